/* Parts of a scene together: elements, models, materials, supports, loads, obstacles, two bodies. Every answer called
 * converged is held against what does not come from the solver: the exact solution of its matrices, geometry,
 * equilibrium, virtual work, and the same scene turned, in other units, with its nodes in another order.
 * in the ordinary build too: a sanitizer looks at a fifth of the scenes */
#include "core/alloc.h"
#include "harness.h"
#include "internal_forces.h"
#include "sanitized.h"
#include "scene_move.h"
#include "scene_norm.h"

#include "assembly/assembly.h"

#include <stdint.h>

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

enum { MOST_EXACT = 110 };

typedef struct {
    int64_t scenes, converged, refused, other, judged, uncertain, moved, semicoercive, touching;
} tally;

typedef struct {
    random_scene *s;
    const uz_result *x;
    uz_body_model model;
    double *load, *inner, *contact; /* n_nodes x dim: forces */
    double size;                    /* of all forces */
    uint64_t seed;
    const char *what;
} examined;

#define HOLDS(e, condition, ...)                                                                                       \
    ((condition) ? (void)0                                                                                             \
                 : (printf("# seed %llu, %s: ", (unsigned long long)(e)->seed, (e)->what),                             \
                    test_fail(__FILE__, __LINE__, __VA_ARGS__)))

