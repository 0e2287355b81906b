/* A measured profile as a target. theory.md T38. */
#ifndef FIT_PROFILE_H
#define FIT_PROFILE_H

#include "fit/target.h"
#include "io/profile_file.h"

/*
 * Make a target of a profile for one channel: points of R_d, or ring means by quadrature. Errors are the
 * file's, each taken together with its neighbours', since standard errors are estimates themselves and of
 * rings that nothing hit are 0; where the file has none, 1 % until residuals tell more. The profile is the
 * light that leaves per light that entered, unless its gain is made free.
 * model: a point at r = 0 is left out where it has no value there. One allocation, which *memory_out owns;
 * end it with free. Fails with DIPOLE_OUT_OF_MEMORY or DIPOLE_BAD_VALUE (fewer than two rows are left).
 */
DIPOLE_CHECKED bool fit_profile_target(const struct io_profile *profile, const char *name, int channel,
                                       dipole_model model, struct fit_target *target_out, void **memory_out,
                                       dipole_status *status);

#endif
