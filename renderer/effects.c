#include "renderer/effects.h"

const struct render_effect *const render_effects[] = {
    &render_effect_object_ids, &render_effect_surface,
    &render_effect_light_view, &render_effect_light_samples,
    &render_effect_specular,   &render_effect_lambert,
    &render_effect_splat,      &render_effect_overlap,
    &render_effect_tsm_table,  &render_effect_tsm_exact,
    &render_effect_tsm_light,  &render_effect_tsm_peel,
    &render_effect_tsm_global, &render_effect_tsm_local,
    &render_effect_tsm_texels, &render_effect_tsm_vertex,
    &render_effect_composite,  &render_effect_capture,
    &render_effect_tone_map,   NULL,
};
