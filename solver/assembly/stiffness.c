/* stiffness.c: the element matrices added up straight into compressed columns, element by element, and what they do to
 * a displacement. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"
#include "element/stiffness_lanes.h"
#include "linalg/linalg.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DOFS = UZ_ELEMENT_DOFS };

static uz_status refuse_shape(const uz_body_model *model, int64_t element, uz_shape_fault fault, uz_error *err)
{
    char nodes[256] = "";
    int count;
    const int64_t *node = uz_mesh_element(&model->mesh, element, &count);
    for (int a = 0; a < count; a++) {
        const size_t used = strlen(nodes);
        snprintf(nodes + used, sizeof nodes - used, "%s%lld", a ? ", " : "", (long long)node[a]);
    }
    return uz_fail(err, UZ_ERR_SCENE, "/mesh/elements", "element %lld (nodes %s) %s", (long long)element, nodes,
                   uz_shape_fault_text(fault));
}

static uz_status element_stiffness(double *ke, const uz_body_model *model, int64_t e, uz_error *err)
{
    uz_element element;
    double xyz[3 * UZ_ELEMENT_NODES];
    uz_body_element(&element, xyz, model, e);
    const uz_shape_fault fault = uz_element_stiffness(ke, &element);
    if (fault != UZ_SHAPE_GOOD)
        return refuse_shape(model, e, fault, err);
    /* A sum of a few entries must not overflow either, and a stiffness must not vanish by underflow. */
    int n = uz_element_node_count(element.kind) * model->mesh.dim;
    for (int i = 0; i < n * n; i++)
        if (!(fabs(ke[i]) < DBL_MAX / 1024))
            return uz_fail(err, UZ_ERR_NOT_FINITE, "/materials",
                           "the stiffness of element %lld overflows; use other units", (long long)e);
    for (int i = 0; i < n; i++)
        if (!(ke[(n + 1) * i] > DBL_MIN * 1024))
            return uz_fail(err, UZ_ERR_SCENE, "/materials",
                           "the stiffness of element %lld underflows to zero; use other units", (long long)e);
    return UZ_OK;
}

/* Element by element, keeping what the next ones share: in a mesh of equal boxes one matrix per material. */
typedef struct {
    const uz_body_model *model;
    bool shared;
    double *of_material; /* shared: n_materials matrices of DOFS x DOFS */
    bool *known;         /* shared: n_materials */
    double own[DOFS * DOFS];
} stiffness_source;

static uz_status source_init(stiffness_source *s, const uz_body_model *model, uz_error *err)
{
    *s = (stiffness_source){.model = model, .shared = model->mesh.uniform && model->kind != UZ_AXISYMMETRIC};
    if (!s->shared)
        return UZ_OK;
    s->of_material = uz_alloc(model->n_materials * DOFS * DOFS, sizeof *s->of_material);
    s->known = uz_alloc_zero(model->n_materials, sizeof *s->known);
    if (s->of_material && s->known)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stiffness of %lld materials",
                   (long long)model->n_materials);
}

static void source_clear(stiffness_source *s)
{
    free(s->of_material);
    free(s->known);
}

/* *ke: the matrix of element e, until the next call. */
static uz_status source_get(const double **ke, stiffness_source *s, int64_t e, uz_error *err)
{
    const int64_t k = s->shared && s->model->material_of ? s->model->material_of[e] : 0;
    double *room = s->shared ? s->of_material + k * DOFS * DOFS : s->own;
    uz_status status = UZ_OK;
    *ke = room;
    if (s->shared && s->known[k])
        return UZ_OK;
    status = element_stiffness(room, s->model, e, err);
    if (s->shared && status == UZ_OK)
        s->known[k] = true;
    return status;
}

