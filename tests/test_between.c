#include "check.h"
#include "stacks.h"

#include "libdipole/dipole.h"

#include <string.h>

#define PI 3.14159265358979323846
#define PI_LONG 3.14159265358979323846264L

static dipole_stack *half_space(double sigma_a, double sigma_s_prime, double eta, dipole_model model)
{
    const dipole_layer base = { { sigma_a, sigma_s_prime, eta, DIPOLE_FDR_EXACT }, INFINITY };
    return stack_of(&base, 1, model);
}

static void init(const dipole_stack *stack, double epsilon, double r_min, double r_max, dipole_sources *out)
{
    dipole_status status;
    if (!dipole_sources_init(stack, epsilon, r_min, r_max, out, &status))
        fail_msg("%s", status.message);
}

/* Of a half-space with light between a tenth and a hundred mean free paths. */
static dipole_sources sources_of(double sigma_a, double eta, dipole_model model)
{
    dipole_sources sources;
    dipole_stack *const stack = half_space(sigma_a, 1.0, eta, model);
    const double l = dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
    init(stack, 0.01, 0.1 * l, fmin(100.0 * l, dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-3)),
         &sources);
    dipole_stack_destroy(stack);
    return sources;
}

static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_BETTER_DIPOLE,
                                       DIPOLE_MODEL_MODES };

/* A source for every purpose: depths and decays of any size, below and above. */
static dipole_sources random_sources(struct rng *rng, double unit)
{
    dipole_sources sources = { .count = 1 + random_bits(rng) % 7 };
    for (size_t k = 0; k < sources.count; k++)
        sources.at[k] =
            (dipole_source){ .depth_mm = (k % 2 ? -unit : unit) * log_uniform(rng, 0.1, 10.0),
                             .weight = log_uniform(rng, 1e-3, 1.0),
                             .sigma_tr_per_mm = k % 3 ? log_uniform(rng, 0.01, 3.0) / unit : 0.0 };
    return sources;
}

static const double origin[3] = { 0.0, 0.0, 0.0 }, up[3] = { 0.0, 0.0, 1.0 };

/* Oracle: over a flat surface the three-dimensional form is the profile, in any position and direction. */
static void over_a_flat_surface_it_is_the_profile(void **state)
{
    (void)state;
    struct rng rng = { .seed = 51 };
    for (int i = 0; i < 1000; i++) {
        dipole_stack *const stack =
            half_space(log_uniform(&rng, 1e-4, 10.0), log_uniform(&rng, 0.01, 10.0),
                       log_uniform(&rng, 0.7, 2.0), i % 2 ? DIPOLE_MODEL_DIPOLE : DIPOLE_MODEL_MULTIPOLE);
        const dipole_coefficients c = *dipole_stack_coefficients(stack, 0);
        dipole_sources sources;
        init(stack, 0.01, c.z_r_mm, 2.0 * c.z_r_mm, &sources);
        assert_int_equal(sources.count, 2);
        assert_true(sources.max_relative_error == 0.0 && sources.sigma_tr_per_mm == c.sigma_tr_per_mm);
        /* a normal and a direction across it, from two angles */
        const double polar = uniform(&rng, 0.0, PI), turn = uniform(&rng, 0.0, 2.0 * PI);
        const double normal[3] = { sin(polar) * cos(turn), sin(polar) * sin(turn), cos(polar) };
        const double across[3] = { cos(polar) * cos(turn), cos(polar) * sin(turn), -sin(polar) };
        const double in[3] = { uniform(&rng, -5.0, 5.0), uniform(&rng, -5.0, 5.0),
                               uniform(&rng, -5.0, 5.0) };
        const double r = c.z_r_mm * log_uniform(&rng, 0.1, 30.0);
        double out[3];
        for (int axis = 0; axis < 3; axis++)
            out[axis] = in[axis] + r * across[axis];
        /* r^2 comes out of a difference of squares, and positions of 5 mm have errors of 1e-15 mm */
        const double tolerance = 1e-12 * (1.0 + 10.0 / r) * (1.0 + c.sigma_tr_per_mm * (r + c.z_v_mm));
        assert_close(dipole_sources_between_per_mm2(&sources, in, normal, out), dipole_rd_per_mm2(&c, r),
                     tolerance, "case %d, r/l %g", i, r / c.z_r_mm);
        dipole_stack_destroy(stack);
    }
}

/* Oracle: the beam model's own profile. The short sum is as near as asked from r_min on; the total is
 * exact; it is short. */
