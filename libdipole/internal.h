/* What the .c files of libdipole share; never installed. */
#ifndef LIBDIPOLE_INTERNAL_H
#define LIBDIPOLE_INTERNAL_H

#include "dual.h"
#include "libdipole/dipole.h"
#include "matrix.h"

#include <complex.h>
#include <math.h>

#define PI 3.14159265358979323846

static inline double square(double x)
{
    return x * x;
}

/* z_v - z_r = (4/3) A z_r, without the cancellation of subtracting. */
static inline double source_separation_mm(const dipole_coefficients *c)
{
    return 4.0 / 3.0 * c->boundary_a * c->z_r_mm;
}

/* hypot(z, r) - z, without the cancellation of subtracting. */
static inline double path_excess_mm(double z_mm, double r_mm)
{
    return r_mm * (r_mm / (hypot(z_mm, r_mm) + z_mm));
}

/* (1 - e^(-x)) / x for x >= 0, 1 at x = 0. */
static inline double decay_mean(double x)
{
    return x > 0.0 ? -expm1(-x) / x : 1.0;
}

/* A falling function of x > 0 and its derivative with respect to log x. */
typedef void falling_function(const void *context, double x, double *value, double *d_log_x);
/* Its root in [lo, hi], 0 < lo < hi, to rounding (sampling.c). */
double dipole_find_root(falling_function *function, const void *context, double lo, double hi);

/* C_2 = int_0^1 F(mu) mu^2 dmu for light inside (fresnel.c). T24 */
double dipole_fresnel_second_moment_inside(double eta);
/* Means of F and 1 - F over a range of squared cosines, for light inside; neither is 1 less the other. T29
 */
void dipole_fresnel_mean_inside(double eta, double cosine2_lo, double cosine2_hi, double *reflected,
                                double *transmitted);

/* What sources are made from (stack.c): the model; and kappa_1, with which the profile of the lit face
 * fades far out. T26 */
dipole_model dipole_stack_model(const dipole_stack *stack);
double dipole_stack_decay_per_mm(const dipole_stack *stack);

/* ---- one spatial frequency of a stack (layers.c) -------------------------------------------------- */

enum { SLAB_MOMENTS = 16 };

struct slab {
    struct dual sigma_s_prime, sigma_t_prime, diffusion, sigma_tr2, thickness;
    struct dual down, up; /* beams entering from above and from below, per unit that entered the stack */
    struct dual through;  /* e^(-sigma_t' thickness)                                                  */
    struct dual near_moments[SLAB_MOMENTS], far_moments[SLAB_MOMENTS]; /* of the fading beam            */
};

/* The modes of a layer (modes.c). T29 */
struct mode_layer {
    struct dual q2[MODE_COUNT];     /* q^2 of each at k = 0, ascending       */
    struct matrix basis;            /* column j: what mode j is in the psi_m */
    struct dual source[MODE_COUNT]; /* of each, for one unit of beam         */
};

enum { MODE_FACE_NODES = 16 };

/* F_m(0), 1 - F_m(0), and what F_m(k) needs. T29 */
struct mode_face {
    double reflected[MODE_COUNT], transmitted[MODE_COUNT];
    double share[MODE_COUNT]; /* g_m F_m(0)/S(0)                                     */
    struct dual sigma_per_mm; /* the unit of k                                       */
    size_t node_count;        /* of E; 0 where nothing is reflected                  */
    double from_normal[MODE_FACE_NODES], weight[MODE_FACE_NODES]; /* 1 - mu; over E(0) */
};

struct system {
    struct slab slabs[DIPOLE_LAYER_LIMIT];
    double eta[DIPOLE_LAYER_LIMIT];
    double a_top, a_bottom;
    size_t count;
    bool is_half_space;
    struct dual unscattered[2];                /* of the beam, by dipole_face */
    double multipole_a[DIPOLE_LAYER_LIMIT][2]; /* A of both faces of each layer (models.c). T25 */
    struct mode_layer mode_layers[DIPOLE_LAYER_LIMIT];
    struct mode_face mode_faces[2]; /* by dipole_face */
};

/* parameter: 3 * layer + 0, 1, 2 for d/d log sigma_a, sigma_s', thickness; negative for none. */
void dipole_system_init(struct system *system, const dipole_layer *layers,
                        const dipole_coefficients *coefficients, size_t count, int parameter);

/*
 * One finite layer at one frequency, x measured from the side the integral runs to, d - x from the other:
 * cosh qd and (sinh qd)/q; the integrals over the layer of the near beam, e^(-sigma_t' x), and of the far
 * beam, e^(-sigma_t' (d - x)), times cosh q(d - x) and (sinh q(d - x))/q. All times `unit`, which is 1 or,
 * in thick layers, e^(-qd).
 */
