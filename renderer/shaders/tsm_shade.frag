// Pass tsm_shade: the flux of a translucent shadow map is multiplied by this.
uniform sampler2D tsm_shadow;
uniform int tsm_block_px;
layout(location = 0) out vec4 left;

void main()
{
    left = vec4(texelFetch(tsm_shadow, ivec2(gl_FragCoord.xy) / tsm_block_px, 0).rgb, 1.0);
}
