#include "finite/point_load.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/check.h"

#include <math.h>
#include <string.h>

/* B of a group that has a rotation is not less than this part of its largest entry. */
#define LEAST_B 1e-12
/* R by powers of a matrix whose eigenvector it is, each the square of the one before: 2^SQUARES. */
enum { SQUARES = 40, MOST_FUNCTIONALS = 6 };

/* A group and its point where they are. */
typedef struct {
    const uz_body_model *model;
    const uz_load *load;
    double *share, *r; /* n_nodes; n_nodes x 3: R r */
    double arm[3];     /* R a */
    double S[9], B[9], inverse[9];
    double m[3];
    int first, turns; /* axes of rotation: first, first + 1 ... */
} point_at;

static void clear_point(point_at *x)
{
    uz_free_all(x->share, x->r);
}

static void multiply(double *out, const double *R, const double *v)
{
    double turned[3] = {0};
    for (int i = 0; i < 9; i++)
        turned[i / 3] += R[i] * v[i % 3];
    memcpy(out, turned, sizeof turned);
}

/* The rotation for which sum M_ij R_ij is largest, by its quaternion: the eigenvector of the largest eigenvalue (B.
 * Horn, "Closed-form solution of absolute orientation using unit quaternions", J. Opt. Soc. Am. A 4 (1987) 629-642). */
static void fit_in_space(double R[9], const double M[9])
{
    const double trace = M[0] + M[4] + M[8];
    double N[4][4] = {{trace}}, size = 0;
    for (int c = 0; c < 3; c++) {
        const int i = (c + 1) % 3, j = (c + 2) % 3;
        N[0][c + 1] = N[c + 1][0] = M[3 * j + i] - M[3 * i + j];
        N[c + 1][c + 1] = 2 * M[4 * c] - trace;
        N[i + 1][j + 1] = N[j + 1][i + 1] = M[3 * i + j] + M[3 * j + i];
    }
    for (int k = 0; k < 16; k++)
        size = fmax(size, fabs(N[k / 4][k % 4]));
    for (int k = 0; k < 4; k++)
        N[k][k] += 4 * size; /* positive definite */
    for (int step = 0; step < SQUARES; step++) {
        double square[4][4] = {{0}}, most = 0;
        for (int k = 0; k < 64; k++)
            square[k / 16][k / 4 % 4] += N[k / 16][k % 4] * N[k % 4][k / 4 % 4];
        for (int k = 0; k < 4; k++)
            most = fmax(most, square[k][k]);
        for (int k = 0; k < 16; k++)
            N[k / 4][k % 4] = most > 0 ? square[k / 4][k % 4] / most : k % 5 == 0;
    }
    int most = 0;
    for (int k = 1; k < 4; k++)
        most = N[k][k] > N[most][most] ? k : most;
    double *q = N[most], w[3], length = 0;
    for (int k = 0; k < 4; k++)
        length = hypot(length, q[k]);
    for (int c = 0; c < 3; c++)
        w[c] = q[c + 1] / length;
    const double sine = uz_unit3(w), angle = 2 * atan2(sine, q[0] / length);
    for (int c = 0; c < 3; c++)
        w[c] *= angle;
    uz_rotation(R, w);
}

/* M = sum s y r' from that of the group's centres. */
static void fit(double R[9], const double M[9], int dim)
{
    if (dim == 3)
        fit_in_space(R, M);
    else
        uz_rotation(R, (double[3]){0, 0, atan2(M[3] - M[1], M[0] + M[4])});
}

/* Of B, of the axes that the group turns about. False: it has no rotation. */
static bool invert(point_at *x)
{
    double rows[3][3], size = 0;
    const double *B = x->B;
    memset(x->inverse, 0, sizeof x->inverse);
    for (int c = 0; c < 3; c++)
        size = fmax(size, fabs(B[4 * c]));
    if (x->turns == 1) {
        x->inverse[8] = 1 / B[8];
        return B[8] > LEAST_B * size;
    }
    for (int c = 0; c < 3; c++)
        uz_cross3(rows[c], B + 3 * ((c + 1) % 3), B + 3 * ((c + 2) % 3));
    const double det = uz_dot3(B, rows[0]);
    for (int i = 0; i < 9; i++)
        x->inverse[i] = rows[i % 3][i / 3] / det;
    return det > LEAST_B * size * size * size;
}

