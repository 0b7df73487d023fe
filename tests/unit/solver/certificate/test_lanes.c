/* Certificates of several answers with one pass over K, and the substitutions that make the answers. */
#include "certificate/certificate.h"
#include "certificate/lanes.h"
#include "factor/factor.h"
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

typedef struct {
    uz_factor *factor;
    uz_factor_workspace *ws;
    int64_t d;
    bool spared; /* no solve may be asked for */
} linear;

static linear factor_of(const uz_csc *K)
{
    linear x = {.ws = uz_factor_workspace_new(), .d = K->cols};
    uz_error err = {0};
    CHECK_INT(factor_by(&x.factor, K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
    return x;
}

static uz_status inverse_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    const linear *f = ctx;
    double *x = vector(f->d);
    (void)enough;
    CHECK(!f->spared);
    uz_factor_permute(f->factor, x, e);
    uz_status status = uz_factor_solve_one(f->factor, f->ws, x, true, err);
    *value = 0;
    for (int64_t i = 0; i < f->d; i++)
        *value += x[i] * x[i];
    free(x);
    return status;
}

static uz_status inverse_norms(void *ctx, double squares[UZ_CERTIFY_LANES], double *E, uz_error *err)
{
    const linear *f = ctx;
    double *X = vector(f->d * UZ_LANES);
    CHECK(!f->spared);
    uz_factor_permute_lanes(f->factor, X, E);
    uz_status status = uz_factor_solve_lanes(f->factor, X, 1, true, err);
    for (int l = 0; l < UZ_CERTIFY_LANES; l++)
        for (int64_t i = 0; i < f->d; i++)
            squares[l] = (i ? squares[l] : 0) + X[i * UZ_LANES + l] * X[i * UZ_LANES + l];
    free(X);
    return status;
}

static uz_status no_doubt(void *ctx, double *doubt, uz_error *err)
{
    (void)ctx, (void)doubt, (void)err;
    return UZ_ERR_INTERNAL;
}

/* Certificates in lanes of answers that are off by anything: the bounds hold, and are those of uz_certify. */
static int check_lanes(const uz_qp *qp, const quad_exact *exact, qp_random *rng, bool spares)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    linear f = factor_of(&qp->K);
    f.spared = spares;
    const uz_certify_input in = {.K = &qp->K,
                                 .N = &qp->N,
                                 .p = qp->p,
                                 .h = qp->h,
                                 .inverse_norm = inverse_norm,
                                 .measure_doubt = no_doubt,
                                 .ctx = &f,
                                 .inverse_bound = uz_factor_describe(f.factor).inverse_bound,
                                 .spares = spares,
                                 .sharp = spares ? INFINITY : 0};
    uz_lane_certifier *certifier = NULL;
    uz_lane_answer answers[UZ_CERTIFY_LANES];
    double *U = vector(d * UZ_CERTIFY_LANES), *P = vector(d * UZ_CERTIFY_LANES), *u = vector(d);
    CHECK_INT(uz_lane_certifier_create(&certifier, &in, inverse_norms, NULL), UZ_OK);
    for (int l = 0; l < UZ_CERTIFY_LANES; l++) {
        double size = pow(10, -2.0 * l);
        answers[l] = (uz_lane_answer){.r = vector(m), .g = vector(m), .h = qp->h, .sharp = in.sharp};
        for (int64_t i = 0; i < m; i++)
            answers[l].r[i] = (double)exact->r[i] * (1 + size * random_signed(rng)) + 1e-3 * size * random_signed(rng);
        for (int64_t j = 0; j < d; j++) {
            U[j * UZ_CERTIFY_LANES + l] = (double)exact->u[j] + size * random_signed(rng);
            P[j * UZ_CERTIFY_LANES + l] = qp->p[j];
        }
    }
    double *r = vector(m), *g = vector(m);
    int certified = 0;
    for (int l = 0; l < UZ_CERTIFY_LANES; l++) {
        uz_certificate one;
        memcpy(r, answers[l].r, (size_t)m * sizeof *r);
        uz_certify_lanes(certifier, answers, UZ_CERTIFY_LANES, U, P);
        for (int64_t j = 0; j < d; j++)
            u[j] = U[j * UZ_CERTIFY_LANES + l];
        CHECK_INT(uz_certify(&one, r, g, u, &in, NULL), UZ_OK);
        const uz_certificate *c = &answers[l].certificate;
        CHECK(!answers[l].certified || isfinite(one.absolute_error));
        if (!answers[l].certified)
            continue;
        certified++;
        CHECK_MSG(c->absolute_error >= quad_error(exact, u), "lane %d: off by %.17g, bound %.17g", l,
                  quad_error(exact, u), c->absolute_error);
        CHECK(c->absolute_error >= quad_error_of_reactions(exact, r));
        CHECK_REL(c->absolute_error, one.absolute_error, 1e-9);
        CHECK_REL(c->energy_primal, one.energy_primal, 1e-12);
        CHECK_REL(c->residual.e1, one.residual.e1, 1e-9);
        CHECK_REL(c->residual.total, one.residual.total, 1e-9);
        CHECK_REL(c->relative_residual.total, one.relative_residual.total, 1e-9);
        CHECK(memcmp(g, answers[l].g, (size_t)m * sizeof *g) == 0);
    }
    for (int l = 0; l < UZ_CERTIFY_LANES; l++) {
        free(answers[l].r);
        free(answers[l].g);
    }
    double *mine[] = {U, P, u, r, g};
    for (int k = 0; k < 5; k++)
        free(mine[k]);
    uz_lane_certifier_free(certifier);
    uz_factor_workspace_free(f.ws);
    uz_factor_free(f.factor);
    return certified;
}

