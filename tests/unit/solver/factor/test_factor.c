/* The sparse factor: what it refuses, what its last block is, and what its orderings leave behind. */
#include "core/alloc.h"
#include "factor/factor_private.h"
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

#include <pthread.h>
#include <signal.h>

static const uz_ordering orderings[] = {UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};

static uz_status factor_of(uz_factor **out, const uz_csc *K, const int64_t *last, int64_t n_last, uz_ordering ordering,
                           size_t limit, uz_error *err)
{
    uz_thread_init(); /* as every caller must: without it CHOLMOD starts a team of OpenMP threads */
    memset(err, 0, sizeof *err);
    *out = (uz_factor *)err; /* must become NULL on failure */
    return factor_by(out, K, last, n_last, ordering, limit, err);
}

static void check_refused(const uz_csc *K, uz_status want, const char *what)
{
    for (size_t k = 0; k < 3; k++) {
        uz_factor *factor;
        uz_error err;
        uz_status status = factor_of(&factor, K, NULL, 0, orderings[k], 0, &err);
        CHECK_MSG(status == want, "%s, %s: %s", what, uz_choice_name(UZ_CHOICE_ORDERING, orderings[k]),
                  uz_status_name(status));
        CHECK(factor == NULL && err.status == want && err.message[0] != '\0');
        CHECK_STR(err.where, "K");
        if (status == UZ_OK)
            uz_factor_free(factor);
    }
}

TEST(tiny_matrices_that_are_not_positive_definite)
{
    static const double cases[][4] = {
        {-1, 0, 0, 1}, {1, 0, 0, -1e-300}, {0, 0, 0, 1}, {1, 2, 2, 1}, {1, 1, 1, 1}, {0, 1, 1, 0}, {1, 0, 0, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        uz_csc K = csc_from_dense(cases[k], 2, 2, true);
        check_refused(&K, UZ_ERR_NOT_SPD, "2 x 2");
        uz_csc_clear(&K);
    }
    double bad[] = {-3}, zero[] = {0};
    uz_csc negative = csc_from_dense(bad, 1, 1, true), empty = csc_from_dense(zero, 1, 1, true);
    check_refused(&negative, UZ_ERR_NOT_SPD, "1 x 1, negative");
    check_refused(&empty, UZ_ERR_NOT_SPD, "1 x 1, no entry");
    uz_csc_clear(&negative);
    uz_csc_clear(&empty);
}

/* Large enough for supernodes; the faults sit at the first, a middle and the last dof. */
TEST(large_matrices_that_are_not_positive_definite)
{
    static const double pivots[] = {-5, -1e-9, 0, 1.0 / 3};
    static const int64_t at[] = {0, 300, 624};
    for (size_t k = 0; k < 12; k++) {
        uz_csc K = grid(25, 25);
        K.val[K.ptr[at[k % 3]]] = pivots[k / 3];
        check_refused(&K, UZ_ERR_NOT_SPD, "grid with a bad pivot");
        uz_csc_clear(&K);
    }
}

/* Neumann Laplacian: the constant vector costs no energy. */
TEST(singular_body)
{
    static const int64_t widths[] = {2, 3, 4, 5, 7, 12, 30};
    for (size_t k = 0; k < sizeof widths / sizeof widths[0]; k++) {
        int64_t w = widths[k];
        uz_csc K = grid(w, w);
        for (int64_t y = 0; y < w; y++)
            for (int64_t x = 0; x < w; x++)
                K.val[K.ptr[y * w + x]] = (x > 0) + (x < w - 1) + (y > 0) + (y < w - 1);
        check_refused(&K, UZ_ERR_NOT_SPD, "free body");
        uz_csc_clear(&K);
    }
}

TEST(shapes)
{
    uz_factor *factor;
    uz_error err;
    uz_csc K = {.rows = 3, .cols = 2};
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_ERR_SIZE);
    CHECK(factor == NULL);
    K = (uz_csc){0};
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_ERR_SIZE);
}

