-- Version 6: pieces of vectors that several jobs have are kept once. Daemons of version 5 go on meanwhile and afterwards:
-- what they put is as it was, and to them `pieces` is what it was.
SET LOCAL search_path = uzawa;

-- What only daemons of version 4 knew.
DROP FUNCTION piece_keys(piece);
DROP VIEW piece;
DROP FUNCTION put_piece, finish_2;

-- Pieces by the SHA-256 of their bytes, and the jobs that have them. One goes with the last job that had it.
CREATE TABLE common(digest bytea PRIMARY KEY, data bytea NOT NULL);
ALTER TABLE common ALTER COLUMN data SET STORAGE EXTERNAL;
CREATE TABLE common_use(
    digest bytea NOT NULL, job text COLLATE "C" NOT NULL, token bigint NOT NULL, PRIMARY KEY(digest, job, token)
);
CREATE INDEX common_use_by_job ON common_use(job);

-- In the transaction that ends the job. Whoever would remove the piece waits for that, and then sees who has it; where
-- he was first it is put anew.
CREATE FUNCTION use_common(p_digest bytea, p_data bytea, p_job text, p_token bigint) RETURNS void LANGUAGE plpgsql
    SET plan_cache_mode = force_generic_plan AS $$
BEGIN
    LOOP
        PERFORM 1 FROM uzawa.common AS c WHERE c.digest = p_digest FOR KEY SHARE;
        EXIT WHEN FOUND;
        INSERT INTO uzawa.common(digest, data) VALUES (p_digest, p_data) ON CONFLICT DO NOTHING;
        EXIT WHEN FOUND;
    END LOOP;
    INSERT INTO uzawa.common_use(digest, job, token) VALUES (p_digest, p_job, p_token) ON CONFLICT DO NOTHING;
END $$;

-- Of two who remove the last jobs that have a piece the second one sees what the first one did; all take pieces in one
-- order. Only where nobody else has it, as far as can be seen, does it wait for those who are about to.
CREATE FUNCTION leave_common() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    jobs text[] := ARRAY(SELECT g.id FROM gone AS g);
    d bytea;
BEGIN
    FOR d IN SELECT DISTINCT u.digest FROM uzawa.common_use AS u WHERE u.job = ANY(jobs) ORDER BY u.digest LOOP
        PERFORM pg_advisory_xact_lock(1970954616, hashtext(encode(d, 'hex')));
        DELETE FROM uzawa.common_use AS u WHERE u.digest = d AND u.job = ANY(jobs);
        IF NOT EXISTS (SELECT 1 FROM uzawa.common_use AS u WHERE u.digest = d) THEN
            PERFORM 1 FROM uzawa.common AS c WHERE c.digest = d FOR UPDATE;
            DELETE FROM uzawa.common AS c WHERE c.digest = d
                AND NOT EXISTS (SELECT 1 FROM uzawa.common_use AS u WHERE u.digest = d);
        END IF;
    END LOOP;
    RETURN NULL;
END $$;
CREATE TRIGGER leave_common AFTER DELETE ON job REFERENCING OLD TABLE AS gone FOR EACH STATEMENT
    EXECUTE FUNCTION leave_common();

-- A ninth line of the list is the digests of those pieces whose bytes are in `common`, in hexadecimal; '': in `data`.
CREATE OR REPLACE VIEW pieces AS
    SELECT job, token, number, name, part, encoding, header, last, data, sum = sum_of(piece_keys(piece_row), data) AS good
    FROM piece_row
    UNION ALL
    SELECT b.job, b.token, e.number, e.name COLLATE "C", e.part, e.encoding, e.header, e.last,
        CASE WHEN e.digest <> '' THEN c.data ELSE substring(b.data FROM e.at::integer + 1 FOR e.size::integer) END,
        CASE WHEN e.digest <> '' THEN coalesce(sha256(c.data) = c.digest, false)
             ELSE substring(b.sum FROM 9) = sum_of(keys_of(b.job, b.n::text), sha256(b.data)) END
    FROM bundle AS b, LATERAL (SELECT CASE WHEN substring(b.sum FOR 8) = sum_of(keys_of(b.job, b.n::text), b.list)
                                           THEN string_to_array(b.list, E'\n') END AS l OFFSET 0) AS good,
        LATERAL unnest(l[1]::bigint[], l[2]::text[], l[3]::bigint[], l[4]::bigint[], l[5]::bigint[], l[6]::float8[],
                       l[7]::bigint[], l[8]::bigint[], l[9]::text[])
            AS e(number, name, part, encoding, header, last, size, at, digest)
        LEFT JOIN common AS c ON c.digest = decode(e.digest, 'hex');

-- Who had the tables of version 5 has these.
DO $$
DECLARE
    who record;
BEGIN
    FOR who IN SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = 'uzawa' AND table_name = 'job' AND privilege_type = 'INSERT' AND grantee <> CURRENT_USER LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON uzawa.common, uzawa.common_use TO %s',
                       CASE who.grantee WHEN 'PUBLIC' THEN 'PUBLIC' ELSE quote_ident(who.grantee) END);
    END LOOP;
END $$;

UPDATE format SET version = 6;
