/* One effect per file of passes/. */
#ifndef RENDERER_EFFECTS_H
#define RENDERER_EFFECTS_H

#include "renderer/plan.h"

extern const struct render_effect render_effect_deform;
extern const struct render_effect render_effect_motion;
extern const struct render_effect render_effect_surface;
extern const struct render_effect render_effect_object_ids;
extern const struct render_effect render_effect_light_layers;
extern const struct render_effect render_effect_light_view;
extern const struct render_effect render_effect_light_picture;
extern const struct render_effect render_effect_shadow_map;
extern const struct render_effect render_effect_avsm_colour;
extern const struct render_effect render_effect_avsm;
extern const struct render_effect render_effect_soft_shadow;
extern const struct render_effect render_effect_shadow_nearest;
extern const struct render_effect render_effect_shadow;
extern const struct render_effect render_effect_light_shadow;
extern const struct render_effect render_effect_coherence;
extern const struct render_effect render_effect_light_samples;
extern const struct render_effect render_effect_specular;
extern const struct render_effect render_effect_lambert;
extern const struct render_effect render_effect_splat;
extern const struct render_effect render_effect_overlap;
extern const struct render_effect render_effect_gather;
extern const struct render_effect render_effect_gather_gl;
extern const struct render_effect render_effect_tsm_table;
extern const struct render_effect render_effect_tsm_exact;
extern const struct render_effect render_effect_tsm_light;
extern const struct render_effect render_effect_tsm_shadow_map;
extern const struct render_effect render_effect_tsm_avsm;
extern const struct render_effect render_effect_tsm_shadow_nearest;
extern const struct render_effect render_effect_tsm_shadow;
extern const struct render_effect render_effect_tsm_peel;
extern const struct render_effect render_effect_tsm_global;
extern const struct render_effect render_effect_tsm_local;
extern const struct render_effect render_effect_tsm_texels;
extern const struct render_effect render_effect_tsm_vertex;
extern const struct render_effect render_effect_environment;
extern const struct render_effect render_effect_ambient_visibility;
extern const struct render_effect render_effect_environment_samples;
extern const struct render_effect render_effect_environment_peel;
extern const struct render_effect render_effect_environment_lambert;
extern const struct render_effect render_effect_composite;
extern const struct render_effect render_effect_capture;
extern const struct render_effect render_effect_tone_map;

#endif
