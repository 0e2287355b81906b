/* What a volume is baked from: sources of the model, cells of the pattern, and the power that each
 * receives. T32. */
#include "lutgen/tsm.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* ---- power that a cell receives ----------------------------------------------------------------- */

/*
 * Power through a polygon of the plane across the light, by the power within discs: with the angle phi of a
 * point of its edge and the distance rho(phi), the sum over edges of int W(rho) dphi/(2 pi), W the power
 * within a disc of radius rho about the point. Gauss's rule of 8 points on each edge.
 */
static const double gauss_x[LUT_GAUSS_POINTS] = { -0.9602898564975363, -0.7966664774136267,
                                                  -0.5255324099163290, -0.1834346424956498,
                                                  0.1834346424956498,  0.5255324099163290,
                                                  0.7966664774136267,  0.9602898564975363 };
static const double gauss_w[LUT_GAUSS_POINTS] = { 0.1012285362903763, 0.2223810344533745,
                                                  0.3137066458778873, 0.3626837833783620,
                                                  0.3626837833783620, 0.3137066458778873,
                                                  0.2223810344533745, 0.1012285362903763 };

/* Radii and weights of the sum for one polygon; returns how many. */
static int polygon_rule(const double (*corners)[2], double scale_mm, double *r_mm, double *weight)
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
        for (int i = 0; i < LUT_GAUSS_POINTS; i++, count++) {
            r_mm[count] = scale_mm * distance / cos(0.5 * (from + to) + 0.5 * (to - from) * gauss_x[i]);
            weight[count] = turn * gauss_w[i] * 0.5 * (to - from) / (2 * PI);
        }
    }
    return count;
}

/* ---- cells ---------------------------------------------------------------------------------- */

static bool are_mirrored(const struct lut_cell *a, const struct lut_cell *b)
{
    const double au = fabs(a->centre[0]), av = fabs(a->centre[1]);
    const double bu = fabs(b->centre[0]), bv = fabs(b->centre[1]);
    const double small = 1e-9 * (au + av + 1);
    return fabs(a->area - b->area) < small && fabs(fmax(au, av) - fmax(bu, bv)) < small &&
           fabs(fmin(au, av) - fmin(bu, bv)) < small;
}

/* Cells share edges, and most are symmetric: most radii occur more than once. */
static int radius_find(struct lut_tsm_plan *plan, double r_mm)
{
    int i = 0;
    while (i < plan->radius_count && fabs(plan->r_mm[i] - r_mm) > 1e-12 * r_mm)
        i++;
    if (i == plan->radius_count)
        plan->r_mm[plan->radius_count++] = r_mm;
    return i;
}

static void class_init(struct lut_tsm_plan *plan, const struct lut_cell *cell, struct lut_cell_class *class)
{
    double r_mm[LUT_RULE_LIMIT], weight[LUT_RULE_LIMIT];
    *class = (struct lut_cell_class){ .cell = *cell, .first = plan->term_count };
    const int count = polygon_rule(cell->corners, plan->lut->inner_mm, r_mm, weight);
    struct lut_rule_term *const terms = plan->terms + class->first;
    for (int i = 0; i < count; i++) {
        const int radius = radius_find(plan, r_mm[i]);
        int k = 0;
        while (k < class->count && terms[k].radius != radius)
            k++;
        if (k == class->count)
            terms[class->count++] = (struct lut_rule_term){ .radius = radius };
        terms[k].weight += weight[i];
    }
    plan->term_count += class->count;
    if (cell->is_inner) /* they come first */
        plan->inner_radius_count = plan->radius_count;
}

static void classes_find(struct lut_tsm_plan *plan)
{
    for (int i = 0; i < plan->lut->sample_count; i++) {
        int k = 0;
        while (k < plan->class_count && !are_mirrored(&plan->classes[k].cell, &plan->cells[i]))
            k++;
        struct lut_cell_class *const class = &plan->classes[k];
        if (k == plan->class_count) {
            plan->class_count++;
            class_init(plan, &plan->cells[i], class);
        }
        class->members[class->member_count++] = i;
        plan->class_of[i] = k;
    }
    plan->r_mm[plan->radius_count] = INFINITY;
}

