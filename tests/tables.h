/* What the tests of lutgen's tables share: materials, and files that are wrong in one place. */
#ifndef TABLES_H
#define TABLES_H

#include "tests/check.h"

#include "io/half.h"
#include "lutgen/internal.h"

#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const char *const bundled[] = {
    "apple",  "chicken1", "chicken2", "cream", "ketchup",    "marble",
    "potato", "skimmilk", "skin1",    "skin2", "spectralon", "wholemilk"
};
enum { BUNDLED_COUNT = 12 };

/* All lengths divided by factor. */
static inline struct io_material read_bundled(const char *name, double factor)
{
    char path[4096];
    struct io_material material;
    dipole_status status = { 0 };
    snprintf(path, sizeof path, SOURCE_FOLDER "/materials/%s.json", name);
    if (!io_material_read(path, &material, &status))
        fail_msg("%s: %s", status.source, status.message);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        for (size_t i = 0; i < material.layer_count; i++) {
            material.layers[c][i].medium.sigma_a_per_mm *= factor;
            material.layers[c][i].medium.sigma_s_prime_per_mm *= factor;
            material.layers[c][i].thickness_mm /= factor;
        }
    return material;
}

static inline struct io_material make_material(double sigma_a, double sigma_s_prime)
{
    struct io_material material = { .name = "made" };
    const dipole_medium medium = { .sigma_a_per_mm = sigma_a,
                                   .sigma_s_prime_per_mm = sigma_s_prime,
                                   .eta = 1.3 };
    io_material_set_media(&material, (const dipole_medium[]){ medium, medium, medium });
    return material;
}

static inline bool is_half(float value)
{
    return io_float_from_half(io_half_from_float(value)) == value;
}

static inline dipole_stack *stack_of(const struct io_material *material, int channel)
{
    dipole_stack *stack = NULL;
    dipole_status status = { 0 };
    if (!dipole_stack_create(material->layers[channel], material->layer_count, material->model,
                             DIPOLE_FROM_ABOVE, &stack, &status))
        fail_msg("%s: %s", material->name, status.message);
    return stack;
}

static inline dipole_coefficients coefficients_of(const struct io_material *material, int channel)
{
    dipole_coefficients c;
    assert_true(dipole_coefficients_init(&material->layers[channel][0].medium, &c, NULL));
    return c;
}

/* ---- files that are wrong in one place ------------------------------------------------------------ */

/* Whether a table can be made of a picture from path. */
typedef bool (*table_opener)(const struct io_image *image, const char *path, dipole_status *status);

static inline struct io_image *read_image(const char *path)
{
    struct io_image *image = NULL;
    dipole_status status = { 0 };
    if (!io_exr_read(path, &image, &status))
        fail_msg("%s", status.message);
    return image;
}

static inline struct io_attribute *attribute_of(struct io_image *image, const char *name)
{
    for (size_t i = 0; i < image->attribute_count; i++)
        if (strcmp(image->attributes[i].name, name) == 0)
            return &image->attributes[i];
    fail_msg("no %s", name);
    return NULL;
}

static inline void assert_text(const struct io_image *image, const char *name, const char *text)
{
    const struct io_attribute *const attribute = io_image_find(image, name);
    assert_non_null(attribute);
    assert_string_equal(attribute->text, text);
}

/* message: part of what is said. */
static inline void assert_refused(const struct io_image *image, table_opener open_table,
                                  const char *message)
{
    dipole_status status = { 0 };
    if (open_table(image, "bad.exr", &status))
        fail_msg("opened, expected \"%s\"", message);
    assert_true(status.code == DIPOLE_BAD_VALUE || status.code == DIPOLE_BAD_SYNTAX);
    assert_string_equal(status.source, "bad.exr");
    if (!strstr(status.message, message))
        fail_msg("\"%s\" is not in \"%s\"", message, status.message);
}

/* Oracle: each change that is made. Every number of the picture's attributes in turn is another, every text
 * has another letter or digit in each of some sixty places. */
static inline void expect_changed_attributes_refused(struct io_image *image, table_opener open_table)
{
    for (size_t i = 0; i < image->attribute_count; i++) {
        const struct io_attribute *const attribute = &image->attributes[i];
        const int count = attribute->kind == IO_ATTRIBUTE_TEXT     ? 0
                          : attribute->kind == IO_ATTRIBUTE_NUMBER ? 1
                                                                   : 3;
        for (int k = 0; k < count; k++) {
            double *const number = &image->attributes[i].numbers[k], was = *number;
            *number = was == 0 ? 1e-4 : was * 1.0001;
            if (open_table(image, "bad.exr", NULL))
                fail_msg("%s[%d] can be %.17g as well as %.17g", attribute->name, k, *number, was);
            *number = was;
        }
        const size_t length = count == 0 ? strlen(attribute->text) : 0;
        for (size_t k = 0; k < length; k += 1 + length / 60) {
            char *const letter = &attribute->text[k], was = *letter;
            if (!((was >= '0' && was <= '9') || (was >= 'a' && was <= 'z')))
                continue;
            *letter = was == '3' ? '4' : was == 'e' ? 'f' : was < 'a' ? '3' : 'e';
            if (open_table(image, "bad.exr", NULL))
                fail_msg("%s has another letter %zu, and that goes unseen: %s", attribute->name, k,
                         attribute->text);
            *letter = was;
        }
    }
}

/* Oracle: what is missing. */
static inline void expect_missing_attributes_named(struct io_image *image, table_opener open_table)
{
    for (size_t i = 0; i < image->attribute_count; i++) {
        struct io_attribute *const attribute = &image->attributes[i];
        char name[64], message[128];
        snprintf(name, sizeof name, "%s", attribute->name);
        snprintf(message, sizeof message, "no attribute %s, expected ", name);
        snprintf(attribute->name, sizeof attribute->name, "dipole:other");
        assert_refused(image, open_table, message);
        snprintf(attribute->name, sizeof attribute->name, "%s", name);
    }
}

#endif
