/* admission.c: what is refused before a body is read, cheapest check first. */

#include "http/api.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* ---- names that are not ours */

/* The name of a Host field or of an origin, "//name:port": what stands before the port. */
static size_t name_len(const char *text, size_t len)
{
    const char *colon = memchr(text, ':', len);
    return colon ? (size_t)(colon - text) : len;
}

/* Without tokens it is the loopback address that lets nobody in. A page gets behind it where its own host name is made
 * to point here (DNS rebinding): for its visitor's browser this service is then the page's own server. The name that
 * it asks for tells: nobody can lead an address here from elsewhere, a name without a dot, localhost and what is below
 * it (RFC 6761, section 6.3), or the hosts of --cors. */
static bool check_name(const api *context, const http_request *rq, problem_details *problem)
{
    static const char LOCAL[] = ".localhost";
    /* header fields that a browser sends whatever its page wants; other programs hardly do */
    static const char *const SENT[] = {"Accept-Language", "Origin", "Referer", "Sec-Fetch-Site"};
    const header_field *field = header_find(&rq->headers, "Host", NULL);
    const header_field *agent = header_find(&rq->headers, "User-Agent", NULL);
    if (context->auth || !field)
        return true;
    const char *host = field->value;
    const size_t n = name_len(host, field->value_len), local = sizeof LOCAL - 1;
    bool own = field->value_len == 0 || host[0] == '[' || !memchr(host, '.', n) || strspn(host, "0123456789.") >= n ||
               (n > local && token_equal(host + n - local, local, LOCAL));
    for (size_t i = 0; i < context->options.n_cors && !own; i++) {
        const char *one = context->options.cors[i], *name = strstr(one, "//");
        const size_t size = name ? name_len(name + 2, strlen(name + 2)) : 0;
        own = strcmp(one, "*") == 0 || (size == n && strncasecmp(name + 2, host, n) == 0);
    }
    bool browser = agent && agent->value_len >= 8 && strncasecmp(agent->value, "Mozilla/", 8) == 0;
    for (size_t i = 0; i < sizeof SENT / sizeof SENT[0]; i++)
        browser = browser || header_find(&rq->headers, SENT[i], NULL);
    if (own || !browser || http_is_public(rq->fd))
        return true;
    return problem_fill(problem, 421, "unknown_host", "This service does not go by that name",
                        "a browser asks for \"%.*s\" on an address that is for this machine only: use "
                        "http://127.0.0.1 or localhost, give the daemon a --token-file, or name the page's origin "
                        "with its option --cors",
                        (int)(field->value_len < 100 ? field->value_len : 100), host);
}

/* A page of another origin must not submit or delete through its visitor's browser, unless its origin is one that may
 * use the service. A browser names the page's origin with every POST and DELETE (RFC 6454; WHATWG Fetch), and another
 * port of this machine is another origin although it is the same site; Sec-Fetch-Site comes with requests to addresses
 * that it trusts only, but no page can write it. Programs send neither. */
static bool check_origin(const api *context, const http_request *rq, problem_details *problem)
{
    static const char SCHEMES[][9] = {"https://", "http://"};
    const bool changes = strcmp(rq->route->method, "POST") == 0 || strcmp(rq->route->method, "DELETE") == 0;
    const header_field *site = header_find(&rq->headers, "Sec-Fetch-Site", NULL);
    const header_field *origin = header_find(&rq->headers, "Origin", NULL);
    const header_field *host = header_find(&rq->headers, "Host", NULL);
    if (!changes || rq->reply.cors_origin)
        return true;
    bool own = !origin;
    /* ours: the Host that was asked for, by HTTPS also where a proxy ends TLS */
    for (size_t i = 0; i < (context->options.tls ? 1 : 2) && origin && host; i++) {
        const size_t scheme = strlen(SCHEMES[i]);
        own = own ||
              (origin->value_len == scheme + host->value_len && strncasecmp(origin->value, SCHEMES[i], scheme) == 0 &&
               strncasecmp(origin->value + scheme, host->value, host->value_len) == 0);
    }
    if (site) /* the browser's own word, right also behind a proxy that puts another Host */
        own = token_equal(site->value, site->value_len, "same-origin") ||
              (own && token_equal(site->value, site->value_len, "none"));
    return own ||
           problem_fill(problem, 403, "cross_site", "Requests from other sites are refused",
                        "a browser sent this for a page of another origin%s%.*s: name the page's origin with "
                        "the daemon's option --cors if it may",
                        origin ? ", " : "", origin ? (int)(origin->value_len < 100 ? origin->value_len : 100) : 0,
                        origin ? origin->value : "");
}

