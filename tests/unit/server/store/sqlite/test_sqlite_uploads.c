/* Files of uploads beside a database: in its backups, damaged, checked. */
#include "sqlite_file.h"
#include "store/sqlite/backup_uploads.h"
#include "store/engine_base.h"
#include "upload_place.h"

#include <sys/stat.h>

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
    CHECK_INT(store_upload_delete(p.s, ABC, NULL), STORE_OK);
    CHECK_INT(store_upload_text(p.s, ABC, &text), STORE_NOT_FOUND);
    copy.s = NULL;
    if (place_open(&copy)) {
        CHECK_INT(files_in(&copy), 1);
        CHECK_INT(store_upload_text(copy.s, ABC, &text), STORE_OK);
        CHECK(text.len == 3 && memcmp(text.data, "abc", 3) == 0);
        store_upload_text_done(&text);
        CHECK_INT(store_upload_delete(copy.s, ABC, NULL), STORE_OK);
        store_close(copy.s);
    }
    place_remove_files(&copy);
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
        CHECK_INT(store_upload_delete(p.s, ABC, NULL), STORE_OK);
        CHECK_INT(second_pass(p.path, copy), !used);
        job_clear(&j);
        snprintf(file, sizeof file, "rm -r '%s'*", copy);
        CHECK_INT(system(file), 0);
        end_place(&p);
    }
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
