#include "fit/target.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

void fit_target_measure_scales(struct fit_target *target)
{
    double counts[FIT_CHANNEL_COUNT] = { 0 }, shares[FIT_CHANNEL_COUNT] = { 0 };
    memset(target->value_scale, 0, sizeof target->value_scale);
    for (size_t i = 0; i < target->datum_count; i++) {
        const struct fit_datum *const datum = &target->data[i];
        target->value_scale[datum->channel] += fabs(datum->value);
        shares[datum->channel] += datum->ambient_share;
        counts[datum->channel] += 1;
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        target->ambient_scale[c] = shares[c] > 0 ? target->value_scale[c] / shares[c] : 0;
        target->value_scale[c] /= fmax(counts[c], 1);
    }
}

/* ---- profiles ---------------------------------------------------------------------------------------- */

static bool evaluate_profile(const struct fit_target *target, const struct fit_form *form,
                             const dipole_stack *stack, double *values, double *gradients)
{
    const size_t count = target->node_count;
    if (!gradients) {
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, target->node_r_mm, count, values);
        return true;
    }
    const bool is_dipole = form->model == DIPOLE_MODEL_DIPOLE ||
                           (form->model == DIPOLE_MODEL_MULTIPOLE && form->layer_count == 1 &&
                            isinf(dipole_stack_layer(stack, 0)->thickness_mm));
    if (is_dipole) {
        dipole_rd_profile_gradient(dipole_stack_coefficients(stack, 0), target->node_r_mm, count, values,
                                   gradients, gradients + count);
        memset(gradients + FIT_THICKNESS * count, 0, count * sizeof *gradients);
        return true;
    }
    dipole_stack_gradient *const found = malloc(count * sizeof *found);
    if (!found)
        return false;
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, target->node_r_mm, count, values);
    dipole_stack_profile_gradient(stack, DIPOLE_FACE_LIT, form->layer, target->node_r_mm, count, found);
    for (size_t k = 0; k < count; k++) {
        gradients[FIT_SIGMA_A * count + k] = found[k].d_log_sigma_a;
        gradients[FIT_SIGMA_S_PRIME * count + k] = found[k].d_log_sigma_s_prime;
        gradients[FIT_THICKNESS * count + k] = form->is_thickness_sought ? found[k].d_log_thickness : 0;
    }
    free(found);
    return true;
}

/* ---- totals ------------------------------------------------------------------------------------------ */

/*
 * Light that goes straight through a slab of optical thickness tau between two surfaces that mirror a part
 * f of it, per light that entered: out of the far face e^-tau (1 - f) / (1 - f^2 e^-2tau), out of the lit
 * one f e^-tau times that. Derivatives by tau.
 */
struct straight {
    double value, d_tau;
};

static struct straight straight_through(double tau, double f, dipole_face face)
{
    const double e = exp(-tau), round = f * f * e * e, rest = 1 - round;
    const double far = (1 - f) * e / rest, d_far = -far * (1 + round) / rest;
    if (face == DIPOLE_FACE_FAR)
        return (struct straight){ far, d_far };
    return (struct straight){ f * e * far, f * e * (d_far - far) };
}

static void evaluate_total(const dipole_stack *stack, const struct io_total *total, double *value,
                           double gradient[FIT_COEFFICIENT_COUNT])
{
    const bool is_far =
        total->kind == IO_TOTAL_DIFFUSE_TRANSMITTANCE || total->kind == IO_TOTAL_TRANSMITTANCE;
    const dipole_face face = is_far ? DIPOLE_FACE_FAR : DIPOLE_FACE_LIT;
    const dipole_stack_gradient scattered = dipole_stack_total_gradient(stack, face, 0);
    *value = dipole_stack_total(stack, face);
    gradient[FIT_SIGMA_A] = scattered.d_log_sigma_a;
    gradient[FIT_SIGMA_S_PRIME] = scattered.d_log_sigma_s_prime;
    gradient[FIT_THICKNESS] = 0; /* stated with the total */
    if (total->kind != IO_TOTAL_REFLECTANCE && total->kind != IO_TOTAL_TRANSMITTANCE)
        return;
    const dipole_coefficients *const c = dipole_stack_coefficients(stack, 0);
    const double mirrored = dipole_fresnel_reflectance(c->eta, 1);
    if (isfinite(total->thickness_mm)) {
        const struct straight straight =
            straight_through(c->sigma_t_prime_per_mm * total->thickness_mm, mirrored, face);
        *value += straight.value;
        gradient[FIT_SIGMA_A] += straight.d_tau * c->sigma_a_per_mm * total->thickness_mm;
        gradient[FIT_SIGMA_S_PRIME] += straight.d_tau * c->sigma_s_prime_per_mm * total->thickness_mm;
    }
    *value = (1 - mirrored) * *value + (is_far ? 0 : mirrored);
    gradient[FIT_SIGMA_A] *= 1 - mirrored;
    gradient[FIT_SIGMA_S_PRIME] *= 1 - mirrored;
}

