/*
 * Only in builds with the address sanitizer: memory that system libraries never give back is not ours.
 * Compiled into every program that links one of them, since the sanitizer looks for these names there.
 */
#include "libdipole/dipole.h"

/* NOLINTBEGIN(bugprone-reserved-identifier): the names are the sanitizer's. */
DIPOLE_API const char *__lsan_default_suppressions(void);
DIPOLE_API const char *__lsan_default_options(void);
DIPOLE_API int dlclose(void *library);

const char *__lsan_default_suppressions(void)
{
    return "leak:libOSMesa\nleak:libLLVM\nleak:libEGL\nleak:libGLX\nleak:libGL.\nleak:libGLdispatch\n"
           "leak:_dri.so\nleak:libglapi\nleak:libX11\nleak:libxcb\nleak:libfontconfig\n";
}

const char *__lsan_default_options(void)
{
    return "print_suppressions=0";
}

/* NOLINTEND(bugprone-reserved-identifier) */

/* Drivers stay loaded until the check for leaks: else it cannot tell whose a leak is. */
int dlclose(void *library)
{
    (void)library;
    return 0;
}
