#include "base/memory.h"

#include <limits.h>
#include <malloc.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The line of a file of one line; "": there is none. */
static void read_line(char *text, int size, const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file || !fgets(text, size, file))
        text[0] = '\0';
    if (file)
        fclose(file);
}

/* The number in a file; infinity where there is none ("max"), or no file. */
static double read_bytes(const char *path)
{
    char text[64], *end = text;
    read_line(text, sizeof text, path);
    const double value = strtod(text, &end);
    return end == text ? (double)INFINITY : value;
}

/* Processors by the time that a group has in a period, "TIME PERIOD" or "max PERIOD". */
static double read_quota(const char *path)
{
    char text[64];
    double time, period;
    read_line(text, sizeof text, path);
    return sscanf(text, "%lf %lf", &time, &period) == 2 && time > 0.0 && period > 0.0 ? time / period
                                                                                      : (double)INFINITY;
}

/* The least that files of this name say, in the group of this process and those around it that can be seen ("0::/a/b"
 * in version 2). */
static double least_of_groups(const char *name, double (*read)(const char *path))
{
    char line[2048], path[4096];
    snprintf(path, sizeof path, "/sys/fs/cgroup/%s", name);
    double least = read(path);
    FILE *file = fopen("/proc/self/cgroup", "r");
    while (file && fgets(line, sizeof line, file)) {
        char *group = strncmp(line, "0::/", 4) == 0 ? line + 3 : NULL;
        if (!group)
            continue;
        group[strcspn(group, "\n")] = '\0';
        for (char *slash; (slash = strrchr(group, '/')) && group[1]; *slash = '\0') {
            snprintf(path, sizeof path, "/sys/fs/cgroup%s/%s", group, name);
            least = fmin(least, read(path));
            if (slash == group)
                break;
        }
    }
    if (file)
        fclose(file);
    return least;
}

size_t memory_available(void)
{
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    const size_t all = pages > 0 && page > 0 ? (size_t)pages * (size_t)page : (size_t)1 << 30;
    const double old = read_bytes("/sys/fs/cgroup/memory/memory.limit_in_bytes"); /* version 1 */
    const double least = fmin(old, least_of_groups("memory.max", read_bytes));
    return least < (double)all ? (size_t)least : all;
}

int processors_available(void)
{
    cpu_set_t may_use;
    const int all = sched_getaffinity(0, sizeof may_use, &may_use) == 0 ? CPU_COUNT(&may_use) : 1;
    const double quota = least_of_groups("cpu.max", read_quota);
    return quota < all ? (quota > 1.0 ? (int)quota : 1) : all;
}

void memory_keep_heap(void)
{
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, INT_MAX);
}

size_t memory_for_cache(size_t available)
{
    const size_t least = (size_t)1 << 30, share = available / 6;
    return share > least ? share : least;
}

size_t memory_share(size_t available, size_t cache, int workers)
{
    size_t least = (size_t)64 << 20, most = available / 5 * 4, share = 0;
    if (most > cache)
        share = (most - cache) / (size_t)(workers > 0 ? workers : 1);
    return share > least ? share : least;
}
