/* matrices.c: stiffness near singular, rows that nearly or wholly depend on each other, numbers at the ends of the
 * range of double. */
#include "extremes.h"

#include "qp_fixture.h"

/* K (d x d row-major, taken over), a bound of 0.5 from above on every third dof, a unit load. */
static uz_qp bounded(double *K, int64_t d, double load)
{
    int64_t m = (d + 2) / 3;
    double *N = vector(m * d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t i = 0; i < m; i++) {
        N[i * d + 3 * i] = 1;
        qp.h[i] = 0.5;
    }
    for (int64_t j = 0; j < d; j++)
        qp.p[j] = load * (j % 4 == 3 ? -1 : 1);
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    return qp;
}

static double *hilbert(int64_t d)
{
    double *K = vector(d * d);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++)
            K[i * d + j] = 1 / (double)(i + j + 1);
    return K;
}

/* A chain of unit springs that only a weak spring holds at its first dof. */
static double *weakly_held(int64_t d, double spring)
{
    double *K = vector(d * d);
    for (int64_t j = 0; j + 1 < d; j++) {
        K[j * d + j] += 1;
        K[(j + 1) * d + j + 1] += 1;
        K[(j + 1) * d + j] = K[j * d + j + 1] = -1;
    }
    K[0] += spring;
    return K;
}

/* Kahan's matrix R'R: its Cholesky pivots say nothing about how near it is to singular. */
static double *kahan(int64_t d, double cosine)
{
    double *R = vector(d * d), *K = vector(d * d), sine = sqrt(1 - cosine * cosine);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = i; j < d; j++)
            R[i * d + j] = pow(sine, (double)i) * (i == j ? 1 : -cosine);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++)
            for (int64_t k = 0; k <= i && k <= j; k++)
                K[i * d + j] += R[k * d + i] * R[k * d + j];
    free(R);
    return K;
}

void run_stiffnesses(suite *all)
{
    char name[64];
    qp_random rng = {5};
    for (int power = 6; power <= 17; power++)
        run_matrices(all, "stiffness", name_of(name, sizeof name, "random, condition 1e%d", power),
                     bounded(random_spd(&rng, 20, pow(10, power), 1), 20, 1), power <= 14 ? OWED_ANSWER : OWED_TRUTH);
    for (int d = 4; d <= 14; d += 2)
        run_matrices(all, "stiffness", name_of(name, sizeof name, "Hilbert, order %d", d), bounded(hilbert(d), d, 1),
                     d <= 10 ? OWED_ANSWER : OWED_TRUTH);
    for (int power = 3; power <= 18; power += 3)
        run_matrices(all, "stiffness", name_of(name, sizeof name, "chain on a spring of 1e-%d", power),
                     bounded(weakly_held(20, pow(10, -power)), 20, 1), power <= 12 ? OWED_ANSWER : OWED_TRUTH);
    for (int d = 10; d <= 60; d += 10)
        run_matrices(all, "stiffness", name_of(name, sizeof name, "Kahan, order %d", d), bounded(kahan(d, 0.5), d, 1),
                     OWED_TRUTH);
    run_matrices(all, "stiffness", "singular: a free chain", bounded(weakly_held(20, 0), 20, 1), OWED_ERROR);
    run_matrices(all, "stiffness", "indefinite by -1e-3", bounded(weakly_held(20, -1e-3), 20, 1), OWED_ERROR);
    run_matrices(all, "stiffness", "indefinite by -1e-12", bounded(weakly_held(20, -1e-12), 20, 1), OWED_ERROR);
    run_matrices(all, "stiffness", "indefinite by -1e-15", bounded(weakly_held(20, -1e-15), 20, 1), OWED_ERROR);
}

/* Two dofs on unit springs, loaded outward, and the rows given (m x 2) at distances h. */
static uz_qp plane(int64_t m, const double *N, const double *h)
{
    double K[] = {2, -1, -1, 2};
    uz_qp qp = {csc_from_dense(K, 2, 2, true), csc_from_dense(N, m, 2, false), vector(2), vector(m)};
    qp.p[0] = 3;
    qp.p[1] = 5;
    for (int64_t i = 0; i < m; i++)
        qp.h[i] = h[i];
    return qp;
}

