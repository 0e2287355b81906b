#include "io/profile_file.h"

#include "io/csv.h"
#include "io/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FILE_SIZE_LIMIT ((size_t)256 << 20)
#define VALUE_LIMIT_PER_MM2 1e100

/* What a column holds. Those that MCML's tables have beside are known and not read. */
enum column { R, R_LO, R_HI, RD, SEM, COLUMN_COUNT, NOT_READ = -1 };

static const struct io_csv_column column_names[] = {
    { "r_mm", R },
    { "r_lo_mm", R_LO },
    { "r_hi_mm", R_HI },
    { "rd_per_mm2", RD },
    { "R_per_mm2", RD },
    { "sem", SEM },
    { "R_sem_per_mm2", SEM },
    { "R1_per_mm2", NOT_READ },
    { "T_per_mm2", NOT_READ },
    { "T_sem_per_mm2", NOT_READ },
    { "T1_per_mm2", NOT_READ },
};
/* MCML's photons are counted as they arrive, those mirrored at the surface too. */
static const char per_incident_name[] = "R_per_mm2";
static const char expected_columns[] = "expected r_mm,rd_per_mm2[,sem] or r_lo_mm,r_hi_mm,rd_per_mm2[,sem]";

struct reader {
    struct io_csv csv;
    size_t field_of[COLUMN_COUNT]; /* IO_CSV_FIELD_LIMIT for none */
    bool is_per_incident;
    dipole_status *status;
};

/* ---- the header ---------------------------------------------------------------------------------- */

static bool read_header(struct reader *reader)
{
    if (!io_csv_read_header(&reader->csv, column_names, sizeof column_names / sizeof column_names[0],
                            expected_columns, reader->field_of, COLUMN_COUNT, reader->status))
        return false;
    const size_t *const field_of = reader->field_of;
    const bool has_r = field_of[R] < IO_CSV_FIELD_LIMIT, has_lo = field_of[R_LO] < IO_CSV_FIELD_LIMIT,
               has_hi = field_of[R_HI] < IO_CSV_FIELD_LIMIT;
    const dipole_place place = io_csv_place(&reader->csv, reader->csv.line_start);
    if (has_r ? has_lo || has_hi : !(has_lo && has_hi))
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "the header has %s, %s",
                           has_r    ? "both a distance and edges of rings"
                           : has_lo ? "r_lo_mm without r_hi_mm"
                           : has_hi ? "r_hi_mm without r_lo_mm"
                                    : "no distance",
                           expected_columns);
    reader->is_per_incident = field_of[RD] < IO_CSV_FIELD_LIMIT &&
                              io_csv_equals(&reader->csv.fields[field_of[RD]], per_incident_name);
    return field_of[RD] < IO_CSV_FIELD_LIMIT ||
           dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "the header has no rd_per_mm2, %s",
                       expected_columns);
}

/* ---- rows ---------------------------------------------------------------------------------------- */

/* The number of a column of the current line, within min..max. */
static bool get_number(const struct reader *reader, enum column column, const char *name, double min,
                       double max, double *out)
{
    return io_csv_get_number(&reader->csv, &reader->csv.fields[reader->field_of[column]], name, min, max,
                             out, reader->status);
}

static bool read_row(const struct reader *reader, struct io_profile *profile)
{
    const struct io_csv *const csv = &reader->csv;
    const size_t i = profile->count;
    if (!io_csv_check_width(csv, reader->status))
        return false;
    double *const lo = &profile->r_lo_mm[i], *const hi = &profile->r_hi_mm[i];
    const double limit = DIPOLE_THICKNESS_MAX_MM;
    if (!(profile->has_rings ? get_number(reader, R_LO, "r_lo_mm", 0, limit, lo) &&
                                   get_number(reader, R_HI, "r_hi_mm", 0, limit, hi)
                             : get_number(reader, R, "r_mm", 0, limit, lo)) ||
        !get_number(reader, RD, "rd_per_mm2", -VALUE_LIMIT_PER_MM2, VALUE_LIMIT_PER_MM2,
                    &profile->rd_per_mm2[i]) ||
        (profile->sem_per_mm2 &&
         !get_number(reader, SEM, "sem", 0, VALUE_LIMIT_PER_MM2, &profile->sem_per_mm2[i])))
        return false;
    if (!profile->has_rings) {
        *hi = *lo;
    } else if (!(*hi > *lo)) {
        const dipole_place place = io_csv_place(csv, csv->fields[reader->field_of[R_HI]].start);
        return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place,
                           "r_hi_mm is %g, expected more than r_lo_mm, %g", *hi, *lo);
    }
    profile->count++;
    return true;
}

