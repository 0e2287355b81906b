/* The translucent-shadow-map volume in memory: baking, sampling, and the audit. T32. */
#include "lutgen/tsm.h"

#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- axes and proximity ------------------------------------------------------------------------- */

double lut_tsm_depth_mm(const struct lut_tsm *lut, double index)
{
    const double end = asinh(lut->depth_max_mm / lut->depth_scale_mm);
    return lut->depth_scale_mm * sinh((2 * index / (lut->size[1] - 1) - 1) * end);
}

double lut_tsm_depth_index(const struct lut_tsm *lut, double dz_mm)
{
    const double end = asinh(lut->depth_max_mm / lut->depth_scale_mm);
    return 0.5 * (lut->size[1] - 1) * (1 + asinh(dz_mm / lut->depth_scale_mm) / end);
}

double lut_tsm_local_depth_mm(const struct lut_tsm *lut, double index)
{
    const double scale_mm = lut->local_depth_scale_mm;
    return scale_mm * sinh(index / (lut->size[0] - 1) * asinh(lut->inner_mm / scale_mm));
}

double lut_tsm_local_depth_index(const struct lut_tsm *lut, double dz_mm)
{
    const double scale_mm = lut->local_depth_scale_mm;
    return (lut->size[0] - 1) * (asinh(fabs(dz_mm) / scale_mm) / asinh(lut->inner_mm / scale_mm));
}

/* 1 at a depth of 0, 0 from inner_mm on, with two continuous derivatives. */
double lut_tsm_proximity(const struct lut_tsm *lut, double dz_mm)
{
    const double x = fmin(fabs(dz_mm) / lut->inner_mm, 1);
    return 1 - x * x * x * (x * (6 * x - 15) + 10);
}

int lut_tsm_kernel_slice(const struct lut_tsm *lut)
{
    return lut->sample_count;
}

int lut_tsm_depth_slice(const struct lut_tsm *lut)
{
    return lut->sample_count + 1;
}

static float *texel(const struct lut_tsm *lut, int s, int t, int r)
{
    const size_t width = (size_t)lut->size[0] * (size_t)lut->size[2];
    return lut->rgb + ((size_t)t * width + (size_t)r * (size_t)lut->size[0] + (size_t)s) * IO_CHANNEL_COUNT;
}

/* ---- power that a cell receives ----------------------------------------------------------------- */

/*
 * Power through a polygon of the plane across the light, by the power within discs: with the angle phi of a
 * point of its edge and the distance rho(phi), the sum over edges of int W(rho) dphi/(2 pi), W the power
 * within a disc of radius rho about the point. Gauss's rule of 8 points on each edge.
 */
enum { GAUSS_POINTS = 8 };
static const double gauss_x[GAUSS_POINTS] = { -0.9602898564975363, -0.7966664774136267, -0.5255324099163290,
                                              -0.1834346424956498, 0.1834346424956498,  0.5255324099163290,
                                              0.7966664774136267,  0.9602898564975363 };
static const double gauss_w[GAUSS_POINTS] = { 0.1012285362903763, 0.2223810344533745, 0.3137066458778873,
                                              0.3626837833783620, 0.3626837833783620, 0.3137066458778873,
                                              0.2223810344533745, 0.1012285362903763 };

/* Radii and weights of the sum for one polygon; returns how many. */
static int polygon_rule(const double corners[4][2], double scale_mm, double *r_mm, double *weight)
{
    int count = 0;
    for (int k = 0; k < 4; k++) {
        const double *const a = corners[k], *const b = corners[(k + 1) % 4];
        const double edge[2] = { b[0] - a[0], b[1] - a[1] };
        const double length = hypot(edge[0], edge[1]), cross = a[0] * b[1] - b[0] * a[1];
        if (length == 0 || fabs(cross) < 1e-12 * length)
            continue; /* seen end on */
        /* angles about the foot of the perpendicular; the other way round if the point lies outside */
        const double distance = fabs(cross) / length, turn = cross > 0 ? 1 : -1;
        const double from = atan2(a[0] * edge[0] + a[1] * edge[1], length * distance);
        const double to = atan2(b[0] * edge[0] + b[1] * edge[1], length * distance);
        for (int i = 0; i < GAUSS_POINTS; i++, count++) {
            r_mm[count] = scale_mm * distance / cos(0.5 * (from + to) + 0.5 * (to - from) * gauss_x[i]);
            weight[count] = turn * gauss_w[i] * 0.5 * (to - from) / (2 * PI);
        }
    }
    return count;
}