static uz_status find_point(point_at *x, const uz_body_model *model, const uz_scene *scene, int64_t i, const double *u,
                            uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    double rest[3] = {0}, now[3] = {0}, M[9] = {0}, R[9], moment[3];
    const char *where = UZ_PLACE("loads", i, "on");
    *x = (point_at){.model = model, .load = &scene->loads[i], .first = dim == 2 ? 2 : 0, .turns = dim == 2 ? 1 : 3};
    const uz_group *group = uz_mesh_group(mesh, x->load->on, where, err);
    if (!group)
        return UZ_ERR_SCENE;
    x->share = uz_alloc_zero(mesh->n_nodes, sizeof *x->share);
    x->r = uz_alloc_zero(3 * mesh->n_nodes, sizeof *x->r);
    if (!x->share || !x->r)
        return uz_no_memory(err, "a force at a point");
    const uz_status status = uz_spread_over_group(x->share, model, group, false, where, err);
    if (status != UZ_OK)
        return status;
    for (int64_t k = 0; k < mesh->n_nodes * dim; k++) {
        rest[k % dim] += x->share[k / dim] * mesh->xyz[k];
        now[k % dim] += x->share[k / dim] * (mesh->xyz[k] + u[k]);
    }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (int c = 0; c < dim && x->share[a] != 0; c++) {
            x->r[3 * a + c] = mesh->xyz[dim * a + c] - rest[c];
            for (int k = 0; k < dim; k++)
                M[3 * k + c] += x->share[a] * (mesh->xyz[dim * a + k] + u[dim * a + k] - now[k]) *
                                (mesh->xyz[dim * a + c] - rest[c]);
        }
    fit(R, M, dim);
    for (int k = 0; k < 27; k++) /* S = M R' */
        x->S[k / 3] += M[k / 9 * 3 + k % 3] * R[k / 3 % 3 * 3 + k % 3];
    for (int k = 0; k < 9; k++)
        x->B[k] = (k % 4 == 0 ? x->S[0] + x->S[4] + x->S[8] : 0) - 0.5 * (x->S[k] + x->S[k % 3 * 3 + k / 3]);
    if (!invert(x))
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "\"%.63s\" is %s, and bears no moment: leave at and moment out, or name more of the body",
                       group->name, dim == 2 ? "one point" : "on a line");
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        if (x->share[a] != 0)
            multiply(x->r + 3 * a, R, x->r + 3 * a);
    for (int c = 0; c < dim; c++)
        x->arm[c] = x->load->point[c] - rest[c];
    multiply(x->arm, R, x->arm);
    uz_cross3(moment, x->arm, x->load->v);
    for (int c = 0; c < 3; c++)
        moment[c] += x->load->moment[c];
    multiply(x->m, x->inverse, moment);
    return UZ_OK;
}

uz_status uz_point_load(double *f, const uz_body_model *model, const uz_scene *scene, int64_t i, const double *u,
                        uz_error *err)
{
    const int dim = model->mesh.dim;
    point_at x;
    const uz_status status = find_point(&x, model, scene, i, u, err);
    for (int64_t a = 0; a < model->mesh.n_nodes && status == UZ_OK; a++) {
        double turned[3];
        uz_cross3(turned, x.m, x.r + 3 * a);
        for (int c = 0; c < dim && x.share[a] != 0; c++)
            f[dim * a + c] += x.share[a] * (x.load->v[c] + turned[c]);
    }
    clear_point(&x);
    return status;
}

