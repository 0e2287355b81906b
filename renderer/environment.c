#include "renderer/environment.h"

#include "io/image.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum {
    ROW_POINTS = 8, /* of Gauss's rule on a part of a row that is a radian or less of the highest order */
    KERNEL_POINTS = RENDER_RULE_LIMIT, /* of Gauss's rule on each panel, exact for degree 127            */
    KERNEL_PANELS = 40,                /* each half as wide as the one before                            */
    ORDERS = RENDER_HARMONIC_LIMIT + 1,
};

/* ---- the map ------------------------------------------------------------------------------------ */

static bool check_size(int width_px, int height_px, const dipole_place *place, dipole_status *status)
{
    if (height_px < 1 || width_px != 2 * height_px)
        return dipole_fail(
            status, DIPOLE_BAD_VALUE, place,
            "the map is %dx%d pixels, expected latitude and longitude: twice as wide as high", width_px,
            height_px);
    return width_px <= RENDER_ENVIRONMENT_SIDE_LIMIT ||
           dipole_fail(status, DIPOLE_BAD_VALUE, place, "the map is %dx%d pixels, expected at most %dx%d",
                       width_px, height_px, RENDER_ENVIRONMENT_SIDE_LIMIT,
                       RENDER_ENVIRONMENT_SIDE_LIMIT / 2);
}

/* Solid angle of each pixel of a row. */
static double pixel_sr(int width_px, int height_px, int row)
{
    const double upper = PI * row / height_px, lower = PI * (row + 1) / height_px;
    return 2 * PI / width_px * 2 * sin(0.5 * (lower + upper)) * sin(0.5 * (lower - upper));
}

/* Copy the picture's radiance, negatives as 0, and find its mean. */
static bool take_pixels(const struct io_image *image, const double rgb[3], const dipole_place *place,
                        struct render_environment *environment, dipole_status *status)
{
    const size_t channels = (size_t)image->channel_count;
    double positive = 0, negative = 0;
    for (int y = 0; y < image->height_px; y++) {
        const double sr = pixel_sr(image->width_px, image->height_px, y);
        for (int x = 0; x < image->width_px; x++) {
            const size_t index = (size_t)y * (size_t)image->width_px + (size_t)x;
            for (size_t c = 0; c < 3; c++) {
                const double value = (double)image->pixels[channels * index + (channels < 3 ? 0 : c)];
                if (!isfinite(value))
                    return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                                       "the map holds %g in pixel (%d, %d), expected finite radiance",
                                       value, x, y);
                positive += sr * fmax(value, 0);
                negative += sr * fmax(-value, 0);
                environment->radiance[3 * index + c] = (float)(rgb[c] * fmax(value, 0));
                environment->mean[c] += sr / (4 * PI) * rgb[c] * fmax(value, 0);
            }
        }
    }
    return negative <= RENDER_ENVIRONMENT_NEGATIVE_LIMIT * positive ||
           dipole_fail(status, DIPOLE_BAD_VALUE, place,
                       "%.2g of the map's light is negative, expected at most %g", negative / positive,
                       RENDER_ENVIRONMENT_NEGATIVE_LIMIT);
}

/* ---- harmonics ---------------------------------------------------------------------------------- */

/* Integrals of cos(m phi), sin(m phi) over columns, and of a row's radiance times them. */
struct waves {
    double along[ORDERS][3], across[ORDERS][3];
};

struct projection {
    struct render_environment *environment;
    double (*columns)[2]; /* of each order and column */
    struct waves *rows;
};

static void add_row(void *context, int row)
{
    const struct projection *const projection = context;
    const struct render_environment *const environment = projection->environment;
    const size_t width = (size_t)environment->width_px;
    const float *const pixels = environment->radiance + 3 * width * (size_t)row;
    struct waves *const waves = &projection->rows[row];
    for (size_t m = 0; m < ORDERS; m++) {
        const double(*const columns)[2] = (const double(*)[2])projection->columns + m * width;
        double along[3] = { 0 }, across[3] = { 0 };
        for (size_t x = 0; x < width; x++) {
            for (size_t c = 0; c < 3; c++) {
                along[c] += (double)pixels[3 * x + c] * columns[x][0];
                across[c] += (double)pixels[3 * x + c] * columns[x][1];
            }
        }
        memcpy(waves->along[m], along, sizeof along);
        memcpy(waves->across[m], across, sizeof across);
    }
}

