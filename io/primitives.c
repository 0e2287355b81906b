#include "io/mesh_internal.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static const double PI = 3.14159265358979323846;

const char *const io_primitive_names[IO_PRIMITIVE_COUNT] = {
    [IO_PRIMITIVE_SPHERE] = "sphere",   [IO_PRIMITIVE_CUBE] = "cube",       [IO_PRIMITIVE_SLAB] = "slab",
    [IO_PRIMITIVE_TORUS] = "torus",     [IO_PRIMITIVE_KNOT] = "knot",       [IO_PRIMITIVE_BOWL] = "bowl",
    [IO_PRIMITIVE_TERRAIN] = "terrain", [IO_PRIMITIVE_LANTERN] = "lantern",
};

enum { DETAIL_MIN = 4, DETAIL_MAX = 4096 };

/* ---- what all of them are built with ------------------------------------------------------------- */

struct vector {
    double x, y, z;
};

static double dot(struct vector a, struct vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static struct vector cross(struct vector a, struct vector b)
{
    return (struct vector){ a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x };
}

static struct vector unit(struct vector a)
{
    const double length = sqrt(dot(a, a));
    return (struct vector){ a.x / length, a.y / length, a.z / length };
}

/* Number of segments of a part whose length is a share of the longest direction's. */
static size_t share_of(int detail, double share, size_t least)
{
    const size_t count = (size_t)lround((double)detail * share);
    return count > least ? count : least;
}

/* Fills a mesh from its start; the counts were computed before. */
struct builder {
    struct io_mesh *mesh;
    size_t vertex_count, index_count;
};

static bool start(struct builder *builder, size_t vertex_count, size_t triangle_count,
                  dipole_status *status)
{
    *builder = (struct builder){ 0 };
    if (triangle_count > IO_MESH_TRIANGLE_LIMIT)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "%zu triangles are more than the %u that a mesh may have", triangle_count,
                           IO_MESH_TRIANGLE_LIMIT);
    builder->mesh = io_mesh_create(vertex_count, triangle_count);
    return builder->mesh ||
           dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu triangles", triangle_count);
}

static uint32_t add_vertex(struct builder *builder, struct vector position, struct vector normal)
{
    const size_t index = builder->vertex_count++;
    float *p = builder->mesh->positions + 3 * index, *n = builder->mesh->normals + 3 * index;
    assert(index < builder->mesh->vertex_count);
    p[0] = (float)position.x, p[1] = (float)position.y, p[2] = (float)position.z;
    n[0] = (float)normal.x, n[1] = (float)normal.y, n[2] = (float)normal.z;
    return (uint32_t)index;
}

static void add_triangle(struct builder *builder, size_t a, size_t b, size_t c)
{
    uint32_t *indices = builder->mesh->indices + builder->index_count;
    assert(builder->index_count < 3 * builder->mesh->triangle_count);
    indices[0] = (uint32_t)a, indices[1] = (uint32_t)b, indices[2] = (uint32_t)c;
    builder->index_count += 3;
}

/* A quadrilateral whose corners go counter-clockwise seen from outside. */
static void add_quad(struct builder *builder, size_t a, size_t b, size_t c, size_t d)
{
    add_triangle(builder, a, b, c);
    add_triangle(builder, a, c, d);
}

static struct io_mesh *finish(struct builder *builder)
{
    assert(builder->vertex_count == builder->mesh->vertex_count);
    assert(builder->index_count == 3 * builder->mesh->triangle_count);
    io_mesh_update_bounds(builder->mesh);
    return builder->mesh;
}

/* ---- surfaces of revolution about y -------------------------------------------------------------- */

/* A point of the outline, in the half-plane of radius >= 0, with its outward normal. */
struct outline_point {
    double radius, y, normal_radius, normal_y;
};

/* count points of an arc of a circle about (radius, y), from angle from_rad, measured from outwards to up,
 * in steps towards to_rad, which is left to the next arc; normals away from the centre, or towards it. */
