#include "tests/baked.h"
#include "tests/svg_check.h"

#include "io/half.h"
#include "lutgen/internal.h"

#include <fcntl.h>
#include <sys/stat.h>

#define MATERIALS SOURCE_FOLDER "/materials/"

static struct tool_run run;

/* ---- what is baked ---------------------------------------------------------------------------------- */

/* Oracle: the tables on disk, audited again here; the order is that of kinds, then of materials. */
static void every_bundled_material_is_baked_in_every_kind(void **state)
{
    (void)state;
    static const char *const names[] = { "apple",   "chicken1", "chicken2",   "cream",
                                         "ketchup", "marble",   "potato",     "skimmilk",
                                         "skin1",   "skin2",    "spectralon", "wholemilk" };
    enum { COUNT = sizeof names / sizeof *names };
    char paths[COUNT][256];
    const char *arguments[COUNT + 5] = { "-o", "a/b/tables", "--kind", "tsm,splat2d,splat1d" };
    for (int i = 0; i < COUNT; i++) {
        snprintf(paths[i], sizeof paths[i], MATERIALS "%s.json", names[i]);
        arguments[4 + i] = paths[i];
    }
    json_t *const files = bake(&run, arguments);
    assert_int_equal(json_array_size(files), 2 * COUNT + 1);
    assert_int_equal(count_entries("a/b/tables"), 2 * COUNT + 1);
    for (size_t i = 0; i < 2 * COUNT + 1; i++) {
        char path[256];
        if (i == COUNT)
            snprintf(path, sizeof path, "a/b/tables/materials.splat2d.exr");
        else
            snprintf(path, sizeof path, "a/b/tables/%s.%s.exr", names[i < COUNT ? i : i - COUNT - 1],
                     i < COUNT ? "splat1d" : "tsm");
        assert_string_equal(file_text(files, i, "path"), path);
        assert_false(file_is_current(files, i));
        audit_file(files, i, i <= COUNT ? 0.001 : 0.15);
    }
    json_decref(files);
}

static void write_models(void)
{
    static const char *const models[] = { "beam", "better_dipole", "modes" };
    for (int i = 0; i < 3; i++) {
        char path[64], text[512];
        snprintf(path, sizeof path, "%s.json", models[i]);
        snprintf(
            text, sizeof text,
            "{ \"name\": \"%s\", \"eta\": 1.3, \"model\": \"%s\",\n  \"sigma_a_per_mm\": [1, 0.1, 0.01], "
            "\"sigma_s_prime_per_mm\": [1, 1, 1] }\n",
            models[i], models[i]);
        write_text(path, text);
    }
    write_text("slab.json",
               "{ \"name\": \"slab\", \"eta\": 1.3, \"layers\": [{ \"thickness_mm\": 2,\n"
               "  \"sigma_a_per_mm\": [1, 0.1, 0.01], \"sigma_s_prime_per_mm\": [1, 1, 1] }] }\n");
    write_text("glazed.json",
               "{ \"name\": \"glazed\", \"eta\": 1.5, \"model\": \"modes\", \"layers\": [\n"
               "  { \"thickness_mm\": 0.5, \"sigma_a_per_mm\": [0.02, 0.02, 0.03],"
               " \"sigma_s_prime_per_mm\": [0.5, 0.6, 0.7] },\n"
               "  { \"thickness_mm\": \"infinite\", \"eta\": 1.4, \"sigma_a_per_mm\": [0.02, 0.02, 0.03],"
               " \"sigma_s_prime_per_mm\": [5, 6, 7] }] }\n");
    write_text("plates.json",
               "{ \"name\": \"plates\", \"eta\": 1.3, \"model\": \"multipole\", \"layers\": [\n"
               "  { \"thickness_mm\": 2, \"sigma_a_per_mm\": [0.1, 0.1, 0.01],"
               " \"sigma_s_prime_per_mm\": [1, 1, 1] },\n"
               "  { \"thickness_mm\": 5, \"sigma_a_per_mm\": [0.1, 0.1, 0.01],"
               " \"sigma_s_prime_per_mm\": [2, 2, 2] }] }\n");
}

