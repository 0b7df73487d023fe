/* hinges.c: pieces of a body that share too few nodes with the rest of it to stay in place.
 *
 * Elements that share a side are one piece. A node that two pieces share is a joint about which either can turn, two of
 * them in space are a hinge. A piece moves freely where its supports and springs, with all of its joints held fast,
 * leave it a rigid motion. That is looked for once K has turned out to be singular: it takes all sides of the mesh.
 * Chains of pieces, each of which the next would hold, are not found. */
#include "assembly/parts.h"

#include "assembly/body_parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "element/element_type.h"
#include "scene/mesh_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uz_mesh *mesh;
    int64_t *first, *around; /* elements around each node */
    int64_t *piece;          /* of each element */
    int64_t *shared;         /* n_elements, zero: corners shared with the element at hand */
    int64_t count;
    uz_parts parts; /* the pieces by number, and behind them the joints */
} pieces;

static int64_t corners_of(const uz_mesh *mesh, int64_t e)
{
    return uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
}

/* Elements with as many common corners as a side has at least, two in the plane and three in space. */
static void join_by_sides(pieces *x)
{
    const uz_mesh *mesh = x->mesh;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        x->piece[e] = e;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int pass = 0; pass < 2; pass++) /* counts, then clears */
            for (int64_t i = mesh->first[e]; i < mesh->first[e] + corners_of(mesh, e); i++)
                for (int64_t q = x->first[mesh->node[i]]; q < x->first[mesh->node[i] + 1] && x->around[q] < e; q++) {
                    const int64_t other = x->around[q];
                    x->shared[other] = pass == 0 ? x->shared[other] + 1 : 0;
                    if (x->shared[other] == mesh->dim)
                        uz_join(x->piece, e, other);
                }
    for (int64_t e = 0; e < mesh->n_elements; e++) /* those before have their numbers already */
        x->piece[e] = x->piece[e] == e ? x->count++ : x->piece[x->piece[e]];
}

/* Of each node: its piece; `count` where it is a joint. */
static void find_joints(pieces *x)
{
    for (int64_t a = 0; a < x->mesh->n_nodes; a++) {
        const int64_t own = x->piece[x->around[x->first[a]]];
        x->parts.of[a] = own;
        for (int64_t q = x->first[a]; q < x->first[a + 1]; q++)
            if (x->piece[x->around[q]] != own)
                x->parts.of[a] = x->count;
    }
}

/* Where the pieces reach to; holds: where they are held, once it is known how large all of them are. */
static void visit_joints(pieces *x, bool holds)
{
    static const double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const uz_mesh *mesh = x->mesh;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (int64_t q = x->first[a]; q < x->first[a + 1] && x->parts.of[a] == x->count; q++) {
            uz_part *p = &x->parts.list[x->piece[x->around[q]]];
            if (!holds)
                uz_part_reach(p, mesh, a);
            for (int c = 0; c < mesh->dim && holds; c++)
                uz_hold_part_at(&x->parts, p, mesh->xyz + a * mesh->dim, axis[c]);
        }
}

/* " node 2 at (1, 1)", the joints of a piece, the first of which are told. Returns how many. */
static int name_joints(char *text, size_t size, const pieces *x, int64_t i)
{
    const uz_mesh *mesh = x->mesh;
    int n = 0;
    text[0] = '\0';
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        bool own = false;
        for (int64_t q = x->first[a]; q < x->first[a + 1] && x->parts.of[a] == x->count; q++)
            own = own || x->piece[x->around[q]] == i;
        if (!own || ++n > 3)
            continue;
        const double *at = mesh->xyz + a * mesh->dim;
        const size_t used = strlen(text);
        const int length = snprintf(text + used, size - used, "%s node %lld at (%.6g, %.6g", n > 1 ? "," : "",
                                    (long long)a, at[0], at[1]);
        const size_t more = used + (size_t)length < size ? used + (size_t)length : size - 1;
        if (mesh->dim == 3)
            snprintf(text + more, size - more, ", %.6g)", at[2]);
        else
            snprintf(text + more, size - more, ")");
    }
    return n;
}

