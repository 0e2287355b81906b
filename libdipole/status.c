#include "internal.h"

#include <stdarg.h>
#include <stdio.h>

const char *dipole_version(void)
{
    return DIPOLE_VERSION;
}

bool(dipole_fail)(dipole_status *status, dipole_code code, const dipole_place *place, const char *format,
                  ...)
{
    if (status == NULL)
        return false;
    *status = (dipole_status){ .code = code };
    if (place != NULL) {
        status->line = place->line;
        status->column = place->column;
        snprintf(status->source, sizeof status->source, "%s", place->source != NULL ? place->source : "");
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(status->message, sizeof status->message, format, arguments);
    va_end(arguments);
    return false;
}
