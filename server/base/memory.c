/* memory.c: limits of the machine and of the control group. */
#include "base/memory.h"

#include <limits.h>
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The number in a file of one line; SIZE_MAX where there is none ("max"), or no file. */
static size_t read_limit(const char *path)
{
    char text[64] = "", *end = text;
    FILE *file = fopen(path, "r");
    if (!file)
        return (size_t)-1;
    if (!fgets(text, sizeof text, file))
        text[0] = '\0';
    fclose(file);
    unsigned long long value = strtoull(text, &end, 10);
    return end == text ? (size_t)-1 : (size_t)value;
}

size_t memory_available(void)
{
    char line[2048], path[4096];
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    size_t least = pages > 0 && page > 0 ? (size_t)pages * (size_t)page : (size_t)1 << 30;
    const size_t root = read_limit("/sys/fs/cgroup/memory.max");
    const size_t old = read_limit("/sys/fs/cgroup/memory/memory.limit_in_bytes"); /* version 1 */
    least = root < least ? root : least;
    least = old < least ? old : least;

    /* The group of this process and those around it that can be seen, "0::/a/b" in version 2. */
    FILE *file = fopen("/proc/self/cgroup", "r");
    while (file && fgets(line, sizeof line, file)) {
        char *name = strncmp(line, "0::/", 4) == 0 ? line + 3 : NULL;
        if (!name)
            continue;
        name[strcspn(name, "\n")] = '\0';
        for (char *slash; (slash = strrchr(name, '/')) && name[1]; *slash = '\0') {
            snprintf(path, sizeof path, "/sys/fs/cgroup%s/memory.max", name);
            const size_t limit = read_limit(path);
            least = limit < least ? limit : least;
            if (slash == name)
                break;
        }
    }
    if (file)
        fclose(file);
    return least;
}

void memory_keep_heap(void)
{
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

size_t memory_share(size_t available, size_t cache, int workers)
{
    size_t least = (size_t)64 << 20, most = available / 5 * 4, share = 0;
    if (most > cache)
        share = (most - cache) / (size_t)(workers > 0 ? workers : 1);
    return share > least ? share : least;
}
