/* The passes of a plan, in order, and the textures that they hand on. */
#include "renderer/plan_internal.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* Every texture of the renderer. */
static const struct render_texture textures[] = {
    { .name = "mesh_triangles", .format = RENDER_OTHER },    /* corners; w = object + 1             */
    { .name = "mesh_positions_mm", .format = RENDER_OTHER }, /* of all vertices                     */
    { .name = "mesh_normals", .format = RENDER_OTHER },
    { .name = "mesh_roughness", .format = RENDER_OTHER }, /* of each object, 0: no gloss         */
    { .name = "surface_triangle", .format = RENDER_R32UI, .is_multisampled = true }, /* from 1; 0: none */
    { .name = "surface_depth", .format = RENDER_DEPTH32F, .is_multisampled = true },
    { .name = "position_mm" },  /* one point of the surface per pixel, w = object + 1               */
    { .name = "normal" },       /* w = roughness, 0: no gloss                                       */
    { .name = "surface_exit" }, /* exit per sr, covered part, part that shows this surface; points that do
                                   not */
    { .name = "position_depth", .format = RENDER_DEPTH32F }, /* 0 where no object is                */
    { .name = "object_media", .format = RENDER_OTHER },      /* what each object is made of              */
    { .name = "light_view", .size = RENDER_SIZE_LIGHT_VIEW, .is_far_where_empty = true },
    { .name = "light_front", .size = RENDER_SIZE_LIGHT_VIEW }, /* of the view before */
    { .name = "light_object", .format = RENDER_R32F, .size = RENDER_SIZE_LIGHT_VIEW },     /* object + 1  */
    { .name = "light_irradiance", .format = RENDER_R32F, .size = RENDER_SIZE_LIGHT_VIEW }, /* per rgb */
    { .name = "light_rest", .size = RENDER_SIZE_LIGHT_VIEW },     /* the surface at rest, mm */
    { .name = "light_shadow", .size = RENDER_SIZE_LIGHT_BLOCKS }, /* left of the light, per channel */
    { .name = "light_depth", .format = RENDER_DEPTH32F, .size = RENDER_SIZE_LIGHT_VIEW },
    { .name = "light_samples", .format = RENDER_OTHER },
    { .name = "posed_vertices", .format = RENDER_OTHER }, /* stands for the objects' vertices */
    { .name = "tsm_volume", .format = RENDER_OTHER },     /* of the map's medium                        */
    { .name = "tsm_pattern", .format = RENDER_OTHER },    /* the places of its samples                  */
    { .name = "tsm_form", .format = RENDER_OTHER },       /* of the local response: R by distance, cosine */
    { .name = "tsm_kernel", .format = RENDER_OTHER },     /* its cells                                  */
    { .name = "tsm_sources", .format = RENDER_OTHER },    /* of its medium, instead of the volume       */
    { .name = "tsm_factors", .format = RENDER_OTHER },
    { .name = "tsm_position_mm", .size = RENDER_SIZE_MAP, .is_mipmapped = true }, /* times w = coverage */
    { .name = "tsm_normal", .size = RENDER_SIZE_MAP, .is_mipmapped = true },      /* times coverage  */
    { .name = "tsm_flux", .size = RENDER_SIZE_MAP, .is_mipmapped = true }, /* W/mm^2; point light: W/sr */
    { .name = "tsm_shadow", .size = RENDER_SIZE_MAP_BLOCKS }, /* left of the light, per channel */
    { .name = "tsm_depth", .format = RENDER_DEPTH32F, .size = RENDER_SIZE_MAP },
    { .name = "tsm_layers", .format = RENDER_OTHER, .size = RENDER_SIZE_MAP }, /* depths of surfaces */
    { .name = "tsm_vertices", .format = RENDER_OTHER },                        /* as position_mm    */
    { .name = "tsm_vertex_radiosity", .size = RENDER_SIZE_VERTICES },
    { .name = "tsm_surface_radiosity", .is_multisampled = true }, /* w = object + 1                  */
    { .name = "environment_irradiance", .format = RENDER_OTHER }, /* kept by environment_draw.c    */
    { .name = "environment_tree", .format = RENDER_OTHER },
    { .name = "peel_position_mm", .size = RENDER_SIZE_PEEL }, /* w = object + 1                       */
    { .name = "peel_normal", .size = RENDER_SIZE_PEEL },      /* w = cosine of the facet to the axis  */
    { .name = "peel_depth", .format = RENDER_DEPTH32F, .size = RENDER_SIZE_PEEL },
    { .name = "shadow_depth_mm", .format = RENDER_R32F, .size = RENDER_SIZE_SHADOW }, /* 0: none */
    { .name = "shadow_order", .format = RENDER_DEPTH32F, .size = RENDER_SIZE_SHADOW },
    { .name = "avsm_ranges", .format = RENDER_OTHER }, /* depths, nodes of each texel: shadow_draw.c */
    { .name = "avsm_nodes", .format = RENDER_OTHER },
    { .name = "avsm_colour", .format = RENDER_OTHER }, /* stands for nodes of three channels         */
    { .name = "shadow_taps", .format = RENDER_OTHER },
    { .name = "shadow_nearest", .format = RENDER_R32F, .size = RENDER_SIZE_SHADOW_BLOCKS },
    { .name = "shadow" },      /* left of one view's light, per channel                               */
    { .name = "overlap_sum" }, /* irradiance times R_d, summed; a = how many samples                 */
    { .name = "radiosity" },   /* W/mm^2                                                              */
    { .name = "specular" },    /* radiance, already averaged over the pixel                           */
    { .name = "radiance" },    /* premultiplied by a = coverage                                       */
    { .name = "capture" },     /* exit per sr, coverage, part of it that shows the pixel's own surface */
    { .name = "display" },     /* tone mapped, 0..1, linear                                           */
};

