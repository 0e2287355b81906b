/*
 * libdipole: how light spreads under the surface of translucent materials.
 *
 * Diffusion profiles of a half-space and the numbers a renderer derives from them. Pure functions of
 * their arguments: no globals, no allocation, no I/O; safe to call from any number of threads.
 *
 * Units: lengths in mm, coefficients in 1/mm. One colour channel at a time. Formulas are numbered as in
 * docs/theory.md (T1, T2, ...).
 */
#ifndef DIPOLE_H
#define DIPOLE_H

#include <stdbool.h>
#include <stddef.h>

#define DIPOLE_VERSION_MAJOR 0
#define DIPOLE_VERSION_MINOR 1
#define DIPOLE_VERSION_PATCH 0
#define DIPOLE_VERSION "0.1.0"

#if defined(__GNUC__)
#define DIPOLE_API __attribute__((visibility("default")))
#define DIPOLE_CHECKED __attribute__((warn_unused_result))
#define DIPOLE_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define DIPOLE_API
#define DIPOLE_CHECKED
#define DIPOLE_PRINTF(text, first)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- failure ------------------------------------------------------------------------------------ */

typedef enum dipole_code {
    DIPOLE_OK = 0,
    DIPOLE_BAD_VALUE,  /* an argument or a field of a file is outside its range    */
    DIPOLE_BAD_SYNTAX, /* a file cannot be parsed                                  */
    DIPOLE_NOT_FOUND,  /* a file, key or device does not exist                     */
    DIPOLE_IO_FAILED,  /* the system refused to read or write                      */
    DIPOLE_OUT_OF_MEMORY,
    DIPOLE_NOT_SUPPORTED, /* legal, but this build or machine cannot do it            */
    DIPOLE_NOT_CONVERGED,
} dipole_code;

/* Why a call failed. Written on failure only; the caller owns it. */
typedef struct dipole_status {
    dipole_code code;
    int line, column;  /* counted from 1; 0 when there is none     */
    char source[128];  /* file that was read, or ""                */
    char message[384]; /* what was found, and what was expected    */
} dipole_status;

/* A place in a file, for messages. */
typedef struct dipole_place {
    const char *source;
    int line, column;
} dipole_place;

/*
 * Fill *status (may be NULL) with code, place (may be NULL) and a printf message.
 * Always returns false, so that a failing function can return it.
 */
DIPOLE_API bool dipole_fail(dipole_status *status, dipole_code code, const dipole_place *place,
                            const char *format, ...) DIPOLE_PRINTF(4, 5);

#ifdef __clang_analyzer__ /* which cannot see that the result is always false */
#define dipole_fail(...) (dipole_fail(__VA_ARGS__), false)
#endif

/* Version of the library that is linked: "major.minor.patch". */
DIPOLE_API const char *dipole_version(void);

/* ---- Fresnel ------------------------------------------------------------------------------------ */

/* Where the diffuse Fresnel reflectance inside the surface, Fdr, comes from. */
typedef enum dipole_fdr_kind {
    DIPOLE_FDR_EXACT = 0,  /* 2 int F(mu) mu dmu, by quadrature; theory.md T2        */
    DIPOLE_FDR_POLYNOMIAL, /* Egan and Hilgeman's fit, as the papers use; T3         */
} dipole_fdr_kind;

/*
 * Unpolarised Fresnel reflectance of a smooth surface. theory.md T1.
 *
 *   eta      index on the far side over index on the side the light comes from, > 0
 *   cosine   of the angle of incidence, 0 to 1
 *   returns  0 to 1 (1 under total reflection); NaN outside the ranges
 */
DIPOLE_API double dipole_fresnel_reflectance(double eta, double cosine);

/* Schlick's approximation to the same; for eta < 1 with the refracted cosine, so that total reflection
 * is kept. theory.md T1. */
DIPOLE_API double dipole_fresnel_reflectance_schlick(double eta, double cosine);

