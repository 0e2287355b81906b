/*
 * How much the light that leaves fixed points of a moving surface flickers because of how it is sampled:
 * the change from frame to frame of radiosity at points that move with the surface, less the change of the
 * converged sum, which is what they should do. Sums are over the light samples that would be drawn: of
 * splats in double, of gathering by its own loops, at each point. No picture is looked at, so what
 * gathering interpolates between pixels is not in it.
 *
 * usage: bench_flicker SCENE.json FRAMES PLOT TITLE {splat|gather EPSILON}...
 *
 * The converged sum is of splats. A row of Markdown for each technique, epsilon and way to sample: flicker
 * in % of the mean radiosity, of all points and of the one that flickers most; the change of the sum and of
 * the converged one; what the radiosity is off by, all in the same %; samples; ms for a frame's light views
 * and samples. PLOT_TECHNIQUE_EPSILON.svg shows flicker by frame.
 */
#include "io/file.h"
#include "lutgen/parallel.h"
#include "plot/plot.h"
#include "renderer/gather.h"
#include "renderer/plan.h"
#include "renderer/renderer.h"
#include "renderer/splat_draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 240, WAYS = 3, WARM_UP = 1, FRAMES = 360 };

/* Sides of what is drawn: nothing is looked at. */
enum { WIDTH_PX = 64, HEIGHT_PX = 48 };

#define REFERENCE_EPSILON 0.0005

struct series {
    int frame_count;
    double (*radiosity)[POINTS]; /* of each frame: of red, green and blue the mean */
    double sample_count, ms;
};

struct bench {
    struct io_scene *scene;
    struct renderer *renderer;
    int frame_count;
};

/* Vertices spread over the first object. */
static void point_at(const struct io_scene *scene, int index, double position_mm[3])
{
    const struct io_mesh *const mesh = scene->objects[0].mesh;
    const size_t vertex = (size_t)((double)index / POINTS * (double)mesh->vertex_count);
    for (size_t k = 0; k < 3; k++)
        position_mm[k] = (double)mesh->positions[3 * vertex + k];
}

/* What splats sum at all points: the tables of their bands (common/profile.glsl), grey, in double. */
struct splat_sums {
    const struct bench *bench;
    const struct render_plan_medium *planned;
    size_t medium;
    struct lut_axis axis;
    float *rgb; /* nodes of all bands */
    double inverse_scale2, nodes_per_log2;
    double *radiosity;
};

static double sum_band(const struct splat_sums *sums, int band, const double position_mm[3])
{
    const struct render_light_samples *const samples =
        render_splatter_band(render_executor_splatter(sums->bench->renderer->executor), sums->medium, band);
    const float(*const nodes)[4] =
        (const float(*)[4])(sums->rgb) + (size_t)band * (size_t)sums->axis.node_count;
    const double reach_mm = sums->planned->bands[band].r_outer_mm;
    double sum = 0;
    for (size_t i = 0; i < samples->count; i++) {
        const struct render_light_sample *const s = &samples->samples[i];
        double distance2 = 0;
        for (int k = 0; k < 3; k++) {
            const double step = position_mm[k] - (double)s->position_mm[k];
            distance2 += step * step;
        }
        if (distance2 >= reach_mm * reach_mm || s->object != 0)
            continue;
        const double place = fmin(log2(1 + distance2 * sums->inverse_scale2) * sums->nodes_per_log2,
                                  sums->axis.node_count - 1.001);
        const int node = (int)place;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            sum += ((double)nodes[node][c] +
                    (place - node) * ((double)nodes[node + 1][c] - (double)nodes[node][c])) *
                   (double)s->flux_w[c] / IO_CHANNEL_COUNT;
    }
    return sum;
}

static void sum_splats_at(void *context, int index)
{
    const struct splat_sums *const sums = context;
    double position_mm[3], sum = 0;
    point_at(sums->bench->scene, index, position_mm);
    for (int b = 0; b < sums->planned->band_count; b++)
        sum += sum_band(sums, b, position_mm);
    sums->radiosity[index] = sum;
}

