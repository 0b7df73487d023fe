/* encode_surface.c: the surface of a deformed body as a binary glTF 2.0 file (Khronos Group, "glTF 2.0 Specification",
 * sections 3 and 4: the GLB container; ISO/IEC 12113:2022).
 *
 * The body is a mesh with three primitives on one set of vertices: triangles, the edges of the elements, and the nodes
 * of contact rows. The displacement is a morph target, so that any viewer shows the body deformed `weight` times. A
 * second mesh is the undeformed outline. What glTF has no words for stands in `extras` of the file, with numbers of
 * accessors: openapi.json says what each of them is. */
#include "codec/codec.h"
#include "codec/room.h"
#include "codec/text.h"

#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "glTF is little-endian");
_Static_assert(sizeof(unsigned) == 4 && sizeof(float) == 4, "numbers are written as they are in memory");

enum { FLOAT = 5126, UNSIGNED = 5125, ARRAYS = 21, NONE = -1 };
enum { POINTS = 0, LINES = 1, TRIANGLES = 4 };    /* modes of a primitive */
enum { VERTEX_DATA = 34962, INDEX_DATA = 34963 }; /* targets of a buffer view */
enum { HEAD = 12, CHUNK_HEAD = 8, JSON_CHUNK = 0x4E4F534A, BINARY_CHUNK = 0x004E4942, MAGIC = 0x46546C67 };

/* One array of the binary chunk: accessor and buffer view have its place in the list as number. */
typedef struct {
    const void *data;
    size_t count, components, offset; /* 4 bytes a component */
    int type, target;                 /* target 0: neither vertices nor indices */
    const float *low, *high;          /* of each component; NULL: not told */
} array;

typedef struct {
    const codec_surface *in;
    text json;
    array arrays[ARRAYS];
    int n_arrays;
    size_t bytes; /* of all arrays */
} surface_writer;

/* Returns the number of its accessor, NONE where there is nothing in it: glTF has no empty ones. */
static int add_array(surface_writer *w, int type, int target, const void *data, int64_t count, size_t components)
{
    if (!data || count < 1)
        return NONE;
    w->arrays[w->n_arrays] = (array){.data = data,
                                     .count = (size_t)count,
                                     .components = components,
                                     .offset = w->bytes,
                                     .type = type,
                                     .target = target};
    w->bytes += 4 * components * (size_t)count;
    return w->n_arrays++;
}

/* -------------------------------------------------------------------- JSON */

