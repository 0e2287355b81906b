/*
 * The stability suite: hard inputs by the million, checked for what physics and dipole.h promise, and by
 * the hundred thousand against high precision. Prints the tables of docs/stability.md; fails where a bound
 * does not hold. Here half-spaces, in stability_layers.c stacks.
 *
 *   stability [SCALE]    SCALE times as many inputs, default 1
 */
#include "stability.h"

#include "oracle.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static int failure_count;

void failed(const char *format, ...)
{
    if (failure_count++ >= 20)
        return;
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
}

static void fail_input(const char *what, const dipole_coefficients *c, double r_mm, double found)
{
    failed("%s: sigma_a %.17g, sigma_s' %.17g, eta %.17g, r %.17g: found %.17g", what, c->sigma_a_per_mm,
           c->sigma_s_prime_per_mm, c->eta, r_mm, found);
}

/* ---- inputs --------------------------------------------------------------------------------------- */

/* sigma from 1e-12 to 1e6 per mm, or 0; alpha' toward 0 and 1; eta from 0.5 to 3, 1, and 1 +- 1e-12. */
static dipole_coefficients random_medium(struct rng *rng)
{
    dipole_medium medium = { .sigma_a_per_mm = log_uniform(rng, 1e-12, 1e6),
                             .sigma_s_prime_per_mm = log_uniform(rng, 1e-12, 1e6),
                             .eta = log_uniform(rng, 0.5, 3.0) };
    switch (random_bits(rng) % 16) {
    case 0:
        medium.sigma_a_per_mm = 0.0;
        break;
    case 1:
        medium.sigma_s_prime_per_mm = 0.0;
        break;
    case 2:
        medium.sigma_a_per_mm = medium.sigma_s_prime_per_mm * log_uniform(rng, 1e-17, 1e-3);
        break;
    case 3:
        medium.sigma_s_prime_per_mm = medium.sigma_a_per_mm * log_uniform(rng, 1e-17, 1e-3);
        break;
    default:
        break;
    }
    switch (random_bits(rng) % 16) {
    case 0:
        medium.eta = 1.0;
        break;
    case 1:
        medium.eta = 1.0 + (random_bits(rng) % 2 ? 1e-12 : -1e-12);
        break;
    case 2:
        medium.eta = random_bits(rng) % 2 ? 0.5 : 3.0;
        break;
    default:
        break;
    }
    dipole_coefficients c;
    dipole_status status;
    if (!dipole_coefficients_init(&medium, &c, &status))
        failed("refused: %s", status.message);
    return c;
}

/* 0, anywhere from 1e-9 to 1e9 mm, or around the medium's own lengths up to where all light has faded. */
static double random_distance(struct rng *rng, const dipole_coefficients *c)
{
    switch (random_bits(rng) % 8) {
    case 0:
        return 0.0;
    case 1:
    case 2:
        return log_uniform(rng, 1e-9, 1e9);
    case 3:
        return c->sigma_tr_per_mm > 0.0 ? uniform(rng, 0.0, 800.0) / c->sigma_tr_per_mm : c->z_v_mm;
    default:
        return c->z_r_mm * log_uniform(rng, 1e-5, 1e5);
    }
}

/* ---- what must hold for every input --------------------------------------------------------------- */

bool is_sound(double value)
{
    return isfinite(value) && value >= 0.0;
}

/* Never NaN, infinite or negative; falling with distance; parts add up to the whole; energy at most 1. The
 * slack is a few roundings. */
