/* renderer/bands.c: the profile in bands of scale, against the profile. */
#include "profiles.h"

/* Oracle: the definition. The finest has no cap, each reaches to the next one's cap, the last to r_max. */
static void bands_follow_each_other(void **state)
{
    (void)state;
    struct rng rng = { .seed = 9 };
    for (int i = 0; i < 500; i++) {
        struct render_band bands[RENDER_BAND_LIMIT];
        const double spacing_mm = log_uniform(&rng, 0.01, 1), r_max_mm = log_uniform(&rng, 0.1, 300);
        const double cap_spacings = uniform(&rng, 1.5, 10);
        const int count = render_bands_make(spacing_mm, r_max_mm, cap_spacings, bands);
        assert_true(count >= 1 && count <= RENDER_BAND_LIMIT);
        assert_true(bands[0].cap_mm == 0);
        for (int b = 0; b < count; b++) {
            assert_close(bands[b].spacing_mm, ldexp(spacing_mm, b), 1e-15, "case %d, band %d", i, b);
            if (b > 0) {
                assert_close(bands[b].cap_mm, cap_spacings * bands[b].spacing_mm, 1e-15, "case %d, band %d",
                             i, b);
                assert_close(bands[b].cap_mm, bands[b - 1].r_outer_mm, 1e-15, "case %d, band %d", i, b);
            }
        }
        assert_true(bands[count - 1].r_outer_mm == r_max_mm);
        assert_true(bands[count - 1].r_outer_mm > bands[count - 1].cap_mm);
    }
    struct render_band single[RENDER_BAND_LIMIT]; /* what is captured is one band */
    assert_int_equal(render_bands_make(0.1, 50, INFINITY, single), 1);
    assert_true(single[0].cap_mm == 0 && single[0].r_outer_mm == 50);
}

/* Oracle: the table. Bands add up to it to the last digits, whatever the caps are; a band ends where it
 * says. */
static void bands_add_up(void **state)
{
    (void)state;
    static const dipole_model models[] = { DIPOLE_MODEL_DIPOLE, DIPOLE_MODEL_BEAM, DIPOLE_MODEL_MODES };
    struct rng rng = { .seed = 10 };
    for (size_t m = 0; m < BUNDLED_COUNT; m++) {
        struct test_profile profile;
        struct render_band bands[RENDER_BAND_LIMIT];
        struct render_split split;
        profile_init(&profile, bundled[m], models[m % COUNT(models)], 0.01);
        const int count = render_bands_make(profile.spacing_mm, profile.r_max_mm, 2, bands);
        assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
        for (int i = 0; i < 300; i++) {
            const double r_mm = i == 0 ? 0 : log_uniform(&rng, 1e-3, 1) * profile.r_max_mm;
            double expected[3], at_0[3], sum[3] = { 0, 0, 0 }, part[3];
            lut_splat_sample(profile.table, 0, r_mm, expected);
            lut_splat_sample(profile.table, 0, 0, at_0);
            for (int b = 0; b < count; b++) {
                render_split_band_per_mm2(&split, b, r_mm, part);
                for (int c = 0; c < 3; c++) {
                    /* far out, where nothing of a channel is left, tables are coarse */
                    assert_true(part[c] >= -1e-3 * expected[c] - 1e-9 * at_0[c]);
                    assert_true(part[c] == 0 || r_mm <= bands[b].r_outer_mm);
                    sum[c] += part[c];
                }
            }
            for (int c = 0; c < 3; c++)
                assert_close(sum[c], expected[c], 1e-13, "%s at %g mm, channel %d", bundled[m], r_mm, c);
        }
        render_split_end(&split);
        profile_end(&profile);
    }
}

/* Oracle: finite differences of the models' own profile. Where a cap ends, value, slope and two more
 * derivatives in the squared distance are the profile's; within, it rises, but less. */
static void caps_are_smooth(void **state)
{
    (void)state;
    static const char *const names[] = { "marble", "ketchup", "wholemilk", "skin1" };
    for (size_t m = 0; m < COUNT(names); m++) {
        struct test_profile profile;
        struct render_band bands[RENDER_BAND_LIMIT];
        struct render_split split;
        profile_init(&profile, names[m], DIPOLE_MODEL_DIPOLE, 0.01);
        const int count = render_bands_make(profile.spacing_mm, profile.r_max_mm, 2, bands);
        assert_true(render_split_init(&profile.source, bands, count, &split, NULL));
        for (int b = 1; b < count; b++) {
            for (int c = 0; c < 3; c++) {
                double rgb[3], before = INFINITY;
                for (double part = 0; part <= 1; part += 0.05) {
                    render_split_from_per_mm2(&split, b, part * bands[b].cap_mm, rgb);
                    assert_true(rgb[c] <= before);
                    before = rgb[c];
                }
                const double *const t = split.caps[b][c];
                double at_0[3];
                lut_splat_sample(profile.table, 0, 0, at_0);
                if (t[0] < 1e-6 * at_0[c])
                    continue;             /* nothing of the channel is left: the steps are too coarse */
                const double step = 0.02; /* of s/s_cap; f' f'' f''' by five points */
                double f[5];
                for (int i = 0; i < 5; i++) {
                    const double r_mm = bands[b].cap_mm * sqrt(1 - step * (i - 2));
                    dipole_stack_profile_per_mm2(profile.medium.stacks[c], DIPOLE_FACE_LIT, &r_mm, 1,
                                                 &f[i]);
                }
                /* the table is scaled by up to its own error */
                assert_close(t[0], f[2], 1e-3, "%s, cap %d, channel %d", names[m], b, c);
                assert_close(t[1], (f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * step), 5e-3,
                             "slope of %s, cap %d", names[m], b);
                assert_close(t[2], (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (24 * step * step),
                             2e-3, "bend of %s, cap %d", names[m], b);
            }
        }
        render_split_end(&split);
        profile_end(&profile);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bands_follow_each_other),
        cmocka_unit_test(bands_add_up),
        cmocka_unit_test(caps_are_smooth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
