/* mortar_pairs.c: which sides of a contact face each other, and which of the two is the slave.
 *
 * Both surfaces are one list of sides here, as a side may belong to either. Two sides may touch if one is of `on` and
 * the other of `with`, unless they have a node in common or are front and back of one part of the body: what lies
 * behind a side is its own back if the body goes on all the way between them (scene/mesh_parts.h).
 *
 * Sides make zones, and of each two zones that face each other the one with the finer mesh is the slave (the linear
 * one, unless its sides are more than twice as long as quadratic ones), whichever is called `on`. Sides of one surface
 * alone are of one zone as far as they hang together; those of both, where the surface may touch itself, as far as it
 * is smooth, and where a smooth piece faces itself it is divided in two. So each pair of places is seen from one side
 * only. */
#include "assembly/mortar.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "obstacle/candidates.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sizes that are the same but for rounding. */
#define ALIKE 1e-6

/* Sides of a zone that are looked at before the slave is chosen. */
enum { LOOKED_AT = 500 };

/* The sides of both groups, each once: those of `on`, then the others of `with`; where there are common ones in an
 * order that does not depend on which group is called `on`. */
static bool join_groups(uz_mortar_pair *pair, const uz_contact_input *in)
{
    const uz_group *group[2] = {in->on, in->with};
    const int64_t n = in->on->n_faces + in->with->n_faces;
    unsigned char *has[2] = {uz_alloc_zero(in->model->mesh.n_elements, 1),
                             uz_alloc_zero(in->model->mesh.n_elements, 1)};
    uz_group *all = &pair->group;
    bool common = false;
    memcpy(all->name, in->on->name, sizeof all->name);
    all->kind = UZ_GROUP_FACES;
    all->face = uz_alloc(n, sizeof *all->face);
    pair->of = uz_alloc(n, 1);
    const bool room = has[0] && has[1] && all->face && pair->of;
    for (int k = 0; k < 2 && room; k++)
        for (int64_t i = 0; i < group[k]->n_faces; i++) {
            const uz_face face = group[k]->face[i];
            const unsigned char bit = (unsigned char)(1u << face.side);
            if (k == 1 && has[0][face.element] & bit)
                common = true;
            else if (!(has[k][face.element] & bit))
                all->face[all->n_faces++] = face;
            has[k][face.element] |= bit;
        }
    if (common)
        qsort(all->face, (size_t)all->n_faces, sizeof *all->face, uz_face_order);
    for (int64_t i = 0; i < all->n_faces && room; i++) {
        pair->of[i] = 0;
        for (int k = 0; k < 2; k++)
            if (has[k][all->face[i].element] >> all->face[i].side & 1)
                pair->of[i] |= (unsigned char)(k == 0 ? UZ_OF_ON : UZ_OF_WITH);
    }
    free(has[0]);
    free(has[1]);
    return room;
}

/* Between the corners of one side; box: 2 dim. */
static double enclose(double *box, const uz_mortar_side *side, int dim)
{
    double size = 0;
    for (int c = 0; c < dim; c++) {
        box[c] = INFINITY;
        box[dim + c] = -INFINITY;
        for (int a = 0; a < side->nodes; a++) {
            box[c] = fmin(box[c], side->xyz[dim * a + c]);
            box[dim + c] = fmax(box[dim + c], side->xyz[dim * a + c]);
        }
        size = hypot(size, box[dim + c] - box[c]);
    }
    return size;
}

/* The tree of the sides, and their balls. */
static uz_status plant_tree(uz_mortar_pair *pair, int dim, uz_error *err)
{
    uz_mortar_surface *surface = &pair->surface;
    double *box = uz_alloc(surface->n, 6 * sizeof *box);
    pair->ball = uz_alloc_zero(surface->n, 4 * sizeof *pair->ball);
    uz_status status = box && pair->ball ? UZ_OK : uz_no_memory(err, UZ_OF_SURFACES);
    for (int64_t i = 0; i < surface->n && status == UZ_OK; i++) {
        const uz_mortar_side *side = &surface->side[i];
        double *ball = pair->ball + 4 * i, most = 0;
        enclose(box + 2 * dim * i, side, dim);
        for (int k = 0; k < side->nodes * dim; k++)
            ball[k % dim] += side->xyz[k] / side->nodes;
        for (int a = 0; a < side->nodes; a++)
            most = fmax(most, uz_distance2(side->xyz + a * dim, ball, dim));
        ball[3] = sqrt(most);
    }
    if (status == UZ_OK)
        status = uz_box_tree_init(&surface->tree, surface->n, dim, box, err);
    free(box);
    return status;
}

