/*
 * What tables cost and how exact they are.
 * usage: bench_tables PART MATERIALS OUTPUT; prints Markdown, writes pictures into OUTPUT.
 */
#include "bench/tables.h"
#include "cli/cli.h"
#include "io/file.h"

#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

const char *const bench_material_names[BENCH_MATERIAL_COUNT] = { "apple",  "chicken1",   "chicken2",
                                                                 "cream",  "ketchup",    "marble",
                                                                 "potato", "skimmilk",   "skin1",
                                                                 "skin2",  "spectralon", "wholemilk" };

void bench_check(bool is_done, const dipole_status *status)
{
    if (is_done)
        return;
    fprintf(stderr, "bench_tables: %s\n", status->message);
    exit(EXIT_FAILED);
}

struct io_material bench_material(const struct bench *bench, const char *name)
{
    char path[4096];
    struct io_material material;
    dipole_status status;
    snprintf(path, sizeof path, "%s/%s.json", bench->materials, name);
    bench_check(io_material_read(path, &material, &status), &status);
    return material;
}

void bench_volume_begin(const struct io_material *material, const int size[3], bool is_filled,
                        struct bench_volume *volume)
{
    dipole_status status;
    *volume = (struct bench_volume){ .lut = { .material = *material, .epsilon = 0.15 } };
    memcpy(volume->lut.size, size, sizeof volume->lut.size);
    bench_check(lut_tsm_plan_create(&volume->lut, &volume->plan, &status), &status);
    if (is_filled)
        bench_check(lut_tsm_plan_bake(volume->plan, 0, &status), &status);
}

void bench_volume_end(struct bench_volume *volume)
{
    lut_tsm_plan_destroy(volume->plan);
    free(volume->lut.rgb);
}

const char *bench_path(const struct bench *bench, const char *name)
{
    static char path[4096];
    snprintf(path, sizeof path, "%s/%s", bench->output, name);
    return path;
}

size_t bench_file_size(const char *path)
{
    char *data;
    size_t size;
    dipole_status status;
    bench_check(io_file_read(path, (size_t)1 << 32, &data, &size, &status), &status);
    free(data);
    return size;
}

void bench_plot(const struct bench *bench, const char *name, const struct plot *plot)
{
    char *svg;
    size_t size;
    dipole_status status;
    bench_check(plot_svg_create(plot, &svg, &size, &status) &&
                    io_file_write(bench_path(bench, name), svg, size, &status),
                &status);
    free(svg);
}

static int compare(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

double bench_median(double *times, size_t count)
{
    qsort(times, count, sizeof *times, compare);
    return times[count / 2];
}

int main(int argc, char **argv)
{
    static const struct part {
        const char *name;
        void (*run)(const struct bench *bench);
    } parts[] = {
        { "speed", bench_speed },           { "sizes", bench_sizes },     { "splat", bench_splat_errors },
        { "volumes", bench_volume_errors }, { "normals", bench_normals }, { "energy", bench_energy },
        { "partition", bench_partition },
    };
    for (size_t i = 0; argc == 4 && i < COUNT(parts); i++)
        if (strcmp(argv[1], parts[i].name) == 0) {
            const struct bench bench = { .materials = argv[2], .output = argv[3] };
            parts[i].run(&bench);
            return EXIT_DONE;
        }
    fprintf(stderr, "usage: bench_tables PART MATERIALS OUTPUT\nparts:");
    for (size_t i = 0; i < COUNT(parts); i++)
        fprintf(stderr, " %s", parts[i].name);
    fprintf(stderr, "\n");
    return EXIT_USAGE;
}
