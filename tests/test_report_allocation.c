/*
 * Every allocation of fit, plot and io that goes into a report in turn fails: the linker sends them here
 * (--wrap). Those of the libraries are their own affair. The sanitizers' build sees what is not freed.
 */
#include "tests/check.h"
#include "tests/failing_allocation.h"

#include "fit/report.h"

#include <stdlib.h>
#include <unistd.h>

/* A report with something of everything. */
static bool write_report(dipole_status *status)
{
    static float target[3 * 6], model[3 * 6];
    static const struct io_image
        image = { .width_px = 3, .height_px = 2, .channel_count = 3, .pixels = target },
        drawn = { .width_px = 3, .height_px = 2, .channel_count = 3, .pixels = model };
    static const unsigned char uses[6] = { FIT_USE_OK, FIT_USE_CLIPPED };
    static const double numbers[4] = { 1, 0.5, 0.5, 1 };
    static const char *const names[2] = { "R sigma_a", "R sigma_s'" };
    const struct fit_report_value value = { "R", "sigma_a", "1/mm", 1, { 0.9, 1.1 }, "" };
    const struct fit_report_picture picture = { "knot.exr", &image, &drawn, uses };
    const struct fit_report_profile profile = { "R",     4, numbers, numbers, numbers,
                                                numbers, 4, numbers, numbers, NULL };
    const struct fit_report_search search = { "start 1", 4, numbers, false };
    const struct fit_report report = { .title = "knot.exr",
                                       .verdict = "Found.",
                                       .model = "beam",
                                       .value_count = 1,
                                       .values = &value,
                                       .picture_count = 1,
                                       .pictures = &picture,
                                       .profile_count = 1,
                                       .profiles = &profile,
                                       .search_count = 1,
                                       .searches = &search,
                                       .note_count = 2,
                                       .notes = names,
                                       .correlation_count = 2,
                                       .correlation_names = names,
                                       .correlations = numbers };
    for (int i = 0; i < 3 * 6; i++) {
        target[i] = 1;
        model[i] = 1.1f;
    }
    return fit_report_write("report", &report, status);
}

/* Oracle: the documented code, whichever allocation it was, and no page; without a failure all is done. */
static void every_failed_allocation_is_told(void **state)
{
    (void)state;
    dipole_status status = { 0 };
    refused_call = 0;
    call_count = 0;
    assert_true(write_report(&status));
    const int total = call_count;
    assert_true(total > 30);
    for (int i = 1; i <= total; i++) {
        assert_int_equal(remove("report/index.html"), i == 1 ? 0 : -1);
        refused_call = i;
        call_count = 0;
        status = (dipole_status){ 0 };
        if (write_report(&status))
            fail_msg("allocation %d of %d failed and nobody saw it", i, total);
        if (status.code != DIPOLE_OUT_OF_MEMORY)
            fail_msg("allocation %d of %d: %d, %s", i, total, (int)status.code, status.message);
    }
    assert_int_equal(access("report/index.html", F_OK), -1);
    refused_call = 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(every_failed_allocation_is_told) };
    return cmocka_run_group_tests_name("report_allocation", tests, NULL, NULL);
}
