/* main.c: the daemon from its command line to its exit status.
 *
 * exit status: 0 ended by a signal, 1 could not start or failed, 2 wrong usage. */
#include "codec/codec.h"
#include "http/http.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/metrics.h"
#include "options/options.h"
#include "privileges.h"
#include "store/engine_base.h"
#include "store/engines/engines.h"
#include "store/move.h"
#include "store/nodes.h"
#include "store/objects/objects.h"
#include "text/streams.h"
#include "uzawa.h"
#include "work/solver_process.h"
#include "work/webhook.h"
#include "work/work.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { EXIT_ENDED = 0, EXIT_FAILED = 1, EXIT_USAGE = 2 };

static const double LEASE_S = 60;
/* Small jobs that a claim takes beside its own, for the next claims of this daemon: a claim costs more than they do. */
enum { CLAIMS_AHEAD = 7 };
static const double AHEAD_S = 0.5;

typedef struct {
    server_log log, audit; /* audit: who did what; its stream NULL: not kept */
    metrics *metrics;
    char node[STORE_NODE]; /* the name of this daemon */
    store *store;
    objects *objects; /* NULL: everything is in the store's own place */
    work *work;
    webhooks *webhooks;
    http_server http;
    auth *auth; /* NULL: no token file */
    http_tls tls;
    option_words origins, callable; /* --cors, --webhook-allow */
    webhook_options hooks;
    option_limit named[OPTIONS_MAX]; /* what limits points into */
    codec_limit limits[OPTIONS_MAX];
    sigset_t signals; /* taken by sigwait in main, blocked in every thread */
} service;

/* The daemon computes by one thread of OpenBLAS, which starts others before main: where memory is short they look for
 * room for ever, and exit waits for them. Once started anew it has none; processes that solve have the environment that
 * it was given. */
static void start_without_blas_threads(bool anew)
{
    static const char THREADS[] = "OPENBLAS_NUM_THREADS", GIVEN[] = "UZAWAD_OPENBLAS_NUM_THREADS";
    const char *threads = getenv(THREADS), *given = getenv(GIVEN);
    if (anew) {
        setenv(GIVEN, threads ? threads : "", 1);
        setenv(THREADS, "1", 1);
    } else if (given) {
        if (given[0])
            setenv(THREADS, given, 1);
        else
            unsetenv(THREADS);
        unsetenv(GIVEN);
    }
}

/* The signals are blocked in every thread, since METIS installs its own SIGTERM and SIGABRT handlers while it orders
 * and jumps out of them: blocked everywhere, these signals can't reach it. Threads that libraries start before main
 * (those of OpenBLAS) inherit nothing of this, but the signal mask survives exec: so the program starts itself once
 * more. */
static void own_signals(char **argv, sigset_t *signals)
{
    sigset_t before, internal; /* internal: between the drain's threads */
    sigemptyset(signals);
    sigaddset(signals, SIGTERM);
    sigaddset(signals, SIGINT);
    sigaddset(signals, SIGHUP);
    sigaddset(signals, SIGABRT);
    pthread_sigmask(SIG_BLOCK, signals, &before);
    sigemptyset(&internal);
    sigaddset(&internal, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &internal, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); /* a limit on the size of files is then met as a full disk is */
    const bool anew = !sigismember(&before, SIGTERM) || !sigismember(&before, SIGABRT);
    start_without_blas_threads(anew);
    if (!anew)
        return;
    char path[4096];
    ssize_t len = readlink("/proc/self/exe", path, sizeof path - 1);
    if (len > 0) {
        path[len] = '\0';
        execv(path, argv); /* returns only on failure: then it runs as it is */
    }
    start_without_blas_threads(false);
}

/* An address that others can reach needs tokens, or a word that says it is meant. */
static bool check_exposure(service *s, const server_options *options, int fd, char *message, size_t size)
{
    if (!http_is_public(fd))
        return true;
    if (!s->auth && !options->insecure_public) {
        snprintf(
            message, size,
            "others can reach %s, and everybody could submit and delete jobs there: give --token-file FILE, listen "
            "on 127.0.0.1 behind a proxy, or say --insecure-public",
            options->listen);
        return false;
    }
    if (!options->tls_cert[0])
        log_write(&s->log, LOG_WARN, "public_without_tls", (log_field[]){LOG_S("listen", options->listen), {0}});
    return true;
}

