#include "fit/estimate.h"

#include "fit/internal.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/*
 * The noise model. Errors of a picture that was computed, and of the operator it is compared with, are
 * relative: sampling, tables and exit factors scale what is there. So a pixel weighs 1/(B + floor); the
 * floor, 10 % of the mean, keeps dark pixels, whose relative errors are larger, from deciding.
 */
static const double floor_share = 0.1;

enum { FOLD_ROWS = 512, START_LIMIT = 4, GRID_SIDE = 4, PARAMETER_COUNT = 2 };

/* 97.5 % quantile of the normal distribution. */
static const double two_sided_95 = 1.959963984540054;

/* An interval wider than a factor of two either way tells an order of magnitude, not a value. */
static const double widest_log_half_width = 0.6931471805599453;

/* ---- the weighted, folded problem ------------------------------------------------------------------ */

static double radiosity_at(const struct fit_measurement *measurement, int channel, size_t pixel)
{
    return (double)measurement->radiosity_w_per_mm2[pixel * FIT_CHANNEL_COUNT + (size_t)channel];
}

static double weight_of(const struct fit_channel_system *system, double radiosity_w_per_mm2)
{
    return 1.0 / (fmax(radiosity_w_per_mm2, 0.0) + system->floor_w_per_mm2) /
           sqrt((double)system->pixel_count);
}

/* One weighted row [ H_j | B_j ]. */
static void system_row(const struct fit_channel_system *system, const struct fit_operator *op, int channel,
                       const struct fit_measurement *measurement, size_t pixel, double *row)
{
    const double *h = fit_operator_row(op, channel, pixel);
    const double b = radiosity_at(measurement, channel, pixel);
    const double weight = weight_of(system, b);
    for (size_t k = 0; k < op->node_count; k++)
        row[k] = weight * op->colour[channel] * h[k];
    row[op->node_count] = weight * b;
}

static double mean_radiosity(const struct fit_measurement *measurement, int channel, size_t pixel_count)
{
    double sum = 0.0;
    for (size_t j = 0; j < pixel_count; j++)
        sum += radiosity_at(measurement, channel, j);
    return sum / (double)pixel_count;
}

static bool system_fold(struct fit_channel_system *system, const struct fit_operator *op, int channel,
                        const struct fit_measurement *measurement, double *rows, dipole_status *status)
{
    const size_t column_count = op->node_count + 1;
    for (size_t first = 0; first < op->pixel_count; first += FOLD_ROWS) {
        const size_t rest = op->pixel_count - first;
        const size_t count = rest < FOLD_ROWS ? rest : FOLD_ROWS;
        for (size_t j = 0; j < count; j++)
            system_row(system, op, channel, measurement, first + j, rows + j * column_count);
        if (!fit_triangle_fold(system->triangle, column_count, rows, count, status))
            return false;
    }
    return true;
}

bool fit_channel_system_init(const struct fit_operator *op, int channel,
                             const struct fit_measurement *measurement, const dipole_medium *start,
                             struct fit_channel_system *out, dipole_status *status)
{
    const size_t column_count = op->node_count + 1;
    *out = (struct fit_channel_system){
        .node_count = op->node_count,
        .pixel_count = op->pixel_count,
        .node_r_mm = op->node_r_mm,
        .eta = start->eta,
        .fdr_kind = start->fdr_kind,
        .floor_w_per_mm2 = floor_share * mean_radiosity(measurement, channel, op->pixel_count),
        .triangle = calloc(column_count * column_count, sizeof(double)),
        .profile = malloc(3 * column_count * sizeof(double)),
    };
    assert(out->floor_w_per_mm2 > 0.0);
    double *rows = malloc(FOLD_ROWS * column_count * sizeof *rows);
    bool done = true;
    if (!out->triangle || !out->profile || !rows)
        done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the fit");
    done = done && system_fold(out, op, channel, measurement, rows, status);
    free(rows);
    if (!done)
        fit_channel_system_destroy(out);
    return done;
}

