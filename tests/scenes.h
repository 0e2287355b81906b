/* Scenes in memory for the tests of the renderer. */
#ifndef SCENES_H
#define SCENES_H

#include "io/scene_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SCENE_LIGHTS = 4, SCENE_OBJECTS = 2 };

/* Storage of a scene; begin with scene_init, end with scene_end. */
struct test_scene {
    struct io_scene scene;
    struct io_light lights[SCENE_LIGHTS];
    struct io_object objects[SCENE_OBJECTS];
};

/* Marble of Jensen et al. 2001. */
static inline struct io_material marble(void)
{
    const double sigma_a[3] = { 0.0021, 0.0041, 0.0071 }, sigma_s_prime[3] = { 2.19, 2.62, 3.00 };
    struct io_material material = { .name = "marble" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] = (dipole_medium){ .sigma_a_per_mm = sigma_a[c],
                                    .sigma_s_prime_per_mm = sigma_s_prime[c],
                                    .eta = 1.5 };
    io_material_set_media(&material, media);
    return material;
}

/* Skin1 of Jensen et al. 2001. */
static inline struct io_material skin1(void)
{
    const double sigma_a[3] = { 0.032, 0.17, 0.48 }, sigma_s_prime[3] = { 0.74, 0.88, 1.01 };
    struct io_material material = { .name = "skin1" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++)
        media[c] = (dipole_medium){ .sigma_a_per_mm = sigma_a[c],
                                    .sigma_s_prime_per_mm = sigma_s_prime[c],
                                    .eta = 1.3 };
    io_material_set_media(&material, media);
    return material;
}

/* An empty scene with a camera that looks along -z from distance_mm, 60 x 45 pixels. */
static inline void scene_init(struct test_scene *test, double distance_mm)
{
    memset(test, 0, sizeof *test);
    strcpy(test->scene.path, "test");
    test->scene.lights = test->lights;
    test->scene.objects = test->objects;
    test->scene.camera = (struct io_camera){ .eye_mm = { 0, 0, distance_mm },
                                             .up = { 0, 1, 0 },
                                             .fov_y_rad = 0.5,
                                             .width_px = 60,
                                             .height_px = 45 };
}

/* Add a primitive, scaled about the origin and moved along x; true when there was memory. */
static inline bool scene_add(struct test_scene *test, enum io_primitive primitive, int detail,
                             double scale_mm, double x_mm, const struct io_material *material)
{
    struct io_object *const object = &test->objects[test->scene.object_count++];
    *object = (struct io_object){ .material = *material, .roughness = 0.3 };
    snprintf(object->name, sizeof object->name, "object %zu", test->scene.object_count);
    if (!io_mesh_create_primitive(primitive, detail, &object->mesh, NULL))
        return false;
    struct io_mesh *const mesh = object->mesh;
    for (int k = 0; k < 3; k++) {
        if (test->scene.object_count == 1) {
            test->scene.min_mm[k] = INFINITY;
            test->scene.max_mm[k] = -INFINITY;
        }
        for (size_t v = 0; v < mesh->vertex_count; v++) {
            float *const p = &mesh->positions[3 * v + (size_t)k];
            *p = (float)((double)*p * scale_mm + (k == 0 ? x_mm : 0));
            test->scene.min_mm[k] = fmin(test->scene.min_mm[k], (double)*p);
            test->scene.max_mm[k] = fmax(test->scene.max_mm[k], (double)*p);
        }
        mesh->min[k] = (float)((double)mesh->min[k] * scale_mm + (k == 0 ? x_mm : 0));
        mesh->max[k] = (float)((double)mesh->max[k] * scale_mm + (k == 0 ? x_mm : 0));
    }
    return true;
}

static inline void scene_add_directional(struct test_scene *test, double x, double y, double z,
                                         double irradiance)
{
    const double length = sqrt(x * x + y * y + z * z);
    test->lights[test->scene.light_count++] =
        (struct io_light){ .kind = IO_LIGHT_DIRECTIONAL,
                           .direction = { x / length, y / length, z / length },
                           .rgb = { irradiance, irradiance, irradiance } };
}

static inline void scene_add_point(struct test_scene *test, double x, double y, double z, double intensity)
{
    test->lights[test->scene.light_count++] = (struct io_light){
        .kind = IO_LIGHT_POINT, .position_mm = { x, y, z }, .rgb = { intensity, intensity, intensity }
    };
}

static inline void scene_end(struct test_scene *test)
{
    for (size_t i = 0; i < test->scene.object_count; i++)
        io_mesh_destroy(test->objects[i].mesh);
}

#endif
