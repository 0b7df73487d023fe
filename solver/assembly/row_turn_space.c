/* row_turn_space.c: the derivative of the forces of rows between solids.
 *
 * A row is n . (u_j - sum_l W_l u_l) with the slave's normal at its node and W_l = int psi_j N_l / D_j. Of its forces
 * there are two derivatives: n turns with the faces around its node; and as the bodies slide the points of the slave
 * come to lie across other places of the master, N_l by its slope there times the way of one past the other. Points of
 * the integrals are held where they are in the slave, with their parts of D_j: how these change is left out, which is
 * nothing where the strain along a face is uniform. Found by differences, as in the plane, all of that would take some
 * hundreds of times as long as the rows.
 *   A. Popp, M. Gitterle, M. Gee, W. Wall, "A dual mortar approach for 3D finite deformation contact with consistent
 *   linearization", Int. J. Numer. Meth. Engng 83 (2010) 1428-1465, whose terms these are but for those left out. */
#include "assembly/row_turn_space.h"

#include "assembly/mortar.h"
#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = UZ_FACE_NODES, BOTH = 2 * UZ_FACE_NODES };

typedef struct {
    uz_row_turn *out;
    const uz_body_model *rows;
    const uz_contact_sites *sites;
    const double *r;
    double least;
    uz_mortar_pair *pair;
    int64_t contact, *row;  /* row: of each place that is pressed, else -1 */
    double *along, *shares; /* n; n x 3: what a place's normal, and its shares, are multiplied with in the forces */
    double *sum;            /* n x 3: of the faces' normals */
} work;

/* ---- what is multiplied */

/* A middle's row is (row - s (first + second)) / (1 - 2 s) of rows of its own and its edge's ends, and its shares are
 * (1 - 2 s) its own and s theirs (mortar.c). */
static void weigh_places(work *w)
{
    const double s = UZ_MIDDLE_SHARE;
    const uz_body_model *rows = w->rows;
    const uz_contact_sites *sites = w->sites;
    for (int64_t p = 0; p < sites->n; p++)
        w->row[p] = -1;
    for (int64_t i = 0; i < rows->m; i++) {
        const int64_t p = rows->row_place[i], *ends = rows->row_ends ? rows->row_ends + 2 * i : NULL;
        if (rows->info.contact_of[i] != w->contact || !(w->r[i] < -w->least))
            continue;
        const bool middle = ends && ends[0] >= 0;
        w->row[p] = i;
        w->along[p] += middle ? w->r[i] / (1 - 2 * s) : w->r[i];
        for (int k = 0; k < 2 && middle; k++)
            w->along[rows->row_place[ends[k]]] -= s * w->r[i] / (1 - 2 * s);
    }
    for (int64_t p = 0; p < sites->n; p++) {
        const int64_t *ends = sites->ends + 2 * p;
        for (int c = 0; c < 3; c++) {
            const double force = w->along[p] * sites->normal[3 * p + c];
            w->shares[3 * p + c] += ends[0] >= 0 ? (1 - 2 * s) * force : force;
            for (int k = 0; k < 2 && ends[0] >= 0; k++)
                w->shares[3 * ends[k] + c] += s * force;
        }
    }
}

/* ---- normals that turn */

static void tangents(double T[2][3], double slope[NODES][3], const uz_mortar_side *side, const double *local)
{
    const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
    double N[NODES];
    uz_side_gradients(N, slope, &shape, local);
    memset(T, 0, 2 * sizeof *T);
    for (int b = 0; b < side->nodes; b++)
        for (int i = 0; i < 2; i++)
            for (int c = 0; c < 3; c++)
                T[i][c] += slope[b][i] * side->xyz[3 * b + c];
}

/* B = (I - n n') A / length: of a unit vector n made of one of that length. */
static void of_unit(double B[3][3], const double n[3], double length)
{
    for (int k = 0; k < 3; k++) {
        const double along = n[0] * B[0][k] + n[1] * B[1][k] + n[2] * B[2][k];
        for (int c = 0; c < 3; c++)
            B[c][k] = (B[c][k] - along * n[c]) / length;
    }
}

