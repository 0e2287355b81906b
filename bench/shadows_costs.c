/* What effects of shadows take beside what the plan predicts, programs compiled. */
#include "bench/shadows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH_PX = 400, HEIGHT_PX = 300, RUNS = 6, RATIOS = 256 };

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* The first frame of several renderers: with programs that a cache holds from the second on. */
static bool run_scene(const char *path, enum render_technique technique, double *ratios, int *ratio_count,
                      dipole_status *status)
{
    double least_ms[RENDER_EFFECT_LIMIT] = { 0 };
    for (int i = 0; i < RUNS; i++) {
        struct bench_shadows bench;
        struct render_plan *plan = NULL;
        double time_ms[RENDER_EFFECT_LIMIT];
        bool done = bench_shadows_begin(path, WIDTH_PX, HEIGHT_PX, &bench, status);
        if (done) {
            const struct render_request request = { .scene = bench.scene,
                                                    .media = bench.renderer->media,
                                                    .technique = technique,
                                                    .epsilon = 0.01 };
            done = render_run(bench.renderer, &request, &plan, time_ms, status);
        }
        for (size_t e = 0; done && e < plan->effect_count; e++) {
            least_ms[e] = i == 0 ? time_ms[e] : fmin(least_ms[e], time_ms[e]);
            const double predicted_ms = plan->decisions[e].cost_ms;
            if (i < RUNS - 1 || !bench_shadows_has(render_effects[e]->name) || !(predicted_ms > 0.5))
                continue;
            printf("| %s | %s | %s | %.0f | %.0f | %.2f |\n", bench_shadows_name(path),
                   render_technique_names[technique], render_effects[e]->name, predicted_ms, least_ms[e],
                   predicted_ms / least_ms[e]);
            if (*ratio_count < RATIOS)
                ratios[(*ratio_count)++] = predicted_ms / least_ms[e];
        }
        render_plan_destroy(plan);
        bench_shadows_end(&bench);
        if (!done)
            return false;
    }
    return true;
}

bool bench_shadows_costs(char *const *paths, int count, dipole_status *status)
{
    static double ratios[RATIOS];
    int ratio_count = 0;
    puts("| scene | technique | effect | predicted ms | ms | ratio |\n|---|---|---|---|---|---|");
    for (int i = 0; i < count; i++) {
        if (!run_scene(paths[i], RENDER_TECHNIQUE_LAMBERT, ratios, &ratio_count, status) ||
            !run_scene(paths[i], RENDER_TECHNIQUE_GATHER, ratios, &ratio_count, status))
            return false;
    }
    for (int i = 0; i < ratio_count; i++)
        ratios[i] = fabs(log(ratios[i]));
    qsort(ratios, (size_t)ratio_count, sizeof *ratios, by_size);
    if (ratio_count > 0)
        printf("\nThe median of %d predictions is off by a factor of %.2f.\n", ratio_count,
               exp(ratios[ratio_count / 2]));
    return true;
}
