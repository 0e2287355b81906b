#include "renderer/reference_tree.h"

#include <math.h>
#include <stdlib.h>

/* The sums' inner loops, for processors with and without wider vectors: the same operations, the same
 * result. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif

enum {
    LEAF_POINTS = 12, /* fewer are not parted */
    PAIRS = 6,        /* xx xy xz yy yz zz                         */
    TRIPLES = 10,     /* xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz */
};

/* What all parts together may err by, of the whole. A hundredth is left for what the profile's table errs
 * by. */
static const double whole_share = 0.99 * RENDER_TREE_ERROR;

/* A part may err by so much of what it adds, in units of whole_share. Most err by much less than they may,
 * so too much is allowed at first, and less and less while all together err by too much. At the last share
 * they cannot. */
static const double first_share = 8, next_share = 0.7, last_share = 0.5;

/* Parts that are summed as one, at most; more are summed at the last share. */
enum { PART_LIMIT = 1 << 20, PARTS_AT_FIRST = 4096 };

/* The bound below the whole is summed over parts this small, as part of their distance. */
static const double rough_size = 0.3;

static const int pair_of[3][3] = { { 0, 1, 2 }, { 1, 3, 4 }, { 2, 4, 5 } };
static const int triples[TRIPLES][3] = { { 0, 0, 0 }, { 0, 0, 1 }, { 0, 0, 2 }, { 0, 1, 1 }, { 0, 1, 2 },
                                         { 0, 2, 2 }, { 1, 1, 1 }, { 1, 1, 2 }, { 1, 2, 2 }, { 2, 2, 2 } };

/* What says whether a part of the points may be summed as one: small, for there are many to look at. */
struct node {
    render_lanes flux_w, fourth;    /* fourth: moment of the distance from the centre          */
    double centre_mm[3], radius_mm; /* no point is farther from the centre                     */
    uint32_t begin, end;            /* points                                                  */
    uint32_t children;              /* the first of two nodes that follow each other; 0: none  */
};

/* Moments of the flux about the centre: sums of flux times products of up to three coordinates. */
struct moments {
    render_lanes first[3], second[PAIRS], third[TRIPLES];
};

struct render_tree {
    const struct render_tree_point *points;
    struct node *nodes;
    struct moments *moments; /* of the node of the same index */
    size_t count;
};

/* ---- building ----------------------------------------------------------------------------------- */

static void swap(struct render_tree_point *a, struct render_tree_point *b)
{
    const struct render_tree_point held = *a;
    *a = *b;
    *b = held;
}

/* Part the points so that those before middle have no larger coordinate than those from there on. */
static void select_middle(struct render_tree_point *points, size_t begin, size_t end, size_t middle,
                          int axis)
{
    while (end - begin > 1) {
        const double pivot = points[begin + (end - begin) / 2].position_mm[axis];
        size_t low = begin, high = end - 1;
        for (;;) {
            while (points[low].position_mm[axis] < pivot)
                low++;
            while (points[high].position_mm[axis] > pivot)
                high--;
            if (low >= high)
                break;
            swap(&points[low++], &points[high--]);
        }
        /* begin .. high are no larger than the pivot, high + 1 .. end - 1 no smaller */
        if (high + 1 >= end)
            high--;
        if (middle <= high)
            end = high + 1;
        else
            begin = high + 1;
    }
}

static int widest_axis(const struct render_tree_point *points, size_t begin, size_t end)
{
    int widest = 0;
    double width_mm = -1;
    for (int k = 0; k < 3; k++) {
        double min_mm = INFINITY, max_mm = -INFINITY;
        for (size_t i = begin; i < end; i++) {
            min_mm = fmin(min_mm, points[i].position_mm[k]);
            max_mm = fmax(max_mm, points[i].position_mm[k]);
        }
        if (max_mm - min_mm > width_mm) {
            width_mm = max_mm - min_mm;
            widest = k;
        }
    }
    return widest;
}

static double brightness(const render_lanes *flux_w)
{
    return (*flux_w)[0] + (*flux_w)[1] + (*flux_w)[2];
}

