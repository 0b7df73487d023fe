/* row_turn.c: the derivative of the forces of rows between bodies, in the plane by central differences; in space
 * row_turn_space.c.
 *
 * A row of two surfaces turns with its slave side, and its shares of masters go over from one to the next as the bodies
 * slide. All of that is found by moving nodes a little and finding the rows again, as far as they are near: the row of
 * a place depends on the sides around its node, whose normals depend on the sides beside these, and on the sides that
 * it faces. Nodes on which no row depends in common are moved together, which takes some tens of places whatever the
 * mesh (Curtis, Powell and Reid, "On the estimation of sparse Jacobian matrices", J. Inst. Maths Applics 13 (1974)
 * 117-119). */
#include "assembly/row_turn.h"

#include "assembly/parts.h"
#include "assembly/row_turn_space.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/linalg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nodes are moved by this part of the shortest side: the square is the error of differences, its inverse times the
 * rounding of rows the other one. */
#define MOVED_BY 1e-5
/* What changes by less is rounding. */
#define ROUNDING 1e-8

typedef struct {
    const uz_body_model *base, *rows;
    const uz_scene *scene;
    const double *r;
    double least, by;
    int64_t n_pressed, *pressed; /* rows */
    /* by columns: nodes that have a side of a contact in common with each; nodes on which each pressed row depends, and
     * by nodes which of the pressed rows do; numbers are 0 */
    uz_csc beside, near, seen;
    int64_t *color, colors; /* n_nodes: -1: none depends on it */
    double *u, *way, *sum;  /* n_nodes x dim; d; d */
} work;

bool uz_has_pairs(const uz_scene *scene)
{
    bool has = false;
    for (int64_t k = 0; k < scene->n_contacts && !has; k++)
        has = scene->contacts[k].kind == UZ_OBSTACLE_BODY;
    return has;
}

/* ---- which rows depend on which nodes */

/* Neighbours along the sides of contacts between bodies, each node among its own; the shortest of these sides. */
static uz_status list_neighbours(work *w, uz_error *err)
{
    const uz_mesh *mesh = &w->base->mesh;
    const int dim = mesh->dim;
    double shortest = INFINITY;
    uz_entries all = {.n = 0};
    for (int64_t k = 0; k < w->scene->n_contacts; k++)
        for (int g = 0; g < 2 && w->scene->contacts[k].kind == UZ_OBSTACLE_BODY; g++) {
            const uz_contact *c = &w->scene->contacts[k];
            const uz_group *group = uz_mesh_group(mesh, g == 0 ? c->on : c->with, "/contacts", NULL);
            for (int64_t i = 0; group && i < group->n_faces; i++) {
                int64_t node[UZ_FACE_NODES];
                const int n = uz_mesh_face(node, mesh, group->face[i]);
                double x[2][3] = {{0}};
                for (int c2 = 0; c2 < 2 * dim; c2++) {
                    const int64_t at = dim * node[c2 / dim] + c2 % dim;
                    x[c2 / dim][c2 % dim] = mesh->xyz[at] + w->rows->place[at];
                }
                shortest = fmin(shortest, sqrt(uz_distance2(x[0], x[1], dim)));
                for (int a = 0; a < n; a++)
                    for (int b = 0; b < n; b++)
                        uz_entries_add(&all, node[b], node[a], 0);
            }
        }
    w->by = MOVED_BY * shortest;
    return uz_csc_from_entries(&w->beside, mesh->n_nodes, mesh->n_nodes, &all, err);
}

/* Pressed row j depends on the neighbours of a node, and `more` times theirs. */
static void gather(uz_entries *to, const work *w, int64_t node, int more, int64_t j)
{
    for (int64_t q = w->beside.ptr[node]; q < w->beside.ptr[node + 1]; q++) {
        const int64_t b = w->beside.idx[q];
        uz_entries_add(to, b, j, 0);
        if (more > 0 && b != node)
            gather(to, w, b, more - 1, j);
    }
}

/* The nodes on which each pressed row depends, and the reverse. */
static uz_status list_dependences(work *w, uz_error *err)
{
    const uz_body_model *rows = w->rows;
    uz_entries all = {.n = 0};
    for (int64_t j = 0; j < w->n_pressed; j++) {
        const int64_t row = w->pressed[j], place = rows->row_place[row];
        const uz_contact_sites *sites = &rows->sites[rows->info.contact_of[row]];
        gather(&all, w, sites->at[place], 1, j);
        for (int64_t q = sites->first[place]; q < sites->first[place + 1]; q++)
            gather(&all, w, sites->node[q], 0, j);
    }
    const uz_status status = uz_csc_from_entries(&w->near, rows->mesh.n_nodes, w->n_pressed, &all, err);
    return status == UZ_OK ? uz_csc_transpose(&w->seen, &w->near, err) : status;
}

