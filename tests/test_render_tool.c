/* The program render, as a user runs it: exit codes, exact messages, pictures read back. */
#include "check.h"

#include "io/exr.h"
#include "io/image.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#define RENDER PROGRAM_FOLDER "/render"

/* Run a shell command in the test's folder; its two outputs. Returns the exit code. */
static int run(const char *command, char *out, char *err, size_t size)
{
    char line[4096];
    snprintf(line, sizeof line, "{ %s; } >stdout.txt 2>stderr.txt", command);
    const int code = system(line);
    assert_true(WIFEXITED(code));
    const char *const names[2] = { "stdout.txt", "stderr.txt" };
    char *const texts[2] = { out, err };
    for (int i = 0; i < 2; i++) {
        FILE *const file = fopen(names[i], "r");
        assert_non_null(file);
        const size_t length = fread(texts[i], 1, size - 1, file);
        texts[i][length] = '\0';
        fclose(file);
    }
    return WEXITSTATUS(code);
}

static void write_file(const char *path, const char *text)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static const char sphere_json[] =
    "{ \"camera\": { \"eye\": [0, 0, 30], \"target\": [0, 0, 0], \"fov_y_deg\": 25, \"size\": [64, 48] },\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"sphere\", \"detail\": 64, \"transform\": { \"scale\": 5 },\n"
    "                \"material\": \"skin1\", \"roughness\": 0.4 }] }\n";

/* Several objects, one of them layered, some glossy, under a light from afar and one among them. */
static const char many_json[] =
    "{ \"camera\": { \"eye\": [3, 6, 30], \"target\": [1, 0, 0], \"fov_y_deg\": 30, \"size\": [63, 47] },\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 3 },\n"
    "             { \"kind\": \"point\", \"position\": [1, 4, 4], \"intensity\": [90, 60, 20] }],\n"
    "  \"objects\": [{ \"primitive\": \"knot\", \"transform\": { \"scale\": 4 }, \"material\": \"marble\" "
    "},\n"
    "              { \"primitive\": \"sphere\", \"detail\": 64, \"material\": \"skin1\", \"specular\": "
    "false,\n"
    "                \"transform\": { \"scale\": 3, \"translate\": [6, 0, 0] } },\n"
    "              { \"primitive\": \"slab\", \"transform\": { \"scale\": 9, \"translate\": [0, -5, 0] },\n"
    "                \"material\": { \"name\": \"coated\", \"eta\": 1.4, \"model\": \"beam\", \"layers\": "
    "[\n"
    "                  { \"thickness_mm\": 0.4, \"sigma_a_per_mm\": [0.02, 0.1, 0.3],\n"
    "                    \"sigma_s_prime_per_mm\": [3, 3, 3] },\n"
    "                  { \"thickness_mm\": \"infinite\", \"sigma_a_per_mm\": [0.01, 0.02, 0.01],\n"
    "                    \"sigma_s_prime_per_mm\": [1.5, 1.5, 1.5] }] } }] }\n";

/* Half way round the first camera is where the second one stands. */
static const char turn_json[] =
    "{ \"cameras\": [{ \"name\": \"front\", \"eye\": [0, 0, 30], \"target\": [0, 0, 0], \"size\": [64, 48] "
    "},\n"
    "             { \"name\": \"back\", \"eye\": [0, 0, -30], \"target\": [0, 0, 0], \"size\": [64, 48] "
    "}],\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"torus\", \"transform\": { \"scale\": [7, 5, 5], \"rotate_deg\": "
    "[30, 0, 20] "
    "},\n"
    "                \"material\": \"marble\" }],\n"
    "  \"frames\": { \"count\": 4, \"camera_turn_deg\": 360 } }\n";

static int setup(void **state)
{
    (void)state;
    write_file("sphere.json", sphere_json);
    write_file("turn.json", turn_json);
    return system("rm -rf *.exr *.png tables others empty") != 0;
}