/* While the process may: later it may be another user. */
static bool read_secrets(service *s, const server_options *options, char *message, size_t size)
{
    if (options->token_file[0] && !(s->auth = auth_new(options->token_file, message, size)))
        return false;
    if (options->webhook_secret_file[0] && !webhook_read_secret(&s->hooks, options->webhook_secret_file, message, size))
        return false;
    if (options->audit_log[0]) {
        const int fd = open(options->audit_log, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0600);
        const bool ready = fd >= 0 && fcntl(fd, F_SETFL, O_APPEND) == 0; /* only its opening does not wait */
        s->audit = (server_log){
            .lock = PTHREAD_MUTEX_INITIALIZER, .stream = ready ? fdopen(fd, "a") : NULL, .least = LOG_INFO};
        if (!s->audit.stream) {
            snprintf(message, size, "cannot write the audit log %s: %s", options->audit_log, strerror(errno));
            return false;
        }
    }
    return !options->tls_cert[0] || http_tls_read(&s->tls, options->tls_cert, options->tls_key, message, size);
}

/* --node, or else the host's name and the port that was taken. */
static void name_node(service *s, const server_options *options, const char *url)
{
    char host[STORE_NODE - 8] = "";
    gethostname(host, sizeof host - 1);
    if (options->node[0])
        snprintf(s->node, sizeof s->node, "%.*s", (int)sizeof s->node - 1, options->node);
    else
        snprintf(s->node, sizeof s->node, "%s%s", host, strrchr(url, ':') ? strrchr(url, ':') : "");
}

/* While the process may read the keys. */
static bool reach_objects(service *s, const server_options *options, char *message, size_t size)
{
    const objects_options o = {.url = options->objects,
                               .region = options->object_region,
                               .key_file = options->object_key_file,
                               .least = (int64_t)options->object_least,
                               .metrics = s->metrics};
    if (!options->objects[0])
        return true;
    if (!store_engine_of(options_address(options))->collect) {
        snprintf(message, size, "--objects needs --store postgresql://...: a file keeps everything beside it");
        return false;
    }
    s->objects = objects_open(&o, message, size);
    return s->objects != NULL;
}

/* The store and those who work on it. */
static bool start_work(service *s, const server_options *options, char *message, size_t size)
{
    const store_settings settings = {.metrics = s->metrics,
                                     .objects = s->objects,
                                     .max_queue = options->max_queue,
                                     .affinity_s = options->affinity_s,
                                     .claims_ahead = CLAIMS_AHEAD,
                                     .ahead_s = AHEAD_S,
                                     .quotas = {.waiting = options->client_queue,
                                                .bytes = (int64_t)options->client_bytes,
                                                .seconds = options->client_seconds},
                                     .uploads = {.one = (int64_t)options->max_upload,
                                                 .all = (int64_t)options->uploads,
                                                 .keep_s = options->upload_days * 86400}};
    const work_options workers = {.node = s->node,
                                  .version = UZAWAD_VERSION,
                                  .workers = options->workers,
                                  .lanes = options->lanes,
                                  .threads = options->threads,
                                  .max_attempts = options->max_attempts,
                                  .cache_bytes = options->cache,
                                  .solve_bytes = options->memory,
                                  .max_solve_s = options->max_solve_s,
                                  .group_command = options->group_command,
                                  .metrics = s->metrics,
                                  .lease_s = LEASE_S,
                                  .retention = {.keep_s = options->keep_days * 86400,
                                                .keep_jobs = options->keep_jobs,
                                                .keep_bytes = (int64_t)options->keep_bytes}};
    s->store = store_open(options_address(options), message, size);
    if (!s->store)
        return false;
    s->store->settings = settings;
    if (s->store->missing)
        log_write(&s->log, LOG_ERROR, "commits_missing", (log_field[]){LOG_S("cause", s->store->missing), {0}});
    s->work = work_start(s->store, &workers, &s->log, message, size);
    if (!s->work)
        return false;
    options_split(&s->callable, options->webhook_allow);
    s->hooks.allow = s->callable.words;
    s->hooks.n_allow = s->callable.n;
    s->hooks.metrics = s->metrics;
    s->webhooks = webhooks_start(s->store, &s->hooks, &s->log, message, size);
    return s->webhooks != NULL;
}

