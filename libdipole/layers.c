/*
 * The beam model: diffusion in layers, lit by the beam that enters and fades in them. docs/theory.md T23.
 *
 * For one spatial frequency k the fluence phi(z) of each layer obeys
 *   -D phi'' + D q^2 phi = sigma_s' (down-going beam + up-going beam),   q^2 = sigma_tr^2 + k^2,
 * with phi/n^2 and the flux J = -D phi' continuous between layers, phi = 2 A D phi' at the top face and
 * phi = -2 A D phi' at the bottom face. It is solved from the bottom upwards by the affine relation
 * J = y phi + c between flux and fluence at each interface, in which only decaying exponentials occur,
 * so that layers of any thickness neither overflow nor cancel.
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
        system->eta[i] = c->eta;
    }
    system->a_top = coefficients[0].boundary_a;
    system->a_bottom = coefficients[count - 1].boundary_a;
    beams_init(system);
}

/* ---- one spatial frequency ------------------------------------------------------------------------ */

/* What the way back down needs: phi(d) = (phi(0) - u_top) through + bottom. */
struct descent {
    struct dual through, bottom, u_top;
};

/*
 * One layer between the relation J = y phi + c at its bottom and the same at its top.
 *
 * phi = a e^(-qz) + b e^(-q(d - z)) + u(z), where u is the response to both beams that vanishes with each
 * beam's entry: u_down(z) = s_down (e^(-sigma_t' z) - e^(-qz))/(q^2 - sigma_t'^2), likewise from below.
 */
static void climb(const struct slab *slab, struct dual q, struct dual *y, struct dual *c,
                  struct descent *out)
{
    const struct dual d = slab->thickness, sigma_t = slab->sigma_t_prime, dq = multiply(slab->diffusion, q);
    const struct dual sum = add(q, sigma_t), e = decay(multiply(q, d));
    const struct dual per = divide(slab->sigma_s_prime, multiply(slab->diffusion, sum));
    const struct dual s_down = multiply(per, slab->down), s_up = multiply(per, slab->up);
    /* (e^(-sigma_t' d) - e^(-qd))/(q - sigma_t'), symmetric in its two rates: the smaller one is taken out
     */
    const struct dual gap = multiply(subtract(q, sigma_t), d);
    const struct dual mean = multiply(d, creal(gap.v) >= 0.0 ? multiply(slab->through, fade_mean(gap))
                                                             : multiply(e, fade_mean(scale(-1.0, gap))));
    /* and the slope of u at the far end */
    const struct dual far_slope = subtract(e, multiply(sigma_t, mean));
    const struct dual u_bottom = multiply(s_down, mean), u_top = multiply(s_up, mean);
    const struct dual slope_bottom = subtract(multiply(s_down, far_slope), s_up);
    const struct dual slope_top = subtract(s_down, multiply(s_up, far_slope));

    const struct dual total = add(dq, *y);
    const struct dual w =
        divide(add(add(multiply(slab->diffusion, slope_bottom), multiply(*y, u_bottom)), *c), total);
    /* 1 + rho e^2 and 1 - rho e^2 with rho = (Dq - y)/(Dq + y), without cancellation in thin layers */
    const struct dual e2 = multiply(e, e), open = fade(scale(2.0, multiply(q, d)));
    const struct dual plus = add(open, divide(scale(2.0, multiply(e2, dq)), total));
    const struct dual minus = add(open, divide(scale(2.0, multiply(e2, *y)), total));

    /* q u - u' at the bottom, for s_down = 1: (q + sigma_t') mean - e, which cancels where q is small */
    const struct dual rates = subtract(q, sigma_t);
    const struct dual rest =
        cabs(rates.v) > 0.5 * cabs(sigma_t.v)
            ? divide(subtract(multiply(sum, slab->through), scale(2.0, multiply(q, e))), rates)
            : subtract(multiply(sum, mean), e);
    out->through = divide(scale(2.0, multiply(e, dq)), multiply(total, plus));
    const struct dual leaving = multiply(slab->diffusion, add(multiply(s_down, rest), s_up));
    out->bottom = add(multiply(multiply(w, e), out->through), divide(subtract(leaving, *c), total));
    out->u_top = u_top;

    *y = divide(multiply(dq, minus), plus);
    *c = subtract(subtract(divide(scale(2.0, multiply(dq, multiply(w, e))), plus),
                           multiply(slab->diffusion, slope_top)),
                  multiply(*y, u_top));
}

/* q = sqrt(sigma_tr^2 + k^2). Where it is 0, a lossless layer at k = 0, the solution has a limit but the
 * formulas 0/0: a q of 1e-18 sigma_t' gives it to the last digit. */
static struct dual rate(const struct slab *slab, double complex k2)
{
    const struct dual q2 = { slab->sigma_tr2.v + k2, slab->sigma_tr2.d };
    return q2.v == 0.0 ? constant(1e-18 * creal(slab->sigma_t_prime.v)) : root(q2);
}

/* R^(k) and T^(k) for k^2, complex; the square roots take the branch with positive real part. */
void dipole_system_solve(const struct system *system, double complex k2, struct dual out[2])
{
    struct descent descents[DIPOLE_LAYER_LIMIT];
    struct dual y = constant(0.5 / system->a_bottom), c = constant(0.0);
    for (size_t i = system->count; i-- > 0;) {
        const struct slab *const slab = &system->slabs[i];
        const struct dual q = rate(slab, k2);
        if (i + 1 == system->count && system->is_half_space) {
            y = multiply(slab->diffusion, q);
            c = scale(-1.0, divide(multiply(slab->sigma_s_prime, slab->down), add(q, slab->sigma_t_prime)));
        } else {
            climb(slab, q, &y, &c, &descents[i]);
        }
        if (i > 0) /* phi/n^2 is continuous: the layer above sees y (n_below/n_above)^2 */
            y = scale(square(system->eta[i] / system->eta[i - 1]), y);
    }
    const struct dual one = constant(1.0);
    out[DIPOLE_FACE_LIT] = scale(-1.0, divide(c, add(one, scale(2.0 * system->a_top, y))));
    out[DIPOLE_FACE_FAR] = constant(0.0);
    if (system->is_half_space)
        return;
    struct dual phi = scale(2.0 * system->a_top, out[DIPOLE_FACE_LIT]);
    for (size_t i = 0; i < system->count; i++) {
        const struct descent *const s = &descents[i];
        phi = add(multiply(subtract(phi, s->u_top), s->through), s->bottom);
        if (i + 1 < system->count)
            phi = scale(square(system->eta[i + 1] / system->eta[i]), phi);
    }
    out[DIPOLE_FACE_FAR] = scale(0.5 / system->a_bottom, phi);
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
