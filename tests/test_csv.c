#include "tests/check.h"

#include "io/csv.h"

#include <stdlib.h>
#include <string.h>

static struct io_csv *begin(const char *text, size_t size, size_t line_limit)
{
    struct io_csv *const csv = malloc(sizeof *csv);
    assert_non_null(csv);
    io_csv_init(csv, text, size, "t.csv", line_limit);
    return csv;
}

/* Oracle: RFC 4180's rules and examples; blanks, comments, a byte order mark and the ends of lines of other
 * systems count for nothing. */
static void fields_are_what_the_text_says(void **state)
{
    (void)state;
    static const char text[] = "\xef\xbb\xbf# \"comment\n"
                               "aaa,\"b \"\"bb\"\"\",ccc\r\n"
                               "\n"
                               " \"a,b\" ,\"\",,\t x y \t\n"
                               "\"# no comment\",\" kept \",\"\"\"\",\"a\"\"\",\"\"\"b\"";
    static const struct {
        int line;
        size_t count;
        const char *fields[5];
    } lines[] = {
        { 2, 3, { "aaa", "b \"bb\"", "ccc" } },
        { 4, 4, { "a,b", "", "", "x y" } },
        { 5, 5, { "# no comment", " kept ", "\"", "a\"", "\"b" } },
    };
    struct io_csv *const csv = begin(text, sizeof text - 1, 100);
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        dipole_status status;
        if (io_csv_next(csv, &status) != IO_CSV_LINE)
            fail_msg("%d:%d: %s", status.line, status.column, status.message);
        assert_int_equal(csv->line_number, lines[i].line);
        assert_int_equal(csv->field_count, lines[i].count);
        for (size_t k = 0; k < lines[i].count; k++)
            assert_true(io_csv_equals(&csv->fields[k], lines[i].fields[k]));
    }
    assert_int_equal(io_csv_next(csv, NULL), IO_CSV_END);
    assert_int_equal(io_csv_next(csv, NULL), IO_CSV_END);
    free(csv);
}

/* Oracle: the messages as a user should read them; columns count characters, not bytes. */
static void failures_name_line_and_column(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int line, column;
        const char *message;
    } cases[] = {
        { "\xc3\xa4,\"b\nc\"\n", 1, 3, "the quote has no end on its line, expected another one" },
        { "\n\xc3\xa4, \"b\" c\n", 2, 8, "text behind the end of a quote, expected a comma" },
        { "a,b \"c\" d\n", 1, 5, "a quote inside a field, expected quotes around it and two inside" },
        { "a,\"", 1, 3, "the quote has no end on its line, expected another one" },
        { "#\n#\n0123456789012345678901234567890123456789\n", 3, 1,
          "the line has 40 bytes, expected at most 32" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct io_csv *const csv = begin(cases[i].text, strlen(cases[i].text), 32);
        dipole_status status;
        assert_int_equal(io_csv_next(csv, &status), IO_CSV_FAILED);
        assert_string_equal(status.message, cases[i].message);
        assert_string_equal(status.source, "t.csv");
        assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
        assert_int_equal(status.line, cases[i].line);
        assert_int_equal(status.column, cases[i].column);
        free(csv);
    }
    char commas[100];
    memset(commas, ',', sizeof commas);
    dipole_status status;
    struct io_csv *csv = begin(commas, sizeof commas, IO_CSV_LINE_LIMIT);
    assert_int_equal(io_csv_next(csv, &status), IO_CSV_FAILED);
    assert_string_equal(status.message, "the line has more than 64 columns");
    assert_int_equal(status.column, IO_CSV_FIELD_LIMIT + 1);
    free(csv);
    csv = begin(commas, IO_CSV_FIELD_LIMIT - 1, IO_CSV_LINE_LIMIT);
    assert_int_equal(io_csv_next(csv, NULL), IO_CSV_LINE);
    assert_int_equal(csv->field_count, IO_CSV_FIELD_LIMIT);
    free(csv);
}

/* Write a field as RFC 4180 has it, quoted always or where it must be; returns where it ends. */
static char *write_field(char *out, const char *text, bool is_quoted)
{
    if (!is_quoted && !strpbrk(text, "\",# \t"))
        return stpcpy(out, text);
    *out++ = '"';
    for (; *text; text++) {
        if (*text == '"')
            *out++ = '"';
        *out++ = *text;
    }
    *out++ = '"';
    return out;
}

/* Oracle: what was written. */
static void what_is_written_comes_back(void **state)
{
    (void)state;
    static const char alphabet[] = "a,\"# \t;\xc3\xa4";
    struct rng rng = { .seed = 4 };
    for (int i = 0; i < 5000; i++) {
        char fields[8][12] = { "x" }, text[512], *end = text; /* no line without a field is empty */
        const size_t count = 1 + random_bits(&rng) % 8;
        for (size_t k = 0; k < count; k++) {
            const size_t length = (k == 0) + random_bits(&rng) % 10;
            for (size_t c = k == 0; c < length; c++)
                fields[k][c] = alphabet[random_bits(&rng) % (sizeof alphabet - 1)];
            fields[k][length] = '\0';
            end = write_field(end, fields[k], random_bits(&rng) % 2);
            *end++ = k + 1 < count ? ',' : '\n';
        }
        struct io_csv *const csv = begin(text, (size_t)(end - text), sizeof text);
        assert_int_equal(io_csv_next(csv, NULL), IO_CSV_LINE);
        assert_int_equal(csv->field_count, count);
        for (size_t k = 0; k < count; k++)
            assert_true(io_csv_equals(&csv->fields[k], fields[k]));
        free(csv);
    }
}

/* Oracle: the definition. */
static void fields_are_cut_and_cleaned_for_messages(void **state)
{
    (void)state;
    char out[64], text[128];
    const int length = snprintf(text, sizeof text, "\x1b[31m\x7f%053d\xc3\xa4%050d", 0, 0);
    const struct io_csv_field field = { .text = text, .length = (size_t)length };
    io_csv_printable(&field, out);
    assert_int_equal(strlen(out), 59);
    assert_memory_equal(out, "?[31m?0", 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fields_are_what_the_text_says),
        cmocka_unit_test(failures_name_line_and_column),
        cmocka_unit_test(what_is_written_comes_back),
        cmocka_unit_test(fields_are_cut_and_cleaned_for_messages),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