static double dot_of(const double *a, const double *b, int64_t n)
{
    double sum = 0;
    for (int64_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* ------------------------------------------------------------- exact solution */

static void check_certificate(examined *e, tally *t)
{
    const uz_scene *scene = &e->s->scene;
    uz_qp qp;
    if (e->model.d > MOST_EXACT || uz_scene_to_qp(&qp, NULL, scene, NULL) != UZ_OK)
        return;
    bool *touch = scene_room(qp.N.rows, sizeof *touch);
    double *u = scene_room(qp.K.cols, sizeof *u);
    for (int64_t i = 0; i < qp.N.rows; i++)
        touch[i] = e->x->r[i] < 0;
    truth known = find_truth(&qp, touch);
    take_whole_norm(&known, &e->model, scene);
    uz_restrict_nodal(u, &e->model, e->x->u);
    const judgement j = judge(&known, &qp, e->x, u);
    HOLDS(e, j.verdict != JUDGED_WRONG, "%s (certified %g, error %g)", j.why, j.certified, j.error);
    t->judged++;
    t->uncertain += j.verdict == JUDGED_UNCERTAIN;
    truth_clear(&known);
    free(touch);
    free(u);
    uz_qp_clear(&qp);
}

/* ------------------------------------------------------------------ geometry */

static double distance_to(const double *x, const double *point, int dim, const double *axis, double unit[3])
{
    double off[3] = {0}, along = 0, length2 = axis ? dot_of(axis, axis, 3) : 1, sum = 0;
    for (int c = 0; c < dim; c++)
        off[c] = x[c] - point[c];
    for (int c = 0; axis && c < 3; c++)
        along += off[c] * axis[c] / length2;
    for (int c = 0; c < 3; c++) {
        off[c] -= axis ? along * axis[c] : 0;
        sum += off[c] * off[c];
    }
    for (int c = 0; c < 3; c++)
        unit[c] = off[c] / sqrt(sum);
    return sqrt(sum);
}

/* The gap (undeformed) and the normal by the obstacle's own definition; false: not told here. */
static bool gap_by_hand(double *gap, double n[3], const uz_contact *o, const double *x, int dim)
{
    if (o->kind == UZ_OBSTACLE_PLANE) {
        const double length = sqrt(dot_of(o->normal, o->normal, dim));
        *gap = 0;
        for (int c = 0; c < dim; c++) {
            n[c] = o->normal[c] / length;
            *gap += (x[c] - o->point[c]) * n[c];
        }
        return true;
    }
    if (o->kind != UZ_OBSTACLE_ROUND && o->kind != UZ_OBSTACLE_CYLINDER)
        return false;
    *gap = distance_to(x, o->point, dim, o->kind == UZ_OBSTACLE_CYLINDER ? o->normal : NULL, n) - o->radius;
    for (int c = 0; c < 3; c++)
        n[c] *= o->inside ? -1 : 1;
    *gap *= o->inside ? -1 : 1;
    return true;
}

/* A node over the straight edges of the other body: the nearest of them by trying all. */
static bool gap_to_edges(double *gap, double n[3], const examined *e, const uz_contact *o, int64_t node)
{
    const uz_mesh *mesh = &e->model.mesh;
    const uz_group *with = uz_mesh_group(mesh, o->with, "", NULL);
    const double *x = mesh->xyz + 2 * node, *u = e->x->u;
    double best = INFINITY;
    for (int64_t f = 0; f < with->n_faces; f++) {
        int64_t of[UZ_FACE_NODES];
        const int count = uz_mesh_face(of, mesh, with->face[f]);
        const double *a = mesh->xyz + 2 * of[0], *b = mesh->xyz + 2 * of[1];
        const double t[2] = {b[0] - a[0], b[1] - a[1]}, tt = dot_of(t, t, 2);
        const double s = ((x[0] - a[0]) * t[0] + (x[1] - a[1]) * t[1]) / tt;
        if (s < 0 || s > 1)
            continue;
        const double w[3] = {count == 3 ? (1 - s) * (1 - 2 * s) : 1 - s, count == 3 ? s * (2 * s - 1) : s,
                             4 * s * (1 - s)};
        const double m[2] = {t[1] / sqrt(tt), -t[0] / sqrt(tt)};
        const double height = (x[0] - a[0]) * m[0] + (x[1] - a[1]) * m[1];
        if (fabs(height) >= best)
            continue;
        best = fabs(height);
        *gap = height;
        for (int c = 0; c < 2; c++) {
            n[c] = m[c];
            for (int k = 0; k < count; k++)
                *gap -= m[c] * w[k] * u[2 * of[k] + c];
        }
    }
    return isfinite(best);
}

static void check_gaps(examined *e)
{
    const uz_mesh_info *info = &e->model.info;
    const int dim = info->dim;
    double most = 0, reach = e->model.mesh.extent;
    for (int64_t i = 0; i < e->x->m; i++)
        most = fmax(most, -e->x->r[i]);
    for (int64_t i = 0; i < e->x->m; i++) {
        const int64_t node = info->contact_node[i];
        const uz_contact *o = &e->s->scene.contacts[info->contact_of[i]];
        const uz_inner_place *inner = uz_row_inner(&e->model, i); /* of a row inside a side: no node, but a place */
        double gap = 0, n[3] = {0}, x[3] = {0}, u[3] = {0};
        for (int a = 0; a < (inner ? inner->nodes : 1); a++) {
            const int64_t at = inner ? inner->node[a] : node;
            for (int c = 0; c < dim; c++) {
                x[c] += (inner ? inner->share[a] : 1) * info->xyz[at * dim + c];
                u[c] += (inner ? inner->share[a] : 1) * e->x->u[at * dim + c];
            }
        }
        for (int c = 0; c < dim && inner; c++) { /* in the side set back, of a hole on the curve behind it */
            HOLDS(e, fabs(x[c] - inner->x[c]) <= inner->back + 0.1 * inner->size, "row %lld: not in its side",
                  (long long)i);
            x[c] = inner->x[c];
        }
        const bool body = o->kind == UZ_OBSTACLE_BODY;
        bool known = body ? dim == 2 && o->between == UZ_CONTACT_NODES && gap_to_edges(&gap, n, e, o, node)
                          : gap_by_hand(&gap, n, o, x, dim);
        for (int c = 0; c < dim; c++)
            reach = fmax(reach, fabs(info->xyz[node * dim + c]) + o->radius);
        HOLDS(e, e->x->r[i] <= 0, "row %lld pulls", (long long)i);
        if (!known)
            continue;
        gap += dot_of(n, u, dim) - (inner ? inner->back : 0);
        HOLDS(e, fabs(gap - e->x->g[i]) <= 1e-12 * reach, "row %lld: gap %.17g, by hand %.17g", (long long)i,
              e->x->g[i], gap);
        for (int c = 0; c < dim; c++)
            HOLDS(e, fabs(n[c] - info->contact_normal[i * dim + c]) <= 1e-9, "row %lld: normal %d", (long long)i, c);
    }
}

/* ------------------------------------------------------------------- forces */

/* r: what the row's node gets (uz_row_forces). */
static void add_row_force(examined *e, int64_t i, double r)
{
    const uz_mesh_info *info = &e->model.info;
    const uz_contact_sites *sites = e->model.sites ? &e->model.sites[info->contact_of[i]] : NULL;
    const uz_inner_place *inner = uz_row_inner(&e->model, i);
    const int64_t place = e->model.row_place[i];
    for (int c = 0; c < info->dim; c++) {
        const double f = -r * info->contact_normal[i * info->dim + c];
        for (int a = 0; a < (inner ? inner->nodes : 1); a++)
            e->contact[(inner ? inner->node[a] : info->contact_node[i]) * info->dim + c] +=
                (inner ? inner->share[a] : 1) * f;
        e->size += fabs(f);
        for (int64_t j = sites && sites->first ? sites->first[place] : 0;
             sites && sites->first && j < sites->first[place + 1]; j++)
            e->contact[sites->node[j] * info->dim + c] -= sites->weight[j] * f;
    }
}

static void find_forces(examined *e)
{
    const uz_mesh_info *info = &e->model.info;
    const int64_t total = info->n_nodes * info->dim;
    double *push = scene_room(e->x->m, sizeof *push);
    uz_error err = {0};
    e->load = scene_room(total, sizeof *e->load);
    e->inner = scene_room(total, sizeof *e->inner);
    e->contact = scene_room(total, sizeof *e->contact);
    CHECK(uz_nodal_loads(e->load, &e->model, &e->s->scene, &err) == UZ_OK);
    CHECK(internal_forces(e->inner, &e->model, e->x->u));
    uz_row_forces(push, &e->model, e->x->r);
    for (int64_t i = 0; i < e->x->m; i++)
        add_row_force(e, i, push[i]);
    free(push);
    for (int64_t i = 0; i < total; i++) {
        e->inner[i] += e->model.spring ? e->model.spring[i] * e->x->u[i] : 0;
        e->size += fabs(e->load[i]);
    }
}

/* Free dofs carry nothing; the supports' share is what is reported, and all of it sums to zero. */
static void check_equilibrium(examined *e)
{
    const uz_mesh_info *info = &e->model.info;
    const uz_evaluation *v = e->x->evaluation;
    const int dim = info->dim;
    double sum[3] = {0}, told[3] = {0}, *left = scene_room(info->n_nodes * dim, sizeof *left), *free_left;
    double stiff = 0, norm = e->x->summary.certificate.energy_norm, error = e->x->summary.certificate.absolute_error;
    for (int64_t j = 0; j < e->model.d; j++)
        stiff = fmax(stiff, e->model.K.val[e->model.K.ptr[j]]);
    for (int64_t i = 0; i < info->n_nodes * dim; i++) {
        left[i] = e->inner[i] - e->load[i] - e->contact[i];
        sum[i % dim] += e->load[i] + e->contact[i];
    }
    free_left = scene_room(e->model.d, sizeof *free_left);
    uz_restrict_nodal(free_left, &e->model, left);
    /* |f_j| <= ||f||_{K^-1} sqrt(K_jj) */
    const double allowed = 4 * error * sqrt(stiff) + 1e-10 * e->size + 1e-13 * norm * sqrt(stiff);
    for (int64_t j = 0; j < e->model.d; j++)
        HOLDS(e, fabs(free_left[j]) <= allowed, "dof %lld carries %g of %g", (long long)j, free_left[j], e->size);
    for (int64_t k = 0; k < v->n_supports; k++)
        for (int c = 0; c < dim; c++)
            sum[c] += v->supports[k].force[c];
    for (int64_t k = 0; k < v->n_contacts; k++)
        for (int c = 0; c < dim; c++)
            told[c] += v->contacts[k].force[c];
    for (int c = 0; c < dim; c++) {
        if (!(info->dim == 2 && e->model.kind == UZ_AXISYMMETRIC && c == 0))
            HOLDS(e, fabs(sum[c]) <= (double)e->model.d * allowed, "forces along %d leave %g of %g", c, sum[c],
                  e->size);
        HOLDS(e, fabs(told[c] - e->x->summary.force[c]) <= 1e-12 * e->size, "two contact forces");
    }
    free(left);
    free(free_left);
}

static bool is_held_by_obstacles(const examined *e)
{
    return e->x->summary.semicoercive.free_modes > 0;
}

/* Clapeyron: the work of all forces, those of supports too, is twice the strain energy. */
static void check_work(examined *e)
{
    const int64_t total = e->model.info.n_nodes * e->model.info.dim;
    const double twice = dot_of(e->x->u, e->inner, total), told = 2 * e->x->evaluation->strain_energy;
    const uz_certificate *c = &e->x->summary.certificate;
    if (e->s->hot)
        return;
    const double allowed = 1e-7 * fabs(twice) + 1e-12 * c->energy_norm * c->energy_norm;
    HOLDS(e, fabs(twice - told) <= allowed, "strain energy %g, by its forces %g", told / 2, twice / 2);
    double work = 0, size = 0;
    for (int64_t i = 0; i < total; i++) {
        const double f = e->load[i] + e->contact[i];
        work += f * e->x->u[i];
        size += fabs(f * e->x->u[i]);
    }
    double *left = scene_room(total, sizeof *left), *free_left = scene_room(e->model.d, sizeof *free_left);
    for (int64_t i = 0; i < total; i++)
        left[i] = e->inner[i] - e->load[i] - e->contact[i];
    uz_restrict_nodal(free_left, &e->model, left); /* of supports: what is not on free dofs */
    double *u = scene_room(e->model.d, sizeof *u);
    uz_restrict_nodal(u, &e->model, e->x->u);
    const double supports = dot_of(left, e->x->u, total) - dot_of(free_left, u, e->model.d);
    /* what a body that only obstacles hold leaves over works along with the whole of it; it is told as imbalance */
    double far = 0;
    for (int64_t i = 0; i < total && is_held_by_obstacles(e); i++)
        far = fmax(far, fabs(e->x->u[i]));
    const double over = 10.0 * (double)e->model.info.dim * e->x->evaluation->imbalance * e->size * far;
    HOLDS(e,
          fabs(twice - work - supports) <= 4 * c->absolute_error * c->energy_norm + over + 1e-9 * (size + fabs(twice)),
          "work %g and %g of supports, twice the strain energy %g", work, supports, twice);
    uz_free_all(left, free_left, u);
}

/* ------------------------------------------------------------------ one scene */

static uz_settings settings_of(uint64_t seed)
{
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_AUTO, UZ_METHOD_ACTIVE_SET,
                                        UZ_METHOD_ACCELERATED_RESTART};
    static const uz_operator ops[] = {UZ_OPERATOR_AUTO, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED,
                                      UZ_OPERATOR_MATRIX_FREE};
    static const double errors[] = {1e-8, 1e-2, 1e-4, 0};
    uz_settings settings = uz_settings_default();
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 5};
    settings.max_iterations = 3000;
    if (seed % 3 > 0)
        return settings;
    random_unit(&rng);
    settings.method = methods[random_int(&rng, 0, 4)];
    settings.op = ops[random_int(&rng, 0, 4)];
    settings.relative_error = errors[random_int(&rng, 0, 4)];
    return settings;
}

