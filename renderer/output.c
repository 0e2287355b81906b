#include "renderer/output.h"

#include "io/file.h"
#include "io/image.h"

#include <string.h>

static bool ends_with(const char *path, const char *suffix)
{
    const size_t length = strlen(path), suffix_length = strlen(suffix);
    return length > suffix_length && strcmp(path + length - suffix_length, suffix) == 0;
}

bool render_output_check(const char *path, bool *is_png_out, dipole_status *status)
{
    const dipole_place place = { .source = path };
    *is_png_out = ends_with(path, ".png");
    if (!*is_png_out && !ends_with(path, ".exr"))
        return dipole_fail(status, DIPOLE_BAD_VALUE, &place,
                           "unknown kind of picture, expected a name that ends in .exr or .png");
    return io_file_check_writable(path, status);
}

bool render_output_save(const char *path, const struct io_image *image, dipole_status *status)
{
    return ends_with(path, ".png") ? io_png_write(path, image, status)
                                   : io_exr_write(path, image, false, status);
}

bool render_output_write(struct renderer *renderer, const struct render_options *options, const char *path,
                         struct render_report *report_out, dipole_status *status)
{
    struct render_options for_file = *options;
    struct io_image *image = NULL;
    const bool done = render_output_check(path, &for_file.is_tone_mapped, status) &&
                      render_draw(renderer, &for_file, &image, report_out, status) &&
                      render_output_save(path, image, status);
    io_image_destroy(image);
    return done;
}
