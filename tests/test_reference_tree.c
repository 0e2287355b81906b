/* renderer/reference_tree.h and reference_profile.h: all pairs, the library's own profiles, closed forms.
 */
#include "check.h"

#include "renderer/reference_tree.h"

#include <stdlib.h>

static const double PI = 3.14159265358979323846;

/* ---- what the tests share ----------------------------------------------------------------------- */

/* Half-spaces and layers, ordinary and hard; lengths in mm. */
static const struct {
    const char *name;
    double sigma_a_per_mm, sigma_s_prime_per_mm;
    double top_mm; /* 0: a half-space; else a layer on one that absorbs more */
} media_list[] = {
    { "ordinary", 0.03, 1, 0 },   { "no absorption", 0, 2, 0 },     { "murky", 1, 1, 0 },
    { "short paths", 2, 60, 0 },  { "long paths", 1e-4, 0.003, 0 }, { "nearly black", 3, 0.03, 0 },
    { "layered", 0.02, 1.5, 1.2 }
};
enum { MEDIA = sizeof media_list / sizeof *media_list };

static struct io_material material_of(int number, dipole_model model)
{
    struct io_material material = { .name = "test", .model = model, .layer_count = 1 };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const double factor = 1 + 0.5 * c;
        dipole_layer *const layers = material.layers[c];
        layers[0] = (dipole_layer){ { .sigma_a_per_mm = media_list[number].sigma_a_per_mm * factor,
                                      .sigma_s_prime_per_mm = media_list[number].sigma_s_prime_per_mm,
                                      .eta = 1.4 },
                                    INFINITY };
        if (media_list[number].top_mm > 0) {
            layers[1] = layers[0];
            layers[1].medium.sigma_a_per_mm *= 10;
            layers[0].thickness_mm = media_list[number].top_mm;
            material.layer_count = 2;
        }
    }
    return material;
}

/* A medium of its own; false where the model has no such thing. */
static bool medium_init(int number, dipole_model model, struct io_material *material,
                        struct render_medium *medium)
{
    *material = material_of(number, model);
    *medium = (struct render_medium){ .material = material, .eta = 1.4 };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!dipole_stack_create(material->layers[c], material->layer_count, model, DIPOLE_FROM_ABOVE,
                                 &medium->stacks[c], NULL))
            return false;
        medium->diffuse_reflectance[c] = dipole_stack_total(medium->stacks[c], DIPOLE_FACE_LIT);
        medium->has_scattering |= medium->diffuse_reflectance[c] > 0;
    }
    return true;
}

static void medium_end(struct render_medium *medium)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        dipole_stack_destroy(medium->stacks[c]);
}

static struct render_profile *profile_of(const struct render_medium *medium, double far_mm, double core_mm)
{
    struct render_profile *profile;
    assert_true(render_profile_create(medium, far_mm, core_mm, &profile, NULL));
    render_profile_set_core(profile, medium, core_mm);
    return profile;
}

static double library(const struct render_medium *medium, int channel, double r_mm)
{
    double value;
    dipole_stack_profile_per_mm2(medium->stacks[channel], DIPOLE_FACE_LIT, &r_mm, 1, &value);
    return value;
}

/* Over all media that the models know. */
#define FOR_EACH_MEDIUM                                                                                    \
    for (int number = 0; number < MEDIA; number++)                                                         \
        for (dipole_model model = DIPOLE_MODEL_DIPOLE; model <= DIPOLE_MODEL_MODES; model++)

/* ---- profiles ----------------------------------------------------------------------------------- */

/* Oracle: the library. The table is made to 1e-7; underflow and what is noise far out is left aside. */
static void tables_equal_the_library(void **state)
{
    (void)state;
    struct rng rng = { .seed = 1 };
    double worst = 0;
    FOR_EACH_MEDIUM
    {
        struct io_material material;
        struct render_medium medium;
        if (medium_init(number, model, &material, &medium)) {
            struct render_profile *const profile = profile_of(&medium, 50, 1e-3);
            const bool is_cut_off = number == 5 && model == DIPOLE_MODEL_MODES; /* at 0, with kinks; T29 */
            if (profile->max_error > 1e-7 && !is_cut_off)
                fail_msg("%s, model %d: %g", media_list[number].name, (int)model, profile->max_error);
            for (int i = 0; i < 300; i++) {
                const double r_mm = log_uniform(&rng, 1e-3, 50);
                render_lanes value;
                render_profile_at(profile, r_mm * r_mm, &value);
                for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
                    const double expected = library(&medium, c, r_mm);
                    const double error = fabs(value[c] - expected) - profile->noise[c] - 1e-240;
                    if (error > 5e-7 * expected && !is_cut_off)
                        fail_msg("%s, model %d, channel %d, %g mm: %g for %g", media_list[number].name,
                                 (int)model, c, r_mm, value[c], expected);
                    if (error > 0 && !is_cut_off)
                        worst = fmax(worst, error / expected);
                }
            }
            render_profile_destroy(profile);
        }
        medium_end(&medium);
    }
    print_message("  largest relative error %.2g\n", worst);
}

