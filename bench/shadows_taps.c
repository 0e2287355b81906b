/* Sets of taps, and ways to turn them: how far shadows are from those of rays. */
#include "bench/shadows.h"

#include "renderer/shadow_taps.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH_PX = 400, HEIGHT_PX = 300, PLACES = 256, TAPS = 25, CANDIDATES = 20 };

#define PI 3.14159265358979323846

static double next_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* Poisson discs by best candidates (Mitchell 1991): each tap the one of some random places that is farthest
 * from those before it. */
static void best_candidates(int count, double (*places)[2])
{
    uint64_t random = 1;
    for (int i = 0; i < count; i++) {
        double farthest = -1;
        for (int c = 0; c < CANDIDATES * count; c++) {
            const double radius = sqrt(next_random(&random)), angle = 2 * PI * next_random(&random);
            const double place[2] = { radius * cos(angle), radius * sin(angle) };
            double away = INFINITY;
            for (int j = 0; j < i; j++)
                away = fmin(away, hypot(place[0] - places[j][0], place[1] - places[j][1]));
            if (away > farthest) {
                farthest = away;
                memcpy(places[i], place, sizeof place);
            }
        }
    }
}

/* Root mean square of the error, relative to the truth's, once it is averaged over squares of pixels: what
 * is seen of noise. Red alone. */
static double blurred_rmse(const struct bench_shadows *bench, int side_px)
{
    double error2 = 0, value2 = 0;
    for (int y = 0; y + side_px <= HEIGHT_PX; y++) {
        for (int x = 0; x + side_px <= WIDTH_PX; x++) {
            double error = 0, value = 0;
            bool is_lit = true;
            for (int k = 0; k < side_px * side_px; k++) {
                const int pixel = (y + k / side_px) * WIDTH_PX + x + k % side_px;
                const double truth = bench->truth[3 * (size_t)pixel];
                is_lit = is_lit && bench_shadows_cosine(bench, pixel) > 0;
                error += (double)bench->shadow[4 * pixel] - truth;
                value += truth;
            }
            error2 += is_lit ? error * error : 0;
            value2 += is_lit ? value * value : 0;
        }
    }
    return sqrt(error2 / value2);
}

static bool run_scene(const char *path, dipole_status *status)
{
    static double spiral[TAPS][2], candidates[TAPS][2], relaxed[TAPS][2];
    static const struct {
        const char *name;
        const double (*taps)[2];
        enum render_shadow_turn turn;
    } rows[] = {
        { "spiral | screen", (const double(*)[2])spiral, RENDER_SHADOW_TURN_SCREEN },
        { "best candidates | screen", (const double(*)[2])candidates, RENDER_SHADOW_TURN_SCREEN },
        { "relaxed | screen", (const double(*)[2])relaxed, RENDER_SHADOW_TURN_SCREEN },
        { "relaxed | surface", (const double(*)[2])relaxed, RENDER_SHADOW_TURN_SURFACE },
        { "relaxed | none", (const double(*)[2])relaxed, RENDER_SHADOW_TURN_NONE },
    };
    struct bench_shadows bench;
    render_shadow_spiral(TAPS, spiral);
    best_candidates(TAPS, candidates);
    bool done = render_shadow_taps(TAPS, relaxed, status) &&
                bench_shadows_begin(path, WIDTH_PX, HEIGHT_PX, &bench, status);
    for (size_t i = 0; done && i < sizeof rows / sizeof *rows; i++) {
        const struct render_shadow_options options = { .tap_count = TAPS,
                                                       .taps = rows[i].taps,
                                                       .turn = rows[i].turn };
        done = bench_shadows_draw(&bench, &options, 1, NULL, status) &&
               (i > 0 || bench_shadows_trace_all(&bench, PLACES, status));
        if (done)
            printf("| %s | %s | %.2f | %.2f | %.2f |\n", bench_shadows_name(path), rows[i].name,
                   100 * blurred_rmse(&bench, 1), 100 * blurred_rmse(&bench, 3),
                   100 * blurred_rmse(&bench, 7));
        fflush(stdout);
    }
    bench_shadows_end(&bench);
    return done;
}

bool bench_shadows_taps(char *const *paths, int count, dipole_status *status)
{
    for (int i = 0; i < count; i++) {
        if (!run_scene(paths[i], status))
            return false;
    }
    return true;
}
