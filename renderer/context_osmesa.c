#include "renderer/context.h"

#include <GL/osmesa.h>
#include <stdlib.h>

/* OSMesa wants a picture to draw into; everything is drawn into textures instead. */
enum { SIDE_PX = 16 };

struct osmesa_context {
    struct render_context base;
    OSMesaContext handle;
    unsigned char picture[4 * SIDE_PX * SIDE_PX];
};

static bool make_current(struct render_context *context, dipole_status *status)
{
    struct osmesa_context *const osmesa = (struct osmesa_context *)context;
    if (OSMesaMakeCurrent(osmesa->handle, osmesa->picture, GL_UNSIGNED_BYTE, SIDE_PX, SIDE_PX))
        return true;
    return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL, "OSMesaMakeCurrent refused");
}

static void destroy(struct render_context *context)
{
    struct osmesa_context *const osmesa = (struct osmesa_context *)context;
    if (osmesa->handle)
        OSMesaDestroyContext(osmesa->handle);
    free(osmesa);
}

bool render_context_create_osmesa(struct render_context **context_out, dipole_status *status)
{
    static const int attributes[] = { OSMESA_FORMAT,
                                      OSMESA_RGBA,
                                      OSMESA_PROFILE,
                                      OSMESA_CORE_PROFILE,
                                      OSMESA_CONTEXT_MAJOR_VERSION,
                                      4,
                                      OSMESA_CONTEXT_MINOR_VERSION,
                                      5,
                                      0 };
    struct osmesa_context *const osmesa = calloc(1, sizeof *osmesa);
    *context_out = NULL;
    if (!osmesa)
        return dipole_fail(status, DIPOLE_OUT_OF_MEMORY, NULL, "no memory");
    osmesa->base = (struct render_context){ .name = "osmesa",
                                            .load = (GLADloadfunc)OSMesaGetProcAddress,
                                            .make_current = make_current,
                                            .destroy = destroy };
    osmesa->handle = OSMesaCreateContextAttribs(attributes, NULL);
    if (!osmesa->handle) {
        destroy(&osmesa->base);
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, NULL,
                           "OSMesaCreateContextAttribs gave no 4.5 core context");
    }
    *context_out = &osmesa->base;
    return true;
}
