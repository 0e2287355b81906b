#include "renderer/execute.h"

#include "renderer/environment_draw.h"
#include "renderer/gather_draw.h"
#include "renderer/geometry.h"
#include "renderer/light_draw.h"
#include "renderer/pose.h"
#include "renderer/shadow_draw.h"
#include "renderer/solid.h"
#include "renderer/splat_draw.h"
#include "renderer/tsm_draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    SAMPLES_PER_PIXEL = 4,
    PROGRAM_LIMIT = 64,
    TEXTURE_LIMIT = 56,
    DEFINES_SIZE = 512,
    REST_LOCATION = RENDER_VERTEX_ARRAYS, /* of a vertex's position at rest */
};

#define PI 3.14159265358979323846

struct program {
    const struct render_pass *pass;
    char defines[DEFINES_SIZE];
    GLuint handle;
};

struct texture {
    const struct render_texture *kind;
    GLuint handle;
    int width_px, height_px;
    bool is_used;    /* by the plan that runs           */
    bool is_written; /* by a pass of the plan that runs */
};

/* One object's arrays. */
struct mesh {
    const struct io_mesh *source; /* at rest, that the geometry has */
    GLuint vertex_array, index_buffer;
    GLsizei index_count;
    size_t first_triangle;     /* counted over all meshes */
    struct render_posed posed; /* its vertices, counted over all meshes, too       */
    bool is_solid;             /* at rest has no triangle that is seen from behind */
    double roughness;          /* 0: no gloss */
};

struct render_executor {
    struct render_gl_errors *errors;
    struct mesh *meshes;
    size_t mesh_count;
    struct render_geometry geometry;
    GLuint empty_vertex_array;
    GLuint pose_program; /* 0 until an object is posed */
    struct program programs[PROGRAM_LIMIT];
    size_t program_count;
    struct texture textures[TEXTURE_LIMIT];
    size_t texture_count;
    size_t draw_counts[RENDER_EFFECT_LIMIT];
    struct render_light_drawing *drawing;       /* NULL until a light's view is first kept in memory */
    struct render_splatter *splatter;           /* NULL until light is first sampled */
    struct render_gatherer *gatherer;           /* NULL until light is first gathered */
    struct render_tsm *tsm;                     /* NULL until a shadow map is first gathered */
    struct render_sky *sky;                     /* NULL until an environment is first drawn */
    struct render_shadower *shadower;           /* NULL until shadows of blockers are first drawn */
    struct render_buffer_texture object_buffer; /* of render_executor_fill_media     */
    struct render_buffer_texture roughness_buffer;
    float point_places[SAMPLES_PER_PIXEL][2]; /* of a pixel's points: 0 to 1 across it */
};

static double now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

/* ---- buffers ------------------------------------------------------------------------------------ */

static double roughness_of(const struct io_object *object)
{
    return object->has_specular ? object->roughness : 0;
}

