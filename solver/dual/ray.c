/* ray.c: from reactions that grow without end to the rows that contradict each other. */
#include "dual/ray.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "law/sign.h"

#include <math.h>
#include <string.h>

enum { MAX_STEPS = 300 };

typedef struct {
    double *s, *direction, *image, *best; /* d, d, m, m */
} least_squares;

/* s = N'y over the rows of the support, which are those with y < 0 or kept zero. */
static double normal_residual(double *s, const uz_csc *N, const double *y)
{
    memset(s, 0, (size_t)N->cols * sizeof *s);
    uz_csc_gaxpy_t(s, N, 1.0, y);
    return uz_dot(N->cols, s, s);
}

uz_status uz_ray_project(double *y, const uz_csc *N, uz_error *err)
{
    least_squares ls = {uz_alloc(N->cols, sizeof(double)), uz_alloc(N->cols, sizeof(double)),
                        uz_alloc(N->rows, sizeof(double)), uz_alloc(N->rows, sizeof(double))};
    bool *support = uz_alloc(N->rows, sizeof *support);
    uz_status status = UZ_OK;
    double largest = 0.0;
    if (ls.s && ls.direction && ls.image && ls.best && support) {
        for (int64_t i = 0; i < N->rows; i++)
            largest = fmax(largest, -y[i]);
        for (int64_t i = 0; i < N->rows; i++) {
            support[i] = largest > 0.0 && y[i] < -1e-6 * largest;
            y[i] = support[i] ? y[i] / largest : 0.0;
        }
        /* y -= its part in the range of N_S (rows S only), by CGLS: what is left has N'y = 0 (Paige and Saunders 1982).
         * Steps on rounding alone lead anywhere: the best y of all is kept */
        double gamma = normal_residual(ls.s, N, y), stop = 1e-32 * gamma, least = gamma;
        memcpy(ls.best, y, (size_t)N->rows * sizeof *y);
        memcpy(ls.direction, ls.s, (size_t)N->cols * sizeof *ls.s);
        for (int step = 0; step < MAX_STEPS && gamma > stop; step++) {
            memset(ls.image, 0, (size_t)N->rows * sizeof *ls.image);
            uz_csc_gaxpy(ls.image, N, 1.0, ls.direction);
            for (int64_t i = 0; i < N->rows; i++)
                ls.image[i] = support[i] ? ls.image[i] : 0.0;
            double square = uz_dot(N->rows, ls.image, ls.image);
            if (!(square > 0.0))
                break;
            uz_axpy(N->rows, -gamma / square, ls.image, y);
            double next = normal_residual(ls.s, N, y);
            for (int64_t j = 0; j < N->cols; j++)
                ls.direction[j] = ls.s[j] + next / gamma * ls.direction[j];
            gamma = next;
            if (gamma < least) {
                least = gamma;
                memcpy(ls.best, y, (size_t)N->rows * sizeof *y);
            }
        }
        memcpy(y, ls.best, (size_t)N->rows * sizeof *y);
        for (int64_t i = 0; i < N->rows; i++)
            y[i] = uz_reaction_cut(y[i]);
    } else {
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to look for contradicting rows");
    }
    uz_free_all(ls.s, ls.direction, ls.image, ls.best, support);
    return status;
}
