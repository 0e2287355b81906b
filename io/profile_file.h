/* Measured or simulated profiles as CSV files; docs/formats.md describes them. */
#ifndef IO_PROFILE_FILE_H
#define IO_PROFILE_FILE_H

#include "libdipole/dipole.h"

/* Most rows, and the longest line, that are read. */
#define IO_PROFILE_ROW_LIMIT ((size_t)1000000)
#define IO_PROFILE_LINE_LIMIT ((size_t)4096)

/* A profile at distances, r_lo_mm = r_hi_mm, or its means over rings. Radii are 0 to 1e50, in any order. */
struct io_profile {
    size_t count; /* at least 1 */
    bool has_rings;
    bool is_per_incident; /* light that arrives, not that enters: the column is R_per_mm2 as in MCML's
                             tables */
    double *r_lo_mm, *r_hi_mm;
    double *rd_per_mm2;  /* of the size of at most 1e100; noise may have made some negative */
    double *sem_per_mm2; /* standard error, >= 0; NULL when the file has none               */
};

/*
 * Read a file with a header line and the columns r_mm, or r_lo_mm and r_hi_mm, and rd_per_mm2, and perhaps
 * sem. Fails with line and column, both from 1; *profile_out is then NULL. End it with io_profile_destroy.
 */
DIPOLE_CHECKED bool io_profile_read(const char *path, struct io_profile **profile_out,
                                    dipole_status *status);

/* The same from memory, NUL-terminated beyond size; source is what messages call it. */
DIPOLE_CHECKED bool io_profile_parse(const char *text, size_t size, const char *source,
                                     struct io_profile **profile_out, dipole_status *status);

void io_profile_destroy(struct io_profile *profile);

/* Where to draw row i: the radius, or the one that halves the ring's area. */
double io_profile_r_mm(const struct io_profile *profile, size_t i);

#endif
