/* Totals of slabs by every rung, against adding and doubling. docs/theory.md T78. */
#include "accuracy/ladder_parts.h"

#include <math.h>

/* Adding and doubling is compared over so many slabs that each needs no more photons than this. */
enum { PHOTON_LIMIT = 100000 };

/* Numbers below this part of the light are left out of relative errors. */
#define LEAST_TOTAL 0.01

/* What a rung errs by over the slabs of one g. */
struct total_sums {
    double error2, *times_ns;
    size_t count, time_count;
};

static void add_total(struct total_sums *sums, double found, double expected, double error)
{
    if (!(expected > LEAST_TOTAL && error < 0.005 * expected))
        return;
    const double relative = found / expected - 1;
    sums->error2 += relative * relative;
    sums->count++;
}

static bool climb_totals_by_photons(const struct accuracy_ladder_options *options,
                                    const struct accuracy_reference_slab *slab, size_t rung, bool is_last,
                                    struct total_sums *sums, struct accuracy_agreement *agreement,
                                    dipole_status *status)
{
    struct ladder_trace call = { .stack = &slab->stack,
                                 .run = { ladder_kinds[rung].photon_count, options->seed + sums->time_count,
                                          1 } };
    sums->times_ns[sums->time_count++] = ladder_measure_ns(ladder_trace_call, &call);
    const struct accuracy_mc_powers *const mean = &call.result.mean, *const error = &call.result.error;
    if (!call.is_done) {
        if (status)
            *status = call.status;
        return false;
    }
    const double r = mean->unscattered_reflected + mean->reflected;
    const double t = mean->unscattered_transmitted + mean->transmitted;
    const double r_expected = slab->total_r - mean->specular;
    add_total(sums, r, r_expected, slab->error);
    add_total(sums, t, slab->total_t, slab->error);
    if (is_last) {
        ladder_agree(agreement, r, r_expected, hypot(error->reflected, slab->error));
        if (slab->total_t > LEAST_TOTAL)
            ladder_agree(agreement, t, slab->total_t, hypot(error->transmitted, slab->error));
    }
    return true;
}

static bool climb_totals_by_model(const struct accuracy_reference_slab *slab, size_t rung,
                                  struct total_sums *sums, dipole_status *status)
{
    struct ladder_model call;
    ladder_model_init(&slab->stack, ladder_kinds[rung].model, &call);
    ladder_model_call(&call);
    if (!call.stack) {
        if (status)
            *status = call.status;
        return call.status.code == DIPOLE_NOT_SUPPORTED;
    }
    const double specular = dipole_fresnel_reflectance(slab->stack.layers[0].eta, 1);
    sums->times_ns[sums->time_count++] = ladder_measure_ns(ladder_model_call, &call);
    add_total(sums, call.reflected * (1 - specular), slab->total_r - specular, slab->error);
    add_total(sums, call.transmitted * (1 - specular), slab->total_t, slab->error);
    dipole_stack_destroy(call.stack);
    return true;
}

bool ladder_climb_totals(const struct accuracy_ladder_options *options, size_t rung, int is_forward,
                         struct accuracy_ladder *ladder, dipole_status *status)
{
    const size_t most = options->is_quick ? PHOTON_LIMIT / 10 : PHOTON_LIMIT;
    double times_ns[ACCURACY_REFERENCE_SLAB_LIMIT];
    struct total_sums sums = { .times_ns = times_ns };
    bool done = true;
    if (ladder_kinds[rung].photon_count > most)
        return true;
    for (size_t i = 0; i < options->reference->slab_count && done && !ladder_is_stopped(options); i++) {
        const struct accuracy_reference_slab *const slab = &options->reference->slabs[i];
        if ((slab->stack.layers[0].g > 0) != is_forward)
            continue;
        done = ladder_kinds[rung].photon_count > 0
                   ? climb_totals_by_photons(options, slab, rung, ladder_kinds[rung].photon_count == most,
                                             &sums, &ladder->agreement_totals, status)
                   : climb_totals_by_model(slab, rung, &sums, status);
    }
    if (sums.count > 0) {
        ladder->totals[is_forward][rung] =
            (struct accuracy_rung){ .is_known = true,
                                    .error = sqrt(sums.error2 / (double)sums.count),
                                    .time_ns = accuracy_median(times_ns, sums.time_count) };
        ladder->total_counts[is_forward][rung] = sums.count;
    }
    return done;
}
