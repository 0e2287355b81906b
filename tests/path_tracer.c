/* Light that enters, walks at random, and leaves. */
#include "path_tracer.h"

#include "lutgen/parallel.h"
#include "path_tracer_parts.h"

#include <stdlib.h>
#include <string.h>

/* Photons below this part of their power play Russian roulette, and survive as often. */
#define ROULETTE 0.2

/* Everything that is counted stands in one row of numbers, a row for each batch: the powers, then the
 * picture, then the rings, front and back. */
enum { POWER_COUNT = sizeof(struct tracer_powers) / sizeof(double) };

struct trace {
    const struct tracer_scene *scene;
    struct tracer_shape shape;
    struct tracer_lamp lamp;
    struct tracer_camera camera;
    const struct tracer_rings *rings;
    size_t photons_per_batch, pixel_count, ring_count, row_length;
    uint64_t seed;
    double *rows;
};

struct photon {
    double p_mm[3], direction[3];
    double power_w, start_w; /* start: before the surface took its part */
    double entry_mm[3];
    int entry_face;
    bool is_scattered;
};

/* ---- light comes in, is scattered ----------------------------------------------------------------------
 */

/* Start a photon just below the surface; false: all of it was mirrored. */
static bool enter(const struct trace *trace, struct accuracy_stream *stream, struct photon *photon,
                  struct tracer_powers *powers)
{
    struct tracer_arrival arrival;
    double normal[3];
    tracer_lamp_sample(&trace->lamp, &trace->shape, stream, &arrival);
    tracer_normal(&trace->shape, arrival.p_mm, arrival.face, normal);
    const double eta = trace->scene->medium.eta;
    const double cosine = fmin(fmax(-tracer_dot(arrival.direction, normal), 0), 1);
    const double mirrored_w = arrival.power_w * dipole_fresnel_reflectance(eta, cosine);
    powers->incident += arrival.power_w;
    powers->mirrored += mirrored_w;
    *photon = (struct photon){ .power_w = arrival.power_w - mirrored_w,
                               .start_w = arrival.power_w,
                               .entry_face = arrival.face };
    const double inside = sqrt(fmax(1 - (1 - cosine * cosine) / (eta * eta), 0));
    for (int k = 0; k < 3; k++) {
        photon->p_mm[k] = photon->entry_mm[k] = arrival.p_mm[k];
        photon->direction[k] = (arrival.direction[k] + cosine * normal[k]) / eta - inside * normal[k];
    }
    return photon->power_w > 0;
}

static void scatter(double g, double direction[3], struct accuracy_stream *stream)
{
    double point[2];
    const double r2 = tracer_disc(stream, point);
    const double axis[3] = { direction[0], direction[1], direction[2] };
    double cosine = 1 - 2 * r2;
    if (g != 0) {
        const double t = (1 - g * g) / (1 + g * cosine);
        cosine = fmin(fmax((1 + g * g - t * t) / (2 * g), -1), 1);
    }
    tracer_turn(axis, cosine, point, r2, direction);
}

/* ---- and goes out ----------------------------------------------------------------------------------- */

static void count_rings(const struct trace *trace, const struct photon *photon, int face, double *rings)
{
    const int axis = photon->entry_face / 2;
    if (face / 2 != axis)
        return;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double r_mm = hypot(photon->p_mm[u] - photon->entry_mm[u], photon->p_mm[v] - photon->entry_mm[v]);
    const double *const edges_mm = trace->rings->edges_mm;
    if (!(r_mm >= edges_mm[0] && r_mm < edges_mm[trace->ring_count]))
        return;
    size_t lo = 0, hi = trace->ring_count;
    while (hi - lo > 1) {
        const size_t middle = (lo + hi) / 2;
        if (r_mm >= edges_mm[middle])
            lo = middle;
        else
            hi = middle;
    }
    rings[lo + (face == photon->entry_face ? 0 : trace->ring_count)] += photon->power_w;
}

