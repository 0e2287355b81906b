/* What tests of the renderer's sums share: a medium with its table. */
#ifndef PROFILES_H
#define PROFILES_H

#include "tests/tables.h"

#include "renderer/bands.h"

struct test_profile {
    struct io_material material;
    struct render_medium medium;
    struct lut_splat *table;
    struct render_band_source source;
    double spacing_mm, r_max_mm; /* at epsilon */
};

static inline void profile_init_of(struct test_profile *profile, const struct io_material *material,
                                   double epsilon)
{
    *profile = (struct test_profile){ .material = *material };
    profile->medium = (struct render_medium){ .material = &profile->material, .has_scattering = true };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        profile->medium.stacks[c] = stack_of(&profile->material, c);
        profile->medium.diffuse_reflectance[c] =
            dipole_stack_total(profile->medium.stacks[c], DIPOLE_FACE_LIT);
    }
    assert_true(lut_splat_bake(&(struct lut_request){ .materials = &profile->material,
                                                      .material_count = 1,
                                                      .epsilon = 0.02 * epsilon },
                               &profile->table, NULL));
    profile->source = (struct render_band_source){ .table = profile->table, .medium = &profile->medium };
    profile->spacing_mm = render_medium_spacing_mm(&profile->medium, 0.58 * epsilon, 0);
    profile->r_max_mm = render_medium_r_max_mm(&profile->medium, 0.02 * epsilon);
}

static inline void profile_init(struct test_profile *profile, const char *name, dipole_model model,
                                double epsilon)
{
    struct io_material material = read_bundled(name, 1);
    material.model = model;
    profile_init_of(profile, &material, epsilon);
}

static inline void profile_end(struct test_profile *profile)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        dipole_stack_destroy(profile->medium.stacks[c]);
    lut_splat_destroy(profile->table);
}

#endif
