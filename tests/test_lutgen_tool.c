#include "lutgen/lut.h"
#include "tests/run_tool.h"

#include "io/file.h"

#include <jansson.h>
#include <sys/stat.h>

#define MATERIALS SOURCE_FOLDER "/materials/"

static struct tool_run run;

static void assert_same_bytes(const char *path, const char *other_path)
{
    char *data = NULL, *other = NULL;
    size_t size = 0, other_size = 0;
    assert_true(io_file_read(path, 1 << 24, &data, &size, NULL));
    assert_true(io_file_read(other_path, 1 << 24, &other, &other_size, NULL));
    assert_int_equal(size, other_size);
    assert_memory_equal(data, other, size);
    free(data);
    free(other);
}

/* Oracle: the tables on disk, audited again here. */
static void every_bundled_material_is_baked(void **state)
{
    (void)state;
    run_tool(&run, "lutgen", "--json", "-o", "a/b/tables", MATERIALS "apple.json",
             MATERIALS "chicken1.json", MATERIALS "chicken2.json", MATERIALS "cream.json",
             MATERIALS "ketchup.json", MATERIALS "marble.json", MATERIALS "potato.json",
             MATERIALS "skimmilk.json", MATERIALS "skin1.json", MATERIALS "skin2.json",
             MATERIALS "spectralon.json", MATERIALS "wholemilk.json");
    assert_done(&run);
    json_t *const result = json_loads(run.out, JSON_REJECT_DUPLICATES, NULL);
    const json_t *const files = json_object_get(result, "files");
    assert_int_equal(json_object_size(result), 1);
    assert_int_equal(json_array_size(files), 12);
    assert_int_equal(count_entries("a/b/tables"), 12);
    for (size_t i = 0; i < json_array_size(files); i++) {
        const json_t *const file = json_array_get(files, i);
        assert_int_equal(json_object_size(file), 5);
        struct lut_splat1d *lut = NULL;
        const char *const path = json_string_value(json_object_get(file, "path"));
        assert_non_null(path);
        assert_true(lut_splat1d_read(path, &lut, NULL));
        assert_string_equal(json_string_value(json_object_get(file, "kind")), "splat1d");
        assert_int_equal(json_integer_value(json_object_get(file, "size")), lut->axis.node_count);
        const double stated = json_number_value(json_object_get(file, "max_relative_error"));
        assert_true(stated == lut->max_relative_error && stated > 0 && stated <= 0.001);
        assert_true(json_number_value(json_object_get(file, "bake_ms")) > 0);
        assert_true(lut->epsilon == 0.001);
        assert_true(lut_splat1d_audit(lut, 10000, 11) <= stated);
        lut_splat1d_destroy(lut);
    }
    json_decref(result);
}

/* Oracle: same inputs, same bytes; another epsilon, other bytes. */
static void two_runs_give_the_same_bytes(void **state)
{
    (void)state;
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "one");
    assert_done(&run);
    run_tool(&run, "lutgen", "-q", "-o", "two", MATERIALS "marble.json");
    assert_done(&run);
    assert_same_bytes("one/marble.splat1d.exr", "two/marble.splat1d.exr");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "--half", "--epsilon", "0.01", "-o", "one");
    assert_done(&run);
    run_tool(&run, "lutgen", MATERIALS "marble.json", "--half", "--epsilon", "0.01", "-o", "two");
    assert_done(&run);
    assert_same_bytes("one/marble.splat1d.exr", "two/marble.splat1d.exr");
    assert_int_equal(count_entries("one"), 1);
    struct lut_splat1d *lut = NULL;
    assert_true(lut_splat1d_read("one/marble.splat1d.exr", &lut, NULL));
    assert_true(lut->epsilon == 0.01);
    lut_splat1d_destroy(lut);
}

/* Oracle: the words of the table, times aside. */
static void people_get_a_table_with_units(void **state)
{
    (void)state;
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", ".", "--epsilon", "0.1");
    assert_done(&run);
    assert_non_null(strstr(run.out, "path                  kind       size  max_relative_error   bake_ms\n"
                                    "                               texels                            ms\n"
                                    "./marble.splat1d.exr  splat1d      64 "));
}

