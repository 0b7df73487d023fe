/* smoother.c: the polynomial that smooths on a grid, and the eigenvalues that it is made for.
 *
 * The largest eigenvalue of diag(K)^-1 K is at most that of any of the parts that a body is put together of, as K and
 * its diagonal are sums over these, and no larger where dofs are held (Fried, J. Sound Vib. 22 (1972)). One cell is a
 * rough part: alone it can do what its neighbours would hinder. For Poisson's ratios from 0.3 to 0.49 its eigenvalue
 * is 1.6 to 2.1 times the largest of a cube of many cells, that of eight cells 1.08 times. */
#include "brick/levels.h"

#include <math.h>
#include <string.h>

enum { DOFS = UZ_BRICK_DOFS, ROOT_POWERS = 7 };

/* lambda_max of a symmetric matrix (n x n) without negative eigenvalues, at most 1.3 % too large: the root of the norm
 * of a high power. */
static double largest(const double *given, int n)
{
    double A[DOFS * DOFS], square[DOFS * DOFS], log_scale = 0.0;
    memcpy(A, given, (size_t)(n * n) * sizeof *A);
    for (int power = 0;; power++) {
        double norm = 0.0;
        for (int i = 0; i < n; i++) {
            double sum = 0.0;
            for (int j = 0; j < n; j++)
                sum += fabs(A[n * i + j]);
            norm = fmax(norm, sum);
        }
        if (norm == 0.0)
            return 0.0;
        log_scale = 2.0 * log_scale + log(norm); /* A stands for exp(log_scale) A */
        if (power == ROOT_POWERS)
            return exp(log_scale / (double)(1 << ROOT_POWERS));
        for (int i = 0; i < n * n; i++)
            A[i] /= norm;
        memset(square, 0, sizeof square);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < n; k++)
                for (int j = 0; j < n; j++)
                    square[n * i + j] += A[n * i + k] * A[n * k + j];
        memcpy(A, square, (size_t)(n * n) * sizeof *A);
    }
}

/* A part of cells is symmetric to its reflections, as each cell is: K is eight blocks, in the plane four, for
 * displacements that are even or odd along each axis, which those of an eighth of the nodes tell. Returns with which
 * sign a dof follows from which of these, 0: it is 0. Here and below nodes and cells of a part are by component. */
static int follow(int *from, int axes, const int node[3], int component, const int cells[3], int parity)
{
    int sign = 1;
    *from = component;
    for (int c = 0; c < axes; c++) {
        const bool odd = (parity >> c & 1) != (c == component), beyond = 2 * node[c] > cells[c];
        if (odd)
            sign *= beyond ? -1 : 2 * node[c] == cells[c] ? 0 : 1;
        *from += axes * (beyond ? cells[c] - node[c] : node[c]) << c;
    }
    return sign;
}

/* The largest eigenvalue of diag(K)^-1 K of a part of at most three cells along each axis. */
static double most_of_part(int axes, const int cells[3], const double *ke, double unit)
{
    const int n = uz_brick_dofs(axes);
    double most = 0.0;
    for (int parity = 0; parity < uz_brick_corners(axes); parity++) {
        double K[DOFS * DOFS] = {0.0}, D[DOFS] = {0.0};
        for (int cell = 0; cell < cells[0] * cells[1] * cells[2]; cell++) {
            const int at[3] = {cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]};
            int from[DOFS], sign[DOFS];
            for (int i = 0; i < n; i++) {
                const int *corner = uz_brick_corner[i / axes];
                const int node[3] = {at[0] + corner[0], at[1] + corner[1], at[2] + corner[2]};
                sign[i] = follow(&from[i], axes, node, i % axes, cells, parity);
            }
            for (int i = 0; i < n; i++) {
                D[from[i]] += sign[i] * sign[i] * (ke[(n + 1) * i] / unit);
                for (int j = 0; j < n; j++)
                    K[n * from[i] + from[j]] += sign[i] * sign[j] * (ke[n * i + j] / unit);
            }
        }
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                K[n * i + j] = D[i] > 0.0 && D[j] > 0.0 ? K[n * i + j] / (sqrt(D[i]) * sqrt(D[j])) : 0.0;
        most = fmax(most, largest(K, n));
    }
    return most;
}

