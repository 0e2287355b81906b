#include "renderer/environment_draw.h"

#include "renderer/environment_keep.h"
#include "renderer/environment_samples.h"
#include "renderer/splat_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UNIT_IRRADIANCE = 15, UNIT_BEHIND = 14 };

/* Surfaces behind each other, front and back, at most. */
enum { LAYER_LIMIT = 64 };

/* Whole numbers that a float holds. */
enum { EXACT_TEXELS = 1 << 24 };

/* The table of a medium, and its number among all that were made. */
struct medium_table {
    struct render_irradiance_table *table;
    uint64_t number;
};

struct render_sky {
    size_t medium_count;
    struct medium_table *of_medium;
    uint64_t table_count;
    struct render_buffer_texture nodes; /* for shaders: of as many tables, with object ids or without */
    uint64_t uploaded_count;
    bool is_by_object;
    struct render_keep *keep;
    struct render_tracer *tracer;
    uint64_t planted; /* changes of shape that the tracer knows */
    GLuint behind;    /* depths of the layer before */
    int behind_px;
};

bool render_sky_create(const struct render_media *media, struct render_sky **sky_out, dipole_status *status)
{
    *sky_out = NULL;
    struct render_sky *const sky = calloc(1, sizeof *sky);
    if (sky) {
        sky->medium_count = media->count;
        sky->of_medium = calloc(media->count + 1, sizeof *sky->of_medium);
    }
    if (!sky || !sky->of_medium) {
        render_sky_destroy(sky);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for an environment");
    }
    if (!render_keep_create(media->object_count, &sky->keep, status)) {
        render_sky_destroy(sky);
        return false;
    }
    *sky_out = sky;
    return true;
}

void render_sky_destroy(struct render_sky *sky)
{
    if (!sky)
        return;
    for (size_t m = 0; sky->of_medium && m < sky->medium_count; m++)
        render_irradiance_table_destroy(sky->of_medium[m].table);
    free(sky->of_medium);
    render_buffer_texture_destroy(&sky->nodes);
    render_keep_destroy(sky->keep);
    render_tracer_destroy(sky->tracer);
    if (sky->behind)
        glDeleteTextures(1, &sky->behind);
    free(sky);
}

size_t render_sky_sampled_count(const struct render_sky *sky)
{
    return render_keep_count(sky->keep);
}

/* ---- tables ------------------------------------------------------------------------------------- */

static bool tabulate(struct render_sky *sky, size_t medium, const struct render_plan *plan,
                     dipole_status *status)
{
    const struct render_irradiance *const irradiance = plan->irradiance[medium];
    struct medium_table *const known = &sky->of_medium[medium];
    const double tolerance = plan->irradiance_tolerance;
    if (!irradiance || (known->table && render_irradiance_table_is_of(known->table, irradiance, tolerance)))
        return true;
    render_irradiance_table_destroy(known->table);
    known->number = ++sky->table_count;
    return render_irradiance_table_create(irradiance, tolerance, &known->table, status);
}

/* First two texels for each object, or one where they are not told apart: where its table begins, and its
 * rows. common/irradiance.glsl reads them so. */
static void fill_nodes(const struct render_sky *sky, const struct render_plan *plan, size_t object_count,
                       float (*texels)[4])
{
    size_t next = object_count;
    for (size_t m = 0; m < sky->medium_count; m++) {
        const struct render_irradiance_table *const table = sky->of_medium[m].table;
        if (!table)
            continue;
        memcpy(texels + next, table->nodes, table->node_count * sizeof *texels);
        for (size_t i = 0; i < object_count; i++) {
            if (plan->objects[i].medium == m) {
                texels[i][0] = (float)next;
                texels[i][1] = (float)table->rows;
            }
        }
        next += table->node_count;
    }
}

static bool check_size(size_t texel_count, dipole_status *status)
{
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
    return texel_count <= (size_t)(limit < EXACT_TEXELS ? limit : EXACT_TEXELS) ||
           dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                       "the environment's tables have %zu nodes, this OpenGL takes %d: a larger epsilon "
                       "needs fewer",
                       texel_count, limit);
}

