/* renderer/gather*.c: what is gathered, against direct sums. */
#include "profiles.h"

#include "renderer/gather.h"

/* ---- what the tests share ----------------------------------------------------------------------- */

/* A picture of a wavy surface, lit in patches. A sample stands for the light of PATCH_POINTS, three by
 * three. */
enum { SIDE_PX = 96, PATCH_SIDE = 3, PATCH_POINTS = PATCH_SIDE * PATCH_SIDE };
struct scenery {
    struct test_profile profile;
    struct render_band bands[RENDER_BAND_LIMIT];
    int band_count;
    struct render_gather_medium medium;
    struct render_light_sample *samples;
    size_t sample_count;
    double (*points_mm)[PATCH_POINTS][3]; /* of each sample */
    double patch_mm;                      /* a side of it, seen from above */
    double width_mm, step_mm;             /* of the surface; where it has a step, between patches */
    float *position_mm;                   /* as request.position_mm */
    double pixel_mm;
    bool has_slopes;
};

static double height_mm(const struct scenery *scenery, double x_mm, double y_mm)
{
    return 0.08 * scenery->width_mm * sin(7 * x_mm / scenery->width_mm) *
               cos(5 * y_mm / scenery->width_mm) +
           (x_mm > scenery->step_mm ? 0.1 * scenery->width_mm : 0);
}

/* As light samples are: where its light is in the mean, and how far it is spread. */
static void put_together(struct scenery *scenery, size_t index)
{
    struct render_light_sample *const sample = &scenery->samples[index];
    struct render_spread_sums sums = { .weight = 0 };
    for (int p = 0; p < PATCH_POINTS; p++) {
        const double *const at = scenery->points_mm[index][p];
        render_spread_add(&sums, 1, at[0], at[1], at[2]);
    }
    for (int k = 0; k < 3; k++)
        sample->position_mm[k] = (float)(sums.first[k] / sums.weight);
    render_spread_of(&sums, 1, scenery->patch_mm, sample->spread_mm2);
}

/* width_mm: of the picture; a step in the middle, a tenth of it high; a border without objects. */
static void scenery_init(struct scenery *scenery, const char *name, dipole_model model, double width_mm,
                         double merging_error)
{
    scenery->has_slopes = true;
    profile_init(&scenery->profile, name, model, 0.01);
    const struct test_profile *const profile = &scenery->profile;
    const double r_max_mm = fmin(profile->r_max_mm, 2 * width_mm);
    const int side = (int)fmin(ceil(width_mm / profile->spacing_mm), 400);
    scenery->width_mm = width_mm;
    scenery->patch_mm = width_mm / side;
    scenery->step_mm = scenery->patch_mm * round(0.6 * side);
    scenery->profile.source.spread_mm = RENDER_FOOTPRINT_SPREAD * scenery->patch_mm;
    scenery->band_count =
        render_bands_make(render_gather_finest_spacings(merging_error) * profile->spacing_mm, r_max_mm,
                          render_gather_cap_spacings(merging_error), scenery->bands);
    assert_true(render_gather_medium_init(&profile->source, scenery->bands, scenery->band_count,
                                          &scenery->medium, NULL));
    scenery->samples = calloc((size_t)side * (size_t)side, sizeof *scenery->samples);
    scenery->points_mm = calloc((size_t)side * (size_t)side, sizeof *scenery->points_mm);
    scenery->sample_count = 0;
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < side * side; i++) {
        const double x = (i % side + 0.5) * scenery->patch_mm, y = (i / side + 0.5) * scenery->patch_mm;
        if (x > 0.3 * width_mm && x < 0.45 * width_mm)
            continue; /* a shadow */
        const size_t index = scenery->sample_count++;
        for (int p = 0; p < PATCH_POINTS; p++) {
            double *const at = scenery->points_mm[index][p];
            at[0] = x + (p % PATCH_SIDE - 1) * scenery->patch_mm / PATCH_SIDE;
            at[1] = y + (p / PATCH_SIDE - 1) * scenery->patch_mm / PATCH_SIDE;
            at[2] = height_mm(scenery, at[0], at[1]);
        }
        put_together(scenery, index);
        for (int c = 0; c < 3; c++)
            scenery->samples[index].flux_w[c] =
                (float)(scenery->patch_mm * scenery->patch_mm * uniform(&rng, 0.8, 1.2));
    }
    scenery->position_mm = calloc(SIDE_PX * SIDE_PX, 4 * sizeof *scenery->position_mm);
    scenery->pixel_mm = width_mm / SIDE_PX;
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        const int column = i % SIDE_PX, row = i / SIDE_PX;
        const double x = (column + 0.5) * scenery->pixel_mm, y = (row + 0.5) * scenery->pixel_mm;
        if (column < 5 || row < 3)
            continue;
        float *const place = scenery->position_mm + 4 * i;
        place[0] = (float)x;
        place[1] = (float)y;
        place[2] = (float)height_mm(scenery, x, y);
        place[3] = 1;
    }
}

static void scenery_end(struct scenery *scenery)
{
    profile_end(&scenery->profile);
    free(scenery->samples);
    free(scenery->points_mm);
    free(scenery->position_mm);
}

