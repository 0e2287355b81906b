/*
 * Every model against the independent reference (tests/reference), and what an evaluation costs.
 * usage: bench_models REFERENCE [PLOT.svg]; prints Markdown.
 */
#include "cli/cli.h"
#include "io/file.h"
#include "libdipole/dipole.h"
#include "plot/plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* ---- what is compared ----------------------------------------------------------------------------- */

static const struct model {
    const char *name;
    dipole_model model;
    dipole_fdr_kind fdr_kind;
    bool is_multiple_only; /* compared with light that was scattered more than once                    */
    bool is_variant;       /* not drawn, not timed       */
    const char *refusal;   /* why it cannot do some stacks; NULL where it can do all                    */
} models[] = {
    { "dipole", DIPOLE_MODEL_DIPOLE, DIPOLE_FDR_EXACT, false, false, "half-space only" },
    { "dipole, polynomial Fdr", DIPOLE_MODEL_DIPOLE, DIPOLE_FDR_POLYNOMIAL, false, true,
      "half-space only" },
    { "better dipole", DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_FDR_EXACT, false, false, "half-space only" },
    { "the same, of R − R1", DIPOLE_MODEL_BETTER_DIPOLE, DIPOLE_FDR_EXACT, true, true, "half-space only" },
    { "multipole", DIPOLE_MODEL_MULTIPOLE, DIPOLE_FDR_EXACT, false, false,
      "its source would leave a layer" },
    { "beam", DIPOLE_MODEL_BEAM, DIPOLE_FDR_EXACT, false, false, NULL },
    { "modes", DIPOLE_MODEL_MODES, DIPOLE_FDR_EXACT, false, false, NULL },
};

enum { RADIUS_COUNT = 5, BIN_LIMIT = 1000, CASE_LIMIT = 32, SLAB_LIMIT = 256 };

/* Rings of the comparison, in mean free paths. */
static const double ring_middle[RADIUS_COUNT] = { 0.5, 1.0, 2.0, 5.0, 10.0 };
static const double ring_half_width[RADIUS_COUNT] = { 0.1, 0.1, 0.1, 0.25, 0.5 };

/* A ring of Monte Carlo, per mm^2 and per light that entered; of R1 the light that was scattered once. */
struct bin {
    double lo_mm, hi_mm, r, r_sem, r1;
};

struct monte_carlo {
    char name[64], layers_text[512];
    dipole_layer layers[DIPOLE_LAYER_LIMIT];
    size_t layer_count;
    double mean_free_path_mm; /* the one that the rings are counted in */
    struct bin bins[BIN_LIMIT];
    size_t bin_count;
    struct bin rings[RADIUS_COUNT];
    double r, r_sem, r1, t, t_sem; /* per light that entered, unscattered light included */
};

/* A slab by adding and doubling, likewise. */
struct slab {
    double alpha_prime, tau_prime, g, eta, r, t, error;
    dipole_layer layer;
};

static struct monte_carlo cases[CASE_LIMIT];
static struct slab slabs[SLAB_LIMIT];
static size_t case_count, slab_count;

/* ---- the reference -------------------------------------------------------------------------------- */

/* The next line that is no comment. */
static bool next_line(FILE *file, char *line, size_t size)
{
    while (fgets(line, (int)size, file))
        if (line[0] != '#')
            return true;
    return false;
}

