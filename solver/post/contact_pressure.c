/* contact_pressure.c: pressure per area from the reactions at nodes.
 *
 * Let p be the pressure and r_i = -integral phi_i p the reactions, phi_i the sides' shape functions. For each corner a
 * of the sides let psi_a be the continuous piecewise linear function that is 1 there: psi_a = sum_i psi_a(x_i) phi_i
 * holds on linear and quadratic sides alike, so that
 *     p_a = integral psi_a p / integral psi_a = -sum_i psi_a(x_i) r_i / integral psi_a,
 * the mean of p around the corner, weighted with psi_a. On linear sides this is reaction over tributary area; on
 * quadratic ones half of what a middle carries counts for each end of its edge, and the middle gets the mean of the two
 * ends. So a uniform pressure is found exactly, the total force is kept, reactions <= 0 give pressures >= 0, and
 * neither the corners of six-node triangles, which carry nothing, nor the 1 : 4 : 1 of a three-node edge make p jump. A
 * reaction at a place x inside a side counts for its corners by psi_a(x), and the pressure there lies between theirs.
 * A corner that hangs, or is the middle of a larger side's edge, is none of these: psi_a is linear there, too. */
#include "post/parts.h"

#include "assembly/discretization.h"
#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

/* By node; zero where the contact at hand is not. */
typedef struct {
    double *area, *force; /* of corners */
    int64_t *end;         /* 2 by node: 1 + the ends of the edge of which it is the middle; NULL: there is none */
    bool *has_row;
    const uz_mesh *mesh;
} pressure_work;

/* The corners between which a node that is none stands, at equal shares; returns how many: 0, it is a corner. */
static int stands_amid(int64_t corner[4], const pressure_work *w, int64_t node)
{
    const int64_t *from;
    const double *share;
    const bool middle = w->end && w->end[2 * node] > 0;
    for (int k = 0; k < 2 && middle; k++)
        corner[k] = w->end[2 * node + k] - 1;
    if (middle || !uz_mesh_hangs(w->mesh, node))
        return middle ? 2 : 0;
    const int count = uz_mesh_amid(&from, &share, w->mesh, node), corners = count < 4 ? 2 : 4;
    memcpy(corner, from, (size_t)corners * sizeof *corner);
    return corners;
}

/* Of a refined mesh: what is at nodes that are no corners goes to corners. Those that a new node stands amid were there
 * before it. */
static void leave_middles(double *value, const pressure_work *w, const uz_group *group)
{
    for (int64_t i = group->n_nodes - 1; i >= 0 && w->mesh->hangs; i--) {
        const int64_t node = group->node[i];
        int64_t corner[4];
        const int count = stands_amid(corner, w, node);
        for (int k = 0; k < count; k++)
            value[corner[k]] += value[node] / count;
        value[node] = count > 0 ? 0 : value[node];
    }
}

