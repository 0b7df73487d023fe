/* arguments.h: the command line as a struct. */
#ifndef CLIENT_ARGUMENTS_H
#define CLIENT_ARGUMENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum {
    CLIENT_SUBMIT,
    CLIENT_UPLOAD,
    CLIENT_STATUS,
    CLIENT_WAIT,
    CLIENT_REFINE,
    CLIENT_VERIFY,
    CLIENT_RESULT,
    CLIENT_PICTURE,
    CLIENT_HISTORY,
    CLIENT_LIST,
    CLIENT_CANCEL,
    CLIENT_VERSION,
    CLIENT_HELP,
    CLIENT_COMMANDS /* how many there are */
} client_command;

#define CLIENT_MAX_TAGS 16 /* as many as the service keeps for a job */

/* Strings point into argv or the environment. */
typedef struct {
    client_command command;
    const char *operand; /* FILE, ID or COMMAND; NULL: none given */
    const char *server;  /* URL, never NULL */
    double timeout_s;    /* INFINITY: none */
    double retry_s;      /* how long to try to reach the server; < 0: chosen by the command */
    const char *tags[CLIENT_MAX_TAGS];
    int n_tags;
    const char *key, *fields, *format, *output, *status, *colour, *factor;
    const char *case_name, *accuracy;          /* accuracy: a number or a level, as written */
    double time_limit_s;                       /* NAN: not given */
    const char *junit, *baseline;              /* a file; a job */
    double tolerance;                          /* < 0: not given */
    long limit, width, height, max_iterations; /* width and max_iterations -1: not given */
    bool wait, quiet, json, progress, csv, plot, ascii, help, version;
} client_options;

/* Fills *out. env_server: value of UZAWA_SERVER or NULL. False: the command line is wrong and message says how.
 * --help and --version anywhere win over what else is wrong with operands. */
bool client_arguments_parse(client_options *out, int argc, char *const *argv, const char *env_server, char *message,
                            size_t size);

const char *client_command_name(client_command command);
bool client_command_find(client_command *out, const char *name);

/* The overview (COMMANDS) or one command's page. */
void client_help_print(FILE *to, client_command command);

#endif
