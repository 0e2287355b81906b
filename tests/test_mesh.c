#include "check.h"

#include "io/mesh_complete.h"
#include "io/mesh_internal.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- helpers ------------------------------------------------------------------------------------- */

static void write_bytes(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static void write_text(const char *path, const char *text)
{
    write_bytes(path, text, strlen(text));
}

static struct io_mesh *read_mesh(const char *path)
{
    struct io_mesh *mesh;
    dipole_status status = { 0 };
    if (!io_mesh_read(path, &mesh, &status))
        fail_msg("%s: %s", status.source, status.message);
    return mesh;
}

static struct io_mesh *read_text(const char *path, const char *text)
{
    write_text(path, text);
    return read_mesh(path);
}

static void assert_refused(const char *path, dipole_code code, const char *message)
{
    struct io_mesh *mesh;
    dipole_status status = { 0 };
    assert_false(io_mesh_read(path, &mesh, &status));
    assert_null(mesh);
    assert_string_equal(status.message, message);
    assert_string_equal(status.source, path);
    assert_int_equal(status.code, code);
}

static void assert_text_refused(const char *path, const char *text, const char *message)
{
    write_text(path, text);
    assert_refused(path, DIPOLE_BAD_VALUE, message);
}

static double component(const struct io_mesh *mesh, const float *vectors, size_t corner, size_t axis)
{
    return (double)vectors[3 * (size_t)mesh->indices[corner] + axis];
}

/* Signed volume: positive when triangles are counter-clockwise from outside. */
static double volume_of(const struct io_mesh *mesh)
{
    double volume = 0;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i += 3) {
        double p[3][3];
        for (size_t k = 0; k < 3; k++)
            for (size_t axis = 0; axis < 3; axis++)
                p[k][axis] = component(mesh, mesh->positions, i + k, axis);
        for (size_t x = 0; x < 3; x++) {
            const size_t y = (x + 1) % 3, z = (x + 2) % 3;
            volume += p[0][x] * (p[1][y] * p[2][z] - p[1][z] * p[2][y]) / 6;
        }
    }
    return volume;
}

