/* cells.h: a mesh while a file that lists cells is read: nodes in space, cells of any dimension, and named sets of
 * either; and what of it is the body, what its sides and its groups. Shared by readers of formats (mesh_reader.h). */
#ifndef UZ_IO_CELLS_H
#define UZ_IO_CELLS_H

#include "element/element_type.h"
#include "uzawa.h"

/* Shapes of cells: those of elements (uz_element_kind), and these. */
enum { CELLS_POINT = UZ_ELEMENT_KINDS, CELLS_LINE2, CELLS_LINE3, CELLS_SHAPES };
int cells_nodes(int shape);

typedef struct {
    char name[64];
    bool nodes; /* of nodes; else of cells */
    int64_t line, count, room, *index;
} cells_set;

typedef struct {
    size_t max_bytes; /* 0: no bound */
    uz_error *err;
    int64_t n_nodes, xyz_room;
    double *xyz; /* n_nodes x 3 */
    int64_t n_cells, shape_room, line_room, first_room, node_room;
    unsigned char *shape;
    int64_t *line;         /* of the file, for refusals */
    int64_t *first, *node; /* nodes of cell i in VTK's order: node[first[i]..first[i + 1]) */
    int64_t n_sets, sets_room, n_members;
    cells_set *sets;
} cells;

/* All return UZ_ERR_MEMORY, or _LIMIT with the line where the mesh becomes too large. */
uz_status cells_add_node(cells *mesh, const double x[3], int64_t line);
/* Nodes as the caller numbers them; uz_status cells_to_given wants indices. */
uz_status cells_add(cells *mesh, int shape, const int64_t *node, int64_t line);
/* An empty set; *set: its index. */
uz_status cells_add_set(int64_t *set, cells *mesh, const char *name, bool nodes, int64_t line);
uz_status cells_add_member(cells *mesh, int64_t set, int64_t index, int64_t line);
/* Sets NAME_VALUE of the cells (or nodes) that have a value each; CELLS_NO_VALUE: in none. Where there are more than
 * `most` values (0: no bound) they are numbers of cells rather than parts, and no sets are made. */
#define CELLS_NO_VALUE INT64_MIN
uz_status cells_add_values(cells *mesh, const char *name, const int64_t *value, bool nodes, int64_t most, int64_t line);

/* The cells of the highest dimension are the body; of sets those are elements, cells of one dimension less are sides,
 * of others their nodes are taken. What is named alike in two ways is NAME (elements before sides before nodes), then
 * NAME.sides, NAME.nodes. Surfaces in space are refused with `advice`. *out is empty on failure;
 * coordinates in space are moved to it. */
uz_status cells_to_given(uz_given_mesh *out, cells *mesh, const char *from_file, const char *advice);
void cells_clear(cells *mesh);

#endif