static void short_sums_are_as_near_as_asked(void **state)
{
    (void)state;
    struct rng rng = { .seed = 52 };
    size_t longest[3] = { 0, 0, 0 };
    for (int i = 0; i < 300 / SLOWNESS; i++) {
        const double sigma_a = i % 7 == 0 ? 0.0 : log_uniform(&rng, 1e-5, 3.0);
        const double eta = i % 5 == 0 ? 1.0 : uniform(&rng, 0.7, 2.0);
        dipole_stack *const stack = half_space(sigma_a, 1.0, eta, DIPOLE_MODEL_BEAM);
        const double l = dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
        for (int k = 0; k < 3; k++) {
            const double epsilon = pow(10.0, -1 - 2 * k), r_min = 0.1 * l;
            dipole_sources sources;
            init(stack, epsilon, r_min, 100.0 * l, &sources);
            assert_true(sources.count > 0 && sources.count % 2 == 0);
            assert_true(sources.max_relative_error <= epsilon);
            longest[k] = sources.count > longest[k] ? sources.count : longest[k];
            assert_close(dipole_sources_within(&sources, 0.0, INFINITY),
                         dipole_stack_total(stack, DIPOLE_FACE_LIT), 1e-13, "case %d", i);
            for (double r = r_min; r < 100.0 * l; r *= 1.3) {
                const double out[3] = { r, 0.0, 0.0 };
                assert_close(dipole_sources_between_per_mm2(&sources, origin, up, out),
                             profile(stack, DIPOLE_FACE_LIT, r), epsilon,
                             "case %d, sigma_a %g, eta %g, r/l %g, %zu sources", i, sigma_a, eta, r / l,
                             sources.count);
            }
        }
        dipole_stack_destroy(stack);
    }
    print_message("  at most %zu, %zu, %zu sources for 0.1, 0.001, 0.00001\n", longest[0], longest[1],
                  longest[2]);
    assert_true(longest[0] <= 24);
}

/* ---- many directions ------------------------------------------------------------------------------ */

/* b of T30: how a lobe falls with (d/z)^2 where d = z. */
static long double steepness(const dipole_source *source)
{
    const long double x = fabsl((long double)source->depth_mm) *
                          ((long double)source->sigma_tr_per_mm + source->sigma_tr_low_per_mm);
    return (3.0L + x * x / (1.0L + x)) / 2.0L;
}

/* A lobe at distance d >= |z|, times its weight. */
static long double lobe(const dipole_source *source, long double d)
{
    const long double z = fabsl((long double)source->depth_mm);
    const long double s = (long double)source->sigma_tr_per_mm + source->sigma_tr_low_per_mm;
    return source->weight * z * (s + 1.0L / d) * expl(-s * d) / (d * d);
}

/* The formula of T30 with 64 bits or more. */
static long double formula(const dipole_sources *sources, double distance, double cosine)
{
    long double sum = 0.0L;
    for (size_t k = 0; k < sources->count; k++) {
        const dipole_source *const source = &sources->at[k];
        const long double z = fabsl((long double)source->depth_mm), e = distance;
        const long double beside = e + (long double)source->depth_mm * cosine;
        const long double d = sqrtl(beside * beside + z * z * (1.0L - cosine) * (1.0L + cosine));
        const long double u = 1.0L - (d / z) * (d / z);
        sum += d < z ? lobe(source, z) * (1.0L + steepness(source) * (u - u * u / 2.0L)) : lobe(source, d);
    }
    return sum / (2.0L * PI_LONG);
}

enum { DIRECTIONS = 37 };

static void directions_fill(struct rng *rng, double cosines[DIRECTIONS])
{
    for (int i = 0; i < DIRECTIONS; i++)
        cosines[i] = uniform(rng, -1.0, 1.0);
    cosines[3] = -1.0;
    cosines[11] = 1.0;
    cosines[36] = 0.0;
}

static double farthest_exponent(const dipole_sources *sources, double distance)
{
    double x = 0.0;
    for (size_t k = 0; k < sources->count; k++)
        x = fmax(x, sources->at[k].sigma_tr_per_mm * (distance + fabs(sources->at[k].depth_mm)));
    return x;
}

static void check_directions(const dipole_sources *sources, double distance, struct rng *rng)
{
    double cosines[DIRECTIONS], values[DIRECTIONS];
    directions_fill(rng, cosines);
    dipole_sources_profile_per_mm2(sources, distance, cosines, DIRECTIONS, values);
    const double x = farthest_exponent(sources, distance);
    for (int i = 0; i < DIRECTIONS; i++) {
        const double expected = (double)formula(sources, distance, cosines[i]);
        if (fabs(values[i] - expected) > 1e-305)
            assert_close(values[i], expected, 3e-15 * (8.0 + x),
                         "distance %g, cosine %g, %zu sources, x %g", distance, cosines[i], sources->count,
                         x);
    }
}

/* Oracle: the formula with more digits. From next to the point to where nothing arrives, for lengths from
 * 1e-45 to 1e45 mm: the fast loop, and what it leaves to the slow one. */
