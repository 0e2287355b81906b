/* What the tests of translucent-shadow-map volumes share. */
#ifndef TSM_CHECK_H
#define TSM_CHECK_H

#include "tests/tables.h"

#include "lutgen/tsm.h"

static inline struct lut_request tsm_request(const struct io_material *material, double epsilon,
                                             bool is_half)
{
    return (struct lut_request){
        .kind = LUT_TSM, .materials = material, .material_count = 1, .epsilon = epsilon, .is_half = is_half
    };
}

static inline struct lut_tsm *tsm_bake(const struct lut_request *request)
{
    struct lut_tsm *lut = NULL;
    dipole_status status = { 0 };
    if (!lut_tsm_bake(request, 2, &lut, &status))
        fail_msg("%s, model %s, at %g: %s", request->materials[0].name,
                 io_model_names[request->materials[0].model], request->epsilon, status.message);
    return lut;
}

/* Texels of all slices but that of the self-test, which only a picture has. */
static inline void assert_same_volume(const struct lut_tsm *a, const struct lut_tsm *b)
{
    assert_memory_equal(a->size, b->size, sizeof a->size);
    assert_memory_equal(a->scale, b->scale, sizeof a->scale);
    const size_t width = (size_t)a->size[0] * (size_t)a->size[2] * 3;
    for (size_t t = 0; t < (size_t)a->size[1]; t++)
        assert_memory_equal(a->rgb + t * width, b->rgb + t * width,
                            (width - (size_t)a->size[0] * 3) * sizeof *a->rgb);
}

#endif
