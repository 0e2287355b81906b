#include "renderer/reference_environment.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum {
    ROWS = 96, /* between +y and -y; twice as many columns around  */
    COLUMNS = 2 * ROWS,
    KERNEL_NODES = 8192,
    FINE_WIDTH = 1024, /* a map whose pixels are points             */
    POINT_LIMIT = 8,   /* along either side of a pixel              */
};

/* A point of the sky. */
struct source {
    double direction[3];
    double flux[3]; /* radiance times solid angle */
};

struct render_exact_irradiance {
    struct source *sources;
    size_t source_count;
    double kernel[KERNEL_NODES + 2]; /* F_t(mu) mu at mu = i / KERNEL_NODES */
    double (*table)[3];              /* ROWS + 1 rows of COLUMNS            */
};

/* ---- the sky as points -------------------------------------------------------------------------- */

/* Points of a pixel by Gauss's rule in either direction. */
static void add_pixel(const struct render_environment *environment, int x, int y, int side,
                      struct render_exact_irradiance *irradiance)
{
    double points[POINT_LIMIT], weights[POINT_LIMIT];
    const float *const radiance =
        environment->radiance + 3 * ((size_t)y * (size_t)environment->width_px + (size_t)x);
    if (!(radiance[0] + radiance[1] + radiance[2] > 0))
        return;
    render_legendre_rule(side, points, weights);
    for (int i = 0; i < side * side; i++) {
        const int across = i % side, down = i / side;
        const double v = y + 0.5 * (1 + points[down]);
        const double area = PI / environment->height_px * (2 * PI / environment->width_px) / 4;
        const double sr = area * weights[across] * weights[down] * sin(PI * v / environment->height_px);
        struct source *const source = &irradiance->sources[irradiance->source_count++];
        render_environment_direction(environment, x + 0.5 * (1 + points[across]), v, source->direction);
        for (int c = 0; c < 3; c++)
            source->flux[c] = sr * (double)radiance[c];
    }
}

/* A block of pixels as one point in the middle of its light. */
static void add_block(const struct render_environment *environment, int x0, int y0, int side,
                      struct render_exact_irradiance *irradiance)
{
    struct source sum = { .flux = { 0 } };
    double length2 = 0;
    for (int y = y0; y < y0 + side && y < environment->height_px; y++) {
        const double sr = PI / environment->height_px * (2 * PI / environment->width_px) *
                          sin(PI * (y + 0.5) / environment->height_px);
        for (int x = x0; x < x0 + side && x < environment->width_px; x++) {
            const float *const radiance =
                environment->radiance + 3 * ((size_t)y * (size_t)environment->width_px + (size_t)x);
            double direction[3];
            render_environment_direction(environment, x + 0.5, y + 0.5, direction);
            for (int c = 0; c < 3; c++) {
                sum.flux[c] += sr * (double)radiance[c];
                for (int k = 0; k < 3; k++)
                    sum.direction[k] += sr * (double)radiance[c] * direction[k];
            }
        }
    }
    for (int k = 0; k < 3; k++)
        length2 += sum.direction[k] * sum.direction[k];
    if (!(length2 > 0))
        return;
    for (int k = 0; k < 3; k++)
        sum.direction[k] /= sqrt(length2);
    irradiance->sources[irradiance->source_count++] = sum;
}

static bool list_sources(const struct render_environment *environment,
                         struct render_exact_irradiance *irradiance)
{
    const int width = environment->width_px, height = environment->height_px;
    const int block = width > FINE_WIDTH ? (width + FINE_WIDTH - 1) / FINE_WIDTH : 1;
    const int side = width >= FINE_WIDTH ? 1 : width >= 128 ? 2 : POINT_LIMIT;
    irradiance->sources = malloc((size_t)(width / block + 1) * (size_t)(height / block + 1) *
                                 (size_t)(side * side) * sizeof *irradiance->sources);
    for (int y = 0; irradiance->sources && y < height; y += block) {
        for (int x = 0; x < width; x += block) {
            if (block > 1)
                add_block(environment, x, y, block, irradiance);
            else
                add_pixel(environment, x, y, side, irradiance);
        }
    }
    return irradiance->sources != NULL;
}

/* ---- sums --------------------------------------------------------------------------------------- */

