#include "io/mesh_internal.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* ---- meshes in memory ---------------------------------------------------------------------------- */

struct io_mesh *io_mesh_create(size_t vertex_count, size_t triangle_count)
{
    const size_t floats = vertex_count * 3, indices = triangle_count * 3;
    struct io_mesh *mesh = malloc(sizeof *mesh + 2 * floats * sizeof(float) + indices * sizeof(uint32_t));
    if (!mesh)
        return NULL;
    *mesh = (struct io_mesh){ .vertex_count = vertex_count, .triangle_count = triangle_count };
    mesh->positions = (float *)(mesh + 1);
    mesh->normals = mesh->positions + floats;
    mesh->indices = (uint32_t *)(mesh->normals + floats);
    return mesh;
}

void io_mesh_update_bounds(struct io_mesh *mesh)
{
    for (int axis = 0; axis < 3; axis++) {
        float min = INFINITY, max = -INFINITY;
        for (size_t i = 0; i < mesh->vertex_count; i++) {
            min = fminf(min, mesh->positions[3 * i + (size_t)axis]);
            max = fmaxf(max, mesh->positions[3 * i + (size_t)axis]);
        }
        mesh->min[axis] = min;
        mesh->max[axis] = max;
    }
}

void io_mesh_destroy(struct io_mesh *mesh)
{
    free(mesh);
}

/* ---- the importing program ----------------------------------------------------------------------- */

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

enum transfer { TRANSFER_DONE, TRANSFER_ENDED, TRANSFER_LATE };

/* Read exactly size bytes from a pipe before the deadline. */
static enum transfer receive(int pipe, int64_t deadline_ms, void *out, size_t size)
{
    for (char *next = out; size > 0;) {
        const int64_t left_ms = deadline_ms - now_ms();
        struct pollfd ready = { .fd = pipe, .events = POLLIN };
        if (left_ms <= 0)
            return TRANSFER_LATE;
        if (poll(&ready, 1, (int)left_ms) <= 0)
            continue; /* late, or interrupted: the clock decides */
        const ssize_t count = read(pipe, next, size);
        if (count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN))
            return TRANSFER_ENDED;
        if (count > 0) {
            next += count;
            size -= (size_t)count;
        }
    }
    return TRANSFER_DONE;
}

/* What a program sends that a hostile file may have taken over is checked like the file itself. */
static bool is_sound(const struct io_mesh *mesh)
{
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        const float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2]) ||
            !(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0f) < 1e-4f))
            return false;
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        if (mesh->indices[i] >= mesh->vertex_count)
            return false;
    return mesh->triangle_count > 0;
}

/* Text that came from a file or a library must not command a terminal. */
static void make_printable(char *text, size_t size)
{
    text[size - 1] = '\0';
    for (; *text; text++)
        if (*text < ' ' || *text > '~')
            *text = '?';
}

/* Receive the header and the mesh. *transfer tells whether a failure is the program's or told in status. */
static bool receive_mesh(const struct io_mesh_importer *importer, const dipole_place *place, int pipe,
                         int64_t deadline_ms, struct io_mesh **mesh, enum transfer *transfer,
                         dipole_status *status)
{
    struct io_mesh_header header;
    *transfer = receive(pipe, deadline_ms, &header, sizeof header);
    if (*transfer == TRANSFER_DONE && memcmp(header.magic, IO_MESH_MAGIC, sizeof header.magic) != 0)
        *transfer = TRANSFER_ENDED;
    if (*transfer != TRANSFER_DONE)
        return false;
    make_printable(header.message, sizeof header.message);
    if (header.message[0] != '\0')
        return dipole_fail(status, DIPOLE_BAD_VALUE, place, "%s", header.message);
    if (header.triangle_count > importer->triangle_limit)
        return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                           "has %" PRIu64 " triangles, expected at most %zu", header.triangle_count,
                           importer->triangle_limit);
    if (header.vertex_count > 3 * header.triangle_count) {
        *transfer = TRANSFER_ENDED; /* a vertex that no triangle uses is not our program's answer */
        return false;
    }
    *mesh = io_mesh_create(header.vertex_count, header.triangle_count);
    if (!*mesh)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, place, "no memory for %" PRIu64 " triangles",
                           header.triangle_count);
    const size_t vector_bytes = (*mesh)->vertex_count * 3 * sizeof(float);
    *transfer = receive(pipe, deadline_ms, (*mesh)->positions, vector_bytes);
    if (*transfer == TRANSFER_DONE)
        *transfer = receive(pipe, deadline_ms, (*mesh)->normals, vector_bytes);
    if (*transfer == TRANSFER_DONE)
        *transfer =
            receive(pipe, deadline_ms, (*mesh)->indices, (*mesh)->triangle_count * 3 * sizeof(uint32_t));
    if (*transfer == TRANSFER_DONE && !is_sound(*mesh))
        *transfer = TRANSFER_ENDED;
    return *transfer == TRANSFER_DONE;
}

