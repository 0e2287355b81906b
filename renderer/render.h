/* Draws scenes of translucent objects off screen. Knows no file formats; plan.h says what is drawn. */
#ifndef RENDERER_RENDER_H
#define RENDERER_RENDER_H

#include "io/exr.h"
#include "io/scene_file.h"
#include "lutgen/lut.h"
#include "renderer/light_samples.h"
#include "renderer/media.h"

/* Where OpenGL 4.5 comes from. The default tries OSMesa, then EGL. */
enum render_context_kind {
    RENDER_CONTEXT_DEFAULT = 0,
    RENDER_CONTEXT_OSMESA,
    RENDER_CONTEXT_EGL,
    RENDER_CONTEXT_WINDOW, /* GLFW, hidden; needs a display */
};

/* The default gathers, or takes splats where epsilon is small (RENDER_GATHER_EPSILON_MIN), or Lambert where
 * scattering stays within a pixel. The reference (reference.h) is slow and exact, and needs no OpenGL. */
enum render_technique {
    RENDER_TECHNIQUE_AUTO = 0,
    RENDER_TECHNIQUE_SPLAT,
    RENDER_TECHNIQUE_LAMBERT,
    RENDER_TECHNIQUE_REFERENCE,
    RENDER_TECHNIQUE_TSM,    /* translucent shadow maps; never taken by default */
    RENDER_TECHNIQUE_GATHER, /* what splats sum, by scale: fewer samples and pixels where the profile is
                                wide */
};
/* "auto", "splat", "lambert", "reference", "tsm", "gather", NULL */
extern const char *const render_technique_names[];

/* How a splat knows the area that its sample stands for: by the flux of its texels, which needs no area; or
 * as in the paper, its disc of r_max over the number of samples that overlap a pixel, for comparison. */
enum render_area { RENDER_AREA_FLUX = 0, RENDER_AREA_OVERLAP };
extern const char *const render_area_names[]; /* "flux", "overlap", NULL */

/* Texels a side of a uniform grid of each light's view, whose lit texels are splats as in the paper; AUTO:
 * as many as the spacing that epsilon asks for needs on surfaces that face the light (theory.md T11, T44).
 */
enum { RENDER_SPLAT_GRID_AUTO = -1, RENDER_SPLAT_GRID_MIN = 2, RENDER_SPLAT_GRID_MAX = 4096 };

/* How light samples are kept from flickering over frames in which light or objects move: not at all; each
 * light's view sampled twice, half a block apart; or samples that stay on the surface. The default is the
 * last, where there is more than one frame. */
enum render_coherence {
    RENDER_COHERENCE_AUTO = 0,
    RENDER_COHERENCE_NONE,
    RENDER_COHERENCE_TWO_PASS,
    RENDER_COHERENCE_SURFACE,
};
extern const char *const render_coherence_names[]; /* "auto", "none", "two-pass", "surface", NULL */

/* What gathers: the processor, in C, or OpenGL's shaders. The default is what the plan takes for faster. */
enum render_gather { RENDER_GATHER_AUTO = 0, RENDER_GATHER_C, RENDER_GATHER_GL };
extern const char *const render_gather_names[]; /* "auto", "c", "gl", NULL */

/* Where light from all around is sampled: on the triangles; or as in the paper, on layers peeled along y;
 * or along all three axes. */
enum render_environment_samples {
    RENDER_ENVIRONMENT_SURFACE = 0,
    RENDER_ENVIRONMENT_PEEL,
    RENDER_ENVIRONMENT_PEEL3,
};
extern const char *const render_environment_samples_names[]; /* "surface", "peel", "peel3", NULL */

/* epsilon: asked relative error of the radiosity. */
#define RENDER_EPSILON_DEFAULT 0.01
#define RENDER_EPSILON_MIN 1e-5
#define RENDER_EPSILON_MAX 0.5
/* The least that a budget is spent on: below it what is not predicted, edges and gloss, errs more, and some
 * media have no such tables. */
#define RENDER_BUDGET_EPSILON_MIN 0.003
#define RENDER_BUDGET_MS_MIN 0.1
#define RENDER_BUDGET_MS_MAX 1e7

/* Gathering sums in single precision by piecewise cubics, which keep no less. */
#define RENDER_GATHER_EPSILON_MIN 0.003

/* Tone mapping leaves pixels alone whose largest channel is up to this, times 2^exposure_ev. T20 */
#define RENDER_TONE_KNEE 0.6

/* Largest picture: sides and pixels (a pixel takes about 180 bytes while it is drawn). */
enum { RENDER_SIDE_LIMIT = 16384 };
#define RENDER_PIXEL_LIMIT ((size_t)1 << 24)

/* So many light samples at the most, whatever epsilon asks for, 32 bytes each: so many texels do all
 * lights' views have, unless there are very many lights. */
#define RENDER_LIGHT_SAMPLE_LIMIT ((size_t)1 << 25)