const struct render_texture *render_texture_find(const char *name)
{
    for (size_t i = 0; i < COUNT(textures); i++) {
        if (strcmp(textures[i].name, name) == 0)
            return &textures[i];
    }
    return NULL;
}

/* Every active pass, effect by effect. */
static size_t list_passes(const struct render_plan *plan, const struct render_effect *const *effects,
                          struct render_plan_pass *rows)
{
    size_t count = 0;
    for (size_t e = 0; effects[e]; e++) {
        for (size_t p = 0; plan->decisions[e].is_active && p < effects[e]->pass_count; p++) {
            if (rows)
                rows[count] = (struct render_plan_pass){ .pass = &effects[e]->passes[p], .effect = e };
            count++;
        }
    }
    return count;
}

bool render_plan_wants(const struct render_plan *plan, const char *texture)
{
    if (strcmp(texture, "normal") == 0 || strcmp(texture, "light_view") == 0)
        return render_plan_reads(plan, texture);
    if (strcmp(texture, "light_object") == 0)
        return plan->has_object_ids;
    if (strcmp(texture, "light_rest") == 0)
        return plan->coherence == RENDER_COHERENCE_SURFACE;
    assert(strcmp(texture, "light_irradiance") == 0);
    return plan->area == RENDER_AREA_OVERLAP;
}

void render_plan_list_writes(const struct render_plan *plan, const struct render_pass *pass,
                             const char *writes[RENDER_PASS_TARGETS + 1])
{
    size_t count = 0;
    while (count < RENDER_PASS_WRITES && pass->writes[count]) {
        writes[count] = pass->writes[count];
        count++;
    }
    for (size_t i = 0; i < RENDER_PASS_EXTRAS && pass->writes_if_wanted[i]; i++) {
        if (render_plan_wants(plan, pass->writes_if_wanted[i]))
            writes[count++] = pass->writes_if_wanted[i];
    }
    writes[count] = NULL;
}

