/* The certificate of finite kinematics: what it says of an answer, and of answers that are wrong in one respect each.
 */
#include "body_fixture.h"
#include "certificate/envelope.h"
#include "certificate/finite.h"
#include "finite/finite_body.h"
#include "linalg/linalg.h"
#include "qp_fixture.h"

/* An answer with all that the certificate reads. */
typedef struct {
    uz_scene scene;
    uz_result *result;
    uz_body_model base, turned, there; /* turned: with rigid groups where they are */
    double *prescribed, *p, *h;
} answered;

static uz_scene block(const char *element, int64_t cells, uz_elasticity law)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){1, 1, 0}, (int64_t[3]){cells, cells, 0});
    s.materials[0].young = 1;
    s.materials[0].law = law;
    s.kinematics = UZ_KINEMATICS_FINITE;
    return s;
}

static void answer(answered *a, const uz_scene *scene)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *scene};
    const uz_settings settings = uz_settings_default();
    uz_error err = {0};
    a->scene = *scene;
    CHECK_MSG(uz_solve(&a->result, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(a->result->summary.outcome, UZ_CONVERGED);
    CHECK_INT(uz_body_model_build(&a->base, scene, UZ_BODY_HELD, &err), UZ_OK);
    a->scene.place = a->result->u;
    CHECK_INT(uz_body_turned(&a->turned, &a->base, a->result->u, &err), UZ_OK);
    CHECK_INT(uz_body_model_move(&a->there, &a->turned, &a->scene, &err), UZ_OK);
    a->scene.place = NULL;
    a->prescribed = body_room(a->base.n_fixed + 1, sizeof(double));
    a->p = body_room(a->base.d + 1, sizeof(double));
    a->h = body_room(a->there.m + 1, sizeof(double));
    CHECK_INT(uz_body_model_load(a->p, a->h, a->prescribed, &a->there, &a->scene, &err), UZ_OK);
}

static void give_back(answered *a)
{
    uz_body_model_clear(&a->there);
    uz_body_turned_clear(&a->turned);
    uz_body_model_clear(&a->base);
    uz_result_free(a->result);
    free(a->prescribed);
    free(a->p);
    free(a->h);
    uz_scene_clear(&a->scene);
}

static uz_finite_certificate judge(const answered *a)
{
    const uz_result *r = a->result;
    const uz_finite_answer of = {&a->there, &a->base, &a->scene, r->u, r->r, r->g, a->prescribed, NULL};
    uz_finite_certificate c;
    uz_error err = {0};
    CHECK_MSG(uz_certify_finite(&c, &of, NULL, &err) == UZ_OK, "%s", err.message);
    return c;
}

static uz_scene on_a_ball(void)
{
    uz_scene s = block("quad8", 4, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "top", 0.05, -0.15, NAN);
    uz_contact *ball = body_plane(&s, "bottom", (double[3]){0.4, -1.5, 0}, (double[3]){0, 1, 0});
    ball->kind = UZ_OBSTACLE_ROUND;
    ball->radius = 1.5;
    return s;
}

/* A side that is rigid and free, on a spring: springs that are stiffer, a group that is bent, turned too far, or pushed
 * along are seen. */
TEST(springs_and_rigid_groups)
{
    uz_scene s = block("quad8", 2, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "left", 0, 0, NAN);
    body_spring(&s, "top", 0, 0.1, 0);
    body_hold(&s, "right", NAN, NAN, NAN)->kind = UZ_SUPPORT_RIGID;
    for (int c = 0; c < 3; c++)
        s.supports[2].turn[c] = NAN;
    body_load(&s, UZ_LOAD_TRACTION, "right", 0.1, -0.1, 0);
    answered a;
    answer(&a, &s);
    uz_result *r = a.result;
    const int64_t n = r->n_nodes;
    const uz_finite_certificate c = judge(&a);
    CHECK_MSG(c.definite && c.residual <= 1e-8 && c.worst_support < 1e-14, "%g %g", c.residual, c.worst_support);
    CHECK(fabs(c.energy - r->evaluation->strain_energy) < 1e-12 && fabs(r->evaluation->supports[2].turned[2]) > 0.05);
    double spring = 0, most = 0;
    for (int64_t i = 0; i < 2 * n; i++)
        spring += 0.5 * a.base.spring[i] * r->u[i] * r->u[i];
    CHECK(spring > 1e-4);
    for (int64_t i = 0; i < 2 * n; i++)
        a.base.spring[i] *= 1.001;
    CHECK(judge(&a).residual > 1e-5 && fabs(judge(&a).energy - c.energy - 0.001 * spring) < 1e-12);
    for (int64_t i = 0; i < 2 * n; i++)
        a.base.spring[i] /= 1.001;
    for (int64_t i = 0; i < n; i++) {
        if (!(r->mesh.xyz[2 * i] > 1 - 1e-9))
            continue;
        r->u[2 * i] += 1e-6; /* along with the others, or alone */
        most = fmax(most, judge(&a).worst_support);
        CHECK(judge(&a).worst_support > 4e-7);
        r->u[2 * i] -= 1e-6;
    }
    CHECK(most < 1e-5 && judge(&a).worst_support < 1e-14);
    for (int64_t i = 0; i < n; i++)
        r->u[2 * i] += r->mesh.xyz[2 * i] > 1 - 1e-9 ? 1e-6 : 0;
    CHECK(judge(&a).worst_support < 1e-14 && judge(&a).residual > 1e-6);
    give_back(&a);
}

/* A block that its load presses on a plane, which alone holds it: not without reactions, nor by what rounding has of
 * them. */
TEST(what_presses_holds_a_body)
{
    uz_scene s = block("quad8", 2, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "left", 0, NAN, NAN);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.2, 0);
    answered a;
    answer(&a, &s);
    const uz_finite_certificate c = judge(&a);
    CHECK_MSG(c.definite && c.residual <= 1e-8, "%g", c.residual);
    for (int64_t i = 0; i < a.result->m; i++)
        a.result->r[i] = -1e-17;
    CHECK(!judge(&a).definite);
    for (int64_t i = 0; i < a.result->m; i++)
        a.result->r[i] = 0;
    CHECK(!judge(&a).definite && isinf(judge(&a).residual));
    give_back(&a);
}

