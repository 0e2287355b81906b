/* renderer/harmonics.c, environment.c, environment_samples.c, environment_visibility.c and
 * reference_environment.c: light from all around without OpenGL. */
#include "check.h"
#include "environment_maps.h"
#include "scenes.h"

#include "io/image.h"
#include "renderer/environment_samples.h"
#include "renderer/projection.h"
#include "renderer/reference_environment.h"

#include <unistd.h>

static const double PI = MAP_PI;

/* ---- harmonics ---------------------------------------------------------------------------------- */

/* Oracle: the harmonics are orthonormal. Products up to order 64 are integrated exactly by 80 latitudes of
 * Gauss's rule in cos theta (split in two rules of 64 on halves) and even steps around. */
static void harmonics_are_orthonormal(void **state)
{
    (void)state;
    enum { AROUND = 160, CHOSEN = 12 };
    const int chosen[CHOSEN][2] = { { 0, 0 },  { 1, -1 }, { 1, 0 },   { 2, 2 },    { 7, -3 }, { 7, 3 },
                                    { 31, 0 }, { 33, 0 }, { 64, 64 }, { 64, -64 }, { 64, 1 }, { 63, 1 } };
    static struct render_harmonics harmonics;
    double(*const unit)[3] = calloc(RENDER_HARMONIC_COUNT, sizeof *unit);
    double points[64], weights[64], sums[CHOSEN][CHOSEN] = { { 0 } };
    assert_non_null(unit);
    render_harmonics_init(&harmonics);
    render_legendre_rule(64, points, weights);
    for (int i = 0; i < 128 * AROUND; i++) {
        const int row = i / AROUND, half = row / 64;
        const double y = 0.5 * (points[row % 64] + (half ? 1 : -1)), s = sqrt(1 - y * y);
        const double phi = 2 * PI * (i % AROUND + 0.5) / AROUND;
        const double direction[3] = { s * sin(phi), y, s * cos(phi) };
        const double weight = 0.5 * weights[row % 64] * 2 * PI / AROUND;
        double values[CHOSEN];
        for (int k = 0; k < CHOSEN; k++) {
            double sum[3];
            double *const at = unit[render_harmonic_index(chosen[k][0], chosen[k][1])];
            at[0] = 1;
            render_harmonics_sum(&harmonics, chosen[k][0], (const double(*)[3])unit, direction, sum);
            at[0] = 0;
            values[k] = sum[0];
        }
        for (int a = 0; a < CHOSEN; a++) {
            for (int b = 0; b <= a; b++)
                sums[a][b] += weight * values[a] * values[b];
        }
    }
    for (int a = 0; a < CHOSEN; a++) {
        for (int b = 0; b <= a; b++) /* rounding of 20,000 terms */
            assert_true(fabs(sums[a][b] - (a == b)) < 1e-12);
    }
    free(unit);
}

static double cosine_lobe(const double direction[3], const void *context)
{
    const double *const axis = context;
    return fmax(direction[0] * axis[0] + direction[1] * axis[1] + direction[2] * axis[2], 0);
}

static double only_pixel(const double direction[3], const void *context)
{
    const double *const axis = context;
    return direction[0] * axis[0] + direction[1] * axis[1] + direction[2] * axis[2] > 0.999999 ? 1 : 0;
}

/* Oracle: closed forms. A constant has order 0 alone, L sqrt(4 pi); a cosine lobe about an axis the zonal
 * coefficients of the clamped cosine, pi, 2 pi/3, pi/4, 0, -pi/24, times the harmonics of its axis, to the
 * square of the pixels' width; a small patch its solid angle times the harmonics of its place. */
