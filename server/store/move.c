/* move.c: the order of a move, and the comparison at its end. */
#include "store/move.h"
#include "core/alloc.h"
#include "store/engine_base.h"

#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PAGE 500

void moved_job_clear(moved_job *m)
{
    job_clear(&m->job);
    uz_free_all(m->key, m->share, m->contents, m->uploads, m->url, m->blobs);
    memset(m, 0, sizeof *m);
}

typedef struct {
    store *from, *to;
    move_report *report;
    char *message;
    size_t size;
} move;

/* Also where the store that failed has said nothing. */
static bool fail(const move *m, store *s, const char *what, const char *id)
{
    char cause[256] = "";
    store_message(s, cause, sizeof cause);
    snprintf(m->message, m->size, "cannot %s %.64s: %s", what, id, cause[0] ? cause : "no cause is known");
    return false;
}

/* ---- uploads */

static bool send_bytes(const move *m, const moved_upload *u)
{
    char piece[65536], client[STORE_CLIENT];
    upload_status status;
    upload_info info;
    int fd = -1;
    int64_t bytes;
    bool known;
    snprintf(client, sizeof client, "%.*s", (int)strcspn(u->clients, "\n"), u->clients);
    if (store_upload_open(m->from, u->info.id, &fd, &bytes) != STORE_OK)
        return fail(m, m->from, "read the upload", u->info.id);
    upload_writer *w = store_upload_begin(m->to, client, false, &status);
    ssize_t n = 0;
    off_t at = 0;
    while (w && status == UPLOAD_OK && (n = pread(fd, piece, sizeof piece, at)) > 0) {
        status = store_upload_write(w, piece, (size_t)n);
        at += n;
    }
    close(fd);
    if (w && status == UPLOAD_OK && n == 0)
        status = store_upload_end(w, &info, &known);
    else
        store_upload_abort(w);
    if (status != UPLOAD_OK || n != 0 || strcmp(info.id, u->info.id) != 0)
        return fail(m, m->to, "write the upload", u->info.id);
    return true;
}

static bool same_upload(const moved_upload *a, const moved_upload *b)
{
    return a->info.bytes == b->info.bytes && a->info.created == b->info.created && strstr(b->clients, a->clients);
}

/* Moves them (compare: NULL), or compares them. */
static bool each_upload(const move *m, bool compare)
{
    char from[80] = "";
    for (;;) {
        moved_upload u = {.clients = NULL}, there = {.clients = NULL};
        const store_status status = m->from->engine->moves->read_upload(m->from, from, &u);
        if (status == STORE_NOT_FOUND)
            return true;
        if (status != STORE_OK)
            return fail(m, m->from, "read the uploads after", from);
        store_status found = m->to->engine->moves->read_upload(m->to, u.info.id, &there);
        const bool known = found == STORE_OK && strcmp(there.info.id, u.info.id) == 0;
        bool good = found == STORE_OK || found == STORE_NOT_FOUND || fail(m, m->to, "look for the upload", u.info.id);
        if (good && compare) {
            int fd = -1;
            int64_t bytes;
            good = known && same_upload(&u, &there) && store_upload_open(m->to, u.info.id, &fd, &bytes) == STORE_OK;
            if (fd >= 0)
                close(fd);
            if (!good)
                snprintf(m->message, m->size, "the upload %.64s is not there as it was", u.info.id);
        } else if (good) {
            good = (known || send_bytes(m, &u)) && (m->to->engine->moves->put_upload(m->to, &u) == STORE_OK ||
                                                    fail(m, m->to, "write the upload", u.info.id));
            m->report->uploads++;
            m->report->uploads_new += !known;
            m->report->bytes += u.info.bytes;
        }
        snprintf(from, sizeof from, "%s~", u.info.id);
        free(u.clients);
        free(there.clients);
        if (!good)
            return false;
    }
}

/* ---- jobs */

static bool same_text(const char *a, const char *b)
{
    return a && b ? strcmp(a, b) == 0 : a == b;
}

/* What no daemon changes any more; of one that has not ended what it was submitted with. */
static bool same_job(const moved_job *a, const moved_job *b)
{
    const bool ended = a->job.status > JOB_RUNNING;
    bool same = a->job.created == b->job.created && same_text(a->job.tags, b->job.tags) && same_text(a->key, b->key) &&
                a->job.priority == b->job.priority && strcmp(a->job.refines, b->job.refines) == 0 &&
                strcmp(a->job.client, b->job.client) == 0 && same_text(a->share, b->share) &&
                same_text(a->uploads, b->uploads) && same_text(a->url, b->url);
    if (ended)
        same = same && a->job.status == b->job.status && a->job.progress == b->job.progress &&
               a->job.attempts == b->job.attempts && a->job.started == b->job.started && a->finished == b->finished &&
               same_text(a->job.summary, b->job.summary) && same_text(a->job.error, b->job.error) && !b->job.damaged &&
               same_text(a->contents, b->contents) && a->bytes == b->bytes && a->n_blobs == b->n_blobs;
    for (size_t i = 0; same && ended && i < a->n_blobs; i++)
        same = a->blobs[i].number == b->blobs[i].number && strcmp(a->blobs[i].name, b->blobs[i].name) == 0;
    return same;
}

typedef struct {
    gnutls_hash_hd_t hash;
    bool good;
} digesting;

static bool add_piece(void *ctx, const result_piece *piece)
{
    digesting *d = ctx;
    const int64_t numbers[] = {piece->part, piece->encoding, piece->header, piece->size};
    d->good = d->good && piece->good && gnutls_hash(d->hash, numbers, sizeof numbers) == 0 &&
              (piece->size == 0 || gnutls_hash(d->hash, piece->data, (size_t)piece->size) == 0);
    return d->good;
}

