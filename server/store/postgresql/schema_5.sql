-- Version 5: the pieces of a result in one row, and daemons that say which process they are. Daemons of version 4 go on
-- meanwhile and afterwards: to them `piece` is what it was.
SET LOCAL search_path = uzawa;

-- A summary of 3 KB stays in its row as it is: to compress it, and to bring it back, was a third of the end of a job.
ALTER TABLE job SET (toast_tuple_target = 4080);

-- Many pieces of a result (result_blobs.h), their bytes one after another: a row, an entry of an index and a checksum for
-- each of them cost more than what was in them. list: eight lines, each the text of an array with an element for each
-- piece: number, name, part, encoding, header, last, size, and where in `data` its bytes begin.
CREATE TABLE bundle(
    job text COLLATE "C" NOT NULL, token bigint NOT NULL, n integer NOT NULL,
    list text NOT NULL, data bytea NOT NULL, sum bytea NOT NULL, PRIMARY KEY(job, n, token)
);
ALTER TABLE bundle ALTER COLUMN data SET STORAGE EXTERNAL;
-- Eight bytes of the list, without which nothing else can be read, and eight of the data, of which no copy is made.
CREATE FUNCTION bundle_sum(p_job text, p_n integer, p_list text, p_data bytea) RETURNS bytea LANGUAGE sql STABLE
    RETURN sum_of(keys_of(p_job, p_n::text), p_list) || sum_of(keys_of(p_job, p_n::text), sha256(p_data));

ALTER TABLE piece RENAME TO piece_row;
-- All pieces of results that are in the database; good: it is what was put.
CREATE VIEW pieces AS
    SELECT job, token, number, name, part, encoding, header, last, data, sum = sum_of(piece_keys(piece_row), data) AS good
    FROM piece_row
    UNION ALL
    SELECT b.job, b.token, e.number, e.name COLLATE "C", e.part, e.encoding, e.header, e.last,
        substring(b.data FROM e.at::integer + 1 FOR e.size::integer),
        substring(b.sum FROM 9) = sum_of(keys_of(b.job, b.n::text), sha256(b.data))
    FROM bundle AS b, LATERAL (SELECT CASE WHEN substring(b.sum FOR 8) = sum_of(keys_of(b.job, b.n::text), b.list)
                                           THEN string_to_array(b.list, E'\n') END AS l OFFSET 0) AS good,
        LATERAL unnest(l[1]::bigint[], l[2]::text[], l[3]::bigint[], l[4]::bigint[], l[5]::bigint[], l[6]::float8[],
                       l[7]::bigint[], l[8]::bigint[]) AS e(number, name, part, encoding, header, last, size, at);

-- As daemons of version 4 know them. It goes with the next version.
CREATE VIEW piece AS
    SELECT job, token, number, name, part, encoding, header, last, data,
        CASE WHEN good THEN sum_of(concat_ws(E'\x1f', job, number, name, part, encoding, header, last), data)
             ELSE ''::bytea END AS sum
    FROM pieces;
CREATE FUNCTION piece_keys(p piece) RETURNS text LANGUAGE sql STABLE
    RETURN concat_ws(E'\x1f', p.job, p.number, p.name, p.part, p.encoding, p.header, p.last);
CREATE FUNCTION put_piece() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO uzawa.piece_row(job, token, number, name, part, encoding, header, last, data, sum)
        VALUES (NEW.job, NEW.token, NEW.number, NEW.name, NEW.part, NEW.encoding, NEW.header, NEW.last, NEW.data, NEW.sum)
        ON CONFLICT DO NOTHING;
    RETURN NEW;
END $$;
CREATE TRIGGER put_piece INSTEAD OF INSERT ON piece FOR EACH ROW EXECUTE FUNCTION put_piece();

CREATE OR REPLACE FUNCTION note_job() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    charge float8 := 0;
    seconds float8 := 0;
