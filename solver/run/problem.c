/* problem.c: checks on a problem, and its load cases one by one. */
#include "run/problem.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *uz_quantity_place(char where[UZ_QUANTITY_POINTER], const uz_problem *problem, int64_t i, const char *key)
{
    if (problem->quantities[i].asked)
        snprintf(where, UZ_QUANTITY_POINTER, "/solver/accuracy/%s", key);
    else
        snprintf(where, UZ_QUANTITY_POINTER, "/quantities/%lld/%s", (long long)i - problem->quantities[0].asked, key);
    return where;
}

/* Is there something of this name that a quantity of this kind is of? */
static bool has_name(const uz_scene *scene, uz_quantity_kind kind, const char *on)
{
    static const char *const SIDES[] = {"left", "right", "bottom", "top", "back", "front"};
    bool there = false;
    const bool given = scene->source == UZ_MESH_GIVEN;
    switch (kind) {
    case UZ_QUANTITY_REACTION:
        for (int64_t i = 0; i < scene->n_supports; i++)
            there = there || strcmp(scene->supports[i].on, on) == 0;
        return there;
    case UZ_QUANTITY_DISPLACEMENT:
        for (int i = 0; i < 2 * scene->box.dim && !given; i++)
            there = there || strcmp(SIDES[i], on) == 0;
        for (int64_t i = 0; i < scene->given.n_groups && given; i++)
            there = there || strcmp(scene->given.groups[i].name, on) == 0;
        for (int64_t i = 0; i < scene->n_selections; i++)
            there = there || strcmp(scene->selections[i].name, on) == 0;
        return there || strcmp(on, "all") == 0 || (given && strcmp(on, "boundary") == 0);
    case UZ_QUANTITY_CONTACT_FORCE:
    case UZ_QUANTITY_MEAN_PRESSURE:
        for (int64_t i = 0; i < scene->n_contacts; i++)
            there = there || !on[0] || strcmp(scene->contacts[i].on, on) == 0;
        return there;
    default:
        return true;
    }
}

/* The names that has_name knows, as far as there is room: `there are "top" and "bottom"`, quoted and with commas. */
static void list_names(char *out, size_t size, const uz_scene *scene, uz_quantity_kind kind)
{
    const bool support = kind == UZ_QUANTITY_REACTION, contact = !support && kind != UZ_QUANTITY_DISPLACEMENT;
    const int64_t count = support ? scene->n_supports : contact ? scene->n_contacts : scene->given.n_groups;
    size_t used = 0;
    *out = '\0';
    for (int64_t i = 0; i < count && used + 70 < size; i++) {
        const char *name = support   ? scene->supports[i].on
                           : contact ? scene->contacts[i].on
                                     : scene->given.groups[i].name;
        bool told = !name[0];
        for (int64_t j = 0; j < i && !told; j++)
            told = strcmp(name, support   ? scene->supports[j].on
                                : contact ? scene->contacts[j].on
                                          : scene->given.groups[j].name) == 0;
        if (!told)
            used += (size_t)snprintf(out + used, size - used, "%s\"%.63s\"", used ? ", " : "; there is ", name);
    }
}

static uz_status check_quantity(const uz_problem *problem, int64_t i, uz_error *err)
{
    const uz_quantity *q = &problem->quantities[i];
    const uz_scene *scene = &problem->scene;
    const bool contact = q->kind == UZ_QUANTITY_CONTACT_FORCE || q->kind == UZ_QUANTITY_MEAN_PRESSURE;
    char where[UZ_QUANTITY_POINTER], names[200];
    if (problem->kind != UZ_PROBLEM_SCENE)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/quantities", "quantities are of scenes");
    if (contact && scene->n_contacts == 0)
        return uz_fail(err, UZ_ERR_SCENE, uz_quantity_place(where, problem, i, "quantity"),
                       "the scene has no contacts that it could be of: give it some, or leave the quantity out");
    if (!has_name(scene, q->kind, q->on)) {
        list_names(names, sizeof names, scene, q->kind);
        return uz_fail(err, UZ_ERR_SCENE, uz_quantity_place(where, problem, i, "on"), "no %s \"%.63s\"%s",
                       contact                           ? "contact is on"
                       : q->kind == UZ_QUANTITY_REACTION ? "support is on"
                                                         : "group is called",
                       q->on, names);
    }
    if (q->kind == UZ_QUANTITY_REACTION && scene->model == UZ_AXISYMMETRIC && q->direction[0] != 0)
        return uz_fail(err, UZ_ERR_SCENE, uz_quantity_place(where, problem, i, "direction"),
                       "around a ring what acts along the radius sums to nothing: use [0, 1]");
    for (int64_t j = 0; j < i; j++)
        if (strcmp(problem->quantities[j].name, q->name) == 0)
            return uz_fail(err, UZ_ERR_SCENE, uz_quantity_place(where, problem, i, "name"),
                           "another quantity is called \"%.63s\": give each a name of its own", q->name);
    return UZ_OK;
}

