/* amg_pair.h: a multigrid with conjugate gradients, and a factor of the same matrix. Tests include it once. */
#ifndef TESTS_SUPPORT_AMG_PAIR_H
#define TESTS_SUPPORT_AMG_PAIR_H

#include "amg/multigrid_private.h"
#include "brick.h"
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

/* A matrix, its modes, and both ways to solve with it. */
typedef struct {
    uz_csc K;
    uz_amg *amg;
    uz_amg_info info;
    uz_cg cg;
    uz_factor *factor;
    uz_factor_workspace *ws;
} pair;

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

/* Takes K and the modes. False where the matrix was refused, with *err. */
static inline bool open_pair(pair *p, uz_csc *K, uz_modes *modes, uz_error *err)
{
    memset(p, 0, sizeof *p);
    p->K = *K;
    memset(K, 0, sizeof *K);
    if (uz_amg_create(&p->amg, &p->K, modes, 0, 0, NULL, err) != UZ_OK)
        return false;
    p->info = p->amg->info;
    CHECK(uz_cg_init(&p->cg, p->amg->mg, err) == UZ_OK);
    CHECK(factor_by(&p->factor, &p->K, NULL, 0, UZ_ORDERING_AUTO, 0, err) == UZ_OK);
    p->ws = uz_factor_workspace_new();
    return true;
}

static inline void close_pair(pair *p)
{
    uz_cg_clear(&p->cg);
    uz_amg_free(p->amg);
    uz_factor_workspace_free(p->ws);
    uz_factor_free(p->factor);
    uz_csc_clear(&p->K);
}

static inline pair open_plane(uz_scene scene, bool with_mesh)
{
    pair p;
    uz_error err = {0};
    uz_modes modes;
    uz_body_model model = build_body(&scene);
    uz_status status = with_mesh
                           ? uz_modes_of_body(&modes, model.info.xyz, model.dof, model.mesh.n_nodes, 2, model.d, &err)
                           : uz_modes_of_matrix(&modes, &model.K, &err);
    CHECK(status == UZ_OK);
    CHECK_INT(modes.count, with_mesh ? 3 : 2);
    CHECK_MSG(open_pair(&p, &model.K, &modes, &err), "%s", err.message);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
    return p;
}

static inline pair open_brick(const int64_t cells[3], const double size[3], double poisson)
{
    pair p;
    uz_error err = {0};
    uz_modes modes;
    brick b = brick_make(cells, size, poisson, true);
    CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK_MSG(open_pair(&p, &b.K, &modes, &err), "%s", err.message);
    brick_free(&b);
    return p;
}

/* x = K^-1 x */
static inline void solve_exactly(const pair *p, double *x)
{
    uz_error err = {0};
    double *y = vector(p->K.cols);
    uz_factor_permute(p->factor, y, x);
    CHECK(uz_factor_solve_one(p->factor, p->ws, y, true, &err) == UZ_OK);
    CHECK(uz_factor_solve_one(p->factor, p->ws, y, false, &err) == UZ_OK);
    uz_factor_unpermute(p->factor, x, y);
    free(y);
}

static inline double dot(const double *x, const double *y, int64_t n)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static inline double *random_vector(int64_t n, uint64_t seed)
{
    qp_random rng = {seed};
    double *x = vector(n);
    for (int64_t i = 0; i < n; i++)
        x[i] = random_signed(&rng);
    return x;
}

static inline void apply(const pair *p, double *z, const double *r)
{
    uz_error err = {0};
    CHECK(uz_multigrid_apply(p->cg.mg, &p->K, p->cg.room, z, r, &err) == UZ_OK);
}

static int64_t cycles; /* of a counting kind */

static inline uz_status count_cycles(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                                     const double *r, uz_error *err)
{
    cycles++;
    return uz_aggregates_kind.apply(mg, K, room, z, r, err);
}

static inline uz_scene stretched(double width, double height, int64_t nx, int64_t ny, double poisson)
{
    uz_scene scene = paper_scene(nx, ny);
    scene.box.size[0] = width;
    scene.box.size[1] = height;
    scene.materials[0].poisson = poisson;
    scene.model = UZ_PLANE_STRAIN;
    scene.formulation = UZ_FORMULATION_STANDARD;
    return scene;
}

#endif
