#include "tests/check.h"

#include "io/json.h"

#include <locale.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- random documents whose positions are known ---------------------------------------------------- */

enum { TEXT_SIZE = 1 << 16, MAX_VALUES = 2000, MAX_DEPTH = 6 };

/* A value that was written: where, and by which steps from the root. */
struct written {
    int line, column;
    int depth;
    struct {
        char key[64]; /* "" for an element */
        size_t index;
    } steps[MAX_DEPTH];
};

struct writer {
    struct rng rng;
    char text[TEXT_SIZE];
    size_t length;
    int line, column;
    struct written values[MAX_VALUES];
    size_t value_count;
};

static size_t pick(struct writer *w, size_t count)
{
    return (size_t)(random_bits(&w->rng) % count);
}

static void put(struct writer *w, const char *text)
{
    for (const char *p = text; *p; p++) {
        assert_true(w->length + 1 < TEXT_SIZE);
        w->text[w->length++] = *p;
        if (*p == '\n') {
            w->line++;
            w->column = 1;
        } else if (((unsigned char)*p & 0xc0) != 0x80) {
            w->column++;
        }
    }
}

static void put_blank(struct writer *w)
{
    static const char *const blanks[] = { "", "", " ", "\n", "\t", "\r\n  " };
    put(w, blanks[pick(w, 6)]);
}

/* Pieces of strings as JSON writes them, and what they mean. */
static const char *const pieces[][2] = {
    { "a", "a" },
    { "\\\"", "\"" },
    { "\\\\", "\\" },
    { "\\u00e9", "\303\251" },
    { "\303\251", "\303\251" },
    { "\342\202\254", "\342\202\254" },
    { "{[,:]}", "{[,:]}" },
    { "\\n", "\n" },
    { "\\ud83d\\ude00", "\360\237\230\200" },
};

static void put_string(struct writer *w, const char *start, char meaning[64])
{
    put(w, "\"");
    put(w, start);
    strcpy(meaning, start);
    for (size_t n = pick(w, 4); n > 0; n--) {
        const char *const *piece = pieces[pick(w, sizeof pieces / sizeof pieces[0])];
        put(w, piece[0]);
        strcat(meaning, piece[1]);
    }
    put(w, "\"");
}

static void put_value(struct writer *w, struct written at)
{
    static const char *const scalars[] = { "0", "-1.5e-3", "true", "false", "null", "[]", "{}" };
    char meaning[64];
    at.line = w->line;
    at.column = w->column;
    if (w->value_count < MAX_VALUES)
        w->values[w->value_count++] = at;
    const size_t kind = at.depth == 0 ? 2 + pick(w, 2) : at.depth == MAX_DEPTH ? pick(w, 2) : pick(w, 4);
    if (kind == 0) {
        put(w, scalars[pick(w, 7)]);
        return;
    }
    if (kind == 1) {
        put_string(w, "", meaning);
        return;
    }
    struct written child = at;
    child.depth++;
    const size_t count = pick(w, 5);
    put(w, kind == 2 ? "{" : "[");
    for (size_t i = 0; i < count; i++) {
        char start[24] = "";
        put_blank(w);
        child.steps[at.depth].index = i;
        child.steps[at.depth].key[0] = '\0';
        if (kind == 2) {
            snprintf(start, sizeof start, "%zu", i); /* keys differ */
            put_string(w, start, child.steps[at.depth].key);
            put_blank(w);
            put(w, ":");
            put_blank(w);
        }
        put_value(w, child);
        put_blank(w);
        if (i + 1 < count)
            put(w, ",");
    }
    put_blank(w);
    put(w, kind == 2 ? "}" : "]");
}

/* Oracle: the positions that the text was written at. */
static void values_are_found_where_they_were_written(void **state)
{
    (void)state;
    struct writer *w = malloc(sizeof *w);
    for (unsigned seed = 0; seed < 200; seed++) {
        w->rng = (struct rng){ .seed = seed };
        w->length = w->value_count = 0;
        w->line = w->column = 1;
        put_blank(w);
        put_value(w, (struct written){ 0 });
        put_blank(w);
        struct io_json_document *document;
        dipole_status status;
        if (!io_json_parse(w->text, w->length, "x.json", &document, &status))
            fail_msg("seed %u: %d:%d: %s\n%.*s", seed, status.line, status.column, status.message,
                     (int)w->length, w->text);
        for (size_t i = 0; i < w->value_count; i++) {
            const struct written *value = &w->values[i];
            struct io_json way[MAX_DEPTH + 1];
            way[0] = io_json_root(document);
            for (int d = 0; d < value->depth; d++) {
                const char *key = value->steps[d].key;
                way[d + 1] =
                    key[0] ? io_json_member(&way[d], key) : io_json_element(&way[d], value->steps[d].index);
                assert_non_null(way[d + 1].value);
            }
            const dipole_place place = io_json_place(&way[value->depth]);
            if (place.line != value->line || place.column != value->column)
                fail_msg("seed %u, value %zu: %d:%d, expected %d:%d in\n%.*s", seed, i, place.line,
                         place.column, value->line, value->column, (int)w->length, w->text);
        }
        io_json_destroy(document);
    }
    free(w);
}

