// Pass surface_resolve: the first of the pixel's points that shows an object, so that even objects thinner
// than a pixel have radiosity; and its depth, 0 where no object is.
uniform sampler2DMS surface_position_mm;
uniform sampler2DMS surface_normal;
uniform vec3 eye_ws_mm, forward_ws;
uniform float near_mm, far_mm;
layout(location = 0) out vec4 position_out_mm;
layout(location = 1) out vec4 normal_out;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    position_out_mm = vec4(0.0);
    normal_out = vec4(0.0);
    for (int i = 3; i >= 0; i--) {
        vec4 point_mm = texelFetch(surface_position_mm, pixel, i);
        if (point_mm.w > 0.0) {
            position_out_mm = point_mm;
            normal_out = texelFetch(surface_normal, pixel, i);
        }
    }
    float depth = (dot(position_out_mm.xyz - eye_ws_mm, forward_ws) - near_mm) / (far_mm - near_mm);
    gl_FragDepth = position_out_mm.w > 0.0 ? clamp(depth, 1e-6, 1.0) : 0.0;
}
