/* Pressures that follow the body: their forces and tangent, a thick tube, a beam that curls, and what the certificate
 * sees of them. References are closed forms, quadratures and the equations of the elastica. */
#include "finite/follower.h"
#include "body_fixture.h"
#include "certificate/finite.h"
#include "certificate/pressed_side.h"
#include "assembly/parts.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

static uz_scene scene_of(uz_model model, const char *element, const double size[3], const int64_t cells[3],
                         uz_elasticity law)
{
    uz_scene s = body_scene(model, element, size, cells);
    s.materials[0].young = 1;
    s.materials[0].law = law;
    s.kinematics = UZ_KINEMATICS_FINITE;
    return s;
}

static void press(uz_scene *s, const char *on, double value)
{
    body_load(s, UZ_LOAD_PRESSURE, on, 0, 0, 0)->value = value;
}

static uz_result *solve(const uz_scene *s)
{
    uz_result *result = body_solve(s, 1e-8);
    CHECK(result->evaluation->imbalance < 1e-8 && isnan(result->evaluation->potential_energy));
    return result;
}

static const double *moved_by(const uz_result *r, const double x[3], int dim)
{
    for (int64_t i = 0; i < r->n_nodes; i++) {
        double away = 0;
        for (int c = 0; c < dim; c++)
            away = fmax(away, fabs(r->mesh.xyz[dim * i + c] - x[c]));
        if (away < 1e-9)
            return r->u + dim * i;
    }
    CHECK_MSG(false, "no node at %g, %g, %g", x[0], x[1], x[2]);
    exit(1);
}

/* ---- forces and tangent */

static double any(qp_random *rng)
{
    return 0.2 * (2 * random_unit(rng) - 1);
}

