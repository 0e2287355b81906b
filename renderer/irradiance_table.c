#include "renderer/irradiance_table.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Of cubics through four nodes a step apart, between the middle two: largest product of the distances over
 * 4!, and largest sum of the weights' magnitudes. */
#define CUBIC_ERROR (3.0 / 128)
#define CUBIC_WEIGHTS 1.25

/* ---- how many nodes ----------------------------------------------------------------------------- */

/*
 * The largest fourth derivative along meridians and circles of latitude, of the channel where it is the
 * largest part of the mean. Both are trigonometric polynomials of degree l of what order l contributes,
 * whose derivatives are at most l times themselves (Bernstein), and that is at most sqrt((2 l + 1) / 4 pi)
 * times the length of its coefficients.
 */
static double fourth_derivative(const struct render_irradiance *irradiance)
{
    double largest = 0;
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int l = 1; l <= irradiance->order; l++) {
            double power = 0;
            for (int i = l * l; i < (l + 1) * (l + 1); i++)
                power += irradiance->coefficients[i][c] * irradiance->coefficients[i][c];
            sum += pow(l, 4) * sqrt((2 * l + 1) / (4 * PI) * power);
        }
        if (irradiance->mean[c] > 0)
            largest = fmax(largest, sum / irradiance->mean[c]);
    }
    return largest;
}

static double error_of(double derivative, int rows)
{
    return CUBIC_ERROR * (1 + CUBIC_WEIGHTS) * derivative * pow(PI / rows, 4);
}

static int rows_for(double derivative, double tolerance)
{
    const double rows = ceil(PI * pow(error_of(derivative, 1) / (pow(PI, 4) * tolerance), 0.25));
    return (int)fmin(fmax(rows, RENDER_IRRADIANCE_ROWS_MIN), RENDER_IRRADIANCE_ROWS_MAX);
}

int render_irradiance_table_rows(const struct render_irradiance *irradiance, double tolerance,
                                 double *error)
{
    const double derivative = fourth_derivative(irradiance);
    const int rows = rows_for(derivative, tolerance);
    if (error)
        *error = error_of(derivative, rows);
    return rows;
}

/* ---- nodes -------------------------------------------------------------------------------------- */

struct filling {
    struct render_irradiance_table *table;
    const struct render_harmonics *harmonics;
    double *cosines, *sines; /* of m times the longitudes of all columns, m by m */
    double *sums;            /* of each row, channel and column                  */
};

/* Longitudes count from -z: m half turns before +z. */
static void fill_waves(struct filling *filling)
{
    const size_t columns = (size_t)render_irradiance_table_columns(filling->table->rows);
    double *const cosines = filling->cosines, *const sines = filling->sines;
    const int order = filling->table->order;
    for (size_t i = 0; i < columns; i++) {
        cosines[i] = 1;
        sines[i] = 0;
        if (order > 0) {
            const double phi = 2 * PI * (double)i / (double)columns - PI;
            cosines[columns + i] = cos(phi);
            sines[columns + i] = sin(phi);
        }
    }
    for (size_t m = 2; m <= (size_t)order; m++) { /* the same angles in another order */
        const double sign = m % 2 ? 1 : -1;
        for (size_t i = 0, at = 0; i < columns; i++, at = (at + m) % columns) {
            cosines[m * columns + i] = sign * cosines[columns + at];
            sines[m * columns + i] = sign * sines[columns + at];
        }
    }
}

/* What all orders l add to m, in three channels. */
static void sum_orders(const struct render_irradiance_table *table, int m,
                       const double functions[RENDER_LEGENDRE_COUNT], double along[3], double across[3])
{
    for (int l = m; l <= table->order; l++) {
        const double p = (m > 0 ? sqrt(2.0) : 1) * functions[render_legendre_index(l, m)];
        const double *const a = table->coefficients[render_harmonic_index(l, m)];
        const double *const b = table->coefficients[render_harmonic_index(l, -m)];
        for (int c = 0; c < 3; c++) {
            along[c] += p * a[c];
            across[c] += m > 0 ? p * b[c] : 0;
        }
    }
}

static void fill_row(void *context, int row)
{
    const struct filling *const filling = context;
    const struct render_irradiance_table *const table = filling->table;
    const size_t columns = (size_t)render_irradiance_table_columns(table->rows);
    const double theta = PI * row / table->rows;
    double functions[RENDER_LEGENDRE_COUNT];
    render_harmonics_legendre(filling->harmonics, table->order, cos(theta), sin(theta), functions);
    for (int m = 0; m <= table->order; m++) {
        const double *const cosines = filling->cosines + (size_t)m * columns;
        const double *const sines = filling->sines + (size_t)m * columns;
        double along[3] = { 0 }, across[3] = { 0 };
        sum_orders(table, m, functions, along, across);
        for (size_t c = 0; c < 3; c++) {
            double *const sums = filling->sums + (3 * (size_t)row + c) * columns;
            for (size_t i = 0; i < columns; i++)
                sums[i] += along[c] * cosines[i] + across[c] * sines[i];
        }
    }
}