/* Owns fd, also on failure. */
static bool start_http(service *s, const server_options *options, int fd, char *message, size_t size)
{
    const http_parts parts = {.store = s->store,
                              .work = s->work,
                              .webhooks = s->webhooks,
                              .log = &s->log,
                              .audit = s->audit.stream ? &s->audit : NULL,
                              .metrics = s->metrics,
                              .auth = s->auth};
    options_split(&s->origins, options->cors);
    const size_t n_limits = options_limits(options, s->named, OPTIONS_MAX); /* for GET /v1/limits */
    for (size_t i = 0; i < n_limits; i++)
        s->limits[i] = (codec_limit){s->named[i].name, s->named[i].unit, s->named[i].meaning, s->named[i].value};
    const http_options limits = {.max_body = options->max_body,
                                 .max_upload = options->max_upload,
                                 .cors = s->origins.words,
                                 .n_cors = s->origins.n,
                                 .max_connections = (unsigned)options->max_connections,
                                 .max_streams = (unsigned)options->max_streams,
                                 .request_deadline_s = options->request_deadline_s,
                                 .max_wait_s = options->max_wait_s,
                                 .max_client_connections = (unsigned)options->max_client_connections,
                                 .max_client_rate = options->max_client_rate,
                                 .tls = s->tls.cert ? &s->tls : NULL,
                                 .access_log = options->access_log,
                                 .limits = s->limits,
                                 .n_limits = n_limits};
    return http_start(&s->http, fd, &parts, &limits, message, size);
}

static bool start(service *s, const server_options *options, char *url, size_t url_size, char *message, size_t size)
{
    struct rlimit descriptors;
    memory_keep_heap(); /* how much of it lies free is the housekeeper's business */
    if (getrlimit(RLIMIT_NOFILE, &descriptors) == 0) {
        descriptors.rlim_cur = descriptors.rlim_max;
        setrlimit(RLIMIT_NOFILE, &descriptors);
    }
    const codec_limits limits = {.json_depth = options->max_json_depth,
                                 .dofs = (int64_t)options->max_dofs,
                                 .rows = (int64_t)options->max_rows,
                                 .nonzeros = (int64_t)options->max_nonzeros};
    if (!codec_init(&limits, message, size))
        return false;
    uz_process_init(options->workers + 1); /* fields of results are computed here */
    if (!read_secrets(s, options, message, size) || !reach_objects(s, options, message, size))
        return false;
    /* The port is taken before any job runs, so that a second daemon fails without a trace; and before the privileges
     * go that a low port needs. */
    int fd = http_listen(options->listen, s->tls.cert ? "https" : "http", url, url_size, message, size);
    if (fd < 0)
        return false;
    name_node(s, options, url);
    if (!check_exposure(s, options, fd, message, size) ||
        (options->user[0] && !privileges_drop(options->user, message, size)) ||
        !start_work(s, options, message, size)) {
        close(fd);
        return false;
    }
    if (s->auth && access(options->token_file, R_OK) != 0) /* now, as the user that the process has become */
        log_write(&s->log, LOG_WARN, "tokens_not_readable_again",
                  (log_field[]){LOG_S("file", options->token_file),
                                LOG_S("user", options->user),
                                LOG_S("cause", strerror(errno)),
                                {0}});
    return start_http(s, options, fd, message, size);
}

static void forget_secrets(service *s)
{
    auth_free(s->auth);
    http_tls_clear(&s->tls);
    webhook_forget_secret(&s->hooks);
    if (s->audit.stream)
        fclose(s->audit.stream);
}

/* Legal at every stage of a start that failed. */
static void end(service *s)
{
    http_stop(&s->http);
    webhooks_stop(s->webhooks);
    if (s->work) {
        work_stop(s->work, 0);
        work_free(s->work);
    }
    if (s->store)
        store_close(s->store);
    objects_close(s->objects);
    forget_secrets(s);
    codec_end();
}

/* ------------------------------------------------------------------- drain */

typedef struct {
    work *work;
    double seconds;
    pthread_t waker; /* told by SIGUSR1 that the work has stopped */
} drain;

static void *drain_work(void *argument)
{
    drain *d = argument;
    work_stop(d->work, d->seconds);
    pthread_kill(d->waker, SIGUSR1);
    return NULL;
}

/* Lets running jobs end; a second signal asks for it now. The work stops in its own thread, so that this one can take
 * the signal. */
