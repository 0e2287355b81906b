/* Random stacks of every legal kind, seeded. */
#ifndef RANDOM_LAYERS_H
#define RANDOM_LAYERS_H

#include "check.h"
#include "libdipole/dipole.h"

enum { RANDOM_LAYERS = 10 };

/* Near 1, exactly 1, or anything. */
static inline double random_eta(struct rng *rng)
{
    const double corner = uniform(rng, 0.0, 1.0);
    if (corner < 0.15)
        return 1.0;
    if (corner < 0.2)
        return 1.0 - 1e-12;
    if (corner < 0.25)
        return 1.0 + 1e-12;
    return log_uniform(rng, 0.5, 3.0);
}

/*
 * 1 to 10 layers, each 1e-6 to 1e6 mean free paths thick, half of the stacks over an infinite base. Half of
 * them have coefficients around one scale, the others of anything from 1e-12 to 1e6 per mm; some layers
 * absorb nothing, some do not scatter. Every fourth stack has thicknesses near a mean free path, so that
 * light comes through.
 */
static inline size_t random_layers(struct rng *rng, dipole_layer layers[RANDOM_LAYERS])
{
    const size_t count = 1 + random_bits(rng) % RANDOM_LAYERS;
    const bool is_wild = random_bits(rng) % 2, is_moderate = random_bits(rng) % 4 == 0;
    const double unit = log_uniform(rng, 1e-3, 1e3);
    for (size_t i = 0; i < count; i++) {
        const double corner = uniform(rng, 0.0, 1.0);
        double sigma_s_prime = is_wild ? log_uniform(rng, 1e-12, 1e6) : unit * log_uniform(rng, 1e-2, 1e2);
        double sigma_a = is_wild ? log_uniform(rng, 1e-12, 1e6) : unit * log_uniform(rng, 1e-6, 10.0);
        if (corner < 0.05)
            sigma_s_prime = 0.0;
        else if (corner > 0.85)
            sigma_a = 0.0;
        const double depth = is_moderate ? log_uniform(rng, 0.1, 10.0) : log_uniform(rng, 1e-6, 1e6);
        layers[i] = (dipole_layer){ { sigma_a, sigma_s_prime, random_eta(rng), DIPOLE_FDR_EXACT },
                                    depth / (sigma_a + sigma_s_prime) };
    }
    if (random_bits(rng) % 2)
        layers[count - 1].thickness_mm = INFINITY;
    return count;
}

#endif
