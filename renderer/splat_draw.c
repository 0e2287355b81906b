#include "renderer/splat_draw.h"

#include "renderer/cell_samples.h"
#include "renderer/light_draw.h"
#include "renderer/splats.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { UNIT_SAMPLES = 14, UNIT_TABLE = 15 };

/* Samples of one medium, of each band. */
struct medium_samples {
    struct render_light_samples bands[RENDER_BAND_LIMIT];
};

struct render_splatter {
    size_t medium_count;
    struct medium_samples *of_medium;
    struct render_band_key *keys; /* of what table_buffer holds, medium by medium */
    size_t splat_count, dropped_count;
    GLuint vertex_array, splat_buffer;
    struct render_buffer_texture sample_buffer, table_buffer;
};

static void vertex_array_create(struct render_splatter *splatter)
{
    glCreateVertexArrays(1, &splatter->vertex_array);
    const GLuint array = splatter->vertex_array;
    glVertexArrayAttribFormat(array, 0, 4, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, rectangle));
    glVertexArrayAttribFormat(array, 1, 1, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, depth));
    glVertexArrayAttribIFormat(array, 2, 2, GL_UNSIGNED_INT, offsetof(struct render_splat, first));
    glVertexArrayAttribFormat(array, 3, 1, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, object));
    glVertexArrayAttribFormat(array, 4, 4, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, centre_mm));
    glVertexArrayAttribFormat(array, 5, 4, GL_FLOAT, GL_FALSE, offsetof(struct render_splat, profile));
    glVertexArrayBindingDivisor(array, 0, 1);
    for (GLuint i = 0; i < 6; i++) {
        glVertexArrayAttribBinding(array, i, 0);
        glEnableVertexArrayAttrib(array, i);
    }
}

bool render_splatter_create(const struct render_media *media, struct render_splatter **splatter_out,
                            dipole_status *status)
{
    *splatter_out = NULL;
    struct render_splatter *const splatter = calloc(1, sizeof *splatter);
    if (splatter) {
        splatter->medium_count = media->count;
        splatter->of_medium = calloc(media->count, sizeof *splatter->of_medium);
        splatter->keys = calloc(media->count, sizeof *splatter->keys);
    }
    if (!splatter || !splatter->of_medium || !splatter->keys) {
        render_splatter_destroy(splatter);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the samples of %zu media",
                           media->count);
    }
    vertex_array_create(splatter);
    *splatter_out = splatter;
    return true;
}

void render_splatter_destroy(struct render_splatter *splatter)
{
    if (!splatter)
        return;
    for (size_t m = 0; splatter->of_medium && m < splatter->medium_count; m++) {
        for (int b = 0; b < RENDER_BAND_LIMIT; b++)
            render_light_samples_destroy(&splatter->of_medium[m].bands[b]);
    }
    if (splatter->vertex_array)
        glDeleteVertexArrays(1, &splatter->vertex_array);
    if (splatter->splat_buffer)
        glDeleteBuffers(1, &splatter->splat_buffer);
    render_buffer_texture_destroy(&splatter->sample_buffer);
    render_buffer_texture_destroy(&splatter->table_buffer);
    free(splatter->of_medium);
    free(splatter->keys);
    free(splatter);
}

static void empty_samples(struct render_splatter *splatter)
{
    for (size_t m = 0; m < splatter->medium_count; m++) {
        for (int b = 0; b < RENDER_BAND_LIMIT; b++)
            splatter->of_medium[m].bands[b].count = 0;
    }
}

void render_splatter_begin(struct render_splatter *splatter)
{
    splatter->splat_count = splatter->dropped_count = 0;
    empty_samples(splatter);
}

void render_splatter_drop_samples(struct render_splatter *splatter)
{
    splatter->dropped_count = render_splatter_sample_count(splatter);
    empty_samples(splatter);
}

/* ---- samples ------------------------------------------------------------------------------------ */

/* Read the corner of a texture that a light's view of such a size has used back; NULL: no memory. */
static float *read_part(const struct render_frame *frame, const char *texture, GLsizei size_px,
                        GLenum format, size_t components)
{
    const size_t size = (size_t)size_px * (size_t)size_px * components * sizeof(float);
    float *const texels = malloc(size);
    if (texels)
        glGetTextureSubImage(render_executor_texture(frame->executor, texture), 0, 0, 0, 0, size_px,
                             size_px, 1, format, GL_FLOAT, (GLsizei)size, texels);
    return texels;
}

