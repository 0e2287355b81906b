/* A picture of a scene as a target: the radiance of its pixels is linear in the profile. theory.md T16,
 * T38. */
#ifndef FIT_PICTURE_H
#define FIT_PICTURE_H

#include "fit/operator.h"
#include "fit/pixels.h"
#include "io/scene_file.h"

struct fit_picture_request {
    const struct io_scene *scene; /* of one material                                                   */
    const struct fit_photo *photo;
    const char *photo_path;      /* for messages                                                       */
    const struct io_image *mask; /* NULL: none                                                         */
    bool is_gain_free, is_ambient_free, is_black_free;
    size_t pixel_limit;   /* 0: FIT_PIXEL_LIMIT                                                 */
    int nodes_per_octave; /* that the profile is known at, fit/operator.h; 0: FIT_NODES_PER_OCTAVE */
};
#define FIT_PIXEL_LIMIT ((size_t)12000)

/* Must outlive the targets it makes. */
struct fit_picture;

/* Get a renderer for the scene. The request, and what it names, must outlive the picture. Fails with
 * DIPOLE_BAD_VALUE (sizes that differ), or as render_create does. */
DIPOLE_CHECKED bool fit_picture_create(const struct fit_picture_request *request,
                                       struct fit_picture **picture_out, dipole_status *status);
void fit_picture_destroy(struct fit_picture *picture);

/*
 * Draw what light and view say, choose pixels, and make the target, with as many light samples as a first
 * look takes, or as close as fit_picture_is_fine() last found that they should be. Its rows stay the
 * picture's. Fails with what render_capture_create, fit_pixels_create and fit_operator_create fail with, or
 * DIPOLE_BAD_VALUE (no light).
 */
DIPOLE_CHECKED bool fit_picture_prepare(struct fit_picture *picture, const struct fit_progress *progress,
                                        struct fit_target *target_out, dipole_status *status);

/*
 * Whether light samples are as close as the coefficients found need them; if not, the next
 * fit_picture_prepare takes closer ones. Where so many cannot be had the answer is true, and note says how
 * much that costs.
 *
 *   stacks  of the channels that can be trusted; NULL for the others
 *   target  of the last fit_picture_prepare; its systematic errors get what sampling adds
 */
bool fit_picture_is_fine(struct fit_picture *picture, dipole_stack *const stacks[FIT_CHANNEL_COUNT],
                         struct fit_target *target, char *note, size_t note_size);

/* Call pixels outliers where a channel of the target, as fit_picture_prepare made it, was given no weight.
 */
void fit_picture_mark_outliers(struct fit_picture *picture, const struct fit_target *target);

/* Of the last fit_picture_prepare. */
const struct fit_pixels *fit_picture_pixels(const struct fit_picture *picture);
const struct render_capture *fit_picture_capture(const struct fit_picture *picture);

#endif
