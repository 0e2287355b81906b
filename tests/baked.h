/* lutgen's result, and its tables read back. */
#ifndef BAKED_H
#define BAKED_H

#include "tests/run_tool.h"

#include "io/file.h"
#include "lutgen/lut.h"

#include <jansson.h>
#include <unistd.h>

/* lutgen --json with the arguments, which must succeed silently; returns "files". */
static inline json_t *bake(struct tool_run *run, const char *const *arguments)
{
    const char *all[128] = { "--json" };
    for (size_t i = 0; arguments[i]; i++) {
        assert_true(i + 2 < sizeof all / sizeof *all);
        all[i + 1] = arguments[i];
    }
    run_tool_limited(run, 0, "lutgen", all);
    assert_done(run);
    json_t *const result = json_loads(run->out, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(result);
    assert_int_equal(json_object_size(result), 1);
    json_t *const files = json_incref(json_object_get(result, "files"));
    assert_true(json_is_array(files));
    json_decref(result);
    return files;
}

#define BAKE(run, ...) bake(run, (const char *const[]){ __VA_ARGS__, NULL })

static inline const char *file_text(const json_t *files, size_t i, const char *key)
{
    const char *const text = json_string_value(json_object_get(json_array_get(files, i), key));
    assert_non_null(text);
    return text;
}

static inline double file_number(const json_t *files, size_t i, const char *key)
{
    const json_t *const number = json_object_get(json_array_get(files, i), key);
    assert_true(json_is_number(number));
    return json_number_value(number);
}

static inline bool file_is_current(const json_t *files, size_t i)
{
    const json_t *const value = json_object_get(json_array_get(files, i), "up_to_date");
    assert_true(json_is_boolean(value));
    return json_is_true(value);
}

/* A file of the result against the numbers of its table: their kind, size and errors. */
static inline void expect_described(const json_t *files, size_t i, const char *kind, const char *size,
                                    const struct lut_error *error)
{
    const json_t *const file = json_array_get(files, i);
    assert_int_equal(json_object_size(file), 7);
    assert_string_equal(file_text(files, i, "kind"), kind);
    char *const found = json_dumps(json_object_get(file, "size"), JSON_COMPACT | JSON_ENCODE_ANY);
    assert_string_equal(found, size);
    free(found);
    assert_true(file_number(files, i, "max_relative_error") == error->max);
    assert_true(file_number(files, i, "p99_relative_error") == error->p99);
    assert_true(error->p99 > 0 && error->p99 <= error->max);
    assert_true(file_is_current(files, i) == (file_number(files, i, "bake_ms") == 0));
}

static inline struct lut_splat *splat_read(const char *path)
{
    struct lut_splat *lut;
    dipole_status status;
    if (!lut_splat_read(path, &lut, &status))
        fail_msg("%s: %s", path, status.message);
    return lut;
}

static inline struct lut_tsm *tsm_read(const char *path)
{
    struct lut_tsm *lut;
    dipole_status status;
    if (!lut_tsm_read(path, &lut, &status))
        fail_msg("%s: %s", path, status.message);
    return lut;
}

/* File i of the result, an EXR file, is what the result says, and errs by no more than it says at points
 * that neither the bake nor its check has seen. */
static inline void audit_file(const json_t *files, size_t i, double epsilon)
{
    enum { SEED = 11, POINTS_PER_NODE = 40, DEPTHS = 100 };
    const char *const path = file_text(files, i, "path"), *const kind = file_text(files, i, "kind");
    struct lut_error found;
    char size[64];
    if (strcmp(kind, "tsm") == 0) {
        struct lut_tsm *const lut = tsm_read(path);
        snprintf(size, sizeof size, "[%d,%d,%d]", lut->size[0], lut->size[1], lut->size[2]);
        expect_described(files, i, kind, size, &lut->error);
        assert_true(lut->epsilon == epsilon && lut->error.max <= epsilon);
        assert_true(lut_tsm_audit(lut, DEPTHS, SEED, &found, NULL));
        if (!(found.max + lut->source_error <= lut->error.max))
            fail_msg("%s errs by %g + %g, not %g", path, found.max, lut->source_error, lut->error.max);
        lut_tsm_destroy(lut);
        return;
    }
    struct lut_splat *const lut = splat_read(path);
    struct lut_error worst = { 0 };
    for (size_t row = 0; row < lut->row_count; row++) {
        const struct lut_error *const stated = &lut->rows[row].error;
        worst = (struct lut_error){ fmax(worst.max, stated->max), fmax(worst.p99, stated->p99) };
        assert_true(lut_splat_audit(lut, row, POINTS_PER_NODE, SEED, &found, NULL));
        if (!(found.max <= stated->max))
            fail_msg("%s, row %zu errs by %g, not %g", path, row, found.max, stated->max);
    }
    snprintf(size, sizeof size, strcmp(kind, "splat1d") == 0 ? "%d" : "[%d,%zu]", lut->node_count,
             lut->row_count);
    expect_described(files, i, kind, size, &worst);
    assert_true(lut->epsilon == epsilon && worst.max <= epsilon);
    lut_splat_destroy(lut);
}

static inline char *read_whole(const char *path, size_t *size)
{
    char *data = NULL;
    if (!io_file_read(path, (size_t)1 << 28, &data, size, NULL))
        fail_msg("%s cannot be read", path);
    return data;
}

static inline bool has_same_bytes(const char *path, const char *other_path)
{
    size_t size, other_size;
    char *const data = read_whole(path, &size), *const other = read_whole(other_path, &other_size);
    const bool is_same = size == other_size && memcmp(data, other, size) == 0;
    free(data);
    free(other);
    return is_same;
}

#endif
