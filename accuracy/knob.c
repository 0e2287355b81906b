#include "accuracy/knob.h"

#include "accuracy/interior.h"
#include "io/half.h"
#include "renderer/gather.h"
#include "renderer/plan.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Everything but the knob is as fine as this asks for. */
#define FINE_EPSILON 0.003

#define COARSEST_EPSILON 0.3

/* ---- what scenes call for ----------------------------------------------------------------------- */

static const char *no_environment(const struct accuracy_subject *subject)
{
    return subject->scene->has_environment ? NULL : "the scene has no environment";
}

static const char *no_lamp(const struct accuracy_subject *subject)
{
    return subject->scene->light_count > 0 ? NULL : "the scene has no parallel or point light";
}

static const char *no_scattering(const struct accuracy_subject *subject)
{
    return subject->media->has_scattering ? NULL : "nothing scatters";
}

static const char *no_maps(const struct accuracy_subject *subject)
{
    return no_scattering(subject) ? no_scattering(subject) : no_lamp(subject);
}

static const char *no_blockers(const struct accuracy_subject *subject)
{
    return subject->scene->blocker_count > 0 ? no_lamp(subject) : "the scene has no blockers";
}

static const char *no_size(const struct accuracy_subject *subject)
{
    for (size_t i = 0; i < subject->scene->light_count; i++) {
        if (subject->scene->lights[i].size_mm > 0 || subject->scene->lights[i].size_rad > 0)
            return NULL;
    }
    return "no light has a size";
}

static const char *no_shadow_maps(const struct accuracy_subject *subject)
{
    return no_blockers(subject) ? no_size(subject) : NULL;
}

/* ---- what is left out --------------------------------------------------------------------------- */

static struct render_plan *plan_of(const struct accuracy_subject *subject, double epsilon,
                                   bool keeps_negligible)
{
    struct render_request request = render_request_for(
        subject->renderer,
        &(struct render_options){ .epsilon = epsilon, .keeps_negligible = keeps_negligible });
    struct render_plan *plan;
    request.environment = subject->renderer->environment;
    request.has_gpu = subject->renderer->has_gpu;
    return render_plan_create(&request, &plan, NULL) ? plan : NULL;
}

static bool are_alike(const struct render_plan *a, const struct render_plan *b)
{
    for (size_t e = 0; e < a->effect_count; e++) {
        if (a->decisions[e].is_active != b->decisions[e].is_active)
            return false;
    }
    return a->environment_order == b->environment_order;
}

/* Whether the automatic choice leaves something out since it changes nothing by more than epsilon. */
static bool leaves_out(const struct accuracy_subject *subject, double epsilon)
{
    struct render_plan *const least = plan_of(subject, epsilon, false);
    struct render_plan *const all = plan_of(subject, epsilon, true);
    const bool does = least && all && !are_alike(least, all);
    render_plan_destroy(least);
    render_plan_destroy(all);
    return does;
}

/* The larger epsilon is, the more is left out. */
static const char *nothing_left_out(const struct accuracy_subject *subject)
{
    return leaves_out(subject, COARSEST_EPSILON) ? NULL
                                                 : "nothing that the scene has is too little to be seen";
}

/* ---- settings ----------------------------------------------------------------------------------- */

static bool set_epsilon(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                        struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.epsilon = value;
    return true;
}

static bool set_kept(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                     struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)status;
    setting->drawing.epsilon = value;
    setting->drawing.keeps_negligible = true;
    if (leaves_out(subject, value))
        snprintf(setting->label, sizeof setting->label, "\u03b5 %.3g, all of it", value);
    return true;
}

static bool set_splat_epsilon(const struct accuracy_knob *knob, struct accuracy_subject *subject,
                              double value, struct accuracy_setting *setting, dipole_status *status)
{
    setting->drawing.technique = RENDER_TECHNIQUE_SPLAT;
    return set_epsilon(knob, subject, value, setting, status);
}

/* Of pictures after the first, as all are timed. */
static bool set_budget(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                       struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.budget_ms = value;
    setting->drawing.is_warm = true;
    return true;
}

/* One part of the error; the others stay fine. */
static bool set_limit(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                      struct accuracy_setting *setting, dipole_status *status)
{
    (void)subject;
    (void)status;
    setting->drawing.technique = RENDER_TECHNIQUE_GATHER;
    setting->drawing.epsilon = FINE_EPSILON;
    memcpy((char *)&setting->drawing.limits + knob->limit, &value, sizeof value);
    return true;
}