static void sweep_dipole(int count)
{
    struct rng rng = { .seed = 101 };
    const double slack = 1.0 + 4e-15;
    for (int i = 0; i < count; i++) {
        const dipole_coefficients c = random_medium(&rng);
        const double r = random_distance(&rng, &c), beyond_r = r * (1.0 + log_uniform(&rng, 1e-15, 1e3));
        const double total = dipole_diffuse_reflectance(&c);
        const double rd = dipole_rd_per_mm2(&c, r), rd_beyond = dipole_rd_per_mm2(&c, beyond_r);
        const double within = dipole_reflectance_within(&c, r), tail = dipole_tail_fraction(&c, r);
        const double ring = dipole_rd_ring_mean_per_mm2(&c, r, beyond_r);
        const double spectrum = dipole_spectrum(&c, 1.0 / fmax(r, 1e-9));
        const double epsilon = log_uniform(&rng, 1e-9, 0.999);
        const dipole_derivative d = dipole_rd_derivative(&c, r);
        double batch, d_log_a, d_log_s;
        dipole_rd_profile_gradient(&c, &r, 1, &batch, &d_log_a, &d_log_s);
        if (!is_sound(rd) || !(rd_beyond <= rd * slack) || !is_sound(batch))
            fail_input("profile", &c, r, rd);
        if (!is_sound(total) || total > 1.0)
            fail_input("total", &c, r, total);
        if (!is_sound(within) || within > total || dipole_reflectance_within(&c, beyond_r) < within / slack)
            fail_input("within", &c, r, within);
        if (!is_sound(tail) || tail > 1.0 || dipole_tail_fraction(&c, beyond_r) > tail * slack)
            fail_input("tail", &c, r, tail);
        if (fabs(within + tail * total - total) > 4e-15 * total)
            fail_input("within + beyond", &c, r, within);
        if (!is_sound(ring) || ring > rd * slack || ring < rd_beyond / slack)
            fail_input("ring mean", &c, r, ring);
        if (!is_sound(spectrum) || spectrum > total * slack)
            fail_input("spectrum", &c, r, spectrum);
        if (!isfinite(d.d_sigma_a) || !isfinite(d.d_sigma_s_prime) || !isfinite(d_log_a) ||
            !isfinite(d_log_s))
            fail_input("derivative", &c, r, d.d_sigma_a);
        if (i % 16 == 0) {
            const double r_max = dipole_r_max_mm(&c, epsilon);
            if (!is_sound(r_max) || fabs(dipole_tail_fraction(&c, r_max) - epsilon) > 1e-11 * epsilon)
                fail_input("r_max", &c, epsilon, r_max);
            const double spacing = dipole_splat_spacing_mm(&c, epsilon);
            if (!(isfinite(spacing) && spacing > 0.0))
                fail_input("splat spacing", &c, epsilon, spacing);
        }
    }
    printf(
        "| dipole | %d | never NaN, infinite or negative; falling; within + beyond = total; energy ≤ 1 |\n",
        count);
}

static void sweep_beam(int count)
{
    struct rng rng = { .seed = 102 };
    const double slack = 1.0 + 1e-14;
    for (int i = 0; i < count; i++) {
        const dipole_coefficients c = random_medium(&rng);
        const dipole_layer base = { { c.sigma_a_per_mm, c.sigma_s_prime_per_mm, c.eta, DIPOLE_FDR_EXACT },
                                    (double)INFINITY };
        dipole_stack *stack;
        if (!dipole_stack_create(&base, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL)) {
            fail_input("refused", &c, 0.0, 0.0);
            continue;
        }
        const double total = dipole_stack_total(stack, DIPOLE_FACE_LIT);
        if (!is_sound(total) || total > 1.0)
            fail_input("beam, total", &c, 0.0, total);
        for (int k = 0; k < 10; k++) {
            const double r = random_distance(&rng, &c),
                         beyond_r = r * (1.0 + log_uniform(&rng, 1e-15, 1e3));
            const double radii[2] = { r, beyond_r };
            double rd[2];
            dipole_stack_gradient gradient;
            dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, radii, 2, rd);
            dipole_stack_profile_gradient(stack, DIPOLE_FACE_LIT, 0, radii, 1, &gradient);
            const double within = dipole_stack_within(stack, DIPOLE_FACE_LIT, r);
            const double beyond = dipole_stack_beyond(stack, DIPOLE_FACE_LIT, r);
            const double ring = dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT, r, beyond_r);
            if (!is_sound(rd[0]) || rd[1] > rd[0] * slack)
                fail_input("beam, profile", &c, r, rd[0]);
            if (!is_sound(within) || !is_sound(beyond) || fabs(within + beyond - total) > 1e-14 * total)
                fail_input("beam, within", &c, r, within);
            if (!is_sound(ring))
                fail_input("beam, ring mean", &c, r, ring);
            if (!isfinite(gradient.d_log_sigma_a) || !isfinite(gradient.d_log_sigma_s_prime))
                fail_input("beam, derivative", &c, r, gradient.d_log_sigma_a);
        }
        dipole_stack_destroy(stack);
    }
    printf("| beam, half-space | %d | the same |\n", 10 * count);
}

