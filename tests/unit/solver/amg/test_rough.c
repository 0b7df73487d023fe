/* Conjugate gradients that are looked at on their way, and those in single precision, against what they stand for.
 * not under ThreadSanitizer: nothing here knows of threads */
#include "amg_pair.h"
#include "cg_steps.h"

/* What a solve ends with: the cycles that it took, *last as it tells it, and the same of the true residual. */
static int64_t cycles_of_solve(double *last, double *actual, pair *p, bool unchecked)
{
    const int64_t n = p->K.cols;
    double *b = random_vector(n, 3), *x = vector(n), *z = vector(n);
    uz_error err = {0};
    uz_cg_info info;
    const uz_cg_stop stop = {.relative = 1e-6, .max_iterations = 100, .deadline = INFINITY, .unchecked = unchecked};
    cycles = 0;
    CHECK(uz_cg_solve(&info, x, &p->cg, &p->K, b, &stop, &err) == UZ_OK && info.met);
    const int64_t count = cycles;
    CHECK(info.last <= 1e-6 * info.first);
    *last = info.last;
    uz_csc_symv(b, &p->K, -1.0, x);
    CHECK(uz_multigrid_apply(p->amg->mg, &p->K, p->cg.room, z, b, &err) == UZ_OK);
    *actual = sqrt(dot(z, b, n));
    free(b);
    free(x);
    free(z);
    return count;
}

TEST(a_residual_that_others_look_at_is_not_looked_at_twice)
{
    pair p = open_plane(paper_scene(60, 20), true);
    uz_multigrid_kind counting = uz_aggregates_kind;
    double last, actual;
    counting.apply = count_cycles;
    p.amg->mg->kind = &counting;
    const int64_t checked = cycles_of_solve(&last, &actual, &p, false);
    CHECK_REL(last, actual, 1e-7); /* products in another order, of numbers that cancel to the seventh digit */
    CHECK_INT(cycles_of_solve(&last, &actual, &p, true), checked - 1);
    CHECK_REL(last, actual, 1e-6); /* the recurrence's has hardly drifted */
    p.amg->mg->kind = &uz_aggregates_kind;
    close_pair(&p);
}

/* ||b - K x|| in the norm of M^-1, at free dofs. */
static double residual_norm(pair *p, const double *x, const double *b, const bool *held)
{
    const int64_t n = p->K.cols;
    double *r = vector(n), *z = vector(n);
    uz_error err = {0};
    memcpy(r, b, (size_t)n * sizeof *r);
    uz_csc_symv(r, &p->K, -1.0, x);
    for (int64_t j = 0; j < n; j++)
        r[j] = held[j] ? 0.0 : r[j];
    CHECK(uz_multigrid_apply(p->amg->mg, &p->K, p->cg.room, z, r, &err) == UZ_OK);
    const double norm = sqrt(dot(r, z, n));
    free(r);
    free(z);
    return norm;
}

/* Solves whose residual is looked at afterwards meet every tolerance, from any start and in any unit, by single
 * precision alone where it may, with some dofs held. */
static void check_rough(pair *p, double least, double unit)
{
    const int64_t n = p->K.cols;
    double *b = random_vector(n, 3), *x = vector(n);
    bool *held = calloc((size_t)n, sizeof *held);
    uz_multigrid_kind counting = uz_aggregates_kind;
    uz_error err = {0};
    uz_cg_info info;
    counting.apply = count_cycles;
    for (int64_t j = 0; j < n; j++) {
        held[j] = j % 11 == 0;
        b[j] *= unit;
    }
    CHECK(uz_cg_hold(&p->cg, &p->K, held, NULL, &err) == UZ_OK);
    for (double relative = 1e-1; relative > 1e-9; relative *= 0.1) {
        for (int64_t j = 0; j < n; j++)
            x[j] = unit * (double)(j % 5);
        const double before = residual_norm(p, x, b, held), absolute = relative * before;
        const uz_cg_stop stop = {.absolute = absolute, .max_iterations = 500, .deadline = INFINITY, .unchecked = true};
        cycles = 0;
        p->amg->mg->kind = &counting;
        CHECK(uz_cg_solve(&info, x, &p->cg, &p->K, b, &stop, &err) == UZ_OK && info.met && info.last <= absolute);
        p->amg->mg->kind = &uz_aggregates_kind;
        const double after = residual_norm(p, x, b, held);
        CHECK_MSG(after <= 1.1 * absolute, "%g of %g where %g was asked for", after, before, absolute);
        CHECK_MSG((cycles == 0) == (relative > least), "%lld cycles in double precision for %g", (long long)cycles,
                  relative);
        for (int64_t j = 0; j < n; j++)
            CHECK(!held[j] || x[j] == unit * (double)(j % 5));
    }
    CHECK(uz_cg_hold(&p->cg, &p->K, NULL, NULL, &err) == UZ_OK);
    free(b);
    free(x);
    free(held);
}

