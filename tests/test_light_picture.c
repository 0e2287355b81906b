/* renderer/light_picture.c, light_clip.c: triangles that a light sees, drawn in memory. */
#include "drawing.h"

#include "renderer/frusta.h"
#include "renderer/light_picture.h"
#include "renderer/renderer.h"

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

/* From the origin, to the faces of a cube about it. */
static void views_around(const double eye_mm[3], double near_mm, double far_mm,
                         struct render_projection faces[RENDER_FACES])
{
    const struct render_ball ball = { .centre_mm = { eye_mm[0], eye_mm[1], eye_mm[2] },
                                      .radius_mm = far_mm / 1.001 };
    assert_int_equal(render_frusta_of_point(eye_mm, &ball, 1, 1, faces), RENDER_FACES);
    for (int f = 0; f < RENDER_FACES; f++)
        faces[f].near_mm = near_mm;
}

static double texel_area_of(const struct render_projection *view, int size_px)
{
    return 4 * view->half_width * view->half_height / size_px / size_px;
}

/* All tiles, put together. */
static void draw_picture(const struct render_light_picture *picture, int tile_px, int shift_px,
                         float *texels, float *objects)
{
    struct render_light_tiles *tiles;
    dipole_status status;
    const int size_px = picture->size_px;
    float *const tile = malloc((size_t)(5 * tile_px * tile_px) * sizeof *tile), *const ids =
                                                                                    tile +
                                                                                    4 * tile_px * tile_px;
    assert_non_null(tile);
    if (!render_light_tiles_create(picture, tile_px, shift_px, &tiles, &status))
        fail_msg("%s", status.message);
    memset(texels, 0, (size_t)(4 * size_px * size_px) * sizeof *texels);
    if (objects)
        memset(objects, 0, (size_t)(size_px * size_px) * sizeof *objects);
    for (int y = -shift_px; y < size_px; y += tile_px) {
        for (int x = -shift_px; x < size_px; x += tile_px) {
            const bool is_drawn = render_light_tiles_draw(tiles, x, y, tile, objects ? ids : NULL);
            for (int i = 0; is_drawn && i < tile_px * tile_px; i++) {
                const int at_x = x + i % tile_px, at_y = y + i / tile_px;
                if (at_x < 0 || at_x >= size_px || at_y < 0 || at_y >= size_px) {
                    assert_true(tile[4 * i + 3] == 0);
                    continue;
                }
                memcpy(texels + 4 * (at_y * size_px + at_x), tile + 4 * i, 4 * sizeof *texels);
                if (objects)
                    objects[at_y * size_px + at_x] = ids[i];
            }
        }
    }
    render_light_tiles_destroy(tiles);
    free(tile);
}

static void draw_meshes(const struct render_light_mesh *meshes, size_t mesh_count,
                        const struct render_projection *view, int thread_count, float *texels,
                        float *objects)
{
    const struct render_light_picture picture = { .meshes = meshes,
                                                  .mesh_count = mesh_count,
                                                  .projection = view,
                                                  .size_px = SIDE,
                                                  .texel_area = texel_area_of(view, SIDE),
                                                  .thread_count = thread_count };
    draw_picture(&picture, 8 * thread_count + 5, thread_count, texels, objects);
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

/* What a ray meets first: { x, y, z in mm, power share }, and the number of its mesh; 0: nothing. */
struct hit {
    double position_mm[3], share, depth_mm, next_mm;
    int object, triangle;
};

/* Weights of a triangle's corners where the ray from + t along meets it (Moeller and Trumbore 1997). */
static bool meet(const struct soup *soup, int triangle, const double from[3], const double along[3],
                 double weights[3], double *t, bool *is_front)
{
    double a[3], ab[3], ac[3], p[3], q[3], to_a[3];
    for (int k = 0; k < 3; k++) {
        const float *const at = &soup->positions[9 * triangle + k];
        a[k] = (double)at[0];
        ab[k] = (double)at[3] - a[k];
        ac[k] = (double)at[6] - a[k];
        to_a[k] = from[k] - a[k];
    }
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        p[k] = along[l] * ac[m] - along[m] * ac[l];
        q[k] = to_a[l] * ab[m] - to_a[m] * ab[l];
    }
    const double determinant = render_dot(ab, p);
    weights[1] = render_dot(to_a, p) / determinant;
    weights[2] = render_dot(along, q) / determinant;
    weights[0] = 1 - weights[1] - weights[2];
    *t = render_dot(ac, q) / determinant;
    *is_front = determinant > 0;
    return weights[0] >= 0 && weights[1] >= 0 && weights[2] >= 0;
}

