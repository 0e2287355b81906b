#include "io/profile_file.h"

#include "io/file.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIELD_LIMIT = 64 };
#define FILE_SIZE_LIMIT ((size_t)256 << 20)
#define VALUE_LIMIT_PER_MM2 1e100

/* What a column holds. Those that MCML's tables have beside are known and not read. */
enum column { R, R_LO, R_HI, RD, SEM, NOT_READ, COLUMN_COUNT };

static const struct {
    const char *name;
    enum column column;
} column_names[] = {
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
static const char expected_columns[] = "expected r_mm,rd_per_mm2[,sem] or r_lo_mm,r_hi_mm,rd_per_mm2[,sem]";

/* ---- lines and fields ---------------------------------------------------------------------------- */

/* A text without its end: what lies between two commas, or the blanks about it. */
struct span {
    const char *start;
    size_t length;
};

struct line {
    const char *start;
    struct span fields[FIELD_LIMIT];
    size_t field_count;
};

struct reader {
    const char *next, *end;
    const char *source;
    int line_number;
    locale_t c_locale;
    struct line line;
    size_t field_of[COLUMN_COUNT]; /* FIELD_LIMIT for none */
    size_t column_count;           /* that the header has  */
    dipole_status *status;
};

/* The column, in characters, at which p stands in the current line. */
static dipole_place place_at(const struct reader *reader, const char *p)
{
    dipole_place place = { .source = reader->source, .line = reader->line_number, .column = 1 };
    for (const char *c = reader->line.start; c < p; c++)
        place.column += ((unsigned char)*c & 0xc0) != 0x80;
    return place;
}

/* Text of a file for a message: at most 60 bytes, no control characters. */
static const char *printable(struct span span, char out[64])
{
    const size_t length = span.length < 60 ? span.length : 60;
    for (size_t i = 0; i < length; i++) {
        const unsigned char c = (unsigned char)span.start[i];
        out[i] = c < 0x20 || c == 0x7f ? '?' : span.start[i];
    }
    out[length] = '\0';
    return out;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static struct span trim(struct span span)
{
    while (span.length > 0 && is_blank(span.start[0])) {
        span.start++;
        span.length--;
    }
    while (span.length > 0 && is_blank(span.start[span.length - 1]))
        span.length--;
    return span;
}

static bool equals(struct span span, const char *text)
{
    return strlen(text) == span.length && memcmp(span.start, text, span.length) == 0;
}

static bool split(struct reader *reader, struct span text)
{
    struct line *const line = &reader->line;
    line->field_count = 0;
    const char *start = text.start;
    for (const char *p = start;; p++) {
        if (p < text.start + text.length && *p != ',')
            continue;
        if (line->field_count == FIELD_LIMIT) {
            const dipole_place place = place_at(reader, start);
            return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                               "the line has more than %d columns", (int)FIELD_LIMIT);
        }
        line->fields[line->field_count++] =
            trim((struct span){ .start = start, .length = (size_t)(p - start) });
        if (p == text.start + text.length)
            return true;
        start = p + 1;
    }
}

enum next { NEXT_LINE, NEXT_END, NEXT_FAILED };

/* The next line that is neither empty nor a comment, split into its fields. */
static enum next next_line(struct reader *reader)
{
    while (reader->next < reader->end) {
        const size_t rest = (size_t)(reader->end - reader->next);
        const char *const newline = memchr(reader->next, '\n', rest);
        struct span text = { .start = reader->next,
                             .length = newline ? (size_t)(newline - reader->next) : rest };
        reader->line.start = text.start;
        reader->line_number++;
        reader->next += text.length + (newline ? 1 : 0);
        if (text.length > 0 && text.start[text.length - 1] == '\r')
            text.length--;
        if (text.length > IO_PROFILE_LINE_LIMIT) {
            const dipole_place place = place_at(reader, text.start);
            dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                        "the line has %zu bytes, expected at most %zu", text.length, IO_PROFILE_LINE_LIMIT);
            return NEXT_FAILED;
        }
        const struct span trimmed = trim(text);
        if (trimmed.length == 0 || trimmed.start[0] == '#')
            continue;
        return split(reader, text) ? NEXT_LINE : NEXT_FAILED;
    }
    return NEXT_END;
}

/* ---- the header ---------------------------------------------------------------------------------- */

static bool name_column(struct reader *reader, size_t field)
{
    const struct span name = reader->line.fields[field];
    const dipole_place place = place_at(reader, name.start);
    char text[64];
    for (size_t i = 0; i < sizeof column_names / sizeof column_names[0]; i++) {
        const enum column column = column_names[i].column;
        if (!equals(name, column_names[i].name))
            continue;
        if (column != NOT_READ && reader->field_of[column] < FIELD_LIMIT)
            return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                               "column \"%s\" is the second of its kind, expected one",
                               printable(name, text));
        reader->field_of[column] = field;
        return true;
    }
    return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "unknown column \"%s\", %s",
                       printable(name, text), expected_columns);
}