TEST(an_answer_and_what_is_wrong_with_others)
{
    const uz_scene s = on_a_ball();
    answered a;
    answer(&a, &s);
    uz_result *r = a.result;
    uz_finite_certificate c = judge(&a);
    CHECK(c.definite && c.residual <= 1e-8 && c.least_det > 0.5 && c.worst_reaction <= 0 && c.worst_support < 1e-15);
    CHECK_MSG(fabs(c.least_det - r->summary.finite.least_det) < 1e-12 && c.least_at_rows > -1e-12 &&
                  c.least_part > -0.02,
              "%.15g %.3g %.3g", c.least_det, c.least_at_rows, c.least_part);
    CHECK(fabs(c.energy - r->evaluation->strain_energy) < 1e-12);
    int64_t pressed = 0, top = 0;
    for (int64_t i = 0; i < r->m; i++)
        pressed = r->r[i] < r->r[pressed] ? i : pressed;
    for (int64_t i = 0; i < r->n_nodes; i++)
        top = r->mesh.xyz[2 * i + 1] > 1 - 1e-9 ? i : top;
    const double reaction = r->r[pressed];
    r->r[pressed] *= 1.001;
    CHECK(judge(&a).residual > 1e-6);
    r->r[pressed] = -reaction;
    CHECK(judge(&a).worst_reaction > 0.9);
    r->r[pressed] = reaction;
    r->g[pressed] += 1e-6; /* a gap that is open under a reaction */
    CHECK(judge(&a).residual > 1e-7);
    r->g[pressed] -= 1e-6;
    double *u = r->u + 2 * r->mesh.contact_node[pressed];
    u[1] -= 0.02; /* into the ball */
    c = judge(&a);
    CHECK(c.least_gap < -0.019 && c.least_part < -0.07 && c.residual > 1e-3);
    u[1] += 0.02;
    r->u[2 * top] += 1e-6;
    c = judge(&a);
    CHECK(fabs(c.worst_support - 1e-6) < 1e-12);
    r->u[2 * top] -= 1e-6;
    u[1] += 3; /* through the top */
    c = judge(&a);
    CHECK(c.least_det < 0 && isinf(c.residual) && !c.definite);
    u[1] -= 3;
    CHECK(judge(&a).residual <= 1e-8);
    give_back(&a);
}

static bool stop_after(void *ctx)
{
    int *left = ctx;
    return (*left)-- <= 0;
}

