/* error_estimate.c: how much of the energy the mesh has missed.
 *
 * The stress of a finite element solution jumps from element to element; averaged at the nodes and interpolated, it is
 * closer to the true stress than the solution's own. The energy of the difference,
 *     eta^2 = integral of (s* - s_h)' C^-1 (s* - s_h) over the volume,
 * estimates the squared energy-norm error of u_h, and ||u||^2 is estimated by ||u_h||^2 + eta^2 (Galerkin
 * orthogonality). */
#include "assembly/parts.h"

#include "assembly/body_parts.h"
#include "assembly/nodal_strains.h"
#include "assembly/stress_lanes.h"
#include "assembly/thin_elements.h"
#include "core/alloc.h"
#include "core/vector3.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uz_body_model *model;
    uz_nodal_strains nodal; /* rows: stresses, once they are recovered */
    uz_stress_sums sums;
} estimate;

void uz_energy_rule(uz_strain_rule *rule, uz_element_kind kind, uz_model model, uz_formulation formulation)
{
    const uz_gauss_rule *energy = &uz_element_type_of(kind)->energy;
    double point[UZ_ELEMENT_GAUSS][3], weight[UZ_ELEMENT_GAUSS];
    for (int g = 0; g < energy->count; g++) {
        memcpy(point[g], energy->point[g].at, sizeof point[g]);
        weight[g] = energy->point[g].weight;
    }
    uz_strain_rule_at(rule, kind, model, formulation, (const double(*)[3])point, weight, energy->count);
}

/* Of simplices one point, where their strain is known (stress_lanes.c). */
static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    const uz_model model = ((const estimate *)ctx)->model->kind;
    uz_strain_rule_at(rule, kind, model, formulation, &uz_element_type_of(kind)->centre, NULL, 1);
    if (!rule->simplex)
        uz_energy_rule(rule, kind, model, formulation);
}

static void compare(void *ctx, const uz_strain_group *group)
{
    estimate *x = ctx;
    const int64_t *place[UZ_STRAIN_LANES];
    uz_nodal_places(place, &x->nodal, group, &x->model->mesh);
    uz_stress_rows_compare(&x->sums, x->nodal.rows, x->nodal.size, group, place);
}

/* Of the means at nodes, from what they are means of. */
static void find_stresses(void *ctx, int64_t begin, int64_t end)
{
    const estimate *x = ctx;
    const uz_nodal_strains *nodal = &x->nodal;
    const int n = nodal->strains;
    for (int64_t i = begin; i < end; i++) {
        const uz_lame lame = x->model->materials[nodal->material ? nodal->material[i] : 0].lame;
        double *row = nodal->rows + i * nodal->size, thermal[UZ_ELEMENT_STRESSES];
        if (nodal->size > n + 1 && row[n + 1] != 0) {
            uz_thermal_strain(thermal, x->model->kind, lame, row[n + 1]);
            for (int c = 0; c < n; c++)
                row[c] -= thermal[c];
        }
        uz_elastic_stress(row, x->model->kind, lame, row);
    }
}

/* The integrals of both stresses, added to the sums. */
static uz_status integrate(uz_stress_sums *sums, const uz_strain_source *from, uz_error *err)
{
    const uz_body_model *model = from->model;
    estimate x = {.model = model, .sums = *sums};
    const uz_strain_work work = {make_rule, compare, &x};
    uz_status status = uz_nodal_strains_recover(&x.nodal, from, UZ_CONTINUE_LINEAR, NULL, err);
    if (status == UZ_OK)
        uz_by_pieces(find_stresses, &x, x.nodal.count);
    if (status == UZ_OK)
        status = uz_strain_groups(&work, from, NULL, err);
    uz_nodal_strains_clear(&x.nodal);
    *sums = x.sums;
    return status;
}

uz_status uz_mesh_error_energy(double *energy, double *eta2, const uz_body_model *model, const double *free_strain,
                               const double *nodal, uz_error *err)
{
    uz_stress_sums sums = {.eta2_of = eta2};
    const uz_strain_source from = {.model = model, .nodal = nodal, .free_strain = free_strain};
    const uz_status status = integrate(&sums, &from, err);
    *energy = sums.eta2;
    return status;
}

/* Strain that makes stress, in parts of the whole, that is not told from rounding and what the equations left. */
#define FREE 1e-7

/* What solves leave of the way of a body that is only carried along, in parts of it. */
#define CARRIED 1e-12
/* What is a translation to that may be strained by a few times as much. */
#define STRAINED_BY 10

/* Where rows press, in a rotation: what solves leave is then no more than rounding makes of a strain, and more is one.
 */
#define ROUNDED (64 * DBL_EPSILON)

/* What supports hold apart by more than this part of their way is no rounding of what they were given. */
#define APART (4 * DBL_EPSILON)

/* Motion that differs by less than this part between nodes: strain may have lost digits that count. */
#define ALIKE 1e-6

