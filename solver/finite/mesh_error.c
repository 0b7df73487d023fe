/* mesh_error.c: Zienkiewicz and Zhu's comparison (assembly/error_estimate.c) in strains that know no rotation.
 *
 * The strain E of Green and Lagrange jumps from element to element; averaged at the nodes it is closer to the true one.
 * With the moduli D = dS/dE of the law where the body is,
 *     eta^2 = integral of (E* - E_h)' D (E* - E_h) over the volume at rest
 * estimates the square of the error in the energy norm of the tangent, but for what the stress does to turning parts,
 * and 2 W stands for the square of the norm of u, which it is of small strain. Of quantities it is the inner product of
 * that with the same of another displacement z, in the derivative of E along it. */
#include "finite/mesh_error.h"

#include "assembly/nodal_strains.h"
#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "finite/finite_body.h"
#include "finite/finite_element.h"
#include "finite/hyperelastic.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_STRAINS = UZ_FINITE_STRAINS };
/* Of smaller strains W is half of S : E, to this part of it, and its own terms cancel. */
#define SMALL 1e-4
/* F is about 1, and known to its last digits. */
#define ROUNDING 1e-13
/* Steps to the strain that is free of stress in the plane. */
enum { MOST_STEPS = 20 };
/* A way for differences, as a part of the body. */
#define STEP 1e-6

typedef struct {
    const uz_body_model *model;
    uz_nodal_strains nodal;
    double energy, eta2, unit; /* unit: integral of the moduli, twice the energy of a strain of 1 */
    bool failed;               /* a point has no energy */
    /* What is compared: own E(u), and, `to` not NULL, half of what E(to[0]) - E(to[1]) is, by the step. Then the nodes
     * have means of that. moved: room for both */
    double own, step, *eta2_of; /* step: of z in to[0]; eta2_of: n_elements; NULL: not wanted */
    const uz_strain_source *to;
    uz_strain_group *moved;
    bool whole; /* with what is hidden */
} comparison;

static void make_rule(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation)
{
    uz_energy_rule(rule, kind, ((const comparison *)ctx)->model->kind, formulation);
}

/* Of what expands freely by w the strain that makes stress is that of the larger body: (E - thermal) / (1 + w)^2. */
static double thermal(double w)
{
    return w * (1 + 0.5 * w);
}

/* What warmth does across a plane that cannot grow there has an energy that no displacement changes: W at the strain
 * that is free of stress in the plane, by Newton's method. 0 of other elements. */
static double energy_across(const uz_element *element, uz_elasticity law, double warm)
{
    double W = 0, S[N_STRAINS], D[N_STRAINS][N_STRAINS], c = 1;
    const double across = 1 / ((1 + warm) * (1 + warm));
    for (int k = 0; k < MOST_STEPS && element->model == UZ_PLANE_STRAIN && warm != 0; k++) {
        double C[N_STRAINS] = {c, c, across};
        if (!uz_finite_law(&W, S, D, C, element, law))
            return 0;
        const double next = c - 2 * S[0] / (D[0][0] + D[0][1]);
        if (!(next > 0) || fabs(next - c) <= 1e-15 * c)
            break;
        c = next;
    }
    return W;
}

/* At point p of the element in a lane: W, and the difference's energy in the moduli there. Where these are not positive
 * a difference may have none. Per volume of the body at rest. */
