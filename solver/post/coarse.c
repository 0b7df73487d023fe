/* coarse.c: is the contact with a rigid obstacle too narrow for the mesh?
 *
 * A row on one node, or on one place inside a side, stands for all of the contact around it: the force depends on the
 * side's length then, and the pressure on nothing else. A side is covered where it is in contact (at a place or a
 * middle inside, or at all corners) and so is what surrounds it: each of its corners touches, or all sides there are in
 * contact and there are several. A row that no side around it is covered beside is on its own. Where neither the
 * obstacle nor the body turns along the side it is none of the mesh's doing: a corner of the body stands on flat
 * ground. */
#include "post/balance.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <math.h>

/* Sides along which the obstacle's normal turns by less than this (rad) see it as flat: 12 of them to its radius. */
#define LEAST_TURN 0.08
/* A body's own sides are curved where they turn by more than the first of these (rad), and by less than the second,
 * from which on they meet in an edge that is meant. */
#define CURVED 0.01
#define CORNER 0.7
/* Part of a contact's force that rows on their own may carry. */
#define LONE_PART 0.1
/* An obstacle stands in a side where it is deeper than this part of it. */
#define STANDS_IN 0.01

/* In parts of the body's extent. */
#define TOUCHES 1e-9

/* By node and by side of the contact at hand. */
typedef struct {
    const uz_body_model *model;
    const uz_group *group;
    const double *u, *r;
    int64_t first, last;              /* rows */
    int64_t *row_of;                  /* n_nodes: 1 + the row at a node */
    int32_t *sides, *touching;        /* n_nodes: sides around it, and those in contact */
    bool *active, *covered;           /* n_nodes: has its row a reaction? is a side around it covered? */
    unsigned char *in_contact, *turn; /* by side */
    double *normals;                  /* n_nodes x 3: sums of the unit normals that the sides have there */
} contact_sides;

/* The nodes of a side, its corners first. */
static int nodes_of(int64_t node[UZ_FACE_NODES], int *corners, const contact_sides *on, int64_t face)
{
    const int count = uz_mesh_face(node, &on->model->mesh, on->group->face[face]);
    *corners = on->model->mesh.dim == 2 ? 2 : count % 4 == 0 ? 4 : 3;
    return count;
}

/* Does the obstacle turn along the side? Its normals at two corners say so; or a corner's gap, which is not that of the
 * plane in which the obstacle meets another: a tooth between flat grounds. */
static bool turns(const contact_sides *on, const int64_t *node, int corners)
{
    const uz_body_model *model = on->model;
    const uz_contact_sites *sites = &model->sites[model->info.contact_of[on->first]];
    const int dim = model->mesh.dim;
    for (int a = 0; a < corners && sites->n > 0; a++) /* a plane has none, and turns nowhere */
        for (int b = 0; b < corners; b++) {
            const int64_t i = on->row_of[node[a]] - 1, j = on->row_of[node[b]] - 1;
            double chord = 0, length = 0, along = 0;
            if (a == b || i < 0 || j < 0)
                continue;
            const double *normal = model->info.contact_normal + i * dim;
            for (int c = 0; c < dim; c++) {
                const int64_t p = node[a] * dim + c, q = node[b] * dim + c;
                const double d =
                    model->mesh.xyz[q] - model->mesh.xyz[p] + (model->place ? model->place[q] - model->place[p] : 0);
                chord = hypot(chord, normal[c] - model->info.contact_normal[j * dim + c]);
                length = hypot(length, d);
                along += normal[c] * d;
            }
            const double off = sites->gap[model->row_place[j]] - sites->gap[model->row_place[i]] - along;
            if (chord > LEAST_TURN || fabs(off) > 0.5 * LEAST_TURN * length)
                return true;
        }
    return false;
}

/* The unit normals of a side at its nodes, and in its middle (the last); false: it has none, as on an axis. */
static bool normals_of(double normal[UZ_FACE_NODES + 1][3], int64_t *node, const contact_sides *on, int64_t face)
{
    uz_side side;
    double xyz[3 * UZ_FACE_NODES];
    uz_body_side(&side, xyz, node, on->model, on->group->face[face]);
    const double middle = side.dim == 3 && side.nodes % 3 == 0 ? 1.0 / 3 : 0;
    for (int a = 0; a <= side.nodes; a++) {
        double area[3] = {0};
        uz_side_area_vector(area, &side, a < side.nodes ? uz_side_local_nodes(&side)[a] : (double[2]){middle, middle});
        if (!uz_unit_normal(normal[a < side.nodes ? a : UZ_FACE_NODES], area, side.dim) && a == side.nodes)
            return false;
    }
    return true;
}

/* Is the side part of a curve? Half of what it turns by with its neighbours, or itself, is between its normal in the
 * middle and the mean at one of its nodes. */
