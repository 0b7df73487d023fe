/* What a process that solves may see of the store. */
#include "store_place.h"
#include "work/relay.h"

#include <unistd.h>

#define ID    "0123456789abcdef0123456789abcdef"
#define OTHER "fedcba9876543210fedcba9876543210"

TEST(the_job_that_a_request_starts_from)
{
    static const struct {
        const char *text, *start;
    } cases[] = {
        {"{\"solver\": {\"warm_start\": {\"job\": \"" ID "\"}}}", ID},
        {"{\"job\":\"" ID "\"}", ID},
        {"{\"job\" \n\t: \r\n \"" ID "\" , \"case\": \"a\"}", ID},
        {"{\"tags\": [\"job\", \"" OTHER "\"], \"job\": \"" ID "\"}", ID},
        {"{\"tags\": [\"" OTHER "\"]}", ""},
        {"{\"jobs\": \"" OTHER "\"}", ""},
        {"{\"job\": \"" OTHER "0\"}", ""},
        {"{\"job\": \"fedcba9876543210FEDCBA9876543210\"}", ""},
        {"{\"job\": [\"" OTHER "\"]}", ""},
        {"{\"job\": \"fedcba98", ""},
        {"\"job\"", ""},
        {"", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const size_t len = strlen(cases[i].text);
        for (size_t cut = 0; cut <= len; cut++) { /* each of them in memory that ends there */
            char start[33], *text = malloc(cut ? cut : 1);
            memcpy(text, cases[i].text, cut);
            relay_find_start(start, text, cut);
            CHECK_MSG(!start[0] || strcmp(start, cases[i].start) == 0, "%s: %s", cases[i].text, start);
            CHECK(cut < len || strcmp(start, cases[i].start) == 0);
            free(text);
        }
    }
}

/* A process may have parts of the job that its own starts from, by whatever it asks, and of no other. */
TEST(parts_of_other_jobs_are_not_given)
{
    static const double reactions[] = {1, 2, 3};
    const store_vector vector = {.name = "reactions", .count = 3, .data = reactions};
    const store_outcome outcome = {
        .status = JOB_SUCCESSFUL,
        .whole = {.summary = "{}", .vectors = &vector, .n_vectors = 1, .name = ""},
    };
    place p;
    segment inbox = {.fd = -1};
    char id[33];
    CHECK(place_begin(&p) && segment_make(&inbox, 0));
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "test", id), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "test", &outcome), STORE_OK);
    for (int whose = 0; whose < 3; whose++) {
        relay_rights rights = {.job = OTHER};
        if (whose < 2)
            snprintf(rights.start, sizeof rights.start, "%s", whose == 0 ? id : OTHER);
        for (int what = 0; what < 2; what++) {
            packet ask = {.kind = MESSAGE_ASK, .u.ask = {.what = what == 0 ? ASK_BLOB : ASK_CASE}}, answer;
            int fd;
            snprintf(ask.u.ask.id, sizeof ask.u.ask.id, "%s", id);
            ask.u.ask.named = what == 0;
            snprintf(ask.u.ask.name, sizeof ask.u.ask.name, "reactions");
            relay_answer(&answer, &fd, p.s, &rights, &ask, &inbox, 0);
            CHECK_INT(fd, -1);
            CHECK_INT(answer.status, whose == 0 ? STORE_OK : STORE_NOT_FOUND);
            CHECK((answer.u.answer.size > 0) == (whose == 0 && what == 0));
        }
    }
    segment_close(&inbox);
    place_end(&p);
}

/* Without a job it may have the uploads that it was told, and nothing else. */
TEST(uploads_of_a_request_that_is_no_job)
{
    char known[2][65], folder[128];
    place p;
    segment inbox = {.fd = -1};
    CHECK(place_begin(&p) && segment_make(&inbox, 0));
    for (int i = 0; i < 2; i++) {
        upload_status status;
        upload_info info = {.bytes = 0};
        bool before;
        upload_writer *w = store_upload_begin(p.s, NULL, false, &status);
        CHECK(w && store_upload_write(w, &i, sizeof i) == UPLOAD_OK &&
              store_upload_end(w, &info, &before) == UPLOAD_OK);
        memcpy(known[i], info.id, sizeof known[i]);
    }
    for (size_t n = 0; n < 3; n++)
        for (int i = 0; i < 2; i++) {
            const relay_rights rights = {.uploads = (const char(*)[65])known, .n_uploads = n};
            packet ask = {.kind = MESSAGE_ASK, .u.ask = {.what = ASK_UPLOAD}}, answer;
            int fd;
            memcpy(ask.u.ask.id, known[i], sizeof ask.u.ask.id);
            relay_answer(&answer, &fd, p.s, &rights, &ask, &inbox, 0);
            CHECK_INT(answer.status, (size_t)i < n ? STORE_OK : STORE_NOT_FOUND);
            CHECK((fd >= 0) == ((size_t)i < n));
            if (fd >= 0)
                close(fd);
        }
    segment_close(&inbox);
    for (int i = 0; i < 2; i++)
        CHECK_INT(store_upload_delete(p.s, known[i], NULL), STORE_OK);
    snprintf(folder, sizeof folder, "%s-uploads", p.path);
    CHECK_INT(rmdir(folder), 0);
    place_end(&p);
}