static struct outline_point *add_arc(struct outline_point *points, size_t count, double radius, double y,
                                     double arc_radius, double from_rad, double to_rad, double sign)
{
    for (size_t i = 0; i < count; i++) {
        const double angle = from_rad + (to_rad - from_rad) * (double)i / (double)count;
        *points++ = (struct outline_point){
            .radius = radius + arc_radius * cos(angle),
            .y = y + arc_radius * sin(angle),
            .normal_radius = sign * cos(angle),
            .normal_y = sign * sin(angle),
        };
    }
    return points;
}

/* Turn an outline that starts and ends on the axis, going counter-clockwise round the solid's half section
 * as seen with the radius to the right and y up. Its first and last point are the poles. */
static bool revolve(const struct outline_point *outline, size_t point_count, size_t turn_count,
                    struct io_mesh **mesh_out, dipole_status *status)
{
    const size_t ring_count = point_count - 2;
    struct builder builder;
    if (!start(&builder, ring_count * turn_count + 2, 2 * ring_count * turn_count, status))
        return false;
    for (size_t i = 1; i <= ring_count; i++)
        for (size_t j = 0; j < turn_count; j++) {
            const double angle = 2 * PI * (double)j / (double)turn_count;
            const double c = cos(angle), s = -sin(angle); /* counter-clockwise seen from above */
            const struct outline_point *p = &outline[i];
            add_vertex(&builder, (struct vector){ p->radius * c, p->y, p->radius * s },
                       (struct vector){ p->normal_radius * c, p->normal_y, p->normal_radius * s });
        }
    const struct outline_point *first = outline, *last = outline + point_count - 1;
    const size_t first_pole =
        add_vertex(&builder, (struct vector){ 0, first->y, 0 }, (struct vector){ 0, first->normal_y, 0 });
    const size_t last_pole =
        add_vertex(&builder, (struct vector){ 0, last->y, 0 }, (struct vector){ 0, last->normal_y, 0 });

    for (size_t j = 0; j < turn_count; j++) {
        const size_t next = (j + 1) % turn_count, top = (ring_count - 1) * turn_count;
        add_triangle(&builder, first_pole, next, j);
        for (size_t i = 0; i + 1 < ring_count; i++)
            add_quad(&builder, i * turn_count + j, i * turn_count + next, (i + 1) * turn_count + next,
                     (i + 1) * turn_count + j);
        add_triangle(&builder, top + j, top + next, last_pole);
    }
    *mesh_out = finish(&builder);
    return true;
}

static bool create_sphere(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    struct outline_point outline[DETAIL_MAX];
    const size_t steps = share_of(detail, 0.5, 2);
    struct outline_point *end = add_arc(outline, steps, 0, 0, 1, -PI / 2, PI / 2, 1);
    *end++ = (struct outline_point){ .y = 1, .normal_y = 1 };
    return revolve(outline, steps + 1, (size_t)detail, mesh_out, status);
}

/* Two quarter circles joined by a half circle for the lip, so that the whole of it is smooth. */
static bool create_bowl(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    const double thickness = 0.1, inner = 1 - thickness;
    struct outline_point outline[DETAIL_MAX];
    const size_t outer_steps = share_of(detail, 0.25, 2), inner_steps = share_of(detail, 0.25 * inner, 2),
                 lip_steps = share_of(detail, 1.0 / 16, 4);
    struct outline_point *end = outline;
    end = add_arc(end, outer_steps, 0, 0, 1, -PI / 2, 0, 1);
    end = add_arc(end, lip_steps, 1 - thickness / 2, 0, thickness / 2, 0, PI, 1);
    end = add_arc(end, inner_steps, 0, 0, inner, 0, -PI / 2, -1);
    *end++ = (struct outline_point){ .y = -inner, .normal_y = 1 };
    return revolve(outline, (size_t)(end - outline), (size_t)detail, mesh_out, status);
}

/* ---- tubes along a closed curve ------------------------------------------------------------------ */

/* A point of the curve and two unit vectors that span its normal plane; their cross product, first by
 * second, points backwards along the curve. */
struct tube_frame {
    struct vector centre, first, second;
};

/* A tube of constant radius about a curve: its normal is exactly the direction from the curve's point,
 * however the frame turns along it. */
