/* auth.c: tokens of a file. */
#include "http/auth.h"

#include <errno.h>
#include <fcntl.h>
#include <gnutls/crypto.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { DIGEST = 32, SECRET_LEAST = 16, SECRET_MOST = 128, MAX_TOKENS = 1000 };

static const char ALLOWED[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~+/=";

typedef struct {
    auth_identity who;
    double until; /* Unix seconds; INFINITY: for ever */
    unsigned char digest[DIGEST];
} token;

typedef struct {
    token *tokens; /* count */
    size_t count;
} token_list;

struct auth {
    char *path;
    pthread_rwlock_t lock; /* list */
    token_list list;
};

const char *const AUTH_SCOPES[] = {"none", "read", "submit", "admin"};

/* ------------------------------------------------------------------- file */

/* The SHA-256 of a secret, or the one that is given in its place: "sha256:" and 64 hexadecimal digits in lower case. */
static const char *take_secret(token *t, const char *secret)
{
    static const char HASHED[] = "sha256:", DIGITS[] = "0123456789abcdef";
    const size_t len = strlen(secret), prefix = sizeof HASHED - 1;
    if (strncmp(secret, HASHED, prefix) == 0) {
        const char *at = secret + prefix;
        if (strlen(at) != 2 * DIGEST || strspn(at, DIGITS) != 2 * DIGEST)
            return "sha256: must be followed by 64 digits 0 to 9 and a to f (printf %s SECRET | sha256sum)";
        for (int i = 0; i < DIGEST; i++)
            t->digest[i] =
                (unsigned char)(16 * (strchr(DIGITS, at[2 * i]) - DIGITS) + (strchr(DIGITS, at[2 * i + 1]) - DIGITS));
        return NULL;
    }
    if (len < SECRET_LEAST || len > SECRET_MOST || strspn(secret, ALLOWED) != len)
        return "the secret must be 16 to 128 letters, digits and -._~+/= (openssl rand -hex 32 makes one), or sha256: "
               "and its digest";
    return gnutls_hash_fast(GNUTLS_DIG_SHA256, secret, len, t->digest) == 0 ? NULL : "no memory";
}

/* What is wrong with a line, NULL: nothing. Never quotes the secret. */
static const char *take_line(token_list *list, char *line)
{
    char *rest = NULL;
    const char *name = strtok_r(line, " \t\r\n", &rest);
    if (!name || name[0] == '#')
        return NULL;
    const char *scope = strtok_r(NULL, " \t\r\n", &rest), *secret = strtok_r(NULL, " \t\r\n", &rest), *word, *why;
    token t = {.who = {.scope = SCOPE_NONE}, .until = INFINITY};
    if (!scope || !secret)
        return "a line must be \"name scope secret\"";
    for (int i = SCOPE_READ; i <= SCOPE_ADMIN; i++)
        if (strcmp(scope, AUTH_SCOPES[i]) == 0)
            t.who.scope = (auth_scope)i;
    if (t.who.scope == SCOPE_NONE)
        return "the second word must be read, submit or admin";
    const char *owner = name;
    while ((word = strtok_r(NULL, " \t\r\n", &rest)))
        if (strncmp(word, "owner=", 6) == 0) {
            owner = word + 6;
        } else if (strncmp(word, "until=", 6) == 0) { /* until the end of the day, or the moment */
            struct tm end = {0};
            const char *behind = strptime(word + 6, "%Y-%m-%d", &end);
            const bool day = behind && !*behind;
            behind = behind && !day ? strptime(behind, "T%H:%M:%SZ", &end) : behind;
            if (!behind || *behind)
                return "until= must be followed by a date of UTC such as 2026-12-31 or 2026-12-31T12:00:00Z";
            t.until = (double)timegm(&end) + (day ? 86400.0 : 0.0);
        } else {
            return "behind \"name scope secret\" there may be owner=NAME and until=DATE";
        }
    if (strlen(name) >= sizeof t.who.name || strspn(name, ALLOWED) != strlen(name) || !owner[0] ||
        strlen(owner) >= sizeof t.who.owner || strspn(owner, ALLOWED) != strlen(owner))
        return "the name must be 1 to 63 letters, digits and -._~+/=, and so must the owner";
    if ((why = take_secret(&t, secret)))
        return why;
    strcpy(t.who.name, name);
    strcpy(t.who.owner, owner);
    for (size_t i = 0; i < list->count; i++) {
        if (strcmp(list->tokens[i].who.name, name) == 0)
            return "this name stands in the file already; several tokens of one owner have names of their own";
        if (memcmp(list->tokens[i].digest, t.digest, DIGEST) == 0)
            return "another token has this secret already";
    }
    if (list->count == MAX_TOKENS)
        return "a file has at most 1000 tokens";
    token *grown = realloc(list->tokens, (list->count + 1) * sizeof *grown);
    if (!grown)
        return "no memory";
    list->tokens = grown;
    list->tokens[list->count++] = t;
    return NULL;
}

static bool read_file(token_list *out, const char *path, char *message, size_t size)
{
    char line[512];
    int number = 0;
    const char *why = NULL;
    *out = (token_list){0};
    /* a secret that every user of the machine can read is none */
    struct stat st;
    FILE *file = NULL;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        snprintf(message, size, "cannot read the token file %s: %s", path, strerror(errno));
    else if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
        snprintf(message, size, "the token file %s is not a regular file", path);
    else if (st.st_mode & S_IRWXO)
        snprintf(message, size, "the token file %s is open to every user of this machine: chmod o= %s", path, path);
    else
        file = fdopen(fd, "r");
    if (!file) {
        if (fd >= 0)
            close(fd);
        return false;
    }
    while (!why && fgets(line, sizeof line, file)) {
        number++;
        why = strchr(line, '\n') || feof(file) ? take_line(out, line) : "this line is too long";
    }
    explicit_bzero(line, sizeof line);
    if (!why && out->count == 0)
        why = "there is no token in it, so nobody could do anything";
    fclose(file);
    if (!why)
        return true;
    snprintf(message, size, "%s:%d: %s", path, number, why);
    free(out->tokens);
    *out = (token_list){0};
    return false;
}

/* ------------------------------------------------------------------ tokens */

auth *auth_new(const char *path, char *message, size_t size)
{
    auth *a = calloc(1, sizeof *a);
    char *copy = strdup(path);
    if (!a || !copy)
        snprintf(message, size, "no memory for the tokens");
    if (!a || !copy || !read_file(&a->list, path, message, size)) {
        free(copy);
        free(a);
        return NULL;
    }
    a->path = copy;
    pthread_rwlock_init(&a->lock, NULL);
    return a;
}

void auth_free(auth *a)
{
    if (!a)
        return;
    pthread_rwlock_destroy(&a->lock);
    free(a->list.tokens);
    free(a->path);
    free(a);
}

bool auth_reload(auth *a, char *message, size_t size)
{
    token_list fresh;
    if (!read_file(&fresh, a->path, message, size))
        return false;
    pthread_rwlock_wrlock(&a->lock);
    token *old = a->list.tokens;
    a->list = fresh;
    pthread_rwlock_unlock(&a->lock);
    free(old);
    return true;
}

auth_identity auth_check(auth *a, const char *secret, size_t len, double now)
{
    unsigned char digest[DIGEST];
    auth_identity found = {.scope = SCOPE_NONE};
    if (len > SECRET_MOST || gnutls_hash_fast(GNUTLS_DIG_SHA256, secret, len, digest) != 0)
        return found;
    pthread_rwlock_rdlock(&a->lock);
    for (size_t i = 0; i < a->list.count; i++) {
        const token *t = &a->list.tokens[i];
        if (gnutls_memcmp(t->digest, digest, DIGEST) != 0)
            continue;
        found = t->who;
        found.expired = now >= t->until;
        if (found.expired)
            found.scope = SCOPE_NONE;
    }
    pthread_rwlock_unlock(&a->lock);
    return found;
}