/* Run the importing program with file as its input; its output can be read from *pipe_out. */
static int spawn(const struct io_mesh_importer *importer, const char *path, int file, int *pipe_out,
                 pid_t *process_out)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return errno;
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    char extension[16], bytes[32], seconds[32];
    snprintf(extension, sizeof extension, "%s", dot ? dot + 1 : "");
    snprintf(bytes, sizeof bytes, "%zu", importer->bytes_limit);
    snprintf(seconds, sizeof seconds, "%d", importer->seconds_limit);
    char *arguments[] = { "mesh-import", extension, bytes, seconds, NULL };

    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, changed;
    sigemptyset(&none);
    sigemptyset(&changed);
    sigaddset(&changed, SIGPIPE); /* a tool may ignore these; ignoring is inherited */
    sigaddset(&changed, SIGXFSZ);
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    const bool is_ready =
        posix_spawn_file_actions_adddup2(&actions, file, STDIN_FILENO) == 0 &&
        posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO) == 0 &&
        posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0) == 0 &&
        posix_spawnattr_setsigmask(&attributes, &none) == 0 &&
        posix_spawnattr_setsigdefault(&attributes, &changed) == 0 &&
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF) == 0;
    const int error =
        is_ready ? posix_spawn(process_out, importer->program, &actions, &attributes, arguments, environ)
                 : ENOMEM;
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    *pipe_out = ends[0];
    if (error != 0)
        close(ends[0]);
    return error;
}

/* Why the program ended without an answer. */
static bool fail_at_end(const dipole_place *place, int outcome, dipole_status *status)
{
    if (WIFSIGNALED(outcome) && WTERMSIG(outcome) != SIGKILL)
        return dipole_fail(status, DIPOLE_BAD_VALUE, place,
                           "is damaged or too large: the reader of meshes died of it (signal %d)",
                           WTERMSIG(outcome));
    return dipole_fail(status, DIPOLE_IO_FAILED, place,
                       "cannot be read: the reader of meshes ended without an answer");
}

static bool import(const struct io_mesh_importer *importer, const char *path, int file,
                   struct io_mesh **mesh, dipole_status *status)
{
    const dipole_place place = { .source = path };
    const int64_t deadline_ms = now_ms() + (int64_t)importer->seconds_limit * 1000;
    int pipe = -1, outcome = 0;
    pid_t process = 0;
    const int error = spawn(importer, path, file, &pipe, &process);
    if (error != 0)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place,
                           "cannot be read: the reader of meshes %s cannot be run: %s", importer->program,
                           strerrordesc_np(error));

    enum transfer transfer;
    const bool done = receive_mesh(importer, &place, pipe, deadline_ms, mesh, &transfer, status);
    /* It has nothing more to say; one that ends by itself has its own reason already. */
    kill(process, SIGKILL);
    close(pipe);
    while (waitpid(process, &outcome, 0) < 0 && errno == EINTR)
        ;
    if (done || transfer == TRANSFER_DONE)
        return done;
    if (transfer == TRANSFER_LATE)
        return dipole_fail(status, DIPOLE_IO_FAILED, &place, "takes longer than %d s to read",
                           importer->seconds_limit);
    return fail_at_end(&place, outcome, status);
}

/* ---- files --------------------------------------------------------------------------------------- */

/* Open a regular file; without O_NONBLOCK a pipe without a writer would hang here. */
static int open_mesh(const char *path, size_t bytes_limit, dipole_status *status)
{
    const dipole_place place = { .source = path };
    struct stat info;
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0 || fstat(file, &info) != 0) {
        const int error = errno;
        if (file >= 0)
            close(file);
        dipole_fail(status, error == ENOENT || error == ENOTDIR ? DIPOLE_NOT_FOUND : DIPOLE_IO_FAILED,
                    &place, "cannot be read: %s", strerrordesc_np(error));
        return -1;
    }
    bool is_fine = false;
    if (S_ISDIR(info.st_mode))
        dipole_fail(status, DIPOLE_IO_FAILED, &place, "is a folder, expected a mesh file");
    else if (!S_ISREG(info.st_mode))
        dipole_fail(status, DIPOLE_IO_FAILED, &place, "is a device or a pipe, expected a mesh file");
    else if (info.st_size == 0)
        dipole_fail(status, DIPOLE_BAD_VALUE, &place, "is empty, expected a mesh file");
    else if ((size_t)info.st_size > bytes_limit)
        dipole_fail(status, DIPOLE_BAD_VALUE, &place, "has %lld bytes, expected at most %zu",
                    (long long)info.st_size, bytes_limit);
    else
        is_fine = true;
    if (is_fine)
        return file;
    close(file);
    return -1;
}

bool io_mesh_read_by(const struct io_mesh_importer *importer, const char *path, struct io_mesh **mesh_out,
                     dipole_status *status)
{
    *mesh_out = NULL;
    const int file = open_mesh(path, importer->bytes_limit, status);
    if (file < 0)
        return false;
    struct io_mesh *mesh = NULL;
    const bool done = import(importer, path, file, &mesh, status);
    close(file);
    if (done)
        io_mesh_update_bounds(mesh);
    else
        io_mesh_destroy(mesh);
    *mesh_out = done ? mesh : NULL;
    return done;
}

bool io_mesh_read(const char *path, struct io_mesh **mesh_out, dipole_status *status)
{
    /* Beside the folder of the running program, installed as in the build tree. */
    char program[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", program, sizeof program - sizeof IO_MESH_IMPORT - 1);
    program[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(program, '/');
    strcpy(slash ? slash + 1 : program, IO_MESH_IMPORT);
    const struct io_mesh_importer importer = {
        .program = program,
        .bytes_limit = IO_MESH_BYTES_LIMIT,
        .triangle_limit = IO_MESH_TRIANGLE_LIMIT,
        .seconds_limit = IO_MESH_SECONDS_LIMIT,
    };
    return io_mesh_read_by(&importer, path, mesh_out, status);
}
