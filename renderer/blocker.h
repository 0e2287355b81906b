/*
 * One thing in the way of light: from z0_mm to ze_mm along the ray, alpha of the light stays in it. Depths
 * are from the light, across parallel planes. Pure functions of numbers. theory.md T59 to T61.
 */
#ifndef RENDERER_BLOCKER_H
#define RENDERER_BLOCKER_H

/* alpha of a way of length_mm >= 0 (may be INFINITY) through extinction_per_mm >= 0. T59 */
double render_blocker_alpha(double extinction_per_mm, double length_mm);

/* The part of alpha, 0 to 1, that stays in the first part, 0 to 1, of the way: 1 at once where alpha is 1.
 * T59 */
double render_blocker_part(double alpha, double part);

/* Where half of what stays has stayed; z0_mm <= result <= ze_mm: the middle where alpha is 0, z0_mm where
 * it is 1. T60 */
double render_blocker_half_mm(double z0_mm, double ze_mm, double alpha);

/* The mean over the way of the light that is left, of 1 that came: 1 where alpha is 0, 0 where it is 1. T59
 */
double render_blocker_mean_left(double alpha);

/* Width on the receiver's plane of the penumbra that a blocker's edge at blocker_mm throws of a light that
 * is size_mm wide; 0 for a blocker that is not nearer than the receiver. blocker_mm > 0. T61 */
double render_penumbra_mm(double receiver_mm, double blocker_mm, double size_mm);

/* The same of parallel light that comes from a disc angle_rad wide. */
double render_penumbra_of_parallel_mm(double receiver_mm, double blocker_mm, double angle_rad);

#endif
