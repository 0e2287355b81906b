/* What objects do over the frames: deformations, rigid motion, sequences of meshes. */
#include "io/scene_motion.h"

#include "io/mesh_internal.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Bounds of what a file may say: large enough for anything that can be seen. */
#define ANGLE_MAX_DEG 36000.0
#define CYCLES_MAX 1000.0

/* How many frames tell how far a deformation stretches the mesh: the middle is one of them. */
enum { STRETCH_FRAMES = 9 };

static const char *const paths[] = { "straight", "there_and_back", NULL };

/* ---- reading ------------------------------------------------------------------------------------- */

/* One number, or two: of the first frame, and of the one after the last. */
static bool get_span(const struct io_json *at, const char *key, double limit, double out[2],
                     dipole_status *status)
{
    if (json_is_array(io_json_member(at, key).value))
        return io_json_get_numbers(at, key, 2, -limit, limit, out, status);
    if (!io_json_get_number(at, key, -limit, limit, out, status))
        return false;
    out[1] = out[0];
    return true;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* How far a mesh reaches along a direction, from a point. */
static void reach_along(const struct io_mesh *mesh, const double origin_mm[3], const double direction[3],
                        double reach_mm[2])
{
    reach_mm[0] = INFINITY;
    reach_mm[1] = -INFINITY;
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        double from_mm[3];
        for (size_t k = 0; k < 3; k++)
            from_mm[k] = (double)mesh->positions[3 * v + k] - origin_mm[k];
        reach_mm[0] = fmin(reach_mm[0], dot(from_mm, direction));
        reach_mm[1] = fmax(reach_mm[1], dot(from_mm, direction));
    }
}

/* A point in scene units; by default the middle of the mesh. */
static bool get_point(const struct io_motion_reading *reading, const struct io_json *at, const char *key,
                      const struct io_mesh *mesh, double out_mm[3], dipole_status *status)
{
    for (int k = 0; k < 3; k++)
        out_mm[k] = 0.5 * ((double)mesh->min[k] + (double)mesh->max[k]);
    if (!io_json_member(at, key).value)
        return true;
    if (!io_scene_get_coordinates(at, key, out_mm, status))
        return false;
    io_scene_scale_to_mm(out_mm, reading->unit_mm);
    return true;
}

static bool get_direction(const struct io_json *at, const char *key, double out[3], dipole_status *status)
{
    const struct io_json direction = io_json_member(at, key);
    if (!io_scene_get_coordinates(at, key, out, status))
        return false;
    return io_scene_normalize(out) ||
           io_json_fail(&direction, DIPOLE_BAD_VALUE, status, "is [0, 0, 0], expected a direction");
}

/* Unit vector at a right angle to the axis: as asked, or x, or z where the axis is x. */
static bool get_toward(const struct io_json *at, const double axis[3], double out[3], dipole_status *status)
{
    const struct io_json toward = io_json_member(at, "toward");
    const bool is_axis_x = fabs(axis[0]) > 0.9;
    out[0] = !is_axis_x;
    out[1] = 0;
    out[2] = is_axis_x;
    if (!get_direction(at, "toward", out, status))
        return false;
    const double along = dot(out, axis);
    for (int k = 0; k < 3; k++)
        out[k] -= along * axis[k];
    const bool is_apart = io_scene_length(out) > 1e-6;
    if (is_apart)
        io_scene_normalize(out);
    return is_apart || io_json_fail(&toward, DIPOLE_BAD_VALUE, status,
                                    "is parallel to axis, expected another direction");
}

/* The length over which an angle is reached; by default all of the mesh along the axis. */
static bool get_length(const struct io_motion_reading *reading, const struct io_json *at,
                       const struct io_mesh *mesh, const struct io_deform *deform, double *length_mm,
                       dipole_status *status)
{
    const struct io_json length = io_json_member(at, "length");
    if (length.value) {
        if (!io_json_get_number(at, "length", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX, length_mm, status))
            return false;
        *length_mm *= reading->unit_mm;
        return true;
    }
    double reach_mm[2];
    reach_along(mesh, deform->origin_mm, deform->axis, reach_mm);
    *length_mm = reach_mm[1] - reach_mm[0];
    return *length_mm > 0 || io_json_fail(&length, DIPOLE_BAD_VALUE, status,
                                          "is missing, but the mesh is flat along axis, expected it");
}

/* What bends as far as its own thickness would be turned inside out. Only of the first deformation is it
 * known where the mesh is. */
