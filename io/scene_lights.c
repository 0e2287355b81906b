#include "io/scene_internal.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

static bool append(struct io_light **lights, size_t count, const struct io_light *light)
{
    struct io_light *const grown = realloc(*lights, (count + 1) * sizeof *grown);
    if (!grown)
        return false;
    grown[count] = *light;
    *lights = grown;
    return true;
}

bool io_scene_add_light(struct io_scene *scene, const struct io_light *light, dipole_status *status)
{
    const struct io_light added = *light; /* it may be one of those that move */
    if (scene->light_count == IO_SCENE_LIGHT_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the scene has %zu lights, as many as it may",
                           scene->light_count);
    if (!append(&scene->frames.lights, scene->light_count, &added) ||
        !append(&scene->lights, scene->light_count, &added))
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for another light");
    scene->light_count++;
    return true;
}

void io_scene_remove_light(struct io_scene *scene, size_t index)
{
    assert(index < scene->light_count);
    const size_t after = scene->light_count - index - 1;
    memmove(scene->lights + index, scene->lights + index + 1, after * sizeof *scene->lights);
    memmove(scene->frames.lights + index, scene->frames.lights + index + 1, after * sizeof *scene->lights);
    scene->light_count--;
}
