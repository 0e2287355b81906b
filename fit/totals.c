#include "fit/totals.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double unstated_error = 0.01;
/* Of totals against adding-doubling, slabs of half a mean free path and more, relative. */
static const double model_errors[] = {
    [DIPOLE_MODEL_DIPOLE] = 0.03, [DIPOLE_MODEL_BETTER_DIPOLE] = 0.03, [DIPOLE_MODEL_MULTIPOLE] = 0.1,
    [DIPOLE_MODEL_BEAM] = 0.03,   [DIPOLE_MODEL_MODES] = 0.005,
};
/* Shortest mean free path looked for, and the longest distance, against a slab's thickness. */
static const double finest_share = 1e-3, largest_share = 100;

bool fit_totals_target(const struct io_totals *totals, const char *name, int channel_count,
                       dipole_model model, struct fit_target *target_out, void **memory_out,
                       dipole_status *status)
{
    const dipole_place place = { .source = name };
    const size_t most = totals->count * (size_t)channel_count;
    double *const one = malloc(sizeof *one + most * sizeof(struct fit_datum));
    *memory_out = one;
    if (!one)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for totals");
    *one = 1;
    struct fit_datum *const data = (struct fit_datum *)(void *)(one + 1);
    double thinnest_mm = INFINITY, thickest_mm = 0;
    size_t count = 0;
    bool is_stated = true, is_bright = false;
    for (size_t i = 0; i < totals->count; i++) {
        const struct io_total *const total = &totals->totals[i];
        if (total->channel >= channel_count) {
            free(one);
            *memory_out = NULL;
            return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                               "names a channel, expected none where one is fitted");
        }
        const int first = total->channel < 0 ? 0 : total->channel;
        const int last = total->channel < 0 ? channel_count - 1 : total->channel;
        for (int c = first; c <= last; c++)
            data[count++] = (struct fit_datum){
                .row = one,
                .first = i,
                .count = 1,
                .factor = 1,
                .value = total->value,
                .sigma = hypot(total->sem > 0 ? total->sem : fmax(unstated_error * total->value, 1e-6),
                               model_errors[model] * total->value),
                .stated = total->sem,
                .robust = 1,
                .channel = c,
            };
        is_stated = is_stated && total->sem > 0;
        is_bright = is_bright || total->value > 0;
        if (isfinite(total->thickness_mm)) {
            thinnest_mm = fmin(thinnest_mm, total->thickness_mm);
            thickest_mm = fmax(thickest_mm, total->thickness_mm);
        }
    }
    if (!is_bright) {
        free(one);
        *memory_out = NULL;
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place, "all values are 0, expected some light");
    }
    const bool has_slab = thickest_mm > 0;
    *target_out = (struct fit_target){
        .node_count = totals->count,
        .totals = totals->totals,
        .row_node_count = totals->count,
        .data = data,
        .datum_count = count,
        .tile_count = 1,
        .are_sigmas_stated = is_stated,
        .systematic = { .misfit_factor = 1 },
        /* a half-space has no length: its totals tell the albedo at any */
        .finest_mm = has_slab ? finest_share * thinnest_mm : 1e-3,
        .largest_mm = has_slab ? largest_share * thickest_mm : 1e3,
    };
    snprintf(target_out->name, sizeof target_out->name, "%s", name);
    fit_target_measure_scales(target_out);
    return true;
}
