/* What baking a table costs, beside what no baking can do without: exponentials, and writing the bytes. */
#include "bench/bare_exp.h"
#include "bench/tables.h"
#include "cli/cli.h"
#include "io/file.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { CHUNK = 4096, ROUND_COUNT = 21, SIZE_ROUND_COUNT = 5 };

static const int usual_size[3] = { 64, 64, 32 };

/* ---- floors ---------------------------------------------------------------------------------------- */

/* One chunk: `pairs` times two exponentials for each value. */
struct exponentials {
    const double *r_mm;
    int pairs;
};

static void chunk_run(void *context, int chunk)
{
    const struct exponentials *const e = context;
    static _Thread_local double values[CHUNK];
    static volatile double sink;
    (void)chunk;
    for (int i = 0; i < e->pairs; i++) {
        bare_exp(e->r_mm, CHUNK, values);
        sink = values[CHUNK - 1];
    }
    (void)sink;
}

static double exponentials_ms(double value_count, size_t source_count, int thread_count)
{
    static double r_mm[CHUNK];
    for (int i = 0; i < CHUNK; i++)
        r_mm[i] = 20.0 * i / CHUNK;
    struct exponentials e = { .r_mm = r_mm, .pairs = (int)(source_count + 1) / 2 };
    const int chunks = (int)ceil(value_count / CHUNK);
    const double start_s = cli_now_s();
    lut_parallel_for(chunks, thread_count, chunk_run, &e);
    return 1e3 * (cli_now_s() - start_s) * value_count / ((double)chunks * CHUNK);
}

/* As many bytes of fresh memory as a volume has, each row by one turn of the loop. */
struct memory {
    float *texels;
    size_t row_floats;
};

static void row_write(void *context, int row)
{
    const struct memory *const memory = context;
    float *const out = memory->texels + (size_t)row * memory->row_floats;
    for (size_t i = 0; i < memory->row_floats; i++)
        out[i] = (float)i;
}

static double memory_ms(const int size[3], int thread_count)
{
    const double start_s = cli_now_s();
    struct memory memory = { .row_floats = (size_t)size[0] * (size_t)size[2] * IO_CHANNEL_COUNT };
    memory.texels = calloc((size_t)size[1] * memory.row_floats, sizeof *memory.texels);
    if (!memory.texels)
        exit(EXIT_FAILED);
    lut_parallel_for(size[1], thread_count, row_write, &memory);
    const double ms = 1e3 * (cli_now_s() - start_s);
    free(memory.texels);
    return ms;
}

/* Values in the slices of the samples, or only in those that differ. */
static double value_count(const struct bench_volume *volume, bool is_distinct)
{
    const int slices = is_distinct ? volume->plan->class_count : volume->lut.sample_count;
    return (double)volume->lut.size[0] * volume->lut.size[1] * slices * IO_CHANNEL_COUNT;
}

static double volume_exponentials_ms(const struct bench_volume *volume, bool is_distinct, int thread_count)
{
    double ms = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        ms += exponentials_ms(value_count(volume, is_distinct) / IO_CHANNEL_COUNT,
                              volume->plan->sources[c].count, thread_count);
    return ms;
}

/* ---- steps of a volume ----------------------------------------------------------------------------- */

enum step {
    EXPONENTIALS = 0,
    DISTINCT,
    MEMORY,
    PLAN,
    FILL,
    AUDIT,
    BAKE,
    PICTURE,
    FILE_WRITE,
    EXR_WRITE,
    READ_AUDIT,
    STEP_COUNT
};

static const char *const step_names[STEP_COUNT] = {
    "*floor: bare exponentials, one for each source and value*",
    "*floor: bare exponentials, of the values that differ only*",
    "*floor: the bytes written to fresh memory*",
    "plan: reach, sources, cells",
    "fill all texels",
    "audit",
    "`lut_tsm_bake`: the three above",
    "picture: copy, attributes, hash of the texels",
    "*floor: a file of as many bytes, with fsync*",
    "EXR file: ZIP, write, fsync",
    "read back, check and audit",
};