/* Each node gets the least color that none has on which a row of its own depends, too. */
static bool color_nodes(work *w)
{
    const int64_t n_nodes = w->rows->mesh.n_nodes;
    int64_t *taken = uz_alloc_zero(n_nodes + 1, sizeof *taken);
    w->color = uz_alloc(n_nodes, sizeof *w->color);
    if (!taken || !w->color) {
        free(taken);
        return false;
    }
    for (int64_t a = 0; a < n_nodes; a++)
        w->color[a] = -1;
    for (int64_t a = 0; a < n_nodes; a++) {
        if (w->seen.ptr[a] == w->seen.ptr[a + 1])
            continue;
        for (int64_t s = w->seen.ptr[a]; s < w->seen.ptr[a + 1]; s++)
            for (int64_t q = w->near.ptr[w->seen.idx[s]]; q < w->near.ptr[w->seen.idx[s] + 1]; q++)
                if (w->color[w->near.idx[q]] >= 0)
                    taken[w->color[w->near.idx[q]]] = 1 + a;
        int64_t color = 0;
        while (taken[color] == 1 + a)
            color++;
        w->color[a] = color;
        w->colors = color + 1 > w->colors ? color + 1 : w->colors;
    }
    free(taken);
    return true;
}

/* ---- differences */

/* What is kept of the rows of a moved body: of each pressed one its number there, or -1, and its gap. */
typedef struct {
    uz_csc rows; /* N' */
    int64_t *at;
    double *gap;
} moved_rows;

int64_t uz_next_row(int64_t *next, const uz_body_model *rows, int64_t contact, int64_t place)
{
    while (*next < rows->m && (rows->info.contact_of[*next] < contact ||
                               (rows->info.contact_of[*next] == contact && rows->row_place[*next] < place)))
        ++*next;
    const bool found = *next < rows->m && rows->info.contact_of[*next] == contact && rows->row_place[*next] == place;
    return found ? *next : -1;
}

static void match_rows(moved_rows *out, const work *w, const uz_body_model *moved)
{
    const uz_body_model *rows = w->rows;
    int64_t next = 0;
    for (int64_t j = 0; j < w->n_pressed; j++) {
        const int64_t contact = rows->info.contact_of[w->pressed[j]], place = rows->row_place[w->pressed[j]];
        out->at[j] = uz_next_row(&next, moved, contact, place);
        out->gap[j] = moved->sites[contact].gap[place];
    }
}

/* A node of its own dofs is moved along these, one that others carry along the axes. */
static bool is_moved(const uz_body_model *model, int64_t node, int c)
{
    const double along[3] = {c == 0, c == 1, c == 2};
    return uz_have_carriers(model, &node, 1) ? uz_is_contact_row(model, node, along)
                                             : model->dof[model->mesh.dim * node + c] >= 0;
}

static void add_slope(uz_entries *to, int64_t row, const uz_body_model *model, int64_t node, int c, double value)
{
    const double slope[3] = {c == 0 ? value : 0, c == 1 ? value : 0, c == 2 ? value : 0};
    if (uz_have_carriers(model, &node, 1))
        uz_add_carried_row(to, row, model, node, slope);
    else
        uz_entries_add(to, row, model->dof[model->mesh.dim * node + c], value);
}

/* What two places on either side say of the pressed rows: each depends on one of the moved nodes at most. Where nodes
 * have common dofs the part of N is added once for all of them, by add_pressed_rows. */