static bool writes(const struct render_plan *plan, const struct render_pass *pass, const char *texture)
{
    const char *list[RENDER_PASS_TARGETS + 1];
    render_plan_list_writes(plan, pass, list);
    for (size_t w = 0; list[w]; w++) {
        if (strcmp(list[w], texture) == 0)
            return true;
    }
    return pass->depth_written && strcmp(pass->depth_written, texture) == 0;
}

static bool writes_before(const struct render_plan *plan, size_t end, const char *texture)
{
    for (size_t i = 0; i < end; i++) {
        if (writes(plan, plan->passes[i].pass, texture))
            return true;
    }
    return false;
}

bool render_plan_writes(const struct render_plan *plan, const char *texture)
{
    return writes_before(plan, plan->pass_count, texture);
}

bool render_plan_reads(const struct render_plan *plan, const char *texture)
{
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        for (size_t r = 0; r < RENDER_PASS_READS && pass->reads[r]; r++) {
            if (strcmp(pass->reads[r], texture) == 0)
                return true;
        }
    }
    return false;
}

static bool check_pass(const struct render_plan *plan, size_t index, dipole_status *status)
{
    const struct render_pass *const pass = plan->passes[index].pass;
    const char *missing = NULL;
    assert(pass);
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads[r]; r++) {
        if (!writes_before(plan, index, pass->reads[r]))
            missing = pass->reads[r];
    }
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads_if_written[r]; r++) {
        if (render_plan_writes(plan, pass->reads_if_written[r]) &&
            !writes_before(plan, index, pass->reads_if_written[r]))
            missing = pass->reads_if_written[r];
    }
    if (pass->depth_tested && !writes_before(plan, index, pass->depth_tested))
        missing = pass->depth_tested;
    if (missing)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "pass \"%s\" reads texture \"%s\" before any pass has written it", pass->name,
                           missing);
    return true;
}

static bool are_repeated_together(const struct render_pass *a, const struct render_pass *b)
{
    return (a->is_per_view && b->is_per_view) || (a->is_per_map && b->is_per_map);
}

/* Append rows begin to end, once or as often as there are views or maps. */
static void repeat_rows(struct render_plan *plan, const struct render_plan_pass *rows, size_t begin,
                        size_t end)
{
    const struct render_pass *const pass = rows[begin].pass;
    const size_t repeats = pass->is_per_view ? plan->view_count : pass->is_per_map ? plan->map_count : 1;
    for (size_t view = 0; view < repeats; view++) {
        for (size_t i = begin; i < end; i++) {
            if (rows[i].pass->is_per_view && plan->views[view].is_repeated && !rows[i].pass->is_of_samples)
                continue;
            plan->passes[plan->pass_count] = rows[i];
            plan->passes[plan->pass_count++].view = view;
        }
    }
}

bool render_plan_add_passes(struct render_plan *plan, const struct render_effect *const *effects,
                            dipole_status *status)
{
    const size_t row_count = list_passes(plan, effects, NULL);
    const size_t most = plan->view_count > plan->map_count ? plan->view_count : plan->map_count;
    const size_t repeats = most > 1 ? most : 1;
    struct render_plan_pass *const rows = calloc(row_count + 1, sizeof *rows);
    plan->passes = calloc(row_count * repeats + 1, sizeof *plan->passes);
    bool done = rows && plan->passes;
    if (done)
        list_passes(plan, effects, rows);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu passes", row_count * repeats);
    for (size_t begin = 0, end; done && begin < row_count; begin = end) {
        end = begin + 1;
        while (end < row_count && are_repeated_together(rows[begin].pass, rows[end].pass))
            end++;
        repeat_rows(plan, rows, begin, end);
    }
    free(rows);
    for (size_t i = 0; done && i < plan->pass_count; i++)
        done = check_pass(plan, i, status);
    return done;
}