/* Points that the reference takes a light with a size for. */
enum { RENDER_LIGHT_PLACES = 128, RENDER_LIGHT_PLACE_LIMIT = 4096 };

/* Draws one scene, any number of times. End it with render_destroy. */
struct renderer;

/*
 * Get an OpenGL context and take the scene's meshes to it. The scene must outlive the renderer; its camera
 * and lights may change between calls, its environment's scale and turn, too, its objects by
 * io_scene_set_frame alone, what they are made of only as render_renew_materials says. Fails as
 * render_environment_read does, with DIPOLE_NOT_SUPPORTED (no context: says which were tried and why each
 * failed) or DIPOLE_OUT_OF_MEMORY.
 */
DIPOLE_CHECKED bool render_create(const struct io_scene *scene, enum render_context_kind kind,
                                  struct renderer **renderer_out, dipole_status *status);
void render_destroy(struct renderer *renderer);

/*
 * Take up the materials, roughness and gloss of the scene's objects after any of them changed; tables are
 * baked anew when a picture first needs them. Fails as render_media_create does: the caller must then put
 * back the materials that were there, with which the renderer goes on.
 */
DIPOLE_CHECKED bool render_renew_materials(struct renderer *renderer, dipole_status *status);

/* Called now and then with the part that is done, 0 to 1, from the thread that draws. */
struct render_progress {
    void (*show)(void *context, const char *what, double fraction); /* NULL: nobody watches */
    void *context;
};

/* Where the global response is gathered: at each fragment, or at the meshes' vertices and interpolated. */
enum render_tsm_gather { RENDER_TSM_FRAGMENT = 0, RENDER_TSM_VERTEX };
extern const char *const render_tsm_gather_names[]; /* "fragment", "vertex", NULL */

/*
 * What is summed. TABLE: the samples of the pattern, each looked up in a volume. EXACT: the same without a
 * table. TEXELS: the 3D form of theory.md T30 over all texels of the map. PROFILE: R_d of the distance over
 * all texels, which is what splats sum. From one to the next one source of error goes: the table, the
 * samples, the form.
 */
enum render_tsm_response {
    RENDER_TSM_TABLE = 0,
    RENDER_TSM_EXACT,
    RENDER_TSM_TEXELS,
    RENDER_TSM_PROFILE,
};
extern const char *const render_tsm_response_names[]; /* "table", "exact", "texels", "profile", NULL */

/* Which part of the response; all of it when texels are summed. */
enum render_tsm_part { RENDER_TSM_SUM = 0, RENDER_TSM_GLOBAL, RENDER_TSM_LOCAL };
extern const char *const render_tsm_part_names[]; /* "sum", "global", "local", NULL */

/* Of translucent shadow maps alone. */
struct render_tsm_options {
    enum render_tsm_gather gather;
    enum render_tsm_response response;
    enum render_tsm_part part;
    int sample_count; /* of the pattern: 13, 21, 53, 117 or 245; 0: 21, or what the volumes have */
    int layer_count;  /* 0: all between a point and where its light entered is taken for solid; else so many
                         surfaces behind each other, even, up to RENDER_TSM_LAYER_LIMIT, tell what is air */
};
enum { RENDER_TSM_LAYER_LIMIT = 16, RENDER_TSM_USUAL_SAMPLES = 21 };

/* What the taps' turn in each pixel is fixed to: others than the first for comparison. */
enum render_shadow_turn {
    RENDER_SHADOW_TURN_SCREEN = 0,
    RENDER_SHADOW_TURN_SURFACE,
    RENDER_SHADOW_TURN_NONE
};

/* Of scenes with blockers or lights with a size alone. */
struct render_shadow_options {
    int node_limit; /* of a texel's transmittance: 0: RENDER_SHADOW_NODES; INT_MAX: all there are */
    int tap_count;  /* of the search and of the filter each; 0: RENDER_SHADOW_TAPS */
    int side_px;    /* of the maps; 0: RENDER_SHADOW_SIDE */
    enum render_shadow_turn turn;
    const double (*taps)[2]; /* tap_count places in the disc of radius 1; NULL: those of T68 */
};
enum {
    RENDER_SHADOW_NODES = 8,
    RENDER_SHADOW_TAPS = 25,
    RENDER_SHADOW_TAP_LIMIT = 1024,
    RENDER_SHADOW_SIDE = 1024,
    RENDER_SHADOW_SIDE_LIMIT = 2048
};

/* What parts of the error may be, in place of their shares of epsilon: to measure what each costs. 0: the
 * share. */
struct render_limits {
    double truncation, aliasing, banding, interpolation, table, environment;
};

