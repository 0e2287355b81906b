#include "fit/certainty.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Singular values of the scaled derivatives below this are rounding. */
static const double rank_tolerance = 1e-8;

/*
 * How far a model is from real light, as a relative error that its coefficients can follow: about what
 * half-spaces of Monte Carlo showed (docs/models.md, docs/fitting.md). What the residuals show of a misfit
 * is the part that the coefficients could not follow, a fifth of all at the least; so a target that the
 * model fits without a misfit was made by the model, and is not suspected.
 */
static const double discrepancies[] = {
    [DIPOLE_MODEL_DIPOLE] = 0.1, [DIPOLE_MODEL_BETTER_DIPOLE] = 0.1, [DIPOLE_MODEL_MULTIPOLE] = 0.1,
    [DIPOLE_MODEL_BEAM] = 0.06,  [DIPOLE_MODEL_MODES] = 0.025,
};
static const double hidden_factor = 5;

enum { FOLD_ROWS = 512, BANDS = 4 };

/* 97.5 % quantile of Student's distribution, by the expansion of Hill about the normal one; 12.7 and 4.30
 * for one and two degrees of freedom, where it fails. */
static double quantile95(double freedom)
{
    const double z = 1.959963984540054, z2 = z * z;
    if (freedom < 1.5)
        return 12.7062;
    if (freedom < 2.5)
        return 4.3027;
    const double n = freedom;
    return z * (1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
                (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n));
}

/* ---- sums over the data ------------------------------------------------------------------------------ */

struct tile_sums {
    double by_model2, by_residual; /* weighted: sum of m^2, of m r                       */
    bool is_used;
};

struct gather {
    const struct fit_problem *problem;
    size_t count; /* of parameters */
    /* of the target at hand */
    const struct fit_target *target;
    struct tile_sums *tiles;
    double *tile_scores, *tile_models; /* tile_count x count: sums of w r J and w m J */
    double *scale, *offset;            /* BANDS x count, count                        */
    double *information;               /* count x count: sum of w J J'                */
    double noise2, datum_count;        /* sum of w r^2                                */
    double relative2[FIT_CHANNEL_COUNT], counts[FIT_CHANNEL_COUNT];
    /* of all */
    double *rows, *triangle, *middle;
    size_t row_count;
    bool is_out_of_memory;
};

static void gather_datum(void *context, struct fit_datum *datum, const struct fit_datum_model *model)
{
    struct gather *const gather = context;
    if (!(datum->robust > 0))
        return;
    const double weight = datum->robust / (datum->sigma * datum->sigma);
    const double residual = model->value - datum->value;
    const double mean = gather->target->value_scale[datum->channel];
    const size_t n = gather->count, tile = (size_t)datum->tile;
    double *const row = gather->rows + gather->row_count * n;
    memset(row, 0, n * sizeof *row);
    /* bands of brightness: what is dark, below the mean, above it, and bright */
    const double bright = fmin(fmax(2 * model->value / mean, 0), BANDS - 1);
    const size_t band = mean > 0 ? (size_t)bright : 0;
    for (int i = 0; i < model->parameter_count; i++) {
        const size_t p = (size_t)model->parameters[i];
        const double derivative = model->derivatives[i];
        row[p] = sqrt(weight) * derivative;
        gather->tile_scores[tile * n + p] += weight * residual * derivative;
        gather->tile_models[tile * n + p] += weight * model->bare * derivative;
        gather->scale[band * n + p] += weight * model->bare * derivative;
        gather->offset[p] += weight * mean * derivative;
        for (int k = 0; k < model->parameter_count; k++)
            gather->information[p * n + (size_t)model->parameters[k]] +=
                weight * derivative * model->derivatives[k];
    }
    gather->tiles[tile].is_used = true;
    /* noise alone, where it is stated: the misfit is what shows above it */
    const double sure = datum->stated > 0 ? datum->robust / (datum->stated * datum->stated) : weight;
    gather->tiles[tile].by_model2 += sure * model->bare * model->bare;
    gather->tiles[tile].by_residual += sure * model->bare * residual;
    gather->noise2 += weight * residual * residual;
    gather->datum_count += 1;
    gather->relative2[datum->channel] += pow(residual / (fabs(datum->value) + 0.1 * mean), 2);
    gather->counts[datum->channel] += 1;
    if (++gather->row_count == FOLD_ROWS) {
        if (!fit_triangle_fold(gather->triangle, n, gather->rows, gather->row_count, NULL))
            gather->is_out_of_memory = true;
        gather->row_count = 0;
    }
}

static void add_square(double *matrix, size_t n, double factor, const double *v)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n && v[i] != 0; k++)
            matrix[i * n + k] += factor * v[i] * v[k];
    }
}