/* What the route takes: body, parameters, type. */
static bool check_request(const api *context, http_request *rq, problem_details *problem)
{
    const route *to = rq->route;
    const bool post = strcmp(to->method, "POST") == 0;
    const size_t limit = to->streamed ? context->options.max_upload : context->options.max_body;
    size_t codings;
    const header_field *coding = header_find(&rq->headers, "Content-Encoding", &codings);
    if (!check_origin(context, rq, problem))
        return false;
    if (!post && (rq->chunked || rq->length > 0))
        return problem_fill(problem, 400, "unexpected_body", "The request must not have a body", "%s %s takes no body",
                            to->method, to->pattern);
    if (rq->length > limit)
        return problem_fill(problem, 413, "body_too_large", "The request body is too large",
                            "the body has %llu bytes, the limit of this server is %zu", (unsigned long long)rq->length,
                            limit);
    if (!route_check_parameters(rq, problem))
        return false;
    if (!post)
        return true;
    if (coding && (codings > 1 || (!token_equal(coding->value, coding->value_len, "identity") &&
                                   !(to->streamed && (token_equal(coding->value, coding->value_len, "gzip") ||
                                                      token_equal(coding->value, coding->value_len, "x-gzip"))))))
        return problem_fill(problem, 415, "content_encoding", "The content coding is not supported",
                            to->streamed ? "send the body as it is, or with Content-Encoding: gzip"
                                         : "send the body without Content-Encoding; uploads may have gzip, and "
                                           "meshes and matrices may be uploads");
    /* a body that any page could send is none of ours; without a body nothing is read */
    const body_type type = request_body_type(rq);
    const bool has_body = rq->chunked || rq->length > 0 || header_find(&rq->headers, "Content-Type", NULL);
    if (has_body && to->streamed && type == BODY_OF_ANY_PAGE)
        return problem_fill(problem, 415, "content_type", "The body must have a type that no page can send unasked",
                            "send the header field Content-Type: application/octet-stream");
    if (has_body && !to->streamed && type != BODY_JSON)
        return problem_fill(problem, 415, "content_type", "The body must be JSON",
                            "send the header field Content-Type: application/json");
    if (!api_draining(context))
        return true;
    rq->reply.retry_after_s = 5;
    return problem_fill(problem, 503, "draining", "The server is shutting down",
                        "no new work is taken: try again when the server is back");
}

