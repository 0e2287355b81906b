/* renderer/light_picture.c: triangles that parallel light sees, drawn in memory. */
#include "check.h"

#include "renderer/light_picture.h"

#include <stdlib.h>
#include <string.h>

enum { SIDE = 48, TEXELS = SIDE * SIDE };

#define HALF_MM 6.0
#define TEXEL_MM (2 * HALF_MM / SIDE)

/* Along some direction, from outside of a cube 2 HALF_MM wide about the origin. */
static struct render_projection view_along(const double forward[3])
{
    const double up[3] = { 0, 1, 0 };
    struct render_projection view = {
        .is_orthographic = true, .half_width = HALF_MM, .half_height = HALF_MM, .near_mm = 1, .far_mm = 60
    };
    for (int k = 0; k < 3; k++)
        view.eye_mm[k] = -30 * forward[k];
    render_projection_aim(&view, forward, up);
    return view;
}

static void draw(const struct render_light_mesh *meshes, size_t mesh_count,
                 const struct render_projection *view, int thread_count, float *texels, float *objects)
{
    const struct render_light_picture picture = { .meshes = meshes,
                                                  .mesh_count = mesh_count,
                                                  .projection = view,
                                                  .size_px = SIDE,
                                                  .texel_area_mm2 = TEXEL_MM * TEXEL_MM,
                                                  .thread_count = thread_count };
    dipole_status status;
    if (!render_light_picture_draw(&picture, texels, objects, &status))
        fail_msg("%s", status.message);
}

static void random_direction(struct rng *rng, double direction[3])
{
    double length2;
    do {
        for (int k = 0; k < 3; k++)
            direction[k] = uniform(rng, -1, 1);
        length2 = render_dot(direction, direction);
    } while (length2 < 0.01 || length2 > 1);
    for (int k = 0; k < 3; k++)
        direction[k] /= sqrt(length2);
}

/* ---- triangles against rays --------------------------------------------------------------------- */

enum { TRIANGLES = 24 };

struct soup {
    struct io_mesh mesh;
    float positions[9 * TRIANGLES], normals[9 * TRIANGLES];
    uint32_t indices[3 * TRIANGLES];
};

static void fill_soup(struct rng *rng, struct soup *soup)
{
    for (int t = 0; t < TRIANGLES; t++) {
        double middle[3];
        for (int k = 0; k < 3; k++)
            middle[k] = uniform(rng, -2.5, 2.5);
        for (int i = 3 * t; i < 3 * t + 3; i++) {
            double normal[3];
            random_direction(rng, normal);
            soup->indices[i] = (uint32_t)i;
            for (int k = 0; k < 3; k++) {
                soup->positions[3 * i + k] = (float)(middle[k] + uniform(rng, -1, 1));
                soup->normals[3 * i + k] = (float)normal[k];
            }
        }
    }
    soup->mesh = (struct io_mesh){ .vertex_count = 3 * TRIANGLES,
                                   .triangle_count = TRIANGLES,
                                   .positions = soup->positions,
                                   .normals = soup->normals,
                                   .indices = soup->indices };
}

/* The middle of a texel, as weights of a triangle's corners in the view's plane; 0 area: false. */
static bool weights_at(const struct render_projection *view, const struct soup *soup, int triangle,
                       const double at_mm[2], double weights[3], double *area_mm2)
{
    double corners[3][3];
    for (int i = 0; i < 3; i++) {
        const float *const p = &soup->positions[9 * triangle + 3 * i];
        const double position_mm[3] = { (double)p[0], (double)p[1], (double)p[2] };
        render_projection_to_view(view, position_mm, corners[i]);
    }
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        const double *const a = corners[(i + 1) % 3], *const b = corners[(i + 2) % 3];
        weights[i] = (b[0] - a[0]) * (at_mm[1] - a[1]) - (b[1] - a[1]) * (at_mm[0] - a[0]);
        sum += weights[i];
    }
    for (int i = 0; i < 3; i++)
        weights[i] /= sum;
    *area_mm2 = 0.5 * sum;
    return fabs(sum) > 1e-3;
}

/* Oracle: each texel's ray against all triangles, in double; the share by dipole_fresnel_reflectance.
 * Corners are moved by up to 1/512 of a texel along x and y: a point by as much, along the light by more
 * the steeper it is (at most by 20 texels' width here, of 0.01 times a corner's weight); texels whose rays
 * pass so near to an edge, or two surfaces so near to each other, are left out. */
