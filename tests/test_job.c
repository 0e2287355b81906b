/* lutgen a second time: what is there and right is left alone, everything else is baked anew. */
#include "tests/baked.h"

#include <sys/stat.h>

#define MARBLE SOURCE_FOLDER "/materials/marble.json"
#define APPLE SOURCE_FOLDER "/materials/apple.json"

static struct tool_run run;

static const char *const kinds[] = { "splat1d", "splat2d", "tsm" };
static const char *const paths[] = { "out/marble.splat1d.exr", "out/materials.splat2d.exr",
                                     "out/marble.tsm.exr" };
/* Of the smallest files that there are. */
static const char *const epsilons[] = { "0.3", "0.3", "0.4" }, *const sizes[] = { "50", "50", "32x48x16" };
enum { KIND_COUNT = 3 };

/* Bake that kind of table of marble. */
static json_t *bake_small(int kind)
{
    return BAKE(&run, MARBLE, "-o", "out", "--kind", kinds[kind], "--epsilon", epsilons[kind], "--size",
                sizes[kind]);
}

/* Of everything in "out", by name. */
struct folder {
    struct entry {
        char name[256];
        struct timespec changed;
        ino_t number;
        char *data;
        size_t size;
    } entries[32];
    size_t count;
};

static void folder_read(struct folder *out)
{
    DIR *const folder = opendir("out");
    assert_non_null(folder);
    out->count = 0;
    for (const struct dirent *at; (at = readdir(folder)) != NULL;) {
        struct stat info;
        char path[512];
        struct entry *const entry = &out->entries[out->count];
        if (at->d_name[0] == '.' && (at->d_name[1] == '\0' || at->d_name[1] == '.'))
            continue;
        snprintf(path, sizeof path, "out/%s", at->d_name);
        snprintf(entry->name, sizeof entry->name, "%s", at->d_name);
        assert_int_equal(stat(path, &info), 0);
        entry->changed = info.st_mtim;
        entry->number = info.st_ino;
        entry->data = read_whole(path, &entry->size);
        assert_true(++out->count < sizeof out->entries / sizeof *out->entries);
    }
    closedir(folder);
}

static void folder_free(struct folder *folder)
{
    for (size_t i = 0; i < folder->count; i++)
        free(folder->entries[i].data);
}

static void expect_same_entries(const struct folder *before, bool is_untouched)
{
    struct folder now;
    folder_read(&now);
    assert_int_equal(now.count, before->count);
    for (size_t i = 0; i < now.count; i++) {
        size_t k = 0;
        while (k < before->count && strcmp(before->entries[k].name, now.entries[i].name) != 0)
            k++;
        if (k == before->count)
            fail_msg("%s was not there", now.entries[i].name);
        const struct entry *const a = &now.entries[i], *const b = &before->entries[k];
        if (a->size != b->size || memcmp(a->data, b->data, a->size) != 0)
            fail_msg("%s has other bytes", a->name);
        const bool is_same_file = a->number == b->number && a->changed.tv_sec == b->changed.tv_sec &&
                                  a->changed.tv_nsec == b->changed.tv_nsec;
        if (is_same_file != is_untouched)
            fail_msg("%s was %s", a->name, is_untouched ? "written again" : "not written again");
    }
    folder_free(&now);
}

/* ---- left alone ------------------------------------------------------------------------------------- */