static void maps_have_the_harmonics_of_closed_forms(void **state)
{
    (void)state;
    enum { HEIGHT = 256 };
    const double level = 3, lobes[5] = { PI, 2 * PI / 3, PI / 4, 0, -PI / 24 };
    struct render_environment *environment = sky_of(8, constant_sky, &level);
    assert_close(environment->coefficients[0][1], level * sqrt(4 * PI), 1e-14, "constant");
    for (int i = 1; i < RENDER_HARMONIC_COUNT; i++)
        assert_true(fabs(environment->coefficients[i][0]) < 1e-13 * level);
    assert_true(environment->rest[0] < 1e-12);
    render_environment_destroy(environment);

    struct rng rng = { .seed = 5 };
    double(*const unit)[3] = calloc(RENDER_HARMONIC_COUNT, sizeof *unit);
    double axis[3];
    assert_non_null(unit);
    random_direction(&rng, axis);
    environment = sky_of(HEIGHT, cosine_lobe, axis);
    for (int l = 0; l <= 4; l++) {
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            double sum[3];
            unit[i][0] = 1;
            render_harmonics_sum(&environment->harmonics, l, (const double(*)[3])unit, axis, sum);
            unit[i][0] = 0;
            assert_true(fabs(environment->coefficients[i][0] - lobes[l] * sum[0]) < 1e-4);
        }
    }
    render_environment_destroy(environment);

    const double theta = PI * 100.5 / HEIGHT, phi = PI - PI * 77.5 / HEIGHT;
    const double place[3] = { sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi) };
    const double sr = PI / HEIGHT * (cos(PI * 100 / HEIGHT) - cos(PI * 101 / HEIGHT));
    environment = sky_of(HEIGHT, only_pixel, place);
    for (int l = 0; l <= RENDER_HARMONIC_LIMIT; l += 8) {
        for (int i = l * l; i < (l + 1) * (l + 1); i++) {
            double sum[3];
            unit[i][0] = 1;
            render_harmonics_sum(&environment->harmonics, l, (const double(*)[3])unit, place, sum);
            unit[i][0] = 0;
            /* a patch 1/82 wide is its middle but for (l/82)^2/24, of the largest harmonic */
            assert_true(fabs(environment->coefficients[i][0] / sr - sum[0]) <
                        1e-9 + (l / 80.0) * (l / 80.0) / 12 * sqrt((2 * l + 1) / (4 * PI)));
        }
    }
    render_environment_destroy(environment);
    free(unit);
}

/* Oracle: Gauss's rule on each pixel of small maps of noise, of any height, odd ones too, turned: to its
 * error for functions of degree 8, 1e-9. */
static void small_maps_have_the_harmonics_of_their_pixels(void **state)
{
    (void)state;
    enum { POINTS = 24, DEGREE = 8 };
    static const int heights[] = { 1, 2, 3, 5, 6 };
    struct rng rng = { .seed = 8 };
    double(*const unit)[3] = calloc(RENDER_HARMONIC_COUNT, sizeof *unit);
    double points[POINTS], weights[POINTS];
    assert_non_null(unit);
    render_legendre_rule(POINTS, points, weights);
    for (size_t h = 0; h < sizeof heights / sizeof *heights; h++) {
        struct io_image *image;
        assert_true(io_image_create(2 * heights[h], heights[h], 3, &image, NULL));
        for (int i = 0; i < 6 * heights[h] * heights[h]; i++)
            image->pixels[i] = (float)uniform(&rng, 0, 1);
        struct render_environment *const environment = environment_of(image, uniform(&rng, -4, 4));
        const double side_rad = PI / heights[h];
        for (int k = 0; k < 6; k++) {
            const int l = k < 2 ? k : (int)uniform(&rng, 0, DEGREE + 0.999);
            const int index = l * l + (int)uniform(&rng, 0, 2 * l + 0.999);
            double expected[3] = { 0 };
            unit[index][0] = 1;
            for (int i = 0; i < 2 * heights[h] * heights[h] * POINTS * POINTS; i++) {
                const int pixel = i / (POINTS * POINTS), a = i / POINTS % POINTS, b = i % POINTS;
                const double x = pixel % (2 * heights[h]) + 0.5 * (1 + points[a]);
                const double y = pixel / (2 * heights[h]) + 0.5 * (1 + points[b]);
                double direction[3], value[3];
                render_environment_direction(environment, x, y, direction);
                render_harmonics_sum(&environment->harmonics, DEGREE, (const double(*)[3])unit, direction,
                                     value);
                for (int c = 0; c < 3; c++)
                    expected[c] += 0.25 * weights[a] * weights[b] * side_rad * side_rad *
                                   sin(side_rad * y) * value[0] * (double)image->pixels[3 * pixel + c];
            }
            unit[index][0] = 0;
            for (int c = 0; c < 3; c++)
                assert_true(fabs(environment->coefficients[index][c] - expected[c]) < 1e-9);
        }
        render_environment_destroy(environment);
        io_image_destroy(image);
    }
    free(unit);
}

