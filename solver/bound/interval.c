/* interval.c: what a pair of displacement and stress proves of a quantity, whatever it was made by: sums over elements
 * and edges by the same code that looks at the answer (check.c). Products of two pairs are from squares,
 *
 *     (sigma_h + C eps(u_h)) : C^-1 (C eps(w) - tau)  from  |sigma_h + t tau - C eps(t w - u_h)|^2, and with -t
 *
 * where t makes both of one size. */
#include "bound/interval.h"

#include "bound/check.h"
#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* By so much of its own size w may be off at obstacles: what brings it to where it may be is rounding. */
#define PLACES 1e-12

enum { STRESSES = UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, MOMENTS = UZ_BOUND_MOMENTS };

typedef struct {
    const uz_bound_pair *pair;
    const uz_bound_body *body;
    const double *u, *stress;
    const uz_bound_check_result *checked;
    uz_bound_check_result scratch;
    examination x;         /* of the pair */
    double *acts[2];       /* resultants less the loads, of the answer's stress and of the pair's */
    double *v, *tractions; /* n_nodes x 2, n_elements x STRESSES: room */
    double *force, *free_strain, *limit;
    double nodal; /* norm of what slaves' nodes have to go by */
} weighing;

static uz_status begin(weighing *y, int64_t n_dofs, uz_error *err)
{
    const uz_mesh *mesh = &y->pair->adjoint->model->mesh;
    const int moments = y->pair->adjoint->degree + 1;
    const int64_t n_moments = y->pair->adjoint->n_edges * moments;
    y->x = (examination){.out = &y->scratch, .body = y->pair->adjoint, .mesh = mesh, .moments = moments};
    y->scratch.residual = uz_alloc_zero(n_dofs, sizeof(double));
    y->x.resultant = uz_alloc_zero(2 * n_moments, sizeof(double));
    y->x.pressure = uz_alloc_zero(n_moments, sizeof(double));
    y->x.lift = uz_alloc_zero(2 * mesh->n_nodes, sizeof(double));
    y->x.moved = uz_alloc_zero(2 * mesh->n_nodes, sizeof(double));
    y->x.gap = uz_alloc_zero(mesh->n_elements, sizeof(double));
    y->acts[0] = uz_alloc_zero(2 * n_moments, sizeof(double));
    y->acts[1] = uz_alloc_zero(2 * n_moments, sizeof(double));
    y->v = uz_alloc(2 * mesh->n_nodes, sizeof(double));
    y->tractions = uz_alloc(mesh->n_elements * STRESSES, sizeof(double));
    y->force = uz_alloc(2 * mesh->n_elements, sizeof(double));
    y->free_strain = uz_alloc(mesh->n_elements, sizeof(double));
    y->limit = uz_alloc(n_moments, sizeof(double));
    return y->scratch.residual && y->x.resultant && y->x.pressure && y->x.lift && y->x.moved && y->x.gap &&
                   y->acts[0] && y->acts[1] && y->v && y->tractions && y->force && y->free_strain && y->limit
               ? UZ_OK
               : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a quantity of %lld elements",
                         (long long)mesh->n_elements);
}

static void end(weighing *y)
{
    uz_free_all(y->scratch.residual, y->x.resultant, y->x.pressure, y->x.lift, y->x.moved, y->x.gap, y->acts[0],
                y->acts[1], y->v, y->tractions, y->force, y->free_strain, y->limit);
}

/* ---- sums over elements */

/* x's sums of 1/2 |tau - C eps(v)|^2 but for springs, and its resultants, from nothing. */
static void add_up(examination *x, const double *v, const double *stress)
{
    const int64_t n_moments = x->body->n_edges * x->moments;
    memset(x->resultant, 0, (size_t)(2 * n_moments) * sizeof *x->resultant);
    x->sum = x->scale = x->margin = x->own_margin = x->strain = x->complementary = x->inside = 0;
    for (int64_t e = 0; e < x->mesh->n_elements; e++)
        uz_examine_element(x, v, stress + e * STRESSES, e);
}

/* Resultants less the loads of a body. */
static void less_loads(double *acts, const examination *x, const uz_bound_body *body)
{
    for (int64_t i = 0; i < body->n_edges; i++)
        uz_less_load(acts, x, &body->edge[i], i);
}