struct render_options {
    enum render_technique technique;
    double epsilon;   /* 0: RENDER_EPSILON_DEFAULT                              */
    double budget_ms; /* 0: none; else in place of epsilon the least error whose picture is predicted to
                         take no longer */
    bool is_warm;     /* of a budget: the pictures after the first are to keep to it */
    struct render_limits limits;
    enum render_area area;
    enum render_coherence coherence;
    int splat_grid; /* of splats alone; 0: samples follow the surface, summed in bands */
    enum render_gather gather;
    const struct render_table *tables;    /* one for each of the scene's media; NULL: baked in memory */
    const struct lut_tsm *const *volumes; /* the same of translucent shadow maps                   */
    struct render_tsm_options tsm;
    struct render_shadow_options shadows;
    enum render_environment_samples environment_samples;
    int ambient_visibility; /* rays from each sample of the environment's light; 0: nothing hides it */
    bool keeps_negligible;  /* draw also what changes nothing by more than epsilon, to see what it costs */
    bool is_tone_mapped;    /* 0..1 over the scene's background, for a PNG; else
                            linear radiance, premultiplied by coverage (alpha)  */

    /* Of the reference alone. */
    struct render_progress progress;
    int thread_count;      /* 0: as many as processors; the picture does not depend on it */
    size_t sample_limit;   /* 0: RENDER_REFERENCE_SAMPLE_LIMIT                            */
    int light_place_count; /* points that a light with a size is taken for; 0: RENDER_LIGHT_PLACES */
};

enum { RENDER_EFFECT_LIMIT = 48, RENDER_NOTE_LIMIT = 4, RENDER_DOUBLING_LIMIT = 32 };

/* One step of the reference: surface samples so far, and the error estimated from them. */
struct render_doubling {
    size_t sample_count;
    double error;
};

struct render_effect_report {
    const char *name;
    bool is_active;
    char reason[160];
    double predicted_ms; /* NAN: of the reference nothing is predicted            */
    double time_ms;
    double error; /* predicted, that it leaves; INFINITY: nothing bounds it  */
};

/* What was done, why, and how long it took. */
struct render_report {
    enum render_technique technique; /* never AUTO */
    double epsilon;
    double budget_ms;       /* that epsilon was chosen for; 0: it was asked for */
    double predicted_ms;    /* of the whole picture; NAN: of the reference nothing is predicted */
    double error_predicted; /* of the reference estimated; INFINITY: not bounded; else what is cut off and
                               the table's, and the root of the squares of the others */
    double truncation_error, table_error;
    double aliasing_error, blur_error, banding_error;
    double environment_error;    /* of the harmonics left out */
    double r_max_mm, spacing_mm; /* 0 when not splatted */
    size_t sample_count;         /* at the finest */
    size_t splat_count, view_count;
    int band_count;
    int map_count, map_side_px; /* translucent shadow maps, and the side of the largest */
    struct render_effect_report effects[RENDER_EFFECT_LIMIT];
    size_t effect_count;
    struct render_doubling doublings[RENDER_DOUBLING_LIMIT]; /* of the reference */
    size_t doubling_count;
    double total_ms;
    char notes[RENDER_NOTE_LIMIT][256]; /* promises that could not be kept */
    size_t note_count;
};

/*
 * Draw the scene as its camera, lights and *options say into a new picture of 4 channels, with attributes
 * dipole:technique, dipole:epsilon and others. *report_out may be NULL.
 * Fails with DIPOLE_BAD_VALUE, DIPOLE_OUT_OF_MEMORY or DIPOLE_NOT_SUPPORTED; *image_out is then NULL.
 */
DIPOLE_CHECKED bool render_draw(struct renderer *renderer, const struct render_options *options,
                                struct io_image **image_out, struct render_report *report_out,
                                dipole_status *status);

/*
 * What a picture is made of beside the profile, in arrays of width_px x height_px pixels, rows from the
 * top: radiance = exit_per_sr x radiosity + specular, where radiosity [W/mm^2] at position_mm is the sum
 * over the samples of flux_w x R_d(|position_mm - sample position|). theory.md T13, T14.
 */
struct render_capture {
    int width_px, height_px;
    float *position_mm;                  /* x 3; 0 where no object is                               */
    float *object;                       /* number of the object that is seen, from 1; 0: none. Only light
                                            that entered through the same object comes out: samples have
                                            object - 1, where the scene has several                 */
    float *coverage;                     /* 0 to 1; 1 only where the equation above holds exactly:
                                            the pixel and its 3 x 3 neighbours are wholly covered, and
                                            the pixel shows a single surface                        */
    float *exit_per_sr;                  /* radiance leaving toward the eye per radiosity           */
    float *specular;                     /* x 3, radiance                                           */
    struct render_light_samples samples; /* spacing_mm apart or less                                */
};

/* Fails as render_draw does; the caller ends *capture_out with render_capture_destroy. spacing_mm > 0;
 * samples are farther apart where they would be more than RENDER_LIGHT_SAMPLE_LIMIT. */
DIPOLE_CHECKED bool render_capture_create(struct renderer *renderer, double spacing_mm,
                                          struct render_capture **capture_out, dipole_status *status);
void render_capture_destroy(struct render_capture *capture);

#endif
