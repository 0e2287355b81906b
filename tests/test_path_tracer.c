/* The path tracer's walk against other people's programs and conservation. */
#include "reference_file.h"
#include "tracer_scenes.h"

enum { RINGS = 130 };

/* ---- against MCML ------------------------------------------------------------------------------------ */

struct mcml_case {
    const char *name;
    double sigma_a_per_mm, sigma_s_per_mm, eta, thickness_mm; /* 0: a half-space */
    size_t photon_count;
};

static struct tracer_scene mcml_scene(const struct mcml_case *mcml)
{
    const double half_mm = 0.5 * mcml->thickness_mm;
    return (struct tracer_scene){
        .body = { .kind = half_mm > 0 ? TRACER_BOX : TRACER_HALF_SPACE,
                  .centre_mm = { 0, -half_mm, 0 },
                  .half_size_mm = { WIDE_MM, half_mm, WIDE_MM } },
        .medium = { mcml->sigma_a_per_mm, mcml->sigma_s_per_mm, 0, mcml->eta },
        .light = { TRACER_PENCIL, { 0, -1, 0 }, { 0, 1, 0 }, 1 },
    };
}

struct rings {
    double edges_mm[RINGS + 1], reference[2][RINGS], reference_error[2][RINGS];
    double found[2][RINGS], error[2][RINGS];
    struct tracer_rings rings;
};

static void read_rings(const struct mcml_case *mcml, struct rings *out)
{
    struct reference_file file;
    char path[256];
    snprintf(path, sizeof path, "mcml/%s.csv", mcml->name);
    reference_open(&file, path);
    size_t count = 0;
    while (reference_next(&file)) {
        assert_true(count < RINGS);
        out->edges_mm[count] = reference_number(&file, "r_lo_mm");
        out->edges_mm[count + 1] = reference_number(&file, "r_hi_mm");
        out->reference[0][count] = reference_number(&file, "R_per_mm2");
        out->reference_error[0][count] = reference_number(&file, "R_sem_per_mm2");
        if (mcml->thickness_mm > 0) {
            out->reference[1][count] = reference_number(&file, "T_per_mm2");
            out->reference_error[1][count] = reference_number(&file, "T_sem_per_mm2");
        }
        count++;
    }
    out->rings = (struct tracer_rings){ out->edges_mm, count,         out->found[0],
                                        out->error[0], out->found[1], out->error[1] };
}

/* Neighbours are joined until each group has an error below 6 % on both sides: then errors are Gaussian. */
static void compare_rings(const struct rings *rings, int side, struct chi2 *chi2)
{
    double found = 0, expected = 0, variance = 0;
    for (size_t i = 0; i < rings->rings.count; i++) {
        const double lo = rings->edges_mm[i], hi = rings->edges_mm[i + 1];
        const double area = TRACER_PI * (hi - lo) * (hi + lo);
        found += area * rings->found[side][i];
        expected += area * rings->reference[side][i];
        const double ours = area * rings->error[side][i], theirs = area * rings->reference_error[side][i];
        variance += ours * ours + theirs * theirs;
        if (found > 0 && sqrt(variance) < 0.06 * found) {
            chi2_add(chi2, found, expected, sqrt(variance));
            found = expected = variance = 0;
        }
    }
}

static void compare_totals(const struct mcml_case *mcml, const struct tracer_result *result)
{
    struct reference_file file;
    reference_open(&file, "mcml_totals.csv");
    bool is_found = false;
    while (reference_next(&file)) {
        if (strcmp(reference_text(&file, "case"), mcml->name) != 0)
            continue;
        is_found = true;
        const struct tracer_powers *const p = &result->mean, *const e = &result->error;
        assert_close(p->mirrored, reference_number(&file, "Rsp"), 1e-6, "mirrored");
        check_number(p->scattered[TRACER_TOP], reference_number(&file, "R"),
                     hypot(e->scattered[TRACER_TOP], reference_number(&file, "R_sem")), mcml->name);
        check_number(p->absorbed, reference_number(&file, "A"),
                     hypot(e->absorbed, reference_number(&file, "R_sem")), mcml->name);
        if (mcml->thickness_mm > 0) {
            check_number(p->scattered[2], reference_number(&file, "T"),
                         hypot(e->scattered[2], reference_number(&file, "T_sem")), mcml->name);
            /* What did not scatter is a sum of certain numbers of photons, in theirs of a closed form's. */
            check_number(p->unscattered[2], reference_number(&file, "T0"), e->unscattered[2] + 1e-4,
                         mcml->name);
            check_number(p->unscattered[TRACER_TOP], reference_number(&file, "R0"),
                         e->unscattered[TRACER_TOP] + 1e-4, mcml->name);
        }
    }
    assert_true(is_found);
}

