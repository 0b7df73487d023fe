/* arguments.h: the command line as a struct. */
#ifndef CLIENT_ARGUMENTS_H
#define CLIENT_ARGUMENTS_H

#include "arguments/commands.h"

#include <stdbool.h>
#include <stddef.h>

#define CLIENT_MAX_TAGS  16 /* as many as the service keeps for a job */
#define CLIENT_MAX_WORDS UZ_OPTION_MOST_WORDS

/* Strings point into argv or the environment. */
typedef struct {
    client_command command;
    const char *operand; /* FILE, ID or COMMAND; NULL: none given */
    const char *context; /* a service by its name; NULL: not given */
    const char *server;  /* URL, never NULL */
    double timeout_s;    /* INFINITY: none */
    double retry_s;      /* how long to try to reach the server; < 0: chosen by the command */
    uz_words tags, set, vary, fields, with;
    const char *K, *N, *h, *p, *mesh, *surface; /* files; NULL: not given */
    bool leave_out;                             /* of a deck */
    double size;                                /* of elements, of a part from CAD; 0: not given */
    const char *from, *to;                      /* points, as written */
    const char *name, *key, *format, *output, *status, *colour, *factor, *axis, *view, *up;
    const char *case_name, *accuracy;                /* accuracy: a number or a level, as written */
    double time_limit_s;                             /* NAN: not given */
    const char *junit, *baseline;                    /* a file; a job */
    double tolerance;                                /* of the baseline; -1: not given */
    int limit, width, height, count, max_iterations; /* -1: not given */
    bool wait, quiet, json, progress, csv, plot, ascii, deformed, whole_error, trade, validate, along_path, help,
        version;
} client_options;

extern const char CLIENT_DEFAULT_SERVER[];

/* Fills *out. env_server: value of UZAWA_SERVER or NULL. False: the command line is wrong and message says how.
 * --help and --version anywhere win over what else is wrong with operands. */
bool client_arguments_parse(client_options *out, int argc, char *const *argv, const char *env_server, char *message,
                            size_t size);

#endif
