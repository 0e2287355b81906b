#include "renderer/passage.h"

#include <math.h>

/* Ways from one node to the next grow by a fifth, from a part of the mean free path; the nodes reach some
 * thousand of them. */
#define FIRST_SHARE 0.02
#define GROWTH 0.2

static double way_mm(const struct io_passage *passage, int node)
{
    return passage->first_mm * expm1(node * log1p(GROWTH)) / GROWTH;
}

/* Of no length: what the faces alone leave. */
#define SHORTEST_SHARE 1e-9

/* Integral of e^(-rate z) from 0 to the end. */
static double fading(double rate, double end)
{
    return fabs(rate * end) < 1e-12 ? end : -expm1(-rate * end) / rate;
}

/* The same of e^(-fall (end - z)) e^(rise z). */
static double growing(double fall, double rise, double end)
{
    const double rate = fall + rise;
    return fabs(rate * end) < 1e-6 ? end * exp(rise * end) : (exp(rise * end) - exp(-fall * end)) / rate;
}

/*
 * What a slab of the beam model leaves of light that comes at a right angle: T23 for one layer and no
 * frequency, in closed form, since a stack takes much longer to make. Not so thick that e^(sigma_tr d) is
 * infinite. sigma_tr d is not 0, but may be next to it.
 */
static double slab_left(const dipole_coefficients *k, const dipole_medium *medium, double d_mm)
{
    const double sigma_t = medium->sigma_a_per_mm + medium->sigma_s_prime_per_mm;
    const double mirrored = dipole_fresnel_reflectance(medium->eta, 1), through = exp(-sigma_t * d_mm);
    const double down = 1 / (1 - mirrored * mirrored * through * through), up = mirrored * through * down;
    const double q = fmax(k->sigma_tr_per_mm, 1e-6 / d_mm), diffusion_mm = 1 / (3 * sigma_t);
    const double slope = 1 / (2 * k->boundary_a * diffusion_mm * q);
    /* of cosh qz, and of sinh qz times the slope, z from the lit face */
    const double plus = down * fading(sigma_t - q, d_mm) + up * growing(sigma_t, q, d_mm);
    const double minus = down * fading(sigma_t + q, d_mm) + up * growing(sigma_t, -q, d_mm);
    const double source = medium->sigma_s_prime_per_mm * 0.5 * (plus + minus + slope * (plus - minus));
    const double wave = cosh(q * d_mm) + slope * sinh(q * d_mm);
    const double flux = diffusion_mm * q * (slope * cosh(q * d_mm) + sinh(q * d_mm)) / wave;
    const double scattered = source / wave / (1 + 2 * k->boundary_a * flux);
    return (1 - mirrored) * (scattered + (1 - mirrored) * through * down);
}

static double path_mm(const dipole_medium *medium)
{
    return 1 / (medium->sigma_a_per_mm + medium->sigma_s_prime_per_mm);
}

bool render_passage_fill(const struct io_material *material, struct io_passage *passage,
                         dipole_status *status)
{
    double shortest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        shortest_mm = fmin(shortest_mm, path_mm(&material->layers[c][0].medium));
    passage->first_mm = FIRST_SHARE * shortest_mm;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_medium *const medium = &material->layers[c][0].medium;
        dipole_coefficients coefficients;
        double before = 1;
        int node = 0;
        if (!dipole_coefficients_init(medium, &coefficients, status))
            return false;
        for (; node < IO_PASSAGE_NODES && before > RENDER_PASSAGE_LEAST; node++) {
            const double thickness_mm = fmax(way_mm(passage, node), SHORTEST_SHARE * path_mm(medium));
            before = fmin(slab_left(&coefficients, medium, thickness_mm), before); /* rounding aside */
            passage->depth[c][node] = -log(fmax(before, 1e-300));
        }
        passage->counts[c] = node;
    }
    return true;
}

double render_passage_left(const struct io_passage *passage, double length_mm, int channel)
{
    const double *const depth = passage->depth[channel];
    const double place = log1p(GROWTH * length_mm / passage->first_mm) / log1p(GROWTH);
    const int last = passage->counts[channel] - 1;
    const int node = place < last - 1 ? (int)place : last - 1;
    const double from_mm = way_mm(passage, node), to_mm = way_mm(passage, node + 1);
    return exp(-depth[node] - (depth[node + 1] - depth[node]) * (length_mm - from_mm) / (to_mm - from_mm));
}
