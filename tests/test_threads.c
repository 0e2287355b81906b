/* dipole.h: safe to call from any number of threads, and any number may use one stack. The same program
 * under the thread sanitizer (preset tsan) reports unsynchronised writes that happened to do no harm. */
#include "check.h"

#include "libdipole/dipole.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { THREADS = 8, RECORD_LIMIT = 4096 };

/* What calls returned, in their order. */
struct record {
    double values[RECORD_LIMIT];
    size_t count;
};

static void add(struct record *record, const void *doubles, size_t size)
{
    /* not an assertion: cmocka's work in the main thread alone */
    if (size > sizeof record->values - record->count * sizeof(double))
        abort();
    memcpy(record->values + record->count, doubles, size);
    record->count += size / sizeof(double);
}

static void add_value(struct record *record, double value)
{
    add(record, &value, sizeof value);
}

static const dipole_layer half_space[1] = { { { 0.032, 0.74, 1.3, DIPOLE_FDR_EXACT }, INFINITY } };
static const dipole_layer skin[3] = { { { 0.3, 2.0, 1.4, DIPOLE_FDR_EXACT }, 0.6 },
                                      { { 0.05, 1.5, 1.35, DIPOLE_FDR_EXACT }, 1.2 },
                                      { { 0.01, 1.0, 1.4, DIPOLE_FDR_EXACT }, INFINITY } };
static const dipole_layer sheets[2] = { { { 0.1, 3.0, 1.3, DIPOLE_FDR_EXACT }, 1.0 },
                                        { { 0.0, 2.0, 1.5, DIPOLE_FDR_POLYNOMIAL }, 2.0 } };

static const struct {
    const dipole_layer *layers;
    size_t count;
    dipole_model model;
    dipole_side side;
} kinds[] = {
    { half_space, 1, DIPOLE_MODEL_DIPOLE, DIPOLE_FROM_ABOVE },
    { half_space, 1, DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_FROM_ABOVE },
    { half_space, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE },
    { skin, 3, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE },
    { sheets, 2, DIPOLE_MODEL_BEAM, DIPOLE_FROM_BELOW },
    { sheets, 2, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_ABOVE },
};

static void create_all(dipole_stack *stacks[COUNT(kinds)])
{
    for (size_t k = 0; k < COUNT(kinds); k++)
        if (!dipole_stack_create(kinds[k].layers, kinds[k].count, kinds[k].model, kinds[k].side, &stacks[k],
                                 NULL))
            abort();
}

static void destroy_all(dipole_stack *const *stacks)
{
    for (size_t k = 0; k < COUNT(kinds); k++)
        dipole_stack_destroy(stacks[k]);
}

/* 13 radii, so that vector loops have a rest, 0 and a far one among them. */
static const double radii_mm[] = { 0.0, 1e-3, 0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 1e4 };
enum { RADII = COUNT(radii_mm) };

static void record_fresnel(struct record *record)
{
    for (double eta = 0.6; eta < 2.0; eta += 0.1) {
        add_value(record, dipole_fresnel_reflectance(eta, 0.4));
        add_value(record, dipole_fresnel_reflectance_schlick(eta, 0.4));
        add_value(record, dipole_fdr_exact(eta));
        add_value(record, dipole_fdt_exact(eta));
        add_value(record, dipole_fdr_polynomial(eta));
        add_value(record, dipole_fdt_outside(eta));
    }
}

