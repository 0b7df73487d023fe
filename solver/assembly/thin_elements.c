/* thin_elements.c: what a body one element thick owes to its free surfaces.
 *
 * Where an element reaches from one side of the body to the other, the mean of the normal stress across it is that of
 * what is applied on both sides: with t(y) across a thickness of 2 h, equilibrium has
 *     1/2h integral of t dy = (t(h) + t(-h)) / 2 + what the shear's moment changes by along the body, over 2 h.
 * No neighbour shows an element that breaks this, as nothing is between it and the surface. Of elements with
 * incompatible modes the linear part of the strain is continued to the nodes (nodal_strains.c), and of one that is
 * alone at its nodes it is met there by itself: stress that goes to zero at the neighbour jumps nowhere. */
#include "assembly/thin_elements.h"

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

static bool may_be_thin(const uz_body_model *model, const uz_scene *scene)
{
    const uz_box *box = &scene->box;
    bool may = scene->source != UZ_MESH_BOX || scene->n_bisected > 0;
    for (int c = 0; c < box->dim && !may; c++)
        may = box->automatic || box->cells[c] == 1;
    return may && model->formulation == UZ_FORMULATION_INCOMPATIBLE && model->kind != UZ_AXISYMMETRIC;
}

/* Nodes at which more acts than loads by area: supports, springs, ties, contacts, forces. */
static void mark_held(unsigned char *held, const uz_body_model *model, const uz_scene *scene)
{
    const int dim = model->mesh.dim;
    for (int64_t i = 0; i < model->mesh.n_nodes * dim; i++) {
        const int64_t j = model->dof[i];
        if (j < 0 || (model->spring && model->spring[i] > 0) || (model->m > 0 && model->N.ptr[j + 1] > model->N.ptr[j]))
            held[i / dim] = 1;
    }
    for (int64_t k = 0; k < scene->n_loads; k++) {
        const uz_load *load = &scene->loads[k];
        const uz_group *group = load->kind == UZ_LOAD_FORCE ? uz_mesh_group(&model->mesh, load->on, "", NULL) : NULL;
        for (int64_t i = 0; group && i < uz_group_node_count(&model->mesh, group); i++)
            held[uz_group_node_at(group, i)] = 1;
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

/* known: 0 at free sides -> with the loads by area. */
static void add_loads(double *known, const uz_body_model *model, const uz_scene *scene)
{
    for (int64_t k = 0; k < scene->n_loads; k++) {
        const uz_load *load = &scene->loads[k];
        const bool by_area = load->kind == UZ_LOAD_PRESSURE || load->kind == UZ_LOAD_TRACTION;
        const uz_group *group = by_area ? uz_mesh_group(&model->mesh, load->on, "", NULL) : NULL;
        for (int64_t i = 0; group && i < group->n_faces; i++) {
            double n[3];
            normal_of(n, model, group->face[i]);
            known[group->face[i].element * UZ_ELEMENT_SIDES + group->face[i].side] +=
                load->kind == UZ_LOAD_PRESSURE ? -load->value : uz_dot3(n, load->v);
        }
    }
}

/* 0 at sides of one element only, where not all corners are held, NaN at others. */
static void find_known(double *known, const uz_body_model *model, const unsigned char *held,
                       const uz_corner_table *sides)
{
    const uz_mesh *mesh = &model->mesh;
    for (int64_t i = 0; i < mesh->n_elements * UZ_ELEMENT_SIDES; i++)
        known[i] = NAN;
    for (int64_t i = 0; i < sides->count; i++) {
        const uz_face face = sides->item[i];
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side].corners;
        const bool inside = mesh->inside && mesh->inside[face.element] >> face.side & 1;
        int64_t node[UZ_FACE_NODES];
        bool all_held = true;
        if (sides->same[i] || sides->same[i + 1] || inside ||
            uz_element_formulation(model, face.element) != UZ_FORMULATION_INCOMPATIBLE)
            continue;
        uz_mesh_face(node, mesh, face);
        for (int k = 0; k < corners; k++)
            all_held = all_held && held[node[k]];
        known[face.element * UZ_ELEMENT_SIDES + face.side] = all_held ? NAN : 0;
    }
}

uz_status uz_thin_elements_find(uz_thin_elements *out, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_corner_table sides = {.item = NULL};
    out->known = NULL;
    if (!may_be_thin(model, scene))
        return UZ_OK;
    unsigned char *held = uz_alloc_zero(mesh->n_nodes, 1);
    out->known = uz_alloc(mesh->n_elements * UZ_ELEMENT_SIDES, sizeof *out->known);
    uz_status status = held && out->known ? uz_corner_table_build(&sides, mesh, true, err)
                                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for sides of %lld elements",
                                                    (long long)mesh->n_elements);
    if (status == UZ_OK) {
        mark_held(held, model, scene);
        find_known(out->known, model, held, &sides);
        add_loads(out->known, model, scene);
    } else {
        uz_thin_elements_clear(out);
    }
    uz_corner_table_clear(&sides);
    free(held);
    return status;
}

