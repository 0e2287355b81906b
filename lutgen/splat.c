/* Splat tables in memory: nodes, what lies between them, and the audit. T15. */
#include "io/half.h"
#include "lutgen/internal.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* Random points in every interval: for the search of the size, and for the error that is stated. */
enum { POINTS_SEARCHED = 4, POINTS_STATED = 32 };

/* What lies between the points of an audit can be so much larger: the error is about a parabola. */
static const double audit_margin = 1.01;

static double weight_at(const struct lut_splat_row *row, double r_mm)
{
    const double x = r_mm / row->axis.scale_mm;
    return row->falloff == 0 ? 1 : pow(1 + x * x, row->falloff);
}

/* ---- nodes -------------------------------------------------------------------------------------- */

/*
 * Linear interpolation between exact nodes errs to one side. Each node is moved by a quarter of the errors
 * in the middle of its two intervals, which halves the largest.
 */
static void channel_bake(const struct lut_profile *profile, const double *r_mm, const double *weights,
                         int last, double *values)
{
    const size_t count = 2 * (size_t)last + 1;
    lut_profile_evaluate(profile, r_mm, count, values);
    for (size_t i = 0; i < count; i++)
        values[i] *= weights[i];
    double before = 0;
    for (int i = 0; i <= last; i++) { /* the interval after node i still has its exact ends */
        double *const node = &values[2 * i];
        const double after = i < last ? 0.5 * (node[0] + node[2]) - node[1] : before;
        node[0] -= 0.25 * ((i > 0 ? before : after) + after);
        before = after;
    }
}

bool lut_splat_row_bake(struct lut_splat_row *row, const struct lut_profile profiles[IO_CHANNEL_COUNT],
                        bool is_half, float *rgb, dipole_status *status)
{
    const size_t count = (size_t)(2 * row->axis.node_count - 1);
    double *const work = malloc(3 * count * sizeof *work);
    if (!work)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a table");
    double *const r_mm = work, *const weights = work + count, *const values = work + 2 * count;
    for (size_t i = 0; i < count; i++) {
        r_mm[i] = lut_axis_r_mm(&row->axis, 0.5 * (double)i);
        weights[i] = weight_at(row, r_mm[i]);
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        channel_bake(&profiles[c], r_mm, weights, row->axis.node_count - 1, values);
        double most = 0;
        for (int i = 0; i < row->axis.node_count; i++)
            most = fmax(most, values[2 * (size_t)i]);
        row->core_mm[c] = profiles[c].core_mm;
        row->scale[c] = is_half ? lut_half_scale(most) : 1;
        for (int i = 0; i < row->axis.node_count; i++) {
            const float stored = (float)(fmax(values[2 * (size_t)i], 0) / row->scale[c]);
            rgb[(size_t)i * IO_CHANNEL_COUNT + (size_t)c] =
                is_half ? io_float_from_half(io_half_from_float(stored)) : stored;
        }
    }
    free(work);
    return true;
}

/* ---- sampling and audit ------------------------------------------------------------------------- */

static void row_sample(const struct lut_splat_row *row, const float *rgb, double index, double r_mm,
                       double rgb_out[IO_CHANNEL_COUNT])
{
    const int last = row->axis.node_count - 2;
    const int i = index < last ? (int)index : last;
    const double f = index - i, w = weight_at(row, r_mm);
    const float *const node = rgb + (size_t)i * IO_CHANNEL_COUNT;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] =
            ((1 - f) * (double)node[c] + f * (double)node[c + IO_CHANNEL_COUNT]) * row->scale[c] / w;
}