/* Locations 0: position_mm, 1: normal, 2: position at rest. */
static void bind_vertices(GLuint vertex_array, GLuint location, GLuint buffer, GLintptr offset)
{
    glVertexArrayVertexBuffer(vertex_array, location, buffer, offset, RENDER_VERTEX_FLOATS * sizeof(float));
    glVertexArrayAttribFormat(vertex_array, location, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(vertex_array, location, location);
    glEnableVertexArrayAttrib(vertex_array, location);
}

static void mesh_create(struct mesh *mesh, const struct io_object *object,
                        const struct render_geometry *geometry)
{
    const struct io_mesh *const source = mesh->source;
    const GLintptr offset = (GLintptr)(mesh->posed.first_vertex * RENDER_VERTEX_FLOATS * sizeof(float));
    glCreateVertexArrays(1, &mesh->vertex_array);
    for (GLuint i = 0; i < RENDER_VERTEX_ARRAYS; i++)
        bind_vertices(mesh->vertex_array, i, geometry->vertices[i].buffer, offset);
    bind_vertices(mesh->vertex_array, REST_LOCATION, geometry->vertices[RENDER_VERTEX_POSITION].buffer,
                  offset);
    glCreateBuffers(1, &mesh->index_buffer);
    glNamedBufferStorage(mesh->index_buffer, (GLsizeiptr)(source->triangle_count * 3 * sizeof(uint32_t)),
                         source->indices, 0);
    glVertexArrayElementBuffer(mesh->vertex_array, mesh->index_buffer);
    mesh->index_count = (GLsizei)(source->triangle_count * 3);
    mesh->roughness = roughness_of(object);
}

static void mesh_end(struct mesh *mesh)
{
    glDeleteVertexArrays(1, &mesh->vertex_array);
    glDeleteBuffers(1, &mesh->index_buffer);
    render_pose_end(&mesh->posed);
}

/* Take all meshes to the context as they are at rest. What became of a mesh that is there is known. */
static bool meshes_create(struct render_executor *executor, const struct io_scene *scene,
                          dipole_status *status)
{
    size_t vertex_count = 0, triangle_count = 0;
    for (size_t i = 0; i < executor->mesh_count; i++)
        mesh_end(&executor->meshes[i]);
    render_geometry_destroy(&executor->geometry);
    bool done = render_geometry_create(scene, &executor->geometry, status);
    for (size_t i = 0; done && i < scene->object_count; i++) {
        struct mesh *const mesh = &executor->meshes[i];
        const struct io_mesh *const source = io_object_rest(&scene->objects[i]);
        const bool is_known = mesh->source == source;
        mesh->source = source;
        mesh->posed.first_vertex = vertex_count;
        mesh->posed.vertex_count = source->vertex_count;
        mesh->first_triangle = triangle_count;
        mesh_create(mesh, &scene->objects[i], &executor->geometry);
        done = is_known || render_mesh_is_solid(source, &mesh->is_solid, status);
        vertex_count += source->vertex_count;
        triangle_count += source->triangle_count;
    }
    return done;
}

/* Meshes that took another's place, which may be of another size, are taken to the context; objects that
 * rest in this frame are put back. */
static bool update_meshes(struct render_executor *executor, const struct io_scene *scene,
                          dipole_status *status)
{
    bool is_known = true;
    for (size_t i = 0; i < executor->mesh_count; i++)
        is_known &= executor->meshes[i].source == io_object_rest(&scene->objects[i]);
    if (!is_known && !meshes_create(executor, scene, status))
        return false;
    for (size_t i = 0; i < executor->mesh_count; i++) {
        if (io_pose_is_rest(&scene->objects[i].pose))
            render_pose_undo(&executor->geometry, &executor->meshes[i].posed);
    }
    return true;
}

bool render_executor_pose(const struct render_frame *frame, bool is_deformed, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    for (size_t i = 0; i < executor->mesh_count; i++) {
        const struct io_object *const object = &frame->request->scene->objects[i];
        struct mesh *const mesh = &executor->meshes[i];
        if (io_pose_is_rest(&object->pose) || (object->pose.deform_count > 0) != is_deformed)
            continue;
        if (!executor->pose_program && !render_pose_program_create(&executor->pose_program, status))
            return false;
        render_pose_write(executor->pose_program, object, &executor->geometry, &mesh->posed);
        bind_vertices(mesh->vertex_array, REST_LOCATION, mesh->posed.rest[RENDER_VERTEX_POSITION], 0);
        render_count_draw(frame);
    }
    return true;
}

/* A texture that a pass keeps by itself is not ours to delete. */
static void texture_end(const struct texture *texture)
{
    if (texture->kind->format != RENDER_OTHER && texture->handle)
        glDeleteTextures(1, &texture->handle);
}

bool render_executor_create(const struct io_scene *scene, struct render_gl_errors *errors,
                            struct render_executor **executor_out, dipole_status *status)
{
    *executor_out = NULL;
    struct render_executor *const executor = calloc(1, sizeof *executor);
    struct mesh *const meshes = calloc(scene->object_count, sizeof *meshes);
    if (!executor || !meshes) {
        free(executor);
        free(meshes);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu objects",
                           scene->object_count);
    }
    executor->errors = errors;
    executor->meshes = meshes;
    executor->mesh_count = scene->object_count;
    glCreateVertexArrays(1, &executor->empty_vertex_array);
    if (!meshes_create(executor, scene, status) ||
        !render_gl_check(errors, "upload of the meshes", status)) {
        render_executor_destroy(executor);
        return false;
    }
    *executor_out = executor;
    return true;
}

void render_executor_destroy(struct render_executor *executor)
{
    if (!executor)
        return;
    for (size_t i = 0; i < executor->mesh_count; i++)
        mesh_end(&executor->meshes[i]);
    render_geometry_destroy(&executor->geometry);
    glDeleteProgram(executor->pose_program);
    for (size_t i = 0; i < executor->program_count; i++)
        glDeleteProgram(executor->programs[i].handle);
    for (size_t i = 0; i < executor->texture_count; i++)
        texture_end(&executor->textures[i]);
    render_light_drawing_destroy(executor->drawing);
    render_splatter_destroy(executor->splatter);
    render_gatherer_destroy(executor->gatherer);
    render_tsm_destroy(executor->tsm);
    render_sky_destroy(executor->sky);
    render_shadower_destroy(executor->shadower);
    render_buffer_texture_destroy(&executor->object_buffer);
    render_buffer_texture_destroy(&executor->roughness_buffer);
    glDeleteVertexArrays(1, &executor->empty_vertex_array);
    free(executor->meshes);
    free(executor);
}

