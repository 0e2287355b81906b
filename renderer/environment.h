/*
 * Light from all around: a map of radiance by latitude and longitude, its spherical harmonics, and the
 * irradiance that enters a surface by its normal. Pure C: no OpenGL here. theory.md T50 to T52.
 */
#ifndef RENDERER_ENVIRONMENT_H
#define RENDERER_ENVIRONMENT_H

#include "io/exr.h"
#include "io/scene_file.h"
#include "renderer/harmonics.h"

/* Largest width of a map; its height is half of it. */
enum { RENDER_ENVIRONMENT_SIDE_LIMIT = 8192 };

/* Maps are written with small negatives by filters: they count as 0. Where they are more than this part of
 * the light something else is wrong. */
#define RENDER_ENVIRONMENT_NEGATIVE_LIMIT 0.01

/* More than any light; what is summed of less stays within single precision. */
#define RENDER_ENVIRONMENT_RADIANCE_LIMIT 1e30

/*
 * A map, scaled and turned, immutable. The pixel in column x and row y is a patch of the sphere of uniform
 * radiance: latitudes from the top, +y, down; longitudes as OpenEXR has them, +z in the middle of the map
 * and +x left of it, the way they are seen from inside. End it with render_environment_destroy.
 */
struct render_environment {
    int width_px, height_px;
    float *radiance;           /* x 3, rows from the top, scaled; in W/(mm^2 sr)          */
    double rgb[3], rotate_rad; /* that it was scaled by and turned                        */
    double mean[3];            /* of the radiance over the sphere                          */
    struct render_harmonics harmonics;
    double (*coefficients)[3];                  /* L_lm, RENDER_HARMONIC_COUNT of them           */
    double power[RENDER_HARMONIC_LIMIT + 1][3]; /* sum over m of L_lm^2                          */
    double rest[3];                             /* the same of all higher orders together        */
};

/*
 * Take a picture of radiance, of 1, 3 or 4 channels, alpha ignored. image is left as it is; place is what
 * messages name. Fails with DIPOLE_BAD_VALUE: not twice as wide as high, too large, not finite, brighter
 * than RENDER_ENVIRONMENT_RADIANCE_LIMIT, or negative by more than RENDER_ENVIRONMENT_NEGATIVE_LIMIT.
 */
DIPOLE_CHECKED bool render_environment_create(const struct io_image *image, const double rgb[3],
                                              double rotate_rad, const dipole_place *place,
                                              struct render_environment **environment_out,
                                              dipole_status *status);
void render_environment_destroy(struct render_environment *environment);

/* Read the scene's map: EXR of any compression, or HDR; its size is known before memory is taken. Fails as
 * above, or where the file cannot be read. */
DIPOLE_CHECKED bool render_environment_read(const struct io_environment *source,
                                            struct render_environment **environment_out,
                                            dipole_status *status);

/* Where light comes from and what there is; false where a map is black. */
bool render_environment_shines(const struct render_environment *environment);

/* Unit vector toward the place (x, y) of the map in pixels from its top left corner, turned. */
void render_environment_direction(const struct render_environment *environment, double x, double y,
                                  double direction[3]);

/*
 * The zonal coefficients of F_t(mu) mu, mu > 0, as factors of a convolution: transfer[l] is
 * sqrt(4 pi / (2 l + 1)) t_l = 2 pi int F_t mu P_l dmu. square is the integral of the kernel's square over
 * the sphere. theory.md T50.
 */
struct render_kernel {
    double transfer[RENDER_HARMONIC_LIMIT + 1], square;
};
void render_kernel_init(double eta, struct render_kernel *kernel);

/* Irradiance that enters, by the normal: theory.md T52. Immutable. */
struct render_irradiance {
    const struct render_environment *environment;
    double eta;
    int order;
    double error;              /* what higher orders add, root mean square, by the mean irradiance */
    double mean[3];            /* over all normals, in W/mm^2                                     */
    double (*coefficients)[3]; /* transfer[l] L_lm up to order                                    */
};

/* What orders above this one add, root mean square over all normals, by the mean irradiance: exact up to
 * RENDER_HARMONIC_LIMIT, of all beyond a bound. */
double render_irradiance_error(const struct render_environment *environment,
                               const struct render_kernel *kernel, int order);

/* The lowest order whose error is at most epsilon, or RENDER_HARMONIC_LIMIT. The environment must outlive
 * it. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_irradiance_create(const struct render_environment *environment, double eta,
                                             double epsilon, struct render_irradiance **irradiance_out,
                                             dipole_status *status);
/* The same of a given order. */
DIPOLE_CHECKED bool render_irradiance_create_of_order(const struct render_environment *environment,
                                                      double eta, int order,
                                                      struct render_irradiance **irradiance_out,
                                                      dipole_status *status);
void render_irradiance_destroy(struct render_irradiance *irradiance);

/* At a unit normal, in W/mm^2, never below 0. */
void render_irradiance_at(const struct render_irradiance *irradiance, const double normal[3],
                          double rgb[3]);

#endif