TEST(memory_limit)
{
    uz_factor *factor;
    uz_error err;
    uz_csc K = grid(30, 30);
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 1000, &err), UZ_ERR_LIMIT);
    CHECK(factor == NULL && strstr(err.message, "1000"));
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
    size_t need = uz_factor_describe(factor).bytes;
    uz_factor_free(factor);
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 2 * need, &err), UZ_OK);
    uz_factor_free(factor);
    uz_csc_clear(&K);
}

static bool always(void *ctx)
{
    ++*(int *)ctx;
    return true;
}

TEST(cancelled_before_the_factorization)
{
    uz_factor *factor;
    uz_error err = {0};
    int asked = 0;
    uz_hooks hooks = {.ctx = &asked, .cancelled = always};
    uz_csc K = grid(10, 10);
    uz_analysis *analysis;
    CHECK_INT(uz_analysis_create(&analysis, &K, NULL, 0, 0, UZ_ORDERING_AMD, &hooks, &err), UZ_ERR_CANCELLED);
    CHECK(analysis == NULL && asked == 1);
    CHECK_INT(uz_analysis_create(&analysis, &K, NULL, 0, 0, UZ_ORDERING_AMD, NULL, &err), UZ_OK);
    CHECK_INT(uz_factor_create(&factor, &K, analysis, 0, &hooks, &err), UZ_ERR_CANCELLED);
    CHECK(factor == NULL && asked == 2);
    uz_analysis_free(analysis);
    uz_csc_clear(&K);
}

/* ||K x - b|| / (||K|| ||x||) */
static double residual(const uz_csc *K, const double *x, const double *b)
{
    double r = 0, size = 0, *y = vector(K->cols);
    uz_csc_symv(y, K, 1, x);
    for (int64_t i = 0; i < K->cols; i++) {
        r = fmax(r, fabs(y[i] - b[i]));
        size = fmax(size, fabs(x[i]));
    }
    free(y);
    return r / (8 * size);
}

TEST(solves_are_accurate)
{
    static const int64_t sizes[] = {1, 2, 3, 4, 7, 40};
    enum { COLUMNS = 3 };
    for (size_t k = 0; k < 18; k++) {
        int64_t w = sizes[k / 3], n = w * w;
        uz_ordering ordering = orderings[k % 3];
        uz_csc K = grid(w, w);
        uz_factor *factor;
        uz_error err;
        uz_factor_workspace *ws = uz_factor_workspace_new();
        double *b = vector(COLUMNS * n), *x = vector(COLUMNS * n), *y = vector(COLUMNS * n);
        qp_random rng = {k};
        CHECK_INT(factor_of(&factor, &K, NULL, 0, ordering, 0, &err), UZ_OK);
        for (int64_t i = 0; i < COLUMNS * n; i++)
            b[i] = random_signed(&rng);
        for (int64_t c = 0; c < COLUMNS; c++)
            uz_factor_permute(factor, y + c * n, b + c * n);
        for (int64_t c = 0; c < 2 * COLUMNS; c++)
            CHECK(uz_factor_solve_one(factor, ws, y + c % COLUMNS * n, c < COLUMNS, &err) == UZ_OK);
        for (int64_t c = 0; c < COLUMNS; c++) {
            uz_factor_unpermute(factor, x + c * n, y + c * n);
            CHECK_MSG(residual(&K, x + c * n, b + c * n) < 1e-15, "%d: %g", (int)n, residual(&K, x + c * n, b + c * n));
        }
        uz_factor_workspace_free(ws);
        uz_factor_free(factor);
        uz_csc_clear(&K);
        uz_free_all(b, x, y);
    }
}

/* The Schur complement of dense K on `last`, by elimination of the others one by one. */
static double *schur_complement(const double *K, int64_t n, const int64_t *last, int64_t n_last)
{
    double *A = vector(n * n), *S = vector(n_last * n_last);
    bool *kept = calloc((size_t)n, sizeof *kept);
    memcpy(A, K, (size_t)(n * n) * sizeof *A);
    for (int64_t k = 0; k < n_last; k++)
        kept[last[k]] = true;
    for (int64_t p = 0; p < n; p++)
        for (int64_t i = 0; !kept[p] && i < n; i++) {
            double factor = A[i * n + p] / A[p * n + p];
            for (int64_t j = 0; i != p && factor != 0 && j < n; j++)
                A[i * n + j] -= factor * A[p * n + j];
        }
    for (int64_t k = 0; k < n_last; k++)
        for (int64_t l = 0; l < n_last; l++)
            S[k * n_last + l] = A[last[k] * n + last[l]];
    free(A);
    free(kept);
    return S;
}

