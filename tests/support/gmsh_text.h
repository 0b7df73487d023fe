/* gmsh_text.h: small Gmsh files in every version and form, for the tests of the reader. */
#ifndef TESTS_GMSH_TEXT_H
#define TESTS_GMSH_TEXT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { GMSH_TEXT_ROOM = 16384 };

/* A file that is being written. */
typedef struct {
    char text[GMSH_TEXT_ROOM];
    size_t len;
    int version; /* 22, 40 or 41 */
    bool binary;
} gmsh_writer;

static inline void put_bytes(gmsh_writer *w, const void *bytes, size_t len)
{
    memcpy(w->text + w->len, bytes, len);
    w->len += len;
}

static inline void put_text(gmsh_writer *w, const char *text)
{
    put_bytes(w, text, strlen(text));
}

/* Numbers as the version and form have them: 4 bytes, 8 bytes, or words. */
static inline void put_int(gmsh_writer *w, int32_t value)
{
    char word[32];
    snprintf(word, sizeof word, "%d ", value);
    if (w->binary)
        put_bytes(w, &value, sizeof value);
    else
        put_text(w, word);
}

static inline void put_size(gmsh_writer *w, int64_t value)
{
    char word[32];
    snprintf(word, sizeof word, "%lld ", (long long)value);
    if (w->binary)
        put_bytes(w, &value, sizeof value);
    else
        put_text(w, word);
}

static inline void put_real(gmsh_writer *w, double value)
{
    char word[40];
    snprintf(word, sizeof word, "%.17g ", value);
    if (w->binary)
        put_bytes(w, &value, sizeof value);
    else
        put_text(w, word);
}

/* A mesh as Gmsh has it: nodes with tags, elements with one physical group each (0: none; in version 4.1 one entity
 * for each group). */
typedef struct {
    int n_nodes;
    const int *tag;
    const double (*xyz)[3];
    int n_elements;
    const struct gmsh_item {
        int type, dim, physical, count, node[10];
    } * element;
    const char *names; /* what stands in $PhysicalNames */
} gmsh_source;

static inline void write_header(gmsh_writer *w)
{
    const int32_t one = 1;
    char line[64];
    snprintf(line, sizeof line, "$MeshFormat\n%s %d 8\n",
             w->version == 22   ? "2.2"
             : w->version == 40 ? "4.0"
                                : "4.1",
             w->binary);
    put_text(w, line);
    if (w->binary) {
        put_bytes(w, &one, sizeof one);
        put_text(w, "\n");
    }
    put_text(w, "$EndMeshFormat\n");
}

static inline void write_2(gmsh_writer *w, const gmsh_source *m)
{
    char count[64];
    snprintf(count, sizeof count, "$Nodes\n%d\n", m->n_nodes);
    put_text(w, count);
    for (int i = 0; i < m->n_nodes; i++) {
        put_int(w, m->tag[i]);
        for (int c = 0; c < 3; c++)
            put_real(w, m->xyz[i][c]);
        put_text(w, w->binary ? "" : "\n");
    }
    snprintf(count, sizeof count, "\n$EndNodes\n$Elements\n%d\n", m->n_elements);
    put_text(w, count);
    for (int e = 0; e < m->n_elements; e++) {
        const struct gmsh_item *item = &m->element[e];
        put_int(w, w->binary ? item->type : e + 1);
        put_int(w, w->binary ? 1 : item->type);
        put_int(w, 2);
        if (w->binary)
            put_int(w, e + 1);
        put_int(w, item->physical);
        put_int(w, 1);
        for (int i = 0; i < item->count; i++)
            put_int(w, item->node[i]);
        put_text(w, w->binary ? "" : "\n");
    }
    put_text(w, "\n$EndElements\n");
}

/* One entity for each element: its number is that of the element. */
static inline void write_entities(gmsh_writer *w, const gmsh_source *m)
{
    put_text(w, "$Entities\n");
    for (int dim = 0; dim < 4; dim++) {
        int count = 0;
        for (int e = 0; e < m->n_elements; e++)
            count += m->element[e].dim == dim;
        put_size(w, count);
    }
    for (int dim = 0; dim < 4; dim++)
        for (int e = 0; e < m->n_elements; e++) {
            if (m->element[e].dim != dim)
                continue;
            put_int(w, e + 1);
            for (int k = 0; k < (dim || w->version == 40 ? 6 : 3); k++)
                put_real(w, k);
            put_size(w, m->element[e].physical != 0);
            if (m->element[e].physical)
                put_int(w, m->element[e].physical);
            if (dim > 0) {
                put_size(w, 2);
                put_int(w, 1);
                put_int(w, -2);
            }
            put_text(w, w->binary ? "" : "\n");
        }
    put_text(w, "\n$EndEntities\n");
}