uz_status uz_mortar_pair_make(uz_mortar_pair *pair, const uz_contact_input *in, uz_error *err)
{
    uz_contact_input before = *in;
    const int dim = in->model->mesh.dim;
    *pair = (uz_mortar_pair){.in = in};
    before.model = in->rest;
    before.rest = NULL;
    if (!join_groups(pair, in))
        return uz_no_memory(err, UZ_OF_SURFACES);
    pair->near = uz_alloc(pair->group.n_faces, sizeof *pair->near);
    pair->way = uz_alloc_zero(pair->group.n_faces, sizeof *pair->way);
    uz_status status = pair->near && pair->way ? UZ_OK : uz_no_memory(err, UZ_OF_SURFACES);
    if (status == UZ_OK)
        status = uz_mortar_surface_make(&pair->surface, in, &pair->group, err);
    if (status == UZ_OK)
        status = plant_tree(pair, dim, err);
    if (status == UZ_OK)
        status = uz_own_body_new(&pair->own, &in->model->mesh, in->on, in->with, err);
    if (status == UZ_OK && in->rest && !in->contact->faceted) {
        status = uz_mortar_surface_make(&pair->rest, &before, &pair->group, err);
        pair->surface.rest = &pair->rest;
    }
    /* The normals that smooth shapes give a surface in space at rest differ from those of its facets: so they do where
     * it has moved. */
    if (status == UZ_OK && pair->surface.rest && dim == 3) {
        uz_mortar_surface facets = {0}, *surface = &pair->surface;
        uz_contact faceted = *in->contact;
        faceted.faceted = true;
        before.contact = &faceted;
        status = uz_mortar_surface_make(&facets, &before, &pair->group, err);
        const bool same = status == UZ_OK && facets.n_places == surface->n_places;
        for (int64_t p = 0; p < surface->n_places && same; p++) {
            for (int c = 0; c < 3; c++)
                surface->normal[3 * p + c] += pair->rest.normal[3 * p + c] - facets.normal[3 * p + c];
            uz_unit3(surface->normal + 3 * p);
        }
        uz_mortar_surface_clear(&facets);
    }
    return status;
}

void uz_mortar_pair_clear(uz_mortar_pair *pair)
{
    uz_mortar_surface_clear(&pair->surface);
    uz_mortar_surface_clear(&pair->rest);
    uz_own_body_free(pair->own);
    uz_free_all(pair->group.face, pair->of, pair->points.point, pair->near, pair->ball, pair->way);
}

/* ---- the points of a side */

uz_way uz_mortar_way(uz_mortar_pair *pair, int64_t i, int64_t j, const double *x, const double *y)
{
    const uz_face *face = pair->group.face;
    if (!pair->own)
        return UZ_WAY_OVERLAP;
    if (pair->way[j] / 3 != i + 1) /* of two sides the first point tells */
        pair->way[j] = 3 * (i + 1) + (int64_t)uz_own_body_way(pair->own, face[i].element, x, face[j].element, y);
    return (uz_way)(pair->way[j] % 3);
}

typedef struct {
    uz_mortar_pair *pair;
    int64_t i, met;
    double normal[3]; /* of side i */
} search;