static void record_dipole(struct record *record, const dipole_coefficients *c)
{
    double values[RADII], d_sigma_a[RADII], d_sigma_s_prime[RADII];
    dipole_rd_profile_per_mm2(c, radii_mm, RADII, values);
    add(record, values, sizeof values);
    dipole_rd_profile_gradient(c, radii_mm, RADII, values, d_sigma_a, d_sigma_s_prime);
    add(record, values, sizeof values);
    add(record, d_sigma_a, sizeof d_sigma_a);
    add(record, d_sigma_s_prime, sizeof d_sigma_s_prime);
    for (size_t i = 0; i < RADII; i++) {
        const dipole_gradient gradient = dipole_rd_gradient(c, radii_mm[i]);
        const dipole_derivative derivative = dipole_rd_derivative(c, radii_mm[i]);
        add(record, &gradient, sizeof gradient);
        add(record, &derivative, sizeof derivative);
        add_value(record, dipole_rd_per_mm2(c, radii_mm[i]));
        add_value(record, dipole_reflectance_within(c, radii_mm[i]));
        add_value(record, dipole_tail_fraction(c, radii_mm[i]));
        add_value(record, dipole_rd_ring_mean_per_mm2(c, radii_mm[i], 1.5 * radii_mm[i]));
        add_value(record, dipole_spectrum(c, radii_mm[i]));
    }
    const dipole_gradient gradient = dipole_diffuse_reflectance_gradient(c);
    add(record, &gradient, sizeof gradient);
    add_value(record, dipole_diffuse_reflectance(c));
    add_value(record, dipole_r_max_mm(c, 0.01));
    add_value(record, dipole_splat_spacing_mm(c, 0.01));
}

static void record_between(struct record *record, const dipole_stack *stack)
{
    static const double in_mm[3] = { 0.0, 0.0, 0.0 }, normal[3] = { 0.0, 0.6, 0.8 },
                        out_mm[3] = { 1.0, 0.5, -0.2 }, cosines[3] = { -1.0, 0.1, 0.7 };
    dipole_sources sources;
    if (!dipole_sources_init(stack, 0.01, 0.1, 3.0, &sources, NULL))
        return;
    double values[3];
    add(record, sources.at, sources.count * sizeof sources.at[0]);
    add_value(record, sources.max_relative_error);
    add_value(record, dipole_sources_between_per_mm2(&sources, in_mm, normal, out_mm));
    dipole_sources_profile_per_mm2(&sources, 1.0, cosines, 3, values);
    add(record, values, sizeof values);
    add_value(record, dipole_sources_within(&sources, -0.2, 1.0));
}

static void record_inversions(struct record *record)
{
    for (int is_beam = 0; is_beam < 2; is_beam++) {
        const dipole_model model = is_beam ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE;
        dipole_medium media[2] = { { .eta = 0.0 }, { .eta = 0.0 } };
        const bool done =
            dipole_medium_from_mean_free_path(0.8, 1.0, 1.3, DIPOLE_FDR_EXACT, model, &media[0], NULL) &&
            dipole_medium_from_diffuse_mean_free_path(0.3, 2.0, 1.4, DIPOLE_FDR_POLYNOMIAL, model,
                                                      &media[1], NULL);
        add_value(record, done);
        for (int i = 0; i < 2; i++) {
            add_value(record, media[i].sigma_a_per_mm);
            add_value(record, media[i].sigma_s_prime_per_mm);
        }
    }
}

static void record_face(struct record *record, const dipole_stack *stack, dipole_face face)
{
    double values[RADII];
    dipole_stack_profile_per_mm2(stack, face, radii_mm, RADII, values);
    add(record, values, sizeof values);
    for (size_t i = 0; i < RADII; i++) {
        add_value(record, dipole_stack_ring_mean_per_mm2(stack, face, radii_mm[i], 1.05 * radii_mm[i]));
        add_value(record, dipole_stack_within(stack, face, radii_mm[i]));
        add_value(record, dipole_stack_beyond(stack, face, radii_mm[i]));
        add_value(record, dipole_stack_spectrum(stack, face, radii_mm[i]));
    }
    add_value(record, dipole_stack_total(stack, face));
    add_value(record, dipole_stack_unscattered(stack, face));
    add_value(record, dipole_stack_r_max_mm(stack, face, 0.01));
    add_value(record, dipole_stack_splat_spacing_mm(stack, face, 0.01));
    for (size_t layer = 0; layer < dipole_stack_layer_count(stack); layer++) {
        dipole_stack_gradient gradients[RADII];
        dipole_stack_profile_gradient(stack, face, layer, radii_mm, RADII, gradients);
        add(record, gradients, sizeof gradients);
        gradients[0] = dipole_stack_total_gradient(stack, face, layer);
        add(record, &gradients[0], sizeof gradients[0]);
    }
}