/* Nodes in two blocks, the second one with parameters. */
static inline void write_4(gmsh_writer *w, const gmsh_source *m)
{
    const int first = m->n_nodes / 2;
    write_entities(w, m);
    put_text(w, "$Nodes\n");
    put_size(w, 2);
    put_size(w, m->n_nodes);
    put_size(w, 1);
    put_size(w, 1000);
    for (int b = 0; b < 2; b++) {
        const int from = b ? first : 0, to = b ? m->n_nodes : first;
        put_int(w, 2);
        put_int(w, 1);
        put_int(w, b);
        put_size(w, to - from);
        for (int i = from; i < to; i++)
            put_size(w, m->tag[i]);
        for (int i = from; i < to; i++)
            for (int c = 0; c < (b ? 5 : 3); c++)
                put_real(w, c < 3 ? m->xyz[i][c] : 0.5);
    }
    put_text(w, "\n$EndNodes\n$Elements\n");
    put_size(w, m->n_elements);
    put_size(w, m->n_elements);
    put_size(w, 1);
    put_size(w, m->n_elements);
    for (int e = 0; e < m->n_elements; e++) {
        const struct gmsh_item *item = &m->element[e];
        put_int(w, item->dim);
        put_int(w, e + 1);
        put_int(w, item->type);
        put_size(w, 1);
        put_size(w, 100 + e);
        for (int i = 0; i < item->count; i++)
            put_size(w, item->node[i]);
        put_text(w, w->binary ? "" : "\n");
    }
    put_text(w, "\n$EndElements\n");
}

/* Version 4.0: numbers of nodes and elements have 4 bytes, heads are the other way round. */
static inline void write_40(gmsh_writer *w, const gmsh_source *m)
{
    write_entities(w, m);
    put_text(w, "$Nodes\n");
    put_size(w, 1);
    put_size(w, m->n_nodes);
    put_int(w, 1);
    put_int(w, 2);
    put_int(w, 0);
    put_size(w, m->n_nodes);
    for (int i = 0; i < m->n_nodes; i++) {
        put_int(w, m->tag[i]);
        for (int c = 0; c < 3; c++)
            put_real(w, m->xyz[i][c]);
        put_text(w, w->binary ? "" : "\n");
    }
    put_text(w, "\n$EndNodes\n$Elements\n");
    put_size(w, m->n_elements);
    put_size(w, m->n_elements);
    for (int e = 0; e < m->n_elements; e++) {
        const struct gmsh_item *item = &m->element[e];
        put_int(w, e + 1);
        put_int(w, item->dim);
        put_int(w, item->type);
        put_size(w, 1);
        put_int(w, 100 + e);
        for (int i = 0; i < item->count; i++)
            put_int(w, item->node[i]);
        put_text(w, w->binary ? "" : "\n");
    }
    put_text(w, "\n$EndElements\n");
}

static inline void write_gmsh(gmsh_writer *w, const gmsh_source *m, int version, bool binary)
{
    w->len = 0;
    w->version = version;
    w->binary = binary;
    write_header(w);
    put_text(w, "$Comments\nanything $Nodes\n$EndComments\n");
    if (m->names) {
        put_text(w, "$PhysicalNames\n");
        put_text(w, m->names);
        put_text(w, "$EndPhysicalNames\n");
    }
    if (version == 22)
        write_2(w, m);
    else if (version == 40)
        write_40(w, m);
    else
        write_4(w, m);
    put_text(w, "$Periodic\n0\n$EndPeriodic\n");
}

/* A quadratic tetrahedron with a face, an edge and a corner that are named, and a point beside it. Tags have gaps and
 * do not ascend. */
static const int TET_TAGS[11] = {70, 3, 9, 12, 15, 18, 21, 24, 27, 30, 500};
static const double TET_XYZ[11][3] = {{0, 0, 0},     {1, 0, 0},     {0, 1, 0},   {0, 0, 1},
                                      {0.5, 0, 0},   {0.5, 0.5, 0}, {0, 0.5, 0}, {0, 0, 0.5},
                                      {0.5, 0, 0.5}, {0, 0.5, 0.5}, {7, 7, 7}};
static const struct gmsh_item TET_ITEMS[5] = {
    {15, 0, 5, 1, {500}},
    {15, 0, 7, 1, {70}},
    {8, 1, 7, 3, {70, 3, 15}},
    {9, 2, 8, 6, {70, 9, 3, 21, 18, 15}},
    {11, 3, 7, 10, {70, 3, 9, 12, 15, 18, 21, 24, 30, 27}}, /* Gmsh's order of the last two */
};
static const gmsh_source TET_SOURCE = {
    11, TET_TAGS, TET_XYZ, 5, TET_ITEMS, "3\n2 8 \"the floor\"\n1 99 \"unused\"\n0 5 \"c\xc3\xb6ntrol\"\n"};

#endif