/* ---- messages -------------------------------------------------------------------------------------- */

/* A reader that uses everything once. */
static bool read_thing(const char *text, dipole_status *status)
{
    static const char *const known[] = { "need", "number", "whole",  "triple", "flag",
                                         "text", "pick",   "things", NULL };
    static const char *const inner[] = { "scale", NULL };
    static const char *const choices[] = { "red", "green", NULL };
    struct io_json_document *document;
    if (!io_json_parse(text, strlen(text), "x.json", &document, status))
        return false;
    const struct io_json root = io_json_root(document);
    const struct io_json things = io_json_member(&root, "things");
    double number, triple[3];
    int whole, choice;
    bool flag;
    char buffer[8];
    size_t count = 0;
    bool done = io_json_check_object(&root, known, 1, status) &&
                io_json_get_number(&root, "number", 0.0, INFINITY, &number, status) &&
                io_json_get_integer(&root, "whole", -5, 5, &whole, status) &&
                io_json_get_numbers(&root, "triple", 3, -INFINITY, 0.25, triple, status) &&
                io_json_get_bool(&root, "flag", &flag, status) &&
                io_json_get_text(&root, "text", buffer, sizeof buffer, status) &&
                io_json_get_choice(&root, "pick", choices, &choice, status) &&
                (!things.value || io_json_check_array(&things, 1, 2, &count, status));
    for (size_t i = 0; i < count && done; i++) {
        const struct io_json thing = io_json_element(&things, i);
        done = io_json_check_object(&thing, inner, 0, status) &&
               io_json_get_number(&thing, "scale", 1e-3, 1e3, &number, status);
    }
    io_json_destroy(document);
    return done;
}