/* Oracle: the files' bytes, times and inode numbers; --force writes the same bytes again. */
static void a_second_run_touches_nothing(void **state)
{
    (void)state;
    static const char *const arguments[] = {
        MARBLE, APPLE, "-o", "out", "--kind", "splat1d,splat2d,tsm", "--format", "exr,dds,raw", NULL, NULL
    };
    const char *forced[sizeof arguments / sizeof *arguments];
    memcpy(forced, arguments, sizeof arguments);
    forced[8] = "--force";
    json_t *const first = bake(&run, arguments);
    struct folder before;
    folder_read(&before);
    assert_int_equal(before.count, 5 * 5);
    for (int round = 0; round < 2; round++) {
        json_t *const again = bake(&run, round == 0 ? arguments : forced);
        assert_int_equal(json_array_size(again), 15);
        for (size_t i = 0; i < 15; i++) {
            assert_false(file_is_current(first, i));
            assert_true(file_is_current(again, i) == (round == 0));
            assert_true((file_number(again, i, "bake_ms") == 0) == (round == 0));
            assert_string_equal(file_text(again, i, "path"), file_text(first, i, "path"));
            assert_true(json_equal(json_object_get(json_array_get(again, i), "size"),
                                   json_object_get(json_array_get(first, i), "size")));
            static const char *const same[] = { "max_relative_error", "p99_relative_error" };
            for (int k = 0; k < 2; k++)
                assert_true(file_number(again, i, same[k]) == file_number(first, i, same[k]));
        }
        expect_same_entries(&before, round == 0);
        json_decref(again);
    }
    folder_free(&before);
    json_decref(first);
}

/* Oracle: the files' bytes, times and inode numbers. Without an EXR file a table is baked to be compared,
 * but what holds the same bytes keeps its date. */
static void files_of_other_formats_keep_their_dates(void **state)
{
    (void)state;
    static const char *const arguments[] = { MARBLE,     "-o",      "out", "--kind", "splat1d,tsm",
                                             "--format", "dds,raw", NULL,  NULL };
    const char *forced[sizeof arguments / sizeof *arguments];
    memcpy(forced, arguments, sizeof arguments);
    forced[7] = "--force";
    json_decref(bake(&run, arguments));
    struct folder before;
    folder_read(&before);
    assert_int_equal(before.count, 2 * 4);
    for (int round = 0; round < 2; round++) {
        json_t *const again = bake(&run, round == 0 ? arguments : forced);
        assert_int_equal(json_array_size(again), 4);
        for (size_t i = 0; i < 4; i++)
            assert_true(file_is_current(again, i) == (round == 0));
        expect_same_entries(&before, round == 0);
        json_decref(again);
    }
    folder_free(&before);
}

/* Oracle: a run in peace. Threads, the folder's name, the file's place and what does not decide the bytes
 * leave a table alone; what it does not know of stays, too. */
static void what_does_not_matter_is_left_alone(void **state)
{
    (void)state;
    write_text("a.json", "{ \"name\": \"a\", \"eta\": 1.3, \"sigma_a_per_mm\": [1, 1, 1],\n"
                         "  \"sigma_s_prime_per_mm\": [1, 2, 3] }\n");
    json_decref(BAKE(&run, "a.json", "-o", "out", "--kind", "splat1d,tsm", "--threads", "1"));
    mkdir("below", 0700);
    write_text("below/a.json", "{\n  \"name\": \"a\",\n  \"extras\": \"elsewhere\", \"eta\": 1.3,\n"
                               "  \"sigma_s_prime_per_mm\": [1, 2, 3], \"sigma_a_per_mm\": [1, 1, 1] }\n");
    struct folder before;
    folder_read(&before);
    json_t *const files =
        BAKE(&run, "below/a.json", "-o", "./out/", "--kind", "tsm,splat1d", "--threads", "2", "-q");
    assert_true(file_is_current(files, 0) && file_is_current(files, 1));
    json_decref(files);
    expect_same_entries(&before, true);
    folder_free(&before);
}

/* ---- baked anew -------------------------------------------------------------------------------------- */

/* Bake as arguments say into "out", where a table of another request lies, and alone: the bytes are the
 * same, and the first one was not taken for it. */
static void expect_baked_anew(const char *const *others, const char *const *arguments)
{
    const char *all[24] = { "-o", "out" };
    assert_int_equal(system("rm -rf out alone"), 0);
    for (size_t i = 0; others[i]; i++)
        all[i + 2] = others[i];
    json_decref(bake(&run, all));
    memset(all + 2, 0, sizeof all - 2 * sizeof *all);
    for (size_t i = 0; arguments[i]; i++)
        all[i + 2] = arguments[i];
    json_t *const files = bake(&run, all);
    const size_t count = json_array_size(files);
    assert_true(count > 0);
    all[1] = "alone";
    json_decref(bake(&run, all));
    assert_int_equal(count_entries("out"), count_entries("alone"));
    for (size_t i = 0; i < count; i++) {
        char path[512];
        assert_false(file_is_current(files, i));
        snprintf(path, sizeof path, "alone/%s", strrchr(file_text(files, i, "path"), '/') + 1);
        assert_true(has_same_bytes(file_text(files, i, "path"), path));
    }
    json_decref(files);
}