/* codes: of the samples' cubes at rest, or NULL. */
static float *gathered_by(const struct scenery *scenery, const uint64_t *codes, double epsilon,
                          int thread_count, struct render_gather_counts *counts)
{
    float *const radiosity = calloc(SIDE_PX * SIDE_PX, 4 * sizeof *radiosity);
    struct render_gather_sources sources;
    assert_true(render_gather_sources_init(scenery->samples, codes, 0, scenery->sample_count,
                                           scenery->bands, scenery->band_count,
                                           scenery->profile.source.spread_mm, &sources, NULL));
    const struct render_gather_object object = { &scenery->medium, &sources, scenery->pixel_mm };
    const struct render_gather_request request = { .width_px = SIDE_PX,
                                                   .height_px = SIDE_PX,
                                                   .position_mm = scenery->position_mm,
                                                   .objects = &object,
                                                   .object_count = 1,
                                                   .epsilon = epsilon,
                                                   .own_epsilon = 20 * epsilon,
                                                   .thread_count = thread_count,
                                                   .has_slopes = scenery->has_slopes };
    assert_true(render_gather_run(&request, radiosity, counts, NULL));
    render_gather_sources_end(&sources);
    return radiosity;
}

static float *gathered(const struct scenery *scenery, double epsilon, int thread_count,
                       struct render_gather_counts *counts)
{
    return gathered_by(scenery, NULL, epsilon, thread_count, counts);
}

/* As of cell_samples.h: cubes as wide as the finest band's spacing, before anything moves. */
static uint64_t *codes_at_rest(const struct render_light_sample *samples, size_t count, double cell_mm)
{
    const double min_mm[3] = { -100, -100, -100 };
    uint64_t *const codes = calloc(count, sizeof *codes);
    for (size_t i = 0; i < count; i++) {
        const float *const at = samples[i].position_mm;
        const double position_mm[3] = { (double)at[0], (double)at[1], (double)at[2] };
        codes[i] = render_cube_code(position_mm, min_mm, cell_mm);
    }
    return codes;
}

struct error {
    double rmse, max, bias;
};

/* Of every channel, relative to the brightest: direct sums over all points of light at every 83rd pixel. */
static struct error error_of(const struct scenery *scenery, const float *radiosity)
{
    double bias = 0, sum = 0, square = 0, square_expected = 0, largest = 0, brightest = 0;
    for (int i = 0; i < SIDE_PX * SIDE_PX; i += 83) {
        const float *const place = scenery->position_mm + 4 * i;
        double expected[3] = { 0, 0, 0 };
        for (size_t s = 0; s < PATCH_POINTS * scenery->sample_count && place[3] > 0; s++) {
            const struct render_light_sample *const sample = &scenery->samples[s / PATCH_POINTS];
            const double *const at = scenery->points_mm[s / PATCH_POINTS][s % PATCH_POINTS];
            double square_mm2 = 0, rgb[3];
            for (int k = 0; k < 3; k++)
                square_mm2 += pow((double)place[k] - at[k], 2);
            lut_splat_sample(scenery->profile.table, 0, sqrt(square_mm2), rgb);
            for (int c = 0; c < 3; c++)
                expected[c] += (double)sample->flux_w[c] / PATCH_POINTS * rgb[c];
        }
        for (int c = 0; c < 3; c++) {
            const double error = (double)radiosity[4 * i + c] - expected[c];
            bias += error;
            sum += expected[c];
            square += error * error;
            square_expected += expected[c] * expected[c];
            largest = fmax(largest, fabs(error));
            brightest = fmax(brightest, expected[c]);
        }
    }
    return (struct error){ sqrt(square / square_expected), largest / brightest, bias / sum };
}

/* ---- kernels ------------------------------------------------------------------------------------ */

/* Oracle: the split. A band's cubics are within 0.6 % of the profile from that band on. */
static void kernels_follow_the_bands(void **state)
{
    (void)state;
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES };
    for (size_t m = 0; m < BUNDLED_COUNT; m++) {
        struct test_profile profile;
        struct render_band bands[RENDER_BAND_LIMIT];
        struct render_split split;
        profile_init(&profile, bundled[m], models[m % COUNT(models)], 0.01);
        const int count = render_bands_make(0.7 * profile.spacing_mm, profile.r_max_mm, 2, bands);
        assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
        bool has_core = false;
        for (int c = 0; c < 3; c++)
            has_core |= profile.table->rows[0].core_mm[c] > 0;
        for (int b = 0; b < count; b++) {
            struct render_gather_kernel kernel;
            double power = 0, summed = 0;
            render_gather_kernel_init(&split, b, &kernel);
            for (double part = 0.001; part < 1; part += 0.003) {
                const double r_mm = part * bands[b].r_outer_mm;
                const float step_mm[3] = { 0, (float)r_mm, 0 }, spread_mm2[6] = { 0 };
                double expected[3], from[3], at_0[3];
                float found[3];
                render_split_band_per_mm2(&split, b, (double)step_mm[1], expected);
                render_split_from_per_mm2(&split, b, (double)step_mm[1], from);
                render_split_from_per_mm2(&split, 0, 0, at_0);
                render_gather_kernel_at(&kernel, step_mm, spread_mm2, found);
                /* a profile without a value at 0 bends more than a cubic in its first piece; its power is
                 * kept */
                const double tolerance = has_core && b == 0 ? (part < 0.3 ? INFINITY : 0.06) : 6e-3;
                power += r_mm * expected[1];
                summed += r_mm * (double)found[1];
                for (int c = 0; c < 3; c++) {
                    if (fabs((double)found[c] - expected[c]) > tolerance * from[c] + 1e-6 * at_0[c])
                        fail_msg(
                            "%s, band %d of %d at %g of its reach, channel %d: found %g, expected %g of %g",
                            bundled[m], b, count, part, c, (double)found[c], expected[c], from[c]);
                }
            }
            assert_close(summed, power, 3e-3, "power of %s in band %d", bundled[m], b);
        }
        render_split_end(&split);
        profile_end(&profile);
    }
}