static bool sweep(struct tube_frame (*frame_at)(double share), double radius, size_t along_count,
                  size_t around_count, struct io_mesh **mesh_out, dipole_status *status)
{
    struct builder builder;
    if (!start(&builder, along_count * around_count, 2 * along_count * around_count, status))
        return false;
    for (size_t i = 0; i < along_count; i++) {
        const struct tube_frame f = frame_at((double)i / (double)along_count);
        for (size_t j = 0; j < around_count; j++) {
            const double angle = 2 * PI * (double)j / (double)around_count, c = cos(angle), s = sin(angle);
            const struct vector n = { c * f.first.x + s * f.second.x, c * f.first.y + s * f.second.y,
                                      c * f.first.z + s * f.second.z };
            add_vertex(&builder,
                       (struct vector){ f.centre.x + radius * n.x, f.centre.y + radius * n.y,
                                        f.centre.z + radius * n.z },
                       n);
        }
    }
    for (size_t i = 0; i < along_count; i++)
        for (size_t j = 0; j < around_count; j++) {
            const size_t this_ring = i * around_count, next_ring = (i + 1) % along_count * around_count;
            const size_t next = (j + 1) % around_count;
            add_quad(&builder, this_ring + j, next_ring + j, next_ring + next, this_ring + next);
        }
    *mesh_out = finish(&builder);
    return true;
}

static struct tube_frame circle_frame(double share)
{
    const double c = cos(2 * PI * share), s = -sin(2 * PI * share);
    return (struct tube_frame){ .centre = { c, 0, s }, .first = { c, 0, s }, .second = { 0, 1, 0 } };
}

static bool create_torus(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    return sweep(circle_frame, 0.35, (size_t)detail, share_of(detail, 0.25, 4), mesh_out, status);
}

/*
 * The trefoil as a (2, 3) torus knot about z. The normal of that torus is normal to the curve and comes
 * back to itself after one turn, which a frame carried along the curve would not.
 */
static struct tube_frame trefoil_frame(double share)
{
    const double major = 0.6, minor = 0.26, t = 2 * PI * share;
    const double c2 = cos(2 * t), s2 = sin(2 * t), c3 = cos(3 * t), s3 = sin(3 * t), r = major + minor * c3;
    const struct vector out = { c3 * c2, c3 * s2, s3 };
    const struct vector tangent = unit((struct vector){ -2 * r * s2 - 3 * minor * s3 * c2,
                                                        2 * r * c2 - 3 * minor * s3 * s2, 3 * minor * c3 });
    return (struct tube_frame){ .centre = { r * c2, r * s2, minor * s3 },
                                .first = out,
                                .second = cross(out, tangent) };
}

static bool create_knot(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    return sweep(trefoil_frame, 0.14, (size_t)detail, share_of(detail, 0.125, 4), mesh_out, status);
}

/* ---- boxes --------------------------------------------------------------------------------------- */

/* A face of a box: a grid of points over two directions whose cross product is the outward normal.
 * Adjoining faces compute their common points from the same numbers, so these agree to the last bit. */
static void add_box_face(struct builder *builder, const struct vector *min, const struct vector *max,
                         const size_t counts[3], int axis, bool is_upper)
{
    const double lo[3] = { min->x, min->y, min->z }, hi[3] = { max->x, max->y, max->z };
    const int u = (axis + (is_upper ? 1 : 2)) % 3, v = (axis + (is_upper ? 2 : 1)) % 3;
    const size_t first = builder->vertex_count, row = counts[u] + 1;
    double normal[3] = { 0, 0, 0 };
    normal[axis] = is_upper ? 1 : -1;
    for (size_t j = 0; j <= counts[v]; j++)
        for (size_t i = 0; i <= counts[u]; i++) {
            double p[3];
            p[axis] = is_upper ? hi[axis] : lo[axis];
            p[u] = lo[u] + (hi[u] - lo[u]) * (double)i / (double)counts[u];
            p[v] = lo[v] + (hi[v] - lo[v]) * (double)j / (double)counts[v];
            add_vertex(builder, (struct vector){ p[0], p[1], p[2] },
                       (struct vector){ normal[0], normal[1], normal[2] });
        }
    for (size_t j = 0; j < counts[v]; j++)
        for (size_t i = 0; i < counts[u]; i++) {
            const size_t corner = first + j * row + i;
            add_quad(builder, corner, corner + 1, corner + row + 1, corner + row);
        }
}

