/*
 * The beam model: diffusion in layers, lit by the beam that enters and fades in them. docs/theory.md T23.
 *
 * For one spatial frequency k the fluence phi(z) of each layer obeys
 *   -D phi'' + D q^2 phi = sigma_s' (down-going beam + up-going beam),   q^2 = sigma_tr^2 + k^2,
 * with phi/n^2 and the flux J = -D phi' continuous between layers, phi = 2 A D phi' at the top face and
 * phi = -2 A D phi' at the bottom face. What leaves by a face is the integral of the source times the
 * solution psi without sources that meets the conditions at the other face and is 1 at this one. psi and
 * its flux y psi are carried from face to face; all that occurs is a sum of terms which are positive at
 * real k, so that no layer, thick or thin, loses digits.
 *
 * Everything is a dual number: value and derivative with respect to one parameter.
 */
#include "internal.h"

/* Beams at normal incidence with every reflection between the interfaces, as geometric series. */
static void beams_init(struct system *system)
{
    const size_t count = system->count;
    double reflectance[DIPOLE_LAYER_LIMIT];   /* of the interface under layer i      */
    struct dual below[DIPOLE_LAYER_LIMIT];    /* of all that lies under layer i      */
    struct dual from_top[DIPOLE_LAYER_LIMIT]; /* of layer i and all under it         */
    for (size_t i = count; i-- > 0;) {
        const bool is_last = i + 1 == count;
        const double far_eta = is_last ? 1.0 : system->eta[i + 1];
        reflectance[i] = is_last && system->is_half_space
                             ? 0.0
                             : dipole_fresnel_reflectance(far_eta / system->eta[i], 1.0);
        below[i] = constant(reflectance[i]);
        if (!is_last) {
            const struct dual loop = subtract(constant(1.0), scale(reflectance[i], from_top[i + 1]));
            below[i] = add(below[i], divide(scale(square(1.0 - reflectance[i]), from_top[i + 1]), loop));
        }
        from_top[i] = multiply(multiply(system->slabs[i].through, system->slabs[i].through), below[i]);
    }
    const double top = dipole_fresnel_reflectance(1.0 / system->eta[0], 1.0);
    struct dual entering = divide(constant(1.0), subtract(constant(1.0), scale(top, from_top[0])));
    system->unscattered[DIPOLE_FACE_LIT] = scale(1.0 - top, multiply(entering, from_top[0]));
    for (size_t i = 0; i < count; i++) {
        struct slab *const slab = &system->slabs[i];
        const struct dual arriving = multiply(entering, slab->through);
        slab->down = entering;
        slab->up = multiply(arriving, below[i]);
        entering = scale(1.0 - reflectance[i], arriving);
        if (i + 1 < count)
            entering = divide(entering, subtract(constant(1.0), scale(reflectance[i], from_top[i + 1])));
    }
    system->unscattered[DIPOLE_FACE_FAR] = system->is_half_space ? constant(0.0) : entering;
}

/* x_k = sign (x_(k-1) - g/k!)/a by whichever direction is stable: upwards from x_0, given, or downwards
 * from x_24 = g/25!, whose error has died out before the moments that are kept. */
static void moments_recur(struct dual a, double sign, struct dual g, struct dual x_0, struct dual *moments)
{
    double inverse_factorials[25] = { 1.0 };
    for (int k = 1; k < 25; k++)
        inverse_factorials[k] = inverse_factorials[k - 1] / k;
    if (creal(a.v) >= 1.0) {
        moments[0] = x_0;
        for (int k = 1; k < SLAB_MOMENTS; k++)
            moments[k] = scale(sign, divide(subtract(moments[k - 1], scale(inverse_factorials[k], g)), a));
        return;
    }
    struct dual x = scale(inverse_factorials[24] / 25.0, g);
    for (int k = 24; k > 0; k--) {
        x = add(scale(inverse_factorials[k], g), scale(sign, multiply(a, x)));
        if (k <= SLAB_MOMENTS)
            moments[k - 1] = x;
    }
}

