#include "renderer/environment.h"

#include "io/image.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum {
    ROW_POINTS = 8, /* of Gauss's rule on a part of a row that is a radian or less of the highest order */
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
                if (!(rgb[c] * value <= RENDER_ENVIRONMENT_RADIANCE_LIMIT))
                    return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                                       "the map's radiance, scaled, is %g in pixel (%d, %d), expected at "
                                       "most %g",
                                       rgb[c] * value, x, y, RENDER_ENVIRONMENT_RADIANCE_LIMIT);
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
    size_t quarter;       /* columns of a quarter of a row, the one in the middle with them */
    double (*columns)[2]; /* of each order and column of a quarter, before the map is turned */
    double turns[ORDERS][2];
    struct waves *rows;
};

/* Sums over the four columns where cosines of even m, of odd m, sines of even m, of odd m are the same but
 * for their sign; at most RENDER_ENVIRONMENT_SIDE_LIMIT / 4 of each, 196 kB. */
enum { COSINES_EVEN, COSINES_ODD, SINES_EVEN, SINES_ODD, FOLDS };
struct folded {
    double sums[FOLDS][RENDER_ENVIRONMENT_SIDE_LIMIT / 4 + 1][3];
};

/* phi is that of column x, pi - phi of the one as far before half of the row, phi - pi and -phi of those
 * half a row on. */
static void fold_row(const float *pixels, size_t width, size_t quarter, struct folded *folded)
{
    const size_t half = width / 2;
    for (size_t x = 0; x < quarter; x++) {
        const size_t mirrored = half - 1 - x;
        const double weight = mirrored == x ? 0.5 : 1; /* the middle of an odd half is its own mirror */
        for (size_t c = 0; c < 3; c++) {
            const double at = (double)pixels[3 * x + c], across = (double)pixels[3 * (x + half) + c];
            const double mirror = (double)pixels[3 * mirrored + c],
                         opposite = (double)pixels[3 * (mirrored + half) + c];
            folded->sums[COSINES_EVEN][x][c] = weight * (at + across + mirror + opposite);
            folded->sums[COSINES_ODD][x][c] = weight * (at - across - mirror + opposite);
            folded->sums[SINES_EVEN][x][c] = weight * (at + across - mirror - opposite);
            folded->sums[SINES_ODD][x][c] = weight * (at - across + mirror - opposite);
        }
    }
}

static void add_row(void *context, int row)
{
    const struct projection *const projection = context;
    const struct render_environment *const environment = projection->environment;
    const size_t width = (size_t)environment->width_px, quarter = projection->quarter;
    struct waves *const waves = &projection->rows[row];
    struct folded folded;
    fold_row(environment->radiance + 3 * width * (size_t)row, width, quarter, &folded);
    for (size_t m = 0; m < ORDERS; m++) {
        const double(*const columns)[2] = (const double(*)[2])projection->columns + m * quarter;
        const double(*const even)[3] = (const double(*)[3])folded.sums[m % 2 ? COSINES_ODD : COSINES_EVEN];
        const double(*const odd)[3] = (const double(*)[3])folded.sums[m % 2 ? SINES_ODD : SINES_EVEN];
        double along[3] = { 0 }, across[3] = { 0 };
        for (size_t x = 0; x < quarter; x++) {
            for (size_t c = 0; c < 3; c++) {
                along[c] += even[x][c] * columns[x][0];
                across[c] += odd[x][c] * columns[x][1];
            }
        }
        const double cosine = projection->turns[m][0], sine = projection->turns[m][1];
        for (size_t c = 0; c < 3; c++) {
            waves->along[m][c] = along[c] * cosine - across[c] * sine;
            waves->across[m][c] = across[c] * cosine + along[c] * sine;
        }
    }
}

/* Longitude of a place in pixels from the left. */
static double longitude(const struct render_environment *environment, double x)
{
    return PI - 2 * PI * x / environment->width_px + environment->rotate_rad;
}

static void integrate_columns(struct projection *projection)
{
    const struct render_environment *const environment = projection->environment;
    const double width_rad = 2 * PI / environment->width_px;
    double(*columns)[2] = projection->columns;
    for (int m = 0; m < ORDERS; m++) {
        const double half = 0.5 * m * width_rad, chord = m > 0 ? width_rad * sin(half) / half : width_rad;
        projection->turns[m][0] = cos(m * environment->rotate_rad);
        projection->turns[m][1] = sin(m * environment->rotate_rad);
        for (size_t x = 0; x < projection->quarter; x++, columns++) {
            const double phi = m * (PI - width_rad * ((double)x + 0.5));
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
    const size_t quarter = (height + 1) / 2;
    struct projection projection = { .environment = environment,
                                     .quarter = quarter,
                                     .columns = calloc(ORDERS * quarter, sizeof *projection.columns),
                                     .rows = calloc(height, sizeof *projection.rows) };
    const bool done = projection.columns && projection.rows;
    if (done) {
        render_harmonics_init(&environment->harmonics);
        integrate_columns(&projection);
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
        memcpy(environment->rgb, rgb, sizeof environment->rgb);
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