/* int (t + k u)(s + k v) / k of the springs, t and s as resultants; *scale: the sizes of what it is the sum of. */
static double spring_product(double *scale, const examination *x, const double *t, const double *u, double of_u,
                             const double *s, const double *v)
{
    double sum = 0;
    for (int64_t i = 0; i < x->body->n_edges; i++)
        for (int c = 0; c < 2; c++) {
            const uz_bound_edge *edge = &x->body->edge[i];
            const double area = uz_bound_measure(x->body, i);
            double b[2][3], q, weight;
            if (!(edge->spring[c] > 0))
                continue;
            uz_along_edge(b[0], u, edge->node, (const double[2]){c == 0, c == 1});
            uz_along_edge(b[1], v, edge->node, (const double[2]){c == 0, c == 1});
            for (uz_line_walk walk = uz_line_begin(edge->weight[0], edge->weight[1]);
                 uz_line_next(&walk, &q, &weight);) {
                const double p = 1 - q, k = edge->spring[c] * (p * edge->weight[0] + q * edge->weight[1]);
                double phi[MOMENTS], traction[2] = {0}, moved[2];
                uz_bound_bernstein(phi, x->moments, q);
                for (int a = 0; a < x->moments; a++) {
                    const int64_t at = (i * x->moments + a) * 2 + c;
                    traction[0] += phi[a] * t[at] * x->moments / area;
                    traction[1] += phi[a] * s[at] * x->moments / area;
                }
                for (int a = 0; a < 2; a++)
                    moved[a] = b[a][0] * p * p + 2 * b[a][1] * p * q + b[a][2] * q * q;
                moved[0] *= of_u;
                sum += weight * area * (traction[0] + k * moved[0]) * (traction[1] + k * moved[1]) / k;
                *scale += weight * area * (fabs(traction[0]) + k * fabs(moved[0])) *
                          (fabs(traction[1]) + k * fabs(moved[1])) / k;
            }
        }
    return sum;
}

/* |d|^2 from above, or as it is; the pair's resultants less its load -> acts[1]. */
static double square_apart(weighing *y, bool bounded)
{
    examination *x = &y->x;
    double scale = 0;
    add_up(x, y->pair->w, y->pair->stress);
    memcpy(y->acts[1], x->resultant, (size_t)(2 * x->body->n_edges * x->moments) * sizeof(double));
    less_loads(y->acts[1], x, x->body);
    const double springs = spring_product(&scale, x, y->acts[1], y->pair->w, 1, y->acts[1], y->pair->w);
    return fmax(0, 2 * x->sum + springs) +
           (bounded ? 2 * (x->margin + x->own_margin) + UZ_SUM_ROUNDING * (2 * x->scale + scale) : 0);
}

uz_status uz_bound_apart(double *apart, const uz_bound_pair *pair, uz_error *err)
{
    weighing y = {.pair = pair};
    uz_status status = begin(&y, 1, err);
    *apart = status == UZ_OK ? sqrt(square_apart(&y, false)) : 0;
    end(&y);
    return status;
}

/* int sigma_m : d, and what rounding and integration may make of it. The answer's resultants -> acts[0]. */
static double work_apart(weighing *y, double apart, double *rounding)
{
    const uz_mesh *mesh = y->x.mesh;
    const int64_t n_moments = y->body->n_edges * y->x.moments;
    uz_bound_body both = *y->body; /* as far as elements ask */
    const double own = y->checked->norm + sqrt(2 * fmax(0, y->checked->gap)),
                 t = own > 0 && apart > 0 ? fmin(1e100, fmax(1e-100, own / apart)) : 1;
    examination x = y->x;
    double sum = 0, scale = 0;
    both.force = y->force;
    both.free_strain = y->body->free_strain ? y->free_strain : NULL;
    x.body = &both;
    for (int sign = 1; sign >= -1; sign -= 2) {
        for (int64_t i = 0; i < 2 * mesh->n_nodes; i++)
            y->v[i] = sign * t * y->pair->w[i] - y->u[i];
        for (int64_t i = 0; i < mesh->n_elements * STRESSES; i++)
            y->tractions[i] = y->stress[i] + sign * t * y->pair->stress[i];
        for (int64_t i = 0; i < 2 * mesh->n_elements; i++)
            y->force[i] = y->body->force[i] + sign * t * y->pair->adjoint->force[i];
        for (int64_t e = 0; e < mesh->n_elements && both.free_strain; e++)
            y->free_strain[e] = -y->body->free_strain[e];
        add_up(&x, y->v, y->tractions);
        sum -= sign * x.sum / (4 * t);
        *rounding += (x.margin + x.own_margin + UZ_SUM_ROUNDING * x.scale) / (4 * t);
        for (int64_t k = 0; k < 2 * n_moments; k++)
            y->acts[0][k] += x.resultant[k] / 2;
    }
    less_loads(y->acts[0], &x, y->body);
    sum -= spring_product(&scale, &y->x, y->acts[0], y->u, -1, y->acts[1], y->pair->w) / 2;
    *rounding += UZ_SUM_ROUNDING * scale;
    return sum;
}

