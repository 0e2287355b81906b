#include "tests/check.h"

#include "io/profile_file.h"
#include "tests/reference_file.h"

#include <stdlib.h>
#include <string.h>

static bool parse(const char *text, struct io_profile **profile, dipole_status *status)
{
    return io_profile_parse(text, strlen(text), "p.csv", profile, status);
}

/* Oracle: the text itself; comments, blanks, empty lines and the ends of lines of other systems count for
 * nothing, nor does the order of the columns. */
static void points_are_read_as_they_stand(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "r_mm,rd_per_mm2,sem\n0.5,2e-3,1e-4\n2,-1e-9,0\n",
        "\xef\xbb\xbf# by me\r\n\r\nr_mm , rd_per_mm2,\tsem\r\n# 1,2,3\r\n 0.5 ,2e-3 , 1e-4\r\n+2,-1e-9,0",
        "sem,R_per_mm2,r_mm\n1e-4,2e-3,.5\n\n  # end\n0,-1e-9,2.",
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct io_profile *profile;
        dipole_status status;
        if (!parse(texts[i], &profile, &status))
            fail_msg("%d:%d: %s", status.line, status.column, status.message);
        assert_int_equal(profile->count, 2);
        assert_false(profile->has_rings);
        assert_true(profile->r_lo_mm[0] == 0.5 && profile->r_hi_mm[0] == 0.5);
        assert_true(profile->r_lo_mm[1] == 2 && profile->rd_per_mm2[0] == 2e-3);
        assert_true(profile->rd_per_mm2[1] == -1e-9);
        assert_true(profile->sem_per_mm2[0] == 1e-4 && profile->sem_per_mm2[1] == 0);
        assert_true(io_profile_r_mm(profile, 1) == 2);
        io_profile_destroy(profile);
    }
}

/* Oracle: the area; the radius of a ring halves it. */
static void rings_are_read_with_their_middle(void **state)
{
    (void)state;
    struct io_profile *profile;
    assert_true(parse("r_lo_mm,r_hi_mm,rd_per_mm2\n0,2,1\n3,5,1\n1e49,2e49,1", &profile, NULL));
    assert_int_equal(profile->count, 3);
    assert_true(profile->has_rings);
    assert_null(profile->sem_per_mm2);
    for (size_t i = 0; i < 3; i++) {
        const double lo = profile->r_lo_mm[i], hi = profile->r_hi_mm[i], r = io_profile_r_mm(profile, i);
        assert_close((hi - r) * (hi + r), (r - lo) * (r + lo), 1e-14, "ring %zu", i);
    }
    io_profile_destroy(profile);
}

/* Oracle: another reader of the same files, and that the rings of a table add up to its total. */
static void monte_carlo_tables_are_read(void **state)
{
    (void)state;
    static const char *const names[] = { "semi_hialb_n15", "slab_hialb_n15_02mfp", "layer3_skinB" };
    for (size_t n = 0; n < sizeof names / sizeof names[0]; n++) {
        char name[128], path[1024];
        snprintf(name, sizeof name, "mcml/%s.csv", names[n]);
        snprintf(path, sizeof path, SOURCE_FOLDER "/tests/reference/%s", name);
        struct io_profile *profile;
        dipole_status status;
        if (!io_profile_read(path, &profile, &status))
            fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
        assert_true(profile->has_rings && profile->sem_per_mm2);
        struct reference_file file;
        reference_open(&file, name);
        double power = 0;
        size_t i = 0;
        for (; reference_next(&file); i++) {
            assert_true(i < profile->count);
            assert_true(profile->r_lo_mm[i] == reference_number(&file, "r_lo_mm"));
            assert_true(profile->r_hi_mm[i] == reference_number(&file, "r_hi_mm"));
            assert_true(profile->rd_per_mm2[i] == reference_number(&file, "R_per_mm2"));
            assert_true(profile->sem_per_mm2[i] == reference_number(&file, "R_sem_per_mm2"));
            const double lo = profile->r_lo_mm[i], hi = profile->r_hi_mm[i];
            power += acos(-1) * (hi - lo) * (hi + lo) * profile->rd_per_mm2[i];
        }
        assert_int_equal(i, profile->count);
        io_profile_destroy(profile);
        reference_open(&file, "mcml_totals.csv");
        while (reference_next(&file))
            if (strcmp(reference_text(&file, "case"), names[n]) == 0)
                assert_close(power, reference_number(&file, "R") - reference_number(&file, "R_beyond"),
                             1e-5, "%s", names[n]);
    }
}

