#include "fit/noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GROUP_LIMIT = 16, GROUP_MIN = 20, TERM_COUNT = 3 };

/* The median of |r| of a normal distribution is this part of its standard deviation. */
static const double median_to_sigma = 1.4826022185056018;
/* Residuals of more sigmas count in proportion to their size, not its square: 98.8 % of normal noise is
 * less. */
static const double huber_sigmas = 2.5;
/* No datum is trusted more than so many times the median one. */
static const double least_sigma_share = 0.1;
/* No pass makes noise smaller than by this. */
static const double least_unit = 1e-6;

/* One datum of a channel with its model. */
struct seen {
    struct fit_datum *datum;
    double model, residual;
};

struct collection {
    struct seen *items;
    size_t count;
};

static void collect(void *context, struct fit_datum *datum, const struct fit_datum_model *model)
{
    struct collection *const collection = context;
    collection->items[collection->count++] =
        (struct seen){ .datum = datum, .model = model->value, .residual = model->value - datum->value };
}

static int by_model(const void *a, const void *b)
{
    const double x = ((const struct seen *)a)->model, y = ((const struct seen *)b)->model;
    return (x > y) - (x < y);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, size_t count)
{
    qsort(values, count, sizeof *values, by_size);
    return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

/* ---- the variance as a function of the signal ---------------------------------------------------------
 */

struct group {
    double model, variance;
};

/* variance = read^2 + shot m + relative^2 m^2, m >= 0. */
struct variance {
    double terms[TERM_COUNT];
};

static double variance_at(const struct variance *variance, double model)
{
    const double m = fmax(model, 0);
    return variance->terms[0] + m * (variance->terms[1] + m * variance->terms[2]);
}

/* Weighted least squares over the terms in the set, relative to each group's variance. False: singular. */
static bool fit_terms(const struct group *groups, size_t count, unsigned set, double unit,
                      struct variance *out, double *error)
{
    double m[TERM_COUNT][TERM_COUNT + 1] = { { 0 } };
    for (size_t g = 0; g < count; g++) {
        const double x = groups[g].model / unit, weight = 1 / groups[g].variance;
        const double columns[TERM_COUNT] = { weight, weight * x, weight * x * x };
        for (int i = 0; i < TERM_COUNT; i++) {
            for (int k = 0; k < TERM_COUNT; k++)
                m[i][k] += columns[i] * columns[k];
            m[i][TERM_COUNT] += columns[i];
        }
    }
    double found[TERM_COUNT] = { 0 };
    for (int i = 0; i < TERM_COUNT; i++) {
        if (!(set >> i & 1u))
            continue;
        if (!(m[i][i] > 0))
            return false;
        for (int k = 0; k < TERM_COUNT; k++) {
            if (k == i || !(set >> k & 1u))
                continue;
            const double share = m[k][i] / m[i][i];
            for (int j = 0; j <= TERM_COUNT; j++)
                m[k][j] -= share * m[i][j];
        }
    }
    for (int i = 0; i < TERM_COUNT; i++) {
        if (set >> i & 1u)
            found[i] = m[i][TERM_COUNT] / m[i][i];
        if (!(found[i] >= 0))
            return false;
    }
    *out = (struct variance){ { found[0], found[1] / unit, found[2] / (unit * unit) } };
    *error = 0;
    for (size_t g = 0; g < count; g++)
        *error += pow(variance_at(out, groups[g].model) / groups[g].variance - 1, 2);
    return true;
}

/* Nonnegative least squares by trying all sets of terms: there are seven. */
static bool fit_variance(const struct group *groups, size_t count, struct variance *out)
{
    double least = INFINITY;
    for (unsigned set = 1; set < 1u << TERM_COUNT; set++) {
        struct variance variance;
        double error;
        if (fit_terms(groups, count, set, groups[count - 1].model, &variance, &error) && error < least) {
            least = error;
            *out = variance;
        }
    }
    return isfinite(least);
}

/* Items are in the order of their model. False: there is nothing to learn from. */
static bool learn_variance(const struct collection *collection, double *scratch, struct variance *out)
{
    struct group groups[GROUP_LIMIT];
    const size_t possible = collection->count / GROUP_MIN;
    const size_t group_count = possible < GROUP_LIMIT ? possible : GROUP_LIMIT;
    if (group_count < 2)
        return false;
    for (size_t g = 0; g < group_count; g++) {
        const size_t first = g * collection->count / group_count;
        const size_t end = (g + 1) * collection->count / group_count;
        double sum = 0;
        for (size_t i = first; i < end; i++) {
            scratch[i - first] = fabs(collection->items[i].residual);
            sum += fmax(collection->items[i].model, 0);
        }
        groups[g].model = sum / (double)(end - first);
        groups[g].variance = pow(median_to_sigma * median(scratch, end - first), 2);
        if (!(groups[g].variance > 0) || !isfinite(groups[g].variance))
            return false;
    }
    return groups[group_count - 1].model > 0 && fit_variance(groups, group_count, out);
}

static void apply_variance(const struct collection *collection, const struct variance *variance)
{
    const double middle = variance_at(variance, collection->items[collection->count / 2].model);
    const double least = fmax(least_sigma_share * least_sigma_share * middle, 0);
    for (size_t i = 0; i < collection->count; i++) {
        const double found = variance_at(variance, collection->items[i].model);
        collection->items[i].datum->sigma = sqrt(fmax(found, least));
    }
}

/* Of data with stated errors: the relative error of the model, where it shows above them. */
static void add_model_error(const struct collection *collection, double *scratch)
{
    size_t count = 0;
    double noise2 = 0;
    for (size_t i = 0; i < collection->count; i++) {
        const struct seen *const seen = &collection->items[i];
        if (!(seen->model > 0) || !(seen->datum->stated > 0) || seen->datum->stated > 0.1 * seen->model)
            continue;
        scratch[count++] = fabs(seen->residual) / seen->model;
        noise2 += pow(seen->datum->stated / seen->model, 2);
    }
    if (count < GROUP_MIN)
        return;
    noise2 /= (double)count;
    const double all2 = pow(median_to_sigma * median(scratch, count), 2);
    const double relative2 = fmax(all2 - noise2, 0);
    for (size_t i = 0; i < collection->count; i++) {
        const struct seen *const seen = &collection->items[i];
        if (seen->datum->stated > 0)
            seen->datum->sigma = hypot(seen->datum->stated, sqrt(relative2) * seen->model);
    }
}

/* Where the variance cannot be learned, of few data or of a fit that is exact: sigmas in the proportions
 * they have, so large that half of the residuals are as large as those of half of a normal distribution. */
static void apply_median(const struct collection *collection, double *scratch)
{
    for (size_t i = 0; i < collection->count; i++)
        scratch[i] = fabs(collection->items[i].residual) / collection->items[i].datum->sigma;
    const double unit = fmax(median_to_sigma * median(scratch, collection->count), least_unit);
    for (size_t i = 0; i < collection->count; i++)
        collection->items[i].datum->sigma *= unit;
}

/* ---- outliers ---------------------------------------------------------------------------------------- */

static void apply_loss(const struct collection *collection, bool are_stated, double *scratch)
{
    for (size_t i = 0; i < collection->count; i++)
        scratch[i] = fabs(collection->items[i].residual) / collection->items[i].datum->sigma;
    double unit = median_to_sigma * median(scratch, collection->count);
    if (are_stated)
        unit = fmax(unit, 1);
    if (!(unit > 0))
        return;
    for (size_t i = 0; i < collection->count; i++) {
        struct fit_datum *const datum = collection->items[i].datum;
        const double sigmas = fabs(collection->items[i].residual) / datum->sigma / unit;
        datum->robust = sigmas > huber_sigmas ? huber_sigmas / sigmas : 1;
        if (!are_stated && sigmas > FIT_NOISE_OUTLIER)
            datum->robust = 0;
    }
}

bool fit_noise_reweigh(struct fit_problem *problem, const double *parameters)
{
    size_t most = 0;
    for (size_t t = 0; t < problem->target_count; t++)
        most = problem->targets[t].datum_count > most ? problem->targets[t].datum_count : most;
    struct collection collection = { .items = malloc((most + 1) * sizeof *collection.items) };
    double *const scratch = malloc((most + 1) * sizeof *scratch);
    bool done = collection.items && scratch;
    for (size_t t = 0; done && t < problem->target_count; t++) {
        const struct fit_target *const target = &problem->targets[t];
        for (int c = 0; done && c < FIT_CHANNEL_COUNT; c++) {
            collection.count = 0;
            done = fit_problem_visit(problem, t, c, parameters, collect, &collection);
            if (!done || collection.count < GROUP_MIN)
                continue;
            struct variance variance = { 0 };
            qsort(collection.items, collection.count, sizeof *collection.items, by_model);
            if (target->are_sigmas_stated)
                add_model_error(&collection, scratch);
            else if (learn_variance(&collection, scratch, &variance))
                apply_variance(&collection, &variance);
            else
                apply_median(&collection, scratch);
            apply_loss(&collection, target->are_sigmas_stated, scratch);
        }
    }
    free(collection.items);
    free(scratch);
    return done;
}
