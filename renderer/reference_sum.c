#include "renderer/reference_sum.h"

#include "lutgen/parallel.h"
#include "renderer/environment_visibility.h"
#include "renderer/plan.h"
#include "renderer/reference_environment.h"
#include "renderer/reference_tree.h"

#include <math.h>
#include <stdlib.h>

enum {
    PART_POINTS = 4096, /* for which one thread looks at a time             */
    TILE_PX = 4,        /* sides of a square of pixels with one cut of trees */
    TILE_GROUPS = TILE_PX * TILE_PX * RENDER_PIXEL_RAYS,
};

/* Groups of a tile share a cut within so many times the extent of a group. */
#define TILE_SHARE 8

/* A singular profile is replaced within so many distances of points by a smooth one of the same power. */
#define CORE_SPACINGS 2.0

/* Points of a half at most, for which tables are laid out. */
#define POINT_LIMIT 0x1p27

/* A point of the surface, dark where its flux is 0. */
struct sample {
    double position_mm[3], flux_w[IO_CHANNEL_COUNT];
    size_t object;
};

/* Light that enters an object. */
struct entry {
    struct render_tree_point *points; /* in the sum's array */
    size_t count;
    struct render_tree *tree;
};

struct render_sum {
    const struct render_pixel_view *view;
    const struct render_surface *surface;
    const struct render_media *media;
    struct render_profile **profiles; /* of each medium; NULL where it scatters nothing */
    double area_mm2;
    int thread_count;
    struct render_sum_sky sky;
    struct render_exact_irradiance **irradiance; /* of each medium; NULL without a sky */
    struct render_visibility **visibility;       /* the same; NULL where nothing is in the way */

    /* of the chunk */
    size_t first, count;
    struct sample *samples; /* the first half, then the second */
    struct render_tree_point *points;
    struct entry *entries[2]; /* of each object, by half */

    /* of the loops */
    struct render_sum_pass pass;
    int first_band;
    double *const *halves;
    dipole_status *statuses; /* of each entry, both halves */
};

static double spacing_mm(const struct render_sum *sum, double point_count)
{
    return sqrt(sum->area_mm2 / point_count);
}

static bool create_profiles(struct render_sum *sum, dipole_status *status)
{
    const struct render_ball ball = render_ball_of_scene(sum->view->scene);
    for (size_t i = 0; i < sum->media->count; i++) {
        const struct render_medium *const medium = &sum->media->media[i];
        if (medium->has_scattering &&
            !render_profile_create(medium, 2 * ball.radius_mm, CORE_SPACINGS * spacing_mm(sum, POINT_LIMIT),
                                   &sum->profiles[i], status))
            return false;
    }
    return true;
}

static bool look_around(struct render_sum *sum, dipole_status *status)
{
    const struct render_environment *const environment = sum->sky.environment;
    bool done = true;
    for (size_t i = 0; done && environment && i < sum->media->count; i++) {
        const struct render_medium *const medium = &sum->media->media[i];
        if (!medium->has_scattering)
            continue;
        done = render_exact_irradiance_create(environment, medium->eta, sum->thread_count,
                                              &sum->irradiance[i], status);
        if (done && sum->sky.ray_count > 0)
            done = render_visibility_create(sum->view->tracer, environment, medium->eta, sum->sky.ray_count,
                                            &sum->visibility[i], status);
    }
    return done;
}

bool render_sum_create(const struct render_pixel_view *view, const struct render_surface *surface,
                       const struct render_media *media, const struct render_sum_sky *sky, int thread_count,
                       struct render_sum **sum_out, dipole_status *status)
{
    *sum_out = NULL;
    const size_t object_count = view->scene->object_count;
    struct render_sum *const sum = calloc(1, sizeof *sum);
    if (!sum)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a sum");
    sum->view = view;
    sum->surface = surface;
    sum->media = media;
    sum->area_mm2 = render_surface_area_mm2(surface);
    sum->thread_count = thread_count;
    sum->sky = *sky;
    sum->irradiance = calloc(media->count, sizeof(struct render_exact_irradiance *));
    sum->visibility = calloc(media->count, sizeof(struct render_visibility *));
    sum->profiles = calloc(media->count, sizeof(struct render_profile *));
    sum->statuses = calloc(2 * object_count, sizeof *sum->statuses);
    for (int half = 0; half < 2; half++)
        sum->entries[half] = calloc(object_count, sizeof *sum->entries[half]);
    if (!sum->profiles || !sum->irradiance || !sum->visibility || !sum->statuses || !sum->entries[0] ||
        !sum->entries[1]) {
        render_sum_destroy(sum);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the light in %zu objects",
                           object_count);
    }
    if (!create_profiles(sum, status) || !look_around(sum, status)) {
        render_sum_destroy(sum);
        return false;
    }
    *sum_out = sum;
    return true;
}

