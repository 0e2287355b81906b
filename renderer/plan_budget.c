/* How epsilon is shared out, and how far and how finely each medium is summed for it. */
#include "renderer/footprint.h"
#include "renderer/gather.h"
#include "renderer/plan_internal.h"

#include <math.h>

/*
 * How epsilon is shared out. What is cut off, and tables, are biases and add up to what else there is. The
 * rest differs from place to place, each in its own way, so squares add up (theory.md, "Budget"). Little
 * may be cut off beyond r_max, of the sum and so of the table: where an object is lit from behind, light
 * from afar is all there is. A tenth of epsilon made a back-lit bunny 5 % too dark in places; another band
 * costs little. Of splats a third is left for what has no bound of its own, the texels of the lights' views
 * and bands on curved surfaces.
 */
#define TRUNCATION_SHARE 0.02
#define ALIASING_SHARE 0.58
#define BANDING_SHARE 0.02
#define TABLE_SHARE 0.02

/* Gathering merges more, which is measured on curved surfaces (render_gather_cap_spacings), and
 * interpolates. */
#define GATHER_BANDING_SHARE 0.5
#define GATHER_INTERPOLATION_SHARE 0.2

/* Interpolation may err by so many epsilon of what is there, by a bound that is seldom met: in the dark,
 * where epsilon of the lit is much, it is the one that counts. */
#define GATHER_OWN_SHARE 4

/* Where pixels are wide and light spreads little: what spreads no farther than a place is away from the
 * surface does not arrive there. */
#define FLAT_SHARE 0.1

/* Caps of so many spacings keep the bands of splats under their share of epsilon = 0.01; for a tenth of
 * that, so many more are needed. */
#define CAP_SPACINGS 8
#define CAP_SPACINGS_PER_DECADE 2
#define CAP_EPSILON 0.01

/* A profile too narrow to be sampled within ALIASING_SHARE is blurred, and half of it each is spent on
 * aliasing and blur, if samples may then be so many times farther apart. */
#define BLUR_GAIN 2

/* Where samples are farther apart than wanted, they are so many times as far on surfaces at a slant to the
 * light: the more the view falls short of what it should have, up to this. Steeper ones get little light.
 */
#define SLOPE_LIMIT 4

/* A sampled shape is followed by at least so many samples, however far the light scatters. */
#define SAMPLES_ACROSS 32

static double tail(const dipole_stack *stack, double r_mm)
{
    return dipole_stack_beyond(stack, DIPOLE_FACE_LIT, r_mm) / dipole_stack_total(stack, DIPOLE_FACE_LIT);
}

/* Of the channel that reaches farthest. */
static double longest_tail(const struct render_medium *medium, double r_mm)
{
    double longest = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            longest = fmax(longest, tail(medium->stacks[c], r_mm));
    }
    return longest;
}

/* Within which no more than that part of the light leaves, of the narrowest channel. */
static double nearest_mm(const struct render_medium *medium, double part)
{
    double narrowest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            narrowest_mm =
                fmin(narrowest_mm, dipole_stack_r_max_mm(medium->stacks[c], DIPOLE_FACE_LIT, 1 - part));
    }
    return narrowest_mm;
}

/* The narrowest channel's. */
static double blurred_spacing_mm(const struct render_plan *plan, const struct render_medium *medium,
                                 double epsilon, double least_mm)
{
    double narrowest_mm = INFINITY;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (medium->diffuse_reflectance[c] > 0)
            narrowest_mm =
                fmin(narrowest_mm, render_footprint_spacing_mm(medium->stacks[c], epsilon, plan->spread,
                                                               least_mm, plan->least_pixel_mm));
    }
    return narrowest_mm;
}

/* Spacing by aliasing alone, or wider with a blur. */
static double sampled_spacing_mm(const struct render_plan *plan, const struct render_medium *medium,
                                 double widest_mm)
{
    const double sharp_mm = render_medium_spacing_mm(medium, plan->aliasing_epsilon, plan->spread);
    if (sharp_mm >= widest_mm)
        return widest_mm;
    const double blurred_mm = blurred_spacing_mm(plan, medium, 0.5 * plan->aliasing_epsilon, sharp_mm);
    return fmin(blurred_mm > BLUR_GAIN * sharp_mm ? blurred_mm : sharp_mm, widest_mm);
}