void render_executor_forget_tables(struct render_executor *executor)
{
    render_splatter_destroy(executor->splatter);
    render_gatherer_destroy(executor->gatherer);
    render_tsm_destroy(executor->tsm);
    executor->splatter = NULL;
    executor->gatherer = NULL;
    executor->tsm = NULL;
}

void render_executor_renew_materials(struct render_executor *executor, const struct io_scene *scene)
{
    for (size_t i = 0; i < executor->mesh_count; i++)
        executor->meshes[i].roughness = roughness_of(&scene->objects[i]);
    render_executor_forget_tables(executor);
    render_sky_destroy(executor->sky);
    executor->sky = NULL;
}

/* ---- programs ----------------------------------------------------------------------------------- */

/* Append "#define HAS_RADIOSITY\n" or the like. */
static void add_define(const char *texture, char defines[DEFINES_SIZE])
{
    const size_t used = strlen(defines);
    char name[48];
    size_t i = 0;
    for (; texture[i] && i + 1 < sizeof name; i++)
        name[i] = texture[i] >= 'a' && texture[i] <= 'z' ? (char)(texture[i] - 'a' + 'A') : texture[i];
    name[i] = '\0';
    snprintf(defines + used, DEFINES_SIZE - used, "#define HAS_%s\n", name);
}

/* One for each optional texture that is read or written under this plan. */
static void list_defines(const struct render_plan *plan, const struct render_pass *pass,
                         char defines[DEFINES_SIZE])
{
    memset(defines, 0, DEFINES_SIZE);
    for (size_t r = 0; r < RENDER_PASS_READS && pass->reads_if_written[r]; r++) {
        if (render_plan_writes(plan, pass->reads_if_written[r]))
            add_define(pass->reads_if_written[r], defines);
    }
    for (size_t i = 0; i < RENDER_PASS_EXTRAS && pass->writes_if_wanted[i]; i++) {
        if (render_plan_wants(plan, pass->writes_if_wanted[i]))
            add_define(pass->writes_if_wanted[i], defines);
    }
}

static bool program_for(struct render_executor *executor, const struct render_plan *plan,
                        const struct render_pass *pass, GLuint *program_out, dipole_status *status)
{
    char defines[DEFINES_SIZE];
    list_defines(plan, pass, defines);
    for (size_t i = 0; i < executor->program_count; i++) {
        const struct program *const known = &executor->programs[i];
        if (known->pass == pass && strcmp(known->defines, defines) == 0) {
            *program_out = known->handle;
            return true;
        }
    }
    if (executor->program_count == PROGRAM_LIMIT)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "more than %d shader programs",
                           PROGRAM_LIMIT);
    char vertex_name[64], fragment_name[64];
    snprintf(vertex_name, sizeof vertex_name, "%s.vert",
             pass->draw == RENDER_DRAW_FULLSCREEN ? "fullscreen" : pass->name);
    snprintf(fragment_name, sizeof fragment_name, "%s.frag", pass->name);
    const struct render_shader *const vertex = render_shader_find(vertex_name);
    const struct render_shader *const fragment = render_shader_find(fragment_name);
    if (!vertex || !fragment)
        return dipole_fail(status, DIPOLE_NOT_FOUND, NULL, "no shader %s",
                           vertex ? fragment_name : vertex_name);
    struct program *const program = &executor->programs[executor->program_count];
    if (!render_program_create(vertex, fragment, defines, &program->handle, status))
        return false;
    glObjectLabel(GL_PROGRAM, program->handle, -1, pass->name);
    program->pass = pass;
    memcpy(program->defines, defines, sizeof defines);
    executor->program_count++;
    *program_out = program->handle;
    return true;
}

/* ---- textures ----------------------------------------------------------------------------------- */

static struct texture *texture_find(const struct render_executor *executor, const char *name)
{
    for (size_t i = 0; i < executor->texture_count; i++) {
        if (strcmp(executor->textures[i].kind->name, name) == 0)
            return (struct texture *)&executor->textures[i];
    }
    return NULL;
}

