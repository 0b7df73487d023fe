"""The way to a PostgreSQL database: roles with least rights, TLS, a pooler between."""
# not under ThreadSanitizer: about the way to a database; threads of it are in test_daemons
import contextlib
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time

import databases
import service
from service import ENDLESS, MATRICES, Service, Skip, check, wait_until

server = databases.shared  # made by the first test that asks for it


@contextlib.contextmanager
def daemon(build, address, *options):
    one = Service(build, "--workers", "1", *options, db=address)
    try:
        yield one
    finally:
        one.stop()


def refused_start(one):
    """What a daemon says that does not start."""
    try:
        one.start()
    except AssertionError as why:
        return str(why)
    raise AssertionError("it started")


def test_one_role_makes_the_tables_another_works(s):
    name = server().database()
    server().sql(name, "CREATE ROLE keeper LOGIN; CREATE ROLE worker LOGIN;"
                       f"GRANT CREATE ON DATABASE {name} TO keeper; REVOKE CREATE ON SCHEMA public FROM PUBLIC")
    plain = server().address(name)
    with daemon(s.build, plain.replace("postgres@", "worker@")) as one:
        check("cannot make the tables" in refused_start(one))
    with daemon(s.build, plain.replace("postgres@", "keeper@")) as one:
        one.start()
        check(one.end() == 0)
    check(server().sql(name, "SELECT tableowner FROM pg_tables WHERE schemaname = 'uzawa' GROUP BY 1") == [["keeper"]])
    with daemon(s.build, plain.replace("postgres@", "worker@")) as one:
        told = refused_start(one)
        check("GRANT USAGE" in told, told)
        server().sql(name, "GRANT USAGE ON SCHEMA uzawa TO worker; GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN"
                           " SCHEMA uzawa TO worker; GRANT USAGE ON ALL SEQUENCES IN SCHEMA uzawa TO worker")
        one.start()
        check(one.solve(MATRICES)["status"] == "successful")
        check(one.get("/v1/nodes").json["nodes"] and one.request("POST", "/v1/admin/check").json["whole"])
        good, told = server().try_sql(name, "SET ROLE worker; DROP TABLE uzawa.job")
        check(not good and "must be owner" in told, told)


