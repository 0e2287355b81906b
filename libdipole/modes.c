/*
 * Exponential modes: three coupled diffusion equations in layers, lit by the beam. docs/theory.md T29.
 *
 * For one spatial frequency k the modes psi_m(z) of a layer obey
 *   -psi'' + (sigma_t'^2 B + k^2) psi = sigma_t' sigma_s' sqrt(w) (down-going beam + up-going beam),
 *   B = diag(t_m^2) - alpha' sqrt(w) sqrt(w)^T = V diag(nu_j^2) V^T,
 * which V takes apart into three equations of the beam model's kind (layers.c). psi_m'/sigma_t' and
 * s_m psi_m/(sigma_t' n^2) are continuous between layers, s_m^2 = t_m^2 sigma_t'^2 + k^2, and a face lets
 * Z_m psi_m out. As in layers.c, what leaves by a face is the integral of the source times a solution
 * without sources that meets the conditions at the other face: here a matrix of three solutions, whose
 * slope is y times themselves, carried from face to face with the integral c of the source times them.
 *
 * y is an M-matrix: off its diagonal nothing is positive, and its inverse is not negative. So at real k
 * what leaves is a sum of positive terms, and there is no singularity while all q_j are real and no face
 * sends back more than it gets.
 *
 * Everything is a dual number: value and derivative with respect to one parameter.
 */
#include "internal.h"

enum { N = MODE_COUNT };

/* Gauss's rule on 0..1: weights g and the rates t = 1/mu of its nodes; sqrt(w) = sqrt(g) t; and sqrt(g) mu,
 * which turns a slope over sigma_t' into flux. */
static const double gauss[N] = { 5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0 };
static const double rate[N] = { 1.1270166537925831148, 2.0, 8.8729833462074168852 };
static const double rate2[N] = { 1.2701665379258311482, 4.0, 78.729833462074168852 };
static const double root_weight[N] = { 0.59398993115433436150, 4.0 / 3.0, 4.6764728357929645252 };
static const double flux_weight[N] = { 0.46764728357929645252, 1.0 / 3.0, 0.059398993115433436150 };
/* The cosines, squared, that each mode stands for at a face: from 1 down, each as wide as 2 g mu. */
static const double cosine2_edge[N + 1] = { 1.0, 0.50705648076625461750, 0.062612036321810173045, 0.0 };

/* ---- once per system: the modes of a layer -------------------------------------------------------- */

/* For mode j, delta = t_j^2 - nu_j^2 is the root of alpha' sum w_m/(t_m^2 - t_j^2 + delta) = 1, which falls
 * with delta in 0 < delta < t_j^2 - t_(j-1)^2. */
struct secular {
    double alpha;
    int mode;
};

static void secular_function(const void *context, double delta, double *value, double *d_log_delta)
{
    const struct secular *const secular = context;
    double sum = 0.0, slope = 0.0;
    for (int m = 0; m < N; m++) {
        const double gap = rate2[m] - rate2[secular->mode] + delta, w = square(root_weight[m]);
        sum += w / gap;
        slope -= w / square(gap);
    }
    *value = secular->alpha * sum - 1.0;
    *d_log_delta = secular->alpha * slope * delta;
}

/* alpha' and 1 - alpha' with the slope of alpha', none by subtracting. */
static void albedo_find(const struct slab *slab, struct dual *alpha, double *epsilon)
{
    const double sigma_t = creal(slab->sigma_t_prime.v);
    *epsilon = creal(slab->sigma_tr2.v) / (3.0 * sigma_t) / sigma_t;
    alpha->v = creal(slab->sigma_s_prime.v) / sigma_t;
    const double complex d_s = slab->sigma_s_prime.d, d_a = slab->sigma_t_prime.d - d_s;
    alpha->d = *epsilon * (d_s / sigma_t) - alpha->v * (d_a / sigma_t);
}

