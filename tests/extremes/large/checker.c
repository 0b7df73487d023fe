/* checker.c: an answer of large deformation, held against elements and laws that are written here once more, in
 * quadruple precision. Of the solver it has nothing: it reads a scene of generated_large.py with displacements, and
 * prints what is left over, for that program to judge.
 *
 * In:   element model law poisson part warm   Young's modulus is 1; part: of supports and loads; warm: what a free
 *                                             body would be longer by under the whole load
 *       dim nodes cells, places, the nodes of each cell, displacements
 *       held dofs: count, then node axis value of each
 *       nodes on the obstacle: count, then each
 *       loaded sides: count, then first last middle (-1: none), and the traction
 *       sides on springs: count, their stiffness along each axis, then first last middle (-1: none)
 *       nodes of a rigid group: count, then each
 *       sphere centre radius, or plane: the one through 0 with matter above
 * Out:  lines of a name and a number:
 *       det      the least of J over quadrature points and a grid
 *       support  how far held dofs are off
 *       most     the largest nodal force
 *       left     of forces on free dofs away from the obstacle
 *       shape    by how much distances in the rigid group have changed, at most
 *       free     of the sum of the forces on the group, and of their moment about its first node over its size
 *       gap      the least of nodes on it
 *       along    of forces along the obstacle: components, of a sphere the moment about its centre
 *       press    the sum of what nodes are pressed with
 *       total0 ..  the force of the obstacle */
#include "quad_exact.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { NODES = 8, POINTS = 27, GRID = 5 };

typedef struct {
    char element[16], model[16], law[32];
    quad lambda, mu, part, size; /* size: of a free body, by its temperature */
    int dim, corners;            /* of a cell: nodes at most NODES */
    int64_t n, cells;
    int nodes;
    double *xyz, *u; /* n x dim */
    int64_t *cell;
    quad *force, *load;  /* n x dim: internal, outer */
    bool ring, averaged; /* averaged: W is that of F with the mean dilatation */
} body;

/* ---- reading */

static double number(void)
{
    double x;
    if (scanf("%lf", &x) != 1)
        exit(2);
    return x;
}

static int64_t index_below(int64_t end)
{
    long long i;
    if (scanf("%lld", &i) != 1 || i < -1 || i >= end)
        exit(2);
    return i;
}

static double *numbers(int64_t count)
{
    double *x = malloc((size_t)(count + 1) * sizeof *x);
    if (!x)
        abort();
    for (int64_t i = 0; i < count; i++)
        x[i] = number();
    return x;
}

static void read_body(body *b)
{
    if (scanf("%15s %15s %31s", b->element, b->model, b->law) != 3)
        exit(2);
    const quad poisson = number();
    b->part = number();
    b->size = 1 + b->part * number();
    b->mu = 1 / (2 * (1 + poisson));
    b->lambda = poisson / ((1 + poisson) * (1 - 2 * poisson));
    b->dim = (int)index_below(4);
    b->n = index_below((int64_t)1 << 32);
    b->cells = index_below((int64_t)1 << 32);
    b->nodes = b->element[0] == 't' ? 3 : strcmp(b->element, "quad4") == 0 ? 4 : 8;
    b->ring = strcmp(b->model, "axisymmetric") == 0;
    b->averaged = poisson >= 0.4 && strcmp(b->model, "plane_stress") != 0 &&
                  (strcmp(b->element, "quad4") == 0 || strcmp(b->element, "hex8") == 0);
    b->xyz = numbers(b->dim * b->n);
    b->cell = malloc((size_t)(b->cells * b->nodes + 1) * sizeof *b->cell);
    if (!b->cell)
        abort();
    for (int64_t i = 0; i < b->cells * b->nodes; i++)
        b->cell[i] = index_below(b->n);
    b->u = numbers(b->dim * b->n);
    b->force = quad_zeros(b->dim * b->n);
    b->load = quad_zeros(b->dim * b->n);
}

/* ---- numbers */