/* The mean of the points' places, by all that enters at them, and how far they reach. */
static void find_centre(const struct render_tree_point *points, struct node *node)
{
    double light = 0, moment[3] = { 0 };
    for (uint32_t i = node->begin; i < node->end; i++) {
        const double weight = brightness(&points[i].flux_w);
        light += weight;
        for (int k = 0; k < 3; k++)
            moment[k] += weight * points[i].position_mm[k];
    }
    for (int k = 0; k < 3; k++)
        node->centre_mm[k] = moment[k] / light;
    double square = 0;
    for (uint32_t i = node->begin; i < node->end; i++) {
        double away2 = 0;
        for (int k = 0; k < 3; k++) {
            const double d = points[i].position_mm[k] - node->centre_mm[k];
            away2 += d * d;
        }
        square = fmax(square, away2);
    }
    node->radius_mm = sqrt(square) * (1 + 1e-12);
}

static void add_point(const struct render_tree_point *point, struct node *node, struct moments *moments)
{
    double d[3];
    for (int k = 0; k < 3; k++)
        d[k] = point->position_mm[k] - node->centre_mm[k];
    const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    node->flux_w += point->flux_w;
    for (int k = 0; k < 3; k++)
        moments->first[k] += d[k] * point->flux_w;
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++)
            moments->second[pair_of[i][j]] += (d[i] * d[j]) * point->flux_w;
    }
    for (int t = 0; t < TRIPLES; t++)
        moments->third[t] += (d[triples[t][0]] * d[triples[t][1]] * d[triples[t][2]]) * point->flux_w;
    node->fourth += square * square * point->flux_w;
}

/* Add a child's moments, moved to the parent's centre; exact. */
static void add_child(const struct node *child, const struct moments *of_child, struct node *node,
                      struct moments *moments)
{
    double e[3], e2 = 0;
    for (int k = 0; k < 3; k++) {
        e[k] = child->centre_mm[k] - node->centre_mm[k];
        e2 += e[k] * e[k];
    }
    node->flux_w += child->flux_w;
    for (int k = 0; k < 3; k++)
        moments->first[k] += of_child->first[k] + e[k] * child->flux_w;
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++)
            moments->second[pair_of[i][j]] += of_child->second[pair_of[i][j]] + e[j] * of_child->first[i] +
                                              e[i] * of_child->first[j] + (e[i] * e[j]) * child->flux_w;
    }
    for (int t = 0; t < TRIPLES; t++) {
        const int i = triples[t][0], j = triples[t][1], k = triples[t][2];
        moments->third[t] += of_child->third[t] + e[k] * of_child->second[pair_of[i][j]] +
                             e[j] * of_child->second[pair_of[i][k]] +
                             e[i] * of_child->second[pair_of[j][k]] + (e[j] * e[k]) * of_child->first[i] +
                             (e[i] * e[k]) * of_child->first[j] + (e[i] * e[j]) * of_child->first[k] +
                             (e[i] * e[j] * e[k]) * child->flux_w;
    }
    /* |d + e|^4 = (d^2 + 2 d e + e^2)^2 */
    render_lanes fourth = child->fourth + e2 * e2 * child->flux_w;
    for (int i = 0; i < 3; i++) {
        fourth += (4 * e2 * e[i]) * of_child->first[i] + (2 * e2) * of_child->second[pair_of[i][i]];
        for (int j = 0; j < 3; j++)
            fourth += (4 * e[i] * e[j]) * of_child->second[pair_of[i][j]];
    }
    for (int t = 0; t < TRIPLES; t++) { /* 4 |d|^2 d e: of the triples i i k and i k k */
        const int i = triples[t][0], j = triples[t][1], k = triples[t][2];
        if (i == j || j == k)
            fourth += (4 * e[i == j ? k : i]) * of_child->third[t];
    }
    node->fourth += fourth;
}

static void build(struct render_tree *tree, struct render_tree_point *points, size_t index)
{
    struct node *const node = &tree->nodes[index];
    struct moments *const moments = &tree->moments[index];
    *moments = (struct moments){ .first = { { 0 } } };
    find_centre(points, node);
    if (node->end - node->begin <= LEAF_POINTS) {
        for (uint32_t i = node->begin; i < node->end; i++)
            add_point(&points[i], node, moments);
        return;
    }
    const uint32_t middle = node->begin + (node->end - node->begin) / 2;
    select_middle(points, node->begin, node->end, middle, widest_axis(points, node->begin, node->end));
    node->children = (uint32_t)tree->count;
    tree->count += 2;
    struct node *const children = &tree->nodes[node->children];
    children[0] = (struct node){ .begin = node->begin, .end = middle };
    children[1] = (struct node){ .begin = middle, .end = node->end };
    for (size_t i = 0; i < 2; i++) {
        build(tree, points, node->children + i);
        add_child(&children[i], &tree->moments[node->children + i], node, moments);
    }
}