/*
 * The misfit that is not noise: the relative residuals of tiles scatter more than the noise in them would
 * make them. The variance between tiles by the moments of DerSimonian and Laird, which trusts each as far
 * as its noise allows.
 */
static double misfit2_of(const struct gather *gather)
{
    double q = 0, sum = 0, squares = 0, count = 0;
    for (int t = 0; t < gather->target->tile_count; t++) {
        const struct tile_sums *const tile = &gather->tiles[t];
        if (!(tile->by_model2 > 0))
            continue;
        q += tile->by_residual * tile->by_residual /
             tile->by_model2; /* relative residual^2 over its variance */
        sum += tile->by_model2;
        squares += tile->by_model2 * tile->by_model2;
        count += 1;
    }
    /* chance alone reaches the second of these once in 20 times */
    const double surplus = q > count + 1.64 * sqrt(2 * count) ? q - count : 0;
    return count > 2 ? surplus / (sum - squares / sum) : 0;
}

/* What is known of a target after its data were gathered. */
struct judged {
    double freedom, noise2, datum_count, misfit2;
};

/* Add the target's part to the middle of the sandwich, T40. */
static void close_target(struct gather *gather, struct judged *all)
{
    const size_t n = gather->count;
    const struct fit_systematic *const systematic = &gather->target->systematic;
    double used = 0;
    for (int t = 0; t < gather->target->tile_count; t++)
        used += gather->tiles[t].is_used ? 1 : 0;
    const double noise = gather->noise2 / fmax(gather->datum_count, 1);
    const double misfit2 = misfit2_of(gather);
    const double few = used / fmax(used - 2, 0.5);
    for (int t = 0; t < gather->target->tile_count; t++) {
        if (!gather->tiles[t].is_used)
            continue;
        add_square(gather->middle, n, used > 3 ? few : 0, gather->tile_scores + (size_t)t * n);
        add_square(gather->middle, n, systematic->tile * systematic->tile,
                   gather->tile_models + (size_t)t * n);
    }
    /* too few to see errors that go together: independent ones, as large as is stated or seen */
    for (size_t i = 0; i < n * n && !(used > 3); i++)
        gather->middle[i] += fmax(noise, 1) * gather->information[i];
    double *const whole = gather->rows; /* free by now */
    for (size_t p = 0; p < n; p++) {
        whole[p] = 0;
        for (size_t band = 0; band < BANDS; band++)
            whole[p] += gather->scale[band * n + p];
    }
    add_square(gather->middle, n, systematic->scale * systematic->scale, whole);
    add_square(gather->middle, n, systematic->offset * systematic->offset, gather->offset);
    const double discrepancy = discrepancies[gather->problem->form.model];
    const double hidden2 = fmax(systematic->misfit_factor * systematic->misfit_factor * misfit2,
                                fmin(discrepancy * discrepancy, hidden_factor * hidden_factor * misfit2));
    add_square(gather->middle, n, hidden2, whole);
    for (size_t band = 0; band < BANDS; band++)
        add_square(gather->middle, n, hidden2, gather->scale + band * n);
    all->freedom += used;
    all->noise2 += gather->noise2;
    all->datum_count += gather->datum_count;
    all->misfit2 = fmax(all->misfit2, misfit2);
}

static bool gather_target(struct gather *gather, struct fit_problem *problem, size_t t,
                          const double *parameters, struct judged *all, dipole_status *status)
{
    const size_t n = gather->count, tile_count = (size_t)problem->targets[t].tile_count;
    double *const memory = calloc(2 * tile_count * n + (BANDS + 1) * n + n * n, sizeof *memory);
    gather->target = &problem->targets[t];
    gather->tiles = calloc(tile_count, sizeof *gather->tiles);
    gather->noise2 = gather->datum_count = 0;
    bool done = memory && gather->tiles;
    if (done) {
        gather->tile_scores = memory;
        gather->tile_models = memory + tile_count * n;
        gather->scale = gather->tile_models + tile_count * n;
        gather->offset = gather->scale + BANDS * n;
        gather->information = gather->offset + n;
    }
    for (int c = 0; done && c < FIT_CHANNEL_COUNT; c++)
        done = fit_problem_visit(problem, t, c, parameters, gather_datum, gather);
    done = done && fit_triangle_fold(gather->triangle, n, gather->rows, gather->row_count, NULL);
    gather->row_count = 0;
    done = done && !gather->is_out_of_memory;
    if (done)
        close_target(gather, all);
    free(memory);
    free(gather->tiles);
    return done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the intervals");
}

/* ---- covariance -------------------------------------------------------------------------------------- */

