/* vtu.h: arrays in a VTK XML file of an unstructured grid.
 *
 * Each array stands where it belongs as base64 of zlib blocks: first the numbers of blocks and their sizes, then the
 * blocks, as vtkZLibDataCompressor writes them (Kitware, "VTK XML Formats"; VTK User's Guide, 11th ed., 19.3). */
#ifndef UZ_FIELDS_VTU_H
#define UZ_FIELDS_VTU_H

#include "text/buffer.h"
#include "scene/mesh.h"
#include "uzawa.h"

typedef enum { UZ_VTU_DOUBLE, UZ_VTU_INT64, UZ_VTU_BYTE } uz_vtu_type;

/* The file's head, points and cells. */
void uz_vtu_begin(uz_buffer *vtu, const uz_mesh *mesh);
/* An array of a section, which stands between <PointData> or <CellData> and its end: `count` items of `components`
 * numbers each. labels (may be NULL): names of the components. */
void uz_vtu_array(uz_buffer *vtu, const char *name, uz_vtu_type type, const void *data, int64_t count, int components,
                  const char *const *labels);
/* Ends the file: uz_buffer_finish. */
uz_status uz_vtu_finish(char **text, size_t *len, uz_buffer *vtu, uz_error *err);

#endif
