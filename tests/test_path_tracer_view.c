/* The path tracer's pictures against closed forms, geometry and conservation. */
#include "tracer_scenes.h"

#include <string.h>

/* Oracle: power conservation. Light comes along an axis, so all pictures from one polar angle have one
 * mean, and the intensities seen, integrated over all directions with 8 Gauss-Legendre points, are the
 * power that left. The intensity is smooth, so the rule errs by less than the photons' noise. */
static void pictures_from_all_sides_hold_all_power(void **state)
{
    (void)state;
    static const double rule[4][2] = { { 0.18343464249564980494, 0.36268378337836198297 },
                                       { 0.52553240991632898582, 0.31370664587788728734 },
                                       { 0.79666647741362673959, 0.22238103445337447054 },
                                       { 0.96028985649753623168, 0.10122853629037625915 } };
    const struct tracer_scene scene = sphere_scene(0.01, 1, 0.3, 1.3);
    const double pixel_mm2 = 4.2 * 4.2 / PIXELS;
    for (int estimator = TRACER_RADIOSITY; estimator <= TRACER_ANGLE; estimator++) {
        struct picture picture;
        double power = 0, variance = 0;
        for (int i = 0; i < 8; i++) {
            const double mu = i < 4 ? rule[i][0] : -rule[i - 4][0], weight = rule[i % 4][1];
            const double toward_eye[3] = { sqrt(1 - mu * mu) * cos(i), sqrt(1 - mu * mu) * sin(i), mu };
            const struct tracer_view view = sphere_view(toward_eye, (enum tracer_estimator)estimator);
            draw(scene, &view, estimator == TRACER_ANGLE ? 300000 : 30000, &picture);
            for (int p = 0; p < PIXELS; p++) {
                const double scale = 2 * TRACER_PI * weight * pixel_mm2,
                             error = scale * (double)picture.error[p];
                power += scale * (double)picture.radiance[p];
                variance += error * error;
            }
        }
        double left = picture.result.mean.scattered[0];
        /* A direction is in the cones about all directions around it, each of which divides by the cone's
         * area seen from the front, not by its solid angle. */
        if (estimator == TRACER_ANGLE)
            left *= 2 / (1 + cos(0.15));
        check_number(power, left, hypot(sqrt(variance), picture.result.error.scattered[0]), "all sides");
        assert_true(sqrt(variance) < 0.01 * left);
    }
}

/* Radiance in a sphere of index 1 toward an eye to which direction points, from a point where it leaves:
 * light scattered once, on the chord. */
static double chord_radiance(const struct tracer_scene *scene, const double p_mm[3],
                             const double direction[3])
{
    enum { STEPS = 40 };
    const struct tracer_medium *const medium = &scene->medium;
    const double sigma_t = medium->sigma_a_per_mm + medium->sigma_s_per_mm;
    double x[3], toward_light[3];
    for (int k = 0; k < 3; k++) {
        x[k] = p_mm[k] - scene->body.centre_mm[k];
        toward_light[k] = -scene->light.direction[k];
    }
    const double chord_mm = 2 * tracer_dot(x, direction), radius_mm = scene->body.radius_mm;
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        const double t_mm = chord_mm * (i + 0.5) / STEPS;
        double q[3];
        for (int k = 0; k < 3; k++)
            q[k] = x[k] - t_mm * direction[k];
        const double along = tracer_dot(q, toward_light);
        const double in_mm = sqrt(along * along + radius_mm * radius_mm - tracer_dot(q, q)) - along;
        sum += exp(-sigma_t * (t_mm + in_mm)) * chord_mm / STEPS;
    }
    return scene->light.strength * medium->sigma_s_per_mm * sum *
           tracer_phase_per_sr(medium->g, -tracer_dot(toward_light, direction));
}

/* Pixel i of 9 of a block of 3 x 3. */
static int block_pixel(int block, int i)
{
    const int row = block / (SIDE / 3) * 3 + i / 3, column = block % (SIDE / 3) * 3 + i % 3;
    return row * SIDE + column;
}