/* Longitude of a place in pixels from the left. */
static double longitude(const struct render_environment *environment, double x)
{
    return PI - 2 * PI * x / environment->width_px + environment->rotate_rad;
}

static void integrate_columns(const struct render_environment *environment, double (*columns)[2])
{
    const double width_rad = 2 * PI / environment->width_px;
    for (int m = 0; m < ORDERS; m++) {
        const double half = 0.5 * m * width_rad, chord = m > 0 ? width_rad * sin(half) / half : width_rad;
        for (int x = 0; x < environment->width_px; x++, columns++) {
            const double phi = m * longitude(environment, x + 0.5);
            (*columns)[0] = chord * cos(phi);
            (*columns)[1] = chord * sin(phi);
        }
    }
}

/* Integrals of the Legendre functions over the latitudes of a row. */
static void integrate_row(const struct render_environment *environment, int row,
                          double integrals[RENDER_LEGENDRE_COUNT])
{
    double points[ROW_POINTS], weights[ROW_POINTS], functions[RENDER_LEGENDRE_COUNT];
    const double height_rad = PI / environment->height_px;
    const int part_count = (int)ceil(height_rad * ORDERS);
    const double half = 0.5 * height_rad / part_count;
    render_legendre_rule(ROW_POINTS, points, weights);
    memset(integrals, 0, RENDER_LEGENDRE_COUNT * sizeof *integrals);
    for (int i = 0; i < part_count * ROW_POINTS; i++) {
        const int part = i / ROW_POINTS, point = i % ROW_POINTS;
        const double theta = height_rad * row + half * (2 * part + 1 + points[point]);
        const double weight = half * weights[point] * sin(theta);
        render_harmonics_legendre(&environment->harmonics, RENDER_HARMONIC_LIMIT, cos(theta), sin(theta),
                                  functions);
        for (int k = 0; k < RENDER_LEGENDRE_COUNT; k++)
            integrals[k] += weight * functions[k];
    }
}

static void add_waves(struct render_environment *environment, int row, const struct waves *waves)
{
    double integrals[RENDER_LEGENDRE_COUNT];
    integrate_row(environment, row, integrals);
    for (int l = 0; l < ORDERS; l++) {
        for (int m = 0; m <= l; m++) {
            const double factor = (m > 0 ? sqrt(2.0) : 1) * integrals[render_legendre_index(l, m)];
            double *const a = environment->coefficients[render_harmonic_index(l, m)];
            double *const b = environment->coefficients[render_harmonic_index(l, -m)];
            for (int c = 0; c < 3; c++) {
                a[c] += factor * waves->along[m][c];
                if (m > 0)
                    b[c] += factor * waves->across[m][c];
            }
        }
    }
}

static void find_power(struct render_environment *environment)
{
    double sum[3] = { 0 };
    for (int y = 0; y < environment->height_px; y++) {
        const double sr = pixel_sr(environment->width_px, environment->height_px, y);
        for (int x = 0; x < environment->width_px; x++) {
            for (int c = 0; c < 3; c++) {
                const double value =
                    (double)environment
                        ->radiance[3 * ((size_t)y * (size_t)environment->width_px + (size_t)x) + (size_t)c];
                sum[c] += sr * value * value;
            }
        }
    }
    for (int l = 0; l < ORDERS; l++) {
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            for (int c = 0; c < 3; c++)
                environment->power[l][c] +=
                    environment->coefficients[i][c] * environment->coefficients[i][c];
        }
        for (int c = 0; c < 3; c++)
            sum[c] -= environment->power[l][c];
    }
    for (int c = 0; c < 3; c++)
        environment->rest[c] = fmax(sum[c], 0);
}

static bool project(struct render_environment *environment, dipole_status *status)
{
    const size_t width = (size_t)environment->width_px, height = (size_t)environment->height_px;
    struct projection projection = { .environment = environment,
                                     .columns = calloc(ORDERS * width, sizeof *projection.columns),
                                     .rows = calloc(height, sizeof *projection.rows) };
    const bool done = projection.columns && projection.rows;
    if (done) {
        render_harmonics_init(&environment->harmonics);
        integrate_columns(environment, projection.columns);
        lut_parallel_for(environment->height_px, 0, add_row, &projection);
        for (int y = 0; y < environment->height_px; y++)
            add_waves(environment, y, &projection.rows[y]);
        find_power(environment);
    }
    free(projection.columns);
    free(projection.rows);
    return done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a map of %zux%zu pixels",
                               width, height);
}