static const char tetrahedron_vertices[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
static const char tetrahedron_obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                      "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
static const char tetrahedron_ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
                                      "property float y\nproperty float z\nelement face 4\n"
                                      "property list uchar int vertex_indices\nend_header\n"
                                      "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
static const char tetrahedron_stl[] = "solid t\n"
                                      "facet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\n"
                                      "vertex 1 0 0\nendloop\nendfacet\n"
                                      "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                      "vertex 0 0 1\nendloop\nendfacet\n"
                                      "facet normal -1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\n"
                                      "vertex 0 1 0\nendloop\nendfacet\n"
                                      "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\n"
                                      "vertex 0 0 1\nendloop\nendfacet\nendsolid t\n";

static const unsigned char corners[4][3] = { { 0, 2, 1 }, { 0, 1, 3 }, { 0, 3, 2 }, { 1, 2, 3 } };
static const float points[4][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

static size_t make_binary_ply(unsigned char *out)
{
    static const char header[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\n"
        "property float y\nproperty float z\nelement face 4\n"
        "property list uchar int vertex_indices\nend_header\n";
    size_t size = sizeof header - 1;
    memcpy(out, header, size);
    memcpy(out + size, points, sizeof points);
    size += sizeof points;
    for (size_t i = 0; i < 4; i++) {
        const int32_t row[3] = { corners[i][0], corners[i][1], corners[i][2] };
        out[size++] = 3;
        memcpy(out + size, row, sizeof row);
        size += sizeof row;
    }
    return size;
}

static size_t make_binary_stl(unsigned char *out)
{
    memset(out, 0, 84);
    out[80] = 4;
    size_t size = 84;
    for (size_t i = 0; i < 4; i++) {
        memset(out + size, 0, 50);
        for (size_t k = 0; k < 3; k++)
            memcpy(out + size + 12 + 12 * k, points[corners[i][k]], 12);
        size += 50;
    }
    return size;
}

static size_t put_chunk(unsigned char *out, unsigned id, size_t size)
{
    const unsigned char header[6] = {
        (unsigned char)id, (unsigned char)(id >> 8), (unsigned char)size, (unsigned char)(size >> 8), 0, 0
    };
    memcpy(out, header, sizeof header);
    return sizeof header;
}

/* Chunks: main, editor, object "t", mesh, its points and its faces. */
static size_t make_3ds(unsigned char *out)
{
    const size_t vertices = 6 + 2 + sizeof points, faces = 6 + 2 + 4 * 8, mesh = 6 + vertices + faces,
                 object = 6 + 2 + mesh, editor = 6 + object, all = 6 + editor;
    unsigned char *next = out;
    next += put_chunk(next, 0x4d4d, all);
    next += put_chunk(next, 0x3d3d, editor);
    next += put_chunk(next, 0x4000, object);
    *next++ = 't';
    *next++ = '\0';
    next += put_chunk(next, 0x4100, mesh);
    next += put_chunk(next, 0x4110, vertices);
    *next++ = 4;
    *next++ = 0;
    memcpy(next, points, sizeof points);
    next += sizeof points;
    next += put_chunk(next, 0x4120, faces);
    *next++ = 4;
    *next++ = 0;
    for (size_t i = 0; i < 4; i++) {
        const unsigned char face[8] = { corners[i][0], 0, corners[i][1], 0, corners[i][2], 0, 0, 0 };
        memcpy(next, face, sizeof face);
        next += sizeof face;
    }
    assert_int_equal(next - out, all);
    return all;
}

/* ---- what comes out ------------------------------------------------------------------------------ */

/* Oracle: the volume of the tetrahedron, 1/6, the same from every format. */
static void formats_give_the_same_solid(void **state)
{
    (void)state;
    unsigned char data[1024];
    write_text("t.obj", tetrahedron_obj);
    write_text("t.ply", tetrahedron_ply);
    write_text("t.stl", tetrahedron_stl);
    write_bytes("binary.ply", data, make_binary_ply(data));
    write_bytes("binary.stl", data, make_binary_stl(data));
    write_bytes("t.3ds", data, make_3ds(data));
    static const char *const paths[] = { "t.obj", "t.ply", "t.stl", "binary.ply", "binary.stl", "t.3ds" };
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        struct io_mesh *mesh = read_mesh(paths[i]);
        assert_int_equal(mesh->triangle_count, 4);
        assert_close(volume_of(mesh), 1.0 / 6, 1e-7, "%s", paths[i]);
        for (int axis = 0; axis < 3; axis++) {
            const bool is_turned = axis == 2 && i == 5; /* 3DS has z up: its y comes out as -z */
            assert_close((double)mesh->min[axis], is_turned ? -1 : 0, 0, "%s: min %d", paths[i], axis);
            assert_close((double)mesh->max[axis], is_turned ? 0 : 1, 0, "%s: max %d", paths[i], axis);
        }
        io_mesh_destroy(mesh);
    }
}

/* Oracle: symmetry. At a corner of a cube three right angles meet, however its squares are cut into
 * triangles, so angle-weighted normals are the diagonals exactly; eight points stay eight vertices. */
static void missing_normals_are_weighted_by_angle(void **state)
{
    (void)state;
    struct io_mesh *mesh = read_text("cube.obj", "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n"
                                                 "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
                                                 "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n"
                                                 "f 4 1 5 8\n");
    assert_int_equal(mesh->vertex_count, 8);
    assert_int_equal(mesh->triangle_count, 12);
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        assert_close((double)mesh->normals[i], (double)mesh->positions[i] / sqrt(3.0), 1e-7, "normal %zu",
                     i);
    io_mesh_destroy(mesh);
}

/* Oracle: symmetry. A solid wound inwards must come out as the same one wound outwards. */
static void closed_mesh_wound_inwards_is_flipped(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n", tetrahedron_vertices);
    struct io_mesh *mesh = read_text("inward.obj", text);
    assert_close(volume_of(mesh), 1.0 / 6, 1e-7, "inward");
    for (size_t corner = 0; corner < 12; corner++) {
        double outwards = 0;
        for (size_t axis = 0; axis < 3; axis++)
            outwards += component(mesh, mesh->normals, corner, axis) *
                        (component(mesh, mesh->positions, corner, axis) - 0.25);
        assert_true(outwards > 0.3);
    }
    io_mesh_destroy(mesh);
}

/* Oracle: the definition. An open surface has no inside: its winding stays, unless the file's normals say
 * otherwise; then these stay. */
static void open_mesh_follows_its_normals(void **state)
{
    (void)state;
    static const char sheet[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    char text[256];
    snprintf(text, sizeof text, "%sf 1 3 2\n", sheet);
    struct io_mesh *plain = read_text("plain.obj", text);
    assert_true(component(plain, plain->normals, 0, 2) == -1);
    io_mesh_destroy(plain);

    snprintf(text, sizeof text, "%svn 0 0 2\nf 1//1 3//1 2//1\n", sheet);
    struct io_mesh *turned = read_text("turned.obj", text);
    double cross_z = 0;
    for (size_t i = 0; i < 3; i++)
        cross_z += component(turned, turned->positions, i, 0) *
                       component(turned, turned->positions, (i + 1) % 3, 1) -
                   component(turned, turned->positions, i, 1) *
                       component(turned, turned->positions, (i + 1) % 3, 0);
    assert_true(component(turned, turned->normals, 0, 2) == 1);
    assert_close(cross_z, 1, 1e-7, "twice the area");
    io_mesh_destroy(turned);
}

/* Oracle: the file. Normals that it has come out as unit vectors; where they differ at one point that point
 * is two vertices. */
static void normals_of_the_file_are_kept(void **state)
{
    (void)state;
    struct io_mesh *mesh = read_text("normals.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                    "vn 0 0 -3\nvn 0 -1 0\n"
                                                    "f 1//1 3//1 2//1\nf 1//2 2//2 4//2\n");
    assert_int_equal(mesh->vertex_count, 6);
    for (size_t corner = 0; corner < 6; corner++) {
        assert_true(component(mesh, mesh->normals, corner, 0) == 0);
        assert_true(component(mesh, mesh->normals, corner, 1) == (corner < 3 ? 0 : -1));
        assert_true(component(mesh, mesh->normals, corner, 2) == (corner < 3 ? -1 : 0));
    }
    io_mesh_destroy(mesh);
}

/* Oracle: the file. Triangles without an area, points, lines and vertices that nothing uses stay behind. */
static void what_has_no_area_is_dropped(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sv 7 8 nan\nv 2 0 0\nf 1 2 5\nf 1 1 2\nl 1 2\np 1\n", tetrahedron_obj);
    write_text("dropped.obj", text);
    assert_refused("dropped.obj", DIPOLE_BAD_VALUE, "has a position that is not finite");
    snprintf(text, sizeof text, "%sv 7 8 9\nv 2 0 0\nf 1 2 6\nf 1 1 2\nl 1 2\np 1\n", tetrahedron_obj);
    struct io_mesh *mesh = read_text("dropped.obj", text);
    assert_int_equal(mesh->triangle_count, 4);
    assert_int_equal(mesh->vertex_count, 4);
    assert_true(mesh->max[0] == 1.0f);
    io_mesh_destroy(mesh);
}

/* Oracle: arithmetic. -0 is 0, and twice the same point is one. */
static void equal_points_are_one_vertex(void **state)
{
    (void)state;
    struct io_mesh *mesh = read_text("twice.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                  "v -0 0 -0.0\nv 1 -0 0\nv 0 1e0 0\nv 0 0 1\n"
                                                  "f 1 3 2\nf 5 6 8\nf 1 4 7\nf 2 7 8\n");
    assert_int_equal(mesh->vertex_count, 4);
    assert_close(volume_of(mesh), 1.0 / 6, 1e-7, "twice");
    io_mesh_destroy(mesh);
}

/* Oracle: primitives.c. A sphere written as OBJ without normals comes back with its vertices, its triangles
 * and normals that are its positions within the size of a facet. */
static void sphere_survives_a_file(void **state)
{
    (void)state;
    struct io_mesh *sphere;
    assert_true(io_mesh_create_primitive(IO_PRIMITIVE_SPHERE, 64, &sphere, NULL));
    FILE *file = fopen("sphere.obj", "w");
    assert_non_null(file);
    for (size_t i = 0; i < 3 * sphere->vertex_count; i += 3)
        fprintf(file, "v %.9g %.9g %.9g\n", (double)sphere->positions[i], (double)sphere->positions[i + 1],
                (double)sphere->positions[i + 2]);
    for (size_t i = 0; i < 3 * sphere->triangle_count; i += 3)
        fprintf(file, "f %u %u %u\n", sphere->indices[i] + 1, sphere->indices[i + 1] + 1,
                sphere->indices[i + 2] + 1);
    assert_int_equal(fclose(file), 0);
    struct io_mesh *mesh = read_mesh("sphere.obj");
    assert_int_equal(mesh->vertex_count, sphere->vertex_count);
    assert_int_equal(mesh->triangle_count, sphere->triangle_count);
    assert_close(volume_of(mesh), volume_of(sphere), 1e-6, "volume");
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        assert_true(fabsf(mesh->normals[i] - mesh->positions[i]) < 2e-3f);
    io_mesh_destroy(mesh);
    io_mesh_destroy(sphere);
}

/* Oracle: known counts of the models of the package glmark2-data: the bunny is closed, without normals. */
static void real_models_are_read(void **state)
{
    (void)state;
    static const char folder[] = "/usr/share/glmark2/models/";
    static const struct {
        const char *name;
        size_t triangle_count;
    } models[] = {
        { "bunny.obj", 69666 }, { "asteroid-high.3ds", 48000 }, { "horse.3ds", 7172 }, { "cat.3ds", 14348 }
    };
    if (access(folder, R_OK) != 0)
        skip();
    for (size_t i = 0; i < sizeof models / sizeof models[0]; i++) {
        char path[128];
        snprintf(path, sizeof path, "%s%s", folder, models[i].name);
        struct io_mesh *mesh = read_mesh(path);
        /* a model may hold triangles without an area: a handful in the hand-made ones */
        assert_true(mesh->triangle_count <= models[i].triangle_count);
        assert_true(mesh->triangle_count + models[i].triangle_count / 100 >= models[i].triangle_count);
        assert_true(volume_of(mesh) > 0);
        if (i == 0) {
            assert_int_equal(mesh->triangle_count, 69666);
            assert_int_equal(mesh->vertex_count,
                             69666 / 2 + 2); /* closed, without handles: V = F / 2 + 2 */
        }
        io_mesh_destroy(mesh);
    }
}

/* ---- files that are refused ---------------------------------------------------------------------- */

/* Oracle: the messages, word by word. */
static void what_is_no_mesh_file_is_refused(void **state)
{
    (void)state;
    assert_refused("absent.obj", DIPOLE_NOT_FOUND, "cannot be read: No such file or directory");
    mkdir("folder.obj", 0777);
    assert_refused("folder.obj", DIPOLE_IO_FAILED, "is a folder, expected a mesh file");
    unlink("pipe.obj");
    assert_int_equal(mkfifo("pipe.obj", 0666), 0);
    assert_refused("pipe.obj", DIPOLE_IO_FAILED, "is a device or a pipe, expected a mesh file");
    write_text("empty.obj", "");
    assert_refused("empty.obj", DIPOLE_BAD_VALUE, "is empty, expected a mesh file");
    assert_text_refused(
        "words.txt", "These are words, and there is no mesh in them.\n",
        "is no mesh of a known format, expected OBJ, PLY, STL, 3DS, glTF or another that assimp "
        "reads");
    assert_text_refused(
        "words", "neither an extension nor a mesh\n",
        "is no mesh of a known format, expected OBJ, PLY, STL, 3DS, glTF or another that assimp "
        "reads");
}

/* Oracle: the messages, word by word. */
static void mesh_without_triangles_is_refused(void **state)
{
    (void)state;
    static const char message[] = "has no triangles, expected at least one";
    char text[512];
    assert_text_refused("v.obj", tetrahedron_vertices, message);
    snprintf(text, sizeof text, "%sp 1 2 3\nl 1 2 3 4\n", tetrahedron_vertices);
    assert_text_refused("lines.obj", text, message);
    assert_text_refused("empty.stl", "solid nothing\nendsolid nothing\n", message);
    assert_text_refused("empty.ply",
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "property float z\nend_header\n0 0 0\n",
                        message);
    snprintf(text, sizeof text, "%sv 2 0 0\nf 1 2 5\nf 1 1 1\n", tetrahedron_vertices);
    assert_text_refused("thin.obj", text, "has no triangle with an area, expected at least one");
}

/* Oracle: the messages, word by word. */
static void bad_numbers_are_refused(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "%sv nan 0 0\nf 1 2 5\n", tetrahedron_obj);
    assert_text_refused("nan.obj", text, "has a position that is not finite");
    snprintf(text, sizeof text, "%sv 1e39 0 0\nf 1 2 5\n", tetrahedron_obj);
    assert_text_refused("huge.obj", text, "has a position that is not finite");
    snprintf(text, sizeof text, "%sf 1 2 5\n", tetrahedron_obj);
    assert_text_refused("beyond.obj", text, "cannot be read as a mesh: OBJ: vertex index out of range");
    assert_text_refused("beyond.ply",
                        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                        "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                        "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
                        "is damaged: a face refers to a vertex that does not exist");
}

/* Oracle: what the whole file announces. Every PLY, STL and 3DS that lost its last byte, its half, or all
 * but its beginning is refused; an ASCII file may lose its last newline. */
static void truncated_files_are_refused(void **state)
{
    (void)state;
    static const char message[] = "is cut short: it ends before the data that it announces";
    unsigned char data[1024];
    const struct {
        const char *path;
        size_t size, least; /* shorter than least it is no such file at all */
        const void *data;
    } files[] = {
        { "cut.ply", sizeof tetrahedron_ply - 2, 4, tetrahedron_ply },
        { "cut.stl", sizeof tetrahedron_stl - 4, 5, tetrahedron_stl },
        { "cut_binary.ply", make_binary_ply(data), 4, NULL },
        { "cut_binary.stl", make_binary_stl(data), 1, NULL },
        { "cut.3ds", make_3ds(data), 2, NULL },
    };
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        const void *bytes = files[i].data;
        if (!bytes) {
            bytes = data;
            if (strcmp(files[i].path, "cut_binary.ply") == 0)
                make_binary_ply(data);
            else if (strcmp(files[i].path, "cut_binary.stl") == 0)
                make_binary_stl(data);
            else
                make_3ds(data);
        }
        /* a text's last line counts as long as one character of it is left */
        const size_t last = i == 0 ? files[i].size - 8 : i == 1 ? files[i].size - 10 : files[i].size - 1;
        const size_t sizes[] = { last, files[i].size / 2, files[i].size / 4, files[i].least };
        for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
            write_bytes(files[i].path, bytes, sizes[k]);
            assert_refused(files[i].path, DIPOLE_BAD_VALUE, message);
        }
    }
    /* in text a number that lost digits is another number: nothing can tell */
    write_bytes("cut.obj", tetrahedron_obj, strlen(tetrahedron_vertices));
    assert_refused("cut.obj", DIPOLE_BAD_VALUE, "has no triangles, expected at least one");
}

