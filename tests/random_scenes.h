/* Random scenes in memory, seeded: whatever a scene file may say, hard corners first. */
#ifndef RANDOM_SCENES_H
#define RANDOM_SCENES_H

#include "random_layers.h"

#include "renderer/plan.h"

#include <stdlib.h>
#include <string.h>

enum { RANDOM_LIGHTS = 4, RANDOM_OBJECTS = 6 };

/* What io/scene_file.c lets through: coordinates of meshes, those of eyes and lights, powers. */
static const double RANDOM_REACH_MM = 1e9, RANDOM_COORDINATE_MM = 1e12, RANDOM_POWER = 1e12;

/* Shares of materials that take long to plan for or to draw. */
struct random_shares {
    double slow; /* other models than the dipole, and layers                                          */
    double wild; /* mean free paths from 1e-6 to 1e6 mm, whatever the object's size; else near to it  */
};

/* A scene and what is asked of it. Begin with random_scene_init, end with random_scene_end. */
struct random_scene {
    uint64_t seed;
    struct io_scene scene;
    struct io_light lights[RANDOM_LIGHTS];
    struct io_object objects[RANDOM_OBJECTS];
    enum render_technique technique;
    enum render_area area;
    double epsilon, spacing_mm;
    bool is_captured, is_tone_mapped;
};

static inline bool chance(struct rng *rng, double part)
{
    return uniform(rng, 0, 1) < part;
}

static inline int random_index(struct rng *rng, int count)
{
    return (int)(random_bits(rng) % (uint64_t)count);
}

static inline void random_direction(struct rng *rng, double out[3])
{
    const double z = uniform(rng, -1, 1), angle_rad = uniform(rng, 0, 2 * acos(-1));
    const double axes[6][3] = { { 1, 0, 0 },  { 0, 1, 0 },  { 0, 0, 1 },
                                { -1, 0, 0 }, { 0, -1, 0 }, { 0, 0, -1 } };
    out[0] = sqrt(1 - z * z) * cos(angle_rad);
    out[1] = sqrt(1 - z * z) * sin(angle_rad);
    out[2] = z;
    if (chance(rng, 0.3))
        memcpy(out, axes[random_index(rng, 6)], 3 * sizeof *out);
}

/* ---- materials ---------------------------------------------------------------------------------- */

/* A half-space; channels alike or not. */
static inline void random_half_space(struct rng *rng, double size_mm, bool is_slow, bool is_wild,
                                     struct io_material *material)
{
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_MULTIPOLE,
                                           DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_MODEL_BEAM,
                                           DIPOLE_MODEL_MODES };
    const int model_count = is_slow ? 5 : 1;
    const double eta = chance(rng, 0.2) ? 1 : log_uniform(rng, 0.7, 3);
    const double common_mm = is_wild ? log_uniform(rng, 1e-6, 1e6) : size_mm * log_uniform(rng, 2e-2, 10);
    dipole_medium media[3];
    for (int c = 0; c < 3; c++) {
        const double free_path_mm = common_mm * (chance(rng, 0.2) ? log_uniform(rng, 1e-3, 1e3) : 1);
        const double corner = uniform(rng, 0, 1), absorbed = log_uniform(rng, 1e-9, 1);
        media[c] = (dipole_medium){ .sigma_a_per_mm = absorbed / free_path_mm,
                                    .sigma_s_prime_per_mm = (1 - absorbed) / free_path_mm,
                                    .eta = eta };
        if (corner < 0.15)
            media[c].sigma_a_per_mm = 0;
        else if (corner < 0.25)
            media[c].sigma_s_prime_per_mm = 0;
        if (media[c].sigma_a_per_mm + media[c].sigma_s_prime_per_mm == 0)
            media[c].sigma_a_per_mm = 1 / free_path_mm;
    }
    io_material_set_media(material, media);
    material->model = models[random_index(rng, model_count)];
}

