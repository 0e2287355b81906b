#include "renderer/volumes.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double render_volume_epsilon(double epsilon)
{
    return fmin(fmax(5 * epsilon, 0.02), 0.15);
}

static struct render_volumes *volumes_create(const struct render_media *media, dipole_status *status)
{
    struct render_volumes *const volumes = calloc(1, sizeof *volumes);
    if (volumes) {
        volumes->count = media->count;
        volumes->volumes = calloc(media->count, sizeof(void *));
    }
    if (volumes && volumes->volumes)
        return volumes;
    free(volumes);
    dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the volumes of %zu media", media->count);
    return NULL;
}

void render_volumes_destroy(struct render_volumes *volumes)
{
    if (!volumes)
        return;
    for (size_t m = 0; m < volumes->count; m++)
        lut_tsm_destroy(volumes->volumes[m]);
    free(volumes->volumes);
    free(volumes);
}

/* Texels along S and T of volumes baked here: 2 to 5 % of error for most media, and more texels add nothing
 * that could be seen beside what the samples miss. */
enum { SIDE_S = 64, SIDE_T = 128 };

/* As exact as asked, or nearly, in so many texels; else coarser in as many as that takes. */
static bool volume_bake(const struct render_medium *medium, double epsilon, int slice_count,
                        struct lut_tsm **lut_out, dipole_status *status)
{
    const struct {
        double factor;
        bool is_free;
    } tries[] = { { 1, false }, { 2, false }, { 4, true }, { 10, true } };
    dipole_status why = { 0 };
    for (size_t i = 0; i < sizeof tries / sizeof *tries; i++) {
        const struct lut_request wanted = { .kind = LUT_TSM,
                                            .materials = medium->material,
                                            .material_count = 1,
                                            .epsilon = fmin(tries[i].factor * epsilon, LUT_EPSILON_MAX),
                                            .size = { tries[i].is_free ? 0 : SIDE_S,
                                                      tries[i].is_free ? 0 : SIDE_T, slice_count } };
        if (lut_tsm_bake(&wanted, 0, lut_out, &why))
            return true;
        if (why.code != DIPOLE_NOT_CONVERGED)
            break;
    }
    return dipole_fail(status, why.code, NULL, "%s", why.message);
}

bool render_volumes_bake(const struct render_media *media, double epsilon, int slice_count,
                         struct render_volumes **volumes_out, dipole_status *status)
{
    *volumes_out = NULL;
    struct render_volumes *const volumes = volumes_create(media, status);
    bool is_done = volumes != NULL;
    for (size_t m = 0; is_done && m < media->count; m++) {
        if (media->media[m].has_scattering)
            is_done = volume_bake(&media->media[m], epsilon, slice_count, &volumes->volumes[m], status);
    }
    if (is_done) {
        volumes->epsilon = epsilon;
        volumes->slice_count = slice_count;
        *volumes_out = volumes;
    } else {
        render_volumes_destroy(volumes);
    }
    return is_done;
}

/* ---- a folder ----------------------------------------------------------------------------------- */

static int select_volume(const struct dirent *entry)
{
    static const char suffix[] = ".tsm.exr";
    const size_t length = strlen(entry->d_name);
    return length >= sizeof suffix && strcmp(entry->d_name + length - (sizeof suffix - 1), suffix) == 0;
}

/* Take a volume for the medium that it is of, if it is better than what there is; else end it. */
static void take_volume(struct lut_tsm *lut, const struct render_media *media,
                        struct render_volumes *volumes)
{
    const struct lut_hash hash = lut_material_hash(&lut->material);
    for (size_t m = 0; m < media->count; m++) {
        struct lut_tsm **const there = &volumes->volumes[m];
        if (strcmp(hash.text, media->media[m].hash.text) == 0 &&
            (!*there || lut->error.max < (*there)->error.max)) {
            lut_tsm_destroy(*there);
            *there = lut;
            return;
        }
    }
    lut_tsm_destroy(lut);
}

static bool read_volume(const char *folder, const char *name, const struct render_media *media,
                        int sample_count, struct render_volumes *volumes, dipole_status *status)
{
    char *path = NULL;
    struct lut_tsm *lut = NULL;
    if (asprintf(&path, "%s/%s", folder, name) < 0)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the path of a volume");
    const bool is_done = lut_tsm_read(path, &lut, status);
    if (is_done && (sample_count == 0 || lut->sample_count == sample_count))
        take_volume(lut, media, volumes);
    else
        lut_tsm_destroy(lut);
    free(path);
    return is_done;
}

static bool check_found(const char *folder, const struct render_media *media,
                        const struct render_volumes *volumes, int file_count, dipole_status *status)
{
    const dipole_place place = { .source = folder };
    for (size_t m = 0; m < media->count; m++) {
        if (!volumes->volumes[m] && media->media[m].has_scattering)
            return dipole_fail(
                status, DIPOLE_NOT_FOUND, &place,
                "no volume of material \"%s\" (material_hash %s) among %d *.tsm.exr; bake one with "
                "lutgen --kind tsm",
                media->media[m].material->name, media->media[m].hash.text, file_count);
    }
    return true;
}

bool render_volumes_find(const char *folder, const struct render_media *media, int sample_count,
                         struct render_volumes **volumes_out, dipole_status *status)
{
    const dipole_place place = { .source = folder };
    struct dirent **entries = NULL;
    *volumes_out = NULL;
    const int count = scandir(folder, &entries, select_volume, alphasort);
    if (count < 0)
        return dipole_fail(status, DIPOLE_NOT_FOUND, &place, "cannot list the folder of tables: %s",
                           strerror(errno));
    struct render_volumes *const volumes = volumes_create(media, status);
    bool is_done = volumes != NULL;
    for (int i = 0; i < count; i++) {
        is_done = is_done && read_volume(folder, entries[i]->d_name, media, sample_count, volumes, status);
        free(entries[i]);
    }
    free(entries);
    if (is_done && check_found(folder, media, volumes, count, status)) {
        *volumes_out = volumes;
        return true;
    }
    render_volumes_destroy(volumes);
    return false;
}
