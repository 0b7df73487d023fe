/* Uploads, expiry, retention and webhooks in the store: what the API tests can't reach or would wait for. */
#include "store/sqlite/backup_uploads.h"
#include "store_place.h"
#include "store/uploads.h"

#include <dirent.h>
#include <sys/stat.h>
#include <zlib.h>

/* SHA-256 of "abc", FIPS 180-4's example (NIST, SHA256.pdf). */
#define ABC "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"

static upload_status send(store *s, const void *data, size_t len, size_t piece, bool gzip, upload_info *info,
                          bool *known)
{
    upload_status status;
    upload_writer *w = store_upload_begin(s, gzip, &status);
    CHECK(w && status == UPLOAD_OK);
    for (size_t at = 0; w && at < len; at += piece)
        store_upload_write(w, (const char *)data + at, len - at < piece ? len - at : piece);
    return w ? store_upload_end(w, info, known) : status;
}

/* Files in the folder of uploads, -1: there is no folder. */
static int files_in(const place *p)
{
    char folder[128];
    int count = 0;
    struct dirent *entry;
    snprintf(folder, sizeof folder, "%s-uploads", p->path);
    DIR *dir = opendir(folder);
    while (dir && (entry = readdir(dir)))
        count += entry->d_name[0] != '.';
    if (!dir)
        return -1;
    closedir(dir);
    return count;
}

static void end_place(place *p)
{
    char folder[128], name[256];
    struct dirent *entry;
    snprintf(folder, sizeof folder, "%s-uploads", p->path);
    DIR *dir = opendir(folder);
    while (dir && (entry = readdir(dir))) {
        snprintf(name, sizeof name, "%s/%.80s", folder, entry->d_name);
        if (entry->d_name[0] != '.')
            unlink(name);
    }
    if (dir)
        closedir(dir);
    rmdir(folder);
    place_end(p);
}

TEST(an_upload_is_named_by_its_digest)
{
    place p;
    upload_info info;
    upload_text text;
    bool known = true;
    if (!place_begin(&p))
        return;
    CHECK_INT(files_in(&p), -1); /* no folder before it is needed */
    CHECK_INT(send(p.s, "abc", 3, 1, false, &info, &known), UPLOAD_OK);
    CHECK(!known && info.bytes == 3 && info.jobs == 0 && info.created > 1e9 && info.used == info.created);
    CHECK_STR(info.id, ABC);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    CHECK(known && info.used >= info.created);
    CHECK_INT(files_in(&p), 1);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_OK);
    CHECK(text.len == 3 && memcmp(text.data, "abc", 3) == 0);
    CHECK_INT(store_upload_delete(p.s, ABC), STORE_OK);
    CHECK(memcmp(text.data, "abc", 3) == 0); /* who reads it reads on */
    store_upload_text_done(&text);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_NOT_FOUND);
    CHECK_INT(store_upload_delete(p.s, ABC), STORE_NOT_FOUND);
    CHECK_INT(files_in(&p), 0);
    end_place(&p);
}

TEST(a_backup_has_the_uploads)
{
    place p, copy;
    upload_info info;
    upload_text text;
    bool known;
    char message[300] = "", folder[256];
    struct stat st;
    if (!place_begin(&p))
        return;
    copy = p;
    snprintf(copy.path, sizeof copy.path, "%s/copy.db", p.folder);
    snprintf(folder, sizeof folder, "%s-uploads", copy.path);
    CHECK_MSG(store_backup_file(p.path, copy.path, NULL, message, sizeof message), "%s", message);
    CHECK(lstat(folder, &st) != 0 && unlink(copy.path) == 0); /* none: no folder */
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    CHECK_MSG(store_backup_file(p.path, copy.path, NULL, message, sizeof message), "%s", message);
    CHECK(!store_backup_file(p.path, copy.path, NULL, message, sizeof message) && strstr(message, "there already"));
    CHECK_INT(store_upload_delete(p.s, ABC), STORE_OK);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_NOT_FOUND);
    copy.s = NULL;
    if (place_open(&copy)) {
        CHECK_INT(files_in(&copy), 1);
        CHECK_INT(store_upload_text(copy.s, ABC, &text), STORE_OK);
        CHECK(text.len == 3 && memcmp(text.data, "abc", 3) == 0);
        store_upload_text_done(&text);
        CHECK_INT(store_upload_delete(copy.s, ABC), STORE_OK);
        store_close(copy.s);
    }
    unlink(copy.path);
    /* A file that is gone: no backup, and nothing is left of one. */
    CHECK(rmdir(folder) == 0);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    snprintf(folder, sizeof folder, "%s-uploads/" ABC, p.path);
    CHECK_INT(unlink(folder), 0);
    CHECK(!store_backup_file(p.path, copy.path, NULL, message, sizeof message) && strstr(message, ABC));
    snprintf(folder, sizeof folder, "%s-uploads", copy.path);
    CHECK(lstat(folder, &st) != 0 && lstat(copy.path, &st) != 0);
    end_place(&p);
}