static void many_directions_are_the_formula(void **state)
{
    (void)state;
    struct rng rng = { .seed = 54 };
    for (int i = 0; i < 2000 / SLOWNESS; i++) {
        const double unit = i % 4 ? 1.0 : log_uniform(&rng, 1e-45, 1e45);
        const dipole_sources sources = random_sources(&rng, unit);
        check_directions(&sources, unit * log_uniform(&rng, 1e-3, 1e3), &rng);
        check_directions(&sources, 0.0, &rng);
        dipole_sources dark = sources;
        for (size_t k = 0; k < dark.count; k++)
            dark.at[k].sigma_tr_per_mm *= log_uniform(&rng, 1.0, 50.0);
        check_directions(&dark, unit * log_uniform(&rng, 0.1, 20.0), &rng);
    }
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        const dipole_sources sources = sources_of(0.03, 1.3, models[m]);
        for (double distance = 1e-3; distance < 1e3; distance *= 1.5)
            check_directions(&sources, distance, &rng);
    }
}

/* Oracle: one at a time from positions. And bit for bit, whatever else is asked for. */
static void many_directions_are_each_alone(void **state)
{
    (void)state;
    struct rng rng = { .seed = 55 };
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        const dipole_sources sources = sources_of(0.03, 1.3, models[m]);
        for (double distance = 1e-3; distance < 1e3; distance *= 2.0) {
            double cosines[DIRECTIONS], values[DIRECTIONS], part[DIRECTIONS];
            directions_fill(&rng, cosines);
            dipole_sources_profile_per_mm2(&sources, distance, cosines, DIRECTIONS, values);
            for (int i = 0; i < DIRECTIONS; i++) {
                const int count = 1 + (int)(random_bits(&rng) % (uint64_t)(DIRECTIONS - i));
                dipole_sources_profile_per_mm2(&sources, distance, cosines + i, (size_t)count, part);
                assert_memory_equal(part, values + i, (size_t)count * sizeof part[0]);
                const double sine = sqrt((1.0 - cosines[i]) * (1.0 + cosines[i]));
                const double out[3] = { distance * sine, 0.0, distance * cosines[i] };
                assert_close(dipole_sources_between_per_mm2(&sources, origin, up, out), values[i],
                             1e-13 * (8.0 + farthest_exponent(&sources, distance)),
                             "distance %g, cosine %g", distance, cosines[i]);
            }
        }
    }
}

/* ---- discs ---------------------------------------------------------------------------------------- */

/* Power through the ring from r_lo to r_hi: Gauss's rule with five points on 40 parts, in log r. */
static double ring_power(const dipole_sources *sources, double height, double r_lo, double r_hi)
{
    static const double gauss[5][2] = { { 0.0, 0.28444444444444444444 },
                                        { -0.53846931010568309104, 0.23931433524968323402 },
                                        { 0.53846931010568309104, 0.23931433524968323402 },
                                        { -0.90617984593866399280, 0.11846344252809454376 },
                                        { 0.90617984593866399280, 0.11846344252809454376 } };
    const int parts = 40;
    const double step = log(r_hi / r_lo) / parts;
    double sum = 0.0;
    for (int i = 0; i < parts; i++)
        for (int j = 0; j < 5; j++) {
            const double r = r_lo * exp(step * (i + 0.5 + 0.5 * gauss[j][0]));
            const double out[3] = { r, 0.0, height };
            sum += 2.0 * PI * r * r * step * gauss[j][1] *
                   dipole_sources_between_per_mm2(sources, origin, up, out);
        }
    return sum;
}

/* Edges of the discs in which sources are nearer than their depth, where the integrand's curvature jumps;
 * ascending. */
static size_t edges_find(const dipole_sources *sources, double height, double edges[DIPOLE_SOURCE_LIMIT])
{
    size_t count = 0;
    for (size_t k = 0; k < sources->count; k++) {
        const double z = sources->at[k].depth_mm, r2 = -height * (height + 2.0 * z);
        if (r2 <= 0.0)
            continue;
        size_t place = count++;
        for (; place > 0 && edges[place - 1] > sqrt(r2); place--)
            edges[place] = edges[place - 1];
        edges[place] = sqrt(r2);
    }
    return count;
}

/* Oracle: the integral of the values between points, in parts between the edges; the disc within the first
 * radius as flat. Heights above, in and below the surface, past the sources and in their plane. */