/* ---- units in the last place, against MPFR -------------------------------------------------------- */

void errors_init(struct errors *errors, size_t limit)
{
    errors->values = calloc(limit, sizeof *errors->values);
    errors->limit = limit;
}

bool errors_add(struct errors *errors, double error)
{
    if (errors->count < errors->limit)
        errors->values[errors->count++] = error;
    return error <= errors->bound;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void errors_print(struct errors *errors, const char *unit)
{
    qsort(errors->values, errors->count, sizeof *errors->values, compare);
    printf("| %s | %zu | %.2g | %.2g | %.2g | %.2g | %s |\n", errors->name, errors->count,
           errors->values[errors->count / 2], errors->values[(size_t)(0.99 * (double)errors->count)],
           errors->values[errors->count - 1], errors->bound, unit);
    free(errors->values);
}

static void errors_note(struct errors *errors, double error, const dipole_coefficients *c, double r_mm,
                        double found)
{
    if (errors_add(errors, error))
        return;
    char what[128];
    snprintf(what, sizeof what, "%s is %.3g off", errors->name, error);
    fail_input(what, c, r_mm, found);
}

enum { PROFILE, WITHIN, TAIL, TOTAL, RING, SPECTRUM, BY_SIGMA_A, BY_SIGMA_S, REACH, KIND_COUNT };

/* |tail(r_max)/epsilon - 1| over the slope of log tail in log r: the relative error of r_max. */
static double reach_error(struct oracle *o, double epsilon, double r_mm)
{
    oracle_tail(o, r_mm);
    mpfr_t miss;
    mpfr_init2(miss, ORACLE_BITS);
    mpfr_sub_d(miss, o->sum, epsilon, MPFR_RNDN);
    oracle_rd(o, r_mm); /* slope = 2 pi r^2 R_d/total, both without alpha' */
    mpfr_div(o->sum, o->sum, o->alpha_prime, MPFR_RNDN);
    mpfr_div(miss, miss, o->sum, MPFR_RNDN);
    oracle_beyond(o, 0.0);
    mpfr_mul(miss, miss, o->sum, MPFR_RNDN);
    const double error = fabs(mpfr_get_d(miss, MPFR_RNDN)) / (4.0 * PI * r_mm * r_mm);
    mpfr_clear(miss);
    return error;
}

static void compare_dipole(int count)
{
    struct rng rng = { .seed = 103 };
    struct errors all[KIND_COUNT] = {
        [PROFILE] = { .name = "profile", .bound = 8.0 },
        [WITHIN] = { .name = "within", .bound = 8.0 },
        [TAIL] = { .name = "tail", .bound = 8.0 },
        [TOTAL] = { .name = "total", .bound = 8.0 },
        [RING] = { .name = "ring mean", .bound = 8.0 },
        [SPECTRUM] = { .name = "spectrum", .bound = 8.0 },
        [BY_SIGMA_A] = { .name = "dRd/dσa", .bound = 64.0 },
        [BY_SIGMA_S] = { .name = "dRd/dσ's", .bound = 64.0 },
        [REACH] = { .name = "r_max, relative", .bound = 1e-12 },
    };
    for (int k = 0; k < KIND_COUNT; k++)
        errors_init(&all[k], (size_t)count);
    for (int i = 0; i < count; i++) {
        const dipole_coefficients c = random_medium(&rng);
        const double r = random_distance(&rng, &c), r_hi = r * (1.0 + log_uniform(&rng, 1e-12, 1e2));
        const double k = 1.0 / fmax(r, 1e-9), epsilon = log_uniform(&rng, 1e-12, 0.999);
        const dipole_derivative d = dipole_rd_derivative(&c, r);
        struct oracle o;
        oracle_init(&o, &c);
        double found = dipole_rd_per_mm2(&c, r);
        oracle_rd(&o, r);
        errors_note(&all[PROFILE], oracle_ulp(&o, found), &c, r, found);
        found = dipole_reflectance_within(&c, r);
        oracle_between(&o, 0.0, r);
        errors_note(&all[WITHIN], oracle_ulp(&o, found), &c, r, found);
        found = dipole_tail_fraction(&c, r);
        oracle_tail(&o, r);
        errors_note(&all[TAIL], oracle_ulp(&o, found), &c, r, found);
        found = dipole_diffuse_reflectance(&c);
        oracle_between(&o, 0.0, -1.0);
        errors_note(&all[TOTAL], oracle_ulp(&o, found), &c, r, found);
        if (r > 0.0 && r_hi > r) {
            found = dipole_rd_ring_mean_per_mm2(&c, r, r_hi);
            oracle_ring_mean(&o, r, r_hi);
            errors_note(&all[RING], oracle_ulp(&o, found), &c, r, found);
        }
        found = dipole_spectrum(&c, k);
        oracle_spectrum(&o, k);
        errors_note(&all[SPECTRUM], oracle_ulp(&o, found), &c, k, found);
        oracle_derivative(&o, &c, true, r);
        errors_note(&all[BY_SIGMA_A], oracle_ulp(&o, d.d_sigma_a), &c, r, d.d_sigma_a);
        oracle_derivative(&o, &c, false, r);
        errors_note(&all[BY_SIGMA_S], oracle_ulp(&o, d.d_sigma_s_prime), &c, r, d.d_sigma_s_prime);
        if (c.sigma_s_prime_per_mm > 0.0) {
            found = dipole_r_max_mm(&c, epsilon);
            errors_note(&all[REACH], reach_error(&o, epsilon, found), &c, epsilon, found);
        }
        oracle_clear(&o);
    }
    for (int k = 0; k < KIND_COUNT; k++)
        errors_print(&all[k], k == REACH ? "1" : "ULP");
}

/* ---- the beam model's half-space, against the line integral with 256 bits ------------------------- */

enum { LINE_BITS = 256, LINE_LIMIT = 2048 };

/* The line integral of T22 by the trapezoidal rule with half the library's step, which leaves 1e-34. */
struct line {
    size_t count;
    mpfr_t z[LINE_LIMIT], weight[LINE_LIMIT], fade[LINE_LIMIT]; /* depth; w(x) dx; e^(-sigma_tr z) */
    mpfr_t sigma_tr, alpha_prime, d, e, term, profile, within, beyond;
};

static struct line line;

static void line_init(const dipole_coefficients *c)
{
    const double step = 1.0 / 16.0;
    const int first = (int)floor(-50.0 / step);
    line.count = (size_t)(ceil(log(80.0 * fmax(1.0, c->boundary_a)) / step) - first);
    mpfr_t b, l, x, one_minus_b;
    mpfr_inits2(LINE_BITS, b, l, x, one_minus_b, line.sigma_tr, line.alpha_prime, line.d, line.e, line.term,
                line.profile, line.within, line.beyond, (mpfr_ptr)0);
    mpfr_set_d(l, c->sigma_a_per_mm, MPFR_RNDN);
    mpfr_add_d(l, l, c->sigma_s_prime_per_mm, MPFR_RNDN);
    mpfr_d_div(line.alpha_prime, c->sigma_s_prime_per_mm, l, MPFR_RNDN);
    mpfr_mul_d(line.sigma_tr, l, c->sigma_a_per_mm, MPFR_RNDN);
    mpfr_mul_ui(line.sigma_tr, line.sigma_tr, 3, MPFR_RNDN);
    mpfr_sqrt(line.sigma_tr, line.sigma_tr, MPFR_RNDN);
    mpfr_ui_div(l, 1, l, MPFR_RNDN);
    mpfr_set_d(b, c->boundary_a, MPFR_RNDN);
    mpfr_mul_ui(b, b, 2, MPFR_RNDN);
    mpfr_div_ui(b, b, 3, MPFR_RNDN);
    mpfr_ui_sub(one_minus_b, 1, b, MPFR_RNDN);
    for (size_t k = 0; k < line.count; k++) {
        mpfr_inits2(LINE_BITS, line.z[k], line.weight[k], line.fade[k], (mpfr_ptr)0);
        mpfr_set_d(x, ((double)k + first) * step, MPFR_RNDN);
        mpfr_exp(x, x, MPFR_RNDN);
        mpfr_mul(line.z[k], x, l, MPFR_RNDN);
        mpfr_neg(line.e, x, MPFR_RNDN);
        mpfr_div(line.term, line.e, b, MPFR_RNDN);
        mpfr_exp(line.e, line.e, MPFR_RNDN);
        mpfr_exp(line.term, line.term, MPFR_RNDN);
        mpfr_sub(line.weight[k], line.e, line.term, MPFR_RNDN);
        mpfr_div(line.weight[k], line.weight[k], one_minus_b, MPFR_RNDN);
        mpfr_mul(line.weight[k], line.weight[k], x, MPFR_RNDN);
        mpfr_mul_d(line.weight[k], line.weight[k], step, MPFR_RNDN);
        mpfr_mul(line.fade[k], line.sigma_tr, line.z[k], MPFR_RNDN);
        mpfr_neg(line.fade[k], line.fade[k], MPFR_RNDN);
        mpfr_exp(line.fade[k], line.fade[k], MPFR_RNDN);
    }
    mpfr_clears(b, l, x, one_minus_b, (mpfr_ptr)0);
}

static void line_clear(void)
{
    for (size_t k = 0; k < line.count; k++)
        mpfr_clears(line.z[k], line.weight[k], line.fade[k], (mpfr_ptr)0);
    mpfr_clears(line.sigma_tr, line.alpha_prime, line.d, line.e, line.term, line.profile, line.within,
                line.beyond, (mpfr_ptr)0);
}

/* alpha'/(2 pi) sum w z (1 + sigma_tr d) e^(-sigma_tr d)/d^3, and the power within and beyond r */
static void line_sum(double r_mm)
{
    mpfr_set_zero(line.profile, 1);
    mpfr_set_zero(line.within, 1);
    mpfr_set_zero(line.beyond, 1);
    for (size_t k = 0; k < line.count; k++) {
        mpfr_set_d(line.d, r_mm, MPFR_RNDN);
        mpfr_hypot(line.d, line.d, line.z[k], MPFR_RNDN);
        mpfr_mul(line.term, line.sigma_tr, line.d, MPFR_RNDN);
        mpfr_neg(line.e, line.term, MPFR_RNDN);
        mpfr_exp(line.e, line.e, MPFR_RNDN);
        mpfr_mul(line.e, line.e, line.z[k], MPFR_RNDN);
        mpfr_div(line.e, line.e, line.d, MPFR_RNDN); /* (z/d) e^(-sigma_tr d) */
        mpfr_add_ui(line.term, line.term, 1, MPFR_RNDN);
        mpfr_mul(line.term, line.term, line.e, MPFR_RNDN);
        mpfr_div(line.term, line.term, line.d, MPFR_RNDN);
        mpfr_div(line.term, line.term, line.d, MPFR_RNDN);
        mpfr_fma(line.profile, line.weight[k], line.term, line.profile, MPFR_RNDN);
        mpfr_fma(line.beyond, line.weight[k], line.e, line.beyond, MPFR_RNDN);
        mpfr_sub(line.term, line.fade[k], line.e, MPFR_RNDN);
        mpfr_fma(line.within, line.weight[k], line.term, line.within, MPFR_RNDN);
    }
    mpfr_mul(line.profile, line.profile, line.alpha_prime, MPFR_RNDN);
    mpfr_mul(line.within, line.within, line.alpha_prime, MPFR_RNDN);
    mpfr_mul(line.beyond, line.beyond, line.alpha_prime, MPFR_RNDN);
    mpfr_const_pi(line.term, MPFR_RNDN);
    mpfr_mul_ui(line.term, line.term, 2, MPFR_RNDN);
    mpfr_div(line.profile, line.profile, line.term, MPFR_RNDN);
}

static void compare_beam(int count)
{
    struct rng rng = { .seed = 104 };
    struct errors all[] = { { .name = "beam, profile", .bound = 8.0 },
                            { .name = "beam, within", .bound = 8.0 },
                            { .name = "beam, beyond", .bound = 8.0 } };
    for (int k = 0; k < 3; k++)
        errors_init(&all[k], (size_t)count);
    for (int i = 0; i < count; i += 10) {
        const dipole_coefficients c = random_medium(&rng);
        const dipole_layer base = { { c.sigma_a_per_mm, c.sigma_s_prime_per_mm, c.eta, DIPOLE_FDR_EXACT },
                                    (double)INFINITY };
        dipole_stack *stack;
        struct oracle o;
        if (!dipole_stack_create(&base, 1, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, NULL))
            continue;
        oracle_init(&o, &c);
        line_init(&c);
        for (int k = 0; k < 10 && i + k < count; k++) {
            double r = random_distance(&rng, &c);
            while (r < 1e-8 * c.mean_free_path_mm) /* below 1e-9 the profile goes on as a constant */
                r = c.mean_free_path_mm * log_uniform(&rng, 1e-8, 1e3);
            double found[3];
            dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r, 1, &found[0]);
            found[1] = dipole_stack_within(stack, DIPOLE_FACE_LIT, r);
            found[2] = dipole_stack_beyond(stack, DIPOLE_FACE_LIT, r);
            line_sum(r);
            const mpfr_srcptr expected[3] = { line.profile, line.within, line.beyond };
            for (int q = 0; q < 3; q++) {
                mpfr_set(o.sum, expected[q], MPFR_RNDN);
                errors_note(&all[q], oracle_ulp(&o, found[q]), &c, r, found[q]);
            }
        }
        line_clear();
        oracle_clear(&o);
        dipole_stack_destroy(stack);
    }
    for (int k = 0; k < 3; k++)
        errors_print(&all[k], "ULP");
}