/* What backup_uploads makes of a copy: 2 done, and the row is there; 1 done, without it; 0 refused. */
static int second_pass(const char *from, const char *to)
{
    sqlite3 *original = NULL, *copy = NULL;
    sqlite3_stmt *stmt = NULL;
    char message[300] = "";
    CHECK_INT(sqlite3_open(from, &original), SQLITE_OK);
    CHECK_INT(sqlite3_open(to, &copy), SQLITE_OK);
    bool ok = backup_uploads(copy, original, from, to, message, sizeof message);
    CHECK_MSG(ok || strstr(message, ABC), "%s", message);
    CHECK_INT(sqlite3_prepare_v2(copy, "SELECT 1 FROM upload", -1, &stmt, NULL), SQLITE_OK);
    bool row = sqlite3_step(stmt) == SQLITE_ROW;
    sqlite3_finalize(stmt);
    sqlite3_close(copy);
    sqlite3_close(original);
    return ok ? 1 + row : 0;
}

/* An upload that is deleted between the copy of the pages and that of its file. */
TEST(a_backup_while_an_upload_goes)
{
    for (int used = 0; used < 2; used++) {
        place p;
        upload_info info;
        job j = {0};
        job_status was;
        bool known, repeated;
        char copy[256], file[400], message[300] = "", ids[1][65] = {ABC};
        if (!place_begin(&p))
            return;
        snprintf(copy, sizeof copy, "%s/copy.db", p.folder);
        CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
        store_request request = {.body = "{}", .body_len = 2, .uploads = ids, .n_uploads = 1};
        if (used)
            CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
        CHECK_MSG(store_backup_file(p.path, copy, NULL, message, sizeof message), "%s", message);
        snprintf(file, sizeof file, "%s-uploads/" ABC, copy);
        CHECK_INT(unlink(file), 0);
        CHECK_INT(second_pass(p.path, copy), 2); /* it is linked again: the original has it */
        CHECK_INT(unlink(file), 0);
        if (used)
            CHECK(store_dismiss(p.s, j.id, &was) == STORE_OK && store_dismiss(p.s, j.id, &was) == STORE_OK);
        CHECK_INT(store_upload_delete(p.s, ABC), STORE_OK);
        CHECK_INT(second_pass(p.path, copy), !used);
        job_clear(&j);
        snprintf(file, sizeof file, "rm -r '%s'*", copy);
        CHECK_INT(system(file), 0);
        end_place(&p);
    }
}