void uz_thin_elements_clear(uz_thin_elements *thin)
{
    free(thin->known);
    thin->known = NULL;
}

static bool share_node(const uz_element_side *one, const uz_element_side *other)
{
    bool share = false;
    for (int i = 0; i < one->corners; i++)
        for (int j = 0; j < other->corners; j++)
            share = share || one->node[i] == other->node[j];
    return share;
}

static double mean_stress(double *stress, const uz_body_model *model, const uz_strain_group *group, int lane)
{
    const int n = group->rule.stresses;
    double volume = 0, thermal[UZ_ELEMENT_STRESSES];
    memset(stress, 0, UZ_ELEMENT_STRESSES * sizeof *stress);
    for (int p = 0; p < group->rule.asked; p++) {
        volume += group->shape.volume[p][lane];
        for (int c = 0; c < n; c++)
            stress[c] += group->shape.volume[p][lane] * group->strain[p][c][lane];
    }
    uz_thermal_strain(thermal, model->kind, *group->lame[lane], group->free_strain[lane]);
    for (int c = 0; c < n; c++)
        stress[c] = stress[c] / volume - thermal[c];
    uz_elastic_stress(stress, model->kind, *group->lame[lane], stress);
    return volume;
}

double uz_thin_difference(const uz_thin_elements *thin, const uz_body_model *model, const uz_strain_group *group,
                          int lane)
{
    static const int AXES[2][UZ_ELEMENT_STRESSES][2] = {{{0, 0}, {1, 1}, {0, 1}},
                                                        {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
    const int64_t e = group->element[lane];
    const double *known = thin->known + e * UZ_ELEMENT_SIDES;
    const uz_element_type *type = uz_element_type_of(group->rule.kind);
    const int n = group->rule.stresses;
    const int(*axes)[2] = AXES[type->dim == 3];
    double stress[UZ_ELEMENT_STRESSES], off[UZ_ELEMENT_STRESSES] = {0}, volume = 0;
    for (int s = 0; s < type->sides; s++)
        for (int t = 0; t < s; t++) {
            double one[3], other[3], across = 0;
            if (isnan(known[s]) || isnan(known[t]) || share_node(&type->side[s], &type->side[t]))
                continue;
            normal_of(one, model, (uz_face){e, s});
            normal_of(other, model, (uz_face){e, t});
            if (uz_dot3(one, other) > -OPPOSITE)
                continue;
            if (!(volume > 0))
                volume = mean_stress(stress, model, group, lane);
            for (int c = 0; c < 3; c++)
                one[c] -= other[c];
            uz_unit3(one);
            for (int c = 0; c < n; c++)
                across += (axes[c][0] == axes[c][1] ? 1 : 2) * one[axes[c][0]] * one[axes[c][1]] * stress[c];
            for (int c = 0; c < n; c++)
                off[c] += (across - 0.5 * (known[s] + known[t])) * one[axes[c][0]] * one[axes[c][1]];
        }
    return volume > 0 ? volume * uz_stress_work(model->kind, *group->lame[lane], off) : 0;
}
