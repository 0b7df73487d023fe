/* mortar.c: contact of two surfaces by dual mortar rows.
 *
 * The pressure is a combination of dual functions psi_j, one for each place j of the slave surface, and the gap is not
 * to be negative in the mean with each of them:
 *
 *     D_j = int psi_j,   M_jl = int psi_j N_l,   g_j = int psi_j g / D_j + n_j . (u_j - sum_l M_jl / D_j u_l) >= 0,
 *
 * with n_j towards the slave; the reaction of the row is -D_j times the pressure there. On each slave side psi_j is the
 * combination of its shape functions with int psi_j N_k = delta_jk int N_j, integrals over the covered part only, so
 * that a row has one slave node and a uniform pressure is a solution exactly, whatever the two meshes.
 *   B. Wohlmuth, "A mortar finite element method using dual spaces for the Lagrange multiplier", SIAM J. Numer. Anal.
 * 38 (2000) 989-1012; A. Popp, M. Gitterle, M. Gee, W. Wall, "A dual mortar approach for 3D finite deformation contact
 *   with consistent linearization", Int. J. Numer. Meth. Engng 83 (2010) 1428-1465; T. Cichosz, M. Bischoff,
 *   "Consistent treatment of boundaries with mortar contact formulations using dual Lagrange multipliers", Comput.
 *   Methods Appl. Mech. Engrg. 200 (2011) 1317-1332.
 *
 * The slave is the side with the finer mesh where the two face each other, whichever of them is called `on`. */
#include "assembly/mortar.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/projection.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A place of which a smaller part is covered has no row: the pressure there would be that of a corner of the contact,
 * over an area that says nothing. */
#define LEAST_COVER 0.05

/* Contributions below this part of the whole are rounding. */
#define ROUNDING 1e-13

/* So has the area of a place: of a quadratic edge that ends on the axis of revolution the end has none. */
#define ROUNDING_AREA 1e-9

/* ---- which side is the slave */

/* Distance between neighbouring nodes. */
static double spacing(const uz_mortar_side *side)
{
    return hypot(side->xyz[2] - side->xyz[0], side->xyz[3] - side->xyz[1]) / (side->nodes - 1);
}

/* Is the master finer than the slave where they face each other? */
static bool is_master_finer(const uz_mortar_points *points, const uz_mortar_surface *slave,
                            const uz_mortar_surface *master)
{
    double fine[2] = {0, 0};
    for (int64_t q = 0; q < points->n; q++) {
        const uz_mortar_point *p = &points->point[q];
        fine[0] += p->weight / spacing(&slave->side[p->slave]);
        fine[1] += p->weight / spacing(&master->side[p->master]);
    }
    return fine[1] > (1 + 1e-6) * fine[0];
}

/* ---- rows */

/* The integrals that rows are made of; M by entries. */
typedef struct {
    double *D, *whole, *gap; /* n_places; whole: of the shape function over all of its sides ... */
    double *around;          /* ... and their areas */
    double *most;            /* n_places: the largest weight of a point, whose master face the row is told by */
    int64_t entries, room, *place, *node;
    double *value;
} integrals;

static void clear(integrals *to)
{
    free(to->D);
    free(to->place);
    free(to->node);
    free(to->value);
}

/* Orthonormal columns by Gram and Schmidt, twice for rounding: A (count x n, by columns) = Q R, R by columns. A column
 * that is nothing new but for rounding: false. */
static bool orthonormalize(double *A, double R[UZ_FACE_NODES][UZ_FACE_NODES], int64_t count, int n)
{
    memset(R, 0, (size_t)UZ_FACE_NODES * sizeof *R);
    for (int j = 0; j < n; j++) {
        double *a = A + j * count, before = 0, after = 0;
        for (int64_t g = 0; g < count; g++)
            before += a[g] * a[g];
        for (int pass = 0; pass < 2; pass++)
            for (int k = 0; k < j; k++) {
                double along = 0;
                for (int64_t g = 0; g < count; g++)
                    along += A[k * count + g] * a[g];
                for (int64_t g = 0; g < count; g++)
                    a[g] -= along * A[k * count + g];
                R[j][k] += along;
            }
        for (int64_t g = 0; g < count; g++)
            after += a[g] * a[g];
        R[j][j] = sqrt(after);
        if (!(after > 1e-24 * before))
            return false;
        for (int64_t g = 0; g < count; g++)
            a[g] /= R[j][j];
    }
    return true;
}

static bool add_master(integrals *to, int64_t place, int64_t node, double value)
{
    if (to->entries == to->room) {
        const int64_t room = 2 * to->room + 1024;
        int64_t *places = uz_realloc(to->place, room, sizeof *places);
        to->place = places ? places : to->place;
        int64_t *nodes = uz_realloc(to->node, room, sizeof *nodes);
        to->node = nodes ? nodes : to->node;
        double *values = uz_realloc(to->value, room, sizeof *values);
        to->value = values ? values : to->value;
        if (!places || !nodes || !values)
            return false;
        to->room = room;
    }
    to->place[to->entries] = place;
    to->node[to->entries] = node;
    to->value[to->entries++] = value;
    return true;
}