static void layer_fill(const struct slab *slab, struct mode_layer *layer)
{
    struct dual alpha;
    double epsilon, nu2[N], basis[N][N], c[N];
    albedo_find(slab, &alpha, &epsilon);
    /* (t_m^2 - nu_j^2) V_mj = alpha' sqrt(w_m) c_j, c = V^T sqrt(w) */
    for (int j = 0; j < N; j++) {
        double delta = 0.0;
        if (creal(alpha.v) > 0.0) {
            const struct secular secular = { creal(alpha.v), j };
            delta =
                dipole_find_root(secular_function, &secular, 1e-3 * creal(alpha.v) * square(root_weight[j]),
                                 j > 0 ? rate2[j] - rate2[j - 1] : rate2[0]);
        }
        nu2[j] = rate2[j] - delta;
        double length2 = 0.0;
        for (int m = 0; m < N; m++) {
            basis[m][j] = root_weight[m] * (m == j ? 1.0 : delta / (rate2[m] - rate2[j] + delta));
            length2 += square(basis[m][j]);
        }
        c[j] = 0.0;
        for (int m = 0; m < N; m++) {
            basis[m][j] /= sqrt(length2);
            c[j] += root_weight[m] * basis[m][j];
        }
    }
    /* the determinant of B is (1 - alpha') prod t^2: no cancellation where absorption is small */
    nu2[0] = epsilon * (rate2[0] * rate2[1] * rate2[2]) / (nu2[1] * nu2[2]);
    for (int j = 0; j < N; j++) {
        struct dual source = constant(0.0);
        for (int m = 0; m < N; m++) {
            double turn = 0.0;
            for (int i = 0; i < N; i++)
                turn += i == j ? 0.0 : basis[m][i] * c[i] / (nu2[j] - nu2[i]);
            layer->basis.at[m][j] = (struct dual){ basis[m][j], -alpha.d * c[j] * turn };
            source = add(source, scale(root_weight[m], layer->basis.at[m][j]));
        }
        layer->source[j] = multiply(slab->sigma_s_prime, source);
        layer->q2[j] = multiply(multiply(slab->sigma_t_prime, slab->sigma_t_prime),
                                (struct dual){ nu2[j], -alpha.d * square(c[j]) });
    }
}

/* ---- once per system: its faces ------------------------------------------------------------------- */

/*
 * The unit of k at a face: 1/(2 mean depth), where depths z weigh sigma_t' e^(-2 tau(z)), what light that
 * is scattered once sees; never below the outer layer's sigma_t'. In a half-space both are sigma_t', in a
 * slab thinner than a mean free path it is 1/thickness.
 */
static struct dual face_sigma_per_mm(const struct system *system, dipole_face face)
{
    struct dual arriving = constant(1.0), depth = constant(0.0), moment = constant(0.0);
    const size_t last = system->count - 1;
    for (size_t n = 0; n <= last && arriving.v != 0.0; n++) {
        const size_t i = face == DIPOLE_FACE_LIT ? n : last - n;
        const struct slab *const slab = &system->slabs[i];
        const struct dual twice_sigma = scale(2.0, slab->sigma_t_prime);
        struct dual stopped = constant(1.0), within = constant(1.0), through = constant(0.0);
        if (!system->is_half_space || i < last) {
            const struct dual x = multiply(twice_sigma, slab->thickness);
            through = decay(x);
            stopped = fade(x);
            /* int_0^x y e^(-y) dy = 1 - (1 + x) e^(-x) = -x^2 d/dx ((1 - e^(-x))/x) */
            within.v = -x.v * x.v * fade_mean((struct dual){ x.v, 1.0 }).d;
            within.d = x.v * through.v * x.d;
        }
        moment =
            add(moment, multiply(arriving, add(multiply(depth, stopped), divide(within, twice_sigma))));
        arriving = multiply(arriving, through);
        depth = add(depth, slab->thickness);
    }
    const struct dual found = divide(subtract(constant(1.0), arriving), scale(2.0, moment));
    const struct dual outer = system->slabs[face == DIPOLE_FACE_LIT ? 0 : last].sigma_t_prime;
    return creal(found.v) > creal(outer.v) ? found : outer;
}

