/* load.c: many keep-alive clients at once against a running daemon; prints one line of JSON.
 *
 * usage: load PORT CLIENTS SECONDS BODY_FILE [PREFER]
 * Each client posts the body to /v1/jobs, waits for the reply and posts again, until the time is over. PREFER is the
 * value of a Prefer header field ("wait=30": the reply comes when the job has ended). Latencies are from the first byte
 * sent to the last byte received. A client connects again where a reply announces that its connection ends: one that
 * was waited for long does. Exit status 1 if a client met anything but 200 and 202. */
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { ROOM = 65536 };

typedef struct {
    int fd;
    size_t sent, got;
    double begun;
    bool closes; /* the last reply said that the connection ends with it */
    char in[ROOM];
} client;

typedef struct {
    char *message; /* head and body of each request */
    size_t len;
    double *latency; /* count of capacity, seconds */
    size_t count, capacity, ended, refused, broken;
} load;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static bool make_message(load *l, const char *path, const char *prefer)
{
    FILE *file = fopen(path, "rb");
    char *body = malloc(1 << 20);
    size_t size = file && body ? fread(body, 1, 1 << 20, file) : 0;
    if (file)
        fclose(file);
    FILE *out = size > 0 ? open_memstream(&l->message, &l->len) : NULL;
    if (!out) {
        free(body);
        return false;
    }
    fprintf(out, "POST /v1/jobs HTTP/1.1\r\nHost: load\r\nContent-Type: application/json\r\nContent-Length: %zu\r\n",
            size);
    if (prefer)
        fprintf(out, "Prefer: %s\r\n", prefer);
    fputs("\r\n", out);
    fwrite(body, 1, size, out);
    free(body);
    return fclose(out) == 0;
}

static bool connect_client(client *c, int port)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((unsigned short)port)};
    int on = 1;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    c->fd = socket(AF_INET, SOCK_STREAM, 0);
    return c->fd >= 0 && connect(c->fd, (struct sockaddr *)&to, sizeof to) == 0 &&
           setsockopt(c->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0 && fcntl(c->fd, F_SETFL, O_NONBLOCK) == 0;
}

/* Bytes of the reply once it is complete, 0 before. */
static size_t reply_size(const client *c)
{
    const char *end = strstr(c->in, "\r\n\r\n");
    if (!end)
        return 0;
    const char *field = strcasestr(c->in, "\r\ncontent-length:");
    size_t body = field && field < end ? strtoul(field + 17, NULL, 10) : 0, all = (size_t)(end - c->in) + 4 + body;
    return c->got >= all ? all : 0;
}

static void note(load *l, client *c)
{
    if (l->count == l->capacity) {
        l->capacity = l->capacity ? 2 * l->capacity : 65536;
        l->latency = realloc(l->latency, l->capacity * sizeof *l->latency);
        if (!l->latency)
            abort();
    }
    l->latency[l->count++] = now() - c->begun;
    int status = atoi(c->in + 9);
    l->ended += status == 200;
    l->refused += status != 200 && status != 202;
    c->closes = strcasestr(c->in, "\r\nconnection: close") != NULL;
}

/* Sends and receives what can be done now; false once the connection is broken. */
static bool go_on(load *l, client *c, bool again)
{
    for (;;) {
        if (c->sent == 0)
            c->begun = now();
        while (c->sent < l->len) {
            ssize_t n = send(c->fd, l->message + c->sent, l->len - c->sent, MSG_NOSIGNAL);
            if (n < 0)
                return errno == EAGAIN;
            c->sent += (size_t)n;
        }
        ssize_t n = recv(c->fd, c->in + c->got, ROOM - 1 - c->got, 0);
        if (n <= 0)
            return n < 0 && errno == EAGAIN;
        c->got += (size_t)n;
        c->in[c->got] = '\0';
        if (reply_size(c) == 0)
            continue;
        note(l, c);
        c->sent = c->got = 0;
        if (!again || c->closes)
            return false;
    }
}

static void watch(int poll, client *c)
{
    epoll_ctl(poll, EPOLL_CTL_ADD, c->fd, &(struct epoll_event){.events = EPOLLIN | EPOLLOUT | EPOLLET, .data.ptr = c});
}

static void run(load *l, client *clients, int n, int port, double seconds)
{
    int poll = epoll_create1(0), open = n;
    struct epoll_event events[64];
    for (int i = 0; i < n; i++)
        watch(poll, &clients[i]);
    double end = now() + seconds;
    while (open > 0 && now() < end + 60) {
        int found = epoll_wait(poll, events, 64, 1000);
        for (int i = 0; i < found; i++) {
            client *c = events[i].data.ptr;
            bool again = now() < end;
            size_t before = l->count;
            if (c->fd < 0 || go_on(l, c, again))
                continue;
            const bool announced = c->closes;
            l->broken += (again && !announced) || l->count == before;
            close(c->fd);
            c->closes = false;
            if (again && announced && connect_client(c, port)) {
                watch(poll, c);
                continue;
            }
            c->fd = -1;
            open--;
        }
    }
    l->broken += (size_t)open;
    close(poll);
}

int main(int argc, char **argv)
{
    load l = {0};
    if (argc < 5 || !make_message(&l, argv[4], argc > 5 ? argv[5] : NULL)) {
        fprintf(stderr, "usage: load PORT CLIENTS SECONDS BODY_FILE [PREFER]\n");
        return 2;
    }
    int n = atoi(argv[2]);
    client *clients = calloc((size_t)n, sizeof *clients);
    for (int i = 0; i < n; i++)
        if (!clients || !connect_client(&clients[i], atoi(argv[1]))) {
            perror("load: connect");
            return 1;
        }
    double begun = now();
    run(&l, clients, n, atoi(argv[1]), atof(argv[3]));
    double took = now() - begun;
    qsort(l.latency, l.count, sizeof *l.latency, by_value);
    double p50 = l.count ? l.latency[l.count / 2] : 0, p99 = l.count ? l.latency[l.count - 1 - l.count / 100] : 0;
    printf("{\"requests\": %zu, \"ended\": %zu, \"refused\": %zu, \"broken\": %zu, \"per_s\": %.1f, \"p50_ms\": %.2f, "
           "\"p99_ms\": %.2f, \"max_ms\": %.2f}\n",
           l.count, l.ended, l.refused, l.broken, (double)l.count / took, 1e3 * p50, 1e3 * p99,
           l.count ? 1e3 * l.latency[l.count - 1] : 0);
    free(clients);
    free(l.latency);
    free(l.message);
    return l.refused || l.broken ? 1 : 0;
}
