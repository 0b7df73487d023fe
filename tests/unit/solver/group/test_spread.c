/* K by blocks of nodes for several processes: every entry arrives once, at the place that its dofs have. */
#include "harness.h"
#include "group/divide.h"
#include "group/spread.h"

#include <math.h>

enum { D = 40, PROCESSES = 3 };

typedef struct {
    double dense[D][D];
    uz_csc K;
    uz_modes modes;
    int32_t node[D];
    float value[D * 2];
    int64_t ptr[D + 1];
    int32_t idx[D * D];
    double val[D * D];
} body;

/* A band with holes, in blocks of nodes too, and some couplings far away. Dof j belongs to node j % nodes, so that dofs
 * of a node are apart, or they have numbers in a row. */
static void fill(body *b, int32_t nodes, bool in_a_row)
{
    memset(b, 0, sizeof *b);
    for (int j = 0; j < D; j++) {
        b->node[j] = in_a_row ? j / ((D + nodes - 1) / nodes) : j % nodes;
        b->value[2 * j] = (float)j;
        b->value[2 * j + 1] = (float)(100 + j);
        b->dense[j][j] = 10.0 + j;
        for (int i = j + 1; i < D; i++)
            if ((i - j < 3 && (i + j) % 11 != 0) || (i * 7 + j) % 31 == 0)
                b->dense[i][j] = b->dense[j][i] = -1.0 / (1.0 + i + 2.0 * j);
    }
    int64_t at = 0;
    for (int j = 0; j < D; j++) {
        for (int i = j; i < D; i++)
            if (b->dense[i][j] != 0.0) {
                b->idx[at] = (int32_t)i;
                b->val[at++] = b->dense[i][j];
            }
        b->ptr[j + 1] = at;
    }
    b->K = (uz_csc){.rows = D, .cols = D, .ptr = b->ptr, .idx = b->idx, .val = b->val};
    b->modes = (uz_modes){.count = 2, .n_nodes = nodes, .node = b->node, .value = b->value};
}

/* Rows of all processes, put together. */
static void gather(double *whole, float *modes, const uz_spread *map, const body *b)
{
    const int64_t bs = map->bs;
    int64_t node = 0;
    uz_error err = {0};
    for (int64_t process = 0; process < PROCESSES; process++) {
        uz_spread_rows rows = {.process = process};
        CHECK(uz_spread_begin(&rows, map, &b->K, &b->modes, &err) == UZ_OK);
        while (uz_spread_next(&rows, map)) {
            const double *value = rows.values;
            int64_t block = 0;
            for (int64_t i = 0; i < rows.nodes; block += rows.counts[i++], node++) {
                CHECK(map->part[map->order[node]] == process);
                for (int64_t c = 0; c < bs; c++)
                    for (int64_t k = 0; k < rows.counts[i]; k++)
                        for (int64_t e = 0; e < bs; e++) {
                            const int64_t row = node * bs + c, other = rows.columns[block + k], column = other * bs + e;
                            const bool own = map->part[map->order[other]] == process;
                            CHECK(!own || other >= node);
                            whole[row * map->size + column] = *value;
                            if (own)
                                whole[column * map->size + row] = *value;
                            value++;
                        }
                for (int64_t k = 1; k < rows.counts[i]; k++)
                    CHECK(rows.columns[block + k - 1] < rows.columns[block + k]);
                memcpy(modes + node * bs * 2, rows.modes + i * bs * 2, (size_t)(bs * 2) * sizeof *modes);
            }
        }
        uz_spread_rows_clear(&rows);
    }
    CHECK(node == map->nodes);
}

static void check_spread(int32_t nodes, int64_t bs, int64_t padded, bool in_a_row)
{
    body *b = malloc(sizeof *b);
    uz_spread map;
    uz_error err = {0};
    fill(b, nodes, in_a_row);
    CHECK(uz_spread_init(&map, &b->K, &b->modes, &err) == UZ_OK);
    CHECK(map.bs == bs && map.size == D + padded);
    for (int64_t i = 0; i < map.nodes; i++)
        map.part[i] = (int32_t)((i * 5 + 1) % PROCESSES);
    CHECK(uz_spread_number(&map, PROCESSES, &err) == UZ_OK);
    double *whole = calloc((size_t)(map.size * map.size), sizeof *whole);
    float *modes = calloc((size_t)(map.size * 2), sizeof *modes);
    bool *has = calloc((size_t)map.size, sizeof *has);
    gather(whole, modes, &map, b);
    for (int i = 0; i < D; i++) {
        CHECK(!has[map.place[i]]);
        has[map.place[i]] = true;
        CHECK(modes[map.place[i] * 2] == (float)i && modes[map.place[i] * 2 + 1] == (float)(100 + i));
        for (int j = 0; j < D; j++)
            CHECK(whole[map.place[i] * map.size + map.place[j]] == b->dense[i][j]);
    }
    for (int64_t i = 0; i < map.size; i++)
        for (int64_t j = 0; !has[i] && j < map.size; j++)
            CHECK(i == j ? whole[i * map.size + j] > 0.0
                         : whole[i * map.size + j] == 0.0 && whole[j * map.size + i] == 0.0);
    uz_spread_clear(&map);
    free(whole);
    free(modes);
    free(has);
    free(b);
}

