/* io/hash.c, and lutgen/hash.c: hashes of materials, of requests and of texels. */
#include "tables.h"

#include "io/hash.h"

static uint64_t hash_of(const struct io_material *material)
{
    return strtoull(lut_material_hash(material).text, NULL, 16);
}

/* Oracle: FNV-1a's published vectors. */
static void bytes_are_hashed_by_fnv(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint64_t hash;
    } cases[] = { { "", UINT64_C(0xcbf29ce484222325) },
                  { "a", UINT64_C(0xaf63dc4c8601ec8c) },
                  { "foobar", UINT64_C(0x85944171f73967e8) } };
    for (size_t i = 0; i < COUNT(cases); i++) {
        uint64_t hash = IO_HASH_START;
        io_hash_bytes(&hash, cases[i].text, strlen(cases[i].text));
        assert_true(hash == cases[i].hash);
    }
    assert_string_equal(lut_hash_print(0x1f).text, "000000000000001f");
}

enum { FIELDS = 5 };

/* Change one field of one layer's medium in one channel. */
static void change(struct io_material *material, int channel, size_t layer, int field)
{
    dipole_layer *const at = &material->layers[channel][layer];
    double *const numbers[] = { &at->medium.sigma_a_per_mm, &at->medium.sigma_s_prime_per_mm,
                                &at->medium.eta, &at->thickness_mm };
    if (field == FIELDS - 1)
        at->medium.fdr_kind = DIPOLE_FDR_POLYNOMIAL;
    else
        *numbers[field] = isinf(*numbers[field]) ? 100 : nextafter(*numbers[field], INFINITY);
}

/* Oracle: the definition; every change of what decides how light spreads is another hash, and no two
 * changes the same. */
static void materials_have_a_hash_of_what_decides(void **state)
{
    (void)state;
    const struct io_material skin = read_bundled("layered/skin", 1);
    struct io_material other = skin;
    snprintf(other.name, sizeof other.name, "another");
    snprintf(other.source, sizeof other.source, "elsewhere");
    snprintf(other.warning, sizeof other.warning, "beware");
    snprintf(other.layer_names[0], sizeof other.layer_names[0], "top");
    assert_true(hash_of(&other) == hash_of(&skin));
    other.layers[0][0].medium.sigma_a_per_mm = 0;
    const uint64_t of_zero = hash_of(&other);
    other.layers[0][0].medium.sigma_a_per_mm = -0.0;
    assert_true(hash_of(&other) == of_zero);

    uint64_t hashes[256] = { hash_of(&skin) };
    size_t count = 1;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        for (size_t layer = 0; layer < skin.layer_count; layer++)
            for (int field = 0; field < FIELDS; field++) {
                other = skin;
                change(&other, c, layer, field);
                hashes[count++] = hash_of(&other);
            }
    for (int model = 0; io_model_names[model]; model++)
        if ((dipole_model)model != skin.model) {
            other = skin;
            other.model = (dipole_model)model;
            hashes[count++] = hash_of(&other);
        }
    other = skin; /* two channels change places, two layers do */
    memcpy(other.layers[0], skin.layers[1], sizeof other.layers[0]);
    memcpy(other.layers[1], skin.layers[0], sizeof other.layers[1]);
    hashes[count++] = hash_of(&other);
    other = skin;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        other.layers[c][0] = skin.layers[c][1];
        other.layers[c][1] = skin.layers[c][0];
    }
    hashes[count++] = hash_of(&other);
    other = skin;
    other.layer_count = 2;
    hashes[count++] = hash_of(&other);
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < i; k++)
            if (hashes[i] == hashes[k])
                fail_msg("changes %zu and %zu have the same hash", i, k);
}

/* Oracle: the definition; the materials' texts stand in the file. */
static void requests_have_a_hash_of_what_decides(void **state)
{
    (void)state;
    struct io_material materials[2] = { read_bundled("marble", 1), read_bundled("apple", 1) };
    const struct io_material swapped[2] = { materials[1], materials[0] };
    struct io_material named[2] = { materials[0], materials[1] };
    snprintf(named[1].name, sizeof named[1].name, "Pear");
    const struct lut_request request = {
        .kind = LUT_SPLAT2D, .materials = materials, .material_count = 2, .epsilon = 0.01
    };
    struct io_material sourced[2] = { materials[0], materials[1] };
    snprintf(sourced[1].source, sizeof sourced[1].source, "elsewhere");
    struct io_material labelled[2] = { materials[0], materials[1] };
    snprintf(labelled[0].layer_names[0], sizeof labelled[0].layer_names[0], "all of it");
    struct lut_request others[12];
    for (size_t i = 0; i < COUNT(others); i++)
        others[i] = request;
    others[1].kind = LUT_TSM;
    others[2].epsilon = 0.02;
    others[3].is_half = true;
    others[4].size[0] = 64;
    others[5].size[1] = 64;
    others[6].size[2] = 64;
    others[7].material_count = 1;
    others[8].materials = swapped;
    others[9].materials = named;
    others[10].materials = sourced;
    others[11].materials = labelled;
    for (size_t i = 0; i < COUNT(others); i++)
        for (size_t k = 0; k < i; k++)
            if (strcmp(lut_request_hash(&others[i]).text, lut_request_hash(&others[k]).text) == 0)
                fail_msg("requests %zu and %zu have the same hash", i, k);
    assert_string_equal(lut_request_hash(&request).text, lut_request_hash(&others[0]).text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_are_hashed_by_fnv),
        cmocka_unit_test(materials_have_a_hash_of_what_decides),
        cmocka_unit_test(requests_have_a_hash_of_what_decides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
