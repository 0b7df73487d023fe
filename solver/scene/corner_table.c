#include "scene/corner_table.h"

#include "core/alloc.h"
#include "core/cpu.h"
#include "core/error.h"
#include "linalg/pieces.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* The corners of an item that are sorted as numbers of 32 bits (nodes are fewer: UZ_SCENE_MAX_DOFS), counted from 1 on,
 * 0 beyond them: two to a word. */
typedef uint32_t corner_number;

/* Words of an item of a bucket while it is sorted: its corners after the lowest one, ascending, and last the item, so
 * that equal ones stay as they are. Sides have four corners at most. */
enum { SIDE_WORDS = 3, ELEMENT_WORDS = UZ_MOST_CORNERS / 2 + 1 };

static const int ALL[UZ_MOST_CORNERS] = {0, 1, 2, 3, 4, 5, 6, 7};

/* Corners of a side or of a whole element: node[local[i]], i < *count. */
static const int *list_corners(int *count, const int64_t **node, const uz_mesh *mesh, uz_face item)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[item.element]);
    *node = mesh->node + mesh->first[item.element];
    *count = item.side < 0 ? type->corners : type->side[item.side].corners;
    return item.side < 0 ? ALL : type->side[item.side].node;
}

UZ_INLINE int64_t lowest_corner(const int64_t *node, const int *local, int count)
{
    int64_t lowest = node[local[0]];
    for (int i = 1; i < count; i++)
        lowest = node[local[i]] < lowest ? node[local[i]] : lowest;
    return lowest;
}

static inline void put_in_order(corner_number *a, corner_number *b)
{
    const corner_number less = *a < *b ? *a : *b, more = *a < *b ? *b : *a;
    *a = less;
    *b = more;
}

/* Ascending, in their place, without a choice of ways: which is the greater cannot be foretold. */
static void sort_four(corner_number corner[4])
{
    put_in_order(&corner[0], &corner[1]);
    put_in_order(&corner[2], &corner[3]);
    put_in_order(&corner[0], &corner[2]);
    put_in_order(&corner[1], &corner[3]);
    put_in_order(&corner[1], &corner[2]);
}

static void sort_corners(corner_number *corner, int count)
{
    for (int i = 1; i < count; i++) {
        const corner_number moved = corner[i];
        int j = i;
        for (; j > 0 && corner[j - 1] > moved; j--)
            corner[j] = corner[j - 1];
        corner[j] = moved;
    }
}

/* The words of the corners alone; node[local[i]], i < count. */
UZ_INLINE void make_words(uint64_t *word, const int64_t *node, const int *local, int count, int words)
{
    corner_number corner[UZ_MOST_CORNERS + 4] = {0}; /* up to 4 end at [3], as the zeros come first */
    const int first = count < 4 ? 4 - count : 0;
    for (int i = 0; i < count; i++)
        corner[first + i] = (corner_number)(node[local[i]] + 1);
    if (count <= 4)
        sort_four(corner);
    else
        sort_corners(corner, count);
    const corner_number *next = corner + first + 1;
    for (int w = 0; w < words - 1; w++)
        word[w] = (uint64_t)next[2 * w] << 32 | next[2 * w + 1];
}

UZ_INLINE void words_of_item(uint64_t *word, const uz_mesh *mesh, uz_face item, int words)
{
    const int64_t *node;
    int count;
    const int *local = list_corners(&count, &node, mesh, item);
    make_words(word, node, local, count, words);
}

/* As the sign of a difference. */
UZ_INLINE int compare(const uint64_t *a, const uint64_t *b, int words)
{
    for (int w = 0; w < words; w++)
        if (a[w] != b[w])
            return a[w] < b[w] ? -1 : 1;
    return 0;
}

static int compare_sides(const void *a, const void *b)
{
    return compare(a, b, SIDE_WORDS);
}

static int compare_elements(const void *a, const void *b)
{
    return compare(a, b, ELEMENT_WORDS);
}

/* Counts an item into start[lowest + 1], or, if `place`, puts it where start[lowest] says. */
UZ_INLINE void walk_item(uz_corner_table *table, const int64_t *node, const int *local, int count, int64_t item,
                         bool place)
{
    const int64_t lowest = lowest_corner(node, local, count);
    if (place)
        table->item[table->start[lowest]++] = item;
    else
        table->start[lowest + 1]++;
}

/* So with every item. */
UZ_INLINE void walk_items(uz_corner_table *table, const uz_mesh *mesh, bool sides, bool place)
{
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e], item = UZ_CORNER_TABLE_SIDES * e;
        if (!sides)
            walk_item(table, node, ALL, type->corners, item, place);
        for (int s = 0; sides && s < type->sides; s++)
            if (type->side[s].corners == 3) /* the number decides how long it takes */
                walk_item(table, node, type->side[s].node, 3, item + s + 1, place);
            else
                walk_item(table, node, type->side[s].node, type->side[s].corners, item + s + 1, place);
    }
}

/* Buckets as the threads that share them see them. */
typedef struct {
    uz_corner_table *table;
    const uz_mesh *mesh;
    bool sides;
    int64_t largest; /* items of a bucket */
    atomic_bool no_memory;
} sorting;