static bool create_box(struct vector min, struct vector max, const size_t counts[3],
                       struct io_mesh **mesh_out, dipole_status *status)
{
    size_t vertex_count = 0, quad_count = 0;
    for (int axis = 0; axis < 3; axis++) {
        const size_t u = counts[(axis + 1) % 3], v = counts[(axis + 2) % 3];
        vertex_count += 2 * (u + 1) * (v + 1);
        quad_count += 2 * u * v;
    }
    struct builder builder;
    if (!start(&builder, vertex_count, 2 * quad_count, status))
        return false;
    for (int axis = 0; axis < 3; axis++) {
        add_box_face(&builder, &min, &max, counts, axis, false);
        add_box_face(&builder, &min, &max, counts, axis, true);
    }
    *mesh_out = finish(&builder);
    return true;
}

static bool create_cube(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    const size_t n = (size_t)detail;
    return create_box((struct vector){ -1, -1, -1 }, (struct vector){ 1, 1, 1 },
                      (const size_t[]){ n, n, n }, mesh_out, status);
}

static bool create_slab(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    const size_t n = (size_t)detail;
    return create_box((struct vector){ -1, -1, -1 }, (struct vector){ 1, 0, 1 },
                      (const size_t[]){ n, share_of(detail, 0.5, 1), n }, mesh_out, status);
}

/* ---- terrain ------------------------------------------------------------------------------------- */

/*
 * Height over (x, z): low hills that end flat at the border, and fins along z, each half as thick as the
 * one before it. A fin is height exp(-(offset / half_width)^4) (1 - z^2)^2: a thin wall that runs out at
 * the ends.
 */
static const struct fin {
    double x, height, half_width;
} fins[] = {
    { -0.66, 0.65, 0.12 },
    { -0.12, 0.65, 0.06 },
    { 0.32, 0.65, 0.03 },
    { 0.70, 0.65, 0.015 },
};
static const double hill_height = 0.05, terrain_depth = 0.3;

struct height {
    double y, slope_x, slope_z;
};

static struct height height_at(double x, double z)
{
    struct height h = {
        .y = hill_height * (1 + cos(PI * x)) * (1 + cos(PI * z)),
        .slope_x = -hill_height * PI * sin(PI * x) * (1 + cos(PI * z)),
        .slope_z = -hill_height * PI * (1 + cos(PI * x)) * sin(PI * z),
    };
    const double along = 1 - z * z;
    for (size_t i = 0; i < sizeof fins / sizeof fins[0]; i++) {
        const double s = (x - fins[i].x) / fins[i].half_width, wall = fins[i].height * exp(-s * s * s * s);
        h.y += wall * along * along;
        h.slope_x += wall * along * along * -4 * s * s * s / fins[i].half_width;
        h.slope_z += wall * -4 * z * along;
    }
    return h;
}

/* Abscissas between which the section at z = 0 has the same length: they crowd on the sides of the fins. */
static void space_evenly(double *x, size_t count)
{
    enum { FINE_COUNT = 1 << 16 };
    double total = 0;
    for (size_t i = 0; i < FINE_COUNT; i++)
        total += hypot(1, height_at(-1 + 2 * ((double)i + 0.5) / FINE_COUNT, 0).slope_x);
    double length = 0;
    size_t next = 1;
    for (size_t i = 0; i < FINE_COUNT; i++) {
        const double step = hypot(1, height_at(-1 + 2 * ((double)i + 0.5) / FINE_COUNT, 0).slope_x);
        for (; next < count && length + step >= total * (double)next / (double)count; next++)
            x[next] =
                -1 + 2 * ((double)i + (total * (double)next / (double)count - length) / step) / FINE_COUNT;
        length += step;
    }
    x[0] = -1;
    x[count] = 1;
}

/* A vertical side: from the floor up to the border of the height field, along which point i is (x[i],
 * z[i]). */
