/* The certificate against the truth: no bound may be below the error of the answer that it bounds. */
#include "certificate/bound.h"
#include "certificate/certificate.h"
#include "certificate/distrust.h"
#include "certificate/row_settle.h"
#include "core/alloc.h"
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"

/* e'K^-1 e through a Cholesky factorization in double precision, as accurate as the solver's own. */
typedef struct {
    const uz_csc *K;
    int64_t d;
    double *L;
    double bound; /* on its inverse, with D = diag(K): the trace of D^1/2 (L L')^-1 D^1/2 */
    int measured; /* how often the doubt was asked for */
} inverse;

/* x = L^-1 x or L'^-1 x, column by column. */
static uz_status half_solve(void *ctx, double *X, int64_t columns, bool transposed, uz_error *err)
{
    const inverse *f = ctx;
    (void)err;
    for (int64_t v = 0; v < columns; v++) {
        double *x = X + v * f->d;
        for (int64_t s = 0; s < f->d; s++) {
            const int64_t i = transposed ? f->d - 1 - s : s;
            for (int64_t k = transposed ? i + 1 : 0; k < (transposed ? f->d : i); k++)
                x[i] -= (transposed ? f->L[k * f->d + i] : f->L[i * f->d + k]) * x[k];
            x[i] /= f->L[i * f->d + i];
        }
    }
    return UZ_OK;
}

static inverse make_inverse(const uz_csc *K)
{
    int64_t d = K->cols;
    inverse f = {K, d, vector(d * d), 0, 0};
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            f.L[K->idx[k] * d + j] = K->val[k];
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j <= i; j++) {
            double sum = f.L[i * d + j];
            for (int64_t k = 0; k < j; k++)
                sum -= f.L[i * d + k] * f.L[j * d + k];
            f.L[i * d + j] = i == j ? sqrt(sum) : sum / f.L[j * d + j];
        }
    double *x = vector(d);
    for (int64_t j = 0; j < d; j++) {
        for (int64_t i = 0; i < d; i++)
            x[i] = i == j ? sqrt(K->val[K->ptr[j]]) : 0;
        half_solve(&f, x, 1, false, NULL);
        for (int64_t i = 0; i < d; i++)
            f.bound += x[i] * x[i];
    }
    free(x);
    return f;
}

static void free_inverse(inverse *f)
{
    free(f->L);
}

static uz_status inverse_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    const inverse *f = ctx;
    uz_status status = half_solve(ctx, e, 1, false, err);
    (void)enough;
    *value = 0;
    for (int64_t i = 0; i < f->d; i++)
        *value += e[i] * e[i];
    return status;
}

static uz_status measure_doubt(void *ctx, double *doubt, uz_error *err)
{
    inverse *f = ctx;
    f->measured++;
    return uz_distrust(doubt, f->K, half_solve, ctx, NULL, err);
}

/* One problem, its exact solution and what the certificate needs. */
typedef struct {
    uz_qp qp;
    quad_exact exact;
    inverse inv;
    double *u, *r, *g; /* the pair under test */
} bench;

static bench make_bench(uz_qp qp)
{
    bench b = {.qp = qp, .inv = make_inverse(&qp.K), .u = vector(qp.K.cols), .r = vector(qp.N.rows)};
    b.g = vector(qp.N.rows);
    return b;
}

static bool solve_bench(bench *b, const bool *start)
{
    bool ok = quad_exact_solve(&b->exact, &b->qp, start);
    CHECK(ok);
    CHECK_MSG(b->exact.violation < (quad)1e-22, "the exact solution violates its conditions by %g",
              (double)b->exact.violation);
    return ok && b->exact.violation < (quad)1e-22;
}

static void free_bench(bench *b)
{
    quad_exact_free(&b->exact);
    free_inverse(&b->inv);
    uz_qp_clear(&b->qp);
    uz_free_all(b->u, b->r, b->g);
}

