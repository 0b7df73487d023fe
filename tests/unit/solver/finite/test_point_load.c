/* Forces and moments at points of groups that deform: what they sum to, that they turn with the group, and both
 * programs of them, the iteration's and the certificate's, against differences and against each other. */
#include "finite/finite_body.h"
#include "finite/point_load.h"
#include "assembly/parts.h"
#include "body_fixture.h"
#include "certificate/point_force.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

/* A block whose right side has a force beside it; in the plane with a moment. */
static uz_scene loaded(const char *element, bool solid)
{
    uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, element, (double[3]){2, 1, solid ? 0.7 : 0},
                            (int64_t[3]){2, 2, solid ? 2 : 0});
    s.materials[0].young = 1;
    s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    s.kinematics = UZ_KINEMATICS_FINITE;
    body_hold(&s, "left", 0, 0, solid ? 0 : (double)NAN);
    uz_load *load = body_load(&s, UZ_LOAD_FORCE, "right", 0.3, -0.2, solid ? 0.5 : 0);
    load->has_point = true;
    load->point[0] = 2.6;
    load->point[1] = 0.1;
    load->point[2] = solid ? 0.9 : 0;
    load->moment[2] = solid ? 0 : 0.4;
    return s;
}

/* Half a turn at most: u = (R - I) (x - centre) and something that deforms. */
static void displace(double *u, const uz_body_model *model, const double w[3], double strain, uint64_t seed)
{
    const int dim = model->mesh.dim;
    qp_random rng = {seed};
    double R[9];
    uz_rotation(R, w);
    for (int64_t i = 0; i < dim * model->mesh.n_nodes; i++) {
        u[i] = strain * (2 * random_unit(&rng) - 1) - model->mesh.xyz[i] + (double)(i % dim) - 1;
        for (int c = 0; c < dim; c++)
            u[i] += R[3 * (i % dim) + c] * model->mesh.xyz[i / dim * dim + c];
    }
}

static const struct {
    const char *element;
    bool solid;
    double w[3];
} OF[] = {{"quad4", false, {0, 0, 0.3}},     {"quad8", false, {0, 0, 3.0}}, {"tri6", false, {0, 0, -1.2}},
          {"hex8", true, {0.3, -0.2, 0.1}},  {"hex20", true, {2, 1.5, -1}}, {"tet10", true, {0, 0, 3.0}},
          {"hex8", true, {0, 0, 3.1415926}}, {"hex20", true, {0, 0, 0}},    {"hex8", true, {2.2214415, 2.2214415, 0}}};
enum { CASES = sizeof OF / sizeof OF[0] };