/* Oracle: the power within a disc, in closed form by the library; and continuity. */
static void cores_keep_the_power(void **state)
{
    (void)state;
    FOR_EACH_MEDIUM
    {
        struct io_material material;
        struct render_medium medium;
        if (medium_init(number, model, &material, &medium)) {
            for (double core_mm = 1e-3; core_mm < 2; core_mm *= 10) {
                struct render_profile *const profile = profile_of(&medium, 50, core_mm);
                const double s = profile->core_mm2;
                assert_int_equal(s > 0, model == DIPOLE_MODEL_BEAM || model == DIPOLE_MODEL_MODES);
                for (int c = 0; c < IO_CHANNEL_COUNT && s > 0; c++) {
                    const double power = PI * s *
                                         (profile->core[0][c] + s / 2 * profile->core[1][c] +
                                          s * s / 3 * profile->core[2][c]);
                    const double at_edge =
                        profile->core[0][c] + s * (profile->core[1][c] + s * profile->core[2][c]);
                    assert_close(power, dipole_stack_within(medium.stacks[c], DIPOLE_FACE_LIT, core_mm),
                                 1e-9, "%s, model %d, core %g mm", media_list[number].name, (int)model,
                                 core_mm);
                    assert_true(fabs(at_edge - library(&medium, c, core_mm)) <
                                1e-6 * library(&medium, c, core_mm) + 1e-13 * profile->core[0][c]);
                }
                render_profile_destroy(profile);
            }
        }
        medium_end(&medium);
    }
}

/* Taylor's series that the tree uses, for one point at d from the centre: up to third powers of d. */
static double taylor(const struct render_profile *profile, int channel, const double v[3],
                     const double d[3])
{
    double along = 0, d2 = 0, s = 0, u;
    for (int k = 0; k < 3; k++) {
        along += v[k] * d[k];
        d2 += d[k] * d[k];
        s += v[k] * v[k];
    }
    const render_lanes *const terms = render_profile_find(profile, s, &u)->terms;
    double f[4];
    for (int order = 0; order < 4; order++) {
        f[order] = 0;
        for (int k = RENDER_PROFILE_TERMS - 1; k >= order; k--)
            f[order] = f[order] * u + tgamma(k + 1) / tgamma(k - order + 1) * terms[k][channel];
    }
    return f[0] + f[1] * (d2 - 2 * along) + f[2] * 2 * (along * along - along * d2) -
           f[3] * 4 / 3 * along * along * along;
}

/* Oracle: the profile itself. What Taylor's series leaves out is no more than the bound says, in any
 * direction and for any extent; beside it the table's error and rounding. */
static void bounds_hold(void **state)
{
    (void)state;
    struct rng rng = { .seed = 2 };
    double closest = 0;
    FOR_EACH_MEDIUM
    {
        struct io_material material;
        struct render_medium medium;
        if (medium_init(number, model, &material, &medium)) {
            struct render_profile *const profile = profile_of(&medium, 50, 1e-3);
            for (int i = 0; i < 400; i++) {
                const double away_mm = log_uniform(&rng, 1e-2, 25);
                const double extent_mm = away_mm * log_uniform(&rng, 1e-3, model < 3 ? 1.9 : 0.9);
                double v[3], d[3], v2 = 0, d2 = 0, r2 = 0, u;
                for (int k = 0; k < 3; k++) {
                    v[k] = uniform(&rng, -1, 1);
                    d[k] = uniform(&rng, -1, 1);
                    v2 += v[k] * v[k];
                    d2 += d[k] * d[k];
                }
                for (int k = 0; k < 3; k++) {
                    v[k] *= away_mm / sqrt(v2);
                    d[k] *= extent_mm / sqrt(d2);
                    r2 += (v[k] - d[k]) * (v[k] - d[k]);
                }
                const double near_mm = fmax(away_mm - extent_mm, 0), fourth = pow(extent_mm, 4);
                const render_lanes bound =
                    render_profile_find(profile, near_mm * near_mm, &u)->bound * fourth / 24;
                for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
                    const double exact = library(&medium, c, sqrt(r2));
                    const double error = fabs(taylor(profile, c, v, d) - exact);
                    const double least = 1e-6 * (exact + library(&medium, c, away_mm)) + profile->noise[c];
                    if (bound[c] > least)
                        closest = fmax(closest, error / bound[c]);
                    assert_true(error <= bound[c] + least);
                }
            }
            render_profile_destroy(profile);
        }
        medium_end(&medium);
    }
    print_message("  largest part of the bound that was used: %.2g\n", closest);
    assert_true(closest > 0.3); /* it is no idle bound */
}

