/* Tables on disk when things go wrong: a signal, a race, a folder or a disk that takes no more. */
#include "tests/run_tool.h"

#include "io/file.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <time.h>

#define MARBLE SOURCE_FOLDER "/materials/marble.json"
#define APPLE SOURCE_FOLDER "/materials/apple.json"

#if defined(__SANITIZE_ADDRESS__)
enum { TRY_COUNT = 8, TRY_LEAST = 4, RACE_ROUNDS = 1 };
static const double budget_s = 4;
#else
enum { TRY_COUNT = 40, TRY_LEAST = 10, RACE_ROUNDS = 4 };
static const double budget_s = 4;
#endif

/* What is baked, twice: old and new. Some have the same size, so that nothing but their bytes tells them
 * apart. */
struct kind {
    const char *name, *formats;
    struct version {
        const char *material, *size, *epsilon;
    } versions[2];
};
static const struct kind kinds[] = {
    { "splat1d", "exr", { { MARBLE, "0", "0.001" }, { MARBLE, "0", "0.00001" } } },
    { "splat2d", "exr", { { MARBLE, "0", "0.01" }, { MARBLE, "0", "0.001" } } },
    { "tsm", "exr", { { MARBLE, "0x0x0", "0.15" }, { MARBLE, "0x0x0", "0.1" } } },
    { "splat1d", "dds,raw", { { MARBLE, "800", "0.0002" }, { MARBLE, "800", "0.0001" } } },
    { "splat2d", "exr,dds,raw", { { APPLE, "400", "0.001" }, { MARBLE, "400", "0.001" } } },
    { "tsm", "exr,dds,raw", { { MARBLE, "48x40x32", "0.3" }, { MARBLE, "48x48x32", "0.3" } } },
};

static struct tool_run run;

static int free_run(void **state)
{
    (void)state;
    free(run.out);
    return 0;
}

/* ---- folders of tables ---------------------------------------------------------------------------- */

enum { TABLE_LIMIT = 16 };

struct table {
    char name[256];
    char *data;
    size_t size;
};

/* All files of a folder. */
struct tables {
    struct table tables[TABLE_LIMIT];
    size_t count;
};

static void tables_read(const char *folder, struct tables *out)
{
    DIR *const entries = opendir(folder);
    assert_non_null(entries);
    out->count = 0;
    for (const struct dirent *entry; (entry = readdir(entries)) != NULL;) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        assert_true(out->count < TABLE_LIMIT);
        struct table *const table = &out->tables[out->count++];
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        snprintf(table->name, sizeof table->name, "%s", entry->d_name);
        assert_true(io_file_read(path, 1 << 30, &table->data, &table->size, NULL));
    }
    closedir(entries);
}

static void tables_free(struct tables *tables)
{
    for (size_t i = 0; i < tables->count; i++)
        free(tables->tables[i].data);
    tables->count = 0;
}

static bool tables_have(const struct tables *tables, const struct table *table)
{
    for (size_t i = 0; i < tables->count; i++) {
        const struct table *const other = &tables->tables[i];
        if (strcmp(other->name, table->name) == 0)
            return other->size == table->size && memcmp(other->data, table->data, table->size) == 0;
    }
    return false;
}

/* Tables of one kind, baked in peace in the folders "old" and "new". */
struct pair {
    const struct kind *kind;
    struct tables old, new;
    size_t new_size;  /* of the largest file */
    double longest_s; /* of two runs that bake the new ones */
};

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* What to call lutgen with; ends with NULL. */
enum { ARGUMENT_COUNT = 14 };

static void arguments_set(const struct kind *kind, bool is_new, const char *folder,
                          const char *arguments[ARGUMENT_COUNT])
{
    const struct version *const version = &kind->versions[is_new];
    const char *const all[] = { version->material, "-q",          "-o",          folder,   "--epsilon",
                                version->epsilon,  "--size",      version->size, "--kind", kind->name,
                                "--format",        kind->formats, "--force",     NULL };
    memcpy(arguments, all, sizeof all);
}

static void bake(const struct kind *kind, bool is_new, const char *folder)
{
    const char *arguments[ARGUMENT_COUNT];
    arguments_set(kind, is_new, folder, arguments);
    run_tool_limited(&run, 0, "lutgen", arguments);
    assert_done(&run);
}

/* Every sidecar has the hash of the file beside it: FNV-1a, 64 bit. */
static void assert_sidecars_right(const struct tables *tables)
{
    for (size_t i = 0; i < tables->count; i++)
        for (size_t k = 0; k < tables->count; k++) {
            const struct table *const table = &tables->tables[i], *const other = &tables->tables[k];
            const size_t length = strlen(table->name);
            if (strncmp(table->name, other->name, length) != 0 ||
                strcmp(other->name + length, ".json") != 0)
                continue;
            uint64_t hash = 14695981039346656037U;
            char text[64];
            for (size_t n = 0; n < table->size; n++)
                hash = (hash ^ (uint8_t)table->data[n]) * 1099511628211U;
            snprintf(text, sizeof text, "\"content_hash\": \"%016llx\"", (unsigned long long)hash);
            assert_non_null(strstr(other->data, text));
        }
}

