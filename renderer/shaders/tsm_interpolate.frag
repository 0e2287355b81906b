// Pass tsm_interpolate: radiosity at four points of each pixel; w: number of the object, from 1.
centroid in vec3 radiosity_w_per_mm2;
uniform float object;
layout(location = 0) out vec4 radiosity_out;

void main()
{
    radiosity_out = vec4(radiosity_w_per_mm2, object);
}