/* block block' = S in the block's order; order and where fit the factor's positions. */
static void check_block(const uz_factor *factor, const double *S, const int64_t *last, int64_t n_last, const char *what)
{
    double *block = vector(n_last * n_last);
    int64_t *order = calloc((size_t)n_last + 1, sizeof *order), *where = calloc((size_t)n_last + 1, sizeof *where);
    int64_t *rank = calloc((size_t)n_last + 1, sizeof *rank);
    uz_error err = {0};
    CHECK_MSG(uz_factor_last_block(factor, block, order, where, &err) == UZ_OK, "%s: %s", what, err.message);
    for (int64_t k = 0; k < n_last; k++) {
        while (rank[k] < n_last && last[rank[k]] != order[k])
            rank[k]++;
        CHECK(rank[k] < n_last);
        CHECK_INT(uz_factor_describe(factor).position[order[k]], where[k]);
        CHECK(k == 0 || where[k] > where[k - 1]);
        CHECK(block[k + k * n_last] > 0);
        for (int64_t l = k + 1; l < n_last; l++)
            CHECK(block[k + l * n_last] == 0);
    }
    for (int64_t k = 0; k < n_last; k++)
        for (int64_t l = 0; l <= k; l++) {
            double sum = 0;
            for (int64_t q = 0; q <= l; q++)
                sum += block[k + q * n_last] * block[l + q * n_last];
            CHECK_MSG(fabs(sum - S[rank[k] * n_last + rank[l]]) < 1e-13, "%s: S(%d, %d) is %g, want %g", what, (int)k,
                      (int)l, sum, S[rank[k] * n_last + rank[l]]);
        }
    uz_free_all(block, order, where, rank);
}

static void check_last(const double *dense, int64_t n, const int64_t *last, int64_t n_last, const char *what)
{
    uz_csc K = csc_from_dense(dense, n, n, true);
    double *S = schur_complement(dense, n, last, n_last);
    for (size_t k = 0; k < 3; k++) {
        uz_factor *factor;
        uz_error err;
        CHECK_INT(factor_of(&factor, &K, last, n_last, orderings[k], 0, &err), UZ_OK);
        CHECK_INT(uz_factor_describe(factor).ordering, orderings[k]);
        check_block(factor, S, last, n_last, what);
        uz_factor_free(factor);
    }
    free(S);
    uz_csc_clear(&K);
}

TEST(last_block_of_one_body)
{
    double *K = vector(144 * 144);
    int64_t edge[] = {0, 12, 24, 36, 48, 60, 72, 84}, corners[] = {0, 11, 132, 143}, one[] = {77}, all[144];
    add_grid(K, 144, 0, 12, 12);
    for (int64_t i = 0; i < 144; i++)
        all[i] = i;
    check_last(K, 144, edge, 8, "edge");
    check_last(K, 144, corners, 4, "corners");
    check_last(K, 144, one, 1, "one dof");
    check_last(K, 144, all, 144, "all dofs");
    check_last(K, 144, NULL, 0, "no dof");
    free(K);
}

/* The elimination tree is a forest: the last dofs need not end up at the very end. */
TEST(last_block_of_unconnected_bodies)
{
    int64_t both[] = {0, 1, 2, 3, 4, 100, 101, 102, 190, 199}, first[] = {0, 5, 9}, second[] = {140, 150, 160, 199};
    double *K = vector(200 * 200);
    add_grid(K, 200, 0, 10, 10);
    add_grid(K, 200, 100, 10, 10);
    check_last(K, 200, both, 10, "both touch");
    check_last(K, 200, first, 3, "the first touches");
    check_last(K, 200, second, 4, "the second touches");
    free(K);
}