/* With a = sigma_t' d: near_k = int_0^1 e^(-ax) (1 - x)^k/k! dx, far_k = int_0^1 e^(-ax) x^k/k! dx. */
static void moments_init(struct slab *slab)
{
    const struct dual a = multiply(slab->sigma_t_prime, slab->thickness), x_0 = fade_mean(a);
    moments_recur(a, -1.0, constant(1.0), x_0, slab->near_moments);
    moments_recur(a, 1.0, slab->through, x_0, slab->far_moments);
}

void dipole_system_init(struct system *system, const dipole_layer *layers,
                        const dipole_coefficients *coefficients, size_t count, int parameter)
{
    system->count = count;
    system->is_half_space = isinf(layers[count - 1].thickness_mm);
    for (size_t i = 0; i < count; i++) {
        const dipole_coefficients *const c = &coefficients[i];
        const int own = parameter - 3 * (int)i; /* 0: log sigma_a, 1: log sigma_s', 2: log thickness */
        const double d_a = own == 0 ? c->sigma_a_per_mm : 0.0,
                     d_s = own == 1 ? c->sigma_s_prime_per_mm : 0.0;
        struct slab *const slab = &system->slabs[i];
        const struct dual sigma_a = { c->sigma_a_per_mm, d_a };
        slab->sigma_s_prime = (struct dual){ c->sigma_s_prime_per_mm, d_s };
        slab->sigma_t_prime = (struct dual){ c->sigma_t_prime_per_mm, d_a + d_s };
        slab->diffusion = divide(constant(1.0 / 3.0), slab->sigma_t_prime);
        slab->sigma_tr2 = scale(3.0, multiply(sigma_a, slab->sigma_t_prime));
        const bool is_infinite = system->is_half_space && i + 1 == count;
        const double thickness = is_infinite ? 0.0 : layers[i].thickness_mm;
        slab->thickness = (struct dual){ thickness, own == 2 ? thickness : 0.0 };
        slab->through = is_infinite ? constant(0.0) : decay(multiply(slab->sigma_t_prime, slab->thickness));
        if (!is_infinite)
            moments_init(slab);
        system->eta[i] = c->eta;
    }
    system->a_top = coefficients[0].boundary_a;
    system->a_bottom = coefficients[count - 1].boundary_a;
    beams_init(system);
}

/* ---- one spatial frequency ------------------------------------------------------------------------ */

/* sum_n x^n series[stride n + first], for |x| < 1/4 to rounding if the terms fall as 1/(2n)!. */
static struct dual power_series(const struct dual *series, int first, struct dual x)
{
    struct dual sum = series[SLAB_MOMENTS - 2 + first];
    for (int n = SLAB_MOMENTS / 2 - 2; n >= 0; n--)
        sum = add(multiply(sum, x), series[2 * n + first]);
    return sum;
}

/* Functions of q^2 by their power series: no square root is taken, real stays real. */
static struct crossing cross_thin(const struct slab *slab, struct dual q2)
{
    static const struct dual inverse_factorials[SLAB_MOMENTS + 1] = {
        { 1.0, 0.0 },
        { 1.0, 0.0 },
        { 1.0 / 2, 0.0 },
        { 1.0 / 6, 0.0 },
        { 1.0 / 24, 0.0 },
        { 1.0 / 120, 0.0 },
        { 1.0 / 720, 0.0 },
        { 1.0 / 5040, 0.0 },
        { 1.0 / 40320, 0.0 },
        { 1.0 / 362880, 0.0 },
        { 1.0 / 3628800, 0.0 },
        { 1.0 / 39916800, 0.0 },
        { 1.0 / 479001600, 0.0 },
        { 1.0 / 6227020800, 0.0 },
        { 1.0 / 87178291200, 0.0 },
        { 1.0 / 1307674368000, 0.0 },
    };
    const struct dual d = slab->thickness, d2 = multiply(d, d), x = multiply(q2, d2);
    return (struct crossing){
        .unit = constant(1.0),
        .cosh = power_series(inverse_factorials, 0, x),
        .sinh = multiply(d, power_series(inverse_factorials, 1, x)),
        .near_cosh = multiply(d, power_series(slab->near_moments, 0, x)),
        .near_sinh = multiply(d2, power_series(slab->near_moments, 1, x)),
        .far_cosh = multiply(d, power_series(slab->far_moments, 0, x)),
        .far_sinh = multiply(d2, power_series(slab->far_moments, 1, x)),
        .q2 = q2,
    };
}