/* Layers of random_layers.h, scaled to the size given; the uppermost index is that of all channels. */
static inline void random_stack(struct rng *rng, double size_mm, struct io_material *material)
{
    dipole_layer layers[RANDOM_LAYERS];
    material->layer_count = random_layers(rng, layers);
    material->model = chance(rng, 0.5) ? DIPOLE_MODEL_BEAM : DIPOLE_MODEL_MODES;
    for (size_t i = 0; i < material->layer_count; i++) {
        for (int c = 0; c < 3; c++) {
            const double factor = c == 0 ? 1 : log_uniform(rng, 0.5, 2);
            material->layers[c][i] = layers[i];
            material->layers[c][i].medium.sigma_a_per_mm *= factor / size_mm;
            material->layers[c][i].medium.sigma_s_prime_per_mm *= factor / size_mm;
            material->layers[c][i].thickness_mm *= size_mm;
        }
    }
}

/* As a file would be checked. */
static inline bool random_material_is_legal(const struct io_material *material)
{
    bool is_legal = true;
    for (int c = 0; c < 3; c++) {
        dipole_stack *stack;
        is_legal = is_legal && dipole_stack_create(material->layers[c], material->layer_count,
                                                   material->model, DIPOLE_FROM_ABOVE, &stack, NULL);
        if (is_legal)
            dipole_stack_destroy(stack);
    }
    return is_legal;
}

static inline void random_material(struct rng *rng, double size_mm, const struct random_shares *shares,
                                   struct io_material *material)
{
    do {
        const bool is_slow = chance(rng, shares->slow), is_wild = chance(rng, shares->wild);
        *material = (struct io_material){ .name = "random" };
        if (is_slow && chance(rng, 0.5))
            random_stack(rng, size_mm, material);
        else
            random_half_space(rng, size_mm, is_slow, is_wild, material);
    } while (!random_material_is_legal(material));
}

/* ---- meshes ------------------------------------------------------------------------------------- */

/* Scale, turn and move; normals by the inverse transpose. As io/scene_transform.c does it. */
static inline void random_place(struct rng *rng, struct io_mesh *mesh, double size_mm,
                                const double centre_mm[3])
{
    double scale[3], x[3], y[3], z[3], length;
    const double kind = uniform(rng, 0, 1);
    for (int k = 0; k < 3; k++)
        scale[k] = size_mm * (kind < 0.5 ? 1 : log_uniform(rng, 0.2, 5)) * (chance(rng, 0.2) ? -1 : 1);
    if (kind > 0.8) /* flat or needle-like */
        scale[random_index(rng, 3)] *= log_uniform(rng, 1e-6, 1e-2);
    if (kind > 0.9)
        scale[random_index(rng, 3)] *= log_uniform(rng, 1e-6, 1e-2);
    random_direction(rng, x);
    do {
        random_direction(rng, y);
        const double along = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        for (int k = 0; k < 3; k++)
            y[k] -= along * x[k];
        length = sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
    } while (length < 0.1);
    for (int k = 0; k < 3; k++)
        y[k] /= length;
    for (int k = 0; k < 3; k++)
        z[k] = x[(k + 1) % 3] * y[(k + 2) % 3] - x[(k + 2) % 3] * y[(k + 1) % 3];
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        float *const p = mesh->positions + 3 * v, *const n = mesh->normals + 3 * v;
        double position[3], normal[3], turned[3];
        for (int k = 0; k < 3; k++) {
            position[k] = (double)p[k] * scale[k];
            normal[k] = (double)n[k] / scale[k];
        }
        for (int k = 0; k < 3; k++) {
            const double moved_mm = x[k] * position[0] + y[k] * position[1] + z[k] * position[2];
            p[k] = (float)fmax(fmin(moved_mm + centre_mm[k], RANDOM_REACH_MM), -RANDOM_REACH_MM);
            turned[k] = x[k] * normal[0] + y[k] * normal[1] + z[k] * normal[2];
        }
        length = sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2]);
        for (int k = 0; k < 3; k++)
            n[k] = (float)(turned[k] / length);
    }
    for (size_t t = 0; t < mesh->triangle_count && scale[0] * scale[1] * scale[2] < 0; t++) {
        const uint32_t corner = mesh->indices[3 * t + 1];
        mesh->indices[3 * t + 1] = mesh->indices[3 * t + 2];
        mesh->indices[3 * t + 2] = corner;
    }
}

