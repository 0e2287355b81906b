/* lutgen/tsm.c, tsm_plan.c, tsm_sample.c, tsm_audit.c: volumes for translucent shadow maps in memory. */
#include "tsm_check.h"

#if defined(__SANITIZE_ADDRESS__)
enum { PARTS = 60, DEPTHS = 3, MATERIAL_STEP = 4 };
#else
enum { PARTS = 150, DEPTHS = 12, MATERIAL_STEP = 1 };
#endif

static void assert_not_baked(const struct lut_request *request, dipole_code code, const char *message)
{
    struct lut_tsm *lut = NULL;
    dipole_status status = { 0 };
    assert_false(lut_tsm_bake(request, 2, &lut, &status));
    assert_null(lut);
    assert_int_equal(status.code, code);
    if (!strstr(status.message, message))
        fail_msg("\"%s\" is not in \"%s\"", message, status.message);
}

/* ---- texels --------------------------------------------------------------------------------------- */

/* What arrives at to_mm when light enters at the origin through a surface with that normal. */
static double between(const dipole_sources *sources, const double normal[3], const double to_mm[3])
{
    static const double origin[3];
    return dipole_sources_between_per_mm2(sources, origin, normal, to_mm);
}

/* Integral over a triangle a, b, c of what arrives height_mm above (below: negative) a surface across the
 * light: the midpoint rule in (x, y) of a + x (b - a + y (c - b)). */
static double triangle_power(const dipole_sources *sources, const double *a, const double *b,
                             const double *c, double scale_mm, double height_mm)
{
    static const double up[3] = { 0, 0, 1 };
    const double cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    double sum = 0;
    for (int i = 0; i < PARTS && cross != 0; i++)
        for (int k = 0; k < PARTS; k++) {
            const double x = (i + 0.5) / PARTS, y = (k + 0.5) / PARTS;
            const double to_mm[3] = { scale_mm * (a[0] + x * (b[0] - a[0] + y * (c[0] - b[0]))),
                                      scale_mm * (a[1] + x * (b[1] - a[1] + y * (c[1] - b[1]))),
                                      height_mm };
            sum += x * between(sources, up, to_mm);
        }
    return sum * cross * scale_mm * scale_mm / PARTS / PARTS;
}

/* Means over all cells by brute force; the outermost take what falls beyond, by the closed form of all. */
static void means_by_force(const dipole_sources *sources, const struct lut_tsm *lut, double dz_mm,
                           double *means)
{
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    const int count = lut_pattern_cells(lut->size[2], cells);
    double rest = dipole_sources_within(sources, -dz_mm, INFINITY), outermost = 0;
    for (int i = 0; i < count; i++) {
        const double(*const p)[2] = (const double(*)[2])cells[i].corners;
        const double power = triangle_power(sources, p[0], p[1], p[2], lut->inner_mm, -dz_mm) +
                             triangle_power(sources, p[0], p[2], p[3], lut->inner_mm, -dz_mm);
        means[i] = power / lut->samples[i].area_mm2;
        rest -= power;
        outermost += cells[i].is_outermost ? power : 0;
    }
    for (int i = 0; i < count; i++)
        if (cells[i].is_outermost)
            means[i] *= 1 + fmax(rest, 0) / outermost;
}

/* The response of a sample where the surface's normal has that cosine with D = x_out - x_in. */
static double response_by_force(const dipole_sources *sources, const struct lut_tsm *lut, int sample,
                                double cosine, double dz_mm, double mean)
{
    static const double up[3] = { 0, 0, 1 };
    const double d_mm[3] = { -lut->samples[sample].offset_mm[0], -lut->samples[sample].offset_mm[1],
                             -dz_mm };
    const double length = sqrt(d_mm[0] * d_mm[0] + d_mm[1] * d_mm[1] + d_mm[2] * d_mm[2]);
    if (length == 0)
        return mean; /* left to the local response */
    double normal[3], across[3], across_length = 0, along = 0;
    static const double any[3] = { 0.36, 0.48, 0.8 };
    for (int k = 0; k < 3; k++)
        along += any[k] * d_mm[k] / length;
    for (int k = 0; k < 3; k++) {
        across[k] = any[k] - along * d_mm[k] / length;
        across_length += across[k] * across[k];
    }
    across_length = sqrt(across_length);
    const double sine = sqrt(fmax(1 - cosine * cosine, 0));
    for (int k = 0; k < 3; k++)
        normal[k] = cosine * d_mm[k] / length + sine * across[k] / across_length;
    return mean * between(sources, normal, d_mm) / between(sources, up, d_mm);
}