static void pair_init(const struct kind *kind, struct pair *out)
{
    *out = (struct pair){ .kind = kind };
    bake(kind, false, "old");
    for (int i = 0; i < 2; i++) {
        const double start_s = now_s();
        bake(kind, true, "new");
        out->longest_s = fmax(out->longest_s, now_s() - start_s);
    }
    tables_read("old", &out->old);
    tables_read("new", &out->new);
    assert_true(out->old.count > 0 && out->old.count == out->new.count);
    assert_sidecars_right(&out->old);
    assert_sidecars_right(&out->new);
    for (size_t i = 0; i < out->new.count; i++) {
        assert_false(tables_have(&out->old, &out->new.tables[i])); /* else nothing below could fail */
        if (out->new.tables[i].size > out->new_size)
            out->new_size = out->new.tables[i].size;
    }
}

static void pair_free(struct pair *pair)
{
    tables_free(&pair->old);
    tables_free(&pair->new);
    assert_int_equal(system("rm -rf old new out"), 0);
}

static void old_tables_put(void)
{
    assert_int_equal(system("rm -rf out && cp -r old out"), 0);
}

static bool ends_with(const char *s, const char *end)
{
    return strlen(s) >= strlen(end) && strcmp(s + strlen(s) - strlen(end), end) == 0;
}

/* Every file in "out" is the whole old or the whole new one, and none is missing: so a sidecar has the hash
 * of the table that it describes, whichever of the two lies beside it. Others: only temporaries, and only
 * where they could not be helped. */
static void assert_whole(const struct pair *pair, bool may_have_temporaries)
{
    struct tables found;
    tables_read("out", &found);
    size_t whole_count = 0;
    for (size_t i = 0; i < found.count; i++) {
        const struct table *const table = &found.tables[i];
        if (tables_have(&pair->old, table) || tables_have(&pair->new, table))
            whole_count++;
        else if (!(may_have_temporaries && strncmp(table->name, ".dipole-", 8) == 0))
            fail_msg("%s: %zu bytes that are neither the old nor the new file", table->name, table->size);
    }
    assert_int_equal(whole_count, pair->old.count);
    tables_free(&found);
}

/* Start lutgen into "out", silently. */
static pid_t start(const struct kind *kind, bool is_new)
{
    const char *arguments[ARGUMENT_COUNT], *argv[ARGUMENT_COUNT + 1] = { PROGRAM_FOLDER "/lutgen" };
    arguments_set(kind, is_new, "out", arguments);
    memcpy(argv + 1, arguments, sizeof arguments);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        const int null = open("/dev/null", O_RDWR);
        dup2(null, STDOUT_FILENO);
        dup2(null, STDERR_FILENO);
        execv(argv[0], (char *const *)(const void *)argv);
        _exit(127);
    }
    return child;
}

/* ---- signals -------------------------------------------------------------------------------------- */

static void interrupt(const struct pair *pair, int number)
{
    struct rng rng = { .seed = (uint64_t)number };
    int try_count = (int)(budget_s / 3 / pair->longest_s);
    try_count = try_count > TRY_COUNT ? TRY_COUNT : try_count < TRY_LEAST ? TRY_LEAST : try_count;
    int ended_count = 0;
    for (int i = 0; i < try_count; i++) {
        old_tables_put();
        const pid_t child = start(pair->kind, true);
        const double delay_s = uniform(&rng, 0, 1.1 * pair->longest_s);
        nanosleep(
            &(struct timespec){ .tv_sec = (time_t)delay_s, .tv_nsec = (long)(fmod(delay_s, 1) * 1e9) },
            NULL);
        assert_int_equal(kill(child, number), 0);
        int result = 0;
        assert_int_equal(waitpid(child, &result, 0), child);
        /* Done before the signal came, or ended by it, and says so. */
        assert_int_equal(WIFSIGNALED(result) ? WTERMSIG(result) : number, number);
        assert_true(WIFSIGNALED(result) || WEXITSTATUS(result) == 0);
        ended_count += WIFSIGNALED(result);
        assert_whole(pair, number == SIGKILL);
    }
    print_message("%s as %s: signal %d ended %d of %d\n", pair->kind->name, pair->kind->formats, number,
                  ended_count, try_count);
}

/* Oracle: the tables baked in peace; whatever moment a signal comes, the file is one of them, bit for bit,
 * and but for SIGKILL, which nobody can answer, nothing else is left. */
static void signals_leave_the_old_or_the_new_table(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct pair pair;
        pair_init(&kinds[i], &pair);
        interrupt(&pair, SIGTERM);
        interrupt(&pair, SIGINT);
        interrupt(&pair, SIGKILL);
        pair_free(&pair);
    }
}