static void texture_size(const struct render_plan *plan, const struct render_texture *kind, int *width_px,
                         int *height_px)
{
    *width_px = plan->width_px;
    *height_px = plan->height_px;
    if (kind->size == RENDER_SIZE_LIGHT_VIEW) {
        int largest = 1;
        for (size_t v = 0; v < plan->view_count; v++)
            largest = plan->views[v].size_px > largest ? plan->views[v].size_px : largest;
        *width_px = *height_px = largest;
    } else if (kind->size == RENDER_SIZE_MAP) {
        *width_px = *height_px = render_plan_map_side_px(plan);
    } else if (kind->size == RENDER_SIZE_PEEL) {
        *width_px = *height_px = plan->peel_side_px;
    } else if (kind->size == RENDER_SIZE_LIGHT_BLOCKS) {
        const int block_px = render_plan_shadow_block_px(plan);
        int largest = 1;
        for (size_t v = 0; v < plan->view_count; v++)
            largest = plan->views[v].size_px > largest ? plan->views[v].size_px : largest;
        *width_px = *height_px = (largest + block_px - 1) / block_px;
    } else if (kind->size == RENDER_SIZE_MAP_BLOCKS) {
        *width_px = *height_px = (render_plan_map_side_px(plan) + RENDER_MAP_BLOCK - 1) / RENDER_MAP_BLOCK;
    } else if (kind->size == RENDER_SIZE_SHADOW) {
        *width_px = *height_px = plan->shadows.size_px;
    } else if (kind->size == RENDER_SIZE_SHADOW_BLOCKS) {
        *width_px = *height_px = (plan->shadows.size_px + RENDER_SHADOW_BLOCK - 1) / RENDER_SHADOW_BLOCK;
    } else if (kind->size == RENDER_SIZE_VERTICES) {
        *width_px = RENDER_VERTEX_ROW;
        *height_px = (int)((plan->vertex_count + RENDER_VERTEX_ROW - 1) / RENDER_VERTEX_ROW);
    }
}

static const GLenum formats[] = { [RENDER_RGBA32F] = GL_RGBA32F,
                                  [RENDER_R32F] = GL_R32F,
                                  [RENDER_R32UI] = GL_R32UI,
                                  [RENDER_DEPTH32F] = GL_DEPTH_COMPONENT32F,
                                  [RENDER_OTHER] = GL_NONE };

/* Make a texture that the plan writes, or take the one there is when its size still fits. */
static bool texture_want(struct render_executor *executor, const struct render_plan *plan, const char *name,
                         dipole_status *status)
{
    struct texture *texture = texture_find(executor, name);
    if (!texture) {
        if (executor->texture_count == TEXTURE_LIMIT)
            return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "more than %d textures", TEXTURE_LIMIT);
        texture = &executor->textures[executor->texture_count++];
        *texture = (struct texture){ .kind = render_texture_find(name) }; /* the row may be an old one's */
    }
    const struct render_texture *const kind = texture->kind;
    int width_px, height_px;
    texture_size(plan, kind, &width_px, &height_px);
    texture->is_used = true;
    if (kind->format == RENDER_OTHER ||
        (texture->handle && texture->width_px == width_px && texture->height_px == height_px))
        return true;
    glDeleteTextures(1, &texture->handle);
    const GLenum format = formats[kind->format];
    if (kind->is_multisampled) {
        glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &texture->handle);
        glTextureStorage2DMultisample(texture->handle, SAMPLES_PER_PIXEL, format, width_px, height_px,
                                      GL_TRUE);
    } else {
        glCreateTextures(GL_TEXTURE_2D, 1, &texture->handle);
        const int largest_px = width_px > height_px ? width_px : height_px;
        const int levels = kind->is_mipmapped ? (int)log2(largest_px) + 1 : 1;
        glTextureStorage2D(texture->handle, levels, format, width_px, height_px);
        glTextureParameteri(texture->handle, GL_TEXTURE_MIN_FILTER,
                            kind->is_mipmapped ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST);
        glTextureParameteri(texture->handle, GL_TEXTURE_MAG_FILTER,
                            kind->is_mipmapped ? GL_LINEAR : GL_NEAREST);
        if (kind->is_mipmapped) { /* 0 outside */
            glTextureParameteri(texture->handle, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
            glTextureParameteri(texture->handle, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
        }
    }
    glObjectLabel(GL_TEXTURE, texture->handle, -1, name);
    texture->width_px = width_px;
    texture->height_px = height_px;
    return render_gl_check(executor->errors, name, status);
}

static bool prepare_textures(struct render_executor *executor, const struct render_plan *plan,
                             dipole_status *status)
{
    for (size_t i = 0; i < executor->texture_count; i++)
        executor->textures[i].is_used = executor->textures[i].is_written = false;
    for (size_t i = 0; i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        const char *writes[RENDER_PASS_TARGETS + 1];
        render_plan_list_writes(plan, pass, writes);
        for (size_t w = 0; writes[w]; w++) {
            if (!texture_want(executor, plan, writes[w], status))
                return false;
        }
        if (pass->depth_written && !texture_want(executor, plan, pass->depth_written, status))
            return false;
    }
    size_t kept = 0;
    for (size_t i = 0; i < executor->texture_count; i++) {
        if (executor->textures[i].is_used)
            executor->textures[kept++] = executor->textures[i];
        else
            texture_end(&executor->textures[i]);
    }
    executor->texture_count = kept;
    return true;
}

GLuint render_executor_texture(const struct render_executor *executor, const char *texture)
{
    const struct texture *const found = texture_find(executor, texture);
    return found ? found->handle : 0;
}

void render_executor_hand_on(struct render_executor *executor, const char *texture, GLuint handle)
{
    texture_find(executor, texture)->handle = handle;
}

/* ---- what is kept between frames ---------------------------------------------------------------- */

bool render_executor_need_drawing(const struct render_frame *frame,
                                  struct render_light_drawing **drawing_out, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->drawing && !(executor->drawing = render_light_drawing_create()))
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for what lights see");
    *drawing_out = executor->drawing;
    return true;
}

