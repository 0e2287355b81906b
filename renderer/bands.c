#include "renderer/bands.h"

#include "renderer/footprint.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* ---- layout ------------------------------------------------------------------------------------- */

int render_bands_make(double spacing_mm, double r_max_mm, double cap_spacings,
                      struct render_band bands[RENDER_BAND_LIMIT])
{
    int count = 0;
    for (bool is_last = false; !is_last; count++) {
        const double wide_mm = ldexp(spacing_mm, count), cap_mm = cap_spacings * wide_mm;
        is_last = count + 1 == RENDER_BAND_LIMIT || 2 * cap_mm >= r_max_mm;
        bands[count] = (struct render_band){ .spacing_mm = wide_mm,
                                             .cap_mm = count > 0 ? cap_mm : 0,
                                             .r_outer_mm = is_last ? r_max_mm : 2 * cap_mm };
    }
    return count;
}

static bool is_same_band(const struct render_band *a, const struct render_band *b)
{
    return a->spacing_mm == b->spacing_mm && a->cap_mm == b->cap_mm && a->r_outer_mm == b->r_outer_mm;
}

bool render_band_keys_are_same(const struct render_band_key *a, const struct render_band_key *b)
{
    bool is_same = a->source.table == b->source.table && a->source.row == b->source.row &&
                   a->source.medium == b->source.medium && a->source.spread_mm == b->source.spread_mm &&
                   a->band_count == b->band_count;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        is_same = is_same && a->source.blur_mm[c] == b->source.blur_mm[c];
    for (int i = 0; is_same && i < a->band_count; i++)
        is_same = is_same_band(&a->bands[i], &b->bands[i]);
    return is_same;
}

/* ---- split -------------------------------------------------------------------------------------- */

static void from_table(const struct render_band_source *source, double r_mm, double rgb[IO_CHANNEL_COUNT])
{
    /* The last node may round to beyond the axis, where the table is 0. Footprints may be wider than it. */
    const double r_max_mm = source->table->rows[source->row].axis.r_max_mm;
    lut_splat_sample(source->table, source->row, fmin(r_mm, r_max_mm), rgb);
    for (int c = 0; c < IO_CHANNEL_COUNT && r_mm > r_max_mm * (1 + 1e-9); c++)
        rgb[c] = 0;
}

static void whole_profile(const struct render_split *split, double r_mm, double rgb[IO_CHANNEL_COUNT])
{
    const double r_max_mm = split->source.table->rows[split->source.row].axis.r_max_mm;
    double nearer[IO_CHANNEL_COUNT] = { 0 }, farther[IO_CHANNEL_COUNT] = { 0 };
    from_table(&split->source, r_mm, rgb);
    /* at the end of the table nothing more can be told, nor is much left */
    const bool has_neighbours = split->source.spread_mm > 0 && r_mm * RENDER_FOOTPRINT_STRIDE <= r_max_mm;
    if (has_neighbours) {
        from_table(&split->source, r_mm / RENDER_FOOTPRINT_STRIDE, nearer);
        from_table(&split->source, r_mm * RENDER_FOOTPRINT_STRIDE, farther);
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct render_footprint *const averaged = split->averaged[c];
        if (averaged && r_mm <= averaged->reach_mm)
            rgb[c] = render_footprint_sample(averaged, r_mm);
        else if (averaged && has_neighbours)
            rgb[c] =
                render_footprint_far_per_mm2(averaged, r_mm, (double[]){ nearer[c], rgb[c], farther[c] });
    }
}

/*
 * Taylor's polynomial of a channel in 1 - s/s_cap, s the distance squared: of the polynomial through
 * CAP_NODES Chebyshev nodes about the cap. The profile is completely monotonic in s, so all terms are
 * positive, and caps rise inwards, below the profile. One that is averaged (not NULL) may have lobes:
 * there it is the polynomial, whatever its signs.
 */
static void fit_cap(const dipole_stack *stack, const struct render_footprint *averaged, double cap_mm,
                    double terms[RENDER_CAP_TERMS])
{
    enum { CAP_NODES = 7 };
    const double half_width = 0.25; /* in s/s_cap */
    double r_mm[CAP_NODES], x[CAP_NODES], divided[CAP_NODES];
    for (int i = 0; i < CAP_NODES; i++) {
        x[i] = half_width * cos(PI * (i + 0.5) / CAP_NODES);
        r_mm[i] = cap_mm * sqrt(1 - x[i]);
    }
    if (averaged) {
        for (int i = 0; i < CAP_NODES; i++)
            divided[i] = render_footprint_exact_per_mm2(averaged, r_mm[i]);
    } else {
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, r_mm, CAP_NODES, divided);
    }
    for (int order = 1; order < CAP_NODES; order++) { /* Newton's form */
        for (int i = CAP_NODES - 1; i >= order; i--)
            divided[i] = (divided[i] - divided[i - 1]) / (x[i] - x[i - order]);
    }
    double power[CAP_NODES] = { divided[CAP_NODES - 1] }; /* and from it powers of x */
    for (int i = CAP_NODES - 2; i >= 0; i--) {
        for (int k = CAP_NODES - 1; k > 0; k--)
            power[k] = power[k - 1] - x[i] * power[k];
        power[0] = divided[i] - x[i] * power[0];
    }
    for (int k = 0; k < RENDER_CAP_TERMS; k++)
        terms[k] = averaged ? power[k] : fmax(power[k], 0);
}