/* With other loads before it, every fifth: the answer is that of the last of several cases. */
static bool solve(uz_result **out, const random_scene *s, uint64_t seed, uz_error *err)
{
    uz_load_case cases[3] = {{.name = "none", .loads = s->scene.loads},
                             {.name = "first", .loads = s->scene.loads, .n_loads = 1},
                             {.name = "all"}};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s->scene};
    const uz_settings settings = settings_of(seed);
    problem.scene.kinematics = UZ_KINEMATICS_FIXED; /* what is done by hand here is of the undeformed body */
    uz_result **results = NULL;
    if (seed % 5 > 0)
        return uz_solve(out, &problem, &settings, NULL, NULL, err) == UZ_OK;
    problem.cases = cases;
    problem.n_cases = 3;
    if (uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, err) != UZ_OK) {
        problem.n_cases = 0; /* a body that only its load presses on has no answer without */
        return uz_solve(out, &problem, &settings, NULL, NULL, err) == UZ_OK;
    }
    *out = results[2];
    results[2] = NULL;
    uz_results_free(results, 3);
    return true;
}

static void examine(random_scene *s, const uz_result *x, tally *t, uint64_t seed)
{
    uz_error err = {0};
    examined e = {.s = s, .x = x, .seed = seed, .what = "as it is"};
    if (uz_body_model_build(&e.model, &s->scene, UZ_BODY_HELD, &err) != UZ_OK || e.model.m != x->m) {
        HOLDS(&e, false, "solved, but the body has %lld rows, not %lld: %s", (long long)e.model.m, (long long)x->m,
              err.message);
        uz_body_model_clear(&e.model);
        return;
    }
    check_certificate(&e, t);
    check_gaps(&e);
    find_forces(&e);
    check_equilibrium(&e);
    check_work(&e);
    uz_free_all(e.load, e.inner, e.contact);
    uz_body_model_clear(&e.model);
}