static FILE *open_table(const char *folder, const char *name)
{
    char path[4096], header[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *const file = fopen(path, "r");
    if (!file || !next_line(file, header, sizeof header)) {
        fprintf(stderr, "bench_models: cannot read %s\n", path);
        exit(EXIT_FAILED);
    }
    return file;
}

/* "n=1.4 sigma_a=0.2 sigma_s=2 g=0 d_mm=0.5; n=..." */
static size_t parse_layers(const char *text, dipole_layer *layers)
{
    size_t count = 0;
    for (const char *p = text; p && count < DIPOLE_LAYER_LIMIT; p = strchr(p, ';')) {
        double n, sigma_a, sigma_s, g, thickness_mm;
        p += strspn(p, "; ");
        if (sscanf(p, "n=%lf sigma_a=%lf sigma_s=%lf g=%lf d_mm=%lf", &n, &sigma_a, &sigma_s, &g,
                   &thickness_mm) != 5)
            return 0;
        layers[count++] =
            (dipole_layer){ { sigma_a, sigma_s * (1.0 - g), n, DIPOLE_FDR_EXACT }, thickness_mm };
    }
    return count;
}

/* Monte Carlo between two radii, in mean free paths: the bins that lie there, as one ring. */
static struct bin ring_between(const struct monte_carlo *mc, double lo, double hi)
{
    struct bin ring = { .lo_mm = INFINITY };
    const double slack = 1e-3;
    for (size_t i = 0; i < mc->bin_count; i++) {
        const struct bin *const b = &mc->bins[i];
        if (b->lo_mm < (lo - slack) * mc->mean_free_path_mm ||
            b->hi_mm > (hi + slack) * mc->mean_free_path_mm)
            continue;
        const double area = b->hi_mm * b->hi_mm - b->lo_mm * b->lo_mm;
        ring.r += area * b->r;
        ring.r1 += area * b->r1;
        ring.r_sem = hypot(ring.r_sem, area * b->r_sem);
        ring.lo_mm = fmin(ring.lo_mm, b->lo_mm);
        ring.hi_mm = fmax(ring.hi_mm, b->hi_mm);
    }
    const double area = ring.hi_mm * ring.hi_mm - ring.lo_mm * ring.lo_mm;
    ring.r /= area;
    ring.r1 /= area;
    ring.r_sem /= area;
    return ring;
}

static void read_bins(const char *folder, double entered, struct monte_carlo *mc)
{
    char name[128], line[4096];
    struct bin b;
    snprintf(name, sizeof name, "mcml/%s.csv", mc->name);
    FILE *const file = open_table(folder, name);
    while (mc->bin_count < BIN_LIMIT && next_line(file, line, sizeof line) &&
           sscanf(line, "%lf,%lf,%lf,%lf,%lf", &b.lo_mm, &b.hi_mm, &b.r, &b.r_sem, &b.r1) == 5) {
        b.r /= entered;
        b.r_sem /= entered;
        b.r1 /= entered;
        mc->bins[mc->bin_count++] = b;
    }
    fclose(file);
    mc->mean_free_path_mm = 20.0 * mc->bins[0].hi_mm; /* the first bin is a twentieth of it wide */
    for (int i = 0; i < RADIUS_COUNT; i++)
        mc->rings[i] =
            ring_between(mc, ring_middle[i] - ring_half_width[i], ring_middle[i] + ring_half_width[i]);
}

static void read_monte_carlo(const char *folder)
{
    char line[4096];
    FILE *const file = open_table(folder, "mcml_totals.csv");
    while (case_count < CASE_LIMIT && next_line(file, line, sizeof line)) {
        struct monte_carlo *const mc = &cases[case_count++];
        double specular, r, r0, t, t0;
        if (sscanf(line, "%63[^,],\"%511[^\"]\",%*d,%*d,%*d,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", mc->name,
                   mc->layers_text, &specular, &r, &mc->r_sem, &r0, &mc->r1, &t, &mc->t_sem, &t0) != 10 ||
            (mc->layer_count = parse_layers(mc->layers_text, mc->layers)) == 0) {
            fprintf(stderr, "bench_models: mcml_totals.csv: %s", line);
            exit(EXIT_FAILED);
        }
        const double entered = 1.0 - specular;
        mc->r = (r + r0) / entered;
        mc->t = (t + t0) / entered;
        mc->r1 /= entered;
        mc->r_sem /= entered;
        mc->t_sem /= entered;
        if (strncmp(mc->name, "val_", 4) != 0) /* of those only totals are known */
            read_bins(folder, entered, mc);
    }
    fclose(file);
}

static void read_adding_doubling(const char *folder)
{
    char line[4096];
    FILE *const file = open_table(folder, "adding_doubling.csv");
    double albedo, g, eta, tau, r, t, error;
    while (slab_count < SLAB_LIMIT && next_line(file, line, sizeof line) &&
           sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%*f,%*f,%*f,%*f,%*d,%lf", &albedo, &g, &eta, &tau, &r, &t,
                  &error) == 7) {
        const double sigma_s_prime = albedo * (1.0 - g), sigma_a = 1.0 - albedo; /* of sigma_t = 1/mm */
        const double specular = dipole_fresnel_reflectance(eta, 1.0), entered = 1.0 - specular;
        slabs[slab_count++] = (struct slab){
            .alpha_prime = sigma_s_prime / (sigma_s_prime + sigma_a),
            .tau_prime = tau * (sigma_s_prime + sigma_a),
            .g = g,
            .eta = eta,
            .r = (r - specular) / entered,
            .t = t / entered,
            .error = error / entered,
            .layer = { { sigma_a, sigma_s_prime, eta, DIPOLE_FDR_EXACT }, tau },
        };
    }
    fclose(file);
}

