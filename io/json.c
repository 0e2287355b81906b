#include "io/json.h"

#include "io/file.h"

#include <locale.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct io_json_document {
    json_t *root;
    char *text; /* NUL-terminated; jansson has found it to be valid JSON */
    char *source;
};

/* ---- where a value stands ------------------------------------------------------------------------ */

/*
 * jansson forgets where values stood, so the text is scanned again when a message needs it. The text is
 * known to be valid, so the scan checks nothing. Members keep the order of the text in jansson and
 * duplicates are refused, so a key is found by its ordinal and its escapes need no decoding.
 */
static const char *skip_blank(const char *p)
{
    return p + strspn(p, " \t\r\n");
}

static const char *skip_string(const char *p)
{
    for (p++; *p != '"'; p++)
        if (*p == '\\')
            p++;
    return p + 1;
}

static const char *skip_value(const char *p)
{
    size_t depth = 0;
    do {
        if (*p == '"') {
            p = skip_string(p);
        } else if (*p == '{' || *p == '[') {
            depth++;
            p++;
        } else if (*p == '}' || *p == ']') {
            depth--;
            p++;
        } else if (depth > 0 && strchr(",: \t\r\n", *p)) {
            p++;
        } else {
            p += strcspn(p, ",:]} \t\r\n");
        }
    } while (depth > 0);
    return p;
}

/* From an object's opening brace to the value of a member, with is_key to its key; or from an array's
 * bracket to an element. */
static const char *enter(const char *p, const struct io_json *at, bool is_key)
{
    size_t ordinal = at->index;
    if (at->key) {
        json_t *object = at->parent->value;
        ordinal = 0;
        for (void *i = json_object_iter(object); strcmp(json_object_iter_key(i), at->key) != 0;
             i = json_object_iter_next(object, i))
            ordinal++;
    }
    p = skip_blank(p + 1);
    for (;; ordinal--) {
        if (ordinal == 0 && is_key)
            return p;
        if (at->key)
            p = skip_blank(skip_blank(skip_string(p)) + 1);
        if (ordinal == 0)
            return p;
        p = skip_blank(skip_blank(skip_value(p)) + 1);
    }
}

static const char *locate(const struct io_json *at, bool is_key)
{
    if (!at->parent)
        return skip_blank(at->document->text);
    const char *p = locate(at->parent, false);
    return at->value ? enter(p, at, is_key) : p;
}

/* Columns count characters, as jansson's do, not bytes. */
static dipole_place place_of(const struct io_json *at, bool is_key)
{
    dipole_place place = { .source = at->document->source, .line = 1, .column = 1 };
    const char *end = locate(at, is_key);
    for (const char *p = at->document->text; p < end; p++) {
        if (*p == '\n') {
            place.line++;
            place.column = 1;
        } else if (((unsigned char)*p & 0xc0) != 0x80) {
            place.column++;
        }
    }
    return place;
}

dipole_place io_json_place(const struct io_json *at)
{
    return place_of(at, false);
}

/* ---- failure ------------------------------------------------------------------------------------- */

/* Append printf text at *length of a buffer; what does not fit is cut. */
static void append(char *buffer, size_t size, size_t *length, const char *format, ...) DIPOLE_PRINTF(4, 5);

static void append(char *buffer, size_t size, size_t *length, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const int count = vsnprintf(buffer + *length, size - *length, format, arguments);
    va_end(arguments);
    if (count > 0)
        *length = *length + (size_t)count < size ? *length + (size_t)count : size - 1;
}

/* Control characters from a file do not reach the terminal. */
static void make_printable(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7f)
            *text = '?';
}

enum { PATH_SIZE = 160 };

static void path_of(const struct io_json *at, char path[PATH_SIZE], size_t *length)
{
    path[*length] = '\0';
    if (!at->parent)
        return;
    path_of(at->parent, path, length);
    if (at->key)
        append(path, PATH_SIZE, length, "%s%s", *length > 0 ? "." : "", at->key);
    else
        append(path, PATH_SIZE, length, "[%zu]", at->index);
}

