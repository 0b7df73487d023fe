#include "core/digest.h"

#include "core/alloc.h"

#include <gnutls/crypto.h>
#include <stdlib.h>

struct uz_digest {
    gnutls_hash_hd_t state;
    bool failed;
};

uz_digest *uz_digest_new(void)
{
    uz_digest *digest = uz_alloc_zero(1, sizeof *digest);
    if (digest && gnutls_hash_init(&digest->state, GNUTLS_DIG_SHA256) != 0) {
        free(digest);
        digest = NULL;
    }
    return digest;
}

void uz_digest_add(uz_digest *digest, const void *data, size_t len)
{
    unsigned long long length = len;
    digest->failed |= gnutls_hash(digest->state, &length, sizeof length) != 0;
    if (len > 0)
        digest->failed |= gnutls_hash(digest->state, data, len) != 0;
}

void uz_digest_add_list(uz_digest *digest, const void *list, int64_t count, size_t size)
{
    const int64_t n = list ? count : 0;
    uz_digest_add(digest, &n, sizeof n);
    if (n > 0)
        uz_digest_add(digest, list, (size_t)n * size);
}

bool uz_digest_end(uz_digest *digest, char hex[65])
{
    unsigned char bytes[32] = {0};
    bool ok = !digest->failed;
    gnutls_hash_deinit(digest->state, bytes);
    free(digest);
    for (int i = 0; ok && i < 32; i++) {
        hex[2 * i] = "0123456789abcdef"[bytes[i] >> 4];
        hex[2 * i + 1] = "0123456789abcdef"[bytes[i] & 15];
    }
    hex[ok ? 64 : 0] = '\0';
    return ok;
}