/* ---- the kernel --------------------------------------------------------------------------------- */

static double legendre(int l, double x)
{
    double p = 1, before = 0;
    for (int k = 0; k < l; k++) {
        const double next = ((2 * k + 1) * x * p - k * before) / (k + 1);
        before = p;
        p = next;
    }
    return p;
}

/* The same integral by the tanh-sinh rule, which minds no root at an end; the range begins at total
 * reflection. */
static double transfer_by_tanh_sinh(double eta, int l)
{
    const double least = eta < 1 ? sqrt(1 - eta * eta) : 0, step = 1.0 / 512;
    double sum = 0;
    for (int i = -2200; i <= 2200; i++) {
        const double t = step * i, u = 0.5 * PI * sinh(t);
        const double from_low = 1 / (1 + exp(-2 * u)); /* 0 to 1 without cancellation at 0 */
        const double weight = step * 0.25 * PI * cosh(t) / (cosh(u) * cosh(u));
        const double mu = least + (1 - least) * from_low;
        if (weight > 0 && mu < 1)
            sum += weight * 2 * (1 - dipole_fresnel_reflectance(eta, mu)) * mu * legendre(l, mu) * 0.5;
    }
    return 2 * PI * (1 - least) * 2 * sum * 0.5;
}

/* Oracle: at eta = 1 the clamped cosine's closed forms; else another quadrature, to 1e-10 of the first; and
 * transfer[0] is pi T_out, T_out as dipole_fdt_outside has it. */
static void zonal_coefficients_are_exact(void **state)
{
    (void)state;
    const double etas[] = { 0.5, 0.8, 0.99, 1.0001, 1.01, 1.3, 1.5, 2.5 };
    const double closed[] = { PI, 2 * PI / 3, PI / 4, 0, -PI / 24, 0, PI / 64 };
    struct render_kernel kernel;
    render_kernel_init(1, &kernel);
    for (int l = 0; l < 7; l++)
        assert_true(fabs(kernel.transfer[l] - closed[l]) < 1e-13);
    assert_close(kernel.square, 2 * PI / 3, 1e-13, "square");
    for (size_t e = 0; e < sizeof etas / sizeof *etas; e++) {
        render_kernel_init(etas[e], &kernel);
        assert_close(kernel.transfer[0], PI * dipole_fdt_outside(etas[e]), 1e-10, "eta %g", etas[e]);
        for (int l = 0; l <= RENDER_HARMONIC_LIMIT; l += l < 4 ? 1 : 12)
            assert_true(fabs(kernel.transfer[l] - transfer_by_tanh_sinh(etas[e], l)) <
                        1e-10 * kernel.transfer[0]);
    }
}

/* ---- irradiance --------------------------------------------------------------------------------- */

static struct render_irradiance *irradiance_of(const struct render_environment *environment, double eta,
                                               double epsilon)
{
    struct render_irradiance *irradiance;
    assert_true(render_irradiance_create(environment, eta, epsilon, &irradiance, NULL));
    return irradiance;
}