/*
 * Diffuse reflectance of the surface for light that comes from inside the medium,
 * Fdr = 2 int_0^1 F(mu) mu dmu. theory.md T2.
 *
 *   eta      index inside over outside, DIPOLE_ETA_MIN to DIPOLE_ETA_MAX
 *   returns  0 (eta = 1) to 1, relative error of both Fdr and 1 - Fdr below 1e-14; NaN outside the range
 */
DIPOLE_API double dipole_fdr_exact(double eta);

/* 1 - Fdr of the same, without cancellation where Fdr is near 1. theory.md T2. */
DIPOLE_API double dipole_fdt_exact(double eta);

/* Egan and Hilgeman's fit of Fdr. theory.md T3. Off by up to 0.0017 for eta in 0.7 to 2.2, jumps at
 * eta = 1, and leaves 0..1 outside about 0.27..3.8; the caller judges. NaN if eta is not > 0. */
DIPOLE_API double dipole_fdr_polynomial(double eta);

/* Diffuse transmittance of the surface for light that comes from outside, 2 int_0^1 (1 - F) mu dmu:
 * what normalises radiance leaving by Fresnel-weighted directions. theory.md T2, T14. */
DIPOLE_API double dipole_fdt_outside(double eta);

/* ---- media -------------------------------------------------------------------------------------- */

/* Legal ranges. Coefficients are 0 or in [MIN, MAX]; distances in [0, MAX]. */
#define DIPOLE_SIGMA_MIN_PER_MM 1e-50
#define DIPOLE_SIGMA_MAX_PER_MM 1e50
#define DIPOLE_THICKNESS_MIN_MM 1e-50
#define DIPOLE_THICKNESS_MAX_MM 1e50
#define DIPOLE_EPSILON_MIN 1e-100
#define DIPOLE_ETA_MIN 0.1
#define DIPOLE_ETA_MAX 10.0

/* One homogeneous medium in one colour channel. */
typedef struct dipole_medium {
    double sigma_a_per_mm;       /* absorption, >= 0                              */
    double sigma_s_prime_per_mm; /* reduced scattering, >= 0; not 0 with sigma_a  */
    double eta;                  /* index inside over outside, 0.1 to 10          */
    dipole_fdr_kind fdr_kind;
} dipole_medium;

/* What every dipole formula needs, derived once. Read it freely; fill it by dipole_coefficients_init. */
typedef struct dipole_coefficients {
    double sigma_a_per_mm, sigma_s_prime_per_mm, eta;   /* as given                          */
    double sigma_t_prime_per_mm;                        /* sigma_a + sigma_s'                */
    double alpha_prime;                                 /* sigma_s' / sigma_t', 0 to 1       */
    double mean_free_path_mm;                           /* 1 / sigma_t'                      */
    double sigma_tr_per_mm;                             /* sqrt(3 sigma_a sigma_t')          */
    double fdr;                                         /* internal diffuse reflectance      */
    double boundary_a;                                  /* A = (1 + Fdr) / (1 - Fdr)         */
    double z_r_mm, z_v_mm;                              /* depth of real, height of virtual source */
    double sigma_tr_low_per_mm, z_r_low_mm, z_v_low_mm; /* what rounding took from these three        */
} dipole_coefficients;

/*
 * Derive what every dipole formula needs. theory.md T4.
 * The one place where a medium is checked: fails with DIPOLE_BAD_VALUE, naming the field, its value and
 * its range; *out is then untouched.
 */
DIPOLE_API DIPOLE_CHECKED bool dipole_coefficients_init(const dipole_medium *medium,
                                                        dipole_coefficients *out, dipole_status *status);

/* ---- the dipole --------------------------------------------------------------------------------- */

/*
 * Diffuse reflectance R_d(r). theory.md T5; Jensen et al. 2001.
 *
 *   r_mm     distance from where the light entered, >= 0
 *   returns  power leaving per mm^2 for one unit of power entering, in 1/mm^2; >= 0 and falling with
 *            r_mm; 0 where the true value underflows; NaN if r_mm is negative or NaN
 */
DIPOLE_API double dipole_rd_per_mm2(const dipole_coefficients *coefficients, double r_mm);