#define HEADER "r_lo_mm,r_hi_mm,rd_per_mm2,sem\n"
#define FORMS "expected r_mm,rd_per_mm2[,sem] or r_lo_mm,r_hi_mm,rd_per_mm2[,sem]"

/* Oracle: the messages as a user should read them. */
static void failures_name_line_and_column(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        dipole_code code;
        int line, column;
        const char *message;
    } cases[] = {
        { "", DIPOLE_BAD_SYNTAX, 0, 0, "has no header line, " FORMS },
        { "# only\n\n", DIPOLE_BAD_SYNTAX, 0, 0, "has no header line, " FORMS },
        { "1,2\n3,4\n", DIPOLE_BAD_SYNTAX, 1, 1, "unknown column \"1\", " FORMS },
        { "r_mm;rd_per_mm2\n", DIPOLE_BAD_SYNTAX, 1, 1, "unknown column \"r_mm;rd_per_mm2\", " FORMS },
        { "#\nr_mm, rd_per_mm2,sd\n1,2,3\n", DIPOLE_BAD_SYNTAX, 2, 18, "unknown column \"sd\", " FORMS },
        { "r_mm,rd_per_mm2,\n1,2,\n", DIPOLE_BAD_SYNTAX, 1, 17, "unknown column \"\", " FORMS },
        { "r_mm,rd_per_mm2,R_per_mm2\n1,2,3\n", DIPOLE_BAD_SYNTAX, 1, 17,
          "column \"R_per_mm2\" is the second of its kind, expected one" },
        { "rd_per_mm2\n1\n", DIPOLE_BAD_SYNTAX, 1, 1, "the header has no distance, " FORMS },
        { "r_lo_mm,rd_per_mm2\n1,2\n", DIPOLE_BAD_SYNTAX, 1, 1,
          "the header has r_lo_mm without r_hi_mm, " FORMS },
        { "r_hi_mm,rd_per_mm2\n1,2\n", DIPOLE_BAD_SYNTAX, 1, 1,
          "the header has r_hi_mm without r_lo_mm, " FORMS },
        { "r_mm,r_hi_mm,rd_per_mm2\n1,2,3\n", DIPOLE_BAD_SYNTAX, 1, 1,
          "the header has both a distance and edges of rings, " FORMS },
        { "r_mm,sem\n1,2\n", DIPOLE_BAD_SYNTAX, 1, 1, "the header has no rd_per_mm2, " FORMS },
        { HEADER, DIPOLE_BAD_VALUE, 0, 0, "has a header and no rows, expected at least one" },
        { HEADER "0,1,2\n", DIPOLE_BAD_SYNTAX, 2, 1,
          "the line has 3 columns, expected the 4 of the header" },
        { HEADER "0,1,2,3\n7\n", DIPOLE_BAD_SYNTAX, 3, 1,
          "the line has 1 column, expected the 4 of the header" },
        { HEADER "0,1,2,3,\n", DIPOLE_BAD_SYNTAX, 2, 1,
          "the line has 5 columns, expected the 4 of the header" },
        { HEADER "0,1,,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is empty, expected a number" },
        { HEADER "0,1, ä ,3\n", DIPOLE_BAD_SYNTAX, 2, 6, "rd_per_mm2 is \"ä\", expected a number" },
        { HEADER "0,1,2,-3\n", DIPOLE_BAD_VALUE, 2, 7, "sem is -3, expected 0 to 1e+100" },
        { HEADER "0,1,ä,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is \"ä\", expected a number" },
        { HEADER "0,1,nan,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is \"nan\", expected a number" },
        { HEADER "0,1,0x10,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is \"0x10\", expected a number" },
        { HEADER "0,1,1e,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is \"1e\", expected a number" },
        { HEADER "0,1,1.2.3,3\n", DIPOLE_BAD_SYNTAX, 2, 5, "rd_per_mm2 is \"1.2.3\", expected a number" },
        { HEADER "0,1,1e400,3\n", DIPOLE_BAD_VALUE, 2, 5,
          "rd_per_mm2 is 1e400, expected -1e+100 to 1e+100" },
        { HEADER "-1,1,1,3\n", DIPOLE_BAD_VALUE, 2, 1, "r_lo_mm is -1, expected 0 to 1e+50" },
        { HEADER "0,1e51,1,3\n", DIPOLE_BAD_VALUE, 2, 3, "r_hi_mm is 1e51, expected 0 to 1e+50" },
        { HEADER "0,1,1,3\n1,1,1,3\n", DIPOLE_BAD_VALUE, 3, 3,
          "r_hi_mm is 1, expected more than r_lo_mm, 1" },
        { "r_mm,rd_per_mm2\n1,\x1b[31m\n", DIPOLE_BAD_SYNTAX, 2, 3,
          "rd_per_mm2 is \"?[31m\", expected a number" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct io_profile *profile = NULL;
        dipole_status status = { 0 };
        if (parse(cases[i].text, &profile, &status))
            fail_msg("read: %s", cases[i].text);
        assert_null(profile);
        assert_string_equal(status.message, cases[i].message);
        assert_string_equal(status.source, "p.csv");
        if (status.code != cases[i].code || status.line != cases[i].line ||
            status.column != cases[i].column)
            fail_msg("%s: code %d at %d:%d, expected %d at %d:%d", cases[i].message, status.code,
                     status.line, status.column, cases[i].code, cases[i].line, cases[i].column);
    }
    struct io_profile *profile;
    dipole_status status;
    assert_false(io_profile_read("missing.csv", &profile, &status));
    assert_int_equal(status.code, DIPOLE_NOT_FOUND);
    /* a zero byte is no number, and does not end the file unseen */
    static const char zero[] = "r_mm,rd_per_mm2\n1,2\0\n3,4\n";
    assert_false(io_profile_parse(zero, sizeof zero - 1, "p.csv", &profile, &status));
    assert_int_equal(status.line, 2);
}