/* ---- what a volume is baked from ---------------------------------------------------------------- */

enum { RULE_LIMIT = 4 * GAUSS_POINTS };

/* Cells that are each other's mirror images receive the same; a class is one of them. */
struct cell_class {
    struct lut_cell cell;
    int member_count;
    int first, count; /* of the rule's radii */
};

struct plan {
    struct lut_tsm *lut;
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    int class_of[LUT_TSM_SAMPLE_LIMIT];
    struct cell_class classes[LUT_TSM_SAMPLE_LIMIT];
    int class_count, radius_count;
    double *r_mm, *weight; /* of all classes' rules; the last radius is infinite */
    dipole_sources sources[IO_CHANNEL_COUNT];
    double floor_per_mm2[IO_CHANNEL_COUNT], flat_inner_power[IO_CHANNEL_COUNT]; /* the latter at dz = 0 */
    struct lut_profile profiles[IO_CHANNEL_COUNT];
};

static bool are_mirrored(const struct lut_cell *a, const struct lut_cell *b)
{
    const double au = fabs(a->centre[0]), av = fabs(a->centre[1]);
    const double bu = fabs(b->centre[0]), bv = fabs(b->centre[1]);
    const double small = 1e-9 * (au + av + 1);
    return fabs(a->area - b->area) < small && fabs(fmax(au, av) - fmax(bu, bv)) < small &&
           fabs(fmin(au, av) - fmin(bu, bv)) < small;
}

static void classes_find(struct plan *plan)
{
    plan->class_count = plan->radius_count = 0;
    for (int i = 0; i < plan->lut->sample_count; i++) {
        int k = 0;
        while (k < plan->class_count && !are_mirrored(&plan->classes[k].cell, &plan->cells[i]))
            k++;
        struct cell_class *const class = &plan->classes[k];
        if (k == plan->class_count) {
            plan->class_count++;
            *class = (struct cell_class){ .cell = plan->cells[i], .first = plan->radius_count };
            class->count = polygon_rule(class->cell.corners, plan->lut->inner_mm, plan->r_mm + class->first,
                                        plan->weight + class->first);
            plan->radius_count += class->count;
        }
        class->member_count++;
        plan->class_of[i] = k;
    }
    plan->r_mm[plan->radius_count] = INFINITY;
}

/*
 * Mean response of each class of cells where the surface of the light's entry lies across the light, dz
 * above the point, and the power of all five inner cells. What falls beyond the last ring is added to it,
 * so that the sum over all cells is all the light that arrives.
 */
static double means_find(const struct plan *plan, int channel, double dz_mm, double *within, double *means)
{
    const double inner_area = plan->lut->inner_mm * plan->lut->inner_mm;
    dipole_sources_within_many(&plan->sources[channel], -dz_mm, plan->r_mm, (size_t)plan->radius_count + 1,
                               within);
    double inner = 0, rest = within[plan->radius_count], outermost = 0;
    for (int k = 0; k < plan->class_count; k++) {
        const struct cell_class *const class = &plan->classes[k];
        double power = 0;
        for (int i = class->first; i < class->first + class->count; i++)
            power += plan->weight[i] * within[i];
        means[k] = power / (class->cell.area * inner_area);
        inner += class->cell.is_inner ? power * class->member_count : 0;
        outermost += class->cell.is_outermost ? power * class->member_count : 0;
        rest -= power * class->member_count;
    }
    for (int k = 0; k < plan->class_count && outermost > 0; k++)
        if (plan->classes[k].cell.is_outermost)
            means[k] *= 1 + fmax(rest, 0) / outermost;
    return inner;
}

/*
 * The whole response of one cell at count cosines: that at its centre, by the distance to the sources,
 * times mean over centre where the surface lies across the light.
 */