static bool check_bend(const struct io_json *at, const struct io_mesh *mesh,
                       const struct io_deform_track *track, double length_mm, dipole_status *status)
{
    const struct io_json angle = io_json_member(at, "angle_deg");
    const double rates[2] = { track->first, track->last };
    double reach_mm[2];
    reach_along(mesh, track->deform.origin_mm, track->deform.toward, reach_mm);
    for (int i = 0; i < 2; i++) {
        const double inside_mm = rates[i] > 0 ? reach_mm[1] : -reach_mm[0];
        if (fabs(rates[i]) * inside_mm >= 1)
            return io_json_fail(&angle, DIPOLE_BAD_VALUE, status,
                                "is %g over %.4g mm, which bends the mesh, %.4g mm thick to the inside, "
                                "into itself, expected less than %.4g",
                                rates[i] * length_mm / IO_SCENE_RAD_PER_DEG, length_mm, inside_mm,
                                length_mm / inside_mm / IO_SCENE_RAD_PER_DEG);
    }
    return true;
}

static bool read_angle(const struct io_motion_reading *reading, const struct io_json *at, bool is_first,
                       const struct io_mesh *mesh, struct io_deform_track *track, dipole_status *status)
{
    static const char *const twist_keys[] = {
        "kind", "angle_deg", "length", "axis", "origin", "path", NULL
    };
    static const char *const bend_keys[] = { "kind",   "angle_deg", "length", "axis",
                                             "origin", "toward",    "path",   NULL };
    const bool is_bend = track->deform.kind == IO_DEFORM_BEND;
    double angle_deg[2], length_mm = 0;
    if (!io_json_check_object(at, is_bend ? bend_keys : twist_keys, 2, status) ||
        !get_span(at, "angle_deg", ANGLE_MAX_DEG, angle_deg, status) ||
        !get_length(reading, at, mesh, &track->deform, &length_mm, status))
        return false;
    track->first = angle_deg[0] * IO_SCENE_RAD_PER_DEG / length_mm;
    track->last = angle_deg[1] * IO_SCENE_RAD_PER_DEG / length_mm;
    return !is_bend || !is_first || check_bend(at, mesh, track, length_mm, status);
}

static bool read_wave(const struct io_motion_reading *reading, const struct io_json *at,
                      struct io_deform_track *track, dipole_status *status)
{
    static const char *const known[] = { "kind",   "amplitude", "wavelength", "axis", "origin",
                                         "toward", "phase_deg", "cycles",     "path", NULL };
    double amplitude[2], wavelength = 1;
    if (!io_json_check_object(at, known, 3, status) ||
        !get_span(at, "amplitude", IO_SCENE_LENGTH_MAX, amplitude, status) ||
        !io_json_get_number(at, "wavelength", IO_SCENE_LENGTH_MIN, IO_SCENE_LENGTH_MAX, &wavelength,
                            status) ||
        !io_json_get_number(at, "phase_deg", -ANGLE_MAX_DEG, ANGLE_MAX_DEG, &track->phase_deg, status) ||
        !io_json_get_number(at, "cycles", -CYCLES_MAX, CYCLES_MAX, &track->cycles, status))
        return false;
    track->deform.rate_rad_per_mm = 2 * PI / (wavelength * reading->unit_mm);
    track->first = amplitude[0] * reading->unit_mm;
    track->last = amplitude[1] * reading->unit_mm;
    const struct io_json at_amplitude = io_json_member(at, "amplitude");
    return fmax(fabs(track->first), fabs(track->last)) <= IO_SCENE_REACH_MAX_MM ||
           io_json_fail(&at_amplitude, DIPOLE_BAD_VALUE, status, "reaches %g mm, expected at most %g mm",
                        fmax(fabs(track->first), fabs(track->last)), IO_SCENE_REACH_MAX_MM);
}

static bool read_track(const struct io_motion_reading *reading, const struct io_json *at, bool is_first,
                       const struct io_mesh *mesh, struct io_deform_track *track, dipole_status *status)
{
    const struct io_json kind_at = io_json_member(at, "kind");
    int kind = 0, path = 0;
    *track = (struct io_deform_track){ .deform = { .axis = { 0, 1, 0 } } };
    if (!json_is_object(at->value))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status, "is no object, expected one with kind");
    if (!kind_at.value)
        return io_json_fail(&kind_at, DIPOLE_BAD_VALUE, status, "is missing, expected twist, bend or wave");
    if (!io_json_get_choice(at, "kind", io_deform_kind_names, &kind, status) ||
        !get_direction(at, "axis", track->deform.axis, status) ||
        !get_point(reading, at, "origin", mesh, track->deform.origin_mm, status) ||
        !get_toward(at, track->deform.axis, track->deform.toward, status) ||
        !io_json_get_choice(at, "path", paths, &path, status))
        return false;
    track->deform.kind = (enum io_deform_kind)kind;
    track->is_there_and_back = path == 1;
    return kind == IO_DEFORM_WAVE ? read_wave(reading, at, track, status)
                                  : read_angle(reading, at, is_first, mesh, track, status);
}

