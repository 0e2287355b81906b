#include "fit/operator.h"

#include "fit/clusters.h"
#include "lutgen/parallel.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/*
 * Distances are sorted by y = 1 + (r/s)^2 on an axis that is linear within each octave of y and doubles its
 * step from octave to octave: the bits of y as a float, shifted, are the index, and the bits shifted out
 * are the fraction. No logarithm, no search. Two grids live on that axis:
 *
 *   bins   BINS per octave, where the flux of a pair is shared linearly between its two neighbours;
 *   nodes  FIT_NODES_PER_OCTAVE or as asked, from which the profile at each bin is interpolated by STENCIL
 * points in log y.
 *
 * Linear sharing errs by at most (1/8)(15/4)/BINS^2 = 3e-5 on r^-3, the steepest power law of the dipole,
 * and by less elsewhere; the nodes err by less than that while sigma_tr r < 10 (tests/test_operator.c).
 */
enum {
    BIN_BITS = 7,
    BINS_PER_OCTAVE = 1 << BIN_BITS,
    STENCIL = 6,
    OCTAVE_LIMIT = 60,
    MANTISSA_BITS = 23,
    FRACTION_BITS = MANTISSA_BITS - BIN_BITS,
    BLOCK_PAIRS = 512, /* pairs whose bins are found together: fits the first cache            */
    BLOCK_PIXELS = 32, /* pixels a thread takes at a time                                       */
    PROGRESS_STEPS = 20,
};
static const uint32_t bits_of_one = 0x3f800000u;

static double axis_y(size_t index, size_t per_octave)
{
    const size_t octave = index / per_octave;
    return ldexp(1.0 + (double)(index % per_octave) / (double)per_octave, (int)octave);
}

/* Profile at bin j from nodes first[j] .. first[j] + STENCIL - 1. */
struct stencil {
    size_t first;
    double weights[STENCIL];
};

struct build {
    const struct fit_geometry *geometry;
    struct fit_operator *op;
    struct fit_clusters **clusters; /* of each object, or one of all      */
    int object_count;
    uint32_t *order;          /* of pixels, along a curve through space           */
    int base;                 /* the channel of a single set                      */
    struct stencil *stencils; /* bin_count                                        */
    size_t bin_count;
    size_t bin_value_count; /* set_count x 2 x bin_count                      */
    size_t first_block;     /* of those under way                             */
    float inverse_scale2_per_mm2, cut_y;
    atomic_bool is_out_of_memory;
    const struct fit_progress *progress;
};

/* Lagrange weights in log y, with the profile's far field y^(-3/2) divided out: what is interpolated is
 * nearly constant where R_d is a power law, and the weights still multiply R_d itself. */
static void stencil_init(struct stencil *stencil, double y, size_t per_octave, size_t node_count)
{
    const size_t exact =
        (size_t)ilogb(y) * per_octave + (size_t)((y / ldexp(1.0, ilogb(y)) - 1.0) * (double)per_octave);
    const size_t below = STENCIL / 2 - 1;
    size_t first = exact > below ? exact - below : 0;
    if (first + STENCIL > node_count)
        first = node_count - STENCIL;
    stencil->first = first;
    for (size_t k = 0; k < STENCIL; k++) {
        const double y_k = axis_y(first + k, per_octave);
        double weight = pow(y_k / y, 1.5);
        for (size_t m = 0; m < STENCIL; m++) {
            const double y_m = axis_y(first + m, per_octave);
            if (m != k)
                weight *= log(y / y_m) / log(y_k / y_m);
        }
        stencil->weights[k] = weight;
    }
}

/* Share the flux of every sample between the bins of its distance. Bins hold, per set, the sums of flux
 * and of flux times fraction: two independent sums where hat functions would need four steps. */
static void bin_pixel(const struct build *build, const struct fit_points *points,
                      const float position_mm[3], double *bins)
{
    const size_t set_count = build->op->set_count;
    memset(bins, 0, build->bin_value_count * sizeof *bins);
    for (size_t start = 0; start < points->count; start += BLOCK_PAIRS) {
        const size_t rest = points->count - start;
        const size_t count = rest < BLOCK_PAIRS ? rest : BLOCK_PAIRS;
        uint32_t bits[BLOCK_PAIRS];
        for (size_t i = 0; i < count; i++) {
            const float dx = points->x[start + i] - position_mm[0];
            const float dy = points->y[start + i] - position_mm[1];
            const float dz = points->z[start + i] - position_mm[2];
            const float y = 1.0f + (dx * dx + dy * dy + dz * dz) * build->inverse_scale2_per_mm2;
            /* y = 0 marks what was cut, which the loop below leaves out */
            const float kept = y <= build->cut_y ? y : 0.0f;
            memcpy(&bits[i], &kept, sizeof kept);
        }
        for (size_t set = 0; set < set_count; set++) {
            double *restrict sum = bins + set * 2 * build->bin_count;
            double *restrict moment = sum + build->bin_count;
            const float *flux = points->flux_w[set_count == 1 ? (size_t)build->base : set] + start;
            for (size_t i = 0; i < count; i++) {
                if (bits[i] == 0)
                    continue;
                const uint32_t offset = bits[i] - bits_of_one;
                const size_t bin = offset >> FRACTION_BITS;
                const double fraction =
                    (double)(offset & ((1u << FRACTION_BITS) - 1)) * (1.0 / (1u << FRACTION_BITS));
                sum[bin] += (double)flux[i];
                moment[bin] += (double)flux[i] * fraction;
            }
        }
    }
}