/* Is y, brought back, x but for what both bounds allow and rounding? */
static void compare(random_scene *s, const uz_result *x, const uz_result *y, const scene_move *how, uint64_t seed,
                    const char *what)
{
    examined e = {.s = s, .x = x, .seed = seed, .what = what};
    uz_error err = {0};
    if (uz_body_model_build(&e.model, &s->scene, UZ_BODY_HELD, &err) != UZ_OK)
        return;
    const int dim = e.model.info.dim;
    const int64_t total = e.model.info.n_nodes * dim;
    double *d = scene_room(total, sizeof *d), *f = scene_room(total, sizeof *f), *ku = scene_room(total, sizeof *ku);
    HOLDS(&e, x->m == y->m, "%lld rows, but %lld", (long long)x->m, (long long)y->m);
    for (int64_t a = 0; a < e.model.info.n_nodes; a++) {
        const int64_t b = how->place ? how->place[a] : a;
        for (int c = 0; c < dim; c++) {
            double back = 0;
            for (int k = 0; k < dim; k++)
                back += how->turn[k][c] * y->u[b * dim + k];
            d[a * dim + c] = back / how->length - x->u[a * dim + c];
        }
    }
    CHECK(internal_forces(f, &e.model, d) && internal_forces(ku, &e.model, x->u));
    double square = dot_of(f, d, total), whole = dot_of(ku, x->u, total);
    for (int64_t i = 0; e.model.spring && i < total; i++) {
        square += e.model.spring[i] * d[i] * d[i];
        whole += e.model.spring[i] * x->u[i] * x->u[i];
    }
    const uz_certificate *cx = &x->summary.certificate, *cy = &y->summary.certificate;
    const double norm = fmax(sqrt(fmax(whole, 0)), cx->energy_norm), other = sqrt(how->force * how->length);
    const double error = sqrt(fmax(square, 0)),
                 allowed = cx->absolute_error + cy->absolute_error / other + 1e-8 * norm + 1e-12;
    HOLDS(&e, error <= allowed, "differs by %g of %g, allowed %g (d = %lld, certified %g and %g)", error, norm, allowed,
          (long long)e.model.d, cx->relative_error, cy->relative_error);
    const double sum[2] = {x->summary.reaction_sum, y->summary.reaction_sum / how->force};
    if (fmax(cx->relative_error, cy->relative_error) <= 1e-8)
        HOLDS(&e, fabs(sum[0] - sum[1]) <= 1e-4 * (fabs(sum[0]) + 1e-3), "reactions sum to %g, but %g", sum[0], sum[1]);
    uz_free_all(d, f, ku);
    uz_body_model_clear(&e.model);
}