/* Mean over a patch in the plane z = 0, whose middle is at 0. */
static double patch_mean_per_mm2(const dipole_stack *stack, const double extents_mm[2],
                                 const float place_mm[3])
{
    enum { PARTS = 24 };
    double r_mm[PARTS * PARTS], values[PARTS * PARTS], sum = 0;
    for (int i = 0; i < PARTS * PARTS; i++) {
        const double x = extents_mm[0] * ((i % PARTS + 0.5) / PARTS - 0.5) - (double)place_mm[0],
                     y = extents_mm[1] * ((0.5 + i / PARTS) / PARTS - 0.5) - (double)place_mm[1];
        r_mm[i] = sqrt(x * x + y * y + (double)place_mm[2] * (double)place_mm[2]);
    }
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, r_mm, PARTS * PARTS, values);
    for (int i = 0; i < PARTS * PARTS; i++)
        sum += values[i] / (PARTS * PARTS);
    return sum;
}

/* Oracle: the integral over the patch. One sample in its middle that knows how far it is spread is nearer
 * to it than one that does not: along the patch, behind it, and between. theory.md T79. */
static void a_patch_is_more_than_a_point(void **state)
{
    (void)state;
    struct test_profile profile;
    struct render_band bands[RENDER_BAND_LIMIT];
    profile_init(&profile, "marble", DIPOLE_MODEL_DIPOLE, 0.01);
    const double h_mm = profile.spacing_mm;
    const double extents_mm[3][2] = { { 0.7 * h_mm, 0.7 * h_mm }, { h_mm, 0.5 * h_mm }, { h_mm, h_mm } };
    const int count = render_bands_make(0.7 * h_mm, profile.r_max_mm, 2, bands);
    double square[2] = { 0, 0 };
    for (int is_spread = 0; is_spread < 2; is_spread++) {
        struct render_gather_medium medium;
        profile.source.spread_mm = is_spread ? RENDER_FOOTPRINT_SPREAD * h_mm : 0;
        const double averaged_mm2 = profile.source.spread_mm * profile.source.spread_mm;
        assert_true(render_gather_medium_init(&profile.source, bands, count, &medium, NULL));
        struct rng rng = { .seed = 11 };
        for (int trial = 0; trial < 600; trial++) {
            const double *const e = extents_mm[trial % 3];
            float spread_mm2[6] = { 0 }, place_mm[3];
            double length2 = 0, way[3], found = 0;
            for (int k = 0; k < 3; k++) {
                way[k] = uniform(&rng, -1, 1);
                if (k == 2 && trial % 2 == 0)
                    way[k] = 0;
                length2 += way[k] * way[k];
                if (is_spread)
                    spread_mm2[k] = (float)((k < 2 ? e[k] * e[k] / 12 : 0) - averaged_mm2);
            }
            const double r_mm = h_mm * uniform(&rng, 1, 6);
            for (int k = 0; k < 3; k++)
                place_mm[k] = (float)(r_mm * way[k] / sqrt(length2));
            for (int b = 0; b < count; b++) {
                float rgb[3];
                render_gather_kernel_at(&medium.kernels[b], place_mm, spread_mm2, rgb);
                found += (double)rgb[1];
            }
            const double expected = patch_mean_per_mm2(profile.medium.stacks[1], e, place_mm);
            square[is_spread] += pow(found / expected - 1, 2) / 600;
        }
    }
    print_message("  points are off by %.2g, patches by %.2g\n", sqrt(square[0]), sqrt(square[1]));
    assert_true(sqrt(square[1]) < 0.25 * sqrt(square[0]));
    profile_end(&profile);
}

/* The largest wave of a lattice of samples, over its mean, and that mean; one whose patches are as wide as
 * they are apart. */
static double wave_of_lattice(const struct render_gather_medium *medium, double width_mm,
                              double averaged_mm2, double reach_mm)
{
    enum { PHASES = 4 };
    const int count = (int)(reach_mm / width_mm);
    const float in_plane = (float)(width_mm * width_mm / 12 - averaged_mm2);
    const float spread_mm2[6] = { averaged_mm2 > 0 ? in_plane : 0, averaged_mm2 > 0 ? in_plane : 0,
                                  (float)-averaged_mm2 };
    double sums[PHASES * PHASES] = { 0 }, mean = 0, largest = 0;
    for (int p = 0; p < PHASES * PHASES; p++) {
        for (int i = -count; i <= count; i++) {
            for (int j = -count; j <= count; j++) {
                const float place_mm[3] = { (float)(width_mm * (i + (double)(p % PHASES) / PHASES)),
                                            (float)(width_mm * (j + (double)(p / PHASES) / PHASES)), 0 };
                float rgb[3];
                for (int b = 0; b < medium->band_count; b++) {
                    render_gather_kernel_at(&medium->kernels[b], place_mm, spread_mm2, rgb);
                    sums[p] += (double)rgb[1];
                }
            }
        }
        mean += sums[p] / (PHASES * PHASES);
    }
    for (int p = 0; p < PHASES * PHASES; p++)
        largest = fmax(largest, fabs(sums[p] / mean - 1));
    return largest;
}

/* Oracle: what a lattice of samples sums. Of points the waves are T11's; of patches, which know how wide
 * they are, T82's, a tenth to a fifth of that. */
