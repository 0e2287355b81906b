/* Baking of a translucent-shadow-map volume. T32. */
#include "lutgen/tsm.h"

#include "io/half.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- rows ---------------------------------------------------------------------------------- */

/* Rows of the volume are independent of each other. */
struct row_loop {
    const struct lut_tsm_plan *plan;
    struct lut_tsm_work *works; /* per row */
};

/* The same part of a row in the slices of all members of a class. */
static void class_bake(const struct lut_tsm_plan *plan, const struct lut_cell_class *class, int t,
                       double dz_mm, const struct lut_tsm_work *work)
{
    const struct lut_tsm *const lut = plan->lut;
    const size_t count = (size_t)lut->size[0];
    const double part = lut_tsm_global_part(plan, class->members[0], dz_mm);
    float *const first = lut_tsm_texel(lut, 0, t, class->members[0]);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        lut_tsm_response(plan, c, class->members[0], dz_mm, count, work);
        for (size_t s = 0; s < count; s++)
            first[s * IO_CHANNEL_COUNT + (size_t)c] = (float)(part * work->values[s]);
    }
    for (int i = 1; i < class->member_count; i++)
        memcpy(lut_tsm_texel(lut, 0, t, class->members[i]), first,
               count * IO_CHANNEL_COUNT * sizeof *first);
}

static void row_bake(void *context, int t)
{
    const struct row_loop *const loop = context;
    const struct lut_tsm_plan *const plan = loop->plan;
    const struct lut_tsm *const lut = plan->lut;
    const struct lut_tsm_work *const work = &loop->works[t];
    const double dz_mm = lut_tsm_depth_mm(lut, t);
    for (int s = 0; s < lut->size[0]; s++)
        work->cosines[s] = 2.0 * s / (lut->size[0] - 1) - 1;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (plan->profiles[c].stack)
            lut_tsm_means_find(plan, c, dz_mm, work);
    for (int k = 0; k < plan->class_count; k++)
        class_bake(plan, &plan->classes[k], t, dz_mm, work);
}

/* Kernel and depth factors: in row 0 where the light enters above the point, in row 1 below. */
static void local_bake(const struct lut_tsm_plan *plan, const struct lut_tsm_work *work)
{
    const struct lut_tsm *const lut = plan->lut;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        double means[LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE];
        lut_tsm_kernel_find(plan, c, means);
        for (int k = 0; k < LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE; k++)
            lut_tsm_texel(lut, k % LUT_TSM_LOCAL_SIDE, k / LUT_TSM_LOCAL_SIDE,
                          lut_tsm_kernel_slice(lut))[c] = (float)means[k];
        for (int row = 0; row < 2; row++)
            for (int s = 0; s < lut->size[0]; s++) {
                const double dz_mm = (row == 0 ? 1 : -1) * lut_tsm_local_depth_mm(lut, s);
                lut_tsm_texel(lut, s, row, lut_tsm_depth_slice(lut))[c] =
                    (float)(lut_tsm_proximity(lut, dz_mm) * lut_tsm_inner_part(plan, c, dz_mm, work));
            }
    }
}

static bool texels_create(struct lut_tsm *lut, dipole_status *status)
{
    const size_t count =
        (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2] * IO_CHANNEL_COUNT;
    free(lut->rgb);
    lut->rgb = calloc(count, sizeof *lut->rgb);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        lut->scale[c] = 1;
    return lut->rgb ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume of %d x %d x %d",
                       lut->size[0], lut->size[1], lut->size[2]);
}

bool lut_tsm_plan_bake(const struct lut_tsm_plan *plan, int thread_count, dipole_status *status)
{
    const int rows = plan->lut->size[1];
    if (!texels_create(plan->lut, status))
        return false;
    struct lut_tsm_work *const works = calloc((size_t)rows, sizeof *works);
    struct row_loop loop = { .plan = plan, .works = works };
    bool is_done = works != NULL;
    for (int t = 0; t < rows && is_done; t++)
        is_done = lut_tsm_work_create(plan, (size_t)plan->lut->size[0], &works[t]);
    if (is_done) {
        local_bake(plan, &works[0]);
        lut_parallel_for(rows, thread_count, row_bake, &loop);
    }
    for (int t = 0; t < rows && works; t++)
        lut_tsm_work_end(&works[t]);
    free(works);
    return is_done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
}

/* Divide by powers of two so that half holds the values, and round them to half; depth factors are 0 to 1.
 */
static void volume_round(struct lut_tsm *lut)
{
    const size_t width = (size_t)lut->size[0] * (size_t)lut->size[2] * IO_CHANNEL_COUNT;
    const size_t scaled = (size_t)lut->size[0] * (size_t)lut_tsm_depth_slice(lut) * IO_CHANNEL_COUNT;
    float most[IO_CHANNEL_COUNT] = { 0 };
    double over_scale[IO_CHANNEL_COUNT];
    for (int t = 0; t < lut->size[1]; t++)
        for (size_t i = 0; i < scaled; i++) {
            const float value = lut->rgb[(size_t)t * width + i];
            most[i % IO_CHANNEL_COUNT] =
                value > most[i % IO_CHANNEL_COUNT] ? value : most[i % IO_CHANNEL_COUNT];
        }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        lut->scale[c] = lut_half_scale((double)most[c]);
        over_scale[c] = 1 / lut->scale[c];
    }
    for (int t = 0; t < lut->size[1]; t++)
        for (size_t i = 0; i < width; i++) {
            float *const value = &lut->rgb[(size_t)t * width + i];
            const float held =
                i < scaled ? (float)((double)*value * over_scale[i % IO_CHANNEL_COUNT]) : *value;
            *value = io_float_from_half(io_half_from_float(held));
        }
}

