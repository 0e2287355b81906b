/* render --view under Xvfb with the panel open, driven by xdotool: technique, material, comparison, saving.
 * Skipped without them. */
#include "window_files.h"

#include "io/scene_file.h"

enum { PANEL = 350, WIDTH = 640 };

/* Where things stand in the panel, with one object and nothing to warn of: docs/window.md has a picture. Of
 * the list of techniques the entries stand below each other from its second line on. */
static const char script[] =
    "#!/bin/sh\n"
    "set -e\n"
    "until_true() { i=0; until \"$@\" >/dev/null 2>&1; do i=$((i + 1)); [ $i -lt 600 ]; sleep 0.1; done; "
    "}\n"
    "titled() { xdotool search --name \"panel.json - $1\"; }\n"
    "last=none\n"
    "settled() {\n" /* fine, the same for a while, and no longer what was there last; left in $2 */
    "  titled \"$1\" && import -window \"$window\" settling.png && sleep 0.5 && titled \"$1\" &&\n"
    "    import -window \"$window\" $2 && cmp -s settling.png $2 && ! cmp -s $last $2\n"
    "}\n"
    "settle() { sleep 0.5; until_true settled \"$1\" $2; last=$2; }\n"
    "to() { xdotool mousemove --window \"$window\" $1 $2; sleep 0.2; }\n"
    "click() { to $1 $2; xdotool mousedown 1; sleep 0.2; xdotool mouseup 1; sleep 0.5; }\n"
    "drag() { to $1 $2; xdotool mousedown 1; sleep 0.2; to $((($1 + $3) / 2)) $2; to $3 $2; xdotool "
    "mouseup 1; "
    "}\n"
    "key() { xdotool key --window \"$window\" $1; }\n"
    "\"$RENDER\" panel.json --view --epsilon 0.1 -o folder/saved.png &\n"
    "viewer=$!\n"
    "trap 'kill $viewer 2>/dev/null || true' EXIT\n"
    "until_true titled 'gather, 640x800'\n"
    "window=$(titled 'gather, 640x800' | head -n 1)\n"
    "to 600 700\n"
    "settle 'gather, 640x800' first.png\n"
    "key Tab; settle 'gather, 990x800' closed.png\n"
    "key Tab; settle 'gather, 640x800' opened.png\n"
    "click 225 129; click 170 192; to 600 700; settle 'lambert, 640x800' lambert.png\n"
    "click 225 129; click 170 154; to 600 700; settle 'gather, 640x800' again.png\n"
    "drag 175 447 200 447; to 600 700; settle 'gather, 640x800' edited.png\n"
    "key c; settle 'gather, 640x800' split.png\n"
    "drag 670 400 500 400; to 600 700; settle 'gather, 640x800' moved.png\n"
    "key c; settle 'gather, 640x800' difference.png\n"
    "key c; settle 'gather, 640x800' alone.png\n"
    "rmdir folder; key s; settle 'gather, 640x800' failed.png; mkdir folder\n"
    "click 100 354; click 100 429\n" /* close Material, open Save */
    "click 140 504; until_true test -s panel_view.json\n"
    "click 50 504; until_true test -s folder/saved.png\n"
    "to 600 600\n"
    "drag 600 600 680 600; sleep 1; settle 'gather, 640x800' turned.png\n"
    "key q || true\n" /* its key-up may find no window left */
    "wait $viewer\n"
    "trap - EXIT\n";

static const char scene_text[] =
    "{ \"camera\": { \"eye\": [6, 8, 34], \"target\": [0, 0, 0], \"fov_y_deg\": 25, \"size\": [640, 800] "
    "},\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [0.8, -0.6, -0.3], \"irradiance\": 5 }],\n"
    "  \"background\": [0.05, 0.1, 0.2],\n"
    "  \"objects\": [{ \"primitive\": \"torus\", \"detail\": 32, \"transform\": { \"scale\": 4 },\n"
    "                \"material\": \"skin1\", \"roughness\": 0.4 }] }\n";

