/* dual_problem.c: the dual problem on macro elements of hybrid type, condensed to unknowns of edges.
 *
 * An element is parted at a point (uz_bound_centre). In each part the stress is that of Airy's functions, all
 * polynomials of degree 2 to degree + 2, plus one that balances a constant force, so that equilibrium holds at every
 * point. Z spans what is in equilibrium across the edges between the parts as well. With the compliance F, the
 * resultants D s of the tractions on the element's sides (D_0 those of the force) and the displacements v there, the
 * stress s = Zz of least complementary energy 1/2 s'Fs + f's - v'(Ds + D_0) leaves of it -1/2 v'Kv + p'v with
 *
 *     LL' = Z'FZ,  B = DZ L'^-1,  y = L^-1 Z'f:     K = BB',  p = By - D_0,  z = L'^-1 (B'v - y)
 *
 * K has the rank of all moments less three. Almeida and Maunder, "Equilibrium Finite Element Formulations", 2017, ch. 5
 * (hybrid elements) and 6 (macro elements without spurious modes). */
#include "bound/macro.h"
#include "bound/walk.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MOST = UZ_MACRO_FUNCTIONS * UZ_BOUND_PARTS, /* functions of an element */
    OUTER = UZ_MACRO_OUTER,
    INNER = OUTER + UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, /* conditions within */
    KEY = UZ_MACRO_KEY,
    MADE = 4 /* elements that are kept: meshes have many alike */
};
#define MOST_KEPT ((int64_t)256 << 20)                                     /* bytes of maps */
static const double STATIONS[2][UZ_BOUND_MOMENTS] = {{0, 1}, {0, 0.5, 1}}; /* along an edge, by degree */

typedef uz_macro macro;

static double mean_gap(double normal[2], const uz_bound_body *body, int64_t i, int a);
static double mean_before(double normal[2], const uz_bound_body *body, int64_t i, int a, bool gaps);
static macro *make(macro *kept, const uz_bound_body *body, int64_t element);
static inline double dot(int n, const double *x, const double *y);
static inline void add(int n, double alpha, const double *x, double *y);
static void spread(macro *m, double *stress, const double *v);
static void weigh(macro *m);
static int64_t *order_of(const uz_bound_body *body);

/* ---- the problem */

/* What the k-th of an edge's a-th moments is given, where it is held. */
static double given(const uz_bound_body *body, int64_t edge, int a, int k)
{
    const int held = k == 0 ? uz_bound_pressed(body, edge, a) : -1;
    double normal[2];
    return held < 0                        ? body->edge[edge].value[k]
           : isnan(body->pressed_at[held]) ? mean_gap(normal, body, edge, a)
                                           : body->pressed_at[held];
}

/* Free dofs of the element's moments, -1 where held; value: what these are given. */
static void number(int64_t dof_of[OUTER], double value[OUTER], const macro *m, const int64_t *dof)
{
    const int moments = m->degree + 1;
    for (int i = 0; i < m->outer; i++) {
        const int64_t edge = m->body->edge_of[4 * m->element + i / (2 * moments)];
        dof_of[i] = dof[edge * 2 * moments + i % (2 * moments)];
        value[i] = given(m->body, edge, i % (2 * moments) / 2, i % 2);
    }
}

/* From the edges' axes to those of their moments, which differ where the normal turns: x, and K (outer x outer, the
 * lower triangle is given; NULL: none); or back. */
static void turn(double *K, double x[OUTER], const macro *m, bool back)
{
    const int n = m->outer, moments = m->degree + 1;
    bool mirrored = !K;
    for (int i = 0; i < n; i += 2) {
        const int64_t at = m->body->edge_of[4 * m->element + i / (2 * moments)];
        const uz_bound_edge *edge = &m->body->edge[at];
        double axis[2][2], R[2][2];
        if (!edge->turns)
            continue;
        for (int c = 0; c < n && !mirrored; c++)
            for (int r = 0; r < c; r++)
                K[r + n * c] = K[c + n * r];
        mirrored = true;
        uz_bound_axes(axis, m->body, at, i % (2 * moments) / 2);
        for (int r = 0; r < 2; r++)
            for (int k = 0; k < 2; k++)
                R[back ? k : r][back ? r : k] = axis[r][0] * edge->axis[k][0] + axis[r][1] * edge->axis[k][1];
        const double x0 = x[i], x1 = x[i + 1];
        x[i] = R[0][0] * x0 + R[0][1] * x1;
        x[i + 1] = R[1][0] * x0 + R[1][1] * x1;
        for (int side = 0; side < 2 && K; side++)
            for (int j = 0; j < n; j++) {
                double *one = side == 0 ? &K[i + n * j] : &K[j + n * i], *other = one + (side == 0 ? 1 : n);
                const double k0 = *one, k1 = *other;
                *one = R[0][0] * k0 + R[0][1] * k1;
                *other = R[1][0] * k0 + R[1][1] * k1;
            }
    }
}

