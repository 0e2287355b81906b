#include "renderer/gather_draw.h"

#include "lutgen/parallel.h"
#include "renderer/gather_gl.h"
#include "renderer/splat_draw.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct render_gatherer {
    size_t medium_count;
    struct render_band_key *keys; /* of each medium: what its kernels were made for */
    struct render_gather_medium *media;
    struct render_gather_gl *gl; /* NULL until OpenGL first gathers */
};

bool render_gatherer_create(const struct render_media *media, struct render_gatherer **gatherer_out,
                            dipole_status *status)
{
    *gatherer_out = NULL;
    struct render_gatherer *const gatherer = calloc(1, sizeof *gatherer);
    if (gatherer) {
        gatherer->medium_count = media->count;
        gatherer->keys = calloc(media->count, sizeof *gatherer->keys);
        gatherer->media =
            aligned_alloc(_Alignof(struct render_gather_medium), media->count * sizeof *gatherer->media);
    }
    if (!gatherer || !gatherer->keys || !gatherer->media) {
        render_gatherer_destroy(gatherer);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather from %zu media",
                           media->count);
    }
    *gatherer_out = gatherer;
    return true;
}

void render_gatherer_destroy(struct render_gatherer *gatherer)
{
    if (!gatherer)
        return;
    render_gather_gl_destroy(gatherer->gl);
    free(gatherer->keys);
    free(gatherer->media);
    free(gatherer);
}

/* Kernels of the media that are seen, anew where the bands or the table have changed. */
static bool prepare_media(struct render_gatherer *gatherer, const struct render_frame *frame,
                          dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    for (size_t m = 0; m < gatherer->medium_count; m++) {
        struct render_band_key *const known = &gatherer->keys[m];
        const struct render_band_key key = render_plan_band_key(plan, &frame->tables[m], m);
        if (key.band_count == 0 || render_band_keys_are_same(known, &key))
            continue;
        known->band_count = 0; /* until it is done */
        if (!render_gather_medium_init(&key.source, key.bands, key.band_count, &gatherer->media[m], status))
            return false;
        *known = key;
    }
    return true;
}

/* ---- sources ------------------------------------------------------------------------------------ */

/* Objects as they are gathered for: one, where they are not told apart. */
struct objects {
    size_t count;
    struct render_gather_object *objects;
    struct render_gather_sources *sources;
    dipole_status *statuses;                   /* of each */
    const struct render_plan_medium **media;   /* of each */
    int *code_levels;                          /* of each: render_plan_code_level */
    size_t *first;                             /* of each, and one past the last */
    const struct render_light_sample *samples; /* object by object */
    const uint64_t *codes;                     /* of their cubes at rest; NULL: they have none */
    struct render_light_sample *own_samples;   /* NULL where the splatter's are in order already */
    uint64_t *own_codes;
};

static void sort_object(void *context, int index)
{
    const struct objects *const all = context;
    const size_t o = (size_t)index;
    all->statuses[o].code = DIPOLE_OK;
    if (!all->objects[o].medium)
        return;
    const struct render_light_sample *const samples = all->samples ? all->samples + all->first[o] : NULL;
    const uint64_t *const codes = all->codes ? all->codes + all->first[o] : NULL;
    if (!render_gather_sources_init(samples, codes, all->code_levels[o], all->first[o + 1] - all->first[o],
                                    all->media[o]->bands, all->media[o]->band_count,
                                    all->media[o]->spread_mm, &all->sources[o], &all->statuses[o]))
        return;
    all->objects[o].sources = &all->sources[o];
}

static void describe_objects(const struct render_gatherer *gatherer, const struct render_plan *plan,
                             struct objects *all)
{
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const struct render_plan_object *const planned = &plan->objects[i];
        const size_t o = plan->has_object_ids ? i : 0;
        if (!(planned->spacing_mm > 0))
            continue;
        const double apart_mm = render_plan_pixel_mm(plan, planned);
        struct render_gather_object *const object = &all->objects[o];
        object->pixel_mm = object->medium ? fmin(object->pixel_mm, apart_mm) : apart_mm;
        object->medium = &gatherer->media[planned->medium];
        all->media[o] = &plan->of_medium[planned->medium];
        all->code_levels[o] = render_plan_code_level(plan, i);
    }
}

/* Samples of all media, object by object. Those of the environment carry no codes of cubes at rest. */
static bool share_out_samples(const struct render_gatherer *gatherer, const struct render_plan *plan,
                              struct render_splatter *splatter, struct objects *all, dipole_status *status)
{
    size_t count = 0;
    for (size_t m = 0; m < gatherer->medium_count; m++)
        count += render_splatter_samples(splatter, m)->count;
    const bool has_codes = plan->coherence == RENDER_COHERENCE_SURFACE && !plan->has_environment;
    if (all->count == 1 && gatherer->medium_count == 1) {
        all->samples = render_splatter_samples(splatter, 0)->samples;
        all->codes = has_codes ? render_splatter_samples(splatter, 0)->codes : NULL;
        all->first[1] = count;
        return true;
    }
    all->samples = all->own_samples = calloc(count + 1, sizeof *all->own_samples);
    all->codes = all->own_codes = has_codes ? calloc(count + 1, sizeof *all->own_codes) : NULL;
    size_t *const next = calloc(all->count + 1, sizeof *next);
    if (!all->samples || (has_codes && !all->codes) || !next) {
        free(next);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples", count);
    }
    for (int is_placing = 0; is_placing < 2; is_placing++) {
        for (size_t m = 0; m < gatherer->medium_count; m++) {
            const struct render_light_samples *const of_medium = render_splatter_samples(splatter, m);
            for (size_t i = 0; i < of_medium->count; i++) {
                const struct render_light_sample *const sample = &of_medium->samples[i];
                const size_t o = all->count == 1 ? 0 : (size_t)sample->object;
                if (!is_placing) {
                    all->first[o + 1]++;
                    continue;
                }
                if (has_codes)
                    all->own_codes[next[o]] = of_medium->codes[i];
                all->own_samples[next[o]++] = *sample;
            }
        }
        for (size_t o = 0; !is_placing && o < all->count; o++) {
            all->first[o + 1] += all->first[o];
            next[o] = all->first[o];
        }
    }
    free(next);
    return true;
}

