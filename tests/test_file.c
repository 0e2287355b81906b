#include "tests/check.h"

#include "io/file.h"

#include <dirent.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Each test works in an empty folder of its own. */
static int enter_empty_folder(void **state)
{
    (void)state;
    return system("rm -rf empty && mkdir empty") == 0 && chdir("empty") == 0 ? 0 : -1;
}

static int leave_folder(void **state)
{
    (void)state;
    return chdir("..");
}

static int entry_count(const char *folder)
{
    DIR *entries = opendir(folder);
    int count = 0;
    while (readdir(entries))
        count++;
    closedir(entries);
    return count - 2; /* . and .. */
}

static void put_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static void expect_file(const char *path, const char *text)
{
    char *data;
    size_t size;
    assert_true(io_file_read(path, 1000, &data, &size, NULL));
    assert_string_equal(data, text);
    assert_int_equal(size, strlen(text));
    free(data);
}

/* Oracle: what was written is what is read, NUL and empty files included. */
static void written_bytes_are_read_back(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    static const size_t sizes[] = { 0, 1, 4096, 65535, 65536, 65537, 1000003 };
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        char *bytes = malloc(sizes[i] + 1), *found;
        for (size_t k = 0; k < sizes[i]; k++)
            bytes[k] = (char)random_bits(&rng);
        size_t size;
        assert_true(io_file_write("a", bytes, sizes[i], NULL));
        assert_true(io_file_read("a", sizes[i], &found, &size, NULL));
        assert_int_equal(size, sizes[i]);
        assert_memory_equal(found, bytes, size);
        assert_int_equal(found[size], 0);
        free(found);
        if (sizes[i] > 0) {
            dipole_status status;
            assert_false(io_file_read("a", sizes[i] - 1, &found, &size, &status));
            assert_null(found);
            assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        }
        free(bytes);
    }
    assert_int_equal(entry_count("."), 1);
}

/* Oracle: a pipe has no size, yet all that comes through it is read, and the limit holds. */
static void a_pipe_is_read_to_its_end(void **state)
{
    (void)state;
    enum { SIZE = 300000 };
    assert_int_equal(mkfifo("pipe", 0600), 0);
    for (size_t limit = SIZE - 1; limit <= SIZE; limit++) {
        const pid_t child = fork();
        if (child == 0) {
            signal(SIGPIPE, SIG_IGN);
            FILE *file = fopen("pipe", "w");
            for (int i = 0; i < SIZE; i++)
                fputc('x', file);
            fclose(file);
            _exit(0);
        }
        char *data;
        size_t size;
        assert_int_equal(io_file_read("pipe", limit, &data, &size, NULL), limit == SIZE);
        assert_int_equal(size, limit == SIZE ? SIZE : 0);
        free(data);
        waitpid(child, NULL, 0);
    }
}

static void expect_unreadable(const char *path, dipole_code code, const char *message)
{
    dipole_status status;
    char *data;
    size_t size;
    assert_false(io_file_read(path, 1000, &data, &size, &status));
    assert_null(data);
    assert_int_equal(status.code, code);
    assert_string_equal(status.source, path);
    assert_string_equal(status.message, message);
}

/* Oracle: the messages as a user should read them. */
static void what_cannot_be_read_is_named(void **state)
{
    (void)state;
    put_file("file", "x");
    expect_unreadable("missing", DIPOLE_NOT_FOUND, "cannot be read: No such file or directory");
    expect_unreadable("file/inside", DIPOLE_NOT_FOUND, "cannot be read: Not a directory");
    expect_unreadable(".", DIPOLE_IO_FAILED, "is a folder, expected a file");
}

static void expect_unwritable(const char *path, dipole_code code, const char *message)
{
    dipole_status status;
    assert_false(io_file_write(path, "new", 3, &status));
    assert_int_equal(status.code, code);
    assert_string_equal(status.source, path);
    assert_string_equal(status.message, message);
}

/* Oracle: the messages as a user should read them; nothing new may stand in the folder afterwards. */
static void what_cannot_be_written_is_named(void **state)
{
    (void)state;
    put_file("file", "old");
    mkdir("folder", 0700);
    expect_unwritable("file/out", DIPOLE_NOT_FOUND, "cannot be written: Not a directory");
    expect_unwritable("missing/out", DIPOLE_NOT_FOUND, "cannot be written: No such file or directory");
    expect_unwritable("folder", DIPOLE_IO_FAILED, "cannot be written: Is a directory");
    assert_int_equal(entry_count("."), 2);
    expect_file("file", "old");
}