/* At the surface: false if the photon left. */
static bool reflect(const struct trace *trace, int face, struct accuracy_stream *stream,
                    struct photon *photon, double *row)
{
    double normal[3], outward[3];
    tracer_normal(&trace->shape, photon->p_mm, face, normal);
    const double eta = trace->scene->medium.eta;
    const double cosine = fmin(fmax(tracer_dot(photon->direction, normal), 0), 1);
    if (accuracy_uniform(stream) <= dipole_fresnel_reflectance(1 / eta, cosine)) {
        for (int k = 0; k < 3; k++)
            photon->direction[k] -= 2 * cosine * normal[k];
        return true;
    }
    struct tracer_powers *const powers = (struct tracer_powers *)row;
    (photon->is_scattered ? powers->scattered : powers->unscattered)[face] += photon->power_w;
    if (photon->is_scattered && trace->pixel_count > 0) {
        const double outside = sqrt(fmax(1 - eta * eta * (1 - cosine * cosine), 0));
        for (int k = 0; k < 3; k++)
            outward[k] = eta * (photon->direction[k] - cosine * normal[k]) + outside * normal[k];
        tracer_camera_add(&trace->camera, photon->p_mm, normal, outward, photon->power_w,
                          row + POWER_COUNT);
    }
    if (photon->is_scattered && trace->ring_count > 0)
        count_rings(trace, photon, face, row + POWER_COUNT + trace->pixel_count);
    return false;
}

/* At a place within: false if roulette ended the photon. */
static bool interact(const struct trace *trace, double albedo, struct accuracy_stream *stream,
                     struct photon *photon, double *row)
{
    struct tracer_powers *const powers = (struct tracer_powers *)row;
    const struct tracer_medium *const medium = &trace->scene->medium;
    powers->absorbed += photon->power_w * (1 - albedo);
    photon->power_w *= albedo;
    if (photon->power_w < ROULETTE * photon->start_w) {
        const double before_w = photon->power_w;
        const bool survives = before_w > 0 && accuracy_uniform(stream) <= ROULETTE;
        photon->power_w = survives ? before_w / ROULETTE : 0;
        powers->roulette += before_w - photon->power_w;
        if (!survives)
            return false;
    }
    if (trace->camera.connection_count > 0)
        tracer_camera_connect(&trace->camera, &trace->shape, medium, photon->p_mm, photon->direction,
                              photon->power_w, stream, row + POWER_COUNT);
    scatter(medium->g, photon->direction, stream);
    photon->is_scattered = true;
    return true;
}

static void trace_photon(const struct trace *trace, struct accuracy_stream *stream, double *row)
{
    const struct tracer_medium *const medium = &trace->scene->medium;
    const double sigma_t = medium->sigma_a_per_mm + medium->sigma_s_per_mm;
    const double albedo = sigma_t > 0 ? medium->sigma_s_per_mm / sigma_t : 0;
    const struct tracer_shape *const shape = &trace->shape;
    struct photon photon;
    bool is_alive = enter(trace, stream, &photon, (struct tracer_powers *)row);
    while (is_alive) {
        int face = 0;
        const double surface_mm = tracer_distance_mm(shape, photon.p_mm, photon.direction, &face);
        const double free_mm = sigma_t > 0 ? -log(accuracy_uniform(stream)) / sigma_t : INFINITY;
        const bool is_at_surface = free_mm >= surface_mm;
        const double step_mm = is_at_surface ? surface_mm : free_mm;
        for (int k = 0; k < 3; k++)
            photon.p_mm[k] += step_mm * photon.direction[k];
        if (is_at_surface && !shape->is_sphere)
            photon.p_mm[face / 2] = shape->planes_mm[face];
        is_alive = is_at_surface ? reflect(trace, face, stream, &photon, row)
                                 : interact(trace, albedo, stream, &photon, row);
    }
}