static bool is_curved(const contact_sides *on, int64_t face)
{
    double normal[UZ_FACE_NODES + 1][3];
    int64_t node[UZ_FACE_NODES];
    int corners;
    if (!normals_of(normal, node, on, face))
        return false;
    const int count = nodes_of(node, &corners, on, face);
    for (int a = 0; a < count; a++) {
        double mean[3], chord = 0;
        if (!uz_unit_normal(mean, on->normals + 3 * node[a], 3))
            continue;
        for (int c = 0; c < 3; c++)
            chord = hypot(chord, mean[c] - normal[UZ_FACE_NODES][c]);
        const double turn = 4 * asin(fmin(1, 0.5 * chord));
        if (turn > CURVED && turn < CORNER)
            return true;
    }
    return false;
}

/* Does this row stand inside this side? */
static bool is_inside(const contact_sides *on, int64_t row, int64_t face)
{
    const uz_inner_place *inner = row < on->last ? uz_row_inner(on->model, row) : NULL;
    const uz_face of = on->group->face[face];
    return inner && inner->face.element == of.element && inner->face.side == of.side;
}

/* Fills what is by node and by side. */
static void look_at_sides(contact_sides *on)
{
    const uz_body_model *model = on->model;
    int64_t node[UZ_FACE_NODES], row = on->first;
    int corners;
    for (int64_t f = 0; f < on->group->n_faces; f++) {
        double normal[UZ_FACE_NODES + 1][3];
        const int count = normals_of(normal, node, on, f) ? nodes_of(node, &corners, on, f) : 0;
        for (int a = 0; a < count; a++)
            for (int c = 0; c < 3; c++)
                on->normals[3 * node[a] + c] += normal[a][c];
    }
    while (row < on->last && !uz_row_inner(model, row)) {
        const int64_t at = model->info.contact_node[row]; /* several times where flanks of a groove hold it */
        on->row_of[at] = on->row_of[at] > 0 ? on->row_of[at] : row + 1;
        on->active[at] = on->active[at] || model->law->kind->active(model->law, NULL, &on->r[row], 1) > 0;
        row++;
    }
    for (int64_t a = model->mesh.n_given; a < model->mesh.n_nodes && model->mesh.hangs; a++) { /* nodes without rows */
        const int64_t *from;
        const double *share;
        const int amid = model->mesh.hangs[a] ? uz_mesh_amid(&from, &share, &model->mesh, a) : 0;
        on->active[a] = on->active[a] || amid > 0;
        for (int k = 0; k < amid; k++)
            on->active[a] = on->active[a] && on->active[from[k]];
    }
    for (int64_t f = 0; f < on->group->n_faces; f++) {
        const int count = nodes_of(node, &corners, on, f);
        bool all = true, inside = false;
        for (int a = 0; a < corners; a++)
            all = all && on->active[node[a]];
        for (int a = corners; a < count; a++)
            all = all || on->active[node[a]];
        for (; is_inside(on, row, f); row++)
            inside = inside || model->law->kind->active(model->law, NULL, &on->r[row], 1) > 0;
        on->in_contact[f] = all || inside;
        /* a row inside is there because the obstacle does not follow the side */
        on->turn[f] = inside || turns(on, node, corners) || is_curved(on, f);
        for (int a = 0; a < count; a++) {
            on->sides[node[a]]++;
            on->touching[node[a]] += on->in_contact[f];
        }
    }
    for (int64_t f = 0; f < on->group->n_faces; f++) {
        const int count = nodes_of(node, &corners, on, f);
        bool covered = on->in_contact[f];
        for (int a = 0; a < corners; a++)
            covered = covered &&
                      (on->active[node[a]] || (on->sides[node[a]] > 1 && on->touching[node[a]] == on->sides[node[a]]));
        for (int a = 0; a < count && covered; a++)
            on->covered[node[a]] = true;
    }
}

/* Force, and sides, of rows on their own; and of all. */
static void add_lone_rows(uz_coarse_contact *out, contact_sides *on, int64_t contact)
{
    const uz_body_model *model = on->model;
    double force = 0, lone = 0, largest = 0;
    int64_t node[UZ_FACE_NODES], sides = 0, at = -1, row = on->first;
    int corners;
    for (int64_t i = on->first; i < on->last; i++) {
        force += fabs(on->r[i]);
        row += !uz_row_inner(model, i);
    }
    for (int64_t f = 0; f < on->group->n_faces; f++) {
        const int count = nodes_of(node, &corners, on, f);
        double here = 0, most = 0;
        bool covered = false;
        for (; is_inside(on, row, f); row++)
            here += fabs(on->r[row]);
        for (int a = 0; a < count; a++)
            covered = covered || on->covered[node[a]];
        for (int a = 0; a < count; a++) {
            const int64_t own = on->row_of[node[a]] - 1;
            if (covered && a >= corners) /* beside a covered side, as the row inside is */
                on->covered[node[a]] = true;
            most = fmax(most, own >= 0 && !on->covered[node[a]] ? fabs(on->r[own]) : 0);
        }
        here = covered ? 0 : here;
        if (!on->turn[f] || !(here + most > 0))
            continue;
        sides++;
        lone += here;
        for (int a = 0; a < count; a++) { /* of each node once */
            const int64_t own = on->row_of[node[a]] - 1;
            if (own < 0 || on->covered[node[a]] || on->sides[node[a]] == 0)
                continue;
            lone += fabs(on->r[own]);
            on->sides[node[a]] = 0;
        }
        if (fmax(here, most) > largest) {
            largest = fmax(here, most);
            at = node[0];
        }
    }
    if (!(lone > LONE_PART * force) || out->sides > sides)
        return;
    *out = (uz_coarse_contact){.contact = contact, .sides = sides, .node = at, .part = lone / force};
}

