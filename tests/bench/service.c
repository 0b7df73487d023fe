/* service.c: jobs of a daemon that was started a second ago with its default settings, over HTTP and with all that it
 * stores, in units of CHOLMOD's linear solve of the same K, which this process measures between two bodies. */
#include "bench/bench.h"
#include "core/clock.h"

#include <curl/curl.h>
#include <ftw.h>
#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { BODIES = BENCH_SERVICE_BODIES, FIRST = BENCH_SERVICE_FIRST, JOBS = 10, CELLS = 600, LAYERS = 200 };

typedef struct {
    char folder[PATH_MAX], url[256]; /* of POST /v1/jobs */
    pid_t process;
    CURL *curl; /* one connection, kept open */
    struct curl_slist *fields;
} daemon_process;

static int remove_one(const char *path, const struct stat *about, int kind, struct FTW *place)
{
    (void)about, (void)kind, (void)place;
    return remove(path);
}

static void daemon_end(daemon_process *daemon)
{
    curl_slist_free_all(daemon->fields);
    curl_easy_cleanup(daemon->curl);
    if (daemon->process > 0) {
        kill(daemon->process, SIGTERM);
        waitpid(daemon->process, NULL, 0);
    }
    if (*daemon->folder)
        nftw(daemon->folder, remove_one, 16, FTW_DEPTH | FTW_PHYS);
}

/* The uzawad beside this program, on a free port, with an empty database in a folder of its own beside it: on the same
 * disk, where /tmp may be memory. false: says why; daemon_end either way. */
static bool daemon_begin(daemon_process *daemon)
{
    char program[PATH_MAX + 16] = {0}, path[PATH_MAX + 16], line[256] = {0};
    int ends[2];
    *daemon = (daemon_process){.process = -1};
    if (readlink("/proc/self/exe", program, PATH_MAX - 64) < 0 || pipe(ends) != 0)
        return false;
    *strrchr(program, '/') = '\0';
    snprintf(daemon->folder, sizeof daemon->folder, "%.*s/bench-service-XXXXXX", PATH_MAX - 64, program);
    if (!mkdtemp(daemon->folder)) {
        *daemon->folder = '\0';
        return false;
    }
    strcat(program, "/uzawad");
    fflush(NULL);
    daemon->process = fork();
    if (daemon->process == 0) {
        dup2(ends[1], STDOUT_FILENO);
        close(ends[0]);
        snprintf(path, sizeof path, "%s/log", daemon->folder);
        if (freopen(path, "w", stderr)) {
            snprintf(path, sizeof path, "%s/contact.db", daemon->folder);
            execl(program, program, "--listen", "127.0.0.1:0", "--db", path, (char *)NULL);
        }
        _exit(127);
    }
    close(ends[1]);
    FILE *out = fdopen(ends[0], "r");
    const bool told = out && fgets(line, sizeof line, out) && strncmp(line, "listening on ", 13) == 0;
    if (out)
        fclose(out);
    if (!told) {
        printf("%s did not start\n", program);
        return false;
    }
    snprintf(daemon->url, sizeof daemon->url, "%.*s/v1/jobs", (int)strcspn(line + 13, "\n"), line + 13);
    daemon->curl = curl_easy_init();
    daemon->fields = curl_slist_append(NULL, "Content-Type: application/json");
    daemon->fields = curl_slist_append(daemon->fields, "Prefer: wait=60");
    return daemon->curl && daemon->fields;
}

static size_t collect(char *bytes, size_t size, size_t count, void *into)
{
    return fwrite(bytes, size, count, into) * size;
}

/* Seconds from the first byte of the request to the last one of the reply, which tells of a job that has ended and is
 * stored; the body has so many cells along it, the traction on its right side is in MPa. NAN: says why. */