/* Through (x, y) of the picture in texels. */
static struct hit trace(const struct render_projection *view, const struct soup *soups,
                        const struct render_light_mesh *meshes, double x, double y)
{
    struct hit hit = { .depth_mm = INFINITY, .next_mm = INFINITY };
    const double u = view->half_width * (2 * x / SIDE - 1), v = view->half_height * (2 * y / SIDE - 1);
    double from[3], along[3];
    for (int k = 0; k < 3; k++) {
        const double aside = u * view->right[k] + v * view->up[k];
        from[k] = view->eye_mm[k] + (view->is_orthographic ? aside : 0);
        along[k] = view->forward[k] + (view->is_orthographic ? 0 : aside);
    }
    for (int t = 0; t < 2 * TRIANGLES; t++) {
        const struct soup *const soup = &soups[t / TRIANGLES];
        double w[3], depth_mm, p[3] = { 0, 0, 0 }, n[3] = { 0, 0, 0 };
        bool is_front;
        if (!meet(soup, t % TRIANGLES, from, along, w, &depth_mm, &is_front) || depth_mm < view->near_mm)
            continue;
        hit.next_mm = fmin(hit.next_mm, fmax(hit.depth_mm, depth_mm));
        if (depth_mm >= hit.depth_mm)
            continue;
        for (int k = 0; k < 9; k++) {
            p[k % 3] += w[k / 3] * (double)soup->positions[9 * (t % TRIANGLES) + k];
            n[k % 3] += w[k / 3] * (double)soup->normals[9 * (t % TRIANGLES) + k];
        }
        hit.depth_mm = depth_mm;
        hit.object = 1 + t / TRIANGLES;
        hit.triangle = t;
        memcpy(hit.position_mm, p, sizeof p);
        const double length = sqrt(render_dot(along, along));
        const double cosine = -render_dot(n, along) / sqrt(render_dot(n, n)) / length;
        const double entering =
            1 - dipole_fresnel_reflectance(meshes[hit.object - 1].eta, fmin(fmax(cosine, 0), 1));
        hit.share = is_front ? texel_area_of(view, SIDE) * entering / pow(length, 3) : 0;
    }
    return hit;
}

/* Compare where rays that pass a fiftieth of a texel beside agree on what they hit, and no second surface
 * is as near as they differ; returns how many texels those are. */
static int compare(const struct render_projection *view, const struct soup *soups,
                   const struct render_light_mesh *meshes, const float *texels, const float *objects)
{
    int compared = 0;
    for (int i = 0; i < TEXELS; i++) {
        const double x = i % SIDE + 0.5, y = i / SIDE + 0.5, aside = 0.02;
        const struct hit hit = trace(view, soups, meshes, x, y);
        double differ_mm = 0, differ_share = 0;
        bool is_clear = true;
        for (int d = 0; d < 4; d++) {
            const struct hit other =
                trace(view, soups, meshes, x + (d % 2 ? aside : -aside), y + (d / 2 ? aside : -aside));
            is_clear &= other.object == hit.object && other.triangle == hit.triangle &&
                        (hit.object == 0 || other.next_mm - other.depth_mm > 0.1);
            differ_share = fmax(differ_share, fabs(other.share - hit.share));
            for (int k = 0; k < 3; k++)
                differ_mm = fmax(differ_mm, fabs(other.position_mm[k] - hit.position_mm[k]));
        }
        if (!is_clear || (hit.object > 0 && hit.depth_mm < 1.01 * view->near_mm))
            continue;
        compared++;
        assert_int_equal((int)objects[i], hit.object);
        for (int k = 0; k < 3 && hit.object > 0; k++)
            assert_true(fabs((double)texels[4 * i + k] - hit.position_mm[k]) < differ_mm + 1e-4);
        assert_true(fabs((double)texels[4 * i + 3] - hit.share) <
                    differ_share + 1e-4 * texel_area_of(view, SIDE));
    }
    return compared;
}