bool render_executor_need_splatter(const struct render_frame *frame, struct render_splatter **splatter_out,
                                   dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->splatter && !render_splatter_create(frame->plan->media, &executor->splatter, status))
        return false;
    *splatter_out = executor->splatter;
    return true;
}

bool render_executor_need_gatherer(const struct render_frame *frame, struct render_gatherer **gatherer_out,
                                   dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->gatherer && !render_gatherer_create(frame->plan->media, &executor->gatherer, status))
        return false;
    *gatherer_out = executor->gatherer;
    return true;
}

bool render_executor_need_tsm(const struct render_frame *frame, struct render_tsm **tsm_out,
                              dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->tsm && !render_tsm_create(frame->plan->media, &executor->tsm, status))
        return false;
    *tsm_out = executor->tsm;
    return true;
}

bool render_executor_need_sky(const struct render_frame *frame, struct render_sky **sky_out,
                              dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->sky && !render_sky_create(frame->plan->media, &executor->sky, status))
        return false;
    *sky_out = executor->sky;
    return true;
}

bool render_executor_need_shadower(const struct render_frame *frame, struct render_shadower **shadower_out,
                                   dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (!executor->shadower && !render_shadower_create(frame->request->scene, &executor->shadower, status))
        return false;
    *shadower_out = executor->shadower;
    return true;
}

struct render_shadower *render_executor_shadower(const struct render_executor *executor)
{
    return executor->shadower;
}

struct render_sky *render_executor_sky(const struct render_executor *executor)
{
    return executor->sky;
}

struct render_tsm *render_executor_tsm(const struct render_executor *executor)
{
    return executor->tsm;
}

const struct render_light_drawing *render_executor_drawing(const struct render_executor *executor)
{
    return executor->drawing;
}

struct render_splatter *render_executor_splatter(const struct render_executor *executor)
{
    return executor->splatter;
}

/* Two texels for each object: eta, exit scale per sr, r_max in mm, 0; and the diffuse reflectance. */
bool render_executor_fill_media(const struct render_frame *frame, dipole_status *status)
{
    const size_t object_count = frame->request->scene->object_count;
    float(*const texels)[2][4] = calloc(object_count, sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the media of %zu objects",
                           object_count);
    for (size_t i = 0; i < object_count; i++) {
        const struct render_medium *const medium =
            &frame->plan->media->media[frame->plan->objects[i].medium];
        texels[i][0][0] = (float)medium->eta;
        texels[i][0][1] = (float)(1 / (PI * dipole_fdt_outside(medium->eta)));
        texels[i][0][2] = (float)frame->plan->of_medium[frame->plan->objects[i].medium].r_max_mm;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            texels[i][1][c] = (float)medium->diffuse_reflectance[c];
    }
    render_buffer_texture_fill(&frame->executor->object_buffer, GL_RGBA32F, texels,
                               object_count * sizeof *texels);
    render_executor_hand_on(frame->executor, "object_media", frame->executor->object_buffer.texture);
    free(texels);
    return true;
}

