/* faulty_vfs.h: for tests, a layer under SQLite (sqlite3_vfs) that fails on demand and knows what a power loss leaves.
 * Source: SQLite documentation, "The OS Backend (VFS) To SQLite"; the model of a disk is that of its "Atomic Commit In
 * SQLite", section 2: a sector is written in full or not at all, in any order, until a sync returns.
 *
 * It is the default VFS from faulty_install() on. Everything goes on to the real one; what was written, and what it
 * covered, is kept until the file is synced. faulty_cut() writes the files as a power loss at that moment could have
 * left them: what was synced, and of what was not each sector or not, by chance. Shared memory (-shm) is lost. */
#ifndef TESTS_FAULTY_VFS_H
#define TESTS_FAULTY_VFS_H

#include <pthread.h>
#include <sqlite3.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FAULTY_FILES = 64, FAULTY_SECTOR = 512 };

/* A write or a truncation that is not synced. */
typedef struct {
    bool truncates;
    bool forgotten;           /* a sync failed: the kernel takes it for written, and no later sync writes it */
    int64_t at, size;         /* of a write; at: the new size of a truncation */
    int64_t old_size;         /* of the file */
    unsigned char *old, *new; /* what was there (zeros past the end), what is there now */
    int64_t old_len;          /* of a truncation: what it cut off */
} faulty_op;

typedef struct {
    char path[512];
    faulty_op *ops; /* n_ops of capacity */
    size_t n_ops, capacity;
    bool deleted;        /* but perhaps not on disk */
    unsigned char *last; /* its content then */
    int64_t last_size;
} faulty_record;

/* One for the program: SQLite's VFS are global too. */
static struct {
    pthread_mutex_t lock;
    sqlite3_vfs vfs, *real;
    faulty_record records[FAULTY_FILES];
    size_t n_records;
    bool tracks;        /* keep what is not synced */
    long events;        /* writes, syncs, truncations, deletions so far */
    long fail_at;       /* the event that fails; 0: none */
    bool fail_for_ever; /* and all after it */
    int fail_code;
    bool fired;
    long cut_at;          /* the event before which on_cut is called; 0: none */
    void (*on_cut)(void); /* under the lock */
    void (*on_sync)(void);
} faulty = {.lock = PTHREAD_MUTEX_INITIALIZER};

typedef struct {
    sqlite3_file base;
    faulty_record *record; /* NULL: not tracked */
    sqlite3_file real;     /* the real one's room follows */
} faulty_file;
#define FAULTY_REAL(file) (&((faulty_file *)(void *)(file))->real)

/* ------------------------------------------------------------------ events */

/* Counts; true if this one must fail. Under the lock. */
static inline bool faulty_event(void)
{
    faulty.events++;
    if (faulty.events == faulty.cut_at && faulty.on_cut)
        faulty.on_cut();
    bool fails = faulty.fail_at > 0 &&
                 (faulty.events == faulty.fail_at || (faulty.fail_for_ever && faulty.events > faulty.fail_at));
    faulty.fired = faulty.fired || fails;
    return fails;
}

static inline void faulty_drop_ops(faulty_record *r)
{
    for (size_t i = 0; i < r->n_ops; i++) {
        free(r->ops[i].old);
        free(r->ops[i].new);
    }
    r->n_ops = 0;
}

/* What a sync makes last: all but what an earlier, failed one forgot; a truncation takes that away too. */
static inline void faulty_drop_synced(faulty_record *r)
{
    size_t kept = 0, cut = 0;
    for (size_t i = 0; i < r->n_ops; i++)
        cut = r->ops[i].truncates && r->ops[i].at == 0 && !r->ops[i].forgotten ? i : cut;
    for (size_t i = 0; i < r->n_ops; i++) {
        if (r->ops[i].forgotten && i >= cut) {
            r->ops[kept++] = r->ops[i];
            continue;
        }
        free(r->ops[i].old);
        free(r->ops[i].new);
    }
    r->n_ops = kept;
}

static inline faulty_record *faulty_find(const char *path, bool add)
{
    for (size_t i = 0; i < faulty.n_records; i++)
        if (strcmp(faulty.records[i].path, path) == 0)
            return &faulty.records[i];
    if (!add || faulty.n_records == FAULTY_FILES)
        return NULL;
    faulty_record *r = &faulty.records[faulty.n_records++];
    snprintf(r->path, sizeof r->path, "%s", path);
    return r;
}

static inline faulty_op *faulty_new_op(faulty_record *r)
{
    if (r->n_ops == r->capacity) {
        r->capacity = r->capacity ? 2 * r->capacity : 64;
        r->ops = realloc(r->ops, r->capacity * sizeof *r->ops);
        if (!r->ops)
            abort();
    }
    faulty_op *op = &r->ops[r->n_ops++];
    memset(op, 0, sizeof *op);
    return op;
}