void uz_bound_springs(double S[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS], const uz_bound_body *body, int64_t edge)
{
    const int moments = body->degree + 1;
    const double *weight = body->edge[edge].weight, times = uz_bound_measure(body, edge) / (moments * moments);
    double M[UZ_BOUND_MOMENTS][2 * UZ_BOUND_MOMENTS] = {{0}}, q,
                                   share; /* products over the weight, and what inverts them */
    for (uz_line_walk walk = uz_line_begin(weight[0], weight[1]); uz_line_next(&walk, &q, &share);) {
        double phi[UZ_BOUND_MOMENTS];
        uz_bound_bernstein(phi, moments, q);
        for (int a = 0; a < moments; a++)
            for (int b = 0; b < moments && uz_bound_weight(body, edge, a) > 0; b++)
                if (uz_bound_weight(body, edge, b) > 0)
                    M[a][b] += share * phi[a] * phi[b] / (weight[0] + q * (weight[1] - weight[0]));
    }
    for (int a = 0; a < moments; a++) {
        const bool none = !(M[a][a] > 0);
        M[a][moments + a] = none ? 0 : times;
        M[a][a] = none ? 1 : M[a][a];
    }
    for (int k = 0; k < moments; k++)
        for (int a = 0; a < moments; a++)
            for (int b = 2 * moments - 1; b >= k && a != k; b--)
                M[a][b] -= M[a][k] / M[k][k] * M[k][b];
    for (int a = 0; a < moments; a++)
        for (int b = 0; b < moments; b++)
            S[a][b] = M[a][moments + b] / M[a][a];
}

/* Springs along an edge are of its first element: a displacement with moments v has 1/2 int k |u|^2 of 1/2 v'Sv at
 * least. */
static void add_springs(double *K, const macro *m)
{
    const int moments = m->degree + 1, n = m->outer;
    for (int i = 0; i < n; i++) {
        double S[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS];
        const int64_t at = m->body->edge_of[4 * m->element + i / (2 * moments)];
        const uz_bound_edge *edge = &m->body->edge[at];
        const int first = i - i % (2 * moments), a = i % (2 * moments) / 2;
        if (!(edge->spring[i % 2] > 0) || edge->element[0] != m->element)
            continue;
        uz_bound_springs(S, m->body, at);
        for (int b = 0; b < moments; b++)
            K[i + n * (first + 2 * b + i % 2)] += edge->spring[i % 2] * S[a][b];
    }
}

static uz_status fail_at(const uz_stop *stop, int64_t element, uz_error *err)
{
    return uz_stop_is_due(stop)
               ? uz_fail(err, UZ_ERR_CANCELLED, "", "the bound was cancelled")
               : uz_fail(err, UZ_ERR_SCENE, "/mesh", "element %lld is too distorted for a stress in equilibrium",
                         (long long)element);
}

/* Does an element have a load of its own, force or expansion, or values that its unknowns are given? */
static bool has_force(const uz_bound_body *body, int64_t e)
{
    return fabs(body->force[2 * e]) > 0 || fabs(body->force[2 * e + 1]) > 0 ||
           (body->free_strain && fabs(body->free_strain[e]) > 0);
}

static bool has_values(const uz_bound_body *body, int64_t e)
{
    const int sides = uz_element_type_of((uz_element_kind)body->model->mesh.kind[e])->corners;
    bool has = body->n_pressed > 0;
    for (int i = 0; i < 2 * sides; i++)
        has = has || fabs(body->edge[body->edge_of[4 * e + i / 2]].value[i % 2]) > 0;
    return has;
}

/* Edges from one on that have an element with it, ascending. */
static int edges_beside(int64_t beside[2 * UZ_BOUND_PARTS], const uz_bound_body *body, int64_t edge)
{
    int n = 1;
    beside[0] = edge;
    for (int k = 0; k < 2 && body->edge[edge].element[k] >= 0; k++) {
        const int64_t e = body->edge[edge].element[k];
        const int sides = uz_element_type_of((uz_element_kind)body->model->mesh.kind[e])->corners;
        for (int s = 0; s < sides; s++) {
            const int64_t other = body->edge_of[4 * e + s];
            int at = n;
            if (other <= edge)
                continue;
            for (n++; beside[at - 1] > other; at--)
                beside[at] = beside[at - 1];
            beside[at] = other;
        }
    }
    return n;
}

/* Where K has entries, its lower triangle: unknowns of edges that have an element in common, which are numbered by
 * edges. first: n_edges + 1, of each its first unknown. */
static uz_status begin_stiffness(uz_csc *K, const int64_t *first, const uz_bound_body *body, uz_error *err)
{
    int64_t beside[2 * UZ_BOUND_PARTS], count = 0;
    const int64_t d = first[body->n_edges];
    for (int64_t i = 0; i < body->n_edges; i++) {
        const int64_t own = first[i + 1] - first[i];
        count -= own * (own - 1) / 2;
        for (int k = edges_beside(beside, body, i) - 1; k >= 0; k--)
            count += own * (first[beside[k] + 1] - first[beside[k]]);
    }
    const uz_status status = uz_csc_init(K, d, d, count, err);
    count = 0;
    for (int64_t i = 0; i < body->n_edges && status == UZ_OK; i++) {
        const int n = edges_beside(beside, body, i);
        for (int64_t c = first[i]; c < first[i + 1]; c++) {
            for (int k = 0; k < n; k++)
                for (int64_t r = k == 0 ? c : first[beside[k]]; r < first[beside[k] + 1]; r++)
                    K->idx[count++] = (int32_t)r;
            K->ptr[c + 1] = count;
        }
    }
    return status;
}

/* An element's lower triangle, of which dof_of are the unknowns. */
static void add_stiffness(uz_csc *K, const int64_t *first, const macro *m, const double *own, const int64_t *dof_of)
{
    const int per = 2 * (m->degree + 1);
    const int64_t *edge = m->body->edge_of + 4 * m->element;
    for (int s = 0; s < m->parts; s++) {
        int64_t beside[2 * UZ_BOUND_PARTS];
        edges_beside(beside, m->body, edge[s]);
        for (int t = 0; t < m->parts; t++) {
            int64_t before = 0; /* unknowns of a column's edges before this one */
            for (int k = 0; edge[t] >= edge[s] && beside[k] < edge[t]; k++)
                before += first[beside[k] + 1] - first[beside[k]];
            for (int j = s * per; j < (s + 1) * per && edge[t] >= edge[s]; j++)
                for (int r = t * per; r < (t + 1) * per && dof_of[j] >= 0; r++)
                    if (dof_of[r] >= dof_of[j])
                        K->val[K->ptr[dof_of[j]] - (dof_of[j] - first[edge[s]]) + before + dof_of[r] -
                               first[edge[t]]] += r >= j ? own[r + m->outer * j] : own[j + m->outer * r];
        }
    }
}