/* The arrays: an accessor and a view of the one buffer for each of them. */
static void put_arrays(surface_writer *w)
{
    text *t = &w->json;
    text_open(t, "accessors", '[');
    for (int i = 0; i < w->n_arrays; i++) {
        const array *a = &w->arrays[i];
        text_open(t, NULL, '{');
        text_integer(t, "bufferView", i);
        text_integer(t, "componentType", a->type);
        text_integer(t, "count", (int64_t)a->count);
        text_string(t, "type", a->components == 3 ? "VEC3" : "SCALAR");
        if (a->low) { /* of vectors */
            text_numbers(t, "min", (const double[]){a->low[0], a->low[1], a->low[2]}, 3);
            text_numbers(t, "max", (const double[]){a->high[0], a->high[1], a->high[2]}, 3);
        }
        text_close(t, '}');
    }
    text_close(t, ']');
    text_open(t, "bufferViews", '[');
    for (int i = 0; i < w->n_arrays; i++) {
        const array *a = &w->arrays[i];
        text_open(t, NULL, '{');
        text_integer(t, "buffer", 0);
        text_integer(t, "byteOffset", (int64_t)a->offset);
        text_integer(t, "byteLength", (int64_t)(4 * a->count * a->components));
        if (a->target)
            text_integer(t, "target", a->target);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_open(t, "buffers", '[');
    text_open(t, NULL, '{');
    text_integer(t, "byteLength", (int64_t)w->bytes);
    text_close(t, '}');
    text_close(t, ']');
}

static void put_accessor(text *t, const char *key, int accessor)
{
    if (accessor != NONE)
        text_integer(t, key, accessor);
}

/* What the primitives share. */
typedef struct {
    int position, displacement, node, von_mises;
} vertices;

static void put_primitive(text *t, int mode, int indices, const vertices *v, bool coloured, bool moves)
{
    if (indices == NONE)
        return;
    text_open(t, NULL, '{');
    text_open(t, "attributes", '{');
    text_integer(t, "POSITION", v->position);
    put_accessor(t, "_NODE", coloured ? v->node : NONE);
    put_accessor(t, "_VON_MISES", coloured ? v->von_mises : NONE);
    text_close(t, '}');
    text_integer(t, "indices", indices);
    text_integer(t, "mode", mode);
    if (moves) {
        text_open(t, "targets", '[');
        text_open(t, NULL, '{');
        text_integer(t, "POSITION", v->displacement);
        text_close(t, '}');
        text_close(t, ']');
    }
    text_close(t, '}');
}

static void put_meshes(surface_writer *w, const vertices *v, int row_vertex)
{
    const uz_surface *s = w->in->surface;
    text *t = &w->json;
    const int triangles = add_array(w, UNSIGNED, INDEX_DATA, s->triangle, 3 * s->n_triangles, 1);
    const int lines = add_array(w, UNSIGNED, INDEX_DATA, s->line, 2 * s->n_lines, 1);
    const int outline = add_array(w, UNSIGNED, INDEX_DATA, s->outline, 2 * s->n_outline, 1);
    const int n_meshes = outline == NONE ? 1 : 2;
    text_integer(t, "scene", 0);
    text_raw(t, "scenes", n_meshes == 2 ? "[{\"nodes\":[0,1]}]" : "[{\"nodes\":[0]}]");
    text_open(t, "nodes", '[');
    for (int mesh = 0; mesh < n_meshes; mesh++) {
        text_open(t, NULL, '{');
        text_string(t, "name", mesh == 0 ? "body" : "undeformed outline");
        text_integer(t, "mesh", mesh);
        text_numbers(t, "translation", s->origin, 3);
        text_numbers(t, "scale", (const double[]){s->unit, s->unit, s->unit}, 3);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_open(t, "meshes", '[');
    text_open(t, NULL, '{');
    text_open(t, "primitives", '[');
    put_primitive(t, TRIANGLES, triangles, v, true, true);
    put_primitive(t, LINES, lines, v, false, true);
    put_primitive(t, POINTS, row_vertex, v, false, true);
    text_close(t, ']');
    text_numbers(t, "weights", &s->factor, 1);
    text_close(t, '}');
    if (n_meshes == 2) {
        text_open(t, NULL, '{');
        text_open(t, "primitives", '[');
        put_primitive(t, LINES, outline, v, false, false);
        text_close(t, ']');
        text_close(t, '}');
    }
    text_close(t, ']');
}

/* ------------------------------------------------------------------ extras */

static void put_drawn(text *t, const char *key, const uz_drawn *drawn, int accessor)
{
    if (!drawn->x)
        return;
    text_open(t, key, '{');
    put_accessor(t, "accessor", accessor);
    text_number(t, "unit", drawn->unit);
    text_number(t, "low", drawn->low);
    text_number(t, "high", drawn->high);
    text_close(t, '}');
}

/* The triangles of a surface that are near the body, as corners one after another, as far as there is room. */
static void put_triangles(text *t, const uz_contact *c, const uz_surface *s)
{
    enum { MOST = 20000 };
    double low[3], high[3], size = 0;
    for (int i = 0; i < 3; i++) { /* of the body, in the scene's coordinates, and as far beyond */
        low[i] = s->origin[i] + s->unit * (double)s->low[i];
        high[i] = s->origin[i] + s->unit * (double)s->high[i];
        size = high[i] - low[i] > size ? high[i] - low[i] : size;
    }
    text_open(t, "surface", '{');
    text_integer(t, "triangles", c->n_x / 3);
    text_open(t, "corners", '[');
    for (int64_t i = 0, put = 0; i + 2 < c->n_x && put < MOST; i += 3) {
        const double *const x[3] = {c->x + i, c->y + i, c->z + i};
        bool away = false;
        for (int k = 0; k < 3; k++) {
            const double least = low[k] - size, most = high[k] + size;
            away = away || (x[k][0] < least && x[k][1] < least && x[k][2] < least) ||
                   (x[k][0] > most && x[k][1] > most && x[k][2] > most);
        }
        for (int k = 0; k < 3 && !away; k++)
            text_numbers(t, NULL, (const double[]){x[0][k], x[1][k], x[2][k]}, 3);
        put += !away;
    }
    text_close(t, ']');
}

/* An obstacle in the words of a request. */
static void put_obstacle(text *t, const uz_contact *c, const uz_surface *s)
{
    const int dim = s->dim;
    const bool cylinder = c->kind == UZ_OBSTACLE_CYLINDER;
    text_open(t, NULL, '{');
    text_string(t, "on", c->on);
    if (c->kind == UZ_OBSTACLE_BODY) {
        text_string(t, "with", c->with);
        text_close(t, '}');
        return;
    }
    text_open(t, "obstacle", '{');
    if (c->kind == UZ_OBSTACLE_PLANE) {
        text_open(t, "plane", '{');
        text_numbers(t, "point", c->point, dim);
        text_numbers(t, "normal", c->normal, dim);
    } else if (c->kind == UZ_OBSTACLE_POLYLINE) {
        text_open(t, "polyline", '{');
        text_open(t, "points", '[');
        for (int64_t i = 0; i < c->n_x; i++)
            text_numbers(t, NULL, (const double[]){c->x[i], c->y[i]}, 2);
        text_close(t, ']');
    } else if (c->kind == UZ_OBSTACLE_HEIGHT) {
        text_open(t, "height", '{');
        text_numbers(t, "x", c->x, c->n_x);
        if (c->n_y > 0) {
            text_numbers(t, "y", c->y, c->n_y);
            text_open(t, "z", '[');
            for (int64_t j = 0; j < c->n_y; j++)
                text_numbers(t, NULL, c->z + j * c->n_x, c->n_x);
            text_close(t, ']');
        } else {
            text_numbers(t, "z", c->z, c->n_x);
        }
    } else if (c->kind == UZ_OBSTACLE_SURFACE) {
        put_triangles(t, c, s);
    } else {
        text_open(t, cylinder ? "cylinder" : dim == 2 ? "circle" : "sphere", '{');
        text_numbers(t, cylinder ? "point" : "center", c->point, dim);
        if (cylinder)
            text_numbers(t, "axis", c->normal, dim);
        text_number(t, "radius", c->radius);
        text_bool(t, "inside", c->inside);
    }
    text_close(t, '}');
    text_close(t, '}');
    text_close(t, '}');
}

static void put_extras(surface_writer *w, const vertices *v, int row_vertex)
{
    const uz_surface *s = w->in->surface;
    const uz_scene *scene = w->in->scene;
    const int64_t n = s->n_rows;
    text *t = &w->json;
    text_open(t, "extras", '{');
    text_string(t, "job", w->in->job_id);
    text_string(t, "case", w->in->case_name);
    text_integer(t, "dim", s->dim);
    text_bool(t, "axisymmetric", scene->model == UZ_AXISYMMETRIC);
    text_integer(t, "nodes", s->n_nodes);
    text_integer(t, "elements", s->n_elements);
    text_numbers(t, "origin", s->origin, 3);
    text_number(t, "unit", s->unit);
    text_number(t, "factor", s->factor);
    text_number(t, "largest_displacement", s->largest);
    text_integer(t, "position", v->position);
    text_integer(t, "displacement", v->displacement);
    put_drawn(t, "von_mises", &s->von_mises, v->von_mises);
    put_drawn(t, "pressure", &s->touch, add_array(w, FLOAT, 0, s->touch.x, s->n_vertices, 1));
    text_open(t, "contact", '{');
    text_integer(t, "rows", n);
    put_accessor(t, "vertex", row_vertex);
    put_accessor(t, "contact", add_array(w, UNSIGNED, 0, s->row_contact, n, 1));
    put_accessor(t, "normal", add_array(w, FLOAT, 0, s->row_normal, n, 3));
    put_drawn(t, "reaction", &s->reaction, add_array(w, FLOAT, 0, s->reaction.x, n, 1));
    put_drawn(t, "gap", &s->gap, add_array(w, FLOAT, 0, s->gap.x, n, 1));
    put_drawn(t, "pressure", &s->pressure, add_array(w, FLOAT, 0, s->pressure.x, n, 1));
    put_drawn(t, "arc", &s->arc, add_array(w, FLOAT, 0, s->arc.x, n, 1));
    put_accessor(t, "part", add_array(w, UNSIGNED, 0, s->row_part, n, 1));
    text_close(t, '}');
    text_open(t, "contacts", '[');
    for (int64_t k = 0; k < scene->n_contacts; k++)
        put_obstacle(t, &scene->contacts[k], s);
    text_close(t, ']');
    text_close(t, '}');
}

char *codec_encode_surface(const codec_surface *surface, size_t *len)
{
    const uz_surface *s = surface->surface;
    surface_writer writer = {.in = surface}, *w = &writer;
    text *t = &w->json;
    char *file = NULL;
    *len = 0;
    vertices v;
    v.position = add_array(w, FLOAT, VERTEX_DATA, s->position, s->n_vertices, 3);
    v.displacement = add_array(w, FLOAT, VERTEX_DATA, s->displacement, s->n_vertices, 3);
    v.node = add_array(w, FLOAT, VERTEX_DATA, s->node, s->n_vertices, 1);
    v.von_mises = add_array(w, FLOAT, VERTEX_DATA, s->von_mises.x, s->n_vertices, 1);
    if (v.position == NONE || v.displacement == NONE)
        return NULL; /* glTF has no mesh without vertices */
    w->arrays[v.position].low = s->low;
    w->arrays[v.position].high = s->high;
    w->arrays[v.displacement].low = s->least;
    w->arrays[v.displacement].high = s->most;
    const int row_vertex = add_array(w, UNSIGNED, INDEX_DATA, s->row_vertex, s->n_rows, 1);
    text_open(t, NULL, '{');
    text_raw(t, "asset", "{\"version\":\"2.0\",\"generator\":\"uzawad\"}");
    put_meshes(w, &v, row_vertex);
    put_extras(w, &v, row_vertex);
    put_arrays(w);
    text_close(t, '}');
    while (t->len % 4 != 0 && !t->failed)
        text_put(t, " ");

    /* the container: a head, the JSON, the arrays */
    const size_t total = HEAD + CHUNK_HEAD + t->len + CHUNK_HEAD + w->bytes;
    if (!t->failed && total <= UINT32_MAX)
        file = room_for(total, 1);
    if (file) {
        const unsigned head[] = {MAGIC, 2, (unsigned)total, (unsigned)t->len, JSON_CHUNK};
        const unsigned behind[] = {(unsigned)w->bytes, BINARY_CHUNK};
        char *at = file + sizeof head + t->len;
        memcpy(file, head, sizeof head);
        memcpy(file + sizeof head, t->data, t->len);
        memcpy(at, behind, sizeof behind);
        for (int i = 0; i < w->n_arrays; i++)
            memcpy(at + sizeof behind + w->arrays[i].offset, w->arrays[i].data,
                   4 * w->arrays[i].count * w->arrays[i].components);
        *len = total;
    }
    free(t->data);
    return file;
}
