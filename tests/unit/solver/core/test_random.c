/* Random numbers from anywhere in their row. */
#include "core/random.h"
#include "harness.h"

TEST(numbers_can_be_begun_anywhere)
{
    const uint64_t seed = 0x9E3779B97F4A7C15u;
    uint64_t state = seed;
    for (uint64_t k = 0; k < 3000; k++) {
        CHECK(uz_random_after(seed, k) == state);
        (void)uz_uniform(&state);
    }
    CHECK(uz_random_after(uz_random_after(seed, 123456789), 987654321) == uz_random_after(seed, 1111111110));
}
