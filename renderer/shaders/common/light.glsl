// A light's view seen from elsewhere: irradiance and shadow at a point of a surface.
#include "common/direction.glsl"
uniform sampler2D light_view;
uniform vec4 light;                  // w = 1: position, mm; w = 0: direction toward the light
uniform vec3 light_rgb;              // directional: W/mm^2 on a facing surface; point: W/sr
uniform mat4 light_view_projection;
uniform int light_view_size_px;
uniform int light_cube_face;         // -1: the view holds the whole scene
uniform float light_texel_mm;        // width of a texel; point: at distance 1

// Face of the cube about the light that a direction falls on; each direction has exactly one.
int cube_face(vec3 d)
{
    vec3 a = abs(d);
    int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    return 2 * axis + (d[axis] < 0.0 ? 1 : 0);
}

// Irradiance on a facing surface if nothing is in the way; 0 where another view is in charge.
vec3 light_irradiance(vec3 position_ws_mm)
{
    if (light.w == 0.0)
        return light_rgb;
    vec3 d = position_ws_mm - light.xyz;
    if (light_cube_face >= 0 && cube_face(d) != light_cube_face)
        return vec3(0.0);
    return light_rgb / max(dot(d, d), 1e-24);  // a light may stand on the surface
}

// Visible part of the light, over 4 x 4 texels. A texel is in the way if its surface is nearer to the light
// and stands above the plane of the surface that is lit, or is nearer than that plane can be at the texel:
// so a surface never shades itself by being sampled coarsely, however steep it is.
float light_visibility(vec3 position_ws_mm, vec3 normal_ws)
{
    vec4 clip = light_view_projection * vec4(position_ws_mm, 1.0);
    float depth = max(clip.w, 1e-30), size_px = float(light_view_size_px);
    vec2 at = clamp((0.5 * clip.xy / depth + 0.5) * size_px - 0.5, -2.0, size_px + 2.0);
    vec3 to_light = toward(light, position_ws_mm);
    float texel_mm = light_texel_mm * depth;
    float cosine = max(dot(normal_ws, to_light), 0.05);
    float nearer_limit_mm = (2.0 + 4.0 * sqrt(1.0 - min(cosine * cosine, 1.0)) / cosine) * texel_mm;
    vec2 part = fract(at);
    ivec2 corner = ivec2(floor(at)) - 1;
    vec4 weights_x = vec4(1.0 - part.x, 1.0, 1.0, part.x), weights_y = vec4(1.0 - part.y, 1.0, 1.0, part.y);
    float visible = 0.0;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 4; i++) {
            ivec2 texel = clamp(corner + ivec2(i, j), ivec2(0), ivec2(light_view_size_px - 1));
            vec3 above = texelFetch(light_view, texel, 0).xyz - position_ws_mm;
            float nearer_mm = dot(above, to_light), height_mm = dot(above, normal_ws);
            float blocked = nearer_mm > nearer_limit_mm    ? 1.0
                            : nearer_mm > 1.5 * texel_mm ? smoothstep(0.5, 2.5, height_mm / texel_mm)
                                                           : 0.0;
            visible += (1.0 - blocked) * weights_x[i] * weights_y[j];
        }
    }
    return visible / 9.0;
}
