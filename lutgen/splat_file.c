/* Splat tables as pictures: rows of texels, everything else in attributes. docs/formats.md */
#include "lutgen/internal.h"
#include "lutgen/self_test.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

const char *const lut_kind_names[] = { "splat1d", "splat2d", "tsm", NULL };

static const char axis_mapping[] =
    "w = 1 + (r/scale_mm)^2, W = 1 + (r_max_mm/scale_mm)^2; u = (w^power - 1)/(W^power - 1), for power 0 "
    "log(w)/log(W); texel i of size has its centre at u = i/(size - 1); linear between";
static const char unit[] = "1/mm^2: texel * dipole:scale * w^-dipole:falloff; 0 beyond dipole:r_max_mm";

/* ---- picture ------------------------------------------------------------------------------------ */

static json_t *triple(const double values[3])
{
    return json_pack("[fff]", values[0], values[1], values[2]);
}

static json_t *row_to_json(const struct lut_splat_row *row)
{
    return json_pack("{s:s, s:s, s:o, s:f, s:f, s:f, s:f, s:o, s:o, s:f, s:f, s:f}", "material",
                     row->material.name, "material_hash", lut_material_hash(&row->material).text,
                     "material_json", io_material_to_json(&row->material, NULL), "r_max_mm",
                     row->axis.r_max_mm, "scale_mm", row->axis.scale_mm, "power", row->axis.power,
                     "falloff", row->falloff, "scale", triple(row->scale), "core_mm", triple(row->core_mm),
                     "predicted_relative_error", row->predicted_error, "max_relative_error", row->error.max,
                     "p99_relative_error", row->error.p99);
}

static json_t *rows_to_json(const struct lut_splat *lut)
{
    json_t *const rows = json_array();
    for (size_t i = 0; i < lut->row_count; i++)
        if (json_array_append_new(rows, row_to_json(&lut->rows[i])) != 0) {
            json_decref(rows);
            return NULL;
        }
    return rows;
}

/* The one row of a 1D table in attributes of their own, for people and for readers without JSON. */
static void put_row(struct lut_writer *writer, const struct lut_splat_row *row)
{
    lut_put_material(writer, &row->material);
    lut_put_number(writer, "dipole:r_max_mm", row->axis.r_max_mm);
    lut_put_number(writer, "dipole:scale_mm", row->axis.scale_mm);
    lut_put_number(writer, "dipole:power", row->axis.power);
    lut_put_number(writer, "dipole:falloff", row->falloff);
    lut_put_numbers(writer, "dipole:scale", row->scale);
    lut_put_numbers(writer, "dipole:core_mm", row->core_mm);
}

static struct lut_error error_of_rows(const struct lut_splat *lut)
{
    struct lut_error worst = { 0 };
    for (size_t i = 0; i < lut->row_count; i++) {
        worst.max = fmax(worst.max, lut->rows[i].error.max);
        worst.p99 = fmax(worst.p99, lut->rows[i].error.p99);
    }
    return worst;
}

/* The table as it was asked for. */
static void put_end(struct lut_writer *writer, const struct lut_splat *lut, enum lut_kind kind)
{
    struct io_material *const materials = calloc(lut->row_count, sizeof *materials);
    if (!materials) {
        writer->is_done = false;
        return;
    }
    for (size_t i = 0; i < lut->row_count; i++)
        materials[i] = lut->rows[i].material;
    lut_put_end(writer, &(struct lut_request){ .kind = kind,
                                               .materials = materials,
                                               .material_count = lut->row_count,
                                               .epsilon = lut->epsilon,
                                               .size = { lut->node_count_asked },
                                               .is_half = lut->is_half });
    free(materials);
}