static void objects_end(struct objects *all)
{
    for (size_t o = 0; all->sources && o < all->count; o++)
        render_gather_sources_end(&all->sources[o]);
    free(all->objects);
    free(all->sources);
    free(all->statuses);
    free((void *)all->media);
    free(all->own_samples);
    free(all->own_codes);
    free(all->code_levels);
    free(all->first);
}

static bool objects_init(const struct render_gatherer *gatherer, const struct render_plan *plan,
                         struct render_splatter *splatter, struct objects *all, dipole_status *status)
{
    *all = (struct objects){ .count = plan->has_object_ids ? plan->media->object_count : 1 };
    all->objects = calloc(all->count, sizeof *all->objects);
    all->sources = calloc(all->count, sizeof *all->sources);
    all->statuses = calloc(all->count, sizeof *all->statuses);
    all->media = calloc(all->count, sizeof(const struct render_plan_medium *));
    all->first = calloc(all->count + 1, sizeof *all->first);
    all->code_levels = calloc(all->count, sizeof *all->code_levels);
    if (!all->code_levels || !all->objects || !all->sources || !all->statuses || !all->media || !all->first)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather for %zu objects",
                           all->count);
    describe_objects(gatherer, plan, all);
    if (!share_out_samples(gatherer, plan, splatter, all, status))
        return false;
    lut_parallel_for((int)all->count, 0, sort_object, all);
    for (size_t o = 0; o < all->count; o++) {
        if (all->statuses[o].code != DIPOLE_OK)
            return dipole_fail(status, all->statuses[o].code, NULL, "%s", all->statuses[o].message);
    }
    return true;
}

/* ---- a frame ------------------------------------------------------------------------------------ */

static size_t picture_size(const struct render_plan *plan)
{
    return (size_t)plan->width_px * (size_t)plan->height_px * 4 * sizeof(float);
}

/* What is asked for, and where the pixels' places are read to. */
static bool make_request(const struct render_frame *frame, const struct objects *all, float *position_mm,
                         struct render_gather_request *request, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    if (!position_mm)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the places of %dx%d pixels",
                           plan->width_px, plan->height_px);
    glGetTextureImage(render_executor_texture(frame->executor, "position_mm"), 0, GL_RGBA, GL_FLOAT,
                      (GLsizei)picture_size(plan), position_mm);
    *request = (struct render_gather_request){ .width_px = plan->width_px,
                                               .height_px = plan->height_px,
                                               .position_mm = position_mm,
                                               .objects = all->objects,
                                               .object_count = all->count,
                                               .epsilon = plan->interpolation_epsilon,
                                               .own_epsilon = plan->own_epsilon };
    return true;
}

static bool gather(const struct render_frame *frame, const struct render_gather_request *request,
                   dipole_status *status)
{
    float *const radiosity = calloc(1, picture_size(frame->plan));
    if (!radiosity)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory for the radiosity of %dx%d pixels", request->width_px,
                           request->height_px);
    struct render_gather_request with_slopes = *request;
    with_slopes.has_slopes = true; /* which OpenGL's shaders do not know */
    const bool done = render_gather_run(&with_slopes, radiosity, NULL, status);
    if (done)
        glTextureSubImage2D(render_executor_texture(frame->executor, "radiosity"), 0, 0, 0,
                            request->width_px, request->height_px, GL_RGBA, GL_FLOAT, radiosity);
    free(radiosity);
    return done;
}

static bool gather_by_gl(struct render_gatherer *gatherer, const struct render_frame *frame,
                         const struct render_gather_request *request, dipole_status *status)
{
    return (gatherer->gl || render_gather_gl_create(&gatherer->gl, status)) &&
           render_gather_gl_draw(gatherer->gl, frame, request, status);
}

bool render_gatherer_run(struct render_gatherer *gatherer, const struct render_frame *frame,
                         dipole_status *status)
{
    struct render_splatter *splatter;
    struct objects all;
    struct render_gather_request request;
    if (!render_executor_need_splatter(frame, &splatter, status) || !prepare_media(gatherer, frame, status))
        return false;
    float *const position_mm = malloc(picture_size(frame->plan));
    const bool done =
        objects_init(gatherer, frame->plan, splatter, &all, status) &&
        make_request(frame, &all, position_mm, &request, status) &&
        (frame->plan->gather == RENDER_GATHER_GL ? gather_by_gl(gatherer, frame, &request, status)
                                                 : gather(frame, &request, status));
    objects_end(&all);
    free(position_mm);
    return done;
}
