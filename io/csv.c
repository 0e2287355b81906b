#include "io/csv.h"

#include <assert.h>
#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void io_csv_init(struct io_csv *csv, const char *text, size_t size, const char *source, size_t line_limit)
{
    static const char byte_order_mark[] = "\xef\xbb\xbf";
    assert(line_limit <= IO_CSV_LINE_LIMIT);
    csv->next = text;
    csv->end = text + size;
    csv->source = source;
    csv->line_limit = line_limit;
    csv->line_number = 0;
    csv->field_count = csv->header_count = 0;
    if (size >= 3 && memcmp(text, byte_order_mark, 3) == 0)
        csv->next += 3;
    csv->line_start = csv->next;
}

dipole_place io_csv_place(const struct io_csv *csv, const char *at)
{
    dipole_place place = { .source = csv->source, .line = csv->line_number, .column = 1 };
    for (const char *c = csv->line_start; c < at; c++)
        place.column += ((unsigned char)*c & 0xc0) != 0x80;
    return place;
}

bool io_csv_equals(const struct io_csv_field *field, const char *text)
{
    return strlen(text) == field->length && memcmp(field->text, text, field->length) == 0;
}

const char *io_csv_printable(const struct io_csv_field *field, char out[64])
{
    size_t length = field->length < 60 ? field->length : 60;
    if (length < field->length) /* no part of a character */
        while (length > 0 && ((unsigned char)field->text[length] & 0xc0) == 0x80)
            length--;
    for (size_t i = 0; i < length; i++) {
        const unsigned char c = (unsigned char)field->text[i];
        out[i] = c < 0x20 || c == 0x7f ? '?' : field->text[i];
    }
    out[length] = '\0';
    return out;
}

size_t io_csv_count_lines(const struct io_csv *csv)
{
    size_t count = 1;
    for (const char *p = csv->next; p < csv->end; p++)
        count += *p == '\n';
    return count;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t';
}

/* A part of a line, from start to before end. */
struct span {
    const char *start, *end;
};

static struct span trim(struct span span)
{
    while (span.start < span.end && is_blank(span.start[0]))
        span.start++;
    while (span.start < span.end && is_blank(span.end[-1]))
        span.end--;
    return span;
}

static bool fail_at(const struct io_csv *csv, const char *at, const char *what, dipole_status *status)
{
    const dipole_place place = io_csv_place(csv, at);
    return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "%s", what);
}

/* The field that begins at *at with a quote; *at is then behind the blanks that follow it, at a comma or at
 * end. Its text goes to *unquoted, which moves on: a line's fields together are no longer than the line. */
static bool read_quoted(const struct io_csv *csv, const char **at, const char *end, char **unquoted,
                        struct io_csv_field *field, dipole_status *status)
{
    const char *p = *at + 1;
    char *out = *unquoted;
    while (p < end && (*p != '"' || (p + 1 < end && p[1] == '"'))) {
        p += *p == '"'; /* the first of two */
        *out++ = *p++;
    }
    if (p == end)
        return fail_at(csv, *at, "the quote has no end on its line, expected another one", status);
    *field = (struct io_csv_field){ .text = *unquoted, .length = (size_t)(out - *unquoted), .start = *at };
    *unquoted = out;
    p++;
    while (p < end && is_blank(*p))
        p++;
    *at = p;
    return p == end || *p == ',' ||
           fail_at(csv, p, "text behind the end of a quote, expected a comma", status);
}

/* The same of a field without quotes. */
static bool read_plain(const struct io_csv *csv, const char **at, const char *end,
                       struct io_csv_field *field, dipole_status *status)
{
    const char *const comma = memchr(*at, ',', (size_t)(end - *at));
    const struct span span = trim((struct span){ .start = *at, .end = comma ? comma : end });
    const size_t length = (size_t)(span.end - span.start);
    const char *const quote = memchr(span.start, '"', length);
    if (quote)
        return fail_at(csv, quote, "a quote inside a field, expected quotes around it and two inside",
                       status);
    *field = (struct io_csv_field){ .text = span.start, .length = length, .start = span.start };
    *at = comma ? comma : end;
    return true;
}

static bool split(struct io_csv *csv, const char *end, dipole_status *status)
{
    char *unquoted = csv->unquoted;
    csv->field_count = 0;
    for (const char *p = csv->line_start;; p++) {
        if (csv->field_count == IO_CSV_FIELD_LIMIT) {
            const dipole_place place = io_csv_place(csv, p);
            return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "the line has more than %d columns",
                               (int)IO_CSV_FIELD_LIMIT);
        }
        struct io_csv_field *const field = &csv->fields[csv->field_count++];
        const char *first = p;
        while (first < end && is_blank(*first))
            first++;
        const bool is_quoted = first < end && *first == '"';
        if (is_quoted)
            p = first;
        if (!(is_quoted ? read_quoted(csv, &p, end, &unquoted, field, status)
                        : read_plain(csv, &p, end, field, status)))
            return false;
        if (p == end)
            return true;
    }
}