/* Oracle: all light from all around enters alike, pi T_out L, and needs no order above 0. */
static void a_constant_map_needs_order_0(void **state)
{
    (void)state;
    const double level = 0.7;
    struct render_environment *const environment = sky_of(16, constant_sky, &level);
    struct render_irradiance *const irradiance = irradiance_of(environment, 1.4, 1e-6);
    const double normal[3] = { 0, 0.6, 0.8 };
    double rgb[3];
    render_irradiance_at(irradiance, normal, rgb);
    assert_int_equal(irradiance->order, 0);
    assert_close(rgb[2], PI * dipole_fdt_outside(1.4) * (double)0.7F, 1e-9, "irradiance");
    render_irradiance_destroy(irradiance);
    render_environment_destroy(environment);
}

/* Oracle: the map itself, summed against the kernel. Root mean square over normals, the harmonics err by
 * what they say, as far as 300 normals can tell, nowhere by more than ten times that, and are never below
 * 0; the table of the reference errs by less than its documentation says. The turned map gives to the
 * turned normal what the map gave to it. */
static void harmonics_keep_to_their_error(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    for (int p = 0; p < PROBES; p++) {
        struct render_environment *const environment = probe(probe_names[p]);
        struct render_exact_irradiance *exact;
        assert_true(render_exact_irradiance_create(environment, 1.5, 0, &exact, NULL));
        for (double epsilon = 0.1; epsilon > 5e-4; epsilon *= 0.1) {
            struct render_irradiance *const irradiance = irradiance_of(environment, 1.5, epsilon);
            assert_true(irradiance->order == RENDER_HARMONIC_LIMIT || irradiance->error <= epsilon);
            double table2[3] = { 0 }, error2[3] = { 0 };
            for (int i = 0; i < 300; i++) {
                double normal[3], sum[3], table[3], rgb[3];
                random_direction(&rng, normal);
                render_exact_irradiance_sum(exact, normal, sum);
                render_exact_irradiance_at(exact, normal, table);
                render_irradiance_at(irradiance, normal, rgb);
                for (int c = 0; c < 3; c++) {
                    /* 1e-4: 2 x 2 points to a pixel of 2.8 degrees */
                    assert_true(fabs(rgb[c] - sum[c]) <=
                                10 * (irradiance->error + 1e-4) * irradiance->mean[c]);
                    error2[c] += (rgb[c] - sum[c]) * (rgb[c] - sum[c]) / 300;
                    assert_true(fabs(table[c] - sum[c]) <= 1e-3 * irradiance->mean[c]);
                    table2[c] += (table[c] - sum[c]) * (table[c] - sum[c]) / 300;
                    assert_true(rgb[c] >= 0);
                }
            }
            for (int c = 0; c < 3; c++) {
                assert_true(sqrt(table2[c]) < 1e-4 * irradiance->mean[c]);
                assert_true(sqrt(error2[c]) <= (1.3 * irradiance->error + 1e-4) * irradiance->mean[c]);
            }
            render_irradiance_destroy(irradiance);
        }
        render_exact_irradiance_destroy(exact);
        render_environment_destroy(environment);
    }
}

/* A sky of 1 but for one pixel. */
static struct render_environment *hot_sky(int height_px, float hot)
{
    struct io_image *image;
    assert_true(io_image_create(2 * height_px, height_px, 1, &image, NULL));
    for (int i = 0; i < 2 * height_px * height_px; i++)
        image->pixels[i] = 1;
    image->pixels[2 * height_px * (height_px / 3) + height_px / 2] = hot;
    struct render_environment *const environment = environment_of(image, 0);
    io_image_destroy(image);
    return environment;
}

/* Oracle: closed form, a sky of 1 and a lamp of no size: one pixel a million times as bright, which is
 * nearly all of the light. Its harmonics do not fall, and still E errs by no more than is asked at some
 * order, as the bound of all higher ones says; it is nowhere below 0, and dark where the lamp has set. */
