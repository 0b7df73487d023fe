/* Bodies with hanging nodes: patch tests, and K, p and N as T'K T, T'f and N T of all nodes. */
#include "assembly/discretization.h"
#include "body_fixture.h"
#include "core/alloc.h"
#include "linalg/linalg.h"
#include "scene/subdivide.h"

enum { X, Y, Z, ROUNDS = 3 };

/* Some elements of a box in three rounds. */
static const int64_t *some(int64_t *n, int dim)
{
    static const int64_t PLANE[] = {UZ_SUBDIVIDED, 2, 1, 6, 3, 1, 9, 12, 2, 10, 13},
                         SPACE[] = {UZ_SUBDIVIDED, 2, 1, 6, 2, 1, 9, 1, 10};
    *n = dim == 2 ? (int64_t)(sizeof PLANE / sizeof *PLANE) : (int64_t)(sizeof SPACE / sizeof *SPACE);
    return dim == 2 ? PLANE : SPACE;
}

static void shear(double x[3])
{
    x[X] += 0.2 * x[Y];
    x[Y] += 0.1 * x[Z];
}

static void scatter(double x[3])
{
    const double y = x[Y];
    x[Y] += 0.1 * cos(9 * x[X] + 5 * y + 4 * x[Z]);
    x[X] += 0.1 * sin(7 * x[X] - 8 * y + 6 * x[Z]);
}

/* A box moved by an affine map, or with every node a little elsewhere. */
static uz_scene moved_box(uz_model model, const char *element, bool affine)
{
    const int dim = model == UZ_SOLID ? 3 : 2;
    uz_scene s = body_scene(model, element, (double[3]){3, 2, 1.5}, (int64_t[3]){3, 3, dim == 3 ? 2 : 0});
    body_give_mesh(&s, affine ? shear : scatter);
    body_straighten(&s);
    body_hold(&s, "left", 0, 0, dim == 3 ? 0 : NAN);
    s.bisected = some(&s.n_bisected, dim);
    return s;
}

/* Bending of a bar with E = 1 and nu = 0.3, or a linear field. */
static void field(double u[3], const double *x, int dim, bool quadratic)
{
    const double nu = 0.3, y = x[Y], z = dim == 3 ? x[Z] : 0;
    u[X] = quadratic ? x[X] * y : 0.3 * x[X] - 0.2 * y + 0.1 * z;
    u[Y] = quadratic ? -0.5 * (x[X] * x[X] + nu * (y * y - (dim == 3 ? z * z : 0))) : 0.5 * x[X] + 0.4 * y - 0.7 * z;
    u[Z] = quadratic ? -nu * y * z : 0.2 * x[X] - 0.6 * y + 0.9 * z;
}

/* Forces within the body of a field that is in balance are rounding. */
static void check_patch(uz_model model, const char *element, bool quadratic)
{
    uz_scene s = moved_box(model, element, quadratic);
    const int dim = s.given.dim;
    uz_body_model body;
    uz_error err = {0};
    CHECK_MSG(uz_body_model_build(&body, &s, UZ_BODY_SUPPORTED, &err) == UZ_OK, "%s: %s", element, err.message);
    const uz_mesh *mesh = &body.mesh;
    const int64_t n = mesh->n_nodes * dim;
    double *nodal = body_room(n, sizeof *nodal), *u = body_room(body.d, sizeof *u), *f = body_room(body.d, sizeof *f),
           *fixed = body_room(body.n_fixed, sizeof *fixed), *again = body_room(n, sizeof *again), largest = 0;
    bool *boundary = body_room(mesh->n_nodes, sizeof *boundary);
    int64_t hanging = 0, inside = 0;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        double at[3];
        field(at, mesh->xyz + i * dim, dim, quadratic);
        memcpy(nodal + i * dim, at, (size_t)dim * sizeof *at);
        hanging += uz_mesh_hangs(mesh, i);
    }
    for (int64_t i = 0; i < n; i++)
        if (body.dof[i] < 0 && body.dof[i] != UZ_NO_DOF)
            fixed[-1 - body.dof[i]] = nodal[i];
    uz_restrict_nodal(u, &body, nodal);
    uz_recover_nodal(again, &body, u, fixed);
    for (int64_t i = 0; i < n; i++)
        CHECK(fabs(again[i] - nodal[i]) < 1e-13);
    uz_csc_symv(f, &body.K, 1, u);
    uz_csc_gaxpy(f, &body.K_fixed, 1, fixed);
    const uz_group *outer = uz_mesh_group(mesh, "boundary", "", NULL);
    for (int64_t i = 0; i < outer->n_nodes; i++)
        boundary[outer->node[i]] = true;
    for (int64_t i = 0; i < n; i++)
        if (body.dof[i] >= 0 && boundary[i / dim])
            largest = fmax(largest, fabs(f[body.dof[i]]));
    for (int64_t i = 0; i < n; i++)
        if (body.dof[i] >= 0 && !boundary[i / dim]) {
            CHECK_MSG(fabs(f[body.dof[i]]) < 1e-11 * largest, "%s: %g beside %g", element, f[body.dof[i]], largest);
            inside++;
        }
    CHECK_MSG(hanging > 5 && inside > 10, "%s: %lld hang, %lld inside", element, (long long)hanging, (long long)inside);
    uz_free_all(nodal, u, f, fixed, again, boundary);
    uz_body_model_clear(&body);
    uz_scene_clear(&s);
}

