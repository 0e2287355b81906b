/*
 * Profiles of stacks of layers: one interface over all models. docs/theory.md T22 to T26.
 *
 * A half-space of the dipole and of the beam model is a row of sources (row.h). Everything else is an
 * inverse Hankel transform of the model's response.
 */
#include "internal.h"
#include "row.h"

#include <stdlib.h>
#include <string.h>

typedef void response_function(const struct system *system, double complex k2, struct dual out[2]);

struct dipole_stack {
    size_t count;
    dipole_side side;
    dipole_model model;
    dipole_layer layers[DIPOLE_LAYER_LIMIT]; /* in the order in which the light meets them */
    dipole_coefficients coefficients[DIPOLE_LAYER_LIMIT];
    response_function *response;
    struct system system;
    double r_floor_mm;               /* below it the profile goes on as a constant */
    double total[2], unscattered[2]; /* by dipole_face */
    struct row row;                  /* of a half-space; count 0 for none; into the same allocation */
    struct hankel hankel[2];         /* by dipole_face; of models that are no row of sources */
};

/* The place of a layer, counted from the top, in the order in which the light meets them; and back. */
static size_t place(const dipole_stack *stack, size_t index)
{
    return stack->side == DIPOLE_FROM_ABOVE ? index : stack->count - 1 - index;
}

/* ---- creation ------------------------------------------------------------------------------------- */

static bool layers_check(const dipole_layer *layers, size_t count, dipole_side side, dipole_status *status)
{
    if (count < 1 || count > DIPOLE_LAYER_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "%zu layers, expected 1 to %d", count,
                           (int)DIPOLE_LAYER_LIMIT);
    for (size_t i = 0; i < count; i++) {
        const double d = layers[i].thickness_mm;
        const bool is_last = i + 1 == count;
        if (!(is_last && d == INFINITY) && !(d >= DIPOLE_THICKNESS_MIN_MM && d <= DIPOLE_THICKNESS_MAX_MM))
            return dipole_fail(
                status, DIPOLE_BAD_VALUE, NULL, "layers[%zu].thickness_mm is %g, expected > 0 (%g to %g%s)",
                i, d, DIPOLE_THICKNESS_MIN_MM, DIPOLE_THICKNESS_MAX_MM, is_last ? ", or infinite" : "");
    }
    if (side == DIPOLE_FROM_BELOW && isinf(layers[count - 1].thickness_mm))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "layers[%zu].thickness_mm is inf, expected a finite one for light from below",
                           count - 1);
    if (side != DIPOLE_FROM_ABOVE && side != DIPOLE_FROM_BELOW)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "side is %d, expected a dipole_side", (int)side);
    return true;
}

/* Of media that are sound on their own. */
static bool ratios_check(const dipole_layer *layers, size_t count, dipole_status *status)
{
    for (size_t i = 1; i < count; i++) {
        const double ratio = layers[i].medium.eta / layers[i - 1].medium.eta;
        if (ratio < DIPOLE_ETA_MIN || ratio > DIPOLE_ETA_MAX)
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "layers[%zu].eta is %g times that of the layer above, expected %g to %g", i,
                               ratio, DIPOLE_ETA_MIN, DIPOLE_ETA_MAX);
    }
    return true;
}

static bool model_check(const dipole_stack *stack, dipole_model model, dipole_status *status)
{
    const bool is_half_space = stack->count == 1 && isinf(stack->layers[0].thickness_mm);
    switch (model) {
    case DIPOLE_MODEL_BEAM:
    case DIPOLE_MODEL_MODES:
        return true;
    case DIPOLE_MODEL_DIPOLE:
    case DIPOLE_MODEL_BETTER_DIPOLE:
        return is_half_space || dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                                            "this model knows only a half-space, expected \"beam\", "
                                            "\"modes\" or \"multipole\" for layers");
    case DIPOLE_MODEL_MULTIPOLE:
        for (size_t i = 0; i < stack->count; i++)
            if (!(stack->layers[i].thickness_mm > stack->coefficients[i].mean_free_path_mm))
                return dipole_fail(
                    status, DIPOLE_NOT_SUPPORTED, NULL,
                    "layers[%zu] is %g mm thick, and the source of the multipole lies %g mm deep, "
                    "below it; expected a thicker layer, or the model \"beam\" or \"modes\", which have no "
                    "limit",
                    place(stack, i), stack->layers[i].thickness_mm,
                    stack->coefficients[i].mean_free_path_mm);
        return true;
    }
    return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "model is %d, expected a dipole_model", (int)model);
}