/* The most that arrives of a channel is taken off a texel's power, and off irradiance if there is any;
 * shadows are left as parts of that. */
static void take_shadows(float *texels, float *irradiance, float *shadows,
                         const struct render_light_view *view)
{
    for (int y = 0; y < view->size_px; y++) {
        for (int x = 0; x < view->size_px; x++) {
            const size_t i = (size_t)y * (size_t)view->size_px + (size_t)x;
            const float *const shadow =
                shadows + 4 * ((size_t)(y / view->shadow_block_px) * (size_t)view->shadow_side_px +
                               (size_t)(x / view->shadow_block_px));
            const float most = fmaxf(shadow[0], fmaxf(shadow[1], shadow[2]));
            texels[4 * i + 3] *= most;
            if (irradiance)
                irradiance[i] *= most;
        }
    }
    for (int i = 0; i < view->shadow_side_px * view->shadow_side_px; i++) {
        float *const shadow = shadows + 4 * (size_t)i;
        const float most = fmaxf(shadow[0], fmaxf(shadow[1], shadow[2]));
        for (int k = 0; k < 3 && most > 0; k++)
            shadow[k] /= most;
    }
}

static struct render_light_target target_of(const struct render_frame *frame, size_t index,
                                            struct render_light_samples *samples)
{
    const struct render_plan_object *const object = &frame->plan->objects[index];
    const struct io_mesh *const rest = io_object_rest(&frame->request->scene->objects[index]);
    struct render_light_target target = { .samples = samples,
                                          .spacing_mm = object->spacing_mm,
                                          .cell_mm = object->cell_mm };
    for (int k = 0; k < 3; k++)
        target.origin_mm[k] = (double)rest->min[k];
    return target;
}

/* Samples of what the view shows, drawn in memory tile by tile. */
static bool append_drawn(const struct render_frame *frame, const struct render_light_target *targets,
                         const struct render_light_view *view, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    struct render_light_picture picture;
    if (!render_light_picture_of(frame, &picture, status))
        return false;
    struct render_light_view drawn = *view;
    struct render_light_tiles *tiles;
    drawn.draw_tile = render_light_tiles_draw;
    drawn.tile_px = render_light_tile_px(view->block_px);
    drawn.tile_object_count = plan->has_object_ids ? picture.mesh_count : 0;
    bool done = render_light_tiles_create(&picture, drawn.tile_px, render_light_view_shift_px(view), &tiles,
                                          status);
    if (done) {
        drawn.tiles = tiles;
        done = render_light_samples_append(targets, &drawn, status);
        render_light_tiles_destroy(tiles);
    }
    render_light_picture_free(&picture);
    return done;
}

static bool append_once(const struct render_frame *frame, const struct render_light_target *targets,
                        const struct render_light_view *view, dipole_status *status)
{
    return view->texels ? render_light_samples_append(targets, view, status)
                        : append_drawn(frame, targets, view, status);
}

static bool append_view(const struct render_frame *frame, const struct render_light_target *targets,
                        struct render_light_view *view, dipole_status *status)
{
    if (frame->plan->coherence == RENDER_COHERENCE_SURFACE)
        return render_cell_samples_append(targets, view, status);
    if (frame->plan->coherence != RENDER_COHERENCE_TWO_PASS)
        return append_once(frame, targets, view, status);
    view->flux_factor = 0.5;
    if (!append_once(frame, targets, view, status))
        return false;
    view->is_shifted = true;
    return append_once(frame, targets, view, status);
}

/* What OpenGL has drawn of a view, read back; NULL: not asked for. */
struct reading {
    float *texels, *objects, *irradiance, *rest_mm, *shadows;
};

static void reading_end(struct reading *reading)
{
    free(reading->texels);
    free(reading->objects);
    free(reading->irradiance);
    free(reading->rest_mm);
    free(reading->shadows);
}