/* ---- many radii at once ---------------------------------------------------------------------------- */

/* In units of what dipole.h allows: with x = sigma_tr r, 3e-16 (8 + x) of the value, and for derivatives
 * 6e-16 (8 + x) (2 + x) of the value. */
static void compare_batch(int count)
{
    struct rng rng = { .seed = 105 };
    struct errors all[] = { { .name = "profile, batch, of what is stated", .bound = 1.0 },
                            { .name = "gradient, batch, of what is stated", .bound = 1.0 } };
    enum { RADII = 37 };
    errors_init(&all[0], (size_t)count);
    errors_init(&all[1], 2 * (size_t)count);
    for (int i = 0; i < count; i += RADII) {
        const dipole_coefficients c = random_medium(&rng);
        double r[RADII], values[RADII], alone[RADII], d_a[RADII], d_s[RADII];
        for (int k = 0; k < RADII; k++)
            r[k] = random_distance(&rng, &c);
        dipole_rd_profile_per_mm2(&c, r, RADII, values);
        dipole_rd_profile_gradient(&c, r, RADII, alone, d_a, d_s);
        struct oracle o;
        oracle_init(&o, &c);
        for (int k = 0; k < RADII && i + k < count; k++) {
            const double x = c.sigma_tr_per_mm * r[k], smallest = 0x1p-1060; /* subnormals aside */
            const double expected = oracle_rd(&o, r[k]);
            const double allowed = 3e-16 * (8.0 + x) * expected + smallest;
            errors_note(&all[0], fmax(fabs(values[k] - expected), fabs(alone[k] - expected)) / allowed, &c,
                        r[k], values[k]);
            const double slope = 2.0 * (2.0 + x) * allowed + 1e-300;
            const double by_a = c.sigma_a_per_mm * oracle_derivative(&o, &c, true, r[k]);
            const double by_s = c.sigma_s_prime_per_mm * oracle_derivative(&o, &c, false, r[k]);
            errors_note(&all[1], fabs(d_a[k] - by_a) / slope, &c, r[k], d_a[k]);
            errors_note(&all[1], fabs(d_s[k] - by_s) / slope, &c, r[k], d_s[k]);
        }
        oracle_clear(&o);
    }
    for (int k = 0; k < 2; k++)
        errors_print(&all[k], "1");
}

