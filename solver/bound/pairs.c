/* pairs.c: two straight surfaces of the body that face each other along a line each.
 *
 * What presses is a polynomial on each edge of the one, the slave's; the other, the master, gets the polynomial on each
 * of its edges that has the same moments. On edges of the slave that have nothing before a part of them nothing
 * presses. Which of the two is the slave changes how narrow the bound is, and no more: the one on whose edges the
 * other's lie as a whole, as there the two are one polynomial; else the one that faces more of the other, of equals the
 * finer one. */
#include "bound/bound.h"

#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Relative to the body's extent: how far nodes may be off the line of a surface; and gaps that are none. Of a length:
 * what is covered, or not, by rounding. */
#define STRAIGHT 1e-13
#define TOUCHING (16 * DBL_EPSILON)
#define ROUNDING 1e-10

/* An edge along the line of its surface. */
typedef struct {
    double low, high;
    int64_t edge;
} reach;

typedef struct {
    const uz_group *group;
    double normal[2], place; /* outward; the line's place along it */
    reach *edges;            /* group->n_faces, ascending */
} surface;

static void refuse(uz_bound_body *body, const char *why, const char *name)
{
    if (!*body->why)
        snprintf(body->why, sizeof body->why, why, name);
}

static int by_place(const void *a, const void *b)
{
    const reach *x = a, *y = b;
    return (x->low > y->low) - (x->low < y->low);
}

static double along(const double x[2], const double n[2])
{
    return x[0] * n[0] + x[1] * n[1];
}

/* Its normal and place, and whether all of its nodes are there. way: along which its edges are sorted. */
static bool take_surface(surface *s, const uz_bound_body *body, const double *way)
{
    const double *xyz = body->model->mesh.xyz, extent = body->model->mesh.extent;
    bool straight = s->group && s->group->kind == UZ_GROUP_FACES && s->group->n_inner == 0 && s->group->n_faces > 0;
    for (int64_t i = 0; straight && i < s->group->n_faces; i++) {
        const int64_t at = body->edge_of[4 * s->group->face[i].element + s->group->face[i].side];
        const double *from = xyz + 2 * body->edge[at].node[0], *to = xyz + 2 * body->edge[at].node[1];
        const double length = hypot(to[0] - from[0], to[1] - from[1]);
        const double n[2] = {(to[1] - from[1]) / length, (from[0] - to[0]) / length};
        if (i == 0) {
            memcpy(s->normal, n, sizeof n);
            s->place = along(from, n);
        }
        const double t[2] = {along(from, way ? way : n), along(to, way ? way : n)};
        straight = along(n, s->normal) > 0.5 && fabs(along(from, s->normal) - s->place) <= STRAIGHT * extent &&
                   fabs(along(to, s->normal) - s->place) <= STRAIGHT * extent;
        if (way)
            s->edges[i] = (reach){fmin(t[0], t[1]), fmax(t[0], t[1]), at};
    }
    if (straight && way)
        qsort(s->edges, (size_t)s->group->n_faces, sizeof *s->edges, by_place);
    for (int64_t i = 1; straight && way && i < s->group->n_faces; i++) /* one behind another, too, is no surface */
        straight = s->edges[i].low >= s->edges[i - 1].high - ROUNDING * (s->edges[i].high - s->edges[i].low);
    return straight;
}

/* Of a surface before another one: its edges that are covered all along, how many and how long together, and along how
 * much of the line edges of the other one are before its own in part. */
typedef struct {
    int64_t edges;
    double covered, parted;
} cover;

/* Pairs of edges that face each other, as segments of the first surface's, ascending along the line. Returns how many.
 */
static int64_t face(uz_bound_segment *segment, cover *own, const surface *one, const surface *other, double gap)
{
    int64_t n = 0, first = 0;
    *own = (cover){.edges = 0};
    for (int64_t i = 0; i < one->group->n_faces; i++) {
        const reach *mine = &one->edges[i];
        double sum = 0;
        while (first < other->group->n_faces && other->edges[first].high <= mine->low)
            first++;
        for (int64_t j = first; j < other->group->n_faces && other->edges[j].low < mine->high; j++) {
            const double low = fmax(mine->low, other->edges[j].low), high = fmin(mine->high, other->edges[j].high);
            if (!(high - low > ROUNDING * (mine->high - mine->low)))
                continue;
            segment[n++] = (uz_bound_segment){.slave = mine->edge,
                                              .master = other->edges[j].edge,
                                              .part = {low, high},
                                              .on = {low, high},
                                              .gap = gap};
            sum += high - low;
            const double whole = other->edges[j].high - other->edges[j].low;
            own->parted += high - low < (1 - ROUNDING) * whole ? high - low : 0;
        }
        if (sum >= (1 - ROUNDING) * (mine->high - mine->low)) {
            own->edges++;
            own->covered += mine->high - mine->low;
        }
    }
    return n;
}

/* From places along the line to parts of edges. */
static void take_parts(uz_bound_segment *s, const uz_bound_body *body, const double way[2])
{
    const double *xyz = body->model->mesh.xyz;
    for (int side = 0; side < 2; side++) {
        const int64_t *node = body->edge[side == 0 ? s->slave : s->master].node;
        const double from = along(xyz + 2 * node[0], way), to = along(xyz + 2 * node[1], way);
        double *part = side == 0 ? s->part : s->on;
        for (int k = 0; k < 2; k++)
            part[k] = fmin(1, fmax(0, (part[k] - from) / (to - from)));
    }
}

