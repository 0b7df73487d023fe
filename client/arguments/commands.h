/* commands.h: the one table of commands and options. The parser, `uzawa help`, the manual page and the
 * completions for bash, zsh and fish all follow from it. */
#ifndef CLIENT_COMMANDS_H
#define CLIENT_COMMANDS_H

#include "text/options.h"

#include <stdbool.h>
#include <stdio.h>

#define CLIENT_VERSION_TEXT "0.1.0"

typedef enum {
    CLIENT_SUBMIT,
    CLIENT_IMPORT,
    CLIENT_UPLOAD,
    CLIENT_STATUS,
    CLIENT_WAIT,
    CLIENT_REFINE,
    CLIENT_VERIFY,
    CLIENT_RESULT,
    CLIENT_PATH,
    CLIENT_PICTURE,
    CLIENT_HISTORY,
    CLIENT_PLOT,
    CLIENT_REPORT,
    CLIENT_REQUEST,
    CLIENT_LIST,
    CLIENT_CANCEL,
    CLIENT_DELETE,
    CLIENT_FACTORS,
    CLIENT_NODES,
    CLIENT_DOCTOR,
    CLIENT_MCP,
    CLIENT_VERSION,
    CLIENT_HELP,
    CLIENT_COMMANDS /* how many there are */
} client_command;

#define CLIENT_IN(command)     (1u << (command))
#define CLIENT_EVERYWHERE      (CLIENT_IN(CLIENT_COMMANDS) - 1u)
#define CLIENT_OPERAND_NEEDED  1u
#define CLIENT_OPERAND_ALLOWED 2u

typedef struct {
    const char *name, *usage, *about;
    const char *operand; /* FILE, ID or COMMAND; NULL: none */
    unsigned operands;   /* CLIENT_OPERAND_... */
    const char *details; /* paragraphs without line breaks of their own, each ended by '\n' */
    const char *exits;   /* how it ends, beyond what is true of all commands; NULL: nothing */
} client_page;

extern const client_page CLIENT_PAGES[CLIENT_COMMANDS];
/* A row's places are the commands that it belongs to. A name may have several rows where it means something else to
 * other commands; the first one for the command counts. */
extern const uz_option_table CLIENT_OPTIONS;
/* The first row of its name for the command; CLIENT_COMMANDS: one that every command that talks to the server has. */
bool client_option_is_own(const uz_option *option, client_command command);

bool client_command_find(client_command *out, const char *name);

/* The exit codes, 0 first; `about` NULL ends the list. */
typedef struct {
    int code;
    const char *about;
} client_exit_line;
extern const client_exit_line CLIENT_EXITS[];

/* The overview (CLIENT_COMMANDS) or one command's page. */
void client_help_print(FILE *to, client_command command);
/* The whole as a manual page (mdoc), as a completion for bash, zsh or fish (false: another shell), as JSON. */
void client_manual_print(FILE *to);
bool client_completion_print(FILE *to, const char *shell);
bool client_help_print_json(FILE *to);

#endif