static void drain_until_stopped(service *s, double seconds)
{
    pthread_t thread;
    drain d = {.work = s->work, .seconds = seconds, .waker = pthread_self()};
    sigset_t expected = s->signals;
    int taken = 0;
    sigaddset(&expected, SIGUSR1);
    transport_drain(s->http.transport);
    if (pthread_create(&thread, NULL, drain_work, &d) != 0) {
        work_stop(s->work, seconds);
        return;
    }
    while (sigwait(&expected, &taken) == 0 && taken != SIGUSR1) {
        log_write(&s->log, LOG_INFO, "drain_cut_short", (log_field[]){{0}});
        work_stop(s->work, 0);
    }
    pthread_join(thread, NULL);
}

static int run(service *s, const server_options *options)
{
    char url[160], message[2 * OPTION_PATH + 512] = "";
    if (!start(s, options, url, sizeof url, message, sizeof message)) {
        fprintf(stderr, "uzawad: %s\n", message);
        end(s);
        return EXIT_FAILED;
    }
    printf("listening on %s\n", url);
    fflush(stdout);
    log_write(&s->log, LOG_INFO, "started",
              (log_field[]){LOG_S("url", url),
                            LOG_S("db", options_address(options)),
                            LOG_I("workers", options->workers),
                            LOG_S("version", UZAWAD_VERSION),
                            {0}});
    /* SIGHUP reads the tokens and the certificate anew, each stays as it was where its files are wrong; where there is
     * nothing to read it ends the daemon, as for every program of a terminal */
    int taken = 0;
    while (sigwait(&s->signals, &taken) != 0 || (taken == SIGHUP && (s->auth || s->tls.cert))) {
        if (taken == SIGHUP && s->auth && auth_reload(s->auth, message, sizeof message))
            log_write(&s->log, LOG_INFO, "tokens_reloaded", (log_field[]){{0}});
        else if (taken == SIGHUP && s->auth)
            log_write(&s->log, LOG_ERROR, "tokens_kept", (log_field[]){LOG_S("cause", message), {0}});
        http_tls fresh = {NULL, NULL};
        if (taken == SIGHUP && s->tls.cert &&
            http_tls_read(&fresh, options->tls_cert, options->tls_key, message, sizeof message) &&
            transport_use_tls(s->http.transport, &fresh, message, sizeof message))
            log_write(&s->log, LOG_INFO, "certificate_reloaded", (log_field[]){{0}});
        else if (taken == SIGHUP && s->tls.cert)
            log_write(&s->log, LOG_ERROR, "certificate_kept", (log_field[]){LOG_S("cause", message), {0}});
        http_tls_clear(&fresh);
        taken = 0;
    }
    if (taken == SIGABRT) /* somebody wants a core file */
        abort();
    log_write(&s->log, LOG_INFO, "stopping", (log_field[]){LOG_S("signal", strsignal(taken)), {0}});
    drain_until_stopped(s, options->drain_s);
    end(s);
    log_write(&s->log, LOG_INFO, "stopped", (log_field[]){{0}});
    return EXIT_ENDED;
}

/* --check-config: the values, and whether a daemon could start with them: the files that it reads, and its address. */
static int check_config(const server_options *options)
{
    char message[OPTION_PATH + 512] = "", address[OPTION_PATH], url[160];
    service s = {.log = {.lock = PTHREAD_MUTEX_INITIALIZER, .stream = stderr, .least = LOG_ERROR}};
    options_show(options, stdout);
    /* the address with a free port: the daemon that it is meant for may be running */
    snprintf(address, sizeof address, "%s", options->listen);
    char *port = strrchr(address, ':');
    if (port && port[1] && !port[1 + strspn(port + 1, "0123456789")] && atol(port + 1) <= 65535)
        strcpy(port + 1, "0");
    const bool secrets =
        read_secrets(&s, options, message, sizeof message) && reach_objects(&s, options, message, sizeof message);
    const int fd = secrets ? http_listen(address, "http", url, sizeof url, message, sizeof message) : -1;
    const bool good = fd >= 0 && check_exposure(&s, options, fd, message, sizeof message);
    if (fd >= 0)
        close(fd);
    if (!good)
        fprintf(stderr, "uzawad: %s\n", message);
    objects_close(s.objects);
    forget_secrets(&s);
    return good ? EXIT_ENDED : EXIT_FAILED;
}