static void add_wall(struct builder *builder, const double *x, const double *z, size_t count,
                     size_t up_count, struct vector normal)
{
    const size_t first = builder->vertex_count, row = count + 1;
    for (size_t j = 0; j <= up_count; j++)
        for (size_t i = 0; i <= count; i++) {
            const double share = (double)j / (double)up_count;
            const double y = share * height_at(x[i], z[i]).y - (1 - share) * terrain_depth;
            add_vertex(builder, (struct vector){ x[i], y, z[i] }, normal);
        }
    for (size_t j = 0; j < up_count; j++)
        for (size_t i = 0; i < count; i++) {
            const size_t corner = first + j * row + i;
            add_quad(builder, corner, corner + 1, corner + row + 1, corner + row);
        }
}

/* The four walls, each along its border so that the outside is to the right. lines holds, for count + 1
 * points: x rising, z rising, x falling, z falling, +1 and -1. */
static void add_walls(struct builder *builder, double *const lines[6], size_t count, size_t up_count)
{
    add_wall(builder, lines[0], lines[4], count, up_count, (struct vector){ 0, 0, 1 });
    add_wall(builder, lines[4], lines[3], count, up_count, (struct vector){ 1, 0, 0 });
    add_wall(builder, lines[2], lines[5], count, up_count, (struct vector){ 0, 0, -1 });
    add_wall(builder, lines[5], lines[1], count, up_count, (struct vector){ -1, 0, 0 });
}

/* The height field, or the floor under it; row i of the grid goes along z. */
static void add_field(struct builder *builder, const double *x, const double *z, size_t count,
                      bool is_floor)
{
    const size_t first = builder->vertex_count, row = count + 1;
    for (size_t i = 0; i <= count; i++)
        for (size_t j = 0; j <= count; j++) {
            const struct height h = height_at(x[i], z[j]);
            const struct vector normal =
                is_floor ? (struct vector){ 0, -1, 0 } : unit((struct vector){ -h.slope_x, 1, -h.slope_z });
            add_vertex(builder, (struct vector){ x[i], is_floor ? -terrain_depth : h.y, z[j] }, normal);
        }
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < count; j++) {
            const size_t a = first + i * row + j, b = a + 1, c = b + row, d = a + row;
            if (is_floor)
                add_quad(builder, a, d, c, b);
            else
                add_quad(builder, a, b, c, d);
        }
}

static bool create_terrain(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    const size_t n = (size_t)detail, up = share_of(detail, 0.125, 1);
    struct builder builder;
    if (!start(&builder, 2 * (n + 1) * (n + 1) + 4 * (n + 1) * (up + 1), 4 * n * n + 8 * n * up, status))
        return false;
    double *const block = malloc(6 * (n + 1) * sizeof *block);
    if (!block) {
        io_mesh_destroy(builder.mesh);
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for a terrain");
    }
    double *lines[6];
    for (size_t k = 0; k < 6; k++)
        lines[k] = block + k * (n + 1);
    space_evenly(lines[0], n);
    for (size_t i = 0; i <= n; i++) {
        lines[1][i] = -1 + 2 * (double)i / (double)n;
        lines[2][n - i] = lines[0][i];
        lines[3][n - i] = lines[1][i];
        lines[4][i] = 1;
        lines[5][i] = -1;
    }
    add_field(&builder, lines[0], lines[1], n, false);
    add_field(&builder, lines[0], lines[1], n, true);
    add_walls(&builder, lines, n, up);
    free(block);
    *mesh_out = finish(&builder);
    return true;
}

/* ---- lantern ------------------------------------------------------------------------------------- */

/*
 * A closed surface about the origin at the distance r = scale (1 - depth sin^2 a (1 - cos(count b))/2), a
 * the angle from the axis y, b that about it: a ball with flutes that run out at the poles. Its outward
 * normal is along the gradient of |p| - r, which has no pole: dr/db holds the square of the sine that it is
 * divided by.
 */
struct fluted_ball {
    double scale, depth, count;
    bool is_cavity; /* the solid is outside: normals and triangles face the origin */
};