static void response(const struct plan *plan, int channel, int sample, double dz_mm, double mean,
                     const double *cosines, size_t count, double *values)
{
    const double inner_mm = plan->lut->inner_mm;
    const double u = plan->cells[sample].centre[0] * inner_mm, v = plan->cells[sample].centre[1] * inner_mm;
    const double distance = sqrt(u * u + v * v + dz_mm * dz_mm),
                 facing = distance > 0 ? -dz_mm / distance : 1;
    double centre;
    dipole_sources_profile_per_mm2(&plan->sources[channel], distance, &facing, 1, &centre);
    dipole_sources_profile_per_mm2(&plan->sources[channel], distance, cosines, count, values);
    for (size_t i = 0; i < count; i++)
        values[i] = centre > 0 ? values[i] * (mean / centre) : 0;
}

/* ---- baking ------------------------------------------------------------------------------------- */

static double left_to_global(const struct plan *plan, int sample, double dz_mm)
{
    return plan->cells[sample].is_inner ? 1 - lut_tsm_proximity(plan->lut, dz_mm) : 1;
}

/* Memory of one row of the bake. */
struct row_work {
    double *within, *means, *cosines, *values;
};

static bool row_work_create(const struct plan *plan, size_t cosine_count, struct row_work *work)
{
    const size_t radii = (size_t)plan->radius_count + 1, classes = (size_t)plan->class_count;
    double *const all = malloc((radii + classes + 2 * cosine_count) * sizeof *all);
    *work =
        (struct row_work){ all, all + radii, all + radii + classes, all + radii + classes + cosine_count };
    return all != NULL;
}

/* Rows of the volume are independent of each other. */
struct row_loop {
    const struct plan *plan;
    struct row_work *works; /* per row */
};

static void row_bake(void *context, int t)
{
    const struct row_loop *const loop = context;
    const struct plan *const plan = loop->plan;
    const struct lut_tsm *const lut = plan->lut;
    const struct row_work *const work = &loop->works[t];
    const double dz_mm = lut_tsm_depth_mm(lut, t);
    for (int s = 0; s < lut->size[0]; s++)
        work->cosines[s] = 2.0 * s / (lut->size[0] - 1) - 1;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        means_find(plan, c, dz_mm, work->within, work->means);
        for (int r = 0; r < lut->sample_count; r++) {
            response(plan, c, r, dz_mm, work->means[plan->class_of[r]], work->cosines, (size_t)lut->size[0],
                     work->values);
            const double part = left_to_global(plan, r, dz_mm);
            float *const out = texel(lut, 0, t, r) + c;
            for (int s = 0; s < lut->size[0]; s++)
                out[(size_t)s * IO_CHANNEL_COUNT] = (float)(part * work->values[s]);
        }
    }
}

/* Means over 7 x 7 cells of the inner square at dz = 0. */
static void kernel_bake(const struct plan *plan, int channel)
{
    const struct lut_tsm *const lut = plan->lut;
    const double side = 1.0 / LUT_TSM_LOCAL_SIDE, cell_mm = side * lut->inner_mm;
    for (int j = 0; j < LUT_TSM_LOCAL_SIDE; j++)
        for (int i = 0; i < LUT_TSM_LOCAL_SIDE; i++) {
            const double u = i * side - 0.5, v = j * side - 0.5;
            const double corners[4][2] = {
                { u, v }, { u + side, v }, { u + side, v + side }, { u, v + side }
            };
            double r_mm[RULE_LIMIT], weight[RULE_LIMIT], within[RULE_LIMIT], power = 0;
            const int count = polygon_rule(corners, lut->inner_mm, r_mm, weight);
            dipole_sources_within_many(&plan->sources[channel], 0, r_mm, (size_t)count, within);
            for (int k = 0; k < count; k++)
                power += weight[k] * within[k];
            texel(lut, i, j, lut_tsm_kernel_slice(lut))[channel] = (float)(power / (cell_mm * cell_mm));
        }
}

/* The inner cells' power at a depth over that at dz = 0. */
static double inner_part(const struct plan *plan, int channel, double dz_mm, const struct row_work *work)
{
    return means_find(plan, channel, dz_mm, work->within, work->means) / plan->flat_inner_power[channel];
}

/* Kernel and depth factors: in row 0 where the light enters above the point, in row 1 below. */
static void local_bake(struct plan *plan, const struct row_work *work)
{
    struct lut_tsm *const lut = plan->lut;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        kernel_bake(plan, c);
        for (int row = 0; row < 2; row++)
            for (int s = 0; s < lut->size[0]; s++) {
                const double dz_mm = (row == 0 ? 1 : -1) * lut_tsm_local_depth_mm(lut, s);
                texel(lut, s, row, lut_tsm_depth_slice(lut))[c] =
                    (float)(lut_tsm_proximity(lut, dz_mm) * inner_part(plan, c, dz_mm, work));
            }
    }
}

