#include "renderer/environment_draw.h"

#include "renderer/environment_samples.h"
#include "renderer/splat_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { UNIT_HARMONICS = 15, UNIT_BEHIND = 14 };

/* Surfaces behind each other, front and back, at most. */
enum { LAYER_LIMIT = 64 };

struct render_sky {
    struct render_buffer_texture harmonics;
    struct render_tracer *tracer;
    GLuint behind; /* depths of the layer before */
    int behind_px;
};

bool render_sky_create(struct render_sky **sky_out, dipole_status *status)
{
    *sky_out = calloc(1, sizeof **sky_out);
    return *sky_out || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for an environment");
}

void render_sky_destroy(struct render_sky *sky)
{
    if (!sky)
        return;
    render_buffer_texture_destroy(&sky->harmonics);
    render_tracer_destroy(sky->tracer);
    if (sky->behind)
        glDeleteTextures(1, &sky->behind);
    free(sky);
}

/* ---- harmonics for shaders ---------------------------------------------------------------------- */

static size_t block_texels(int order)
{
    return (size_t)(order + 1) * (size_t)(order + 2);
}

/* Two texels for each degree l and order m, m by m: coefficients of cos and sin, and in w the factors of
 * the recurrence. common/harmonics.glsl reads them so. */
static void fill_block(const struct render_irradiance *irradiance, int order, float (*texels)[4])
{
    const struct render_harmonics *const harmonics = &irradiance->environment->harmonics;
    for (int m = 0; m <= order; m++) {
        const double norm = m > 0 ? sqrt(2.0) : 1;
        for (int l = m; l <= order; l++, texels += 2) {
            for (int c = 0; c < 3 && l <= irradiance->order; c++) {
                texels[0][c] = (float)(norm * irradiance->coefficients[render_harmonic_index(l, m)][c]);
                texels[1][c] =
                    m > 0 ? (float)(norm * irradiance->coefficients[render_harmonic_index(l, -m)][c]) : 0;
            }
            texels[0][3] = (float)harmonics->rise[render_legendre_index(l, m)];
            texels[1][3] = (float)harmonics->fall[render_legendre_index(l, m)];
        }
    }
}

/* A block for each object, or one where they are not told apart. */
bool render_sky_upload(const struct render_frame *frame, dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    const size_t count = plan->has_object_ids ? plan->media->object_count : 1,
                 block = block_texels(plan->environment_order);
    struct render_sky *sky;
    if (!render_executor_need_sky(frame, &sky, status))
        return false;
    float(*const texels)[4] = calloc(count * block, sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the harmonics of %zu objects",
                           count);
    for (size_t i = 0; i < count; i++) {
        const struct render_irradiance *const irradiance = plan->irradiance[plan->objects[i].medium];
        if (irradiance)
            fill_block(irradiance, plan->environment_order, texels + i * block);
    }
    render_buffer_texture_fill(&sky->harmonics, GL_RGBA32F, texels, count * block * sizeof *texels);
    free(texels);
    return true;
}

void render_sky_bind(const struct render_frame *frame)
{
    struct render_sky *const sky = render_executor_sky(frame->executor);
    render_bind_buffer(frame, "harmonics", UNIT_HARMONICS, &sky->harmonics);
    render_set_int(frame->program, "harmonics_order", frame->plan->environment_order);
    render_set_int(frame->program, "harmonics_block",
                   frame->plan->has_object_ids ? (int)block_texels(frame->plan->environment_order) : 0);
    render_set_medium(frame->program, frame->plan);
}

/* ---- samples ------------------------------------------------------------------------------------ */

bool render_sky_plant(const struct render_frame *frame, dipole_status *status)
{
    struct render_sky *sky;
    if (!render_executor_need_sky(frame, &sky, status))
        return false;
    bool is_stale = !sky->tracer;
    for (size_t i = 0; i < frame->request->scene->object_count; i++)
        is_stale |= frame->request->scene->objects[i].motion != NULL;
    if (!is_stale)
        return true;
    render_tracer_destroy(sky->tracer);
    sky->tracer = NULL;
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
    double min_mm[3];
    for (int k = 0; k < 3; k++)
        min_mm[k] = planned->ball.centre_mm[k] - planned->ball.radius_mm;
    return render_patches_create(frame->plan->irradiance[planned->medium], min_mm, planned->spacing_mm,
                                 patches, status);
}

static bool finish_object(const struct render_frame *frame, size_t object, struct render_patches *patches,
                          dipole_status *status)
{
    const struct render_plan_object *const planned = &frame->plan->objects[object];
    const struct render_sky *const sky = render_executor_sky(frame->executor);
    const int ray_count = frame->request->ambient_visibility;
    struct render_splatter *splatter;
    struct render_visibility *visibility = NULL;
    bool done = render_executor_need_splatter(frame, &splatter, status);
    if (done && ray_count > 0)
        done = render_visibility_create(sky->tracer, frame->plan->environment,
                                        frame->plan->media->media[planned->medium].eta, ray_count,
                                        &visibility, status);
    done =
        done && render_patches_finish(patches, frame->plan->has_object_ids ? (float)object : 0, visibility,
                                      render_splatter_samples(splatter, planned->medium), status);
    render_visibility_destroy(visibility);
    return done;
}

bool render_sky_sample(const struct render_frame *frame, dipole_status *status)
{
    bool done = true;
    for (size_t i = 0; done && i < frame->plan->media->object_count; i++) {
        struct render_patches *patches = NULL;
        if (!is_sampled(frame->plan, i))
            continue;
        done = begin_object(frame, i, &patches, status) &&
               render_patches_add_mesh(patches, frame->request->scene->objects[i].mesh, status) &&
               finish_object(frame, i, patches, status);
        render_patches_destroy(patches);
    }
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
        struct render_patch patch = { .area_mm2 = layer->texel_mm2 / fabs(cosine),
                                      .extent_mm = texel_mm / fabs(cosine) };
        for (int k = 0; k < 3; k++) {
            patch.position_mm[k] = (double)position[k];
            patch.normal[k] = (double)normal[k];
            patch.facet_normal[k] = (double)normal[k];
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
    for (size_t i = 0; done && i < frame->plan->media->object_count; i++) {
        if (is_sampled(frame->plan, i))
            done = peel_object(frame, i, &layer, status);
    }
    free(layer.positions);
    free(layer.normals);
    return done;
}
