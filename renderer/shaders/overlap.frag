// Pass overlap: radiosity += the sum of irradiance times R_d over the samples within r_max, times the area of
// one: the disc of r_max over their number (T35). Adds the radiosity of one light's view.
#include "common/medium.glsl"
uniform sampler2D overlap_sum;  // a: how many samples
uniform sampler2D position_mm;
layout(location = 0) out vec4 radiosity_w_per_mm2;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 sum = texelFetch(overlap_sum, pixel, 0);
    float object = texelFetch(position_mm, pixel, 0).w;
    float r_mm = object > 0.0 ? medium_r_max_mm(object) : 0.0;
    float area_mm2 = 3.14159265358979 * r_mm * r_mm / max(sum.a, 1.0);
    radiosity_w_per_mm2 = vec4(area_mm2 * sum.rgb, 0.0);
}
