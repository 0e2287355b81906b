#include "renderer/environment_visibility.h"

#include "renderer/projection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { CUMULATIVE_NODES = 4096, ROWS_LIMIT = 256 };

/* The turn from one ray to the next that fills the circle most evenly. */
#define GOLDEN_TURN 2.39996322972865332

struct ray {
    double cosine, sine, phi;
};

struct render_visibility {
    const struct render_tracer *tracer;
    const struct render_environment *environment;
    int ray_count;
    struct ray *rays;
    int rows;   /* of the smoothed map, twice as many columns */
    float *map; /* x 3                                        */
};

/* Directions so that each stands for the same part of the kernel: strata of its integral over mu, turned
 * from one to the next. */
static bool aim_rays(struct render_visibility *visibility, double eta)
{
    double *const sums = calloc(CUMULATIVE_NODES + 1, sizeof *sums);
    if (!sums)
        return false;
    for (int i = 0; i < CUMULATIVE_NODES; i++) {
        const double mu = (i + 0.5) / CUMULATIVE_NODES;
        sums[i + 1] = sums[i] + (1 - dipole_fresnel_reflectance(eta, mu)) * mu;
    }
    int node = 0;
    for (int i = 0; i < visibility->ray_count; i++) {
        const double part = (i + 0.5) / visibility->ray_count * sums[CUMULATIVE_NODES];
        while (node + 1 < CUMULATIVE_NODES && sums[node + 1] < part)
            node++;
        const double step = sums[node + 1] - sums[node];
        const double mu = (node + (step > 0 ? (part - sums[node]) / step : 0.5)) / CUMULATIVE_NODES;
        visibility->rays[i] =
            (struct ray){ .cosine = mu, .sine = sqrt(fmax(1 - mu * mu, 0)), .phi = GOLDEN_TURN * i };
    }
    free(sums);
    return true;
}

/* Means of the map over patches about as large as the solid angle of a ray. */
static void smooth_map(struct render_visibility *visibility)
{
    const struct render_environment *const environment = visibility->environment;
    const int rows = visibility->rows, columns = 2 * rows;
    for (int y = 0; y < rows; y++) {
        for (int x = 0; x < columns; x++) {
            const int y0 = (int)((int64_t)y * environment->height_px / rows),
                      y1 = (int)((int64_t)(y + 1) * environment->height_px / rows);
            const int x0 = (int)((int64_t)x * environment->width_px / columns),
                      x1 = (int)((int64_t)(x + 1) * environment->width_px / columns);
            double sum[3] = { 0 }, weight = 0;
            for (int j = y0; j < y1; j++) {
                const double sr = sin(PI * (j + 0.5) / environment->height_px);
                for (int i = x0; i < x1; i++) {
                    const size_t pixel = (size_t)j * (size_t)environment->width_px + (size_t)i;
                    for (size_t c = 0; c < 3; c++)
                        sum[c] += sr * (double)environment->radiance[3 * pixel + c];
                    weight += sr;
                }
            }
            for (int c = 0; c < 3; c++)
                visibility->map[3 * (y * columns + x) + c] = (float)(sum[c] / weight);
        }
    }
}

bool render_visibility_create(const struct render_tracer *tracer,
                              const struct render_environment *environment, double eta, int ray_count,
                              struct render_visibility **visibility_out, dipole_status *status)
{
    *visibility_out = NULL;
    struct render_visibility *const visibility = calloc(1, sizeof *visibility);
    bool done = visibility != NULL;
    if (done) {
        const int wanted = (int)ceil(sqrt(ray_count));
        visibility->tracer = tracer;
        visibility->environment = environment;
        visibility->ray_count = ray_count;
        visibility->rows = wanted < environment->height_px ? wanted : environment->height_px;
        visibility->rays = calloc((size_t)ray_count, sizeof *visibility->rays);
        visibility->map =
            calloc(6 * (size_t)visibility->rows * (size_t)visibility->rows, sizeof *visibility->map);
        done = visibility->rays && visibility->map && aim_rays(visibility, eta);
    }
    if (done) {
        smooth_map(visibility);
        *visibility_out = visibility;
        return true;
    }
    render_visibility_destroy(visibility);
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %d rays", ray_count);
}

void render_visibility_destroy(struct render_visibility *visibility)
{
    if (!visibility)
        return;
    free(visibility->rays);
    free(visibility->map);
    free(visibility);
}

/* Two unit vectors at right angles to the normal and each other (Duff et al. 2017). */
static void basis(const double normal[3], double across[3], double along[3])
{
    const double sign = normal[2] < 0 ? -1 : 1;
    const double a = -1 / (sign + normal[2]), b = normal[0] * normal[1] * a;
    across[0] = 1 + sign * normal[0] * normal[0] * a;
    across[1] = sign * b;
    across[2] = -sign * normal[0];
    along[0] = b;
    along[1] = sign + normal[1] * normal[1] * a;
    along[2] = -normal[1];
}

static const float *radiance_at(const struct render_visibility *visibility, const double direction[3])
{
    const int rows = visibility->rows, columns = 2 * rows;
    const double theta = acos(fmin(fmax(direction[1], -1), 1));
    double turn = (PI + visibility->environment->rotate_rad - atan2(direction[0], direction[2])) / (2 * PI);
    turn -= floor(turn);
    const int y = (int)fmin(theta / PI * rows, rows - 1), x = (int)fmin(turn * columns, columns - 1);
    return visibility->map + 3 * (y * columns + x);
}

/* A number of a point as an angle: SplitMix64's last step. */
static double turn_of(uint64_t number)
{
    uint64_t x = number + 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return 2 * PI * ((double)((x ^ (x >> 31)) >> 11) * 0x1p-53);
}

void render_visibility_share(const struct render_visibility *visibility, const double position_mm[3],
                             const double normal[3], const double facet_normal[3], uint64_t number,
                             double share[3])
{
    double across[3], along[3], seen[3] = { 0 }, all[3] = { 0 };
    const double turn = turn_of(number);
    int clear_count = 0;
    basis(normal, across, along);
    for (int i = 0; i < visibility->ray_count; i++) {
        const struct ray *const ray = &visibility->rays[i];
        const double x = ray->sine * cos(ray->phi + turn), y = ray->sine * sin(ray->phi + turn);
        double direction[3], traced[3];
        for (int k = 0; k < 3; k++)
            direction[k] = x * across[k] + y * along[k] + ray->cosine * normal[k];
        /* A smooth normal sees past the plane of its facet, which cannot: what is mirrored there decides.
         */
        const double behind = fmin(render_dot(direction, facet_normal), 0);
        for (int k = 0; k < 3; k++)
            traced[k] = direction[k] - 2 * behind * facet_normal[k];
        const bool is_clear =
            render_tracer_is_clear(visibility->tracer, position_mm, facet_normal, traced, INFINITY);
        const float *const radiance = radiance_at(visibility, direction);
        clear_count += is_clear;
        for (int c = 0; c < 3; c++) {
            all[c] += (double)radiance[c];
            seen[c] += is_clear ? (double)radiance[c] : 0;
        }
    }
    for (int c = 0; c < 3; c++)
        share[c] = all[c] > 0 ? seen[c] / all[c] : (double)clear_count / visibility->ray_count;
}
