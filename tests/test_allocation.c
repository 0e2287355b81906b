/*
 * Every allocation of libdipole in turn fails. The linker sends the library's calls here (--wrap), which
 * count what is held and refuse the one that a test has chosen.
 */
#include "check.h"

#include "libdipole/dipole.h"

#include <stdbool.h>
#include <stdlib.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static int call_count;   /* allocations asked for */
static int refused_call; /* which of them fails, from 1; 0 for none */
static int held_count;   /* allocations not yet freed */

/* NOLINTBEGIN(bugprone-reserved-identifier): the names are the linker's. */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void __real_free(void *old);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);
void __wrap_free(void *old);

static void *count_held(void *got)
{
    held_count += got != NULL;
    return got;
}

void *__wrap_malloc(size_t size)
{
    return ++call_count == refused_call ? NULL : count_held(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return ++call_count == refused_call ? NULL : count_held(__real_calloc(count, size));
}

void *__wrap_realloc(void *old, size_t size)
{
    if (++call_count == refused_call)
        return NULL;
    return old != NULL ? __real_realloc(old, size) : count_held(__real_realloc(old, size));
}

void __wrap_free(void *old)
{
    held_count -= old != NULL;
    __real_free(old);
}
/* NOLINTEND(bugprone-reserved-identifier) */

static const dipole_layer half_space[1] = { { { 0.032, 0.74, 1.3, DIPOLE_FDR_EXACT }, INFINITY } };
static const dipole_layer slab[1] = { { { 0.032, 0.74, 1.3, DIPOLE_FDR_EXACT }, 5.0 } };
static const dipole_layer skin[3] = { { { 0.3, 2.0, 1.4, DIPOLE_FDR_EXACT }, 0.6 },
                                      { { 0.05, 1.5, 1.35, DIPOLE_FDR_EXACT }, 1.2 },
                                      { { 0.01, 1.0, 1.4, DIPOLE_FDR_EXACT }, INFINITY } };
static const dipole_layer sheets[2] = { { { 0.1, 3.0, 1.3, DIPOLE_FDR_EXACT }, 1.0 },
                                        { { 0.0, 2.0, 1.5, DIPOLE_FDR_EXACT }, 2.0 } };

static const struct kind {
    const dipole_layer *layers;
    size_t count;
    dipole_model model;
    dipole_side side;
    bool has_nodes; /* and so more allocations than one */
} kinds[] = {
    { half_space, 1, DIPOLE_MODEL_DIPOLE, DIPOLE_FROM_ABOVE, false },
    { half_space, 1, DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_FROM_ABOVE, true },
    { half_space, 1, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_ABOVE, false },
    { half_space, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, false },
    { slab, 1, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_ABOVE, true },
    { slab, 1, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_BELOW, true },
    { skin, 3, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, true },
    { sheets, 2, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, true },
    { sheets, 2, DIPOLE_MODEL_BEAM, DIPOLE_FROM_BELOW, true },
    { sheets, 2, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_ABOVE, true },
    { sheets, 2, DIPOLE_MODEL_MULTIPOLE, DIPOLE_FROM_BELOW, true },
};

static bool create(const struct kind *kind, int refused, dipole_stack **stack, dipole_status *status)
{
    call_count = 0;
    refused_call = refused;
    const bool done =
        dipole_stack_create(kind->layers, kind->count, kind->model, kind->side, stack, status);
    refused_call = 0;
    return done;
}

static double profile(const dipole_stack *stack)
{
    const double r_mm = 1.0;
    double value;
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r_mm, 1, &value);
    return value;
}

/* Oracle: what dipole.h promises, *stack_out is NULL; and the counts: nothing stays held. A stack that is
 * made afterwards is the one from before. */
static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (size_t k = 0; k < COUNT(kinds); k++) {
        dipole_stack *stack, *again;
        assert_true(create(&kinds[k], 0, &stack, NULL));
        const int calls = call_count, held = held_count;
        assert_true(kinds[k].has_nodes ? calls > 1 : calls == 1);
        for (int refused = 1; refused <= calls; refused++) {
            dipole_status status = { .code = DIPOLE_OK };
            dipole_stack *none = stack;
            if (create(&kinds[k], refused, &none, &status) || none != NULL)
                fail_msg("kind %zu: made without allocation %d of %d", k, refused, calls);
            assert_int_equal(call_count, refused);
            assert_int_equal(status.code, DIPOLE_OUT_OF_MEMORY);
            char message[64];
            snprintf(message, sizeof message, "no memory for %zu layers", kinds[k].count);
            assert_string_equal(status.message, message);
            assert_int_equal(held_count, held);
            assert_false(create(&kinds[k], refused, &none, NULL));
            assert_int_equal(held_count, held);
        }
        assert_true(create(&kinds[k], 0, &again, NULL));
        assert_int_equal(call_count, calls);
        assert_true(profile(again) == profile(stack));
        dipole_stack_destroy(again);
        dipole_stack_destroy(stack);
        assert_int_equal(held_count, 0);
    }
}

/* Oracle: dipole.h, nothing but the creation of a stack allocates. */
static void nothing_else_allocates(void **state)
{
    (void)state;
    static const double r_mm[3] = { 0.0, 1.0, 100.0 }, origin_mm[3], normal[3] = { 0.0, 0.0, 1.0 };
    for (size_t k = 0; k < COUNT(kinds); k++) {
        dipole_stack *stack;
        assert_true(create(&kinds[k], 0, &stack, NULL));
        call_count = 0;
        for (int f = 0; f < 2; f++) {
            const dipole_face face = f ? DIPOLE_FACE_FAR : DIPOLE_FACE_LIT;
            double values[3];
            dipole_stack_gradient gradients[3];
            dipole_stack_profile_per_mm2(stack, face, r_mm, 3, values);
            dipole_stack_profile_gradient(stack, face, 0, r_mm, 3, gradients);
            gradients[0] = dipole_stack_total_gradient(stack, face, 0);
            (void)dipole_stack_ring_mean_per_mm2(stack, face, 1.0, 3.0);
            (void)dipole_stack_r_max_mm(stack, face, 0.01);
            (void)dipole_stack_splat_spacing_mm(stack, face, 0.01);
        }
        dipole_sources sources;
        assert_true(dipole_sources_init(stack, 0.01, 0.1, 2.0, &sources, NULL));
        assert_true(dipole_sources_between_per_mm2(&sources, origin_mm, normal, origin_mm) > 0.0);
        assert_true(dipole_sources_within(&sources, -0.1, 1.0) > 0.0);
        assert_int_equal(call_count, 0);
        dipole_stack_destroy(stack);
    }
    dipole_coefficients c;
    dipole_medium medium;
    assert_true(dipole_coefficients_init(&half_space[0].medium, &c, NULL));
    assert_true(dipole_medium_from_mean_free_path(0.7, 1.0, 1.3, DIPOLE_FDR_EXACT, DIPOLE_MODEL_BEAM,
                                                  &medium, NULL));
    assert_true(dipole_r_max_mm(&c, 0.01) > 0.0 && dipole_splat_spacing_mm(&c, 0.01) > 0.0);
    assert_int_equal(call_count, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(nothing_else_allocates),
    };
    return cmocka_run_group_tests_name("allocation", tests, NULL, NULL);
}
