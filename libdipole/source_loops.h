/*
 * The loops that bake volumes, for the file that includes this: it defines SOURCE_LOOPS, the name of the
 * table, and is compiled for one kind of processor. The compiler turns them into vector code. Each value is
 * summed in the order of the sources, so that it depends on nothing but its own argument. theory.md T30
 */
#include "internal.h"
#include "sources.h"

/* ---- one distance, many directions ---------------------------------------------------------------- */

/*
 * Two sources at one distance D: d^2 = D^2 + z^2 + 2 z D cos, continued below z^2 as in sources.h: w (1 + b
 * (u - u^2/2)) = w + v (inward - bend v), v = z^2 u. As in row_loops.h the fast loop leaves out the second
 * double of sigma_tr and what only extreme inputs need.
 */
struct source_pair {
    double sigma_tr[2], middle[2], slope[2], floor[2], weighted_z[2];
    double inward[2], bend[2]; /* the parabola, times weighted_z, in v = z^2 - d^2 */
};

static struct source_pair source_pair_of(const dipole_sources *sources, size_t k, double distance_mm)
{
    const bool is_last = k + 1 == sources->count; /* an odd one out becomes two halves */
    struct source_pair pair;
    for (size_t i = 0; i < 2; i++) {
        const dipole_source *const source = &sources->at[is_last ? k : k + i];
        const double z = source->depth_mm;
        pair.sigma_tr[i] = source->sigma_tr_per_mm;
        pair.middle[i] = MULTIPLY_ADD(distance_mm, distance_mm, z * z);
        pair.slope[i] = 2.0 * z * distance_mm;
        pair.floor[i] = z * z;
        pair.weighted_z[i] = (is_last ? 0.5 : 1.0) / (2.0 * PI) * source->weight * fabs(z);
        pair.inward[i] = pair.weighted_z[i] * source_steepness(source->sigma_tr_per_mm * fabs(z)) / (z * z);
        pair.bend[i] = 0.5 * pair.inward[i] / (z * z);
    }
    return pair;
}

/* x up to 500, lengths of 1e-12 to 1e15 mm and no weight below 1e-20: no term is below 1e-290. */
static bool is_usual(const dipole_sources *sources, double distance_mm)
{
    bool is_good = sources->count > 0 && distance_mm >= 0.0 && distance_mm < 1e15;
    for (size_t k = 0; k < sources->count; k++) {
        const double z = fabs(sources->at[k].depth_mm), s = sources->at[k].sigma_tr_per_mm;
        is_good &= z > 1e-12 && z < 1e15 && s * (distance_mm + z) < 500.0 && sources->at[k].weight > 1e-20;
    }
    return is_good;
}

/* Both terms with one division. */
static inline double source_pair_value(const struct source_pair *pair, double cosine)
{
    const double a = MULTIPLY_ADD(cosine, pair->slope[0], pair->middle[0]),
                 b = MULTIPLY_ADD(cosine, pair->slope[1], pair->middle[1]);
    const double a2 = a < pair->floor[0] ? pair->floor[0] : a, b2 = b < pair->floor[1] ? pair->floor[1] : b;
    const double d_a = sqrt(a2), d_b = sqrt(b2), x_a = pair->sigma_tr[0] * d_a,
                 x_b = pair->sigma_tr[1] * d_b;
    const double v_a = a2 - a, v_b = b2 - b;
    const double w_a = MULTIPLY_ADD(v_a, MULTIPLY_ADD(v_a, -pair->bend[0], pair->inward[0]),
                                    pair->weighted_z[0]),
                 w_b = MULTIPLY_ADD(v_b, MULTIPLY_ADD(v_b, -pair->bend[1], pair->inward[1]),
                                    pair->weighted_z[1]);
    const double e_a = decay_times_normal(MULTIPLY_ADD(w_a, x_a, w_a), x_a),
                 e_b = decay_times_normal(MULTIPLY_ADD(w_b, x_b, w_b), x_b);
    const double a3 = d_a * a2, b3 = d_b * b2;
    return MULTIPLY_ADD(e_a, b3, e_b * a3) / (a3 * b3);
}

static double value_at(const dipole_sources *sources, double distance_mm, double cosine)
{
    double sum = 0.0;
    for (size_t k = 0; k < sources->count; k++) {
        const double z = sources->at[k].depth_mm;
        const double d2 = square(distance_mm + z * cosine) + z * z * (1.0 - cosine) * (1.0 + cosine);
        sum += sources->at[k].weight * source_lobe(&sources->at[k], d2);
    }
    return distance_mm >= 0.0 && fabs(cosine) <= 1.0 ? sum / (2.0 * PI) : NAN;
}

/* A cosine out of range makes the first two sources NaN, and so the sum. */
static void profile_begin(const struct source_pair *pair_in, const double *restrict cosines, size_t count,
                          double *restrict values)
{
    const struct source_pair pair = *pair_in;
    for (size_t i = 0; i < count; i++)
        values[i] = source_pair_value(&pair, fabs(cosines[i]) <= 1.0 ? cosines[i] : NAN);
}

