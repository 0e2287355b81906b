/* The cases of the ladder, and the way up. docs/theory.md T78. */
#include "accuracy/ladder_parts.h"
#include "accuracy/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { OWN_RING_COUNT = 40 };

/* ---- cases ---------------------------------------------------------------------------------------- */

/* Join rings of MCML until each is wide enough. */
static void case_of_reference(const struct accuracy_reference_case *from, struct accuracy_ladder_case *out)
{
    const double growth = 1.2;
    *out = (struct accuracy_ladder_case){ .stack = from->stack, .entered = 1 - from->specular };
    snprintf(out->name, sizeof out->name, "%s", from->name);
    out->reflected = (from->reflected + from->unscattered_reflected) / out->entered;
    out->edges_mm[0] = from->edges_mm[0];
    double power = 0, variance = 0;
    for (size_t i = 0; i < from->ring_count && out->ring_count < ACCURACY_LADDER_RING_LIMIT; i++) {
        const double lo_mm = from->edges_mm[i], hi_mm = from->edges_mm[i + 1];
        const double area = LADDER_PI * (hi_mm - lo_mm) * (hi_mm + lo_mm);
        power += area * from->rd_per_mm2[i];
        variance += area * area * from->rd_error[i] * from->rd_error[i];
        if (hi_mm < growth * out->edges_mm[out->ring_count] && i + 1 < from->ring_count)
            continue;
        const size_t ring = out->ring_count++;
        out->edges_mm[ring + 1] = hi_mm;
        out->rd_per_mm2[ring] = power / (ladder_area_mm2(out, ring) * out->entered);
        out->rd_error[ring] = sqrt(variance) / (ladder_area_mm2(out, ring) * out->entered);
        power = variance = 0;
    }
}

static bool case_of_material(const struct accuracy_ladder_options *options,
                             const struct io_material *material, int channel,
                             struct accuracy_ladder_case *out, dipole_status *status)
{
    const struct accuracy_mc_run run = { options->truth_photon_count, options->seed,
                                         options->thread_count };
    struct accuracy_mc_result result;
    *out = (struct accuracy_ladder_case){ .is_own_truth = true, .ring_count = OWN_RING_COUNT };
    snprintf(out->name, sizeof out->name, "%s, %s", material->name, io_channel_names[channel]);
    accuracy_mc_stack_init(material->layers[channel], material->layer_count, options->g, &out->stack);
    if (!accuracy_rings_choose(material->layers[channel], material->layer_count, OWN_RING_COUNT,
                               out->edges_mm, status) ||
        !ladder_trace_case(out, &run, out->rd_per_mm2, out->rd_error, &result, NULL, status))
        return false;
    out->entered = 1 - result.mean.specular;
    out->reflected = ladder_reflected(&result.mean);
    return true;
}

/* ---- all of it ------------------------------------------------------------------------------------ */

static void show(const struct accuracy_ladder_options *options, const char *what, double fraction)
{
    if (options->show)
        options->show(options->context, what, fraction);
}

static bool climb_references(const struct accuracy_ladder_options *options, size_t case_count,
                             struct accuracy_ladder *out, dipole_status *status)
{
    bool done = true;
    for (size_t i = 0;
         options->reference && i < options->reference->case_count && done && !ladder_is_stopped(options);
         i++) {
        const struct accuracy_reference_case *const from = &options->reference->cases[i];
        if (from->ring_count == 0)
            continue;
        struct accuracy_ladder_case *const at = &out->cases[out->case_count++];
        show(options, from->name, (double)out->case_count / (double)case_count);
        case_of_reference(from, at);
        done = ladder_climb(options, at, from, out, status);
    }
    for (size_t rung = 0; options->reference && rung < ACCURACY_RUNG_COUNT && done; rung++)
        done = ladder_climb_totals(options, rung, 0, out, status) &&
               ladder_climb_totals(options, rung, 1, out, status);
    return done;
}

bool accuracy_ladder_init(const struct accuracy_ladder_options *options, struct accuracy_ladder *out,
                          dipole_status *status)
{
    const size_t reference_count = options->reference ? options->reference->case_count : 0;
    const size_t case_count = reference_count + IO_CHANNEL_COUNT * options->material_count;
    *out = (struct accuracy_ladder){ .cases = calloc(case_count + 1, sizeof *out->cases) };
    if (!out->cases)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for the ladder");
    bool done = climb_references(options, case_count, out, status);
    for (size_t i = 0;
         i < IO_CHANNEL_COUNT * options->material_count && done && !ladder_is_stopped(options); i++) {
        struct accuracy_ladder_case *const at = &out->cases[out->case_count];
        const struct io_material *const material = &options->materials[i / IO_CHANNEL_COUNT];
        show(options, material->name, (double)out->case_count / (double)case_count);
        done = case_of_material(options, material, (int)(i % IO_CHANNEL_COUNT), at, status) &&
               ladder_climb(options, at, NULL, out, status);
        out->case_count += done;
    }
    return done;
}

void accuracy_ladder_end(struct accuracy_ladder *ladder)
{
    free(ladder->cases);
    *ladder = (struct accuracy_ladder){ 0 };
}
