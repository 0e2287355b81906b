/* One case by every rung, and its time. docs/theory.md T78. */
#include "accuracy/ladder_parts.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

const struct ladder_kind ladder_kinds[ACCURACY_RUNG_COUNT] = {
    { .name = "Monte Carlo, 10^3 photons", .photon_count = 1000 },
    { .name = "Monte Carlo, 10^4 photons", .photon_count = 10000 },
    { .name = "Monte Carlo, 10^5 photons", .photon_count = 100000 },
    { .name = "Monte Carlo, 10^6 photons", .photon_count = 1000000 },
    { .name = "dipole", .model = DIPOLE_MODEL_DIPOLE },
    { .name = "better dipole", .model = DIPOLE_MODEL_BETTER_DIPOLE },
    { .name = "multipole", .model = DIPOLE_MODEL_MULTIPOLE },
    { .name = "beam", .model = DIPOLE_MODEL_BEAM },
    { .name = "modes", .model = DIPOLE_MODEL_MODES },
};

/* ---- time ----------------------------------------------------------------------------------------- */

enum { REPEAT_COUNT = 5 };

/* Of this thread on a processor: others that run do not count. */
static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double ladder_measure_ns(void (*call)(void *context), void *context)
{
    double times_ns[REPEAT_COUNT];
    const double begin_s = now_s();
    call(context);
    const double first_s = now_s() - begin_s;
    const int calls = (int)fmin(fmax(5e-4 / fmax(first_s, 1e-9), 1), 1e5);
    if (first_s > 0.1)
        return 1e9 * first_s;
    for (int i = 0; i < REPEAT_COUNT; i++) {
        const double start_s = now_s();
        for (int k = 0; k < calls; k++)
            call(context);
        times_ns[i] = 1e9 * (now_s() - start_s) / calls;
    }
    return accuracy_median(times_ns, REPEAT_COUNT);
}

/* ---- what is timed -------------------------------------------------------------------------------- */

void ladder_trace_call(void *context)
{
    struct ladder_trace *const call = context;
    call->is_done = accuracy_mc_trace(call->stack, &call->run, call->rings, &call->result, &call->status);
}

void ladder_model_init(const struct accuracy_mc_stack *stack, dipole_model model, struct ladder_model *out)
{
    *out = (struct ladder_model){ .layer_count = stack->layer_count, .model = model };
    for (size_t i = 0; i < stack->layer_count; i++) {
        const struct accuracy_mc_layer *const from = &stack->layers[i];
        out->layers[i].medium =
            (dipole_medium){ .sigma_a_per_mm = from->sigma_a_per_mm,
                             .sigma_s_prime_per_mm = from->sigma_s_per_mm * (1 - from->g),
                             .eta = from->eta };
        out->layers[i].thickness_mm = from->thickness_mm;
    }
}

void ladder_model_call(void *context)
{
    struct ladder_model *const call = context;
    dipole_stack_destroy(call->stack);
    if (!dipole_stack_create(call->layers, call->layer_count, call->model, DIPOLE_FROM_ABOVE, &call->stack,
                             &call->status))
        return;
    call->reflected = dipole_stack_total(call->stack, DIPOLE_FACE_LIT) +
                      dipole_stack_unscattered(call->stack, DIPOLE_FACE_LIT);
    call->transmitted = dipole_stack_total(call->stack, DIPOLE_FACE_FAR) +
                        dipole_stack_unscattered(call->stack, DIPOLE_FACE_FAR);
}

static void call_profile(void *context)
{
    struct ladder_model *const call = context;
    dipole_stack_profile_per_mm2(call->stack, DIPOLE_FACE_LIT, call->r_mm, call->count, call->values);
}

/* ---- profiles ------------------------------------------------------------------------------------- */

double ladder_area_mm2(const struct accuracy_ladder_case *at, size_t ring)
{
    const double lo_mm = at->edges_mm[ring], hi_mm = at->edges_mm[ring + 1];
    return LADDER_PI * (hi_mm - lo_mm) * (hi_mm + lo_mm);
}

/* T78 */
static double profile_error(const struct accuracy_ladder_case *at, const double *rd_per_mm2)
{
    double difference = 0, sum = 0;
    for (size_t i = 0; i < at->ring_count; i++) {
        difference += ladder_area_mm2(at, i) * fabs(rd_per_mm2[i] - at->rd_per_mm2[i]);
        sum += ladder_area_mm2(at, i) * at->rd_per_mm2[i];
    }
    return difference / sum;
}

/* What Gaussian errors of the truth come to: the mean of their absolute values. */
static double noise_floor(const struct accuracy_ladder_case *at)
{
    double difference = 0, sum = 0;
    for (size_t i = 0; i < at->ring_count; i++) {
        difference += ladder_area_mm2(at, i) * at->rd_error[i];
        sum += ladder_area_mm2(at, i) * at->rd_per_mm2[i];
    }
    return sqrt(2 / LADDER_PI) * difference / sum;
}

void ladder_agree(struct accuracy_agreement *agreement, double found, double expected, double error)
{
    if (!(error > 0))
        return;
    const double z = fabs(found - expected) / error;
    agreement->mean_square += (z * z - agreement->mean_square) / (double)(agreement->count + 1);
    agreement->count++;
    agreement->beyond_count += z > 3;
    agreement->worst = fmax(agreement->worst, z);
}

