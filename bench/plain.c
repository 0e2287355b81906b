/*
 * What effects cost that a scene does not call for: a plain scene, drawn by the renderer as it is, or with
 * PLAIN defined by one from whose list all other effects are missing.
 * usage: bench_plain_all|bench_plain_only   prints the least and the median time of a picture in ms
 */
#include "renderer/effects.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PICTURES = 60, WARM_UP = 10 };

#ifdef PLAIN
const struct render_effect *const render_effects[] = { &render_effect_surface, &render_effect_light_view,
                                                       &render_effect_lambert, &render_effect_composite,
                                                       NULL };
#endif

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* A sphere under one light, without gloss, whose light leaves where it enters. */
static bool init_scene(struct io_scene *scene, struct io_object *object, struct io_light *light,
                       dipole_status *status)
{
    if (!io_material_open("marble", &object->material, status) ||
        !io_mesh_create_primitive(IO_PRIMITIVE_SPHERE, 128, &object->mesh, status))
        return false;
    *light = (struct io_light){ .direction = { 0.6, -0.64, -0.48 }, .rgb = { 1, 1, 1 } };
    *scene = (struct io_scene){ .camera = { .eye_mm = { 0, 0, 4 },
                                            .up = { 0, 1, 0 },
                                            .fov_y_rad = 0.6,
                                            .width_px = 400,
                                            .height_px = 300 },
                                .lights = light,
                                .light_count = 1,
                                .objects = object,
                                .object_count = 1,
                                .min_mm = { -1, -1, -1 },
                                .max_mm = { 1, 1, 1 } };
    return true;
}

int main(void)
{
    struct io_scene scene;
    struct io_object object = { .roughness = 0.3 };
    struct io_light light;
    struct renderer *renderer = NULL;
    dipole_status status = { 0 };
    double times_ms[PICTURES];
    bool done = init_scene(&scene, &object, &light, &status) &&
                render_create(&scene, RENDER_CONTEXT_DEFAULT, &renderer, &status);
    for (int i = 0; done && i < WARM_UP + PICTURES; i++) {
        struct io_image *image;
        struct render_report report;
        done = render_draw(renderer, &(struct render_options){ .technique = RENDER_TECHNIQUE_LAMBERT },
                           &image, &report, &status);
        if (done && i >= WARM_UP)
            times_ms[i - WARM_UP] = report.total_ms;
        if (done)
            io_image_destroy(image);
    }
    if (done) {
        qsort(times_ms, PICTURES, sizeof *times_ms, compare);
        printf("%.3f %.3f\n", times_ms[0], times_ms[PICTURES / 2]);
    } else {
        fprintf(stderr, "bench_plain: %s\n", status.message);
    }
    render_destroy(renderer);
    io_mesh_destroy(object.mesh);
    return done ? 0 : 1;
}
