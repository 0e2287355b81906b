/*
 * Where the time of a fit to a picture goes; and the same least squares as one would do them without
 * derivatives: residuals by drawing the scene, their Jacobian by forward differences, seven pictures for
 * each iteration.
 * usage: bench_fit_time SCENE.json PICTURE.exr START.json [ROUNDS]
 *
 * Both begin at START.json, whose coefficients are not the truth. ROUNDS times (1) by turns. Prints JSON.
 * Calls that are timed are wrapped by the linker (bench/CMakeLists.txt): nothing in fit/ knows of it.
 */
#include "cli/cli.h"
#include "fit/fit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { PARAMETER_COUNT = 2 * FIT_CHANNEL_COUNT };

struct cost {
    double wall_s, cpu_s;
    int count;
};

static double cpu_now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static struct cost cost_start(void)
{
    return (struct cost){ .wall_s = cli_now_s(), .cpu_s = cpu_now_s() };
}

static void cost_add(struct cost *sum, const struct cost *start)
{
    sum->wall_s += cli_now_s() - start->wall_s;
    sum->cpu_s += cpu_now_s() - start->cpu_s;
    sum->count++;
}

/* ---- calls of the library, timed --------------------------------------------------------------------- */

static struct cost preparing, searching, judging, solving;
static int iteration_count;

bool wrapped_prepare(struct fit_picture *picture, const struct fit_progress *progress,
                     struct fit_target *target_out,
                     dipole_status *status) __asm__("__wrap_fit_picture_prepare");
bool real_prepare(struct fit_picture *picture, const struct fit_progress *progress,
                  struct fit_target *target_out,
                  dipole_status *status) __asm__("__real_fit_picture_prepare");
bool wrapped_prepare(struct fit_picture *picture, const struct fit_progress *progress,
                     struct fit_target *target_out, dipole_status *status)
{
    const struct cost start = cost_start();
    const bool is_done = real_prepare(picture, progress, target_out, status);
    cost_add(&preparing, &start);
    return is_done;
}

bool wrapped_search(struct fit_problem *problem, bool is_warm, const volatile sig_atomic_t *stop,
                    struct fit_search_log *log, struct fit_minimum *out,
                    dipole_status *status) __asm__("__wrap_fit_search");
bool real_search(struct fit_problem *problem, bool is_warm, const volatile sig_atomic_t *stop,
                 struct fit_search_log *log, struct fit_minimum *out,
                 dipole_status *status) __asm__("__real_fit_search");
bool wrapped_search(struct fit_problem *problem, bool is_warm, const volatile sig_atomic_t *stop,
                    struct fit_search_log *log, struct fit_minimum *out, dipole_status *status)
{
    const struct cost start = cost_start();
    const bool is_done = real_search(problem, is_warm, stop, log, out, status);
    cost_add(&searching, &start);
    return is_done;
}

bool wrapped_judge(struct fit_problem *problem, const struct fit_minimum *minimum, bool is_quick,
                   const volatile sig_atomic_t *stop, struct fit_estimates *out,
                   dipole_status *status) __asm__("__wrap_fit_judge");
bool real_judge(struct fit_problem *problem, const struct fit_minimum *minimum, bool is_quick,
                const volatile sig_atomic_t *stop, struct fit_estimates *out,
                dipole_status *status) __asm__("__real_fit_judge");
bool wrapped_judge(struct fit_problem *problem, const struct fit_minimum *minimum, bool is_quick,
                   const volatile sig_atomic_t *stop, struct fit_estimates *out, dipole_status *status)
{
    const struct cost start = cost_start();
    const bool is_done = real_judge(problem, minimum, is_quick, stop, out, status);
    cost_add(&judging, &start);
    return is_done;
}

bool wrapped_solve(const struct fit_least_squares *problem, const double *start, struct fit_minimum *out,
                   dipole_status *status) __asm__("__wrap_fit_least_squares_solve");
bool real_solve(const struct fit_least_squares *problem, const double *start, struct fit_minimum *out,
                dipole_status *status) __asm__("__real_fit_least_squares_solve");
bool wrapped_solve(const struct fit_least_squares *problem, const double *start, struct fit_minimum *out,
                   dipole_status *status)
{
    const struct cost begun = cost_start();
    const bool is_done = real_solve(problem, start, out, status);
    cost_add(&solving, &begun);
    iteration_count += out->iteration_count;
    return is_done;
}

/* ---- results ----------------------------------------------------------------------------------------- */

static void print_cost(const char *name, const struct cost *cost)
{
    printf("\"%s\": {\"wall_s\": %.6g, \"cpu_s\": %.6g, \"count\": %d}, ", name, cost->wall_s, cost->cpu_s,
           cost->count);
}