/* Marble's two sources, which are exact whatever is asked for. */
static void marble_sources(const struct io_material *marble, int channel, dipole_sources *sources)
{
    dipole_stack *const stack = stack_of(marble, channel);
    assert_true(dipole_sources_init(stack, 0.01, 0.1, 10, sources, NULL));
    dipole_stack_destroy(stack);
}

/* Oracle: T32 in its own words, by integration over the cells. Found 3e-5, most of it the oracle's; a cell
 * far out has 8 nodes on each edge. */
static void texels_are_means_over_their_cells(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    const struct io_material marble = read_bundled("marble", 1);
    struct lut_request request = tsm_request(&marble, 0.5, false);
    request.size[0] = 33;
    request.size[1] = 65; /* one node is at depth 0 */
    struct lut_tsm *const lut = tsm_bake(&request);
    assert_int_equal(lut->sample_count, 21);
    for (int i = 0; i < DEPTHS; i++) {
        const int c = i % 3, t = i == 0 ? 32 : (int)(random_bits(&rng) % 65);
        const double dz_mm = lut_tsm_depth_mm(lut, t);
        dipole_sources sources;
        double means[LUT_TSM_SAMPLE_LIMIT];
        marble_sources(&marble, c, &sources);
        means_by_force(&sources, lut, dz_mm, means);
        for (int r = 0; r < lut->sample_count; r++)
            for (int s = 0; s < 33; s += 4) {
                const double part = r < 5 ? 1 - lut_tsm_proximity(lut, dz_mm) : 1;
                const double expected =
                    part * response_by_force(&sources, lut, r, s / 16.0 - 1, dz_mm, means[r]);
                assert_close((double)lut_tsm_texel(lut, s, t, r)[c], expected, PARTS > 100 ? 1e-4 : 1e-3,
                             "channel %d, sample %d, depth %g mm, cosine %g", c, r, dz_mm, s / 16.0 - 1);
            }
    }
    lut_tsm_destroy(lut);
}

/* Oracle: the same between the nodes, within the stated error: of the response, and of no less than the
 * profile at r_max(0.03). */
static void samples_between_keep_the_error(void **state)
{
    (void)state;
    struct rng rng = { .seed = 2 };
    const struct io_material marble = read_bundled("marble", 1);
    const struct lut_request request = tsm_request(&marble, 0.05, false);
    struct lut_tsm *const lut = tsm_bake(&request);
    for (int i = 0; i < DEPTHS; i++) {
        const int c = i % 3;
        const double dz_mm = lut->depth_max_mm * uniform(&rng, -1, 1);
        dipole_sources sources;
        double means[LUT_TSM_SAMPLE_LIMIT];
        marble_sources(&marble, c, &sources);
        means_by_force(&sources, lut, dz_mm, means);
        const dipole_coefficients k = coefficients_of(&marble, c);
        const double floor = dipole_rd_per_mm2(&k, dipole_r_max_mm(&k, 0.03));
        for (int n = 0; n < 2000; n++) {
            const int r = (int)(random_bits(&rng) % 21);
            const double cosine = uniform(&rng, -1, 1);
            const double part = r < 5 ? 1 - lut_tsm_proximity(lut, dz_mm) : 1;
            const double whole = response_by_force(&sources, lut, r, cosine, dz_mm, means[r]);
            double rgb[IO_CHANNEL_COUNT];
            lut_tsm_sample(lut, r, cosine, dz_mm, rgb);
            const double error = fabs(rgb[c] - part * whole) / fmax(whole, floor);
            if (!(error <= lut->error.max))
                fail_msg("sample %d, depth %g mm, cosine %g: error %g, stated %g", r, dz_mm, cosine, error,
                         lut->error.max);
        }
    }
    for (int r = 0; r < 21; r++) { /* and ends */
        double rgb[IO_CHANNEL_COUNT];
        lut_tsm_sample(lut, r, 0, nextafter(lut->depth_max_mm, INFINITY), rgb);
        assert_true(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    }
    lut_tsm_destroy(lut);
}

/* Oracle: integration over the cells of the kernel, at depth 0. */
static void the_kernel_is_means_over_its_cells(void **state)
{
    (void)state;
    const struct io_material marble = read_bundled("marble", 1);
    const struct lut_request request = tsm_request(&marble, 0.1, false);
    struct lut_tsm *const lut = tsm_bake(&request);
    const double side = 1.0 / LUT_TSM_LOCAL_SIDE, area_mm2 = pow(side * lut->inner_mm, 2);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_sources sources;
        marble_sources(&marble, c, &sources);
        for (int i = -3; i <= 3; i++)
            for (int j = -3; j <= 3; j++) {
                const double u = (i - 0.5) * side, v = (j - 0.5) * side;
                const double p[4][2] = {
                    { u, v }, { u + side, v }, { u + side, v + side }, { u, v + side }
                };
                const double power = triangle_power(&sources, p[0], p[1], p[2], lut->inner_mm, 0) +
                                     triangle_power(&sources, p[0], p[2], p[3], lut->inner_mm, 0);
                double rgb[IO_CHANNEL_COUNT];
                lut_tsm_local_kernel(lut, i, j, rgb);
                /* the midpoint rule leaves 1e-4 with 60 parts to a side, and a quarter with twice as many
                 */
                assert_close(rgb[c], power / area_mm2, 0.45 / (PARTS * PARTS), "channel %d, cell (%d, %d)",
                             c, i, j);
            }
    }
    lut_tsm_destroy(lut);
}

