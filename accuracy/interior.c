#include "accuracy/interior.h"

#include "renderer/reference_pixel.h"

#include <math.h>
#include <stdlib.h>

/* The cosine of the angle that a pixel's surface may turn by. */
#define CREASE_COSINE 0.8

/* How wide a pixel is where the surface is, across the line of sight. */
static double pixel_width_mm(const struct render_pixel_view *view, const double position_mm[3])
{
    double place_mm[3];
    render_projection_to_view(&view->camera, position_mm, place_mm);
    const double away_mm = view->camera.is_orthographic ? 1 : place_mm[2];
    return 2 * view->camera.half_width * away_mm / view->width_px;
}

static bool is_one_surface(const struct render_pixel_view *view, const struct render_pixel *pixel)
{
    const struct render_surface_point *const first = &pixel->groups[0].points[0];
    const double limit_mm = pixel_width_mm(view, first->position_mm);
    if (pixel->hit_count < RENDER_PIXEL_RAYS)
        return false;
    for (int g = 0; g < pixel->group_count; g++) {
        for (int i = 0; i < pixel->groups[g].count; i++) {
            const struct render_surface_point *const point = &pixel->groups[g].points[i];
            double off_mm = 0;
            for (int k = 0; k < 3; k++)
                off_mm += first->facet_normal[k] * (point->position_mm[k] - first->position_mm[k]);
            if (point->object != first->object || fabs(off_mm) > limit_mm ||
                render_dot(first->facet_normal, point->facet_normal) < CREASE_COSINE)
                return false;
        }
    }
    return true;
}

static void sort(const struct render_pixel_view *view, unsigned char *kinds)
{
    for (int y = 0; y < view->height_px; y++) {
        for (int x = 0; x < view->width_px; x++) {
            struct render_pixel pixel;
            render_pixel_trace(view, x, y, &pixel);
            kinds[(size_t)y * (size_t)view->width_px + (size_t)x] = pixel.hit_count == 0 ? ACCURACY_EMPTY
                                                                    : is_one_surface(view, &pixel)
                                                                        ? ACCURACY_INTERIOR
                                                                        : ACCURACY_EDGE;
        }
    }
}

/* What has a neighbour that is no interior is at the edge itself. */
static void spread_edges(int width_px, int height_px, const unsigned char *kinds, unsigned char *out)
{
    for (int y = 0; y < height_px; y++) {
        for (int x = 0; x < width_px; x++) {
            const size_t at = (size_t)y * (size_t)width_px + (size_t)x;
            out[at] = kinds[at];
            for (int j = -1; j <= 1; j++) {
                for (int i = -1; i <= 1; i++) {
                    const bool is_outside =
                        x + i < 0 || x + i >= width_px || y + j < 0 || y + j >= height_px;
                    if (kinds[at] == ACCURACY_INTERIOR &&
                        (is_outside ||
                         kinds[(size_t)(y + j) * (size_t)width_px + (size_t)(x + i)] != ACCURACY_INTERIOR))
                        out[at] = ACCURACY_EDGE;
                }
            }
        }
    }
}

bool accuracy_interior_create(const struct io_scene *scene, unsigned char **kinds_out,
                              dipole_status *status)
{
    const struct io_camera *const camera = &scene->camera;
    const size_t count = (size_t)camera->width_px * (size_t)camera->height_px;
    const struct render_ball ball = render_ball_of_scene(scene);
    struct render_tracer *tracer = NULL;
    unsigned char *const kinds = calloc(count + 1, 1);
    struct render_pixel_medium *const media = calloc(scene->object_count + 1, sizeof *media);
    struct render_pixel_view view = {
        .scene = scene, .media = media, .width_px = camera->width_px, .height_px = camera->height_px
    };
    *kinds_out = calloc(count + 1, 1);
    bool done = kinds && media && *kinds_out;
    if (!done)
        dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for the edges of %zu pixels", count);
    done = done && render_tracer_create(scene, &tracer, status);
    if (done) {
        for (size_t i = 0; i < scene->object_count; i++)
            media[i].group_mm = INFINITY;
        view.tracer = tracer;
        render_projection_of_camera(camera, &ball, &view.camera);
        sort(&view, kinds);
        spread_edges(camera->width_px, camera->height_px, kinds, *kinds_out);
    } else {
        free(*kinds_out);
        *kinds_out = NULL;
    }
    render_tracer_destroy(tracer);
    free(media);
    free(kinds);
    return done;
}