/* Who asks, and how often; before anything about the request is told, even whether its path exists. */
static bool check_client(api *context, http_request *rq, bool has_route, problem_details *problem)
{
    static const char SCHEME[] = "Bearer";
    const auth_scope need = has_route ? route_scope(rq->route) : SCOPE_READ;
    auth_identity who = {.scope = SCOPE_NONE};
    char *field = rq->reply.authenticate;
    const size_t size = sizeof rq->reply.authenticate;
    /* the token of `Authorization: Bearer TOKEN` */
    const header_field *given = context->auth ? header_find(&rq->headers, "Authorization", NULL) : NULL;
    if (given && (given->value_len <= sizeof SCHEME || given->value[sizeof SCHEME - 1] != ' ' ||
                  !token_equal(given->value, sizeof SCHEME - 1, SCHEME)))
        given = NULL;
    if (given) {
        const char *at = given->value + sizeof SCHEME, *end = given->value + given->value_len;
        while (at < end && *at == ' ')
            at++;
        who = auth_check(context->auth, at, (size_t)(end - at), clock_seconds(CLOCK_REALTIME));
        memcpy(rq->token, who.name, sizeof rq->token);
        memcpy(rq->client, who.owner, sizeof rq->client);
    }
    const auth_scope have = who.scope;
    rq->sees_all = !context->auth || have >= SCOPE_ADMIN;
    memcpy(rq->share, rq->client, sizeof rq->share);
    for (size_t i = 0; !rq->client[0] && i < rq->address_len; i++)
        snprintf(rq->share + 2 * i, 3, "%02x", rq->address[i]);
    /* how often: a known token counts by its name, everybody else by address: guesses too */
    const bool limited = context->rate.per_s > 0.0 && !(rq->route && strcmp(rq->route->pattern, "/healthz") == 0);
    const void *key = rq->token[0] ? (const void *)rq->token : rq->address;
    const size_t key_len = rq->token[0] ? strlen(rq->token) : rq->address_len;
    const double wait = limited && key_len > 0
                            ? rate_take(&context->rate, rq->token, key, key_len, clock_seconds(CLOCK_MONOTONIC))
                            : 0.0;
    if (wait > 0.0) {
        metrics_add(context->metrics, METRIC_RATE_LIMITED, 1);
        rq->reply.retry_after_s = 1 + (int)wait;
        return problem_fill(problem, 429, "too_many_requests", "Too many requests",
                            "one client may send %d requests per second (the daemon's option --max-client-rate)",
                            context->options.max_client_rate);
    }
    if (!context->auth || have >= need)
        return true;
    rq->reply.allow[0] = '\0';
    metrics_add(context->metrics, METRIC_UNAUTHORIZED, 1);
    if (have != SCOPE_NONE) {
        snprintf(field, size, "Bearer realm=\"uzawad\", error=\"insufficient_scope\", scope=\"%s\"", AUTH_SCOPES[need]);
        return problem_fill(problem, 403, "insufficient_scope", "This token does not allow that",
                            "the token \"%s\" has the scope %s, and this needs %s", rq->token, AUTH_SCOPES[have],
                            AUTH_SCOPES[need]);
    }
    snprintf(field, size, "Bearer realm=\"uzawad\"%s", given ? ", error=\"invalid_token\"" : "");
    return problem_fill(problem, 401, "unauthorized", "A token is needed", "%s",
                        who.expired ? "the token has expired: ask for a new one"
                        : given     ? "the token is not one of this server's"
                                    : "send the header field Authorization: Bearer TOKEN");
}

bool admission_check(void *ctx, http_request *rq)
{
    api *context = ctx;
    problem_details *problem = &rq->refused;
    bool found = target_parse(&rq->target, rq->raw_target, problem) &&
                 route_find(rq, rq->reply.allow, sizeof rq->reply.allow, problem);
    if (rq->spare) { /* on a connection beyond the limit */
        rq->reply.close = true;
        if (!found || (strcmp(rq->route->pattern, "/healthz") != 0 && strcmp(rq->route->pattern, "/readyz") != 0)) {
            rq->reply.retry_after_s = 5;
            return problem_fill(problem, 503, "too_many_connections", "Too many connections are open",
                                "%u connections are busy, as many as this server lets (its option --max-connections): "
                                "try again later",
                                context->options.max_connections);
        }
    }
    if (!check_name(context, rq, problem) || !check_client(context, rq, found, problem) || !found ||
        !check_request(context, rq, problem))
        return false;
    rq->streamed = rq->route->streamed;
    rq->body_limit = rq->streamed ? context->options.max_upload : context->options.max_body;
    return !rq->streamed || uploads_begin(context, rq);
}