/* The share of one slave side, whose points these are: with A = sqrt(w) N = Q R the dual functions at the points are
 * Q R^-T diag(int N) / sqrt(w). Where the part that is covered is too small for that it is left out. A: room for count
 * x nodes. */
static bool add_side(integrals *to, uz_contact_sites *sites, const uz_mortar_surface *slave,
                     const uz_mortar_surface *master, const uz_mortar_point *point, int64_t count, double *A)
{
    const uz_mortar_side *side = &slave->side[point->slave];
    const int n = side->nodes;
    double R[UZ_FACE_NODES][UZ_FACE_NODES], D[UZ_FACE_NODES] = {0};
    for (int a = 0; a < n; a++)
        for (int64_t g = 0; g < count; g++) {
            A[a * count + g] = sqrt(point[g].weight) * point[g].N[a];
            D[a] += point[g].weight * point[g].N[a];
        }
    if (!orthonormalize(A, R, count, n))
        return true;
    for (int a = 0; a < n; a++)
        to->D[side->place[a]] += D[a];
    for (int64_t g = 0; g < count; g++) {
        const uz_mortar_side *other = &master->side[point[g].master];
        double psi[UZ_FACE_NODES]; /* R psi' = Q', from the last row up */
        for (int j = n - 1; j >= 0; j--) {
            psi[j] = A[j * count + g];
            for (int k = j + 1; k < n; k++)
                psi[j] -= R[k][j] * psi[k];
            psi[j] /= R[j][j];
        }
        for (int a = 0; a < n; a++) {
            const int64_t place = side->place[a];
            const double share = psi[a] * D[a] * sqrt(point[g].weight);
            to->gap[place] += share * point[g].gap;
            if (point[g].weight * fabs(point[g].N[a]) > to->most[place]) {
                to->most[place] = point[g].weight * fabs(point[g].N[a]);
                sites->face[place] = other->face;
            }
            for (int b = 0; b < other->nodes; b++)
                if (!add_master(to, place, other->node[b], share * point[g].M[b]))
                    return false;
        }
    }
    return true;
}

static bool add_sides(integrals *to, uz_contact_sites *sites, const uz_mortar_points *points,
                      const uz_mortar_surface *slave, const uz_mortar_surface *master, const uz_body_model *model)
{
    int64_t most = 0, end;
    for (int64_t first = 0; first < points->n; first = end) {
        for (end = first; end < points->n && points->point[end].slave == points->point[first].slave;)
            end++;
        most = end - first > most ? end - first : most;
    }
    double *A = uz_alloc(UZ_FACE_NODES * most, sizeof *A);
    bool room = A != NULL;
    for (int64_t first = 0; first < points->n && room; first = end) {
        for (end = first; end < points->n && points->point[end].slave == points->point[first].slave;)
            end++;
        room = add_side(to, sites, slave, master, points->point + first, end - first, A);
    }
    free(A);
    for (int64_t i = 0; i < slave->n && room; i++) {
        uz_side side;
        double xyz[3 * UZ_FACE_NODES], weight[UZ_FACE_NODES];
        int64_t node[UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, model, slave->side[i].face);
        uz_side_weights(weight, &side);
        for (int a = 0; a < side.nodes; a++) {
            to->whole[slave->side[i].place[a]] += weight[a];
            to->around[slave->side[i].place[a]] += uz_side_area(&side);
        }
    }
    return room;
}

/* Fills the sites from the integrals: places without a row keep an infinite gap. */
static uz_status fill_sites(uz_contact_sites *sites, const integrals *of, const uz_mortar_surface *slave,
                            const uz_body_model *model, uz_error *err)
{
    const int dim = model->mesh.dim;
    int64_t kept = 0;
    uz_csc M = {0};
    const uz_status status =
        uz_csc_from_triplets(&M, model->mesh.n_nodes, sites->n, of->entries, of->node, of->place, of->value, err);
    if (status != UZ_OK)
        return status;
    sites->first = uz_alloc_zero(sites->n + 1, sizeof *sites->first);
    sites->node = uz_alloc(M.ptr[M.cols], sizeof *sites->node);
    sites->weight = uz_alloc(M.ptr[M.cols], sizeof *sites->weight);
    const bool room = sites->first && sites->node && sites->weight;
    for (int64_t p = 0; p < sites->n && room; p++) {
        const double D = of->D[p];
        const bool row = D > LEAST_COVER * of->whole[p] && D > ROUNDING_AREA * of->around[p];
        for (int64_t q = M.ptr[p]; q < M.ptr[p + 1] && row; q++)
            if (fabs(M.val[q]) > ROUNDING * D) {
                sites->node[kept] = M.idx[q];
                sites->weight[kept++] = M.val[q] / D;
            }
        sites->first[p + 1] = kept;
        sites->gap[p] = row ? of->gap[p] / D : INFINITY;
        sites->area[p] = row ? D : 0;
        sites->at[p] = slave->node[p];
        for (int c = 0; c < dim; c++)
            sites->normal[p * dim + c] = -slave->normal[p * dim + c];
    }
    uz_csc_clear(&M);
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact between two surfaces");
}