/* int tau : expansion. */
static double expansion_work(const weighing *y, double *rounding)
{
    double sum = 0;
    for (int64_t e = 0; e < y->x.mesh->n_elements && y->body->free_strain; e++) {
        int count;
        const int64_t *node = uz_mesh_element(y->x.mesh, e, &count);
        const int parts = uz_element_type_of((uz_element_kind)y->x.mesh->kind[e])->corners;
        double corner[3][2];
        uz_bound_centre(corner[2], y->body, e);
        for (int k = 0; k < parts; k++) {
            uz_bound_place(corner[0], y->body, node[k]);
            uz_bound_place(corner[1], y->body, node[(k + 1) % parts]);
            const double part = uz_expansion_work(
                &y->x, corner, y->pair->stress + e * STRESSES + k * UZ_BOUND_POINTS * 3, y->body->free_strain[e], e);
            sum += part;
            *rounding += UZ_SUM_ROUNDING * fabs(part);
        }
    }
    return sum;
}

/* ---- along edges */

/* A bound on minus the least value of a quadratic polynomial, from its Bernstein coefficients. */
static double below_zero(const double b[3])
{
    return fmax(fmax(-b[0], -b[2]), -b[1] - sqrt(fmax(0, b[0]) * fmax(0, b[2])));
}

/* By how much s is below its chord along an edge: before a circle four times that, as normals turn, too. */
static double bends_away(const uz_bound_body *body, int64_t i, const double *u)
{
    const uz_bound_edge *edge = &body->edge[i];
    const uz_obstacle_piece *piece = &body->before.at[edge->before];
    double s[4], b[3], n[2], below = 0;
    for (int64_t k = 0; k < edge->pieces; k++)
        for (int j = 0; j < 4; j++) { /* both ends, and the middle and the end of the piece */
            const double q = j < 2 ? j : j == 2 ? ((k > 0 ? piece[k - 1].end : 0) + piece[k].end) / 2 : piece[k].end;
            s[j] = uz_bound_gap(n, body, i, q);
            uz_along_edge(b, u, edge->node, n);
            s[j] -= b[0] * (1 - q) * (1 - q) + 2 * b[1] * q * (1 - q) + b[2] * q * q;
            below = j < 2 ? below : fmax(below, (1 - q) * s[0] + q * s[1] - s[j]);
        }
    return below;
}

/* How far the coefficients of a quadratic w_n may be from om, by share: those of s, if none is negative. Where the
 * middle one is, s is the square of a line and what is left of both ends. Of an s that is no polynomial one that is
 * below it. */
static void open_quadratic(double b[3], const uz_bound_body *body, int64_t i, const double *u)
{
    enum { SAMPLES = 8 };
    const uz_bound_edge *edge = &body->edge[i];
    const uz_obstacle_piece *piece = &body->before.at[edge->before];
    double s[3], along[3], n[2], above = 0;
    for (int a = 0; a < 3; a++) {
        s[a] =
            uz_bound_gap(n, body, i, a == 2 ? 0.5 : a) - n[0] * u[2 * edge->node[a]] - n[1] * u[2 * edge->node[a] + 1];
    }
    b[0] = s[0];
    b[1] = 2 * s[2] - (s[0] + s[1]) / 2;
    b[2] = s[1];
    for (int64_t k = 0; k < edge->pieces && edge->turns; k++)
        for (int j = 1; j <= SAMPLES; j++) {
            const double from = k > 0 ? piece[k - 1].end : 0, q = from + (piece[k].end - from) * j / SAMPLES, p = 1 - q;
            const double gap = uz_bound_gap(n, body, i, q);
            uz_along_edge(along, u, edge->node, n);
            above = fmax(above,
                         (b[0] + along[0]) * p * p + 2 * (b[1] + along[1]) * p * q + (b[2] + along[2]) * q * q - gap);
        }
    for (int a = 0; a < 3; a++)
        b[a] -= above;
    if (b[1] < 0) {
        const double part = -b[1] * (1 + 1e-9), both = sqrt(fmax(0, b[0]) * fmax(0, b[2]));
        b[0] *= both > part ? 1 - part / both : 0;
        b[2] *= both > part ? 1 - part / both : 0;
    }
}