/* The shape of all; of the range only the first of each material is looked at, as building looks at all. */
uz_status uz_check_elements(const uz_body_model *model, uz_error *err)
{
    double ke[DOFS * DOFS];
    uz_status status = UZ_OK;
    const int64_t distinct =
        model->mesh.uniform && model->kind != UZ_AXISYMMETRIC && !model->material_of ? 1 : model->mesh.n_elements;
    bool *known = uz_alloc_zero(model->n_materials, sizeof *known);
    if (!known)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld materials", (long long)model->n_materials);
    for (int64_t e = 0; e < distinct && status == UZ_OK; e++) {
        const int64_t k = model->material_of ? model->material_of[e] : 0;
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES];
        uz_body_element(&element, xyz, model, e);
        const uz_shape_fault fault = uz_element_check(&element);
        if (fault != UZ_SHAPE_GOOD)
            status = refuse_shape(model, e, fault, err);
        else if (!known[k])
            status = element_stiffness(ke, model, e, err);
        known[k] = true;
    }
    free(known);
    return status;
}

/* ---------------------------------------------------------------- adding up */

/* Nodes, whose columns somebody adds to: `from` to before `to`. */
typedef struct {
    int64_t from, to;
} columns;

static bool has_columns(const columns *of, int64_t node)
{
    return node >= of->from && node < of->to;
}

/* The block of two nodes whose dofs are all free, without questions. column, row: the first of the earlier one's and of
 * the later one's; ke: of these, rows n apart. */
UZ_INLINE void add_whole_block(uz_csc *K, int64_t column, int64_t row, const double *ke, int n, int dim)
{
    const int64_t place = uz_csc_seek(K, row, column) - K->ptr[column];
    for (int64_t j = 0; j < dim; j++) {
        double *val = K->val + K->ptr[column + j] + place - j;
        for (int i = 0; i < dim; i++)
            val[i] += ke[i * n + j];
    }
}

/* The rows of a node stand together in every column, at a place that the column of another's first free dof tells: each
 * following one lacks the rows of that node before its diagonal. */
static void add_block(uz_csc *K, const int64_t *column, const int64_t *row, const double *ke, int n, int dim)
{
    int64_t place = -1, first_column = 0;
    for (int j = 0; j < dim; j++) {
        int64_t at = 0;
        for (int i = 0; i < dim && column[j] >= 0; i++) {
            if (row[i] < 0)
                continue;
            if (place < 0) {
                place = uz_csc_find(K, row[i], column[j]) - K->ptr[column[j]];
                first_column = column[j];
            }
            K->val[K->ptr[column[j]] + place - (column[j] - first_column) + at++] += ke[i * n + j];
        }
    }
}

/* The columns of a node whose dofs are all free: its own block's lower triangle, at the head of each, and the blocks of
 * later nodes; of those that are not free as well: add_block. */
UZ_INLINE void add_whole_node(uz_csc *K, const int64_t *const *dof, const bool *free, const double *ke,
                              const int64_t *node, int count, int a, int dim)
{
    const int n = count * dim;
    const int64_t column = dof[a][0];
    for (int j = 0; j < dim; j++)
        for (int i = j; i < dim; i++)
            K->val[K->ptr[column + j] + i - j] += ke[(a * dim + i) * n + a * dim + j];
    for (int b = 0; b < count; b++)
        if (node[b] > node[a] && free[b])
            add_whole_block(K, column, dof[b][0], ke + b * dim * n + a * dim, n, dim);
        else if (node[b] > node[a])
            add_block(K, dof[a], dof[b], ke + b * dim * n + a * dim, n, dim);
}

/* What dof j of node a has of a stiffness in its own block and, where it is supported, in K_fixed. */
static void add_own(uz_body_model *model, const double *ke, const int64_t *const *dof, int n, int a, int j)
{
    const int dim = model->mesh.dim;
    uz_csc *K = &model->K, *K_fixed = &model->K_fixed;
    const int64_t column = dof[a][j];
    /* the block of the node itself: its lower triangle, at the head of each column */
    for (int i = j; i < dim && column >= 0; i++)
        if (dof[a][i] >= 0)
            K->val[K->ptr[column] + dof[a][i] - column] += ke[(a * dim + i) * n + a * dim + j];
    /* the free rows of a supported dof */
    for (int i = 0; i < n && column < 0; i++) {
        const int64_t row = dof[i / dim][i % dim];
        if (row >= 0)
            K_fixed->val[uz_csc_find(K_fixed, row, -1 - column)] += ke[i * n + a * dim + j];
    }
}

