#include "fit/operator.h"

#include <assert.h>
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <threads.h>
#include <unistd.h>

/*
 * Distances are sorted by y = 1 + (r/s)^2 on an axis that is linear within each octave of y and doubles its
 * step from octave to octave: the bits of y as a float, shifted, are the index, and the bits shifted out
 * are the fraction. No logarithm, no search. Two grids live on that axis:
 *
 *   bins   BINS per octave, where the flux of a pair is shared linearly between its two neighbours;
 *   nodes  NODES per octave, from which the profile at each bin is interpolated by STENCIL points in log y.
 *
 * Linear sharing errs by at most (1/8)(15/4)/BINS^2 = 3e-5 on r^-3, the steepest power law of the dipole,
 * and by less elsewhere; the nodes err by less than that while sigma_tr r < 10 (tests/test_operator.c).
 */
enum {
    BIN_BITS = 7,
    BINS_PER_OCTAVE = 1 << BIN_BITS,
    NODES_PER_OCTAVE = 8,
    STENCIL = 6,
    OCTAVE_LIMIT = 60,
    MANTISSA_BITS = 23,
    FRACTION_BITS = MANTISSA_BITS - BIN_BITS,
    BLOCK_PAIRS = 512, /* pairs whose bins are found together: fits the first cache            */
    BLOCK_PIXELS = 32, /* pixels a thread takes at a time                                       */
    THREAD_LIMIT = 64,
};
static const uint32_t bits_of_one = 0x3f800000u;

static double axis_y(size_t index, size_t per_octave)
{
    const size_t octave = index / per_octave;
    return ldexp(1.0 + (double)(index % per_octave) / (double)per_octave, (int)octave);
}

/* Samples by component, so that distances to one pixel are found several at a time. */
struct flat_samples {
    size_t count, set_count;
    float *x, *y, *z;
    float *flux[FIT_CHANNEL_COUNT];
};

/* Profile at bin j from nodes first[j] .. first[j] + STENCIL - 1. */
struct stencil {
    size_t first;
    double weights[STENCIL];
};

struct build {
    const struct fit_geometry *geometry;
    struct fit_operator *op;
    struct flat_samples samples;
    struct stencil *stencils; /* bin_count                                        */
    size_t bin_count;
    double *bins; /* per thread: set_count x 2 x bin_count            */
    size_t bins_per_thread;
    float inverse_scale2_per_mm2, cut_y;
    atomic_size_t next_pixel, next_thread;
    const struct fit_progress *progress;
};

/* Lagrange weights in log y, with the profile's far field y^(-3/2) divided out: what is interpolated is
 * nearly constant where R_d is a power law, and the weights still multiply R_d itself. */
static void stencil_init(struct stencil *stencil, double y, size_t node_count)
{
    const size_t exact = (size_t)(ilogb(y) * NODES_PER_OCTAVE) +
                         (size_t)((y / ldexp(1.0, ilogb(y)) - 1.0) * NODES_PER_OCTAVE);
    const size_t below = STENCIL / 2 - 1;
    size_t first = exact > below ? exact - below : 0;
    if (first + STENCIL > node_count)
        first = node_count - STENCIL;
    stencil->first = first;
    for (size_t k = 0; k < STENCIL; k++) {
        const double y_k = axis_y(first + k, NODES_PER_OCTAVE);
        double weight = pow(y_k / y, 1.5);
        for (size_t m = 0; m < STENCIL; m++) {
            const double y_m = axis_y(first + m, NODES_PER_OCTAVE);
            if (m != k)
                weight *= log(y / y_m) / log(y_k / y_m);
        }
        stencil->weights[k] = weight;
    }
}

/* Share the flux of every sample between the bins of its distance. Bins hold, per set, the sums of flux
 * and of flux times fraction: two independent sums where hat functions would need four steps. */