static void add_differences(uz_row_turn *out, work *w, const moved_rows side[2], int64_t color, int c)
{
    const uz_body_model *base = w->base;
    for (int64_t j = 0; j < w->n_pressed; j++) {
        int64_t node = -1;
        for (int64_t q = w->near.ptr[j]; q < w->near.ptr[j + 1] && node < 0; q++)
            node = w->color[w->near.idx[q]] == color ? w->near.idx[q] : -1;
        if (node < 0 || !is_moved(base, node, c))
            continue;
        if (side[0].at[j] < 0 || side[1].at[j] < 0) {
            out->known = false;
            return;
        }
        const int64_t row = w->pressed[j],
                      own =
                          base->follow.first ? -1 : uz_csc_find(&w->rows->N, row, base->dof[base->mesh.dim * node + c]);
        const double change = (side[1].gap[j] - side[0].gap[j]) / (2 * w->by),
                     along = own < 0 ? 0 : w->rows->N.val[own];
        if (fabs(change + along) > ROUNDING)
            add_slope(&out->gap, row, base, node, c, change + along);
        for (int s = 0; s < 2; s++)
            for (int64_t q = side[s].rows.ptr[side[s].at[j]]; q < side[s].rows.ptr[side[s].at[j] + 1]; q++)
                w->sum[side[s].rows.idx[q]] += (s ? 1 : -1) * side[s].rows.val[q];
        for (int s = 0; s < 2; s++)
            for (int64_t q = side[s].rows.ptr[side[s].at[j]]; q < side[s].rows.ptr[side[s].at[j] + 1]; q++) {
                const int64_t i = side[s].rows.idx[q];
                const double slope = w->sum[i] / (2 * w->by);
                w->sum[i] = 0;
                if (fabs(slope) * w->by > ROUNDING * MOVED_BY)
                    add_slope(&out->force, i, base, node, c, w->r[row] * slope);
            }
    }
}

/* u: `by` along c at the nodes of a color that others carry, whose way tells nothing of them. */
static void move_carried(work *w, int64_t color, int c, double by)
{
    const int dim = w->base->mesh.dim;
    for (int64_t a = 0; a < w->base->mesh.n_nodes && w->base->follow.first; a++)
        for (int k = 0; k < dim && uz_have_carriers(w->base, &a, 1); k++)
            w->u[dim * a + k] = k == c && w->color[a] == color && is_moved(w->base, a, c) ? by : 0;
}

/* All nodes of a color along c, there and back. */
static uz_status move_color(uz_row_turn *out, work *w, moved_rows side[2], int64_t color, int c, uz_error *err)
{
    const uz_body_model *base = w->base;
    const int dim = base->mesh.dim;
    uz_scene scene = *w->scene;
    uz_status status = UZ_OK;
    bool any = false;
    memset(w->way, 0, (size_t)base->d * sizeof *w->way);
    for (int64_t a = 0; a < base->mesh.n_nodes; a++)
        if (w->color[a] == color && is_moved(base, a, c)) {
            if (!uz_have_carriers(base, &a, 1))
                w->way[base->dof[dim * a + c]] = w->by;
            any = true;
        }
    for (int s = 0; s < 2 && status == UZ_OK && any && out->known; s++) {
        uz_body_model moved = {.d = 0};
        uz_error own = {0};
        for (int64_t j = 0; j < base->d; j++)
            w->way[j] = s ? fabs(w->way[j]) : -w->way[j];
        uz_recover_nodal(w->u, base, w->way, NULL);
        move_carried(w, color, c, s ? w->by : -w->by);
        for (int64_t i = 0; i < dim * base->mesh.n_nodes; i++)
            w->u[i] += w->rows->place[i];
        scene.place = w->u;
        status = uz_body_model_move(&moved, base, &scene, &own);
        if (status == UZ_OK) {
            match_rows(&side[s], w, &moved);
            status = uz_csc_transpose(&side[s].rows, &moved.N, &own);
        }
        uz_body_model_clear(&moved);
        if (status == UZ_ERR_SCENE) { /* no contact can be found there */
            out->known = false;
            status = UZ_OK;
        } else if (status != UZ_OK && err) {
            *err = own;
        }
    }
    if (status == UZ_OK && any && out->known)
        add_differences(out, w, side, color, c);
    uz_csc_clear(&side[0].rows);
    uz_csc_clear(&side[1].rows);
    return status;
}

static bool is_pressed(const work *w, int64_t i)
{
    return w->r[i] < -w->least && w->scene->contacts[w->rows->info.contact_of[i]].kind == UZ_OBSTACLE_BODY;
}

static void add_pressed_rows(uz_entries *to, const work *w)
{
    const uz_csc *N = &w->rows->N;
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            if (is_pressed(w, N->idx[q]))
                uz_entries_add(to, N->idx[q], j, N->val[q]);
}

