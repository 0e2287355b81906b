#include "fit/job.h"

#include "fit/job_report.h"
#include "fit/output.h"
#include "fit/profile.h"
#include "fit/totals.h"
#include "io/file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const fit_free_names[] = { "exposure", "white-balance", "ambient", "black-level", NULL };

/* Own pictures are met to 0.1 %, Monte Carlo profiles to 1 %. */
static const double suspicious_misfit = 0.03;

/* Where a search begins of which nothing else says where: a grid of starts covers the rest. */
static const double usual_sigma_a_per_mm = 0.01, usual_sigma_s_prime_per_mm = 1;

static bool is_free(const struct fit_job *job, enum fit_free what)
{
    return job->options->free >> what & 1u;
}

/* ---- the material ------------------------------------------------------------------------------------ */

/*
 * Which model. What the user says; what a picture by render says that it was drawn with; what the scene's
 * material states; else the beam model, unless another one fits clearly better. A few totals cannot decide
 * that: there the modes stand, which are nearest to adding-doubling (docs/models.md).
 */
static dipole_model choose_model(struct fit_job *job, bool is_known_material)
{
    job->is_model_open = false;
    if (job->options->model >= 0)
        return (dipole_model)job->options->model;
    if (job->picture_count > 0 && job->photos[0].has_model)
        return job->photos[0].model;
    if (is_known_material && job->material.is_model_stated)
        return job->material.model;
    if (job->picture_count + job->profile_count == 0)
        return DIPOLE_MODEL_MODES;
    job->is_model_open = true;
    return DIPOLE_MODEL_BEAM;
}

static bool read_start(struct fit_job *job, struct io_material *start, dipole_status *status)
{
    const char *const path = job->options->start_path;
    const dipole_place place = { .source = path };
    if (!io_material_open(path, start, status))
        return false;
    if (start->warning[0])
        cli_note(job->tool, &job->options->common, "%s: %s", path, start->warning);
    return start->layer_count == 1 || job->picture_count == 0 ||
           start->layer_count == job->material.layer_count ||
           dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                       "the start has %zu layers, expected %zu as in the scene, or one", start->layer_count,
                       job->material.layer_count);
}

/* The search begins at these coefficients of the sought layer; what is known stays the scene's. */
static void take_start(struct fit_job *job, const struct io_material *start)
{
    const size_t to = job->form.layer, from = start->layer_count > 1 ? to : 0;
    if (to >= job->material.layer_count)
        return; /* init_form tells */
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        dipole_layer *const layer = &job->material.layers[c][to];
        layer->medium.sigma_a_per_mm = start->layers[c][from].medium.sigma_a_per_mm;
        layer->medium.sigma_s_prime_per_mm = start->layers[c][from].medium.sigma_s_prime_per_mm;
        if (start->layer_count > 1)
            layer->thickness_mm = start->layers[c][from].thickness_mm;
    }
}

/* The material of the scene, with the start of --start; or that of --start; or one of --eta. */
static bool read_material(struct fit_job *job, dipole_status *status)
{
    const struct fit_job_options *const options = job->options;
    const dipole_medium usual = { .sigma_a_per_mm = usual_sigma_a_per_mm,
                                  .sigma_s_prime_per_mm = usual_sigma_s_prime_per_mm,
                                  .eta = options->eta };
    if (job->picture_count > 0)
        job->material = job->scenes[0]->objects[0].material;
    else if (!options->start_path)
        io_material_set_media(&job->material,
                              (const dipole_medium[IO_CHANNEL_COUNT]){ usual, usual, usual });
    if (options->start_path) {
        struct io_material start;
        if (!read_start(job, &start, status))
            return false;
        if (job->picture_count > 0)
            take_start(job, &start);
        else
            job->material = start;
    }
    for (int c = 0; c < IO_CHANNEL_COUNT && options->eta > 0; c++)
        job->material.layers[c][0].medium.eta = options->eta;
    return true;
}

