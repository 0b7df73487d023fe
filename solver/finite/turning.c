/* turning.c: what concerns Gauss points stands in lanes by four of them, what concerns pairs of nodes by four nodes. */
#include "finite/turning.h"

#include "assembly/parts.h"
#include "core/cpu.h"
#include "element/element.h"
#include "finite/point_lanes.h"

#include <math.h>
#include <string.h>

enum { LANES = UZ_FINITE_LANES, GROUPS = UZ_ELEMENT_NODES / UZ_FINITE_LANES };
typedef uz_four four;

UZ_INLINE void multiply(four out[3][3], four A[3][3], four B[3][3], int dim)
{
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) {
            out[i][j] = A[i][0] * B[0][j];
            for (int k = 1; k < dim; k++)
                out[i][j] += A[i][k] * B[k][j];
        }
}

/* R of a skew w (both dim x dim): (I + w) V^-1 with V^2 = I - w^2. square: |w|^2. */
UZ_INLINE void rotation(four *square, four R[3][3], four w[3][3], int dim)
{
    four root = {0}, ww[3][3];
    *square = (four){0};
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < i; j++)
            *square += w[i][j] * w[i][j];
    for (int l = 0; l < LANES; l++)
        root[l] = sqrt(1 + (*square)[l]);
    multiply(ww, w, w, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            R[i][j] = (i == j) + w[i][j] / root + ww[i][j] / (root * (root + 1));
}

/* H, of where a step begins, becomes what a turned step changes it by; h is the step's. turning, strain: the
 * integrands. */