static double seconds_of_job(daemon_process *daemon, int64_t cells, double traction)
{
    char request[1024], *reply = NULL;
    size_t size = 0;
    long code = 0;
    FILE *into = open_memstream(&reply, &size);
    snprintf(request, sizeof request,
             "{\"problem\": {\"kind\": \"scene\", \"model\": \"plane_stress\", \"thickness\": 5, "
             "\"mesh\": {\"box\": {\"size\": [60, 20], \"cells\": [%lld, %d], \"element\": \"quad4\"}}, "
             "\"materials\": [{\"on\": \"all\", \"young\": 200e3, \"poisson\": 0.3}], "
             "\"supports\": [{\"on\": \"left\", \"ux\": 0, \"uy\": 0}], "
             "\"loads\": [{\"on\": \"top\", \"traction\": [0, -0.05]}, {\"on\": \"right\", \"traction\": [%.3f, 0]}], "
             "\"contacts\": [{\"on\": \"bottom\", "
             "\"obstacle\": {\"plane\": {\"point\": [0, 0], \"normal\": [0, 1]}}}]}}",
             (long long)cells, LAYERS, traction);
    curl_easy_setopt(daemon->curl, CURLOPT_URL, daemon->url);
    curl_easy_setopt(daemon->curl, CURLOPT_PROXY, "");
    curl_easy_setopt(daemon->curl, CURLOPT_HTTPHEADER, daemon->fields);
    curl_easy_setopt(daemon->curl, CURLOPT_POSTFIELDS, request);
    curl_easy_setopt(daemon->curl, CURLOPT_WRITEFUNCTION, collect);
    curl_easy_setopt(daemon->curl, CURLOPT_WRITEDATA, into);
    const double start = uz_seconds();
    const CURLcode sent = into ? curl_easy_perform(daemon->curl) : CURLE_OUT_OF_MEMORY;
    double seconds = uz_seconds() - start;
    if (into)
        fclose(into);
    curl_easy_getinfo(daemon->curl, CURLINFO_RESPONSE_CODE, &code);
    json_t *job = reply ? json_loadb(reply, size, 0, NULL) : NULL;
    const char *outcome = json_string_value(json_object_get(json_object_get(job, "summary"), "outcome"));
    if (sent != CURLE_OK || code != 200 || !outcome || strcmp(outcome, "converged") != 0) {
        printf("a job of %lld x %d cells did not converge: %s, status %ld: %.400s\n", (long long)cells, LAYERS,
               curl_easy_strerror(sent), code, reply ? reply : "");
        seconds = NAN;
    }
    json_decref(job);
    free(reply);
    return seconds;
}

/* CHOLMOD's solve of the body's K; decide: with the better ordering, which is then remembered. */
static bool linear_of(bench_linear *linear, bench_ordering *ordering, bool decide, int64_t cells)
{
    uz_scene scene = bench_paper_scene(cells);
    uz_qp qp = {0};
    uz_error err;
    scene.box.cells[1] = LAYERS;
    const bool ok = uz_scene_to_qp(&qp, NULL, &scene, &err) == UZ_OK;
    if (ok && decide)
        *ordering = bench_better_ordering(&qp.K, qp.p);
    if (ok)
        *linear = bench_cholmod(&qp.K, qp.p, *ordering);
    uz_qp_clear(&qp);
    uz_scene_clear(&scene);
    return ok;
}

/* Bodies of 600 to 619 cells, none of which comes twice, in an order that is not of their sizes; ten jobs on each, each
 * with a load of its own. */
bool bench_service(bench_service_cost *out)
{
    double cold[BODIES], second[BODIES], tenth[BODIES], cold_seconds[BODIES], second_seconds[BODIES],
        tenth_seconds[BODIES], whole[BODIES], factored[BODIES], solve[BODIES];
    daemon_process daemon;
    bench_ordering ordering = BENCH_AMD;
    bench_linear linear;
    /* The largest body first: this process has then touched all the memory that it needs. */
    bool ok = linear_of(&linear, &ordering, true, CELLS + BODIES - 1) && daemon_begin(&daemon);
    sleep(1);
    for (int k = 0; ok && k < BODIES; k++) {
        const int64_t cells = CELLS + 7 * k % BODIES;
        double seconds[JOBS];
        for (int job = 0; ok && job < JOBS; job++) {
            seconds[job] = seconds_of_job(&daemon, cells, 0.5 + 0.01 * job);
            ok = !isnan(seconds[job]);
        }
        ok = ok && linear_of(&linear, &ordering, false, cells);
        if (!ok)
            break;
        whole[k] = linear.analyze + linear.factorize + linear.solve;
        factored[k] = linear.factorize + linear.solve;
        solve[k] = 1e3 * linear.solve;
        cold_seconds[k] = seconds[0];
        second_seconds[k] = 1e3 * seconds[1];
        tenth_seconds[k] = 1e3 * seconds[JOBS - 1];
        cold[k] = seconds[0] / whole[k];
        second[k] = seconds[1] / linear.solve;
        tenth[k] = seconds[JOBS - 1] / linear.solve;
    }
    daemon_end(&daemon);
    if (ok) {
        out->first = bench_summarise(cold, FIRST); /* those that find no memory ready; sorted among themselves only */
        out->later = bench_summarise(cold + FIRST, BODIES - FIRST);
        out->cold = bench_summarise(cold, BODIES);
        out->second = bench_summarise(second, BODIES);
        out->tenth = bench_summarise(tenth, BODIES);
        out->cold_s = bench_summarise(cold_seconds, BODIES);
        out->linear_s = bench_summarise(whole, BODIES);
        out->factored_s = bench_summarise(factored, BODIES);
        out->second_ms = bench_summarise(second_seconds, BODIES);
        out->tenth_ms = bench_summarise(tenth_seconds, BODIES);
        out->solve_ms = bench_summarise(solve, BODIES);
    }
    return ok;
}