static void a_hot_pixel_does_not_ring(void **state)
{
    (void)state;
    enum { HEIGHT = 256, ROW = HEIGHT / 3 };
    const double epsilon = 1e-3, eta = 1.5;
    const double sr = PI / HEIGHT * (cos(PI * ROW / HEIGHT) - cos(PI * (ROW + 1) / HEIGHT));
    struct rng rng = { .seed = 6 };
    struct render_environment *const environment = hot_sky(HEIGHT, 1e6F);
    struct render_irradiance *const irradiance = irradiance_of(environment, eta, epsilon);
    double error2 = 0, lamp[3];
    assert_true(irradiance->order < RENDER_HARMONIC_LIMIT && irradiance->error <= epsilon);
    render_environment_direction(environment, HEIGHT / 2 + 0.5, ROW + 0.5, lamp);
    for (int i = 0; i < 2000; i++) {
        double normal[3], rgb[3];
        random_direction(&rng, normal);
        const double mu = render_dot(normal, lamp);
        const double transmitted = mu > 0 ? 1 - dipole_fresnel_reflectance(eta, mu) : 0;
        const double expected = PI * dipole_fdt_outside(eta) + (1e6 - 1) * sr * transmitted * fmax(mu, 0);
        render_irradiance_at(irradiance, normal, rgb);
        const double error = (rgb[1] - expected) / irradiance->mean[1];
        error2 += error * error / 2000;
        assert_true(rgb[1] >= 0);
        assert_true(fabs(error) < (mu < -0.1 ? 3 : 10) * epsilon);
    }
    assert_true(sqrt(error2) < 1.3 * epsilon); /* 2000 normals, and a pixel that is 0.7 degrees wide */
    render_irradiance_destroy(irradiance);
    render_environment_destroy(environment);
}

/* Oracle: by hand. The largest map there may be and the smallest. One in a thousand of the first's light is
 * in one pixel; of two pixels, the halves of the sky left and right, both light what faces up alike. */
static void maps_may_be_large_and_small(void **state)
{
    (void)state;
    enum { HEIGHT = RENDER_ENVIRONMENT_SIDE_LIMIT / 2, ROW = HEIGHT / 3 };
    const double sr = 2 * PI / (2 * HEIGHT) * (cos(PI * ROW / HEIGHT) - cos(PI * (ROW + 1) / HEIGHT));
    struct render_environment *environment = hot_sky(HEIGHT, (float)(1e-3 * 4 * PI / sr));
    assert_close(environment->mean[0], 1 + 1e-3, 1e-6, "mean"); /* of floats */
    struct render_irradiance *irradiance = irradiance_of(environment, 1.3, 1e-3);
    assert_true(irradiance->order > 0 && irradiance->order < RENDER_HARMONIC_LIMIT);
    render_irradiance_destroy(irradiance);
    render_environment_destroy(environment);

    struct io_image *image;
    double rgb[3], left[3], right[3];
    assert_true(io_image_create(2, 1, 1, &image, NULL));
    image->pixels[0] = 1;
    image->pixels[1] = 3;
    environment = environment_of(image, 0);
    irradiance = irradiance_of(environment, 1.3, 1e-3);
    render_irradiance_at(irradiance, (const double[3]){ 0, 1, 0 }, rgb);
    render_irradiance_at(irradiance, (const double[3]){ 1, 0, 0 }, left);
    render_irradiance_at(irradiance, (const double[3]){ -1, 0, 0 }, right);
    assert_close(rgb[0], 2 * PI * dipole_fdt_outside(1.3), 1e-6, "above");
    assert_close(left[0], PI * dipole_fdt_outside(1.3), 2e-2, "left"); /* +x, where the map is 1 */
    assert_close(right[0], 3 * PI * dipole_fdt_outside(1.3), 2e-2, "right");
    render_irradiance_destroy(irradiance);
    render_environment_destroy(environment);
    io_image_destroy(image);
}

