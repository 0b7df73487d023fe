/* loads.c: the scene's loads as forces of the nodes. What falls on a supported dof goes into the support. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uz_body_model *model;
    const uz_load *load;
    double *f;   /* n_nodes x dim */
    bool finite; /* what follows the body is for finite/follower.h; temperature is in the strains */
} loading;

static void add_to_nodes(const loading *x, const double *f, const int64_t *node, int count)
{
    const int dim = x->model->mesh.dim;
    for (int i = 0; i < count * dim; i++)
        x->f[node[i / dim] * dim + i % dim] += f[i];
}

/* Where the shares (of 1) have their centre, and J w = sum s r x (w x r) about it. */
static void second_moments(double centre[3], double J[3][3], const uz_mesh *mesh, const double *share)
{
    memset(centre, 0, 3 * sizeof *centre);
    memset(J, 0, 3 * sizeof *J);
    for (int pass = 0; pass < 2; pass++)
        for (int64_t a = 0; a < mesh->n_nodes; a++) {
            double r[3] = {0};
            for (int c = 0; c < mesh->dim; c++)
                r[c] = mesh->xyz[a * mesh->dim + c] - (pass == 0 ? 0 : centre[c]);
            for (int i = 0; i < 3 && share[a] != 0; i++) {
                centre[i] += pass == 0 ? share[a] * r[i] : 0;
                for (int j = 0; j < 3 && pass == 1; j++)
                    J[i][j] += share[a] * ((i == j ? uz_dot3(r, r) : 0) - r[i] * r[j]);
            }
        }
}

/* A force at a point with a moment: f = s (v + w x r), so that sum f = v and sum r x f = J w. */
static uz_status add_at_point(const loading *x, const double *share, const uz_group *group, const char *where,
                              uz_error *err)
{
    const uz_mesh *mesh = &x->model->mesh;
    double centre[3], J[3][3], rows[3][3], arm[3], moment[3], w[3] = {0}, det, size = 0;
    second_moments(centre, J, mesh, share);
    for (int c = 0; c < 3; c++)
        arm[c] = c < mesh->dim ? x->load->point[c] - centre[c] : 0;
    uz_cross3(moment, arm, x->load->v);
    for (int c = 0; c < 3; c++) {
        moment[c] += x->load->moment[c];
        uz_cross3(rows[c], J[(c + 1) % 3], J[(c + 2) % 3]);
        size = fmax(size, fabs(J[c][c]));
    }
    det = uz_dot3(J[0], rows[0]);
    if (mesh->dim == 2 ? !(J[2][2] > 0) : !(det > 1e-12 * size * size * size))
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "\"%s\" is %s, and bears no moment: leave at and moment out, or name more of the body",
                       group->name, mesh->dim == 2 ? "one point" : "on a line");
    for (int i = 0; i < 3 && mesh->dim == 3; i++)
        w[i] = (rows[0][i] * moment[0] + rows[1][i] * moment[1] + rows[2][i] * moment[2]) / det;
    if (mesh->dim == 2)
        w[2] = moment[2] / J[2][2];
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        double r[3] = {0}, turned[3];
        for (int c = 0; c < mesh->dim; c++)
            r[c] = mesh->xyz[a * mesh->dim + c] - centre[c];
        uz_cross3(turned, w, r);
        for (int c = 0; c < mesh->dim && share[a] != 0; c++)
            x->f[a * mesh->dim + c] += share[a] * (x->load->v[c] + turned[c]);
    }
    return UZ_OK;
}

enum { SIDES_AT_ONCE = 128, SIDES_OF_PART = 32 };

/* What a traction or pressure does to the nodes of a side. */
typedef struct {
    int64_t node[UZ_FACE_NODES];
    double f[3 * UZ_FACE_NODES];
    int nodes;
} loaded_side;

/* Some sides as the threads that share them see them. */
typedef struct {
    const loading *x;
    const uz_face *face;
    int count;
    loaded_side side[SIDES_AT_ONCE];
} loading_sides;

static void load_sides(void *ctx, int part)
{
    loading_sides *s = ctx;
    const uz_load *load = s->x->load;
    const int end = (part + 1) * SIDES_OF_PART < s->count ? (part + 1) * SIDES_OF_PART : s->count;
    for (int i = part * SIDES_OF_PART; i < end; i++) {
        loaded_side *to = &s->side[i];
        uz_side side;
        double xyz[3 * UZ_ELEMENT_NODES], pressure[UZ_FACE_NODES];
        uz_body_side(&side, xyz, to->node, s->x->model, s->face[i]);
        memset(to->f, 0, sizeof to->f);
        to->nodes = side.nodes;
        for (int a = 0; a < side.nodes; a++)
            pressure[a] = load->value;
        if (load->kind == UZ_LOAD_PRESSURE)
            uz_side_add_pressure(to->f, &side, pressure);
        else
            uz_side_add_traction(to->f, &side, load->v);
    }
}