bool render_tree_create(struct render_tree_point *points, size_t count, struct render_tree **tree_out,
                        dipole_status *status)
{
    *tree_out = NULL;
    struct render_tree *const tree = calloc(1, sizeof *tree);
    /* halves of more than LEAF_POINTS points have at least half as many */
    const size_t node_limit = 2 * (2 * count / LEAF_POINTS) + 1;
    if (tree) {
        tree->nodes = aligned_alloc(sizeof(render_lanes), node_limit * sizeof *tree->nodes);
        tree->moments = aligned_alloc(sizeof(render_lanes), node_limit * sizeof *tree->moments);
    }
    if (!tree || !tree->nodes || !tree->moments) {
        render_tree_destroy(tree);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a tree of %zu points", count);
    }
    tree->points = points;
    if (count > 0) {
        tree->count = 1;
        tree->nodes[0] = (struct node){ .end = (uint32_t)count };
        build(tree, points, 0);
    }
    *tree_out = tree;
    return true;
}

void render_tree_destroy(struct render_tree *tree)
{
    if (!tree)
        return;
    free(tree->nodes);
    free(tree->moments);
    free(tree);
}

/* ---- sums --------------------------------------------------------------------------------------- */

/* How a node is summed: point by point, without error, or as one. */
enum way { WAY_POINTS = 0, WAY_NODE };

struct part {
    render_lanes error, least; /* what it errs by at most; what it adds at least */
    double share;              /* that it takes of what it may err by            */
    uint32_t node;
    enum way way;
};

struct parts {
    struct part *at;
    size_t count, room;
    bool is_full; /* no memory, or more than there may be */
};

/* Targets in a ball. Errors here are times 24, the 4! of Taylor's remainder. */
struct visit {
    const struct render_tree *tree;
    const struct render_profile *profile;
    struct render_tree_targets *targets;
    double centre_mm[3], radius_mm, core_mm;
    render_lanes mean; /* of the profile over all points, at least */
};

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double distance_mm(const double a_mm[3], const double b_mm[3])
{
    const double x = a_mm[0] - b_mm[0], y = a_mm[1] - b_mm[1], z = a_mm[2] - b_mm[2];
    return sqrt(x * x + y * y + z * z);
}

/* Taylor's series of the profile in the square of the distance, up to third powers of the extent. */
WIDE static void add_node(const struct node *node, const struct moments *moments,
                          const struct render_profile *profile, struct render_tree_targets *targets)
{
    const render_lanes *const m1 = moments->first, *const m2 = moments->second, *const m3 = moments->third;
    const render_lanes trace = m2[0] + m2[3] + m2[5];
    const render_lanes third_x = m3[0] + m3[3] + m3[5], third_y = m3[1] + m3[6] + m3[8],
                       third_z = m3[2] + m3[7] + m3[9];
    for (int i = 0; i < targets->count; i++) {
        const double x = targets->position_mm[i][0] - node->centre_mm[0];
        const double y = targets->position_mm[i][1] - node->centre_mm[1];
        const double z = targets->position_mm[i][2] - node->centre_mm[2];
        double u;
        const render_lanes *const t = render_profile_find(profile, x * x + y * y + z * z, &u)->terms;
        const render_lanes f0 = t[0] + u * (t[1] + u * (t[2] + u * (t[3] + u * (t[4] + u * t[5]))));
        const render_lanes f1 = t[1] + u * (2 * t[2] + u * (3 * t[3] + u * (4 * t[4] + u * (5 * t[5]))));
        const render_lanes half_f2 = t[2] + u * (3 * t[3] + u * (6 * t[4] + u * (10 * t[5])));
        const render_lanes sixth_f3 = t[3] + u * (4 * t[4] + u * (10 * t[5]));
        const render_lanes along1 = x * m1[0] + y * m1[1] + z * m1[2];
        const render_lanes along2 = x * (x * m2[0] + (2 * y) * m2[1] + (2 * z) * m2[2]) +
                                    y * (y * m2[3] + (2 * z) * m2[4]) + z * z * m2[5];
        const render_lanes across3 = x * third_x + y * third_y + z * third_z;
        const render_lanes along3 = x * (x * (x * m3[0] + (3 * y) * m3[1] + (3 * z) * m3[2]) +
                                         y * ((3 * y) * m3[3] + (6 * z) * m3[4]) + (3 * z * z) * m3[5]) +
                                    y * (y * (y * m3[6] + (3 * z) * m3[7]) + (3 * z * z) * m3[8]) +
                                    z * z * z * m3[9];
        targets->sums[i] += f0 * node->flux_w + f1 * (trace - 2 * along1) +
                            4 * half_f2 * (along2 - across3) - 8 * sixth_f3 * along3;
    }
}