/* Oracle: each texel's ray against all triangles, in double; the share by dipole_fresnel_reflectance, times
 * the area across parallel light, or the solid angle that a point light sees. Corners are moved by up to
 * 1/512 of a texel along x and y; rays that pass by at ten times that bound what it may change. From the
 * middle of the triangles many are cut by the near plane, or reach far beyond the picture. */
static void texels_show_what_rays_hit(void **state)
{
    (void)state;
    struct rng rng = { .seed = 17 };
    static float texels[4 * TEXELS], objects[TEXELS];
    int compared[3] = { 0, 0, 0 };
    for (int round = 0; round < 18; round++) {
        struct soup soups[2];
        struct render_projection views[RENDER_FACES];
        double forward[3];
        size_t view_count = 1;
        random_direction(&rng, forward);
        views[0] = view_along(forward);
        fill_soup(&rng, &soups[0]);
        fill_soup(&rng, &soups[1]);
        if (round % 3 == 1) {
            const struct render_ball ball = { .radius_mm = 6.5 };
            const double eye_mm[3] = { -20 * forward[0], -20 * forward[1], -20 * forward[2] };
            view_count = render_frusta_of_point(eye_mm, &ball, 1, 1, views);
            assert_int_equal(view_count, 1);
        } else if (round % 3 == 2) {
            const double eye_mm[3] = { forward[0], forward[1], forward[2] };
            view_count = RENDER_FACES;
            views_around(eye_mm, log_uniform(&rng, 0.01, 1), 10, views);
        }
        const struct render_light_mesh meshes[2] = { { .mesh = &soups[0].mesh, .eta = 1.4 },
                                                     { .mesh = &soups[1].mesh, .eta = 0.8 } };
        for (size_t v = 0; v < view_count; v++) {
            draw_meshes(meshes, 2, &views[v], round % 4, texels, objects);
            compared[round % 3] += compare(&views[v], soups, meshes, texels, objects);
        }
    }
    print_message("  compared: %d parallel, %d perspective, %d of cubes\n", compared[0], compared[1],
                  compared[2]);
    assert_true(compared[0] > 6 * TEXELS / 2 && compared[1] > 6 * TEXELS / 2);
    assert_true(compared[2] > 36 * TEXELS / 4);
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
        draw_meshes(&of, 1, &view, 0, texels, NULL);
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
        draw_meshes(&of, 1, &view, 1, texels, NULL);
        draw_meshes(&of, 1, &view, 5, others, objects);
        assert_memory_equal(texels, others, sizeof texels);
        of.has_hidden_inside = false;
        draw_meshes(&of, 1, &view, 3, others, NULL);
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

/* ---- all around --------------------------------------------------------------------------------- */

/* Share of what a point light at a_mm from the middle of a hollow ball sends out that enters it: the
 * midpoint rule over the cosine to the axis. */
static double hollow_ball_share(double a_mm, double radius_mm, double eta)
{
    enum { STEPS = 4000 };
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        const double mu = -1 + (i + 0.5) * 2 / STEPS;
        const double sine = a_mm / radius_mm * sqrt(1 - mu * mu);
        sum += 1 - dipole_fresnel_reflectance(eta, sqrt(1 - sine * sine));
    }
    return sum / STEPS;
}

/* Oracle: the closed surface about a light. No ray leaves it, whatever triangles are cut by near planes and
 * by those between the faces of the cube, and all that enters is that of the ball, to what its facets make
 * of it. Coarse balls are of triangles that several faces share. */