/* Oracle: MCML, ring by ring and in total. */
static void agrees_with_mcml(void **state)
{
    (void)state;
    static const struct mcml_case cases[] = {
        { "semi_hialb_n10", 0.001, 1, 1, 0, 100000 },
        { "semi_hialb_n15", 0.001, 1, 1.5, 0, 60000 },
        { "semi_marbleG_n13", 0.0041, 2.6, 1.3, 0, 60000 },
        { "semi_skin1R_n13", 0.032, 0.74, 1.3, 0, 100000 },
        { "semi_lowalb_n14", 1, 1, 1.4, 0, 400000 },
        { "slab_hialb_n15_01mfp", 0.001, 1, 1.5, 0.999000999, 100000 },
        { "slab_hialb_n15_02mfp", 0.001, 1, 1.5, 1.998001998, 100000 },
        { "slab_hialb_n15_20mfp", 0.001, 1, 1.5, 19.98001998, 60000 },
    };
    struct rings *const rings = calloc(1, sizeof *rings);
    assert_non_null(rings);
    struct chi2 chi2 = { 0 };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct tracer_scene scene = mcml_scene(&cases[i]);
        struct tracer_result result = { .rings = &rings->rings };
        read_rings(&cases[i], rings);
        trace(&scene, cases[i].photon_count, 100 + i, &result);
        check_balance(&result.mean);
        compare_totals(&cases[i], &result);
        struct chi2 of_case = { 0 };
        compare_rings(rings, 0, &of_case);
        if (cases[i].thickness_mm > 0)
            compare_rings(rings, 1, &of_case);
        chi2_check(&of_case, 20, cases[i].name);
        chi2.sum += of_case.sum;
        chi2.count += of_case.count;
    }
    free(rings);
    chi2_check(&chi2, 400, "all of MCML");
}

/* Oracle: adding and doubling, 168 slabs, g of 0 and 0.8; also the light that did not scatter. */
static void agrees_with_adding_and_doubling(void **state)
{
    (void)state;
    struct reference_file file;
    struct chi2 chi2 = { 0 };
    reference_open(&file, "adding_doubling.csv");
    while (reference_next(&file)) {
        const double albedo = reference_number(&file, "albedo"), tau = reference_number(&file, "tau");
        const double half_mm = tau < INFINITY ? 0.5 * tau : 0;
        const struct tracer_scene scene = {
            .body = { .kind = half_mm > 0 ? TRACER_BOX : TRACER_HALF_SPACE,
                      .half_size_mm = { WIDE_MM, half_mm, WIDE_MM } },
            .medium = { 1 - albedo, albedo, reference_number(&file, "g"),
                        reference_number(&file, "n_slab") },
            .light = { TRACER_PENCIL, { 0, -1, 0 }, { 0, 100, 0 }, 1 },
        };
        struct tracer_result result = { 0 };
        trace(&scene, 6400, (uint64_t)chi2.count, &result);
        check_balance(&result.mean);
        const struct tracer_powers *const p = &result.mean, *const e = &result.error;
        const double inexact = reference_number(&file, "err");
        const double r = p->mirrored + p->scattered[TRACER_TOP] + p->unscattered[TRACER_TOP];
        const double r_error = hypot(e->scattered[TRACER_TOP], e->unscattered[TRACER_TOP]);
        chi2_add(&chi2, r, reference_number(&file, "R_total"), hypot(r_error, inexact));
        const double t = p->scattered[2] + p->unscattered[2];
        /* Fewer than some hundred photons that passed have no Gaussian error. */
        if (reference_number(&file, "T_total") > 0.03)
            chi2_add(&chi2, t, reference_number(&file, "T_total"),
                     hypot(hypot(e->scattered[2], e->unscattered[2]), inexact));
    }
    chi2_check(&chi2, 250, "adding and doubling");
}

/* ---- spheres ------------------------------------------------------------------------------------------
 */

/* Oracle: conservation of energy; the incident power is the shadow's area times the irradiance, of a point
 * the solid angle times the intensity; what is mirrored is the flat surface's diffuse reflectance. */