/* In space what side i meets is in the cylinder on it, across its plane: far away that is little of what is near. */
static bool list_near(void *ctx, int64_t item)
{
    search *s = ctx;
    const unsigned char of_mine = s->pair->of[s->i], of_its = s->pair->of[item];
    const uz_mortar_side *a = &s->pair->surface.side[s->i], *b = &s->pair->surface.side[item];
    s->met++;
    if (s->pair->in->model->mesh.dim == 3) {
        const double *mine = s->pair->ball + 4 * s->i, *its = s->pair->ball + 4 * item;
        const double off[3] = {its[0] - mine[0], its[1] - mine[1], its[2] - mine[2]};
        const double reach = 1.001 * (mine[3] + its[3]);
        double across[3];
        uz_cross3(across, off, s->normal);
        if (uz_dot3(across, across) > reach * reach)
            return false;
    }
    if (!(of_mine & UZ_OF_ON && of_its & UZ_OF_WITH) && !(of_mine & UZ_OF_WITH && of_its & UZ_OF_ON))
        return false;
    for (int k = 0; k < a->nodes && s->pair->own; k++)
        for (int l = 0; l < b->nodes; l++)
            if (a->node[k] == b->node[l])
                return false; /* neighbours do not touch */
    s->pair->near[s->pair->n_near++] = item;
    return false;
}

/* The area of all points. Where the master has several layers, as of a plate and what is behind it, only the nearest is
 * kept: what is farther than it by more than the side's size goes. */
static double covered_area(uz_mortar_points *points, double size)
{
    double area = 0, nearest = INFINITY;
    int64_t kept = 0;
    for (int64_t g = 0; g < points->n; g++)
        nearest = fmin(nearest, fabs(points->point[g].gap));
    for (int64_t g = 0; g < points->n; g++)
        if (fabs(points->point[g].gap) <= nearest + size) {
            area += points->point[g].weight;
            points->point[kept++] = points->point[g];
        }
    points->n = kept;
    return area;
}

/* The master is looked for close by, then farther away as long as the side is not covered: most sides are covered at
 * once. Layers nearer to each other than the side's size are told apart point by point where they cover it more than
 * once. */
bool uz_mortar_find_points(uz_mortar_pair *pair, int64_t i)
{
    const int dim = pair->in->model->mesh.dim;
    const uz_mortar_geometry *geometry = uz_mortar_geometry_of(dim);
    const double area = pair->surface.side[i].area;
    double box[6], covered = 0;
    const double size = enclose(box, &pair->surface.side[i], dim);
    int64_t before = -1;
    search s = {.pair = pair, .i = i};
    const uz_side shape = uz_mortar_side_of(&pair->surface.side[i], pair->in->model);
    static const double MIDDLE[2][2] = {{0, 0}, {1. / 3, 1. / 3}};
    uz_side_area_vector(s.normal, &shape, MIDDLE[dim == 3 && shape.nodes % 3 == 0]);
    uz_unit3(s.normal);
    pair->points.n = 0;
    for (double reach = size; covered < (1 - 1e-9) * area; reach *= 8) {
        double wide[6];
        for (int c = 0; c < dim; c++) { /* in space the box of that cylinder */
            const double *ball = pair->ball + 4 * i, aside = reach * fabs(s.normal[c]) + 1.001 * ball[3];
            wide[c] = dim == 3 ? ball[c] - aside : box[c] - reach;
            wide[dim + c] = dim == 3 ? ball[c] + aside : box[dim + c] + reach;
        }
        pair->n_near = s.met = 0;
        uz_box_tree_meet(&pair->surface.tree, wide, list_near, &s);
        if (pair->n_near > before) {
            before = pair->n_near;
            qsort(pair->near, (size_t)pair->n_near, sizeof *pair->near, uz_ascending);
            pair->points.n = 0;
            if (!geometry->points(pair, i))
                return false;
            covered = covered_area(&pair->points, size);
            pair->layered = dim == 3 && covered > (1 + 1e-6) * area;
            pair->points.n = pair->layered ? 0 : pair->points.n;
            if (pair->layered && !geometry->points(pair, i))
                return false;
            pair->layered = false;
        }
        covered = covered_area(&pair->points, size);
        if (s.met == pair->surface.n || reach > 2 * pair->in->model->mesh.extent)
            break;
    }
    return true;
}

/* ---- zones */

