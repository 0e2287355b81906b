/* Inside the library: what render.c and view.c share. */
#ifndef RENDERER_RENDERER_H
#define RENDERER_RENDERER_H

#include "renderer/calibration.h"
#include "renderer/context.h"
#include "renderer/execute.h"
#include "renderer/tables.h"
#include "renderer/volumes.h"

struct renderer {
    const struct io_scene *scene;
    struct render_context *context;
    struct render_gl_errors errors;
    struct render_executor *executor;
    struct render_machine machine;
    bool has_gpu; /* OpenGL is not software */
    struct render_calibration calibration;
    bool is_calibrated; /* else costs are those of another machine */
    bool is_warm;       /* a picture was drawn */
    struct render_media *media;
    struct render_environment *environment; /* NULL: the scene has none */
    struct render_tables *tables;   /* baked when a plan first needed them, to the finest asked so far */
    struct render_volumes *volumes; /* the same                                                 */
};

/* What the options ask of this renderer. */
struct render_request render_request_for(const struct renderer *renderer,
                                         const struct render_options *options);

DIPOLE_CHECKED bool render_make_current(struct renderer *renderer, dipole_status *status);

/* Plan and draw; the textures stay with the executor, *plan_out is the caller's to destroy. */
DIPOLE_CHECKED bool render_run(struct renderer *renderer, const struct render_request *request,
                               struct render_plan **plan_out, double time_ms[RENDER_EFFECT_LIMIT],
                               dipole_status *status);

/* Everything but total_ms. */
void render_fill_report(const struct renderer *renderer, const struct render_plan *plan,
                        const double time_ms[RENDER_EFFECT_LIMIT], struct render_report *report);

#endif