static bool sum_splats(const struct bench *bench, const struct render_plan *plan,
                       const struct render_band_source *source, size_t medium, double radiosity[POINTS],
                       dipole_status *status)
{
    struct splat_sums sums = { .bench = bench,
                               .planned = &plan->of_medium[medium],
                               .medium = medium,
                               .axis = render_bands_axis(source) };
    const double end = sums.axis.r_max_mm / sums.axis.scale_mm;
    sums.inverse_scale2 = 1 / (sums.axis.scale_mm * sums.axis.scale_mm);
    sums.nodes_per_log2 = (sums.axis.node_count - 1) / log2(1 + end * end);
    sums.rgb =
        calloc((size_t)sums.planned->band_count * (size_t)sums.axis.node_count, 4 * sizeof *sums.rgb);
    sums.radiosity = radiosity;
    const bool done = sums.rgb ? render_bands_bake(source, sums.planned->bands, sums.planned->band_count,
                                                   sums.rgb, status)
                               : dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for profiles");
    if (done)
        lut_parallel_for(POINTS, 0, sum_splats_at, &sums);
    free(sums.rgb);
    return done;
}

/* The points as a picture of one row; so far apart that nothing is interpolated between them. */
#define FAR_APART_MM 1e6

static bool sum_gathered(const struct bench *bench, const struct render_plan *plan,
                         const struct render_band_source *source, size_t medium, double radiosity[POINTS],
                         dipole_status *status)
{
    const struct render_plan_medium *const planned = &plan->of_medium[medium];
    const struct render_light_samples *const samples =
        render_splatter_samples(render_executor_splatter(bench->renderer->executor), medium);
    static struct render_gather_medium kernels;
    static float position_mm[POINTS][4], rgb[POINTS][4];
    struct render_gather_sources sources = { .band_count = 0 };
    const struct render_gather_object object = { .medium = &kernels,
                                                 .sources = &sources,
                                                 .pixel_mm = FAR_APART_MM };
    const struct render_gather_request request = { .width_px = POINTS,
                                                   .height_px = 1,
                                                   .position_mm = position_mm[0],
                                                   .objects = &object,
                                                   .object_count = 1,
                                                   .epsilon = RENDER_EPSILON_MIN };
    for (int i = 0; i < POINTS; i++) {
        double point_mm[3];
        point_at(bench->scene, i, point_mm);
        for (int k = 0; k < 3; k++)
            position_mm[i][k] = (float)point_mm[k];
        position_mm[i][3] = 1;
    }
    const bool done =
        render_gather_medium_init(source, planned->bands, planned->band_count, &kernels, status) &&
        render_gather_sources_init(samples->samples,
                                   plan->coherence == RENDER_COHERENCE_SURFACE ? samples->codes : NULL,
                                   render_plan_code_level(plan, 0), samples->count, planned->bands,
                                   planned->band_count, planned->spread_mm, &sources, status) &&
        render_gather_run(&request, rgb[0], NULL, status);
    render_gather_sources_end(&sources);
    for (int i = 0; done && i < POINTS; i++)
        radiosity[i] = ((double)rgb[i][0] + (double)rgb[i][1] + (double)rgb[i][2]) / IO_CHANNEL_COUNT;
    return done;
}

/* Radiosity at every point of the frame that was drawn last. */
static bool sum_points(const struct bench *bench, const struct render_plan *plan, double radiosity[POINTS],
                       dipole_status *status)
{
    const size_t medium = plan->objects[0].medium;
    const struct render_band_key key =
        render_plan_band_key(plan, &bench->renderer->tables->of_medium[medium], medium);
    return (plan->technique == RENDER_TECHNIQUE_GATHER ? sum_gathered : sum_splats)(
        bench, plan, &key.source, medium, radiosity, status);
}