/* Oracle: as above. */
static void every_model_and_layers_are_baked(void **state)
{
    (void)state;
    write_models();
    json_t *const files =
        BAKE(&run, "beam.json", "better_dipole.json", "modes.json", "slab.json", "glazed.json",
             "plates.json", "-o", ".", "--kind", "splat1d,splat2d,tsm", "--epsilon", "0.2");
    assert_int_equal(json_array_size(files), 13);
    for (size_t i = 0; i < 13; i++)
        audit_file(files, i, 0.2);
    json_decref(files);
    struct lut_splat *const lut = splat_read("glazed.splat1d.exr");
    assert_int_equal(lut->rows[0].material.model, DIPOLE_MODEL_MODES);
    assert_int_equal(lut->rows[0].material.layer_count, 2);
    lut_splat_destroy(lut);
}

/* Oracle: the tables of one row: a row of many holds, texel by texel, what a table of its own with as many
 * texels does; rows stand in the order of the command line. */
static void many_rows_are_the_tables_of_one(void **state)
{
    (void)state;
    static const char *const names[] = { "skin1", "marble", "apple" };
    static const char *const titles[] = { "Skin 1", "Marble", "Apple" };
    json_t *const files =
        BAKE(&run, MATERIALS "skin1.json", MATERIALS "marble.json", MATERIALS "apple.json", "--kind",
             "splat2d,splat1d", "--size", "200", "-o", ".");
    assert_int_equal(json_array_size(files), 4);
    struct lut_splat *const many = splat_read("materials.splat2d.exr");
    assert_int_equal(many->row_count, 3);
    assert_int_equal(many->node_count, 200);
    for (size_t i = 0; i < 3; i++) {
        char path[64];
        snprintf(path, sizeof path, "%s.splat1d.exr", names[i]);
        struct lut_splat *const one = splat_read(path);
        assert_string_equal(many->rows[i].material.name, one->rows[0].material.name);
        assert_string_equal(many->rows[i].material.name, titles[i]);
        assert_int_equal(one->node_count, 200);
        const size_t row = (size_t)one->node_count * IO_CHANNEL_COUNT;
        assert_memory_equal(many->rgb + i * row, one->rgb, row * sizeof *one->rgb);
        assert_true(many->rows[i].error.max == one->rows[0].error.max);
        lut_splat_destroy(one);
    }
    lut_splat_destroy(many);
    json_decref(files);
}

/* Oracle: the sizes asked for, and the documented limits, in exact words. */
static void sizes_are_those_asked_for(void **state)
{
    (void)state;
    json_t *files =
        BAKE(&run, MATERIALS "marble.json", "--kind", "splat1d,tsm", "--size", "123", "-o", ".");
    struct lut_error error;
    struct lut_tsm *tsm = tsm_read("marble.tsm.exr");
    error = tsm->error;
    expect_described(files, 1, "tsm", "[64,64,32]", &error);
    lut_tsm_destroy(tsm);
    assert_int_equal(json_integer_value(json_object_get(json_array_get(files, 0), "size")), 123);
    audit_file(files, 0, 0.001);
    json_decref(files);
    files =
        BAKE(&run, MATERIALS "marble.json", "--kind", "tsm", "--size", "40x90x16", "-e", "0.4", "-o", ".");
    tsm = tsm_read("marble.tsm.exr");
    expect_described(files, 0, "tsm", "[40,90,16]", &tsm->error);
    assert_int_equal(tsm->sample_count, 13);
    lut_tsm_destroy(tsm);
    audit_file(files, 0, 0.4);
    json_decref(files);

    static const char marble[] = MATERIALS "marble.json";
    static const struct {
        const char *kind, *size;
        int exit_code;
        const char *message;
    } cases[] = {
        { "splat1d", "7", 1, "a width of 7 texels, expected 8 to 32768" },
        { "splat2d", "32769", 1, "a width of 32769 texels, expected 8 to 32768" },
        { "splat1d", "-9", 1, "a width of -9 texels, expected 8 to 32768" },
        { "splat1d", "8", 1, "8 texels reach a relative error of 0.19, expected at most epsilon = 0.001" },
        { "tsm", "64x64x20", 1, "a volume of 20 slices, expected 16, 32, 64, 128 or 256" },
        { "tsm", "7x8x16", 1, "a volume of 7 x 8 x 16, expected 8 to 1024 for S" },
        { "tsm", "8x1025x16", 1, "a volume of 8 x 1025 x 16, expected 8 to 1024 for T" },
        { "tsm", "8x8x16", 1,
          "8 x 8 x 16 texels reach a relative error of 0.95, expected at most epsilon = 0.15" },
        { "tsm", "64x64", 2, NULL },
        { "tsm", "64x64x32x", 2, NULL },
        { "splat1d", "5.5", 2, NULL },
        { "splat1d", "n", 2, NULL },
        { "splat1d", "123456", 2, NULL },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char message[512];
        const bool is_joint = strcmp(cases[i].kind, "splat2d") == 0;
        if (cases[i].message)
            snprintf(message, sizeof message, "lutgen: %s%s%s\n", is_joint ? "" : marble,
                     is_joint ? "" : ": ", cases[i].message);
        else
            snprintf(message, sizeof message,
                     "lutgen: --size is \"%s\", expected a number of texels (splat1d, splat2d) or SxTxR "
                     "(tsm)\n",
                     cases[i].size);
        run_tool(&run, "lutgen", marble, "-o", "out", "--kind", cases[i].kind, "--size", cases[i].size);
        assert_failed(&run, cases[i].exit_code, message);
    }
    run_tool(&run, "lutgen", marble, "-o", "out", "--kind", "tsm", "--size", "64");
    assert_failed(&run, 2,
                  "lutgen: --size is \"64\", that of a splat table, but --kind is tsm: expected SxTxR\n");
    run_tool(&run, "lutgen", marble, "-o", "out", "--kind", "splat1d,splat2d", "--size", "64x64x32");
    assert_failed(&run, 2, "lutgen: --size is \"64x64x32\", that of a volume, but --kind has no tsm\n");
    assert_int_equal(count_entries("out"), -1);
}

