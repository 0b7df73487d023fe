-- Version 4: the same with fewer statements for each job. Daemons of version 3 go on meanwhile and afterwards.
--
-- What every job passes through names its tables in full: a function that sets its search path has everything looked up
-- anew.
SET LOCAL search_path = uzawa;

-- A result has many pieces, each of which would look for its job. Whoever writes some ends the job in the same
-- transaction, or takes them back; they go with it by note_job.
ALTER TABLE piece DROP CONSTRAINT piece_job_fkey;

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
        DELETE FROM uzawa.piece WHERE job = OLD.id;
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

-- Changes of a share that came one after another; came: a job was new.
CREATE FUNCTION fold_share(p_name text, p_ahead boolean, p_waiting integer, p_small integer, p_running integer,
    p_used float8, p_came boolean) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
    floor_used float8;
BEGIN
    UPDATE uzawa.share AS s SET waiting = s.waiting + p_waiting, small = s.small + p_small,
        running = s.running + p_running, used = s.used + p_used
        WHERE s.name = p_name AND s.ahead = p_ahead AND (s.waiting + s.running > 0 OR NOT p_came);
    IF NOT FOUND THEN
        SELECT used INTO floor_used FROM uzawa.share WHERE waiting + running > 0 AND ahead = p_ahead ORDER BY used LIMIT 1;
        -- One that comes begins where the least of the others stands: there is no credit for the time before.
        INSERT INTO uzawa.share AS s(name, ahead, waiting, small, running, used)
        VALUES (p_name, p_ahead, p_waiting, p_small, p_running, coalesce(floor_used, 0) + p_used)
        ON CONFLICT (name, ahead) DO UPDATE SET waiting = s.waiting + p_waiting, small = s.small + p_small,
            running = s.running + p_running, used = greatest(s.used, coalesce(floor_used, 0)) + p_used;
    END IF;
    -- It goes when it has nothing and they have passed it.
    IF p_waiting + p_running < 0 OR (p_came AND p_waiting + p_running = 0) THEN
        SELECT used INTO floor_used FROM uzawa.share WHERE waiting + running > 0 AND ahead = p_ahead ORDER BY used LIMIT 1;
        DELETE FROM uzawa.share WHERE waiting + running = 0 AND ahead = p_ahead
            AND used <= coalesce(floor_used, 'Infinity');
    END IF;
END $$;

-- As before, but what one share has in a row is brought there at once.
CREATE OR REPLACE FUNCTION fold() RETURNS void LANGUAGE plpgsql
    SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    e record;
    d_jobs bigint[] := '{0,0,0,0,0}';
    d_bytes bigint[] := '{0,0,0,0,0}';
    name text;
    ahead boolean;
    waiting integer;
    small integer;
    running integer;
    used float8;
    came boolean;
    one integer;
BEGIN
    FOR e IN WITH gone AS (DELETE FROM uzawa.ledger WHERE n > 0 RETURNING *) SELECT * FROM gone ORDER BY n LOOP
        IF name IS NULL OR e.share <> name OR e.ahead <> ahead THEN
            IF name IS NOT NULL THEN
                PERFORM uzawa.fold_share(name, ahead, waiting, small, running, used, came);
            END IF;
            name := e.share;
            ahead := e.ahead;
            waiting := 0;
            small := 0;
            running := 0;
            used := 0;
            came := false;
        END IF;
        one := 0;
        IF e.was IS NOT NULL THEN
            d_jobs[e.was + 1] := d_jobs[e.was + 1] - 1;
            d_bytes[e.was + 1] := d_bytes[e.was + 1] - e.bytes_was;
            IF e.was = 0 THEN
                one := -1;
            ELSIF e.was = 1 THEN
                running := running - 1;
            END IF;
        ELSE
            came := true;
        END IF;
        IF e.becomes IS NOT NULL THEN
            d_jobs[e.becomes + 1] := d_jobs[e.becomes + 1] + 1;
            d_bytes[e.becomes + 1] := d_bytes[e.becomes + 1] + e.bytes;
            IF e.becomes = 0 THEN
                one := one + 1;
            ELSIF e.becomes = 1 THEN
                running := running + 1;
            END IF;
        END IF;
        IF one <> 0 THEN
            waiting := waiting + one;
            IF e.small THEN
                small := small + one;
            END IF;
        END IF;
        used := used + e.used;
        IF e.client <> '' THEN
            INSERT INTO uzawa.client(name, waiting, bytes, day, seconds)
            VALUES (e.client, one, e.bytes - e.bytes_was, e.day, e.seconds)
            ON CONFLICT ON CONSTRAINT client_pkey DO UPDATE SET waiting = client.waiting + excluded.waiting,
                bytes = client.bytes + excluded.bytes,
                seconds = CASE WHEN excluded.seconds = 0 OR client.day = excluded.day THEN client.seconds ELSE 0 END
                          + excluded.seconds,
                day = CASE WHEN excluded.seconds = 0 THEN client.day ELSE excluded.day END;
        END IF;
    END LOOP;
    IF name IS NOT NULL THEN
        PERFORM uzawa.fold_share(name, ahead, waiting, small, running, used, came);
        UPDATE uzawa.tally AS t SET jobs = t.jobs + d_jobs[t.status + 1], bytes = t.bytes + d_bytes[t.status + 1]
            WHERE d_jobs[t.status + 1] <> 0 OR d_bytes[t.status + 1] <> 0;
    END IF;