void lut_splat_sample(const struct lut_splat *lut, size_t row, double r_mm,
                      double rgb_out[IO_CHANNEL_COUNT])
{
    assert(row < lut->row_count);
    const struct lut_splat_row *const at = &lut->rows[row];
    const float *const rgb = lut->rgb + row * (size_t)lut->node_count * IO_CHANNEL_COUNT;
    if (r_mm >= 0 && r_mm <= at->axis.r_max_mm) {
        row_sample(at, rgb, lut_axis_index(&at->axis, r_mm), r_mm, rgb_out);
        return;
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = 0;
}

/* Random points, one in each equal part of every interval, and the nodes, where rounding shows. */
static size_t points_choose(const struct lut_axis *axis, int per_node, unsigned seed, double *r_mm)
{
    uint64_t random = seed;
    const size_t parts = (size_t)(axis->node_count - 1) * (size_t)per_node;
    for (size_t i = 0; i < parts; i++)
        r_mm[i] = lut_axis_r_mm(axis, ((double)i + lut_random(&random)) / per_node);
    for (int i = 0; i < axis->node_count; i++)
        r_mm[parts + (size_t)i] = lut_axis_r_mm(axis, i);
    return parts + (size_t)axis->node_count;
}

static bool row_audit(const struct lut_splat_row *row, const float *rgb,
                      const struct lut_profile profiles[IO_CHANNEL_COUNT], int per_node, unsigned seed,
                      struct lut_error *error_out, dipole_status *status)
{
    const size_t most = (size_t)row->axis.node_count * ((size_t)per_node + 1);
    double *const work = malloc((1 + 2 * IO_CHANNEL_COUNT) * most * sizeof *work);
    if (!work)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the audit of a table");
    double *const r_mm = work, *const exact = work + most,
                  *const errors = work + (1 + IO_CHANNEL_COUNT) * most;
    const size_t count = points_choose(&row->axis, per_node, seed, r_mm);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        lut_profile_evaluate(&profiles[c], r_mm, count, exact + (size_t)c * count);
    for (size_t i = 0; i < count; i++) {
        double sampled[IO_CHANNEL_COUNT];
        row_sample(row, rgb, lut_axis_index(&row->axis, r_mm[i]), r_mm[i], sampled);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const size_t at = (size_t)c * count + i;
            const double difference = fabs(sampled[c] - exact[at]);
            errors[at] = difference == 0 ? 0 : difference / fmax(exact[at], profiles[c].floor_per_mm2);
        }
    }
    *error_out = lut_error_of(errors, IO_CHANNEL_COUNT * count);
    free(work);
    return true;
}

bool lut_splat_audit(const struct lut_splat *lut, size_t row, int points_per_node, unsigned seed,
                     struct lut_error *error_out, dipole_status *status)
{
    assert(row < lut->row_count);
    struct lut_profile profiles[IO_CHANNEL_COUNT];
    const bool is_done =
        lut_profiles_init(&lut->rows[row].material, lut->epsilon, profiles, status) &&
        row_audit(&lut->rows[row], lut->rgb + row * (size_t)lut->node_count * IO_CHANNEL_COUNT, profiles,
                  points_per_node, seed, error_out, status);
    lut_profiles_end(profiles);
    return is_done;
}

/* ---- the fewest nodes --------------------------------------------------------------------------- */

/* A row on its way. */
struct draft {
    struct lut_splat_row *row;
    struct lut_profile profiles[IO_CHANNEL_COUNT];
    bool is_half;
    double epsilon, bend; /* bend: of lut_axis_find */
};

/* Bake into rgb, which has room for node_count nodes, and measure. */
static bool draft_try(struct draft *draft, int node_count, int per_node, float *rgb, dipole_status *status)
{
    struct lut_splat_row *const row = draft->row;
    row->axis.node_count = node_count;
    if (!lut_splat_row_bake(row, draft->profiles, draft->is_half, rgb, status) ||
        !row_audit(row, rgb, draft->profiles, per_node, LUT_SEED_BAKE, &row->error, status))
        return false;
    row->error.max *= audit_margin;
    row->error.p99 = fmin(row->error.p99 * audit_margin, row->error.max);
    row->predicted_error = draft->bend / (16.0 * (node_count - 1) * (node_count - 1)) +
                           (draft->is_half ? LUT_HALF_ROUNDING : 0);
    return true;
}

