/* What the files of the plan share. */
#ifndef RENDERER_PLAN_INTERNAL_H
#define RENDERER_PLAN_INTERNAL_H

#include "renderer/plan.h"

/* Texels a side of a light's view: every OpenGL 4.5 has 16384; this many of four floats take 268 MB. And of
 * all views together: RENDER_LIGHT_SAMPLE_LIMIT texels, since each may become a sample. */
enum { RENDER_VIEW_SIDE_LIMIT = 4096 };

/* Part of epsilon that light from all around may err by: harmonics left out, by their bound, and of that
 * the tables of irradiance, by theirs. */
#define RENDER_ENVIRONMENT_SHARE 0.1
#define RENDER_IRRADIANCE_SHARE 0.02

void render_plan_add_note(struct render_plan *plan, const char *format, ...) DIPOLE_PRINTF(2, 3);

/* plan_environment.c: the environment that may be drawn; then, once the technique is known, its irradiance
 * in each medium; its end. */
DIPOLE_CHECKED bool render_plan_take_environment(const struct render_request *request,
                                                 struct render_plan *plan, dipole_status *status);
DIPOLE_CHECKED bool render_plan_light_from_around(const struct render_request *request,
                                                  struct render_plan *plan, dipole_status *status);
void render_plan_forget_environment(struct render_plan *plan);

/* plan_budget.c: share out epsilon; r_max, spacing and blur of each visible medium. Then, once the views
 * are known, their finest spacing tells what aliasing is left, and the bands can be laid out. */
void render_plan_look_at_gloss(const struct render_request *request, struct render_plan *plan);

void render_plan_spend_epsilon(const struct render_request *request, struct render_plan *plan);
void render_plan_space_samples(const struct render_request *request, struct render_plan *plan);
void render_plan_spend_on_gathering(const struct render_request *request, struct render_plan *plan);
void render_plan_settle_spacing(const struct render_request *request, struct render_plan *plan);
void render_plan_predict_error(const struct render_request *request, struct render_plan *plan);

/* plan_search.c: once costs are known; says so when the budget is exceeded, and what by. */
void render_plan_note_budget(const struct render_request *request, struct render_plan *plan);

/* plan_motion.c: before epsilon is spent; and once spacings and the technique are known. */
void render_plan_look_at_motion(const struct render_request *request, struct render_plan *plan);
void render_plan_choose_cells(const struct render_request *request, struct render_plan *plan);

/* plan_grid.c: whether the number of texels is one; then the views get as many as are asked, or as epsilon
 * asks for, which fails for too many; and what error they leave, in one band. */
DIPOLE_CHECKED bool render_plan_check_grid(const struct render_request *request, dipole_status *status);
DIPOLE_CHECKED bool render_plan_choose_grids(const struct render_request *request, struct render_plan *plan,
                                             dipole_status *status);
void render_plan_settle_grid(struct render_plan *plan, size_t medium, double texel_mm);

/* plan_views.c */
DIPOLE_CHECKED bool render_plan_make_views(const struct render_request *request, struct render_plan *plan,
                                           dipole_status *status);

/* plan_shadows.c: once there are views. */
DIPOLE_CHECKED bool render_plan_make_shadows(const struct render_request *request, struct render_plan *plan,
                                             dipole_status *status);

/* The same of translucent shadow maps, once there are any. */
DIPOLE_CHECKED bool render_plan_make_map_shadows(const struct render_request *request,
                                                 struct render_plan *plan, dipole_status *status);

/* plan_tsm.c: the maps of technique tsm, the pattern of each medium, and what is known of the error. Fails
 * also for options that contradict each other, and for volumes of other media. */
DIPOLE_CHECKED bool render_plan_make_maps(const struct render_request *request, struct render_plan *plan,
                                          dipole_status *status);
void render_plan_predict_map_error(const struct render_request *request, struct render_plan *plan);

/* How far apart the samples of a view may be: as asked, or as the coarsest texels allow. */
double render_plan_widest_spacing_mm(const struct render_plan *plan);

#endif
