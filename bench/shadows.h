/* What the measurements of soft shadows share: a scene that is drawn, and what rays say of its pixels. */
#ifndef BENCH_SHADOWS_H
#define BENCH_SHADOWS_H

#include "plot/plot.h"
#include "renderer/reference_trace.h"
#include "renderer/renderer.h"

struct bench_shadows {
    struct io_scene *scene;
    struct renderer *renderer;
    int width_px, height_px;
    float *shadow, *position_mm, *normal; /* of the picture that was drawn last, four for each pixel */
    double *truth;                        /* three for each pixel */
    struct render_casters casters;        /* what light comes through, as rays know it and as it is drawn */
    struct render_tracer *tracer;
};

/* Fails as a scene's reading and the renderer do. End it in every case. */
DIPOLE_CHECKED bool bench_shadows_begin(const char *path, int width_px, int height_px,
                                        struct bench_shadows *bench, dipole_status *status);
void bench_shadows_end(struct bench_shadows *bench);

/* Whether an effect is one of shadows. */
bool bench_shadows_has(const char *effect);

/* Draw the shadows run_count times, and read them; the least time of the shadows' effects. */
DIPOLE_CHECKED bool bench_shadows_draw(struct bench_shadows *bench,
                                       const struct render_shadow_options *options, int run_count,
                                       double *ms_out, dipole_status *status);

/* Rays through the scene as it is now; end them in every case. */
DIPOLE_CHECKED bool bench_shadows_begin_rays(struct bench_shadows *bench, dipole_status *status);
void bench_shadows_end_rays(struct bench_shadows *bench);

/* What place_count points of the first light leave at a pixel of the picture that was drawn last. */
void bench_shadows_trace(const struct bench_shadows *bench, int pixel, int place_count, double left[3]);
/* The same of all pixels, into truth. */
DIPOLE_CHECKED bool bench_shadows_trace_all(struct bench_shadows *bench, int place_count,
                                            dipole_status *status);

/* Cosine between a pixel's normal and the way to the middle of the first light; 0 where it looks away or
 * shows nothing. */
double bench_shadows_cosine(const struct bench_shadows *bench, int pixel);

/* Relative to the root mean square of the truth, over pixels that the light may reach: of the factor, and
 * of the factor times the cosine. */
struct bench_shadows_error {
    double factor, irradiance;
};
struct bench_shadows_error bench_shadows_compare(const struct bench_shadows *bench);

/* A scene's file name without "shadow_" and ".json"; valid for some calls. */
const char *bench_shadows_name(const char *path);

/* To STEM_NAME.svg. */
DIPOLE_CHECKED bool bench_write_plot(const struct plot *plot, const char *stem, const char *name,
                                     dipole_status *status);

/* The parts: each prints rows of Markdown. */
DIPOLE_CHECKED bool bench_shadows_edges(const char *stem, dipole_status *status);
DIPOLE_CHECKED bool bench_shadows_scenes(char *const *paths, int count, const char *stem,
                                         dipole_status *status);
DIPOLE_CHECKED bool bench_shadows_taps(char *const *paths, int count, dipole_status *status);
DIPOLE_CHECKED bool bench_shadows_costs(char *const *paths, int count, dipole_status *status);
DIPOLE_CHECKED bool bench_shadows_flicker(const char *path, const char *title, const char *stem,
                                          dipole_status *status);

#endif
