// Irradiance that enters by the normal, from a table by its latitude and longitude, cubics between;
// renderer/irradiance_table.c has the same (theory.md T47).
uniform samplerBuffer irradiance_nodes;  // first of each object, or one: where its table begins, and its rows
uniform bool irradiance_is_by_object;

// Lagrange's cubic through nodes -1, 0, 1, 2 at t.
vec4 irradiance_weights(float t)
{
    vec3 from = vec3(t + 1.0, t - 1.0, t - 2.0);
    return vec4(t * from.y * from.z / -6.0, from.x * from.y * from.z / 2.0, from.x * t * from.z / -2.0,
                from.x * t * from.y / 6.0);
}

vec3 environment_irradiance(vec3 normal_ws, float object)
{
    vec2 table = texelFetch(irradiance_nodes, irradiance_is_by_object ? int(object) - 1 : 0).xy;
    int rows = int(table.y), columns = 2 * rows;
    if (rows == 0)
        return vec3(0.0);
    const float half_turns = 0.318309886;  // in a radian
    float s = length(normal_ws.xz);
    float v = atan(s, normal_ws.y) * half_turns * float(rows);
    float u = ((s > 0.0 ? atan(normal_ws.x, normal_ws.z) : 0.0) * half_turns + 1.0) * float(rows);
    int row = min(int(v), rows - 1), column = min(int(u), columns - 1);
    vec4 down = irradiance_weights(v - float(row)), around = irradiance_weights(u - float(column));
    vec3 sum = vec3(0.0);
    int at = int(table.x) + row * (columns + 3) + column;
    for (int j = 0; j < 4; j++, at += columns + 3)
        for (int i = 0; i < 4; i++)
            sum += down[j] * around[i] * texelFetch(irradiance_nodes, at + i).rgb;
    return max(sum, vec3(0.0));
}