static bool read_deforms(const struct io_motion_reading *reading, const struct io_mesh *mesh,
                         struct io_motion *motion, dipole_status *status)
{
    const struct io_json at = io_json_member(reading->at, "deform");
    size_t count;
    if (!at.value)
        return true;
    if (!io_json_check_array(&at, 1, IO_DEFORM_LIMIT, &count, status))
        return false;
    for (; motion->track_count < count; motion->track_count++) {
        const struct io_json element = io_json_element(&at, motion->track_count);
        if (!read_track(reading, &element, motion->track_count == 0, mesh,
                        &motion->tracks[motion->track_count], status))
            return false;
    }
    return true;
}

/* A turn and a step, of a key or of all frames together. */
static bool get_turn(const struct io_motion_reading *reading, const struct io_json *at,
                     struct io_motion_key *key, dipole_status *status)
{
    const struct io_json translate = io_json_member(at, "translate");
    if (!io_json_get_number(at, "turn_deg", -ANGLE_MAX_DEG, ANGLE_MAX_DEG, &key->turn_deg, status) ||
        !io_scene_get_coordinates(at, "translate", key->translate_mm, status))
        return false;
    io_scene_scale_to_mm(key->translate_mm, reading->unit_mm);
    return io_scene_length(key->translate_mm) <= IO_SCENE_REACH_MAX_MM ||
           io_json_fail(&translate, DIPOLE_BAD_VALUE, status, "reaches %g mm, expected at most %g mm",
                        io_scene_length(key->translate_mm), IO_SCENE_REACH_MAX_MM);
}

static bool create_keys(const struct io_json *at, size_t count, struct io_motion *motion,
                        dipole_status *status)
{
    motion->keys = calloc(count, sizeof *motion->keys);
    return motion->keys || io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
}

static bool read_keys(const struct io_motion_reading *reading, const struct io_json *at,
                      struct io_motion *motion, dipole_status *status)
{
    static const char *const known[] = { "frame", "turn_deg", "translate", NULL };
    size_t count;
    if (!io_json_check_array(at, 2, IO_KEY_LIMIT, &count, status) ||
        !create_keys(at, count, motion, status))
        return false;
    for (; motion->key_count < count; motion->key_count++) {
        const struct io_json element = io_json_element(at, motion->key_count),
                             frame_at = io_json_member(&element, "frame");
        struct io_motion_key *const key = &motion->keys[motion->key_count];
        if (!io_json_check_object(&element, known, 1, status) ||
            !io_json_get_number(&element, "frame", 0, 1e6, &key->frame, status) ||
            !get_turn(reading, &element, key, status))
            return false;
        if (motion->key_count > 0 && !(key->frame > key[-1].frame))
            return io_json_fail(&frame_at, DIPOLE_BAD_VALUE, status,
                                "is %g, expected more than that of the key before, %g", key->frame,
                                key[-1].frame);
    }
    return true;
}

/* From where it is at frame 0 to a turn and a step at the frame after the last. */
static bool read_span(const struct io_motion_reading *reading, const struct io_json *at,
                      struct io_motion *motion, dipole_status *status)
{
    int path = 0;
    if (!create_keys(at, 2, motion, status) || !get_turn(reading, at, &motion->keys[1], status) ||
        !io_json_get_choice(at, "path", paths, &path, status))
        return false;
    motion->key_count = 2;
    motion->keys[1].frame = reading->frame_count;
    motion->is_there_and_back = path == 1;
    return true;
}