/* zone (sides): which of the zones each is of. Returns how many; -1: no memory. */
static int64_t number_zones(int64_t *zone, const uz_mortar_pair *pair)
{
    const uz_mortar_surface *surface = &pair->surface;
    const int64_t places = surface->n_places;
    int64_t *of = uz_alloc(places, sizeof *of), *id = uz_alloc(3 * places, sizeof *id), count = 0;
    unsigned char *used = uz_alloc_zero(places, 1);
    const bool room = of && id && used;
    for (int64_t k = 0; k < 3 * places && room; k++)
        id[k] = -1;
    for (int group = 1; group <= 3 && room; group++) {
        int64_t *const own = id + (group - 1) * places;
        for (int64_t p = 0; p < places; p++)
            of[p] = p;
        for (int64_t i = 0; i < surface->n; i++)
            for (int a = 0; a < surface->side[i].nodes && pair->of[i] == group; a++) {
                uz_join(of, surface->side[i].place[a], surface->side[i].place[0]);
                used[surface->side[i].place[a]] |= (unsigned char)(1u << group);
            }
        for (int64_t p = 1, last = 0; p < places && group < 3; p++) { /* around corners, too */
            if (!(used[p] >> group & 1))
                continue;
            if (surface->node[p] == surface->node[last] && used[last] >> group & 1)
                uz_join(of, p, last);
            last = p;
        }
        for (int64_t i = 0; i < surface->n; i++) {
            if (pair->of[i] != group)
                continue;
            const int64_t root = uz_join_root(of, surface->side[i].place[0]);
            own[root] = own[root] < 0 ? count++ : own[root];
            zone[i] = own[root];
        }
    }
    uz_free_all(of, id, used);
    return room ? count : -1;
}

/* ---- zones in their order */

typedef struct {
    double area, stiffness, away,
        middle[3];               /* the mean over its sides; away: of their middle, from that of all nodes */
    int64_t first, side, number; /* the lowest place and side of a zone, and its number */
    int64_t held, dofs;          /* of its sides' nodes, those of rigid groups being held */
    bool bound;                  /* of a tie: most of it is held, and can't follow */
    int64_t fixed;               /* dofs of its part of the body that are held */
} zone_mark;

/* -1, 1; 0: the same but for rounding. */
static int compare_sizes(double x, double y)
{
    return fabs(x - y) <= ALIKE * fmax(fabs(x), fabs(y)) ? 0 : x < y ? -1 : 1;
}

/* What can't follow is last; the smaller one first, which ends on the other, then the softer, then the nearer to the
 * middle of the mesh, then the one of fewer nodes, which is linear, then that of the part which is held less: what does
 * not depend on how nodes are numbered, nor on which of them is `on`, nor on the axes. Then the lowest nodes. */
static int by_order(const void *a, const void *b)
{
    const zone_mark *x = a, *y = b;
    const int area = compare_sizes(x->area, y->area), stiffness = compare_sizes(x->stiffness, y->stiffness),
              away = compare_sizes(x->away, y->away);
    if (x->bound != y->bound)
        return x->bound ? 1 : -1;
    if (area || stiffness || away)
        return area ? area : stiffness ? stiffness : away;
    if (x->dofs != y->dofs)
        return x->dofs < y->dofs ? -1 : 1;
    if (x->fixed != y->fixed)
        return x->fixed < y->fixed ? -1 : 1;
    return x->first != y->first ? (x->first > y->first) - (x->first < y->first)
                                : (x->side > y->side) - (x->side < y->side);
}

/* Where a surface touches itself what a zone is depends on how much of the body the surface has, and its zones are of
 * one body: they have no sizes. */
