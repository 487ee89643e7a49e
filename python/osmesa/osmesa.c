/* Stands for Mesa's OSMesa in a wheel, which the system has or has not: cameras and films look for it when they draw. */
#include <GL/osmesa.h>
#include <dlfcn.h>
#include <stddef.h>

static void *find(const char *name) {
    /* In the scope of all, where MuJoCo looks for OpenGL. */
    static void *mesa;
    if (!mesa) mesa = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_GLOBAL);
    return mesa ? dlsym(mesa, name) : NULL;
}

OSMesaContext OSMesaCreateContextExt(GLenum format, GLint depth, GLint stencil, GLint accumulation,
                                     OSMesaContext shared) {
    OSMesaContext (*create)(GLenum, GLint, GLint, GLint, OSMesaContext);
    *(void **)&create = find("OSMesaCreateContextExt");
    return create ? create(format, depth, stencil, accumulation, shared) : NULL;
}

void OSMesaDestroyContext(OSMesaContext context) {
    void (*destroy)(OSMesaContext);
    *(void **)&destroy = find("OSMesaDestroyContext");
    if (destroy) destroy(context);
}

GLboolean OSMesaMakeCurrent(OSMesaContext context, void *buffer, GLenum type, GLsizei width, GLsizei height) {
    GLboolean (*make)(OSMesaContext, void *, GLenum, GLsizei, GLsizei);
    *(void **)&make = find("OSMesaMakeCurrent");
    return make ? make(context, buffer, type, width, height) : GL_FALSE;
}