static bool init_form(struct fit_job *job, dipole_status *status)
{
    struct fit_form *const form = &job->form;
    form->layer_count = job->material.layer_count;
    if (form->layer >= form->layer_count)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "--layer is %zu, expected 1 to %zu",
                           form->layer + 1, form->layer_count);
    form->model = choose_model(job, job->picture_count > 0 || job->options->start_path);
    memcpy(form->layers, job->material.layers, sizeof form->layers);
    /* the thickness of a slab that is measured by itself is measured with a calliper */
    form->is_thickness_sought = !job->options->is_thickness_known && form->layer_count > 1 &&
                                isfinite(form->layers[0][form->layer].thickness_mm);
    job->material.model = form->model;
    return true;
}

/* ---- targets ----------------------------------------------------------------------------------------- */

static bool check_scene(const struct fit_job *job, const struct io_scene *scene, dipole_status *status)
{
    const dipole_place place = { .source = scene->path };
    if (scene->object_count == 0)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "the scene has no object to fit");
    if (scene->has_environment)
        return dipole_fail(
            status, DIPOLE_NOT_SUPPORTED, &place,
            "the scene has an environment, which cannot be fitted to, expected lights alone");
    const double eta = job->scenes[0]->objects[0].material.layers[0][0].medium.eta;
    const double found = scene->objects[0].material.layers[0][0].medium.eta;
    return found == eta || dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                                       "the material's eta is %g, expected %g as in %s: it is one material",
                                       found, eta, job->scenes[0]->path);
}

static bool read_picture(struct fit_job *job, size_t i, dipole_status *status)
{
    const struct fit_job_options *const options = job->options;
    const char *const camera = options->camera_names.count == 0   ? NULL
                               : options->camera_names.count == 1 ? options->camera_names.values[0]
                                                                  : options->camera_names.values[i];
    const struct io_scene_options scene_options = { .allowed_paths = options->allowed_paths.values,
                                                    .allowed_path_count = options->allowed_paths.count,
                                                    .camera_name = camera };
    if (!io_scene_read(options->scene_paths.values[i], &scene_options, &job->scenes[i], status) ||
        !check_scene(job, job->scenes[i], status))
        return false;
    const int width_px = job->scenes[i]->camera.width_px, height_px = job->scenes[i]->camera.height_px;
    if (!fit_photo_read(options->photo_paths.values[i], options->is_linear,
                        exp2(job->scenes[i]->exposure_ev), &job->photos[i], status) ||
        !fit_photo_reduce(&job->photos[i], width_px, height_px, status))
        return false;
    return i >= options->mask_paths.count ||
           (io_photo_read(options->mask_paths.values[i], IO_PHOTO_LINEAR, NULL, &job->masks[i], status) &&
            fit_mask_reduce(&job->masks[i], width_px, height_px, status));
}

/* A light whose brightness is not stated leaves the exposure open. */
static bool has_unstated_light(const struct io_scene *scene)
{
    for (size_t i = 0; i < scene->light_count; i++) {
        if (!scene->lights[i].is_stated)
            return true;
    }
    return false;
}

static bool create_picture(struct fit_job *job, size_t i, dipole_status *status)
{
    const bool is_unstated = has_unstated_light(job->scenes[i]);
    if (is_unstated && !is_free(job, FIT_FREE_EXPOSURE))
        cli_note(job->tool, &job->options->common,
                 "%s: a light's brightness is not stated, so the exposure is fitted, too",
                 job->options->scene_paths.values[i]);
    const struct fit_picture_request request = {
        .scene = job->scenes[i],
        .photo = &job->photos[i],
        .photo_path = job->options->photo_paths.values[i],
        .mask = job->masks[i],
        .is_gain_free = is_unstated || is_free(job, FIT_FREE_EXPOSURE),
        .is_ambient_free = is_free(job, FIT_FREE_AMBIENT),
        .is_black_free = is_free(job, FIT_FREE_BLACK_LEVEL),
        /* so that memory does not grow with the number of pictures beyond a few */
        .pixel_limit = FIT_PIXEL_LIMIT / (1 + job->picture_count / 4),
    };
    return fit_picture_create(&request, &job->pictures[i], status);
}

