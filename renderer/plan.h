/*
 * What to draw, decided before any OpenGL call: effects with their reasons, the error budget, the lights'
 * views and the passes in order. Plain data.
 */
#ifndef RENDERER_PLAN_H
#define RENDERER_PLAN_H

#include "renderer/bands.h"
#include "renderer/projection.h"
#include "renderer/render.h"

struct render_frame; /* execute.h */

/* What is asked. */
struct render_request {
    const struct io_scene *scene;
    const struct lut_splat *table; /* NULL: one is baked to the plan's table_epsilon */
    double epsilon;
    double spacing_mm; /* 0: from epsilon */
    enum render_technique technique;
    bool is_captured; /* no scattering; what it would need is kept instead */
    bool is_tone_mapped;
};

enum render_draw_kind {
    RENDER_DRAW_SCENE = 0,  /* every object                                    */
    RENDER_DRAW_FULLSCREEN, /* one triangle over the target                    */
    RENDER_DRAW_SPLATS,     /* one rectangle per splat                         */
    RENDER_DRAW_NOTHING,    /* the pass's run function works on the CPU        */
};

enum { RENDER_PASS_READS = 6, RENDER_PASS_WRITES = 3 };

/* One row of an effect. Names of textures are those of the table in plan.c. */
struct render_pass {
    const char *name; /* also of its shaders: NAME.vert or fullscreen.vert, NAME.frag */
    enum render_draw_kind draw;
    bool is_per_view; /* once for each of the lights' views        */
    bool is_added;    /* to what the target holds, else replaces it */
    const char *reads[RENDER_PASS_READS];
    const char *reads_if_written[RENDER_PASS_READS]; /* shader sees HAS_<NAME>        */
    const char *writes[RENDER_PASS_WRITES];
    const char *depth_written;                      /* depth texture, tested and written         */
    const char *depth_tested;                       /* depth texture, tested only                */
    void (*bind)(const struct render_frame *frame); /* sets uniforms  */
    bool (*run)(const struct render_frame *frame, dipole_status *status); /* draw NOTHING   */
};

struct render_decision {
    bool is_active;
    char reason[160];
};

struct render_plan;

struct render_effect {
    const char *name, *source; /* source: publication, or what it is */
    struct render_decision (*decide)(const struct render_request *request, const struct render_plan *plan);
    const struct render_pass *passes;
    size_t pass_count;
};

/* THE list, in the order of the frame; ends with NULL. */
extern const struct render_effect *const render_effects[];

/* For decide(). */
struct render_decision render_called_for(const char *format, ...) DIPOLE_PRINTF(1, 2);
struct render_decision render_not_called_for(const char *format, ...) DIPOLE_PRINTF(1, 2);

enum render_format { RENDER_RGBA32F = 0, RENDER_DEPTH32F, RENDER_ON_CPU };
enum render_size { RENDER_SIZE_FRAME = 0, RENDER_SIZE_LIGHT_VIEW };

struct render_texture {
    const char *name;
    enum render_format format;
    enum render_size size;
    bool is_multisampled;
};

/* The texture of that name; NULL when there is none. */
const struct render_texture *render_texture_find(const char *name);

/* What a light sees; six of them make the cube about a point light that is near. */
struct render_plan_view {
    size_t light;
    struct render_projection projection;
    bool is_cube_face;
    int face; /* 0..5: +x -x +y -y +z -z                          */
    int size_px;
    int levels;        /* blocks of 2^levels texels are at most spacing wide */
    double texel_area; /* mm^2; perspective: at distance 1                  */
};

struct render_plan_pass {
    const struct render_pass *pass;
    size_t effect; /* index into render_effects                        */
    size_t view;   /* index into views, when the pass is_per_view      */
};

/* Owns its lists; end it with render_plan_destroy. */
struct render_plan {
    enum render_technique technique; /* never AUTO                                       */
    double epsilon;
    dipole_coefficients coefficients[IO_CHANNEL_COUNT];
    double eta, diffuse_reflectance[IO_CHANNEL_COUNT];
    bool has_scattering; /* some channel's alpha' > 0                        */
    bool has_specular;
    size_t lit_count; /* lights that are not black                        */

    /* The error budget: shares of epsilon, then what they lead to. */
    double truncation_epsilon, aliasing_epsilon, banding_epsilon, table_epsilon;
    double truncation_error, aliasing_error, banding_error, table_error, error_predicted;
    double r_max_mm;                             /* splats reach as far                              */
    double r_max_px;                             /* on the picture, at the nearest                   */
    double spacing_mm;                           /* asked of the finest light samples */
    struct render_band bands[RENDER_BAND_LIMIT]; /* none unless splatted or captured */
    int band_count;
    char notes[RENDER_NOTE_LIMIT][256];
    size_t note_count;

    struct render_ball ball;
    struct render_projection camera;
    int width_px, height_px;
    double pixel_mm; /* perspective: at distance 1                       */

    struct render_decision decisions[RENDER_EFFECT_LIMIT];
    size_t effect_count;
    struct render_plan_view *views;
    size_t view_count;
    struct render_plan_pass *passes;
    size_t pass_count;
};

/*
 * Fails with DIPOLE_BAD_VALUE (objects of different media, picture too large, epsilon out of range, table
 * of another medium), DIPOLE_OUT_OF_MEMORY, or when a pass would read what none has written.
 */
DIPOLE_CHECKED bool render_plan_create(const struct render_request *request, struct render_plan **plan_out,
                                       dipole_status *status);
void render_plan_destroy(struct render_plan *plan);

/* The first part of a plan, all that the reference needs: what the scene says, checked (media, lights,
 * camera); neither budget nor views nor passes. Owns nothing then. */
DIPOLE_CHECKED bool render_plan_read_scene(const struct render_request *request, struct render_plan *plan,
                                           dipole_status *status);

/* What every technique asks of a scene: size of the picture, number of lights; and of epsilon. Fails with
 * DIPOLE_BAD_VALUE. */
DIPOLE_CHECKED bool render_scene_check(const struct io_scene *scene, double epsilon, dipole_status *status);

/* Whether a light is not black. */
bool render_light_shines(const struct io_light *light);

/* Fails unless every object has the same medium with one index; names the two objects. */
DIPOLE_CHECKED bool render_plan_check_media(const struct io_scene *scene, dipole_status *status);

/* Fails unless the table is of this medium, by its hash; names the first coefficient that differs. place:
 * the table's file, or NULL. */
DIPOLE_CHECKED bool render_plan_check_table(const struct lut_splat *table,
                                            const struct io_material *material, const dipole_place *place,
                                            dipole_status *status);

/*
 * Lay out the passes of the active effects of a list (render_effects but for tests): passes that are
 * per view stand together and are repeated view by view. Fails when a texture is read before it is
 * written, naming pass and texture.
 */
DIPOLE_CHECKED bool render_plan_add_passes(struct render_plan *plan,
                                           const struct render_effect *const *effects,
                                           dipole_status *status);

/* Whether a pass of the plan writes, or needs, that texture. */
bool render_plan_writes(const struct render_plan *plan, const char *texture);
bool render_plan_reads(const struct render_plan *plan, const char *texture);

#endif