#define ARGUMENTS(...) ((const char *const[]){ __VA_ARGS__, NULL })

/* Oracle: a run into an empty folder. */
static void another_request_is_baked_anew(void **state)
{
    (void)state;
    static const char other[] =
        "{ \"name\": \"Marble\", \"eta\": 1.5, \"sigma_a_per_mm\": [0.0021, 0.0041, "
        "0.0071],\n  \"sigma_s_prime_per_mm\": [2.19, 2.62, 3.000001] }\n";
    static const char renamed[] =
        "{ \"name\": \"Murble\", \"eta\": 1.5, \"sigma_a_per_mm\": [0.0021, 0.0041, "
        "0.0071],\n  \"sigma_s_prime_per_mm\": [2.19, 2.62, 3] }\n";
    static const char model[] =
        "{ \"name\": \"Marble\", \"eta\": 1.5, \"model\": \"better_dipole\", \"sigma_a_per_mm\": [0.0021, "
        "0.0041, 0.0071],\n  \"sigma_s_prime_per_mm\": [2.19, 2.62, 3] }\n";
    static const char source[] =
        "{ \"name\": \"Marble\", \"source\": \"me\", \"eta\": 1.5, \"sigma_a_per_mm\": [0.0021, 0.0041, "
        "0.0071],\n  \"sigma_s_prime_per_mm\": [2.19, 2.62, 3] }\n";
    static const char *const texts[] = { other, renamed, model, source };
    assert_int_equal(mkdir("below", 0700), 0);
    for (int i = 0; i < KIND_COUNT; i++) {
        const char *const kind = kinds[i];
        for (size_t k = 0; k < 4; k++) {
            write_text("below/marble.json", texts[k]);
            expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind), ARGUMENTS("below/marble.json", "-k", kind));
        }
        expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind), ARGUMENTS(MARBLE, "-k", kind, "--half"));
        expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind, "--half"), ARGUMENTS(MARBLE, "-k", kind));
        expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind, "-e", "0.3"),
                          ARGUMENTS(MARBLE, "-k", kind, "-e", "0.3000001"));
        const char *const size = i == 2 ? "64x64x32" : "100"; /* which a volume has, too, unasked */
        expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind), ARGUMENTS(MARBLE, "-k", kind, "-s", size));
        expect_baked_anew(ARGUMENTS(MARBLE, "-k", kind, "-s", size), ARGUMENTS(MARBLE, "-k", kind));
    }
    expect_baked_anew(ARGUMENTS(MARBLE, "-k", "splat2d"), ARGUMENTS(MARBLE, APPLE, "-k", "splat2d"));
    expect_baked_anew(ARGUMENTS(APPLE, MARBLE, "-k", "splat2d"), ARGUMENTS(MARBLE, APPLE, "-k", "splat2d"));
    /* what lies under the name is a table, but of another kind */
    json_decref(BAKE(&run, MARBLE, "-o", "out", "-k", "splat1d,tsm"));
    assert_int_equal(rename("out/marble.tsm.exr", "out/marble.splat1d.exr"), 0);
    json_t *const files = BAKE(&run, MARBLE, "-o", "out", "-k", "splat1d,tsm");
    assert_false(file_is_current(files, 0) || file_is_current(files, 1));
    json_decref(files);
}

/* Put size bytes under path, run lutgen for that kind; whether it took them for current. */
static bool is_taken(int kind, const char *data, size_t size)
{
    assert_true(io_file_write(paths[kind], data, size, NULL));
    json_t *const files = bake_small(kind);
    const bool is_current = file_is_current(files, 0);
    json_decref(files);
    return is_current;
}

