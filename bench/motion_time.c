/*
 * What motion costs: a frame of a scene drawn as its file says, its vertices deformed and moved by shaders,
 * and the same with meshes that were posed beforehand and stand still, in turns. usage: bench_motion_time
 * SCENE.json FRAME TECHNIQUE TIMES
 *
 * Markdown cells: CPU ms of setting the frame and drawing it, the least of all times; of drawing the meshes
 * that stand still; their ratio.
 */
#include "renderer/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Of all threads of this process: others may use the machine. */
static double cpu_ms(void)
{
    return 1e3 * (double)clock() / CLOCKS_PER_SEC;
}

/* Leave nothing for the shaders to do. */
static void freeze(struct io_scene *scene)
{
    for (size_t i = 0; i < scene->object_count; i++) {
        scene->objects[i].rest = scene->objects[i].mesh;
        scene->objects[i].pose = (struct io_pose){ .deform_count = 0 };
    }
}

static bool draw(struct renderer *renderer, const struct render_options *options, dipole_status *status)
{
    struct io_image *image = NULL;
    const bool done = render_draw(renderer, options, &image, NULL, status);
    io_image_destroy(image);
    return done;
}

/* A scene of its own for each way: meshes are not taken to OpenGL anew. */
static bool run(char **arguments, const struct render_options *options, dipole_status *status)
{
    const struct io_scene_options reading = { .width_px = 320, .height_px = 240 };
    const int frame = atoi(arguments[2]), times = atoi(arguments[4]);
    struct io_scene *scenes[2] = { NULL, NULL };
    struct renderer *renderers[2] = { NULL, NULL };
    double least_ms[2] = { INFINITY, INFINITY };
    bool done = true;
    for (int k = 0; k < 2 && done; k++) {
        done = io_scene_read(arguments[1], &reading, &scenes[k], status);
        if (done)
            io_scene_set_frame(scenes[k], frame);
        if (done && k == 1)
            freeze(scenes[k]);
        done = done && render_create(scenes[k], RENDER_CONTEXT_DEFAULT, &renderers[k], status) &&
               draw(renderers[k], options, status);
    }
    for (int i = 0; i < 2 * times && done; i++) {
        const int k = i % 2;
        const double start_ms = cpu_ms();
        if (k == 0)
            io_scene_set_frame(scenes[k], frame);
        done = draw(renderers[k], options, status);
        least_ms[k] = fmin(least_ms[k], cpu_ms() - start_ms);
    }
    if (done)
        printf("%.0f | %.0f | %.3f\n", least_ms[0], least_ms[1], least_ms[0] / least_ms[1]);
    for (int k = 0; k < 2; k++) {
        render_destroy(renderers[k]);
        io_scene_destroy(scenes[k]);
    }
    return done;
}

int main(int argc, char **argv)
{
    dipole_status status = { 0 };
    if (argc != 5) {
        fputs("usage: bench_motion_time SCENE.json FRAME TECHNIQUE TIMES\n", stderr);
        return 2;
    }
    struct render_options options = { .epsilon = 0.03, .coherence = RENDER_COHERENCE_NONE };
    for (int t = 0; render_technique_names[t]; t++) {
        if (strcmp(render_technique_names[t], argv[3]) == 0)
            options.technique = (enum render_technique)t;
    }
    if (run(argv, &options, &status))
        return 0;
    fprintf(stderr, "bench_motion_time: %s\n", status.message);
    return 1;
}
