#include "fit/clusters.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Radius over distance at which a cluster is taken as a whole. */
static const double cluster_angle = 1.0 / 7;

enum { LEAF_SIZE = 8, AXES = 3, SWEEPS = 12 };

struct node {
    double mean_mm[3], radius_mm;
    float axes_mm[AXES][3]; /* principal axes, so long that points at both ends have the moments */
    float flux_w[FIT_CHANNEL_COUNT];
    uint32_t first, count; /* samples */
    uint32_t right;        /* the left child follows its parent; 0: a leaf */
};

/* A binary tree: each node halves its samples across the longest side of their box. */
struct fit_clusters {
    struct render_light_sample *samples;
    struct node *nodes;
    uint32_t node_count;
};

/* ---- the tree ---------------------------------------------------------------------------------------- */

/* Eigenvectors of a symmetric matrix by Jacobi's rotations: m becomes diagonal, the columns of v the
 * vectors.
 */
static void diagonalize(double m[AXES][AXES], double v[AXES][AXES])
{
    for (int i = 0; i < AXES; i++) {
        for (int k = 0; k < AXES; k++)
            v[i][k] = i == k;
    }
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        for (int p = 0; p < AXES; p++) {
            for (int q = p + 1; q < AXES; q++) {
                if (m[p][q] == 0)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = copysign(1, theta) / (fabs(theta) + hypot(theta, 1));
                const double c = 1 / hypot(t, 1), s = t * c;
                for (int k = 0; k < AXES; k++) {
                    const double kp = m[k][p], kq = m[k][q];
                    m[k][p] = c * kp - s * kq;
                    m[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < AXES; k++) {
                    const double pk = m[p][k], qk = m[q][k], vp = v[k][p], vq = v[k][q];
                    m[p][k] = c * pk - s * qk;
                    m[q][k] = s * pk + c * qk;
                    v[k][p] = c * vp - s * vq;
                    v[k][q] = s * vp + c * vq;
                }
            }
        }
    }
}

static double brightness(const struct render_light_sample *sample)
{
    return (double)sample->flux_w[0] + (double)sample->flux_w[1] + (double)sample->flux_w[2];
}

static void summarize(const struct render_light_sample *samples, struct node *node)
{
    double weight = 0, flux_w[FIT_CHANNEL_COUNT] = { 0 }, moments[AXES][AXES] = { { 0 } }, axes[AXES][AXES];
    for (int a = 0; a < 3; a++)
        node->mean_mm[a] = 0;
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        for (int a = 0; a < 3; a++)
            node->mean_mm[a] += brightness(&samples[i]) * (double)samples[i].position_mm[a];
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            flux_w[c] += (double)samples[i].flux_w[c];
        weight += brightness(&samples[i]);
    }
    for (int a = 0; a < 3; a++)
        node->mean_mm[a] =
            weight > 0 ? node->mean_mm[a] / weight : (double)samples[node->first].position_mm[a];
    node->radius_mm = 0;
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        double offset[3];
        for (int a = 0; a < 3; a++)
            offset[a] = (double)samples[i].position_mm[a] - node->mean_mm[a];
        for (int a = 0; a < 3; a++) {
            for (int b = 0; b < 3; b++)
                moments[a][b] += weight > 0 ? brightness(&samples[i]) / weight * offset[a] * offset[b] : 0;
        }
        node->radius_mm = fmax(node->radius_mm, hypot(hypot(offset[0], offset[1]), offset[2]));
    }
    diagonalize(moments, axes);
    for (int k = 0; k < AXES; k++) {
        for (int a = 0; a < 3; a++)
            node->axes_mm[k][a] = (float)(sqrt(AXES * fmax(moments[k][k], 0)) * axes[a][k]);
    }
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        node->flux_w[c] = (float)flux_w[c];
}

static int longest_side(const struct render_light_sample *samples, uint32_t count)
{
    float lo[3] = { INFINITY, INFINITY, INFINITY }, hi[3] = { -INFINITY, -INFINITY, -INFINITY };
    for (uint32_t i = 0; i < count; i++) {
        for (int a = 0; a < 3; a++) {
            lo[a] = fminf(lo[a], samples[i].position_mm[a]);
            hi[a] = fmaxf(hi[a], samples[i].position_mm[a]);
        }
    }
    int longest = 0;
    for (int a = 1; a < 3; a++)
        longest = hi[a] - lo[a] > hi[longest] - lo[longest] ? a : longest;
    return longest;
}

/* Bring the samples with the smaller coordinates before index middle: quickselect, by the median of three.
 */
static void halve(struct render_light_sample *samples, uint32_t count, uint32_t middle, int axis)
{
    uint32_t low = 0, high = count - 1;
    while (low < high) {
        const float a = samples[low].position_mm[axis], b = samples[(low + high) / 2].position_mm[axis],
                    c = samples[high].position_mm[axis];
        const float pivot = fmaxf(fminf(a, b), fminf(fmaxf(a, b), c));
        uint32_t i = low, k = high;
        for (;;) {
            while (samples[i].position_mm[axis] < pivot)
                i++;
            while (samples[k].position_mm[axis] > pivot)
                k--;
            if (i >= k)
                break;
            const struct render_light_sample moved = samples[i];
            samples[i++] = samples[k];
            samples[k--] = moved;
        }
        if (middle <= k)
            high = k;
        else
            low = k + 1;
    }
}

