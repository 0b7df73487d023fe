-- Version 1 of the tables and functions. The rule for changing them stands in schema.h.
--
-- Each operation of the store that changes something is one function, so that it is one round trip and its plans are
-- kept by the server, whatever stands between (a pooler hands a connection from one client to the next). Times are Unix
-- seconds by the database's clock, but `created`, which goes with the id. What stands in rows means what it means in
-- the other engine's: status 0 accepted, 1 running, 2 successful, 3 failed, 4 dismissed; `finished` of a running job is
-- when it was told to end.
--
-- Locks. A transaction locks rows of its own job, and uploads in the order of their ids. What is counted of jobs (tally,
-- share, client) would be rows that all transactions share: so a trigger writes each change into `ledger`, without a
-- lock, and fold() brings it there, for one at a time (the advisory lock of take_queue). Nothing else writes those
-- tables, and nobody waits for the disk while he has that lock: claims commit asynchronously.
CREATE SCHEMA uzawa;
SET LOCAL search_path = uzawa;

CREATE TABLE format(version integer NOT NULL);
INSERT INTO format VALUES (1);

CREATE SEQUENCE token;
-- A daemon that has the store open. Jobs of one that is gone are nobody's, whatever their lease.
CREATE TABLE node(
    id text COLLATE "C" PRIMARY KEY, host text NOT NULL, pid integer NOT NULL, begun float8 NOT NULL, seen float8 NOT NULL
);

CREATE TABLE job(
    id text COLLATE "C" PRIMARY KEY CHECK (length(id) = 32),
    status smallint NOT NULL DEFAULT 0 CHECK (status BETWEEN 0 AND 4),
    progress smallint NOT NULL DEFAULT 0 CHECK (progress BETWEEN 0 AND 100),
    attempts integer NOT NULL DEFAULT 0,
    created float8 NOT NULL, started float8 NOT NULL DEFAULT 0, finished float8 NOT NULL DEFAULT 0,
    node text COLLATE "C", owner text, token bigint NOT NULL DEFAULT 0, -- the fencing token of the last claim
    lease float8 NOT NULL DEFAULT 0, lease_s float8 NOT NULL DEFAULT 0, -- when it ends, and how long it lasts
    tags text NOT NULL, summary text, error text, key text COLLATE "C", refines text,
    priority smallint NOT NULL, queue_until float8 NOT NULL, bytes bigint NOT NULL,
    client text COLLATE "C" NOT NULL, share text COLLATE "C" NOT NULL, small boolean NOT NULL,
    summary_sum bytea, contents text, contents_sum bytea
);
CREATE UNIQUE INDEX job_by_key ON job(key) WHERE key IS NOT NULL;
CREATE INDEX job_by_status ON job(status, id);
CREATE INDEX job_by_client ON job(client, id) WHERE client <> '';
CREATE INDEX job_by_turn ON job(share, (priority > 5), priority DESC, id) WHERE status = 0;
CREATE INDEX job_by_lane ON job(share, (priority > 5), priority DESC, id) WHERE status = 0 AND small;
CREATE INDEX job_by_queue_until ON job(queue_until) WHERE status = 0 AND queue_until > 0;
CREATE INDEX job_by_lease ON job(lease) WHERE status = 1;
CREATE INDEX job_by_end ON job(finished, id) WHERE status >= 2;

-- digest: the SHA-256 of the body, by which a repeated key is compared and the body checked.
CREATE TABLE request(
    job text COLLATE "C" PRIMARY KEY REFERENCES job(id) ON DELETE CASCADE, body bytea NOT NULL, digest bytea NOT NULL
);
ALTER TABLE request ALTER COLUMN body SET STORAGE EXTERNAL;

CREATE TABLE tag(
    tag text COLLATE "C" NOT NULL, job text COLLATE "C" NOT NULL REFERENCES job(id) ON DELETE CASCADE,
    PRIMARY KEY(tag, job)
);
CREATE INDEX tag_by_job ON tag(job);

-- Results. The token is part of the keys, so that who ends a job never waits for one who lost it and still writes.
CREATE TABLE answer(
    job text COLLATE "C" NOT NULL REFERENCES job(id) ON DELETE CASCADE, token bigint NOT NULL,
    number bigint NOT NULL, name text COLLATE "C" NOT NULL, summary text NOT NULL, sum bytea NOT NULL,
    PRIMARY KEY(job, number, token), UNIQUE(job, name, token)
);
-- Pieces of vectors and of histories, whose name is '/' (result_blobs.h).
CREATE TABLE piece(
    job text COLLATE "C" NOT NULL REFERENCES job(id) ON DELETE CASCADE, token bigint NOT NULL,
    number bigint NOT NULL, name text COLLATE "C" NOT NULL, part bigint NOT NULL,
    encoding bigint NOT NULL, header bigint NOT NULL, last float8 NOT NULL, data bytea NOT NULL, sum bytea NOT NULL,
    PRIMARY KEY(job, number, name, part, token)
);
ALTER TABLE piece ALTER COLUMN data SET STORAGE EXTERNAL;

