/* The largest eigenvalue of the dual operator: never too small, so that no step is too long. */
#include "dual/form.h"
#include "harness.h"
#include "qp_fixture.h"

enum { MOST = 4000 };

typedef struct {
    uz_dual_load load;
    uz_dual dual;
    int64_t m;
    double eigenvalue[MOST];
    int applied, fail_after;
} diagonal;

static uz_status apply(uz_dual_load *load, double *y, const double *x, uz_error *err)
{
    diagonal *D = (diagonal *)load;
    (void)err;
    if (D->applied++ == D->fail_after)
        return UZ_ERR_INTERNAL;
    for (int64_t i = 0; i < D->m; i++)
        y[i] = D->eigenvalue[i] * x[i];
    return UZ_OK;
}

static uz_status find_largest(double *lambda, diagonal *D, uz_error *err)
{
    static const uz_dual_form form = {.apply = apply};
    uz_dual_lazy lazy = {.making = PTHREAD_MUTEX_INITIALIZER, .known = PTHREAD_MUTEX_INITIALIZER, .lambda_max = {NAN}};
    D->dual = (uz_dual){.form = &form, .m = D->m, .lazy = &lazy};
    D->load = (uz_dual_load){.dual = &D->dual, .stop = {.deadline = INFINITY}};
    uz_status status = uz_dual_load_lambda_max(&D->load, lambda, false, err);
    double again = NAN; /* kept, unless it failed */
    const int applied = D->applied;
    CHECK(status != UZ_OK || (uz_dual_load_lambda_max(&D->load, &again, false, err) == UZ_OK && again == *lambda));
    CHECK(status != UZ_OK || D->applied == applied);
    return status;
}

static void check_within(diagonal *D, const char *what, double tolerance)
{
    double lambda = NAN, truth = 0;
    uz_error err = {0};
    D->applied = 0;
    D->fail_after = -1;
    for (int64_t i = 0; i < D->m; i++)
        truth = fmax(truth, D->eigenvalue[i]);
    CHECK_INT(find_largest(&lambda, D, &err), UZ_OK);
    CHECK_MSG(lambda >= truth * (1 - 1e-12), "%s: %.17g for %.17g", what, lambda, truth);
    CHECK_MSG(lambda <= truth * (1 + tolerance), "%s: %.17g for %.17g", what, lambda, truth);
    CHECK_MSG(D->applied <= 121, "%s: %d applications", what, D->applied);
}

static void check_bound(diagonal *D, const char *what)
{
    check_within(D, what, 2e-4);
}

TEST(one_row)
{
    diagonal D = {.m = 1, .eigenvalue = {0.37}};
    check_bound(&D, "m = 1");
}

TEST(no_rows_and_no_operator)
{
    double lambda = 7;
    uz_error err = {0};
    diagonal D = {.m = 0, .fail_after = -1};
    CHECK_INT(find_largest(&lambda, &D, &err), UZ_OK);
    CHECK(lambda == 0);
    D.m = 50;
    lambda = 7;
    CHECK_INT(find_largest(&lambda, &D, &err), UZ_OK);
    CHECK(lambda == 0);
}

TEST(multiples_of_the_identity)
{
    static const double sizes[] = {1e-300, 1e-30, 1, 1e30, 1e150};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        diagonal D = {.m = 40};
        for (int64_t i = 0; i < D.m; i++)
            D.eigenvalue[i] = sizes[k];
        check_bound(&D, "identity");
    }
}

TEST(random_spectra)
{
    qp_random rng = {3};
    for (int k = 0; k < 60; k++) {
        diagonal D = {.m = random_int(&rng, 1, 400)};
        double decades = 12 * random_unit(&rng);
        for (int64_t i = 0; i < D.m; i++)
            D.eigenvalue[i] = pow(10, -decades * random_unit(&rng));
        check_bound(&D, "random");
    }
}

/* Clusters at the top: which of them is found does not matter, how large they are does. */
TEST(clusters)
{
    qp_random rng = {4};
    for (int k = 0; k < 40; k++) {
        diagonal D = {.m = random_int(&rng, 20, 400)};
        double width = pow(10, -2 - 12 * random_unit(&rng));
        for (int64_t i = 0; i < D.m; i++)
            D.eigenvalue[i] = i < 10 ? 1 - width * random_unit(&rng) : 0.9 * random_unit(&rng);
        check_bound(&D, "cluster");
    }
}

/* One eigenvalue just above a dense rest: where the steps end before it is found, the bound still holds. */
TEST(outlier_among_many)
{
    static const double above[] = {1e-6, 1e-3, 0.1, 10, 1e6};
    for (size_t k = 0; k < sizeof above / sizeof above[0]; k++) {
        diagonal D = {.m = MOST};
        for (int64_t i = 0; i < D.m; i++)
            D.eigenvalue[i] = (double)(i + 1) / (double)D.m;
        D.eigenvalue[1234] = 1 + above[k];
        check_within(&D, "outlier", 1e-3);
    }
}

/* Singular operators of low rank end early. */
TEST(low_rank)
{
    for (int64_t rank = 1; rank < 6; rank++) {
        diagonal D = {.m = 300};
        for (int64_t i = 0; i < rank; i++)
            D.eigenvalue[50 * i] = (double)(i + 1);
        check_bound(&D, "rank");
        CHECK(D.applied <= 12);
    }
}

TEST(discrete_laplacian)
{
    /* The compliance of a string: eigenvalues 1 / (2 - 2 cos(pi k / (m + 1))). */
    diagonal D = {.m = 600};
    for (int64_t i = 0; i < D.m; i++)
        D.eigenvalue[i] = 1 / (2 - 2 * cos(3.14159265358979 * (double)(i + 1) / (double)(D.m + 1)));
    check_bound(&D, "string");
    CHECK(D.applied < 60);
}

TEST(failure_of_the_operator_is_passed_on)
{
    for (int k = 0; k < 5; k++) {
        double lambda = 7;
        uz_error err = {0};
        diagonal D = {.m = 30, .fail_after = k};
        for (int64_t i = 0; i < D.m; i++)
            D.eigenvalue[i] = (double)i;
        CHECK_INT(find_largest(&lambda, &D, &err), UZ_ERR_INTERNAL);
        CHECK(lambda == 0);
    }
}