static bool bake_table(struct accuracy_subject *subject, double epsilon, bool is_half,
                       struct accuracy_setting *setting, dipole_status *status)
{
    struct render_tables **const tables = &subject->tables[subject->table_count];
    if (!render_tables_bake(subject->media, epsilon, tables, status))
        return false;
    subject->table_count++;
    for (size_t t = 0; is_half && t < (*tables)->lut_count; t++) {
        struct lut_splat *const lut = (*tables)->luts[t];
        for (size_t i = 0; i < lut->row_count * (size_t)lut->node_count * IO_CHANNEL_COUNT; i++)
            lut->rgb[i] = io_float_from_half(io_half_from_float(lut->rgb[i]));
    }
    setting->drawing.technique = RENDER_TECHNIQUE_GATHER;
    setting->drawing.epsilon = FINE_EPSILON;
    setting->drawing.tables = (*tables)->of_medium;
    return true;
}

static bool set_table(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                      struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    return bake_table(subject, value, false, setting, status);
}

static bool set_half_table(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                           struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    return bake_table(subject, value, true, setting, status);
}

static bool set_taps(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                     struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.technique = RENDER_TECHNIQUE_TSM;
    setting->drawing.tsm.sample_count = (int)value;
    return true;
}

static bool set_volume(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                       struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    struct render_volumes **const volumes = &subject->volumes[subject->volume_count];
    if (!render_volumes_bake(subject->media, value, render_plan_slice_count(0), volumes, status))
        return false;
    subject->volume_count++;
    setting->drawing.technique = RENDER_TECHNIQUE_TSM;
    setting->drawing.volumes = (const struct lut_tsm *const *)(*volumes)->volumes;
    return true;
}

static bool set_layers(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                       struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.technique = RENDER_TECHNIQUE_TSM;
    setting->drawing.tsm.layer_count = (int)value;
    return true;
}

/* Samples are texels of the light's view. */
static bool set_grid(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                     struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.technique = RENDER_TECHNIQUE_SPLAT;
    setting->drawing.epsilon = FINE_EPSILON;
    setting->drawing.splat_grid = (int)value;
    return true;
}

static bool set_sky_samples(const struct accuracy_knob *knob, struct accuracy_subject *subject,
                            double value, struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    setting->drawing.technique = RENDER_TECHNIQUE_GATHER;
    setting->drawing.epsilon = FINE_EPSILON;
    setting->drawing.environment_samples = (enum render_environment_samples)value;
    snprintf(setting->label, sizeof setting->label, "%s",
             render_environment_samples_names[setting->drawing.environment_samples]);
    return true;
}

/* Another model for every material that it can be of: a scene and a renderer of its own. */
static bool set_model(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                      struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    const size_t v = subject->variant_count++;
    struct io_scene **const scene = &subject->variants[v];
    if (!io_scene_read(subject->path, subject->reading, scene, status))
        return false;
    for (size_t i = 0; i < (*scene)->object_count; i++)
        (*scene)->objects[i].material.model = (dipole_model)value;
    dipole_status why = { .code = DIPOLE_OK };
    if (!render_create(*scene, RENDER_CONTEXT_DEFAULT, &subject->variant_renderers[v], &why))
        return why.code == DIPOLE_BAD_VALUE || why.code == DIPOLE_NOT_SUPPORTED ||
               dipole_fail(status, why.code, NULL, "%s", why.message);
    setting->renderer = subject->variant_renderers[v];
    setting->drawing.technique = RENDER_TECHNIQUE_GATHER;
    setting->drawing.epsilon = FINE_EPSILON;
    snprintf(setting->label, sizeof setting->label, "%s", io_model_names[(dipole_model)value]);
    return true;
}

static struct render_shadow_options *shadows_of(struct accuracy_setting *setting)
{
    setting->drawing.technique = RENDER_TECHNIQUE_GATHER;
    setting->drawing.epsilon = FINE_EPSILON;
    return &setting->drawing.shadows;
}

static bool set_shadow_nodes(const struct accuracy_knob *knob, struct accuracy_subject *subject,
                             double value, struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    shadows_of(setting)->node_limit = (int)value;
    return true;
}