/* Oracle: what the whole file announces, for every length; no byte beyond the last is touched (sanitizer).
 */
static void every_shorter_length_is_incomplete(void **state)
{
    (void)state;
    unsigned char whole[1024];
    for (int format = 0; format < 3; format++) {
        static const char *const extensions[] = { "PLY", "stl", "3ds" };
        static const size_t least[] = { 4, 0, 2 }; /* shorter ones may be anything */
        const size_t size = format == 0   ? make_binary_ply(whole)
                            : format == 1 ? make_binary_stl(whole)
                                          : make_3ds(whole);
        assert_true(io_mesh_is_complete(whole, size, extensions[format]));
        for (size_t length = least[format]; length < size; length++) {
            unsigned char *part = malloc(length + (length == 0));
            assert_non_null(part);
            memcpy(part, whole, length);
            if (io_mesh_is_complete(part, length, extensions[format]))
                fail_msg("%s: %zu of %zu bytes pass for all", extensions[format], length, size);
            free(part);
        }
    }
}

/* Oracle: the message. A mesh is one file: what it refers to is never opened. */
static void a_mesh_opens_no_other_file(void **state)
{
    (void)state;
    const float buffer[9] = { 0, 0, 0, 1, 0, 0, 0, 1, 0 };
    write_bytes("outside.bin", buffer, sizeof buffer);
    write_text("outside.gltf",
               "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
               "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
               "\"buffers\":[{\"uri\":\"outside.bin\",\"byteLength\":36}],"
               "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,"
               "\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,1,0]}]}");
    struct io_mesh *mesh;
    dipole_status status;
    assert_false(io_mesh_read("outside.gltf", &mesh, &status));
    assert_string_equal(status.message,
                        "cannot be read as a mesh: GLTF: could not open referenced file \"outside.bin\"");
}

