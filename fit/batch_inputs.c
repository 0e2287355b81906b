/* What the result of a row depends on, as one number. */
#include "fit/batch_internal.h"

#include "io/hash.h"
#include "io/json.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* A scene names a material and meshes, these no more files: so deep, and no further. */
enum { DEPTH_LIMIT = 4 };

/* A regular file, open for reading; -1 when there is none. Never waits, as a pipe would have it. */
static int open_regular(const char *path)
{
    struct stat info;
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file >= 0 && fstat(file, &info) == 0 && S_ISREG(info.st_mode))
        return file;
    if (file >= 0)
        close(file);
    return -1;
}

static bool hash_contents(int file, uint64_t *hash)
{
    enum { PIECE = 1 << 16 };
    char *const piece = malloc(PIECE);
    ssize_t count = piece ? 1 : -1;
    while (count > 0) {
        count = read(file, piece, PIECE);
        io_hash_bytes(hash, piece, count > 0 ? (size_t)count : 0);
    }
    free(piece);
    return count == 0;
}

bool batch_file_hash(const char *path, uint64_t *out)
{
    const int file = open_regular(path);
    if (file < 0)
        return false;
    *out = IO_HASH_START;
    const bool done = hash_contents(file, out);
    close(file);
    return done;
}

static void hash_named_file(uint64_t *hash, const char *folder, const char *name, int depth);

/* Files that a JSON value names, by any text in it. */
static void hash_named_files(uint64_t *hash, const char *folder, json_t *value, int depth)
{
    const char *key;
    json_t *member;
    size_t i;
    if (json_is_string(value))
        hash_named_file(hash, folder, json_string_value(value), depth);
    else if (json_is_array(value))
        json_array_foreach(value, i, member) hash_named_files(hash, folder, member, depth);
    else
        json_object_foreach(value, key, member) hash_named_files(hash, folder, member, depth);
}

static void hash_json(uint64_t *hash, const char *path, int depth)
{
    struct io_json_document *document;
    char folder[BATCH_PATH_LIMIT];
    if (!io_json_read(path, &document, NULL)) /* its contents have been hashed: the row will fail by it */
        return;
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    hash_named_files(hash, folder, io_json_root(document).value, depth + 1);
    io_json_destroy(document);
}

/* The contents of a file, if the text names one, and of those that it names. */
static void hash_named_file(uint64_t *hash, const char *folder, const char *name, int depth)
{
    char path[BATCH_PATH_LIMIT];
    const bool is_absolute = name[0] == '/';
    const int length =
        snprintf(path, sizeof path, "%s%s%s", is_absolute ? "" : folder, is_absolute ? "" : "/", name);
    if (depth > DEPTH_LIMIT || name[0] == '\0' || length < 0 || (size_t)length >= sizeof path)
        return;
    const int file = open_regular(path);
    if (file < 0)
        return;
    io_hash_text(hash, name);
    hash_contents(file, hash);
    close(file);
    const char *const suffix = strrchr(name, '.');
    if (suffix && strcmp(suffix, ".json") == 0)
        hash_json(hash, path, depth);
}

static void hash_cell(uint64_t *hash, const char *folder, const struct batch_column *column,
                      const char *cell)
{
    if (cell[0] == '\0') /* as if there were no such column */
        return;
    io_hash_text(hash, column->name);
    io_hash_text(hash, cell);
    if (!batch_column_is_several(column)) {
        hash_named_file(hash, folder, cell, 0);
        return;
    }
    char part[BATCH_PATH_LIMIT];
    for (const char *p = cell; *p;) {
        const size_t length = strcspn(p, (const char[]){ BATCH_SEPARATOR, '\0' });
        snprintf(part, sizeof part, "%.*s", (int)length, p);
        hash_named_file(hash, folder, part, 0);
        p += length + (p[length] != '\0');
    }
}

/* A column and its cell, to be sorted by the column's name. */
struct pair {
    const struct batch_column *column;
    const char *cell;
};

static int compare_pairs(const void *a, const void *b)
{
    const struct pair *const left = a, *const right = b;
    return strcmp(left->column->name, right->column->name);
}

uint64_t batch_inputs_hash(const struct batch_list *list, const struct batch_row *row,
                           const char *const *flags, size_t flag_count)
{
    struct pair pairs[BATCH_COLUMN_LIMIT];
    const char *cell = row->cells;
    for (size_t i = 0; i < list->column_count; i++, cell += strlen(cell) + 1)
        pairs[i] = (struct pair){ .column = &list->columns[i], .cell = cell };
    qsort(pairs, list->column_count, sizeof pairs[0], compare_pairs);
    uint64_t hash = IO_HASH_START;
    for (size_t i = 0; i < list->column_count; i++)
        if (pairs[i].column->kind != BATCH_NAME)
            hash_cell(&hash, list->folder, pairs[i].column, pairs[i].cell);
    for (size_t i = 0; i < flag_count; i++)
        io_hash_text(&hash, flags[i]);
    return hash;
}
