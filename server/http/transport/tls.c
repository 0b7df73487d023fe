/* tls.c: the certificate and the key, checked before libmicrohttpd takes them: it would only say that it can't start.
 */
#include "http/transport/transport.h"

#include <errno.h>
#include <gnutls/gnutls.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PEM_MOST = 1 << 20 };

/* malloc'ed text; NULL with the reason. */
static char *read_text(const char *path, char *message, size_t size)
{
    FILE *file = fopen(path, "re");
    char *text = file ? malloc(PEM_MOST + 1) : NULL;
    if (!text) {
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

bool http_tls_read(http_tls *out, const char *cert_path, const char *key_path, char *message, size_t size)
{
    *out = (http_tls){NULL, NULL};
    if (MHD_is_feature_supported(MHD_FEATURE_TLS) != MHD_YES) {
        snprintf(message, size, "the installed libmicrohttpd has no TLS: put a proxy in front");
        return false;
    }
    http_tls pair = {.cert = read_text(cert_path, message, size)};
    if (pair.cert)
        pair.key = read_text(key_path, message, size);
    if (!pair.key) {
        http_tls_clear(&pair);
        return false;
    }
    gnutls_certificate_credentials_t credentials;
    const gnutls_datum_t c = {(unsigned char *)pair.cert, (unsigned)strlen(pair.cert)};
    const gnutls_datum_t k = {(unsigned char *)pair.key, (unsigned)strlen(pair.key)};
    int rc = gnutls_certificate_allocate_credentials(&credentials);
    if (rc >= 0) {
        rc = gnutls_certificate_set_x509_key_mem(credentials, &c, &k, GNUTLS_X509_FMT_PEM);
        gnutls_certificate_free_credentials(credentials);
    }
    if (rc >= 0) {
        *out = pair;
        return true;
    }
    snprintf(message, size, "%s and %s are no certificate and its key in PEM: %s", cert_path, key_path,
             gnutls_strerror(rc));
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