/* ---- local and global ----------------------------------------------------------------------------- */

/* Oracle: the two parts are one whole at every depth, and the depth factor is the local part of what
 * arrives in the inner square, by its closed form; continuous through 0 and at the end. */
static void local_and_global_leave_no_gap(void **state)
{
    (void)state;
    const struct io_material marble = read_bundled("marble", 1);
    const struct lut_request request = tsm_request(&marble, 0.02, false);
    struct lut_tsm *const lut = tsm_bake(&request);
    struct lut_tsm copy = *lut;
    struct lut_tsm_plan *plan = NULL;
    struct lut_tsm_work work;
    assert_true(lut_tsm_plan_create(&copy, &plan, NULL) && lut_tsm_work_create(plan, 0, &work));
    for (int i = -300; i <= 300; i++) {
        const double dz_mm = lut->inner_mm * i / 200.0;
        for (int r = 0; r < lut->sample_count; r++)
            assert_close(lut_tsm_global_part(plan, r, dz_mm) + (r < 5 ? lut_tsm_proximity(lut, dz_mm) : 0),
                         1, 1e-15, "sample %d, depth %g", r, dz_mm);
        double factor[IO_CHANNEL_COUNT], next[IO_CHANNEL_COUNT];
        lut_tsm_local_depth_factor(lut, dz_mm, factor);
        lut_tsm_local_depth_factor(lut, dz_mm + 1e-7 * lut->inner_mm, next);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double whole = lut_tsm_inner_part(plan, c, dz_mm, &work);
            const double local = lut_tsm_proximity(lut, dz_mm) * whole;
            assert_true(fabs(factor[c] - local) <= lut->error.max * whole);
            assert_true(fabs(next[c] - factor[c]) < 1e-5);
        }
    }
    for (int side = -1; side <= 1; side += 2) {
        double factor[IO_CHANNEL_COUNT];
        lut_tsm_local_depth_factor(lut, side * 1e-12, factor);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            assert_close(factor[c], 1, 1e-6, "at depth 0");
        lut_tsm_local_depth_factor(lut, side * lut->inner_mm, factor);
        assert_true(factor[0] == 0 && factor[1] == 0 && factor[2] == 0);
    }
    lut_tsm_work_end(&work);
    lut_tsm_plan_destroy(plan);
    lut_tsm_destroy(lut);
}