-- Bytes of uploads (blobs.h), and of those that are being written, under a name of their own.
CREATE TABLE blob(id text COLLATE "C" PRIMARY KEY, written float8 NOT NULL, sealed boolean NOT NULL);
CREATE TABLE blob_piece(
    blob text COLLATE "C" NOT NULL REFERENCES blob(id) ON DELETE CASCADE, part bigint NOT NULL, data bytea NOT NULL,
    PRIMARY KEY(blob, part)
);
ALTER TABLE blob_piece ALTER COLUMN data SET STORAGE EXTERNAL;
-- The reference to the blob is what decides between one who adds the row and one who removes the blob.
CREATE TABLE upload(
    id text COLLATE "C" PRIMARY KEY REFERENCES blob(id),
    bytes bigint NOT NULL, created float8 NOT NULL, used float8 NOT NULL
);
CREATE INDEX upload_by_use ON upload(used);
CREATE TABLE upload_use(
    upload text COLLATE "C" NOT NULL REFERENCES upload(id),
    job text COLLATE "C" NOT NULL REFERENCES job(id) ON DELETE CASCADE, PRIMARY KEY(upload, job)
);
CREATE INDEX upload_use_by_job ON upload_use(job);
CREATE TABLE upload_client(
    upload text COLLATE "C" NOT NULL REFERENCES upload(id) ON DELETE CASCADE, client text COLLATE "C" NOT NULL,
    PRIMARY KEY(upload, client)
);
CREATE INDEX upload_client_by_client ON upload_client(client, upload);

-- state 0: the job has not ended, 1: to be told at `next`, 2: told, 3: given up.
CREATE TABLE webhook(
    job text COLLATE "C" PRIMARY KEY REFERENCES job(id) ON DELETE CASCADE, url text NOT NULL,
    state smallint NOT NULL DEFAULT 0 CHECK (state BETWEEN 0 AND 3), attempts integer NOT NULL DEFAULT 0,
    next float8 NOT NULL DEFAULT 0
);
CREATE INDEX webhook_due ON webhook(next) WHERE state = 1;
CREATE INDEX webhook_open ON webhook(job) WHERE state < 2;

-- What is counted of jobs: in each status; of each client with a name; of each share of the workers (store.h), where
-- `used` is as in start-time fair queueing (Goyal, Vin and Cheng, 1997).
CREATE TABLE tally(status smallint PRIMARY KEY, jobs bigint NOT NULL DEFAULT 0, bytes bigint NOT NULL DEFAULT 0);
INSERT INTO tally(status) VALUES (0), (1), (2), (3), (4);
CREATE TABLE client(
    name text COLLATE "C" PRIMARY KEY, waiting bigint NOT NULL DEFAULT 0, bytes bigint NOT NULL DEFAULT 0,
    day integer NOT NULL DEFAULT 0, seconds float8 NOT NULL DEFAULT 0
);
CREATE TABLE share(
    name text COLLATE "C" NOT NULL, ahead boolean NOT NULL, waiting bigint NOT NULL DEFAULT 0,
    small bigint NOT NULL DEFAULT 0, running bigint NOT NULL DEFAULT 0, used float8 NOT NULL DEFAULT 0,
    PRIMARY KEY(name, ahead)
);
CREATE INDEX share_by_turn ON share(ahead DESC, running, used, name) WHERE waiting > 0;
CREATE INDEX share_by_lane ON share(ahead DESC, running, used, name) WHERE small > 0;
CREATE INDEX share_at_work ON share(ahead, used) WHERE waiting + running > 0;
CREATE INDEX share_idle ON share(ahead, used) WHERE waiting + running = 0;
-- A change of a job that is not counted there yet. was, becomes: its status, NULL: none; bytes: of the job before and
-- after; used: time of workers since its share was charged last; seconds: of a run that ended, on `day`.
CREATE TABLE ledger(
    n bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, was smallint, becomes smallint,
    share text COLLATE "C" NOT NULL, ahead boolean NOT NULL, small boolean NOT NULL, client text COLLATE "C" NOT NULL,
    bytes_was bigint NOT NULL, bytes bigint NOT NULL, used float8 NOT NULL, seconds float8 NOT NULL, day integer NOT NULL
);
ALTER TABLE ledger SET (autovacuum_vacuum_threshold = 1000, autovacuum_vacuum_scale_factor = 0,
                        autovacuum_vacuum_insert_threshold = -1);

CREATE FUNCTION moment() RETURNS float8 LANGUAGE sql VOLATILE
    RETURN extract(epoch FROM clock_timestamp())::float8;
-- A checksum of what answers are made of, with the keys of its row: what appears under another one is found, too.
CREATE FUNCTION sum_of(keys text, data bytea) RETURNS bytea LANGUAGE sql STABLE
    RETURN substring(sha256(convert_to(keys, 'UTF8') || data) FOR 8);
