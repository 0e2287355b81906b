/* Measured totals of slabs as CSV files; docs/formats.md describes them. */
#ifndef IO_TOTALS_FILE_H
#define IO_TOTALS_FILE_H

#include "libdipole/dipole.h"

/* What of the light a number counts. */
enum io_total_kind {
    IO_TOTAL_DIFFUSE_REFLECTANCE = 0, /* scattered, per light that entered */
    IO_TOTAL_DIFFUSE_TRANSMITTANCE,
    IO_TOTAL_REFLECTANCE, /* all of it, mirrored and straight through too, per light that arrives      */
    IO_TOTAL_TRANSMITTANCE,
    IO_TOTAL_KIND_COUNT
};

struct io_total {
    enum io_total_kind kind;
    int channel;         /* 0 to 2, or -1: not said                     */
    double thickness_mm; /* INFINITY: a half-space                      */
    double value;        /* 0 to 1                                      */
    double sem;          /* standard error, > 0; 0: not stated          */
};

struct io_totals {
    size_t count; /* at least 1 */
    struct io_total *totals;
};

#define IO_TOTALS_ROW_LIMIT ((size_t)10000)

/*
 * Read a file with a header line and the columns thickness_mm (a number, or inf), perhaps channel (R, G,
 * B), and one or more of diffuse_reflectance, diffuse_transmittance, total_reflectance and
 * total_transmittance, each perhaps with a column of the same name and _sem behind. An empty cell is a
 * value that was not measured. Fails with line and column; *totals_out is then NULL. End it with
 * io_totals_destroy.
 */
DIPOLE_CHECKED bool io_totals_read(const char *path, struct io_totals **totals_out, dipole_status *status);
void io_totals_destroy(struct io_totals *totals);

#endif