static size_t squeeze(unsigned char *out, size_t room, const char *text, size_t len)
{
    z_stream z = {.next_in = (unsigned char *)(uintptr_t)text, .avail_in = (unsigned)len, .next_out = out};
    z.avail_out = (unsigned)room;
    CHECK_INT(deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    CHECK_INT(deflate(&z, Z_FINISH), Z_STREAM_END);
    deflateEnd(&z);
    return z.total_out;
}

TEST(gzip_in_pieces_of_any_size)
{
    enum { LEN = 200000 };
    place p;
    upload_info info, plain;
    bool known;
    if (!place_begin(&p))
        return;
    char *text = malloc(LEN);
    unsigned char *small = malloc(LEN);
    for (int i = 0; i < LEN; i++)
        text[i] = (char)('a' + i % 7 + (i / 1000) % 3);
    CHECK_INT(send(p.s, text, LEN, LEN, false, &plain, &known), UPLOAD_OK);
    size_t first = squeeze(small, LEN, text, 70000);
    size_t len = first + squeeze(small + first, LEN - first, text + 70000, LEN - 70000);
    for (size_t piece = 1; piece <= len; piece = piece * 3 + 1) {
        CHECK_INT(send(p.s, small, len, piece, true, &info, &known), UPLOAD_OK);
        CHECK(known);
        CHECK_STR(info.id, plain.id);
    }
    for (size_t cut = 1; cut < len; cut += 97) /* cut where the first member ends, it is a whole stream */
        CHECK_INT(send(p.s, small, cut, 50, true, &info, &known), cut == first ? UPLOAD_OK : UPLOAD_BAD_GZIP);
    small[first / 2] ^= 1;
    CHECK_INT(send(p.s, small, len, 4096, true, &info, &known), UPLOAD_BAD_GZIP);
    CHECK(files_in(&p) >= 1 && files_in(&p) <= 2);
    end_place(&p);
    free(text);
    free(small);
}

TEST(limits_of_one_and_of_all)
{
    place p;
    upload_info info;
    bool known;
    char data[100] = {0};
    if (!place_begin(&p))
        return;
    store_configure(p.s, &(store_settings){.uploads = {.one = 50, .all = 100, .keep_s = 0}});
    CHECK_INT(send(p.s, data, 51, 7, false, &info, &known), UPLOAD_TOO_LARGE);
    CHECK_INT(send(p.s, data, 50, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(send(p.s, data, 40, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(send(p.s, data, 11, 7, false, &info, &known), UPLOAD_NO_ROOM);
    CHECK_INT(send(p.s, data, 10, 7, false, &info, &known), UPLOAD_OK);
    CHECK_INT(files_in(&p), 3);
    place_reopen(&p); /* counts what is there; limits are not kept */
    store_configure(p.s, &(store_settings){.uploads = {.one = 50, .all = 100}});
    CHECK_INT(send(p.s, data, 1, 7, false, &info, &known), UPLOAD_NO_ROOM);
    end_place(&p);
}

TEST(an_upload_in_use_stays)
{
    place p;
    upload_info info;
    bool known, repeated;
    job j = {0};
    int64_t count;
    job_status was;
    if (!place_begin(&p))
        return;
    const char ids[][65] = {ABC}, unknown[][65] = {ABC, "00"};
    store_request request = {.body = "{}", .body_len = 2, .uploads = ids, .n_uploads = 1};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_NOT_FOUND);
    CHECK_INT(rows_in(p.path, "job"), 0);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    request.uploads = unknown;
    request.n_uploads = 2;
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_NOT_FOUND);
    request.uploads = ids;
    request.n_uploads = 1;
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    CHECK_INT(store_upload_delete(p.s, ABC), STORE_CONFLICT);
    store_configure(p.s, &(store_settings){.uploads = {.keep_s = 1e-6}});
    CHECK_INT(store_collect_uploads(p.s, &count), STORE_OK);
    CHECK(count == 0 && files_in(&p) == 1);
    CHECK_INT(store_dismiss(p.s, j.id, &was), STORE_OK);
    CHECK_INT(store_dismiss(p.s, j.id, &was), STORE_OK); /* deleted */
    CHECK_INT(store_collect_uploads(p.s, &count), STORE_OK);
    CHECK(count == 1 && files_in(&p) == 0);
    job_clear(&j);
    end_place(&p);
}

TEST(a_damaged_file_is_no_upload)
{
    place p;
    upload_info info;
    upload_text text;
    bool known;
    char path[256], message[256];
    if (!place_begin(&p))
        return;
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    snprintf(path, sizeof path, "%s-uploads/%s", p.path, ABC);
    CHECK_INT(truncate(path, 2), 0);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_DAMAGED);
    store_message(p.s, message, sizeof message);
    CHECK_MSG(strstr(message, ABC), "%s", message);
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK); /* sending it again mends it */
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_OK);
    store_upload_text_done(&text);
    FILE *file = fopen(path, "r+"); /* the same length, other bytes */
    CHECK(file && fputc('x', file) == 'x' && fclose(file) == 0);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_DAMAGED);
    CHECK(text.data == NULL && text.len == 0);
    CHECK_INT(unlink(path), 0);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_DAMAGED);
    end_place(&p);
}

TEST(a_check_reads_the_files_of_uploads)
{
    place p;
    upload_info info;
    store_findings found;
    bool known;
    char path[256], message[256];
    if (!place_begin(&p))
        return;
    CHECK_INT(send(p.s, "abc", 3, 3, false, &info, &known), UPLOAD_OK);
    CHECK_INT(store_check(p.s, &found), STORE_OK);
    CHECK_MSG(strcmp(found.findings, "") == 0, "%s", found.findings);
    free(found.findings);
    snprintf(path, sizeof path, "%s-uploads/%s", p.path, ABC);
    FILE *file = fopen(path, "r+");
    CHECK(file && fputc('x', file) == 'x' && fclose(file) == 0);
    CHECK_INT(store_check(p.s, &found), STORE_OK);
    CHECK_MSG(strstr(found.findings, ABC), "%s", found.findings);
    free(found.findings);
    CHECK_INT(unlink(path), 0);
    CHECK(store_check_file(p.path, &found, message, sizeof message));
    CHECK_MSG(strstr(found.findings, ABC), "%s", found.findings);
    free(found.findings);
    end_place(&p);
}

/* ---- expiry and retention */

static void submit_with(store *s, store_request request, char id[33])
{
    job j = {0};
    bool repeated;
    request.body = "{}";
    request.body_len = 2;
    CHECK_INT(store_submit(s, &request, &j, &repeated), STORE_OK);
    strcpy(id, j.id);
    job_clear(&j);
}

