/* sliding.c: how far the geometry of contacts is off where an answer has moved the surfaces to.
 *
 * An answer that was found with the gaps and normals of the undeformed body says nothing of what they are where the
 * surfaces have come to: over a radius R a gap changes by D^2 / 2 R when the surface slides by D, and the normal by
 * D / R. Both are taken anew there and compared with what the answer assumed. A gap is measured by the approach of
 * what is pressed together (overlap.h): that part of the reactions is wrong. On another body the reactions also act
 * D beside where they should: that is measured by the size of what touches. */
#include "post/balance.h"

#include "assembly/discretization.h"
#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>

/* Where the place of a row is now: nodes of a slave surface may have another number of places, and so may those in the
 * grooves of an obstacle. -1: nowhere. */
static int64_t place_now(const uz_contact_sites *now, const uz_contact_sites *before, int64_t place, int dim)
{
    int64_t low = 0, high = now->n, found = -1;
    if (!before->at) {
        const int64_t nodes = before->n - before->n_inner - before->n_flanks, flank = place - nodes;
        double most = 0;
        if (flank < 0 || flank >= before->n_flanks)
            place += flank < 0 ? 0 : now->n_flanks - before->n_flanks;
        for (int64_t i = 0; i < now->n_flanks && flank >= 0 && flank < before->n_flanks; i++) {
            double along = 0;
            for (int c = 0; c < dim && now->flank[i] == before->flank[flank]; c++)
                along += now->normal[(nodes + i) * dim + c] * before->normal[place * dim + c];
            found = along > most ? nodes + i : found;
            most = fmax(most, along);
        }
        const bool is_flank = flank >= 0 && flank < before->n_flanks;
        return is_flank ? found : place < now->n ? place : -1;
    }
    if (place < now->n && now->at[place] == before->at[place])
        return place;
    while (low < high) {
        const int64_t middle = (low + high) / 2;
        if (now->at[middle] < before->at[place])
            low = middle + 1;
        else
            high = middle;
    }
    return low < now->n && now->at[low] == before->at[place] ? low : -1;
}

/* Means over the reactions, and the deepest overlap. */
typedef struct {
    double force, gap, turn, aside, overlap;
} misfit;

/* The diagonal of the box around the nodes of contact k that are pushed, at least one face of the other body. */
static double size_of_zone(const uz_body_model *model, int64_t k, const double *push)
{
    const int dim = model->mesh.dim;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, square = 0, face = 0;
    for (int64_t i = 0; i < model->m; i++) {
        if (model->info.contact_of[i] != k || !(push[i] < 0))
            continue;
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, model, model->sites[k].face[model->row_place[i]]);
        for (int c = 0; c < dim; c++) {
            const double x = model->mesh.xyz[model->info.contact_node[i] * dim + c];
            low[c] = fmin(low[c], x);
            high[c] = fmax(high[c], x);
            face = fmax(face, fabs(xyz[dim + c] - xyz[c]));
        }
    }
    for (int c = 0; c < dim; c++)
        square += (high[c] - low[c]) * (high[c] - low[c]);
    return fmax(sqrt(square), face);
}

static void add_rows(misfit *to, const uz_body_model *model, const uz_body_model *there, const double *u,
                     const double *push, double approach)
{
    const int dim = model->mesh.dim;
    double zone = 0;
    for (int64_t i = 0; i < model->m; i++) {
        const int64_t k = model->info.contact_of[i];
        if ((i == 0 || k != model->info.contact_of[i - 1]) && model->sites[k].first)
            zone = size_of_zone(model, k, push);
        const uz_contact_sites *before = &model->sites[k], *now = &there->sites[k];
        const double force = fmax(0, -push[i]);
        to->force += force;
        if (force <= 0 || before->n == 0) /* of a plane nothing changes */
            continue;
        const int64_t p = model->row_place[i], q = place_now(now, before, p, dim);
        const bool found = q >= 0 && isfinite(now->gap[q]);
        double chord = 0, along = 0, square = 0;
        for (int c = 0; c < dim && found; c++)
            chord = hypot(chord, now->normal[q * dim + c] - before->normal[p * dim + c]);
        for (int c = 0; c < dim && before->first; c++) { /* how far its node has slid along the other body */
            double v = u[model->info.contact_node[i] * dim + c];
            for (int64_t j = before->first[p]; j < before->first[p + 1]; j++)
                v -= before->weight[j] * u[before->node[j] * dim + c];
            along += v * before->normal[p * dim + c];
            square += v * v;
        }
        to->gap += force * (found ? fabs(now->gap[q]) : approach);
        to->turn += force * 2 * asin(fmin(1, 0.5 * chord));
        to->aside += before->first ? force * sqrt(fmax(0, square - along * along)) / zone : 0;
    }
    for (int64_t k = 0; k < there->n_sites; k++)
        for (int64_t p = 0; p < there->sites[k].n; p++)
            to->overlap = fmax(to->overlap, -there->sites[k].gap[p]);
}

uz_status uz_measure_sliding(double *sliding, const uz_body_model *model, const uz_scene *scene, const double *u,
                             const double *r, double approach, uz_error *err)
{
    uz_scene at = *scene;
    uz_body_model there;
    misfit of = {0};
    bool changes = false;
    *sliding = NAN;
    for (int64_t k = 0; k < model->n_sites; k++)
        changes = changes || model->sites[k].n > 0;
    *sliding = changes ? NAN : 0;
    if (!changes || model->place)
        return UZ_OK;
    at.place = u;
    uz_error refusal = {0};
    uz_status status = uz_body_model_move(&there, model, &at, &refusal);
    if (status == UZ_ERR_MEMORY)
        return uz_fail(err, status, "", "no memory for the place of %lld nodes", (long long)model->mesh.n_nodes);
    if (status != UZ_OK) {
        *sliding = INFINITY; /* no contact can be found there */
        return UZ_OK;
    }
    double *push = uz_alloc(model->m, sizeof *push);
    if (push) {
        uz_row_forces(push, model, r);
        add_rows(&of, model, &there, u, push, approach);
        const double tiny = 1e-9 * model->mesh.extent;
        if (of.force > 0)
            *sliding = fmax(fmax(of.gap / of.force, of.overlap) / approach, fmax(of.turn, of.aside) / of.force);
        else /* nothing touches: does it there? */
            *sliding = of.overlap > tiny ? (double)INFINITY : 0;
    }
    free(push);
    uz_body_model_clear(&there);
    return push ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)model->m);
}
