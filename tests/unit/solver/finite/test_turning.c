/* Steps whose parts turn, of homogeneous ones: what they lead to by Rodrigues' formula, on every element. */
#include "body_fixture.h"
#include "core/vector3.h"
#include "finite/finite_body.h"
#include "finite/turning.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

typedef double matrix[3][3];

static void multiply(matrix out, matrix a, matrix b)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
}

/* G x at every node. */
static double *field(const uz_body_model *model, matrix G)
{
    const int dim = model->mesh.dim;
    double *u = body_room(dim * model->mesh.n_nodes, sizeof *u);
    for (int64_t i = 0; i < dim * model->mesh.n_nodes; i++)
        for (int j = 0; j < dim; j++)
            u[i] += G[i % dim][j] * model->mesh.xyz[dim * (i / dim) + j];
    return u;
}

/* On free dofs, the forces of the step from F to F + h, both about the origin, are those by which the metric has the
 * displacement G x. */
static void check_step(uz_turning *found, const uz_body_model *model, matrix F, matrix h, matrix G)
{
    const int64_t n = model->mesh.dim * model->mesh.n_nodes;
    uz_body_model metric;
    uz_error err = {0};
    matrix H, to;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            H[i][j] = F[i][j] - (i == j);
            to[i][j] = H[i][j] + h[i][j];
        }
    double *at = field(model, H), *there = field(model, to), *u = field(model, G), *force = body_room(n, sizeof *force),
           *p = body_room(model->d, sizeof *p), *v = body_room(model->d, sizeof *v), largest = 0;
    CHECK_INT(uz_finite_tangent_of(&metric, model, &err), UZ_OK);
    uz_turning_metric(&metric, model);
    for (int near = 0; near < 2; near++) { /* from F on, and from F + h */
        uz_turning_of(found, force, model, at, there, near ? there : NULL);
        for (int64_t i = 0; i < n && near; i++)
            u[i] -= there[i] - at[i];
        uz_gather_nodal(p, model, force);
        uz_restrict_nodal(v, model, u);
        for (int64_t j = 0; j < model->d && !near; j++)
            largest = fmax(largest, fabs(p[j]));
        uz_csc_symv(p, &metric.K, -1, v);
        for (int64_t i = 0; i < n; i++)
            for (int64_t q = model->dof[i] < 0 ? metric.K_fixed.ptr[-1 - model->dof[i]] : 0;
                 model->dof[i] < 0 && q < metric.K_fixed.ptr[-model->dof[i]]; q++)
                p[metric.K_fixed.idx[q]] -= metric.K_fixed.val[q] * u[i];
        for (int64_t j = 0; j < model->d; j++)
            CHECK_MSG(fabs(p[j]) < 1e-12 * largest, "%.3g of %.3g", p[j], largest);
    }
    CHECK(largest > 0);
    uz_finite_tangent_clear(&metric);
    free(at);
    free(there);
    free(u);
    free(force);
    free(p);
    free(v);
}

static const struct {
    uz_model model;
    const char *element;
} BODY[] = {{UZ_PLANE_STRAIN, "quad4"}, {UZ_PLANE_STRAIN, "quad8"}, {UZ_PLANE_STRESS, "tri3"},
            {UZ_PLANE_STRAIN, "tri6"},  {UZ_SOLID, "hex8"},         {UZ_SOLID, "tet4"},
            {UZ_SOLID, "hex20"},        {UZ_SOLID, "tet10"}};

static uz_body_model body(uz_scene *s, uz_model kind, const char *element)
{
    *s = body_scene(kind, element, (double[3]){3, 2, 1}, (int64_t[3]){3, 2, 2});
    s->materials[0].young = 2.6; /* mu = 1 */
    body_hold(s, "left", 0, 0, kind == UZ_SOLID ? 0 : NAN);
    return body_model(s);
}

TEST(a_homogeneous_step_is_turned)
{
    qp_random rng = {3};
    for (int k = 0; k < 8; k++) {
        const int dim = BODY[k].model == UZ_SOLID ? 3 : 2;
        matrix F = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, stretch = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, g, h, R, V, to;
        double w[3] = {dim == 3 ? 0.8 : 0, dim == 3 ? -0.5 : 0, 1.5}, strain = 0;
        const matrix skew = {{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}};
        uz_scene s;
        uz_body_model model = body(&s, BODY[k].model, BODY[k].element);
        for (int i = 0; i < dim; i++)
            for (int j = 0; j <= i; j++) {
                F[i][j] += 0.3 * random_signed(&rng);
                F[j][i] += 0.3 * random_signed(&rng);
                stretch[i][j] += 0.2 * random_signed(&rng);
                stretch[j][i] = stretch[i][j];
            }
        const double square = uz_dot3(w, w), angle = atan(uz_unit3(w));
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const double off = stretch[i][j] - (i == j);
                g[i][j] = off + skew[i][j];
                strain += off * off;
                R[i][j] =
                    cos(angle) * (i == j) + sin(angle) * skew[i][j] / sqrt(square) + (1 - cos(angle)) * w[i] * w[j];
            }
        multiply(h, g, F);
        multiply(V, stretch, F);
        multiply(to, R, V);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                to[i][j] -= F[i][j];
        uz_turning found;
        check_step(&found, &model, F, h, to);
        CHECK_MSG(fabs(found.turning / (3 * square * square) - 1) < 1e-12, "%.9g", found.turning);
        CHECK_MSG(fabs(found.strain / found.turning - 2 * strain / square / square) < 1e-12, "%.9g", found.strain);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* What does not turn is as it was, rings among it, around whose axis the metric has u_r / r. */
TEST(a_step_that_does_not_turn_is_left)
{
    for (int k = 0; k < 9; k++) {
        uz_scene s;
        const bool ring = k == 8;
        matrix F = {{1.2, 0.1, 0}, {0, 0.9, 0}, {0, 0, 1}}, h = {{0.3, 0.1, 0}, {0.1, -0.2, 0}, {0, 0, 0}}, step;
        uz_body_model model = body(&s, ring ? UZ_AXISYMMETRIC : BODY[k].model, ring ? "quad8" : BODY[k].element);
        uz_turning found;
        if (ring) /* a field that is a linear one around the axis, too */
            F[0][1] = h[0][1] = h[1][0] = 0;
        multiply(step, h, F);
        check_step(&found, &model, F, step, step);
        CHECK(found.turning < 1e-25 && found.strain > 0.1);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