static bool read_rows(struct reader *reader, size_t capacity, struct io_profile *profile)
{
    for (;;) {
        const enum io_csv_next next = io_csv_next(&reader->csv, reader->status);
        if (next == IO_CSV_FAILED)
            return false;
        if (next == IO_CSV_END)
            break;
        if (profile->count == capacity) {
            const dipole_place place = io_csv_place(&reader->csv, reader->csv.line_start);
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place, "the table has more than %zu rows",
                               capacity);
        }
        if (!read_row(reader, profile))
            return false;
    }
    const dipole_place place = { .source = reader->csv.source };
    return profile->count > 0 || dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place,
                                             "has a header and no rows, expected at least one");
}

/* ---- files --------------------------------------------------------------------------------------- */

/* One allocation: the struct, then its columns. */
static struct io_profile *profile_allocate(size_t capacity, bool has_rings, bool has_sem)
{
    struct io_profile *const profile =
        malloc(sizeof *profile + (has_sem ? 4 : 3) * capacity * sizeof(double));
    if (!profile)
        return NULL;
    double *const numbers = (double *)(profile + 1);
    *profile = (struct io_profile){ .has_rings = has_rings,
                                    .r_lo_mm = numbers,
                                    .r_hi_mm = numbers + capacity,
                                    .rd_per_mm2 = numbers + 2 * capacity,
                                    .sem_per_mm2 = has_sem ? numbers + 3 * capacity : NULL };
    return profile;
}

static bool parse(struct reader *reader, struct io_profile **profile_out)
{
    if (!read_header(reader))
        return false;
    const size_t line_count = io_csv_count_lines(&reader->csv);
    const size_t capacity = line_count < IO_PROFILE_ROW_LIMIT ? line_count : IO_PROFILE_ROW_LIMIT;
    struct io_profile *const profile = profile_allocate(capacity, reader->field_of[R] == IO_CSV_FIELD_LIMIT,
                                                        reader->field_of[SEM] < IO_CSV_FIELD_LIMIT);
    if (!profile)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu rows", capacity);
    profile->is_per_incident = reader->is_per_incident;
    if (!read_rows(reader, capacity, profile)) {
        io_profile_destroy(profile);
        return false;
    }
    *profile_out = profile;
    return true;
}

bool io_profile_parse(const char *text, size_t size, const char *source, struct io_profile **profile_out,
                      dipole_status *status)
{
    *profile_out = NULL;
    struct reader *const reader = malloc(sizeof *reader);
    bool done = false;
    if (reader) {
        io_csv_init(&reader->csv, text, size, source, IO_PROFILE_LINE_LIMIT);
        reader->status = status;
        done = parse(reader, profile_out);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to read %.100s", source);
    }
    free(reader);
    return done;
}

bool io_profile_read(const char *path, struct io_profile **profile_out, dipole_status *status)
{
    *profile_out = NULL;
    char *text = NULL;
    size_t size = 0;
    const bool done = io_file_read(path, FILE_SIZE_LIMIT, &text, &size, status) &&
                      io_profile_parse(text, size, path, profile_out, status);
    free(text);
    return done;
}

void io_profile_destroy(struct io_profile *profile)
{
    free(profile);
}

double io_profile_r_mm(const struct io_profile *profile, size_t i)
{
    const double lo = profile->r_lo_mm[i], hi = profile->r_hi_mm[i];
    return lo == hi ? lo : hi * sqrt(0.5 * (1.0 + (lo / hi) * (lo / hi)));
}