TEST(certificates_in_lanes_are_those_of_single_answers)
{
    int lanes = 0, certified = 0;
    for (uint64_t seed = 0; seed < 40; seed++) {
        qp_random rng = {seed + 300};
        qp_kind kind = {
            .d = random_int(&rng, 1, 30), .m = random_int(&rng, 1, 10), .condition = pow(10, (double)(seed % 6))};
        uz_qp qp = random_qp(&rng, &kind);
        quad_exact exact;
        if (quad_exact_solve(&exact, &qp, NULL)) {
            lanes += UZ_CERTIFY_LANES;
            certified += check_lanes(&qp, &exact, &rng, seed % 2 == 0);
        }
        quad_exact_free(&exact);
        uz_qp_clear(&qp);
    }
    CHECK_MSG(100 * certified >= 95 * lanes, "%d of %d", certified, lanes); /* others are left to single answers */
}

/* L^-1 and L'^-1 in lanes against the substitutions of single vectors. */
TEST(substitutions_in_lanes)
{
    uz_scene scene = paper_scene(24, 8);
    uz_body_model model = build_body(&scene);
    linear f = factor_of(&model.K);
    int64_t d = model.d, size = d * UZ_LANES;
    enum { BLOCKS = 3 };
    double *X = vector(BLOCKS * size), *x = vector(BLOCKS * size);
    qp_random rng = {11};
    for (int64_t k = 0; k < BLOCKS * size; k++)
        X[k] = random_signed(&rng);
    for (int forward = 1; forward >= 0; forward--) {
        for (int64_t lane = 0; lane < BLOCKS * UZ_LANES; lane++)
            for (int64_t j = 0; j < d; j++)
                x[lane * d + j] = X[lane / UZ_LANES * size + j * UZ_LANES + lane % UZ_LANES];
        CHECK_INT(uz_factor_solve_lanes(f.factor, X, BLOCKS, forward, NULL), UZ_OK);
        double worst = 0, largest = 0;
        for (int64_t lane = 0; lane < BLOCKS * UZ_LANES; lane++) {
            double *one = x + lane * d;
            CHECK_INT(uz_factor_solve_one(f.factor, f.ws, one, forward, NULL), UZ_OK);
            for (int64_t j = 0; j < d; j++) {
                double got = X[lane / UZ_LANES * size + j * UZ_LANES + lane % UZ_LANES];
                worst = fmax(worst, fabs(got - one[j]));
                largest = fmax(largest, fabs(one[j]));
            }
        }
        CHECK_MSG(worst <= 1e-12 * largest, "off by %g of %g", worst, largest);
    }
    free(X);
    free(x);
    uz_factor_workspace_free(f.ws);
    uz_factor_free(f.factor);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}
