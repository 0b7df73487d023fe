/* confine.c: limits and a filter of system calls (seccomp(2)). */
#include "work/confine.h"
#include "core/sanitized.h"

#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__x86_64__)
#define ARCHITECTURE AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define ARCHITECTURE AUDIT_ARCH_AARCH64
#endif

void confine_memory(size_t more)
{
    struct rlimit limit;
    unsigned long data = 0;
    FILE *file = SANITIZED ? NULL : fopen("/proc/self/statm", "r");
    if (!file)
        return;
    const bool known = fscanf(file, "%*s %*s %*s %*s %*s %lu", &data) == 1;
    const size_t now = (size_t)data * (size_t)sysconf(_SC_PAGESIZE);
    fclose(file);
    if (!known || getrlimit(RLIMIT_DATA, &limit) != 0 || more > RLIM_INFINITY - 1 - now)
        return;
    limit.rlim_cur = now + more < limit.rlim_max ? now + more : limit.rlim_max;
    setrlimit(RLIMIT_DATA, &limit);
}

#ifdef ARCHITECTURE

/* What allocating, computing, waiting and talking over open descriptors need. */
static const int ALLOWED[] = {
    SYS_read,          SYS_write,           SYS_readv,
    SYS_writev,        SYS_pread64,         SYS_lseek,
    SYS_close,         SYS_ftruncate,       SYS_munmap,
    SYS_mremap,        SYS_madvise,         SYS_brk,
    SYS_futex,         SYS_sched_yield,     SYS_sched_getaffinity,
    SYS_clock_gettime, SYS_clock_getres,    SYS_clock_nanosleep,
    SYS_nanosleep,     SYS_gettimeofday,    SYS_getrusage,
    SYS_times,         SYS_sysinfo,         SYS_getpid,
    SYS_gettid,        SYS_getcpu,          SYS_getrandom,
    SYS_rt_sigaction,  SYS_rt_sigprocmask,  SYS_rt_sigreturn,
    SYS_rt_sigpending, SYS_restart_syscall, SYS_exit,
    SYS_sigaltstack,   SYS_exit_group,      SYS_ppoll,
    SYS_recvmsg,       SYS_sendmsg,         SYS_set_robust_list,
    SYS_membarrier,
#ifdef SYS_rseq
    SYS_rseq,
#endif
#ifdef SYS_poll
    SYS_poll,
#endif
#ifdef SYS_time
    SYS_time,
#endif
};

enum { N_ALLOWED = sizeof ALLOWED / sizeof ALLOWED[0], ROOM = 64 + 2 * N_ALLOWED };

/* The lower half of the argument, on machines of either byte order that are supported: both are little-endian. */
#define ARGUMENT(i) ((unsigned)offsetof(struct seccomp_data, args[i]))

bool confine_process(void)
{
    struct sock_filter code[ROOM];
    unsigned short n = 0;
    if (SANITIZED || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
        return false;
    const struct sock_filter allow = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    const struct sock_filter refuse = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM);
    const struct sock_filter number = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, (unsigned)offsetof(struct seccomp_data, nr));
    code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, (unsigned)offsetof(struct seccomp_data, arch));
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARCHITECTURE, 1, 0);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
    code[n++] = number;
    for (int i = 0; i < N_ALLOWED; i++) {
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)ALLOWED[i], 0, 1);
        code[n++] = allow;
    }
    /* Memory, but none that can be executed. */
    static const int MAPPING[] = {SYS_mmap, SYS_mprotect};
    for (size_t i = 0; i < sizeof MAPPING / sizeof MAPPING[0]; i++) {
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)MAPPING[i], 0, 4);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, ARGUMENT(2));
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, PROT_EXEC, 1, 0);
        code[n++] = allow;
        code[n++] = refuse;
    }
    /* A signal to itself, as abort() sends it. */
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_tgkill, 0, 3);
    code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, ARGUMENT(0));
    code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)getpid(), 0, 1);
    code[n++] = allow;
    code[n++] = refuse;
    const struct sock_fprog filter = {.len = n, .filter = code};
    return syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &filter) == 0;
}

#else

bool confine_process(void)
{
    return false;
}

#endif
