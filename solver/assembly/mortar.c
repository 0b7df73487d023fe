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
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "obstacle/projection.h"
#include "scene/check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A place of which a smaller part is covered has no row: the pressure there would be that of a corner of the contact,
 * over an area that says nothing. */
#define LEAST_COVER 0.05

/* Where a contact names none: degrees. */
#define FEATURE_ANGLE 40

#define PI 3.14159265358979323846

/* Contributions below this part of the whole are rounding. */
#define ROUNDING 1e-13

/* So has the area of a place: of a quadratic edge that ends on the axis of revolution the end has none. */
#define LEAST_AREA 1e-9

/* ---- surfaces */

const uz_mortar_geometry *uz_mortar_geometry_of(int dim)
{
    return dim == 2 ? &uz_mortar_plane : &uz_mortar_space;
}

double uz_mortar_least_cosine(const uz_contact_input *in)
{
    const double degrees = in->contact->feature_angle > 0 ? in->contact->feature_angle : FEATURE_ANGLE;
    return cos(degrees * PI / 180);
}

uz_side uz_mortar_side_of(const uz_mortar_side *side, const uz_body_model *model)
{
    return (uz_side){.dim = model->mesh.dim,
                     .nodes = side->nodes,
                     .model = model->kind,
                     .thickness = model->thickness,
                     .xyz = side->xyz};
}

const uz_mortar_side *uz_mortar_rest(const uz_mortar_surface *surface, const uz_mortar_side *side)
{
    return surface->rest ? &surface->rest->side[side - surface->side] : side;
}

void uz_mortar_surface_clear(uz_mortar_surface *surface)
{
    uz_box_tree_clear(&surface->tree);
    uz_free_all(surface->side, surface->node, surface->normal, surface->patch);
}

uz_status uz_mortar_surface_make(uz_mortar_surface *out, const uz_contact_input *in, const uz_group *group,
                                 uz_error *err)
{
    *out = (uz_mortar_surface){.n = group->n_faces, .side = uz_alloc_zero(group->n_faces, sizeof *out->side)};
    uz_status status = out->side ? UZ_OK : uz_no_memory(err, UZ_OF_SURFACES);
    for (int64_t i = 0; i < out->n && status == UZ_OK; i++) {
        uz_mortar_side *side = &out->side[i];
        uz_side shape;
        side->face = group->face[i];
        uz_body_side(&shape, side->xyz, side->node, in->model, side->face);
        side->nodes = shape.nodes;
        side->area = uz_side_area(&shape);
        if (side->area > 0)
            continue;
        status = uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", in->index, NULL),
                         "the side at node %lld of \"%.63s\" has no area, and so no normal", (long long)side->node[0],
                         group->name);
    }
    if (status == UZ_OK && !uz_mortar_geometry_of(in->model->mesh.dim)->places(out, in))
        status = uz_no_memory(err, UZ_OF_SURFACES);
    return status;
}

/* ---- points */

bool uz_mortar_add_point(uz_mortar_points *points, const uz_mortar_point *p)
{
    if (!uz_grow(&points->point, points->n, 1, &points->room, sizeof *points->point))
        return false;
    points->point[points->n++] = *p;
    return true;
}

/* ---- rows */

/* The integrals that rows are made of, by place. */
typedef struct {
    double *D, *whole, *gap; /* whole: of the shape function over all of its sides ... */
    double *around;          /* ... and their areas */
    double *least;           /* gaps below it are none that points of the place's sides have */
    double *most;            /* the largest share that a master side has, by which the row is told */
    uz_entries masters;      /* node, place */
} integrals;

/* Orthonormal columns by Gram and Schmidt, twice for rounding: A (count x n, by columns) = Q R, R by columns. False: a
 * column is nothing new but for rounding. */
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

/* Of a face with middles the shape functions that take the part of shape functions: those of corners have a share of
 * their edges' middles, without which they are of integral 0 (six nodes) or negative (eight). See
 * uz_side_positive_weights. Integrals transform alike. */
static void transform(double *N, int nodes, int dim)
{
    const int corners = nodes / 2;
    for (int j = 0; j < corners && dim == 3 && nodes >= 6; j++) {
        N[j] += UZ_MIDDLE_SHARE * N[corners + j];
        N[(j + 1) % corners] += UZ_MIDDLE_SHARE * N[corners + j];
    }
    for (int j = 0; j < corners && dim == 3 && nodes >= 6; j++)
        N[corners + j] *= 1 - 2 * UZ_MIDDLE_SHARE;
}