/* The body at rest, whose nodes follow others as they do in `rows`. */
static uz_body_model with_followers(const uz_body_model *base, const uz_body_model *rows)
{
    uz_body_model out = *base;
    out.follow = rows->follow;
    out.turned = rows->turned;
    return out;
}

static bool list_pressed(work *w)
{
    const uz_body_model *rows = w->rows;
    w->pressed = uz_alloc(rows->m, sizeof *w->pressed);
    for (int64_t i = 0; i < rows->m && w->pressed; i++)
        if (is_pressed(w, i))
            w->pressed[w->n_pressed++] = i;
    return w->pressed != NULL;
}

uz_status uz_row_turn_find(uz_row_turn *out, const uz_body_model *base, const uz_body_model *rows,
                           const uz_scene *scene, const double *r, double least, const uz_stop *stop, uz_error *err)
{
    const int dim = base->mesh.dim;
    const uz_body_model there = with_followers(base, rows);
    work w = {.base = &there, .rows = rows, .scene = scene, .r = r, .least = least};
    moved_rows side[2] = {{.at = NULL}, {.at = NULL}};
    uz_status status = UZ_OK;
    *out = (uz_row_turn){.known = true};
    if (dim == 3)
        return uz_row_turn_in_space(out, base, rows, scene, r, least, err);
    bool room = list_pressed(&w);
    if (room && w.n_pressed > 0) {
        w.u = uz_alloc(dim * base->mesh.n_nodes, sizeof *w.u);
        w.way = uz_alloc(base->d, sizeof *w.way);
        w.sum = uz_alloc_zero(base->d, sizeof *w.sum);
        room = w.u && w.way && w.sum;
        for (int s = 0; s < 2; s++) {
            side[s].at = uz_alloc(w.n_pressed, sizeof *side[s].at);
            side[s].gap = uz_alloc(w.n_pressed, sizeof *side[s].gap);
            room = room && side[s].at && side[s].gap;
        }
        status = list_neighbours(&w, err);
        if (status == UZ_OK)
            status = list_dependences(&w, err);
        room = room && (status != UZ_OK || color_nodes(&w));
    }
    if (status == UZ_OK && !room)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for how %lld contact rows turn", (long long)rows->m);
    for (int64_t color = 0; color < w.colors && status == UZ_OK && out->known; color++)
        for (int c = 0; c < dim && status == UZ_OK && out->known; c++) {
            out->known = !uz_stop_is_due(stop);
            if (out->known)
                status = move_color(out, &w, side, color, c, err);
        }
    if (status == UZ_OK && base->follow.first)
        add_pressed_rows(&out->gap, &w);
    if (status == UZ_OK && (out->force.failed || out->gap.failed))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for how contact rows turn");
    if (!out->known)
        out->force.n = out->gap.n = 0;
    uz_csc_clear(&w.beside);
    uz_csc_clear(&w.near);
    uz_csc_clear(&w.seen);
    uz_free_all(w.pressed, w.color, w.u, w.way, w.sum);
    for (int s = 0; s < 2; s++) {
        free(side[s].at);
        free(side[s].gap);
    }
    return status;
}

/* ---- along one direction */

/* The body's largest motion, in its extent: what is left of the second derivative, or of the rounding of rows. */
#define MOVED_ALONG 1e-7

/* Adds `factor` times N'r, and the gaps, of the pressed rows between bodies, as they are in `at`; false: not all of
 * them are. room: of 2 at->m; N of `rows` is that of the gaps. */
static bool add_rows_at(double *force, double *gap, double factor, const work *w, const uz_body_model *at, double *room)
{
    double *r = room, *g = room + at->m;
    int64_t next = 0;
    bool all = true;
    for (int64_t i = 0; i < at->m; i++) {
        const uz_contact_sites *sites = &at->sites[at->info.contact_of[i]];
        r[i] = 0;
        g[i] = sites->gap ? sites->gap[at->row_place[i]] : 0; /* a plane has no sites */
    }
    uz_blend_rows(g, at);
    for (int64_t j = 0; j < w->n_pressed && all; j++) {
        const int64_t row = w->pressed[j];
        const int64_t there = uz_next_row(&next, at, w->rows->info.contact_of[row], w->rows->row_place[row]);
        all = there >= 0;
        if (all) {
            r[there] = factor * w->r[row];
            gap[row] += factor * g[there];
        }
    }
    if (all)
        uz_csc_gaxpy_t(force, &at->N, 1, r);
    return all;
}

