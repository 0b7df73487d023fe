/* confine.h: what a process that solves gives up before it reads its first job. */
#ifndef SERVER_WORK_CONFINE_H
#define SERVER_WORK_CONFINE_H

#include <stdbool.h>
#include <stddef.h>

/* From now on the data of this process, all that it allocates, may take so many bytes more than now. */
void confine_memory(size_t more);

/* From now on this process, in all its threads, can use the memory and the descriptors that it has, and nothing else of
 * the system: no file is opened or looked at, no socket made, no program run, no process made or signalled, no memory
 * made executable. What is tried fails with EPERM. There is no way back. False: the system has no such filter (seccomp,
 * Linux 3.17), or this is a build with a sanitizer, whose reports need more. */
bool confine_process(void);

#endif
