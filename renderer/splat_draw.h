/* Draws the light samples of every medium as splats: the state that its passes share between frames. */
#ifndef RENDERER_SPLAT_DRAW_H
#define RENDERER_SPLAT_DRAW_H

#include "renderer/execute.h"

struct render_splatter;

/* Its context must be current, here and below. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_splatter_create(const struct render_media *media,
                                           struct render_splatter **splatter_out, dipole_status *status);
void render_splatter_destroy(struct render_splatter *splatter);

/* Forget the samples of the frame before. */
void render_splatter_begin(struct render_splatter *splatter);

/* Forget the samples that were drawn; they stay counted. */
void render_splatter_drop_samples(struct render_splatter *splatter);

/* Reduce the light's view that was just drawn to samples. */
DIPOLE_CHECKED bool render_splatter_sample_view(struct render_splatter *splatter,
                                                const struct render_frame *frame, dipole_status *status);

/* Merge them band by band and draw them all, in one call. */
DIPOLE_CHECKED bool render_splatter_draw(struct render_splatter *splatter, const struct render_frame *frame,
                                         dipole_status *status);

/* The finest samples of a medium. */
/* Samples of a medium in one of its bands, as they were drawn last. */
const struct render_light_samples *render_splatter_band(const struct render_splatter *splatter,
                                                        size_t medium, int band);
struct render_light_samples *render_splatter_samples(struct render_splatter *splatter, size_t medium);
size_t render_splatter_sample_count(const struct render_splatter *splatter);
size_t render_splatter_splat_count(const struct render_splatter *splatter);

#endif