static void patches_in_rows_hardly_alias(void **state)
{
    (void)state;
    static const double parts[] = { 1, 0.84, 0.7 };
    struct test_profile profile;
    struct render_band bands[RENDER_BAND_LIMIT];
    profile_init(&profile, "marble", DIPOLE_MODEL_DIPOLE, 0.1);
    const double h_mm = profile.spacing_mm;
    const int count = render_bands_make(0.7 * h_mm, profile.r_max_mm, 2, bands);
    const dipole_stack *const stack = profile.medium.stacks[1];
    for (int is_spread = 0; is_spread < 2; is_spread++) {
        struct render_gather_medium medium;
        const struct render_footprint_kernel kernel = { .spread_mm = is_spread
                                                                         ? RENDER_FOOTPRINT_SPREAD * h_mm
                                                                         : 0 };
        profile.source.spread_mm = kernel.spread_mm;
        assert_true(render_gather_medium_init(&profile.source, bands, count, &medium, NULL));
        double worst = 0;
        for (int i = 0; i < 3; i++)
            worst = fmax(worst, wave_of_lattice(&medium, parts[i] * h_mm,
                                                kernel.spread_mm * kernel.spread_mm, profile.r_max_mm));
        const double bound = render_footprint_aliasing(stack, h_mm, &kernel);
        print_message("  %s: %.2g, at most %.2g\n", is_spread ? "patches" : "points", worst, bound);
        /* the next waves add some; kernels err by a thousandth */
        assert_true(worst < 1.2 * bound + 1e-3 && worst > 0.5 * bound);
    }
    profile_end(&profile);
}

/* Oracle: the portable loops. Those of this processor choose the same sources, and sum the same to float's
 * precision. */
static void loops_agree(void **state)
{
    (void)state;
    struct test_profile profile;
    struct render_band bands[RENDER_BAND_LIMIT];
    struct render_split split;
    struct render_gather_kernel kernel;
    struct rng rng = { .seed = 3 };
    profile_init(&profile, "skin1", DIPOLE_MODEL_DIPOLE, 0.01);
    const int count = render_bands_make(profile.spacing_mm, profile.r_max_mm, 2, bands);
    assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
    render_gather_kernel_init(&split, 1, &kernel);
    const double reach_mm = bands[1].r_outer_mm;
    const struct render_gather_loops *const plain = &render_gather_loops_portable,
                                            *const best = render_gather_loops_best();
    for (int trial = 0; trial < 2000; trial++) {
        struct render_gather_group group;
        struct render_gather_places places = { .sums = { { 0 } } };
        const struct render_gather_source *list[RENDER_GATHER_LANES];
        struct render_gather_box box;
        for (int i = 0; i < RENDER_GATHER_LANES; i++) {
            group.sources[i] = (struct render_gather_source){ .flux_w = { 1, 2, 3 } };
            for (int k = 0; k < 6; k++)
                group.sources[i].spread_mm2[k] = (float)uniform(&rng, 0, 0.01 * reach_mm * reach_mm);
            for (int k = 0; k < 3; k++) {
                group.sources[i].position_mm[k] = group.position_mm[k][i] =
                    (float)uniform(&rng, -reach_mm, reach_mm);
                places.position_mm[k][i] = (float)uniform(&rng, -reach_mm, reach_mm);
                box.min_mm[k] = (float)uniform(&rng, -reach_mm, 0);
                box.max_mm[k] = (float)uniform(&rng, 0, reach_mm);
            }
            list[i] = &group.sources[i];
        }
        for (int k = 0; k < 3; k++)
            group.position_mm[k][7] = INFINITY; /* as those that fill a group up */
        const float reach2_mm2 = (float)uniform(&rng, 0, reach_mm * reach_mm);
        const unsigned bits = plain->near(&group, &box, reach2_mm2);
        assert_int_equal(bits & 0x80, 0);
        assert_int_equal(best->near(&group, &box, reach2_mm2), bits);
        enum { LISTED = 2 * RENDER_GATHER_LANES };
        const struct render_gather_source *listed[2][LISTED];
        const uint32_t numbers[3] = { 0, 0, 0 };
        size_t counts[2] = { 1, 1 };
        const size_t looked_at =
            plain->list(&group, numbers, 3, &box, reach2_mm2, listed[0], &counts[0], LISTED);
        assert_int_equal(best->list(&group, numbers, 3, &box, reach2_mm2, listed[1], &counts[1], LISTED),
                         looked_at);
        assert_int_equal(counts[0], 1 + looked_at * (size_t)__builtin_popcount(bits));
        assert_int_equal(counts[1], counts[0]);
        for (size_t i = 1; i < counts[0]; i++)
            assert_ptr_equal(listed[0][i], listed[1][i]);
        struct render_gather_places others = places, with_slopes = places, others_with = places;
        plain->sum(&kernel, list, RENDER_GATHER_LANES, &places);
        best->sum(&kernel, list, RENDER_GATHER_LANES, &others);
        plain->sum_with_slopes(&kernel, list, RENDER_GATHER_LANES, &with_slopes);
        best->sum_with_slopes(&kernel, list, RENDER_GATHER_LANES, &others_with);
        assert_memory_equal(places.sums, with_slopes.sums, sizeof places.sums);
        for (int c = 0; c < 3; c++) {
            const float most = fabsf(kernel.terms[c][0][6]);
            for (int i = 0; i < RENDER_GATHER_LANES; i++) {
                assert_true(fabsf(places.sums[c][i] - others.sums[c][i]) <= 1e-5f * most);
                assert_true(fabsf(places.sums[c][i] - others_with.sums[c][i]) <= 1e-5f * most);
                for (int k = 0; k < 3; k++)
                    assert_true(fabsf(with_slopes.slopes[c][k][i] - others_with.slopes[c][k][i]) <=
                                1e-4f * most / (float)reach_mm);
            }
        }
    }
    render_split_end(&split);
    profile_end(&profile);
}

