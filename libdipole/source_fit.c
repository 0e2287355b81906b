/*
 * Sources for a profile that is no sum of sources itself: their weights by non-negative least squares
 * (Lawson and Hanson 1974). docs/theory.md T30.
 */
#include "internal.h"
#include "sources.h"

/* Places a decade, of radii and of depths; how far depths reach beyond the radii at either end; and beyond
 * how many decay lengths nothing lies. */
static const double rows_per_decade = 12.0, least_steps = 40.0, columns_per_decade = 8.0;
static const double depth_first = 0.1, depth_last = 3.0, depth_end = 30.0;

/* Between the decays of sources, and the fastest of all, in 1/mean free path. */
static const double decay_ratio = 2.0, decay_last = 4.0;

enum { SAMPLE_LIMIT = 74, ROW_COUNT_LIMIT = SAMPLE_LIMIT + 1, COLUMN_LIMIT = 640 };
enum { PAIR_LIMIT = DIPOLE_SOURCE_LIMIT / 2, TURN_LIMIT = 300 };

/* ---- the profile at a geometric row of radii ------------------------------------------------------ */

struct samples {
    size_t count;
    double r_mm[SAMPLE_LIMIT], values[SAMPLE_LIMIT];
};

/* Steps from r_min_mm to r_max_mm at their ends, or in their middles. False where a value is not positive:
 * that radius is then the last. */
static bool samples_fill(const dipole_stack *stack, double r_min_mm, double r_max_mm, bool in_middle,
                         struct samples *out)
{
    const double range = log(r_max_mm / r_min_mm);
    const size_t steps = (size_t)fmax(least_steps, ceil(rows_per_decade / log(10.0) * range));
    out->count = in_middle ? steps : steps + 1;
    for (size_t i = 0; i < out->count; i++)
        out->r_mm[i] = r_min_mm * exp(range * (((double)i + (in_middle ? 0.5 : 0.0)) / (double)steps));
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, out->r_mm, out->count, out->values);
    for (size_t i = 0; i < out->count; i++)
        if (!(out->values[i] > 0.0)) {
            out->count = i + 1;
            return false;
        }
    return true;
}

static double flat_lobe(const dipole_source *source, double r_mm)
{
    return source_lobe(source, square(r_mm) + square(source->depth_mm)) / (2.0 * PI);
}

/* Infinite where there is no number. */
static double samples_error(const struct samples *samples, const dipole_sources *sources)
{
    double largest = 0.0;
    for (size_t i = 0; i < samples->count; i++) {
        double sum = 0.0;
        for (size_t k = 0; k < sources->count; k++)
            sum += sources->at[k].weight * flat_lobe(&sources->at[k], samples->r_mm[i]);
        const double error = sum == samples->values[i] ? 0.0 : fabs(sum / samples->values[i] - 1.0);
        largest = isnan(error) ? INFINITY : fmax(largest, error);
    }
    return largest;
}

double dipole_source_error(const dipole_stack *stack, const dipole_sources *sources, double r_min_mm,
                           double r_max_mm)
{
    struct samples samples;
    (void)samples_fill(stack, r_min_mm, r_max_mm, true, &samples);
    return samples_error(&samples, sources);
}

/* ---- non-negative least squares ------------------------------------------------------------------- */

/*
 * min |A x - 1| with x >= 0: rows are in units of what they should be, columns are scaled to length 1. The
 * columns in use have an orthogonal basis (modified Gram-Schmidt), A = Q R.
 */
struct fit {
    size_t row_count, column_count, used_count;
    double columns[COLUMN_LIMIT][ROW_COUNT_LIMIT], length[COLUMN_LIMIT];
    dipole_source sources[COLUMN_LIMIT]; /* of the columns, weight 1 */
    size_t used[PAIR_LIMIT];
    double x[PAIR_LIMIT];
    double basis[PAIR_LIMIT][ROW_COUNT_LIMIT], triangle[PAIR_LIMIT][PAIR_LIMIT];
    double shares[PAIR_LIMIT]; /* of the target, along the basis */
    double residual[ROW_COUNT_LIMIT];
};

static double dot(const double *a, const double *b, size_t count)
{
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += a[i] * b[i];
    return sum;
}

/* The basis from the column in use number `first` on. False if the last is hardly more than what the others
 * span. */
