/* What was asked of a table, and what was measured. */
#include "bench/tables.h"
#include "cli/cli.h"

#include <math.h>
#include <stdlib.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { ROUND_COUNT = 5 };

/* ---- splat tables ---------------------------------------------------------------------------------- */

/* A table as it is stored, and how long it took. */
struct splat_result {
    struct lut_splat_row row;
    int node_count;
    size_t bytes;
    double ms;
};

static struct splat_result splat_bake(const struct bench *bench, const struct lut_request *request)
{
    struct lut_splat *lut = NULL;
    struct io_image *image;
    dipole_status status;
    double times[ROUND_COUNT];
    for (int round = 0; round < ROUND_COUNT; round++) {
        lut_splat_destroy(lut);
        const double start_s = cli_now_s();
        bench_check(lut_splat_bake(request, &lut, &status), &status);
        times[round] = 1e3 * (cli_now_s() - start_s);
    }
    bench_check(lut_splat_to_image(lut, request->kind, &image, &status) &&
                    io_exr_write(bench_path(bench, "error.exr"), image, request->is_half, &status),
                &status);
    const struct splat_result result = { .row = lut->rows[0],
                                         .node_count = lut->node_count,
                                         .bytes = bench_file_size(bench_path(bench, "error.exr")),
                                         .ms = bench_median(times, ROUND_COUNT) };
    io_image_destroy(image);
    lut_splat_destroy(lut);
    return result;
}

/* Against direct evaluation at other points than the bake's. */
static void print_splat(const struct splat_result *result)
{
    printf(" %.2g | %.2g | %.2g | %d | %zu | %.2f |", result->row.predicted_error, result->row.error.max,
           result->row.error.p99, result->node_count, result->bytes, result->ms);
}

void bench_splat_errors(const struct bench *bench)
{
    static const double epsilons[] = { 0.1, 0.01, 0.001 };
    printf("| | asked | predicted | largest | 99 %% | texels | bytes | ms | half: predicted | largest | 99 "
           "%% | texels | "
           "bytes | ms |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < BENCH_MATERIAL_COUNT; i++) {
        const struct io_material material = bench_material(bench, bench_material_names[i]);
        for (size_t k = 0; k < COUNT(epsilons); k++) {
            struct lut_request request = {
                .kind = LUT_SPLAT1D, .materials = &material, .material_count = 1, .epsilon = epsilons[k]
            };
            printf("| %s | %g |", bench_material_names[i], epsilons[k]);
            for (int half = 0; half < 2; half++) {
                request.is_half = half == 1;
                const struct splat_result result = splat_bake(bench, &request);
                print_splat(&result);
            }
            printf("\n");
        }
    }
}

/* ---- volumes --------------------------------------------------------------------------------------- */

static void print_volume(const struct bench *bench, const struct lut_request *request)
{
    struct lut_tsm *lut = NULL;
    struct io_image *image;
    dipole_status status;
    double times[ROUND_COUNT];
    for (int round = 0; round < ROUND_COUNT; round++) {
        lut_tsm_destroy(lut);
        const double start_s = cli_now_s();
        if (!lut_tsm_bake(request, 0, &lut, &status)) {
            printf(" *%s* | | | |", status.message);
            return;
        }
        times[round] = 1e3 * (cli_now_s() - start_s);
    }
    bench_check(lut_tsm_to_image(lut, &image, &status) &&
                    io_exr_write(bench_path(bench, "error.exr"), image, request->is_half, &status),
                &status);
    printf(" %.2g (%.2g) | %d × %d | %.2f | %.1f |", lut->error.max, lut->error.p99, lut->size[0],
           lut->size[1], 1e-6 * (double)bench_file_size(bench_path(bench, "error.exr")),
           bench_median(times, ROUND_COUNT));
    io_image_destroy(image);
    lut_tsm_destroy(lut);
}

void bench_volume_errors(const struct bench *bench)
{
    static const double epsilons[] = { 0.15, 0.05, 0.02 };
    printf("| |");
    for (size_t k = 0; k < COUNT(epsilons); k++)
        printf(" %g asked: largest (99 %%) | S × T | MB | ms |", epsilons[k]);
    printf(" 0.15, half: largest (99 %%) | S × T | MB | ms "
           "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < BENCH_MATERIAL_COUNT; i++) {
        const struct io_material material = bench_material(bench, bench_material_names[i]);
        printf("| %s |", bench_material_names[i]);
        for (size_t k = 0; k <= COUNT(epsilons); k++)
            print_volume(bench, &(struct lut_request){ .kind = LUT_TSM,
                                                       .materials = &material,
                                                       .material_count = 1,
                                                       .epsilon = epsilons[k % COUNT(epsilons)],
                                                       .is_half = k == COUNT(epsilons) });
        printf("\n");
        fflush(stdout);
    }
}

