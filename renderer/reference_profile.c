#include "renderer/reference_profile.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum {
    MANTISSA_BITS = 52,
    PARTS_BITS_MIN = 3, /* pieces to a power of two: 8 ... */
    PARTS_BITS_MAX = 9, /* ... to 512                      */
    PROBES = 5,         /* places in a piece at which its error is measured */
};

/* Asked of the table where the profile is above its noise, relative. */
static const double table_error = 1e-7;

/* Values below this part of the largest are of no account: the profile underflows. */
static const double least_part = 1e-250;

/* Less than this part of the value at a hundredth of a mean free path is noise. */
static const double noise_part = 1e-14;

/* The bound is measured in three places of each piece. */
static const double bound_margin = 1.25;

/* Near 0 a smooth profile changes over this part of a mean free path or more. */
static const double smooth_share = 0.25;

static double bits_to_place(uint64_t bits)
{
    double place;
    memcpy(&place, &bits, sizeof place);
    return place;
}

static uint64_t place_to_bits(double place)
{
    uint64_t bits;
    memcpy(&bits, &place, sizeof bits);
    return bits;
}

static double start_of(const struct render_profile *profile, size_t piece)
{
    return bits_to_place((profile->first + piece) << profile->dropped_bits);
}

static void lookup(const struct render_medium *medium, int channel, const double *s_mm2, size_t count,
                   double *values)
{
    double r_mm[16];
    for (size_t i = 0; i < count; i++)
        r_mm[i] = sqrt(fmax(s_mm2[i], 0));
    dipole_stack_profile_per_mm2(medium->stacks[channel], DIPOLE_FACE_LIT, r_mm, count, values);
}

/* ---- pieces ------------------------------------------------------------------------------------- */

/* The polynomial through values at nodes 0..1 of a piece, in powers of the distance from its start. */
static void interpolate(const double *nodes, const double *values, double width, double *terms)
{
    double newton[RENDER_PROFILE_TERMS];
    memcpy(newton, values, sizeof newton);
    for (int order = 1; order < RENDER_PROFILE_TERMS; order++) {
        for (int i = RENDER_PROFILE_TERMS - 1; i >= order; i--)
            newton[i] = (newton[i] - newton[i - 1]) / (nodes[i] - nodes[i - order]);
    }
    for (int i = 0; i < RENDER_PROFILE_TERMS; i++)
        terms[i] = 0;
    for (int i = RENDER_PROFILE_TERMS - 1; i >= 0; i--) { /* terms = terms (u - node) + newton */
        for (int k = RENDER_PROFILE_TERMS - 1; k > 0; k--)
            terms[k] = terms[k - 1] - nodes[i] * terms[k];
        terms[0] = newton[i] - nodes[i] * terms[0];
    }
    double scale = 1;
    for (int k = 0; k < RENDER_PROFILE_TERMS; k++) {
        terms[k] *= scale;
        scale /= width;
    }
}

static void fill_piece(struct render_profile *profile, const struct render_medium *medium, size_t index,
                       int channel)
{
    const double start = start_of(profile, index), width = start_of(profile, index + 1) - start;
    double nodes[RENDER_PROFILE_TERMS], s_mm2[RENDER_PROFILE_TERMS], values[RENDER_PROFILE_TERMS];
    double terms[RENDER_PROFILE_TERMS];
    for (int i = 0; i < RENDER_PROFILE_TERMS; i++) {
        nodes[i] = 0.5 - 0.5 * cos((i + 0.5) * PI / RENDER_PROFILE_TERMS);
        s_mm2[i] = start + nodes[i] * width - profile->shift_mm2;
    }
    lookup(medium, channel, s_mm2, RENDER_PROFILE_TERMS, values);
    interpolate(nodes, values, width, terms);
    for (int k = 0; k < RENDER_PROFILE_TERMS; k++)
        profile->pieces[index].terms[k][channel] = terms[k];
}

