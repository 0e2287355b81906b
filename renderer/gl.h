/* What the passes need of OpenGL: errors as dipole_status, shaders with #include, uniforms by name. */
#ifndef RENDERER_GL_H
#define RENDERER_GL_H

#include "renderer/projection.h"

#include <glad/gl.h>

/* The first error the driver reported, kept until it is looked at. */
struct render_gl_errors {
    bool has_failed, is_out_of_memory;
    char message[256];
};

/* Load the functions of the current context and listen to its errors; errors must outlive the context. */
DIPOLE_CHECKED bool render_gl_start(GLADloadfunc load, struct render_gl_errors *errors,
                                    dipole_status *status);

/* Fails with the first error since the last check; doing: what was going on. */
DIPOLE_CHECKED bool render_gl_check(struct render_gl_errors *errors, const char *doing,
                                    dipole_status *status);

/* Whether the current context draws on the processor: llvmpipe, softpipe or the like. */
bool render_gl_is_software(void);

/* A GLSL file: its name below shaders/, and its text. */
struct render_shader {
    const char *name, *text;
};

/* Every file of shaders/, embedded when the library is built; ends with a NULL name. */
extern const struct render_shader render_shaders[];

/* The embedded file of that name; NULL when there is none. */
const struct render_shader *render_shader_find(const char *name);

/*
 * Compile and link. defines: lines put after #version, or NULL. Messages of the compiler name the file
 * and line. Fails with DIPOLE_NOT_SUPPORTED.
 */
DIPOLE_CHECKED bool render_program_create(const struct render_shader *vertex,
                                          const struct render_shader *fragment, const char *defines,
                                          GLuint *program_out, dipole_status *status);

/* The same of a vertex shader whose outputs are written to buffers, one for each. */
DIPOLE_CHECKED bool render_feedback_program_create(const struct render_shader *vertex,
                                                   const char *const *outputs, int output_count,
                                                   GLuint *program_out, dipole_status *status);

/* A buffer that shaders read as a texture. */
struct render_buffer_texture {
    GLuint buffer, texture;
};

/* Put new data in place of the old; size > 0. Destroy accepts { 0 }. */
void render_buffer_texture_fill(struct render_buffer_texture *buffer, GLenum format, const void *data,
                                size_t size);
void render_buffer_texture_destroy(struct render_buffer_texture *buffer);

/* Uniforms by name; a program that has none of that name is left alone. */
void render_set_int(GLuint program, const char *name, int value);
void render_set_float(GLuint program, const char *name, double value);
void render_set_vec3(GLuint program, const char *name, const double value[3]);
void render_set_vec4(GLuint program, const char *name, double x, double y, double z, double w);
void render_set_matrix(GLuint program, const char *name, const struct render_projection *projection);

#endif