/* A stiffness of displacements at nodes, to some columns of K and K_fixed. */
static void add_to_columns(uz_body_model *model, const columns *of, const double *ke, const int64_t *node, int count)
{
    double turned[DOFS * DOFS], tied[DOFS * DOFS];
    uz_ties ties;
    const int64_t *dof[UZ_ELEMENT_NODES];
    bool free[UZ_ELEMENT_NODES];
    const int dim = model->mesh.dim;
    if (model->mesh.hangs)
        uz_tie_nodes(&ties, &model->mesh, node, count);
    if (model->mesh.hangs && ties.hangs) {
        uz_tie_stiffness(tied, &ties, ke, dim);
        ke = tied;
        node = ties.node;
        count = ties.count;
    }
    const int n = count * dim;
    if (uz_are_rotated(model, node, count)) {
        memcpy(turned, ke, (size_t)(n * n) * sizeof *ke);
        uz_turn_stiffness(turned, model, node, count);
        ke = turned;
    }
    for (int a = 0; a < count; a++) { /* free dofs of a node have numbers in a row */
        dof[a] = model->dof + node[a] * dim;
        free[a] = dof[a][0] >= 0 && dof[a][1] >= 0 && dof[a][dim - 1] >= 0;
    }
    for (int a = 0; a < count; a++) {
        if (!has_columns(of, node[a]))
            continue;
        for (int j = 0; j < dim && !free[a]; j++)
            add_own(model, ke, dof, n, a, j);
        for (int b = 0; b < count && !free[a]; b++)
            if (node[b] > node[a])
                add_block(&model->K, dof[a], dof[b], ke + b * dim * n + a * dim, n, dim);
        if (free[a] && dim == 2)
            add_whole_node(&model->K, dof, free, ke, node, count, a, 2);
        else if (free[a])
            add_whole_node(&model->K, dof, free, ke, node, count, a, 3);
    }
}

void uz_add_stiffness(uz_body_model *model, const double *ke, const int64_t *node, int count)
{
    const columns all = {0, model->mesh.n_nodes};
    if (uz_have_carriers(model, node, count))
        uz_add_carried(model, ke, node, count);
    else
        add_to_columns(model, &all, ke, node, count);
}

/* ---------------------------------------------------------------- all elements */

enum { LANES = UZ_STRAIN_LANES };

/* One of those that add up a body's elements, each to columns of its own, all in the order of the elements: so that
 * every entry is the same sum however many there are. An element around whose nodes several have columns is made by
 * each of these. */
typedef struct {
    uz_body_model *model;
    columns of;
    stiffness_source source;
    uz_stiffness_rule *rule; /* UZ_ELEMENT_KINDS, nodes 0: not made yet; NULL: elements share their matrices */
    /* Elements that follow each other and are of one kind and formulation, to be made at once. */
    int count;
    int64_t element[LANES];
    uz_formulation formulation;
    bool in_lanes;
    double *ke; /* LANES x DOFS x DOFS */
    int64_t refused;
    uz_status status;
    uz_error err;
} adder;

static bool adder_init(adder *s, uz_body_model *model)
{
    s->model = model;
    s->status = source_init(&s->source, model, &s->err);
    if (s->status != UZ_OK || s->source.shared)
        return s->status == UZ_OK;
    s->rule = uz_alloc(UZ_ELEMENT_KINDS, sizeof *s->rule);
    s->ke = uz_alloc(LANES * DOFS * DOFS, sizeof *s->ke);
    for (int kind = 0; s->rule && kind < UZ_ELEMENT_KINDS; kind++)
        s->rule[kind].nodes = 0;
    if (!s->rule || !s->ke)
        s->status = uz_fail(&s->err, UZ_ERR_MEMORY, "", "no memory to add up the stiffness of elements");
    return s->status == UZ_OK;
}