/* Oracle: the sums channel by channel, to the last bit, where channels scatter alike; others are no grey.
 */
static void grey_is_summed_once(void **state)
{
    (void)state;
    struct rng rng = { .seed = 4 };
    for (int is_grey = 0; is_grey <= 1; is_grey++) {
        struct io_material material = read_bundled("skin1", 1);
        struct test_profile profile;
        struct render_band bands[RENDER_BAND_LIMIT];
        struct render_split split;
        struct render_gather_kernel kernel;
        for (int c = 1; c < IO_CHANNEL_COUNT && is_grey; c++)
            memcpy(material.layers[c], material.layers[0], sizeof material.layers[0]);
        profile_init_of(&profile, &material, 0.01);
        const int count = render_bands_make(profile.spacing_mm, profile.r_max_mm, 2, bands);
        assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
        render_gather_kernel_init(&split, 1, &kernel);
        assert_int_equal(kernel.is_grey, is_grey);
        struct render_gather_source source = { .flux_w = { 1, 0.2f, 3 } };
        struct render_gather_places places = { .sums = { { 0 } } };
        const struct render_gather_source *const list[1] = { &source };
        for (int k = 0; k < 6; k++)
            source.spread_mm2[k] = (float)uniform(&rng, 0, 0.1);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < RENDER_GATHER_LANES; i++)
                places.position_mm[k][i] = (float)uniform(&rng, 0, 0.5 * bands[1].r_outer_mm);
        }
        struct render_gather_places once = places, with_slopes = places, once_with = places;
        render_gather_loops_best()->sum(&kernel, list, 1, &once);
        render_gather_loops_best()->sum_with_slopes(&kernel, list, 1, &once_with);
        kernel.is_grey = false;
        render_gather_loops_best()->sum(&kernel, list, 1, &places);
        render_gather_loops_best()->sum_with_slopes(&kernel, list, 1, &with_slopes);
        assert_memory_equal(once.sums, places.sums, sizeof places.sums);
        assert_memory_equal(once_with.sums, with_slopes.sums, sizeof places.sums);
        assert_memory_equal(once_with.slopes, with_slopes.slopes, sizeof places.slopes);
        assert_true(places.sums[1][0] > 0);
        render_split_end(&split);
        profile_end(&profile);
    }
}

/* Oracle: differences of the sums of a source that is spread the same in a plane, which is all that slopes
 * know, at places of the plane. Second derivatives of piecewise cubics jump by a few per cent of the slope.
 */
static void slopes_are_differences(void **state)
{
    (void)state;
    struct test_profile profile;
    struct render_band bands[RENDER_BAND_LIMIT];
    struct render_split split;
    struct rng rng = { .seed = 21 };
    profile_init(&profile, "marble", DIPOLE_MODEL_DIPOLE, 0.01);
    const int count = render_bands_make(profile.spacing_mm, profile.r_max_mm, 2, bands);
    assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
    for (int b = 1; b + 1 < count; b++) { /* the last ends at r_max with a step */
        struct render_gather_kernel kernel;
        render_gather_kernel_init(&split, b, &kernel);
        const double cap_mm = bands[b].cap_mm;
        const float spread_mm2 = (float)(bands[b].spacing_mm * bands[b].spacing_mm / 12);
        const struct render_gather_source source = { .flux_w = { 1, 1, 1 },
                                                     .spread_mm2 = { spread_mm2, spread_mm2, 0 } };
        const struct render_gather_source *const list[1] = { &source };
        double square[3] = { 0, 0, 0 }, error[3] = { 0, 0, 0 };
        for (int trial = 0; trial < 500; trial++) {
            const double angle = uniform(&rng, 0, 6.28), r_mm = uniform(&rng, 0.1, 1.5) * cap_mm;
            const double h_mm = 0.1 * cap_mm;
            struct render_gather_places places = { .sums = { { 0 } } };
            for (int i = 0; i < RENDER_GATHER_LANES; i++) {
                const double far_mm = r_mm + (i == 1 ? -h_mm : i == 2 ? h_mm : 0);
                places.position_mm[0][i] = (float)(far_mm * cos(angle));
                places.position_mm[1][i] = (float)(far_mm * sin(angle));
            }
            render_gather_loops_portable.sum_with_slopes(&kernel, list, 1, &places);
            for (int c = 0; c < 3; c++) {
                const double expected =
                    ((double)places.sums[c][2] - (double)places.sums[c][1]) / (2 * h_mm);
                const double found = (double)places.slopes[c][0][0] * cos(angle) +
                                     (double)places.slopes[c][1][0] * sin(angle);
                square[c] += expected * expected;
                error[c] += (found - expected) * (found - expected);
            }
        }
        for (int c = 0; c < 3; c++)
            assert_true(sqrt(error[c] / square[c]) < 0.06);
    }
    render_split_end(&split);
    profile_end(&profile);
}

/* ---- sources ------------------------------------------------------------------------------------ */