/* Rows past a pole go on behind it, half a turn around. */
static void fill_nodes(struct filling *filling)
{
    struct render_irradiance_table *const table = filling->table;
    const int rows = table->rows, columns = render_irradiance_table_columns(rows);
    float(*node)[4] = table->nodes;
    for (int j = -1; j <= rows + 1; j++) {
        const int row = j < 0 ? -j : j > rows ? 2 * rows - j : j, turn = row == j ? 0 : rows;
        const double *const sums = filling->sums + 3 * (size_t)row * (size_t)columns;
        for (int i = -1; i <= columns + 1; i++, node++) {
            const int column = (i + turn + columns) % columns;
            for (int c = 0; c < 3; c++)
                (*node)[c] = (float)sums[c * columns + column];
        }
    }
}

/* ---- the table ---------------------------------------------------------------------------------- */

static size_t coefficient_count(int order)
{
    return (size_t)(order + 1) * (size_t)(order + 1);
}

static bool fill(const struct render_harmonics *harmonics, struct render_irradiance_table *table)
{
    const size_t columns = (size_t)render_irradiance_table_columns(table->rows);
    const size_t wave_count = columns * (size_t)(table->order + 1);
    struct filling filling = {
        .table = table,
        .harmonics = harmonics,
        .cosines = malloc(wave_count * sizeof *filling.cosines),
        .sines = malloc(wave_count * sizeof *filling.sines),
        .sums = calloc(3 * (size_t)(table->rows + 1) * columns, sizeof *filling.sums),
    };
    const bool done = filling.cosines && filling.sines && filling.sums;
    if (done) {
        fill_waves(&filling);
        lut_parallel_for(table->rows + 1, 0, fill_row, &filling);
        fill_nodes(&filling);
    }
    free(filling.cosines);
    free(filling.sines);
    free(filling.sums);
    return done;
}

bool render_irradiance_table_create(const struct render_irradiance *irradiance, double tolerance,
                                    struct render_irradiance_table **table_out, dipole_status *status)
{
    double error;
    const int rows = render_irradiance_table_rows(irradiance, tolerance, &error);
    const size_t count = coefficient_count(irradiance->order);
    *table_out = NULL;
    struct render_irradiance_table *const table = calloc(1, sizeof *table);
    if (table) {
        *table = (struct render_irradiance_table){
            .rows = rows,
            .node_count = render_irradiance_table_nodes(rows),
            .error = error,
            .eta = irradiance->eta,
            .order = irradiance->order,
            .coefficients = malloc(count * sizeof *table->coefficients),
        };
        table->nodes = calloc(table->node_count, sizeof *table->nodes);
    }
    bool done = table && table->nodes && table->coefficients;
    if (done) {
        memcpy(table->coefficients, irradiance->coefficients, count * sizeof *table->coefficients);
        done = fill(&irradiance->environment->harmonics, table);
    }
    if (!done) {
        render_irradiance_table_destroy(table);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory to tabulate the irradiance in %d rows", rows);
    }
    *table_out = table;
    return true;
}

void render_irradiance_table_destroy(struct render_irradiance_table *table)
{
    if (!table)
        return;
    free(table->nodes);
    free(table->coefficients);
    free(table);
}

bool render_irradiance_table_is_of(const struct render_irradiance_table *table,
                                   const struct render_irradiance *irradiance, double tolerance)
{
    return table->order == irradiance->order && table->eta == irradiance->eta &&
           memcmp(table->coefficients, irradiance->coefficients,
                  coefficient_count(table->order) * sizeof *table->coefficients) == 0 &&
           table->rows == render_irradiance_table_rows(irradiance, tolerance, NULL);
}

/* ---- between nodes ------------------------------------------------------------------------------ */

/* Lagrange's cubic through nodes -1, 0, 1, 2 at t. */
static void cubic(float t, float weights[4])
{
    const float before = t + 1, behind = t - 1, last = t - 2;
    weights[0] = t * behind * last * (-1.0F / 6);
    weights[1] = before * behind * last * 0.5F;
    weights[2] = before * t * last * -0.5F;
    weights[3] = before * t * behind * (1.0F / 6);
}

void render_irradiance_table_at(const struct render_irradiance_table *table, const double normal[3],
                                double rgb[3])
{
    const int columns = render_irradiance_table_columns(table->rows);
    const float x = (float)normal[0], y = (float)normal[1], z = (float)normal[2];
    const float v = atan2f(sqrtf(x * x + z * z), y) * (float)(1 / PI) * (float)table->rows;
    const float u = (atan2f(x, z) * (float)(0.5 / PI) + 0.5F) * (float)columns;
    const int row = v < (float)(table->rows - 1) ? (int)v : table->rows - 1;
    const int column = u < (float)(columns - 1) ? (int)u : columns - 1;
    const float(*node)[4] = (const float(*)[4])table->nodes + (size_t)row * (size_t)(columns + 3) + column;
    float down[4], around[4], sum[4] = { 0 };
    cubic(v - (float)row, down);
    cubic(u - (float)column, around);
    for (int j = 0; j < 4; j++, node += columns + 3) {
        for (int i = 0; i < 4; i++) {
            const float weight = down[j] * around[i];
            for (int c = 0; c < 4; c++)
                sum[c] += weight * node[i][c];
        }
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] > 0 ? (double)sum[c] : 0;
}
