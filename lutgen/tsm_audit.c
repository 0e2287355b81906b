/* The audit of a translucent-shadow-map volume. T32. */
#include "lutgen/tsm.h"

#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>

/* Most cosines at each depth for each class of cells, one in each of as many parts: one in each interval up
 * to as many. */
enum { COSINE_LIMIT = 64 };

/* An index of an axis in part `part` of `parts`: at a node; in the middle between two, where linear
 * interpolation errs most; or anywhere. */
enum place { AT_NODE, IN_MIDDLE, ANYWHERE };

static double index_choose(uint64_t *random, int node_count, int part, int parts, enum place place)
{
    const double x = (part + lut_random(random)) / parts * (node_count - 1);
    switch (place) {
    case AT_NODE:
        return round(x);
    case IN_MIDDLE:
        return fmin(floor(x), node_count - 2) + 0.5;
    case ANYWHERE:
        break;
    }
    return x;
}

/* Rounds of the audit: depths of the volume, then depth factors of the local response in the middle between
 * two nodes on either side. Each has its own random numbers and its own room for errors. */
struct audit {
    const struct lut_tsm_plan *plan;
    enum lut_tsm_audit_kind kind;
    int depth_count, cosine_count;
    unsigned seed;
    int channel_count; /* that scatter */
    size_t room;       /* errors of one depth */
    double *errors;    /* of all depths, then channel_count for each depth factor */
    struct lut_tsm_work *works;
};

/* Errors of one class at one depth: points in the slices of its members by turns. */
static double *class_audit(const struct audit *audit, const struct lut_cell_class *class, double t,
                           double dz_mm, enum place place, uint64_t *random,
                           const struct lut_tsm_work *work, double *errors)
{
    const struct lut_tsm_plan *const plan = audit->plan;
    const struct lut_tsm *const lut = plan->lut;
    const double part = lut_tsm_global_part(plan, class->members[0], dz_mm);
    double sampled[COSINE_LIMIT][IO_CHANNEL_COUNT];
    for (int k = 0; k < audit->cosine_count; k++) {
        const double s = index_choose(random, lut->size[0], k, audit->cosine_count, place);
        work->cosines[k] = 2 * s / (lut->size[0] - 1) - 1;
        lut_tsm_sample_at(lut, class->members[k % class->member_count], s, t, sampled[k]);
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        lut_tsm_response(plan, c, class->members[0], dz_mm, (size_t)audit->cosine_count, work);
        for (int k = 0; k < audit->cosine_count; k++)
            *errors++ = fabs(sampled[k][c] - part * work->values[k]) /
                        fmax(work->values[k], plan->profiles[c].floor_per_mm2);
    }
    return errors;
}

/* Errors at one depth, for every class and channel at some cosines: of two rounds one is in the middle
 * along both axes, so that with two rounds to an interval of T no middle is left out. */
static void depth_audit(const struct audit *audit, int round, uint64_t *random, double *errors)
{
    const struct lut_tsm_plan *const plan = audit->plan;
    const struct lut_tsm *const lut = plan->lut;
    const struct lut_tsm_work *const work = &audit->works[round];
    const enum place off_grid = round % 2 == 0 ? IN_MIDDLE : ANYWHERE;
    const double t = index_choose(random, lut->size[1], round, audit->depth_count,
                                  audit->kind == LUT_AUDIT_S ? AT_NODE : off_grid);
    const double dz_mm = lut_tsm_depth_mm(lut, t);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        if (plan->profiles[c].stack)
            lut_tsm_means_find(plan, c, dz_mm, work);
    for (int k = 0; k < plan->class_count; k++)
        errors = class_audit(audit, &plan->classes[k], t, dz_mm,
                             audit->kind == LUT_AUDIT_T ? AT_NODE : off_grid, random, work, errors);
}

/* The same of the local response's depth factor: relative to the whole response of the inner square, or to
 * R_d(r_max) where that is more. */
