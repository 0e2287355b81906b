#include "renderer/gather_gl.h"

#include "renderer/gather_records.h"

#include <stdlib.h>
#include <string.h>

enum {
    UNIT_SOURCES = 12,
    UNIT_KERNELS,
    UNIT_WORDS,
    UNIT_LEVELS,
    ROWS_AT_ONCE = 64, /* of tiles: bounds what their lists take */
    SOURCE_TEXELS = 3,
    KERNEL_TEXELS = 2 + RENDER_GATHER_PIECES * IO_CHANNEL_COUNT,
};

struct render_gather_gl {
    GLuint vertex_array, tile_buffer;
    struct render_buffer_texture sources, kernels, words;
    GLuint levels;     /* from 1 on, one above the other; 0: there were none yet */
    int width, height; /* of that texture */
    struct render_gather_records records;
};

bool render_gather_gl_create(struct render_gather_gl **gl_out, dipole_status *status)
{
    struct render_gather_gl *const gl = calloc(1, sizeof *gl);
    *gl_out = gl;
    if (!gl)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather by OpenGL");
    glCreateVertexArrays(1, &gl->vertex_array);
    for (GLuint i = 0; i < 2; i++) {
        glVertexArrayAttribIFormat(gl->vertex_array, i, 4, GL_INT, 4 * i * (GLuint)sizeof(int32_t));
        glVertexArrayAttribBinding(gl->vertex_array, i, 0);
        glEnableVertexArrayAttrib(gl->vertex_array, i);
    }
    return true;
}

void render_gather_gl_destroy(struct render_gather_gl *gl)
{
    if (!gl)
        return;
    glDeleteVertexArrays(1, &gl->vertex_array);
    glDeleteBuffers(1, &gl->tile_buffer);
    glDeleteTextures(1, &gl->levels);
    render_buffer_texture_destroy(&gl->sources);
    render_buffer_texture_destroy(&gl->kernels);
    render_buffer_texture_destroy(&gl->words);
    render_gather_records_end(&gl->records);
    free(gl);
}

/* ---- buffers ------------------------------------------------------------------------------------ */

static bool fill(struct render_buffer_texture *buffer, GLenum format, size_t texel_size, const void *texels,
                 size_t count, const char *what, dipole_status *status)
{
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
    if (count > (size_t)limit)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "%s take %zu texels, this OpenGL has buffers of %d: gather in C (--gather c)",
                           what, count, limit);
    render_buffer_texture_fill(buffer, format, texels, count * texel_size);
    return true;
}

/* Position and flux's red; flux's green and blue, and spread: xx yy zz yz zx xy. first_groups: by
 * render_gather_band_number. */
static bool fill_sources(struct render_gather_gl *gl, const struct render_gather_request *request,
                         uint32_t *first_groups, dipole_status *status)
{
    size_t group_count = 0;
    for (size_t o = 0; o < request->object_count; o++) {
        const struct render_gather_sources *const sources = request->objects[o].sources;
        for (int b = 0; sources && b < sources->band_count; b++) {
            first_groups[render_gather_band_number(o, b)] = (uint32_t)group_count;
            group_count += sources->levels[b].group_count;
        }
    }
    if (group_count > RENDER_GATHER_GROUP_LIMIT)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "%zu groups of light samples, by OpenGL at most %zu: gather in C (--gather c)",
                           group_count, RENDER_GATHER_GROUP_LIMIT);
    _Static_assert(sizeof(struct render_gather_source) == SOURCE_TEXELS * 4 * sizeof(float),
                   "sources are texels");
    const size_t of_group = RENDER_GATHER_LANES * sizeof(struct render_gather_source);
    char *const texels = malloc(group_count * of_group + 1), *next = texels;
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu groups of light samples",
                           group_count);
    for (size_t o = 0; o < request->object_count; o++) {
        const struct render_gather_sources *const sources = request->objects[o].sources;
        for (int b = 0; sources && b < sources->band_count; b++) {
            for (size_t g = 0; g < sources->levels[b].group_count; g++, next += of_group)
                memcpy(next, sources->levels[b].groups[g].sources, of_group);
        }
    }
    const bool done = group_count == 0 ||
                      fill(&gl->sources, GL_RGBA32F, 4 * sizeof(float), texels,
                           group_count * RENDER_GATHER_LANES * SOURCE_TEXELS, "light samples", status);
    free(texels);
    return done;
}

