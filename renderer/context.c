#include "renderer/context.h"

#include <stdio.h>

struct backend {
    enum render_context_kind kind;
    const char *name;
    bool (*create)(struct render_context **context_out, dipole_status *status);
    bool is_default; /* tried when none is asked for */
};

static const struct backend backends[] = {
    { RENDER_CONTEXT_OSMESA, "osmesa", render_context_create_osmesa, true },
    { RENDER_CONTEXT_EGL, "egl", render_context_create_egl, true },
    { RENDER_CONTEXT_WINDOW, "window", render_context_create_window, false },
};

bool render_context_create(enum render_context_kind kind, struct render_context **context_out,
                           dipole_status *status)
{
    char reasons[256] = "";
    size_t used = 0;
    *context_out = NULL;
    for (size_t i = 0; i < sizeof backends / sizeof *backends; i++) {
        const struct backend *const backend = &backends[i];
        if (kind == RENDER_CONTEXT_DEFAULT ? !backend->is_default : backend->kind != kind)
            continue;
        dipole_status failure = { .code = DIPOLE_OK };
        if (backend->create(context_out, &failure))
            return true;
        const int written = snprintf(reasons + used, sizeof reasons - used, "%s%s: %s", used ? "; " : "",
                                     backend->name, failure.message);
        used += written > 0 && (size_t)written < sizeof reasons - used ? (size_t)written : 0;
    }
    return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "no OpenGL 4.5 context could be had: %s",
                       reasons);
}

void render_context_destroy(struct render_context *context)
{
    if (context)
        context->destroy(context);
}