/* Whatever a step needs of those before it. */
struct run {
    const struct bench *bench;
    struct bench_volume volume;
    struct io_image *image;
    size_t file_size;
    char *file;
    struct lut_request request;
};

static void run_begin(const struct bench *bench, const struct io_material *material, struct run *run)
{
    dipole_status status;
    *run = (struct run){
        .bench = bench,
        .request = { .kind = LUT_TSM, .materials = material, .material_count = 1, .epsilon = 0.15 }
    };
    bench_volume_begin(material, usual_size, true, &run->volume);
    run->volume.lut.error.max = run->volume.lut.epsilon; /* nothing is asked of it */
    bench_check(lut_tsm_to_image(&run->volume.lut, &run->image, &status) &&
                    io_exr_write(bench_path(bench, "speed.exr"), run->image, false, &status),
                &status);
    bench_check(
        io_file_read(bench_path(bench, "speed.exr"), (size_t)1 << 32, &run->file, &run->file_size, &status),
        &status);
}

static void run_end(struct run *run)
{
    bench_volume_end(&run->volume);
    io_image_destroy(run->image);
    free(run->file);
}

static void bake_once(const struct run *run, int thread_count)
{
    struct lut_tsm *lut;
    dipole_status status;
    bench_check(lut_tsm_bake(&run->request, thread_count, &lut, &status), &status);
    lut_tsm_destroy(lut);
}

static void plan_once(const struct run *run)
{
    struct bench_volume volume;
    bench_volume_begin(&run->volume.lut.material, usual_size, false, &volume);
    bench_volume_end(&volume);
}

static void audit_once(const struct run *run, int thread_count)
{
    struct lut_error error;
    dipole_status status;
    bench_check(lut_tsm_plan_audit(run->volume.plan, LUT_AUDIT_BOTH, 4 * run->volume.lut.size[1],
                                   LUT_SEED_BAKE, thread_count, &error, &status),
                &status);
}

static void read_once(const struct run *run)
{
    struct lut_tsm *lut;
    struct lut_error error;
    dipole_status status;
    bench_check(lut_tsm_read(bench_path(run->bench, "speed.exr"), &lut, &status) &&
                    lut_tsm_audit(lut, 64, LUT_SEED_CHECK, &error, &status),
                &status);
    lut_tsm_destroy(lut);
}

static void picture_once(const struct run *run)
{
    struct io_image *image;
    dipole_status status;
    bench_check(lut_tsm_to_image(&run->volume.lut, &image, &status), &status);
    io_image_destroy(image);
}

static double step_ms(struct run *run, enum step step, int thread_count)
{
    dipole_status status;
    if (step == EXPONENTIALS || step == DISTINCT)
        return volume_exponentials_ms(&run->volume, step == DISTINCT, thread_count);
    if (step == MEMORY)
        return memory_ms(usual_size, thread_count);
    const double start_s = cli_now_s();
    switch (step) {
    case PLAN:
        plan_once(run);
        break;
    case FILL:
        bench_check(lut_tsm_plan_bake(run->volume.plan, thread_count, &status), &status);
        break;
    case AUDIT:
        audit_once(run, thread_count);
        break;
    case BAKE:
        bake_once(run, thread_count);
        break;
    case PICTURE:
        picture_once(run);
        break;
    case FILE_WRITE:
        bench_check(io_file_write(bench_path(run->bench, "floor.bin"), run->file, run->file_size, &status),
                    &status);
        break;
    case EXR_WRITE:
        bench_check(io_exr_write(bench_path(run->bench, "speed.exr"), run->image, false, &status), &status);
        break;
    default:
        read_once(run);
    }
    return 1e3 * (cli_now_s() - start_s);
}

