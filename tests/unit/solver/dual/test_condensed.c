/* The dense operator from a factor with the contact last and from one with the contact anywhere: the same numbers. */
#include "core/alloc.h"
#include "dual/dual.h"
#include "dual/form.h"
#include "factor_fixture.h"
#include "harness.h"
#include "hex8.h"
#include "qp_fixture.h"

/* Every row once more: D is singular. */
static void repeat_rows(uz_qp *qp)
{
    int64_t m = qp->N.rows, nnz = qp->N.ptr[qp->N.cols], *row = calloc((size_t)(2 * nnz), sizeof *row),
            *col = calloc((size_t)(2 * nnz), sizeof *col);
    double *value = vector(2 * nnz), *h = vector(2 * m);
    uz_error err;
    for (int64_t j = 0; j < qp->N.cols; j++)
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            for (int64_t copy = 0; copy < 2; copy++) {
                row[k + copy * nnz] = qp->N.idx[k] + copy * m;
                col[k + copy * nnz] = j;
                value[k + copy * nnz] = qp->N.val[k];
                h[qp->N.idx[k] + copy * m] = qp->h[qp->N.idx[k]];
            }
    uz_csc_clear(&qp->N);
    CHECK(uz_csc_from_triplets(&qp->N, 2 * m, qp->K.cols, 2 * nnz, row, col, value, &err) == UZ_OK);
    free(qp->h);
    qp->h = h;
    uz_free_all(row, col, value);
}

static uz_qp leaning_cube(int64_t n)
{
    uz_qp qp;
    uz_error err = {0};
    CHECK(hex8_qp(&qp, n, &err) == UZ_OK && hex8_lean(&qp, &err) == UZ_OK);
    return qp;
}

typedef struct {
    uz_factor *factor;
    uz_dual *dual;
    uz_dual_load *load;
} form;

static form form_of(const uz_qp *qp, bool contact_last)
{
    form f = {0};
    int64_t *dofs = NULL, count = 0;
    uz_error err;
    CHECK(uz_dual_contact_dofs(&dofs, &count, &qp->N, &err) == UZ_OK);
    CHECK(factor_by(&f.factor, &qp->K, dofs, contact_last ? count : 0, UZ_ORDERING_AUTO, 0, &err) == UZ_OK);
    CHECK_INT(uz_factor_describe(f.factor).contact_last, contact_last);
    uz_dual_source source = {.op = UZ_OPERATOR_CONDENSED, .N = &qp->N, .factor = f.factor};
    CHECK(uz_dual_create(&f.dual, &source, NULL, &err) == UZ_OK);
    CHECK(uz_dual_load_create(&f.load, f.dual, &qp->K, qp->p, qp->h, &err) == UZ_OK);
    free(dofs);
    return f;
}

static void free_form(form *f)
{
    uz_dual_load_free(f->load);
    uz_dual_free(f->dual);
    uz_factor_free(f->factor);
}

static void check_close(const double *a, const double *b, int64_t n, double tolerance, const char *what)
{
    double worst = 0, size = 0;
    for (int64_t i = 0; i < n; i++) {
        worst = fmax(worst, fabs(a[i] - b[i]));
        size = fmax(size, fabs(b[i]));
    }
    CHECK_MSG(worst <= tolerance * size, "%s: differ by %g of %g", what, worst, size);
}