static bool volume_bake(struct plan *plan, int thread_count, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    const int rows = lut->size[1];
    struct row_work *const works = calloc((size_t)rows, sizeof *works);
    struct row_loop loop = { .plan = plan, .works = works };
    bool is_done = works != NULL;
    for (int t = 0; t < rows && is_done; t++)
        is_done = row_work_create(plan, (size_t)lut->size[0], &works[t]);
    if (is_done) {
        local_bake(plan, &works[0]);
        lut_parallel_for(rows, thread_count, row_bake, &loop);
    }
    for (int t = 0; t < rows && works; t++)
        free(works[t].within);
    free(works);
    return is_done || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
}

/* Divide by powers of two so that half holds the values, and round them to half; depth factors are 0 to 1.
 */
static void volume_round(struct lut_tsm *lut)
{
    const int factors = lut_tsm_depth_slice(lut);
    double most[IO_CHANNEL_COUNT] = { 0 };
    for (int pass = 0; pass < 2; pass++) {
        for (int t = 0; t < lut->size[1]; t++)
            for (int r = 0; r <= factors; r++)
                for (int s = 0; s < lut->size[0]; s++)
                    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
                        float *const value = &texel(lut, s, t, r)[c];
                        if (pass == 0 && r < factors)
                            most[c] = fmax(most[c], (double)*value);
                        else if (pass == 1)
                            *value =
                                (float)lut_half_round((double)*value / (r < factors ? lut->scale[c] : 1));
                    }
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            lut->scale[c] = lut_half_scale(most[c]);
    }
}

/* ---- sampling ----------------------------------------------------------------------------------- */

/* Where an index lies: the node below, and how far on to the next. */
static int split(double index, int count, double *fraction)
{
    const int i = index < count - 2 ? (int)fmax(index, 0) : count - 2;
    *fraction = fmin(fmax(index - i, 0), 1);
    return i;
}

void lut_tsm_sample(const struct lut_tsm *lut, int sample, double cosine, double dz_mm,
                    double rgb_out[IO_CHANNEL_COUNT])
{
    assert(sample >= 0 && sample < lut->sample_count);
    double fs, ft;
    const int s = split(0.5 * (1 + cosine) * (lut->size[0] - 1), lut->size[0], &fs);
    const int t = split(lut_tsm_depth_index(lut, dz_mm), lut->size[1], &ft);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double a =
            (1 - fs) * (double)texel(lut, s, t, sample)[c] + fs * (double)texel(lut, s + 1, t, sample)[c];
        const double b = (1 - fs) * (double)texel(lut, s, t + 1, sample)[c] +
                         fs * (double)texel(lut, s + 1, t + 1, sample)[c];
        rgb_out[c] = fabs(dz_mm) <= lut->depth_max_mm ? ((1 - ft) * a + ft * b) * lut->scale[c] : 0;
    }
}

void lut_tsm_local_kernel(const struct lut_tsm *lut, int i, int j, double rgb_out[IO_CHANNEL_COUNT])
{
    const int half = LUT_TSM_LOCAL_SIDE / 2;
    assert(abs(i) <= half && abs(j) <= half);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = (double)texel(lut, i + half, j + half, lut_tsm_kernel_slice(lut))[c] * lut->scale[c];
}

void lut_tsm_local_depth_factor(const struct lut_tsm *lut, double dz_mm, double rgb_out[IO_CHANNEL_COUNT])
{
    double f;
    const int s = split(lut_tsm_local_depth_index(lut, dz_mm), lut->size[0], &f);
    const int row = dz_mm >= 0 ? 0 : 1, r = lut_tsm_depth_slice(lut);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] = fabs(dz_mm) < lut->inner_mm ? (1 - f) * (double)texel(lut, s, row, r)[c] +
                                                       f * (double)texel(lut, s + 1, row, r)[c]
                                                 : 0;
}

/* ---- audit -------------------------------------------------------------------------------------- */

/* Cosines at each depth, one in each of as many parts. */
enum { COSINES_AUDITED = 8 };

/* Which axes' points lie off the grid. */
enum audit { AUDIT_BOTH = 0, AUDIT_S, AUDIT_T };