enum io_csv_next io_csv_next(struct io_csv *csv, dipole_status *status)
{
    while (csv->next < csv->end) {
        const char *const newline = memchr(csv->next, '\n', (size_t)(csv->end - csv->next));
        const char *end = newline ? newline : csv->end;
        csv->line_start = csv->next;
        csv->line_number++;
        csv->next = newline ? newline + 1 : end;
        if (end > csv->line_start && end[-1] == '\r')
            end--;
        const size_t length = (size_t)(end - csv->line_start);
        if (length > csv->line_limit) {
            const dipole_place place = io_csv_place(csv, csv->line_start);
            dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "the line has %zu bytes, expected at most %zu",
                        length, csv->line_limit);
            return IO_CSV_FAILED;
        }
        const struct span trimmed = trim((struct span){ .start = csv->line_start, .end = end });
        if (trimmed.start == trimmed.end || trimmed.start[0] == '#')
            continue;
        return split(csv, end, status) ? IO_CSV_LINE : IO_CSV_FAILED;
    }
    return IO_CSV_END;
}

static bool name_column(const struct io_csv *csv, size_t field, const struct io_csv_column *names,
                        size_t name_count, const char *expected, size_t *field_of, dipole_status *status)
{
    const struct io_csv_field *const name = &csv->fields[field];
    const dipole_place place = io_csv_place(csv, name->start);
    char text[64];
    for (size_t i = 0; i < name_count; i++) {
        if (!io_csv_equals(name, names[i].name))
            continue;
        if (names[i].column < 0)
            return true;
        if (field_of[names[i].column] < IO_CSV_FIELD_LIMIT)
            return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                               "column \"%s\" is the second of its kind, expected one",
                               io_csv_printable(name, text));
        field_of[names[i].column] = field;
        return true;
    }
    return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "unknown column \"%s\", %s",
                       io_csv_printable(name, text), expected);
}

bool io_csv_read_header(struct io_csv *csv, const struct io_csv_column *names, size_t name_count,
                        const char *expected, size_t *field_of, size_t column_count, dipole_status *status)
{
    const dipole_place place = { .source = csv->source };
    const enum io_csv_next next = io_csv_next(csv, status);
    if (next == IO_CSV_FAILED)
        return false;
    if (next == IO_CSV_END)
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "has no header line, %s", expected);
    csv->header_count = csv->field_count;
    for (size_t column = 0; column < column_count; column++)
        field_of[column] = IO_CSV_FIELD_LIMIT;
    for (size_t field = 0; field < csv->field_count; field++) {
        if (!name_column(csv, field, names, name_count, expected, field_of, status))
            return false;
    }
    return true;
}

bool io_csv_check_width(const struct io_csv *csv, dipole_status *status)
{
    const dipole_place place = io_csv_place(csv, csv->line_start);
    return csv->field_count == csv->header_count ||
           dipole_fail(status, DIPOLE_BAD_SYNTAX, &place,
                       "the line has %zu column%s, expected the %zu of the header", csv->field_count,
                       csv->field_count == 1 ? "" : "s", csv->header_count);
}

bool io_csv_get_number(const struct io_csv *csv, const struct io_csv_field *field, const char *name,
                       double min, double max, double *out, dipole_status *status)
{
    const dipole_place place = io_csv_place(csv, field->start);
    char text[64], number[64];
    if (field->length == 0)
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "%s is empty, expected a number", name);
    /* hexadecimal numbers, inf and nan are none */
    const bool fits = field->length < sizeof number;
    if (fits) {
        memcpy(number, field->text, field->length);
        number[field->length] = '\0';
    }
    const locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    char *end = number;
    const bool is_decimal = fits && strspn(number, "0123456789+-.eE") == field->length;
    const double value = is_decimal && c_locale ? strtod_l(number, &end, c_locale) : NAN;
    if (c_locale)
        freelocale(c_locale);
    if (end != number + field->length)
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "%s is \"%s\", expected a number", name,
                           io_csv_printable(field, text));
    if (!(value >= min && value <= max))
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "%s is %s, expected %g to %g", name,
                           io_csv_printable(field, text), min, max);
    *out = value;
    return true;
}
