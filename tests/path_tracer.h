/*
 * A Monte Carlo path tracer of light in one convex body, as independent truth: it knows the equation of
 * transfer and Fresnel's formulas, but nothing of diffusion. One colour channel at a time.
 *
 * A homogeneous medium with a smooth surface fills a sphere, a box or a half-space. Light refracts in,
 * walks at random and leaves by refraction; what leaves after at least one scattering makes the picture.
 * Light mirrored outside and light that passed unscattered are counted, but not in the picture.
 */
#ifndef PATH_TRACER_H
#define PATH_TRACER_H

#include "io/scene_file.h"

enum tracer_body_kind { TRACER_SPHERE = 0, TRACER_BOX, TRACER_HALF_SPACE };

/* A slab is a wide box. Its faces have numbers: 2 * axis, and 1 more at the positive end. A half-space is
 * all below y = centre_mm[1] and has face 3, a sphere has face 0. */
struct tracer_body {
    enum tracer_body_kind kind;
    double centre_mm[3];
    double radius_mm;       /* sphere, > 0      */
    double half_size_mm[3]; /* box, each > 0    */
};

enum { TRACER_FACES = 6, TRACER_TOP = 3 };

struct tracer_medium {
    double sigma_a_per_mm, sigma_s_per_mm; /* >= 0; in a half-space sigma_a > 0; sigma_s is not reduced */
    double g;                              /* mean cosine of Henyey and Greenstein, -1 < g < 1          */
    double eta;                            /* index inside over outside, 0.1 to 10                      */
};

enum tracer_light_kind { TRACER_DIRECTIONAL = 0, TRACER_POINT, TRACER_PENCIL };

struct tracer_light {
    enum tracer_light_kind kind;
    double direction[3];   /* directional, pencil: the way it travels, not 0                       */
    double position_mm[3]; /* point, pencil: where it starts, outside the body; a pencil meets it  */
    double strength;       /* > 0; directional: irradiance on a facing surface in W/mm^2; point:
                              intensity in W/sr; pencil: power in W. A half-space takes a pencil   */
};

/* How what leaves becomes radiance, in W/(mm^2 sr). */
enum tracer_estimator {
    TRACER_RADIOSITY = 0, /* power leaving per mm^2 times the diffuse exit of theory.md T14         */
    TRACER_ANGLE,         /* what leaves within cone_rad of the direction to the eye: its radiance,
                             averaged over that cone with the weight cosine to the normal; over all
                             directions such pictures hold 2/(1 + cos(cone_rad)) of the power       */
    TRACER_NEXT_EVENT,    /* exact: each scattering is joined to the eye, by way of reflections in
                             the faces, too; box or half-space, orthographic camera                 */
};

struct tracer_view {
    struct io_camera camera; /* at most 2^20 pixels; the eye of a perspective one is outside the body */
    enum tracer_estimator estimator;
    double cone_rad; /* TRACER_ANGLE: half the opening angle, above 0 and up to 0.5 */
};

struct tracer_scene {
    struct tracer_body body;
    struct tracer_medium medium;
    struct tracer_light light;
    const struct tracer_view *view; /* NULL: no picture is wanted */
};

/* Photons are traced in TRACER_BATCHES batches, each with random numbers of its own that follow from the
 * seed: results do not depend on thread_count. photon_count is rounded up to a multiple. */
struct tracer_run {
    size_t photon_count; /* 1 to 10^12                     */
    uint64_t seed;
    int thread_count; /* 0: as many as processors       */
};

enum { TRACER_BATCHES = 32 };

/* In W. incident = mirrored + absorbed + roulette + all scattered and unscattered, but for rounding. */
struct tracer_powers {
    double incident;                /* fell on the body                              */
    double mirrored;                /* by the surface, outside                       */
    double absorbed;                /* by the medium                                 */
    double roulette;                /* lost at Russian roulette: 0 in the mean       */
    double scattered[TRACER_FACES]; /* left through this face, scattered at least once */
    double unscattered[TRACER_FACES];
};

/* Scattered light by distance from where a pencil enters a face, through it and through the opposite one.
 */
struct tracer_rings {
    const double *edges_mm; /* count + 1, ascending, the first >= 0                */
    size_t count;           /* at most 4096                                        */
    double *front_per_mm2, *front_error, *back_per_mm2, *back_error; /* each count; W/mm^2 */
};

/* What a run gives. Every mean has a standard error from the spread of the batches (itself to 13 %). */
struct tracer_result {
    float *radiance, *radiance_error; /* the caller's, width x height, top row first; error may be NULL */
    struct tracer_rings *rings;       /* NULL: none are wanted; a box or half-space, and a pencil       */
    struct tracer_powers mean, error;
};

/*
 * Trace. The pointers of *result are set by the caller, radiance if and only if there is a view.
 * Fails with DIPOLE_BAD_VALUE where a value is outside the ranges above, or with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool tracer_trace(const struct tracer_scene *scene, const struct tracer_run *run,
                                 struct tracer_result *result, dipole_status *status);

/* Only the picture: width x height of the scene's view, each; standard_error may be NULL. */
DIPOLE_CHECKED bool tracer_picture(const struct tracer_scene *scene, size_t photon_count, uint64_t seed,
                                   int thread_count, float *radiance, float *standard_error,
                                   dipole_status *status);

#endif