static void bin_pixel(const struct build *build, const float position_mm[3], double *bins)
{
    const struct flat_samples *samples = &build->samples;
    memset(bins, 0, build->bins_per_thread * sizeof *bins);
    for (size_t start = 0; start < samples->count; start += BLOCK_PAIRS) {
        const size_t rest = samples->count - start;
        const size_t count = rest < BLOCK_PAIRS ? rest : BLOCK_PAIRS;
        uint32_t bits[BLOCK_PAIRS];
        for (size_t i = 0; i < count; i++) {
            const float dx = samples->x[start + i] - position_mm[0];
            const float dy = samples->y[start + i] - position_mm[1];
            const float dz = samples->z[start + i] - position_mm[2];
            const float y = 1.0f + (dx * dx + dy * dy + dz * dz) * build->inverse_scale2_per_mm2;
            /* what was cut is put into bin 0 with no flux by the loop below; y = 0 marks it */
            const float kept = y <= build->cut_y ? y : 0.0f;
            memcpy(&bits[i], &kept, sizeof kept);
        }
        for (size_t set = 0; set < samples->set_count; set++) {
            double *restrict sum = bins + set * 2 * build->bin_count;
            double *restrict moment = sum + build->bin_count;
            const float *flux = samples->flux[set] + start;
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

/* Take blocks of pixels until none is left. Every row has one writer, so threads change no bit. */
static int build_rows(void *argument)
{
    struct build *build = argument;
    struct fit_operator *op = build->op;
    const size_t thread = atomic_fetch_add(&build->next_thread, 1);
    double *bins = build->bins + thread * build->bins_per_thread;
    for (;;) {
        const size_t first = atomic_fetch_add(&build->next_pixel, BLOCK_PIXELS);
        if (first >= op->pixel_count)
            return 0;
        const size_t end = first + BLOCK_PIXELS < op->pixel_count ? first + BLOCK_PIXELS : op->pixel_count;
        for (size_t j = first; j < end; j++) {
            bin_pixel(build, build->geometry->positions_mm + 3 * j, bins);
            for (size_t set = 0; set < op->set_count; set++)
                row_from_bins(build, bins + set * 2 * build->bin_count,
                              op->rows + (set * op->pixel_count + j) * op->node_count);
        }
        if (thread == 0 && build->progress && build->progress->show)
            build->progress->show(build->progress->context, "building the operator",
                                  (double)end / (double)op->pixel_count);
    }
}

static void build_run(struct build *build, size_t thread_count)
{
    thrd_t threads[THREAD_LIMIT];
    size_t started = 0;
    while (started + 1 < thread_count && thrd_create(&threads[started], build_rows, build) == thrd_success)
        started++;
    (void)build_rows(build);
    for (size_t i = 0; i < started; i++)
        thrd_join(threads[i], NULL);
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

static size_t processor_count(void)
{
    const long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : count > THREAD_LIMIT ? THREAD_LIMIT : (size_t)count;
}

static bool samples_flatten(const struct fit_geometry *geometry, int base, size_t set_count,
                            struct flat_samples *out)
{
    const size_t count = geometry->sample_count;
    float *memory = malloc((count + 1) * (3 + set_count) * sizeof *memory);
    if (!memory)
        return false;
    *out = (struct flat_samples){
        .count = count, .set_count = set_count, .x = memory, .y = memory + count, .z = memory + 2 * count
    };
    for (size_t set = 0; set < set_count; set++)
        out->flux[set] = memory + (3 + set) * count;
    for (size_t i = 0; i < count; i++) {
        const struct render_light_sample *sample = &geometry->samples[i];
        out->x[i] = sample->position_mm[0];
        out->y[i] = sample->position_mm[1];
        out->z[i] = sample->position_mm[2];
        for (size_t set = 0; set < set_count; set++)
            out->flux[set][i] = sample->flux_w[set_count == 1 ? (size_t)base : set];
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

bool fit_operator_create(const struct fit_geometry *geometry, const struct fit_progress *progress,
                         struct fit_operator **operator_out, dipole_status *status)
{
    *operator_out = NULL;
    assert(geometry->pixel_count > 0 && geometry->sample_count > 0 && geometry->finest_mm > 0.0);
    /* Below s the axis is linear in r^2: a third of the shortest mean free path leaves the bend of R_d,
     * at r = z_r, to the logarithmic part. */
    const double scale_mm = geometry->finest_mm / 3.0;
    const double largest_y = 1.0 + pow(largest_distance_mm(geometry) / scale_mm, 2.0);
    if (!(largest_y < ldexp(1.0, OCTAVE_LIMIT - 1)))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "positions span %g mm, expected less than %g mm at a mean free path of %g mm",
                           largest_distance_mm(geometry), scale_mm * ldexp(1.0, OCTAVE_LIMIT / 2 - 1),
                           geometry->finest_mm);
    /* one part in 1e5 above the bound, for distances rounded up in float */
    const size_t octave_count = (size_t)ilogb(largest_y * 1.00001) + 1;

    double colour[FIT_CHANNEL_COUNT];
    const int base = brightest_channel(geometry, colour);
    const size_t set_count = is_one_colour(geometry, base, colour) ? 1 : FIT_CHANNEL_COUNT;
    const size_t thread_count = processor_count();
    const double cut_y = 1.0 + pow(geometry->cut_mm / scale_mm, 2.0);
    struct build build = {
        .geometry = geometry,
        .bin_count = octave_count * BINS_PER_OCTAVE + 1,
        .inverse_scale2_per_mm2 = (float)(1.0 / (scale_mm * scale_mm)),
        .cut_y = (float)fmin(cut_y, 1e38),
        .progress = progress,
    };
    build.bins_per_thread = set_count * 2 * build.bin_count;
    const bool is_allocated =
        operator_allocate(geometry->pixel_count, octave_count * NODES_PER_OCTAVE + 1, set_count,
                          &build.op) &&
        samples_flatten(geometry, base, set_count, &build.samples) &&
        (build.stencils = malloc(build.bin_count * sizeof *build.stencils)) &&
        (build.bins = malloc(thread_count * build.bins_per_thread * sizeof *build.bins));
    if (is_allocated) {
        struct fit_operator *op = build.op;
        for (int c = 0; c < FIT_CHANNEL_COUNT; c++)
            op->colour[c] = set_count == 1 ? colour[c] : 1.0;
        for (size_t k = 0; k < op->node_count; k++)
            op->node_r_mm[k] = scale_mm * sqrt(axis_y(k, NODES_PER_OCTAVE) - 1.0);
        for (size_t j = 0; j < build.bin_count; j++)
            stencil_init(&build.stencils[j], axis_y(j, BINS_PER_OCTAVE), op->node_count);
        build_run(&build, thread_count);
    }
    free(build.samples.x);
    free(build.stencils);
    free(build.bins);
    if (!is_allocated) {
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
