/* Sources under one point of a surface, seen from another. docs/theory.md T30. */
#include "internal.h"
#include "lobe.h"
#include "row.h"

/*
 * The beam model's line of sources by the trapezoidal rule in log z with a step h: for a strip of
 * half-width pi/4 the error is about 2 e^(-pi^2/2h), which is set to epsilon/4. Below the first node the
 * integrand has fallen as the square of the depth, beyond the last as e^(-z/L). What is cut off and left
 * over is shared out so that the total is exact.
 */
static size_t beam_sources_init(const dipole_coefficients *c, double epsilon, double r_min_mm,
                                dipole_source *out)
{
    const double l = c->mean_free_path_mm, longest = fmax(1.0, 2.0 / 3.0 * c->boundary_a);
    const double step = 0.5 * PI * PI / log(8.0 / epsilon);
    const double first = log(fmin(r_min_mm / l, 1.0) * sqrt(0.25 * epsilon));
    const double last = log(longest * (log(4.0 / epsilon) + 4.0));
    const size_t count = (size_t)ceil((last - first) / step) + 1;
    if (2 * count > DIPOLE_SOURCE_LIMIT)
        return 0;
    const double s = c->sigma_tr_per_mm;
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        const double x = exp(first + (double)k * step), weight = dipole_row_beam_weight(c, x, step);
        sum += weight * exp(-s * x * l);
        out[2 * k] = (dipole_source){ x * l, weight };
        out[2 * k + 1] = (dipole_source){ -x * l, weight };
    }
    const double b = 2.0 / 3.0 * c->boundary_a, total = 1.0 / ((1.0 + s * l) * (1.0 + s * l * b));
    for (size_t k = 0; k < 2 * count; k++)
        out[k].weight *= 0.5 * c->alpha_prime * total / sum;
    return 2 * count;
}

size_t dipole_sources_init(const dipole_coefficients *c, dipole_model model, double epsilon,
                           double r_min_mm, dipole_source out[DIPOLE_SOURCE_LIMIT], dipole_status *status)
{
    if (model == DIPOLE_MODEL_DIPOLE) {
        out[0] = (dipole_source){ c->z_r_mm, 0.5 * c->alpha_prime };
        out[1] = (dipole_source){ -c->z_v_mm, 0.5 * c->alpha_prime };
        return 2;
    }
    if (model != DIPOLE_MODEL_BEAM) {
        dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                    "this model has no sources, expected \"dipole\" or \"beam\"");
        return 0;
    }
    if (!(epsilon >= 1e-9 && epsilon <= 0.1)) {
        dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "epsilon is %g, expected 1e-9 to 0.1", epsilon);
        return 0;
    }
    if (!(r_min_mm >= 1e-6 * c->mean_free_path_mm)) {
        dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "r_min_mm is %g, expected at least %g", r_min_mm,
                    1e-6 * c->mean_free_path_mm);
        return 0;
    }
    const size_t count = beam_sources_init(c, epsilon, r_min_mm, out);
    if (count == 0)
        dipole_fail(
            status, DIPOLE_NOT_SUPPORTED, NULL,
            "more than %d sources are needed for eta %g, r_min_mm %g, epsilon %g; expected larger ones",
            (int)DIPOLE_SOURCE_LIMIT, c->eta, r_min_mm, epsilon);
    return count;
}

/* |depth| (sigma_tr + 1/d) e^(-sigma_tr d)/d^2 with d at least |depth|: as a lobe, at the distance that
 * makes the hypotenuse d. */
static double source_lobe(const dipole_coefficients *c, double depth_mm, double d2_mm2)
{
    const double z = fabs(depth_mm), r2 = d2_mm2 - z * z;
    const double r = sqrt(r2 < 0.0 ? 0.0 : r2); /* NaN stays NaN */
    const struct dd sigma_tr = { c->sigma_tr_per_mm, c->sigma_tr_low_per_mm };
    const double distance = lobe_distance(r);
    return lobe_value((struct dd){ z, 0.0 }, sigma_tr, distance, lobe_square(distance));
}

double dipole_rd_between_per_mm2(const dipole_coefficients *c, const dipole_source *sources, size_t count,
                                 const double in_mm[3], const double in_normal[3], const double out_mm[3])
{
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        double d2 = 0.0;
        for (int axis = 0; axis < 3; axis++)
            d2 += square(out_mm[axis] - in_mm[axis] + sources[k].depth_mm * in_normal[axis]);
        sum += sources[k].weight * source_lobe(c, sources[k].depth_mm, d2);
    }
    return sum / (2.0 * PI);
}
