/* problems.c: the paper's body, cases in folders, and generated families: rank-deficient, degenerate, near-singular. */
#include "core/alloc.h"
#include "peers/lab.h"
#include "qp_fixture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------------ scenes */

static bool paper_scene(uz_scene *s, int64_t nx)
{
    memset(s, 0, sizeof *s);
    s->model = UZ_PLANE_STRESS;
    s->thickness = 5.0;
    s->box = (uz_box){.size = {60.0, 20.0}, .cells = {nx, nx / 3}, .grading = {1, 1}, .element = "quad4", .dim = 2};
    s->materials = uz_alloc_zero(1, sizeof *s->materials);
    s->supports = uz_alloc_zero(1, sizeof *s->supports);
    s->loads = uz_alloc_zero(2, sizeof *s->loads);
    s->contacts = uz_alloc_zero(1, sizeof *s->contacts);
    if (!s->materials || !s->supports || !s->loads || !s->contacts) {
        uz_scene_clear(s);
        return false;
    }
    s->n_materials = s->n_supports = s->n_contacts = 1;
    s->n_loads = 2;
    s->materials[0] = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3};
    s->supports[0] = (uz_support){.on = "left", .u = {0, 0, NAN}};
    s->loads[0] = (uz_load){.on = "top", .v = {0, -0.05}};
    s->loads[1] = (uz_load){.on = "right", .v = {0.5, 0}};
    s->contacts[0] = (uz_contact){.on = "bottom", .normal = {0, 1}};
    return true;
}

bool lab_scene(uz_scene *out, const char *name)
{
    long long nx;
    return sscanf(name, "body/%lld", &nx) == 1 && nx >= 3 && paper_scene(out, nx);
}

static uz_status body_problem(uz_qp *out, const char *name, uz_error *err)
{
    uz_scene scene;
    uz_mesh_info info;
    if (!lab_scene(&scene, name))
        return UZ_ERR_ARGUMENT;
    uz_status status = uz_scene_to_qp(out, &info, &scene, err);
    if (status == UZ_OK)
        uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
    return status;
}

/* ----------------------------------------------------------------- folders */

static char *read_text(size_t *len, const char *cases, const char *name, const char *part)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s/%s.mtx", cases, name, part);
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    *len = 0;
    if (file && fseek(file, 0, SEEK_END) == 0 && (text = uz_alloc(ftell(file), 1)) != NULL) {
        *len = (size_t)ftell(file);
        rewind(file);
        *len = fread(text, 1, *len, file);
    }
    if (file)
        fclose(file);
    return text;
}

static uz_status read_matrix(uz_csc *out, const char *cases, const char *name, const char *part, uz_error *err)
{
    size_t len;
    uz_mm_info info;
    char *text = read_text(&len, cases, name, part);
    uz_status status = text ? uz_mm_read(out, &info, text, len, 0, err) : UZ_ERR_IO;
    if (status == UZ_OK && *part == 'K' && info.symmetry == UZ_MM_GENERAL)
        status = uz_symmetric_lower(out, err);
    free(text);
    return status;
}

static uz_status read_vector(double **out, const char *cases, const char *name, const char *part, uz_error *err)
{
    size_t len;
    int64_t n;
    char *text = read_text(&len, cases, name, part);
    uz_status status = text ? uz_mm_read_vector(out, &n, text, len, 0, err) : UZ_ERR_IO;
    free(text);
    return status;
}

static uz_status case_problem(uz_qp *out, const char *cases, const char *name, uz_error *err)
{
    uz_status status = read_matrix(&out->K, cases, name, "K", err);
    if (status == UZ_OK)
        status = read_matrix(&out->N, cases, name, "N", err);
    if (status == UZ_OK)
        status = read_vector(&out->h, cases, name, "h", err);
    if (status == UZ_OK)
        status = read_vector(&out->p, cases, name, "p", err);
    return status == UZ_OK ? uz_qp_check(out, err) : status;
}

/* --------------------------------------------------------------- generated */

