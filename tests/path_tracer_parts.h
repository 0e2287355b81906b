/* What the parts of the path tracer share: random numbers, the body as planes, light and camera. */
#ifndef PATH_TRACER_PARTS_H
#define PATH_TRACER_PARTS_H

#include "accuracy/batches.h"
#include "path_tracer.h"

#include <math.h>

#define TRACER_PI 3.14159265358979323846

static inline double tracer_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- random numbers ------------------------------------------------------------------------------- */

/* A point in the unit disc, uniform; returns its distance from the middle, squared, above 0. That is
 * uniform, too, and independent of the angle. */
double tracer_disc(struct accuracy_stream *stream, double point[2]);

/* A direction with this cosine to the axis, at the angle about it of a point in the disc. */
void tracer_turn(const double axis[3], double cosine, const double point[2], double r2, double out[3]);

/* ---- the body ------------------------------------------------------------------------------------- */

/* A box, or a half-space with planes at infinity; of a sphere the middle and the radius. */
struct tracer_shape {
    bool is_sphere;
    double centre_mm[3], radius_mm;
    double planes_mm[TRACER_FACES];
};

/* From a point within along a unit vector to the surface; *face is what is met. Infinite where nothing is.
 */
static inline double tracer_distance_mm(const struct tracer_shape *shape, const double p_mm[3],
                                        const double direction[3], int *face)
{
    if (shape->is_sphere) {
        double along = 0, r2 = 0;
        for (int k = 0; k < 3; k++) {
            const double x = p_mm[k] - shape->centre_mm[k];
            along += x * direction[k];
            r2 += x * x;
        }
        *face = 0;
        const double under = along * along + (shape->radius_mm * shape->radius_mm - r2);
        return fmax(sqrt(fmax(under, 0)) - along, 0);
    }
    double nearest = INFINITY;
    for (int k = 0; k < 3; k++) {
        if (direction[k] == 0)
            continue;
        const int met = 2 * k + (direction[k] > 0);
        const double distance = (shape->planes_mm[met] - p_mm[k]) / direction[k];
        if (distance < nearest) {
            nearest = distance;
            *face = met;
        }
    }
    return fmax(nearest, 0);
}

void tracer_shape_init(const struct tracer_body *body, struct tracer_shape *out);

/* The unit vector outward, at a point of the surface. */
void tracer_normal(const struct tracer_shape *shape, const double p_mm[3], int face, double normal[3]);

/* ---- light ------------------------------------------------------------------------------------------ */

struct tracer_lamp {
    struct tracer_light light; /* its direction is a unit vector, if it has one */
    double across[2][3];       /* unit vectors at right angles to it            */
};

/* Where light comes to the body. */
struct tracer_arrival {
    double p_mm[3], direction[3];
    int face;
    double power_w; /* what a photon stands for: the mean over many is the power that falls on the body */
};

void tracer_lamp_init(const struct tracer_light *light, struct tracer_lamp *out);
void tracer_lamp_sample(const struct tracer_lamp *lamp, const struct tracer_shape *shape,
                        struct accuracy_stream *stream, struct tracer_arrival *out);

/* Where a ray from outside first meets the body; false: it does not. */
bool tracer_meet(const struct tracer_shape *shape, const double from_mm[3], const double direction[3],
                 double p_mm[3], int *face);

/* What is wrong with what is asked; NULL: nothing. */
const char *tracer_find_fault(const struct tracer_scene *scene, const struct tracer_run *run,
                              const struct tracer_rings *rings);

/* ---- the camera ----------------------------------------------------------------------------------- */

/* A direction inside the medium that a face refracts toward an orthographic eye. */
struct tracer_connection {
    int face;
    double direction[3];
    double reflected[3]; /* of light that travels this way, at faces across each axis                */
    double radiance;     /* mean over a pixel, for 1 W/sr that comes to the face from within, and leaves */
};

struct tracer_camera {
    struct tracer_view view;
    double eta, exit_per_sr; /* 1/(pi T_out) of T14 */
    double right[3], up[3], forward[3];
    double half_width, half_height, pixel_area; /* in mm, mm^2, or at distance 1 */
    double cone_cosine, cone_sine2;
    struct tracer_connection connections[3];
    int connection_count;
};

/* A scene that has been checked. */
void tracer_camera_init(const struct tracer_scene *scene, struct tracer_camera *out);

/* Add to the picture what leaves with a power at a point; outward is the direction in which it leaves. */
void tracer_camera_add(const struct tracer_camera *camera, const double p_mm[3], const double normal[3],
                       const double outward[3], double power_w, double *picture);

/* Henyey and Greenstein's phase function, per sr. */
double tracer_phase_per_sr(double g, double cosine);

/* Join a scattering at p_mm to the eye: light came along direction, power_w leaves it. */
void tracer_camera_connect(const struct tracer_camera *camera, const struct tracer_shape *shape,
                           const struct tracer_medium *medium, const double p_mm[3],
                           const double direction[3], double power_w, struct accuracy_stream *stream,
                           double *picture);

/*
 * Irradiance from a cone of radiance 1 about a direction with this cosine to the normal, as far as it is
 * above the surface: the integral of the cosine over it. 0 <= cosine <= 1, sine2 that of the cone's half
 * angle, at most 1/2.
 */
double tracer_cone_flux(double cosine, double sine2);

#endif