/* All steps in turns with one and two threads; medians. */
static void steps_measure(struct run *run, const bool has_step[STEP_COUNT], double ms[STEP_COUNT][2])
{
    static double times[STEP_COUNT][2][ROUND_COUNT];
    for (int round = 0; round < ROUND_COUNT; round++)
        for (int threads = 1; threads <= 2; threads++)
            for (int step = 0; step < STEP_COUNT; step++)
                if (has_step[step])
                    times[step][threads - 1][round] = step_ms(run, (enum step)step, threads);
    for (int step = 0; step < STEP_COUNT; step++)
        for (int threads = 0; threads < 2; threads++)
            ms[step][threads] = has_step[step] ? bench_median(times[step][threads], ROUND_COUNT) : 0;
}

/* ---- the tables ------------------------------------------------------------------------------------ */

static void print_steps(const struct bench *bench)
{
    static const bool has_step[STEP_COUNT] = { true, true, true, true, true, true,
                                               true, true, true, true, true };
    const struct io_material marble = bench_material(bench, "marble");
    struct run run;
    double ms[STEP_COUNT][2];
    run_begin(bench, &marble, &run);
    steps_measure(&run, has_step, ms);
    const double whole = ms[BAKE][1] + ms[PICTURE][1] + ms[EXR_WRITE][1] + ms[READ_AUDIT][1];
    printf("| marble, 64 × 64 × 32, float | 1 thread, ms | 2 threads, ms |\n|---|---|---|\n");
    for (int step = 0; step < STEP_COUNT; step++)
        printf("| %s | %.2f | %.2f |\n", step_names[step], ms[step][0], ms[step][1]);
    printf("\nExponentials and memory are %.2f ms, filling takes %.1f times as long with one thread and "
           "%.1f times with "
           "two; the file is %.1f times its floor. All that `lutgen` does for a volume, with two threads, "
           "takes "
           "%.0f ms.\n",
           ms[EXPONENTIALS][0] + ms[MEMORY][0], ms[FILL][0] / (ms[EXPONENTIALS][0] + ms[MEMORY][0]),
           ms[FILL][1] / (ms[EXPONENTIALS][1] + ms[MEMORY][1]), ms[EXR_WRITE][0] / ms[FILE_WRITE][0],
           whole);
    run_end(&run);
}

static void print_models(const struct bench *bench)
{
    static const bool has_step[STEP_COUNT] = {
        [EXPONENTIALS] = true, [MEMORY] = true, [PLAN] = true, [FILL] = true, [AUDIT] = true
    };
    static const struct {
        const char *label, *file;
        dipole_model model; /* DIPOLE_MODEL_DIPOLE: as in the file */
    } rows[] = {
        { "marble, dipole", "marble", DIPOLE_MODEL_DIPOLE },
        { "skin1, dipole", "skin1", DIPOLE_MODEL_DIPOLE },
        { "marble, beam", "marble", DIPOLE_MODEL_BEAM },
        { "marble, modes", "marble", DIPOLE_MODEL_MODES },
        { "layered/marble_slab", "layered/marble_slab", DIPOLE_MODEL_DIPOLE },
        { "layered/skin", "layered/skin", DIPOLE_MODEL_DIPOLE },
    };
    printf("\n| 64 × 64 × 32 texels, two threads | sources of R, G, B | floor, ms | plan, ms | fill, ms | "
           "in units of the "
           "floor | audit, ms |\n|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < COUNT(rows); i++) {
        struct io_material material = bench_material(bench, rows[i].file);
        struct run run;
        double ms[STEP_COUNT][2];
        if (rows[i].model != DIPOLE_MODEL_DIPOLE)
            material.model = rows[i].model;
        run_begin(bench, &material, &run);
        steps_measure(&run, has_step, ms);
        const dipole_sources *const sources = run.volume.plan->sources;
        const double floor = ms[EXPONENTIALS][1] + ms[MEMORY][1];
        printf("| %s | %zu, %zu, %zu | %.2f | %.2f | %.2f | %.2f | %.2f |\n", rows[i].label,
               sources[0].count, sources[1].count, sources[2].count, floor, ms[PLAN][1], ms[FILL][1],
               ms[FILL][1] / floor, ms[AUDIT][1]);
        fflush(stdout);
        run_end(&run);
    }
}