/* A random index of an axis in part `part` of `parts`: in the middle between two nodes, where linear
 * interpolation errs most, or anywhere, or at a node. */
static double index_choose(uint64_t *random, int node_count, int part, int parts, bool is_off_grid)
{
    const double x = (part + lut_random(random)) / parts * (node_count - 1);
    const bool is_middle = lut_random(random) < 0.5;
    return !is_off_grid ? round(x) : is_middle ? fmin(floor(x), node_count - 2) + 0.5 : x;
}

/* Errors at one depth, for every sample and channel at some cosines; returns how many. */
static size_t depth_audit(const struct plan *plan, double dz_mm, bool is_s_off_grid, uint64_t *random,
                          const struct row_work *work, double *errors)
{
    const struct lut_tsm *const lut = plan->lut;
    size_t count = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        means_find(plan, c, dz_mm, work->within, work->means);
        for (int r = 0; r < lut->sample_count; r++) {
            for (int k = 0; k < COSINES_AUDITED; k++)
                work->cosines[k] =
                    2 * index_choose(random, lut->size[0], k, COSINES_AUDITED, is_s_off_grid) /
                        (lut->size[0] - 1) -
                    1;
            response(plan, c, r, dz_mm, work->means[plan->class_of[r]], work->cosines, COSINES_AUDITED,
                     work->values);
            const double part = left_to_global(plan, r, dz_mm);
            for (int k = 0; k < COSINES_AUDITED; k++) {
                double sampled[IO_CHANNEL_COUNT];
                lut_tsm_sample(lut, r, work->cosines[k], dz_mm, sampled);
                errors[count++] = fabs(sampled[c] - part * work->values[k]) /
                                  fmax(work->values[k], plan->floor_per_mm2[c]);
            }
        }
    }
    return count;
}

/* The same of the local response's depth factor, relative to the whole response, too. */
static size_t local_audit(const struct plan *plan, uint64_t *random, const struct row_work *work,
                          double *errors)
{
    const struct lut_tsm *const lut = plan->lut;
    const double side = lut_random(random) < 0.5 ? -1 : 1;
    const double dz_mm = side * lut_tsm_local_depth_mm(lut, lut_random(random) * (lut->size[0] - 1));
    size_t count = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        double sampled[IO_CHANNEL_COUNT];
        const double whole = inner_part(plan, c, dz_mm, work);
        lut_tsm_local_depth_factor(lut, dz_mm, sampled);
        errors[count++] = fabs(sampled[c] - lut_tsm_proximity(lut, dz_mm) * whole) / whole;
    }
    return count;
}

static bool audit(const struct plan *plan, enum audit which, int depth_count, unsigned seed,
                  struct lut_error *error_out, dipole_status *status)
{
    const size_t per_depth =
        (size_t)plan->lut->sample_count * COSINES_AUDITED * IO_CHANNEL_COUNT + IO_CHANNEL_COUNT;
    double *const errors = malloc((size_t)depth_count * per_depth * sizeof *errors);
    struct row_work work = { 0 };
    const bool is_done = errors && row_work_create(plan, COSINES_AUDITED, &work);
    uint64_t random = seed;
    size_t filled = 0;
    for (int i = 0; i < depth_count && is_done; i++) {
        const double t = index_choose(&random, plan->lut->size[1], i, depth_count, which != AUDIT_S);
        filled += depth_audit(plan, lut_tsm_depth_mm(plan->lut, t), which != AUDIT_T, &random, &work,
                              errors + filled);
        if (which == AUDIT_BOTH)
            filled += local_audit(plan, &random, &work, errors + filled);
    }
    *error_out = filled > 0 ? lut_error_of(errors, filled) : (struct lut_error){ 0 };
    free(work.within);
    free(errors);
    return is_done ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the audit of a volume");
}

/* ---- volumes ------------------------------------------------------------------------------------ */

void lut_tsm_destroy(struct lut_tsm *lut)
{
    if (lut)
        free(lut->rgb);
    free(lut);
}

static void plan_destroy(struct plan *plan)
{
    if (plan) {
        lut_profiles_end(plan->profiles);
        free(plan->r_mm);
    }
    free(plan);
}

/* The pattern reaches so far that this part of the light comes from farther, which the last ring takes: a
 * wider one would have coarser cells. */
static const double extent_epsilon = 0.03;