static void measure_zones(zone_mark *mark, int64_t count, const int64_t *zone, const uz_mortar_pair *pair)
{
    const uz_body_model *model = pair->in->model;
    const int dim = model->mesh.dim;
    double middle[3];
    bool itself = false;
    uz_mesh_middle(middle, &model->mesh);
    for (int64_t i = 0; i < pair->surface.n; i++)
        itself = itself || pair->of[i] == (UZ_OF_ON | UZ_OF_WITH);
    for (int64_t z = 0; z < count; z++)
        mark[z] = (zone_mark){.first = INT64_MAX, .side = INT64_MAX, .number = z};
    for (int64_t i = 0; i < pair->surface.n; i++) {
        const uz_mortar_side *side = &pair->surface.side[i];
        zone_mark *of = mark + zone[i];
        of->area += side->area;
        of->stiffness += side->area * uz_most_stiffness(uz_element_material(model, side->face.element)->lame);
        for (int k = 0; k < side->nodes * dim; k++)
            of->middle[k % dim] += side->area * side->xyz[k] / side->nodes;
        for (int a = 0; a < side->nodes; a++) {
            of->first = side->place[a] < of->first ? side->place[a] : of->first;
            of->dofs += dim;
            for (int c = 0; c < dim; c++)
                of->held += model->dof[side->node[a] * dim + c] < 0 || uz_is_rigid(model, side->node[a]);
        }
        of->side = i < of->side ? i : of->side;
    }
    for (int64_t z = 0; z < count; z++) {
        mark[z].bound = pair->in->tie && 2 * mark[z].held > mark[z].dofs;
        if (itself) {
            mark[z].area = mark[z].stiffness = 0;
            mark[z].dofs = 0;
            continue;
        }
        mark[z].stiffness /= mark[z].area;
        for (int c = 0; c < dim; c++)
            mark[z].middle[c] /= mark[z].area;
        /* of sides around the middle it is rounding, which is to decide nothing */
        mark[z].away = model->mesh.extent + sqrt(uz_distance2(mark[z].middle, middle, dim));
    }
}

/* What holds the parts of the body that zones are of: it tells equal ones that are shifted against each other, as a
 * half turn makes one of the other. False: no memory. */
static bool measure_parts(zone_mark *mark, const int64_t *zone, const uz_mortar_pair *pair)
{
    const uz_body_model *model = pair->in->model;
    const uz_mesh *mesh = &model->mesh;
    int64_t *part = uz_alloc(mesh->n_nodes, sizeof *part), *fixed = uz_alloc_zero(mesh->n_nodes, sizeof *fixed);
    const bool room = part && fixed && uz_mesh_number_parts(part, mesh) >= 0;
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim && room; i++)
        fixed[part[i / mesh->dim]] += model->dof[i] < 0 || uz_is_rigid(model, i / mesh->dim);
    for (int64_t i = 0; i < pair->surface.n && room; i++)
        mark[zone[i]].fixed = fixed[part[pair->surface.side[i].node[0]]];
    free(part);
    free(fixed);
    return room;
}

/* Do only numbers tell some of them? */
static bool are_alike(const zone_mark *mark, int64_t count)
{
    bool alike = false;
    for (int64_t z = 1; z < count && !alike; z++) {
        zone_mark last = mark[z - 1];
        last.first = mark[z].first;
        last.side = mark[z].side;
        alike = by_order(&last, &mark[z]) == 0;
    }
    return alike;
}

/* Zones are numbered by their order. bound: of each, as of its mark. False: no memory. */
static bool order_zones(int64_t *zone, bool *bound, int64_t count, const uz_mortar_pair *pair)
{
    zone_mark *mark = uz_alloc(count, sizeof *mark);
    int64_t *number = uz_alloc(count, sizeof *number);
    bool room = mark && number;
    if (room) {
        measure_zones(mark, count, zone, pair);
        qsort(mark, (size_t)count, sizeof *mark, by_order);
    }
    if (room && count > 1 && mark[0].area > 0 && are_alike(mark, count)) {
        measure_zones(mark, count, zone, pair);
        room = measure_parts(mark, zone, pair);
        qsort(mark, (size_t)count, sizeof *mark, by_order);
    }
    for (int64_t z = 0; z < count && room; z++) {
        number[mark[z].number] = z;
        bound[z] = mark[z].bound;
    }
    for (int64_t i = 0; i < pair->surface.n && room; i++)
        zone[i] = number[zone[i]];
    free(mark);
    free(number);
    return room;
}