/* What stands at [at, at + size), zeros past the end. */
static inline unsigned char *faulty_read(sqlite3_file *real, int64_t at, int64_t size)
{
    unsigned char *data = calloc(1, (size_t)size + 1);
    if (!data)
        abort();
    if (size > 0)
        real->pMethods->xRead(real, data, (int)size, at); /* a short read fills with zeros */
    return data;
}

static inline void faulty_note_write(sqlite3_file *file, const void *data, int n, int64_t at)
{
    sqlite3_file *real = FAULTY_REAL(file);
    faulty_record *r = ((faulty_file *)(void *)file)->record;
    if (!r || !faulty.tracks)
        return;
    faulty_op *op = faulty_new_op(r);
    sqlite3_int64 old_size = 0;
    real->pMethods->xFileSize(real, &old_size);
    *op = (faulty_op){.at = at, .size = n, .old_size = old_size, .old = faulty_read(real, at, n)};
    op->new = malloc((size_t)n + 1);
    if (!op->new)
        abort();
    memcpy(op->new, data, (size_t)n);
}

static inline void faulty_note_truncation(sqlite3_file *file, int64_t size)
{
    sqlite3_file *real = FAULTY_REAL(file);
    faulty_record *r = ((faulty_file *)(void *)file)->record;
    sqlite3_int64 old_size = 0;
    if (!r || !faulty.tracks)
        return;
    real->pMethods->xFileSize(real, &old_size);
    faulty_op *op = faulty_new_op(r);
    int64_t cut = old_size > size ? old_size - size : 0;
    *op = (faulty_op){.truncates = true, .at = size, .old_size = old_size, .old_len = cut};
    op->old = faulty_read(real, size, cut);
}

/* ----------------------------------------------------------------- methods */

static inline int faulty_close(sqlite3_file *file)
{
    sqlite3_file *real = FAULTY_REAL(file);
    return real->pMethods ? real->pMethods->xClose(real) : SQLITE_OK;
}

static inline int faulty_xread(sqlite3_file *file, void *data, int n, sqlite3_int64 at)
{
    return FAULTY_REAL(file)->pMethods->xRead(FAULTY_REAL(file), data, n, at);
}

static inline int faulty_write(sqlite3_file *file, const void *data, int n, sqlite3_int64 at)
{
    pthread_mutex_lock(&faulty.lock);
    int rc = faulty_event() ? faulty.fail_code : SQLITE_OK;
    if (rc == SQLITE_OK) {
        faulty_note_write(file, data, n, at);
        rc = FAULTY_REAL(file)->pMethods->xWrite(FAULTY_REAL(file), data, n, at);
    }
    pthread_mutex_unlock(&faulty.lock);
    return rc;
}

static inline int faulty_truncate(sqlite3_file *file, sqlite3_int64 size)
{
    pthread_mutex_lock(&faulty.lock);
    int rc = faulty_event() ? SQLITE_IOERR_TRUNCATE : SQLITE_OK;
    if (rc == SQLITE_OK) {
        faulty_note_truncation(file, size);
        rc = FAULTY_REAL(file)->pMethods->xTruncate(FAULTY_REAL(file), size);
    }
    pthread_mutex_unlock(&faulty.lock);
    return rc;
}

/* Nothing has to reach the real disk: the power of this machine stays on. */
static inline int faulty_sync(sqlite3_file *file, int flags)
{
    (void)flags;
    if (faulty.on_sync)
        faulty.on_sync();
    pthread_mutex_lock(&faulty.lock);
    faulty_record *r = ((faulty_file *)(void *)file)->record;
    int rc = faulty_event() ? SQLITE_IOERR_FSYNC : SQLITE_OK;
    for (size_t i = 0; r && rc != SQLITE_OK && i < r->n_ops; i++)
        r->ops[i].forgotten = true;
    if (rc == SQLITE_OK && r) {
        faulty_drop_synced(r);
        if (strstr(r->path, "-wal") || strstr(r->path, "-journal")) /* its folder too, when it is new: os_unix.c */
            for (size_t i = 0; i < faulty.n_records; i++)
                faulty.records[i].deleted = false;
    }
    pthread_mutex_unlock(&faulty.lock);
    return rc;
}

