/* thin_elements.c: what a thin body owes to its free surfaces.
 *
 * Where an element, or a stack of them, reaches from one side of the body to the other, the mean of the normal stress
 * across it is that of what is applied on both sides: with t(y) across a thickness of 2 h, equilibrium has
 *     1/2h integral of t dy = (t(h) + t(-h)) / 2 + what the shear's moment changes by along the body, over 2 h.
 * No neighbour shows elements that break this. With incompatible modes the linear part of the strain is continued to
 * the nodes (nodal_strains.c), so that stress which goes to zero at the next element along the body jumps nowhere. Of
 * elements that are short against the thickness it does. */
#include "assembly/thin_elements.h"

#include "assembly/nodal_strains.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/corner_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sides that lean by an angle have its square of the stress along them for mean across: of opposite sides within this
 * cosine of each other that is less than 5 %. */
#define OPPOSITE 0.9

/* How thick a stack of several may be, against the shortest edge of the side that it begins with. At a warm clamp
 * elements that are a third of the thickness long are told 0.75 of their error by what jumps, those that are half of it
 * 0.66; what are as long as the body is thick were told 0.33. */
#define THICK 2.01

typedef struct {
    const uz_body_model *model;
    uz_corner_table sides;
    double *known;        /* n_elements x UZ_ELEMENT_SIDES: the normal stress that loads ask for at a side; NaN: no load
                           * alone tells it, as at sides between elements, supports and contacts */
    double *stress, *off; /* n_elements x UZ_ELEMENT_STRESSES: the mean; what it differs by */
    double *volume;       /* n_elements */
    bool any;             /* of stacks there is one */
} thin_elements;

static bool may_be_thin(const uz_body_model *model, const uz_scene *scene)
{
    const uz_box *box = &scene->box;
    bool may = scene->source != UZ_MESH_BOX || scene->n_bisected > 0 || box->automatic;
    for (int c = 0; c < box->dim && !may; c++) {
        bool thin = true;
        for (int o = 0; o < box->dim; o++)
            thin = thin && (o == c || (box->grading[o] > 0 && box->grading[o] != 1) ||
                            box->size[c] <= THICK * box->size[o] / (double)box->cells[o]);
        may = thin || box->cells[c] == 1;
    }
    return may && model->formulation == UZ_FORMULATION_INCOMPATIBLE && model->kind != UZ_AXISYMMETRIC;
}

static void mark_group(unsigned char *held, const uz_body_model *model, const uz_group *group)
{
    for (int64_t i = 0; group && i < uz_group_node_count(&model->mesh, group); i++)
        held[uz_group_node_at(group, i)] = 1;
}

/* Nodes at which more acts than loads and springs by area: supports, springs of other groups, ties, contacts, forces.
 */
static void mark_held(unsigned char *held, const uz_body_model *model, const uz_scene *scene)
{
    const int dim = model->mesh.dim;
    for (int64_t i = 0; i < model->mesh.n_nodes * dim; i++) {
        const int64_t j = model->dof[i];
        if (j < 0 || (model->m > 0 && model->N.ptr[j + 1] > model->N.ptr[j]))
            held[i / dim] = 1;
    }
    for (int64_t k = 0; k < scene->n_supports; k++) {
        const bool spring = scene->supports[k].kind == UZ_SUPPORT_SPRING;
        const uz_group *group = spring ? uz_mesh_group(&model->mesh, scene->supports[k].on, "", NULL) : NULL;
        mark_group(held, model, group && group->kind != UZ_GROUP_FACES ? group : NULL);
    }
    for (int64_t k = 0; k < scene->n_loads; k++) {
        const uz_load *load = &scene->loads[k];
        mark_group(held, model, load->kind == UZ_LOAD_FORCE ? uz_mesh_group(&model->mesh, load->on, "", NULL) : NULL);
        if (load->kind == UZ_LOAD_NODE_FORCE)
            held[load->node] = 1;
    }
}