/* Of linear ones: s bends away from its chord by h^2 / 8R. */
static void open_linear(double s[3], const uz_bound_body *body, int64_t i, const double *u)
{
    const uz_bound_edge *edge = &body->edge[i];
    const double bends = edge->turns ? bends_away(body, i, u) : 0;
    for (int a = 0; a < 2; a++) {
        double n[2];
        s[2 * a] = uz_bound_gap(n, body, i, a) - bends;
        s[2 * a] -= n[0] * u[2 * edge->node[a]] + n[1] * u[2 * edge->node[a] + 1];
    }
    s[1] = INFINITY;
}

void uz_bound_openings(double *open, const uz_bound_body *body, const uz_bound_check_result *checked)
{
    const uz_mesh *mesh = &body->model->mesh;
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        open[i] = INFINITY;
    for (int64_t i = 0; i < body->n_edges; i++) {
        static const int AT[3] = {0, 2, 1}; /* of nodes the coefficients */
        const uz_bound_edge *edge = &body->edge[i];
        double s[3];
        if (edge->contact < 0)
            continue;
        if (edge->node[2] >= 0)
            open_quadratic(s, body, i, checked->lifted);
        else
            open_linear(s, body, i, checked->lifted);
        for (int a = 0; a < 3 && edge->node[a] >= 0; a++)
            open[edge->node[a]] = fmax(0, fmin(open[edge->node[a]], s[AT[a]]));
    }
    for (int64_t k = 0; k < body->n_segments; k++) { /* between bodies the least along each segment */
        const examination x = {.body = body};
        const uz_bound_segment *segment = &body->segment[k];
        double s[3];
        uz_along_segment(s, &x, segment, checked->lifted);
        for (int a = 0; a < 3; a++)
            s[a] = segment->gap - s[a];
        for (int a = 0; a < 6; a++) {
            const int64_t node = body->edge[a < 3 ? segment->slave : segment->master].node[a % 3];
            if (node >= 0)
                open[node] = fmax(0, fmin(open[node], -below_zero(s)));
        }
    }
}

/* Brings a node of an edge, of a quadratic one's middle the coefficient, to where it may be. Was it elsewhere? */
static bool bring_node(const weighing *y, const double *open, int64_t i, int a, bool always)
{
    static const double PART[3] = {0, 1, 0.5};
    const uz_bound_body *body = y->body;
    const uz_bound_edge *edge = &body->edge[i];
    double n[2], way[2], *w = y->pair->w + 2 * edge->node[a];
    uz_bound_gap(n, body, i, PART[a]);
    const bool free_along = uz_way_along(way, body->model, edge->node[a], n);
    const double om = y->pair->wanted[edge->contact], most = y->pair->share * open[edge->node[a]];
    const double here = n[0] * w[0] + n[1] * w[1];
    double moved = here, by = 0;
    if (a == 2) {
        double ends = 0;
        for (int k = 0; k < 2; k++) {
            uz_bound_gap(n, body, i, PART[k]);
            ends += n[0] * y->pair->w[2 * edge->node[k]] + n[1] * y->pair->w[2 * edge->node[k] + 1];
        }
        moved = 2 * here - ends / 2;
    }
    by = (fmax(om - most, fmin(om + most, moved)) - moved) / (a == 2 ? 2 : 1);
    const bool off = free_along && (always || fabs(by) > PLACES / 10 * (fabs(om) + fabs(w[0]) + fabs(w[1])));
    for (int c = 0; c < 2 && off; c++)
        w[c] += by * way[c];
    return off;
}

static void bring_nodes(weighing *y)
{
    const uz_bound_body *body = y->body;
    enum { PASSES = 60 };
    bool changed = true;
    double *open = y->v; /* n_nodes of it */
    uz_bound_openings(open, body, y->checked);
    for (int pass = 0; pass < (body->corners ? PASSES : 1) && changed; pass++) { /* normals leap at corners */
        changed = false;
        for (int a = 0; a < 3; a++)
            for (int64_t i = 0; i < body->n_edges; i++)
                if (body->edge[i].contact >= 0 && body->edge[i].node[a] >= 0)
                    changed = bring_node(y, open, i, a, pass == 0) || changed;
    }
}