static bool coefficients_fill(dipole_stack *stack, dipole_status *status)
{
    for (size_t i = 0; i < stack->count; i++) {
        dipole_status why;
        if (!dipole_coefficients_init(&stack->layers[i].medium, &stack->coefficients[i], &why))
            return stack->count == 1 ? dipole_fail(status, why.code, NULL, "%s", why.message)
                                     : dipole_fail(status, why.code, NULL, "layers[%zu].%s",
                                                   place(stack, i), why.message);
    }
    return true;
}

/* What the model's response is computed from; parameter as in dipole_system_init(). */
static void system_init(const dipole_stack *stack, int parameter, struct system *system)
{
    dipole_system_init(system, stack->layers, stack->coefficients, stack->count, parameter);
    if (stack->model == DIPOLE_MODEL_MODES)
        dipole_modes_init(system);
    if (stack->response == dipole_multipole_solve) /* the dipole's, too */
        dipole_multipole_init(system);
}

/* sigma_tr of the last layer as the model has it. */
static double base_sigma_tr_per_mm(const dipole_stack *stack)
{
    const dipole_coefficients *const c = &stack->coefficients[stack->count - 1];
    if (stack->model == DIPOLE_MODEL_MODES)
        return sqrt(creal(stack->system.mode_layers[stack->count - 1].q2[0].v));
    const double grosjean = 3.0 * c->sigma_a_per_mm / (c->sigma_t_prime_per_mm + c->sigma_a_per_mm);
    return stack->model == DIPOLE_MODEL_BETTER_DIPOLE ? c->sigma_t_prime_per_mm * sqrt(grosjean)
                                                      : c->sigma_tr_per_mm;
}

/* Where R^ and T^ begin to be singular. */
static double singularity_per_mm(const dipole_stack *stack)
{
    if (stack->model == DIPOLE_MODEL_BEAM)
        return dipole_system_first_singularity_per_mm(&stack->system);
    if (stack->model == DIPOLE_MODEL_MODES)
        return dipole_modes_first_singularity_per_mm(&stack->system);
    if (stack->model == DIPOLE_MODEL_MULTIPOLE)
        return dipole_multipole_first_singularity_per_mm(&stack->system);
    return base_sigma_tr_per_mm(stack);
}

static double shortest_length_mm(const dipole_stack *stack)
{
    double shortest = INFINITY;
    for (size_t i = 0; i < stack->count; i++)
        shortest = fmin(shortest, stack->coefficients[i].mean_free_path_mm);
    return shortest;
}

static void totals_fill(dipole_stack *stack)
{
    const bool has_beam = stack->model == DIPOLE_MODEL_BEAM || stack->model == DIPOLE_MODEL_MODES;
    struct dual totals[2];
    stack->response(&stack->system, 0.0, totals);
    for (int face = 0; face < 2; face++) {
        stack->total[face] = creal(totals[face].v);
        stack->unscattered[face] = has_beam ? creal(stack->system.unscattered[face].v) : 0.0;
    }
}

static double complex response_lit(const void *context, double complex k2)
{
    const dipole_stack *const stack = context;
    struct dual f[2];
    stack->response(&stack->system, k2, f);
    return f[DIPOLE_FACE_LIT].v;
}

static double complex response_far(const void *context, double complex k2)
{
    const dipole_stack *const stack = context;
    struct dual f[2];
    stack->response(&stack->system, k2, f);
    return f[DIPOLE_FACE_FAR].v;
}

/* Everything but a row of sources: lay out and fill the contours of both faces. */
static bool hankels_init(dipole_stack *stack)
{
    static hankel_function *const responses[2] = { response_lit, response_far };
    const size_t last = stack->count - 1;
    const bool is_half_space = isinf(stack->layers[last].thickness_mm);
    struct hankel_input input = {
        .context = stack,
        .singularity_per_mm = singularity_per_mm(stack),
        .r_min_mm = stack->r_floor_mm,
        .extent_mm = is_half_space ? stack->coefficients[last].mean_free_path_mm : 0.0,
    };
    for (size_t i = 0; i < stack->count; i++)
        input.extent_mm += i < last || !is_half_space ? stack->layers[i].thickness_mm : 0.0;
    input.is_cut = is_half_space && input.singularity_per_mm == base_sigma_tr_per_mm(stack);
    for (int face = 0; face < 2; face++) {
        input.response = responses[face];
        if (!dipole_hankel_init(&stack->hankel[face], &input))
            return false;
    }
    return true;
}

