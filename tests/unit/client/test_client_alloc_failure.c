/* Every allocation of the client's own while it makes requests fails once: what comes out then is the same requests or
 * a clear end, and not one block is left behind. (jansson's are not among them: the client ends when one fails.) */
#include "failing_heap.h"
#include "harness.h"

#include "request/build.h"

#include <unistd.h>

static client_bodies whole; /* as they come out when nothing fails */

static bool same(const client_bodies *a, const client_bodies *b)
{
    if (a->count != b->count)
        return false;
    for (size_t i = 0; i < a->count; i++)
        if (a->item[i].body.len != b->item[i].body.len ||
            memcmp(a->item[i].body.data, b->item[i].body.data, a->item[i].body.len) != 0 ||
            strcmp(a->item[i].label, b->item[i].label) != 0)
            return false;
    return true;
}

static void options_of(client_options *o, int jobs)
{
    *o = (client_options){.command = CLIENT_SUBMIT, .operand = "tests/data/paper_body.json", .json = true};
    o->tags.item[o->tags.count++] = "first";
    if (!jobs)
        return;
    o->set.item[o->set.count++] = "solver.accuracy=quick";
    o->vary.item[o->vary.count++] = "materials.0.young=1,2";
    o->vary.item[o->vary.count++] = "loads.1.traction=[0.1,0],[0.2,0]";
}

static void fail_each(int jobs)
{
    client_options options;
    FILE *nowhere = fopen("/dev/null", "w");
    client_session s = {.options = &options, .out = nowhere, .err = nowhere};
    options_of(&options, jobs);
    CHECK_INT(client_build(&s, &whole), CLIENT_OK);
    CHECK_INT(whole.count, jobs ? 2 : 1);
    bool done = false;
    long n = 0;
    for (; !done && n < 10000; n++) {
        client_bodies bodies;
        heap_watch(n);
        client_exit code = client_build(&s, &bodies);
        done = !heap.failed;
        CHECK_MSG(code == CLIENT_OK ? same(&bodies, &whole) : code == CLIENT_LOCAL, "allocation %ld: exit %d", n, code);
        client_bodies_clear(&bodies);
        heap.watching = false;
        CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    }
    CHECK_MSG(n > 3 && n < 10000, "%ld allocations", n);
    client_bodies_clear(&whole);
    fclose(nowhere);
}

TEST(requests_of_one_job)
{
    fail_each(0);
}

TEST(requests_that_vary)
{
    fail_each(1);
}
