/* Any bytes as an input file of Abaqus or CalculiX. What is accepted must be in range, and either be a mesh that can be
 * computed with or be refused with a reason; what is refused must say where. */
#include "mesh_demands.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uz_deck deck;
    uz_error err = {0};
    demand_of_reader(uz_abaqus_read, data, size);
    const uz_status status = uz_deck_read(&deck, (const char *)data, size, MEMORY, size % 2 == 0, &err);
    demand(status == UZ_OK || err.message[0]);
    for (int64_t i = 0; status == UZ_OK && i < deck.scene.given.n_groups; i++)
        demand_group(&deck.scene.given, &deck.scene.given.groups[i]);
    uz_deck_clear(&deck);
    return 0;
}