static bool read_header(struct reader *reader)
{
    const enum next next = next_line(reader);
    if (next == NEXT_FAILED)
        return false;
    if (next == NEXT_END) {
        const dipole_place place = { .source = reader->source };
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "has no header line, %s",
                           expected_columns);
    }
    for (int column = 0; column < COLUMN_COUNT; column++)
        reader->field_of[column] = FIELD_LIMIT;
    reader->column_count = reader->line.field_count;
    for (size_t i = 0; i < reader->column_count; i++)
        if (!name_column(reader, i))
            return false;
    const size_t *const field_of = reader->field_of;
    const bool has_r = field_of[R] < FIELD_LIMIT, has_lo = field_of[R_LO] < FIELD_LIMIT,
               has_hi = field_of[R_HI] < FIELD_LIMIT;
    const dipole_place place = place_at(reader, reader->line.start);
    if (has_r ? has_lo || has_hi : !(has_lo && has_hi))
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "the header has %s, %s",
                           has_r    ? "both a distance and edges of rings"
                           : has_lo ? "r_lo_mm without r_hi_mm"
                           : has_hi ? "r_hi_mm without r_lo_mm"
                                    : "no distance",
                           expected_columns);
    return field_of[RD] < FIELD_LIMIT || dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                                                     "the header has no rd_per_mm2, %s", expected_columns);
}

/* ---- rows ---------------------------------------------------------------------------------------- */

/* The number of a column of the current line, within min..max. */
static bool get_number(const struct reader *reader, enum column column, const char *name, double min,
                       double max, double *out)
{
    const struct span field = reader->line.fields[reader->field_of[column]];
    const dipole_place place = place_at(reader, field.start);
    char text[64], number[64];
    if (field.length == 0)
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "%s is empty, expected a number",
                           name);
    /* hexadecimal numbers, inf and nan are none */
    const bool fits = field.length < sizeof number;
    if (fits) {
        memcpy(number, field.start, field.length);
        number[field.length] = '\0';
    }
    char *end = number;
    const double value = fits && strspn(number, "0123456789+-.eE") == field.length
                             ? strtod_l(number, &end, reader->c_locale)
                             : NAN;
    if (end != number + field.length)
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place, "%s is \"%s\", expected a number",
                           name, printable(field, text));
    if (!(value >= min && value <= max))
        return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place, "%s is %s, expected %g to %g", name,
                           printable(field, text), min, max);
    *out = value;
    return true;
}

static bool read_row(const struct reader *reader, struct io_profile *profile)
{
    const struct line *const line = &reader->line;
    const size_t i = profile->count;
    if (line->field_count != reader->column_count) {
        const dipole_place place = place_at(reader, line->start);
        return dipole_fail(reader->status, DIPOLE_BAD_SYNTAX, &place,
                           "the line has %zu column%s, expected the %zu of the header", line->field_count,
                           line->field_count == 1 ? "" : "s", reader->column_count);
    }
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
        const dipole_place place = place_at(reader, line->fields[reader->field_of[R_HI]].start);
        return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place,
                           "r_hi_mm is %g, expected more than r_lo_mm, %g", *hi, *lo);
    }
    profile->count++;
    return true;
}

static bool read_rows(struct reader *reader, size_t capacity, struct io_profile *profile)
{
    for (;;) {
        const enum next next = next_line(reader);
        if (next == NEXT_FAILED)
            return false;
        if (next == NEXT_END)
            break;
        if (profile->count == capacity) {
            const dipole_place place = place_at(reader, reader->line.start);
            return dipole_fail(reader->status, DIPOLE_BAD_VALUE, &place, "the table has more than %zu rows",
                               capacity);
        }
        if (!read_row(reader, profile))
            return false;
    }
    const dipole_place place = { .source = reader->source };
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

/* Lines that are left, which rows cannot outnumber; no more than the limit. */
static size_t count_lines(const struct reader *reader)
{
    size_t count = 1;
    for (const char *p = reader->next; p < reader->end; p++)
        count += *p == '\n';
    return count < IO_PROFILE_ROW_LIMIT ? count : IO_PROFILE_ROW_LIMIT;
}

static bool parse(struct reader *reader, struct io_profile **profile_out)
{
    static const char byte_order_mark[] = "\xef\xbb\xbf";
    const size_t size = (size_t)(reader->end - reader->next);
    if (size >= 3 && memcmp(reader->next, byte_order_mark, 3) == 0)
        reader->next += 3;
    if (!read_header(reader))
        return false;
    const size_t capacity = count_lines(reader);
    struct io_profile *const profile =
        profile_allocate(capacity, reader->field_of[R] == FIELD_LIMIT, reader->field_of[SEM] < FIELD_LIMIT);
    if (!profile)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu rows", capacity);
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
    const locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    bool done = false;
    if (reader && c_locale) {
        *reader = (struct reader){
            .next = text, .end = text + size, .source = source, .c_locale = c_locale, .status = status
        };
        done = parse(reader, profile_out);
    } else {
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to read %.100s", source);
    }
    if (c_locale)
        freelocale(c_locale);
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
