/* What became of each pixel of a picture that is fitted to. */
#ifndef FIT_USE_H
#define FIT_USE_H

enum fit_use {
    FIT_USE_OK = 0,      /* may be fitted to                                             */
    FIT_USE_NOT_COVERED, /* not wholly covered by one surface: background, silhouettes   */
    FIT_USE_MASKED,      /* by the mask that was given                                   */
    FIT_USE_NOT_FINITE,
    FIT_USE_CLIPPED,
    FIT_USE_DARK,        /* too dark to hold a value                                     */
    FIT_USE_SPECULAR,    /* mostly light mirrored at the surface                         */
    FIT_USE_SHADOW_EDGE, /* direct light changes within the pixel                        */
    FIT_USE_OUTLIER,     /* so far from the model that it was given no weight            */
    FIT_USE_COUNT
};

/* "used", "not covered", "masked", ... for people. */
extern const char *const fit_use_names[FIT_USE_COUNT];

#endif
