/*
 * What to draw, decided before any OpenGL call: effects with their reasons, the error budget, the lights'
 * views and the passes in order. Plain data.
 */
#ifndef RENDERER_PLAN_H
#define RENDERER_PLAN_H

#include "renderer/bands.h"
#include "renderer/calibration.h"
#include "renderer/casters.h"
#include "renderer/environment.h"
#include "renderer/projection.h"
#include "renderer/render.h"

struct render_frame; /* execute.h */

/* What is asked. */
struct render_request {
    const struct io_scene *scene;
    const struct render_media *media;     /* of the scene; NULL: made for this plan                  */
    const struct render_table *tables;    /* one for each medium; NULL: baked to the plan's table_epsilon */
    const struct lut_tsm *const *volumes; /* the same of translucent shadow maps            */
    struct render_tsm_options tsm;
    struct render_shadow_options shadows;
    const struct render_environment *environment; /* the scene's, if it has one; NULL: read for this plan */
    enum render_environment_samples environment_samples;
    int ambient_visibility;
    double epsilon;
    double budget_ms; /* 0: none; else epsilon is the least whose plan is predicted to take no longer */
    bool is_warm;     /* predict a picture after the first */
    const struct render_calibration *calibration; /* NULL: costs are those of cost.h's machine */
    struct render_limits limits;
    double spacing_mm; /* 0: from epsilon */
    enum render_technique technique;
    enum render_area area;
    enum render_coherence coherence;
    int splat_grid; /* as in render_options */
    enum render_gather gather;
    bool has_gpu;     /* OpenGL is not software */
    bool is_captured; /* no scattering; what it would need is kept instead */
    bool is_tone_mapped;
    bool keeps_negligible; /* as in render_options */
};

enum render_draw_kind {
    RENDER_DRAW_SCENE = 0,  /* every object                                    */
    RENDER_DRAW_FULLSCREEN, /* one triangle over the target                    */
    RENDER_DRAW_BY_RUN,     /* the pass's run function draws into the targets  */
    RENDER_DRAW_NOTHING,    /* the pass's run function needs no targets        */
};

enum { RENDER_PASS_READS = 10, RENDER_PASS_WRITES = 4, RENDER_PASS_EXTRAS = 3, RENDER_PASS_TARGETS = 7 };

/* One row of an effect. Names of textures are those of the table in plan.c. */
struct render_pass {
    const char *name; /* also of its shaders: NAME.vert or fullscreen.vert, NAME.frag */
    enum render_draw_kind draw;
    bool is_per_view;   /* once for each of the lights' views        */
    bool is_per_map;    /* once for each translucent shadow map      */
    bool is_of_samples; /* per view: also for views that are repeated for other objects */
    bool is_added;      /* to what the target holds, else replaces it */
    bool is_blended;    /* draws add up, on a target that was cleared         */
    const char *reads[RENDER_PASS_READS];
    const char *reads_if_written[RENDER_PASS_READS]; /* shader sees HAS_<NAME>        */
    const char *writes[RENDER_PASS_WRITES];
    const char *writes_if_wanted[RENDER_PASS_EXTRAS]; /* behind them, if render_plan_wants: HAS_<NAME> */
    const char *depth_written;                        /* depth texture, tested and written         */
    const char *depth_tested;                         /* depth texture, tested only                */
    void (*bind)(const struct render_frame *frame);   /* sets uniforms  */
    bool (*run)(const struct render_frame *frame, dipole_status *status); /* BY_RUN and NOTHING */
};

struct render_decision {
    bool is_active;
    char reason[160];
    double cost_ms; /* predicted, 0 unless active         */
    double error;   /* that it leaves, relative radiosity */
};

struct render_plan;

struct render_effect {
    const char *name, *source; /* source: publication, or what it is */
    struct render_decision (*decide)(const struct render_request *request, const struct render_plan *plan);
    double (*cost_ms)(const struct render_plan *plan); /* when it is active (cost.h)  */
    double start_ms;                                   /* of the first picture, beside its programs   */
    double (*error)(const struct render_plan *plan);   /* NULL: it leaves none        */
    bool is_kept; /* what it makes is kept while no object changes: later pictures do without it */
    const struct render_pass *passes;
    size_t pass_count;
};

/* THE list, in the order of the frame; ends with NULL. */
extern const struct render_effect *const render_effects[];

/* For decide(). */
struct render_decision render_called_for(const char *format, ...) DIPOLE_PRINTF(1, 2);
struct render_decision render_not_called_for(const char *format, ...) DIPOLE_PRINTF(1, 2);