/* The row of sources of a half-space, in 3 row.count doubles. */
static void row_fill(dipole_stack *stack, double *storage)
{
    const size_t count = stack->row.count;
    const dipole_coefficients *const c = &stack->coefficients[0];
    double *const depth_mm = storage, *const depth_low_mm = storage + count,
                  *const weight = storage + 2 * count;
    if (count == 2) {
        struct row_of_two pair;
        dipole_row_of_two_init(c, &pair);
        memcpy(depth_mm, pair.depth_mm, sizeof pair.depth_mm);
        memcpy(depth_low_mm, pair.depth_low_mm, sizeof pair.depth_low_mm);
        memcpy(weight, pair.weight, sizeof pair.weight);
    } else {
        dipole_row_beam_fill(c, depth_mm, depth_low_mm, weight);
    }
    stack->row = (struct row){ c, count, depth_mm, depth_low_mm, weight };
}

bool dipole_stack_create(const dipole_layer *layers, size_t count, dipole_model model, dipole_side side,
                         dipole_stack **stack_out, dipole_status *status)
{
    *stack_out = NULL;
    if (!layers_check(layers, count, side, status))
        return false;
    dipole_stack draft = { .count = count, .side = side, .model = model };
    for (size_t i = 0; i < count; i++)
        draft.layers[i] = layers[place(&draft, i)];
    if (!coefficients_fill(&draft, status) || !ratios_check(layers, count, status) ||
        !model_check(&draft, model, status))
        return false;
    static response_function *const responses[] = {
        [DIPOLE_MODEL_DIPOLE] = dipole_multipole_solve,
        [DIPOLE_MODEL_BETTER_DIPOLE] = dipole_better_dipole_solve,
        [DIPOLE_MODEL_MULTIPOLE] = dipole_multipole_solve,
        [DIPOLE_MODEL_BEAM] = dipole_system_solve,
        [DIPOLE_MODEL_MODES] = dipole_modes_solve,
    };
    draft.response = responses[model];
    system_init(&draft, -1, &draft.system);
    totals_fill(&draft);

    draft.r_floor_mm = 1e-9 * shortest_length_mm(&draft);
    const bool is_half_space = count == 1 && isinf(layers[0].thickness_mm);
    if (is_half_space && model == DIPOLE_MODEL_BEAM)
        draft.row.count = dipole_row_beam_count(&draft.coefficients[0]);
    else if (is_half_space && (model == DIPOLE_MODEL_DIPOLE || model == DIPOLE_MODEL_MULTIPOLE))
        draft.row.count = 2;

    dipole_stack *const stack = malloc(sizeof *stack + 3 * draft.row.count * sizeof(double));
    if (stack == NULL)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu layers", count);
    *stack = draft;
    if (stack->row.count > 0) {
        row_fill(stack, (double *)(stack + 1));
    } else if (!hankels_init(stack)) {
        dipole_stack_destroy(stack);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu layers", count);
    }
    *stack_out = stack;
    return true;
}

void dipole_stack_destroy(dipole_stack *stack)
{
    if (stack == NULL)
        return;
    for (int face = 0; face < 2; face++)
        dipole_hankel_clear(&stack->hankel[face]);
    free(stack);
}

size_t dipole_stack_layer_count(const dipole_stack *stack)
{
    return stack->count;
}

const dipole_layer *dipole_stack_layer(const dipole_stack *stack, size_t index)
{
    return &stack->layers[place(stack, index)];
}

const dipole_coefficients *dipole_stack_coefficients(const dipole_stack *stack, size_t index)
{
    return &stack->coefficients[place(stack, index)];
}

dipole_model dipole_stack_model(const dipole_stack *stack)
{
    return stack->model;
}

double dipole_stack_decay_per_mm(const dipole_stack *stack)
{
    return singularity_per_mm(stack);
}

/* ---- what a stack sends out ----------------------------------------------------------------------- */

double dipole_stack_total(const dipole_stack *stack, dipole_face face)
{
    return stack->total[face];
}

double dipole_stack_unscattered(const dipole_stack *stack, dipole_face face)
{
    return stack->unscattered[face];
}

