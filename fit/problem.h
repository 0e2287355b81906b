/*
 * All targets together as one least-squares problem: the parameters, the residuals, their derivatives.
 * theory.md T38.
 */
#ifndef FIT_PROBLEM_H
#define FIT_PROBLEM_H

#include "fit/solve.h"
#include "fit/target.h"

enum { FIT_TARGET_LIMIT = 16 };

/* Where each unknown stands among the parameters; -1: it is not sought. */
struct fit_layout {
    size_t parameter_count;
    int coefficient[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT]; /* logarithms; thickness: one for all */
    int gain[FIT_TARGET_LIMIT];     /* logarithm                                */
    int balance[FIT_CHANNEL_COUNT]; /* logarithm, of a channel against the second; one for all targets  */
    int ambient[FIT_TARGET_LIMIT][FIT_CHANNEL_COUNT]; /* in units of the target's ambient_scale         */
    int black[FIT_TARGET_LIMIT][FIT_CHANNEL_COUNT];   /* in units of its value_scale                    */
};

struct fit_block_memory {
    bool has_nodes, has_gradients;
    double logs[FIT_COEFFICIENT_COUNT];
};

/* The data of one target in one channel, weighted, and folded to a triangle if that makes them fewer. */
struct fit_block {
    struct fit_target *target;
    size_t target_index, datum_count, row_count;
    int channel;
    double *rows;    /* row_count x (row_node_count + FIT_BLOCK_EXTRA); NULL: datum by datum       */
    double *nodes;   /* scratch: (1 + FIT_COEFFICIENT_COUNT) row_node_count                         */
    double *scratch; /* of fit_target_evaluate                                                      */
    struct fit_block_memory *memory; /* which values nodes holds: they are asked for again and again  */
};
enum { FIT_BLOCK_CONSTANT = 0, FIT_BLOCK_AMBIENT, FIT_BLOCK_BLACK, FIT_BLOCK_VALUE, FIT_BLOCK_EXTRA };

struct fit_problem {
    struct fit_form form;
    struct fit_target *targets;
    size_t target_count;
    bool has_light[FIT_CHANNEL_COUNT]; /* else nothing is sought in that channel                      */
    bool is_balance_free;
    struct fit_layout layout;
    struct fit_block blocks[FIT_TARGET_LIMIT * FIT_CHANNEL_COUNT];
    size_t block_count;
    double start[FIT_PARAMETER_LIMIT], lower[FIT_PARAMETER_LIMIT], upper[FIT_PARAMETER_LIMIT];
};

/*
 * Lay out the parameters and take memory for the blocks; targets (at most FIT_TARGET_LIMIT) stay the
 * caller's and must outlive the problem. End it with fit_problem_destroy. Fails with DIPOLE_OUT_OF_MEMORY
 * or DIPOLE_BAD_VALUE (a start that is no material).
 */
DIPOLE_CHECKED bool fit_problem_init(const struct fit_form *form, struct fit_target *targets,
                                     size_t target_count, bool is_balance_free, struct fit_problem *out,
                                     dipole_status *status);
void fit_problem_destroy(struct fit_problem *problem);

/* Weigh all data by their sigma and robust and fold them anew, on all processors. */
DIPOLE_CHECKED bool fit_problem_fold(struct fit_problem *problem, dipole_status *status);

size_t fit_problem_residual_count(const struct fit_problem *problem);

/* A fit_residual_function over a fit_problem. */
bool fit_problem_residuals(const void *problem, const double *parameters, double *residuals,
                           double *jacobian);

/* What the parameters say of one channel of one target. */
struct fit_state {
    double logs[FIT_COEFFICIENT_COUNT];
    double gain, ambient, black; /* ambient and black in the data's own units */
};
void fit_problem_state(const struct fit_problem *problem, size_t target, int channel,
                       const double *parameters, struct fit_state *out);

/* Model and derivatives of a datum, by the few parameters it depends on. */
enum { FIT_DATUM_PARAMETER_LIMIT = FIT_COEFFICIENT_COUNT + 4 };
struct fit_datum_model {
    double value;
    double bare; /* without black and ambient: what the gain multiplies */
    int parameter_count;
    int parameters[FIT_DATUM_PARAMETER_LIMIT];
    double derivatives[FIT_DATUM_PARAMETER_LIMIT];
};

/* Call visit for every datum of a target in one channel. False where the model has no value. */
typedef void fit_datum_visit(void *context, struct fit_datum *datum, const struct fit_datum_model *model);
bool fit_problem_visit(struct fit_problem *problem, size_t target, int channel, const double *parameters,
                       fit_datum_visit *visit, void *context);

/* Sum of squares of one channel when gain, ambient and black are as good as they can be; INFINITY where
 * there is no value. found: of each target. */
double fit_problem_channel_cost(const struct fit_problem *problem, int channel,
                                const double logs[FIT_COEFFICIENT_COUNT],
                                struct fit_state found[FIT_TARGET_LIMIT]);

/* Parameters for given coefficients of each channel, the rest as good as they can be. */
void fit_problem_parameters(const struct fit_problem *problem,
                            double logs[FIT_CHANNEL_COUNT][FIT_COEFFICIENT_COUNT], double *parameters);

#endif
