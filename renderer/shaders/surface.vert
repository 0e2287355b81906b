// Pass surface: object to the camera's clip space. What is interpolated is divided by the depth here and
// multiplied by it again in the fragment shader: llvmpipe takes the depth of the pixel's middle for all its
// points, which moves positions off the surface by a part of a pixel.
layout(location = 0) in vec3 position_in_mm;
layout(location = 1) in vec3 normal_in;
uniform mat4 view_projection;
noperspective sample out vec3 position_over_depth;
noperspective sample out vec3 normal_over_depth;
noperspective sample out float one_over_depth;

void main()
{
    gl_Position = view_projection * vec4(position_in_mm, 1.0);
    one_over_depth = 1.0 / gl_Position.w;
    position_over_depth = position_in_mm * one_over_depth;
    normal_over_depth = normal_in * one_over_depth;
}
