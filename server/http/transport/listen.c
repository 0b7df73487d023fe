/* listen.c: before the server starts: from "HOST:PORT" to a listening socket, and the certificate. */
#include "base/given_file.h"
#include "http/transport/connection.h"

#include <errno.h>
#include <gnutls/gnutls.h>
#include <microhttpd.h>
#include <netdb.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

/* Splits at the last colon; brackets around an IPv6 address are required and dropped. */
static bool split_host_port(const char *text, char host[256], char port[6])
{
    const char *colon = strrchr(text, ':');
    if (!colon || colon == text || strlen(colon + 1) > 5 || !colon[1] || colon[1 + strspn(colon + 1, "0123456789")])
        return false;
    size_t len = (size_t)(colon - text);
    bool bracketed = text[0] == '[' && text[len - 1] == ']';
    if (bracketed) {
        text++;
        len -= 2;
    } else if (memchr(text, ':', len)) {
        return false;
    }
    if (len == 0 || len > 255)
        return false;
    memcpy(host, text, len);
    host[len] = '\0';
    strcpy(port, colon + 1);
    return atoi(port) <= 65535;
}

int http_listen(const char *host_port, const char *scheme, char *url, size_t url_size, char *message, size_t size)
{
    char host[256], port[16];
    int on = 1;
    if (!split_host_port(host_port, host, port)) {
        snprintf(message, size, "\"%s\" is not HOST:PORT or [IPv6]:PORT with a port from 0 to 65535", host_port);
        return -1;
    }
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV}, *found = NULL;
    int failure = getaddrinfo(host, port, &hints, &found);
    if (failure != 0) {
        snprintf(message, size, "cannot find the address of %s: %s", host, gai_strerror(failure));
        return -1;
    }
    /* A restart must not wait for the old connections' TIME_WAIT; a live listener still excludes a second one. */
    int fd = socket(found->ai_family, found->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, found->ai_protocol);
    const bool listens = fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                         bind(fd, found->ai_addr, found->ai_addrlen) == 0 && listen(fd, SOMAXCONN) == 0;
    if (!listens)
        snprintf(message, size, "cannot listen on %s: %m%s", host_port,
                 errno == EADDRINUSE
                     ? "; another program listens there: stop it, or give another port (0 takes a free one)"
                 : errno == EACCES ? "; ports below 1024 are for root: give another one, or start as root with --user"
                 : errno == EADDRNOTAVAIL ? "; this machine does not have that address"
                                          : "");
    freeaddrinfo(found);

    /* its address, with the port that was taken */
    struct sockaddr_storage name;
    socklen_t len = sizeof name;
    int n = -1;
    if (listens && getsockname(fd, (struct sockaddr *)&name, &len) == 0 &&
        getnameinfo((struct sockaddr *)&name, len, host, sizeof host, port, sizeof port,
                    NI_NUMERICHOST | NI_NUMERICSERV) == 0)
        n = snprintf(url, url_size, name.ss_family == AF_INET6 ? "%s://[%s]:%s" : "%s://%s:%s", scheme, host, port);
    if (n > 0 && (size_t)n < url_size)
        return fd;
    if (listens)
        snprintf(message, size, "cannot tell the address of the socket on %s", host_port);
    if (fd >= 0)
        close(fd);
    return -1;
}

bool http_is_public(int listen_fd)
{
    struct sockaddr_storage name;
    socklen_t len = sizeof name;
    if (getsockname(listen_fd, (struct sockaddr *)&name, &len) != 0)
        return true;
    if (name.ss_family == AF_INET)
        return ntohl(((struct sockaddr_in *)(void *)&name)->sin_addr.s_addr) >> 24 != IN_LOOPBACKNET;
    if (name.ss_family != AF_INET6)
        return true;
    const struct in6_addr *six = &((struct sockaddr_in6 *)(void *)&name)->sin6_addr;
    bool mapped = IN6_IS_ADDR_V4MAPPED(six) && six->s6_addr[12] == IN_LOOPBACKNET;
    return !IN6_IS_ADDR_LOOPBACK(six) && !mapped;
}

/* ---- the certificate and the key, checked before libmicrohttpd takes them: it would only say that it can't start */

enum { PEM_MOST = 1 << 20 };

/* malloc'ed text; NULL with the reason. secret: other users of this machine must not be able to read it. */
static char *read_text(const char *path, bool secret, char *message, size_t size)
{
    struct stat st;
    FILE *file = given_file_open(path);
    const bool open_to_all = file && secret && (fstat(fileno(file), &st) != 0 || (st.st_mode & S_IRWXO));
    char *text = file && !open_to_all ? malloc(PEM_MOST + 1) : NULL;
    if (open_to_all) {
        snprintf(message, size, "the key %s is open to every user of this machine: chmod o= %s", path, path);
    } else if (!text) {
        snprintf(message, size, "cannot read %s: %s", path, strerror(file ? ENOMEM : errno));
    } else {
        size_t n = fread(text, 1, PEM_MOST, file);
        text[n] = '\0';
        if (n == 0 || n == PEM_MOST || ferror(file)) {
            snprintf(message, size, "%s is empty, too large, or cannot be read", path);
            free(text);
            text = NULL;
        }
    }
    if (file)
        fclose(file);
    return text;
}

bool http_tls_load(gnutls_certificate_credentials_t *out, const http_tls *tls, char *message, size_t size)
{
    const gnutls_datum_t cert = {(unsigned char *)tls->cert, (unsigned)strlen(tls->cert)};
    const gnutls_datum_t key = {(unsigned char *)tls->key, (unsigned)strlen(tls->key)};
    int rc = gnutls_certificate_allocate_credentials(out);
    if (rc >= 0 && (rc = gnutls_certificate_set_x509_key_mem(*out, &cert, &key, GNUTLS_X509_FMT_PEM)) < 0)
        gnutls_certificate_free_credentials(*out);
    if (rc < 0)
        snprintf(message, size, "%s", gnutls_strerror(rc));
    return rc >= 0;
}

bool http_tls_read(http_tls *out, const char *cert_path, const char *key_path, char *message, size_t size)
{
    *out = (http_tls){NULL, NULL};
    if (MHD_is_feature_supported(MHD_FEATURE_TLS) != MHD_YES) {
        snprintf(message, size, "the installed libmicrohttpd has no TLS: put a proxy in front");
        return false;
    }
    http_tls pair = {.cert = read_text(cert_path, false, message, size)};
    if (pair.cert)
        pair.key = read_text(key_path, true, message, size);
    if (!pair.key) {
        http_tls_clear(&pair);
        return false;
    }
    gnutls_certificate_credentials_t credentials;
    char why[160];
    if (http_tls_load(&credentials, &pair, why, sizeof why)) {
        gnutls_certificate_free_credentials(credentials);
        *out = pair;
        return true;
    }
    snprintf(message, size, "%s and %s are no certificate and its key in PEM: %s", cert_path, key_path, why);
    http_tls_clear(&pair);
    return false;
}

void http_tls_clear(http_tls *tls)
{
    if (tls->key)
        explicit_bzero(tls->key, strlen(tls->key));
    free(tls->key);
    free(tls->cert);
    *tls = (http_tls){NULL, NULL};
}
