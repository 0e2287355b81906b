/* Meshes that follow each other, frame by frame. */
#include "io/mesh_internal.h"
#include "io/scene_motion.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where a pattern wants its number: one %d or %04d, and no other per cent sign. */
struct pattern {
    const char *text, *rest;
    int prefix_length, width;
};

static bool parse_pattern(const char *text, struct pattern *out)
{
    const char *const sign = strchr(text, '%');
    if (!sign || strchr(sign + 1, '%'))
        return false;
    const char *c = sign + 1;
    *out = (struct pattern){ .text = text, .prefix_length = (int)(sign - text) };
    if (c[0] == '0' && c[1] >= '1' && c[1] <= '9') {
        out->width = c[1] - '0';
        c += 2;
    }
    out->rest = c + 1;
    return *c == 'd';
}

/* A mesh, placed as the first one is. The triangles of all are counted before the next is read. */
static bool add_mesh(const struct io_motion_reading *reading, const struct io_json *at, const char *name,
                     struct io_motion *motion, size_t *triangle_count, dipole_status *status)
{
    struct io_mesh **const mesh = &motion->meshes[motion->mesh_count];
    if (!io_scene_read_mesh(at, name, reading->options, mesh, status))
        return false;
    motion->mesh_count++; /* it is ours */
    *triangle_count += (*mesh)->triangle_count;
    if (*triangle_count > IO_MESH_TRIANGLE_LIMIT)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status,
                            "brings the sequence to %zu triangles with \"%.100s\", expected at most %u",
                            *triangle_count, name, IO_MESH_TRIANGLE_LIMIT);
    return (motion->mesh_count > 1 || io_scene_fit_mesh(reading->at, *mesh, reading->transform, status)) &&
           io_scene_place_mesh(reading->at, reading->transform, reading->unit_mm, *mesh, status);
}

static bool create_list(const struct io_json *at, size_t count, struct io_motion *motion,
                        dipole_status *status)
{
    motion->meshes = calloc(count, sizeof(void *));
    return motion->meshes || io_json_fail(at, DIPOLE_OUT_OF_MEMORY, status, "does not fit into memory");
}

static bool read_list(const struct io_motion_reading *reading, const struct io_json *at,
                      struct io_motion *motion, dipole_status *status)
{
    size_t count, triangle_count = 0;
    if (!io_json_check_array(at, 1, IO_MESH_SEQUENCE_LIMIT, &count, status) ||
        !create_list(at, count, motion, status))
        return false;
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(at, i);
        const char *const name = json_string_value(element.value);
        if (!name)
            return io_json_fail(&element, DIPOLE_BAD_VALUE, status,
                                "is not a string, expected the path of a mesh file");
        if (!add_mesh(reading, &element, name, motion, &triangle_count, status))
            return false;
    }
    return true;
}

static bool read_pattern(const struct io_motion_reading *reading, const struct io_json *at,
                         struct io_motion *motion, dipole_status *status)
{
    static const char *const known[] = { "pattern", "count", "first", NULL };
    const struct io_json text = io_json_member(at, "pattern");
    struct pattern pattern;
    int first = 0, count = 1;
    size_t triangle_count = 0;
    if (!io_json_check_object(at, known, 2, status) ||
        !io_json_get_integer(at, "count", 1, IO_MESH_SEQUENCE_LIMIT, &count, status) ||
        !io_json_get_integer(at, "first", 0, 1000000, &first, status))
        return false;
    if (!json_is_string(text.value) || !parse_pattern(json_string_value(text.value), &pattern))
        return io_json_fail(&text, DIPOLE_BAD_VALUE, status,
                            "is %s%.100s%s, expected a path with one %%d, or %%04d for leading zeros",
                            json_is_string(text.value) ? "\"" : "no string",
                            json_is_string(text.value) ? json_string_value(text.value) : "",
                            json_is_string(text.value) ? "\"" : "");
    if (!create_list(at, (size_t)count, motion, status))
        return false;
    for (int i = 0; i < count; i++) {
        char name[PATH_MAX];
        const int length = snprintf(name, sizeof name, "%.*s%0*d%s", pattern.prefix_length, pattern.text,
                                    pattern.width, first + i, pattern.rest);
        if (length >= PATH_MAX)
            return io_json_fail(&text, DIPOLE_BAD_VALUE, status, "is %d bytes long, expected at most %d",
                                length, PATH_MAX - 1);
        if (!add_mesh(reading, &text, name, motion, &triangle_count, status))
            return false;
    }
    return true;
}

bool io_scene_read_sequence(const struct io_motion_reading *reading, struct io_motion *motion,
                            dipole_status *status)
{
    const struct io_json at = io_json_member(reading->at, "mesh_sequence");
    static const char *const others[] = { "mesh", "primitive", "detail" };
    for (size_t i = 0; i < 3; i++) {
        const struct io_json other = io_json_member(reading->at, others[i]);
        if (other.value)
            return io_json_fail(&at, DIPOLE_BAD_VALUE, status, "stands beside %s, expected one of the two",
                                others[i]);
    }
    return json_is_array(at.value) ? read_list(reading, &at, motion, status)
                                   : read_pattern(reading, &at, motion, status);
}