/* K, unless it is NULL, and what elements add to p. */
static uz_status assemble(uz_csc *K, double *p, const int64_t *first, const uz_bound_body *body, const int64_t *dof,
                          const uz_stop *stop, uz_error *err)
{
    const int64_t n = body->model->mesh.n_elements;
    macro *kept = uz_alloc_zero(MADE, sizeof *kept), *m = NULL;
    int64_t *order = order_of(body);
    uz_status status = kept && order ? UZ_OK
                                     : uz_fail(err, UZ_ERR_MEMORY, "",
                                               "no memory for the dual problem of %lld elements", (long long)n);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        const int64_t e = order[i];
        int64_t dof_of[OUTER];
        double value[OUTER], own_p[OUTER], own[OUTER * OUTER];
        if (!K && !has_force(body, e) && !has_values(body, e))
            continue;
        if ((i % 256 == 0 && uz_stop_is_due(stop)) || !(m = make(kept, body, e))) {
            status = fail_at(stop, e, err);
            break;
        }
        if (!m->weighed)
            weigh(m);
        memcpy(own, m->K, (size_t)(m->outer * m->outer) * sizeof *own);
        memcpy(own_p, m->p, (size_t)m->outer * sizeof *own_p);
        number(dof_of, value, m, dof);
        add_springs(own, m);
        turn(own, own_p, m, false);
        for (int r = 0; r < m->outer; r++) {
            for (int j = 0; j < m->outer; j++)
                if (dof_of[j] < 0)
                    own_p[r] -= (r >= j ? own[r + m->outer * j] : own[j + m->outer * r]) * value[j];
            if (dof_of[r] >= 0)
                p[dof_of[r]] += own_p[r];
        }
        if (K)
            add_stiffness(K, first, m, own, dof_of);
    }
    uz_free_all(kept, order);
    return status;
}

/* The mean of the gap with the a-th weight, along the direction of the a-th moments: that of a line is its value at
 * (a + 1) / (degree + 2) of its length. */
static double mean_gap(double normal[2], const uz_bound_body *body, int64_t i, int a)
{
    return body->edge[i].turns ? mean_before(normal, body, i, a, true)
                               : uz_bound_gap(normal, body, i, (a + 1.) / (body->degree + 2));
}

double uz_bound_mean_along(const uz_bound_body *body, int64_t edge, int a)
{
    double normal[2];
    return body->edge[edge].turns ? mean_before(normal, body, edge, a, false) : 1;
}

/* Where the normal turns: the same, or of 1 in place of the gap, by Simpson's rule, as nothing is proved here. */
static double mean_before(double normal[2], const uz_bound_body *body, int64_t i, int a, bool gaps)
{
    const uz_bound_edge *edge = &body->edge[i];
    const int moments = body->degree + 1, steps = edge->pieces > 4 ? 4 : 16;
    double n[2], sum = 0, from = 0;
    uz_bound_normal(normal, body, i, a);
    for (int64_t piece = edge->before; piece < edge->before + edge->pieces; piece++) {
        const double end = body->before.at[piece].end;
        for (int k = 0; k <= steps; k++) {
            const double t = from + (end - from) * k / steps, gap = uz_bound_piece_gap(n, body, i, piece, t);
            const double weight = (end - from) * (k % steps == 0 ? 1. : k % 2 ? 4. : 2.) / (3 * steps);
            const double phi = (a == 1 && moments == 3 ? 2 : 1) * pow(1 - t, moments - 1 - a) * pow(t, a);
            sum += moments * weight * phi * (normal[0] * n[0] + normal[1] * n[1]) * (gaps ? gap : 1);
        }
        from = end;
    }
    return sum;
}

bool uz_bound_has_row(const uz_bound_body *body, const int64_t *dof, int64_t edge, int a)
{
    double axis[2][2], normal[2];
    bool has = false;
    uz_bound_axes(axis, body, edge, a);
    uz_bound_normal(normal, body, edge, a);
    for (int k = 0; k < 2; k++)
        has = has || (dof[(edge * (body->degree + 1) + a) * 2 + k] >= 0 &&
                      fabs(normal[0] * axis[k][0] + normal[1] * axis[k][1]) > 1e-9);
    return has && body->edge[edge].presses;
}

typedef struct {
    int64_t m, count, *row, *col; /* rows, entries */
    double *val, *h;
} row_list;

static void add_entry(row_list *N, int64_t at, double value)
{
    N->row[N->count] = N->m;
    N->col[N->count] = at;
    N->val[N->count++] = value;
}

/* Of an edge before an obstacle: what the pressure with the a-th polynomial does along the normals, at all moments
 * where they turn. Of u . n_a alone the gap would be off by what the edge has of u across n_a, which alternates from
 * moment to moment: a strain that does not get smaller with the edge. */