static void a_hollow_ball_is_seen_without_holes(void **state)
{
    (void)state;
    const double pi = 3.14159265358979323846, radius_mm = 5, eta = 1.4;
    const struct {
        int detail;
        double at_mm[3], tolerance;
    } rows[] = { { 96, { 0, 0, 0 }, 2e-3 },  { 96, { 1, -2, 1.5 }, 2e-3 },  { 96, { 0, 4.6, 0 }, 0.02 },
                 { 8, { 0.5, 0, 0 }, 0.1 },  { 4, { 0.1, 0.2, 0.3 }, 0.3 }, { 4, { 0, 0, 0 }, 0.3 },
                 { 12, { 1, 3.9, 1 }, 0.1 }, { 96, { 0, -4.95, 0 }, 0.1 } };
    static float texels[4 * TEXELS], objects[TEXELS];
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct io_mesh *const mesh = make_primitive(IO_PRIMITIVE_SPHERE, rows[r].detail, (float)radius_mm);
        for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
            mesh->normals[i] = -mesh->normals[i];
        for (size_t t = 0; t < mesh->triangle_count; t++) {
            const uint32_t swap = mesh->indices[3 * t];
            mesh->indices[3 * t] = mesh->indices[3 * t + 1];
            mesh->indices[3 * t + 1] = swap;
        }
        const struct render_light_mesh of = { .mesh = mesh, .eta = eta };
        struct render_projection faces[RENDER_FACES];
        views_around(rows[r].at_mm, 0.01, 12, faces);
        double sum = 0;
        for (int f = 0; f < RENDER_FACES; f++) {
            draw_meshes(&of, 1, &faces[f], f % 3, texels, objects);
            for (int i = 0; i < TEXELS; i++) {
                assert_true(objects[i] == 1 && texels[4 * i + 3] > 0);
                sum += (double)texels[4 * i + 3];
            }
        }
        const double a_mm = sqrt(render_dot(rows[r].at_mm, rows[r].at_mm));
        assert_close(sum, 4 * pi * hollow_ball_share(a_mm, radius_mm, eta), rows[r].tolerance, "row %zu",
                     r);
        io_mesh_destroy(mesh);
    }
}

/* ---- hard cases --------------------------------------------------------------------------------- */

/* Oracle: what OpenGL leaves out, too: nothing is drawn of triangles without area, behind the light, before
 * the near plane or beside the picture. Coordinates of any size, near the light or far beyond the picture,
 * give finite texels in front of the near plane. */
static void hard_triangles_do_no_harm(void **state)
{
    (void)state;
    struct rng rng = { .seed = 23 };
    static float texels[4 * TEXELS], objects[TEXELS];
    const double origin[3] = { 0, 0, 0 };
    struct render_projection faces[RENDER_FACES];
    size_t seen = 0;
    for (int round = 0; round < 60; round++) {
        struct soup soup;
        fill_soup(&rng, &soup);
        const double scale = log_uniform(&rng, 1e-18, 1e18), near_mm = scale * log_uniform(&rng, 1e-4, 1);
        for (int i = 0; i < 9 * TRIANGLES; i++) {
            const double far_out = i % 4 ? 1 : log_uniform(&rng, 1e-6, 1e6);
            soup.positions[i] = (float)(scale * far_out * (double)soup.positions[i]);
            if (i / 9 % 6 == 0 && i % 9 >= 6) /* no area: two corners are one */
                soup.positions[i] = soup.positions[i - 3];
            if (i / 9 % 6 == 1) /* all the same */
                soup.positions[i] = soup.positions[i / 9 * 9 + i % 3];
        }
        double rounding_mm = 0; /* of floats */
        for (int i = 0; i < 9 * TRIANGLES; i++)
            rounding_mm = fmax(rounding_mm, 1e-6 * fabs((double)soup.positions[i]));
        const struct render_light_mesh of = { .mesh = &soup.mesh, .eta = 1.3 };
        views_around(origin, near_mm, scale * 10, faces);
        for (int f = 0; f < RENDER_FACES; f++) {
            draw_meshes(&of, 1, &faces[f], f % 3, texels, objects);
            for (int i = 0; i < TEXELS; i++) {
                double position_mm[3], in_view_mm[3];
                assert_true(texels[4 * i + 3] >= 0 &&
                            (double)texels[4 * i + 3] <= 1.00001 * texel_area_of(&faces[f], SIDE));
                for (int k = 0; k < 3; k++)
                    position_mm[k] = (double)texels[4 * i + k];
                render_projection_to_view(&faces[f], position_mm, in_view_mm);
                assert_true(objects[i] == 0 || in_view_mm[2] > 0.9 * near_mm - rounding_mm);
                seen += objects[i] == 1;
            }
        }
    }
    assert_true(seen > 60 * TEXELS / 4);
    struct soup behind;
    fill_soup(&rng, &behind);
    for (int i = 2; i < 9 * TRIANGLES; i += 3)
        behind.positions[i] = -1 - fabsf(behind.positions[i]);
    views_around(origin, 0.1, 10, faces);
    const struct render_light_mesh of = { .mesh = &behind.mesh, .eta = 1.3 };
    draw_meshes(&of, 1, &faces[4], 0, texels, objects); /* +z */
    for (int i = 0; i < TEXELS; i++)
        assert_true(objects[i] == 0 && texels[4 * i + 3] == 0);
}