/* Triangles without an area, twice the same, missing; normals that point anywhere, or nowhere. */
static inline void random_damage(struct rng *rng, struct io_mesh *mesh)
{
    for (int i = 0; i < 8; i++) {
        const size_t a = random_bits(rng) % mesh->triangle_count,
                     b = random_bits(rng) % mesh->triangle_count;
        uint32_t *const at = mesh->indices + 3 * a;
        switch (random_index(rng, 4)) {
        case 0:
            at[1] = at[0];
            break;
        case 1:
            memcpy(at, mesh->indices + 3 * b, 3 * sizeof *at);
            break;
        case 2:
            if (mesh->triangle_count > 1)
                mesh->triangle_count -= 1 + random_bits(rng) % (mesh->triangle_count - 1) / 4;
            break;
        default:
            at[2] = at[1] = at[0];
        }
    }
    const double ugly = chance(rng, 0.5) ? uniform(rng, 0, 1) : 0;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        float *const n = mesh->normals + 3 * v;
        double direction[3] = { 0, 0, 0 };
        if (!chance(rng, ugly))
            continue;
        if (chance(rng, 0.8))
            random_direction(rng, direction);
        for (int k = 0; k < 3; k++)
            n[k] = (float)direction[k];
    }
}

static inline void random_bounds(struct io_mesh *mesh)
{
    for (int k = 0; k < 3; k++) {
        mesh->min[k] = INFINITY;
        mesh->max[k] = -INFINITY;
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            mesh->min[k] = fminf(mesh->min[k], mesh->positions[3 * v + (size_t)k]);
            mesh->max[k] = fmaxf(mesh->max[k], mesh->positions[3 * v + (size_t)k]);
        }
    }
}

static inline void random_object(struct rng *rng, struct random_scene *random, double size_mm,
                                 const double middle_mm[3], const struct random_shares *shares)
{
    struct io_scene *const scene = &random->scene;
    struct io_object *const object = &random->objects[scene->object_count];
    const size_t number = scene->object_count++;
    *object = (struct io_object){ .roughness = uniform(rng, 0.05, 1), .has_specular = chance(rng, 0.4) };
    snprintf(object->name, sizeof object->name, "object %zu", number);
    /* the terrain takes 10 ms to make, the others next to nothing */
    const int primitive_count = IO_PRIMITIVE_COUNT - !chance(rng, 0.1);
    assert_true(io_mesh_create_primitive((enum io_primitive)random_index(rng, primitive_count),
                                         4 + random_index(rng, 12), &object->mesh, NULL));
    const double kind = uniform(rng, 0, 1);
    double centre_mm[3];
    for (int k = 0; k < 3; k++) /* coincident, beside each other, far apart */
        centre_mm[k] = middle_mm[k] + size_mm * (kind < 0.2   ? 0
                                                 : kind < 0.9 ? uniform(rng, -3, 3)
                                                              : log_uniform(rng, 1e-6, 1e6));
    random_place(rng, object->mesh, size_mm * (chance(rng, 0.1) ? log_uniform(rng, 1e-9, 1e3) : 1),
                 centre_mm);
    if (chance(rng, 0.4))
        random_damage(rng, object->mesh);
    random_bounds(object->mesh);
    if (number > 0 && chance(rng, 0.4))
        object->material = random->objects[0].material;
    else
        random_material(rng, size_mm, shares, &object->material);
    for (int k = 0; k < 3; k++) {
        scene->min_mm[k] = number == 0 ? (double)object->mesh->min[k]
                                       : fmin(scene->min_mm[k], (double)object->mesh->min[k]);
        scene->max_mm[k] = number == 0 ? (double)object->mesh->max[k]
                                       : fmax(scene->max_mm[k], (double)object->mesh->max[k]);
    }
}

/* ---- camera and lights -------------------------------------------------------------------------- */

