/* guarantee.c: a guaranteed bound on the whole error of answers on a mesh, where it is asked for: the dual problem is
 * one in matrices, which is solved as any other, and so is the norm of what its stress lacks of equilibrium. */
#include "run/guarantee.h"

#include "run/solve.h"
#include "bound/interval.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "run/transfer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The square of a bound over |sigma_h - C eps(u_h)|^2, up to which another way out of obstacles would gain little. */
#define NARROW 1.5
/* The same, and the bound over what the error is by estimate, up to which closer sides along the contact gain little.
 */
#define FINE     1.05
#define EXPECTED 1.2
/* The square of a bound by the gap alone over the same, from which on much of it is where the stress presses and the
 * answer does not touch. */
#define FAR_OFF 1.05
/* An obstacle that is off a line by less, of the largest displacement, is one. */
#define SEEN 1e-2
/* So often what holds a body that only obstacles hold is chosen anew; what its answer presses by beside a stress that
 * was held itself; and, in parts of the stiffness of its unknowns, the springs that find out where it presses: from
 * 1e-8 to 1e-11 they make no difference.
 */
enum { MOST_CHOICES = 10 };
#define BY_ANSWER 0.01
#define SOFT      1e-9

uz_settings uz_guarantee_settings(const uz_guaranteed *g, double now)
{
    uz_settings settings = uz_settings_default();
    settings.memory_limit = g->settings->memory_limit;
    settings.time_limit_s = fmax(0.0, g->stop.deadline - now);
    return settings;
}

/* The dual problem, or the residual's: the library's own solve, with what is left of the time. */
static uz_status solve(uz_result **out, const uz_guaranteed *g, const uz_qp *qp, uz_error *err)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    const double started = uz_seconds();
    const uz_settings settings = uz_guarantee_settings(g, started);
    *out = NULL;
    uz_status status = uz_solve_rounds(out, &problem, &settings, NULL, NULL, g->cache, &g->hooks, err);
    status = uz_settle_cases(out, status, &problem, &settings, NULL, g->cache, &g->hooks, started, err);
    if (status != UZ_OK) {
        uz_result_free(*out);
        *out = NULL;
    }
    return status;
}

uz_status uz_measure_residual(double *norm, const uz_guaranteed *g, double *residual, uz_error *err)
{
    uz_qp qp = {.K = g->qp.K, .p = residual};
    uz_result *result = NULL;
    double largest = 0, no_gaps = 0;
    *norm = 0;
    for (int64_t i = 0; i < qp.K.cols; i++)
        largest = fmax(largest, fabs(qp.p[i]));
    if (!(largest > 0))
        return UZ_OK;
    *norm = INFINITY;
    qp.h = &no_gaps;
    uz_status status = uz_csc_init(&qp.N, 0, qp.K.cols, 0, err);
    if (status == UZ_OK)
        status = solve(&result, g, &qp, err);
    if (status == UZ_OK && isfinite(result->summary.certificate.absolute_error))
        *norm = result->summary.certificate.energy_norm + result->summary.certificate.absolute_error;
    uz_result_free(result);
    uz_csc_clear(&qp.N);
    return status;
}

/* How hard an answer presses at its nodes, 0 elsewhere; NULL: no memory. */
static double *press_at_nodes(const uz_result *result)
{
    const uz_mesh_info *mesh = &result->mesh;
    double *pressure = uz_alloc_zero(result->n_nodes, sizeof *pressure);
    for (int64_t i = 0; i < result->m && pressure; i++)
        if (mesh->contact_area[i] > 0)
            pressure[mesh->contact_node[i]] =
                fmax(pressure[mesh->contact_node[i]], -result->r[i] / mesh->contact_area[i]);
    return pressure;
}

/* A body that only obstacles hold, where its answer presses on them: pressure by nodes, NULL if there was no memory for
 * it. */
static uz_status hold(uz_guaranteed *g, const double *pressure, uz_error *err)
{
    free(g->pressing);
    g->pressing = uz_alloc(g->body.n_edges * (g->body.degree + 1), sizeof *g->pressing);
    if (!g->pressing || !pressure)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld edges", (long long)g->body.n_edges);
    uz_bound_pressure_at_moments(g->pressing, &g->body, pressure);
    uz_bound_hold(&g->body, g->pressing);
    return UZ_OK;
}