/* ---- which zone is the slave */

/* What one point tells of its two zones, lo < hi. */
typedef struct {
    int64_t lo, hi, order;
    bool from_hi;
    double gap, fine[2]; /* fine: area over the distance of nodes, of lo and hi */
} sample;

static int by_zones(const void *a, const void *b)
{
    const sample *x = a, *y = b;
    if (x->lo != y->lo)
        return (x->lo > y->lo) - (x->lo < y->lo);
    if (x->hi != y->hi)
        return (x->hi > y->hi) - (x->hi < y->hi);
    return x->from_hi != y->from_hi ? x->from_hi - y->from_hi : (x->order > y->order) - (x->order < y->order);
}

/* How coarse a side is as a slave: its length, whichever edge a face begins with; twice that where it is quadratic. The
 * pressure of quadratic sides bends within a side, which linear masters cannot follow unless they are much finer, and
 * zigzags: by 18 % on a press fit, where linear slaves have 0.1 % (test_mortar.py). */
static double coarseness(const uz_mortar_side *side, int dim)
{
    const bool triangle = side->nodes % 3 == 0;
    const double length = dim == 2   ? hypot(side->xyz[2] - side->xyz[0], side->xyz[3] - side->xyz[1])
                          : triangle ? sqrt(2 * side->area)
                                     : sqrt(side->area);
    return side->nodes > (dim == 2 ? 2 : triangle ? 3 : 4) ? 2 * length : length;
}

/* Samples of what zones face each other: on some sides of each zone, the lowest first. Returns how many; -1: no memory.
 */
static int64_t take_samples(sample **out, uz_mortar_pair *pair, const int64_t *zone, int64_t n_zones)
{
    const uz_mortar_surface *surface = &pair->surface;
    const int dim = pair->in->model->mesh.dim;
    int64_t n = 0, room = 0;
    uz_entries all = {.n = 0};
    uz_csc of_zone = {0}; /* by columns: the sides of each */
    for (int64_t i = 0; i < surface->n; i++)
        uz_entries_add(&all, i, zone[i], 0);
    bool good = uz_csc_from_entries(&of_zone, surface->n, n_zones, &all, NULL) == UZ_OK;
    const int64_t *start = of_zone.ptr;
    const int32_t *list = of_zone.idx;
    for (int64_t z = 0; z < n_zones && good; z++) {
        if (n_zones == 2 && z == 1 && n > 0)
            break; /* the other one has told */
        for (int64_t k = start[z]; k < start[z + 1] && good; k += 1 + (start[z + 1] - start[z]) / LOOKED_AT) {
            good = uz_mortar_find_points(pair, list[k]) && uz_grow(out, n, pair->points.n, &room, sizeof **out);
            for (int64_t g = 0; g < pair->points.n && good; g++) {
                const uz_mortar_point *p = &pair->points.point[g];
                const int64_t other = zone[p->master];
                const bool from_hi = z > other;
                if (z == other)
                    continue;
                sample *s = &(*out)[n];
                *s = (sample){from_hi ? other : z, from_hi ? z : other, n, from_hi, p->gap, {0}};
                s->fine[from_hi] = p->weight / coarseness(&surface->side[list[k]], dim);
                s->fine[!from_hi] = p->weight / coarseness(&surface->side[p->master], dim);
                n++;
            }
        }
    }
    uz_csc_clear(&of_zone);
    return good ? n : -1;
}

/* The finer of two zones where they face each other is the slave, unless it alone is bound. Looked at only where the
 * two are hardly farther from each other than at their nearest: what is farther away touches late or never, however
 * fine it is. */
