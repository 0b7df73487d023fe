#include "store/sqlite/checksum.h"

#include <endian.h>
#include <gnutls/crypto.h>
#include <stdint.h>
#include <string.h>
#include <zlib.h>

static uLong add_number(uLong sum, uint64_t bits)
{
    bits = htole64(bits);
    return crc32_z(sum, (const unsigned char *)&bits, sizeof bits);
}

static void checksum(sqlite3_context *out, int count, sqlite3_value **values)
{
    uLong sum = 0;
    for (int i = 0; i < count; i++) {
        sqlite3_value *value = values[i];
        const int type = sqlite3_value_type(value);
        sum = add_number(sum, (uint64_t)type);
        if (type == SQLITE_INTEGER) {
            sum = add_number(sum, (uint64_t)sqlite3_value_int64(value));
        } else if (type == SQLITE_FLOAT) {
            const double x = sqlite3_value_double(value);
            uint64_t bits;
            memcpy(&bits, &x, sizeof bits);
            sum = add_number(sum, bits);
        } else if (type != SQLITE_NULL) { /* the pointer before the length, as SQLite's manual asks */
            const void *data = type == SQLITE_TEXT ? sqlite3_value_text(value) : sqlite3_value_blob(value);
            const int size = sqlite3_value_bytes(value);
            if (!data && size > 0) {
                sqlite3_result_error_nomem(out);
                return;
            }
            sum = add_number(sum, (uint64_t)size);
            sum = size > 0 ? crc32_z(sum, data, (size_t)size) : sum;
        }
    }
    sqlite3_result_int64(out, (sqlite3_int64)sum);
}

/* NULL of NULL. */
static void sha256(sqlite3_context *out, int count, sqlite3_value **values)
{
    (void)count;
    unsigned char digest[SHA256_BYTES];
    const void *data = sqlite3_value_blob(values[0]);
    if (sqlite3_value_type(values[0]) == SQLITE_NULL)
        sqlite3_result_null(out);
    else if (gnutls_hash_fast(GNUTLS_DIG_SHA256, data ? data : "", (size_t)sqlite3_value_bytes(values[0]), digest) != 0)
        sqlite3_result_error_nomem(out);
    else
        sqlite3_result_blob(out, digest, sizeof digest, SQLITE_TRANSIENT);
}

bool checksum_register(sqlite3 *db)
{
    return sqlite3_create_function_v2(db, "sha256", 1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, NULL, sha256, NULL, NULL,
                                      NULL) == SQLITE_OK &&
           sqlite3_create_function_v2(db, "checksum", -1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, NULL, checksum, NULL,
                                      NULL, NULL) == SQLITE_OK;
}