/* ---- sums --------------------------------------------------------------------------------------- */

enum { POINTS = 3000, TARGETS = 8 };

/* Points on a sphere, in a cube, on a plane or in heaps, in some of which one colour enters only. */
static void make_cloud(struct rng *rng, int shape, struct render_tree_point *points)
{
    double heap[3] = { 0 };
    for (int i = 0; i < POINTS; i++) {
        double p[3], length2 = 0;
        for (int k = 0; k < 3; k++) {
            if (i % 500 == 0)
                heap[k] = uniform(rng, -9, 9);
            p[k] = uniform(rng, -1, 1);
            length2 += p[k] * p[k];
        }
        points[i] = (struct render_tree_point){ .unused = 0 };
        for (int k = 0; k < 3; k++) {
            const double places[] = { 10 * p[k] / sqrt(length2), 10 * p[k], k == 1 ? 0 : 10 * p[k],
                                      heap[k] + 0.3 * p[k] };
            points[i].position_mm[k] = places[shape];
            points[i].flux_w[k] = shape == 3 && i / 500 % 3 != k ? 0 : log_uniform(rng, 1e-4, 1);
        }
    }
}

/* All pairs, by the library where the profile is no core. */
static double all_pairs(const struct render_tree_point *points, const struct render_medium *medium,
                        const struct render_profile *profile, const double target_mm[3], int channel)
{
    static double r_mm[POINTS], values[POINTS];
    for (int i = 0; i < POINTS; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++)
            square += pow(points[i].position_mm[k] - target_mm[k], 2);
        r_mm[i] = sqrt(square);
    }
    dipole_stack_profile_per_mm2(medium->stacks[channel], DIPOLE_FACE_LIT, r_mm, POINTS, values);
    double sum = 0;
    for (int i = 0; i < POINTS; i++) {
        render_lanes in_core;
        render_profile_at(profile, r_mm[i] * r_mm[i], &in_core);
        sum += points[i].flux_w[channel] *
               (r_mm[i] * r_mm[i] < profile->core_mm2 ? in_core[channel] : values[i]);
    }
    return sum;
}

static double compare(const struct render_medium *medium, struct render_profile *profile, int shape,
                      struct rng *rng, double least_share)
{
    static struct render_tree_point points[POINTS];
    struct render_tree *tree;
    double worst = 0, flux_w[IO_CHANNEL_COUNT] = { 0 };
    make_cloud(rng, shape, points);
    assert_true(render_tree_create(points, POINTS, &tree, NULL));
    for (int i = 0; i < POINTS; i++) {
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            flux_w[c] += points[i].flux_w[c];
    }
    struct render_tree_targets targets = { .count = 1 + (int)uniform(rng, 0, TARGETS) };
    const double extent_mm = log_uniform(rng, 1e-3, 2);
    const double *const middle_mm = points[(int)uniform(rng, 0, POINTS)].position_mm;
    for (int i = 0; i < targets.count; i++) {
        for (int k = 0; k < 3; k++)
            targets.position_mm[i][k] = middle_mm[k] + extent_mm * uniform(rng, -1, 1);
    }
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        targets.least[c] = least_share * flux_w[c];
    render_tree_add(tree, profile, &targets);
    for (int i = 0; i < targets.count; i++) {
        for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
            const double exact = all_pairs(points, medium, profile, targets.position_mm[i], c);
            const double error = fabs(targets.sums[i][c] - exact) - profile->noise[c] * flux_w[c] - 1e-240;
            if (error > 0)
                worst = fmax(worst, error / fmax(exact, targets.least[c]));
        }
    }
    render_tree_destroy(tree);
    return worst;
}

