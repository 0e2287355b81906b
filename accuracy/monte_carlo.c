/* What is asked of the Monte Carlo, light that has not scattered yet, and statistics. T76 to T78. */
#include "accuracy/monte_carlo.h"

#include "accuracy/monte_carlo_parts.h"
#include "lutgen/parallel.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

/* ---- what is asked -------------------------------------------------------------------------------- */

void accuracy_mc_stack_init(const dipole_layer *layers, size_t count, double g,
                            struct accuracy_mc_stack *out)
{
    *out = (struct accuracy_mc_stack){ .layer_count = count };
    for (size_t i = 0; i < count && i < DIPOLE_LAYER_LIMIT; i++)
        out->layers[i] =
            (struct accuracy_mc_layer){ .sigma_a_per_mm = layers[i].medium.sigma_a_per_mm,
                                        .sigma_s_per_mm = layers[i].medium.sigma_s_prime_per_mm / (1 - g),
                                        .g = g,
                                        .eta = layers[i].medium.eta,
                                        .thickness_mm = layers[i].thickness_mm };
}

static bool check_number(size_t layer, const char *name, double value, bool is_good, const char *expected,
                         dipole_status *status)
{
    return is_good || dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "layers[%zu].%s is %g, expected %s",
                                  layer, name, value, expected);
}

static bool is_coefficient(double value)
{
    return value == 0 || (value >= DIPOLE_SIGMA_MIN_PER_MM && value <= DIPOLE_SIGMA_MAX_PER_MM);
}

static bool check_layer(const struct accuracy_mc_layer *layer, size_t i, bool is_last,
                        dipole_status *status)
{
    const double d = layer->thickness_mm;
    const bool is_thickness =
        (d >= DIPOLE_THICKNESS_MIN_MM && d <= DIPOLE_THICKNESS_MAX_MM) || (is_last && isinf(d) && d > 0);
    return check_number(i, "sigma_a_per_mm", layer->sigma_a_per_mm, is_coefficient(layer->sigma_a_per_mm),
                        "0 or 1e-50 to 1e50", status) &&
           check_number(i, "sigma_s_per_mm", layer->sigma_s_per_mm, is_coefficient(layer->sigma_s_per_mm),
                        "0 or 1e-50 to 1e50", status) &&
           check_number(i, "g", layer->g, fabs(layer->g) < 1, "above -1 and below 1", status) &&
           check_number(i, "eta", layer->eta, layer->eta >= DIPOLE_ETA_MIN && layer->eta <= DIPOLE_ETA_MAX,
                        "0.1 to 10", status) &&
           check_number(i, "thickness_mm", d, is_thickness,
                        is_last ? "1e-50 to 1e50, or infinite" : "1e-50 to 1e50", status);
}

static bool check(const struct accuracy_mc_stack *stack, const struct accuracy_mc_run *run,
                  const struct accuracy_mc_rings *rings, dipole_status *status)
{
    if (stack->layer_count < 1 || stack->layer_count > DIPOLE_LAYER_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "layer_count is %zu, expected 1 to %d",
                           stack->layer_count, DIPOLE_LAYER_LIMIT);
    for (size_t i = 0; i < stack->layer_count; i++)
        if (!check_layer(&stack->layers[i], i, i + 1 == stack->layer_count, status))
            return false;
    if (run->photon_count < 1 || run->photon_count > 1000000000000)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "photon_count is %zu, expected 1 to 1e12",
                           run->photon_count);
    if (rings == NULL)
        return true;
    if (rings->count > ACCURACY_MC_RING_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "the number of rings is %zu, expected at most %d", rings->count,
                           ACCURACY_MC_RING_LIMIT);
    for (size_t i = 0; i <= rings->count && rings->count > 0; i++) {
        const double edge_mm = rings->edges_mm[i];
        if (!(edge_mm >= 0 && edge_mm < INFINITY && (i == 0 || edge_mm > rings->edges_mm[i - 1])))
            return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                               "edges_mm[%zu] is %g, expected >= 0 and above the one before", i, edge_mm);
    }
    return true;
}

/* ---- light that has not scattered (T76) ----------------------------------------------------------- */

/* Interface i is above layer i; at normal incidence. */
static double reflectance_above(const struct mc_walk *walk, int i)
{
    const double above = i > 0 ? walk->layers[i - 1].eta : 1;
    const double below = i < walk->layer_count ? walk->layers[i].eta : walk->eta_below;
    const double root = (below - above) / (below + above);
    return root * root;
}