CREATE FUNCTION sum_of(keys text, data text) RETURNS bytea LANGUAGE sql STABLE
    RETURN sum_of(keys, convert_to(data, 'UTF8'));
CREATE FUNCTION keys_of(a text, b text) RETURNS text LANGUAGE sql IMMUTABLE RETURN a || E'\x1f' || b;
CREATE FUNCTION piece_keys(p piece) RETURNS text LANGUAGE sql STABLE
    RETURN concat_ws(E'\x1f', p.job, p.number, p.name, p.part, p.encoding, p.header, p.last);

-- A job as it is read; good: its summary is what was written.
CREATE TYPE shown AS (
    id text, status smallint, progress smallint, attempts integer, created float8, started float8, finished float8,
    tags text, summary text, error text, refines text, priority smallint, client text, good boolean
);
-- The one with this id. Its plan is kept, which is worth it for what everybody asks.
CREATE FUNCTION get_job(p_id text) RETURNS SETOF shown LANGUAGE plpgsql ROWS 1
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan AS $$
BEGIN
    RETURN QUERY SELECT id, status, progress, attempts, created, started, finished, tags, summary, error, refines,
        priority, client, summary IS NULL OR summary_sum = sum_of(keys_of(id, status::text), summary)
        FROM job WHERE id = p_id;
END $$;

CREATE FUNCTION note_job() RETURNS trigger LANGUAGE plpgsql SET search_path = uzawa AS $$
DECLARE
    j job := coalesce(NEW, OLD);
    charge float8 := 0;
    seconds float8 := 0;
BEGIN
    IF TG_OP = 'UPDATE' AND OLD.status = 1 THEN
        -- The lease was extended when its share was charged last. A run that takes no time, or comes to no end, still
        -- was a turn.
        charge := least(OLD.lease_s, greatest(0, moment() + OLD.lease_s - OLD.lease));
        IF NEW.status <> 1 THEN
            charge := charge + 0.001;
        END IF;
        IF NEW.status >= 2 THEN
            seconds := greatest(0, NEW.finished - NEW.started);
        END IF;
    END IF;
    INSERT INTO ledger(was, becomes, share, ahead, small, client, bytes_was, bytes, used, seconds, day)
    VALUES (CASE WHEN TG_OP <> 'INSERT' THEN OLD.status END, CASE WHEN TG_OP <> 'DELETE' THEN NEW.status END, j.share,
            j.priority > 5, CASE WHEN TG_OP = 'UPDATE' AND OLD.status = 0 THEN OLD.small ELSE j.small END, j.client,
            CASE WHEN TG_OP = 'INSERT' THEN 0 ELSE OLD.bytes END, CASE WHEN TG_OP = 'DELETE' THEN 0 ELSE NEW.bytes END,
            charge, seconds, floor(j.finished / 86400));
    IF TG_OP = 'UPDATE' AND NEW.status >= 2 AND OLD.status < 2 THEN
        UPDATE webhook SET state = 1, next = NEW.finished WHERE job = NEW.id;
    END IF;
    RETURN NULL;
END $$;
CREATE TRIGGER note_new AFTER INSERT ON job FOR EACH ROW EXECUTE FUNCTION note_job();
CREATE TRIGGER note_gone AFTER DELETE ON job FOR EACH ROW EXECUTE FUNCTION note_job();
CREATE TRIGGER note_change AFTER UPDATE OF status, lease, bytes ON job FOR EACH ROW EXECUTE FUNCTION note_job();

-- The lock of those who count and choose: for good until the end of the transaction.
CREATE FUNCTION take_queue(wait boolean) RETURNS boolean LANGUAGE plpgsql AS $$
BEGIN
    IF NOT wait THEN
        RETURN pg_try_advisory_xact_lock(1970954615, 2);
    END IF;
    PERFORM pg_advisory_xact_lock(1970954615, 2);
    RETURN true;
END $$;

-- Under that lock: counts what the ledger has, in the order in which it came.
CREATE FUNCTION fold() RETURNS void LANGUAGE plpgsql
    SET search_path = uzawa SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off
    SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    e record;
    d_jobs bigint[] := '{0,0,0,0,0}';
    d_bytes bigint[] := '{0,0,0,0,0}';
    d_waiting integer;
    d_running integer;
    floor_used float8;