void fit_channel_system_destroy(struct fit_channel_system *system)
{
    free(system->triangle);
    free(system->profile);
    *system = (struct fit_channel_system){ 0 };
}

/* Profile and its two derivatives at the nodes, one after the other in system->profile. */
static bool evaluate_profile(const struct fit_channel_system *system, const double *log_sigmas)
{
    const dipole_medium medium = { .sigma_a_per_mm = exp(log_sigmas[0]),
                                   .sigma_s_prime_per_mm = exp(log_sigmas[1]),
                                   .eta = system->eta,
                                   .fdr_kind = system->fdr_kind };
    dipole_coefficients coefficients;
    if (!dipole_coefficients_init(&medium, &coefficients, NULL))
        return false;
    for (size_t k = 0; k < system->node_count; k++) {
        const dipole_gradient gradient = dipole_rd_gradient(&coefficients, system->node_r_mm[k]);
        system->profile[k] = dipole_rd_per_mm2(&coefficients, system->node_r_mm[k]);
        system->profile[system->node_count + k] = gradient.d_log_sigma_a;
        system->profile[2 * system->node_count + k] = gradient.d_log_sigma_s_prime;
    }
    return true;
}

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += a[i] * b[i];
    return sum;
}

bool fit_channel_residuals(const void *context, const double *parameters, double *residuals,
                           double *jacobian)
{
    const struct fit_channel_system *system = context;
    if (!evaluate_profile(system, parameters))
        return false;
    const size_t node_count = system->node_count;
    for (size_t i = 0; i <= node_count; i++) {
        const double *row = system->triangle + i * (node_count + 1);
        const size_t count = node_count - i; /* the triangle is 0 left of its diagonal */
        residuals[i] = dot(row + i, system->profile + i, count) - row[node_count];
        if (jacobian) {
            jacobian[2 * i] = dot(row + i, system->profile + node_count + i, count);
            jacobian[2 * i + 1] = dot(row + i, system->profile + 2 * node_count + i, count);
        }
    }
    return true;
}

/* ---- the search -------------------------------------------------------------------------------------- */

struct bounds {
    double lower[PARAMETER_COUNT], upper[PARAMETER_COUNT]; /* of log sigma_a, log sigma_s' */
};

/* A medium is worth considering when the scene could show it: from mean free paths of finest_mm up to far
 * beyond the scene, and down to absorption that the longest path would not feel. */
static struct bounds bounds_of_scene(const struct fit_operator *op, double finest_mm)
{
    const double largest_mm = op->node_r_mm[op->node_count - 1];
    return (struct bounds){
        .lower = { log(fmax(1e-9 / largest_mm, DIPOLE_SIGMA_MIN_PER_MM)),
                   log(fmax(1e-3 / largest_mm, DIPOLE_SIGMA_MIN_PER_MM)) },
        .upper = { log(fmin(1.0 / finest_mm, DIPOLE_SIGMA_MAX_PER_MM)),
                   log(fmin(1.0 / finest_mm, DIPOLE_SIGMA_MAX_PER_MM)) },
    };
}

struct candidate {
    double point[PARAMETER_COUNT];
    double sum_of_squares;
};

static double sum_of_squares_at(const struct fit_channel_system *system, const double *point,
                                double *residuals)
{
    if (!fit_channel_residuals(system, point, residuals, NULL))
        return INFINITY;
    return dot(residuals, residuals, system->node_count + 1);
}

/* Keep the best candidates, best first. */
static void candidate_insert(struct candidate *best, size_t count, const struct candidate *candidate)
{
    struct candidate moving = *candidate;
    for (size_t i = 0; i < count; i++) {
        if (moving.sum_of_squares < best[i].sum_of_squares) {
            const struct candidate pushed = best[i];
            best[i] = moving;
            moving = pushed;
        }
    }
}