/* " (group upper)": groups that are within a piece, the first of them. */
static void name_groups(char *text, size_t size, const pieces *x, int64_t i)
{
    int n = 0;
    text[0] = '\0';
    for (int64_t g = 0; g < x->mesh->n_groups && n < 3; g++) {
        const uz_group *group = &x->mesh->groups[g];
        bool within = !group->everything && group->n_nodes > 0, own = false;
        for (int64_t k = 0; k < group->n_nodes && within; k++) {
            const int64_t of = x->parts.of[group->node[k]];
            within = of == i || of == x->count;
            own = own || of == i;
        }
        if (!within || !own)
            continue;
        const size_t used = strlen(text);
        snprintf(text + used, size - used, "%s%s", n++ > 0 ? ", " : " (of ", group->name);
    }
    const size_t used = strlen(text);
    if (n > 0)
        snprintf(text + used, size - used, ")");
}

static uz_status refuse(const pieces *x, uz_error *err)
{
    char motions[300] = "", name[160], groups[220], joints[200];
    double mode[UZ_MOTIONS][UZ_MOTIONS];
    for (int64_t i = 0; i < x->count; i++) {
        const uz_part *p = &x->parts.list[i];
        if (p->rank == x->parts.motions)
            continue;
        const int n = uz_free_motions(mode, &x->parts, p), shared = name_joints(joints, sizeof joints, x, i);
        if (shared == 0) /* it is a part of its own, whose motions obstacles may have held */
            continue;
        name_groups(groups, sizeof groups, x, i);
        const bool every = shared == 1 && n == 3; /* in space */
        if (every)
            snprintf(motions, sizeof motions, "every rotation about it");
        for (int k = 0; k < n && !every; k++) {
            const size_t used = strlen(motions);
            uz_name_part_motion(name, sizeof name, &x->parts, p, mode[k], false);
            snprintf(motions + used, sizeof motions - used, "%s%s", k ? ", " : "", name);
        }
        return uz_fail(err, UZ_ERR_FREE_BODY, "/mesh",
                       "the piece with node %lld%s hangs on the rest of the body by%s%s alone, which leaves %s free; "
                       "let them share all nodes of a side, or hold the piece by further supports or springs",
                       (long long)p->node, groups, joints, shared > 3 ? " and others on a line" : "", motions);
    }
    return UZ_OK;
}

uz_status uz_check_hinges(const uz_body_model *model, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    if (mesh->uniform || mesh->hangs || model->n_rigid > 0 || model->tied.share.ptr)
        return UZ_OK;
    pieces x = {.mesh = mesh};
    uz_parts_begin(&x.parts, model);
    x.first = uz_alloc(mesh->n_nodes + 1, sizeof *x.first);
    x.around = uz_alloc(mesh->first[mesh->n_elements], sizeof *x.around);
    x.piece = uz_alloc(mesh->n_elements, sizeof *x.piece);
    x.shared = uz_alloc_zero(mesh->n_elements, sizeof *x.shared);
    x.parts.of = uz_alloc(mesh->n_nodes, sizeof *x.parts.of);
    uz_status status =
        x.first && x.around && x.piece && x.shared && x.parts.of ? UZ_OK : uz_no_memory(err, "the pieces of a body");
    if (status == UZ_OK) {
        uz_mesh_list_around(x.first, x.around, mesh);
        join_by_sides(&x);
        find_joints(&x);
        x.parts.count = x.count + 1;
        status = uz_list_parts(&x.parts, mesh, err);
    }
    if (status == UZ_OK) {
        for (int64_t e = mesh->n_elements - 1; e >= 0; e--) /* of all joints, as long as it has no other node */
            if (x.parts.list[x.piece[e]].high[0] < x.parts.list[x.piece[e]].low[0])
                x.parts.list[x.piece[e]].node = mesh->node[mesh->first[e]];
        visit_joints(&x, false);
        uz_hold_by_supports(&x.parts, model);
        visit_joints(&x, true);
        status = refuse(&x, err);
    }
    uz_parts_clear(&x.parts);
    uz_free_all(x.first, x.around, x.piece, x.shared);
    return status;
}