static void run_dependent_rows(suite *all)
{
    char name[64];
    for (int power = 4; power <= 16; power += 3) {
        double angle = pow(10, -power), N[] = {1, 1, 1, 1 + angle, 1, 1 - angle}, h[] = {1, 1, 1};
        run_matrices(all, "rows", name_of(name, sizeof name, "nearly parallel by 1e-%d", power), plane(3, N, h),
                     OWED_ANSWER);
        double offset[] = {1, 1 + angle, 1 - angle}, same[] = {1, 1, 1, 1, 1, 1};
        run_matrices(all, "rows", name_of(name, sizeof name, "parallel, apart by 1e-%d", power), plane(3, same, offset),
                     OWED_ANSWER);
        double slit[] = {1, -1 + angle}, opposite[] = {1, 1, -1, -1};
        run_matrices(all, "rows", name_of(name, sizeof name, "a slit of 1e-%d", power), plane(2, opposite, slit),
                     power <= 13 ? OWED_ANSWER : OWED_TRUTH);
        double overlap[] = {1, -1 - angle};
        run_matrices(all, "rows", name_of(name, sizeof name, "contradicting by 1e-%d", power),
                     plane(2, opposite, overlap), power <= 13 ? OWED_PROOF : OWED_TRUTH);
    }
    double opposite[] = {1, 1, -1, -1, 1, 0}, equal[] = {1, -1, 0.25};
    run_matrices(all, "rows", "opposite rows: an equation", plane(3, opposite, equal), OWED_ANSWER);
    double corner[] = {1, 0, 0, 1, 1, 1, 2, 1}, at[] = {1, 1, 2, 3};
    run_matrices(all, "rows", "four rows through one point", plane(4, corner, at), OWED_ANSWER);
}

static void run_scaled_rows(suite *all)
{
    char name[64];
    static const int powers[] = {-300, -150, -100, -30, -8, 8, 30, 100, 150, 300};
    for (size_t k = 0; k < sizeof powers / sizeof powers[0]; k++) {
        double factor = pow(10, powers[k]);
        double N[] = {1, 1, factor, 0, 0, factor, -factor, factor}, h[] = {1, 0.75 * factor, 2 * factor, 5 * factor};
        run_matrices(all, "rows", name_of(name, sizeof name, "one in three times 1e%d", powers[k]), plane(4, N, h),
                     powers[k] >= -8 && powers[k] <= 8 ? OWED_ANSWER : OWED_TRUTH);
        double wide[] = {1, 1, factor, -factor, -factor, factor}, slit[] = {1, 0.5 * factor, -0.51 * factor};
        run_matrices(all, "rows", name_of(name, sizeof name, "contradicting, times 1e%d", powers[k]),
                     plane(3, wide, slit), powers[k] >= -8 && powers[k] <= 8 ? OWED_PROOF : OWED_TRUTH);
    }
}

/* Each dof of a chain bounded `copies` times, copy c by a row of factor `factors[c]`; some of the bounds touch only. */
static uz_qp repeated(int64_t d, int64_t copies, const double *factors)
{
    double *N = vector(copies * d * d), *K = weakly_held(d, 1);
    uz_qp qp = bounded(K, d, 1);
    uz_csc_clear(&qp.N);
    free(qp.h);
    qp.h = vector(copies * d);
    for (int64_t i = 0; i < copies * d; i++) {
        int64_t j = i % d;
        double factor = factors[i / d];
        N[i * d + j] = factor;
        if (j > 0)
            N[i * d + j - 1] = 0.5 * factor;
        qp.h[i] = 0.7 * factor;
    }
    qp.N = csc_from_dense(N, copies * d, d, false);
    free(N);
    return qp;
}

/* Springs pulled exactly to their bounds: every reaction and every gap is zero; and rows through the same point. */
static uz_qp weakly_active(int64_t d, double more)
{
    double *K = vector(d * d), *N = vector((2 * d - 1) * d);
    uz_qp qp = {.p = vector(d), .h = vector(2 * d - 1)};
    for (int64_t j = 0; j < d; j++) {
        K[j * d + j] = 2;
        N[j * d + j] = 1;
        qp.p[j] = 1;
        qp.h[j] = 0.5;
        if (j == 0)
            continue;
        N[(d + j - 1) * d + j - 1] = N[(d + j - 1) * d + j] = 1;
        qp.h[d + j - 1] = 1;
    }
    qp.p[0] += more;
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, 2 * d - 1, d, false);
    free(K);
    free(N);
    return qp;
}

