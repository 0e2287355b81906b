/* Inverse Hankel transforms along contours. docs/theory.md T26. */
#include "internal.h"

#include <stdlib.h>

/*
 * (1/2 pi) int_0^inf F(k) J_0(kr) k dk = (1/pi^2) Im int F(k^2 = -kappa^2) K_0(kappa r) kappa dkappa, from
 * a vertex on the real axis below the first singularity kappa_1 to infinity. F is a Laplace transform in
 * k^2 of something positive, so |F| and |K_0| are largest where the real part of kappa^2 is; the best
 * vertex for a radius is where F(-kappa^2) K_0(kappa r) is smallest on the real axis, since there the terms
 * of the sum are hardly larger than their sum. Two families of hyperbolas kappa = scale cosh(t + i angle)
 * pass vertices from 0 to kappa_1: those of 45 degrees, along which the real part of kappa^2 is constant,
 * with scale up to kappa_1; and from there those with foci +-kappa_1 and ever smaller angle. For large
 * radii over an infinite base whose sigma_tr is kappa_1 the contour is the cut itself, where Im F is all
 * there is.
 *
 * The midpoint rule in t has the error e^(-2 pi delta/step) of what the integrand is at most within delta
 * of the contour. By how much it grows there follows from how far F and K_0 have fallen (step_for).
 */
static const double ratio = 1.25;     /* between the scales of neighbouring hyperbolas of 45 degrees */
static const double narrowing = 0.75; /* between the angles of those that narrow                    */
enum { WIDE = 28, NARROW = 8 };       /* how many of each at most                                    */

/* A decay of e^-745 is 0: nothing falls farther. */
static const double fall_end = 745.0;

/* The largest step for which 2 pi delta/step - growth(delta) reaches 38 for some delta: error e^(-38).
 * growth = fall (1 - cos(bend delta)), bend 2 along 45 degrees and 1 along confocal hyperbolas. */
static double step_for(double delta_end, double fall, double bend)
{
    double step = 0.0;
    for (int i = 1; i <= 16; i++) {
        const double delta = delta_end * i / 16.0;
        step = fmax(step, 2.0 * PI * delta / (38.0 + fmin(fall, fall_end) * (1.0 - cos(bend * delta))));
    }
    return step;
}

static double real_response(const struct hankel_input *input, double kappa)
{
    return creal(input->response(input->context, -kappa * kappa));
}

/* ---- layout --------------------------------------------------------------------------------------- */

/* Im F on the upper side of the cut, at kappa^2 = singularity^2 + q^2. With k^2 real, roots are taken on
 * the lower side. */
static double cut_density(const struct hankel_input *input, double q)
{
    const double s = input->singularity_per_mm;
    return -cimag(input->response(input->context, -(s * s + q * q)));
}

/*
 * How far Im F on the cut is proportional to q to one part in 1000, from small q upwards: it is an odd
 * function of q, so that its other singularities are some 30 times farther. 0 if there is no such range, or
 * if none is needed since the base absorbs within the layers' own extent.
 */
static double cut_end(const struct hankel_input *input)
{
    const double highest = 0.5 / input->extent_mm;
    if (!input->is_cut || input->singularity_per_mm > 0.1 * highest)
        return 0.0;
    const double lowest = 1e-3 * highest, slope = cut_density(input, lowest) / lowest;
    if (slope == 0.0) /* a layer that lets nothing through hides the base */
        return 0.0;
    double end = 0.0;
    for (double q = 2.0 * lowest; q <= highest; q *= 2.0) {
        if (!(fabs(cut_density(input, q) / q - slope) <= 1e-3 * slope))
            break;
        end = q;
    }
    return end;
}

static void contour_append(struct hankel *hankel, double scale, double angle)
{
    hankel->contours[hankel->contour_count++] =
        (struct hankel_contour){ .scale = scale, .angle = angle, .vertex = scale * cos(angle) };
}

/* The hyperbolas, from the smallest vertex on, at which F is not much more than at 0. Where the next one
 * begins to serve, it is better by a factor of e^2. */
static void hyperbolas_plan(struct hankel *hankel, const struct hankel_input *input, double singularity)
{
    const double limit = log(real_response(input, 0.0)) + 1.0;
    int wide = 0;
    while (wide < WIDE && log(real_response(input, sqrt(0.5) * singularity * pow(ratio, -wide))) > limit)
        wide++;
    for (int i = wide; i >= 0; i--)
        contour_append(hankel, singularity * pow(ratio, -i), 0.25 * PI);
    for (int i = 1; i <= NARROW; i++)
        contour_append(hankel, singularity, 0.25 * PI * pow(narrowing, i));
    double last = 0.0;
    for (size_t i = 0; i < hankel->contour_count; i++) {
        struct hankel_contour *const contour = &hankel->contours[i];
        contour->log_response = log(real_response(input, contour->vertex));
        if (i > 0)
            contour->r_from_mm = fmax(last, (contour->log_response - contour[-1].log_response + 2.0) /
                                                (contour->vertex - contour[-1].vertex));
        last = contour->r_from_mm;
    }
}