/* ---- whole pictures ----------------------------------------------------------------------------- */

/* Oracle: their tiles, however wide; places at rest are where a linear map takes the surface's. */
static void whole_pictures_are_their_tiles(void **state)
{
    (void)state;
    struct rng rng = { 11 };
    const double origin[3] = { 0, 0, 0 };
    struct soup soups[2];
    float rest_mm[2][9 * TRIANGLES];
    for (int trial = 0; trial < 12; trial++) {
        const int size_px = trial == 0 ? 1 : (int)uniform(&rng, 2, 150);
        const size_t count = (size_t)size_px * (size_t)size_px;
        struct render_light_mesh meshes[2];
        for (int m = 0; m < 2; m++) {
            fill_soup(&rng, &soups[m]);
            for (int i = 0; i < 9 * TRIANGLES; i++)
                rest_mm[m][i] = 2 * soups[m].positions[i] + (float)(i % 3);
            meshes[m] =
                (struct render_light_mesh){ .mesh = &soups[m].mesh, .rest_mm = rest_mm[m], .eta = 1.4 };
        }
        struct render_projection faces[RENDER_FACES];
        double forward[3];
        random_direction(&rng, forward);
        views_around(origin, 0.01, 10, faces);
        const struct render_projection view = trial % 2 == 0 ? view_along(forward) : faces[trial % 6];
        const struct render_light_picture picture = { .meshes = meshes,
                                                      .mesh_count = 2,
                                                      .projection = &view,
                                                      .size_px = size_px,
                                                      .texel_area = texel_area_of(&view, size_px),
                                                      .thread_count = trial % 3 };
        float *const memory = malloc(count * 14 * sizeof *memory);
        assert_non_null(memory);
        float *const texels = memory, *const objects = memory + 4 * count;
        const struct render_light_texels whole = { .texels = memory + 5 * count,
                                                   .objects = memory + 9 * count,
                                                   .rest_mm = memory + 10 * count,
                                                   .empty = { 7, 8, 9, 0 } };
        draw_picture(&picture, 23, trial, texels, objects);
        assert_true(render_light_picture_draw(&picture, &whole, NULL));
        for (size_t i = 0; i < count; i++) {
            const float *const here = whole.texels + 4 * i, *const rest = whole.rest_mm + 4 * i;
            assert_true(whole.objects[i] == objects[i]);
            assert_memory_equal(here, objects[i] > 0 ? texels + 4 * i : whole.empty, 4 * sizeof *here);
            for (int k = 0; k < 3; k++)
                assert_true(fabsf(rest[k] - (objects[i] > 0 ? 2 * here[k] + (float)k : 0)) < 1e-4F);
            assert_true(rest[3] == (objects[i] > 0 ? 1 : 0));
        }
        free(memory);
    }
}

/* ---- OpenGL ------------------------------------------------------------------------------------- */