bool render_environment_create(const struct io_image *image, const double rgb[3], double rotate_rad,
                               const dipole_place *place, struct render_environment **environment_out,
                               dipole_status *status)
{
    *environment_out = NULL;
    if (!check_size(image->width_px, image->height_px, place, status))
        return false;
    const size_t pixel_count = (size_t)image->width_px * (size_t)image->height_px;
    struct render_environment *const environment = calloc(1, sizeof *environment);
    if (environment) {
        environment->width_px = image->width_px;
        environment->height_px = image->height_px;
        environment->rotate_rad = rotate_rad;
        environment->radiance = malloc(3 * pixel_count * sizeof *environment->radiance);
        environment->coefficients = calloc(RENDER_HARMONIC_COUNT, sizeof *environment->coefficients);
    }
    bool done = environment && environment->radiance && environment->coefficients;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, place, "no memory for a map of %dx%d pixels",
                    image->width_px, image->height_px);
    done = done && take_pixels(image, rgb, place, environment, status) && project(environment, status);
    if (done)
        *environment_out = environment;
    else
        render_environment_destroy(environment);
    return done;
}

void render_environment_destroy(struct render_environment *environment)
{
    if (!environment)
        return;
    free(environment->radiance);
    free(environment->coefficients);
    free(environment);
}

/* EXRCore reads all but DWA, in a tenth of the time that OpenImageIO takes to begin. */
static bool read_image(const char *path, struct io_image **image_out, dipole_status *status)
{
    const char *const dot = strrchr(path, '.');
    dipole_status why = { 0 };
    if (dot && strcmp(dot, ".exr") == 0) {
        if (io_exr_read(path, image_out, &why))
            return true;
        if (why.code != DIPOLE_NOT_SUPPORTED) {
            if (status)
                *status = why;
            return false;
        }
    }
    return io_photo_read(path, IO_PHOTO_LINEAR, NULL, image_out, status);
}

bool render_environment_read(const struct io_environment *source,
                             struct render_environment **environment_out, dipole_status *status)
{
    const dipole_place place = { .source = source->path };
    struct io_image *image = NULL;
    int width_px, height_px;
    *environment_out = NULL;
    const bool done =
        io_photo_size(source->path, &width_px, &height_px, status) &&
        check_size(width_px, height_px, &place, status) && read_image(source->path, &image, status) &&
        render_environment_create(image, source->rgb, source->rotate_rad, &place, environment_out, status);
    io_image_destroy(image);
    return done;
}

bool render_environment_shines(const struct render_environment *environment)
{
    return environment->mean[0] > 0 || environment->mean[1] > 0 || environment->mean[2] > 0;
}

void render_environment_direction(const struct render_environment *environment, double x, double y,
                                  double direction[3])
{
    const double theta = PI * y / environment->height_px, phi = longitude(environment, x);
    direction[0] = sin(theta) * sin(phi);
    direction[1] = cos(theta);
    direction[2] = sin(theta) * cos(phi);
}

/* ---- the kernel --------------------------------------------------------------------------------- */

static void add_point(double eta, double cosine, double weight, struct render_kernel *kernel)
{
    const double value = (1 - dipole_fresnel_reflectance(eta, cosine)) * cosine;
    double p = 1, before = 0;
    for (int l = 0; l < ORDERS; l++) {
        kernel->transfer[l] += 2 * PI * weight * value * p;
        const double next = ((2.0 * l + 1) * cosine * p - l * before) / (l + 1);
        before = p;
        p = next;
    }
    kernel->square += 2 * PI * weight * value * value;
}

/*
 * F_t is analytic in the cosine but for where the square root of eta^2 - 1 + mu^2 begins: at total
 * reflection, or close to 0 for an eta just above 1. Panels are finer and finer toward it; where it lies in
 * the range the variable is the root itself.
 */