static uz_status make_rows(uz_contact_sites *sites, const uz_contact_input *in, const uz_mortar_points *points,
                           const uz_mortar_surface *slave, const uz_mortar_surface *master, uz_error *err)
{
    const int64_t n = slave->n_places;
    integrals of = {.D = uz_alloc_zero(5 * n, sizeof *of.D)};
    sites->gap = uz_alloc(n, sizeof *sites->gap);
    sites->normal = uz_alloc(n * in->model->mesh.dim, sizeof *sites->normal);
    sites->area = uz_alloc(n, sizeof *sites->area);
    sites->at = uz_alloc(n, sizeof *sites->at);
    sites->face = uz_alloc_zero(n, sizeof *sites->face);
    uz_status status = UZ_ERR_MEMORY;
    if (of.D && sites->gap && sites->normal && sites->area && sites->at && sites->face) {
        sites->n = n;
        of.whole = of.D + n;
        of.gap = of.D + 2 * n;
        of.most = of.D + 3 * n;
        of.around = of.D + 4 * n;
        if (add_sides(&of, sites, points, slave, master, in->model))
            status = fill_sites(sites, &of, slave, in->model, err);
    }
    clear(&of);
    return status != UZ_ERR_MEMORY ? status
                                   : uz_fail(err, UZ_ERR_MEMORY, "",
                                             "no memory for contact between two surfaces of %lld nodes", (long long)n);
}

/* The lowest node of a group: which surface is looked at first may not depend on what the two are called. */
static bool begins_before(const uz_group *a, const uz_group *b)
{
    return a->node[0] < b->node[0];
}

static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    uz_mortar_surface slave = {0}, master = {0};
    uz_mortar_points points = {0};
    char where[96];
    uz_status status = uz_contact_pair_check(&in->model->mesh, in->on, in->with, in->index, err);
    if (status != UZ_OK)
        return status;
    const bool straight = begins_before(in->on, in->with);
    sites->swapped = !straight;
    status = uz_mortar_plane_surface(&slave, in, straight ? in->on : in->with, err);
    if (status == UZ_OK)
        status = uz_mortar_plane_surface(&master, in, straight ? in->with : in->on, err);
    if (status == UZ_OK)
        status = uz_mortar_plane_points(&points, in, &slave, &master, err);
    if (status == UZ_OK && is_master_finer(&points, &slave, &master)) {
        const uz_mortar_surface other = slave;
        slave = master;
        master = other;
        sites->swapped = straight;
        points.n = 0;
        status = uz_mortar_plane_points(&points, in, &slave, &master, err);
    }
    if (status == UZ_OK && points.n == 0) {
        snprintf(where, sizeof where, "/contacts/%lld/on", (long long)in->index);
        status =
            uz_fail(err, UZ_ERR_SCENE, where, "no part of \"%.63s\" faces \"%.63s\"", in->on->name, in->with->name);
    }
    if (status == UZ_OK)
        status = make_rows(sites, in, &points, &slave, &master, err);
    uz_mortar_surface_clear(&slave);
    uz_mortar_surface_clear(&master);
    free(points.point);
    return status;
}

/* ---- the discretization */

static int64_t places(const uz_contact_input *in)
{
    return in->model->sites[in->index].n;
}

static bool row(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place)
{
    static const double whole = 1;
    const int dim = in->model->mesh.dim;
    const int64_t first = sites->first[place];
    *row = (uz_contact_row){.node = sites->at[place],
                            .face = sites->face[place],
                            .gap = sites->gap[place],
                            .slaves = 1,
                            .slave_share = &whole,
                            .masters = (int)(sites->first[place + 1] - first),
                            .master = sites->node + first,
                            .master_share = sites->weight + first};
    row->slave = &row->node;
    memcpy(row->normal, sites->normal + place * dim, (size_t)dim * sizeof *row->normal);
    return isfinite(row->gap);
}

static void areas(double *area, const uz_contact_input *in)
{
    const uz_contact_sites *sites = &in->model->sites[in->index];
    memcpy(area, sites->area, (size_t)sites->n * sizeof *area);
}

const uz_contact_discretization uz_surface_to_surface = {
    .name = "surface to surface", .places = places, .find = find, .row = row, .areas = areas};