static bool rank_zones(uz_contact_sites *sites, const bool *bound, uz_mortar_pair *pair, int64_t n_zones)
{
    sample *s = NULL;
    const int64_t n = take_samples(&s, pair, sites->zone, n_zones);
    const double reach = UZ_CANDIDATES_REACH * uz_mesh_size(&pair->in->model->mesh);
    int64_t pairs = 0;
    if (n > 0)
        qsort(s, (size_t)n, sizeof *s, by_zones);
    for (int64_t k = 0; k < n; k++)
        pairs += k == 0 || s[k].lo != s[k - 1].lo || s[k].hi != s[k - 1].hi;
    sites->rank = n >= 0 ? uz_alloc(2 * pairs, sizeof *sites->rank) : NULL;
    for (int64_t first = 0, end; first < n && sites->rank; first = end) {
        double fine[2] = {0, 0}, least = INFINITY;
        const bool from_hi = s[first].from_hi; /* those seen from the lower zone, if there are any */
        for (end = first; end < n && s[end].lo == s[first].lo && s[end].hi == s[first].hi; end++)
            least = s[end].from_hi == from_hi ? fmin(least, s[end].gap) : least;
        const double most = fmax(least, 0) + reach;
        for (int64_t k = first; k < end; k++)
            for (int j = 0; j < 2 && s[k].from_hi == from_hi && s[k].gap <= most; j++)
                fine[j] += s[k].fine[j];
        const bool lo_bound = bound[s[first].lo], hi_bound = bound[s[first].hi];
        const bool hi = lo_bound != hi_bound ? lo_bound : fine[1] > (1 + ALIKE) * fine[0];
        sites->rank[2 * sites->n_ranks] = hi ? s[first].hi : s[first].lo;
        sites->rank[2 * sites->n_ranks++ + 1] = hi ? s[first].lo : s[first].hi;
    }
    if (sites->rank)
        qsort(sites->rank, (size_t)sites->n_ranks, 2 * sizeof *sites->rank, uz_ascending_pairs);
    free(s);
    return sites->rank != NULL;
}

bool uz_mortar_is_slave(const uz_contact_sites *sites, int64_t i, int64_t j)
{
    const int64_t way[2] = {sites->zone[i], sites->zone[j]}, back[2] = {way[1], way[0]};
    if (way[0] == way[1])
        return i < j;
    const size_t n = (size_t)sites->n_ranks, size = 2 * sizeof *sites->rank;
    if (bsearch(way, sites->rank, n, size, uz_ascending_pairs))
        return true;
    return way[0] < way[1] &&
           !bsearch(back, sites->rank, n, size, uz_ascending_pairs); /* two that did not face each other before */
}

/* ---- zones that face themselves */

/* A growing list of pairs of numbers. */
typedef struct {
    int64_t n, room, (*pair)[2];
} pair_list;

static bool add_two(pair_list *list, int64_t a, int64_t b)
{
    if (!uz_grow(&list->pair, list->n, 1, &list->room, sizeof *list->pair))
        return false;
    list->pair[list->n][0] = a;
    list->pair[list->n++][1] = b;
    return true;
}

/* Where the pairs that begin with a number begin. */
static int64_t first_of(const pair_list *list, int64_t number)
{
    int64_t lo = 0, hi = list->n;
    while (lo < hi) {
        const int64_t middle = lo + (hi - lo) / 2;
        if (list->pair[middle][0] < number)
            lo = middle + 1;
        else
            hi = middle;
    }
    return lo;
}

/* Two halves of each zone that faces itself, as the inside of a ring does: from one side and those across fronts go on
 * along the surface, ring by ring, until they meet. half: 0 where a side does not face its own zone, else 1 or 2;
 * across: pairs of sides; sides: pairs of place and side; queue: room for all sides. */
static void divide(unsigned char *half, const uz_mortar_surface *surface, const pair_list *across,
                   const pair_list *sides, int64_t *queue)
{
    for (int64_t k = 0; k < across->n; k++) {
        int64_t n = 0;
        if (half[across->pair[k][0]])
            continue;
        half[across->pair[k][0]] = 1;
        queue[n++] = across->pair[k][0];
        for (int64_t next = 0; next < n; next++) {
            const int64_t i = queue[next];
            for (int64_t q = first_of(across, i); q < across->n && across->pair[q][0] == i; q++) {
                const int64_t j = across->pair[q][1];
                if (half[j])
                    continue;
                half[j] = (unsigned char)(3 - half[i]);
                queue[n++] = j;
            }
            for (int a = 0; a < surface->side[i].nodes; a++) {
                const int64_t place = surface->side[i].place[a];
                for (int64_t q = first_of(sides, place); q < sides->n && sides->pair[q][0] == place; q++) {
                    const int64_t j = sides->pair[q][1];
                    if (half[j])
                        continue;
                    half[j] = half[i];
                    queue[n++] = j;
                }
            }
        }
    }
}