static uz_certify_input input_of(bench *b)
{
    b->inv.K = &b->qp.K; /* the bench may have moved */
    return (uz_certify_input){.K = &b->qp.K,
                              .N = &b->qp.N,
                              .p = b->qp.p,
                              .h = b->qp.h,
                              .inverse_norm = inverse_norm,
                              .measure_doubt = measure_doubt,
                              .ctx = &b->inv,
                              .inverse_bound = b->inv.bound};
}

/* Certifies the pair and checks the bounds. Returns bound / error of u, NaN where that says nothing. */
static double check_pair(bench *b, const char *what)
{
    uz_certify_input in = input_of(b);
    uz_certificate c;
    uz_error err = {0};
    CHECK_INT(uz_certify(&c, b->r, b->g, b->u, &in, &err), UZ_OK);
    double error_u = quad_error(&b->exact, b->u), error_r = quad_error_of_reactions(&b->exact, b->r);
    double norm = (double)quad_sqrt(b->exact.norm2);
    CHECK_MSG(c.absolute_error >= error_u, "%s: d %d m %d: u is off by %.17g, bound %.17g", what, (int)b->exact.d,
              (int)b->exact.m, error_u, c.absolute_error);
    CHECK_MSG(c.absolute_error >= error_r, "%s: d %d m %d: u_r is off by %.17g, bound %.17g", what, (int)b->exact.d,
              (int)b->exact.m, error_r, c.absolute_error);
    CHECK_MSG(!(c.relative_error * norm < error_u), "%s: relative bound %.17g, true %.17g", what, c.relative_error,
              error_u / norm);
    CHECK(c.gap >= 0 && !isnan(c.relative_error) && c.residual.e3 >= 0);
    for (int64_t i = 0; i < b->exact.m; i++)
        CHECK(b->r[i] <= 0);
    double error = fmax(error_u, error_r);
    return error > 0 ? c.absolute_error / error : NAN;
}

static void take_exact(bench *b)
{
    for (int64_t j = 0; j < b->exact.d; j++)
        b->u[j] = (double)b->exact.u[j];
    for (int64_t i = 0; i < b->exact.m; i++)
        b->r[i] = (double)b->exact.r[i];
}

/* u and r with errors of relative size `size`; r stays <= 0 and keeps its zeros. */
static void take_perturbed(bench *b, qp_random *rng, double size, bool keep_zeros)
{
    double r_scale = 0;
    take_exact(b);
    for (int64_t j = 0; j < b->exact.d; j++)
        b->u[j] *= 1 + size * random_signed(rng);
    for (int64_t i = 0; i < b->exact.m; i++)
        r_scale = fmax(r_scale, fabs(b->r[i]));
    for (int64_t i = 0; i < b->exact.m; i++) {
        b->r[i] *= 1 + size * random_signed(rng);
        if (!keep_zeros)
            b->r[i] = fmin(0, b->r[i] + size * r_scale * random_signed(rng));
    }
}

/* The ratios of bounds to errors that were seen, and how many pairs were left without a bound. */
typedef struct {
    double value[16384];
    int count, pairs, unbounded;
} ratios;

