/* mesh_text.h: what tests of all formats of meshes ask of their readers. */
#ifndef MESH_TEXT_H
#define MESH_TEXT_H

#include "harness.h"
#include "io/mesh_reader.h"

typedef uz_status read_mesh(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);

/* A text that is refused: how, in which line, and words of the message. */
typedef struct {
    const char *text;
    uz_status status;
    int64_t line;
    const char *says;
} mesh_refusal;

static inline const uz_given_group *find_given(const uz_given_mesh *mesh, const char *name)
{
    for (int64_t i = 0; i < mesh->n_groups; i++)
        if (strcmp(mesh->groups[i].name, name) == 0)
            return &mesh->groups[i];
    CHECK_MSG(false, "no group %s", name);
    static const uz_given_group none;
    return &none;
}

/* In the format that its beginning says. */
static inline void read_text(uz_given_mesh *mesh, const char *text)
{
    const char *format = strstr(text, "$MeshFormat")    ? "gmsh"
                         : *text == '*'                 ? "abaqus"
                         : *text == '<' || *text == '#' ? "vtk"
                                                        : "nastran";
    uz_error err = {0};
    CHECK_MSG(uz_mesh_read(mesh, format, text, strlen(text), 0, &err) == UZ_OK, "line %lld: %s", (long long)err.line,
              err.message);
}

static inline void check_refusals(read_mesh *read, const mesh_refusal *refusals, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uz_given_mesh mesh;
        uz_error err = {0};
        const uz_status status = read(&mesh, refusals[i].text, strlen(refusals[i].text), 0, &err);
        CHECK_MSG(status == refusals[i].status && err.line == refusals[i].line, "refusal %zu: %s, line %lld: %s", i,
                  uz_status_name(status), (long long)err.line, err.message);
        CHECK_MSG(strstr(err.message, refusals[i].says) != NULL, "refusal %zu: \"%s\"", i, err.message);
        CHECK(!mesh.xyz && !mesh.groups);
        uz_given_mesh_clear(&mesh);
    }
}

/* Whatever is cut off, the rest is read or refused. */
static inline void check_beginnings(read_mesh *read, const char *name, const char *text, size_t all)
{
    for (size_t len = 0; len < all; len++) {
        uz_given_mesh given;
        uz_error err = {0};
        char *part = malloc(len + 1); /* of its own length: a sanitizer sees what is read beyond it */
        memcpy(part, text, len);
        const uz_status status = read(&given, part, len, 0, &err);
        CHECK_MSG(status == UZ_OK || ((status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED) && err.line > 0),
                  "%s, %zu bytes: %s", name, len, uz_status_name(status));
        free(part);
        uz_given_mesh_clear(&given);
    }
}

#endif