/* With A = sqrt(w) N = Q R the dual functions at the points are Q R^-T diag(int N) / sqrt(w). */
bool uz_mortar_shares(double *share, double D[UZ_FACE_NODES], const uz_mortar_pair *pair, int64_t i)
{
    const uz_mortar_points *points = &pair->points;
    const int n = pair->surface.side[i].nodes, dim = pair->in->model->mesh.dim;
    const int64_t count = points->n;
    double R[UZ_FACE_NODES][UZ_FACE_NODES], *A = share;
    memset(D, 0, UZ_FACE_NODES * sizeof *D);
    for (int64_t g = 0; g < count; g++) {
        double N[UZ_FACE_NODES];
        memcpy(N, points->point[g].N, sizeof N);
        transform(N, n, dim);
        for (int a = 0; a < n; a++) {
            A[a * count + g] = sqrt(points->point[g].weight) * N[a];
            D[a] += points->point[g].weight * N[a];
        }
    }
    if (count < n || !orthonormalize(A, R, count, n))
        return false;
    for (int64_t g = 0; g < count; g++) {
        double psi[UZ_FACE_NODES] = {0}; /* R psi' = Q', from the last row up */
        for (int j = n - 1; j >= 0; j--) {
            psi[j] = A[j * count + g];
            for (int k = j + 1; k < n; k++)
                psi[j] -= R[k][j] * psi[k];
            psi[j] /= R[j][j];
        }
        for (int a = 0; a < n; a++)
            share[a * count + g] = psi[a] * D[a] * sqrt(points->point[g].weight);
    }
    return true;
}

/* The share of one slave side with its points. A side of which too little is covered for that is left out. */
static bool add_side(integrals *to, uz_contact_sites *sites, const uz_mortar_pair *pair, int64_t i, double *A)
{
    const uz_mortar_points *points = &pair->points;
    const uz_mortar_side *side = &pair->surface.side[i];
    const int n = side->nodes, dim = pair->in->model->mesh.dim;
    const int64_t count = points->n;
    double D[UZ_FACE_NODES], M[UZ_FACE_NODES][UZ_FACE_NODES] = {{0}};
    if (!uz_mortar_shares(A, D, pair, i))
        return true;
    double least = INFINITY, shortest = INFINITY;
    const int corners = dim == 2 ? 2 : n % 3 == 0 ? 3 : 4;
    for (int64_t g = 0; g < count; g++)
        least = fmin(least, points->point[g].gap);
    for (int a = 0; a < corners; a++)
        shortest = fmin(shortest, uz_distance2(side->xyz + a * dim, side->xyz + (a + 1) % corners * dim, dim));
    for (int a = 0; a < n; a++) {
        to->D[side->place[a]] += D[a];
        to->least[side->place[a]] = fmin(to->least[side->place[a]], least - sqrt(shortest));
    }
    for (int64_t g = 0; g < count; g++) {
        const uz_mortar_point *p = &points->point[g];
        const uz_mortar_side *other = &pair->surface.side[p->master];
        for (int a = 0; a < n; a++) {
            const double share = A[a * count + g];
            to->gap[side->place[a]] += share * p->gap;
            for (int b = 0; b < other->nodes; b++)
                M[a][b] += share * p->M[b];
        }
        if (g + 1 < count && points->point[g + 1].master == p->master)
            continue;
        for (int a = 0; a < n; a++) { /* all points on this master side are seen */
            const int64_t place = side->place[a];
            double sum = 0;
            for (int b = 0; b < other->nodes; b++) {
                sum += M[a][b];
                if (!uz_entries_add(&to->masters, other->node[b], place, M[a][b]))
                    return false;
            }
            if (fabs(sum) > to->most[place]) {
                to->most[place] = fabs(sum);
                sites->face[place] = other->face;
                sites->of[place] = (unsigned char)((pair->of[i] & UZ_OF_ON ? UZ_SLAVE_ON : 0) |
                                                   (pair->of[i] & UZ_OF_WITH ? UZ_SLAVE_WITH : 0) |
                                                   (pair->of[p->master] & UZ_OF_ON ? UZ_MASTER_ON : 0));
            }
        }
        memset(M, 0, sizeof M);
    }
    return true;
}

bool uz_mortar_find_slave_points(uz_mortar_pair *pair, const uz_contact_sites *sites, int64_t i)
{
    uz_mortar_points *points = &pair->points;
    const bool found = uz_mortar_find_points(pair, i);
    int64_t kept = 0;
    for (int64_t g = 0; g < points->n && found; g++)
        if (uz_mortar_is_slave(sites, i, points->point[g].master))
            points->point[kept++] = points->point[g];
    points->n = kept;
    return found;
}