/* Largest error in a piece beyond the noise, relative to the value. */
static double piece_error(const struct render_profile *profile, const struct render_medium *medium,
                          size_t index, int channel, double least)
{
    const double start = start_of(profile, index), width = start_of(profile, index + 1) - start;
    double s_mm2[PROBES], values[PROBES], worst = 0;
    for (int i = 0; i < PROBES; i++)
        s_mm2[i] = start + width * i / (PROBES - 0.99) - profile->shift_mm2;
    lookup(medium, channel, s_mm2, PROBES, values);
    for (int i = 0; i < PROBES; i++) {
        double u;
        const render_lanes *const t = render_profile_find(profile, s_mm2[i], &u)->terms;
        double found = 0;
        for (int k = RENDER_PROFILE_TERMS - 1; k >= 0; k--)
            found = found * u + t[k][channel];
        const double error = fabs(found - values[i]) - profile->noise[channel];
        if (values[i] > least && error > 0)
            worst = fmax(worst, error / values[i]);
    }
    return worst;
}

/*
 * Largest fourth derivative of R(|x - y|) along a line that meets the piece, over all directions: with q
 * the squared cosine between line and distance 16 s^2 f'''' q^2 + 48 s f''' q + 12 f'', which is largest
 * at q = 0, 1, or between. T33.
 */
static double fourth_derivative(const render_lanes *terms, int channel, double s_mm2, double u)
{
    double t[RENDER_PROFILE_TERMS];
    for (int k = 0; k < RENDER_PROFILE_TERMS; k++)
        t[k] = terms[k][channel];
    const double f2 = 2 * t[2] + u * (6 * t[3] + u * (12 * t[4] + u * 20 * t[5]));
    const double f3 = 6 * t[3] + u * (24 * t[4] + u * 60 * t[5]);
    const double f4 = 24 * t[4] + u * 120 * t[5];
    const double a = 16 * s_mm2 * s_mm2 * f4, b = 48 * s_mm2 * f3, c = 12 * f2, q = -0.5 * b / a;
    double largest = fmax(fabs(c), fabs(a + b + c));
    if (q > 0 && q < 1)
        largest = fmax(largest, fabs(c + 0.5 * b * q));
    return largest;
}

static void fill_bounds(struct render_profile *profile)
{
    render_lanes beyond = { 0 };
    for (size_t i = profile->count; i-- > 0;) {
        struct render_profile_piece *const piece = &profile->pieces[i];
        const double start = start_of(profile, i), width = start_of(profile, i + 1) - start;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            for (int place = 0; place < 3; place++) {
                const double u = 0.5 * place * width, s_mm2 = fmax(start + u - profile->shift_mm2, 0);
                beyond[c] = fmax(beyond[c], fourth_derivative(piece->terms, c, s_mm2, u));
            }
        }
        piece->bound = bound_margin * beyond;
    }
}

/* Some profiles of the modes are not positive everywhere, so not all of them fall with distance (T29). */
static void fill_least(struct render_profile *profile)
{
    render_lanes least = { INFINITY, INFINITY, INFINITY, 0 };
    for (size_t i = 0; i < profile->count; i++) {
        const double start = start_of(profile, i), width = start_of(profile, i + 1) - start;
        for (int place = 0; place < 3; place++) {
            render_lanes value;
            render_profile_at(profile, start + 0.4999999 * place * width - profile->shift_mm2, &value);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                least[c] = fmin(least[c], fmax(value[c], 0));
        }
        profile->pieces[i].least = (1 - 1e-6) * least;
    }
}

/* Lay out so many parts to a power of two, and fill them. false: no memory. */
static bool fill(struct render_profile *profile, const struct render_medium *medium, int parts_bits,
                 double least_core_mm)
{
    profile->dropped_bits = MANTISSA_BITS - parts_bits;
    profile->first = place_to_bits(profile->shift_mm2) >> profile->dropped_bits;
    const double last = profile->shift_mm2 + profile->far_mm * profile->far_mm;
    profile->count = (size_t)((place_to_bits(last) >> profile->dropped_bits) - profile->first) + 1;
    free(profile->pieces);
    const size_t size = profile->count * sizeof *profile->pieces;
    profile->pieces = aligned_alloc(sizeof(render_lanes), size);
    if (!profile->pieces)
        return false;
    memset(profile->pieces, 0, size);
    profile->max_error = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!(medium->diffuse_reflectance[c] > 0))
            continue;
        double largest;
        lookup(medium, c, (const double[]){ least_core_mm * least_core_mm }, 1, &largest);
        for (size_t i = 0; i < profile->count; i++)
            fill_piece(profile, medium, i, c);
        for (size_t i = 0; i < profile->count; i++) {
            if (profile->is_singular &&
                start_of(profile, i) - profile->shift_mm2 < least_core_mm * least_core_mm)
                continue; /* never looked up */
            profile->max_error =
                fmax(profile->max_error, piece_error(profile, medium, i, c, least_part * largest));
        }
    }
    return true;
}

