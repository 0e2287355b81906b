/* Uniforms that several passes share. */
#include "renderer/execute.h"

#define PI 3.14159265358979323846

void render_set_light(GLuint program, const struct io_light *light)
{
    if (light->kind == IO_LIGHT_POINT)
        render_set_vec4(program, "light", light->position_mm[0], light->position_mm[1],
                        light->position_mm[2], 1);
    else
        render_set_vec4(program, "light", -light->direction[0], -light->direction[1], -light->direction[2],
                        0);
}

void render_set_light_view(GLuint program, const struct render_request *request,
                           const struct render_plan_view *view)
{
    const struct io_light *const light = &request->scene->lights[view->light];
    render_set_light(program, light);
    render_set_vec3(program, "light_rgb", light->rgb);
    render_set_matrix(program, "light_view_projection", &view->projection);
    render_set_int(program, "light_view_size_px", view->size_px);
    render_set_int(program, "light_cube_face", view->is_cube_face ? view->face : -1);
    render_set_float(program, "light_texel_mm", 2 * view->projection.half_width / view->size_px);
}

void render_set_camera(GLuint program, const struct render_plan *plan)
{
    const struct render_projection *const camera = &plan->camera;
    if (camera->is_orthographic)
        render_set_vec4(program, "eye", -camera->forward[0], -camera->forward[1], -camera->forward[2], 0);
    else
        render_set_vec4(program, "eye", camera->eye_mm[0], camera->eye_mm[1], camera->eye_mm[2], 1);
    render_set_float(program, "pixel_mm", plan->pixel_mm);
    render_set_int(program, "width_px", plan->width_px);
    render_set_int(program, "height_px", plan->height_px);
}

void render_set_medium(GLuint program, const struct render_plan *plan)
{
    const struct render_medium *const medium = &plan->media->media[0];
    render_set_float(program, "eta", medium->eta);
    render_set_float(program, "exit_scale_per_sr", 1 / (PI * dipole_fdt_outside(medium->eta)));
    render_set_vec3(program, "diffuse_reflectance", medium->diffuse_reflectance);
}
