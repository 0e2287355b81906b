#include "check.h"

#include "io/totals_file.h"

#include <stdio.h>
#include <string.h>

static void write_file(const char *text)
{
    FILE *const file = fopen("totals.csv", "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

/* Oracle: the numbers in the text, in the order of rows and kinds; an empty cell is no value, and no error.
 */
static void values_are_as_they_stand(void **state)
{
    (void)state;
    static const struct io_total expected[] = {
        { IO_TOTAL_REFLECTANCE, 0, 1.5, 0.25, 0.01 },
        { IO_TOTAL_TRANSMITTANCE, 0, 1.5, 0.5, 0 },
        { IO_TOTAL_TRANSMITTANCE, 2, 3, 0.125, 0 },
        { IO_TOTAL_REFLECTANCE, 1, INFINITY, 0.75, 0.02 },
    };
    struct io_totals *totals;
    write_file("# a spectrophotometer's\nchannel,thickness_mm,total_transmittance,total_reflectance,"
               "total_reflectance_sem\nR,1.5,.5,0.25,1e-2\n\nB,3,0.125,,\nG,inf,,0.75,0.02\n");
    assert_true(io_totals_read("totals.csv", &totals, NULL));
    assert_int_equal(totals->count, sizeof expected / sizeof *expected);
    for (size_t i = 0; i < totals->count; i++) {
        assert_int_equal(totals->totals[i].kind, expected[i].kind);
        assert_int_equal(totals->totals[i].channel, expected[i].channel);
        assert_true(totals->totals[i].thickness_mm == expected[i].thickness_mm);
        assert_true(totals->totals[i].value == expected[i].value);
        assert_true(totals->totals[i].sem == expected[i].sem);
    }
    io_totals_destroy(totals);
    write_file("thickness_mm,diffuse_reflectance,diffuse_transmittance\n2,0.3,0.4\n");
    assert_true(io_totals_read("totals.csv", &totals, NULL));
    assert_int_equal(totals->count, 2);
    assert_int_equal(totals->totals[0].channel, -1);
    assert_int_equal(totals->totals[1].kind, IO_TOTAL_DIFFUSE_TRANSMITTANCE);
    io_totals_destroy(totals);
}

/* Oracle: the place and the message that a user should read. */
static void what_is_wrong_is_told_where(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int line, column;
        const char *message; /* how it begins */
    } cases[] = {
        { "", 0, 0, "has no header line, expected thickness_mm" },
        { "thickness_mm,channel\n", 1, 1, "the header has no reflectance and no transmittance" },
        { "total_reflectance\n", 1, 1, "the header has no thickness_mm" },
        { "thickness_mm,albedo\n", 1, 14, "unknown column \"albedo\", expected thickness_mm" },
        { "thickness_mm,total_reflectance,thickness_mm\n", 1, 32,
          "column \"thickness_mm\" is the second of its kind, expected one" },
        { "thickness_mm,total_reflectance\n1,0.5,3\n", 2, 1,
          "the line has 3 columns, expected the 2 of the header" },
        { "thickness_mm,total_reflectance\n1,1.5\n", 2, 3, "total_reflectance is 1.5, expected 0 to 1" },
        { "thickness_mm,total_reflectance\n0,0.5\n", 2, 1, "thickness_mm is 0, expected 1e-50 to 1e+50" },
        { "thickness_mm,total_reflectance\nthin,0.5\n", 2, 1,
          "thickness_mm is \"thin\", expected a number" },
        { "thickness_mm,total_reflectance,channel\n1,0.5,r\n", 2, 7,
          "channel is \"r\", expected R, G or B" },
        { "thickness_mm,total_reflectance\n1,\n", 0, 0, "has a header and no values" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct io_totals *totals;
        dipole_status status;
        write_file(cases[i].text);
        assert_false(io_totals_read("totals.csv", &totals, &status));
        assert_null(totals);
        assert_string_equal(status.source, "totals.csv");
        if (status.line != cases[i].line || status.column != cases[i].column ||
            strncmp(status.message, cases[i].message, strlen(cases[i].message)) != 0)
            fail_msg("case %zu: %d:%d: %s", i, status.line, status.column, status.message);
    }
    struct io_totals *totals;
    dipole_status status;
    assert_false(io_totals_read("absent.csv", &totals, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_as_they_stand),
        cmocka_unit_test(what_is_wrong_is_told_where),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
