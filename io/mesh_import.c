/*
 * The program that mesh.c runs to read a mesh file: file on standard input, plain arrays on standard output
 * (io_mesh_header, mesh_internal.h).
 *
 *     mesh-import EXTENSION BYTES SECONDS
 *
 * A program of its own rather than a fork of ours: the renderer has OpenGL and its threads in it, a fork of
 * which may do next to nothing safely; and its address space, and what a sanitizer adds to it, would count
 * against the memory limit. Here the limits hold before the first byte of the file is looked at, and the
 * worst that assimp can do is to end this process. It opens no other file: what a mesh refers to (material
 * libraries, textures, glTF buffers beside it) is refused, so a mesh cannot smuggle in a file of its
 * reader's.
 */
#include "io/mesh_build.h"
#include "io/mesh_complete.h"
#include "io/mesh_internal.h"

#include <assimp/cfileio.h>
#include <assimp/cimport.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

/* Under the address sanitizer, whose shadow alone is terabytes, the build says 0. */
#ifndef IO_MESH_IMPORT_LIMITS_MEMORY
#define IO_MESH_IMPORT_LIMITS_MEMORY 1
#endif

/* ---- limits -------------------------------------------------------------------------------------- */

static bool limit(int resource, rlim_t amount)
{
    const struct rlimit limits = { .rlim_cur = amount, .rlim_max = amount };
    return setrlimit((__rlimit_resource_t)resource, &limits) == 0;
}

static bool limit_resources(rlim_t bytes, rlim_t seconds)
{
    return (!IO_MESH_IMPORT_LIMITS_MEMORY || limit(RLIMIT_AS, bytes)) && limit(RLIMIT_CPU, seconds) &&
           limit(RLIMIT_CORE, 0) && limit(RLIMIT_FSIZE, 0) && limit(RLIMIT_NOFILE, 0);
}

/* ---- the file, as assimp sees it ----------------------------------------------------------------- */

struct input {
    char name[32];
    const unsigned char *data;
    size_t size;
};

/* assimp opens the file once to look at its beginning and again to read it. */
struct stream {
    struct aiFile file; /* first, so that a pointer to it is one to the stream */
    const struct input *input;
    size_t offset;
};

static size_t stream_read(struct aiFile *file, char *out, size_t size, size_t count)
{
    struct stream *stream = (struct stream *)file;
    const size_t left = stream->input->size - stream->offset;
    if (size == 0)
        return 0;
    const size_t items = count < left / size ? count : left / size;
    memcpy(out, stream->input->data + stream->offset, items * size);
    stream->offset += items * size;
    return items;
}

static size_t stream_write(struct aiFile *file, const char *data, size_t size, size_t count)
{
    (void)file, (void)data, (void)size, (void)count;
    return 0;
}

static size_t stream_tell(struct aiFile *file)
{
    return ((const struct stream *)file)->offset;
}

static size_t stream_size(struct aiFile *file)
{
    return ((const struct stream *)file)->input->size;
}

static enum aiReturn stream_seek(struct aiFile *file, size_t offset, enum aiOrigin origin)
{
    struct stream *stream = (struct stream *)file;
    const size_t base = origin == aiOrigin_CUR   ? stream->offset
                        : origin == aiOrigin_END ? stream->input->size
                                                 : 0;
    const size_t target = base + offset; /* backwards by wrapping round */
    if (target > stream->input->size)
        return aiReturn_FAILURE;
    stream->offset = target;
    return aiReturn_SUCCESS;
}

static void stream_flush(struct aiFile *file)
{
    (void)file;
}

static struct aiFile *stream_open(struct aiFileIO *io, const char *name, const char *mode)
{
    const struct input *input = (const struct input *)(void *)io->UserData;
    (void)mode;
    struct stream *stream = strcmp(name, input->name) == 0 ? malloc(sizeof *stream) : NULL;
    if (!stream)
        return NULL;
    *stream = (struct stream){
        .file = { .ReadProc = stream_read,
                  .WriteProc = stream_write,
                  .TellProc = stream_tell,
                  .FileSizeProc = stream_size,
                  .SeekProc = stream_seek,
                  .FlushProc = stream_flush },
        .input = input,
    };
    return &stream->file;
}

static void stream_close(struct aiFileIO *io, struct aiFile *file)
{
    (void)io;
    free(file);
}

static bool map_input(struct input *input)
{
    struct stat info;
    if (fstat(STDIN_FILENO, &info) != 0 || info.st_size <= 0)
        return false;
    input->size = (size_t)info.st_size;
    const void *data = mmap(NULL, input->size, PROT_READ, MAP_PRIVATE, STDIN_FILENO, 0);
    input->data = data;
    return data != MAP_FAILED;
}

/* ---- what is handed back ------------------------------------------------------------------------- */

static _Noreturn void finish(void)
{
    fflush(stdout);
    _exit(ferror(stdout) ? EXIT_FAILURE : EXIT_SUCCESS); /* no time is spent on taking the scene apart */
}

static void write_header(struct io_mesh_header *header)
{
    memcpy(header->magic, IO_MESH_MAGIC, sizeof header->magic);
    fwrite(header, sizeof *header, 1, stdout);
}

static _Noreturn void fail(const char *what, const char *detail)
{
    struct io_mesh_header header = { 0 };
    snprintf(header.message, sizeof header.message, "%s%s%s", what, detail[0] ? ": " : "", detail);
    write_header(&header);
    finish();
}

