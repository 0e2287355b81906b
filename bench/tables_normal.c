/*
 * The coordinate S: the paper packs the normal's two numbers into it, n_x in w steps times n_y in 64/w;
 * ours is the cosine that the response depends on. What each does to the response.
 */
#include "bench/tables.h"

#include <math.h>
#include <stdlib.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { POINT_COUNT = 40000, NODE_COUNT = 64 };

#define PI 3.14159265358979323846

/* How S is looked up. */
enum method { NEAREST = 0, LINEAR_NY, BILINEAR, COSINE };

/* One point: where the light enters as seen from it, and the normal there. */
struct point {
    double delta_mm[3], distance_mm, normal[3]; /* z towards the light */
};

static double response(const dipole_sources *sources, const struct point *point, double cosine)
{
    double value;
    cosine = fmin(fmax(cosine, -1), 1);
    dipole_sources_profile_per_mm2(sources, point->distance_mm, &cosine, 1, &value);
    return value;
}

/* With the normal of which x and y are given; outside the unit circle it lies at its edge. */
static double response_of_normal(const dipole_sources *sources, const struct point *point, double n_x,
                                 double n_y)
{
    const double length = fmax(sqrt(n_x * n_x + n_y * n_y), 1);
    const double x = n_x / length, y = n_y / length, z = sqrt(fmax(1 - x * x - y * y, 0));
    return response(sources, point,
                    (x * point->delta_mm[0] + y * point->delta_mm[1] + z * point->delta_mm[2]) /
                        point->distance_mm);
}

/* Texel i of count on -1 to 1. */
static double centre(int i, int count)
{
    return (2.0 * i + 1) / count - 1;
}

/* The texel at or below n, and how far on to the next; or the nearest. */
static int place(double n, int count, bool is_linear, double *fraction)
{
    const double x = fmin(fmax(0.5 * (n + 1) * count - 0.5, 0), count - 1);
    const int i = is_linear ? (int)fmin(floor(x), count - 2) : (int)floor(x + 0.5);
    *fraction = is_linear ? x - i : 0;
    return i;
}

static double looked_up(const dipole_sources *sources, const struct point *point, enum method method,
                        int width)
{
    double f_x, f_y, sum = 0;
    if (method == COSINE) {
        double cosine = 0;
        for (int k = 0; k < 3; k++)
            cosine += point->normal[k] * point->delta_mm[k] / point->distance_mm;
        const double s = 0.5 * (cosine + 1) * (NODE_COUNT - 1);
        const int i = (int)fmin(fmax(floor(s), 0), NODE_COUNT - 2);
        return (1 - (s - i)) * response(sources, point, 2.0 * i / (NODE_COUNT - 1) - 1) +
               (s - i) * response(sources, point, 2.0 * (i + 1) / (NODE_COUNT - 1) - 1);
    }
    const int height = NODE_COUNT / width;
    const int x = place(point->normal[0], width, method == BILINEAR, &f_x);
    const int y = place(point->normal[1], height, method != NEAREST, &f_y);
    for (int k = 0; k < 4; k++) {
        const double weight = (k & 1 ? f_x : 1 - f_x) * (k & 2 ? f_y : 1 - f_y);
        if (weight > 0)
            sum += weight * response_of_normal(sources, point, centre(x + (k & 1), width),
                                               centre(y + (k >> 1), height));
    }
    return sum;
}

static struct point point_choose(const struct lut_tsm *lut, uint64_t *random)
{
    const int sample = (int)(lut_random(random) * lut->sample_count);
    const double t = lut_random(random) * (lut->size[1] - 1), z = 0.1 + 0.9 * lut_random(random),
                 angle = 2 * PI * lut_random(random), rho = sqrt(1 - z * z);
    struct point point = { .delta_mm = { -lut->samples[sample].offset_mm[0],
                                         -lut->samples[sample].offset_mm[1], -lut_tsm_depth_mm(lut, t) },
                           .normal = { rho * cos(angle), rho * sin(angle), z } };
    point.distance_mm = hypot(hypot(point.delta_mm[0], point.delta_mm[1]), point.delta_mm[2]);
    return point;
}

/* All channels at the same points for every method. */
static struct lut_error error_of(const struct bench_volume *volume, enum method method, int width,
                                 double *errors)
{
    const struct lut_tsm_plan *const plan = volume->plan;
    uint64_t random = LUT_SEED_CHECK;
    size_t count = 0;
    for (int i = 0; i < POINT_COUNT; i++) {
        const struct point point = point_choose(&volume->lut, &random);
        double cosine = 0;
        for (int k = 0; k < 3; k++)
            cosine += point.normal[k] * point.delta_mm[k] / point.distance_mm;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double exact = response(&plan->sources[c], &point, cosine);
            errors[count++] = fabs(looked_up(&plan->sources[c], &point, method, width) - exact) /
                              fmax(exact, plan->profiles[c].floor_per_mm2);
        }
    }
    return lut_error_of(errors, count);
}

void bench_normals(const struct bench *bench)
{
    static const char *const names[] = { "marble", "skin1", "spectralon", "wholemilk" };
    static const int widths[] = { 2, 4, 8, 16, 32 }, size[3] = { 64, 64, 32 };
    static const char *const methods[] = { "nearest", "linear along n_y", "bilinear, two fetches" };
    static double errors[POINT_COUNT * IO_CHANNEL_COUNT];
    struct bench_volume volumes[COUNT(names)];
    printf("| coordinate S of 64 texels |");
    for (size_t i = 0; i < COUNT(names); i++) {
        const struct io_material material = bench_material(bench, names[i]);
        bench_volume_begin(&material, size, false, &volumes[i]);
        printf(" %s |", names[i]);
    }
    printf("\n|---|---|---|---|---|\n");
    for (int method = NEAREST; method <= COSINE; method++)
        for (size_t k = 0; k < (method == COSINE ? 1 : COUNT(widths)); k++) {
            if (method == COSINE)
                printf("| **64 cosines, linear: ours** |");
            else
                printf("| %d × %d normals, %s |", widths[k], NODE_COUNT / widths[k], methods[method]);
            for (size_t i = 0; i < COUNT(names); i++) {
                const struct lut_error error =
                    error_of(&volumes[i], (enum method)method, widths[k], errors);
                printf(" %.2g (%.2g) |", error.p99, error.max);
            }
            printf("\n");
            fflush(stdout);
        }
    for (size_t i = 0; i < COUNT(names); i++)
        bench_volume_end(&volumes[i]);
}
