/*
 * lutgen/glsl on tables that lutgen itself has baked: what a shader is given stands in the files'
 * attributes, what it must find is what lutgen and the library say.
 */
#include "tests/glsl.h"
#include "tests/run_tool.h"

#include "lutgen/lut.h"
#include "lutgen/self_test.h"

#define MATERIALS SOURCE_FOLDER "/materials/"

static struct tool_run run;

static void file_path(enum file_kind kind, const char *stem, char path[64])
{
    static const char *const endings[] = { "exr", "dds", "raw" };
    snprintf(path, 64, "%s.%s", stem, endings[kind]);
}

/* The table's attributes as JSON: of the sidecar, which the tests of raw compare with what was set. */
static json_t *attributes_of(const char *stem)
{
    char path[80];
    snprintf(path, sizeof path, "%s.raw.json", stem);
    json_t *const sidecar = json_load_file(path, 0, NULL);
    assert_non_null(sidecar);
    json_t *const attributes = json_incref(json_object_get(sidecar, "attributes"));
    json_decref(sidecar);
    return attributes;
}

static double number(const json_t *object, const char *name)
{
    const json_t *const value = json_object_get(object, name);
    if (!json_is_number(value))
        fail_msg("no number %s", name);
    return json_number_value(value);
}

static void numbers(const json_t *object, const char *name, double out[3])
{
    const json_t *const array = json_object_get(object, name);
    assert_int_equal(json_array_size(array), 3);
    for (size_t i = 0; i < 3; i++)
        out[i] = json_number_value(json_array_get(array, i));
}

/* ---- splat tables ---------------------------------------------------------------------------------- */

static const char splat_answer[] =
    "uniform sampler2D texels;\n"
    "uniform float r_max_mm[3], scale_mm[3], power[3], falloff[3];\n"
    "uniform vec3 scale[3];\n"
    "vec3 answer(vec4 a, vec4 b) { int row = int(a.y);\n"
    "  return dipole_splat_rd_per_mm2(texels, dipole_splat(r_max_mm[row], scale_mm[row], power[row],\n"
    "                                                      falloff[row], scale[row], row), a.x); }\n";

/* Set the uniforms of row y by its attributes, whose names begin with prefix. */
static void set_row(GLuint program, int y, const json_t *attributes, const char *prefix)
{
    static const char *const names[] = { "r_max_mm", "scale_mm", "power", "falloff" };
    char uniform[32], attribute[32];
    for (size_t i = 0; i < COUNT(names); i++) {
        snprintf(uniform, sizeof uniform, "%s[%d]", names[i], y);
        snprintf(attribute, sizeof attribute, "%s%s", prefix, names[i]);
        render_set_float(program, uniform, number(attributes, attribute));
    }
    double scale[3];
    snprintf(uniform, sizeof uniform, "scale[%d]", y);
    snprintf(attribute, sizeof attribute, "%sscale", prefix);
    numbers(attributes, attribute, scale);
    render_set_vec3(program, uniform, scale);
}

/*
 * Oracle: lut_splat_sample in double, which the shader's float follows within 2e-5 of the strongest channel
 * there: a table that is long for its nodes (layered/skin, 45 mm) falls by much from node to node in the
 * others, which are at their end. All files give the same.
 */
static void expect_splat(const char *stem, const char *exr_path)
{
    const GLuint program = program_create("#version 330 core\n", "", "splat.glsl", splat_answer);
    static float queries[QUERY_COUNT * WORDS], rgba[FILE_KIND_COUNT][QUERY_COUNT * 4];
    struct lut_splat *lut = NULL;
    dipole_status status;
    if (!lut_splat_read(exr_path, &lut, &status))
        fail_msg("%s", status.message);
    json_t *const attributes = attributes_of(stem);
    if (lut->row_count == 1)
        set_row(program, 0, attributes, "dipole:");
    else
        for (size_t y = 0; y < lut->row_count; y++)
            set_row(program, (int)y, json_array_get(json_object_get(attributes, "dipole:row_json"), y), "");
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < QUERY_COUNT; i++) {
        const size_t y = (size_t)i % lut->row_count;
        const double r_max_mm = lut->rows[y].axis.r_max_mm;
        queries[i * WORDS] = (float)(i < 4   ? 0
                                     : i < 8 ? 1.001 * r_max_mm
                                     : i % 2 ? uniform(&rng, 0, r_max_mm)
                                             : log_uniform(&rng, 1e-4 * r_max_mm, r_max_mm));
        queries[i * WORDS + 1] = (float)y;
    }
    for (int kind = 0; kind < FILE_KIND_COUNT; kind++) {
        char path[64];
        file_path((enum file_kind)kind, stem, path);
        const GLuint texture = load_file((enum file_kind)kind, path);
        ask(program, texture, queries, rgba[kind]);
        glDeleteTextures(1, &texture);
        assert_memory_equal(rgba[0], rgba[kind], sizeof rgba[0]);
    }
    for (int i = 0; i < QUERY_COUNT; i++) {
        double expected[3];
        const double r_mm = (double)queries[i * WORDS];
        lut_splat_sample(lut, (size_t)i % lut->row_count, r_mm, expected);
        const double most = fmax(expected[0], fmax(expected[1], expected[2]));
        for (int c = 0; c < 3; c++)
            if (!(fabs((double)rgba[0][i * 4 + c] - expected[c]) <= 2e-5 * most))
                fail_msg("%s, channel %d, r %g: %g, expected %g", stem, c, r_mm, (double)rgba[0][i * 4 + c],
                         expected[c]);
    }
    json_decref(attributes);
    lut_splat_destroy(lut);
    glDeleteProgram(program);
}

