/* What the tests of lutgen/glsl share: a context, files to textures as an engine loads them, and programs
 * that answer queries. */
#ifndef TESTS_GLSL_H
#define TESTS_GLSL_H

#include "tests/table_files.h"

#include "io/dds.h"
#include "io/raw.h"
#include "renderer/context.h"
#include "renderer/gl.h"

#include <jansson.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { QUERY_COUNT = 4096, WORDS = 8 }; /* numbers that a shader is asked with, each */

static struct render_context *context;
static struct render_gl_errors gl_errors;

static inline int start(void **state)
{
    (void)state;
    dipole_status status;
    if (render_context_create(RENDER_CONTEXT_OSMESA, &context, &status) &&
        context->make_current(context, &status) && render_gl_start(context->load, &gl_errors, &status))
        return 0;
    print_error("%s\n", status.message);
    return -1;
}

static inline int stop(void **state)
{
    (void)state;
    render_context_destroy(context);
    return 0;
}

static inline void expect_no_gl_error(void)
{
    dipole_status status;
    if (!render_gl_check(&gl_errors, "a test", &status))
        fail_msg("%s", status.message);
}

/* ---- files to textures ----------------------------------------------------------------------------- */

enum file_kind { FILE_EXR = 0, FILE_DDS, FILE_RAW, FILE_KIND_COUNT };

static inline void put_file(enum file_kind kind, const char *path, const struct io_image *image, int depth,
                            bool is_half)
{
    dipole_status status;
    if (!(kind == FILE_EXR   ? io_exr_write(path, image, is_half, &status)
          : kind == FILE_DDS ? io_dds_write(path, image, depth, is_half, &status)
                             : io_raw_write(path, image, depth, is_half, &status)))
        fail_msg("%s", status.message);
}

/* As an engine does: linear filtering, clamped to the edge, one level. */
static inline GLuint texture_create(GLenum target, GLenum internal_format, int width, int height, int depth,
                                    GLenum format, GLenum type, const void *texels)
{
    GLuint texture;
    glCreateTextures(target, 1, &texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    if (target == GL_TEXTURE_3D) {
        glTextureStorage3D(texture, 1, internal_format, width, height, depth);
        glTextureSubImage3D(texture, 0, 0, 0, 0, width, height, depth, format, type, texels);
    } else {
        glTextureStorage2D(texture, 1, internal_format, width, height);
        glTextureSubImage2D(texture, 0, 0, 0, width, height, format, type, texels);
    }
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    expect_no_gl_error();
    return texture;
}

static inline GLuint load_exr(const char *path)
{
    struct io_image *image;
    assert_true(io_exr_read(path, &image, NULL));
    const GLuint texture = texture_create(GL_TEXTURE_2D, GL_RGB32F, image->width_px, image->height_px, 1,
                                          GL_RGB, GL_FLOAT, image->pixels);
    io_image_destroy(image);
    return texture;
}

static inline GLuint load_dds(const char *path)
{
    size_t size;
    unsigned char *const bytes = read_bytes(path, &size);
    const int height = (int)little_endian(bytes + 12, 4), width = (int)little_endian(bytes + 16, 4);
    const int depth = (int)little_endian(bytes + 24, 4);
    const bool is_half = little_endian(bytes + 128, 4) == 10,
               is_volume = little_endian(bytes + 132, 4) == 4;
    assert_int_equal(size, 148 + (size_t)width * (size_t)height * (size_t)depth * (is_half ? 8 : 16));
    const GLuint texture =
        texture_create(is_volume ? GL_TEXTURE_3D : GL_TEXTURE_2D, is_half ? GL_RGBA16F : GL_RGBA32F, width,
                       height, depth, GL_RGBA, is_half ? GL_HALF_FLOAT : GL_FLOAT, bytes + 148);
    free(bytes);
    return texture;
}

static inline GLuint load_raw(const char *path)
{
    size_t size;
    char sidecar_path[64];
    snprintf(sidecar_path, sizeof sidecar_path, "%s.json", path);
    unsigned char *const bytes = read_bytes(path, &size);
    json_t *const sidecar = json_load_file(sidecar_path, 0, NULL);
    int width, height, depth;
    const char *format;
    assert_int_equal(json_unpack(sidecar, "{s:i, s:i, s:i, s:s}", "width", &width, "height", &height,
                                 "depth", &depth, "format", &format),
                     0);
    const bool is_half = strcmp(format, "rgb16f") == 0;
    assert_int_equal(size, (size_t)width * (size_t)height * (size_t)depth * (is_half ? 6 : 12));
    const GLuint texture =
        texture_create(depth > 1 ? GL_TEXTURE_3D : GL_TEXTURE_2D, is_half ? GL_RGB16F : GL_RGB32F, width,
                       height, depth, GL_RGB, is_half ? GL_HALF_FLOAT : GL_FLOAT, bytes);
    json_decref(sidecar);
    free(bytes);
    return texture;
}

static inline GLuint load_file(enum file_kind kind, const char *path)
{
    return kind == FILE_EXR ? load_exr(path) : kind == FILE_DDS ? load_dds(path) : load_raw(path);
}

/* ---- shaders --------------------------------------------------------------------------------------- */

static inline char *read_glsl(const char *name)
{
    char path[512], *text;
    size_t size;
    snprintf(path, sizeof path, SOURCE_FOLDER "/lutgen/glsl/%s", name);
    assert_true(io_file_read(path, 1 << 16, &text, &size, NULL));
    return text;
}

static inline GLuint compile(GLenum stage, int part_count, const char *const *parts)
{
    const GLuint shader = glCreateShader(stage);
    glShaderSource(shader, part_count, parts, NULL);
    glCompileShader(shader);
    GLint is_compiled;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &is_compiled);
    char log[1024] = "";
    glGetShaderInfoLog(shader, sizeof log, NULL, log);
    if (!is_compiled || strstr(log, "warning"))
        fail_msg("%s", log);
    return shader;
}