/* Wherever it is asked whether to go on it can end: then it says so, and no more. */
TEST(a_certificate_that_is_stopped_says_so)
{
    const uz_scene s = on_a_ball();
    answered a;
    answer(&a, &s);
    const uz_result *r = a.result;
    const uz_finite_answer of = {&a.there, &a.base, &a.scene, r->u, r->r, r->g, a.prescribed, NULL};
    int asked = 0, stopped = 0;
    for (bool ended = false; !ended && asked < 100; asked++) {
        int left = asked;
        const uz_hooks hooks = {.ctx = &left, .cancelled = stop_after};
        const uz_stop stop = {&hooks, INFINITY};
        uz_finite_certificate c;
        uz_error err = {0};
        CHECK_INT(uz_certify_finite(&c, &of, &stop, &err), UZ_OK);
        CHECK(c.stopped ? !c.definite && isinf(c.residual) : c.definite && c.residual < 1e-8);
        stopped += c.stopped;
        ended = !c.stopped;
    }
    CHECK_MSG(stopped >= 3 && stopped == asked - 1, "%d of %d", stopped, asked);
    give_back(&a);
}

/* A ball that is narrower than the points at which a side is looked at are apart is seen between them as deep as it is.
 */
TEST(an_obstacle_between_the_points_of_a_side)
{
    for (int solid = 0; solid < 2; solid++) {
        uz_scene s = solid ? body_scene(UZ_SOLID, "hex20", (double[3]){4, 1, 1}, (int64_t[3]){1, 1, 1})
                           : body_scene(UZ_PLANE_STRAIN, "quad8", (double[3]){4, 1, 0}, (int64_t[3]){1, 1, 0});
        s.materials[0].young = 1;
        s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
        s.kinematics = UZ_KINEMATICS_FINITE;
        body_hold(&s, "top", 0, 0, solid ? 0 : NAN);
        uz_contact *ball = body_plane(&s, "bottom", (double[3]){1.25, -2, 0.6}, (double[3]){0, 1, 0});
        ball->kind = UZ_OBSTACLE_ROUND;
        ball->radius = 0.2;
        answered a;
        answer(&a, &s); /* nothing moves it */
        CHECK(fabs(judge(&a).least_gap - 1.8) < 0.02);
        a.scene.contacts[0].point[1] = -0.05;
        const uz_finite_certificate c = judge(&a);
        CHECK_MSG(fabs(c.least_gap + 0.15) < 1e-4 && c.least_part < -0.03, "%.6g %.6g", c.least_gap, c.least_part);
        give_back(&a);
    }
}

/* Both corners of an edge and all quadrature points are upright, and the edge between them is not. */
TEST(an_edge_that_is_inside_out_between_its_ends)
{
    static const double MOVED[9][2] = {
        {0, 0},      {-0.44, -0.3}, {0.3, 0.08},   {0.2, -0.09}, {0.34, -0.34},
        {0.37, 0.5}, {0, 0},        {0.16, -0.19}, {0, 0}}; /* rows of three from below */
    uz_scene s = block("tri6", 1, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "left", 0, 0, NAN);
    answered a;
    answer(&a, &s);
    uz_result *r = a.result;
    CHECK(judge(&a).least_det == 1);
    for (int64_t i = 0; i < r->n_nodes; i++)
        for (int c = 0; c < 2; c++)
            r->u[2 * i + c] = MOVED[lround(2 * r->mesh.xyz[2 * i]) + 3 * lround(2 * r->mesh.xyz[2 * i + 1])][c];
    const uz_finite_certificate c = judge(&a);
    CHECK_MSG(c.least_det < -1 && isinf(c.residual) && !c.definite, "%g", c.least_det);
    give_back(&a);
}

/* Rows of middles have a share of the gaps of their ends, and may press where nothing is near. */
TEST(what_is_pressed_from_afar)
{
    uz_scene s = body_scene(UZ_SOLID, "hex20", (double[3]){4, 1, 0.8}, (int64_t[3]){1, 1, 1});
    s.materials[0].young = 1;
    s.materials[0].poisson = 0;
    s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    s.kinematics = UZ_KINEMATICS_FINITE;
    body_hold(&s, "top", 0, -0.15, 0);
    uz_contact *ball = body_plane(&s, "bottom", (double[3]){2, -100, 0.4}, (double[3]){0, 1, 0});
    ball->kind = UZ_OBSTACLE_ROUND;
    ball->radius = 100;
    answered a;
    answer(&a, &s);
    CHECK(a.result->summary.active > 0 && judge(&a).pressed_apart < 0.01);
    a.scene.contacts[0].point[1] -= 0.4;
    CHECK_MSG(judge(&a).pressed_apart > 0.09 && judge(&a).pressed_apart < 0.11, "%g", judge(&a).pressed_apart);
    give_back(&a);
}

