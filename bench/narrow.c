/*
 * Channels too narrow for their light samples: two ways to keep samples from showing as dots, on a flat
 * surface where the truth is known. theory.md T34.
 *
 *   averaged   the profile, averaged over the samples' footprints: what the renderer does
 *   local      what lies within two spacings and above the band's cap (T21) is taken from the light at the
 *              pixel itself, times its share of the reflectance; samples sum the rest
 *   exact      the same, of light that knows where its shadows are better than the light's view does
 *
 * usage: bench_narrow MATERIALS   (the folder); a row of Markdown for each medium, spacing and size of
 * texels
 *
 * Spacing in mean free paths, texels of the light's view to a spacing, share of the reflectance that is
 * local. Then in % of the lit surface's radiosity: at the edge of a shadow the largest error, the root mean
 * square within four spacings, and the largest error of a mean over a spacing, for each of the three; the
 * largest error where light rises and falls every eight spacings, and how far the brightest and the darkest
 * place in even light are apart, dots, for the first two.
 */
#include "io/material_file.h"
#include "renderer/bands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* As in plan_budget.c: half of aliasing's share. */
#define BLUR_SHARE 0.29

enum { CHANNEL = 2, PLACES = 65, OFFSETS = 12, RINGS = 4000, TEXELS = 4 };

#define CAP_SPACINGS 2
#define ANGLE_RAD 0.4 /* of the grid of samples to the edge */

struct medium {
    struct io_material material;
    struct render_medium medium;
    struct lut_splat *table;
    double r_max_mm;
};

enum { AVERAGED, LOCAL, LOCAL_EXACT, WAYS };

/* How light falls on the plane: 0 to 1. */
enum lighting { EVEN, EDGE, WAVE };

/* What is summed, and how. */
struct trial {
    const struct medium *medium;
    enum lighting lighting;
    double spacing_mm, wave_mm, offset[2]; /* of the grid, in cells */
    int texels;                            /* of the light's view to a cell, in each direction */
    struct render_split blurred, capped;
    double near_power; /* of what is above the cap */
};

static void check(bool is_done, const dipole_status *status)
{
    if (is_done)
        return;
    fprintf(stderr, "bench_narrow: %s\n", status->message);
    exit(1);
}

static void medium_init(const char *folder, const char *name, dipole_model model, double epsilon,
                        struct medium *medium)
{
    char path[1024];
    dipole_status status = { 0 };
    *medium = (struct medium){ .r_max_mm = 0 };
    snprintf(path, sizeof path, "%s/%s.json", folder, name);
    check(io_material_read(path, &medium->material, &status), &status);
    medium->material.model = model;
    medium->medium = (struct render_medium){ .material = &medium->material, .has_scattering = true };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_stack **const stack = &medium->medium.stacks[c];
        check(dipole_stack_create(medium->material.layers[c], medium->material.layer_count, model,
                                  DIPOLE_FROM_ABOVE, stack, &status),
              &status);
        medium->medium.diffuse_reflectance[c] = dipole_stack_total(*stack, DIPOLE_FACE_LIT);
    }
    medium->r_max_mm =
        dipole_stack_r_max_mm(medium->medium.stacks[CHANNEL], DIPOLE_FACE_LIT, 0.02 * epsilon);
    const struct lut_request request = { .materials = &medium->material,
                                         .material_count = 1,
                                         .epsilon = fmax(0.02 * epsilon, LUT_EPSILON_MIN) };
    check(lut_splat_bake(&request, &medium->table, &status), &status);
}

static void medium_end(struct medium *medium)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        dipole_stack_destroy(medium->medium.stacks[c]);
    lut_splat_destroy(medium->table);
}

static double light_at(const struct trial *trial, double x_mm)
{
    if (trial->lighting == EDGE)
        return x_mm > 0 ? 1 : 0;
    return trial->lighting == WAVE ? 0.5 + 0.5 * cos(2 * PI * x_mm / trial->wave_mm) : 1;
}

/* The plane by the grid's coordinates, in cells. */
static double x_of(const struct trial *trial, double u, double v)
{
    return trial->spacing_mm *
           (cos(ANGLE_RAD) * (u - trial->offset[0]) - sin(ANGLE_RAD) * (v - trial->offset[1]));
}

static double y_of(const struct trial *trial, double u, double v)
{
    return trial->spacing_mm *
           (sin(ANGLE_RAD) * (u - trial->offset[0]) + cos(ANGLE_RAD) * (v - trial->offset[1]));
}