BEGIN
    FOR e IN WITH gone AS (DELETE FROM ledger WHERE n > 0 RETURNING *) SELECT * FROM gone ORDER BY n LOOP
        IF e.was IS NOT NULL THEN
            d_jobs[e.was + 1] := d_jobs[e.was + 1] - 1;
            d_bytes[e.was + 1] := d_bytes[e.was + 1] - e.bytes_was;
        END IF;
        IF e.becomes IS NOT NULL THEN
            d_jobs[e.becomes + 1] := d_jobs[e.becomes + 1] + 1;
            d_bytes[e.becomes + 1] := d_bytes[e.becomes + 1] + e.bytes;
        END IF;
        d_waiting := (e.becomes IS NOT DISTINCT FROM 0)::integer - (e.was IS NOT DISTINCT FROM 0)::integer;
        d_running := (e.becomes IS NOT DISTINCT FROM 1)::integer - (e.was IS NOT DISTINCT FROM 1)::integer;
        IF e.client <> '' THEN
            INSERT INTO client(name, waiting, bytes, day, seconds)
            VALUES (e.client, d_waiting, e.bytes - e.bytes_was, e.day, e.seconds)
            ON CONFLICT (name) DO UPDATE SET waiting = client.waiting + excluded.waiting,
                bytes = client.bytes + excluded.bytes,
                seconds = CASE WHEN excluded.seconds = 0 OR client.day = excluded.day THEN client.seconds ELSE 0 END
                          + excluded.seconds,
                day = CASE WHEN excluded.seconds = 0 THEN client.day ELSE excluded.day END;
        END IF;
        IF d_waiting = 0 AND d_running = 0 AND e.used = 0 THEN
            CONTINUE;
        END IF;
        SELECT used INTO floor_used FROM share WHERE waiting + running > 0 AND ahead = e.ahead ORDER BY used LIMIT 1;
        -- One that comes begins where the least of the others stands: there is no credit for the time before.
        INSERT INTO share(name, ahead, waiting, small, running, used)
        VALUES (e.share, e.ahead, d_waiting, d_waiting * e.small::integer, d_running, coalesce(floor_used, 0) + e.used)
        ON CONFLICT (name, ahead) DO UPDATE SET waiting = share.waiting + excluded.waiting,
            small = share.small + excluded.small, running = share.running + excluded.running,
            used = CASE WHEN e.was IS NULL AND share.waiting + share.running = 0
                        THEN greatest(share.used, excluded.used) ELSE share.used + e.used END;
        -- It goes when it has nothing and they have passed it.
        IF d_waiting + d_running < 0 THEN
            SELECT used INTO floor_used FROM share WHERE waiting + running > 0 AND ahead = e.ahead ORDER BY used LIMIT 1;
            DELETE FROM share WHERE waiting + running = 0 AND ahead = e.ahead
                AND used <= coalesce(floor_used, 'Infinity');
        END IF;
    END LOOP;
    UPDATE tally SET jobs = jobs + d_jobs[status + 1], bytes = bytes + d_bytes[status + 1]
        WHERE d_jobs[status + 1] <> 0 OR d_bytes[status + 1] <> 0;
END $$;

-- Jobs and bytes in each status now.
CREATE VIEW counted AS
    SELECT status, sum(jobs)::bigint AS jobs, sum(bytes)::bigint AS bytes FROM (
        SELECT status, jobs, bytes FROM tally
        UNION ALL SELECT was, -1, -bytes_was FROM ledger WHERE was IS NOT NULL
        UNION ALL SELECT becomes, 1, bytes FROM ledger WHERE becomes IS NOT NULL) AS each GROUP BY status;

-- What this client has of: waiting jobs, bytes of jobs and uploads, seconds of workers today; those that are to be known.
CREATE FUNCTION client_has(who text, OUT waiting bigint, OUT bytes bigint, OUT seconds float8) LANGUAGE sql STABLE
    SET search_path = uzawa AS $$
    WITH late AS (SELECT coalesce(sum((becomes IS NOT DISTINCT FROM 0)::integer - (was IS NOT DISTINCT FROM 0)::integer), 0)
                  AS waiting, coalesce(sum(bytes - bytes_was), 0) AS bytes,
                  coalesce(sum(seconds) FILTER (WHERE day = floor(moment() / 86400)), 0) AS seconds
                  FROM ledger WHERE client = who)
    SELECT (late.waiting + coalesce((SELECT waiting FROM client WHERE name = who), 0))::bigint,
           (late.bytes + coalesce((SELECT bytes FROM client WHERE name = who), 0)
            + coalesce((SELECT sum(upload.bytes) FROM upload_client JOIN upload ON id = upload
                        WHERE upload_client.client = who), 0))::bigint,
           late.seconds + coalesce((SELECT seconds FROM client WHERE name = who AND day = floor(moment() / 86400)), 0)
    FROM late $$;

-- verdict: "new"; "repeat" with the job that came with the key before, "differs": with another body; "again": this id is
-- there, the submission was carried out before and its answer lost; "busy", "waiting", "bytes", "seconds": of these
-- there are as many as may; "upload": one is not there.
CREATE FUNCTION submit(p_id text, p_created float8, p_body bytea, p_digest bytea, p_tags text, p_client text,
    p_share text, p_key text, p_refines text, p_uploads text[], p_any_upload boolean, p_priority integer,
    p_small boolean, p_webhook text, p_queue_limit float8, p_max_queue bigint, p_waiting bigint, p_bytes bigint,
    p_seconds float8, OUT verdict text, OUT job text) LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    has record;
    asked integer;
    found_uploads integer;
