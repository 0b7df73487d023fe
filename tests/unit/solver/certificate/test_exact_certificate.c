/* Certificates in rational numbers against answers that are known exactly: K is diagonal, one dof with two rows. */
#include "certificate/exact.h"
#include "harness.h"
#include "qp_fixture.h"

/* K u = p + N'r with N = (3, -3): 3 u <= h_0 and -3 u <= h_1. */
typedef struct {
    double k, p, h[2];
} spring;

static uz_status inverse_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    (void)enough, (void)err;
    *value = e[0] * e[0] / *(double *)ctx;
    return UZ_OK;
}

/* v = (h_0 + off) / 3, r_0 = (K v - p) / 3 + wrong; the certificate of u. */
static uz_certificate certify(const spring *x, double u, double off, double wrong)
{
    const double dense[] = {3, -3};
    double stiffness = x->k, none = INFINITY;
    uz_csc K = csc_from_dense(&stiffness, 1, 1, true), N = csc_from_dense(dense, 2, 1, false);
    const uz_certify_input in = {.K = &K,
                                 .N = &N,
                                 .p = &x->p,
                                 .h = x->h,
                                 .inverse_norm = inverse_norm,
                                 .ctx = &stiffness,
                                 .rcond = 1,
                                 .inverse_bound = INFINITY};
    uz_certificate c = {.absolute_error = none, .relative_error = none};
    mpf_t v[1], s[2], t;
    mpf_inits(t, NULL);
    mpf_init2(v[0], 2048);
    mpf_init2(s[0], 2048);
    mpf_init2(s[1], 2048);
    mpf_set_d(v[0], x->h[0]);
    mpf_set_d(t, off);
    mpf_add(v[0], v[0], t);
    mpf_div_ui(v[0], v[0], 3);
    mpf_set_d(t, x->k);
    mpf_mul(s[0], v[0], t);
    mpf_set_d(t, x->p);
    mpf_sub(s[0], s[0], t);
    mpf_div_ui(s[0], s[0], 3);
    mpf_set_d(t, wrong);
    mpf_add(s[0], s[0], t);
    CHECK_INT(uz_certify_exact(&c, &u, (const mpf_t *)v, (const mpf_t *)s, &in, NULL), UZ_OK);
    mpf_clears(t, v[0], s[0], s[1], NULL);
    uz_csc_clear(&K);
    uz_csc_clear(&N);
    return c;
}

/* Loads up to 2^900 times what strains: u* = 1/3, and what a double leaves of it is 2^-54 / 3. */
TEST(loads_that_dwarf_strain)
{
    for (int far = 0; far <= 900; far += 100) {
        const spring x = {ldexp(1, -far / 2), ldexp(1, far - far / 2), {1, 5}};
        const double error = sqrt(x.k) * 0x1p-54 / 3, least = x.k / 18 - x.p / 3;
        const uz_certificate c = certify(&x, 1.0 / 3, 0, 0);
        CHECK_MSG(c.absolute_error >= error && c.absolute_error <= 1.0001 * error, "2^%d: %g, is %g", far,
                  c.absolute_error, error);
        CHECK_MSG(c.relative_error >= 0x1p-54 && c.relative_error < 1.0001 * 0x1p-54, "%g", c.relative_error);
        CHECK(c.energy_dual <= least && least <= c.energy_primal);
        CHECK_REL(c.energy_dual, c.energy_primal, 1e-15);
    }
}

