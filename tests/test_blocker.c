/* renderer/blocker.c: what one blocker keeps, and where. */
#include "check.h"
#include "renderer/blocker.h"

#include <mpfr.h>

enum { BITS = 2400 }; /* 1 - alpha/2 of the smallest double */

/* z0 + (zE - z0) ln(1 - alpha/2)/ln(1 - alpha) of T60, as it is printed but for the sign. */
static double half_by_mpfr(double z0_mm, double ze_mm, double alpha)
{
    mpfr_t a, upper, lower, z;
    mpfr_inits2(BITS, a, upper, lower, z, (mpfr_ptr)0);
    mpfr_set_d(a, alpha, MPFR_RNDN);
    mpfr_ui_sub(lower, 1, a, MPFR_RNDN);
    mpfr_log(lower, lower, MPFR_RNDN);
    mpfr_div_ui(a, a, 2, MPFR_RNDN);
    mpfr_ui_sub(upper, 1, a, MPFR_RNDN);
    mpfr_log(upper, upper, MPFR_RNDN);
    mpfr_div(upper, upper, lower, MPFR_RNDN);
    mpfr_set_d(z, ze_mm, MPFR_RNDN);
    mpfr_sub_d(z, z, z0_mm, MPFR_RNDN);
    mpfr_mul(z, z, upper, MPFR_RNDN);
    mpfr_add_d(z, z, z0_mm, MPFR_RNDN);
    const double found = mpfr_get_d(z, MPFR_RNDN);
    mpfr_clears(a, upper, lower, z, (mpfr_ptr)0);
    return found;
}

/* Oracle: MPFR, for alpha from the smallest double to one step below 1. */
static void half_depth_keeps_its_digits(void **state)
{
    (void)state;
    struct rng rng = { .seed = 59 };
    for (int i = 0; i < 300; i++) {
        const double z0_mm = uniform(&rng, 0, 100), ze_mm = z0_mm + log_uniform(&rng, 1e-6, 1e3);
        const double near_1 = 1 - log_uniform(&rng, 0x1p-53, 0.5);
        const double alpha = i % 2 ? near_1 : log_uniform(&rng, 5e-324, 1);
        /* a rounding of each of the four steps */
        assert_close(render_blocker_half_mm(z0_mm, ze_mm, alpha), half_by_mpfr(z0_mm, ze_mm, alpha), 1e-15,
                     "z0 %g, zE %g, alpha %.17g", z0_mm, ze_mm, alpha);
    }
}

/* Oracle: limits of T60. E6: with the printed sign the depth lies in front of the blocker. */
static void half_depth_has_its_limits(void **state)
{
    (void)state;
    assert_true(render_blocker_half_mm(2, 6, 0) == 4);
    assert_true(render_blocker_half_mm(2, 6, 1) == 2);
    assert_close(render_blocker_half_mm(2, 6, 5e-324), 4, 1e-15, "alpha of one step");
    assert_close(render_blocker_half_mm(2, 6, 0.75), 2 + 4 * log(1 - 0.375) / log(0.25), 1e-15,
                 "alpha 3/4");
    for (double alpha = 0; alpha <= 1; alpha += 0.125)
        assert_true(render_blocker_half_mm(3, 3, alpha) == 3);
    double before_mm = 6;
    for (double alpha = 0; alpha < 1; alpha += 1e-3) {
        const double half_mm = render_blocker_half_mm(2, 6, alpha);
        assert_true(half_mm >= 2 && half_mm <= 4 && half_mm < before_mm);
        before_mm = half_mm;
    }
}

/* Oracle: by definition half of alpha stays before the half depth, and none of it before 0, all before 1.
 */
static void half_stays_before_half_depth(void **state)
{
    (void)state;
    struct rng rng = { .seed = 60 };
    for (int i = 0; i < 300; i++) {
        const double alpha = i % 2 ? uniform(&rng, 0, 1) : log_uniform(&rng, 1e-20, 1);
        assert_close(render_blocker_part(alpha, render_blocker_half_mm(0, 1, alpha)), 0.5, 1e-13,
                     "alpha %g", alpha);
        assert_true(render_blocker_part(alpha, 0) == 0 && render_blocker_part(alpha, 1) == 1);
        const double u = uniform(&rng, 0, 1), v = uniform(&rng, 0, 1);
        assert_true((render_blocker_part(alpha, u) < render_blocker_part(alpha, v)) == (u < v));
    }
    assert_true(render_blocker_part(0, 0.25) == 0.25 && render_blocker_part(1, 0.25) == 1);
    assert_true(render_blocker_part(1, 0) == 0 && render_blocker_part(0, -1) == 0 &&
                render_blocker_part(0, 2) == 1);
}