static bool basis_extend(struct fit *fit, size_t first)
{
    double length = 1.0;
    for (size_t j = first; j < fit->used_count; j++) {
        double *const q = fit->basis[j], rest[ROW_COUNT_LIMIT];
        for (size_t i = 0; i < fit->row_count; i++) {
            q[i] = fit->columns[fit->used[j]][i];
            rest[i] = 1.0;
        }
        for (size_t k = 0; k < j; k++) {
            const double part = dot(fit->basis[k], q, fit->row_count);
            fit->triangle[k][j] = part;
            for (size_t i = 0; i < fit->row_count; i++) {
                q[i] -= part * fit->basis[k][i];
                rest[i] -= fit->shares[k] * fit->basis[k][i];
            }
        }
        length = fmax(sqrt(dot(q, q, fit->row_count)), 1e-100);
        fit->triangle[j][j] = length;
        for (size_t i = 0; i < fit->row_count; i++)
            q[i] /= length;
        fit->shares[j] = dot(q, rest, fit->row_count);
    }
    return length > 1e-11;
}

static void solve(const struct fit *fit, double x[PAIR_LIMIT])
{
    for (size_t j = fit->used_count; j-- > 0;) {
        x[j] = fit->shares[j];
        for (size_t k = j + 1; k < fit->used_count; k++)
            x[j] -= fit->triangle[j][k] * x[k];
        x[j] /= fit->triangle[j][j];
    }
}

static void residual_update(struct fit *fit)
{
    for (size_t i = 0; i < fit->row_count; i++)
        fit->residual[i] = 1.0;
    for (size_t j = 0; j < fit->used_count; j++)
        for (size_t i = 0; i < fit->row_count; i++)
            fit->residual[i] -= fit->x[j] * fit->columns[fit->used[j]][i];
}

static bool is_used(const struct fit *fit, size_t column)
{
    for (size_t j = 0; j < fit->used_count; j++)
        if (fit->used[j] == column)
            return true;
    return false;
}

/* Drop what has weight 0; *first is the first place that has changed. */
static void drop_unused(struct fit *fit, size_t *first)
{
    size_t kept = 0;
    *first = fit->used_count;
    for (size_t j = 0; j < fit->used_count; j++) {
        if (fit->x[j] > 0.0) {
            fit->used[kept] = fit->used[j];
            fit->x[kept++] = fit->x[j];
        } else if (*first > kept) {
            *first = kept;
        }
    }
    fit->used_count = kept;
}

/* Take the column in that points most along the residual. False where none helps. */
static bool take_in(struct fit *fit)
{
    bool is_barred[COLUMN_LIMIT] = { false };
    while (fit->used_count < PAIR_LIMIT) {
        size_t best = fit->column_count;
        double largest = 1e-14;
        for (size_t j = 0; j < fit->column_count; j++) {
            if (is_barred[j] || is_used(fit, j))
                continue;
            const double gain = dot(fit->columns[j], fit->residual, fit->row_count);
            if (gain > largest)
                largest = gain, best = j;
        }
        if (best == fit->column_count)
            return false;
        const size_t last = fit->used_count++;
        fit->used[last] = best;
        fit->x[last] = 0.0;
        double x[PAIR_LIMIT];
        if (basis_extend(fit, last)) {
            solve(fit, x);
            if (x[last] > 0.0)
                return true;
        }
        fit->used_count--;
        is_barred[best] = true;
    }
    return false;
}

/* Move towards the solution, dropping on the way what would become negative, until it is reached. */
static void settle(struct fit *fit)
{
    for (;;) {
        double x[PAIR_LIMIT], share = 1.0;
        size_t nearest = fit->used_count, first;
        solve(fit, x);
        for (size_t j = 0; j < fit->used_count; j++)
            if (!(x[j] > 0.0) && fit->x[j] / (fit->x[j] - x[j]) < share)
                share = fit->x[j] / (fit->x[j] - x[j]), nearest = j;
        for (size_t j = 0; j < fit->used_count; j++)
            fit->x[j] += share * (x[j] - fit->x[j]);
        if (nearest == fit->used_count)
            return;
        fit->x[nearest] = 0.0;
        drop_unused(fit, &first);
        (void)basis_extend(fit, first);
    }
}

/* ---- sources ------------------------------------------------------------------------------------- */