bool io_json_fail(const struct io_json *at, dipole_code code, dipole_status *status, const char *format,
                  ...)
{
    char path[PATH_SIZE], message[sizeof status->message];
    size_t path_length = 0, length = 0;
    path_of(at, path, &path_length);
    append(message, sizeof message, &length, "%s%s", path, path_length > 0 ? " " : "");
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, sizeof message - length, format, arguments);
    va_end(arguments);
    make_printable(message);
    const dipole_place place = io_json_place(at);
    return dipole_fail(status, code, &place, "%s", message);
}

static bool fail_at_unknown_key(const struct io_json *object, const char *key, const char *const *known,
                                dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    char path[PATH_SIZE], message[sizeof status->message];
    size_t path_length = 0, length = 0;
    path_of(object, path, &path_length);
    append(message, sizeof message, &length, "unknown key \"%.60s\"%s%s, expected", key,
           path_length > 0 ? " in " : "", path);
    for (size_t i = 0; known[i]; i++)
        append(message, sizeof message, &length, "%s %s", i > 0 ? "," : "", known[i]);
    make_printable(message);
    const dipole_place place = place_of(&member, true);
    return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "%s", message);
}

/* "is a string, expected a number": what a value of the wrong type is told. */
static bool fail_at_type(const struct io_json *at, const char *expected, dipole_status *status)
{
    static const char *const names[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "a string",
        [JSON_INTEGER] = "a number", [JSON_REAL] = "a number",  [JSON_TRUE] = "true",
        [JSON_FALSE] = "false",      [JSON_NULL] = "null",
    };
    if (!at->value)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status, "is missing, expected %s", expected);
    return io_json_fail(at, DIPOLE_BAD_VALUE, status, "%sis %s, expected %s",
                        at->parent ? "" : "the whole ", names[json_typeof(at->value)], expected);
}

/* ---- documents ----------------------------------------------------------------------------------- */

bool io_json_parse(const char *text, size_t size, const char *source,
                   struct io_json_document **document_out, dipole_status *status)
{
    *document_out = NULL;
    dipole_place place = { .source = source };
    if (size > IO_JSON_SIZE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "has %zu bytes, expected at most %zu", size,
                           IO_JSON_SIZE_LIMIT);
    struct io_json_document *document = calloc(1, sizeof *document);
    if (!document || !(document->source = strdup(source)) || !(document->text = malloc(size + 1))) {
        io_json_destroy(document);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for %zu bytes of JSON", size);
    }
    memcpy(document->text, text, size);
    document->text[size] = '\0';

    json_error_t error;
    document->root =
        json_loadb(document->text, size, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, &error);
    if (!document->root) {
        io_json_destroy(document);
        if (json_error_code(&error) == json_error_out_of_memory)
            return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for %zu bytes of JSON",
                               size);
        place.line = error.line > 0 ? error.line : 1;
        place.column = error.column > 0 ? error.column : 1;
        make_printable(error.text);
        return dipole_fail(status, DIPOLE_BAD_SYNTAX, &place, "JSON syntax: %s", error.text);
    }
    *document_out = document;
    return true;
}

bool io_json_read(const char *path, struct io_json_document **document_out, dipole_status *status)
{
    *document_out = NULL;
    char *text = NULL;
    size_t size = 0;
    const bool done = io_file_read(path, IO_JSON_SIZE_LIMIT, &text, &size, status) &&
                      io_json_parse(text, size, path, document_out, status);
    free(text);
    return done;
}

void io_json_destroy(struct io_json_document *document)
{
    if (!document)
        return;
    json_decref(document->root);
    free(document->text);
    free(document->source);
    free(document);
}

struct io_json io_json_root(const struct io_json_document *document)
{
    return (struct io_json){ .document = document, .value = document->root };
}

struct io_json io_json_member(const struct io_json *object, const char *key)
{
    return (struct io_json){ .document = object->document,
                             .parent = object,
                             .key = key,
                             .value = json_object_get(object->value, key) };
}

struct io_json io_json_element(const struct io_json *array, size_t index)
{
    return (struct io_json){ .document = array->document,
                             .parent = array,
                             .index = index,
                             .value = json_array_get(array->value, index) };
}

/* ---- values -------------------------------------------------------------------------------------- */

