/* maintenance.c: checks of a database, also while daemons use it. */
#include "store/postgresql/internal.h"
#include "store/postgresql/schema.h"

#include <stdio.h>
#include <stdlib.h>

/* Queries whose rows are findings. What has a checksum is read whole; that rows refer to what is there PostgreSQL sees
 * to itself. */
static const struct {
    const char *sql, *finding;
} CHECKS[] = {
    {"SELECT id FROM uzawa.job WHERE uzawa.request_digest(id) IS NULL LIMIT 20", "job %s has no request\n"},
    {"SELECT counted.status::text FROM uzawa.counted LEFT JOIN (SELECT status, count(*) AS jobs, sum(bytes) AS bytes"
     " FROM uzawa.job GROUP BY status) AS there ON there.status = counted.status"
     " WHERE counted.jobs <> coalesce(there.jobs, 0) OR counted.bytes <> coalesce(there.bytes, 0)",
     "the tally of jobs with status %s is wrong\n"},
    {"SELECT id FROM uzawa.job WHERE summary_sum <> uzawa.sum_of(uzawa.keys_of(id, status::text), summary) LIMIT 20",
     "the summary of job %s is not what was written\n"},
    {"SELECT id FROM uzawa.job WHERE contents_sum <> uzawa.sum_of(id, contents) LIMIT 20",
     "the list of the result of job %s is not what was written\n"},
    {"SELECT id FROM uzawa.job WHERE contents IS NOT NULL AND split_part(contents, ' ', 1)::bigint <>"
     " (SELECT count(*) FROM uzawa.answer WHERE answer.job = id)"
     " + (SELECT count(*) FROM uzawa.pieces AS p WHERE p.job = id AND p.part = 0)"
     " + (SELECT count(*) FROM uzawa.placed WHERE placed.job = id AND part = 0) LIMIT 20",
     "a part of the result of job %s is missing\n"},
    {"SELECT name FROM (SELECT name, waiting, bytes FROM uzawa.client UNION ALL SELECT client,"
     " (coalesce(becomes, 9) = 0)::int - (coalesce(was, 9) = 0)::int, bytes - bytes_was FROM uzawa.ledger"
     " WHERE client <> '' UNION ALL SELECT client, -(status = 0)::int, -bytes FROM uzawa.job WHERE client <> '')"
     " AS both_sides GROUP BY name HAVING sum(waiting) <> 0 OR sum(bytes) <> 0",
     "what is counted of client %s is wrong\n"},
    {"SELECT DISTINCT name FROM (SELECT name, ahead, waiting, small, running FROM uzawa.share UNION ALL"
     " SELECT share, ahead, w, w * small::int, r FROM (SELECT *, (coalesce(becomes, 9) = 0)::int"
     " - (coalesce(was, 9) = 0)::int AS w, (coalesce(becomes, 9) = 1)::int - (coalesce(was, 9) = 1)::int AS r"
     " FROM uzawa.ledger) AS late UNION ALL SELECT share, priority > 5, -(status = 0)::int,"
     " -(status = 0 AND small)::int, -(status = 1)::int FROM uzawa.job WHERE status < 2) AS both_sides"
     " GROUP BY name, ahead HAVING sum(waiting) <> 0 OR sum(small) <> 0 OR sum(running) <> 0",
     "what is counted of share %s is wrong\n"},
    {"SELECT job FROM uzawa.request WHERE digest <> sha256(body) LIMIT 20",
     "the request of job %s is not what was written\n"},
    {"SELECT number || ' of job ' || job FROM uzawa.answer"
     " WHERE sum <> uzawa.sum_of(concat_ws(E'\\x1f', job, number, name), summary) LIMIT 20",
     "the summary of case %s is not what was written\n"},
    {"SELECT name || ' of job ' || job FROM uzawa.piece_row WHERE"
     " sum <> uzawa.sum_of(uzawa.piece_keys(piece_row), data) LIMIT 20",
     "the %s is not what was written\n"},
    {"SELECT name || ' of job ' || job FROM uzawa.pieces WHERE NOT good AND job IN (SELECT b.job FROM uzawa.bundle AS b"
     " WHERE b.sum <> uzawa.bundle_sum(b.job, b.n, b.list, b.data) UNION ALL SELECT u.job FROM uzawa.common_use AS u"
     " LEFT JOIN uzawa.common AS c USING (digest) WHERE c.digest IS NULL OR sha256(c.data) <> c.digest) LIMIT 20",
     "the %s is not what was written\n"},
    {"SELECT encode(digest, 'hex') FROM uzawa.common AS c WHERE NOT EXISTS (SELECT 1 FROM uzawa.common_use AS u"
     " JOIN uzawa.job ON job.id = u.job WHERE u.digest = c.digest) LIMIT 20",
     "piece %s belongs to no result\n"},
    {"SELECT name || ' of job ' || job FROM uzawa.placed WHERE sum <> uzawa.sum_of(uzawa.placed_keys(placed), digest)"
     " LIMIT 20",
     "the place of the %s is not what was written\n"},
    {"SELECT object || ' of job ' || job FROM uzawa.placed WHERE size > 0 AND NOT EXISTS (SELECT 1 FROM uzawa.object"
     " WHERE object.name = placed.object AND object.job = placed.job AND NOT doomed) LIMIT 20",
     "the object %s is nobody's\n"},
    {"SELECT each || ' of the request of job ' || r.job FROM uzawa.request_placed AS r, unnest(objects) AS each"
     " WHERE NOT EXISTS (SELECT 1 FROM uzawa.object AS o WHERE o.name = each AND o.job = r.job AND NOT o.doomed)"
     " LIMIT 20",
     "the object %s is nobody's\n"},
    {"SELECT upload.id FROM uzawa.upload WHERE NOT EXISTS (SELECT 1 FROM uzawa.blob_piece WHERE blob = upload.id"
     " AND object IS NOT NULL) AND id <> coalesce((SELECT encode(sha256(string_agg(data, ''::bytea"
     " ORDER BY part)), 'hex') FROM uzawa.blob_piece WHERE blob = upload.id), encode(sha256(''), 'hex')) LIMIT 20",
     "the bytes of upload %s are not what was sent\n"},
};

