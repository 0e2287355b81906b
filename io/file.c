#include "io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

/* The system's reason in English and thread-safe, unlike strerror. */
static const char *reason(int error)
{
    const char *text = strerrordesc_np(error);
    return text ? text : "unknown error";
}

static bool fail_at_path(dipole_status *status, const char *path, const char *what, int error)
{
    const dipole_place place = { .source = path };
    const dipole_code code = error == ENOENT || error == ENOTDIR ? DIPOLE_NOT_FOUND : DIPOLE_IO_FAILED;
    return dipole_fail(status, code, &place, "%s: %s", what, reason(error));
}

/* ---- reading ------------------------------------------------------------------------------------- */

/* Sizes come from reading, not from the system's word: pipes have none, and files grow. */
static bool read_all(int file, const char *path, size_t limit_bytes, char **data_out, size_t *size_out,
                     dipole_status *status)
{
    const dipole_place place = { .source = path };
    struct stat info;
    if (fstat(file, &info) != 0)
        return fail_at_path(status, path, "cannot be read", errno);
    if (S_ISDIR(info.st_mode))
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "is a folder, expected a file");
    const bool is_sized = S_ISREG(info.st_mode) && info.st_size >= 0 && (size_t)info.st_size <= limit_bytes;
    size_t capacity = is_sized ? (size_t)info.st_size + 2 : 65536; /* one to see the end, one for the NUL */
    size_t size = 0;
    char *data = malloc(capacity);
    ssize_t count = 1;
    while (data && size <= limit_bytes && (count = read(file, data + size, capacity - 1 - size)) != 0) {
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            break;
        size += (size_t)count;
        if (size == capacity - 1) {
            char *more = realloc(data, capacity *= 2);
            if (!more)
                free(data);
            data = more;
        }
    }
    if (!data)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for %zu bytes", capacity);
    if (count < 0 || size > limit_bytes) {
        const int error = errno;
        free(data);
        if (count < 0)
            return fail_at_path(status, path, "cannot be read", error);
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "is too large, expected at most %zu bytes",
                           limit_bytes);
    }
    data[size] = '\0';
    *data_out = data;
    *size_out = size;
    return true;
}

bool io_file_read(const char *path, size_t limit_bytes, char **data_out, size_t *size_out,
                  dipole_status *status)
{
    *data_out = NULL;
    *size_out = 0;
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return fail_at_path(status, path, "cannot be read", errno);
    const bool done = read_all(file, path, limit_bytes, data_out, size_out, status);
    close(file);
    return done;
}

/* ---- writing ------------------------------------------------------------------------------------- */

/* Folder part of a path, "." when there is none, with its slash if it is the root. */
static bool folder_of(const char *path, char out[PATH_MAX])
{
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) : 1;
    if (!slash)
        path = ".";
    else if (length == 0)
        length = 1;
    if (length >= PATH_MAX)
        return false;
    memcpy(out, path, length);
    out[length] = '\0';
    return true;
}

static bool write_all(int file, const char *data, size_t size)
{
    while (size > 0) {
        const ssize_t count = write(file, data, size);
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            return false;
        data += count;
        size -= (size_t)count;
    }
    return true;
}

/* A device or a pipe cannot be replaced, only written to: renaming over /dev/null would destroy it. */
static bool write_to_device(const char *path, const void *data, size_t size, dipole_status *status)
{
    const int file = open(path, O_WRONLY | O_CLOEXEC);
    bool done = file >= 0 && write_all(file, data, size);
    const int error = errno;
    if (file >= 0)
        close(file);
    return done || fail_at_path(status, path, "cannot be written", error);
}

/*
 * Temporary files that may exist now. A place is claimed, its path filled in, and only then is it in use:
 * what a signal handler sees in use is whole. Fixed, since a handler can neither lock nor allocate; a
 * writer that finds all places taken writes all the same, and leaves its file behind when a signal ends it.
 */
enum { PLACE_COUNT = 16, PLACE_FREE = 0, PLACE_CLAIMED, PLACE_IN_USE };
static struct {
    atomic_int state;
    char path[PATH_MAX];
} temporaries[PLACE_COUNT];