UZ_INLINE void turn(four *turning, four *strain, four H[3][3], four h[3][3], int dim)
{
    four F[3][3], transposed[3][3], inverse[3][3], det, g[3][3], w[3][3], stretch[3][3], R[3][3], to[3][3], square;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            F[i][j] = H[i][j] + (i == j);
    uz_lane_invert(transposed, &det, F, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            inverse[i][j] = transposed[j][i];
    multiply(g, h, inverse, dim);
    *strain = (four){0};
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) {
            const four own = 0.5 * (g[i][j] + g[j][i]);
            *strain += own * own;
            stretch[i][j] = own + (i == j);
            w[i][j] = 0.5 * (g[i][j] - g[j][i]);
        }
    rotation(&square, R, w, dim);
    *turning = 0.5 * square * square; /* w'w is |w|^2 along both directions that turn */
    multiply(to, stretch, F, dim);
    multiply(H, R, to, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            H[i][j] -= F[i][j];
}

/* An element that a step is taken from u by, or whose metric is made. */
typedef struct {
    const uz_finite_rule *rule;
    const uz_element *element;
    const double *u, *step, *near; /* near: from u on; NULL: there */
} task;

/* force: nodes x dim. */
UZ_INLINE void add_turning(uz_turning *out, double *force, const task *x, int dim)
{
    const uz_finite_rule *rule = x->rule;
    const bool ring = dim == 2 && rule->model == UZ_AXISYMMETRIC;
    uz_rest rest;
    uz_gradients from, by, near;
    four sum[3][GROUPS] = {{{0}}};
    uz_rest_of(&rest, rule, x->element, dim, ring);
    uz_find_gradients(from, rule, &rest, x->u, dim, ring);
    uz_find_gradients(by, rule, &rest, x->step, dim, ring);
    if (x->near)
        uz_find_gradients(near, rule, &rest, x->near, dim, ring);
    for (int p = 0; p < rule->gauss; p += LANES) {
        four H[3][3], h[3][3], turning, strain, around = {0};
        const four weight = x->element->lame.mu * *uz_four_from(&rest.volume[p]);
        for (int c = 0; c < dim; c++)
            for (int i = 0; i < dim; i++) {
                H[c][i] = *uz_four_from(&from[c][i][p]);
                h[c][i] = *uz_four_from(&by[c][i][p]);
            }
        turn(&turning, &strain, H, h, dim);
        for (int c = 0; c < dim && x->near; c++)
            for (int i = 0; i < dim; i++)
                H[c][i] -= *uz_four_from(&near[c][i][p]);
        if (ring) {
            around = *uz_four_from(&by[2][2][p]);
            if (x->near)
                around -= *uz_four_from(&near[2][2][p]);
            around = weight * around * *uz_four_from(&rest.per_radius[p]);
        }
        for (int g = p; g < p + LANES && g < rule->gauss; g++) {
            out->turning += weight[g - p] * turning[g - p];
            out->strain += weight[g - p] * strain[g - p];
        }
        uz_add_to_nodes(sum, H, weight, around, rule, &rest, p, dim, ring);
    }
    for (int a = 0; a < rule->nodes; a++)
        for (int c = 0; c < dim; c++)
            force[dim * a + c] = sum[c][a / LANES][a % LANES];
}

/* ke: full, and zero at entry. */
UZ_INLINE void find_metric(double *ke, const task *x, int dim)
{
    const uz_finite_rule *rule = x->rule;
    const bool ring = dim == 2 && rule->model == UZ_AXISYMMETRIC;
    const int n = dim * rule->nodes, wide = (rule->nodes + LANES - 1) / LANES;
    uz_rest rest;
    four sum[UZ_ELEMENT_NODES][GROUPS] = {{{0}}}, hoop[UZ_ELEMENT_NODES][GROUPS] = {{{0}}};
    uz_rest_of(&rest, rule, x->element, dim, ring);
    for (int g = 0; g < rule->gauss; g++) {
        const double weight = x->element->lame.mu * rest.volume[g];
        const double around = ring ? weight * rest.per_radius[g] * rest.per_radius[g] : 0;
        four G[3][GROUPS];
        for (int w = 0; w < wide; w++)
            for (int j = 0; j < dim; j++) {
                G[j][w] = *uz_four_from(&rule->at_nodes[g][0][LANES * w]) * rest.inverse[0][j][g];
                for (int i = 1; i < dim; i++)
                    G[j][w] += *uz_four_from(&rule->at_nodes[g][i][LANES * w]) * rest.inverse[i][j][g];
            }
        for (int a = 0; a < rule->nodes; a++)
            for (int w = 0; w <= a / LANES; w++) {
                for (int j = 0; j < dim; j++)
                    sum[a][w] += weight * G[j][a / LANES][a % LANES] * G[j][w];
                if (ring)
                    hoop[a][w] += around * rule->at_nodes[g][3][a] * *uz_four_from(&rule->at_nodes[g][3][LANES * w]);
            }
    }
    for (int a = 0; a < rule->nodes; a++)
        for (int b = 0; b <= a; b++)
            for (int c = 0; c < dim; c++) {
                const double own = sum[a][b / LANES][b % LANES] + (c == 0 ? hoop[a][b / LANES][b % LANES] : 0);
                ke[n * (dim * a + c) + dim * b + c] = ke[n * (dim * b + c) + dim * a + c] = own;
            }
}

typedef struct {
    void (*add_turning)(uz_turning *out, double *force, const task *x);
    void (*find_metric)(double *ke, const task *x);
} kernels;

#define ADD_TURNING(NAME, DIM, VERSION)                                                                                \
    VERSION static void NAME(uz_turning *out, double *force, const task *x)                                            \
    {                                                                                                                  \
        add_turning(out, force, x, DIM);                                                                               \
    }
#define FIND_METRIC(NAME, DIM, VERSION)                                                                                \
    VERSION static void NAME(double *ke, const task *x)                                                                \
    {                                                                                                                  \
        find_metric(ke, x, DIM);                                                                                       \
    }
ADD_TURNING(plane_turning, 2, )
ADD_TURNING(space_turning, 3, )
ADD_TURNING(plane_fused_turning, 2, UZ_AVX2_FMA)
ADD_TURNING(space_fused_turning, 3, UZ_AVX2_FMA)
FIND_METRIC(plane_metric, 2, )
FIND_METRIC(space_metric, 3, )
FIND_METRIC(plane_fused_metric, 2, UZ_AVX2_FMA)
FIND_METRIC(space_fused_metric, 3, UZ_AVX2_FMA)

static kernels kernels_of(int dim)
{
    if (uz_cpu_has_avx2_fma())
        return dim == 2 ? (kernels){plane_fused_turning, plane_fused_metric}
                        : (kernels){space_fused_turning, space_fused_metric};
    return dim == 2 ? (kernels){plane_turning, plane_metric} : (kernels){space_turning, space_metric};
}

/* The rule of an element's kind: *rule, made anew where it is another one's. */
static void use_rule(uz_finite_rule *rule, const uz_element *element)
{
    if (rule->nodes == 0 || rule->kind != element->kind)
        uz_finite_rule_of(rule, element->kind, element->model);
}

void uz_turning_of(uz_turning *out, double *force, const uz_body_model *model, const double *from, const double *to,
                   const double *near)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    const kernels by = kernels_of(dim);
    uz_finite_rule rule = {.nodes = 0};
    *out = (uz_turning){.turning = 0};
    memset(force, 0, (size_t)(dim * mesh->n_nodes) * sizeof *force);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], step[UZ_ELEMENT_DOFS], own[UZ_ELEMENT_DOFS],
            back[UZ_ELEMENT_DOFS];
        uz_turning rigid = {0};
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        uz_body_element(&element, xyz, model, e);
        use_rule(&rule, &element);
        for (int i = 0; i < dim * count; i++) {
            u[i] = from[dim * node[i / dim] + i % dim];
            step[i] = to[dim * node[i / dim] + i % dim] - u[i];
            back[i] = near ? near[dim * node[i / dim] + i % dim] - u[i] : 0;
        }
        by.add_turning(uz_is_unstrained(model, node, count) ? &rigid : out, own,
                       &(task){&rule, &element, u, step, near ? back : NULL});
        for (int i = 0; i < dim * count; i++)
            force[dim * node[i / dim] + i % dim] += own[i];
    }
}

void uz_turning_metric(uz_body_model *metric, const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    const kernels by = kernels_of(mesh->dim);
    uz_finite_rule rule = {.nodes = 0};
    memset(metric->K.val, 0, (size_t)metric->K.ptr[metric->K.cols] * sizeof *metric->K.val);
    memset(metric->K_fixed.val, 0, (size_t)metric->K_fixed.ptr[metric->K_fixed.cols] * sizeof *metric->K_fixed.val);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], xyz[3 * UZ_ELEMENT_NODES];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const size_t n = (size_t)(mesh->dim * count);
        memset(ke, 0, n * n * sizeof *ke);
        uz_body_element(&element, xyz, model, e);
        use_rule(&rule, &element);
        by.find_metric(ke, &(task){.rule = &rule, .element = &element});
        uz_add_stiffness(metric, ke, node, count);
    }
}
