/* fields.c: what an answer means, computed from the scene, the displacements and the reactions. */
#include "post/evaluate.h"
#include "post/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    uz_field field;
    const char *name;
} NAMES[] = {
    {UZ_FIELD_PRESSURE, "pressure"},
    {UZ_FIELD_CONTACT_STATUS, "contact_status"},
    {UZ_FIELD_STRESS, "stress"},
    {UZ_FIELD_PRINCIPAL, "principal"},
    {UZ_FIELD_VON_MISES, "von_mises"},
    {UZ_FIELD_STRAIN, "strain"},
    {UZ_FIELD_STRESS_GAUSS, "stress_gauss"},
    {UZ_FIELD_DISPLACEMENTS, "displacements"},
    {UZ_FIELD_REACTIONS, "reactions"},
    {UZ_FIELD_GAPS, "gaps"},
    {UZ_FIELD_MATERIALS, "materials"},
};
enum { N_NAMES = sizeof NAMES / sizeof NAMES[0] };

const char *uz_field_name(uz_field field)
{
    for (int i = 0; i < N_NAMES; i++)
        if (NAMES[i].field == field)
            return NAMES[i].name;
    return "unknown";
}

bool uz_field_parse(uz_field *out, const char *name, size_t len)
{
    for (int i = 0; i < N_NAMES; i++)
        if (strlen(NAMES[i].name) == len && memcmp(NAMES[i].name, name, len) == 0) {
            *out = NAMES[i].field;
            return true;
        }
    return false;
}

const char *const *uz_field_components(int dim)
{
    static const char *const PLANE[] = {"xx", "yy", "zz", "xy"}, *const SPACE[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
    return dim == 2 ? PLANE : SPACE;
}

void uz_fields_clear(uz_fields *fields)
{
    if (!fields)
        return;
    uz_free_all(fields->pressure, fields->contact_status, fields->stress, fields->principal, fields->von_mises,
                fields->strain, fields->gauss_element, fields->gauss_point, fields->gauss_stress);
    memset(fields, 0, sizeof *fields);
}

/* ---- principal stresses and von Mises' equivalent; components: xx yy zz xy [yz zx] */

/* One rotation of Jacobi's method that makes A[p][q] zero (Golub and Van Loan, Matrix Computations, 8.5). */
static void rotate(double A[3][3], int p, int q)
{
    const int r = 3 - p - q;
    if (A[p][q] == 0)
        return;
    const double theta = 0.5 * (A[q][q] - A[p][p]) / A[p][q];
    const double t = copysign(1, theta) / (fabs(theta) + hypot(1, theta)), c = 1 / hypot(1, t), s = t * c;
    const double rp = A[r][p], rq = A[r][q];
    A[p][p] -= t * A[p][q];
    A[q][q] += t * A[p][q];
    A[p][q] = A[q][p] = 0;
    A[r][p] = A[p][r] = c * rp - s * rq;
    A[r][q] = A[q][r] = s * rp + c * rq;
}

void uz_principal(double principal[3], const double *stress, int components)
{
    enum { SWEEPS = 12 };
    if (components == 4) {
        const double mean = 0.5 * (stress[0] + stress[1]), radius = hypot(0.5 * (stress[0] - stress[1]), stress[3]);
        principal[0] = mean + radius;
        principal[1] = mean - radius;
        principal[2] = stress[2];
    } else {
        double A[3][3] = {
            {stress[0], stress[3], stress[5]}, {stress[3], stress[1], stress[4]}, {stress[5], stress[4], stress[2]}};
        const double size =
            fabs(A[0][0]) + fabs(A[1][1]) + fabs(A[2][2]) + fabs(A[0][1]) + fabs(A[1][2]) + fabs(A[2][0]);
        for (int sweep = 0; sweep < SWEEPS; sweep++) {
            if (!(fabs(A[0][1]) + fabs(A[1][2]) + fabs(A[2][0]) > DBL_EPSILON * DBL_EPSILON * size))
                break;
            rotate(A, 0, 1);
            rotate(A, 0, 2);
            rotate(A, 1, 2);
        }
        for (int i = 0; i < 3; i++)
            principal[i] = A[i][i];
    }
    /* The largest first. */
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (principal[j] < principal[j + 1]) {
                const double larger = principal[j + 1];
                principal[j + 1] = principal[j];
                principal[j] = larger;
            }
}

double uz_von_mises(const double *s, int components)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    double shear = s[3] * s[3];
    if (components == 6)
        shear += s[4] * s[4] + s[5] * s[5];
    return sqrt(0.5 * (a * a + b * b + c * c) + 3 * shear);
}

/* ---- the fields */

/* Room for what is wanted; UZ_OK leaves the others NULL. */
static uz_status make_room(double **out, bool wanted, int64_t count, int components, uz_error *err)
{
    if (wanted && !(*out = uz_alloc_zero(count * components, sizeof **out)))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a field of %lld numbers",
                       (long long)count * (long long)components);
    return UZ_OK;
}

static const unsigned OF_STRESS = UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL | UZ_FIELD_VON_MISES;