/* What the last view that OpenGL drew holds, and the same drawn in memory. */
static void compare_with_opengl(const struct renderer *renderer, const struct render_plan *plan,
                                const struct io_scene *scene)
{
    const struct render_plan_view *const view = &plan->views[plan->view_count - 1];
    const size_t count = (size_t)view->size_px * (size_t)view->size_px;
    float *const drawn = malloc(count * 4 * sizeof *drawn), *const texels =
                                                                malloc(count * 4 * sizeof *texels);
    assert_true(drawn && texels);
    glGetTextureSubImage(render_executor_texture(renderer->executor, "light_view"), 0, 0, 0, 0,
                         view->size_px, view->size_px, 1, GL_RGBA, GL_FLOAT,
                         (GLsizei)(count * 4 * sizeof *drawn), drawn);
    const struct render_light_mesh meshes[2] = { { .mesh = scene->objects[0].mesh, .eta = 1.5 },
                                                 { .mesh = scene->objects[1].mesh, .eta = 1.5 } };
    const struct render_light_picture picture = { .meshes = meshes,
                                                  .mesh_count = 2,
                                                  .projection = &view->projection,
                                                  .size_px = view->size_px,
                                                  .texel_area = view->texel_area };
    draw_picture(&picture, 64, 0, texels, NULL);
    size_t lit = 0, differing = 0;
    double flux[2] = { 0, 0 }, far_mm = 0;
    for (size_t i = 0; i < count; i++) {
        const float *const a = drawn + 4 * i, *const b = texels + 4 * i;
        double step2_mm2 = 0;
        for (int k = 0; k < 3; k++)
            step2_mm2 += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
        flux[0] += (double)a[3];
        flux[1] += (double)b[3];
        lit += a[3] > 0 || b[3] > 0;
        if ((a[3] > 0) != (b[3] > 0) || (a[3] > 0 && step2_mm2 > 0.01 * 0.01)) {
            differing++;
            continue;
        }
        if (a[3] > 0) {
            far_mm = fmax(far_mm, sqrt(step2_mm2));
            assert_true(fabs((double)a[3] - (double)b[3]) < 0.02 * view->texel_area);
        }
    }
    print_message("  %zu views of %d texels a side: %zu of %zu lit texels differ, others by %.1g mm\n",
                  plan->view_count, view->size_px, differing, lit, far_mm);
    assert_true(lit > 1000 && differing < lit / 500);
    assert_close(flux[1], flux[0], 1e-4, "power of %zu views", plan->view_count);
    free(drawn);
    free(texels);
}

/* Oracle: pass light_view, which draws the same where OpenGL is not software. Both round corners to 1/256
 * of a texel, so only outlines may differ, and surfaces that light grazes. */
static void opengl_draws_the_same(void **state)
{
    (void)state;
    const double positions_mm[3][3] = { { 30, 25, 40 }, { 0.5, 2, 1 }, { -8, -3, 0 } };
    for (int light = 0; light < 4; light++) {
        struct test_scene test;
        const struct io_material material = marble();
        scene_init(&test, 60);
        assert_true(scene_add(&test, IO_PRIMITIVE_KNOT, 96, 4, -5, &material));
        assert_true(scene_add(&test, IO_PRIMITIVE_SPHERE, 24, 5, 6, &material));
        if (light == 3)
            scene_add_directional(&test, -1, -1, -2, 3);
        else
            scene_add_point(&test, positions_mm[light][0], positions_mm[light][1], positions_mm[light][2],
                            400);
        for (int i = 0; i < 2; i++) {
            test.objects[i].has_specular = true;
            test.objects[i].casts = IO_CASTS_OPAQUE; /* else each has views of its own */
        }
        struct renderer *const renderer = renderer_of(&test, RENDER_CONTEXT_DEFAULT);
        const struct render_request request = { .scene = &test.scene,
                                                .media = renderer->media,
                                                .epsilon = 0.03,
                                                .technique = RENDER_TECHNIQUE_GATHER };
        renderer->has_gpu = true;
        struct render_plan *plan;
        double time_ms[RENDER_EFFECT_LIMIT];
        dipole_status status;
        if (!render_run(renderer, &request, &plan, time_ms, &status))
            fail_msg("%s", status.message);
        assert_false(plan->has_light_pictures);
        compare_with_opengl(renderer, plan, &test.scene);
        render_plan_destroy(plan);
        render_destroy(renderer);
        scene_end(&test);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_show_what_rays_hit),
        cmocka_unit_test(a_sphere_is_a_disc),
        cmocka_unit_test(insides_and_threads_change_nothing),
        cmocka_unit_test(a_hollow_ball_is_seen_without_holes),
        cmocka_unit_test(hard_triangles_do_no_harm),
        cmocka_unit_test(whole_pictures_are_their_tiles),
        cmocka_unit_test(opengl_draws_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