/* The same at count radii, several times faster a radius; relative error below 3e-16 (8 + x), with
 * x = sigma_tr r. */
DIPOLE_API void dipole_rd_profile_per_mm2(const dipole_coefficients *coefficients, const double *r_mm,
                                          size_t count, double *values);

/* Derivatives of R_d(r) with respect to log sigma_a and log sigma_s', eta held. theory.md T12.
 * Both are finite at sigma_a = 0 and at sigma_s' = 0 (there they are 0). */
typedef struct dipole_gradient {
    double d_log_sigma_a, d_log_sigma_s_prime; /* in the unit of the quantity itself */
} dipole_gradient;

DIPOLE_API dipole_gradient dipole_rd_gradient(const dipole_coefficients *coefficients, double r_mm);

/* The same with respect to sigma_a and sigma_s' themselves, in 1/mm; finite at sigma_a = 0, where the chain
 * rule through log sigma_a would be 0/0. theory.md T12. */
typedef struct dipole_derivative {
    double d_sigma_a, d_sigma_s_prime;
} dipole_derivative;

DIPOLE_API dipole_derivative dipole_rd_derivative(const dipole_coefficients *coefficients, double r_mm);

/*
 * R_d and its derivatives with respect to log sigma_a and log sigma_s' at count radii, each an array of
 * count doubles. For fits: many times faster than one by one, where every digit is kept even if terms
 * cancel. Here, with x = sigma_tr r, R_d errs by 3e-16 (8 + x) of itself and a derivative by 6e-16 (8 + x)
 * (2 + x) R_d, or by 1e-300 per mm^2.
 */
DIPOLE_API void dipole_rd_profile_gradient(const dipole_coefficients *coefficients, const double *r_mm,
                                           size_t count, double *values, double *d_log_sigma_a,
                                           double *d_log_sigma_s_prime);

/* Total diffuse reflectance, the integral of R_d over the plane, 0 to 1. theory.md T6. */
DIPOLE_API double dipole_diffuse_reflectance(const dipole_coefficients *coefficients);

/* Its derivatives. theory.md T12. */
DIPOLE_API dipole_gradient dipole_diffuse_reflectance_gradient(const dipole_coefficients *coefficients);

/* Power leaving within r_mm of where the light entered, 0 to the total; no digits are lost at small
 * r_mm. theory.md T7. NaN if r_mm is negative or NaN. */
DIPOLE_API double dipole_reflectance_within(const dipole_coefficients *coefficients, double r_mm);

/* Mean of R_d over the ring r_lo_mm..r_hi_mm, in 1/mm^2, without cancellation for thin rings. T7.
 * r_lo_mm = r_hi_mm gives R_d there; NaN unless 0 <= r_lo_mm <= r_hi_mm. */
DIPOLE_API double dipole_rd_ring_mean_per_mm2(const dipole_coefficients *coefficients, double r_lo_mm,
                                              double r_hi_mm);

/* Part of the total that leaves beyond r_mm, 1 at 0 and falling to 0; no digits are lost at large r_mm.
 * theory.md T8. Does not depend on alpha' other than through sigma_tr, so it is defined at sigma_s' = 0. */
DIPOLE_API double dipole_tail_fraction(const dipole_coefficients *coefficients, double r_mm);

/* Radius of the disc beyond which a part epsilon (1e-100 <= epsilon < 1) of the light leaves: the root of
 * T8, relative error below 1e-12. theory.md T9. NaN outside the range. */
DIPOLE_API double dipole_r_max_mm(const dipole_coefficients *coefficients, double epsilon);

/* Two-dimensional Fourier transform of R_d at k_per_mm (rad/mm, >= 0); the total at 0. theory.md T10. */
DIPOLE_API double dipole_spectrum(const dipole_coefficients *coefficients, double k_per_mm);

/* Spacing h of a square grid of light samples whose aliasing is at most epsilon of the
 * total: 4 spectrum(2 pi / h) = epsilon spectrum(0). theory.md T11. epsilon 1e-100 to below 4; NaN outside.
 * Like r_max it does not depend on alpha' otherwise, so it is defined at sigma_s' = 0. */
