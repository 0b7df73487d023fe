/* options_table.c: every option of the daemon: what it is called, what it takes, what it means. */
#include "options/options.h"

#include <limits.h>
#include <string.h>

#define AT(member) offsetof(server_options, member)
#define NO_LIMIT   NULL

static const option_row ROWS[] = {
    {"listen", OPTION_TEXT, AT(listen), 0, 0, "127.0.0.1:8080", NULL, NO_LIMIT, false,
     "HOST:PORT to listen on; [::1]:0 works too, port 0 takes a free one. An address that others can reach needs a "
     "token-file"},
    {"db", OPTION_FILE, AT(db), 0, 0, "./contact.db", NULL, NO_LIMIT, false, "jobs and results are kept in this file"},
    {"config", OPTION_FILE, AT(config), 0, 0, "", NULL, NO_LIMIT, false,
     "file with lines \"name = value\" for all options but this one"},
    {"token-file", OPTION_FILE, AT(token_file), 0, 0, "", NULL, NO_LIMIT, false,
     "lines \"name scope secret\": who may read, submit or admin; read again at SIGHUP. Without it everybody may all"},
    {"insecure-public", OPTION_SWITCH, AT(insecure_public), 0, 1, "no", NULL, NO_LIMIT, false,
     "listen on an address that others can reach although there is no token-file"},
    {"tls-cert", OPTION_FILE, AT(tls_cert), 0, 0, "", NULL, NO_LIMIT, false,
     "certificate chain (PEM): answer by HTTPS; needs tls-key"},
    {"tls-key", OPTION_FILE, AT(tls_key), 0, 0, "", NULL, NO_LIMIT, false, "private key (PEM) of tls-cert"},
    {"user", OPTION_TEXT, AT(user), 0, 0, "", NULL, NO_LIMIT, false,
     "become this user once the port is taken, when started as root"},
    {"workers", OPTION_INTEGER, AT(workers), 1, 1024, NULL, "as many as there are processors", "threads", false,
     "problems solved at once"},
    {"cache", OPTION_BYTES, AT(cache), 1, 0, "1G", NULL, "bytes", false, "memory for factors that are kept"},
    {"memory", OPTION_BYTES, AT(memory), 1, 0, NULL,
     "80 % of what the machine or its control group has, less the cache, divided by the workers", "bytes", false,
     "memory that one problem may take"},
    {"max-solve-s", OPTION_SECONDS, AT(max_solve_s), 0, 1e9, "86400", NULL, "seconds", true,
     "time that one job may take; it ends with the best answer so far, or fails where there is none; 0: no limit"},
    {"max-queue", OPTION_INTEGER, AT(max_queue), 0, INT_MAX, "0", NULL, "jobs", true,
     "jobs that may wait; one more is answered 503; 0: no limit"},
    {"max-attempts", OPTION_INTEGER, AT(max_attempts), 1, 1000, "3", NULL, "runs", false,
     "runs of a job whose run ends with the process before it is failed"},
    {"keep-days", OPTION_SECONDS, AT(keep_days), 0, 1e6, "0", NULL, "days", true,
     "ended jobs are deleted so long after their end; 0: no limit"},
    {"keep-jobs", OPTION_INTEGER, AT(keep_jobs), 0, INT_MAX, "0", NULL, "jobs", true,
     "ended jobs that are kept; of more the oldest are deleted; 0: no limit"},
    {"keep-bytes", OPTION_BYTES, AT(keep_bytes), 0, 0, "0", NULL, "bytes", true,
     "requests and results of ended jobs that are kept; of more the oldest are deleted; 0: no limit"},
    {"max-upload", OPTION_BYTES, AT(max_upload), 1, 0, "1G", NULL, "bytes", false,
     "largest upload, after decompression"},
    {"uploads", OPTION_BYTES, AT(uploads), 1, 0, "10G", NULL, "bytes", false,
     "all uploads together, in a folder beside the db with its name and \"-uploads\"; those that no job uses make "
     "room"},
    {"upload-days", OPTION_SECONDS, AT(upload_days), 0, 1e6, "30", NULL, "days", true,
     "an upload that no job uses is deleted so long after it was last used; 0: it is kept"},
    {"webhook-allow", OPTION_HOSTS, AT(webhook_allow), 0, 0, "", NULL, NO_LIMIT, false,
     "HOST or HOST:PORT that jobs may ask to have their end told to; several: give it again, or spaces between them. "
     "Without one nobody is called"},
    {"webhook-secret-file", OPTION_FILE, AT(webhook_secret_file), 0, 0, "", NULL, NO_LIMIT, false,
     "what is told is signed with the bytes of this file"},
    {"cors", OPTION_ORIGINS, AT(cors), 0, 0, "", NULL, NO_LIMIT, false,
     "pages of this origin (https://host[:port], or * for all) may use the service from a browser; several: give it "
     "again, or spaces between them"},
    {"max-connections", OPTION_INTEGER, AT(max_connections), 1, 100000, "1024", NULL, "connections", false,
     "connections open at once"},
    {"max-streams", OPTION_INTEGER, AT(max_streams), 1, 100000, NULL, "three quarters of max-connections", "streams",
     false, "event streams open at once; they are connections too"},
    {"max-client-connections", OPTION_INTEGER, AT(max_client_connections), 0, 100000, "0", NULL, "connections", true,
     "connections of one address open at once; 0: no limit of its own. Behind a proxy all clients are one"},
    {"max-client-rate", OPTION_INTEGER, AT(max_client_rate), 0, 1000000, "10000", NULL, "requests per second", true,
     "requests of one address or token per second, twice as many at once; more are answered 429; 0: no limit"},
    {"max-body", OPTION_BYTES, AT(max_body), 1, 0, "64M", NULL, "bytes", false, "largest request body"},
    {"max-json-depth", OPTION_INTEGER, AT(max_json_depth), 8, 64, "64", NULL, "levels", false,
     "arrays and objects within each other in a request"},
    {"max-dofs", OPTION_COUNT, AT(max_dofs), 1, 0, "100M", NULL, "dofs", false, "d: degrees of freedom of a problem"},
    {"max-rows", OPTION_COUNT, AT(max_rows), 1, 0, "100M", NULL, "rows", false,
     "m: rows of N of a problem given as matrices"},
    {"max-nonzeros", OPTION_COUNT, AT(max_nonzeros), 1, 0, "1000M", NULL, "entries", false,
     "entries of K, and of N, of a problem given as matrices"},
    {"request-deadline-s", OPTION_SECONDS, AT(request_deadline_s), 0.1, 1e6, "30", NULL, "seconds", false,
     "time for a request to arrive, plus 1 s per 100 kB of its body"},
    {"max-wait-s", OPTION_SECONDS, AT(max_wait_s), 0, 3600, "60", NULL, "seconds", false,
     "longest wait that Prefer: wait is granted"},
    {"drain-s", OPTION_SECONDS, AT(drain_s), 0, 1e6, "30", NULL, "seconds", false,
     "time for running jobs to end after SIGTERM; then they are put back"},
    {"log-level", OPTION_LEVEL, AT(level), 0, 3, "info", NULL, NO_LIMIT, false, "debug, info, warn or error"},
    {"access-log", OPTION_SWITCH, AT(access_log), 0, 1, "yes", NULL, NO_LIMIT, false, "log a line for each request"},
};
#define N_ROWS (sizeof ROWS / sizeof ROWS[0])
_Static_assert(N_ROWS <= OPTIONS_MAX, "server_options has room for the sources");

size_t options_table(const option_row **rows)
{
    *rows = ROWS;
    return N_ROWS;
}

const option_row *options_find(const char *name, size_t len)
{
    for (size_t i = 0; i < N_ROWS; i++)
        if (strlen(ROWS[i].name) == len && memcmp(ROWS[i].name, name, len) == 0)
            return &ROWS[i];
    return NULL;
}