static void discs_are_the_integral(void **state)
{
    (void)state;
    struct rng rng = { .seed = 56 };
    for (int i = 0; i < 300 / SLOWNESS; i++) {
        const dipole_sources sources =
            i % 10 ? random_sources(&rng, 1.0) : sources_of(0.03, 1.3, models[i / 10 % 4]);
        const double height = i % 5 == 0   ? 0.0
                              : i % 5 == 1 ? -sources.at[0].depth_mm
                                           : (i % 2 ? -1.0 : 1.0) * log_uniform(&rng, 0.01, 30.0);
        double edges[DIPOLE_SOURCE_LIMIT], lo = 1e-7;
        const size_t edge_count = edges_find(&sources, height, edges);
        const double on_axis[3] = { 0.0, 0.0, height };
        double sum = PI * lo * lo * dipole_sources_between_per_mm2(&sources, origin, up, on_axis);
        size_t next = 0;
        for (double r = 0.01; r < 1000.0; r *= 3.0) {
            for (; next < edge_count && edges[next] < r; next++) {
                if (edges[next] <= lo * 1.0000001)
                    continue;
                sum += ring_power(&sources, height, lo, edges[next]);
                lo = edges[next];
            }
            sum += ring_power(&sources, height, lo, r);
            lo = r;
            assert_close(dipole_sources_within(&sources, height, r), sum, 1e-8,
                         "case %d, height %g, r %g, %zu sources", i, height, r, sources.count);
        }
        /* what is left: |z|/d without absorption, d at least 900 mm */
        assert_close(dipole_sources_within(&sources, height, INFINITY), sum, 0.1, "case %d", i);
        assert_close(dipole_sources_within(&sources, height, 1e9 * lo),
                     dipole_sources_within(&sources, height, INFINITY), 1e-8, "case %d", i);
    }
}

/* Power through a disc by the closed form of T30, with 64 bits or more; held: each lobe constant nearer to
 * its source than its depth, which is what the continuation is compared with. */
static long double disc_formula(const dipole_sources *sources, double height, double radius, bool is_held)
{
    long double sum = 0.0L;
    for (size_t k = 0; k < sources->count; k++) {
        const dipole_source *const source = &sources->at[k];
        const long double z = fabsl((long double)source->depth_mm), h = height, r = radius;
        const long double s = (long double)source->sigma_tr_per_mm + source->sigma_tr_low_per_mm;
        const long double edge2 = fmaxl(-h * (h + 2.0L * source->depth_mm), 0.0L);
        const long double inner = fminl(r * r, edge2), rise = fabsl(h + source->depth_mm);
        const long double u0 = edge2 / (z * z), u1 = u0 - inner / (z * z);
        const long double mean = (u0 + u1) / 2.0L - (u0 * u0 + u0 * u1 + u1 * u1) / 6.0L;
        const long double start = edge2 > 0.0L ? z : rise,
                          d = edge2 > 0.0L ? sqrtl(z * z + r * r - inner) : hypotl(r, rise);
        sum += lobe(source, z) * inner / 2.0L * (1.0L + (is_held ? 0.0L : steepness(source) * mean));
        sum += source->weight * z * (expl(-s * start) / start - expl(-s * d) / d);
    }
    return sum;
}

/* Oracles: nearer to a source than its depth the integrand is a quadratic in r^2, which Gauss's rule with
 * three points integrates exactly from the values between points. And the closed form with more digits, on
 * past the edge. Sources one at a time, discs of all sizes through all of that space. */
static void discs_next_to_a_source_are_the_integral(void **state)
{
    (void)state;
    struct rng rng = { .seed = 59 };
    for (int i = 0; i < 3000; i++) {
        const double unit = i % 3 ? 1.0 : log_uniform(&rng, 1e-40, 1e40);
        dipole_sources source = random_sources(&rng, unit);
        source.count = 1;
        source.at[0].sigma_tr_per_mm = i % 5 ? log_uniform(&rng, 1e-3, 100.0) / unit : 0.0;
        const double z = source.at[0].depth_mm, x = source.at[0].sigma_tr_per_mm * fabs(z);
        /* from the source's own plane to within 1e-12 of where the region ends, both ways */
        const double part = i % 7 ? log_uniform(&rng, 1e-12, 1.0) : 1.0;
        const double height = i % 2 ? -z * part : -z * (2.0 - part);
        const double edge = sqrt(-height * (height + 2.0 * z)), r = edge * log_uniform(&rng, 1e-6, 1.0);
        double sum = 0.0;
        for (int j = -1; j <= 1; j++) {
            const double r2 = r * r * (0.5 + 0.5 * j * 0.77459666924148337704);
            const double out[3] = { sqrt(r2), 0.0, height };
            sum += PI * r * r * (j == 0 ? 8.0 : 5.0) / 18.0 *
                   dipole_sources_between_per_mm2(&source, origin, up, out);
        }
        if (sum < 1e-290)
            continue; /* nothing left */
        const double tolerance = 3e-15 * (8.0 + x);
        assert_close(dipole_sources_within(&source, height, r), sum, tolerance,
                     "case %d, x %g, height/z %g, r/edge %g", i, x, height / z, r / edge);
        if (part < 1e-3)
            continue; /* the difference of two exponentials keeps too few digits */
        const double radii[] = {
            1e-3 * r,       r,           edge, edge * (1.0 + 1e-15), edge * (1.0 + 1e-6), 1.5 * edge,
            edge + fabs(z), 100.0 * edge
        };
        for (size_t j = 0; j < sizeof radii / sizeof radii[0]; j++)
            assert_close(dipole_sources_within(&source, height, radii[j]),
                         (double)disc_formula(&source, height, radii[j], false), tolerance,
                         "case %d, x %g, height/z %g, r/edge %g", i, x, height / z, radii[j] / edge);
    }
}