static double picture_difference(const char *a, const char *b)
{
    return difference((struct part){ a, PANEL }, (struct part){ b, PANEL }, WIDTH);
}

/* 8 bits on the screen are all that may differ; what is changed differs by far more. */
#define SAME 0.005
#define CHANGED 0.01

static void check_pictures(void)
{
    assert_true(picture_difference("first.png", "opened.png") < SAME);
    assert_true(difference((struct part){ "first.png", 0 }, (struct part){ "closed.png", 0 }, PANEL) >
                CHANGED);
    assert_true(picture_difference("first.png", "lambert.png") > CHANGED);
    assert_true(picture_difference("first.png", "again.png") < SAME);
    assert_true(picture_difference("again.png", "edited.png") > CHANGED);
    assert_true(picture_difference("edited.png", "alone.png") < SAME);
    assert_true(picture_difference("edited.png", "difference.png") > CHANGED);
    assert_true(picture_difference("alone.png", "turned.png") > CHANGED);
    /* a picture that could not be saved is told of in a corner, and the window goes on */
    assert_true(picture_difference("alone.png", "failed.png") > 0.001);
}

/* The divider goes from column 670 to 500: names and the divider itself aside, what lies between changes,
 * and nothing else. */
static void check_divider(void)
{
    static const struct {
        int left, width;
        bool is_changed;
    } columns[] = { { PANEL, 490 - PANEL, false }, { 515, 140, true }, { 685, 300, false } };
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        const double found = difference((struct part){ "split.png", columns[i].left },
                                        (struct part){ "moved.png", columns[i].left }, columns[i].width);
        assert_true(columns[i].is_changed ? found > CHANGED : found < SAME);
    }
}

/* Oracle: the scene that was read; the mouse over the panel has changed a material there and no camera. */
static void check_scene(void)
{
    struct io_scene *before, *after;
    assert_true(io_scene_read("panel.json", NULL, &before, NULL));
    assert_true(io_scene_read("panel_view.json", NULL, &after, NULL));
    for (int k = 0; k < 3; k++) {
        assert_true(before->camera.eye_mm[k] == after->camera.eye_mm[k]);
        assert_true(before->lights[0].direction[k] == after->lights[0].direction[k]);
    }
    for (int c = 0; c < 3; c++) {
        const dipole_medium *const a = &before->objects[0].material.layers[c][0].medium;
        const dipole_medium *const b = &after->objects[0].material.layers[c][0].medium;
        assert_true(c == 1 ? b->sigma_a_per_mm > 2 * a->sigma_a_per_mm
                           : b->sigma_a_per_mm == a->sigma_a_per_mm);
        assert_true(b->sigma_s_prime_per_mm == a->sigma_s_prime_per_mm);
    }
    io_scene_destroy(before);
    io_scene_destroy(after);
}

/* Oracles: what was on the screen before, and the scene that was saved, drawn without a window. */
static void the_panel_does_what_it_says(void **state)
{
    (void)state;
    need_display();
    assert_int_equal(system("rm -rf *.png panel_view.json folder && mkdir folder"), 0);
    write_file("panel.json", scene_text);
    run_script("panel.sh", script, "1200x820");
    check_pictures();
    check_divider();
    check_scene();
    assert_int_equal(
        system(PROGRAM_FOLDER "/render panel_view.json --epsilon 0.1 -o headless.png >/dev/null"), 0);
    assert_true(difference((struct part){ "folder/saved.png", 0 }, (struct part){ "headless.png", 0 },
                           WIDTH) < SAME);
    assert_true(difference((struct part){ "alone.png", PANEL }, (struct part){ "headless.png", 0 }, WIDTH) <
                SAME);
}

int main(void)
{
    const struct CMUnitTest tests[] = { cmocka_unit_test(the_panel_does_what_it_says) };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