/* Oracle: turning the map about y turns E with it; to rounding. */
static void irradiance_turns_with_the_map(void **state)
{
    (void)state;
    const double turn = 0.7;
    struct rng rng = { .seed = 4 };
    struct io_image *image;
    assert_true(io_exr_read(SOURCE_FOLDER "/scenes/probes/studio.exr", &image, NULL));
    struct render_environment *const still = environment_of(image, 0), *const turned =
                                                                           environment_of(image, turn);
    struct render_irradiance *const a = irradiance_of(still, 1.3, 1e-3), *const b = irradiance_of(
                                                                             turned, 1.3, 1e-3);
    assert_int_equal(a->order, b->order);
    for (int i = 0; i < 100; i++) {
        double normal[3], there[3], rgb[3];
        random_direction(&rng, normal);
        const double moved[3] = { cos(turn) * normal[0] + sin(turn) * normal[2], normal[1],
                                  cos(turn) * normal[2] - sin(turn) * normal[0] };
        render_irradiance_at(a, normal, rgb);
        render_irradiance_at(b, moved, there);
        for (int c = 0; c < 3; c++)
            assert_close(there[c], rgb[c], 1e-11, "turned");
    }
    render_irradiance_destroy(a);
    render_irradiance_destroy(b);
    render_environment_destroy(still);
    render_environment_destroy(turned);
    io_image_destroy(image);
}

/* ---- samples ------------------------------------------------------------------------------------ */

static struct render_light_samples sample_mesh(const struct render_irradiance *irradiance,
                                               const struct io_mesh *mesh, double spacing_mm,
                                               const struct render_visibility *visibility)
{
    const double min_mm[3] = { (double)mesh->min[0], (double)mesh->min[1], (double)mesh->min[2] };
    struct render_light_samples samples = { 0 };
    struct render_irradiance_table *table;
    struct render_patches *patches;
    assert_true(render_irradiance_table_create(irradiance, 1e-6, &table, NULL));
    assert_true(render_patches_create(table, min_mm, spacing_mm, &patches, NULL) &&
                render_patches_add_mesh(patches, mesh, NULL) &&
                render_patches_finish(patches, 0, visibility, &samples, NULL));
    render_patches_destroy(patches);
    render_irradiance_table_destroy(table);
    return samples;
}

/* Oracle: all flux that enters a sphere is 4 pi R^2 times the mean irradiance, pi T_out times the mean
 * radiance, whatever the map; a cube's the sum over its six faces. Samples are no wider than the spacing
 * along any axis, whether triangles are larger or smaller than that, and cover the surface. */
static void samples_carry_all_flux(void **state)
{
    (void)state;
    const double radius_mm = 10, eta = 1.3;
    const struct io_material material = skin1();
    for (int p = 0; p < PROBES; p++) {
        struct render_environment *const environment = probe(probe_names[p]);
        struct render_irradiance *const irradiance = irradiance_of(environment, eta, 1e-3);
        for (int coarse = 0; coarse < 2; coarse++) {
            const double spacing_mm = coarse ? 3 : 0.4;
            struct test_scene test;
            scene_init(&test, 0);
            assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 128, radius_mm, 0, &material) &&
                        scene_add(&test, IO_PRIMITIVE_CUBE, 4, radius_mm, 0, &material));
            for (int object = 0; object < 2; object++) {
                struct render_light_samples samples =
                    sample_mesh(irradiance, test.objects[object].mesh, spacing_mm, NULL);
                double found_w[3] = { 0 }, expected_w[3] = { 0 };
                for (size_t i = 0; i < samples.count; i++) {
                    for (int c = 0; c < 3; c++)
                        found_w[c] += (double)samples.samples[i].flux_w[c];
                    /* each axis within the spacing; the footprint is a diagonal */
                    assert_true((double)samples.samples[i].footprint_mm <= sqrt(3) * spacing_mm);
                }
                for (int c = 0; c < 3; c++)
                    expected_w[c] = 4 * PI * radius_mm * radius_mm * irradiance->mean[c];
                const double side_mm = 2 * (double)test.objects[1].mesh->max[0];
                for (int face = 0; face < 6 && object == 1; face++) {
                    double normal[3] = { 0, 0, 0 }, rgb[3];
                    normal[face / 2] = face % 2 ? -1 : 1;
                    render_irradiance_at(irradiance, normal, rgb);
                    for (int c = 0; c < 3; c++)
                        expected_w[c] = (face > 0 ? expected_w[c] : 0) + side_mm * side_mm * rgb[c];
                }
                for (int c = 0; c < 3; c++) /* the sphere has 128 segments, and floats carry the flux */
                    assert_close(found_w[c], expected_w[c], object == 0 ? 1.2e-3 : 1e-5,
                                 "%s object %d spacing %g", probe_names[p], object, spacing_mm);
                render_light_samples_destroy(&samples);
            }
            scene_end(&test);
        }
        render_irradiance_destroy(irradiance);
        render_environment_destroy(environment);
    }
}