END $$;

-- A request whose body is in objects, in order. Daemons of version 3, which find no body, give its job back.
CREATE TABLE request_placed(
    job text COLLATE "C" PRIMARY KEY REFERENCES job(id) ON DELETE CASCADE, size bigint NOT NULL, digest bytea NOT NULL,
    objects text[] COLLATE "C" NOT NULL
);
CREATE FUNCTION request_digest(p_job text) RETURNS bytea LANGUAGE sql STABLE
    RETURN coalesce((SELECT r.digest FROM request AS r WHERE r.job = p_job),
                    (SELECT p.digest FROM request_placed AS p WHERE p.job = p_job));

-- As submit_2, in one. p_again: it was tried before and the answer was lost. p_body NULL: it is in p_objects.
CREATE FUNCTION submit_3(p_id text, p_created float8, p_body bytea, p_digest bytea, p_tags text, p_client text,
    p_share text, p_key text, p_refines text, p_uploads text[], p_any_upload boolean, p_priority integer,
    p_small boolean, p_webhook text, p_queue_limit float8, p_max_queue bigint, p_waiting bigint, p_bytes bigint,
    p_seconds float8, p_held bigint, p_again boolean, p_size bigint, p_objects text[], OUT verdict text, OUT job text) LANGUAGE plpgsql
    SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    has record;
    asked integer;
    found_uploads integer;
BEGIN
    job := p_id;
    IF p_again AND EXISTS (SELECT 1 FROM uzawa.job AS j WHERE j.id = p_id) THEN
        verdict := 'again';
        RETURN;
    END IF;
    IF p_key IS NOT NULL THEN
        SELECT CASE WHEN uzawa.request_digest(j.id) = p_digest THEN 'repeat' ELSE 'differs' END, j.id INTO verdict, job
            FROM uzawa.job AS j WHERE j.key = p_key;
        IF FOUND THEN
            RETURN;
        END IF;
        job := p_id;
    END IF;
    IF p_max_queue > 0 AND (SELECT c.jobs FROM uzawa.counted AS c WHERE c.status = 0) >= p_max_queue THEN
        verdict := 'busy';
        RETURN;
    END IF;
    IF p_client <> '' AND (p_waiting > 0 OR p_bytes > 0 OR p_seconds > 0) THEN
        SELECT * INTO has FROM uzawa.client_has(p_client);
        verdict := CASE WHEN p_waiting > 0 AND has.waiting >= p_waiting THEN 'waiting'
                        WHEN p_bytes > 0 AND has.bytes + p_size > p_bytes THEN 'bytes'
                        WHEN p_seconds > 0 AND has.seconds >= p_seconds THEN 'seconds' END;
        IF verdict IS NOT NULL THEN
            RETURN;
        END IF;
    END IF;
    IF p_uploads IS NOT NULL THEN
        SELECT count(DISTINCT each) INTO asked FROM unnest(p_uploads) AS each;
        PERFORM 1 FROM uzawa.upload AS u WHERE u.id = ANY(p_uploads) ORDER BY u.id FOR NO KEY UPDATE;
        UPDATE uzawa.upload AS u SET used = uzawa.moment() WHERE u.id = ANY(p_uploads) AND (p_any_upload OR EXISTS
            (SELECT 1 FROM uzawa.upload_client AS c WHERE c.upload = u.id AND c.client = p_client));
        GET DIAGNOSTICS found_uploads = ROW_COUNT;
        IF found_uploads < asked THEN
            verdict := 'upload';
            RETURN;
        END IF;
    END IF;
    INSERT INTO uzawa.job(id, created, tags, key, refines, priority, queue_until, bytes, client, share, small, body)
        VALUES (p_id, p_created, p_tags, p_key, p_refines, p_priority,
                CASE WHEN p_queue_limit > 0 THEN uzawa.moment() + p_queue_limit ELSE 0 END, p_size, p_client,
                p_share, p_small, p_held);
    IF p_body IS NOT NULL THEN
        INSERT INTO uzawa.request(job, body, digest) VALUES (p_id, p_body, p_digest);
    ELSE
        PERFORM uzawa.object_keep(p_objects, p_id, NULL);
        INSERT INTO uzawa.request_placed(job, size, digest, objects) VALUES (p_id, p_size, p_digest, p_objects);
    END IF;
    IF p_tags <> '[]' THEN
        INSERT INTO uzawa.tag(tag, job) SELECT DISTINCT value #>> '{}', p_id
            FROM jsonb_array_elements(p_tags::jsonb) AS value WHERE jsonb_typeof(value) = 'string';
    END IF;
    IF p_uploads IS NOT NULL THEN
        INSERT INTO uzawa.upload_use(upload, job) SELECT DISTINCT each, p_id FROM unnest(p_uploads) AS each;
    END IF;
    IF p_webhook IS NOT NULL THEN
        INSERT INTO uzawa.webhook(job, url) VALUES (p_id, p_webhook);
    END IF;
    verdict := 'new';
