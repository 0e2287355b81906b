/* Irradiance from all around tabulated over the directions of the normal, once for each medium, so that one
 * costs the same at any order of harmonics. Pure C: no OpenGL here. theory.md T47. */
#ifndef RENDERER_IRRADIANCE_TABLE_H
#define RENDERER_IRRADIANCE_TABLE_H

#include "renderer/environment.h"

/* Rows of a table at the least and at the most. */
enum { RENDER_IRRADIANCE_ROWS_MIN = 4, RENDER_IRRADIANCE_ROWS_MAX = 1024 };

/*
 * Nodes stand pi / rows apart, from +y down and around y, 2 rows of them, from -z over -x. One row and one
 * column stand before the first, two rows and two columns behind the last part, so that no interval lacks a
 * neighbour. shaders/common/irradiance.glsl reads the same. Immutable.
 */
struct render_irradiance_table {
    int rows;          /* parts from pole to pole                                       */
    float (*nodes)[4]; /* W/mm^2, may be below 0, and 0; rows + 3 rows of 2 rows + 3    */
    size_t node_count; /* of them all                                                   */
    double error;      /* bound of what the table adds at any normal, by the mean irradiance */
    double eta;        /* what it was made of: with these, nothing else decides         */
    int order;
    double (*coefficients)[3];
};

static inline int render_irradiance_table_columns(int rows)
{
    return 2 * rows;
}
static inline size_t render_irradiance_table_nodes(int rows)
{
    return (size_t)(rows + 3) * (size_t)(render_irradiance_table_columns(rows) + 3);
}

/*
 * As few rows as keep the bound at or below tolerance, by the mean irradiance of the channel where it is
 * the largest part; or RENDER_IRRADIANCE_ROWS_MAX. The irradiance need not outlive it. Fails with
 * DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_irradiance_table_create(const struct render_irradiance *irradiance,
                                                   double tolerance,
                                                   struct render_irradiance_table **table_out,
                                                   dipole_status *status);
void render_irradiance_table_destroy(struct render_irradiance_table *table);

/* Whether a table for them would be the same. */
bool render_irradiance_table_is_of(const struct render_irradiance_table *table,
                                   const struct render_irradiance *irradiance, double tolerance);

/* How many rows a table has that keeps to the tolerance, and the bound of its error; error may be NULL. */
int render_irradiance_table_rows(const struct render_irradiance *irradiance, double tolerance,
                                 double *error);

/* At a unit normal, in W/mm^2, never below 0. */
void render_irradiance_table_at(const struct render_irradiance_table *table, const double normal[3],
                                double rgb[3]);

#endif