/* Whether the cubes are those of the frame or those at rest. */
static void check_moments(bool has_codes)
{
    enum { COUNT_OF_SAMPLES = 5003 };
    struct rng rng = { .seed = 8 };
    struct render_light_sample *const samples = calloc(COUNT_OF_SAMPLES, sizeof *samples);
    struct render_band bands[RENDER_BAND_LIMIT];
    struct render_gather_sources sources;
    double expected[10] = { 0 };
    for (int i = 0; i < COUNT_OF_SAMPLES; i++) {
        for (int k = 0; k < 3; k++) {
            samples[i].position_mm[k] = (float)uniform(&rng, -20, 20);
            samples[i].flux_w[k] = (float)uniform(&rng, 0, 1);
        }
    }
    const int count = render_bands_make(0.3, 60, 2, bands);
    uint64_t *const codes = has_codes ? codes_at_rest(samples, COUNT_OF_SAMPLES, 0.3) : NULL;
    assert_true(
        render_gather_sources_init(samples, codes, 0, COUNT_OF_SAMPLES, bands, count, 0, &sources, NULL));
    for (int b = -1; b < count; b++) {
        double sums[10] = { 0 };
        const size_t source_count = b < 0 ? COUNT_OF_SAMPLES : sources.levels[b].source_count;
        for (size_t i = 0; i < source_count; i++) {
            struct render_gather_source source = { .spread_mm2 = { 0 } };
            if (b < 0) {
                memcpy(source.position_mm, samples[i].position_mm, sizeof source.position_mm);
                memcpy(source.flux_w, samples[i].flux_w, sizeof source.flux_w);
            } else {
                source = sources.levels[b].groups[i / RENDER_GATHER_LANES].sources[i % RENDER_GATHER_LANES];
            }
            const double weight =
                (double)source.flux_w[0] + (double)source.flux_w[1] + (double)source.flux_w[2];
            sums[0] += weight;
            for (int k = 0; k < 3; k++) {
                const double x = (double)source.position_mm[k], y = (double)source.position_mm[(k + 1) % 3];
                static const int mixed[3] = { 5, 3, 4 }; /* xy yz zx */
                sums[1 + k] += weight * x;
                sums[4 + k] += weight * (x * x + (double)source.spread_mm2[k]);
                sums[7 + k] += weight * (x * y + (double)source.spread_mm2[mixed[k]]);
            }
        }
        for (int i = 0; i < 10; i++) {
            if (b < 0)
                expected[i] = sums[i];
            else /* float, of values up to 20 mm from 0 */
                assert_true(fabs(sums[i] - expected[i]) <= 1e-5 * 400 * expected[0]);
        }
        if (b > 0)
            assert_true(sources.levels[b].source_count < sources.levels[b - 1].source_count);
    }
    render_gather_sources_end(&sources);
    free(samples);
    free(codes);
}

/* Oracle: sums over the samples. Whatever is merged, power, its first and its second moments stay. */
static void merging_keeps_moments(void **state)
{
    (void)state;
    check_moments(false);
    check_moments(true);
}

/* Oracle: every group, one after the other. The tree finds just those whose samples' box is near. */
static void the_tree_misses_nothing(void **state)
{
    (void)state;
    struct rng rng = { .seed = 12 };
    for (int count = 0; count < 3000; count = 3 * count + 1) {
        struct render_light_sample *const samples = calloc((size_t)count + 1, sizeof *samples);
        struct render_band bands[RENDER_BAND_LIMIT];
        struct render_gather_sources sources;
        uint32_t found[4000];
        for (int i = 0; i < count; i++) {
            for (int k = 0; k < 3; k++) {
                samples[i].position_mm[k] = (float)uniform(&rng, -20, 20);
                samples[i].flux_w[k] = 1;
            }
        }
        const int band_count = render_bands_make(0.01, 60, 2, bands);
        assert_true(render_gather_sources_init(samples, NULL, 0, (size_t)count, bands, band_count, 0,
                                               &sources, NULL));
        for (int trial = 0; trial < 50; trial++) {
            struct render_gather_box box;
            const float reach_mm = (float)log_uniform(&rng, 0.1, 30);
            const struct render_gather_level *const level = &sources.levels[0];
            for (int k = 0; k < 3; k++) {
                box.min_mm[k] = (float)uniform(&rng, -25, 20);
                box.max_mm[k] = box.min_mm[k] + (float)uniform(&rng, 0, 5);
            }
            const size_t found_count = render_gather_find(level, &box, reach_mm, found, COUNT(found));
            size_t next = 0;
            for (size_t g = 0; g < level->group_count; g++) {
                const bool is_found = next < found_count && found[next] == g;
                next += is_found;
                if (!is_found)
                    assert_int_equal(
                        render_gather_loops_portable.near(&level->groups[g], &box, reach_mm * reach_mm), 0);
            }
            assert_int_equal(next, found_count);
        }
        render_gather_sources_end(&sources);
        free(samples);
    }
}

/* ---- pictures ----------------------------------------------------------------------------------- */

/* Oracle: direct sums over all samples. Errors stay below those that the plan states (0.28 % of banding and
 * 0.1 % of interpolation at epsilon = 0.01, relative RMSE; three times that at the worst pixel), near
 * steps, too. */