/* Oracles: at height 0 the closed form of the dipole; a small disc is flat, so no digit is lost; a disc
 * alone is bit for bit a disc among others. */
static void discs_lose_no_digits(void **state)
{
    (void)state;
    struct rng rng = { .seed = 57 };
    for (int i = 0; i < 300; i++) {
        const double unit = i % 2 ? 1.0 : log_uniform(&rng, 1e-40, 1e40);
        dipole_stack *const stack = half_space(log_uniform(&rng, 1e-4, 3.0) / unit, 1.0 / unit,
                                               uniform(&rng, 0.7, 2.0), DIPOLE_MODEL_DIPOLE);
        const dipole_coefficients *const c = dipole_stack_coefficients(stack, 0);
        dipole_sources sources;
        init(stack, 0.01, c->z_r_mm, 2.0 * c->z_r_mm, &sources);
        for (double r = 1e-12 * unit; r < 1e12 * unit; r *= 7.0) {
            const double x = c->sigma_tr_per_mm * (r + c->z_v_mm);
            assert_close(dipole_sources_within(&sources, 0.0, r), dipole_reflectance_within(c, r),
                         3e-15 * (8.0 + fmin(x, 700.0)), "case %d, r/unit %g", i, r / unit);
        }
        dipole_stack_destroy(stack);

        const dipole_sources any = random_sources(&rng, unit);
        const double height = unit * uniform(&rng, -5.0, 5.0), on_axis[3] = { 0.0, 0.0, height };
        const double flat = dipole_sources_between_per_mm2(&any, origin, up, on_axis);
        double radii[DIRECTIONS], values[DIRECTIONS];
        for (int j = 0; j < DIRECTIONS; j++)
            radii[j] = unit * 1e-40 * pow(10.0, j);
        dipole_sources_within_many(&any, height, radii, DIRECTIONS, values);
        for (int j = 0; j < DIRECTIONS; j++) {
            assert_true(dipole_sources_within(&any, height, radii[j]) == values[j]);
            /* where the disc is flat to rounding, unless next to a source */
            if (radii[j] < 1e-10 * unit)
                assert_close(values[j], PI * radii[j] * radii[j] * flat,
                             3e-14 * (8.0 + farthest_exponent(&any, fabs(height))), "case %d, r/unit %g", i,
                             radii[j] / unit);
        }
    }
}

/* ---- shapes that are thin ------------------------------------------------------------------------- */

/* Oracle: dipole.h, nothing jumps next to a source: where d = |z| the value has one slope from both sides,
 * -2 b/|z| times itself, and at the source it is level and (1 + b/2) times that value. */
static void lobes_go_on_smoothly_next_to_their_source(void **state)
{
    (void)state;
    struct rng rng = { .seed = 60 };
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        const dipole_sources sources = sources_of(0.3, 1.3, models[m]);
        for (size_t k = 0; k < sources.count; k++) {
            const dipole_sources one = { .count = 1, .at = { sources.at[k] } };
            const double z = fabs(one.at[0].depth_mm), b = (double)steepness(&one.at[0]);
            const double polar = uniform(&rng, 0.0, PI), step = 1e-6;
            const double d[6] = { 1.0 - step, 1.0 - 1e-15, 1.0, 1.0 + 1e-15, 1.0 + step, 1e-4 };
            double value[6];
            for (int i = 0; i < 6; i++) {
                const double out[3] = { z * d[i] * sin(polar), 0.0,
                                        z * d[i] * cos(polar) - one.at[0].depth_mm };
                value[i] = dipole_sources_between_per_mm2(&one, origin, up, out);
            }
            const double top = (double)(lobe(&one.at[0], (long double)z) / (2.0L * PI_LONG));
            const double rounding = 1e-14 * (2.0 + b);
            assert_close(value[1], top, rounding, "inside");
            assert_close(value[2], top, rounding, "at the edge");
            assert_close(value[3], top, rounding, "outside");
            /* a quotient is off by half a step times the curvature */
            assert_close((value[2] - value[0]) / step, -2.0 * b * top, step * (3.0 + 2.0 * b),
                         "from inside");
            assert_close((value[4] - value[2]) / step, -2.0 * b * top, step * (3.0 + 2.0 * b),
                         "from outside");
            const double source[3] = { 0.0, 0.0, -one.at[0].depth_mm };
            const double highest = dipole_sources_between_per_mm2(&one, origin, up, source);
            assert_close(highest, top * (1.0 + 0.5 * b), 1e-14 * (2.0 + b), "at the source");
            assert_close(value[5], highest, 1e-14 * (2.0 + b), "next to it"); /* falls as d^4 */
        }
    }
}

