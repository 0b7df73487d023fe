#include "store/postgresql/former.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* The first word of a file, or the target of a link; false: there is none. */
static bool read_word(const char *path, bool is_link, char *out, size_t size)
{
    ssize_t n = -1;
    if (is_link) {
        n = readlink(path, out, size - 1);
    } else {
        FILE *file = fopen(path, "re");
        n = file ? (ssize_t)fread(out, 1, size - 1, file) : -1;
        if (file)
            fclose(file);
    }
    out[n > 0 ? n : 0] = '\0';
    out[strcspn(out, " \n")] = '\0';
    return out[0] != '\0';
}

/* When it began, in ticks since the boot (proc(5), field 22 of stat). False: there is no such process, or it has
 * ended. */
static bool read_start(pid_t pid, unsigned long long *start)
{
    char path[32], text[1024];
    snprintf(path, sizeof path, "/proc/%ld/stat", (long)pid);
    FILE *file = fopen(path, "re");
    const size_t n = file ? fread(text, 1, sizeof text - 1, file) : 0;
    if (file)
        fclose(file);
    text[n] = '\0';
    const char *at = strrchr(text, ')'); /* its name may have anything in it */
    char state = 'X';
    return at &&
           sscanf(at + 1, " %c %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %llu", &state,
                  start) == 2 &&
           !strchr("ZXx", state);
}

static bool read_place(char boot[64], char space[64])
{
    return read_word("/proc/sys/kernel/random/boot_id", false, boot, 64) &&
           read_word("/proc/self/ns/pid", true, space, 64);
}

bool former_describe(pid_t pid, char out[FORMER_TEXT])
{
    char boot[64], space[64];
    unsigned long long start;
    out[0] = '\0';
    return read_place(boot, space) && read_start(pid, &start) &&
           snprintf(out, FORMER_TEXT, "%s %s %ld %llu", boot, space, (long)pid, start) < FORMER_TEXT;
}

static bool read_described(const char *described, char boot[64], char space[64], long *pid, unsigned long long *start)
{
    return sscanf(described, "%63s %63s %ld %llu", boot, space, pid, start) == 4 && *pid > 0;
}

bool former_is_near(const char *described)
{
    char boot[64], space[64], our_boot[64], our_space[64];
    long pid;
    unsigned long long start;
    return read_described(described, boot, space, &pid, &start) && read_place(our_boot, our_space) &&
           strcmp(boot, our_boot) == 0 && strcmp(space, our_space) == 0;
}

bool former_is_gone(const char *described)
{
    char boot[64], space[64];
    long pid;
    unsigned long long start, now;
    if (!read_described(described, boot, space, &pid, &start))
        return false;
    if (kill((pid_t)pid, 0) != 0 && errno == ESRCH)
        return true;
    /* Where the processes of other users are hidden, who can be sent a signal may be one of those. */
    if (read_start((pid_t)pid, &now))
        return now != start;
    char path[32];
    snprintf(path, sizeof path, "/proc/%ld/stat", pid);
    return access(path, R_OK) == 0;
}
