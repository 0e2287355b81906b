#include "renderer/tsm_draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nodes of the exact response along the depth: linear between them errs by some 1e-5. */
enum { FACTOR_NODES = 2049 };

/* Texels of the form of T30 by distance and cosine. */
enum { FORM_DISTANCES = 256, FORM_COSINES = 128 };

/* Of one medium. */
struct medium_tables {
    const struct lut_tsm *lut; /* that the textures hold; NULL: none */
    GLuint volume, form;
    struct render_buffer_texture pattern, kernel;
    const struct lut_tsm *exact_lut; /* the same of the sources */
    struct render_buffer_texture sources, factors;
    int source_counts[IO_CHANNEL_COUNT];
};

struct render_tsm {
    size_t medium_count;
    struct medium_tables *of_medium;
    GLuint vertices;
    GLuint layers;
    int layer_count, layer_side_px;
};

bool render_tsm_create(const struct render_media *media, struct render_tsm **tsm_out, dipole_status *status)
{
    struct render_tsm *const tsm = calloc(1, sizeof *tsm);
    *tsm_out = NULL;
    if (tsm) {
        tsm->medium_count = media->count;
        tsm->of_medium = calloc(media->count, sizeof *tsm->of_medium);
    }
    if (tsm && tsm->of_medium) {
        *tsm_out = tsm;
        return true;
    }
    free(tsm);
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the volumes of %zu media",
                       media->count);
}

static void delete_texture(GLuint *texture)
{
    if (*texture)
        glDeleteTextures(1, texture);
    *texture = 0;
}

void render_tsm_destroy(struct render_tsm *tsm)
{
    if (!tsm)
        return;
    for (size_t m = 0; m < tsm->medium_count; m++) {
        struct medium_tables *const tables = &tsm->of_medium[m];
        delete_texture(&tables->volume);
        delete_texture(&tables->form);
        render_buffer_texture_destroy(&tables->pattern);
        render_buffer_texture_destroy(&tables->kernel);
        render_buffer_texture_destroy(&tables->sources);
        render_buffer_texture_destroy(&tables->factors);
    }
    delete_texture(&tsm->vertices);
    delete_texture(&tsm->layers);
    free(tsm->of_medium);
    free(tsm);
}

/* ---- tables ------------------------------------------------------------------------------------- */

static size_t medium_of(const struct render_frame *frame)
{
    return frame->plan->objects[frame->view->object].medium;
}

static GLuint volume_create(const struct lut_tsm *lut)
{
    GLuint texture;
    glCreateTextures(GL_TEXTURE_3D, 1, &texture);
    glTextureStorage3D(texture, 1, GL_RGB32F, lut->size[0], lut->size[1], lut->size[2]);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, lut->size[0] * lut->size[2]); /* slices stand side by side */
    for (int r = 0; r < lut->size[2]; r++) {
        glPixelStorei(GL_UNPACK_SKIP_PIXELS, r * lut->size[0]);
        glTextureSubImage3D(texture, 0, 0, 0, r, lut->size[0], lut->size[1], 1, GL_RGB, GL_FLOAT, lut->rgb);
    }
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    glPixelStorei(GL_UNPACK_SKIP_PIXELS, 0);
    return texture;
}

static void pattern_fill(const struct lut_tsm *lut, struct render_buffer_texture *pattern)
{
    float texels[LUT_TSM_SAMPLE_LIMIT][4];
    for (int i = 0; i < lut->sample_count; i++) {
        const struct lut_tsm_sample *const sample = &lut->samples[i];
        texels[i][0] = (float)sample->offset_mm[0];
        texels[i][1] = (float)sample->offset_mm[1];
        texels[i][2] = (float)sample->width_mm;
        texels[i][3] = (float)sample->area_mm2;
    }
    render_buffer_texture_fill(pattern, GL_RGBA32F, texels, (size_t)lut->sample_count * sizeof *texels);
}

/* How far a sample may lie. */
static double form_reach_mm(const struct lut_tsm *lut)
{
    return 2 * lut->depth_max_mm;
}

