/* How local and global response share the light: a shadow's edge, and depth. And the pattern of cells. */
#include "bench/tables.h"
#include "io/file.h"

#include <math.h>
#include <stdlib.h>

enum { POINT_COUNT = 601, MARK_COUNT = 61, GREEN = 1 };

#define PI 3.14159265358979323846

/* One curve: what the volume says, in two parts, and what is right. */
struct curves {
    double x[POINT_COUNT], local[POINT_COUNT], global[POINT_COUNT], sum[POINT_COUNT], exact[POINT_COUNT];
};

/* ---- a lit half-plane ------------------------------------------------------------------------------- */

/* Area of the part of a convex polygon that lies at u < limit, over its area. */
static double lit_part(double corners[4][2], double area, double limit)
{
    double clipped[8][2], twice = 0;
    int count = 0;
    for (int k = 0; k < 4; k++) {
        const double *const a = corners[k], *const b = corners[(k + 1) % 4];
        if (a[0] < limit) {
            clipped[count][0] = a[0];
            clipped[count++][1] = a[1];
        }
        if ((a[0] < limit) != (b[0] < limit)) {
            clipped[count][0] = limit;
            clipped[count++][1] = a[1] + (b[1] - a[1]) * (limit - a[0]) / (b[0] - a[0]);
        }
    }
    for (int k = 0; k < count; k++) {
        const double *const a = clipped[k], *const b = clipped[(k + 1) % count];
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return 0.5 * twice / area;
}

/* Power from the half-plane at u < 0 at a point x away from its edge (x > 0: in the shadow): over the
 * angles that reach it, what falls beyond the edge. Midpoint rule. */
static double half_plane(const dipole_sources *sources, double x_mm)
{
    enum { ANGLES = 2000 };
    const double total = dipole_sources_within(sources, 0, INFINITY);
    double beyond = 0;
    for (int i = 0; i < ANGLES; i++) {
        const double angle = ((i + 0.5) / ANGLES - 0.5) * PI;
        beyond += (total - dipole_sources_within(sources, 0, fabs(x_mm) / cos(angle))) / (2.0 * ANGLES);
    }
    return x_mm > 0 ? beyond : total - beyond;
}

static void edge_fill(const struct bench_volume *volume, double reach_mm, struct curves *curves)
{
    const struct lut_tsm *const lut = &volume->lut;
    const double a_mm = lut->inner_mm, cell = 1.0 / LUT_TSM_LOCAL_SIDE;
    const dipole_sources *const sources = &volume->plan->sources[GREEN];
    const double total = dipole_sources_within(sources, 0, INFINITY);
    double rgb[IO_CHANNEL_COUNT], factor[IO_CHANNEL_COUNT];
    lut_tsm_local_depth_factor(lut, 0, factor);
    for (int i = 0; i < POINT_COUNT; i++) {
        const double x_mm = reach_mm * (2.0 * i / (POINT_COUNT - 1) - 1);
        double global = 0, local = 0;
        for (int k = 0; k < lut->sample_count; k++) {
            struct lut_cell *const at = &volume->plan->cells[k];
            lut_tsm_sample(lut, k, 0, 0, rgb);
            global += lit_part(at->corners, at->area, -x_mm / a_mm) * lut->samples[k].area_mm2 * rgb[GREEN];
        }
        for (int k = 0; k < LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE; k++) {
            const int column = k % LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2,
                      row = k / LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2;
            const double part = fmin(fmax(-x_mm / a_mm / cell - (column - 0.5), 0), 1);
            lut_tsm_local_kernel(lut, column, row, rgb);
            local += part * cell * cell * a_mm * a_mm * rgb[GREEN] * factor[GREEN];
        }
        curves->x[i] = x_mm;
        curves->global[i] = global / total;
        curves->local[i] = local / total;
        curves->sum[i] = (global + local) / total;
        curves->exact[i] = half_plane(sources, x_mm) / total;
    }
}

/* ---- depth ------------------------------------------------------------------------------------------ */

static void depth_fill(const struct bench_volume *volume, double reach_mm, struct curves *curves)
{
    const struct lut_tsm *const lut = &volume->lut;
    const dipole_sources *const sources = &volume->plan->sources[GREEN];
    const double cell_mm = lut->inner_mm / LUT_TSM_LOCAL_SIDE,
                 total = dipole_sources_within(sources, 0, INFINITY);
    double rgb[IO_CHANNEL_COUNT], factor[IO_CHANNEL_COUNT], kernel = 0;
    for (int k = 0; k < LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE; k++) {
        lut_tsm_local_kernel(lut, k % LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2,
                             k / LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2, rgb);
        kernel += cell_mm * cell_mm * rgb[GREEN];
    }
    for (int i = 0; i < POINT_COUNT; i++) {
        const double dz_mm = reach_mm * (2.0 * i / (POINT_COUNT - 1) - 1);
        double global = 0;
        for (int k = 0; k < lut->sample_count; k++) {
            const double *const offset = lut->samples[k].offset_mm;
            const double distance = hypot(hypot(offset[0], offset[1]), dz_mm);
            lut_tsm_sample(lut, k, distance > 0 ? -dz_mm / distance : 1, dz_mm, rgb);
            global += lut->samples[k].area_mm2 * rgb[GREEN];
        }
        lut_tsm_local_depth_factor(lut, dz_mm, factor);
        curves->x[i] = dz_mm;
        curves->global[i] = global / total;
        curves->local[i] = kernel * factor[GREEN] / total;
        curves->sum[i] = curves->global[i] + curves->local[i];
        curves->exact[i] = dipole_sources_within(sources, -dz_mm, INFINITY) / total;
    }
}

/* ---- pictures --------------------------------------------------------------------------------------- */

static void curves_plot(const struct bench *bench, const char *name, const char *title,
                        const char *subtitle, const char *x_title, double y_max,
                        const struct curves *curves)
{
    double x[MARK_COUNT], exact[MARK_COUNT];
    for (int i = 0; i < MARK_COUNT; i++) {
        x[i] = curves->x[i * ((POINT_COUNT - 1) / (MARK_COUNT - 1))];
        exact[i] = curves->exact[i * ((POINT_COUNT - 1) / (MARK_COUNT - 1))];
    }
    const struct plot_series series[] = {
        { .kind = PLOT_POINTS,
          .label = "exact",
          .count = MARK_COUNT,
          .x = x,
          .y = exact,
          .color = PLOT_GREY,
          .is_hollow = true },
        { .label = "local + global",
          .count = POINT_COUNT,
          .x = curves->x,
          .y = curves->sum,
          .color = "#000000",
          .is_thin = true },
        { .label = "global: the volume",
          .count = POINT_COUNT,
          .x = curves->x,
          .y = curves->global,
          .color = PLOT_BLUE,
          .dash = PLOT_DASHED },
        { .label = "local: 7 × 7 cells",
          .count = POINT_COUNT,
          .x = curves->x,
          .y = curves->local,
          .color = PLOT_RED,
          .dash = PLOT_DASH_DOTTED },
    };
    const struct plot plot = {
        .height_px = 520,
        .title = title,
        .subtitle = subtitle,
        .x = { .title = x_title, .min = 1.03 * curves->x[0], .max = 1.03 * curves->x[POINT_COUNT - 1] },
        .y = { .title = "of what an evenly lit slab sends out", .max = y_max },
        .series = series,
        .series_count = sizeof series / sizeof *series,
        .has_legend = true
    };
    bench_plot(bench, name, &plot);
}

static double worst_of(const struct curves *curves)
{
    double worst = 0;
    for (int i = 0; i < POINT_COUNT; i++)
        worst = fmax(worst, fabs(curves->sum[i] - curves->exact[i]));
    return worst;
}

/* The cells, each with the mip level of the light's view that has its mean, in widths of the inner one. */
static void pattern_draw(const struct bench *bench, const struct bench_volume *volume)
{
    static const char *const fills[] = { "#fde0c5", "#f8f1e7", "#dcebf5", "#b5d3e9" };
    enum { SIDE = 640, MARGIN = 20 };
    const struct lut_tsm_plan *const plan = volume->plan;
    const double extent = lut_pattern_extent(volume->lut.size[2]), scale = SIDE / extent,
                 middle = MARGIN + 0.5 * SIDE;
    char text[32768];
    int size = snprintf(
        text, sizeof text,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
        "font-family=\"sans-serif\" font-size=\"15\" text-anchor=\"middle\">\n"
        "<rect width=\"%d\" height=\"%d\" fill=\"#ffffff\"/>\n",
        SIDE + 2 * MARGIN, SIDE + 2 * MARGIN, SIDE + 2 * MARGIN, SIDE + 2 * MARGIN, SIDE + 2 * MARGIN,
        SIDE + 2 * MARGIN);
    for (int i = 0; i < volume->lut.sample_count; i++) {
        const struct lut_cell *const cell = &plan->cells[i];
        const double width = sqrt(cell->area), level = log2(width);
        const int fill = cell->is_inner ? (i == 0 ? 0 : 1) : cell->is_outermost ? 3 : 2;
        size += snprintf(text + size, sizeof text - (size_t)size,
                         "<polygon fill=\"%s\" stroke=\"#333333\" points=\"", fills[fill]);
        for (int k = 0; k < 4; k++)
            size += snprintf(text + size, sizeof text - (size_t)size, "%s%.2f,%.2f", k > 0 ? " " : "",
                             middle + scale * cell->corners[k][0], middle - scale * cell->corners[k][1]);
        size += snprintf(text + size, sizeof text - (size_t)size, "\"/>\n");
        if (!cell->is_inner)
            size += snprintf(text + size, sizeof text - (size_t)size,
                             "<text x=\"%.2f\" y=\"%.2f\" fill=\"#222222\">%+.1f</text>\n",
                             middle + scale * cell->centre[0], middle - scale * cell->centre[1] + 5, level);
        size += snprintf(text + size, sizeof text - (size_t)size,
                         "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"2.2\" fill=\"#cc3311\"/>\n",
                         middle + scale * cell->centre[0],
                         middle - scale * cell->centre[1] + (cell->is_inner ? 0 : 14));
    }
    size += snprintf(text + size, sizeof text - (size_t)size, "</svg>\n");
    dipole_status status;
    bench_check(io_file_write(bench_path(bench, "tables_pattern.svg"), text, (size_t)size, &status),
                &status);
}

void bench_partition(const struct bench *bench)
{
    static const int size[3] = { 64, 64, 32 };
    static struct curves edge, depth;
    const struct io_material marble = bench_material(bench, "marble");
    struct bench_volume volume;
    bench_volume_begin(&marble, size, true, &volume);
    edge_fill(&volume, 4 * volume.lut.inner_mm, &edge);
    depth_fill(&volume, 3 * volume.lut.inner_mm, &depth);
    curves_plot(bench, "tables_edge.svg", "A flat slab, lit to the left of a shadow's edge",
                "Marble, green. Lines: by the volume and the local response; circles: by integration.",
                "distance from the edge of the shadow, mm", 1.1, &edge);
    curves_plot(
        bench, "tables_depth.svg", "A point below and above an evenly lit surface",
        "Marble, green; the surface lies across the light. Lines: by the volume and the local response; "
        "circles: in closed form.",
        "dz: how much deeper the point lies than the surface, mm", 1.5, &depth);
    pattern_draw(bench, &volume);
    printf("Here, of what an evenly lit slab sends out, the sum errs by at most %.1g across the shadow's "
           "edge and by "
           "%.1g over depth; a = %.2f mm.\n",
           worst_of(&edge), worst_of(&depth), volume.lut.inner_mm);
    bench_volume_end(&volume);
}
