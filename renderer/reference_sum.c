#include "renderer/reference_sum.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>

enum {
    POINTS = 64,     /* in a cell, at which light is looked for         */
    PART_CELLS = 64, /* for which one thread looks at a time            */
    BATCH = 512,     /* distances whose profile is computed at once     */
    SLOTS = RENDER_SUM_CHUNK * POINTS,
};

/* Points of a cell are put together where they are no farther apart than this many widths of a cell. */
#define EXTENT_LIMIT 2.5

/* Where light enters, one array for each quantity. */
struct samples {
    double position_mm[3][SLOTS], flux_w[IO_CHANNEL_COUNT][SLOTS];
    size_t count;
};

/* Light at the points of a cell. */
struct cell {
    double position_mm[POINTS][3], flux_w[POINTS][IO_CHANNEL_COUNT];
};

struct render_sum {
    const struct render_pixel_view *view;
    const struct render_surface *surface;
    double area_mm2;
    int thread_count;
    int twins[IO_CHANNEL_COUNT];     /* first channel of the same medium; -1: nothing is scattered */
    size_t cell_count, first, count; /* of the surface; of the chunk */
    int first_row;
    double *const *halves;
    struct samples samples[2];
};

static bool is_same(const dipole_coefficients *a, const dipole_coefficients *b)
{
    return a->sigma_a_per_mm == b->sigma_a_per_mm && a->sigma_s_prime_per_mm == b->sigma_s_prime_per_mm &&
           a->fdr == b->fdr;
}

static bool shines_in(const struct io_scene *scene, int channel)
{
    for (size_t i = 0; i < scene->light_count; i++) {
        if (scene->lights[i].rgb[channel] > 0)
            return true;
    }
    return false;
}

bool render_sum_create(const struct render_pixel_view *view, const struct render_surface *surface,
                       int thread_count, struct render_sum **sum_out, dipole_status *status)
{
    *sum_out = NULL;
    struct render_sum *const sum = calloc(1, sizeof *sum);
    if (!sum)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d samples of the surface",
                           2 * SLOTS);
    sum->view = view;
    sum->surface = surface;
    sum->area_mm2 = render_surface_area_mm2(surface);
    sum->thread_count = thread_count;
    const dipole_coefficients *const k = view->plan->coefficients;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        sum->twins[c] = -1;
        for (int other = c; other >= 0 && k[c].alpha_prime > 0 && shines_in(view->scene, c); other--) {
            if (is_same(&k[c], &k[other]))
                sum->twins[c] = other;
        }
    }
    *sum_out = sum;
    return true;
}

void render_sum_destroy(struct render_sum *sum)
{
    free(sum);
}

/* ---- samples ------------------------------------------------------------------------------------ */