TEST(linear_fields_are_exact)
{
    check_patch(UZ_PLANE_STRESS, "quad4", false);
    check_patch(UZ_PLANE_STRAIN, "quad8", false);
    check_patch(UZ_SOLID, "hex8", false);
    check_patch(UZ_SOLID, "hex20", false);
}

TEST(quadratic_fields_are_exact_on_straight_meshes)
{
    check_patch(UZ_PLANE_STRESS, "quad8", true);
    check_patch(UZ_SOLID, "hex20", true);
}

static double random_value(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int64_t)(*seed >> 33) / 1e9 - 1;
}

static double energy_of(const uz_body_model *body, const double *nodal)
{
    double energy;
    CHECK_INT(uz_strain_energy(&energy, body, nodal, false, NULL), UZ_OK);
    return energy;
}

/* Reactions in proportion to the areas of rows are in balance with a constant pressure. */
static void check_areas(const uz_body_model *body, const char *kind)
{
    const uz_mesh *mesh = &body->mesh;
    double *r = body_room(body->m, sizeof *r), *at = body_room(body->m, sizeof *at);
    bool inner = false;
    for (int64_t i = 0; i < body->m; i++) {
        r[i] = body->info.contact_area[i];
        CHECK_MSG(r[i] > 0, "%s: area %g", kind, r[i]);
        inner = inner || uz_row_inner(body, i);
    }
    uz_row_forces(at, body, r);
    double *weight = body_room(body->mesh.n_nodes, sizeof *weight);
    const uz_group *bottom = uz_mesh_group(mesh, "bottom", "", NULL);
    for (int64_t i = 0; i < bottom->n_faces; i++) {
        uz_side side;
        double xyz[3 * UZ_FACE_NODES], w[UZ_FACE_NODES];
        int64_t node[UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, body, bottom->face[i]);
        uz_side_weights(w, &side);
        for (int a = 0; a < side.nodes; a++)
            weight[node[a]] += w[a];
    }
    uz_leave_hanging(weight, mesh);
    for (int64_t i = 0; i < body->m && !inner; i++)
        CHECK_MSG(fabs(at[i] - weight[body->info.contact_node[i]]) < 1e-12, "%s, row %lld: %g, not %g", kind,
                  (long long)i, at[i], weight[body->info.contact_node[i]]);
    uz_free_all(r, at, weight);
}