/* ---- splat tables ---------------------------------------------------------------------------------- */

enum splat_step { S_EXPONENTIALS = 0, S_PROFILES, S_AXIS, S_FILL, S_BAKE, S_FLOOR, S_WRITE, S_COUNT };

/* A row that is filled again and again, and the table that it belongs to. */
struct splat_run {
    const struct bench *bench;
    struct lut_request request;
    struct lut_splat *lut;
    struct lut_profile profiles[IO_CHANNEL_COUNT];
    struct io_image *image;
    float *rgb;
    char *file;
    size_t file_size;
};

static void profiles_once(const struct splat_run *run)
{
    struct lut_profile profiles[IO_CHANNEL_COUNT];
    dipole_status status;
    bench_check(lut_profiles_init(run->request.materials, run->request.epsilon, profiles, &status),
                &status);
    lut_profiles_end(profiles);
}

static void splat_once(const struct splat_run *run)
{
    struct lut_splat *lut;
    dipole_status status;
    bench_check(lut_splat_bake(&run->request, &lut, &status), &status);
    lut_splat_destroy(lut);
}

static double splat_step_ms(const struct splat_run *run, enum splat_step step)
{
    struct lut_splat_row row = run->lut->rows[0];
    dipole_status status;
    if (step == S_EXPONENTIALS)
        return exponentials_ms((2 * run->lut->node_count - 1) * IO_CHANNEL_COUNT, 2, 1);
    const double start_s = cli_now_s();
    switch (step) {
    case S_PROFILES:
        profiles_once(run);
        break;
    case S_AXIS:
        (void)lut_axis_find(run->profiles, 160, &row.axis, &row.falloff);
        break;
    case S_FILL:
        bench_check(lut_splat_row_bake(&row, run->profiles, false, run->rgb, &status), &status);
        break;
    case S_BAKE:
        splat_once(run);
        break;
    case S_FLOOR:
        bench_check(io_file_write(bench_path(run->bench, "floor.bin"), run->file, run->file_size, &status),
                    &status);
        break;
    default:
        bench_check(io_exr_write(bench_path(run->bench, "speed.exr"), run->image, false, &status), &status);
    }
    return 1e3 * (cli_now_s() - start_s);
}

static void print_splat(const struct bench *bench, const char *label, const struct io_material *material)
{
    static double times[S_COUNT][ROUND_COUNT];
    double ms[S_COUNT];
    dipole_status status;
    struct splat_run run = {
        .bench = bench,
        .request = { .kind = LUT_SPLAT1D, .materials = material, .material_count = 1, .epsilon = 0.001 }
    };
    bench_check(lut_splat_bake(&run.request, &run.lut, &status) &&
                    lut_splat_to_image(run.lut, LUT_SPLAT1D, &run.image, &status) &&
                    lut_profiles_init(material, 0.001, run.profiles, &status) &&
                    io_exr_write(bench_path(bench, "speed.exr"), run.image, false, &status),
                &status);
    bench_check(
        io_file_read(bench_path(bench, "speed.exr"), (size_t)1 << 32, &run.file, &run.file_size, &status),
        &status);
    run.rgb = malloc((size_t)run.lut->node_count * IO_CHANNEL_COUNT * sizeof *run.rgb);
    for (int round = 0; round < ROUND_COUNT && run.rgb; round++)
        for (int step = 0; step < S_COUNT; step++)
            times[step][round] = splat_step_ms(&run, (enum splat_step)step);
    for (int step = 0; step < S_COUNT; step++)
        ms[step] = bench_median(times[step], ROUND_COUNT);
    printf("| %s | %d | %.4f | %.4f | %.1f | %.3f | %.3f | %.2f | %.2f | %.2f |\n", label,
           run.lut->node_count, ms[S_EXPONENTIALS], ms[S_FILL], ms[S_FILL] / ms[S_EXPONENTIALS],
           ms[S_PROFILES], ms[S_AXIS], ms[S_BAKE], ms[S_FLOOR], ms[S_WRITE]);
    fflush(stdout);
    free(run.rgb);
    free(run.file);
    io_image_destroy(run.image);
    lut_splat_destroy(run.lut);
    lut_profiles_end(run.profiles);
}

