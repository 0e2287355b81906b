/*
 * Every allocation of io and lutgen that goes into a table's file in turn fails: the linker sends them here
 * (--wrap). Those of the libraries are their own affair. The sanitizers' build sees what is not freed.
 */
#include "tests/check.h"
#include "tests/failing_allocation.h"

#include "io/dds.h"
#include "io/raw.h"
#include "lutgen/self_test.h"

#include <stdlib.h>
#include <string.h>

enum { ATTRIBUTE_COUNT = 40 }; /* more than one growth */

static bool set_attributes(struct io_image *image)
{
    bool is_done = true;
    for (int i = 0; i < ATTRIBUTE_COUNT; i++) {
        char name[32];
        snprintf(name, sizeof name, "dipole:%d", i % 30); /* some are replaced */
        const size_t count = image->attribute_count;
        const bool is_new = !io_image_find(image, name);
        const bool is_set =
            i % 2 ? io_image_set_text(image, name, "text") : io_image_set_number(image, name, i);
        assert_int_equal(image->attribute_count, count + (is_set && is_new));
        is_done = is_done && is_set;
    }
    return is_done && lut_self_test_set_probes(image, 2);
}

/* All that is done with a table; false when something failed. What is there must be whole. */
static bool write_and_read(dipole_status *status)
{
    struct io_image *image = NULL, *found = NULL;
    if (!io_image_create(16, 8, 3, &image, status))
        return false;
    lut_self_test_fill(image, 2, true);
    bool is_done = set_attributes(image);
    if (!is_done)
        status->code = DIPOLE_OUT_OF_MEMORY; /* setters have no status */
    is_done = is_done && io_exr_write("a.exr", image, true, status) &&
              io_exr_read("a.exr", &found, status) && io_dds_write("a.dds", image, 2, true, status) &&
              io_dds_sidecar_write("a.dds", image, 2, true, status) &&
              io_raw_write("a.raw", image, 2, false, status);
    if (found) {
        assert_memory_equal(found->pixels, image->pixels, (size_t)16 * 8 * 3 * sizeof(float));
        assert_int_equal(found->attribute_count, image->attribute_count);
    }
    io_image_destroy(found);
    io_image_destroy(image);
    return is_done;
}

/* Oracle: the documented code, whichever allocation it was; without a failure all is done. */
static void every_failed_allocation_is_told(void **state)
{
    (void)state;
    dipole_status status = { 0 };
    refused_call = 0;
    call_count = 0;
    assert_true(write_and_read(&status));
    const int total = call_count;
    assert_true(total > 50);
    for (int i = 1; i <= total; i++) {
        refused_call = i;
        call_count = 0;
        status = (dipole_status){ 0 };
        if (write_and_read(&status))
            fail_msg("allocation %d of %d failed and nobody saw it", i, total);
        if (status.code != DIPOLE_OUT_OF_MEMORY)
            fail_msg("allocation %d of %d: %d, %s", i, total, (int)status.code, status.message);
    }
    refused_call = 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(every_failed_allocation_is_told) };
    return cmocka_run_group_tests_name("table_allocation", tests, NULL, NULL);
}