/* OTHER: kept by its pass, which says how to bind it. */
enum render_format { RENDER_RGBA32F = 0, RENDER_R32F, RENDER_R32UI, RENDER_DEPTH32F, RENDER_OTHER };
enum render_size {
    RENDER_SIZE_FRAME = 0,
    RENDER_SIZE_LIGHT_VIEW,
    RENDER_SIZE_MAP,
    RENDER_SIZE_VERTICES,
    RENDER_SIZE_PEEL,
    RENDER_SIZE_SHADOW,
    RENDER_SIZE_LIGHT_BLOCKS,  /* a texel for each block of a light's view, render_plan_shadow_block_px a
                                  side */
    RENDER_SIZE_MAP_BLOCKS,    /* the same of a translucent shadow map, RENDER_MAP_BLOCK a side */
    RENDER_SIZE_SHADOW_BLOCKS, /* a texel for each block of them, RENDER_SHADOW_BLOCK a side */
};

/* Width of textures with a texel for each vertex of the scene. */
enum { RENDER_VERTEX_ROW = 1024 };

struct render_texture {
    const char *name;
    enum render_format format;
    enum render_size size;
    bool is_multisampled;
    bool is_mipmapped;       /* levels are made anew after each pass that writes it */
    bool is_far_where_empty; /* of a light's view: cleared to a point far away, else to 0 */
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
    int block_px;      /* blocks of so many texels a side are at most spacing wide */
    double texel_area; /* mm^2; perspective: at distance 1                  */
    size_t object;     /* of translucent shadow maps, and where is_of_object: whose light it holds */
    bool is_of_object; /* shows that object alone; others do not hide it       */
    bool is_repeated;  /* the view before is of the same light: passes that are not of samples are done */
    int layer; /* shows what faces the light behind so many such surfaces of the object: those that the view
                  before it shows, and others. theory.md T71 */
};

/* What shadows of one of the lights' views are looked up in. theory.md T67. */
struct render_plan_shadow {
    struct render_projection projection;
    int size_px;
    double nearest_mm; /* along the axis: nothing that blocks is nearer to the light */
    double
        light_size; /* point: diameter in mm; parallel: of its disc at distance 1; 0: it has no penumbras */
    double surface_count; /* about so many of blockers that let light through, in all texels  */
    double share;         /* about so much of what the light lights, blockers may be before   */
};

enum { RENDER_SHADOW_BLOCK = 16, RENDER_MAP_BLOCK = 4 };

/* What blocks light, of lights that shine; all 0 in a scene with neither blockers nor such lights. */
struct render_plan_shadows {
    bool is_called_for; /* else the lights' views do for shadows */
    size_t blocker_count, translucent_count, coloured_count, soft_light_count, spot_count, triangle_count,
        opaque_triangle_count;
    size_t object_count; /* that let light through: counted as translucent, too, but not as blockers */
    size_t layer_count;  /* of views of what lies behind an object's first surface */
    struct render_casters casters;
    int node_limit, tap_count, size_px;
    struct render_plan_shadow *of_view; /* NULL: not called for */
    struct render_plan_shadow *of_map;  /* the same of translucent shadow maps */
};

struct render_plan_pass {
    const struct render_pass *pass;
    size_t effect; /* index into render_effects                        */
    size_t view;   /* index into views, when the pass is_per_view; into maps, when is_per_map */
};

/* What becomes of one object. */
struct render_plan_object {
    size_t medium;
    struct render_ball ball;
    bool is_visible;     /* some of it may be in the picture; what is not is no more than a blocker   */
    double lit_area_mm2; /* of its surface that may face a light, light by light                     */
    double pixel_count;  /* that it may cover, as a ball would                                       */
    double spacing_mm;   /* of its finest light samples                                              */
    double cell_mm;      /* of cubes that samples are gathered in; 0: they follow the light's view   */
};

/* What becomes of the visible objects of one medium. All 0 where there are none. */
struct render_plan_medium {
    bool is_visible;
    double diameter_mm;               /* of the largest object                            */
    double r_max_mm;                  /* splats reach as far                              */
    double wanted_mm;                 /* spacing of light samples that epsilon asks for   */
    double spacing_mm;                /* of the finest: as wanted, or as many as may be   */
    double blur_mm[IO_CHANNEL_COUNT]; /* of the profile, so that they do not show; 0: none is needed */
    double spread_mm;                 /* of the light that is put together in one, T79; 0 of a grid */
    struct render_band bands[RENDER_BAND_LIMIT]; /* none unless splatted or captured */
    int band_count;
    /* About how far one has to go for a gathered band and all beyond it to change by as much as they are; 0
     * for the finest, and where nothing is gathered. */
    double change_mm[RENDER_BAND_LIMIT];
    double inner_mm; /* of the pattern of samples of translucent shadow maps     */
    double truncation_error, aliasing_error, blur_error, table_error;
};