/* Mean over a pixel of the mean over the cone, both by a midpoint rule. */
static double single_scattering_pixel(const struct tracer_scene *scene, const struct tracer_view *view,
                                      const double right[3], const double up[3], const double toward_eye[3],
                                      int pixel)
{
    enum { GRID = 5, RINGS_IN_CONE = 3, SPOKES = 8 };
    double sum = 0;
    for (int sub = 0; sub < GRID * GRID; sub++) {
        const double step_mm = view->camera.height_mm / SIDE;
        const double x = (pixel % SIDE + (sub % GRID + 0.5) / GRID - 0.5 * SIDE) * step_mm;
        const double y = (0.5 * SIDE - pixel / SIDE - (sub / GRID + 0.5) / GRID) * step_mm;
        const double z2 = scene->body.radius_mm * scene->body.radius_mm - x * x - y * y;
        if (z2 <= 0)
            continue;
        double p_mm[3], normal[3], radiance = 0, weight = 0;
        for (int k = 0; k < 3; k++) {
            p_mm[k] = x * right[k] + y * up[k] + sqrt(z2) * toward_eye[k];
            normal[k] = p_mm[k] / scene->body.radius_mm;
            p_mm[k] += scene->body.centre_mm[k];
        }
        for (int i = 0; i < RINGS_IN_CONE * SPOKES; i++) {
            const double cosine =
                1 - (1 - cos(view->cone_rad)) * (i / SPOKES + 0.5) / RINGS_IN_CONE; /* equal solid angles */
            const double angle = 2 * TRACER_PI * (i % SPOKES) / SPOKES, sine = sqrt(1 - cosine * cosine);
            double direction[3];
            for (int k = 0; k < 3; k++)
                direction[k] = cosine * toward_eye[k] + sine * (cos(angle) * right[k] + sin(angle) * up[k]);
            const double exit = tracer_dot(direction, normal);
            if (exit > 0) {
                radiance += exit * chord_radiance(scene, p_mm, direction);
                weight += exit;
            }
        }
        sum += weight > 0 ? radiance / weight : 0;
    }
    return sum / (GRID * GRID);
}

/*
 * Oracle: where light scatters at most once and index is matched, the picture is an integral along chords.
 * Of the light that scatters here less than one part in a thousand scatters again.
 */
static void thin_sphere_is_its_single_scattering(void **state)
{
    (void)state;
    struct tracer_scene scene = sphere_scene(0.2, 2e-4, 0.4, 1);
    const double toward_eye[3] = { 1, 0, 0 }, right[3] = { 0, 0, -1 }, up[3] = { 0, 1, 0 };
    struct tracer_view view = sphere_view(toward_eye, TRACER_ANGLE);
    view.cone_rad = 0.25;
    struct picture picture;
    draw(scene, &view, 4000000, &picture);
    check_balance(&picture.result.mean);
    double found = 0, expected = 0, variance = 0;
    struct chi2 chi2 = { 0 };
    for (int block = 0; block < PIXELS / 9; block++) { /* of 3 x 3 pixels, for Gaussian errors */
        double block_found = 0, block_expected = 0, block_variance = 0;
        for (int i = 0; i < 9; i++) {
            const int pixel = block_pixel(block, i);
            block_found += (double)picture.radiance[pixel];
            block_expected += single_scattering_pixel(&scene, &view, right, up, toward_eye, pixel);
            block_variance += (double)picture.error[pixel] * (double)picture.error[pixel];
        }
        found += block_found;
        expected += block_expected;
        variance += block_variance;
        /* Photons that are counted here have nearly one weight, found / variance is its inverse: how many
         * are expected, and their variance. Blocks with few have no Gaussian error. */
        const double weight = block_found > 0 ? block_variance / block_found : INFINITY;
        if (block_expected > 25 * weight)
            chi2_add(&chi2, block_found, block_expected, sqrt(block_expected * weight));
    }
    chi2_check(&chi2, 30, "single scattering");
    check_number(found, expected, sqrt(variance) + 1e-3 * expected, "single scattering");
    assert_true(sqrt(variance) < 0.03 * expected);
}

/* Oracle: geometry. A sphere's picture is a disc: of its radius across parallel rays, of the tangent cone's
 * for an eye near by; nothing is drawn beyond. */