/* Parts of two cells along each axis, and one of three where their number is odd. */
static double most_of(int axes, const int64_t cells[3], const double *ke, double unit)
{
    double most = 0.0;
    int part[3];
    for (part[0] = 1; part[0] <= 3; part[0]++)
        for (part[1] = 1; part[1] <= 3; part[1]++)
            for (part[2] = 1; part[2] <= (axes == 2 ? 1 : 3); part[2]++) {
                bool there = true;
                for (int c = 0; c < axes; c++) {
                    const int64_t n = cells[uz_brick_axis_of(axes, c)];
                    there = there && (n <= 3 ? part[c] == n : part[c] == 2 || part[c] == 2 + n % 2);
                }
                if (there)
                    most = fmax(most, most_of_part(axes, part, ke, unit));
            }
    return most;
}

/* The least eigenvalue of diag(K)^-1 K among oscillations from node to node that the next grid has not. */
static double least_of_oscillations(int axes, const double *ke, double unit, const bool coarser[3])
{
    const int corners = uz_brick_corners(axes), n = uz_brick_dofs(axes);
    int lost = 0;
    double block[9 * UZ_BRICK_PARITIES], least = INFINITY;
    for (int m = 0; m < axes; m++)
        lost |= coarser[uz_brick_axis_of(axes, m)] ? 1 << m : 0;
    (void)uz_brick_blocks(block, axes, ke, unit);
    for (int parity = 0; parity < corners; parity++)
        for (int m = 0; m < axes && (parity & lost) != 0; m++) /* displacements along an axis */
            least = fmin(least, corners * block[9 * (parity ^ 1 << m) + 4 * m] / (ke[(n + 1) * m] / unit));
    return least;
}

/* A polynomial of this degree smooths what is by no more than COVERED times its square below the largest eigenvalue.
 * Measured on cubes, by time to the same error: 6 to 10 are as good for two steps, 12 to 20 for three, 20 to 35 for
 * four, and more than four take longer (Poisson's ratio 0.49: 6 steps 3 %, 8 13 %) however much would be left. */
#define COVERED 2.2
enum { DEGREE_LEAST = 2 };

/* Chebyshev's, so many steps as the next grid leaves to do. */
void uz_brick_smoother_init(uz_brick_smoother *out, int axes, const int64_t cells[3], const double *ke, double unit,
                            const bool coarser[3])
{
    const double most = most_of(axes, cells, ke, unit), range = most / least_of_oscillations(axes, ke, unit, coarser);
    int degree = DEGREE_LEAST;
    while (degree < UZ_BRICK_DEGREE_MOST && COVERED * degree * degree < range)
        degree++;
    const double least = most / (COVERED * degree * degree), middle = 0.5 * (most + least), half = 0.5 * (most - least),
                 sigma = middle / half;
    double rho = 1.0 / sigma;
    *out = (uz_brick_smoother){.most = most, .degree = degree, .q = {(float)(1.0 / middle)}};
    for (int k = 1; k < degree; k++) {
        const double next = 1.0 / (2.0 * sigma - rho);
        out->p[k] = (float)(next * rho);
        out->q[k] = (float)(2.0 * next / half);
        rho = next;
    }
}

/* M^-1 is at least what the smoothers do without the coarser grids, (1 - phi(t)^2) / t for an eigenvalue t of
 * diag(K)^-1 K, phi what the polynomial leaves. */
double uz_brick_bound_on_cycle(const uz_brick_smoother *s)
{
    enum { SAMPLES = 4000 };
    double worst = 0.0;
    for (int k = 1; k <= SAMPLES; k++) {
        const double t = s->most * k / SAMPLES;
        double phi = 1.0, d = 0.0;
        for (int step = 0; step < s->degree; step++) {
            d = (double)s->p[step] * d + (double)s->q[step] * phi;
            phi -= t * d;
        }
        worst = fmax(worst, t / (1.0 - phi * phi));
    }
    return 1.01 * worst;
}