/* A vertex of any object. */
static inline void random_vertex(struct rng *rng, const struct random_scene *random, double out_mm[3])
{
    const struct io_mesh *const mesh =
        random->objects[random_index(rng, (int)random->scene.object_count)].mesh;
    const size_t v = random_bits(rng) % mesh->vertex_count;
    for (int k = 0; k < 3; k++)
        out_mm[k] = (double)mesh->positions[3 * v + (size_t)k];
}

/* On a surface, inside the scene, about it or far away. */
static inline void random_place_mm(struct rng *rng, const struct random_scene *random, double size_mm,
                                   double out_mm[3])
{
    const struct io_scene *const scene = &random->scene;
    const double kind = uniform(rng, 0, 1);
    double direction[3];
    random_vertex(rng, random, out_mm);
    if (kind < 0.1)
        return;
    random_direction(rng, direction);
    const double distance_mm = kind < 0.12  ? log_uniform(rng, 1, RANDOM_COORDINATE_MM)
                               : kind < 0.2 ? 0
                               : kind < 0.3 ? size_mm * log_uniform(rng, 1e-6, 1)
                               : kind < 0.9 ? size_mm * uniform(rng, 1.5, 8)
                                            : size_mm * log_uniform(rng, 10, 1e6);
    for (int k = 0; k < 3; k++) {
        const double from_mm = chance(rng, 0.9) ? 0.5 * (scene->min_mm[k] + scene->max_mm[k]) : out_mm[k];
        out_mm[k] =
            fmax(fmin(from_mm + distance_mm * direction[k], RANDOM_COORDINATE_MM), -RANDOM_COORDINATE_MM);
    }
}

static inline void random_camera(struct rng *rng, struct random_scene *random, double size_mm)
{
    static const int sizes[][2] = { { 1, 1 }, { 4096, 1 }, { 1, 4096 }, { 2, 3 }, { 1, 7 }, { 17, 1 } };
    struct io_camera *const camera = &random->scene.camera;
    double aim_mm[3], aside[3], length2 = 0;
    *camera = (struct io_camera){ .is_orthographic = chance(rng, 0.3) };
    random_place_mm(rng, random, size_mm, camera->eye_mm);
    if (chance(rng, 0.9))
        random_vertex(rng, random, aim_mm);
    else
        random_place_mm(rng, random, size_mm, aim_mm);
    for (int k = 0; k < 3; k++)
        length2 += (aim_mm[k] - camera->eye_mm[k]) * (aim_mm[k] - camera->eye_mm[k]);
    if (!(length2 > 0)) { /* a scene file must name another point */
        aim_mm[0] = camera->eye_mm[0] + fmax(size_mm, 1e-6 * fabs(camera->eye_mm[0]));
        memcpy(aim_mm + 1, camera->eye_mm + 1, 2 * sizeof *aim_mm);
    }
    const bool is_away = chance(rng, 0.05);
    for (int k = 0; k < 3; k++)
        camera->target_mm[k] = is_away ? 2 * camera->eye_mm[k] - aim_mm[k] : aim_mm[k];
    do {
        double view[3], length = 0, along = 0;
        random_direction(rng, camera->up);
        for (int k = 0; k < 3; k++) {
            view[k] = camera->target_mm[k] - camera->eye_mm[k];
            length += view[k] * view[k];
        }
        for (int k = 0; k < 3; k++)
            along += view[k] / sqrt(length) * camera->up[k];
        for (int k = 0; k < 3; k++)
            aside[k] = camera->up[k] - along * view[k] / sqrt(length);
    } while (sqrt(aside[0] * aside[0] + aside[1] * aside[1] + aside[2] * aside[2]) < 1e-3);
    camera->fov_y_rad = (chance(rng, 0.8) ? uniform(rng, 15, 60) : uniform(rng, 1, 170)) * acos(-1) / 180;
    camera->height_mm = size_mm * (chance(rng, 0.8) ? uniform(rng, 1, 6) : log_uniform(rng, 1e-3, 1e3));
    camera->width_px = 1 + 2 * random_index(rng, 16);
    camera->height_px = 1 + 2 * random_index(rng, 16);
    if (chance(rng, 0.2)) {
        const int *const size = sizes[random_index(rng, (int)(sizeof sizes / sizeof *sizes))];
        camera->width_px = size[0];
        camera->height_px = size[1];
    }
}

