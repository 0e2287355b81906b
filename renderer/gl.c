#include "renderer/gl.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GLSL_VERSION "#version 450 core\n"

enum { INCLUDE_DEPTH_LIMIT = 8, SHADER_FILE_LIMIT = 32, SHADER_BYTES_LIMIT = 1 << 18 };

/* ---- errors ------------------------------------------------------------------------------------- */

static void GLAD_API_PTR on_message(GLenum source, GLenum type, GLuint id, GLenum severity, GLsizei length,
                                    const GLchar *message, const void *user)
{
    struct render_gl_errors *const errors = (struct render_gl_errors *)user;
    (void)source;
    (void)severity;
    (void)length;
    if (type != GL_DEBUG_TYPE_ERROR || errors->has_failed)
        return;
    errors->has_failed = true;
    errors->is_out_of_memory = id == GL_OUT_OF_MEMORY;
    snprintf(errors->message, sizeof errors->message, "%s", message);
}

bool render_gl_start(GLADloadfunc load, struct render_gl_errors *errors, dipole_status *status)
{
    const int version = gladLoadGL(load);
    if (version < GLAD_MAKE_VERSION(4, 5))
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "OpenGL %d.%d, expected 4.5",
                           GLAD_VERSION_MAJOR(version), GLAD_VERSION_MINOR(version));
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_message, errors);
    return true;
}

bool render_gl_is_software(void)
{
    static const char *const names[] = {
        "llvmpipe", "softpipe", "swrast", "SWR", "Software", "SwiftShader"
    };
    const char *const renderer = (const char *)glGetString(GL_RENDERER);
    for (size_t i = 0; renderer && i < sizeof names / sizeof *names; i++) {
        if (strstr(renderer, names[i]))
            return true;
    }
    return false;
}

bool render_gl_check(struct render_gl_errors *errors, const char *doing, dipole_status *status)
{
    const GLenum code = glGetError();
    if (!errors->has_failed && code == GL_NO_ERROR)
        return true;
    const bool is_out_of_memory = errors->is_out_of_memory || code == GL_OUT_OF_MEMORY;
    dipole_fail(status, is_out_of_memory ? DIPOLE_OUT_OF_MEMORY : DIPOLE_NOT_SUPPORTED, NULL,
                "OpenGL error 0x%04x during %s: %s", code, doing, errors->message);
    *errors = (struct render_gl_errors){ .has_failed = false };
    return false;
}

/* ---- shaders ------------------------------------------------------------------------------------ */

/* A text that grows, and the files it came from: their index is the source number in #line. */
struct assembly {
    char *text;
    size_t used;
    const char *files[SHADER_FILE_LIMIT];
    int file_count;
};

const struct render_shader *render_shader_find(const char *name)
{
    for (const struct render_shader *shader = render_shaders; shader->name; shader++) {
        if (strcmp(shader->name, name) == 0)
            return shader;
    }
    return NULL;
}

static bool put(struct assembly *assembly, const char *text, size_t length, dipole_status *status)
{
    if (length >= SHADER_BYTES_LIMIT - assembly->used)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "a shader is longer than %d bytes",
                           SHADER_BYTES_LIMIT);
    memcpy(assembly->text + assembly->used, text, length);
    assembly->used += length;
    assembly->text[assembly->used] = '\0';
    return true;
}

static bool put_line_mark(struct assembly *assembly, int line, int file, dipole_status *status)
{
    char mark[48];
    const int length = snprintf(mark, sizeof mark, "#line %d %d\n", line, file);
    return put(assembly, mark, (size_t)length, status);
}

static bool assemble(struct assembly *assembly, const struct render_shader *shader, int depth,
                     dipole_status *status)
{
    static const char directive[] = "#include \"";
    if (depth > INCLUDE_DEPTH_LIMIT || assembly->file_count == SHADER_FILE_LIMIT)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s: includes too many or too deep",
                           shader->name);
    const int file = assembly->file_count++;
    assembly->files[file] = shader->name;
    if (!put_line_mark(assembly, 1, file, status))
        return false;
    int line = 1;
    for (const char *at = shader->text; *at; line++) {
        const char *const newline = strchr(at, '\n');
        const size_t length = newline ? (size_t)(newline - at) + 1 : strlen(at);
        if (strncmp(at, directive, sizeof directive - 1) != 0) {
            if (!put(assembly, at, length, status))
                return false;
        } else {
            char name[64] = "";
            const char *const path = at + sizeof directive - 1;
            const size_t name_length = strcspn(path, "\"\n");
            if (name_length < sizeof name)
                memcpy(name, path, name_length);
            const struct render_shader *const included = render_shader_find(name);
            if (!included)
                return dipole_fail(status, DIPOLE_NOT_FOUND, NULL, "%s:%d: no shader file \"%s\"",
                                   shader->name, line, name);
            if (!assemble(assembly, included, depth + 1, status) ||
                !put_line_mark(assembly, line + 1, file, status))
                return false;
        }
        at += length;
    }
    return true;
}

/* The first line of the compiler's log, "FILE NUMBER:LINE(COLUMN): ..." with the file's name. */
static void fail_with_log(const struct assembly *assembly, const char *log, dipole_status *status)
{
    char *end;
    const long file = strtol(log, &end, 10);
    const int length = (int)strcspn(end, "\n");
    if (end != log && *end == ':' && file >= 0 && file < assembly->file_count)
        dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s%.*s", assembly->files[file], length, end);
    else
        dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s: %.*s", assembly->files[0],
                    (int)strcspn(log, "\n"), log);
}