/* Gauss's rule with 8 nodes on -1..1, positive half. */
static const double legendre[4][2] = {
    { 0.18343464249564980494, 0.36268378337836198297 },
    { 0.52553240991632898582, 0.31370664587788728734 },
    { 0.79666647741362673959, 0.22238103445337447054 },
    { 0.96028985649753623168, 0.10122853629037625915 },
};

/* The nodes of E between two cosines, in mu = lo + (hi - lo) u^2 (3 - 2u). */
static void nodes_add(double eta, double lo, double hi, struct mode_face *face)
{
    for (int node = 0; node < 8; node++) {
        const double *const rule = legendre[node / 2];
        const double u = 0.5 + (node % 2 ? 0.5 : -0.5) * rule[0];
        const double mu = lo + (hi - lo) * (u * u * (3.0 - 2.0 * u));
        const double reflectance = hi < 1.0 ? 1.0 : dipole_fresnel_reflectance(1.0 / eta, mu);
        face->from_normal[face->node_count] = 1.0 - mu;
        face->weight[face->node_count++] = u * (1.0 - u) * rule[1] * (hi - lo) * reflectance * mu;
    }
}

static void face_fill(double eta, struct dual sigma_per_mm, struct mode_face *face)
{
    *face = (struct mode_face){ .sigma_per_mm = sigma_per_mm };
    double in_modes = 0.0, scattered_once = 0.0;
    for (int m = 0; m < N; m++) {
        dipole_fresnel_mean_inside(eta, cosine2_edge[m + 1], cosine2_edge[m], &face->reflected[m],
                                   &face->transmitted[m]);
        face->share[m] = gauss[m] * face->reflected[m];
        in_modes += face->share[m] / (rate[m] + 1.0);
    }
    if (eta == 1.0)
        return;
    const double critical = eta > 1.0 ? sqrt((eta - 1.0) * (eta + 1.0)) / eta : 0.0;
    if (eta > 1.0)
        nodes_add(eta, 0.0, critical, face);
    nodes_add(eta, critical, 1.0, face);
    for (size_t i = 0; i < face->node_count; i++)
        scattered_once += face->weight[i] / (2.0 - face->from_normal[i]);
    for (size_t i = 0; i < face->node_count; i++)
        face->weight[i] /= scattered_once;
    for (int m = 0; m < N; m++)
        face->share[m] /= in_modes;
}

void dipole_modes_init(struct system *system)
{
    const size_t last = system->count - 1;
    for (size_t i = 0; i <= last; i++)
        layer_fill(&system->slabs[i], &system->mode_layers[i]);
    face_fill(system->eta[0], face_sigma_per_mm(system, DIPOLE_FACE_LIT),
              &system->mode_faces[DIPOLE_FACE_LIT]);
    if (!system->is_half_space)
        face_fill(system->eta[last], face_sigma_per_mm(system, DIPOLE_FACE_FAR),
                  &system->mode_faces[DIPOLE_FACE_FAR]);
}

/* ---- one spatial frequency: a face ---------------------------------------------------------------- */

/*
 * Z_m = s_m (1 - F_m)/(1 + F_m), F_m = F_m(0) rho. rho = [E(k)/E(0)] [S(0)/S(k)], where E is what the face
 * reflects of light scattered once, which is known exactly, and S is the same by modes with F_m(0):
 *   E = int_0^1 F mu/sqrt((1 + mu)^2 + k^2 (1 - mu^2)) dmu,   S = sum g_m F_m(0)/(sqrt(t_m^2 + k^2) + 1).
 * Up to k = 10, 1 - rho comes from what E and S lack of what they are at k = 0, which does not cancel.
 */