/* Oracle: nothing is infinite, NaN or negative: depths of any size, no absorption to any, in, next to and
 * far from the source. */
static void any_size_is_finite(void **state)
{
    (void)state;
    static const double depths[] = { 1e-61, 1e-50, 1e-12, 1.0, 1e15, 1e50 },
                        exponents[] = { 0.0, 1e-100, 1.0, 499.0, 744.0, 1400.0, 1e100, 1e200 },
                        places[] = { 0.0,  1e-100, 1e-12, 0.5,  1.0 - 1e-16, 1.0,   1.0 + 3e-16,
                                     1.99, 2.0,    2.01,  1e12, 1e100,       1e250, (double)INFINITY };
    static const double cosines[] = { -1.0, -0.9999999, -0.5, 0.0, 0.5, 1.0 };
    const size_t place_count = sizeof places / sizeof places[0];
    for (size_t i = 0; i < sizeof depths / sizeof depths[0] * 2; i++)
        for (size_t j = 0; j < sizeof exponents / sizeof exponents[0]; j++) {
            const double z = depths[i / 2];
            const dipole_sources one = { .count = 1,
                                         .at = { { i % 2 ? -z : z, 0.5, exponents[j] / z, 0.0 } } };
            for (size_t p = 0; p < place_count; p++) {
                double values[6], radii[14];
                dipole_sources_profile_per_mm2(&one, z * places[p], cosines, 6, values);
                for (int k = 0; k < 6; k++)
                    assert_true(isfinite(values[k]) && values[k] >= 0.0);
                for (size_t q = 0; q < place_count; q++)
                    radii[q] = z * places[q];
                for (int side = -1; side <= 1; side += 2) {
                    double discs[14];
                    dipole_sources_within_many(&one, side * z * places[p], radii, place_count, discs);
                    for (size_t q = 0; q < place_count; q++)
                        assert_true(isfinite(discs[q]) && discs[q] >= 0.0);
                }
            }
        }
}

/* Oracle: the continuation's own integral. Where a sheet ends in the source's plane, without absorption
 * (b = 3/2), 1/2 (1 + b/3) leaves within r = z and 1 beyond. And wherever the far face lies, what arrives
 * is finite and falls with the thickness beyond the source. */
static void sheets_thinner_than_the_source_is_deep_stay_finite(void **state)
{
    (void)state;
    const dipole_sources real = { .count = 1, .at = { { .depth_mm = 1.0, .weight = 1.0 } } };
    assert_close(dipole_sources_within(&real, -1.0, INFINITY), 1.75, 1e-14, "the sheet ends at the source");
    struct rng rng = { .seed = 53 };
    for (int i = 0; i < 100; i++) {
        const double sigma_a = log_uniform(&rng, 1e-4, 1.0), l = 1.0 / (1.0 + sigma_a);
        const dipole_sources sources = sources_of(sigma_a, uniform(&rng, 1.0, 2.0), models[i % 4]);
        double last = 2.0;
        for (double t = 1e-6; t < 100.0; t *= 1.5) {
            const double through = dipole_sources_within(&sources, -t * l, INFINITY);
            assert_true(isfinite(through) && through >= 0.0 && through < 2.0);
            if (t > 3.0 && i % 4 < 2)
                assert_true(through < last);
            last = through;
        }
    }
    /* next to a source and in it */
    dipole_stack *const skin = half_space(0.032, 0.74, 1.3, DIPOLE_MODEL_DIPOLE);
    const dipole_coefficients *const c = dipole_stack_coefficients(skin, 0);
    dipole_sources sources;
    init(skin, 0.01, 1.0, 2.0, &sources);
    const double in_source[3] = { 0.0, 0.0, -c->z_r_mm };
    const double at_source = dipole_sources_between_per_mm2(&sources, origin, up, in_source);
    assert_true(isfinite(at_source) && at_source < 2.0 * dipole_rd_per_mm2(c, 0.0));
    dipole_stack_destroy(skin);
}

/* Oracle: a source sends nothing negative anywhere, and nowhere more than (1 + b/2) times what it sends to
 * the point of entry. */