static void spend_on_medium(const struct render_request *request, struct render_plan *plan, size_t index)
{
    const struct render_medium *const medium = &plan->media->media[index];
    struct render_plan_medium *const planned = &plan->of_medium[index];
    if (!planned->is_visible || !medium->has_scattering)
        return;
    if (!request->is_captured)
        plan->flat_mm = fmin(plan->flat_mm, nearest_mm(medium, FLAT_SHARE * plan->epsilon));
    planned->r_max_mm = render_medium_r_max_mm(medium, plan->truncation_epsilon);
    planned->table_error = plan->table_epsilon;
    if (request->tables) {
        const struct lut_splat_row *const row =
            &request->tables[index].lut->rows[request->tables[index].row];
        planned->r_max_mm = fmin(planned->r_max_mm, row->axis.r_max_mm);
        planned->table_error = row->error.max;
    }
    if (planned->r_max_mm >= planned->diameter_mm)
        planned->r_max_mm =
            planned->diameter_mm; /* every pair of points is near enough: nothing is cut off */
    else
        planned->truncation_error = longest_tail(medium, planned->r_max_mm);
    plan->r_max_mm = fmax(plan->r_max_mm, planned->r_max_mm);
}

static void space_medium(const struct render_request *request, struct render_plan *plan, size_t index)
{
    struct render_plan_medium *const planned = &plan->of_medium[index];
    if (!(planned->r_max_mm > 0))
        return;
    planned->wanted_mm =
        request->spacing_mm > 0
            ? request->spacing_mm
            : sampled_spacing_mm(plan, &plan->media->media[index], planned->diameter_mm / SAMPLES_ACROSS);
    planned->spacing_mm = planned->wanted_mm;
    plan->spacing_mm = fmin(plan->spacing_mm, planned->spacing_mm);
}

static void space_objects(const struct render_request *request, struct render_plan *plan)
{
    for (size_t i = 0; i < request->scene->object_count; i++) {
        struct render_plan_object *const object = &plan->objects[i];
        const double spacing_mm = plan->of_medium[object->medium].spacing_mm;
        if (!object->is_visible)
            continue;
        object->spacing_mm = request->spacing_mm > 0
                                 ? spacing_mm
                                 : fmin(spacing_mm, 2 * object->ball.radius_mm / SAMPLES_ACROSS);
        plan->spacing_mm = fmin(plan->spacing_mm, object->spacing_mm > 0 ? object->spacing_mm : INFINITY);
    }
}

/* Normal of a triangle, as long as its area; its first corner. */
static void area_vector(const struct io_mesh *mesh, size_t triangle, double corner_mm[3],
                        double area_mm2[3])
{
    double sides[2][3];
    const float *const first = &mesh->positions[3 * (size_t)mesh->indices[3 * triangle]];
    for (int k = 0; k < 3; k++)
        corner_mm[k] = (double)first[k];
    for (size_t i = 0; i < 2; i++) {
        const float *const other = &mesh->positions[3 * (size_t)mesh->indices[3 * triangle + 1 + i]];
        for (int k = 0; k < 3; k++)
            sides[i][k] = (double)other[k] - corner_mm[k];
    }
    for (int k = 0; k < 3; k++)
        area_mm2[k] = 0.5 * (sides[0][(k + 1) % 3] * sides[1][(k + 2) % 3] -
                             sides[0][(k + 2) % 3] * sides[1][(k + 1) % 3]);
}

/* Of the mesh, whatever may be in the way. */
static double facing_area_mm2(const struct io_mesh *mesh, const struct io_light *light)
{
    double sum_mm2 = 0;
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        double corner_mm[3], area_mm2[3], to_light[3];
        area_vector(mesh, t, corner_mm, area_mm2);
        for (int k = 0; k < 3; k++)
            to_light[k] =
                light->kind == IO_LIGHT_POINT ? light->position_mm[k] - corner_mm[k] : -light->direction[k];
        if (render_dot(area_mm2, to_light) > 0)
            sum_mm2 += sqrt(render_dot(area_mm2, area_mm2));
    }
    return sum_mm2;
}

static double lit_area_mm2(const struct io_scene *scene, const struct io_mesh *mesh)
{
    double sum_mm2 = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        if (render_light_shines(&scene->lights[i]))
            sum_mm2 += facing_area_mm2(mesh, &scene->lights[i]);
    }
    return sum_mm2;
}

/* Light from all around is another light, which all of the surface faces. */
static double area_lit_from_around_mm2(const struct render_plan *plan, size_t object)
{
    return plan->environment ? plan->media->area_mm2[object] : 0;
}

