// Pass gather_gl: radiosity of a node: what coarser levels have summed, interpolated, and the bands of its
// own level over the samples that are near its tile (theory.md T43; records: renderer/gather_records.h).
uniform sampler2D position_mm;
uniform sampler2D levels;        // level l from row first_rows[l] on
uniform samplerBuffer sources;   // three texels each: position, flux, spread
uniform samplerBuffer kernels;   // inverse, reach squared, averaged; lost; eight pieces of three cubics
uniform usamplerBuffer words;
uniform int first_rows[6];
uniform int first_row;           // of the level that is drawn
flat in ivec4 place_of_tile;
flat in ivec4 bands_of_tile;
layout(location = 0) out vec4 radiosity_w_per_mm2;

// What the nodes of the coarser level about a pixel have summed; mask: those that count.
vec3 interpolated(ivec2 pixel, uint mask, int level)
{
    int side = 1 << level, half_side = side / 2;
    ivec2 shifted = pixel + side - half_side;
    ivec2 before = shifted / side - 1;
    vec2 part = vec2(shifted % side) / float(side);
    vec4 sum = vec4(0.0);
    for (int corner = 0; corner < 4; corner++) {
        if ((mask >> corner & 1u) == 0u)
            continue;
        ivec2 step_to = ivec2(corner & 1, corner >> 1);
        vec2 weights = mix(1.0 - part, part, vec2(step_to));
        ivec2 node = before + step_to;
        sum += weights.x * weights.y * vec4(texelFetch(levels, node + ivec2(0, first_rows[level]), 0).rgb, 1.0);
    }
    return sum.rgb / sum.w;
}

// One source: flux times the band, to the second order of its spread (render_gather_kernel_at).
vec3 source_w_per_mm2(int source, vec3 here_mm, int kernel, vec3 inverse_reach2_averaged, vec3 lost)
{
    vec4 a = texelFetch(sources, source);
    vec3 step_mm = here_mm - a.xyz;
    float distance2 = dot(step_mm, step_mm);
    if (!(distance2 <= inverse_reach2_averaged.y))
        return vec3(0.0);
    vec4 b = texelFetch(sources, source + 1), c = texelFetch(sources, source + 2);
    float u = 1.0 + distance2 * inverse_reach2_averaged.x;
    int bits = floatBitsToInt(u);
    int piece = kernel + 2 + 3 * (bits >> 22 & 7);
    float t = intBitsToFloat((bits & 0x3fffff) | 0x3f800000) - 1.25;
    float slope = inverse_reach2_averaged.x * intBitsToFloat(0x7f000000 - (bits & 0x7f800000));
    vec3 squares = vec3(b.zw, c.x), mixed = c.yzw;  // xx yy zz, yz zx xy
    float along = dot(squares, step_mm * step_mm) + 2.0 * dot(mixed, step_mm.yzx * step_mm.zxy);
    float trace = squares.x + squares.y + squares.z + inverse_reach2_averaged.z;
    float first = slope * trace, second = 4.0 * slope * slope * along;
    vec4 red = texelFetch(kernels, piece), green = texelFetch(kernels, piece + 1), blue = texelFetch(kernels, piece + 2);
    vec3 t0 = vec3(red.x, green.x, blue.x), t1 = vec3(red.y, green.y, blue.y);
    vec3 t2 = vec3(red.z, green.z, blue.z), t3 = vec3(red.w, green.w, blue.w);
    vec3 half_bend = t2 + 3.0 * t * t3;
    vec3 band = t0 + t * (t1 + t * (t2 + t * t3)) + first * (t1 + t * (half_bend + t2)) + second * half_bend;
    return vec3(a.w, b.xy) * band * (1.0 + lost * trace);
}

void main()
{
    ivec2 in_tile = ivec2(gl_FragCoord.xy) - ivec2(0, first_row) - 8 * place_of_tile.xy;
    uint node = texelFetch(words, place_of_tile.z + 8 * in_tile.y + in_tile.x).r;
    if (node == 0u)
        discard;
    int width = textureSize(position_mm, 0).x, at_pixel = int(node & 0xffffffu);
    ivec2 pixel = ivec2(at_pixel % width, at_pixel / width);
    uint mask = node >> 24 & 15u;
    vec3 here_mm = texelFetch(position_mm, pixel, 0).xyz;
    vec3 sum = vec3(0.0);
    int band_count = bands_of_tile.y;
    if (place_of_tile.w >= 0) {
        if (mask != 0u)
            sum = interpolated(pixel, mask, place_of_tile.w);
        else
            band_count = bands_of_tile.z;
    }
    int at = place_of_tile.z + 64;
    for (int band = 0; band < band_count; band++) {
        int kernel = 26 * (bands_of_tile.x + band);
        vec3 inverse_reach2_averaged = texelFetch(kernels, kernel).xyz;
        vec3 lost = texelFetch(kernels, kernel + 1).rgb;
        int end = at + 1 + int(texelFetch(words, at).r);
        for (at++; at < end; at++) {
            uint word = texelFetch(words, at).r;
            int group = 24 * int(word >> 8);
            for (uint near = word & 255u; near != 0u; near &= near - 1u)
                sum += source_w_per_mm2(group + 3 * findLSB(near), here_mm, kernel, inverse_reach2_averaged, lost);
        }
    }
    radiosity_w_per_mm2 = vec4(sum, 0.0);
}