BEGIN
    IF TG_OP = 'INSERT' THEN
        INSERT INTO uzawa.ledger(was, becomes, share, ahead, small, client, bytes_was, bytes, used, seconds, day)
        VALUES (NULL, NEW.status, NEW.share, NEW.priority > 5, NEW.small, NEW.client, 0, NEW.bytes, 0, 0, 0);
        RETURN NULL;
    END IF;
    IF TG_OP = 'DELETE' THEN
        INSERT INTO uzawa.ledger(was, becomes, share, ahead, small, client, bytes_was, bytes, used, seconds, day)
        VALUES (OLD.status, NULL, OLD.share, OLD.priority > 5, OLD.small, OLD.client, OLD.bytes, 0, 0, 0, 0);
        DELETE FROM uzawa.bundle WHERE job = OLD.id;
        DELETE FROM uzawa.piece_row WHERE job = OLD.id;
        RETURN NULL;
    END IF;
    IF OLD.status = 1 THEN
        -- The lease was extended when its share was charged last. A run that takes no time, or comes to no end, still
        -- was a turn.
        charge := least(OLD.lease_s, greatest(0, uzawa.moment() + OLD.lease_s - OLD.lease));
        IF NEW.status <> 1 THEN
            charge := charge + 0.001;
        END IF;
        IF NEW.status >= 2 THEN
            seconds := greatest(0, NEW.finished - NEW.started);
        END IF;
        IF NEW.status = 2 AND OLD.body IS NOT NULL THEN
            UPDATE uzawa.holding AS h SET seconds = coalesce(h.seconds, NEW.finished - NEW.started),
                again = CASE WHEN h.seconds IS NOT NULL THEN NEW.finished - NEW.started END
                WHERE h.body = OLD.body AND h.node = OLD.node AND h.again IS NULL;
        END IF;
    END IF;
    INSERT INTO uzawa.ledger(was, becomes, share, ahead, small, client, bytes_was, bytes, used, seconds, day)
    VALUES (OLD.status, NEW.status, NEW.share, NEW.priority > 5, CASE WHEN OLD.status = 0 THEN OLD.small ELSE NEW.small END,
            NEW.client, OLD.bytes, NEW.bytes, charge, seconds, floor(NEW.finished / 86400));
    IF NEW.status >= 2 AND OLD.status < 2 THEN
        UPDATE uzawa.webhook SET state = 1, next = NEW.finished WHERE job = NEW.id;
    END IF;
    RETURN NULL;
END $$;

-- As finish_2; when the job ended.
CREATE FUNCTION finish_3(p_job text, p_owner text, p_token bigint, p_status integer, p_summary text, p_error text,
    p_bytes bigint, p_contents text) RETURNS float8 LANGUAGE plpgsql SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    ended float8;
BEGIN
    UPDATE uzawa.job SET status = p_status, finished = uzawa.moment(), summary = p_summary, error = p_error, node = NULL,
        owner = NULL, lease = 0, progress = CASE WHEN p_status = 2 THEN 100 ELSE progress END,
        summary_sum = uzawa.sum_of(uzawa.keys_of(id, p_status::text), p_summary), bytes = bytes + p_bytes,
        contents = p_contents, contents_sum = uzawa.sum_of(id, p_contents)
        WHERE id = p_job AND status = 1 AND owner = p_owner AND token = p_token RETURNING finished INTO ended;
    IF NOT FOUND THEN
        SELECT finished INTO ended FROM uzawa.job WHERE id = p_job AND status = p_status AND token = p_token
            AND summary IS NOT DISTINCT FROM p_summary AND error IS NOT DISTINCT FROM p_error
            AND contents IS NOT DISTINCT FROM p_contents;
        IF NOT FOUND THEN
            PERFORM uzawa.refuse_lease(p_job);
        END IF;
    END IF;
    RETURN ended;
END $$;

-- Which process a daemon is, and of which machine (former.h); '': it does not say.
ALTER TABLE node ADD COLUMN process text NOT NULL DEFAULT '';

-- Who had the tables of version 4 has these.
DO $$
DECLARE
    who record;
BEGIN
    FOR who IN SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = 'uzawa' AND table_name = 'job' AND privilege_type = 'INSERT' AND grantee <> CURRENT_USER LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON uzawa.bundle, uzawa.piece, uzawa.pieces TO %s',
                       CASE who.grantee WHEN 'PUBLIC' THEN 'PUBLIC' ELSE quote_ident(who.grantee) END);
    END LOOP;
END $$;

UPDATE format SET version = 5;
