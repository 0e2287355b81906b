/* Each picture beside the same scene drawn with what was found. */
#include "fit/job_report_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double drawn_epsilon = 0.01;

/* The scene with the material that was found: its own, but for the objects. */
static bool draw_scene(const struct fit_job *job, size_t i, struct io_image **image_out,
                       dipole_status *status)
{
    const struct render_options options = { .technique = RENDER_TECHNIQUE_AUTO, .epsilon = drawn_epsilon };
    struct io_scene scene = *job->scenes[i];
    struct renderer *renderer = NULL;
    *image_out = NULL;
    scene.objects = malloc(scene.object_count * sizeof *scene.objects);
    if (!scene.objects)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the objects");
    memcpy(scene.objects, job->scenes[i]->objects, scene.object_count * sizeof *scene.objects);
    for (size_t k = 0; k < scene.object_count; k++)
        scene.objects[k].material = job->material;
    const bool done = render_create(&scene, RENDER_CONTEXT_DEFAULT, &renderer, status) &&
                      render_draw(renderer, &options, image_out, NULL, status);
    render_destroy(renderer);
    free(scene.objects);
    return done;
}

/* From radiance of the scene to what the target shows. */
static void scale_to_target(const struct fit_job *job, size_t i, struct io_image *image)
{
    const struct render_capture *const capture = fit_picture_capture(job->pictures[i]);
    const size_t count = (size_t)image->width_px * (size_t)image->height_px;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        struct fit_state state;
        fit_problem_state(&job->result.problem, i, c, job->result.minimum.parameters, &state);
        for (size_t p = 0; p < count; p++) {
            float *const pixel = image->pixels + p * (size_t)image->channel_count;
            const double coverage = image->channel_count > 3 ? (double)pixel[3] : 1;
            const double around = state.ambient * (double)capture->exit_per_sr[p] + state.black;
            pixel[c] = (float)(state.gain * (double)pixel[c] + coverage * around);
        }
    }
}

/* Coefficients that nothing can be drawn with, as a fit may find, are no reason to keep the rest back. */
static bool draw_nothing(struct job_page *page, size_t i, const dipole_status *reason,
                         dipole_status *status)
{
    const struct io_image *const image = page->job->photos[i].image;
    job_text_add(job_page_note(page), JOB_NOTE_SIZE,
                 "%s: the scene could not be drawn with what was found: %s.", page->target_names[i],
                 reason->message);
    if (!io_image_create(image->width_px, image->height_px, 3, &page->models[i], status))
        return false;
    for (size_t p = 0; p < 3 * (size_t)image->width_px * (size_t)image->height_px; p++)
        page->models[i]->pixels[p] = NAN;
    return true;
}

bool job_page_add_pictures(struct job_page *page, dipole_status *status)
{
    const struct fit_job *const job = page->job;
    for (size_t i = 0; i < job->picture_count; i++) {
        dipole_status reason = { 0 };
        if (draw_scene(job, i, &page->models[i], &reason))
            scale_to_target(job, i, page->models[i]);
        else if (!draw_nothing(page, i, &reason, status))
            return false;
        page->pictures[i] =
            (struct fit_report_picture){ .name = page->target_names[i],
                                         .image = job->photos[i].image,
                                         .model = page->models[i],
                                         .uses = fit_picture_pixels(job->pictures[i])->uses };
    }
    page->report.picture_count = job->picture_count;
    return true;
}