/* Integrals over all sides that are slaves, as far as they are. False: no memory. */
static bool integrate(integrals *of, uz_contact_sites *sites, uz_mortar_pair *pair)
{
    const uz_mortar_surface *surface = &pair->surface;
    const int dim = pair->in->model->mesh.dim;
    double *A = NULL;
    int64_t room = 0;
    for (int64_t i = 0; i < surface->n; i++) {
        const uz_mortar_side *side = &surface->side[i];
        const uz_side shape = uz_mortar_side_of(side, pair->in->model);
        const int corners = side->nodes / 2;
        double weight[UZ_FACE_NODES];
        uz_side_weights(weight, &shape);
        transform(weight, side->nodes, dim);
        for (int a = 0; a < side->nodes; a++) {
            const int64_t place = side->place[a];
            of->whole[place] += weight[a];
            of->around[place] += side->area;
            for (int k = 0; k < 2 && dim == 3 && side->nodes >= 6 && a >= corners; k++)
                sites->ends[2 * place + k] = side->place[(a - corners + k) % corners];
        }
        if (sites->n_zones == 2 && sites->n_ranks == 1 && sites->zone[i] == sites->rank[1])
            continue; /* the master of all that it faces */
        if (uz_mortar_find_slave_points(pair, sites, i) &&
            uz_grow(&A, 0, UZ_FACE_NODES * pair->points.n, &room, sizeof *A) && add_side(of, sites, pair, i, A))
            continue;
        free(A);
        return false;
    }
    free(A);
    return true;
}

/* A place with a row that is a middle between two ends with rows. */
static bool is_middle(const uz_contact_sites *sites, int64_t place)
{
    const int64_t *end = sites->ends + 2 * place;
    return end[0] >= 0 && isfinite(sites->gap[place]) && isfinite(sites->gap[end[0]]) && isfinite(sites->gap[end[1]]);
}

/* Fills the sites from the integrals: places without a row keep an infinite gap. contact_rows.c makes of the row of a
 * middle the transformed one, (row - s (first + second)) / (1 - 2 s), which moves the right slaves; the masters and the
 * gap, which are those of the transformed row already, are put in here so that they come out right. */
static uz_status fill_sites(uz_contact_sites *sites, integrals *of, const uz_mortar_surface *slave,
                            const uz_body_model *model, uz_error *err)
{
    const double s = UZ_MIDDLE_SHARE;
    const int dim = model->mesh.dim;
    uz_csc M = {0};
    uz_entries kept = {.n = 0};
    uz_status status = uz_csc_from_entries(&M, model->mesh.n_nodes, sites->n, &of->masters, err);
    if (status != UZ_OK)
        return status;
    /* Where what covers a part of a side is far and steep, as the arm of a fold over its bend, the gap at the other end
     * is that of a line through the gaps there, extended to nowhere: below all of them by more than the side's length.
     */
    for (int64_t p = 0; p < sites->n; p++) {
        const bool row = of->D[p] > LEAST_COVER * of->whole[p] && of->D[p] > LEAST_AREA * of->around[p] &&
                         of->gap[p] >= of->least[p] * of->D[p];
        sites->gap[p] = row ? of->gap[p] / of->D[p] : INFINITY;
        sites->area[p] = row ? of->D[p] : 0;
        sites->at[p] = slave->node[p];
        for (int c = 0; c < dim; c++)
            sites->normal[p * dim + c] = -slave->normal[p * dim + c];
    }
    /* A column of masters for each row; of a middle with those of its ends. */
    for (int64_t p = 0; p < sites->n; p++) {
        const bool middle = isfinite(sites->gap[p]) && is_middle(sites, p);
        for (int k = 0; k < (middle ? 3 : 1) && isfinite(sites->gap[p]); k++) {
            const int64_t from = k == 0 ? p : sites->ends[2 * p + k - 1];
            const double share = (!middle ? 1 : k == 0 ? 1 - 2 * s : s) / of->D[from];
            for (int64_t q = M.ptr[from]; q < M.ptr[from + 1]; q++)
                if (fabs(M.val[q]) > ROUNDING * of->D[from])
                    uz_entries_add(&kept, M.idx[q], p, share * M.val[q]);
        }
    }
    for (int64_t p = 0; p < sites->n; p++) /* ends are no middles: their gaps are their own yet */
        if (is_middle(sites, p))
            sites->gap[p] =
                (1 - 2 * s) * sites->gap[p] + s * (sites->gap[sites->ends[2 * p]] + sites->gap[sites->ends[2 * p + 1]]);
        else
            sites->ends[2 * p] = sites->ends[2 * p + 1] = -1;
    uz_csc_clear(&M);
    status = uz_csc_from_entries(&M, model->mesh.n_nodes, sites->n, &kept, err);
    if (status == UZ_OK && !(sites->node = uz_alloc(M.ptr[M.cols], sizeof *sites->node)))
        status = uz_no_memory(err, UZ_OF_SURFACES);
    for (int64_t q = 0; status == UZ_OK && q < M.ptr[M.cols]; q++)
        sites->node[q] = M.idx[q];
    free(M.idx);
    sites->first = M.ptr;
    sites->weight = M.val;
    return status;
}