static bool attributes_set(struct io_image *image, const struct lut_splat *lut, enum lut_kind kind)
{
    struct lut_writer writer = { .image = image, .is_done = true };
    const struct lut_error error = error_of_rows(lut);
    lut_put_text(&writer, "dipole:kind", lut_kind_names[kind]);
    if (kind == LUT_SPLAT1D)
        lut_put_number(&writer, "dipole:size", lut->node_count);
    else
        lut_put_numbers(&writer, "dipole:size",
                        (const double[]){ lut->node_count, (double)lut->row_count, 1 });
    lut_put_number(&writer, "dipole:epsilon", lut->epsilon);
    lut_put_number(&writer, "dipole:max_relative_error", error.max);
    lut_put_number(&writer, "dipole:p99_relative_error", error.p99);
    if (kind == LUT_SPLAT1D)
        put_row(&writer, &lut->rows[0]);
    lut_put_text(&writer, "dipole:axis_mapping", axis_mapping);
    lut_put_text(&writer, "dipole:unit", unit);
    lut_put_json(&writer, "dipole:row_json", rows_to_json(lut));
    writer.is_done = writer.is_done && lut_self_test_set_probes(image, 1);
    put_end(&writer, lut, kind);
    return writer.is_done;
}

bool lut_splat_to_image(const struct lut_splat *lut, enum lut_kind kind, struct io_image **image_out,
                        dipole_status *status)
{
    assert(kind == LUT_SPLAT2D || (kind == LUT_SPLAT1D && lut->row_count == 1));
    if (!io_image_create(lut->node_count, (int)lut->row_count, IO_CHANNEL_COUNT, image_out, status))
        return false;
    memcpy((*image_out)->pixels, lut->rgb,
           lut->row_count * (size_t)lut->node_count * IO_CHANNEL_COUNT * sizeof *lut->rgb);
    if (attributes_set(*image_out, lut, kind))
        return true;
    io_image_destroy(*image_out);
    *image_out = NULL;
    return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                       "the table's description does not fit into a file (is a name not UTF-8, or are the "
                       "materials too many?)");
}

/* ---- back --------------------------------------------------------------------------------------- */

static bool row_parse(const struct io_json *at, double epsilon, struct lut_splat_row *row,
                      dipole_status *status)
{
    static const char *const known[] = { "material",
                                         "material_hash",
                                         "material_json",
                                         "r_max_mm",
                                         "scale_mm",
                                         "power",
                                         "falloff",
                                         "scale",
                                         "core_mm",
                                         "predicted_relative_error",
                                         "max_relative_error",
                                         "p99_relative_error",
                                         NULL };
    const struct io_json material = io_json_member(at, "material_json");
    return io_json_check_object(at, known, 12, status) &&
           io_material_parse(&material, &row->material, status) &&
           io_json_get_number(at, "r_max_mm", 1e-100, 1e100, &row->axis.r_max_mm, status) &&
           io_json_get_number(at, "scale_mm", 1e-100, 1e100, &row->axis.scale_mm, status) &&
           io_json_get_number(at, "power", 0, 4, &row->axis.power, status) &&
           io_json_get_number(at, "falloff", 0, 4, &row->falloff, status) &&
           io_json_get_numbers(at, "scale", 3, 0x1p-300, 0x1p300, row->scale, status) &&
           io_json_get_numbers(at, "core_mm", 3, 0, 1e100, row->core_mm, status) &&
           io_json_get_number(at, "predicted_relative_error", 0, 1e6, &row->predicted_error, status) &&
           io_json_get_number(at, "max_relative_error", 0, epsilon, &row->error.max, status) &&
           io_json_get_number(at, "p99_relative_error", 0, epsilon, &row->error.p99, status);
}

