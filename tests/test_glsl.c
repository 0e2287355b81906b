/*
 * lutgen/glsl against the formulas of docs/engines.md: tables made here by those formulas, written as EXR,
 * DDS and raw, read back by a few lines that know only the documented layouts, and sampled by the shader
 * functions.
 */
#include "tests/glsl.h"

#include "io/half.h"
#include "lutgen/self_test.h"

/* ---- splat tables ---------------------------------------------------------------------------------- */

static const dipole_medium skin[3] = { { 0.032, 0.74, 1.3, DIPOLE_FDR_EXACT },
                                       { 0.17, 0.88, 1.3, DIPOLE_FDR_EXACT },
                                       { 0.48, 1.01, 1.3, DIPOLE_FDR_EXACT } };

/* A row of a table, and the attributes that a shader is given. */
struct row {
    double r_max_mm, scale_mm, power, falloff, scale[3];
};

/* Radius of u, the inverse of the documented mapping. */
static double row_radius(const struct row *row, double u)
{
    const double x = row->r_max_mm / row->scale_mm, w_max = 1 + x * x;
    const double w =
        row->power == 0 ? pow(w_max, u) : pow(1 + u * (pow(w_max, row->power) - 1), 1 / row->power);
    return row->scale_mm * sqrt(w - 1);
}

/* Fill a row of the image by the documented formula. */
static void row_fill(struct row *row, const dipole_coefficients coefficients[3], struct io_image *image,
                     int y, bool is_half)
{
    const int size = image->width_px;
    for (int c = 0; c < 3; c++) {
        double most = 0;
        for (int pass = 0; pass < 2; pass++) /* the largest, then the texels */
            for (int i = 0; i < size; i++) {
                const double r_mm = row_radius(row, (double)i / (size - 1)), x = r_mm / row->scale_mm;
                const double value =
                    dipole_rd_per_mm2(&coefficients[c], r_mm) * pow(1 + x * x, row->falloff);
                most = fmax(most, value);
                row->scale[c] = is_half ? exp2(floor(log2(most)) - 15) : 1.0; /* 2^15 to 2^16 */
                const float texel = (float)fmin(value / row->scale[c], 65504);
                image->pixels[(y * size + i) * 3 + c] =
                    is_half ? io_float_from_half(io_half_from_float(texel)) : texel;
            }
    }
}

/* The documented evaluation, in double. */
static double row_sample(const struct row *row, const struct io_image *image, int y, double r_mm,
                         int channel)
{
    if (r_mm > row->r_max_mm)
        return 0;
    const double x = r_mm / row->scale_mm, w = 1 + x * x, x_max = row->r_max_mm / row->scale_mm;
    const double w_max = 1 + x_max * x_max;
    const double u =
        row->power == 0 ? log(w) / log(w_max) : (pow(w, row->power) - 1) / (pow(w_max, row->power) - 1);
    const int size = image->width_px;
    const double at = u * (size - 1);
    const int i = at < size - 2 ? (int)at : size - 2;
    const float *const texel = image->pixels + (y * size + i) * 3 + channel;
    const double value = (1 - (at - i)) * (double)texel[0] + (at - i) * (double)texel[3];
    return value * row->scale[channel] * pow(w, -row->falloff);
}

static const char splat_answer[] =
    "uniform sampler2D texels;\n"
    "uniform float r_max_mm[2], scale_mm[2], power[2], falloff[2];\n"
    "uniform vec3 scale[2];\n"
    "vec3 answer(vec4 a, vec4 b) { int row = int(a.y);\n"
    "  return dipole_splat_rd_per_mm2(texels, dipole_splat(r_max_mm[row], scale_mm[row], power[row],\n"
    "                                                      falloff[row], scale[row], row), a.x); }\n";

static void set_row(GLuint program, int y, const struct row *row)
{
    char name[32];
#define NAMED(text) (snprintf(name, sizeof name, text "[%d]", y), name)
    render_set_float(program, NAMED("r_max_mm"), row->r_max_mm);
    render_set_float(program, NAMED("scale_mm"), row->scale_mm);
    render_set_float(program, NAMED("power"), row->power);
    render_set_float(program, NAMED("falloff"), row->falloff);
    render_set_vec3(program, NAMED("scale"), row->scale);
#undef NAMED
}