/* How many light samples there would be, about, if they were least_mm apart at least. */
static double expected_samples(const struct render_request *request, const struct render_plan *plan,
                               double least_mm)
{
    double count = 0;
    for (size_t i = 0; i < request->scene->object_count; i++) {
        const struct render_plan_object *const object = &plan->objects[i];
        const double spacing_mm = fmax(object->spacing_mm, least_mm);
        if (object->spacing_mm > 0)
            count += object->lit_area_mm2 / spacing_mm / spacing_mm;
    }
    return count;
}

/* Set samples so far apart that there are not too many of them. The views' texels limit them as well, but
 * the bands are laid out for what is asked here: the coarsest must leave few samples of a whole scene. */
static void limit_samples(const struct render_request *request, struct render_plan *plan)
{
    const double limit = (double)RENDER_LIGHT_SAMPLE_LIMIT;
    double least_mm = plan->spacing_mm;
    for (size_t i = 0; i < request->scene->object_count;
         i++) /* no more than this: as if all faced each light */
        plan->objects[i].lit_area_mm2 =
            plan->media->area_mm2[i] * (double)plan->lit_count + area_lit_from_around_mm2(plan, i);
    if (expected_samples(request, plan, least_mm) <= limit)
        return;
    for (size_t i = 0; i < request->scene->object_count; i++)
        plan->objects[i].lit_area_mm2 = lit_area_mm2(request->scene, request->scene->objects[i].mesh) +
                                        area_lit_from_around_mm2(plan, i);
    while (expected_samples(request, plan, least_mm) > limit)
        least_mm *= 1.05;
    for (size_t i = 0; i < request->scene->object_count; i++) {
        if (plan->objects[i].spacing_mm > 0)
            plan->objects[i].spacing_mm = fmax(plan->objects[i].spacing_mm, least_mm);
    }
    for (size_t m = 0; m < plan->media->count; m++) {
        if (plan->of_medium[m].spacing_mm > 0)
            plan->of_medium[m].spacing_mm = fmax(plan->of_medium[m].spacing_mm, least_mm);
    }
    plan->spacing_mm = least_mm;
}

/* Of the nearest surface there may be. */
static double least_pixel_mm(const struct render_plan *plan)
{
    const struct render_projection *const camera = &plan->camera;
    if (camera->is_orthographic)
        return plan->pixel_mm;
    double centre_mm[3];
    render_projection_to_view(camera, plan->ball.centre_mm, centre_mm);
    return plan->pixel_mm *
           fmax(sqrt(render_dot(centre_mm, centre_mm)) - plan->ball.radius_mm, camera->near_mm);
}

static double limit_or(double limit, double share)
{
    return limit > 0 ? limit : share;
}

void render_plan_spend_epsilon(const struct render_request *request, struct render_plan *plan)
{
    const struct render_limits *const limits = &request->limits;
    plan->least_pixel_mm = least_pixel_mm(plan);
    plan->truncation_epsilon = limit_or(limits->truncation, TRUNCATION_SHARE * plan->epsilon);
    plan->aliasing_epsilon = limit_or(limits->aliasing, ALIASING_SHARE * plan->epsilon);
    plan->banding_epsilon = BANDING_SHARE * plan->epsilon;
    plan->table_epsilon = fmax(limit_or(limits->table, TABLE_SHARE * plan->epsilon), LUT_EPSILON_MIN);
    plan->flat_mm = INFINITY;
    for (size_t m = 0; m < plan->media->count; m++)
        spend_on_medium(request, plan, m);
    plan->r_max_px = plan->r_max_mm / plan->least_pixel_mm;
}

void render_plan_space_samples(const struct render_request *request, struct render_plan *plan)
{
    /* samples that are gathered know how far they were spread */
    plan->spread = plan->technique == RENDER_TECHNIQUE_GATHER ? RENDER_FOOTPRINT_SPREAD : 0;
    plan->spacing_mm = INFINITY;
    for (size_t m = 0; m < plan->media->count; m++)
        space_medium(request, plan, m);
    space_objects(request, plan);
    limit_samples(request, plan);
    if (isinf(plan->spacing_mm)) /* nothing scatters */
        plan->spacing_mm =
            request->spacing_mm > 0 ? request->spacing_mm : 2 * plan->ball.radius_mm / SAMPLES_ACROSS;
}