static bool read_back(const struct render_frame *frame, struct reading *reading, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    const int block_px = render_plan_shadow_block_px(plan), size_px = frame->view->size_px;
    const struct {
        const char *texture;
        bool is_wanted;
        int side_px;
        GLenum format;
        size_t components;
        float **out;
    } parts[] = {
        { "light_view", true, size_px, GL_RGBA, 4, &reading->texels },
        { "light_object", render_plan_wants(plan, "light_object"), size_px, GL_RED, 1, &reading->objects },
        { "light_irradiance", render_plan_wants(plan, "light_irradiance"), size_px, GL_RED, 1,
          &reading->irradiance },
        { "light_rest", render_plan_wants(plan, "light_rest"), size_px, GL_RGBA, 4, &reading->rest_mm },
        { "light_shadow", plan->shadows.of_view != NULL, (size_px + block_px - 1) / block_px, GL_RGBA, 4,
          &reading->shadows },
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (parts[i].is_wanted && !(*parts[i].out = read_part(frame, parts[i].texture, parts[i].side_px,
                                                              parts[i].format, parts[i].components)))
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                               "no memory for a light's view of %d texels a side", size_px);
    }
    return true;
}

/* The frame's view, of which texels are read back, kept in memory, or not known yet. */
static struct render_light_view view_of(const struct render_frame *frame, const struct reading *reading)
{
    const struct render_plan *const plan = frame->plan;
    const struct render_plan_view *const planned = frame->view;
    const int block_px = render_plan_shadow_block_px(plan);
    struct render_light_view view = { .texels = reading->texels,
                                      .objects = reading->objects,
                                      .irradiance = reading->irradiance,
                                      .rest_mm = reading->rest_mm,
                                      .shadows = plan->shadows.coloured_count > 0 ? reading->shadows : NULL,
                                      .shadow_block_px = block_px,
                                      .shadow_side_px = (planned->size_px + block_px - 1) / block_px,
                                      .size_px = planned->size_px,
                                      .block_px = planned->block_px };
    if (render_plan_keeps_pictures(plan)) {
        const struct render_light_texels *const drawn =
            render_light_drawing_texels(render_executor_drawing(frame->executor));
        view.texels = drawn->texels;
        view.objects = drawn->objects;
        view.rest_mm = drawn->rest_mm;
    }
    memcpy(view.forward, planned->projection.forward, sizeof view.forward);
    view.eye_depth_mm = render_dot(planned->projection.eye_mm, planned->projection.forward);
    view.texel = planned->projection.is_orthographic ? 0 : sqrt(planned->texel_area);
    memcpy(view.rgb, frame->request->scene->lights[planned->light].rgb, sizeof view.rgb);
    return view;
}

/* Where the samples of each object go. Without ids all are alike, but some may be out of sight. */
static void find_targets(struct render_splatter *splatter, const struct render_frame *frame,
                         struct render_light_target *targets)
{
    const struct render_plan *const plan = frame->plan;
    const size_t object_count = frame->request->scene->object_count;
    for (size_t i = 0; i < object_count; i++) {
        const struct render_plan_object *const object = &plan->objects[i];
        if (object->spacing_mm > 0)
            targets[i] = target_of(frame, i, &splatter->of_medium[object->medium].bands[0]);
    }
    for (size_t i = 1; !plan->has_object_ids && i < object_count; i++) {
        if (targets[i].samples && (!targets[0].samples || targets[i].spacing_mm < targets[0].spacing_mm))
            targets[0] = targets[i];
    }
}

bool render_splatter_sample_view(struct render_splatter *splatter, const struct render_frame *frame,
                                 dipole_status *status)
{
    const size_t object_count = frame->request->scene->object_count;
    struct render_light_target *const targets = calloc(object_count, sizeof *targets);
    if (!targets)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu objects", object_count);
    find_targets(splatter, frame, targets);
    struct reading reading = { .texels = NULL };
    bool done = frame->plan->has_light_pictures || read_back(frame, &reading, status);
    if (done) {
        struct render_light_view view = view_of(frame, &reading);
        if (reading.shadows)
            take_shadows(reading.texels, reading.irradiance, reading.shadows, &view);
        done = append_view(frame, targets, &view, status);
    }
    reading_end(&reading);
    free(targets);
    return done;
}

/* ---- splats ------------------------------------------------------------------------------------- */

