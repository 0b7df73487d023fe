/* auth.c: tokens of a file. */
#include "http/auth.h"

#include <errno.h>
#include <fcntl.h>
#include <gnutls/crypto.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { DIGEST = 32, SECRET_LEAST = 16, SECRET_MOST = 128, MAX_TOKENS = 1000 };

typedef struct {
    char name[64];
    auth_scope scope;
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

static const char *const SCOPES[] = {"none", "read", "submit", "admin"};

const char *auth_scope_name(auth_scope scope)
{
    return SCOPES[scope];
}

/* ------------------------------------------------------------------- file */

/* What is wrong with a line, NULL: nothing. Never quotes the secret. */
static const char *take_line(token_list *list, char *line)
{
    static const char ALLOWED[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~+/=";
    char *rest = NULL;
    const char *name = strtok_r(line, " \t\r\n", &rest);
    if (!name || name[0] == '#')
        return NULL;
    const char *scope = strtok_r(NULL, " \t\r\n", &rest), *secret = strtok_r(NULL, " \t\r\n", &rest);
    token t = {.scope = SCOPE_NONE};
    if (!scope || !secret || strtok_r(NULL, " \t\r\n", &rest))
        return "a line must be \"name scope secret\"";
    for (int i = SCOPE_READ; i <= SCOPE_ADMIN; i++)
        if (strcmp(scope, SCOPES[i]) == 0)
            t.scope = (auth_scope)i;
    if (t.scope == SCOPE_NONE)
        return "the second word must be read, submit or admin";
    if (strlen(name) >= sizeof t.name || strspn(name, ALLOWED) != strlen(name))
        return "the name must be 1 to 63 letters, digits and -._~+/=";
    if (strlen(secret) < SECRET_LEAST || strlen(secret) > SECRET_MOST || strspn(secret, ALLOWED) != strlen(secret))
        return "the secret must be 16 to 128 letters, digits and -._~+/= (openssl rand -hex 32 makes one)";
    for (size_t i = 0; i < list->count; i++)
        if (strcmp(list->tokens[i].name, name) == 0)
            return "this name stands in the file already";
    if (list->count == MAX_TOKENS)
        return "a file has at most 1000 tokens";
    strcpy(t.name, name);
    token *grown = realloc(list->tokens, (list->count + 1) * sizeof *grown);
    if (!grown || gnutls_hash_fast(GNUTLS_DIG_SHA256, secret, strlen(secret), t.digest) != 0) {
        list->tokens = grown ? grown : list->tokens;
        return "no memory";
    }
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

auth_scope auth_check(auth *a, const char *secret, size_t len, char name[64])
{
    unsigned char digest[DIGEST];
    auth_scope scope = SCOPE_NONE;
    name[0] = '\0';
    if (len > SECRET_MOST || gnutls_hash_fast(GNUTLS_DIG_SHA256, secret, len, digest) != 0)
        return SCOPE_NONE;
    pthread_rwlock_rdlock(&a->lock);
    for (size_t i = 0; i < a->list.count; i++)
        if (gnutls_memcmp(a->list.tokens[i].digest, digest, DIGEST) == 0) {
            scope = a->list.tokens[i].scope;
            memcpy(name, a->list.tokens[i].name, 64);
        }
    pthread_rwlock_unlock(&a->lock);
    return scope;
}
