/* Measured totals of slabs as a target. theory.md T38. */
#ifndef FIT_TOTALS_H
#define FIT_TOTALS_H

#include "fit/target.h"

/*
 * Make a target of totals, each the value of a slab of its own thickness. Values without a stated error are
 * taken to be known to 1 %; what the model is off thin slabs (docs/models.md) is added to each. Rows
 * without a channel count for every channel below channel_count. totals must outlive the target; what else
 * it needs *memory_out owns, to be ended with free. Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_BAD_VALUE (a
 * channel that is not fitted, nothing measured but zeros).
 */
DIPOLE_CHECKED bool fit_totals_target(const struct io_totals *totals, const char *name, int channel_count,
                                      dipole_model model, struct fit_target *target_out, void **memory_out,
                                      dipole_status *status);

#endif