/* Oracle: a file as large as the system allows; the old file stays, and no other is left. */
static void a_full_disk_leaves_the_old_file(void **state)
{
    (void)state;
    put_file("file", "old");
    const pid_t child = fork();
    if (child == 0) {
        const struct rlimit limit = { .rlim_cur = 1000, .rlim_max = 1000 };
        static char data[5000];
        dipole_status status;
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        _exit(io_file_write("file", data, sizeof data, &status)                  ? 1
              : status.code != DIPOLE_IO_FAILED                                  ? 2
              : strcmp(status.message, "cannot be written: File too large") != 0 ? 3
                                                                                 : 0);
    }
    int result;
    waitpid(child, &result, 0);
    assert_true(WIFEXITED(result));
    assert_int_equal(WEXITSTATUS(result), 0);
    expect_file("file", "old");
    assert_int_equal(entry_count("."), 1);
}

/* Oracle: a device is still a device after it was written to. It is reached through a link, so that a
 * mistake replaces the link and not the machine's device. */
static void a_device_is_written_to_and_not_replaced(void **state)
{
    (void)state;
    struct stat info;
    assert_int_equal(symlink("/dev/null", "null"), 0);
    assert_int_equal(symlink("/dev/full", "full"), 0);
    assert_true(io_file_write("null", "x", 1, NULL));
    assert_int_equal(stat("null", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    expect_unwritable("full", DIPOLE_IO_FAILED, "cannot be written: No space left on device");
    assert_int_equal(stat("full", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    assert_int_equal(entry_count("."), 2);
}

/* Oracle: whatever moment a reader looks, it sees one whole version. */
static void a_reader_never_sees_half_a_file(void **state)
{
    (void)state;
    enum { SIZE = 100000, ROUNDS = 100 };
    static char block[SIZE];
    assert_true(io_file_write("file", block, SIZE, NULL));
    const pid_t child = fork();
    if (child == 0) {
        bool done = true;
        for (int i = 0; i < ROUNDS; i++) {
            memset(block, i, SIZE);
            done = io_file_write("file", block, SIZE, NULL) && done;
        }
        _exit(done ? 0 : 1);
    }
    int result = 0;
    while (waitpid(child, &result, WNOHANG) == 0) {
        char *data;
        size_t size;
        assert_true(io_file_read("file", SIZE, &data, &size, NULL));
        assert_int_equal(size, SIZE);
        assert_memory_equal(data, data + 1, SIZE - 1);
        free(data);
    }
    assert_int_equal(result, 0);
    assert_int_equal(entry_count("."), 1);
}

/* ---- checked writing -------------------------------------------------------------------------------- */

enum { CHECKED_SIZE = 100003 };

/* What a check saw, and what it shall say. */
struct watch {
    const char *folder;     /* of the file that is written                    */
    const char *old;        /* what stands there under its name; NULL: nothing */
    const char *path;       /* the name it shall have                          */
    const char *data;       /* CHECKED_SIZE bytes that are written             */
    const char *message;    /* NULL: passes; else what is wrong with the file  */
    const char *own_source; /* or with another one                             */
    int calls;
};

static bool watch_file(void *context, const char *path, dipole_status *status)
{
    struct watch *const watch = context;
    char *data;
    size_t size;
    watch->calls++;
    assert_string_not_equal(path, watch->path);
    assert_int_equal(strncmp(path, watch->folder, strlen(watch->folder)), 0);
    assert_null(strchr(path + strlen(watch->folder) + 1, '/'));
    assert_true(io_file_read(path, CHECKED_SIZE, &data, &size, NULL));
    assert_int_equal(size, CHECKED_SIZE);
    assert_memory_equal(data, watch->data, size);
    free(data);
    if (watch->old)
        expect_file(watch->path, watch->old);
    else
        assert_int_equal(access(watch->path, F_OK), -1);
    const dipole_place place = { .source = watch->own_source ? watch->own_source : path, .line = 3 };
    return !watch->message || dipole_fail(status, DIPOLE_BAD_VALUE, &place, "%s", watch->message);
}

/* Oracle: the bytes that are written; while they are looked at, the name still has the old ones. */
static void a_check_sees_the_whole_file_before_it_has_its_name(void **state)
{
    (void)state;
    static char data[CHECKED_SIZE];
    struct rng rng = { .seed = 8 };
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (char)random_bits(&rng);
    assert_int_equal(mkdir("folder", 0700), 0);
    struct watch watches[] = { { .folder = "folder", .path = "folder/file" },
                               { .folder = "folder", .path = "folder/file" },
                               { .folder = ".", .path = "file" } };
    watches[1].old = "old";
    for (size_t i = 0; i < 3; i++) {
        struct watch *const watch = &watches[i];
        watch->data = data;
        if (watch->old)
            put_file(watch->path, watch->old);
        assert_true(io_file_write_checked(watch->path, data, sizeof data, watch_file, watch, NULL));
        assert_int_equal(watch->calls, 1);
        char *found;
        size_t size;
        assert_true(io_file_read(watch->path, sizeof data, &found, &size, NULL));
        assert_int_equal(size, sizeof data);
        assert_memory_equal(found, data, size);
        free(found);
        assert_int_equal(entry_count("folder"), 1);
    }
    assert_int_equal(entry_count("."), 2);
}

/* Oracle: the folder as it was, and the check's own words, about the file's own name: nobody has heard of
 * the other one. Without a status all is the same. */
static void a_check_that_refuses_leaves_all_as_it_was(void **state)
{
    (void)state;
    static char data[CHECKED_SIZE];
    char long_path[400] = "";
    while (strlen(long_path) < 300) {
        strcat(long_path, "a_long_folder_name/");
        assert_int_equal(mkdir(long_path, 0700), 0);
    }
    strcat(long_path, "file");
    const char *const paths[] = { "file", "./file", "new", long_path };
    put_file("file", "old");
    for (size_t i = 0; i < 4; i++) {
        const size_t length = strrchr(paths[i], '/') ? (size_t)(strrchr(paths[i], '/') - paths[i]) : 0;
        char folder[400] = ".";
        if (length > 0)
            snprintf(folder, sizeof folder, "%.*s", (int)length, paths[i]);
        for (int k = 0; k < 3; k++) {
            struct watch watch = { .folder = folder,
                                   .old = i < 2 ? "old" : NULL,
                                   .path = paths[i],
                                   .data = data,
                                   .message = "is not good enough",
                                   .own_source = k == 1 ? "another" : NULL };
            dipole_status status = { 0 };
            assert_false(io_file_write_checked(paths[i], data, sizeof data, watch_file, &watch,
                                               k == 2 ? NULL : &status));
            assert_int_equal(watch.calls, 1);
            if (k == 2)
                continue;
            char expected[sizeof status.source];
            snprintf(expected, sizeof expected, "%s", k == 1 ? "another" : paths[i]);
            assert_int_equal(status.code, DIPOLE_BAD_VALUE);
            assert_string_equal(status.source, expected);
            assert_int_equal(status.line, 3);
            assert_string_equal(status.message, "is not good enough");
        }
        assert_int_equal(entry_count(folder), i < 3 ? 2 : 0);
    }
    expect_file("file", "old");
}

static bool never_called(void *context, const char *path, dipole_status *status)
{
    (void)path;
    (void)status;
    *(bool *)context = true;
    return true;
}

/* Oracle: where nothing can be written nothing is looked at; a device has no bytes that could be. Without a
 * check it is io_file_write. */
static void a_check_is_for_files_that_were_written(void **state)
{
    (void)state;
    bool was_called = false;
    dipole_status status;
    struct stat info;
    assert_int_equal(mkdir("folder", 0700), 0);
    assert_int_equal(symlink("/dev/null", "null"), 0);
    assert_false(io_file_write_checked("missing/file", "x", 1, never_called, &was_called, &status));
    assert_string_equal(status.source, "missing/file");
    assert_true(io_file_write_checked("null", "x", 1, never_called, &was_called, NULL));
    assert_false(was_called);
    assert_int_equal(stat("null", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    assert_false(io_file_write_checked("folder", "x", 1, never_called, &was_called, &status));
    assert_string_equal(status.source, "folder");
    assert_string_equal(status.message, "cannot be written: Is a directory");
    assert_true(io_file_write_checked("file", "text", 4, NULL, NULL, &status));
    expect_file("file", "text");
    assert_int_equal(entry_count("."), 3);
}

/* ---- signals ---------------------------------------------------------------------------------------- */

static bool wait_for_ever(void *context, const char *path, dipole_status *status)
{
    (void)path;
    (void)status;
    if (write(*(int *)context, "x", 1) == 1)
        for (;;)
            pause();
    return false;
}

static void remove_and_exit(int number)
{
    (void)number;
    io_file_remove_temporaries(); /* NOLINT(bugprone-signal-handler): made for it */
    _exit(7);
}

/* Oracle: the folder; whatever moment a signal comes, its handler leaves one whole version and nothing
 * else. */
static void a_signal_leaves_no_temporary(void **state)
{
    (void)state;
    enum { SIZE = 300000, ROUNDS = 100 };
    static char block[SIZE];
    struct rng rng = { .seed = 5 };
    assert_true(io_file_write("file", block, SIZE, NULL));
    for (int i = 0; i < ROUNDS; i++) {
        const pid_t child = fork();
        if (child == 0) {
            signal(SIGTERM, remove_and_exit);
            for (int k = 0;; k++) {
                memset(block, k, SIZE);
                if (!io_file_write("file", block, SIZE, NULL))
                    _exit(1);
            }
        }
        usleep((useconds_t)log_uniform(&rng, 500, 5000));
        kill(child, SIGTERM);
        int result = 0;
        waitpid(child, &result, 0);
        assert_true((WIFEXITED(result) && WEXITSTATUS(result) == 7) || WTERMSIG(result) == SIGTERM);
        char *data;
        size_t size;
        assert_true(io_file_read("file", SIZE, &data, &size, NULL));
        assert_int_equal(size, SIZE);
        assert_memory_equal(data, data + 1, SIZE - 1);
        free(data);
        assert_int_equal(entry_count("."), 1);
    }
    io_file_remove_temporaries(); /* nothing is being written: nothing goes */
    assert_int_equal(entry_count("."), 1);
}

/* Oracle: as above, while a check is under way. */
static void a_signal_during_a_check_leaves_no_temporary(void **state)
{
    (void)state;
    int ends[2], result = 0;
    char byte;
    put_file("file", "old");
    assert_int_equal(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        signal(SIGTERM, remove_and_exit);
        _exit(io_file_write_checked("file", "new", 3, wait_for_ever, &ends[1], NULL) ? 1 : 2);
    }
    assert_int_equal(read(ends[0], &byte, 1), 1);
    assert_int_equal(entry_count("."), 2);
    kill(child, SIGTERM);
    waitpid(child, &result, 0);
    assert_true(WIFEXITED(result) && WEXITSTATUS(result) == 7);
    assert_int_equal(entry_count("."), 1);
    expect_file("file", "old");
    close(ends[0]);
    close(ends[1]);
}

/* ---- places ----------------------------------------------------------------------------------------- */

/* Oracle: io_file_write's own verdict on the same path. */
static void check_writable_foretells_write(void **state)
{
    (void)state;
    put_file("file", "old");
    mkdir("folder", 0700);
    assert_int_equal(symlink("/dev/null", "null"), 0);
    static const char *const paths[] = { "file",   "new",       "folder/new", "./new", "file/out",
                                         "folder", "missing/x", "null",       "." };
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        dipole_status before = { 0 }, after = { 0 };
        const bool can = io_file_check_writable(paths[i], &before);
        const bool did = io_file_write(paths[i], "x", 1, &after);
        if (can != did)
            fail_msg("%s: check says %d (%s), write says %d (%s)", paths[i], can, before.message, did,
                     after.message);
    }
}

/* Oracle: the file system. */
static void folders_are_made_with_their_parents(void **state)
{
    (void)state;
    struct stat info;
    dipole_status status;
    char absolute[PATH_MAX];
    assert_true(io_folder_make("a/b//c/", NULL));
    assert_true(io_folder_make("a/b/c", NULL));
    assert_true(stat("a/b/c", &info) == 0 && S_ISDIR(info.st_mode));
    assert_non_null(realpath(".", absolute));
    strcat(absolute, "/d/e");
    assert_true(io_folder_make(absolute, NULL));
    assert_true(stat("d/e", &info) == 0 && S_ISDIR(info.st_mode));
    put_file("file", "x");
    assert_false(io_folder_make("file/below", &status));
    assert_string_equal(status.source, "file/below");
    assert_string_equal(status.message, "cannot be made: Not a directory");
    assert_false(io_folder_make("", NULL));
}

static bool resolves(const char *from, const char *reference, const char *allowed, char out[PATH_MAX],
                     dipole_status *status)
{
    const dipole_place place = { .source = from, .line = 3, .column = 4 };
    return io_path_resolve(&place, reference, &allowed, allowed ? 1 : 0, out, PATH_MAX, status);
}

/* Oracle: what realpath says of the file itself. */
static void references_stay_under_their_folder(void **state)
{
    (void)state;
    char out[PATH_MAX], mesh[PATH_MAX], other[PATH_MAX];
    dipole_status status;
    assert_true(io_folder_make("scene/sub", NULL) && io_folder_make("scene-other", NULL));
    put_file("scene/x.json", "");
    put_file("scene/sub/mesh.obj", "");
    put_file("scene-other/mesh.obj", "");
    assert_int_equal(symlink("../scene-other/mesh.obj", "scene/leak.obj"), 0);
    assert_int_equal(symlink("sub/mesh.obj", "scene/inner.obj"), 0);
    assert_non_null(realpath("scene/sub/mesh.obj", mesh));
    assert_non_null(realpath("scene-other/mesh.obj", other));

    static const char *const inside[] = { "sub/mesh.obj", "./sub/../sub/mesh.obj", "inner.obj",
                                          "../scene/inner.obj" };
    for (size_t i = 0; i < 4; i++) {
        assert_true(resolves("scene/x.json", inside[i], NULL, out, &status));
        assert_string_equal(out, mesh);
    }
    assert_true(resolves("scene/x.json", mesh, NULL, out, &status));

    static const char *const outside[] = { "../scene-other/mesh.obj", "leak.obj", "/etc/passwd", "..",
                                           "." };
    for (size_t i = 0; i < 5; i++) {
        char expected[PATH_MAX];
        snprintf(expected, sizeof expected,
                 "path \"%s\" leads out of this file's folder, expected one inside, or --allow-path FOLDER",
                 outside[i]);
        assert_false(resolves("scene/x.json", outside[i], NULL, out, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_string_equal(status.message, expected);
        assert_int_equal(status.line, 3);
    }
    assert_true(resolves("scene/x.json", "leak.obj", "scene-other", out, &status));
    assert_string_equal(out, other);
    assert_true(resolves("scene/x.json", "leak.obj", "/", out, &status));
    assert_false(resolves("scene/x.json", "leak.obj", "scene/sub", out, &status));

    assert_false(resolves("scene/x.json", "missing.obj", NULL, out, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_string_equal(status.message, "path \"missing.obj\" cannot be read: No such file or directory");
    assert_false(resolves("scene/x.json", "", NULL, out, &status));

    const dipole_place place = { .source = "scene/x.json" };
    assert_false(io_path_resolve(&place, "inner.obj", NULL, 0, out, strlen(mesh), &status));
    assert_true(io_path_resolve(&place, "inner.obj", NULL, 0, out, strlen(mesh) + 1, &status));
}

/* Oracle: the build tree, where materials lie beside the programs as they do once installed. */
static void bundled_files_are_found_beside_the_program(void **state)
{
    (void)state;
    char path[PATH_MAX];
    dipole_status status;
    char *data;
    size_t size;
    assert_true(io_data_path("materials/marble.json", path, sizeof path, &status));
    assert_true(io_file_read(path, 10000, &data, &size, &status));
    assert_non_null(strstr(data, "\"Marble\""));
    free(data);
    assert_false(io_data_path("materials/unobtainium.json", path, sizeof path, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    assert_string_equal(status.source, "materials/unobtainium.json");
    assert_false(io_data_path("materials/marble.json", path, 10, &status));
}

#define in_empty_folder(test) cmocka_unit_test_setup_teardown(test, enter_empty_folder, leave_folder)

int main(void)
{
    const struct CMUnitTest tests[] = {
        in_empty_folder(written_bytes_are_read_back),
        in_empty_folder(a_pipe_is_read_to_its_end),
        in_empty_folder(what_cannot_be_read_is_named),
        in_empty_folder(what_cannot_be_written_is_named),
        in_empty_folder(a_full_disk_leaves_the_old_file),
        in_empty_folder(a_device_is_written_to_and_not_replaced),
        in_empty_folder(a_reader_never_sees_half_a_file),
        in_empty_folder(a_check_sees_the_whole_file_before_it_has_its_name),
        in_empty_folder(a_check_that_refuses_leaves_all_as_it_was),
        in_empty_folder(a_check_is_for_files_that_were_written),
        in_empty_folder(a_signal_leaves_no_temporary),
        in_empty_folder(a_signal_during_a_check_leaves_no_temporary),
        in_empty_folder(check_writable_foretells_write),
        in_empty_folder(folders_are_made_with_their_parents),
        in_empty_folder(references_stay_under_their_folder),
        in_empty_folder(bundled_files_are_found_beside_the_program),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