/* Caps nearer than so many steps of a footprint (12 times its width) are of the averaged profile. */
enum { NEAR_FOOTPRINT = 96 };

/* All caps, scaled to meet the table. */
static void fit_caps(struct render_split *split)
{
    for (int b = 1; b < split->band_count; b++) {
        double at_cap[IO_CHANNEL_COUNT];
        whole_profile(split, split->bands[b].cap_mm, at_cap);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            double *const terms = split->caps[b][c];
            const struct render_footprint *const averaged = split->averaged[c];
            if (at_cap[c] == 0)
                continue;
            if (averaged && split->bands[b].cap_mm < NEAR_FOOTPRINT * averaged->step_mm) {
                fit_cap(NULL, averaged, split->bands[b].cap_mm, terms);
                terms[0] = at_cap[c];
                continue;
            }
            fit_cap(split->source.medium->stacks[c], NULL, split->bands[b].cap_mm, terms);
            const double scale = terms[0] > 0 ? at_cap[c] / terms[0] : 0;
            for (int k = 0; k < RENDER_CAP_TERMS; k++)
                terms[k] *= scale;
        }
    }
}

bool render_split_init(const struct render_band_source *source, const struct render_band *bands,
                       int band_count, struct render_split *split, dipole_status *status)
{
    *split = (struct render_split){ .source = *source, .band_count = band_count };
    for (int b = 0; b < band_count; b++)
        split->bands[b] = bands[b];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct render_footprint_kernel kernel = { source->blur_mm[c], source->spread_mm };
        if ((kernel.blur_mm > 0 || kernel.spread_mm > 0) &&
            !render_footprint_create(source->medium->stacks[c], &kernel, &split->averaged[c], status))
            return false;
    }
    fit_caps(split);
    return true;
}

void render_split_end(struct render_split *split)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        free(split->averaged[c]);
}

/* What a cap puts in place of the profile. */
static double cap_per_mm2(const struct render_split *split, int band, int channel, double r_mm)
{
    const double ratio = r_mm / split->bands[band].cap_mm, x = 1 - ratio * ratio;
    const double *const t = split->caps[band][channel];
    return t[0] + x * (t[1] + x * (t[2] + x * t[3]));
}

/* Of the band and all beyond it, where rgb is the whole profile. */
static void from_band(const struct render_split *split, int band, double r_mm,
                      const double whole[IO_CHANNEL_COUNT], double rgb[IO_CHANNEL_COUNT])
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        rgb[c] = whole[c];
        if (band == split->band_count || r_mm > split->bands[split->band_count - 1].r_outer_mm)
            rgb[c] = 0;
        else if (r_mm < split->bands[band].cap_mm)
            rgb[c] = cap_per_mm2(split, band, c, r_mm);
    }
}

void render_split_from_per_mm2(const struct render_split *split, int band, double r_mm,
                               double rgb_out[IO_CHANNEL_COUNT])
{
    double whole[IO_CHANNEL_COUNT];
    whole_profile(split, r_mm, whole);
    from_band(split, band, r_mm, whole, rgb_out);
}

static void band_alone(const struct render_split *split, int band, double r_mm,
                       const double whole[IO_CHANNEL_COUNT], double rgb_out[IO_CHANNEL_COUNT])
{
    double beyond[IO_CHANNEL_COUNT];
    from_band(split, band, r_mm, whole, rgb_out);
    from_band(split, band + 1, r_mm, whole, beyond);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        rgb_out[c] -= beyond[c];
}

void render_split_band_per_mm2(const struct render_split *split, int band, double r_mm,
                               double rgb_out[IO_CHANNEL_COUNT])
{
    double whole[IO_CHANNEL_COUNT];
    whole_profile(split, r_mm, whole);
    band_alone(split, band, r_mm, whole, rgb_out);
}

/* ---- tables ------------------------------------------------------------------------------------- */

struct lut_axis render_bands_axis(const struct render_band_source *source)
{
    struct lut_axis axis = source->table->rows[source->row].axis;
    axis.power = 0;
    axis.node_count = RENDER_BAND_NODES;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        axis.r_max_mm = fmax(axis.r_max_mm, RENDER_FOOTPRINT_REACH * source->blur_mm[c]);
    return axis;
}

bool render_bands_bake(const struct render_band_source *source, const struct render_band *bands,
                       int band_count, float *rgb, dipole_status *status)
{
    const struct lut_axis axis = render_bands_axis(source);
    struct render_split split;
    const bool done = render_split_init(source, bands, band_count, &split, status);
    for (int i = 0; done && i < axis.node_count; i++) {
        const double r_mm = fmin(lut_axis_r_mm(&axis, i), axis.r_max_mm);
        double whole[IO_CHANNEL_COUNT], part[IO_CHANNEL_COUNT];
        whole_profile(&split, r_mm, whole);
        for (int b = 0; b < band_count; b++) {
            band_alone(&split, b, r_mm, whole, part);
            float *const node = rgb + 4 * ((size_t)b * (size_t)axis.node_count + (size_t)i);
            for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                node[c] = (float)part[c];
            node[3] = 0;
        }
    }
    render_split_end(&split);
    return done;
}