/* Radii over all of the row and some beyond it; its ends are among them. */
static void splat_queries(const struct row rows[2], int row_count, float queries[QUERY_COUNT * WORDS])
{
    struct rng rng = { .seed = 12 };
    for (int i = 0; i < QUERY_COUNT; i++) {
        const int y = i % row_count;
        const double r_max = rows[y].r_max_mm;
        queries[i * WORDS] = (float)(i < 4    ? 0
                                     : i < 8  ? (double)nextafterf((float)r_max, 0)
                                     : i < 16 ? 1.001 * r_max
                                     : i % 2  ? uniform(&rng, 0, r_max)
                                              : log_uniform(&rng, 1e-5 * r_max, r_max));
        queries[i * WORDS + 1] = (float)y;
    }
}

/*
 * Oracles: the table evaluated in double, which the shader's float follows within 1e-5; R_d itself, from
 * which 512 nodes on these axes differ by at most 4.5e-4, and half by its 2^-11 more; and that the three
 * kinds of file give the same, bit by bit.
 */
static void splat_glsl_is_the_documented_formula(void **state)
{
    (void)state;
    enum { SIZE = 512 };
    dipole_coefficients coefficients[3];
    for (int c = 0; c < 3; c++)
        assert_true(dipole_coefficients_init(&skin[c], &coefficients[c], NULL));
    const GLuint programs[2] = { program_create("#version 330 core\n", "", "splat.glsl", splat_answer),
                                 program_create("#version 450 core\n", "", "splat.glsl", splat_answer) };
    static float queries[QUERY_COUNT * WORDS], rgba[FILE_KIND_COUNT][QUERY_COUNT * 4];
    for (int variant = 0; variant < 16; variant++) {
        const bool is_half = variant & 1;
        const int row_count = variant & 2 ? 2 : 1;
        struct row rows[2] = {
            { 6.0, 0.3, variant & 4 ? 0.3 : 0, variant & 8 ? 1.5 : 0, { 0 } },
            { 9.0, 0.9, variant & 4 ? 0.004 : 0.3, variant & 8 ? 0.5 : 1, { 0 } },
        };
        struct io_image *image;
        assert_true(io_image_create(SIZE, row_count, 3, &image, NULL));
        for (int y = 0; y < row_count; y++)
            row_fill(&rows[y], coefficients, image, y, is_half);
        splat_queries(rows, row_count, queries);
        for (int kind = 0; kind < FILE_KIND_COUNT; kind++) {
            put_file((enum file_kind)kind, "splat", image, 1, is_half);
            const GLuint texture = load_file((enum file_kind)kind, "splat");
            const GLuint program = programs[kind % 2];
            for (int y = 0; y < row_count; y++)
                set_row(program, y, &rows[y]);
            ask(program, texture, queries, rgba[kind]);
            glDeleteTextures(1, &texture);
        }
        assert_memory_equal(rgba[FILE_EXR], rgba[FILE_DDS], sizeof rgba[0]);
        assert_memory_equal(rgba[FILE_EXR], rgba[FILE_RAW], sizeof rgba[0]);
        for (int i = 0; i < QUERY_COUNT; i++) {
            const int y = i % row_count;
            const double r_mm = (double)queries[i * WORDS];
            for (int c = 0; c < 3; c++) {
                const double found = (double)rgba[0][i * 4 + c];
                const double expected = row_sample(&rows[y], image, y, r_mm, c);
                assert_close(found, expected, 1e-5, "variant %d, channel %d, r %g", variant, c, r_mm);
                if (r_mm <= rows[y].r_max_mm)
                    assert_close(found, dipole_rd_per_mm2(&coefficients[c], r_mm),
                                 is_half ? 4.5e-4 + 0x1p-11 : 4.5e-4, "variant %d, channel %d, r %g",
                                 variant, c, r_mm);
            }
        }
        io_image_destroy(image);
    }
    for (int i = 0; i < 2; i++)
        glDeleteProgram(programs[i]);
}

/* ---- volumes ----------------------------------------------------------------------------------------- */

enum { TSM_S = 16, TSM_T = 24, TSM_R = 8, TSM_SAMPLES = 5, TSM_LOCAL = 5, TSM_FACTOR = 6 };

