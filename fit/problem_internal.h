/* What problem.c and problem_start.c share: rows of blocks, evaluated. */
#ifndef FIT_PROBLEM_INTERNAL_H
#define FIT_PROBLEM_INTERNAL_H

#include "fit/problem.h"

/* A row's sums over the nodes and over their derivatives. */
struct fit_row_sums {
    double nodes, gradients[FIT_COEFFICIENT_COUNT], constant, ambient, black, value;
};

/* Values at a block's nodes, and their gradients; nothing is done where these are there from the last call.
 */
bool fit_block_evaluate(const struct fit_problem *problem, const struct fit_block *block,
                        const double logs[FIT_COEFFICIENT_COUNT], bool has_gradients);

/* The sums of each row of a block, weighted, one after the other; the cursor begins at {0}. False: there
 * are no more. */
struct fit_block_cursor {
    size_t row, datum;
};
bool fit_block_next(const struct fit_block *block, bool has_gradients, struct fit_block_cursor *cursor,
                    struct fit_row_sums *out);

#endif