/* Each row of N three times, with factors that are no powers of two: the rank is a third of the rows. */
static uz_status repeat_rows(uz_qp *qp, uz_error *err)
{
    static const double factor[] = {1.0, 0.3, 7.0};
    int64_t m = qp->N.rows, nnz = qp->N.ptr[qp->N.cols], at = 0;
    double *h = vector(3 * m);
    uz_csc N;
    uz_status status = uz_csc_init(&N, 3 * m, qp->N.cols, 3 * nnz, err);
    for (int64_t j = 0; status == UZ_OK && j < qp->N.cols; j++) {
        for (int copy = 0; copy < 3; copy++)
            for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++, at++) {
                N.idx[at] = (int32_t)(copy * m + qp->N.idx[k]);
                N.val[at] = factor[copy] * qp->N.val[k];
            }
        N.ptr[j + 1] = at;
    }
    for (int64_t i = 0; i < 3 * m; i++)
        h[i] = factor[i / m] * qp->h[i % m];
    uz_csc_clear(&qp->N);
    free(qp->h);
    qp->N = N;
    qp->h = h;
    return status;
}

static uz_status dependent_body(uz_qp *out, double nx, uz_error *err)
{
    char name[32];
    snprintf(name, sizeof name, "body/%.0f", nx);
    uz_status status = body_problem(out, name, err);
    return status == UZ_OK ? repeat_rows(out, err) : status;
}

/* Every third row repeats the one before at another scale; dense to half. */
static uz_status dependent_random(uz_qp *out, double d, uz_error *err)
{
    qp_random rng = {11};
    (void)err;
    *out = random_qp(&rng, &(qp_kind){.d = (int64_t)d, .m = (int64_t)(0.75 * d), .condition = 1e4, .dependent = true});
    return UZ_OK;
}

/* A chain of d springs, the first of them of stiffness `held`; a bound from above on every stride-th dof. */
static uz_status chain(uz_qp *out, int64_t d, int64_t stride, double held, uz_error *err)
{
    int64_t m = (d + stride - 1) / stride;
    uz_status status = uz_csc_init(&out->K, d, d, 2 * d - 1, err);
    if (status == UZ_OK)
        status = uz_csc_init(&out->N, m, d, m, err);
    for (int64_t j = 0, at = 0; status == UZ_OK && j < d; j++) {
        out->K.idx[at] = (int32_t)j;
        out->K.val[at++] = (j == 0 ? held : 1.0) + (j + 1 < d ? 1.0 : 0.0);
        if (j + 1 < d) {
            out->K.idx[at] = (int32_t)(j + 1);
            out->K.val[at++] = -1.0;
        }
        out->K.ptr[j + 1] = at;
        out->N.ptr[j + 1] = j / stride + 1;
    }
    for (int64_t i = 0; status == UZ_OK && i < m; i++) {
        out->N.idx[i] = (int32_t)i;
        out->N.val[i] = 1.0;
    }
    out->p = vector(d);
    out->h = vector(m);
    return status;
}

/* Built backwards: a third of the rows touch and push, a third touch without a reaction, a third are open. */
static uz_status degenerate_chain(uz_qp *out, double d, uz_error *err)
{
    qp_random rng = {3};
    uz_status status = chain(out, (int64_t)d, 1, 1.0, err);
    if (status != UZ_OK)
        return status;
    double *u = vector(out->K.cols);
    for (int64_t j = 0; j < out->K.cols; j++)
        u[j] = random_signed(&rng);
    uz_csc_symv(out->p, &out->K, 1.0, u);
    for (int64_t i = 0; i < out->N.rows; i++) {
        out->h[i] = u[i] + (i % 3 == 2 ? random_unit(&rng) : 0.0);
        out->p[i] += i % 3 == 0 ? random_unit(&rng) : 0.0; /* -N'r */
    }
    free(u);
    return UZ_OK;
}

/* Row i of N (m x d) is turned so that a way down from the vertex leads inside. */
static void turn_row(double *row, const double *inside, int64_t d)
{
    double along = 0;
    for (int64_t j = 0; j < d; j++)
        along += row[j] * inside[j];
    for (int64_t j = 0; along > 0 && j < d; j++)
        row[j] = -row[j];
}

