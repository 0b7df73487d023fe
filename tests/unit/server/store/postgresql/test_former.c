/* Which process a daemon is, and whether it is no more. */
#include "harness.h"
#include "store/postgresql/former.h"

#include <signal.h>
#include <stdio.h>
#include <sys/wait.h>
#include <unistd.h>

TEST(a_process_that_has_ended_is_gone)
{
    char us[FORMER_TEXT], child[FORMER_TEXT], later[FORMER_TEXT], boot[64], space[64];
    long pid;
    unsigned long long start;
    siginfo_t ended;
    CHECK(former_describe(getpid(), us));
    CHECK(former_is_near(us));
    CHECK(!former_is_gone(us));
    const pid_t one = fork();
    if (one == 0) {
        pause();
        _exit(0);
    }
    CHECK(former_describe(one, child));
    CHECK(former_is_near(child) && !former_is_gone(child));
    kill(one, SIGSTOP); /* it may go on any time */
    CHECK(!former_is_gone(child));
    kill(one, SIGKILL);
    CHECK(waitid(P_PID, (id_t)one, &ended, WEXITED | WNOWAIT) == 0);
    CHECK(former_is_gone(child)); /* its parent has not asked for its status yet */
    CHECK(waitpid(one, NULL, 0) == one);
    CHECK(former_is_gone(child));
    CHECK(!former_describe(one, later));
    /* another one may have the number */
    CHECK(sscanf(us, "%63s %63s %ld %llu", boot, space, &pid, &start) == 4);
    snprintf(later, sizeof later, "%s %s %ld %llu", boot, space, pid, start + 1);
    CHECK(former_is_near(later) && former_is_gone(later));
}

TEST(what_runs_elsewhere_is_not_known)
{
    char us[FORMER_TEXT], boot[64], space[64], other[FORMER_TEXT];
    CHECK(former_describe(getpid(), us));
    CHECK(sscanf(us, "%63s %63s", boot, space) == 2);
    snprintf(other, sizeof other, "%s pid:[1] 1 1", boot);
    CHECK(!former_is_near(other));
    snprintf(other, sizeof other, "0-0 %s 1 1", space);
    CHECK(!former_is_near(other));
    CHECK(!former_is_near("") && !former_is_gone(""));
    CHECK(!former_is_near("a b 0 1") && !former_is_gone("a b 0 1"));
}
