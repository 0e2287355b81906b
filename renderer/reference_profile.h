/*
 * A medium's profile as the sums of the reference look it up: all channels at once, by the square of the
 * distance, with three derivatives, and with a bound of what a sum that is cut off after them leaves out.
 * theory.md T33.
 */
#ifndef RENDERER_REFERENCE_PROFILE_H
#define RENDERER_REFERENCE_PROFILE_H

#include "renderer/media.h"

#include <stdint.h>
#include <string.h>

/* One value for each channel; the last is 0. Compilers turn it into vector code. */
typedef double render_lanes __attribute__((vector_size(32)));
enum { RENDER_LANES = 4 };

enum { RENDER_PROFILE_TERMS = 6 };

/* Between two nodes: a polynomial in the distance to the lower one, and the bound from there on. */
struct render_profile_piece {
    render_lanes terms[RENDER_PROFILE_TERMS];
    render_lanes least; /* no value at this distance or nearer is smaller, in 1/mm^2 */
    render_lanes
        bound; /* |d^4 R/dr^4| and its like in any direction, at this distance or farther, 1/mm^6 */
};

/* Of the square s of a distance. Pieces are equal parts of the powers of two in s + shift_mm2, so that the
 * bits of the sum say which one it is. */
struct render_profile {
    double shift_mm2, far_mm; /* for distances up to far_mm */
    int dropped_bits;
    uint64_t first;
    size_t count;
    struct render_profile_piece *pieces;
    double core_mm2;      /* below this square another polynomial takes over; 0: nowhere        */
    render_lanes core[3]; /* in powers of s                                                     */
    render_lanes noise;   /* what the library's own profile may err by, in 1/mm^2               */
    double max_error;     /* measured, relative, of values above the noise                      */
    bool is_singular;     /* has no value at 0: needs a core                                    */
};

/*
 * Tabulate a medium for distances from 0 (of one that is singular there from least_core_mm on) to far_mm.
 * Fails with DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_profile_create(const struct render_medium *medium, double far_mm,
                                          double least_core_mm, struct render_profile **profile_out,
                                          dipole_status *status);
void render_profile_destroy(struct render_profile *profile);

/*
 * Where the medium is singular, replace its profile within core_mm (at least as far as the table was made
 * for) by a quadratic in the square of the distance, with the same power, and value and slope at core_mm.
 * Others stay as they are.
 */
void render_profile_set_core(struct render_profile *profile, const struct render_medium *medium,
                             double core_mm);

/* The piece for a square of a distance, and how far into it. */
static inline const struct render_profile_piece *render_profile_find(const struct render_profile *profile,
                                                                     double s_mm2, double *into_out)
{
    const double place = s_mm2 + profile->shift_mm2;
    uint64_t bits;
    double start;
    memcpy(&bits, &place, sizeof bits);
    const uint64_t index = bits >> profile->dropped_bits, start_bits = index << profile->dropped_bits;
    memcpy(&start, &start_bits, sizeof start);
    *into_out = place - start;
    return &profile->pieces[index - profile->first];
}

/* The profile itself, in 1/mm^2. */
static inline void render_profile_at(const struct render_profile *profile, double s_mm2,
                                     render_lanes *value_out)
{
    if (s_mm2 < profile->core_mm2) {
        *value_out = profile->core[0] + s_mm2 * (profile->core[1] + s_mm2 * profile->core[2]);
        return;
    }
    double u;
    const render_lanes *const t = render_profile_find(profile, s_mm2, &u)->terms;
    *value_out = t[0] + u * (t[1] + u * (t[2] + u * (t[3] + u * (t[4] + u * t[5]))));
}

#endif