/* The command ends with that code and exactly that line on stderr, and leaves no picture. */
static void fails_with(const char *command, int code, const char *message)
{
    char out[32768], err[32768];
    const int found = run(command, out, err, sizeof out);
    if (found != code || strcmp(err, message) != 0)
        print_error("%s\n  exit %d, stderr: %s", command, found, err);
    assert_string_equal(err, message);
    assert_int_equal(found, code);
    assert_string_equal(out, "");
    assert_int_equal(system("ls | grep -q '^bad\\.'") != 0, 1);
}

static struct io_image *read_exr(const char *path)
{
    struct io_image *image;
    dipole_status status;
    if (!io_exr_read(path, &image, &status))
        fail_msg("%s", status.message);
    return image;
}

static double relative_rmse(const struct io_image *found, const struct io_image *expected)
{
    assert_int_equal(found->width_px, expected->width_px);
    assert_int_equal(found->height_px, expected->height_px);
    double error2 = 0, value2 = 0;
    for (size_t i = 0; i < (size_t)found->width_px * (size_t)found->height_px * 4; i++) {
        const double e = (double)expected->pixels[i], f = (double)found->pixels[i];
        error2 += (f - e) * (f - e);
        value2 += e * e;
    }
    return sqrt(error2 / value2);
}

/* Oracle: the promised exit codes and messages; nothing is half-written. */
static void bad_input_is_one_line_and_no_picture(void **state)
{
    (void)state;
    fails_with(RENDER " absent.json -o bad.exr", 1,
               "render: absent.json: cannot be read: No such file or directory\n");
    fails_with(RENDER " sphere.json -o bad.tif", 1,
               "render: bad.tif: unknown kind of picture, expected a name that ends in .exr or .png\n");
    fails_with(RENDER " sphere.json -o absent/bad.exr", 1,
               "render: absent/bad.exr: cannot be written, its folder is missing: No such file or "
               "directory\n");
    fails_with(RENDER " sphere.json -o bad.exr --size 16384x16384", 1,
               "render: sphere.json: the picture is 16384x16384, expected sides of 1 to 16384 and at most "
               "16777216 pixels\n");
    fails_with(RENDER " sphere.json -o bad.exr --luts absent", 1,
               "render: absent: cannot list the folder of tables: No such file or directory\n");
    fails_with(RENDER " turn.json -o bad.exr --camera top", 1,
               "render: turn.json:1:14: cameras has none named \"top\", expected one of front, back\n");
    fails_with(RENDER " sphere.json -o bad.exr --camera top", 1,
               "render: sphere.json:1:13: camera has no name, but \"top\" is asked for\n");
    fails_with(RENDER " turn.json -o bad.exr --frames 2:4", 1,
               "render: turn.json: frames 2 to 4 are asked for, expected 0 to 3\n");
    fails_with(RENDER " sphere.json -o bad.exr --frames 1", 1,
               "render: sphere.json: frames 1 to 1 are asked for, expected 0 to 0\n");
    fails_with("ulimit -f 4; " RENDER " sphere.json -o bad.exr --technique lambert", 1,
               "render: bad.exr: cannot be written: File too large\n");
}

/* Oracle: it is drawn. Every model, and layers, beside each other. */
static void every_model_is_drawn(void **state)
{
    (void)state;
    write_file(
        "models.json",
        "{ \"camera\": { \"eye\": [0, 0, 60], \"target\": [0, 0, 0], \"size\": [90, 60] },\n"
        "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0, 0, -1], \"irradiance\": 3 "
        "}],\n"
        "  \"objects\": [\n"
        "    { \"primitive\": \"sphere\", \"transform\": { \"translate\": [-8, 0, 0], \"scale\": 3 "
        "}, \"material\": \"skin1\" },\n"
        "    { \"primitive\": \"cube\", \"transform\": { \"scale\": 3 }, \"material\": { \"name\": "
        "\"s\", \"eta\": 1.3,\n"
        "      \"layers\": [{ \"thickness_mm\": 2, \"sigma_a_per_mm\": [1, 1, 1], "
        "\"sigma_s_prime_per_mm\": [1, 1, 1] }] } },\n"
        "    { \"primitive\": \"sphere\", \"transform\": { \"translate\": [8, 0, 0], \"scale\": 3 }, "
        "\"material\":\n"
        "      { \"name\": \"b\", \"eta\": 1.3, \"model\": \"beam\", \"sigma_a_per_mm\": [1, 1, 1], "
        "\"sigma_s_prime_per_mm\": [1, 1, 1] } }] }\n");
    char out[32768], err[32768];
    assert_int_equal(run(RENDER " models.json -o models.exr --explain", out, err, sizeof err), 0);
    assert_non_null(strstr(out, "object_ids "));
    assert_non_null(strstr(out, "objects of different media"));
}