/* Of one cell. Far out the sum of turns leaves a rounding of the total: see power_rounding. */
static double class_power(const struct lut_tsm_plan *plan, const struct lut_cell_class *class,
                          const double *within)
{
    double power = 0;
    for (int i = class->first; i < class->first + class->count; i++)
        power += plan->terms[i].weight * within[plan->terms[i].radius];
    return fmax(power, 0);
}

/* Of the total: powers below it are noise. */
static const double power_rounding = 1e-13;

void lut_tsm_means_find(const struct lut_tsm_plan *plan, int channel, double dz_mm,
                        const struct lut_tsm_work *work)
{
    double *const within = work->within, *const means = work->means + channel * plan->class_count;
    const double inner_area = plan->lut->inner_mm * plan->lut->inner_mm;
    dipole_sources_within_many(&plan->sources[channel], -dz_mm, plan->r_mm, (size_t)plan->radius_count + 1,
                               within);
    const double noise = power_rounding * within[plan->radius_count];
    double rest = within[plan->radius_count], outermost = 0;
    for (int k = 0; k < plan->class_count; k++) {
        const struct lut_cell_class *const class = &plan->classes[k];
        const double power = class_power(plan, class, within);
        means[k] = power > noise ? power / (class->cell.area * inner_area) : -1;
        outermost += class->cell.is_outermost ? power * class->member_count : 0;
        rest -= power * class->member_count;
    }
    for (int k = 0; k < plan->class_count && outermost > noise && rest > noise; k++)
        if (plan->classes[k].cell.is_outermost)
            means[k] *= 1 + rest / outermost;
}

static double inner_power(const struct lut_tsm_plan *plan, int channel, double dz_mm,
                          const struct lut_tsm_work *work)
{
    dipole_sources_within_many(&plan->sources[channel], -dz_mm, plan->r_mm,
                               (size_t)plan->inner_radius_count, work->within);
    double power = 0;
    for (int k = 0; k < plan->class_count && plan->classes[k].cell.is_inner; k++)
        power += class_power(plan, &plan->classes[k], work->within) * plan->classes[k].member_count;
    return power;
}

double lut_tsm_inner_part(const struct lut_tsm_plan *plan, int channel, double dz_mm,
                          const struct lut_tsm_work *work)
{
    return inner_power(plan, channel, dz_mm, work) / plan->flat_inner_power[channel];
}

/* The response at the cell's centre, by the distance to the sources, times mean over centre where the
 * surface lies across the light; times 1 where the mean is lost in noise. */
void lut_tsm_response(const struct lut_tsm_plan *plan, int channel, int sample, double dz_mm, size_t count,
                      const struct lut_tsm_work *work)
{
    const int k = plan->class_of[sample];
    const double *const centre = plan->classes[k].cell.centre;
    const double u = centre[0] * plan->lut->inner_mm, v = centre[1] * plan->lut->inner_mm;
    const double distance = sqrt(u * u + v * v + dz_mm * dz_mm);
    work->cosines[count] = distance > 0 ? -dz_mm / distance : 1;
    dipole_sources_profile_per_mm2(&plan->sources[channel], distance, work->cosines, count + 1,
                                   work->values);
    const double mean = work->means[channel * plan->class_count + k];
    const double factor = mean < 0 ? 1 : work->values[count] > 0 ? mean / work->values[count] : 0;
    for (size_t i = 0; i < count; i++)
        work->values[i] *= factor;
}

double lut_tsm_global_part(const struct lut_tsm_plan *plan, int sample, double dz_mm)
{
    return plan->cells[sample].is_inner ? 1 - lut_tsm_proximity(plan->lut, dz_mm) : 1;
}