/* The sample of a cell: the light of its texels, at their middle. */
static double sample_of(const struct trial *trial, int column, int row, double place_mm[2])
{
    double flux = 0;
    place_mm[0] = place_mm[1] = 0;
    for (int i = 0; i < trial->texels * trial->texels; i++) {
        const int right = i % trial->texels, down = i / trial->texels;
        const double u = column + (right + 0.5) / trial->texels, v = row + (down + 0.5) / trial->texels;
        const double light = light_at(trial, x_of(trial, u, v)) / (trial->texels * trial->texels);
        flux += light;
        place_mm[0] += light * x_of(trial, u, v);
        place_mm[1] += light * y_of(trial, u, v);
    }
    for (int k = 0; k < 2 && flux > 0; k++)
        place_mm[k] /= flux;
    return flux * trial->spacing_mm * trial->spacing_mm;
}

/* The light that there is at (x, 0) if shadows are looked up in the light's view. */
static double light_by_texels(const struct trial *trial, double x_mm)
{
    if (trial->lighting != EDGE)
        return light_at(trial, x_mm);
    double grid[2] = { cos(ANGLE_RAD) * x_mm, -sin(ANGLE_RAD) * x_mm };
    for (int k = 0; k < 2; k++)
        grid[k] =
            (floor((grid[k] / trial->spacing_mm + trial->offset[k]) * trial->texels) + 0.5) / trial->texels;
    return light_at(trial, x_of(trial, grid[0], grid[1]));
}

/* Of the lit surface's radiosity, at (x, 0). */
static void sum_at(const struct trial *trial, double x_mm, double sums[WAYS])
{
    const double reach_mm = trial->medium->r_max_mm,
                 total = trial->medium->medium.diffuse_reflectance[CHANNEL];
    const double end_mm = fmax(reach_mm, 6 * trial->spacing_mm);
    const int reach = (int)ceil(end_mm / trial->spacing_mm) + 1;
    const double u = cos(ANGLE_RAD) * x_mm / trial->spacing_mm + trial->offset[0],
                 v = -sin(ANGLE_RAD) * x_mm / trial->spacing_mm + trial->offset[1];
    sums[AVERAGED] = 0;
    sums[LOCAL] = trial->near_power * light_by_texels(trial, x_mm);
    sums[LOCAL_EXACT] = trial->near_power * light_at(trial, x_mm);
    for (int row = (int)floor(v) - reach; row <= (int)floor(v) + reach; row++) {
        for (int column = (int)floor(u) - reach; column <= (int)floor(u) + reach; column++) {
            double place_mm[2], rgb[IO_CHANNEL_COUNT];
            const double flux = sample_of(trial, column, row, place_mm),
                         r_mm = hypot(place_mm[0] - x_mm, place_mm[1]);
            if (!(flux > 0) || r_mm > end_mm)
                continue;
            render_split_from_per_mm2(&trial->blurred, 0, r_mm, rgb);
            sums[AVERAGED] += flux * rgb[CHANNEL];
            render_split_from_per_mm2(&trial->capped, 1, r_mm, rgb);
            sums[LOCAL] += flux * rgb[CHANNEL];
            sums[LOCAL_EXACT] += flux * rgb[CHANNEL];
        }
    }
    for (int w = 0; w < WAYS; w++)
        sums[w] /= total;
}

/* What the medium makes of the light, exactly: of an edge ring by ring, of a wave by its spectrum. */
static double truth_at(const struct trial *trial, double x_mm)
{
    const dipole_stack *const stack = trial->medium->medium.stacks[CHANNEL];
    const double total = dipole_stack_total(stack, DIPOLE_FACE_LIT);
    if (trial->lighting == WAVE)
        return 0.5 + 0.5 * cos(2 * PI * x_mm / trial->wave_mm) *
                         dipole_stack_spectrum(stack, DIPOLE_FACE_LIT, 2 * PI / trial->wave_mm) / total;
    if (trial->lighting == EVEN)
        return 1;
    const double end_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-5);
    double lit = 0, before = 0;
    for (int i = 1; i <= RINGS; i++) {
        const double r_mm = end_mm * pow((double)i / RINGS, 3),
                     middle_mm = end_mm * pow((i - 0.5) / RINGS, 3);
        const double within = dipole_stack_within(stack, DIPOLE_FACE_LIT, r_mm);
        lit += (within - before) * (1 - acos(fmin(fmax(x_mm / middle_mm, -1), 1)) / PI);
        before = within;
    }
    return lit / before;
}

struct found {
    double largest, square, largest_mean, lowest, highest;
};

static void found_add(const double errors[PLACES], struct found *found)
{
    enum { SPAN = (PLACES - 1) / 8 }; /* a spacing */
    for (int i = 0; i < PLACES; i++) {
        double sum = 0;
        for (int k = 0; k < SPAN && i + SPAN <= PLACES; k++)
            sum += errors[i + k] / SPAN;
        found->largest = fmax(found->largest, fabs(errors[i]));
        found->largest_mean = fmax(found->largest_mean, fabs(sum));
        found->square += errors[i] * errors[i] / (PLACES * OFFSETS);
        found->lowest = fmin(found->lowest, errors[i]);
        found->highest = fmax(found->highest, errors[i]);
    }
}