/* Is w_n nowhere farther from om than m s_h along an edge? */
static void look_at_edge(weighing *y, int64_t i)
{
    const uz_bound_edge *edge = &y->body->edge[i];
    const double m = y->pair->share, om = y->pair->wanted[edge->contact];
    double s[3], moved[3], most = 0, size = fabs(om) + m * y->x.farthest;
    if (edge->turns) {
        uz_bulge_excess(&y->x, y->checked->lifted, y->pair->w, om, m, y->checked->pressure, i);
        return;
    }
    const uz_obstacle_piece *line = uz_bound_line(y->body, edge);
    uz_along_edge(s, y->checked->lifted, edge->node, line->normal);
    uz_along_edge(moved, y->pair->w, edge->node, line->normal);
    for (int a = 0; a < 3; a++) {
        const double gap = a == 0 ? line->gap[0] : a == 2 ? line->gap[1] : (line->gap[0] + line->gap[1]) / 2;
        for (int c = 0; c < 2 && edge->node[a] >= 0; c++)
            size = fmax(size, fabs(y->pair->w[2 * edge->node[a] + c]));
        s[a] = m * (gap - s[a]);
        moved[a] -= om;
    }
    for (int k = 0; k < 2; k++) {
        double b[3];
        for (int a = 0; a < 3; a++)
            b[a] = s[a] + (k == 0 ? moved[a] : -moved[a]);
        most = fmax(most, below_zero(b));
    }
    if (!*y->scratch.fault && !(most <= PLACES * size))
        snprintf(y->scratch.fault, sizeof y->scratch.fault,
                 "the contact meets supports%s, where what presses has no bound; end it before",
                 y->body->corners ? " or a corner" : "");
}

/* Where surfaces of the body face each other nodes of two meshes say where w_n is: along a slave's edge its ends go by
 * as much as w_n is beyond m s_h there, as a displacement on its own (bulge), not added to w. */
static void look_at_pairs(weighing *y)
{
    const uz_bound_body *body = y->body;
    examination *x = &y->x;
    double margin = 0, square = 0, *by = x->lift;
    memset(by, 0, (size_t)(2 * x->mesh->n_nodes) * sizeof *by);
    for (int64_t k = 0; k < body->n_segments; k++) {
        const uz_bound_segment *segment = &body->segment[k];
        const uz_bound_edge *slave = &body->edge[segment->slave];
        const double m = y->pair->share, om = y->pair->wanted[segment->contact];
        double s[3], moved[3], most = 0, size = fabs(om) + m * (fabs(segment->gap) + x->farthest), way[2];
        uz_along_segment(s, x, segment, y->checked->lifted);
        uz_along_segment(moved, x, segment, y->pair->w);
        for (int sign = 1; sign >= -1; sign -= 2) {
            double b[3];
            for (int a = 0; a < 3; a++)
                b[a] = m * (segment->gap - s[a]) + sign * (moved[a] - om);
            most = fmax(most, below_zero(b));
        }
        for (int a = 0; a < 2 && most > PLACES * size; a++) {
            const int64_t node = slave->node[a];
            if (!uz_way_along(way, body->model, node, slave->normal) && !*y->scratch.fault)
                snprintf(y->scratch.fault, sizeof y->scratch.fault,
                         "the contact meets supports, where what presses has no bound; end it before");
            for (int c = 0; c < 2; c++)
                if (fabs(most * way[c]) > fabs(by[2 * node + c]))
                    by[2 * node + c] = most * way[c];
        }
    }
    uz_middle_slaves(x);
    for (int64_t e = 0; e < x->mesh->n_elements; e++)
        square += 2 * uz_energy_of(&margin, x, by, false, e);
    for (int64_t k = 0; k < body->n_segments; k++) {
        double b[3];
        uz_along_segment(b, x, &body->segment[k], by);
        if (body->edge[body->segment[k].slave].facing == UZ_BOUND_SLAVE)
            x->bulge_work += uz_segment_work(x, &body->segment[k], y->checked->pressure, b);
    }
    y->nodal = sqrt(square + 2 * margin + 2 * uz_spring_energy(x, by));
}

/* Of the pair's tractions: its pressure's work on gaps and its work at supports -> middle, what is missing -> residual
 * and R(u_h) -> middle. */
