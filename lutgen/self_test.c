#include "lutgen/self_test.h"

#include "io/json.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* ---- the patch ------------------------------------------------------------------------------------ */

enum { GREY_COUNT = 6, GREY_ROW = 2 };
static const float greys[2][GREY_COUNT] = { { 0.5f, 0.25f, 0x1p-10f, 1000.0f, 131072.0f, 0x1p-30f },
                                            { 0.5f, 0.25f, 0x1p-10f, 1000.0f, 65504.0f, 0x1p-14f } };

static bool is_side(int side)
{
    return side >= LUT_SELF_TEST_SIDE_MIN && side <= LUT_SELF_TEST_SIDE_MAX;
}

static float patch_value(int x, int y, int channel, int width, int height, bool is_half)
{
    const bool is_left = x == 0, is_right = x == width - 1;
    if (y == 0 && (is_left || is_right))
        return channel == (is_left ? 0 : 1);
    if (y == height - 1 && (is_left || is_right))
        return is_left ? channel == 2 : 0.5f;
    if (y == GREY_ROW && x >= 1 && x <= GREY_COUNT)
        return greys[is_half][x - 1];
    if (y == height / 2) {
        int steps = 1;
        while (steps < width)
            steps *= 2;
        return (float)x / (float)steps;
    }
    return 0.0f;
}

void lut_self_test_fill(struct io_image *image, int depth, bool is_half)
{
    assert(image->channel_count == 3 && depth > 0 && image->width_px % depth == 0);
    const int width = image->width_px / depth, height = image->height_px;
    assert(is_side(width) && is_side(height));
    for (int y = 0; y < height; y++) {
        float *out =
            image->pixels + ((size_t)y * (size_t)image->width_px + (size_t)((depth - 1) * width)) * 3;
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++)
                *out++ = patch_value(x, y, c, width, height, is_half);
    }
}

/* ---- what happened to it -------------------------------------------------------------------------- */

static float srgb_decode(float value)
{
    return value <= 0.04045f ? value / 12.92f : powf((value + 0.055f) / 1.055f, 2.4f);
}

static float srgb_encode(float value)
{
    return value <= 0.0031308f ? 12.92f * value : 1.055f * powf(value, 1 / 2.4f) - 0.055f;
}

/* What becomes of a value that must go through what the flags say. A picture is encoded before it is cut to
 * 8 bits, and decoded after. */
static float changed(float value, unsigned flags)
{
    if (flags & LUT_SELF_TEST_SRGB_ENCODED)
        value = srgb_encode(value);
    if (flags & LUT_SELF_TEST_HALVED)
        value = value > 65504.0f ? INFINITY : value < 0x1p-24f ? 0.0f : value;
    if (flags & (LUT_SELF_TEST_CLAMPED | LUT_SELF_TEST_QUANTISED))
        value = fminf(value, 1.0f);
    if (flags & LUT_SELF_TEST_QUANTISED)
        value = roundf(255.0f * value) / 255.0f;
    if (flags & LUT_SELF_TEST_SRGB_DECODED)
        value = srgb_decode(value);
    return value;
}

/* Graphics processors take sRGB by approximations that miss by 2 %. */
static bool is_near(float found, float expected, unsigned flags)
{
    const bool is_rough = flags & (LUT_SELF_TEST_SRGB_DECODED | LUT_SELF_TEST_SRGB_ENCODED);
    if (isinf(expected)) /* half saturates in some programs */
        return found == expected || found == 65504.0f;
    return fabsf(found - expected) <= (is_rough ? 3e-2f : 1e-3f) * expected;
}

static const int orders[][3] = { { 0, 1, 2 }, { 2, 1, 0 }, { 0, 2, 1 },
                                 { 1, 0, 2 }, { 1, 2, 0 }, { 2, 0, 1 } };

static bool is_patch(const float *rgb, int width, int height, bool is_half, unsigned flags,
                     const int order[3])
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < 3; c++) {
                const int from_x = flags & LUT_SELF_TEST_FLIPPED_X ? width - 1 - x : x;
                const int from_y = flags & LUT_SELF_TEST_FLIPPED_Y ? height - 1 - y : y;
                const float value = patch_value(from_x, from_y, order[c], width, height, is_half);
                if (!is_near(*rgb++, changed(value, flags), flags))
                    return false;
            }
    return true;
}

static bool is_patch_in_any_order(const float *rgb, int width, int height, bool is_half, unsigned flags)
{
    if (!(flags & LUT_SELF_TEST_CHANNELS_SWAPPED))
        return is_patch(rgb, width, height, is_half, flags, orders[0]);
    for (size_t i = 1; i < sizeof orders / sizeof orders[0]; i++)
        if (is_patch(rgb, width, height, is_half, flags, orders[i]))
            return true;
    return false;
}

static int flag_count(unsigned flags)
{
    int count = 0;
    for (; flags; flags &= flags - 1)
        count++;
    return count;
}

unsigned lut_self_test_check(const float *rgb, int width, int height, bool is_half)
{
    if (!is_side(width) || !is_side(height))
        return LUT_SELF_TEST_UNKNOWN;
    const unsigned both = LUT_SELF_TEST_SRGB_DECODED | LUT_SELF_TEST_SRGB_ENCODED; /* undo each other */
    for (int count = 0; count < 8; count++)
        for (unsigned flags = 0; flags < LUT_SELF_TEST_UNKNOWN; flags++)
            if (flag_count(flags) == count && (flags & both) != both &&
                is_patch_in_any_order(rgb, width, height, is_half, flags))
                return flags;
    return LUT_SELF_TEST_UNKNOWN;
}

/* ---- probes --------------------------------------------------------------------------------------- */

static json_t *probe(const struct io_image *image, int width, int x, int y, int z)
{
    const float *const rgb =
        image->pixels + ((size_t)y * (size_t)image->width_px + (size_t)(z * width + x)) * 3;
    return json_pack("{s:[i, i, i], s:[f, f, f]}", "texel", x, y, z, "rgb", (double)rgb[0], (double)rgb[1],
                     (double)rgb[2]);
}

bool lut_self_test_set_probes(struct io_image *image, int depth)
{
    assert(image->channel_count == 3 && depth > 0 && image->width_px % depth == 0);
    const int width = image->width_px / depth;
    json_t *const probes = json_array();
    bool is_done = probes != NULL;
    /* A side of 1 has one corner, not two. */
    for (int z = 0; z<depth; z += depth> 1 ? depth - 1 : 1)
        for (int y = 0; y<image->height_px; y += image->height_px> 1 ? image->height_px - 1 : 1)
            for (int x = 0; x<width; x += width> 1 ? width - 1 : 1)
                is_done = is_done && json_array_append_new(probes, probe(image, width, x, y, z)) == 0;
    char *const text = is_done ? io_json_format(probes) : NULL;
    is_done = text && io_image_set_text(image, "dipole:self_test_json", text);
    free(text);
    json_decref(probes);
    return is_done;
}