/* A block that is pressed on one side: f turns with the body, and is its derivative's integral. */
TEST(forces_turn_with_the_body_and_have_the_tangent)
{
    static const struct {
        uz_model model;
        const char *element;
    } OF[] = {{UZ_PLANE_STRAIN, "quad4"}, {UZ_PLANE_STRESS, "tri6"}, {UZ_AXISYMMETRIC, "quad8"},
              {UZ_SOLID, "hex8"},         {UZ_SOLID, "tet10"},       {UZ_SOLID, "hex20"}};
    for (int k = 0; k < 6; k++) {
        const int dim = OF[k].model == UZ_SOLID ? 3 : 2;
        qp_random rng = {(uint64_t)k + 3};
        uz_scene s = scene_of(OF[k].model, OF[k].element, (double[3]){1, 2, dim == 3 ? 1 : 0},
                              (int64_t[3]){2, 2, dim == 3 ? 2 : 0}, UZ_ELASTIC_NEO_HOOKE);
        s.box.origin[0] = 1;
        s.thickness = OF[k].model == UZ_PLANE_STRESS ? 0.3 : 1;
        press(&s, "right", 0.7);
        body_hold(&s, "bottom", 0, 0, dim == 3 ? 0 : (double)NAN);
        uz_body_model model = body_model(&s), tangent;
        const int64_t n = dim * model.mesh.n_nodes;
        uz_error err = {0};
        double *u = body_room(n, sizeof *u), *v = body_room(n, sizeof *v), *turned = body_room(n, sizeof *turned);
        double *f = body_room(n, sizeof *f), *g = body_room(n, sizeof *g), *change = body_room(n, sizeof *change);
        double *Kv = body_room(model.d, sizeof *Kv), *p = body_room(model.d, sizeof *p),
               *free_v = body_room(model.d, sizeof *free_v);
        for (int64_t i = 0; i < n; i++) {
            u[i] = any(&rng);
            v[i] = model.dof[i] < 0 ? 0 : any(&rng);
        }
        CHECK(uz_follower_loads(f, &model, &s, u, &err) == UZ_OK);
        /* x + u turned about z, but of rings, whose axis stays */
        const double cs = OF[k].model == UZ_AXISYMMETRIC ? 1 : 0.6, sn = OF[k].model == UZ_AXISYMMETRIC ? 0 : 0.8;
        for (int64_t i = 0; i < n; i += dim) {
            const double x = model.mesh.xyz[i] + u[i], y = model.mesh.xyz[i + 1] + u[i + 1];
            turned[i] = cs * x - sn * y - model.mesh.xyz[i] + (sn > 0 ? 5 : 0);
            turned[i + 1] = sn * x + cs * y - model.mesh.xyz[i + 1] - 3;
            if (dim == 3)
                turned[i + 2] = u[i + 2] + 1;
        }
        CHECK(uz_follower_loads(g, &model, &s, turned, &err) == UZ_OK);
        for (int64_t i = 0; i < n; i += dim) {
            CHECK(fabs(g[i] - (cs * f[i] - sn * f[i + 1])) < 1e-13 &&
                  fabs(g[i + 1] - (sn * f[i] + cs * f[i + 1])) < 1e-13);
            CHECK(dim == 2 || fabs(g[i + 2] - f[i + 2]) < 1e-13);
        }
        /* f(u + v) - f(u - v) is twice the derivative along v, as terms are of degree two at most */
        tangent = model;
        tangent.K.val = body_room(model.K.ptr[model.K.cols], sizeof(double));
        tangent.K_fixed.val = body_room(model.K_fixed.ptr[model.K_fixed.cols] + 1, sizeof(double));
        uz_csc skew = {0};
        CHECK(uz_follower_tangent(&tangent, &skew, &s, u, &err) == UZ_OK);
        memset(f, 0, (size_t)n * sizeof *f);
        memset(g, 0, (size_t)n * sizeof *g);
        for (int64_t i = 0; i < n; i++)
            turned[i] = u[i] + v[i];
        CHECK(uz_follower_loads(f, &model, &s, turned, &err) == UZ_OK);
        for (int64_t i = 0; i < n; i++)
            turned[i] = u[i] - v[i];
        CHECK(uz_follower_loads(g, &model, &s, turned, &err) == UZ_OK);
        for (int64_t i = 0; i < n; i++)
            change[i] = 0.5 * (f[i] - g[i]);
        uz_gather_nodal(p, &model, change);
        uz_restrict_nodal(free_v, &model, v);
        uz_csc_symv(Kv, &tangent.K, 1, free_v);
        memset(change, 0, (size_t)n * sizeof *change);
        CHECK_MSG(skew.ptr, "%s: an edge that is free has a skew part", OF[k].element);
        if (skew.ptr)
            uz_csc_gaxpy(change, &skew, 1, v);
        uz_gather_nodal(f, &model, change);
        for (int64_t j = 0; j < model.d; j++)
            CHECK_MSG(fabs(p[j] - (f[j] - Kv[j])) < 1e-12, "%s: %.15g %.15g", OF[k].element, p[j], f[j] - Kv[j]);
        uz_csc_clear(&skew);
        free(tangent.K.val);
        free(tangent.K_fixed.val);
        uz_body_model_clear(&model);
        for (int i = 0; i < 9; i++)
            free((double *[]){u, v, turned, f, g, change, Kv, p, free_v}[i]);
        uz_scene_clear(&s);
    }
}

