/* Which sides and elements have the same corners, against a comparison of each with each. */
#include "harness.h"
#include "scene/corner_table.h"

#include <stdlib.h>
#include <string.h>

enum { NODES = 60, MOST = 400 };

/* Elements of all kinds of solids, with any corners: what is no body, but a table all the same. */
typedef struct {
    int64_t node[MOST * 8], first[MOST + 1];
    unsigned char kind[MOST];
} elements;

static void make_mesh(uz_mesh *mesh, elements *of, int64_t nodes, int64_t count)
{
    static const unsigned char KINDS[] = {UZ_TET4, UZ_HEX8, UZ_WEDGE6};
    *mesh = (uz_mesh){
        .dim = 3, .n_nodes = nodes, .n_elements = count, .node = of->node, .first = of->first, .kind = of->kind};
    of->first[0] = 0;
    for (int64_t e = 0; e < count; e++) {
        of->kind[e] = KINDS[rand() % 3];
        const int corners = uz_element_type_of((uz_element_kind)of->kind[e])->corners;
        int64_t *node = of->node + of->first[e];
        for (int i = 0; i < corners; i++) {
            bool again = true;
            while (again) {
                node[i] = rand() % nodes;
                again = false;
                for (int j = 0; j < i; j++)
                    again = again || node[j] == node[i];
            }
        }
        of->first[e + 1] = of->first[e] + corners;
    }
}

static int by_number(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* As they stand, and ascending with -1 beyond them; returns how many. */
static int corners_of(int64_t given[8], int64_t sorted[8], const uz_mesh *mesh, uz_face item)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[item.element]);
    const int64_t *node = mesh->node + mesh->first[item.element];
    const int count = item.side < 0 ? type->corners : type->side[item.side].corners;
    for (int i = 0; i < 8; i++)
        given[i] = i >= count ? -1 : node[item.side < 0 ? i : type->side[item.side].node[i]];
    memcpy(sorted, given, 8 * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, by_number);
    return count;
}

/* Ascending by corners, then by element and side; `same` and the search by what the corners are. */
static void check_table(const uz_mesh *mesh, bool sides, int64_t least_in_one_bucket)
{
    uz_corner_table table;
    int64_t count = 0, largest = 0;
    CHECK(uz_corner_table_build(&table, mesh, sides, NULL) == UZ_OK);
    for (int64_t e = 0; e < mesh->n_elements; e++)
        count += sides ? uz_element_type_of((uz_element_kind)mesh->kind[e])->sides : 1;
    CHECK_INT(table.count, count);
    CHECK_INT(table.same[count], 0);
    for (int64_t i = 0, group = 0; i < table.count; i++) {
        int64_t own[8], sorted[8], before[8], other[8];
        const uz_face item = uz_corner_table_item(&table, i);
        const int corners = corners_of(own, sorted, mesh, item);
        int order = -1;
        if (i > 0) {
            corners_of(other, before, mesh, uz_corner_table_item(&table, i - 1));
            for (int k = 0; k < 8 && order == -1 && (k == 0 || before[k - 1] == sorted[k - 1]); k++)
                order = before[k] > sorted[k] ? 1 : k == 7 && before[k] == sorted[k] ? 0 : -1;
        }
        CHECK_MSG(order <= 0, "item %d is out of order", (int)i);
        CHECK_INT(table.same[i], i > 0 && order == 0);
        CHECK(order != 0 || table.item[i - 1] < table.item[i]);
        group = table.same[i] ? group : i;
        CHECK_INT(uz_corner_table_find(&table, mesh, own, corners), group);
        CHECK(table.start[sorted[0]] <= i && i < table.start[sorted[0] + 1]);
    }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        largest = table.start[a + 1] - table.start[a] > largest ? table.start[a + 1] - table.start[a] : largest;
    CHECK(largest >= least_in_one_bucket);
    const int64_t nowhere[4] = {mesh->n_nodes - 1, mesh->n_nodes - 2, mesh->n_nodes - 4, mesh->n_nodes - 3};
    int64_t there = -1, own[8], sorted[8];
    for (int64_t i = table.count - 1; i >= 0; i--)
        if (corners_of(own, sorted, mesh, uz_corner_table_item(&table, i)) == 4 && sorted[0] == mesh->n_nodes - 4 &&
            sorted[3] == mesh->n_nodes - 1)
            there = i;
    CHECK_INT(uz_corner_table_find(&table, mesh, nowhere, 4), there);
    uz_corner_table_clear(&table);
}

TEST(buckets_with_few_items)
{
    elements of;
    uz_mesh mesh;
    srand(1);
    for (int k = 0; k < 20; k++) {
        make_mesh(&mesh, &of, NODES, 40);
        check_table(&mesh, true, 4);
        check_table(&mesh, false, 2);
    }
}

TEST(buckets_with_many_items)
{
    elements of;
    uz_mesh mesh;
    srand(2);
    make_mesh(&mesh, &of, 9, MOST);
    check_table(&mesh, true, 500);
    check_table(&mesh, false, 100);
}