/* The unit normal in the middle of a side. */
static void normal_of(double n[3], const uz_body_model *model, uz_face face)
{
    static const double MIDDLE[2] = {0, 0};
    double xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    uz_side side;
    n[2] = 0;
    uz_body_side(&side, xyz, node, model, face);
    uz_side_area_vector(n, &side, MIDDLE);
    uz_unit3(n);
}

/* known: 0 at free sides -> with a part of the loads by area. */
static void add_loads(double *known, const uz_body_model *model, const uz_scene *scene, double part)
{
    for (int64_t k = 0; k < scene->n_loads; k++) {
        const uz_load *load = &scene->loads[k];
        const bool by_area = load->kind == UZ_LOAD_PRESSURE || load->kind == UZ_LOAD_TRACTION;
        const uz_group *group = by_area ? uz_mesh_group(&model->mesh, load->on, "", NULL) : NULL;
        for (int64_t i = 0; group && i < group->n_faces; i++) {
            double n[3];
            normal_of(n, model, group->face[i]);
            known[group->face[i].element * UZ_ELEMENT_SIDES + group->face[i].side] +=
                part * (load->kind == UZ_LOAD_PRESSURE ? -load->value : uz_dot3(n, load->v));
        }
    }
}

/* ... and with what springs that are spread over sides pull at them, the body displaced by nodal. */
static void add_springs(double *known, const uz_body_model *model, const uz_scene *scene, const double *nodal)
{
    const int dim = model->mesh.dim;
    for (int64_t k = 0; k < scene->n_supports; k++) {
        const uz_support *support = &scene->supports[k];
        const bool spring = support->kind == UZ_SUPPORT_SPRING;
        const uz_group *group = spring ? uz_mesh_group(&model->mesh, support->on, "", NULL) : NULL;
        double area = 0;
        for (int pass = 0; pass < 2 && group && group->kind == UZ_GROUP_FACES; pass++) /* the whole area first */
            for (int64_t i = 0; i < group->n_faces; i++) {
                double xyz[3 * UZ_FACE_NODES], weight[UZ_FACE_NODES], n[3], pull = 0, own = 0;
                int64_t node[UZ_FACE_NODES];
                uz_side side;
                uz_body_side(&side, xyz, node, model, group->face[i]);
                uz_side_positive_weights(weight, &side);
                normal_of(n, model, group->face[i]);
                for (int a = 0; a < side.nodes; a++) {
                    own += weight[a];
                    for (int c = 0; c < dim; c++)
                        pull -= weight[a] * support->spring[c] * nodal[node[a] * dim + c] * n[c];
                }
                if (pass == 0)
                    area += own;
                else
                    known[group->face[i].element * UZ_ELEMENT_SIDES + group->face[i].side] += pull / (own * area);
            }
    }
}

/* 0 at sides of one element only, where not all corners are held, NaN at others. */
static void find_known(thin_elements *x, const unsigned char *held)
{
    const uz_mesh *mesh = &x->model->mesh;
    for (int64_t i = 0; i < mesh->n_elements * UZ_ELEMENT_SIDES; i++)
        x->known[i] = NAN;
    for (int64_t i = 0; i < x->sides.count; i++) {
        const uz_face face = uz_corner_table_item(&x->sides, i);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side].corners;
        const bool inside = mesh->inside && mesh->inside[face.element] >> face.side & 1;
        int64_t node[UZ_FACE_NODES];
        bool all_held = true;
        if (x->sides.same[i] || x->sides.same[i + 1] || inside ||
            uz_element_formulation(x->model, face.element) != UZ_FORMULATION_INCOMPATIBLE)
            continue;
        uz_mesh_face(node, mesh, face);
        for (int k = 0; k < corners; k++)
            all_held = all_held && held[node[k]];
        x->known[face.element * UZ_ELEMENT_SIDES + face.side] = all_held ? NAN : 0;
    }
}

static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    uz_energy_rule(rule, kind, ((const thin_elements *)ctx)->model->kind, formulation);
}