DIPOLE_API double dipole_splat_spacing_mm(const dipole_coefficients *coefficients, double epsilon);

/* ---- layers and models -------------------------------------------------------------------------- */

/* How light spreads under the surface. */
typedef enum dipole_model {
    DIPOLE_MODEL_DIPOLE = 0,    /* Jensen et al. 2001; a half-space; T5                              */
    DIPOLE_MODEL_BETTER_DIPOLE, /* d'Eon 2012; a half-space; T24                                     */
    DIPOLE_MODEL_MULTIPOLE,     /* Donner and Jensen 2005; layers thicker than one mean free path; T25 */
    DIPOLE_MODEL_BEAM,          /* extended source, partial-current boundary; any layers; T22, T23   */
    DIPOLE_MODEL_MODES,         /* three exponential modes, surfaces by Fresnel (fdr_kind is ignored); any
                                   layers; T29                                                       */
} dipole_model;

/* One layer, top first. thickness_mm: 1e-50 to 1e50, or INFINITY for the last (a half-space). */
typedef struct dipole_layer {
    dipole_medium medium;
    double thickness_mm;
} dipole_layer;

enum { DIPOLE_LAYER_LIMIT = 16 };

/* Where light leaves: through the face it entered, or the other. */
typedef enum dipole_face { DIPOLE_FACE_LIT = 0, DIPOLE_FACE_FAR } dipole_face;

/* Which side the light comes from: onto the first layer, or from below onto the last, which is then finite.
 */
typedef enum dipole_side { DIPOLE_FROM_ABOVE = 0, DIPOLE_FROM_BELOW } dipole_side;

/* A stack of layers in one colour channel, immutable: any number of threads may use one. */
typedef struct dipole_stack dipole_stack;

/*
 * Prepare count (1 to DIPOLE_LAYER_LIMIT) layers, light entering at normal incidence from one side.
 * The caller owns *stack_out and ends it with dipole_stack_destroy(). Fails with DIPOLE_BAD_VALUE (naming
 * layer, field, value and range), DIPOLE_NOT_SUPPORTED (the model cannot do these layers) or
 * DIPOLE_OUT_OF_MEMORY; *stack_out is then NULL.
 */
DIPOLE_API DIPOLE_CHECKED bool dipole_stack_create(const dipole_layer *layers, size_t count,
                                                   dipole_model model, dipole_side side,
                                                   dipole_stack **stack_out, dipole_status *status);
DIPOLE_API void dipole_stack_destroy(dipole_stack *stack);

/* What layer was given, and what was derived from it; index below the count, from the top. */
DIPOLE_API const dipole_layer *dipole_stack_layer(const dipole_stack *stack, size_t index);
DIPOLE_API const dipole_coefficients *dipole_stack_coefficients(const dipole_stack *stack, size_t index);
DIPOLE_API size_t dipole_stack_layer_count(const dipole_stack *stack);

/* Part of the light that entered which leaves by a face after scattering, 0 to 1; the far face of a
 * half-space has 0. theory.md T6, T22 to T25, T29. */
DIPOLE_API double dipole_stack_total(const dipole_stack *stack, dipole_face face);

/* Part that leaves without scattering, straight through or mirrored inside. Models beam and modes only,
 * else 0. T23 */
DIPOLE_API double dipole_stack_unscattered(const dipole_stack *stack, dipole_face face);

/* Spatial spectrum at k_per_mm (rad/mm, >= 0), the total at 0. T10, T22 to T25. */
DIPOLE_API double dipole_stack_spectrum(const dipole_stack *stack, dipole_face face, double k_per_mm);

/*
 * Profile: power leaving per mm^2 at each of count radii, for one unit of power entering, in 1/mm^2.
 *
 *   r_mm     distances, >= 0; values is count doubles, NaN where r_mm is negative or NaN
 *   Of a half-space of the dipole the error is that of dipole_rd_profile_per_mm2(), of the beam model 8
 * units in the last place (T22); of all else 1e-10 of the value at r = 0, of the modes 1e-9 (T26, T29). The
 * beam model has an integrable logarithm at r = 0, the modes an integrable 1/r: below 1e-9 of the shortest
 * mean free path the value there is continued.
 */