static void weigh_edges(weighing *y, uz_bound_interval *out, const int64_t *dof)
{
    examination *x = &y->x;
    for (int64_t i = 0; i < y->body->n_edges; i++) {
        const uz_bound_edge *edge = &y->body->edge[i];
        double missing[MOMENTS][2], b[3], m[MOMENTS];
        uz_less_load(x->resultant, x, &x->body->edge[i], i);
        uz_examine_tractions(missing, x, y->pair->w, i);
        for (int a = 0; a < x->moments; a++) {
            double axis[2][2], term;
            uz_bound_axes(axis, y->body, i, a);
            for (int k = 0; k < 2; k++) {
                const int64_t at = dof[(i * x->moments + a) * 2 + k];
                if (edge->held[k]) {
                    term = missing[a][k] * edge->value[k];
                } else {
                    uz_along_edge(b, y->u, edge->node, axis[k]);
                    uz_edge_means(m, b, x->moments);
                    term = missing[a][k] * m[a];
                    if (at >= 0)
                        out->residual[at] = missing[a][k];
                }
                out->middle += term;
                out->rounding += UZ_SUM_ROUNDING * fabs(term);
            }
            if (edge->contact >= 0 && !edge->turns) {
                const double *gap = uz_bound_line(y->body, edge)->gap;
                term = x->pressure[i * x->moments + a] * (gap[0] + (gap[1] - gap[0]) * (a + 1) / (x->moments + 1));
                out->middle += term;
                out->rounding += UZ_SUM_ROUNDING * fabs(term);
            }
        }
    }
    out->middle -= y->scratch.dual; /* where normals turn */
    out->rounding += UZ_SUM_ROUNDING * fabs(y->scratch.dual);
}

/* The same of masters, which the slaves' pressure acts on. */
static uz_status weigh_masters(weighing *y, uz_bound_interval *out, const int64_t *dof, uz_error *err)
{
    y->scratch.dual = y->scratch.defect = y->x.scale = 0;
    const uz_status status = uz_press_masters(&y->x, y->u, dof, err);
    out->middle += y->scratch.defect - y->scratch.dual;
    out->rounding += UZ_SUM_ROUNDING * y->x.scale;
    return status;
}

/* w has to be what the adjoint body says of supports. */
static void look_at_supports(const weighing *y, uz_bound_interval *out)
{
    double b[3], size = 0;
    for (int64_t i = 0; i < 2 * y->x.mesh->n_nodes; i++)
        size = fmax(size, fabs(y->pair->w[i]));
    for (int64_t i = 0; i < y->body->n_edges && !*out->fault; i++)
        for (int k = 0; k < 2; k++) {
            const uz_bound_edge *edge = &y->pair->adjoint->edge[i];
            uz_along_edge(b, y->pair->w, edge->node, edge->axis[k]);
            for (int a = 0; a < 3 && edge->held[k]; a++)
                if (!(fabs(b[a] - edge->value[k]) <= 1e-12 * size))
                    snprintf(out->fault, sizeof out->fault, "the supports that it is about meet others");
        }
}

static double norm_of(const examination *x, const double *u)
{
    double sum = 0, margin = 0;
    for (int64_t e = 0; e < x->mesh->n_elements; e++)
        sum += uz_energy_of(&margin, x, u, false, e);
    return sqrt(2 * (sum + margin));
}

/* |d| and bulges, for which w is brought to where it may be: all that widths are of, but for rounding. */
static void measure(weighing *y, uz_bound_interval *out)
{
    const uz_bound_body *body = y->body;
    for (int64_t k = 0; k < body->n_edges * y->x.moments; k++)
        y->limit[k] = y->pair->share * fmax(0, y->checked->pressure[k]);
    y->x.limit = y->limit;
    bring_nodes(y);
    look_at_supports(y, out);
    out->apart = sqrt(square_apart(y, true));
    memcpy(out->local, y->x.gap, (size_t)body->model->mesh.n_elements * sizeof *out->local);
    out->lacking = 100 * y->x.inside * sqrt(2 * fabs(y->x.complementary));
    for (int64_t i = 0; i < 2 * body->model->mesh.n_nodes; i++)
        y->x.farthest = fmax(y->x.farthest, fabs(y->checked->lifted[i]));
    for (int64_t i = 0; i < body->n_edges; i++)
        if (body->edge[i].contact >= 0)
            look_at_edge(y, i);
    look_at_pairs(y);
    out->bulge = sqrt(y->x.bulge) + y->nodal;
    out->pressed = y->x.bulge_work;
    if (!*out->fault)
        snprintf(out->fault, sizeof out->fault, "%.90s", y->scratch.fault);
}