/* Oracle: the same for the command line itself. What comes in later versions is unknown now. */
static void wrong_usage_is_code_2(void **state)
{
    (void)state;
    fails_with(RENDER " sphere.json", 2, "render: no --output (-o) IMG was given; try --help\n");
    fails_with(RENDER " sphere.json -o bad.exr --technique magic", 2,
               "render: --technique is \"magic\", expected one of auto, splat, lambert, reference, tsm, "
               "gather\n");
    fails_with(RENDER " sphere.json -o bad.exr --context glx", 2,
               "render: --context is \"glx\", expected one of osmesa, egl, window\n");
    fails_with(RENDER " turn.json -o bad.exr --frames 2:1", 2,
               "render: --frames is \"2:1\", expected FIRST:LAST or one number, each 0 to 99999\n");
    fails_with(RENDER " turn.json -o bad.exr --frames=-1", 2,
               "render: --frames is \"-1\", expected FIRST:LAST or one number, each 0 to 99999\n");
    fails_with(RENDER " turn.json --view --frames 0:1", 2, "render: --view cannot be used with --frames\n");
    fails_with(RENDER " sphere.json --view --explain", 2, "render: --view cannot be used with --explain\n");
    fails_with(RENDER " sphere.json --view --context egl", 2,
               "render: --view cannot be used with --context\n");
    fails_with(RENDER " sphere.json -o bad.exr -t reference --context egl", 2,
               "render: --technique reference cannot be used with --context\n");
    fails_with(RENDER " sphere.json -o bad.exr -t tsm --splat-area overlap", 2,
               "render: --splat-area is of --technique splat alone\n");
    static const char *const grids[] = { "1", "-1", "4097", "4.5", "64x", "Auto", "99999999999999999999" };
    for (size_t i = 0; i < sizeof grids / sizeof *grids; i++) {
        char command[256], message[256];
        snprintf(command, sizeof command, RENDER " sphere.json -o bad.exr --splat-grid=\"%s\"", grids[i]);
        snprintf(message, sizeof message,
                 "render: --splat-grid is \"%s\", expected auto, 0 or a whole number from 2 to 4096\n",
                 grids[i]);
        fails_with(command, 2, message);
    }
    fails_with(RENDER " sphere.json -o bad.exr -t gather --splat-grid 64", 2,
               "render: --splat-grid is of --technique splat alone\n");
    fails_with(RENDER " sphere.json -o bad.exr --splat-grid auto --coherence surface", 2,
               "render: --splat-grid cannot be used with --coherence two-pass or surface: its samples are "
               "texels of "
               "the light's view\n");
    fails_with(
        RENDER " sphere.json -o bad.exr -t tsm --budget-ms 50", 2,
        "render: --budget-ms is of --technique gather and splat alone: no error is predicted of others\n");
    fails_with(RENDER " sphere.json -o bad.exr --epsilon 0.1 --budget-ms 50", 2,
               "render: --budget-ms cannot be used with --epsilon\n");
    fails_with(RENDER " sphere.json -o bad.exr -t tsm --coherence surface", 2,
               "render: --coherence is of --technique gather and splat alone\n");
    static const char *const tsm_options[] = { "--tsm vertex", "--tsm-response exact", "--tsm-part local",
                                               "--tsm-samples 53", "--peel 2" };
    for (size_t i = 0; i < sizeof tsm_options / sizeof *tsm_options; i++) {
        char command[256];
        snprintf(command, sizeof command, RENDER " sphere.json -o bad.exr %s", tsm_options[i]);
        fails_with(command, 2,
                   "render: --tsm, --tsm-response, --tsm-part, --tsm-samples and --peel are of --technique "
                   "tsm alone\n");
    }
    char out[32768], err[32768];
    assert_int_equal(run(RENDER " sphere.json -o bad.exr --epsilon 0", out, err, sizeof out), 2);
    assert_int_equal(run(RENDER " -o bad.exr", out, err, sizeof out), 2);
}

