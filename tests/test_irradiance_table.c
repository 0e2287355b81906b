/* renderer/irradiance_table.c: irradiance by the normal, from a table, against the harmonics that it is of.
 */
#include "environment_maps.h"

#include "renderer/irradiance_table.h"

#include <string.h>

static struct render_irradiance_table *table_of(const struct render_irradiance *irradiance,
                                                double tolerance)
{
    struct render_irradiance_table *table;
    assert_true(render_irradiance_table_create(irradiance, tolerance, &table, NULL));
    return table;
}

static double white_sky(const double direction[3], const void *context)
{
    (void)direction;
    return uniform((struct rng *)context, 0, 1);
}

/* The largest difference of both at random normals and those where intervals meet, by the mean. */
static double largest_error(const struct render_irradiance *irradiance,
                            const struct render_irradiance_table *table, int count, struct rng *rng)
{
    double largest = 0;
    for (int i = 0; i < count; i++) {
        double normal[3], found[3], expected[3];
        random_direction(rng, normal);
        if (i < 27) { /* poles, axes, diagonals, and what is no direction */
            const double length = sqrt((i % 3 != 1) + (i / 3 % 3 != 1) + (i / 9 != 1));
            normal[0] = length > 0 ? (i % 3 - 1) / length : 0;
            normal[1] = length > 0 ? (i / 3 % 3 - 1) / length : 1;
            normal[2] = length > 0 ? (i / 9 - 1) / length : 0;
        }
        if (i >= 27 && i < 47) /* as close to a pole as it gets */
            for (int k = 0; k < 3; k++)
                normal[k] = k == 1 ? (i % 2 ? 1 : -1) : normal[k] * pow(10, 20 - i);
        render_irradiance_at(irradiance, normal, expected);
        render_irradiance_table_at(table, normal, found);
        for (int c = 0; c < 3; c++) {
            assert_true(found[c] >= 0);
            largest = fmax(largest, fabs(found[c] - expected[c]) / irradiance->mean[c]);
        }
    }
    return largest;
}

/* Oracle: the sum of harmonics. Nowhere does the table err by more than its bound (and rounding to floats),
 * of maps bundled and of noise, at any order; the bound keeps to the tolerance, with no more rows than
 * that. */
static void tables_keep_to_their_bound(void **state)
{
    (void)state;
    struct rng rng = { .seed = 11 };
    const int orders[] = { 0, 1, 2, 7, 20, RENDER_HARMONIC_LIMIT };
    for (int p = 0; p <= PROBES; p++) {
        struct render_environment *const environment =
            p < PROBES ? probe(probe_names[p]) : sky_of(32, white_sky, &rng);
        for (size_t o = 0; o < sizeof orders / sizeof *orders; o++) {
            struct render_irradiance *irradiance;
            assert_true(render_irradiance_create_of_order(environment, 1.4, orders[o], &irradiance, NULL));
            for (double tolerance = 1e-2; tolerance > 1e-5; tolerance *= 0.1) {
                struct render_irradiance_table *const table = table_of(irradiance, tolerance);
                assert_true(table->error <= tolerance);
                const double error = largest_error(irradiance, table, 400, &rng);
                assert_true(error <= table->error + 1e-5);    /* floats of angles and of sums */
                if (table->rows > RENDER_IRRADIANCE_ROWS_MIN) /* one row less would not do */
                    assert_true(table->error * pow((table->rows - 1.0) / table->rows, -4) > tolerance);
                render_irradiance_table_destroy(table);
            }
            render_irradiance_destroy(irradiance);
        }
        render_environment_destroy(environment);
    }
}

/* Oracle: the bound is no idle one: of a single high order the table errs by a good part of it, and by the
 * fourth power of the rows. */
static void the_error_falls_as_the_fourth_power(void **state)
{
    (void)state;
    struct rng rng = { .seed = 12 };
    struct render_environment *const environment = probe("studio");
    struct render_irradiance *irradiance;
    assert_true(render_irradiance_create_of_order(environment, 1.4, 12, &irradiance, NULL));
    memset(irradiance->coefficients + 1, 0, (13 * 13 - 1) * sizeof *irradiance->coefficients);
    irradiance->coefficients[render_harmonic_index(12, 12)][0] = 0.1 * irradiance->mean[0];
    double before = 0;
    for (int i = 0; i < 3; i++) {
        struct render_irradiance_table *const table = table_of(irradiance, 3e-3 * pow(16, -i));
        const double error = largest_error(irradiance, table, 4000, &rng);
        assert_true(error > 0.02 * table->error && error <= table->error);
        assert_true(i == 0 || (before / error > 11 && before / error < 23));
        before = error;
        render_irradiance_table_destroy(table);
    }
    render_irradiance_destroy(irradiance);
    render_environment_destroy(environment);
}

/* Oracle: by hand. A table is known by what it was made of: another turn of the map, index, order or
 * tolerance is another; the same again is the same. */
static void tables_are_known_by_their_light(void **state)
{
    (void)state;
    struct io_image *image;
    assert_true(io_exr_read(SOURCE_FOLDER "/scenes/probes/studio.exr", &image, NULL));
    struct render_environment *const still = environment_of(image, 0), *const turned =
                                                                           environment_of(image, 1);
    const struct {
        const struct render_environment *environment;
        double eta, tolerance;
        int order;
        bool is_same;
    } rows[] = { { still, 1.4, 1e-4, 9, true },
                 { turned, 1.4, 1e-4, 9, false },
                 { still, 1.41, 1e-4, 9, false },
                 { still, 1.4, 1e-4, 10, false },
                 { still, 1.4, 1e-5, 9, false } };
    struct render_irradiance *irradiance;
    assert_true(render_irradiance_create_of_order(still, 1.4, 9, &irradiance, NULL));
    struct render_irradiance_table *const table = table_of(irradiance, 1e-4);
    render_irradiance_destroy(irradiance);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_true(render_irradiance_create_of_order(rows[i].environment, rows[i].eta, rows[i].order,
                                                      &irradiance, NULL));
        assert_int_equal(render_irradiance_table_is_of(table, irradiance, rows[i].tolerance),
                         rows[i].is_same);
        render_irradiance_destroy(irradiance);
    }
    render_irradiance_table_destroy(table);
    render_environment_destroy(still);
    render_environment_destroy(turned);
    io_image_destroy(image);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_keep_to_their_bound),
        cmocka_unit_test(the_error_falls_as_the_fourth_power),
        cmocka_unit_test(tables_are_known_by_their_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
