/* What is sought: the coefficients of one layer of a material, in one channel or three. theory.md T38. */
#ifndef FIT_FORM_H
#define FIT_FORM_H

#include "libdipole/dipole.h"

enum { FIT_CHANNEL_COUNT = 3 };

/* Coefficients of a channel, searched for by their logarithms. */
enum fit_coefficient { FIT_SIGMA_A = 0, FIT_SIGMA_S_PRIME, FIT_THICKNESS, FIT_COEFFICIENT_COUNT };

/* Everything about the material that is not sought, and where the search begins. */
struct fit_form {
    dipole_model model;
    int channel_count;         /* 1 or FIT_CHANNEL_COUNT                                          */
    size_t layer_count, layer; /* layer: the one that is sought, from the top                */
    bool is_thickness_sought;  /* of that layer, the same in all channels                    */
    dipole_layer layers[FIT_CHANNEL_COUNT][DIPOLE_LAYER_LIMIT];
};

/* The stack of a channel with the given coefficients in the layer that is sought; logs[FIT_THICKNESS] is
 * not read unless that is sought. Fails as dipole_stack_create does. */
DIPOLE_CHECKED bool fit_form_stack_create(const struct fit_form *form, int channel,
                                          const double logs[FIT_COEFFICIENT_COUNT],
                                          dipole_stack **stack_out, dipole_status *status);

/* The logarithms at which the form begins; of no absorption or scattering, those of 1e-9 of the other. */
void fit_form_start(const struct fit_form *form, int channel, double logs[FIT_COEFFICIENT_COUNT]);

#endif