/* All around a body the forces sum to nothing, wherever and however large it is, and there is no skew part. */
TEST(a_pressure_all_around_has_no_resultant)
{
    for (int dim = 2; dim <= 3; dim++) {
        static const char *const SIDES[] = {"left", "right", "bottom", "top", "front", "back"};
        qp_random rng = {(uint64_t)dim};
        uz_scene s =
            scene_of(dim == 2 ? UZ_PLANE_STRAIN : UZ_SOLID, dim == 2 ? "quad8" : "hex20",
                     (double[3]){1, 2, dim == 3 ? 1 : 0}, (int64_t[3]){2, 2, dim == 3 ? 1 : 0}, UZ_ELASTIC_NEO_HOOKE);
        for (int i = 0; i < 2 * dim; i++)
            press(&s, SIDES[i], 3);
        body_hold(&s, "left", 0, 0, 0);
        uz_body_model model = body_model(&s), tangent = model;
        const int64_t n = dim * model.mesh.n_nodes;
        double *u = body_room(n, sizeof *u), *f = body_room(n, sizeof *f), sum[3] = {0}, moment = 0;
        uz_error err = {0};
        uz_csc skew = {0};
        for (int64_t i = 0; i < n; i++)
            u[i] = any(&rng);
        CHECK(uz_follower_loads(f, &model, &s, u, &err) == UZ_OK);
        for (int64_t i = 0; i < n; i++)
            sum[i % dim] += f[i];
        for (int64_t i = 0; i < n; i += dim)
            moment += (model.mesh.xyz[i] + u[i]) * f[i + 1] - (model.mesh.xyz[i + 1] + u[i + 1]) * f[i];
        CHECK(fabs(sum[0]) < 1e-13 && fabs(sum[1]) < 1e-13 && fabs(sum[2]) < 1e-13);
        CHECK_MSG(fabs(moment) < 1e-12, "%.3g", moment);
        tangent.K.val = body_room(model.K.ptr[model.K.cols], sizeof(double));
        tangent.K_fixed.val = body_room(model.K_fixed.ptr[model.K_fixed.cols] + 1, sizeof(double));
        CHECK(uz_follower_tangent(&tangent, &skew, &s, u, &err) == UZ_OK);
        CHECK(!skew.ptr);
        free(tangent.K.val);
        free(tangent.K_fixed.val);
        uz_body_model_clear(&model);
        free(u);
        free(f);
        uz_scene_clear(&s);
    }
}

/* ---- answers */

static void bend(double x[3])
{
    const double r = x[0], angle = x[1];
    x[0] = r * cos(angle);
    x[1] = r * sin(angle);
}

/* A thick tube of 1..2 under inner pressure, in the plane, as a ring, and as a solid between walls: its outer radius by
 * quadrature of the equilibrium (of the tube over a rod that wide, which presses as much). */
TEST(a_tube_under_pressure)
{
    static const double PRESSURE[] = {0.04624617, 0.15335612, 0.23487387}, INNER[] = {1.1, 1.5, 2.5},
                        OUTER[] = {2.06485078, 2.34524417, 3.143535};
    for (int k = 0; k < 3; k++)
        for (int kind = 0; kind < 3; kind++) {
            const int dim = kind == 2 ? 3 : 2;
            uz_scene s = kind == 0   ? scene_of(UZ_PLANE_STRAIN, "quad8", (double[3]){1, acos(0), 0},
                                                (int64_t[3]){4, 8, 0}, UZ_ELASTIC_NEO_HOOKE)
                         : kind == 1 ? scene_of(UZ_AXISYMMETRIC, "quad8", (double[3]){1, 0.25, 0},
                                                (int64_t[3]){8, 1, 0}, UZ_ELASTIC_NEO_HOOKE)
                                     : scene_of(UZ_SOLID, "hex20", (double[3]){1, acos(0), 0.25}, (int64_t[3]){4, 6, 1},
                                                UZ_ELASTIC_NEO_HOOKE);
            s.box.origin[0] = 1;
            if (kind != 1)
                body_give_mesh(&s, bend);
            body_hold(&s, "bottom", NAN, 0, NAN);
            body_hold(&s, "top", kind == 1 ? (double)NAN : 0, kind == 1 ? 0 : (double)NAN, NAN);
            if (kind == 2) {
                body_hold(&s, "front", NAN, NAN, 0);
                body_hold(&s, "back", NAN, NAN, 0);
            }
            press(&s, "left", PRESSURE[k]);
            uz_result *r = solve(&s);
            const uz_finite *f = &r->summary.finite;
            const double inner = 1 + moved_by(r, (double[3]){1, 0, 0}, dim)[0],
                         outer = 2 + moved_by(r, (double[3]){2, 0, 0}, dim)[0];
            CHECK_MSG(f->steps == 1 && f->qps <= 6 && f->definite, "%d %d: %lld steps, %lld QPs", k, kind,
                      (long long)f->steps, (long long)f->qps);
            CHECK_MSG(fabs(inner - INNER[k]) < 2e-3 * (INNER[k] - 1), "%d %d: %.8g", k, kind, inner);
            CHECK_MSG(fabs(outer - OUTER[k]) < 2e-3 * (OUTER[k] - 2), "%d %d: %.8g", k, kind, outer);
            /* what its symmetry planes bear: pressure times the deformed section */
            if (kind == 0)
                CHECK_MSG(fabs(r->evaluation->supports[0].force[1] + PRESSURE[k] * inner) < 2e-3 * PRESSURE[k] * inner,
                          "%.8g", r->evaluation->supports[0].force[1]);
            uz_result_free(r);
            uz_scene_clear(&s);
        }
}