/* Places inside sides that have no row, where the obstacle stands in the side. */
static void add_deep_sides(uz_coarse_contact *out, const contact_sides *on, int64_t contact)
{
    const uz_contact_sites *sites = &on->model->sites[contact];
    const int dim = on->model->mesh.dim;
    double deepest = 0;
    int64_t sides = 0, at = -1;
    for (int64_t i = 0; i < sites->n_inner; i++) {
        const uz_inner_place *inner = &sites->inner[i];
        double gap = inner->gap;
        if (isfinite(sites->gap[sites->n - sites->n_inner + i]))
            continue;
        for (int a = 0; a < inner->nodes; a++)
            for (int c = 0; c < dim; c++)
                gap += inner->share[a] * inner->normal[c] *
                       (on->u[inner->node[a] * dim + c] -
                        (on->model->place ? on->model->place[inner->node[a] * dim + c] : 0));
        if (!(-gap > STANDS_IN * inner->size))
            continue;
        sides++;
        at = -gap > deepest ? inner->node[0] : at;
        deepest = fmax(deepest, -gap);
    }
    if (deepest > out->depth)
        *out = (uz_coarse_contact){.contact = contact, .sides = sides, .node = at, .depth = deepest};
}

uz_status uz_find_coarse_contact(uz_coarse_contact *out, const uz_body_model *model, const uz_scene *scene,
                                 const double *u, const double *r, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes;
    int64_t row = 0;
    bool room = true;
    *out = (uz_coarse_contact){.contact = -1, .node = -1};
    for (int64_t k = 0; k < scene->n_contacts && room; k++) {
        contact_sides on = {.model = model, .u = u, .r = r, .first = row};
        while (row < model->m && model->info.contact_of[row] == k)
            row++;
        on.last = row;
        on.group = uz_mesh_group(&model->mesh, scene->contacts[k].on, "", NULL);
        if (scene->contacts[k].kind == UZ_OBSTACLE_BODY || !on.group || on.group->n_faces == 0 || on.first == on.last)
            continue; /* without a row where supports hold all of the side */
        on.row_of = uz_alloc_zero(n, sizeof *on.row_of);
        on.sides = uz_alloc_zero(n, sizeof *on.sides);
        on.touching = uz_alloc_zero(n, sizeof *on.touching);
        on.active = uz_alloc_zero(n, sizeof *on.active);
        on.covered = uz_alloc_zero(n, sizeof *on.covered);
        on.in_contact = uz_alloc_zero(on.group->n_faces, 1);
        on.turn = uz_alloc_zero(on.group->n_faces, 1);
        on.normals = uz_alloc_zero(n, 3 * sizeof *on.normals);
        room =
            on.row_of && on.sides && on.touching && on.active && on.covered && on.in_contact && on.turn && on.normals;
        if (room) {
            look_at_sides(&on);
            add_deep_sides(out, &on, k);
            if (!(out->depth > 0))
                add_lone_rows(out, &on, k);
        }
        uz_free_all(on.row_of, on.sides, on.touching, on.active, on.covered, on.in_contact, on.turn, on.normals);
    }
    return room ? UZ_OK
                : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the sides of %lld contacts",
                          (long long)scene->n_contacts);
}

/* ---- presses and touches nowhere */

/* Of the node itself: the row of a middle has a share of its ends' off it. */
static double own_gap(const uz_body_model *model, const double *g, int64_t row)
{
    const int64_t *ends = model->row_ends;
    if (!ends || ends[2 * row] < 0)
        return g[row];
    return (1 - 2 * UZ_MIDDLE_SHARE) * g[row] +
           UZ_MIDDLE_SHARE * (own_gap(model, g, ends[2 * row]) + own_gap(model, g, ends[2 * row + 1]));
}

double uz_pressed_apart(int64_t *row, const uz_body_model *model, const uz_overlap *overlap, int64_t n_contacts,
                        const double *r, const double *g)
{
    double most = 0;
    int64_t i = 0;
    for (int64_t k = 0; k < n_contacts; k++) {
        double nearest = INFINITY;
        int64_t at = -1;
        for (; i < model->m && model->info.contact_of[i] == k; i++) {
            const double gap = own_gap(model, g, i);
            if (model->law->kind->active(model->law, NULL, &r[i], 1) == 0 || gap >= nearest)
                continue;
            nearest = gap;
            at = i;
        }
        const bool touches = overlap[k].depth > 0 || !(nearest > TOUCHES * model->mesh.extent);
        if (at < 0 || touches || model->sites[k].ends || !(nearest > most))
            continue;
        most = nearest;
        *row = at;
    }
    return most;
}