/* By the sum of its series, of a small x. */
static quad exponential(quad x)
{
    quad sum = 1, term = 1;
    for (int k = 1; k < 60; k++)
        sum += term *= x / k;
    return sum;
}

/* About the root in double precision e^y is x but for 1e-16: the first two terms of what is left are all. */
static quad logarithm(quad x)
{
    const quad y = log((double)x), part = exponential(-y / 64);
    quad left = x;
    for (int k = 0; k < 64; k++)
        left *= part;
    left -= 1;
    return y + left - left * left / 2;
}

static quad cube_root(quad x)
{
    quad root = cbrt((double)x);
    for (int k = 0; k < 3; k++)
        root = (2 * root + x / (root * root)) / 3;
    return root;
}

/* ---- elements */

static const int CORNER[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                 {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const int MIDDLE[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};

/* Values and derivatives by local coordinates: products of (1 + p x) / 2, of quad8 less the halves of the middles. */
static void shape(quad N[NODES], quad D[NODES][3], const body *b, const quad at[3])
{
    if (b->nodes == 3) {
        for (int a = 0; a < 3; a++)
            for (int i = 0; i < 2; i++)
                D[a][i] = a == 0 ? -1 : a == i + 1;
        N[0] = 1 - at[0] - at[1];
        N[1] = at[0];
        N[2] = at[1];
        return;
    }
    const int corners = b->dim == 3 ? 8 : 4;
    for (int a = 0; a < corners; a++) {
        quad factor[3];
        N[a] = 1;
        for (int i = 0; i < b->dim; i++)
            N[a] *= factor[i] = (1 + CORNER[a][i] * at[i]) / 2;
        for (int i = 0; i < b->dim; i++) {
            D[a][i] = (quad)CORNER[a][i] / 2;
            for (int j = 0; j < b->dim; j++)
                D[a][i] *= i == j ? 1 : factor[j];
        }
    }
    for (int m = 0; m < 4 && b->dim == 2 && b->nodes == 8; m++) {
        const int flat = MIDDLE[m][0] != 0, sign = MIDDLE[m][flat ? 0 : 1]; /* the axis along the side */
        const quad along = at[flat], across = at[!flat];
        N[4 + m] = (1 - along * along) * (1 + sign * across) / 2;
        D[4 + m][flat] = -along * (1 + sign * across);
        D[4 + m][!flat] = sign * (1 - along * along) / 2;
        for (int end = 0; end < 2; end++) {
            const int corner = (m + end) % 4;
            N[corner] -= N[4 + m] / 2;
            for (int i = 0; i < 2; i++)
                D[corner][i] -= D[4 + m][i] / 2;
        }
    }
}

/* Of 3 x 3 matrices; returns the determinant. */
static quad cofactors(quad C[3][3], quad A[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (i + 1) % 3, c = (i + 2) % 3, d = (j + 1) % 3, e = (j + 2) % 3;
            C[i][j] = A[a][d] * A[c][e] - A[a][e] * A[c][d];
        }
    return A[0][0] * C[0][0] + A[0][1] * C[0][1] + A[0][2] * C[0][2];
}

/* A point of a cell: F, gradients of shape functions before anything moves, N / r of rings, and the measure. */
typedef struct {
    quad F[3][3], grad[NODES][3], around[NODES], measure;
} point;

static void deform(point *x, const body *b, int64_t cell, const quad at[3])
{
    const int64_t *node = b->cell + cell * b->nodes;
    quad N[NODES], D[NODES][3], J[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, C[3][3], radius = 0, moved = 0;
    shape(N, D, b, at);
    for (int i = 0; i < b->dim; i++)
        for (int c = 0; c < b->dim; c++) {
            J[c][i] = 0;
            for (int a = 0; a < b->nodes; a++)
                J[c][i] += D[a][i] * b->xyz[b->dim * node[a] + c];
        }
    const quad det = x->measure = cofactors(C, J);
    for (int a = 0; a < b->nodes; a++) {
        for (int c = 0; c < b->dim; c++) {
            x->grad[a][c] = 0;
            for (int i = 0; i < b->dim; i++)
                x->grad[a][c] += D[a][i] * C[c][i] / det; /* the inverse transposed */
        }
        radius += N[a] * b->xyz[b->dim * node[a]];
        moved += N[a] * b->u[b->dim * node[a]];
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            x->F[i][j] = i == j;
            for (int a = 0; a < b->nodes && i < b->dim && j < b->dim; a++)
                x->F[i][j] += x->grad[a][j] * b->u[b->dim * node[a] + i];
        }
    if (b->ring) {
        x->F[2][2] += moved / radius;
        for (int a = 0; a < b->nodes; a++)
            x->around[a] = N[a] / radius;
        x->measure *= 2 * ((quad)3.14159265358979323846 + (quad)1.2246467991473532e-16) * radius;
    }
}

/* First Piola-Kirchhoff stress of F, and J, of a body that is as it is where it is free of stress. */
static quad piola_cold(quad P[3][3], const body *b, quad F[3][3])
{
    quad G[3][3], trace = 0;
    const quad J = cofactors(G, F), lambda = b->lambda, mu = b->mu;
    if (strcmp(b->law, "st_venant_kirchhoff") == 0) {
        quad S[3][3];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const quad E = (F[0][i] * F[0][j] + F[1][i] * F[1][j] + F[2][i] * F[2][j] - (i == j)) / 2;
                trace += i == j ? E : 0;
                S[i][j] = 2 * mu * E;
            }
        for (int i = 0; i < 3; i++)
            S[i][i] += lambda * trace;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                P[i][j] = F[i][0] * S[0][j] + F[i][1] * S[1][j] + F[i][2] * S[2][j];
        return J;
    }
    if (!(J > 0))
        return J;
    const quad root = cube_root(J), bulk = lambda + 2 * mu / 3;
    for (int i = 0; i < 9; i++)
        trace += F[i / 3][i % 3] * F[i / 3][i % 3];
    const bool plain = strcmp(b->law, "neo_hooke") == 0;
    const quad own = plain ? mu : mu / (root * root),
               inverse = plain ? lambda * logarithm(J) - mu : bulk * (J - 1) * J - own * trace / 3;
    for (int i = 0; i < 9; i++)
        P[i / 3][i % 3] = own * F[i / 3][i % 3] + inverse * G[i / 3][i % 3] / J;
    return J;
}

/* A warm body is one that was larger at rest: W(F / size) on size^3 of its volume. */
static quad piola(quad P[3][3], const body *b, quad F[3][3])
{
    quad own[3][3];
    for (int i = 0; i < 9; i++)
        own[i / 3][i % 3] = F[i / 3][i % 3] / b->size;
    const quad J = piola_cold(P, b, own);
    for (int i = 0; i < 9 && J > 0; i++)
        P[i / 3][i % 3] *= b->size * b->size;
    return J;
}

/* Gauss points of the cells; returns how many. */
static int rule(quad at[POINTS][3], quad weight[POINTS], const body *b)
{
    const bool three = b->dim == 2 && b->nodes == 8;
    const quad far = quad_sqrt(three ? (quad)3 / 5 : (quad)1 / 3);
    const int along = three ? 3 : 2, count = b->dim == 3 ? 8 : along * along;
    if (b->nodes == 3) {
        for (int k = 0; k < 3; k++) {
            at[k][0] = !b->ring ? (quad)1 / 3 : k == 1 ? (quad)2 / 3 : (quad)1 / 6;
            at[k][1] = !b->ring ? (quad)1 / 3 : k == 2 ? (quad)2 / 3 : (quad)1 / 6;
            weight[k] = b->ring ? (quad)1 / 6 : (quad)1 / 2;
        }
        return b->ring ? 3 : 1;
    }
    for (int k = 0; k < count; k++) {
        weight[k] = 1;
        for (int i = 0, left = k; i < b->dim; i++, left /= along) {
            const int step = left % along;
            at[k][i] = three ? (step - 1) * far : (2 * step - 1) * far;
            weight[k] *= !three ? 1 : step == 1 ? (quad)8 / 9 : (quad)5 / 9;
        }
    }
    return count;
}

/* dW/dF of W(s F), s = (theta / J)^(1/n), at a given theta: s (P - t F^-T / n) with P of s F and t = P : F, over the n
 * directions. Returns dW / dtheta = s t / (n theta). */
static quad mean_piola(quad P[3][3], const body *b, const point *x, quad theta)
{
    const int n = b->dim == 3 || b->ring ? 3 : 2;
    quad F[3][3], own[3][3], G[3][3], t = 0;
    memcpy(own, x->F, sizeof own);
    memcpy(F, x->F, sizeof F);
    const quad J = cofactors(G, own), s = n == 3 ? cube_root(theta / J) : quad_sqrt(theta / J);
    for (int i = 0; i < 9; i++)
        F[i / 3][i % 3] *= i < 8 || n == 3 ? s : 1;
    (void)piola(P, b, F);
    for (int i = 0; i < 9; i++)
        t += i < 8 || n == 3 ? P[i / 3][i % 3] * own[i / 3][i % 3] : 0;
    for (int i = 0; i < 9; i++)
        if (i < 8 || n == 3)
            P[i / 3][i % 3] = s * (P[i / 3][i % 3] - t / n * G[i / 3][i % 3] / J);
    return s * t / (n * theta);
}

/* Of a cell whose J are positive the mean of J, and of dW / dtheta. */
static void find_mean(quad *theta, quad *pressure, const body *b, int64_t e, const quad at[POINTS][3],
                      const quad weight[POINTS], int count)
{
    quad volume = 0, P[3][3], G[3][3];
    *theta = *pressure = 0;
    for (int k = 0; k < 2 * count; k++) {
        point x;
        deform(&x, b, e, at[k % count]);
        const quad own = weight[k % count] * x.measure;
        if (k == count)
            *theta /= volume;
        if (k < count)
            *theta += own * cofactors(G, x.F);
        else
            *pressure += own * mean_piola(P, b, &x, *theta) / volume;
        volume += k < count ? own : 0;
    }
}

/* Internal forces. Returns the least J at their points and those of a grid. */
static quad add_forces(body *b)
{
    quad at[POINTS][3] = {{0}}, weight[POINTS], least = INFINITY, theta = 0, pressure = 0;
    const int count = rule(at, weight, b), grid = b->nodes == 3 ? 0 : b->dim == 3 ? GRID * GRID * GRID : GRID * GRID;
    for (int64_t e = 0; e < b->cells; e++) {
        quad P[3][3], G[3][3];
        point x;
        if (b->averaged)
            find_mean(&theta, &pressure, b, e, at, weight, count);
        for (int k = 0; k < count; k++) {
            deform(&x, b, e, at[k]);
            const quad J = piola(P, b, x.F);
            least = J < least ? J : least;
            if (b->averaged && J > 0) {
                (void)mean_piola(P, b, &x, theta);
                (void)cofactors(G, x.F);
                for (int i = 0; i < 9; i++)
                    P[i / 3][i % 3] += pressure * G[i / 3][i % 3];
            }
            for (int a = 0; a < b->nodes && J > 0; a++)
                for (int i = 0; i < b->dim; i++) {
                    quad sum = b->ring && i == 0 ? P[2][2] * x.around[a] : 0;
                    for (int j = 0; j < b->dim; j++)
                        sum += P[i][j] * x.grad[a][j];
                    b->force[b->dim * b->cell[e * b->nodes + a] + i] += weight[k] * x.measure * sum;
                }
        }
        for (int k = 0; k < grid; k++) {
            const int along[3] = {k % GRID, k / GRID % GRID, k / (GRID * GRID)};
            const quad place[3] = {(quad)along[0] / 2 - 1, (quad)along[1] / 2 - 1, (quad)along[2] / 2 - 1};
            deform(&x, b, e, place);
            const quad J = piola(P, b, x.F);
            least = J < least ? J : least;
        }
    }
    return least;
}

/* ---- what is left over */

static void tell(const char *name, quad value)
{
    printf("%s %.17g\n", name, (double)value);
}

static quad larger(quad a, quad b)
{
    return quad_abs(b) > a ? quad_abs(b) : a;
}

/* Held dofs are marked. */
static void look_at_supports(bool *taken, const body *b)
{
    quad off = 0;
    for (int64_t count = index_below((int64_t)1 << 32); count > 0; count--) {
        const int64_t node = index_below(b->n), axis = index_below(b->dim);
        off = larger(off, b->u[b->dim * node + axis] - b->part * number());
        taken[b->dim * node + axis] = true;
    }
    tell("support", off);
}

/* Straight sides: halves, or by Simpson's rule. */
static void add_loads(body *b)
{
    for (int64_t count = index_below((int64_t)1 << 32); count > 0; count--) {
        const int64_t first = index_below(b->n), last = index_below(b->n), middle = index_below(b->n);
        quad square = 0;
        for (int c = 0; c < b->dim; c++) {
            const quad way = (quad)b->xyz[b->dim * last + c] - b->xyz[b->dim * first + c];
            square += way * way;
        }
        for (int c = 0; c < b->dim; c++) {
            const quad all = number() * quad_sqrt(square) * b->part, end = middle < 0 ? all / 2 : all / 6;
            b->load[b->dim * first + c] += end;
            b->load[b->dim * last + c] += end;
            if (middle >= 0)
                b->load[b->dim * middle + c] += 4 * all / 6;
        }
    }
}

static quad distance(const body *b, int64_t first, int64_t last, bool moved)
{
    quad square = 0;
    for (int c = 0; c < b->dim; c++) {
        const int64_t to = b->dim * last + c, from = b->dim * first + c;
        const quad way = (quad)b->xyz[to] - b->xyz[from] + (moved ? (quad)b->u[to] - b->u[from] : 0);
        square += way * way;
    }
    return quad_sqrt(square);
}

/* What springs pull with, spread over the sides by their length at rest, as loads are. */
static void add_springs(body *b)
{
    const int64_t count = index_below((int64_t)1 << 32);
    double stiff[3] = {0};
    quad whole = 0, *share = calloc((size_t)b->n, sizeof *share);
    if (!share)
        abort();
    for (int c = 0; c < b->dim && count > 0; c++)
        stiff[c] = number();
    for (int64_t k = 0; k < count; k++) {
        const int64_t first = index_below(b->n), last = index_below(b->n), middle = index_below(b->n);
        const quad length = distance(b, first, last, false), end = middle < 0 ? length / 2 : length / 6;
        whole += length;
        share[first] += end;
        share[last] += end;
        if (middle >= 0)
            share[middle] += 4 * length / 6;
    }
    for (int64_t i = 0; i < b->dim * b->n && count > 0; i++)
        b->load[i] -= share[i / b->dim] / whole * stiff[i % b->dim] * b->u[i];
    free(share);
}

/* Its nodes are marked as the caller reads them. */
static void look_at_group(const body *b, const int64_t *node, int64_t count)
{
    quad shape = 0, free = 0, size = 0, sum[3] = {0}, moment[3] = {0};
    for (int64_t k = 0; k < count; k++) {
        quad way[3] = {0}, f[3] = {0};
        for (int64_t j = 0; j < k; j++)
            shape = larger(shape, distance(b, node[j], node[k], true) - distance(b, node[j], node[k], false));
        size = larger(size, distance(b, node[0], node[k], false));
        for (int c = 0; c < b->dim; c++) {
            const int64_t at = b->dim * node[k] + c, from = b->dim * node[0] + c;
            way[c] = (quad)b->xyz[at] + b->u[at] - b->xyz[from] - b->u[from];
            f[c] = b->force[at] - b->load[at];
            sum[c] += f[c];
        }
        for (int c = 0; c < 3; c++)
            moment[c] += way[(c + 1) % 3] * f[(c + 2) % 3] - way[(c + 2) % 3] * f[(c + 1) % 3];
    }
    for (int c = 0; c < 3 && count > 0; c++)
        free = larger(larger(free, sum[c]), moment[c] / size);
    tell("shape", shape);
    tell("free", free);
}

/* What the obstacle does to its nodes: gaps, what presses, and what does not. */
static void look_at_obstacle(const body *b, const int64_t *on, int64_t count)
{
    char kind[16];
    double centre[3] = {0}, radius = 0;
    quad gap = INFINITY, press = 0, along = 0, moment[3] = {0}, total[3] = {0};
    if (scanf("%15s", kind) != 1)
        exit(2);
    const bool round = strcmp(kind, "sphere") == 0;
    for (int c = 0; c < b->dim && round; c++)
        centre[c] = number();
    if (round)
        radius = number();
    for (int64_t k = 0; k < count; k++) {
        quad way[3] = {0}, f[3] = {0}, square = 0;
        for (int c = 0; c < b->dim; c++) {
            way[c] = (quad)b->xyz[b->dim * on[k] + c] + b->u[b->dim * on[k] + c] - centre[c];
            f[c] = b->force[b->dim * on[k] + c] - b->load[b->dim * on[k] + c];
            total[c] += f[c];
            square += way[c] * way[c];
        }
        const quad size = quad_sqrt(square), own = round ? size - radius : way[1];
        gap = own < gap ? own : gap;
        press += round ? (f[0] * way[0] + f[1] * way[1] + f[2] * way[2]) / size : f[1];
        for (int c = 0; c < 3; c++) {
            moment[c] += way[(c + 1) % 3] * f[(c + 2) % 3] - way[(c + 2) % 3] * f[(c + 1) % 3];
            along = round || c == 1 ? along : larger(along, f[c]);
        }
    }
    for (int c = 0; c < 3 && round; c++)
        along = larger(along, moment[c] / radius);
    tell("gap", gap);
    tell("press", press);
    tell("along", along);
    for (int c = 0; c < b->dim; c++)
        printf("total%d %.17g\n", c, (double)total[c]);
}

int main(void)
{
    body b = {.dim = 0};
    quad most = 0, left = 0;
    read_body(&b);
    const int64_t n = b.dim * b.n;
    bool *taken = calloc((size_t)n + 1, sizeof *taken);
    int64_t *on = calloc((size_t)b.n + 1, sizeof *on);
    if (!taken || !on)
        abort();
    look_at_supports(taken, &b);
    const int64_t count = index_below(b.n + 1);
    for (int64_t k = 0; k < count; k++) {
        on[k] = index_below(b.n);
        for (int c = 0; c < b.dim; c++)
            taken[b.dim * on[k] + c] = true;
    }
    add_loads(&b);
    add_springs(&b);
    const int64_t in_group = index_below(b.n + 1);
    int64_t *group = calloc((size_t)in_group + 1, sizeof *group);
    if (!group)
        abort();
    for (int64_t k = 0; k < in_group; k++) {
        group[k] = index_below(b.n);
        for (int c = 0; c < b.dim; c++)
            taken[b.dim * group[k] + c] = true;
    }
    tell("det", add_forces(&b));
    for (int64_t i = 0; i < n; i++) {
        most = larger(most, b.force[i]);
        left = taken[i] ? left : larger(left, b.force[i] - b.load[i]);
    }
    tell("most", most);
    tell("left", left);
    look_at_group(&b, group, in_group);
    look_at_obstacle(&b, on, count);
    free(group);
    free(taken);
    free(on);
    free(b.xyz);
    free(b.u);
    free(b.cell);
    free(b.force);
    free(b.load);
    return 0;
}