/* Of the light that arrives a part is mirrored at the surface and does not enter. */
static void make_per_entered(const struct fit_job *job, struct io_profile *profile)
{
    const double entered = 1 - dipole_fresnel_reflectance(job->material.layers[0][0].medium.eta, 1);
    for (size_t i = 0; i < profile->count; i++) {
        profile->rd_per_mm2[i] /= entered;
        if (profile->sem_per_mm2)
            profile->sem_per_mm2[i] /= entered;
    }
}

static bool read_profile(struct fit_job *job, size_t i, dipole_status *status)
{
    const char *const path = job->options->profile_paths.values[i];
    const char *const slash = strrchr(path, '/');
    const int channel = job->form.channel_count == 1 ? 0 : (int)(i % FIT_CHANNEL_COUNT);
    struct fit_target *const target = &job->others[job->other_count];
    if (!io_profile_read(path, &job->profiles[i], status))
        return false;
    if (job->profiles[i]->is_per_incident)
        make_per_entered(job, job->profiles[i]);
    if (!fit_profile_target(job->profiles[i], slash ? slash + 1 : path, channel,
                            job->is_model_open ? DIPOLE_MODEL_MODES : job->form.model, target,
                            &job->other_memory[job->other_count], status))
        return false;
    target->is_gain_free = is_free(job, FIT_FREE_EXPOSURE);
    job->other_count++;
    return true;
}

static bool read_totals(struct fit_job *job, size_t i, dipole_status *status)
{
    const char *const path = job->options->totals_paths.values[i];
    const char *const slash = strrchr(path, '/');
    const dipole_place place = { .source = path };
    if (job->material.layer_count > 1)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, &place,
                           "totals are of one layer, expected no others in the material");
    if (!fit_totals_target(job->totals[i], slash ? slash + 1 : path, job->form.channel_count,
                           job->form.model, &job->others[job->other_count],
                           &job->other_memory[job->other_count], status))
        return false;
    job->other_count++;
    return true;
}

/* Pictures have three channels; a profile or a slab has one, unless it comes in three or names them. */
static int count_channels(const struct fit_job *job)
{
    bool is_coloured =
        job->picture_count > 0 || (job->profile_count > 0 && job->profile_count % FIT_CHANNEL_COUNT == 0);
    for (size_t i = 0; i < job->options->totals_paths.count; i++) {
        for (size_t k = 0; k < job->totals[i]->count; k++)
            is_coloured = is_coloured || job->totals[i]->totals[k].channel >= 0;
    }
    return is_coloured ? FIT_CHANNEL_COUNT : 1;
}

bool fit_job_read(const struct cli_tool *tool, const struct fit_job_options *options, struct fit_job *job,
                  dipole_status *status)
{
    *job = (struct fit_job){ .tool = tool, .options = options };
    job->picture_count = options->photo_paths.count;
    job->profile_count = options->profile_paths.count;
    job->form.layer = options->layer > 0 ? (size_t)options->layer - 1 : 0;
    bool done = io_file_check_writable(options->material_path, status);
    for (size_t i = 0; done && i < options->totals_paths.count; i++)
        done = io_totals_read(options->totals_paths.values[i], &job->totals[i], status);
    if (!done)
        return false;
    job->form.channel_count = count_channels(job);
    for (size_t i = 0; done && i < job->picture_count; i++)
        done = read_picture(job, i, status);
    done = done && read_material(job, status) && init_form(job, status);
    for (size_t i = 0; done && i < job->picture_count; i++)
        done = create_picture(job, i, status);
    for (size_t i = 0; done && i < job->profile_count; i++)
        done = read_profile(job, i, status);
    for (size_t i = 0; done && i < options->totals_paths.count; i++)
        done = read_totals(job, i, status);
    return done && (!options->report_path || fit_job_report_check(options->report_path, status));
}

void fit_job_destroy(struct fit_job *job)
{
    if (job->has_result)
        fit_result_destroy(&job->result);
    for (size_t i = 0; i < FIT_TARGET_LIMIT; i++) {
        fit_picture_destroy(job->pictures[i]);
        fit_photo_destroy(&job->photos[i]);
        io_image_destroy(job->masks[i]);
        io_scene_destroy(job->scenes[i]);
        io_profile_destroy(job->profiles[i]);
        io_totals_destroy(job->totals[i]);
        free(job->other_memory[i]);
    }
}

