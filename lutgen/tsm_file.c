/* Translucent-shadow-map volumes as pictures: slices side by side, everything else in attributes.
 * docs/formats.md */
#include "lutgen/self_test.h"
#include "lutgen/tsm.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char axis_mapping[] =
    "D = x_out - x_in, N the unit normal at x_in towards the light, dz = depth of x_out - depth of x_in "
    "along the "
    "light, all in mm. s = (1 + dot(N, D)/length(D))/2, t = (1 + asinh(dz/depth_scale_mm)/"
    "asinh(depth_max_mm/depth_scale_mm))/2; texel (i, j) of a slice of S x T has its centre at s = i/(S - "
    "1), "
    "t = j/(T - 1); linear between, not across slices; slice r belongs to entry r of pattern_json";
static const char unit[] =
    "1/mm^2: texel * dipole:scale; times the sample's area_mm2 and the flux per mm^2 across "
    "the light it is the power per mm^2 that leaves; 0 beyond depth_max_mm";
static const char local_mapping[] =
    "local_slice: 7 x 7 texels from (0, 0), means over cells of local_width_mm in 1/mm^2, texel * "
    "dipole:scale, the "
    "point in (3, 3); times local_width_mm^2, the flux per mm^2 and a factor: depth_factor_slice, texel "
    "(i, 0) for "
    "dz >= 0, (i, 1) for dz < 0, as it stands, at i = (S - 1) asinh(|dz|/local_depth_scale_mm)/"
    "asinh(inner_mm/local_depth_scale_mm), 0 beyond inner_mm";

static json_t *pattern_to_json(const struct lut_tsm *lut)
{
    json_t *const pattern = json_array();
    for (int i = 0; i < lut->sample_count; i++) {
        const struct lut_tsm_sample *const sample = &lut->samples[i];
        json_t *const entry =
            json_pack("{s:[ff], s:f, s:f}", "offset_mm", sample->offset_mm[0], sample->offset_mm[1],
                      "width_mm", sample->width_mm, "area_mm2", sample->area_mm2);
        if (json_array_append_new(pattern, entry) != 0) {
            json_decref(pattern);
            return NULL;
        }
    }
    return pattern;
}

static bool attributes_set(struct io_image *image, const struct lut_tsm *lut)
{
    struct lut_writer writer = { .image = image, .is_done = true };
    const int *const size = lut->size;
    lut_put_text(&writer, "dipole:kind", lut_kind_names[LUT_TSM]);
    lut_put_numbers(&writer, "dipole:size", (const double[]){ size[0], size[1], size[2] });
    lut_put_number(&writer, "dipole:epsilon", lut->epsilon);
    lut_put_number(&writer, "dipole:max_relative_error", lut->error.max);
    lut_put_number(&writer, "dipole:p99_relative_error", lut->error.p99);
    lut_put_number(&writer, "dipole:source_error", lut->source_error);
    lut_put_material(&writer, &lut->material);
    lut_put_number(&writer, "dipole:depth_scale_mm", lut->depth_scale_mm);
    lut_put_number(&writer, "dipole:depth_max_mm", lut->depth_max_mm);
    lut_put_numbers(&writer, "dipole:scale", lut->scale);
    lut_put_text(&writer, "dipole:axis_mapping", axis_mapping);
    lut_put_text(&writer, "dipole:unit", unit);
    lut_put_json(&writer, "dipole:pattern_json", pattern_to_json(lut));
    lut_put_number(&writer, "dipole:inner_mm", lut->inner_mm);
    lut_put_number(&writer, "dipole:local_width_mm", lut->inner_mm / LUT_TSM_LOCAL_SIDE);
    lut_put_number(&writer, "dipole:local_depth_scale_mm", lut->local_depth_scale_mm);
    lut_put_number(&writer, "dipole:local_slice", lut_tsm_kernel_slice(lut));
    lut_put_number(&writer, "dipole:depth_factor_slice", lut_tsm_depth_slice(lut));
    lut_put_number(&writer, "dipole:self_test_slice", size[2] - 1);
    lut_put_text(&writer, "dipole:local_mapping", local_mapping);
    lut_put_end(&writer, &(struct lut_request){
                             .kind = LUT_TSM,
                             .materials = &lut->material,
                             .material_count = 1,
                             .epsilon = lut->epsilon,
                             .size = { lut->size_asked[0], lut->size_asked[1], lut->size_asked[2] },
                             .is_half = lut->is_half });
    return writer.is_done;
}

bool lut_tsm_to_image(const struct lut_tsm *lut, struct io_image **image_out, dipole_status *status)
{
    const size_t count =
        (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2] * IO_CHANNEL_COUNT;
    if (!io_image_create(lut->size[0] * lut->size[2], lut->size[1], IO_CHANNEL_COUNT, image_out, status))
        return false;
    memcpy((*image_out)->pixels, lut->rgb, count * sizeof *lut->rgb);
    lut_self_test_fill(*image_out, lut->size[2], lut->is_half);
    if (attributes_set(*image_out, lut))
        return true;
    io_image_destroy(*image_out);
    *image_out = NULL;
    return dipole_fail(
        status, DIPOLE_OUT_OF_MEMORY, NULL,
        "the volume's description does not fit into a file (is the material's name not UTF-8?)");
}

