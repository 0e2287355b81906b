#include "renderer/tables.h"

#include "renderer/plan.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_table(const struct dirent *entry)
{
    static const char suffix[] = ".splat1d.exr";
    const size_t length = strlen(entry->d_name);
    return length > sizeof suffix - 1 && strcmp(entry->d_name + length - (sizeof suffix - 1), suffix) == 0;
}

static int select_table(const struct dirent *entry)
{
    return is_table(entry);
}

/* Keep the better of *best and candidate, end the other. */
static void keep_better(struct lut_splat **best, struct lut_splat *candidate)
{
    if (*best && (*best)->rows[0].error.max <= candidate->rows[0].error.max) {
        lut_splat_destroy(candidate);
        return;
    }
    lut_splat_destroy(*best);
    *best = candidate;
}

/* What the search has seen. */
struct search {
    const struct io_material *material;
    struct lut_splat *best;
    dipole_status namesake; /* why a table of the material's name is not it */
};

static bool look_at(struct search *search, const char *path, dipole_status *status)
{
    const dipole_place place = { .source = path };
    struct lut_splat *table = NULL;
    if (!lut_splat_read(path, &table, status))
        return false;
    dipole_status difference;
    if (render_plan_check_table(table, search->material, &place, &difference)) {
        keep_better(&search->best, table);
        return true;
    }
    if (strcmp(table->rows[0].material.name, search->material->name) == 0)
        search->namesake = difference;
    lut_splat_destroy(table);
    return true;
}

bool render_table_find(const char *folder, const struct io_material *material, struct lut_splat **table_out,
                       dipole_status *status)
{
    const dipole_place place = { .source = folder };
    struct dirent **entries = NULL;
    *table_out = NULL;
    const int count = scandir(folder, &entries, select_table, alphasort);
    if (count < 0)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place, "cannot list the folder of tables: %s",
                           strerror(errno));
    struct search search = { .material = material };
    bool done = true;
    for (int i = 0; i < count; i++) {
        char path[4096];
        const int length = snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        if (done && length > 0 && (size_t)length < sizeof path)
            done = look_at(&search, path, status);
        free(entries[i]);
    }
    free(entries);
    if (done && search.best) {
        *table_out = search.best;
        return true;
    }
    lut_splat_destroy(search.best);
    if (done && search.namesake.code != DIPOLE_OK && status)
        *status = search.namesake;
    else if (done)
        dipole_fail(status, DIPOLE_NOT_FOUND, &place,
                    "no table of material \"%s\" among %d *.splat1d.exr; bake one with lutgen",
                    material->name, count);
    return false;
}
