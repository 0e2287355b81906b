/*
 * What can be turned to trade accuracy for time, one knob at a time: everything else is kept finer than
 * matters there. Which knobs a scene calls for, and their settings.
 */
#ifndef ACCURACY_KNOB_H
#define ACCURACY_KNOB_H

#include "renderer/renderer.h"

enum { ACCURACY_LABEL_SIZE = 32, ACCURACY_SETTING_LIMIT = 16 };

/* The scene that is measured, and what is baked for settings of its knobs. End it with
 * accuracy_subject_end. */
struct accuracy_subject {
    const char *path;
    const struct io_scene_options *reading;
    struct io_scene *scene;
    unsigned char *kinds; /* of its pixels, interior.h */
    struct renderer *renderer;
    struct render_media *media;
    struct render_tables *tables[2 * ACCURACY_SETTING_LIMIT];
    size_t table_count;
    struct render_volumes *volumes[ACCURACY_SETTING_LIMIT];
    size_t volume_count;
    /* The scene with other models, each with a renderer of its own. */
    struct io_scene *variants[ACCURACY_SETTING_LIMIT];
    struct renderer *variant_renderers[ACCURACY_SETTING_LIMIT];
    size_t variant_count;
};

struct accuracy_setting {
    char label[ACCURACY_LABEL_SIZE];
    struct renderer *renderer; /* NULL: the subject's */
    struct render_options drawing;
};

struct accuracy_knob {
    const char *name, *title;
    const char *what;                                               /* that is turned: one sentence */
    const char *(*why_not)(const struct accuracy_subject *subject); /* NULL: every scene calls for it; else
                                                                      why this one does not, or NULL */
    size_t limit;       /* which of struct render_limits: its offset */
    const char *format; /* printf, of a value: the setting's label; NULL: set() writes it */
    /* Bakes what the value needs. A setting that the scene cannot have is left without a label. */
    bool (*set)(const struct accuracy_knob *knob, struct accuracy_subject *subject, double value,
                struct accuracy_setting *setting, dipole_status *status);
    double values[ACCURACY_SETTING_LIMIT]; /* coarsest first */
    size_t value_count;
    bool is_quick; /* swept also when there is little time */
};

/* THE list; ends with a NULL name. The first is the automatic choice: epsilon. */
extern const struct accuracy_knob accuracy_knobs[];

/* path and reading must outlive it. Fails as io_scene_read, render_create and accuracy_interior_create do.
 */
DIPOLE_CHECKED bool accuracy_subject_init(const char *path, const struct io_scene_options *reading,
                                          struct accuracy_subject *subject, dipole_status *status);
void accuracy_subject_end(struct accuracy_subject *subject);

#endif