struct totals_request {
    const struct fit_target *target;
    const struct fit_form *form;
    int channel;
    const double *logs;
    double *values, *gradients; /* gradients may be NULL */
    atomic_bool has_failed;
};

/* The totals of one slab: those of the same thickness before it have done it already. */
static void evaluate_slab(void *context, int index)
{
    struct totals_request *const request = context;
    const struct io_total *const totals = request->target->totals;
    const size_t count = request->target->node_count;
    const double thickness_mm = totals[index].thickness_mm;
    for (int k = 0; k < index; k++) {
        if (totals[k].thickness_mm == thickness_mm)
            return;
    }
    struct fit_form slab = *request->form;
    dipole_stack *stack = NULL;
    slab.layers[request->channel][slab.layer].thickness_mm = thickness_mm;
    slab.is_thickness_sought = false;
    if (!fit_form_stack_create(&slab, request->channel, request->logs, &stack, NULL)) {
        atomic_store(&request->has_failed, true);
        return;
    }
    for (size_t k = (size_t)index; k < count; k++) {
        double gradient[FIT_COEFFICIENT_COUNT];
        if (totals[k].thickness_mm != thickness_mm)
            continue;
        evaluate_total(stack, &totals[k], &request->values[k], gradient);
        for (size_t p = 0; request->gradients && p < FIT_COEFFICIENT_COUNT; p++)
            request->gradients[p * count + k] = gradient[p];
    }
    dipole_stack_destroy(stack);
}

static bool evaluate_totals(struct totals_request *request)
{
    lut_parallel_for((int)request->target->node_count, 0, evaluate_slab, request);
    return !request->has_failed;
}

/* ---- both -------------------------------------------------------------------------------------------- */

static void apply_blur(const struct fit_target *target, int channel, const double *nodes, double *rows)
{
    for (size_t i = 0; i < target->row_node_count; i++) {
        double sum = 0;
        for (size_t k = 0; k < target->node_count; k++)
            sum += target->blur[channel][i * target->node_count + k] * nodes[k];
        rows[i] = sum;
    }
}

bool fit_target_evaluate(const struct fit_target *target, const struct fit_form *form, int channel,
                         const double logs[FIT_COEFFICIENT_COUNT], double *scratch, double *values,
                         double *gradients)
{
    double *const node_values = target->blur[channel] ? scratch : values;
    double *const node_gradients =
        gradients && target->blur[channel] ? scratch + target->node_count : gradients;
    bool done;
    if (target->totals) {
        done = evaluate_totals(&(struct totals_request){ .target = target,
                                                         .form = form,
                                                         .channel = channel,
                                                         .logs = logs,
                                                         .values = node_values,
                                                         .gradients = node_gradients });
    } else {
        dipole_stack *stack = NULL;
        done = fit_form_stack_create(form, channel, logs, &stack, NULL) &&
               evaluate_profile(target, form, stack, node_values, node_gradients);
        dipole_stack_destroy(stack);
    }
    if (!done || !target->blur[channel])
        return done;
    apply_blur(target, channel, node_values, values);
    for (size_t p = 0; gradients && p < FIT_COEFFICIENT_COUNT; p++)
        apply_blur(target, channel, node_gradients + p * target->node_count,
                   gradients + p * target->row_node_count);
    return true;
}