def test_tls_to_the_database(s):
    mine = databases.Server()
    folder = tempfile.mkdtemp(prefix="test-tls-")
    try:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        name, data = mine.database(), pathlib.Path(mine.folder, "data")
        for which in ("server", "other"):
            subprocess.run(["openssl", "req", "-new", "-x509", "-days", "2", "-nodes", "-subj", "/CN=localhost", "-addext",
                            "subjectAltName=DNS:localhost", "-out", f"{folder}/{which}.crt", "-keyout",
                            f"{folder}/{which}.key"], capture_output=True, check=True)
        mine.stop()
        for end in ("crt", "key"):
            shutil.copy(f"{folder}/server.{end}", data / f"server.{end}")
            os.chmod(data / f"server.{end}", 0o600)
            os.chown(data / f"server.{end}", data.stat().st_uid, -1)
        # only by TLS, but for this program's own questions
        (data / "pg_hba.conf").write_text("local all all trust\nhostssl all all 127.0.0.1/32 trust\n", encoding="ascii")
        mine.settings = ("fsync=off", "ssl=on", "listen_addresses=127.0.0.1", f"port={port}")
        mine.start(port)
        address = f"postgresql://postgres@localhost:{port}/{name}?hostaddr=127.0.0.1&sslmode="
        with daemon(s.build, address + "disable") as one:
            check("no pg_hba.conf entry" in refused_start(one))
        with daemon(s.build, address + f"verify-full&sslrootcert={folder}/other.crt") as one:
            check("certificate verify failed" in refused_start(one))
        with daemon(s.build, address + f"verify-full&sslrootcert={folder}/server.crt") as one:
            one.start()
            check(one.solve(MATRICES)["status"] == "successful")
            plain = subprocess.run(["psql", "-X", "-A", "-t", "-d", f"postgresql://postgres@/{name}?host={mine.folder}&port={port}",
                                    "-c", "SELECT count(*) FILTER (WHERE ssl), count(*) FILTER (WHERE NOT ssl) FROM"
                                          " pg_stat_ssl JOIN pg_stat_activity USING (pid) WHERE application_name = 'uzawad'"],
                                   capture_output=True, text=True, check=True).stdout.strip().split("|")
            check(int(plain[0]) >= 2 and plain[1] == "0", plain)
    finally:
        mine.end()
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def pooler(of):
    """PgBouncer in transaction mode before a server, with fewer connections to it than two daemons want; its folder."""
    program = shutil.which("pgbouncer", path=os.environ["PATH"] + ":/usr/sbin")
    if not program:
        raise Skip("no PgBouncer (Debian: pgbouncer)")
    folder = tempfile.mkdtemp(prefix="test-pooler-")
    os.chmod(folder, 0o777)
    pathlib.Path(folder, "users").write_text('"postgres" ""\n', encoding="ascii")
    pathlib.Path(folder, "ini").write_text(
        f"[databases]\n* = host={of.folder}\n[pgbouncer]\nunix_socket_dir = {folder}\nlisten_addr =\nauth_type = trust\n"
        f"auth_file = {folder}/users\npool_mode = transaction\ndefault_pool_size = 4\nlisten_port = 6432\n", encoding="ascii")
    as_other = [] if os.getuid() else ["setpriv", "--reuid", "postgres", "--regid", "postgres", "--clear-groups"]
    with open(os.path.join(folder, "log"), "wb") as log:
        process = subprocess.Popen([*as_other, program, os.path.join(folder, "ini")], stdout=log, stderr=log)
    try:
        wait_until(lambda: os.path.exists(os.path.join(folder, ".s.PGSQL.6432")))
        yield folder
    finally:
        process.kill()
        process.wait()
        shutil.rmtree(folder, ignore_errors=True)


def test_a_pooler_in_transaction_mode(s):
    """No message comes through it: who waits looks by itself."""
    name = server().database()
    with pooler(server()) as folder:
        address = f"postgresql://postgres@/{name}?host={folder}&port=6432"
        with daemon(s.build, address) as a, daemon(s.build, address) as b:
            a.start()
            b.start()
            jobs = [one.post(MATRICES, {"Idempotency-Key": f"k{i}"}).json["id"] for i in range(10) for one in (a, b)]
            check(len(set(jobs)) == 10, jobs)
            for job in set(jobs):
                check(b.wait_status(job, "successful", "failed")["status"] == "successful")
            long = a.post(ENDLESS).json["id"]
            a.wait_status(long, "running")
            here, other = (a, b) if any(one["job"] == long for one in a.events("job_started")) else (b, a)
            begun = time.monotonic()
            check(other.request("DELETE", f"/v1/jobs/{long}").status in (200, 202))
            check(other.get(f"/v1/jobs/{long}", Prefer="wait=60").json["status"] == "dismissed")
            check(time.monotonic() - begun < 40, time.monotonic() - begun)
            check(here.get(f"/v1/jobs/{long}").json["status"] == "dismissed")
            check(a.request("POST", "/v1/admin/check").json["whole"])


def test_a_server_behind_a_pooler_stands_still(s):
    """The pooler takes connections as before: to ask on a new one takes no longer than on an old one."""
    name = server().database()
    with pooler(server()) as folder, daemon(s.build, f"postgresql://postgres@/{name}?host={folder}&port=6432") as a:
        a.start()
        stopped = [server().process.pid, *(int(row[0]) for row in server().sql(
            name, "SELECT pid FROM pg_stat_activity WHERE datname = current_database() AND pid <> pg_backend_pid()"))]
        try:
            for pid in stopped:
                os.kill(pid, signal.SIGSTOP)
            for _ in range(2):  # 5 s each; the second would be 45
                check(a.request("GET", "/healthz", timeout=30).json["status"] == "store_unavailable")
        finally:
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
        wait_until(lambda: a.get("/healthz").json["status"] == "ok")


if __name__ == "__main__":
    service.main(globals())
