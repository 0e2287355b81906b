/* What the parts of bench_tables share. */
#ifndef BENCH_TABLES_H
#define BENCH_TABLES_H

#include "lutgen/tsm.h"
#include "plot/plot.h"

enum { BENCH_MATERIAL_COUNT = 12, BENCH_ROUND_LIMIT = 41 };

/* Stems of the files of the measured materials. */
extern const char *const bench_material_names[BENCH_MATERIAL_COUNT];

/* What is measured with: the folder of materials, and where pictures and files go. */
struct bench {
    const char *materials, *output;
};

/* Print why and end the program, where a step failed. */
void bench_check(bool is_done, const dipole_status *status);

/* "marble", "layered/skin". */
struct io_material bench_material(const struct bench *bench, const char *name);

/* A volume with its plan and, if it is to be filled, its texels. End it with bench_volume_end. */
struct bench_volume {
    struct lut_tsm lut;
    struct lut_tsm_plan *plan;
};
void bench_volume_begin(const struct io_material *material, const int size[3], bool is_filled,
                        struct bench_volume *volume);
void bench_volume_end(struct bench_volume *volume);

/* A path in the output folder; valid until the next call. */
const char *bench_path(const struct bench *bench, const char *name);
size_t bench_file_size(const char *path);
void bench_plot(const struct bench *bench, const char *name, const struct plot *plot);

/* Of one time per round; sorts them. */
double bench_median(double *times, size_t count);

/* The parts; each prints Markdown. */
void bench_speed(const struct bench *bench);
void bench_sizes(const struct bench *bench);
void bench_splat_errors(const struct bench *bench);
void bench_volume_errors(const struct bench *bench);
void bench_normals(const struct bench *bench);
void bench_energy(const struct bench *bench);
void bench_partition(const struct bench *bench);

#endif