static inline void random_light(struct rng *rng, struct random_scene *random, double size_mm)
{
    struct io_light *const light = &random->lights[random->scene.light_count++];
    *light = (struct io_light){ .kind = chance(rng, 0.5) ? IO_LIGHT_POINT : IO_LIGHT_DIRECTIONAL };
    random_direction(rng, light->direction);
    random_place_mm(rng, random, size_mm, light->position_mm);
    if (chance(rng, 0.1))
        memcpy(light->position_mm, random->scene.camera.eye_mm, sizeof light->position_mm);
    const double power = chance(rng, 0.7) ? uniform(rng, 0.5, 5) : log_uniform(rng, 1e-12, RANDOM_POWER);
    const int only = random_index(rng, 12); /* 0 to 2: that channel; 3: black */
    for (int c = 0; c < 3; c++)
        light->rgb[c] = only == c || only > 3 ? power * uniform(rng, 0.5, 1) : 0;
}

/* ---- the scene ---------------------------------------------------------------------------------- */

static inline void random_scene_init(struct random_scene *random, uint64_t seed,
                                     const struct random_shares *shares)
{
    static const enum render_technique techniques[] = { RENDER_TECHNIQUE_AUTO, RENDER_TECHNIQUE_SPLAT,
                                                        RENDER_TECHNIQUE_LAMBERT, RENDER_TECHNIQUE_TSM };
    struct rng rng = { .seed = seed };
    memset(random, 0, sizeof *random);
    random->seed = seed;
    strcpy(random->scene.path, "random");
    random->scene.lights = random->lights;
    random->scene.objects = random->objects;
    const double size_mm = chance(&rng, 0.6) ? log_uniform(&rng, 0.1, 100) : log_uniform(&rng, 1e-6, 1e6);
    double middle_mm[3];
    for (int k = 0; k < 3; k++)
        middle_mm[k] = chance(&rng, 0.9) ? 0 : size_mm * log_uniform(&rng, 1, 1e8);
    const int object_count = chance(&rng, 0.4) ? 1 : 1 + random_index(&rng, RANDOM_OBJECTS);
    for (int i = 0; i < object_count; i++)
        random_object(&rng, random, size_mm, middle_mm, shares);
    random_camera(&rng, random, size_mm);
    const int light_count = random_index(&rng, RANDOM_LIGHTS + 1);
    for (int i = 0; i < light_count; i++)
        random_light(&rng, random, size_mm);
    random->scene.exposure_ev = chance(&rng, 0.8) ? uniform(&rng, -4, 4) : uniform(&rng, -100, 100);
    for (int c = 0; c < 3; c++)
        random->scene.background[c] = chance(&rng, 0.5) ? uniform(&rng, 0, 1) : 0;
    random->technique = techniques[random_index(&rng, (int)(sizeof techniques / sizeof *techniques))];
    random->epsilon = chance(&rng, 0.8) ? log_uniform(&rng, 3e-3, 0.1)
                                        : log_uniform(&rng, RENDER_EPSILON_MIN, RENDER_EPSILON_MAX);
    random->area = chance(&rng, 0.1) ? RENDER_AREA_OVERLAP : RENDER_AREA_FLUX;
    random->is_captured = chance(&rng, 0.1);
    random->is_tone_mapped = chance(&rng, 0.3);
    if (random->is_captured || chance(&rng, 0.05))
        random->spacing_mm = size_mm * log_uniform(&rng, 1e-2, 10);
}

static inline void random_scene_end(struct random_scene *random)
{
    for (size_t i = 0; i < random->scene.object_count; i++)
        io_mesh_destroy(random->objects[i].mesh);
}

static inline struct render_request random_scene_request(const struct random_scene *random)
{
    return (struct render_request){ .scene = &random->scene,
                                    .epsilon = random->epsilon,
                                    .spacing_mm = random->spacing_mm,
                                    .technique = random->technique,
                                    .area = random->area,
                                    .is_captured = random->is_captured,
                                    .is_tone_mapped = random->is_tone_mapped };
}

#endif
