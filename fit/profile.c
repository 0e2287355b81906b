#include "fit/profile.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RING_POINTS = 12, TILE_LIMIT = 20, NEIGHBOURS = 3, ROW_MIN = 2 };

static const double unstated_error = 0.01;
static const double finest_share = 0.05; /* of the smallest radius: shortest mean free path looked for */

/* Nodes and weights of Gauss and Legendre's rule of 12 points on -1..1: the upper half. */
static const double gauss_nodes[RING_POINTS / 2] = { 0.1252334085114689, 0.3678314989981802,
                                                     0.5873179542866175, 0.7699026741943047,
                                                     0.9041172563704749, 0.9815606342467193 };
static const double gauss_weights[RING_POINTS / 2] = { 0.2491470458134028, 0.2334925365383548,
                                                       0.2031674267230659, 0.1600783285433462,
                                                       0.1069393259953184, 0.0471753363865118 };

/* The mean over a ring as a sum: with u = r^2, even in area; where the ring ends at or near 0 with u
 * proportional to t^4, which makes a logarithm or 1/r smooth. */
static void ring_rule(double lo_mm, double hi_mm, double *r_mm, double *weights)
{
    const bool is_disc = lo_mm < 0.3 * hi_mm;
    for (size_t i = 0; i < RING_POINTS; i++) {
        const size_t half = i < RING_POINTS / 2 ? RING_POINTS / 2 - 1 - i : i - RING_POINTS / 2;
        const double t = 0.5 + (i < RING_POINTS / 2 ? -0.5 : 0.5) * gauss_nodes[half];
        const double weight = 0.5 * gauss_weights[half];
        if (is_disc) {
            r_mm[i] = sqrt(lo_mm * lo_mm + (hi_mm * hi_mm - lo_mm * lo_mm) * t * t * t * t);
            weights[i] = weight * 4 * t * t * t;
        } else {
            r_mm[i] = lo_mm + (hi_mm - lo_mm) * t;
            weights[i] = weight * 2 * r_mm[i] / (hi_mm + lo_mm);
        }
    }
}

struct ordered {
    const struct io_profile *profile;
    size_t row;
};

static int by_radius(const void *a, const void *b)
{
    const struct ordered *const p = a, *const q = b;
    const double x = io_profile_r_mm(p->profile, p->row), y = io_profile_r_mm(q->profile, q->row);
    return x != y ? (x > y) - (x < y) : (p->row > q->row) - (p->row < q->row);
}

/* Means over a row and its neighbours in radius. */
struct local {
    double value, sem2;
};

static struct local local_means(const struct ordered *rows, size_t count, size_t i)
{
    const struct io_profile *const profile = rows->profile;
    const size_t first = i > NEIGHBOURS ? i - NEIGHBOURS : 0;
    const size_t last = i + NEIGHBOURS < count ? i + NEIGHBOURS : count - 1;
    struct local sum = { 0 };
    for (size_t k = first; k <= last; k++) {
        const double sem = profile->sem_per_mm2 ? profile->sem_per_mm2[rows[k].row] : 0;
        sum.value += fabs(profile->rd_per_mm2[rows[k].row]);
        sum.sem2 += sem * sem;
    }
    const double n = (double)(last - first + 1);
    return (struct local){ sum.value / n, sum.sem2 / n };
}

/* The least error that a row may have: that of the smallest stated, or a part of the largest value. */
static double least_sigma(const struct io_profile *profile)
{
    double least = INFINITY, largest = 0;
    for (size_t i = 0; i < profile->count; i++) {
        if (profile->sem_per_mm2 && profile->sem_per_mm2[i] > 0)
            least = fmin(least, profile->sem_per_mm2[i]);
        largest = fmax(largest, fabs(profile->rd_per_mm2[i]));
    }
    return isfinite(least) ? least : fmax(1e-6 * unstated_error * largest, 1e-300);
}

/*
 * A standard error from few batches is itself a quarter off, and small where chance made the value small:
 * taken as it is it would pull the fit down. So its square is meaned over neighbours; where none is stated
 * the error is a part of the mean value about it.
 */
static double sigma_of(const struct ordered *rows, size_t count, size_t i, double least)
{
    const struct io_profile *const profile = rows->profile;
    const struct local local = local_means(rows, count, i);
    if (!profile->sem_per_mm2)
        return fmax(unstated_error * local.value, least);
    const double own = profile->sem_per_mm2[rows[i].row];
    return fmax(own > 0 || local.sem2 > 0 ? sqrt(local.sem2) : least, least);
}