/* ---- how it is stored ------------------------------------------------------------------------------- */

/* Oracle: the arithmetic of half: every texel is one, and the file is smaller; a material whose profile
 * falls by more than half's range keeps the same error. */
static void half_keeps_the_error_in_fewer_bytes(void **state)
{
    (void)state;
    json_t *const files = BAKE(&run, MATERIALS "marble.json", MATERIALS "spectralon.json", "--kind",
                               "splat1d,splat2d,tsm", "--half", "-o", ".");
    assert_int_equal(json_array_size(files), 5);
    for (size_t i = 0; i < 5; i++) {
        const char *const path = file_text(files, i, "path");
        audit_file(files, i, i < 3 ? 0.001 : 0.15);
        struct io_image *image;
        assert_true(io_exr_read(path, &image, NULL));
        assert_string_equal(io_image_find(image, "dipole:storage")->text, "half");
        const size_t count = (size_t)image->width_px * (size_t)image->height_px * 3;
        for (size_t k = 0; k < count; k++)
            assert_true(io_float_from_half(io_half_from_float(image->pixels[k])) == image->pixels[k]);
        size_t size, float_size;
        free(read_whole(path, &size));
        assert_true(io_exr_write("float.exr", image, false, NULL));
        free(read_whole("float.exr", &float_size));
        assert_true(size < float_size);
        io_image_destroy(image);
    }
    json_decref(files);
    run_tool(&run, "lutgen", MATERIALS "marble.json", "--half", "--epsilon", "0.0004", "-o", "out");
    assert_failed(&run, 1,
                  "lutgen: " MATERIALS
                  "marble.json: epsilon is 0.0004, expected > 0.00049 for a half table "
                  "(half rounds by as much); use float\n");
}

/* Like json_equal, but 1 is 1.0. */
static bool is_same_json(const json_t *a, json_t *b)
{
    if (json_is_number(a) && json_is_number(b))
        return json_number_value(a) == json_number_value(b);
    bool is_same = true;
    if (json_is_array(a) && json_is_array(b)) {
        for (size_t i = 0; i < json_array_size(a) && is_same; i++)
            is_same = is_same_json(json_array_get(a, i), json_array_get(b, i));
        return is_same && json_array_size(a) == json_array_size(b);
    }
    if (!json_is_object(a) || !json_is_object(b))
        return json_equal(a, b);
    const char *key;
    json_t *value;
    json_object_foreach(b, key, value) is_same = is_same && is_same_json(json_object_get(a, key), value);
    return is_same && json_object_size(a) == json_object_size(b);
}