TEST(changes_are_solved_for_in_single_precision)
{
    pair p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3);
    check_rough(&p, 3e-5, 1.0);
    check_rough(&p, 3e-5, 0x1p-400);
    check_rough(&p, 3e-5, 0x1p400);
    close_pair(&p);
    p = open_plane(stretched(600, 20, 300, 10, 0.3), true); /* bends so easily that it hides more */
    check_rough(&p, 3e-2, 1.0);
    close_pair(&p);
}

/* Somebody who looks at a solve on its way. */
typedef struct {
    const pair *p;
    const double *x, *b;
    double near, goal; /* asked for; said */
    int asked;
} onlooker;

static double look_on(void *ctx)
{
    onlooker *o = ctx;
    const int64_t n = o->p->K.cols;
    double *r = vector(n), off = 0.0, size = 0.0;
    memcpy(r, o->b, (size_t)n * sizeof *r);
    uz_csc_symv(r, &o->p->K, -1.0, o->x);
    for (int64_t j = 0; j < n; j++) { /* at held dofs too */
        off = fmax(off, fabs(r[j] - o->p->cg.r[j]));
        size = fmax(size, fabs(r[j]));
    }
    CHECK_MSG(off <= 1e-5 * size, "a residual of %g is off by %g", size, off);
    o->asked++;
    free(r);
    return o->goal;
}

/* Asked once, where the residual is as small as was said; then it is solved to the goal, or no further. */
static void check_look(pair *p, bool unchecked, double goal)
{
    const int64_t n = p->K.cols;
    double *b = random_vector(n, 3), *x = vector(n);
    bool *held = calloc((size_t)n, sizeof *held);
    uz_error err = {0};
    uz_cg_info info;
    for (int64_t j = 0; j < n; j++) {
        held[j] = j % 11 == 0;
        x[j] = (double)(j % 5);
    }
    CHECK(uz_cg_hold(&p->cg, &p->K, held, NULL, &err) == UZ_OK);
    const double before = residual_norm(p, x, b, held);
    onlooker o = {p, x, b, 1e-2 * before, goal * before, 0};
    const uz_cg_stop stop = {.absolute = 1e-9 * before,
                             .max_iterations = 500,
                             .deadline = INFINITY,
                             .unchecked = unchecked,
                             .look = look_on,
                             .ctx = &o,
                             .look_absolute = o.near};
    CHECK(uz_cg_solve(&info, x, &p->cg, &p->K, b, &stop, &err) == UZ_OK && info.looked);
    const double after = residual_norm(p, x, b, held);
    CHECK_INT(o.asked, 1);
    CHECK_INT(info.ended, isinf(goal));
    CHECK_INT(info.met, !isinf(goal));
    CHECK_MSG(after <= 1.1 * (isinf(goal) ? o.near : o.goal), "%g of %g", after, before);
    CHECK_MSG(!isinf(goal) || after > 1e-2 * o.near, "solved for %g in vain", after);
    for (int64_t j = 0; j < n; j++)
        CHECK(!held[j] || x[j] == (double)(j % 5));
    CHECK(uz_cg_hold(&p->cg, &p->K, NULL, NULL, &err) == UZ_OK);
    free(b);
    free(x);
    free(held);
}

TEST(a_solve_is_looked_at_on_its_way)
{
    pair p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3);
    for (int unchecked = 0; unchecked < 2; unchecked++) {
        check_look(&p, unchecked, INFINITY);
        check_look(&p, unchecked, 1e-3);
        check_look(&p, unchecked, 1e-7);
    }
    close_pair(&p);
}

TEST(steps_in_single_precision_are_those_of_conjugate_gradients)
{
    pair p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3);
    double *r = random_vector(p.K.cols, 5);
    check_steps(p.amg->mg, &p.K, p.cg.room, r);
    free(r);
    close_pair(&p);
}

/* What a rough solve says it has left is what it has left. */
TEST(the_residual_in_single_precision_is_told)
{
    pair p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3);
    const int64_t n = p.K.cols;
    double *b = random_vector(n, 3), *x = vector(n), *left = vector(n);
    bool *held = calloc((size_t)n, sizeof *held);
    const uz_cg_stop stop = {.relative = 1e-2, .max_iterations = 100, .deadline = INFINITY, .unchecked = true};
    uz_cg_info info;
    uz_error err = {0};
    for (int64_t j = 0; j < n; j++)
        held[j] = j % 11 == 0;
    CHECK(uz_cg_hold(&p.cg, &p.K, held, NULL, &err) == UZ_OK);
    CHECK(uz_cg_solve(&info, x, &p.cg, &p.K, b, &stop, &err) == UZ_OK && info.met && info.iterations > 1);
    memcpy(left, b, (size_t)n * sizeof *left);
    uz_csc_symv(left, &p.K, -1.0, x);
    double apart = 0.0, whole = 0.0;
    for (int64_t j = 0; j < n; j++) {
        const double wanted = held[j] ? 0.0 : left[j];
        apart += (p.cg.r[j] - wanted) * (p.cg.r[j] - wanted);
        whole += wanted * wanted;
    }
    CHECK_MSG(whole > 0.0 && apart < 1e-8 * whole, "%g of %g", apart, whole);
    CHECK(uz_cg_hold(&p.cg, &p.K, NULL, NULL, &err) == UZ_OK);
    free(b);
    free(x);
    free(left);
    free(held);
    close_pair(&p);
}

