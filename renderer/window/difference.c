#include "renderer/window/difference.h"

#include <math.h>

double window_difference_range(double value)
{
    static const double steps[] = { 1, 2, 5, 10 };
    const double least = 1e-4;
    if (!(value > least))
        return least;
    const double power = pow(10, floor(log10(value)));
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
        /* what is as large but for rounding is not beyond */
        if (steps[i] * power >= value * (1 - 1e-12))
            return steps[i] * power;
    }
    return 10 * power;
}

void window_difference_measure(const float *left, const float *right, size_t pixel_count,
                               struct window_difference *out)
{
    double brightest = 0, largest = 0, square = 0;
    size_t count = 0;
    for (size_t i = 0; i < pixel_count; i++) {
        const float *const a = left + 4 * i, *const b = right + 4 * i;
        if (a[3] <= 0 && b[3] <= 0)
            continue;
        for (int c = 0; c < 3; c++) {
            const double difference = (double)b[c] - (double)a[c];
            brightest = fmax(brightest, (double)fmaxf(a[c], b[c]));
            largest = fmax(largest, fabs(difference));
            square += difference * difference;
        }
        count += 3;
    }
    *out = (struct window_difference){ .brightest = brightest };
    if (brightest > 0) {
        out->rmse = sqrt(square / (double)count) / brightest;
        out->max = largest / brightest;
    }
    out->range = window_difference_range(out->max);
}

void window_difference_colour(double t, float rgb[3])
{
    /* Steps of even lightness to either side. */
    static const unsigned char stops[][3] = { { 5, 48, 97 },     { 33, 102, 172 },  { 67, 147, 195 },
                                              { 146, 197, 222 }, { 242, 242, 242 }, { 244, 165, 130 },
                                              { 214, 96, 77 },   { 178, 24, 43 },   { 103, 0, 31 } };
    const int last = sizeof stops / sizeof *stops - 1;
    const double at = 0.5 * (fmin(fmax(t, -1), 1) + 1) * last;
    const int first = at < last ? (int)at : last - 1;
    for (int c = 0; c < 3; c++)
        rgb[c] = (float)((stops[first][c] + (at - first) * (stops[first + 1][c] - stops[first][c])) / 255);
}
