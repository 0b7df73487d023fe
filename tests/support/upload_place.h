/* upload_place.h: for tests, uploads in the store of a place, whose blobs are files of the folder PATH-uploads. */
#ifndef TESTS_UPLOAD_PLACE_H
#define TESTS_UPLOAD_PLACE_H

#include "store_place.h"

#include <dirent.h>

/* SHA-256 of "abc", FIPS 180-4's example (NIST, SHA256.pdf). */
#define ABC "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"

static inline upload_status send(store *s, const void *data, size_t len, size_t piece, bool gzip, upload_info *info,
                                 bool *known)
{
    upload_status status;
    upload_writer *w = store_upload_begin(s, NULL, gzip, &status);
    CHECK(w && status == UPLOAD_OK);
    for (size_t at = 0; w && at < len; at += piece)
        store_upload_write(w, (const char *)data + at, len - at < piece ? len - at : piece);
    return w ? store_upload_end(w, info, known) : status;
}

/* Files in the folder of uploads, -1: there is no folder; or blobs in the database. */
static inline int files_in(const place *p)
{
    char folder[128];
    int count = 0;
    struct dirent *entry;
    int64_t blobs = -1;
    if (p->database[0])
        return postgresql_run(p->database, "SELECT count(*) FROM uzawa.blob", &blobs) ? (int)blobs : -1;
    snprintf(folder, sizeof folder, "%s-uploads", p->path);
    DIR *dir = opendir(folder);
    while (dir && (entry = readdir(dir)))
        count += entry->d_name[0] != '.';
    if (!dir)
        return -1;
    closedir(dir);
    return count;
}

static inline void end_place(place *p)
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

#endif
