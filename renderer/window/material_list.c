#include "renderer/window/material_list.h"

#include "io/file.h"
#include "io/material_file.h"

#include <dirent.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_LIMIT = 1024 };

static bool add(struct window_material_list *list, const char *name)
{
    char **const grown = realloc(list->names, (list->count + 1) * sizeof *grown);
    if (!grown)
        return false;
    list->names = grown;
    grown[list->count] = strdup(name);
    return grown[list->count] && ++list->count;
}

/* Materials of a folder, whose names begin with prefix; folders are only looked into from the uppermost. */
static bool add_folder(struct window_material_list *list, const char *path, const char *prefix)
{
    DIR *const folder = opendir(path);
    bool done = true;
    const struct dirent *entry;
    while (folder && done && list->count < LIST_LIMIT && (entry = readdir(folder)) != NULL) {
        char name[NAME_MAX + 64], inner[PATH_MAX];
        snprintf(name, sizeof name, "%s%s", prefix, entry->d_name);
        char *const suffix = strrchr(name, '.');
        if (suffix && strcmp(suffix, ".json") == 0) {
            *suffix = '\0';
            done = !io_material_is_bundled_name(name) || add(list, name);
        } else if (!suffix && prefix[0] == '\0' &&
                   snprintf(inner, sizeof inner, "%s/%s", path, name) < (int)sizeof inner) {
            strcat(name, "/");
            done = add_folder(list, inner, name);
        }
    }
    if (folder)
        closedir(folder);
    return done;
}

static int compare(const void *a, const void *b)
{
    const char *const one = *(const char *const *)a, *const other = *(const char *const *)b;
    const bool is_deep = strchr(one, '/') != NULL, is_other_deep = strchr(other, '/') != NULL;
    return is_deep != is_other_deep ? is_deep - is_other_deep : strcmp(one, other);
}

bool window_material_list_create(struct window_material_list *list, dipole_status *status)
{
    char path[PATH_MAX];
    *list = (struct window_material_list){ 0 };
    if (!io_data_path("materials", path, sizeof path, NULL))
        return true;
    if (!add_folder(list, path, "")) {
        window_material_list_destroy(list);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the names of materials");
    }
    if (list->count > 0)
        qsort(list->names, list->count, sizeof *list->names, compare);
    return true;
}

void window_material_list_destroy(struct window_material_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->names[i]);
    free(list->names);
    *list = (struct window_material_list){ 0 };
}
