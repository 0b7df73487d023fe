#include "assembly/strain_group.h"

#include "core/alloc.h"
#include "core/cpu.h"
#include "core/error.h"
#include "core/hooks.h"
#include "scene/mesh.h"

#include <stdlib.h>
#include <string.h>

enum { LANES = UZ_STRAIN_LANES };

UZ_INLINE void take_material(uz_strain_group *g, const uz_strain_source *from)
{
    const uz_lame **lame = g->lame;
    if (g->alike && !from->free_strain)
        return;
    g->alike = !from->model->material_of;
    g->general = false;
    for (int l = 0; l < LANES; l++) {
        lame[l] = &uz_element_material(from->model, g->element[l])->lame;
        g->general = g->general || lame[l]->general;
    }
    g->material.lambda = (uz_lanes){lame[0]->lambda, lame[1]->lambda, lame[2]->lambda, lame[3]->lambda};
    g->material.mu = (uz_lanes){lame[0]->mu, lame[1]->mu, lame[2]->mu, lame[3]->mu};
    g->free_strain = g->thermal = (uz_lanes){0};
    for (int l = 0; l < LANES && from->free_strain; l++) {
        double strain[UZ_ELEMENT_STRESSES];
        uz_thermal_strain(strain, from->model->kind, *lame[l], from->free_strain[g->element[l]]);
        g->free_strain[l] = from->free_strain[g->element[l]];
        g->thermal[l] = strain[0];
    }
}

typedef double two __attribute__((vector_size(16), aligned(8), may_alias));

/* Values (n_nodes x dim) at the nodes of the elements: two of a node at once, then those of the elements side by side.
 */
UZ_INLINE void gather(uz_lanes *out, const uz_strain_group *g, const double *value, int dim)
{
    for (int a = 0; a < g->rule.nodes; a++) {
        const double *const at[LANES] = {value + g->node[0][a] * dim, value + g->node[1][a] * dim,
                                         value + g->node[2][a] * dim, value + g->node[3][a] * dim};
        const uz_lanes even = __builtin_shufflevector(*(const two *)at[0], *(const two *)at[2], 0, 1, 2, 3),
                       odd = __builtin_shufflevector(*(const two *)at[1], *(const two *)at[3], 0, 1, 2, 3);
        *out++ = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
        *out++ = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
        if (dim == 3)
            *out++ = (uz_lanes){at[0][2], at[1][2], at[2][2], at[3][2]};
    }
}

/* Incompatible modes take the shape of least energy, which has to do with directions: one element after the other. */
static void strains_of_each(uz_strain_group *g, const uz_body_model *model)
{
    for (int l = 0; l < LANES; l++) {
        double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], strain[UZ_ELEMENT_STRESSES];
        uz_element element;
        uz_element_motion motion;
        uz_body_element(&element, xyz, model, g->element[l]);
        for (int i = 0; i < g->rule.nodes * g->rule.dim; i++)
            u[i] = g->u[i][l];
        uz_element_move(&motion, &element, u);
        for (int p = 0; p < g->rule.points; p++) {
            uz_element_strain(strain, &motion, g->rule.point[p]);
            for (int c = 0; c < g->rule.stresses; c++)
                g->strain[p][c][l] = strain[c];
        }
    }
}

/* What the rotation leaves by rounding is eps of its square, while the strain beside it may be a millionth of it.
 * Minimizes sum |u_a - w x x_a|^2, with x and u from the first node. */
UZ_INLINE void take_unrotated(uz_strain_group *g, int dim)
{
    uz_lanes x[UZ_ELEMENT_NODES][3] = {{{0}}}, J[3][3] = {{{0}}}, w[3] = {{0}};
    for (int a = 1; a < g->rule.nodes; a++) {
        uz_lanes u[3] = {{0}};
        for (int c = 0; c < dim; c++) {
            x[a][c] = g->x[a * dim + c] - g->x[c];
            u[c] = g->u[a * dim + c];
        }
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            J[i][i] += x[a][j] * x[a][j] + x[a][k] * x[a][k];
            J[i][j] = J[j][i] -= x[a][i] * x[a][j];
            w[i] += x[a][j] * u[k] - x[a][k] * u[j];
        }
    }
    for (int i = dim == 3 ? 0 : 2; i < 3; i++) /* elimination; in the plane the third axis stands alone */
        for (int k = i + 1; k < 3; k++) {
            const uz_lanes factor = J[k][i] / J[i][i];
            for (int j = i; j < 3; j++)
                J[k][j] -= factor * J[i][j];
            w[k] -= factor * w[i];
        }
    for (int i = 2; i >= 0; i--) {
        for (int j = i + 1; j < 3; j++)
            w[i] -= J[i][j] * w[j];
        w[i] = dim == 3 || i == 2 ? w[i] / J[i][i] : (uz_lanes){0};
    }
    for (int a = 1; a < g->rule.nodes; a++)
        for (int c = 0; c < dim; c++)
            g->u[a * dim + c] -= w[(c + 1) % 3] * x[a][(c + 2) % 3] - w[(c + 2) % 3] * x[a][(c + 1) % 3];
}