static inline int faulty_size(sqlite3_file *f, sqlite3_int64 *size)
{
    return FAULTY_REAL(f)->pMethods->xFileSize(FAULTY_REAL(f), size);
}
static inline int faulty_lock(sqlite3_file *f, int level)
{
    return FAULTY_REAL(f)->pMethods->xLock(FAULTY_REAL(f), level);
}
static inline int faulty_unlock(sqlite3_file *f, int level)
{
    return FAULTY_REAL(f)->pMethods->xUnlock(FAULTY_REAL(f), level);
}
static inline int faulty_reserved(sqlite3_file *f, int *out)
{
    return FAULTY_REAL(f)->pMethods->xCheckReservedLock(FAULTY_REAL(f), out);
}
static inline int faulty_control(sqlite3_file *f, int op, void *arg)
{
    return FAULTY_REAL(f)->pMethods->xFileControl(FAULTY_REAL(f), op, arg);
}
static inline int faulty_sector(sqlite3_file *f)
{
    (void)f;
    return FAULTY_SECTOR;
}
static inline int faulty_traits(sqlite3_file *f)
{
    return FAULTY_REAL(f)->pMethods->xDeviceCharacteristics(FAULTY_REAL(f));
}
static inline int faulty_shm_map(sqlite3_file *f, int page, int size, int extend, void volatile **out)
{
    return FAULTY_REAL(f)->pMethods->xShmMap(FAULTY_REAL(f), page, size, extend, out);
}
static inline int faulty_shm_lock(sqlite3_file *f, int offset, int n, int flags)
{
    return FAULTY_REAL(f)->pMethods->xShmLock(FAULTY_REAL(f), offset, n, flags);
}
static inline void faulty_shm_barrier(sqlite3_file *f)
{
    FAULTY_REAL(f)->pMethods->xShmBarrier(FAULTY_REAL(f));
}
static inline int faulty_shm_unmap(sqlite3_file *f, int delete)
{
    return FAULTY_REAL(f)->pMethods->xShmUnmap(FAULTY_REAL(f), delete);
}

static const sqlite3_io_methods FAULTY_METHODS = {2,
                                                  faulty_close,
                                                  faulty_xread,
                                                  faulty_write,
                                                  faulty_truncate,
                                                  faulty_sync,
                                                  faulty_size,
                                                  faulty_lock,
                                                  faulty_unlock,
                                                  faulty_reserved,
                                                  faulty_control,
                                                  faulty_sector,
                                                  faulty_traits,
                                                  faulty_shm_map,
                                                  faulty_shm_lock,
                                                  faulty_shm_barrier,
                                                  faulty_shm_unmap,
                                                  NULL,
                                                  NULL};

static inline int faulty_open(sqlite3_vfs *vfs, const char *name, sqlite3_file *file, int flags, int *out_flags)
{
    faulty_file *f = (faulty_file *)(void *)file;
    (void)vfs;
    f->record = NULL;
    int rc = faulty.real->xOpen(faulty.real, name, &f->real, flags, out_flags);
    f->base.pMethods = rc == SQLITE_OK || f->real.pMethods ? &FAULTY_METHODS : NULL;
    if (rc != SQLITE_OK || !name || !(flags & (SQLITE_OPEN_MAIN_DB | SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)))
        return rc;
    pthread_mutex_lock(&faulty.lock);
    f->record = faulty_find(name, true);
    if (f->record && f->record->deleted) {
        free(f->record->last);
        f->record->last = NULL;
        f->record->deleted = false;
    }
    pthread_mutex_unlock(&faulty.lock);
    return rc;
}

static inline unsigned char *faulty_content(const char *path, int64_t *size)
{
    FILE *file = fopen(path, "rb");
    *size = 0;
    if (!file)
        return NULL;
    fseek(file, 0, SEEK_END);
    *size = ftell(file);
    rewind(file);
    unsigned char *data = malloc((size_t)*size + 1);
    if (!data || fread(data, 1, (size_t)*size, file) != (size_t)*size)
        abort();
    fclose(file);
    return data;
}

static inline int faulty_delete(sqlite3_vfs *vfs, const char *name, int sync_folder)
{
    (void)vfs;
    pthread_mutex_lock(&faulty.lock);
    int rc = faulty_event() ? SQLITE_IOERR_DELETE : SQLITE_OK;
    faulty_record *r = rc == SQLITE_OK && faulty.tracks ? faulty_find(name, false) : NULL;
    if (r && !sync_folder) {
        free(r->last);
        r->last = faulty_content(name, &r->last_size);
        r->deleted = r->last != NULL;
    }
    if (r)
        faulty_drop_ops(r);
    if (rc == SQLITE_OK)
        rc = faulty.real->xDelete(faulty.real, name, sync_folder);
    pthread_mutex_unlock(&faulty.lock);
    return rc;
}

/* ------------------------------------------------------------------- tests */

