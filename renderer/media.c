#include "renderer/media.h"

#include "renderer/area_light.h"
#include "renderer/footprint.h"
#include "renderer/passage.h"
#include "renderer/solid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool medium_init(struct render_medium *medium, const struct io_material *material,
                        dipole_status *status)
{
    *medium = (struct render_medium){ .material = material,
                                      .hash = lut_material_hash(material),
                                      .eta = material->layers[0][0].medium.eta };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!dipole_stack_create(material->layers[c], material->layer_count, material->model,
                                 DIPOLE_FROM_ABOVE, &medium->stacks[c], status))
            return false;
        medium->diffuse_reflectance[c] = dipole_stack_total(medium->stacks[c], DIPOLE_FACE_LIT);
        medium->has_scattering |= medium->diffuse_reflectance[c] > 0;
    }
    return true;
}

static double surface_area_mm2(const struct io_mesh *mesh)
{
    double sum = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *const corners = &mesh->indices[3 * t];
        double sides[2][3], normal[3], square = 0;
        for (int side = 0; side < 2; side++) {
            for (size_t k = 0; k < 3; k++)
                sides[side][k] = (double)mesh->positions[3 * (size_t)corners[side + 1] + k] -
                                 (double)mesh->positions[3 * (size_t)corners[0] + k];
        }
        for (int k = 0; k < 3; k++) {
            normal[k] = sides[0][(k + 1) % 3] * sides[1][(k + 2) % 3] -
                        sides[0][(k + 2) % 3] * sides[1][(k + 1) % 3];
            square += normal[k] * normal[k];
        }
        sum += 0.5 * sqrt(square);
    }
    return sum;
}

/* Of a closed surface. */
static double volume_mm3(const struct io_mesh *mesh)
{
    double sum = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        double corners[3][3];
        for (size_t i = 0; i < 3; i++) {
            for (size_t k = 0; k < 3; k++)
                corners[i][k] = (double)mesh->positions[3 * (size_t)mesh->indices[3 * t + i] + k] -
                                (double)mesh->min[k];
        }
        for (int k = 0; k < 3; k++)
            sum += corners[0][k] * (corners[1][(k + 1) % 3] * corners[2][(k + 2) % 3] -
                                    corners[1][(k + 2) % 3] * corners[2][(k + 1) % 3]);
    }
    return fmax(sum / 6, 0);
}

static bool may_pass(const struct io_object *object)
{
    return object->casts != IO_CASTS_OPAQUE && object->material.layer_count == 1 &&
           !io_object_motion_kinds(object).is_sequence;
}

static bool need_passage(struct render_medium *medium, dipole_status *status)
{
    if (medium->passage)
        return true;
    medium->passage = calloc(1, sizeof *medium->passage);
    if (!medium->passage)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for what crosses a medium");
    return render_passage_fill(medium->material, medium->passage, status);
}

/* What shadows ask for: which objects are closed, and what crosses their media, where there are others that
 * they may shade; and which hide light from themselves, where a light has a size. */
static bool look_through(const struct io_scene *scene, struct render_media *media, dipole_status *status)
{
    bool is_soft = false;
    for (size_t i = 0; i < scene->light_count; i++)
        is_soft |= render_light_has_size(&scene->lights[i]);
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_object *const object = &scene->objects[i];
        const struct io_motion_kinds kinds = io_object_motion_kinds(object);
        const bool can_pass = may_pass(object) && scene->object_count > 1;
        bool is_closed = false;
        if ((can_pass || is_soft) && !render_mesh_is_solid(object->mesh, &is_closed, status))
            return false;
        if (is_closed && can_pass) {
            media->volume_mm3[i] = volume_mm3(object->mesh);
            const bool can_be_asked = object->casts == IO_CASTS_TRANSLUCENT || kinds.is_deformed ||
                                      render_body_is_thin(media->volume_mm3[i], media->area_mm2[i]);
            if (can_be_asked && !need_passage(&media->media[media->of_object[i]], status))
                return false;
        }
        if (is_closed && !kinds.is_deformed && !kinds.is_sequence &&
            !render_mesh_is_convex(object->mesh, &media->is_convex[i], status))
            return false;
    }
    return true;
}

/* Index of the medium of that hash; count when there is none yet. */
static size_t find(const struct render_media *media, const struct lut_hash *hash)
{
    for (size_t i = 0; i < media->count; i++) {
        if (strcmp(media->media[i].hash.text, hash->text) == 0)
            return i;
    }
    return media->count;
}