/* Oracle: the messages as a user should read them. */
static void failures_say_where_what_and_what_was_expected(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        dipole_code code;
        int line, column;
        const char *message;
    } cases[] = {
        { "{\"need\": 1,\n \"\303\251\": 2, \"nmber\": 3}", DIPOLE_BAD_VALUE, 2, 2,
          "unknown key \"\303\251\", expected need, number, whole, triple, flag, text, pick, things" },
        { "{\"need\": 1, \"a\\u001b[31m\": 2}", DIPOLE_BAD_VALUE, 1, 13,
          "unknown key \"a?[31m\", expected need, number, whole, triple, flag, text, pick, things" },
        { "{\"number\": 1}", DIPOLE_BAD_VALUE, 1, 1, "need is missing, it is required here" },
        { "[1]", DIPOLE_BAD_VALUE, 1, 1, "the whole is an array, expected an object" },
        { "{\"need\":0,\n\n  \"number\":  \"\\\"3\"}", DIPOLE_BAD_VALUE, 3, 14,
          "number is a string, expected a number" },
        { "{\"need\":0,\"number\": -0.2}", DIPOLE_BAD_VALUE, 1, 21, "number is -0.2, expected >= 0" },
        { "{\"need\":0,\"whole\": 6}", DIPOLE_BAD_VALUE, 1, 20, "whole is 6, expected -5 to 5" },
        { "{\"need\":0,\"whole\": 1.5}", DIPOLE_BAD_VALUE, 1, 20, "whole is 1.5, expected a whole number" },
        { "{\"need\":0,\"triple\": [0, 0.1]}", DIPOLE_BAD_VALUE, 1, 21,
          "triple has 2 elements, expected an array of 3 numbers" },
        { "{\"need\":0,\"triple\": [0, 0.1,\n  0.3]}", DIPOLE_BAD_VALUE, 2, 3,
          "triple[2] is 0.3, expected <= 0.25" },
        { "{\"need\":0,\"triple\": [0, [0, 1], 2]}", DIPOLE_BAD_VALUE, 1, 25,
          "triple[1] is an array, expected a number" },
        { "{\"need\":0,\"flag\": 1}", DIPOLE_BAD_VALUE, 1, 19, "flag is a number, expected true or false" },
        { "{\"need\":0,\"text\": \"12345678\"}", DIPOLE_BAD_VALUE, 1, 19,
          "text has 8 bytes, expected at most 7" },
        { "{\"need\":0,\"pick\": \"blue\"}", DIPOLE_BAD_VALUE, 1, 19,
          "pick is \"blue\", expected \"red\" or \"green\"" },
        { "{\"need\":0,\"pick\": null}", DIPOLE_BAD_VALUE, 1, 19,
          "pick is null, expected \"red\" or \"green\"" },
        { "{\"need\":0,\"things\": []}", DIPOLE_BAD_VALUE, 1, 21,
          "things has 0 elements, expected 1 to 2" },
        { "{\"need\":0,\"things\": [{}, {\"scale\": 0}]}", DIPOLE_BAD_VALUE, 1, 36,
          "things[1].scale is 0, expected 0.001 to 1000" },
        { "{\"need\":0,\"things\": [{}, {\"scall\": 0}]}", DIPOLE_BAD_VALUE, 1, 27,
          "unknown key \"scall\" in things[1], expected scale" },
        { "{\"need\": NaN}", DIPOLE_BAD_SYNTAX, 1, 12, "JSON syntax: invalid token near 'NaN'" },
        { "{\"need\":\n Infinity}", DIPOLE_BAD_SYNTAX, 2, 9, "JSON syntax: invalid token near 'Infinity'" },
        { "{\"need\": 1e999}", DIPOLE_BAD_SYNTAX, 1, 14, "JSON syntax: real number overflow near '1e999'" },
        { "{\"need\": 1, \"need\": 2}", DIPOLE_BAD_SYNTAX, 1, 18,
          "JSON syntax: duplicate object key near '\"need\"'" },
        { "{\"need\": 1,}", DIPOLE_BAD_SYNTAX, 1, 12, "JSON syntax: string or '}' expected near '}'" },
        { "{\"need\": 1", DIPOLE_BAD_SYNTAX, 1, 10, "JSON syntax: '}' expected near end of file" },
        { "", DIPOLE_BAD_SYNTAX, 1, 1, "JSON syntax: '[' or '{' expected near end of file" },
        { "{\"need\": 1} 2", DIPOLE_BAD_SYNTAX, 1, 13, "JSON syntax: end of file expected near '2'" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        dipole_status status = { 0 };
        assert_false(read_thing(cases[i].text, &status));
        assert_string_equal(status.message, cases[i].message);
        assert_string_equal(status.source, "x.json");
        if (status.code != cases[i].code || status.line != cases[i].line ||
            status.column != cases[i].column)
            fail_msg("%s: code %d at %d:%d, expected %d at %d:%d", cases[i].message, status.code,
                     status.line, status.column, cases[i].code, cases[i].line, cases[i].column);
    }
}

/* Oracle: the values in the text; absent keys keep their defaults. */
static void values_arrive_and_absent_keys_keep_defaults(void **state)
{
    (void)state;
    static const char text[] =
        "{\"n\": 2.5, \"i\": 3e0, \"v\": [1, 2, 3], \"b\": true, \"t\": \"\\u00e9\", \"c\": \"y\"}";
    static const char *const choices[] = { "x", "y", NULL };
    struct io_json_document *document;
    assert_true(io_json_parse(text, sizeof text - 1, "x.json", &document, NULL));
    const struct io_json root = io_json_root(document);
    double n = 0, v[3] = { 0 };
    int i = 0, c = 0;
    bool b = false;
    char t[3] = "";
    assert_true(io_json_get_number(&root, "n", 2.5, 2.5, &n, NULL));
    assert_true(io_json_get_integer(&root, "i", 3, 3, &i, NULL));
    assert_true(io_json_get_numbers(&root, "v", 3, 1.0, 3.0, v, NULL));
    assert_true(io_json_get_bool(&root, "b", &b, NULL));
    assert_true(io_json_get_text(&root, "t", t, sizeof t, NULL));
    assert_true(io_json_get_choice(&root, "c", choices, &c, NULL));
    assert_true(n == 2.5 && i == 3 && v[0] == 1 && v[1] == 2 && v[2] == 3 && b && c == 1);
    assert_string_equal(t, "\303\251");
    assert_true(io_json_get_number(&root, "absent", 0, 1, &n, NULL) &&
                io_json_get_integer(&root, "absent", 0, 1, &i, NULL) &&
                io_json_get_numbers(&root, "absent", 3, 0, 1, v, NULL) &&
                io_json_get_bool(&root, "absent", &b, NULL) &&
                io_json_get_text(&root, "absent", t, sizeof t, NULL) &&
                io_json_get_choice(&root, "absent", choices, &c, NULL));
    assert_true(n == 2.5 && i == 3 && v[2] == 3 && b && c == 1);
    assert_string_equal(t, "\303\251");
    io_json_destroy(document);
}