/* C = A^-1 M A^-1; A^-1 is the inverse of J'J. Infinite variances stand apart. */
static void sandwich(const double *inverse, const double *middle, size_t n, double *scratch, double *out)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t m = 0; m < n; m++)
                sum += (isfinite(inverse[i * n + m]) ? inverse[i * n + m] : 0) * middle[m * n + k];
            scratch[i * n + k] = sum;
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++) {
            double sum = 0;
            for (size_t m = 0; m < n; m++)
                sum += scratch[i * n + m] * (isfinite(inverse[m * n + k]) ? inverse[m * n + k] : 0);
            out[i * n + k] = sum;
        }
    }
    for (size_t i = 0; i < n; i++) {
        if (isinf(inverse[i * n + i]))
            out[i * n + i] = INFINITY;
    }
}

/*
 * Noise that is even and independent is the least: where few tiles make the sandwich's noise term chancy,
 * and in directions that nothing shows, of which the sandwich knows no noise. A parameter that is below it
 * takes that noise's correlations, too.
 */
static void raise_to_noise(const double *inverse, double noise, size_t n, double *covariance)
{
    for (size_t i = 0; i < n; i++) {
        const double least = noise * inverse[i * n + i], found = covariance[i * n + i];
        if (!(found < least) || isinf(found))
            continue;
        for (size_t k = 0; k < n; k++) {
            covariance[i * n + k] = noise * inverse[i * n + k];
            covariance[k * n + i] = noise * inverse[k * n + i];
        }
    }
}

/*
 * Within a pixel neither picture nor operator is certain: what is as small as that, such as the edge of a
 * shadow, seems wider or narrower, and all lengths of the medium with it. So much of (pixel / mean free
 * path)^2, as a standard error of lengths; the finest picture of a channel counts. Opaque media of 0.1 mm
 * under pixels of 0.25 mm came back 2.9 % off.
 */
static const double length_error = 0.005;

static void add_length_errors(const struct fit_certainty *certainty)
{
    const struct fit_problem *const problem = certainty->problem;
    const size_t n = problem->layout.parameter_count;
    for (int c = 0; c < problem->form.channel_count; c++) {
        const int *const at = problem->layout.coefficient[c];
        double pixel_mm = INFINITY;
        for (size_t t = 0; t < problem->target_count; t++) {
            if (problem->targets[t].value_scale[c] > 0)
                pixel_mm = fmin(pixel_mm, problem->targets[t].pixel_mm);
        }
        if (!problem->has_light[c] || !isfinite(pixel_mm))
            continue;
        const double sigma_t_prime_per_mm = exp(certainty->minimum->parameters[at[FIT_SIGMA_A]]) +
                                            exp(certainty->minimum->parameters[at[FIT_SIGMA_S_PRIME]]);
        const double error = length_error * pow(pixel_mm * sigma_t_prime_per_mm, 2);
        for (int p = 0; p < FIT_THICKNESS; p++) {
            for (int q = 0; q < FIT_THICKNESS; q++)
                certainty->covariance[(size_t)at[p] * n + (size_t)at[q]] += error * error;
        }
    }
}

bool fit_certainty_find(struct fit_certainty *certainty, struct fit_estimates *out, dipole_status *status)
{
    struct fit_problem *const problem = certainty->problem;
    const size_t n = problem->layout.parameter_count;
    double *const memory = calloc(n * n + (FOLD_ROWS + 1) * n, sizeof *memory);
    struct gather gather = {
        .problem = problem, .count = n, .triangle = certainty->triangle, .middle = certainty->middle
    };
    struct judged all = { 0 };
    bool done = memory || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the intervals");
    if (done)
        gather.rows = memory + n * n;
    for (size_t t = 0; done && t < problem->target_count; t++)
        done = gather_target(&gather, problem, t, certainty->minimum->parameters, &all, status);
    done = done && fit_inverse_information(gather.triangle, n, rank_tolerance, certainty->inverse,
                                           certainty->singular, status);
    if (done) {
        const double freedom = all.datum_count - (double)n;
        certainty->noise = freedom > 0 ? fmax(all.noise2 / freedom, 1) : 1;
        sandwich(certainty->inverse, gather.middle, n, memory, certainty->covariance);
        raise_to_noise(certainty->inverse, certainty->noise, n, certainty->covariance);
        add_length_errors(certainty);
        const bool is_few = all.freedom < 4; /* stated errors, not seen ones */
        const double per_channel = (double)n / (double)problem->form.channel_count;
        certainty->quantile = is_few ? quantile95(1e9) : quantile95(fmax(all.freedom - per_channel, 1));
        out->misfit = sqrt(all.misfit2);
        double squares = 0, count = 0;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            out->channels[c].rms_residual = sqrt(gather.relative2[c] / fmax(gather.counts[c], 1));
            squares += gather.relative2[c];
            count += gather.counts[c];
        }
        out->rms_residual = sqrt(squares / fmax(count, 1));
    }
    free(memory);
    return done;
}
