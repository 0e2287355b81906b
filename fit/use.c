#include "fit/use.h"

const char *const fit_use_names[FIT_USE_COUNT] = {
    [FIT_USE_OK] = "used",           [FIT_USE_NOT_COVERED] = "not covered",
    [FIT_USE_MASKED] = "masked",     [FIT_USE_NOT_FINITE] = "not finite",
    [FIT_USE_CLIPPED] = "clipped",   [FIT_USE_DARK] = "too dark",
    [FIT_USE_SPECULAR] = "specular", [FIT_USE_SHADOW_EDGE] = "shadow edge",
    [FIT_USE_OUTLIER] = "outlier",
};