static scene_move choose_move(const random_scene *s, int k)
{
    scene_move how = {.turn = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .length = 1, .force = 1};
    if (k == 0 && s->turnable) {
        const double a = s->scene.given.dim == 3 ? 0.7 : 0, b = 0.4;
        const double first[3][3] = {{cos(b), -sin(b), 0}, {sin(b), cos(b), 0}, {0, 0, 1}};
        const double other[3][3] = {{1, 0, 0}, {0, cos(a), -sin(a)}, {0, sin(a), cos(a)}};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                how.turn[i][j] = other[i][0] * first[0][j] + other[i][1] * first[1][j] + other[i][2] * first[2][j];
    } else if (k == 1) {
        how.length = 1e-3;
        how.force = 1e3;
    } else if (k == 2) {
        how.length = 0x1p20;
        how.force = 0x1p-9;
    } else {
        how.reorder = true;
    }
    return how;
}

static void move_and_compare(random_scene *s, const uz_result *x, tally *t, uint64_t seed, int k)
{
    static const char *const names[] = {"turned", "mm", "powers of two", "reordered"};
    random_scene moved = make_random_scene(seed);
    uz_result *y = NULL;
    uz_error err = {0};
    scene_move how = choose_move(s, k);
    move_scene(&moved, &how);
    examined e = {.s = s, .x = x, .seed = seed, .what = how.reorder ? names[3] : names[k]};
    const bool answered = solve(&y, &moved, seed, &err);
    HOLDS(&e, answered, "refused at %s: %s", err.where, err.message);
    if (answered && y->summary.outcome == UZ_CONVERGED) {
        compare(s, x, y, &how, seed, e.what);
        t->moved++;
    } else if (answered) {
        t->other++;
        HOLDS(&e, y->summary.outcome != UZ_INFEASIBLE, "%s", y->summary.message);
    }
    uz_result_free(y);
    uz_scene_clear(&moved.scene);
    free(how.place);
}