static bool read_move(const struct io_motion_reading *reading, const struct io_mesh *mesh,
                      struct io_motion *motion, dipole_status *status)
{
    static const char *const span_keys[] = { "turn_deg", "translate", "axis", "point", "path", NULL };
    static const char *const keys_keys[] = { "keys", "axis", "point", "interpolate", NULL };
    static const char *const interpolations[] = { "linear", "catmull_rom", NULL };
    const struct io_json at = io_json_member(reading->at, "motion"), keys = io_json_member(&at, "keys");
    int interpolation = 0;
    if (!at.value)
        return true;
    memcpy(motion->axis, (const double[3]){ 0, 1, 0 }, sizeof motion->axis);
    if (!io_json_check_object(&at, keys.value ? keys_keys : span_keys, 0, status) ||
        !get_direction(&at, "axis", motion->axis, status) ||
        !get_point(reading, &at, "point", mesh, motion->point_mm, status) ||
        !io_json_get_choice(&at, "interpolate", interpolations, &interpolation, status))
        return false;
    motion->is_smooth = interpolation == 1;
    return keys.value ? read_keys(reading, &keys, motion, status) : read_span(reading, &at, motion, status);
}

/* ---- meshes -------------------------------------------------------------------------------------- */

static bool create_posed(const struct io_motion_reading *reading, struct io_motion *motion,
                         dipole_status *status)
{
    size_t vertex_count = 0, triangle_count = 0;
    if (motion->track_count == 0 && motion->key_count == 0)
        return true;
    for (size_t i = 0; i < motion->mesh_count; i++) {
        const struct io_mesh *const mesh = motion->meshes[i];
        vertex_count = mesh->vertex_count > vertex_count ? mesh->vertex_count : vertex_count;
        triangle_count = mesh->triangle_count > triangle_count ? mesh->triangle_count : triangle_count;
    }
    motion->posed = io_mesh_create(vertex_count, triangle_count);
    return motion->posed ||
           io_json_fail(reading->at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
}

/* The one mesh, or a sequence. */
static bool take_meshes(const struct io_motion_reading *reading, struct io_mesh **mesh,
                        struct io_motion *motion, dipole_status *status)
{
    const struct io_json sequence = io_json_member(reading->at, "mesh_sequence");
    if (sequence.value)
        return io_scene_read_sequence(reading, motion, status);
    motion->meshes = calloc(1, sizeof(void *));
    if (!motion->meshes)
        return io_json_fail(reading->at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    motion->meshes[0] = *mesh;
    motion->mesh_count = 1;
    *mesh = NULL;
    return true;
}

static struct io_pose pose_at(const struct io_motion *motion, int frame);
static void pose_mesh(const struct io_pose *pose, const struct io_mesh *rest, struct io_motion *motion);

static double edge2(const struct io_mesh *mesh, size_t triangle, size_t side)
{
    const float *const a = &mesh->positions[3 * (size_t)mesh->indices[3 * triangle + side]];
    const float *const b = &mesh->positions[3 * (size_t)mesh->indices[3 * triangle + (side + 1) % 3]];
    const double x = (double)a[0] - (double)b[0], y = (double)a[1] - (double)b[1],
                 z = (double)a[2] - (double)b[2];
    return x * x + y * y + z * z;
}

/* Mean over the edges, which counts all alike: meshes have edges as long as they need to be. */
static double mean_stretch2(const struct io_mesh *rest, const struct io_mesh *posed)
{
    double sum = 0, count = 0;
    for (size_t t = 0; t < rest->triangle_count; t++) {
        for (size_t side = 0; side < 3; side++) {
            const double before2 = edge2(rest, t, side);
            if (!(before2 > 0))
                continue;
            sum += edge2(posed, t, side) / before2;
            count++;
        }
    }
    return count > 0 ? sum / count : 1;
}

/* Always true. */
static bool measure_stretch(struct io_motion *motion)
{
    motion->stretch = 1;
    for (int i = 0; i < STRETCH_FRAMES && motion->track_count > 0; i++) {
        const int frame = (int)((double)motion->frame_count * i / (STRETCH_FRAMES - 1));
        const struct io_mesh *const rest = motion->meshes[(size_t)frame % motion->mesh_count];
        const struct io_pose pose = pose_at(motion, frame);
        pose_mesh(&pose, rest, motion);
        motion->stretch = fmax(motion->stretch, sqrt(mean_stretch2(rest, motion->posed)));
    }
    return true;
}

double io_object_stretch(const struct io_object *object)
{
    return object->motion ? object->motion->stretch : 1;
}

bool io_scene_read_motion(const struct io_motion_reading *reading, struct io_mesh **mesh,
                          struct io_motion **motion_out, dipole_status *status)
{
    const json_t *const json = reading->at->value;
    if (!json_object_get(json, "mesh_sequence") && !json_object_get(json, "deform") &&
        !json_object_get(json, "motion"))
        return true;
    struct io_motion *const motion = calloc(1, sizeof *motion);
    if (!motion)
        return io_json_fail(reading->at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
    motion->frame_count = reading->frame_count;
    *motion_out = motion;
    return take_meshes(reading, mesh, motion, status) &&
           read_deforms(reading, motion->meshes[0], motion, status) &&
           read_move(reading, motion->meshes[0], motion, status) && create_posed(reading, motion, status) &&
           measure_stretch(motion);
}

void io_scene_end_shape(struct io_mesh *mesh, struct io_motion *motion)
{
    if (!motion) {
        io_mesh_destroy(mesh);
        return;
    }
    if (motion->mesh_count == 0) /* not taken yet */
        io_mesh_destroy(mesh);
    for (size_t i = 0; i < motion->mesh_count; i++)
        io_mesh_destroy(motion->meshes[i]);
    io_mesh_destroy(motion->posed);
    free(motion->meshes);
    free(motion->keys);
    free(motion);
}

size_t io_scene_triangle_count(const struct io_object *object)
{
    const struct io_motion *const motion = object->motion;
    size_t count = motion ? 0 : object->mesh->triangle_count;
    for (size_t i = 0; motion && i < motion->mesh_count; i++)
        count += motion->meshes[i]->triangle_count;
    return count;
}

struct io_motion_kinds io_object_motion_kinds(const struct io_object *object)
{
    const struct io_motion *const motion = object->motion;
    return (struct io_motion_kinds){ .is_deformed = motion && motion->track_count > 0,
                                     .is_moved = motion && motion->key_count > 0,
                                     .is_sequence = motion && motion->mesh_count > 1 };
}

/* ---- frames -------------------------------------------------------------------------------------- */

/* 0 at the first frame, 1 at the one after the last; or there and back, to exactly 0 since a cosine is
 * flat. */
static double part_of_frames(int frame, int count, bool is_there_and_back)
{
    return is_there_and_back ? 0.5 - 0.5 * cos(2 * PI * frame / count) : (double)frame / count;
}

static struct io_deform deform_at(const struct io_deform_track *track, int frame, int count)
{
    struct io_deform deform = track->deform;
    const double part = part_of_frames(frame, count, track->is_there_and_back);
    const double amount = part == 1 ? track->last : track->first + part * (track->last - track->first);
    if (deform.kind != IO_DEFORM_WAVE) {
        deform.rate_rad_per_mm = amount;
        return deform;
    }
    deform.amplitude_mm = amount;
    deform.phase_rad =
        remainder(track->phase_deg + remainder(360 * track->cycles * frame / count, 360), 360) *
        IO_SCENE_RAD_PER_DEG;
    return deform;
}

/* Turn, then the three coordinates of the step. */
static double component(const struct io_motion_key *key, int i)
{
    return i == 0 ? key->turn_deg : key->translate_mm[i - 1];
}

/* Slope at a key: of the line from the one before to the next one; at the ends of the last piece. */
static double slope_at(const struct io_motion *motion, size_t key, int i)
{
    const size_t before = key > 0 ? key - 1 : key, next = key + 1 < motion->key_count ? key + 1 : key;
    const struct io_motion_key *const a = &motion->keys[before], *const b = &motion->keys[next];
    return (component(b, i) - component(a, i)) / (b->frame - a->frame);
}

static double interpolate(const struct io_motion *motion, size_t key, double t, int i)
{
    const struct io_motion_key *const a = &motion->keys[key], *const b = a + 1;
    const double from = component(a, i), step = component(b, i) - from, width = b->frame - a->frame;
    if (!motion->is_smooth)
        return from + t * step;
    const double slope_a = width * slope_at(motion, key, i), slope_b = width * slope_at(motion, key + 1, i);
    return from +
           t * (slope_a + t * (3 * step - 2 * slope_a - slope_b + t * (slope_a + slope_b - 2 * step)));
}

/* Before the first key and after the last it stands still. */
static struct io_motion_key key_at(const struct io_motion *motion, int frame)
{
    const struct io_motion_key *const keys = motion->keys;
    const size_t last = motion->key_count - 1;
    double at = frame;
    if (motion->is_there_and_back)
        at = part_of_frames(frame, motion->frame_count, true) * motion->frame_count;
    if (at <= keys[0].frame || at >= keys[last].frame)
        return at <= keys[0].frame ? keys[0] : keys[last];
    size_t key = 0;
    while (keys[key + 1].frame <= at)
        key++;
    const double t = (at - keys[key].frame) / (keys[key + 1].frame - keys[key].frame);
    struct io_motion_key found = { .frame = at, .turn_deg = interpolate(motion, key, t, 0) };
    for (int k = 0; k < 3; k++)
        found.translate_mm[k] = interpolate(motion, key, t, k + 1);
    return found;
}

/* Rotation about the axis through the point, then the step. */
static void set_move(const struct io_motion *motion, int frame, struct io_pose *pose)
{
    const struct io_motion_key key = key_at(motion, frame);
    const double angle_rad = remainder(key.turn_deg, 360) * IO_SCENE_RAD_PER_DEG; /* whole turns are 0 */
    const double s = sin(angle_rad), c = cos(angle_rad), *const axis = motion->axis;
    pose->is_moved = angle_rad != 0 || io_scene_length(key.translate_mm) > 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            const int third = 3 - i - k, sign = (k - i + 3) % 3 == 1 ? -1 : 1;
            pose->rotation[i][k] = (1 - c) * axis[i] * axis[k] + (i == k ? c : sign * s * axis[third]);
        }
    }
    for (int i = 0; i < 3; i++)
        pose->shift_mm[i] =
            motion->point_mm[i] - dot(pose->rotation[i], motion->point_mm) + key.translate_mm[i];
}

static struct io_pose pose_at(const struct io_motion *motion, int frame)
{
    struct io_pose pose = { .deform_count = 0 };
    for (size_t i = 0; i < motion->track_count; i++) {
        const struct io_deform deform = deform_at(&motion->tracks[i], frame, motion->frame_count);
        if (!io_deform_is_identity(&deform))
            pose.deforms[pose.deform_count++] = deform;
    }
    if (motion->key_count > 0)
        set_move(motion, frame, &pose);
    return pose;
}

/* Fill the posed mesh from the one at rest. */
static void pose_mesh(const struct io_pose *pose, const struct io_mesh *rest, struct io_motion *motion)
{
    struct io_mesh *const posed = motion->posed;
    posed->vertex_count = rest->vertex_count;
    posed->triangle_count = rest->triangle_count;
    if (motion->indices != rest)
        memcpy(posed->indices, rest->indices, 3 * rest->triangle_count * sizeof *rest->indices);
    motion->indices = rest;
    for (size_t i = 0; i < rest->vertex_count; i++) {
        double position_mm[3], normal[3];
        for (size_t k = 0; k < 3; k++) {
            position_mm[k] = (double)rest->positions[3 * i + k];
            normal[k] = (double)rest->normals[3 * i + k];
        }
        io_pose_apply(pose, position_mm, normal);
        for (size_t k = 0; k < 3; k++) {
            posed->positions[3 * i + k] = (float)position_mm[k];
            posed->normals[3 * i + k] = (float)normal[k];
        }
    }
    io_mesh_update_bounds(posed);
}

static void pose_object(struct io_object *object, int frame)
{
    struct io_motion *const motion = object->motion;
    struct io_mesh *const rest = motion->meshes[(size_t)frame % motion->mesh_count];
    object->rest = rest;
    object->pose = pose_at(motion, frame);
    if (motion->posed)
        pose_mesh(&object->pose, rest, motion);
    object->mesh = motion->posed ? motion->posed : rest;
}

/* Without a sequence: io_scene_read_blocker knows none. */
static void pose_blocker(struct io_blocker *blocker, int frame)
{
    struct io_motion *const motion = blocker->motion;
    const struct io_pose pose = pose_at(motion, frame);
    pose_mesh(&pose, motion->meshes[0], motion);
    blocker->mesh = motion->posed;
}

static void grow_box(struct io_scene *scene, const struct io_mesh *mesh)
{
    for (int axis = 0; axis < 3; axis++) {
        scene->min_mm[axis] = fmin(scene->min_mm[axis], (double)mesh->min[axis]);
        scene->max_mm[axis] = fmax(scene->max_mm[axis], (double)mesh->max[axis]);
    }
}

void io_scene_pose_objects(struct io_scene *scene, int frame)
{
    for (int axis = 0; axis < 3; axis++) {
        scene->min_mm[axis] = INFINITY;
        scene->max_mm[axis] = -INFINITY;
    }
    for (size_t i = 0; i < scene->object_count; i++) {
        if (scene->objects[i].motion)
            pose_object(&scene->objects[i], frame);
        grow_box(scene, scene->objects[i].mesh);
    }
    for (size_t i = 0; i < scene->blocker_count; i++) {
        if (scene->blockers[i].motion)
            pose_blocker(&scene->blockers[i], frame);
    }
}