/* What is wrong is in the bound: of s, of v that has to be moved, and of u. */
TEST(what_is_off_is_bounded)
{
    const spring x = {0x1p-40, 0x1p60, {1, -1}}; /* the rows leave u = 1/3 and nothing else: v is never a double */
    const double by_r = 3 * 0x1p-10 / sqrt(x.k), by_u = 1e-3 * sqrt(x.k);
    CHECK_MSG(certify(&x, 1.0 / 3, 0, 0).absolute_error < 1e-10, "right");
    const uz_certificate r = certify(&x, 1.0 / 3, 0, -0x1p-10);
    CHECK_MSG(r.absolute_error >= by_r && r.absolute_error < 1.01 * by_r, "%g, is %g", r.absolute_error, by_r);
    const uz_certificate u = certify(&x, 1.0 / 3 + 1e-3, 0, 0);
    CHECK_MSG(u.absolute_error >= (1 - 1e-9) * by_u && u.absolute_error < 1.01 * by_u, "%g", u.absolute_error);
    const spring beside = {1, 4, {1, 5}};
    for (double off = -0x1p-4; off <= 0x1p-4; off += 0x1p-7) { /* beyond the row, or short of it: -s'g counts */
        const uz_certificate c = certify(&beside, (1 + off) / 3, off, 0);
        CHECK_MSG(c.absolute_error >= fabs(off) / 3, "%g: %g", off, c.absolute_error);
        CHECK_MSG(c.energy_dual <= 1.0 / 18 - 4.0 / 3 && 1.0 / 18 - 4.0 / 3 <= c.energy_primal, "%g", off);
    }
}

/* Nothing is claimed of what is not feasible, or not a number. */
TEST(no_bound_without_a_feasible_point)
{
    const spring apart = {1, 4, {1, -1 - 0x1p-52}}, plain = {1, 4, {1, 5}};
    CHECK(isinf(certify(&apart, 1.0 / 3, 0, 0).absolute_error));
    CHECK(isinf(certify(&plain, INFINITY, 0, 0).absolute_error));
    CHECK(isinf(certify(&plain, NAN, 0, 0).absolute_error));
}

/* K = (1 1; 1 1 + eps) of condition 4 / eps, and a row that never touches. v: out, u* in 512 bits. */
static uz_certificate certify_pair(double eps, const double *u, const double *p, mpf_t *v)
{
    const double stiffness[] = {1, 1, 1, 1 + eps}, dense[] = {1, 0}, h = 1e30;
    uz_csc K = csc_from_dense(stiffness, 2, 2, true), N = csc_from_dense(dense, 1, 2, false);
    const uz_certify_input in = {.K = &K, .N = &N, .p = p, .h = &h, .rcond = 1, .inverse_bound = INFINITY};
    uz_certificate c = {.absolute_error = INFINITY, .relative_error = INFINITY};
    mpf_t s[1], t;
    mpf_init2(s[0], 512);
    mpf_init2(t, 512);
    for (int j = 0; j < 2; j++)
        mpf_init2(v[j], 512);
    mpf_set_d(v[1], p[1]); /* u_2 = (p_2 - p_1) / eps, u_1 = p_1 - u_2 */
    mpf_set_d(t, p[0]);
    mpf_sub(v[1], v[1], t);
    mpf_set_d(v[0], eps);
    mpf_div(v[1], v[1], v[0]);
    mpf_sub(v[0], t, v[1]);
    CHECK_INT(uz_certify_exact(&c, u, (const mpf_t *)v, (const mpf_t *)s, &in, NULL), UZ_OK);
    mpf_clears(s[0], t, NULL);
    uz_csc_clear(&K);
    uz_csc_clear(&N);
    return c;
}

TEST(stiffness_that_no_double_factor_knows)
{
    for (int power = 8; power <= 52; power += 4) {
        const double eps = ldexp(1, -power), p[] = {1.0 / 3, 1.0 / 3 + 3 * eps}, u[] = {-8.0 / 3, 3.0 + 1e-9};
        mpf_t v[2];
        const uz_certificate c = certify_pair(eps, u, p, v);
        const long double a = (long double)u[0] - mpf_get_d(v[0]), b = (long double)u[1] - mpf_get_d(v[1]),
                          error = sqrtl((a + b) * (a + b) + (long double)eps * b * b);
        CHECK_MSG((long double)c.absolute_error >= error * (1 - 1e-6L) &&
                      (long double)c.absolute_error <= error * 1.001L,
                  "2^-%d: %g, is %g", power, c.absolute_error, (double)error);
        mpf_clears(v[0], v[1], NULL);
        const uz_certificate none = certify_pair(-eps, u, p, v); /* K is not positive definite */
        CHECK_MSG(isinf(none.absolute_error), "2^-%d: %g", power, none.absolute_error);
        mpf_clears(v[0], v[1], NULL);
    }
}
