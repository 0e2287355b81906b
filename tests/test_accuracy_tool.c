/* accuracy as a user runs it: its page in a browser, going on after an interruption, messages. */
#include "tests/run_tool.h"

#include "io/file.h"
#include "io/image.h"
#include "tests/browser.h"
#include "tests/svg_check.h"

#include <signal.h>

static const char scene[] =
    "{ \"camera\": { \"eye\": [5, 10, 48], \"target\": [0, 0, 0], \"fov_y_deg\": 38 },\n"
    "  \"lights\": [{ \"kind\": \"directional\", \"direction\": [-0.5, -0.6, -0.6], \"irradiance\": 3 }],\n"
    "  \"objects\": [{ \"primitive\": \"sphere\", \"detail\": 48, \"transform\": { \"scale\": 12 },\n"
    "                \"material\": \"marble\", \"specular\": false }] }\n";

static json_t *results_of(const char *path)
{
    json_error_t error;
    json_t *const root = json_load_file(path, 0, &error);
    if (!root)
        fail_msg("%s: %s", path, error.text);
    return root;
}

/* ---- the page ----------------------------------------------------------------------------------- */

/* The middle of the first element that the selector finds, after it is scrolled to. */
static void find(struct browser *browser, const char *selector, double place_px[2])
{
    char script[512];
    snprintf(script, sizeof script,
             "(function () { var e = document.querySelector('%s'); e.scrollIntoView({ block: 'center' }); "
             "var b = e.getBoundingClientRect(); return b.x + b.width / 2; })()",
             selector);
    place_px[0] = browser_number(browser, script);
    snprintf(script, sizeof script,
             "(function () { var b = document.querySelector('%s').getBoundingClientRect(); return b.y + "
             "b.height / 2; })()",
             selector);
    place_px[1] = browser_number(browser, script);
}

/* Values stand beside the mouse, and go when it does. */
static void check_hover(struct browser *browser)
{
    double place_px[2];
    char text[512];
    assert_true(browser_number(browser, "document.querySelectorAll('svg [data-tip]').length") > 10);
    find(browser, "svg [data-tip]", place_px);
    browser_mouse(browser, "mouseMoved", place_px[0], place_px[1]);
    browser_wait_for(browser, "document.getElementById('tip').offsetWidth");
    browser_run(browser, "document.getElementById('tip').textContent", text, sizeof text);
    assert_non_null(strstr(text, " ms, RMSE "));
    assert_true(browser_number(browser, "(function () { var b = document.getElementById('tip')"
                                        ".getBoundingClientRect(); return b.left >= 0 && b.right <= "
                                        "document.documentElement.clientWidth; })()") == 1);
    browser_mouse(browser, "mouseMoved", 2, 2);
    browser_wait_for(browser, "document.getElementById('tip').offsetWidth === 0");
}

/* Every link leads to something on the page, and a click scrolls there. */
static void check_links(struct browser *browser)
{
    double place_px[2];
    assert_true(browser_number(browser, "document.links.length") > 10);
    assert_close(browser_number(browser, "Array.from(document.links).filter(function (a) { return !"
                                         "document.querySelector(a.getAttribute('href')); }).length"),
                 0, 0, "dead links");
    browser_number(browser, "(scrollTo(0, 0), 0)");
    find(browser, "nav a", place_px);
    browser_mouse(browser, "mousePressed", place_px[0], place_px[1]);
    browser_mouse(browser, "mouseReleased", place_px[0], place_px[1]);
    browser_wait_for(browser, "location.hash === '#knobs' && scrollY > 0");
}