static void write_kernel(const struct render_gather_kernel *kernel, float *texels)
{
    texels[0] = kernel->inverse_per_mm2;
    texels[1] = kernel->reach2_mm2;
    texels[2] = kernel->averaged_mm2;
    memcpy(texels + 4, kernel->lost_per_mm2, sizeof kernel->lost_per_mm2);
    for (int p = 0; p < RENDER_GATHER_PIECES; p++) {
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            for (int k = 0; k < RENDER_GATHER_TERMS; k++)
                texels[4 * (2 + IO_CHANNEL_COUNT * p + c) + k] = kernel->terms[c][k][p];
        }
    }
}

static bool fill_kernels(struct render_gather_gl *gl, const struct render_gather_request *request,
                         dipole_status *status)
{
    const size_t count = request->object_count * RENDER_BAND_LIMIT, of_kernel = (size_t)4 * KERNEL_TEXELS;
    float *const texels = calloc(count + 1, of_kernel * sizeof *texels);
    if (!texels)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu bands", count);
    for (size_t o = 0; o < request->object_count; o++) {
        const struct render_gather_medium *const medium = request->objects[o].medium;
        for (int b = 0; medium && b < medium->band_count; b++)
            write_kernel(&medium->kernels[b], texels + render_gather_band_number(o, b) * of_kernel);
    }
    const bool done = fill(&gl->kernels, GL_RGBA32F, 4 * sizeof(float), texels, count * KERNEL_TEXELS,
                           "profiles", status);
    free(texels);
    return done;
}

/* ---- levels ------------------------------------------------------------------------------------- */

static int tile_rows(const struct render_gather_nodes *level)
{
    return (level->height + RENDER_GATHER_TILE - 1) / RENDER_GATHER_TILE;
}