/* Fill the buffer of profiles, all media one after the other, unless it holds them already. */
static bool fill_table(struct render_splatter *splatter, const struct render_frame *frame,
                       const struct render_table *tables, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    bool is_known = splatter->table_buffer.texture != 0;
    size_t node_count = 0;
    for (size_t m = 0; m < splatter->medium_count; m++) {
        const struct render_band_key key = render_plan_band_key(plan, &tables[m], m);
        is_known &= render_band_keys_are_same(&splatter->keys[m], &key);
        if (key.band_count > 0)
            node_count += (size_t)key.band_count * (size_t)render_bands_axis(&key.source).node_count;
    }
    if (is_known)
        return true;
    float *const nodes = calloc(node_count + 1, 4 * sizeof *nodes), *next = nodes;
    if (!nodes)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for profiles of %zu nodes",
                           node_count);
    bool done = true;
    for (size_t m = 0; done && m < splatter->medium_count; m++) {
        const struct render_band_key key = render_plan_band_key(plan, &tables[m], m);
        if (key.band_count == 0)
            continue;
        done = render_bands_bake(&key.source, key.bands, key.band_count, next, status);
        next += (size_t)key.band_count * (size_t)render_bands_axis(&key.source).node_count * 4;
    }
    if (done)
        render_buffer_texture_fill(&splatter->table_buffer, GL_RGBA32F, nodes,
                                   node_count * 4 * sizeof *nodes);
    for (size_t m = 0; done && m < splatter->medium_count; m++)
        splatter->keys[m] = render_plan_band_key(plan, &tables[m], m);
    free(nodes);
    return done;
}

/* Of a sample: position, footprint; flux, object. */
enum { SAMPLE_TEXELS = 2, SAMPLE_FLOATS = 4 * SAMPLE_TEXELS };
_Static_assert(offsetof(struct render_light_sample, spread_mm2) == SAMPLE_FLOATS * sizeof(float), "texels");

/* What is drawn: texels of samples, one band after the other, and splats of them. */
struct batch {
    float *texels;
    size_t sample_count, sample_capacity;
    struct render_splats splats;
};

static bool add_samples(struct batch *batch, const struct render_light_samples *samples,
                        dipole_status *status)
{
    if (batch->sample_capacity - batch->sample_count < samples->count) {
        const size_t capacity = batch->sample_count + samples->count + batch->sample_capacity / 2;
        float *const grown = realloc(batch->texels, capacity * SAMPLE_FLOATS * sizeof *grown);
        if (!grown)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples",
                               capacity);
        batch->texels = grown;
        batch->sample_capacity = capacity;
    }
    for (size_t i = 0; i < samples->count; i++)
        memcpy(batch->texels + batch->sample_count++ * SAMPLE_FLOATS, &samples->samples[i],
               SAMPLE_FLOATS * sizeof *batch->texels);
    return true;
}

/* The next coarser samples of a medium. Those of the environment carry no codes of cubes at rest. */
static bool merge_band(const struct render_plan *plan, double spacing_mm,
                       const struct render_light_samples *finer, struct render_light_samples *coarser,
                       dipole_status *status)
{
    if (plan->coherence != RENDER_COHERENCE_SURFACE || plan->has_environment)
        return render_light_samples_merge(finer, spacing_mm, coarser, status);
    int *const levels = calloc(plan->media->object_count, sizeof *levels);
    if (!levels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory to merge the samples of %zu objects", plan->media->object_count);
    for (size_t i = 0; i < plan->media->object_count; i++) {
        if (plan->objects[i].cell_mm > 0)
            levels[i] = (int)fmin(round(log2(spacing_mm / plan->objects[i].cell_mm)), 20);
        levels[i] = levels[i] > 0 ? levels[i] : 0;
    }
    const bool done = render_cell_samples_merge(finer, levels, coarser, status);
    free(levels);
    return done;
}

/* first_node: of the medium's first band; moved on to the next medium's. */
static bool add_medium(struct render_splatter *splatter, const struct render_plan *plan, size_t medium,
                       const struct render_table *table, size_t *first_node, struct batch *batch,
                       dipole_status *status)
{
    const struct render_plan_medium *const planned = &plan->of_medium[medium];
    struct render_light_samples *const samples = splatter->of_medium[medium].bands;
    const struct render_band_source source = render_plan_band_key(plan, table, medium).source;
    for (int b = 0; b < planned->band_count; b++) {
        const struct render_band *const band = &planned->bands[b];
        const struct lut_axis axis = render_bands_axis(&source);
        const double end = axis.r_max_mm / axis.scale_mm;
        const struct render_splat_profile profile = {
            .reach2_mm2 = (float)(band->r_outer_mm * band->r_outer_mm),
            .first_node = (float)*first_node,
            .inverse_scale2 = (float)(1 / (axis.scale_mm * axis.scale_mm)),
            .nodes_per_log2 = (float)((axis.node_count - 1) / log2(1 + end * end)),
        };
        if (b > 0 && !merge_band(plan, band->spacing_mm, &samples[b - 1], &samples[b], status))
            return false;
        if (!render_splats_append(&batch->splats, &samples[b], batch->sample_count, &plan->camera,
                                  band->r_outer_mm, &profile, plan->has_grid ? 1 : RENDER_SPLAT_SAMPLES,
                                  status) ||
            !add_samples(batch, &samples[b], status))
            return false;
        *first_node += (size_t)axis.node_count;
    }
    return true;
}

static bool check_size(const struct batch *batch, dipole_status *status)
{
    GLint texel_limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texel_limit);
    return SAMPLE_TEXELS * batch->sample_count <= (size_t)texel_limit ||
           dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                       "%zu light samples, this OpenGL takes %d: a larger epsilon needs fewer",
                       batch->sample_count, texel_limit / SAMPLE_TEXELS);
}

