/* What the tests that look at a window share: files, pictures, and a run under Xvfb driven by xdotool. */
#ifndef WINDOW_FILES_H
#define WINDOW_FILES_H

#include "check.h"

#include "io/image.h"

#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

static inline void write_file(const char *path, const char *text)
{
    FILE *const file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static inline struct io_image *read_png(const char *path)
{
    struct io_image *image;
    dipole_status status;
    if (!io_photo_read(path, IO_PHOTO_SRGB, NULL, &image, &status))
        fail_msg("%s: %s", path, status.message);
    return image;
}

/* Columns of a picture from left on; all rows. */
struct part {
    const char *path;
    int left;
};

/* Root mean square of the difference of two parts of that width, in linear light. */
static inline double difference(struct part a, struct part b, int width)
{
    struct io_image *const one = read_png(a.path), *const other = read_png(b.path);
    const int height = one->height_px;
    assert_true(one->width_px >= a.left + width && other->width_px >= b.left + width);
    assert_int_equal(other->height_px, height);
    double sum2 = 0;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const size_t i = (size_t)(y * one->width_px + a.left + x) * (size_t)one->channel_count;
            const size_t k = (size_t)(y * other->width_px + b.left + x) * (size_t)other->channel_count;
            for (size_t c = 0; c < 3; c++) {
                const double d = (double)one->pixels[i + c] - (double)other->pixels[k + c];
                sum2 += d * d;
            }
        }
    }
    io_image_destroy(one);
    io_image_destroy(other);
    return sqrt(sum2 / (3.0 * width * height));
}

/* Skips the test where there is no display to be had. */
static inline void need_display(void)
{
    if (system("command -v xvfb-run >/dev/null && command -v xdotool >/dev/null && "
               "command -v import >/dev/null") == 0)
        return;
    print_message("  no xvfb-run, xdotool or import\n");
    skip();
}

/* Run a script on a screen of that size; $RENDER is the program. */
static inline void run_script(const char *path, const char *text, const char *size)
{
    char command[512];
    write_file(path, text);
    /* Each from a display number of its own: two that look for a free one at once find the same. Without
     * -noreset the server starts anew when the first xdotool leaves, and refuses the window meanwhile. */
    snprintf(command, sizeof command,
             "RENDER=" PROGRAM_FOLDER
             "/render xvfb-run -a -n $((100 + $$ %% 900)) -s '-noreset -screen 0 %sx24' "
             "sh %s >%s.log 2>&1",
             size, path, path);
    const int code = system(command);
    if (code != 0) {
        print_error("%s ended with %d and printed:\n", path, WEXITSTATUS(code));
        snprintf(command, sizeof command, "cat %s.log >&2", path);
        (void)!system(command);
    }
    assert_int_equal(code, 0);
}

#endif