static void nothing_exceeds_what_a_source_sends_to_itself(void **state)
{
    (void)state;
    struct rng rng = { .seed = 58 };
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        const dipole_sources sources = sources_of(0.03, 1.3, models[m]);
        for (int i = 0; i < 1000; i++) {
            const dipole_sources one = { .count = 1,
                                         .at = { sources.at[random_bits(&rng) % sources.count] } };
            const double top = dipole_sources_between_per_mm2(&one, origin, up, origin) *
                               (1.0 + 0.5 * (double)steepness(&one.at[0]));
            double cosines[DIRECTIONS], values[DIRECTIONS];
            directions_fill(&rng, cosines);
            dipole_sources_profile_per_mm2(&one, log_uniform(&rng, 1e-3, 100.0), cosines, DIRECTIONS,
                                           values);
            for (int j = 0; j < DIRECTIONS; j++)
                assert_true(values[j] >= 0.0 && values[j] <= top * (1.0 + 1e-12));
        }
    }
}

/* Oracle: the table in theory.md T30 (white, index 1.5): power through the far face of sheets, that of the
 * dipole with its sources held at their depth, and the beam model's own transmittance of that slab. */
static void thin_sheets_send_through_what_is_stated(void **state)
{
    (void)state;
    static const struct {
        double thickness, held, through[3], slab;
    } rows[] = {
        { 0.25, 0.92, { 0.95, 0.84, 0.83 }, 0.11 }, { 0.5, 0.98, { 1.06, 0.86, 0.81 }, 0.20 },
        { 1.0, 1.01, { 1.14, 0.86, 0.80 }, 0.31 },  { 2.0, 0.71, { 0.71, 0.81, 0.78 }, 0.39 },
        { 5.0, 0.25, { 0.25, 0.57, 0.55 }, 0.34 },  { 20.0, 0.04, { 0.04, 0.08, 0.07 }, 0.11 },
    };
    const dipole_sources sources[3] = { sources_of(0.001, 1.5, DIPOLE_MODEL_DIPOLE),
                                        sources_of(0.001, 1.5, DIPOLE_MODEL_BEAM),
                                        sources_of(0.001, 1.5, DIPOLE_MODEL_MODES) };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const double t = rows[i].thickness / 1.001;
        const dipole_layer sheet = { { 0.001, 1.0, 1.5, DIPOLE_FDR_EXACT }, t };
        dipole_stack *const stack = stack_of(&sheet, 1, DIPOLE_MODEL_BEAM);
        const double slab = dipole_stack_total(stack, DIPOLE_FACE_FAR);
        const double held = (double)disc_formula(&sources[0], -t, 1e12, true);
        bool is_as_stated = fabs(slab - rows[i].slab) < 0.006 && fabs(held - rows[i].held) < 0.006;
        double through[3];
        for (int m = 0; m < 3; m++) {
            through[m] = dipole_sources_within(&sources[m], -t, INFINITY);
            is_as_stated &= fabs(through[m] - rows[i].through[m]) < 0.006;
        }
        if (!is_as_stated)
            fail_msg("%g mean free paths: held %.3f, dipole %.3f, beam %.3f, modes %.3f, slab %.3f",
                     rows[i].thickness, held, through[0], through[1], through[2], slab);
        dipole_stack_destroy(stack);
    }
}

/* ---- what is refused ------------------------------------------------------------------------------ */