static void row_from_bins(const struct build *build, const double *bins, double *row)
{
    const double *sum = bins, *moment = bins + build->bin_count;
    memset(row, 0, build->op->node_count * sizeof *row);
    for (size_t j = 0; j < build->bin_count; j++) {
        const double flux = sum[j] - moment[j] + (j > 0 ? moment[j - 1] : 0.0);
        if (flux == 0.0)
            continue;
        const struct stencil *stencil = &build->stencils[j];
        for (size_t k = 0; k < STENCIL; k++)
            row[stencil->first + k] += flux * stencil->weights[k];
    }
}

/* The rows of one block of pixels. Every row has one writer, so threads change no bit. */
static void build_block(void *context, int index)
{
    struct build *const build = context;
    struct fit_operator *const op = build->op;
    struct fit_points points = { 0 };
    const size_t first = ((size_t)index + build->first_block) * BLOCK_PIXELS;
    const size_t end = first + BLOCK_PIXELS < op->pixel_count ? first + BLOCK_PIXELS : op->pixel_count;
    double *const bins = malloc(build->bin_value_count * sizeof *bins);
    bool done = bins != NULL;
    for (size_t j = first; done && j < end; j++) {
        const float *const position_mm = build->geometry->positions_mm + 3 * j;
        const int object = build->geometry->objects ? build->geometry->objects[j] : 0;
        done = fit_clusters_collect(build->clusters[object], position_mm, &points);
        if (!done)
            break;
        bin_pixel(build, &points, position_mm, bins);
        for (size_t set = 0; set < op->set_count; set++)
            row_from_bins(build, bins + set * 2 * build->bin_count,
                          op->rows + (set * op->pixel_count + j) * op->node_count);
    }
    if (!done)
        atomic_store(&build->is_out_of_memory, true);
    free(bins);
    fit_points_destroy(&points);
}

/* All blocks, some at a time, so that progress is shown by the calling thread. */
static void build_rows(struct build *build)
{
    const size_t block_count = (build->op->pixel_count + BLOCK_PIXELS - 1) / BLOCK_PIXELS;
    const size_t step = block_count / PROGRESS_STEPS + 1;
    for (size_t first = 0; first < block_count; first += step) {
        const size_t rest = block_count - first;
        build->first_block = first;
        if (build->progress && build->progress->show)
            build->progress->show(build->progress->context, "building the operator",
                                  (double)first / (double)block_count);
        lut_parallel_for((int)(rest < step ? rest : step), 0, build_block, build);
    }
}

/* Twice the diagonal of the box around everything would do; the diagonal itself is the bound. */
static double largest_distance_mm(const struct fit_geometry *geometry)
{
    double lo[3] = { INFINITY, INFINITY, INFINITY }, hi[3] = { -INFINITY, -INFINITY, -INFINITY };
    for (size_t i = 0; i < geometry->pixel_count + geometry->sample_count; i++) {
        const float *position = i < geometry->pixel_count
                                    ? geometry->positions_mm + 3 * i
                                    : geometry->samples[i - geometry->pixel_count].position_mm;
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], (double)position[a]);
            hi[a] = fmax(hi[a], (double)position[a]);
        }
    }
    return hypot(hypot(hi[0] - lo[0], hi[1] - lo[1]), hi[2] - lo[2]);
}

/* The channel with most light, and every channel's share of it. */
static int brightest_channel(const struct fit_geometry *geometry, double colour[FIT_CHANNEL_COUNT])
{
    double total_w[FIT_CHANNEL_COUNT] = { 0.0 };
    for (size_t i = 0; i < geometry->sample_count; i++) {
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            total_w[c] += (double)geometry->samples[i].flux_w[c];
    }
    int base = 0;
    for (int c = 1; c < FIT_CHANNEL_COUNT; c++)
        base = total_w[c] > total_w[base] ? c : base;
    for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
        colour[c] = total_w[base] > 0.0 ? total_w[c] / total_w[base] : 1.0;
    return base;
}

/* Fluxes are floats: colours that agree within a few roundings are one colour. */
static bool is_one_colour(const struct fit_geometry *geometry, int base,
                          const double colour[FIT_CHANNEL_COUNT])
{
    for (size_t i = 0; i < geometry->sample_count; i++) {
        const float *flux_w = geometry->samples[i].flux_w;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++) {
            if (fabs((double)flux_w[c] - colour[c] * (double)flux_w[base]) > 1e-6 * (double)flux_w[base])
                return false;
        }
    }
    return true;
}

