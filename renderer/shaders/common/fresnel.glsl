// Reflectance of a smooth surface for unpolarised light; dipole_fresnel_reflectance is the same in C.
// eta: index on the far side over index on the near side; cosine of the angle of incidence, 0 to 1.
float fresnel_reflectance(float eta, float cosine)
{
    float sine2_refracted = (1.0 - cosine * cosine) / (eta * eta);
    if (sine2_refracted >= 1.0)
        return 1.0;
    float cosine_refracted = sqrt(1.0 - sine2_refracted);
    float s = (cosine - eta * cosine_refracted) / (cosine + eta * cosine_refracted);
    float p = (eta * cosine - cosine_refracted) / (eta * cosine + cosine_refracted);
    return 0.5 * (s * s + p * p);
}
