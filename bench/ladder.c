/*
 * The physics ladder over the reference data and bundled materials: docs/ladder.md.
 * usage: bench_ladder REFERENCE PLOT.svg PHOTONS MATERIAL...; prints Markdown. PHOTONS are those of truth
 * for each channel of a material.
 */
#include "accuracy/ladder.h"
#include "cli/cli.h"
#include "io/file.h"

#include <stdlib.h>

enum { MATERIAL_LIMIT = 64, PHOTON_RUNGS = 4 };

static void print_rungs(const struct accuracy_ladder *ladder)
{
    printf(
        "| rung | stacks | error, median | least | largest | ns a radius |\n|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        struct accuracy_rung_summary all;
        if (accuracy_rung_summarize(ladder, i, &all))
            printf("| %s | %zu | %.3f | %.3f | %.3f | %.3g |\n", accuracy_rung_name(i), all.count,
                   all.error, all.error_low, all.error_high, all.time_ns);
    }
}

static void print_totals(const struct accuracy_ladder *ladder)
{
    printf("\n| rung | g = 0: error | of | µs a slab | g = 0.8: error | of | µs a slab |\n"
           "|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < ACCURACY_RUNG_COUNT; i++) {
        const struct accuracy_rung *const g0 = &ladder->totals[0][i], *const g8 = &ladder->totals[1][i];
        if (g0->is_known && g8->is_known)
            printf("| %s | %.4f | %zu | %.3g | %.4f | %zu | %.3g |\n", accuracy_rung_name(i), g0->error,
                   ladder->total_counts[0][i], 1e-3 * g0->time_ns, g8->error, ladder->total_counts[1][i],
                   1e-3 * g8->time_ns);
    }
}

static void print_agreement(const char *name, const struct accuracy_agreement *agreement)
{
    printf("| %s | %zu | %zu | %.2f | %.2f |\n", name, agreement->count, agreement->beyond_count,
           agreement->worst, agreement->mean_square);
}

/* With the most photons of those rungs that all cases have. */
static void print_cases(const struct accuracy_ladder *ladder)
{
    const size_t rung = PHOTON_RUNGS - 2;
    printf("\n| stack | truth errs by |");
    for (size_t i = rung; i < ACCURACY_RUNG_COUNT; i++)
        if (i != PHOTON_RUNGS - 1)
            printf(" %s |", accuracy_rung_name(i));
    printf(" photons per s |\n|---|---|---|---|---|---|---|---|---|\n");
    for (size_t k = 0; k < ladder->case_count; k++) {
        const struct accuracy_ladder_case *const at = &ladder->cases[k];
        printf("| %s | %.4f |", at->name, at->floor);
        for (size_t i = rung; i < ACCURACY_RUNG_COUNT; i++)
            if (i != PHOTON_RUNGS - 1 && at->rungs[i].is_known)
                printf(" %.3f |", at->rungs[i].error);
            else if (i != PHOTON_RUNGS - 1)
                printf(" |");
        if (at->rungs[rung].is_known)
            printf(" %.2g |\n", 1e5 / (1e-9 * at->rungs[rung].time_ns * (double)at->ring_count));
        else
            printf(" |\n");
    }
}

static bool run(int argc, char **argv, dipole_status *status)
{
    static struct io_material materials[MATERIAL_LIMIT];
    struct accuracy_ladder_options options = { .materials = materials,
                                               .truth_photon_count = strtoull(argv[3], NULL, 10),
                                               .seed = 1 };
    struct accuracy_reference *reference;
    struct accuracy_ladder ladder = { 0 };
    char *svg = NULL;
    size_t size;
    bool done = accuracy_reference_read(argv[1], &reference, status);
    for (int i = 4; i < argc && options.material_count < MATERIAL_LIMIT && done; i++)
        done = io_material_open(argv[i], &materials[options.material_count++], status);
    options.reference = reference;
    done = done && accuracy_ladder_init(&options, &ladder, status) &&
           accuracy_ladder_plot_create(&ladder, &svg, &size, status) &&
           io_file_write(argv[2], svg, size, status);
    if (done) {
        print_rungs(&ladder);
        print_totals(&ladder);
        printf("\n| Monte Carlo against others | numbers | beyond 3 | largest z | mean z² |\n"
               "|---|---|---|---|---|\n");
        print_agreement("totals: MCML, adding and doubling", &ladder.agreement_totals);
        print_agreement("rings: MCML", &ladder.agreement_rings);
        print_cases(&ladder);
    }
    accuracy_ladder_end(&ladder);
    free(svg);
    free(reference);
    return done;
}

int main(int argc, char **argv)
{
    const struct cli_tool tool = { .name = "bench_ladder" };
    dipole_status status = { .code = DIPOLE_OK };
    if (argc < 5) {
        fprintf(stderr, "usage: bench_ladder REFERENCE PLOT.svg PHOTONS MATERIAL...\n");
        return EXIT_USAGE;
    }
    return run(argc, argv, &status) ? EXIT_DONE : cli_report(&tool, &status, EXIT_FAILED);
}