TEST(last_block_of_many_bodies)
{
    enum { BODIES = 12, SIZE = 9, TOTAL = BODIES * SIZE };
    double *K = vector(TOTAL * TOTAL);
    int64_t last[2 * BODIES], count = 0;
    for (int64_t b = 0; b < BODIES; b++) {
        add_grid(K, TOTAL, b * SIZE, 3, 3);
        if (b % 3 != 1) {
            last[count++] = b * SIZE + b % SIZE;
            if (b % SIZE != SIZE - 1)
                last[count++] = b * SIZE + SIZE - 1;
        }
    }
    check_last(K, TOTAL, last, count, "many bodies");
    free(K);
}

TEST(last_block_of_diagonal_and_tiny_matrices)
{
    for (int64_t n = 1; n < 8; n++) {
        double *K = vector(n * n);
        int64_t last[] = {n / 2, n - 1};
        for (int64_t i = 0; i < n; i++)
            K[i * n + i] = 2 + (double)i;
        check_last(K, n, last, last[0] == last[1] ? 1 : 2, "diagonal");
        for (int64_t i = 1; i < n; i++)
            K[i * n + i - 1] = K[(i - 1) * n + i] = -0.5;
        check_last(K, n, last, last[0] == last[1] ? 1 : 2, "chain");
        free(K);
    }
}

static void own_handler(int number)
{
    (void)number;
}

static void *factor_by_metis(void *ctx)
{
    uz_thread_init();
    for (int k = 0; k < 4; k++) {
        uz_factor *factor;
        uz_error err;
        CHECK_INT(factor_of(&factor, ctx, NULL, 0, UZ_ORDERING_METIS, 0, &err), UZ_OK);
        uz_factor_free(factor);
    }
    return NULL;
}

static void check_handlers(void)
{
    struct sigaction now;
    sigaction(SIGTERM, NULL, &now);
    CHECK(now.sa_handler == own_handler && (now.sa_flags & SA_RESTART));
    sigaction(SIGABRT, NULL, &now);
    CHECK(now.sa_handler == SIG_IGN);
}

/* METIS swaps these dispositions while it runs. */
TEST(metis_leaves_signal_dispositions_alone)
{
    enum { THREADS = 4 };
    struct sigaction before[2], own = {.sa_handler = own_handler, .sa_flags = SA_RESTART}, ignore = {0};
    pthread_t threads[THREADS];
    uz_csc K = grid(30, 30);
    uz_factor *factor;
    uz_error err;
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGTERM, &own, &before[0]);
    sigaction(SIGABRT, &ignore, &before[1]);
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_METIS, 0, &err), UZ_OK);
    uz_factor_free(factor);
    check_handlers();
    for (int t = 0; t < THREADS; t++)
        CHECK(pthread_create(&threads[t], NULL, factor_by_metis, &K) == 0);
    for (int t = 0; t < THREADS; t++)
        pthread_join(threads[t], NULL);
    check_handlers();
    sigaction(SIGTERM, &before[0], NULL);
    sigaction(SIGABRT, &before[1], NULL);
    uz_csc_clear(&K);
}

/* K with the fixed dofs held: their rows and columns as those of the identity. */
static uz_csc hold(const uz_csc *K, const bool *fixed)
{
    uz_csc held;
    uz_error err = {0};
    CHECK(uz_csc_copy(&held, K, &err) == UZ_OK);
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            if (fixed[j] || fixed[K->idx[k]])
                held.val[k] = K->idx[k] == j;
    return held;
}

TEST(principal_part)
{
    for (uint64_t seed = 0; seed < 30; seed++) {
        qp_random rng = {seed};
        int64_t w = random_int(&rng, 1, 14), n = w * w;
        uz_csc K = grid(w, w);
        uz_factor *factor;
        uz_principal *part = NULL;
        uz_factor_workspace *ws = uz_factor_workspace_new();
        uz_error err;
        bool *fixed = calloc((size_t)n, sizeof *fixed);
        double *b = vector(n), *x = vector(n), share = random_unit(&rng);
        for (int64_t i = 0; i < n; i++) {
            fixed[i] = seed > 1 ? random_unit(&rng) < share : seed == 1;
            b[i] = x[i] = random_signed(&rng);
        }
        CHECK(factor_of(&factor, &K, NULL, 0, orderings[seed % 3], 0, &err) == UZ_OK);
        CHECK(uz_principal_create(&part, &K, fixed, factor, ws, NULL, &err) == UZ_OK && part);
        CHECK(uz_principal_solve(x, part, &err) == UZ_OK);
        uz_csc held = hold(&K, fixed);
        for (int64_t i = 0; i < n; i++)
            CHECK(!fixed[i] || x[i] == b[i]);
        CHECK(residual(&held, x, b) < 1e-15);
        uz_principal_free(part);
        uz_factor_free(factor);
        uz_factor_workspace_free(ws);
        uz_csc_clear(&K);
        uz_csc_clear(&held);
        uz_free_all(fixed, b, x);
    }
}

