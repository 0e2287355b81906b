/* How much the shadow at fixed points of a surface flickers while a light, a blocker or the camera moves:
 * the change of its error from a frame to the next. Each point is looked up in the pixel that shows it, and
 * held against rays to where that pixel's surface is. */
#include "bench/shadows.h"

#include "lutgen/parallel.h"
#include "renderer/projection.h"
#include "renderer/reference_trace.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH_PX = 400, HEIGHT_PX = 300, POINTS = 300, FRAMES = 60, WAYS = 3, PLACES = 512 };

/* enum render_shadow_turn */
static const char *const names[WAYS] = { "screen", "surface", "none" };

struct flicker_bench {
    struct bench_shadows shadows;
    double point_mm[POINTS][3];
    int point_count;
    int pixel[POINTS]; /* of this frame; -1: none shows the point */
    double *expected_now;
    double error[FRAMES][POINTS], expected[FRAMES][POINTS]; /* NAN: not seen */
};

/* Spread over the pixels of frame 0 that the light may reach. */
static void choose_points(struct flicker_bench *bench)
{
    const struct bench_shadows *const shadows = &bench->shadows;
    const int pixels = WIDTH_PX * HEIGHT_PX;
    const double golden = 0.61803398874989484820;
    for (int i = 0; i < pixels && bench->point_count < POINTS; i++) {
        const int pixel = (int)(fmod(i * golden, 1) * pixels);
        double left[3];
        if (!(bench_shadows_cosine(shadows, pixel) > 0))
            continue;
        bench_shadows_trace(shadows, pixel, 64, left);
        if (left[0] < 0.02 || left[0] > 0.98) /* in penumbras alone */
            continue;
        for (int k = 0; k < 3; k++)
            bench->point_mm[bench->point_count][k] = (double)shadows->position_mm[4 * pixel + k];
        bench->point_count++;
    }
}

/* The pixel that shows a point, by the frame's camera; -1: none. */
static int pixel_of(const struct bench_shadows *bench, const struct render_projection *camera,
                    const double point_mm[3])
{
    double in_view[3];
    render_projection_to_view(camera, point_mm, in_view);
    const int x = (int)floor((in_view[0] / in_view[2] / camera->half_width / 2 + 0.5) * WIDTH_PX);
    const int y = (int)floor((-in_view[1] / in_view[2] / camera->half_height / 2 + 0.5) * HEIGHT_PX);
    if (x < 0 || y < 0 || x >= WIDTH_PX || y >= HEIGHT_PX)
        return -1;
    const float *const found_mm = bench->position_mm + 4 * (y * WIDTH_PX + x);
    const double pixel_mm = 2 * camera->half_width / WIDTH_PX * in_view[2];
    double away2 = 0;
    for (int k = 0; k < 3; k++)
        away2 += pow((double)found_mm[k] - point_mm[k], 2);
    return found_mm[3] > 0 && away2 < 9 * pixel_mm * pixel_mm ? y * WIDTH_PX + x : -1;
}

static void find_pixels(struct flicker_bench *bench)
{
    const struct render_ball ball = render_ball_of_scene(bench->shadows.scene);
    struct render_projection camera;
    render_projection_of_camera(&bench->shadows.scene->camera, &ball, &camera);
    for (int i = 0; i < bench->point_count; i++)
        bench->pixel[i] = pixel_of(&bench->shadows, &camera, bench->point_mm[i]);
}

static void trace_point(void *context, int index)
{
    struct flicker_bench *const bench = context;
    double left[3];
    if (bench->pixel[index] < 0)
        return;
    bench_shadows_trace(&bench->shadows, bench->pixel[index], PLACES, left);
    bench->expected_now[index] = left[0];
}

/* Rays say what is right the first time a frame is drawn: what is drawn where does not depend on the taps.
 */