void render_kernel_init(double eta, struct render_kernel *kernel)
{
    double points[KERNEL_POINTS], weights[KERNEL_POINTS];
    const double least = eta < 1 ? sqrt((1 - eta) * (1 + eta)) : 0;
    render_legendre_rule(KERNEL_POINTS, points, weights);
    *kernel = (struct render_kernel){ .square = 0 };
    for (int panel = 0; panel < KERNEL_PANELS; panel++) {
        const double end = ldexp(1, -panel), begin = panel + 1 < KERNEL_PANELS ? 0.5 * end : 0;
        for (int i = 0; i < KERNEL_POINTS; i++) {
            const double half = 0.5 * (end - begin), u = begin + half * (1 + points[i]);
            const double cosine = eta < 1 ? least + (1 - least) * u * u : u;
            const double slope = eta < 1 ? 2 * (1 - least) * u : 1;
            add_point(eta, fmin(cosine, 1), half * weights[i] * slope, kernel);
        }
    }
}

/* ---- irradiance --------------------------------------------------------------------------------- */

double render_irradiance_error(const struct render_environment *environment,
                               const struct render_kernel *kernel, int order)
{
    double largest = 0, square = kernel->square;
    for (int l = 0; l < ORDERS; l++)
        square -= (2 * l + 1) / (4 * PI) * kernel->transfer[l] * kernel->transfer[l];
    for (int c = 0; c < 3; c++) {
        double sum = fmax(square, 0) * environment->rest[c] / (2 * ORDERS + 1);
        for (int l = order + 1; l < ORDERS; l++)
            sum += kernel->transfer[l] * kernel->transfer[l] * environment->power[l][c] / (4 * PI);
        if (environment->mean[c] > 0)
            largest = fmax(largest, sqrt(sum) / (kernel->transfer[0] * environment->mean[c]));
    }
    return largest;
}

static bool create(const struct render_environment *environment, double eta,
                   const struct render_kernel *kernel, int order, struct render_irradiance **irradiance_out,
                   dipole_status *status)
{
    const size_t count = (size_t)(order + 1) * (size_t)(order + 1);
    struct render_irradiance *const irradiance = calloc(1, sizeof *irradiance);
    double(*const coefficients)[3] = calloc(count, sizeof *coefficients);
    if (!irradiance || !coefficients) {
        free(irradiance);
        free(coefficients);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu harmonics", count);
    }
    *irradiance = (struct render_irradiance){ .environment = environment,
                                              .eta = eta,
                                              .order = order,
                                              .error = render_irradiance_error(environment, kernel, order),
                                              .coefficients = coefficients };
    for (int l = 0; l <= order; l++) {
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            for (int c = 0; c < 3; c++)
                coefficients[i][c] = kernel->transfer[l] * environment->coefficients[i][c];
        }
    }
    for (int c = 0; c < 3; c++)
        irradiance->mean[c] = kernel->transfer[0] * environment->mean[c];
    *irradiance_out = irradiance;
    return true;
}

bool render_irradiance_create_of_order(const struct render_environment *environment, double eta, int order,
                                       struct render_irradiance **irradiance_out, dipole_status *status)
{
    struct render_kernel kernel;
    *irradiance_out = NULL;
    render_kernel_init(eta, &kernel);
    return create(environment, eta, &kernel, order, irradiance_out, status);
}

bool render_irradiance_create(const struct render_environment *environment, double eta, double epsilon,
                              struct render_irradiance **irradiance_out, dipole_status *status)
{
    struct render_kernel kernel;
    int order = 0;
    *irradiance_out = NULL;
    render_kernel_init(eta, &kernel);
    while (order < RENDER_HARMONIC_LIMIT && render_irradiance_error(environment, &kernel, order) > epsilon)
        order++;
    return create(environment, eta, &kernel, order, irradiance_out, status);
}

void render_irradiance_destroy(struct render_irradiance *irradiance)
{
    if (!irradiance)
        return;
    free(irradiance->coefficients);
    free(irradiance);
}

void render_irradiance_at(const struct render_irradiance *irradiance, const double normal[3], double rgb[3])
{
    render_harmonics_sum(&irradiance->environment->harmonics, irradiance->order,
                         (const double(*)[3])irradiance->coefficients, normal, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(rgb[c], 0);
}