WIDE static void add_points(const struct render_tree_point *points, uint32_t count,
                            const struct render_profile *profile, struct render_tree_targets *targets)
{
    for (int i = 0; i < targets->count; i++) {
        render_lanes sum = { 0 };
        for (uint32_t j = 0; j < count; j++) {
            const double x = targets->position_mm[i][0] - points[j].position_mm[0];
            const double y = targets->position_mm[i][1] - points[j].position_mm[1];
            const double z = targets->position_mm[i][2] - points[j].position_mm[2];
            render_lanes value;
            render_profile_at(profile, x * x + y * y + z * z, &value);
            sum += value * points[j].flux_w;
        }
        targets->sums[i] += sum;
    }
}

/* No less than this arrives at a target from a point of the node, for each unit of its flux: the least up
 * to the farthest that they can be apart. */
static inline void least_value(const struct visit *visit, const struct node *node, double away_mm,
                               render_lanes *value_out)
{
    const double far_mm = smaller(larger(away_mm + node->radius_mm + visit->radius_mm, visit->core_mm),
                                  visit->profile->far_mm);
    double u;
    *value_out = render_profile_find(visit->profile, far_mm * far_mm, &u)->least;
}

/* The share that an error takes of what a node may err by. */
static inline double share_of(const struct visit *visit, const struct node *node, const struct part *part)
{
    double share = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double allowed = 24 * whole_share * larger(part->least[c], node->flux_w[c] * visit->mean[c]);
        if (part->error[c] > 0)
            share = larger(share, part->error[c] / allowed);
    }
    return share;
}

/* The cheapest way of summing a node that takes no more than share, and what it errs by, at most, at any
 * target. */
WIDE static void judge(const struct visit *visit, uint32_t index, double share, struct part *part)
{
    const struct node *const node = &visit->tree->nodes[index];
    const double away_mm = distance_mm(visit->centre_mm, node->centre_mm);
    const double near_mm = larger(away_mm - node->radius_mm - visit->radius_mm, 0);
    double u;
    *part = (struct part){ .node = index };
    least_value(visit, node, away_mm, &part->least);
    part->least *= node->flux_w;
    if (visit->core_mm > 0 && near_mm <= visit->core_mm)
        return;
    const render_lanes bound = render_profile_find(visit->profile, near_mm * near_mm, &u)->bound;
    part->way = WAY_NODE;
    part->error = bound * node->fourth;
    part->share = share_of(visit, node, part);
    if (part->share <= share)
        return;
    part->way = WAY_POINTS;
    part->error = (render_lanes){ 0 };
    part->share = 0;
}

static void add_part(const struct visit *visit, const struct part *part)
{
    const struct render_tree *const tree = visit->tree;
    const struct node *const node = &tree->nodes[part->node];
    if (part->way == WAY_NODE)
        add_node(node, &tree->moments[part->node], visit->profile, visit->targets);
    else
        add_points(&tree->points[node->begin], node->end - node->begin, visit->profile, visit->targets);
}

