#include "renderer/pose.h"

#include <math.h>
#include <stdio.h>

static const GLintptr STRIDE = RENDER_VERTEX_FLOATS * sizeof(float);

bool render_pose_program_create(GLuint *program_out, dipole_status *status)
{
    static const char *const written[RENDER_VERTEX_ARRAYS] = {
        [RENDER_VERTEX_POSITION] = "position_mm", [RENDER_VERTEX_NORMAL] = "normal"
    };
    return render_feedback_program_create(render_shader_find("pose.vert"), written, RENDER_VERTEX_ARRAYS,
                                          program_out, status);
}

/* ---- uniforms ----------------------------------------------------------------------------------- */

/* Members of an element of the array of structs. */
static const char *member(char name[64], size_t index, const char *of)
{
    snprintf(name, 64, "deforms[%zu].%s", index, of);
    return name;
}

static void set_deform(GLuint program, size_t index, const struct io_deform *deform)
{
    char name[64];
    render_set_int(program, member(name, index, "kind"), (int)deform->kind);
    render_set_vec3(program, member(name, index, "origin_mm"), deform->origin_mm);
    render_set_vec3(program, member(name, index, "axis"), deform->axis);
    render_set_vec3(program, member(name, index, "toward"), deform->toward);
    render_set_float(program, member(name, index, "rate_rad_per_mm"), deform->rate_rad_per_mm);
    render_set_float(program, member(name, index, "amplitude_mm"), deform->amplitude_mm);
    render_set_float(program, member(name, index, "phase_rad"), deform->phase_rad);
}

static void set_motion(GLuint program, const struct io_pose *pose)
{
    static const double nowhere_mm[3] = { 0, 0, 0 };
    float columns[9] = { 1, 0, 0, 0, 1, 0, 0, 0, 1 };
    for (int row = 0; row < 3 && pose->is_moved; row++) {
        for (int column = 0; column < 3; column++)
            columns[3 * column + row] = (float)pose->rotation[row][column];
    }
    glProgramUniformMatrix3fv(program, glGetUniformLocation(program, "motion_rotation"), 1, GL_FALSE,
                              columns);
    render_set_vec3(program, "motion_shift_mm", pose->is_moved ? pose->shift_mm : nowhere_mm);
}

/* ---- vertices ----------------------------------------------------------------------------------- */

static GLintptr offset_of(const struct render_posed *posed)
{
    return (GLintptr)posed->first_vertex * STRIDE;
}

static GLsizeiptr size_of(const struct render_posed *posed)
{
    return (GLsizeiptr)posed->vertex_count * STRIDE;
}

static void keep_rest(const struct render_geometry *geometry, struct render_posed *posed)
{
    glCreateVertexArrays(1, &posed->vertex_array);
    glCreateBuffers(RENDER_VERTEX_ARRAYS, posed->rest);
    for (GLuint i = 0; i < RENDER_VERTEX_ARRAYS; i++) { /* locations 0: rest_mm, 1: rest_normal */
        glNamedBufferStorage(posed->rest[i], size_of(posed), NULL, 0);
        glCopyNamedBufferSubData(geometry->vertices[i].buffer, posed->rest[i], offset_of(posed), 0,
                                 size_of(posed));
        glVertexArrayVertexBuffer(posed->vertex_array, i, posed->rest[i], 0, (GLsizei)STRIDE);
        glVertexArrayAttribFormat(posed->vertex_array, i, 3, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(posed->vertex_array, i, i);
        glEnableVertexArrayAttrib(posed->vertex_array, i);
    }
}

void render_pose_write(GLuint program, const struct io_object *object,
                       const struct render_geometry *geometry, struct render_posed *posed)
{
    const struct io_pose *const pose = &object->pose;
    if (!posed->vertex_array)
        keep_rest(geometry, posed);
    render_set_int(program, "deform_count", (int)pose->deform_count);
    for (size_t i = 0; i < pose->deform_count; i++)
        set_deform(program, i, &pose->deforms[i]);
    set_motion(program, pose);
    glUseProgram(program);
    glBindVertexArray(posed->vertex_array);
    for (GLuint i = 0; i < RENDER_VERTEX_ARRAYS; i++)
        glBindBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, i, geometry->vertices[i].buffer, offset_of(posed),
                          size_of(posed));
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, (GLsizei)posed->vertex_count);
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    for (GLuint i = 0; i < RENDER_VERTEX_ARRAYS; i++)
        glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, i, 0);
    posed->is_posed = true;
}

void render_pose_undo(const struct render_geometry *geometry, struct render_posed *posed)
{
    for (int i = 0; posed->is_posed && i < RENDER_VERTEX_ARRAYS; i++)
        glCopyNamedBufferSubData(posed->rest[i], geometry->vertices[i].buffer, 0, offset_of(posed),
                                 size_of(posed));
    posed->is_posed = false;
}

void render_pose_end(struct render_posed *posed)
{
    if (posed->vertex_array) {
        glDeleteVertexArrays(1, &posed->vertex_array);
        glDeleteBuffers(RENDER_VERTEX_ARRAYS, posed->rest);
    }
    *posed = (struct render_posed){ 0 };
}

/* ---- sides -------------------------------------------------------------------------------------- */

/* How far the box of the mesh at rest reaches to the bend's inside. */
static double inside_mm(const struct io_deform *bend, const struct io_mesh *rest)
{
    const double sign = bend->rate_rad_per_mm < 0 ? -1 : 1;
    double sum_mm = 0;
    for (int k = 0; k < 3; k++) {
        const double toward = sign * bend->toward[k];
        sum_mm +=
            toward * ((toward > 0 ? (double)rest->max[k] : (double)rest->min[k]) - bend->origin_mm[k]);
    }
    return sum_mm;
}

bool render_pose_keeps_sides(const struct io_object *object)
{
    const struct io_pose *const pose = &object->pose;
    for (size_t i = 0; i < pose->deform_count; i++) {
        const struct io_deform *const deform = &pose->deforms[i];
        if (deform->kind == IO_DEFORM_BEND &&
            (i > 0 || !(fabs(deform->rate_rad_per_mm) * inside_mm(deform, io_object_rest(object)) < 1)))
            return false;
    }
    return true;
}