/* SplitMix64: as random as it need be, and the same for every number of threads. */
static double random_of(uint64_t a, uint64_t b)
{
    uint64_t x = a * 0x9e3779b97f4a7c15u + b * 0xd1b54a32d192ed03u + 0x632be59bd9b4e019u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return (double)((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

/* Power that enters at a point for so much area. Facets catch the light, smooth normals mirror a part of
 * it, as in a light's view (T13): irradiance falls with the facet's cosine. */
static void light_point(const struct render_sum *sum, const struct render_surface_point *point,
                        double area_mm2, double flux_w[IO_CHANNEL_COUNT])
{
    const struct io_scene *const scene = sum->view->scene;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        flux_w[c] = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const struct io_light *const light = &scene->lights[i];
        double to_light[3], falloff;
        if (!render_light_shines(light) ||
            !render_light_reaches(sum->view->tracer, light, point, to_light, &falloff))
            continue;
        const double cosine = fmin(fmax(render_dot(point->normal, to_light), 0), 1);
        const double entering = falloff * render_dot(point->facet_normal, to_light) *
                                (1 - dipole_fresnel_reflectance(sum->view->plan->eta, cosine));
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            flux_w[c] += area_mm2 * light->rgb[c] * entering;
    }
}

static double brightness(const double flux_w[IO_CHANNEL_COUNT])
{
    return flux_w[0] + flux_w[1] + flux_w[2];
}

/* Diagonal of the box about the lit points begin .. end - 1. */
static double extent_mm(const struct cell *cell, int begin, int end)
{
    double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };
    double diagonal2 = 0;
    for (int i = begin; i < end; i++) {
        for (int k = 0; k < 3 && brightness(cell->flux_w[i]) > 0; k++) {
            min[k] = fmin(min[k], cell->position_mm[i][k]);
            max[k] = fmax(max[k], cell->position_mm[i][k]);
        }
    }
    for (int k = 0; k < 3; k++) {
        const double side_mm = fmax(max[k] - min[k], 0);
        diagonal2 += side_mm * side_mm;
    }
    return sqrt(diagonal2);
}

/* Put points begin .. end - 1 together: their flux at its middle. Where they are far apart, because the
 * line has gone on elsewhere, halves of them. The sample takes the slot of its first point. */
static void put_together(const struct render_sum *sum, const struct cell *cell, int begin, int end,
                         struct samples *samples, size_t slot)
{
    const double limit_mm = EXTENT_LIMIT * sqrt(sum->area_mm2 / (double)sum->cell_count);
    if (end - begin > 1 && extent_mm(cell, begin, end) > limit_mm) {
        const int middle = (begin + end) / 2;
        put_together(sum, cell, begin, middle, samples, slot);
        put_together(sum, cell, middle, end, samples, slot);
        return;
    }
    double flux_w[IO_CHANNEL_COUNT] = { 0 }, moment[3] = { 0 };
    for (int i = begin; i < end; i++) {
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            flux_w[c] += cell->flux_w[i][c];
        for (int k = 0; k < 3; k++)
            moment[k] += brightness(cell->flux_w[i]) * cell->position_mm[i][k];
    }
    const double light = brightness(flux_w);
    for (int k = 0; k < 3 && light > 0; k++)
        samples->position_mm[k][slot + (size_t)begin] = moment[k] / light;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        samples->flux_w[c][slot + (size_t)begin] = flux_w[c];
}

/* The cells of the second half begin in the middle of those of the first. */
static void take_cell(struct render_sum *sum, int half, size_t index)
{
    struct samples *const samples = &sum->samples[half];
    const double cell_count = (double)sum->cell_count, area_mm2 = sum->area_mm2 / cell_count / POINTS;
    const uint64_t number = sum->first + index, seed = 2 * (uint64_t)sum->cell_count + (uint64_t)half;
    struct cell cell;
    for (int i = 0; i < POINTS; i++) {
        const double within = (i + random_of(seed, number * POINTS + (uint64_t)i)) / POINTS;
        const double place = ((double)number + within + 0.5 * half) / cell_count;
        struct render_surface_point point;
        render_surface_at(sum->surface, place < 1 ? place : place - 1, &point);
        for (int k = 0; k < 3; k++)
            cell.position_mm[i][k] = point.position_mm[k];
        light_point(sum, &point, area_mm2, cell.flux_w[i]);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            samples->flux_w[c][index * POINTS + (size_t)i] = 0;
    }
    put_together(sum, &cell, 0, POINTS, samples, index * POINTS);
}

static void take_part(void *context, int part)
{
    struct render_sum *const sum = context;
    const size_t begin = (size_t)part * PART_CELLS;
    for (int half = 0; half < 2; half++) {
        for (size_t i = begin; i < begin + PART_CELLS && i < sum->count; i++)
            take_cell(sum, half, i);
    }
}

/* Leave out the empty slots. */
static void close_ranks(struct samples *samples, size_t slot_count)
{
    samples->count = 0;
    for (size_t i = 0; i < slot_count; i++) {
        const double flux_w[] = { samples->flux_w[0][i], samples->flux_w[1][i], samples->flux_w[2][i] };
        if (!(brightness(flux_w) > 0))
            continue;
        for (int k = 0; k < 3; k++)
            samples->position_mm[k][samples->count] = samples->position_mm[k][i];
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            samples->flux_w[c][samples->count] = flux_w[c];
        samples->count++;
    }
}

void render_sum_take(struct render_sum *sum, size_t cell_count, size_t first, size_t count)
{
    sum->cell_count = cell_count;
    sum->first = first;
    sum->count = count;
    lut_parallel_for((int)((count + PART_CELLS - 1) / PART_CELLS), sum->thread_count, take_part, sum);
    for (int half = 0; half < 2; half++)
        close_ranks(&sum->samples[half], count * POINTS);
}

/* ---- sums --------------------------------------------------------------------------------------- */

/* Add scale times the radiosity at a point. */
static void add_samples(const struct render_sum *sum, const struct samples *samples,
                        const double position_mm[3], double scale, double radiance[3])
{
    double r_mm[BATCH], profiles[IO_CHANNEL_COUNT][BATCH];
    for (size_t at = 0; at < samples->count; at += BATCH) {
        const size_t rest = samples->count - at, count = rest < BATCH ? rest : BATCH;
        const double *const x = samples->position_mm[0] + at, *const y = samples->position_mm[1] + at,
                            *const z = samples->position_mm[2] + at;
        for (size_t i = 0; i < count; i++) {
            const double dx = x[i] - position_mm[0], dy = y[i] - position_mm[1], dz = z[i] - position_mm[2];
            r_mm[i] = sqrt(dx * dx + dy * dy + dz * dz);
        }
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            if (sum->twins[c] < 0)
                continue;
            if (sum->twins[c] == c)
                dipole_rd_profile_per_mm2(&sum->view->plan->coefficients[c], r_mm, count, profiles[c]);
            const double *const profile = profiles[sum->twins[c]], *const flux_w = samples->flux_w[c] + at;
            double batch = 0;
            for (size_t i = 0; i < count; i++)
                batch += flux_w[i] * profile[i];
            radiance[c] += scale * batch;
        }
    }
}

/* Radiosity hardly differs within a group: that of its middle does for all its points. */
static void add_group(const struct render_sum *sum, const struct samples *samples,
                      const struct render_pixel_group *group, double radiance[3])
{
    double middle_mm[3] = { 0 }, scale = 0;
    for (int i = 0; i < group->count; i++) {
        scale += render_pixel_exit_per_sr(sum->view, &group->points[i]) / RENDER_PIXEL_RAYS;
        for (int k = 0; k < 3; k++)
            middle_mm[k] += group->points[i].position_mm[k] / group->count;
    }
    add_samples(sum, samples, middle_mm, scale, radiance);
}

static void add_row(void *context, int row)
{
    const struct render_sum *const sum = context;
    const int width_px = sum->view->plan->width_px, y = sum->first_row + row;
    struct render_pixel pixel;
    for (int x = 0; x < width_px; x++) {
        render_pixel_trace(sum->view, x, y, &pixel);
        for (int half = 0; half < 2; half++) {
            double *const radiance = sum->halves[half] + 3 * ((size_t)y * (size_t)width_px + (size_t)x);
            for (int g = 0; g < pixel.group_count; g++)
                add_group(sum, &sum->samples[half], &pixel.groups[g], radiance);
        }
    }
}

void render_sum_add_rows(struct render_sum *sum, int first_row, int row_count, double *const halves[2])
{
    sum->first_row = first_row;
    sum->halves = halves;
    lut_parallel_for(row_count, sum->thread_count, add_row, sum);
}