/* The given start, and the best few of a coarse grid over the whole range: one search costs milliseconds,
 * a wrong valley costs the answer. */
static void choose_starts(const struct fit_channel_system *system, const dipole_medium *start,
                          const struct bounds *bounds, double *residuals, struct candidate *starts)
{
    static const double grid_albedos[GRID_SIDE] = { 0.9999, 0.995, 0.9, 0.5 };
    for (int p = 0; p < PARAMETER_COUNT; p++) {
        const double sigma_per_mm = p == 0 ? start->sigma_a_per_mm : start->sigma_s_prime_per_mm;
        starts[0].point[p] = fmin(fmax(log(sigma_per_mm), bounds->lower[p]), bounds->upper[p]);
    }
    for (size_t i = 1; i < START_LIMIT; i++)
        starts[i].sum_of_squares = INFINITY;
    const double longest = log(3.0 / system->node_r_mm[system->node_count - 1]);
    for (int i = 0; i < GRID_SIDE; i++) {
        const double share = (i + 0.5) / GRID_SIDE;
        const double log_sigma_t = (1.0 - share) * longest + share * bounds->upper[1];
        for (int k = 0; k < GRID_SIDE; k++) {
            struct candidate candidate = { .point = { log_sigma_t + log1p(-grid_albedos[k]),
                                                      log_sigma_t + log(grid_albedos[k]) } };
            for (int p = 0; p < PARAMETER_COUNT; p++)
                candidate.point[p] = fmin(fmax(candidate.point[p], bounds->lower[p]), bounds->upper[p]);
            candidate.sum_of_squares = sum_of_squares_at(system, candidate.point, residuals);
            candidate_insert(starts + 1, START_LIMIT - 1, &candidate);
        }
    }
}

static bool search(const struct fit_channel_system *system, const dipole_medium *start,
                   const struct bounds *bounds, struct fit_minimum *best, dipole_status *status)
{
    struct fit_least_squares problem = { .residuals = fit_channel_residuals,
                                         .context = system,
                                         .residual_count = system->node_count + 1,
                                         .parameter_count = PARAMETER_COUNT };
    memcpy(problem.lower, bounds->lower, sizeof bounds->lower);
    memcpy(problem.upper, bounds->upper, sizeof bounds->upper);
    double *residuals = malloc(problem.residual_count * sizeof *residuals);
    if (!residuals)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the fit");
    struct candidate starts[START_LIMIT];
    choose_starts(system, start, bounds, residuals, starts);
    free(residuals);

    int iteration_count = 0;
    for (size_t i = 0; i < START_LIMIT; i++) {
        struct fit_minimum minimum;
        if (!fit_least_squares_solve(&problem, starts[i].point, &minimum, status))
            return false;
        iteration_count += minimum.iteration_count;
        /* of equal minima the first, so that the given start decides where the picture cannot */
        if (i == 0 || minimum.sum_of_squares < 0.999 * best->sum_of_squares)
            *best = minimum;
    }
    best->iteration_count = iteration_count;
    return true;
}

/* ---- intervals --------------------------------------------------------------------------------------- */

/* Symmetric 2 x 2: { xx, xy, yy }. */
struct symmetric {
    double xx, xy, yy;
};

static void symmetric_add_square(struct symmetric *sum, double factor, const double v[2])
{
    sum->xx += factor * v[0] * v[0];
    sum->xy += factor * v[0] * v[1];
    sum->yy += factor * v[1] * v[1];
}

static double symmetric_form(const struct symmetric *m, const double u[2], const double v[2])
{
    return u[0] * (m->xx * v[0] + m->xy * v[1]) + u[1] * (m->xy * v[0] + m->yy * v[1]);
}

