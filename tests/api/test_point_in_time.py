"""What docs/operations.md says of a backup of PostgreSQL: a base backup and the archive of its log, the server's disk is
lost, and the database is brought back as it was at a time: every job that was acknowledged before it is there."""
import glob
import os
import pathlib
import shutil
import subprocess
import tempfile

import databases
import service
from service import MATRICES, Service, check, expect, wait_until

# not under sanitizers: it is PostgreSQL that is tried here


def as_server(*words):
    """As the user that the server runs as (tests/postgresql.sh)."""
    user = ["setpriv", "--reuid", "postgres", "--regid", "postgres", "--clear-groups"] if os.getuid() == 0 else []
    subprocess.run([*user, *words], check=True, capture_output=True, cwd="/")


class Restored(databases.Server):
    """A server on a folder that has its data already."""

    def __init__(self, folder, *settings):
        self.folder, self.settings, self.made = folder, settings, 0
        self.start()


def solved(daemon, n):
    """The jobs and their results."""
    found = {}
    for i in range(n):
        job = daemon.solve({**MATRICES, "tags": [str(i)]})
        check(job["status"] == "successful", job)
        found[job["id"]] = expect(daemon.get(f"/v1/jobs/{job['id']}/result"), 200).body
    return found


def test_a_time_comes_back(s):
    archive = tempfile.mkdtemp(prefix="test-archive-")
    os.chmod(archive, 0o777)
    again = tempfile.mkdtemp(prefix="test-postgresql-")
    os.chmod(again, 0o777)
    # a segment has its name when it is whole: a copy under way must not be taken for one
    keep = f"test ! -f {archive}/%f && cp %p {archive}/%f.part && mv {archive}/%f.part {archive}/%f"
    server = databases.Server("fsync=on", "archive_mode=on", f"archive_command={keep}")
    restored = None
    try:
        name = server.database()
        daemon = Service(s.build, "--workers", "1", db=server.address(name)).start()
        try:
            first = solved(daemon, 3)
            tool = sorted(glob.glob("/usr/lib/postgresql/*/bin/pg_basebackup"))[-1]
            as_server(tool, "-h", server.folder, "-U", "postgres", "-D", f"{again}/data", "-c", "fast", "-X", "none")
            then = solved(daemon, 3)
            waiting = expect(daemon.post({**service.ENDLESS, "tags": ["before"]}), 202).json["id"]
            daemon.wait_status(waiting, "running")
            moment = server.sql(name, "SELECT clock_timestamp()")[0][0]
            later = solved_later(daemon)
            expect(daemon.request("DELETE", f"/v1/jobs/{next(iter(first))}"), 204)  # a mistake, say
            segment = server.sql(name, "SELECT pg_walfile_name(pg_switch_wal())")[0][0]
            wait_until(lambda: os.path.exists(os.path.join(archive, segment)))
            daemon.process.kill()
        finally:
            daemon.stop()
        server.stop()
        shutil.rmtree(os.path.join(server.folder, "data"))  # the disk is gone
        as_server("touch", f"{again}/data/recovery.signal")
        restored = Restored(again, f"restore_command=cp {archive}/%f %p", f"recovery_target_time={moment}",
                            "recovery_target_action=promote", "archive_mode=off")
        wait_until(lambda: restored.sql("postgres", "SELECT pg_is_in_recovery()") == [["f"]])
        daemon = Service(s.build, "--workers", "1", db=restored.address(name)).start()
        try:
            for job, result in {**first, **then}.items():
                check(expect(daemon.get(f"/v1/jobs/{job}/result"), 200).body == result, job)
            expect(daemon.get(f"/v1/jobs/{later}"), 404)
            # the daemon that had it is gone, and its lease with the time
            restored.sql(name, "UPDATE uzawa.job SET lease = uzawa.moment() - 1 WHERE status = 1")
            check(daemon.wait_status(waiting, "running")["tags"] == ["before"])
            check(daemon.request("POST", "/v1/admin/check").json["whole"])
            daemon.request("DELETE", f"/v1/jobs/{waiting}")
            solved(daemon, 1)
            check(daemon.end() == 0, daemon.log())
        finally:
            daemon.stop()
    finally:
        server.end()
        if restored:
            restored.end()
        for folder in (archive, again):
            shutil.rmtree(folder, ignore_errors=True)
    check(not pathlib.Path(again).exists())


def solved_later(daemon):
    return expect(daemon.post({**MATRICES, "tags": ["later"]}), 202).json["id"]


test_a_time_comes_back.options = (None,)


if __name__ == "__main__":
    service.main(globals())
