/* patches.c: nodal stress and strain of linear elements.
 *
 * Within a linear element only the strain in its middle is second order accurate: what its shape functions say beyond
 * that point has the wrong slope in general, and at a boundary no neighbour on the other side makes up for it. So a
 * polynomial of degree 1 is fitted to the middles of the elements around the node by least squares and read at the node
 * (Zienkiewicz and Zhu, "The superconvergent patch recovery", Int. J. Numer. Meth. Engng 33 (1992) 1331-1364). Where
 * the node lies at the rim of its elements' middles, the next ring of elements joins in. Materials are fitted by
 * themselves, and averaged by volume where they meet. */
#include "post/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <math.h>
#include <string.h>

enum { DIM = 3, BETWEEN_QUESTIONS = 1024, MOST_VALUES = 2 * UZ_FIELD_COMPONENTS, MOST_MATERIALS = 8 };

/* An element's middle. */
typedef struct {
    double x[DIM], volume, value[MOST_VALUES]; /* stress, strain */
} sample;

typedef struct {
    const uz_field_body *body;
    int dim, values;
    sample *of;              /* n_elements */
    unsigned char *plain;    /* n_elements: linear, with a slope that is not its own */
    int64_t *first, *around; /* elements around each node */
    int64_t *seen;           /* n_elements: 1 + the last patch that it was in */
    int64_t patches;
    int64_t *patch; /* elements of the patch at hand; room for them */
    int64_t count, room;
} patches;

static int32_t material_of(const patches *p, int64_t e)
{
    return p->body->model->material_of ? p->body->model->material_of[e] : 0;
}

/* Adds the plain elements of the material around a node. False: no memory. */
static bool add_ring(patches *p, int64_t node, int32_t material)
{
    for (int64_t i = p->first[node]; i < p->first[node + 1]; i++) {
        const int64_t e = p->around[i];
        if (p->seen[e] == p->patches || material_of(p, e) != material || !p->plain[e])
            continue;
        if (!uz_grow(&p->patch, p->count, 1, &p->room, sizeof *p->patch))
            return false;
        p->seen[e] = p->patches;
        p->patch[p->count++] = e;
    }
    return true;
}

/* Volume of the patch and the mean of its values; returns how far the node is from the middle of the patch, in parts of
 * its radius. */
static double average(double value[MOST_VALUES], double *volume, const patches *p, const double *x)
{
    double centre[DIM] = {0}, offset = 0, radius = 0;
    *volume = 0;
    memset(value, 0, MOST_VALUES * sizeof *value);
    for (int64_t i = 0; i < p->count; i++) {
        const sample *s = &p->of[p->patch[i]];
        double distance = 0;
        *volume += s->volume;
        for (int v = 0; v < p->values; v++)
            value[v] += s->volume * s->value[v];
        for (int c = 0; c < p->dim; c++) {
            centre[c] += s->volume * (s->x[c] - x[c]);
            distance += (s->x[c] - x[c]) * (s->x[c] - x[c]);
        }
        radius = fmax(radius, distance);
    }
    for (int v = 0; v < p->values; v++)
        value[v] /= *volume;
    for (int c = 0; c < p->dim; c++)
        offset += centre[c] / *volume * (centre[c] / *volume);
    return sqrt(offset / radius);
}

/* The linear polynomial through the samples, at the node. False: they do not determine a slope. */
static bool fit(double at_node[MOST_VALUES], const patches *p, const double *x)
{
    double G[DIM + 1][DIM + 1] = {{0}}, b[DIM + 1][MOST_VALUES] = {{0}}, scale[DIM] = {0};
    for (int64_t i = 0; i < p->count; i++)
        for (int c = 0; c < p->dim; c++)
            scale[c] = fmax(scale[c], fabs(p->of[p->patch[i]].x[c] - x[c]));
    for (int64_t i = 0; i < p->count; i++) {
        const sample *s = &p->of[p->patch[i]];
        double basis[DIM + 1] = {1};
        for (int c = 0; c < p->dim; c++)
            basis[c + 1] = scale[c] > 0 ? (s->x[c] - x[c]) / scale[c] : 0;
        for (int r = 0; r <= p->dim; r++) {
            for (int c = 0; c <= p->dim; c++)
                G[r][c] += basis[r] * basis[c];
            for (int v = 0; v < p->values; v++)
                b[r][v] += basis[r] * s->value[v];
        }
    }
    /* G a = b for a[0] of each right-hand side, from the last row, so that the first unknown needs no substitution. */
    const double least = 1e-3 * G[0][0];
    for (int j = p->dim; j >= 0; j--) {
        if (!(G[j][j] > least) && j > 0)
            return false;
        for (int i = 0; i < j; i++) {
            const double factor = G[i][j] / G[j][j];
            for (int k = 0; k <= j; k++)
                G[i][k] -= factor * G[j][k];
            for (int v = 0; v < p->values; v++)
                b[i][v] -= factor * b[j][v];
        }
    }
    if (!(G[0][0] > 1e-3 * least))
        return false;
    for (int v = 0; v < p->values; v++)
        at_node[v] = b[0][v] / G[0][0];
    return true;
}

enum { IN_THE_MIDDLE, FITTED, UNKNOWN, NO_MEMORY };