/* The items of a bucket, count from `first` on, by their corners. entry: room for as many. */
UZ_INLINE void sort_bucket(uint64_t *entry, const sorting *x, int64_t first, int64_t count, int words)
{
    enum { FEW = 64 }; /* but in meshes made to be hard: a node is the lowest of some sides */
    const size_t size = (size_t)words * sizeof *entry;
    for (int64_t i = 0; i < count; i++) {
        uint64_t added[ELEMENT_WORDS];
        words_of_item(added, x->mesh, uz_corner_table_item(x->table, first + i), words);
        added[words - 1] = (uint64_t)x->table->item[first + i];
        int64_t j = i;
        for (; count <= FEW && j > 0 && compare(entry + words * (j - 1), added, words) > 0; j--)
            memcpy(entry + words * j, entry + words * (j - 1), size);
        memcpy(entry + words * j, added, size);
    }
    if (count > FEW)
        qsort(entry, (size_t)count, size, words == SIDE_WORDS ? compare_sides : compare_elements);
    for (int64_t i = 0; i < count; i++) {
        x->table->item[first + i] = (int64_t)entry[words * i + words - 1];
        x->table->same[first + i] = i > 0 && compare(entry + words * i, entry + words * (i - 1), words - 1) == 0;
    }
}

/* Those of some nodes. */
static void sort_buckets(void *ctx, int64_t begin, int64_t end)
{
    sorting *x = ctx;
    uint64_t *entry = uz_alloc(x->largest, ELEMENT_WORDS * sizeof *entry);
    if (!entry)
        x->no_memory = true;
    for (int64_t node = begin; entry && node < end; node++) {
        const int64_t first = x->table->start[node], count = x->table->start[node + 1] - first;
        if (x->sides)
            sort_bucket(entry, x, first, count, SIDE_WORDS);
        else
            sort_bucket(entry, x, first, count, ELEMENT_WORDS);
    }
    free(entry);
}

uz_status uz_corner_table_build(uz_corner_table *out, const uz_mesh *mesh, bool sides, uz_error *err)
{
    memset(out, 0, sizeof *out);
    out->start = uz_alloc_zero(mesh->n_nodes + 1, sizeof *out->start);
    if (out->start) {
        walk_items(out, mesh, sides, false);
        for (int64_t i = 0; i < mesh->n_nodes; i++)
            out->start[i + 1] += out->start[i];
        out->count = out->start[mesh->n_nodes];
        out->item = uz_alloc(out->count, sizeof *out->item);
        out->same = uz_alloc(out->count + 1, sizeof *out->same);
    }
    sorting x = {.table = out, .mesh = mesh, .sides = sides, .no_memory = !out->start || !out->item || !out->same};
    if (!x.no_memory) {
        walk_items(out, mesh, sides, true);
        memmove(out->start + 1, out->start, (size_t)mesh->n_nodes * sizeof *out->start); /* placing moved each on */
        out->start[0] = 0;
        for (int64_t i = 0; i < mesh->n_nodes; i++)
            if (out->start[i + 1] - out->start[i] > x.largest)
                x.largest = out->start[i + 1] - out->start[i];
        uz_by_pieces(sort_buckets, &x, mesh->n_nodes);
        out->same[out->count] = 0;
    }
    if (!x.no_memory)
        return UZ_OK;
    uz_corner_table_clear(out);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to compare %lld elements", (long long)mesh->n_elements);
}

void uz_corner_table_clear(uz_corner_table *table)
{
    uz_free_all(table->start, table->item, table->same);
    memset(table, 0, sizeof *table);
}

int64_t uz_corner_table_find(const uz_corner_table *table, const uz_mesh *mesh, const int64_t *corner, int count)
{
    uint64_t wanted[ELEMENT_WORDS], there[ELEMENT_WORDS];
    make_words(wanted, corner, ALL, count, ELEMENT_WORDS);
    const int64_t lowest = lowest_corner(corner, ALL, count);
    int64_t low = table->start[lowest], high = table->start[lowest + 1], end = high;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        words_of_item(there, mesh, uz_corner_table_item(table, middle), ELEMENT_WORDS);
        if (compare(there, wanted, ELEMENT_WORDS - 1) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == end)
        return -1;
    words_of_item(there, mesh, uz_corner_table_item(table, low), ELEMENT_WORDS);
    return compare(there, wanted, ELEMENT_WORDS - 1) == 0 ? low : -1;
}

/* A side that lies within a subdivided body has no other with the same corners. */
static bool is_outside(const uz_mesh *mesh, const uz_corner_table *sides, int64_t i)
{
    const uz_face side = uz_corner_table_item(sides, i);
    return !sides->same[i] && !sides->same[i + 1] && !(mesh->inside && mesh->inside[side.element] >> side.side & 1);
}

uz_status uz_outer_sides(uz_group *out, const uz_mesh *mesh, uz_error *err)
{
    uz_corner_table sides = {0};
    int64_t count = 0;
    *out = (uz_group){.kind = UZ_GROUP_FACES};
    uz_status status = uz_corner_table_build(&sides, mesh, true, err);
    for (int64_t i = 0; i < sides.count; i++)
        count += is_outside(mesh, &sides, i);
    if (status == UZ_OK && !(out->face = uz_alloc(count, sizeof *out->face)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld outer sides", (long long)count);
    for (int64_t i = 0; status == UZ_OK && i < sides.count; i++)
        if (is_outside(mesh, &sides, i))
            out->face[out->n_faces++] = uz_corner_table_item(&sides, i);
    uz_corner_table_clear(&sides);
    return status;
}