/* Oracle: a prefix of an object is never an object. Run under a sanitizer it also shows that none is read
 * beyond its end. */
static void truncated_text_is_a_syntax_error(void **state)
{
    (void)state;
    static const char text[] = "{\"a\": [1.5, \"\\u00e9\\\"\", {\"b\": null}],\n \"c\": {\"d\": [[], {}]}}";
    for (size_t size = 0; size + 1 < sizeof text - 1; size++) {
        char *copy = malloc(size + 1); /* of exactly that size */
        memcpy(copy, text, size);
        struct io_json_document *document;
        dipole_status status;
        assert_false(io_json_parse(copy, size, "x.json", &document, &status));
        assert_null(document);
        assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
        assert_true(status.line >= 1 && status.column >= 1);
        free(copy);
    }
}

/* Oracle: the documented limit. */
static void a_file_over_the_limit_is_refused(void **state)
{
    (void)state;
    FILE *file = fopen("large.json", "w");
    assert_non_null(file);
    assert_int_equal(ftruncate(fileno(file), (off_t)IO_JSON_SIZE_LIMIT + 1), 0);
    fclose(file);
    struct io_json_document *document;
    dipole_status status;
    assert_false(io_json_read("large.json", &document, &status));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message, "is too large, expected at most 16777216 bytes");
    assert_string_equal(status.source, "large.json");
    unlink("large.json");
}

/* Oracle: nesting beyond any sensible file must not exhaust the stack. */
static void deep_nesting_is_a_syntax_error(void **state)
{
    (void)state;
    enum { DEPTH = 1000000 };
    char *text = malloc(DEPTH);
    memset(text, '[', DEPTH);
    struct io_json_document *document;
    dipole_status status;
    assert_false(io_json_parse(text, DEPTH, "x.json", &document, &status));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
    free(text);
}

/* Oracle: reading what was written gives every double back, in a locale with decimal commas as well. */
static void formatted_numbers_read_back_exactly(void **state)
{
    (void)state;
    struct rng rng = { .seed = 7 };
    for (int pass = 0; pass < 2; pass++) {
        if (pass == 1 && !setlocale(LC_ALL, "de_DE.UTF-8"))
            break;
        json_t *array = json_array();
        double values[500];
        for (size_t i = 0; i < 500; i++) {
            values[i] = (random_bits(&rng) & 1 ? -1.0 : 1.0) * log_uniform(&rng, 1e-300, 1e300);
            json_array_append_new(array, json_real(values[i]));
        }
        json_t *root = json_pack("{s:o, s:s, s:[i, [], {}, b, n], s:{}}", "values", array, "text\n",
                                 "\303\251\"", "mixed", 3, 1, "empty");
        char *text = io_json_format(root);
        struct io_json_document *document;
        assert_true(io_json_parse(text, strlen(text), "x.json", &document, NULL));
        const struct io_json again = io_json_root(document);
        double found[500];
        assert_true(io_json_get_numbers(&again, "values", 500, -INFINITY, INFINITY, found, NULL));
        assert_memory_equal(found, values, sizeof values);
        io_json_destroy(document);
        free(text);
        json_decref(root);
    }
    setlocale(LC_ALL, "C");
}

/* Oracle: the layout that people read. */
static void formatted_json_is_for_people(void **state)
{
    (void)state;
    json_t *root = json_pack("{s:[fff], s:[{s:b}, s], s:{}, s:[]}", "rgb", 0.0021, 1e-7, 3.0, "list", "x",
                             1, "y", "none", "nothing");
    char *text = io_json_format(root);
    assert_string_equal(
        text, "{\n  \"rgb\": [0.0021, 1e-07, 3],\n  \"list\": [\n    {\n      \"x\": true\n    },\n"
              "    \"y\"\n  ],\n  \"none\": {},\n  \"nothing\": []\n}\n");
    free(text);
    text = io_json_format_line(root);
    assert_string_equal(text,
                        "{\"rgb\": [0.0021, 1e-07, 3], \"list\": [{\"x\": true}, \"y\"], \"none\": {}, "
                        "\"nothing\": []}\n");
    free(text);
    json_decref(root);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_found_where_they_were_written),
        cmocka_unit_test(failures_say_where_what_and_what_was_expected),
        cmocka_unit_test(values_arrive_and_absent_keys_keep_defaults),
        cmocka_unit_test(truncated_text_is_a_syntax_error),
        cmocka_unit_test(a_file_over_the_limit_is_refused),
        cmocka_unit_test(deep_nesting_is_a_syntax_error),
        cmocka_unit_test(formatted_numbers_read_back_exactly),
        cmocka_unit_test(formatted_json_is_for_people),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