struct storage {
    double *node_r_mm, *weights;
    struct fit_datum *data;
    struct ordered *rows;
};

static bool storage_allocate(size_t count, size_t nodes_per_row, void **memory_out, struct storage *out)
{
    const size_t node_count = count * nodes_per_row;
    char *const memory = malloc(2 * node_count * sizeof(double) +
                                count * (sizeof(struct fit_datum) + sizeof(struct ordered)));
    *memory_out = memory;
    if (!memory)
        return false;
    out->node_r_mm = (double *)(void *)memory;
    out->weights = out->node_r_mm + node_count;
    out->data = (struct fit_datum *)(void *)(out->weights + node_count);
    out->rows = (struct ordered *)(void *)(out->data + count);
    return true;
}

/* Rows in the order of their radii, without those where the model has no value. */
static size_t take_rows(const struct io_profile *profile, dipole_model model, struct ordered *rows)
{
    const bool has_pole = model == DIPOLE_MODEL_BEAM || model == DIPOLE_MODEL_MODES;
    size_t count = 0;
    for (size_t i = 0; i < profile->count; i++) {
        if (!(has_pole && profile->r_hi_mm[i] == 0))
            rows[count++] = (struct ordered){ profile, i };
    }
    qsort(rows, count, sizeof *rows, by_radius);
    return count;
}

bool fit_profile_target(const struct io_profile *profile, const char *name, int channel, dipole_model model,
                        struct fit_target *target_out, void **memory_out, dipole_status *status)
{
    const size_t nodes_per_row = profile->has_rings ? RING_POINTS : 1;
    const dipole_place place = { .source = name };
    struct storage storage;
    if (!storage_allocate(profile->count, nodes_per_row, memory_out, &storage))
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a profile");
    const size_t count = take_rows(profile, model, storage.rows);
    if (count < ROW_MIN) {
        free(*memory_out);
        *memory_out = NULL;
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "the profile has %zu rows to fit, expected %d or more", count, ROW_MIN);
    }
    const double least = least_sigma(profile);
    const size_t tile_count = count < TILE_LIMIT ? count : TILE_LIMIT;
    double smallest_mm = INFINITY, largest_mm = 0;
    for (size_t i = 0; i < count; i++) {
        const size_t row = storage.rows[i].row;
        double *const r_mm = storage.node_r_mm + i * nodes_per_row;
        double *const weights = storage.weights + i * nodes_per_row;
        const double lo_mm = profile->r_lo_mm[row], hi_mm = profile->r_hi_mm[row];
        size_t used = nodes_per_row;
        if (nodes_per_row > 1 && hi_mm > lo_mm) {
            ring_rule(lo_mm, hi_mm, r_mm, weights);
        } else {
            used = 1;
            for (size_t k = 0; k < nodes_per_row; k++)
                r_mm[k] = hi_mm;
            weights[0] = 1;
        }
        storage.data[i] = (struct fit_datum){ .row = weights,
                                              .first = i * nodes_per_row,
                                              .count = used,
                                              .factor = 1,
                                              .value = profile->rd_per_mm2[row],
                                              .sigma = sigma_of(storage.rows, count, i, least),
                                              .robust = 1,
                                              .channel = channel,
                                              .tile = (int)(i * tile_count / count),
                                              .place = row };
        storage.data[i].stated = profile->sem_per_mm2 ? storage.data[i].sigma : 0;
        if (hi_mm > 0)
            smallest_mm = fmin(smallest_mm, hi_mm);
        largest_mm = fmax(largest_mm, hi_mm);
    }
    const double finest_mm = finest_share * (isfinite(smallest_mm) ? smallest_mm : 1);
    *target_out = (struct fit_target){
        .node_count = count * nodes_per_row,
        .node_r_mm = storage.node_r_mm,
        .row_node_count = count * nodes_per_row,
        .data = storage.data,
        .datum_count = count,
        .tile_count = (int)tile_count,
        .are_sigmas_stated = profile->sem_per_mm2 != NULL,
        .systematic = { .scale = profile->sem_per_mm2 ? 0 : unstated_error, .misfit_factor = 1 },
        .finest_mm = finest_mm,
        .largest_mm = fmax(largest_mm, 10 * finest_mm),
    };
    snprintf(target_out->name, sizeof target_out->name, "%s", name);
    fit_target_measure_scales(target_out);
    return true;
}
