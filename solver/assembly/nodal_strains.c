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
#include "linalg/pieces.h"
#include "scene/mesh.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    uz_nodal_strains *out;
    const uz_body_model *model;
    uz_continuation how;
    unsigned char *seen; /* NULL, or by place: 1 where there is one element, 2 where there are more */
    double share[UZ_ELEMENT_KINDS][UZ_ELEMENT_NODES][UZ_ELEMENT_SAMPLES];
} recovery;

/* The constants that strains and stresses depend on, and whose. */
typedef struct {
    double constant[4];
    const uz_anisotropy *general; /* of a material with directions: what it has in place of the first two */
    int32_t material;
} constants;

static int compare_constants(const constants *x, const constants *y)
{
    for (int i = 0; i < 4; i++)
        if (x->constant[i] != y->constant[i])
            return x->constant[i] < y->constant[i] ? -1 : 1;
    return x->general && y->general ? memcmp(x->general, y->general, sizeof *x->general) : !y->general - !x->general;
}

static int by_constants(const void *a, const void *b)
{
    const constants *x = a, *y = b;
    const int order = compare_constants(x, y);
    return order ? order : x->material < y->material ? -1 : 1;
}

/* alike (n_materials): the first material of the same constants, as what it is called makes no strain jump. */
static bool find_alike(int32_t *alike, const uz_body_model *model)
{
    const int64_t n = model->n_materials;
    constants *list = uz_alloc(n, sizeof *list);
    for (int64_t k = 0; k < n && list; k++) {
        const uz_body_material *m = &model->materials[k];
        const uz_lame *lame = &m->lame;
        list[k] =
            (constants){{lame->general ? 0 : lame->lambda, lame->general ? 0 : lame->mu, m->expansion, (double)m->law},
                        lame->general,
                        (int32_t)k};
    }
    if (list)
        qsort(list, (size_t)n, sizeof *list, by_constants);
    for (int64_t k = 0; k < n && list; k++) {
        const bool same = k > 0 && compare_constants(&list[k], &list[k - 1]) == 0;
        alike[list[k].material] = same ? alike[list[k - 1].material] : list[k].material;
    }
    free(list);
    return list != NULL;
}

/* Numbers the pairs of node and material. next: of each pair the one before at its node; head: the last pair of a node,
 * -1: none. alike: as of find_alike. */
static void number_places(uz_nodal_strains *out, const uz_body_model *model, const int32_t *alike, int64_t *head,
                          int64_t *next)
{
    const uz_mesh *mesh = &model->mesh;
    out->count = 0;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        head[a] = -1;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e]; i < mesh->first[e + 1]; i++) {
            const int64_t node = mesh->node[i];
            const int32_t material = alike[model->material_of[e]];
            int64_t at = head[node];
            while (at >= 0 && out->material[at] != material)
                at = next[at];
            if (at < 0) {
                at = out->count++;
                out->material[at] = material;
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
    for (int l = 0; l < group->count && r->seen; l++)
        for (int a = 0; a < group->rule.nodes; a++)
            r->seen[place[l][a]] = r->seen[place[l][a]] ? 2 : 1;
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

/* A triangle, tetrahedron or wedge that is alone at its nodes, with its material, differs from no mean: nothing shows
 * what it errs by. It is compared with what an element of one degree less has: quadratic ones with the mean of their
 * strain, linear ones with none. (Quadrilaterals and hexahedra have products of coordinates that no mean takes over.)
 * seen: of the recovery. */
static void lower_alone(uz_nodal_strains *out, const unsigned char *seen, const uz_body_model *model,
                        const double *free_strain)
{
    const uz_mesh *mesh = &model->mesh;
    const int64_t *const of = out->of ? out->of : mesh->node;
    bool any = false;
    for (int64_t i = 0; i < out->count && !any; i++)
        any = seen[i] == 1;
    for (int64_t e = 0; e < mesh->n_elements && any; e++) {
        const int64_t *place = of + mesh->first[e];
        if (seen[place[0]] != 1)
            continue;
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        double mean[UZ_ELEMENT_STRESSES] = {0};
        bool alone = (1 << type->dim) != type->corners;
        for (int a = 0; a < type->nodes && alone; a++)
            alone = seen[place[a]] == 1;
        if (!alone)
            continue;
        if (type->nodes == type->corners && free_strain)
            uz_thermal_strain(mean, model->kind, uz_element_material(model, e)->lame, free_strain[e]);
        for (int a = 0; a < type->corners && type->nodes > type->corners; a++)
            for (int c = 0; c < out->strains; c++)
                mean[c] += out->rows[place[a] * out->size + c] / type->corners;
        for (int a = 0; a < type->nodes; a++)
            memcpy(out->rows + place[a] * out->size, mean, (size_t)out->strains * sizeof *mean);
    }
}

static void divide_by_volume(void *ctx, int64_t begin, int64_t end)
{
    const uz_nodal_strains *of = ctx;
    for (int64_t i = begin; i < end; i++) {
        double *row = of->rows + i * of->size, volume = row[of->strains];
        const double scale = volume > 0 ? 1 / volume : 0;
        for (int c = 0; c < of->size; c++)
            row[c] *= scale;
        row[of->strains] = volume;
    }
}

uz_status uz_nodal_strains_recover(uz_nodal_strains *out, const uz_strain_source *from, uz_continuation how,
                                   const uz_hooks *hooks, uz_error *err)
{
    const uz_body_model *model = from->model;
    const uz_mesh *mesh = &model->mesh;
    const int64_t most = mesh->n_elements > 0 ? mesh->first[mesh->n_elements] : 0;
    int64_t *head = NULL, *next = NULL;
    int32_t *alike = NULL;
    unsigned char *seen = NULL;
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
        alike = uz_alloc(model->n_materials, sizeof *alike);
        ok = out->of && out->node && out->material && head && next && alike && find_alike(alike, model);
        if (ok)
            number_places(out, model, alike, head, next);
    }
    free(alike);
    out->rows = ok ? uz_alloc_zero(out->count * out->size, sizeof *out->rows) : NULL;
    recovery *r = out->rows ? uz_alloc(1, sizeof *r) : NULL;
    if (r && how == UZ_CONTINUE_LINEAR)
        seen = uz_alloc_zero(out->count, 1);
    if (!r || (how == UZ_CONTINUE_LINEAR && !seen)) {
        uz_free_all(head, next, r);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the strain at %lld nodes", (long long)mesh->n_nodes);
    }
    r->out = out;
    r->model = model;
    r->how = how;
    r->seen = seen;
    const uz_strain_work work = {make_rule, add_group, r};
    const uz_status status = uz_strain_groups(&work, from, hooks, err);
    free(r);
    if (status == UZ_OK)
        uz_by_pieces(divide_by_volume, out, out->count);
    if (status == UZ_OK && seen && mesh->n_elements > 0)
        lower_alone(out, seen, model, from->free_strain);
    if (status == UZ_OK && mesh->hangs)
        follow(out, mesh, head, next);
    uz_free_all(seen, head, next);
    return status;
}

void uz_nodal_strains_clear(uz_nodal_strains *strains)
{
    uz_free_all(strains->of, strains->node, strains->material, strains->rows);
    memset(strains, 0, sizeof *strains);
}

void uz_nodal_places(const int64_t *place[UZ_STRAIN_LANES], const uz_nodal_strains *strains,
                     const uz_strain_group *group, const uz_mesh *mesh)
{
    for (int l = 0; l < UZ_STRAIN_LANES; l++)
        place[l] = strains->of ? strains->of + mesh->first[group->element[l]] : group->node[l];
}