void render_plan_spend_on_gathering(const struct render_request *request, struct render_plan *plan)
{
    if (plan->technique != RENDER_TECHNIQUE_GATHER)
        return;
    plan->banding_epsilon = fmin(limit_or(request->limits.banding, GATHER_BANDING_SHARE * plan->epsilon),
                                 RENDER_GATHER_MERGING_ERROR_MAX);
    plan->interpolation_epsilon =
        limit_or(request->limits.interpolation, GATHER_INTERPOLATION_SHARE * plan->epsilon);
    plan->own_epsilon = GATHER_OWN_SHARE * plan->epsilon;
    plan->finest_spacings = render_gather_finest_spacings(plan->banding_epsilon);
}

/* Of the channels that scatter. */
static double worst_aliasing(const struct render_medium *medium, double spacing_mm, double spread_mm,
                             const double blur_mm[IO_CHANNEL_COUNT])
{
    double worst = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const struct render_footprint_kernel kernel = { blur_mm[c], spread_mm };
        if (medium->diffuse_reflectance[c] > 0)
            worst = fmax(worst, render_footprint_aliasing(medium->stacks[c], spacing_mm, &kernel));
    }
    return worst;
}

/* Whether a channel aliases by more than its share. */
static bool needs_blur(const struct render_plan *plan, const struct render_medium *medium,
                       double spacing_mm, double spread_mm)
{
    const double epsilon = plan->aliasing_epsilon * (1 + 1e-6);
    bool is_needed = false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        is_needed |= medium->diffuse_reflectance[c] > 0 &&
                     render_footprint_blur_mm(medium->stacks[c], spacing_mm, spread_mm, epsilon) > 0;
    return is_needed;
}

/* Half of the share each is for aliasing and blur then. */
static void blur_channels(const struct render_plan *plan, const struct render_medium *medium,
                          double spacing_mm, struct render_plan_medium *planned)
{
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        const dipole_stack *const stack = medium->stacks[c];
        if (!(medium->diffuse_reflectance[c] > 0))
            continue;
        planned->blur_mm[c] =
            render_footprint_blur_mm(stack, spacing_mm, planned->spread_mm, 0.5 * plan->aliasing_epsilon);
        if (planned->blur_mm[c] > 0)
            planned->blur_error =
                fmax(planned->blur_error,
                     render_footprint_error(stack, planned->blur_mm[c], plan->least_pixel_mm));
    }
}

/* Of the medium's visible objects, which may be of several sizes: each sample's own spread makes up for
 * what others ask for, but not next to it if the profile is averaged too far. */
static double closest_spacing_mm(const struct render_plan *plan, size_t medium, double texel_mm)
{
    double closest_mm = plan->of_medium[medium].spacing_mm;
    for (size_t i = 0; i < plan->media->object_count; i++) {
        const struct render_plan_object *const object = &plan->objects[i];
        if (object->medium == medium && object->spacing_mm > 0)
            closest_mm = fmin(closest_mm, object->spacing_mm);
    }
    return fmax(closest_mm, texel_mm);
}

/* Channels of which less lies beyond a cap are too dark there for gathering to look at. */
#define VISIBLE_SHARE 1e-5

/* A cap adds so much over its width to how fast the profile falls beyond it (measured materials). */
#define CAP_CHANGE 1.7

/* About how far one has to go for what lies beyond a cap to change by as much as it is, of the channel that
 * falls fastest: from how much of it lies beyond two caps. */
static double change_mm(const struct render_medium *medium, double cap_mm)
{
    double fastest_per_mm = 0;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        if (!(medium->diffuse_reflectance[c] > 0))
            continue;
        const double beyond = tail(medium->stacks[c], cap_mm),
                     farther = tail(medium->stacks[c], 2 * cap_mm);
        if (beyond > VISIBLE_SHARE && farther > 0)
            fastest_per_mm = fmax(fastest_per_mm, log(beyond / farther) / cap_mm);
    }
    return 1 / (fastest_per_mm + CAP_CHANGE / cap_mm);
}