/* Power per mm^2 at a point dz under a surface across the light with a flux of 1 per mm^2. */
static double power_under_plane(const struct lut_tsm *lut, int channel, double dz_mm)
{
    double sum = 0, kernel = 0, rgb[IO_CHANNEL_COUNT];
    for (int i = 0; i < lut->sample_count; i++) {
        const struct lut_tsm_sample *const sample = &lut->samples[i];
        const double distance_mm = hypot(hypot(sample->offset_mm[0], sample->offset_mm[1]), dz_mm);
        lut_tsm_sample(lut, i, distance_mm > 0 ? -dz_mm / distance_mm : 1, dz_mm, rgb);
        sum += sample->area_mm2 * rgb[channel];
    }
    for (int i = -3; i <= 3; i++)
        for (int j = -3; j <= 3; j++) {
            lut_tsm_local_kernel(lut, i, j, rgb);
            kernel += rgb[channel];
        }
    lut_tsm_local_depth_factor(lut, dz_mm, rgb);
    return sum + kernel * rgb[channel] * pow(lut->inner_mm / LUT_TSM_LOCAL_SIDE, 2);
}

/* Oracle: conservation. Over a flat surface everything is the total reflectance: found 6e-4 at most, which
 * the interpolation between the nodes beside depth 0 takes. At other depths it is the power that the
 * sources send through a plane: found within a third of the error that is stated of each sample, or 0.1 %
 * of the total, for an error is relative to no less than the profile at r_max. */
static void check_energy(const struct io_material *material, double epsilon)
{
    const struct lut_request request = tsm_request(material, epsilon, false);
    struct lut_tsm *const lut = tsm_bake(&request);
    struct lut_tsm copy = *lut;
    struct lut_tsm_plan *plan = NULL; /* for the sources, which are no others than lutgen's if fitted */
    assert_true(lut_tsm_plan_create(&copy, &plan, NULL));
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_stack *const stack = stack_of(material, c);
        const double total = dipole_stack_total(stack, DIPOLE_FACE_LIT);
        assert_close(power_under_plane(lut, c, 0), total, 1e-3, "%s, model %s, channel %d, flat",
                     material->name, io_model_names[material->model], c);
        for (int i = -20; i <= 20; i++) {
            const double dz_mm = 0.1 * i * lut->inner_mm, found = power_under_plane(lut, c, dz_mm);
            const double expected = dipole_sources_within(&plan->sources[c], -dz_mm, INFINITY);
            if (!(fabs(found - expected) <= fmax(0.4 * lut->error.max * expected, 1e-3 * total)))
                fail_msg("%s, model %s, channel %d, dz %g of inner_mm: power %g, expected %g, flat %g",
                         material->name, io_model_names[material->model], c, 0.1 * i, found, expected,
                         total);
        }
        dipole_stack_destroy(stack);
    }
    lut_tsm_plan_destroy(plan);
    lut_tsm_destroy(lut);
}

static void no_light_is_lost_or_made(void **state)
{
    (void)state;
    for (size_t m = 0; m < COUNT(bundled); m += MATERIAL_STEP)
        for (int model = 0; io_model_names[model]; model++) {
            struct io_material material = read_bundled(bundled[m], 1);
            material.model = (dipole_model)model;
            check_energy(&material, 0.05);
        }
}

static void no_light_is_lost_or_made_in_layers(void **state)
{
    (void)state;
    const struct io_material slab = read_bundled("layered/marble_slab", 1);
    check_energy(&slab, 0.05);
    const struct io_material skin = read_bundled("layered/skin", 1);
    if (MATERIAL_STEP == 1)
        check_energy(&skin, 0.1);
}

/* ---- errors and sizes ----------------------------------------------------------------------------- */

/* Oracle: audits at other places. */
static void error_is_at_most_what_is_stated(void **state)
{
    (void)state;
    static const double factors[] = { 1e-6, 1, 1e6 };
    for (size_t m = 0; m < COUNT(bundled); m += MATERIAL_STEP)
        for (size_t f = 0; f < COUNT(factors); f++)
            for (int is_half = 0; is_half < 2; is_half++) {
                const struct io_material material = read_bundled(bundled[m], factors[f]);
                const struct lut_request request = tsm_request(&material, 0.05, is_half);
                struct lut_tsm *const lut = tsm_bake(&request);
                assert_true(lut->error.max <= 0.05 && lut->error.p99 <= lut->error.max);
                struct lut_error error;
                assert_true(lut_tsm_audit(lut, 3 * lut->size[1] + 13, 11 + (unsigned)m, &error, NULL));
                if (!(error.max <= lut->error.max && error.p99 <= lut->error.p99))
                    fail_msg("%s: error %g, p99 %g, stated %g, %g", material.name, error.max, error.p99,
                             lut->error.max, lut->error.p99);
                lut_tsm_destroy(lut);
            }
}

