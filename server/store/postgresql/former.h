/* former.h: which process a daemon is, so that the next one on its machine can tell that it is no more, and need not
 * wait until the leases of its jobs are over. Nothing depends on being right about that: an owner whose job was taken
 * has a token that is good for nothing. */
#ifndef SERVER_STORE_POSTGRESQL_FORMER_H
#define SERVER_STORE_POSTGRESQL_FORMER_H

#include <stdbool.h>
#include <sys/types.h>

#define FORMER_TEXT 160

/* "BOOT SPACE PID START": the boot of the machine, the space in which the process number counts (that of a container),
 * the number, and when the process began, in ticks since the boot. false: the system does not tell. */
bool former_describe(pid_t pid, char out[FORMER_TEXT]);
/* Of a process as it was described: is it of this boot and space, so that one can look? */
bool former_is_near(const char *described);
/* Of one that is near: it is no more, or has ended and nobody has asked for its status yet. */
bool former_is_gone(const char *described);

#endif