static void draw_batch(struct render_splatter *splatter, const struct render_frame *frame,
                       const struct batch *batch)
{
    render_buffer_texture_fill(&splatter->sample_buffer, GL_RGBA32F, batch->texels,
                               batch->sample_count * SAMPLE_FLOATS * sizeof *batch->texels);
    render_bind_buffer(frame, "light_samples", UNIT_SAMPLES, &splatter->sample_buffer);
    render_bind_buffer(frame, "profile_table", UNIT_TABLE, &splatter->table_buffer);
    render_set_int(frame->program, "profile_last_node", RENDER_BAND_NODES - 1);
    glProgramUniform2f(frame->program, glGetUniformLocation(frame->program, "pixel"),
                       2.0F / (float)frame->plan->width_px, 2.0F / (float)frame->plan->height_px);
    glDeleteBuffers(1, &splatter->splat_buffer);
    glCreateBuffers(1, &splatter->splat_buffer);
    glNamedBufferStorage(splatter->splat_buffer,
                         (GLsizeiptr)(batch->splats.count * sizeof *batch->splats.splats),
                         batch->splats.splats, 0);
    glVertexArrayVertexBuffer(splatter->vertex_array, 0, splatter->splat_buffer, 0,
                              sizeof *batch->splats.splats);
    glBindVertexArray(splatter->vertex_array);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)batch->splats.count);
    render_count_draw(frame);
}

bool render_splatter_draw(struct render_splatter *splatter, const struct render_frame *frame,
                          dipole_status *status)
{
    const struct render_table *const tables = frame->tables;
    struct batch batch = { 0 };
    size_t first_node = 0;
    bool done = fill_table(splatter, frame, tables, status);
    for (size_t m = 0; done && m < splatter->medium_count; m++)
        done = add_medium(splatter, frame->plan, m, &tables[m], &first_node, &batch, status);
    done = done && check_size(&batch, status);
    splatter->splat_count += batch.splats.count;
    if (done && batch.splats.count > 0)
        draw_batch(splatter, frame, &batch);
    free(batch.texels);
    render_splats_destroy(&batch.splats);
    return done;
}

struct render_light_samples *render_splatter_samples(struct render_splatter *splatter, size_t medium)
{
    return &splatter->of_medium[medium].bands[0];
}

const struct render_light_samples *render_splatter_band(const struct render_splatter *splatter,
                                                        size_t medium, int band)
{
    return &splatter->of_medium[medium].bands[band];
}

size_t render_splatter_sample_count(const struct render_splatter *splatter)
{
    size_t count = splatter->dropped_count;
    for (size_t m = 0; m < splatter->medium_count; m++)
        count += splatter->of_medium[m].bands[0].count;
    return count;
}

size_t render_splatter_splat_count(const struct render_splatter *splatter)
{
    return splatter->splat_count;
}