static void play(tally *t, uint64_t seed)
{
    random_scene s = make_random_scene(seed);
    uz_result *x = NULL;
    uz_error err = {0};
    t->scenes++;
    if (!solve(&x, &s, seed, &err)) {
        t->refused++;
        if (getenv("SEEDS"))
            printf("# seed %llu refused at %s: %s\n", (unsigned long long)seed, err.where, err.message);
    } else if (x->summary.outcome != UZ_CONVERGED) {
        t->other++;
        if (getenv("SEEDS"))
            printf("# seed %llu %s: %s\n", (unsigned long long)seed,
                   uz_choice_name(UZ_CHOICE_OUTCOME, x->summary.outcome), x->summary.message);
    } else {
        t->converged++;
        t->semicoercive += x->summary.semicoercive.free_modes > 0;
        t->touching += x->summary.active > 0;
        examine(&s, x, t, seed);
        move_and_compare(&s, x, t, seed, (int)(seed % 4));
    }
    uz_result_free(x);
    uz_scene_clear(&s.scene);
}

TEST(no_scene_has_a_false_answer)
{
    const char *from = getenv("FIRST_SEED"), *count = getenv("SEEDS");
    const uint64_t first = from ? strtoull(from, NULL, 10) : 0, all = (uint64_t)some_of(300),
                   seeds = count ? strtoull(count, NULL, 10) : all;
    tally t = {0};
    for (uint64_t seed = first; seed < first + seeds; seed++)
        play(&t, seed);
    printf("# %lld scenes: %lld converged (%lld touch, %lld held by obstacles), %lld other, %lld refused; %lld judged, "
           "%lld uncertain; %lld moved\n",
           (long long)t.scenes, (long long)t.converged, (long long)t.touching, (long long)t.semicoercive,
           (long long)t.other, (long long)t.refused, (long long)t.judged, (long long)t.uncertain, (long long)t.moved);
    CHECK(seeds < 20 || (4 * t.converged > 3 * t.scenes && 10 * t.other < t.scenes));
}