/* Of the normal at a face's node a, a part of that of its place, by displacements of the face's nodes. */
static void turn_normal(work *w, const uz_mortar_side *side, int a)
{
    const int64_t p = side->place[a];
    const uz_contact_sites *sites = w->sites;
    const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
    double T[2][3], slope[NODES][3], own[3], whole[3];
    tangents(T, slope, side, uz_side_local_nodes(&shape)[a]);
    uz_cross3(own, T[0], T[1]);
    memcpy(whole, w->sum + 3 * p, sizeof whole);
    const double area = uz_unit3(own), length = uz_unit3(whole);
    for (int b = 0; b < side->nodes; b++) {
        double B[3][3];
        for (int k = 0; k < 3; k++) {
            const double way[3] = {k == 0, k == 1, k == 2};
            double first[3], second[3];
            uz_cross3(first, way, T[1]);
            uz_cross3(second, T[0], way);
            for (int c = 0; c < 3; c++)
                B[c][k] = slope[b][0] * first[c] + slope[b][1] * second[c];
        }
        of_unit(B, own, area);
        of_unit(B, whole, length);
        for (int64_t q = sites->first[p] - 1; q < sites->first[p + 1]; q++) { /* the slave, then masters */
            const bool slave = q < sites->first[p];
            const double factor = w->along[p] * (slave ? 1 : -sites->weight[q]);
            double part[9];
            for (int k = 0; k < 9; k++)
                part[k] = factor * B[k / 3][k % 3];
            uz_add_carried_block(&w->out->force, w->rows, slave ? sites->at[p] : sites->node[q], side->node[b], part);
        }
    }
}

static void turn_normals(work *w)
{
    const uz_mortar_surface *surface = &w->pair->surface;
    for (int pass = 0; pass < 2; pass++)
        for (int64_t i = 0; i < surface->n; i++)
            for (int a = 0; a < surface->side[i].nodes; a++) {
                const uz_mortar_side *side = &surface->side[i];
                const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
                double normal[3];
                if (w->along[side->place[a]] == 0)
                    continue;
                if (pass == 1) {
                    turn_normal(w, side, a);
                    continue;
                }
                uz_side_area_vector(normal, &shape, uz_side_local_nodes(&shape)[a]);
                uz_unit3(normal);
                for (int c = 0; c < 3; c++)
                    w->sum[3 * side->place[a] + c] += normal[c];
            }
}

/* ---- points that slide */

/* Of one slave side and one master side: forces on nodes of the master, and gaps of the slave's places, by
 * displacements of the nodes of both, the slave's first. */
typedef struct {
    double force[NODES][3][BOTH][3], gap[NODES][BOTH][3];
} slopes;

/* share: of the point in the dual functions, `every` apart; across: the plane on which both sides are projected. */
static void add_point(slopes *to, const work *w, const uz_mortar_side *side, const uz_mortar_point *p,
                      const double *share, int64_t every, const double across[3])
{
    const uz_mortar_surface *surface = &w->pair->surface;
    const uz_mortar_side *other = &surface->side[p->master];
    double T[2][3], slope[NODES][3], area[3], normal[3] = {0}, moves[BOTH], force[3] = {0};
    tangents(T, slope, other, p->local);
    uz_cross3(area, T[0], T[1]);
    for (int i = 0; i < 2; i++) { /* of the tangents what is along the plane */
        const double off = uz_dot3(T[i], across);
        for (int c = 0; c < 3; c++)
            T[i][c] -= off * across[c];
    }
    const double J[2][2] = {{uz_dot3(T[0], T[0]), uz_dot3(T[0], T[1])}, {uz_dot3(T[1], T[0]), uz_dot3(T[1], T[1])}};
    const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    for (int a = 0; a < side->nodes; a++) {
        const int64_t place = side->place[a];
        const double part = w->sites->area[place] > 0 ? share[a * every] / w->sites->area[place] : 0;
        for (int c = 0; c < 3; c++) {
            force[c] += part * w->shares[3 * place + c];
            normal[c] += p->N[a] * surface->normal[3 * place + c];
        }
    }
    uz_unit3(normal);
    const double closes = -uz_dot3(normal, across) / uz_dot3(area, across);
    for (int a = 0; a < side->nodes; a++)
        moves[a] = p->N[a];
    for (int b = 0; b < other->nodes; b++)
        moves[side->nodes + b] = -p->M[b];
    const int count = side->nodes + other->nodes;
    for (int l = 0; l < other->nodes; l++) {
        const double local[2] = {(J[1][1] * slope[l][0] - J[1][0] * slope[l][1]) / det,
                                 (J[0][0] * slope[l][1] - J[0][1] * slope[l][0]) / det};
        double by[3];
        for (int k = 0; k < 3; k++)
            by[k] = local[0] * T[0][k] + local[1] * T[1][k];
        for (int c = 0; c < 3; c++)
            for (int b = 0; b < count; b++)
                for (int k = 0; k < 3; k++)
                    to->force[l][c][b][k] += force[c] * moves[b] * by[k];
    }
    for (int a = 0; a < side->nodes; a++) {
        const int64_t place = side->place[a];
        const double part = w->row[place] >= 0 ? share[a * every] / w->sites->area[place] : 0;
        for (int b = 0; b < count && part != 0; b++)
            for (int k = 0; k < 3; k++)
                to->gap[a][b][k] += part * closes * area[k] * moves[b];
    }
}

