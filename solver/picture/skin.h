/* skin.h: what is seen of a body: the elements of a plane, the outer faces of a solid, and the edges of both. */
#ifndef UZ_PICTURE_SKIN_H
#define UZ_PICTURE_SKIN_H

#include "scene/mesh.h"

/* The points around cell i are point[first[i]..first[i + 1]): mesh nodes, counter-clockwise in the plane or as seen
 * from outside. 3 or 4 of them are corners; of 6 or 8 every second one is the middle of an edge, the first is a corner.
 */
typedef struct {
    int64_t n_cells;
    int64_t *first; /* n_cells + 1 */
    int64_t *point;
} uz_skin;

enum { UZ_CELL_POINTS = UZ_FACE_NODES };

/* UZ_ERR_MEMORY, _CANCELLED; cleared then. */
uz_status uz_skin_build(uz_skin *out, const uz_mesh *mesh, const uz_hooks *hooks, uz_error *err);
void uz_skin_clear(uz_skin *skin);

/* Triangles of a cell with this many points, as places among them, three each: its nodes alone are corners of them.
 * Returns how many. */
int uz_cell_triangles(const int (**triangle)[3], int points);

/* Edges of the cells as straight pieces between two nodes, each once: `line`, 2 x n_lines. `outline`, 2 x n_outline:
 * those at the border of a plane; of a solid those where its faces meet at more than 37 degrees, or more than two of
 * them do. */
typedef struct {
    int64_t n_lines, n_outline;
    int64_t *line, *outline;
} uz_skin_edges;

uz_status uz_skin_edges_build(uz_skin_edges *out, const uz_skin *skin, const uz_mesh *mesh, uz_error *err);
void uz_skin_edges_clear(uz_skin_edges *edges);

/* What there may be no memory for. */
#define UZ_OF_SKIN "the surface of a body"

#endif
