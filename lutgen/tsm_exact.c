/* The response without a volume: its sources, and what depends on the depth alone. T32. */
#include "lutgen/tsm.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static double node_depth_mm(int node, int node_count, double scale_mm, double max_mm)
{
    return scale_mm * sinh((2.0 * node / (node_count - 1) - 1) * asinh(max_mm / scale_mm));
}

/* The response where the surface lies across the light is the cell's mean there: over the form of T30 at
 * the same place it is the factor. */
static double factor_at(const struct lut_tsm_plan *plan, int channel, int sample, double dz_mm,
                        const struct lut_tsm_work *work)
{
    const double *const offset_mm = plan->lut->samples[sample].offset_mm;
    const double distance_mm =
        sqrt(offset_mm[0] * offset_mm[0] + offset_mm[1] * offset_mm[1] + dz_mm * dz_mm);
    const double cosine = distance_mm > 0 ? -dz_mm / distance_mm : 1;
    double form;
    work->cosines[0] = cosine;
    lut_tsm_response(plan, channel, sample, dz_mm, 1, work);
    dipole_sources_profile_per_mm2(&plan->sources[channel], distance_mm, &cosine, 1, &form);
    return form > 0 ? work->values[0] / form : 0;
}

static void factors_fill(const struct lut_tsm_plan *plan, const struct lut_tsm_work *work,
                         struct lut_tsm_exact *exact)
{
    const struct lut_tsm *const lut = plan->lut;
    const size_t count = (size_t)exact->node_count, samples = (size_t)lut->sample_count;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        for (size_t k = 0; k < count; k++) {
            const double dz_mm =
                node_depth_mm((int)k, exact->node_count, lut->depth_scale_mm, lut->depth_max_mm);
            lut_tsm_means_find(plan, c, dz_mm, work);
            for (size_t i = 0; i < samples; i++)
                exact->rgb[(i * count + k) * IO_CHANNEL_COUNT + (size_t)c] =
                    (float)(lut_tsm_global_part(plan, (int)i, dz_mm) *
                            factor_at(plan, c, (int)i, dz_mm, work));
        }
    }
}

bool lut_tsm_exact_create(const struct lut_tsm *lut, int node_count, struct lut_tsm_exact **exact_out,
                          dipole_status *status)
{
    assert(node_count >= 2 && node_count <= 65536);
    struct lut_tsm copy = *lut; /* the plan derives its lengths anew */
    struct lut_tsm_plan *plan = NULL;
    struct lut_tsm_work work = { 0 };
    *exact_out = NULL;
    struct lut_tsm_exact *const exact = calloc(1, sizeof *exact);
    if (exact)
        exact->rgb =
            calloc((size_t)lut->sample_count * (size_t)node_count, IO_CHANNEL_COUNT * sizeof *exact->rgb);
    bool is_done = exact && exact->rgb;
    if (!is_done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the response of %d samples",
                    lut->sample_count);
    is_done = is_done && lut_tsm_plan_create(&copy, &plan, status);
    if (is_done && !lut_tsm_work_create(plan, 1, &work))
        is_done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the response");
    if (is_done) {
        exact->node_count = node_count;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            exact->sources[c] = plan->sources[c];
        factors_fill(plan, &work, exact);
        *exact_out = exact;
    } else {
        lut_tsm_exact_destroy(exact);
    }
    lut_tsm_work_end(&work);
    lut_tsm_plan_destroy(plan);
    return is_done;
}

void lut_tsm_exact_destroy(struct lut_tsm_exact *exact)
{
    if (exact)
        free(exact->rgb);
    free(exact);
}
