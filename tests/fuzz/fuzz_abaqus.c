/* Any bytes as an input file of Abaqus or CalculiX. What is accepted must be in range, and either be a mesh that can be
 * computed with or be refused with a reason; what is refused must say where. */
#include "mesh_demands.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    demand_of_reader(uz_abaqus_read, data, size);
    return 0;
}