static void forget_chunk(struct render_sum *sum)
{
    for (size_t i = 0; i < sum->view->scene->object_count; i++) {
        for (int half = 0; half < 2; half++) {
            if (sum->entries[half]) {
                render_tree_destroy(sum->entries[half][i].tree);
                sum->entries[half][i] = (struct entry){ 0 };
            }
        }
    }
    free(sum->samples);
    free(sum->points);
    sum->samples = NULL;
    sum->points = NULL;
}

void render_sum_destroy(struct render_sum *sum)
{
    if (!sum)
        return;
    forget_chunk(sum);
    for (size_t i = 0; i < sum->media->count && sum->profiles; i++)
        render_profile_destroy(sum->profiles[i]);
    for (size_t i = 0; i < sum->media->count && sum->irradiance && sum->visibility; i++) {
        render_exact_irradiance_destroy(sum->irradiance[i]);
        render_visibility_destroy(sum->visibility[i]);
    }
    free(sum->profiles);
    free(sum->irradiance);
    free(sum->visibility);
    free(sum->statuses);
    free(sum->entries[0]);
    free(sum->entries[1]);
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

/* Power of one light without a size that enters at a point for so much area. Facets catch the light, smooth
 * normals mirror a part of it, as in a light's view (T13): irradiance falls with the facet's cosine. */
static void add_light(const struct render_sum *sum, const struct io_light *light,
                      const struct render_surface_point *point, double area_mm2,
                      double flux_w[IO_CHANNEL_COUNT])
{
    double to_light[3], falloff, left[IO_CHANNEL_COUNT];
    if (!render_light_reaches(sum->view->tracer, light, point, to_light, &falloff, left))
        return;
    const double cosine = fmin(fmax(render_dot(point->normal, to_light), 0), 1);
    const double entering = falloff * render_dot(point->facet_normal, to_light) *
                            (1 - dipole_fresnel_reflectance(sum->view->media[point->object].eta, cosine));
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        flux_w[c] += area_mm2 * light->rgb[c] * left[c] * entering;
}

/* number: of the point, the same in every run. */
static void light_point(const struct render_sum *sum, const struct render_surface_point *point,
                        uint64_t number, double area_mm2, double flux_w[IO_CHANNEL_COUNT])
{
    const struct io_scene *const scene = sum->view->scene;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        flux_w[c] = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const struct io_light *const light = &scene->lights[i];
        for (int p = 0; p < render_light_places(light) && render_light_shines(light); p++) {
            const struct io_light place =
                render_light_place_of(light, point, number, p, sum->view->light_place_count);
            add_light(sum, &place, point, area_mm2, flux_w);
        }
    }
}

/* Light from all around enters, too, by the smooth normal. */
static void light_from_around(const struct render_sum *sum, const struct render_surface_point *point,
                              uint64_t number, double area_mm2, double flux_w[IO_CHANNEL_COUNT])
{
    const size_t medium = sum->media->of_object[point->object];
    double irradiance[3], share[3] = { 1, 1, 1 };
    render_exact_irradiance_at(sum->irradiance[medium], point->normal, irradiance);
    if (sum->visibility[medium])
        render_visibility_share(sum->visibility[medium], point->position_mm, point->normal,
                                point->facet_normal, number, share);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        flux_w[c] += area_mm2 * share[c] * irradiance[c];
}

static struct render_profile *profile_of(const struct render_sum *sum, size_t object)
{
    return sum->profiles[sum->media->of_object[object]];
}

static void take_part(void *context, int part)
{
    struct render_sum *const sum = context;
    const double point_count = (double)sum->pass.point_count;
    const double area_mm2 = sum->area_mm2 / point_count * (sum->pass.is_joined ? 0.5 : 1);
    const size_t begin = (size_t)part * PART_POINTS;
    for (int half = 0; half < 2; half++) {
        const uint64_t seed = 2 * (uint64_t)sum->pass.point_count + (uint64_t)half;
        for (size_t i = begin; i < begin + PART_POINTS && i < sum->count; i++) {
            const uint64_t number = sum->first + i;
            struct sample *const sample = &sum->samples[(half == 1 ? sum->count : 0) + i];
            struct render_surface_point point;
            render_surface_at(sum->surface, ((double)number + random_of(seed, number)) / point_count,
                              &point);
            *sample = (struct sample){ .object = point.object };
            for (int k = 0; k < 3; k++)
                sample->position_mm[k] = point.position_mm[k];
            if (profile_of(sum, point.object))
                light_point(sum, &point, 2 * number + (uint64_t)half, area_mm2, sample->flux_w);
            if (profile_of(sum, point.object) && sum->sky.environment)
                light_from_around(sum, &point, 2 * number + (uint64_t)half, area_mm2, sample->flux_w);
        }
    }
}