/* What shaders need to know of the triangles that a pixel shows (common/points.glsl). */
bool render_executor_use_meshes(const struct render_frame *frame, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    float *const roughness = calloc(executor->mesh_count, sizeof *roughness);
    if (!roughness)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the gloss of %zu objects",
                           executor->mesh_count);
    for (size_t i = 0; i < executor->mesh_count; i++)
        roughness[i] = (float)executor->meshes[i].roughness;
    render_buffer_texture_fill(&executor->roughness_buffer, GL_R32F, roughness,
                               executor->mesh_count * sizeof *roughness);
    free(roughness);
    const struct render_geometry *const geometry = &executor->geometry;
    render_executor_hand_on(executor, "mesh_triangles", geometry->triangles.texture);
    render_executor_hand_on(executor, "mesh_positions_mm",
                            geometry->vertices[RENDER_VERTEX_POSITION].texture);
    render_executor_hand_on(executor, "mesh_normals", geometry->vertices[RENDER_VERTEX_NORMAL].texture);
    render_executor_hand_on(executor, "mesh_roughness", executor->roughness_buffer.texture);
    return true;
}

/* OpenGL chooses the places; it tells those of the framebuffer that is drawn to. */
void render_executor_find_points(const struct render_frame *frame)
{
    for (GLuint i = 0; i < SAMPLES_PER_PIXEL; i++)
        glGetMultisamplefv(GL_SAMPLE_POSITION, i, frame->executor->point_places[i]);
}

void render_set_points(const struct render_frame *frame)
{
    const struct render_plan *const plan = frame->plan;
    const struct render_projection *const camera = &plan->camera;
    double corner[3], right[3], up[3];
    for (int k = 0; k < 3; k++) {
        const double middle = camera->is_orthographic ? camera->eye_mm[k] : camera->forward[k];
        right[k] = 2 * camera->half_width / plan->width_px * camera->right[k];
        up[k] = 2 * camera->half_height / plan->height_px * camera->up[k];
        corner[k] = middle - camera->half_width * camera->right[k] - camera->half_height * camera->up[k];
    }
    render_set_vec3(frame->program, "ray_corner", corner);
    render_set_vec3(frame->program, "ray_right", right);
    render_set_vec3(frame->program, "ray_up", up);
    glProgramUniform2fv(frame->program, glGetUniformLocation(frame->program, "point_places"),
                        SAMPLES_PER_PIXEL, frame->executor->point_places[0]);
    render_set_camera(frame->program, plan);
}

/* ---- counts ------------------------------------------------------------------------------------- */

size_t render_executor_program_count(const struct render_executor *executor)
{
    return executor->program_count + (executor->pose_program != 0) +
           (executor->shadower && render_shadower_has_program(executor->shadower));
}

size_t render_executor_draw_count(const struct render_executor *executor, size_t effect)
{
    return executor->draw_counts[effect];
}

void render_count_draw(const struct render_frame *frame)
{
    frame->executor->draw_counts[frame->effect]++;
}

/* ---- passes ------------------------------------------------------------------------------------- */

static void bind_textures(const struct render_frame *frame, const struct render_pass *pass)
{
    int unit = 0;
    for (size_t list = 0; list < 2; list++) {
        const char *const *const names = list ? pass->reads_if_written : pass->reads;
        for (size_t r = 0; r < RENDER_PASS_READS && names[r]; r++) {
            const GLuint texture = render_executor_texture(frame->executor, names[r]);
            if (!texture)
                continue;
            glBindTextureUnit((GLuint)unit, texture);
            render_set_int(frame->program, names[r], unit++);
        }
    }
}

void render_far_point(const struct render_plan_view *view, float value[4])
{
    for (int k = 0; k < 3; k++)
        value[k] = (float)(view->projection.eye_mm[k] +
                           1e6 * view->projection.far_mm * view->projection.forward[k]);
    value[3] = 0;
}

static bool attach_targets(const struct render_frame *frame, const struct render_pass *pass,
                           GLuint framebuffer, dipole_status *status)
{
    GLenum buffers[RENDER_PASS_TARGETS];
    GLsizei buffer_count = 0;
    const char *writes[RENDER_PASS_TARGETS + 1];
    render_plan_list_writes(frame->plan, pass, writes);
    for (size_t w = 0; writes[w]; w++) {
        struct texture *const target = texture_find(frame->executor, writes[w]);
        const GLenum attachment = GL_COLOR_ATTACHMENT0 + (GLenum)w;
        if (target->kind->format != RENDER_OTHER) /* else the pass attaches it by itself */
            glNamedFramebufferTexture(framebuffer, attachment, target->handle, 0);
        buffers[buffer_count++] = attachment;
    }
    const char *const depth_name = pass->depth_written ? pass->depth_written : pass->depth_tested;
    if (depth_name)
        glNamedFramebufferTexture(framebuffer, GL_DEPTH_ATTACHMENT,
                                  render_executor_texture(frame->executor, depth_name), 0);
    glNamedFramebufferDrawBuffers(framebuffer, buffer_count, buffers);
    if (glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "pass \"%s\": incomplete framebuffer",
                           pass->name);
    for (size_t w = 0; writes[w]; w++) {
        struct texture *const target = texture_find(frame->executor, writes[w]);
        const GLuint nothing[4] = { 0, 0, 0, 0 };
        float value[4] = { 0, 0, 0, 0 };
        if (target->kind->is_far_where_empty && frame->view)
            render_far_point(frame->view, value);
        if (target->kind->format == RENDER_R32UI)
            glClearNamedFramebufferuiv(framebuffer, GL_COLOR, (GLint)w, nothing);
        else if (target->kind->format != RENDER_OTHER && (!pass->is_added || !target->is_written))
            glClearNamedFramebufferfv(framebuffer, GL_COLOR, (GLint)w, value);
        target->is_written = true;
    }
    if (pass->depth_written) {
        const float farthest = 1;
        glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
    }
    return true;
}

