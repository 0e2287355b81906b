/* Pictures as files, by their suffix. */
#ifndef RENDERER_OUTPUT_H
#define RENDERER_OUTPUT_H

#include "renderer/render.h"

/* Fails unless path ends in .exr or .png and can be written; *is_png_out says which. */
DIPOLE_CHECKED bool render_output_check(const char *path, bool *is_png_out, dipole_status *status);

/* Write a picture as its name says: tone mapped if it is a PNG. */
DIPOLE_CHECKED bool render_output_save(const char *path, const struct io_image *image,
                                       dipole_status *status);

/* Draw the scene and write it. */
DIPOLE_CHECKED bool render_output_write(struct renderer *renderer, const struct render_options *options,
                                        const char *path, struct render_report *report_out,
                                        dipole_status *status);

#endif
