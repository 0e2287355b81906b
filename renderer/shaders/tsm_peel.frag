// Pass tsm_peel: the depth of the nearest surface behind the last layer's.
in float depth_mm;
uniform sampler2DArray tsm_layers;
uniform int layer;
layout(location = 0) out float depth_out_mm;

void main()
{
    if (layer > 0 && depth_mm <= texelFetch(tsm_layers, ivec3(gl_FragCoord.xy, layer - 1), 0).r)
        discard;
    depth_out_mm = depth_mm;
}
