/* mesh_error.c: Zienkiewicz and Zhu's comparison (assembly/error_estimate.c) in strains that know no rotation.
 *
 * The strain E of Green and Lagrange jumps from element to element; averaged at the nodes it is closer to the true one.
 * With the moduli D = dS/dE of the law where the body is,
 *     eta^2 = integral of (E* - E_h)' D (E* - E_h) over the volume at rest
 * estimates the square of the error in the energy norm of the tangent, but for what the stress does to turning parts,
 * and 2 W stands for the square of the norm of u, which it is of small strain. Of quantities it is the inner product of
 * that with the same of another displacement z, in the derivative of E along it.
 * Means of E that each keep the volume do not: they are off by the square of how E differs, and where the law is nearly
 * incompressible that would be all that is told. So where there is mean dilatation, whose J is known, what is averaged
 * has ln J for its trace, and of E* - E_h the part along C is what makes the change of ln J that of the means.
 */
#include "finite/mesh_error.h"

#include "assembly/nodal_strains.h"
#include "assembly/stress_lanes.h"
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
    bool whole;     /* with what is hidden */
    bool by_volume; /* means are of strains with ln J for their trace */
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

/* What the trace of a strain is less than ln J (uz_lane_green_strains), by its n components with shears 2 E_xy. */
static double volume_beside(const double *E, int n, int direct)
{
    const double *shear = E + direct, plane = 2 * E[0] + 2 * E[1] + 4 * E[0] * E[1] - shear[0] * shear[0];
    double more = plane, trace = E[0] + E[1];
    if (direct == 3) {
        more += 2 * E[2] * (1 + plane);
        trace += E[2];
    }
    if (n == N_STRAINS)
        more += 2 * shear[0] * shear[1] * shear[2] - (1 + 2 * E[0]) * shear[1] * shear[1] -
                (1 + 2 * E[1]) * shear[2] * shear[2];
    return 0.5 * log1p(more) - trace;
}

/* A difference whose trace is one of ln J becomes one of strains, at C. */
static void strain_of_volume(double *off, const double C[N_STRAINS], const int *at, double per_square, int n,
                             int direct)
{
    const double by[N_STRAINS] = {C[1] * C[2] - C[4] * C[4], C[0] * C[2] - C[5] * C[5], C[0] * C[1] - C[3] * C[3],
                                  C[4] * C[5] - C[3] * C[2], C[3] * C[5] - C[0] * C[4], C[3] * C[4] - C[1] * C[5]};
    const double det = C[0] * by[0] + C[3] * by[3] + C[5] * by[5];
    double trace = 0, along = 0, sum = 0;
    for (int c = 0; c < direct; c++)
        trace += off[c];
    for (int c = 0; c < n; c++) {
        off[c] = per_square * (off[c] - (c < direct ? trace / direct : 0));
        along += by[at[c]] / det * off[c];
        sum += c < direct ? by[at[c]] / det : 0;
    }
    for (int c = 0; c < direct; c++)
        off[c] += (trace - along) / sum;
}

/* At point p of the element in a lane: W, and the difference's energy in the moduli there. Where these are not positive
 * a difference may have none. Per volume of the body at rest. */
