/* What a table carries so that whoever loads it can see whether its values arrived as they are. */
#ifndef LUTGEN_SELF_TEST_H
#define LUTGEN_SELF_TEST_H

#include "io/exr.h"

/* Least width and height of a slice that holds the patch, and the most. */
enum { LUT_SELF_TEST_SIDE_MIN = 8, LUT_SELF_TEST_SIDE_MAX = 2048 };

/*
 * Fill the last of the depth slices that lie side by side in an image of 3 channels with the patch: its
 * sides are LUT_SELF_TEST_SIDE_MIN to LUT_SELF_TEST_SIDE_MAX. In texels (x, y) of the slice of width x
 * height, rows from the top; all else is 0, and every value is a half:
 *
 *   (0, 0) 1 0 0            (width - 1, 0) 0 1 0
 *   (0, height - 1) 0 0 1   (width - 1, height - 1) 0.5 0.5 0.5
 *   (1, 2) to (6, 2)        grey: 0.5, 0.25, 2^-10, 1000, large, small; large and small are 65504 and 2^-14
 * in a half table; in a float table 131072 and 2^-30, which only float holds (x, height/2)           grey:
 * x over the least power of two >= width
 */
void lut_self_test_fill(struct io_image *image, int depth, bool is_half);

/* What happened to a patch; flags, as several may have. */
enum lut_self_test_result {
    LUT_SELF_TEST_FINE = 0,
    LUT_SELF_TEST_FLIPPED_X = 1,
    LUT_SELF_TEST_FLIPPED_Y = 2,
    LUT_SELF_TEST_CHANNELS_SWAPPED = 4, /* R, G, B in any other order                               */
    LUT_SELF_TEST_SRGB_DECODED = 8,     /* taken for sRGB and made linear: 0.5 is 0.2140            */
    LUT_SELF_TEST_SRGB_ENCODED = 16,    /* taken for linear and made sRGB: 0.5 is 0.7354            */
    LUT_SELF_TEST_CLAMPED = 32,         /* to 0..1                                                  */
    LUT_SELF_TEST_QUANTISED = 64,       /* to 8 bits, and so clamped as well                        */
    LUT_SELF_TEST_HALVED = 128,         /* a float table in half: large is infinite, small is 0     */
    LUT_SELF_TEST_UNKNOWN = 256         /* no patch, or changed otherwise: resampled, compressed    */
};

/*
 * Say what happened to the patch of a table (is_half: one stored in half): rgb is the slice as it arrived,
 * height rows of width texels of 3 floats, compared within 0.1 %, with sRGB within 3 %. The one with the
 * fewest flags is returned.
 */
unsigned lut_self_test_check(const float *rgb, int width, int height, bool is_half);

/*
 * Tables without a patch name texels instead: set dipole:self_test_json, a JSON array of
 * {"texel": [x, y, slice], "rgb": [r, g, b]} with the values at the corners of the first and the last
 * slice. image has 3 channels and finite values there. False as io_image_set_text, or without memory.
 */
bool lut_self_test_set_probes(struct io_image *image, int depth);

#endif