static uz_status make_rows(uz_contact_sites *sites, uz_mortar_pair *pair, uz_error *err)
{
    const int64_t n = pair->surface.n_places;
    const uz_body_model *model = pair->in->model;
    integrals of = {.D = uz_alloc_zero(6 * n, sizeof *of.D)};
    sites->gap = uz_alloc(n, sizeof *sites->gap);
    sites->normal = uz_alloc(n * model->mesh.dim, sizeof *sites->normal);
    sites->area = uz_alloc(n, sizeof *sites->area);
    sites->at = uz_alloc(n, sizeof *sites->at);
    sites->ends = uz_alloc(2 * n, sizeof *sites->ends);
    sites->face = uz_alloc_zero(n, sizeof *sites->face);
    sites->of = uz_alloc_zero(n, sizeof *sites->of);
    bool room =
        of.D && sites->gap && sites->normal && sites->area && sites->at && sites->ends && sites->face && sites->of;
    if (room) {
        sites->n = n;
        of.whole = of.D + n;
        of.gap = of.D + 2 * n;
        of.most = of.D + 3 * n;
        of.around = of.D + 4 * n;
        of.least = of.D + 5 * n;
        for (int64_t p = 0; p < n; p++)
            of.least[p] = INFINITY;
        memset(sites->ends, 0xff, (size_t)(2 * n) * sizeof *sites->ends);
        room = integrate(&of, sites, pair);
    }
    const uz_status status =
        room ? fill_sites(sites, &of, &pair->surface, model, err) : uz_no_memory(err, UZ_OF_SURFACES);
    free(of.D);
    uz_entries_clear(&of.masters);
    return status;
}

static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    uz_mortar_pair pair = {.in = in};
    uz_status status = uz_contact_pair_check(&in->model->mesh, in->on, in->with, in->index, err);
    if (status == UZ_OK)
        status = uz_mortar_pair_make(&pair, in, err);
    if (status == UZ_OK)
        status = uz_mortar_choose_slaves(sites, &pair, err);
    if (status == UZ_OK)
        status = make_rows(sites, &pair, err);
    /* what the sides of each group are taken for */
    const uz_mortar_surface *all = pair.rest.n > 0 ? &pair.rest : &pair.surface;
    uz_mortar_surface some = *all;
    some.side = status == UZ_OK ? uz_alloc(all->n, sizeof *some.side) : NULL;
    for (int k = 0; k < 2 && status == UZ_OK; k++) {
        some.n = 0;
        for (int64_t i = 0; i < all->n && some.side; i++)
            if (pair.of[i] & (k == 0 ? UZ_OF_ON : UZ_OF_WITH))
                some.side[some.n++] = all->side[i];
        if (!some.side || !uz_mortar_describe(&sites->surface[k], &some, in, k == 0 ? in->on : in->with))
            status = uz_no_memory(err, UZ_OF_SURFACES);
        sites->surface[k].contact = in->index;
        for (int64_t p = 0; p < sites->n; p++)
            sites->surface[k].slave =
                sites->surface[k].slave ||
                (isfinite(sites->gap[p]) && sites->of[p] & (k == 0 ? UZ_SLAVE_ON : UZ_SLAVE_WITH));
    }
    free(some.side);
    if (status == UZ_OK && sites->first[sites->n] == 0 && !in->rest && !in->later) {
        status = uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", in->index, "on"),
                         "no part of \"%.63s\" faces \"%.63s\"", in->on->name, in->with->name);
    }
    uz_mortar_pair_clear(&pair);
    return status;
}

/* ---- the discretization */

static int64_t places(const uz_contact_input *in)
{
    return in->model->sites[in->index].n;
}

static bool areas(double *area, const uz_contact_input *in)
{
    const uz_contact_sites *sites = &in->model->sites[in->index];
    memcpy(area, sites->area, (size_t)sites->n * sizeof *area);
    return true;
}

const uz_contact_discretization uz_surface_to_surface = {
    .name = "surface to surface", .places = places, .find = find, .row = uz_row_of_sites, .areas = areas};
