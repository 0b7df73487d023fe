#include "store/sqlite/trail.h"
#include "store/blobs.h"
#include "store/sqlite/file_format.h"

#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define KEPT_MOST  (1 << 20) /* bytes; then the older half goes */
#define NAMED_MOST 20        /* changes that are named to a person */

/* The line that names the database. */
static void first_line(sqlite3 *db, char out[48])
{
    int64_t id = 0;
    file_format_integer(db, "SELECT jobs FROM tally WHERE status = -2", &id);
    snprintf(out, 48, "uzawad trail %016" PRIx64 "\n", (uint64_t)id);
}

/* The whole file and a NUL, malloc'ed; NULL: there is none, or no memory. */
static char *read_all(const char *path, size_t *len)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    char *text = fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode) ? malloc((size_t)st.st_size + 1) : NULL;
    const ssize_t n = text ? pread(fd, text, (size_t)st.st_size, 0) : -1;
    if (fd >= 0)
        close(fd);
    if (n < 0) {
        free(text);
        return NULL;
    }
    *len = (size_t)n;
    text[n] = '\0';
    return text;
}

char *trail_missing(sqlite3 *db, const char *file, uint64_t *last)
{
    char path[4096], first[48], what[24], id[65];
    size_t len, said_len;
    int64_t number = 0;
    uint64_t lost = 0, from = 0, at;
    char *said = NULL;
    *last = 0;
    if ((size_t)snprintf(path, sizeof path, "%s-trail", file) >= sizeof path)
        return NULL;
    char *text = read_all(path, &len); /* before the number: a daemon may be at work */
    first_line(db, first);
    const bool known = file_format_integer(db, "SELECT jobs FROM tally WHERE status = -1", &number);
    *last = (uint64_t)number;
    FILE *out = text && strncmp(text, first, strlen(first)) == 0 ? open_memstream(&said, &said_len) : NULL;
    for (char *line = out ? text + strlen(first) : NULL, *end; line && (end = strchr(line, '\n')); line = end + 1) {
        *end = '\0'; /* a last line without an end was not written whole */
        if (sscanf(line, "%" SCNu64 " %23s %64s", &at, what, id) != 3 || at <= (uint64_t)number)
            continue;
        from = lost == 0 ? at : from;
        *last = at > *last ? at : *last;
        if (lost++ < NAMED_MOST)
            fprintf(out, "%s%s %s (%" PRIu64 ")", lost > 1 ? ", " : "", what, id, at);
    }
    if (out && lost > NAMED_MOST)
        fprintf(out, " and %" PRIu64 " more", lost - NAMED_MOST);
    if (out)
        fclose(out);
    free(text);
    char *words = NULL;
    if (known && lost > 0 && said &&
        asprintf(&words,
                 "the database ends with commit %" PRId64 ", but %" PRIu64 " to %" PRIu64
                 " were on disk once: its write-ahead log was cut or deleted, or it is an older copy. Lost: %s",
                 number, from, *last, said) < 0)
        words = NULL;
    free(said);
    return words;
}

void trail_open(trail *t, sqlite3 *db, const char *file)
{
    size_t len = 0;
    first_line(db, t->first);
    if (asprintf(&t->path, "%s-trail", file) < 0) {
        t->path = NULL;
        return;
    }
    char *text = read_all(t->path, &len);
    const bool ours = text && strncmp(text, t->first, strlen(t->first)) == 0;
    const bool cut = ours && text[len - 1] != '\n'; /* the next line must not go on with half a one */
    free(text);
    t->fd =
        open(t->path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | (ours ? 0 : O_TRUNC), 0600);
    t->size = (int64_t)len;
    if (t->fd >= 0 && (!ours || cut) && !blob_write_all(t->fd, ours ? "\n" : t->first, ours ? 1 : strlen(t->first))) {
        close(t->fd);
        t->fd = -1;
    }
}

void trail_note(trail *t, const char *what, const char *id)
{
    char *at = t->noted.data + t->noted.len;
    const size_t room = sizeof t->noted.data - t->noted.len;
    const size_t len = (size_t)snprintf(at, room, " %s %s\n", what, id);
    t->noted.len += len < room ? len : 0;
}

void trail_committed(trail *t, uint64_t number)
{
    trail_text *to = &t->waiting;
    for (size_t at = 0, len; at < t->noted.len; at += len) {
        const char *line = t->noted.data + at;
        len = (size_t)((const char *)memchr(line, '\n', t->noted.len - at) - line) + 1;
        const size_t room = sizeof to->data - to->len;
        const size_t all = (size_t)snprintf(to->data + to->len, room, "%" PRIu64 "%.*s", number, (int)len, line);
        to->len += all < room ? all : 0;
    }
    t->noted.len = 0;
}

void trail_append(trail *t, bool on_disk)
{
    char fresh[4096];
    size_t len = 0;
    if (t->fd >= 0 && on_disk && t->taken.len > 0 && blob_write_all(t->fd, t->taken.data, t->taken.len))
        t->size += (int64_t)t->taken.len;
    if (t->fd < 0 || t->size <= KEPT_MOST)
        return;
    /* The newer half stays, in another file that takes the place of this one. */
    char *text = read_all(t->path, &len), *from = text ? strchr(text + len / 2, '\n') : NULL;
    if (from && (size_t)snprintf(fresh, sizeof fresh, "%s.new", t->path) < sizeof fresh) {
        const size_t rest = len - (size_t)(from + 1 - text);
        const int fd = open(fresh, O_WRONLY | O_APPEND | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (fd >= 0 && blob_write_all(fd, t->first, strlen(t->first)) && blob_write_all(fd, from + 1, rest) &&
            rename(fresh, t->path) == 0) {
            close(t->fd);
            t->fd = fd;
            t->size = (int64_t)(strlen(t->first) + rest);
        } else if (fd >= 0) {
            close(fd);
            unlink(fresh);
        }
    }
    free(text);
}
