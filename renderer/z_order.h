/* Places along the Z-order curve: cubes near in space are mostly near along it, and a cube's code without
 * its last three bits is that of the one twice as wide. */
#ifndef RENDERER_Z_ORDER_H
#define RENDERER_Z_ORDER_H

#include <stddef.h>
#include <stdint.h>

/* A sample's object, and its cube. */
struct render_z_key {
    uint64_t code;
    size_t index;
    float object;
    int count; /* of texels in a row from index on that are taken together: cell_samples.c */
};

/* Put two zeros between the low 21 bits. */
static inline uint64_t render_z_spread(uint64_t x)
{
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffff;
    x = (x | x << 16) & 0x001f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

/* Of a cube by three numbers, rounded down, kept to 0 to 2^21 - 1. */
static inline uint64_t render_z_order(const double cell[3])
{
    uint64_t code = 0;
    for (int k = 0; k < 3; k++) {
        const double above = cell[k] > 0 ? cell[k] : 0, held = above < 0x1fffff ? above : 0x1fffff;
        code |= render_z_spread((uint64_t)held) << k;
    }
    return code;
}

#endif
