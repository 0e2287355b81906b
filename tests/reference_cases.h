/* The independent truth of tests/reference as a test reads it: a file that is damaged fails the test. */
#ifndef TESTS_REFERENCE_CASES_H
#define TESTS_REFERENCE_CASES_H

#include "check.h"

#include "accuracy/reference.h"

static inline struct accuracy_reference *read_reference(void)
{
    struct accuracy_reference *reference;
    dipole_status status;
    if (!accuracy_reference_read(SOURCE_FOLDER "/tests/reference", &reference, &status))
        fail_msg("%s:%d:%d: %s", status.source, status.line, status.column, status.message);
    return reference;
}

#endif