/* ---- limits, and an importing program that fails -------------------------------------------------- */

static const char importer_program[] = MESH_IMPORT_PROGRAM;

static void assert_importer_fails(const struct io_mesh_importer *importer, dipole_code code,
                                  const char *message)
{
    struct io_mesh *mesh;
    dipole_status status = { 0 };
    assert_false(io_mesh_read_by(importer, "t.obj", &mesh, &status));
    assert_null(mesh);
    assert_string_equal(status.message, message);
    assert_int_equal(status.code, code);
}

/* Oracle: the limits given. */
static void limits_hold(void **state)
{
    (void)state;
    write_text("t.obj", tetrahedron_obj);
    struct io_mesh_importer importer = {
        .program = importer_program, .bytes_limit = 50, .triangle_limit = 100, .seconds_limit = 60
    };
    assert_importer_fails(&importer, DIPOLE_BAD_VALUE, "has 64 bytes, expected at most 50");
    importer.bytes_limit = (size_t)1 << 30;
    importer.triangle_limit = 3;
    assert_importer_fails(&importer, DIPOLE_BAD_VALUE, "has 4 triangles, expected at most 3");
}

#ifndef __SANITIZE_ADDRESS__ /* its shadow alone is more than any limit: it is not set there */
/* Oracle: the message. A text of ten megabytes does not fit into eighty together with the libraries. */
static void memory_limit_holds(void **state)
{
    (void)state;
    FILE *file = fopen("large.obj", "w");
    assert_non_null(file);
    fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\n", file);
    for (int i = 0; i < 1000000; i++)
        fputs("f 1 2 3\n", file);
    assert_int_equal(fclose(file), 0);
    const struct io_mesh_importer importer = { .program = importer_program,
                                               .bytes_limit = (size_t)80 << 20,
                                               .triangle_limit = 2000000,
                                               .seconds_limit = 60 };
    struct io_mesh *mesh;
    dipole_status status;
    assert_false(io_mesh_read_by(&importer, "large.obj", &mesh, &status));
    assert_string_equal(status.message, "needs too much memory to be read");
    unlink("large.obj");
}
#endif