/* ---- visibility --------------------------------------------------------------------------------- */

/* Oracle: nothing hides the sky from a convex body, so each share is 1 to the last bit. On a plane at the
 * foot of an endless wall, half of a uniform sky is seen: here a slab against a tall one, a fiftieth as far
 * away as it is wide; and rays are the same in every run. */
static void rays_see_what_is_not_hidden(void **state)
{
    (void)state;
    const double level = 1;
    const struct io_material material = skin1();
    struct render_environment *const environment = sky_of(8, constant_sky, &level);
    struct test_scene test;
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 32, 5, 0, &material));
    struct render_tracer *tracer;
    struct render_visibility *visibility;
    struct rng rng = { .seed = 9 };
    assert_true(render_tracer_create(&test.scene, &tracer, NULL) &&
                render_visibility_create(tracer, environment, 1.3, 64, &visibility, NULL));
    for (int i = 0; i < 200; i++) {
        struct render_surface_point point;
        double share[3];
        const double weights[3] = { 0.2, 0.3, 0.5 };
        render_triangle_point(test.objects[0].mesh, (size_t)i, weights, &point);
        render_visibility_share(visibility, point.position_mm, point.normal, point.facet_normal,
                                random_bits(&rng), share);
        assert_true(share[0] == 1 && share[1] == 1 && share[2] == 1);
    }
    render_visibility_destroy(visibility);
    render_tracer_destroy(tracer);
    scene_end(&test);

    /* the wall is the face x = 100 of a cube, seen from a place just before its middle */
    scene_init(&test, 0);
    assert_true(scene_add(&test, IO_PRIMITIVE_CUBE, 4, 1000, -1000, &material));
    const double wall_mm = (double)test.objects[0].mesh->max[0];
    const double at_mm[3] = { wall_mm + 1, 0, 0 }, up[3] = { 0, 1, 0 };
    double first[3], again[3];
    assert_true(render_tracer_create(&test.scene, &tracer, NULL) &&
                render_visibility_create(tracer, environment, 1.3, 1024, &visibility, NULL));
    render_visibility_share(visibility, at_mm, up, up, 7, first);
    render_visibility_share(visibility, at_mm, up, up, 7, again);
    assert_close(first[0], 0.5, 0.02, "half of the sky"); /* 1024 rays, stratified around */
    assert_memory_equal(first, again, sizeof first);
    render_visibility_destroy(visibility);
    render_tracer_destroy(tracer);
    scene_end(&test);
    render_environment_destroy(environment);
}

/* ---- files -------------------------------------------------------------------------------------- */

static void expect_refused(const char *path, const char *message)
{
    struct io_environment source = { .rgb = { 1, 1, 1 } };
    struct render_environment *environment = NULL;
    dipole_status status = { 0 };
    snprintf(source.path, sizeof source.path, "%s", path);
    assert_false(render_environment_read(&source, &environment, &status));
    assert_null(environment);
    if (!strstr(status.message, message))
        fail_msg("\"%s\" does not say \"%s\"", status.message, message);
    assert_string_equal(status.source, path);
}