static bool compile(const struct render_shader *shader, const char *defines, GLenum stage, GLuint program,
                    dipole_status *status)
{
    struct assembly assembly = { .text = malloc(SHADER_BYTES_LIMIT) };
    if (!assembly.text)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for shader %s", shader->name);
    bool done = put(&assembly, GLSL_VERSION, strlen(GLSL_VERSION), status) &&
                put(&assembly, defines ? defines : "", defines ? strlen(defines) : 0, status) &&
                assemble(&assembly, shader, 0, status);
    if (done) {
        const GLuint handle = glCreateShader(stage);
        const GLchar *const text = assembly.text;
        glShaderSource(handle, 1, &text, NULL);
        glCompileShader(handle);
        GLint is_compiled = GL_FALSE;
        glGetShaderiv(handle, GL_COMPILE_STATUS, &is_compiled);
        done = is_compiled;
        if (done) {
            glAttachShader(program, handle);
        } else {
            char log[1024] = "";
            glGetShaderInfoLog(handle, sizeof log, NULL, log);
            fail_with_log(&assembly, log, status);
        }
        glDeleteShader(handle); /* lives on while it is attached */
    }
    free(assembly.text);
    return done;
}

/* They go, now that the program is linked. */
static void detach_shaders(GLuint program)
{
    GLuint shaders[2];
    GLsizei count = 0;
    glGetAttachedShaders(program, 2, &count, shaders);
    for (GLsizei i = 0; i < count; i++)
        glDetachShader(program, shaders[i]);
}

/* Link what was compiled; what fails, now or before, is deleted. */
static bool finish(GLuint program, bool is_compiled, const char *names, GLuint *program_out,
                   dipole_status *status)
{
    GLint is_linked = GL_FALSE;
    if (is_compiled) {
        glLinkProgram(program);
        glGetProgramiv(program, GL_LINK_STATUS, &is_linked);
    }
    *program_out = is_linked ? program : 0;
    if (is_linked) {
        detach_shaders(program);
        return true;
    }
    if (is_compiled) {
        char log[256] = "";
        glGetProgramInfoLog(program, sizeof log, NULL, log);
        dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s: %.*s", names, (int)strcspn(log, "\n"), log);
    }
    glDeleteProgram(program);
    return false;
}

bool render_program_create(const struct render_shader *vertex, const struct render_shader *fragment,
                           const char *defines, GLuint *program_out, dipole_status *status)
{
    const GLuint program = glCreateProgram();
    char names[160];
    snprintf(names, sizeof names, "%s with %s", vertex->name, fragment->name);
    const bool is_compiled = compile(vertex, defines, GL_VERTEX_SHADER, program, status) &&
                             compile(fragment, defines, GL_FRAGMENT_SHADER, program, status);
    return finish(program, is_compiled, names, program_out, status);
}

bool render_feedback_program_create(const struct render_shader *vertex, const char *const *outputs,
                                    int output_count, GLuint *program_out, dipole_status *status)
{
    const GLuint program = glCreateProgram();
    const bool is_compiled = compile(vertex, NULL, GL_VERTEX_SHADER, program, status);
    glTransformFeedbackVaryings(program, output_count, outputs, GL_SEPARATE_ATTRIBS);
    return finish(program, is_compiled, vertex->name, program_out, status);
}

/* ---- uniforms ----------------------------------------------------------------------------------- */

void render_set_int(GLuint program, const char *name, int value)
{
    glProgramUniform1i(program, glGetUniformLocation(program, name), value);
}

void render_set_float(GLuint program, const char *name, double value)
{
    glProgramUniform1f(program, glGetUniformLocation(program, name), (float)value);
}

void render_set_vec3(GLuint program, const char *name, const double value[3])
{
    glProgramUniform3f(program, glGetUniformLocation(program, name), (float)value[0], (float)value[1],
                       (float)value[2]);
}

void render_set_vec4(GLuint program, const char *name, double x, double y, double z, double w)
{
    glProgramUniform4f(program, glGetUniformLocation(program, name), (float)x, (float)y, (float)z,
                       (float)w);
}

void render_set_matrix(GLuint program, const char *name, const struct render_projection *projection)
{
    float matrix[16];
    render_projection_matrix(projection, matrix);
    glProgramUniformMatrix4fv(program, glGetUniformLocation(program, name), 1, GL_FALSE, matrix);
}

/* ---- buffers ------------------------------------------------------------------------------------ */

void render_buffer_texture_destroy(struct render_buffer_texture *buffer)
{
    if (buffer->texture)
        glDeleteTextures(1, &buffer->texture);
    if (buffer->buffer)
        glDeleteBuffers(1, &buffer->buffer);
    *buffer = (struct render_buffer_texture){ 0 };
}

void render_buffer_texture_fill(struct render_buffer_texture *buffer, GLenum format, const void *data,
                                size_t size)
{
    render_buffer_texture_destroy(buffer);
    glCreateBuffers(1, &buffer->buffer);
    glNamedBufferStorage(buffer->buffer, (GLsizeiptr)size, data, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &buffer->texture);
    glTextureBuffer(buffer->texture, format, buffer->buffer);
}