static inline void faulty_install(void)
{
    if (faulty.real)
        return;
    faulty.real = sqlite3_vfs_find(NULL);
    faulty.vfs = *faulty.real;
    faulty.vfs.zName = "faulty";
    faulty.vfs.szOsFile = (int)sizeof(faulty_file) + faulty.real->szOsFile;
    faulty.vfs.xOpen = faulty_open;
    faulty.vfs.xDelete = faulty_delete;
    faulty.vfs.pNext = NULL;
    sqlite3_vfs_register(&faulty.vfs, 1);
}

/* Forgets all files and faults. */
static inline void faulty_reset(void)
{
    pthread_mutex_lock(&faulty.lock);
    for (size_t i = 0; i < faulty.n_records; i++) {
        faulty_drop_ops(&faulty.records[i]);
        free(faulty.records[i].ops);
        free(faulty.records[i].last);
    }
    memset(faulty.records, 0, sizeof faulty.records);
    faulty.n_records = 0;
    faulty.events = faulty.fail_at = faulty.cut_at = 0;
    faulty.fail_for_ever = faulty.fired = faulty.tracks = false;
    faulty.on_cut = faulty.on_sync = NULL;
    pthread_mutex_unlock(&faulty.lock);
}

static inline unsigned faulty_random(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX generator */
    return (unsigned)(*state >> 33);
}

typedef struct {
    unsigned char *data;
    int64_t size, room;
} faulty_image;

static inline void faulty_room(faulty_image *image, int64_t size)
{
    if (size <= image->room)
        return;
    image->data = realloc(image->data, (size_t)size);
    if (!image->data)
        abort();
    memset(image->data + image->room, 0, (size_t)(size - image->room));
    image->room = size;
}

static inline void faulty_resize(faulty_image *image, int64_t size)
{
    faulty_room(image, size);
    if (size > image->size)
        memset(image->data + image->size, 0, (size_t)(size - image->size));
    image->size = size;
}

/* Takes back everything that is not synced, from the last to the first. */
static inline void faulty_undo(faulty_image *image, const faulty_record *r)
{
    for (size_t i = r->n_ops; i-- > 0;) {
        const faulty_op *op = &r->ops[i];
        faulty_resize(image, op->truncates ? op->old_size : image->size);
        if (op->truncates)
            memcpy(image->data + op->at, op->old, (size_t)op->old_len);
        else {
            faulty_room(image, op->at + op->size);
            memcpy(image->data + op->at, op->old, (size_t)op->size);
            image->size = op->old_size;
        }
    }
}

/* `chance` of 8 that a sector that was not synced is there nevertheless. */
static inline void faulty_redo(faulty_image *image, const faulty_record *r, unsigned chance, uint64_t *seed)
{
    for (size_t i = 0; i < r->n_ops; i++) {
        const faulty_op *op = &r->ops[i];
        if (op->truncates) {
            if (faulty_random(seed) % 8 < chance)
                faulty_resize(image, op->at);
            continue;
        }
        for (int64_t at = 0; at < op->size;) {
            int64_t n = FAULTY_SECTOR - (op->at + at) % FAULTY_SECTOR;
            n = n < op->size - at ? n : op->size - at;
            if (faulty_random(seed) % 8 < chance) {
                if (op->at + at + n > image->size)
                    faulty_resize(image, op->at + at + n);
                memcpy(image->data + op->at + at, op->new + at, (size_t)n);
            }
            at += n;
        }
    }
}

/* Writes what a power loss leaves of every tracked file into `folder`. Under the lock (on_cut). */
static inline void faulty_cut(const char *folder, uint64_t *seed)
{
    char path[700];
    unsigned chance = faulty_random(seed) % 9; /* 0: nothing that was not synced, 8: all */
    for (size_t i = 0; i < faulty.n_records; i++) {
        faulty_record *r = &faulty.records[i];
        faulty_image image = {0};
        image.data = faulty_content(r->path, &image.size);
        if (!image.data && r->deleted && faulty_random(seed) % 2) {
            image.size = r->last_size;
            image.data = malloc((size_t)image.size + 1);
            if (image.data)
                memcpy(image.data, r->last, (size_t)image.size);
        }
        if (!image.data)
            continue;
        image.room = image.size;
        faulty_undo(&image, r);
        faulty_redo(&image, r, chance, seed);
        snprintf(path, sizeof path, "%s/%s", folder, strrchr(r->path, '/') + 1);
        FILE *out = fopen(path, "wb");
        if (!out || fwrite(image.data, 1, (size_t)image.size, out) != (size_t)image.size || fclose(out) != 0)
            abort();
        free(image.data);
    }
}

#endif