/* Oracle: exit codes and messages. Options of shadow maps are taken together, and refused where they
 * contradict. */
static void shadow_maps_take_their_options(void **state)
{
    (void)state;
    char out[32768], err[32768];
    assert_int_equal(run(RENDER " sphere.json -t tsm --tsm vertex --tsm-response exact --tsm-part global "
                                "--tsm-samples 13 --peel 4 --explain -o good.exr",
                         out, err, sizeof out),
                     0);
    assert_string_equal(err, "");
    assert_non_null(strstr(out, "error not bounded; of the table 0\n"));
    assert_non_null(strstr(out, "4 layers are asked for"));
    assert_int_equal(unlink("good.exr"), 0);
    fails_with(
        RENDER " sphere.json -t tsm --tsm-response texels --peel 2 -o bad.exr", 1,
        "render: response \"texels\" sums all texels at each fragment: it has no parts, no vertices and no "
        "layers\n");
    fails_with(RENDER " sphere.json -t tsm --peel 3 -o bad.exr", 2,
               "render: --peel is \"3\", expected one of 0, 2, 4, 6, 8, 10, 12, 14, 16\n");
}

/* Oracle: the environment, made unfit for each backend: every one tried is named with its reason. */
static void a_missing_context_names_what_was_tried(void **state)
{
    (void)state;
    fails_with("env -u DISPLAY -u WAYLAND_DISPLAY " RENDER " sphere.json -o bad.exr --context window", 1,
               "render: no OpenGL 4.5 context could be had: window: glfwInit: X11: The DISPLAY environment "
               "variable is missing\n");
    fails_with("MESA_GL_VERSION_OVERRIDE=3.1 " RENDER " sphere.json -o bad.exr", 1,
               "render: no OpenGL 4.5 context could be had: osmesa: OSMesaCreateContextAttribs gave no 4.5 "
               "core context; egl: eglCreateContext (4.5 core) failed with EGL error 0x3009\n");
}

/* What --explain prints of each effect stands under its heading, however long names are. */
static void assert_explained_in_columns(const char *text)
{
    const char *const header = strstr(text, "effect ");
    assert_non_null(header);
    const size_t active = (size_t)(strstr(header, "active") - header),
                 reason = (size_t)(strstr(header, "reason") - header);
    size_t longest = 0, count = 0;
    const char *line = strchr(strchr(header, '\n') + 1, '\n') + 1; /* after the units */
    for (; strcspn(line, "\n") > reason; line = strchr(line, '\n') + 1, count++) {
        const size_t name = strcspn(line, " ");
        longest = name > longest ? name : longest;
        assert_true(strspn(line + name, " ") == active - name);
        assert_true(strncmp(line + active, "yes ", 4) == 0 || strncmp(line + active, "no  ", 4) == 0);
        assert_true(line[reason - 1] == ' ' && line[reason - 2] == ' ' && line[reason - 3] != ' ');
        assert_true(line[reason] != ' ');
    }
    assert_int_equal(active, longest + 2);
    assert_true(count > 20);
}