/* Gaps, the operator, a correction and the displacements, of some r <= 0. */
static void compare(const uz_qp *qp)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    form last = form_of(qp, true), any = form_of(qp, false);
    double *r = vector(m), *Dr = vector(m), *other = vector(m), *g = vector(m), *u = vector(d), *v = vector(d);
    double bound[2] = {0}, psi[2], norm2[2], lambda[2];
    bool *close = calloc((size_t)m, sizeof *close);
    uz_error err;
    for (int64_t i = 0; i < m; i++) {
        r[i] = i % 3 == 0 ? -1e-4 * (double)(i % 7) : 0;
        close[i] = r[i] < 0;
    }
    check_close(any.load->g0, last.load->g0, m, 1e-12, "g0");
    CHECK(uz_dual_load_prepare(last.load, &err) == UZ_OK &&
          uz_dual_load_lambda_max(last.load, &lambda[0], false, &err) == UZ_OK);
    CHECK(uz_dual_load_prepare(any.load, &err) == UZ_OK &&
          uz_dual_load_lambda_max(any.load, &lambda[1], false, &err) == UZ_OK);
    CHECK_REL(lambda[1], lambda[0], 1e-6);
    CHECK(uz_dual_load_apply(last.load, Dr, r, &err) == UZ_OK && uz_dual_load_apply(any.load, other, r, &err) == UZ_OK);
    check_close(other, Dr, m, 1e-12, "D r");
    uz_dual_load_energies(last.load, &psi[0], &norm2[0], r, Dr);
    uz_dual_load_energies(any.load, &psi[1], &norm2[1], r, other);
    CHECK_REL(psi[1], psi[0], 1e-12);
    CHECK_REL(norm2[1], norm2[0], 1e-12);
    for (int64_t i = 0; i < m; i++)
        g[i] = last.load->g0[i] - Dr[i];
    CHECK(uz_dual_load_correct(last.load, &bound[0], INFINITY, r, g, close, &err) == UZ_OK);
    CHECK(uz_dual_load_correct(any.load, &bound[1], INFINITY, r, g, close, &err) == UZ_OK);
    CHECK(isfinite(bound[0]) && bound[0] > 0);
    CHECK_REL(bound[1], bound[0], 0.5e-8);
    CHECK(last.load->has_kept && any.load->has_kept);
    for (int with = 0; with < 2; with++) {
        CHECK(uz_dual_load_recover(last.load, u, r, with, &err) == UZ_OK);
        CHECK(uz_dual_load_recover(any.load, v, r, with, &err) == UZ_OK);
        check_close(v, u, d, 1e-9, with ? "corrected displacements" : "displacements");
    }
    free_form(&last);
    free_form(&any);
    uz_free_all(r, Dr, other, g, u, v, close);
}

TEST(contact_last_and_contact_anywhere)
{
    uz_thread_init();
    for (int twice = 0; twice < 2; twice++) {
        uz_qp qp = leaning_cube(6);
        if (twice)
            repeat_rows(&qp);
        compare(&qp);
        uz_qp_clear(&qp);
    }
}

/* One row for each dof and the contact not last: what the trailing block would say comes from D. */
TEST(single_dofs_and_contact_anywhere)
{
    uz_qp qp;
    uz_error err = {0};
    uz_thread_init();
    CHECK(hex8_qp(&qp, 6, &err) == UZ_OK);
    compare(&qp);
    uz_qp_clear(&qp);
}

/* More dofs than rows: the solver leaves them where they are, and is right. */
TEST(leaning_normals_are_certified)
{
    uz_qp qp = leaning_cube(8);
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = qp};
    uz_settings settings = uz_settings_default();
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACTIVE_SET, UZ_METHOD_ACCELERATED_RESTART};
    double energy = NAN;
    uz_thread_init();
    for (int k = 0; k < 3; k++) {
        uz_result *result;
        uz_error err = {0};
        settings.method = methods[k];
        CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_INT(result->summary.op, UZ_OPERATOR_CONDENSED);
        CHECK(!result->summary.contact_last);
        CHECK(result->summary.active > 0);
        if (k > 0)
            CHECK_REL(result->summary.certificate.energy_dual, energy, 1e-12);
        energy = result->summary.certificate.energy_dual;
        uz_result_free(result);
    }
    uz_qp_clear(&qp);
}

/* The factor of a body whose contact is not last serves one of the same K whose rows touch nothing. */
TEST(rows_of_zeros_on_a_factor_from_the_cache)
{
    uz_problem leaning = {.kind = UZ_PROBLEM_MATRICES, .qp = leaning_cube(8)}, idle = {.kind = UZ_PROBLEM_MATRICES};
    uz_settings settings = uz_settings_default();
    uz_cache *cache = uz_cache_new((size_t)1 << 28);
    uz_result *first = NULL, *second = NULL;
    const int64_t d = leaning.qp.K.cols;
    uz_thread_init();
    CHECK_INT(uz_csc_copy(&idle.qp.K, &leaning.qp.K, NULL), UZ_OK);
    CHECK_INT(uz_csc_init(&idle.qp.N, 2, d, 0, NULL), UZ_OK);
    idle.qp.p = vector(d);
    idle.qp.h = vector(2);
    idle.qp.p[0] = idle.qp.h[0] = idle.qp.h[1] = 1;
    CHECK_INT(uz_solve(&first, &leaning, &settings, cache, NULL, NULL), UZ_OK);
    CHECK_INT(uz_solve(&second, &idle, &settings, cache, NULL, NULL), UZ_OK);
    CHECK(first && !first->summary.contact_last);
    CHECK(second && second->summary.reused.factor && second->summary.outcome == UZ_CONVERGED);
    CHECK(second && second->g[0] == 1 && second->r[1] == 0);
    uz_result_free(first);
    uz_result_free(second);
    uz_cache_free(cache);
    uz_problem_clear(&leaning);
    uz_problem_clear(&idle);
}