static void adder_clear(adder *s)
{
    source_clear(&s->source);
    free(s->rule);
    free(s->ke);
}

static void add_element(adder *s, const double *ke, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(&s->model->mesh, e, &count);
    if (s->model->follow.first && !uz_is_unstrained(s->model, node, count))
        uz_add_stiffness(s->model, ke, node, count);
    else if (!s->model->follow.first)
        add_to_columns(s->model, &s->of, ke, node, count);
}

/* The matrices of those that wait; false: not of all. */
static bool make_in_lanes(adder *s)
{
    const uz_body_model *model = s->model;
    const uz_mesh *mesh = &model->mesh;
    const uz_element_kind kind = (uz_element_kind)mesh->kind[s->element[0]];
    uz_stiffness_rule *rule = &s->rule[kind];
    uz_lanes x[3 * UZ_ELEMENT_NODES];
    uz_lane_material material;
    double *ke[LANES];
    if (rule->nodes == 0)
        uz_stiffness_rule_of(rule, kind, model->kind);
    for (int l = 0; l < LANES; l++) { /* the first again where there is none */
        const int64_t e = s->element[l < s->count ? l : 0], *node = mesh->node + mesh->first[e];
        const uz_lame *lame = &uz_element_material(model, e)->lame;
        ke[l] = s->ke + (l < s->count ? l : 0) * DOFS * DOFS;
        material.lambda[l] = lame->lambda;
        material.mu[l] = lame->mu;
        for (int a = 0; a < rule->nodes; a++)
            for (int c = 0; c < rule->dim; c++)
                x[a * rule->dim + c][l] = mesh->xyz[node[a] * rule->dim + c];
    }
    return uz_lane_stiffness(ke, rule, s->formulation, x, &material, model->thickness);
}

static void add_waiting(adder *s)
{
    const bool made = s->count > 0 && s->in_lanes && make_in_lanes(s);
    for (int l = 0; l < s->count && s->status == UZ_OK; l++) {
        const double *ke = s->ke + l * DOFS * DOFS;
        if (!made)
            s->status = source_get(&ke, &s->source, s->element[l], &s->err);
        if (s->status == UZ_OK)
            add_element(s, ke, s->element[l]);
        else
            s->refused = s->element[l];
    }
    s->count = 0;
}

static void await(adder *s, int64_t e)
{
    const uz_body_model *model = s->model;
    const uz_element element = {.model = model->kind,
                                .formulation = uz_element_formulation(model, e),
                                .lame = uz_element_material(model, e)->lame};
    const bool in_lanes = !s->source.shared && uz_is_for_lanes(&element);
    if (s->count > 0 && (s->in_lanes != in_lanes || s->formulation != element.formulation ||
                         model->mesh.kind[s->element[0]] != model->mesh.kind[e]))
        add_waiting(s);
    s->in_lanes = in_lanes;
    s->formulation = element.formulation;
    s->element[s->count++] = e;
    if (s->count == LANES || !in_lanes)
        add_waiting(s);
}

/* Is one of an element's nodes, or of those that its hanging ones lie amid, among these? */
static bool concerns(const columns *of, const uz_mesh *mesh, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    for (int a = 0; a < count; a++)
        if (has_columns(of, node[a]) || uz_mesh_hangs(mesh, node[a]))
            return true;
    return false;
}

static void add_elements(void *ctx, int part)
{
    adder *s = (adder *)ctx + part;
    const uz_mesh *mesh = &s->model->mesh;
    const bool all = s->of.to - s->of.from == mesh->n_nodes;
    for (int64_t e = 0; e < mesh->n_elements && s->status == UZ_OK; e++)
        if (all || concerns(&s->of, mesh, e))
            await(s, e);
    if (s->status == UZ_OK)
        add_waiting(s);
}

enum { WORTH_SHARING = 20000 }; /* elements */