/*
 * Covariance of the two logarithms, with J the weighted Jacobian by pixels, r the residuals, B the picture,
 * m the mean of the picture at every pixel, weighted as B is, A = J'J, and sums over tiles t of the
 * picture:
 *
 *     C = A^-1 ( T/(T-2) sum_t (J_t' r_t)(J_t' r_t)'
 *              + tile_error^2 sum_t (J_t' B_t)(J_t' B_t)'
 *              + scale_error^2 (J' B)(J' B)'
 *              + offset_error^2 (J' m)(J' m)' ) A^-1
 *
 * First, what the residuals show, however they correlate within a tile (cluster-robust, "sandwich"). Then
 * what they need not show, because the coefficients can follow it: relative errors that vary over the
 * picture; an error of the whole picture's scale; light that is missing or in excess everywhere, as little
 * where it is bright as it is much where it is dark.
 *
 * A is inverted with J's columns scaled to length 1. Then its singular values are 1 + |rho| and 1 - |rho|,
 * rho being the columns' correlation: at |rho| = 1 the picture knows one combination only. 1 - rho^2 is
 * raised to rounding level, and the variances come out as large as they are.
 */
struct information {
    struct symmetric a;
    double variances[2];        /* of log sigma_a and log sigma_s'                            */
    double absorption_distance; /* standard error of the weighted picture along what sigma_a changes and
                                  sigma_s' cannot                                            */
    double rms_residual;
};
static const double rounding_level = 1e-12;

static void covariance_from(const struct symmetric *middle, struct information *information)
{
    const double length[2] = { sqrt(information->a.xx), sqrt(information->a.yy) };
    information->variances[0] = information->variances[1] = INFINITY;
    if (!(length[0] > 0.0) || !(length[1] > 0.0))
        return;
    const double rho = information->a.xy / (length[0] * length[1]);
    const double determinant = fmax(1.0 - rho * rho, rounding_level);
    /* rows of the inverse of { 1, rho; rho, 1 }, times the determinant and over the columns' lengths */
    const double rows[2][2] = { { 1.0 / length[0], -rho / length[1] },
                                { -rho / length[0], 1.0 / length[1] } };
    for (int p = 0; p < 2; p++) {
        const double form = symmetric_form(middle, rows[p], rows[p]);
        information->variances[p] = form / pow(determinant * length[p], 2.0);
        if (p == 0)
            information->absorption_distance = sqrt(form / determinant);
    }
}

/* Sums of one tile. */
struct tile {
    double by_residual[2], by_radiosity[2];
    bool is_used;
};

static bool gather_information(const struct fit_channel_system *system, const struct fit_operator *op,
                               int channel, const struct fit_measurement *measurement,
                               const double *parameters, struct information *out, dipole_status *status)
{
    const size_t node_count = op->node_count;
    struct tile *tiles = calloc((size_t)measurement->tile_count, sizeof *tiles);
    double *row = malloc((node_count + 1) * sizeof *row);
    if (!tiles || !row || !evaluate_profile(system, parameters)) {
        free(tiles);
        free(row);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the intervals");
    }
    *out = (struct information){ 0 };
    const double mean = mean_radiosity(measurement, channel, op->pixel_count);
    double sum_of_squares = 0.0, by_offset[2] = { 0.0 };
    for (size_t j = 0; j < op->pixel_count; j++) {
        system_row(system, op, channel, measurement, j, row);
        const double gradient[2] = { dot(row, system->profile + node_count, node_count),
                                     dot(row, system->profile + 2 * node_count, node_count) };
        const double residual = dot(row, system->profile, node_count) - row[node_count];
        struct tile *tile = &tiles[measurement->tiles[j]];
        tile->is_used = true;
        for (int p = 0; p < 2; p++) {
            tile->by_residual[p] += gradient[p] * residual;
            tile->by_radiosity[p] += gradient[p] * row[node_count];
        }
        for (int p = 0; p < 2; p++)
            by_offset[p] += gradient[p] * weight_of(system, radiosity_at(measurement, channel, j)) * mean;
        symmetric_add_square(&out->a, 1.0, gradient);
        sum_of_squares += residual * residual;
    }
    out->rms_residual = sqrt(sum_of_squares); /* rows carry 1 / sqrt(pixel_count) */

    double used_count = 0.0, total[2] = { 0.0 };
    struct symmetric seen = { 0 }, middle = { 0 };
    for (int t = 0; t < measurement->tile_count; t++) {
        used_count += tiles[t].is_used ? 1.0 : 0.0;
        symmetric_add_square(&seen, 1.0, tiles[t].by_residual);
        symmetric_add_square(&middle, pow(measurement->tile_error, 2.0), tiles[t].by_radiosity);
        for (int p = 0; p < 2; p++)
            total[p] += tiles[t].by_radiosity[p];
    }
    symmetric_add_square(&middle, pow(measurement->scale_error, 2.0), total);
    symmetric_add_square(&middle, pow(measurement->offset_error, 2.0), by_offset);
    const double few = used_count / fmax(used_count - 2.0, 0.5);
    middle.xx += few * seen.xx;
    middle.xy += few * seen.xy;
    middle.yy += few * seen.yy;
    covariance_from(&middle, out);
    free(tiles);
    free(row);
    return true;
}