static void add_edge_rows(row_list *N, const uz_bound_body *body, const int64_t *dof, int64_t i)
{
    const int moments = body->degree + 1;
    for (int a = 0; a < moments; a++) {
        double normal[2], acts[UZ_BOUND_MOMENTS][2], one[UZ_BOUND_MOMENTS] = {0}, gap = mean_gap(normal, body, i, a);
        if (!uz_bound_has_row(body, dof, i, a))
            continue;
        one[a] = 1;
        uz_bound_acts(acts, body, i, one);
        for (int k = 0; k < 2 * moments; k++) {
            double axis[2][2];
            uz_bound_axes(axis, body, i, k / 2);
            const double share = acts[k / 2][0] * axis[k % 2][0] + acts[k / 2][1] * axis[k % 2][1];
            const int64_t at = dof[i * 2 * moments + k];
            if (at < 0)
                gap -= share * given(body, i, k / 2, k % 2);
            else if (fabs(share) > 1e-9) /* uz_bound_has_row */
                add_entry(N, at, share);
        }
        N->h[N->m++] = gap;
    }
}

/* Of a slave's edge, which begins with segment k, and the masters before it. */
static void add_pair_rows(row_list *N, const uz_bound_body *body, const int64_t *dof, int64_t k)
{
    const int moments = body->degree + 1;
    const int64_t slave = body->segment[k].slave;
    for (int a = 0; a < moments; a++) {
        add_entry(N, dof[(slave * moments + a) * 2], 1);
        for (int64_t j = k; j < body->n_segments && body->segment[j].slave == slave; j++) {
            double W[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS];
            uz_bound_segment_weights(W, body, &body->segment[j]);
            for (int b = 0; b < moments; b++)
                add_entry(N, dof[(body->segment[j].master * moments + b) * 2], -W[a][b]);
        }
        N->h[N->m++] = body->segment[k].gap;
    }
}

/* Rows of the edges before obstacles, and of those that face others. */
static uz_status add_rows(uz_qp *qp, int64_t d, const uz_bound_body *body, const int64_t *dof, uz_error *err)
{
    const int moments = body->degree + 1;
    int64_t edges = 0;
    for (int64_t i = 0; i < body->n_edges; i++)
        edges += body->edge[i].presses || body->edge[i].facing == UZ_BOUND_SLAVE;
    const int64_t room = moments * moments * (2 * edges + body->n_segments);
    row_list N = {.row = uz_alloc(room, sizeof(int64_t)), .col = uz_alloc(room, sizeof(int64_t))};
    N.val = uz_alloc(room, sizeof *N.val);
    N.h = qp->h = uz_alloc(moments * edges, sizeof *qp->h);
    uz_status status =
        N.row && N.col && N.val && N.h
            ? UZ_OK
            : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact rows", (long long)(moments * edges));
    for (int64_t i = 0; i < body->n_edges && status == UZ_OK; i++)
        if (body->edge[i].presses)
            add_edge_rows(&N, body, dof, i);
    for (int64_t k = 0; k < body->n_segments && status == UZ_OK; k++)
        if (body->edge[body->segment[k].slave].facing == UZ_BOUND_SLAVE &&
            (k == 0 || body->segment[k - 1].slave != body->segment[k].slave))
            add_pair_rows(&N, body, dof, k);
    if (status == UZ_OK)
        status = uz_csc_from_triplets(&qp->N, N.m, d, N.count, N.row, N.col, N.val, err);
    uz_free_all(N.row, N.col, N.val);
    return status;
}

static uz_status make_problem(uz_qp *qp, int64_t **dof, const uz_bound_body *body, bool stiffness, const uz_stop *stop,
                              uz_error *err)
{
    const int moments = body->degree + 1;
    int64_t d = 0, *first = uz_alloc(body->n_edges + 1, sizeof *first);
    *qp = (uz_qp){.p = NULL};
    *dof = uz_alloc(body->n_edges * 2 * moments, sizeof **dof);
    if (!*dof || !first) {
        free(first);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the dual problem of %lld edges",
                       (long long)body->n_edges);
    }
    for (int64_t i = 0; i < body->n_edges * 2 * moments; i++) {
        first[i / (2 * moments)] = i % (2 * moments) == 0 ? d : first[i / (2 * moments)];
        (*dof)[i] = body->edge[i / (2 * moments)].held[i % 2] ||
                            !(uz_bound_weight(body, i / (2 * moments), (int)(i % (2 * moments) / 2)) > 0) ||
                            (i % 2 == 0 && uz_bound_pressed(body, i / (2 * moments), (int)(i % (2 * moments) / 2)) >= 0)
                        ? -1
                        : d++;
    }
    first[body->n_edges] = d;
    qp->p = uz_alloc_zero(d, sizeof *qp->p);
    uz_status status = qp->p ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld unknowns", (long long)d);
    if (status == UZ_OK)
        status = stiffness ? begin_stiffness(&qp->K, first, body, err) : uz_csc_init(&qp->K, d, d, 0, err);
    if (status == UZ_OK)
        status = assemble(stiffness ? &qp->K : NULL, qp->p, first, body, *dof, stop, err);
    for (int64_t i = 0; i < body->n_edges && status == UZ_OK; i++) { /* a constant traction is shared by weights */
        const uz_bound_edge *edge = &body->edge[i];
        for (int a = 0; a < 2 * moments; a++) {
            const int64_t at = (*dof)[i * 2 * moments + a];
            const double each = uz_bound_measure(body, i) / moments * uz_bound_weight(body, i, a / 2);
            double axis[2][2];
            uz_bound_axes(axis, body, i, a / 2);
            if (at >= 0)
                qp->p[at] += each * (edge->traction[0] * axis[a % 2][0] + edge->traction[1] * axis[a % 2][1]);
        }
    }
    if (status == UZ_OK)
        status = add_rows(qp, d, body, *dof, err);
    free(first);
    if (status != UZ_OK) {
        uz_qp_clear(qp);
        free(*dof);
        *dof = NULL;
    }
    return status;
}

uz_status uz_bound_dual_problem(uz_qp *qp, int64_t **dof, const uz_bound_body *body, const uz_stop *stop, uz_error *err)
{
    return make_problem(qp, dof, body, true, stop, err);
}