/* By what presses at moments, resultants; or, of a stress that did not tell all by itself, in the answer, which counts
 * less. */
static void hold_pressed(uz_guaranteed *g, double *resultant)
{
    uz_bound_body *body = &g->body;
    const int moments = body->degree + 1;
    for (int64_t i = 0; i < body->n_edges * moments; i++) {
        const double own = g->at ? 0 : BY_ANSWER * g->pressing[i];
        const double p = fmax(resultant[i] / uz_bound_measure(body, i / moments), own);
        resultant[i] = isnan(g->pressing[i]) ? 0 : p;
    }
    uz_bound_hold(body, resultant);
    for (int k = 0; k < body->n_pressed && g->at; k++)
        body->pressed_at[k] = g->at[body->pressed[k]];
}

/* Anew, where what was chosen would have to pull: the moment that would most is not chosen again, and others by what
 * presses in the stress. */
static void hold_elsewhere(uz_guaranteed *g, double *resultant)
{
    const uz_bound_body *body = &g->body;
    int64_t worst = body->pressed[0];
    for (int k = 1; k < body->n_pressed; k++)
        worst = resultant[body->pressed[k]] < resultant[worst] ? body->pressed[k] : worst;
    g->pressing[worst] = NAN;
    hold_pressed(g, resultant);
}

/* Where the stress itself presses, and what its displacement is: held by nothing but soft springs at all unknowns, its
 * rows tell. Moments that press there may as well be held where they are, and do not pull then. Where it tells nothing
 * the choice that there is stays. */
static uz_status hold_where_stress_presses(uz_guaranteed *g, uz_error *err)
{
    uz_bound_body *body = &g->body;
    const uz_bound_body chosen = *body;
    const int moments = body->degree + 1;
    const int64_t n = body->n_edges * moments;
    uz_qp qp = {.p = NULL};
    uz_result *soft = NULL;
    int64_t *dof = NULL, row = 0;
    double *resultant = uz_alloc_zero(n, sizeof *resultant), *at = uz_alloc_zero(n, sizeof *at);
    body->n_pressed = 0;
    uz_status status = resultant && at ? uz_bound_dual_problem(&qp, &dof, body, &g->stop, err)
                                       : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld edges",
                                                 (long long)body->n_edges);
    for (int64_t j = 0; j < qp.K.cols && status == UZ_OK; j++)
        for (int64_t q = qp.K.ptr[j]; q < qp.K.ptr[j + 1]; q++)
            qp.K.val[q] *= qp.K.idx[q] == j ? 1 + SOFT : 1;
    if (status == UZ_OK)
        status = solve(&soft, g, &qp, err);
    const bool told = status == UZ_OK && isfinite(soft->summary.certificate.absolute_error);
    for (int64_t i = 0; i < n && told; i++)
        if (uz_bound_has_row(body, dof, i / moments, (int)(i % moments))) {
            resultant[i] = fmax(0, -soft->r[row++]);
            at[i] = dof[2 * i] < 0 ? 0 : soft->u[dof[2 * i]];
        }
    if (told) {
        g->at = at;
        at = NULL;
        hold_pressed(g, resultant);
    }
    if (!told || *body->why) {
        free(g->at);
        g->at = NULL;
        body->n_pressed = chosen.n_pressed;
        memcpy(body->pressed, chosen.pressed, sizeof body->pressed);
        memcpy(body->pressed_at, chosen.pressed_at, sizeof body->pressed_at);
        memcpy(body->why, chosen.why, sizeof body->why);
    }
    uz_result_free(soft);
    uz_qp_clear(&qp);
    uz_free_all(dof, resultant, at);
    return status == UZ_ERR_MEMORY || status == UZ_ERR_CANCELLED ? status : UZ_OK;
}

/* With what takes the answer out of obstacles, and without it, as the check finds something by itself, too: what proves
 * most. */