/* Index of a free place, now claimed, or -1. */
static int place_claim(void)
{
    for (int i = 0; i < PLACE_COUNT; i++) {
        int expected = PLACE_FREE;
        if (atomic_compare_exchange_strong(&temporaries[i].state, &expected, PLACE_CLAIMED))
            return i;
    }
    return -1;
}

static void place_set(int place, int state)
{
    if (place >= 0)
        atomic_store(&temporaries[place].state, state);
}

void io_file_remove_temporaries(void)
{
    const int error = errno;
    for (int i = 0; i < PLACE_COUNT; i++)
        if (atomic_load(&temporaries[i].state) == PLACE_IN_USE)
            unlink(temporaries[i].path);
    errno = error;
}

/*
 * Create a file whose name no other process or thread uses, on this machine or another one that shares the
 * folder: a handler may remove it before it exists, so it must be nobody else's. place (or -1) is in use
 * when the file exists.
 */
static int create_temporary(const char *folder, int place, char temporary[PATH_MAX])
{
    for (int attempt = 0; attempt < 100; attempt++) {
        unsigned long long word;
        if (getrandom(&word, sizeof word, 0) != (ssize_t)sizeof word)
            return -1;
        const int length =
            snprintf(temporary, PATH_MAX, "%s/.dipole-%ld-%016llx.tmp", folder, (long)getpid(), word);
        if (length < 0 || length >= PATH_MAX) {
            errno = ENAMETOOLONG;
            return -1;
        }
        if (place >= 0)
            memcpy(temporaries[place].path, temporary, (size_t)length + 1);
        place_set(place, PLACE_IN_USE);
        const int file = open(temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file >= 0 || errno != EEXIST)
            return file;
        place_set(place, PLACE_CLAIMED);
    }
    return -1;
}

/* Bytes on disk before the file is closed; errno says why not. */
static bool fill_and_close(int file, const void *data, size_t size)
{
    const bool is_full = write_all(file, data, size) && fsync(file) == 0;
    const int error = errno;
    const bool is_closed = close(file) == 0;
    if (!is_full)
        errno = error;
    return is_full && is_closed;
}

/* Write under a temporary name, check, and rename. */
static bool write_and_rename(const char *path, const char *folder, int place, const void *data, size_t size,
                             io_file_check *check, void *context, dipole_status *status)
{
    char temporary[PATH_MAX];
    const int file = create_temporary(folder, place, temporary);
    if (file < 0)
        return fail_at_path(status, path, "cannot be written", errno);
    bool done = fill_and_close(file, data, size) || fail_at_path(status, path, "cannot be written", errno);
    if (done && check && !check(context, temporary, status)) {
        done = false;
        if (status && strncmp(status->source, temporary, sizeof status->source - 1) ==
                          0) /* a name that nobody has heard of */
            snprintf(status->source, sizeof status->source, "%s", path);
    }
    done = done && (rename(temporary, path) == 0 || fail_at_path(status, path, "cannot be written", errno));
    if (!done)
        unlink(temporary);
    return done;
}

bool io_file_write(const char *path, const void *data, size_t size, dipole_status *status)
{
    return io_file_write_checked(path, data, size, NULL, NULL, status);
}

bool io_file_write_checked(const char *path, const void *data, size_t size, io_file_check *check,
                           void *context, dipole_status *status)
{
    struct stat info;
    if (stat(path, &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode))
        return write_to_device(path, data, size, status);

    char folder[PATH_MAX];
    if (!folder_of(path, folder))
        return fail_at_path(status, path, "cannot be written", ENAMETOOLONG);
    const int place = place_claim();
    const bool done = write_and_rename(path, folder, place, data, size, check, context, status);
    place_set(place, PLACE_FREE);
    return done;
}

bool io_file_check_writable(const char *path, dipole_status *status)
{
    const dipole_place place = { .source = path };
    char folder[PATH_MAX];
    struct stat info;
    if (!folder_of(path, folder))
        return fail_at_path(status, path, "cannot be written", ENAMETOOLONG);
    if (stat(folder, &info) != 0)
        return fail_at_path(status, path, "cannot be written, its folder is missing", errno);
    if (!S_ISDIR(info.st_mode))
        return fail_at_path(status, path, "cannot be written", ENOTDIR);
    if (stat(path, &info) == 0) {
        if (S_ISDIR(info.st_mode))
            return dipole_fail(status, DIPOLE_IO_FAILED, &place, "is a folder, expected a file");
        if (!S_ISREG(info.st_mode))
            return access(path, W_OK) == 0 || fail_at_path(status, path, "cannot be written", errno);
    }
    return access(folder, W_OK | X_OK) == 0 || fail_at_path(status, path, "cannot be written", errno);
}