static bool is_lit(const struct sample *sample)
{
    return sample->flux_w[0] + sample->flux_w[1] + sample->flux_w[2] > 0;
}

static struct entry *entry_of(struct render_sum *sum, size_t sample)
{
    const bool is_second = sample >= sum->count && !sum->pass.is_joined;
    return &sum->entries[is_second ? 1 : 0][sum->samples[sample].object];
}

/* Leave out what is dark, and put together what enters the same object. */
static bool sort_samples(struct render_sum *sum, dipole_status *status)
{
    size_t lit_count = 0;
    for (size_t i = 0; i < 2 * sum->count; i++) {
        if (is_lit(&sum->samples[i])) {
            entry_of(sum, i)->count++;
            lit_count++;
        }
    }
    sum->points = aligned_alloc(sizeof(render_lanes), (lit_count + 1) * sizeof *sum->points);
    if (!sum->points)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu samples", lit_count);
    struct render_tree_point *next = sum->points;
    for (int half = 0; half < 2; half++) {
        for (size_t i = 0; i < sum->view->scene->object_count; i++) {
            sum->entries[half][i].points = next;
            next += sum->entries[half][i].count;
            sum->entries[half][i].count = 0;
        }
    }
    for (size_t i = 0; i < 2 * sum->count; i++) {
        const struct sample *const sample = &sum->samples[i];
        if (!is_lit(sample))
            continue;
        struct entry *const entry = entry_of(sum, i);
        struct render_tree_point *const point = &entry->points[entry->count++];
        *point = (struct render_tree_point){ .unused = 0 };
        for (int k = 0; k < 3; k++) {
            point->position_mm[k] = sample->position_mm[k];
            point->flux_w[k] = sample->flux_w[k];
        }
    }
    free(sum->samples);
    sum->samples = NULL;
    return true;
}

static void plant(void *context, int index)
{
    struct render_sum *const sum = context;
    const size_t object_count = sum->view->scene->object_count, i = (size_t)index;
    struct entry *const entry = &sum->entries[i / object_count][i % object_count];
    sum->statuses[i] = (dipole_status){ .code = DIPOLE_OK };
    if (entry->count > 0 &&
        !render_tree_create(entry->points, entry->count, &entry->tree, &sum->statuses[i]))
        entry->tree = NULL; /* its status says so */
}

bool render_sum_take(struct render_sum *sum, const struct render_sum_pass *pass, size_t first, size_t count,
                     dipole_status *status)
{
    const size_t object_count = sum->view->scene->object_count;
    forget_chunk(sum);
    sum->pass = *pass;
    sum->first = first;
    sum->count = count;
    sum->samples = malloc(2 * count * sizeof *sum->samples);
    if (!sum->samples)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu samples", 2 * count);
    for (size_t i = 0; i < sum->media->count; i++) {
        if (sum->profiles[i])
            render_profile_set_core(sum->profiles[i], &sum->media->media[i],
                                    CORE_SPACINGS * spacing_mm(sum, (double)pass->point_count));
    }
    lut_parallel_for((int)((count + PART_POINTS - 1) / PART_POINTS), sum->thread_count, take_part, sum);
    if (!sort_samples(sum, status))
        return false;
    lut_parallel_for((int)(2 * object_count), sum->thread_count, plant, sum);
    for (size_t i = 0; i < 2 * object_count; i++) {
        if (sum->statuses[i].code != DIPOLE_OK)
            return dipole_fail(status, sum->statuses[i].code, NULL, "%s", sum->statuses[i].message);
    }
    return true;
}

/* ---- sums --------------------------------------------------------------------------------------- */

/* Radiosity hardly differs within a group of a pixel's points: that of its middle does for all. */
struct group {
    double middle_mm[3], exit_per_sr;
    size_t object, pixel;
};

struct tile {
    struct group groups[TILE_GROUPS];
    size_t count;
};