static void set_state(const struct render_frame *frame, const struct render_pass *pass)
{
    const struct render_texture *const target =
        render_texture_find(pass->writes[0] ? pass->writes[0] : pass->depth_written);
    const bool is_map = target->size == RENDER_SIZE_MAP;
    int width_px, height_px;
    texture_size(frame->plan, target, &width_px, &height_px);
    if (frame->view &&
        (is_map || target->size == RENDER_SIZE_LIGHT_VIEW)) /* a part of a texture for the largest */
        width_px = height_px = frame->view->size_px;
    glViewport(0, 0, width_px, height_px);
    /* What stands between the light and the object that a map is fitted to is in front of its near plane.
     */
    (is_map || target->size == RENDER_SIZE_SHADOW ? glEnable : glDisable)(GL_DEPTH_CLAMP);
    (pass->is_added || pass->is_blended ? glEnable : glDisable)(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    (pass->depth_written || pass->depth_tested ? glEnable : glDisable)(GL_DEPTH_TEST);
    glDepthMask(pass->depth_written ? GL_TRUE : GL_FALSE);
    /* The triangle over the target is in front of all that a pixel shows, and of none where it is empty. */
    glDepthFunc(pass->draw == RENDER_DRAW_FULLSCREEN && pass->depth_written ? GL_ALWAYS : GL_LESS);
    glDisable(GL_CULL_FACE);
}

void render_draw_object(const struct render_frame *frame, size_t object)
{
    const struct mesh *const mesh = &frame->executor->meshes[object];
    const struct render_plan *const plan = frame->plan;
    const struct render_medium *const medium = &plan->media->media[plan->objects[object].medium];
    render_set_float(frame->program, "object", (double)(object + 1));
    render_set_int(frame->program, "first_vertex", (int)mesh->posed.first_vertex);
    render_set_int(frame->program, "first_triangle", (int)mesh->first_triangle);
    render_set_float(frame->program, "object_eta", medium->eta);
    glBindVertexArray(mesh->vertex_array);
    glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    render_count_draw(frame);
}

void render_draw_fullscreen(const struct render_frame *frame)
{
    glBindVertexArray(frame->executor->empty_vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    render_count_draw(frame);
}

void render_bind_buffer(const struct render_frame *frame, const char *name, int unit,
                        const struct render_buffer_texture *buffer)
{
    glBindTextureUnit((GLuint)unit, buffer->texture);
    render_set_int(frame->program, name, unit);
}

/* Whether the eye or light is outside of an object: then no triangle of a solid is seen from behind. */
static bool is_seen_from_outside(const struct render_frame *frame, size_t object)
{
    const struct render_projection *const view =
        frame->view ? &frame->view->projection : &frame->plan->camera;
    const struct render_ball *const ball = &frame->plan->objects[object].ball;
    double distance2 = 0;
    for (int k = 0; k < 3; k++)
        distance2 += (ball->centre_mm[k] - view->eye_mm[k]) * (ball->centre_mm[k] - view->eye_mm[k]);
    return view->is_orthographic || distance2 > ball->radius_mm * ball->radius_mm;
}

bool render_executor_hides_inside(const struct render_frame *frame, size_t object)
{
    return frame->executor->meshes[object].is_solid &&
           render_pose_keeps_sides(&frame->request->scene->objects[object]) &&
           is_seen_from_outside(frame, object);
}

static bool draw(const struct render_frame *frame, const struct render_pass *pass, dipole_status *status)
{
    if (pass->draw == RENDER_DRAW_BY_RUN)
        return pass->run(frame, status);
    if (pass->draw == RENDER_DRAW_FULLSCREEN) {
        render_draw_fullscreen(frame);
        return true;
    }
    for (size_t i = 0; i < frame->executor->mesh_count; i++) {
        if (frame->view && frame->view->is_of_object && frame->view->object != i)
            continue;
        (render_executor_hides_inside(frame, i) ? glEnable : glDisable)(GL_CULL_FACE);
        render_draw_object(frame, i);
    }
    glDisable(GL_CULL_FACE);
    return true;
}

static void make_mipmaps(const struct render_frame *frame, const struct render_pass *pass)
{
    const char *writes[RENDER_PASS_TARGETS + 1];
    render_plan_list_writes(frame->plan, pass, writes);
    for (size_t w = 0; writes[w]; w++) {
        const struct texture *const target = texture_find(frame->executor, writes[w]);
        if (target->kind->is_mipmapped)
            glGenerateTextureMipmap(target->handle);
    }
}

static bool run_pass(struct render_frame *frame, const struct render_pass *pass, dipole_status *status)
{
    struct render_executor *const executor = frame->executor;
    if (pass->draw == RENDER_DRAW_NOTHING)
        return pass->run(frame, status) && render_gl_check(executor->errors, pass->name, status);
    if (!program_for(executor, frame->plan, pass, &frame->program, status))
        return false;
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    set_state(frame, pass); /* before the targets are cleared: what is masked is not */
    bool done = attach_targets(frame, pass, framebuffer, status);
    if (done) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glUseProgram(frame->program);
        bind_textures(frame, pass);
        if (pass->bind)
            pass->bind(frame);
        done = draw(frame, pass, status);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        make_mipmaps(frame, pass);
    }
    glDeleteFramebuffers(1, &framebuffer);
    glFinish(); /* timer queries are wrong by orders of magnitude on software renderers */
    return done && render_gl_check(executor->errors, pass->name, status);
}

/* Programs are made before any pass is timed. */
static bool prepare_programs(struct render_executor *executor, const struct render_plan *plan,
                             dipole_status *status)
{
    bool done = true;
    for (size_t i = 0; done && i < plan->pass_count; i++) {
        const struct render_pass *const pass = plan->passes[i].pass;
        GLuint program;
        done = pass->draw == RENDER_DRAW_NOTHING || program_for(executor, plan, pass, &program, status);
    }
    return done;
}

bool render_executor_run(struct render_executor *executor, const struct render_request *request,
                         const struct render_plan *plan, const struct render_table *tables,
                         const struct lut_tsm *const *volumes, double time_ms[RENDER_EFFECT_LIMIT],
                         dipole_status *status)
{
    memset(time_ms, 0, RENDER_EFFECT_LIMIT * sizeof *time_ms);
    memset(executor->draw_counts, 0, sizeof executor->draw_counts);
    if (!update_meshes(executor, request->scene, status))
        return false;
    if (executor->splatter)
        render_splatter_begin(executor->splatter);
    if (!prepare_textures(executor, plan, status))
        return false;
    bool done = prepare_programs(executor, plan, status);
    for (size_t i = 0; done && i < plan->pass_count; i++) {
        const struct render_plan_pass *const row = &plan->passes[i];
        struct render_frame frame = { .executor = executor,
                                      .request = request,
                                      .plan = plan,
                                      .tables = tables,
                                      .volumes = volumes,
                                      .effect = row->effect };
        if (row->pass->is_per_view)
            frame.view = &plan->views[row->view];
        if (row->pass->is_per_map)
            frame.view = &plan->maps[row->view];
        const double start_ms = now_ms();
        done = run_pass(&frame, row->pass, status);
        time_ms[row->effect] += now_ms() - start_ms;
    }
    return done;
}

bool render_executor_read(struct render_executor *executor, const char *texture, float *pixels,
                          dipole_status *status)
{
    const struct texture *const source = texture_find(executor, texture);
    const size_t row = (size_t)source->width_px * 4;
    float *const swap = malloc(row * sizeof *swap);
    if (!swap)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a row of %d pixels",
                           source->width_px);
    glGetTextureSubImage(source->handle, 0, 0, 0, 0, source->width_px, source->height_px, 1, GL_RGBA,
                         GL_FLOAT, (GLsizei)(row * (size_t)source->height_px * sizeof *pixels), pixels);
    for (int top = 0, bottom = source->height_px - 1; top < bottom; top++, bottom--) {
        float *const a = pixels + row * (size_t)top, *const b = pixels + row * (size_t)bottom;
        memcpy(swap, a, row * sizeof *swap);
        memcpy(a, b, row * sizeof *swap);
        memcpy(b, swap, row * sizeof *swap);
    }
    free(swap);
    return render_gl_check(executor->errors, "reading the picture back", status);
}
