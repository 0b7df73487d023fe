/* corner_table.h: which elements, or sides of elements, have the same corners.
 *
 * Items are put into buckets by their lowest corner, and sorted within a bucket by the others: n log n whatever the
 * mesh, where a hash table has a worst case that a mesh can be made for. */
#ifndef UZ_SCENE_CORNER_TABLE_H
#define UZ_SCENE_CORNER_TABLE_H

#include "scene/mesh.h"

enum { UZ_MOST_CORNERS = UZ_ELEMENT_CORNERS };

typedef struct {
    int64_t *start;      /* n_nodes + 1: the bucket of node i is item[start[i]..start[i + 1]) */
    int64_t *item;       /* sides, or whole elements, as uz_corner_table_item reads them; equal ones by element */
    unsigned char *same; /* count + 1: has the item before it the same corners? The last is 0 */
    int64_t count;
} uz_corner_table;

/* Elements have six sides at most: one number says all. */
enum { UZ_CORNER_TABLE_SIDES = 8 };

/* A side; or a whole element, whose `side` is -1. */
static inline uz_face uz_corner_table_item(const uz_corner_table *table, int64_t i)
{
    const int64_t item = table->item[i];
    return (uz_face){item / UZ_CORNER_TABLE_SIDES, (int)(item % UZ_CORNER_TABLE_SIDES) - 1};
}

uz_status uz_corner_table_build(uz_corner_table *out, const uz_mesh *mesh, bool sides, uz_error *err);
void uz_corner_table_clear(uz_corner_table *table);

/* Place of the first item with these corners, in any order; -1 if there is none. Nodes must be in range. */
int64_t uz_corner_table_find(const uz_corner_table *table, const uz_mesh *mesh, const int64_t *corner, int count);

/* The sides that belong to one element only, whatever groups are called: out->face, n_faces, in the order of such a
 * table. The caller frees out->face. Error: UZ_ERR_MEMORY. */
uz_status uz_outer_sides(uz_group *out, const uz_mesh *mesh, uz_error *err);

#endif