UZ_INLINE void load(uz_strain_group *g, const uz_strain_source *from, int dim)
{
    const uz_mesh *mesh = &from->model->mesh;
    for (int l = 0; l < LANES; l++) {
        if (l >= g->count)
            g->element[l] = g->element[0];
        g->node[l] = mesh->node + mesh->first[g->element[l]];
    }
    take_material(g, from);
    gather(g->u, g, from->nodal, dim);
    for (int c = from->model->kind == UZ_AXISYMMETRIC; c < dim && from->apart; c++) {
        const uz_lanes first = g->u[c];
        for (int a = 0; a < g->rule.nodes; a++)
            g->u[a * dim + c] -= first;
    }
    if (!g->shaped) {
        const bool equal = mesh->uniform && from->model->kind != UZ_AXISYMMETRIC;
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES];
        if (equal)
            uz_body_element(&element, xyz, from->model, g->element[0]);
        else
            gather(g->x, g, mesh->xyz, dim);
        for (int i = 0; equal && i < g->rule.nodes * dim; i++)
            g->x[i] = xyz[i] - (uz_lanes){0};
        if (!g->rule.simplex || from->large)
            uz_lane_shape_of(&g->shape, &g->rule, g->x, from->model->thickness);
        g->shaped = equal;
    }
    if (from->unrotated && from->model->kind != UZ_AXISYMMETRIC)
        take_unrotated(g, dim);
    if (from->large)
        uz_lane_green_strains(g->strain, &g->rule, &g->shape, g->u, from->by_volume);
    else if (g->rule.simplex)
        uz_lane_simplex(&g->shape, g->strain[0], &g->rule, g->x, g->u, from->model->thickness);
    else if (!g->general || g->rule.formulation != UZ_FORMULATION_INCOMPATIBLE)
        uz_lane_strains(g->strain, &g->rule, &g->shape, &g->material, g->u);
    else
        strains_of_each(g, from->model);
}

UZ_INLINE void load_in_space(uz_strain_group *g, const uz_strain_source *from)
{
    if (g->rule.dim == 2)
        load(g, from, 2);
    else
        load(g, from, 3);
}

UZ_AVX2_FMA static void load_fused(uz_strain_group *g, const uz_strain_source *from)
{
    load_in_space(g, from);
}

void uz_strain_group_load(uz_strain_group *group, const uz_strain_source *from)
{
    (uz_cpu_has_avx2_fma() ? load_fused : load_in_space)(group, from);
}

static void finish(uz_strain_group *g, const uz_strain_work *work, const uz_strain_source *from)
{
    if (g->count == 0)
        return;
    uz_strain_group_load(g, from);
    work->take(work->ctx, g);
    g->count = 0;
}

uz_status uz_strain_groups(const uz_strain_work *work, const uz_strain_source *from, const uz_hooks *hooks,
                           uz_error *err)
{
    enum { BETWEEN_QUESTIONS = 1024 };
    const uz_body_model *model = from->model;
    const uz_mesh *mesh = &model->mesh;
    uz_strain_group *groups = uz_alloc(UZ_ELEMENT_KINDS, sizeof *groups); /* one for each kind, which are large */
    if (!groups)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the strains of %lld elements",
                       (long long)mesh->n_elements);
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        groups[kind].begun = false;
        groups[kind].count = 0;
    }
    const int64_t end = from->end > 0 ? from->end : mesh->n_elements;
    for (int64_t e = from->begin; e < end; e++) {
        const uz_element_kind kind = (uz_element_kind)mesh->kind[e];
        uz_strain_group *g = &groups[kind];
        if (e % BETWEEN_QUESTIONS == 0 && uz_cancelled(hooks)) {
            free(groups);
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled while strains were computed");
        }
        if (!g->begun || model->material_of) {
            const uz_formulation formulation = uz_element_formulation(model, e);
            if (!g->begun || formulation != g->rule.formulation) {
                finish(g, work, from);
                if (!g->begun)
                    memset(g, 0, sizeof *g);
                work->rule(work->ctx, &g->rule, kind, formulation);
                g->begun = true;
                g->shaped = g->alike = false;
            }
        }
        g->element[g->count++] = e;
        if (g->count == LANES)
            finish(g, work, from);
    }
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        finish(&groups[kind], work, from);
    free(groups);
    return UZ_OK;
}
