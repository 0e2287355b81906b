/*
 * A model's own profile on the rings of a measured one, with the same standard errors: what a fit of the
 * measured one must miss is then the model's, what a fit of this one misses the fit's.
 * usage: bench_fit_rings MODEL SIGMA_A SIGMA_S_PRIME ETA MEASURED.csv   (1/mm; prints CSV per light
 * entered)
 */
#include "cli/cli.h"
#include "io/material_file.h"
#include "io/profile_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_rings(const dipole_stack *stack, const struct io_profile *measured, double entered)
{
    printf("r_lo_mm,r_hi_mm,rd_per_mm2,sem\n");
    for (size_t i = 0; i < measured->count; i++) {
        const double sem = measured->sem_per_mm2 ? measured->sem_per_mm2[i] / entered : 0;
        printf("%.17g,%.17g,%.17g,%.17g\n", measured->r_lo_mm[i], measured->r_hi_mm[i],
               dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT, measured->r_lo_mm[i],
                                              measured->r_hi_mm[i]),
               sem);
    }
}

int main(int argc, char **argv)
{
    dipole_status status;
    dipole_stack *stack = NULL;
    struct io_profile *measured = NULL;
    int model = 0;
    if (argc != 6) {
        fprintf(stderr, "usage: bench_fit_rings MODEL SIGMA_A SIGMA_S_PRIME ETA MEASURED.csv\n");
        return EXIT_USAGE;
    }
    while (io_model_names[model] && strcmp(io_model_names[model], argv[1]) != 0)
        model++;
    const dipole_layer layer = { .medium = { .sigma_a_per_mm = strtod(argv[2], NULL),
                                             .sigma_s_prime_per_mm = strtod(argv[3], NULL),
                                             .eta = strtod(argv[4], NULL) },
                                 .thickness_mm = INFINITY };
    const bool is_done =
        (io_model_names[model] ||
         dipole_fail(&status, DIPOLE_BAD_VALUE, NULL, "%s is not the name of a model", argv[1])) &&
        dipole_stack_create(&layer, 1, (dipole_model)model, DIPOLE_FROM_ABOVE, &stack, &status) &&
        io_profile_read(argv[5], &measured, &status);
    if (is_done)
        print_rings(stack, measured,
                    measured->is_per_incident ? 1 - dipole_fresnel_reflectance(layer.medium.eta, 1) : 1);
    io_profile_destroy(measured);
    dipole_stack_destroy(stack);
    if (is_done)
        return EXIT_DONE;
    fprintf(stderr, "bench_fit_rings: %s\n", status.message);
    return EXIT_FAILED;
}