/* About its mean place the group bears R a x F + M, and F: all of it turned turns forces with it. */
TEST(forces_and_moments_are_borne_wherever_the_group_is)
{
    for (int k = 0; k < CASES; k++) {
        uz_scene s = loaded(OF[k].element, OF[k].solid);
        uz_body_model model = body_model(&s);
        const int dim = model.mesh.dim;
        const int64_t n = dim * model.mesh.n_nodes;
        double *u = body_room(n, sizeof *u), *f = body_room(n, sizeof *f), *share = body_room(n, sizeof *share);
        double R[9], sum[3] = {0}, moment[3] = {0}, rest[3] = {0}, now[3] = {0}, arm[3] = {0}, borne[3];
        uz_error err = {0};
        displace(u, &model, OF[k].w, 0, 1); /* as a rigid body */
        CHECK(uz_point_load(f, &model, &s, 0, u, &err) == UZ_OK);
        CHECK(uz_spread_over_group(share, &model, uz_mesh_group(&model.mesh, "right", "", &err), false, "", &err) ==
              UZ_OK);
        for (int64_t i = 0; i < n; i++) {
            rest[i % dim] += share[i / dim] * model.mesh.xyz[i];
            now[i % dim] += share[i / dim] * (model.mesh.xyz[i] + u[i]);
        }
        for (int64_t a = 0; a < n / dim; a++) {
            double r[3] = {0}, own[3] = {0}, turned[3];
            for (int c = 0; c < dim; c++) {
                r[c] = model.mesh.xyz[dim * a + c] + u[dim * a + c] - now[c];
                own[c] = f[dim * a + c];
                sum[c] += own[c];
            }
            uz_cross3(turned, r, own);
            for (int c = 0; c < 3; c++)
                moment[c] += turned[c];
        }
        uz_rotation(R, OF[k].w);
        for (int i = 0; i < 9; i++)
            arm[i / 3] += R[i] * (s.loads[0].point[i % 3] - rest[i % 3]);
        uz_cross3(borne, arm, s.loads[0].v);
        for (int c = dim == 2 ? 2 : 0; c < 3; c++)
            CHECK_MSG(fabs(moment[c] - borne[c] - s.loads[0].moment[c]) < 1e-12, "%s: %.15g", OF[k].element, moment[c]);
        for (int c = 0; c < dim; c++)
            CHECK(fabs(sum[c] - s.loads[0].v[c]) < 1e-13);
        free(u);
        free(f);
        free(share);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* Of deformed groups: K against central differences, and the certificate's forces and K against these. */
TEST(both_programs_are_derivatives_and_agree)
{
    for (int k = 0; k < CASES; k++) {
        const double step = 1e-5;
        uz_scene s = loaded(OF[k].element, OF[k].solid);
        uz_body_model model = body_model(&s), own = {0}, other = {0};
        const int dim = model.mesh.dim;
        const int64_t n = dim * model.mesh.n_nodes;
        double *room[9], none = 0, off = 0, apart = 0, most = 0;
        uz_error err = {0};
        for (int i = 0; i < 9; i++)
            room[i] = body_room(n, sizeof **room);
        double *u = room[0], *v = room[1], *f = room[2], *g = room[3], *at = room[4], *p = room[5], *q = room[6],
               *Kv = room[7], *free_v = room[8];
        CHECK(uz_finite_tangent_of(&own, &model, &err) == UZ_OK && uz_finite_tangent_of(&other, &model, &err) == UZ_OK);
        displace(u, &model, OF[k].w, 0.15, (uint64_t)k + 1);
        displace(v, &model, (double[3]){0}, 1, (uint64_t)k + 99);
        for (int64_t i = 0; i < n; i++)
            v[i] = model.dof[i] < 0 ? 0 : v[i];
        CHECK(uz_point_load(f, &model, &s, 0, u, &err) == UZ_OK && uz_point_tangent(&own, &s, 0, u, &err) == UZ_OK);
        const uz_finite_answer of = {&model, &model, &s, u, &none, &none, &none, NULL};
        CHECK(uz_point_forces(g, &other, &of, &err) == UZ_OK);
        for (int64_t i = 0; i < n; i++)
            apart = fmax(apart, fabs(f[i] - g[i]));
        CHECK_MSG(apart < 1e-14, "%s: forces differ by %.3g", OF[k].element, apart);
        apart = 0;
        for (int64_t i = 0; i < model.K.ptr[model.d]; i++) {
            most = fmax(most, fabs(own.K.val[i]));
            apart = fmax(apart, fabs(own.K.val[i] - other.K.val[i]));
        }
        CHECK_MSG(most > 1e-3 && apart < 1e-13 * most, "%s: K differ by %.3g of %.3g", OF[k].element, apart, most);
        for (int sign = 1; sign >= -1; sign -= 2) {
            memset(f, 0, (size_t)n * sizeof *f);
            for (int64_t i = 0; i < n; i++)
                at[i] = u[i] + sign * step * v[i];
            CHECK(uz_point_load(f, &model, &s, 0, at, &err) == UZ_OK);
            uz_gather_nodal(sign > 0 ? p : q, &model, f);
        }
        uz_restrict_nodal(free_v, &model, v);
        uz_csc_symv(Kv, &own.K, 1, free_v);
        for (int64_t j = 0; j < model.d; j++)
            off = fmax(off, fabs(-Kv[j] - (p[j] - q[j]) / (2 * step)));
        CHECK_MSG(off < 1e-7 * most, "%s: K is off by %.3g of %.3g", OF[k].element, off, most);
        for (int i = 0; i < 9; i++)
            free(room[i]);
        uz_finite_tangent_clear(&own);
        uz_finite_tangent_clear(&other);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