/* ---- back --------------------------------------------------------------------------------------- */

static bool size_get(const struct lut_reader *reader, struct lut_tsm *lut)
{
    const struct io_image *const image = reader->image;
    double size[3], asked[3];
    if (!lut_get_numbers(reader, "dipole:size", LUT_TSM_SIDE_MIN, LUT_TSM_SIDE_MAX, size) ||
        !lut_get_numbers(reader, "dipole:size_asked", 0, LUT_TSM_SIDE_MAX, asked))
        return false;
    for (int i = 0; i < 3; i++) {
        lut->size[i] = (int)size[i];
        lut->size_asked[i] = (int)asked[i];
    }
    if (!lut_pattern_has(lut->size[2]) || image->channel_count != IO_CHANNEL_COUNT ||
        image->width_px != lut->size[0] * lut->size[2] || image->height_px != lut->size[1])
        return dipole_fail(
            reader->status, DIPOLE_BAD_VALUE, &reader->place,
            "the picture is %d x %d with %d channels, expected %d slices of %d x %d side by side and "
            "%d (dipole:size)",
            image->width_px, image->height_px, image->channel_count, lut->size[2], lut->size[0],
            lut->size[1], IO_CHANNEL_COUNT);
    return true;
}

static bool material_get(const struct lut_reader *reader, struct io_material *out)
{
    struct io_json_document *document = NULL;
    dipole_status why = { 0 };
    if (!lut_get_json(reader, "dipole:material_json", &document))
        return false;
    const struct io_json root = io_json_root(document);
    const bool is_done = io_material_parse(&root, out, &why);
    io_json_destroy(document);
    return is_done ||
           dipole_fail(reader->status, why.code, &reader->place, "dipole:material_json: %s", why.message);
}

static bool parse(const struct lut_reader *reader, struct lut_tsm *lut)
{
    static const char *const kinds[] = { "tsm", NULL };
    static const char *const storages[] = { "float", "half", NULL };
    int kind, storage;
    if (!lut_get_choice(reader, "dipole:kind", kinds, &kind) || !lut_check_version(reader) ||
        !size_get(reader, lut) || !material_get(reader, &lut->material) ||
        !lut_get_number(reader, "dipole:epsilon", LUT_EPSILON_MIN, LUT_EPSILON_MAX, &lut->epsilon) ||
        !lut_get_number(reader, "dipole:max_relative_error", 0, lut->epsilon, &lut->error.max) ||
        !lut_get_number(reader, "dipole:p99_relative_error", 0, lut->epsilon, &lut->error.p99) ||
        !lut_get_number(reader, "dipole:source_error", 0, lut->epsilon, &lut->source_error) ||
        !lut_get_number(reader, "dipole:depth_scale_mm", 1e-100, 1e100, &lut->depth_scale_mm) ||
        !lut_get_number(reader, "dipole:depth_max_mm", 1e-100, 1e100, &lut->depth_max_mm) ||
        !lut_get_number(reader, "dipole:inner_mm", 1e-100, 1e100, &lut->inner_mm) ||
        !lut_get_number(reader, "dipole:local_depth_scale_mm", 1e-100, 1e100, &lut->local_depth_scale_mm) ||
        !lut_get_numbers(reader, "dipole:scale", 0x1p-300, 0x1p300, lut->scale) ||
        !lut_get_choice(reader, "dipole:storage", storages, &storage))
        return false;
    lut->is_half = storage == 1;
    lut_tsm_samples_fill(lut);
    const size_t count =
        (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2] * IO_CHANNEL_COUNT;
    lut->rgb = malloc(count * sizeof *lut->rgb);
    if (!lut->rgb)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, &reader->place,
                           "out of memory for a volume");
    memcpy(lut->rgb, reader->image->pixels, count * sizeof *lut->rgb);
    struct io_image *expected = NULL;
    const bool is_done = lut_check_texels(reader, lut->rgb, count) &&
                         lut_tsm_to_image(lut, &expected, reader->status) &&
                         lut_check_same(reader, expected);
    io_image_destroy(expected);
    return is_done;
}

bool lut_tsm_from_image(const struct io_image *image, const char *path, struct lut_tsm **lut_out,
                        dipole_status *status)
{
    *lut_out = NULL;
    struct lut_tsm *const lut = calloc(1, sizeof *lut);
    const struct lut_reader reader = { .image = image, .place = { .source = path }, .status = status };
    if (!lut)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &reader.place, "out of memory for a volume");
    if (!parse(&reader, lut)) {
        lut_tsm_destroy(lut);
        return false;
    }
    *lut_out = lut;
    return true;
}

bool lut_tsm_read(const char *path, struct lut_tsm **lut_out, dipole_status *status)
{
    *lut_out = NULL;
    struct io_image *image = NULL;
    const bool is_done =
        io_exr_read(path, &image, status) && lut_tsm_from_image(image, path, lut_out, status);
    io_image_destroy(image);
    return is_done;
}