static double kernel_mean(const struct lut_tsm_plan *plan, int channel, int i, int j)
{
    const double side = 1.0 / LUT_TSM_LOCAL_SIDE, cell_mm = side * plan->lut->inner_mm;
    const double u = i * side - 0.5, v = j * side - 0.5;
    const double corners[4][2] = { { u, v }, { u + side, v }, { u + side, v + side }, { u, v + side } };
    double r_mm[LUT_RULE_LIMIT], weight[LUT_RULE_LIMIT], within[LUT_RULE_LIMIT], power = 0;
    const int count = polygon_rule(corners, plan->lut->inner_mm, r_mm, weight);
    dipole_sources_within_many(&plan->sources[channel], 0, r_mm, (size_t)count, within);
    for (int k = 0; k < count; k++)
        power += weight[k] * within[k];
    return fmax(power, 0) / (cell_mm * cell_mm); /* as in class_power */
}

/* Cells are each other's mirror images in eight ways. */
void lut_tsm_kernel_find(const struct lut_tsm_plan *plan, int channel,
                         double means[LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE])
{
    const int last = LUT_TSM_LOCAL_SIDE - 1;
    for (int j = 0; j <= last / 2; j++)
        for (int i = 0; i <= j; i++) {
            const double mean = kernel_mean(plan, channel, i, j);
            for (int mirror = 0; mirror < 8; mirror++) {
                const int x = mirror & 1 ? last - i : i, y = mirror & 2 ? last - j : j;
                means[mirror & 4 ? x * LUT_TSM_LOCAL_SIDE + y : y * LUT_TSM_LOCAL_SIDE + x] = mean;
            }
        }
}

/* ---- plans ---------------------------------------------------------------------------------- */

bool lut_tsm_work_create(const struct lut_tsm_plan *plan, size_t cosine_count, struct lut_tsm_work *work)
{
    const size_t radii = (size_t)plan->radius_count + 1,
                 means = IO_CHANNEL_COUNT * (size_t)plan->class_count, cosines = cosine_count + 1;
    double *const all = malloc((radii + means + 2 * cosines) * sizeof *all);
    *work =
        all ? (struct lut_tsm_work){ all, all + radii, all + radii + means, all + radii + means + cosines }
            : (struct lut_tsm_work){ 0 };
    return all != NULL;
}

void lut_tsm_work_end(struct lut_tsm_work *work)
{
    free(work->within);
}

void lut_tsm_plan_destroy(struct lut_tsm_plan *plan)
{
    if (plan) {
        lut_profiles_end(plan->profiles);
        free(plan->r_mm);
        free(plan->terms);
    }
    free(plan);
}

/* Lengths and samples follow from the material and the number of slices. */
static void lengths_find(struct lut_tsm_plan *plan)
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
    lut->inner_mm = lut_tsm_inner_mm(r_max_mm, lut->size[2]);
    lut->depth_max_mm = r_max_mm;
    lut->depth_scale_mm = lut->inner_mm;
    lut->local_depth_scale_mm = fmin(lut->inner_mm, shortest_mm);
    lut_tsm_samples_fill(lut);
    lut_pattern_cells(lut->size[2], plan->cells);
}

static bool sources_find(struct lut_tsm_plan *plan, dipole_status *status)
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
    }
    return true;
}

bool lut_tsm_plan_create(struct lut_tsm *lut, struct lut_tsm_plan **plan_out, dipole_status *status)
{
    struct lut_tsm_plan *const plan = calloc(1, sizeof *plan);
    const size_t terms = (size_t)LUT_TSM_SAMPLE_LIMIT * LUT_RULE_LIMIT;
    *plan_out = plan;
    if (!plan || !(plan->r_mm = malloc((terms + 1) * sizeof *plan->r_mm)) ||
        !(plan->terms = malloc(terms * sizeof *plan->terms)))
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    plan->lut = lut;
    if (!lut_profiles_init(&lut->material, LUT_TSM_EXTENT_EPSILON, plan->profiles, status) ||
        !lut_profiles_check_range(plan->profiles, status))
        return false;
    lengths_find(plan);
    if (!sources_find(plan, status))
        return false;
    classes_find(plan);
    struct lut_tsm_work work;
    if (!lut_tsm_work_create(plan, 0, &work))
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a volume");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (plan->profiles[c].stack)
            plan->flat_inner_power[c] = inner_power(plan, c, 0, &work);
    lut_tsm_work_end(&work);
    return true;
}