/* Who counts steps in single precision for somebody else. */
typedef struct {
    uz_cg_visit visit;
    void *ctx;
} counter;
static int64_t rough_steps;

static bool count_step(void *ctx, double along, double before, double after)
{
    const counter *c = ctx;
    rough_steps++;
    return c->visit(c->ctx, along, before, after);
}

static uz_status step_and_count(const uz_multigrid *mg, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                                void *ctx, uz_error *err)
{
    counter c = {visit, ctx};
    return uz_aggregates_kind.step_roughly(mg, room, r, count_step, &c, err);
}

/* The bound on the spectrum of a brick: cycles in double precision that it took, rough_steps, and lambda; rough: by a
 * kind that has steps in single precision. both: by one that has steps of two residuals; returns how many. */
static int64_t take_bound(double *lambda, const int64_t cells[3], const double size[3], double poisson, bool rough,
                          bool both)
{
    brick b = brick_make(cells, size, poisson, true);
    uz_multigrid_kind counting = uz_aggregates_kind;
    uz_multigrid *mg;
    uz_modes modes;
    uz_amg *amg;
    uz_error err = {0};
    counting.apply = count_cycles;
    counting.step_roughly = rough ? step_and_count : NULL;
    counting.step_both = both ? counting.step_both : NULL;
    CHECK_INT(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err), UZ_OK);
    CHECK_INT(uz_multigrid_create(&mg, &b.K, &modes, NULL, 0, NULL, &err), UZ_OK);
    mg->kind = &counting;
    cycles = rough_steps = 0;
    CHECK_INT(uz_amg_of(&amg, mg, &b.K, 0, NULL, &err), UZ_OK);
    *lambda = amg->info.lambda;
    const int64_t steps = both ? amg->info.iterations : cycles;
    uz_amg_free(amg);
    uz_modes_clear(&modes);
    brick_free(&b);
    return steps;
}

static int64_t cycles_of_bound(double *lambda, const int64_t cells[3], const double size[3], double poisson, bool rough)
{
    return take_bound(lambda, cells, size, poisson, rough, false);
}

/* Drawn apart they bound the spectrum as one does, which test_amg holds against solves; the steps' cycles and products
 * are those of each. */
TEST(two_residuals_bound_the_spectrum_in_fewer_steps)
{
    const int64_t cells[][3] = {{9, 9, 9}, {16, 8, 8}, {60, 4, 4}};
    for (int k = 0; k < 3; k++)
        for (int firm = 0; firm < 2; firm++) {
            const double size[] = {(double)cells[k][0], (double)cells[k][1], (double)cells[k][2]};
            double alone, together;
            const int64_t cycles_alone = cycles_of_bound(&alone, cells[k], size, firm ? 0.45 : 0.3, false),
                          steps = take_bound(&together, cells[k], size, firm ? 0.45 : 0.3, false, true);
            CHECK_MSG(fabs(together - alone) < 0.15 * alone, "%g for %g", together, alone);
            CHECK_MSG(4 * steps < 3 * cycles_alone, "%lld for %lld", (long long)steps, (long long)cycles_alone);
        }
}

TEST(the_spectrum_is_bounded_in_single_precision_where_that_hides_little)
{
    const int64_t cube[] = {9, 9, 9}, block[] = {16, 8, 8}, bar[] = {120, 4, 4};
    double rough, exact;
    CHECK(cycles_of_bound(&rough, cube, (double[]){1, 1, 1}, 0.3, true) < 5);
    CHECK(cycles_of_bound(&exact, cube, (double[]){1, 1, 1}, 0.3, false) > 15);
    CHECK_MSG(rough < exact && rough > 0.95 * exact, "%g for %g", rough, exact);
    CHECK(cycles_of_bound(&rough, block, (double[]){2, 1, 1}, 0.3, true) < 5);
    CHECK(cycles_of_bound(&exact, block, (double[]){2, 1, 1}, 0.3, false) > 15);
    CHECK_MSG(rough < exact && rough > 0.95 * exact, "%g for %g", rough, exact);
    /* so hard to compress that its bound would be hidden, which shows after a few steps */
    CHECK(cycles_of_bound(&rough, block, (double[]){2, 1, 1}, 0.49, true) > 15);
    CHECK_MSG(rough_steps > 0 && rough_steps < 15, "%lld steps in vain", (long long)rough_steps);
    cycles_of_bound(&exact, block, (double[]){2, 1, 1}, 0.49, false);
    CHECK_REL(rough, exact, 1e-12);
    /* bends too easily */
    CHECK(cycles_of_bound(&rough, bar, (double[]){120, 1, 1}, 0.3, true) > 15);
    CHECK_INT(rough_steps, 0);
    cycles_of_bound(&exact, bar, (double[]){120, 1, 1}, 0.3, false);
    CHECK_REL(rough, exact, 1e-12);
}