static bool digest_blob(store *s, const char *id, const moved_blob *blob, unsigned char digest[32])
{
    digesting d = {.good = true};
    const result_key key = {id, blob->number, blob->name[0] ? blob->name : NULL};
    if (gnutls_hash_init(&d.hash, GNUTLS_DIG_SHA256) != 0)
        return false;
    const store_status status = s->engine->results->get(s, &key, -1, add_piece, &d);
    gnutls_hash_deinit(d.hash, digest);
    return status == STORE_OK && d.good;
}

static bool same_cases(const move *m, const char *id)
{
    store_case *a = NULL, *b = NULL;
    size_t n_a = 0, n_b = 0;
    bool same = store_get_cases(m->from, id, NULL, &a, &n_a) == STORE_OK &&
                store_get_cases(m->to, id, NULL, &b, &n_b) == STORE_OK && n_a == n_b;
    for (size_t i = 0; same && i < n_a; i++)
        same = a[i].number == b[i].number && same_text(a[i].name, b[i].name) && same_text(a[i].summary, b[i].summary);
    store_cases_free(a, n_a);
    store_cases_free(b, n_b);
    return same;
}

static bool same_request(const move *m, const char *id)
{
    char *a = NULL, *b = NULL;
    size_t len_a = 0, len_b = 0;
    const bool same = store_get_body(m->from, id, &a, &len_a) == STORE_OK &&
                      store_get_body(m->to, id, &b, &len_b) == STORE_OK && len_a == len_b && memcmp(a, b, len_a) == 0;
    free(a);
    free(b);
    return same;
}

static bool compare_job(const move *m, const moved_job *j)
{
    moved_job there = {.key = NULL};
    const char *id = j->job.id;
    unsigned char a[32], b[32];
    bool same = m->to->engine->moves->read_job(m->to, id, &there) == STORE_OK && same_job(j, &there) &&
                same_request(m, id) && (j->job.status < JOB_SUCCESSFUL || same_cases(m, id));
    for (size_t i = 0; same && i < j->n_blobs && j->job.status > JOB_RUNNING; i++)
        same = digest_blob(m->from, id, &j->blobs[i], a) && digest_blob(m->to, id, &j->blobs[i], b) &&
               memcmp(a, b, sizeof a) == 0;
    moved_job_clear(&there);
    if (!same)
        snprintf(m->message, m->size, "job %.32s is not there as it was", id);
    return same;
}

static bool one_job(const move *m, const char *id, bool compare)
{
    moved_job j = {.key = NULL};
    bool good = m->from->engine->moves->read_job(m->from, id, &j) == STORE_OK || fail(m, m->from, "read job", id);
    if (good && compare) {
        good = compare_job(m, &j);
    } else if (good) {
        const store_status status = m->to->engine->moves->put_job(m->to, m->from, &j);
        m->report->jobs++;
        m->report->jobs_new += status == STORE_OK;
        m->report->bytes += j.bytes;
        good = status == STORE_OK || status == STORE_CONFLICT || fail(m, m->to, "write job", id);
    }
    moved_job_clear(&j);
    return good;
}

static bool each_job(const move *m, bool compare)
{
    char last[33] = "";
    for (bool more = true; more;) {
        const store_query query = {.ascending = true, .before = last[0] ? last : NULL, .limit = PAGE};
        job *jobs = NULL;
        size_t count = 0;
        bool good =
            store_list(m->from, &query, &jobs, &count, &more) == STORE_OK || fail(m, m->from, "list jobs after", last);
        for (size_t i = 0; i < count; i++) {
            good = good && one_job(m, jobs[i].id, compare);
            memcpy(last, jobs[i].id, sizeof last);
            job_clear(&jobs[i]);
        }
        free(jobs);
        if (!good)
            return false;
    }
    return true;
}

static bool each_client(const move *m)
{
    char from[STORE_CLIENT + 2] = "";
    moved_client c;
    store_status status;
    while ((status = m->from->engine->moves->read_client(m->from, from, &c)) == STORE_OK) {
        if (m->to->engine->moves->put_client(m->to, &c) != STORE_OK)
            return fail(m, m->to, "write what is counted of owner", c.name);
        snprintf(from, sizeof from, "%s\x01", c.name);
    }
    return status == STORE_NOT_FOUND || fail(m, m->from, "read what is counted of owners after", from);
}

/* ---- all of it */

static bool check_whole(const move *m, store *s, const char *which)
{
    store_findings found = {.findings = NULL};
    bool good = store_check(s, &found) == STORE_OK || fail(m, s, "check", which);
    if (good && found.findings[0]) {
        snprintf(m->message, m->size, "%s is damaged: %.300s", which, found.findings);
        good = false;
    }
    free(found.findings);
    return good;
}

bool store_move(store *from, store *to, move_report *out, char *message, size_t size)
{
    const move m = {from, to, out, message, size};
    *out = (move_report){.jobs = 0};
    if (!to->engine->moves || !to->engine->moves->put_job || !from->engine->moves || from->engine == to->engine) {
        snprintf(message, size,
                 "a file is moved into a database of PostgreSQL: --move FILE postgresql://USER@HOST/NAME");
        return false;
    }
    return check_whole(&m, from, "what is to be moved") && each_upload(&m, false) && each_job(&m, false) &&
           each_client(&m) && each_upload(&m, true) && each_job(&m, true) &&
           check_whole(&m, to, "the database that was moved into");
}