static void profile_add(const struct source_pair *pair_in, const double *restrict cosines, size_t count,
                        double *restrict values)
{
    const struct source_pair pair = *pair_in;
    for (size_t i = 0; i < count; i++)
        values[i] += source_pair_value(&pair, cosines[i]);
}

static void profile(const dipole_sources *sources, double distance_mm, const double *cosines, size_t count,
                    double *values)
{
    if (!is_usual(sources, distance_mm)) {
        for (size_t i = 0; i < count; i++)
            values[i] = value_at(sources, distance_mm, cosines[i]);
        return;
    }
    for (size_t k = 0; k < sources->count; k += 2) {
        const struct source_pair pair = source_pair_of(sources, k, distance_mm);
        if (k == 0)
            profile_begin(&pair, cosines, count, values);
        else
            profile_add(&pair, cosines, count, values);
    }
}

/* ---- discs ---------------------------------------------------------------------------------------- */

/*
 * One source over a disc whose plane it is `rise` = height + z away from. Beyond where d = |z| its |z|
 * e^(-s d)/d is differenced by hand as in lobe.h: |z| (e^(-s d0)/d0 - e^(-s d)/d) = |z| e^(-s d0)/d [D/d0 +
 * 1 - e^(-s D)],  D = d - d0. Out to there, r^2 up to `hold2`, stands the parabola of sources.h, whose u
 * falls from u0 on the axis by r^2/z^2. Its mean over the disc,
 *   1 + b (u0 - u0^2/2) - b y ((1 - u0)/2 + y/6),  y = min(r^2, hold2)/z^2 <= u0,
 * loses no digit: what is taken away is at most half of what it is taken from.
 */
struct source_disc {
    double sigma_tr, rise2, floor, over_floor, hold2, start, over_start, on_axis, outward, bend, faded;
};

static struct source_disc source_disc_of(const dipole_sources *sources, size_t k, double height_mm)
{
    const double z = sources->at[k].depth_mm, depth = fabs(z), s = sources->at[k].sigma_tr_per_mm;
    const double weighted_z = sources->at[k].weight * depth;
    const double hold2 = -height_mm * (height_mm + 2.0 * z); /* z^2 - rise^2 */
    const double above = fabs(height_mm + z), rise = above > LOBE_FAR_MM ? LOBE_FAR_MM : above,
                 start = hold2 > 0.0 ? depth : rise;
    const double held = 0.5 * weighted_z * (s + 1.0 / depth) * exp(-s * depth) / (depth * depth);
    const double b = source_steepness(s * depth), u0 = hold2 > 0.0 ? hold2 / (depth * depth) : 0.0;
    return (struct source_disc){
        .sigma_tr = s,
        .rise2 = rise * rise,
        .floor = depth * depth,
        .over_floor = 1.0 / (depth * depth),
        .hold2 = hold2 > 0.0 ? hold2 : 0.0,
        .start = start,
        .over_start = 1.0 / start,
        .on_axis = held * (1.0 + b * (u0 - 0.5 * u0 * u0)),
        .outward = held * b * 0.5 * (1.0 - u0),
        .bend = held * b / 6.0,
        .faded = weighted_z * exp(-s * start),
    };
}

static inline double source_disc_within(const struct source_disc *disc, double r_mm)
{
    const double r = r_mm > LOBE_FAR_MM ? LOBE_FAR_MM : r_mm, r2 = r * r;
    const double d2 = r2 + disc->rise2, d = sqrt(d2 < disc->floor ? disc->floor : d2);
    const double inner = r2 < disc->hold2 ? r2 : disc->hold2, outer = r2 - inner;
    const double sum = d + disc->start, over = 1.0 / (d * sum), longer = outer * (d * over);
    const double share = MULTIPLY_ADD(longer, disc->over_start, decay_deficit(disc->sigma_tr * longer));
    const double y = inner * disc->over_floor;
    const double held = MULTIPLY_ADD(-y, MULTIPLY_ADD(y, disc->bend, disc->outward), disc->on_axis);
    return MULTIPLY_ADD(held, inner, disc->faded * (share * (sum * over)));
}

static void within(const dipole_sources *sources, double height_mm, const double *restrict r_mm,
                   size_t count, double *restrict values)
{
    for (size_t i = 0; i < count; i++)
        values[i] = 0.0;
    for (size_t k = 0; k < sources->count; k++) {
        const struct source_disc disc = source_disc_of(sources, k, height_mm);
        for (size_t i = 0; i < count; i++)
            values[i] += source_disc_within(&disc, r_mm[i]);
    }
    for (size_t i = 0; i < count; i++)
        values[i] = r_mm[i] >= 0.0 ? values[i] : NAN;
}

const struct source_loops SOURCE_LOOPS = { profile, within };
