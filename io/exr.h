/* OpenEXR files by the OpenEXRCore C API: tables and linear pictures. */
#ifndef IO_EXR_H
#define IO_EXR_H

#include "io/file.h"

#ifdef __cplusplus
extern "C" {
#endif

enum io_attribute_kind { IO_ATTRIBUTE_TEXT = 0, IO_ATTRIBUTE_NUMBER, IO_ATTRIBUTE_NUMBERS };

/* A named value in the header; the image owns it. */
struct io_attribute {
    char name[64]; /* "dipole:kind" */
    enum io_attribute_kind kind;
    char *text;        /* IO_ATTRIBUTE_TEXT: UTF-8; else NULL   */
    double numbers[3]; /* IO_ATTRIBUTE_NUMBER: [0]; NUMBERS: v3 */
};

/* Most attributes of an image, and longest text of one in bytes. */
enum { IO_IMAGE_MAX_CHANNELS = 4, IO_IMAGE_MAX_ATTRIBUTES = 256, IO_IMAGE_TEXT_LIMIT = 4 << 20 };

/* A picture in memory: height x width x channel_count floats, rows from the top, channels interleaved
 * R, G, B [, A]. End it with io_image_destroy. */
struct io_image {
    int width_px, height_px, channel_count; /* 1 (Y), 3 or 4 channels */
    float *pixels;
    struct io_attribute *attributes; /* attribute_count, in the order in which they were first set */
    size_t attribute_count, attribute_capacity;
};

/* Largest width or height, and largest picture in pixels. */
enum { IO_IMAGE_SIDE_LIMIT = 65536 };
#define IO_IMAGE_PIXEL_LIMIT ((size_t)1 << 28)

DIPOLE_CHECKED bool io_image_create(int width_px, int height_px, int channel_count,
                                    struct io_image **image_out, dipole_status *status);
void io_image_destroy(struct io_image *image);

/*
 * Set an attribute; one of that name is replaced. Numbers keep all their digits, a text is copied. False
 * when the name has more than 63 bytes, the text more than IO_IMAGE_TEXT_LIMIT, IO_IMAGE_MAX_ATTRIBUTES are
 * there, or memory runs out; the image is then as it was.
 */
bool io_image_set_text(struct io_image *image, const char *name, const char *text);
bool io_image_set_number(struct io_image *image, const char *name, double value);
bool io_image_set_numbers(struct io_image *image, const char *name, const double values[3]);
/* NULL when there is none of that name. */
const struct io_attribute *io_image_find(const struct io_image *image, const char *name);

/* Write scanline EXR, ZIP, float or half (rounded to nearest even), atomically. Same image, same bytes.
 * A finite value over the largest half, 65504, is DIPOLE_BAD_VALUE, naming pixel and channel: a clamped
 * table would be silently wrong. */
DIPOLE_CHECKED bool io_exr_write(const char *path, const struct io_image *image, bool is_half,
                                 dipole_status *status);

/* The same, as io_file_write_checked. */
DIPOLE_CHECKED bool io_exr_write_checked(const char *path, const struct io_image *image, bool is_half,
                                         io_file_check *check, void *context, dipole_status *status);

/* Read scanline or tiled RGB(A) or single-channel EXR: the first part, the largest level, every compression
 * but DWA. Texts, doubles and v3d whose name starts with "dipole:" are kept as attributes; more or longer
 * ones than an image holds are DIPOLE_BAD_VALUE. Fails with the file and what is wrong; sizes are checked
 * before memory is taken. */
DIPOLE_CHECKED bool io_exr_read(const char *path, struct io_image **image_out, dipole_status *status);

#ifdef __cplusplus
}
#endif
#endif
