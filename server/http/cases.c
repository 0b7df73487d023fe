/* cases.c: names of load cases in what a client is told. */
#include "http/jobs.h"
#include "text/edit_distance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAMES_SHOWN = 10 };

/* A detail is ASCII (problem.c), so that cutting it short never cuts a character. */
static void append(problem_details *problem, const char *before, const char *name, const char *after)
{
    size_t used = strlen(problem->detail);
    snprintf(problem->detail + used, sizeof problem->detail - used, "%s%s%s", before, name, after);
    for (char *at = problem->detail + used; *at; at++)
        if ((unsigned char)*at < 0x20 || (unsigned char)*at > 0x7e)
            *at = '?';
}

void cases_list(problem_details *problem, const char *wrong, const store_case *cases, size_t count)
{
    char number[48];
    const char **names = wrong ? malloc((count + 1) * sizeof *names) : NULL;
    for (size_t i = 0; names && i < count; i++)
        names[i] = cases[i].name;
    const int closest = names ? uz_closest(wrong, strlen(wrong), names, count) : -1;
    if (closest >= 0)
        append(problem, " Did you mean \"", names[closest], "\"?");
    free(names);
    if (count == 0) {
        append(problem, " It has no cases.", "", "");
        return;
    }
    append(problem, " Its cases: ", "", "");
    for (size_t i = 0; i < count && i < NAMES_SHOWN; i++)
        append(problem, i ? ", \"" : "\"", cases[i].name, "\"");
    snprintf(number, sizeof number, ", ... (%zu in all)", count);
    append(problem, count > NAMES_SHOWN ? number : "", ".", "");
}