static void run_repeated_rows(suite *all)
{
    static const double same[] = {1, 1, 1}, exact[] = {1, 4, 0.25}, rounded[] = {1, 0.3, 1e3},
                        wide[] = {1e-8, 1e8, 0.3};
    run_matrices(all, "rows", "all rows three times", repeated(12, 3, same), OWED_ANSWER);
    run_matrices(all, "rows", "times 1, 4, 1/4", repeated(12, 3, exact), OWED_ANSWER);
    run_matrices(all, "rows", "times 1, 0.3, 1e3", repeated(12, 3, rounded), OWED_ANSWER);
    run_matrices(all, "rows", "times 1e-8, 1e8, 0.3", repeated(12, 3, wide), OWED_ANSWER);
    run_matrices(all, "rows", "weakly active", weakly_active(8, 0), OWED_ANSWER);
    run_matrices(all, "rows", "weakly active but one", weakly_active(8, 1), OWED_ANSWER);
    for (int power = 8; power <= 14; power += 2) {
        char name[64];
        double overlap[] = {1, -1 - pow(10, -power)}, oblique[] = {0.6, 0.8, -0.6, -0.8};
        run_matrices(all, "rows", name_of(name, sizeof name, "oblique, contradicting by 1e-%d", power),
                     plane(2, oblique, overlap), OWED_PROOF);
    }
}

static void run_empty_rows(suite *all)
{
    double N[] = {0, 0, 1, 1}, open[] = {1, 1}, touching[] = {0, 1}, closed[] = {-1, 1}, hair[] = {-1e-30, 1};
    run_matrices(all, "rows", "empty row with a gap", plane(2, N, open), OWED_ANSWER);
    run_matrices(all, "rows", "empty row without a gap", plane(2, N, touching), OWED_ANSWER);
    run_matrices(all, "rows", "empty row, penetrating", plane(2, N, closed), OWED_PROOF);
    run_matrices(all, "rows", "empty row, penetrating by 1e-30", plane(2, N, hair), OWED_TRUTH);
    run_matrices(all, "rows", "no rows", plane(0, N, open), OWED_ANSWER);
    double unit[] = {1, 0, 0, 1}, far[] = {1, 1e9}, farther[] = {1, 1e300}, deep[] = {-1e9, 1};
    run_matrices(all, "rows", "gaps of 1 and 1e9", plane(2, unit, far), OWED_ANSWER);
    run_matrices(all, "rows", "gaps of 1 and 1e300", plane(2, unit, farther), OWED_TRUTH);
    double beside[] = {1, 1, -1, -1, 1, 0}, hidden[] = {1, -1.001, 1e30};
    run_matrices(all, "rows", "contradicting, beside a gap of 1e30", plane(3, beside, hidden), OWED_TRUTH);
    run_matrices(all, "rows", "gaps of -1e9 and 1", plane(2, unit, deep), OWED_ANSWER);
}

void run_rows(suite *all)
{
    run_dependent_rows(all);
    run_repeated_rows(all);
    run_scaled_rows(all);
    run_empty_rows(all);
}

static void scale_vector(double *x, int64_t n, double factor)
{
    for (int64_t i = 0; i < n; i++)
        x[i] *= factor;
}

/* One problem in units in which a force is `force` and a length `length` times as large. */
static void run_units(suite *all, double force, double length, owed what)
{
    char name[64];
    qp_random rng = {9};
    uz_qp qp = bounded(random_spd(&rng, 12, 1e3, 1), 12, 1);
    scale_vector(qp.K.val, qp.K.ptr[12], force / length);
    scale_vector(qp.p, 12, force);
    scale_vector(qp.h, qp.N.rows, length);
    run_matrices(all, "range",
                 name_of(name, sizeof name, "forces 1e%+.0f, lengths 1e%+.0f", log10(force), log10(length)), qp, what);
}

void run_ranges(suite *all)
{
    static const double powers[] = {-300, -160, -100, -30, 30, 100, 160, 300};
    for (size_t k = 0; k < sizeof powers / sizeof powers[0]; k++) {
        double x = powers[k];
        owed what = fabs(x) <= 30 ? OWED_ANSWER : OWED_TRUTH;
        run_units(all, pow(10, x), 1, what);
        run_units(all, 1, pow(10, x), what);
        run_units(all, pow(10, x / 2), pow(10, -x / 2), what);
        run_units(all, pow(10, x), pow(10, x), what);
    }
}
