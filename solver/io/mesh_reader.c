#include "io/mesh_reader.h"

#include "core/error.h"

#include <string.h>

static const uz_mesh_reader READERS[] = {
    {"gmsh", uz_gmsh_read},
    {"abaqus", uz_abaqus_read},
    {"vtk", uz_vtk_read},
    {"nastran", uz_nastran_read},
};

uz_status uz_mesh_read(uz_given_mesh *out, const char *format, const char *text, size_t len, size_t max_bytes,
                       uz_error *err)
{
    const uz_mesh_reader *reader = NULL;
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < sizeof READERS / sizeof READERS[0] && !reader; i++)
        if (strcmp(READERS[i].name, format) == 0)
            reader = &READERS[i];
    if (reader)
        return reader->read(out, text, len, max_bytes, err);
    return uz_fail(err, UZ_ERR_UNSUPPORTED, "", "meshes of the format \"%.32s\" are not read", format);
}
