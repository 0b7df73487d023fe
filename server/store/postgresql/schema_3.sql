-- Version 3: large bytes in an object store. Daemons of version 2 go on meanwhile and afterwards; they can't read what is
-- there, so objects are for when all are of version 3.
SET LOCAL search_path = uzawa;

-- An object, from before it is written until after it was removed: so nothing is there without a row. Its name was never
-- another's and is never used again. It belongs to a job (its result) or to a blob (an upload), or to nobody: then it
-- goes when `due` is over. doomed: it is being removed, and nobody may have it any more.
CREATE TABLE object(
    name text COLLATE "C" PRIMARY KEY, bytes bigint NOT NULL, due float8 NOT NULL, doomed boolean NOT NULL DEFAULT false,
    job text COLLATE "C" REFERENCES job(id) ON DELETE SET NULL,
    blob text COLLATE "C" REFERENCES blob(id) ON DELETE SET NULL
);
CREATE INDEX object_by_job ON object(job) WHERE job IS NOT NULL;
CREATE INDEX object_by_blob ON object(blob) WHERE blob IS NOT NULL;
CREATE INDEX object_by_due ON object(due) WHERE due < 'Infinity';

-- Pieces of vectors and of histories, as in `piece`, whose bytes are in objects: where, and their SHA-256.
CREATE TABLE placed(
    job text COLLATE "C" NOT NULL REFERENCES job(id) ON DELETE CASCADE, token bigint NOT NULL,
    number bigint NOT NULL, name text COLLATE "C" NOT NULL, part bigint NOT NULL,
    encoding bigint NOT NULL, header bigint NOT NULL, last float8 NOT NULL, size bigint NOT NULL,
    object text COLLATE "C" NOT NULL, at bigint NOT NULL, digest bytea NOT NULL, sum bytea NOT NULL,
    PRIMARY KEY(job, number, name, part, token)
);
-- A piece of an upload that is in an object has no data.
ALTER TABLE blob_piece ADD COLUMN object text COLLATE "C", ADD COLUMN size bigint;

CREATE FUNCTION placed_keys(p placed) RETURNS text LANGUAGE sql STABLE
    RETURN concat_ws(E'\x1f', p.job, p.number, p.name, p.part, p.encoding, p.header, p.last, p.size, p.object, p.at);

-- Who is about to write an object has a day until its row belongs to something; a reader of what was deleted an hour.
CREATE FUNCTION note_object() RETURNS trigger LANGUAGE plpgsql SET search_path = uzawa AS $$
BEGIN
    NEW.due := CASE WHEN NEW.job IS NOT NULL OR NEW.blob IS NOT NULL THEN 'Infinity' ELSE moment() + 3600 END;
    RETURN NEW;
END $$;
CREATE TRIGGER note_object BEFORE UPDATE OF job, blob ON object FOR EACH ROW EXECUTE FUNCTION note_object();

CREATE FUNCTION object_begin(p_name text, p_bytes bigint) RETURNS void LANGUAGE sql SET search_path = uzawa AS $$
    INSERT INTO object(name, bytes, due) VALUES (p_name, p_bytes, moment() + 86400) $$;

-- Objects become a job's or a blob's. One that is gone meanwhile is to be written once more.
CREATE FUNCTION object_keep(p_names text[], p_job text, p_blob text) RETURNS void LANGUAGE plpgsql
    SET search_path = uzawa AS $$
DECLARE
    kept integer;
BEGIN
    UPDATE object SET job = p_job, blob = p_blob WHERE name = ANY(p_names) AND NOT doomed;
    GET DIAGNOSTICS kept = ROW_COUNT;
    IF kept < cardinality(p_names) THEN
        RAISE EXCEPTION 'an object was collected before it was anybody''s' USING ERRCODE = 'UZ003';
    END IF;
END $$;

-- Pieces of the result of a job, in objects; digests: 32 bytes of each.
CREATE FUNCTION put_placed(p_job text, p_token bigint, p_numbers bigint[], p_names text[], p_parts bigint[],
    p_encodings bigint[], p_headers bigint[], p_lasts float8[], p_sizes bigint[], p_objects text[], p_ats bigint[],
    p_digests bytea) RETURNS void LANGUAGE plpgsql SET search_path = uzawa SET plan_cache_mode = force_generic_plan AS $$
DECLARE
    p placed;
BEGIN
    FOR i IN 1 .. array_length(p_numbers, 1) LOOP
        p := ROW(p_job, p_token, p_numbers[i], p_names[i], p_parts[i], p_encodings[i], p_headers[i], p_lasts[i], p_sizes[i],
                 p_objects[i], p_ats[i], substring(p_digests FROM 32 * i - 31 FOR 32), NULL);
        p.sum := sum_of(placed_keys(p), p.digest);
        INSERT INTO placed VALUES (p.*) ON CONFLICT DO NOTHING; -- an end that is tried again
    END LOOP;
END $$;

-- A piece of a blob that is being written.
CREATE FUNCTION blob_place(p_blob text, p_part bigint, p_object text, p_size bigint) RETURNS void LANGUAGE plpgsql
    SET search_path = uzawa AS $$
BEGIN
    PERFORM object_keep(ARRAY[p_object], NULL, p_blob);
    INSERT INTO blob_piece(blob, part, data, object, size) VALUES (p_blob, p_part, '', p_object, p_size);
END $$;

-- As blob_publish, with the objects of both. The row of p_id comes first: others who publish the same wait for it.
CREATE FUNCTION blob_publish_2(p_from text, p_id text) RETURNS void LANGUAGE plpgsql SET search_path = uzawa AS $$
BEGIN
    INSERT INTO blob(id, written, sealed) VALUES (p_id, moment(), true)
        ON CONFLICT (id) DO UPDATE SET written = excluded.written;
    UPDATE object SET blob = NULL WHERE blob = p_id;
    UPDATE object SET blob = p_id WHERE blob = p_from;
    PERFORM blob_publish(p_from, p_id);
END $$;

-- Some of those that are to go, also where somebody else failed to remove them: not twice within a minute.
CREATE FUNCTION object_doom(p_most integer) RETURNS SETOF text LANGUAGE sql SET search_path = uzawa AS $$
    UPDATE object SET doomed = true, due = moment() + 60 WHERE name IN (SELECT o.name FROM object AS o
        WHERE o.due < moment() ORDER BY o.due LIMIT p_most FOR NO KEY UPDATE SKIP LOCKED) RETURNING name $$;

-- Who had the tables of version 2 has these.
DO $$
DECLARE
    who record;
BEGIN
    FOR who IN SELECT DISTINCT grantee FROM information_schema.role_table_grants
        WHERE table_schema = 'uzawa' AND table_name = 'job' AND privilege_type = 'INSERT' AND grantee <> CURRENT_USER LOOP
        EXECUTE format('GRANT SELECT, INSERT, UPDATE, DELETE ON uzawa.object, uzawa.placed TO %s',
                       CASE who.grantee WHEN 'PUBLIC' THEN 'PUBLIC' ELSE quote_ident(who.grantee) END);
    END LOOP;
END $$;

UPDATE format SET version = 3;