double dipole_stack_spectrum(const dipole_stack *stack, dipole_face face, double k_per_mm)
{
    if (!(k_per_mm >= 0.0))
        return NAN;
    struct dual f[2];
    stack->response(&stack->system, k_per_mm * k_per_mm, f);
    return fmax(creal(f[face].v), 0.0);
}

/* The row of sources of what a face sends out; of the far face of a half-space nothing. */
static double row_profile(const dipole_stack *stack, dipole_face face, double r_mm)
{
    if (face != DIPOLE_FACE_LIT)
        return 0.0;
    const double r = stack->row.count == 2 ? r_mm : fmax(r_mm, stack->r_floor_mm);
    return dipole_row_value(&stack->row, r);
}

/* Rounding may leave a tiny negative number where the true value is next to nothing: it becomes 0. */
static double profile(const dipole_stack *stack, dipole_face face, double r_mm)
{
    if (!(r_mm >= 0.0))
        return NAN;
    if (stack->row.count > 0)
        return row_profile(stack, face, r_mm);
    if (isinf(r_mm))
        return 0.0;
    const double r = fmax(r_mm, stack->r_floor_mm);
    return fmax(0.0, dipole_hankel_profile(&stack->hankel[face], r));
}

void dipole_stack_profile_per_mm2(const dipole_stack *stack, dipole_face face, const double *r_mm,
                                  size_t count, double *values)
{
    if (stack->row.count == 2 && face == DIPOLE_FACE_LIT) {
        dipole_row_profile(&stack->row, r_mm, count, values);
        return;
    }
    for (size_t i = 0; i < count; i++)
        values[i] = profile(stack, face, r_mm[i]);
}

/* Of an inverse Hankel transform: the power within and beyond, the smaller one by its own integral. */
static void powers(const dipole_stack *stack, dipole_face face, double r_mm, double *within, double *beyond)
{
    const double total = stack->total[face];
    if (r_mm < stack->r_floor_mm) {
        *within = fmin(total, PI * r_mm * r_mm * profile(stack, face, r_mm));
        *beyond = total - *within;
        return;
    }
    *beyond = isinf(r_mm) ? 0.0 : fmax(0.0, dipole_hankel_beyond(&stack->hankel[face], r_mm));
    *within = total - *beyond;
    if (*beyond < 0.5 * total)
        return;
    *within = fmin(total, fmax(0.0, dipole_hankel_within(&stack->hankel[face], r_mm)));
    *beyond = total - *within;
}

double dipole_stack_beyond(const dipole_stack *stack, dipole_face face, double r_mm)
{
    if (!(r_mm >= 0.0))
        return NAN;
    if (stack->row.count > 0)
        return face == DIPOLE_FACE_LIT
                   ? fmin(stack->coefficients[0].alpha_prime * dipole_row_beyond(&stack->row, 1.0, r_mm),
                          stack->total[face])
                   : 0.0;
    double within, beyond;
    powers(stack, face, r_mm, &within, &beyond);
    return beyond;
}

double dipole_stack_within(const dipole_stack *stack, dipole_face face, double r_mm)
{
    if (!(r_mm >= 0.0))
        return NAN;
    if (stack->row.count > 0)
        return face == DIPOLE_FACE_LIT
                   ? fmin(stack->coefficients[0].alpha_prime * dipole_row_within(&stack->row, r_mm),
                          stack->total[face])
                   : 0.0;
    double within, beyond;
    powers(stack, face, r_mm, &within, &beyond);
    return within;
}

/* The mean over a wide ring from the power beyond its edges; over a narrow one, where that would cancel, by
 * Gauss's rule with five points in r^2, which is exact to 1e-12 of the profile for edges 10 % apart. */