/* Drop what begins beyond r_mm. */
static void contours_cut_off(struct hankel *hankel, double r_mm)
{
    while (hankel->contour_count > 0 && hankel->contours[hankel->contour_count - 1].r_from_mm >= r_mm)
        hankel->contour_count--;
}

static void cut_plan(struct hankel *hankel, double singularity, double end)
{
    const double kappa_end = hypot(singularity, end);
    const double r_from_mm = 45.0 / (end * (end / (kappa_end + singularity)));
    contours_cut_off(hankel, r_from_mm);
    contour_append(hankel, singularity, 0.0);
    hankel->contours[hankel->contour_count - 1].r_from_mm = r_from_mm;
    if (singularity * r_from_mm < 16.0) { /* one with fine steps for where K_0 falls by e^-745 */
        contour_append(hankel, singularity, 0.0);
        hankel->contours[hankel->contour_count - 1].r_from_mm = 16.0 / singularity;
    }
}

static void steps_choose(struct hankel *hankel)
{
    for (size_t i = 0; i < hankel->contour_count; i++) {
        struct hankel_contour *const contour = &hankel->contours[i];
        const double r_to_mm = i + 1 < hankel->contour_count ? contour[1].r_from_mm : INFINITY;
        const double fall = fmax(-contour->log_response, contour->vertex * r_to_mm);
        const bool is_wide = contour->angle == 0.25 * PI;
        contour->step =
            step_for(contour->angle > 0.0 ? contour->angle : 0.25 * PI, fall, is_wide ? 2.0 : 1.0);
    }
}

/* ---- nodes ---------------------------------------------------------------------------------------- */

static bool node_append(struct hankel *hankel, const struct hankel_node *node)
{
    if (hankel->node_count == hankel->node_limit) {
        const size_t limit = hankel->node_limit > 0 ? 2 * hankel->node_limit : 512;
        struct hankel_node *const nodes = realloc(hankel->nodes, limit * sizeof *nodes);
        if (nodes == NULL)
            return false;
        hankel->nodes = nodes;
        hankel->node_limit = limit;
    }
    hankel->nodes[hankel->node_count++] = *node;
    return true;
}

/* Nodes up to where the terms have fallen by 1e-20: for good, or at the smallest radius that is served. The
 * first contour is for all small radii, and for the power within them, a sum that falls as kappa^-2 only.
 */
static bool contour_fill(struct hankel *hankel, const struct hankel_input *input,
                         struct hankel_contour *contour)
{
    const bool is_cut = contour->angle == 0.0;
    contour->first = hankel->node_count;
    double largest = 0.0, largest_term = 0.0;
    for (size_t i = 0;; i++) {
        const double complex t = ((double)i + 0.5) * contour->step + I * contour->angle;
        const double complex kappa = contour->scale * ccosh(t);
        struct hankel_node node = {
            .kappa = kappa,
            .log_kappa = clog(kappa),
            .weight = contour->step / (PI * PI) * kappa * (contour->scale * csinh(t)),
        };
        if (is_cut) /* there F is the conjugate of what it is above the cut */
            node.weight = -creal(node.weight);
        node.term = node.weight * input->response(input->context, -kappa * kappa);
        if (is_cut)
            node.term = I * cimag(node.term);
        const double reached =
            size(node.term) * exp(-(creal(kappa) - contour->vertex) * contour->r_from_mm);
        largest = fmax(largest, reached);
        largest_term = fmax(largest_term, size(node.term));
        if (!(reached >= 1e-20 * largest) || size(kappa) * input->r_min_mm > 1e7)
            break;
        if (!node_append(hankel, &node))
            return false;
    }
    contour->count = hankel->node_count - contour->first;
    for (size_t j = hankel->node_count; j-- > contour->first;)
        if (size(hankel->nodes[j].term) > 1e-22 * largest_term)
            contour->kappa_low = creal(hankel->nodes[j].kappa);
    return true;
}

bool dipole_hankel_init(struct hankel *hankel, const struct hankel_input *input)
{
    *hankel = (struct hankel){ .r_far_mm = INFINITY };
    if (!(real_response(input, 0.0) > 1e-300))
        return true;
    /* A lossless base is singular at 0. A vertex so close to 0 leaves out what is lost beside the rest, up
     * to a radius from where on the asymptote r^-3 is exact. */
    const double end = cut_end(input);
    double singularity = input->singularity_per_mm;
    if (singularity == 0.0) {
        singularity = end > 0.0 ? 1e-26 * end : 1e-30 / input->extent_mm;
        hankel->r_far_mm = end > 0.0 ? 1e8 / end : INFINITY;
    }
    hyperbolas_plan(hankel, input, singularity);
    if (end > 0.0)
        cut_plan(hankel, singularity, end);
    steps_choose(hankel);
    for (size_t i = 0; i < hankel->contour_count; i++) {
        struct hankel_contour *const contour = &hankel->contours[i];
        const bool is_used = i + 1 == hankel->contour_count || contour[1].r_from_mm > contour->r_from_mm;
        if ((is_used || i == 0) && !contour_fill(hankel, input, contour)) {
            dipole_hankel_clear(hankel);
            return false;
        }
    }
    return true;
}

