/* A growing buffer for SVG text. A failed allocation is remembered and asked for once, at the end. */
#ifndef PLOT_TEXT_H
#define PLOT_TEXT_H

#include "libdipole/dipole.h"

struct plot_text {
    char *data; /* NUL-terminated beyond size; NULL when empty */
    size_t size, capacity;
    bool has_failed;
};

void plot_text_add(struct plot_text *text, const void *bytes, size_t size);

/*
 * Add a format that knows %d (int), %f (double, two decimals at most), %% and %s (UTF-8 text, escaped for
 * XML; bytes that XML cannot hold become U+FFFD). Independent of the locale.
 */
void plot_text_print(struct plot_text *text, const char *format, ...) DIPOLE_PRINTF(2, 3);

/* Number of bytes (1 to 4) of the UTF-8 character at s, or 0 when there is none that XML allows. */
size_t plot_text_character_size(const char *s);

/* Width of size bytes of UTF-8 in a sans-serif font, estimated from above for usual fonts. */
double plot_text_width_px(const char *s, size_t size, double font_px);

void plot_text_destroy(struct plot_text *text);

#endif