BEGIN
    job := p_id;
    IF EXISTS (SELECT 1 FROM job AS j WHERE j.id = p_id) THEN
        verdict := 'again';
        RETURN;
    END IF;
    IF p_key IS NOT NULL THEN
        SELECT CASE WHEN r.digest = p_digest THEN 'repeat' ELSE 'differs' END, j.id INTO verdict, job
            FROM job AS j JOIN request AS r ON r.job = j.id WHERE j.key = p_key;
        IF FOUND THEN
            RETURN;
        END IF;
        job := p_id;
    END IF;
    IF p_max_queue > 0 AND (SELECT c.jobs FROM counted AS c WHERE c.status = 0) >= p_max_queue THEN
        verdict := 'busy';
        RETURN;
    END IF;
    IF p_client <> '' AND (p_waiting > 0 OR p_bytes > 0 OR p_seconds > 0) THEN
        SELECT * INTO has FROM client_has(p_client);
        verdict := CASE WHEN p_waiting > 0 AND has.waiting >= p_waiting THEN 'waiting'
                        WHEN p_bytes > 0 AND has.bytes + length(p_body) > p_bytes THEN 'bytes'
                        WHEN p_seconds > 0 AND has.seconds >= p_seconds THEN 'seconds' END;
        IF verdict IS NOT NULL THEN
            RETURN;
        END IF;
    END IF;
    IF p_uploads IS NOT NULL THEN
        SELECT count(DISTINCT each) INTO asked FROM unnest(p_uploads) AS each;
        PERFORM 1 FROM upload AS u WHERE u.id = ANY(p_uploads) ORDER BY u.id FOR NO KEY UPDATE;
        UPDATE upload AS u SET used = moment() WHERE u.id = ANY(p_uploads) AND (p_any_upload OR EXISTS
            (SELECT 1 FROM upload_client AS c WHERE c.upload = u.id AND c.client = p_client));
        GET DIAGNOSTICS found_uploads = ROW_COUNT;
        IF found_uploads < asked THEN
            verdict := 'upload';
            RETURN;
        END IF;
    END IF;
    INSERT INTO job(id, created, tags, key, refines, priority, queue_until, bytes, client, share, small)
        VALUES (p_id, p_created, p_tags, p_key, p_refines, p_priority,
                CASE WHEN p_queue_limit > 0 THEN moment() + p_queue_limit ELSE 0 END, length(p_body), p_client, p_share,
                p_small);
    INSERT INTO request(job, body, digest) VALUES (p_id, p_body, p_digest);
    IF p_tags <> '[]' THEN
        INSERT INTO tag(tag, job) SELECT DISTINCT value #>> '{}', p_id FROM jsonb_array_elements(p_tags::jsonb) AS value
            WHERE jsonb_typeof(value) = 'string';
    END IF;
    IF p_uploads IS NOT NULL THEN
        INSERT INTO upload_use(upload, job) SELECT DISTINCT each, p_id FROM unnest(p_uploads) AS each;
    END IF;
    IF p_webhook IS NOT NULL THEN
        INSERT INTO webhook(job, url) VALUES (p_id, p_webhook);
    END IF;
    verdict := 'new';
END $$;

-- What a claim gives; the body where it is short.
CREATE TYPE claimed AS (id text, attempts integer, created float8, started float8, tags text, refines text,
                        priority smallint, client text, token bigint, body bytea, digest bytea);
CREATE FUNCTION claim(p_node text, p_owner text, p_lease float8, p_small boolean) RETURNS SETOF claimed
    LANGUAGE plpgsql ROWS 1
    SET search_path = uzawa SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off
    SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    s record;
    chosen text;
    now float8;
BEGIN
    PERFORM take_queue(true);
    PERFORM fold();
    now := moment();
    -- A share whose jobs have all waited longer than they may, which nobody has said yet, is passed over.
    IF p_small THEN
        FOR s IN SELECT name, ahead FROM share WHERE share.small > 0 ORDER BY ahead DESC, running, used, name LOOP
            SELECT id INTO chosen FROM job WHERE status = 0 AND job.small AND job.share = s.name
                AND (priority > 5) = s.ahead AND (queue_until = 0 OR queue_until >= now)
                ORDER BY priority DESC, id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
            EXIT WHEN FOUND;
        END LOOP;
    ELSE
        FOR s IN SELECT name, ahead FROM share WHERE waiting > 0 ORDER BY ahead DESC, running, used, name LOOP
            SELECT id INTO chosen FROM job WHERE status = 0 AND job.share = s.name
                AND (priority > 5) = s.ahead AND (queue_until = 0 OR queue_until >= now)
                ORDER BY priority DESC, id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
            EXIT WHEN FOUND;
        END LOOP;
    END IF;
    IF chosen IS NULL THEN
        RETURN;
    END IF;
    UPDATE job SET status = 1, attempts = attempts + 1, progress = 0, started = now, finished = 0, node = p_node,
        owner = p_owner, token = nextval('token'), lease = now + p_lease, lease_s = p_lease WHERE id = chosen;
    RETURN QUERY SELECT j.id, j.attempts, j.created, j.started, j.tags, j.refines, j.priority, j.client, j.token, r.body,
        r.digest FROM job AS j LEFT JOIN request AS r ON r.job = j.id AND length(r.body) <= 65536 WHERE j.id = chosen;