static bool upload(const struct render_frame *frame, struct render_sky *sky, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    const size_t object_count = plan->has_object_ids ? plan->media->object_count : 1;
    size_t count = object_count;
    if (sky->uploaded_count == sky->table_count && sky->is_by_object == plan->has_object_ids)
        return true;
    for (size_t m = 0; m < sky->medium_count; m++)
        count += sky->of_medium[m].table ? sky->of_medium[m].table->node_count : 0;
    if (!check_size(count, status))
        return false;
    float(*const texels)[4] = calloc(count, sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu nodes of irradiance",
                           count);
    fill_nodes(sky, plan, object_count, texels);
    render_buffer_texture_fill(&sky->nodes, GL_RGBA32F, texels, count * sizeof *texels);
    free(texels);
    sky->uploaded_count = sky->table_count;
    sky->is_by_object = plan->has_object_ids;
    return true;
}

bool render_sky_tabulate(const struct render_frame *frame, dipole_status *status)
{
    struct render_sky *sky;
    bool done = render_executor_need_sky(frame, &sky, status);
    if (done)
        render_keep_watch(sky->keep, frame->request->scene);
    for (size_t m = 0; done && m < sky->medium_count; m++)
        done = tabulate(sky, m, frame->plan, status);
    if (done && frame->plan->technique == RENDER_TECHNIQUE_LAMBERT)
        done = upload(frame, sky, status);
    return done;
}

void render_sky_bind(const struct render_frame *frame)
{
    struct render_sky *const sky = render_executor_sky(frame->executor);
    render_bind_buffer(frame, "irradiance_nodes", UNIT_IRRADIANCE, &sky->nodes);
    render_set_int(frame->program, "irradiance_is_by_object", sky->is_by_object);
    render_set_medium(frame->program, frame->plan);
}

/* ---- samples ------------------------------------------------------------------------------------ */

bool render_sky_plant(const struct render_frame *frame, dipole_status *status)
{
    struct render_sky *sky;
    if (!render_executor_need_sky(frame, &sky, status))
        return false;
    if (sky->tracer && sky->planted == render_keep_changes(sky->keep))
        return true;
    render_tracer_destroy(sky->tracer);
    sky->tracer = NULL;
    sky->planted = render_keep_changes(sky->keep);
    return render_tracer_create(frame->request->scene, &sky->tracer, status);
}

/* Whether an object gets samples. */
static bool is_sampled(const struct render_plan *plan, size_t object)
{
    return plan->objects[object].spacing_mm > 0 && plan->irradiance[plan->objects[object].medium];
}

static bool begin_object(const struct render_frame *frame, size_t object, struct render_patches **patches,
                         dipole_status *status)
{
    const struct render_plan_object *const planned = &frame->plan->objects[object];
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    double min_mm[3];
    for (int k = 0; k < 3; k++)
        min_mm[k] = planned->ball.centre_mm[k] - planned->ball.radius_mm;
    return render_patches_create(sky->of_medium[planned->medium].table, min_mm, planned->spacing_mm,
                                 patches, status);
}

static struct render_keep_key key_of(const struct render_frame *frame, size_t object)
{
    const struct render_plan *const plan = frame->plan;
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    const int ray_count = frame->request->ambient_visibility;
    return (struct render_keep_key){ .light = sky->of_medium[plan->objects[object].medium].number,
                                     .spacing_mm = plan->objects[object].spacing_mm,
                                     .way = frame->request->environment_samples,
                                     .object = plan->has_object_ids ? (float)object : 0,
                                     .ray_count = ray_count,
                                     .environment = ray_count > 0 ? plan->environment : NULL };
}

static bool finish_object(const struct render_frame *frame, size_t object, struct render_patches *patches,
                          dipole_status *status)
{
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    const struct render_medium *const medium =
        &frame->plan->media->media[frame->plan->objects[object].medium];
    const struct render_keep_key key = key_of(frame, object);
    struct render_visibility *visibility = NULL;
    const bool done =
        (key.ray_count == 0 || render_visibility_create(sky->tracer, frame->plan->environment, medium->eta,
                                                        key.ray_count, &visibility, status)) &&
        render_patches_finish(patches, key.object, visibility, render_keep_begin(sky->keep, object),
                              status);
    render_visibility_destroy(visibility);
    if (done)
        render_keep_end(sky->keep, object, &key);
    return done;
}