uz_status uz_bound_dual_load(uz_qp *qp, int64_t **dof, const uz_bound_body *body, const uz_stop *stop, uz_error *err)
{
    return make_problem(qp, dof, body, false, stop, err);
}

/* ---- stresses */

static int values_of(int parts, int degree)
{
    return parts * (degree == 1 ? 3 : 6) * 3;
}

/* The k-th of an element's values that are not zero anyway, in its part of the stress. */
static int place_of_value(int k, int degree)
{
    const int of_part = (degree == 1 ? 3 : 6) * 3;
    return k / of_part * UZ_BOUND_POINTS * 3 + k % of_part;
}

/* The stresses by an element's unknowns -> map. */
static void make_map(double *map, macro *m)
{
    const int values = values_of(m->parts, m->degree);
    for (int j = 0; j < m->outer; j++) {
        double v[OUTER] = {0}, s[UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3] = {0};
        v[j] = 1;
        spread(m, s, v);
        for (int k = 0; k < values; k++)
            map[(int64_t)j * values + k] = s[place_of_value(k, m->degree)];
    }
}

uz_status uz_bound_keep_maps(uz_bound_body *body, const uz_stop *stop, uz_error *err)
{
    const int64_t n = body->model->mesh.n_elements;
    uz_bound_body plain = *body; /* without loads */
    int64_t total = 0, room = 0, *order = order_of(body);
    macro *kept = uz_alloc_zero(MADE, sizeof *kept), *m = NULL;
    plain.free_strain = NULL;
    plain.force = uz_alloc_zero(2 * n, sizeof *plain.force);
    body->map_at = uz_alloc(n, sizeof *body->map_at);
    bool memory = order && kept && plain.force && body->map_at, large = false;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < n && memory && !large && status == UZ_OK; i++) {
        if ((i % 256 == 0 && uz_stop_is_due(stop)) || !(m = make(kept, &plain, order[i]))) {
            status = fail_at(stop, order[i], err);
            break;
        }
        const int64_t size = (int64_t)values_of(m->parts, m->degree) * m->outer;
        large = m->map < 0 && (total + size) * (int64_t)sizeof(double) > MOST_KEPT;
        memory = m->map >= 0 || large || uz_grow(&body->map, total, size, &room, sizeof *body->map);
        if (m->map < 0 && memory && !large) { /* else that of others like it is there */
            m->map = total;
            make_map(body->map + total, m);
            total += size;
        }
        body->map_at[order[i]] = m->map;
    }
    if (large) {
        free(body->map);
        body->map = NULL;
    }
    uz_free_all(plain.force, kept, order);
    return memory ? status
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stresses of %lld elements", (long long)n);
}

uz_status uz_bound_stress(double *stress, const uz_bound_body *body, const int64_t *dof, const double *v,
                          const uz_stop *stop, uz_error *err)
{
    const int64_t n = body->model->mesh.n_elements;
    uz_status status = UZ_OK;
    macro *kept = uz_alloc_zero(MADE + 1, sizeof *kept), *m = NULL;
    int64_t *order = order_of(body);
    if (!kept || !order) {
        uz_free_all(kept, order);
        return uz_no_memory(err, "the stress of an element");
    }
    memset(stress, 0, (size_t)n * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3 * sizeof *stress);
    for (int64_t k = 0; k < n && status == UZ_OK; k++) {
        const int64_t e = order[k];
        int64_t dof_of[OUTER];
        double value[OUTER];
        const bool mapped = body->map && !has_force(body, e);
        if (mapped) { /* the element's place alone */
            m = &kept[MADE];
            m->body = body;
            m->element = e;
            m->degree = body->degree;
            m->parts = uz_element_type_of((uz_element_kind)body->model->mesh.kind[e])->corners;
            m->outer = 2 * m->parts * (m->degree + 1);
        }
        if ((k % 256 == 0 && uz_stop_is_due(stop)) || (!mapped && !(m = make(kept, body, e)))) {
            status = fail_at(stop, e, err);
            break;
        }
        number(dof_of, value, m, dof);
        for (int i = 0; i < m->outer; i++)
            if (dof_of[i] >= 0)
                value[i] = v[dof_of[i]];
        turn(NULL, value, m, true);
        double *to = stress + e * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3;
        if (!mapped) {
            spread(m, to, value);
            continue;
        }
        const int values = values_of(m->parts, m->degree);
        double sum[UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3] = {0};
        for (int j = 0; j < m->outer; j++)
            add(values, value[j], body->map + body->map_at[e] + (int64_t)j * values, sum);
        for (int i = 0; i < values; i++)
            to[place_of_value(i, m->degree)] = sum[i];
    }
    uz_free_all(kept, order);
    return status;
}

/* ---- one element */

static inline double dot(int n, const double *x, const double *y)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static inline void add(int n, double alpha, const double *x, double *y)
{
    for (int i = 0; i < n; i++)
        y[i] += alpha * x[i];
}

/* Resultants of the tractions of a part on the edge from `from` to `to`, which has the part on its left, along the two
 * axes: rows (2 per moment) of `all` columns, and those of the balancing stress (NULL: not wanted). Coefficients of
 * Bernstein polynomials, from values at the edge's stations. */