/* Owns its lists; end it with render_plan_destroy. */
struct render_plan {
    enum render_technique technique; /* never AUTO                                       */
    enum render_area area;
    bool has_light_pictures; /* what lights see is drawn in memory */
    bool has_grid;        /* samples are the texels of a uniform grid of each light's view, in one band */
    double grid_texel_mm; /* across the view, at the widest */
    enum render_coherence coherence; /* never AUTO; NONE where no light samples move */
    enum render_gather gather;       /* never AUTO; C unless the technique is GATHER */
    char gather_reason[128];         /* why */
    bool has_gpu;                    /* OpenGL is not software */
    size_t deformed_vertex_count, moved_vertex_count;
    double epsilon;
    double budget_ms; /* that it was chosen for; 0: none */
    double beside_ms; /* predicted of what no effect does */
    const struct render_media *media;
    struct render_media *own_media; /* when the request brought none                    */
    struct render_plan_object *objects;
    struct render_plan_medium *of_medium;
    bool has_scattering;          /* some visible medium's        */
    bool is_glossy, has_specular; /* some visible object is; and it can be seen */
    double gloss_most;   /* what the glossiest mirrors, of what a lit flat surface sends out, at the most */
    bool has_object_ids; /* objects are told apart: they differ, or are near each other */
    const char *ids_reason; /* why, or why not                                             */
    size_t lit_count;       /* lights that are not black                        */
    bool has_environment;   /* that is drawn                                    */
    const struct render_environment *environment; /* NULL: none, black, or the technique cannot       */
    struct render_environment *own_environment;   /* when the request brought none                    */
    struct render_irradiance **irradiance;        /* of each medium; NULL where it lights nothing     */
    int environment_order;                        /* the highest of any medium                        */
    double irradiance_tolerance;                  /* of tables of irradiance, by its mean         */
    double irradiance_nodes, irradiance_terms;    /* of all tables; and terms m that they sum         */
    int visibility_ray_count;                     /* from each sample, through what is in the way     */
    int peel_side_px;                             /* of the largest layer; 0 unless peeled            */
    int peel_axis_count;                          /* that layers are peeled along; 0: none            */
    size_t triangle_count;
    double covered_px; /* pixels that objects may cover, at most all       */
    double glossy_px;  /* of these, those that glossy objects may cover */

    /* The error budget: shares of epsilon, then what they lead to, of the worst medium. */
    double truncation_epsilon, aliasing_epsilon, banding_epsilon, table_epsilon;
    /* Of gathering alone: what interpolation may err by, of what is lit and of what is there; samples of
     * the finest band are merged in cubes so many spacings wide. */
    double interpolation_epsilon, own_epsilon, finest_spacings;
    double truncation_error, aliasing_error, blur_error, banding_error, table_error, environment_error,
        gloss_error, error_predicted; /* gloss: 0 where it is drawn */
    double spread;                    /* of a sample's light, as part of their spacing; 0 unless gathered */
    double flat_mm;    /* light may be looked for so far from surfaces; INFINITY: of a capture */
    double r_max_mm;   /* the farthest medium's                            */
    double r_max_px;   /* on the picture, at the nearest                   */
    double spacing_mm; /* the narrowest medium's                           */
    int band_count;    /* the most of any medium                           */
    char notes[RENDER_NOTE_LIMIT][256];
    size_t note_count;

    struct render_ball ball;
    struct render_projection camera;
    int width_px, height_px;
    double pixel_mm;       /* perspective: at distance 1                       */
    double least_pixel_mm; /* on the nearest surface                           */

    struct render_decision decisions[RENDER_EFFECT_LIMIT];
    size_t effect_count;
    struct render_plan_view *views;
    size_t view_count;
    struct render_plan_view *maps; /* translucent shadow maps: of each light and visible object */
    size_t map_count;
    struct render_tsm_options tsm;
    struct render_plan_shadows shadows;
    size_t vertex_count; /* of the scene, when the maps are gathered at vertices */
    struct render_plan_pass *passes;
    size_t pass_count;
};

/*
 * Fails with DIPOLE_BAD_VALUE (picture too large, epsilon out of range, table of another medium),
 * DIPOLE_OUT_OF_MEMORY, or when a pass would read what none has written.
 */