/* Divides the zones of both surfaces that face themselves; *n_zones grows. */
static bool divide_zones(int64_t *zone, int64_t *n_zones, uz_mortar_pair *pair)
{
    const uz_mortar_surface *surface = &pair->surface;
    pair_list across = {0}, sides = {0};
    unsigned char *half = NULL;
    int64_t *queue = NULL, *second = NULL;
    bool good = true;
    for (int64_t i = 0; i < surface->n && good; i++) {
        int64_t last = -1;
        bool itself = false;
        if (pair->of[i] != (UZ_OF_ON | UZ_OF_WITH))
            continue;
        good = uz_mortar_find_points(pair, i);
        for (int64_t g = 0; g < pair->points.n && good; g++) {
            const int64_t j = pair->points.point[g].master;
            if (j == last || zone[j] != zone[i])
                continue;
            itself = true;
            good = add_two(&across, i, last = j) && add_two(&across, j, i);
        }
        for (int a = 0; a < surface->side[i].nodes && itself && good; a++)
            good = add_two(&sides, surface->side[i].place[a], i);
    }
    if (good && across.n > 0) {
        half = uz_alloc_zero(surface->n, 1);
        queue = uz_alloc(surface->n, sizeof *queue);
        second = uz_alloc_zero(*n_zones, sizeof *second);
        good = half && queue && second;
        qsort(across.pair, (size_t)across.n, sizeof *across.pair, uz_ascending_pairs);
        qsort(sides.pair, (size_t)sides.n, sizeof *sides.pair, uz_ascending_pairs);
    }
    if (good && across.n > 0)
        divide(half, surface, &across, &sides, queue);
    for (int64_t i = 0; i < surface->n && good && half; i++)
        if (half[i] == 2) {
            second[zone[i]] = second[zone[i]] ? second[zone[i]] : (*n_zones)++;
            zone[i] = second[zone[i]];
        }
    uz_free_all(across.pair, sides.pair, half, queue, second);
    return good;
}

uz_status uz_mortar_choose_slaves(uz_contact_sites *sites, uz_mortar_pair *pair, uz_error *err)
{
    const int64_t n = pair->surface.n;
    const uz_contact_sites *before = pair->in->rest ? &pair->in->rest->sites[pair->in->index] : NULL;
    sites->zone = uz_alloc(n, sizeof *sites->zone);
    if (!sites->zone)
        return uz_no_memory(err, UZ_OF_SURFACES);
    sites->n_sides = n;
    if (!before) {
        pair->rough = true;
        int64_t n_zones = number_zones(sites->zone, pair);
        bool good = n_zones >= 0 && divide_zones(sites->zone, &n_zones, pair);
        bool *bound = good ? uz_alloc(n_zones, sizeof *bound) : NULL;
        good = bound && order_zones(sites->zone, bound, n_zones, pair) && rank_zones(sites, bound, pair, n_zones);
        free(bound);
        sites->n_zones = n_zones;
        pair->rough = false;
        return good ? UZ_OK : uz_no_memory(err, UZ_OF_SURFACES);
    }
    sites->rank = uz_alloc(2 * before->n_ranks, sizeof *sites->rank);
    if (!sites->rank)
        return uz_no_memory(err, UZ_OF_SURFACES);
    memcpy(sites->zone, before->zone, (size_t)n * sizeof *sites->zone);
    memcpy(sites->rank, before->rank, (size_t)(2 * before->n_ranks) * sizeof *sites->rank);
    sites->n_ranks = before->n_ranks;
    sites->n_zones = before->n_zones;
    return UZ_OK;
}