static void write_map(const char *path, int width_px, int height_px, float value, float first)
{
    struct io_image *image;
    dipole_status status;
    assert_true(io_image_create(width_px, height_px, 3, &image, NULL));
    for (int i = 0; i < 3 * width_px * height_px; i++)
        image->pixels[i] = i == 0 ? first : value;
    if (!io_exr_write(path, image, false, &status))
        fail_msg("%s", status.message);
    io_image_destroy(image);
}

/* Oracle: what is wrong is said, and with which file. */
static void bad_maps_are_refused(void **state)
{
    (void)state;
    write_map("one.exr", 1, 1, 1, 1);
    expect_refused("one.exr",
                   "the map is 1x1 pixels, expected latitude and longitude: twice as wide as high");
    write_map("huge.exr", 8200, 4100, 0, 0);
    expect_refused("huge.exr", "the map is 8200x4100 pixels, expected at most 8192x4096");
    write_map("nan.exr", 8, 4, 1, NAN);
    expect_refused("nan.exr", "the map holds nan in pixel (0, 0), expected finite radiance");
    write_map("infinite.exr", 8, 4, 1, INFINITY);
    expect_refused("infinite.exr", "the map holds inf in pixel (0, 0), expected finite radiance");
    write_map("minus.exr", 8, 4, 1, -INFINITY);
    expect_refused("minus.exr", "the map holds -inf in pixel (0, 0), expected finite radiance");
    write_map("bright.exr", 8, 4, 1, 1e31F);
    expect_refused("bright.exr",
                   "the map's radiance, scaled, is 1e+31 in pixel (0, 0), expected at most 1e+30");
    write_map("negative.exr", 8, 4, 1, -100);
    expect_refused("negative.exr", "of the map's light is negative, expected at most 0.01");
    assert_int_equal(truncate("nan.exr", 150), 0);
    expect_refused("nan.exr", "");
    FILE *const file = fopen("text.hdr", "w");
    assert_non_null(file);
    fputs("#?RADIANCE\n", file);
    fclose(file);
    expect_refused("text.hdr", "cannot be read as an image");
    expect_refused("absent.exr", "");
}

/* Oracle: the map without its small negatives; black is black. */
static void small_negatives_are_black(void **state)
{
    (void)state;
    struct io_environment source = { .path = "dim.exr", .rgb = { 1, 2, 0 } };
    struct render_environment *environment;
    write_map("dim.exr", 8, 4, 1, -0.01F);
    assert_true(render_environment_read(&source, &environment, NULL));
    assert_true(environment->radiance[0] == 0 && environment->radiance[1] == 2);
    assert_true(render_environment_shines(environment));
    render_environment_destroy(environment);
    write_map("black.exr", 8, 4, 0, 0);
    strcpy(source.path, "black.exr");
    assert_true(render_environment_read(&source, &environment, NULL));
    assert_false(render_environment_shines(environment));
    render_environment_destroy(environment);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(harmonics_are_orthonormal),
        cmocka_unit_test(maps_have_the_harmonics_of_closed_forms),
        cmocka_unit_test(small_maps_have_the_harmonics_of_their_pixels),
        cmocka_unit_test(zonal_coefficients_are_exact),
        cmocka_unit_test(a_constant_map_needs_order_0),
        cmocka_unit_test(harmonics_keep_to_their_error),
        cmocka_unit_test(a_hot_pixel_does_not_ring),
        cmocka_unit_test(maps_may_be_large_and_small),
        cmocka_unit_test(irradiance_turns_with_the_map),
        cmocka_unit_test(samples_carry_all_flux),
        cmocka_unit_test(rays_see_what_is_not_hidden),
        cmocka_unit_test(bad_maps_are_refused),
        cmocka_unit_test(small_negatives_are_black),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
