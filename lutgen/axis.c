/* The axis of a splat table, and the choice of the one that needs the fewest nodes. T15. */
#include "lutgen/internal.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ((1 + x^2)^power - 1)/power, with its limit for power 0. */
static double stretched(double x, double power)
{
    const double log_w = log1p(x * x);
    return power == 0 ? log_w : expm1(power * log_w) / power;
}

double lut_axis_index(const struct lut_axis *axis, double r_mm)
{
    return (axis->node_count - 1) * (stretched(r_mm / axis->scale_mm, axis->power) /
                                     stretched(axis->r_max_mm / axis->scale_mm, axis->power));
}

double lut_axis_r_mm(const struct lut_axis *axis, double index)
{
    const double u = index / (axis->node_count - 1);
    const double t = u * stretched(axis->r_max_mm / axis->scale_mm, axis->power);
    const double log_w = axis->power == 0 ? t : log1p(axis->power * t) / axis->power;
    /* The last node is r_max itself, not what is left of it after log and exp. */
    return u == 1 ? axis->r_max_mm : fmin(axis->scale_mm * sqrt(expm1(log_w)), axis->r_max_mm);
}

/* ---- the choice --------------------------------------------------------------------------------- */

/*
 * Between two nodes a distance h apart in u, linear interpolation of g = R_d w^falloff errs by
 * h^2/8 |g_uu|/g of R_d, so an axis is as good as the largest |g_uu|/g along it is small. With y = log r,
 * L = log R_d and m = d(log w)/dy = 2x^2/w:
 *   G = log g:  G_y = L_y + falloff m,   G_yy = L_yy + falloff m_y,   m_y = 4x^2/w^2
 *   u:          u_y = w^power m/Phi,     u_yy/u_y = power m + m_y/m,  Phi = (W^power - 1)/power
 *   g_uu/g = G_uu + G_u^2 = [G_yy + G_y (G_y - u_yy/u_y)]/u_y^2
 */
struct curve {
    double r_mm[AXIS_POINTS];
    double slope[IO_CHANNEL_COUNT][AXIS_POINTS], bend[IO_CHANNEL_COUNT][AXIS_POINTS]; /* L_y, L_yy */
    double weight[IO_CHANNEL_COUNT][AXIS_POINTS]; /* R_d over what the error is relative to, 0 to 1       */
    double value[IO_CHANNEL_COUNT][AXIS_POINTS];  /* log R_d                                              */
};

static void curve_init(const struct lut_profile profiles[IO_CHANNEL_COUNT], double r_min_mm,
                       double r_max_mm, struct curve *curve)
{
    const double step = log(r_max_mm / r_min_mm) / (AXIS_POINTS - 1);
    double rd[AXIS_POINTS];
    memset(curve, 0, sizeof *curve);
    for (int j = 0; j < AXIS_POINTS; j++)
        curve->r_mm[j] = fmin(r_min_mm * exp(j * step), r_max_mm);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        lut_profile_evaluate(&profiles[c], curve->r_mm, AXIS_POINTS, rd);
        double *const value = curve->value[c];
        for (int j = 0; j < AXIS_POINTS; j++)
            value[j] = log(fmax(rd[j], DBL_MIN));
        for (int j = 1; j + 1 < AXIS_POINTS && profiles[c].stack; j++) {
            curve->slope[c][j] = (value[j + 1] - value[j - 1]) / (2 * step);
            curve->bend[c][j] = (value[j + 1] - 2 * value[j] + value[j - 1]) / (step * step);
            curve->weight[c][j] = fmin(rd[j] / profiles[c].floor_per_mm2, 1);
        }
    }
}

/* What a scale decides of the mapping at the curve's points; all powers share it. */
struct scaled {
    double log_w[AXIS_POINTS], m[AXIS_POINTS], m_y[AXIS_POINTS];
};

static void scaled_init(const struct curve *curve, double scale_mm, struct scaled *scaled)
{
    for (int j = 1; j + 1 < AXIS_POINTS; j++) {
        const double x = curve->r_mm[j] / scale_mm, x2 = x * x, w = 1 + x2;
        scaled->log_w[j] = log1p(x2);
        scaled->m[j] = 2 * x2 / w;
        scaled->m_y[j] = 2 * scaled->m[j] / w;
    }
}

/* log g of a channel falls by less than the limit of storage wherever the error is relative to R_d itself.
 */