static void expect_attribute(const json_t *found, const struct io_attribute *expected)
{
    if (!found)
        fail_msg("no attribute %s", expected->name);
    const size_t length = strlen(expected->name);
    switch (expected->kind) {
    case IO_ATTRIBUTE_NUMBER:
        assert_true(json_number_value(found) == expected->numbers[0]);
        return;
    case IO_ATTRIBUTE_NUMBERS:
        for (size_t i = 0; i < 3; i++)
            assert_true(json_number_value(json_array_get(found, i)) == expected->numbers[i]);
        return;
    case IO_ATTRIBUTE_TEXT:
        break;
    }
    if (length > 5 && strcmp(expected->name + length - 5, "_json") == 0) {
        json_t *const value = json_loads(expected->text, 0, NULL);
        assert_true(is_same_json(found, value));
        json_decref(value);
    } else {
        assert_string_equal(json_string_value(found), expected->text);
    }
}

/* FNV-1a, written down again: http://www.isthe.com/chongo/tech/comp/fnv. */
static void hash_of_bytes(const char *data, size_t size, char out[17])
{
    uint64_t hash = 14695981039346656037U;
    for (size_t i = 0; i < size; i++) {
        hash ^= (uint64_t)(uint8_t)data[i];
        hash *= 1099511628211U;
    }
    snprintf(out, 17, "%016llx", (unsigned long long)hash);
}

/* A DDS or raw file and its sidecar against the EXR file beside, whose texels are x fastest, then y, then
 * the slice. */