static void expect_bytes(const char *path, const char *data, size_t size)
{
    size_t found_size;
    char *const found = read_whole(path, &found_size);
    assert_int_equal(found_size, size);
    assert_memory_equal(found, data, size);
    free(found);
}

static bool is_same_image(const struct io_image *a, const struct io_image *b)
{
    if (a->width_px != b->width_px || a->height_px != b->height_px ||
        a->channel_count != b->channel_count || a->attribute_count != b->attribute_count)
        return false;
    const size_t count = (size_t)a->width_px * (size_t)a->height_px * (size_t)a->channel_count;
    bool is_same = memcmp(a->pixels, b->pixels, count * sizeof *a->pixels) == 0;
    for (size_t i = 0; i < a->attribute_count && is_same; i++) {
        const struct io_attribute *const x = &a->attributes[i], *const y = io_image_find(b, x->name);
        is_same = y && x->kind == y->kind && (!x->text || strcmp(x->text, y->text) == 0);
        for (int k = 0; k < 3 && is_same; k++)
            is_same = x->numbers[k] == y->numbers[k];
    }
    return is_same;
}

/* Oracle: the file that was there: after a run its bytes are back, wherever one was changed, or the change
 * was of nothing that a table has: it reads the same. */
static void a_damaged_table_is_baked_anew(void **state)
{
    (void)state;
    struct rng rng = { .seed = 17 };
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        json_decref(bake_small(kind));
        size_t size;
        char *const good = read_whole(paths[kind], &size), *const bad = read_whole(paths[kind], &size);
        struct io_image *image;
        assert_true(io_exr_read(paths[kind], &image, NULL));
        int harmless_count = 0;
        for (int i = 0; i < 60; i++) {
            /* half of them in the texels, at the end */
            const size_t at = i % 2 ? random_bits(&rng) % size : size - 1 - random_bits(&rng) % (size / 3);
            bad[at] = (char)(good[at] ^ (char)(1U << random_bits(&rng) % 8));
            struct io_image *found = NULL;
            assert_true(io_file_write(paths[kind], bad, size, NULL));
            const bool is_harmless = io_exr_read(paths[kind], &found, NULL) && is_same_image(found, image);
            io_image_destroy(found);
            harmless_count += is_harmless;
            if (is_taken(kind, bad, size) != is_harmless)
                fail_msg("%s: byte %zu of %zu is %d instead of %d", paths[kind], at, size, bad[at],
                         good[at]);
            if (!is_harmless)
                expect_bytes(paths[kind], good, size);
            bad[at] = good[at];
        }
        assert_true(harmless_count < 10);
        for (int i = 0; i < 12; i++) {
            const size_t length = i < 3 ? (size_t)i : i == 3 ? size - 1 : random_bits(&rng) % size;
            assert_false(is_taken(kind, good, length));
            expect_bytes(paths[kind], good, size);
        }
        io_image_destroy(image);
        free(good);
        free(bad);
    }
}

static void attribute_change(struct io_image *image, size_t i, int way)
{
    struct io_attribute *const attribute = &image->attributes[i];
    if (way == 0) {
        attribute->name[strlen(attribute->name) - 1] ^= 1; /* renamed */
    } else if (attribute->kind != IO_ATTRIBUTE_TEXT) {
        attribute->numbers[0] = way == 1 ? attribute->numbers[0] * (1 + 0x1p-50) + 0x1p-1000 : NAN;
    } else {
        char text[65536];
        snprintf(text, sizeof text, "%s%s", attribute->text, way == 1 ? " " : "x");
        assert_true(io_image_set_text(image, attribute->name, text));
    }
}

/* Oracle: the file that was there; each attribute in turn is renamed, changed in its last bit, or
 * replaced. */
