/* A whole transport with handlers of our own, on a libmicrohttpd that keeps all that it says of a connection at one
 * place, as 1.0 does: what is asked next overwrites what was asked before. */
#include "harness.h"
#include "http/transport/transport.h"

#include <dlfcn.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

const union MHD_ConnectionInfo *MHD_get_connection_info(struct MHD_Connection *mhd, enum MHD_ConnectionInfoType type,
                                                        ...)
{
    typedef const union MHD_ConnectionInfo *ask(struct MHD_Connection *, enum MHD_ConnectionInfoType, ...);
    static _Thread_local union MHD_ConnectionInfo place;
    ask *real;
    *(void **)&real = dlsym(RTLD_NEXT, "MHD_get_connection_info");
    const union MHD_ConnectionInfo *found = real(mhd, type);
    if (!found)
        return NULL;
    switch (type) { /* all that the transport asks for without TLS */
    case MHD_CONNECTION_INFO_CONNECTION_FD:
        place.connect_fd = found->connect_fd;
        break;
    case MHD_CONNECTION_INFO_CLIENT_ADDRESS:
        place.client_addr = found->client_addr;
        break;
    case MHD_CONNECTION_INFO_SOCKET_CONTEXT:
        place.socket_context = found->socket_context;
        break;
    case MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE:
        place.header_size = found->header_size;
        break;
    case MHD_CONNECTION_INFO_HTTP_STATUS:
        place.http_status = found->http_status;
        break;
    default:
        return NULL;
    }
    return &place;
}

typedef struct {
    struct sockaddr_in peer; /* of the socket that a request says it came by */
    size_t address_len;
    atomic_int over;
} seen;

static bool let_in(void *ctx, http_request *rq)
{
    (void)ctx;
    return rq->fd >= 0;
}

static void answer(void *ctx, http_request *rq)
{
    seen *s = ctx;
    socklen_t len = sizeof s->peer;
    getpeername(rq->fd, (struct sockaddr *)&s->peer, &len);
    s->address_len = rq->address_len;
    reply_text(&rq->reply, 200, "text/plain", strdup("good"), 4);
}

static void account(void *ctx, const http_request *rq, bool completed, bool expired)
{
    seen *s = ctx;
    CHECK(completed && !expired && rq->status == 200);
    atomic_fetch_add(&s->over, 1);
}

static void drop(void *ctx, http_request *rq)
{
    (void)ctx;
    (void)rq;
}

TEST(a_request_knows_its_socket_and_address)
{
    static const char REQUEST[] = "GET / HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n";
    seen s = {.over = 0};
    char url[160], message[256] = "", got[1024] = "";
    transport *server;
    struct sockaddr_in own = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t own_len = sizeof own;
    const transport_handlers handlers = {
        .ctx = &s, .admit = let_in, .answer = answer, .account = account, .drop = drop};
    const transport_options options = {
        .feed = feed_new(), .body_budget = 1000, .max_connections = 4, .max_streams = 1, .request_deadline_s = 5};
    const int fd = http_listen("127.0.0.1:0", "http", url, sizeof url, message, sizeof message);
    CHECK_MSG(fd >= 0 && transport_start(&server, fd, &handlers, &options, message, sizeof message), "%s", message);
    own.sin_port = htons((uint16_t)atoi(strrchr(url, ':') + 1));
    const int client = socket(AF_INET, SOCK_STREAM, 0);
    CHECK(connect(client, (struct sockaddr *)&own, sizeof own) == 0);
    CHECK(getsockname(client, (struct sockaddr *)&own, &own_len) == 0);
    CHECK_INT(write(client, REQUEST, sizeof REQUEST - 1), sizeof REQUEST - 1);
    for (size_t at = 0, n = 1; n > 0 && at < sizeof got - 1; at += n) {
        const ssize_t more = read(client, got + at, sizeof got - 1 - at);
        n = more > 0 ? (size_t)more : 0;
    }
    close(client);
    transport_stop(server);
    CHECK_MSG(strncmp(got, "HTTP/1.1 200 ", 13) == 0 && strstr(got, "\r\n\r\ngood"), "%s", got);
    CHECK(s.peer.sin_port == own.sin_port && s.address_len == 4);
    CHECK_INT(atomic_load(&s.over), 1);
    feed_free(options.feed);
}