static void take_means(void *ctx, const uz_strain_group *group)
{
    thin_elements *x = ctx;
    const int n = group->rule.stresses;
    for (int l = 0; l < group->count; l++) {
        double *stress = x->stress + group->element[l] * UZ_ELEMENT_STRESSES, volume = 0, thermal[UZ_ELEMENT_STRESSES];
        for (int p = 0; p < group->rule.asked; p++) {
            volume += group->shape.volume[p][l];
            for (int c = 0; c < n; c++)
                stress[c] += group->shape.volume[p][l] * group->strain[p][c][l];
        }
        uz_thermal_strain(thermal, x->model->kind, *group->lame[l], group->free_strain[l]);
        for (int c = 0; c < n; c++)
            stress[c] = stress[c] / volume - thermal[c];
        uz_elastic_stress(stress, x->model->kind, *group->lame[l], stress);
        x->volume[group->element[l]] = volume;
    }
}

static double known_at(const thin_elements *x, uz_face face)
{
    return x->known[face.element * UZ_ELEMENT_SIDES + face.side];
}

static const uz_element_type *type_at(const thin_elements *x, uz_face face)
{
    return uz_element_type_of((uz_element_kind)x->model->mesh.kind[face.element]);
}

/* The side of the element that has no node of this one; -1: none has, or it is no element of incompatible modes. */
static int opposite_side(const thin_elements *x, uz_face face)
{
    const uz_element_type *type = type_at(x, face);
    const uz_element_side *own = &type->side[face.side];
    int found = -1;
    for (int s = 0; s < type->sides && uz_element_formulation(x->model, face.element) == UZ_FORMULATION_INCOMPATIBLE;
         s++) {
        bool share = false;
        for (int i = 0; i < own->corners; i++)
            for (int j = 0; j < type->side[s].corners; j++)
                share = share || own->node[i] == type->side[s].node[j];
        found = share ? found : s;
    }
    return found;
}

/* *face: a side -> the same one of the element beyond it, if there is one. */
static bool cross(uz_face *face, const thin_elements *x)
{
    int64_t node[UZ_FACE_NODES];
    uz_mesh_face(node, &x->model->mesh, *face);
    const int64_t i =
        uz_corner_table_find(&x->sides, &x->model->mesh, node, type_at(x, *face)->side[face->side].corners);
    if (i < 0 || !x->sides.same[i + 1])
        return false;
    const uz_face one = uz_corner_table_item(&x->sides, i);
    *face = one.element == face->element ? uz_corner_table_item(&x->sides, i + 1) : one;
    return true;
}

static double shortest_edge(const uz_side *side)
{
    double least = INFINITY;
    for (int a = 0; a < side->nodes; a++)
        least = fmin(least,
                     uz_distance2(side->xyz + a * side->dim, side->xyz + (a + 1) % side->nodes * side->dim, side->dim));
    return sqrt(least);
}

/* The side opposite to the one that a stack begins with; false: what is there no load alone tells, or the stack is not
 * thin. *across (stresses): the mean over it. */
static bool find_end(uz_face *end, double *across, const thin_elements *x, uz_face first)
{
    const uz_body_model *model = x->model;
    double xyz[3 * UZ_FACE_NODES], volume = 0;
    int64_t node[UZ_FACE_NODES];
    uz_side side;
    uz_body_side(&side, xyz, node, model, first);
    const double most = THICK * shortest_edge(&side) * uz_side_area(&side);
    memset(across, 0, UZ_ELEMENT_STRESSES * sizeof *across);
    *end = first;
    do {
        const double own = x->volume[end->element];
        end->side = opposite_side(x, *end);
        if (end->side < 0 || (end->element != first.element && volume + own > most))
            return false;
        volume += own;
        for (int c = 0; c < UZ_ELEMENT_STRESSES; c++)
            across[c] += own * x->stress[end->element * UZ_ELEMENT_STRESSES + c];
    } while (isnan(known_at(x, *end)) && cross(end, x));
    for (int c = 0; c < UZ_ELEMENT_STRESSES; c++)
        across[c] /= volume;
    return !isnan(known_at(x, *end));
}

