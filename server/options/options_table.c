/* options_table.c: every option of the daemon: what it is called, what it takes, what it means. */
#include "options/options.h"

#include <limits.h>
#include <string.h>

#define SETTING(NAME, KIND, MEMBER, ...)                                                                               \
    {                                                                                                                  \
        .name = NAME, .kind = UZ_OPTION_##KIND, .offset = offsetof(server_options, MEMBER), .places = OPTION_SETTING,  \
        __VA_ARGS__                                                                                                    \
    }
#define REQUEST(NAME, KIND, ...)                                                                                       \
    {                                                                                                                  \
        .name = NAME, .kind = UZ_OPTION_##KIND, .places = OPTION_REQUEST, __VA_ARGS__                                  \
    }

/* "https://host[:port]" as a browser sends it, or "*". */
static bool is_origin(const char *word)
{
    const char *host = strstr(word, "://");
    bool fits = host && (strncmp(word, "http://", 7) == 0 || strncmp(word, "https://", 8) == 0);
    return strcmp(word, "*") == 0 || (fits && host[3] && !strchr(host + 3, '/'));
}

/* "host" or "host:port", without a scheme. */
static bool is_host(const char *word)
{
    return !strchr(word, '/');
}

static const uz_option ROWS[] = {
    SETTING("listen", TEXT, listen, .value = "TEXT", .normal = "127.0.0.1:8080",
            .about = "HOST:PORT to listen on; [::1]:0 works too, port 0 takes a free one. An address that others can "
                     "reach needs a token-file"),
    SETTING("db", TEXT, db, .value = "FILE", .normal = "./contact.db",
            .about = "jobs and results are kept in this file"),
    SETTING("store", TEXT, store, .value = "URL", .normal = "",
            .about = "they are kept in a PostgreSQL database that several daemons share instead: "
                     "postgresql://USER@HOST/NAME; not together with db"),
    SETTING("node", TEXT, node, .value = "NAME", .normal = "",
            .about = "name of this daemon among those that share the store; without it host and port"),
    SETTING("affinity-s", NUMBER, affinity_s, .value = "S", .most = 3600, .normal = "5", .unit = "seconds",
            .zero_is_off = true,
            .about = "with several daemons, a job waits at most so long for the one that has its body's factor, or "
                     "because jobs of others go before it for that; 0: it does not"),
    SETTING("objects", TEXT, objects, .value = "URL", .normal = "",
            .about =
                "large results and uploads are kept in an object store with the S3 interface, not in the database: "
                "https://HOST/BUCKET or https://HOST/BUCKET/PREFIX; with PostgreSQL only, the same for all daemons"),
    SETTING("object-region", TEXT, object_region, .value = "TEXT", .normal = "us-east-1",
            .about = "region that requests to the object store are signed for"),
    SETTING("object-key-file", TEXT, object_key_file, .value = "FILE", .normal = "",
            .about = "one line \"ACCESS_KEY_ID SECRET_ACCESS_KEY\" of the object store, mode 600; without it they come "
                     "from AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"),
    SETTING("object-least", BYTES, object_least, .value = "BYTES", .least = 1, .normal = "256K", .unit = "bytes",
            .about = "what has fewer bytes stays in the database"),
    SETTING("config", TEXT, config, .value = "FILE", .normal = "",
            .about = "file with lines \"name = value\" for all options but this one"),
    SETTING("token-file", TEXT, token_file, .value = "FILE", .normal = "",
            .about = "lines \"name scope secret\": who may read, submit or admin; read again at SIGHUP. Without it "
                     "everybody may all"),
    SETTING("audit-log", TEXT, audit_log, .value = "FILE", .normal = "",
            .about = "append to this file who did what: a JSON object a line for each request that changes something "
                     "or was refused for its token"),
    SETTING("insecure-public", SWITCH, insecure_public, .normal = "no",
            .about = "listen on an address that others can reach although there is no token-file"),
    SETTING("tls-cert", TEXT, tls_cert, .value = "FILE", .normal = "",
            .about = "certificate chain (PEM): answer by HTTPS; needs tls-key"),
    SETTING("tls-key", TEXT, tls_key, .value = "FILE", .normal = "",
            .about =
                "private key (PEM) of tls-cert, which others must not be able to read; both are read again at SIGHUP"),
    SETTING("user", TEXT, user, .value = "TEXT", .normal = "",
            .about = "become this user once the port is taken, when started as root"),
    SETTING("workers", INTEGER, workers, .value = "N", .least = 1, .most = 1024,
            .otherwise = "as many as there are processors", .unit = "threads", .about = "problems solved at once"),
    SETTING("lanes", INTEGER, lanes, .value = "N", .most = 64, .normal = "1", .unit = "threads",
            .about = "more workers, which solve small problems only, while all others are busy"),
    SETTING(
        "threads", INTEGER, threads, .value = "N", .most = 1024, .normal = "0", .unit = "threads", .zero_is_off = true,
        .about = "of one solve, at most, where processors are idle, which jobs that run share out evenly; 0: all of "
                 "them"),
    SETTING("cache", BYTES, cache, .value = "BYTES", .least = 1,
            .otherwise = "a sixth of what the machine or its control group has, at least 1G", .unit = "bytes",
            .about = "memory for bodies that are kept; a quarter of it, at most 256M, lies ready for the next one"),
    SETTING("memory", BYTES, memory, .value = "BYTES", .least = 1,
            .otherwise = "80 % of what the machine or its control group has, less the cache, divided by the workers",
            .unit = "bytes", .about = "memory that one problem may take"),
    SETTING("max-solve-s", NUMBER, max_solve_s, .value = "S", .most = 1e9, .normal = "86400", .unit = "seconds",
            .zero_is_off = true,
            .about = "time that one job may take; it ends with the best answer so far, or fails where there is none; "
                     "0: no limit"),
    SETTING("group-command", TEXT, group_command, .value = "TEXT", .normal = "",
            .about =
                "what starts the processes of a solve with the operator distributed, by sh; {program} in it stands "
                "for uzawa-group: mpirun -n 4 {program}. Without it the operator is refused"),
    SETTING("max-queue", INTEGER, max_queue, .value = "N", .most = INT_MAX, .normal = "0", .unit = "jobs",
            .zero_is_off = true, .about = "jobs that may wait; one more is answered 503; 0: no limit"),
    SETTING("client-queue", INTEGER, client_queue, .value = "N", .most = INT_MAX, .normal = "0", .unit = "jobs",
            .zero_is_off = true,
            .about = "jobs of one owner of tokens that may wait; one more is answered 429; 0: no limit"),
    SETTING("client-bytes", BYTES, client_bytes, .value = "BYTES", .normal = "0", .unit = "bytes", .zero_is_off = true,
            .about = "requests, results and uploads of one owner of tokens; more are answered 429; 0: no limit"),
    SETTING("client-seconds", NUMBER, client_seconds, .value = "S", .most = 1e9, .normal = "0", .unit = "seconds",
            .zero_is_off = true,
            .about = "time of workers that jobs of one owner of tokens may take in a day (UTC), counted as they end; "
                     "then its submissions are answered 429; 0: no limit"),
    SETTING("max-attempts", INTEGER, max_attempts, .value = "N", .least = 1, .most = 1000, .normal = "3",
            .unit = "runs", .about = "runs of a job whose run ends with the process before it is failed"),
    SETTING("keep-days", NUMBER, keep_days, .value = "D", .most = 1e6, .normal = "0", .unit = "days",
            .zero_is_off = true, .about = "ended jobs are deleted so long after their end; 0: no limit"),
    SETTING("keep-jobs", INTEGER, keep_jobs, .value = "N", .most = INT_MAX, .normal = "0", .unit = "jobs",
            .zero_is_off = true, .about = "ended jobs that are kept; of more the oldest are deleted; 0: no limit"),
    SETTING("keep-bytes", BYTES, keep_bytes, .value = "BYTES", .normal = "0", .unit = "bytes", .zero_is_off = true,
            .about = "requests and results of ended jobs that are kept; of more the oldest are deleted; 0: no limit"),
    SETTING("max-upload", BYTES, max_upload, .value = "BYTES", .least = 1, .normal = "1G", .unit = "bytes",
            .about = "largest upload, after decompression"),
    SETTING("uploads", BYTES, uploads, .value = "BYTES", .least = 1, .normal = "10G", .unit = "bytes",
            .about = "all uploads together, in a folder beside the db with its name and \"-uploads\"; those that no "
                     "job uses make room"),
    SETTING("upload-days", NUMBER, upload_days, .value = "D", .most = 1e6, .normal = "30", .unit = "days",
            .zero_is_off = true,
            .about = "an upload that no job uses is deleted so long after it was last used; 0: it is kept"),
    SETTING("webhook-allow", LIST, webhook_allow, .value = "HOST", .most = OPTION_WORDS, .check = is_host,
            .wants = "host or host:port", .normal = "",
            .about = "HOST or HOST:PORT that jobs may ask to have their end told to; several: give it again, or spaces "
                     "between them. Without one nobody is called"),
    SETTING("webhook-secret-file", TEXT, webhook_secret_file, .value = "FILE", .normal = "",
            .about = "what is told is signed with the bytes of this file"),
    SETTING("cors", LIST, cors, .value = "ORIGIN", .most = OPTION_WORDS, .check = is_origin,
            .wants = "http://host[:port], https://host[:port] or *", .normal = "",
            .about = "pages of this origin (https://host[:port], or * for all) may use the service from a browser; "
                     "several: give it again, or spaces between them"),
    SETTING("max-connections", INTEGER, max_connections, .value = "N", .least = 1, .most = 100000, .normal = "1024",
            .unit = "connections", .about = "connections open at once"),
    SETTING("max-streams", INTEGER, max_streams, .value = "N", .least = 1, .most = 100000,
            .otherwise = "three quarters of max-connections", .unit = "streams",
            .about = "event streams open at once; they are connections too"),
    SETTING("max-client-connections", INTEGER, max_client_connections, .value = "N", .most = 100000,
            .otherwise = "a quarter of max-connections, on a loopback address 0", .unit = "connections",
            .zero_is_off = true,
            .about =
                "connections of one address open at once; 0: no limit of its own. Behind a proxy all clients are one"),
    SETTING("max-client-rate", INTEGER, max_client_rate, .value = "N", .most = 1000000, .normal = "10000",
            .unit = "requests per second", .zero_is_off = true,
            .about = "requests of one address, or of one token to all daemons, per second, twice as many at once; more "
                     "are answered "
                     "429; 0: no limit"),
    SETTING("max-body", BYTES, max_body, .value = "BYTES", .least = 1, .normal = "64M", .unit = "bytes",
            .about = "largest request body"),
    SETTING("max-json-depth", INTEGER, max_json_depth, .value = "N", .least = 8, .most = 64, .normal = "64",
            .unit = "levels", .about = "arrays and objects within each other in a request"),
    SETTING("max-dofs", COUNT, max_dofs, .value = "N", .least = 1, .normal = "100M", .unit = "dofs",
            .about = "d: degrees of freedom of a problem"),
    SETTING("max-rows", COUNT, max_rows, .value = "N", .least = 1, .normal = "100M", .unit = "rows",
            .about = "m: rows of N of a problem given as matrices"),
    SETTING("max-nonzeros", COUNT, max_nonzeros, .value = "N", .least = 1, .normal = "1000M", .unit = "entries",
            .about = "entries of K, and of N, of a problem given as matrices"),
    SETTING("request-deadline-s", NUMBER, request_deadline_s, .value = "S", .least = 0.1, .most = 1e6, .normal = "30",
            .unit = "seconds", .about = "time for a request to arrive, plus 1 s per 100 kB of its body"),
    SETTING("max-wait-s", NUMBER, max_wait_s, .value = "S", .most = 3600, .normal = "60", .unit = "seconds",
            .about = "longest wait that Prefer: wait is granted"),
    SETTING("drain-s", NUMBER, drain_s, .value = "S", .most = 1e6, .normal = "30", .unit = "seconds",
            .about = "time for running jobs to end after SIGTERM; then they are put back"),
    SETTING("log-level", LEVEL, level, .value = "LEVEL", .choices = OPTION_LEVELS, .normal = "info",
            .about = "debug, info, warn or error"),
    SETTING("access-log", SWITCH, access_log, .value = "yes|no", .normal = "yes",
            .about = "log a line for each request"),
    /* What is asked for instead of a run; `least` says what. */
    REQUEST("check-config", FLAG, .least = OPTIONS_CHECK,
            .about = "print the values in effect and where they come from, look at the files and the address that they "
                     "name, and end"),
    REQUEST("example-config", FLAG, .least = OPTIONS_EXAMPLE,
            .about = "print a configuration file with every option, and end"),
    REQUEST("check-db", FLAG, .least = OPTIONS_CHECK_DB,
            .about = "look whether the file of --db is whole, also while a daemon uses it, and end"),
    REQUEST("backup", WORD, .least = OPTIONS_BACKUP, .value = "FILE",
            .about = "copy the database to a new FILE, also while a daemon uses it, and end"),
    REQUEST(
        "move", WORD, .least = OPTIONS_MOVE, .value = "FILE",
        .about =
            "bring everything in FILE, which no daemon uses, into the database of PostgreSQL that --store, or a word "
            "behind FILE, names; compare both, and end. What is there already stays: it may be run again"),
    REQUEST("version", FLAG, .least = OPTIONS_VERSION),
    REQUEST("help", FLAG, .least = OPTIONS_HELP),
};
#define N_ROWS (sizeof ROWS / sizeof ROWS[0])
_Static_assert(N_ROWS <= OPTIONS_MAX, "server_options has room for the sources");

const uz_option_table DAEMON_OPTIONS = {ROWS, N_ROWS};
