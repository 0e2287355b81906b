#include "plot/color.h"

#include <math.h>

/* The inverse of CIELAB's cube root. */
static double cube(double f)
{
    static const double edge = 6.0 / 29;
    return f > edge ? f * f * f : 3 * edge * edge * (f - 4.0 / 29);
}

static unsigned char srgb_encode(double linear)
{
    linear = fmin(fmax(linear, 0), 1);
    const double encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (unsigned char)lround(255 * encoded);
}

void plot_color(double position, unsigned char rgb[3])
{
    static const double pi = 3.14159265358979323846;
    const double t = fmin(fmax(position, 0), 1);
    const double angle_rad = (270 - 130 * t) * pi / 180;
    const double l = 18 + 76 * t, a = 48 + 86 * cos(angle_rad), b = 36 + 86 * sin(angle_rad);

    /* CIELAB to CIE XYZ under D65, then linear sRGB (IEC 61966-2-1). */
    const double f = (l + 16) / 116;
    const double x = 0.95047 * cube(f + a / 500), y = cube(f), z = 1.08883 * cube(f - b / 200);
    rgb[0] = srgb_encode(3.2404542 * x - 1.5371385 * y - 0.4985314 * z);
    rgb[1] = srgb_encode(-0.9692660 * x + 1.8760108 * y + 0.0415560 * z);
    rgb[2] = srgb_encode(0.0556434 * x - 0.2040259 * y + 1.0572252 * z);
}
