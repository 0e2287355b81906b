/* Names of the bundled materials. */
#ifndef RENDERER_WINDOW_MATERIAL_LIST_H
#define RENDERER_WINDOW_MATERIAL_LIST_H

#include "libdipole/dipole.h"

/* Sorted, those in folders last. End it with window_material_list_destroy. */
struct window_material_list {
    char **names;
    size_t count;
};

/* Empty where no materials are bundled. Fails with DIPOLE_OUT_OF_MEMORY. */
DIPOLE_CHECKED bool window_material_list_create(struct window_material_list *list, dipole_status *status);
void window_material_list_destroy(struct window_material_list *list);

#endif