DIPOLE_API void dipole_stack_profile_per_mm2(const dipole_stack *stack, dipole_face face,
                                             const double *r_mm, size_t count, double *values);

/* Mean of the profile over the ring r_lo_mm..r_hi_mm, in 1/mm^2; the profile itself where they are equal.
 */
DIPOLE_API double dipole_stack_ring_mean_per_mm2(const dipole_stack *stack, dipole_face face,
                                                 double r_lo_mm, double r_hi_mm);

/* Power leaving within and beyond r_mm, 0 to the total; of layers exact to 1e-12 of the total, of a
 * half-space neither loses digits where it is small. T22, T26 */
DIPOLE_API double dipole_stack_within(const dipole_stack *stack, dipole_face face, double r_mm);
DIPOLE_API double dipole_stack_beyond(const dipole_stack *stack, dipole_face face, double r_mm);

/* Radius beyond which a part epsilon (1e-100 to below 1) of what the face sends out leaves. T9 */
DIPOLE_API double dipole_stack_r_max_mm(const dipole_stack *stack, dipole_face face, double epsilon);

/* Spacing of a square grid of light samples whose aliasing is at most epsilon (1e-100 to below 4) of what
 * the face sends out. T11. NaN outside the range. */
DIPOLE_API double dipole_stack_splat_spacing_mm(const dipole_stack *stack, dipole_face face,
                                                double epsilon);

/* Derivatives with respect to the logarithms of one layer's parameters; layer counts from the top. */
typedef struct dipole_stack_gradient {
    double d_log_sigma_a, d_log_sigma_s_prime, d_log_thickness;
} dipole_stack_gradient;

DIPOLE_API dipole_stack_gradient dipole_stack_total_gradient(const dipole_stack *stack, dipole_face face,
                                                             size_t layer);
DIPOLE_API void dipole_stack_profile_gradient(const dipole_stack *stack, dipole_face face, size_t layer,
                                              const double *r_mm, size_t count,
                                              dipole_stack_gradient *gradients);

/* ---- between two points of a surface ------------------------------------------------------------ */

/*
 * Where light enters a surface that is not flat, sources stand under that point, against the normal, and
 * their images above it; what arrives at another point follows from its distance to each. Translucent
 * shadow maps sum over these. theory.md T30.
 */
typedef struct dipole_source {
    double depth_mm; /* under the surface; negative for an image above it; never 0 */
    double weight;   /* > 0; of the dipole and the beam model alpha' times the part of the light */
    double sigma_tr_per_mm, sigma_tr_low_per_mm; /* how its light fades; low is what rounding took */
} dipole_source;

enum { DIPOLE_SOURCE_LIMIT = 128 };

/* Plain data, to copy and to keep. */
typedef struct dipole_sources {
    size_t count; /* 0 where nothing leaves by the lit face */
    dipole_source at[DIPOLE_SOURCE_LIMIT];
    double sigma_tr_per_mm;    /* the slowest decay of all, which is what is left far out */
    double max_relative_error; /* measured, of the profile of a flat surface, r_min_mm to r_max_mm */
} dipole_sources;

/*
 * The sources of what a stack sends out through its lit face. T30.
 *
 *   Of the dipole's half-space (the multipole's is the same) they are the model's own two, without error.
 * Of the beam model's half-space pairs of depth z and -z, a short sum for its line of sources, whose total
 * is exact. Of all else pairs that are fitted to the profile; the power within r_max_mm is exact.
 *
 *   epsilon             largest relative error of the profile of a flat surface, 1e-9 to 0.1
 *   r_min_mm, r_max_mm  where that holds: from 1e-6 of the first layer's mean free path on, and
 *                       r_max_mm > r_min_mm, at most 1e6 times it
 *
 * Fails with DIPOLE_BAD_VALUE; with DIPOLE_NOT_SUPPORTED where the beam model's sum would be longer than
 * DIPOLE_SOURCE_LIMIT; with DIPOLE_NOT_CONVERGED, naming what was reached, where a fit comes no nearer.
 * *out is then undefined. Allocates nothing; a fit takes half a megabyte of stack.
 */
