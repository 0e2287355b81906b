#include "renderer/casters.h"

#include "renderer/passage.h"
#include "renderer/projection.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static double nearest_gap_mm(const struct io_scene *scene, size_t object)
{
    double nearest_mm = INFINITY;
    for (size_t i = 0; i < scene->object_count; i++)
        nearest_mm =
            i == object
                ? nearest_mm
                : fmin(nearest_mm, render_mesh_gap_mm(scene->objects[object].mesh, scene->objects[i].mesh));
    return nearest_mm;
}

/* Whether light of a disc on its way to one box may cross another: not where a plane across an axis parts
 * them, and the light comes from the first one's side of it. */
static bool may_shade(const struct io_light *light, const struct io_mesh *mesh, const struct io_mesh *lit)
{
    for (int k = 0; k < 3; k++) {
        const double low_mm = (double)mesh->min[k], high_mm = (double)mesh->max[k];
        const bool is_below = high_mm <= (double)lit->min[k], is_above = low_mm >= (double)lit->max[k];
        const double size = light->kind == IO_LIGHT_POINT ? light->size_mm / 2 : tan(light->size_rad / 2);
        /* where the light comes from, over the box; of parallel light as far as it is wide */
        const double over = light->kind == IO_LIGHT_POINT ? light->position_mm[k] - high_mm
                                                          : -light->direction[k],
                     under = light->kind == IO_LIGHT_POINT ? low_mm - light->position_mm[k]
                                                           : light->direction[k];
        if ((is_below && over >= size) || (is_above && under >= size))
            return false;
    }
    return true;
}

static bool shades_others(const struct io_scene *scene, size_t object)
{
    for (size_t l = 0; l < scene->light_count; l++) {
        for (size_t i = 0; i < scene->object_count; i++) {
            if (i != object &&
                may_shade(&scene->lights[l], scene->objects[object].mesh, scene->objects[i].mesh))
                return true;
        }
    }
    return false;
}

/* Whether light that goes straight on through the object is nearer to what becomes of it on the next one
 * than no light is: of the diffuse light that leaves a disc, the part on its axis so far away is A/(A + pi
 * gap^2); what is not scattered does go straight on. T70 */
static bool is_better_straight(const struct io_material *material, double silhouette_mm2,
                               double thickness_mm, double gap_mm, const struct io_passage *passage)
{
    double right = 0, wrong = 0;
    const double part = silhouette_mm2 / (silhouette_mm2 + PI * gap_mm * gap_mm);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &material->layers[c][0].medium;
        const double all = render_passage_left(passage, thickness_mm, c);
        const double straight =
            all *
            fmin(exp(-(medium->sigma_a_per_mm + medium->sigma_s_prime_per_mm) * thickness_mm) / all, 1);
        right += straight + part * (all - straight);
        wrong += (1 - part) * (all - straight);
    }
    return right >= wrong;
}

/* NULL: the object lets light through, *left_out of it at most. */
static const char *why_opaque(const struct io_scene *scene, const struct render_media *media, size_t index,
                              double epsilon, double *left_out)
{
    const struct io_object *const object = &scene->objects[index];
    const struct io_passage *const passage = media->media[media->of_object[index]].passage;
    const double silhouette_mm2 = media->area_mm2[index] / 4;
    *left_out = 0;
    if (object->casts == IO_CASTS_OPAQUE)
        return "casts \"opaque\"";
    if (object->material.layer_count != 1)
        return "has layers";
    if (!(media->volume_mm3[index] > 0))
        return "is not closed";
    if (!passage || (object->casts == IO_CASTS_AUTO &&
                     !render_body_is_thin(media->volume_mm3[index], media->area_mm2[index])))
        return "is not thin";
    const double thickness_mm = media->volume_mm3[index] / (2 * silhouette_mm2);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        *left_out = fmax(*left_out, render_passage_left(passage, thickness_mm, c));
    if (*left_out < epsilon)
        return "leaves less than epsilon";
    if (object->casts == IO_CASTS_TRANSLUCENT)
        return NULL;
    if (!shades_others(scene, index))
        return "nothing is behind it";
    return is_better_straight(&object->material, silhouette_mm2, thickness_mm, nearest_gap_mm(scene, index),
                              passage)
               ? NULL
               : "is far from others, where its light spreads";
}

static void take_object(const struct io_scene *scene, const struct render_media *media, size_t index,
                        struct render_casters *casters)
{
    casters->lets_through[index] = true;
    casters->objects[casters->count - casters->blocker_count] = index;
    casters->casters[casters->count++] =
        (struct io_blocker){ .mesh = scene->objects[index].mesh,
                             .passage = media->media[media->of_object[index]].passage };
}

static void give_reason(const struct io_object *object, const char *why, double left,
                        struct render_casters *casters)
{
    if (left > 0)
        snprintf(casters->opaque_reason, sizeof casters->opaque_reason, "%.24s would leave %.2g, but %s",
                 object->name, left, why);
    else
        snprintf(casters->opaque_reason, sizeof casters->opaque_reason, "%.24s %s", object->name, why);
}

bool render_casters_init(const struct io_scene *scene, const struct render_media *media, double epsilon,
                         struct render_casters *casters, dipole_status *status)
{
    const size_t count = scene->blocker_count + scene->object_count;
    *casters =
        (struct render_casters){ .blocker_count = scene->blocker_count, .count = scene->blocker_count };
    casters->casters = calloc(count + 1, sizeof *casters->casters);
    casters->objects = calloc(scene->object_count + 1, sizeof *casters->objects);
    casters->lets_through = calloc(scene->object_count + 1, sizeof *casters->lets_through);
    if (!casters->casters || !casters->objects || !casters->lets_through)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for what throws shadows");
    if (scene->blocker_count > 0)
        memcpy(casters->casters, scene->blockers, scene->blocker_count * sizeof *casters->casters);
    double most_opaque = -1;
    for (size_t i = 0; scene->object_count > 1 && i < scene->object_count; i++) {
        double left;
        const char *const why = why_opaque(scene, media, i, epsilon, &left);
        if (!why) {
            take_object(scene, media, i, casters);
            casters->most_left = fmax(casters->most_left, left);
        } else if (left > most_opaque) { /* of what there would be most to see */
            most_opaque = left;
            give_reason(&scene->objects[i], why, left, casters);
        }
    }
    return true;
}

void render_casters_end(struct render_casters *casters)
{
    free(casters->casters);
    free(casters->objects);
    free(casters->lets_through);
    *casters = (struct render_casters){ .casters = NULL };
}