static void local_audit(const struct audit *audit, int round, double *errors)
{
    const struct lut_tsm_plan *const plan = audit->plan;
    const struct lut_tsm *const lut = plan->lut;
    const int intervals = lut->size[0] - 1, i = round - audit->depth_count;
    const double dz_mm = (i < intervals ? 1 : -1) * lut_tsm_local_depth_mm(lut, i % intervals + 0.5);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!plan->profiles[c].stack)
            continue;
        double sampled[IO_CHANNEL_COUNT];
        const double whole = lut_tsm_inner_part(plan, c, dz_mm, &audit->works[round]);
        const double least =
            plan->profiles[c].floor_per_mm2 * lut->inner_mm * lut->inner_mm / plan->flat_inner_power[c];
        lut_tsm_local_depth_factor(lut, dz_mm, sampled);
        *errors++ = fabs(sampled[c] - lut_tsm_proximity(lut, dz_mm) * whole) / fmax(whole, least);
    }
}

static void round_run(void *context, int round)
{
    const struct audit *const audit = context;
    uint64_t random = ((uint64_t)audit->seed << 32) + (uint64_t)round;
    const size_t depths = (size_t)audit->depth_count, i = (size_t)round;
    if (round < audit->depth_count)
        depth_audit(audit, round, &random, audit->errors + i * audit->room);
    else
        local_audit(audit, round,
                    audit->errors + depths * audit->room + (i - depths) * (size_t)audit->channel_count);
}

/* Those of the volume give the percentile; those of the local response count for the largest. */
static struct lut_error errors_sum(const struct audit *audit, size_t count)
{
    const size_t of_volume = (size_t)audit->depth_count * audit->room;
    struct lut_error error = { 0 };
    if (of_volume > 0)
        error = lut_error_of(audit->errors, of_volume);
    if (count > of_volume)
        error.max = fmax(error.max, lut_error_of(audit->errors + of_volume, count - of_volume).max);
    return error;
}

bool lut_tsm_plan_audit(const struct lut_tsm_plan *plan, enum lut_tsm_audit_kind kind, int depth_count,
                        unsigned seed, int thread_count, struct lut_error *error_out, dipole_status *status)
{
    const int rounds = depth_count + (kind == LUT_AUDIT_BOTH ? 2 * (plan->lut->size[0] - 1) : 0);
    const int intervals = plan->lut->size[0] - 1;
    struct audit audit = { .plan = plan,
                           .kind = kind,
                           .depth_count = depth_count,
                           .cosine_count = intervals < COSINE_LIMIT ? intervals : COSINE_LIMIT,
                           .seed = seed };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        audit.channel_count += plan->profiles[c].stack != NULL;
    audit.room = (size_t)plan->class_count * (size_t)audit.cosine_count * (size_t)audit.channel_count;
    const size_t count =
        (size_t)depth_count * audit.room + (size_t)(rounds - depth_count) * (size_t)audit.channel_count;
    audit.errors = malloc((count + 1) * sizeof *audit.errors); /* + 1: nothing may scatter */
    audit.works = calloc((size_t)rounds, sizeof *audit.works);
    bool is_done = audit.errors && audit.works;
    for (int i = 0; i < rounds && is_done; i++)
        is_done = lut_tsm_work_create(plan, (size_t)audit.cosine_count, &audit.works[i]);
    if (is_done) {
        lut_parallel_for(rounds, thread_count, round_run, &audit);
        *error_out = errors_sum(&audit, count);
    }
    for (int i = 0; i < rounds && audit.works; i++)
        lut_tsm_work_end(&audit.works[i]);
    free(audit.works);
    free(audit.errors);
    return is_done ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the audit of a volume");
}

bool lut_tsm_audit(const struct lut_tsm *lut, int depth_count, unsigned seed, struct lut_error *error_out,
                   dipole_status *status)
{
    struct lut_tsm copy = *lut; /* the plan derives its lengths anew */
    struct lut_tsm_plan *plan = NULL;
    const bool is_done = lut_tsm_plan_create(&copy, &plan, status) &&
                         lut_tsm_plan_audit(plan, LUT_AUDIT_BOTH, depth_count, seed, 0, error_out, status);
    lut_tsm_plan_destroy(plan);
    return is_done;
}
