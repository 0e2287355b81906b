#include "check.h"

#include "libdipole/dipole.h"

#include <string.h>

/* Oracle: dipole.h. What was in *status before is gone. */
static void failures_are_written_down(void **state)
{
    (void)state;
    dipole_status status = { DIPOLE_IO_FAILED, 1, 2, "old.json", "old" };
    assert_false(dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "eta is %g, expected %s", 0.0, "> 0"));
    assert_int_equal(status.code, DIPOLE_BAD_VALUE);
    assert_string_equal(status.message, "eta is 0, expected > 0");
    assert_true(status.line == 0 && status.column == 0 && status.source[0] == '\0');
    const dipole_place comma = { "skin.json", 12, 18 }, nameless = { NULL, 3, 4 };
    assert_false(dipole_fail(&status, DIPOLE_BAD_SYNTAX, &comma, "a comma"));
    assert_int_equal(status.code, DIPOLE_BAD_SYNTAX);
    assert_string_equal(status.source, "skin.json");
    assert_true(status.line == 12 && status.column == 18);
    assert_false(dipole_fail(&status, DIPOLE_NOT_FOUND, &nameless, "none"));
    assert_true(status.source[0] == '\0' && status.line == 3 && status.column == 4);
    assert_false(dipole_fail(NULL, DIPOLE_NOT_FOUND, NULL, "nobody asks"));
}

/* Oracle: the sizes of the fields. Longer texts are cut off, and still end. */
static void long_texts_are_cut_off(void **state)
{
    (void)state;
    char text[1000];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    const dipole_place place = { text, 1, 1 };
    dipole_status status;
    assert_false(dipole_fail(&status, DIPOLE_BAD_VALUE, &place, "%s", text));
    assert_int_equal(strlen(status.source), sizeof status.source - 1);
    assert_int_equal(strlen(status.message), sizeof status.message - 1);
    assert_true(status.line == 1 && status.code == DIPOLE_BAD_VALUE);
}

/* Oracle: the header's own parts of the version. */
static void version_is_that_of_the_header(void **state)
{
    (void)state;
    char version[32];
    snprintf(version, sizeof version, "%d.%d.%d", DIPOLE_VERSION_MAJOR, DIPOLE_VERSION_MINOR,
             DIPOLE_VERSION_PATCH);
    assert_string_equal(dipole_version(), version);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(failures_are_written_down),
        cmocka_unit_test(long_texts_are_cut_off),
        cmocka_unit_test(version_is_that_of_the_header),
    };
    return cmocka_run_group_tests_name("status", tests, NULL, NULL);
}