/* Put a shell script in the importing program's place. */
static struct io_mesh_importer script(const char *commands)
{
    static int number; /* a new file each time: one that still runs cannot be written */
    static char path[64];
    char text[512];
    snprintf(path, sizeof path, "./importer%d.sh", number++);
    snprintf(text, sizeof text, "#!/bin/sh\n%s\n", commands);
    write_text(path, text);
    assert_int_equal(chmod(path, 0755), 0);
    return (struct io_mesh_importer){
        .program = path, .bytes_limit = (size_t)1 << 30, .triangle_limit = 1000000, .seconds_limit = 1
    };
}

static const char no_answer[] = "cannot be read: the reader of meshes ended without an answer";

/* Oracle: the messages. Whatever the importing program does, the caller gets one line. */
static void failing_importer_is_reported(void **state)
{
    (void)state;
    write_text("t.obj", tetrahedron_obj);
    struct io_mesh_importer importer = script("exec sleep 60");
    assert_importer_fails(&importer, DIPOLE_IO_FAILED, "takes longer than 1 s to read");
    importer = script("while :; do :; done");
    assert_importer_fails(&importer, DIPOLE_IO_FAILED, "takes longer than 1 s to read");
    importer = script("kill -SEGV $$");
    importer.seconds_limit = 60;
    assert_importer_fails(&importer, DIPOLE_BAD_VALUE,
                          "is damaged or too large: the reader of meshes died of it (signal 11)");
    importer = script("exit 0");
    assert_importer_fails(&importer, DIPOLE_IO_FAILED, no_answer);
    importer = script("exec yes");
    assert_importer_fails(&importer, DIPOLE_IO_FAILED, no_answer);
    importer = script("printf dipmesh; exec cat /dev/zero");
    assert_importer_fails(&importer, DIPOLE_IO_FAILED, no_answer);
    importer.program = "./no-such-program";
    assert_importer_fails(
        &importer, DIPOLE_NOT_FOUND,
        "cannot be read: the reader of meshes ./no-such-program cannot be run: No such file or "
        "directory");
}

