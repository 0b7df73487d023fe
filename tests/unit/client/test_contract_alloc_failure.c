/* Every allocation of the checks, the comparison and the report fails once: then they say that they are not whole, and
 * not one block is left behind. */
#include "failing_heap.h"
#include "harness.h"

#include "commands/contract.h"
#include "show/junit.h"

#define ANSWER                                                                                                         \
    "{\"summary\": {\"outcome\": \"converged\", \"energy\": {\"primal\": -1}, \"contact\": {\"reaction_sum\": -2}, "   \
    "\"certificate\": {\"gap\": 0}}, \"displacements\": [[0, 1], [0, 2]], \"nodes\": [[0, 0], [1, 0]], "               \
    "\"contact_nodes\": [1], \"reactions\": [-2]}"
#define LINE "{\"quantity\": \"contact.active\", \"min\": 1, \"value\": 2, \"error\": null, \"result\": \"pass\"}"
#define JOB                                                                                                            \
    "{\"id\": \"1\", \"created\": \"2026-01-31T12:00:00Z\", \"status\": \"successful\", \"summary\": {\"outcome\": "   \
    "\"converged\", \"assertions\": [" LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE      \
    ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE ", " LINE "]}}"

enum { CHECKS = 1 + 16 + 4 };

/* True: the suite has all checks. */
static bool try_all(const json_t *job, const json_t *answer)
{
    client_checks checks = {.item = NULL};
    client_suites suites = {.item = NULL};
    client_checks_outcome(&checks, job);
    client_checks_assertions(&checks, json_object_get(job, "summary"), "");
    client_baseline_results(&checks, "", answer, answer, 1e-3);
    const bool whole = !checks.failed, added = client_suites_add(&suites, "a", job, &checks);
    CHECK(whole ? true : !added);
    CHECK(!added || (suites.count == 1 && suites.item[0].checks.count == CHECKS && checks.count == 0));
    client_checks_clear(&checks);
    client_suites_clear(&suites);
    return added;
}

TEST(checks_and_reports)
{
    json_t *job = json_loads(JOB, 0, NULL), *answer = json_loads(ANSWER, 0, NULL);
    CHECK(job && answer && try_all(job, answer));
    bool done = false;
    long n = 0;
    for (; !done && n < 1000; n++) {
        heap_watch(n);
        const bool added = try_all(job, answer);
        done = !heap.failed;
        heap.watching = false;
        CHECK_MSG(added == done, "allocation %ld fails without a word", n);
        CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    }
    CHECK_MSG(n > 4 && n < 1000, "%ld allocations", n);
    json_decref(job);
    json_decref(answer);
}
