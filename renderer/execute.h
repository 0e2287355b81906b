/* Runs plans: owns buffers, textures, framebuffers, programs and timers. Its context must be current. */
#ifndef RENDERER_EXECUTE_H
#define RENDERER_EXECUTE_H

#include "renderer/gl.h"
#include "renderer/plan.h"
#include "renderer/splats.h"

struct render_executor;

/* What a pass sees when its bind or run function is called. */
struct render_frame {
    struct render_executor *executor;
    const struct render_request *request;
    const struct render_plan *plan;
    const struct render_plan_view *view; /* of passes per view, else NULL */
    GLuint program;                      /* 0 when nothing is drawn       */
};

/* Takes the scene's meshes to the context. End it with render_executor_destroy, context current. */
DIPOLE_CHECKED bool render_executor_create(const struct io_scene *scene, struct render_gl_errors *errors,
                                           struct render_executor **executor_out, dipole_status *status);
void render_executor_destroy(struct render_executor *executor);

/*
 * Run the passes in order; time_ms[e] of each effect of the plan is set. table: needed when the plan
 * splats, else NULL. Fails with DIPOLE_NOT_SUPPORTED or DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_executor_run(struct render_executor *executor,
                                        const struct render_request *request,
                                        const struct render_plan *plan, const struct lut_splat *table,
                                        double time_ms[RENDER_EFFECT_LIMIT], dipole_status *status);

/* Copy a texture of the frame's size, RGBA, rows from the top. */
DIPOLE_CHECKED bool render_executor_read(struct render_executor *executor, const char *texture,
                                         float *pixels, dipole_status *status);

/* OpenGL's name of a texture; 0 when no pass has asked for it. */
GLuint render_executor_texture(const struct render_executor *executor, const char *texture);

/* How many programs were compiled so far. */
size_t render_executor_program_count(const struct render_executor *executor);

/* What the last run sampled, at the finest. */
struct render_light_samples *render_executor_samples(struct render_executor *executor);
size_t render_executor_splat_count(const struct render_executor *executor);

/* For bind functions (passes/shared.c): a light, its view, the camera, and how radiosity leaves. */
void render_set_light(GLuint program, const struct io_light *light);
void render_set_light_view(GLuint program, const struct render_request *request,
                           const struct render_plan_view *view);
void render_set_camera(GLuint program, const struct render_plan *plan);
void render_set_exit(GLuint program, const struct render_plan *plan);

/* For run functions: reduce the light's view that was just drawn to samples. */
DIPOLE_CHECKED bool render_executor_sample_light_view(const struct render_frame *frame,
                                                      dipole_status *status);

#endif
