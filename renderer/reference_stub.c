#include "renderer/reference.h"
bool render_reference_draw(const struct io_scene *scene, const struct render_options *options,
                           struct io_image **image_out, struct render_report *report_out,
                           dipole_status *status)
{
    (void)scene;
    (void)options;
    (void)report_out;
    *image_out = NULL;
    return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "not yet");
}
