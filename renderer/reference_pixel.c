#include "renderer/reference_pixel.h"

#include "renderer/area_light.h"
#include "renderer/gloss.h"
#include "renderer/plan.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- rays --------------------------------------------------------------------------------------- */

/* A ray from the camera's near plane through a place in the picture, in pixels from the top left. */
static void camera_ray(const struct render_pixel_view *view, double x_px, double y_px, double origin_mm[3],
                       double direction[3])
{
    const struct render_projection *const camera = &view->camera;
    const double across = (2 * x_px / view->width_px - 1) * camera->half_width;
    const double up = (1 - 2 * y_px / view->height_px) * camera->half_height;
    for (int k = 0; k < 3; k++) {
        const double aside = across * camera->right[k] + up * camera->up[k];
        direction[k] = camera->forward[k] + (camera->is_orthographic ? 0 : aside);
        origin_mm[k] =
            camera->eye_mm[k] + camera->near_mm * direction[k] + (camera->is_orthographic ? aside : 0);
    }
}

static double distance_mm(const double a_mm[3], const double b_mm[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++)
        square += (a_mm[k] - b_mm[k]) * (a_mm[k] - b_mm[k]);
    return sqrt(square);
}

static void add_hit(const struct render_pixel_view *view, const struct render_surface_point *hit,
                    struct render_pixel *pixel)
{
    int g = 0;
    while (g < pixel->group_count &&
           (pixel->groups[g].points[0].object != hit->object ||
            distance_mm(hit->position_mm, pixel->groups[g].points[0].position_mm) >
                view->media[hit->object].group_mm))
        g++;
    if (g == pixel->group_count)
        pixel->groups[pixel->group_count++].count = 0;
    struct render_pixel_group *const group = &pixel->groups[g];
    group->points[group->count++] = *hit;
    pixel->hit_count++;
}

void render_pixel_trace(const struct render_pixel_view *view, int x, int y, struct render_pixel *pixel)
{
    pixel->group_count = pixel->hit_count = 0;
    for (int i = 0; i < RENDER_PIXEL_RAYS; i++) {
        const int column = i % RENDER_PIXEL_SIDE, line = i / RENDER_PIXEL_SIDE;
        const double x_px = x + (column + 0.5) / RENDER_PIXEL_SIDE;
        const double y_px = y + (line + 0.5) / RENDER_PIXEL_SIDE;
        double origin_mm[3], direction[3];
        struct render_surface_point hit;
        camera_ray(view, x_px, y_px, origin_mm, direction);
        if (render_tracer_find(view->tracer, origin_mm, direction, &hit))
            add_hit(view, &hit, pixel);
    }
}

/* ---- light -------------------------------------------------------------------------------------- */

static void toward_eye(const struct render_projection *camera, const double position_mm[3],
                       double to_eye[3])
{
    const double away_mm = distance_mm(camera->eye_mm, position_mm);
    for (int k = 0; k < 3; k++)
        to_eye[k] =
            camera->is_orthographic ? -camera->forward[k] : (camera->eye_mm[k] - position_mm[k]) / away_mm;
}

double render_pixel_exit_per_sr(const struct render_pixel_view *view,
                                const struct render_surface_point *point)
{
    const struct render_pixel_medium *const medium = &view->media[point->object];
    double to_eye[3];
    toward_eye(&view->camera, point->position_mm, to_eye);
    /* Interpolated normals may lean away from the eye near the silhouette: mirrored, as common/exit.glsl.
     */
    const double cosine = fmin(fabs(render_dot(point->normal, to_eye)), 1);
    return (1 - dipole_fresnel_reflectance(medium->eta, cosine)) * medium->exit_scale_per_sr;
}

bool render_light_reaches(const struct render_tracer *tracer, const struct io_light *light,
                          const struct render_surface_point *point, double to_light[3], double *falloff_out,
                          double left[IO_CHANNEL_COUNT])
{
    double away_mm = INFINITY, onward[3];
    *falloff_out = 1;
    for (int k = 0; k < 3; k++)
        to_light[k] = -light->direction[k];
    if (light->kind == IO_LIGHT_POINT) {
        away_mm = distance_mm(light->position_mm, point->position_mm);
        for (int k = 0; k < 3; k++)
            to_light[k] = (light->position_mm[k] - point->position_mm[k]) / away_mm;
        *falloff_out = 1 / (away_mm * away_mm);
    }
    for (int k = 0; k < 3; k++)
        onward[k] = -to_light[k];
    *falloff_out *= render_light_spot_part(light, onward);
    if (!(render_dot(point->facet_normal, to_light) > 0) || !(*falloff_out > 0) ||
        !render_tracer_is_clear_of_opaque(tracer, point->position_mm, point->facet_normal, to_light,
                                          away_mm))
        return false;
    render_tracer_left(tracer, point->position_mm, to_light, away_mm, left);
    return true;
}