/* Left out where it reaches no radius. */
static void column_append(struct fit *fit, const struct samples *samples, double power,
                          const dipole_source *source)
{
    const dipole_sources one = { .count = 1, .at = { *source } };
    double *const column = fit->columns[fit->column_count];
    for (size_t i = 0; i < samples->count; i++)
        column[i] = flat_lobe(source, samples->r_mm[i]) / samples->values[i];
    column[samples->count] = dipole_sources_within(&one, 0.0, samples->r_mm[samples->count - 1]) / power;
    const double length = sqrt(dot(column, column, fit->row_count));
    if (!(length > 1e-200 && length < 1e200))
        return;
    for (size_t i = 0; i < fit->row_count; i++)
        column[i] /= length;
    fit->sources[fit->column_count] = *source;
    fit->length[fit->column_count++] = length;
}

static double fastest_decay_per_mm(const dipole_stack *stack)
{
    double fastest = 0.0;
    for (size_t i = 0; i < dipole_stack_layer_count(stack); i++)
        fastest = fmax(fastest, decay_last * dipole_stack_coefficients(stack, i)->sigma_t_prime_per_mm);
    return fastest;
}

/* A row for each radius and one for the power within the last. Columns: depths on a geometric grid, of the
 * stack's slowest decay alone or of ever faster ones besides. */
static void fit_init(struct fit *fit, const dipole_stack *stack, const struct samples *samples,
                     double power, bool has_all_decays)
{
    const double slowest = dipole_stack_decay_per_mm(stack);
    const double first_mm = depth_first * samples->r_mm[0],
                 last_mm = depth_last * samples->r_mm[samples->count - 1];
    const double end = has_all_decays ? fastest_decay_per_mm(stack) : slowest;
    fit->row_count = samples->count + 1;
    fit->column_count = fit->used_count = 0;
    for (double s = slowest; s <= end;
         s = s == slowest ? fmax(decay_ratio * s, depth_last / last_mm) : decay_ratio * s) {
        double z = first_mm;
        while (z <= last_mm && z * s <= depth_end && fit->column_count < COLUMN_LIMIT) {
            column_append(fit, samples, power, &(dipole_source){ z, 1.0, s, 0.0 });
            z *= exp(log(10.0) / columns_per_decade);
        }
    }
}

/* The sources in use, with exactly the power within the last radius. */
static void sources_fill(const struct fit *fit, double r_max_mm, double power, dipole_sources *out)
{
    out->count = 2 * fit->used_count;
    out->sigma_tr_per_mm = INFINITY;
    for (size_t j = 0; j < fit->used_count; j++) {
        dipole_source source = fit->sources[fit->used[j]];
        source.weight = 0.5 * fit->x[j] / fit->length[fit->used[j]];
        out->sigma_tr_per_mm = fmin(out->sigma_tr_per_mm, source.sigma_tr_per_mm);
        out->at[2 * j] = source;
        source.depth_mm = -source.depth_mm;
        out->at[2 * j + 1] = source;
    }
    const double scale = power / dipole_sources_within(out, 0.0, r_max_mm);
    for (size_t k = 0; k < out->count; k++)
        out->at[k].weight *= scale;
}

bool dipole_source_fit(const dipole_stack *stack, double epsilon, double r_min_mm, double r_max_mm,
                       dipole_sources *out, double *bad_r_mm)
{
    struct samples samples = { .count = 0 }, between = { .count = 0 };
    for (int k = 0; k < 2; k++) {
        struct samples *const each = k ? &between : &samples;
        *bad_r_mm = r_max_mm;
        if (!samples_fill(stack, r_min_mm, r_max_mm, k == 1, each)) {
            *bad_r_mm = each->r_mm[each->count - 1];
            return false;
        }
    }
    const double power = dipole_stack_within(stack, DIPOLE_FACE_LIT, r_max_mm);
    struct fit fit;
    out->max_relative_error = INFINITY;
    for (int k = 0; k < 2 && !(out->max_relative_error <= epsilon); k++) {
        fit_init(&fit, stack, &samples, power, k == 1);
        for (int turn = 0; turn < TURN_LIMIT && !(out->max_relative_error <= epsilon); turn++) {
            residual_update(&fit);
            if (!take_in(&fit))
                break;
            settle(&fit);
            sources_fill(&fit, r_max_mm, power, out);
            out->max_relative_error = samples_error(&between, out);
        }
    }
    return true;
}
