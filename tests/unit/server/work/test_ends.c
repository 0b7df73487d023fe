/* The last jobs that ended here. */
#include "harness.h"
#include "work/ends.h"

#include <stdlib.h>
#include <string.h>

static job claimed(int i)
{
    static char tags[] = "[\"a\"]";
    job j = {.status = JOB_RUNNING, .attempts = 1, .created = 1.0, .started = 2.0, .tags = tags};
    snprintf(j.id, sizeof j.id, "%032d", i);
    return j;
}

TEST(an_end_is_found_for_a_while)
{
    enum { MANY = 100 };
    const store_outcome success = {.status = JOB_SUCCESSFUL, .whole.summary = "{\"outcome\": \"converged\"}"};
    ends *e = ends_new();
    job j, found;
    CHECK(e);
    for (int i = 0; e && i < MANY; i++) {
        j = claimed(i);
        CHECK(!ends_find(e, j.id, &found));
        ends_keep(e, &j, &success, 3.0 + i);
        CHECK(ends_find(e, j.id, &found));
        CHECK(found.status == JOB_SUCCESSFUL && found.progress == 100 && found.attempts == 1 && found.started == 2.0 &&
              found.finished == 3.0 + i && !found.error);
        CHECK_STR(found.summary, success.whole.summary);
        CHECK_STR(found.tags, "[\"a\"]");
        job_clear(&found);
    }
    j = claimed(0);
    CHECK(!ends_find(e, j.id, &found) && !found.id[0] && !found.tags);
    ends_free(e);
    ends_free(NULL);
}

TEST(what_is_no_success_or_not_on_disk_is_not_kept)
{
    char *large = calloc(1, 100001);
    store_outcome o = {.status = JOB_FAILED, .error = "{}", .whole.summary = "{}"};
    ends *e = ends_new();
    job j = claimed(1), found;
    CHECK(e && large);
    memset(large, 'x', 100000);
    ends_keep(e, &j, &o, 3.0);
    o.status = JOB_SUCCESSFUL;
    ends_keep(e, &j, &o, 0.0); /* the store has not said when */
    o.whole.summary = NULL;
    ends_keep(e, &j, &o, 3.0);
    o.whole.summary = large;
    ends_keep(e, &j, &o, 3.0);
    CHECK(!ends_find(e, j.id, &found));
    ends_free(e);
    free(large);
}