/* ---- the whole ---------------------------------------------------------------------------------- */

/* Where a profile is not known to be positive, far out: what lies below is cut off at 0. None of a
 * half-space of sources. */
static double noise_per_mm2(const struct render_medium *medium, int channel, double path_mm)
{
    const struct io_material *const material = medium->material;
    if (!io_material_has_layers(material) &&
        (material->model == DIPOLE_MODEL_DIPOLE || material->model == DIPOLE_MODEL_BEAM))
        return 0;
    const double near_mm = 0.01 * path_mm;
    double value;
    lookup(medium, channel, (const double[]){ near_mm * near_mm }, 1, &value);
    return noise_part * value;
}

bool render_profile_create(const struct render_medium *medium, double far_mm, double least_core_mm,
                           struct render_profile **profile_out, dipole_status *status)
{
    *profile_out = NULL;
    /* aligned, for its lanes */
    struct render_profile *const profile = aligned_alloc(sizeof(render_lanes), sizeof *profile);
    if (!profile)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a profile");
    *profile = (struct render_profile){ .far_mm = far_mm * (1 + 1e-6) };
    const dipole_model model = medium->material->model;
    profile->is_singular = model == DIPOLE_MODEL_BEAM || model == DIPOLE_MODEL_MODES;
    double path_mm = render_medium_shortest_path_mm(medium);
    if (!isfinite(path_mm))
        path_mm = far_mm; /* nothing scatters: all is 0 */
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            profile->noise[c] = noise_per_mm2(medium, c, path_mm);
    }
    double shift_mm = smooth_share * path_mm;
    if (profile->is_singular)
        shift_mm = fmin(shift_mm, 0.03 * least_core_mm);
    profile->shift_mm2 = exp2(floor(log2(shift_mm * shift_mm))); /* where a piece begins */
    double last_error = INFINITY;
    bool done = fill(profile, medium, PARTS_BITS_MIN, profile->is_singular ? least_core_mm : 0);
    for (int bits = PARTS_BITS_MIN + 1; done && bits <= PARTS_BITS_MAX && profile->max_error > table_error;
         bits++) {
        if (bits > PARTS_BITS_MIN + 2 && profile->max_error > 0.5 * last_error)
            break; /* a kink, where the library cuts off at 0 */
        last_error = profile->max_error;
        done = fill(profile, medium, bits, profile->is_singular ? least_core_mm : 0);
    }
    if (!done) {
        render_profile_destroy(profile);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a profile");
    }
    fill_bounds(profile);
    fill_least(profile);
    *profile_out = profile;
    return true;
}

void render_profile_destroy(struct render_profile *profile)
{
    if (!profile)
        return;
    free(profile->pieces);
    free(profile);
}

void render_profile_set_core(struct render_profile *profile, const struct render_medium *medium,
                             double core_mm)
{
    if (!profile->is_singular)
        return;
    const double radius_mm = fmin(core_mm, profile->far_mm), square_mm2 = radius_mm * radius_mm;
    double u;
    const render_lanes *const t = render_profile_find(profile, square_mm2, &u)->terms;
    profile->core_mm2 = square_mm2;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        double value = 0, slope = 0;
        for (int k = RENDER_PROFILE_TERMS - 1; k >= 0; k--) {
            slope = slope * u + value;
            value = value * u + t[k][c];
        }
        slope *= square_mm2;
        const double mean =
            dipole_stack_within(medium->stacks[c], DIPOLE_FACE_LIT, radius_mm) / (PI * square_mm2);
        const double a2 = 3 * (mean - value + 0.5 * slope), a1 = slope - 2 * a2;
        const bool scatters = medium->diffuse_reflectance[c] > 0;
        profile->core[0][c] = scatters ? value - a1 - a2 : 0;
        profile->core[1][c] = scatters ? a1 / square_mm2 : 0;
        profile->core[2][c] = scatters ? a2 / (square_mm2 * square_mm2) : 0;
    }
}
