#include "scene/refinement.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/corner_table.h"

#include <stdlib.h>
#include <string.h>

bool uz_refinement_begin(uz_refinement *x, uz_mesh *mesh)
{
    x->mesh = mesh;
    x->dim = mesh->dim;
    x->nodes = mesh->n_nodes;
    x->room_xyz = mesh->n_nodes * x->dim;
    x->room_first = 1;
    x->xyz = uz_alloc(mesh->n_nodes * x->dim, sizeof *x->xyz);
    x->from_first = uz_alloc_zero(1, sizeof *x->from_first);
    x->failed = !x->xyz || !x->from_first;
    if (x->xyz)
        memcpy(x->xyz, mesh->xyz, (size_t)(mesh->n_nodes * x->dim) * sizeof *x->xyz);
    return !x->failed;
}

uz_status uz_refinement_end(uz_refinement *x, bool listed, uz_error *err)
{
    const long long elements = x->mesh->n_elements;
    uz_status status = UZ_OK;
    if (!listed)
        status = uz_fail(err, UZ_ERR_ARGUMENT, "/mesh/refine",
                         "a list of elements to be bisected names one that is not there");
    else if (x->too_many)
        status =
            uz_fail(err, UZ_ERR_LIMIT, "/mesh/refine", "a refined mesh has more than %d unknowns", UZ_SCENE_MAX_DOFS);
    if (x->failed)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to refine a mesh of %lld elements", elements);
    uz_free_all(x->links, x->users, x->xyz, x->from_first, x->from, x->from_share, x->table);
    return status;
}

/* ---- nodes and links */

static bool make_room(uz_refinement *x, int count)
{
    const int64_t added = x->nodes - x->mesh->n_nodes;
    return uz_grow(&x->xyz, x->nodes * x->dim, x->dim, &x->room_xyz, sizeof *x->xyz) &&
           uz_grow(&x->from_first, added + 1, 1, &x->room_first, sizeof *x->from_first) &&
           uz_grow(&x->from, x->n_from, count, &x->room_from, sizeof *x->from) &&
           uz_grow(&x->from_share, x->n_from, count, &x->room_share, sizeof *x->from_share);
}

int64_t uz_refinement_node(uz_refinement *x, const int64_t *from, const double *share, int count)
{
    if (x->nodes >= UZ_SCENE_MAX_DOFS / x->dim)
        x->too_many = true;
    x->failed = x->failed || (!x->too_many && !make_room(x, count));
    if (x->too_many || x->failed)
        return 0;
    for (int c = 0; c < x->dim; c++) {
        double sum = 0;
        for (int k = 0; k < count; k++)
            sum += share[k] * x->xyz[from[k] * x->dim + c];
        x->xyz[x->nodes * x->dim + c] = sum;
    }
    memcpy(x->from + x->n_from, from, (size_t)count * sizeof *from);
    memcpy(x->from_share + x->n_from, share, (size_t)count * sizeof *share);
    x->n_from += count;
    x->from_first[x->nodes - x->mesh->n_nodes + 1] = x->n_from;
    return x->nodes++;
}

/* Of the mixer of Steele, Lea and Flood, OOPSLA 2014. */
static uint64_t hash_of(const int64_t node[UZ_LINK_NODES])
{
    uint64_t z = 0;
    for (int k = 0; k < UZ_LINK_NODES; k++) {
        z = (z + (uint64_t)node[k]) * 0x9e3779b97f4a7c15u;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
        z = (z ^ z >> 27) * 0x94d049bb133111ebu;
        z ^= z >> 31;
    }
    return z;
}

static bool make_slots(uz_refinement *x)
{
    const int64_t slots = x->slots > 0 ? 2 * x->slots : 1024;
    int64_t *table = uz_alloc_zero(slots, sizeof *table);
    for (int64_t i = 0; table && i < x->n_links; i++) {
        uint64_t at = hash_of(x->links[i].node);
        while (table[at & (uint64_t)(slots - 1)])
            at++;
        table[at & (uint64_t)(slots - 1)] = i + 1;
    }
    if (!table)
        return false;
    free(x->table);
    x->table = table;
    x->slots = slots;
    return true;
}

