/* SVG to PNG by librsvg and cairo. */
#include "plot/plot.h"

#include <cairo.h>
#include <librsvg/rsvg.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* More pixels than any figure has; less than would exhaust a small machine. */
static const double side_limit_px = 16384;

struct bytes {
    unsigned char *data;
    size_t size, capacity;
};

static cairo_status_t bytes_append(void *closure, const unsigned char *data, unsigned int size)
{
    struct bytes *const bytes = closure;
    if (bytes->capacity - bytes->size < size) {
        const size_t capacity = 2 * (bytes->size + size) + 65536;
        unsigned char *const grown = realloc(bytes->data, capacity);
        if (!grown)
            return CAIRO_STATUS_NO_MEMORY;
        bytes->data = grown;
        bytes->capacity = capacity;
    }
    memcpy(bytes->data + bytes->size, data, size);
    bytes->size += size;
    return CAIRO_STATUS_SUCCESS;
}

static bool render(RsvgHandle *handle, double scale, struct bytes *bytes, dipole_status *status)
{
    double width = 0, height = 0;
    if (!rsvg_handle_get_intrinsic_size_in_pixels(handle, &width, &height))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "the SVG has no size in pixels");
    width = ceil(width * scale);
    height = ceil(height * scale);
    if (!(width >= 1 && width <= side_limit_px && height >= 1 && height <= side_limit_px))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL,
                           "a PNG of %.0f x %.0f pixels, expected 1 to %.0f", width, height, side_limit_px);

    cairo_surface_t *const surface =
        cairo_image_surface_create(CAIRO_FORMAT_ARGB32, (int)width, (int)height);
    cairo_t *const cairo = cairo_create(surface);
    const RsvgRectangle viewport = { 0, 0, width, height };
    GError *error = NULL;
    const bool is_drawn = rsvg_handle_render_document(handle, cairo, &viewport, &error);
    const bool is_done =
        is_drawn && cairo_status(cairo) == CAIRO_STATUS_SUCCESS &&
        cairo_surface_write_to_png_stream(surface, bytes_append, bytes) == CAIRO_STATUS_SUCCESS;
    if (!is_drawn)
        dipole_fail(status, DIPOLE_BAD_SYNTAX, NULL, "cannot draw the SVG: %s",
                    error ? error->message : "unknown reason");
    else if (!is_done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "out of memory while writing a PNG");
    g_clear_error(&error);
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
    return is_done;
}

bool plot_png_create(const char *svg, size_t size, double scale, unsigned char **png_out, size_t *size_out,
                     dipole_status *status)
{
    *png_out = NULL;
    if (!(scale >= 0.1 && scale <= 10))
        return dipole_fail(status, DIPOLE_BAD_VALUE, NULL, "scale of a PNG is %g, expected 0.1 to 10",
                           scale);
    GError *error = NULL;
    RsvgHandle *const handle = rsvg_handle_new_from_data((const guint8 *)svg, size, &error);
    if (!handle) {
        dipole_fail(status, DIPOLE_BAD_SYNTAX, NULL, "not an SVG: %s",
                    error ? error->message : "unknown reason");
        g_clear_error(&error);
        return false;
    }
    struct bytes bytes = { 0 };
    const bool is_done = render(handle, scale, &bytes, status);
    g_object_unref(handle);
    if (!is_done) {
        free(bytes.data);
        return false;
    }
    *png_out = bytes.data;
    *size_out = bytes.size;
    return true;
}