/* From one set of held dofs to the next: a few that change, many, none, all, and back. */
TEST(principal_parts_one_after_the_other)
{
    for (uint64_t seed = 0; seed < 12; seed++) {
        qp_random rng = {seed};
        int64_t w = random_int(&rng, 2, 40), n = w * w;
        uz_csc K = grid(w, w);
        uz_factor *factor;
        uz_principal *part = NULL;
        uz_factor_workspace *ws = uz_factor_workspace_new();
        uz_error err;
        bool *fixed = calloc((size_t)n, sizeof *fixed), positive = true;
        double *b = vector(n), *x = vector(n);
        CHECK(factor_of(&factor, &K, NULL, 0, orderings[seed % 3], 0, &err) == UZ_OK);
        CHECK(uz_principal_create(&part, &K, fixed, factor, ws, NULL, &err) == UZ_OK && part);
        for (int k = 0; k < 12; k++) {
            const int64_t middle = random_int(&rng, 0, n);
            for (int64_t i = 0; i < n; i++) { /* a disk comes or goes; single dofs; none and all */
                const int64_t dx = i % w - middle % w, dy = i / w - middle / w;
                if (k == 5 || k == 9)
                    fixed[i] = k == 9;
                else if (k % 3 == 2 ? random_unit(&rng) < 0.02 : 16 * (dx * dx + dy * dy) < n)
                    fixed[i] = k % 2 == 0;
                b[i] = x[i] = random_signed(&rng);
            }
            CHECK(part && uz_principal_hold(&positive, part, &K, fixed, NULL, &err) == UZ_OK && positive);
            CHECK(part && uz_principal_solve(x, part, &err) == UZ_OK);
            uz_csc held = hold(&K, fixed);
            for (int64_t i = 0; i < n; i++)
                CHECK(!fixed[i] || x[i] == b[i]);
            CHECK_MSG(residual(&held, x, b) < 1e-15, "seed %d, set %d", (int)seed, k);
            uz_csc_clear(&held);
        }
        uz_principal_free(part);
        uz_factor_free(factor);
        uz_factor_workspace_free(ws);
        uz_csc_clear(&K);
        uz_free_all(fixed, b, x);
    }
}

/* Another dof in the middle of a grid changes the separators around it, not what they separate. */
TEST(another_held_dof_changes_little_of_a_factor)
{
    enum { W = 60 };
    uz_csc K = grid(W, W);
    uz_factor *factor;
    uz_paths *paths = NULL;
    uz_factor_workspace *ws = uz_factor_workspace_new();
    uz_error err;
    bool fixed[W * W] = {false}, positive = false;
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
    CHECK(uz_paths_create(&paths, &K, factor, ws, &err) == UZ_OK && paths);
    for (int i = 0; i < W * W; i++)
        fixed[i] = i % 2;
    const double most = uz_paths_work(paths, fixed);
    for (int i = 0; i < W * W; i++)
        fixed[i] = (i % W - 30) * (i % W - 30) + (i / W - 30) * (i / W - 30) < 25;
    CHECK(uz_paths_hold(&positive, paths, fixed, NULL, &err) == UZ_OK && positive);
    CHECK(uz_paths_work(paths, fixed) == 0);
    fixed[30 * W + 35] = true;
    const double work = uz_paths_work(paths, fixed);
    CHECK_MSG(work > 0 && 2 * work < most, "%g of %g", work, most);
    uz_paths_free(paths);
    uz_factor_free(factor);
    uz_factor_workspace_free(ws);
    uz_csc_clear(&K);
}

/* e_j'K^-1 e_j <= bound / K_jj for all j, and for random vectors. */
/* One after the other, of one pattern: each is the factor of its own numbers. Scaled by a power of four, these have the
 * same digits. */