/* Room for all levels but the first, in whole tiles; first_rows: where each starts. */
static bool make_levels(struct render_gather_gl *gl, const struct render_gather_places_of_frame *places,
                        GLint first_rows[RENDER_GATHER_LEVELS], dipole_status *status)
{
    int width = 1, height = 0;
    for (int l = 1; l < places->level_count; l++) {
        first_rows[l] = height;
        width = places->levels[l].width > width ? places->levels[l].width : width;
        height += tile_rows(&places->levels[l]) * RENDER_GATHER_TILE;
    }
    if (height == 0 || (width <= gl->width && height <= gl->height))
        return true;
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
    if (width > limit || height > limit)
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "a picture of %dx%d needs a texture of %dx%d, this OpenGL has %d: gather in C "
                           "(--gather c)",
                           places->request->width_px, places->request->height_px, width, height, limit);
    glDeleteTextures(1, &gl->levels);
    glCreateTextures(GL_TEXTURE_2D, 1, &gl->levels);
    glTextureStorage2D(gl->levels, 1, GL_RGBA32F, width, height);
    glTextureParameteri(gl->levels, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(gl->levels, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glObjectLabel(GL_TEXTURE, gl->levels, -1, "gather_levels");
    gl->width = width;
    gl->height = height;
    return true;
}

/* Tiles are points as wide as they. Their middle may lie beyond the picture, but not beyond the viewport.
 */
static bool draw_rows(struct render_gather_gl *gl, const struct render_frame *frame,
                      const struct render_gather_nodes *level, int first_row, dipole_status *status)
{
    const struct render_gather_records *const records = &gl->records;
    if (records->tile_count == 0)
        return true;
    if (!fill(&gl->words, GL_R32UI, sizeof *records->words, records->words, records->word_count,
              "lists of light samples", status))
        return false;
    glDeleteBuffers(1, &gl->tile_buffer);
    glCreateBuffers(1, &gl->tile_buffer);
    glNamedBufferStorage(gl->tile_buffer, (GLsizeiptr)(records->tile_count * sizeof *records->tiles),
                         records->tiles, 0);
    glVertexArrayVertexBuffer(gl->vertex_array, 0, gl->tile_buffer, 0, sizeof *records->tiles);
    const int columns = (level->width + RENDER_GATHER_TILE - 1) / RENDER_GATHER_TILE,
              rows = tile_rows(level);
    glViewport(0, first_row, columns * RENDER_GATHER_TILE, rows * RENDER_GATHER_TILE);
    render_set_int(frame->program, "first_row", first_row);
    glProgramUniform2i(frame->program, glGetUniformLocation(frame->program, "tile_counts"), columns, rows);
    render_bind_buffer(frame, "words", UNIT_WORDS, &gl->words);
    glBindVertexArray(gl->vertex_array);
    glDrawArrays(GL_POINTS, 0, (GLsizei)records->tile_count);
    render_count_draw(frame);
    return true;
}

/* From the coarsest on: each is interpolated from those before it. */
static bool draw_levels(struct render_gather_gl *gl, const struct render_frame *frame,
                        const struct render_gather_places_of_frame *places, const uint32_t *first_groups,
                        dipole_status *status)
{
    GLint first_rows[RENDER_GATHER_LEVELS] = { 0 }, target;
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &target);
    if (!make_levels(gl, places, first_rows, status))
        return false;
    glProgramUniform1iv(frame->program, glGetUniformLocation(frame->program, "first_rows"),
                        RENDER_GATHER_LEVELS, first_rows);
    glBindTextureUnit(UNIT_LEVELS, gl->levels);
    render_set_int(frame->program, "levels", UNIT_LEVELS);
    glEnable(GL_PROGRAM_POINT_SIZE);
    GLuint framebuffer;
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, gl->levels, 0);
    bool done = true;
    for (int l = places->level_count - 1; done && l >= 0; l--) {
        const struct render_gather_nodes *const level = &places->levels[l];
        glBindFramebuffer(GL_FRAMEBUFFER, l > 0 ? framebuffer : (GLuint)target);
        for (int row = 0; done && row < tile_rows(level); row += ROWS_AT_ONCE) {
            const int end = row + ROWS_AT_ONCE < tile_rows(level) ? row + ROWS_AT_ONCE : tile_rows(level);
            done = render_gather_record(places, l, row, end, first_groups, &gl->records, status) &&
                   draw_rows(gl, frame, level, first_rows[l], status);
        }
        glTextureBarrier(); /* the next level reads what this one has drawn */
    }
    glDisable(GL_PROGRAM_POINT_SIZE);
    glDeleteFramebuffers(1, &framebuffer);
    return done;
}

bool render_gather_gl_draw(struct render_gather_gl *gl, const struct render_frame *frame,
                           const struct render_gather_request *request, dipole_status *status)
{
    struct render_gather_places_of_frame places;
    uint32_t *const first_groups =
        calloc(request->object_count + 1, RENDER_BAND_LIMIT * sizeof *first_groups);
    bool done = render_gather_places_init(request, &places, status);
    if (!first_groups)
        done = dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to gather for %zu objects",
                           request->object_count);
    done = done && fill_sources(gl, request, first_groups, status) && fill_kernels(gl, request, status);
    if (done) {
        render_bind_buffer(frame, "sources", UNIT_SOURCES, &gl->sources);
        render_bind_buffer(frame, "kernels", UNIT_KERNELS, &gl->kernels);
        done = draw_levels(gl, frame, &places, first_groups, status);
    }
    render_gather_places_end(&places);
    free(first_groups);
    return done;
}