static bool set_shadow_taps(const struct accuracy_knob *knob, struct accuracy_subject *subject,
                            double value, struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    shadows_of(setting)->tap_count = (int)value;
    return true;
}

static bool set_shadow_side(const struct accuracy_knob *knob, struct accuracy_subject *subject,
                            double value, struct accuracy_setting *setting, dipole_status *status)
{
    (void)knob;
    (void)subject;
    (void)status;
    shadows_of(setting)->side_px = (int)value;
    return true;
}

/* ---- the list ----------------------------------------------------------------------------------- */

const struct accuracy_knob accuracy_knobs[] = {
    { .name = "epsilon",
      .title = "Automatic choice",
      .what = "The error asked for, \u03b5: everything below is chosen by it.",
      .set = set_epsilon,
      .format = "ε %.3g",
      .values = { COARSEST_EPSILON, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.003 },
      .value_count = 8,
      .is_quick = true },
    { .name = "budget",
      .title = "Automatic choice, by time",
      .what = "The time that a picture may take: \u03b5 is the least that is predicted to keep to it.",
      .why_not = no_scattering,
      .set = set_budget,
      .format = "%.3g ms",
      .values = { 30, 60, 120, 300, 1000 },
      .value_count = 5 },
    { .name = "kept",
      .title = "Nothing left out",
      .what =
          "The automatic choice, with all that it leaves out since it changes nothing by more than \u03b5.",
      .why_not = nothing_left_out,
      .set = set_kept,
      .values = { COARSEST_EPSILON, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.003 },
      .value_count = 8,
      .is_quick = true },
    { .name = "splat",
      .title = "Splats, by \u03b5",
      .what = "The same error asked for, light samples drawn one by one.",
      .why_not = no_maps,
      .set = set_splat_epsilon,
      .format = "ε %.3g",
      .values = { 0.3, 0.1, 0.03, 0.01, 0.003, 0.001 },
      .value_count = 6 },
    { .name = "r_max",
      .title = "Where the profile is cut off",
      .what = "The part of the light that may leave beyond r_max.",
      .why_not = no_scattering,
      .set = set_limit,
      .limit = offsetof(struct render_limits, truncation),
      .format = "%.2g beyond r_max",
      .values = { 0.3, 0.1, 0.03, 0.01, 0.001, 1e-4 },
      .value_count = 6,
      .is_quick = true },
    { .name = "density",
      .title = "Density of light samples",
      .what = "The aliasing that sampling light may leave.",
      .why_not = no_scattering,
      .set = set_limit,
      .limit = offsetof(struct render_limits, aliasing),
      .format = "aliasing %.2g",
      .values = { 0.3, 0.1, 0.03, 0.01, 0.003, 0.001 },
      .value_count = 6,
      .is_quick = true },
    { .name = "merging",
      .title = "Merging of light samples",
      .what = "The error that merging samples far away may leave.",
      .why_not = no_scattering,
      .set = set_limit,
      .limit = offsetof(struct render_limits, banding),
      .format = "merging %.2g",
      .values = { RENDER_GATHER_MERGING_ERROR_MAX, 0.002, 0.001, 5e-4, 2e-4, 1e-4 },
      .value_count = 6 },
    { .name = "levels",
      .title = "Levels of pixels",
      .what = "The error that interpolating wide bands between pixels may leave.",
      .why_not = no_scattering,
      .set = set_limit,
      .limit = offsetof(struct render_limits, interpolation),
      .format = "interpolation %.2g",
      .values = { 0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-5 },
      .value_count = 7,
      .is_quick = true },
    { .name = "table",
      .title = "Size of the profile's table",
      .what = "The relative error of the table that profiles are read from.",
      .why_not = no_scattering,
      .set = set_table,
      .format = "to %.2g",
      .values = { 0.1, 0.03, 0.01, 0.001, 1e-4 },
      .value_count = 5 },
    { .name = "table_half",
      .title = "The same in half precision",
      .what = "Tables of half floats, as engines keep them.",
      .why_not = no_scattering,
      .set = set_half_table,
      .format = "half, to %.2g",
      .values = { 0.1, 0.01, 0.001 },
      .value_count = 3 },
    { .name = "model",
      .title = "Model of the profile",
      .what = "How light is taken to spread; the error is against the model that the material states.",
      .why_not = no_scattering,
      .set = set_model,
      .values = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_MODEL_MULTIPOLE,
                  DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES },
      .value_count = 5 },
    { .name = "grid",
      .title = "Resolution of the light's view",
      .what = "Splats over a uniform grid in each light's view, as in the paper.",
      .why_not = no_maps,
      .set = set_grid,
      .format = "%.0f texels a side",
      .values = { 32, 64, 128, 256 },
      .value_count = 4 },
    { .name = "sky_samples",
      .title = "Samples of light from all around",
      .what =
          "Where light from all around is sampled: on the surface itself, or in layers peeled along one "
          "axis or three.",
      .why_not = no_environment,
      .set = set_sky_samples,
      .values = { RENDER_ENVIRONMENT_PEEL, RENDER_ENVIRONMENT_PEEL3, RENDER_ENVIRONMENT_SURFACE },
      .value_count = 3 },
    { .name = "shadow_nodes",
      .title = "Nodes of transmittance",
      .what = "How many nodes each texel's transmittance keeps.",
      .why_not = no_blockers,
      .set = set_shadow_nodes,
      .format = "%.0f nodes",
      .values = { 2, 4, 8, 16, 32 },
      .value_count = 5 },
    { .name = "shadow_taps",
      .title = "Taps of soft shadows",
      .what = "How many texels the search and the filter look at, each.",
      .why_not = no_size,
      .set = set_shadow_taps,
      .format = "%.0f taps",
      .values = { 4, 9, 16, 25, 49, 100 },
      .value_count = 6 },
    { .name = "shadow_side",
      .title = "Size of shadow maps",
      .what = "How many texels a side of each light's shadow maps has.",
      .why_not = no_shadow_maps,
      .set = set_shadow_side,
      .format = "%.0f texels a side",
      .values = { 128, 256, 512, 1024, 2048 },
      .value_count = 5 },
    { .name = "order",
      .title = "Order of harmonics",
      .what = "The part of the environment's light that harmonics left out may be.",
      .why_not = no_environment,
      .set = set_limit,
      .limit = offsetof(struct render_limits, environment),
      .format = "harmonics %.2g",
      .values = { 0.3, 0.1, 0.03, 0.01, 0.003, 0.001 },
      .value_count = 6,
      .is_quick = true },
    { .name = "taps",
      .title = "Samples of translucent shadow maps",
      .what = "How many samples of the map are taken for each pixel.",
      .why_not = no_maps,
      .set = set_taps,
      .format = "%.0f samples",
      .values = { 13, 21, 53, 117, 245 },
      .value_count = 5 },
    { .name = "volume",
      .title = "Volume of translucent shadow maps",
      .what = "The error that the volume is baked to.",
      .why_not = no_maps,
      .set = set_volume,
      .format = "to %.2g",
      .values = { 0.3, 0.1, 0.03 },
      .value_count = 3 },
    { .name = "layers",
      .title = "Peeled layers",
      .what = "How many surfaces behind each other tell material from air.",
      .why_not = no_maps,
      .set = set_layers,
      .format = "%.0f layers",
      .values = { 0, 2, 4, 8, 16 },
      .value_count = 5 },
    { .name = NULL },
};

/* ---- the subject -------------------------------------------------------------------------------- */

bool accuracy_subject_init(const char *path, const struct io_scene_options *reading,
                           struct accuracy_subject *subject, dipole_status *status)
{
    *subject = (struct accuracy_subject){ .path = path, .reading = reading };
    return io_scene_read(path, reading, &subject->scene, status) &&
           accuracy_interior_create(subject->scene, &subject->kinds, status) &&
           render_media_create(subject->scene, &subject->media, status) &&
           render_create(subject->scene, RENDER_CONTEXT_DEFAULT, &subject->renderer, status);
}

void accuracy_subject_end(struct accuracy_subject *subject)
{
    for (size_t i = 0; i < subject->table_count; i++)
        render_tables_destroy(subject->tables[i]);
    for (size_t i = 0; i < subject->volume_count; i++)
        render_volumes_destroy(subject->volumes[i]);
    for (size_t i = 0; i < subject->variant_count; i++) {
        render_destroy(subject->variant_renderers[i]);
        io_scene_destroy(subject->variants[i]);
    }
    render_destroy(subject->renderer);
    render_media_destroy(subject->media);
    free(subject->kinds);
    io_scene_destroy(subject->scene);
}