static void expect_like_exr(const char *path, const char *exr_path, int depth)
{
    char beside[256], hash[17];
    size_t size;
    struct io_image *image;
    snprintf(beside, sizeof beside, "%s.json", path);
    char *const data = read_whole(path, &size);
    json_t *const sidecar = json_load_file(beside, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(sidecar);
    assert_true(io_exr_read(exr_path, &image, NULL));
    hash_of_bytes(data, size, hash);
    assert_string_equal(json_string_value(json_object_get(sidecar, "content_hash")), hash);
    const json_t *const attributes = json_object_get(sidecar, "attributes");
    assert_int_equal(json_object_size(attributes), image->attribute_count);
    for (size_t i = 0; i < image->attribute_count; i++)
        expect_attribute(json_object_get(attributes, image->attributes[i].name), &image->attributes[i]);

    const bool is_half = strcmp(io_image_find(image, "dipole:storage")->text, "half") == 0;
    const size_t header = (size_t)json_integer_value(json_object_get(sidecar, "header_bytes"));
    const size_t channels = header > 0 ? 4 : 3, bytes = is_half ? 2 : 4;
    const size_t width = (size_t)image->width_px / (size_t)depth, height = (size_t)image->height_px;
    assert_int_equal(size, header + width * height * (size_t)depth * channels * bytes);
    for (size_t i = 0; i < width * height * (size_t)depth * 3; i++) {
        const size_t texel = i / 3, x = texel % width, y = texel / width % height,
                     z = texel / width / height;
        const float expected = image->pixels[(y * (size_t)image->width_px + z * width + x) * 3 + i % 3];
        float found = 0;
        const char *const at = data + header + (texel * channels + i % 3) * bytes;
        if (is_half) {
            uint16_t bits;
            memcpy(&bits, at, sizeof bits);
            found = io_float_from_half(bits);
        } else {
            memcpy(&found, at, sizeof found);
        }
        assert_true(found == expected);
    }
    io_image_destroy(image);
    json_decref(sidecar);
    free(data);
}

/* Oracle: the EXR file, value by value. */
static void formats_hold_the_same(void **state)
{
    (void)state;
    for (int is_half = 0; is_half <= 1; is_half++) {
        json_t *const files =
            BAKE(&run, MATERIALS "marble.json", MATERIALS "apple.json", "-o", is_half ? "half" : "float",
                 "--kind", "splat1d,splat2d,tsm", "--format", "raw,exr,dds", is_half ? "--half" : "-q");
        static const char *const formats[] = { "exr", "dds", "raw" };
        assert_int_equal(json_array_size(files), 3 * 5);
        assert_int_equal(count_entries(is_half ? "half" : "float"), 5 * 5);
        for (size_t i = 0; i < 15; i += 3)
            for (size_t k = 0; k < 3; k++) {
                const char *const path = file_text(files, i + k, "path"), *const end = strrchr(path, '.');
                const char *const exr_path = file_text(files, i, "path");
                assert_string_equal(end + 1, formats[k]);
                assert_true(strncmp(path, exr_path, (size_t)(end + 1 - path)) == 0);
                if (k > 0)
                    expect_like_exr(path, exr_path, i >= 9 ? 32 : 1);
            }
        json_decref(files);
    }
}

/* Oracle: the same tables without EXR: the bytes do not depend on what else is written. */
static void formats_do_not_depend_on_each_other(void **state)
{
    (void)state;
    json_decref(BAKE(&run, MATERIALS "marble.json", "-o", "all", "--format", "exr,dds,raw"));
    json_decref(BAKE(&run, MATERIALS "marble.json", "-o", "dds", "--format", "dds"));
    json_decref(BAKE(&run, MATERIALS "marble.json", "-o", "raw", "--format", "raw"));
    assert_int_equal(count_entries("dds") + count_entries("raw"), 4);
    assert_true(has_same_bytes("all/marble.splat1d.dds", "dds/marble.splat1d.dds"));
    assert_true(has_same_bytes("all/marble.splat1d.dds.json", "dds/marble.splat1d.dds.json"));
    assert_true(has_same_bytes("all/marble.splat1d.raw", "raw/marble.splat1d.raw"));
    assert_true(has_same_bytes("all/marble.splat1d.raw.json", "raw/marble.splat1d.raw.json"));
}

/* Oracle: same inputs, same bytes, however many threads; another epsilon, other bytes. */
static void bytes_do_not_depend_on_threads(void **state)
{
    (void)state;
    static const char *const counts[] = { "1", "2", "5", "0" };
    static const char *const kinds[] = { "marble.splat1d", "marble.tsm", "materials.splat2d" };
    for (size_t i = 0; i < 4; i++)
        json_decref(BAKE(&run, MATERIALS "marble.json", "--kind", "splat1d,splat2d,tsm", "--threads",
                         counts[i], "-o", counts[i]));
    json_decref(BAKE(&run, MATERIALS "marble.json", "--kind", "splat1d,splat2d,tsm", "--epsilon", "0.05",
                     "-o", "other"));
    for (size_t k = 0; k < 3; k++) {
        char path[64], other_path[64];
        snprintf(path, sizeof path, "1/%s.exr", kinds[k]);
        for (size_t i = 1; i < 4; i++) {
            snprintf(other_path, sizeof other_path, "%s/%s.exr", counts[i], kinds[k]);
            assert_true(has_same_bytes(path, other_path));
        }
        snprintf(other_path, sizeof other_path, "other/%s.exr", kinds[k]);
        assert_false(has_same_bytes(path, other_path));
    }
}

/* ---- pictures and words ------------------------------------------------------------------------------ */

/* Oracle: XML and librsvg; tables that are up to date are drawn all the same, in the same bytes. */
static void plots_are_drawn(void **state)
{
    (void)state;
    static const char *const names[] = { "marble.splat1d.svg", "apple.splat1d.svg", "materials.splat2d.svg",
                                         "marble.tsm.svg", "apple.tsm.svg" };
    for (int round = 0; round < 2; round++) {
        json_t *const files = BAKE(&run, MATERIALS "marble.json", MATERIALS "apple.json", "-o", ".",
                                   "--kind", "splat1d,splat2d,tsm", "--plot");
        assert_int_equal(json_array_size(files), 5); /* tables only */
        assert_true(file_is_current(files, 0) == (round == 1));
        json_decref(files);
        for (size_t i = 0; i < 5; i++) {
            size_t size;
            char kept[64];
            char *const svg = read_whole(names[i], &size);
            assert_well_formed(svg);
            assert_drawable(svg);
            assert_non_null(strstr(svg, i == 2  ? "Splat table of 2 materials"
                                        : i % 2 ? (i == 3 ? "Marble, volume" : "Apple, splat table")
                                                : (i == 0 ? "Marble, splat table" : "Apple, volume")));
            free(svg);
            snprintf(kept, sizeof kept, "%s.kept", names[i]);
            if (round == 0)
                assert_int_equal(rename(names[i], kept), 0);
            else
                assert_true(has_same_bytes(names[i], kept));
        }
    }
}

/* Run lutgen with stderr on a terminal; what it drew. False without terminals. */
static bool run_on_terminal(char *out, size_t size)
{
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0)
        return false;
    const int line = open(ptsname(terminal), O_RDWR | O_NOCTTY);
    assert_true(line >= 0);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
        dup2(line, STDERR_FILENO);
        execl(PROGRAM_FOLDER "/lutgen", "lutgen", MATERIALS "marble.json", "-o", ".", (char *)NULL);
        _exit(127);
    }
    close(line);
    size_t count = 0;
    for (ssize_t got; (got = read(terminal, out + count, size - 1 - count)) > 0;)
        count += (size_t)got;
    out[count] = '\0';
    close(terminal);
    int result = 0;
    waitpid(child, &result, 0);
    assert_true(WIFEXITED(result) && WEXITSTATUS(result) == 0);
    return true;
}