static void print_splats(const struct bench *bench)
{
    struct io_material material = bench_material(bench, "marble");
    printf(
        "\n| splat1d, ε = 0.001, one thread | texels | floor: exponentials, ms | fill, ms | in units of "
        "the floor | "
        "reach, ms | axis, ms | `lut_splat_bake` in all, ms | floor: file with fsync, ms | EXR file, ms |\n"
        "|---|---|---|---|---|---|---|---|---|---|\n");
    print_splat(bench, "marble, dipole", &material);
    material.model = DIPOLE_MODEL_BEAM;
    print_splat(bench, "marble, beam", &material);
    material = bench_material(bench, "skin1");
    print_splat(bench, "skin1, dipole", &material);
    material = bench_material(bench, "layered/skin");
    print_splat(bench, "layered/skin", &material);
}

void bench_speed(const struct bench *bench)
{
    print_steps(bench);
    print_models(bench);
    print_splats(bench);
}

/* ---- time against size ------------------------------------------------------------------------------ */

enum { SIZE_COUNT = 5, LINE_COUNT = 4 };

/* Milliseconds of: filling with one thread and with two, plan, fill and audit with two, and with the file.
 */
static void size_round(const struct bench *bench, const struct io_material *material, int side,
                       double ms[LINE_COUNT])
{
    const int size[3] = { side, side, side };
    struct bench_volume volume;
    struct lut_error error;
    struct io_image *image;
    dipole_status status;
    bench_volume_begin(material, size, false, &volume);
    double start_s = cli_now_s();
    bench_check(lut_tsm_plan_bake(volume.plan, 1, &status), &status);
    ms[0] = 1e3 * (cli_now_s() - start_s);
    bench_volume_end(&volume);
    start_s = cli_now_s();
    bench_volume_begin(material, size, false, &volume);
    const double fill_s = cli_now_s();
    bench_check(lut_tsm_plan_bake(volume.plan, 2, &status), &status);
    ms[1] = 1e3 * (cli_now_s() - fill_s);
    bench_check(
        lut_tsm_plan_audit(volume.plan, LUT_AUDIT_BOTH, 4 * side, LUT_SEED_BAKE, 2, &error, &status),
        &status);
    ms[2] = 1e3 * (cli_now_s() - start_s);
    bench_check(lut_tsm_to_image(&volume.lut, &image, &status) &&
                    io_exr_write(bench_path(bench, "speed.exr"), image, false, &status),
                &status);
    ms[3] = 1e3 * (cli_now_s() - start_s);
    io_image_destroy(image);
    bench_volume_end(&volume);
}

/* Slope of log y over log x by least squares. */
static double slope_of(const double *x, const double *y, size_t count)
{
    double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < count; i++) {
        mean_x += log(x[i]) / (double)count;
        mean_y += log(y[i]) / (double)count;
    }
    for (size_t i = 0; i < count; i++) {
        xx += (log(x[i]) - mean_x) * (log(x[i]) - mean_x);
        xy += (log(x[i]) - mean_x) * (log(y[i]) - mean_y);
    }
    return xy / xx;
}