static bool add_sides(pressure_work *w, const uz_body_model *model, const uz_group *group)
{
    uz_side side;
    double xyz[3 * UZ_FACE_NODES], weight[UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    for (int64_t f = 0; f < group->n_faces; f++) {
        uz_body_side(&side, xyz, node, model, group->face[f]);
        const int corners = side.dim == 2 ? 2 : side.nodes % 4 == 0 ? 4 : 3;
        if (side.nodes > corners && !w->end && !(w->end = uz_alloc_zero(2 * model->mesh.n_nodes, sizeof *w->end)))
            return false;
        uz_side_weights(weight, &side);
        for (int a = 0; a < corners; a++)
            w->area[node[a]] += weight[a];
        /* Middle j of a side lies between its corners j and j + 1. */
        for (int j = 0; j < side.nodes - corners; j++) {
            const int64_t middle = node[corners + j], ends[2] = {node[j], node[(j + 1) % corners]};
            for (int k = 0; k < 2; k++) {
                w->area[ends[k]] += 0.5 * weight[corners + j];
                w->end[2 * middle + k] = 1 + ends[k];
            }
        }
    }
    return true;
}

/* A corner that a support holds has no row, and what it carries went into the support. */
static double pressure_at(const pressure_work *w, int64_t node)
{
    int64_t corner[4];
    const int corners = stands_amid(corner, w, node);
    double sum = 0;
    int count = 0;
    bool some = false;
    for (int k = 0; k < corners; k++)
        some = some || w->has_row[corner[k]];
    for (int k = 0; k < corners; k++) {
        if (some && !w->has_row[corner[k]])
            continue;
        sum += pressure_at(w, corner[k]);
        count++;
    }
    if (corners > 0)
        return sum / count;
    return w->area[node] > 0 ? w->force[node] / w->area[node] : NAN;
}

/* Corners that a support holds have no row. */
static double pressure_inside(const pressure_work *w, const uz_inner_place *inner)
{
    double sum = 0, shares = 0;
    for (int a = 0; a < inner->corners; a++) {
        const double there = w->has_row[inner->node[a]] ? pressure_at(w, inner->node[a]) : NAN;
        if (isnan(there))
            continue;
        sum += inner->linear[a] * there;
        shares += inner->linear[a];
    }
    return shares > 0 ? sum / shares : (double)NAN;
}

/* Do those have rows that a hanging node goes with? */
static void hang_rows(pressure_work *w, const uz_group *group)
{
    for (int64_t i = 0; i < group->n_nodes && w->mesh->hangs; i++) {
        int64_t corner[4];
        for (int k = w->mesh->hangs[group->node[i]] ? stands_amid(corner, w, group->node[i]) : 0; k > 0; k--)
            w->has_row[group->node[i]] = w->has_row[group->node[i]] || w->has_row[corner[k - 1]];
    }
}

uz_status uz_contact_pressure(double *pressure, const uz_body_model *model, const uz_scene *scene, const double *r,
                              uz_error *err)
{
    const int64_t m = model->m, n_nodes = model->mesh.n_nodes;
    pressure_work w = {uz_alloc_zero(n_nodes, sizeof *w.area), uz_alloc_zero(n_nodes, sizeof *w.force), NULL,
                       uz_alloc_zero(n_nodes, sizeof *w.has_row), &model->mesh};
    const int64_t *contact = model->info.contact_of;
    bool done = w.area && w.force && w.has_row;
    for (int64_t first = 0, last; done && first < m; first = last) {
        for (last = first; last < m && contact[last] == contact[first];)
            last++;
        if (model->sites && model->sites[contact[first]].at) {
            /* Between surfaces the pressure is that of the rows' own functions, whose integrals are the areas. */
            for (int64_t i = first; i < last; i++)
                pressure[i] = -r[i] / model->info.contact_area[i];
            continue;
        }
        const uz_group *group = uz_mesh_group(&model->mesh, scene->contacts[contact[first]].on, "", NULL);
        if (!group)
            continue;
        done = add_sides(&w, model, group);
        for (int64_t i = first; done && i < last; i++) {
            const int64_t node = model->info.contact_node[i], *end = w.end ? w.end + 2 * node : NULL;
            const uz_inner_place *inner = uz_row_inner(model, i);
            for (int a = 0; inner && a < inner->corners; a++)
                w.force[inner->node[a]] -= inner->linear[a] * r[i];
            if (inner)
                continue;
            const bool middle = end && end[0] > 0;
            w.has_row[node] = true;
            for (int k = 0; k < 2 && middle; k++)
                w.force[end[k] - 1] -= 0.5 * r[i];
            if (!middle)
                w.force[node] -= r[i];
        }
        if (done) {
            leave_middles(w.area, &w, group);
            leave_middles(w.force, &w, group);
            hang_rows(&w, group);
        }
        for (int64_t i = first; done && i < last; i++)
            pressure[i] = uz_row_inner(model, i) ? pressure_inside(&w, uz_row_inner(model, i))
                                                 : pressure_at(&w, model->info.contact_node[i]);
        for (int64_t i = 0; i < uz_group_node_count(&model->mesh, group); i++) {
            const int64_t node = uz_group_node_at(group, i);
            w.area[node] = w.force[node] = 0;
            w.has_row[node] = false;
            if (w.end)
                w.end[2 * node] = w.end[2 * node + 1] = 0;
        }
    }
    uz_free_all(w.area, w.force, w.end, w.has_row);
    return done ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld rows", (long long)m);
}

/* At a hanging node: linear between the corners that it lies amid. NAN where one has none. */
static double pressure_amid(const double *nodal, const uz_mesh *mesh, int64_t node)
{
    const int64_t *from;
    const double *share;
    const int count = uz_mesh_amid(&from, &share, mesh, node), corners = count < 4 ? 2 : 4;
    double sum = 0;
    for (int k = 0; k < corners; k++)
        sum += nodal[from[k]] / corners;
    return sum;
}

uz_status uz_nodal_pressure(double *nodal, const uz_body_model *model, const uz_scene *scene, const double *pressure,
                            uz_error *err)
{
    const int64_t n_nodes = model->mesh.n_nodes;
    const int64_t *contact = model->info.contact_of;
    double *weight = uz_alloc_zero(n_nodes, sizeof *weight), *sum = uz_alloc_zero(n_nodes, sizeof *sum);
    uz_status status =
        weight && sum ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld nodes", (long long)n_nodes);
    for (int64_t a = 0; a < n_nodes; a++)
        nodal[a] = NAN;
    uz_contact_input in;
    for (int64_t i = 0; status == UZ_OK && i < model->m; i++) {
        uz_contact_row row;
        if (i == 0 || contact[i] != contact[i - 1])
            status = uz_contact_input_of(&in, model, scene, contact[i], err);
        if (status != UZ_OK || isnan(pressure[i]))
            continue;
        const int64_t node = model->info.contact_node[i];
        const double area = model->info.contact_area[i];
        if (!uz_row_inner(model, i))
            nodal[node] = fmax(nodal[node], pressure[i]);
        for (int k = 0; in.with && uz_contact_row_at(&row, &in, model->row_place[i]) && k < row.masters; k++) {
            weight[row.master[k]] += fabs(row.master_share[k]) * area;
            sum[row.master[k]] += fabs(row.master_share[k]) * area * pressure[i];
        }
    }
    for (int64_t a = 0; status == UZ_OK && a < n_nodes; a++) {
        if (weight[a] > 0)
            nodal[a] = fmax(nodal[a], sum[a] / weight[a]);
        if (uz_mesh_hangs(&model->mesh, a))
            nodal[a] = pressure_amid(nodal, &model->mesh, a);
    }
    uz_free_all(weight, sum);
    return status;
}