void lut_tsm_samples_fill(struct lut_tsm *lut)
{
    struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
    lut->sample_count = lut_pattern_cells(lut->size[2], cells);
    for (int i = 0; i < lut->sample_count; i++)
        lut->samples[i] =
            (struct lut_tsm_sample){ .offset_mm = { cells[i].centre[0] * lut->inner_mm,
                                                    cells[i].centre[1] * lut->inner_mm },
                                     .width_mm = sqrt(cells[i].area) * lut->inner_mm,
                                     .area_mm2 = cells[i].area * lut->inner_mm * lut->inner_mm };
}

/* Lengths and samples follow from the material and the number of slices. */
static void lengths_find(struct plan *plan)
{
    struct lut_tsm *const lut = plan->lut;
    double r_max_mm = 0, shortest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct lut_profile *const profile = &plan->profiles[c];
        r_max_mm = fmax(r_max_mm, profile->stack ? profile->r_max_mm : 0);
        shortest_mm = fmin(shortest_mm, profile->mean_free_path_mm);
    }
    if (r_max_mm == 0) /* nothing scatters */
        r_max_mm = shortest_mm;
    lut->inner_mm = 2 * r_max_mm / lut_pattern_extent(lut->size[2]);
    lut->depth_max_mm = r_max_mm;
    lut->depth_scale_mm = lut->inner_mm;
    lut->local_depth_scale_mm = fmin(lut->inner_mm, shortest_mm);
    lut_tsm_samples_fill(lut);
    lut_pattern_cells(lut->size[2], plan->cells);
}

static bool sources_find(struct plan *plan, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    /* a tenth of the error; the shallowest point that is asked for lies half a local cell away */
    const double epsilon = fmin(fmax(0.1 * lut->epsilon, 1e-6), 0.1);
    const double r_min_mm = 0.5 * lut->inner_mm / LUT_TSM_LOCAL_SIDE;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct lut_profile *const profile = &plan->profiles[c];
        dipole_status why = { 0 };
        if (!profile->stack)
            continue;
        /* beyond r_max the error is relative to the profile there, which falls to nothing soon after */
        const double r_max_mm = fmax(2 * profile->r_max_mm, 2 * r_min_mm);
        if (!dipole_sources_init(profile->stack, epsilon, r_min_mm, r_max_mm, &plan->sources[c], &why))
            return dipole_fail(status, why.code, NULL, "channel %s: %s", io_channel_names[c], why.message);
        lut->source_error = fmax(lut->source_error, plan->sources[c].max_relative_error);
        plan->floor_per_mm2[c] = profile->floor_per_mm2;
    }
    return true;
}

/* What baking and the audit need, of a volume whose material, epsilon and size[2] are set. */
static bool plan_create(struct lut_tsm *lut, struct plan **plan_out, dipole_status *status)
{
    struct plan *const plan = calloc(1, sizeof *plan);
    double *const rules = malloc((size_t)2 * (LUT_TSM_SAMPLE_LIMIT * RULE_LIMIT + 1) * sizeof *rules);
    *plan_out = plan;
    if (!plan || !rules) {
        free(rules);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    }
    plan->lut = lut;
    plan->r_mm = rules;
    plan->weight = rules + LUT_TSM_SAMPLE_LIMIT * RULE_LIMIT + 1;
    if (!lut_profiles_init(&lut->material, extent_epsilon, plan->profiles, status) ||
        !lut_profiles_check_range(plan->profiles, status))
        return false;
    lengths_find(plan);
    if (!sources_find(plan, status))
        return false;
    classes_find(plan);
    double means[LUT_TSM_SAMPLE_LIMIT];
    double *const within = malloc(((size_t)plan->radius_count + 1) * sizeof *within);
    if (!within)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (plan->profiles[c].stack)
            plan->flat_inner_power[c] = means_find(plan, c, 0, within, means);
    free(within);
    return true;
}

/* What lies between the points of an audit can be so much larger. */
static const double audit_margin = 1.1;