static void sums_are_right(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        dipole_model model;
        double width_mm;
    } cases[] = { { "marble", DIPOLE_MODEL_DIPOLE, 30 },    { "marble", DIPOLE_MODEL_BEAM, 30 },
                  { "ketchup", DIPOLE_MODEL_DIPOLE, 60 },   { "skin1", DIPOLE_MODEL_DIPOLE, 10 },
                  { "wholemilk", DIPOLE_MODEL_DIPOLE, 40 }, { "skimmilk", DIPOLE_MODEL_DIPOLE, 4 },
                  { "spectralon", DIPOLE_MODEL_DIPOLE, 5 }, { "apple", DIPOLE_MODEL_BETTER_DIPOLE, 40 } };
    for (size_t run = 0; run < 2 * COUNT(cases); run++) {
        const size_t i = run / 2;
        struct scenery scenery;
        struct render_gather_counts counts;
        scenery_init(&scenery, cases[i].name, cases[i].model, cases[i].width_mm, 0.0028);
        scenery.has_slopes = run % 2 == 1;
        float *const radiosity = gathered(&scenery, 0.001, 0, &counts);
        const struct error error = error_of(&scenery, radiosity);
        print_message(
            "  %-10s %3g mm, %6zu samples, %d bands: rmse %.2e, max %.2e, bias %+.1e; %zu places, %zu "
            "refined, %zu sums\n",
            cases[i].name, cases[i].width_mm, scenery.sample_count, scenery.band_count, error.rmse,
            error.max, error.bias, counts.place_count, counts.refined_count, counts.evaluation_count);
        assert_true(error.rmse < 0.0038);
        assert_true(error.max < 3 * 0.0038);
        assert_true(fabs(error.bias) < 1.5e-3); /* of 48 samples, 1.2e-3 */
        free(radiosity);
        scenery_end(&scenery);
    }
}

/* About a skew axis through the origin, and a step aside. */
static void turn_point(double angle_rad, double at_mm[3])
{
    const double axis[3] = { 2.0 / 7, 3.0 / 7, 6.0 / 7 }, c = cos(angle_rad), s = sin(angle_rad);
    const double x[3] = { at_mm[0], at_mm[1], at_mm[2] };
    const double along = axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2];
    for (int k = 0; k < 3; k++) {
        const double across = axis[(k + 1) % 3] * x[(k + 2) % 3] - axis[(k + 2) % 3] * x[(k + 1) % 3];
        at_mm[k] = c * x[k] + s * across + (1 - c) * along * axis[k] + 1.234;
    }
}

static void turn(struct scenery *scenery, double angle_rad)
{
    for (size_t i = 0; i < scenery->sample_count; i++) {
        for (int p = 0; p < PATCH_POINTS; p++)
            turn_point(angle_rad, scenery->points_mm[i][p]);
        put_together(scenery, i);
    }
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        double at_mm[3];
        for (int k = 0; k < 3; k++)
            at_mm[k] = (double)scenery->position_mm[4 * i + k];
        turn_point(angle_rad, at_mm);
        for (int k = 0; k < 3; k++)
            scenery->position_mm[4 * i + k] = (float)at_mm[k];
    }
}

static double spacing_of(const char *name)
{
    struct test_profile profile;
    profile_init(&profile, name, DIPOLE_MODEL_DIPOLE, 0.01);
    const double spacing_mm = profile.spacing_mm;
    profile_end(&profile);
    return spacing_mm;
}

/* Oracle: direct sums over all samples. What merging and cubics err by is what the plan says for caps so
 * wide, whatever the material, however the surface lies in the cubes, and at the edges of light. */
static void merging_errs_as_planned_at_any_angle(void **state)
{
    (void)state;
    static const double errors[] = { 3.4e-3, 2.8e-3, 1.4e-3, 8.4e-4 };
    struct rng rng = { .seed = 21 };
    for (size_t m = 0; m < BUNDLED_COUNT; m++) {
        for (size_t e = 0; e < COUNT(errors); e++) {
            struct scenery scenery;
            struct render_gather_counts counts;
            const double width_mm = spacing_of(bundled[m]) * log_uniform(&rng, 20, 60);
            scenery_init(&scenery, bundled[m], DIPOLE_MODEL_DIPOLE, width_mm, errors[e]);
            turn(&scenery, uniform(&rng, 0.2, 6)); /* cubes cut the surface at all angles */
            float *const radiosity = gathered(&scenery, 0, 0, &counts);
            const struct error error = error_of(&scenery, radiosity);
            print_message("  %-12s %4.1f mm, %6zu samples, caps of %.2f spacings: rmse %.2e of %.0e, max "
                          "%.2e, bias %+.1e\n",
                          bundled[m], width_mm, scenery.sample_count, render_gather_cap_spacings(errors[e]),
                          error.rmse, errors[e], error.max, error.bias);
            assert_true(error.rmse <= errors[e]);
            assert_true(error.max <= 6 * errors[e]);
            free(radiosity);
            scenery_end(&scenery);
        }
    }
}

/* Oracle: what is asked. Less error is allowed, more is summed; with none, nothing is interpolated. */
static void interpolation_follows_epsilon(void **state)
{
    (void)state;
    static const double epsilons[] = { 0.01, 0.001, 0 };
    struct scenery scenery;
    size_t before = 0;
    scenery_init(&scenery, "wholemilk", DIPOLE_MODEL_DIPOLE, 10, 0.003);
    for (size_t i = 0; i < COUNT(epsilons); i++) {
        struct render_gather_counts counts;
        float *const radiosity = gathered(&scenery, epsilons[i], 1, &counts);
        assert_true(counts.evaluation_count > before);
        before = counts.evaluation_count;
        if (epsilons[i] == 0) {
            assert_int_equal(counts.place_count, (SIDE_PX - 5) * (SIDE_PX - 3));
            assert_int_equal(counts.refined_count, 0);
        }
        free(radiosity);
    }
    scenery_end(&scenery);
}

