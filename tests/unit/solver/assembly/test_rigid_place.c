/* Rigid groups under large rotations: rotations and their vectors, steps that keep distances, and what steps are to
 * first and second order, by differences. */
#include "assembly/parts.h"
#include "body_fixture.h"
#include "core/alloc.h"
#include "core/vector3.h"
#include "linalg/blas.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

static void random_vector(double w[3], qp_random *rng, double size)
{
    for (int c = 0; c < 3; c++)
        w[c] = random_signed(rng);
    uz_unit3(w);
    for (int c = 0; c < 3; c++)
        w[c] *= size;
}

/* Small ones, by almost half a turn, and all between: orthogonal, right-handed, and the same vector. */
TEST(rotations_and_their_vectors)
{
    qp_random rng = {7};
    static const double SIZE[] = {0, 1e-12, 1e-6, 0.1, 1, 2, 3, 3.14, 3.14159};
    for (int k = 0; k < 200; k++) {
        double w[3], R[9], back[3], off = 0;
        random_vector(w, &rng, SIZE[k % 9]);
        if (k % 10 == 9)
            w[k % 3] = 0;
        uz_rotation(R, w);
        for (int i = 0; i < 9; i++) {
            double dot = 0;
            for (int c = 0; c < 3; c++)
                dot += R[3 * (i / 3) + c] * R[3 * (i % 3) + c];
            off = fmax(off, fabs(dot - (i % 4 == 0)));
        }
        CHECK_MSG(off < 1e-14, "%g", off);
        uz_rotation_vector(back, R);
        CHECK_MSG(sqrt(uz_distance2(back, w, 3)) < 1e-9 * (SIZE[k % 9] > 3 ? 1 : 1e-5), "%g of %g",
                  sqrt(uz_distance2(back, w, 3)), SIZE[k % 9]);
    }
}

static uz_scene held(int dim)
{
    uz_scene s = body_scene(dim == 2 ? UZ_PLANE_STRAIN : UZ_SOLID, dim == 2 ? "quad4" : "hex8", (double[3]){2, 1, 1},
                            (int64_t[3]){2, 2, 2});
    body_hold(&s, "left", 0, 0, 0);
    uz_support *rigid = body_hold(&s, "right", NAN, NAN, NAN);
    rigid->kind = UZ_SUPPORT_RIGID;
    for (int c = 0; c < 3; c++) {
        rigid->turn[c] = NAN;
        rigid->about[c] = 0.3 * (c < dim);
    }
    return s;
}

/* From a place that is turned far the displacements of a step of the group's dofs, times t, and f'u of them. */
static double step(double *u, const uz_body_model *turned, const uz_body_model *model, const double *from,
                   const double *v, double t, const double *f)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double work = 0;
    uz_recover_nodal(u, turned, v, NULL);
    for (int64_t i = 0; i < n; i++)
        u[i] = from[i] + (uz_is_rigid(model, i / model->mesh.dim) ? t * u[i] : 0);
    uz_rigid_step(u, model, from, false);
    for (int64_t i = 0; i < n; i++)
        work += uz_is_rigid(model, i / model->mesh.dim) ? f[i] * u[i] : 0;
    return work;
}

