/* Tables as text, a line at a time: commas, quotes as in RFC 4180, comments. */
#ifndef IO_CSV_H
#define IO_CSV_H

#include "libdipole/dipole.h"

/* Most columns, and the longest line that any reader may ask for. */
enum { IO_CSV_FIELD_LIMIT = 64 };
#define IO_CSV_LINE_LIMIT ((size_t)16384)

struct io_csv_field {
    const char *text; /* without quotes and the blanks about it; length bytes, no NUL after them */
    size_t length;
    const char *start; /* where it stands in the file, for io_csv_place */
};

/* A reader, and the line that it read last. Large: on the heap, or alone on the stack. */
struct io_csv {
    const char *next, *end; /* what is still to be read */
    const char *source;     /* what messages call it    */
    size_t line_limit;
    int line_number; /* from 1 */
    const char *line_start;
    struct io_csv_field fields[IO_CSV_FIELD_LIMIT];
    size_t field_count, header_count; /* of the current line, and of the header */
    char unquoted[IO_CSV_LINE_LIMIT]; /* fields that had quotes inside */
};

/* Begin at a text that the caller keeps, behind its byte order mark if it has one. line_limit is at most
 * IO_CSV_LINE_LIMIT. */
void io_csv_init(struct io_csv *csv, const char *text, size_t size, const char *source, size_t line_limit);

enum io_csv_next { IO_CSV_LINE, IO_CSV_END, IO_CSV_FAILED };

/*
 * Read the next line that is neither empty nor a comment (its first character is #) into csv->fields, which
 * stay until the next call. Lines end with LF or CR LF. A field that begins with a quote ends with one on
 * the same line; two of them inside are one. Fails with DIPOLE_BAD_SYNTAX, line and column: a line or its
 * fields are over the limits, or a quote is not where it may be.
 */
enum io_csv_next io_csv_next(struct io_csv *csv, dipole_status *status);

/* Lines that are left, which rows cannot outnumber. */
size_t io_csv_count_lines(const struct io_csv *csv);

/* Line, and column in characters, of a place in the current line. */
dipole_place io_csv_place(const struct io_csv *csv, const char *at);

bool io_csv_equals(const struct io_csv_field *field, const char *text);

/* What a column holds, by its name in the header; several names may hold one thing. */
struct io_csv_column {
    const char *name;
    int column; /* -1: known, and not read */
};

/*
 * Read the header, the first line, and set field_of[column] of column_count columns: IO_CSV_FIELD_LIMIT
 * where it has none. Fails with place and name where a name is not among name_count names, or a column is
 * named twice; expected, "expected ...", ends the messages.
 */
DIPOLE_CHECKED bool io_csv_read_header(struct io_csv *csv, const struct io_csv_column *names,
                                       size_t name_count, const char *expected, size_t *field_of,
                                       size_t column_count, dipole_status *status);

/* Fails unless the current line has as many fields as the header. */
DIPOLE_CHECKED bool io_csv_check_width(const struct io_csv *csv, dipole_status *status);

/* The number in a field of the current line, min..max, decimal whatever the locale. Fails with place, name
 * and what stands there. */
DIPOLE_CHECKED bool io_csv_get_number(const struct io_csv *csv, const struct io_csv_field *field,
                                      const char *name, double min, double max, double *out,
                                      dipole_status *status);

/* A field for a message: at most 60 bytes, no control characters. Returns out. */
const char *io_csv_printable(const struct io_csv_field *field, char out[64]);

#endif