/* The node's value in one material. */
static int recover_material(double value[MOST_VALUES], double *volume, patches *p, int64_t node, int32_t material)
{
    const double CENTRED = 0.02, RIM = 0.3;
    const double *x = p->body->model->mesh.xyz + node * p->dim;
    double unused, mean[MOST_VALUES];
    p->patches++;
    p->count = 0;
    if (!add_ring(p, node, material))
        return NO_MEMORY;
    const double offset = average(mean, volume, p, x);
    memcpy(value, mean, sizeof mean);
    if (offset <= CENTRED)
        return IN_THE_MIDDLE;
    if (offset <= RIM && fit(value, p, x))
        return FITTED;
    for (int64_t i = 0, inner = p->count; i < inner; i++) { /* the next ring */
        int nodes;
        const int64_t *next = uz_mesh_element(&p->body->model->mesh, p->patch[i], &nodes);
        for (int a = 0; a < nodes; a++)
            if (!add_ring(p, next[a], material))
                return NO_MEMORY;
    }
    average(mean, &unused, p, x);
    return fit(value, p, x) ? FITTED : UNKNOWN;
}

/* *done false: no slope can be told, and nothing is written. False: no memory. */
static bool recover_node(double *stress, double *strain, unsigned char *done, patches *p, int64_t node)
{
    const int components = p->values / 2;
    double sum[MOST_VALUES] = {0}, total = 0, value[MOST_VALUES], volume;
    int32_t list[MOST_MATERIALS]; /* the materials around the node: none where some element is not plain */
    int count = 0;
    bool plain = true;
    for (int64_t i = p->first[node]; plain && i < p->first[node + 1]; i++) {
        const int32_t material = material_of(p, p->around[i]);
        int k = 0;
        while (k < count && list[k] != material)
            k++;
        plain = p->plain[p->around[i]] && k < MOST_MATERIALS; /* nor where there are too many */
        if (plain && k == count)
            list[count++] = material;
    }
    count = plain ? count : 0;
    for (int k = 0; k < count; k++) {
        const int how = recover_material(value, &volume, p, node, list[k]);
        if (how == NO_MEMORY || how == UNKNOWN)
            return how == UNKNOWN;
        total += volume;
        for (int v = 0; v < p->values; v++)
            sum[v] += volume * value[v];
    }
    for (int c = 0; c < components && count > 0; c++) {
        if (stress)
            stress[node * components + c] = sum[c] / total;
        if (strain)
            strain[node * components + c] = sum[components + c] / total;
    }
    *done = count > 0;
    return true;
}

#define STRESS "the stress at nodes"

static uz_status take_samples(patches *p, uz_field_points *middle, const double *u, const uz_hooks *hooks,
                              uz_error *err)
{
    const uz_mesh *mesh = &p->body->model->mesh;
    const size_t bytes = (size_t)p->body->components * sizeof(double);
    bool known[UZ_ELEMENT_KINDS] = {false};
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        if (e % BETWEEN_QUESTIONS == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while stresses were computed");
        if (!p->plain[e])
            continue;
        if (!known[kind]) {
            middle[kind].count = 1;
            memcpy(middle[kind].point[0], uz_element_type_of(kind)->centre, sizeof middle[kind].point[0]);
            uz_field_points_init(&middle[kind], p->body, u);
            known[kind] = true;
        }
        sample *to = &p->of[e];
        uz_field_state state;
        int nodes;
        const int64_t *node = uz_mesh_element(mesh, e, &nodes);
        uz_field_points_states(&state, &middle[kind], e);
        memset(to->x, 0, sizeof to->x);
        if (!middle[kind].group.shaped || middle[kind].volume == 0) { /* equal boxes have one */
            uz_element own;
            double xyz[3 * UZ_ELEMENT_NODES];
            uz_body_element(&own, xyz, p->body->model, e);
            middle[kind].volume = uz_element_volume(&own);
        }
        to->volume = middle[kind].volume;
        memcpy(to->value, state.stress, bytes);
        memcpy(to->value + p->body->components, state.strain, bytes);
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < mesh->dim; c++)
                to->x[c] += mesh->xyz[node[a] * mesh->dim + c];
        for (int c = 0; c < mesh->dim; c++)
            to->x[c] /= nodes;
    }
    return UZ_OK;
}

uz_status uz_field_fit_patches(double *stress, double *strain, unsigned char *done, const uz_field_body *body,
                               const double *u, const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &body->model->mesh;
    patches p = {.body = body, .dim = mesh->dim, .values = 2 * body->components};
    uz_field_points *middle = NULL;
    bool any = false;
    p.plain = uz_alloc(mesh->n_elements, 1);
    uz_status status = p.plain ? UZ_OK : uz_no_memory(err, STRESS);
    /* Incompatible modes have the whole slope, quadratic elements too: their own points serve better. */
    for (int64_t e = 0; p.plain && e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        p.plain[e] =
            type->nodes == type->corners && uz_element_formulation(body->model, e) != UZ_FORMULATION_INCOMPATIBLE;
        any = any || p.plain[e];
    }
    if (any) {
        p.of = uz_alloc(mesh->n_elements, sizeof *p.of);
        middle = uz_alloc(UZ_ELEMENT_KINDS, sizeof *middle);
        p.first = uz_alloc(mesh->n_nodes + 1, sizeof *p.first);
        p.around = uz_alloc(mesh->first[mesh->n_elements], sizeof *p.around);
        p.seen = uz_alloc_zero(mesh->n_elements, sizeof *p.seen);
        if (p.first && p.around)
            uz_mesh_list_around(p.first, p.around, mesh);
        status = p.of && middle && p.first && p.around && p.seen ? take_samples(&p, middle, u, hooks, err)
                                                                 : uz_no_memory(err, STRESS);
    }
    for (int64_t a = 0; any && status == UZ_OK && a < mesh->n_nodes; a++) {
        if (a % BETWEEN_QUESTIONS == 0 && uz_cancelled(hooks))
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while stresses were computed");
        else if (!recover_node(stress, strain, &done[a], &p, a))
            status = uz_no_memory(err, STRESS);
    }
    uz_free_all(middle, p.of, p.plain, p.first, p.around, p.seen, p.patch);
    return status;
}