static void add_tractions(double *rows, double *rest, const macro *m, int part, const double *from, const double *to,
                          const double axis[2][2], bool reversed)
{
    const double t[2] = {to[0] - from[0], to[1] - from[1]};
    const int moments = m->degree + 1;
    for (int a = 0; a < moments; a++) {
        const double s = STATIONS[m->degree - 1][a];
        const double at[2] = {from[0] + s * t[0], from[1] + s * t[1]};
        const int place = reversed ? moments - 1 - a : a;
        double S[4][UZ_MACRO_FUNCTIONS + 1];
        m->of->stresses(S, m, at);
        for (int k = 0; k < 2; k++) {
            /* normal times length: (t_y, -t_x); a middle station's value is (b_0 + 2 b_1 + b_2) / 4 */
            const double xx = axis[k][0] * t[1], yy = -axis[k][1] * t[0], xy = axis[k][1] * t[1] - axis[k][0] * t[0];
            for (int b = 0; b <= m->functions; b++) {
                const bool last = b == m->functions;
                const double value = (xx * S[0][b] + yy * S[1][b] + xy * S[2][b]) * m->body->depth / moments;
                double *to_row = last ? rest + k : rows + k * m->all + part * m->functions + b;
                const int step = last ? 2 : 2 * m->all;
                if (last && !rest)
                    continue;
                if (moments == 3 && a != 1)
                    to_row[step] -= value / 2;
                to_row[step * place] += moments == 3 && a == 1 ? 2 * value : value;
            }
        }
    }
}

/* Z (n x (n - rank)), orthonormal: what all columns of M (n x columns, overwritten) are orthogonal to, by Householder's
 * reflections with pivoting. Returns the rank; -1: it can't be told from rounding. */
static int span_null_space(double *Z, double *M, int n, int columns)
{
    double first = 0, largest = 0, v[MOST];
    int rank = 0;
    for (int j = 0; j < columns && j < n; j++) {
        int best = j;
        largest = -1;
        for (int c = j; c < columns; c++) {
            const double size = sqrt(dot(n - j, M + j + n * c, M + j + n * c));
            best = size > largest ? c : best;
            largest = fmax(largest, size);
        }
        first = j == 0 ? largest : first;
        if (!(largest > 1e-11 * first))
            break;
        if (!(largest > 1e-8 * first))
            return -1;
        rank = j + 1;
        for (int i = 0; i < n; i++) {
            const double held = M[i + n * best];
            M[i + n * best] = M[i + n * j];
            M[i + n * j] = held;
        }
        double *h = M + n * j; /* becomes the unit vector of the reflection, from row j on */
        h[j] += h[j] < 0 ? -largest : largest;
        const double size = sqrt(dot(n - j, h + j, h + j));
        for (int i = j; i < n; i++)
            h[i] /= size;
        for (int c = j + 1; c < columns; c++)
            add(n - j, -2 * dot(n - j, h + j, M + j + n * c), h + j, M + j + n * c);
    }
    for (int c = rank; c < n; c++) {
        memset(v, 0, sizeof v);
        v[c] = 1;
        for (int j = rank - 1; j >= 0; j--)
            add(n - j, -2 * dot(n - j, M + j + n * j, v + j), M + j + n * j, v + j);
        memcpy(Z + n * (c - rank), v, (size_t)n * sizeof *v);
    }
    return rank;
}

void uz_macro_part(double corner[3][2], const uz_macro *m, int part)
{
    memcpy(corner[0], m->corner[part], sizeof corner[0]);
    memcpy(corner[1], m->corner[(part + 1) % m->parts], sizeof corner[1]);
    memcpy(corner[2], m->centre, sizeof corner[2]);
}

/* Rows (of `all` columns) of stresses at the places of the element's sides that are on the axis of rings; how many. */
static int vanish_at_axis(double *rows, const macro *m)
{
    const int places = m->degree == 1 ? 2 : 3;
    int count = 0;
    for (int part = 0; part < m->parts && m->body->rings; part++) {
        double corner[3][2];
        uz_macro_part(corner, m, part);
        for (int i = 0; i < places; i++) {
            const double *a = corner[i < 2 ? i : 0], *b = corner[i < 2 ? i : 1];
            const double at[2] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
            double S[4][UZ_MACRO_FUNCTIONS + 1];
            if (at[0] > 0)
                continue;
            m->of->stresses(S, m, at);
            for (int c = 0; c < 3; c++, count++)
                memcpy(rows + count * m->all + part * m->functions, S[c], (size_t)m->functions * sizeof(double));
        }
    }
    return count;
}

/* The compliance of a part, functions x functions, and what the balancing stress and free expansion make of it. */
static void comply(double *F, double *f, const macro *m, int part)
{
    const uz_body_model *model = m->body->model;
    const uz_lame lame = uz_element_material(model, m->element)->lame;
    const int n = m->functions, components = m->of->components;
    double corner[3][2], at[2], weight;
    uz_macro_part(corner, m, part);
    memset(F, 0, (size_t)(n * n) * sizeof *F);
    memset(f, 0, (size_t)n * sizeof *f);
    for (uz_walk walk = uz_walk_begin(corner, m->body->rings, m->degree); uz_walk_next(&walk, at, &weight);) {
        double S[4][UZ_MACRO_FUNCTIONS + 1], strain[4][UZ_MACRO_FUNCTIONS + 1];
        m->of->stresses(S, m, at);
        weight *= m->body->depth;
        for (int b = 0; b <= n; b++) {
            double e[4];
            const double s[4] = {S[0][b], S[1][b], S[2][b], components > 3 ? S[3][b] : 0};
            const bool last = b == n && m->body->free_strain;
            m->of->strain(e, s, lame, last ? m->body->free_strain[m->element] : 0, model->kind, at[0]);
            for (int i = 0; i < components; i++)
                strain[i][b] = e[i];
        }
        for (int b = 0; b < n; b++)
            for (int i = 0; i < components; i++) {
                f[b] += weight * S[i][b] * strain[i][n];
                add(n - b, weight * strain[i][b], S[i] + b, F + b + n * b);
            }
    }
    for (int b = 0; b < n; b++)
        for (int a = 0; a < b; a++)
            F[a + n * b] = F[b + n * a];
}