/* Oracle: what is asked. */
static void sizes_grow_with_accuracy_and_are_kept(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("ketchup", 1);
    static const double epsilons[] = { 0.2, 0.05, 0.02 };
    int before[2] = { 0, 0 };
    for (size_t e = 0; e < COUNT(epsilons); e++) {
        const struct lut_request request = tsm_request(&material, epsilons[e], false);
        struct lut_tsm *const lut = tsm_bake(&request);
        assert_true(lut->size[0] >= before[0] && lut->size[1] >= before[1]);
        assert_true(e == 0 || lut->size[0] + lut->size[1] > before[0] + before[1]);
        assert_int_equal(lut->size[2], 32);
        before[0] = lut->size[0];
        before[1] = lut->size[1];
        lut_tsm_destroy(lut);
    }
    assert_true(before[0] > 64 && before[1] > 64);

    static const int sizes[][3] = { { 40, 100, 16 }, { 64, 128, 64 }, { 33, 65, 128 }, { 48, 64, 256 } };
    const struct io_material marble = read_bundled("marble", 1);
    for (size_t i = 0; i < COUNT(sizes); i++) {
        struct lut_request request = tsm_request(&marble, 0.5, i == 1);
        memcpy(request.size, sizes[i], sizeof request.size);
        struct lut_tsm *const lut = tsm_bake(&request);
        assert_memory_equal(lut->size, sizes[i], sizeof lut->size);
        assert_memory_equal(lut->size_asked, sizes[i], sizeof lut->size);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) { /* whatever the pattern, all light is there */
            dipole_stack *const stack = stack_of(&marble, c);
            assert_close(power_under_plane(lut, c, 0), dipole_stack_total(stack, DIPOLE_FACE_LIT), 0.01,
                         "size %zu", i);
            dipole_stack_destroy(stack);
        }
        lut_tsm_destroy(lut);
    }
    struct lut_request request = tsm_request(&marble, 0.01, false);
    request.size[0] = request.size[1] = 8;
    assert_not_baked(&request, DIPOLE_NOT_CONVERGED, "8 x 8 x 32 texels reach a relative error of ");
    request.size[1] = 0; /* T alone cannot make up for it */
    assert_not_baked(&request, DIPOLE_NOT_CONVERGED, "8 x 1024 x 32 texels reach a relative error of ");
}

/* Oracle: the stated ranges. */
static void bad_requests_are_refused(void **state)
{
    (void)state;
    const struct io_material marble = read_bundled("marble", 1);
    static const struct {
        int size[3];
        const char *message;
    } cases[] = {
        { { 7, 0, 0 }, "a volume of 7 x 0 x 0, expected 8 to 1024 for S" },
        { { -1, 0, 0 }, "a volume of -1 x 0 x 0, expected 8 to 1024 for S" },
        { { 0, 1025, 0 }, "a volume of 0 x 1025 x 0, expected 8 to 1024 for T" },
        { { 0, 0, 33 }, "a volume of 33 slices, expected 16, 32, 64, 128 or 256" },
        { { 1024, 64, 128 }, "128 slices of 1024 texels side by side, expected at most 65536 texels" },
    };
    struct lut_request request;
    for (size_t i = 0; i < COUNT(cases); i++) {
        request = tsm_request(&marble, 0.05, false);
        memcpy(request.size, cases[i].size, sizeof request.size);
        assert_not_baked(&request, DIPOLE_BAD_VALUE, cases[i].message);
    }
    request = tsm_request(&marble, 4.88e-4, true);
    assert_not_baked(&request, DIPOLE_BAD_VALUE,
                     "epsilon is 0.000488, expected > 0.00049 for a half table");
    request = tsm_request(&marble, 0.6, false);
    assert_not_baked(&request, DIPOLE_BAD_VALUE, "epsilon is 0.6, expected 1e-06 to 0.5");
    const struct io_material two[2] = { marble, marble };
    request = tsm_request(two, 0.05, false);
    request.material_count = 2;
    assert_not_baked(&request, DIPOLE_BAD_VALUE, "2 materials, expected 1 to 1");
    const struct io_material bad = make_material(-1, 1), huge = make_material(1e30, 1e30);
    request = tsm_request(&bad, 0.05, false);
    assert_not_baked(&request, DIPOLE_BAD_VALUE, "sigma_a_per_mm is -1");
    request = tsm_request(&huge, 0.05, false);
    assert_not_baked(&request, DIPOLE_BAD_VALUE, "channel R falls from");
}