/* Oracle: a line that is drawn and cleared again; every other test's run sees none, its stderr is a pipe.
 */
static void progress_is_for_terminals(void **state)
{
    (void)state;
    char text[4096];
    if (!run_on_terminal(text, sizeof text))
        skip();
    assert_non_null(strstr(text, "\rlutgen: ./marble.splat1d 0 %"));
    char cleared[82];
    snprintf(cleared, sizeof cleared, "\r%79s\r", "");
    assert_string_equal(text + strlen(text) - strlen(cleared), cleared);
}

/* Oracle: the words of the table, times aside. */
static void people_get_a_table_with_units(void **state)
{
    (void)state;
    static const char *const arguments[] = {
        MATERIALS "marble.json", "-o",       ".",       "--epsilon", "0.2", "--kind",
        "splat1d,splat2d,tsm",   "--format", "exr,raw", NULL
    };
    static const char *const lines[] = {
        "path                     kind           size  max_relative_error  p99_relative_error     bake_ms\n"
        "                                      texels                                                  ms\n"
        "./marble.splat1d.exr     splat1d ",
        "\n./marble.splat1d.raw     splat1d ", "\n./materials.splat2d.exr  splat2d ", "x1 ",
        "\n./marble.tsm.raw         tsm        64x64x32              0.0837 "
    };
    run_tool_limited(&run, 0, "lutgen", arguments);
    assert_done(&run);
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        assert_non_null(strstr(run.out, lines[i]));
    assert_null(strstr(run.out, "up to date"));
    run_tool_limited(&run, 0, "lutgen", arguments);
    assert_done(&run);
    assert_int_equal(count_of(run.out, "  up to date\n"), 6);
}

/* ---- what is wrong ----------------------------------------------------------------------------------- */