static uz_status check(uz_guaranteed *g, const double *u, const uz_scene *scene, uz_error *err)
{
    const double *const all[] = {g->lift, g->cheap, g->carried[0], g->carried[1]};
    const double *lifts[1 + sizeof all / sizeof all[0]] = {NULL};
    int n = 1;
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        if (all[k])
            lifts[n++] = all[k];
    uz_bound_check_clear(&g->checked);
    return uz_bound_check_lifts(&g->checked, &g->body, scene, g->dof, g->qp.K.cols, u, lifts, n, g->stress, err);
}

/* The displacement of least energy, where that proves more of quantities: its errors are smaller than those of the
 * answer and of what takes it out of obstacles. */
static uz_status take_out(uz_guaranteed *g, const double *u, const uz_scene *scene, uz_error *err)
{
    const int64_t n = 2 * g->body.model->mesh.n_nodes;
    g->shown = &g->checked;
    if (!g->cheap)
        return UZ_OK;
    double *out = uz_alloc(n, sizeof *out);
    if (!out)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacement of %lld nodes", (long long)n / 2);
    for (int64_t i = 0; i < n; i++)
        out[i] = u[i] + g->cheap[i];
    uz_status status = uz_bound_check(&g->out_of_it, &g->body, scene, g->dof, g->qp.K.cols, out, NULL, g->stress, err);
    const bool better = status == UZ_OK && !*g->out_of_it.fault &&
                        uz_bound_ball(&g->out_of_it, g->rho) < uz_bound_ball(&g->checked, g->rho);
    if (better) {
        g->admissible = out;
        g->shown = &g->out_of_it;
    } else {
        free(out);
    }
    return status;
}