static bool operator_allocate(size_t pixel_count, size_t node_count, size_t set_count,
                              struct fit_operator **operator_out)
{
    /* bounds keep the product below from wrapping */
    if (pixel_count > (size_t)1 << 28 || node_count > (size_t)1 << 12)
        return false;
    const size_t value_count = node_count + set_count * pixel_count * node_count;
    struct fit_operator *op = malloc(sizeof *op + value_count * sizeof(double));
    if (!op)
        return false;
    *op = (struct fit_operator){ .pixel_count = pixel_count,
                                 .node_count = node_count,
                                 .set_count = set_count };
    op->node_r_mm = (double *)(void *)(op + 1);
    op->rows = op->node_r_mm + node_count;
    *operator_out = op;
    return true;
}

/* One tree for each object that pixels show, so that light stays in the object that it entered. */
static bool create_clusters(struct build *build)
{
    const struct fit_geometry *const geometry = build->geometry;
    build->object_count = 1;
    for (size_t j = 0; geometry->objects && j < geometry->pixel_count; j++)
        build->object_count =
            geometry->objects[j] >= build->object_count ? geometry->objects[j] + 1 : build->object_count;
    build->clusters = calloc((size_t)build->object_count, sizeof(struct fit_clusters *));
    bool done = build->clusters != NULL;
    for (int object = 0; done && object < build->object_count; object++)
        done = fit_clusters_create(geometry->samples, geometry->sample_count,
                                   geometry->objects ? object : -1, &build->clusters[object], NULL);
    return done;
}

bool fit_operator_create(const struct fit_geometry *geometry, const struct fit_progress *progress,
                         struct fit_operator **operator_out, dipole_status *status)
{
    *operator_out = NULL;
    assert(geometry->pixel_count > 0 && geometry->sample_count > 0 && geometry->finest_mm > 0.0);
    /* Below s the axis is linear in r^2: a third of the shortest mean free path leaves the bend of R_d,
     * at r = z_r, to the logarithmic part. */
    const double scale_mm = geometry->finest_mm / 3.0;
    /* the points of a cluster lie up to sqrt(3) of its radius from its mean, a quarter farther than samples
     */
    const double largest_mm = 1.25 * largest_distance_mm(geometry);
    const double largest_y = 1.0 + pow(largest_mm / scale_mm, 2.0);
    if (!(largest_y < ldexp(1.0, OCTAVE_LIMIT - 1)))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "positions span %g mm, expected less than %g mm at a mean free path of %g mm",
                           largest_mm, scale_mm * ldexp(1.0, OCTAVE_LIMIT / 2 - 1), geometry->finest_mm);
    const size_t per_octave =
        geometry->nodes_per_octave > 0 ? (size_t)geometry->nodes_per_octave : FIT_NODES_PER_OCTAVE;
    /* one part in 1e5 above the bound, for distances rounded up in float; as many nodes as a stencil takes
     */
    size_t octave_count = (size_t)ilogb(largest_y * 1.00001) + 1;
    while (octave_count * per_octave + 1 < STENCIL)
        octave_count++;

    double colour[FIT_CHANNEL_COUNT];
    const int base = brightest_channel(geometry, colour);
    const size_t set_count = is_one_colour(geometry, base, colour) ? 1 : FIT_CHANNEL_COUNT;
    const double cut_y = 1.0 + pow(geometry->cut_mm / scale_mm, 2.0);
    struct build build = {
        .geometry = geometry,
        .bin_count = octave_count * BINS_PER_OCTAVE + 1,
        .inverse_scale2_per_mm2 = (float)(1.0 / (scale_mm * scale_mm)),
        .cut_y = (float)fmin(cut_y, 1e38),
        .base = base,
        .progress = progress,
    };
    build.bin_value_count = set_count * 2 * build.bin_count;
    const bool is_allocated =
        operator_allocate(geometry->pixel_count, octave_count * per_octave + 1, set_count, &build.op) &&
        create_clusters(&build) && (build.stencils = malloc(build.bin_count * sizeof *build.stencils));
    if (is_allocated) {
        struct fit_operator *op = build.op;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            op->colour[c] = set_count == 1 ? colour[c] : 1.0;
        for (size_t k = 0; k < op->node_count; k++)
            op->node_r_mm[k] = scale_mm * sqrt(axis_y(k, per_octave) - 1.0);
        for (size_t j = 0; j < build.bin_count; j++)
            stencil_init(&build.stencils[j], axis_y(j, BINS_PER_OCTAVE), per_octave, op->node_count);
        build_rows(&build);
    }
    for (int object = 0; build.clusters && object < build.object_count; object++)
        fit_clusters_destroy(build.clusters[object]);
    free(build.clusters);
    free(build.stencils);
    if (!is_allocated || build.is_out_of_memory) {
        free(build.op);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the operator of %zu pixels",
                           geometry->pixel_count);
    }
    *operator_out = build.op;
    return true;
}

void fit_operator_destroy(struct fit_operator *op)
{
    free(op);
}

const double *fit_operator_row(const struct fit_operator *op, int channel, size_t pixel)
{
    const size_t set = op->set_count == 1 ? 0 : (size_t)channel;
    return op->rows + (set * op->pixel_count + pixel) * op->node_count;
}