/* Side by side, in their order, whoever has computed them. */
static void add_sides(const loading *x, const uz_group *group)
{
    loading_sides s = {.x = x};
    for (int64_t first = 0; first < group->n_faces; first += s.count) {
        s.face = group->face + first;
        s.count = group->n_faces - first < SIDES_AT_ONCE ? (int)(group->n_faces - first) : SIDES_AT_ONCE;
        uz_aside_share(load_sides, &s, (s.count + SIDES_OF_PART - 1) / SIDES_OF_PART);
        for (int i = 0; i < s.count; i++)
            add_to_nodes(x, s.side[i].f, s.side[i].node, s.side[i].nodes);
    }
}

static uz_status add_load(const loading *x, const char *where, uz_error *err)
{
    const uz_mesh *mesh = &x->model->mesh;
    double xyz[3 * UZ_ELEMENT_NODES];
    if (x->load->kind == UZ_LOAD_NODE_FORCE) {
        if (x->load->node < 0 || x->load->node >= mesh->n_nodes)
            return uz_fail(err, UZ_ERR_SCENE, where, "there is no node %lld; this mesh has 0 to %lld",
                           (long long)x->load->node, (long long)mesh->n_nodes - 1);
        for (int c = 0; c < mesh->dim; c++)
            x->f[x->load->node * mesh->dim + c] += x->load->v[c];
        return UZ_OK;
    }
    const uz_group *group = uz_mesh_group(mesh, x->load->on, where, err);
    if (!group)
        return UZ_ERR_SCENE;
    if (x->finite && (x->load->kind == UZ_LOAD_PRESSURE || x->load->kind == UZ_LOAD_TEMPERATURE || x->load->has_point))
        return UZ_OK;
    switch (x->load->kind) {
    case UZ_LOAD_TRACTION:
    case UZ_LOAD_PRESSURE:
        add_sides(x, group);
        return UZ_OK;
    case UZ_LOAD_FORCE: {
        double *share = uz_alloc_zero(mesh->n_nodes, sizeof *share);
        if (!share)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a force on %lld nodes", (long long)group->n_nodes);
        uz_status status = uz_spread_over_group(share, x->model, group, false, where, err);
        if (status == UZ_OK && x->load->has_point)
            status = add_at_point(x, share, group, where, err);
        for (int64_t i = 0; i < mesh->n_nodes * mesh->dim && status == UZ_OK && !x->load->has_point; i++)
            x->f[i] += share[i / mesh->dim] * x->load->v[i % mesh->dim];
        free(share);
        return status;
    }
    default: /* body force, gravity or temperature */
        for (int64_t i = 0; i < uz_group_element_count(mesh, group); i++) {
            const int64_t e = uz_group_element_at(group, i);
            const uz_body_material *material = uz_element_material(x->model, e);
            double of_element[UZ_ELEMENT_DOFS] = {0}, strain[UZ_ELEMENT_STRESSES], b[3];
            int count;
            const int64_t *nodes = uz_mesh_element(mesh, e, &count);
            uz_element element;
            uz_body_element(&element, xyz, x->model, e);
            for (int c = 0; c < 3; c++)
                b[c] = x->load->v[c] * (x->load->kind == UZ_LOAD_GRAVITY ? material->density : 1);
            if (x->load->kind == UZ_LOAD_TEMPERATURE) {
                uz_thermal_strain(strain, element.model, element.lame, material->expansion * x->load->value);
                uz_element_add_thermal_load(of_element, &element, strain);
            } else {
                uz_element_add_body_force(of_element, &element, b);
            }
            add_to_nodes(x, of_element, nodes, count);
        }
        return UZ_OK;
    }
}

uz_status uz_nodal_loads(double *f, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = UZ_OK;
    memset(f, 0, (size_t)(model->mesh.n_nodes * model->mesh.dim) * sizeof *f);
    for (int64_t i = 0; i < scene->n_loads && status == UZ_OK; i++) {
        const loading x = {model, &scene->loads[i], f, uz_is_finite_answer(scene)};
        status = add_load(&x, UZ_PLACE("loads", i, scene->loads[i].kind == UZ_LOAD_NODE_FORCE ? "node" : "on"), err);
    }
    return status;
}

uz_status uz_free_strains(double **out, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    double *strain = NULL;
    *out = NULL;
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const uz_load *load = &scene->loads[i];
        if (load->kind != UZ_LOAD_TEMPERATURE)
            continue;
        const uz_group *group = uz_mesh_group(&model->mesh, load->on, "/loads", err);
        if (!strain && group)
            strain = uz_alloc_zero(model->mesh.n_elements, sizeof *strain);
        if (!strain || !group) {
            free(strain);
            return !group ? UZ_ERR_SCENE : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for temperatures");
        }
        for (int64_t k = 0; k < uz_group_element_count(&model->mesh, group); k++) {
            const int64_t e = uz_group_element_at(group, k);
            strain[e] += uz_element_material(model, e)->expansion * load->value;
        }
    }
    *out = strain;
    return UZ_OK;
}
