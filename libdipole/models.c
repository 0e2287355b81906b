/* The papers' models in the Hankel domain. docs/theory.md T24, T25. */
#include "internal.h"

/* ---- d'Eon 2012, a better dipole (T24) ------------------------------------------------------------ */

void dipole_better_dipole_solve(const struct system *system, double complex k2, struct dual out[2])
{
    const struct slab *const slab = &system->slabs[0];
    /* Grosjean's diffusion coefficient (2 sigma_a + sigma_s')/(3 sigma_t'^2) and its own sigma_tr */
    const struct dual sigma_t = slab->sigma_t_prime, sigma_a = subtract(sigma_t, slab->sigma_s_prime);
    const struct dual diffusion = divide(add(sigma_t, sigma_a), scale(3.0, multiply(sigma_t, sigma_t)));
    struct dual q2 = divide(sigma_a, diffusion);
    q2.v += k2;
    const struct dual q = root(q2);
    /* C_1 = Fdr/2 and C_2, the Fresnel moments */
    const double fdt = dipole_fdt_exact(system->eta[0]),
                 c2 = dipole_fresnel_second_moment_inside(system->eta[0]);
    const double boundary_a = (1.0 + 3.0 * c2) / fdt;
    const struct dual z_r = divide(constant(1.0), sigma_t), gap = scale(4.0 * boundary_a, diffusion);
    const struct dual e_r = decay(multiply(q, z_r)), qgap = multiply(q, gap);
    /* fluence (e^(-q z_r) - e^(-q z_v))/(2 D q) and flux (e^(-q z_r) + e^(-q z_v))/2, z_v = z_r + gap */
    const struct dual fluence =
        divide(multiply(e_r, multiply(gap, fade_mean(qgap))), scale(2.0, diffusion));
    const struct dual flux = scale(0.5, multiply(e_r, add(constant(1.0), decay(qgap))));
    const struct dual alpha = divide(slab->sigma_s_prime, sigma_t);
    const struct dual sum = add(scale(0.25 * fdt, fluence), scale(0.5 * (1.0 - 3.0 * c2), flux));
    /* alpha'^2: light that scattered more than once; the model leaves single scattering to others */
    out[DIPOLE_FACE_LIT] = multiply(multiply(alpha, alpha), sum);
    out[DIPOLE_FACE_FAR] = constant(0.0);
}

/* ---- Donner and Jensen 2005 (T25) ----------------------------------------------------------------- */

/* (1 - e^(-2 q a))/(1 - e^(-2 q b)), a/b at q = 0. */
static struct dual fade_ratio(struct dual q, struct dual a, struct dual b)
{
    const struct dual twice = scale(2.0, q);
    return divide(multiply(a, fade_mean(multiply(twice, a))), multiply(b, fade_mean(multiply(twice, b))));
}

/*
 * The infinite row of sources in closed form: with L = d + z_0 + z_1,
 *   R^ = alpha' cosh(q z_0) sinh q(d + z_1 - l)/sinh qL,   T^ = alpha' cosh(q z_1) sinh q(l + z_0)/sinh qL,
 * where z_0 is the extrapolation behind the face the light enters and z_1 behind the other; written with
 * decaying exponentials only.
 */
static void slab_exchange(const struct slab *slab, struct dual q, struct dual z_0, struct dual z_1,
                          struct dual *r, struct dual *t)
{
    const struct dual length = divide(constant(1.0), slab->sigma_t_prime), d = slab->thickness;
    const struct dual half_alpha = scale(0.5, divide(slab->sigma_s_prime, slab->sigma_t_prime));
    const struct dual all = add(d, add(z_0, z_1)), one = constant(1.0);
    *r = multiply(multiply(half_alpha, decay(multiply(q, length))),
                  multiply(add(one, decay(scale(2.0, multiply(q, z_0)))),
                           fade_ratio(q, subtract(add(d, z_1), length), all)));
    *t = multiply(
        multiply(half_alpha, decay(multiply(q, subtract(d, length)))),
        multiply(add(one, decay(scale(2.0, multiply(q, z_1)))), fade_ratio(q, add(length, z_0), all)));
}

/* A half-space: alpha'/2 (e^(-q l) + e^(-q (l + 2 z_0))). T10 */
static struct dual base_reflectance(const struct slab *slab, struct dual q, struct dual z_0)
{
    const struct dual length = divide(constant(1.0), slab->sigma_t_prime);
    const struct dual half_alpha = scale(0.5, divide(slab->sigma_s_prime, slab->sigma_t_prime));
    return multiply(multiply(half_alpha, decay(multiply(q, length))),
                    add(constant(1.0), decay(scale(2.0, multiply(q, z_0)))));
}

