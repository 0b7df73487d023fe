/* nodal_strains.c: the one recovery of strains at nodes, for fields (post/recover.c) and the estimate of the mesh's
 * error (error_estimate.c).
 *
 * Derivatives of a finite element solution are most accurate at certain points of each element (Barlow, Int. J. Numer.
 * Meth. Engng 10 (1976) 243-251), the samples of its type. What they say is continued to the nodes and averaged there
 * by volume. Fields continue the whole polynomial through the samples: it is the most accurate. The estimate, which
 * compares the averages with the solution's own stress, must not take over more of it than is accurate: near a corner
 * whose stress is singular, products of coordinates bring the solution's error back into the average and hide it
 * (docs/theory.md has both ways in figures). */
#include "assembly/nodal_strains.h"

#include "assembly/stress_lanes.h"
#include "core/alloc.h"
#include "core/error.h"
#include "scene/mesh.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    uz_nodal_strains *out;
    const uz_body_model *model;
    uz_continuation how;
    double share[UZ_ELEMENT_KINDS][UZ_ELEMENT_NODES][UZ_ELEMENT_SAMPLES];
} recovery;

/* Numbers the pairs of node and material. next: of each pair the one before at its node; head: the last pair of a node,
 * -1: none. */
static void number_places(uz_nodal_strains *out, const uz_body_model *model, int64_t *head, int64_t *next)
{
    const uz_mesh *mesh = &model->mesh;
    out->count = 0;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        head[a] = -1;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e]; i < mesh->first[e + 1]; i++) {
            const int64_t node = mesh->node[i];
            int64_t at = head[node];
            while (at >= 0 && out->material[at] != model->material_of[e])
                at = next[at];
            if (at < 0) {
                at = out->count++;
                out->material[at] = model->material_of[e];
                out->node[at] = node;
                next[at] = head[node];
                head[node] = at;
            }
            out->of[i] = at;
        }
}

static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    recovery *r = ctx;
    double point[UZ_ELEMENT_SAMPLES][3];
    const uz_element_type *type = uz_element_type_of(kind);
    int count = type->recover(point, r->share[kind], kind);
    if (r->how == UZ_CONTINUE_LINEAR) {
        if (type->nodes == type->corners && formulation != UZ_FORMULATION_INCOMPATIBLE) {
            memcpy(point[0], type->centre, sizeof point[0]);
            count = 1;
        }
        for (int a = 0; a < type->nodes; a++)
            r->share[kind][a][0] = 1;
    }
    uz_strain_rule_at(rule, kind, r->model->kind, formulation, (const double(*)[3])point, NULL, count);
}

static void add_group(void *ctx, const uz_strain_group *group)
{
    recovery *r = ctx;
    const int64_t *place[UZ_STRAIN_LANES];
    const bool shared = r->how == UZ_CONTINUE_WHOLE || group->rule.asked == 1;
    uz_nodal_places(place, r->out, group, &r->model->mesh);
    uz_strain_rows_add(r->out->rows, r->out->size, group, place,
                       shared ? (const double(*)[UZ_ELEMENT_SAMPLES])r->share[group->rule.kind] : NULL);
}

/* At hanging nodes what those make of it that they lie amid: an average over the elements that have a hanging node
 * would be one of one side of it alone, and off by as much as the strain changes along half of an element. head, next:
 * as of number_places. */
static void follow(uz_nodal_strains *out, const uz_mesh *mesh, const int64_t *head, const int64_t *next)
{
    for (int64_t i = 0; i < out->count; i++) {
        const int64_t node = out->of ? out->node[i] : i, *from;
        const double *share;
        double *row = out->rows + i * out->size;
        const int count = uz_mesh_hangs(mesh, node) ? uz_mesh_amid(&from, &share, mesh, node) : 0;
        for (int c = 0; c < out->size && count > 0; c++)
            row[c] = c == out->strains ? row[c] : 0;
        for (int k = 0; k < count; k++) {
            int64_t at = out->of ? head[from[k]] : from[k]; /* elements of one material around both have its place */
            while (out->of && at >= 0 && out->material[at] != out->material[i])
                at = next[at];
            for (int c = 0; c < out->size && at >= 0; c++)
                row[c] += c == out->strains ? 0 : share[k] * out->rows[at * out->size + c];
        }
    }
}

uz_status uz_nodal_strains_recover(uz_nodal_strains *out, const uz_strain_source *from, uz_continuation how,
                                   const uz_hooks *hooks, uz_error *err)
{
    const uz_body_model *model = from->model;
    const uz_mesh *mesh = &model->mesh;
    const int64_t most = mesh->n_elements > 0 ? mesh->first[mesh->n_elements] : 0;
    int64_t *head = NULL, *next = NULL;
    memset(out, 0, sizeof *out);
    out->count = mesh->n_nodes;
    out->strains = uz_stress_count(model->kind);
    out->size = out->strains == 3 && !from->free_strain ? 4 : 8;
    bool ok = true;
    if (model->material_of) {
        out->of = uz_alloc(most, sizeof *out->of);
        out->node = uz_alloc(most, sizeof *out->node);
        out->material = uz_alloc(most, sizeof *out->material);
        head = uz_alloc(mesh->n_nodes, sizeof *head);
        next = uz_alloc(most, sizeof *next);
        ok = out->of && out->node && out->material && head && next;
        if (ok)
            number_places(out, model, head, next);
    }
    out->rows = ok ? uz_alloc_zero(out->count * out->size, sizeof *out->rows) : NULL;
    recovery *r = out->rows ? uz_alloc(1, sizeof *r) : NULL;
    if (!r) {
        free(head);
        free(next);
    }
    if (!r)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the strain at %lld nodes", (long long)mesh->n_nodes);
    r->out = out;
    r->model = model;
    r->how = how;
    const uz_strain_work work = {make_rule, add_group, r};
    const uz_status status = uz_strain_groups(&work, from, hooks, err);
    free(r);
    for (int64_t i = 0; status == UZ_OK && i < out->count; i++) {
        double *row = out->rows + i * out->size;
        const double scale = row[out->strains] > 0 ? 1 / row[out->strains] : 0;
        for (int c = 0; c < out->size; c++)
            row[c] *= c == out->strains ? 1 : scale;
    }
    if (status == UZ_OK && mesh->hangs)
        follow(out, mesh, head, next);
    free(head);
    free(next);
    return status;
}

void uz_nodal_strains_clear(uz_nodal_strains *strains)
{
    free(strains->of);
    free(strains->node);
    free(strains->material);
    free(strains->rows);
    memset(strains, 0, sizeof *strains);
}

void uz_nodal_places(const int64_t *place[UZ_STRAIN_LANES], const uz_nodal_strains *strains,
                     const uz_strain_group *group, const uz_mesh *mesh)
{
    for (int l = 0; l < UZ_STRAIN_LANES; l++)
        place[l] = strains->of ? strains->of + mesh->first[group->element[l]] : group->node[l];
}