static void see_pixel(const struct render_sum *sum, int x, int y, struct tile *tile)
{
    struct render_pixel pixel;
    render_pixel_trace(sum->view, x, y, &pixel);
    for (int g = 0; g < pixel.group_count; g++) {
        const struct render_pixel_group *const seen = &pixel.groups[g];
        struct group *const group = &tile->groups[tile->count++];
        *group = (struct group){ .object = seen->points[0].object,
                                 .pixel = (size_t)y * (size_t)sum->view->width_px + (size_t)x };
        for (int i = 0; i < seen->count; i++) {
            group->exit_per_sr += render_pixel_exit_per_sr(sum->view, &seen->points[i]) / RENDER_PIXEL_RAYS;
            for (int k = 0; k < 3; k++)
                group->middle_mm[k] += seen->points[i].position_mm[k] / seen->count;
        }
    }
}

static bool is_near(const struct render_sum *sum, const struct group *a, const struct group *b)
{
    const double limit_mm = TILE_SHARE * sum->view->media[a->object].group_mm;
    double square = 0;
    for (int k = 0; k < 3; k++)
        square += (a->middle_mm[k] - b->middle_mm[k]) * (a->middle_mm[k] - b->middle_mm[k]);
    return a->object == b->object && square <= limit_mm * limit_mm;
}

static void add_targets(const struct render_sum *sum, const struct group *groups,
                        struct render_tree_targets *targets)
{
    const size_t object = groups->object;
    const double chunk_count = ceil((double)sum->pass.point_count / RENDER_SUM_CHUNK);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        targets->least[c] = sum->pass.least[c] / sum->view->media[object].exit_scale_per_sr / chunk_count;
    for (int half = 0; half < 2; half++) {
        const struct render_tree *const tree = sum->entries[half][object].tree;
        if (!tree)
            continue;
        for (int i = 0; i < targets->count; i++)
            targets->sums[i] = (render_lanes){ 0 };
        render_tree_add(tree, profile_of(sum, object), targets);
        for (int i = 0; i < targets->count; i++) {
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                sum->halves[half][3 * groups[i].pixel + (size_t)c] +=
                    groups[i].exit_per_sr * targets->sums[i][c];
        }
    }
}

/* Sum for groups that are near each other, together. */
static void add_tile(const struct render_sum *sum, struct tile *tile)
{
    while (tile->count > 0) {
        struct group taken[RENDER_TREE_TARGETS] = { { .object = 0 } };
        struct render_tree_targets targets = { .count = 0 };
        const struct group first = tile->groups[0];
        size_t left = 0;
        for (size_t i = 0; i < tile->count; i++) {
            const struct group *const group = &tile->groups[i];
            if (targets.count == RENDER_TREE_TARGETS || !is_near(sum, &first, group)) {
                tile->groups[left++] = *group;
                continue;
            }
            for (int k = 0; k < 3; k++)
                targets.position_mm[targets.count][k] = group->middle_mm[k];
            taken[targets.count++] = *group;
        }
        tile->count = left;
        add_targets(sum, taken, &targets);
    }
}

static int tiles_along(const struct render_sum_pass *pass, int side_px)
{
    const int tile_px = pass->step_px > 1 ? pass->step_px : TILE_PX;
    return (side_px + tile_px - 1) / tile_px;
}

static void add_tile_number(void *context, int index)
{
    const struct render_sum *const sum = context;
    const int step_px = sum->pass.step_px, tile_px = step_px > 1 ? step_px : TILE_PX;
    const int across = tiles_along(&sum->pass, sum->view->width_px);
    const int x0 = index % across * tile_px, y0 = (sum->first_band + index / across) * tile_px;
    struct tile tile = { .count = 0 };
    for (int y = y0 + step_px / 2; y < y0 + tile_px && y < sum->view->height_px; y += step_px) {
        for (int x = x0 + step_px / 2; x < x0 + tile_px && x < sum->view->width_px; x += step_px)
            see_pixel(sum, x, y, &tile);
    }
    add_tile(sum, &tile);
}

int render_sum_band_count(const struct render_sum *sum, const struct render_sum_pass *pass)
{
    return tiles_along(pass, sum->view->height_px);
}

void render_sum_add_bands(struct render_sum *sum, const struct render_sum_pass *pass, int first, int count,
                          double *const halves[2])
{
    sum->pass = *pass;
    sum->first_band = first;
    sum->halves = halves;
    lut_parallel_for(count * tiles_along(pass, sum->view->width_px), sum->thread_count, add_tile_number,
                     sum);
}