/* --check-db */
static int check_db(const char *path)
{
    char message[OPTION_PATH + 512] = "";
    store_findings found;
    if (!store_check_file(path, &found, message, sizeof message)) {
        fprintf(stderr, "uzawad: %s\n", message);
        return EXIT_FAILED;
    }
    bool whole = found.findings[0] == '\0';
    if (whole)
        printf("%s is whole: %lld jobs, checked in %.3g s\n", path, (long long)found.jobs, found.seconds);
    else
        fprintf(
            stderr,
            "uzawad: %s is damaged:\n%sKeep the file, and go on with a backup or a new file; sqlite3's .recover can "
            "save what is readable.\n",
            path, found.findings);
    free(found.findings);
    return whole ? EXIT_ENDED : EXIT_FAILED;
}

/* --move */
static int move_file(const server_options *options, const char *path)
{
    service s = {0};
    char message[OPTION_PATH + 700] = "";
    move_report found = {.jobs = 0};
    bool good = false;
    store *from = NULL;
    if (store_engine_of(path)->scheme[0] || !store_engine_of(options_address(options))->scheme[0])
        snprintf(message, sizeof message,
                 "--move takes a file, and the database of PostgreSQL that it goes into: --move "
                 "FILE postgresql://USER@HOST/NAME");
    else if (access(path, R_OK | W_OK) != 0)
        snprintf(message, sizeof message, "%s: %s", path, strerror(errno));
    else if ((from = store_open(path, message, sizeof message)) && reach_objects(&s, options, message, sizeof message))
        s.store = store_open(options_address(options), message, sizeof message);
    if (s.store) {
        s.store->settings.objects = s.objects;
        good = store_move(from, s.store, &found, message, sizeof message);
    }
    store_close(s.store);
    store_close(from);
    objects_close(s.objects);
    if (good)
        printf(
            "%s: %lld jobs and %lld uploads, %lld bytes, are in the database as they were; %lld and %lld of them were "
            "there before\n",
            path, (long long)found.jobs, (long long)found.uploads, (long long)found.bytes,
            (long long)(found.jobs - found.jobs_new), (long long)(found.uploads - found.uploads_new));
    else
        fprintf(stderr, "uzawad: %s\n", message);
    return good ? EXIT_ENDED : EXIT_FAILED;
}

int main(int argc, char **argv)
{
    server_options options;
    char message[2 * OPTION_PATH + 512], backup[OPTION_PATH];
    int64_t bytes = 0;
    if (argc > 1 && strcmp(argv[1], SOLVER_ROLE) == 0)
        return solver_process(argc, argv);
    uz_hold_standard_streams();
    switch (options_read(&options, argc, argv, backup, message, sizeof message)) {
    case OPTIONS_HELP:
        options_usage(stdout);
        return EXIT_ENDED;
    case OPTIONS_VERSION:
        printf("uzawad %s\n", UZAWAD_VERSION);
        return EXIT_ENDED;
    case OPTIONS_CHECK:
        return check_config(&options);
    case OPTIONS_EXAMPLE:
        options_example(stdout);
        return EXIT_ENDED;
    case OPTIONS_WRONG:
        fprintf(stderr, "uzawad: %s\n%s", message, "usage: uzawad [OPTION]...; uzawad --help lists them\n");
        return EXIT_USAGE;
    case OPTIONS_CHECK_DB:
        return check_db(options_address(&options));
    case OPTIONS_BACKUP:
        if (!store_backup_file(options_address(&options), backup, &bytes, message, sizeof message)) {
            fprintf(stderr, "uzawad: %s\n", message);
            return EXIT_FAILED;
        }
        printf("%s: %lld bytes\n", backup, (long long)bytes);
        return EXIT_ENDED;
    case OPTIONS_MOVE:
        return move_file(&options, backup);
    case OPTIONS_RUN:
        break;
    }
    service s = {0};
    own_signals(argv, &s.signals);
    s.log = (server_log){.lock = PTHREAD_MUTEX_INITIALIZER, .stream = stderr, .least = (log_level)options.level};
    s.metrics = metrics_new();
    if (!s.metrics) {
        fprintf(stderr, "uzawad: no memory\n");
        return EXIT_FAILED;
    }
    int status = run(&s, &options);
    metrics_free(s.metrics);
    return status;
}
