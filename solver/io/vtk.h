/* vtk.h: VTK's files of unstructured grids while their mesh is read. Private to uz_vtk_read.
 *
 * Source of the formats: "VTK File Formats", of the VTK User's Guide, and what VTK 9 and meshio write. */
#ifndef UZ_IO_VTK_H
#define UZ_IO_VTK_H

#include "io/cells.h"

/* Types of numbers in files. */
typedef struct {
    const char *xml, *legacy;
    int size;
    bool whole, is_signed;
} vtk_type;
extern const vtk_type VTK_TYPES[];
extern const int VTK_TYPE_COUNT;

/* Numbers as they are used: integers where the file has integers (whole), else reals. */
typedef struct {
    bool whole;
    int64_t n, *integer;
    double *real;
} vtk_numbers;
/* Room for n numbers; UZ_ERR_MEMORY. */
uz_status vtk_numbers_make(vtk_numbers *out, int64_t n, bool whole, uz_error *err);
void vtk_numbers_clear(vtk_numbers *numbers);
/* Number i from its bytes (type->size); reversed: in the other order than this machine's. */
void vtk_numbers_put(vtk_numbers *to, int64_t i, const unsigned char *bytes, const vtk_type *type, bool reversed);
/* Number i from a word of a text. False: it is none of its kind. */
bool vtk_numbers_read(vtk_numbers *to, int64_t i, const char *word, size_t len);

/* The mesh of a grid: points (3 x n_points), the cells' types, where each ends in the connectivity, and that. line: for
 * refusals. */
typedef struct {
    vtk_numbers points, types, ends, connectivity;
    int64_t line;
} vtk_grid;
void vtk_grid_clear(vtk_grid *grid);
uz_status vtk_add_grid(cells *mesh, const vtk_grid *grid);
/* Integers of cells or points, one each, as groups NAME_VALUE. */
uz_status vtk_add_data(cells *mesh, const char *name, const vtk_numbers *data, bool nodes, int64_t line);

/* The line of a place of a text, from 1. */
int64_t vtk_line(const char *text, const char *at);

/* From a whole file to cells (vtk_xml.c, vtk_legacy.c). */
uz_status vtk_read_xml(cells *mesh, const char *text, size_t len);
uz_status vtk_read_legacy(cells *mesh, const char *text, size_t len);

#endif