/* What is known of the quantity, and rounding. */
static uz_status find_middle(weighing *y, uz_bound_interval *out, const uz_scene *scene, const int64_t *dof,
                             uz_error *err)
{
    uz_status status = UZ_OK;
    out->rounding = out->lacking * norm_of(&y->x, y->u); /* what is missing within elements works on u_h, too */
    const double work = uz_work_of_loads(&y->x, scene, y->pair->w, &status, err);
    weigh_edges(y, out, dof);
    status = status == UZ_OK ? weigh_masters(y, out, dof, err) : status;
    out->lacking += sqrt(y->x.turning);
    out->middle += work - work_apart(y, out->apart, &out->rounding) + expansion_work(y, &out->rounding);
    out->rounding += UZ_SUM_ROUNDING * fabs(work);
    return status;
}

static uz_status begin_interval(weighing *y, uz_bound_interval *out, int64_t n_dofs, uz_error *err)
{
    *out = (uz_bound_interval){.share = y->pair->share};
    out->local = uz_alloc(y->body->model->mesh.n_elements, sizeof *out->local);
    const uz_status status = begin(y, n_dofs, err);
    return status == UZ_OK && !out->local ? uz_no_memory(err, "what elements have of an interval") : status;
}

uz_status uz_bound_width(uz_bound_interval *out, const uz_bound_pair *pair, const uz_bound_body *body,
                         const uz_bound_check_result *checked, uz_error *err)
{
    weighing y = {.pair = pair, .body = body, .checked = checked};
    const uz_status status = begin_interval(&y, out, 1, err);
    out->middle = NAN;
    if (status == UZ_OK)
        measure(&y, out);
    end(&y);
    return status;
}

uz_status uz_bound_weigh(uz_bound_interval *out, const uz_bound_pair *pair, const uz_bound_body *body,
                         const uz_scene *scene, const int64_t *dof, int64_t n_dofs, const double *u,
                         const double *stress, const uz_bound_check_result *checked, uz_error *err)
{
    weighing y = {.pair = pair, .body = body, .u = u, .stress = stress, .checked = checked};
    uz_status status = begin_interval(&y, out, n_dofs, err);
    if (status == UZ_OK) {
        measure(&y, out);
        out->residual = y.scratch.residual;
        status = find_middle(&y, out, scene, dof, err);
        y.scratch.residual = NULL;
    }
    end(&y);
    return status;
}

/* ---- the interval */

/* Bounds on a = |e_u| and b = |e_sigma|, X = |sigma_h - C eps(u_h)| apart from each other: a^2 / 2 + b^2 / 2 + P is at
 * most F + b |w|, with F the gap and what is lacking (check.c), so that b is largest where it is a + X. */
static double stress_error(const uz_bound_check_result *c, double residual_norm, double *F)
{
    const double rho = uz_bound_lacking(c, residual_norm), w = c->lift, X = sqrt(2 * fmax(0, c->gap));
    *F = c->gap + rho * (uz_bound_error(c, residual_norm) + w);
    const double half = (X - w) / 2, square = half * half + *F + w * X - X * X / 2;
    const double apart = X + fmax(0, -half + sqrt(fmax(0, square))), alone = w + sqrt(w * w + 2 * *F);
    return fmin(alone, apart);
}

double uz_bound_ball(const uz_bound_check_result *c, double residual_norm)
{
    double F;
    const double b = stress_error(c, residual_norm, &F);
    return fmax(0, F + b * c->lift - c->least / 4);
}

double uz_bound_half(const uz_bound_interval *q, const uz_bound_check_result *c, double residual_norm, double own_norm)
{
    const double H = uz_bound_ball(c, residual_norm), A = q->apart, m = q->share;
    const double half = 2 * m * sqrt(H) <= A ? A * sqrt(H) : m * H + A * A / (4 * m);
    double F;
    const double bulged = stress_error(c, residual_norm, &F) + uz_bound_lacking(c, residual_norm);
    return *q->fault ? (double)INFINITY
                     : half + (own_norm + q->lacking) * uz_bound_error(c, residual_norm) + q->rounding + q->pressed +
                           q->bulge * bulged;
}