/* The count by which an error of e at count nodes becomes epsilon, if it falls as the square. */
static int count_for(const struct draft *draft, int count, double error)
{
    const double rounding = draft->is_half ? LUT_HALF_ROUNDING : 0;
    const double allowed = fmax(draft->epsilon - rounding, 0.01 * draft->epsilon);
    const double found = 1 + (count - 1) * sqrt(fmax(error - rounding, 0) / allowed);
    return (int)fmin(fmax(ceil(found), LUT_NODE_COUNT_MIN), LUT_NODE_COUNT_MAX);
}

/*
 * The smallest count that passes, to a part in 32 of what failed: the prediction is tried first, then what
 * the measured errors say, between a count that failed and one that passed.
 */
static bool count_find(struct draft *draft, float *rgb, int *count_out, dipole_status *status)
{
    int failed = LUT_NODE_COUNT_MIN - 1, passed = LUT_NODE_COUNT_MAX + 1;
    int count = count_for(draft, LUT_NODE_COUNT_MIN,
                          draft->bend / (16.0 * (LUT_NODE_COUNT_MIN - 1) * (LUT_NODE_COUNT_MIN - 1)));
    double last_error = INFINITY;
    while (passed - failed > 1 + failed / 32) {
        if (!draft_try(draft, count, POINTS_SEARCHED, rgb, status))
            return false;
        last_error = draft->row->error.max;
        if (last_error <= draft->epsilon)
            passed = count;
        else
            failed = count;
        count = count_for(draft, count, last_error);
        if (count <= failed) /* the guess adds nothing: halve what is left, doubling while nothing passed */
            count = passed > LUT_NODE_COUNT_MAX ? (int)fmin(failed * 1.25 + 1, LUT_NODE_COUNT_MAX)
                                                : (failed + passed) / 2;
        if (count >= passed)
            count = (failed + passed) / 2;
    }
    if (passed > LUT_NODE_COUNT_MAX)
        return dipole_fail(status, DIPOLE_NOT_CONVERGED, NULL,
                           "%d texels reach a relative error of %.2g, expected at most epsilon = %g",
                           LUT_NODE_COUNT_MAX, last_error, draft->epsilon);
    *count_out = passed;
    return true;
}

/* Axis of one row, and the fewest nodes unless their number is given. rgb: room for LUT_NODE_COUNT_MAX. */
static bool draft_plan(struct draft *draft, float *rgb, int *node_count, dipole_status *status)
{
    /* half: 2^-14 to 65504 with a factor of e to spare; float holds more than any profile falls */
    const double log_range_limit = draft->is_half ? log(65504 / 0x1p-14) - 1 : 160;
    if (!lut_profiles_init(&draft->row->material, draft->epsilon, draft->profiles, status) ||
        !lut_profiles_check_range(draft->profiles, status))
        return false;
    draft->bend = lut_axis_find(draft->profiles, log_range_limit, &draft->row->axis, &draft->row->falloff);
    return *node_count > 0 || count_find(draft, rgb, node_count, status);
}

/* ---- tables ------------------------------------------------------------------------------------- */

void lut_splat_destroy(struct lut_splat *lut)
{
    if (lut) {
        free(lut->rows);
        free(lut->rgb);
    }
    free(lut);
}

/* Which material failed, when there is more than one. */
static bool fail_at_row(const struct lut_splat *lut, size_t row, const dipole_status *why,
                        dipole_status *status)
{
    return dipole_fail(status, why->code, NULL, "%s%s%s",
                       lut->row_count > 1 ? lut->rows[row].material.name : "",
                       lut->row_count > 1 ? ": " : "", why->message);
}

/* The row that needs the most nodes decides for all. */
static bool rows_plan(struct lut_splat *lut, struct draft *drafts, int node_count, dipole_status *status)
{
    float *const rgb = malloc((size_t)LUT_NODE_COUNT_MAX * IO_CHANNEL_COUNT * sizeof *rgb);
    bool is_done = rgb || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a table");
    for (size_t i = 0; i < lut->row_count && is_done; i++) {
        dipole_status why = { 0 };
        int count = node_count;
        is_done = draft_plan(&drafts[i], rgb, &count, &why) || fail_at_row(lut, i, &why, status);
        lut->node_count = count > lut->node_count ? count : lut->node_count;
    }
    free(rgb);
    return is_done;
}