static bool compare_at(double *W, double *eta2, const comparison *x, const uz_strain_group *group, const int64_t *place,
                       const uz_element *element, double across, int p, int lane)
{
    static const int PLANE[] = {0, 1, 3}, SPACE[] = {0, 1, 2, 3, 4, 5}; /* components of the rows' */
    const int n = group->rule.stresses, direct = group->rule.direct, *at = n == 3 ? PLANE : SPACE;
    const double warm = group->free_strain[lane], size = 1 + warm, per_square = 1 / (size * size);
    double mean = 0; /* expansion, at the nodes */
    for (int a = 0; a < group->rule.nodes && x->nodal.size > n + 1; a++)
        mean += group->rule.N[p][a] * x->nodal.rows[place[a] * x->nodal.size + n + 1];
    const double freely = x->by_volume ? log1p(mean) - log1p(warm) : thermal(mean) - thermal(warm);
    double C[N_STRAINS] = {1, 1, n == 3 ? per_square : 1}, strain[N_STRAINS], S[N_STRAINS], D[N_STRAINS][N_STRAINS],
           E[N_STRAINS] = {0}, off[N_STRAINS], sum = 0, work = 0, most = 0;
    for (int c = 0; c < n; c++)
        E[c] = group->strain[p][c][lane];
    const double beside = x->by_volume ? volume_beside(E, n, direct) / direct : 0;
    for (int c = 0; c < n; c++) {
        off[c] = -x->own * (E[c] + (c < direct ? beside + freely : 0));
        if (x->to)
            off[c] -= (x->moved[0].strain[p][c][lane] - x->moved[1].strain[p][c][lane]) / (2 * x->step);
        for (int a = 0; a < group->rule.nodes; a++)
            off[c] += group->rule.N[p][a] * x->nodal.rows[place[a] * x->nodal.size + c];
        strain[c] = per_square * (E[c] - (c < direct ? thermal(warm) : 0));
        C[at[c]] += (c < direct ? 2 : 1) * strain[c]; /* shears are 2 E_xy, and C_xy is */
        off[c] *= x->by_volume ? 1 : per_square;
    }
    if (x->by_volume)
        strain_of_volume(off, C, at, per_square, n, direct);
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
        uz_whole_difference(&times, x->nodal.rows, x->nodal.size, group, place);
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

static bool has_mean_dilatation(const uz_body_model *model)
{
    bool found = false;
    for (int64_t e = 0; e < model->mesh.n_elements && !found; e++)
        found = uz_element_formulation(model, e) == UZ_FORMULATION_BBAR;
    return found;
}

uz_status uz_finite_mesh_error(double *error, double *eta2, const uz_body_model *model, const uz_scene *scene,
                               const double *free_strain, const double *u, uz_error *err)
{
    comparison x = {.model = model, .own = 1, .whole = true, .eta2_of = eta2, .by_volume = has_mean_dilatation(model)};
    const uz_strain_source from = {
        .model = model, .nodal = u, .free_strain = free_strain, .apart = true, .large = true};
    uz_strain_source means = from;
    means.by_volume = x.by_volume;
    if (eta2)
        memset(eta2, 0, (size_t)model->mesh.n_elements * sizeof *eta2);
    uz_status status = uz_nodal_strains_recover(&x.nodal, &means, UZ_CONTINUE_LINEAR, NULL, err);
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
static double step_along(const comparison *x, const double *z, double times)
{
    const uz_body_model *model = x->model;
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double most = 0;
    for (int64_t i = 0; i < n && x->by_volume; i++)
        most = fmax(most, fabs(times * z[i]));
    return most > 0 ? STEP * model->mesh.extent / most : 1;
}

uz_status uz_finite_error_energy(double *energy, double *eta2, const uz_body_model *model, const double *free_strain,
                                 const double *u, const double *z, double own, double times, uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *place = uz_alloc(2 * n, sizeof *place);
    const bool by_volume = has_mean_dilatation(model);
    const uz_strain_source from = {
        .model = model, .nodal = u, .free_strain = free_strain, .apart = true, .large = true};
    uz_strain_source means = from;
    means.by_volume = by_volume;
    uz_strain_source to[2] = {means, means};
    comparison x = {.model = model, .own = own, .to = times != 0 ? to : NULL, .eta2_of = eta2, .by_volume = by_volume};
    uz_status status = UZ_OK;
    x.moved = uz_alloc(2, sizeof *x.moved);
    if (!place || !x.moved)
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the errors of %lld nodes", (long long)model->mesh.n_nodes);
    x.step = x.to ? step_along(&x, z, times) : 1;
    for (int64_t i = 0; i < n && status == UZ_OK && x.to; i++) {
        place[i] = u[i] + x.step * times * z[i];
        place[n + i] = u[i] - x.step * times * z[i];
    }
    to[0].nodal = place;
    to[1].nodal = place ? place + n : NULL;
    if (eta2)
        memset(eta2, 0, (size_t)model->mesh.n_elements * sizeof *eta2);
    if (status == UZ_OK)
        status = recover_along(&x, &means, err);
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
