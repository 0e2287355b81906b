/* What a body of a medium leaves of light that crosses it, by the length of the way. Pure C. theory.md T69.
 */
#ifndef RENDERER_PASSAGE_H
#define RENDERER_PASSAGE_H

#include "io/scene_file.h"

/* Of the longest way beyond which less than this is left of any channel nothing is tabulated: light falls
 * on as it did. */
#define RENDER_PASSAGE_LEAST 1e-7

/*
 * Tabulate the transmittance of a slab of the material, without layers, by its thickness: light that comes
 * at a right angle, diffuse and unscattered alike. Fails with DIPOLE_OUT_OF_MEMORY, or as
 * dipole_coefficients_init does.
 */
DIPOLE_CHECKED bool render_passage_fill(const struct io_material *material, struct io_passage *passage,
                                        dipole_status *status);

/* What is left of a channel behind so long a way, length_mm >= 0: 0 to 1, falling. */
double render_passage_left(const struct io_passage *passage, double length_mm, int channel);

#endif
