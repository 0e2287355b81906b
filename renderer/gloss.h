/* Light mirrored at rough surfaces, T19, and the most that it can be, T80. Pure C. */
#ifndef RENDERER_GLOSS_H
#define RENDERER_GLOSS_H

/* f cosine of GGX with the height-correlated Smith term, in 1/sr, for a reflectance of 1. Roughness 0.05 to
 * 1; cosines between the normal and the half vector, the way to the light and that to the eye, the last two
 * above 0. specular.frag has the same. */
double render_ggx_per_sr(double roughness, double cosine_half, double cosine_in, double cosine_out);

/* The most that a surface, however it lies, mirrors of what a light gives one that faces it, in 1/sr, where
 * the ways to the light and to the eye are least_rad to most_rad apart, 0 to pi. theory.md T80. */
double render_gloss_most_per_sr(double eta, double roughness, double least_rad, double most_rad);

#endif