TEST(nodes_are_filled_up)
{
    check_spread(15, 3, 5, false); /* ten nodes of three dofs, five of two */
    check_spread(20, 2, 0, false);
}

TEST(columns_of_dofs_in_a_row_are_copied_where_they_are_whole)
{
    check_spread(14, 3, 2, true); /* the last one has one dof */
    check_spread(20, 2, 0, true);
}

TEST(dofs_are_nodes_where_too_much_would_be_added)
{
    check_spread(27, 1, 0, false); /* thirteen nodes of two, fourteen of one */
    check_spread(4, 1, 0, false);  /* ten dofs each are no node */
}

TEST(a_part_that_does_not_exist_is_refused)
{
    body *b = malloc(sizeof *b);
    uz_spread map;
    uz_error err = {0};
    fill(b, 20, false);
    CHECK(uz_spread_init(&map, &b->K, &b->modes, &err) == UZ_OK);
    for (int64_t i = 0; i < map.nodes; i++)
        map.part[i] = i == 7 ? PROCESSES : 0;
    CHECK(uz_spread_number(&map, PROCESSES, &err) == UZ_ERR_INTERNAL);
    uz_spread_clear(&map);
    b->val[0] = -1.0;
    err = (uz_error){.status = UZ_OK};
    CHECK(uz_spread_init(&map, &b->K, &b->modes, &err) == UZ_ERR_NOT_SPD && strcmp(err.where, "K") == 0);
    uz_spread_clear(&map);
    free(b);
}

/* ---- by places */

enum { NX = 12, NY = 5, NZ = 4, POINTS = NX * NY * NZ };

static void lattice(double x[POINTS][3])
{
    for (int i = 0; i < POINTS; i++) {
        const int at[3] = {i % NX, i / NX % NY, i / NX / NY};
        x[i][0] = 7 + 0.8 * at[0] - 0.6 * at[1]; /* turned */
        x[i][1] = 3 + 0.6 * at[0] + 0.8 * at[1];
        x[i][2] = at[2];
    }
}

TEST(points_are_divided_across_their_longest_side)
{
    double x[POINTS][3];
    int32_t part[POINTS];
    lattice(x);
    CHECK(uz_divide(part, x[0], POINTS, 3, 3));
    for (int i = 0; i < POINTS; i++)
        CHECK_INT(part[i], i % NX / 4);
    CHECK(uz_divide(part, x[0], POINTS, 3, 1));
    for (int i = 0; i < POINTS; i++)
        CHECK_INT(part[i], 0);
    memset(x, 0, sizeof x); /* all in one place */
    int count[4] = {0};
    CHECK(uz_divide(part, x[0], POINTS, 3, 4));
    for (int i = 0; i < POINTS; i++)
        count[part[i]]++;
    for (int p = 0; p < 4; p++)
        CHECK_INT(count[p], POINTS / 4);
}

/* A chain of nodes that lies straight is cut once, one whose nodes have any place is not cut by where they are. */
TEST(a_cut_through_too_many_couplings_is_none)
{
    enum { N = 100 };
    double val[2 * N], x[N];
    int64_t ptr[N + 1] = {0};
    int32_t idx[2 * N];
    int32_t node[N];
    float value[N];
    bool divided;
    uz_error err = {0};
    for (int j = 0; j < N; j++) {
        ptr[j + 1] = ptr[j];
        for (int i = j; i < j + 2 && i < N; i++) {
            val[ptr[j + 1]] = i == j ? 2 : -1;
            idx[ptr[j + 1]++] = (int32_t)i;
        }
        node[j] = j;
        value[j] = 1;
        x[j] = j;
    }
    const uz_csc K = {.rows = N, .cols = N, .ptr = ptr, .idx = idx, .val = val};
    uz_modes modes = {.count = 1, .n_nodes = N, .node = node, .value = value, .xyz = x, .dim = 1};
    uz_spread map;
    CHECK_INT(uz_spread_init(&map, &K, &modes, &err), UZ_OK);
    CHECK_INT(uz_spread_divide(&divided, &map, &modes, 2, &err), UZ_OK);
    CHECK(divided);
    for (int i = 0; i < N; i++)
        CHECK_INT(map.part[i], i >= N / 2);
    memset(map.part, 0, N * sizeof *map.part);
    for (int j = 0; j < N; j++)
        x[j] = j * 37 % N;
    CHECK_INT(uz_spread_divide(&divided, &map, &modes, 2, &err), UZ_OK);
    CHECK(!divided && map.part[N - 1] == 0);
    modes.xyz = NULL;
    CHECK_INT(uz_spread_divide(&divided, &map, &modes, 2, &err), UZ_OK);
    CHECK(!divided);
    uz_spread_clear(&map);
}