double dipole_stack_ring_mean_per_mm2(const dipole_stack *stack, dipole_face face, double r_lo_mm,
                                      double r_hi_mm)
{
    static const double gauss[5][2] = { { 0.0, 0.28444444444444444444 },
                                        { -0.53846931010568309104, 0.23931433524968323402 },
                                        { 0.53846931010568309104, 0.23931433524968323402 },
                                        { -0.90617984593866399280, 0.11846344252809454376 },
                                        { 0.90617984593866399280, 0.11846344252809454376 } };
    if (!(r_lo_mm >= 0.0 && r_hi_mm >= r_lo_mm))
        return NAN;
    if (stack->row.count > 0)
        return face == DIPOLE_FACE_LIT ? stack->coefficients[0].alpha_prime / (2.0 * PI) *
                                             dipole_row_ring_mean(&stack->row, r_lo_mm, r_hi_mm)
                                       : 0.0;
    if (r_hi_mm == r_lo_mm)
        return profile(stack, face, r_lo_mm);
    if (r_hi_mm > 1.1 * r_lo_mm) {
        const double area_mm2 = PI * (r_hi_mm - r_lo_mm) * (r_hi_mm + r_lo_mm);
        const double within = dipole_stack_within(stack, face, r_hi_mm);
        if (2.0 * within < stack->total[face])
            return fmax(0.0, within - dipole_stack_within(stack, face, r_lo_mm)) / area_mm2;
        return fmax(0.0,
                    dipole_stack_beyond(stack, face, r_lo_mm) - dipole_stack_beyond(stack, face, r_hi_mm)) /
               area_mm2;
    }
    double sum = 0.0;
    for (int i = 0; i < 5; i++) {
        const double share = 0.5 + 0.5 * gauss[i][0];
        const double r2 = r_lo_mm * r_lo_mm + share * (r_hi_mm - r_lo_mm) * (r_hi_mm + r_lo_mm);
        sum += gauss[i][1] * profile(stack, face, sqrt(r2));
    }
    return sum;
}

/* ---- radii and spacings ----------------------------------------------------------------------------- */

struct question {
    const dipole_stack *stack;
    dipole_face face;
    double target;
    bool is_within;
};

/* log of a falling function of e^log_x over its target. What has underflown is as good as 1e-308. */
typedef double falling_log(const struct question *question, double log_x);

/*
 * The root, to rounding, by Chandrupatla's method: inverse quadratic interpolation where it is safe, else
 * bisection. The root is sought around log_start with ever longer strides.
 */