/* The stack that begins with a side, unless it is found from its other end. */
static void take_stack(thin_elements *x, uz_face first)
{
    static const int AXES[2][UZ_ELEMENT_STRESSES][2] = {{{0, 0}, {1, 1}, {0, 1}},
                                                        {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
    const bool solid = x->model->mesh.dim == 3;
    const int(*axes)[2] = AXES[solid], n = solid ? 6 : 3;
    double one[3], other[3], stress[UZ_ELEMENT_STRESSES], normal[UZ_ELEMENT_STRESSES], apart = 0;
    uz_face end, at = first;
    if (isnan(known_at(x, first)) || !find_end(&end, stress, x, first) || end.element < first.element ||
        (end.element == first.element && end.side < first.side))
        return;
    normal_of(one, x->model, first);
    normal_of(other, x->model, end);
    if (uz_dot3(one, other) > -OPPOSITE)
        return;
    for (int c = 0; c < 3; c++)
        one[c] -= other[c];
    uz_unit3(one);
    for (int c = 0; c < n; c++) {
        normal[c] = one[axes[c][0]] * one[axes[c][1]];
        apart += (axes[c][0] == axes[c][1] ? 1 : 2) * normal[c] * stress[c];
    }
    apart -= 0.5 * (known_at(x, first) + known_at(x, end));
    do {
        for (int c = 0; c < n; c++)
            x->off[at.element * UZ_ELEMENT_STRESSES + c] += apart * normal[c];
        at.side = opposite_side(x, at);
    } while (at.element != end.element && cross(&at, x));
    x->any = true;
}

static uz_status begin(thin_elements *x, unsigned char *held, const uz_scene *scene, const double *nodal, double loads,
                       uz_error *err)
{
    const uz_status status = uz_corner_table_build(&x->sides, &x->model->mesh, true, err);
    if (status != UZ_OK)
        return status;
    mark_held(held, x->model, scene);
    find_known(x, held);
    add_loads(x->known, x->model, scene, loads);
    add_springs(x->known, x->model, scene, nodal);
    return UZ_OK;
}

uz_status uz_thin_elements_errors(double **least, const uz_scene *scene, const uz_strain_source *from, double loads,
                                  uz_error *err)
{
    const uz_body_model *model = from->model;
    const int64_t n = model->mesh.n_elements;
    thin_elements x = {.model = model};
    const uz_strain_work work = {make_rule, take_means, &x};
    *least = NULL;
    if (!may_be_thin(model, scene))
        return UZ_OK;
    unsigned char *held = uz_alloc_zero(model->mesh.n_nodes, 1);
    x.known = uz_alloc(n * UZ_ELEMENT_SIDES, sizeof *x.known);
    x.stress = uz_alloc_zero(n * UZ_ELEMENT_STRESSES, sizeof *x.stress);
    x.off = uz_alloc_zero(n * UZ_ELEMENT_STRESSES, sizeof *x.off);
    x.volume = uz_alloc(n, sizeof *x.volume);
    uz_status status = held && x.known && x.stress && x.off && x.volume
                           ? begin(&x, held, scene, from->nodal, loads, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for sides of %lld elements", (long long)n);
    if (status == UZ_OK)
        status = uz_strain_groups(&work, from, NULL, err);
    for (int64_t e = 0; e < n && status == UZ_OK; e++)
        for (int s = 0; s < uz_element_type_of((uz_element_kind)model->mesh.kind[e])->sides; s++)
            take_stack(&x, (uz_face){e, s});
    if (status == UZ_OK && x.any) { /* in the place of the volumes */
        for (int64_t e = 0; e < n; e++)
            x.volume[e] *=
                uz_stress_work(model->kind, uz_element_material(model, e)->lame, x.off + e * UZ_ELEMENT_STRESSES);
        *least = x.volume;
        x.volume = NULL;
    }
    uz_corner_table_clear(&x.sides);
    uz_free_all(held, x.known, x.stress, x.off, x.volume);
    return status;
}