/* ---- folders and paths --------------------------------------------------------------------------- */

bool io_folder_make(const char *path, dipole_status *status)
{
    char part[PATH_MAX];
    const size_t length = strlen(path);
    if (length == 0 || length >= sizeof part)
        return fail_at_path(status, path, "cannot be made", length == 0 ? ENOENT : ENAMETOOLONG);
    for (size_t end = 1; end <= length; end++) {
        if (path[end] != '/' && path[end] != '\0')
            continue;
        memcpy(part, path, end);
        part[end] = '\0';
        if (mkdir(part, 0777) == 0)
            continue;
        const int error = errno;
        struct stat info;
        if (stat(part, &info) != 0)
            return fail_at_path(status, path, "cannot be made", error);
        if (!S_ISDIR(info.st_mode))
            return fail_at_path(status, path, "cannot be made", ENOTDIR);
    }
    return true;
}

static bool is_under(const char *path, const char *folder)
{
    const size_t length = strcmp(folder, "/") == 0 ? 0 : strlen(folder);
    return strncmp(path, folder, length) == 0 && path[length] == '/';
}

bool io_path_resolve(const dipole_place *from, const char *reference, const char *const *allowed,
                     size_t allowed_count, char *out, size_t size, dipole_status *status)
{
    char folder[PATH_MAX], base[PATH_MAX], joined[PATH_MAX], target[PATH_MAX];
    if (!folder_of(from->source, folder) || !realpath(folder, base))
        return dipole_fail(status, DIPOLE_NOT_FOUND, from, "the folder of this file is missing");
    const int length = snprintf(joined, sizeof joined, "%s%s%s", reference[0] == '/' ? "" : base,
                                reference[0] == '/' ? "" : "/", reference);
    if (length < 0 || (size_t)length >= sizeof joined || reference[0] == '\0')
        return dipole_fail(status, DIPOLE_BAD_VALUE, from,
                           "path \"%.100s\" has %zu bytes, expected 1 to %d", reference, strlen(reference),
                           PATH_MAX - 1);
    if (!realpath(joined, target))
        return dipole_fail(status, DIPOLE_NOT_FOUND, from, "path \"%.200s\" cannot be read: %s", reference,
                           reason(errno));
    bool is_allowed = is_under(target, base);
    for (size_t i = 0; i < allowed_count && !is_allowed; i++) {
        if (!realpath(allowed[i], folder))
            return fail_at_path(status, allowed[i], "cannot be read as a folder of --allow-path", errno);
        is_allowed = is_under(target, folder);
    }
    if (!is_allowed)
        return dipole_fail(status, DIPOLE_BAD_VALUE, from,
                           "path \"%.200s\" leads out of this file's folder, expected one inside, or "
                           "--allow-path FOLDER",
                           reference);
    if (strlen(target) >= size)
        return dipole_fail(status, DIPOLE_BAD_VALUE, from,
                           "path \"%.100s\" is too long, expected %zu bytes", reference, size - 1);
    strcpy(out, target);
    return true;
}

bool io_data_path(const char *relative, char *out, size_t size, dipole_status *status)
{
    char program[PATH_MAX], folder[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    program[length > 0 ? length : 0] = '\0';
    if (!folder_of(program, folder))
        return dipole_fail(status, DIPOLE_NOT_FOUND, NULL, "the folder of this program is not known");
    const int count = snprintf(out, size, "%s/../share/libdipole/%s", folder, relative);
    const dipole_place place = { .source = relative };
    if (count < 0 || (size_t)count >= size)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place, "the path of this bundled file is too long");
    if (access(out, R_OK) != 0)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place,
                           "this bundled file is missing, expected in %.200s/../share/libdipole", folder);
    return true;
}
