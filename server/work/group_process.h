/* group_process.h: the processes that hold a body together for a process that solves: a command of the administrator's
 * starts them (mpirun, srun), and the first of them calls back at a socket of this machine. */
#ifndef SERVER_WORK_GROUP_PROCESS_H
#define SERVER_WORK_GROUP_PROCESS_H

#include "base/log.h"

#include <stdbool.h>
#include <sys/types.h>

/* All zero: there is none. */
typedef struct {
    pid_t pid;    /* of the command, which leads a process group; 0: none */
    int listener; /* where it is to call; 0: nowhere, or it has called */
} group_process;

/* Starts the command by sh: {program} in it stands for uzawa-group and its argument. What is left of an earlier one is
 * ended. False: it could not be started, and the log says why. */
bool group_process_begin(group_process *g, const char *command, server_log *log);
/* Once the listener is readable: the stream, which the caller closes; -1: somebody else called. */
int group_process_accept(group_process *g);
/* It has ended of itself; *status as waitpid has it. */
bool group_process_ended(group_process *g, int *status);
/* It is to end, at once. */
void group_process_end(group_process *g);
/* Waits until it has, for a moment, then kills what is left. */
void group_process_reap(group_process *g);

#endif