/* Oracle: the bytes of one thread. */
static void bytes_do_not_depend_on_threads(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("skin1", 1);
    static const int thread_counts[] = { 1, 1, 2, 7, 0 };
    struct lut_tsm *first = NULL;
    for (size_t i = 0; i < COUNT(thread_counts); i++) {
        const struct lut_request request = tsm_request(&material, 0.1, true);
        struct lut_tsm *lut = NULL;
        assert_true(lut_tsm_bake(&request, thread_counts[i], &lut, NULL));
        first = first ? first : lut;
        assert_same_volume(lut, first);
        assert_memory_equal(&lut->error, &first->error, sizeof lut->error);
        if (lut != first)
            lut_tsm_destroy(lut);
    }
    lut_tsm_destroy(first);
}

/* Oracle: what a half is; the largest uses half's range. */
static void texels_of_a_half_volume_are_halves(void **state)
{
    (void)state;
    const struct io_material material = read_bundled("ketchup", 1e3);
    const struct lut_request request = tsm_request(&material, 0.1, true);
    struct lut_tsm *const lut = tsm_bake(&request);
    const size_t count = (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2];
    double most[IO_CHANNEL_COUNT] = { 0 };
    for (size_t i = 0; i < 3 * count; i++) {
        const double value = (double)lut->rgb[i];
        assert_true(value >= 0 && value <= 65504 && is_half(lut->rgb[i]));
        most[i % 3] = fmax(most[i % 3], value);
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        assert_true(most[c] >= 32752);
    lut_tsm_destroy(lut);
}

/* Oracle: limits. */
static void edges_of_the_range_bake(void **state)
{
    (void)state;
    struct io_material material = make_material(0.5, 0); /* nothing scatters */
    struct lut_request request = tsm_request(&material, 0.01, true);
    struct lut_tsm *lut = tsm_bake(&request);
    assert_true(lut->error.max == 0 && lut->inner_mm > 0 && isfinite(lut->depth_max_mm));
    for (size_t i = 0; i < (size_t)3 * 64 * 64 * 32; i++)
        assert_true(lut->rgb[i] == 0);
    lut_tsm_destroy(lut);

    material = make_material(0.5, 2);
    request = tsm_request(&material, 0.05, false);
    struct lut_tsm *const whole = tsm_bake(&request);
    material.layers[1][0].medium.sigma_a_per_mm = 1;
    material.layers[1][0].medium.sigma_s_prime_per_mm = 0;
    lut = tsm_bake(&request);
    assert_true(lut->inner_mm == whole->inner_mm);
    for (size_t i = 0; i < (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2]; i++) {
        assert_true(lut->rgb[3 * i] == whole->rgb[3 * i]);
        assert_true(lut->rgb[3 * i + 1] == 0);
    }
    assert_close(power_under_plane(lut, 1, 0) + 1, 1, 1e-15, "no light");
    lut_tsm_destroy(lut);
    lut_tsm_destroy(whole);

    material = make_material(0, 1);
    check_energy(&material, 0.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_are_means_over_their_cells),
        cmocka_unit_test(samples_between_keep_the_error),
        cmocka_unit_test(the_kernel_is_means_over_its_cells),
        cmocka_unit_test(local_and_global_leave_no_gap),
        cmocka_unit_test(no_light_is_lost_or_made),
        cmocka_unit_test(no_light_is_lost_or_made_in_layers),
        cmocka_unit_test(error_is_at_most_what_is_stated),
        cmocka_unit_test(sizes_grow_with_accuracy_and_are_kept),
        cmocka_unit_test(bad_requests_are_refused),
        cmocka_unit_test(bytes_do_not_depend_on_threads),
        cmocka_unit_test(texels_of_a_half_volume_are_halves),
        cmocka_unit_test(edges_of_the_range_bake),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