static struct dual rho_lack(const struct mode_face *face, double complex k2)
{
    const struct dual unit = divide(constant(1.0), face->sigma_per_mm), unit2 = multiply(unit, unit);
    const struct dual kk = { unit2.v * k2, unit2.d * k2 };
    struct dual e = constant(0.0), e_lost = constant(0.0), s = constant(0.0), s_lost = constant(0.0);
    for (size_t i = 0; i < face->node_count; i++) {
        const double a = 2.0 - face->from_normal[i], b = face->from_normal[i] * a;
        const struct dual r = root(add(constant(a * a), scale(b, kk)));
        const struct dual part = divide(constant(face->weight[i]), r);
        e = add(e, part);
        e_lost = add(e_lost, divide(scale(b / a, part), add(r, constant(a))));
    }
    for (int m = 0; m < N; m++) {
        const struct dual r = root(add(constant(rate2[m]), kk));
        const struct dual part = divide(constant(face->share[m]), add(r, constant(1.0)));
        s = add(s, part);
        s_lost = add(s_lost, divide(scale(1.0 / (rate[m] + 1.0), part), add(r, constant(rate[m]))));
    }
    return size(kk.v) > 100.0 ? subtract(constant(1.0), divide(e, s))
                              : divide(multiply(kk, subtract(e_lost, s_lost)), s);
}

static void face_admittance(const struct mode_face *face, double complex k2, const struct dual s[N],
                            struct dual z[N])
{
    const struct dual lack = face->node_count > 0 ? rho_lack(face, k2) : constant(0.0);
    for (int m = 0; m < N; m++) {
        const struct dual less = scale(face->reflected[m], lack);
        z[m] = multiply(s[m], divide(add(constant(face->transmitted[m]), less),
                                     subtract(constant(1.0 + face->reflected[m]), less)));
    }
}

/* ---- one spatial frequency: a layer --------------------------------------------------------------- */

/* Of all that has been passed: the slope y of three solutions and the integral c of source x solution, both
 * over the solutions. is_regular: no combination of them has become 0 on the way (for real k^2). */
struct front {
    struct matrix y;
    struct dual c[N];
    bool is_regular;
};

/* V diag(a) V^T */
static struct matrix of_modes(const struct mode_layer *layer, const struct dual a[N])
{
    const struct matrix back = transpose(&layer->basis), rows = rows_scaled(a, &back);
    return product(&layer->basis, &rows);
}

/* The infinite base, where all decays downwards. */
static struct front base_front(const struct slab *slab, const struct mode_layer *layer, double complex k2)
{
    const struct matrix back = transpose(&layer->basis);
    struct front front = { .is_regular = true };
    struct dual q[N];
    for (int j = 0; j < N; j++) {
        q[j] = root((struct dual){ layer->q2[j].v + k2, layer->q2[j].d });
        front.c[j] = divide(multiply(layer->source[j], slab->down), add(q[j], slab->sigma_t_prime));
    }
    row_turn(front.c, &back);
    front.y = of_modes(layer, q);
    return front;
}

/*
 * A layer in which no mode changes much, with cosh and sinh as matrices V diag V^T:
 *   psi_near = m psi_far, m = cosh + sinh y,   slope_near = (q^2 sinh + cosh y) psi_far.
 * A mode that no face lets out is a row of small numbers in y and, as cosh - 1 is kept apart, remains one.
 */