/* Oracle: the JSON that was promised, and the attributes of the picture read back. */
static void results_are_told_as_promised(void **state)
{
    (void)state;
    char out[32768], err[32768];
    assert_int_equal(run(RENDER " sphere.json -o a.exr --json --epsilon 0.02", out, err, sizeof err), 0);
    assert_string_equal(err, "");
    json_t *const result = json_loads(out, 0, NULL);
    assert_non_null(result);
    assert_string_equal(json_string_value(json_object_get(result, "technique")), "gather");
    assert_string_equal(json_string_value(json_object_get(result, "image")), "a.exr");
    assert_close(json_number_value(json_object_get(result, "epsilon")), 0.02, 0, "epsilon");
    assert_true(json_number_value(json_object_get(result, "total_ms")) > 0);
    const double peak_rss_bytes = json_number_value(json_object_get(result, "peak_rss_bytes"));
    assert_true(peak_rss_bytes > 1e6 && peak_rss_bytes < 1e11); /* of a process with OpenGL */
    const json_t *const effects = json_object_get(result, "effects");
    assert_true(json_array_size(effects) >= 11);
    for (size_t i = 0; i < json_array_size(effects); i++) {
        const json_t *const effect = json_array_get(effects, i);
        assert_true(json_is_string(json_object_get(effect, "name")));
        assert_true(json_is_boolean(json_object_get(effect, "active")));
        assert_true(json_is_string(json_object_get(effect, "reason")));
        assert_true(json_is_number(json_object_get(effect, "ms")));
        assert_true(json_is_number(json_object_get(effect, "predicted_ms")));
        assert_true(json_is_number(json_object_get(effect, "error")));
    }
    json_decref(result);
    struct io_image *const image = read_exr("a.exr");
    assert_int_equal(image->width_px, 64);
    assert_int_equal(image->height_px, 48);
    assert_int_equal(image->channel_count, 4);
    assert_string_equal(io_image_find(image, "dipole:technique")->text, "gather");
    assert_string_equal(io_image_find(image, "dipole:version")->text, DIPOLE_VERSION);
    assert_close(io_image_find(image, "dipole:epsilon")->numbers[0], 0.02, 0, "attribute");
    io_image_destroy(image);
    assert_int_equal(
        run(RENDER " sphere.json -o b.exr --explain --size 32x24 -t lambert", out, err, sizeof err), 0);
    assert_non_null(strstr(out, "technique lambert, epsilon 0.01\n"));
    assert_explained_in_columns(out);
    const char *const splat = strstr(out, "\nsplat ");
    assert_non_null(splat);
    assert_non_null(strstr(splat, "  no            0.0        0.0         0  technique is lambert\n"));
    assert_non_null(strstr(out, "b.exr: lambert, epsilon 0.01, "));
}

/* The pictures are alike but for the rounding of positions in float. */
static void assert_alike(const char *path_a, const char *path_b, bool are_alike)
{
    struct io_image *const a = read_exr(path_a), *const b = read_exr(path_b);
    assert_int_equal(relative_rmse(a, b) < 1e-4, are_alike);
    io_image_destroy(a);
    io_image_destroy(b);
}

/* Oracle: cameras that stand where the turned one must be, OpenGL and the reference alike. */
static void frames_are_numbered_pictures(void **state)
{
    (void)state;
    static const char *const techniques[] = { "lambert", "reference --epsilon 0.1 --size 16x12" };
    char command[1024], out[32768], err[32768];
    for (size_t i = 0; i < 2; i++) {
        snprintf(command, sizeof command,
                 "rm -f *.exr; " RENDER " turn.json -o f.exr -t %s --frames 0:2 && " RENDER
                 " turn.json -o front.exr -t %s && " RENDER " turn.json -o back.exr -t %s --camera back",
                 techniques[i], techniques[i], techniques[i]);
        assert_int_equal(run(command, out, err, sizeof err), 0);
        assert_string_equal(err, "");
        assert_non_null(strstr(out, "f.0001.exr: "));
        assert_int_equal(system("test $(ls *.exr | wc -l) = 5"), 0);
        assert_alike("f.0000.exr", "front.exr", true);
        assert_alike("f.0002.exr", "back.exr", true);
        assert_alike("f.0001.exr", "back.exr", false);
    }
    assert_int_equal(system("cmp -s f.0000.exr front.exr"), 0); /* to the last bit */
}

