/* Material files; docs/formats.md and materials/material.schema.json describe them. */
#ifndef IO_MATERIAL_FILE_H
#define IO_MATERIAL_FILE_H

#include "io/json.h"
#include "libdipole/dipole.h"

enum { IO_CHANNEL_COUNT = 3 };

/* Names of the channels: "R", "G", "B". */
extern const char *const io_channel_names[IO_CHANNEL_COUNT];

/* Names of the models in files, by dipole_model; ends with NULL. */
extern const char *const io_model_names[];

/* A homogeneous material is one layer of infinite thickness. Layers are top first, as many in each channel.
 */
struct io_material {
    char name[128];
    char source[512];  /* publication, or ""                        */
    char warning[384]; /* suspicious but legal (a unit slip), or "" */
    dipole_model model;
    bool is_model_stated; /* by the file, else model is the default         */
    size_t layer_count;
    dipole_layer layers[IO_CHANNEL_COUNT][DIPOLE_LAYER_LIMIT]; /* checked by dipole_stack_create    */
    char layer_names[DIPOLE_LAYER_LIMIT][64];                  /* "epidermis", or ""                */
};

/* More than one layer, or one that ends. */
bool io_material_has_layers(const struct io_material *material);

/* Make it a half-space of these media, one for each channel. */
void io_material_set_media(struct io_material *material, const dipole_medium media[IO_CHANNEL_COUNT]);

/* Read and check a material file. Fails with place (line, column where JSON has them) and the key. */
DIPOLE_CHECKED bool io_material_read(const char *path, struct io_material *out, dipole_status *status);

/* A name without ".json" such as "marble" or "narasimhan2006/espresso", and where the bundled material of
 * that name is. Fails with DIPOLE_NOT_FOUND. */
bool io_material_is_bundled_name(const char *text);
DIPOLE_CHECKED bool io_material_bundled_path(const char *name, char *out, size_t size,
                                             dipole_status *status);

/* What a user names on a command line: a file, or where there is none of that name a bundled material. */
DIPOLE_CHECKED bool io_material_open(const char *name, struct io_material *out, dipole_status *status);

/* The same from a value of a parsed file, a material that stands inside a scene. */
DIPOLE_CHECKED bool io_material_parse(const struct io_json *at, struct io_material *out,
                                      dipole_status *status);

/* A material as JSON, with coefficients whatever form they were given in; fit (may be NULL) becomes its
 * "fit" block. NULL: out of memory, or a text that is not UTF-8. The caller owns it. */
json_t *io_material_to_json(const struct io_material *material, const json_t *fit);

/* Write a material file; fit (may be NULL) becomes its "fit" block. */
DIPOLE_CHECKED bool io_material_write(const char *path, const struct io_material *material,
                                      const json_t *fit, dipole_status *status);

#endif