END $$;

-- Raises what says that a lease is no good: the transaction is taken back with all that was written before.
CREATE FUNCTION refuse_lease(p_job text) RETURNS void LANGUAGE plpgsql SET search_path = uzawa AS $$
BEGIN
    IF EXISTS (SELECT 1 FROM job WHERE id = p_job) THEN
        RAISE EXCEPTION 'the job is no longer this owner''s' USING ERRCODE = 'UZ001';
    END IF;
    RAISE EXCEPTION 'there is no such job' USING ERRCODE = 'UZ002';
END $$;

-- Whether it was told to end.
CREATE FUNCTION renew(p_job text, p_owner text, p_token bigint, p_progress integer) RETURNS boolean LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    told boolean;
BEGIN
    UPDATE job SET lease = moment() + lease_s, progress = p_progress
        WHERE id = p_job AND status = 1 AND owner = p_owner AND token = p_token RETURNING finished > 0 INTO told;
    IF NOT FOUND THEN
        PERFORM refuse_lease(p_job);
    END IF;
    RETURN told;
END $$;

CREATE FUNCTION release(p_job text, p_owner text, p_token bigint, p_counted boolean) RETURNS void LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
BEGIN
    UPDATE job SET status = CASE WHEN finished > 0 THEN 4 ELSE 0 END,
        attempts = attempts - CASE WHEN finished > 0 OR p_counted THEN 0 ELSE 1 END,
        progress = CASE WHEN finished > 0 THEN progress ELSE 0 END,
        started = CASE WHEN finished > 0 THEN started ELSE 0 END,
        node = NULL, owner = NULL, lease = 0, queue_until = 0, small = small AND finished > 0
        WHERE id = p_job AND status = 1 AND owner = p_owner AND token = p_token;
    IF NOT FOUND THEN
        PERFORM refuse_lease(p_job);
    END IF;
END $$;

-- Pieces of the result of a job; their bytes one after another in p_data.
CREATE FUNCTION put_pieces(p_job text, p_token bigint, p_numbers bigint[], p_names text[], p_parts bigint[],
    p_encodings bigint[], p_headers bigint[], p_lasts float8[], p_sizes bigint[], p_data bytea) RETURNS void
    LANGUAGE plpgsql SET search_path = uzawa SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    p piece;
    at integer := 1;
BEGIN
    FOR i IN 1 .. array_length(p_numbers, 1) LOOP
        p := ROW(p_job, p_token, p_numbers[i], p_names[i], p_parts[i], p_encodings[i], p_headers[i], p_lasts[i],
                 substring(p_data FROM at FOR p_sizes[i]::integer), NULL);
        p.sum := sum_of(piece_keys(p), p.data);
        INSERT INTO piece VALUES (p.*);
        at := at + p_sizes[i];
    END LOOP;
END $$;

-- The last statement of its transaction: the job's row is locked no longer than that. p_again: it was tried before and
-- the answer was lost; what that has done counts.
CREATE FUNCTION finish(p_job text, p_owner text, p_token bigint, p_again boolean, p_status integer, p_summary text,
    p_error text, p_bytes bigint, p_contents text) RETURNS void LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
BEGIN
    UPDATE job SET status = p_status, finished = moment(), summary = p_summary, error = p_error, node = NULL,
        owner = NULL, lease = 0, progress = CASE WHEN p_status = 2 THEN 100 ELSE progress END,
        summary_sum = sum_of(keys_of(id, p_status::text), p_summary), bytes = bytes + p_bytes, contents = p_contents,
        contents_sum = sum_of(id, p_contents)
        WHERE id = p_job AND status = 1 AND owner = p_owner AND token = p_token;
    IF NOT FOUND AND p_again THEN
        PERFORM 1 FROM job WHERE id = p_job AND status = p_status AND token = p_token;
    END IF;
    IF NOT FOUND THEN
        PERFORM refuse_lease(p_job);
    END IF;
END $$;

-- Running jobs that are nobody's any more: the lease is over, or the daemon gone. Those that were told to end do, those
-- that have had their attempts fail, the others wait again.
CREATE FUNCTION take_back(p_most integer, p_error text) RETURNS TABLE(job text, becomes smallint) LANGUAGE plpgsql
    SET search_path = uzawa SET jit = off SET enable_seqscan = off AS $$