/* change: d + m, of zeros. */
static uz_status difference_along(bool *known, double *change, work *w, double part, uz_error *err)
{
    const uz_body_model *rows = w->rows;
    uz_scene scene = *w->scene;
    uz_body_model moved = {.d = 0};
    uz_error own = {0};
    double *room = NULL;
    scene.place = w->u;
    uz_status status = uz_body_model_move(&moved, w->base, &scene, &own);
    if (status == UZ_OK && !(room = uz_alloc(2 * (moved.m + rows->m), sizeof *room)))
        status = uz_fail(&own, UZ_ERR_MEMORY, "", "no memory for how contact rows turn");
    if (status == UZ_OK)
        *known = add_rows_at(change, change + rows->d, 1 / part, w, &moved, room) &&
                 add_rows_at(change, change + rows->d, -1 / part, w, rows, room);
    free(room);
    uz_body_model_clear(&moved);
    if (status == UZ_ERR_SCENE) /* no contact can be found there */
        return UZ_OK;
    if (status != UZ_OK && err)
        *err = own;
    return status;
}

uz_status uz_row_turn_along(bool *known, double *force, double *gap, const uz_body_model *base,
                            const uz_body_model *rows, const uz_scene *scene, const double *r, const double *v,
                            uz_error *err)
{
    const int64_t n = base->mesh.dim * base->mesh.n_nodes, d = base->d;
    const uz_body_model there = with_followers(base, rows);
    work w = {.base = &there, .rows = rows, .scene = scene, .r = r};
    double most = 0, *change = uz_alloc_zero(d + rows->m, sizeof *change);
    uz_status status = UZ_OK;
    *known = false;
    w.u = uz_alloc(n, sizeof *w.u);
    if (!w.u || !change || !list_pressed(&w))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for how %lld contact rows turn", (long long)rows->m);
    for (int64_t j = 0; j < d; j++)
        most = fmax(most, fabs(v[j]));
    const double part = MOVED_ALONG * base->mesh.extent / most;
    if (status == UZ_OK && most > 0 && isfinite(part)) {
        uz_recover_nodal(w.u, &there, v, NULL);
        for (int64_t i = 0; i < n; i++)
            w.u[i] = rows->place[i] + part * w.u[i];
        status = difference_along(known, change, &w, part, err);
    }
    for (int64_t j = 0; j < d && *known; j++)
        force[j] += change[j];
    if (*known)
        uz_csc_gaxpy(change + d, &rows->N, 1, v);
    for (int64_t j = 0; j < w.n_pressed && *known; j++)
        gap[w.pressed[j]] += change[d + w.pressed[j]];
    uz_free_all(w.u, w.pressed, change);
    return status;
}

void uz_row_turn_clear(uz_row_turn *turn)
{
    uz_entries_clear(&turn->force);
    uz_entries_clear(&turn->gap);
}

void uz_add_entries(double *y, const uz_entries *of, const double *x, bool skew)
{
    const double part = skew ? 0.5 : 1;
    for (int64_t k = 0; k < of->n; k++) {
        y[of->row[k]] += part * of->val[k] * x[of->col[k]];
        if (skew)
            y[of->col[k]] -= part * of->val[k] * x[of->row[k]];
    }
}

/* ---- with a stiffness */

uz_status uz_widen_by_rows(uz_csc *out, const uz_csc *K, const uz_csc *N, const double *r, double least,
                           const uz_row_turn *turn, uz_error *err)
{
    uz_entries all = {.n = 0};
    uz_csc rows = {0};
    const uz_status status = uz_csc_transpose(&rows, N, err);
    if (status != UZ_OK)
        return status;
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            uz_entries_add(&all, K->idx[q], j, K->val[q]);
    for (int64_t i = 0; i < N->rows && r; i++)
        for (int64_t p = rows.ptr[i]; p < rows.ptr[i + 1] && r[i] < -least; p++)
            for (int64_t q = rows.ptr[i]; q <= p; q++)
                uz_entries_add(&all, rows.idx[p], rows.idx[q], 0);
    for (int64_t k = 0; turn && k < turn->force.n; k++) {
        const int64_t i = turn->force.row[k], j = turn->force.col[k];
        const double value = turn->force.val[k];
        uz_entries_add(&all, i > j ? i : j, i > j ? j : i, i == j ? -value : -0.5 * value);
    }
    uz_csc_clear(&rows);
    return uz_csc_from_entries(out, K->rows, K->cols, &all, err);
}