/* ---- the fit ----------------------------------------------------------------------------------------- */

static void show_progress(void *context, const char *what, double fraction)
{
    cli_progress_show(context, what, fraction);
}

static void note_models(const struct fit_job *job)
{
    char text[128] = "";
    size_t length = 0;
    for (size_t i = 0; i < job->result.trial_count && length < sizeof text; i++)
        length += (size_t)snprintf(text + length, sizeof text - length, "%s %.2g %% of %s",
                                   i == 0 ? "" : ",", 100 * job->result.trials[i].rms_residual,
                                   io_model_names[job->result.trials[i].model]);
    if (job->result.trial_count > 1)
        cli_note(job->tool, &job->options->common,
                 "no model was asked for; rms residuals are%s: %s is taken", text,
                 io_model_names[job->form.model]);
}

bool fit_job_run(struct fit_job *job, const volatile sig_atomic_t *stop, dipole_status *status)
{
    struct cli_progress progress;
    const double start_s = cli_now_s();
    cli_progress_start(&progress, job->tool, &job->options->common);
    static const dipole_model half_space_models[] = { DIPOLE_MODEL_MODES, DIPOLE_MODEL_DIPOLE };
    const struct fit_request request = {
        .form = &job->form,
        .models = half_space_models,
        /* of these the dipole knows no layers */
        .model_count = !job->is_model_open                      ? 0
                       : io_material_has_layers(&job->material) ? 1
                                                                : 2,
        .pictures = job->pictures,
        .picture_count = job->picture_count,
        .others = job->others,
        .other_count = job->other_count,
        .is_balance_free = is_free(job, FIT_FREE_WHITE_BALANCE),
        .progress = { .show = show_progress, .context = &progress },
        .stop = stop,
    };
    job->has_result = fit_run(&request, &job->result, status);
    cli_progress_show(&progress, "done", 1);
    job->seconds = cli_now_s() - start_s;
    if (!job->has_result)
        return false;
    for (size_t i = 0; i < job->picture_count; i++)
        fit_picture_mark_outliers(job->pictures[i], &job->result.targets[i]);
    job->form.model = job->material.model = job->result.problem.form.model;
    note_models(job);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const int from = c < job->form.channel_count ? c : 0;
        const struct fit_channel_estimate *const found = &job->result.estimates.channels[from];
        dipole_layer *const layer = &job->material.layers[c][job->form.layer];
        layer->medium.sigma_a_per_mm = found->sigma_a_per_mm.value;
        layer->medium.sigma_s_prime_per_mm = found->sigma_s_prime_per_mm.value;
        if (job->form.is_thickness_sought)
            layer->thickness_mm = found->thickness_mm.value;
    }
    if (job->result.estimates.misfit > suspicious_misfit)
        cli_note(job->tool, &job->options->common,
                 "the model misses the target by %.2g %% that is not noise: a tone curve, another shape or "
                 "light, "
                 "or a medium that it does not describe",
                 100 * job->result.estimates.misfit);
    for (size_t i = 0; i < job->result.note_count; i++)
        cli_note(job->tool, &job->options->common, "%s", job->result.notes[i]);
    return true;
}

bool fit_job_write(struct fit_job *job, dipole_status *status)
{
    const struct fit_job_options *const options = job->options;
    char name[sizeof job->material.name + 16];
    snprintf(name, sizeof name, "%s, fitted", job->material.name[0] ? job->material.name : "profile");
    snprintf(job->material.name, sizeof job->material.name, "%.*s", (int)sizeof job->material.name - 1,
             name);
    snprintf(job->material.source, sizeof job->material.source,
             "recovered from measurements by fit, libdipole %s", dipole_version());
    json_t *const block = fit_output_block(job);
    bool done = block ? io_material_write(options->material_path, &job->material, block, status)
                      : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the result");
    done = done && (!options->report_path || fit_job_report(job, status));
    if (done && options->common.json)
        done = fit_output_print_json(block, status);
    else if (done)
        fit_output_print_table(job);
    json_decref(block);
    return done && cli_stdout_finish(status);
}
