/* Objects that only stand in the way of light. */
#include "io/scatter.h"
#include "io/scene_motion.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double EXTINCTION_MAX_PER_MM = 1e12;

bool io_scene_is_blocker(const struct io_json *at)
{
    static const char *const keys[] = { "opacity", "extinction_per_mm", "extinction_of", "particles",
                                        "fibres" };
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        if (json_object_get(at->value, keys[i]) && !json_object_get(at->value, "material"))
            return true;
    }
    return false;
}

/* ---- what stays ---------------------------------------------------------------------------------- */

static bool get_rgb(const struct io_json *at, const char *key, double max, double out[3],
                    dipole_status *status)
{
    if (!json_is_number(io_json_member(at, key).value))
        return io_json_get_numbers(at, key, 3, 0, max, out, status);
    if (!io_json_get_number(at, key, 0, max, out, status))
        return false;
    out[1] = out[2] = out[0];
    return true;
}

/* Light that was scattered no longer comes from the light: what is left of it falls with sigma_a +
 * sigma_s'. */
static bool read_extinction_of(const struct io_json *at, const struct io_scene_options *options,
                               double extinction_per_mm[3], dipole_status *status)
{
    struct io_material material;
    if (!io_scene_read_material(at, options, &material, status))
        return false;
    if (material.layer_count != 1)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "has %zu layers, expected a material without layers",
                            (size_t)material.layer_count);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        extinction_per_mm[c] =
            material.layers[c][0].medium.sigma_a_per_mm + material.layers[c][0].medium.sigma_s_prime_per_mm;
    return true;
}

static bool read_opacity(const struct io_json *at, const struct io_scene_options *options,
                         struct io_blocker *blocker, dipole_status *status)
{
    const struct io_json opacity = io_json_member(at, "opacity"),
                         extinction = io_json_member(at, "extinction_per_mm"),
                         material = io_json_member(at, "extinction_of"),
                         sheet = io_json_member(at, "sheet");
    const int stated = (opacity.value != NULL) + (extinction.value != NULL) + (material.value != NULL);
    if (stated != 1)
        return io_json_fail(stated ? &opacity : at, DIPOLE_BAD_VALUE, status,
                            stated
                                ? "stands beside another, expected one of opacity, extinction_per_mm and "
                                  "extinction_of"
                                : "has no opacity, expected opacity, extinction_per_mm or extinction_of");
    if (opacity.value)
        return get_rgb(at, "opacity", 1, blocker->opacity, status);
    if (sheet.value || json_object_get(at->value, "particles"))
        return io_json_fail(sheet.value ? &sheet : &extinction, DIPOLE_BAD_VALUE, status,
                            "is of solids with an extinction alone, expected opacity for thin blockers");
    blocker->has_extinction = true;
    return extinction.value
               ? get_rgb(at, "extinction_per_mm", EXTINCTION_MAX_PER_MM, blocker->extinction_per_mm, status)
               : read_extinction_of(&material, options, blocker->extinction_per_mm, status);
}

/* ---- shapes -------------------------------------------------------------------------------------- */

static bool create_particles(const struct io_json *at, struct io_blocker *blocker, dipole_status *status)
{
    static const char *const known[] = { "count", "radius", "seed", NULL };
    int count = 0, seed = 1;
    return io_json_check_object(at, known, 2, status) &&
           io_json_get_integer(at, "count", 1, IO_PARTICLE_LIMIT, &count, status) &&
           io_json_get_number(at, "radius", IO_SCENE_LENGTH_MIN, 1, &blocker->particle_mm, status) &&
           io_json_get_integer(at, "seed", 0, INT32_MAX, &seed, status) &&
           io_mesh_create_particles(count, seed, &blocker->mesh, status);
}

static bool create_fibres(const struct io_json *at, struct io_blocker *blocker, dipole_status *status)
{
    static const char *const known[] = { "count", "radius", "segments", "seed", NULL };
    int count = 0, segments = 32, seed = 1;
    double radius = 0;
    dipole_status found;
    return io_json_check_object(at, known, 2, status) &&
           io_json_get_integer(at, "count", 1, IO_FIBRE_LIMIT, &count, status) &&
           io_json_get_number(at, "radius", IO_SCENE_LENGTH_MIN, 1, &radius, status) &&
           io_json_get_integer(at, "segments", 1, IO_FIBRE_SEGMENT_LIMIT, &segments, status) &&
           io_json_get_integer(at, "seed", 0, INT32_MAX, &seed, status) &&
           (io_mesh_create_fibres(count, segments, radius, seed, &blocker->mesh, &found) ||
            io_json_fail(at, found.code, status, "asks for too much: %s", found.message));
}

static bool read_shape(const struct io_json *at, const struct io_scene_options *options,
                       struct io_blocker *blocker, dipole_status *status)
{
    const struct io_json particles = io_json_member(at, "particles"), fibres = io_json_member(at, "fibres");
    const json_t *const others[] = { json_object_get(at->value, "mesh"),
                                     json_object_get(at->value, "primitive"),
                                     particles.value && fibres.value ? fibres.value : NULL };
    for (size_t i = 0; i < 3 && (particles.value || fibres.value); i++) {
        if (others[i])
            return io_json_fail(
                particles.value ? &particles : &fibres, DIPOLE_BAD_VALUE, status,
                "stands beside another shape, expected one of mesh, primitive, particles and fibres");
    }
    if (particles.value)
        return create_particles(&particles, blocker, status);
    if (fibres.value)
        return create_fibres(&fibres, blocker, status);
    const struct io_json mesh = io_json_member(at, "mesh");
    if (!others[0] && !others[1])
        return io_json_fail(&mesh, DIPOLE_BAD_VALUE, status,
                            "is missing, expected it, primitive, particles or fibres");
    return io_scene_read_shape(at, options, &blocker->mesh, status);
}

/* What a transform makes of a length in the mean of all directions. */
static double mean_scale(const struct io_scene_transform *transform)
{
    return transform->fit * cbrt(fabs(transform->scale[0] * transform->scale[1] * transform->scale[2]));
}

bool io_scene_read_blocker(const struct io_json *at, const struct io_scene_options *options, double unit_mm,
                           int frame_count, struct io_blocker *blocker, dipole_status *status)
{
    static const char *const known[] = {
        "opacity", "extinction_per_mm", "extinction_of", "mesh", "primitive", "detail", "particles",
        "fibres",  "transform",         "sheet",         "name", "deform",    "motion", NULL
    };
    const struct io_json transform_at = io_json_member(at, "transform");
    struct io_scene_transform transform;
    *blocker = (struct io_blocker){ .mesh = NULL };
    if (!io_json_check_object(at, known, 0, status) ||
        !io_json_get_text(at, "name", blocker->name, sizeof blocker->name, status) ||
        !io_json_get_bool(at, "sheet", &blocker->is_sheet, status) ||
        !read_opacity(at, options, blocker, status) ||
        !io_scene_read_transform(&transform_at, &transform, status) ||
        !read_shape(at, options, blocker, status) ||
        !io_scene_fit_mesh(at, blocker->mesh, &transform, status))
        return false;
    blocker->particle_mm *= mean_scale(&transform) * unit_mm;
    const struct io_motion_reading reading = { .at = at,
                                               .options = options,
                                               .transform = &transform,
                                               .unit_mm = unit_mm,
                                               .frame_count = frame_count };
    return io_scene_place_mesh(at, &transform, unit_mm, blocker->mesh, status) &&
           io_scene_read_motion(&reading, &blocker->mesh, &blocker->motion, status);
}