int64_t uz_refinement_link(uz_refinement *x, const int64_t *corner, int corners)
{
    uz_link new = {{-1, -1, -1, -1}, -1, -1, -1, false};
    for (int i = 0; i < corners; i++) {
        int j = i;
        for (; j > 0 && new.node[j - 1] > corner[i]; j--)
            new.node[j] = new.node[j - 1];
        new.node[j] = corner[i];
    }
    if (2 * (x->n_links + 1) > x->slots && !make_slots(x)) {
        x->failed = true;
        return 0;
    }
    for (uint64_t at = hash_of(new.node);; at++) {
        int64_t *slot = &x->table[at & (uint64_t)(x->slots - 1)];
        if (*slot && memcmp(x->links[*slot - 1].node, new.node, sizeof new.node) == 0)
            return *slot - 1;
        if (*slot)
            continue;
        if (!uz_grow(&x->links, x->n_links, 1, &x->room_links, sizeof *x->links)) {
            x->failed = true;
            return 0;
        }
        x->links[x->n_links] = new;
        *slot = ++x->n_links;
        return x->n_links - 1;
    }
}

void uz_refinement_use(uz_refinement *x, int64_t link, int64_t element)
{
    if (x->failed || !uz_grow(&x->users, x->n_users, 1, &x->room_users, sizeof *x->users)) {
        x->failed = true;
        return;
    }
    x->users[x->n_users] = (uz_link_user){element, x->links[link].users};
    x->links[link].users = x->n_users++;
}

/* ---- groups */

/* The refined mesh and where its elements come from. */
typedef struct {
    const uz_refinement *x;
    const uz_mesh *fine;
    const int64_t *root;
    const signed char *side;
    unsigned char *outer_sides; /* by element that was given: bits of its sides that no other has */
    unsigned char *outer;       /* nodes of the boundary */
    unsigned char *has;         /* by element that was given: room for a byte */
} heirs;

static bool is_part_of(const heirs *h, const unsigned char *sides, int64_t e, int s)
{
    const signed char of = h->side[e * UZ_ELEMENT_SIDES + s];
    return of >= 0 && sides[h->root[e]] >> of & 1;
}

/* What the parts of the given elements take over from a group of their sides, or of themselves. in: nodes of these are
 * marked. */
static bool refine_items(uz_group *out, const heirs *h, const uz_group *group, unsigned char *in)
{
    int64_t room_faces = 0, room_elements = 0;
    memset(h->has, 0, (size_t)h->x->mesh->n_elements);
    for (int64_t i = 0; i < group->n_faces; i++)
        h->has[group->face[i].element] |= (unsigned char)(1 << group->face[i].side);
    for (int64_t i = 0; i < group->n_elements; i++)
        h->has[group->element[i]] = 1;
    for (int64_t e = 0; e < h->fine->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)h->fine->kind[e]);
        const int64_t *node = h->fine->node + h->fine->first[e];
        const bool whole = group->kind == UZ_GROUP_ELEMENTS && h->has[h->root[e]];
        if (whole && !uz_grow(&out->element, out->n_elements, 1, &room_elements, sizeof *out->element))
            return false;
        if (whole)
            out->element[out->n_elements++] = e;
        for (int k = 0; k < type->nodes && whole; k++)
            in[node[k]] = 1;
        for (int s = 0; s < type->sides && group->kind == UZ_GROUP_FACES && h->has[h->root[e]]; s++) {
            if (!is_part_of(h, h->has, e, s))
                continue;
            if (!uz_grow(&out->face, out->n_faces, 1, &room_faces, sizeof *out->face))
                return false;
            out->n_inner += !is_part_of(h, h->outer_sides, e, s);
            out->face[out->n_faces++] = (uz_face){e, s};
            for (int k = 0; k < type->side[s].nodes; k++)
                in[node[type->side[s].node[k]]] = 1;
        }
    }
    return true;
}

/* New nodes that lie amid nodes of a group of nodes join it. An edge or a face through the body from one side to
 * another is none of a group that has whole sides of the boundary: what lies amid it joins only where one of its
 * corners, which come first among what it lies amid, is inside. */
static void join_nodes(unsigned char *in, const heirs *h)
{
    const int64_t old = h->x->mesh->n_nodes;
    bool whole = false;
    for (int pass = 0; pass < 1 + whole; pass++) {
        for (int64_t i = old; i < h->fine->n_nodes; i++) {
            const int64_t first = h->x->from_first[i - old], count = h->x->from_first[i - old + 1] - first;
            const int64_t *from = h->x->from + first;
            const bool linear = h->x->from_share[first] > 0; /* which corners of whole faces and elements are not */
            const int64_t corners = count < 4 || count == 5 ? 2 : count == 20 || (count == 8 && linear) ? 8 : 4;
            bool inside = false;
            for (int64_t k = 0; k < corners; k++)
                inside = inside || !h->outer[from[k]];
            in[i] = pass == 0 || h->outer[i] || inside;
            for (int64_t k = 0; k < count; k++)
                in[i] = in[i] && in[from[k]];
        }
        for (int64_t e = 0; e < h->fine->n_elements && !whole; e++) {
            const uz_element_type *type = uz_element_type_of((uz_element_kind)h->fine->kind[e]);
            for (int s = 0; s < type->sides && !whole; s++) {
                whole = is_part_of(h, h->outer_sides, e, s);
                for (int k = 0; k < type->side[s].nodes && whole; k++)
                    whole = in[h->fine->node[h->fine->first[e] + type->side[s].node[k]]];
            }
        }
    }
}