static const struct {
    double depth_scale_mm, depth_max_mm, local_width_mm, local_depth_scale_mm, inner_mm, scale[3];
} tsm = { 0.4, 30, 0.25, 0.2, 1.75, { 0.125, 2, 1 } };

static size_t tsm_at(int s, int t, int r, int channel)
{
    return ((size_t)t * TSM_S * TSM_R + (size_t)r * TSM_S + (size_t)s) * 3 + (size_t)channel;
}

/* A smooth volume, other in each slice and channel, with all that a table has. */
static struct io_image *tsm_create(bool is_half)
{
    struct io_image *image;
    assert_true(io_image_create(TSM_S * TSM_R, TSM_T, 3, &image, NULL));
    for (int r = 0; r < TSM_R; r++)
        for (int t = 0; t < TSM_T; t++)
            for (int s = 0; s < TSM_S; s++)
                for (int c = 0; c < 3; c++) {
                    const double x = (double)s / (TSM_S - 1), y = (double)t / (TSM_T - 1);
                    const float value =
                        (float)((1 + r) *
                                exp(sin(2.0 * x + c) - 8 * (y - 0.5) * (y - 0.5) * (1 + c) + 0.3 * r * x));
                    image->pixels[tsm_at(s, t, r, c)] =
                        is_half ? io_float_from_half(io_half_from_float(value)) : value;
                }
    lut_self_test_fill(image, TSM_R, is_half);
    return image;
}

/* Linear in s and t, counted in texels from the centre of the first. */
static double tsm_bilinear(const struct io_image *image, double s, double t, int r, int channel)
{
    const int i = s < TSM_S - 2 ? (int)s : TSM_S - 2, j = t < TSM_T - 2 ? (int)t : TSM_T - 2;
    const double f = s - i, g = t - j;
    const float *const p = image->pixels;
    return (1 - g) * ((1 - f) * (double)p[tsm_at(i, j, r, channel)] +
                      f * (double)p[tsm_at(i + 1, j, r, channel)]) +
           g * ((1 - f) * (double)p[tsm_at(i, j + 1, r, channel)] +
                f * (double)p[tsm_at(i + 1, j + 1, r, channel)]);
}

/* The documented evaluation of a query, in double. */
static double tsm_expected(const struct io_image *image, const float *query, int channel)
{
    const double dz_mm = (double)query[3];
    const int which = (int)query[7];
    if (fabs(dz_mm) > (which < 0 ? tsm.inner_mm : tsm.depth_max_mm))
        return 0;
    if (which < 0) {
        const int cell = -1 - which;
        const double kernel = (double)image->pixels[tsm_at(cell % 7, cell / 7, TSM_LOCAL, channel)];
        const double s = asinh(fabs(dz_mm) / tsm.local_depth_scale_mm) /
                         asinh(tsm.inner_mm / tsm.local_depth_scale_mm) * (TSM_S - 1);
        return kernel * tsm.scale[channel] * tsm_bilinear(image, s, dz_mm < 0, TSM_FACTOR, channel) *
               tsm.local_width_mm * tsm.local_width_mm;
    }
    const double t =
        (0.5 + 0.5 * asinh(dz_mm / tsm.depth_scale_mm) / asinh(tsm.depth_max_mm / tsm.depth_scale_mm)) *
        (TSM_T - 1);
    double dot = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        dot += (double)query[i] * (double)query[4 + i];
        square += (double)query[i] * (double)query[i];
    }
    const double cosine = square > 0 ? fmax(fmin(dot / sqrt(square), 1), -1) : 0;
    return tsm_bilinear(image, (0.5 + 0.5 * cosine) * (TSM_S - 1), t, which, channel) * tsm.scale[channel];
}

/* Normals and distances in all directions, the ends of both axes among them; delta 0; depths beyond the
 * end. */