static void put(struct parts *parts, const struct part *part)
{
    if (parts->count == parts->room && !parts->is_full) {
        const size_t room = parts->room > 0 ? 2 * parts->room : PARTS_AT_FIRST;
        struct part *const more =
            room <= PART_LIMIT ? aligned_alloc(sizeof(render_lanes), room * sizeof *more) : NULL;
        parts->is_full = !more;
        if (more) {
            if (parts->count > 0)
                memcpy(more, parts->at, parts->count * sizeof *more);
            free(parts->at);
            parts->at = more;
            parts->room = room;
        }
    }
    if (!parts->is_full)
        parts->at[parts->count++] = *part;
}

/* Cut a node into parts that take no more than a share of what they may err by, and keep them, or sum them
 * at once where parts is NULL. */
static void cut(const struct visit *visit, uint32_t index, double share, struct parts *parts)
{
    const uint32_t children = visit->tree->nodes[index].children;
    struct part part;
    judge(visit, index, share, &part);
    if (part.way == WAY_POINTS && children > 0) {
        cut(visit, children, share, parts);
        cut(visit, children + 1, share, parts);
        return;
    }
    if (parts)
        put(parts, &part);
    else
        add_part(visit, &part);
}

/* Cut those of the parts that take more than this share. */
static void cut_again(const struct visit *visit, double share, struct parts *parts)
{
    const size_t count = parts->count;
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t index = parts->at[i].node;
        if (parts->at[i].share <= share)
            parts->at[kept++] = parts->at[i];
        else
            cut(visit, index, share, parts); /* its parts go to the end */
    }
    memmove(parts->at + kept, parts->at + count, (parts->count - count) * sizeof *parts->at);
    parts->count -= count - kept;
}

/* Whether all parts together err by no more than the whole may. */
WIDE static bool is_right(const struct visit *visit, const struct parts *parts)
{
    const render_lanes noise = visit->profile->noise * visit->tree->nodes[0].flux_w;
    render_lanes error = { 0 }, least = { 0 };
    for (size_t i = 0; i < parts->count; i++) {
        error += parts->at[i].error;
        least += parts->at[i].least;
    }
    bool is_right = true;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        is_right = is_right &&
                   error[c] <= 24 * (whole_share * larger(least[c], visit->targets->least[c]) + noise[c]);
    return is_right;
}

/* Add a bound below what arrives at any target. */
static void add_least(const struct visit *visit, const struct node *node, render_lanes *sum)
{
    const double away_mm = distance_mm(visit->centre_mm, node->centre_mm);
    if (node->children == 0 || node->radius_mm + visit->radius_mm < rough_size * away_mm) {
        render_lanes least;
        least_value(visit, node, away_mm, &least);
        *sum += node->flux_w * least;
        return;
    }
    add_least(visit, &visit->tree->nodes[node->children], sum);
    add_least(visit, &visit->tree->nodes[node->children + 1], sum);
}

static void enclose(struct visit *visit)
{
    const struct render_tree_targets *const targets = visit->targets;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < targets->count; i++)
            visit->centre_mm[k] += targets->position_mm[i][k] / targets->count;
    }
    for (int i = 0; i < targets->count; i++)
        visit->radius_mm = fmax(visit->radius_mm, distance_mm(visit->centre_mm, targets->position_mm[i]));
    visit->radius_mm *= 1 + 1e-12;
}

void render_tree_add(const struct render_tree *tree, const struct render_profile *profile,
                     struct render_tree_targets *targets)
{
    if (tree->count == 0 || targets->count == 0)
        return;
    struct visit visit = {
        .tree = tree, .profile = profile, .targets = targets, .core_mm = sqrt(profile->core_mm2)
    };
    enclose(&visit);
    const struct node *const root = &tree->nodes[0];
    render_lanes least = { 0 };
    add_least(&visit, root, &least);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (root->flux_w[c] > 0)
            visit.mean[c] = larger(least[c], targets->least[c]) / root->flux_w[c] +
                            profile->noise[c] / RENDER_TREE_ERROR;
    }
    struct parts parts = { .count = 0 };
    double share = first_share;
    cut(&visit, 0, share, &parts);
    while (!parts.is_full && share > last_share && !is_right(&visit, &parts)) {
        share = larger(next_share * share, last_share);
        cut_again(&visit, share, &parts);
    }
    for (size_t i = 0; i < parts.count && !parts.is_full; i++)
        add_part(&visit, &parts.at[i]);
    if (parts.is_full)
        cut(&visit, 0, last_share, NULL);
    free(parts.at);
}