/* e_k x (e_l x v), the mean of both orders. */
static void turn_twice(double out[3], int k, int l, const double v[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = 0.5 * ((c == l ? v[k] : 0) + (c == k ? v[l] : 0)) - (k == l ? v[c] : 0);
}

/* Z: the inverse of the Lagrangian's second derivatives in R and m, by axes of rotation, which are (A, -B; -B, 0). */
static void invert_second(double Z[MOST_FUNCTIONALS][MOST_FUNCTIONALS], const point_at *x)
{
    double A[9] = {0};
    for (int k = 0; k < x->turns * x->turns; k++) {
        double turned[3];
        const int p = x->first + k / x->turns, q = x->first + k % x->turns;
        turn_twice(turned, p, q, x->arm);
        A[3 * p + q] = uz_dot3(x->load->v, turned);
        for (int c = 0; c < 3; c++) { /* m . sum s (twice turned R r) x y, and sum s y (R r)' = S */
            const int i = (c + 1) % 3, j = (c + 2) % 3;
            double at_i[3], at_j[3];
            turn_twice(at_i, p, q, x->S + 3 * j);
            turn_twice(at_j, p, q, x->S + 3 * i);
            A[3 * p + q] += x->m[c] * (at_i[i] - at_j[j]);
        }
    }
    for (int k = 0; k < x->turns; k++)
        for (int l = 0; l < x->turns; l++) { /* 0, -1 / B; -1 / B, -1 / B A / B */
            const double *row = x->inverse + 3 * (x->first + k), *column = x->inverse + x->first + l;
            Z[k][l] = Z[x->turns + k][x->turns + l] = 0;
            Z[k][x->turns + l] = Z[x->turns + l][k] = -row[x->first + l];
            for (int i = 0; i < 9; i++)
                Z[x->turns + k][x->turns + l] -= row[i / 3] * A[i] * column[i % 3 * 3];
        }
}

/* Of dofs: the derivative in displacements of what Z is of. room: n_nodes x dim. */
static void find_functional(double *out, double *room, const point_at *x, int k)
{
    const int dim = x->model->mesh.dim, axis = x->first + k % x->turns;
    const double e[3] = {axis == 0, axis == 1, axis == 2};
    for (int64_t a = 0; a < x->model->mesh.n_nodes; a++) {
        double v[3];
        uz_cross3(v, e, x->r + 3 * a);
        if (k < x->turns)
            uz_cross3(v, x->m, (double[3]){v[0], v[1], v[2]});
        for (int c = 0; c < dim; c++)
            room[dim * a + c] = x->share[a] * v[c];
    }
    uz_gather_nodal(out, x->model, room);
}

uz_status uz_point_tangent(uz_body_model *tangent, const uz_scene *scene, int64_t i, const double *u, uz_error *err)
{
    const int64_t d = tangent->d, n = tangent->mesh.n_nodes * tangent->mesh.dim;
    double Z[MOST_FUNCTIONALS][MOST_FUNCTIONALS];
    uz_csc *K = &tangent->K;
    point_at x;
    uz_status status = find_point(&x, tangent, scene, i, u, err);
    const int rank = 2 * x.turns;
    double *C = uz_alloc(rank * d, sizeof *C), *room = uz_alloc(n, sizeof *room);
    if (status == UZ_OK && (!C || !room))
        status = uz_no_memory(err, "a force at a point");
    if (status == UZ_OK)
        invert_second(Z, &x);
    for (int k = 0; k < rank && status == UZ_OK; k++)
        find_functional(C + k * d, room, &x, k);
    for (int64_t j = 0; j < d && status == UZ_OK; j++) {
        double by[MOST_FUNCTIONALS] = {0}, any = 0;
        for (int k = 0; k < rank * rank; k++)
            by[k / rank] += Z[k / rank][k % rank] * C[k % rank * d + j];
        for (int k = 0; k < rank; k++)
            any = fmax(any, fabs(C[k * d + j]));
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1] && any > 0; q++)
            for (int k = 0; k < rank; k++)
                K->val[q] += C[k * d + K->idx[q]] * by[k];
    }
    uz_free_all(C, room);
    clear_point(&x);
    return status;
}
