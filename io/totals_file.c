#include "io/totals_file.h"

#include "io/csv.h"
#include "io/file.h"
#include "io/material_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FILE_SIZE_LIMIT ((size_t)16 << 20)

enum { THICKNESS = 2 * IO_TOTAL_KIND_COUNT, CHANNEL, COLUMN_COUNT };

/* Each value is followed by its error. */
static const struct io_csv_column column_names[COLUMN_COUNT] = {
    { "diffuse_reflectance", 2 * IO_TOTAL_DIFFUSE_REFLECTANCE },
    { "diffuse_reflectance_sem", 2 * IO_TOTAL_DIFFUSE_REFLECTANCE + 1 },
    { "diffuse_transmittance", 2 * IO_TOTAL_DIFFUSE_TRANSMITTANCE },
    { "diffuse_transmittance_sem", 2 * IO_TOTAL_DIFFUSE_TRANSMITTANCE + 1 },
    { "total_reflectance", 2 * IO_TOTAL_REFLECTANCE },
    { "total_reflectance_sem", 2 * IO_TOTAL_REFLECTANCE + 1 },
    { "total_transmittance", 2 * IO_TOTAL_TRANSMITTANCE },
    { "total_transmittance_sem", 2 * IO_TOTAL_TRANSMITTANCE + 1 },
    { "thickness_mm", THICKNESS },
    { "channel", CHANNEL },
};
static const char expected_columns[] =
    "expected thickness_mm, diffuse_ or total_reflectance or _transmittance, each perhaps with _sem, and "
    "perhaps channel";

struct reader {
    struct io_csv csv;
    size_t field_of[COLUMN_COUNT]; /* IO_CSV_FIELD_LIMIT for none */
    dipole_status *status;
};

static bool has(const struct reader *reader, int column)
{
    return reader->field_of[column] < IO_CSV_FIELD_LIMIT;
}

/* ---- the header -------------------------------------------------------------------------------------- */

static bool read_header(struct reader *reader)
{
    if (!io_csv_read_header(&reader->csv, column_names, COLUMN_COUNT, expected_columns, reader->field_of,
                            COLUMN_COUNT, reader->status))
        return false;
    const dipole_place place = io_csv_place(&reader->csv, reader->csv.line_start);
    bool has_value = false;
    for (int kind = 0; kind < IO_TOTAL_KIND_COUNT; kind++)
        has_value = has_value || has(reader, 2 * kind);
    return (has(reader, THICKNESS) && has_value) ||
           dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "the header has no %s, %s",
                       has_value ? "thickness_mm" : "reflectance and no transmittance", expected_columns);
}

/* ---- rows -------------------------------------------------------------------------------------------- */

static const struct io_csv_field *field_of(const struct reader *reader, int column)
{
    return &reader->csv.fields[reader->field_of[column]];
}

static bool get_thickness(const struct reader *reader, double *out)
{
    const struct io_csv_field *const field = field_of(reader, THICKNESS);
    *out = INFINITY;
    return io_csv_equals(field, "inf") ||
           io_csv_get_number(&reader->csv, field, "thickness_mm", DIPOLE_THICKNESS_MIN_MM,
                             DIPOLE_THICKNESS_MAX_MM, out, reader->status);
}

static bool get_channel(const struct reader *reader, int *out)
{
    *out = -1;
    if (!has(reader, CHANNEL))
        return true;
    const struct io_csv_field *const field = field_of(reader, CHANNEL);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (io_csv_equals(field, io_channel_names[c]))
            *out = c;
    }
    const dipole_place place = io_csv_place(&reader->csv, field->start);
    char text[64];
    return *out >= 0 || dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                                    "channel is \"%s\", expected R, G or B", io_csv_printable(field, text));
}

static bool read_row(const struct reader *reader, struct io_totals *totals)
{
    const struct io_csv *const csv = &reader->csv;
    struct io_total total = { 0 };
    if (!io_csv_check_width(csv, reader->status) || !get_thickness(reader, &total.thickness_mm) ||
        !get_channel(reader, &total.channel))
        return false;
    for (int kind = 0; kind < IO_TOTAL_KIND_COUNT; kind++) {
        const int value = 2 * kind, error = 2 * kind + 1;
        if (!has(reader, value) || field_of(reader, value)->length == 0)
            continue;
        total.kind = (enum io_total_kind)kind;
        total.sem = 0;
        if (!io_csv_get_number(csv, field_of(reader, value), column_names[value].name, 0, 1, &total.value,
                               reader->status) ||
            (has(reader, error) && field_of(reader, error)->length > 0 &&
             !io_csv_get_number(csv, field_of(reader, error), column_names[error].name, 0, 1, &total.sem,
                                reader->status)))
            return false;
        totals->totals[totals->count++] = total;
    }
    return true;
}

static bool read_rows(struct reader *reader, struct io_totals *totals)
{
    for (size_t row = 0;; row++) {
        const enum io_csv_next next = io_csv_next(&reader->csv, reader->status);
        if (next == IO_CSV_FAILED)
            return false;
        if (next == IO_CSV_END)
            break;
        const dipole_place place = io_csv_place(&reader->csv, reader->csv.line_start);
        if (row == IO_TOTALS_ROW_LIMIT)
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place, "the table has more than %zu rows",
                               IO_TOTALS_ROW_LIMIT);
        if (!read_row(reader, totals))
            return false;
    }
    const dipole_place place = { .source = reader->csv.source };
    return totals->count > 0 || dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place,
                                            "has a header and no values, expected at least one");
}

static bool parse(struct reader *reader, struct io_totals **totals_out)
{
    if (!read_header(reader))
        return false;
    const size_t line_count = io_csv_count_lines(&reader->csv);
    const size_t row_count = line_count < IO_TOTALS_ROW_LIMIT ? line_count : IO_TOTALS_ROW_LIMIT;
    const size_t capacity = row_count * IO_TOTAL_KIND_COUNT;
    struct io_totals *const totals = malloc(sizeof *totals + capacity * sizeof *totals->totals);
    if (!totals)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu rows", row_count);
    *totals = (struct io_totals){ .totals = (struct io_total *)(totals + 1) };
    if (!read_rows(reader, totals)) {
        io_totals_destroy(totals);
        return false;
    }
    *totals_out = totals;
    return true;
}

bool io_totals_read(const char *path, struct io_totals **totals_out, dipole_status *status)
{
    char *text = NULL;
    size_t size = 0;
    *totals_out = NULL;
    if (!io_file_read(path, FILE_SIZE_LIMIT, &text, &size, status))
        return false;
    bool done = false;
    struct reader *const reader = malloc(sizeof *reader);
    if (reader) {
        io_csv_init(&reader->csv, text, size, path, IO_CSV_LINE_LIMIT);
        reader->status = status;
        done = parse(reader, totals_out);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to read %.100s", path);
    }
    free(reader);
    free(text);
    return done;
}

void io_totals_destroy(struct io_totals *totals)
{
    free(totals);
}