DECLARE
    now float8 := moment();
BEGIN
    RETURN QUERY UPDATE job AS j SET
        status = CASE WHEN finished > 0 THEN 4 WHEN attempts >= p_most THEN 3 ELSE 0 END,
        finished = CASE WHEN finished > 0 THEN finished WHEN attempts >= p_most THEN now ELSE 0 END,
        error = CASE WHEN finished = 0 AND attempts >= p_most THEN p_error ELSE error END,
        progress = CASE WHEN finished = 0 AND attempts < p_most THEN 0 ELSE progress END,
        started = CASE WHEN finished = 0 AND attempts < p_most THEN 0 ELSE started END,
        node = NULL, owner = NULL, lease = 0, queue_until = 0
        WHERE j.id IN (SELECT i.id FROM job AS i WHERE i.status = 1 AND (i.lease < now OR NOT EXISTS
            (SELECT 1 FROM node WHERE node.id = i.node)) FOR NO KEY UPDATE SKIP LOCKED)
        RETURNING j.id, j.status;
END $$;

-- What has to happen without anybody asking. p_error: for those that waited too long.
CREATE FUNCTION expire(p_error text, p_most integer, p_lost text) RETURNS TABLE(job text, becomes smallint, waited boolean)
    LANGUAGE plpgsql SET search_path = uzawa SET jit = off SET enable_seqscan = off AS $$
DECLARE
    now float8 := moment();
BEGIN
    IF EXISTS (SELECT 1 FROM ledger) AND take_queue(false) THEN
        PERFORM fold();
    END IF;
    RETURN QUERY UPDATE job AS j SET status = 3, finished = now, error = p_error
        WHERE j.id IN (SELECT i.id FROM job AS i WHERE i.status = 0 AND i.queue_until > 0 AND i.queue_until < now
                       FOR NO KEY UPDATE SKIP LOCKED)
        RETURNING j.id, j.status, true;
    IF p_most > 0 THEN
        RETURN QUERY SELECT t.job, t.becomes, false FROM take_back(p_most, p_lost) AS t;
    END IF;
END $$;

-- Ended jobs that are too old, too many or too large together, the oldest first: at most 20 of them, or 64 MiB.
CREATE FUNCTION retain(p_now float8, p_keep_s float8, p_jobs bigint, p_bytes bigint) RETURNS TABLE(job text, client text)
    LANGUAGE plpgsql SET search_path = uzawa SET jit = off SET enable_seqscan = off AS $$
DECLARE
    have record;
    j record;
    chosen text[] := '{}';
    size bigint := 0;
BEGIN
    SELECT sum(c.jobs)::bigint AS jobs, sum(c.bytes)::bigint AS bytes INTO have FROM counted AS c WHERE status >= 2;
    FOR j IN SELECT i.id, i.finished, i.bytes FROM job AS i WHERE i.status >= 2
        AND NOT EXISTS (SELECT 1 FROM webhook AS w WHERE w.job = i.id AND w.state = 1)
        ORDER BY i.finished, i.id LIMIT 20 FOR UPDATE SKIP LOCKED LOOP
        EXIT WHEN size >= 67108864 OR NOT ((p_keep_s > 0 AND j.finished < p_now - p_keep_s)
            OR (p_jobs > 0 AND have.jobs > p_jobs) OR (p_bytes > 0 AND have.bytes > p_bytes));
        chosen := chosen || j.id;
        size := size + j.bytes;
        have.jobs := have.jobs - 1;
        have.bytes := have.bytes - j.bytes;
    END LOOP;
    RETURN QUERY DELETE FROM job AS d WHERE d.id = ANY(chosen) RETURNING d.id, d.client;
END $$;

CREATE FUNCTION dismiss(p_job text, OUT was smallint, OUT client text) LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
BEGIN
    SELECT j.status, j.client INTO was, client FROM job AS j WHERE j.id = p_job FOR UPDATE;
    IF was = 0 THEN
        UPDATE job AS j SET status = 4, finished = moment() WHERE j.id = p_job;
    ELSIF was = 1 THEN
        UPDATE job AS j SET finished = moment() WHERE j.id = p_job AND j.finished = 0;
    ELSIF was >= 2 THEN
        DELETE FROM job AS j WHERE j.id = p_job;
    END IF;
END $$;

-- The one that has been due for longest of those that are not at these places. It is this caller's for a minute: others
-- that ask meanwhile get another one. Neither scheme nor host are of upper or lower case; what follows the place is no
-- more of a host or port.
CREATE FUNCTION webhook_next(p_except text[]) RETURNS TABLE(job text, url text, attempts integer) LANGUAGE plpgsql
    SET search_path = uzawa SET jit = off SET enable_seqscan = off AS $$
DECLARE
    now float8 := moment();