static bool refine_group(uz_group *group, const heirs *h)
{
    const int64_t n = h->fine->n_nodes;
    unsigned char *in = uz_alloc_zero(n, 1); /* nodes of the group */
    uz_group out = {.kind = group->kind};
    memcpy(out.name, group->name, sizeof out.name);
    bool room = in != NULL;
    for (int64_t i = 0; i < group->n_nodes && room; i++)
        in[group->node[i]] = 1;
    if (room && group->kind != UZ_GROUP_NODES)
        room = refine_items(&out, h, group, in);
    else if (room)
        join_nodes(in, h);
    for (int64_t i = 0; i < n && room; i++)
        out.n_nodes += in[i];
    out.node = room ? uz_alloc(out.n_nodes, sizeof *out.node) : NULL;
    for (int64_t i = 0, k = 0; i < n && out.node; i++)
        if (in[i])
            out.node[k++] = i;
    uz_free_all(in, group->node, group->face, group->element);
    *group = out;
    return out.node != NULL;
}

static bool list_inside(const heirs *h, uz_mesh *fine);

static bool refine_groups(const uz_refinement *x, uz_mesh *fine, const int64_t *root, const signed char *side)
{
    const uz_mesh *mesh = x->mesh;
    heirs h = {.x = x,
               .fine = fine,
               .root = root,
               .side = side,
               .outer_sides = uz_alloc_zero(mesh->n_elements, 1),
               .outer = uz_alloc_zero(fine->n_nodes, 1),
               .has = uz_alloc(mesh->n_elements, 1)};
    uz_corner_table sides = {.count = 0};
    bool room = h.outer_sides && h.outer && h.has && uz_corner_table_build(&sides, mesh, true, NULL) == UZ_OK;
    for (int64_t i = 0; i < sides.count && room; i++) {
        const uz_face one = uz_corner_table_item(&sides, i);
        if (!sides.same[i] && !sides.same[i + 1])
            h.outer_sides[one.element] |= (unsigned char)(1 << one.side);
    }
    uz_corner_table_clear(&sides);
    for (int64_t e = 0; e < fine->n_elements && room; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)fine->kind[e]);
        for (int s = 0; s < type->sides; s++)
            for (int k = 0; k < type->side[s].nodes && is_part_of(&h, h.outer_sides, e, s); k++)
                h.outer[fine->node[fine->first[e] + type->side[s].node[k]]] = 1;
    }
    for (int64_t k = 0; k < mesh->n_groups && room; k++)
        room = mesh->groups[k].everything || refine_group(&mesh->groups[k], &h);
    room = room && (!fine->hangs || list_inside(&h, fine));
    uz_free_all(h.outer_sides, h.outer, h.has);
    return room;
}

/* Of a mesh with hanging nodes, where two elements that meet need not have the same corners there. */
static bool list_inside(const heirs *h, uz_mesh *fine)
{
    fine->inside = uz_alloc_zero(fine->n_elements, 1);
    for (int64_t e = 0; e < fine->n_elements && fine->inside; e++)
        for (int s = 0; s < uz_element_type_of((uz_element_kind)fine->kind[e])->sides; s++)
            fine->inside[e] |= (unsigned char)(is_part_of(h, h->outer_sides, e, s) ? 0 : 1 << s);
    return fine->inside != NULL;
}

void uz_refinement_publish(uz_refinement *x, uz_mesh *fine, const int64_t *root, const signed char *side)
{
    uz_mesh *mesh = x->mesh;
    fine->n_nodes = x->nodes;
    x->failed = x->failed || !refine_groups(x, fine, root, side);
    if (x->failed) {
        uz_free_all(fine->kind, fine->first, fine->node, fine->hangs, fine->part_of, fine->inside);
        return;
    }
    uz_free_all(mesh->xyz, mesh->kind, mesh->first, mesh->node);
    fine->dim = mesh->dim;
    fine->extent = mesh->extent;
    fine->n_unused = mesh->n_unused;
    fine->n_given = mesh->n_nodes;
    fine->groups = mesh->groups;
    fine->n_groups = mesh->n_groups;
    fine->xyz = x->xyz;
    fine->from_first = x->from_first;
    fine->from = x->from;
    fine->from_share = x->from_share;
    x->xyz = x->from_share = NULL;
    x->from_first = x->from = NULL;
    *mesh = *fine;
}