bool io_json_check_object(const struct io_json *at, const char *const *known, size_t required_count,
                          dipole_status *status)
{
    if (!json_is_object(at->value))
        return fail_at_type(at, "an object", status);
    for (void *i = json_object_iter(at->value); i; i = json_object_iter_next(at->value, i)) {
        const char *key = json_object_iter_key(i);
        size_t k = 0;
        while (known[k] && strcmp(known[k], key) != 0)
            k++;
        if (!known[k])
            return fail_at_unknown_key(at, key, known, status);
    }
    for (size_t k = 0; k < required_count; k++) {
        const struct io_json member = io_json_member(at, known[k]);
        if (!member.value)
            return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "is missing, it is required here");
    }
    return true;
}

bool io_json_check_array(const struct io_json *at, size_t min_count, size_t max_count, size_t *count_out,
                         dipole_status *status)
{
    if (!json_is_array(at->value))
        return fail_at_type(at, "an array", status);
    const size_t count = json_array_size(at->value);
    if (count < min_count || count > max_count)
        return io_json_fail(at, DIPOLE_BAD_VALUE, status, "has %zu element%s, expected %zu to %zu", count,
                            count == 1 ? "" : "s", min_count, max_count);
    *count_out = count;
    return true;
}

/* As few digits as give the value back, with a point whatever the locale. */
static const char *shortest(char buffer[32], double value)
{
    const locale_t before = uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0));
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(buffer, 32, "%.*g", digits, value);
        if (strtod(buffer, NULL) == value)
            break;
    }
    uselocale(before);
    return buffer;
}

static bool get_number(const struct io_json *at, double min, double max, const char *kind, double *out,
                       dipole_status *status)
{
    if (!json_is_number(at->value))
        return fail_at_type(at, kind, status);
    const double value = json_number_value(at->value);
    if (value >= min && value <= max) {
        *out = value;
        return true;
    }
    char found[32], low[32], high[32];
    shortest(found, value);
    shortest(low, min);
    shortest(high, max);
    if (isinf(max))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status, "is %s, expected >= %s", found, low);
    if (isinf(min))
        return io_json_fail(at, DIPOLE_BAD_VALUE, status, "is %s, expected <= %s", found, high);
    return io_json_fail(at, DIPOLE_BAD_VALUE, status, "is %s, expected %s to %s", found, low, high);
}

bool io_json_get_number(const struct io_json *object, const char *key, double min, double max, double *out,
                        dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    return !member.value || get_number(&member, min, max, "a number", out, status);
}

bool io_json_get_integer(const struct io_json *object, const char *key, int min, int max, int *out,
                         dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    double value = 0.0;
    if (!member.value)
        return true;
    if (!get_number(&member, min, max, "a whole number", &value, status))
        return false;
    if (value != floor(value)) {
        char found[32];
        return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "is %s, expected a whole number",
                            shortest(found, value));
    }
    *out = (int)value;
    return true;
}

bool io_json_get_numbers(const struct io_json *object, const char *key, size_t count, double min,
                         double max, double *out, dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    if (!member.value)
        return true;
    char expected[64];
    snprintf(expected, sizeof expected, "an array of %zu numbers", count);
    if (!json_is_array(member.value))
        return fail_at_type(&member, expected, status);
    if (json_array_size(member.value) != count)
        return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "has %zu element%s, expected %s",
                            json_array_size(member.value), json_array_size(member.value) == 1 ? "" : "s",
                            expected);
    for (size_t i = 0; i < count; i++) {
        const struct io_json element = io_json_element(&member, i);
        if (!get_number(&element, min, max, "a number", &out[i], status))
            return false;
    }
    return true;
}

bool io_json_get_bool(const struct io_json *object, const char *key, bool *out, dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    if (!member.value)
        return true;
    if (!json_is_boolean(member.value))
        return fail_at_type(&member, "true or false", status);
    *out = json_is_true(member.value);
    return true;
}

