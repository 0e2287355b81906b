#include "renderer/tables.h"

#include "renderer/plan.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct render_tables *tables_create(const struct render_media *media, size_t lut_limit,
                                           dipole_status *status)
{
    struct render_tables *const tables = calloc(1, sizeof *tables);
    if (tables) {
        tables->of_medium = calloc(media->count, sizeof *tables->of_medium);
        tables->luts = calloc(lut_limit + 1, sizeof(void *));
    }
    if (tables && tables->of_medium && tables->luts)
        return tables;
    render_tables_destroy(tables);
    dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the tables of %zu media", media->count);
    return NULL;
}

void render_tables_destroy(struct render_tables *tables)
{
    if (!tables)
        return;
    for (size_t i = 0; i < tables->lut_count; i++)
        lut_splat_destroy(tables->luts[i]);
    free(tables->luts);
    free(tables->of_medium);
    free(tables);
}

bool render_tables_bake(const struct render_media *media, double epsilon, struct render_tables **tables_out,
                        dipole_status *status)
{
    *tables_out = NULL;
    struct render_tables *const tables = tables_create(media, media->count, status);
    if (!tables)
        return false;
    tables->epsilon = epsilon;
    for (size_t m = 0; m < media->count; m++) {
        const struct lut_request wanted = { .materials = media->media[m].material,
                                            .material_count = 1,
                                            .epsilon = epsilon };
        if (!media->media[m].has_scattering)
            continue;
        dipole_status reason;
        if (!lut_splat_bake(&wanted, &tables->luts[tables->lut_count], &reason)) {
            render_tables_destroy(tables);
            return dipole_fail(status, reason.code, NULL, "no table of material \"%.60s\": %s",
                               wanted.materials->name, reason.message);
        }
        tables->of_medium[m].lut = tables->luts[tables->lut_count++];
    }
    *tables_out = tables;
    return true;
}

/* ---- a folder ----------------------------------------------------------------------------------- */

static bool ends_with(const char *name, const char *suffix)
{
    const size_t length = strlen(name), suffix_length = strlen(suffix);
    return length > suffix_length && strcmp(name + length - suffix_length, suffix) == 0;
}

static int select_table(const struct dirent *entry)
{
    return ends_with(entry->d_name, ".splat1d.exr") || ends_with(entry->d_name, ".splat2d.exr");
}

static double error_of(const struct render_table *table)
{
    return table->lut ? table->lut->rows[table->row].error.max : INFINITY;
}

/* Take the rows of a table that are better than what there is. */
static void take_rows(const struct lut_splat *lut, const struct render_media *media,
                      struct render_tables *tables)
{
    for (size_t row = 0; row < lut->row_count; row++) {
        const struct render_table candidate = { lut, row };
        for (size_t m = 0; m < media->count; m++) {
            if (error_of(&candidate) < error_of(&tables->of_medium[m]) &&
                render_plan_check_table(&candidate, media->media[m].material, NULL, NULL))
                tables->of_medium[m] = candidate;
        }
    }
}

/* Why a table of the material's name is not one of its medium; false when none has the name. */
static bool explain_namesake(const struct render_tables *tables, const char *const *paths,
                             const struct io_material *material, dipole_status *status)
{
    for (size_t i = 0; i < tables->lut_count; i++) {
        const struct lut_splat *const lut = tables->luts[i];
        const dipole_place place = { .source = paths[i] };
        for (size_t row = 0; row < lut->row_count; row++) {
            const struct render_table table = { lut, row };
            if (strcmp(lut->rows[row].material.name, material->name) == 0 &&
                !render_plan_check_table(&table, material, &place, status))
                return true;
        }
    }
    return false;
}

static bool check_found(const struct render_tables *tables, const char *const *paths, const char *folder,
                        const struct render_media *media, dipole_status *status)
{
    const dipole_place place = { .source = folder };
    for (size_t m = 0; m < media->count; m++) {
        const struct io_material *const material = media->media[m].material;
        if (tables->of_medium[m].lut || !media->media[m].has_scattering)
            continue;
        if (!explain_namesake(tables, paths, material, status))
            dipole_fail(status, DIPOLE_NOT_FOUND, &place,
                        "no table of material \"%s\" among %zu *.splat1d.exr and *.splat2d.exr; bake one "
                        "with lutgen",
                        material->name, tables->lut_count);
        return false;
    }
    return true;
}

bool render_tables_find(const char *folder, const struct render_media *media,
                        struct render_tables **tables_out, dipole_status *status)
{
    const dipole_place place = { .source = folder };
    struct dirent **entries = NULL;
    *tables_out = NULL;
    const int count = scandir(folder, &entries, select_table, alphasort);
    if (count < 0)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place, "cannot list the folder of tables: %s",
                           strerror(errno));
    struct render_tables *const tables = tables_create(media, (size_t)count, status);
    char **const paths = calloc((size_t)count + 1, sizeof *paths);
    bool done = tables && paths;
    if (tables && !paths)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &place, "no memory for %d names", count);
    for (int i = 0; i < count; i++) {
        if (done && asprintf(&paths[i], "%s/%s", folder, entries[i]->d_name) < 0)
            paths[i] = NULL;
        done = done && paths[i] && lut_splat_read(paths[i], &tables->luts[i], status);
        if (done) {
            tables->lut_count++;
            take_rows(tables->luts[i], media, tables);
        }
        free(entries[i]);
    }
    free(entries);
    done = done && check_found(tables, (const char *const *)paths, folder, media, status);
    for (size_t m = 0; done && m < media->count; m++) {
        if (tables->of_medium[m].lut)
            tables->epsilon = fmax(tables->epsilon, tables->of_medium[m].lut->epsilon);
    }
    for (int i = 0; paths && i < count; i++)
        free(paths[i]);
    free(paths);
    if (done)
        *tables_out = tables;
    else
        render_tables_destroy(tables);
    return done;
}
