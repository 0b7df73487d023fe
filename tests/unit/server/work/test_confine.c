/* What a process that is confined can still do, and what it cannot: it tries.
 * in the ordinary build too: a sanitizer does not get through the filter */
#include "harness.h"
#include "work/confine.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* Refused, and for no other reason. */
static bool refused(long result)
{
    return result == -1 && errno == EPERM;
}

/* Tries everything; returns the number of the first thing that went wrong, 0: none, 99: there is no filter here. */
static int try_all(void)
{
    struct stat st;
    char *const argv[] = {NULL};
    const int file = open("/dev/zero", O_RDONLY);
    char byte;
    if (!confine_process())
        return 99;
    /* what solving takes */
    void *block = malloc(64 << 20);
    if (!block || read(file, &byte, 1) != 1)
        return 1;
    free(block);
    void *map = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (map == MAP_FAILED || mprotect(map, 1 << 20, PROT_READ) != 0)
        return 2;
    /* files */
    if (!refused(open("/etc/passwd", O_RDONLY)) || !refused(open("/tmp/uzawad-confined", O_WRONLY | O_CREAT, 0600)))
        return 3;
    if (!refused(stat("/etc/passwd", &st)) || !refused(unlink("/tmp/uzawad-confined")) || !refused(access("/", R_OK)))
        return 4;
    /* network */
    if (!refused(socket(AF_INET, SOCK_STREAM, 0)) || !refused(socket(AF_UNIX, SOCK_STREAM, 0)))
        return 5;
    /* processes */
    if (!refused(execv("/bin/true", argv)) || !refused(fork()) || !refused(kill(getppid(), 0)))
        return 6;
    /* code */
    if (!refused(mprotect(map, 1 << 20, PROT_READ | PROT_EXEC)) ||
        mmap(NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED)
        return 7;
    /* other descriptors */
    if (!refused(dup(file)) || !refused(fcntl(file, F_DUPFD, 0)))
        return 8;
    return 0;
}

TEST(a_confined_process_can_only_solve)
{
    const pid_t pid = fork();
    int status = 0;
    if (pid == 0)
        _exit(try_all());
    CHECK(pid > 0 && waitpid(pid, &status, 0) == pid);
    CHECK(WIFEXITED(status));
    if (WEXITSTATUS(status) == 99)
        test_skip("no filter of system calls here");
    else
        CHECK_INT(WEXITSTATUS(status), 0);
}

TEST(memory_is_bounded)
{
    const pid_t pid = fork();
    int status = 0;
    if (pid == 0) {
        confine_memory((size_t)64 << 20);
        void *small = malloc((size_t)16 << 20), *large = malloc((size_t)1 << 30);
        _exit(!small ? 1 : large ? 2 : 0);
    }
    CHECK(pid > 0 && waitpid(pid, &status, 0) == pid);
    CHECK(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || (WEXITSTATUS(status) == 2 && !confine_process())));
}