static bool rows_parse(const struct lut_reader *reader, struct lut_splat *lut)
{
    struct io_json_document *document = NULL;
    dipole_status why = { 0 };
    if (!lut_get_json(reader, "dipole:row_json", &document))
        return false;
    const struct io_json root = io_json_root(document);
    size_t count;
    bool is_done = io_json_check_array(&root, 1, LUT_ROW_LIMIT, &count, &why);
    if (is_done && count != (size_t)reader->image->height_px)
        is_done =
            dipole_fail(&why, DIPOLE_BAD_VALUE, NULL, "%zu rows are described, expected %d, the height",
                        count, reader->image->height_px);
    if (is_done && !(lut->rows = calloc(count, sizeof *lut->rows)))
        is_done = dipole_fail(&why, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for %zu rows", count);
    for (size_t i = 0; i < count && is_done; i++) {
        const struct io_json at = io_json_element(&root, i);
        is_done = row_parse(&at, lut->epsilon, &lut->rows[i], &why);
        lut->rows[i].axis.node_count = lut->node_count;
        lut->row_count = i + 1;
    }
    io_json_destroy(document);
    return is_done ||
           dipole_fail(reader->status, why.code, &reader->place, "dipole:row_json: %s", why.message);
}

static bool texels_copy(const struct lut_reader *reader, struct lut_splat *lut)
{
    const size_t count = lut->row_count * (size_t)lut->node_count * IO_CHANNEL_COUNT;
    lut->rgb = malloc(count * sizeof *lut->rgb);
    if (!lut->rgb)
        return dipole_fail(reader->status, DIPOLE_OUT_OF_MEMORY, &reader->place,
                           "out of memory for a table");
    memcpy(lut->rgb, reader->image->pixels, count * sizeof *lut->rgb);
    return lut_check_texels(reader, lut->rgb, count);
}

static bool parse(const struct lut_reader *reader, struct lut_splat *lut)
{
    static const char *const kinds[] = { "splat1d", "splat2d", NULL };
    static const char *const storages[] = { "float", "half", NULL };
    const struct io_image *const image = reader->image;
    int kind, storage;
    double asked[3];
    if (!lut_get_choice(reader, "dipole:kind", kinds, &kind) || !lut_check_version(reader) ||
        !lut_get_numbers(reader, "dipole:size_asked", 0, LUT_NODE_COUNT_MAX, asked) ||
        !lut_get_number(reader, "dipole:epsilon", LUT_EPSILON_MIN, LUT_EPSILON_MAX, &lut->epsilon) ||
        !lut_get_choice(reader, "dipole:storage", storages, &storage))
        return false;
    if (image->channel_count != IO_CHANNEL_COUNT || image->width_px < LUT_NODE_COUNT_MIN ||
        image->width_px > LUT_NODE_COUNT_MAX || (kind == LUT_SPLAT1D && image->height_px != 1))
        return dipole_fail(
            reader->status, DIPOLE_BAD_VALUE, &reader->place,
            "the picture is %d x %d with %d channels, expected a width of %d to %d%s, and %d",
            image->width_px, image->height_px, image->channel_count, LUT_NODE_COUNT_MIN, LUT_NODE_COUNT_MAX,
            kind == LUT_SPLAT1D ? ", a height of 1" : "", IO_CHANNEL_COUNT);
    lut->node_count = image->width_px;
    lut->node_count_asked = (int)asked[0];
    lut->is_half = storage == 1;
    struct io_image *expected = NULL;
    const bool is_done = rows_parse(reader, lut) && texels_copy(reader, lut) &&
                         lut_splat_to_image(lut, (enum lut_kind)kind, &expected, reader->status) &&
                         lut_check_same(reader, expected);
    io_image_destroy(expected);
    return is_done;
}

bool lut_splat_from_image(const struct io_image *image, const char *path, struct lut_splat **lut_out,
                          dipole_status *status)
{
    *lut_out = NULL;
    struct lut_splat *const lut = calloc(1, sizeof *lut);
    const struct lut_reader reader = { .image = image, .place = { .source = path }, .status = status };
    if (!lut)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, &reader.place, "out of memory for a table");
    if (!parse(&reader, lut)) {
        lut_splat_destroy(lut);
        return false;
    }
    *lut_out = lut;
    return true;
}

bool lut_splat_read(const char *path, struct lut_splat **lut_out, dipole_status *status)
{
    *lut_out = NULL;
    struct io_image *image = NULL;
    const bool is_done =
        io_exr_read(path, &image, status) && lut_splat_from_image(image, path, lut_out, status);
    io_image_destroy(image);
    return is_done;
}