/* By the elastica of height 0.2 whose load q per length of its lower face, (1 + 0.1 k) ds, stays across it: from the
 * free end N' = V k, V' = -N k - q (1 + 0.1 k), M' = -V with k = M / EI, by steps of Runge and Kutta; then its shape
 * from where it is held. */
static void curl(double end[2], double q, double stiffness, double length)
{
    enum { STEPS = 4000 };
    double y[3] = {0}, k[STEPS + 1], angle = 0;
    const double h = length / STEPS;
    for (int i = 0; i < STEPS; i++) {
        double sum[3] = {0}, at[3] = {y[0], y[1], y[2]};
        k[STEPS - i] = y[2] / stiffness;
        for (int stage = 0; stage < 4; stage++) {
            const double c = at[2] / stiffness, d[3] = {at[1] * c, -at[0] * c - q * (1 + 0.1 * c), -at[1]};
            static const double WEIGHT[] = {1. / 6, 1. / 3, 1. / 3, 1. / 6}, NEXT[] = {0.5, 0.5, 1, 0};
            for (int j = 0; j < 3; j++) {
                sum[j] += WEIGHT[stage] * d[j];
                at[j] = y[j] - NEXT[stage] * h * d[j]; /* towards the held end */
            }
        }
        for (int j = 0; j < 3; j++)
            y[j] -= h * sum[j];
    }
    k[0] = y[2] / stiffness;
    end[0] = end[1] = 0;
    for (int i = 0; i < STEPS; i++) {
        const double middle = angle + 0.25 * h * (k[i] + k[i + 1]);
        end[0] += h * cos(middle);
        end[1] += h * sin(middle);
        angle += 0.5 * h * (k[i] + k[i + 1]);
    }
}

/* A cantilever of 10 x 0.2 under a pressure from below, past a right angle: its end is free, so that the tangent has a
 * skew part. */