static uz_status nodal_fields(uz_fields *out, const uz_field_body *body, const double *u, unsigned which,
                              const uz_hooks *hooks, uz_error *err)
{
    const int components = out->components;
    uz_status status = make_room(&out->stress, which & OF_STRESS, out->n_nodes, components, err);
    if (status == UZ_OK)
        status = make_room(&out->strain, which & UZ_FIELD_STRAIN, out->n_nodes, components, err);
    if (status == UZ_OK)
        status = make_room(&out->principal, which & UZ_FIELD_PRINCIPAL, out->n_nodes, 3, err);
    if (status == UZ_OK)
        status = make_room(&out->von_mises, which & UZ_FIELD_VON_MISES, out->n_nodes, 1, err);
    if (status == UZ_OK && (out->stress || out->strain))
        status = uz_field_recover(out->stress, out->strain, body, u, hooks, err);
    if (status != UZ_OK)
        return status;
    for (int64_t a = 0; out->principal && a < out->n_nodes; a++)
        uz_principal(out->principal + 3 * a, out->stress + a * components, components);
    for (int64_t a = 0; out->von_mises && a < out->n_nodes; a++)
        out->von_mises[a] = uz_von_mises(out->stress + a * components, components);
    if (!(which & UZ_FIELD_STRESS)) {
        free(out->stress);
        out->stress = NULL;
    }
    return UZ_OK;
}

/* Per area where the body is: before anything moves, but of finite kinematics. */
static uz_status pressure_of(double *pressure, const uz_field_body *body, const uz_field_source *answer, uz_error *err)
{
    uz_body_model displaced;
    if (!uz_is_finite_answer(body->scene) || !answer->u)
        return uz_contact_pressure(pressure, body->model, body->scene, answer->r, err);
    uz_status status = uz_displaced(&displaced, body->model, answer->u, err);
    if (status != UZ_OK)
        return status;
    status = uz_contact_pressure(pressure, &displaced, body->scene, answer->r, err);
    free(displaced.mesh.xyz);
    return status;
}

static const unsigned OF_BODY = OF_STRESS | UZ_FIELD_STRAIN | UZ_FIELD_STRESS_GAUSS | UZ_FIELD_DISPLACEMENTS;
static const unsigned OF_CONTACT = UZ_FIELD_PRESSURE | UZ_FIELD_CONTACT_STATUS | UZ_FIELD_REACTIONS;

uz_status uz_fields_of_body(uz_fields *out, const uz_field_body *body, const uz_field_source *answer, unsigned which,
                            const uz_hooks *hooks, uz_error *err)
{
    const uz_body_model *model = body->model;
    memset(out, 0, sizeof *out);
    const int64_t n_u = model->mesh.n_nodes * model->mesh.dim, m = model->m;
    if (which & OF_BODY && (!answer->u || answer->n_u != n_u))
        return uz_fail(err, UZ_ERR_SIZE, "u", "the fields of the body need %lld displacements", (long long)n_u);
    if (which & OF_CONTACT && m > 0 && (!answer->r || answer->m != m))
        return uz_fail(err, UZ_ERR_SIZE, "r", "the fields of the contact need %lld reactions", (long long)m);
    if (which & UZ_FIELD_GAPS && m > 0 && (!answer->g || answer->m != m))
        return uz_fail(err, UZ_ERR_SIZE, "g", "the fields of the contact need %lld gaps", (long long)m);
    out->dim = model->mesh.dim;
    out->components = body->components;
    out->n_nodes = model->mesh.n_nodes;
    out->n_elements = model->mesh.n_elements;
    out->m = m;
    uz_status status = make_room(&out->pressure, which & UZ_FIELD_PRESSURE, m, 1, err);
    if (status == UZ_OK)
        status = make_room(&out->contact_status, which & UZ_FIELD_CONTACT_STATUS, m, 1, err);
    if (status == UZ_OK && out->pressure)
        status = pressure_of(out->pressure, body, answer, err);
    for (int64_t i = 0; status == UZ_OK && out->contact_status && i < m; i++)
        out->contact_status[i] = (double)model->law->kind->active(model->law, NULL, &answer->r[i], 1);
    if (status == UZ_OK)
        status = nodal_fields(out, body, answer->u, which, hooks, err);
    const bool gauss = which & UZ_FIELD_STRESS_GAUSS;
    if (status == UZ_OK && gauss) {
        out->n_points = uz_field_gauss_count(body);
        status = make_room(&out->gauss_element, true, out->n_points, 1, err);
    }
    if (status == UZ_OK && gauss)
        status = make_room(&out->gauss_point, true, out->n_points, out->dim, err);
    if (status == UZ_OK && gauss)
        status = make_room(&out->gauss_stress, true, out->n_points, out->components, err);
    if (status == UZ_OK && gauss)
        status = uz_field_gauss(out->gauss_element, out->gauss_point, out->gauss_stress, body, answer->u, hooks, err);
    if (status != UZ_OK)
        uz_fields_clear(out);
    return status;
}

uz_status uz_fields_compute(uz_fields *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                            const uz_hooks *hooks, uz_error *err)
{
    uz_body_model model;
    uz_field_body body = {.scene = scene};
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    if (status == UZ_OK)
        status = uz_fields_of_body(out, &body, answer, which, hooks, err);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    return status;
}