void dipole_hankel_clear(struct hankel *hankel)
{
    free(hankel->nodes);
    *hankel = (struct hankel){ .r_far_mm = INFINITY };
}

/* ---- sums ----------------------------------------------------------------------------------------- */

/* The first node with Re kappa, which grows with the index, of at least kappa. */
static size_t node_find(const struct hankel *hankel, const struct hankel_contour *contour, double kappa)
{
    size_t lo = contour->first, hi = contour->first + contour->count;
    while (lo < hi) {
        const size_t middle = lo + (hi - lo) / 2;
        if (creal(hankel->nodes[middle].kappa) >= kappa)
            hi = middle;
        else
            lo = middle + 1;
    }
    return lo;
}

/* Of the profile, kappa^2 kills the first terms: those with kappa r < 1e-11, and at small radii those with
 * the same part of what kappa is where the terms are largest. Of everything, what is e^(-45) of the first
 * node is lost beside it. */
static double kappa_low(const struct hankel_contour *contour, double r_mm)
{
    return fmin(contour->kappa_low, 1e-11 / r_mm);
}

static double kappa_high(const struct hankel_contour *contour, double r_mm)
{
    return contour->vertex + 45.0 / r_mm;
}

bool dipole_hankel_is_needed(const struct hankel_contour *contour, const struct hankel_node *node,
                             double r_mm)
{
    return creal(node->kappa) >= kappa_low(contour, r_mm) && creal(node->kappa) < kappa_high(contour, r_mm);
}

const struct hankel_contour *dipole_hankel_contour_for(const struct hankel *hankel, double r_mm)
{
    size_t i = hankel->contour_count;
    while (i > 1 && r_mm < hankel->contours[i - 1].r_from_mm)
        i--;
    return i > 0 && hankel->contours[i - 1].vertex * r_mm < fall_end ? &hankel->contours[i - 1] : NULL;
}

double dipole_hankel_profile(const struct hankel *hankel, double r_mm)
{
    const double r = fmin(r_mm, hankel->r_far_mm), log_r = log(r);
    const struct hankel_contour *const contour = dipole_hankel_contour_for(hankel, r);
    if (contour == NULL)
        return 0.0;
    const size_t first = node_find(hankel, contour, kappa_low(contour, r)),
                 end = node_find(hankel, contour, kappa_high(contour, r));
    double sum = 0.0;
    for (size_t j = first; j < end; j++) {
        const struct hankel_node *const node = &hankel->nodes[j];
        const double complex k0 = dipole_bessel_k0(node->kappa * r, node->log_kappa + log_r);
        sum += creal(node->term) * cimag(k0) + cimag(node->term) * creal(k0);
    }
    return sum * dipole_hankel_far_factor(hankel, r_mm);
}

double dipole_hankel_far_factor(const struct hankel *hankel, double r_mm)
{
    const double share = hankel->r_far_mm / r_mm;
    return r_mm > hankel->r_far_mm ? share * share * share : 1.0;
}

double dipole_hankel_beyond(const struct hankel *hankel, double r_mm)
{
    const double r = fmin(r_mm, hankel->r_far_mm), log_r = log(r);
    const struct hankel_contour *const contour = dipole_hankel_contour_for(hankel, r);
    if (contour == NULL)
        return 0.0;
    const size_t end = node_find(hankel, contour, kappa_high(contour, r));
    double sum = 0.0;
    for (size_t j = contour->first; j < end; j++) {
        const struct hankel_node *const node = &hankel->nodes[j];
        const double complex zk1 = dipole_bessel_zk1(node->kappa * r, node->log_kappa + log_r);
        sum += cimag(node->term / (node->kappa * node->kappa) * zk1);
    }
    return 2.0 * PI * sum * (r / r_mm);
}

double dipole_hankel_within(const struct hankel *hankel, double r_mm)
{
    if (hankel->contour_count == 0)
        return 0.0;
    const struct hankel_contour *const contour = &hankel->contours[0];
    const double log_r = log(r_mm);
    double sum = 0.0;
    for (size_t j = contour->first; j < contour->first + contour->count; j++) {
        const struct hankel_node *const node = &hankel->nodes[j];
        const double complex rest =
            dipole_bessel_zk1_complement(node->kappa * r_mm, node->log_kappa + log_r);
        sum += cimag(node->term / (node->kappa * node->kappa) * rest);
    }
    return 2.0 * PI * sum;
}
