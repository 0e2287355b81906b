#include "renderer/reference_trace.h"

#include "renderer/blocker.h"
#include "renderer/crossings.h"
#include "renderer/projection.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/*
 * Shadow rays begin so far above their triangle, as part of the largest coordinate: 2^-19. Rounding the
 * origin to float moves it by 2^-24 of that at most, and Embree's own arithmetic errs by a few such steps,
 * so the origin surely lies above the plane of its triangle and of every triangle that the surface bends
 * away to: no surface shades itself. Where it bends toward the ray it is hit, as it should. At a contact
 * the origin lies inside the other object, whose far side then blocks: nothing leaks, unless a sheet is
 * thinner than this.
 */
#define LIFT 0x1p-19

struct render_tracer {
    const struct io_scene *scene;
    const struct io_blocker *casters; /* blockers, and objects that let light through */
    size_t caster_count;
    RTCDevice device;
    RTCScene triangles;       /* geometry i is object i */
    RTCScene opaque;          /* the same without objects that let light through; NULL: there are none */
    RTCScene blockers;        /* geometry i is caster i; NULL: there are none */
    double lift_mm, reach_mm; /* reach: no longer is what holds all blockers */
};

static bool check(const struct render_tracer *tracer, const char *what, dipole_status *status)
{
    switch (rtcGetDeviceError(tracer->device)) {
    case RTC_ERROR_NONE:
        return true;
    case RTC_ERROR_OUT_OF_MEMORY:
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to trace rays (%s)", what);
    default:
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "Embree cannot trace rays here (%s)", what);
    }
}

static bool add_object(struct render_tracer *tracer, RTCScene triangles, const struct io_mesh *mesh,
                       unsigned index, dipole_status *status)
{
    const RTCGeometry geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *const vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                    3 * sizeof(float), mesh->vertex_count);
    unsigned *const indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                      3 * sizeof(unsigned), mesh->triangle_count);
    if (vertices && indices) {
        memcpy(vertices, mesh->positions, 3 * mesh->vertex_count * sizeof *vertices);
        memcpy(indices, mesh->indices, 3 * mesh->triangle_count * sizeof *indices);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(triangles, geometry, index);
    }
    rtcReleaseGeometry(geometry);
    return check(tracer, "a mesh", status);
}

static bool add_particles(struct render_tracer *tracer, const struct io_blocker *particles, unsigned index,
                          dipole_status *status)
{
    const RTCGeometry geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_DISC_POINT);
    float *const discs = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                                 4 * sizeof(float), particles->mesh->vertex_count);
    if (discs) {
        for (size_t i = 0; i < particles->mesh->vertex_count; i++) {
            memcpy(discs + 4 * i, particles->mesh->positions + 3 * i, 3 * sizeof *discs);
            discs[4 * i + 3] = (float)particles->particle_mm;
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(tracer->blockers, geometry, index);
    }
    rtcReleaseGeometry(geometry);
    return check(tracer, "particles", status);
}

