-- Version 2: jobs go where the factor of their body is; nodes say what they are and can be drained; rates of requests
-- that hold for all nodes together. Daemons of version 1 go on meanwhile and afterwards (schema.h): they call `submit`
-- and `claim` of version 1, which know nothing of bodies.
SET LOCAL search_path = uzawa;

-- body: what stands for the job's body (process_body), NULL: not known. passed: when a claim first left this job where
-- it was for the sake of what is here, 0: none has.
ALTER TABLE job ADD COLUMN body bigint, ADD COLUMN passed float8 NOT NULL DEFAULT 0;
-- What a daemon says of itself now and then (store_node); draining: it shall claim nothing.
ALTER TABLE node ADD COLUMN name text NOT NULL DEFAULT '', ADD COLUMN version text NOT NULL DEFAULT '',
    ADD COLUMN workers integer NOT NULL DEFAULT 0, ADD COLUMN busy integer NOT NULL DEFAULT 0,
    ADD COLUMN factors bigint NOT NULL DEFAULT 0, ADD COLUMN bytes bigint NOT NULL DEFAULT 0,
    ADD COLUMN max_bytes bigint NOT NULL DEFAULT 0, ADD COLUMN draining boolean NOT NULL DEFAULT false;
-- Bodies whose factor a node has, or makes now; seconds, again: what its first and its second run of the body took,
-- NULL: it has not ended.
CREATE TABLE holding(
    body bigint NOT NULL, node text COLLATE "C" NOT NULL REFERENCES node(id) ON DELETE CASCADE, seconds float8,
    again float8,
    PRIMARY KEY(body, node)
);
CREATE INDEX holding_by_node ON holding(node);
-- Requests that a client has made of all nodes together. Nothing is lost with it that would be missed.
CREATE UNLOGGED TABLE rate(client text COLLATE "C" PRIMARY KEY, total bigint NOT NULL, at float8 NOT NULL);

-- Whoever may change jobs may use what is new: a daemon whose role is not the owner's goes on.
DO $$
DECLARE
    who record;
BEGIN
    FOR who IN SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = 'uzawa' AND table_name = 'job' AND privilege_type = 'UPDATE'
        AND grantee <> current_user LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON uzawa.holding, uzawa.rate TO %s',
                       CASE WHEN who.grantee = 'PUBLIC' THEN 'PUBLIC' ELSE quote_ident(who.grantee) END);
    END LOOP;
END $$;

CREATE OR REPLACE FUNCTION note_job() RETURNS trigger LANGUAGE plpgsql SET search_path = uzawa AS $$
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
        IF NEW.status = 2 AND OLD.body IS NOT NULL THEN
            UPDATE holding AS h SET seconds = coalesce(h.seconds, NEW.finished - NEW.started),
                again = CASE WHEN h.seconds IS NOT NULL THEN NEW.finished - NEW.started END
                WHERE h.body = OLD.body AND h.node = OLD.node AND h.again IS NULL;
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

-- As `submit`, for a job with this body.
CREATE FUNCTION submit_2(p_id text, p_created float8, p_body bytea, p_digest bytea, p_tags text, p_client text,
    p_share text, p_key text, p_refines text, p_uploads text[], p_any_upload boolean, p_priority integer,
    p_small boolean, p_webhook text, p_queue_limit float8, p_max_queue bigint, p_waiting bigint, p_bytes bigint,
    p_seconds float8, p_held bigint, OUT verdict text, OUT job text) LANGUAGE plpgsql
    SET search_path = uzawa SET plan_cache_mode = force_generic_plan
    AS $$
BEGIN
    SELECT s.verdict, s.job INTO verdict, job FROM submit(p_id, p_created, p_body, p_digest, p_tags, p_client, p_share,
        p_key, p_refines, p_uploads, p_any_upload, p_priority, p_small, p_webhook, p_queue_limit, p_max_queue,
        p_waiting, p_bytes, p_seconds) AS s;
    IF verdict = 'new' AND p_held IS NOT NULL THEN
        UPDATE job AS j SET body = p_held WHERE j.id = p_id;
    END IF;
END $$;