/* ---- models --------------------------------------------------------------------------------------- */

/* NULL where the model says that it cannot do these layers; anything else ends the program. */
static dipole_stack *stack_of(const struct model *model, const dipole_layer *layers, size_t count)
{
    dipole_layer own[DIPOLE_LAYER_LIMIT];
    dipole_stack *stack;
    dipole_status status;
    memcpy(own, layers, count * sizeof *layers);
    for (size_t i = 0; i < count; i++)
        own[i].medium.fdr_kind = model->fdr_kind;
    if (dipole_stack_create(own, count, model->model, DIPOLE_FROM_ABOVE, &stack, &status))
        return stack;
    if (status.code != DIPOLE_NOT_SUPPORTED) {
        fprintf(stderr, "bench_models: %s: %s\n", model->name, status.message);
        exit(EXIT_FAILED);
    }
    return NULL;
}

/* All that leaves by a face, scattered or not. */
static double leaving(const dipole_stack *stack, dipole_face face)
{
    return dipole_stack_total(stack, face) + dipole_stack_unscattered(stack, face);
}

static double percent(double found, double expected)
{
    return 100.0 * (found / expected - 1.0);
}

static double ring_error(const struct bin *ring, const struct model *model, const dipole_stack *stack)
{
    return percent(dipole_stack_ring_mean_per_mm2(stack, DIPOLE_FACE_LIT, ring->lo_mm, ring->hi_mm),
                   ring->r - (model->is_multiple_only ? ring->r1 : 0.0));
}

/* ---- tables of Monte Carlo ------------------------------------------------------------------------ */

/* In percent of Monte Carlo. */
struct errors {
    bool is_known, has_rings, has_t;
    double rings[RADIUS_COUNT], r, t;
};

static struct errors errors_of(const struct monte_carlo *mc, const struct model *model)
{
    dipole_stack *const stack = stack_of(model, mc->layers, mc->layer_count);
    struct errors errors = { .is_known = stack != NULL,
                             .has_rings = mc->bin_count > 0,
                             .has_t = mc->t > 0.0 };
    if (!stack)
        return errors;
    for (int i = 0; i < RADIUS_COUNT && errors.has_rings; i++)
        errors.rings[i] = ring_error(&mc->rings[i], model, stack);
    errors.r = percent(leaving(stack, DIPOLE_FACE_LIT), mc->r - (model->is_multiple_only ? mc->r1 : 0.0));
    if (errors.has_t)
        errors.t = percent(leaving(stack, DIPOLE_FACE_FAR), mc->t);
    dipole_stack_destroy(stack);
    return errors;
}