/* Decode a screenshot and see that it shows dark text and colour on white, of the size that was asked. */
static void check_screenshot(struct browser *browser, int width_px, int height_px)
{
    char *const text = browser_screenshot(browser);
    FILE *const file = popen("base64 -d > shot.png", "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(pclose(file), 0);
    free(text);
    struct io_image *image;
    assert_true(io_photo_read("shot.png", IO_PHOTO_SRGB, NULL, &image, NULL));
    assert_int_equal(image->width_px, width_px);
    assert_int_equal(image->height_px, height_px);
    size_t white = 0, dark = 0, coloured = 0;
    const size_t pixels = (size_t)image->width_px * (size_t)image->height_px;
    for (size_t i = 0; i < pixels; i++) {
        const float *const c = image->pixels + (size_t)image->channel_count * i;
        white += c[0] > 0.95f && c[1] > 0.95f && c[2] > 0.95f;
        dark += c[0] < 0.3f && c[1] < 0.3f && c[2] < 0.3f;
        coloured += fabsf(c[0] - c[2]) > 0.3f;
    }
    assert_true(white > pixels / 2);
    assert_true(dark > pixels / 1000);
    assert_true(coloured > 50);
    io_image_destroy(image);
}

/* Oracle: what a reader of the page does. */
static void the_page_works_in_a_browser(void **state)
{
    (void)state;
    struct tool_run run = { .out = NULL };
    struct browser browser;
    char folder[2048], url[4096];
    write_text("scene.json", scene);
    run_tool(&run, "accuracy", "scene.json", "-o", "report", "--quick", "--size", "64x48", "-q");
    assert_done(&run);
    json_t *const results = results_of("report/accuracy.json");
    assert_true(json_array_size(json_object_get(results, "points")) > 10);
    assert_true(json_array_size(json_object_get(results, "not_called_for")) > 3);
    json_decref(results);
    assert_non_null(getcwd(folder, sizeof folder));
    snprintf(url, sizeof url, "file://%s/report/report.html", folder);
    browser_start(&browser, url, 1100, 800);
    browser_wait_for(&browser, "document.readyState === 'complete' && document.links.length > 0");
    assert_close(browser_number(&browser, "performance.getEntriesByType('resource').filter(function (r) { "
                                          "return !r.name.startsWith('data:'); }).length"),
                 0, 0, "other files");
    assert_close(browser_number(&browser, "Array.from(document.images).filter(function (i) { return !"
                                          "i.naturalWidth; }).length"),
                 0, 0, "broken pictures");
    assert_true(browser_number(&browser, "document.images.length") >= 3);
    assert_true(browser_number(&browser, "document.documentElement.scrollWidth") <= 1100);
    check_screenshot(&browser, 1100, 800);
    check_hover(&browser);
    check_links(&browser);
    browser_end(&browser);
    free(run.out);
}

/* ---- runs --------------------------------------------------------------------------------------- */

/* Interrupted once it has drawn something, it ends with a page, and the next run goes on from there. */
static void what_was_interrupted_goes_on(void **state)
{
    (void)state;
    static const char *const arguments[] = { "accuracy", "scene.json", "-o", "report", "--quick", "--size",
                                             "48x36",    "--repeat",   "2",  "-q",     NULL };
    struct tool_run run = { .out = NULL };
    int status = 0;
    write_text("scene.json", scene);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        execv(PROGRAM_FOLDER "/accuracy", (char *const *)(const void *)arguments);
        _exit(127);
    }
    while (access("report/accuracy.json", F_OK) != 0 && waitpid(child, &status, WNOHANG) == 0)
        usleep(10000);
    kill(child, SIGINT);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_int_equal(access("report/report.html", F_OK), 0);
    run_tool_limited(&run, 0, "accuracy", arguments + 1);
    assert_done(&run);
    json_t *first = results_of("report/accuracy.json");
    run_tool_limited(&run, 0, "accuracy", arguments + 1); /* all is there: nothing is timed again */
    assert_done(&run);
    json_t *second = results_of("report/accuracy.json");
    const json_t *const points = json_object_get(first, "points"), *const points_again =
                                                                       json_object_get(second, "points");
    assert_int_equal(json_array_size(points), json_array_size(points_again));
    for (size_t i = 0; i < json_array_size(points); i++)
        assert_true(json_equal(json_object_get(json_array_get(points, i), "times_ms"),
                               json_object_get(json_array_get(points_again, i), "times_ms")));
    json_decref(first);
    json_decref(second);
    free(run.out);
}

static void wrong_use_is_told(void **state)
{
    (void)state;
    static const struct {
        const char *arguments[8];
        int exit_code;
        const char *message;
    } rows[] = {
        { { "scene.json" }, 2, "accuracy: no --output (-o) DIR was given; try --help\n" },
        { { "--calibrate", "-o", "x" }, 2, "accuracy: --calibrate takes no scene and no --output\n" },
        { { "--monte-carlo" },
          2,
          "accuracy: --monte-carlo takes a MATERIAL.json, and no --output or --calibrate\n" },
        { { "-o", "x", "--g", "0.5" },
          2,
          "accuracy: --photons, --seed and --g are of --monte-carlo alone\n" },
        { { "none.json", "-o", "x" },
          1,
          "accuracy: none.json: cannot be read: No such file or directory\n" },
    };
    struct tool_run run = { .out = NULL };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        run_tool_limited(&run, 0, "accuracy", rows[i].arguments);
        assert_failed(&run, rows[i].exit_code, rows[i].message);
        assert_int_equal(count_entries("x"), -1);
    }
    free(run.out);
}

/* Oracle: the same seed, the same bytes but for the time it took; another seed, others within errors. */
static void photons_follow_their_seed(void **state)
{
    (void)state;
    struct tool_run run = { .out = NULL };
    json_t *results[3];
    static const char *const seeds[] = { "7", "7", "8" };
    for (int i = 0; i < 3; i++) {
        run_tool(&run, "accuracy", "--monte-carlo", "marble", "--photons", "20000", "--seed", seeds[i],
                 "--json");
        assert_done(&run);
        results[i] = json_loads(run.out, 0, NULL);
        assert_non_null(results[i]);
        json_object_del(results[i], "seconds");
    }
    assert_true(json_equal(results[0], results[1]));
    assert_false(json_equal(results[0], results[2]));
    for (int i = 0; i < 3; i++)
        json_decref(results[i]);
    free(run.out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        tool_test(the_page_works_in_a_browser),
        tool_test(what_was_interrupted_goes_on),
        tool_test(wrong_use_is_told),
        tool_test(photons_follow_their_seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