static void silhouette_is_where_geometry_says(void **state)
{
    (void)state;
    struct tracer_scene scene = sphere_scene(0, 20, 0, 1.3);
    scene.light.kind = TRACER_POINT; /* from nearly all over the side that is seen */
    scene.light.position_mm[0] = 1 + 2.0 * 0.36;
    scene.light.position_mm[1] = 2 + 2.0 * 0.48;
    scene.light.position_mm[2] = 3 + 2.0 * 0.8 + 200;
    for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
        const double toward_eye[3] = { 0.36, 0.48, 0.8 };
        struct tracer_view view = sphere_view(toward_eye, TRACER_RADIOSITY);
        double radius_px = 2 / 4.2 * SIDE;
        if (is_perspective) {
            view.camera.is_orthographic = false;
            view.camera.fov_y_rad = 1;
            for (int k = 0; k < 3; k++)
                view.camera.eye_mm[k] = scene.body.centre_mm[k] + 5 * toward_eye[k];
            radius_px = tan(asin(2.0 / 5)) / tan(0.5) * SIDE / 2;
        }
        struct picture picture;
        draw(scene, &view, 400000, &picture);
        for (int p = 0; p < PIXELS; p++) {
            const double x = p % SIDE + 0.5 - 0.5 * SIDE, y = p / SIDE + 0.5 - 0.5 * SIDE;
            const double far_px = hypot(fabs(x) + 0.5, fabs(y) + 0.5),
                         near_px = hypot(fabs(x) - 0.5, fabs(y) - 0.5);
            if (near_px > radius_px)
                assert_true(picture.radiance[p] == 0);
            if (far_px < radius_px)
                assert_true(picture.radiance[p] > 0);
        }
    }
}

/* A wide slab of index 1.4, lit from above all over. */
static struct tracer_scene slab_scene(void)
{
    return (struct tracer_scene){
        .body = { .kind = TRACER_BOX, .half_size_mm = { 15, 1, 15 } },
        .medium = { 0.05, 2, 0.5, 1.4 },
        .light = { TRACER_DIRECTIONAL, { 0, -1, 0 }, { 0 }, 2 },
    };
}

/* Oracle: in the middle of a wide slab radiosity is the same everywhere, so a pixel of any camera shows it
 * times the diffuse exit at the angle of its ray. */
static void perspective_shows_radiance(void **state)
{
    (void)state;
    const struct tracer_scene scene = slab_scene();
    struct tracer_result totals = { 0 };
    struct tracer_scene narrow = slab_scene();
    narrow.body.half_size_mm[0] = narrow.body.half_size_mm[2] = WIDE_MM;
    narrow.light = (struct tracer_light){ TRACER_PENCIL, { 0, -1, 0 }, { 0, 9, 0 }, 1 };
    trace(&narrow, 400000, 3, &totals);
    for (int is_below = 0; is_below < 2; is_below++) {
        const double y = is_below ? -5 : 5;
        const struct tracer_view view = { .camera = { .eye_mm = { 2, y, -1 },
                                                      .target_mm = { 0, 0, 0 },
                                                      .up = { 0, 0, 1 },
                                                      .fov_y_rad = 1.2,
                                                      .width_px = SIDE,
                                                      .height_px = SIDE } };
        struct picture picture;
        draw(scene, &view, 1000000, &picture);
        struct tracer_scene with_view = scene;
        with_view.view = &view;
        struct tracer_camera camera;
        tracer_camera_init(&with_view, &camera);
        const double radiosity = 2 * totals.mean.scattered[is_below ? 2 : TRACER_TOP];
        const double part = totals.error.scattered[is_below ? 2 : TRACER_TOP] * 2 / radiosity;
        struct chi2 chi2 = { 0 };
        for (int block = 0; block < PIXELS / 9; block++) { /* of 3 x 3 pixels, for Gaussian errors */
            double found = 0, expected = 0, variance = 0;
            for (int i = 0; i < 9; i++) {
                const int p = block_pixel(block, i);
                const double x = 2 * (p % SIDE + 0.5) / SIDE - 1, v = 1 - 2 * (p / SIDE + 0.5) / SIDE;
                double ray[3];
                for (int k = 0; k < 3; k++)
                    ray[k] = camera.forward[k] + camera.half_width * x * camera.right[k] +
                             camera.half_height * v * camera.up[k];
                const double cosine = fabs(ray[1]) / sqrt(tracer_dot(ray, ray));
                found += (double)picture.radiance[p];
                expected += radiosity * camera.exit_per_sr * (1 - dipole_fresnel_reflectance(1.4, cosine));
                variance += (double)picture.error[p] * (double)picture.error[p];
            }
            chi2_add(&chi2, found, expected, hypot(sqrt(variance), part * expected));
        }
        chi2_check(&chi2, PIXELS / 9, "perspective");
    }
}