static bool compare_at(double *W, double *eta2, const comparison *x, const uz_strain_group *group, const int64_t *place,
                       const uz_element *element, double across, int p, int lane)
{
    static const int PLANE[] = {0, 1, 3}, SPACE[] = {0, 1, 2, 3, 4, 5}; /* components of the rows' */
    const int n = group->rule.stresses, *at = n == 3 ? PLANE : SPACE;
    const double warm = group->free_strain[lane], size = 1 + warm, per_square = 1 / (size * size);
    double mean = 0; /* expansion, at the nodes */
    for (int a = 0; a < group->rule.nodes && x->nodal.size > n + 1; a++)
        mean += group->rule.N[p][a] * x->nodal.rows[place[a] * x->nodal.size + n + 1];
    double C[N_STRAINS] = {1, 1, n == 3 ? per_square : 1}, strain[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS],
           off[N_STRAINS], sum = 0, work = 0, most = 0;
    for (int c = 0; c < n; c++) {
        const double E = group->strain[p][c][lane] - (at[c] < 3 ? thermal(warm) : 0);
        off[c] = -x->own * (E + (at[c] < 3 ? thermal(mean) : 0));
        if (x->to)
            off[c] -= (x->moved[0].strain[p][c][lane] - x->moved[1].strain[p][c][lane]) / (2 * x->step);
        for (int a = 0; a < group->rule.nodes; a++)
            off[c] += group->rule.N[p][a] * x->nodal.rows[place[a] * x->nodal.size + c];
        off[c] *= per_square;
        strain[c] = per_square * E;
        C[at[c]] += (at[c] < 3 ? 2 : 1) * strain[c]; /* shears are 2 E_xy, and C_xy is */
    }
    const uz_elasticity law = uz_element_material(x->model, group->element[lane])->law;
    if (!uz_finite_law(W, S, D, C, element, law))
        return false;
    for (int i = 0; i < n; i++) {
        work += S[at[i]] * strain[i];
        most = fmax(most, fabs(strain[i]));
        for (int j = 0; j < n; j++)
            sum += off[i] * D[at[i]][at[j]] * off[j];
    }
    if (most < SMALL && warm == 0)
        *W = 0.5 * work;
    else
        *W -= across;
    *W *= size * size * size;
    *eta2 = fmax(0, sum) * size * size * size;
    return true;
}

static void compare(void *ctx, const uz_strain_group *group)
{
    comparison *x = ctx;
    const int64_t *place[UZ_STRAIN_LANES];
    uz_nodal_places(place, &x->nodal, group, &x->model->mesh);
    uz_lanes times = (uz_lanes){0} + 1;
    if (x->whole)
        uz_whole_difference(&times, group, place, &x->nodal);
    for (int k = 0; k < 2 && x->to; k++) {
        x->moved[k] = *group;
        uz_strain_group_load(&x->moved[k], &x->to[k]);
    }
    for (int l = 0; l < group->count; l++) {
        double xyz[3 * UZ_ELEMENT_NODES], W, eta2;
        uz_element element;
        uz_body_element(&element, xyz, x->model, group->element[l]);
        const double across =
            energy_across(&element, uz_element_material(x->model, group->element[l])->law, group->free_strain[l]);
        for (int p = 0; p < group->rule.asked; p++) {
            if (!compare_at(&W, &eta2, x, group, place[l], &element, across, p, l)) {
                x->failed = true;
                return;
            }
            x->energy += group->shape.volume[p][l] * W;
            x->unit += group->shape.volume[p][l] * (element.lame.lambda + 2 * element.lame.mu);
            eta2 *= times[l] * group->shape.volume[p][l];
            x->eta2 += eta2;
            if (x->eta2_of)
                x->eta2_of[group->element[l]] += eta2;
        }
    }
}

uz_status uz_finite_mesh_error(double *error, double *eta2, const uz_body_model *model, const uz_scene *scene,
                               const double *free_strain, const double *u, uz_error *err)
{
    comparison x = {.model = model, .own = 1, .whole = true, .eta2_of = eta2};
    const uz_strain_source from = {
        .model = model, .nodal = u, .free_strain = free_strain, .apart = true, .large = true};
    if (eta2)
        memset(eta2, 0, (size_t)model->mesh.n_elements * sizeof *eta2);
    uz_status status = uz_nodal_strains_recover(&x.nodal, &from, UZ_CONTINUE_LINEAR, NULL, err);
    if (status == UZ_OK)
        status = uz_strain_groups(&(uz_strain_work){make_rule, compare, &x}, &from, NULL, err);
    uz_nodal_strains_clear(&x.nodal);
    double stored;
    const double springs = uz_spring_error(eta2, &stored, model, scene, u, 2 * x.energy);
    if (status == UZ_OK && isnan(springs))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to look at what springs do");
    x.eta2 += springs;
    x.energy += 0.5 * stored;
    const double square = 2 * x.energy + x.eta2;
    const bool told = status == UZ_OK && !x.failed, rests = x.energy == 0 && x.eta2 == 0;
    *error = told && rests ? 0 : told && square > ROUNDING * ROUNDING * x.unit ? sqrt(x.eta2 / square) : (double)NAN;
    return status;
}

