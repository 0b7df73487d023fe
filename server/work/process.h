/* process.h: a process that solves, as the daemon has it: it is started when there is a job for it (the first one
 * before), lives on with its cache, may be killed at any time, and is started again for the next one.
 *
 * A process belongs to whoever took it from the pool (work_take_process); nothing here is locked. */
#ifndef SERVER_WORK_PROCESS_H
#define SERVER_WORK_PROCESS_H

#include "base/log.h"
#include "work/group_process.h"
#include "work/message.h"
#include "work/segment.h"

#include <sys/types.h>

enum { PROCESS_BODIES = 256 };

typedef struct {
    const char *program; /* that is started; NULL: this one, again */
    size_t cache_bytes, solve_bytes;
    server_log *log;
    group_process group; /* of its job, until the next one has its own */

    pid_t pid;         /* 0: none lives */
    int socket;        /* -1 when none lives */
    bool ready;        /* it has said so */
    int64_t oom_kills; /* of the machine, when it was started */
    segment board_memory, inbox, outbox;
    board *board;

    /* For who chooses a process for a job; under the pool's lock. */
    bool taken, answered;            /* answered: its job's outcome is being stored, and it is free soon */
    double given;                    /* back to the pool, on CLOCK_MONOTONIC */
    uint64_t bodies[PROCESS_BODIES]; /* n_bodies that it solved and has, the last one first */
    size_t n_bodies;
    uz_cache_entry *entries; /* n_entries, as it listed them last */
    size_t n_entries, held_entries, held_bytes;
} process;

/* What it shares with the one that lives; false: no memory. process_free in every case, which lets one that is idle end
 * by itself and kills any other. */
bool process_make(process *p, const char *program, size_t cache_bytes, size_t solve_bytes, server_log *log);
void process_free(process *p);

/* One lives, maybe not ready yet. False: it could not be started, and the log says why. */
bool process_begin(process *p);
/* Ends it at once, in the middle of whatever it does; process_reap is still to be called. */
void process_kill(process *p);
/* Waits for its end, after it was killed or its socket closed: its status as waitpid has it. *out_of_memory: the
 * machine or the control group killed it for want of memory, or it knew of none when it died. */
int process_reap(process *p, bool *out_of_memory);

/* What stands for the body of a job's text: the same for texts whose problems differ only in
 * what leaves its stiffness as it is: loads, obstacles, how contact moves, names of units. */
uint64_t process_body(const char *text, size_t len);

#endif
