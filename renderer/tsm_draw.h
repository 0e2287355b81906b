/* What translucent shadow maps are gathered with: the state that their passes share between frames. */
#ifndef RENDERER_TSM_DRAW_H
#define RENDERER_TSM_DRAW_H

#include "renderer/execute.h"

struct render_tsm;

/* Its context must be current, here and below. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool render_tsm_create(const struct render_media *media, struct render_tsm **tsm_out,
                                      dipole_status *status);
void render_tsm_destroy(struct render_tsm *tsm);

/* Hand on the volume and the pattern of the medium of the map's object (tsm_volume, tsm_pattern); or its
 * sources and factors (tsm_sources, tsm_factors). Made when the medium first needs them. */
DIPOLE_CHECKED bool render_tsm_use_volume(const struct render_frame *frame, dipole_status *status);
DIPOLE_CHECKED bool render_tsm_use_sources(const struct render_frame *frame, dipole_status *status);

/* Hand on the positions of all vertices (tsm_vertices). */
DIPOLE_CHECKED bool render_tsm_use_vertices(const struct render_frame *frame, dipole_status *status);

/* Draw the map's object layer by layer, each what lies behind the last, and hand them on (tsm_layers). */
DIPOLE_CHECKED bool render_tsm_peel(const struct render_frame *frame, dipole_status *status);

/* Uniforms of common/tsm_map.glsl and of common/tsm_response.glsl. */
void render_tsm_set_map(const struct render_frame *frame);
void render_tsm_set_response(const struct render_frame *frame);

/* Sources of the map's medium, of all channels, once it has been asked for them. */
int render_tsm_source_count(const struct render_frame *frame);

/* For decide(): why technique tsm has nothing to do, or NULL. */
const char *render_tsm_idle_reason(const struct render_request *request, const struct render_plan *plan);
/* The same of effects that work with the samples of the pattern. */
const char *render_tsm_unsampled_reason(const struct render_request *request,
                                        const struct render_plan *plan);

#endif