static void trace_batch(void *context, int batch)
{
    const struct trace *const trace = context;
    struct accuracy_stream stream = accuracy_stream_of(trace->seed, (uint64_t)batch);
    double *const row = trace->rows + (size_t)batch * trace->row_length;
    for (size_t i = 0; i < trace->photons_per_batch; i++)
        trace_photon(trace, &stream, row);
}

/* ---- results ---------------------------------------------------------------------------------------- */

static void gather(const struct trace *trace, size_t column, double *mean, double *error)
{
    accuracy_judge(trace->rows + column, TRACER_BATCHES, trace->row_length, mean, error);
    *mean /= (double)trace->photons_per_batch;
    *error /= (double)trace->photons_per_batch;
}

static void gather_all(const struct trace *trace, struct tracer_result *result)
{
    for (size_t i = 0; i < POWER_COUNT; i++)
        gather(trace, i, (double *)&result->mean + i, (double *)&result->error + i);
    double mean, error;
    for (size_t i = 0; i < trace->pixel_count; i++) {
        gather(trace, POWER_COUNT + i, &mean, &error);
        result->radiance[i] = (float)mean;
        if (result->radiance_error != NULL)
            result->radiance_error[i] = (float)error;
    }
    struct tracer_rings *const rings = result->rings;
    for (size_t i = 0; i < trace->ring_count; i++) {
        const size_t column = POWER_COUNT + trace->pixel_count + i;
        const double lo_mm = rings->edges_mm[i], hi_mm = rings->edges_mm[i + 1];
        const double area_mm2 = TRACER_PI * (hi_mm - lo_mm) * (hi_mm + lo_mm);
        gather(trace, column, &mean, &error);
        rings->front_per_mm2[i] = mean / area_mm2;
        rings->front_error[i] = error / area_mm2;
        gather(trace, column + trace->ring_count, &mean, &error);
        rings->back_per_mm2[i] = mean / area_mm2;
        rings->back_error[i] = error / area_mm2;
    }
}

/* ---- what is asked ---------------------------------------------------------------------------------- */

bool tracer_trace(const struct tracer_scene *scene, const struct tracer_run *run,
                  struct tracer_result *result, dipole_status *status)
{
    struct trace trace = { .scene = scene, .rings = result->rings, .seed = run->seed };
    const char *const fault = tracer_find_fault(scene, run, result->rings);
    if (fault != NULL)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "path tracer: %s", fault);
    tracer_shape_init(&scene->body, &trace.shape);
    tracer_lamp_init(&scene->light, &trace.lamp);
    if (scene->view != NULL) {
        tracer_camera_init(scene, &trace.camera);
        trace.pixel_count = (size_t)scene->view->camera.width_px * (size_t)scene->view->camera.height_px;
    }
    trace.ring_count = result->rings != NULL ? result->rings->count : 0;
    trace.row_length = POWER_COUNT + trace.pixel_count + 2 * trace.ring_count;
    trace.photons_per_batch = (run->photon_count + TRACER_BATCHES - 1) / TRACER_BATCHES;
    trace.rows = calloc(TRACER_BATCHES * trace.row_length, sizeof *trace.rows);
    if (trace.rows == NULL)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "path tracer: no memory for the picture");
    lut_parallel_for(TRACER_BATCHES, run->thread_count, trace_batch, &trace);
    gather_all(&trace, result);
    free(trace.rows);
    return true;
}

bool tracer_picture(const struct tracer_scene *scene, size_t photon_count, uint64_t seed, int thread_count,
                    float *radiance, float *standard_error, dipole_status *status)
{
    const struct tracer_run run = { photon_count, seed, thread_count };
    struct tracer_result result = { 0 };
    result.radiance = radiance;
    result.radiance_error = standard_error;
    if (scene->view == NULL)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "path tracer: the scene has no view");
    return tracer_trace(scene, &run, &result, status);
}
