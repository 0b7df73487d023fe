#include "scene/corner_table.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/pieces.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* An item of a bucket while it is sorted: the corners after the lowest one, ascending, -1 beyond them. */
typedef struct {
    int64_t corner[UZ_MOST_CORNERS - 1], item;
} sort_entry;

static void sort_nodes(int64_t *node, int count)
{
    for (int i = 1; i < count; i++) {
        const int64_t moved = node[i];
        int j = i;
        for (; j > 0 && node[j - 1] > moved; j--)
            node[j] = node[j - 1];
        node[j] = moved;
    }
}

/* The corners of a side or of a whole element, -1 beyond them; how many there are. */
static int list_corners(int64_t corner[UZ_MOST_CORNERS], const uz_mesh *mesh, uz_face item)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[item.element]);
    const int64_t *node = mesh->node + mesh->first[item.element];
    const int *local = item.side < 0 ? NULL : type->side[item.side].node;
    const int count = item.side < 0 ? type->corners : type->side[item.side].corners;
    for (int i = 0; i < UZ_MOST_CORNERS; i++)
        corner[i] = i >= count ? -1 : local ? node[local[i]] : node[i];
    return count;
}

/* The same, ascending. */
static void sorted_corners(int64_t corner[UZ_MOST_CORNERS], const uz_mesh *mesh, uz_face item)
{
    sort_nodes(corner, list_corners(corner, mesh, item));
}

static int64_t lowest_corner(const uz_mesh *mesh, uz_face item)
{
    int64_t corner[UZ_MOST_CORNERS];
    const int count = list_corners(corner, mesh, item);
    int64_t lowest = corner[0];
    for (int i = 1; i < count; i++)
        lowest = corner[i] < lowest ? corner[i] : lowest;
    return lowest;
}

static int compare_corners(const int64_t *a, const int64_t *b)
{
    for (int i = 0; i < UZ_MOST_CORNERS - 1; i++)
        if (a[i] != b[i])
            return a[i] < b[i] ? -1 : 1;
    return 0;
}

static int compare_entries(const void *a, const void *b)
{
    const sort_entry *x = a, *y = b;
    const int order = compare_corners(x->corner, y->corner);
    return order ? order : (x->item > y->item) - (x->item < y->item);
}

/* Calls for every item: counts it into start[lowest + 1], or, if `place`, puts it where start[lowest] says. */
static void walk_items(uz_corner_table *table, const uz_mesh *mesh, bool sides, bool place)
{
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const int last = sides ? uz_element_type_of((uz_element_kind)mesh->kind[e])->sides - 1 : -1;
        for (int s = sides ? 0 : -1; s <= last; s++) {
            const int64_t lowest = lowest_corner(mesh, (uz_face){e, s});
            if (place)
                table->item[table->start[lowest]++] = UZ_CORNER_TABLE_SIDES * e + s + 1;
            else
                table->start[lowest + 1]++;
        }
    }
}

/* Buckets as the threads that share them see them. */
typedef struct {
    uz_corner_table *table;
    const uz_mesh *mesh;
    int64_t largest; /* items of a bucket */
    atomic_bool no_memory;
} sorting;

/* Those of some nodes, by their items' corners. */
static void sort_buckets(void *ctx, int64_t begin, int64_t end)
{
    enum { FEW = 16 }; /* in a bucket, but in meshes made to be hard: a node is the lowest of a few sides */
    sorting *x = ctx;
    const uz_corner_table *table = x->table;
    int64_t corner[UZ_MOST_CORNERS];
    sort_entry *entry = uz_alloc(x->largest, sizeof *entry);
    if (!entry)
        x->no_memory = true;
    for (int64_t node = begin; entry && node < end; node++) {
        const int64_t first = table->start[node], count = table->start[node + 1] - first;
        int64_t *item = table->item + first;
        unsigned char *same = table->same + first;
        for (int64_t i = 0; i < count; i++) {
            sort_entry added = {.item = item[i]};
            int64_t j = i;
            sorted_corners(corner, x->mesh, uz_corner_table_item(table, first + i));
            memcpy(added.corner, corner + 1, sizeof added.corner);
            for (; count <= FEW && j > 0 && compare_entries(&entry[j - 1], &added) > 0; j--)
                entry[j] = entry[j - 1];
            entry[j] = added;
        }
        if (count > FEW)
            qsort(entry, (size_t)count, sizeof *entry, compare_entries);
        for (int64_t i = 0; i < count; i++) {
            item[i] = entry[i].item;
            same[i] = i > 0 && compare_corners(entry[i].corner, entry[i - 1].corner) == 0;
        }
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
    sorting x = {.table = out, .mesh = mesh, .no_memory = !out->start || !out->item || !out->same};
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

int64_t uz_corner_table_find(const uz_corner_table *table, const uz_mesh *mesh, int64_t *corner, int count)
{
    int64_t wanted[UZ_MOST_CORNERS], there[UZ_MOST_CORNERS];
    sort_nodes(corner, count);
    for (int i = 0; i < UZ_MOST_CORNERS; i++)
        wanted[i] = i < count ? corner[i] : -1;
    int64_t low = table->start[corner[0]], high = table->start[corner[0] + 1], end = high;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        sorted_corners(there, mesh, uz_corner_table_item(table, middle));
        if (compare_corners(there + 1, wanted + 1) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == end)
        return -1;
    sorted_corners(there, mesh, uz_corner_table_item(table, low));
    return compare_corners(there + 1, wanted + 1) == 0 ? low : -1;
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