bool render_media_create(const struct io_scene *scene, struct render_media **media_out,
                         dipole_status *status)
{
    *media_out = NULL;
    struct render_media *const media = calloc(1, sizeof *media);
    if (media) {
        media->media = calloc(scene->object_count, sizeof *media->media);
        media->object_count = scene->object_count;
        media->area_mm2 = calloc(scene->object_count, sizeof *media->area_mm2);
        media->of_object = calloc(scene->object_count, sizeof *media->of_object);
        media->volume_mm3 = calloc(scene->object_count, sizeof *media->volume_mm3);
        media->is_convex = calloc(scene->object_count, sizeof *media->is_convex);
    }
    bool done = media && media->media && media->of_object && media->area_mm2 && media->volume_mm3 &&
                media->is_convex;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the media of %zu objects",
                    scene->object_count);
    for (size_t i = 0; done && i < scene->object_count; i++) {
        const struct io_material *const material = &scene->objects[i].material;
        media->area_mm2[i] = surface_area_mm2(scene->objects[i].mesh);
        const struct lut_hash hash = lut_material_hash(material);
        media->of_object[i] = find(media, &hash);
        if (media->of_object[i] < media->count)
            continue;
        struct render_medium *const medium = &media->media[media->count++]; /* counted first: it is ours */
        done = medium_init(medium, material, status);
        media->has_scattering |= medium->has_scattering;
    }
    done = done && look_through(scene, media, status);
    if (done)
        *media_out = media;
    else
        render_media_destroy(media);
    return done;
}

void render_media_measure(const struct io_scene *scene, struct render_media *media)
{
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct io_motion_kinds kinds = io_object_motion_kinds(&scene->objects[i]);
        if (kinds.is_deformed || kinds.is_sequence)
            media->area_mm2[i] = surface_area_mm2(scene->objects[i].mesh);
        if (kinds.is_deformed && media->volume_mm3[i] > 0)
            media->volume_mm3[i] = volume_mm3(scene->objects[i].mesh);
    }
}

void render_media_destroy(struct render_media *media)
{
    if (!media)
        return;
    for (size_t i = 0; i < media->count; i++) {
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            dipole_stack_destroy(media->media[i].stacks[c]);
        free(media->media[i].passage);
    }
    free(media->media);
    free(media->of_object);
    free(media->area_mm2);
    free(media->volume_mm3);
    free(media->is_convex);
    free(media);
}

double render_medium_r_max_mm(const struct render_medium *medium, double epsilon)
{
    double farthest_mm = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            farthest_mm =
                fmax(farthest_mm, dipole_stack_r_max_mm(medium->stacks[c], DIPOLE_FACE_LIT, epsilon));
    }
    return farthest_mm;
}

double render_medium_spacing_mm(const struct render_medium *medium, double epsilon, double spread)
{
    double narrowest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            narrowest_mm =
                fmin(narrowest_mm, render_footprint_sharp_spacing_mm(medium->stacks[c], epsilon, spread));
    }
    return narrowest_mm;
}

double render_medium_shortest_path_mm(const struct render_medium *medium)
{
    double shortest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const size_t count = dipole_stack_layer_count(medium->stacks[c]);
        for (size_t i = 0; i < count && medium->diffuse_reflectance[c] > 0; i++)
            shortest_mm =
                fmin(shortest_mm, dipole_stack_coefficients(medium->stacks[c], i)->mean_free_path_mm);
    }
    return shortest_mm;
}

bool render_medium_is_grey(const struct render_medium *medium)
{
    const struct io_material *const material = medium->material;
    bool is_grey = true;
    for (int c = 1; c < IO_CHANNEL_COUNT; c++) {
        for (size_t i = 0; i < material->layer_count; i++) {
            const dipole_layer *const first = &material->layers[0][i], *const layer =
                                                                           &material->layers[c][i];
            is_grey = is_grey && layer->thickness_mm == first->thickness_mm &&
                      layer->medium.sigma_a_per_mm == first->medium.sigma_a_per_mm &&
                      layer->medium.sigma_s_prime_per_mm == first->medium.sigma_s_prime_per_mm &&
                      layer->medium.eta == first->medium.eta;
        }
    }
    return is_grey;
}

const char *render_media_list_names(const struct render_media *media, char *names, size_t size)
{
    names[0] = '\0';
    for (size_t m = 0; m < media->count; m++) {
        const size_t length = strlen(names);
        snprintf(names + length, size - length, "%s%s", m > 0 ? "," : "", media->media[m].material->name);
    }
    return names;
}