/* Signed, and with a digit more where it is small. */
static void print_error(double error)
{
    if (fabs(error) < 0.05)
        printf(" 0 |");
    else if (fabs(error) < 9.95)
        printf(" %+.1f |", error);
    else
        printf(" %+.0f |", error);
}

static void print_model(const struct monte_carlo *mc, const struct model *model)
{
    const struct errors errors = errors_of(mc, model);
    printf("| %s |", model->name);
    if (!errors.is_known) {
        printf(" *%s* | | | | | | |\n", model->refusal);
        return;
    }
    for (int i = 0; i < RADIUS_COUNT; i++)
        if (errors.has_rings)
            print_error(errors.rings[i]);
        else
            printf(" |");
    print_error(errors.r);
    if (errors.has_t)
        print_error(errors.t);
    else
        printf(" |");
    printf("\n");
}

/* How sure Monte Carlo is, and how much of its light was scattered once. */
static void print_monte_carlo(const struct monte_carlo *mc)
{
    printf("| *standard error of Monte Carlo* |");
    for (int i = 0; i < RADIUS_COUNT; i++)
        printf(mc->bin_count > 0 ? " *%.1f* |" : " |", 100.0 * mc->rings[i].r_sem / mc->rings[i].r);
    printf(" *%.2f* |", 100.0 * mc->r_sem / mc->r);
    printf(mc->t > 0.0 ? " *%.2f* |\n" : " |\n", 100.0 * mc->t_sem / mc->t);
    printf("| *of its light scattered once* |");
    for (int i = 0; i < RADIUS_COUNT; i++)
        printf(mc->bin_count > 0 ? " *%.1f* |" : " |", 100.0 * mc->rings[i].r1 / mc->rings[i].r);
    printf(" *%.1f* | |\n", 100.0 * mc->r1 / mc->r);
}

static void print_cases(void)
{
    for (size_t i = 0; i < case_count; i++) {
        printf("\n**%s**: %s\n\n| model | 0.5 ℓ | 1 ℓ | 2 ℓ | 5 ℓ | 10 ℓ | R | T |\n"
               "|---|---|---|---|---|---|---|---|\n",
               cases[i].name, cases[i].layers_text);
        for (size_t m = 0; m < COUNT(models); m++)
            print_model(&cases[i], &models[m]);
        print_monte_carlo(&cases[i]);
    }
}

/* What all errors of a kind come to. */
struct summary {
    double sum, worst;
    int count;
};

static void summary_add(struct summary *summary, double error)
{
    summary->sum += fabs(error);
    summary->count++;
    if (fabs(error) > fabs(summary->worst))
        summary->worst = error;
}

static void print_summary(const struct summary *summary)
{
    if (summary->count == 0) {
        printf(" |");
        return;
    }
    printf(" %.1f;", summary->sum / summary->count);
    print_error(summary->worst);
}

static const char *const group_names[] = { "half-spaces, α' > 0.9", "half-spaces, α' < 0.9", "slabs",
                                           "stacks of layers" };

static size_t group_of(const struct monte_carlo *mc)
{
    const dipole_medium *const medium = &mc->layers[0].medium;
    if (mc->layer_count > 1)
        return 3;
    if (isfinite(mc->layers[0].thickness_mm))
        return 2;
    return medium->sigma_s_prime_per_mm < 9.0 * medium->sigma_a_per_mm;
}

/* Cases of which only totals are known are left out. */
static void print_group(size_t group, const struct model *model)
{
    struct summary near = { 0 }, far = { 0 }, total = { 0 };
    for (size_t i = 0; i < case_count; i++) {
        const struct errors errors = errors_of(&cases[i], model);
        if (group_of(&cases[i]) != group || !errors.is_known || !errors.has_rings)
            continue;
        for (int k = 0; k < RADIUS_COUNT; k++)
            summary_add(ring_middle[k] <= 2.0 ? &near : &far, errors.rings[k]);
        summary_add(&total, errors.r);
        if (errors.has_t)
            summary_add(&total, errors.t);
    }
    if (total.count == 0)
        return;
    printf("| %s |", model->name);
    print_summary(&near);
    print_summary(&far);
    print_summary(&total);
    printf("\n");
}