END $$;

-- As claim_2. A job whose body this node has, if it is the first of the share whose turn it is, needs no choice.
--
-- p_more: so many more, of the jobs that come next, where nobody else's wait, all are small, this node has their bodies,
-- and four times as many wait.
CREATE FUNCTION claim_3(p_node text, p_owner text, p_lease float8, p_small boolean, p_bound float8, p_more integer)
    RETURNS SETOF claimed_2 LANGUAGE plpgsql ROWS 1
    SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    s record;
    first record;
    chosen text;
    its_body bigint;
    its_fit integer;
    is_small boolean;
    wait float8;
    later float8;
    now float8;
    got uzawa.claimed_2;
BEGIN
    IF EXISTS (SELECT 1 FROM uzawa.node AS n WHERE n.id = p_node AND n.draining) THEN
        RETURN;
    END IF;
    PERFORM pg_advisory_xact_lock(1970954615, 2); -- as take_queue has it
    PERFORM uzawa.fold();
    now := uzawa.moment();
    -- A share whose jobs have all waited longer than they may, or are left to others, is passed over.
    FOR s IN SELECT h.name, h.ahead, h.waiting FROM uzawa.share AS h WHERE h.waiting > 0 AND (h.small > 0 OR NOT p_small)
        ORDER BY h.ahead DESC, h.running, h.used, h.name LOOP
        IF p_small THEN
            SELECT j.id, j.body, j.passed INTO first FROM uzawa.job AS j WHERE j.status = 0 AND j.small
                AND j.share = s.name AND (j.priority > 5) = s.ahead AND (j.queue_until = 0 OR j.queue_until >= now)
                ORDER BY j.priority DESC, j.id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
        ELSE
            SELECT j.id, j.body, j.passed INTO first FROM uzawa.job AS j WHERE j.status = 0
                AND j.share = s.name AND (j.priority > 5) = s.ahead AND (j.queue_until = 0 OR j.queue_until >= now)
                ORDER BY j.priority DESC, j.id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
        END IF;
        CONTINUE WHEN NOT FOUND;
        its_fit := 0;
        IF first.body IS NOT NULL THEN
            SELECT CASE WHEN bool_or(h.node = p_node) THEN 1 WHEN count(*) > 0 THEN 2 ELSE 0 END INTO its_fit
                FROM uzawa.holding AS h WHERE h.body = first.body;
        END IF;
        IF p_bound <= 0 OR first.body IS NULL OR its_fit = 1
            OR (first.passed > 0 AND now - first.passed >= p_bound) THEN
            chosen := first.id;
            its_body := first.body;
            EXIT;
        END IF;
        SELECT * INTO chosen, its_body, its_fit, wait FROM uzawa.choose(p_node, s.name, s.ahead, p_small, p_bound, now);
        EXIT WHEN chosen IS NOT NULL;
        later := least(later, wait);
    END LOOP;
    IF chosen IS NULL THEN
        IF later IS NOT NULL THEN
            got.fit := 0;
            got.later := later;
            RETURN NEXT got;
        END IF;
        RETURN;
    END IF;
    IF its_body IS NOT NULL AND its_fit <> 1 THEN
        INSERT INTO uzawa.holding(body, node) SELECT its_body, n.id FROM uzawa.node AS n WHERE n.id = p_node
            ON CONFLICT DO NOTHING;
    END IF;
    UPDATE uzawa.job AS j SET status = 1, attempts = j.attempts + 1, progress = 0, started = now, finished = 0,
        node = p_node, owner = p_owner, token = nextval('uzawa.token'), lease = now + p_lease, lease_s = p_lease
        WHERE j.id = chosen
        RETURNING j.id, j.attempts, j.created, j.started, j.tags, j.refines, j.priority, j.client, j.token, NULL::bytea,
            NULL::bytea, j.body, its_fit, NULL::float8 INTO got;
    SELECT r.body, r.digest, j.small INTO got.body, got.digest, is_small FROM uzawa.job AS j
        LEFT JOIN uzawa.request AS r ON r.job = j.id AND length(r.body) <= 65536 WHERE j.id = chosen;
    RETURN NEXT got;
    IF p_more = 0 OR s.waiting < 5 OR NOT is_small
        OR EXISTS (SELECT 1 FROM uzawa.share AS h WHERE h.waiting > 0 AND (h.name <> s.name OR h.ahead <> s.ahead)) THEN
        RETURN;
    END IF;
    FOR first IN SELECT j.id, j.small, j.body FROM uzawa.job AS j WHERE j.status = 0 AND j.share = s.name
        AND (j.priority > 5) = s.ahead AND (j.queue_until = 0 OR j.queue_until >= now)
        ORDER BY j.priority DESC, j.id LIMIT least(p_more, (s.waiting - 1) / 4) FOR NO KEY UPDATE SKIP LOCKED LOOP
        EXIT WHEN NOT first.small OR (first.body IS NOT NULL AND first.body IS DISTINCT FROM its_body AND NOT EXISTS
            (SELECT 1 FROM uzawa.holding AS h WHERE h.body = first.body AND h.node = p_node));
        UPDATE uzawa.job AS j SET status = 1, attempts = j.attempts + 1, progress = 0, started = now, finished = 0,
            node = p_node, owner = p_owner, token = nextval('uzawa.token'), lease = now + p_lease, lease_s = p_lease
            WHERE j.id = first.id
            RETURNING j.id, j.attempts, j.created, j.started, j.tags, j.refines, j.priority, j.client, j.token,
                NULL::bytea, NULL::bytea, j.body, 1, NULL::float8 INTO got;
        SELECT r.body, r.digest INTO got.body, got.digest FROM uzawa.request AS r
            WHERE r.job = first.id AND length(r.body) <= 65536;
        RETURN NEXT got;
    END LOOP;
