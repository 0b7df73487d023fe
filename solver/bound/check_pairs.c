/* check_pairs.c: edges that face other edges of the body (pairs.c).
 *
 * What presses is that of the slave's stress, r. On the master's edges it is a traction that the stress, a polynomial T
 * on each of them, has in the mean: what T lacks of r's moments joins the residual, and r - T, which is then orthogonal
 * to the polynomials on an edge, is bounded as what turns before round obstacles is (check_round.c). The gap is
 * s = gap - (u_slave - u_master) . n along the segments, polynomials of degree 2 at most. */
#include "bound/check.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>

enum { POINTS = 4, MOMENTS = UZ_BOUND_MOMENTS }; /* products of three polynomials of degree 2 */

typedef struct {
    const uz_bound_edge *slave, *master;
    double length, area;                           /* of the slave's edge; times thickness */
    double at[POINTS], on[POINTS], weight[POINTS]; /* weights of the whole edge */
} stretch;

static double length_of(const examination *x, const uz_bound_edge *edge)
{
    const double *from = x->mesh->xyz + 2 * edge->node[0], *to = x->mesh->xyz + 2 * edge->node[1];
    return hypot(to[0] - from[0], to[1] - from[1]);
}

static stretch stretch_of(const examination *x, const uz_bound_segment *s)
{
    stretch t = {.slave = &x->body->edge[s->slave], .master = &x->body->edge[s->master]};
    double point[POINTS], weight[POINTS];
    uz_gauss(point, weight, POINTS);
    t.length = length_of(x, t.slave);
    t.area = t.length * x->body->depth;
    for (int g = 0; g < POINTS; g++) {
        const double q = (1 + point[g]) / 2;
        t.at[g] = s->part[0] + q * (s->part[1] - s->part[0]);
        t.on[g] = s->on[0] + q * (s->on[1] - s->on[0]);
        t.weight[g] = weight[g] / 2 * fabs(s->part[1] - s->part[0]);
    }
    return t;
}

static double value(const double b[3], double q)
{
    return b[0] * (1 - q) * (1 - q) + 2 * b[1] * q * (1 - q) + b[2] * q * q;
}

/* A polynomial by its resultants on an edge. */
static double pressure_at(const double *resultant, int moments, double area, double q)
{
    double phi[MOMENTS], sum = 0;
    uz_bound_bernstein(phi, moments, q);
    for (int a = 0; a < moments; a++)
        sum += resultant[a] * moments / area * phi[a];
    return sum;
}

void uz_along_segment(double b[3], const examination *x, const uz_bound_segment *s, const double *v)
{
    const uz_bound_edge *slave = &x->body->edge[s->slave], *master = &x->body->edge[s->master];
    double mine[3], its[3], at[3];
    uz_along_edge(mine, v, slave->node, slave->normal);
    uz_along_edge(its, v, master->node, slave->normal);
    for (int k = 0; k < 3; k++)
        at[k] = value(mine, s->part[0] + k * (s->part[1] - s->part[0]) / 2) -
                value(its, s->on[0] + k * (s->on[1] - s->on[0]) / 2);
    b[0] = at[0];
    b[1] = 2 * at[1] - (at[0] + at[2]) / 2;
    b[2] = at[2];
}

double uz_segment_work(const examination *x, const uz_bound_segment *s, const double *pressure, const double b[3])
{
    const stretch t = stretch_of(x, s);
    double work = 0;
    for (int g = 0; g < POINTS; g++)
        work += t.weight[g] * t.area * pressure_at(pressure + s->slave * x->moments, x->moments, t.area, t.at[g]) *
                value(b, (t.at[g] - s->part[0]) / (s->part[1] - s->part[0]));
    return work;
}

static bool presses(const examination *x, const uz_bound_segment *s)
{
    return x->body->edge[s->slave].facing == UZ_BOUND_SLAVE;
}

/* ---- what presses on the master */

/* The pressure's work, and the master's share of it: `acting`, resultants by edges and moments, as integrals yet. */
static void press(examination *x, double *acting, const uz_bound_segment *s, const double *u)
{
    const stretch t = stretch_of(x, s);
    const double open[3] = {s->gap, s->gap, s->gap};
    double leap[3];
    uz_along_segment(leap, x, s, u);
    const double on_gap = uz_segment_work(x, s, x->pressure, open), moved = uz_segment_work(x, s, x->pressure, leap);
    uz_add_contact_gap(x, &x->body->edge[s->slave], on_gap - moved);
    x->out->dual -= on_gap;
    x->scale += fabs(on_gap) + fabs(moved);
    for (int g = 0; g < POINTS; g++) {
        double phi[MOMENTS];
        const double r = pressure_at(x->pressure + s->slave * x->moments, x->moments, t.area, t.at[g]);
        uz_bound_bernstein(phi, x->moments, t.on[g]);
        for (int a = 0; a < x->moments; a++)
            acting[s->master * x->moments + a] += t.weight[g] * t.area * r * phi[a];
    }
}

/* The polynomial that has these moments: its resultants. */
static void project(examination *x, double *acting, const double *u, const int64_t *dof, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double b[3], m[MOMENTS], integral[MOMENTS], *to = acting + i * x->moments;
    for (int a = 0; a < x->moments; a++) {
        integral[a] = to[a];
        to[a] = 0;
    }
    for (int a = 0; a < x->moments; a++)
        for (int k = 0; k < x->moments; k++)
            to[a] += uz_bound_product_inverse[x->moments - 2][a][k] * integral[k] / x->moments;
    uz_along_edge(b, u, edge->node, edge->normal);
    uz_edge_means(m, b, x->moments);
    for (int a = 0; a < x->moments; a++) {
        const int64_t at = dof[(i * x->moments + a) * 2];
        x->out->residual[at] += to[a];
        x->out->defect += to[a] * m[a];
        x->scale += fabs(to[a] * m[a]);
    }
}

