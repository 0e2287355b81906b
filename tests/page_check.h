/* What must hold of every page that fit writes, and what is in it. */
#ifndef PAGE_CHECK_H
#define PAGE_CHECK_H

#include "io/file.h"
#include "io/image.h"
#include "plot/text.h"
#include "tests/svg_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Well-formed, in UTF-8, and in need of no other file. */
static inline void assert_page(const char *page, size_t size)
{
    static const char head[] = "<!DOCTYPE html>\n";
    assert_memory_equal(page, head, sizeof head - 1);
    assert_well_formed(page + sizeof head - 1);
    for (size_t i = 0; i < size; i += plot_text_character_size(page + i)) /* valid UTF-8 */
        assert_true(plot_text_character_size(page + i) > 0);
    assert_int_equal(count_of(page, "http"), count_of(page, "http://www.w3.org/2000/svg"));
    assert_null(strstr(page, "<script"));
    assert_null(strstr(page, "<link"));
    assert_int_equal(count_of(page, " src="), count_of(page, " src=\"data:image/png;base64,"));
    assert_null(strstr(page, " href="));
}

static inline int base64_value(char c)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *const at = memchr(letters, c, sizeof letters - 1);
    return at ? (int)(at - letters) : -1;
}

/* The picture of this name in the page, read back as any program reads a PNG. */
static inline struct io_image *picture_of(const char *page, const char *name)
{
    char key[256];
    snprintf(key, sizeof key, "alt=\"%s\" src=\"data:image/png;base64,", name);
    const char *text = strstr(page, key);
    if (!text)
        fail_msg("no picture %s", name);
    text += strlen(key);
    const size_t length = strcspn(text, "\"");
    assert_int_equal(length % 4, 0);
    unsigned char *const bytes = malloc(length / 4 * 3 + 3);
    size_t size = 0;
    for (size_t i = 0; i < length; i += 4) {
        int values[4];
        for (size_t k = 0; k < 4; k++)
            values[k] = base64_value(text[i + k]);
        bytes[size++] = (unsigned char)(values[0] << 2 | values[1] >> 4);
        if (text[i + 2] != '=')
            bytes[size++] = (unsigned char)(values[1] << 4 | values[2] >> 2);
        if (text[i + 3] != '=')
            bytes[size++] = (unsigned char)(values[2] << 6 | values[3]);
    }
    struct io_image *image;
    dipole_status status;
    assert_true(io_file_write("embedded.png", bytes, size, NULL));
    free(bytes);
    if (!io_photo_read("embedded.png", IO_PHOTO_SRGB, NULL, &image, &status))
        fail_msg("%s: %s", name, status.message);
    return image;
}

static inline void assert_color(const struct io_image *image, int x, int y, const unsigned char rgb[3])
{
    for (int c = 0; c < 3; c++) {
        const double linear = (double)image->pixels[3 * (y * image->width_px + x) + c];
        const double srgb = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
        assert_int_equal(lround(255 * srgb), rgb[c]);
    }
}

static inline void assert_has(const char *page, const char *text)
{
    if (!strstr(page, text))
        fail_msg("the page has no \"%s\"", text);
}

#endif