struct crossing {
    struct dual unit, cosh, sinh, near_cosh, near_sinh, far_cosh, far_sinh, q2;
};

struct crossing dipole_slab_cross(const struct slab *slab, struct dual q2);

/* R^ and T^ at k^2, complex, by dipole_face: the beam model. T23 */
void dipole_system_solve(const struct system *system, double complex k2, struct dual out[2]);
/* The smallest kappa where R^ and T^ are singular at k^2 = -kappa^2; sigma_tr of the base at most. */
double dipole_system_first_singularity_per_mm(const struct system *system);

/* ---- exponential modes (modes.c) ------------------------------------------------------------------ */

/* What a system needs besides, its own parameter's derivatives included. T29 */
void dipole_modes_init(struct system *system);
void dipole_modes_solve(const struct system *system, double complex k2, struct dual out[2]);
double dipole_modes_first_singularity_per_mm(const struct system *system);

/* ---- the papers' models at one spatial frequency (models.c) --------------------------------------- */

/* d'Eon's better dipole; a half-space. T24 */
void dipole_better_dipole_solve(const struct system *system, double complex k2, struct dual out[2]);
/* Donner and Jensen's multipole and their combination of layers. T25 */
void dipole_multipole_init(struct system *system);
void dipole_multipole_solve(const struct system *system, double complex k2, struct dual out[2]);
double dipole_multipole_first_singularity_per_mm(const struct system *system);

/* ---- inverse Hankel transforms (hankel.c) --------------------------------------------------------- */

/* One face of a model: F at k^2, and what is known of it. */
typedef double complex hankel_function(const void *context, double complex k2);

struct hankel_input {
    hankel_function *response;
    const void *context;
    double singularity_per_mm; /* the smallest kappa where F is singular at k^2 = -kappa^2             */
    bool is_cut;               /* it is the beginning of a cut, F being analytic in q of the base      */
    double r_min_mm;           /* smallest radius                                                      */
    double extent_mm;          /* of all that is not the base, and its mean free path                  */
};

/* kappa = scale cosh(t + i angle), for radii from r_from_mm on. */
struct hankel_contour {
    double scale, angle, step;
    double vertex, log_response; /* where it leaves the real axis, and F there */
    double kappa_low;            /* below it the terms are nothing             */
    double r_from_mm;
    size_t first, count; /* its nodes */
};

/* (1/2 pi) int F(k) J_0(kr) k dk = sum_j Im [term_j K_0(kappa_j r)], term = weight F(-kappa^2). */
struct hankel_node {
    double complex kappa, log_kappa, weight, term;
};

enum { HANKEL_CONTOURS = 40 };

struct hankel {
    struct hankel_contour contours[HANKEL_CONTOURS];
    size_t contour_count; /* 0 if nothing leaves by this face */
    double r_far_mm;      /* from here on the profile falls as r^-3 */
    struct hankel_node *nodes;
    size_t node_count, node_limit;
};

/* False without memory. dipole_hankel_clear() ends it. */
bool dipole_hankel_init(struct hankel *hankel, const struct hankel_input *input);
void dipole_hankel_clear(struct hankel *hankel);
/* The profile at a radius and the power beyond and within it; r_min_mm <= r_mm < infinity. */
double dipole_hankel_profile(const struct hankel *hankel, double r_mm);
double dipole_hankel_beyond(const struct hankel *hankel, double r_mm);
double dipole_hankel_within(const struct hankel *hankel, double r_mm);
/* What the sums run over, for others to do it: the contour for a radius, NULL where all has underflown; k^2
 * at a node; whether the node matters for a radius; and by how much the profile falls from r_far_mm to
 * r_mm. */
const struct hankel_contour *dipole_hankel_contour_for(const struct hankel *hankel, double r_mm);
bool dipole_hankel_is_needed(const struct hankel_contour *contour, const struct hankel_node *node,
                             double r_mm);
double dipole_hankel_far_factor(const struct hankel *hankel, double r_mm);

/* ---- Bessel functions (bessel.c) ------------------------------------------------------------------ */

/* K_0(z), z K_1(z) and 1 - z K_1(z) for |arg z| <= pi/4, z not 0, given log z; relative error below 1e-14,
 * for large z times |z|/16. */
double complex dipole_bessel_k0(double complex z, double complex log_z);
double complex dipole_bessel_zk1(double complex z, double complex log_z);
double complex dipole_bessel_zk1_complement(double complex z, double complex log_z);

#endif
