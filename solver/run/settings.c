/* settings.c: defaults, the names of choices and outcomes, and what is wrong with settings. */
#include "run/settings.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const OPERATORS[] = {
    [UZ_OPERATOR_AUTO] = "auto",
    [UZ_OPERATOR_CONDENSED] = "condensed",
    [UZ_OPERATOR_FACTORED] = "factored",
    [UZ_OPERATOR_MATRIX_FREE] = "matrix_free",
    [UZ_OPERATOR_DISTRIBUTED] = "distributed",
};
static const char *const ORDERINGS[] = {
    [UZ_ORDERING_AUTO] = "auto",
    [UZ_ORDERING_CAMD] = "camd",
    [UZ_ORDERING_AMD] = "amd",
    [UZ_ORDERING_METIS] = "metis",
};
static const char *const STOPPINGS[] = {
    [UZ_STOP_CERTIFIED] = "certified",
    [UZ_STOP_PAPER] = "paper",
};
static const char *const ROW_SCALINGS[] = {
    [UZ_ROW_SCALING_AUTO] = "auto",
    [UZ_ROW_SCALING_NONE] = "none",
    [UZ_ROW_SCALING_UNIT] = "unit",
};
static const char *const OUTCOMES[] = {
    [UZ_CONVERGED] = "converged",
    [UZ_ITERATION_LIMIT] = "iteration_limit",
    [UZ_TIME_LIMIT] = "time_limit",
    [UZ_PRECISION_LIMIT] = "precision_limit",
    [UZ_PAPER_RULE] = "paper_rule",
    [UZ_INFEASIBLE] = "infeasible",
    [UZ_DISMISSED] = "dismissed",
    [UZ_VERIFIED] = "verified",
    [UZ_NOT_VERIFIED] = "not_verified",
    [UZ_MESH_LIMIT] = "mesh_limit",
    [UZ_OUT_OF_REACH] = "out_of_reach",
    [UZ_LOOSE] = "loose",
    [UZ_MOVING_GEOMETRY] = "moving_geometry",
    [UZ_UNSTABLE] = "unstable",
    [UZ_INVERTED] = "inverted",
    [UZ_UNHELD] = "unheld",
};
static const char *const QUANTITIES[] = {
    [UZ_QUANTITY_CONTACT_FORCE] = "contact.force", [UZ_QUANTITY_REACTION] = "reaction",
    [UZ_QUANTITY_DISPLACEMENT] = "displacement",   [UZ_QUANTITY_MEAN_PRESSURE] = "mean_pressure",
    [UZ_QUANTITY_STRAIN_ENERGY] = "strain_energy",
};
static const char *const KINEMATICS[] = {
    [UZ_KINEMATICS_AUTO] = "auto",
    [UZ_KINEMATICS_FIXED] = "fixed",
    [UZ_KINEMATICS_MOVING] = "moving",
    [UZ_KINEMATICS_FINITE] = "finite",
};

#define COUNTED(table) table, sizeof(table) / sizeof((table)[0])

static const struct {
    const char *const *names;
    size_t count;
} CHOICES[] = {
    [UZ_CHOICE_OPERATOR] = {COUNTED(OPERATORS)},    [UZ_CHOICE_ORDERING] = {COUNTED(ORDERINGS)},
    [UZ_CHOICE_STOPPING] = {COUNTED(STOPPINGS)},    [UZ_CHOICE_ROW_SCALING] = {COUNTED(ROW_SCALINGS)},
    [UZ_CHOICE_KINEMATICS] = {COUNTED(KINEMATICS)}, [UZ_CHOICE_QUANTITY] = {COUNTED(QUANTITIES)},
    [UZ_CHOICE_OUTCOME] = {COUNTED(OUTCOMES)},
};

const char *uz_choice_name(uz_choice of, unsigned value)
{
    return value < CHOICES[of].count ? CHOICES[of].names[value] : "unknown";
}

int uz_choice_find(uz_choice of, const char *name)
{
    for (size_t i = 0; i < CHOICES[of].count; i++)
        if (strcmp(CHOICES[of].names[i], name) == 0)
            return (int)i;
    return -1;
}

uz_settings uz_settings_default(void)
{
    uz_settings settings = {
        .relative_error = 1e-8,
        .epsilon = 1e-6,
        .max_iterations = 100000,
        .time_limit_s = INFINITY,
    };
    return settings;
}

uz_status uz_check_settings(const uz_settings *s, uz_error *err)
{
    if (!(s->relative_error >= 0.0 && s->relative_error <= 1.0))
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "relative_error must lie in [0, 1], it is %g", s->relative_error);
    if (!(s->epsilon >= 0.0 && isfinite(s->epsilon)))
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "epsilon must be finite and not negative, it is %g", s->epsilon);
    if (!(s->alpha >= 0.0 && isfinite(s->alpha)))
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "alpha must be finite and not negative, it is %g", s->alpha);
    if (!(s->quantity_error >= 0.0 && s->quantity_error <= 1.0))
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "quantity_error must lie in [0, 1], it is %g", s->quantity_error);
    if (s->max_iterations < 0 || !(s->time_limit_s >= 0.0))
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "max_iterations and time_limit_s must not be negative");
    if (s->method >= UZ_METHOD_GIVEN || strcmp(uz_method_name(s->method), "unknown") == 0 ||
        (size_t)s->op >= CHOICES[UZ_CHOICE_OPERATOR].count ||
        (size_t)s->ordering >= CHOICES[UZ_CHOICE_ORDERING].count ||
        (size_t)s->stopping >= CHOICES[UZ_CHOICE_STOPPING].count ||
        (size_t)s->row_scaling >= CHOICES[UZ_CHOICE_ROW_SCALING].count)
        return uz_fail(err, UZ_ERR_ARGUMENT, "",
                       "method, operator, ordering, stopping or row_scaling is not one of the known ones");
    return UZ_OK;
}

double uz_requested_error(const uz_settings *settings)
{
    return settings->relative_error > 0.0 ? settings->relative_error : UZ_EXACT_RELATIVE_ERROR;
}

uz_status uz_balance_request(double *requested, const uz_body_model *model, const uz_scene *scene, const double *u,
                             const double *prescribed, int exponent, uz_error *err)
{
    const int64_t count = model->mesh.n_nodes * model->mesh.dim;
    double *nodal = uz_alloc(count, sizeof *nodal);
    double mesh = NAN;
    uz_mesh_look look;
    if (nodal) {
        uz_recover_nodal(nodal, model, u, prescribed);
        for (int64_t i = 0; exponent != 0 && i < count; i++)
            nodal[i] = ldexp(nodal[i], -exponent);
        mesh = uz_estimate_mesh_error(NULL, &look, model, scene, nodal);
    }
    free(nodal);
    if (isnan(mesh))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to look at what the mesh loses");
    if (mesh > 0.0 && isfinite(mesh))
        *requested = fmin(1.0, fmax(UZ_EXACT_RELATIVE_ERROR, 0.1 * mesh * look.share));
    return UZ_OK;
}