/* Symmetric in the logarithm. */
static void interval(int parameter, const struct fit_minimum *minimum,
                     const struct information *information, const struct bounds *bounds, double ci95[2])
{
    const double half_width = two_sided_95 * sqrt(information->variances[parameter]);
    ci95[0] = exp(fmax(minimum->parameters[parameter] - half_width, bounds->lower[parameter]));
    ci95[1] = exp(fmin(minimum->parameters[parameter] + half_width, bounds->upper[parameter]));
}

/* How the folded picture changes with sigma_a, when sigma_s' does what it can to keep it. */
struct absorption_line {
    const struct fit_channel_system *system;
    const double *minimum;
    double *at_minimum, *jacobian, *residuals; /* node_count + 1, twice that, node_count + 1 */
};

static double distance_along(const struct absorption_line *line, double log_sigma_a)
{
    const size_t count = line->system->node_count + 1;
    const double point[PARAMETER_COUNT] = { log_sigma_a, line->minimum[1] };
    if (!fit_channel_residuals(line->system, point, line->residuals, NULL))
        return INFINITY;
    double change2 = 0.0, along = 0.0, slope2 = 0.0;
    for (size_t i = 0; i < count; i++) {
        const double change = line->residuals[i] - line->at_minimum[i];
        const double slope = line->jacobian[2 * i + 1];
        change2 += change * change;
        along += change * slope;
        slope2 += slope * slope;
    }
    return sqrt(fmax(change2 - along * along / slope2, 0.0));
}

/*
 * Where absorption is too small to show, the logarithm has no lower end, and brightness bends with it. So
 * the ends are sought where the picture has changed by as much as the errors allow.
 */
static bool interval_of_small_absorption(const struct fit_channel_system *system,
                                         const struct fit_minimum *minimum,
                                         const struct information *information, const struct bounds *bounds,
                                         double ci95[2], dipole_status *status)
{
    const size_t count = system->node_count + 1;
    double *const memory = calloc(4 * count, sizeof *memory);
    if (!memory)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the intervals");
    const struct absorption_line line = { .system = system,
                                          .minimum = minimum->parameters,
                                          .at_minimum = memory,
                                          .jacobian = memory + count,
                                          .residuals = memory + 3 * count };
    const double allowed = two_sided_95 * information->absorption_distance;
    (void)fit_channel_residuals(system, minimum->parameters, line.at_minimum, line.jacobian);
    for (int end = 0; end < 2; end++) {
        double inside = minimum->parameters[0], outside = end == 0 ? bounds->lower[0] : bounds->upper[0];
        if (!(distance_along(&line, outside) > allowed))
            inside = outside;
        while (fabs(outside - inside) > 1e-6) {
            const double middle = 0.5 * (inside + outside);
            if (distance_along(&line, middle) > allowed)
                outside = middle;
            else
                inside = middle;
        }
        ci95[end] = exp(inside);
    }
    free(memory);
    return true;
}

