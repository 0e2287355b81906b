#include "renderer/reference_trace.h"

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
    RTCDevice device;
    RTCScene triangles; /* geometry i is object i */
    double lift_mm;
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

static bool add_object(struct render_tracer *tracer, const struct io_mesh *mesh, unsigned index,
                       dipole_status *status)
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
        rtcAttachGeometryByID(tracer->triangles, geometry, index);
    }
    rtcReleaseGeometry(geometry);
    return check(tracer, "a mesh", status);
}

bool render_tracer_create(const struct io_scene *scene, struct render_tracer **tracer_out,
                          dipole_status *status)
{
    *tracer_out = NULL;
    struct render_tracer *const tracer = calloc(1, sizeof *tracer);
    if (!tracer)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory to trace rays");
    tracer->scene = scene;
    double largest_mm = 0;
    for (int k = 0; k < 3; k++)
        largest_mm = fmax(largest_mm, fmax(fabs(scene->min_mm[k]), fabs(scene->max_mm[k])));
    tracer->lift_mm = LIFT * largest_mm;
    /* One thread builds the same tree each time, so that ties between triangles end the same way. */
    tracer->device = rtcNewDevice("threads=1,set_affinity=0");
    bool done = check(tracer, "a device", status);
    if (done) {
        tracer->triangles = rtcNewScene(tracer->device);
        rtcSetSceneFlags(tracer->triangles, RTC_SCENE_FLAG_ROBUST);
        done = check(tracer, "a scene", status);
    }
    for (size_t i = 0; done && i < scene->object_count; i++)
        done = add_object(tracer, scene->objects[i].mesh, (unsigned)i, status);
    if (done) {
        rtcCommitScene(tracer->triangles);
        done = check(tracer, "a tree", status);
    }
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

bool render_tracer_is_clear(const struct render_tracer *tracer, const double position_mm[3],
                            const double facet_normal[3], const double direction[3], double distance_mm)
{
    double origin_mm[3];
    for (int k = 0; k < 3; k++)
        origin_mm[k] = position_mm[k] + tracer->lift_mm * facet_normal[k];
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay ray = ray_of(origin_mm, direction, distance_mm);
    rtcOccluded1(tracer->triangles, &context, &ray);
    return ray.tfar > 0; /* -infinity: something is hit */
}