/* Oracle: the limits themselves. */
static void sizes_are_bounded(void **state)
{
    (void)state;
    static const char row[] = "1,2\n";
    const size_t size = 32 + 4 * (IO_PROFILE_ROW_LIMIT + 1);
    char *const text = malloc(size);
    assert_non_null(text);
    struct io_profile *profile;
    dipole_status status;
    const size_t header = (size_t)sprintf(text, "r_mm,rd_per_mm2\n");
    for (size_t i = 0; i < 4 * (IO_PROFILE_ROW_LIMIT + 1); i++)
        text[header + i] = row[i % 4];
    assert_true(io_profile_parse(text, header + 4 * IO_PROFILE_ROW_LIMIT, "p.csv", &profile, &status));
    assert_int_equal(profile->count, IO_PROFILE_ROW_LIMIT);
    io_profile_destroy(profile);
    assert_false(
        io_profile_parse(text, header + 4 * (IO_PROFILE_ROW_LIMIT + 1), "p.csv", &profile, &status));
    assert_string_equal(status.message, "the table has more than 1000000 rows");
    assert_int_equal(status.line, IO_PROFILE_ROW_LIMIT + 2);

    memset(text, ',', size);
    assert_false(io_profile_parse(text, 100, "p.csv", &profile, &status));
    assert_string_equal(status.message, "the line has more than 64 columns");
    assert_false(io_profile_parse(text, 5000, "p.csv", &profile, &status));
    assert_string_equal(status.message, "the line has 5000 bytes, expected at most 4096");
    free(text);
}

/* Oracle: damage ends in a table or a message with a place, never in a crash (sanitizers). */
static void damaged_files_end_in_a_message(void **state)
{
    (void)state;
    static const char text[] = "# by me\n" HEADER "0,1,2e-3,1e-4\n1,2,-1e-9,0\r\n2,5.5,+.5,1e-9\n";
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 20000; i++) {
        const size_t size = i % 2 ? sizeof text - 1 : random_bits(&rng) % sizeof text;
        char *const copy = malloc(size + 1); /* of its size, so that reading beyond is seen */
        assert_non_null(copy);
        memcpy(copy, text, size);
        copy[size] = '\0';
        for (uint64_t n = random_bits(&rng) % 4; n > 0 && size > 0; n--)
            copy[random_bits(&rng) % size] = (char)random_bits(&rng);
        struct io_profile *profile;
        dipole_status status = { 0 };
        if (!io_profile_parse(copy, size, "p.csv", &profile, &status))
            assert_true(status.message[0] && !profile);
        io_profile_destroy(profile);
        free(copy);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_are_read_as_they_stand),
        cmocka_unit_test(rings_are_read_with_their_middle),
        cmocka_unit_test(monte_carlo_tables_are_read),
        cmocka_unit_test(failures_name_line_and_column),
        cmocka_unit_test(sizes_are_bounded),
        cmocka_unit_test(damaged_files_end_in_a_message),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
