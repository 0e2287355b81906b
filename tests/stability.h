/* Shared by the parts of the stability suite. */
#ifndef STABILITY_H
#define STABILITY_H

#include "check.h"
#include "libdipole/dipole.h"

#include <stdbool.h>
#include <stddef.h>

/* Errors of one quantity, and how large they may be. */
struct errors {
    const char *name;
    double bound;
    size_t count, limit;
    double *values;
};

void errors_init(struct errors *errors, size_t limit);
/* false if the error is out of bounds */
bool errors_add(struct errors *errors, double error);
/* A row of the table; ends the errors. */
void errors_print(struct errors *errors, const char *unit);

/* Counts a failure; says the first ones. */
void failed(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A number, finite, not negative. */
bool is_sound(double value);

/* What must hold for any stack; stacks of any kind against MPFR (stability_layers.c). */
void sweep_layers(int count);
void compare_layers(int count);

#endif
