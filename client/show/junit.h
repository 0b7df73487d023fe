/* junit.h: checks as a JUnit report, the XML that CI systems show: a test suite for each job, a test case for each
 * check. There is no standard of it; this is what Jenkins' JUnit plugin, GitLab and the common actions of GitHub read:
 * testsuites > testsuite > properties, testcase > failure or error. */
#ifndef CLIENT_JUNIT_H
#define CLIENT_JUNIT_H

#include "show/checks.h"

/* One job. */
typedef struct {
    char *name, *id, *created, *outcome;
    double seconds;
    client_checks checks;
} client_suite;

/* Zero-initialise. */
typedef struct {
    client_suite *item;
    size_t count;
} client_suites;

/* Adds a suite for the job and takes over *checks, which is then empty. False: no memory. */
bool client_suites_add(client_suites *to, const char *name, const json_t *job, client_checks *checks);
void client_suites_clear(client_suites *suites);

/* Writes the report, whole or not at all. False: message says why. */
bool client_junit_write(const client_suites *suites, const char *path, char *message, size_t size);

#endif