-- Which of a share's jobs this node is to have, locked. fit: 0: nobody has its body, 1: this node has, 2: others have
-- it. id NULL: none, or none yet: one of them waits for who has its body, for `later` seconds more at most.
--
-- A job that this node has the body of goes before older ones of the same priority, and one that others have is left to
-- them for as long as the factor spared them, but no longer than p_bound. Once it is p_bound
-- since a job was first passed over, it goes before all of its priority. The first 64 are looked at.
CREATE FUNCTION choose(p_node text, p_share text, p_ahead boolean, p_small boolean, p_bound float8, now float8,
    OUT id text, OUT body bigint, OUT fit integer, OUT later float8) LANGUAGE plpgsql
    SET search_path = uzawa SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off
    SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    first record;
    w record;
    passed_over text[];
BEGIN
    IF p_small THEN
        SELECT j.id, j.body, j.passed, j.priority INTO first FROM job AS j WHERE j.status = 0 AND j.small
            AND j.share = p_share AND (j.priority > 5) = p_ahead AND (j.queue_until = 0 OR j.queue_until >= now)
            ORDER BY j.priority DESC, j.id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
    ELSE
        SELECT j.id, j.body, j.passed, j.priority INTO first FROM job AS j WHERE j.status = 0
            AND j.share = p_share AND (j.priority > 5) = p_ahead AND (j.queue_until = 0 OR j.queue_until >= now)
            ORDER BY j.priority DESC, j.id LIMIT 1 FOR NO KEY UPDATE SKIP LOCKED;
    END IF;
    IF NOT FOUND THEN
        RETURN;
    END IF;
    SELECT CASE WHEN bool_or(h.node = p_node) THEN 1 ELSE 2 END INTO fit FROM holding AS h WHERE h.body = first.body
        HAVING count(*) > 0;
    fit := coalesce(fit, 0);
    IF p_bound <= 0 OR first.body IS NULL OR fit = 1 OR (first.passed > 0 AND now - first.passed >= p_bound) THEN
        id := first.id;
        body := first.body;
        RETURN;
    END IF;
    FOR w IN SELECT j.*, coalesce(h.fit, 0) AS fit, h.worth, j.passed > 0 AND now - j.passed >= p_bound AS overdue
        FROM (SELECT i.id, i.body, i.passed, i.priority FROM job AS i WHERE i.status = 0 AND (i.small OR NOT p_small)
              AND i.share = p_share AND (i.priority > 5) = p_ahead AND (i.queue_until = 0 OR i.queue_until >= now)
              ORDER BY i.priority DESC, i.id LIMIT 64) AS j
        LEFT JOIN LATERAL (SELECT CASE WHEN bool_or(k.node = p_node) THEN 1 ELSE 2 END AS fit,
                                  min(greatest(0, coalesce(k.seconds - coalesce(k.again, 0), p_bound))) AS worth
            FROM holding AS k JOIN node AS n ON n.id = k.node WHERE k.body = j.body
            AND (k.node = p_node OR (n.seen > now - 30 AND NOT n.draining)) HAVING count(*) > 0) AS h ON true
        ORDER BY j.priority DESC, overdue DESC, CASE coalesce(h.fit, 0) WHEN 1 THEN 0 WHEN 0 THEN 1 ELSE 2 END, j.id
    LOOP
        IF w.fit = 2 AND NOT w.overdue AND (w.passed = 0 OR now - w.passed < least(w.worth, p_bound)) THEN
            later := least(later, least(w.worth, p_bound) - CASE WHEN w.passed > 0 THEN now - w.passed ELSE 0 END);
            CONTINUE;
        END IF;
        SELECT j.id INTO id FROM job AS j WHERE j.id = w.id AND j.status = 0 FOR NO KEY UPDATE SKIP LOCKED;
        IF FOUND THEN
            body := w.body;
            fit := w.fit;
            later := NULL;
            EXIT;
        END IF;
    END LOOP;
    -- Those that stand before it, or all that are left to others, remember since when.
    SELECT array_agg(i.id) INTO passed_over FROM (SELECT j.id, j.priority, j.passed FROM job AS j WHERE j.status = 0
        AND (j.small OR NOT p_small) AND j.share = p_share AND (j.priority > 5) = p_ahead
        AND (j.queue_until = 0 OR j.queue_until >= now) ORDER BY j.priority DESC, j.id LIMIT 64) AS i
        WHERE i.passed = 0
        AND (choose.id IS NULL OR i.priority > w.priority OR (i.priority = w.priority AND i.id < w.id));
    IF passed_over IS NOT NULL THEN
        UPDATE job AS j SET passed = now WHERE j.id IN (SELECT i.id FROM job AS i WHERE i.id = ANY(passed_over)
            AND i.status = 0 FOR NO KEY UPDATE SKIP LOCKED);
    END IF;
