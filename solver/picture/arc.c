#include "picture/arc.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>

/* By node, of the contact at hand. */
typedef struct {
    const uz_body_model *model;
    const uz_group *group;
    int64_t *next; /* 1 + place in the group of the side that begins here; 0: none that is still to be walked */
    bool *follows; /* a side ends here */
    double *at;    /* NaN: not reached */
    unsigned *part;
    double length; /* walked so far */
    unsigned parts;
} arc_walk;

static double distance(const uz_mesh *mesh, int64_t a, int64_t b)
{
    return hypot(mesh->xyz[2 * b] - mesh->xyz[2 * a], mesh->xyz[2 * b + 1] - mesh->xyz[2 * a + 1]);
}

static void reach(arc_walk *w, int64_t node)
{
    if (!isnan(w->at[node])) /* where a ring closes */
        return;
    w->at[node] = w->length;
    w->part[node] = w->parts;
}

static void walk_from(arc_walk *w, int64_t node)
{
    const uz_mesh *mesh = &w->model->mesh;
    int64_t on[UZ_FACE_NODES];
    reach(w, node);
    while (w->next[node] > 0) {
        const int count = uz_mesh_face(on, mesh, w->group->face[w->next[node] - 1]);
        w->next[node] = 0;
        if (count == 3) {
            w->length += distance(mesh, node, on[2]);
            reach(w, on[2]);
        }
        w->length += distance(mesh, count == 3 ? on[2] : node, on[1]);
        node = on[1];
        reach(w, node);
    }
    w->parts++;
}

uz_status uz_contact_arc(double *arc, unsigned *part, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes, m = model->m, *contact = model->info.contact_of;
    int64_t on[UZ_FACE_NODES];
    arc_walk w = {.model = model,
                  .next = uz_alloc(n, sizeof *w.next),
                  .follows = uz_alloc(n, sizeof *w.follows),
                  .at = uz_alloc(n, sizeof *w.at),
                  .part = uz_alloc(n, sizeof *w.part)};
    const bool room = w.next && w.follows && w.at && w.part;
    for (int64_t first = 0, last; room && first < m; first = last) {
        for (last = first; last < m && contact[last] == contact[first];)
            last++;
        for (int64_t i = 0; i < w.model->mesh.n_nodes; i++) {
            w.next[i] = 0;
            w.follows[i] = false;
            w.at[i] = NAN;
        }
        w.length = 0;
        w.parts = 0;
        w.group = uz_mesh_group(&model->mesh, scene->contacts[contact[first]].on, "", NULL);
        const int64_t n_faces = w.group ? w.group->n_faces : 0;
        for (int64_t f = 0; f < n_faces; f++) {
            uz_mesh_face(on, &model->mesh, w.group->face[f]);
            w.next[on[0]] = f + 1;
            w.follows[on[1]] = true;
        }
        /* Ends first, then what is left: rings. */
        for (int rings = 0; rings < 2; rings++)
            for (int64_t f = 0; f < n_faces; f++) {
                uz_mesh_face(on, &model->mesh, w.group->face[f]);
                if (w.next[on[0]] > 0 && (rings || !w.follows[on[0]]))
                    walk_from(&w, on[0]);
            }
        /* Rows [first, last) are those of one contact. */
        for (int64_t i = first; i < last; i++) {
            const uz_inner_place *inner = uz_row_inner(model, i);
            const int64_t node = inner ? inner->node[0] : w.model->info.contact_node[i];
            const bool reached = !isnan(w.at[node]);
            arc[i] = reached ? w.at[node] : w.length;
            if (inner && reached) /* on its way from the first corner to the second */
                arc[i] += inner->linear[1] * distance(&model->mesh, node, inner->node[1]);
            part[i] = reached ? w.part[node] : w.parts;
        }
    }
    uz_free_all(w.next, w.follows, w.at, w.part);
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the sides of %lld contacts", (long long)m);
}