/* Oracle: what is lit is seen on that side: light from above, from the right, of a point, too. */
static void pictures_stand_upright(void **state)
{
    (void)state;
    const double toward_eye[3] = { 0, 0, 1 };
    const struct tracer_view view = sphere_view(toward_eye, TRACER_RADIOSITY);
    for (int i = 0; i < 4; i++) {
        struct tracer_scene scene = sphere_scene(1, 5, 0, 1.3);
        const bool is_above = i % 2 == 0;
        const double direction[3] = { is_above ? 0 : -1, is_above ? -1 : 0, 0 };
        memcpy(scene.light.direction, direction, sizeof direction);
        scene.light.kind = i < 2 ? TRACER_DIRECTIONAL : TRACER_POINT;
        for (int k = 0; k < 3; k++)
            scene.light.position_mm[k] = scene.body.centre_mm[k] - 9 * direction[k];
        struct picture picture;
        draw(scene, &view, 20000, &picture);
        double lit = 0, dark = 0;
        for (int p = 0; p < PIXELS; p++) {
            const bool is_lit = is_above ? p / SIDE < SIDE / 2 : p % SIDE >= SIDE / 2;
            *(is_lit ? &lit : &dark) += (double)picture.radiance[p];
        }
        assert_true(lit > 10 * dark);
    }
}

/* Oracle: the estimators against each other: true radiance by counting what leaves in a narrow cone, and by
 * joining each scattering to the eye. A box, seen obliquely, so that three faces and all their reflections
 * take part; index from matched to total reflection between faces. */
static void next_event_agrees_with_angle(void **state)
{
    (void)state;
    static const double etas[] = { 1, 1.3, 1.6, 0.93 };
    for (size_t i = 0; i < sizeof etas / sizeof *etas; i++) {
        struct tracer_scene scene = sphere_scene(0.05, 0.6, 0.4, etas[i]);
        scene.body = (struct tracer_body){ .kind = TRACER_BOX,
                                           .centre_mm = { 1, 2, 3 },
                                           .half_size_mm = { 1, 0.7, 1.2 } };
        const double toward_eye[3] = { 0.48, 0.6, 0.64 };
        struct tracer_view view = sphere_view(toward_eye, TRACER_ANGLE);
        view.cone_rad = 0.12;
        struct picture angle, next;
        draw(scene, &view, 1500000, &angle);
        view.estimator = TRACER_NEXT_EVENT;
        draw(scene, &view, 10000, &next);
        check_balance(&next.result.mean);
        double found = 0, expected = 0, variance = 0;
        for (int p = 0; p < PIXELS; p++) {
            found += (double)next.radiance[p];
            expected += (double)angle.radiance[p];
            variance += (double)angle.error[p] * (double)angle.error[p] +
                        (double)next.error[p] * (double)next.error[p];
        }
        /* Over so narrow a cone the mean differs from the middle by a part of its radius squared. */
        check_number(found, expected, sqrt(variance) + 0.001 * expected, "next event");
        assert_true(sqrt(variance) < 0.03 * expected);
    }
}

enum { COSINES = 400 };

/* Chandrasekhar's H of isotropic scattering at the cosines (i + 1/2)/COSINES, by iteration of
 * 1/H(x) = sqrt(1 - albedo) + albedo/2 int H(y) y/(x + y) dy; the midpoint rule errs by some 1e-5. */
static void solve_h(double albedo, double h[COSINES])
{
    for (int i = 0; i < COSINES; i++)
        h[i] = 1;
    for (int round = 0; round < 60; round++) {
        double next[COSINES];
        for (int i = 0; i < COSINES; i++) {
            const double x = (i + 0.5) / COSINES;
            double sum = 0;
            for (int j = 0; j < COSINES; j++) {
                const double y = (j + 0.5) / COSINES;
                sum += h[j] * y / (x + y) / COSINES;
            }
            next[i] = 1 / (sqrt(1 - albedo) + 0.5 * albedo * sum);
        }
        for (int i = 0; i < COSINES; i++)
            h[i] = 0.5 * (h[i] + next[i]);
    }
}

static void direction_at(double cosine, double azimuth_rad, double out[3])
{
    const double sine = sqrt(1 - cosine * cosine);
    out[0] = sine * cos(azimuth_rad);
    out[1] = cosine;
    out[2] = sine * sin(azimuth_rad);
}

/* The intensity that an orthographic eye sees, W/sr: radiance times area across the view. */
static double intensity(const struct picture *picture, double height_mm, double *error)
{
    double sum = 0, variance = 0;
    for (int p = 0; p < PIXELS; p++) {
        sum += (double)picture->radiance[p];
        variance += (double)picture->error[p] * (double)picture->error[p];
    }
    *error = sqrt(variance) * height_mm * height_mm / PIXELS;
    return sum * height_mm * height_mm / PIXELS;
}

/* Oracle: the exact radiance of a half-space of matched index that scatters isotropically (Chandrasekhar
 * 1960): of a pencil of 1 W, albedo/(4 pi) H(mu) H(mu0) mu/(mu + mu0) W/sr in all. */