/* A of a face between a layer and what lies beyond it. */
static double face_a(double eta, double eta_beyond)
{
    const double ratio = eta / eta_beyond;
    return (1.0 + dipole_fdr_exact(ratio)) / dipole_fdt_exact(ratio);
}

void dipole_multipole_init(struct system *system)
{
    for (size_t i = 0; i < system->count; i++) {
        const double above = i > 0 ? system->eta[i - 1] : 1.0,
                     below = i + 1 < system->count ? system->eta[i + 1] : 1.0;
        system->multipole_a[i][0] = face_a(system->eta[i], above);
        system->multipole_a[i][1] = face_a(system->eta[i], below);
    }
}

/* Light that enters a layer from above or below spreads as if a beam had entered it, per frequency:
 * R_12 = R_1 + T_1 R_2 T_1'/(1 - R_1' R_2), T_12 = T_1 T_2/(1 - R_1' R_2). Joined from the bottom upwards.
 * Returns the smallest real part of 1 - R_1' R_2.
 */
static double multipole_solve(const struct system *system, double complex k2, struct dual out[2])
{
    struct dual r_below = constant(0.0), t_below = constant(1.0);
    const size_t count = system->count;
    double smallest = 1.0;
    for (size_t i = count; i-- > 0;) {
        const struct slab *const slab = &system->slabs[i];
        struct dual q2 = slab->sigma_tr2;
        q2.v += k2;
        const struct dual q = root(q2);
        const double a_0 = system->multipole_a[i][0], a_1 = system->multipole_a[i][1];
        const struct dual z_0 = scale(2.0 * a_0, slab->diffusion), z_1 = scale(2.0 * a_1, slab->diffusion);
        if (i + 1 == count && system->is_half_space) {
            r_below = base_reflectance(slab, q, z_0);
            t_below = constant(0.0);
            continue;
        }
        struct dual r, t, r_up, t_up;
        slab_exchange(slab, q, z_0, z_1, &r, &t);
        slab_exchange(slab, q, z_1, z_0, &r_up, &t_up);
        const struct dual loop = subtract(constant(1.0), multiply(r_up, r_below));
        r_below = add(r, divide(multiply(multiply(t, r_below), t_up), loop));
        t_below = divide(multiply(t, t_below), loop);
        smallest = fmin(smallest, creal(loop.v));
    }
    out[DIPOLE_FACE_LIT] = r_below;
    out[DIPOLE_FACE_FAR] = t_below;
    return smallest;
}

void dipole_multipole_solve(const struct system *system, double complex k2, struct dual out[2])
{
    multipole_solve(system, k2, out);
}

/* The poles of each layer, sinh qL = 0, begin at sigma_tr^2 + (pi/L)^2, the base's cut at sigma_tr; between
 * layers a pole is where 1 - R_1' R_2 becomes 0, which falls up to there. */
double dipole_multipole_first_singularity_per_mm(const struct system *system)
{
    double lo = INFINITY, hi = INFINITY;
    const size_t count = system->count;
    for (size_t i = 0; i < count; i++) {
        const struct slab *const slab = &system->slabs[i];
        const double sigma_tr = sqrt(creal(slab->sigma_tr2.v));
        const double a_0 = system->multipole_a[i][0], a_1 = system->multipole_a[i][1];
        const double all = creal(slab->thickness.v) + 2.0 * (a_0 + a_1) * creal(slab->diffusion.v);
        const bool is_base = i + 1 == count && system->is_half_space;
        lo = fmin(lo, sigma_tr);
        hi = fmin(hi, is_base ? sigma_tr : hypot(sigma_tr, PI / all) * (1.0 - 1e-13));
    }
    struct dual f[2];
    if (multipole_solve(system, -hi * hi, f) > 0.0)
        return hi;
    while (hi - lo > 1e-13 * hi && hi > 1e-200) {
        const double middle = lo > 0.5 * hi ? 0.5 * (lo + hi) : fmax(sqrt(lo) * sqrt(hi), 0.1 * hi);
        if (multipole_solve(system, -middle * middle, f) > 0.0)
            lo = middle;
        else
            hi = middle;
    }
    return lo;
}
