// What an object is made of: the one medium of the scene, or that of each object where they are told apart.
// object: number of the object, from 1, as it stands in w of position textures.
#ifdef HAS_OBJECT_MEDIA
uniform samplerBuffer object_media;  // two texels each: eta, exit scale, r_max; diffuse reflectance

float medium_eta(float object)
{
    return texelFetch(object_media, 2 * int(object) - 2).x;
}

float medium_exit_scale_per_sr(float object)
{
    return texelFetch(object_media, 2 * int(object) - 2).y;
}

float medium_r_max_mm(float object)
{
    return texelFetch(object_media, 2 * int(object) - 2).z;
}

vec3 medium_diffuse_reflectance(float object)
{
    return texelFetch(object_media, 2 * int(object) - 1).rgb;
}
#else
uniform float eta;
uniform float exit_scale_per_sr;  // 1 / (pi 2 int (1 - F) mu dmu)
uniform vec3 diffuse_reflectance;
uniform float r_max_mm;

float medium_eta(float object)
{
    return eta;
}

float medium_exit_scale_per_sr(float object)
{
    return exit_scale_per_sr;
}

float medium_r_max_mm(float object)
{
    return r_max_mm;
}

vec3 medium_diffuse_reflectance(float object)
{
    return diffuse_reflectance;
}
#endif