TEST(factors_made_briefly_have_their_own_numbers)
{
    enum { WIDTH = 20, N = WIDTH * WIDTH, FACTORS = 3 };
    uz_csc K = grid(WIDTH, WIDTH);
    uz_factor *factor, *brief;
    uz_error err;
    uz_factor_workspace *ws = uz_factor_workspace_new();
    double *b = vector(N), *x = vector(N), *want = vector(N), *room = vector(N);
    qp_random rng = {1};
    for (int64_t i = 0; i < N; i++)
        b[i] = random_signed(&rng);
    CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
    CHECK(uz_factor_solve(factor, ws, want, b, room, &err) == UZ_OK);
    uz_analysis *analysis = uz_factor_analysis(factor);
    for (int k = 0; k < FACTORS; k++) {
        CHECK_INT(uz_factor_create_briefly(&brief, &K, analysis, 0, NULL, &err), UZ_OK);
        CHECK(uz_factor_solve(brief, ws, x, b, room, &err) == UZ_OK);
        for (int64_t i = 0; i < N; i++)
            CHECK(ldexp(x[i], 2 * k) == want[i]);
        uz_factor_free(brief);
        for (int64_t q = 0; q < K.ptr[N]; q++)
            K.val[q] *= 4;
    }
    K.val[K.ptr[N / 2]] = -1;
    CHECK_INT(uz_factor_create_briefly(&brief, &K, analysis, 0, NULL, &err), UZ_ERR_NOT_SPD);
    uz_analysis_free(analysis);
    uz_factor_free(factor);
    uz_factor_workspace_free(ws);
    uz_csc_clear(&K);
    uz_free_all(b, x, want, room);
}

TEST(inverse_norm_is_an_upper_bound)
{
    for (uint64_t seed = 0; seed < 40; seed++) {
        qp_random rng = {seed};
        int64_t n = random_int(&rng, 1, 30);
        double *dense = random_spd(&rng, n, pow(10, 8 * random_unit(&rng)), 1), bound = 0, worst = 0;
        uz_csc K = csc_from_dense(dense, n, n, true);
        uz_factor *factor;
        uz_error err;
        CHECK_INT(factor_of(&factor, &K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
        bound = uz_factor_describe(factor).inverse_bound;
        double *x = vector(n), *L = dense_symmetric(&K);
        CHECK(dense_cholesky(L, n));
        for (int64_t i = 0; i < n; i++)
            x[i] = random_signed(&rng);
        for (int step = 0; step < 50; step++) { /* power iteration with diag(K)^1/2 K^-1 diag(K)^1/2 */
            double square = 0;
            for (int64_t i = 0; i < n; i++)
                x[i] *= sqrt(dense[i * n + i]);
            dense_solve(x, L, n);
            for (int64_t i = 0; i < n; i++) {
                x[i] *= sqrt(dense[i * n + i]);
                square += x[i] * x[i];
            }
            worst = sqrt(square);
            for (int64_t i = 0; i < n; i++)
                x[i] /= worst;
        }
        CHECK(uz_factor_describe(factor).rcond >= (1 - 1e-6) / worst);
        CHECK_MSG(bound >= worst && bound <= 200 * worst, "n %d: bound %g, norm at least %g", (int)n, bound, worst);
        uz_analysis *analysis = uz_factor_analysis(factor);
        uz_factor *brief;
        CHECK_INT(uz_factor_create_briefly(&brief, &K, analysis, 0, NULL, &err), UZ_OK);
        CHECK(isinf(uz_factor_describe(brief).inverse_bound));
        double rcond = NAN;
        CHECK_INT(uz_factor_estimate_rcond(&rcond, brief, &K, &err), UZ_OK);
        CHECK(rcond >= (1 - 1e-6) / worst && rcond <= uz_factor_describe(brief).rcond);
        CHECK_MSG(rcond <= 1e3 / worst, "n %d: %g, of %g", (int)n, rcond, 1 / worst);
        uz_factor_free(brief);
        uz_analysis_free(analysis);
        uz_free_all(dense, x, L);
        uz_factor_free(factor);
        uz_csc_clear(&K);
    }
}