static void compare_with_mcml(const struct accuracy_ladder_case *at, const double *rd_per_mm2,
                              const double *rd_error, const struct accuracy_mc_powers *mean,
                              const struct accuracy_mc_powers *error,
                              const struct accuracy_reference_case *reference,
                              struct accuracy_ladder *ladder)
{
    ladder_agree(&ladder->agreement_totals, mean->reflected, reference->reflected,
                 hypot(error->reflected, reference->reflected_error));
    ladder_agree(&ladder->agreement_totals, mean->transmitted, reference->transmitted,
                 hypot(error->transmitted, reference->transmitted_error));
    for (size_t i = 0; i < at->ring_count; i++) {
        const double of_both = hypot(rd_error[i], at->rd_error[i]);
        if (of_both <
            0.06 * fmin(rd_per_mm2[i], at->rd_per_mm2[i])) /* else too few photons for a Gaussian error */
            ladder_agree(&ladder->agreement_rings, rd_per_mm2[i], at->rd_per_mm2[i], of_both);
    }
}

bool ladder_trace_case(const struct accuracy_ladder_case *at, const struct accuracy_mc_run *run,
                       double *rd_per_mm2, double *rd_error, struct accuracy_mc_result *result,
                       double *time_ns, dipole_status *status)
{
    double td[2][ACCURACY_LADDER_RING_LIMIT];
    const struct accuracy_mc_rings rings = { at->edges_mm, at->ring_count, rd_per_mm2,
                                             rd_error,     td[0],          td[1] };
    struct ladder_trace call = { .stack = &at->stack, .run = *run, .rings = &rings };
    if (time_ns)
        *time_ns = ladder_measure_ns(ladder_trace_call, &call);
    else
        ladder_trace_call(&call);
    if (!call.is_done) {
        if (status)
            *status = call.status;
        return false;
    }
    for (size_t i = 0; i < at->ring_count; i++) {
        rd_per_mm2[i] /= 1 - call.result.mean.specular;
        rd_error[i] /= 1 - call.result.mean.specular;
    }
    *result = call.result;
    return true;
}

double ladder_reflected(const struct accuracy_mc_powers *powers)
{
    return (powers->reflected + powers->unscattered_reflected) / (1 - powers->specular);
}

static bool climb_by_photons(struct accuracy_ladder_case *at, size_t rung, uint64_t seed, bool is_last,
                             const struct accuracy_reference_case *reference,
                             struct accuracy_ladder *ladder, dipole_status *status)
{
    const struct accuracy_mc_run run = { ladder_kinds[rung].photon_count, seed, 1 };
    double rd_per_mm2[ACCURACY_LADDER_RING_LIMIT], rd_error[ACCURACY_LADDER_RING_LIMIT], time_ns;
    struct accuracy_mc_result result;
    if (!ladder_trace_case(at, &run, rd_per_mm2, rd_error, &result, &time_ns, status))
        return false;
    at->rungs[rung] =
        (struct accuracy_rung){ .is_known = true,
                                .error = profile_error(at, rd_per_mm2),
                                .total_error = ladder_reflected(&result.mean) / at->reflected - 1,
                                .time_ns = time_ns / (double)at->ring_count };
    if (is_last && reference)
        compare_with_mcml(at, rd_per_mm2, rd_error, &result.mean, &result.error, reference, ladder);
    return true;
}

static bool climb_by_model(struct accuracy_ladder_case *at, size_t rung, dipole_status *status)
{
    double r_mm[ACCURACY_LADDER_RING_LIMIT], values[ACCURACY_LADDER_RING_LIMIT];
    struct ladder_model call;
    ladder_model_init(&at->stack, ladder_kinds[rung].model, &call);
    call.r_mm = r_mm;
    call.count = at->ring_count;
    call.values = values;
    for (size_t i = 0; i < at->ring_count; i++)
        r_mm[i] = 0.5 * (at->edges_mm[i] + at->edges_mm[i + 1]);
    ladder_model_call(&call);
    if (!call.stack) {
        if (status)
            *status = call.status;
        return call.status.code == DIPOLE_NOT_SUPPORTED;
    }
    struct accuracy_rung *const out = &at->rungs[rung];
    *out = (struct accuracy_rung){ .is_known = true, .total_error = call.reflected / at->reflected - 1 };
    out->prepare_ns = ladder_measure_ns(ladder_model_call, &call);
    if (!call.stack)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a model");
    out->time_ns = ladder_measure_ns(call_profile, &call) / (double)at->ring_count;
    for (size_t i = 0; i < at->ring_count; i++)
        values[i] = dipole_stack_ring_mean_per_mm2(call.stack, DIPOLE_FACE_LIT, at->edges_mm[i],
                                                   at->edges_mm[i + 1]);
    out->error = profile_error(at, values);
    dipole_stack_destroy(call.stack);
    return true;
}

bool ladder_climb(const struct accuracy_ladder_options *options, struct accuracy_ladder_case *at,
                  const struct accuracy_reference_case *reference, struct accuracy_ladder *ladder,
                  dipole_status *status)
{
    /* Truth of our own is no truth for as many photons. */
    const size_t most = at->is_own_truth    ? options->truth_photon_count / 4
                        : options->is_quick ? 100000
                                            : SIZE_MAX;
    bool done = true;
    at->floor = noise_floor(at);
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT && done; i++) {
        const bool is_last = i + 1 == ACCURACY_RUNG_COUNT || ladder_kinds[i + 1].photon_count == 0 ||
                             ladder_kinds[i + 1].photon_count > most;
        /* The multipole of a half-space is the dipole. */
        if (ladder_kinds[i].model == DIPOLE_MODEL_MULTIPOLE && at->stack.layer_count == 1 &&
            isinf(at->stack.layers[0].thickness_mm))
            continue;
        if (ladder_kinds[i].photon_count == 0)
            done = climb_by_model(at, i, status);
        else if (ladder_kinds[i].photon_count <= most)
            done = climb_by_photons(at, i, options->seed + 1 + i, is_last, reference, ladder, status);
    }
    return done;
}