int64_t uz_case_before(const uz_problem *problem, int64_t i)
{
    int64_t before = i;
    while (--before >= 0 && strcmp(problem->cases[before].name, problem->cases[i].after) != 0)
        continue;
    return before;
}

static uz_status check_path(const uz_problem *problem, int64_t i, uz_error *err)
{
    const uz_load_case *one = &problem->cases[i];
    const bool finite = problem->kind == UZ_PROBLEM_SCENE && problem->scene.kinematics == UZ_KINEMATICS_FINITE;
    if (!one->after[0] && !one->has_part)
        return UZ_OK;
    if (!finite)
        return uz_fail(err, UZ_ERR_SCENE, one->after[0] ? "/after" : "/part",
                       "paths of loads are those of the kinematics \"finite\"; use these, or give the case its loads");
    if (one->has_part && !isfinite(one->part))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "/part", "not a finite number");
    if (one->after[0] && uz_case_before(problem, i) < 0)
        return uz_fail(err, UZ_ERR_SCENE, "/after",
                       "no case before this one is called \"%.63s\": name one that stands earlier in the list",
                       one->after);
    return UZ_OK;
}

uz_status uz_check_problem(const uz_problem *problem, uz_error *err)
{
    if (problem->n_cases < 0 || (problem->n_cases > 0 && !problem->cases))
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "the problem's load cases are missing");
    uz_status status = problem->kind == UZ_PROBLEM_MATRICES ? uz_qp_check(&problem->qp, err) : UZ_OK;
    const bool scene = problem->kind == UZ_PROBLEM_SCENE;
    for (int64_t i = 0; status == UZ_OK && i < problem->n_quantities; i++)
        status = check_quantity(problem, i, err);
    for (int64_t i = 0; status == UZ_OK && i < problem->n_cases; i++) {
        const uz_load_case *one = &problem->cases[i];
        status = check_path(problem, i, err);
        if (status != UZ_OK) {
            uz_error_name_case(err, problem, i);
            break;
        }
        if (scene ? one->p || one->h : one->loads != NULL)
            status = uz_fail(err, UZ_ERR_ARGUMENT, "", "%s",
                             scene ? "a load case of a scene has loads, not p or h"
                                   : "a load case of a problem in matrices has p and h, not loads");
        if (status == UZ_OK)
            status = uz_check_finite(one->p, problem->qp.K.cols, "p", err);
        if (status == UZ_OK)
            status = uz_check_finite(one->h, problem->qp.N.rows, "h", err);
        if (status != UZ_OK)
            uz_error_name_case(err, problem, i);
    }
    return status;
}

void uz_error_name_case(uz_error *err, const uz_problem *problem, int64_t i)
{
    char prefix[32];
    if (!err)
        return;
    bool pointer = err->where[0] == '/' || err->where[0] == '\0';
    size_t length = (size_t)snprintf(prefix, sizeof prefix, "/cases/%lld%s", (long long)(i - problem->cases[i].surplus),
                                     pointer ? "" : "/");
    memmove(err->where + length, err->where, sizeof err->where - length);
    memcpy(err->where, prefix, length);
    err->where[sizeof err->where - 1] = '\0';
}

uz_scene uz_scene_of_case(const uz_problem *problem, int64_t i)
{
    uz_scene scene = problem->scene;
    if (i >= 0 && i < problem->n_cases && problem->cases[i].loads) {
        scene.loads = problem->cases[i].loads;
        scene.n_loads = problem->cases[i].n_loads;
    }
    return scene;
}

bool uz_is_mesh_chosen(const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    return problem->kind == UZ_PROBLEM_SCENE &&
           (scene->refine || (scene->source == UZ_MESH_BOX && scene->box.automatic));
}

uz_problem uz_problem_of_case(const uz_problem *problem, int64_t i)
{
    uz_problem one = *problem;
    one.cases = NULL;
    one.n_cases = 0;
    one.scene = uz_scene_of_case(problem, i);
    if (problem->n_cases > 0 && problem->cases[i].p)
        one.qp.p = problem->cases[i].p;
    if (problem->n_cases > 0 && problem->cases[i].h)
        one.qp.h = problem->cases[i].h;
    return one;
}

void uz_problem_clear(uz_problem *problem)
{
    if (!problem)
        return;
    if (problem->kind == UZ_PROBLEM_SCENE)
        uz_scene_clear(&problem->scene);
    else
        uz_qp_clear(&problem->qp);
    for (int64_t i = 0; problem->cases && i < problem->n_cases; i++)
        uz_free_all(problem->cases[i].p, problem->cases[i].h, problem->cases[i].loads);
    uz_free_all(problem->cases, problem->quantities);
    memset(problem, 0, sizeof *problem);
}
