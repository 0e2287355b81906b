/* What baking a table costs, beside what no baking can do without: exponentials, and writing the bytes. */
#include "bench/bare_exp.h"
#include "bench/tables.h"
#include "cli/cli.h"
#include "io/file.h"
#include "io/raw.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

enum { CHUNK = 4096, ROUND_COUNT = 21, SIZE_ROUND_COUNT = 5 };

static const int usual_size[3] = { 64, 64, 32 };

/* ---- floors ---------------------------------------------------------------------------------------- */

static void chunk_run(void *context, int chunk)
{
    const double *const r_mm = context;
    static _Thread_local double values[CHUNK];
    static volatile double sink;
    (void)chunk;
    bare_exp(r_mm, CHUNK, values);
    sink = values[CHUNK - 1];
    (void)sink;
}

/* Of pairs of exponentials. */
static double exponentials_ms(double pair_count, int thread_count)
{
    static double r_mm[CHUNK];
    for (int i = 0; i < CHUNK; i++)
        r_mm[i] = 20.0 * i / CHUNK;
    const int chunks = (int)ceil(pair_count / CHUNK);
    const double start_s = cli_now_s();
    lut_parallel_for(chunks, thread_count, chunk_run, r_mm);
    return 1e3 * (cli_now_s() - start_s) * pair_count / ((double)chunks * CHUNK);
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

/* One for each source and value in the slices of the samples, or in those that differ only. */
static double volume_exponentials_ms(const struct bench_volume *volume, bool is_distinct, int thread_count)
{
    const int slices = is_distinct ? volume->plan->class_count : volume->lut.sample_count;
    double pairs = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        pairs += 0.5 * (double)volume->plan->sources[c].count;
    return exponentials_ms(pairs * volume->lut.size[0] * volume->lut.size[1] * slices, thread_count);
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
    RAW_FLOOR,
    RAW_WRITE,
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
    "*floor: a file of as many bytes as the EXR file, with fsync*",
    "EXR file: ZIP, write, fsync",
    "*floor: a file of all texels, with fsync*",
    "raw file and its sidecar, each with fsync",
    "read the EXR file back, check and audit it",
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
    bench_check(lut_tsm_plan_audit(run->volume.plan, LUT_AUDIT_BOTH, 2 * (run->volume.lut.size[1] - 1),
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
    case RAW_FLOOR:
        bench_check(io_file_write(bench_path(run->bench, "floor.bin"), run->volume.lut.rgb,
                                  (size_t)usual_size[0] * (size_t)usual_size[1] * (size_t)usual_size[2] *
                                      IO_CHANNEL_COUNT * sizeof(float),
                                  &status),
                    &status);
        break;
    case RAW_WRITE:
        bench_check(
            io_raw_write(bench_path(run->bench, "speed.raw"), run->image, usual_size[2], false, &status),
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
    bool has_step[STEP_COUNT];
    const struct io_material marble = bench_material(bench, "marble");
    struct run run;
    double ms[STEP_COUNT][2];
    for (int step = 0; step < STEP_COUNT; step++)
        has_step[step] = true;
    run_begin(bench, &marble, &run);
    steps_measure(&run, has_step, ms);
    const double whole = ms[BAKE][1] + ms[PICTURE][1] + ms[EXR_WRITE][1] + ms[READ_AUDIT][1];
    printf("| marble, 64 × 64 × 32, float | 1 thread, ms | 2 threads, ms |\n|---|---|---|\n");
    for (int step = 0; step < STEP_COUNT; step++)
        printf("| %s | %.2f | %.2f |\n", step_names[step], ms[step][0], ms[step][1]);
    printf("\nFilling takes %.1f times its floor, exponentials and memory, with one thread and %.1f times "
           "with two. "
           "Filling and the raw file take %.1f times the floor of both; filling and the EXR file %.1f "
           "times, and "
           "nearly all of that is ZIP. All that `lutgen` does for this volume, read back and audited, "
           "takes %.0f ms "
           "with two threads.\n",
           ms[FILL][0] / (ms[EXPONENTIALS][0] + ms[MEMORY][0]),
           ms[FILL][1] / (ms[EXPONENTIALS][1] + ms[MEMORY][1]),
           (ms[FILL][0] + ms[RAW_WRITE][0]) / (ms[EXPONENTIALS][0] + ms[MEMORY][0] + ms[RAW_FLOOR][0]),
           (ms[FILL][0] + ms[EXR_WRITE][0]) / (ms[EXPONENTIALS][0] + ms[MEMORY][0] + ms[FILE_WRITE][0]),
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

enum splat_step {
    S_EXPONENTIALS = 0,
    S_VALUES,
    S_PROFILES,
    S_AXIS,
    S_FILL,
    S_BAKE,
    S_FLOOR,
    S_WRITE,
    S_COUNT
};

/* A row that is filled again and again, and the table that it belongs to. */
struct splat_run {
    const struct bench *bench;
    struct lut_request request;
    struct lut_splat *lut;
    struct lut_profile profiles[IO_CHANNEL_COUNT];
    struct io_image *image;
    double *r_mm, *values; /* of all nodes and middles */
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
        return exponentials_ms((2 * run->lut->node_count - 1) * IO_CHANNEL_COUNT, 1);
    const double start_s = cli_now_s();
    switch (step) {
    case S_VALUES:
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            lut_profile_evaluate(&run->profiles[c], run->r_mm, 2 * (size_t)run->lut->node_count - 1,
                                 run->values);
        break;
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
    const size_t nodes = (size_t)run.lut->node_count;
    run.rgb = malloc(nodes * IO_CHANNEL_COUNT * sizeof *run.rgb);
    run.r_mm = malloc(4 * nodes * sizeof *run.r_mm);
    if (!run.rgb || !run.r_mm)
        exit(EXIT_FAILED);
    run.values = run.r_mm + 2 * nodes;
    for (size_t i = 0; i < 2 * nodes - 1; i++)
        run.r_mm[i] = lut_axis_r_mm(&run.lut->rows[0].axis, 0.5 * (double)i);
    for (int round = 0; round < ROUND_COUNT; round++)
        for (int step = 0; step < S_COUNT; step++)
            times[step][round] = splat_step_ms(&run, (enum splat_step)step);
    for (int step = 0; step < S_COUNT; step++)
        ms[step] = bench_median(times[step], ROUND_COUNT);
    printf("| %s | %d | %.1f | %.1f | %.1f | %.0f | %.0f | %.2f | %.2f | %.2f | %.2f |\n", label,
           run.lut->node_count, 1e3 * ms[S_EXPONENTIALS], 1e3 * ms[S_VALUES], 1e3 * ms[S_FILL],
           1e3 * ms[S_PROFILES], 1e3 * ms[S_AXIS], ms[S_BAKE], ms[S_FLOOR], ms[S_WRITE],
           (ms[S_FILL] + ms[S_WRITE]) / (ms[S_VALUES] + ms[S_FLOOR]));
    fflush(stdout);
    free(run.rgb);
    free(run.r_mm);
    free(run.file);
    io_image_destroy(run.image);
    lut_splat_destroy(run.lut);
    lut_profiles_end(run.profiles);
}

static void print_splats(const struct bench *bench)
{
    struct io_material material = bench_material(bench, "marble");
    printf("\n| splat1d, ε = 0.001, one thread | texels | *two bare exponentials for each value, µs* | "
           "*bare profile, µs* "
           "| fill, µs | reach, µs | axis, µs | `lut_splat_bake`, ms | *floor: file with fsync, ms* | EXR "
           "file, ms | fill and "
           "file over profile and floor |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
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

/* Filled as often as makes a million texels, so that the clock can tell. */
static double fill_ms(struct bench_volume *volume, int thread_count)
{
    const int texels = volume->lut.size[0] * volume->lut.size[1] * volume->lut.size[2];
    const int times = texels < 1 << 20 ? (1 << 20) / texels : 1;
    const double start_s = cli_now_s();
    for (int i = 0; i < times; i++) {
        dipole_status status;
        bench_check(lut_tsm_plan_bake(volume->plan, thread_count, &status), &status);
    }
    return 1e3 * (cli_now_s() - start_s) / times;
}

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
    char name[32]; /* to replace a larger file takes the time to delete it */
    snprintf(name, sizeof name, "speed_%d.exr", side);
    bench_volume_begin(material, size, false, &volume);
    ms[0] = fill_ms(&volume, 1);
    ms[1] = fill_ms(&volume, 2);
    bench_volume_end(&volume);
    const double start_s = cli_now_s();
    bench_volume_begin(material, size, false, &volume);
    bench_check(lut_tsm_plan_bake(volume.plan, 2, &status), &status);
    bench_check(
        lut_tsm_plan_audit(volume.plan, LUT_AUDIT_BOTH, 2 * (side - 1), LUT_SEED_BAKE, 2, &error, &status),
        &status);
    ms[2] = 1e3 * (cli_now_s() - start_s);
    bench_check(lut_tsm_to_image(&volume.lut, &image, &status) &&
                    io_exr_write(bench_path(bench, name), image, false, &status),
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
    double ratio = 0; /* the line through the origin, in the mean of logarithms, from 32³ on */
    for (int i = 1; i < SIZE_COUNT; i++)
        ratio += log(ms[0][i] / texels[i]) / (SIZE_COUNT - 1);
    for (int i = 0; i < SIZE_COUNT; i++)
        through[i] = exp(ratio) * texels[i];
    printf("\nFrom 32³ on time goes with the number of texels to the power of");
    for (int k = 0; k < LINE_COUNT; k++)
        printf(" %.2f (%s)%s", slope_of(texels + 1, ms[k] + 1, SIZE_COUNT - 1), names[k],
               k + 1 < LINE_COUNT ? "," : ".");
    printf(" The line through the origin is %.2f ns a texel with one thread; what each row of a volume "
           "needs whatever its "
           "size makes 16³ take longer, and so does starting a thread.\n",
           1e6 * exp(ratio));

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
    series[2 * LINE_COUNT] = (struct plot_series){ .label = "in proportion to texels",
                                                   .count = SIZE_COUNT,
                                                   .x = texels,
                                                   .y = through,
                                                   .color = "#000000",
                                                   .is_thin = true };
    const struct plot plot = { .title = "Time to bake a volume against its size",
                               .subtitle =
                                   "Marble; volumes of 16³, 32³, 64³, 128³ and 256³ texels, RGB, float.",
                               .x = { .title = "texels", .scale = PLOT_LOG, .min = 2e3, .max = 4e7 },
                               .y = { .title = "time, ms", .scale = PLOT_LOG },
                               .series = series,
                               .series_count = COUNT(series),
                               .has_legend = true };
    bench_plot(bench, "tables_size.svg", &plot);
}
