// Pass surface: which triangle is seen, counted over all objects, from 1. Shaded once for all of a pixel's points
// that show it; where they meet it common/points.glsl tells.
uniform int first_triangle;  // of the object
layout(location = 0) out uint triangle;

void main()
{
    triangle = uint(first_triangle + gl_PrimitiveID) + 1u;
}
