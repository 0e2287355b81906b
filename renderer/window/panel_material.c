#include "renderer/gui/gui.h"
#include "renderer/window/window.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NAME_LIMIT = 64 }; /* objects in the list of objects */

static const struct gui_range sigma_a_range = { 1e-5, 100, true, "%.3g" };
static const struct gui_range sigma_s_range = { 1e-3, 1000, true, "%.3g" };
static const struct gui_range reflectance_range = { 0.001, 0.999, false, "%.3f" };
static const struct gui_range path_range = { 1e-3, 100, true, "%.3g" };
static const struct gui_range thickness_range = { 1e-3, 100, true, "%.3g mm" };
static const struct gui_range eta_range = { 1, 2.5, false, "%.3f" };
static const struct gui_range roughness_range = { 0.05, 1, false, "%.2f" };

/* ---- changes ------------------------------------------------------------------------------------ */

/* Make the object what edited says; where that cannot be, it stays as it is, and the panel tells why. */
static bool apply(struct window *window, const struct io_object *edited)
{
    struct io_object *const object = &window->scene->objects[window->panel.object];
    const struct io_object before = *object;
    dipole_status status = { .code = DIPOLE_OK };
    *object = *edited;
    if (!render_renew_materials(window->renderer, &status)) {
        *object = before;
        window_tell(window, "Material not changed", &status);
        return false;
    }
    /* Tables from a folder are of the materials that were. */
    window->drawing.tables = NULL;
    window->drawing.volumes = NULL;
    window_touch(window);
    return true;
}

static void choose(struct window *window, size_t index)
{
    struct window_panel *const panel = &window->panel;
    const size_t object_count = window->scene->object_count;
    struct io_object edited = window->scene->objects[panel->object];
    dipole_status status = { .code = DIPOLE_OK };
    if (index < object_count) {
        edited.material = panel->as_read[index];
    } else {
        char path[4096];
        if (!io_material_bundled_path(panel->material_names[index], path, sizeof path, &status) ||
            !io_material_read(path, &edited.material, &status)) {
            window_tell(window, "Material not changed", &status);
            return;
        }
    }
    if (apply(window, &edited)) {
        panel->chosen[panel->object] = index;
        panel->is_edited[panel->object] = false;
        panel->layer = 0;
    }
}

/* The model by which a reflectance is turned into coefficients; false: there is none. As in files. */
static bool find_inverse(const struct io_material *material, dipole_model *model)
{
    *model = material->model == DIPOLE_MODEL_MULTIPOLE ? DIPOLE_MODEL_DIPOLE : material->model;
    return !io_material_has_layers(material) &&
           (*model == DIPOLE_MODEL_DIPOLE || *model == DIPOLE_MODEL_BEAM);
}

/* ---- what is derived ---------------------------------------------------------------------------- */

static const struct window_derived *derive(struct window *window)
{
    struct window_panel *const panel = &window->panel;
    struct window_derived *const derived = &panel->derived;
    const struct render_media *const media = window->renderer->media;
    const double epsilon = window->sides[0].epsilon;
    if (derived->media == media && derived->object == panel->object && derived->layer == panel->layer &&
        derived->epsilon == epsilon)
        return derived;
    const struct render_medium *const medium = &media->media[media->of_object[panel->object]];
    *derived = (struct window_derived){
        .media = media, .object = panel->object, .layer = panel->layer, .epsilon = epsilon
    };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        derived->coefficients[c] = *dipole_stack_coefficients(medium->stacks[c], panel->layer);
        derived->reflectance[c] = medium->diffuse_reflectance[c];
        if (medium->diffuse_reflectance[c] > 0)
            derived->r_max_mm[c] = dipole_stack_r_max_mm(medium->stacks[c], DIPOLE_FACE_LIT, epsilon);
    }
    return derived;
}

static void show_row(const char *name, const char *tip, const double values[IO_CHANNEL_COUNT])
{
    char text[24];
    gui_cell(GUI_DIM, name);
    gui_tip(tip);
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        snprintf(text, sizeof text, isfinite(values[c]) ? "%.3g" : "\u221e", values[c]);
        gui_cell(GUI_PLAIN, text);
        gui_tip(tip);
    }
}

static void show_derived(const struct window_derived *derived)
{
    static const double widths[] = { 0.43, 0.19, 0.19, 0.19 };
    double albedo[IO_CHANNEL_COUNT], path_mm[IO_CHANNEL_COUNT], diffuse_mm[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        albedo[c] = derived->coefficients[c].alpha_prime;
        path_mm[c] = derived->coefficients[c].mean_free_path_mm;
        diffuse_mm[c] = 1 / derived->coefficients[c].sigma_tr_per_mm;
    }
    if (!gui_table_begin("derived", widths, 4))
        return;
    gui_cell(GUI_DIM, "derived");
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        gui_cell(GUI_DIM, io_channel_names[c]);
    show_row("albedo \u03b1\u2032", "\u03c3s\u2032 / (\u03c3a + \u03c3s\u2032)", albedo);
    show_row("mean free path, mm", "1 / (\u03c3a + \u03c3s\u2032)", path_mm);
    show_row("diffuse path, mm", "Diffuse mean free path: 1 / \u03c3tr", diffuse_mm);
    show_row("reflectance", "Of what enters, the part that leaves again; of all layers.",
             derived->reflectance);
    show_row("r_max, mm", "All but \u03b5 of the light leaves within it.", derived->r_max_mm);
    gui_table_end();
}

/* ---- sliders ------------------------------------------------------------------------------------ */