static void energy_is_kept(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < 40; i++) {
        const bool is_absorbing = i % 4 != 0;
        struct tracer_scene scene =
            sphere_scene(is_absorbing ? log_uniform(&rng, 1e-3, 3) : 0, log_uniform(&rng, 0.01, 5),
                         uniform(&rng, -0.5, 0.9), i % 5 == 0 ? 1 : log_uniform(&rng, 0.7, 1.6));
        double incident = 12 * TRACER_PI;
        if (i % 3 == 1) {
            scene.light.kind = TRACER_POINT;
            scene.light.position_mm[0] = 1 + log_uniform(&rng, 2.1, 20);
            scene.light.position_mm[1] = 2;
            scene.light.position_mm[2] = 3;
            const double sine = 2 / (scene.light.position_mm[0] - 1);
            incident = 3 * 2 * TRACER_PI * (1 - sqrt(1 - sine * sine));
        }
        if (i % 3 == 2) {
            scene.body.kind = TRACER_BOX;
            for (int k = 0; k < 3; k++)
                scene.body.half_size_mm[k] = log_uniform(&rng, 0.5, 4);
            const double *const half = scene.body.half_size_mm;
            scene.light.direction[0] = -0.6;
            scene.light.direction[2] = 0.8;
            incident = 3 * 4 * half[1] * (0.6 * half[2] + 0.8 * half[0]);
        }
        struct tracer_result result = { 0 };
        trace(&scene, 3200, (uint64_t)i, &result);
        check_balance(&result.mean);
        assert_close(result.mean.incident, incident, 1e-9, "incident power, case %d", i);
        if (!is_absorbing)
            assert_true(result.mean.absorbed == 0);
        check_number(result.mean.roulette, 0, result.error.roulette, "roulette");
        if (i % 3 == 0)
            check_number(result.mean.mirrored / incident, 1 - dipole_fdt_outside(scene.medium.eta),
                         result.error.mirrored / incident + 1e-12, "mirrored");
    }
}

/* Oracle: the power on a box from a point is the intensity times its solid angle; from the middle of a
 * cube's face the cube beyond hides a face's solid angle, arctan(1/(d sqrt(d^2 + 2))) * 4. */
static void point_light_fills_its_solid_angle(void **state)
{
    (void)state;
    struct tracer_scene scene = sphere_scene(1, 0, 0, 1.2);
    scene.body = (struct tracer_body){ .kind = TRACER_BOX, .half_size_mm = { 1, 1, 1 } };
    scene.light = (struct tracer_light){ TRACER_POINT, { 0 }, { 0, 2.5, 0 }, 7 };
    struct tracer_result result = { 0 };
    trace(&scene, 100000, 1, &result);
    check_balance(&result.mean);
    check_number(result.mean.incident, 7 * 4 * atan(1 / (1.5 * sqrt(1.5 * 1.5 + 2))), result.error.incident,
                 "solid angle");
}

/* Oracle: a point light's power is spread evenly over solid angle: of the cone that holds a sphere the
 * inner half, and each quarter around it, get their share; where it comes to is on the surface and faces
 * it. */
static void point_light_is_even_on_a_sphere(void **state)
{
    (void)state;
    enum { COUNT = 40000 };
    struct tracer_scene scene = sphere_scene(1, 1, 0, 1.3);
    scene.light = (struct tracer_light){ TRACER_POINT, { 0 }, { 1, 2, 6.5 }, 1 };
    struct tracer_shape shape;
    struct tracer_lamp lamp;
    struct accuracy_stream stream = { { 1, 2, 3, 4 } };
    tracer_shape_init(&scene.body, &shape);
    tracer_lamp_init(&scene.light, &lamp);
    const double least_cosine = sqrt(1 - 4 / (3.5 * 3.5));
    int inner = 0, quarters[4] = { 0 };
    for (int i = 0; i < COUNT; i++) {
        struct tracer_arrival arrival;
        double normal[3];
        tracer_lamp_sample(&lamp, &shape, &stream, &arrival);
        tracer_normal(&shape, arrival.p_mm, arrival.face, normal);
        assert_close(tracer_dot(normal, normal), 1, 1e-9, "on the surface");
        assert_true(tracer_dot(normal, arrival.direction) < 1e-6);
        inner += -arrival.direction[2] > 0.5 * (1 + least_cosine);
        quarters[2 * (arrival.direction[0] > 0) + (arrival.direction[1] > 0)]++;
    }
    check_number(inner, 0.5 * COUNT, sqrt(0.25 * COUNT), "inner half");
    for (int i = 0; i < 4; i++)
        check_number(quarters[i], 0.25 * COUNT, sqrt(0.1875 * COUNT), "quarter");
}

/* ---- runs -------------------------------------------------------------------------------------------- */