bool io_json_get_text(const struct io_json *object, const char *key, char *out, size_t size,
                      dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    if (!member.value)
        return true;
    if (!json_is_string(member.value))
        return fail_at_type(&member, "a string", status);
    const size_t length = json_string_length(member.value);
    if (length >= size)
        return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "has %zu bytes, expected at most %zu",
                            length, size - 1);
    memcpy(out, json_string_value(member.value), length + 1);
    return true;
}

bool io_json_get_choice(const struct io_json *object, const char *key, const char *const *choices, int *out,
                        dipole_status *status)
{
    const struct io_json member = io_json_member(object, key);
    if (!member.value)
        return true;
    char expected[256];
    size_t length = 0;
    for (int i = 0; choices[i]; i++)
        append(expected, sizeof expected, &length, "%s\"%s\"", i > 0 ? " or " : "", choices[i]);
    if (!json_is_string(member.value))
        return fail_at_type(&member, expected, status);
    for (int i = 0; choices[i]; i++) {
        if (strcmp(choices[i], json_string_value(member.value)) == 0) {
            *out = i;
            return true;
        }
    }
    return io_json_fail(&member, DIPOLE_BAD_VALUE, status, "is \"%.60s\", expected %s",
                        json_string_value(member.value), expected);
}

/* ---- writing ------------------------------------------------------------------------------------- */

json_t *io_json_number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static bool is_flat(json_t *array)
{
    for (size_t i = 0; i < json_array_size(array); i++)
        if (!json_is_number(json_array_get(array, i)))
            return false;
    return true;
}

static bool print_string(FILE *out, const char *text)
{
    json_t *string = json_string(text);
    char *quoted = json_dumps(string, JSON_ENCODE_ANY);
    json_decref(string);
    const bool done = quoted && fputs(quoted, out) >= 0;
    free(quoted);
    return done;
}

/* Where no lines are broken. */
enum { ONE_LINE = -1 };

/* A new line of a value that stands at indent, further in by more. */
static void break_line(FILE *out, int indent, int more)
{
    if (indent != ONE_LINE)
        fprintf(out, "\n%*s", indent + more, "");
}

static bool print_value(FILE *out, json_t *value, int indent)
{
    const int inner = indent == ONE_LINE ? ONE_LINE : indent + 2;
    char number[32];
    switch (json_typeof(value)) {
    case JSON_INTEGER:
        fprintf(out, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        return true;
    case JSON_REAL:
        fputs(shortest(number, json_real_value(value)), out);
        return true;
    case JSON_TRUE:
    case JSON_FALSE:
        fputs(json_is_true(value) ? "true" : "false", out);
        return true;
    case JSON_NULL:
        fputs("null", out);
        return true;
    case JSON_STRING:
        return print_string(out, json_string_value(value));
    case JSON_ARRAY: {
        const bool is_line = indent == ONE_LINE || is_flat(value);
        const size_t count = json_array_size(value);
        fputc('[', out);
        for (size_t i = 0; i < count; i++) {
            if (!is_line)
                break_line(out, indent, 2);
            if (!print_value(out, json_array_get(value, i), inner))
                return false;
            if (i + 1 < count)
                fputs(is_line ? ", " : ",", out);
        }
        if (!is_line)
            break_line(out, indent, 0);
        fputc(']', out);
        return true;
    }
    case JSON_OBJECT: {
        const char *separator = "";
        fputc('{', out);
        for (void *i = json_object_iter(value); i; i = json_object_iter_next(value, i)) {
            fputs(separator, out);
            break_line(out, indent, 2);
            if (!print_string(out, json_object_iter_key(i)))
                return false;
            fputs(": ", out);
            if (!print_value(out, json_object_iter_value(i), inner))
                return false;
            separator = indent == ONE_LINE ? ", " : ",";
        }
        if (json_object_size(value) > 0)
            break_line(out, indent, 0);
        fputc('}', out);
        return true;
    }
    }
    return false;
}

static char *format(json_t *value, int indent)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    bool done = print_value(out, value, indent);
    fputc('\n', out);
    done = !ferror(out) && done;
    if (fclose(out) != 0 || !done) {
        free(text);
        return NULL;
    }
    return text;
}

char *io_json_format(json_t *value)
{
    return format(value, 0);
}

char *io_json_format_line(json_t *value)
{
    return format(value, ONE_LINE);
}