static void take_edge(uz_bound_body *body, int64_t i, uz_bound_facing facing, const double n[2], const char *name)
{
    uz_bound_edge *edge = &body->edge[i];
    if (edge->contact >= 0 || (edge->facing != UZ_BOUND_ALONE && edge->facing != facing))
        refuse(body, "an edge of \"%s\" has two obstacles before it", name);
    if (edge->held[0] || edge->held[1])
        refuse(body, "supports hold edges of \"%s\", which other edges face", name);
    edge->facing = facing;
    memcpy(edge->normal, n, sizeof edge->normal);
    edge->axis[0][0] = edge->axis[1][1] = n[0];
    edge->axis[0][1] = n[1];
    edge->axis[1][0] = -n[1];
}

/* The segments, by slaves; both sides' edges learn what they are. */
static void take_segments(uz_bound_body *body, int64_t n, const surface *slave, const double way[2],
                          const uz_contact *contact, int64_t number)
{
    uz_bound_segment *segment = body->segment + body->n_segments;
    for (int64_t i = 0, next = 0; i < n; i = next) {
        double sum = 0;
        for (next = i; next < n && segment[next].slave == segment[i].slave; next++) {
            take_parts(&segment[next], body, way);
            segment[next].contact = number;
            sum += fabs(segment[next].part[1] - segment[next].part[0]);
        }
        const bool all = sum >= 1 - ROUNDING;
        take_edge(body, segment[i].slave, all ? UZ_BOUND_SLAVE : UZ_BOUND_PARTLY, slave->normal, contact->on);
        for (int64_t k = i; k < next && all; k++)
            take_edge(body, segment[k].master, UZ_BOUND_MASTER, slave->normal, contact->with);
    }
    body->n_segments += n;
}

uz_status uz_bound_take_pair(uz_bound_body *body, const uz_scene *scene, int64_t number, uz_error *err)
{
    const uz_contact *contact = &scene->contacts[number];
    const uz_mesh *mesh = &body->model->mesh;
    surface s[2] = {{.group = uz_mesh_group(mesh, contact->on, "", NULL)},
                    {.group = uz_mesh_group(mesh, contact->with, "", NULL)}};
    if (!take_surface(&s[0], body, NULL) || !take_surface(&s[1], body, NULL) ||
        !(along(s[0].normal, s[1].normal) < -1 + 1e-12)) {
        refuse(body,
               "the contact of \"%s\" is with another part of the body, and the two are not straight and parallel",
               contact->on);
        return UZ_OK;
    }
    const int64_t total = s[0].group->n_faces + s[1].group->n_faces;
    const double way[2] = {-s[0].normal[1], s[0].normal[0]}, gap = -s[1].place - s[0].place;
    uz_bound_segment *segment = uz_alloc(body->n_segments + total, sizeof *segment);
    s[0].edges = uz_alloc(total, sizeof *s[0].edges);
    if (segment && body->n_segments > 0)
        memcpy(segment, body->segment, (size_t)body->n_segments * sizeof *segment);
    if (!segment || !s[0].edges) {
        uz_free_all(segment, s[0].edges);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the %lld edges of a contact", (long long)total);
    }
    free(body->segment);
    body->segment = segment;
    segment += body->n_segments;
    s[1].edges = s[0].edges + s[0].group->n_faces;
    cover of[2];
    if (!take_surface(&s[0], body, way) || !take_surface(&s[1], body, way)) {
        refuse(body, "the contact of \"%s\" is with another part of the body, and edges lie on each other",
               contact->on);
        free(s[0].edges);
        return UZ_OK;
    }
    const double own = fabs(gap) < TOUCHING * mesh->extent ? 0 : gap;
    face(segment, &of[0], &s[0], &s[1], own);
    face(segment, &of[1], &s[1], &s[0], own);
    const double same = ROUNDING * mesh->extent, share[2] = {(double)of[0].edges / (double)s[0].group->n_faces,
                                                             (double)of[1].edges / (double)s[1].group->n_faces};
    const bool whole[2] = {of[0].parted <= same && of[0].covered >= of[1].covered - same,
                           of[1].parted <= same && of[1].covered >= of[0].covered - same};
    const bool finer = s[1].group->n_faces > s[0].group->n_faces;
    const int slave = whole[0] != whole[1] ? whole[1] : share[1] > share[0] || (!(share[1] < share[0]) && finer);
    take_segments(body, face(segment, &of[slave], &s[slave], &s[1 - slave], own), &s[slave], way, contact, number);
    free(s[0].edges);
    return UZ_OK;
}

void uz_bound_segment_weights(double W[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS], const uz_bound_body *body,
                              const uz_bound_segment *s)
{
    static const double AT[3] = {0.11270166537925831, 0.5, 0.88729833462074169},
                        WEIGHT[3] = {5. / 18, 8. / 18, 5. / 18};
    const int moments = body->degree + 1;
    memset(W, 0, sizeof(double) * UZ_BOUND_MOMENTS * UZ_BOUND_MOMENTS);
    for (int g = 0; g < 3; g++) {
        double mine[UZ_BOUND_MOMENTS], its[UZ_BOUND_MOMENTS];
        uz_bound_bernstein(mine, moments, s->part[0] + AT[g] * (s->part[1] - s->part[0]));
        uz_bound_bernstein(its, moments, s->on[0] + AT[g] * (s->on[1] - s->on[0]));
        for (int a = 0; a < moments; a++)
            for (int b = 0; b < moments; b++)
                for (int k = 0; k < moments; k++)
                    W[a][b] += WEIGHT[g] * fabs(s->part[1] - s->part[0]) * mine[a] * its[k] *
                               uz_bound_product_inverse[body->degree - 1][k][b];
    }
}