static void print_groups(void)
{
    for (size_t group = 0; group < COUNT(group_names); group++) {
        printf("\n| %s | rings at 0.5, 1, 2 ℓ | at 5, 10 ℓ | totals R and T |\n|---|---|---|---|\n",
               group_names[group]);
        for (size_t m = 0; m < COUNT(models); m++)
            print_group(group, &models[m]);
    }
}

/* ---- tables of adding and doubling ---------------------------------------------------------------- */

/* Is it known to half a percent? */
static bool is_known(double part, double error)
{
    return part > 0.0 && error < 0.005 * part;
}

enum extent { HALF_SPACE = 0, THICK, THIN };

static enum extent extent_of(const struct slab *slab)
{
    return isinf(slab->tau_prime) ? HALF_SPACE : slab->tau_prime > 0.999 ? THICK : THIN;
}

static void print_slab_summary(const char *title, enum extent extent, bool is_low_albedo)
{
    printf("\n| %s | g = 0: R | T | g = 0.8: R | T |\n|---|---|---|---|---|\n", title);
    for (size_t m = 0; m < COUNT(models); m++) {
        struct summary parts[4] = { 0 };
        if (models[m].is_multiple_only) /* what scattered once is not in these tables */
            continue;
        for (size_t i = 0; i < slab_count; i++) {
            const struct slab *const s = &slabs[i];
            if (extent_of(s) != extent || (s->alpha_prime < 0.8999) != is_low_albedo)
                continue;
            dipole_stack *const stack = stack_of(&models[m], &s->layer, 1);
            const int first = s->g > 0.0 ? 2 : 0;
            if (stack && is_known(s->r, s->error))
                summary_add(&parts[first], percent(leaving(stack, DIPOLE_FACE_LIT), s->r));
            if (stack && is_known(s->t, s->error))
                summary_add(&parts[first + 1], percent(leaving(stack, DIPOLE_FACE_FAR), s->t));
            dipole_stack_destroy(stack);
        }
        if (parts[0].count + parts[2].count == 0)
            continue;
        printf("| %s |", models[m].name);
        for (int i = 0; i < 4; i++)
            print_summary(&parts[i]);
        printf("\n");
    }
}

static void print_slabs(bool wants_half_space)
{
    printf("\n| α' | g | n | thickness/ℓ |");
    for (size_t m = 0; m < COUNT(models); m++)
        if (!models[m].is_multiple_only && (wants_half_space || models[m].model >= DIPOLE_MODEL_MULTIPOLE))
            printf(wants_half_space ? " %s R |" : " %s R | T |", models[m].name);
    printf("\n|---|---|---|---|");
    for (size_t m = 0; m < COUNT(models); m++)
        if (!models[m].is_multiple_only && (wants_half_space || models[m].model >= DIPOLE_MODEL_MULTIPOLE))
            printf(wants_half_space ? "---|" : "---|---|");
    printf("\n");
    for (size_t i = 0; i < slab_count; i++) {
        const struct slab *const s = &slabs[i];
        if ((extent_of(s) == HALF_SPACE) != wants_half_space)
            continue;
        printf("| %.4g | %.4g | %.4g | ", s->alpha_prime, s->g, s->eta);
        printf(wants_half_space ? "∞ |" : "%.3g |", s->tau_prime);
        for (size_t m = 0; m < COUNT(models); m++) {
            if (models[m].is_multiple_only ||
                (!wants_half_space && models[m].model < DIPOLE_MODEL_MULTIPOLE))
                continue;
            dipole_stack *const stack = stack_of(&models[m], &s->layer, 1);
            const double parts[2] = { s->r, s->t };
            for (int face = 0; face < (wants_half_space ? 1 : 2); face++)
                if (stack && is_known(parts[face], s->error))
                    print_error(percent(leaving(stack, (dipole_face)face), parts[face]));
                else
                    printf(stack ? " ? |" : " – |");
            dipole_stack_destroy(stack);
        }
        printf("\n");
    }
}