TEST(a_job_that_ran_once_has_no_queue_limit)
{
    place p;
    char id[33], claimed[33], other[33];
    int64_t count;
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.queue_limit_s = 1000}, id);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_INT(release_as(p.s, claimed, "me"), STORE_OK);
    submit_with(p.s, (store_request){.queue_limit_s = 1000}, other);
    change_file(p.path, "UPDATE job SET queue_until = 1 WHERE queue_until > 0"); /* long after */
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_STR(claimed, id);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_NOT_FOUND); /* too late, though nobody has said so yet */
    CHECK_INT(store_expire(p.s, "{\"code\": \"late\"}", &count), STORE_OK);
    CHECK_INT(count, 1);
    CHECK_INT(status_of(p.s, other), JOB_FAILED);
    CHECK_INT(store_expire(p.s, "{}", &count), STORE_OK);
    CHECK_INT(count, 0);
    place_end(&p);
}

TEST(priorities_go_before_age)
{
    static const int PRIORITIES[] = {0, 10, -10, 10, 3};
    static const int ORDER[] = {1, 3, 4, 0, 2};
    place p;
    char id[5][33], claimed[33];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 5; i++)
        submit_with(p.s, (store_request){.priority = PRIORITIES[i]}, id[i]);
    for (int i = 0; i < 5; i++) {
        CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
        CHECK_STR(claimed, id[ORDER[i]]);
    }
    place_end(&p);
}

static void end_jobs(store *s, int n, const char *webhook)
{
    char id[33];
    for (int i = 0; i < n; i++) {
        submit_with(s, (store_request){.webhook = webhook}, id);
        CHECK_INT(claim_id(s, "me", id), STORE_OK);
        CHECK_INT(finish_as(s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    }
}

TEST(retention_goes_in_small_steps)
{
    place p;
    int64_t count, total = 0;
    int rounds = 0;
    if (!place_begin(&p))
        return;
    end_jobs(p.s, 50, NULL);
    do {
        CHECK_INT(store_retain(p.s, &(store_retention){.keep_jobs = 5}, &count), STORE_OK);
        CHECK(count <= 20);
        total += count;
        rounds++;
    } while (count > 0 && rounds < 10);
    CHECK_INT(total, 45);
    CHECK_INT(rounds, 4);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_bytes = 6}, &count), STORE_OK); /* a body has 2 */
    CHECK_INT(count, 2);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1000}, &count), STORE_OK);
    CHECK_INT(count, 0);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 3);
    place_end(&p);
}

TEST(a_job_stays_until_somebody_was_told)
{
    place p;
    webhook_due due;
    int64_t count;
    if (!place_begin(&p))
        return;
    CHECK_INT(store_webhook_next(p.s, &due), STORE_NOT_FOUND);
    end_jobs(p.s, 1, "http://x/");
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 0);
    place_reopen(&p);
    CHECK_INT(store_webhook_next(p.s, &due), STORE_OK);
    CHECK_STR(due.url, "http://x/");
    CHECK_INT(due.attempts, 0);
    free(due.url);
    CHECK_INT(store_webhook_attempted(p.s, due.job, WEBHOOK_AGAIN, 1000), STORE_OK);
    CHECK_INT(store_webhook_next(p.s, &due), STORE_NOT_FOUND); /* not yet */
    change_file(p.path, "UPDATE webhook SET next = 0");
    CHECK_INT(store_webhook_next(p.s, &due), STORE_OK);
    CHECK_INT(due.attempts, 1);
    CHECK_INT(store_webhook_postpone(p.s, "http://y/", 1000), STORE_OK);
    webhook_due same;
    CHECK_INT(store_webhook_next(p.s, &same), STORE_OK);
    free(same.url);
    CHECK_INT(store_webhook_postpone(p.s, due.url, 1000), STORE_OK);
    CHECK_INT(store_webhook_next(p.s, &same), STORE_NOT_FOUND);
    free(due.url);
    CHECK_INT(store_webhook_attempted(p.s, due.job, WEBHOOK_TOLD, 0), STORE_OK);
    CHECK_INT(store_webhook_next(p.s, &due), STORE_NOT_FOUND);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 1);
    CHECK_INT(rows_in(p.path, "webhook"), 0);
    place_end(&p);
}

TEST(a_full_queue)
{
    place p;
    char id[33], claimed[33];
    job j = {0};
    bool repeated;
    if (!place_begin(&p))
        return;
    store_configure(p.s, &(store_settings){.max_queue = 2});
    submit_with(p.s, (store_request){.priority = 0}, id);
    submit_with(p.s, (store_request){.idempotency_key = "k"}, id);
    store_request request = {.body = "{}", .body_len = 2};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_BUSY);
    request.idempotency_key = "k";
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    CHECK(repeated);
    job_clear(&j);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    submit_with(p.s, (store_request){.priority = 0}, id);
    place_end(&p);
}