/* Light goes up and down between interfaces: of what meets interface i from above, back[i] returns. */
static void follow_ballistic(struct mc_walk *walk)
{
    const int count = walk->layer_count;
    const bool is_endless = count > 0 && isinf(walk->layers[count - 1].thickness_mm);
    double back[DIPOLE_LAYER_LIMIT + 1], fade[DIPOLE_LAYER_LIMIT], met[DIPOLE_LAYER_LIMIT];
    back[count] = is_endless ? 0 : reflectance_above(walk, count);
    for (int i = count - 1; i >= 0; i--) {
        const struct mc_layer *const layer = &walk->layers[i];
        const double depth = layer->sigma_t_per_mm > 0 ? layer->sigma_t_per_mm * layer->thickness_mm : 0;
        const double rho = reflectance_above(walk, i);
        fade[i] = exp(-depth);
        met[i] = -expm1(-depth);
        const double returned = fade[i] * fade[i] * back[i + 1];
        back[i] = rho + (1 - rho) * (1 - rho) * returned / (1 - rho * returned);
    }
    double down = 1;
    walk->ballistic.specular = reflectance_above(walk, 0);
    if (count > 0) { /* back[0] without its first term */
        const double rho = walk->ballistic.specular, returned = fade[0] * fade[0] * back[1];
        walk->ballistic.unscattered_reflected = (1 - rho) * (1 - rho) * returned / (1 - rho * returned);
    }
    for (int i = 0; i < count; i++) {
        const struct mc_layer *const layer = &walk->layers[i];
        const double rho = reflectance_above(walk, i);
        down *= (1 - rho) / (1 - rho * fade[i] * fade[i] * back[i + 1]);
        const double ways[2] = { down, down * fade[i] * back[i + 1] };
        for (int is_upward = 0; is_upward < 2; is_upward++) {
            const double power = ways[is_upward] * met[i];
            walk->ballistic.absorbed[i] += power * layer->absorption;
            walk->scattered += power * layer->albedo;
            if (power * layer->albedo > 0)
                walk->sources[walk->source_count++] =
                    (struct mc_source){ i, is_upward == 1, walk->scattered };
        }
        down *= fade[i];
    }
    if (!is_endless)
        walk->ballistic.unscattered_transmitted = down * (1 - reflectance_above(walk, count));
    for (int i = 0; i < walk->source_count; i++)
        walk->sources[i].end /= walk->scattered;
}

/* ---- what the walk needs --------------------------------------------------------------------------- */

/* Levels of equal area under the exponential's density; the lowest holds its tail as well. */
static void init_ziggurat(struct mc_walk *walk)
{
    const double tail_start = 7.69711747013104972, area = 0.0039496598225815571993;
    walk->level[0] = area / exp(-tail_start);
    walk->level[1] = tail_start;
    for (int i = 2; i < ZIGGURAT_LEVELS; i++)
        walk->level[i] = -log(area / walk->level[i - 1] + exp(-walk->level[i - 1]));
    walk->level[ZIGGURAT_LEVELS] = 0;
    for (int i = 0; i <= ZIGGURAT_LEVELS; i++)
        walk->height[i] = exp(-walk->level[i]);
}

void mc_walk_init(const struct accuracy_mc_stack *stack, struct mc_walk *out)
{
    *out = (struct mc_walk){ .layer_count = (int)stack->layer_count, .eta_below = 1 };
    const struct accuracy_mc_layer *const last = &stack->layers[stack->layer_count - 1];
    if (isinf(last->thickness_mm) && last->sigma_a_per_mm + last->sigma_s_per_mm == 0) {
        out->layer_count--; /* is what lies below the others */
        out->eta_below = last->eta;
    }
    for (int i = 0; i < out->layer_count; i++) {
        const struct accuracy_mc_layer *const from = &stack->layers[i];
        const double sigma_t_per_mm = from->sigma_a_per_mm + from->sigma_s_per_mm;
        out->layers[i] = (struct mc_layer){ .sigma_a_per_mm = from->sigma_a_per_mm,
                                            .sigma_t_per_mm = sigma_t_per_mm,
                                            .g = from->g,
                                            .eta = from->eta,
                                            .thickness_mm = from->thickness_mm,
                                            .is_clear = from->sigma_s_per_mm == 0,
                                            .mean_free_path_mm = 1 / sigma_t_per_mm };
        if (sigma_t_per_mm > 0) {
            out->layers[i].absorption = from->sigma_a_per_mm / sigma_t_per_mm;
            out->layers[i].albedo = from->sigma_s_per_mm / sigma_t_per_mm;
        }
    }
    for (int i = 0; i < out->layer_count; i++) {
        struct mc_layer *const layer = &out->layers[i];
        const double above = i > 0 ? out->layers[i - 1].eta : 1;
        const double below = i + 1 < out->layer_count ? out->layers[i + 1].eta : out->eta_below;
        const double ratio = fmax(above, below) / layer->eta;
        if (ratio < 1 && layer->thickness_mm < INFINITY)
            layer->trapped_cosine2 = (1 - ratio) * (1 + ratio);
    }
    follow_ballistic(out);
    init_ziggurat(out);
}

