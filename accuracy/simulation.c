#include "accuracy/simulation.h"

#include "cli/cli.h"

#include <math.h>

bool accuracy_rings_choose(const dipole_layer *layers, size_t layer_count, size_t count, double *edges_mm,
                           dipole_status *status)
{
    dipole_stack *stack;
    if (!dipole_stack_create(layers, layer_count, DIPOLE_MODEL_BEAM, DIPOLE_FROM_ABOVE, &stack, status))
        return false;
    const double first_mm = 0.05 * dipole_stack_coefficients(stack, 0)->mean_free_path_mm;
    const double far_mm = dipole_stack_r_max_mm(stack, DIPOLE_FACE_LIT, 1e-3);
    const double last_mm = far_mm > 10 * first_mm ? far_mm : 10 * first_mm; /* also where nothing leaves */
    edges_mm[0] = 0;
    for (size_t i = 0; i < count; i++)
        edges_mm[i + 1] = first_mm * pow(last_mm / first_mm, (double)i / (double)(count - 1));
    dipole_stack_destroy(stack);
    return true;
}

bool accuracy_simulation_run(const struct accuracy_simulation_options *options,
                             struct accuracy_simulation *out, dipole_status *status)
{
    *out = (struct accuracy_simulation){ .g = options->g, .seed = options->run.seed };
    if (!io_material_open(options->material, &out->material, status))
        return false;
    const double start_s = cli_now_s();
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        struct accuracy_simulation_channel *const at = &out->channels[c];
        const struct accuracy_mc_rings rings = { at->edges_mm,   ACCURACY_SIMULATION_RING_COUNT,
                                                 at->rd_per_mm2, at->rd_error,
                                                 at->td_per_mm2, at->td_error };
        const dipole_layer *const layers = out->material.layers[c];
        accuracy_mc_stack_init(layers, out->material.layer_count, options->g, &at->stack);
        if (!accuracy_rings_choose(layers, out->material.layer_count, rings.count, at->edges_mm, status) ||
            !accuracy_mc_trace(&at->stack, &options->run, &rings, &at->result, status))
            return false;
    }
    out->time_s = cli_now_s() - start_s;
    return true;
}

/* ---- results -------------------------------------------------------------------------------------- */

/* A number that is estimated, with its standard error; what is exact has 0. */
static json_t *estimate(double mean, double error)
{
    return json_pack("{s:f, s:f}", "mean", mean, "sem", error);
}

static json_t *powers_to_json(const struct accuracy_mc_result *result, size_t layer_count)
{
    const struct accuracy_mc_powers *const mean = &result->mean, *const error = &result->error;
    json_t *const absorbed = json_array();
    for (size_t i = 0; i < layer_count; i++)
        json_array_append_new(absorbed, estimate(mean->absorbed[i], error->absorbed[i]));
    return json_pack(
        "{s:f, s:f, s:f, s:o, s:o, s:o, s:o, s:o}", "specular", mean->specular, "unscattered_reflected",
        mean->unscattered_reflected, "unscattered_transmitted", mean->unscattered_transmitted, "reflected",
        estimate(mean->reflected, error->reflected), "transmitted",
        estimate(mean->transmitted, error->transmitted), "absorbed_in_layers", absorbed, "roulette",
        estimate(mean->roulette, error->roulette), "lost", estimate(mean->lost, error->lost));
}

static json_t *channel_to_json(const struct accuracy_simulation_channel *at, const char *name)
{
    json_t *const rings = json_array();
    for (size_t i = 0; i < ACCURACY_SIMULATION_RING_COUNT; i++)
        json_array_append_new(rings, json_pack("{s:f, s:f, s:f, s:f, s:f, s:f}", "r_lo_mm", at->edges_mm[i],
                                               "r_hi_mm", at->edges_mm[i + 1], "rd_per_mm2",
                                               at->rd_per_mm2[i], "rd_sem", at->rd_error[i], "td_per_mm2",
                                               at->td_per_mm2[i], "td_sem", at->td_error[i]));
    return json_pack("{s:s, s:f, s:o, s:o}", "channel", name, "scatterings_per_photon",
                     at->result.scatterings / (double)at->result.photon_count, "powers",
                     powers_to_json(&at->result, at->stack.layer_count), "rings", rings);
}

json_t *accuracy_simulation_to_json(const struct accuracy_simulation *simulation)
{
    json_t *const channels = json_array();
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        json_array_append_new(channels, channel_to_json(&simulation->channels[c], io_channel_names[c]));
    return json_pack("{s:s, s:f, s:I, s:I, s:f, s:o}", "material", simulation->material.name, "g",
                     simulation->g, "photons", (json_int_t)simulation->channels[0].result.photon_count,
                     "seed", (json_int_t)simulation->seed, "seconds", simulation->time_s, "channels",
                     channels);
}

static void print_power(FILE *file, const char *name, const struct accuracy_simulation *simulation,
                        size_t offset)
{
    fprintf(file, "%-24s", name);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct accuracy_mc_result *const result = &simulation->channels[c].result;
        fprintf(file, "  %9.6f +- %-8.2g", ((const double *)&result->mean)[offset],
                ((const double *)&result->error)[offset]);
    }
    fprintf(file, "\n");
}

#define OFFSET(member) (offsetof(struct accuracy_mc_powers, member) / sizeof(double))

void accuracy_simulation_print(const struct accuracy_simulation *simulation, FILE *file)
{
    fprintf(file, "%s, g %g, %zu photons a channel, seed %llu, %.2f s\n\n%-24s", simulation->material.name,
            simulation->g, simulation->channels[0].result.photon_count,
            (unsigned long long)simulation->seed, simulation->time_s, "per incident power");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        fprintf(file, "  %-21s", io_channel_names[c]);
    fprintf(file, "\n");
    print_power(file, "specular", simulation, OFFSET(specular));
    print_power(file, "reflected unscattered", simulation, OFFSET(unscattered_reflected));
    print_power(file, "reflected", simulation, OFFSET(reflected));
    print_power(file, "transmitted unscattered", simulation, OFFSET(unscattered_transmitted));
    print_power(file, "transmitted", simulation, OFFSET(transmitted));
    for (size_t i = 0; i < simulation->material.layer_count; i++) {
        char name[64];
        snprintf(name, sizeof name, "absorbed in layer %zu", i + 1);
        print_power(file, name, simulation, OFFSET(absorbed) + i);
    }
    print_power(file, "lost", simulation, OFFSET(lost));
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct accuracy_simulation_channel *const at = &simulation->channels[c];
        fprintf(file, "\n%s: %10s %11s %23s\n   %10s %11s %23s\n", io_channel_names[c], "r from", "to",
                "Rd", "mm", "mm", "1/mm^2");
        for (size_t i = 0; i < ACCURACY_SIMULATION_RING_COUNT; i++)
            fprintf(file, "   %10.4g %11.4g %12.4g +- %-8.2g\n", at->edges_mm[i], at->edges_mm[i + 1],
                    at->rd_per_mm2[i], at->rd_error[i]);
    }
}