/* sigma_a and sigma_s' of each channel. */
static void print_found(const double *found)
{
    printf("\"found\": [");
    for (int i = 0; i < PARAMETER_COUNT; i++)
        printf("%s%.9g", i > 0 ? ", " : "", found[i]);
    printf("]}");
}

/* ---- as the program does it -------------------------------------------------------------------------- */

static bool fit_as_usual(const char *const *paths, const struct io_material *start, dipole_status *status)
{
    const struct io_scene_options options = { .camera_name = NULL };
    const struct cost begun = cost_start();
    struct io_scene *scene = NULL;
    struct fit_photo photo = { 0 };
    struct fit_picture *picture = NULL;
    struct fit_result result;
    struct fit_form form = { .model = start->model, .channel_count = FIT_CHANNEL_COUNT, .layer_count = 1 };
    struct cost total = { 0 };
    memcpy(form.layers, start->layers, sizeof form.layers);
    preparing = searching = judging = solving = total;
    iteration_count = 0;
    bool is_done = io_scene_read(paths[0], &options, &scene, status) &&
                   fit_photo_read(paths[1], false, 1, &photo, status);
    const struct fit_picture_request request = { .scene = scene, .photo = &photo, .photo_path = paths[1] };
    const struct fit_request fit = { .form = &form, .pictures = &picture, .picture_count = 1 };
    is_done = is_done && fit_picture_create(&request, &picture, status) && fit_run(&fit, &result, status);
    cost_add(&total, &begun);
    if (is_done) {
        double found[PARAMETER_COUNT];
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            found[2 * c] = result.estimates.channels[c].sigma_a_per_mm.value;
            found[2 * c + 1] = result.estimates.channels[c].sigma_s_prime_per_mm.value;
        }
        printf("{\"method\": \"fit\", ");
        print_cost("total", &total);
        print_cost("prepare", &preparing);
        print_cost("search", &searching);
        print_cost("judge", &judging);
        print_cost("solve", &solving);
        printf("\"rounds\": %d, \"iterations\": %d, \"pixels\": %zu, ", result.round_count, iteration_count,
               fit_picture_pixels(picture)->count);
        print_found(found);
        fit_result_destroy(&result);
    }
    fit_picture_destroy(picture);
    fit_photo_destroy(&photo);
    io_scene_destroy(scene);
    return is_done;
}

/* ---- by drawing the scene ---------------------------------------------------------------------------- */

struct drawing {
    struct io_scene *scene;
    const struct io_image *target;
    size_t *pixels; /* pixel_count: wholly covered */
    size_t pixel_count;
    double scale[FIT_CHANNEL_COUNT]; /* a tenth of the mean, as in the fit */
    double *moved;                   /* residuals, a step away */
    int draw_count;
    struct cost creating; /* of draws: getting a renderer for the medium, which other programs could keep */
    dipole_status *status;
};

/* Residuals relative to the picture with a floor, at logarithms of coefficients. */
static bool draw_residuals(struct drawing *drawing, const double *logs, double *residuals)
{
    const struct render_options options = { .technique = RENDER_TECHNIQUE_SPLAT };
    struct renderer *renderer = NULL;
    struct io_image *image = NULL;
    for (size_t i = 0; i < drawing->scene->object_count; i++) {
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            dipole_medium *const medium = &drawing->scene->objects[i].material.layers[c][0].medium;
            medium->sigma_a_per_mm = exp(logs[2 * c]);
            medium->sigma_s_prime_per_mm = exp(logs[2 * c + 1]);
        }
    }
    const struct cost begun = cost_start();
    bool is_done = render_create(drawing->scene, RENDER_CONTEXT_DEFAULT, &renderer, drawing->status);
    cost_add(&drawing->creating, &begun);
    is_done = is_done && render_draw(renderer, &options, &image, NULL, drawing->status);
    render_destroy(renderer);
    if (!is_done)
        return false;
    drawing->draw_count++;
    for (size_t j = 0; j < drawing->pixel_count; j++) {
        const size_t at = 4 * drawing->pixels[j];
        for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++) {
            const double value = (double)drawing->target->pixels[at + c];
            residuals[FIT_CHANNEL_COUNT * j + c] =
                ((double)image->pixels[at + c] - value) / (value + drawing->scale[c]);
        }
    }
    io_image_destroy(image);
    return true;
}

static bool differences(const void *context, const double *logs, double *residuals, double *jacobian)
{
    /* far above the noise of single precision, far below where the model bends */
    static const double step = 0.01;
    struct drawing *const drawing = *(struct drawing *const *)context;
    const size_t count = FIT_CHANNEL_COUNT * drawing->pixel_count;
    if (!draw_residuals(drawing, logs, residuals))
        return false;
    for (int p = 0; jacobian && p < PARAMETER_COUNT; p++) {
        double moved[PARAMETER_COUNT];
        memcpy(moved, logs, sizeof moved);
        moved[p] += step;
        if (!draw_residuals(drawing, moved, drawing->moved))
            return false;
        for (size_t i = 0; i < count; i++)
            jacobian[i * PARAMETER_COUNT + (size_t)p] = (drawing->moved[i] - residuals[i]) / step;
    }
    return true;
}