/* ---- media from what they reflect ------------------------------------------------------------------ */

/* From reflectances near 0, near 1 and in between, and either length, to the medium and back (T28). */
static void compare_inversions(int count)
{
    struct rng rng = { .seed = 106 };
    struct errors all[] = { { .name = "reflectance after a round trip, relative", .bound = 1e-12 },
                            { .name = "mean free path after it, relative", .bound = 1e-12 } };
    for (int k = 0; k < 2; k++)
        errors_init(&all[k], (size_t)count);
    for (int i = 0; i < count; i++) {
        const double reflectance = i % 3 == 0   ? log_uniform(&rng, 1e-30, 1.0)
                                   : i % 3 == 1 ? 1.0 - log_uniform(&rng, 2e-16, 1.0)
                                                : uniform(&rng, 0.0, 1.0);
        const double length = log_uniform(&rng, 1e-12, 1e6), eta = log_uniform(&rng, 0.5, 3.0);
        const dipole_model model = i % 2 ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_DIPOLE;
        const bool is_diffuse = i / 2 % 2;
        dipole_medium medium;
        dipole_status status;
        dipole_coefficients c;
        if (!(is_diffuse ? dipole_medium_from_diffuse_mean_free_path : dipole_medium_from_mean_free_path)(
                reflectance, length, eta, DIPOLE_FDR_EXACT, model, &medium, &status) ||
            !dipole_coefficients_init(&medium, &c, &status)) {
            failed("reflectance %.17g, length %.17g: %s", reflectance, length, status.message);
            continue;
        }
        const double x = c.sigma_tr_per_mm * c.mean_free_path_mm, b = 2.0 / 3.0 * c.boundary_a;
        const double back = model == DIPOLE_MODEL_BEAM ? c.alpha_prime / ((1.0 + x) * (1.0 + b * x))
                                                       : dipole_diffuse_reflectance(&c);
        const double length_back = is_diffuse ? 1.0 / c.sigma_tr_per_mm : c.mean_free_path_mm;
        errors_note(&all[0], fabs(back / reflectance - 1.0), &c, reflectance, back);
        errors_note(&all[1], fabs(length_back / length - 1.0), &c, length, length_back);
    }
    for (int k = 0; k < 2; k++)
        errors_print(&all[k], "1");
}

int main(int argc, char **argv)
{
    const double scale = argc > 1 ? strtod(argv[1], NULL) : 1.0;
    if (!(scale > 0.0 && scale <= 1000.0)) {
        fprintf(stderr, "usage: stability [SCALE], more than 0 to 1000\n");
        return 2;
    }
    printf("| model | inputs | held |\n|---|---|---|\n");
    sweep_dipole((int)(1e6 * scale));
    sweep_beam((int)(2e4 * scale));
    sweep_layers((int)(2e4 * scale));
    printf(
        "\n| quantity | inputs | median | 99 %% | worst | bound | unit |\n|---|---|---|---|---|---|---|\n");
    compare_dipole((int)(1e5 * scale));
    compare_batch((int)(2e4 * scale));
    compare_beam((int)(2e3 * scale));
    compare_inversions((int)(1e5 * scale));
    compare_layers((int)(2e4 * scale));
    printf("\n%d failures\n", failure_count);
    mpfr_free_cache();
    return failure_count > 0;
}