static void settle_medium(const struct render_request *request, struct render_plan *plan, size_t index,
                          double texel_mm)
{
    const struct render_medium *const medium = &plan->media->media[index];
    struct render_plan_medium *const planned = &plan->of_medium[index];
    const double wanted_mm = planned->wanted_mm;
    if (!(wanted_mm > 0))
        return;
    if (plan->has_grid) {
        render_plan_settle_grid(plan, index, texel_mm);
        return;
    }
    const bool is_gathered = plan->technique == RENDER_TECHNIQUE_GATHER;
    const double decades = fmax(log10(CAP_EPSILON / plan->epsilon), 0);
    const double cap_spacings = is_gathered ? render_gather_cap_spacings(plan->banding_epsilon)
                                            : CAP_SPACINGS + CAP_SPACINGS_PER_DECADE * decades;
    const double finest_mm = (is_gathered ? plan->finest_spacings : 1) * planned->spacing_mm;
    const double spacing_mm = fmax(planned->spacing_mm, texel_mm);
    const double on_slopes_mm = spacing_mm * fmin(fmax(spacing_mm / wanted_mm, 1), SLOPE_LIMIT);
    planned->spread_mm = plan->spread * closest_spacing_mm(plan, index, texel_mm);
    if (!request->is_captured) {
        if (needs_blur(plan, medium, on_slopes_mm, planned->spread_mm))
            blur_channels(plan, medium, on_slopes_mm, planned);
        planned->aliasing_error =
            worst_aliasing(medium, on_slopes_mm, planned->spread_mm, planned->blur_mm);
    }
    const double widest_blur_mm = fmax(fmax(planned->blur_mm[0], planned->blur_mm[1]), planned->blur_mm[2]);
    /* Footprints may be wider than the profile. */
    const double blurred_mm = fmin(RENDER_FOOTPRINT_REACH * widest_blur_mm, planned->diameter_mm);
    planned->r_max_mm = fmax(planned->r_max_mm, blurred_mm);
    plan->r_max_mm = fmax(plan->r_max_mm, planned->r_max_mm);
    /* What is captured is summed by others, from the finest samples alone; so are samples that are counted.
     */
    const bool is_single = request->is_captured || plan->area == RENDER_AREA_OVERLAP;
    const double reach_mm = planned->r_max_mm;
    planned->band_count =
        render_bands_make(finest_mm, reach_mm, is_single ? INFINITY : cap_spacings, planned->bands);
    plan->band_count = planned->band_count > plan->band_count ? planned->band_count : plan->band_count;
    for (int b = 1; is_gathered && b < planned->band_count; b++)
        planned->change_mm[b] = change_mm(medium, planned->bands[b].cap_mm);
    if (request->is_captured)
        return;
    if (spacing_mm > wanted_mm * (1 + 1e-6))
        render_plan_add_note(
            plan,
            "light samples of material \"%.60s\" are %.3g mm apart, %.3g mm were asked: a "
            "light's view is limited to %d texels a side, all to %zu; edges of shadows blur by "
            "%.2g mm, which changes them by up to %.2g",
            medium->material->name, spacing_mm, wanted_mm, RENDER_VIEW_SIDE_LIMIT,
            RENDER_LIGHT_SAMPLE_LIMIT, widest_blur_mm, planned->blur_error);
}

void render_plan_settle_spacing(const struct render_request *request, struct render_plan *plan)
{
    if (!render_plan_sums_samples(plan))
        return;
    const double texel_mm = render_plan_widest_spacing_mm(plan);
    for (size_t m = 0; m < plan->media->count; m++)
        settle_medium(request, plan, m, texel_mm);
}

static double root_of_squares(const double *errors, size_t count)
{
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += errors[i] * errors[i];
    return sqrt(sum);
}

void render_plan_predict_error(const struct render_request *request, struct render_plan *plan)
{
    if (!render_plan_sums_samples(plan) || request->is_captured || !plan->has_scattering)
        return;
    plan->banding_error =
        hypot(plan->band_count > 1 ? plan->banding_epsilon : 0, plan->interpolation_epsilon);
    for (size_t m = 0; m < plan->media->count; m++) {
        const struct render_plan_medium *const planned = &plan->of_medium[m];
        plan->truncation_error = fmax(plan->truncation_error, planned->truncation_error);
        plan->aliasing_error = fmax(plan->aliasing_error, planned->aliasing_error);
        plan->blur_error = fmax(plan->blur_error, planned->blur_error);
        plan->table_error = fmax(plan->table_error, planned->table_error);
        const double varying = root_of_squares(
            (double[]){ planned->aliasing_error, planned->blur_error, plan->banding_error }, 3);
        if (request->tables && planned->table_error + planned->truncation_error + varying > plan->epsilon)
            render_plan_add_note(plan,
                                 "the table of material \"%.60s\" was baked with epsilon %.3g: its part of "
                                 "the error is %.2g; one baked with %.3g keeps %.3g",
                                 plan->media->media[m].material->name, request->tables[m].lut->epsilon,
                                 planned->table_error + planned->truncation_error, plan->table_epsilon,
                                 plan->epsilon);
    }
    plan->error_predicted =
        plan->truncation_error + plan->table_error +
        root_of_squares((double[]){ plan->aliasing_error, plan->blur_error, plan->banding_error,
                                    plan->environment_error, plan->gloss_error },
                        5);
}