END $$;

-- As `claimed`, with how the job came here (choose); id NULL: nothing now, but look again after `later` seconds.
CREATE TYPE claimed_2 AS (id text, attempts integer, created float8, started float8, tags text, refines text,
                          priority smallint, client text, token bigint, body bytea, digest bytea, held bigint,
                          fit integer, later float8);
CREATE FUNCTION claim_2(p_node text, p_owner text, p_lease float8, p_small boolean, p_bound float8)
    RETURNS SETOF claimed_2 LANGUAGE plpgsql ROWS 1
    SET search_path = uzawa SET jit = off SET enable_seqscan = off SET enable_bitmapscan = off
    SET plan_cache_mode = force_generic_plan
    AS $$
DECLARE
    s record;
    chosen text;
    its_body bigint;
    its_fit integer;
    wait float8;
    later float8;
    now float8;
BEGIN
    IF EXISTS (SELECT 1 FROM node AS n WHERE n.id = p_node AND n.draining) THEN
        RETURN;
    END IF;
    PERFORM take_queue(true);
    PERFORM fold();
    now := moment();
    -- A share whose jobs have all waited longer than they may, or are left to others, is passed over.
    IF p_small THEN
        FOR s IN SELECT name, ahead FROM share WHERE share.small > 0 ORDER BY ahead DESC, running, used, name LOOP
            SELECT * INTO chosen, its_body, its_fit, wait
                FROM choose(p_node, s.name, s.ahead, true, p_bound, now);
            EXIT WHEN chosen IS NOT NULL;
            later := least(later, wait);
        END LOOP;
    ELSE
        FOR s IN SELECT name, ahead FROM share WHERE waiting > 0 ORDER BY ahead DESC, running, used, name LOOP
            SELECT * INTO chosen, its_body, its_fit, wait
                FROM choose(p_node, s.name, s.ahead, false, p_bound, now);
            EXIT WHEN chosen IS NOT NULL;
            later := least(later, wait);
        END LOOP;
    END IF;
    IF chosen IS NULL THEN
        IF later IS NOT NULL THEN
            RETURN QUERY SELECT NULL::text, 0, 0::float8, 0::float8, NULL::text, NULL::text, 0::smallint, NULL::text,
                0::bigint, NULL::bytea, NULL::bytea, NULL::bigint, 0, later;
        END IF;
        RETURN;
    END IF;
    IF its_body IS NOT NULL AND its_fit <> 1 THEN
        INSERT INTO holding(body, node) SELECT its_body, n.id FROM node AS n WHERE n.id = p_node ON CONFLICT DO NOTHING;
    END IF;
    UPDATE job SET status = 1, attempts = attempts + 1, progress = 0, started = now, finished = 0, node = p_node,
        owner = p_owner, token = nextval('token'), lease = now + p_lease, lease_s = p_lease WHERE id = chosen;
    RETURN QUERY SELECT j.id, j.attempts, j.created, j.started, j.tags, j.refines, j.priority, j.client, j.token,
        r.body, r.digest, j.body, its_fit, NULL::float8
        FROM job AS j LEFT JOIN request AS r ON r.job = j.id AND length(r.body) <= 65536 WHERE j.id = chosen;
END $$;

-- What clients have asked of this node since it said so last is counted; what they asked of all.
CREATE FUNCTION exchange_rates(p_clients text[], p_used bigint[]) RETURNS TABLE(client text, total bigint) LANGUAGE sql
    SET search_path = uzawa AS $$
    INSERT INTO rate AS r(client, total, at) SELECT c, u, moment() FROM unnest(p_clients, p_used) AS each(c, u)
        ORDER BY c
        ON CONFLICT (client) DO UPDATE SET total = r.total + excluded.total, at = excluded.at
        RETURNING r.client, r.total $$;

UPDATE format SET version = 2;
