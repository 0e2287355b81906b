#include "renderer/geometry.h"

#include <stdlib.h>
#include <string.h>

static bool check_size(size_t vertex_count, size_t triangle_count, dipole_status *status)
{
    GLint texel_limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texel_limit);
    const size_t count = vertex_count > triangle_count ? vertex_count : triangle_count;
    return count <= (size_t)texel_limit ||
           dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                       "the scene has %zu vertices and %zu triangles, this OpenGL takes %d of each",
                       vertex_count, triangle_count, texel_limit);
}

static void copy_triangles(const struct io_scene *scene, uint32_t (*texels)[4])
{
    size_t first_vertex = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_mesh *const mesh = io_object_rest(&scene->objects[i]);
        for (size_t t = 0; t < mesh->triangle_count; t++, texels++) {
            for (size_t k = 0; k < 3; k++)
                (*texels)[k] = (uint32_t)first_vertex + mesh->indices[3 * t + k];
            (*texels)[3] = (uint32_t)i + 1;
        }
        first_vertex += mesh->vertex_count;
    }
}

static void copy_vertices(const struct io_scene *scene, int array, float *values)
{
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_mesh *const mesh = io_object_rest(&scene->objects[i]);
        const float *const source = array == RENDER_VERTEX_POSITION ? mesh->positions : mesh->normals;
        for (size_t v = 0; v < mesh->vertex_count; v++, values += RENDER_VERTEX_FLOATS)
            memcpy(values, source + 3 * v, 3 * sizeof *values);
    }
}

bool render_geometry_create(const struct io_scene *scene, struct render_geometry *geometry,
                            dipole_status *status)
{
    size_t vertex_count = 0, triangle_count = 0;
    *geometry = (struct render_geometry){ 0 };
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_mesh *const mesh = io_object_rest(&scene->objects[i]);
        vertex_count += mesh->vertex_count;
        triangle_count += mesh->triangle_count;
    }
    if (!check_size(vertex_count, triangle_count, status))
        return false;
    float *const values = calloc(vertex_count + 1, RENDER_VERTEX_FLOATS * sizeof *values);
    uint32_t(*const texels)[4] = calloc(triangle_count + 1, sizeof *texels);
    const bool done = values && texels;
    if (done) {
        copy_triangles(scene, texels);
        render_buffer_texture_fill(&geometry->triangles, GL_RGBA32UI, texels,
                                   triangle_count * sizeof *texels);
    }
    for (int array = 0; done && array < RENDER_VERTEX_ARRAYS; array++) {
        copy_vertices(scene, array, values);
        render_buffer_texture_fill(&geometry->vertices[array], GL_RGBA32F, values,
                                   RENDER_VERTEX_FLOATS * vertex_count * sizeof *values);
    }
    free(values);
    free(texels);
    return done ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu vertices and %zu triangles",
                       vertex_count, triangle_count);
}

void render_geometry_destroy(struct render_geometry *geometry)
{
    for (int array = 0; array < RENDER_VERTEX_ARRAYS; array++)
        render_buffer_texture_destroy(&geometry->vertices[array]);
    render_buffer_texture_destroy(&geometry->triangles);
}
