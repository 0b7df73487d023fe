/* Any bytes as a VTK file. What is accepted must be in range, and either be a mesh that can be computed with or be
 * refused with a reason; what is refused must say where. */
#include "io/mesh_reader.h"
#include "mesh_demands.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    demand_of_reader(uz_vtk_read, data, size);
    return 0;
}