static void baked_splat_tables_are_sampled(void **state)
{
    (void)state;
    for (int is_half = 0; is_half < 2; is_half++) {
        run_tool(&run, "lutgen", MATERIALS "marble.json", MATERIALS "skin1.json",
                 MATERIALS "layered/skin.json", "-k", "splat1d,splat2d", "-f", "exr,dds,raw", "--force",
                 "-o", "baked", "-q", "-e", is_half ? "0.01" : "0.001", is_half ? "--half" : "-q");
        if (run.exit_code != 0)
            fail_msg("%s", run.err);
        static const char *const stems[] = { "baked/marble.splat1d", "baked/skin1.splat1d",
                                             "baked/materials.splat2d" };
        for (size_t k = 0; k < COUNT(stems); k++) {
            char path[64];
            file_path(FILE_EXR, stems[k], path);
            expect_splat(stems[k], path);
        }
    }
}

/* ---- volumes ----------------------------------------------------------------------------------------- */

static const char tsm_answer[] =
    "uniform DIPOLE_TSM_SAMPLER texels;\n"
    "uniform float depth_scale_mm, depth_max_mm, local_width_mm, local_depth_scale_mm, inner_mm;\n"
    "uniform vec3 size, scale;\n"
    "uniform int local_slice, depth_factor_slice;\n"
    "vec3 answer(vec4 a, vec4 b) {\n"
    "  dipole_tsm table = dipole_tsm(ivec3(size), depth_scale_mm, depth_max_mm, scale, local_slice,\n"
    "                                depth_factor_slice, local_width_mm, local_depth_scale_mm, inner_mm);\n"
    "  int which = int(b.w);\n"
    "  if (b.x < -1.5)\n" /* a texel of the last slice */
    "    return dipole_tsm_texel(texels, table, a.x, a.y, table.size.z - 1);\n"
    "  return which < 0 ? dipole_tsm_local(texels, table, ivec2((-1 - which) % 7, (-1 - which) / 7), a.w)\n"
    "                   : dipole_tsm_response_per_mm2(texels, table, which, a.xyz, b.xyz, a.w); }\n";

static void set_tsm(GLuint program, const json_t *attributes)
{
    static const char *const floats[] = { "depth_scale_mm", "depth_max_mm", "local_width_mm",
                                          "local_depth_scale_mm", "inner_mm" };
    static const char *const slices[] = { "local_slice", "depth_factor_slice" };
    static const char *const vectors[] = { "size", "scale" };
    char name[64];
    for (size_t i = 0; i < COUNT(floats); i++) {
        snprintf(name, sizeof name, "dipole:%s", floats[i]);
        render_set_float(program, floats[i], number(attributes, name));
    }
    for (size_t i = 0; i < COUNT(slices); i++) {
        snprintf(name, sizeof name, "dipole:%s", slices[i]);
        render_set_int(program, slices[i], (int)number(attributes, name));
    }
    for (size_t i = 0; i < COUNT(vectors); i++) {
        double value[3];
        snprintf(name, sizeof name, "dipole:%s", vectors[i]);
        numbers(attributes, name, value);
        render_set_vec3(program, vectors[i], value);
    }
}

/* Places across the light at a sample's own offset, at any depth; or cells of the local response. */
static void tsm_queries(const struct lut_tsm *lut, float queries[QUERY_COUNT * WORDS])
{
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < QUERY_COUNT; i++) {
        float *const query = queries + i * WORDS;
        const int sample = (int)(random_bits(&rng) % (unsigned)lut->sample_count);
        const bool is_local = i % 4 == 0;
        const double reach_mm = is_local ? lut->inner_mm : lut->depth_max_mm;
        const double dz_mm =
            (i % 2 ? 1 : -1) *
            (i % 64 == 0 ? 1.001 * reach_mm : log_uniform(&rng, 1e-3 * reach_mm, reach_mm));
        const double z = uniform(&rng, -1, 1), angle = uniform(&rng, 0, 6.283185307179586);
        const double values[WORDS] = { -lut->samples[sample].offset_mm[0],
                                       -lut->samples[sample].offset_mm[1],
                                       -dz_mm, /* the light comes from +z */
                                       dz_mm,
                                       sqrt(1 - z * z) * cos(angle),
                                       sqrt(1 - z * z) * sin(angle),
                                       z,
                                       is_local ? -1 - (int)(random_bits(&rng) % 49) : sample };
        for (int k = 0; k < WORDS; k++)
            query[k] = (float)values[k];
    }
}