DIPOLE_API DIPOLE_CHECKED bool dipole_sources_init(const dipole_stack *stack, double epsilon,
                                                   double r_min_mm, double r_max_mm, dipole_sources *out,
                                                   dipole_status *status);

/*
 * Power that leaves per mm^2 at out_mm for one unit that enters at in_mm through a surface with the unit
 * normal in_normal, in 1/mm^2. Over a flat surface it is the profile. Where the shape is thin or concave a
 * point can lie next to a source, and the profile would have no bound: nearer to a source than its own
 * depth z its part is continued with the same value and slope, level at the source, where it is (1 + b/2)
 * times what it is at distance z; b = (3 + x^2/(1 + x))/2, x = sigma_tr z. What that does to the energy is
 * in theory.md T30.
 */
DIPOLE_API double dipole_sources_between_per_mm2(const dipole_sources *sources, const double in_mm[3],
                                                 const double in_normal[3], const double out_mm[3]);

/*
 * The same at one distance |out_mm - in_mm| in count directions, for baking volumes. A value does not
 * depend on what else is asked for.
 *
 *   cosines  of the angle between in_normal and out_mm - in_mm, -1 (straight below) to 1
 *   values   count doubles, relative error below 3e-15 (8 + sigma_tr d), d the distance to the farthest
 *            source; NaN outside the ranges
 */
DIPOLE_API void dipole_sources_profile_per_mm2(const dipole_sources *sources, double distance_mm,
                                               const double *cosines, size_t count, double *values);

/*
 * Power that the same sends through a disc parallel to the surface, with its centre on the normal at
 * height_mm above the point of entry (negative: below, where light arrives at another side of a shape).
 *
 *   r_mm     of the disc, >= 0, may be INFINITY
 *   returns  its closed form, no digits lost at small r_mm: relative error below 3e-15 (8 + sigma_tr d);
 *            NaN outside the range
 */
DIPOLE_API double dipole_sources_within(const dipole_sources *sources, double height_mm, double r_mm);
/* The same of count discs, much faster a disc. */
DIPOLE_API void dipole_sources_within_many(const dipole_sources *sources, double height_mm,
                                           const double *r_mm, size_t count, double *values);

/* ---- media from reflectance and a length -------------------------------------------------------- */

/*
 * The medium of which a half-space sends diffuse_reflectance back, by the dipole or the beam model.
 * theory.md T28.
 *
 *   diffuse_reflectance        0 to 1; below 1 beside the diffuse mean free path
 *   mean_free_path_mm          1/sigma_t', 1e-50 to 1e50
 *   diffuse_mean_free_path_mm  1/sigma_tr, 1e-50 to 1e50: the other length that is called a "radius"
 *
 * The reflectance of *out is the one given to 1e-12, and so is what would be absorbed. Fails with
 * DIPOLE_BAD_VALUE, also where a coefficient of the medium would leave its legal range, or with
 * DIPOLE_NOT_SUPPORTED for other models; *out is then untouched.
 */
DIPOLE_API DIPOLE_CHECKED bool dipole_medium_from_mean_free_path(double diffuse_reflectance,
                                                                 double mean_free_path_mm, double eta,
                                                                 dipole_fdr_kind fdr_kind,
                                                                 dipole_model model, dipole_medium *out,
                                                                 dipole_status *status);
DIPOLE_API DIPOLE_CHECKED bool dipole_medium_from_diffuse_mean_free_path(
    double diffuse_reflectance, double diffuse_mean_free_path_mm, double eta, dipole_fdr_kind fdr_kind,
    dipole_model model, dipole_medium *out, dipole_status *status);

#ifdef __cplusplus
}
#endif
#endif
