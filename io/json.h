/*
 * JSON files for the readers of this folder: jansson, plus messages that say where a value stands.
 *
 * A struct io_json is a value together with the way that led to it, made on the stack while a reader
 * descends; its parent must outlive it. A failure names the file, line, column and the key's path:
 * "scene.json:12:18: objects[0].transform.scale is -1, expected > 0".
 */
#ifndef IO_JSON_H
#define IO_JSON_H

#include "libdipole/dipole.h"

#include <jansson.h>

/* Largest file that is read. */
#define IO_JSON_SIZE_LIMIT ((size_t)16 << 20)

/* A parsed file with its text. End it with io_json_destroy. */
struct io_json_document;

/* A value in a document. The root has no parent; a member has a key, an element an index. */
struct io_json {
    const struct io_json_document *document;
    const struct io_json *parent;
    const char *key; /* NULL for an element                    */
    size_t index;    /* of an element                          */
    json_t *value;   /* NULL when the object has no such key   */
};

/* Read a file. Fails as io_file_read does, or with DIPOLE_BAD_SYNTAX, line and column. Duplicate keys, NaN,
 * Infinity and numbers beyond the range of double are syntax errors. */
DIPOLE_CHECKED bool io_json_read(const char *path, struct io_json_document **document_out,
                                 dipole_status *status);

/* The same from memory; source is what messages call it. */
DIPOLE_CHECKED bool io_json_parse(const char *text, size_t size, const char *source,
                                  struct io_json_document **document_out, dipole_status *status);

void io_json_destroy(struct io_json_document *document);

struct io_json io_json_root(const struct io_json_document *document);
struct io_json io_json_member(const struct io_json *object, const char *key);
struct io_json io_json_element(const struct io_json *array, size_t index);

/* The file's path, and where the value stands in it: for io_path_resolve and dipole_fail. An absent member
 * stands where its object does. */
dipole_place io_json_place(const struct io_json *at);

/* Fail at a value: the message is the value's path, a blank, and the printf text ("is 3, expected < 2");
 * for a root the text alone. Always false. */
bool io_json_fail(const struct io_json *at, dipole_code code, dipole_status *status, const char *format,
                  ...) DIPOLE_PRINTF(4, 5);

/* Fail unless at is an object. known ends with NULL; other keys are refused by a message that lists the
 * known ones, and the first required_count of known must be present. */
DIPOLE_CHECKED bool io_json_check_object(const struct io_json *at, const char *const *known,
                                         size_t required_count, dipole_status *status);

/* Fail unless at is an array of min_count to max_count elements. */
DIPOLE_CHECKED bool io_json_check_array(const struct io_json *at, size_t min_count, size_t max_count,
                                        size_t *count_out, dipole_status *status);

/*
 * Members of an object that io_json_check_object has passed. An absent key is no failure: *out keeps what
 * it had, the default. Numbers lie in min..max; an infinite limit means none (JSON numbers are always
 * finite).
 */
DIPOLE_CHECKED bool io_json_get_number(const struct io_json *object, const char *key, double min,
                                       double max, double *out, dipole_status *status);
DIPOLE_CHECKED bool io_json_get_integer(const struct io_json *object, const char *key, int min, int max,
                                        int *out, dipole_status *status);
/* An array of exactly count numbers. */
DIPOLE_CHECKED bool io_json_get_numbers(const struct io_json *object, const char *key, size_t count,
                                        double min, double max, double *out, dipole_status *status);
DIPOLE_CHECKED bool io_json_get_bool(const struct io_json *object, const char *key, bool *out,
                                     dipole_status *status);
/* At most size - 1 bytes of UTF-8. */
DIPOLE_CHECKED bool io_json_get_text(const struct io_json *object, const char *key, char *out, size_t size,
                                     dipole_status *status);
/* One of choices, which end with NULL; *out is its index. */
DIPOLE_CHECKED bool io_json_get_choice(const struct io_json *object, const char *key,
                                       const char *const *choices, int *out, dipole_status *status);

/* null for infinities and NaN, which JSON does not have. NULL: no memory. */
json_t *io_json_number(double value);

/* JSON as text for people: one member per line, arrays of numbers on one line, each number with as few
 * digits as give it back; ends with a newline. The caller frees it; NULL without memory. */
char *io_json_format(json_t *value);

/* The same on one line, which ends with a newline: for files with a value on each line. */
char *io_json_format_line(json_t *value);

#endif