static void keep_ratio(ratios *all, double ratio)
{
    if (!isnan(ratio) && all->count < 16384)
        all->value[all->count++] = ratio;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(ratios *all)
{
    qsort(all->value, (size_t)all->count, sizeof *all->value, by_value);
    return all->count ? all->value[all->count / 2] : NAN;
}

static double check_and_count(bench *b, ratios *all, const char *what)
{
    double ratio = check_pair(b, what);
    all->pairs++;
    all->unbounded += isinf(ratio);
    return ratio;
}

/* Pairs near the solution, where the bound must be sharp, and pairs far from it, where it must hold. */
static void check_many_pairs(bench *b, qp_random *rng, ratios *all)
{
    take_exact(b);
    keep_ratio(all, check_and_count(b, all, "rounded"));
    for (int digits = 1; digits <= 16; digits += 3) {
        take_perturbed(b, rng, pow(10, -digits), true);
        keep_ratio(all, check_and_count(b, all, "perturbed"));
        take_perturbed(b, rng, pow(10, -digits), false);
        check_and_count(b, all, "perturbed everywhere");
    }
    for (int64_t i = 0; i < b->exact.m; i++)
        b->r[i] = -10 * random_unit(rng) * (random_unit(rng) < 0.5);
    check_and_count(b, all, "random r");
    for (int64_t j = 0; j < b->exact.d; j++)
        b->u[j] = 5 * random_signed(rng);
    check_and_count(b, all, "random pair");
    memset(b->r, 0, (size_t)b->exact.m * sizeof *b->r);
    memset(b->u, 0, (size_t)b->exact.d * sizeof *b->u);
    check_and_count(b, all, "zero pair");
}

/* sharp: what the median ratio must stay below; unbounded: the share of pairs that may be left without a bound. */
static void check_kind(const char *name, qp_kind kind, int problems, double sharp, double unbounded)
{
    ratios *all = calloc(1, sizeof *all);
    qp_random rng = {(uint64_t)(kind.d * 1000 + kind.m) + (uint64_t)name[0]};
    for (int k = 0; k < problems; k++) {
        qp_kind one = kind;
        one.d = random_int(&rng, 1, kind.d + 1);
        one.m = random_int(&rng, kind.m / 2, kind.m + 1);
        bench b = make_bench(random_qp(&rng, &one));
        if (solve_bench(&b, NULL))
            check_many_pairs(&b, &rng, all);
        free_bench(&b);
    }
    double middle = median(all), share = (double)all->unbounded / (double)all->pairs;
    printf("# %s: bound / error near the solution: median %.3g, 99 of 100 below %.3g; without bound: %.2g %% of %d\n",
           name, middle, all->value[all->count * 99 / 100], 100 * share, all->pairs);
    CHECK_MSG(middle < sharp, "%s: median ratio %g", name, middle);
    CHECK_MSG(share <= unbounded, "%s: %g %% without bound", name, 100 * share);
    free(all);
}

TEST(independent_rows)
{
    check_kind("plain", (qp_kind){.d = 12, .m = 6, .condition = 100}, 300, 10, 0.02);
}

TEST(more_rows_than_dofs)
{
    check_kind("many rows", (qp_kind){.d = 5, .m = 10, .condition = 100}, 300, 50, 0.02);
}

TEST(dependent_rows)
{
    check_kind("dependent", (qp_kind){.d = 12, .m = 10, .condition = 100, .dependent = true}, 300, 50, 0.02);
}

TEST(badly_scaled_rows)
{
    check_kind("scaled", (qp_kind){.d = 12, .m = 8, .condition = 100, .badly_scaled = true}, 300, 50, 0.02);
    check_kind("both", (qp_kind){.d = 12, .m = 8, .condition = 100, .badly_scaled = true, .dependent = true}, 300, 50,
               0.06);
}

TEST(ill_conditioned_stiffness)
{
    check_kind("1e6", (qp_kind){.d = 12, .m = 8, .condition = 1e6}, 300, 50, 0.02);
    check_kind("1e9", (qp_kind){.d = 12, .m = 8, .condition = 1e9}, 300, 50, 0.02);
    check_kind("1e12", (qp_kind){.d = 12, .m = 8, .condition = 1e12}, 300, 50, 0.02);
    check_kind("1e12d", (qp_kind){.d = 12, .m = 10, .condition = 1e12, .dependent = true}, 300, 50, 0.02);
}

TEST(zero_rows)
{
    check_kind("zero row", (qp_kind){.d = 8, .m = 6, .condition = 100, .zero_row = true}, 300, 50, 0.02);
}

TEST(no_rows)
{
    qp_random rng = {7};
    qp_kind kind = {.d = 9, .m = 0, .condition = 1e4};
    ratios near = {.count = 0};
    bench b = make_bench(random_qp(&rng, &kind));
    if (solve_bench(&b, NULL))
        check_many_pairs(&b, &rng, &near);
    CHECK(median(&near) < 10);
    free_bench(&b);
}

/* p and h such that a chosen displacement, active set and reactions are the solution, up to the rounding of p and h:
 * the exact solution of the rounded problem has the same active set. */
static uz_qp build_backwards(qp_random *rng, int64_t d, int64_t m, bool *active)
{
    qp_kind kind = {.d = d, .m = m, .condition = 1e4};
    uz_qp qp = random_qp(rng, &kind);
    double *u = vector(d), *r = vector(m), *Nu = vector(m);
    for (int64_t j = 0; j < d; j++)
        u[j] = random_signed(rng);
    for (int64_t i = 0; i < m; i++) {
        active[i] = random_unit(rng) < 0.5;
        r[i] = active[i] ? -0.1 - random_unit(rng) : 0;
    }
    uz_csc_gaxpy(Nu, &qp.N, 1, u);
    for (int64_t i = 0; i < m; i++)
        qp.h[i] = Nu[i] + (active[i] ? 0 : 0.1 + random_unit(rng));
    memset(qp.p, 0, (size_t)d * sizeof *qp.p);
    uz_csc_symv(qp.p, &qp.K, 1, u);
    uz_csc_gaxpy_t(qp.p, &qp.N, -1, r);
    uz_free_all(u, r, Nu);
    return qp;
}

TEST(problems_built_from_their_solution)
{
    ratios near = {.count = 0};
    qp_random rng = {11};
    for (int k = 0; k < 6; k++) {
        bool active[40];
        bench b = make_bench(build_backwards(&rng, 50, random_int(&rng, 10, 41), active));
        if (solve_bench(&b, active)) {
            for (int64_t i = 0; i < b.exact.m; i++)
                CHECK_INT(b.exact.active[i], active[i]);
            check_many_pairs(&b, &rng, &near);
        }
        free_bench(&b);
    }
    CHECK_MSG(median(&near) < 50, "median ratio %g", median(&near));
}

/* Of the pair: u* itself with r = r*: nothing but rounding may be left. */
TEST(rounded_solution_is_certified_to_rounding)
{
    qp_random rng = {13};
    for (int k = 0; k < 30; k++) {
        qp_kind kind = {.d = 10, .m = 6, .condition = 100};
        bench b = make_bench(random_qp(&rng, &kind));
        if (solve_bench(&b, NULL)) {
            uz_certify_input in = input_of(&b);
            uz_certificate c;
            take_exact(&b);
            CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
            CHECK_MSG(c.relative_error < 1e-13, "relative error %g", c.relative_error);
            CHECK_REL(c.energy_primal, (double)b.exact.energy, 1e-12);
            CHECK_REL(c.energy_norm, (double)quad_sqrt(b.exact.norm2), 1e-13);
        }
        free_bench(&b);
    }
}

/* Whatever is known of the inverse, and however much of the request the rows in contact use up: with a solve the
 * certificate meets the request, so it does. */
TEST(a_blunt_bound_on_the_inverse_misses_no_request)
{
    qp_random rng = {29};
    int64_t solved = 0;
    for (int k = 0; k < 30; k++) {
        qp_kind kind = {.d = 10, .m = 6, .condition = 100};
        bench b = make_bench(random_qp(&rng, &kind));
        if (solve_bench(&b, NULL)) {
            uz_certify_input in = input_of(&b);
            uz_certificate c;
            take_exact(&b);
            double push[6] = {0}; /* u off by what the correction takes back: all of the bound is in that */
            for (int64_t i = 0; i < kind.m; i++)
                push[i] = b.exact.active[i] ? 1e-9 * random_signed(&rng) : 0;
            for (int64_t j = 0; j < kind.d; j++)
                for (int64_t q = b.qp.N.ptr[j]; q < b.qp.N.ptr[j + 1]; q++)
                    b.u[j] += push[b.qp.N.idx[q]] * b.qp.N.val[q] / b.qp.K.val[b.qp.K.ptr[j]];
            CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
            const double least = c.relative_error;
            in.spares = true;
            /* where no row is active all of it is rounding */
            for (double sharp = 0.5 * 1.001 * least; least > 1e-12 && sharp < 64 * least; sharp *= 1.5)
                for (int power = 0; power < 30; power++) {
                    in.sharp = sharp;
                    in.inverse_bound = ldexp(1e3, power);
                    CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
                    CHECK_MSG(c.relative_error <= 2 * sharp, "2^%d: %g of %g asked", power, c.relative_error,
                              2 * sharp);
                    solved += c.relative_error <= 1.01 * least;
                }
        }
        free_bench(&b);
    }
    CHECK(solved > 0);
}

TEST(the_largest_and_the_norm_of_any_length)
{
    double x[41] = {0};
    for (int n = 1; n <= 41; n++)
        for (int at = 0; at < n; at++) {
            x[at] = -3;
            x[(at + n / 2) % n] += 1; /* the same where n is 1 */
            const double rest = n > 1 ? 1 : 0, most = n > 1 ? 3 : 2;
            CHECK(uz_bound_largest(x, n) == most);
            CHECK_REL(uz_bound_norm(x, n), sqrt(most * most + rest), 1e-15);
            memset(x, 0, sizeof x);
        }
}

/* Wherever in the vectors, of whatever length, it stands: sums in lanes and comparisons pass over nothing. */
TEST(what_is_not_a_number_bounds_nothing)
{
    static const double values[] = {NAN, INFINITY, -INFINITY};
    qp_random rng = {19};
    for (int d = 1; d <= 21; d++) {
        qp_kind kind = {.d = d, .m = 1 + d / 3, .condition = 10};
        bench b = make_bench(random_qp(&rng, &kind));
        uz_certify_input in = input_of(&b);
        for (int at = 0; at < 3 * d; at++) {
            uz_certificate c;
            const double kept = b.u[at / 3];
            b.u[at / 3] = values[at % 3];
            CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
            CHECK_MSG(c.relative_error == INFINITY && c.absolute_error == INFINITY && c.gap == INFINITY,
                      "u_%d of %d is %g: %g, %g", at / 3, d, values[at % 3], c.relative_error, c.absolute_error);
            CHECK(!(c.residual.e1 < INFINITY));
            b.u[at / 3] = kept;
        }
        free_bench(&b);
    }
}

TEST(pulling_reactions_are_cut_and_counted)
{
    qp_random rng = {17};
    qp_kind kind = {.d = 6, .m = 4, .condition = 10};
    bench b = make_bench(random_qp(&rng, &kind));
    uz_certify_input in = input_of(&b);
    uz_certificate c;
    b.r[0] = 3;
    b.r[1] = -1;
    b.r[2] = 4;
    CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
    CHECK(b.r[0] == 0 && b.r[1] == -1 && b.r[2] == 0);
    CHECK_REL(c.residual.e3, 5.0, 1e-15);
    free_bench(&b);
}

/* Two rows that exclude each other: no feasible displacement, so nothing is bounded. */
TEST(contradicting_rows_have_no_bound)
{
    double K[] = {2}, N[] = {1, -1};
    uz_qp qp = {csc_from_dense(K, 1, 1, true), csc_from_dense(N, 2, 1, false), vector(1), vector(2)};
    qp.h[0] = -1;
    bench b = make_bench(qp);
    uz_certify_input in = input_of(&b);
    uz_certificate c;
    CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
    CHECK(isinf(c.absolute_error) && isinf(c.relative_error) && isinf(c.gap));
    free_bench(&b);
}

/* u <= a and 300 u >= b contradict by 6e-15, far less than the rounding of a gap of 500 from where u is. */
TEST(contradictions_are_not_hidden_by_wide_gaps)
{
    double K[] = {2}, N[] = {1, -300};
    uz_qp qp = {csc_from_dense(K, 1, 1, true), csc_from_dense(N, 2, 1, false), vector(1), vector(2)};
    qp.h[0] = 1479.4566850800898;
    qp.h[1] = -443837.00552402693;
    bench b = make_bench(qp);
    uz_certify_input in = input_of(&b);
    uz_certificate c;
    b.u[0] = 955.38379484146287;
    CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
    CHECK(isinf(c.absolute_error));
    free_bench(&b);
}

/* u_1 <= -1 and u_1 >= -1 + far, where u_1 was found no nearer than the rounding of u_2 = 1e90 allows. */
TEST(contradictions_are_not_hidden_by_displacements)
{
    for (int power = 0; power <= 60; power += 10) {
        const double far = pow(2, -power);
        double K[] = {2, 1, 1, 3}, N[] = {1, 0, -1, 0};
        uz_qp qp = {csc_from_dense(K, 2, 2, true), csc_from_dense(N, 2, 2, false), vector(2), vector(2)};
        for (int64_t k = 0; k < 3; k++)
            qp.K.val[k] = ldexp(qp.K.val[k], -300);
        qp.p[1] = 1;
        qp.h[0] = -1;
        qp.h[1] = power > 52 ? 1 : 1 - far;
        bench b = make_bench(qp);
        uz_certify_input in = input_of(&b);
        uz_certificate c;
        b.u[0] = 1e73;
        b.u[1] = ldexp(1, 300) / 3;
        CHECK(uz_certify(&c, b.r, b.g, b.u, &in, NULL) == UZ_OK);
        CHECK_MSG(isinf(c.absolute_error) == (power <= 52), "2^-%d: %g", power, c.absolute_error);
        free_bench(&b);
    }
}

/* What rounding leaves of the gaps is moved in rational numbers: rows that depend on each other and leave no room, with
 * entries that no double-double displacement can meet exactly; and a row that speaks of a penetration below 1e-100. */
TEST(rows_are_settled_exactly)
{
    static const double N[4][3] = {{0.1, 0.3, 0.7}, {-0.1, -0.3, -0.7}, {0.3, 0.1, 0}, {0x1p200, 1, 0}};
    double h[] = {1, -1, 0.7, 0}, weight[] = {0.5, 0.25, 1}, c[3] = {0}, gap[4];
    double u[] = {1, 1, (1 - 0.4) / 0.7};
    for (int deep = 0; deep < 2; deep++) {
        uz_csc Nt = csc_from_dense((const double[]){N[0][0], N[1][0], N[2][0], N[3][0], N[0][1], N[1][1], N[2][1],
                                                    N[3][1], N[0][2], N[1][2], N[2][2], N[3][2]},
                                   3, 4, false);
        uz_row_settle x = {.Nt = &Nt, .weight = weight, .h = h, .u = u, .c = c, .gap = gap};
        h[3] = deep ? 0 : 0x1p201;
        CHECK(uz_row_settle_solve(&x));
        if (deep) /* 2^200 u_1 <= -u_2: u_1 has to move by 1, and others with it */
            CHECK_MSG(x.length > 1 && x.length < 30 && gap[3] < 1e-30, "%g %g", x.length, gap[3]);
        else
            CHECK_MSG(x.length > 0 && x.length < 1e-14 && gap[0] + gap[1] < 1e-30, "%g %g", x.length, gap[0]);
        h[1] = nextafter(-1, -2);
        CHECK(!uz_row_settle_solve(&x));
        h[1] = -1;
        uz_csc_clear(&Nt);
    }
    u[0] = NAN;
    uz_csc Nt = csc_from_dense((const double[]){1, 0, 0}, 3, 1, false);
    uz_row_settle x = {.Nt = &Nt, .weight = weight, .h = h, .u = u, .c = c, .gap = gap};
    CHECK(!uz_row_settle_solve(&x));
    uz_csc_clear(&Nt);
}

/* S S' = (1 + t) K: then M = (1 - 1 / (1 + t)) I. */
TEST(distrust_bounds_how_far_a_factor_is_off)
{
    qp_random rng = {4};
    for (int k = 0; k < 60; k++) {
        const int64_t d = random_int(&rng, 1, 30);
        double *dense = random_spd(&rng, d, pow(10, 6 * random_unit(&rng)), 1), off = pow(10, -6 * random_unit(&rng));
        uz_csc K = csc_from_dense(dense, d, d, true);
        inverse f = make_inverse(&K);
        for (int64_t i = 0; i < d * d; i++)
            f.L[i] *= sqrt(1 + off);
        double norm = 0, is = 1 - 1 / (1 + off);
        uz_error err = {0};
        CHECK_INT(uz_distrust(&norm, &K, half_solve, &f, NULL, &err), UZ_OK);
        CHECK_MSG(norm >= is && norm <= 300 * is, "norm %g, bound %g", is, norm);
        CHECK_MSG(is < 1e-3 || norm < 20 * is, "norm %g, bound %g", is, norm); /* more powers where it matters */
        free_inverse(&f);
        uz_csc_clear(&K);
        free(dense);
    }
}

/* K has a negative eigenvalue that is smaller than what its factor is off by. */
TEST(distrust_finds_that_a_matrix_is_not_definite)
{
    double dense[] = {1, -1, -1, 1 - 1e-9}, near[] = {1, -1, -1, 1 + 1e-9};
    uz_csc K = csc_from_dense(dense, 2, 2, true), L = csc_from_dense(near, 2, 2, true);
    inverse f = make_inverse(&L);
    double norm = 0;
    uz_error err = {0};
    CHECK_INT(uz_distrust(&norm, &K, half_solve, &f, NULL, &err), UZ_ERR_NOT_SPD);
    CHECK(strstr(err.message, "u'K u < 0") != NULL);
    CHECK_INT(uz_distrust(&norm, &L, half_solve, &f, NULL, &err), UZ_OK);
    CHECK(norm < 1e-2);
    free_inverse(&f);
    uz_csc_clear(&K);
    uz_csc_clear(&L);
}

/* A doubt that is assumed stays in the bound; it is measured only where the bound would be duller than was asked for,
 * or where little is left of the factor. */
TEST(doubt_is_measured_where_it_matters_to_what_was_asked)
{
    const struct {
        double doubt, sharp;
        int measured;
    } cases[] = {{5e-3, 0.0, 0}, {0.1, 1e-3, 0}, {0.45, 1e-3, 0}, {0.1, 1e-9, 1}, {0.1, 0.0, 1}, {0.7, 1e-3, 1}};
    const double dense[] = {2, 1, 1, 2}, p[] = {1, 1};
    uz_qp qp = {.K = csc_from_dense(dense, 2, 2, true), .p = vector(2), .h = vector(0)};
    CHECK_INT(uz_csc_init(&qp.N, 0, 2, 0, NULL), UZ_OK);
    memcpy(qp.p, p, sizeof p);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        bench b = make_bench(qp);
        uz_certify_input in = input_of(&b);
        uz_certificate c;
        in.sharp = cases[k].sharp;
        in.inverse_bound = cases[k].doubt / uz_bound_doubt(1.0, 2);
        b.u[0] = b.u[1] = (1 + 1e-6) / 3; /* u* = (1, 1) / 3: wrong by 1e-6 in the energy norm */
        CHECK_INT(uz_certify(&c, b.r, b.g, b.u, &in, NULL), UZ_OK);
        CHECK_INT(b.inv.measured, cases[k].measured);
        CHECK_REL(c.relative_error, cases[k].measured ? 1e-6 : 1e-6 / sqrt(1 - cases[k].doubt), 1e-2);
        free_inverse(&b.inv);
        uz_free_all(b.u, b.r, b.g);
    }
    uz_qp_clear(&qp);
}