void render_exact_irradiance_sum(const struct render_exact_irradiance *irradiance, const double normal[3],
                                 double rgb[3])
{
    double sum[3] = { 0 };
    for (size_t i = 0; i < irradiance->source_count; i++) {
        const struct source *const source = &irradiance->sources[i];
        const double mu = source->direction[0] * normal[0] + source->direction[1] * normal[1] +
                          source->direction[2] * normal[2];
        if (!(mu > 0))
            continue;
        const double at = fmin(mu, 1) * KERNEL_NODES;
        const size_t node = (size_t)at;
        const double part = at - (double)node;
        const double kernel =
            irradiance->kernel[node] + part * (irradiance->kernel[node + 1] - irradiance->kernel[node]);
        for (int c = 0; c < 3; c++)
            sum[c] += kernel * source->flux[c];
    }
    memcpy(rgb, sum, sizeof sum);
}

static void fill_row(void *context, int row)
{
    struct render_exact_irradiance *const irradiance = context;
    const double theta = PI * row / ROWS;
    for (int column = 0; column < COLUMNS; column++) {
        const double phi = 2 * PI * column / COLUMNS;
        const double normal[3] = { sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi) };
        render_exact_irradiance_sum(irradiance, normal, irradiance->table[row * COLUMNS + column]);
    }
}

bool render_exact_irradiance_create(const struct render_environment *environment, double eta,
                                    int thread_count, struct render_exact_irradiance **irradiance_out,
                                    dipole_status *status)
{
    *irradiance_out = NULL;
    struct render_exact_irradiance *const irradiance = calloc(1, sizeof *irradiance);
    if (irradiance)
        irradiance->table = calloc((ROWS + 1) * (size_t)COLUMNS, sizeof *irradiance->table);
    if (!irradiance || !irradiance->table || !list_sources(environment, irradiance)) {
        render_exact_irradiance_destroy(irradiance);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to sum a map of %dx%d pixels",
                           environment->width_px, environment->height_px);
    }
    for (int i = 0; i < KERNEL_NODES + 2; i++) {
        const double mu = fmin((double)i / KERNEL_NODES, 1);
        irradiance->kernel[i] = (1 - dipole_fresnel_reflectance(eta, mu)) * mu;
    }
    lut_parallel_for(ROWS + 1, thread_count, fill_row, irradiance);
    *irradiance_out = irradiance;
    return true;
}

void render_exact_irradiance_destroy(struct render_exact_irradiance *irradiance)
{
    if (!irradiance)
        return;
    free(irradiance->sources);
    free(irradiance->table);
    free(irradiance);
}

/* ---- between normals ---------------------------------------------------------------------------- */

/* Lagrange's cubic through nodes -1, 0, 1, 2 at t. */
static void cubic(double t, double weights[4])
{
    weights[0] = -t * (t - 1) * (t - 2) / 6;
    weights[1] = (t + 1) * (t - 1) * (t - 2) / 2;
    weights[2] = -(t + 1) * t * (t - 2) / 2;
    weights[3] = (t + 1) * t * (t - 1) / 6;
}

void render_exact_irradiance_at(const struct render_exact_irradiance *irradiance, const double normal[3],
                                double rgb[3])
{
    const double v = acos(fmin(fmax(normal[1], -1), 1)) / PI * ROWS;
    const double u = (atan2(normal[0], normal[2]) / (2 * PI) + 1) * COLUMNS;
    const int row0 = (int)fmin(v, ROWS - 1), column0 = (int)u;
    double down[4], around[4], sum[3] = { 0 };
    cubic(v - row0, down);
    cubic(u - column0, around);
    for (int j = 0; j < 4; j++) {
        int row = row0 + j - 1, turn = 0; /* past a pole: on its other side */
        if (row < 0 || row > ROWS) {
            row = row < 0 ? -row : 2 * ROWS - row;
            turn = COLUMNS / 2;
        }
        for (int i = 0; i < 4; i++) {
            const int column = (column0 + i - 1 + turn + COLUMNS) % COLUMNS;
            for (int c = 0; c < 3; c++)
                sum[c] += down[j] * around[i] * irradiance->table[row * COLUMNS + column][c];
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(sum[c], 0);
}