/* Answer with what the test wrote into a file. */
static void assert_answer_refused(const struct io_mesh_header *header, const float positions[9],
                                  const float normals[9], const uint32_t indices[3], const char *message)
{
    FILE *file = fopen("answer", "wb");
    assert_non_null(file);
    fwrite(header, sizeof *header, 1, file);
    fwrite(positions, 9 * sizeof *positions, 1, file);
    fwrite(normals, 9 * sizeof *normals, 1, file);
    fwrite(indices, 3 * sizeof *indices, 1, file);
    assert_int_equal(fclose(file), 0);
    const struct io_mesh_importer importer = script("exec cat answer");
    struct io_mesh *mesh;
    dipole_status status = { 0 };
    const bool done = io_mesh_read_by(&importer, "t.obj", &mesh, &status);
    assert_true(done == (message == NULL));
    if (message)
        assert_string_equal(status.message, message);
    io_mesh_destroy(mesh);
}

/* Oracle: the definition of a mesh. An importing program that a file has taken over can send what it likes;
 * what would lead the reader astray does not pass. */
static void wrong_answers_are_refused(void **state)
{
    (void)state;
    write_text("t.obj", tetrahedron_obj);
    const struct io_mesh_header good = { .magic = IO_MESH_MAGIC, .vertex_count = 3, .triangle_count = 1 };
    const float positions[9] = { 0, 0, 0, 1, 0, 0, 0, 1, 0 }, normals[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 };
    const uint32_t indices[3] = { 0, 1, 2 };
    assert_answer_refused(&good, positions, normals, indices, NULL);

    struct io_mesh_header header = good;
    header.magic[0] = 'D';
    assert_answer_refused(&header, positions, normals, indices, no_answer);
    header = good;
    header.triangle_count = UINT64_MAX;
    assert_answer_refused(&header, positions, normals, indices,
                          "has 18446744073709551615 triangles, expected at most 1000000");
    header = good;
    header.vertex_count = UINT64_MAX / 12 + 2;
    assert_answer_refused(&header, positions, normals, indices, no_answer);
    header = good;
    header.triangle_count = 2;
    assert_answer_refused(&header, positions, normals, indices, no_answer);
    header = good;
    header.vertex_count = header.triangle_count = 0;
    assert_answer_refused(&header, positions, normals, indices, no_answer);
    header = good;
    memset(header.message, '\x1b', sizeof header.message);
    char expected[sizeof header.message];
    memset(expected, '?', sizeof expected - 1);
    expected[sizeof expected - 1] = '\0';
    assert_answer_refused(&header, positions, normals, indices, expected);

    float bad[9];
    memcpy(bad, positions, sizeof bad);
    bad[4] = INFINITY;
    assert_answer_refused(&good, bad, normals, indices, no_answer);
    memcpy(bad, normals, sizeof bad);
    bad[5] = NAN;
    assert_answer_refused(&good, positions, bad, indices, no_answer);
    bad[5] = 2;
    assert_answer_refused(&good, positions, bad, indices, no_answer);
    assert_answer_refused(&good, positions, normals, (const uint32_t[]){ 0, 1, 3 }, no_answer);
}

