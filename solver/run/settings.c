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
};

#define COUNT(table) (sizeof(table) / sizeof((table)[0]))

static const char *name_at(const char *const *table, size_t count, unsigned value)
{
    return value < count ? table[value] : "unknown";
}

/* The index of the name in the table, or -1. */
static int find_name(const char *const *table, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(table[i], name) == 0)
            return (int)i;
    return -1;
}

const char *uz_operator_name(uz_operator value)
{
    return name_at(OPERATORS, COUNT(OPERATORS), (unsigned)value);
}

const char *uz_kinematics_name(uz_kinematics value)
{
    return name_at(KINEMATICS, COUNT(KINEMATICS), (unsigned)value);
}

const char *uz_quantity_name(uz_quantity_kind value)
{
    return name_at(QUANTITIES, COUNT(QUANTITIES), (unsigned)value);
}

const char *uz_ordering_name(uz_ordering value)
{
    return name_at(ORDERINGS, COUNT(ORDERINGS), (unsigned)value);
}

const char *uz_stopping_name(uz_stopping value)
{
    return name_at(STOPPINGS, COUNT(STOPPINGS), (unsigned)value);
}

const char *uz_row_scaling_name(uz_row_scaling value)
{
    return name_at(ROW_SCALINGS, COUNT(ROW_SCALINGS), (unsigned)value);
}

const char *uz_outcome_name(uz_outcome value)
{
    return name_at(OUTCOMES, COUNT(OUTCOMES), (unsigned)value);
}

bool uz_operator_parse(uz_operator *out, const char *name)
{
    int found = find_name(OPERATORS, COUNT(OPERATORS), name);
    if (found >= 0)
        *out = (uz_operator)found;
    return found >= 0;
}

bool uz_quantity_parse(uz_quantity_kind *out, const char *name)
{
    int found = find_name(QUANTITIES, COUNT(QUANTITIES), name);
    if (found >= 0)
        *out = (uz_quantity_kind)found;
    return found >= 0;
}

bool uz_ordering_parse(uz_ordering *out, const char *name)
{
    int found = find_name(ORDERINGS, COUNT(ORDERINGS), name);
    if (found >= 0)
        *out = (uz_ordering)found;
    return found >= 0;
}

bool uz_stopping_parse(uz_stopping *out, const char *name)
{
    int found = find_name(STOPPINGS, COUNT(STOPPINGS), name);
    if (found >= 0)
        *out = (uz_stopping)found;
    return found >= 0;
}

bool uz_row_scaling_parse(uz_row_scaling *out, const char *name)
{
    int found = find_name(ROW_SCALINGS, COUNT(ROW_SCALINGS), name);
    if (found >= 0)
        *out = (uz_row_scaling)found;
    return found >= 0;
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

/* An enumerator that has a name. */
static bool is_known(const char *name)
{
    return strcmp(name, "unknown") != 0;
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
    if (s->method >= UZ_METHOD_GIVEN || !is_known(uz_method_name(s->method)) || !is_known(uz_operator_name(s->op)) ||
        !is_known(uz_ordering_name(s->ordering)) || !is_known(uz_stopping_name(s->stopping)) ||
        !is_known(uz_row_scaling_name(s->row_scaling)))
        return uz_fail(err, UZ_ERR_ARGUMENT, "",
                       "method, operator, ordering, stopping or row_scaling is not one of the known ones");
    return UZ_OK;
}

double uz_requested_error(const uz_settings *settings)
{
    return settings->relative_error > 0.0 ? settings->relative_error : UZ_EXACT_RELATIVE_ERROR;
}

void uz_balance_request(double *requested, const uz_body_model *model, const uz_scene *scene, const double *u,
                        const double *prescribed, int exponent)
{
    const int64_t count = model->mesh.n_nodes * model->mesh.dim;
    double *nodal = uz_alloc(count, sizeof *nodal);
    if (!nodal)
        return;
    uz_recover_nodal(nodal, model, u, prescribed);
    for (int64_t i = 0; exponent != 0 && i < count; i++)
        nodal[i] = ldexp(nodal[i], -exponent);
    double share;
    const double mesh = uz_estimate_mesh_error(NULL, &share, model, scene, nodal);
    free(nodal);
    if (mesh > 0.0 && isfinite(mesh))
        *requested = fmin(1.0, fmax(UZ_EXACT_RELATIVE_ERROR, 0.1 * mesh * share));
}