/* The same of solids, on a cylinder whose axis is oblique. */
TEST(an_answer_of_a_solid_and_what_is_wrong_with_others)
{
    static const char *const ELEMENTS[] = {"hex8", "tet10", "hex20"};
    for (int k = 0; k < 3; k++) {
        const int64_t cells = k == 0 ? 4 : 2;
        uz_scene s = body_scene(UZ_SOLID, ELEMENTS[k], (double[3]){1, 1, 1}, (int64_t[3]){cells, cells, cells});
        s.materials[0].young = 1;
        s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
        s.kinematics = UZ_KINEMATICS_FINITE;
        body_hold(&s, "top", 0.05, -0.1, 0.02);
        uz_contact *roller = body_plane(&s, "bottom", (double[3]){0.4, -2, 0.5}, (double[3]){0.4, 0, 1});
        roller->kind = UZ_OBSTACLE_CYLINDER;
        roller->radius = 2;
        answered a;
        answer(&a, &s);
        uz_result *r = a.result;
        uz_finite_certificate c = judge(&a);
        CHECK(c.definite && c.residual <= 1e-8 && c.least_det > 0.5 && c.worst_reaction <= 0);
        CHECK(c.worst_support < 1e-15 && c.least_at_rows > -1e-12 && c.least_part > -0.03);
        CHECK(fabs(c.energy - r->evaluation->strain_energy) < 1e-12);
        int64_t pressed = 0;
        for (int64_t i = 0; i < r->m; i++)
            pressed = r->r[i] < r->r[pressed] && !uz_row_inner(&a.there, i) ? i : pressed;
        const double reaction = r->r[pressed];
        r->r[pressed] *= 1.001;
        CHECK(judge(&a).residual > 1e-6);
        r->r[pressed] = -reaction;
        CHECK(judge(&a).worst_reaction > 0.1); /* the largest is inside of a side */
        r->r[pressed] = reaction;
        double *u = r->u + 3 * r->mesh.contact_node[pressed];
        u[1] -= 0.05; /* into the cylinder */
        c = judge(&a);
        CHECK_MSG(c.least_gap < -0.045 && c.least_part < -0.03 && c.residual > 1e-3, "%.3g", c.least_gap);
        u[1] += 3; /* through the top */
        c = judge(&a);
        CHECK(c.least_det < 0 && isinf(c.residual) && !c.definite);
        u[1] -= 2.95;
        CHECK(judge(&a).residual <= 1e-8);
        give_back(&a);
    }
}

/* To first order the residual is the distance in the norm of the tangent: without contact, that of the iteration. */
static void check_distance(uz_elasticity law, double poisson, uz_model model)
{
    uz_scene s = block(model == UZ_SOLID ? "hex8" : "quad4", model == UZ_SOLID ? 2 : 4, law);
    s.model = model;
    s.materials[0].poisson = poisson;
    if (model == UZ_SOLID)
        s.box.dim = 3;
    if (model == UZ_SOLID)
        s.box.size[2] = (double)(s.box.cells[2] = 1);
    body_hold(&s, "bottom", 0, 0, model == UZ_SOLID ? 0 : NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", model == UZ_AXISYMMETRIC ? 0.02 : 0.05, 0.05, 0);
    answered a;
    answer(&a, &s);
    uz_body_model tangent;
    uz_finite_measure measure;
    uz_error err = {0};
    CHECK_INT(uz_finite_tangent_of(&tangent, &a.base, &err), UZ_OK);
    uz_finite_body(&measure, NULL, &tangent, &a.base, NULL, a.result->u, NULL);
    qp_random rng = {5};
    const int64_t n = a.base.mesh.dim * a.base.mesh.n_nodes;
    double *v = body_room(a.base.d, sizeof *v), *Kv = body_room(a.base.d, sizeof *Kv), square = 0;
    CHECK_REL(judge(&a).energy, measure.energy, 1e-12);
    for (int64_t i = 0; i < n; i++)
        if (a.base.dof[i] >= 0) {
            v[a.base.dof[i]] = 1e-6 * (random_unit(&rng) - 0.5);
            a.result->u[i] += v[a.base.dof[i]];
        }
    uz_csc_symv(Kv, &tangent.K, 1, v);
    for (int64_t j = 0; j < a.base.d; j++)
        square += v[j] * Kv[j];
    const double expected = sqrt(square / (2 * measure.energy));
    const uz_finite_certificate c = judge(&a);
    CHECK_MSG(c.definite && fabs(c.residual - expected) < 1e-3 * expected, "%.9g, not %.9g", c.residual, expected);
    free(v);
    free(Kv);
    uz_finite_tangent_clear(&tangent);
    give_back(&a);
}

/* From Poisson's ratio 0.4 on with mean dilatation. */
TEST(the_residual_is_the_distance)
{
    check_distance(UZ_ELASTIC_NEO_HOOKE_ISOCHORIC, 0.3, UZ_PLANE_STRAIN);
    for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++) {
        check_distance((uz_elasticity)law, 0.45, UZ_PLANE_STRAIN);
        check_distance((uz_elasticity)law, 0.45, UZ_AXISYMMETRIC);
        check_distance((uz_elasticity)law, 0.45, UZ_SOLID);
    }
}