static void take_slopes(work *w, const slopes *of, const uz_mortar_side *side, const uz_mortar_side *other)
{
    const int count = side->nodes + other->nodes;
    for (int b = 0; b < count; b++) {
        const int64_t j = b < side->nodes ? side->node[b] : other->node[b - side->nodes];
        for (int l = 0; l < other->nodes; l++) {
            double B[9];
            for (int c = 0; c < 3; c++)
                memcpy(B + 3 * c, of->force[l][c][b], 3 * sizeof *B);
            uz_add_carried_block(&w->out->force, w->rows, other->node[l], j, B);
        }
        for (int a = 0; a < side->nodes; a++)
            if (w->row[side->place[a]] >= 0)
                uz_add_carried_row(&w->out->gap, w->row[side->place[a]], w->rows, j, of->gap[a][b]);
    }
}

static bool slide_side(work *w, int64_t i, double **share, int64_t *most, slopes *room)
{
    uz_mortar_pair *pair = w->pair;
    const uz_mortar_side *side = &pair->surface.side[i];
    const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
    const double centre[2] = {side->nodes % 3 == 0 ? 1.0 / 3 : 0, side->nodes % 3 == 0 ? 1.0 / 3 : 0};
    double across[3], D[NODES];
    bool any = false;
    for (int a = 0; a < side->nodes; a++)
        any = any || uz_dot3(w->shares + 3 * side->place[a], w->shares + 3 * side->place[a]) > 0;
    if (!any)
        return true;
    if (!uz_mortar_find_slave_points(pair, w->sites, i))
        return false;
    const uz_mortar_points *points = &pair->points;
    if (!uz_grow(share, 0, points->n * NODES, most, sizeof **share))
        return false;
    if (points->n == 0 || !uz_mortar_shares(*share, D, pair, i))
        return true;
    uz_side_area_vector(across, &shape, centre);
    uz_unit3(across);
    for (int64_t g = 0; g < points->n; g++) {
        const uz_mortar_point *p = &points->point[g];
        if (g == 0 || p[-1].master != p->master)
            memset(room, 0, sizeof *room);
        add_point(room, w, side, p, *share + g, points->n, across);
        if (g + 1 == points->n || p[1].master != p->master)
            take_slopes(w, room, side, &pair->surface.side[p->master]);
    }
    return true;
}

static bool slide_all(work *w)
{
    double *share = NULL;
    int64_t most = 0;
    slopes *own = uz_alloc(1, sizeof *own);
    bool room = own != NULL;
    for (int64_t i = 0; i < w->pair->surface.n && room; i++)
        room = slide_side(w, i, &share, &most, own);
    free(share);
    free(own);
    return room;
}

/* What the gaps' slopes are off -N. */
static void add_rows(work *w)
{
    const uz_csc *N = &w->rows->N;
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
            const int64_t i = N->idx[q];
            if (w->rows->info.contact_of[i] == w->contact && w->r[i] < -w->least)
                uz_entries_add(&w->out->gap, i, j, N->val[q]);
        }
}

static uz_status turn_contact(uz_row_turn *out, const uz_contact_input *in, const uz_body_model *rows, const double *r,
                              double least, uz_error *err)
{
    const int64_t n = rows->sites[in->index].n;
    uz_mortar_pair pair;
    work w = {.out = out, .rows = rows, .sites = &rows->sites[in->index], .r = r, .least = least, .pair = &pair};
    w.contact = in->index;
    w.row = uz_alloc(n, sizeof *w.row);
    w.along = uz_alloc_zero(7 * n, sizeof *w.along);
    w.shares = w.along ? w.along + n : NULL;
    w.sum = w.along ? w.along + 4 * n : NULL;
    uz_status status = uz_mortar_pair_make(&pair, in, err);
    bool room = w.row && w.along;
    if (status == UZ_OK && room) {
        weigh_places(&w);
        turn_normals(&w);
        room = slide_all(&w);
        add_rows(&w);
    }
    if (status == UZ_OK && (!room || out->force.failed || out->gap.failed))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for how contact rows turn");
    uz_mortar_pair_clear(&pair);
    free(w.row);
    free(w.along);
    return status;
}

uz_status uz_row_turn_in_space(uz_row_turn *out, const uz_body_model *base, const uz_body_model *rows,
                               const uz_scene *scene, const double *r, double least, uz_error *err)
{
    const int64_t n = 3 * base->mesh.n_nodes;
    uz_body_model there = *rows;
    double *xyz = uz_alloc(n, sizeof *xyz);
    uz_status status = xyz ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for how contact rows turn");
    for (int64_t i = 0; i < n && xyz; i++)
        xyz[i] = base->mesh.xyz[i] + rows->place[i];
    there.mesh.xyz = xyz;
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        uz_contact_input in;
        if (scene->contacts[k].kind != UZ_OBSTACLE_BODY)
            continue;
        status = uz_contact_input_of(&in, &there, scene, k, err);
        in.rest = base;
        if (status == UZ_OK)
            status = turn_contact(out, &in, rows, r, least, err);
    }
    free(xyz);
    return status;
}