static bool trace_frame(struct flicker_bench *bench, int frame, dipole_status *status)
{
    const bool done = bench_shadows_begin_rays(&bench->shadows, status);
    if (done) {
        if (frame == 0)
            choose_points(bench);
        find_pixels(bench);
        bench->expected_now = bench->expected[frame];
        lut_parallel_for(bench->point_count, 0, trace_point, bench);
    }
    bench_shadows_end_rays(&bench->shadows);
    return done;
}

static bool run_frame(struct flicker_bench *bench, int frame, enum render_shadow_turn turn,
                      dipole_status *status)
{
    struct bench_shadows *const shadows = &bench->shadows;
    io_scene_set_frame(shadows->scene, frame);
    if (!bench_shadows_draw(shadows, &(struct render_shadow_options){ .turn = turn }, 1, NULL, status) ||
        (turn == RENDER_SHADOW_TURN_SCREEN && !trace_frame(bench, frame, status)))
        return false;
    find_pixels(bench);
    for (int i = 0; i < bench->point_count; i++)
        bench->error[frame][i] =
            bench->pixel[i] < 0 ? NAN
                                : (double)shadows->shadow[4 * bench->pixel[i]] - bench->expected[frame][i];
    return true;
}

/* Of each frame the change to the next that rays do not make, the mean over the points, in % of the mean
 * factor; the mean of all. Also of rays alone, and of the error. */
struct found {
    double by_frame[FRAMES - 1], flicker, true_change, error;
};

static struct found sum_up(const struct flicker_bench *bench)
{
    struct found found = { .flicker = 0 };
    double mean = 0, count = 0;
    for (int f = 0; f + 1 < FRAMES; f++) {
        double changes = 0, here = 0;
        for (int i = 0; i < bench->point_count; i++) {
            const double change = bench->error[f + 1][i] - bench->error[f][i];
            if (isnan(change))
                continue;
            changes += fabs(change);
            here++;
            found.true_change += fabs(bench->expected[f + 1][i] - bench->expected[f][i]);
            found.error += fabs(bench->error[f][i]);
            mean += bench->expected[f][i];
        }
        found.by_frame[f] = changes / fmax(here, 1);
        found.flicker += changes;
        count += here;
    }
    const double per_cent = 100 / mean;
    found.flicker *= per_cent;
    found.true_change *= per_cent;
    found.error *= per_cent;
    for (int f = 0; f + 1 < FRAMES; f++)
        found.by_frame[f] *= per_cent * count;
    return found;
}

static bool plot(const struct found found[WAYS], const char *stem, const char *title, dipole_status *status)
{
    struct plot_series series[WAYS];
    double x[FRAMES - 1];
    for (int f = 0; f + 1 < FRAMES; f++)
        x[f] = f;
    for (int w = 0; w < WAYS; w++)
        series[w] =
            (struct plot_series){ .label = names[w], .count = FRAMES - 1, .x = x, .y = found[w].by_frame };
    const struct plot chart = { .width_px = 720,
                                .height_px = 360,
                                .title = title,
                                .x = { .title = "frame" },
                                .y = { .title = "flicker in % of the mean factor" },
                                .series = series,
                                .series_count = WAYS };
    return bench_write_plot(&chart, stem, "flicker", status);
}

bool bench_shadows_flicker(const char *path, const char *title, const char *stem, dipole_status *status)
{
    struct found found[WAYS] = { { .flicker = 0 } };
    struct flicker_bench *const bench = calloc(1, sizeof *bench);
    if (!bench)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory");
    bool done = bench_shadows_begin(path, WIDTH_PX, HEIGHT_PX, &bench->shadows, status);
    for (int w = 0; done && w < WAYS; w++) {
        for (int f = 0; done && f < FRAMES; f++)
            done = run_frame(bench, f, (enum render_shadow_turn)w, status);
        if (!done)
            break;
        found[w] = sum_up(bench);
        printf("| %s | %s | %.3f | %.3f | %.2f |\n", title, names[w], found[w].flicker,
               found[w].true_change, found[w].error);
        fflush(stdout);
    }
    done = done && plot(found, stem, title, status);
    bench_shadows_end(&bench->shadows);
    free(bench);
    return done;
}
