/* Weights that follow the residuals: noise that grows with the signal, and outliers. theory.md T39. */
#ifndef FIT_NOISE_H
#define FIT_NOISE_H

#include "fit/problem.h"

/*
 * Where sigmas are not stated, set each datum's to what residuals of data about as bright show:
 * sigma^2 = read^2 + shot model + relative^2 model^2, the three fitted to medians of groups; where they are
 * stated, sigma^2 = stated^2 + relative^2 model^2, so that data that are more exact than the model do not
 * decide by themselves. Then set each
 * datum's robust share by Huber's loss; of targets whose sigmas are not stated (pictures: dust, hair,
 * mirrored lamps) to 0 beyond FIT_NOISE_OUTLIER sigmas.
 * False where the model has no value at the parameters, or memory runs out.
 */
#define FIT_NOISE_OUTLIER 8.0
bool fit_noise_reweigh(struct fit_problem *problem, const double *parameters);

#endif