static void pass_thin(const struct mode_layer *layer, const struct crossing x[N], struct dual near_beam,
                      struct dual far_beam, struct front *front)
{
    const struct matrix back = transpose(&layer->basis);
    const struct dual one = constant(1.0), ones[N] = { one, one, one };
    struct dual cosh_less_1[N], sinh[N], q2_sinh[N], source[N], source_y[N];
    for (int j = 0; j < N; j++) {
        sinh[j] = x[j].sinh;
        q2_sinh[j] = multiply(x[j].q2, x[j].sinh);
        cosh_less_1[j] = divide(multiply(q2_sinh[j], x[j].sinh), add(x[j].cosh, one));
        source[j] = multiply(layer->source[j],
                             add(multiply(near_beam, x[j].near_cosh), multiply(far_beam, x[j].far_cosh)));
        source_y[j] = multiply(layer->source[j],
                               add(multiply(near_beam, x[j].near_sinh), multiply(far_beam, x[j].far_sinh)));
    }
    const struct matrix cosh_part = of_modes(layer, cosh_less_1), sinh_part = of_modes(layer, sinh);
    const struct matrix cosh_y = product(&cosh_part, &front->y), sinh_y = product(&sinh_part, &front->y);
    struct matrix m = sum(&cosh_part, &sinh_y), slope = of_modes(layer, q2_sinh);
    diagonal_add(&m, ones);
    slope = sum(&slope, &cosh_y);
    slope = sum(&slope, &front->y);
    row_turn(source, &back);
    row_turn(source_y, &back);
    row_turn(source_y, &front->y);
    row_add(front->c, source);
    row_add(front->c, source_y);

    struct dual determinant;
    const struct matrix over_m = inverse(&m, &determinant);
    front->is_regular = front->is_regular && creal(determinant.v) > 0.0;
    front->y = product(&slope, &over_m);
    row_turn(front->c, &over_m);
}

/*
 * Any other layer, in its modes, cosh and sinh times unit: psi_near = m psi_far/unit. So a mode's source
 * and slope are rows times psi_far = m^-1 unit psi_near, over its own unit: harmless if that is 1, or the
 * largest, as of the slowest mode. Other modes are the sum of e^(-qx) psi_near, x from the near side, and
 * what the far side causes, with f = unit (q - y) psi_far:
 *   psi(x) = e^(-qx) psi_near + f (sinh qx)/q,   slope_near = q psi_near - f.
 */
static void pass_thick(const struct slab *slab, const struct mode_layer *layer, const struct crossing x[N],
                       struct dual near_beam, struct dual far_beam, struct front *front)
{
    const struct matrix back = transpose(&layer->basis);
    struct matrix y = product(&front->y, &layer->basis);
    y = product(&back, &y);
    row_turn(front->c, &layer->basis);
    /* of each mode, by psi_far and by psi_near: slope, and source of the slowest and of the others */
    struct matrix m, slope;
    struct dual slope_near[N], source_near[N], source_slow[N], over_slowest[N];
    for (int i = 0; i < N; i++) {
        const bool is_slow = i == 0 || x[i].unit.v == 1.0;
        const struct dual near = multiply(layer->source[i], near_beam),
                          far = multiply(layer->source[i], far_beam);
        const struct dual q = root(x[i].q2), minus_unit = scale(-1.0, x[i].unit);
        struct dual slope_one = multiply(x[i].q2, x[i].sinh), slope_y = x[i].cosh;
        struct dual source_one = add(multiply(near, x[i].near_cosh), multiply(far, x[i].far_cosh));
        struct dual source_y = add(multiply(near, x[i].near_sinh), multiply(far, x[i].far_sinh));
        slope_near[i] = source_near[i] = constant(0.0);
        if (!is_slow) {
            source_near[i] = add(source_one, multiply(q, source_y));
            slope_near[i] = q;
            slope_one = multiply(q, minus_unit);
            slope_y = x[i].unit;
            source_y = scale(-1.0, add(multiply(near, x[i].far_sinh), multiply(far, x[i].near_sinh)));
            source_one = scale(-1.0, multiply(q, source_y));
        }
        struct dual *const source = i == 0 ? source_slow : front->c;
        for (int j = 0; j < N; j++) {
            const struct dual one = constant(i == j), y_ij = y.at[i][j];
            m.at[i][j] = add(multiply(one, x[i].cosh), multiply(x[i].sinh, y_ij));
            slope.at[i][j] = add(multiply(one, slope_one), multiply(slope_y, y_ij));
            const struct dual source_ij = add(multiply(one, source_one), multiply(source_y, y_ij));
            source[j] = i == 0 ? source_ij : add(source[j], source_ij);
        }
        /* unit over that of the slowest mode, where the quotient has not underflown to 0/0 */
        over_slowest[i] = size(x[0].unit.v) > 1e-200
                              ? divide(x[i].unit, x[0].unit)
                              : decay(multiply(subtract(q, root(x[0].q2)), slab->thickness));
    }

