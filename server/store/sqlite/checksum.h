/* checksum.h: checksums of stored rows, as an SQL function.
 *
 * SQLite notices a page that is not well formed, but not a byte that changed within a text or a blob. What answers are
 * made of therefore has a checksum in its row, checksum(key columns..., contents...), the CRC-32 of RFC 1952 over the
 * values with their types and lengths: it finds every single error of up to 32 bits in a row, and misses one in 2^32 of
 * the others. With the keys in it, contents that appear under another job or another name are found too.
 * A vector of some size is kept once for all jobs that have the same, under its SHA-256, which then stands in the row
 * in its place: sha256(data). A NULL instead was written by a format that had none (file_format.c). */
#ifndef SERVER_STORE_SQLITE_CHECKSUM_H
#define SERVER_STORE_SQLITE_CHECKSUM_H

#include <sqlite3.h>
#include <stdbool.h>

/* Makes checksum() and sha256() known to a connection; false: no memory. */
bool checksum_register(sqlite3 *db);

/* What stands in the column `sum` of a row, and whether a row that is read is as it was written: SQL texts. */
#define SUM_OF(columns)      "checksum(" columns ")"
#define SUM_IS(sum, columns) "(" sum " IS NULL OR " sum " = checksum(" columns "))"

#define SHA256_BYTES 32
/* Whether the bytes that a vector's row stands for are those, where `piece` is joined as FROM_PIECES says. */
#define FROM_PIECES "vector LEFT JOIN piece ON vector.shared AND piece.digest = vector.data"
#define PIECE_IS    "(NOT vector.shared OR coalesce(sha256(piece.data) = vector.data, 0))"

/* The columns that a checksum covers, of each table that has one. */
#define SUM_JOB      "job.id, job.status, job.summary"
#define SUM_CONTENTS "job.id, job.contents"
#define SUM_REQUEST  "request.job, request.body"
#define SUM_ANSWER   "answer.job, answer.number, answer.name, answer.summary"
#define SUM_VECTOR   "vector.job, vector.answer, vector.name, vector.part, vector.version, vector.count, vector.data"
#define SUM_HISTORY                                                                                                    \
    "history.job, history.answer, history.part, history.version, history.columns, history.last, history.data"

#endif