static void a_changed_attribute_is_noticed(void **state)
{
    (void)state;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        json_decref(bake_small(kind));
        size_t size;
        char *const good = read_whole(paths[kind], &size);
        struct io_image *image;
        assert_true(io_exr_read(paths[kind], &image, NULL));
        const size_t count = image->attribute_count;
        assert_true(count > 12);
        for (size_t i = 0; i < count; i++)
            for (int way = 0; way < 3; way++) {
                size_t bad_size;
                struct io_image *changed;
                assert_true(io_file_write(paths[kind], good, size, NULL));
                assert_true(io_exr_read(paths[kind], &changed, NULL));
                attribute_change(changed, i, way);
                assert_true(io_exr_write(paths[kind], changed, false, NULL));
                char *const bad = read_whole(paths[kind], &bad_size);
                if (is_taken(kind, bad, bad_size))
                    fail_msg("%s: change %d of attribute %s was not noticed", paths[kind], way,
                             image->attributes[i].name);
                expect_bytes(paths[kind], good, size);
                free(bad);
                io_image_destroy(changed);
            }
        io_image_destroy(image);
        free(good);
    }
}

/* Change the first text in the file that stands there; its length stays. */
static void text_replace(const char *path, const char *text, const char *other)
{
    size_t size;
    char *const data = read_whole(path, &size);
    size_t at = 0;
    while (at < size && strncmp(data + at, text, strlen(text)) != 0)
        at++;
    assert_true(at < size);
    assert_int_equal(strlen(text), strlen(other));
    memcpy(data + at, other, strlen(other));
    assert_true(io_file_write(path, data, size, NULL));
    free(data);
}

static void byte_flip(const char *path, size_t at)
{
    size_t size;
    char *const data = read_whole(path, &size);
    data[at % size] ^= 1;
    assert_true(io_file_write(path, data, size, NULL));
    free(data);
}

/* Oracle: the folder as it was: a DDS file, raw numbers or a sidecar that is missing or changed is made
 * again. */
static void files_beside_are_looked_at_too(void **state)
{
    (void)state;
    static const char *const names[] = { "marble.splat1d", "materials.splat2d", "marble.tsm" };
    static const char *const ends[] = { "exr", "dds", "dds.json", "raw", "raw.json" };
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        const char *const arguments[] = { MARBLE,         "-o",       "out",         "--kind",
                                          kinds[kind],    "--format", "exr,dds,raw", "--epsilon",
                                          epsilons[kind], "--size",   sizes[kind],   NULL };
        assert_int_equal(system("rm -rf out"), 0);
        json_decref(bake(&run, arguments));
        struct folder before;
        folder_read(&before);
        for (size_t i = 0; i < 5; i++)
            for (int way = 0; way < 4; way++) {
                char path[256], message[300];
                snprintf(path, sizeof path, "out/%s.%s", names[kind], ends[i]);
                snprintf(message, sizeof message, "%s, way %d", path, way);
                if (i == 0 && way == 3)
                    continue; /* elsewhere, at every place */
                const bool is_sidecar = strstr(ends[i], "json") != NULL;
                if (way == 0)
                    assert_int_equal(unlink(path), 0);
                else if (way == 1)
                    assert_int_equal(truncate(path, 90), 0);
                else if (way == 2 && is_sidecar)
                    text_replace(path, "\"dipole:epsilon\": 0.", "\"dipole:epsilon\": 1.");
                else if (way == 3 && is_sidecar)
                    text_replace(path, "\"content_hash\": \"", "\"content_hush\": \"");
                else
                    byte_flip(path, way == 2 ? 100000 : 9);
                json_t *const files = bake(&run, arguments);
                for (size_t k = 0; k < 3; k++)
                    if (file_is_current(files, k))
                        fail_msg("%s was not noticed", message);
                json_decref(files);
                struct folder now;
                folder_read(&now);
                folder_free(&now);
                assert_int_equal(now.count, 5);
                for (size_t k = 0; k < before.count; k++) {
                    char kept[300];
                    snprintf(kept, sizeof kept, "out/%s", before.entries[k].name);
                    expect_bytes(kept, before.entries[k].data, before.entries[k].size);
                }
            }
        folder_free(&before);
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
        tool_test(a_second_run_touches_nothing),       tool_test(files_of_other_formats_keep_their_dates),
        tool_test(what_does_not_matter_is_left_alone), tool_test(another_request_is_baked_anew),
        tool_test(a_damaged_table_is_baked_anew),      tool_test(a_changed_attribute_is_noticed),
        tool_test(files_beside_are_looked_at_too),
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