static void half_space_has_the_radiance_of_chandrasekhar(void **state)
{
    (void)state;
    static const double albedos[] = { 0.5, 0.95 };
    static const int cosines[][2] = { { 399, 280 }, { 240, 200 }, { 120, 399 }, { 300, 80 } };
    for (int i = 0; i < 8; i++) {
        const double albedo = albedos[i / 4];
        const double mu_0 = (cosines[i % 4][0] + 0.5) / COSINES, mu = (cosines[i % 4][1] + 0.5) / COSINES;
        double h[COSINES], up[3], eye[3], error;
        solve_h(albedo, h);
        direction_at(mu_0, 0.3, up);
        direction_at(mu, 1 + i, eye);
        const struct tracer_scene scene = {
            .body = { .kind = TRACER_HALF_SPACE },
            .medium = { 1 - albedo, albedo, 0, 1 },
            .light = { TRACER_PENCIL, { -up[0], -up[1], -up[2] }, { up[0], up[1], up[2] }, 1 },
        };
        struct tracer_view view = sphere_view(eye, TRACER_NEXT_EVENT);
        view.camera.height_mm = 1e4;
        struct picture picture;
        draw(scene, &view, 40000, &picture);
        const double found = intensity(&picture, 1e4, &error);
        const double expected =
            albedo / (4 * TRACER_PI) * h[cosines[i % 4][0]] * h[cosines[i % 4][1]] * mu / (mu + mu_0);
        check_number(found, expected, error + 1e-4 * expected, "half-space");
        assert_true(error < 0.01 * expected);
    }
}

/* Oracle: reciprocity. Light from one side seen from another is light from there seen from here. */
static void eye_and_light_can_change_places(void **state)
{
    (void)state;
    struct rng rng = { .seed = 8 };
    for (int i = 0; i < 4; i++) {
        struct tracer_scene scene = sphere_scene(0.1, 1, 0.6, i % 2 == 0 ? 1.5 : 0.9);
        scene.body.kind = TRACER_BOX;
        double ends[2][3], found[2], errors[2];
        for (int k = 0; k < 3; k++)
            scene.body.half_size_mm[k] = uniform(&rng, 0.5, 1.5);
        for (int end = 0; end < 2; end++)
            direction_at(uniform(&rng, -0.9, 0.9), uniform(&rng, 0, 6), ends[end]);
        for (int end = 0; end < 2; end++) {
            struct tracer_view view = sphere_view(ends[end], TRACER_NEXT_EVENT);
            view.camera.height_mm = 6;
            for (int k = 0; k < 3; k++)
                scene.light.direction[k] = -ends[1 - end][k];
            struct picture picture;
            draw(scene, &view, 60000, &picture);
            found[end] = intensity(&picture, 6, &errors[end]);
            assert_true(errors[end] < 0.02 * found[end]);
        }
        check_number(found[0], found[1], hypot(errors[0], errors[1]), "reciprocity");
    }
}

/* Oracle: quadrature over the cone, in steps of equal solid angle. */
static void cone_flux_is_its_integral(void **state)
{
    (void)state;
    enum { RADII = 400, ANGLES = 400 };
    for (int i = 0; i <= 20; i++) {
        const double cosine = i / 20.0, sine = sqrt(1 - cosine * cosine), half_rad = 0.1 + 0.02 * i;
        double sum = 0;
        for (int j = 0; j < RADII * ANGLES; j++) {
            const double c = 1 - (1 - cos(half_rad)) * (j / ANGLES + 0.5) / RADII;
            const double azimuth = 2 * TRACER_PI * (j % ANGLES + 0.5) / ANGLES;
            sum += fmax(c * cosine + sqrt(1 - c * c) * sine * cos(azimuth), 0);
        }
        sum *= 2 * TRACER_PI * (1 - cos(half_rad)) / (RADII * ANGLES);
        assert_close(tracer_cone_flux(cosine, sin(half_rad) * sin(half_rad)), sum, 1e-4, "cosine %g",
                     cosine);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_from_all_sides_hold_all_power),
        cmocka_unit_test(thin_sphere_is_its_single_scattering),
        cmocka_unit_test(silhouette_is_where_geometry_says),
        cmocka_unit_test(perspective_shows_radiance),
        cmocka_unit_test(pictures_stand_upright),
        cmocka_unit_test(next_event_agrees_with_angle),
        cmocka_unit_test(half_space_has_the_radiance_of_chandrasekhar),
        cmocka_unit_test(eye_and_light_can_change_places),
        cmocka_unit_test(cone_flux_is_its_integral),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