TEST(a_cantilever_under_pressure_curls)
{
    const double stiffness = 1.2e6 * 0.2 * 0.2 * 0.2 / 12;
    for (int k = 1; k <= 3; k++) {
        const double q = 4.0 * k * stiffness / 1000;
        double end[2];
        uz_scene s = scene_of(UZ_PLANE_STRAIN, "quad8", (double[3]){10, 0.2, 0}, (int64_t[3]){32, 1, 0},
                              UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
        s.materials[0].young = 1.2e6;
        s.materials[0].poisson = 0;
        body_hold(&s, "left", 0, 0, NAN);
        press(&s, "bottom", q);
        uz_result *r = solve(&s);
        const double *u = moved_by(r, (double[3]){10, 0.1, 0}, 2);
        curl(end, q, stiffness, 10);
        CHECK_MSG(fabs(10 + u[0] - end[0]) < 0.03 && fabs(u[1] - end[1]) < 0.03, "%d: %.6g %.6g, wanted %.6g %.6g", k,
                  10 + u[0], u[1], end[0], end[1]);
        CHECK_MSG(r->summary.finite.failed == 0 && r->summary.finite.most <= 10 && r->summary.finite.qps <= 12,
                  "%lld failed, %lld QPs", (long long)r->summary.finite.failed, (long long)r->summary.finite.qps);
        uz_result_free(r);
        uz_scene_clear(&s);
    }
}

/* ---- the certificate */

/* It finds the pressure that an answer is under, and no other one; with code of its own. */
TEST(the_certificate_sees_where_pressures_act)
{
    for (int dim = 2; dim <= 3; dim++) {
        uz_scene s =
            scene_of(dim == 2 ? UZ_PLANE_STRAIN : UZ_SOLID, dim == 2 ? "quad8" : "hex8",
                     (double[3]){2, 1, dim == 3 ? 1 : 0}, (int64_t[3]){4, 2, dim == 3 ? 2 : 0}, UZ_ELASTIC_NEO_HOOKE);
        uz_error err = {0};
        uz_finite_certificate c;
        body_hold(&s, "left", 0, 0, 0);
        press(&s, "top", 0.02);
        uz_result *r = solve(&s);
        uz_body_model base = body_model(&s);
        double *prescribed = body_room(base.n_fixed, sizeof *prescribed), none = 0;
        const uz_finite_answer of = {&base, &base, &s, r->u, &none, &none, prescribed, NULL};
        CHECK(uz_certify_finite(&c, &of, NULL, &err) == UZ_OK);
        CHECK_MSG(c.definite && c.residual < 1e-8, "%.3g", c.residual);
        s.loads[0].value *= 1.001;
        CHECK(uz_certify_finite(&c, &of, NULL, &err) == UZ_OK);
        CHECK_MSG(c.residual > 5e-4 && c.residual < 2e-3, "%.3g", c.residual);
        /* a load that keeps its direction is another one: what it differs by is seen */
        s.loads[0] = (uz_load){.kind = UZ_LOAD_TRACTION, .on = "top", .v = {0, -0.02, 0}};
        CHECK(uz_certify_finite(&c, &of, NULL, &err) == UZ_OK);
        CHECK_MSG(c.residual > 0.01, "%.3g", c.residual);
        free(prescribed);
        uz_body_model_clear(&base);
        uz_result_free(r);
        uz_scene_clear(&s);
    }
}

/* Both programs of the force and of the stiffness of a side: faces and edges of all kinds that are out of shape. */
TEST(both_sides_agree)
{
    static const int NODES[] = {2, 3, 3, 4, 6, 8};
    qp_random rng = {11};
    for (int k = 0; k < 12; k++) {
        const int dim = k % 6 < 2 ? 2 : 3, nodes = NODES[k % 6], n = dim * nodes;
        double xyz[3 * UZ_SIDE_NODES], f[3 * UZ_SIDE_NODES] = {0}, p[UZ_SIDE_NODES],
                                             ke[9 * UZ_SIDE_NODES * UZ_SIDE_NODES];
        long double x[3 * UZ_SIDE_NODES], force[3 * UZ_SIDE_NODES], more[3 * UZ_SIDE_NODES], less[3 * UZ_SIDE_NODES];
        double unused[9 * UZ_SIDE_NODES * UZ_SIDE_NODES], slope[9 * UZ_SIDE_NODES * UZ_SIDE_NODES];
        const uz_side side = {dim, nodes, dim == 3 ? UZ_SOLID : k < 6 ? UZ_AXISYMMETRIC : UZ_PLANE_STRESS, 0.3, xyz};
        for (int i = 0; i < n; i++)
            x[i] = xyz[i] = 2 + 10 * any(&rng);
        for (int a = 0; a < nodes; a++)
            p[a] = 0.7;
        uz_side_add_pressure(f, &side, p);
        uz_pressed_side(force, ke, &side, x, 0.7);
        for (int q = 0; q < n; q++) {
            CHECK_MSG(fabs(f[q] - (double)force[q]) < 1e-12, "%d nodes: %.15g %.15g", nodes, f[q], (double)force[q]);
            x[q] += 1;
            uz_pressed_side(more, unused, &side, x, 0.7);
            x[q] -= 2;
            uz_pressed_side(less, unused, &side, x, 0.7);
            x[q] += 1;
            for (int i = 0; i < n; i++)
                slope[i * n + q] = (double)(less[i] - more[i]) / 2;
        }
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                CHECK(fabs(ke[i * n + j] - 0.5 * (slope[i * n + j] + slope[j * n + i])) < 1e-12);
    }
}
