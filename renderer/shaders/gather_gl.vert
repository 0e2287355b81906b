// Pass gather_gl: a tile of eight by eight nodes of a level, drawn as a point.
layout(location = 0) in ivec4 place;  // x, y in tiles; first word; level to interpolate from, -1: none
layout(location = 1) in ivec4 bands;  // first kernel; bands that all nodes sum, and that refined nodes do
uniform ivec2 tile_counts;
flat out ivec4 place_of_tile;
flat out ivec4 bands_of_tile;

void main()
{
    gl_Position = vec4((2.0 * vec2(place.xy) + 1.0) / vec2(tile_counts) - 1.0, 0.0, 1.0);
    gl_PointSize = 8.0;
    place_of_tile = place;
    bands_of_tile = bands;
}
