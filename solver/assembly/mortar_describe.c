/* mortar_describe.c: what the surfaces of a contact are taken for, in words and numbers for whoever asked. */
#include "assembly/mortar.h"

#include "core/alloc.h"
#include "core/vector3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define DEGREES (180 / 3.14159265358979323846)

/* Sides that turn by more than this are hardly meant for a curve. */
#define MOST_OF_A_CURVE 60.5

/* Degrees that rounding makes of no turn at all. */
#define NO_TURN 1e-4

void uz_mortar_find_parts(int64_t *part, const uz_mortar_surface *surface)
{
    for (int64_t p = 0; p < surface->n_places; p++)
        part[p] = p;
    for (int64_t i = 0; i < surface->n; i++)
        for (int a = 1; a < surface->side[i].nodes; a++)
            part[uz_join_root(part, surface->side[i].place[a])] = uz_join_root(part, surface->side[i].place[0]);
    for (int64_t p = 0; p < surface->n_places; p++)
        part[p] = uz_join_root(part, p);
}

static double degrees_between(const double *a, const double *b, int dim)
{
    double dot = 0;
    for (int c = 0; c < dim; c++)
        dot += a[c] * b[c];
    return DEGREES * acos(fmin(fmax(dot, -1), 1));
}

/* Nodes amid a run of facets that turn by more than the feature angle at all their corners, and whose neighbours do: a
 * chamfer's do not. strip: n_places. */
static void find_corners(uz_contact_surface *out, const uz_mortar_surface *surface, const uz_contact_input *in,
                         unsigned char *bent)
{
    enum { BENT = 1, STRIP = 2 };
    const int dim = in->model->mesh.dim;
    const double least = DEGREES * acos(uz_mortar_least_cosine(in));
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = 0; i < surface->n && pass == 1; i++) {
            const uz_mortar_side *side = &surface->side[i];
            const int corners = dim == 2 ? 2 : side->nodes % 3 == 0 ? 3 : 4;
            int all = BENT;
            for (int a = 0; a < corners; a++)
                all &= bent[side->place[a]];
            for (int a = 0; a < corners && all; a++)
                bent[side->place[a]] |= STRIP;
        }
        for (int64_t p = 0, last = -1; p < surface->n_places; p++)
            for (int64_t q = p - 1; q >= 0 && surface->node[q] == surface->node[p]; q--) {
                const double turn = degrees_between(surface->normal + dim * p, surface->normal + dim * q, dim);
                if (turn <= least || turn > MOST_OF_A_CURVE)
                    continue;
                if (pass == 0) {
                    bent[p] = bent[q] = BENT;
                } else if (bent[p] & bent[q] & STRIP) {
                    out->corners += last != surface->node[p];
                    last = surface->node[p];
                    out->corner_turn = fmax(out->corner_turn, turn);
                }
            }
    }
}

bool uz_mortar_describe(uz_contact_surface *out, const uz_mortar_surface *surface, const uz_contact_input *in,
                        const uz_group *group)
{
    static const char *const WORD[] = {
        [UZ_SMOOTH_PLANE] = "plane", [UZ_SMOOTH_SPHERE] = "sphere", [UZ_SMOOTH_CYLINDER] = "cylinder",
        [UZ_SMOOTH_CONE] = "cone",   [UZ_SMOOTH_TORUS] = "torus",
    };
    const int64_t n = surface->n_places;
    const int dim = in->model->mesh.dim;
    const uz_mortar_geometry *geometry = uz_mortar_geometry_of(dim);
    int64_t *part = uz_alloc(n, sizeof *part), largest = 0;
    double *area = uz_alloc_zero(n, sizeof *area);
    unsigned char *bent = uz_alloc_zero(n, 1);
    const bool room = part && area && bent;
    *out = (uz_contact_surface){.dim = 0};
    if (!room)
        goto done;
    snprintf(out->group, sizeof out->group, "%s", group->name);
    uz_mortar_find_parts(part, surface);
    for (int64_t i = 0; i < surface->n; i++) {
        const uz_mortar_side *side = &surface->side[i];
        const uz_side shape = uz_mortar_side_of(side, in->model);
        double *own = &area[part[side->place[0]]];
        *own += side->area;
        largest = *own > area[part[surface->side[largest].place[0]]] ? i : largest;
        out->free_form = out->free_form || (dim == 3 && side->shape.kind == UZ_SMOOTH_NONE);
        for (int a = 0; a < side->nodes && !in->contact->faceted; a++) /* half-way between its nodes */
            for (int b = 0; b < a; b++) {
                double local[2] = {0}, N[UZ_FACE_NODES], x[3] = {0}, off[3];
                for (int c = 0; c + 1 < dim; c++)
                    local[c] = 0.5 * (uz_side_local_nodes(&shape)[a][c] + uz_side_local_nodes(&shape)[b][c]);
                uz_side_shape(N, &shape, local);
                for (int k = 0; k < dim * side->nodes; k++)
                    x[k % dim] += N[k / dim] * side->xyz[k];
                geometry->offset(off, surface, side, local, x);
                out->largest_offset = fmax(out->largest_offset, sqrt(uz_dot3(off, off)));
            }
        for (int a = 0; a < side->nodes; a++) { /* half of the turn is on either side of the node's normal */
            double normal[3] = {0};
            uz_side_area_vector(normal, &shape, uz_side_local_nodes(&shape)[a]);
            if (uz_unit3(normal) > 0)
                out->largest_turn =
                    fmax(out->largest_turn, 2 * degrees_between(normal, surface->normal + dim * side->place[a], dim));
        }
    }
    out->free_form = out->free_form && out->largest_turn > NO_TURN && !in->contact->faceted;
    for (int64_t p = 0; p < n; p++)
        out->parts += area[p] > 0; /* by the place that stands for all of them */
    find_corners(out, surface, in, bent);
    const uz_mortar_side *side = &surface->side[largest];
    const uz_smooth_shape *shape = &side->shape;
    const char *word = dim == 2            ? (out->largest_turn > NO_TURN ? "curve" : "straight")
                       : WORD[shape->kind] ? WORD[shape->kind]
                       : side->fitted      ? "free_form"
                       : side->nodes > 4   ? "quadratic"
                                           : "facets";
    snprintf(out->shape, sizeof out->shape, "%s", in->contact->faceted ? "facets" : word);
    if (dim == 3 && shape->kind != UZ_SMOOTH_NONE) {
        out->dim = 3;
        for (int c = 0; c < 3; c++) {
            out->point[c] = shape->point[c];
            out->axis[c] = shape->axis[c];
        }
        out->radius = shape->radius;
        out->tube = shape->tube;
        out->slope = shape->slope;
    }
done:
    uz_free_all(part, area, bent);
    return room;
}