static _Noreturn void fail_by_assimp(void)
{
    const char *text = aiGetErrorString();
    if (strstr(text, "bad_alloc"))
        fail("needs too much memory to be read", "");
    if (strstr(text, "No suitable reader"))
        fail("is no mesh of a known format, expected OBJ, PLY, STL, 3DS, glTF or another that assimp reads",
             "");
    fail("cannot be read as a mesh", text);
}

/* ---- from assimp's scene to a mesh --------------------------------------------------------------- */

static bool is_triangle(const struct aiFace *face)
{
    return face->mNumIndices == 3; /* points and lines stay behind */
}

static void count(const struct aiScene *scene, struct io_mesh_soup *soup)
{
    for (unsigned m = 0; m < scene->mNumMeshes; m++) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        soup->vertex_count += mesh->mNumVertices;
        for (unsigned i = 0; i < mesh->mNumFaces; i++)
            soup->triangle_count += is_triangle(&mesh->mFaces[i]);
    }
}

static void copy_vertices(const struct aiMesh *mesh, struct io_mesh_vertex *out)
{
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const struct aiVector3D *p = &mesh->mVertices[i], *n = mesh->mNormals ? &mesh->mNormals[i] : NULL;
        out[i] = (struct io_mesh_vertex){ .position = { p->x, p->y, p->z } };
        if (n)
            memcpy(out[i].normal, (const float[3]){ n->x, n->y, n->z }, sizeof out[i].normal);
    }
}

static uint32_t *copy_triangles(const struct aiMesh *mesh, size_t first_vertex, uint32_t *out)
{
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *face = &mesh->mFaces[i];
        for (unsigned k = 0; is_triangle(face) && k < 3; k++) {
            if (face->mIndices[k] >= mesh->mNumVertices)
                fail("is damaged: a face refers to a vertex that does not exist", "");
            *out++ = (uint32_t)(first_vertex + face->mIndices[k]);
        }
    }
    return out;
}

static void take_soup(const struct aiScene *scene, struct io_mesh_soup *soup)
{
    count(scene, soup);
    if (soup->vertex_count > UINT32_MAX)
        fail("has more vertices than can be counted", "");
    soup->vertices = malloc(soup->vertex_count * sizeof *soup->vertices + 1);
    soup->triangles = malloc(soup->triangle_count * 3 * sizeof *soup->triangles + 1);
    if (!soup->vertices || !soup->triangles)
        fail("needs too much memory to be read", "");
    size_t first_vertex = 0;
    uint32_t *triangles = soup->triangles;
    for (unsigned m = 0; m < scene->mNumMeshes; m++) {
        copy_vertices(scene->mMeshes[m], soup->vertices + first_vertex);
        triangles = copy_triangles(scene->mMeshes[m], first_vertex, triangles);
        first_vertex += scene->mMeshes[m]->mNumVertices;
    }
}

static _Noreturn void write_mesh(const struct io_mesh_soup *soup)
{
    struct io_mesh_header header = { .vertex_count = soup->vertex_count,
                                     .triangle_count = soup->triangle_count };
    write_header(&header);
    for (size_t i = 0; i < soup->vertex_count; i++)
        fwrite(soup->vertices[i].position, sizeof soup->vertices[i].position, 1, stdout);
    for (size_t i = 0; i < soup->vertex_count; i++)
        fwrite(soup->vertices[i].normal, sizeof soup->vertices[i].normal, 1, stdout);
    fwrite(soup->triangles, 3 * sizeof *soup->triangles, soup->triangle_count, stdout);
    finish();
}

static bool has_triangles(const struct aiScene *scene)
{
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        if (scene->mMeshes[i]->mPrimitiveTypes & aiPrimitiveType_TRIANGLE)
            return true;
    return false;
}

int main(int argc, char **argv)
{
    if (argc != 4 || !limit_resources(strtoull(argv[2], NULL, 10), strtoull(argv[3], NULL, 10)))
        return EXIT_FAILURE;
    struct input input;
    snprintf(input.name, sizeof input.name, "mesh.%.15s", argv[1]);
    if (!map_input(&input))
        fail("cannot be read", "");
    if (!io_mesh_is_complete(input.data, input.size, argv[1]))
        fail("is cut short: it ends before the data that it announces", "");

    struct aiFileIO io = { .OpenProc = stream_open, .CloseProc = stream_close, .UserData = (char *)&input };
    const struct aiScene *scene = aiImportFileEx(input.name, aiProcess_Triangulate, &io);
    if (!scene)
        fail_by_assimp();
    /* Flattening a scene without triangles is an error to assimp; to us it is an answer. */
    if (has_triangles(scene) && !(scene = aiApplyPostProcessing(scene, aiProcess_PreTransformVertices)))
        fail_by_assimp();
    struct io_mesh_soup soup = { 0 };
    take_soup(scene, &soup);
    aiReleaseImport(scene);
    switch (io_mesh_build(&soup)) {
    case IO_MESH_BUILT:
        write_mesh(&soup);
    case IO_MESH_NO_TRIANGLES:
        fail("has no triangles, expected at least one", "");
    case IO_MESH_NOT_FINITE:
        fail("has a position that is not finite", "");
    case IO_MESH_ALL_DEGENERATE:
        fail("has no triangle with an area, expected at least one", "");
    case IO_MESH_NO_MEMORY:
        fail("needs too much memory to be read", "");
    }
    return EXIT_FAILURE;
}
