/* Every form of the table through the same checks: they are forms of one operator. A new row is tested at once. */
#include "core/alloc.h"
#include "dual/block.h"
#include "dual/form.h"
#include "factor_fixture.h"
#include "harness.h"
#include "hex8.h"
#include "qp_fixture.h"

typedef struct {
    const uz_qp *qp;
    const uz_dual_abilities *can;
    uz_factor *factor;
    uz_amg *amg;
    uz_dual *dual;
    uz_dual_load *load;
    double tolerance; /* of what it answers, relative */
    int64_t inverted; /* columns of D^-1 that it gave */
} subject;

static void open_subject(subject *s, const uz_qp *qp, int k)
{
    uz_error err = {0};
    uz_modes modes = {0};
    *s = (subject){.qp = qp, .can = &uz_dual_forms[k]->can};
    s->tolerance = s->can->exact ? 1e-10 : 1e-6;
    if (s->can->needs_factor) {
        int64_t *dofs = NULL, count = 0;
        CHECK_INT(uz_dual_contact_dofs(&dofs, &count, &qp->N, &err), UZ_OK);
        CHECK_INT(factor_by(&s->factor, &qp->K, dofs, s->can->contact_last ? count : 0, UZ_ORDERING_AUTO, 0, &err),
                  UZ_OK);
        free(dofs);
    } else {
        CHECK_INT(uz_modes_of_matrix(&modes, &qp->K, &err), UZ_OK);
        CHECK_INT(uz_amg_create(&s->amg, &qp->K, &modes, 0, 0, NULL, &err), UZ_OK);
    }
    uz_dual_source source = {.op = s->can->op, .N = &qp->N, .factor = s->factor, .amg = s->amg};
    CHECK_INT(uz_dual_create(&s->dual, &source, NULL, &err), UZ_OK);
    CHECK_INT(uz_dual_load_create(&s->load, s->dual, &qp->K, qp->p, qp->h, &err), UZ_OK);
    CHECK_INT(uz_dual_load_aim(s->load, 1e-10, NULL, &err), UZ_OK);
    CHECK(s->dual->can == s->can && s->dual->d == qp->K.cols && s->dual->m == qp->N.rows);
    CHECK(s->dual->bytes > 0 && s->load->bytes > 0);
}

static void close_subject(subject *s)
{
    uz_dual_load_free(s->load);
    uz_dual_free(s->dual);
    uz_factor_free(s->factor);
    uz_amg_free(s->amg);
}