static double root_find(falling_log *f, const struct question *question, double log_start)
{
    double b = log_start, f_b = f(question, b), stride = f_b > 0.0 ? 0.7 : -0.7;
    double a = b + stride, f_a = f(question, a);
    while ((f_a > 0.0) == (f_b > 0.0)) {
        b = a, f_b = f_a;
        stride *= 2.0;
        a += stride, f_a = f(question, a);
    }
    double share = 0.5;
    for (;;) {
        const double x = a + share * (b - a), f_x = f(question, x);
        double c, f_c; /* what was a or b before */
        if ((f_x > 0.0) == (f_a > 0.0)) {
            c = a, f_c = f_a;
        } else {
            c = b, f_c = f_b;
            b = a, f_b = f_a;
        }
        a = x, f_a = f_x;
        const double best = fabs(f_a) < fabs(f_b) ? a : b;
        const double smallest = 2e-16 * fmax(1.0, fabs(best)) / fabs(b - a);
        if (f_a == 0.0 || !(smallest < 0.5))
            return best;
        const double xi = (a - b) / (c - b), phi = (f_a - f_b) / (f_c - f_b);
        share = phi * phi < xi && square(1.0 - phi) < 1.0 - xi
                    ? f_a / (f_b - f_a) * f_c / (f_b - f_c) +
                          (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
                    : 0.5;
        share = fmax(smallest, fmin(1.0 - smallest, share));
    }
}

static double reach_log(const struct question *question, double log_r)
{
    const double r_mm = exp(log_r);
    if (question->is_within)
        return -log(fmax(1e-308, dipole_stack_within(question->stack, question->face, r_mm)) /
                    question->target);
    return log(fmax(1e-308, dipole_stack_beyond(question->stack, question->face, r_mm)) / question->target);
}

static double spectrum_log(const struct question *question, double log_k)
{
    const double f = dipole_stack_spectrum(question->stack, question->face, exp(log_k));
    return log(fmax(1e-308, f) / question->target);
}

double dipole_stack_r_max_mm(const dipole_stack *stack, dipole_face face, double epsilon)
{
    if (!(epsilon >= DIPOLE_EPSILON_MIN && epsilon < 1.0))
        return NAN;
    const bool is_within = epsilon > 0.5;
    const double target = (is_within ? 1.0 - epsilon : epsilon) * stack->total[face];
    if (!(target > 1e-307))
        return 0.0;
    const struct question question = { stack, face, target, is_within };
    return exp(root_find(reach_log, &question, log(stack->coefficients[0].mean_free_path_mm)));
}

double dipole_stack_splat_spacing_mm(const dipole_stack *stack, dipole_face face, double epsilon)
{
    if (!(epsilon >= DIPOLE_EPSILON_MIN && epsilon < 4.0))
        return NAN;
    const double target = 0.25 * epsilon * stack->total[face];
    if (!(target > 1e-307))
        return INFINITY;
    const struct question question = { stack, face, target, false };
    return 2.0 * PI /
           exp(root_find(spectrum_log, &question, log(stack->coefficients[0].sigma_t_prime_per_mm)));
}

/* ---- derivatives ---------------------------------------------------------------------------------- */

static void gradient_set(dipole_stack_gradient *gradient, int parameter, double value)
{
    double *const fields[3] = { &gradient->d_log_sigma_a, &gradient->d_log_sigma_s_prime,
                                &gradient->d_log_thickness };
    *fields[parameter] = value;
}

dipole_stack_gradient dipole_stack_total_gradient(const dipole_stack *stack, dipole_face face, size_t layer)
{
    dipole_stack_gradient gradient = { 0.0, 0.0, 0.0 };
    for (int parameter = 0; parameter < 3; parameter++) {
        struct system system;
        struct dual f[2];
        system_init(stack, 3 * (int)place(stack, layer) + parameter, &system);
        stack->response(&system, 0.0, f);
        gradient_set(&gradient, parameter, creal(f[face].d));
    }
    return gradient;
}

/* Adds what the nodes of one contour give to the gradients at those radii that it serves. Each node is
 * solved once per parameter and its kernel evaluated once per radius. */
static void contour_gradient(const dipole_stack *stack, const struct system systems[3], dipole_face face,
                             const struct hankel_contour *contour, const double *r_mm, size_t count,
                             dipole_stack_gradient *gradients)
{
    const struct hankel *const hankel = &stack->hankel[face];
    for (size_t j = contour->first; j < contour->first + contour->count; j++) {
        const struct hankel_node *const node = &hankel->nodes[j];
        double complex terms[3];
        bool is_solved = false;
        for (size_t i = 0; i < count; i++) {
            if (!(r_mm[i] >= 0.0) || isinf(r_mm[i]))
                continue;
            const double r = fmin(fmax(r_mm[i], stack->r_floor_mm), hankel->r_far_mm);
            if (dipole_hankel_contour_for(hankel, r) != contour ||
                !dipole_hankel_is_needed(contour, node, r))
                continue;
            for (int parameter = 0; !is_solved && parameter < 3; parameter++) {
                struct dual f[2];
                stack->response(&systems[parameter], -node->kappa * node->kappa, f);
                terms[parameter] = contour->angle > 0.0 ? node->weight * f[face].d
                                                        : I * (creal(node->weight) * cimag(f[face].d));
            }
            is_solved = true;
            const double complex kernel = dipole_bessel_k0(node->kappa * r, node->log_kappa + log(r)) *
                                          dipole_hankel_far_factor(hankel, r_mm[i]);
            gradients[i].d_log_sigma_a += cimag(terms[0] * kernel);
            gradients[i].d_log_sigma_s_prime += cimag(terms[1] * kernel);
            gradients[i].d_log_thickness += cimag(terms[2] * kernel);
        }
    }
}

void dipole_stack_profile_gradient(const dipole_stack *stack, dipole_face face, size_t layer,
                                   const double *r_mm, size_t count, dipole_stack_gradient *gradients)
{
    for (size_t i = 0; i < count; i++) {
        gradients[i] = (dipole_stack_gradient){ 0.0, 0.0, 0.0 };
        if (!(r_mm[i] >= 0.0))
            gradients[i] = (dipole_stack_gradient){ NAN, NAN, NAN };
        else if (stack->row.count > 0 && face == DIPOLE_FACE_LIT) {
            const double r = stack->row.count == 2 ? r_mm[i] : fmax(r_mm[i], stack->r_floor_mm);
            double value;
            dipole_row_gradient(&stack->row, &r, 1, &value, &gradients[i].d_log_sigma_a,
                                &gradients[i].d_log_sigma_s_prime);
        }
    }
    if (stack->row.count > 0)
        return;
    struct system systems[3];
    for (int parameter = 0; parameter < 3; parameter++)
        system_init(stack, 3 * (int)place(stack, layer) + parameter, &systems[parameter]);
    const struct hankel *const hankel = &stack->hankel[face];
    for (size_t i = 0; i < hankel->contour_count; i++)
        contour_gradient(stack, systems, face, &hankel->contours[i], r_mm, count, gradients);
}
