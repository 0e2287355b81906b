/* Finds a scene's table in a folder of tables. */
#ifndef RENDERER_TABLES_H
#define RENDERER_TABLES_H

#include "lutgen/lut.h"

/*
 * Read the table of that medium among the *.splat1d.exr of a folder; of several, the most exact. Fails with
 * DIPOLE_NOT_FOUND (no such folder or table; names one of the material's name that is of another medium),
 * or as lut_splat_read does.
 */
DIPOLE_CHECKED bool render_table_find(const char *folder, const struct io_material *material,
                                      struct lut_splat **table_out, dipole_status *status);

#endif
