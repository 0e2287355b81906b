/* Runs plans: owns buffers, textures, framebuffers, programs and timers. Its context must be current. */
#ifndef RENDERER_EXECUTE_H
#define RENDERER_EXECUTE_H

#include "renderer/gl.h"
#include "renderer/plan.h"

struct render_executor;
struct render_light_drawing;
struct render_splatter;
struct render_gatherer;
struct render_sky;
struct render_shadower;
struct render_tsm;

/* What a pass sees when its bind or run function is called. */
struct render_frame {
    struct render_executor *executor;
    const struct render_request *request;
    const struct render_plan *plan;
    const struct render_table *tables;    /* of each medium, when the plan splats */
    const struct lut_tsm *const *volumes; /* of each medium, when the plan has maps */
    const struct render_plan_view *view;  /* of passes per view or map, else NULL */
    size_t effect;                        /* that the pass is of                  */
    GLuint program;                       /* 0 when nothing is drawn              */
};

/* Takes the scene's meshes to the context. End it with render_executor_destroy, context current. */
DIPOLE_CHECKED bool render_executor_create(const struct io_scene *scene, struct render_gl_errors *errors,
                                           struct render_executor **executor_out, dipole_status *status);
void render_executor_destroy(struct render_executor *executor);

/* Forget what was made of tables and volumes, which are known by address: before those are freed, as others
 * may come to lie there. Context current. */
void render_executor_forget_tables(struct render_executor *executor);

/* Forget what was made of the media, and take the objects' roughness again. Context current. */
void render_executor_renew_materials(struct render_executor *executor, const struct io_scene *scene);

/*
 * Run the passes in order; time_ms[e] of each effect of the plan is set. tables: one for each medium,
 * needed when the plan splats, else NULL; volumes: the same when it has maps. Fails with
 * DIPOLE_NOT_SUPPORTED or DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_executor_run(struct render_executor *executor,
                                        const struct render_request *request,
                                        const struct render_plan *plan, const struct render_table *tables,
                                        const struct lut_tsm *const *volumes,
                                        double time_ms[RENDER_EFFECT_LIMIT], dipole_status *status);

/* Copy a texture of the frame's size, RGBA, rows from the top. */
DIPOLE_CHECKED bool render_executor_read(struct render_executor *executor, const char *texture,
                                         float *pixels, dipole_status *status);

/* OpenGL's name of a texture; 0 when no pass has asked for it. */
GLuint render_executor_texture(const struct render_executor *executor, const char *texture);

/* How many programs were compiled so far; how many draw calls an effect made in the last run. */
size_t render_executor_program_count(const struct render_executor *executor);
size_t render_executor_draw_count(const struct render_executor *executor, size_t effect);

/* The light's view that was drawn in memory last; NULL before a plan that keeps one has run. */
const struct render_light_drawing *render_executor_drawing(const struct render_executor *executor);

/* The state of the splats; NULL before a plan that needs light samples has run. */
struct render_splatter *render_executor_splatter(const struct render_executor *executor);

/* ---- for bind and run functions ----------------------------------------------------------------- */

/* Uniforms that several passes share (passes/shared.c): a light, its view, the camera, and how radiosity
 * leaves the one medium there is (common/medium.glsl). */
void render_set_light(GLuint program, const struct io_light *light);
void render_set_light_view(GLuint program, const struct render_request *request,
                           const struct render_plan_view *view);
void render_set_camera(GLuint program, const struct render_plan *plan);
void render_set_medium(GLuint program, const struct render_plan *plan);

/* Where the points of pixels are, and the rays through them (common/points.glsl); the camera, too. The
 * places are those of the framebuffer that they were found with. */
void render_executor_find_points(const struct render_frame *frame);
void render_set_points(const struct render_frame *frame);

/* Say that a draw call was made. Functions that draw by themselves call it. */
/* Whether no triangle of an object is seen from behind, by the camera or the frame's light. */
bool render_executor_hides_inside(const struct render_frame *frame, size_t object);

void render_count_draw(const struct render_frame *frame);

/* Draw one object, or a triangle over the whole target. */
void render_draw_object(const struct render_frame *frame, size_t object);
void render_draw_fullscreen(const struct render_frame *frame);

/* Let the shader read a buffer, or a texture that a pass keeps by itself. */
void render_bind_buffer(const struct render_frame *frame, const char *name, int unit,
                        const struct render_buffer_texture *buffer);

/* The texture (RENDER_OTHER) that passes read by that name from now on; its maker ends it. */
void render_executor_hand_on(struct render_executor *executor, const char *texture, GLuint handle);

/* Where a light's view shows no surface it shows one infinitely far away: nothing there casts a shadow. */
void render_far_point(const struct render_plan_view *view, float value[4]);

/* Make what is kept between frames, when it is first needed. */
DIPOLE_CHECKED bool render_executor_need_drawing(const struct render_frame *frame,
                                                 struct render_light_drawing **drawing_out,
                                                 dipole_status *status);
DIPOLE_CHECKED bool render_executor_need_splatter(const struct render_frame *frame,
                                                  struct render_splatter **splatter_out,
                                                  dipole_status *status);

DIPOLE_CHECKED bool render_executor_need_gatherer(const struct render_frame *frame,
                                                  struct render_gatherer **gatherer_out,
                                                  dipole_status *status);
DIPOLE_CHECKED bool render_executor_need_tsm(const struct render_frame *frame, struct render_tsm **tsm_out,
                                             dipole_status *status);

DIPOLE_CHECKED bool render_executor_need_sky(const struct render_frame *frame, struct render_sky **sky_out,
                                             dipole_status *status);

DIPOLE_CHECKED bool render_executor_need_shadower(const struct render_frame *frame,
                                                  struct render_shadower **shadower_out,
                                                  dipole_status *status);

/* What was made; NULL before. */
struct render_tsm *render_executor_tsm(const struct render_executor *executor);
struct render_shadower *render_executor_shadower(const struct render_executor *executor);
struct render_sky *render_executor_sky(const struct render_executor *executor);

/* Put the vertices of objects that are not at rest where the frame has them: those that are deformed, or
 * those that are moved alone. */
DIPOLE_CHECKED bool render_executor_pose(const struct render_frame *frame, bool is_deformed,
                                         dipole_status *status);

/* The triangles of all objects, for common/points.glsl; handed on as mesh_triangles and so on. */
DIPOLE_CHECKED bool render_executor_use_meshes(const struct render_frame *frame, dipole_status *status);

/* What each object is made of, for common/medium.glsl; handed on as object_media. */
DIPOLE_CHECKED bool render_executor_fill_media(const struct render_frame *frame, dipole_status *status);

#endif