static void tsm_expected(const struct lut_tsm *lut, const float *query, double rgb_out[3])
{
    const double dz_mm = (double)query[3];
    const int which = (int)query[7];
    if (which < 0) {
        double factor[3];
        const double side_mm = lut->inner_mm / LUT_TSM_LOCAL_SIDE;
        lut_tsm_local_kernel(lut, (-1 - which) % 7 - 3, (-1 - which) / 7 - 3, rgb_out);
        lut_tsm_local_depth_factor(lut, dz_mm, factor);
        for (int c = 0; c < 3; c++)
            rgb_out[c] *= factor[c] * side_mm * side_mm;
        return;
    }
    double dot = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        dot += (double)query[i] * (double)query[4 + i];
        square += (double)query[i] * (double)query[i];
    }
    lut_tsm_sample(lut, which, square > 0 ? fmax(fmin(dot / sqrt(square), 1), -1) : 0, dz_mm, rgb_out);
}

/* Oracles: lutgen's own sampling in double, which the shader's float follows within 5e-4 where the local
 * response and the rest fade into each other, so where one is next to 0, and 2e-5 elsewhere; the patch in
 * the last slice arrives as it is. */
static void baked_volumes_are_sampled(void **state)
{
    (void)state;
    static const char stem[] = "baked/skin1.tsm";
    static float queries[QUERY_COUNT * WORDS], rgba[QUERY_COUNT * 4], patch[QUERY_COUNT * 3];
    const GLuint programs[2] = { program_create("#version 330 core\n", "#define DIPOLE_TSM_STRIP\n",
                                                "tsm.glsl", tsm_answer),
                                 program_create("#version 330 core\n", "", "tsm.glsl", tsm_answer) };
    for (int is_half = 0; is_half < 2; is_half++) {
        run_tool(&run, "lutgen", MATERIALS "skin1.json", "-k", "tsm", "-f", "exr,dds,raw", "--force", "-o",
                 "baked", is_half ? "--half" : "-q");
        if (run.exit_code != 0)
            fail_msg("%s", run.err);
        char path[64];
        struct io_image *image;
        struct lut_tsm *lut = NULL;
        dipole_status status;
        file_path(FILE_EXR, stem, path);
        if (!io_exr_read(path, &image, &status) || !lut_tsm_from_image(image, path, &lut, &status))
            fail_msg("%s", status.message);
        io_image_destroy(image);
        json_t *const attributes = attributes_of(stem);
        const int width = lut->size[0], height = lut->size[1];
        assert_true(width * height <= QUERY_COUNT);
        for (int kind = 0; kind < FILE_KIND_COUNT; kind++) {
            const GLuint program = programs[kind != FILE_EXR];
            file_path((enum file_kind)kind, stem, path);
            const GLuint texture = load_file((enum file_kind)kind, path);
            set_tsm(program, attributes);
            tsm_queries(lut, queries);
            ask(program, texture, queries, rgba);
            for (int i = 0; i < QUERY_COUNT; i++) {
                double expected[3];
                tsm_expected(lut, queries + i * WORDS, expected);
                const double depth_mm = fabs((double)queries[i * WORDS + 3]);
                const bool is_fading = depth_mm <= lut->inner_mm;
                for (int c = 0; c < 3; c++) {
                    const double found = (double)rgba[i * 4 + c];
                    assert_close(found, expected[c], is_fading ? 5e-4 : 2e-5,
                                 "kind %d, query %d, channel %d, dz %g", kind, i, c,
                                 (double)queries[i * WORDS + 3]);
                }
            }
            for (int i = 0; i < width * height; i++) {
                queries[i * WORDS] = (float)(i % width);
                queries[i * WORDS + 1] = (float)(i / width);
                queries[i * WORDS + 4] = -2;
            }
            ask(program, texture, queries, rgba);
            for (int i = 0; i < width * height * 3; i++)
                patch[i] = rgba[i / 3 * 4 + i % 3];
            assert_int_equal(lut_self_test_check(patch, width, height, is_half), LUT_SELF_TEST_FINE);
            glDeleteTextures(1, &texture);
        }
        json_decref(attributes);
        lut_tsm_destroy(lut);
    }
    glDeleteProgram(programs[0]);
    glDeleteProgram(programs[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(baked_splat_tables_are_sampled),
        tool_test(baked_volumes_are_sampled),
    };
    return cmocka_run_group_tests_name("glsl_baked", tests, start, stop);
}