/* Oracle: the messages that dipole.h promises. */
static void bad_requests_are_refused(void **state)
{
    (void)state;
    const struct {
        dipole_model model;
        double epsilon, r_min_mm, r_max_mm;
        dipole_code code;
        const char *message;
    } rows[] = {
        { DIPOLE_MODEL_BEAM, 1e-10, 1.0, 2.0, DIPOLE_BAD_VALUE, "epsilon is 1e-10, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, (double)NAN, 1.0, 2.0, DIPOLE_BAD_VALUE,
          "epsilon is nan, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_MODES, 0.11, 1.0, 2.0, DIPOLE_BAD_VALUE, "epsilon is 0.11, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_DIPOLE, INFINITY, 1.0, 2.0, DIPOLE_BAD_VALUE,
          "epsilon is inf, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, -0.01, 1.0, 2.0, DIPOLE_BAD_VALUE, "epsilon is -0.01, expected 1e-9 to 0.1" },
        { DIPOLE_MODEL_BEAM, 0.01, (double)NAN, 2.0, DIPOLE_BAD_VALUE,
          "r_min_mm is nan, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_MODES, 0.01, -1.0, 2.0, DIPOLE_BAD_VALUE,
          "r_min_mm is -1, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_BEAM, 0.01, 0.0, 2.0, DIPOLE_BAD_VALUE,
          "r_min_mm is 0, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_BEAM, 0.01, INFINITY, INFINITY, DIPOLE_BAD_VALUE,
          "r_min_mm is inf, expected at least 1.29534e-06" },
        { DIPOLE_MODEL_DIPOLE, 0.01, 1.0, 1.0, DIPOLE_BAD_VALUE,
          "r_max_mm is 1, expected more than r_min_mm, 1, and at most 1e+06 times it" },
        { DIPOLE_MODEL_MODES, 0.01, 1.0, (double)NAN, DIPOLE_BAD_VALUE,
          "r_max_mm is nan, expected more than r_min_mm, 1, and at most 1e+06 times it" },
        { DIPOLE_MODEL_BEAM, 0.01, 1.0, 1.1e6, DIPOLE_BAD_VALUE,
          "r_max_mm is 1.1e+06, expected more than r_min_mm, 1, and at most 1e+06 times it" },
        { DIPOLE_MODEL_BEAM, 1e-9, 1e-5, 1.0, DIPOLE_NOT_SUPPORTED,
          "more than 128 sources are needed for eta 1.3, r_min_mm 1e-05, epsilon 1e-09; expected larger "
          "ones" },
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        dipole_stack *const stack = half_space(0.032, 0.74, 1.3, rows[i].model);
        dipole_sources sources;
        dipole_status status = { 0 };
        assert_false(dipole_sources_init(stack, rows[i].epsilon, rows[i].r_min_mm, rows[i].r_max_mm,
                                         &sources, &status));
        assert_int_equal(status.code, rows[i].code);
        assert_string_equal(status.message, rows[i].message);
        assert_false(dipole_sources_init(stack, rows[i].epsilon, rows[i].r_min_mm, rows[i].r_max_mm,
                                         &sources, NULL));
        dipole_stack_destroy(stack);
    }
}

/* Oracle: dipole.h, NaN where a coordinate is, next to a source as well; and nothing
 * arrives at the end of the world. */
static void bad_places_are_nan(void **state)
{
    (void)state;
    for (size_t m = 0; m < sizeof models / sizeof models[0]; m++) {
        const dipole_sources sources = sources_of(0.04, 1.3, models[m]);
        for (int k = 0; k < 9; k++) {
            double at[3][3] = { { 0.0, 0.0, 0.0 }, { 0.0, 0.0, 1.0 }, { 1.0, 0.0, 0.0 } };
            at[k / 3][k % 3] = (double)NAN;
            assert_true(isnan(dipole_sources_between_per_mm2(&sources, at[0], at[1], at[2])));
        }
        const double far[3] = { INFINITY, 0.0, 0.0 };
        assert_true(dipole_sources_between_per_mm2(&sources, origin, up, far) == 0.0);

        const double distances[] = { 1.0, (double)NAN, -1.0, 1e20, INFINITY };
        const double cosines[] = { 0.5, (double)NAN, 1.0000001, -1.0000001, INFINITY, -1.0 };
        for (size_t i = 0; i < sizeof distances / sizeof distances[0]; i++) {
            double values[6];
            dipole_sources_profile_per_mm2(&sources, distances[i], cosines, 6, values);
            for (int j = 0; j < 6; j++) {
                const bool is_good = distances[i] >= 0.0 && fabs(cosines[j]) <= 1.0;
                assert_true(is_good ? values[j] >= 0.0 && isfinite(values[j]) : isnan(values[j]));
                assert_true(!(distances[i] > 1e19 && is_good) || values[j] < 1e-50);
            }
        }
        assert_true(isnan(dipole_sources_within(&sources, 0.0, -1.0)));
        assert_true(isnan(dipole_sources_within(&sources, 0.0, (double)NAN)));
        assert_true(isnan(dipole_sources_within(&sources, (double)NAN, 1.0)));
        assert_true(dipole_sources_within(&sources, -1.0, 0.0) == 0.0);
        assert_true(dipole_sources_within(&sources, 1e300, 1.0) < 1e-250);
        assert_true(dipole_sources_within(&sources, -INFINITY, 1.0) < 1e-250);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(over_a_flat_surface_it_is_the_profile),
        cmocka_unit_test(short_sums_are_as_near_as_asked),
        cmocka_unit_test(many_directions_are_the_formula),
        cmocka_unit_test(many_directions_are_each_alone),
        cmocka_unit_test(discs_are_the_integral),
        cmocka_unit_test(discs_next_to_a_source_are_the_integral),
        cmocka_unit_test(discs_lose_no_digits),
        cmocka_unit_test(lobes_go_on_smoothly_next_to_their_source),
        cmocka_unit_test(any_size_is_finite),
        cmocka_unit_test(sheets_thinner_than_the_source_is_deep_stay_finite),
        cmocka_unit_test(nothing_exceeds_what_a_source_sends_to_itself),
        cmocka_unit_test(thin_sheets_send_through_what_is_stated),
        cmocka_unit_test(bad_requests_are_refused),
        cmocka_unit_test(bad_places_are_nan),
    };
    return cmocka_run_group_tests_name("between", tests, NULL, NULL);
}
