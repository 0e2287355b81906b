/* report.html: the whole trade-off on one page that needs no network. */
#ifndef ACCURACY_PAGE_H
#define ACCURACY_PAGE_H

#include "accuracy/sweep.h"

/* Also writes its main plot as folder/accuracy.svg. Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_IO_FAILED. */
DIPOLE_CHECKED bool accuracy_page_write(const struct accuracy_sweep *sweep, const char *folder,
                                        dipole_status *status);

#endif