/* Local coordinates along two edges of a triangle, between the middles of opposite edges of a quadrilateral. */
static void scale(macro *m)
{
    const double(*p)[2] = m->corner;
    double a[2], b[2], S[4][UZ_MACRO_FUNCTIONS + 1], largest[UZ_MACRO_FUNCTIONS] = {0};
    for (int c = 0; c < 2; c++) {
        a[c] = m->parts == 3 ? p[1][c] - p[0][c] : (p[1][c] + p[2][c] - p[0][c] - p[3][c]) / 4;
        b[c] = m->parts == 3 ? p[2][c] - p[0][c] : (p[2][c] + p[3][c] - p[0][c] - p[1][c]) / 4;
    }
    const double det = a[0] * b[1] - a[1] * b[0];
    m->local[0][0] = b[1] / det;
    m->local[0][1] = -b[0] / det;
    m->local[1][0] = -a[1] / det;
    m->local[1][1] = a[0] / det;
    for (int i = 0; i < m->functions; i++)
        m->times[i] = 1;
    for (int k = 0; k < m->parts; k++) {
        m->of->stresses(S, m, p[k]);
        for (int i = 0; i < m->functions; i++) {
            largest[i] = fmax(largest[i], fmax(fabs(S[2][i]), fmax(fabs(S[0][i]), fabs(S[1][i]))));
            if (m->of->components > 3)
                largest[i] = fmax(largest[i], m->centre[0] * fabs(S[3][i]));
        }
    }
    for (int i = 0; i < m->functions; i++)
        m->times[i] = 1 / largest[i];
}

typedef struct {
    double radius;
    int64_t element;
} placed;

static int by_radius(const void *a, const void *b)
{
    const placed *x = a, *y = b;
    const int way = (x->radius > y->radius) - (x->radius < y->radius);
    return way != 0 ? way : (x->element > y->element) - (x->element < y->element);
}

/* In which elements are gone through: of rings by the radius, at which others may be like it. NULL: no memory. */
static int64_t *order_of(const uz_bound_body *body)
{
    const uz_mesh *mesh = &body->model->mesh;
    const int64_t n = mesh->n_elements;
    int64_t *order = uz_alloc(n, sizeof *order);
    placed *all = body->rings && order ? uz_alloc(n, sizeof *all) : NULL;
    for (int64_t e = 0; e < n && order; e++)
        order[e] = e;
    for (int64_t e = 0; e < n && all; e++)
        all[e] = (placed){mesh->xyz[2 * mesh->node[mesh->first[e]]], e};
    if (all)
        qsort(all, (size_t)n, sizeof *all, by_radius);
    for (int64_t e = 0; e < n && all; e++)
        order[e] = all[e].element;
    if (body->rings && !all) {
        free(order);
        order = NULL;
    }
    free(all);
    return order;
}

/* Turns to an element. */
static void place(macro *m, const uz_bound_body *body, int64_t element)
{
    const uz_mesh *mesh = &body->model->mesh;
    int count;
    const int64_t *node = uz_mesh_element(mesh, element, &count);
    m->body = body;
    m->element = element;
    m->degree = body->degree;
    m->parts = uz_element_type_of((uz_element_kind)mesh->kind[element])->corners;
    m->of = body->rings ? &uz_ring_stresses : &uz_plane_stresses;
    m->functions = m->of->functions[m->degree - 1];
    m->all = m->parts * m->functions;
    m->outer = m->parts * 2 * (m->degree + 1);
    uz_bound_centre(m->centre, body, element);
    for (int k = 0; k < m->parts; k++)
        uz_bound_place(m->corner[k], body, node[k]);
}

/* What an element's own numbers follow from; returns its size. */
static double find_key(double key[KEY], const uz_bound_body *body, int64_t element)
{
    const uz_mesh *mesh = &body->model->mesh;
    const uz_lame lame = uz_element_material(body->model, element)->lame;
    int count, at = 6;
    const int64_t *node = uz_mesh_element(mesh, element, &count);
    const int parts = uz_element_type_of((uz_element_kind)mesh->kind[element])->corners;
    double size = 0, first[2], corner[2];
    memset(key, 0, KEY * sizeof *key);
    uz_bound_place(first, body, node[0]);
    for (int k = 0; k < parts; k++) {
        const uz_bound_edge *edge = &body->edge[body->edge_of[4 * element + k]];
        uz_bound_place(corner, body, node[k]);
        for (int c = 0; c < 2 && k > 0; c++) {
            key[2 * (k - 1) + c] = corner[c] - first[c];
            size = fmax(size, fabs(key[2 * (k - 1) + c]));
        }
        key[at++] = edge->node[0] == node[k];
        memcpy(key + at, edge->axis, sizeof edge->axis);
        at += 4;
    }
    const double rest[] = {body->rings ? first[0] : 0, /* rings have elements alike at one radius alone */
                           parts,
                           lame.lambda,
                           lame.mu,
                           body->force[2 * element],
                           body->force[2 * element + 1],
                           body->free_strain ? body->free_strain[element] : 0};
    memcpy(key + KEY - sizeof rest / sizeof rest[0], rest, sizeof rest);
    return size;
}

/* Is it the element that was made there, but for where it stands and rounding of the shape, of which what the stress
 * then lacks of equilibrium is found as any other? */
static bool is_like(const macro *m, const double key[KEY], double size)
{
    bool same = m->made;
    for (int i = 0; i < KEY && same; i++)
        same = fabs(key[i] - m->key[i]) <= (i < 6 ? 1e-13 * size : 0);
    return same;
}