/* Oracle: the same run on another number of threads, to the last bit; another seed differs. */
static void threads_do_not_matter(void **state)
{
    (void)state;
    const double toward_eye[3] = { 0, 0.6, 0.8 };
    const struct tracer_view view = sphere_view(toward_eye, TRACER_RADIOSITY);
    struct tracer_scene scene = sphere_scene(0.1, 2, 0.5, 1.3);
    scene.view = &view;
    static const int thread_counts[] = { 1, 2, 5, 0 };
    static float radiance[4][PIXELS], error[4][PIXELS], other[PIXELS];
    for (int i = 0; i < 4; i++) {
        assert_true(tracer_picture(&scene, 10000, 9, thread_counts[i], radiance[i], error[i], NULL));
        assert_memory_equal(radiance[i], radiance[0], sizeof radiance[0]);
        assert_memory_equal(error[i], error[0], sizeof error[0]);
    }
    assert_true(tracer_picture(&scene, 10000, 10, 0, other, NULL, NULL));
    assert_memory_not_equal(other, radiance[0], sizeof other);
}

/* Oracle: errors are those of Poisson where a photon has one weight: of 0 / 1 decisions. */
static void errors_are_what_counting_says(void **state)
{
    (void)state;
    const size_t photon_count = 100000;
    const struct tracer_scene scene = sphere_scene(0, 0.2, 0, 1);
    struct tracer_result result = { 0 };
    trace(&scene, photon_count, 4, &result);
    const double part = result.mean.scattered[0] / result.mean.incident;
    const double expected = result.mean.incident * sqrt(part * (1 - part) / (double)photon_count);
    assert_close(result.error.scattered[0], expected, 0.5, "error"); /* 4 of its own 13 % */
}

/* Oracle: the list of what is refused, and a word of each message. */
static void bad_values_are_refused(void **state)
{
    (void)state;
    const double toward_eye[3] = { 0, 0, 1 };
    float picture[PIXELS];
    for (int i = 0; i < 18; i++) {
        struct tracer_view view = sphere_view(toward_eye, TRACER_ANGLE);
        struct tracer_scene scene = sphere_scene(0.1, 1, 0, 1.3);
        struct tracer_run run = { 100, 0, 1 };
        scene.view = &view;
        const char *word = NULL;
        switch (i) {
        case 0:
            scene.body.radius_mm = 0;
            word = "radius_mm";
            break;
        case 1:
            scene.body.kind = TRACER_BOX;
            word = "half_size_mm";
            break;
        case 2:
            scene.medium.sigma_a_per_mm = -1;
            word = "sigma_a";
            break;
        case 3:
            scene.medium.sigma_s_per_mm = NAN;
            word = "sigma_s";
            break;
        case 4:
            scene.medium.g = 1;
            word = "g must";
            break;
        case 5:
            scene.medium.eta = 0;
            word = "eta";
            break;
        case 6:
            scene.light.strength = 0;
            word = "strength";
            break;
        case 7:
            scene.light.direction[2] = 0;
            word = "direction";
            break;
        case 8:
            scene.light = (struct tracer_light){ TRACER_POINT, { 0 }, { 1, 2, 3.5 }, 1 };
            word = "outside";
            break;
        case 9:
            scene.light = (struct tracer_light){ TRACER_PENCIL, { 0, 1, 0 }, { 9, 0, 0 }, 1 };
            word = "meet";
            break;
        case 10:
            scene.body.kind = TRACER_HALF_SPACE;
            word = "pencil";
            break;
        case 11:
            scene.body.kind = TRACER_HALF_SPACE;
            scene.medium.sigma_a_per_mm = 0;
            word = "no end";
            break;
        case 12:
            view.camera.width_px = 1 << 20;
            word = "pixels";
            break;
        case 13:
            view.camera.height_mm = 0;
            word = "height";
            break;
        case 14:
            view.camera.is_orthographic = false;
            view.camera.fov_y_rad = 1;
            view.camera.eye_mm[2] = 3;
            word = "eye";
            break;
        case 15:
            view.cone_rad = 0;
            word = "cone_rad";
            break;
        case 16:
            view.estimator = TRACER_NEXT_EVENT;
            word = "flat";
            break;
        default:
            run.photon_count = 0;
            word = "photon_count";
            break;
        }
        struct tracer_result result = { .radiance = picture };
        dipole_status status;
        assert_false(tracer_trace(&scene, &run, &result, &status));
        assert_int_equal(status.code, DIPOLE_BAD_VALUE);
        assert_non_null(strstr(status.message, word));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_mcml),
        cmocka_unit_test(agrees_with_adding_and_doubling),
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(point_light_fills_its_solid_angle),
        cmocka_unit_test(point_light_is_even_on_a_sphere),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(errors_are_what_counting_says),
        cmocka_unit_test(bad_values_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