static bool run(struct bench *bench, enum render_technique technique, enum render_coherence coherence,
                double epsilon, struct series *series, dipole_status *status)
{
    *series = (struct series){ .frame_count = bench->frame_count };
    series->radiosity = calloc((size_t)bench->frame_count, sizeof *series->radiosity);
    if (!series->radiosity)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory");
    bool done = true;
    for (int step = -WARM_UP; done && step < bench->frame_count; step++) {
        const int frame = step < 0 ? 0 : step;
        const struct render_request request = { .scene = bench->scene,
                                                .media = bench->renderer->media,
                                                .technique = technique,
                                                .coherence = coherence,
                                                .epsilon = epsilon };
        struct render_plan *plan = NULL;
        double time_ms[RENDER_EFFECT_LIMIT];
        io_scene_set_frame(bench->scene, frame);
        done = render_run(bench->renderer, &request, &plan, time_ms, status);
        if (done && step >= 0) {
            done = sum_points(bench, plan, series->radiosity[frame], status);
            series->sample_count +=
                (double)render_splatter_sample_count(render_executor_splatter(bench->renderer->executor)) /
                bench->frame_count;
            for (size_t e = 0; e < plan->effect_count; e++) {
                if (strcmp(render_effects[e]->name, "light_view") == 0 ||
                    strcmp(render_effects[e]->name, "light_picture") == 0 ||
                    strcmp(render_effects[e]->name, "light_samples") == 0)
                    series->ms += time_ms[e] / bench->frame_count;
            }
        }
        render_plan_destroy(plan);
    }
    return done;
}

/* Mean and largest over the points of the change from frame to frame that the reference does not make, the
 * mean change of both, and how far they are apart; in % of the mean radiosity. */
struct flicker {
    double mean, largest, changes, true_changes, error;
};

static struct flicker compare(const struct series *series, const struct series *reference)
{
    const int count = series->frame_count;
    struct flicker found = { .mean = 0 };
    double mean = 0;
    for (int f = 0; f < count; f++) {
        for (int i = 0; i < POINTS; i++)
            mean += reference->radiosity[f][i] / POINTS / count;
    }
    const double per_cent = 100 / mean / POINTS / count;
    for (int i = 0; i < POINTS; i++) {
        double sum = 0;
        for (int f = 0; f < count; f++) {
            const int next = (f + 1) % count; /* loops close */
            const double change = series->radiosity[next][i] - series->radiosity[f][i];
            const double true_change = reference->radiosity[next][i] - reference->radiosity[f][i];
            sum += fabs(change - true_change);
            found.changes += per_cent * fabs(change);
            found.true_changes += per_cent * fabs(true_change);
            found.error += per_cent * fabs(series->radiosity[f][i] - reference->radiosity[f][i]);
        }
        found.mean += per_cent * sum;
        found.largest = fmax(found.largest, sum * per_cent * POINTS);
    }
    return found;
}

/* Of each frame the change to the next one that the reference does not make, the mean over the points, in
 * %. */
static bool write_plot(const char *path, const char *title, const struct series *ways,
                       const struct series *reference, dipole_status *status)
{
    static const char *const names[WAYS] = { "none", "two-pass", "surface" };
    const int count = reference->frame_count;
    struct plot_series curves[WAYS];
    double x[FRAMES], y[WAYS][FRAMES], mean = 0;
    char *svg = NULL;
    size_t size = 0;
    for (int f = 0; f < count; f++) {
        for (int i = 0; i < POINTS; i++)
            mean += reference->radiosity[f][i] / POINTS / count;
    }
    for (int w = 0; w < WAYS; w++) {
        for (int f = 0; f < count; f++) {
            const int next = (f + 1) % count;
            x[f] = f;
            y[w][f] = 0;
            for (int i = 0; i < POINTS; i++)
                y[w][f] += 100 / mean / POINTS *
                           fabs(ways[w].radiosity[next][i] - ways[w].radiosity[f][i] -
                                reference->radiosity[next][i] + reference->radiosity[f][i]);
        }
        curves[w] = (struct plot_series){
            .kind = PLOT_LINE, .label = names[w], .count = (size_t)count, .x = x, .y = y[w]
        };
    }
    const struct plot plot = { .width_px = 720,
                               .height_px = 360,
                               .title = title,
                               .x = { .title = "frame" },
                               .y = { .title = "flicker in % of the mean radiosity" },
                               .series = curves,
                               .series_count = WAYS };
    const bool done = plot_svg_create(&plot, &svg, &size, status) && io_file_write(path, svg, size, status);
    free(svg);
    return done;
}