BEGIN
    RETURN QUERY UPDATE webhook AS w SET next = now + 60 WHERE w.job = (SELECT i.job FROM webhook AS i
        WHERE i.state = 1 AND i.next <= now AND NOT EXISTS (SELECT 1 FROM unnest(p_except) AS place
            WHERE lower(left(i.url, length(place))) = lower(place)
            AND position(substring(i.url FROM length(place) + 1 FOR 1) IN '/?#') > 0)
        ORDER BY i.next LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED)
        RETURNING w.job, w.url, w.attempts;
END $$;

CREATE FUNCTION webhook_attempted(p_job text, p_url text, p_state integer, p_delay float8, p_silent float8) RETURNS void
    LANGUAGE plpgsql SET search_path = uzawa AS $$
BEGIN
    IF p_silent > 0 THEN
        UPDATE webhook AS w SET next = greatest(w.next, moment() + p_silent) WHERE w.job IN
            (SELECT i.job FROM webhook AS i WHERE i.state = 1 AND i.url = p_url AND i.job <> p_job
             FOR NO KEY UPDATE SKIP LOCKED);
    END IF;
    UPDATE webhook SET state = p_state, next = moment() + p_delay, attempts = attempts + 1 WHERE job = p_job;
END $$;

-- Of a client, or of anybody where that is NULL.
CREATE FUNCTION upload_row(p_id text, p_client text) RETURNS TABLE(bytes bigint, created float8, used float8, jobs bigint)
    LANGUAGE sql STABLE SET search_path = uzawa AS $$
    SELECT u.bytes, u.created, u.used, (SELECT count(*) FROM upload_use AS n JOIN job AS j ON j.id = n.job
        WHERE n.upload = u.id AND (p_client IS NULL OR j.client = p_client))
    FROM upload AS u WHERE u.id = p_id AND (p_client IS NULL OR EXISTS
        (SELECT 1 FROM upload_client AS c WHERE c.upload = u.id AND c.client = p_client)) $$;

-- excess: of bytes it would have more than it may.
CREATE FUNCTION upload_add(p_id text, p_client text, p_bytes bigint, p_most bigint, OUT known boolean, OUT excess boolean)
    LANGUAGE plpgsql SET search_path = uzawa AS $$
DECLARE
    now float8 := moment();
BEGIN
    known := EXISTS (SELECT 1 FROM upload_client WHERE upload = p_id AND client = p_client);
    excess := NOT known AND p_client <> '' AND p_most > 0 AND (SELECT h.bytes FROM client_has(p_client) AS h) + p_bytes > p_most;
    IF excess THEN
        RETURN;
    END IF;
    INSERT INTO upload(id, bytes, created, used) VALUES (p_id, p_bytes, now, now)
        ON CONFLICT (id) DO UPDATE SET used = excluded.used;
    INSERT INTO upload_client(upload, client) VALUES (p_id, p_client) ON CONFLICT DO NOTHING;
END $$;

-- verdict: "none", "used", "kept": others have it; "gone".
CREATE FUNCTION upload_forget(p_id text, p_client text) RETURNS text LANGUAGE plpgsql SET search_path = uzawa AS $$
DECLARE
    has record;
BEGIN
    PERFORM 1 FROM upload WHERE id = p_id FOR UPDATE;
    SELECT * INTO has FROM upload_row(p_id, p_client);
    IF NOT FOUND THEN
        RETURN 'none';
    ELSIF has.jobs > 0 THEN
        RETURN 'used';
    END IF;
    DELETE FROM upload_client WHERE upload = p_id AND (p_client IS NULL OR client = p_client);
    DELETE FROM upload WHERE id = p_id AND NOT EXISTS (SELECT 1 FROM upload_use WHERE upload = p_id)
        AND NOT EXISTS (SELECT 1 FROM upload_client WHERE upload = p_id);
    RETURN CASE WHEN FOUND THEN 'gone' ELSE 'kept' END;
END $$;

-- What was written under p_from is the blob p_id from now on.
CREATE FUNCTION blob_publish(p_from text, p_id text) RETURNS void LANGUAGE plpgsql SET search_path = uzawa AS $$
BEGIN
    INSERT INTO blob(id, written, sealed) VALUES (p_id, moment(), true)
        ON CONFLICT (id) DO UPDATE SET written = excluded.written;
    DELETE FROM blob_piece WHERE blob = p_id;
    UPDATE blob_piece SET blob = p_id WHERE blob = p_from;
    DELETE FROM blob WHERE id = p_from;
END $$;
-- A row that names it keeps it: then this fails. What a row will name is there for an hour at least, and for a day while
-- it is being written.
CREATE FUNCTION blob_sweep() RETURNS void LANGUAGE sql SET search_path = uzawa AS $$
    DELETE FROM blob AS b WHERE b.written < moment() - CASE WHEN b.sealed THEN 3600 ELSE 86400 END
        AND NOT EXISTS (SELECT 1 FROM upload AS u WHERE u.id = b.id) $$;
