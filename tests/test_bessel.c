#include "check.h"
#include "libdipole/internal.h"

/* K_n(z) e^z = int_0^inf e^(-z (cosh t - 1)) cosh nt dt by the trapezoidal rule, 64 bits. For large z the
 * integrand is a Gaussian of width z^(-1/2): a quarter of that leaves e^(-200). */
static long double complex oracle(int n, long double complex z)
{
    const long double step = fminl(1.0L / 32.0L, 0.25L / sqrtl(cabsl(z)));
    long double complex sum = 0.5L;
    for (int i = 1;; i++) {
        const long double half = sinhl(0.5L * step * i);
        const long double complex term = cexpl(-2.0L * z * half * half) * (n ? coshl(step * i) : 1.0L);
        sum += term;
        if (cabsl(term) < 1e-24L * cabsl(sum))
            return step * sum;
    }
}

static double relative(double complex found, long double complex expected)
{
    return (double)(cabsl(found - expected) / cabsl(expected));
}

/* Oracle: the integral, in the sector of the contours, from where the logarithm rules to where e^-z ends.
 */
static void bessel_functions_are_their_integrals(void **state)
{
    (void)state;
    double worst[3] = { 0.0, 0.0, 0.0 };
    struct rng rng = { .seed = 81 };
    for (int i = 0; i < 20000; i++) {
        const double size = i % 2 ? log_uniform(&rng, 1e-12, 700.0) : log_uniform(&rng, 0.5, 8.0);
        const double angle = i % 5 == 0 ? 0.0 : uniform(&rng, 0.0, 0.25 * PI);
        const double complex z = size * (cos(angle) + I * sin(angle));
        const long double complex fade = cexpl(-(long double complex)z);
        const long double complex k0 = fade * oracle(0, z), zk1 = z * fade * oracle(1, z);
        const double complex log_z = log(size) + I * angle;
        worst[0] = fmax(worst[0], relative(dipole_bessel_k0(z, log_z), k0) / (1.0 + size));
        worst[1] = fmax(worst[1], relative(dipole_bessel_zk1(z, log_z), zk1) / (1.0 + size));
        if (size > 0.05)
            worst[2] = fmax(worst[2], relative(dipole_bessel_zk1_complement(z, log_z), 1.0L - zk1));
    }
    print_message("  worst relative error: K_0 %.1e (1 + |z|), z K_1 %.1e (1 + |z|), 1 - z K_1 %.1e\n",
                  worst[0], worst[1], worst[2]);
    assert_true(worst[0] < 4e-15 && worst[1] < 4e-15 && worst[2] < 2e-14);
}

/* Oracle: the first terms of 1 - z K_1 = -(z^2/2) (log(z/2) + gamma - 1/2) - ..., where 1 would swallow it.
 */
static void small_arguments_keep_their_digits(void **state)
{
    (void)state;
    const double gamma = 0.57721566490153286061;
    struct rng rng = { .seed = 82 };
    for (int i = 0; i < 2000; i++) {
        const double size = log_uniform(&rng, 1e-140, 1e-7), angle = uniform(&rng, 0.0, 0.25 * PI);
        const double complex z = size * (cos(angle) + I * sin(angle)), log_z = log(size) + I * angle;
        const double complex expected = -0.5 * z * z * (log_z - log(2.0) + gamma - 0.5);
        assert_true(relative(dipole_bessel_zk1_complement(z, log_z), expected) < 1e-13);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bessel_functions_are_their_integrals),
        cmocka_unit_test(small_arguments_keep_their_digits),
    };
    return cmocka_run_group_tests_name("bessel", tests, NULL, NULL);
}
