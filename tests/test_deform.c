/* io/deform.c: what a twist, a bend and a wave do to points and normals. */
#include "check.h"

#include "io/deform.h"

#include <string.h>

static const double PI = 3.14159265358979323846;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void normalise(double v[3])
{
    const double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

static void random_direction(struct rng *rng, double v[3])
{
    do {
        for (int k = 0; k < 3; k++)
            v[k] = uniform(rng, -1, 1);
    } while (dot(v, v) < 0.01);
    normalise(v);
}

/* Any axis, origin and amount; bends of points up to 3 mm away stay outside their centre. */
static struct io_deform random_deform(struct rng *rng, enum io_deform_kind kind)
{
    struct io_deform deform = { .kind = kind,
                                .rate_rad_per_mm = uniform(rng, -0.3, 0.3),
                                .amplitude_mm = uniform(rng, -2, 2),
                                .phase_rad = uniform(rng, -4, 4) };
    double other[3];
    random_direction(rng, deform.axis);
    do {
        random_direction(rng, other);
        cross(deform.axis, other, deform.toward);
    } while (dot(deform.toward, deform.toward) < 0.01);
    normalise(deform.toward);
    for (int k = 0; k < 3; k++)
        deform.origin_mm[k] = uniform(rng, -1, 1);
    return deform;
}

static void random_point(struct rng *rng, const struct io_deform *deform, double p[3])
{
    for (int k = 0; k < 3; k++)
        p[k] = deform->origin_mm[k] + uniform(rng, -1.7, 1.7);
}

static void place(const struct io_deform *deform, const double p[3], double out[3])
{
    double normal[3] = { 1, 0, 0 };
    memcpy(out, p, 3 * sizeof *out);
    io_deform_apply(deform, out, normal);
}

/* Columns of the Jacobian by central differences, whose error is some h^2 = 1e-10. */
static void jacobian(const struct io_deform *deform, const double p[3], double columns[3][3])
{
    const double h = 1e-5;
    for (int k = 0; k < 3; k++) {
        double before[3] = { p[0], p[1], p[2] }, after[3] = { p[0], p[1], p[2] };
        before[k] -= h;
        after[k] += h;
        place(deform, before, before);
        place(deform, after, after);
        for (int i = 0; i < 3; i++)
            columns[k][i] = (after[i] - before[i]) / (2 * h);
    }
}

static double determinant(double columns[3][3])
{
    double c[3];
    cross(columns[0], columns[1], c);
    return dot(c, columns[2]);
}

/* Oracle: by hand. A quarter turn per 2 mm about y takes (1, 2, 0) to (0, 2, -1). */
static void a_twist_turns_by_height(void **state)
{
    (void)state;
    const struct io_deform twist = { .axis = { 0, 1, 0 }, .rate_rad_per_mm = PI / 4 };
    const double expected[3] = { 0, 2, -1 }, p[3] = { 1, 2, 0 };
    double found[3];
    place(&twist, p, found);
    for (int k = 0; k < 3; k++)
        assert_true(fabs(found[k] - expected[k]) < 1e-15);
}

/* Oracle: a circle. A bar of length pi R bent by curvature 1/R is half of one: its end is 2 R to the side.
 */
static void a_bent_bar_is_an_arc(void **state)
{
    (void)state;
    const double radius_mm = 3;
    const struct io_deform bend = {
        .kind = IO_DEFORM_BEND, .axis = { 1, 0, 0 }, .toward = { 0, 0, 1 }, .rate_rad_per_mm = 1 / radius_mm
    };
    const double end[3] = { PI * radius_mm, 0.5, 0 }, inner[3] = { PI * radius_mm / 2, 0, 1 };
    double found[3];
    place(&bend, end, found);
    assert_true(fabs(found[0]) < 1e-14 && found[1] == 0.5);
    assert_close(found[2], 2 * radius_mm, 1e-14, "end");
    place(&bend, inner, found); /* nearer to the centre, which is at z = R */
    assert_close(found[0], radius_mm - 1, 1e-14, "inner, along");
    assert_close(found[2], radius_mm, 1e-14, "inner, toward");
}

/* Oracle: the length of the polygon through 10,000 points of the neutral axis; its error is some
 * (angle/10000)^2 / 24. */
static void a_bend_keeps_the_length_of_its_axis(void **state)
{
    (void)state;
    struct rng rng = { .seed = 3 };
    for (int i = 0; i < 20; i++) {
        const struct io_deform bend = random_deform(&rng, IO_DEFORM_BEND);
        const double length_mm = uniform(&rng, 1, 20);
        double last[3], length = 0;
        memcpy(last, bend.origin_mm, sizeof last);
        for (int step = 1; step <= 10000; step++) {
            double p[3], away[3];
            for (int k = 0; k < 3; k++)
                p[k] = bend.origin_mm[k] + length_mm * step / 10000 * bend.axis[k];
            place(&bend, p, p);
            for (int k = 0; k < 3; k++)
                away[k] = p[k] - last[k];
            length += sqrt(dot(away, away));
            memcpy(last, p, sizeof last);
        }
        assert_close(length, length_mm, 1e-7, "case %d", i);
    }
}

/* Oracle: determinants by finite differences: 1 of twists and waves, which so keep every volume, and
 * 1 - curvature times the height of a bend (T54 to T56). */
static void volumes_are_kept_but_for_bends(void **state)
{
    (void)state;
    struct rng rng = { .seed = 4 };
    for (int i = 0; i < 3000; i++) {
        const struct io_deform deform = random_deform(&rng, (enum io_deform_kind)(i % 3));
        double p[3], columns[3][3], from[3];
        random_point(&rng, &deform, p);
        jacobian(&deform, p, columns);
        for (int k = 0; k < 3; k++)
            from[k] = p[k] - deform.origin_mm[k];
        const double expected =
            deform.kind == IO_DEFORM_BEND ? 1 - deform.rate_rad_per_mm * dot(from, deform.toward) : 1;
        assert_close(determinant(columns), expected, 1e-7, "case %d", i);
    }
}

/* Oracle: two tangents, taken along by finite differences: the normal is at a right angle to both, and on
 * the side that their cross product is on. */
static void normals_are_those_of_the_deformed_surface(void **state)
{
    (void)state;
    struct rng rng = { .seed = 5 };
    for (int i = 0; i < 3000; i++) {
        const struct io_deform deform = random_deform(&rng, (enum io_deform_kind)(i % 3));
        double p[3], columns[3][3], normal[3], other[3], tangents[2][3], moved[2][3], expected[3];
        random_point(&rng, &deform, p);
        random_direction(&rng, normal);
        do {
            random_direction(&rng, other);
            cross(normal, other, tangents[0]);
        } while (dot(tangents[0], tangents[0]) < 0.01);
        cross(normal, tangents[0], tangents[1]);
        jacobian(&deform, p, columns);
        for (int t = 0; t < 2; t++) {
            for (int k = 0; k < 3; k++)
                moved[t][k] = tangents[t][0] * columns[0][k] + tangents[t][1] * columns[1][k] +
                              tangents[t][2] * columns[2][k];
        }
        cross(moved[0], moved[1], expected);
        normalise(expected);
        io_deform_apply(&deform, p, normal);
        normalise(normal);
        assert_true(dot(normal, expected) > 1 - 1e-12);
    }
}

/* Oracle: bytes. What is by 0 leaves every bit, signs of 0 too; whatever else it says. */
static void an_amount_of_zero_is_the_identity(void **state)
{
    (void)state;
    struct rng rng = { .seed = 6 };
    for (int i = 0; i < 300; i++) {
        struct io_pose pose = { .deform_count = 3 };
        for (int d = 0; d < 3; d++) {
            pose.deforms[d] = random_deform(&rng, (enum io_deform_kind)d);
            if (d < 2)
                pose.deforms[d].rate_rad_per_mm = 0;
            else
                pose.deforms[d].amplitude_mm = 0;
            double p[3] = { uniform(&rng, -9, 9), -0.0, uniform(&rng, -1e9, 1e9) },
                   n[3] = { 0.6, -0.0, 0.8 };
            const double p_before[3] = { p[0], p[1], p[2] }, n_before[3] = { n[0], n[1], n[2] };
            io_deform_apply(&pose.deforms[d], p, n);
            assert_memory_equal(p, p_before, sizeof p);
            assert_memory_equal(n, n_before, sizeof n);
        }
    }
    const struct io_pose rest = { .deform_count = 0 };
    double p[3] = { -0.0, 1, 2 }, n[3] = { 3, -0.0, 4 }; /* not even its length changes */
    const double p_before[3] = { -0.0, 1, 2 }, n_before[3] = { 3, -0.0, 4 };
    io_pose_apply(&rest, p, n);
    assert_memory_equal(p, p_before, sizeof p);
    assert_memory_equal(n, n_before, sizeof n);
}

/* Oracle: small amounts. A displacement in proportion to the rate keeps its digits down to 1e-12 of it. */
static void small_amounts_keep_their_digits(void **state)
{
    (void)state;
    struct rng rng = { .seed = 7 };
    for (int i = 0; i < 200; i++) {
        struct io_deform deform = random_deform(&rng, IO_DEFORM_BEND);
        const double s = uniform(&rng, 0.5, 3);
        double p[3], end[3];
        deform.rate_rad_per_mm = log_uniform(&rng, 1e-9, 1e-5);
        memset(deform.origin_mm, 0, sizeof deform.origin_mm);
        for (int k = 0; k < 3; k++)
            p[k] = s * deform.axis[k];
        place(&deform, p, end);
        /* (1 - cos x)/rate = rate s^2/2 but for x^2/12 of it */
        assert_close(dot(end, deform.toward) / (0.5 * deform.rate_rad_per_mm * s * s), 1, 1e-6, "case %d",
                     i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_twist_turns_by_height),
        cmocka_unit_test(a_bent_bar_is_an_arc),
        cmocka_unit_test(a_bend_keeps_the_length_of_its_axis),
        cmocka_unit_test(volumes_are_kept_but_for_bends),
        cmocka_unit_test(normals_are_those_of_the_deformed_surface),
        cmocka_unit_test(an_amount_of_zero_is_the_identity),
        cmocka_unit_test(small_amounts_keep_their_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