/* So many places of a light does one point take; points near it take others. */
enum { PLACES_EACH = 8 };

int render_light_places(const struct io_light *light)
{
    return render_light_has_size(light) ? PLACES_EACH : 1;
}

/* Neighbours on the list of places are spread over the disc by steps of the golden section. */
struct io_light render_light_place_of(const struct io_light *light,
                                      const struct render_surface_point *point, uint64_t number, int index,
                                      int place_count)
{
    const int places = render_light_places(light);
    const uint64_t step = (uint64_t)(0.618 * place_count) | 1;
    const uint64_t at = (number * (uint64_t)places + (uint64_t)index) * step % (uint64_t)place_count;
    struct io_light place = render_light_place(light, point->position_mm, (int)at, place_count);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        place.rgb[c] /= places;
    return place;
}

void render_light_left(const struct render_tracer *tracer, const struct io_light *light,
                       const struct render_surface_point *point, int count, double left[IO_CHANNEL_COUNT])
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        left[c] = 0;
    for (int i = 0; i < count; i++) {
        const struct io_light place = render_light_place(light, point->position_mm, i, count);
        double to_light[3], falloff, once[IO_CHANNEL_COUNT];
        if (!render_light_reaches(tracer, &place, point, to_light, &falloff, once))
            continue;
        for (int c = 0; c < IO_CHANNEL_COUNT; c++)
            left[c] += once[c] / count;
    }
}

/* Mirrored part of the irradiance of a light, in 1/sr. */
static double mirrored_per_sr(const struct render_pixel_view *view,
                              const struct render_surface_point *point, const double to_light[3])
{
    double to_eye[3], middle[3];
    toward_eye(&view->camera, point->position_mm, to_eye);
    const double cosine_in = render_dot(point->normal, to_light);
    const double cosine_out = render_dot(point->normal, to_eye);
    if (cosine_in <= 0 || cosine_out <= 0)
        return 0;
    for (int k = 0; k < 3; k++)
        middle[k] = to_light[k] + to_eye[k];
    const double length = sqrt(render_dot(middle, middle));
    const double cosine_half = fmin(fmax(render_dot(to_light, middle) / length, 0), 1);
    return dipole_fresnel_reflectance(view->media[point->object].eta, cosine_half) *
           render_ggx_per_sr(view->scene->objects[point->object].roughness,
                             render_dot(point->normal, middle) / length, cosine_in, cosine_out);
}

static void add_mirrored(const struct render_pixel_view *view, const struct io_light *light,
                         const struct render_surface_point *point, double radiance[3])
{
    double to_light[3], falloff, left[IO_CHANNEL_COUNT];
    if (!render_light_reaches(view->tracer, light, point, to_light, &falloff, left))
        return;
    const double mirrored = falloff * mirrored_per_sr(view, point, to_light);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        radiance[c] += light->rgb[c] * left[c] * mirrored;
}

void render_pixel_add_specular(const struct render_pixel_view *view,
                               const struct render_surface_point *point, uint64_t number,
                               double radiance[3])
{
    if (!view->scene->objects[point->object].has_specular)
        return;
    for (size_t i = 0; i < view->scene->light_count; i++) {
        const struct io_light *const light = &view->scene->lights[i];
        for (int p = 0; p < render_light_places(light) && render_light_shines(light); p++) {
            const struct io_light place =
                render_light_place_of(light, point, number, p, view->light_place_count);
            add_mirrored(view, &place, point, radiance);
        }
    }
}

/* ---- for a screen ------------------------------------------------------------------------------- */

/* tone_map.frag has the same. */
void render_tone_map(const struct io_scene *scene, float rgba[4])
{
    const double knee = RENDER_TONE_KNEE, exposure = exp2(scene->exposure_ev);
    double colour[3], largest = 0;
    for (int c = 0; c < 3; c++) {
        const double over = (double)rgba[c] + (1 - (double)rgba[3]) * scene->background[c];
        colour[c] = fmax(exposure * over, 0);
        largest = fmax(largest, colour[c]);
    }
    for (int c = 0; c < 3 && largest > knee; c++) {
        const double bent = 1 - (1 - knee) * exp(-(largest - knee) / (1 - knee));
        const double fade = 1 - 1 / (1 + 0.15 * (largest - bent));
        const double scaled = colour[c] * (bent / largest);
        colour[c] = scaled + fade * (bent - scaled);
    }
    for (int c = 0; c < 3; c++)
        rgba[c] = (float)colour[c];
    rgba[3] = 1;
}
