/* Matrices and rows of three dual numbers. */
#ifndef LIBDIPOLE_MATRIX_H
#define LIBDIPOLE_MATRIX_H

#include "dual.h"

enum { MODE_COUNT = 3 };

struct matrix {
    struct dual at[MODE_COUNT][MODE_COUNT]; /* row, column */
};

static inline struct matrix product(const struct matrix *a, const struct matrix *b)
{
    struct matrix out;
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++)
            out.at[i][j] = add(multiply(a->at[i][0], b->at[0][j]),
                               add(multiply(a->at[i][1], b->at[1][j]), multiply(a->at[i][2], b->at[2][j])));
    return out;
}

static inline struct matrix transpose(const struct matrix *a)
{
    struct matrix out;
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++)
            out.at[i][j] = a->at[j][i];
    return out;
}

static inline struct matrix sum(const struct matrix *a, const struct matrix *b)
{
    struct matrix out;
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++)
            out.at[i][j] = add(a->at[i][j], b->at[i][j]);
    return out;
}

/* diag(a) m */
static inline struct matrix rows_scaled(const struct dual a[MODE_COUNT], const struct matrix *m)
{
    struct matrix out;
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++)
            out.at[i][j] = multiply(a[i], m->at[i][j]);
    return out;
}

static inline void diagonal_add(struct matrix *m, const struct dual a[MODE_COUNT])
{
    for (int i = 0; i < MODE_COUNT; i++)
        m->at[i][i] = add(m->at[i][i], a[i]);
}

/* row = row m */
static inline void row_turn(struct dual row[MODE_COUNT], const struct matrix *m)
{
    const struct dual old[MODE_COUNT] = { row[0], row[1], row[2] };
    for (int j = 0; j < MODE_COUNT; j++)
        row[j] = add(multiply(old[0], m->at[0][j]),
                     add(multiply(old[1], m->at[1][j]), multiply(old[2], m->at[2][j])));
}

static inline void row_add(struct dual row[MODE_COUNT], const struct dual other[MODE_COUNT])
{
    for (int j = 0; j < MODE_COUNT; j++)
        row[j] = add(row[j], other[j]);
}

/* By cofactors: rows and columns of any sizes do each other no harm. */
static inline struct matrix inverse(const struct matrix *m, struct dual *determinant)
{
    struct matrix out;
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++) {
            const struct dual *const above = m->at[(j + 1) % MODE_COUNT], *const below =
                                                                              m->at[(j + 2) % MODE_COUNT];
            const int left = (i + 1) % MODE_COUNT, right = (i + 2) % MODE_COUNT;
            out.at[i][j] =
                subtract(multiply(above[left], below[right]), multiply(above[right], below[left]));
        }
    *determinant = add(multiply(m->at[0][0], out.at[0][0]),
                       add(multiply(m->at[0][1], out.at[1][0]), multiply(m->at[0][2], out.at[2][0])));
    const struct dual one_over = divide(constant(1.0), *determinant);
    for (int i = 0; i < MODE_COUNT; i++)
        for (int j = 0; j < MODE_COUNT; j++)
            out.at[i][j] = multiply(one_over, out.at[i][j]);
    return out;
}

#endif