/* ---- time ----------------------------------------------------------------------------------------- */

enum { BATCH = 1024, SINGLES = 128, ROUND_COUNT = 41 };

struct times {
    double create_us, batch_ns, single_ns;
};

/* Infinite where the model cannot do the case. */
static struct times measure(const struct model *model, const struct monte_carlo *mc, const double *r_mm)
{
    static double values[BATCH];
    struct times times;
    double start_s = cli_now_s();
    dipole_stack *const stack = stack_of(model, mc->layers, mc->layer_count);
    times.create_us = 1e6 * (cli_now_s() - start_s);
    if (!stack)
        return (struct times){ INFINITY, INFINITY, INFINITY };
    start_s = cli_now_s();
    dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, r_mm, BATCH, values);
    times.batch_ns = 1e9 * (cli_now_s() - start_s) / BATCH;
    start_s = cli_now_s();
    for (size_t i = 0; i < BATCH; i += BATCH / SINGLES)
        dipole_stack_profile_per_mm2(stack, DIPOLE_FACE_LIT, &r_mm[i], 1, &values[i]);
    times.single_ns = 1e9 * (cli_now_s() - start_s) / SINGLES;
    dipole_stack_destroy(stack);
    return times;
}

/* Shortest of all rounds; the models take turns. */
static void print_times(const char *name)
{
    struct times shortest[COUNT(models)];
    const struct monte_carlo *mc = cases;
    while (strcmp(mc->name, name) != 0)
        mc++;
    double r_mm[BATCH];
    for (int i = 0; i < BATCH; i++)
        r_mm[i] = mc->mean_free_path_mm * 0.05 * pow(400.0, (double)i / BATCH);
    for (int i = 0; i < ROUND_COUNT; i++)
        for (size_t m = 0; m < COUNT(models); m++) {
            if (models[m].is_variant)
                continue;
            const struct times t = measure(&models[m], mc, r_mm);
            struct times *const s = &shortest[m];
            *s = i == 0 ? t
                        : (struct times){ fmin(s->create_us, t.create_us), fmin(s->batch_ns, t.batch_ns),
                                          fmin(s->single_ns, t.single_ns) };
        }
    for (size_t m = 0; m < COUNT(models); m++)
        if (!models[m].is_variant && shortest[m].create_us < INFINITY)
            printf("| %s | %s | %.0f | %.0f | %.0f |\n", name, models[m].name, shortest[m].create_us,
                   shortest[m].batch_ns, shortest[m].single_ns);
}

/* ---- picture -------------------------------------------------------------------------------------- */

enum { PLOT_RINGS = 40 };