static void tsm_queries(float queries[QUERY_COUNT * WORDS])
{
    struct rng rng = { .seed = 31 };
    for (int i = 0; i < QUERY_COUNT; i++) {
        float *const query = queries + i * WORDS;
        const double z = uniform(&rng, -1, 1), angle = uniform(&rng, 0, 6.283185307179586);
        const double normal[3] = { sqrt(1 - z * z) * cos(angle), sqrt(1 - z * z) * sin(angle), z };
        const double length_mm = log_uniform(&rng, 1e-3, 1e2);
        for (int k = 0; k < 3; k++) {
            query[4 + k] = (float)normal[k];
            query[k] = (float)(i % 8 == 0    ? length_mm * normal[k]
                               : i % 8 == 1  ? -length_mm * normal[k]
                               : i % 64 == 2 ? 0
                                             : length_mm * uniform(&rng, -1, 1));
        }
        const double dz_mm = log_uniform(&rng, 1e-4, tsm.depth_max_mm);
        query[3] = (float)(i % 32 == 0   ? tsm.depth_max_mm
                           : i % 32 == 1 ? -tsm.depth_max_mm
                           : i % 32 == 2 ? 1.001 * tsm.depth_max_mm
                           : i % 32 == 3 ? 0
                           : i % 2 == 0  ? dz_mm
                                         : -dz_mm);
        query[7] = (float)(i % 3 == 0 ? -1 - (int)(random_bits(&rng) % 49)
                                      : (int)(random_bits(&rng) % TSM_SAMPLES));
    }
}

static const char tsm_answer[] =
    "uniform DIPOLE_TSM_SAMPLER texels;\n"
    "uniform float depth_scale_mm, depth_max_mm, local_width_mm, local_depth_scale_mm, inner_mm;\n"
    "uniform vec3 scale;\n"
    "vec3 answer(vec4 a, vec4 b) {\n"
    "  dipole_tsm table = dipole_tsm(ivec3(16, 24, 8), depth_scale_mm, depth_max_mm, scale, 5, 6,\n"
    "                                local_width_mm, local_depth_scale_mm, inner_mm);\n"
    "  int which = int(b.w);\n"
    "  return which < 0 ? dipole_tsm_local(texels, table, ivec2((-1 - which) % 7, (-1 - which) / 7), a.w)\n"
    "                   : dipole_tsm_response_per_mm2(texels, table, which, a.xyz, b.xyz, a.w); }\n";

/* Oracle: the volume evaluated in double, which the shader's float follows within 1e-5, as a strip and as a
 * volume. */
static void tsm_glsl_is_the_documented_formula(void **state)
{
    (void)state;
    static const char *const versions[] = { "#version 330 core\n", "#version 450 core\n" };
    const GLuint strips[2] = {
        program_create(versions[0], "#define DIPOLE_TSM_STRIP\n", "tsm.glsl", tsm_answer),
        program_create(versions[1], "#define DIPOLE_TSM_STRIP\n", "tsm.glsl", tsm_answer)
    };
    const GLuint volumes[2] = { program_create(versions[0], "", "tsm.glsl", tsm_answer),
                                program_create(versions[1], "", "tsm.glsl", tsm_answer) };
    static float queries[QUERY_COUNT * WORDS], rgba[FILE_KIND_COUNT][QUERY_COUNT * 4];
    tsm_queries(queries);
    for (int is_half = 0; is_half < 2; is_half++) {
        struct io_image *const image = tsm_create(is_half);
        for (int kind = 0; kind < FILE_KIND_COUNT; kind++) {
            put_file((enum file_kind)kind, "tsm", image, TSM_R, is_half);
            const GLuint texture = load_file((enum file_kind)kind, "tsm");
            const GLuint program = kind == FILE_EXR ? strips[is_half] : volumes[is_half];
            render_set_float(program, "depth_scale_mm", tsm.depth_scale_mm);
            render_set_float(program, "depth_max_mm", tsm.depth_max_mm);
            render_set_float(program, "local_width_mm", tsm.local_width_mm);
            render_set_float(program, "local_depth_scale_mm", tsm.local_depth_scale_mm);
            render_set_float(program, "inner_mm", tsm.inner_mm);
            render_set_vec3(program, "scale", tsm.scale);
            ask(program, texture, queries, rgba[kind]);
            glDeleteTextures(1, &texture);
        }
        assert_memory_equal(rgba[FILE_DDS], rgba[FILE_RAW], sizeof rgba[0]);
        for (int i = 0; i < QUERY_COUNT * 3; i++) {
            const int query = i / 3, c = i % 3;
            const double expected = tsm_expected(image, queries + query * WORDS, c);
            for (int kind = 0; kind < 2; kind++) {
                const double found = (double)rgba[kind][query * 4 + c];
                assert_close(found, expected, 1e-5, "query %d, channel %d, kind %d", query, c, kind);
            }
        }
        io_image_destroy(image);
    }
    for (int i = 0; i < 2; i++) {
        glDeleteProgram(strips[i]);
        glDeleteProgram(volumes[i]);
    }
}