/* Oracle: the JSON that was promised. An array with --frames, of one frame too. */
static void frames_are_told_as_promised(void **state)
{
    (void)state;
    char out[32768], err[32768];
    for (int last = 1; last < 3; last++) {
        char command[512];
        snprintf(command, sizeof command, RENDER " turn.json -o ./a.b.png -t lambert --json --frames 1:%d",
                 last);
        assert_int_equal(run(command, out, err, sizeof err), 0);
        assert_string_equal(err, "");
        json_t *const result = json_loads(out, 0, NULL);
        const json_t *const frames = json_object_get(result, "frames");
        assert_int_equal(json_array_size(frames), last);
        assert_int_equal(json_object_size(result), 2);
        double total_ms = 0;
        for (int k = 0; k < last; k++) {
            const json_t *const frame = json_array_get(frames, (size_t)k);
            char path[32];
            snprintf(path, sizeof path, "./a.b.%04d.png", k + 1);
            assert_string_equal(json_string_value(json_object_get(frame, "image")), path);
            assert_int_equal(json_object_size(frame), 8);
            assert_int_equal(access(path, R_OK), 0);
            total_ms += json_number_value(json_object_get(frame, "total_ms"));
        }
        assert_close(json_number_value(json_object_get(result, "total_ms")), total_ms, 1e-12, "total");
        json_decref(result);
    }
    /* a later frame that cannot be written is an error, those before it are whole */
    assert_int_equal(mkdir("late.0001.exr", 0777), 0);
    assert_int_equal(
        run(RENDER " turn.json -o late.exr -t lambert --json --frames 0:2", out, err, sizeof err), 1);
    assert_string_equal(out, "");
    assert_non_null(strstr(err, "render: late.0001.exr: "));
    io_image_destroy(read_exr("late.0000.exr"));
    assert_int_not_equal(access("late.0002.exr", F_OK), 0);
}

/* Oracle: the linear picture, tone mapped and encoded by hand. */
static void the_png_is_the_tone_mapped_exr(void **state)
{
    (void)state;
    char out[32768], err[32768];
    assert_int_equal(
        run(RENDER " sphere.json -o a.exr && " RENDER " sphere.json -o a.png", out, err, sizeof out), 0);
    struct io_image *const linear = read_exr("a.exr");
    struct io_image *png;
    assert_true(io_photo_read("a.png", IO_PHOTO_SRGB, NULL, &png, NULL));
    size_t count = 0;
    for (size_t i = 0; i < 64 * 48; i++) {
        const float *const rgb = linear->pixels + 4 * i;
        if (fmaxf(fmaxf(rgb[0], rgb[1]), rgb[2]) > 0.59f)
            continue;
        for (size_t c = 0; c < 3; c++) {
            const double found = (double)png->pixels[(size_t)png->channel_count * i + c];
            /* Half a step of 8 bits: the curve's slope is at most 12.92, at least 0.9 of linear. */
            assert_true(fabs(found - (double)rgb[c]) < 0.6 / 255 * 2.5);
            count += rgb[c] > 0;
        }
    }
    assert_true(count > 500);
    io_image_destroy(linear);
    io_image_destroy(png);
}

/* Oracle: the picture with a table baked in memory. A table of other coefficients under the right name is
 * refused, and so is a folder without one. */
