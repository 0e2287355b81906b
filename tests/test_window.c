/* render --view under Xvfb, driven by xdotool: what the screen shows is the picture. Skipped without them.
 */
#include "window_files.h"

/* Shows the scene, takes a screenshot, turns the camera by a left drag and takes another, goes back by R,
 * changes the technique by T, and closes by Q. A window is awaited by its title, a fine picture by its size
 * in the title. */
static const char script[] =
    "#!/bin/sh\n"
    "set -e\n"
    "fine() {\n"
    "  i=0\n"
    "  until xdotool search --name \"$1, 320x240\" >/dev/null 2>&1; do\n"
    "    i=$((i + 1)); [ $i -lt 300 ] && kill -0 $viewer || exit 1; sleep 0.1\n"
    "  done\n"
    "}\n"
    "changed() {\n" /* wait until the screen no longer shows $1, and is fine again; leave it in $2 */
    "  k=0\n"
    "  while fine \"$3\"; import -window \"$window\" $2; cmp -s $1 $2; do\n"
    "    k=$((k + 1)); [ $k -lt 300 ] || exit 1; sleep 0.1\n"
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

/* Of whole pictures. */
static double picture_difference(const char *a, const char *b)
{
    return difference((struct part){ a, 0 }, (struct part){ b, 0 }, 320);
}

/* Oracle: the same scene without a window; 8 bits on the screen are all that may differ. */
static void the_window_shows_the_picture_and_obeys(void **state)
{
    (void)state;
    need_display();
    assert_int_equal(system("rm -f *.png"), 0);
    write_file("window.json", scene);
    assert_int_equal(system(PROGRAM_FOLDER "/render window.json -o headless.png >/dev/null"), 0);
    run_script("window.sh", script, "800x600");
    assert_true(picture_difference("first.png", "headless.png") < 0.005);
    assert_true(picture_difference("home.png", "headless.png") < 0.005);
    assert_true(picture_difference("saved.png", "relit.png") < 0.005);
    assert_true(picture_difference("turned.png", "headless.png") > 0.01);
    assert_true(picture_difference("relit.png", "headless.png") > 0.01);
    assert_true(picture_difference("lambert.png", "relit.png") > 0.01);
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(the_window_shows_the_picture_and_obeys) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
