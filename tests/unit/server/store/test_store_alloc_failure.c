/* Every allocation of uploads, and of requests that name them, fails once: a clear refusal, and nothing is left. */
#include "failing_heap.h"

#include "codec/codec.h"
#include "store_place.h"
#include "store/uploads.h"

#include <dirent.h>

enum { MOST = 1000 };

#define K_TEXT "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 1\n"

static place here;
static char body[400];

/* True if it went well; checks what it got otherwise. */
typedef bool (*attempt)(void);

static void fail_each(attempt run, int fewest)
{
    int allowed = 0;
    bool done = false;
    for (; allowed < MOST && !done; allowed++) {
        heap_watch(allowed);
        bool well = run();
        heap.watching = false;
        CHECK_MSG(heap.live == 0, "%d blocks left after %d allocations", heap.live, allowed);
        CHECK_MSG(well == !heap.failed, "%d after %d allocations", well, allowed);
        done = !heap.failed;
    }
    CHECK_MSG(done && allowed > fewest, "%d allocations", allowed);
}

static int unfinished(void)
{
    char folder[128];
    int count = 0;
    struct dirent *entry;
    snprintf(folder, sizeof folder, "%s-uploads", here.path);
    DIR *dir = opendir(folder);
    while (dir && (entry = readdir(dir)))
        count += strncmp(entry->d_name, "incoming-", 9) == 0;
    if (dir)
        closedir(dir);
    return count;
}

static bool send(void)
{
    upload_status status;
    upload_info info;
    bool known;
    upload_writer *w = store_upload_begin(here.s, NULL, false, &status);
    if (!w) {
        CHECK(status != UPLOAD_OK);
        return false;
    }
    store_upload_write(w, K_TEXT, strlen(K_TEXT));
    status = store_upload_end(w, &info, &known);
    if (status == UPLOAD_OK)
        snprintf(body, sizeof body,
                 "{\"problem\": {\"kind\": \"matrices\", \"K\": {\"upload\": \"%s\"}, \"p\": [1, 2]}, \"webhook\": "
                 "{\"url\": \"http://example.org\"}}",
                 info.id);
    return status == UPLOAD_OK;
}

static bool decode(void)
{
    codec_request request;
    problem_details problem;
    bool good = codec_decode(&request, CODEC_SOLVE, body, strlen(body), here.s, &problem);
    if (good) {
        CHECK(request.n_uploads == 1 && request.webhook);
        codec_request_strip(&request);
        CHECK(request.n_uploads == 1 && request.webhook && !request.problem.qp.p);
        codec_request_clear(&request);
    } else {
        CHECK_MSG(problem.status == 503, "%d %s %s", problem.status, problem.code, problem.detail);
    }
    return good;
}

static bool encode(void)
{
    const double row[CODEC_HISTORY_COLUMNS] = {1, 2, 3};
    char *texts[] = {codec_encode_upload(&(upload_info){.id = "x"}),
                     codec_encode_progress(5, &(job_grid){.number = 2}, row),
                     codec_encode_valid(&(uz_prediction){.d = 1}), codec_encode_valid(NULL)};
    bool good = true;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        good = good && texts[i];
        free(texts[i]);
    }
    return good;
}

TEST(uploads_and_requests_that_name_them)
{
    char message[256], path[256];
    if (!place_begin(&here) || !codec_init(NULL, message, sizeof message))
        return;
    fail_each(send, 1);
    CHECK_INT(unfinished(), 0);
    fail_each(decode, 5);
    fail_each(encode, 4);
    codec_end();
    snprintf(path, sizeof path, "rm -r '%s-uploads'", here.path);
    CHECK_INT(system(path), 0);
    place_end(&here);
}