static bool add_blockers(struct render_tracer *tracer, dipole_status *status)
{
    tracer->blockers = rtcNewScene(tracer->device);
    rtcSetSceneFlags(tracer->blockers, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    bool done = check(tracer, "a scene", status);
    for (size_t i = 0; done && i < tracer->caster_count; i++) {
        const struct io_blocker *const blocker = &tracer->casters[i];
        done = blocker->particle_mm > 0
                   ? add_particles(tracer, blocker, (unsigned)i, status)
                   : add_object(tracer, tracer->blockers, blocker->mesh, (unsigned)i, status);
        for (int k = 0; k < 3; k++)
            tracer->reach_mm +=
                (double)blocker->mesh->max[k] - (double)blocker->mesh->min[k] + 2 * blocker->particle_mm;
    }
    if (done)
        rtcCommitScene(tracer->blockers);
    return done && check(tracer, "a tree", status);
}

static bool add_objects(struct render_tracer *tracer, const bool *left_out, RTCScene *scene_out,
                        dipole_status *status)
{
    *scene_out = rtcNewScene(tracer->device);
    rtcSetSceneFlags(*scene_out, RTC_SCENE_FLAG_ROBUST);
    bool done = check(tracer, "a scene", status);
    for (size_t i = 0; done && i < tracer->scene->object_count; i++)
        done = (left_out && left_out[i]) ||
               add_object(tracer, *scene_out, tracer->scene->objects[i].mesh, (unsigned)i, status);
    if (done)
        rtcCommitScene(*scene_out);
    return done && check(tracer, "a tree", status);
}

bool render_tracer_create(const struct io_scene *scene, struct render_tracer **tracer_out,
                          dipole_status *status)
{
    return render_tracer_create_with(scene, NULL, tracer_out, status);
}

bool render_tracer_create_with(const struct io_scene *scene, const struct render_casters *casters,
                               struct render_tracer **tracer_out, dipole_status *status)
{
    *tracer_out = NULL;
    struct render_tracer *const tracer = calloc(1, sizeof *tracer);
    if (!tracer)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to trace rays");
    tracer->scene = scene;
    tracer->casters = casters ? casters->casters : scene->blockers;
    tracer->caster_count = casters ? casters->count : scene->blocker_count;
    double largest_mm = 0;
    for (int k = 0; k < 3; k++)
        largest_mm = fmax(largest_mm, fmax(fabs(scene->min_mm[k]), fabs(scene->max_mm[k])));
    tracer->lift_mm = LIFT * largest_mm;
    /* One thread builds the same tree each time, so that ties between triangles end the same way. */
    tracer->device = rtcNewDevice("threads=1,set_affinity=0");
    bool done = check(tracer, "a device", status);
    done = done && add_objects(tracer, NULL, &tracer->triangles, status);
    if (done && casters && casters->count > casters->blocker_count)
        done = add_objects(tracer, casters->lets_through, &tracer->opaque, status);
    if (done && tracer->caster_count > 0)
        done = add_blockers(tracer, status);
    if (done)
        *tracer_out = tracer;
    else
        render_tracer_destroy(tracer);
    return done;
}

void render_tracer_destroy(struct render_tracer *tracer)
{
    if (!tracer)
        return;
    if (tracer->triangles)
        rtcReleaseScene(tracer->triangles);
    if (tracer->opaque)
        rtcReleaseScene(tracer->opaque);
    if (tracer->blockers)
        rtcReleaseScene(tracer->blockers);
    if (tracer->device)
        rtcReleaseDevice(tracer->device);
    free(tracer);
}

static struct RTCRay ray_of(const double origin_mm[3], const double direction[3], double distance_mm)
{
    return (struct RTCRay){ .org_x = (float)origin_mm[0],
                            .org_y = (float)origin_mm[1],
                            .org_z = (float)origin_mm[2],
                            .dir_x = (float)direction[0],
                            .dir_y = (float)direction[1],
                            .dir_z = (float)direction[2],
                            .tfar = (float)distance_mm,
                            .mask = 0xffffffffu };
}

/* Embree's place in the triangle is float; the same in double, kept to the triangle. */
static void refine(const double origin_mm[3], const double direction[3], const double corners_mm[3][3],
                   double weights[3])
{
    double normal[3], offset[3], from[3], across[3];
    render_triangle_normal(corners_mm, normal);
    for (int k = 0; k < 3; k++)
        from[k] = corners_mm[0][k] - origin_mm[k];
    const double fall = render_dot(normal, direction), square = render_dot(normal, normal);
    const double t = render_dot(normal, from) / fall;
    if (!isfinite(t))
        return; /* seen edge on: float must do */
    for (int k = 0; k < 3; k++)
        offset[k] = origin_mm[k] + t * direction[k];
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        const double part_mm[3][3] = {
            { offset[0], offset[1], offset[2] },
            { corners_mm[(i + 1) % 3][0], corners_mm[(i + 1) % 3][1], corners_mm[(i + 1) % 3][2] },
            { corners_mm[(i + 2) % 3][0], corners_mm[(i + 2) % 3][1], corners_mm[(i + 2) % 3][2] },
        };
        render_triangle_normal(part_mm, across);
        weights[i] = fmax(render_dot(across, normal) / square, 0);
        sum += weights[i];
    }
    for (int i = 0; i < 3; i++)
        weights[i] /= sum;
}

bool render_tracer_find(const struct render_tracer *tracer, const double origin_mm[3],
                        const double direction[3], struct render_surface_point *hit)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit found = { .ray = ray_of(origin_mm, direction, INFINITY),
                               .hit = { .geomID = RTC_INVALID_GEOMETRY_ID } };
    rtcIntersect1(tracer->triangles, &context, &found);
    if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return false;
    const struct io_mesh *const mesh = tracer->scene->objects[found.hit.geomID].mesh;
    double corners_mm[3][3];
    render_triangle_corners(mesh, found.hit.primID, corners_mm);
    const double u = (double)found.hit.u, v = (double)found.hit.v;
    double weights[3] = { 1 - u - v, u, v };
    refine(origin_mm, direction, corners_mm, weights);
    render_triangle_point(mesh, found.hit.primID, weights, hit);
    hit->object = found.hit.geomID;
    return true;
}

static bool is_clear(const struct render_tracer *tracer, RTCScene triangles, const double position_mm[3],
                     const double facet_normal[3], const double direction[3], double distance_mm)
{
    double origin_mm[3];
    for (int k = 0; k < 3; k++)
        origin_mm[k] = position_mm[k] + tracer->lift_mm * facet_normal[k];
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay ray = ray_of(origin_mm, direction, distance_mm);
    rtcOccluded1(triangles, &context, &ray);
    return ray.tfar > 0; /* -infinity: something is hit */
}

