// Pass tsm_interpolate: object to the camera's clip space, with the radiosity that was gathered at its vertices.
layout(location = 0) in vec3 position_in_mm;
uniform mat4 view_projection;
uniform sampler2D tsm_vertex_radiosity;
uniform int first_vertex;  // of the object, counted over all
centroid out vec3 radiosity_w_per_mm2;

void main()
{
    int index = first_vertex + gl_VertexID, row = textureSize(tsm_vertex_radiosity, 0).x;
    radiosity_w_per_mm2 = texelFetch(tsm_vertex_radiosity, ivec2(index % row, index / row), 0).rgb;
    gl_Position = view_projection * vec4(position_in_mm, 1.0);
}
