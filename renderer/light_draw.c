#include "renderer/light_draw.h"

#include <stdlib.h>
#include <string.h>

bool render_light_picture_of(const struct render_frame *frame, struct render_light_picture *picture,
                             dipole_status *status)
{
    const struct render_plan *const plan = frame->plan;
    const bool has_rest = render_plan_wants(plan, "light_rest");
    const struct io_scene *const scene = frame->request->scene;
    struct render_light_mesh *const meshes = calloc(scene->object_count, sizeof *meshes);
    if (!meshes)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory for %zu objects",
                           scene->object_count);
    for (size_t i = 0; i < scene->object_count; i++)
        meshes[i] =
            (struct render_light_mesh){ .mesh = scene->objects[i].mesh,
                                        .rest_mm =
                                            has_rest ? io_object_rest(&scene->objects[i])->positions : NULL,
                                        .eta = plan->media->media[plan->objects[i].medium].eta,
                                        .has_hidden_inside = render_executor_hides_inside(frame, i) };
    *picture = (struct render_light_picture){ .meshes = meshes,
                                              .mesh_count = scene->object_count,
                                              .projection = &frame->view->projection,
                                              .size_px = frame->view->size_px,
                                              .texel_area = frame->view->texel_area };
    return true;
}

void render_light_picture_free(struct render_light_picture *picture)
{
    free((struct render_light_mesh *)picture->meshes);
}

struct render_light_drawing {
    struct render_light_texels drawn; /* of the last view */
    float *memory;
    size_t capacity; /* in floats */
};

struct render_light_drawing *render_light_drawing_create(void)
{
    return calloc(1, sizeof(struct render_light_drawing));
}

void render_light_drawing_destroy(struct render_light_drawing *drawing)
{
    if (!drawing)
        return;
    free(drawing->memory);
    free(drawing);
}

static bool reserve(struct render_light_drawing *drawing, const struct render_frame *frame,
                    dipole_status *status)
{
    const bool has_objects = render_plan_wants(frame->plan, "light_object"),
               has_rest = render_plan_wants(frame->plan, "light_rest");
    const size_t count = (size_t)frame->view->size_px * (size_t)frame->view->size_px,
                 wanted = count * (4U + (has_objects ? 1U : 0U) + (has_rest ? 4U : 0U));
    if (wanted > drawing->capacity) {
        free(drawing->memory);
        drawing->memory = malloc(wanted * sizeof *drawing->memory);
        drawing->capacity = drawing->memory ? wanted : 0;
    }
    if (!drawing->memory)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL,
                           "no memory for a light's view of %d texels a side", frame->view->size_px);
    drawing->drawn = (struct render_light_texels){ .texels = drawing->memory };
    if (has_objects)
        drawing->drawn.objects = drawing->memory + 4 * count;
    if (has_rest)
        drawing->drawn.rest_mm = drawing->memory + (has_objects ? 5 : 4) * count;
    return true;
}

bool render_light_drawing_draw(struct render_light_drawing *drawing, const struct render_frame *frame,
                               dipole_status *status)
{
    struct render_light_picture picture;
    const int size_px = frame->view->size_px;
    if (!reserve(drawing, frame, status) || !render_light_picture_of(frame, &picture, status))
        return false;
    render_far_point(frame->view, drawing->drawn.empty);
    const bool done = render_light_picture_draw(&picture, &drawing->drawn, status);
    render_light_picture_free(&picture);
    if (done && render_plan_reads(frame->plan, "light_view"))
        glTextureSubImage2D(render_executor_texture(frame->executor, "light_view"), 0, 0, 0, size_px,
                            size_px, GL_RGBA, GL_FLOAT, drawing->drawn.texels);
    return done;
}

const struct render_light_texels *render_light_drawing_texels(const struct render_light_drawing *drawing)
{
    return &drawing->drawn;
}