/* More work than this, in parts of all, is not worth to be done by several. */
#define TWICE_MOST 1.25

/* Nodes in parts with as many elements around them each; returns how many parts. */
static int divide_nodes(columns of[UZ_ASIDE_MOST], const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    const int parts = mesh->n_elements < WORTH_SHARING || model->follow.first ? 1 : uz_aside_threads();
    const uz_csc *K = &model->K;
    double made = 0;
    int64_t a = 0;
    for (int p = 0; p < parts; p++) {
        const int64_t entries = K->ptr[K->cols] / parts * (p + 1);
        of[p].from = a;
        for (; a < mesh->n_nodes && p < parts - 1; a++) {
            const int64_t column = model->dof[a * mesh->dim];
            if (column >= 0 && K->ptr[column] >= entries)
                break;
        }
        of[p].to = p < parts - 1 ? a : mesh->n_nodes;
    }
    for (int p = 0; p < parts && parts > 1; p++)
        for (int64_t e = 0; e < mesh->n_elements; e++)
            made += concerns(&of[p], mesh, e);
    if (made > TWICE_MOST * (double)mesh->n_elements) {
        of[0].to = mesh->n_nodes;
        return 1;
    }
    return parts;
}

static uz_status add_all_elements(uz_body_model *model, uz_error *err)
{
    columns of[UZ_ASIDE_MOST];
    const int parts = divide_nodes(of, model);
    adder *adders = uz_alloc_zero(parts, sizeof *adders), *first = NULL;
    if (!adders)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to add up the stiffness of elements");
    bool ready = true;
    for (int p = 0; p < parts; p++) {
        adders[p].of = of[p];
        ready = adder_init(&adders[p], model) && ready;
    }
    if (ready)
        uz_aside_share(add_elements, adders, parts);
    for (int p = 0; p < parts; p++)
        if (adders[p].status != UZ_OK && (!first || adders[p].refused < first->refused))
            first = &adders[p];
    const uz_status status = first ? first->status : UZ_OK;
    if (first && err)
        *err = first->err;
    for (int p = 0; p < parts; p++)
        adder_clear(&adders[p]);
    free(adders);
    return status;
}

/* The springs of a node as a matrix of its dofs: Q diag(k) Q'. */
static void add_springs(uz_body_model *model)
{
    const int dim = model->mesh.dim;
    for (int64_t a = 0; a < model->mesh.n_nodes && model->spring; a++) {
        const double *k = model->spring + a * dim, *Q = uz_node_frame(model, a);
        const int64_t *dof = model->dof + a * dim;
        double own[9] = {0};
        for (int c = 0; c < dim; c++)
            own[c * dim + c] = k[c];
        const bool follows = uz_mesh_hangs(&model->mesh, a) || uz_have_carriers(model, &a, 1);
        if (follows)
            uz_add_stiffness(model, own, &a, 1);
        for (int j = 0; j < dim && !follows; j++)
            for (int i = 0; i < dim; i++) {
                double value = Q || i != j ? 0 : k[i];
                for (int c = 0; Q && c < dim; c++)
                    value += Q[i * dim + c] * k[c] * Q[j * dim + c];
                if (value == 0 || dof[i] < 0 || (dof[j] >= 0 && dof[i] < dof[j]))
                    continue;
                if (dof[j] >= 0)
                    model->K.val[uz_csc_find(&model->K, dof[i], dof[j])] += value;
                else
                    model->K_fixed.val[uz_csc_find(&model->K_fixed, dof[i], -1 - dof[j])] += value;
            }
    }
}

uz_status uz_build_stiffness(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = uz_build_pattern(model, scene, err);
    if (status == UZ_OK)
        status = add_all_elements(model, err);
    if (status == UZ_OK)
        add_springs(model);
    return status;
}

/* ------------------------------------------------------------ strain energy */

/* Displacements of an element's nodes against those of the first: a translation strains nothing, and what it would
 * leave by rounding grows with it. Not along the radius. Returns how many. */
