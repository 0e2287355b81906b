// Irradiance that enters by the normal, as a sum of spherical harmonics about y; renderer/harmonics.c has the
// same (theory.md T51, T52). Two texels for each degree l and order m, m by m: coefficients of cos(m phi) and
// sin(m phi), and in w the factors of the recurrence.
uniform samplerBuffer harmonics;
uniform int harmonics_order;
uniform int harmonics_block;  // texels of an object, 0: all have the same

vec3 environment_irradiance(vec3 normal_ws, float object)
{
    int at = harmonics_block * (int(object) - 1);
    float cosine = normal_ws.y, sine = length(normal_ws.xz);
    vec2 turn = sine > 0.0 ? normal_ws.zx / sine : vec2(1.0, 0.0), wave = vec2(1.0, 0.0);
    float first = 1.0;
    vec3 sum = vec3(0.0);
    for (int m = 0; m <= harmonics_order; m++) {
        float p = 0.0, before = 0.0;
        for (int l = m; l <= harmonics_order; l++) {
            vec4 along = texelFetch(harmonics, at++), across = texelFetch(harmonics, at++);
            if (l == m) {
                first *= m > 0 ? along.w * sine : along.w;
                p = first;
            } else {
                float next = along.w * cosine * p - across.w * before;
                before = p;
                p = next;
            }
            sum += p * (wave.x * along.rgb + wave.y * across.rgb);
        }
        wave = vec2(wave.x * turn.x - wave.y * turn.y, wave.y * turn.x + wave.x * turn.y);
    }
    return max(sum, vec3(0.0));
}
