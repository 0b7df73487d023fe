/* mesh_reader.h: the file formats that a mesh is read from, one row each of the table in mesh_reader.c. To add one:
 * docs/architecture/mesh-reader.md. */
#ifndef UZ_IO_MESH_READER_H
#define UZ_IO_MESH_READER_H

#include "uzawa.h"

typedef struct {
    const char *name; /* as uz_mesh_read is asked for it: "gmsh" */
    /* Reads a whole file. `text` may be anything, and counts in it are not to be trusted; max_bytes bounds what the
     * mesh may take (0: no bound). *out is for uz_given_mesh_clear, and empty on failure: elements have VTK's order of
     * nodes (the descriptors of element/element_type.h have that of the format), nodes and elements are numbered from 0
     * in the order of the file, named parts are groups, and from_file is "/mesh/NAME". Errors: UZ_ERR_FORMAT,
     * _UNSUPPORTED, _NOT_FINITE and _LIMIT with the line, _MEMORY. */
    uz_status (*read)(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);
} uz_mesh_reader;

/* Rows of the table. */
uz_status uz_vtk_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);
uz_status uz_nastran_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err);

#endif