/* Oracle: exact messages; no folder is made when an input is bad, even the last one. */
static void bad_input_is_named_and_nothing_written(void **state)
{
    (void)state;
    write_text("negative.json", "{ \"name\": \"n\", \"eta\": 1.3,\n  \"sigma_a_per_mm\": [0.1, -2, 0],\n"
                                "  \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_text("syntax.json", "{ \"name\": \"n\",\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "negative.json", "-o", "out");
    assert_failed(
        &run, 1,
        "lutgen: negative.json:2:27: sigma_a_per_mm[1] is -2, expected >= 0 (0, or 1e-50 to 1e+50)\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "syntax.json", "-o", "out");
    assert_failed(&run, 1,
                  "lutgen: syntax.json:2:1: JSON syntax: string or '}' expected near end of file\n");
    run_tool(&run, "lutgen", "missing.json", "-o", "out");
    assert_failed(&run, 1, "lutgen: missing.json: cannot be read: No such file or directory\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", MATERIALS "spectralon.json", "--half", "-o", "out");
    assert_failed(&run, 1,
                  "lutgen: " MATERIALS
                  "spectralon.json: channel R falls from 11.2 to 2.87e-09 per mm^2 within "
                  "r_max, more than half holds at epsilon 0.001; use float or a larger epsilon\n");
    mkdir("other", 0777);
    write_text("other/marble.json", "{ \"name\": \"n\", \"eta\": 1.3, \"sigma_a_per_mm\": [1, 2, 3],\n"
                                    "  \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_text("marble.json", "{}");
    run_tool(&run, "lutgen", "other/marble.json", "marble.json", "-o", "out");
    assert_failed(
        &run, 1,
        "lutgen: other/marble.json and marble.json would both become out/marble.splat1d.exr, expected "
        "different file names\n");
    assert_int_equal(count_entries("out"), -1);
}

/* Oracle: exact messages; a table that lutgen can bake, asked for beside, is not written either. */
static void other_models_are_refused_and_nothing_written(void **state)
{
    (void)state;
    write_text("beam.json", "{ \"name\": \"b\", \"eta\": 1.3, \"model\": \"beam\",\n"
                            "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    write_text("slab.json", "{ \"name\": \"s\", \"eta\": 1.3,\n  \"layers\": [{ \"thickness_mm\": 2,\n"
                            "  \"sigma_a_per_mm\": [1, 1, 1], \"sigma_s_prime_per_mm\": [1, 1, 1] }] }\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "beam.json", "-o", "out");
    assert_failed(
        &run, 1,
        "lutgen: beam.json:1:37: model is \"beam\", which cannot be done by this program, expected "
        "\"dipole\"\n");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "slab.json", "-o", "out");
    assert_failed(
        &run, 1,
        "lutgen: slab.json:2:13: layers cannot be done by this program, which knows the classical "
        "dipole only, expected one medium with the model \"dipole\"\n");
    assert_int_equal(count_entries("out"), -1);
}

/* Oracle: exact messages, exit code 2. */
static void wrong_usage_is_explained(void **state)
{
    (void)state;
    run_tool(&run, "lutgen", "x.json");
    assert_failed(&run, 2, "lutgen: no --output (-o) DIR was given; try --help\n");
    run_tool(&run, "lutgen", "-o", "out");
    assert_failed(&run, 2, "lutgen: 0 operands, expected at least 1: lutgen MATERIAL.json... -o DIR\n");
    run_tool(&run, "lutgen", "x.json", "-o", "out", "--kind", "tsm");
    assert_failed(&run, 2, "lutgen: --kind is \"tsm\", expected one of splat1d\n");
    run_tool(&run, "lutgen", "x.json", "-o", "out", "--epsilon", "0");
    assert_failed(&run, 2, "lutgen: --epsilon is \"0\", expected a number 1e-06 to 0.5\n");
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

/* Oracle: on a full disk the table that was there stays, and no other file. */
static void full_disk_leaves_what_was_there(void **state)
{
    (void)state;
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "out", "--epsilon", "0.1");
    assert_done(&run);
    assert_int_equal(system("cp out/marble.splat1d.exr before.exr"), 0);
    run_tool_limited(&run, 1000, "lutgen",
                     (const char *const[]){ MATERIALS "marble.json", "-o", "out", NULL });
    assert_failed(&run, 1, "lutgen: out/marble.splat1d.exr: cannot be written: File too large\n");
    assert_same_bytes("out/marble.splat1d.exr", "before.exr");
    assert_int_equal(count_entries("out"), 1);
}

/* Oracle: exact messages where the folder cannot be made or the name is taken by a folder. */
static void unwritable_output_is_named(void **state)
{
    (void)state;
    write_text("file", "");
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "file/out");
    assert_failed(&run, 1, "lutgen: file/out: cannot be made: Not a directory\n");
    mkdir("out", 0777);
    mkdir("out/marble.splat1d.exr", 0777);
    run_tool(&run, "lutgen", MATERIALS "marble.json", "-o", "out");
    assert_failed(&run, 1, "lutgen: out/marble.splat1d.exr: cannot be written: Is a directory\n");
    assert_int_equal(count_entries("out"), 1);
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
        tool_test(every_bundled_material_is_baked),
        tool_test(two_runs_give_the_same_bytes),
        tool_test(people_get_a_table_with_units),
        tool_test(bad_input_is_named_and_nothing_written),
        tool_test(other_models_are_refused_and_nothing_written),
        tool_test(wrong_usage_is_explained),
        tool_test(unit_slips_are_noted),
        tool_test(full_disk_leaves_what_was_there),
        tool_test(unwritable_output_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
