/* options.h: what the daemon can be told, by one table (options_table.c) for the command line, the environment and a
 * file.
 *
 * An option "max-body" is --max-body VALUE, UZAWAD_MAX_BODY=VALUE, or a line "max-body = VALUE" in the file that
 * --config or UZAWAD_CONFIG names. Precedence: flag, environment, file, default; but every value that is given must be
 * valid, wherever it stands. */
#ifndef SERVER_OPTIONS_H
#define SERVER_OPTIONS_H

#include "text/options.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#define UZAWAD_VERSION "0.1.0"

enum { OPTION_PATH = UZ_OPTION_ROOM, OPTIONS_MAX = 64, OPTION_WORDS = 32 };

/* Places of the rows: settings stand in files and the environment too, requests on the command line only. */
enum { OPTION_SETTING = 1, OPTION_REQUEST = 2 };

typedef enum { FROM_DEFAULT, FROM_FILE, FROM_ENVIRONMENT, FROM_FLAG } option_source;

typedef struct {
    /* where */
    char listen[OPTION_PATH], db[OPTION_PATH], store[OPTION_PATH], node[OPTION_PATH], config[OPTION_PATH];
    double affinity_s;
    /* large blobs: "" where there is no object store */
    char objects[OPTION_PATH], object_region[OPTION_PATH], object_key_file[OPTION_PATH];
    size_t object_least;
    /* who may: "" where there is none */
    char token_file[OPTION_PATH], tls_cert[OPTION_PATH], tls_key[OPTION_PATH], user[OPTION_PATH],
        audit_log[OPTION_PATH];
    bool insecure_public;
    /* work */
    int workers, lanes, threads, max_attempts;
    size_t cache, memory;            /* bytes; memory: of one solve */
    double max_solve_s;              /* of one job; 0: no limit */
    char group_command[OPTION_PATH]; /* "": none */
    int max_queue;                   /* jobs that wait; 0: no limit */
    /* of one owner of tokens; 0: no limit */
    int client_queue;
    size_t client_bytes;
    double client_seconds; /* of workers in a day */
    /* ended jobs that are kept; 0: no limit */
    double keep_days;
    int keep_jobs;
    size_t keep_bytes;
    /* whom the end of a job may be told, and a file with what signs it; "" where there is none */
    char webhook_allow[OPTION_PATH], webhook_secret_file[OPTION_PATH];
    /* uploads */
    size_t max_upload, uploads; /* bytes of one, and of all */
    double upload_days;         /* one that no job uses is kept so long */
    /* requests */
    int max_connections, max_client_connections, max_client_rate; /* the last two: 0 is no limit */
    int max_streams;                                              /* of the connections */
    int max_json_depth;
    size_t max_body, max_dofs, max_rows, max_nonzeros;
    double request_deadline_s, max_wait_s;
    char cors[OPTION_PATH];
    /* end, log */
    double drain_s;
    int level; /* log_level */
    bool access_log;

    option_source source[OPTIONS_MAX]; /* in the order of the table */
    int line[OPTIONS_MAX];             /* in the file, where the value comes from there */
} server_options;

typedef enum {
    OPTIONS_RUN,
    OPTIONS_HELP,
    OPTIONS_VERSION,
    OPTIONS_CHECK,    /* --check-config: only say what the values are */
    OPTIONS_EXAMPLE,  /* --example-config */
    OPTIONS_CHECK_DB, /* --check-db */
    OPTIONS_BACKUP,   /* --backup FILE */
    OPTIONS_MOVE,     /* --move FILE [URL] */
    OPTIONS_WRONG     /* the reason is in message */
} options_verdict;

/* Reads argv, the environment and the file. backup (OPTION_PATH bytes, may be NULL) takes the FILE of --backup or
 * --move. */
options_verdict options_read(server_options *out, int argc, char **argv, char *backup, char *message, size_t size);

/* Where jobs are kept: store, or db where that is "". */
const char *options_address(const server_options *o);

/* The words of a list of words, as options_read leaves it: separated by single spaces. */
typedef struct {
    char text[OPTION_PATH];
    const char *words[OPTION_WORDS];
    size_t n;
} option_words;
void options_split(option_words *out, const char *list);

void options_usage(FILE *to);
/* Every option as "name = value  # where it comes from"; what is printed can be read again. */
void options_show(const server_options *o, FILE *to);
/* A file with every option, its meaning and its default, commented out (uzawad.conf.example). */
void options_example(FILE *to);

/* ---- limits, as GET /v1/limits shows them */
typedef struct {
    char name[40]; /* max_body */
    double value;  /* of a limit that is off: infinity */
    const char *unit, *meaning;
    bool is_set; /* to something else than the default */
} option_limit;
/* The options that are limits; at most `most`. Returns how many. */
size_t options_limits(const server_options *o, option_limit *out, size_t most);

/* ---- for the files of this folder */

#define OPTION_LEVELS "debug info warn error" /* in the order of log_level */
extern const uz_option_table DAEMON_OPTIONS;
/* Gives a value to an option; false with what it takes instead in message. */
bool options_set(server_options *o, const uz_option *row, const char *text, char *message, size_t size);
/* options_file.c: reads the file into *o; false with "FILE:LINE: what is wrong; what to do" in message. */
bool options_read_file(server_options *o, const char *path, char *message, size_t size);

#endif