/* Largest difference between two pictures, over the brightest value. */
static double largest_difference(const float *a, const float *b)
{
    double largest = 0, brightest = 0;
    for (int i = 0; i < 4 * SIDE_PX * SIDE_PX; i++) {
        largest = fmax(largest, fabs((double)a[i] - (double)b[i]));
        brightest = fmax(brightest, (double)a[i]);
    }
    return largest / brightest;
}

/* Oracle: the same scene before it moved. Samples that are merged by their cubes at rest give the same sums
 * at the same places of the surface wherever it is, but for rounding of positions to floats, which may take
 * one to the next cubic, or out of reach (3e-4); by cubes of the frame other samples are merged, which
 * changes sums by 0.2 % and more. Errors are as above. */
static void merging_at_rest_moves_with_the_surface(void **state)
{
    (void)state;
    static const char *const names[] = { "marble", "skin1", "ketchup" };
    for (size_t i = 0; i < COUNT(names); i++) {
        struct scenery scenery;
        scenery_init(&scenery, names[i], DIPOLE_MODEL_DIPOLE, 20, 0.0028);
        uint64_t *const codes =
            codes_at_rest(scenery.samples, scenery.sample_count, scenery.bands[0].spacing_mm);
        float *const rest[2] = { gathered_by(&scenery, NULL, 0, 0, NULL),
                                 gathered_by(&scenery, codes, 0, 0, NULL) };
        for (int step = 1; step <= 2; step++) {
            turn(&scenery, 0.3);
            float *const moved[2] = { gathered_by(&scenery, NULL, 0, 0, NULL),
                                      gathered_by(&scenery, codes, 0, 0, NULL) };
            const double by_frame = largest_difference(rest[0], moved[0]),
                         at_rest = largest_difference(rest[1], moved[1]);
            const struct error error = error_of(&scenery, moved[1]);
            print_message("  %-8s moves by %.1e by the frame's cubes, %.1e by those at rest, rmse %.1e\n",
                          names[i], by_frame, at_rest, error.rmse);
            assert_true(at_rest < 5e-4);
            assert_true(by_frame > 2e-3);
            assert_true(error.rmse < 0.0038);
            free(moved[0]);
            free(moved[1]);
        }
        free(rest[0]);
        free(rest[1]);
        free(codes);
        scenery_end(&scenery);
    }
}

/* Oracle: one thread. Not a bit depends on how many there are. */
static void threads_change_nothing(void **state)
{
    (void)state;
    struct scenery scenery;
    scenery_init(&scenery, "marble", DIPOLE_MODEL_DIPOLE, 20, 0.003);
    float *const one = gathered(&scenery, 0.002, 1, NULL), *const four = gathered(&scenery, 0.002, 4, NULL);
    assert_memory_equal(one, four, SIDE_PX * SIDE_PX * 4 * sizeof *one);
    free(one);
    free(four);
    scenery_end(&scenery);
}

/* Oracle: no light is dark, no object is 0, an object's light is its own. */
static void light_stays_in_its_object(void **state)
{
    (void)state;
    struct scenery scenery;
    struct render_gather_sources lit, dark;
    scenery_init(&scenery, "marble", DIPOLE_MODEL_DIPOLE, 20, 0.003);
    assert_true(render_gather_sources_init(scenery.samples, NULL, 0, scenery.sample_count, scenery.bands,
                                           scenery.band_count, 0, &lit, NULL));
    assert_true(
        render_gather_sources_init(NULL, NULL, 0, 0, scenery.bands, scenery.band_count, 0, &dark, NULL));
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        if (scenery.position_mm[4 * i + 3] > 0)
            scenery.position_mm[4 * i + 3] =
                (float)(1 + i % SIDE_PX / 7 % 3); /* stripes of three objects */
    }
    const struct render_gather_object objects[] = { { &scenery.medium, &lit, scenery.pixel_mm },
                                                    { &scenery.medium, &dark, scenery.pixel_mm },
                                                    { NULL, NULL, 0 } };
    const struct render_gather_request request = { .width_px = SIDE_PX,
                                                   .height_px = SIDE_PX,
                                                   .position_mm = scenery.position_mm,
                                                   .objects = objects,
                                                   .object_count = 3,
                                                   .epsilon = 0.002,
                                                   .own_epsilon = 0.04,
                                                   .has_slopes = true };
    float *const radiosity = calloc(SIDE_PX * SIDE_PX, 4 * sizeof *radiosity);
    assert_true(render_gather_run(&request, radiosity, NULL, NULL));
    for (int i = 0; i < SIDE_PX * SIDE_PX; i++) {
        const bool is_lit = scenery.position_mm[4 * i + 3] == 1;
        for (int c = 0; c < 3; c++)
            assert_true(is_lit ? radiosity[4 * i + c] > 0 : radiosity[4 * i + c] == 0);
    }
    free(radiosity);
    render_gather_sources_end(&lit);
    render_gather_sources_end(&dark);
    scenery_end(&scenery);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_follow_the_bands),
        cmocka_unit_test(a_patch_is_more_than_a_point),
        cmocka_unit_test(patches_in_rows_hardly_alias),
        cmocka_unit_test(grey_is_summed_once),
        cmocka_unit_test(loops_agree),
        cmocka_unit_test(slopes_are_differences),
        cmocka_unit_test(merging_keeps_moments),
        cmocka_unit_test(the_tree_misses_nothing),
        cmocka_unit_test(sums_are_right),
        cmocka_unit_test(merging_errs_as_planned_at_any_angle),
        cmocka_unit_test(interpolation_follows_epsilon),
        cmocka_unit_test(merging_at_rest_moves_with_the_surface),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(light_stays_in_its_object),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