static void record_stack(struct record *record, const dipole_stack *stack)
{
    for (size_t i = 0; i < dipole_stack_layer_count(stack); i++) {
        add_value(record, dipole_stack_layer(stack, i)->thickness_mm);
        add(record, dipole_stack_coefficients(stack, i), sizeof(dipole_coefficients));
    }
    record_face(record, stack, DIPOLE_FACE_LIT);
    record_face(record, stack, DIPOLE_FACE_FAR);
    record_between(record, stack);
}

/* Everything that dipole.h offers, on what all threads share. */
static void record_all(struct record *record, dipole_stack *const *stacks)
{
    record->count = 0;
    record_fresnel(record);
    record_dipole(record, dipole_stack_coefficients(stacks[0], 0));
    record_inversions(record);
    for (size_t k = 0; k < COUNT(kinds); k++)
        record_stack(record, stacks[k]);
}

struct task {
    pthread_barrier_t *start;
    dipole_stack *const *stacks; /* shared; NULL to create one's own */
    struct record record;
};

static void *work(void *context)
{
    struct task *const task = context;
    dipole_stack *own[COUNT(kinds)];
    pthread_barrier_wait(task->start);
    if (task->stacks != NULL) {
        record_all(&task->record, task->stacks);
    } else {
        create_all(own);
        record_all(&task->record, own);
        destroy_all(own);
    }
    return NULL;
}

/* Oracle: one thread on its own, bit for bit. */
static void assert_threads_agree(dipole_stack *const *shared)
{
    static struct task tasks[THREADS];
    static struct record alone;
    pthread_t threads[THREADS];
    pthread_barrier_t start;
    assert_int_equal(pthread_barrier_init(&start, NULL, THREADS), 0);
    for (int t = 0; t < THREADS; t++) {
        tasks[t] = (struct task){ .start = &start, .stacks = shared };
        assert_int_equal(pthread_create(&threads[t], NULL, work, &tasks[t]), 0);
    }
    for (int t = 0; t < THREADS; t++)
        assert_int_equal(pthread_join(threads[t], NULL), 0);
    pthread_barrier_destroy(&start);
    dipole_stack *stacks[COUNT(kinds)];
    create_all(stacks);
    record_all(&alone, stacks);
    destroy_all(stacks);
    for (int t = 0; t < THREADS; t++) {
        assert_int_equal(tasks[t].record.count, alone.count);
        assert_memory_equal(tasks[t].record.values, alone.values, alone.count * sizeof(double));
    }
}

/* Runs first: whatever the library would set up at its first call is set up by all threads at once. */
static void threads_create_stacks_of_their_own(void **state)
{
    (void)state;
    assert_threads_agree(NULL);
}

static void threads_share_stacks(void **state)
{
    (void)state;
    dipole_stack *stacks[COUNT(kinds)];
    create_all(stacks);
    assert_threads_agree(stacks);
    destroy_all(stacks);
}

/* Oracle: what each wrote. A failure belongs to the caller: threads that fail at once do not mix messages.
 */
static void *fail_often(void *context)
{
    dipole_status *const status = context;
    const dipole_medium medium = { 1.0, 1.0, 11.0 + status->line, DIPOLE_FDR_EXACT };
    dipole_coefficients c;
    for (int i = 0; i < 1000; i++)
        if (dipole_coefficients_init(&medium, &c, status))
            abort();
    return NULL;
}

static void failures_belong_to_their_caller(void **state)
{
    (void)state;
    pthread_t threads[THREADS];
    dipole_status statuses[THREADS];
    for (int t = 0; t < THREADS; t++) {
        statuses[t].line = t;
        assert_int_equal(pthread_create(&threads[t], NULL, fail_often, &statuses[t]), 0);
    }
    for (int t = 0; t < THREADS; t++) {
        char expected[64];
        snprintf(expected, sizeof expected, "eta is %d, expected > 0 (0.1 to 10)", 11 + t);
        assert_int_equal(pthread_join(threads[t], NULL), 0);
        assert_string_equal(statuses[t].message, expected);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_create_stacks_of_their_own),
        cmocka_unit_test(threads_share_stacks),
        cmocka_unit_test(failures_belong_to_their_caller),
    };
    return cmocka_run_group_tests_name("threads", tests, NULL, NULL);
}