/* x->nodal becomes the means of what is compared: E is a polynomial of degree two, whose derivative along z is half of
 * what it differs by between u + z and u - z. With mean dilatation it is none, and the way is a small part of z. */
static uz_status recover_along(comparison *x, const uz_strain_source *from, uz_error *err)
{
    uz_nodal_strains *to = &x->nodal;
    uz_status status = uz_nodal_strains_recover(to, from, UZ_CONTINUE_LINEAR, NULL, err);
    for (int64_t i = 0; i < to->count * to->size && status == UZ_OK; i++)
        to->rows[i] *= i % to->size < to->strains ? x->own : 1;
    for (int k = 0; k < 2 && status == UZ_OK && x->to; k++) {
        uz_nodal_strains moved;
        status = uz_nodal_strains_recover(&moved, &x->to[k], UZ_CONTINUE_LINEAR, NULL, err);
        for (int64_t i = 0; i < to->count * to->size && status == UZ_OK; i++)
            if (i % to->size < to->strains)
                to->rows[i] += (k == 0 ? 0.5 : -0.5) / x->step * moved.rows[i];
        uz_nodal_strains_clear(&moved);
    }
    return status;
}

/* What part of times z is gone for a derivative. */
static double step_along(const uz_body_model *model, const double *z, double times)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    bool averaged = false;
    double most = 0;
    for (int64_t e = 0; e < model->mesh.n_elements && !averaged; e++)
        averaged = uz_element_formulation(model, e) == UZ_FORMULATION_BBAR;
    for (int64_t i = 0; i < n && averaged; i++)
        most = fmax(most, fabs(times * z[i]));
    return most > 0 ? STEP * model->mesh.extent / most : 1;
}

uz_status uz_finite_error_energy(double *energy, double *eta2, const uz_body_model *model, const double *free_strain,
                                 const double *u, const double *z, double own, double times, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *place = uz_alloc(2 * n, sizeof *place);
    const uz_strain_source from = {
        .model = model, .nodal = u, .free_strain = free_strain, .apart = true, .large = true};
    uz_strain_source to[2] = {from, from};
    comparison x = {.model = model, .own = own, .to = times != 0 ? to : NULL, .eta2_of = eta2};
    uz_status status = UZ_OK;
    x.moved = uz_alloc(2, sizeof *x.moved);
    if (!place || !x.moved)
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the errors of %lld nodes", (long long)model->mesh.n_nodes);
    x.step = x.to ? step_along(model, z, times) : 1;
    for (int64_t i = 0; i < n && status == UZ_OK && x.to; i++) {
        place[i] = u[i] + x.step * times * z[i];
        place[n + i] = u[i] - x.step * times * z[i];
    }
    to[0].nodal = place;
    to[1].nodal = place ? place + n : NULL;
    if (eta2)
        memset(eta2, 0, (size_t)model->mesh.n_elements * sizeof *eta2);
    if (status == UZ_OK)
        status = recover_along(&x, &from, err);
    if (status == UZ_OK)
        status = uz_strain_groups(&(uz_strain_work){make_rule, compare, &x}, &from, NULL, err);
    *energy = x.failed ? (double)NAN : x.eta2;
    uz_nodal_strains_clear(&x.nodal);
    uz_free_all(x.moved, place);
    return status;
}

uz_status uz_finite_distance(double *half, const uz_body_model *model, const double *free_strain, const double *from,
                             const double *to, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *force = uz_alloc(2 * n, sizeof *force);
    uz_finite_measure there, before;
    *half = 0;
    if (!force)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to compare the answers of two meshes");
    uz_finite_body(&there, force, NULL, model, free_strain, to, NULL);
    uz_finite_body(&before, force + n, NULL, model, free_strain, from, NULL);
    for (int64_t i = 0; i < n && there.least_det > 0 && before.least_det > 0; i++)
        *half += 0.5 * (to[i] - from[i]) * (force[i] - force[n + i]);
    *half = fmax(0, *half);
    free(force);
    return UZ_OK;
}