static bool has_range(const struct curve *curve, const struct scaled *scaled, int channel, double falloff,
                      double log_range_limit)
{
    double least = DBL_MAX, most = -DBL_MAX;
    for (int j = 1; j + 1 < AXIS_POINTS; j++)
        if (curve->weight[channel][j] == 1) {
            const double log_g = curve->value[channel][j] + falloff * scaled->log_w[j];
            least = fmin(least, log_g);
            most = fmax(most, log_g);
        }
    return most - least <= log_range_limit;
}

/*
 * Largest |g_uu|/g of all channels that scatter, or some value from limit on if it is not below limit: then
 * *first is where, and the next axis is looked at there first, since most that are too bad are so there.
 */
static double bend_max(const struct curve *curve, const struct scaled *scaled, double end, double power,
                       double falloff, double limit, int *first)
{
    const double phi = stretched(end, power);
    const int begin = *first, points = AXIS_POINTS - 2;
    double worst = 0;
    for (int i = 0; i < points && worst < limit; i++) {
        const int j = 1 + (begin + i) % points;
        const double m = scaled->m[j], m_y = scaled->m_y[j];
        const double stretch = power == 0 ? 1 : exp(power * scaled->log_w[j]);
        const double over_u_y = phi / (stretch * m), u_yy_over_u_y = power * m + m_y / m;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double g_y = curve->slope[c][j] + falloff * m, g_yy = curve->bend[c][j] + falloff * m_y;
            const double bend = (g_yy + g_y * (g_y - u_yy_over_u_y)) * (over_u_y * over_u_y);
            worst = fmax(worst, curve->weight[c][j] * fabs(bend));
        }
        if (worst >= limit)
            *first = j - 1;
    }
    return worst;
}

/* A place in the search: log of scale over the shortest length, and power. */
struct place {
    double log_scale, power, bend;
};

static struct place search(const struct curve *curve, double r_max_mm, double shortest_mm, double falloff,
                           double log_range_limit)
{
    struct place best = { .log_scale = 0.5, .power = 0.2, .bend = INFINITY };
    double scale_step = 1, power_step = 0.1;
    int first = 0;
    for (int round = 0; round < 6; round++, scale_step /= 2, power_step /= 2) {
        const struct place centre = best;
        for (int i = -2; i <= 2; i++) {
            struct place place = { .log_scale = centre.log_scale + i * scale_step };
            const double scale_mm = shortest_mm * exp(place.log_scale);
            struct scaled scaled;
            scaled_init(curve, scale_mm, &scaled);
            bool is_held = true;
            for (int c = 0; c < IO_CHANNEL_COUNT && is_held; c++)
                is_held = has_range(curve, &scaled, c, falloff, log_range_limit);
            for (int j = -2; j <= 2 && is_held; j++) {
                place.power = fmax(centre.power + j * power_step, 0);
                place.bend =
                    bend_max(curve, &scaled, r_max_mm / scale_mm, place.power, falloff, best.bend, &first);
                if (place.bend < best.bend)
                    best = place;
            }
        }
    }
    return best;
}

double lut_axis_find(const struct lut_profile profiles[IO_CHANNEL_COUNT], double log_range_limit,
                     struct lut_axis *axis_out, double *falloff_out)
{
    static const double falloffs[] = { 0, 0.5, 1, 1.5 };
    double r_max_mm = 0, shortest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (profiles[c].stack) {
            r_max_mm = fmax(r_max_mm, profiles[c].r_max_mm);
            shortest_mm = fmin(shortest_mm, profiles[c].shortest_mm);
        }
    if (r_max_mm == 0) { /* nothing scatters: any axis does */
        *axis_out = (struct lut_axis){ .r_max_mm = profiles[0].r_max_mm, .scale_mm = profiles[0].r_max_mm };
        *falloff_out = 0;
        return 0;
    }
    struct curve curve;
    curve_init(profiles, 0.05 * shortest_mm, r_max_mm, &curve);
    double best = INFINITY;
    *axis_out = (struct lut_axis){ .r_max_mm = r_max_mm, .scale_mm = shortest_mm };
    *falloff_out = 1.5;
    for (size_t i = 0; i < sizeof falloffs / sizeof *falloffs; i++) {
        const struct place place = search(&curve, r_max_mm, shortest_mm, falloffs[i], log_range_limit);
        if (place.bend < best) {
            best = place.bend;
            axis_out->scale_mm = shortest_mm * exp(place.log_scale);
            axis_out->power = place.power;
            *falloff_out = falloffs[i];
        }
    }
    return best;
}