/* Intervals, and in words which combination the picture leaves open. */
static bool judge(const struct fit_channel_system *system, const struct fit_minimum *minimum,
                  const struct information *information, const struct bounds *bounds,
                  struct fit_estimate *out, dipole_status *status)
{
    const double widest = widest_log_half_width / two_sided_95;
    const bool is_a_known = information->variances[0] <= widest * widest;
    const bool is_s_known = information->variances[1] <= widest * widest;
    out->is_identifiable = is_a_known && is_s_known;
    interval(0, minimum, information, bounds, out->sigma_a_ci95);
    interval(1, minimum, information, bounds, out->sigma_s_prime_ci95);
    if (!is_a_known && is_s_known) {
        if (!interval_of_small_absorption(system, minimum, information, bounds, out->sigma_a_ci95, status))
            return false;
        snprintf(
            out->note, sizeof out->note,
            "the picture does not show how little light is absorbed: sigma_a may be anything up to %.3g/mm",
            out->sigma_a_ci95[1]);
    } else if (is_a_known && !is_s_known) {
        snprintf(
            out->note, sizeof out->note,
            "the picture does not show how the light is scattered: sigma_s' may be anything from %.3g to "
            "%.3g/mm",
            out->sigma_s_prime_ci95[0], out->sigma_s_prime_ci95[1]);
    } else if (!is_a_known) {
        snprintf(out->note, sizeof out->note,
                 "the picture fixes only the albedo, about %.4g: sigma_a and sigma_s' can grow or shrink "
                 "together; a shadow edge or a thin part would tell them apart",
                 out->sigma_s_prime_per_mm / (out->sigma_a_per_mm + out->sigma_s_prime_per_mm));
    }
    return true;
}

static void explain_darkness(const struct bounds *bounds, const dipole_medium *start,
                             struct fit_estimate *out)
{
    *out = (struct fit_estimate){
        .sigma_a_per_mm = start->sigma_a_per_mm,
        .sigma_a_ci95 = { exp(bounds->lower[0]), exp(bounds->upper[0]) },
        .sigma_s_prime_per_mm = start->sigma_s_prime_per_mm,
        .sigma_s_prime_ci95 = { exp(bounds->lower[1]), exp(bounds->upper[1]) },
        .has_converged = true,
        .note = "no light enters or leaves in this channel: it tells nothing, the start stands",
    };
}

bool fit_estimate_channel(const struct fit_operator *op, int channel,
                          const struct fit_measurement *measurement, const dipole_medium *start,
                          double finest_mm, struct fit_estimate *out, dipole_status *status)
{
    dipole_coefficients checked;
    if (!dipole_coefficients_init(start, &checked, status))
        return false;
    const struct bounds bounds = bounds_of_scene(op, finest_mm);
    if (!(mean_radiosity(measurement, channel, op->pixel_count) > 0.0) || !(op->colour[channel] > 0.0)) {
        explain_darkness(&bounds, start, out);
        return true;
    }
    struct fit_channel_system system;
    if (!fit_channel_system_init(op, channel, measurement, start, &system, status))
        return false;
    struct fit_minimum minimum = { 0 };
    struct information information = { 0 };
    bool done =
        search(&system, start, &bounds, &minimum, status) &&
        gather_information(&system, op, channel, measurement, minimum.parameters, &information, status);
    if (done) {
        *out = (struct fit_estimate){ .sigma_a_per_mm = exp(minimum.parameters[0]),
                                      .sigma_s_prime_per_mm = exp(minimum.parameters[1]),
                                      .rms_residual = information.rms_residual,
                                      .iteration_count = minimum.iteration_count,
                                      .has_converged = minimum.has_converged };
        done = judge(&system, &minimum, &information, &bounds, out, status);
    }
    fit_channel_system_destroy(&system);
    return done;
}
