#include "fit/form.h"

#include <math.h>

bool fit_form_stack_create(const struct fit_form *form, int channel,
                           const double logs[FIT_COEFFICIENT_COUNT], dipole_stack **stack_out,
                           dipole_status *status)
{
    dipole_layer layers[DIPOLE_LAYER_LIMIT];
    for (size_t i = 0; i < form->layer_count; i++)
        layers[i] = form->layers[channel][i];
    dipole_layer *const sought = &layers[form->layer];
    sought->medium.sigma_a_per_mm = exp(logs[FIT_SIGMA_A]);
    sought->medium.sigma_s_prime_per_mm = exp(logs[FIT_SIGMA_S_PRIME]);
    if (form->is_thickness_sought)
        sought->thickness_mm = exp(logs[FIT_THICKNESS]);
    return dipole_stack_create(layers, form->layer_count, form->model, DIPOLE_FROM_ABOVE, stack_out,
                               status);
}

void fit_form_start(const struct fit_form *form, int channel, double logs[FIT_COEFFICIENT_COUNT])
{
    const dipole_layer *const layer = &form->layers[channel][form->layer];
    const double sigma_a = layer->medium.sigma_a_per_mm, sigma_s = layer->medium.sigma_s_prime_per_mm;
    logs[FIT_SIGMA_A] = log(fmax(sigma_a, 1e-9 * sigma_s));
    logs[FIT_SIGMA_S_PRIME] = log(fmax(sigma_s, 1e-9 * sigma_a));
    logs[FIT_THICKNESS] = isfinite(layer->thickness_mm) ? log(layer->thickness_mm) : 0;
}
