/* error_estimate.c: how much of the energy the mesh has missed.
 *
 * The stress of a finite element solution jumps from element to element; averaged at the nodes and interpolated, it is
 * closer to the true stress than the solution's own. The energy of the difference,
 *     eta^2 = integral of (s* - s_h)' C^-1 (s* - s_h) over the volume,
 * estimates the squared energy-norm error of u_h, and ||u||^2 is estimated by ||u_h||^2 + eta^2 (Galerkin
 * orthogonality). Stresses may jump where the material changes: there each material has its own average.
 *
 * Elements are taken a few at a time, those of one kind together, in whatever order that gives. */
#include "assembly/parts.h"

#include "assembly/stress_lanes.h"
#include "core/alloc.h"
#include "scene/mesh.h"

#include <math.h>
#include <stdlib.h>

enum { LANES = UZ_STRAIN_LANES };

/* Averages: one place for each node and material that meet there. */
typedef struct {
    uz_strain_source from;
    int64_t *place; /* of each node of each element; NULL: the place is the node */
    int64_t count;
    int size;                /* of a row */
    double *rows;            /* count x size, see uz_stress_rows_add */
    uz_strain_group *groups; /* one for each kind */
    bool averaged;           /* what groups are for: false the averages, true the energies */
    double eta2, energy2;
} averaging;

static void finish_group(averaging *x, uz_strain_group *g)
{
    const int64_t *place[LANES];
    if (g->count == 0)
        return;
    uz_strain_group_load(g, &x->from);
    for (int l = 0; l < LANES; l++)
        place[l] = x->place ? x->place + x->from.model->mesh.first[g->element[l]] : g->node[l];
    if (x->averaged)
        uz_stress_rows_compare(&x->eta2, &x->energy2, x->rows, g, place);
    else
        uz_stress_rows_add(x->rows, g, place);
    g->count = 0;
}

static void begin_group(averaging *x, uz_strain_group *g, uz_element_kind kind, uz_formulation formulation)
{
    finish_group(x, g);
    uz_strain_rule_init(&g->rule, kind, x->from.model->kind, formulation);
    g->begun = true;
    g->shaped = false;
}

/* The group that has the element's kind; only the last material's formulation is known to it. */
static uz_strain_group *group_of(averaging *x, int64_t e)
{
    const uz_body_model *model = x->from.model;
    const uz_element_kind kind = (uz_element_kind)model->mesh.kind[e];
    uz_strain_group *g = &x->groups[kind];
    if (g->begun && !model->material_of)
        return g;
    const uz_formulation formulation = uz_element_formulation(model, e);
    if (!g->begun || formulation != g->rule.formulation)
        begin_group(x, g, kind, formulation);
    return g;
}

static void pass(averaging *x)
{
    for (int64_t e = 0; e < x->from.model->mesh.n_elements; e++) {
        uz_strain_group *g = group_of(x, e);
        g->element[g->count++] = e;
        if (g->count == LANES)
            finish_group(x, g);
    }
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        finish_group(x, &x->groups[kind]);
}

static void divide(averaging *x)
{
    const int n = uz_stress_count(x->from.model->kind);
    for (int64_t a = 0; a < x->count; a++) {
        double *row = x->rows + a * x->size;
        const double scale = row[n] > 0 ? 1 / row[n] : 0;
        for (int c = 0; c < n; c++)
            row[c] *= scale;
    }
}

/* Numbers the pairs of node and material. next, material: of each pair; head: the first pair of a node, -1: none. */
static void number_places(averaging *x, int64_t *head, int64_t *next, int32_t *material)
{
    const uz_mesh *mesh = &x->from.model->mesh;
    x->count = 0;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        head[a] = -1;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e]; i < mesh->first[e + 1]; i++) {
            const int32_t own = x->from.model->material_of[e];
            int64_t at = head[mesh->node[i]];
            while (at >= 0 && material[at] != own)
                at = next[at];
            if (at < 0) {
                at = x->count++;
                material[at] = own;
                next[at] = head[mesh->node[i]];
                head[mesh->node[i]] = at;
            }
            x->place[i] = at;
        }
}

static bool make_places(averaging *x)
{
    const uz_mesh *mesh = &x->from.model->mesh;
    const int64_t most = mesh->n_elements > 0 ? mesh->first[mesh->n_elements] : 0;
    x->count = mesh->n_nodes;
    if (!x->from.model->material_of)
        return true;
    x->place = uz_alloc(most, sizeof *x->place);
    int64_t *head = uz_alloc(mesh->n_nodes, sizeof *head), *next = uz_alloc(most, sizeof *next);
    int32_t *material = uz_alloc(most, sizeof *material);
    const bool ok = x->place && head && next && material;
    if (ok)
        number_places(x, head, next, material);
    free(head);
    free(next);
    free(material);
    return ok;
}

static bool make_rows(averaging *x)
{
    x->size = uz_stress_row_size(x->from.model->kind);
    x->groups = uz_alloc_zero(UZ_ELEMENT_KINDS, sizeof *x->groups);
    if (!x->groups || !make_places(x))
        return false;
    x->rows = uz_alloc_zero(x->count * x->size, sizeof *x->rows);
    return x->rows != NULL;
}

static double estimate(averaging *x)
{
    if (make_rows(x)) {
        pass(x);
        divide(x);
        x->averaged = true;
        pass(x);
    }
    free(x->groups);
    free(x->place);
    free(x->rows);
    return x->energy2 > 0 ? sqrt(x->eta2 / (x->energy2 + x->eta2)) : NAN;
}

double uz_estimate_discretization_error(const uz_body_model *model, const double *nodal)
{
    averaging x = {.from = {.model = model, .nodal = nodal}};
    return estimate(&x);
}

double uz_estimate_mesh_error(const uz_body_model *model, const uz_scene *scene, const double *nodal)
{
    double *free_strain = NULL;
    if (uz_free_strains(&free_strain, model, scene, NULL) != UZ_OK)
        return NAN;
    averaging x = {.from = {.model = model, .nodal = nodal, .free_strain = free_strain}};
    const double error = estimate(&x);
    free(free_strain);
    return error;
}
