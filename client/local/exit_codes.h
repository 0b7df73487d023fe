/* exit_codes.h: how `uzawa` ends. The numbers are a contract: pipelines test them. */
#ifndef CLIENT_EXIT_CODES_H
#define CLIENT_EXIT_CODES_H

typedef enum {
    CLIENT_OK = 0,               /* done; `wait`, `verify` and --wait: the answer is certified as asked */
    CLIENT_USAGE = 2,            /* the command line is wrong; nothing was sent */
    CLIENT_ASSERTION_FAILED = 3, /* the job ended with an answer that fails an assertion or a comparison asked for */
    CLIENT_REFUSED = 4,          /* the server refused the request (4xx) and said why */
    CLIENT_SERVER_ERROR = 5,     /* the server failed (5xx) or answered what is no answer */
    CLIENT_JOB_FAILED = 6,       /* the job ended without an answer */
    CLIENT_NOT_CONVERGED = 7,    /* the job ended with an answer that is not certified as asked */
    CLIENT_INFEASIBLE = 8,       /* the job ended: no displacement satisfies the contact conditions */
    CLIENT_DISMISSED = 9,        /* the job was dismissed */
    CLIENT_WAIT_TIMEOUT = 10,    /* the job goes on, but --timeout has passed */
    CLIENT_LOCAL = 11,           /* a file could not be read or written, or there is no memory */
    CLIENT_UNREACHABLE = 12,     /* no connection, or no answer in time */
    CLIENT_INTERRUPTED = 130     /* by SIGINT, as shells say it; a job that was waited for goes on */
} client_exit;

#endif