static bool try_size(struct plan *plan, int thread_count, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    const size_t count =
        (size_t)lut->size[0] * (size_t)lut->size[1] * (size_t)lut->size[2] * IO_CHANNEL_COUNT;
    free(lut->rgb);
    lut->rgb = calloc(count, sizeof *lut->rgb);
    if (!lut->rgb)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume of %d x %d x %d",
                           lut->size[0], lut->size[1], lut->size[2]);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        lut->scale[c] = 1;
    if (!volume_bake(plan, thread_count, status))
        return false;
    if (lut->is_half)
        volume_round(lut);
    if (!audit(plan, AUDIT_BOTH, 2 * lut->size[1], LUT_SEED_BAKE, &lut->error, status))
        return false;
    lut->error.max = audit_margin * lut->error.max + lut->source_error;
    lut->error.p99 = fmin(audit_margin * lut->error.p99 + lut->source_error, lut->error.max);
    return true;
}

/* Double the side whose own error is larger, if its size was not given; false where that ends. */
static bool grow(struct plan *plan, bool *has_grown, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    struct lut_error by_s, by_t;
    if (!audit(plan, AUDIT_S, lut->size[1], LUT_SEED_BAKE, &by_s, status) ||
        !audit(plan, AUDIT_T, lut->size[1], LUT_SEED_BAKE, &by_t, status))
        return false;
    const bool can_s = lut->size_asked[0] == 0 && lut->size[0] < LUT_TSM_SIDE_MAX;
    const bool can_t = lut->size_asked[1] == 0 && lut->size[1] < LUT_TSM_SIDE_MAX;
    *has_grown = can_s || can_t;
    if (can_s && (by_s.max > by_t.max || !can_t))
        lut->size[0] *= 2;
    else if (can_t)
        lut->size[1] *= 2;
    return true;
}

static bool size_find(struct plan *plan, int thread_count, dipole_status *status)
{
    struct lut_tsm *const lut = plan->lut;
    for (bool has_grown = true; has_grown;) {
        if (!try_size(plan, thread_count, status))
            return false;
        if (lut->error.max <= lut->epsilon)
            return true;
        if (!grow(plan, &has_grown, status))
            return false;
    }
    return dipole_fail(status, DIPOLE_NOT_CONVERGED, NULL,
                       "%d x %d x %d texels reach a relative error of %.2g, expected at most epsilon = %g",
                       lut->size[0], lut->size[1], lut->size[2], lut->error.max, lut->epsilon);
}

static bool check_request(const struct lut_request *request, dipole_status *status)
{
    if (!lut_request_check(request, status))
        return false;
    for (int i = 0; i < 2; i++)
        if (request->size[i] != 0 &&
            (request->size[i] < LUT_TSM_SIDE_MIN || request->size[i] > LUT_TSM_SIDE_MAX))
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "a volume of %d x %d x %d, expected %d to %d for %s", request->size[0],
                               request->size[1], request->size[2], LUT_TSM_SIDE_MIN, LUT_TSM_SIDE_MAX,
                               i == 0 ? "S" : "T");
    if (request->size[2] != 0 && !lut_pattern_has(request->size[2]))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "a volume of %d slices, expected 16, 32, 64, 128 or 256", request->size[2]);
    return true;
}

bool lut_tsm_bake(const struct lut_request *request, int thread_count, struct lut_tsm **lut_out,
                  dipole_status *status)
{
    static const int usual[3] = { 64, 64, 32 };
    *lut_out = NULL;
    if (!check_request(request, status))
        return false;
    struct lut_tsm *const lut = calloc(1, sizeof *lut);
    if (!lut)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    lut->material = request->materials[0];
    lut->epsilon = request->epsilon;
    lut->is_half = request->is_half;
    for (int i = 0; i < 3; i++) {
        lut->size_asked[i] = request->size[i];
        lut->size[i] = request->size[i] > 0 ? request->size[i] : usual[i];
    }
    struct plan *plan = NULL;
    const bool is_done = plan_create(lut, &plan, status) && size_find(plan, thread_count, status);
    plan_destroy(plan);
    if (is_done)
        *lut_out = lut;
    else
        lut_tsm_destroy(lut);
    return is_done;
}

bool lut_tsm_audit(const struct lut_tsm *lut, int depth_count, unsigned seed, struct lut_error *error_out,
                   dipole_status *status)
{
    struct lut_tsm copy = *lut; /* the plan derives its lengths anew */
    struct plan *plan = NULL;
    const bool is_done =
        plan_create(&copy, &plan, status) && audit(plan, AUDIT_BOTH, depth_count, seed, error_out, status);
    plan_destroy(plan);
    return is_done;
}