static double dot(const double *a, const double *b, int64_t n)
{
    double sum = 0;
    for (int64_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

static void check_close(const subject *s, const double *a, const double *b, int64_t n, const char *what)
{
    double worst = 0, size = 0;
    for (int64_t i = 0; i < n; i++) {
        worst = fmax(worst, fabs(a[i] - b[i]));
        size = fmax(size, fabs(b[i]));
    }
    CHECK_MSG(worst <= s->tolerance * size, "%s, %s: differ by %g of %g",
              uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op), what, worst, size);
}

/* K u = p + N'r, relative to what is added up. */
static void check_equilibrium(const subject *s, const double *u, const double *r, const char *what)
{
    const int64_t d = s->dual->d;
    double *Ku = vector(d), *right = vector(d);
    uz_csc_symv(Ku, &s->qp->K, 1, u);
    memcpy(right, s->qp->p, (size_t)d * sizeof *right);
    uz_csc_gaxpy_t(right, &s->dual->N, 1, r);
    check_close(s, Ku, right, d, what);
    free(Ku);
    free(right);
}

/* D against that of the first form: symmetric, column by column, as a sum of columns. */
static void check_operator(subject *s, subject *first, const double *x, const double *y)
{
    const int64_t m = s->dual->m;
    double *Dx = vector(m), *Dy = vector(m), *other = vector(m), *column = vector(m), *unit = vector(m);
    uz_error err = {0};
    CHECK_INT(uz_dual_load_apply(s->load, Dy, y, &err), UZ_OK);
    CHECK_INT(uz_dual_load_apply(s->load, Dx, x, &err), UZ_OK);
    CHECK_INT(uz_dual_load_apply(first->load, other, x, &err), UZ_OK);
    check_close(s, Dx, other, m, "D x");
    check_close(s, s->load->g0, first->load->g0, m, "g0");
    double scale = sqrt(dot(x, Dx, m) * dot(y, Dy, m));
    CHECK_MSG(scale > 0 && fabs(dot(y, Dx, m) - dot(x, Dy, m)) <= s->tolerance * scale, "%s: not symmetric",
              uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op));
    for (int64_t i = 0; i < m; i += 5) {
        unit[i] = 1;
        CHECK_INT(uz_dual_load_column(s->load, column, i, &err), UZ_OK);
        CHECK_INT(uz_dual_load_apply(s->load, other, unit, &err), UZ_OK);
        check_close(s, column, other, m, "column");
        bool can = false;
        CHECK_INT(uz_dual_load_inverse_column(s->load, &can, column, i, &err), UZ_OK);
        if (can) {
            CHECK_INT(uz_dual_load_apply(s->load, other, column, &err), UZ_OK);
            check_close(s, other, unit, m, "D times a column of its inverse");
        }
        s->inverted += can;
        unit[i] = 0;
    }
    int64_t applied = s->load->applications;
    double lambda = NAN;
    CHECK_INT(uz_dual_load_prepare(s->load, &err), UZ_OK);
    CHECK_INT(uz_dual_load_lambda_max(s->load, &lambda, false, &err), UZ_OK);
    CHECK(lambda > 0 && s->load->applications > applied && s->dual->lazy->lambda_max[0] == lambda);
    CHECK_MSG(dot(x, Dx, m) <= lambda * dot(x, x, m) * (1 + s->tolerance), "%s: lambda_max",
              uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op));
    CHECK_INT(uz_dual_load_apply(s->load, other, x, &err), UZ_OK); /* by what was prepared */
    check_close(s, other, Dx, m, "D x after preparing");
    uz_free_all(Dx, Dy, other, column, unit);
}

/* u(r), its energies, and a feasible displacement within the bound. */
static void check_recovery(subject *s, const double *r)
{
    const int64_t d = s->dual->d, m = s->dual->m;
    double *Dr = vector(m), *g = vector(m), *u = vector(d), *v = vector(d), *K = vector(d), psi, norm2, bound = NAN;
    bool *close = calloc((size_t)m, sizeof *close);
    uz_error err = {0};
    CHECK_INT(uz_dual_load_apply(s->load, Dr, r, &err), UZ_OK);
    for (int64_t i = 0; i < m; i++) {
        g[i] = s->load->g0[i] - Dr[i];
        close[i] = r[i] < 0;
    }
    uz_dual_load_energies(s->load, &psi, &norm2, r, Dr);
    CHECK_INT(uz_dual_load_correct(s->load, &bound, 0.0, r, g, close, &err), UZ_OK);
    CHECK(isfinite(bound) && bound > 0 && !s->load->has_kept);
    CHECK_INT(uz_dual_load_correct(s->load, &bound, INFINITY, r, g, close, &err), UZ_OK);
    CHECK(s->load->has_kept);
    CHECK_INT(uz_dual_load_recover(s->load, u, r, false, &err), UZ_OK);
    check_equilibrium(s, u, r, "recovered");
    uz_csc_symv(K, &s->qp->K, 1, u);
    CHECK_REL(norm2, dot(u, K, d), s->tolerance);
    CHECK_INT(uz_dual_load_recover(s->load, v, r, true, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        u[j] = v[j] - u[j];
    memset(K, 0, (size_t)d * sizeof *K);
    uz_csc_symv(K, &s->qp->K, 1, u);
    CHECK_MSG(sqrt(dot(u, K, d)) <= 2 * bound * (1 + s->tolerance), "%s: the correction is larger than its bound",
              uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op));
    memcpy(g, s->load->h, (size_t)m * sizeof *g);
    uz_csc_gaxpy(g, &s->dual->N, -1, v);
    for (int64_t i = 0; i < m; i++)
        CHECK_MSG(g[i] >= -1e-9 && (!close[i] || g[i] <= 1e-9), "%s: gap %g of row %d",
                  uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op), g[i], (int)i);
    uz_free_all(Dr, g, u, v, K, close);
}

