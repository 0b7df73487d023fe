/* solver_process.h: the program in its other role: a process that solves, started by the daemon (work/process.h). */
#ifndef SERVER_WORK_SOLVER_PROCESS_H
#define SERVER_WORK_SOLVER_PROCESS_H

#include "core/sanitized.h"

/* The first argument in that role; the others are numbers: the daemon's process id, bytes of cache with the reserve,
 * bytes that a solve may take (0: no limit). */
#define SOLVER_ROLE "--solver-process"
enum { SOLVER_ARGUMENTS = 5 };

/* What it is started with. */
enum { SOLVER_SOCKET = 3, SOLVER_BOARD, SOLVER_INBOX, SOLVER_OUTBOX };

/* Of the cache's bytes one part in so many, up to a limit, is the reserve's: memory that lies ready for the next
 * factor. Tests under a sanitizer start some hundred solver processes, each of which would make all of it ready. */
enum { RESERVE_SHARE = 4, RESERVE_MOST = (SANITIZED ? 8 : 256) << 20 };

/* Its exit status where the group of processes that it solved with was lost: with it goes all that was made. */
enum { SOLVER_GROUP_LOST = 3 };

/* Solves what comes until the daemon closes its end. Returns the exit status. */
int solver_process(int argc, char **argv);

#endif