/* A connection of its own for a while: a check may take long, and ends early where it can't go on. */
static bool check(link_to *l, store_findings *out)
{
    size_t len = 0;
    *out = (store_findings){.findings = NULL};
    const double begun = clock_seconds(CLOCK_MONOTONIC);
    FILE *text = open_memstream(&out->findings, &len);
    if (!text)
        return false;
    /* All of one moment, since others go on meanwhile. */
    store_status status = link_script(l, "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY");
    for (size_t i = 0; i <= sizeof CHECKS / sizeof CHECKS[0] && status == STORE_OK; i++) {
        const bool last = i == sizeof CHECKS / sizeof CHECKS[0];
        link_begin(l, LINK_READ);
        link_send(l, &(call){.sql = last ? "SELECT count(*) FROM uzawa.job" : CHECKS[i].sql, .once = true});
        status = link_end(l);
        for (int row = 0; status == STORE_OK && !last && row < PQntuples(l->answers[0]); row++)
            fprintf(text, CHECKS[i].finding, PQgetvalue(l->answers[0], row, 0));
        if (status == STORE_OK && last)
            out->jobs = cell_integer(l->answers[0], 0, 0);
    }
    if (status != STORE_OK)
        fprintf(text, "the check ended early: %s\n", l->message);
    link_script(l, "ROLLBACK");
    out->seconds = clock_seconds(CLOCK_MONOTONIC) - begun;
    if (fclose(text) == 0)
        return true;
    free(out->findings);
    out->findings = NULL;
    return false;
}

store_status postgresql_check(store *base, store_findings *out)
{
    postgresql_store *s = postgresql_of(base);
    link_to *l = postgresql_take(s);
    if (!l->pg)
        return postgresql_give(s, l, STORE_AWAY);
    const bool good = check(l, out);
    if (!good)
        snprintf(l->message, sizeof l->message, "no memory for the findings");
    return postgresql_give(s, l, good ? STORE_OK : STORE_ERROR);
}

bool postgresql_check_file(const char *address, store_findings *out, char *message, size_t size)
{
    link_to l = {.pg = NULL};
    *out = (store_findings){.findings = NULL};
    if (!link_address_fits(address, message, size))
        return false;
    bool good = link_open(&l, address, LINK_READ);
    const int version = good ? schema_version(&l) : -1;
    if (version == 0)
        snprintf(l.message, sizeof l.message, "the database is empty: there is no job in it");
    good = version > 0 && check(&l, out);
    if (!good)
        snprintf(message, size, "%s", version > 0 ? "no memory for the findings" : l.message);
    link_close(&l);
    return good;
}

/* The server's own tools do that, for all of it at one moment. */
bool postgresql_backup_file(const char *address, const char *to, int64_t *bytes, char *message, size_t size)
{
    (void)address;
    *bytes = 0;
    snprintf(message, size,
             "a database of PostgreSQL is copied by its own tools: pg_dump --format=custom --schema=uzawa --file=%s "
             "with the address of --db, and pg_restore brings it back",
             to);
    return false;
}

int64_t postgresql_free_bytes(store *base)
{
    (void)base;
    return -1;
}

store_status postgresql_try_write(store *base)
{
    call c = {.sql = "UPDATE uzawa.node SET seen = uzawa.moment() WHERE id = $1"};
    call_text(&c, postgresql_of(base)->node);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, true, &c, NULL, NULL);
}