/* Hand an object's samples, which are there by now, to those that are drawn. */
static bool hand_on(const struct render_frame *frame, size_t object, dipole_status *status)
{
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    const struct render_keep_key key = key_of(frame, object);
    const struct render_light_samples *const kept = render_keep_find(sky->keep, object, &key);
    struct render_splatter *splatter;
    return render_executor_need_splatter(frame, &splatter, status) &&
           render_light_samples_add_all(
               render_splatter_samples(splatter, frame->plan->objects[object].medium), kept, status);
}

static bool sample_triangles(const struct render_frame *frame, size_t object, dipole_status *status)
{
    struct render_patches *patches = NULL;
    const bool done =
        begin_object(frame, object, &patches, status) &&
        render_patches_add_mesh(patches, frame->request->scene->objects[object].mesh, status) &&
        finish_object(frame, object, patches, status);
    render_patches_destroy(patches);
    return done;
}

/* ---- peeling ------------------------------------------------------------------------------------ */

/* A layer read back: position and whether there is a surface; normal and cosine of the facet to the axis.
 */
struct layer {
    float (*positions)[4], (*normals)[4];
    int size_px;
    double texel_mm2;
    struct render_projection projection;
};

/* An orthographic view along one axis that holds the object's ball. */
static struct render_projection view_along(const struct render_ball *ball, int axis)
{
    const double up[3] = { axis == 2 ? 1 : 0, axis == 0 ? 1 : 0, axis == 1 ? 1 : 0 };
    double forward[3] = { 0, 0, 0 };
    const double radius_mm = 1.01 * ball->radius_mm;
    struct render_projection projection = { .is_orthographic = true,
                                            .half_width = radius_mm,
                                            .half_height = radius_mm,
                                            .near_mm = radius_mm,
                                            .far_mm = 3 * radius_mm };
    forward[axis] = -1;
    render_projection_aim(&projection, forward, up);
    for (int k = 0; k < 3; k++)
        projection.eye_mm[k] = ball->centre_mm[k] - 2 * radius_mm * forward[k];
    return projection;
}

/* Add the texels of a layer as patches; how many there are, -1: failed. */
static long add_layer(const struct layer *layer, struct render_patches *patches, dipole_status *status)
{
    const size_t count = (size_t)layer->size_px * (size_t)layer->size_px;
    const double texel_mm = sqrt(layer->texel_mm2);
    long found = 0;
    for (size_t i = 0; i < count; i++) {
        const float *const position = layer->positions[i], *const normal = layer->normals[i];
        const double cosine = (double)normal[3];
        if (!(position[3] > 0))
            continue;
        found++;
        if (!(fabs(cosine) > 0)) /* another axis sees it better */
            continue;
        struct render_patch patch = { .area_mm2 = layer->texel_mm2 / fabs(cosine) };
        const float half_mm = (float)(0.5 * texel_mm / fabs(cosine));
        for (int k = 0; k < 3; k++) {
            patch.position_mm[k] = (double)position[k];
            patch.normal[k] = (double)normal[k];
            patch.facet_normal[k] = (double)normal[k];
            patch.min_mm[k] = position[k] - half_mm;
            patch.max_mm[k] = position[k] + half_mm;
        }
        if (!render_patches_add(patches, &patch, status))
            return -1;
    }
    return found;
}

static void read_layer(const struct render_frame *frame, struct layer *layer)
{
    const GLsizei size_px = layer->size_px;
    const size_t size = (size_t)size_px * (size_t)size_px * sizeof *layer->positions;
    glGetTextureSubImage(render_executor_texture(frame->executor, "peel_position_mm"), 0, 0, 0, 0, size_px,
                         size_px, 1, GL_RGBA, GL_FLOAT, (GLsizei)size, layer->positions);
    glGetTextureSubImage(render_executor_texture(frame->executor, "peel_normal"), 0, 0, 0, 0, size_px,
                         size_px, 1, GL_RGBA, GL_FLOAT, (GLsizei)size, layer->normals);
}

/* Nearest front faces, the nearest back faces behind them, the nearest front faces behind those, until
 * nothing is left. */
