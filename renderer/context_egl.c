/* EGL on Mesa's surfaceless platform: no window system, no default framebuffer. */
#include "renderer/context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <stdlib.h>

struct egl_context {
    struct render_context base;
    EGLDisplay display;
    EGLContext handle;
};

static bool fail(dipole_status *status, const char *what)
{
    return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "%s failed with EGL error 0x%04x", what,
                       (unsigned)eglGetError());
}

static bool make_current(struct render_context *context, dipole_status *status)
{
    struct egl_context *const egl = (struct egl_context *)context;
    return eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->handle) ||
           fail(status, "eglMakeCurrent");
}

static void destroy(struct render_context *context)
{
    struct egl_context *const egl = (struct egl_context *)context;
    if (egl->display != EGL_NO_DISPLAY) {
        eglMakeCurrent(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        if (egl->handle != EGL_NO_CONTEXT)
            eglDestroyContext(egl->display, egl->handle);
        eglTerminate(egl->display);
    }
    free(egl);
}

static bool open_display(struct egl_context *egl, dipole_status *status)
{
    static const EGLint attributes[] = { EGL_CONTEXT_MAJOR_VERSION,
                                         4,
                                         EGL_CONTEXT_MINOR_VERSION,
                                         5,
                                         EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                         EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                         EGL_NONE };
    egl->display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (egl->display == EGL_NO_DISPLAY)
        return fail(status, "eglGetPlatformDisplay (surfaceless)");
    if (!eglInitialize(egl->display, NULL, NULL))
        return fail(status, "eglInitialize");
    if (!eglBindAPI(EGL_OPENGL_API))
        return fail(status, "eglBindAPI (OpenGL)");
    egl->handle = eglCreateContext(egl->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    return egl->handle != EGL_NO_CONTEXT || fail(status, "eglCreateContext (4.5 core)");
}

bool render_context_create_egl(struct render_context **context_out, dipole_status *status)
{
    struct egl_context *const egl = calloc(1, sizeof *egl);
    *context_out = NULL;
    if (!egl)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory");
    egl->base = (struct render_context){ .name = "egl",
                                         .load = (GLADloadfunc)eglGetProcAddress,
                                         .make_current = make_current,
                                         .destroy = destroy };
    if (!open_display(egl, status)) {
        destroy(&egl->base);
        return false;
    }
    *context_out = &egl->base;
    return true;
}