/* Errors along a line, for many places of the grid. */
static void measure(struct trial *trial, enum lighting lighting, struct found found[WAYS])
{
    double truth[PLACES], errors[WAYS][PLACES];
    trial->lighting = lighting;
    trial->wave_mm = 8 * trial->spacing_mm;
    for (int w = 0; w < WAYS; w++)
        found[w] = (struct found){ .lowest = INFINITY, .highest = -INFINITY };
    for (int offset = 0; offset < OFFSETS; offset++) {
        trial->offset[0] = fmod(0.13 + 0.618034 * offset, 1);
        trial->offset[1] = fmod(0.41 + 0.754878 * offset, 1);
        for (int i = 0; i < PLACES; i++) {
            const double x_mm = trial->spacing_mm * (8.0 * i / (PLACES - 1) - 4);
            if (offset == 0)
                truth[i] = truth_at(trial, x_mm);
            double sums[WAYS];
            sum_at(trial, x_mm, sums);
            for (int w = 0; w < WAYS; w++)
                errors[w][i] = 100 * (sums[w] - truth[i]);
        }
        for (int w = 0; w < WAYS; w++)
            found_add(errors[w], &found[w]);
    }
}

static void trial_init(const struct medium *medium, double spacing_mm, double epsilon, int texels,
                       struct trial *trial)
{
    const dipole_stack *const stack = medium->medium.stacks[CHANNEL];
    const double cap_mm = CAP_SPACINGS * spacing_mm, reach_mm = fmax(medium->r_max_mm, 2.1 * cap_mm);
    struct render_band_source source = { .table = medium->table, .medium = &medium->medium };
    const struct render_band bands[2] = { { spacing_mm, 0, 2 * cap_mm }, { spacing_mm, cap_mm, reach_mm } };
    dipole_status status = { 0 };
    *trial = (struct trial){ .medium = medium, .spacing_mm = spacing_mm, .texels = texels };
    check(render_split_init(&source, bands, 2, &trial->capped, &status), &status);
    source.blur_mm[CHANNEL] = render_footprint_blur_mm(stack, spacing_mm, 0, BLUR_SHARE * epsilon);
    check(render_split_init(&source, bands, 2, &trial->blurred, &status), &status);
    trial->near_power = dipole_stack_within(stack, DIPOLE_FACE_LIT, cap_mm);
    for (int i = 0; i < RINGS; i++) {
        double rgb[IO_CHANNEL_COUNT];
        const double r_mm = cap_mm * (i + 0.5) / RINGS;
        render_split_from_per_mm2(&trial->capped, 1, r_mm, rgb);
        trial->near_power -= 2 * PI * r_mm * cap_mm / RINGS * rgb[CHANNEL];
    }
}

static void row(const char *name, const struct medium *medium, double spacings, double epsilon, int texels)
{
    const double path_mm = dipole_stack_coefficients(medium->medium.stacks[CHANNEL], 0)->mean_free_path_mm;
    struct trial trial;
    struct found edge[WAYS], wave[WAYS], even[WAYS];
    trial_init(medium, spacings * path_mm, epsilon, texels, &trial);
    measure(&trial, EDGE, edge);
    measure(&trial, WAVE, wave);
    measure(&trial, EVEN, even);
    printf("| %s | %g | %d | %.2f |", name, spacings, texels,
           trial.near_power / medium->medium.diffuse_reflectance[CHANNEL]);
    for (int w = 0; w < WAYS; w++)
        printf(" %.1f | %.1f | %.1f |", edge[w].largest, sqrt(edge[w].square), edge[w].largest_mean);
    for (int w = 0; w < LOCAL_EXACT; w++)
        printf(" %.2f |", wave[w].largest);
    for (int w = 0; w < LOCAL_EXACT; w++)
        printf(" %.2f |", even[w].highest - even[w].lowest);
    printf("\n");
    fflush(stdout);
    render_split_end(&trial.blurred);
    render_split_end(&trial.capped);
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name, *file;
        dipole_model model;
    } media[] = { { "ketchup, blue", "ketchup", DIPOLE_MODEL_DIPOLE },
                  { "skin1, blue, beam", "skin1", DIPOLE_MODEL_BEAM } };
    static const double spacings[] = { 0.5, 1, 4, 10, 30 };
    const double epsilon = 0.01;
    if (argc != 2) {
        fputs("usage: bench_narrow MATERIALS\n", stderr);
        return 2;
    }
    for (size_t m = 0; m < sizeof media / sizeof *media; m++) {
        struct medium medium;
        medium_init(argv[1], media[m].file, media[m].model, epsilon, &medium);
        for (size_t s = 0; s < sizeof spacings / sizeof *spacings; s++) {
            row(media[m].name, &medium, spacings[s], epsilon, TEXELS);
            row(media[m].name, &medium, spacings[s], epsilon, 1);
        }
        medium_end(&medium);
    }
    return 0;
}