/* Row after row of one cosine, -1 to 1; distances scale sinh(u asinh(reach/scale)). */
static bool form_create(const struct lut_tsm *lut, const struct lut_tsm_exact *exact, GLuint *texture_out,
                        dipole_status *status)
{
    float(*const texels)[FORM_DISTANCES][3] = calloc(FORM_COSINES, sizeof *texels);
    double cosines[FORM_COSINES], values[FORM_COSINES];
    const double scale_mm = lut->local_depth_scale_mm, end = asinh(form_reach_mm(lut) / scale_mm);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a local response");
    for (int i = 0; i < FORM_COSINES; i++)
        cosines[i] = 2.0 * i / (FORM_COSINES - 1) - 1;
    for (int k = 0; k < FORM_DISTANCES; k++) {
        const double distance_mm = scale_mm * sinh(end * k / (FORM_DISTANCES - 1));
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            dipole_sources_profile_per_mm2(&exact->sources[c], distance_mm, cosines, FORM_COSINES, values);
            for (int i = 0; i < FORM_COSINES; i++)
                texels[i][k][c] = (float)values[i];
        }
    }
    glCreateTextures(GL_TEXTURE_2D, 1, texture_out);
    glTextureStorage2D(*texture_out, 1, GL_RGB32F, FORM_DISTANCES, FORM_COSINES);
    glTextureSubImage2D(*texture_out, 0, 0, 0, FORM_DISTANCES, FORM_COSINES, GL_RGB, GL_FLOAT, texels);
    glTextureParameteri(*texture_out, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(*texture_out, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(*texture_out, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(*texture_out, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    free(texels);
    return true;
}

/* Of each cell of the local response, its mean over what it is at the middle, times its area. */
static void kernel_fill(const struct lut_tsm *lut, const struct lut_tsm_exact *exact,
                        struct render_buffer_texture *kernel)
{
    enum { SIDE = LUT_TSM_LOCAL_SIDE };
    const double cell_mm = lut->inner_mm / SIDE, flat = 0;
    float texels[SIDE * SIDE][4] = { 0 };
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int x = i % SIDE - SIDE / 2, y = i / SIDE - SIDE / 2;
        double mean[IO_CHANNEL_COUNT];
        lut_tsm_local_kernel(lut, x, y, mean);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            double middle;
            dipole_sources_profile_per_mm2(&exact->sources[c], cell_mm * sqrt(x * x + y * y), &flat, 1,
                                           &middle);
            texels[i][c] = middle > 0 ? (float)(mean[c] / middle * cell_mm * cell_mm) : 0;
        }
    }
    render_buffer_texture_fill(kernel, GL_RGBA32F, texels, sizeof texels);
}

static bool local_fill(const struct lut_tsm *lut, struct medium_tables *tables, dipole_status *status)
{
    struct lut_tsm_exact *exact = NULL;
    const bool is_done =
        lut_tsm_exact_create(lut, 2, &exact, status) && form_create(lut, exact, &tables->form, status);
    if (is_done)
        kernel_fill(lut, exact, &tables->kernel);
    lut_tsm_exact_destroy(exact);
    return is_done;
}

bool render_tsm_use_volume(const struct render_frame *frame, dipole_status *status)
{
    struct render_tsm *tsm;
    if (!render_executor_need_tsm(frame, &tsm, status))
        return false;
    const size_t medium = medium_of(frame);
    struct medium_tables *const tables = &tsm->of_medium[medium];
    if (tables->lut != frame->volumes[medium]) {
        const struct lut_tsm *const lut = frame->volumes[medium];
        delete_texture(&tables->volume);
        delete_texture(&tables->form);
        tables->lut = NULL;
        if (!local_fill(lut, tables, status))
            return false;
        tables->volume = volume_create(lut);
        pattern_fill(lut, &tables->pattern);
        tables->lut = lut;
    }
    render_executor_hand_on(frame->executor, "tsm_form", tables->form);
    render_executor_hand_on(frame->executor, "tsm_kernel", tables->kernel.texture);
    render_executor_hand_on(frame->executor, "tsm_volume", tables->volume);
    render_executor_hand_on(frame->executor, "tsm_pattern", tables->pattern.texture);
    return true;
}

/* Channel after channel: depth, weight/(2 pi), sigma_tr, and the lobe's steepness at its own depth. */
static bool sources_fill(const struct lut_tsm_exact *exact, struct render_buffer_texture *buffer,
                         dipole_status *status)
{
    float(*const texels)[4] = calloc(IO_CHANNEL_COUNT * DIPOLE_SOURCE_LIMIT, sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a medium's sources");
    for (size_t c = 0; c < IO_CHANNEL_COUNT; c++) {
        for (size_t k = 0; k < exact->sources[c].count; k++) {
            const dipole_source *const source = &exact->sources[c].at[k];
            const double x = source->sigma_tr_per_mm * fabs(source->depth_mm);
            float *const texel = texels[c * DIPOLE_SOURCE_LIMIT + k];
            texel[0] = (float)source->depth_mm;
            texel[1] = (float)(source->weight / (2 * acos(-1)));
            texel[2] = (float)source->sigma_tr_per_mm;
            texel[3] = (float)(0.5 * (2 + x + 1 / (1 + x))); /* b of theory.md T30 */
        }
    }
    render_buffer_texture_fill(buffer, GL_RGBA32F, texels,
                               IO_CHANNEL_COUNT * DIPOLE_SOURCE_LIMIT * sizeof *texels);
    free(texels);
    return true;
}

static bool exact_fill(struct medium_tables *tables, const struct lut_tsm *lut, dipole_status *status)
{
    struct lut_tsm_exact *exact = NULL;
    bool is_done = lut_tsm_exact_create(lut, FACTOR_NODES, &exact, status);
    if (is_done) {
        const size_t count = (size_t)lut->sample_count * FACTOR_NODES * IO_CHANNEL_COUNT;
        render_buffer_texture_fill(&tables->factors, GL_RGB32F, exact->rgb, count * sizeof *exact->rgb);
        is_done = sources_fill(exact, &tables->sources, status);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            tables->source_counts[c] = (int)exact->sources[c].count;
    }
    lut_tsm_exact_destroy(exact);
    return is_done;
}

bool render_tsm_use_sources(const struct render_frame *frame, dipole_status *status)
{
    struct render_tsm *tsm;
    if (!render_executor_need_tsm(frame, &tsm, status))
        return false;
    const size_t medium = medium_of(frame);
    struct medium_tables *const tables = &tsm->of_medium[medium];
    if (tables->exact_lut != frame->volumes[medium]) {
        tables->exact_lut = NULL;
        if (!exact_fill(tables, frame->volumes[medium], status))
            return false;
        tables->exact_lut = frame->volumes[medium];
    }
    render_executor_hand_on(frame->executor, "tsm_sources", tables->sources.texture);
    render_executor_hand_on(frame->executor, "tsm_factors", tables->factors.texture);
    return true;
}

/* ---- vertices ----------------------------------------------------------------------------------- */

bool render_tsm_use_vertices(const struct render_frame *frame, dipole_status *status)
{
    const struct io_scene *const scene = frame->request->scene;
    const size_t rows = (frame->plan->vertex_count + RENDER_VERTEX_ROW - 1) / RENDER_VERTEX_ROW;
    struct render_tsm *tsm;
    if (!render_executor_need_tsm(frame, &tsm, status))
        return false;
    bool is_stale = !tsm->vertices;
    for (size_t i = 0; i < scene->object_count; i++)
        is_stale |= scene->objects[i].motion != NULL;
    if (is_stale) {
        delete_texture(&tsm->vertices);
        float(*const texels)[4] = calloc(rows * RENDER_VERTEX_ROW, sizeof *texels);
        if (!texels)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu vertices",
                               frame->plan->vertex_count);
        size_t next = 0;
        for (size_t i = 0; i < scene->object_count; i++) {
            for (size_t v = 0; v < scene->objects[i].mesh->vertex_count; v++, next++) {
                memcpy(texels[next], &scene->objects[i].mesh->positions[3 * v], 3 * sizeof **texels);
                texels[next][3] = (float)(i + 1);
            }
        }
        glCreateTextures(GL_TEXTURE_2D, 1, &tsm->vertices);
        glTextureStorage2D(tsm->vertices, 1, GL_RGBA32F, RENDER_VERTEX_ROW, (GLsizei)rows);
        glTextureSubImage2D(tsm->vertices, 0, 0, 0, RENDER_VERTEX_ROW, (GLsizei)rows, GL_RGBA, GL_FLOAT,
                            texels);
        free(texels);
    }
    render_executor_hand_on(frame->executor, "tsm_vertices", tsm->vertices);
    return true;
}

/* ---- layers ------------------------------------------------------------------------------------- */

static void layers_want(struct render_tsm *tsm, int layer_count, int side_px)
{
    if (tsm->layers && tsm->layer_count == layer_count && tsm->layer_side_px == side_px)
        return;
    delete_texture(&tsm->layers);
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &tsm->layers);
    glTextureStorage3D(tsm->layers, 1, GL_R32F, side_px, side_px, layer_count);
    glTextureParameteri(tsm->layers, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(tsm->layers, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    tsm->layer_count = layer_count;
    tsm->layer_side_px = side_px;
}

bool render_tsm_peel(const struct render_frame *frame, dipole_status *status)
{
    struct render_tsm *tsm;
    if (!render_executor_need_tsm(frame, &tsm, status))
        return false;
    const int layer_count = frame->request->tsm.layer_count;
    const float none[4] = { 1e30f, 1e30f, 1e30f, 1e30f }, farthest = 1;
    GLint framebuffer;
    layers_want(tsm, layer_count, render_plan_map_side_px(frame->plan));
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
    for (int layer = 0; layer < layer_count; layer++) {
        glNamedFramebufferTextureLayer((GLuint)framebuffer, GL_COLOR_ATTACHMENT0, tsm->layers, 0, layer);
        glClearNamedFramebufferfv((GLuint)framebuffer, GL_COLOR, 0, none);
        glClearNamedFramebufferfv((GLuint)framebuffer, GL_DEPTH, 0, &farthest);
        glBindTextureUnit(0, tsm->layers); /* one layer is read, another written */
        render_set_int(frame->program, "tsm_layers", 0);
        render_set_int(frame->program, "layer", layer);
        render_draw_object(frame, frame->view->object);
        glTextureBarrier();
    }
    render_executor_hand_on(frame->executor, "tsm_layers", tsm->layers);
    return true;
}

/* ---- uniforms ----------------------------------------------------------------------------------- */

void render_tsm_set_map(const struct render_frame *frame)
{
    const struct render_plan_view *const map = frame->view;
    const GLuint program = frame->program;
    render_set_light(program, &frame->request->scene->lights[map->light]);
    render_set_matrix(program, "map_view_projection", &map->projection);
    render_set_vec3(program, "map_right", map->projection.right);
    render_set_vec3(program, "map_up", map->projection.up);
    render_set_vec3(program, "map_forward", map->projection.forward);
    render_set_vec3(program, "map_centre_mm", frame->plan->objects[map->object].ball.centre_mm);
    render_set_vec3(program, "map_eye_mm", map->projection.eye_mm);
    render_set_float(program, "map_size_px", map->size_px);
    render_set_float(program, "map_texture_px", render_plan_map_side_px(frame->plan));
    render_set_float(program, "map_texel_mm", 2 * map->projection.half_width / map->size_px);
    render_set_int(program, "map_cube_face", map->is_cube_face ? map->face : -1);
    render_set_float(program, "map_object", (double)map->object + 1);
    render_set_int(program, "map_layer_count", frame->request->tsm.layer_count);
}

static void set_table(GLuint program, const struct lut_tsm *lut)
{
    glProgramUniform3i(program, glGetUniformLocation(program, "tsm_table.size"), lut->size[0], lut->size[1],
                       lut->size[2]);
    render_set_float(program, "tsm_table.depth_scale_mm", lut->depth_scale_mm);
    render_set_float(program, "tsm_table.depth_max_mm", lut->depth_max_mm);
    render_set_vec3(program, "tsm_table.scale", lut->scale);
    render_set_float(program, "local_width_mm", lut->inner_mm / LUT_TSM_LOCAL_SIDE);
    render_set_float(program, "form_scale_mm", lut->local_depth_scale_mm);
    render_set_float(program, "form_reach_mm", form_reach_mm(lut));
    render_set_float(program, "inner_mm", lut->inner_mm);
}

void render_tsm_set_response(const struct render_frame *frame)
{
    const size_t index = medium_of(frame);
    const struct render_medium *const medium = &frame->plan->media->media[index];
    const struct lut_tsm *const lut = frame->volumes[index];
    const struct render_tsm *const tsm = render_executor_tsm(frame->executor);
    const int *const counts = tsm->of_medium[index].source_counts;
    double shortest_mm = INFINITY, decay_per_mm[IO_CHANNEL_COUNT] = { 0 };
    glProgramUniform3i(frame->program, glGetUniformLocation(frame->program, "tsm_source_counts"), counts[0],
                       counts[1], counts[2]);
    set_table(frame->program, lut);
    render_set_int(frame->program, "tsm_sample_count", lut->sample_count);
    render_set_int(frame->program, "tsm_factor_nodes", FACTOR_NODES);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_coefficients *const top = dipole_stack_coefficients(medium->stacks[c], 0);
        decay_per_mm[c] = top->sigma_tr_per_mm;
        if (medium->diffuse_reflectance[c] > 0)
            shortest_mm = fmin(shortest_mm, top->mean_free_path_mm);
    }
    render_set_vec3(frame->program, "tsm_decay_per_mm", decay_per_mm);
    render_set_float(frame->program, "mean_free_path_mm", shortest_mm);
}

int render_tsm_source_count(const struct render_frame *frame)
{
    const int *const counts =
        render_executor_tsm(frame->executor)->of_medium[medium_of(frame)].source_counts;
    return counts[0] + counts[1] + counts[2];
}

const char *render_tsm_unsampled_reason(const struct render_request *request,
                                        const struct render_plan *plan)
{
    const char *const idle = render_tsm_idle_reason(request, plan);
    const bool is_all_texels =
        request->tsm.response == RENDER_TSM_TEXELS || request->tsm.response == RENDER_TSM_PROFILE;
    return idle ? idle : is_all_texels ? "all texels are summed" : NULL;
}

const char *render_tsm_idle_reason(const struct render_request *request, const struct render_plan *plan)
{
    if (request->is_captured)
        return "captured without scattering";
    if (plan->technique != RENDER_TECHNIQUE_TSM)
        return "technique is not tsm";
    if (plan->lit_count == 0)
        return "no light shines";
    return plan->map_count > 0 ? NULL : "no channel scatters";
}