static int take_nodal(double d[DOFS], const uz_body_model *model, const double *nodal, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(&model->mesh, e, &count);
    const bool rings = model->kind == UZ_AXISYMMETRIC;
    const int dim = model->mesh.dim;
    for (int a = 0; a < count; a++)
        for (int c = 0; c < dim; c++)
            d[a * dim + c] = nodal[node[a] * dim + c] - (rings && c == 0 ? 0 : nodal[node[0] * dim + c]);
    return count * dim;
}

/* d'ke d of one element, by one triangle of the symmetric ke; the rows do not wait for each other. */
static double energy_any(const uz_body_model *model, const double *ke, const double *nodal, int64_t e)
{
    double d[DOFS], sum = 0;
    const int n = take_nodal(d, model, nodal, e);
    for (int i = 0; i < n; i++) {
        double row = 0;
        for (int j = 0; j < i; j++)
            row += ke[i * n + j] * d[j];
        sum += d[i] * (2 * row + ke[i * n + i] * d[i]);
    }
    return sum;
}

typedef double two __attribute__((vector_size(16), aligned(8), may_alias));
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

/* The same for quad4, the element of most meshes: ke by columns, in two registers each, and d in two. */
static inline __attribute__((always_inline)) double energy_quad4(const uz_body_model *model, const double *ke,
                                                                 const double *nodal, int64_t e)
{
    enum { N = 8 };
    const int64_t *node = model->mesh.node + model->mesh.first[e];
    two u[4];
    for (int a = 0; a < 4; a++)
        u[a] = *(const two *)(nodal + 2 * node[a]);
    const double first = model->kind == UZ_AXISYMMETRIC ? 0 : u[0][0];
    const four origin = {first, u[0][1], first, u[0][1]};
    const four d[2] = {__builtin_shufflevector(u[0], u[1], 0, 1, 2, 3) - origin,
                       __builtin_shufflevector(u[2], u[3], 0, 1, 2, 3) - origin};
    four low = {0}, high = {0};
    for (int j = 0; j < N; j++) {
        low += *(const four *)(ke + j * N) * d[j / 4][j % 4];
        high += *(const four *)(ke + j * N + 4) * d[j / 4][j % 4];
    }
    const four sum = low * d[0] + high * d[1];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

UZ_AVX2_FMA static double energy_quad4_wide(const uz_body_model *model, const double *ke, const double *nodal,
                                            int64_t e)
{
    return energy_quad4(model, ke, nodal, e);
}

/* And for hex8, the element of most solids: by columns, in six registers. */
static inline __attribute__((always_inline)) double energy_hex8(const uz_body_model *model, const double *ke,
                                                                const double *nodal, int64_t e)
{
    enum { N = 24, WIDE = N / 4 };
    double d[DOFS];
    four row[WIDE] = {{0}}, sum = {0};
    take_nodal(d, model, nodal, e);
    for (int j = 0; j < N; j++) {
        const four *column = (const four *)(ke + j * N);
        row[0] += column[0] * d[j];
        row[1] += column[1] * d[j];
        row[2] += column[2] * d[j];
        row[3] += column[3] * d[j];
        row[4] += column[4] * d[j];
        row[5] += column[5] * d[j];
    }
    for (int i = 0; i < WIDE; i++)
        sum += row[i] * *(const four *)(d + 4 * i);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

UZ_AVX2_FMA static double energy_hex8_wide(const uz_body_model *model, const double *ke, const double *nodal, int64_t e)
{
    return energy_hex8(model, ke, nodal, e);
}

typedef double (*element_energy)(const uz_body_model *model, const double *ke, const double *nodal, int64_t e);

/* Twice the energy of elements begin to end - 1, which share their matrices. */
static uz_status add_energies(double *twice, const uz_body_model *model, const double *nodal, int64_t begin,
                              int64_t end, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const bool wide = uz_cpu_has_avx2_fma();
    const element_energy of_quad4 = wide ? energy_quad4_wide : energy_quad4,
                         of_hex8 = wide ? energy_hex8_wide : energy_hex8;
    stiffness_source source;
    const double *ke;
    uz_status status = source_init(&source, model, err);
    for (int64_t e = begin; e < end && status == UZ_OK; e++) {
        status = source_get(&ke, &source, e, err);
        if (status == UZ_OK)
            *twice += mesh->kind[e] == UZ_QUAD4  ? of_quad4(model, ke, nodal, e)
                      : mesh->kind[e] == UZ_HEX8 ? of_hex8(model, ke, nodal, e)
                                                 : energy_any(model, ke, nodal, e);
    }
    source_clear(&source);
    return status;
}

enum { SHARES = 2 };

typedef struct {
    const uz_body_model *model;
    const double *nodal;
    bool carried, by_strains;
    double twice[SHARES];
    uz_status status[SHARES];
    uz_error err[SHARES];
} energy_sum;

static void add_share(void *ctx, int share)
{
    energy_sum *sum = ctx;
    const int64_t n = sum->model->mesh.n_elements, middle = n < WORTH_SHARING ? 0 : n / 2;
    const int64_t begin = share == 0 ? 0 : middle, end = share == 0 ? middle : n;
    double *twice = &sum->twice[share];
    sum->status[share] = sum->by_strains ? uz_strain_energy_of_groups(twice, sum->model, sum->nodal, sum->carried,
                                                                      begin, end, &sum->err[share])
                                         : add_energies(twice, sum->model, sum->nodal, begin, end, &sum->err[share]);
}

uz_status uz_strain_energy(double *energy, const uz_body_model *model, const double *nodal, bool carried, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    energy_sum sum = {.model = model, .nodal = nodal, .carried = carried};
    sum.by_strains = carried || !mesh->uniform || model->kind == UZ_AXISYMMETRIC;
    if (model->brick && !sum.by_strains)
        sum.status[0] = uz_brick_energy(&sum.twice[0], model->brick, nodal, &sum.err[0]);
    else if (mesh->n_elements < WORTH_SHARING)
        add_share(&sum, 1);
    else
        uz_aside_share(add_share, &sum, SHARES);
    double twice = sum.twice[0] + sum.twice[1];
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim && model->spring; i++)
        twice += model->spring[i] * nodal[i] * nodal[i];
    *energy = 0.5 * twice;
    for (int share = 0; share < SHARES; share++)
        if (sum.status[share] != UZ_OK) {
            if (err)
                *err = sum.err[share];
            return sum.status[share];
        }
    return UZ_OK;
}

/* ------------------------------------------------------------ energy of rounding */

uz_status uz_turning_energy(double *energy, const uz_body_model *model, const double *nodal, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    stiffness_source source;
    const double *ke;
    *energy = 0;
    uz_status status = source_init(&source, model, err);
    for (int64_t e = 0; e < mesh->n_elements && status == UZ_OK; e++) {
        double delta[DOFS];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        bool turned = uz_are_rotated(model, node, count);
        for (int a = 0; a < count; a++)
            turned = turned || uz_mesh_hangs(mesh, node[a]) || uz_have_carriers(model, &node[a], 1);
        if (!turned)
            continue;
        status = source_get(&ke, &source, e, err);
        for (int a = 0; a < count; a++)
            for (int c = 0; c < dim; c++)
                delta[a * dim + c] = uz_turning_error(model, node[a], nodal);
        double sum = 0; /* |delta|'|ke||delta| */
        for (int i = 0; i < count * dim && status == UZ_OK; i++)
            for (int j = 0; j < count * dim; j++)
                sum += fabs(ke[i * count * dim + j]) * fabs(delta[i]) * fabs(delta[j]);
        *energy += sum;
    }
    for (int64_t a = 0; a < mesh->n_nodes && model->spring; a++) {
        const double delta = uz_turning_error(model, a, nodal);
        for (int c = 0; c < dim; c++)
            *energy += model->spring[a * dim + c] * delta * delta;
    }
    source_clear(&source);
    return status;
}