/* Supports along and across the axes, springs, and a round obstacle that turns nodes, at sides with hanging nodes. */
TEST(matrices_are_those_of_all_nodes_with_hanging_ones_tied)
{
    static const char *const KINDS[] = {"quad4", "quad8", "hex8", "hex20"};
    for (int k = 0; k < 4; k++) {
        const bool solid = k > 1;
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, KINDS[k], (double[3]){3, 2, 1.5},
                                (int64_t[3]){3, 3, solid ? 2 : 0});
        const int dim = solid ? 3 : 2;
        s.bisected = some(&s.n_bisected, dim);
        body_hold(&s, "left", 0.01, solid ? NAN : 0, NAN);
        body_hold_normal(&s, "top", (double[3]){1, 2, solid ? 0.5 : 0}, 0.02);
        body_spring(&s, "right", 1e4, 2e4, solid ? 5e3 : 0);
        uz_contact *contact = body_plane(&s, "bottom", (double[3]){1, -20, 0.3}, (double[3]){0, 0, 1});
        contact->kind = solid ? UZ_OBSTACLE_CYLINDER : UZ_OBSTACLE_ROUND;
        contact->radius = 19.9;
        uz_body_model body;
        uz_error err = {0};
        CHECK_MSG(uz_body_model_build(&body, &s, UZ_BODY_HELD, &err) == UZ_OK, "%s", err.message);
        const int64_t n = body.mesh.n_nodes * dim;
        double *u = body_room(body.d, sizeof *u), *zero = body_room(body.d, sizeof *zero),
               *Ku = body_room(body.d, sizeof *Ku), *fixed = body_room(body.n_fixed, sizeof *fixed),
               *nodal = body_room(n, sizeof *nodal), *f = body_room(n, sizeof *f), *p = body_room(body.d, sizeof *p),
               *gap = body_room(body.m, sizeof *gap), half[3] = {0}, work[2] = {0};
        uint64_t seed = 3;
        for (int64_t i = 0; i < body.d; i++)
            u[i] = random_value(&seed);
        for (int64_t i = 0; i < body.n_fixed; i++)
            fixed[i] = random_value(&seed);
        for (int64_t i = 0; i < n; i++)
            f[i] = random_value(&seed);
        uz_csc_symv(Ku, &body.K, 1, u);
        for (int64_t i = 0; i < body.d; i++)
            half[0] += 0.5 * u[i] * Ku[i];
        uz_recover_nodal(nodal, &body, u, NULL);
        CHECK_REL(half[0], energy_of(&body, nodal), 1e-11);
        uz_gather_nodal(p, &body, f);
        for (int64_t i = 0; i < body.d; i++)
            work[0] += p[i] * u[i];
        for (int64_t i = 0; i < n; i++)
            work[1] += f[i] * nodal[i];
        CHECK_REL(work[0], work[1], 1e-11);
        /* rows at nodes: minus the displacement along the normal; of middles of eight-node faces blended */
        uz_csc_gaxpy(gap, &body.N, -1, u);
        double *plain = body_room(body.m, sizeof *plain);
        for (int64_t i = 0; i < body.m; i++) {
            const uz_inner_place *inner = uz_row_inner(&body, i);
            CHECK(!uz_mesh_hangs(&body.mesh, body.info.contact_node[i]) || inner);
            for (int a = 0; a < (inner ? inner->nodes : 1); a++)
                for (int c = 0; c < dim; c++)
                    plain[i] += (inner ? inner->share[a] : 1) * body.info.contact_normal[i * dim + c] *
                                nodal[(inner ? inner->node[a] : body.info.contact_node[i]) * dim + c];
        }
        uz_blend_rows(plain, &body);
        for (int64_t i = 0; i < body.m; i++)
            CHECK_MSG(fabs(gap[i] - plain[i]) < 1e-10, "%s, row %lld: %g, not %g", KINDS[k], (long long)i, gap[i],
                      plain[i]);
        CHECK(body.m > 5);
        uz_recover_nodal(nodal, &body, zero, fixed);
        half[1] = energy_of(&body, nodal);
        uz_recover_nodal(nodal, &body, u, fixed);
        half[2] = energy_of(&body, nodal);
        memset(Ku, 0, (size_t)body.d * sizeof *Ku);
        uz_csc_gaxpy(Ku, &body.K_fixed, 1, fixed);
        for (int64_t i = 0; i < body.d; i++)
            half[0] += u[i] * Ku[i];
        CHECK_REL(half[0] + half[1], half[2], 1e-10);
        check_areas(&body, KINDS[k]);
        void *rooms[] = {u, zero, Ku, fixed, nodal, f, p, gap, plain};
        for (size_t i = 0; i < sizeof rooms / sizeof *rooms; i++)
            free(rooms[i]);
        uz_body_model_clear(&body);
        uz_scene_clear(&s);
    }
}