bool render_tracer_is_clear(const struct render_tracer *tracer, const double position_mm[3],
                            const double facet_normal[3], const double direction[3], double distance_mm)
{
    return is_clear(tracer, tracer->triangles, position_mm, facet_normal, direction, distance_mm);
}

bool render_tracer_is_clear_of_opaque(const struct render_tracer *tracer, const double position_mm[3],
                                      const double facet_normal[3], const double direction[3],
                                      double distance_mm)
{
    return is_clear(tracer, tracer->opaque ? tracer->opaque : tracer->triangles, position_mm, facet_normal,
                    direction, distance_mm);
}

/* ---- blockers ------------------------------------------------------------------------------------ */

enum { FEW_CROSSINGS = 256 };

/* All crossings of one ray, in any order; depth is along the ray. */
struct crossing_list {
    struct RTCIntersectContext context; /* first: Embree hands it back */
    const struct io_scene *scene;
    struct render_crossing *crossings, few[FEW_CROSSINGS];
    size_t count, capacity;
    bool is_short; /* of memory */
};

static void add_crossing(struct crossing_list *list, const struct render_crossing *crossing)
{
    if (list->count == list->capacity) {
        struct render_crossing *const grown = malloc(2 * list->capacity * sizeof *grown);
        list->is_short |= !grown;
        if (!grown)
            return;
        memcpy(grown, list->crossings, list->count * sizeof *grown);
        if (list->crossings != list->few)
            free(list->crossings);
        list->crossings = grown;
        list->capacity *= 2;
    }
    list->crossings[list->count++] = *crossing;
}

/* Embree's filter: every hit is noted, and none ends the ray. */
static void note_crossing(const struct RTCFilterFunctionNArguments *arguments)
{
    struct crossing_list *const list = (struct crossing_list *)arguments->context;
    if (arguments->valid[0] == 0)
        return;
    /* of one ray at a time: then these are what single rays and hits are */
    const struct RTCRay *const ray = (const struct RTCRay *)arguments->ray;
    const struct RTCHit *const hit = (const struct RTCHit *)arguments->hit;
    const float facing = hit->Ng_x * ray->dir_x + hit->Ng_y * ray->dir_y + hit->Ng_z * ray->dir_z;
    /* the ray goes toward the light, against it */
    add_crossing(list, &(struct render_crossing){
                           .depth_mm = -ray->tfar, .blocker = hit->geomID, .is_entry = facing > 0 });
    arguments->valid[0] = 0;
}

/* What a segment leaves before the receiver's depth. */
static void take_segment(const struct render_segment *segment, double receiver_mm,
                         double left[IO_CHANNEL_COUNT])
{
    const double length_mm = segment->ze_mm - segment->z0_mm;
    if (segment->z0_mm >= receiver_mm)
        return;
    const double part = segment->ze_mm > receiver_mm ? (receiver_mm - segment->z0_mm) / length_mm : 1;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        left[c] *= 1 - segment->alpha[c] * render_blocker_part(segment->alpha[c], part);
}

/* The ray begins behind the point, where no blocker is, so that each that holds the point is seen whole. */
void render_tracer_left(const struct render_tracer *tracer, const double position_mm[3],
                        const double direction[3], double distance_mm, double left[IO_CHANNEL_COUNT])
{
    struct crossing_list list = { .scene = tracer->scene, .capacity = FEW_CROSSINGS };
    struct render_segment few[FEW_CROSSINGS], *segments = few;
    double origin_mm[3];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        left[c] = 1;
    if (!tracer->blockers)
        return;
    list.crossings = list.few;
    for (int k = 0; k < 3; k++)
        origin_mm[k] = position_mm[k] - tracer->reach_mm * direction[k];
    rtcInitIntersectContext(&list.context);
    list.context.filter = note_crossing;
    struct RTCRay ray = ray_of(origin_mm, direction, tracer->reach_mm + distance_mm);
    rtcOccluded1(tracer->blockers, &list.context, &ray);
    if (list.count > FEW_CROSSINGS)
        segments = malloc(list.count * sizeof *segments);
    if (segments && !list.is_short) {
        const size_t count = render_crossings_pair(
            tracer->casters, list.crossings, list.count,
            isfinite(distance_mm) ? -(tracer->reach_mm + distance_mm) : INFINITY, 1, segments);
        for (size_t i = 0; i < count; i++)
            take_segment(&segments[i], -tracer->reach_mm, left);
    } else {
        memset(left, 0, IO_CHANNEL_COUNT * sizeof *left);
    }
    if (segments != few)
        free(segments);
    if (list.crossings != list.few)
        free(list.crossings);
}
