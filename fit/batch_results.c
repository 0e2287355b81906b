/* The files of results: a line for each row that was run, never changed, only added to. */
#include "fit/batch_internal.h"

#include "io/json.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

/* Longest line that is read: more than a row's may be. */
#define LINE_LIMIT ((size_t)4 << 20)

static bool fail_at_path(const char *path, const char *what, dipole_status *status)
{
    const char *const reason = strerrordesc_np(errno);
    const dipole_place place = { .source = path };
    return dipole_fail(status, DIPOLE_IO_FAILED, &place, "%s: %s", what, reason ? reason : "unknown error");
}

/* ---- appending ------------------------------------------------------------------------------------ */

static bool lock(struct batch_results *results, dipole_status *status)
{
    if (flock(results->file, LOCK_EX | LOCK_NB) == 0)
        return true;
    if (errno != EWOULDBLOCK)
        return fail_at_path(results->path, "cannot be locked", status);
    const dipole_place place = { .source = results->path };
    return dipole_fail(status, DIPOLE_IO_FAILED, &place,
                       "another process is at work on these rows, expected one at a time");
}

/* Whether the file ends within a line: the process that wrote it was ended, or the disk was full. */
static bool look_at_end(struct batch_results *results, dipole_status *status)
{
    char last = '\n';
    const off_t size = lseek(results->file, 0, SEEK_END);
    if (size < 0 || (size > 0 && pread(results->file, &last, 1, size - 1) != 1))
        return fail_at_path(results->path, "cannot be read", status);
    results->is_torn = last != '\n';
    return true;
}

bool batch_results_open(const char *folder, size_t shard_index, size_t shard_count,
                        struct batch_results *out, dipole_status *status)
{
    char shard[64] = "";
    if (shard_count > 0)
        snprintf(shard, sizeof shard, ".%zu-of-%zu", shard_index + 1, shard_count);
    out->file = -1;
    const int length = snprintf(out->path, sizeof out->path, "%s/results%s.jsonl", folder, shard);
    const dipole_place place = { .source = folder };
    if (length < 0 || (size_t)length >= sizeof out->path)
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "the path is too long");
    out->file = open(out->path, O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY, 0666);
    if (out->file < 0)
        return fail_at_path(out->path, "cannot be written", status);
    if (lock(out, status) && look_at_end(out, status))
        return true;
    batch_results_close(out);
    return false;
}

void batch_results_close(struct batch_results *results)
{
    if (results->file >= 0)
        close(results->file);
    results->file = -1;
}

bool batch_results_append(struct batch_results *results, json_t *line, dipole_status *status)
{
    char *const text = io_json_format_line(line);
    const size_t length = text ? strlen(text) : 0;
    char *const block = text ? malloc(length + 2) : NULL;
    if (!block) {
        free(text);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a line of results");
    }
    const size_t torn = results->is_torn;
    block[0] = '\n';
    memcpy(block + torn, text, length + 1);
    const size_t size = torn + length;
    errno = 0;
    const ssize_t written = write(results->file, block, size); /* whole, or torn: never in pieces */
    if (written > 0)
        results->is_torn = block[written - 1] != '\n';
    const bool is_written = written >= 0 && (size_t)written == size;
    if (!is_written && written >= 0)
        errno = ENOSPC;
    free(text);
    free(block);
    return (is_written && fsync(results->file) == 0) ||
           fail_at_path(results->path, "cannot be written", status);
}

/* ---- reading -------------------------------------------------------------------------------------- */

/* The next line without its end; false at the end of the file. One that is too long comes as "". */
static bool read_line(FILE *file, char *out, size_t size)
{
    size_t length = 0;
    bool is_long = false;
    int c;
    while ((c = getc_unlocked(file)) != EOF && c != '\n') {
        is_long = is_long || length + 1 == size;
        if (!is_long)
            out[length++] = (char)c;
    }
    out[is_long ? 0 : length] = '\0';
    return c != EOF || length > 0;
}

static bool read_file(const char *path, batch_visit *visit, void *context, size_t *ignored,
                      dipole_status *status)
{
    FILE *const file = fopen(path, "re");
    char *const line = malloc(LINE_LIMIT);
    if (!file || !line) {
        if (file)
            fclose(file);
        free(line);
        return file ? dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a line of results")
                    : fail_at_path(path, "cannot be read", status);
    }
    while (read_line(file, line, LINE_LIMIT)) {
        json_t *const value = json_loads(line, 0, NULL);
        if (json_is_object(value))
            visit(context, value);
        else
            ++*ignored;
        json_decref(value);
    }
    const bool done = !ferror(file) || fail_at_path(path, "cannot be read", status);
    fclose(file);
    free(line);
    return done;
}

/* results*.jsonl */
static int is_results(const struct dirent *entry)
{
    static const char start[] = "results", end[] = ".jsonl";
    const size_t length = strlen(entry->d_name);
    return length >= sizeof start + sizeof end - 2 &&
           strncmp(entry->d_name, start, sizeof start - 1) == 0 &&
           strcmp(entry->d_name + length - (sizeof end - 1), end) == 0;
}

bool batch_results_read(const char *folder, batch_visit *visit, void *context, size_t *ignored_out,
                        dipole_status *status)
{
    struct dirent **entries;
    const int count = scandir(folder, &entries, is_results, alphasort);
    if (count < 0)
        return fail_at_path(folder, "cannot be read", status);
    bool done = true;
    *ignored_out = 0;
    for (int i = 0; i < count; i++) {
        char path[PATH_MAX];
        const int length = snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        if (done && length > 0 && (size_t)length < sizeof path)
            done = read_file(path, visit, context, ignored_out, status);
        free(entries[i]);
    }
    free(entries);
    return done;
}