DIPOLE_CHECKED bool render_plan_create(const struct render_request *request, struct render_plan **plan_out,
                                       dipole_status *status);
void render_plan_destroy(struct render_plan *plan);

/* What the picture is predicted to take: all effects, and beside_ms. */
double render_plan_cost_ms(const struct render_plan *plan);

/*
 * Of a request with a budget: set epsilon to the least of RENDER_BUDGET_EPSILON_MIN to RENDER_EPSILON_MAX,
 * in steps of a tenth of a decade, whose plan is predicted to take no longer; to the largest when all take
 * longer, and render_plan_create says so in a note. Does nothing without a budget. Fails as
 * render_plan_create does.
 */
DIPOLE_CHECKED bool render_plan_spend_budget(struct render_request *request, dipole_status *status);

/* Fails for an epsilon out of range, a picture that is too large, or too many lights. */
DIPOLE_CHECKED bool render_plan_check_request(const struct io_scene *scene, double epsilon,
                                              dipole_status *status);

/* Whether nothing asks for shadows of the lights' views: maps have their own. */
bool render_plan_shades_maps_alone(const struct render_plan *plan);

/* Texels a side of a block of the lights' views whose shadow is looked up once: at most as wide as light
 * samples are apart, where no light has a size half as wide. */
int render_plan_shadow_block_px(const struct render_plan *plan);

/* Views whose shadows are looked up in a map of their own: those of one light's objects share it. */
size_t render_plan_shadow_map_count(const struct render_plan *plan);

/* Whether a light is not black. */
bool render_light_shines(const struct io_light *light);

/* What a medium's bands are tabulated by. */
struct render_band_key render_plan_band_key(const struct render_plan *plan,
                                            const struct render_table *table, size_t medium);

/* Whether light samples are summed: by splats or by gathering. */
bool render_plan_sums_samples(const struct render_plan *plan);

/* Whether what lights see is drawn in memory as a whole, since more than samples is taken from it. */
bool render_plan_keeps_pictures(const struct render_plan *plan);

/* Fails unless the table is of this medium, by its hash; names the first coefficient that differs. place:
 * the table's file, or NULL. */
DIPOLE_CHECKED bool render_plan_check_table(const struct render_table *table,
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

/* The textures that a pass writes under this plan, ending with NULL; depth aside. */
void render_plan_list_writes(const struct render_plan *plan, const struct render_pass *pass,
                             const char *writes[RENDER_PASS_TARGETS + 1]);

/* Whether the scene calls for a texture that a pass can write beside its others. */
bool render_plan_wants(const struct render_plan *plan, const char *texture);

/* Slices of a volume for so many samples, 0: the usual number; 0 when there is no such pattern. */
int render_plan_slice_count(int sample_count);

/* Texels of a peeled layer are so wide, as part of the spacing: patches as fine as those of triangles. */
#define RENDER_PEEL_SHARE 0.35
/* Texels a side of an object's peeled layers; 0 where it is not sampled. */
int render_plan_peel_side_px(const struct render_plan *plan, size_t object);
/* The axis of RENDER_ENVIRONMENT_PEEL: y. */
enum { RENDER_PEEL_AXIS = 1 };

/*
 * Aliasing of a grid whose texels are texel_mm wide across a light's view, at most, on surfaces of any
 * slope to the light, as part of the radiosity of one that faces it. theory.md T44
 */
double render_plan_grid_aliasing(const dipole_stack *stack, double texel_mm);

/* Pixels that the rectangles of a uniform grid's splats cover, about, each once for each splat. */
double render_plan_grid_fragments(const struct render_plan *plan);

/* Fails for a number of rays that is out of range. */
DIPOLE_CHECKED bool render_plan_check_rays(int ray_count, dipole_status *status);

/* Why nothing is lit; NULL when something may be. */
const char *render_plan_dark_reason(const struct render_plan *plan);

/* Pixels are as far apart as this on the object's near side. */
double render_plan_pixel_mm(const struct render_plan *plan, const struct render_plan_object *object);

/* The texels of the largest map; 0 when there is none. */
int render_plan_map_side_px(const struct render_plan *plan);

/* Whether a pass of the plan writes, or needs, that texture. */
bool render_plan_writes(const struct render_plan *plan, const char *texture);
bool render_plan_reads(const struct render_plan *plan, const char *texture);

/* Cubes that samples stay in (cell_mm), 2^this to a side, are as wide as the finest band's spacing, or less
 * by up to a half; may be negative. */
int render_plan_code_level(const struct render_plan *plan, size_t object);

#endif
