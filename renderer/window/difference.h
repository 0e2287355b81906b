/* The difference of two pictures: as numbers, and as colours. No window is needed. */
#ifndef RENDERER_WINDOW_DIFFERENCE_H
#define RENDERER_WINDOW_DIFFERENCE_H

#include <stddef.h>

/* Right less left, as parts of the brightest channel of any pixel of both; all 0 where both are black. */
struct window_difference {
    double brightest; /* radiance                                                      */
    double rmse;      /* root mean square over the channels of pixels that objects cover */
    double max;       /* largest of any channel, without its sign                      */
    double range;     /* 1, 2 or 5 times a power of ten, at least max: ends of the scale */
};

enum { WINDOW_COLOUR_COUNT = 255 };

/* left, right: pixel_count times RGBA, premultiplied, finite. */
void window_difference_measure(const float *left, const float *right, size_t pixel_count,
                               struct window_difference *out);

/* 1, 2 or 5 times a power of ten that is at least value; 1e-4 at the least. */
double window_difference_range(double value);

/* sRGB for t from -1, blue, over 0, nearly white, to 1, red. */
void window_difference_colour(double t, float rgb[3]);

#endif