void bench_sizes(const struct bench *bench)
{
    static const int sides[SIZE_COUNT] = { 16, 32, 64, 128, 256 };
    static const char *const names[LINE_COUNT] = { "fill, one thread", "fill, two threads",
                                                   "plan, fill, audit", "and EXR file" };
    static const char *const colors[LINE_COUNT] = { PLOT_BLUE, PLOT_GREEN, PLOT_RED, PLOT_GREY };
    static double times[SIZE_COUNT][LINE_COUNT][SIZE_ROUND_COUNT];
    double texels[SIZE_COUNT], ms[LINE_COUNT][SIZE_COUNT], through[SIZE_COUNT];
    const struct io_material marble = bench_material(bench, "marble");
    for (int round = 0; round < SIZE_ROUND_COUNT; round++)
        for (int i = 0; i < SIZE_COUNT; i++) {
            double found[LINE_COUNT];
            size_round(bench, &marble, sides[i], found);
            for (int k = 0; k < LINE_COUNT; k++)
                times[i][k][round] = found[k];
        }
    printf("| marble | samples | fill, 1 thread, ms | ns a texel | fill, 2 threads, ms | plan, fill, "
           "audit, ms | and "
           "EXR file, ms |\n|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < SIZE_COUNT; i++) {
        struct lut_cell cells[LUT_TSM_SAMPLE_LIMIT];
        texels[i] = (double)sides[i] * sides[i] * sides[i];
        for (int k = 0; k < LINE_COUNT; k++)
            ms[k][i] = bench_median(times[i][k], SIZE_ROUND_COUNT);
        printf("| %d³ | %d | %.3g | %.2f | %.3g | %.3g | %.3g |\n", sides[i],
               lut_pattern_cells(sides[i], cells), ms[0][i], 1e6 * ms[0][i] / texels[i], ms[1][i], ms[2][i],
               ms[3][i]);
    }
    double ratio = 0; /* the line through the origin, in the mean of logarithms */
    for (int i = 0; i < SIZE_COUNT; i++)
        ratio += log(ms[0][i] / texels[i]) / SIZE_COUNT;
    for (int i = 0; i < SIZE_COUNT; i++)
        through[i] = exp(ratio) * texels[i];
    printf("\nTime goes with the number of texels to the power of");
    for (int k = 0; k < LINE_COUNT; k++)
        printf(" %.2f (%s)%s", slope_of(texels, ms[k], SIZE_COUNT), names[k],
               k + 1 < LINE_COUNT ? "," : "");
    printf(", and filling takes %.2f ns a texel.\n", 1e6 * exp(ratio));

    struct plot_series series[2 * LINE_COUNT + 1];
    for (int k = 0; k < LINE_COUNT; k++) {
        series[2 * k] = (struct plot_series){ .label = names[k],
                                              .count = SIZE_COUNT,
                                              .x = texels,
                                              .y = ms[k],
                                              .color = colors[k],
                                              .dash = (enum plot_dash)k };
        series[2 * k + 1] = (struct plot_series){
            .kind = PLOT_POINTS, .count = SIZE_COUNT, .x = texels, .y = ms[k], .color = colors[k]
        };
    }
    series[2 * LINE_COUNT] = (struct plot_series){ .label = "proportional to texels",
                                                   .count = SIZE_COUNT,
                                                   .x = texels,
                                                   .y = through,
                                                   .color = "#000000",
                                                   .is_thin = true };
    const struct plot plot = { .title = "Time to bake a volume against its size",
                               .subtitle =
                                   "Marble; volumes of 16³, 32³, 64³, 128³ and 256³ texels, RGB, float.",
                               .x = { .title = "texels", .scale = PLOT_LOG },
                               .y = { .title = "time, ms", .scale = PLOT_LOG },
                               .series = series,
                               .series_count = COUNT(series),
                               .has_legend = true };
    bench_plot(bench, "tables_size.svg", &plot);
}