/* Energy of an element whose strain is that part of the way of its nodes over its least extent, and twice what it has;
 * of rings the way is that along the axis, as the other one strains them. */
static double energy_of_way(double *own, const uz_body_model *model, const double *nodal, int64_t e, double part)
{
    const int dim = model->mesh.dim, ring = model->kind == UZ_AXISYMMETRIC;
    const int corners = uz_element_type_of((uz_element_kind)model->mesh.kind[e])->corners;
    double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], way = 0, least = INFINITY;
    int count;
    const int64_t *node = uz_mesh_element(&model->mesh, e, &count);
    uz_element element;
    uz_body_element(&element, xyz, model, e);
    for (int i = 0; i < count * dim; i++) {
        u[i] = nodal[node[i / dim] * dim + i % dim];
        way = i % dim >= ring ? fmax(way, fabs(u[i])) : way;
    }
    for (int a = 0; a < corners; a++)
        for (int b = 0; b < a; b++)
            least = fmin(least, uz_distance2(xyz + a * dim, xyz + b * dim, dim));
    const double strain = part * way / sqrt(least);
    *own = 2 * uz_element_strain_energy(&element, u);
    return uz_most_stiffness(element.lame) * uz_element_volume(&element) * strain * strain;
}

/* Has each element no more than that? So it is of a body that is only rotated. */
static bool is_carried(const uz_body_model *model, const double *nodal, double part)
{
    bool carried = true;
    for (int64_t e = 0; e < model->mesh.n_elements && carried; e++) {
        double own;
        const double most = energy_of_way(&own, model, nodal, e, part);
        carried = own <= most;
    }
    return carried;
}

/* What rounding of displacements makes of strains, in twice the energy. */
static double energy_of_rounding(const uz_body_model *model, const double *nodal)
{
    double sum = 0, own;
    for (int64_t e = 0; e < model->mesh.n_elements; e++)
        sum += energy_of_way(&own, model, nodal, e, DBL_EPSILON);
    return sum;
}

/* But for a part of its way. It strains nothing, unless along the radius of rings: what its strains come to is
 * rounding. */
static bool is_translation(const uz_body_model *model, const double *nodal, double part)
{
    const int dim = model->mesh.dim;
    double way = 0;
    for (int c = 0; c < dim; c++)
        way = fmax(way, fabs(nodal[c]));
    bool so = model->kind != UZ_AXISYMMETRIC || fabs(nodal[0]) <= part * way;
    for (int64_t i = dim; i < model->mesh.n_nodes * dim && so; i++)
        so = fabs(nodal[i] - nodal[i % dim]) <= part * way;
    return so;
}

/* Is node a of a rigid group other than the node that has its translation, or may the group turn? */
static bool goes_along(const uz_body_model *model, int64_t a)
{
    const uz_rigid_group *group = uz_rigid_group_of(model, a);
    const int dim = model->mesh.dim;
    bool so = group && group->anchor[0] != a;
    for (int c = 0; c < dim && group && group->anchor[1] >= 0; c++)
        so = so || model->dof[group->anchor[1] * dim + c] >= 0;
    return so;
}

/* A part of the body: is it only translated, and what the first node that is held has, by axis or in all. */
typedef struct {
    const double *any, *first[3], *whole, *from;
    bool shifted;
} held_part;

/* list (parts->count, zeroed): which are translations; returns whether all are. */
static bool find_shifted(held_part *list, const uz_parts *parts, const uz_body_model *model, const double *nodal)
{
    const int dim = model->mesh.dim;
    bool all = true;
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        held_part *p = &list[parts->of[a]];
        const double *u = nodal + a * dim;
        double way = 0;
        p->shifted = p->any ? p->shifted : true;
        p->any = p->any ? p->any : u;
        for (int c = 0; c < dim; c++)
            way = fmax(way, fabs(p->any[c]));
        for (int c = 0; c < dim; c++)
            p->shifted = p->shifted && fabs(u[c] - p->any[c]) <= CARRIED * way;
        p->shifted = p->shifted && (model->kind != UZ_AXISYMMETRIC || fabs(u[0]) <= CARRIED * way);
        all = all && p->shifted;
    }
    return all;
}