/* ---- the size that keeps epsilon ----------------------------------------------------------------- */

/* What lies between the points of an audit can be so much larger. */
static const double audit_margin = 1.25;

static bool try_size(struct lut_tsm_plan *plan, int thread_count, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    if (!lut_tsm_plan_bake(plan, thread_count, status))
        return false;
    if (lut->is_half)
        volume_round(lut);
    if (!lut_tsm_plan_audit(plan, LUT_AUDIT_BOTH, 2 * (lut->size[1] - 1), LUT_SEED_BAKE, thread_count,
                            &lut->error, status))
        return false;
    lut->error.max = audit_margin * lut->error.max + lut->source_error;
    lut->error.p99 = fmin(audit_margin * lut->error.p99 + lut->source_error, lut->error.max);
    return true;
}

/* Double the side whose own error is larger, if its size was not given; false where that ends. */
static bool grow(struct lut_tsm_plan *plan, int thread_count, bool *has_grown, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    struct lut_error by_s, by_t;
    const int depth_count = lut->size[1] / 2; /* fewer than for the error itself will do to compare */
    if (!lut_tsm_plan_audit(plan, LUT_AUDIT_S, depth_count, LUT_SEED_BAKE, thread_count, &by_s, status) ||
        !lut_tsm_plan_audit(plan, LUT_AUDIT_T, depth_count, LUT_SEED_BAKE, thread_count, &by_t, status))
        return false;
    const bool can_s = lut->size_asked[0] == 0 && lut->size[0] < LUT_TSM_SIDE_MAX &&
                       2 * lut->size[0] * lut->size[2] <= IO_IMAGE_SIDE_LIMIT;
    const bool can_t = lut->size_asked[1] == 0 && lut->size[1] < LUT_TSM_SIDE_MAX;
    *has_grown = can_s || can_t;
    if (can_s && (by_s.max > by_t.max || !can_t))
        lut->size[0] *= 2;
    else if (can_t)
        lut->size[1] *= 2;
    return true;
}

static bool size_find(struct lut_tsm_plan *plan, int thread_count, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    for (bool has_grown = true; has_grown;) {
        if (!try_size(plan, thread_count, status))
            return false;
        if (lut->error.max <= lut->epsilon)
            return true;
        if (!grow(plan, thread_count, &has_grown, status))
            return false;
    }
    return dipole_fail(status, DIPOLE_NOT_CONVERGED, NULL,
                       "%d x %d x %d texels reach a relative error of %.2g, expected at most epsilon = %g",
                       lut->size[0], lut->size[1], lut->size[2], lut->error.max, lut->epsilon);
}

/* ---- volumes ---------------------------------------------------------------------------------- */

void lut_tsm_destroy(struct lut_tsm *lut)
{
    if (lut)
        free(lut->rgb);
    free(lut);
}

static const int usual_size[3] = { 64, 64, 32 };

static bool check_request(const struct lut_request *request, dipole_status *status)
{
    if (!lut_request_check(request, status))
        return false;
    for (int i = 0; i < 2; i++)
        if (request->size[i] != 0 &&
            (request->size[i] < LUT_TSM_SIDE_MIN || request->size[i] > LUT_TSM_SIDE_MAX))
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "a volume of %d x %d x %d, expected %d to %d for %s", request->size[0],
                               request->size[1], request->size[2], LUT_TSM_SIDE_MIN, LUT_TSM_SIDE_MAX,
                               i == 0 ? "S" : "T");
    if (request->size[2] != 0 && !lut_pattern_has(request->size[2]))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "a volume of %d slices, expected 16, 32, 64, 128 or 256", request->size[2]);
    const int s = request->size[0] > 0 ? request->size[0] : usual_size[0];
    const int r = request->size[2] > 0 ? request->size[2] : usual_size[2];
    return s * r <= IO_IMAGE_SIDE_LIMIT ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                       "%d slices of %d texels side by side, expected at most %d texels", r, s,
                       IO_IMAGE_SIDE_LIMIT);
}

bool lut_tsm_bake(const struct lut_request *request, int thread_count, struct lut_tsm **lut_out,
                  dipole_status *status)
{
    *lut_out = NULL;
    if (!check_request(request, status))
        return false;
    struct lut_tsm *const lut = calloc(1, sizeof *lut);
    if (!lut)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    lut->material = request->materials[0];
    lut->epsilon = request->epsilon;
    lut->is_half = request->is_half;
    for (int i = 0; i < 3; i++) {
        lut->size_asked[i] = request->size[i];
        lut->size[i] = request->size[i] > 0 ? request->size[i] : usual_size[i];
    }
    struct lut_tsm_plan *plan = NULL;
    const bool is_done = lut_tsm_plan_create(lut, &plan, status) && size_find(plan, thread_count, status);
    lut_tsm_plan_destroy(plan);
    if (is_done)
        *lut_out = lut;
    else
        lut_tsm_destroy(lut);
    return is_done;
}