static void texels_show_what_rays_hit(void **state)
{
    (void)state;
    struct rng rng = { .seed = 17 };
    static float texels[4 * TEXELS], objects[TEXELS];
    int compared = 0;
    for (int round = 0; round < 20; round++) {
        struct soup soups[2];
        double forward[3];
        random_direction(&rng, forward);
        const struct render_projection view = view_along(forward);
        fill_soup(&rng, &soups[0]);
        fill_soup(&rng, &soups[1]);
        const struct render_light_mesh meshes[2] = { { .mesh = &soups[0].mesh, .eta = 1.4 },
                                                     { .mesh = &soups[1].mesh, .eta = 0.8 } };
        draw(meshes, 2, &view, 0, texels, objects);
        for (int i = 0; i < TEXELS; i++) {
            const double at_mm[2] = { (i % SIDE + 0.5) * TEXEL_MM - HALF_MM,
                                      (i / SIDE + 0.5) * TEXEL_MM - HALF_MM };
            double nearest_mm = INFINITY, next_mm = INFINITY, position_mm[3] = { 0, 0, 0 }, share = 0;
            bool is_clear = true;
            int object = 0;
            for (int t = 0; t < 2 * TRIANGLES; t++) {
                const struct soup *const soup = &soups[t / TRIANGLES];
                double w[3], area_mm2, p[3] = { 0, 0, 0 }, n[3] = { 0, 0, 0 }, in_view[3];
                if (!weights_at(&view, soup, t % TRIANGLES, at_mm, w, &area_mm2)) {
                    is_clear = false;
                    continue;
                }
                const double least = fmin(w[0], fmin(w[1], w[2]));
                is_clear &= fabs(least) * sqrt(fabs(area_mm2)) > 0.02;
                if (least < 0)
                    continue;
                for (int k = 0; k < 9; k++) {
                    p[k % 3] += w[k / 3] * (double)soup->positions[9 * (t % TRIANGLES) + k];
                    n[k % 3] += w[k / 3] * (double)soup->normals[9 * (t % TRIANGLES) + k];
                }
                render_projection_to_view(&view, p, in_view);
                next_mm = fmin(next_mm, fmax(nearest_mm, in_view[2]));
                if (in_view[2] >= nearest_mm)
                    continue;
                nearest_mm = in_view[2];
                object = 1 + t / TRIANGLES;
                memcpy(position_mm, p, sizeof p);
                const double cosine = -render_dot(n, forward) / sqrt(render_dot(n, n));
                share = area_mm2 < 0 ? 0
                                     : TEXEL_MM * TEXEL_MM *
                                           (1 - dipole_fresnel_reflectance(meshes[object - 1].eta,
                                                                           fmin(fmax(cosine, 0), 1)));
            }
            if (!is_clear || next_mm - nearest_mm < 0.1)
                continue;
            compared++;
            assert_int_equal((int)objects[i], object);
            for (int k = 0; k < 3 && object > 0; k++)
                assert_true(fabs((double)texels[4 * i + k] - position_mm[k]) < 0.1);
            /* Shares change by most where light grazes. */
            assert_true(fabs((double)texels[4 * i + 3] - share) < 0.15 * TEXEL_MM * TEXEL_MM);
        }
    }
    assert_true(compared > 20 * TEXELS / 10);
}

/* ---- closed surfaces ---------------------------------------------------------------------------- */

static struct io_mesh *make_primitive(enum io_primitive primitive, int detail, float scale)
{
    struct io_mesh *mesh;
    assert_true(io_mesh_create_primitive(primitive, detail, &mesh, NULL));
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        mesh->positions[i] *= scale;
    return mesh;
}

/* Oracle: a sphere lit from one side; its picture is the disc, without gaps, and what enters is
 * pi r^2 (1 - F) averaged over the disc, 2 int (1 - F) mu dmu. 48 texels across make the disc's area, and
 * 96 segments the sphere's, exact to about 1 %. */
static void a_sphere_is_a_disc(void **state)
{
    (void)state;
    struct io_mesh *const mesh = make_primitive(IO_PRIMITIVE_SPHERE, 96, 5);
    const struct render_light_mesh of = { .mesh = mesh, .eta = 1.5, .has_hidden_inside = true };
    static float texels[4 * TEXELS];
    const double pi = 3.14159265358979323846, expected = pi * 25 * dipole_fdt_outside(1.5);
    struct rng rng = { .seed = 3 };
    for (int round = 0; round < 10; round++) {
        double forward[3], sum = 0;
        random_direction(&rng, forward);
        const struct render_projection view = view_along(forward);
        draw(&of, 1, &view, 0, texels, NULL);
        for (int i = 0; i < TEXELS; i++) {
            const double x_mm = (i % SIDE + 0.5) * TEXEL_MM - HALF_MM,
                         y_mm = (i / SIDE + 0.5) * TEXEL_MM - HALF_MM;
            sum += (double)texels[4 * i + 3];
            if (hypot(x_mm, y_mm) < 4.9)
                assert_true(texels[4 * i + 3] > 0);
            if (hypot(x_mm, y_mm) > 5.01)
                assert_true(texels[4 * i + 3] == 0 && texels[4 * i] == 0);
        }
        assert_close(sum, expected, 0.015, "round %d", round);
    }
    io_mesh_destroy(mesh);
}

/* Oracle: what is seen from behind lies behind what is seen from the front, for a solid: the same texels to
 * the last bit whether it is drawn or not. And as many threads as may be change none. */
static void insides_and_threads_change_nothing(void **state)
{
    (void)state;
    struct io_mesh *const mesh = make_primitive(IO_PRIMITIVE_KNOT, 128, 3);
    struct render_light_mesh of = { .mesh = mesh, .eta = 1.3, .has_hidden_inside = true };
    static float texels[4 * TEXELS], others[4 * TEXELS], objects[TEXELS];
    struct rng rng = { .seed = 9 };
    for (int round = 0; round < 10; round++) {
        double forward[3];
        random_direction(&rng, forward);
        const struct render_projection view = view_along(forward);
        of.has_hidden_inside = true;
        draw(&of, 1, &view, 1, texels, NULL);
        draw(&of, 1, &view, 5, others, objects);
        assert_memory_equal(texels, others, sizeof texels);
        of.has_hidden_inside = false;
        draw(&of, 1, &view, 3, others, NULL);
        int different = 0;
        for (int i = 0; i < TEXELS; i++) {
            for (int k = 0; k < 4; k++)
                different += texels[4 * i + k] != others[4 * i + k];
            assert_true((objects[i] == 1) == (texels[4 * i + 3] > 0) || texels[4 * i + 3] == 0);
        }
        /* At the outline both sides are as near, to the last bits. */
        assert_true(different < TEXELS / 100);
    }
    io_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_show_what_rays_hit),
        cmocka_unit_test(a_sphere_is_a_disc),
        cmocka_unit_test(insides_and_threads_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