/* The pixels that a fit could use, and how bright they are. */
static bool choose_pixels(struct drawing *drawing, dipole_status *status)
{
    const struct io_image *const target = drawing->target;
    const size_t count = (size_t)target->width_px * (size_t)target->height_px;
    drawing->pixels = malloc(count * sizeof *drawing->pixels);
    drawing->moved = malloc(FIT_CHANNEL_COUNT * count * sizeof *drawing->moved);
    if (!drawing->pixels || !drawing->moved)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu pixels", count);
    for (size_t i = 0; i < count; i++) {
        if (target->pixels[4 * i + 3] >= 1.0f)
            drawing->pixels[drawing->pixel_count++] = i;
        for (size_t c = 0; c < FIT_CHANNEL_COUNT && target->pixels[4 * i + 3] >= 1.0f; c++)
            drawing->scale[c] += (double)target->pixels[4 * i + c];
    }
    for (size_t c = 0; c < FIT_CHANNEL_COUNT; c++)
        drawing->scale[c] *= 0.1 / (double)drawing->pixel_count;
    return drawing->pixel_count > 0 || dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "nothing is covered");
}

static bool fit_by_differences(const char *const *paths, const struct io_material *start,
                               dipole_status *status)
{
    const struct io_scene_options options = { .camera_name = NULL };
    const struct cost begun = cost_start();
    struct drawing drawing = { .status = status };
    const struct drawing *const context = &drawing;
    struct io_image *target = NULL;
    struct fit_minimum minimum = { 0 };
    struct cost total = { 0 }, solve = { 0 };
    bool is_done =
        io_scene_read(paths[0], &options, &drawing.scene, status) && io_exr_read(paths[1], &target, status);
    drawing.target = target;
    is_done = is_done && choose_pixels(&drawing, status);
    struct fit_least_squares problem = { .residuals = differences,
                                         .context = &context,
                                         .residual_count = FIT_CHANNEL_COUNT * drawing.pixel_count,
                                         .parameter_count = PARAMETER_COUNT };
    double from[PARAMETER_COUNT];
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
        from[2 * c] = log(start->layers[c][0].medium.sigma_a_per_mm);
        from[2 * c + 1] = log(start->layers[c][0].medium.sigma_s_prime_per_mm);
    }
    for (int p = 0; p < PARAMETER_COUNT; p++) {
        problem.lower[p] = from[p] - log(1e3);
        problem.upper[p] = from[p] + log(1e3);
    }
    const struct cost solve_begun = cost_start();
    is_done = is_done && real_solve(&problem, from, &minimum, status);
    cost_add(&solve, &solve_begun);
    cost_add(&total, &begun);
    if (is_done) {
        double found[PARAMETER_COUNT];
        for (int p = 0; p < PARAMETER_COUNT; p++)
            found[p] = exp(minimum.parameters[p]);
        printf("{\"method\": \"differences\", ");
        print_cost("total", &total);
        print_cost("solve", &solve);
        print_cost("create", &drawing.creating);
        printf("\"converged\": %s, \"iterations\": %d, \"draws\": %d, \"pixels\": %zu, ",
               minimum.has_converged ? "true" : "false", minimum.iteration_count, drawing.draw_count,
               drawing.pixel_count);
        print_found(found);
    }
    io_image_destroy(target);
    io_scene_destroy(drawing.scene);
    free(drawing.pixels);
    free(drawing.moved);
    return is_done;
}

int main(int argc, char **argv)
{
    if (argc != 4 && argc != 5) {
        fprintf(stderr, "usage: bench_fit_time SCENE.json PICTURE.exr START.json [ROUNDS]\n");
        return EXIT_USAGE;
    }
    const char *const paths[] = { argv[1], argv[2] };
    const int round_count = argc > 4 ? atoi(argv[4]) : 1;
    struct io_material start;
    dipole_status status;
    bool is_done = io_material_open(argv[3], &start, &status);
    printf("[");
    for (int i = 0; is_done && i < round_count; i++) {
        printf("%s", i > 0 ? ",\n" : "");
        is_done = fit_as_usual(paths, &start, &status);
        printf(",\n");
        is_done = is_done && fit_by_differences(paths, &start, &status);
        fflush(stdout);
    }
    printf("]\n");
    if (is_done)
        return EXIT_DONE;
    fprintf(stderr, "bench_fit_time: %s\n", status.message);
    return EXIT_FAILED;
}
