/* A program of somebody else's: finds the installed library, links it and calls it. */
#include <libdipole/dipole.h>

#include <stdio.h>

int main(void)
{
    const dipole_medium marble_green = { .sigma_a_per_mm = 0.0041,
                                         .sigma_s_prime_per_mm = 2.62,
                                         .eta = 1.5 };
    dipole_coefficients coefficients;
    dipole_status status;
    if (!dipole_coefficients_init(&marble_green, &coefficients, &status)) {
        fprintf(stderr, "%s\n", status.message);
        return 1;
    }
    printf("libdipole %s: marble reflects %.4f\n", dipole_version(),
           dipole_diffuse_reflectance(&coefficients));
    return 0;
}