static void add_fluted_point(struct builder *builder, const struct fluted_ball *ball, double a, double b)
{
    const double sa = sin(a), ca = cos(a), sb = sin(b), cb = cos(b), wave = (1 - cos(ball->count * b)) / 2;
    const double r = ball->scale * (1 - ball->depth * sa * sa * wave);
    const double along = ball->scale * ball->depth * 2 * sa * ca * wave / r;
    const double about = ball->scale * ball->depth * sa * ball->count / 2 * sin(ball->count * b) / r;
    const struct vector out = { sa * cb, ca, -sa * sb };
    const struct vector n = unit((struct vector){ out.x + along * ca * cb - about * sb, out.y - along * sa,
                                                  out.z - along * ca * sb - about * cb });
    const double sign = ball->is_cavity ? -1 : 1;
    add_vertex(builder, (struct vector){ r * out.x, r * out.y, r * out.z },
               (struct vector){ sign * n.x, sign * n.y, sign * n.z });
}

/* A triangle of a surface seen from the origin's other side, or the same turned over. */
static void add_facing(struct builder *builder, bool is_cavity, size_t a, size_t b, size_t c)
{
    add_triangle(builder, a, is_cavity ? c : b, is_cavity ? b : c);
}

/* Rings of turn_count points from the upper pole down, then the two poles. */
static void add_fluted_ball(struct builder *builder, const struct fluted_ball *ball, size_t ring_count,
                            size_t turn_count)
{
    const size_t first = builder->vertex_count, poles = first + ring_count * turn_count;
    const size_t last = poles - turn_count;
    for (size_t i = 1; i <= ring_count; i++)
        for (size_t j = 0; j < turn_count; j++)
            add_fluted_point(builder, ball, PI * (double)i / (double)(ring_count + 1),
                             2 * PI * (double)j / (double)turn_count);
    add_fluted_point(builder, ball, 0, 0);
    add_fluted_point(builder, ball, PI, 0);
    for (size_t j = 0; j < turn_count; j++) {
        const size_t next = (j + 1) % turn_count;
        add_facing(builder, ball->is_cavity, poles, first + j, first + next);
        add_facing(builder, ball->is_cavity, poles + 1, last + next, last + j);
        for (size_t i = 0; i + 1 < ring_count; i++) {
            const size_t upper = first + i * turn_count, lower = upper + turn_count;
            add_facing(builder, ball->is_cavity, upper + j, lower + j, lower + next);
            add_facing(builder, ball->is_cavity, upper + j, lower + next, upper + next);
        }
    }
}

/* The wall is 0.2 thick on the ribs and 0.08 in the flutes. */
static bool create_lantern(int detail, struct io_mesh **mesh_out, dipole_status *status)
{
    const struct fluted_ball outside = { .scale = 1, .depth = 0.12, .count = 12 };
    const struct fluted_ball cavity = { .scale = 0.8, .is_cavity = true };
    const size_t turns = (size_t)detail, rings = share_of(detail, 0.5, 2) - 1;
    struct builder builder;
    if (!start(&builder, 2 * (rings * turns + 2), 4 * rings * turns, status))
        return false;
    add_fluted_ball(&builder, &outside, rings, turns);
    add_fluted_ball(&builder, &cavity, rings, turns);
    *mesh_out = finish(&builder);
    return true;
}

/* ---- the list ------------------------------------------------------------------------------------ */

bool io_mesh_create_primitive(enum io_primitive primitive, int detail, struct io_mesh **mesh_out,
                              dipole_status *status)
{
    static bool (*const create[IO_PRIMITIVE_COUNT])(int, struct io_mesh **, dipole_status *) = {
        [IO_PRIMITIVE_SPHERE] = create_sphere,   [IO_PRIMITIVE_CUBE] = create_cube,
        [IO_PRIMITIVE_SLAB] = create_slab,       [IO_PRIMITIVE_TORUS] = create_torus,
        [IO_PRIMITIVE_KNOT] = create_knot,       [IO_PRIMITIVE_BOWL] = create_bowl,
        [IO_PRIMITIVE_TERRAIN] = create_terrain, [IO_PRIMITIVE_LANTERN] = create_lantern,
    };
    *mesh_out = NULL;
    if (detail < DETAIL_MIN || detail > DETAIL_MAX)
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "detail is %d, expected %d to %d", detail,
                           DETAIL_MIN, DETAIL_MAX);
    assert(primitive < IO_PRIMITIVE_COUNT);
    return create[primitive](detail, mesh_out, status);
}