/* The dual problem, and its stress. *solved false: it has none, and out->why says so. */
static uz_status make_stress(uz_guaranteed *g, bool *solved, uz_guarantee *out, uz_error *err)
{
    const int64_t n = g->body.model->mesh.n_elements;
    uz_result *dual = NULL;
    *solved = false;
    uz_status status = uz_bound_dual_problem(&g->qp, &g->dof, &g->body, &g->stop, err);
    if (status == UZ_OK)
        status = solve(&dual, g, &g->qp, err);
    if (status == UZ_OK && !isfinite(dual->summary.certificate.absolute_error)) {
        snprintf(out->why, sizeof out->why, "the dual problem could not be solved: %.100s", dual->summary.message);
        uz_result_free(dual);
        return UZ_OK;
    }
    if (status == UZ_OK) {
        g->stress = uz_alloc(n * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, sizeof *g->stress);
        status = g->stress ? uz_bound_stress(g->stress, &g->body, g->dof, dual->u, &g->stop, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the stress of %lld elements", (long long)n);
    }
    *solved = status == UZ_OK;
    uz_result_free(dual);
    return status;
}

/* The same of a body that only obstacles hold, which may be held elsewhere then. */
static uz_status make_held_stress(uz_guaranteed *g, bool *solved, uz_guarantee *out, const uz_scene *scene,
                                  const double *u, uz_error *err)
{
    const int moments = g->body.degree + 1;
    bool pulls = g->body.n_loose > 0, softly = false;
    uz_status status = UZ_OK;
    *solved = false;
    for (int k = 0; k < g->body.n_pressed; k++) /* of what turns not even the gap of a moment by itself is known */
        softly = softly || g->body.edge[g->body.pressed[k] / moments].turns;
    if (softly)
        status = hold_where_stress_presses(g, err);
    if (status == UZ_OK)
        status = make_stress(g, solved, out, err);
    for (int again = 0; again < MOST_CHOICES && pulls && *solved && status == UZ_OK; again++) {
        uz_bound_check_result found;
        status = uz_bound_check(&found, &g->body, scene, g->dof, g->qp.K.cols, u, NULL, g->stress, err);
        pulls = status == UZ_OK && found.pulls;
        if (pulls && !softly)
            status = hold_where_stress_presses(g, err);
        else if (pulls)
            hold_elsewhere(g, found.pressure);
        softly = true;
        uz_bound_check_clear(&found);
        *solved = !*g->body.why;
        if (!pulls || !*solved || status != UZ_OK)
            break;
        uz_qp_clear(&g->qp);
        uz_free_all(g->dof, g->stress);
        g->dof = NULL;
        g->stress = NULL;
        status = make_stress(g, solved, out, err);
    }
    if (*g->body.why)
        snprintf(out->why, sizeof out->why, "%s", g->body.why);
    return status;
}

static void clear(uz_guaranteed *g)
{
    uz_bound_body_clear(&g->body);
    uz_qp_clear(&g->qp);
    uz_free_all(g->dof, g->stress, g->pressing, g->at, g->lift, g->cheap, g->carried[0], g->carried[1], g->admissible);
    uz_bound_check_clear(&g->checked);
    uz_bound_check_clear(&g->out_of_it);
}

/* From the interpolation of the answer on the closer mesh to the answer. The two are one on the sides of its own mesh,
 * so that their gaps to a stress differ by the potential energies, and by what the stress lacks of equilibrium on their
 * difference, which is no more than that of the norms. */
static uz_status take_answer(uz_guaranteed *closer, const uz_guaranteed *g, const uz_scene *scene,
                             const uz_closer *mesh, const double *u, uz_error *err)
{
    double own, own_strain, own_margin, its, its_strain, its_margin;
    if (mesh->triangles)
        return UZ_OK;
    uz_status status = uz_bound_potential(&own, &own_strain, &own_margin, &g->body, scene, u, err);
    if (status == UZ_OK)
        status = uz_bound_potential(&its, &its_strain, &its_margin, &closer->body, &mesh->problem.scene, mesh->u, err);
    if (status != UZ_OK)
        return status;
    closer->checked.gap += own - its + own_margin + its_margin +
                           closer->rho * (sqrt(2 * (own_strain + own_margin)) + sqrt(2 * (its_strain + its_margin)));
    closer->checked.norm = sqrt(2 * fmax(0, own_strain - own_margin));
    return UZ_OK;
}

/* What `closer` proves, on its mesh. Its fault, or infinite norms: nothing. */
static uz_status prove_on(uz_guaranteed *closer, const uz_guaranteed *g, const uz_closer *mesh, const uz_scene *scene,
                          const double *u, uz_error *err)
{
    const uz_scene *its = &mesh->problem.scene;
    const int64_t n = mesh->model.mesh.n_nodes;
    uz_status status = uz_bound_check(&closer->checked, &closer->body, its, closer->dof, closer->qp.K.cols, mesh->u,
                                      NULL, closer->stress, err);
    double *push = uz_alloc(3 * n, sizeof *push);
    if (status == UZ_OK && !push)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for what presses on %lld nodes", (long long)n);
    if (status == UZ_OK) {
        const uz_bound_check_result *c = &closer->checked;
        const uz_standing answer = {
            .u = mesh->u, .push = push, .open = push + 2 * n, .stands_off = 2 * c->gap > FAR_OFF * c->least};
        uz_bound_push(push, push + 2 * n, &closer->body, closer->checked.pressure, mesh->u);
        status = uz_lift_out(closer, &answer, err);
    }
    if (status == UZ_OK && (closer->lift || closer->cheap || closer->carried[0] || closer->carried[1]))
        status = check(closer, mesh->u, its, err);
    if (status == UZ_OK)
        status = uz_measure_residual(&closer->rho, closer, closer->checked.residual, err);
    if (status == UZ_OK)
        status = take_answer(closer, g, scene, mesh, u, err);
    free(push);
    return status;
}

/* What both meshes prove is true. */
static void take_better(uz_guarantee *out, const uz_guaranteed *g, double bound)
{
    const uz_bound_check_result *c = &g->checked;
    const double dual = c->dual - fabs(c->defect) - uz_bound_lacking(c, g->rho) * bound,
                 primal = g->admissible ? fmin(c->primal, g->out_of_it.primal) : c->primal;
    out->primal = out->proved ? fmin(out->primal, primal) : primal;
    out->dual = out->proved ? fmax(out->dual, dual) : dual;
    if (!out->proved || bound < out->bound) {
        out->bound = bound;
        out->relative = !(bound > 0) ? 0 : c->norm > bound ? bound / (c->norm - bound) : (double)INFINITY;
        out->unknowns = g->qp.K.cols;
    }
    out->proved = true;
    out->why[0] = '\0'; /* on one mesh, whatever another one could not */
}

static uz_status hold_closer(uz_guaranteed *closer, const uz_closer *mesh, const uz_result *result, uz_error *err)
{
    double *own = press_at_nodes(result),
           *finer = own ? uz_carry_nodal(&mesh->model.mesh, own, result->n_nodes, 1) : NULL;
    const uz_status status = hold(closer, finer, err);
    uz_free_all(own, finer);
    return status;
}

/* On a mesh that is finer where the answer presses (closer.c). *narrow: is little of the bound of what takes the answer
 * out of obstacles, and of how far that stands off them? */
static uz_status prove_closer(uz_guarantee *out, bool *narrow, const uz_result *result, const uz_guaranteed *g,
                              const uz_scene *scene, uz_error *err)
{
    uz_guarantee other = {.asked = true};
    uz_guaranteed closer = {.settings = g->settings, .cache = g->cache, .hooks = g->hooks, .stop = g->stop};
    uz_closer mesh;
    bool any = false, solved = false;
    uz_status status = uz_closer_make(&mesh, &any, g, result, err);
    closer.problem = &mesh.problem;
    closer.rho = INFINITY;
    if (status == UZ_OK && any)
        status = uz_bound_body_make(&closer.body, &mesh.model, &mesh.problem.scene, err);
    const double *own[] = {g->lift, g->cheap};
    for (int k = 0; k < 2 && status == UZ_OK && any; k++)
        closer.carried[k] = own[k] ? uz_carry_nodal(&mesh.model.mesh, own[k], g->body.model->mesh.n_nodes, 2) : NULL;
    if (status == UZ_OK && any && !*closer.body.why && closer.body.n_loose > 0)
        status = hold_closer(&closer, &mesh, result, err);
    if (status == UZ_OK && any && !*closer.body.why)
        status = make_held_stress(&closer, &solved, &other, &mesh.problem.scene, mesh.u, err);
    if (status == UZ_OK && solved)
        status = prove_on(&closer, g, &mesh, scene, result->u, err);
    const uz_bound_check_result *c = &closer.checked;
    const double bound = solved && status == UZ_OK ? uz_bound_error(c, closer.rho) : (double)INFINITY;
    if (isfinite(bound))
        take_better(out, &closer, bound);
    *narrow = isfinite(bound) && bound * bound <= NARROW * c->least;
    clear(&closer);
    uz_closer_clear(&mesh);
    return status == UZ_ERR_MEMORY || status == UZ_ERR_CANCELLED ? status : UZ_OK; /* there is the answer's own mesh */
}

/* By how much the obstacle before an edge is off a line, as far as normals say. */
static double bent(const uz_bound_body *body, int64_t i)
{
    const uz_bound_edge *edge = &body->edge[i];
    double first[2], n[2], most = 0, from = 0;
    if (!edge->turns)
        return 0;
    uz_bound_piece_gap(first, body, i, edge->before, 0);
    for (int64_t k = edge->before; k < edge->before + edge->pieces; k++) {
        const double end = body->before.at[k].end;
        for (int j = 0; j < 2; j++) {
            uz_bound_piece_gap(n, body, i, k, j == 0 ? from : end);
            most = fmax(most, hypot(n[0] - first[0], n[1] - first[1]));
        }
        from = end;
    }
    return most * uz_bound_measure(body, i) / body->depth;
}

/* Is what a bound is too wide by along the contact? Before planes gaps and pressures are polynomials. */
static bool wants_closer(const uz_guaranteed *g, const double *u)
{
    double off = 0, farthest = 0;
    for (int64_t i = 0; i < g->body.n_edges; i++)
        off = fmax(off, bent(&g->body, i));
    for (int64_t i = 0; i < 2 * g->body.model->mesh.n_nodes; i++)
        farthest = fmax(farthest, fabs(u[i]));
    return g->body.n_segments > 0 || off > SEEN * farthest;
}

/* Is the mesh fine enough for its contact? By what the bound has beside the stress's distance, and as a stress whose
 * pressure has no room on the sides that there are is far from the answer everywhere, by the estimate, too. */
static bool is_fine(const uz_guaranteed *g, const uz_summary *s, double bound)
{
    const uz_bound_check_result *c = &g->checked;
    return g->body.n_segments == 0 && bound * bound <= FINE * c->least &&
           bound <= EXPECTED * s->discretization_error * c->norm;
}

/* On the answer's own mesh, when it is held and out of obstacles. *bound INFINITY: nothing, and out->why says why. */
static uz_status prove_own(uz_guarantee *out, double *bound, uz_guaranteed *g, const double *u, const uz_scene *scene,
                           uz_error *err)
{
    const uz_bound_check_result *c = &g->checked;
    bool solved = false;
    *bound = INFINITY;
    uz_status status = make_held_stress(g, &solved, out, scene, u, err);
    if (status != UZ_OK || !solved)
        return status;
    status = check(g, u, scene, err);
    if (status == UZ_OK)
        status = uz_measure_residual(&g->rho, g, g->checked.residual, err);
    if (status != UZ_OK)
        return status;
    *bound = uz_bound_error(c, g->rho);
    if (isfinite(*bound)) {
        status = take_out(g, u, scene, err);
        take_better(out, g, *bound);
    } else if (!out->proved) {
        snprintf(out->why, sizeof out->why, "%s",
                 *c->fault ? c->fault : "what the stress lacks of equilibrium could not be bounded");
    }
    return status;
}

/* -> summary.guarantee, but for its time and reasons that are errors. The mesh that is more likely to do goes first: of
 * quadratic elements, and where surfaces face each other, much of a bound is of the sides along the contact, of linear
 * ones little. Quantities, and the next mesh, are from what the answer's own proves. */
static uz_status prove(uz_result *result, uz_guaranteed *g, const uz_body_model *model, const uz_scene *scene,
                       uz_error *err)
{
    uz_guarantee *out = &result->summary.guarantee;
    const uz_standing answer = {.u = result->u, .r = result->r, .gap = result->g};
    bool narrow = false;
    double bound = INFINITY;
    uz_status status = uz_bound_body_make(&g->body, model, scene, err);
    for (int64_t k = 0; k < scene->n_contacts && result->place && status == UZ_OK && !*g->body.why; k++)
        if (scene->contacts[k].kind != UZ_OBSTACLE_PLANE)
            snprintf(g->body.why, sizeof g->body.why,
                     "gaps of the answer are those where the body has gone; they are proved with fixed kinematics");
    if (status == UZ_OK && g->body.n_loose > 0 && !*g->body.why) {
        double *pressure = press_at_nodes(result);
        status = hold(g, pressure, err);
        free(pressure);
    }
    if (status != UZ_OK || *g->body.why) {
        snprintf(out->why, sizeof out->why, "%s", g->body.why);
        return status;
    }
    const bool closer = wants_closer(g, result->u), sides = g->body.degree > 1 || g->body.n_segments > 0,
               first = closer && sides && result->evaluation->n_quantities == 0 && !scene->refine;
    status = uz_lift_out(g, &answer, err);
    if (status == UZ_OK && first)
        status = prove_closer(out, &narrow, result, g, scene, err);
    if (status == UZ_OK && !narrow)
        status = prove_own(out, &bound, g, result->u, scene, err);
    if (status == UZ_OK && closer && !first && bound > 0 && !is_fine(g, &result->summary, bound))
        status = prove_closer(out, &narrow, result, g, scene, err);
    return status;
}

void uz_add_share(uz_evaluation *evaluation, int64_t n, const double *of)
{
    double sum = 0;
    for (int64_t i = 0; i < n; i++)
        sum += of[i];
    for (int64_t i = 0; i < n && evaluation->share && sum > 0; i++)
        evaluation->share[i] += of[i] / sum;
}

/* For the next mesh: which elements have what of the gap. */
static uz_status share_gap(uz_result *result, const uz_guaranteed *g, uz_error *err)
{
    const int64_t n = g->body.model->mesh.n_elements;
    free(result->evaluation->share);
    result->evaluation->share = uz_alloc_zero(n, sizeof(double));
    if (!result->evaluation->share)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the errors of %lld elements", (long long)n);
    uz_add_share(result->evaluation, n, g->shown->local);
    return UZ_OK;
}

static void guarantee_answer(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                             const uz_hooks *hooks, double started)
{
    const double began = uz_seconds();
    uz_summary *s = &result->summary;
    uz_guarantee *out = &s->guarantee;
    uz_body_model model = {.d = 0};
    uz_error err = {0};
    uz_guaranteed g = {.problem = problem, .settings = settings, .cache = cache, .rho = INFINITY};
    g.hooks.ctx = hooks ? hooks->ctx : NULL;
    g.hooks.cancelled = hooks ? hooks->cancelled : NULL;
    g.stop = (uz_stop){&g.hooks, started + settings->time_limit_s};
    *out = (uz_guarantee){.asked = true, .bound = INFINITY, .relative = INFINITY, .primal = NAN, .dual = NAN};
    if (!result->evaluation) {
        snprintf(out->why, sizeof out->why, "there is no answer to bound the error of");
        return;
    }
    uz_cache *own_cache = cache ? NULL : uz_cache_new(SIZE_MAX); /* both of its problems have one K */
    g.cache = cache ? cache : own_cache;
    uz_status status = uz_body_model_build(&model, &problem->scene, UZ_BODY_OUTLINE, &err);
    if (status == UZ_OK) {
        out->straightened = uz_bound_straighten(&model.mesh);
        status = prove(result, &g, &model, &problem->scene, &err);
    }
    const double whole = s->certificate.energy_norm;
    if (out->proved && !isfinite(out->relative) && s->discretization_error == 0 && out->bound < whole)
        out->relative = out->bound / (whole - out->bound); /* it is carried along: as the certificate's error */
    const bool own = g.shown != NULL;                      /* else nothing is proved, or by a closer mesh alone */
    if (status == UZ_OK && own && problem->scene.refine)
        status = share_gap(result, &g, &err);
    if (status == UZ_OK && own && result->evaluation->n_quantities > 0)
        status = uz_bound_keep_maps(&g.body, &g.stop, &err);
    if (status == UZ_OK && own)
        status = uz_prove_quantities(result, &g, &err);
    clear(&g);
    uz_body_model_clear(&model);
    uz_cache_free(own_cache);
    if (status != UZ_OK) /* the answer is there, and stays */
        snprintf(out->why, sizeof out->why, "%.150s",
                 uz_stop_is_due(&g.stop) ? "it was stopped before the bound was made" : err.message);
    for (int64_t i = 0; i < result->evaluation->n_quantities; i++) {
        uz_quantity_found *q = &result->evaluation->quantities[i];
        if (!q->guaranteed && !*q->unproved)
            snprintf(q->unproved, sizeof q->unproved, "%s",
                     own           ? "it was stopped before it was proved, or had no memory"
                     : out->proved ? "the whole error is guaranteed by a finer mesh, not by the answer's own"
                                   : "the whole error is not guaranteed (error.why)");
    }
    out->seconds = uz_seconds() - began;
    s->timings.total += out->seconds;
    s->timings.certify += out->seconds;
}

void uz_judge_whole_error(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started)
{
    uz_summary *s = &result->summary;
    if (problem->kind != UZ_PROBLEM_SCENE)
        return;
    if (settings->guaranteed)
        guarantee_answer(result, problem, settings, cache, hooks, started);
    const double total = uz_total_error(NULL, s);
    const bool unproved = s->guarantee.asked && !s->guarantee.proved;
    if (!(settings->total_error > 0) || s->outcome != UZ_CONVERGED || (total <= settings->total_error && !unproved))
        return;
    s->outcome = UZ_MESH_LIMIT;
    s->requested_error = settings->total_error;
    if (unproved)
        snprintf(s->message, sizeof s->message, "the whole error, about %.3g, is not guaranteed: %s", total,
                 s->guarantee.why);
    else if (s->guarantee.proved && !isfinite(total))
        snprintf(s->message, sizeof s->message,
                 "on this mesh the whole error, at most %.3g in the energy norm, may be all of the answer; asked for "
                 "%.3g of it: refine it, or let the cells be chosen",
                 s->guarantee.bound, settings->total_error);
    else
        snprintf(s->message, sizeof s->message,
                 "on this mesh the whole error is %s %.3g, asked for %.3g: refine it, or let the cells be chosen",
                 s->guarantee.proved ? "at most" : "about", total, settings->total_error);
}