static bool read_technique(const char *name, enum render_technique *out, dipole_status *status)
{
    *out = strcmp(name, "gather") == 0 ? RENDER_TECHNIQUE_GATHER : RENDER_TECHNIQUE_SPLAT;
    return *out == RENDER_TECHNIQUE_GATHER || strcmp(name, "splat") == 0 ||
           dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "technique %s, expected splat or gather", name);
}

/* All ways to sample, a row each, and the plot. */
static bool measure(struct bench *bench, const char *technique_name, const char *epsilon,
                    const struct series *reference, const char *plot, const char *title,
                    dipole_status *status)
{
    static const enum render_coherence kinds[WAYS] = { RENDER_COHERENCE_NONE, RENDER_COHERENCE_TWO_PASS,
                                                       RENDER_COHERENCE_SURFACE };
    struct series ways[WAYS] = { { .frame_count = 0 } };
    enum render_technique technique;
    char path[512], full_title[256];
    snprintf(path, sizeof path, "%s_%s_%s.svg", plot, technique_name, epsilon);
    snprintf(full_title, sizeof full_title, "%s, %s, epsilon %s", title, technique_name, epsilon);
    bool done = read_technique(technique_name, &technique, status);
    for (int w = 0; done && w < WAYS; w++) {
        done = run(bench, technique, kinds[w], atof(epsilon), &ways[w], status);
        if (!done)
            break;
        const struct flicker found = compare(&ways[w], reference);
        printf("| %s | %s | %s | %s | %.4f | %.4f | %.3f | %.3f | %.3f | %.0f | %.0f |\n", title,
               technique_name, epsilon, render_coherence_names[kinds[w]], found.mean, found.largest,
               found.changes, found.true_changes, found.error, ways[w].sample_count, ways[w].ms);
        fflush(stdout);
    }
    done = done && write_plot(path, full_title, ways, reference, status);
    for (int w = 0; w < WAYS; w++)
        free(ways[w].radiosity);
    return done;
}

int main(int argc, char **argv)
{
    struct bench bench = { .frame_count = argc > 2 ? atoi(argv[2]) : 0 };
    struct series reference = { .frame_count = 0 };
    dipole_status status = { 0 };
    if (argc < 7 || argc % 2 == 0 || bench.frame_count < 2 || bench.frame_count > FRAMES) {
        fputs("usage: bench_flicker SCENE.json FRAMES PLOT TITLE {splat|gather EPSILON}...\n", stderr);
        return 2;
    }
    const struct io_scene_options options = { .width_px = WIDTH_PX, .height_px = HEIGHT_PX };
    bool done = io_scene_read(argv[1], &options, &bench.scene, &status);
    if (done && bench.scene->frames.count != bench.frame_count)
        done = dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "the scene has %d frames",
                           bench.scene->frames.count);
    done =
        done && render_create(bench.scene, RENDER_CONTEXT_DEFAULT, &bench.renderer, &status) &&
        run(&bench, RENDER_TECHNIQUE_SPLAT, RENDER_COHERENCE_NONE, REFERENCE_EPSILON, &reference, &status);
    for (int i = 5; done && i < argc; i += 2)
        done = measure(&bench, argv[i], argv[i + 1], &reference, argv[3], argv[4], &status);
    if (!done)
        fprintf(stderr, "bench_flicker: %s\n", status.message);
    free(reference.radiosity);
    render_destroy(bench.renderer);
    io_scene_destroy(bench.scene);
    return done ? 0 : 1;
}