/* ---- races ---------------------------------------------------------------------------------------- */

/* Oracle: as above; many that write the same file at once do not disturb each other. */
static void writers_at_once_leave_one_whole_table(void **state)
{
    (void)state;
    enum { WRITERS = 16 };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct pair pair;
        pair_init(&kinds[i], &pair);
        for (int round = 0; round < RACE_ROUNDS; round++) {
            old_tables_put();
            pid_t children[WRITERS];
            for (int k = 0; k < WRITERS; k++)
                children[k] = start(&kinds[i], k % 2);
            for (int k = 0; k < WRITERS; k++) {
                int result = 0;
                assert_int_equal(waitpid(children[k], &result, 0), children[k]);
                assert_true(WIFEXITED(result) && WEXITSTATUS(result) == 0);
            }
            assert_whole(&pair, false);
        }
        pair_free(&pair);
    }
}

/* ---- disks and folders ---------------------------------------------------------------------------- */

/* lutgen into folder must fail, with one line that names what is in there and the reason. */
static void assert_refused(const struct kind *kind, const char *folder, const char *reason)
{
    const char *arguments[ARGUMENT_COUNT];
    char start_of_line[300];
    arguments_set(kind, true, folder, arguments);
    run_tool_limited(&run, 0, "lutgen", arguments);
    snprintf(start_of_line, sizeof start_of_line, "lutgen: %s", folder);
    if (run.exit_code != 1 || strncmp(run.err, start_of_line, strlen(start_of_line)) != 0 ||
        !ends_with(run.err, reason) || strchr(run.err, '\n')[1] != '\0')
        fail_msg("exit code %d, \"%s\", expected 1 and \"%s...%s\"", run.exit_code, run.err, start_of_line,
                 reason);
    assert_string_equal(run.out, "");
}

/* Oracle: the old tables; wherever the disk gets full, they stay, and the message names a file that did not
 * get written. With room for the largest file all is well. */
static void full_disks_leave_the_old_table(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct pair pair;
        pair_init(&kinds[i], &pair);
        const size_t size = pair.new_size;
        const size_t limits[] = { 0, 1, 511, size / 3, size / 2, size - 1, size };
        for (size_t k = 0; k < sizeof limits / sizeof *limits; k++) {
            old_tables_put();
            struct rlimit before, limit;
            assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
            limit = (struct rlimit){ .rlim_cur = limits[k], .rlim_max = before.rlim_max };
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0); /* lutgen inherits it */
            if (limits[k] < size)
                assert_refused(&kinds[i], "out", ": cannot be written: File too large\n");
            else
                bake(&kinds[i], true, "out");
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
            assert_whole(&pair, false);
        }
        pair_free(&pair);
    }
}

/* Oracle: the reasons of the system, and the folder as it was. */
static void unusable_folders_are_named(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        write_text("file", "text");
        assert_int_equal(symlink("nowhere", "dangling"), 0);
        assert_refused(&kinds[i], "/dev/full", ": cannot be made: Not a directory\n");
        assert_refused(&kinds[i], "/dev/full/below", ": cannot be made: Not a directory\n");
        assert_refused(&kinds[i], "file", ": cannot be made: Not a directory\n");
        assert_refused(&kinds[i], "file/below", ": cannot be made: Not a directory\n");
        assert_refused(&kinds[i], "dangling", ": cannot be made: File exists\n");
        assert_int_equal(count_entries("."), 2);
        assert_int_equal(unlink("file") | unlink("dangling"), 0);
    }
}

/* Oracle: the old tables. For root, permissions count only once it has lost the right to pass over them. */
static void a_folder_that_is_read_only_stays_as_it_was(void **state)
{
    (void)state;
    prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0); /* of the programs run from here on */
    assert_int_equal(mkdir("probe", 0555), 0);
    if (system("touch probe/file 2>/dev/null") == 0) {
        print_message("permissions do not bind this user\n");
        skip();
    }
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct pair pair;
        pair_init(&kinds[i], &pair);
        old_tables_put();
        assert_int_equal(chmod("out", 0555), 0);
        assert_refused(&kinds[i], "out", ": cannot be written: Permission denied\n");
        assert_refused(&kinds[i], "out/below", ": cannot be made: Permission denied\n");
        tables_free(&pair.new); /* so that only the old ones are whole */
        assert_whole(&pair, false);
        assert_int_equal(chmod("out", 0755), 0);
        pair_free(&pair);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(signals_leave_the_old_or_the_new_table),
        tool_test(writers_at_once_leave_one_whole_table),
        tool_test(full_disks_leave_the_old_table),
        tool_test(unusable_folders_are_named),
        tool_test(a_folder_that_is_read_only_stays_as_it_was), /* last: it gives up a right */
    };
    return cmocka_run_group_tests(tests, NULL, free_run);
}