static bool edit_coefficients(struct io_material *material, size_t layer)
{
    double sigma_a[IO_CHANNEL_COUNT], sigma_s[IO_CHANNEL_COUNT];
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        sigma_a[c] = material->layers[c][layer].medium.sigma_a_per_mm;
        sigma_s[c] = material->layers[c][layer].medium.sigma_s_prime_per_mm;
    }
    const int a = gui_sliders("absorption \u03c3a, 1/mm", true, &sigma_a_range, sigma_a);
    const int s = gui_sliders("reduced scattering \u03c3s\u2032, 1/mm", true, &sigma_s_range, sigma_s);
    if (a >= 0)
        material->layers[a][layer].medium.sigma_a_per_mm = sigma_a[a];
    if (s >= 0)
        material->layers[s][layer].medium.sigma_s_prime_per_mm = sigma_s[s];
    return a >= 0 || s >= 0;
}

static bool edit_reflectance(struct window *window, const struct window_derived *derived,
                             dipole_model model, struct io_material *material)
{
    double reflectance[IO_CHANNEL_COUNT], path_mm[IO_CHANNEL_COUNT];
    dipole_status status = { .code = DIPOLE_OK };
    for (int c = 0; c < IO_CHANNEL_COUNT; c++) {
        reflectance[c] = derived->reflectance[c];
        path_mm[c] = derived->coefficients[c].mean_free_path_mm;
    }
    const int r = gui_sliders("diffuse reflectance", true, &reflectance_range, reflectance);
    const int p = gui_sliders("mean free path, mm", true, &path_range, path_mm);
    const int c = r >= 0 ? r : p;
    if (c < 0)
        return false;
    dipole_medium *const medium = &material->layers[c][0].medium;
    if (dipole_medium_from_mean_free_path(reflectance[c], path_mm[c], medium->eta, medium->fdr_kind, model,
                                          medium, &status))
        return true;
    window_tell(window, "Material not changed", &status);
    return false;
}

static bool edit_eta(struct io_material *material, size_t layer)
{
    double eta = material->layers[0][layer].medium.eta;
    const bool is_changed = gui_slider("index \u03b7", &eta_range, &eta);
    for (int c = 0; is_changed && c < IO_CHANNEL_COUNT; c++)
        material->layers[c][layer].medium.eta = eta;
    return is_changed;
}

static bool edit_thickness(struct io_material *material, size_t layer)
{
    double thickness_mm = material->layers[0][layer].thickness_mm;
    if (!isfinite(thickness_mm) || !gui_slider("thickness", &thickness_range, &thickness_mm))
        return false;
    for (int c = 0; c < IO_CHANNEL_COUNT; c++)
        material->layers[c][layer].thickness_mm = thickness_mm;
    return true;
}

static bool edit_material(struct window *window, struct io_material *material)
{
    static const char *const forms[] = { "coefficients", "reflectance, path" };
    struct window_panel *const panel = &window->panel;
    const struct window_derived *const derived = derive(window);
    dipole_model model;
    const bool has_inverse = find_inverse(material, &model);
    size_t form = has_inverse && panel->is_by_reflectance;
    if (has_inverse && gui_choice("by", forms, 2, &form))
        panel->is_by_reflectance = form == 1;
    bool is_changed = form == 1 ? edit_reflectance(window, derived, model, material)
                                : edit_coefficients(material, panel->layer);
    is_changed |= edit_eta(material, panel->layer);
    return edit_thickness(material, panel->layer) || is_changed;
}

/* ---- what is edited ----------------------------------------------------------------------------- */

static void show_objects(struct window *window)
{
    static char texts[NAME_LIMIT][160];
    const char *names[NAME_LIMIT];
    const size_t all = window->scene->object_count, count = all < NAME_LIMIT ? all : NAME_LIMIT;
    for (size_t i = 0; i < count; i++) {
        snprintf(texts[i], sizeof texts[i], "%zu  %s", i + 1, window->scene->objects[i].name);
        names[i] = texts[i];
    }
    if (all > 1 && gui_choice("object", names, count, &window->panel.object))
        window->panel.layer = 0;
}

static void show_layers(struct window *window, const struct io_material *material)
{
    char texts[DIPOLE_LAYER_LIMIT][80];
    const char *names[DIPOLE_LAYER_LIMIT];
    for (size_t i = 0; i < material->layer_count; i++) {
        snprintf(texts[i], sizeof texts[i], "%zu  %s", i + 1, material->layer_names[i]);
        names[i] = texts[i];
    }
    if (material->layer_count > 1)
        gui_choice("layer", names, material->layer_count, &window->panel.layer);
}

void window_material_show(struct window *window)
{
    struct window_panel *const panel = &window->panel;
    if (!gui_section("Material", true))
        return;
    show_objects(window);
    size_t index = panel->chosen[panel->object];
    if (gui_choice("material", panel->material_names, window->scene->object_count + panel->list.count,
                   &index))
        choose(window, index);
    struct io_object edited = window->scene->objects[panel->object];
    show_layers(window, &edited.material);
    const bool is_edited = edit_material(window, &edited.material);
    const bool has_roughness = gui_slider("roughness", &roughness_range, &edited.roughness);
    const bool has_gloss = gui_check("gloss", &edited.has_specular);
    if (panel->is_edited[panel->object]) {
        gui_same_line();
        if (gui_button("Undo changes")) {
            choose(window, panel->chosen[panel->object]);
            return;
        }
    }
    if ((is_edited || has_roughness || has_gloss) && apply(window, &edited))
        panel->is_edited[panel->object] |= is_edited;
    show_derived(derive(window));
}