/* int |r - T|^2 of each master's edge -> left, covered: what of it segments cover. */
static void compare(const examination *x, double *left, double *covered, const double *acting,
                    const uz_bound_segment *s)
{
    const stretch t = stretch_of(x, s);
    const double area = length_of(x, t.master) * x->body->depth;
    for (int g = 0; g < POINTS; g++) {
        const double off = pressure_at(x->pressure + s->slave * x->moments, x->moments, t.area, t.at[g]) -
                           pressure_at(acting + s->master * x->moments, x->moments, area, t.on[g]);
        left[s->master] += t.weight[g] * t.length * off * off;
    }
    covered[s->master] += fabs(s->on[1] - s->on[0]);
}

/* ... of the parts before which there is nothing: no more than of the whole edge. */
static double uncovered(const examination *x, const double *acting, int64_t i)
{
    const double length = length_of(x, &x->body->edge[i]), area = length * x->body->depth;
    double at[POINTS], weight[POINTS], sum = 0;
    uz_gauss(at, weight, POINTS);
    for (int g = 0; g < POINTS; g++) {
        const double t = pressure_at(acting + i * x->moments, x->moments, area, (1 + at[g]) / 2);
        sum += weight[g] / 2 * length * t * t;
    }
    return sum;
}

uz_status uz_press_masters(examination *x, const double *u, const int64_t *dof, uz_error *err)
{
    const uz_bound_body *body = x->body;
    if (body->n_segments == 0)
        return UZ_OK;
    double *acting = uz_alloc_zero(body->n_edges * x->moments, sizeof *acting);
    double *left = uz_alloc_zero(2 * body->n_edges, sizeof *left), *covered = left ? left + body->n_edges : NULL;
    if (!acting || !left) {
        uz_free_all(acting, left);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for what presses on %lld edges", (long long)body->n_edges);
    }
    for (int64_t k = 0; k < body->n_segments; k++)
        if (presses(x, &body->segment[k]))
            press(x, acting, &body->segment[k], u);
    for (int64_t i = 0; i < body->n_edges; i++)
        if (body->edge[i].facing == UZ_BOUND_MASTER)
            project(x, acting, u, dof, i);
    for (int64_t k = 0; k < body->n_segments; k++)
        if (presses(x, &body->segment[k]))
            compare(x, left, covered, acting, &body->segment[k]);
    for (int64_t i = 0; i < body->n_edges; i++)
        if (body->edge[i].facing == UZ_BOUND_MASTER)
            uz_count_turning(x, &body->edge[i], left[i] + (covered[i] < 1 - 1e-10 ? uncovered(x, acting, i) : 0));
    uz_free_all(acting, left);
    return UZ_OK;
}

/* ---- what is in the other body */

/* The nodes of a slave's edge go by as much as any of its segments needs, after what was given. */
void uz_take_pairs_apart(examination *x, const double *u)
{
    for (int64_t k = 0; k < x->body->n_segments; k++) {
        const uz_bound_segment *s = &x->body->segment[k];
        const uz_bound_edge *slave = &x->body->edge[s->slave];
        double leap[3], given[3] = {0}, left[3], by = 0;
        uz_along_segment(leap, x, s, u);
        if (x->given)
            uz_along_segment(given, x, s, x->given);
        for (int a = 0; a < 3; a++)
            left[a] = s->gap - leap[a] - given[a];
        for (int a = 0; a < 3; a++)
            by = fmax(by, -left[a] - (a == 1 ? sqrt(fmax(0, left[0]) * fmax(0, left[2])) : 0));
        for (int a = 0; a < 2; a++)
            uz_lift_node(x, slave->node[a], slave->normal, by);
    }
    uz_middle_slaves(x);
}

void uz_middle_slaves(examination *x)
{
    for (int64_t i = 0; i < x->body->n_edges; i++) {
        const uz_bound_edge *edge = &x->body->edge[i];
        if ((edge->facing != UZ_BOUND_SLAVE && edge->facing != UZ_BOUND_PARTLY) || edge->node[2] < 0)
            continue;
        for (int c = 0; c < 2; c++)
            x->lift[2 * edge->node[2] + c] = (x->lift[2 * edge->node[0] + c] + x->lift[2 * edge->node[1] + c]) / 2;
    }
}

void uz_look_at_pairs(examination *x, const double *u)
{
    for (int64_t k = 0; k < x->body->n_segments; k++) {
        const uz_bound_segment *s = &x->body->segment[k];
        double leap[3], lift[3], left[3], tolerance = uz_place_rounding(x);
        uz_along_segment(leap, x, s, u);
        uz_along_segment(lift, x, s, x->lift);
        x->out->gap -= presses(x, s) ? uz_segment_work(x, s, x->pressure, lift) : 0;
        for (int a = 0; a < 3; a++)
            tolerance = fmax(tolerance, 1e-12 * (fabs(leap[a]) + fabs(s->gap)));
        for (int a = 0; a < 3; a++)
            left[a] = s->gap - leap[a] - lift[a] + tolerance;
        if (!*x->out->fault && !(left[0] >= 0 && left[2] >= 0 && left[1] >= -sqrt(left[0] * left[2]) - tolerance))
            snprintf(x->out->fault, sizeof x->out->fault, "bodies are in each other where supports keep them there");
    }
}