/* A program that answers a query in each pixel: vec3 answer(vec4 a, vec4 b), after one of our files. */
static inline GLuint program_create(const char *version, const char *defines, const char *file,
                                    const char *answer)
{
    static const char *const vertex =
        "#version 330 core\n"
        "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1)"
        " * 4.0 - 1.0, 0.0, 1.0); }\n";
    static const char *const end =
        "uniform samplerBuffer queries;\n"
        "out vec4 value;\n"
        "void main() { int i = int(gl_FragCoord.x);\n"
        "  value = vec4(answer(texelFetch(queries, 2 * i), texelFetch(queries, 2 * i + 1)), 1.0); }\n";
    char *const functions = read_glsl(file);
    const GLuint program = glCreateProgram();
    const GLuint shaders[2] = { compile(GL_VERTEX_SHADER, 1, &vertex),
                                compile(GL_FRAGMENT_SHADER, 5,
                                        (const char *[]){ version, defines, functions, answer, end }) };
    for (int i = 0; i < 2; i++) {
        glAttachShader(program, shaders[i]);
        glDeleteShader(shaders[i]);
    }
    glLinkProgram(program);
    GLint is_linked;
    glGetProgramiv(program, GL_LINK_STATUS, &is_linked);
    assert_true(is_linked);
    free(functions);
    render_set_int(program, "texels", 0);
    render_set_int(program, "queries", 1);
    return program;
}

/* Ask QUERY_COUNT queries of WORDS numbers; rgba answers. */
static inline void ask(GLuint program, GLuint table, const float *queries, float *rgba)
{
    GLuint buffer, buffer_texture, target, framebuffer, vertex_array;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, (GLsizeiptr)(QUERY_COUNT * WORDS * sizeof(float)), queries, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &buffer_texture);
    glTextureBuffer(buffer_texture, GL_RGBA32F, buffer);
    glCreateTextures(GL_TEXTURE_2D, 1, &target);
    glTextureStorage2D(target, 1, GL_RGBA32F, QUERY_COUNT, 1);
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, target, 0);
    glCreateVertexArrays(1, &vertex_array);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, QUERY_COUNT, 1);
    glUseProgram(program);
    glBindTextureUnit(0, table);
    glBindTextureUnit(1, buffer_texture);
    glBindVertexArray(vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glGetTextureImage(target, 0, GL_RGBA, GL_FLOAT, QUERY_COUNT * 16, rgba);
    expect_no_gl_error();
    glDeleteVertexArrays(1, &vertex_array);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(1, &target);
    glDeleteTextures(1, &buffer_texture);
    glDeleteBuffers(1, &buffer);
}

#endif