TEST(steps_are_rigid_and_of_second_order_what_is_told)
{
    qp_random rng = {11};
    for (int dim = 2; dim <= 3; dim++) {
        uz_scene s = held(dim);
        uz_body_model model = body_model(&s), turned, K;
        const int64_t n = model.mesh.n_nodes * dim;
        double *from = body_room(n, sizeof *from), *u = body_room(n, sizeof *u), *f = body_room(n, sizeof *f),
               *v = body_room(model.d, sizeof *v), *p = body_room(model.d, sizeof *p), t[3], R[9], size = 0;
        uz_error err = {0};
        for (int turn = 0; turn < 4; turn++) { /* each from where the one before led to */
            CHECK_INT(uz_body_turned(&turned, &model, from, &err), UZ_OK);
            for (int64_t j = 0; j < model.d; j++)
                v[j] = random_signed(&rng);
            for (int64_t i = 0; i < n; i++)
                f[i] = random_signed(&rng);
            const double h = 1e-4, here = step(u, &turned, &model, from, v, 0, f);
            const double first =
                (step(u, &turned, &model, from, v, h, f) - step(u, &turned, &model, from, v, -h, f)) / (2 * h);
            const double second =
                (step(u, &turned, &model, from, v, h, f) + step(u, &turned, &model, from, v, -h, f) - 2 * here) /
                (h * h);
            double linear = 0, bends = 0;
            for (int64_t i = 0; i < n; i++) /* forces on the group alone */
                f[i] = uz_is_rigid(&model, i / dim) ? f[i] : 0;
            uz_gather_nodal(p, &turned, f);
            linear = uz_dot(model.d, p, v);
            K = turned;
            K.K.val = body_room(model.K.ptr[model.d], sizeof(double));
            uz_rigid_turn_stiffness(&K, &model, from, f);
            memset(p, 0, (size_t)model.d * sizeof *p);
            uz_csc_symv(p, &K.K, 1, v);
            bends = uz_dot(model.d, p, v);
            CHECK_MSG(fabs(first - linear) < 1e-6 && fabs(second - bends) < 1e-5, "%d: %g %g, %g %g", dim, first,
                      linear, second, bends);
            CHECK(fabs(bends) > 1e-2);
            free(K.K.val);
            step(u, &turned, &model, from, v, 1.5, f);
            uz_body_turned_clear(&turned);
            memcpy(from, u, (size_t)n * sizeof *u);
            uz_rigid_place(t, R, &model, model.rigid, from);
            size = fmax(size, fabs(R[1]));
            for (int64_t a = 0; a < model.mesh.n_nodes; a++)
                for (int64_t b = 0; b < a; b++) {
                    double x[2][3] = {{0}};
                    if (!uz_is_rigid(&model, a) || !uz_is_rigid(&model, b))
                        continue;
                    for (int c = 0; c < dim; c++) {
                        x[0][c] = model.mesh.xyz[dim * a + c] + from[dim * a + c];
                        x[1][c] = model.mesh.xyz[dim * b + c] + from[dim * b + c];
                    }
                    const double was = uz_distance2(model.mesh.xyz + dim * a, model.mesh.xyz + dim * b, dim);
                    CHECK(fabs(uz_distance2(x[0], x[1], 3) - was) < 1e-12);
                }
        }
        CHECK(size > 0.2);
        uz_free_all(from, u, f, v, p);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* From one place to the next: by the angle whose tangent is that of the linear step, unless that is prescribed. */
TEST(polar_steps_turn_by_less_unless_all_is_prescribed)
{
    qp_random rng = {5};
    for (int k = 0; k < 4; k++) {
        const int dim = 2 + k % 2;
        const bool given = k >= 2;
        uz_scene s = held(dim);
        for (int c = dim == 2 ? 2 : 0; c < 3 && given; c++)
            s.supports[s.n_supports - 1].turn[c] = 0;
        uz_body_model model = body_model(&s);
        const uz_rigid_group *group = model.rigid;
        const int64_t n = model.mesh.n_nodes * dim;
        double *from = body_room(n, sizeof *from), *u = body_room(n, sizeof *u);
        for (int turn = 0; turn < 2; turn++) {
            double w[3], told[3], t[3], R[2][9], by[9] = {0};
            random_vector(w, &rng, 1.2);
            for (int c = 0; c < 3 && dim == 2; c++)
                w[c] = c == 2 ? 1.2 : 0;
            uz_rigid_place(t, R[0], &model, group, from);
            for (int64_t a = 0; a < model.mesh.n_nodes; a++) {
                double r[3] = {0}, way[3];
                for (int c = 0; c < dim; c++)
                    r[c] = model.mesh.xyz[dim * a + c] + from[dim * a + c] - group->point[c] - t[c];
                uz_cross3(way, w, r);
                for (int c = 0; c < dim; c++)
                    u[dim * a + c] = from[dim * a + c] + way[c];
            }
            uz_rigid_step(u, &model, from, true);
            uz_rigid_place(t, R[1], &model, group, u);
            for (int i = 0; i < 9; i++)
                for (int c = 0; c < 3; c++)
                    by[i] += R[1][3 * (i / 3) + c] * R[0][3 * (i % 3) + c];
            uz_rotation_vector(told, by);
            const double part = given ? 1 : atan(1.2) / 1.2;
            for (int c = 0; c < 3; c++)
                CHECK_MSG(fabs(told[c] - part * w[c]) < 1e-12, "%d %d: %g of %g", dim, given, told[c], w[c]);
            memcpy(from, u, (size_t)n * sizeof *u);
        }
        free(from);
        free(u);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