/* One of `kept`, made there unless one like it is; NULL: that cannot be. */
static macro *make(macro *kept, const uz_bound_body *body, int64_t element)
{
    static const double AXES[2][2] = {{1, 0}, {0, 1}};
    const uz_mesh *mesh = &body->model->mesh;
    int count;
    const int64_t *node = uz_mesh_element(mesh, element, &count);
    double key[KEY];
    macro *m = kept;
    double inner[INNER * MOST], outer[OUTER * MOST];
    double F[UZ_MACRO_FUNCTIONS * UZ_MACRO_FUNCTIONS], f[UZ_MACRO_FUNCTIONS];
    const double size = find_key(key, body, element);
    int64_t latest = 0;
    for (int i = 0; i < MADE; i++)
        latest = kept[i].last > latest ? kept[i].last : latest;
    for (int i = 0; i < MADE; i++) {
        if (is_like(&kept[i], key, size)) {
            place(&kept[i], body, element);
            kept[i].last = latest + 1;
            return &kept[i];
        }
        m = kept[i].last < m->last ? &kept[i] : m; /* the one not used for longest */
    }
    place(m, body, element);
    memcpy(m->key, key, sizeof m->key);
    m->made = m->weighed = false;
    m->last = latest + 1;
    m->map = -1;
    memset(inner, 0, (size_t)((m->outer + (body->rings ? INNER - OUTER : 0)) * m->all) * sizeof *inner);
    memset(outer, 0, (size_t)(m->outer * m->all) * sizeof *outer);
    scale(m);
    memset(m->rest, 0, sizeof m->rest);
    for (int k = 0; k < m->parts; k++) {
        const int next = (k + 1) % m->parts, rows = 2 * (m->degree + 1);
        const uz_bound_edge *edge = &body->edge[body->edge_of[4 * element + k]];
        add_tractions(outer + k * rows * m->all, m->rest + k * rows, m, k, m->corner[k], m->corner[next], edge->axis,
                      edge->node[0] != node[k]);
        /* from the centre: part k is on the left of the edge to its first corner reversed */
        add_tractions(inner + next * rows * m->all, NULL, m, k, m->corner[next], m->centre, AXES, false);
        add_tractions(inner + k * rows * m->all, NULL, m, k, m->centre, m->corner[k], AXES, true);
    }
    const int at_axis = vanish_at_axis(inner + m->outer * m->all, m);
    const int rank = span_null_space(m->Z, inner, m->all, m->outer + at_axis);
    if (rank < 0 || (at_axis == 0 && rank != m->outer - (m->parts == 4 ? 1 : 0)))
        return NULL;
    m->kept = m->all - rank;
    const int ld = m->kept + m->outer;
    memset(m->A, 0, (size_t)(ld * m->kept) * sizeof *m->A);
    memset(m->y, 0, (size_t)m->kept * sizeof *m->y);
    for (int part = 0; part < m->parts; part++) {
        comply(F, f, m, part);
        for (int j = 0; j < m->kept; j++) {
            const double *z = m->Z + m->all * j + part * m->functions;
            double Fz[UZ_MACRO_FUNCTIONS] = {0};
            for (int b = 0; b < m->functions; b++)
                add(m->functions, z[b], F + m->functions * b, Fz);
            for (int i = j; i < m->kept; i++)
                m->A[i + ld * j] += dot(m->functions, m->Z + m->all * i + part * m->functions, Fz);
            m->y[j] += dot(m->functions, z, f);
        }
    }
    for (int j = 0; j < m->kept; j++)
        for (int r = 0; r < m->outer; r++)
            m->A[m->kept + r + ld * j] = dot(m->all, outer + r * m->all, m->Z + m->all * j);
    if (uz_block_factor(m->kept, m->outer, m->A, ld) < m->kept)
        return NULL;
    uz_trsv_lower(m->kept, m->A, ld, m->y, false);
    m->made = true;
    return m;
}

/* K = BB' and By - D_0. */
static void weigh(macro *m)
{
    const int ld = m->kept + m->outer;
    uz_block_outer(&(uz_outer){
        .rows = m->outer, .n = m->outer, .k = m->kept, .A = m->A + m->kept, .ld = ld, .C = m->K, .ldc = m->outer});
    for (int i = 0; i < m->outer; i++) {
        m->p[i] = -m->rest[i];
        for (int k = 0; k < m->kept; k++)
            m->p[i] += m->A[m->kept + i + ld * k] * m->y[k];
    }
    m->weighed = true;
}

static void spread(macro *m, double *stress, const double *v)
{
    const int ld = m->kept + m->outer, points = m->degree == 1 ? 3 : 6;
    double z[MOST], s[MOST] = {0};
    for (int k = 0; k < m->kept; k++)
        z[k] = dot(m->outer, m->A + m->kept + ld * k, v) - m->y[k];
    uz_trsv_lower(m->kept, m->A, ld, z, true);
    for (int k = 0; k < m->kept; k++)
        add(m->all, z[k], m->Z + m->all * k, s);
    for (int part = 0; part < m->parts; part++) {
        double corner[3][2];
        uz_macro_part(corner, m, part);
        for (int i = 0; i < points; i++) {
            const double *a = corner[i % 3], *b = corner[i < 3 ? i : (i + 1) % 3];
            const double at[2] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
            double S[4][UZ_MACRO_FUNCTIONS + 1], *to = stress + (part * UZ_BOUND_POINTS + i) * 3;
            m->of->stresses(S, m, at);
            for (int c = 0; c < 3; c++)
                to[c] = m->body->rings && !(at[0] > 0) /* at the axis, but for rounding */
                            ? 0
                            : S[c][m->functions] + dot(m->functions, S[c], s + part * m->functions);
        }
    }
}