/* D_AA r_A = g0_A and r = 0 elsewhere; bounds: each row bounds a dof, so that nobody may refuse. every: 0, A is a
 * guess; of so many rows the first, or, negative, all but that. */
static void check_active(subject *s, bool bounds, int64_t every)
{
    const int64_t d = s->dual->d, m = s->dual->m;
    double *r = vector(m), *g = vector(m), *Dr = vector(m), *gap = vector(m), *u = vector(d);
    bool *active = calloc((size_t)m, sizeof *active);
    uz_active_end end = UZ_ACTIVE_UNSOLVED;
    uz_error err = {0};
    int64_t count = 0;
    if (every != 0 || !uz_dual_load_guess_active(s->load, active))
        for (int64_t i = 0; i < m; i++)
            active[i] = every == 0 ? s->load->g0[i] < 0 : (i % every == 0) == (every > 0);
    for (int64_t i = 0; i < m; i++)
        count += active[i];
    CHECK(count > 1 && count < m);
    CHECK_INT(uz_dual_load_prepare(s->load, &err), UZ_OK);
    /* Forms that are not exact judge a guess roughly first; each time that they are asked they do it ten times better.
     */
    for (int asked = s->can->exact ? 1 : 10; asked > 0; asked--)
        CHECK_INT(uz_dual_load_solve_active(s->load, &end, r, g, active, &err), UZ_OK);
    CHECK(end == UZ_ACTIVE_SOLVED || (end == UZ_ACTIVE_UNSOLVED && !bounds && !s->can->cheap_steps));
    if (end == UZ_ACTIVE_SOLVED) {
        CHECK_INT(uz_dual_load_apply(s->load, Dr, r, &err), UZ_OK);
        for (int64_t i = 0; i < m; i++) {
            CHECK(active[i] ? g[i] == 0 || s->can->cheap_steps : r[i] == 0);
            gap[i] = s->load->g0[i] - Dr[i];
            g[i] = active[i] ? 0 : g[i];
        }
        for (int64_t i = 0; i < m; i++)
            CHECK_MSG(fabs(gap[i] - g[i]) <= s->tolerance * fabs(s->load->g0[i]) + 1e-2 * s->tolerance,
                      "%s: row %d (%s) has the gap %g, not %g", uz_choice_name(UZ_CHOICE_OPERATOR, s->can->op), (int)i,
                      active[i] ? "active" : "free", gap[i], g[i]);
        CHECK_INT(uz_dual_load_recover(s->load, u, r, false, &err), UZ_OK);
        check_equilibrium(s, u, r, "with given rows");
    }
    uz_free_all(r, g, Dr, gap, u, active);
}

/* Where somebody has no factor to ask. */
static void check_inverse_norm(subject *s, const double *r)
{
    double *e = vector(s->dual->d), *Dr = vector(s->dual->m), value = NAN, again = NAN;
    uz_error err = {0};
    CHECK_INT(uz_dual_load_apply(s->load, Dr, r, &err), UZ_OK);
    const double exact = dot(Dr, r, s->dual->m);
    for (int k = 0; k < 2; k++) { /* of the same e it is the same */
        memset(e, 0, (size_t)s->dual->d * sizeof *e);
        uz_csc_gaxpy_t(e, &s->dual->N, 1, r);
        CHECK_INT(s->load->dual->form->inverse_norm(s->load, k == 0 ? &value : &again, e, 0.0, &err), UZ_OK);
    }
    CHECK_MSG(value >= exact * (1 - 1e-2) && value <= exact * 1.1, "%g for %g", value, exact);
    CHECK(again == value);
    free(e);
    free(Dr);
}

