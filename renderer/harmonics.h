/* Real spherical harmonics about the y axis, by recurrences that are stable at any order. theory.md T51. */
#ifndef RENDERER_HARMONICS_H
#define RENDERER_HARMONICS_H

enum {
    RENDER_HARMONIC_LIMIT = 64, /* largest order */
    RENDER_HARMONIC_COUNT = (RENDER_HARMONIC_LIMIT + 1) * (RENDER_HARMONIC_LIMIT + 1),
    RENDER_LEGENDRE_COUNT = (RENDER_HARMONIC_LIMIT + 1) * (RENDER_HARMONIC_LIMIT + 2) / 2,
};

/* Factors of the recurrences. */
struct render_harmonics {
    double rise[RENDER_LEGENDRE_COUNT], fall[RENDER_LEGENDRE_COUNT];
};

void render_harmonics_init(struct render_harmonics *harmonics);

/* Where a function of degree l stands: with order -l <= m <= l among the harmonics, 0 <= m <= l among the
 * Legendre functions. */
static inline int render_harmonic_index(int l, int m)
{
    return l * l + l + m;
}
static inline int render_legendre_index(int l, int m)
{
    return l * (l + 1) / 2 + m;
}

/*
 * Legendre functions of degree up to degree at an angle of that cosine and sine from the axis, so normed
 * that functions[l, 0], and sqrt(2) functions[l, m] times cos(m phi) or sin(m phi), have a mean square of
 * 1/(4 pi) over the sphere. No sign (-1)^m.
 */
void render_harmonics_legendre(const struct render_harmonics *harmonics, int degree, double cosine,
                               double sine, double functions[RENDER_LEGENDRE_COUNT]);

/* Sum of coefficients (of three channels) times harmonics in the direction of a unit vector. The angle phi
 * is 0 at +z and a right angle at +x. */
void render_harmonics_sum(const struct render_harmonics *harmonics, int degree,
                          const double (*coefficients)[3], const double direction[3], double sum[3]);

enum { RENDER_RULE_LIMIT = 64 };

/* Gauss and Legendre's rule of count points, up to RENDER_RULE_LIMIT, on -1..1. */
void render_legendre_rule(int count, double points[], double weights[]);

#endif