static void tables_on_disk_are_found_by_their_medium(void **state)
{
    (void)state;
    char out[32768], err[32768];
    write_file("skin1.json", "{ \"name\": \"Skin 1\", \"eta\": 1.3, \"sigma_a_per_mm\": [0.1, 0.2, 0.3],\n"
                             "  \"sigma_s_prime_per_mm\": [1, 1, 1] }\n");
    assert_int_equal(mkdir("empty", 0777), 0);
    assert_int_equal(run("m=" PROGRAM_FOLDER "/../share/libdipole/materials; " PROGRAM_FOLDER
                         "/lutgen $m/marble.json $m/skin1.json -o tables && " PROGRAM_FOLDER
                         "/lutgen skin1.json -o others",
                         out, err, sizeof out),
                     0);
    assert_int_equal(run(RENDER " sphere.json -o memory.exr -e 0.05 && " RENDER
                                " sphere.json -o disk.exr -e 0.05 --luts tables",
                         out, err, sizeof out),
                     0);
    assert_string_equal(err, "");
    struct io_image *const memory = read_exr("memory.exr"), *const disk = read_exr("disk.exr");
    assert_true(relative_rmse(disk, memory) < 1e-6);
    io_image_destroy(memory);
    io_image_destroy(disk);
    fails_with(RENDER " sphere.json -o bad.exr --luts empty", 1,
               "render: empty: no table of material \"Skin 1\" among 0 *.splat1d.exr and *.splat2d.exr; "
               "bake one with lutgen\n");
    fails_with(
        RENDER " sphere.json -o bad.exr --luts others", 1,
        "render: others/skin1.splat1d.exr: the table is of another medium than material \"Skin 1\": "
        "its sigma_a_per_mm in R is 0.1, the scene's 0.032 (material_hash 1f5541b08983f534, the scene's "
        "a9c2422a5663c1be)\n");
}

/* Draw a scene with a context; prefix: what runs the program, or "". */
static struct io_image *draw_with(const char *prefix, const char *context, const char *scene,
                                  const char *technique)
{
    char command[1024], out[4096], err[4096];
    snprintf(command, sizeof command, "%s" RENDER " %s -o %s.exr --context %s --technique %s", prefix,
             scene, context, context, technique);
    if (run(command, out, err, sizeof out) != 0)
        fail_msg("%s: %s", command, err);
    snprintf(command, sizeof command, "%s.exr", context);
    return read_exr(command);
}

/* Oracle: each other. OSMesa, EGL and a hidden window give one picture, whatever is drawn. */
static void all_contexts_give_the_same_picture(void **state)
{
    (void)state;
    static const char *const techniques[] = { "splat", "lambert", "tsm", "gather" };
    static const char *const scenes[] = { "sphere.json", "many.json" };
    static const struct {
        const char *prefix, *name;
    } contexts[] = { { "", "egl" }, { "xvfb-run -a ", "window" } };
    write_file("many.json", many_json);
    const bool has_display = system("command -v xvfb-run >/dev/null") == 0;
    if (!has_display)
        print_message("  no xvfb-run: the window was not tried\n");
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        for (size_t t = 0; t < sizeof techniques / sizeof *techniques; t++) {
            struct io_image *const osmesa = draw_with("", "osmesa", scenes[s], techniques[t]);
            for (int c = 0; c < 1 + has_display; c++) {
                struct io_image *const other =
                    draw_with(contexts[c].prefix, contexts[c].name, scenes[s], techniques[t]);
                assert_true(relative_rmse(other, osmesa) < 1e-4);
                io_image_destroy(other);
            }
            io_image_destroy(osmesa);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(bad_input_is_one_line_and_no_picture, setup),
        cmocka_unit_test_setup(every_model_is_drawn, setup),
        cmocka_unit_test_setup(wrong_usage_is_code_2, setup),
        cmocka_unit_test_setup(shadow_maps_take_their_options, setup),
        cmocka_unit_test_setup(a_missing_context_names_what_was_tried, setup),
        cmocka_unit_test_setup(results_are_told_as_promised, setup),
        cmocka_unit_test_setup(frames_are_numbered_pictures, setup),
        cmocka_unit_test_setup(frames_are_told_as_promised, setup),
        cmocka_unit_test_setup(the_png_is_the_tone_mapped_exr, setup),
        cmocka_unit_test_setup(tables_on_disk_are_found_by_their_medium, setup),
        cmocka_unit_test_setup(all_contexts_give_the_same_picture, setup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
