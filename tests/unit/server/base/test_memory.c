/* What a solve may take of the machine, and what the service has of it. */
#include "harness.h"
#include "base/memory.h"
#include "options/options.h"

#include <unistd.h>

TEST(share_of_a_worker)
{
    const size_t G = (size_t)1 << 30;
    CHECK_INT(memory_share(10 * G, 2 * G, 3), 2 * G);
    CHECK_INT(memory_share(10 * G, 0, 1), 8 * G);
    CHECK_INT(memory_share(G, 2 * G, 4), (size_t)64 << 20);
    CHECK_INT(memory_share(0, 0, 0), (size_t)64 << 20);
    CHECK(memory_available() > 0);
    CHECK(processors_available() >= 1 && processors_available() <= sysconf(_SC_NPROCESSORS_ONLN));
}

TEST(cache_grows_with_the_machine)
{
    const size_t G = (size_t)1 << 30;
    CHECK_INT(memory_for_cache(4 * G), G);
    CHECK_INT(memory_for_cache(24 * G), 4 * G);
}

TEST(option)
{
    server_options options;
    char message[256], *given[] = {"uzawad", "--memory", "3M", NULL}, *none[] = {"uzawad", NULL};
    char *cache[] = {"uzawad", "--cache", "5M", NULL};
    char *wrong[] = {"uzawad", "--memory", "0", NULL};
    CHECK_INT(options_read(&options, 3, given, NULL, message, sizeof message), OPTIONS_RUN);
    CHECK_INT(options.memory, 3 << 20);
    CHECK_INT(options_read(&options, 1, none, NULL, message, sizeof message), OPTIONS_RUN);
    CHECK_INT(options.cache, memory_for_cache(memory_available()));
    CHECK_INT(options.memory, memory_share(memory_available(), options.cache, options.workers));
    CHECK_INT(options_read(&options, 3, cache, NULL, message, sizeof message), OPTIONS_RUN);
    CHECK_INT(options.cache, 5 << 20);
    CHECK_INT(options_read(&options, 3, wrong, NULL, message, sizeof message), OPTIONS_WRONG);
}