/* ---- batches and statistics (T78) ------------------------------------------------------------------- */

enum { POWER_COUNT = sizeof(struct accuracy_mc_powers) / sizeof(double) };

/* What is counted stands in one row of numbers for each batch: the powers, then the rings. */
struct batches {
    struct mc_walk walk;
    size_t photons_per_batch, row_length;
    uint64_t seed;
    double *rows;
    double scatterings[ACCURACY_MC_BATCHES];
};

static void trace_batch(void *context, int index)
{
    struct batches *const batches = context;
    double *const row = batches->rows + (size_t)index * batches->row_length;
    struct accuracy_stream stream = accuracy_stream_of(batches->seed, (uint64_t)index);
    struct mc_tally tally = { (struct accuracy_mc_powers *)row, row + POWER_COUNT, 0 };
    mc_walk_batch(&batches->walk, batches->photons_per_batch, &stream, &tally);
    batches->scatterings[index] = tally.scatterings;
}

static void judge(const struct batches *batches, size_t column, double *mean, double *error)
{
    const double scale = batches->walk.scattered / (double)batches->photons_per_batch;
    accuracy_judge(batches->rows + column, ACCURACY_MC_BATCHES, batches->row_length, mean, error);
    *mean *= scale;
    *error *= scale;
}

static void gather(const struct batches *batches, const struct accuracy_mc_rings *rings,
                   struct accuracy_mc_result *result)
{
    *result =
        (struct accuracy_mc_result){ .photon_count = batches->photons_per_batch * ACCURACY_MC_BATCHES };
    for (size_t i = 0; i < POWER_COUNT; i++) {
        double *const mean = (double *)&result->mean + i;
        judge(batches, i, mean, (double *)&result->error + i);
        *mean += ((const double *)&batches->walk.ballistic)[i];
    }
    for (int i = 0; i < ACCURACY_MC_BATCHES; i++)
        result->scatterings += batches->scatterings[i];
    const size_t count = batches->walk.ring_count;
    for (size_t i = 0; i < count; i++) {
        const double lo_mm = rings->edges_mm[i], hi_mm = rings->edges_mm[i + 1];
        const double area_mm2 = PI * (hi_mm - lo_mm) * (hi_mm + lo_mm);
        judge(batches, POWER_COUNT + i, &rings->rd_per_mm2[i], &rings->rd_error[i]);
        judge(batches, POWER_COUNT + count + i, &rings->td_per_mm2[i], &rings->td_error[i]);
        rings->rd_per_mm2[i] /= area_mm2;
        rings->rd_error[i] /= area_mm2;
        rings->td_per_mm2[i] /= area_mm2;
        rings->td_error[i] /= area_mm2;
    }
}

bool accuracy_mc_trace(const struct accuracy_mc_stack *stack, const struct accuracy_mc_run *run,
                       const struct accuracy_mc_rings *rings, struct accuracy_mc_result *result,
                       dipole_status *status)
{
    if (!check(stack, run, rings, status))
        return false;
    const size_t ring_count = rings != NULL ? rings->count : 0, row_length = POWER_COUNT + 2 * ring_count;
    struct batches *const batches = malloc(sizeof *batches);
    double *const rows = calloc(ACCURACY_MC_BATCHES * row_length, sizeof *rows);
    const bool has_memory = batches != NULL && rows != NULL;
    if (has_memory) {
        *batches = (struct batches){ .photons_per_batch = (run->photon_count + ACCURACY_MC_BATCHES - 1) /
                                                          ACCURACY_MC_BATCHES,
                                     .row_length = row_length,
                                     .seed = run->seed,
                                     .rows = rows };
        mc_walk_init(stack, &batches->walk);
        batches->walk.ring_count = ring_count;
        for (size_t i = 0; i <= ring_count && ring_count > 0; i++)
            batches->walk.edges2_mm2[i] = rings->edges_mm[i] * rings->edges_mm[i];
        if (batches->walk.scattered > 0)
            lut_parallel_for(ACCURACY_MC_BATCHES, run->thread_count, trace_batch, batches);
        gather(batches, rings, result);
    }
    free(rows);
    free(batches);
    return has_memory || dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory for a Monte Carlo");
}