/* Is a node held farther from the first one of its part than rounding may? */
static bool is_held_apart(held_part *p, const uz_body_model *model, const double *nodal, int64_t a, bool large)
{
    const int dim = model->mesh.dim;
    const double *u = nodal + a * dim, *x = model->mesh.xyz + a * dim;
    double way = 0, along = 0, length2 = 0, motion2 = 0;
    bool all = true;
    if ((uz_is_rigid(model, a) && !p->shifted) || goes_along(model, a) || uz_node_frame(model, a))
        return false;
    for (int c = 0; c < dim; c++) {
        const int64_t j = model->dof[a * dim + c];
        const bool held = j < 0 && j != UZ_NO_DOF;
        all = all && held;
        if (held && !p->first[c])
            p->first[c] = u;
        if (held && p->shifted && fabs(u[c] - p->first[c][c]) > APART * fabs(u[c]))
            return true;
    }
    if (!all || p->shifted)
        return false;
    p->whole = p->whole ? p->whole : u;
    p->from = p->from ? p->from : x;
    for (int c = 0; c < dim; c++) { /* what the square of the distance to the first one grows by */
        const double d = x[c] - p->from[c], e = u[c] - p->whole[c];
        way = fmax(way, fmax(fabs(u[c]), fabs(p->whole[c])));
        along += e * (2 * d + (large ? e : 0));
        length2 += d * d;
        motion2 += e * e;
    }
    const double length = sqrt(length2);
    way += large ? length : 0; /* which is what a turn takes nodes to, less where they were */
    return fabs(along) > 2 * APART * way * (length + sqrt(motion2));
}

/* *translated (may be NULL): is each part of the body carried along without a turn? Without memory it is stretched. */
static bool is_stretched(bool *translated, const uz_body_model *model, const double *nodal, bool large)
{
    uz_parts parts = {.list = NULL};
    held_part *list = uz_find_parts(&parts, model, NULL) == UZ_OK ? uz_alloc_zero(parts.count, sizeof *list) : NULL;
    const bool all = list && find_shifted(list, &parts, model, nodal);
    bool stretched = !list;
    for (int64_t a = 0; a < model->mesh.n_nodes && !stretched; a++)
        stretched = is_held_apart(&list[parts.of[a]], model, nodal, a, large);
    if (translated)
        *translated = all;
    uz_parts_clear(&parts);
    free(list);
    return stretched;
}

bool uz_is_stretched(const uz_body_model *model, const double *nodal, bool large)
{
    return is_stretched(NULL, model, nodal, large);
}

/* Does nothing strain the body, but rounding? */
static bool nothing_strains(const uz_body_model *model, const uz_scene *scene, const double *nodal)
{
    const bool alone = model->m == 0; /* what presses on a body may be less than solves leave, as loads may */
    bool translated = false;
    return is_carried(model, nodal, STRAINED_BY * CARRIED) && !uz_is_loaded(model, scene) &&
           !is_stretched(&translated, model, nodal, false) &&
           (translated || is_carried(model, nodal, alone ? CARRIED : ROUNDED));
}

double uz_estimate_mesh_error(double *eta2, uz_mesh_look *look, const uz_body_model *model, const uz_scene *scene,
                              const double *nodal)
{
    double *free_strain = NULL;
    if (look)
        *look = (uz_mesh_look){1, NAN, NAN};
    if (eta2)
        memset(eta2, 0, (size_t)model->mesh.n_elements * sizeof *eta2);
    if (scene && uz_free_strains(&free_strain, model, scene, NULL) != UZ_OK)
        return NAN;
    if (!free_strain && (is_translation(model, nodal, 0) || (scene && nothing_strains(model, scene, nodal))))
        return 0;
    const uz_strain_source from = {.model = model, .nodal = nodal, .free_strain = free_strain};
    double *least = NULL, *own = NULL;
    uz_status status = scene ? uz_thin_elements_errors(&least, scene, &from, 1, NULL) : UZ_OK;
    if (least && !eta2) {
        own = uz_alloc_zero(model->mesh.n_elements, sizeof *own);
        status = own ? UZ_OK : UZ_ERR_MEMORY;
    }
    uz_stress_sums sums = {.hidden = true, .steepness = look != NULL, .eta2_of = eta2 ? eta2 : own};
    if (status == UZ_OK)
        status = integrate(&sums, &from, NULL);
    for (int64_t e = 0; e < model->mesh.n_elements && least && status == UZ_OK; e++) {
        sums.eta2 += fmax(0, least[e] - sums.eta2_of[e]);
        sums.eta2_of[e] = fmax(least[e], sums.eta2_of[e]);
    }
    uz_free_all(least, own, free_strain);
    if (status != UZ_OK)
        return NAN;
    if (look) {
        look->twice = sums.others ? NAN : sums.whole;
        look->steep2 = 0;
        for (int l = 0; l < UZ_STRAIN_LANES; l++)
            look->steep2 = fmax(look->steep2, sums.steep2[l]);
    }
    double stored;
    const double springs = uz_spring_error(eta2, &stored, model, scene, nodal, sums.whole);
    if (isnan(springs))
        return NAN;
    sums.eta2 += springs;
    sums.whole += stored;
    sums.stress += stored;
    if (!(sums.whole > 0 && isfinite(sums.whole)))
        return INFINITY;
    const double stressed = sqrt(sums.stress / sums.whole);
    if (stressed < FREE)
        return 0;
    if (is_translation(model, nodal, ALIKE)) /* nor is what rounding left of strains known */
        sums.eta2 += energy_of_rounding(model, nodal);
    if (look)
        look->share = stressed;
    return sqrt(sums.eta2 / (sums.stress + sums.eta2));
}