/* Two loads in a block, the second twice as large, as one after the other. */
static void check_lanes(subject *s, const double *r)
{
    const int64_t d = s->dual->d, m = s->dual->m;
    uz_dual_block *block = NULL;
    uz_dual_load *lane[2] = {NULL, NULL};
    const double *both[2] = {r, r};
    const bool corrected[2] = {false, false};
    double *u = vector(d), *v = vector(d);
    uz_error err = {0};
    CHECK_INT(uz_dual_block_create(&block, s->dual, 1, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        for (int l = 0; l < 2; l++)
            block->P[j * UZ_LANES + l] = (l + 1) * s->qp->p[j];
    CHECK_INT(uz_dual_block_forward(block, &err), UZ_OK);
    for (int l = 0; l < 2; l++)
        CHECK_INT(uz_dual_block_open(&lane[l], block, l, &s->qp->K, s->qp->h, &err), UZ_OK);
    check_close(s, lane[0]->g0, s->load->g0, m, "g0 in a block");
    CHECK_REL(lane[1]->psi0, 4 * s->load->psi0, s->tolerance);
    CHECK_INT(uz_dual_block_recover(block, lane, both, corrected, 2, &err), UZ_OK);
    CHECK_INT(uz_dual_load_recover(s->load, u, r, false, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        v[j] = block->U[j * UZ_LANES];
    check_close(s, v, u, d, "displacements in a block");
    CHECK_INT(uz_dual_load_recover(lane[1], v, r, false, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        u[j] = block->U[j * UZ_LANES + 1];
    check_close(s, v, u, d, "displacements of a lane alone");
    for (int l = 0; l < 2; l++)
        uz_dual_load_free(lane[l]);
    uz_dual_block_free(block);
    free(u);
    free(v);
}

static void check_forms(const uz_qp *qp, bool bounds)
{
    const int64_t m = qp->N.rows;
    qp_random rng = {7};
    double *x = vector(m), *y = vector(m), *r = vector(m);
    subject first;
    for (int64_t i = 0; i < m; i++) {
        x[i] = random_signed(&rng);
        y[i] = random_signed(&rng);
        r[i] = i % 3 == 0 ? -1e-4 * (double)(1 + i % 7) : 0;
    }
    open_subject(&first, qp, 0);
    for (int k = 0; k < UZ_DUAL_FORMS; k++) {
        subject s;
        open_subject(&s, qp, k);
        check_operator(&s, &first, x, y);
        CHECK((s.inverted > 0) == (bounds && s.can->needs_factor));
        check_recovery(&s, r);
        check_active(&s, bounds, 0);
        for (int64_t every = -4; every <= 4 && bounds && s.can->exact; every += 8)
            check_active(&s, bounds, every);
        if (!s.can->needs_factor)
            check_inverse_norm(&s, r);
        if (s.can->lanes)
            check_lanes(&s, r);
        close_subject(&s);
    }
    close_subject(&first);
    uz_free_all(x, y, r);
}

/* What is small enough is told by a cycle, and not made sharp; what is not is sharp, to be judged by. */
TEST(a_bound_is_as_sharp_as_it_has_to_be)
{
    const double enough[] = {100.0, 0.0, 1.01, 0.5}, sharp = 1.02; /* times the exact value */
    uz_qp qp;
    uz_error err = {0};
    subject s;
    qp_random rng = {11};
    uz_thread_init();
    CHECK_INT(hex8_qp(&qp, 12, &err), UZ_OK);
    for (int k = 0; k < UZ_DUAL_FORMS; k++) {
        if (uz_dual_forms[k]->can.needs_factor || uz_dual_forms[k]->can.asked_for)
            continue;
        open_subject(&s, &qp, k);
        const int64_t d = qp.K.cols;
        for (int q = 0; q < 4; q++) {
            double *w = vector(d), *e = vector(d), value = NAN;
            for (int64_t j = 0; j < d; j++)
                w[j] = random_signed(&rng);
            uz_csc_symv(e, &qp.K, 1.0, w);
            const double exact = dot(w, e, d);
            CHECK_INT(s.load->dual->form->inverse_norm(s.load, &value, e, enough[q] * exact, &err), UZ_OK);
            CHECK_MSG(value >= exact * (1 - 1e-12), "%.17g for %.17g", value, exact);
            CHECK_MSG(q == 0 ? value > sharp * exact && value <= enough[q] * exact : value <= sharp * exact,
                      "%g for %g where %g is enough", value, exact, enough[q] * exact);
            free(w);
            free(e);
        }
        close_subject(&s);
    }
    uz_qp_clear(&qp);
}

TEST(rows_that_bound_a_dof_each)
{
    uz_qp qp;
    uz_error err = {0};
    uz_thread_init();
    CHECK(hex8_qp(&qp, 6, &err) == UZ_OK);
    check_forms(&qp, true);
    uz_qp_clear(&qp);
}

TEST(rows_of_several_dofs)
{
    uz_qp qp;
    uz_error err = {0};
    uz_thread_init();
    CHECK(hex8_qp(&qp, 6, &err) == UZ_OK && hex8_lean(&qp, &err) == UZ_OK);
    check_forms(&qp, false);
    uz_qp_clear(&qp);
}

/* -u <= -1 and u <= 0.5: who says that the rows contradict each other shows the ray. */
TEST(bounds_that_cross)
{
    uz_csc K = grid(6, 5);
    const int64_t d = K.cols, row[] = {0, 1, 2}, col[] = {3, 7, 7};
    const double value[] = {1, -1, 1};
    double h[] = {1, -1, 0.5}, *p = vector(d);
    uz_qp qp = {.K = K, .p = p, .h = h};
    uz_error err = {0};
    uz_thread_init();
    CHECK_INT(uz_csc_from_triplets(&qp.N, 3, d, 3, row, col, value, &err), UZ_OK);
    for (int k = 0, rays = 0; k < UZ_DUAL_FORMS; k++) {
        subject s;
        double y[3] = {0}, g[3], force[30] = {0};
        bool active[3] = {false, true, true};
        uz_active_end end;
        open_subject(&s, &qp, k);
        CHECK_INT(uz_dual_load_solve_active(s.load, &end, y, g, active, &err), UZ_OK);
        CHECK(end != UZ_ACTIVE_SOLVED);
        if (end == UZ_ACTIVE_RAY) {
            uz_csc_gaxpy_t(force, &s.dual->N, 1, y);
            CHECK(dot(force, force, d) == 0 && dot(y, s.load->h, 3) > 0);
            CHECK(y[0] == 0 && y[1] < 0 && y[2] < 0);
            rays++;
        }
        CHECK(end == UZ_ACTIVE_RAY || s.dual->rows_may_depend);
        CHECK(k < UZ_DUAL_FORMS - 1 || rays > 0);
        close_subject(&s);
    }
    uz_csc_clear(&K);
    uz_csc_clear(&qp.N);
    free(p);
}

/* The table: every form once, with all that a form can't do without, and found by its name. */
TEST(the_table_is_complete)
{
    for (int k = 0; k < UZ_DUAL_FORMS; k++) {
        const uz_dual_abilities *can = &uz_dual_forms[k]->can;
        const uz_dual_form *form = uz_dual_form_of(can->op);
        CHECK(can->op != UZ_OPERATOR_AUTO && can == &form->can && &uz_dual_form_of(can->op)->can == can);
        CHECK_INT(uz_choice_find(UZ_CHOICE_OPERATOR, uz_choice_name(UZ_CHOICE_OPERATOR, can->op)), can->op);
        CHECK(form->dual_size >= sizeof(uz_dual) && form->load_size >= sizeof(uz_dual_load));
        CHECK(form->create && form->clear && form->load && form->unload && form->apply && form->correct);
        CHECK(form->recover && form->solve_active && form->add_cost);
        CHECK(can->exact || (form->aim && form->probe));
        CHECK(can->needs_factor || form->inverse_norm);
        CHECK(can->lanes == (form->load_lane != NULL) && can->lanes == (form->add_reactions != NULL));
        CHECK(!can->lanes || can->needs_factor);
        CHECK(!form->suits || can->needs_factor);
    }
}
