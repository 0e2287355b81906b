/* Colours of heat maps. */
#ifndef PLOT_COLOR_H
#define PLOT_COLOR_H

/*
 * Colour (sRGB, R, G, B) at position, 0 (dark violet) to 1 (light yellow); clamped beyond. A helix in
 * CIELAB: L* rises from 18 to 94 in proportion to position while (a*, b*) runs at constant speed along a
 * circle of radius 86 round (48, 36), from 270 to 140 degrees. So equal steps look equally large
 * everywhere (Delta E 1976 is 2.1 per hundredth), and since lightness alone gives the order, also to
 * colour-blind readers and in grey. All of it lies inside sRGB.
 */
void plot_color(double position, unsigned char rgb[3]);

#endif