    struct dual determinant;
    const struct matrix over_m = inverse(&m, &determinant);
    /* for k^2 < 0 only the slowest mode may oscillate, and then its unit is e^(-i angle) */
    const bool is_turning = cimag(x[0].unit.v) != 0.0;
    front->is_regular =
        front->is_regular && creal(is_turning ? determinant.v * conj(x[0].unit.v) : determinant.v) > 0.0;
    y = product(&slope, &over_m);
    row_turn(front->c, &over_m);
    row_turn(source_slow, &over_m);
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < N; i++)
            y.at[i][j] = multiply(y.at[i][j], i == 0 ? over_slowest[j] : x[j].unit);
        y.at[j][j] = add(y.at[j][j], slope_near[j]);
        front->c[j] = add(multiply(front->c[j], x[j].unit),
                          add(multiply(source_slow[j], over_slowest[j]), source_near[j]));
    }
    y = product(&y, &back);
    front->y = product(&layer->basis, &y);
    row_turn(front->c, &back);
}

/* ---- one spatial frequency: the stack ------------------------------------------------------------- */

/* What both ways through the stack share. */
struct frequency {
    struct crossing crossings[DIPOLE_LAYER_LIMIT][N];
    struct dual s[DIPOLE_LAYER_LIMIT][N];
    struct dual z[2][N]; /* of the faces, by dipole_face */
};

static void frequency_init(const struct system *system, double complex k2, struct frequency *frequency)
{
    const size_t last = system->count - 1;
    for (size_t i = 0; i <= last; i++) {
        const struct slab *const slab = &system->slabs[i];
        const struct dual sigma2 = multiply(slab->sigma_t_prime, slab->sigma_t_prime);
        for (int m = 0; m < N; m++) {
            const struct dual q2 = system->mode_layers[i].q2[m];
            frequency->s[i][m] = root((struct dual){ rate2[m] * sigma2.v + k2, rate2[m] * sigma2.d });
            if (i < last || !system->is_half_space)
                frequency->crossings[i][m] = dipole_slab_cross(slab, (struct dual){ q2.v + k2, q2.d });
        }
    }
    face_admittance(&system->mode_faces[DIPOLE_FACE_LIT], k2, frequency->s[0],
                    frequency->z[DIPOLE_FACE_LIT]);
    if (!system->is_half_space)
        face_admittance(&system->mode_faces[DIPOLE_FACE_FAR], k2, frequency->s[last],
                        frequency->z[DIPOLE_FACE_FAR]);
}

