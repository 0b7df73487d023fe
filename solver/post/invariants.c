/* invariants.c: principal stresses and von Mises' equivalent. Components: xx yy zz xy [yz zx]. */
#include "post/parts.h"

#include <float.h>
#include <math.h>

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