/* Oracle: all pairs, by the library. The bound is RENDER_TREE_ERROR, proven. */
static void trees_equal_all_pairs(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    double worst = 0;
    FOR_EACH_MEDIUM
    {
        struct io_material material;
        struct render_medium medium;
        if (medium_init(number, model, &material, &medium)) {
            struct render_profile *const profile = profile_of(&medium, 40, 0.2);
            for (int shape = 0; shape < 4; shape++) {
                const double error = compare(&medium, profile, shape, &rng, shape == 2 ? 1e-6 : 0);
                worst = fmax(worst, error);
                if (!(error <= RENDER_TREE_ERROR))
                    fail_msg("%s, model %d, shape %d: %g", media_list[number].name, (int)model, shape,
                             error);
            }
            render_profile_destroy(profile);
        }
        medium_end(&medium);
    }
    print_message("  largest relative error %.2g\n", worst);
}

/* Oracle: energy. About a point of a sphere, the area within a chord r is pi r^2 as on a plane: what leaves
 * in all is the power within a disc as wide as the sphere, never more than enters. */
static void a_sphere_keeps_the_energy(void **state)
{
    (void)state;
    enum { LEAVING = 400 };
    struct rng rng = { .seed = 4 };
    static struct render_tree_point points[POINTS];
    const double radius_mm = 10, golden_rad = PI * (3 - sqrt(5));
    const int numbers[] = { 0, 6 };
    for (size_t n = 0; n < 2; n++) {
        for (dipole_model model = DIPOLE_MODEL_DIPOLE; model <= DIPOLE_MODEL_MODES; model++) {
            struct io_material material;
            struct render_medium medium;
            if (medium_init(numbers[n], model, &material, &medium)) {
                struct render_profile *const profile = profile_of(&medium, 2 * radius_mm, 0.5);
                struct render_tree *tree;
                make_cloud(&rng, 0, points);
                assert_true(render_tree_create(points, POINTS, &tree, NULL));
                double entering[IO_CHANNEL_COUNT] = { 0 }, leaving[IO_CHANNEL_COUNT] = { 0 };
                for (int i = 0; i < LEAVING; i++) {
                    const double z = 1 - (2 * i + 1.0) / LEAVING, rho = sqrt(1 - z * z);
                    struct render_tree_targets targets = { .count = 1 };
                    targets.position_mm[0][0] = radius_mm * rho * cos(golden_rad * i);
                    targets.position_mm[0][1] = radius_mm * rho * sin(golden_rad * i);
                    targets.position_mm[0][2] = radius_mm * z;
                    render_tree_add(tree, profile, &targets);
                    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                        leaving[c] += targets.sums[0][c] * 4 * PI * radius_mm * radius_mm / LEAVING;
                }
                for (int i = 0; i < POINTS; i++) {
                    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
                        entering[c] += points[i].flux_w[c];
                }
                for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
                    const double within =
                        dipole_stack_within(medium.stacks[c], DIPOLE_FACE_LIT, 2 * radius_mm);
                    assert_true(leaving[c] <= entering[c]);
                    assert_close(leaving[c] / entering[c], within, 0.05, "%s, model %d",
                                 media_list[numbers[n]].name, (int)model); /* LEAVING points 1.8 mm apart */
                }
                render_tree_destroy(tree);
                render_profile_destroy(profile);
            }
            medium_end(&medium);
        }
    }
}

/* Oracle: sums of nothing, and of one point. */
static void few_points_are_summed(void **state)
{
    (void)state;
    struct io_material material;
    struct render_medium medium;
    assert_true(medium_init(0, DIPOLE_MODEL_DIPOLE, &material, &medium));
    struct render_profile *const profile = profile_of(&medium, 40, 0.2);
    struct render_tree *tree;
    struct render_tree_point point = { .position_mm = { 1, 2, 3 }, .flux_w = { 1, 2, 3, 0 } };
    struct render_tree_targets targets = { .position_mm = { { 1, 2, 5 } }, .count = 1 };
    assert_true(render_tree_create(&point, 0, &tree, NULL));
    render_tree_add(tree, profile, &targets);
    assert_true(targets.sums[0][0] == 0);
    render_tree_destroy(tree);
    assert_true(render_tree_create(&point, 1, &tree, NULL));
    render_tree_add(tree, profile, &targets);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        assert_close(targets.sums[0][c], (c + 1) * library(&medium, c, 2), 1e-7, "channel %d", c);
    render_tree_destroy(tree);
    render_profile_destroy(profile);
    medium_end(&medium);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_equal_the_library),
        cmocka_unit_test(cores_keep_the_power),
        cmocka_unit_test(bounds_hold),
        cmocka_unit_test(trees_equal_all_pairs),
        cmocka_unit_test(a_sphere_keeps_the_energy),
        cmocka_unit_test(few_points_are_summed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