/* What leaves by a face, carried to it from the other. */
static struct dual leaving(const struct system *system, const struct frequency *frequency,
                           double complex k2, dipole_face face, bool *is_regular)
{
    const size_t count = system->count;
    const struct dual *const z = frequency->z[face];
    struct front front = { .is_regular = true };
    for (size_t n = 0; n < count; n++) {
        const size_t i = face == DIPOLE_FACE_LIT ? count - 1 - n : n;
        const struct slab *const slab = &system->slabs[i];
        const struct mode_layer *const layer = &system->mode_layers[i];
        const struct crossing *const x = frequency->crossings[i];
        const struct dual near = face == DIPOLE_FACE_LIT ? slab->down : slab->up,
                          far = face == DIPOLE_FACE_LIT ? slab->up : slab->down;
        if (n == 0 && system->is_half_space) {
            front = base_front(slab, layer, k2);
            continue;
        }
        if (n == 0) {
            diagonal_add(&front.y, frequency->z[1 - face]);
        } else { /* the layer before sees slopes by s psi/n^2 */
            const size_t before = face == DIPOLE_FACE_LIT ? i + 1 : i - 1;
            struct dual ratio[N];
            for (int m = 0; m < N; m++)
                ratio[m] = scale(square(system->eta[before] / system->eta[i]),
                                 divide(frequency->s[i][m], frequency->s[before][m]));
            front.y = rows_scaled(ratio, &front.y);
        }
        if (x[0].unit.v == 1.0 && x[1].unit.v == 1.0 && x[2].unit.v == 1.0)
            pass_thin(layer, x, near, far, &front);
        else
            pass_thick(slab, layer, x, near, far, &front);
    }
    struct dual determinant, sum_out = constant(0.0);
    diagonal_add(&front.y, z);
    const struct matrix solved = inverse(&front.y, &determinant);
    *is_regular = front.is_regular && creal(determinant.v) > 0.0;
    row_turn(front.c, &solved);
    for (int m = 0; m < N; m++)
        sum_out = add(sum_out, scale(flux_weight[m], multiply(front.c[m], z[m])));
    return sum_out;
}

/* R^(k) and T^(k) for k^2, complex; the square roots take the branch with positive real part. */
void dipole_modes_solve(const struct system *system, double complex k2, struct dual out[2])
{
    struct frequency frequency;
    bool is_regular;
    frequency_init(system, k2, &frequency);
    out[DIPOLE_FACE_LIT] = leaving(system, &frequency, k2, DIPOLE_FACE_LIT, &is_regular);
    out[DIPOLE_FACE_FAR] = system->is_half_space
                               ? constant(0.0)
                               : leaving(system, &frequency, k2, DIPOLE_FACE_FAR, &is_regular);
}

/* ---- where the response is singular --------------------------------------------------------------- */

static bool is_below_first_singularity(const struct system *system, double kappa)
{
    struct frequency frequency;
    bool is_regular;
    frequency_init(system, -kappa * kappa, &frequency);
    leaving(system, &frequency, -kappa * kappa, DIPOLE_FACE_LIT, &is_regular);
    return is_regular;
}

/* For k^2 = -kappa^2 < 0 the slowest mode oscillates in the layers with q_1 < kappa: at most half a turn
 * below the first singularity, where a combination of the solutions is 0 in some depth, or meets the
 * condition at the top. Roots are taken of s_m, the base's q_1 and the faces' E, which bound it, too. */
double dipole_modes_first_singularity_per_mm(const struct system *system)
{
    double lo = INFINITY, hi = INFINITY;
    const size_t last = system->count - 1;
    for (size_t i = 0; i <= last; i++) {
        const double q_1 = sqrt(creal(system->mode_layers[i].q2[0].v));
        const bool is_base = i == last && system->is_half_space;
        lo = fmin(lo, q_1);
        hi = fmin(hi, is_base ? q_1
                              : (1.0 - 1e-13) * fmin(rate[0] * creal(system->slabs[i].sigma_t_prime.v),
                                                     hypot(q_1, PI / creal(system->slabs[i].thickness.v))));
        if (i == 0 || (i == last && !is_base))
            hi = fmin(hi, (1.0 - 1e-13) * creal(system->mode_faces[i == 0 ? 0 : 1].sigma_per_mm.v));
    }
    lo = fmin(lo, hi);
    if (is_below_first_singularity(system, hi))
        return hi;
    while (hi - lo > 1e-13 * hi && hi > 1e-200) {
        const double middle = lo > 0.5 * hi ? 0.5 * (lo + hi) : fmax(sqrt(lo) * sqrt(hi), 0.1 * hi);
        if (is_below_first_singularity(system, middle))
            lo = middle;
        else
            hi = middle;
    }
    return lo;
}