/* The error of each model over the radius: rings a sixth as wide as their radius. */
static bool draw(const char *path, const char *name, dipole_status *status)
{
    static double x[PLOT_RINGS], y[COUNT(models)][PLOT_RINGS], low[PLOT_RINGS], high[PLOT_RINGS];
    struct plot_series series[COUNT(models) + 1];
    size_t series_count = 0, ring_count = 0, dash = 0;
    const struct monte_carlo *mc = cases;
    while (strcmp(mc->name, name) != 0)
        mc++;
    double edges[PLOT_RINGS + 1] = { 0.1 };
    while (ring_count < PLOT_RINGS && edges[ring_count] < 12.0) {
        const double width = fmax(0.1, 0.15 * edges[ring_count]);
        edges[ring_count + 1] = 0.05 * floor(20.0 * (edges[ring_count] + width) + 0.5);
        ring_count++;
    }
    for (size_t m = 0; m < COUNT(models); m++) {
        if (models[m].is_variant || models[m].model == DIPOLE_MODEL_MULTIPOLE) /* here the dipole */
            continue;
        dipole_stack *const stack = stack_of(&models[m], mc->layers, mc->layer_count);
        for (size_t i = 0; i < ring_count; i++) {
            const struct bin ring = ring_between(mc, edges[i], edges[i + 1]);
            const double noise = 100.0 * ring.r_sem / ring.r;
            x[i] = sqrt(0.5 * (edges[i] * edges[i] + edges[i + 1] * edges[i + 1]));
            y[m][i] = ring_error(&ring, &models[m], stack);
            low[i] = -2.0 * noise;
            high[i] = 2.0 * noise;
        }
        dipole_stack_destroy(stack);
        series[series_count++] = (struct plot_series){ .label = models[m].name,
                                                       .count = ring_count,
                                                       .x = x,
                                                       .y = y[m],
                                                       .dash = (enum plot_dash)(dash++ % 4) };
    }
    series[series_count++] = (struct plot_series){ .kind = PLOT_BAND,
                                                   .label = "Monte Carlo ± 2 standard errors",
                                                   .count = ring_count,
                                                   .x = x,
                                                   .y_low = low,
                                                   .y_high = high,
                                                   .color = PLOT_GREY };
    const struct plot_marker zero = { .is_horizontal = true };
    const struct plot plot = { .title = "Models against Monte Carlo: skin1, red",
                               .subtitle = "σa 0.032 /mm, σ′s 0.74 /mm, g = 0, η 1.3; means over rings",
                               .x = { .title = "distance r from where the light entered, mean free paths ℓ",
                                      .scale = PLOT_LOG },
                               .y = { .title = "error of the profile, %" },
                               .series = series,
                               .series_count = series_count,
                               .markers = &zero,
                               .marker_count = 1 };
    char *svg = NULL;
    size_t size;
    const bool is_done =
        plot_svg_create(&plot, &svg, &size, status) && io_file_write(path, svg, size, status);
    free(svg);
    return is_done;
}

/* ---- the page ------------------------------------------------------------------------------------- */

int main(int argc, char **argv)
{
    dipole_status status;
    if (argc < 2 || argc > 3) {
        fprintf(stderr, "usage: bench_models REFERENCE [PLOT.svg]\n");
        return EXIT_USAGE;
    }
    read_monte_carlo(argv[1]);
    read_adding_doubling(argv[1]);
    if (argc == 3 && !draw(argv[2], "semi_skin1R_n13", &status)) {
        fprintf(stderr, "bench_models: %s\n", status.message);
        return EXIT_FAILED;
    }
    printf("### Time\n\n"
           "| case | model | create, µs | ns per radius, 1024 in a call | ns per call of one radius |\n"
           "|---|---|---|---|---|\n");
    print_times("semi_hialb_n15");
    print_times("slab_hialb_n15_20mfp");
    print_times("layer3_skinR");
    printf("\n### Monte Carlo, in short\n\nMean of the absolute errors; the largest error, in %%.\n");
    print_groups();
    printf("\n### Adding and doubling, in short\n\nMean of the absolute errors; the largest error, in "
           "%%.\n");
    print_slab_summary("half-space, α' ≥ 0.9", HALF_SPACE, false);
    print_slab_summary("half-space, α' < 0.9", HALF_SPACE, true);
    print_slab_summary("slab of ≥ 1 ℓ, α' ≥ 0.9", THICK, false);
    print_slab_summary("slab of ≥ 1 ℓ, α' < 0.9", THICK, true);
    print_slab_summary("slab of < 1 ℓ, α' ≥ 0.9", THIN, false);
    print_slab_summary("slab of < 1 ℓ, α' < 0.9", THIN, true);
    printf("\n### Monte Carlo, case by case\n");
    print_cases();
    printf("\n### Adding and doubling, case by case\n");
    print_slabs(true);
    print_slabs(false);
    return EXIT_DONE;
}
