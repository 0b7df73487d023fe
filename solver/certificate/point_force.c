/* point_force.c: in extended precision. With s the shares of the group's nodes, r their places at rest from the centre
 * and y where they are, R is the rotation without sum s (R r) x y, and the point is at the mean of y and R a, a its arm
 * at rest. Along straight ways of nodes y + t d, with D = sum s d (R r)' and S = sum s y (R r)', R turns by w,
 *
 *     B w = sum s (R r) x d,    B w' = w x S w + 2 (D' w - tr(D) w),    B = tr(S) I - S
 *
 * so that the work F . R a, and M times the angle in the plane, has the second derivative
 * (R a x F + M) . w' + F . (w x (w x R a)), a quadratic form of D, whose entries are linear in displacements. */
#include "certificate/point_force.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"

#include <string.h>

/* Rotations about one axis after the other, each by the best angle but for the first ones, which leave saddles, until
 * none is left. */
enum { MOST_SWEEPS = 10000 };
#define SETTLED 1e-17L

typedef struct {
    const uz_finite_answer *of;
    const uz_load *load;
    double *share;
    long double *r; /* n_nodes x 3: R r */
    long double S[9], inverse[9], arm[3], b[3];
} point_at;

static void cross(long double out[3], const long double a[3], const long double b[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

static void apply(long double out[3], const long double A[9], const long double v[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = A[3 * c] * v[0] + A[3 * c + 1] * v[1] + A[3 * c + 2] * v[2];
}

static void rotate(long double v[3], int axis, long double angle)
{
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const long double at = v[i];
    v[i] = cosl(angle) * at - sinl(angle) * v[j];
    v[j] = sinl(angle) * at + cosl(angle) * v[j];
}

/* S becomes that of R: rows of M = sum s y r', turned. R: columns are what it makes of the axes. */
static void turn(long double R[3][3], long double S[9], int dim)
{
    long double most = 1;
    for (int sweep = 0; sweep < MOST_SWEEPS && most > SETTLED; sweep++) {
        most = 0;
        for (int axis = dim == 2 ? 2 : 0; axis < 3; axis++) {
            const int i = (axis + 1) % 3, j = (axis + 2) % 3;
            const long double best = atan2l(S[3 * j + i] - S[3 * i + j], S[4 * i] + S[4 * j]);
            const long double angle = sweep == 0 && dim == 3 ? best + axis + 1 : best; /* off what is symmetric */
            for (int k = 0; k < 3; k++) {
                rotate(S + 3 * k, axis, angle);
                rotate(R[k], axis, angle);
            }
            most = fmaxl(most, fabsl(angle));
        }
    }
}

/* B^-1 about the axes that the group turns about; false: B is not positive definite, and R not the best rotation. */
static bool invert(long double out[9], const long double S[9], int dim)
{
    long double B[9], rows[3][3];
    for (int k = 0; k < 9; k++)
        B[k] = (k % 4 == 0 ? S[0] + S[4] + S[8] : 0) - (S[k] + S[k % 3 * 3 + k / 3]) / 2;
    memset(out, 0, 9 * sizeof *out);
    if (dim == 2) {
        out[8] = 1 / B[8];
        return B[8] > 0;
    }
    for (int c = 0; c < 3; c++)
        cross(rows[c], B + 3 * ((c + 1) % 3), B + 3 * ((c + 2) % 3));
    const long double det = B[0] * rows[0][0] + B[1] * rows[0][1] + B[2] * rows[0][2];
    for (int k = 0; k < 9; k++)
        out[k] = rows[k % 3][k / 3] / det;
    return B[0] > 0 && B[0] * B[4] - B[1] * B[3] > 0 && det > 0;
}

static uz_status find(point_at *x, const uz_finite_answer *of, const uz_load *load, uz_error *err)
{
    const uz_mesh *mesh = &of->model->mesh;
    const int dim = mesh->dim;
    const uz_group *group = uz_mesh_group(mesh, load->on, "/loads", err);
    long double rest[3] = {0}, now[3] = {0}, R[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, force[3], moment[3];
    *x = (point_at){.of = of, .load = load};
    if (!group)
        return UZ_ERR_SCENE;
    x->share = uz_alloc_zero(mesh->n_nodes, sizeof *x->share);
    x->r = uz_alloc_zero(3 * mesh->n_nodes, sizeof *x->r);
    if (!x->share || !x->r)
        return uz_no_memory(err, "a force at a point");
    const uz_status status = uz_spread_over_group(x->share, of->model, group, false, "/loads", err);
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < dim * mesh->n_nodes; i++) {
        rest[i % dim] += (long double)x->share[i / dim] * mesh->xyz[i];
        now[i % dim] += x->share[i / dim] * ((long double)mesh->xyz[i] + of->u[i]);
    }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (int k = 0; k < dim * dim && x->share[a] != 0; k++) {
            const int64_t at = dim * a + k / dim, by = dim * a + k % dim;
            x->S[3 * (k / dim) + k % dim] +=
                x->share[a] * (mesh->xyz[at] + of->u[at] - now[k / dim]) * (mesh->xyz[by] - rest[k % dim]);
        }
    turn(R, x->S, dim);
    if (!invert(x->inverse, x->S, dim))
        return uz_fail(err, UZ_ERR_SCENE, "/loads", "no rotation of \"%.63s\" can be told", load->on);
    for (int64_t i = 0; i < 3 * dim * mesh->n_nodes; i++) {
        const int64_t a = i / 3 / dim;
        const int c = (int)(i / 3 % dim);
        x->r[3 * a + i % 3] += x->share[a] != 0 ? R[c][i % 3] * (mesh->xyz[dim * a + c] - rest[c]) : 0;
    }
    for (int i = 0; i < 3 * dim; i++)
        x->arm[i % 3] += R[i / 3][i % 3] * (load->point[i / 3] - rest[i / 3]);
    for (int c = 0; c < 3; c++)
        force[c] = load->v[c];
    cross(moment, x->arm, force);
    for (int c = 0; c < 3; c++)
        moment[c] += load->moment[c];
    apply(x->b, x->inverse, moment);
    return UZ_OK;
}

/* The second derivative along D. */
static long double bend(const point_at *x, const long double D[9])
{
    long double q[3], w[3], along[3], change[3], once[3], twice[3], sum = 0;
    for (int c = 0; c < 3; c++)
        q[c] = D[3 * ((c + 2) % 3) + (c + 1) % 3] - D[3 * ((c + 1) % 3) + (c + 2) % 3];
    apply(w, x->inverse, q);
    apply(along, x->S, w);
    cross(change, w, along);
    cross(once, w, x->arm);
    cross(twice, w, once);
    for (int c = 0; c < 3; c++) {
        change[c] += 2 * (D[c] * w[0] + D[3 + c] * w[1] + D[6 + c] * w[2] - (D[0] + D[4] + D[8]) * w[c]);
        sum += x->b[c] * change[c] + x->load->v[c] * twice[c];
    }
    return sum;
}

/* C (dim^2 x d): entries of D by dofs. */
static void subtract(uz_csc *K, const point_at *x, const double *C, int dim)
{
    const int n = dim * dim;
    double H[9][9];
    for (int p = 0; p < n; p++)
        for (int q = 0; q < n; q++) {
            long double sum[9] = {0}, difference[9] = {0};
            sum[3 * (p / dim) + p % dim] += 1;
            difference[3 * (p / dim) + p % dim] += 1;
            sum[3 * (q / dim) + q % dim] += 1;
            difference[3 * (q / dim) + q % dim] -= 1;
            H[p][q] = (double)((bend(x, sum) - bend(x, difference)) / 4);
        }
    for (int64_t j = 0; j < K->cols; j++) {
        double by[9] = {0};
        bool any = false;
        for (int p = 0; p < n; p++)
            for (int q = 0; q < n; q++)
                by[p] += H[p][q] * C[q * K->cols + j];
        for (int p = 0; p < n; p++)
            any = any || by[p] != 0;
        for (int64_t at = K->ptr[j]; at < K->ptr[j + 1] && any; at++)
            for (int p = 0; p < n; p++)
                K->val[at] -= C[p * K->cols + K->idx[at]] * by[p];
    }
}

static uz_status add(double *f, uz_body_model *tangent, const uz_finite_answer *of, const uz_load *load, uz_error *err)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    const int64_t n = model->mesh.n_nodes;
    point_at x;
    uz_status status = find(&x, of, load, err);
    double *C = uz_alloc(dim * dim * model->d, sizeof *C), *room = uz_alloc(dim * n, sizeof *room);
    if (status == UZ_OK && (!C || !room))
        status = uz_no_memory(err, "a force at a point");
    for (int p = 0; p < dim * dim && status == UZ_OK; p++) {
        for (int64_t i = 0; i < dim * n; i++)
            room[i] = i % dim == p / dim ? (double)(x.share[i / dim] * x.r[3 * (i / dim) + p % dim]) : 0;
        uz_gather_nodal(C + p * model->d, model, room);
    }
    if (status == UZ_OK)
        subtract(&tangent->K, &x, C, dim);
    for (int64_t a = 0; a < n && status == UZ_OK; a++) {
        long double turned[3];
        cross(turned, x.b, x.r + 3 * a);
        for (int c = 0; c < dim; c++)
            f[dim * a + c] += (double)(x.share[a] * (load->v[c] + turned[c]));
    }
    uz_free_all(C, room, x.share, x.r);
    return status;
}

uz_status uz_point_forces(double *f, uz_body_model *tangent, const uz_finite_answer *of, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < of->scene->n_loads && status == UZ_OK; i++)
        if (of->scene->loads[i].has_point)
            status = add(f, tangent, of, &of->scene->loads[i], err);
    return status;
}