/* Depth is at most the logarithm of the count: halves are even. */
static void build(struct fit_clusters *clusters, uint32_t first, uint32_t count)
{
    struct node *const node = &clusters->nodes[clusters->node_count++];
    *node = (struct node){ .first = first, .count = count };
    summarize(clusters->samples, node);
    if (count <= LEAF_SIZE)
        return;
    halve(clusters->samples + first, count, count / 2, longest_side(clusters->samples + first, count));
    build(clusters, first, count / 2);
    node->right = clusters->node_count;
    build(clusters, first + count / 2, count - count / 2);
}

/* Copy the samples of an object, or all; returns how many. */
static size_t copy_samples(const struct render_light_sample *samples, size_t count, int object,
                           struct render_light_sample *out)
{
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        if (object < 0 || samples[i].object == (float)object)
            out[kept++] = samples[i];
    }
    return kept;
}

bool fit_clusters_create(const struct render_light_sample *samples, size_t count, int object,
                         struct fit_clusters **clusters_out, dipole_status *status)
{
    struct fit_clusters *const clusters = calloc(1, sizeof *clusters);
    *clusters_out = NULL;
    if (clusters && count <= UINT32_MAX / 2) {
        clusters->samples = malloc(count * sizeof *clusters->samples);
        /* leaves hold more than half of LEAF_SIZE, unless all are in one */
        clusters->nodes = malloc((4 * count / LEAF_SIZE + 2) * sizeof *clusters->nodes);
    }
    if (!clusters || !clusters->samples || !clusters->nodes) {
        fit_clusters_destroy(clusters);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu light samples", count);
    }
    const size_t kept = copy_samples(samples, count, object, clusters->samples);
    if (kept > 0)
        build(clusters, 0, (uint32_t)kept);
    *clusters_out = clusters;
    return true;
}

void fit_clusters_destroy(struct fit_clusters *clusters)
{
    if (!clusters)
        return;
    free(clusters->samples);
    free(clusters->nodes);
    free(clusters);
}

/* ---- points ------------------------------------------------------------------------------------------ */

void fit_points_destroy(struct fit_points *points)
{
    free(points->x);
    *points = (struct fit_points){ 0 };
}

static bool points_reserve(struct fit_points *points, size_t more)
{
    enum { ARRAYS = 3 + FIT_CHANNEL_COUNT };
    if (points->count + more <= points->capacity)
        return true;
    const size_t capacity = 2 * points->capacity + more + 1024;
    float *const memory = malloc(ARRAYS * capacity * sizeof *memory);
    if (!memory)
        return false;
    float *const old[ARRAYS] = { points->x,         points->y,         points->z,
                                 points->flux_w[0], points->flux_w[1], points->flux_w[2] };
    float **const now[ARRAYS] = { &points->x,         &points->y,         &points->z,
                                  &points->flux_w[0], &points->flux_w[1], &points->flux_w[2] };
    for (size_t k = 0; k < ARRAYS; k++) {
        if (points->count > 0)
            memcpy(memory + k * capacity, old[k], points->count * sizeof *memory);
        *now[k] = memory + k * capacity;
    }
    free(old[0]);
    points->capacity = capacity;
    return true;
}

static void add_point(struct fit_points *points, const double at_mm[3],
                      const float flux_w[FIT_CHANNEL_COUNT], float share)
{
    const size_t i = points->count++;
    points->x[i] = (float)at_mm[0];
    points->y[i] = (float)at_mm[1];
    points->z[i] = (float)at_mm[2];
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        points->flux_w[c][i] = share * flux_w[c];
}

static bool add_cluster(const struct node *node, struct fit_points *points)
{
    if (!points_reserve(points, 2 * AXES))
        return false;
    for (int k = 0; k < AXES; k++) {
        for (int end = -1; end <= 1; end += 2) {
            double at_mm[3];
            for (int a = 0; a < 3; a++)
                at_mm[a] = node->mean_mm[a] + end * (double)node->axes_mm[k][a];
            add_point(points, at_mm, node->flux_w, 0.5f / AXES);
        }
    }
    return true;
}

static bool add_samples(const struct fit_clusters *clusters, const struct node *node,
                        struct fit_points *points)
{
    if (!points_reserve(points, node->count))
        return false;
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        const struct render_light_sample *const sample = &clusters->samples[i];
        const double at_mm[3] = { (double)sample->position_mm[0], (double)sample->position_mm[1],
                                  (double)sample->position_mm[2] };
        add_point(points, at_mm, sample->flux_w, 1);
    }
    return true;
}

static bool collect(const struct fit_clusters *clusters, uint32_t index, const double position_mm[3],
                    struct fit_points *out)
{
    const struct node *const node = &clusters->nodes[index];
    double square = 0;
    for (int a = 0; a < 3; a++) {
        const double offset_mm = node->mean_mm[a] - position_mm[a];
        square += offset_mm * offset_mm;
    }
    const double reach_mm = node->radius_mm / cluster_angle;
    if (node->count > 2 * AXES && reach_mm * reach_mm <= square)
        return add_cluster(node, out);
    if (node->right == 0)
        return add_samples(clusters, node, out);
    return collect(clusters, index + 1, position_mm, out) &&
           collect(clusters, node->right, position_mm, out);
}

bool fit_clusters_collect(const struct fit_clusters *clusters, const float position_mm[3],
                          struct fit_points *out)
{
    const double at_mm[3] = { (double)position_mm[0], (double)position_mm[1], (double)position_mm[2] };
    out->count = 0;
    if (clusters->node_count == 0 || collect(clusters, 0, at_mm, out))
        return true;
    out->count = 0;
    return false;
}