/* Oracle: the definition of a mesh, on seeded damage: it is refused with a message, or it is a mesh. */
static void damaged_files_end_in_a_message(void **state)
{
    (void)state;
    const struct io_mesh_importer importer = { .program = importer_program,
                                               .bytes_limit = (size_t)1 << 30,
                                               .triangle_limit = 1000000,
                                               .seconds_limit = 10 };
    struct rng rng = { .seed = 1 };
    unsigned char whole[1024], damaged[1024];
    for (int round = 0; round < 60; round++) {
        static const char *const paths[] = { "damaged.ply", "damaged.stl", "damaged.3ds", "damaged.obj",
                                             "damaged_text.ply" };
        size_t size;
        switch (round % 5) {
        case 0:
            size = make_binary_ply(whole);
            break;
        case 1:
            size = make_binary_stl(whole);
            break;
        case 2:
            size = make_3ds(whole);
            break;
        case 3:
            memcpy(whole, tetrahedron_obj, size = sizeof tetrahedron_obj - 1);
            break;
        default:
            memcpy(whole, tetrahedron_ply, size = sizeof tetrahedron_ply - 1);
            break;
        }
        memcpy(damaged, whole, size);
        for (uint64_t flips = 1 + random_bits(&rng) % 4; flips > 0; flips--)
            damaged[random_bits(&rng) % size] ^= (unsigned char)(1u << random_bits(&rng) % 8);
        write_bytes(paths[round % 5], damaged,
                    size - (size_t)(random_bits(&rng) % 2 * (random_bits(&rng) % 20)));
        struct io_mesh *mesh;
        dipole_status status = { 0 };
        if (io_mesh_read_by(&importer, paths[round % 5], &mesh, &status)) {
            assert_true(mesh->triangle_count > 0);
            for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
                assert_true(mesh->indices[i] < mesh->vertex_count);
            for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
                assert_true(isfinite(mesh->positions[i]) && isfinite(mesh->normals[i]));
        } else {
            assert_null(mesh);
            assert_true(strlen(status.message) > 0);
        }
        io_mesh_destroy(mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(formats_give_the_same_solid),
        cmocka_unit_test(missing_normals_are_weighted_by_angle),
        cmocka_unit_test(closed_mesh_wound_inwards_is_flipped),
        cmocka_unit_test(open_mesh_follows_its_normals),
        cmocka_unit_test(normals_of_the_file_are_kept),
        cmocka_unit_test(what_has_no_area_is_dropped),
        cmocka_unit_test(equal_points_are_one_vertex),
        cmocka_unit_test(sphere_survives_a_file),
        cmocka_unit_test(real_models_are_read),
        cmocka_unit_test(what_is_no_mesh_file_is_refused),
        cmocka_unit_test(mesh_without_triangles_is_refused),
        cmocka_unit_test(bad_numbers_are_refused),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(every_shorter_length_is_incomplete),
        cmocka_unit_test(a_mesh_opens_no_other_file),
        cmocka_unit_test(limits_hold),
#ifndef __SANITIZE_ADDRESS__
        cmocka_unit_test(memory_limit_holds),
#endif
        cmocka_unit_test(failing_importer_is_reported),
        cmocka_unit_test(wrong_answers_are_refused),
        cmocka_unit_test(damaged_files_end_in_a_message),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