/* ---- energy ---------------------------------------------------------------------------------------- */

/* What a point sends out under a surface across the light that is evenly lit, dz above it: the sum over the
 * volume and the local response. */
static double sum_of(const struct bench_volume *volume, int channel, double dz_mm)
{
    const struct lut_tsm *const lut = &volume->lut;
    double sum = 0, rgb[IO_CHANNEL_COUNT], factor[IO_CHANNEL_COUNT];
    for (int i = 0; i < lut->sample_count; i++) {
        const double distance =
            hypot(hypot(lut->samples[i].offset_mm[0], lut->samples[i].offset_mm[1]), dz_mm);
        lut_tsm_sample(lut, i, distance > 0 ? -dz_mm / distance : 1, dz_mm, rgb);
        sum += lut->samples[i].area_mm2 * rgb[channel];
    }
    const double cell_mm = lut->inner_mm / LUT_TSM_LOCAL_SIDE;
    lut_tsm_local_depth_factor(lut, dz_mm, factor);
    for (int i = 0; i < LUT_TSM_LOCAL_SIDE * LUT_TSM_LOCAL_SIDE; i++) {
        lut_tsm_local_kernel(lut, i % LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2,
                             i / LUT_TSM_LOCAL_SIDE - LUT_TSM_LOCAL_SIDE / 2, rgb);
        sum += cell_mm * cell_mm * rgb[channel] * factor[channel];
    }
    return sum;
}

/* Largest errors of the sum: at dz = 0, at any depth in units of the sum at 0, and relative to the truth
 * where that is more than a hundredth of the sum at 0. */
struct sum_errors {
    double flat, absolute, relative;
};

static void errors_add(const struct bench_volume *volume, int channel, struct sum_errors *errors)
{
    enum { DEPTHS = 2000 };
    const dipole_sources *const sources = &volume->plan->sources[channel];
    const double total = dipole_sources_within(sources, 0, INFINITY);
    errors->flat = fmax(errors->flat, fabs(sum_of(volume, channel, 0) / total - 1));
    for (int i = -DEPTHS; i <= DEPTHS; i++) {
        const double dz_mm = volume->lut.depth_max_mm * i / DEPTHS;
        const double exact = dipole_sources_within(sources, -dz_mm, INFINITY);
        const double error = fabs(sum_of(volume, channel, dz_mm) - exact);
        errors->absolute = fmax(errors->absolute, error / total);
        if (exact > 0.01 * total)
            errors->relative = fmax(errors->relative, error / exact);
    }
}

/* Part of the light that falls beyond the last ring, at dz = 0. */
static double folded(const struct bench_volume *volume, int channel)
{
    const struct lut_tsm_plan *const plan = volume->plan;
    double within = 0, total = 0;
    struct lut_tsm_work work;
    dipole_status status;
    bench_check(lut_tsm_work_create(plan, 1, &work) ||
                    dipole_fail(&status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory"),
                &status);
    dipole_sources_within_many(&plan->sources[channel], 0, plan->r_mm, (size_t)plan->radius_count + 1,
                               work.within);
    total = work.within[plan->radius_count];
    for (int k = 0; k < plan->class_count; k++)
        for (int i = plan->classes[k].first; i < plan->classes[k].first + plan->classes[k].count; i++)
            within +=
                plan->classes[k].member_count * plan->terms[i].weight * work.within[plan->terms[i].radius];
    lut_tsm_work_end(&work);
    return 1 - within / total;
}

void bench_energy(const struct bench *bench)
{
    static const int size[3] = { 64, 64, 32 };
    printf("| | a, mm | r_max, mm | folded into the last ring | error of the sum at dz = 0 | at any dz, of "
           "the sum at 0 | "
           "relative, where 1 %% of that is left |\n|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < BENCH_MATERIAL_COUNT; i++) {
        const struct io_material material = bench_material(bench, bench_material_names[i]);
        struct bench_volume volume;
        struct sum_errors errors = { 0 };
        double beyond = 0;
        bench_volume_begin(&material, size, true, &volume);
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            beyond = fmax(beyond, folded(&volume, c));
            errors_add(&volume, c, &errors);
        }
        printf("| %s | %.2f | %.1f | %.1f %% | %.3f %% | %.1f %% | %.1f %% |\n", bench_material_names[i],
               volume.lut.inner_mm, volume.lut.depth_max_mm, 100 * beyond, 100 * errors.flat,
               100 * errors.absolute, 100 * errors.relative);
        bench_volume_end(&volume);
    }
}
