/* One effect per file of passes/. */
#ifndef RENDERER_EFFECTS_H
#define RENDERER_EFFECTS_H

#include "renderer/plan.h"

extern const struct render_effect render_effect_surface;
extern const struct render_effect render_effect_object_ids;
extern const struct render_effect render_effect_light_view;
extern const struct render_effect render_effect_light_samples;
extern const struct render_effect render_effect_specular;
extern const struct render_effect render_effect_lambert;
extern const struct render_effect render_effect_splat;
extern const struct render_effect render_effect_overlap;
extern const struct render_effect render_effect_composite;
extern const struct render_effect render_effect_capture;
extern const struct render_effect render_effect_tone_map;

#endif