/* ---- the self-test patch ----------------------------------------------------------------------------- */

/* Oracle: what OpenGL is known to do to a texture of that format. */
static void what_formats_do_to_the_patch_is_named(void **state)
{
    (void)state;
    static const char fetch[] =
        "uniform sampler3D texels;\n"
        "vec3 answer(vec4 a, vec4 b) { return texelFetch(texels, ivec3(a.xyz), 0).rgb; }\n";
    static const struct {
        GLenum format;
        unsigned float_result, half_result;
    } cases[] = {
        { GL_RGB32F, LUT_SELF_TEST_FINE, LUT_SELF_TEST_FINE },
        { GL_RGBA16F, LUT_SELF_TEST_HALVED, LUT_SELF_TEST_FINE },
        { GL_RGBA8, LUT_SELF_TEST_QUANTISED, LUT_SELF_TEST_QUANTISED },
        { GL_RGBA16, LUT_SELF_TEST_CLAMPED | LUT_SELF_TEST_HALVED, LUT_SELF_TEST_CLAMPED },
        { GL_SRGB8_ALPHA8, LUT_SELF_TEST_QUANTISED | LUT_SELF_TEST_SRGB_DECODED,
          LUT_SELF_TEST_QUANTISED | LUT_SELF_TEST_SRGB_DECODED },
        { GL_RGB9_E5, LUT_SELF_TEST_UNKNOWN, LUT_SELF_TEST_UNKNOWN },
    };
    const GLuint program = program_create("#version 330 core\n", "", "splat.glsl", fetch);
    static float queries[QUERY_COUNT * WORDS], rgba[QUERY_COUNT * 4], patch[TSM_S * TSM_T * 3];
    for (int i = 0; i < TSM_S * TSM_T; i++) {
        queries[i * WORDS] = (float)(i % TSM_S);
        queries[i * WORDS + 1] = (float)(i / TSM_S);
        queries[i * WORDS + 2] = TSM_R - 1;
    }
    for (int is_half = 0; is_half < 2; is_half++) {
        struct io_image *const image = tsm_create(is_half);
        float *const volume = malloc((size_t)TSM_S * TSM_T * TSM_R * 3 * sizeof *volume);
        for (int i = 0; i < TSM_S * TSM_T * TSM_R * 3; i++) /* slice after slice */
            volume[i] =
                image->pixels[tsm_at(i / 3 % TSM_S, i / 3 / TSM_S % TSM_T, i / 3 / (TSM_S * TSM_T), i % 3)];
        for (size_t k = 0; k < COUNT(cases); k++) {
            const GLuint texture = texture_create(GL_TEXTURE_3D, cases[k].format, TSM_S, TSM_T, TSM_R,
                                                  GL_RGB, GL_FLOAT, volume);
            ask(program, texture, queries, rgba);
            for (int i = 0; i < TSM_S * TSM_T * 3; i++)
                patch[i] = rgba[i / 3 * 4 + i % 3];
            const unsigned found = lut_self_test_check(patch, TSM_S, TSM_T, is_half);
            const unsigned expected = is_half ? cases[k].half_result : cases[k].float_result;
            if (found != expected)
                fail_msg("case %zu, half %d: %u, expected %u", k, is_half, found, expected);
            glDeleteTextures(1, &texture);
        }
        free(volume);
        io_image_destroy(image);
    }
    glDeleteProgram(program);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splat_glsl_is_the_documented_formula),
        cmocka_unit_test(tsm_glsl_is_the_documented_formula),
        cmocka_unit_test(what_formats_do_to_the_patch_is_named),
    };
    return cmocka_run_group_tests_name("glsl", tests, start, stop);
}
