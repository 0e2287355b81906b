/* Splat tables of a scene's media: from a folder, or baked in memory. */
#ifndef RENDERER_TABLES_H
#define RENDERER_TABLES_H

#include "renderer/media.h"

/* End it with render_tables_destroy. */
struct render_tables {
    double epsilon;                 /* the coarsest table's            */
    struct render_table *of_medium; /* as many as there are media      */
    struct lut_splat **luts;        /* whose rows those are            */
    size_t lut_count;
};

/* A table for each medium. Fails as lut_splat_bake does. */
DIPOLE_CHECKED bool render_tables_bake(const struct render_media *media, double epsilon,
                                       struct render_tables **tables_out, dipole_status *status);

/*
 * Read each medium's row among the *.splat1d.exr and *.splat2d.exr of a folder; of several, the most exact.
 * Fails with DIPOLE_NOT_FOUND (no such folder or table; names one of the material's name that is of another
 * medium), or as lut_splat_read does.
 */
DIPOLE_CHECKED bool render_tables_find(const char *folder, const struct render_media *media,
                                       struct render_tables **tables_out, dipole_status *status);

void render_tables_destroy(struct render_tables *tables);

#endif
