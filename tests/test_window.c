/* render --view under Xvfb, driven by xdotool: what the screen shows is the picture. Skipped without them.
 */
#include "check.h"

#include "io/image.h"

#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

/* Shows the scene, takes a screenshot, turns the camera by a left drag and takes another, goes back by R,
 * changes the technique by T, and closes by Q. A window is awaited by its title, a fine picture by its size
 * in the title. */
static const char script[] =
    "#!/bin/sh\n"
    "set -e\n"
    "fine() {\n"
    "  i=0\n"
    "  until xdotool search --name \"$1, 320x240\" >/dev/null 2>&1; do\n"
    "    i=$((i + 1)); [ $i -lt 300 ]; sleep 0.1\n"
    "  done\n"
    "}\n"
    "changed() {\n" /* wait until the screen no longer shows $1, and is fine again; leave it in $2 */
    "  i=0\n"
    "  while fine \"$3\"; import -window \"$window\" $2; cmp -s $1 $2; do\n"
    "    i=$((i + 1)); [ $i -lt 300 ]; sleep 0.1\n"
    "  done\n"
    "  sleep 0.5; fine \"$3\"; import -window \"$window\" $2\n"
    "}\n"
    "\"$RENDER\" window.json --view -o saved.png &\n"
    "viewer=$!\n"
    "trap 'kill $viewer 2>/dev/null || true' EXIT\n"
    "fine gather\n"
    "window=$(xdotool search --name 'window.json - gather' | head -n 1)\n"
    "import -window \"$window\" first.png\n"
    "xdotool mousemove --window \"$window\" 100 120 mousedown 1\n"
    "for x in 110 120 130 140 150 160 170 180; do\n"
    "  xdotool mousemove --window \"$window\" $x 120; sleep 0.05\n"
    "done\n"
    "xdotool mouseup 1\n"
    "changed first.png turned.png gather\n"
    "xdotool key --window \"$window\" r\n"
    "changed turned.png home.png gather\n"
    "xdotool mousemove --window \"$window\" 100 120 mousedown 3 mousemove_relative 60 0 mouseup 3\n"
    "changed home.png relit.png gather\n"
    "xdotool key --window \"$window\" s\n"
    "i=0; until [ -s saved.png ]; do i=$((i + 1)); [ $i -lt 300 ]; sleep 0.1; done\n"
    "xdotool key --window \"$window\" t\n"
    "changed relit.png lambert.png lambert\n"
    "xdotool key --window \"$window\" q || true\n" /* its key-up may find no window left */
    "wait $viewer\n"
    "trap - EXIT\n";

static const char scene[] =
    "{ \"camera\": { \"eye\": [6, 8, 28], \"target\": [0, 0, 0], \"fov_y_deg\": 25, \"size\": [320, 240] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 5 }],\n"
    "  \"background\": [0.05, 0.1, 0.2],\n"
    "  \"objects\": [{ \"primitive\": \"torus\", \"detail\": 64, \"transform\": { \"scale\": 4 },\n"
    "                \"material\": \"skin1\", \"roughness\": 0.4 }] }\n";

static void write_file(const char *path, const char *text)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static struct io_image *read_png(const char *path)
{
    struct io_image *image;
    dipole_status status;
    if (!io_photo_read(path, IO_PHOTO_SRGB, NULL, &image, &status))
        fail_msg("%s: %s", path, status.message);
    assert_int_equal(image->width_px, 320);
    assert_int_equal(image->height_px, 240);
    return image;
}

/* Root mean square of the difference, in linear light. */
static double difference(const char *a_path, const char *b_path)
{
    struct io_image *const a = read_png(a_path), *const b = read_png(b_path);
    double sum2 = 0;
    for (size_t i = 0; i < 320 * 240; i++) {
        for (size_t c = 0; c < 3; c++) {
            const double d = (double)a->pixels[(size_t)a->channel_count * i + c] -
                             (double)b->pixels[(size_t)b->channel_count * i + c];
            sum2 += d * d;
        }
    }
    io_image_destroy(a);
    io_image_destroy(b);
    return sqrt(sum2 / (320 * 240 * 3));
}

/* Oracle: the same scene without a window; 8 bits on the screen are all that may differ. */
static void the_window_shows_the_picture_and_obeys(void **state)
{
    (void)state;
    if (system("command -v xvfb-run >/dev/null && command -v xdotool >/dev/null && "
               "command -v import >/dev/null") != 0) {
        print_message("  no xvfb-run, xdotool or import\n");
        skip();
    }
    assert_int_equal(system("rm -f *.png"), 0);
    write_file("window.json", scene);
    write_file("window.sh", script);
    assert_int_equal(system(PROGRAM_FOLDER "/render window.json -o headless.png >/dev/null"), 0);
    /* each from a display number of its own: two that look for a free one at once find the same */
    const int code = system("RENDER=" PROGRAM_FOLDER
                            "/render xvfb-run -a -n $((100 + $$ % 900)) -s '-screen 0 800x600x24' "
                            "sh window.sh >window.log 2>&1");
    if (code != 0)
        print_error("window.sh ended with %d: see window.log\n", WEXITSTATUS(code));
    assert_int_equal(code, 0);
    assert_true(difference("first.png", "headless.png") < 0.005);
    assert_true(difference("home.png", "headless.png") < 0.005);
    assert_true(difference("saved.png", "relit.png") < 0.005);
    assert_true(difference("turned.png", "headless.png") > 0.01);
    assert_true(difference("relit.png", "headless.png") > 0.01);
    assert_true(difference("lambert.png", "relit.png") > 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(the_window_shows_the_picture_and_obeys) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
