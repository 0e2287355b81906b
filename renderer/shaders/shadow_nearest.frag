// Pass shadow_nearest: how far from the light the nearest is that blocks, in each block of 16 x 16 texels; 0: nothing.
uniform sampler2D shadow_depth_mm;
#ifdef HAS_AVSM_RANGES
uniform sampler2D avsm_ranges;
#endif
uniform float shadow_half_width;  // of the view at distance 1; parallel light: 0
layout(location = 0) out float nearest_mm;

void main()
{
    ivec2 first = 16 * ivec2(gl_FragCoord.xy), end = min(first + 16, textureSize(shadow_depth_mm, 0));
    float nearest = 1e30, side = float(textureSize(shadow_depth_mm, 0).x);
    for (int y = first.y; y < end.y; y++) {
        for (int x = first.x; x < end.x; x++) {
            vec2 place = (vec2(x, y) + 0.5) / side * 2.0 - 1.0;
            float away = length(vec3(place * shadow_half_width, 1.0));
            float opaque_mm = texelFetch(shadow_depth_mm, ivec2(x, y), 0).r;
            nearest = opaque_mm > 0.0 ? min(nearest, opaque_mm * away) : nearest;
#ifdef HAS_AVSM_RANGES
            vec4 range = texelFetch(avsm_ranges, ivec2(x, y), 0);
            nearest = range.w > 0.0 ? min(nearest, range.x * away) : nearest;
#endif
        }
    }
    nearest_mm = nearest < 1e30 ? max(nearest, 1e-6) : 0.0;  // the light may be within what blocks
}