/* All rows with lut->node_count nodes. *is_exact_out: whether each keeps epsilon, else *row_out does not.
 */
static bool rows_bake(struct lut_splat *lut, struct draft *drafts, bool *is_exact_out, size_t *row_out,
                      dipole_status *status)
{
    const size_t width = (size_t)lut->node_count * IO_CHANNEL_COUNT;
    free(lut->rgb);
    lut->rgb = malloc(lut->row_count * width * sizeof *lut->rgb);
    if (!lut->rgb)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a table of %zu rows",
                           lut->row_count);
    *is_exact_out = true;
    for (size_t i = 0; i < lut->row_count && *is_exact_out; i++) {
        if (!draft_try(&drafts[i], lut->node_count, POINTS_STATED, lut->rgb + i * width, status))
            return false;
        *is_exact_out = lut->rows[i].error.max <= lut->epsilon;
        *row_out = i;
    }
    return true;
}

static bool table_bake(struct lut_splat *lut, struct draft *drafts, int node_count, dipole_status *status)
{
    bool is_exact = false;
    size_t row = 0;
    if (!rows_plan(lut, drafts, node_count, status))
        return false;
    while (rows_bake(lut, drafts, &is_exact, &row, status)) {
        if (is_exact)
            return true;
        const int more = lut->node_count + lut->node_count / 32 + 1; /* the search had fewer points */
        if (node_count > 0 || more > LUT_NODE_COUNT_MAX) {
            dipole_status why = { 0 };
            dipole_fail(&why, DIPOLE_NOT_CONVERGED, NULL,
                        "%d texels reach a relative error of %.2g, expected at most epsilon = %g",
                        lut->node_count, lut->rows[row].error.max, lut->epsilon);
            return fail_at_row(lut, row, &why, status);
        }
        lut->node_count = more;
    }
    return false;
}

static bool check_request(const struct lut_request *request, dipole_status *status)
{
    const int node_count = request->size[0];
    return lut_request_check(request, status) &&
           (node_count == 0 || (node_count >= LUT_NODE_COUNT_MIN && node_count <= LUT_NODE_COUNT_MAX) ||
            dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "a width of %d texels, expected %d to %d",
                        node_count, LUT_NODE_COUNT_MIN, LUT_NODE_COUNT_MAX));
}

/* Rows of the request's materials, not yet baked; NULL: out of memory. */
static struct lut_splat *table_create(const struct lut_request *request)
{
    struct lut_splat *const lut = calloc(1, sizeof *lut);
    if (!lut || !(lut->rows = calloc(request->material_count, sizeof *lut->rows))) {
        lut_splat_destroy(lut);
        return NULL;
    }
    lut->epsilon = request->epsilon;
    lut->is_half = request->is_half;
    lut->node_count_asked = request->size[0];
    lut->row_count = request->material_count;
    for (size_t i = 0; i < lut->row_count; i++)
        lut->rows[i].material = request->materials[i];
    return lut;
}

bool lut_splat_bake(const struct lut_request *request, struct lut_splat **lut_out, dipole_status *status)
{
    *lut_out = NULL;
    if (!check_request(request, status))
        return false;
    const size_t count = request->material_count;
    struct lut_splat *lut = table_create(request);
    struct draft *const drafts = calloc(count, sizeof *drafts);
    bool is_done = (lut && drafts) || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                                                  "out of memory for %zu materials", count);
    for (size_t i = 0; i < count && is_done; i++)
        drafts[i] = (struct draft){ .row = &lut->rows[i],
                                    .is_half = request->is_half,
                                    .epsilon = request->epsilon };
    is_done = is_done && table_bake(lut, drafts, request->size[0], status);
    for (size_t i = 0; i < count && drafts; i++)
        lut_profiles_end(drafts[i].profiles);
    free(drafts);
    if (!is_done) {
        lut_splat_destroy(lut);
        return false;
    }
    *lut_out = lut;
    return true;
}
