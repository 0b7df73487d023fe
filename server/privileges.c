#include "privileges.h"

#include <errno.h>
#include <grp.h>
#include <pwd.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

bool privileges_drop(const char *user, char *message, size_t size)
{
    char text[4096];
    struct passwd entry, *found = NULL;
    if (getpwnam_r(user, &entry, text, sizeof text, &found) != 0 || !found) {
        snprintf(message, size, "there is no user \"%s\" to become", user);
        return false;
    }
    if (geteuid() == found->pw_uid && getuid() == found->pw_uid)
        return true;
    if (geteuid() != 0) {
        snprintf(message, size, "only root can become user \"%s\": start as root, or without --user", user);
        return false;
    }
    if (initgroups(user, found->pw_gid) != 0 || setgid(found->pw_gid) != 0 || setuid(found->pw_uid) != 0) {
        snprintf(message, size, "cannot become user \"%s\": %s", user, strerror(errno));
        return false;
    }
    if (found->pw_uid != 0 && (setuid(0) == 0 || geteuid() == 0)) { /* the way back must be closed */
        snprintf(message, size, "user \"%s\" could become root again", user);
        return false;
    }
    return true;
}