/* Oracle: exact messages; no folder is made when an input is bad, even the last one. */
static void bad_input_is_named_and_nothing_written(void **state)
{
    (void)state;
    write_text("negative.json", "{ \"name\": \"n\", \"eta\": 1.3,\n  \"sigma_a_per_mm\": [0.1, -2, 0],\n"
                                "  \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_text("syntax.json", "{ \"name\": \"n\",\n");
    write_text("thin.json", "{ \"name\": \"t\", \"eta\": 1.3, \"model\": \"multipole\",\n"
                            "  \"layers\": [{ \"thickness_mm\": 0.1, \"sigma_a_per_mm\": [1, 1, 1],\n"
                            "  \"sigma_s_prime_per_mm\": [1, 1, 1] }] }\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "negative.json", "-o", "out");
    assert_failed(
        &run, 1,
        "lutgen: negative.json:2:27: sigma_a_per_mm[1] is -2, expected >= 0 (0, or 1e-50 to 1e+50)\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "syntax.json", "-o", "out");
    assert_failed(&run, 1,
                  "lutgen: syntax.json:2:1: JSON syntax: string or '}' expected near end of file\n");
    run_tool(&run, "lutgen", "missing.json", "-o", "out");
    assert_failed(&run, 1, "lutgen: missing.json: cannot be read: No such file or directory\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "thin.json", "-o", "out");
    assert_int_equal(run.exit_code, 1);
    assert_int_equal(strncmp(run.err, "lutgen: thin.json:", 18), 0);
    mkdir("other", 0777);
    write_text("other/marble.json", "{ \"name\": \"n\", \"eta\": 1.3, \"sigma_a_per_mm\": [1, 2, 3],\n"
                                    "  \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_text("marble.json", "{}");
    run_tool(&run, "lutgen", "other/marble.json", "marble.json", "-o", "out", "--format", "dds");
    assert_failed(
        &run, 1,
        "lutgen: other/marble.json and marble.json would both become out/marble.splat1d.dds, expected "
        "different file names\n");
    assert_int_equal(count_entries("out"), -1);
}

/* Oracle: exact messages, exit code 2. */
static void wrong_usage_is_explained(void **state)
{
    (void)state;
    static const struct {
        const char *option, *value, *message;
    } cases[] = {
        { "--kind", "splat3d",
          "--kind is \"splat3d\", expected one of splat1d, splat2d, tsm, or several with commas between" },
        { "--kind", "tsm,,splat1d",
          "--kind is \"\", expected one of splat1d, splat2d, tsm, or several with commas between" },
        { "--format", "exr,png",
          "--format is \"png\", expected one of exr, dds, raw, or several with commas between" },
        { "--epsilon", "0", "--epsilon is \"0\", expected a number 1e-06 to 0.5" },
        { "--threads", "65", "--threads is \"65\", expected a number 0 to 64" },
        { "--size", "", "--size is empty, expected N|SxTxR" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char message[512];
        snprintf(message, sizeof message, "lutgen: %s\n", cases[i].message);
        run_tool(&run, "lutgen", "x.json", "-o", "out", cases[i].option, cases[i].value);
        assert_failed(&run, 2, message);
    }
    run_tool(&run, "lutgen", "x.json");
    assert_failed(&run, 2, "lutgen: no --output (-o) DIR was given; try --help\n");
    run_tool(&run, "lutgen", "-o", "out");
    assert_failed(&run, 2, "lutgen: 0 operands, expected at least 1: lutgen MATERIAL.json... -o DIR\n");
}

/* Oracle: a material in 1/m gets a note, which -q silences; the table is baked all the same. */
static void unit_slips_are_noted(void **state)
{
    (void)state;
    write_text("slip.json", "{ \"name\": \"s\", \"eta\": 1.3, \"sigma_a_per_mm\": [2000, 2000, 2000],\n"
                            "  \"sigma_s_prime_per_mm\": [20000, 20000, 20000] }\n");
    run_tool(&run, "lutgen", "slip.json", "-o", ".");
    assert_int_equal(run.exit_code, 0);
    assert_int_equal(strncmp(run.err, "lutgen: note: slip.json: channel R: ", 36), 0);
    run_tool(&run, "lutgen", "slip.json", "-o", ".", "-q");
    assert_done(&run);
    assert_int_equal(access("slip.splat1d.exr", R_OK), 0);
}

/* Oracle: exact messages where the folder cannot be made or the name is taken by a folder. */
static void unwritable_output_is_named(void **state)
{
    (void)state;
    write_text("file", "");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "file/out");
    assert_failed(&run, 1, "lutgen: file/out: cannot be made: Not a directory\n");
    mkdir("out", 0777);
    static const char *const names[] = { "out/marble.splat1d.exr", "out/marble.splat1d.dds",
                                         "out/marble.splat1d.raw", "out/marble.splat1d.raw.json",
                                         "out/marble.splat1d.svg" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char message[256];
        mkdir(names[i], 0777);
        run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "out", "--format", "exr,dds,raw", "--plot");
        snprintf(message, sizeof message, "lutgen: %s: cannot be written: Is a directory\n", names[i]);
        assert_failed(&run, 1, message);
        assert_int_equal(system("ls -A out | grep -q '^[.]'") == 0, 0); /* no temporaries */
        assert_int_equal(rmdir(names[i]), 0);
    }
}

static int free_run(void **state)
{
    (void)state;
    free(run.out);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(every_bundled_material_is_baked_in_every_kind),
        tool_test(every_model_and_layers_are_baked),
        tool_test(many_rows_are_the_tables_of_one),
        tool_test(sizes_are_those_asked_for),
        tool_test(half_keeps_the_error_in_fewer_bytes),
        tool_test(formats_hold_the_same),
        tool_test(formats_do_not_depend_on_each_other),
        tool_test(bytes_do_not_depend_on_threads),
        tool_test(plots_are_drawn),
        tool_test(progress_is_for_terminals),
        tool_test(people_get_a_table_with_units),
        tool_test(bad_input_is_named_and_nothing_written),
        tool_test(wrong_usage_is_explained),
        tool_test(unit_slips_are_noted),
        tool_test(unwritable_output_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