/* Oracle: two ways one after the other keep what one of both lengths does; numerical mean of what is left.
 */
static void extinction_adds_up(void **state)
{
    (void)state;
    struct rng rng = { .seed = 61 };
    for (int i = 0; i < 300; i++) {
        const double extinction = log_uniform(&rng, 1e-8, 30), a_mm = log_uniform(&rng, 1e-6, 1),
                     b_mm = log_uniform(&rng, 1e-6, 1);
        const double first = render_blocker_alpha(extinction, a_mm),
                     then = render_blocker_alpha(extinction, b_mm);
        assert_close(render_blocker_alpha(extinction, a_mm + b_mm), first + then - first * then, 1e-14,
                     "extinction %g", extinction);
    }
    assert_true(render_blocker_alpha(0, INFINITY) == 0 && render_blocker_alpha(INFINITY, 0) == 0);
    assert_true(render_blocker_alpha(1, INFINITY) == 1 && render_blocker_alpha(INFINITY, 1) == 1);
    static const double alphas[] = { 1e-9, 0.1, 0.5, 0.99 };
    enum { STEPS = 20000 };
    for (int i = 0; i < 4; i++) {
        double mean = 0;
        for (int k = 0; k < STEPS; k++)
            mean += (1 - alphas[i] * render_blocker_part(alphas[i], (k + 0.5) / STEPS)) / STEPS;
        assert_close(render_blocker_mean_left(alphas[i]), mean, 1e-8, "alpha %g: midpoint rule", alphas[i]);
    }
    assert_true(render_blocker_mean_left(0) == 1 && render_blocker_mean_left(1) == 0);
}

/* Oracle: rays from both ends of the light over the blocker's edge, met with the receiver's plane. */
static void penumbra_is_what_rays_enclose(void **state)
{
    (void)state;
    struct rng rng = { .seed = 62 };
    for (int i = 0; i < 100; i++) {
        const double blocker_mm = log_uniform(&rng, 0.1, 100),
                     receiver_mm = blocker_mm * uniform(&rng, 1.01, 10);
        const double size_mm = log_uniform(&rng, 1e-3, 1e3), edge_mm = uniform(&rng, -5, 5);
        double ends_mm[2];
        for (int k = 0; k < 2; k++) {
            const double from_mm = (k - 0.5) * size_mm;
            ends_mm[k] = from_mm + (edge_mm - from_mm) * receiver_mm / blocker_mm;
        }
        assert_close(render_penumbra_mm(receiver_mm, blocker_mm, size_mm), fabs(ends_mm[0] - ends_mm[1]),
                     1e-11, "receiver %g, blocker %g, size %g", receiver_mm, blocker_mm, size_mm);
        /* parallel light: of a light so far away that nothing changes any more */
        const double angle = log_uniform(&rng, 1e-4, 1), far_mm = 1e9;
        assert_close(
            render_penumbra_of_parallel_mm(receiver_mm, blocker_mm, angle),
            render_penumbra_mm(far_mm + receiver_mm, far_mm + blocker_mm, 2 * far_mm * tan(angle / 2)),
            1e-5, "angle %g: the far light's distance is rounded", angle);
    }
    assert_true(render_penumbra_mm(1, 1, 5) == 0 && render_penumbra_mm(1, 2, 5) == 0);
    assert_true(render_penumbra_mm(2, 1, 0) == 0 && render_penumbra_of_parallel_mm(1, 2, 0.1) == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_depth_keeps_its_digits),   cmocka_unit_test(half_depth_has_its_limits),
        cmocka_unit_test(half_stays_before_half_depth),  cmocka_unit_test(extinction_adds_up),
        cmocka_unit_test(penumbra_is_what_rays_enclose),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