/* With decaying exponentials only. The pole at q = sigma_t' is removable. */
static struct crossing cross_thick(const struct slab *slab, struct dual q2)
{
    const struct dual q = root(q2), d = slab->thickness, sigma_t = slab->sigma_t_prime;
    const struct dual e = decay(multiply(q, d)), e2 = multiply(e, e);
    /* (1 - e^(-(q + sigma_t') d))/(q + sigma_t') and (e^(-sigma_t' d) - e^(-qd))/(q - sigma_t'), symmetric
     * in its two rates: the smaller one is taken out */
    const struct dual sum = multiply(d, fade_mean(multiply(add(q, sigma_t), d)));
    const struct dual gap = multiply(subtract(q, sigma_t), d);
    const struct dual mean = multiply(d, creal(gap.v) >= 0.0 ? multiply(slab->through, fade_mean(gap))
                                                             : multiply(e, fade_mean(scale(-1.0, gap))));
    struct crossing out = {
        .unit = e,
        .cosh = scale(0.5, add(constant(1.0), e2)),
        .sinh = scale(0.5, divide(fade(scale(2.0, multiply(q, d))), q)),
        .near_cosh = scale(0.5, add(sum, multiply(e, mean))),
        .near_sinh = scale(0.5, divide(subtract(sum, multiply(e, mean)), q)),
        .far_cosh = scale(0.5, add(mean, multiply(e, sum))),
        .far_sinh = scale(0.5, divide(subtract(mean, multiply(e, sum)), q)),
        .q2 = q2,
    };
    if (creal(sigma_t.v) > 2.0 * size(q.v)) /* where the two nearly cancel */
        out.far_sinh =
            divide(subtract(e, multiply(slab->through, add(out.cosh, multiply(sigma_t, out.sinh)))),
                   subtract(multiply(sigma_t, sigma_t), q2));
    return out;
}

struct crossing dipole_slab_cross(const struct slab *slab, struct dual q2)
{
    return size(q2.v) * square(creal(slab->thickness.v)) < 0.25 ? cross_thin(slab, q2)
                                                                : cross_thick(slab, q2);
}

/* psi from one side of a layer to the other: y, its flux over itself, and c, the integral of source x psi
 * over psi, of all that has been passed. */
static void pass(const struct slab *slab, const struct crossing *x, struct dual near_beam,
                 struct dual far_beam, struct dual *y, struct dual *c)
{
    const struct dual y_d = divide(*y, slab->diffusion);
    const struct dual psi = add(x->cosh, multiply(y_d, x->sinh));
    const struct dual near = multiply(near_beam, add(x->near_cosh, multiply(y_d, x->near_sinh)));
    const struct dual far = multiply(far_beam, add(x->far_cosh, multiply(y_d, x->far_sinh)));
    const struct dual source = multiply(slab->sigma_s_prime, add(near, far));
    *c = divide(add(source, multiply(x->unit, *c)), psi);
    *y = divide(add(multiply(*y, x->cosh), multiply(slab->diffusion, multiply(x->q2, x->sinh))), psi);
}

