#include "io/scene_motion.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FRAME_LIMIT = 100000 };

bool io_scene_read_frames(const struct io_json *at, struct io_scene *scene, dipole_status *status)
{
    static const char *const known[] = { "count", "camera_turn_deg", "lights_turn_deg", NULL };
    struct io_frames *const frames = &scene->frames;
    *frames = (struct io_frames){ .count = 1, .camera = scene->camera };
    if (at->value && (!io_json_check_object(at, known, 1, status) ||
                      !io_json_get_integer(at, "count", 1, FRAME_LIMIT, &frames->count, status) ||
                      !io_json_get_number(at, "camera_turn_deg", -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX,
                                          &frames->camera_turn_deg, status) ||
                      !io_json_get_number(at, "lights_turn_deg", -IO_SCENE_LENGTH_MAX, IO_SCENE_LENGTH_MAX,
                                          &frames->lights_turn_deg, status)))
        return false;
    if (scene->light_count == 0)
        return true;
    frames->lights = calloc(scene->light_count, sizeof *frames->lights);
    if (!frames->lights)
        return io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    memcpy(frames->lights, scene->lights, scene->light_count * sizeof *frames->lights);
    return true;
}

/* Turn v by an angle about a unit axis, counter-clockwise seen against it (Rodrigues). */
static void turn(double v[3], const double axis[3], double angle_rad)
{
    const double s = sin(angle_rad), c = cos(angle_rad), before[3] = { v[0], v[1], v[2] };
    const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
    for (int x = 0; x < 3; x++) {
        const int y = (x + 1) % 3, z = (x + 2) % 3;
        v[x] = c * before[x] + s * (axis[y] * before[z] - axis[z] * before[y]) + (1 - c) * along * axis[x];
    }
}

static void turn_about(double point[3], const double centre[3], const double axis[3], double angle_rad)
{
    double from_centre[3];
    for (int x = 0; x < 3; x++)
        from_centre[x] = point[x] - centre[x];
    turn(from_centre, axis, angle_rad);
    for (int x = 0; x < 3; x++)
        point[x] = centre[x] + from_centre[x];
}

/* Whole turns are left out exactly: then the angle is 0. */
static double angle_of_frame(const struct io_frames *frames, double turn_deg, int frame)
{
    return remainder(turn_deg * frame / frames->count, 360) * IO_SCENE_RAD_PER_DEG;
}

void io_scene_set_frame(struct io_scene *scene, int frame)
{
    static const double y[3] = { 0, 1, 0 };
    const struct io_frames *const frames = &scene->frames;
    assert(frame >= 0 && frame <= frames->count);
    const double camera_rad = angle_of_frame(frames, frames->camera_turn_deg, frame),
                 lights_rad = angle_of_frame(frames, frames->lights_turn_deg, frame);
    scene->camera = frames->camera;
    if (scene->light_count > 0)
        memcpy(scene->lights, frames->lights, scene->light_count * sizeof *scene->lights);
    if (camera_rad != 0) { /* at 0 even the rounding of a turn would show */
        double up[3];
        memcpy(up, scene->camera.up, sizeof up);
        io_scene_normalize(up);
        turn_about(scene->camera.eye_mm, scene->camera.target_mm, up, camera_rad);
    }
    for (size_t i = 0; i < scene->light_count && lights_rad != 0; i++) {
        if (scene->lights[i].kind == IO_LIGHT_POINT)
            turn_about(scene->lights[i].position_mm, scene->camera.target_mm, y, lights_rad);
        else
            turn(scene->lights[i].direction, y, lights_rad);
    }
    io_scene_pose_objects(scene, frame);
}