END $$;

-- What was claimed and nobody has begun waits again as if it had not been; one that was told to end does.
CREATE FUNCTION unclaim(p_job text, p_token bigint) RETURNS smallint LANGUAGE sql AS $$
    UPDATE uzawa.job SET status = CASE WHEN finished > 0 THEN 4 ELSE 0 END, attempts = attempts - 1, started = 0,
        node = NULL, owner = NULL, lease = 0 WHERE id = p_job AND status = 1 AND token = p_token RETURNING status $$;

-- As finish. An end that is there already, of this claim and with the same words, is this one: its answer was lost.
CREATE FUNCTION finish_2(p_job text, p_owner text, p_token bigint, p_status integer, p_summary text, p_error text,
    p_bytes bigint, p_contents text) RETURNS void LANGUAGE plpgsql SET plan_cache_mode = force_generic_plan AS $$
BEGIN
    UPDATE uzawa.job SET status = p_status, finished = uzawa.moment(), summary = p_summary, error = p_error, node = NULL,
        owner = NULL, lease = 0, progress = CASE WHEN p_status = 2 THEN 100 ELSE progress END,
        summary_sum = uzawa.sum_of(uzawa.keys_of(id, p_status::text), p_summary), bytes = bytes + p_bytes,
        contents = p_contents, contents_sum = uzawa.sum_of(id, p_contents)
        WHERE id = p_job AND status = 1 AND owner = p_owner AND token = p_token;
    IF NOT FOUND THEN
        PERFORM 1 FROM uzawa.job WHERE id = p_job AND status = p_status AND token = p_token
            AND summary IS NOT DISTINCT FROM p_summary AND error IS NOT DISTINCT FROM p_error
            AND contents IS NOT DISTINCT FROM p_contents;
        IF NOT FOUND THEN
            PERFORM uzawa.refuse_lease(p_job);
        END IF;
    END IF;
END $$;

-- Who had the tables of version 3 has this.
DO $$
DECLARE
    who record;
BEGIN
    FOR who IN SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = 'uzawa' AND table_name = 'job' AND privilege_type = 'INSERT' AND grantee <> CURRENT_USER LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON uzawa.request_placed TO %s',
                       CASE who.grantee WHEN 'PUBLIC' THEN 'PUBLIC' ELSE quote_ident(who.grantee) END);
    END LOOP;
END $$;

UPDATE format SET version = 4;