/* R^(k) and T^(k) for k^2, complex; the square roots take the branch with positive real part. */
void dipole_system_solve(const struct system *system, double complex k2, struct dual out[2])
{
    struct crossing crossings[DIPOLE_LAYER_LIMIT];
    const size_t count = system->count;
    const struct dual one = constant(1.0);
    struct dual y = constant(0.5 / system->a_bottom), c = constant(0.0);
    for (size_t i = count; i-- > 0;) {
        const struct slab *const slab = &system->slabs[i];
        if (i + 1 == count && system->is_half_space) {
            const struct dual q = root((struct dual){ slab->sigma_tr2.v + k2, slab->sigma_tr2.d });
            y = multiply(slab->diffusion, q);
            c = divide(multiply(slab->sigma_s_prime, slab->down), add(q, slab->sigma_t_prime));
        } else {
            crossings[i] =
                dipole_slab_cross(slab, (struct dual){ slab->sigma_tr2.v + k2, slab->sigma_tr2.d });
            pass(slab, &crossings[i], slab->down, slab->up, &y, &c);
        }
        if (i > 0) /* phi/n^2 is continuous: the layer above sees y (n_below/n_above)^2 */
            y = scale(square(system->eta[i] / system->eta[i - 1]), y);
    }
    out[DIPOLE_FACE_LIT] = divide(c, add(one, scale(2.0 * system->a_top, y)));
    out[DIPOLE_FACE_FAR] = constant(0.0);
    if (system->is_half_space)
        return;
    y = constant(0.5 / system->a_top), c = constant(0.0);
    for (size_t i = 0; i < count; i++) {
        const struct slab *const slab = &system->slabs[i];
        pass(slab, &crossings[i], slab->up, slab->down, &y, &c);
        if (i + 1 < count)
            y = scale(square(system->eta[i] / system->eta[i + 1]), y);
    }
    out[DIPOLE_FACE_FAR] = divide(c, add(one, scale(2.0 * system->a_bottom, y)));
}

/* ---- where the response is singular --------------------------------------------------------------- */

/*
 * For k^2 = -kappa^2 < 0 the fluence without sources oscillates in the layers with sigma_tr < kappa. Below
 * the first singularity the solution that meets the bottom condition has no zero anywhere, and at the top
 * J = y phi stays above -phi/(2A). y climbs as in climb(), with hyperbolic or circular tangents.
 */
static bool is_below_first_singularity(const struct system *system, double kappa)
{
    double y = 0.5 / system->a_bottom;
    for (size_t i = system->count; i-- > 0;) {
        const struct slab *const slab = &system->slabs[i];
        const double diffusion = creal(slab->diffusion.v), thickness = creal(slab->thickness.v);
        const double q2 = creal(slab->sigma_tr2.v) - kappa * kappa, q = sqrt(fabs(q2)), dq = diffusion * q;
        if (i + 1 == system->count && system->is_half_space) {
            if (q2 < 0.0)
                return false;
            y = dq;
        } else if (q2 > 0.0) {
            const double t = tanh(q * thickness);
            if (dq + y * t <= 0.0)
                return false;
            y = dq * (y + dq * t) / (dq + y * t);
        } else if (q2 < 0.0) {
            const double angle = atan(y / dq) - q * thickness;
            if (angle <= -0.5 * PI)
                return false;
            y = dq * tan(angle);
        } else {
            if (1.0 + y * thickness / diffusion <= 0.0)
                return false;
            y = y / (1.0 + y * thickness / diffusion);
        }
        if (i > 0)
            y *= square(system->eta[i] / system->eta[i - 1]);
    }
    return 1.0 + 2.0 * system->a_top * y > 0.0;
}

double dipole_system_first_singularity_per_mm(const struct system *system)
{
    double lo = INFINITY;
    for (size_t i = 0; i < system->count; i++)
        lo = fmin(lo, sqrt(creal(system->slabs[i].sigma_tr2.v)));
    double hi = sqrt(creal(system->slabs[system->count - 1].sigma_tr2.v));
    if (system->is_half_space && is_below_first_singularity(system, hi))
        return hi; /* the base's cut */
    if (!system->is_half_space) {
        hi = fmax(2.0 * lo, creal(system->slabs[0].sigma_t_prime.v));
        while (is_below_first_singularity(system, hi))
            hi *= 2.0;
    }
    while (hi - lo > 1e-13 * hi) {
        const double middle = lo > 1e-6 * hi ? 0.5 * (lo + hi) : fmax(sqrt(lo) * sqrt(hi), 1e-3 * hi);
        if (is_below_first_singularity(system, middle))
            lo = middle;
        else
            hi = middle;
        if (hi < 1e-200)
            break;
    }
    return lo;
}
