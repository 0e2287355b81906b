/* What a pixel of the reference sees, and the parts of its colour that need no sum over the surface. */
#ifndef RENDERER_REFERENCE_PIXEL_H
#define RENDERER_REFERENCE_PIXEL_H

#include "renderer/projection.h"
#include "renderer/reference_trace.h"

#include <stdint.h>

/* Rays through a pixel, a square of them. */
enum { RENDER_PIXEL_SIDE = 4, RENDER_PIXEL_RAYS = RENDER_PIXEL_SIDE * RENDER_PIXEL_SIDE };

/* What a pixel asks of an object's medium. */
struct render_pixel_medium {
    double eta, exit_scale_per_sr; /* 1 / (pi dipole_fdt_outside(eta))             */
    double group_mm;               /* points of a group are no farther from its first */
};

struct render_pixel_view {
    const struct io_scene *scene;
    const struct render_tracer *tracer;
    const struct render_pixel_medium *media; /* of each object */
    int light_place_count;                   /* that a light with a size is taken for */
    struct render_projection camera;
    int width_px, height_px;
};

/* Surface points of a pixel, of one object, within group_mm of the first. */
struct render_pixel_group {
    struct render_surface_point points[RENDER_PIXEL_RAYS];
    int count;
};

struct render_pixel {
    struct render_pixel_group groups[RENDER_PIXEL_RAYS];
    int group_count, hit_count;
};

/* Trace the rays of pixel (x, y), counted from the top left. */
void render_pixel_trace(const struct render_pixel_view *view, int x, int y, struct render_pixel *pixel);

/* Radiance toward the eye per radiosity. theory.md T14. */
double render_pixel_exit_per_sr(const struct render_pixel_view *view,
                                const struct render_surface_point *point);

/* Add light mirrored toward the eye at a point, from every light of the scene that reaches it. theory.md
 * T19. number: of the point, says which places of a light with a size it takes. */
void render_pixel_add_specular(const struct render_pixel_view *view,
                               const struct render_surface_point *point, uint64_t number,
                               double radiance[3]);

/*
 * What arrives at a point from a light without a size: unit vector toward the light; its irradiance per rgb
 * on a facing surface (1, or 1/mm^2 of a point light); what blockers leave of it. false where the point's
 * facet looks away, or an object is in the way.
 */
bool render_light_reaches(const struct render_tracer *tracer, const struct io_light *light,
                          const struct render_surface_point *point, double to_light[3], double *falloff_out,
                          double left[IO_CHANNEL_COUNT]);

/* Place index, 0 to render_light_places(light) - 1, of those that point number takes of a light, whose rgb
 * then is the place's. theory.md T66. */
int render_light_places(const struct io_light *light);
struct io_light render_light_place_of(const struct io_light *light,
                                      const struct render_surface_point *point, uint64_t number, int index,
                                      int place_count);

/* The mean over count places of a light of what reaches a point, per channel: its exact shadow factor. */
void render_light_left(const struct render_tracer *tracer, const struct io_light *light,
                       const struct render_surface_point *point, int count, double left[IO_CHANNEL_COUNT]);

/* Radiance over the background, to 0..1, linear. theory.md T20. */
void render_tone_map(const struct io_scene *scene, float rgba[4]);

#endif