/* A block between frictionless plates at St. Venant and Kirchhoff's law: homogeneous states are equilibria, and from a
 * stretch of 0.63643 down no minima. */
TEST(an_equilibrium_that_is_no_minimum)
{
    uz_scene s = block("quad8", 6, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold(&s, "top", NAN, -0.2, NAN);
    answered a;
    answer(&a, &s);
    static const double STRETCH[] = {0.66, 0.645, 0.625, 0.6};
    for (int k = 0; k < 4; k++) {
        const double lambda = 0.3 / (1.3 * 0.4), mu = 1 / 2.6, up = STRETCH[k];
        const double aside = sqrt(1 - lambda / (lambda + 2 * mu) * (up * up - 1)); /* no stress along x */
        for (int64_t i = 0; i < a.result->n_nodes; i++) {
            const double *x = a.result->mesh.xyz + 2 * i;
            a.result->u[2 * i] = (aside - 1) * x[0];
            a.result->u[2 * i + 1] = (up - 1) * x[1];
        }
        for (int64_t i = 0; i < 2 * a.base.mesh.n_nodes; i++)
            if (a.base.dof[i] < 0)
                a.prescribed[-1 - a.base.dof[i]] = a.result->u[i];
        const uz_finite_certificate c = judge(&a);
        CHECK(c.worst_support == 0 && c.least_det > 0.5);
        CHECK_MSG(c.definite == (up > 0.63643), "stretch %g", up);
        CHECK(c.definite ? c.residual < 1e-12 : isinf(c.residual));
    }
    give_back(&a);
}

/* A matrix of random places, with two parts that nothing connects. */
TEST(the_factor_is_one)
{
    enum { N = 40 };
    qp_random rng = {3};
    for (int k = 0; k < 20; k++) {
        double dense[N * N] = {0}, x[N], b[N], room[N], size[N], sum = 0, square = 0;
        uz_envelope factor;
        uz_error err = {0};
        bool definite;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < i; j++)
                if ((i < 25) == (j < 25) && random_unit(&rng) < 0.08)
                    dense[i * N + j] = dense[j * N + i] = random_unit(&rng) - 0.5;
        for (int i = 0; i < N; i++) {
            double around = 0;
            for (int j = 0; j < N; j++)
                around += fabs(dense[i * N + j]);
            dense[i * N + i] = size[i] = around + 0.1;
            x[i] = random_unit(&rng) - 0.5;
        }
        for (int i = 0; i < N; i++) {
            b[i] = 0;
            for (int j = 0; j < N; j++)
                b[i] += dense[i * N + j] * x[j];
            sum += x[i] * b[i];
        }
        uz_csc A = csc_from_dense(dense, N, N, true);
        CHECK_INT(uz_envelope_factor(&factor, &definite, &A, size, 1e-12, NULL, &err), UZ_OK);
        CHECK(definite);
        uz_envelope_forward(b, &factor, room);
        for (int i = 0; i < N; i++)
            square += b[i] * b[i]; /* x'A x = b'A^-1 b */
        CHECK_MSG(fabs(square - sum) < 1e-12 * sum, "%.15g, not %.15g", square, sum);
        uz_envelope_clear(&factor);
        A.val[A.ptr[k]] = -0.1; /* no longer */
        CHECK_INT(uz_envelope_factor(&factor, &definite, &A, size, 1e-12, NULL, &err), UZ_OK);
        CHECK(!definite);
        uz_envelope_clear(&factor);
        uz_csc_clear(&A);
    }
}