static bool peel_axis(const struct render_frame *frame, size_t object, int axis, struct layer *layer,
                      struct render_patches *patches, dipole_status *status)
{
    struct render_sky *const sky = render_executor_sky(frame->executor);
    const float none[4] = { 0 }, nearest = 0, farthest = 1;
    GLint framebuffer;
    layer->projection = view_along(&frame->plan->objects[object].ball, axis);
    const double texel_mm = 2 * layer->projection.half_width / layer->size_px;
    layer->texel_mm2 = texel_mm * texel_mm;
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
    glViewport(0, 0, layer->size_px, layer->size_px);
    glEnable(GL_CULL_FACE);
    glClearTexImage(sky->behind, 0, GL_DEPTH_COMPONENT, GL_FLOAT, &nearest);
    render_set_matrix(frame->program, "view_projection", &layer->projection);
    render_set_int(frame->program, "axis", axis);
    render_set_int(frame->program, "is_only_axis",
                   frame->request->environment_samples == RENDER_ENVIRONMENT_PEEL);
    long found = 1;
    for (int i = 0; i < LAYER_LIMIT && found > 0; i++) {
        glClearNamedFramebufferfv((GLuint)framebuffer, GL_COLOR, 0, none);
        glClearNamedFramebufferfv((GLuint)framebuffer, GL_COLOR, 1, none);
        glClearNamedFramebufferfv((GLuint)framebuffer, GL_DEPTH, 0, &farthest);
        glCullFace(i % 2 == 0 ? GL_BACK : GL_FRONT);
        glBindTextureUnit(UNIT_BEHIND, sky->behind);
        render_set_int(frame->program, "behind", UNIT_BEHIND);
        render_draw_object(frame, object);
        read_layer(frame, layer);
        found = add_layer(layer, patches, status);
        glCopyImageSubData(render_executor_texture(frame->executor, "peel_depth"), GL_TEXTURE_2D, 0, 0, 0,
                           0, sky->behind, GL_TEXTURE_2D, 0, 0, 0, 0, layer->size_px, layer->size_px, 1);
    }
    glCullFace(GL_BACK);
    glDisable(GL_CULL_FACE);
    return found >= 0;
}

static bool peel_object(const struct render_frame *frame, size_t object, struct layer *layer,
                        dipole_status *status)
{
    const bool is_single = frame->request->environment_samples == RENDER_ENVIRONMENT_PEEL;
    struct render_patches *patches = NULL;
    layer->size_px = render_plan_peel_side_px(frame->plan, object);
    bool done = begin_object(frame, object, &patches, status);
    for (int axis = 0; done && axis < 3; axis++) {
        if (!is_single || axis == RENDER_PEEL_AXIS)
            done = peel_axis(frame, object, axis, layer, patches, status);
    }
    done = done && finish_object(frame, object, patches, status);
    render_patches_destroy(patches);
    return done;
}

/* Of each object what is kept, else sampled anew: its triangles, or with layers to put them in peeled. */
static bool sample_objects(const struct render_frame *frame, struct layer *layer, dipole_status *status)
{
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    bool done = true;
    for (size_t i = 0; done && i < frame->plan->media->object_count; i++) {
        if (!is_sampled(frame->plan, i))
            continue;
        const struct render_keep_key key = key_of(frame, i);
        if (!render_keep_find(sky->keep, i, &key))
            done = layer ? peel_object(frame, i, layer, status) : sample_triangles(frame, i, status);
        done = done && hand_on(frame, i, status);
    }
    return done;
}

bool render_sky_sample(const struct render_frame *frame, dipole_status *status)
{
    return sample_objects(frame, NULL, status);
}

static void want_behind(struct render_sky *sky, int size_px)
{
    if (sky->behind && sky->behind_px == size_px)
        return;
    if (sky->behind)
        glDeleteTextures(1, &sky->behind);
    glCreateTextures(GL_TEXTURE_2D, 1, &sky->behind);
    glTextureStorage2D(sky->behind, 1, GL_DEPTH_COMPONENT32F, size_px, size_px);
    glTextureParameteri(sky->behind, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(sky->behind, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    sky->behind_px = size_px;
}

bool render_sky_peel(const struct render_frame *frame, dipole_status *status)
{
    const size_t side = (size_t)frame->plan->peel_side_px;
    struct render_sky *sky;
    if (!render_executor_need_sky(frame, &sky, status))
        return false;
    struct layer layer = { .positions = malloc(side * side * sizeof *layer.positions),
                           .normals = malloc(side * side * sizeof *layer.normals) };
    bool done = layer.positions && layer.normals;
    if (done)
        want_behind(sky, frame->plan->peel_side_px);
    else
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a layer of %zu texels a side", side);
    done = done && sample_objects(frame, &layer, status);
    free(layer.positions);
    free(layer.normals);
    return done;
}
