/* Energy: no more light leaves than enters, and light from all sides shows no side. */
#include "check.h"
#include "scenes.h"

#include "renderer/renderer.h"

static const double PI = 3.14159265358979323846;

/* ---- materials ---------------------------------------------------------------------------------- */

static struct io_material half_space(const char *name, dipole_model model, double free_path_mm,
                                     double albedo, double eta)
{
    struct io_material material = { .name = "" };
    dipole_medium media[3];
    for (int c = 0; c < 3; c++) /* green and blue scatter less far */
        media[c] = (dipole_medium){ .sigma_a_per_mm = (1 - albedo) / free_path_mm * (1 + c),
                                    .sigma_s_prime_per_mm = albedo / free_path_mm * (1 + c),
                                    .eta = eta };
    io_material_set_media(&material, media);
    material.model = model;
    snprintf(material.name, sizeof material.name, "%s", name);
    return material;
}

/* A thin layer that absorbs blue over a base that scatters far. */
static struct io_material layered(dipole_model model)
{
    struct io_material material = { .name = "layered", .model = model, .layer_count = 2 };
    for (int c = 0; c < 3; c++) {
        material.layers[c][0] =
            (dipole_layer){ { .sigma_a_per_mm = 0.02 + 0.2 * c, .sigma_s_prime_per_mm = 4, .eta = 1.4 },
                            0.3 };
        material.layers[c][1] = (dipole_layer){
            { .sigma_a_per_mm = 0.01, .sigma_s_prime_per_mm = 1.5, .eta = 1.4 }, INFINITY
        };
    }
    return material;
}

enum { MATERIAL_COUNT = 8 };

static struct io_material material_of(int index)
{
    switch (index) {
    case 0:
        return half_space("dipole, absorbs almost nothing", DIPOLE_MODEL_DIPOLE, 1.5, 0.99999, 1.5);
    case 1:
        return half_space("dipole, dark", DIPOLE_MODEL_DIPOLE, 1.5, 0.3, 1.3);
    case 2:
        return half_space("better dipole, equal indices", DIPOLE_MODEL_BETTER_DIPOLE, 1.5, 0.98, 1);
    case 3:
        return half_space("beam, absorbs almost nothing", DIPOLE_MODEL_BEAM, 1.5, 0.99999, 1.5);
    case 4:
        return half_space("beam, dark", DIPOLE_MODEL_BEAM, 1.5, 0.5, 1.4);
    case 5:
        return half_space("modes", DIPOLE_MODEL_MODES, 1.5, 0.97, 1.4);
    case 6:
        return layered(DIPOLE_MODEL_BEAM);
    default:
        return marble();
    }
}

/* ---- pictures ----------------------------------------------------------------------------------- */

static struct io_image *draw(struct renderer *renderer, enum render_technique technique, double epsilon)
{
    const struct render_options options = { .technique = technique, .epsilon = epsilon };
    struct io_image *image;
    dipole_status status;
    if (!render_draw(renderer, &options, &image, NULL, &status))
        fail_msg("%s", status.message);
    return image;
}

static struct renderer *renderer_of(const struct test_scene *test)
{
    struct renderer *renderer;
    dipole_status status;
    if (!render_create(&test->scene, RENDER_CONTEXT_DEFAULT, &renderer, &status))
        fail_msg("%s", status.message);
    return renderer;
}

/* Points spread evenly over the sphere. */
static void spread_direction(int index, int count, double out[3])
{
    const double z = 1 - (2 * index + 1.0) / count, turn_rad = index * PI * (3 - sqrt(5));
    out[0] = sqrt(1 - z * z) * cos(turn_rad);
    out[1] = z;
    out[2] = sqrt(1 - z * z) * sin(turn_rad);
}

/* Look at the origin from that direction, orthographically. */
static void look_from(struct io_scene *scene, const double direction[3], double width_mm, int size_px)
{
    scene->camera = (struct io_camera){ .is_orthographic = true,
                                        .up = { 0.1, 1, 0.2 },
                                        .height_mm = width_mm,
                                        .width_px = size_px,
                                        .height_px = size_px };
    for (int k = 0; k < 3; k++)
        scene->camera.eye_mm[k] = 10 * width_mm * direction[k];
}

/* ---- no more leaves than enters ----------------------------------------------------------------- */

enum { VIEW_COUNT = 16, VIEW_PX = 40 };

/* Power that leaves toward infinity: pictures from all around, integrated over their area and over all
 * directions. */
static void leaving_w(struct test_scene *test, struct renderer *renderer, enum render_technique technique,
                      double width_mm, double power_w[3])
{
    memset(power_w, 0, 3 * sizeof *power_w);
    const double pixel_mm = width_mm / VIEW_PX;
    for (int v = 0; v < VIEW_COUNT; v++) {
        double direction[3];
        spread_direction(v, VIEW_COUNT, direction);
        look_from(&test->scene, direction, width_mm, VIEW_PX);
        struct io_image *const image = draw(renderer, technique, 0.05);
        for (size_t i = 0; i < VIEW_PX * VIEW_PX; i++) {
            for (size_t c = 0; c < 3; c++)
                power_w[c] +=
                    (double)image->pixels[4 * i + c] * pixel_mm * pixel_mm * 4 * PI / VIEW_COUNT;
        }
        io_image_destroy(image);
    }
}

static void entering_w(struct renderer *renderer, double spacing_mm, double power_w[3])
{
    struct render_capture *captured;
    dipole_status status;
    if (!render_capture_create(renderer, spacing_mm, &captured, &status))
        fail_msg("%s", status.message);
    memset(power_w, 0, 3 * sizeof *power_w);
    for (size_t i = 0; i < captured->samples.count; i++) {
        for (size_t c = 0; c < 3; c++)
            power_w[c] += (double)captured->samples.samples[i].flux_w[c];
    }
    render_capture_destroy(captured);
}

static void no_more_light_leaves_than_enters(void **state)
{
    (void)state;
    static const enum io_primitive shapes[] = { IO_PRIMITIVE_SPHERE, IO_PRIMITIVE_CUBE, IO_PRIMITIVE_KNOT,  IO_PRIMITIVE_SLAB,IO_PRIMITIVE_BOWL };
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        for (int m = 0; m < MATERIAL_COUNT; m++) {
            const struct io_material material = material_of(m);
            struct test_scene test;
            scene_init(&test, 40);
            assert_true(scene_add(&test, shapes[s], 64, 6, 0, &material));
            scene_add_directional(&test, -1, -1.5, -0.7, 3);
            scene_add_point(&test, 12, 3, -9, 200);
            struct renderer *const renderer = renderer_of(&test);
            double in_w[3], out_w[3],lambert[3];
            entering_w(renderer, 0.3, in_w);
            leaving_w(&test, renderer, RENDER_TECHNIQUE_SPLAT, 20, out_w);
            leaving_w(&test, renderer, RENDER_TECHNIQUE_LAMBERT, 20, lambert);
            print_message("  shape %d, %-32s: %.3f %.3f %.3f of the light leaves, lambert %.3f %.3f %.3f, R %.3f %.3f %.3f\n", shapes[s], material.name,
                          out_w[0] / in_w[0], out_w[1] / in_w[1], out_w[2] / in_w[2],
                          lambert[0] / in_w[0], lambert[1] / in_w[1], lambert[2] / in_w[2],
                          renderer->media->media[0].diffuse_reflectance[0], renderer->media->media[0].diffuse_reflectance[1], renderer->media->media[0].diffuse_reflectance[2]);
            render_destroy(renderer);
            scene_end(&test);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_more_light_leaves_than_enters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