/* 3 d rows through one point in d dimensions, the apex of a cone; a sixth of them with a reaction. */
static uz_status degenerate_vertex(uz_qp *out, double size, uz_error *err)
{
    qp_random rng = {7};
    int64_t d = (int64_t)size, m = 3 * d;
    double *K = random_spd(&rng, d, 1e3, 1.0), *N = vector(m * d), *u = vector(d), *r = vector(m);
    (void)err;
    for (int64_t j = 0; j < d; j++)
        u[j] = random_signed(&rng);
    for (int64_t k = 0; k < m * d; k++)
        N[k] = random_unit(&rng) < 0.3 ? random_signed(&rng) : 0.0;
    for (int64_t i = 0; i < m; i++)
        turn_row(N + i * d, u, d);
    for (int64_t i = 0; i < m; i++)
        r[i] = i % 6 == 0 ? -random_unit(&rng) : 0.0;
    out->K = csc_from_dense(K, d, d, true);
    out->N = csc_from_dense(N, m, d, false);
    out->p = vector(d);
    out->h = vector(m);
    uz_csc_symv(out->p, &out->K, 1.0, u);
    uz_csc_gaxpy_t(out->p, &out->N, -1.0, r);
    uz_csc_gaxpy(out->h, &out->N, 1.0, u);
    free(K);
    free(N);
    free(u);
    free(r);
    return UZ_OK;
}

static void load_bounded(uz_qp *qp)
{
    for (int64_t j = 0; j < qp->K.cols; j++)
        qp->p[j] = j % 4 == 3 ? -1.0 : 1.0;
    for (int64_t i = 0; i < qp->N.rows; i++)
        qp->h[i] = 0.5;
}

static uz_status weakly_held(uz_qp *out, double spring, uz_error *err)
{
    uz_status status = chain(out, 300, 3, spring, err);
    if (status == UZ_OK)
        load_bounded(out);
    return status;
}

static uz_status ill_conditioned(uz_qp *out, double condition, uz_error *err)
{
    enum { D = 120 };
    qp_random rng = {5};
    uz_status status = chain(out, D, 3, 1.0, err);
    if (status != UZ_OK)
        return status;
    double *K = random_spd(&rng, D, condition, 1.0);
    uz_csc_clear(&out->K);
    out->K = csc_from_dense(K, D, D, true);
    load_bounded(out);
    free(K);
    return UZ_OK;
}

static const struct {
    const char *name;
    uz_status (*make)(uz_qp *out, double parameter, uz_error *err);
    double parameter;
} generated[] = {
    {"rank_deficient/body_30", dependent_body, 30},     {"rank_deficient/body_60", dependent_body, 60},
    {"rank_deficient/random_40", dependent_random, 40}, {"rank_deficient/random_200", dependent_random, 200},
    {"degenerate/chain_300", degenerate_chain, 300},    {"degenerate/chain_3000", degenerate_chain, 3000},
    {"degenerate/vertex_20", degenerate_vertex, 20},    {"degenerate/vertex_100", degenerate_vertex, 100},
    {"near_singular/spring_1e-6", weakly_held, 1e-6},   {"near_singular/spring_1e-10", weakly_held, 1e-10},
    {"near_singular/random_1e8", ill_conditioned, 1e8}, {"near_singular/random_1e12", ill_conditioned, 1e12}};

const char *lab_generated_name(int which)
{
    return which < (int)(sizeof generated / sizeof *generated) ? generated[which].name : NULL;
}

uz_status lab_problem(uz_qp *out, const char *name, const char *cases, uz_error *err)
{
    memset(out, 0, sizeof *out);
    if (strncmp(name, "body/", 5) == 0)
        return body_problem(out, name, err);
    if (strncmp(name, "cases/", 6) == 0)
        return case_problem(out, cases, name + 6, err);
    for (size_t k = 0; k < sizeof generated / sizeof *generated; k++)
        if (strcmp(name, generated[k].name) == 0)
            return generated[k].make(out, generated[k].parameter, err);
    return UZ_ERR_ARGUMENT;
}
