"""Options by flag, environment and file; what is in effect; limits."""
# not under ThreadSanitizer: about answers, not about threads
import json
import os
import pathlib
import re
import shutil
import subprocess

import service
from service import MATRICES, PATIENT_S, SCENE, Skip, check, expect, options, wait_until


def run(s, *arguments, **environment):
    return subprocess.run(s.command(*arguments), capture_output=True, text=True, timeout=PATIENT_S, check=False,
                          env={**os.environ, **environment})


def write(s, text):
    path = os.path.join(s.folder, "test.conf")
    pathlib.Path(path).write_text(text, encoding="utf-8")
    return path


def effective(s, *arguments, **environment):
    """{name: (value, source)} of --check-config."""
    got = run(s, "--check-config", *arguments, **environment)
    check(got.returncode == 0 and got.stderr == "", got)
    values = {}
    for line in got.stdout.splitlines():
        rest, _, source = line.rpartition("  # ")
        name, _, value = rest.removeprefix("# ").partition(" = ")
        values[name] = (value, source)
    return values


@options(None)
def test_precedence(s):
    path = write(s, "max-body = 1K\ndrain-s = 5\nmax-attempts = 7 # a comment\n\n# another\n db = \"a # b.db\"\n")
    got = effective(s)
    check(got["max-body"] == ("67108864", "default") and got["max-attempts"] == ("3", "default"), got)
    got = effective(s, "--config", path)
    check(got["max-body"] == ("1024", "line 1 of the file") and got["drain-s"] == ("5", "line 2 of the file"), got)
    check(got["max-attempts"] == ("7", "line 3 of the file") and got["db"] == ('"a # b.db"', "line 6 of the file"), got)
    got = effective(s, "--config", path, UZAWAD_MAX_BODY="2K", UZAWAD_DRAIN_S="6", UZAWAD_SERVICE_HOST="10.0.0.1")
    check(got["max-body"] == ("2048", "environment") and got["drain-s"] == ("6", "environment"), got)
    got = effective(s, "--max-body", "3K", UZAWAD_MAX_BODY="2K", UZAWAD_CONFIG=path, UZAWAD_DRAIN_S="6")
    check(got["max-body"] == ("3072", "command line") and got["drain-s"] == ("6", "environment"), got)
    check(got["max-attempts"] == ("7", "line 3 of the file") and got["config"][0] == path, got)


@options(None)
def test_lists(s):
    got = effective(s)
    check(got["cors"] == ('""', "default") and got["webhook-allow"] == ('""', "default"), got)
    got = effective(s, "--cors", "https://a.example", "--cors", "http://b:1  http://c:2", "--webhook-allow", "h:1",
                    UZAWAD_WEBHOOK_ALLOW="g f", UZAWAD_CORS="*")
    check(got["cors"] == ('"https://a.example http://b:1 http://c:2"', "command line"), got)
    check(got["webhook-allow"] == ("h:1", "command line"), got)
    path = write(s, "cors = https://a.example  https://b.example\n")
    got = effective(s, "--config", path, UZAWAD_WEBHOOK_ALLOW="g  f")
    check(got["cors"] == ('"https://a.example https://b.example"', "line 1 of the file"), got)
    check(got["webhook-allow"] == ('"g f"', "environment"), got)
    for arguments in (["--cors", "a.example"], ["--cors", "https://a.example/x"], ["--cors", "ftp://a"],
                      ["--cors", "*", "--cors", "x"], ["--webhook-allow", "http://a"], ["--cors", "* " * 33],
                      ["--cors", "http://" + "x" * 600, "--cors", "http://" + "y" * 600]):
        got = run(s, "--check-config", *arguments)
        check(got.returncode == 2 and arguments[0][2:] in got.stderr, arguments, got)


@options(None)
def test_what_is_printed_can_be_read(s):
    first = run(s, "--check-config", "--max-body", "5M", "--cors", "http://a", "--cors", "http://b", "--keep-days", "2.5", "--db", 'odd "name" \\ # x', "--insecure-public").stdout
    second = run(s, "--check-config", "--config", write(s, first)).stdout
    values = [[line.rpartition("  # ")[0] for line in text.splitlines() if not line.startswith("#")]
              for text in (first, second)]
    check(values[0] == values[1] and len(values[0]) > 20, values)


@options(None)
def test_mistakes_name_their_place(s):
    for text, line, words in (("max-boddy = 1K", 1, 'did you mean "max-body"'), ("\nmax-body = 10X", 2, "K, M or G"),
                              ("max-body", 1, "name = value"), ("db = \"a", 1, "quotes"), ("db = \"a\" b", 1, "quotes"),
                              ("workers = 0", 1, "from 1 to 1024"), ("drain-s = nan", 1, "seconds from 0"),
                              ("drain-s = 1\n\ndrain-s = 1", 3, "line 1 already"), ("config = x", 1, "take this line out"),
                              ("log-level = loud", 1, "debug, info"), ("access-log = perhaps", 1, "yes or no"),
                              ("listen =", 1, "text"), ("qqqqqqqqqqqqqqqq = 1", 1, "--help"),
                              ("db = " + "x" * 5000, 1, "too long"), ("max-dofs = -3", 1, "above 0"), ("keep-days = -1", 1, "days from 0"),
                              ("keep-bytes = x", 1, "K, M or G"), ("cors = a.b", 1, "https://host")):
        path = write(s, text + "\n")
        for arguments in (["--check-config"], []):
            got = run(s, "--config", path, *arguments)
            check(got.returncode == 2 and got.stdout == "" and f"{path}:{line}: " in got.stderr and words in got.stderr,
                  text, got)
    # A value that another covers must be valid too.
    got = run(s, "--config", write(s, "max-body = 10X"), "--max-body", "1K", "--check-config")
    check(got.returncode == 2 and "test.conf:1" in got.stderr, got)
    got = run(s, "--check-config", UZAWAD_MAX_BODY="x")
    check(got.returncode == 2 and "UZAWAD_MAX_BODY in the environment" in got.stderr, got)
    got = run(s, "--config", "/nonexistent/x")
    check(got.returncode == 2 and "/nonexistent/x" in got.stderr, got)
    got = run(s, "--tls-cert", "x", "--check-config")
    check(got.returncode == 2 and "tls-key" in got.stderr, got)


@options(None)
def test_a_configuration_that_could_not_start(s):
    """The values are printed, and what is wrong with the files and the address that they name."""
    tokens = os.path.join(s.folder, "tokens")
    pathlib.Path(tokens).write_text("reader read secret\n", encoding="utf-8")
    os.chmod(tokens, 0o600)
    for arguments, words in ((["--listen", "nonsense"], "HOST:PORT"), (["--listen", "127.0.0.1:99999"], "65535"),
                             (["--listen", "192.0.2.1:80"], "192.0.2.1"), (["--listen", "0.0.0.0:80"], "--token-file"),
                             (["--token-file", "/nonexistent/x"], "/nonexistent/x"), (["--token-file", tokens], tokens + ":1"),
                             (["--webhook-secret-file", "/nonexistent/y"], "/nonexistent/y"),
                             (["--tls-cert", "/nonexistent/c", "--tls-key", "/nonexistent/k"], "/nonexistent/c")):
        got = run(s, "--check-config", *arguments)
        check(got.returncode == 1 and words in got.stderr and "listen = " in got.stdout, arguments, got)
        started = run(s, "--db", s.db, *arguments)  # it is what a start would have said
        check(started.returncode == 1 and words in started.stderr, arguments, started)
    got = run(s, "--check-config", "--listen", "0.0.0.0:80", "--insecure-public")
    check(got.returncode == 0 and not got.stderr, got)
    s.start()
    got = run(s, "--check-config", "--listen", f"{s.host}:{s.port}", "--db", s.db)  # the one that runs
    check(got.returncode == 0 and not got.stderr, got)


@options(None)
def test_pipes_that_nobody_writes_to(s):
    """They are not waited for, whichever option names them; one that somebody writes to, as <(...) of a shell, is read."""
    pipe = os.path.join(s.folder, "pipe")
    os.mkfifo(pipe)
    for arguments in (["--config", pipe], ["--token-file", pipe], ["--webhook-secret-file", pipe], ["--audit-log", pipe], ["--tls-cert", pipe, "--tls-key", pipe],
                      ["--store", "postgresql://a@192.0.2.1/b", "--objects", "http://192.0.2.1/b", "--object-key-file", pipe]):
        got = run(s, "--check-config", *arguments)
        check(got.returncode > 0 and pipe in got.stderr, arguments, got)
    for arguments in (["--check-db"], ["--backup", pipe + ".copy"], []):
        got = run(s, "--db", pipe, *arguments)
        check(got.returncode == 1 and "not a regular file" in got.stderr, arguments, got)
    end, into = os.pipe()
    os.write(into, b"workers = 3\n")
    os.close(into)
    got = subprocess.run(s.command("--check-config", "--config", f"/dev/fd/{end}"), pass_fds=[end], capture_output=True, text=True, timeout=PATIENT_S, check=False)
    os.close(end)
    check(got.returncode == 0 and "workers = 3" in got.stdout, got)


@options(None)
def test_the_sample_is_the_table(s):
    sample = (service.ROOT / "server/uzawad.conf.example").read_text(encoding="utf-8")
    check(run(s, "--example-config").stdout == sample, "write it again: uzawad --example-config")
    # Taking the '#' away changes nothing but where a value comes from.
    text = "".join(line[1:] if line.startswith("#") and not line.startswith("# ") else line
                   for line in sample.splitlines(True))
    default = effective(s)
    computed = ("workers", "cache", "memory", "max-streams", "max-client-connections")
    for name in computed:
        text = text.replace(f"\n{name} =\n", "\n\n")
    for name, (value, source) in effective(s, "--config", write(s, text)).items():
        check(value == default[name][0] or name == "config", name, value, default[name])
        check(source.endswith("of the file") or name in ("config", *computed), name, source)


def option_names(s):
    return set(re.findall(r"^  --([a-z-]+)", run(s, "--help").stdout, re.MULTILINE))


@options(None)
def test_the_unit_is_one(s):
    """What the systemd unit says, systemd understands, also with the lines that are there to be uncommented."""
    unit = (service.ROOT / "server/uzawad.service").read_text(encoding="utf-8")
    used = set(re.findall(r"--([a-z][a-z-]*)", "\n".join(re.findall(r"^Exec.*", unit, re.MULTILINE))))
    check(used and used <= option_names(s), used)
    if not shutil.which("systemd-analyze"):
        raise Skip("no systemd-analyze")
    check("\n#LoadCredential=" in unit and "/usr/local/bin/uzawad" in unit, unit)
    path = pathlib.Path(s.folder) / "uzawad.service"
    for text in (unit, re.sub(r"^#(?=[A-Z][A-Za-z]+=)", "", unit, flags=re.MULTILINE)):
        path.write_text(text.replace("/usr/local/bin/uzawad", str(pathlib.Path(s.build).resolve() / "uzawad")), encoding="utf-8")
        got = subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, timeout=60, check=False)
        check(got.returncode == 0 and not got.stderr.strip(), got)


@options(None)
def test_the_container_has_what_the_daemon_needs(s):
    text = (service.ROOT / "server/Containerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    named = {name.lower().replace("_", "-") for line in lines if line.startswith("ENV ")
             for name in re.findall(r"UZAWAD_([A-Z_]+)=", line)}
    check(named and named <= option_names(s), named)
    image = lines[[i for i, line in enumerate(lines) if line.startswith("FROM ")][-1]:]
    packages = set(" ".join(line for line in image if "apt-get install" in line).split())
    if not shutil.which("dpkg-query") or not shutil.which("ldd"):
        raise Skip("no dpkg-query or no ldd")
    for program in ("uzawad", "uzawa"):
        file = str(pathlib.Path(s.build).resolve() / program)
        found = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
        direct = subprocess.run(["readelf", "-d", file], capture_output=True, text=True, check=True).stdout
        for name in re.findall(r"NEEDED.*\[(.*)\]", direct):
            place = re.search(re.escape(name) + r" => (\S+)", found)
            real = os.path.realpath(place[1]) if place else name
            owners = (subprocess.run(["dpkg-query", "-S", path], capture_output=True, text=True, check=False).stdout
                      for path in (real, real.removeprefix("/usr")))  # packages older than /usr merged name /lib
            package = next((owner.split(":")[0] for owner in owners if owner), None)
            check(package in packages or package in (None, "libc6") or name.startswith(("libasan", "libubsan", "libtsan")), name, package)
            check(package or name.startswith(("libc.", "libm.", "libz.", "ld-")) or "san" in name, name, place)


@options("--max-body", "100K", "--max-client-rate", "0", "--keep-days", "3", "--uploads", "1M")
def test_limits_are_shown(s):
    limits = expect(s.get("/v1/limits"), 200).json["limits"]
    check(limits["max_body"]["value"] == 102400 and limits["max_body"]["unit"] == "bytes", limits)
    check(limits["max_client_rate"]["value"] is None and limits["max_json_depth"]["value"] == 64, limits)
    check(limits["keep_days"]["value"] == 3 and limits["keep_days"]["unit"] == "days", limits)
    check(limits["keep_jobs"]["value"] is None and limits["keep_bytes"]["value"] is None, limits)
    check(limits["max_queue"]["value"] is None and limits["uploads"]["value"] == 1 << 20, limits)
    check(limits["max_header_fields"]["value"] == 128 and limits["max_header"]["unit"] == "bytes", limits)
    check(all(one["description"] for one in limits.values()) and "listen" not in limits, limits)
    expect(s.post({**MATRICES, "tags": ["x" * 60] * 2, "pad": "y" * 102400}), 413, "body_too_large")


@options("--max-dofs", "600", "--max-rows", "1K", "--max-nonzeros", "1", "--max-json-depth", "9")
def test_limits_on_the_problem(s):
    reply = expect(s.post(SCENE), 413, "problem_too_large")
    check("682 degrees of freedom" in reply.json["detail"] and "--max-dofs" in reply.json["detail"], reply)
    reply = expect(s.post(MATRICES), 413, "problem_too_large")
    check("2 entries of K" in reply.json["detail"] and "--max-nonzeros" in reply.json["detail"], reply)
    expect(s.request("POST", "/v1/jobs", "[" * 10 + "]" * 10, {"Content-Type": "application/json"}), 400, "json_depth")
    small = json.loads(json.dumps(SCENE))
    small["problem"]["mesh"]["box"]["cells"] = [4, 2]
    check(s.solve(small)["status"] == "successful")


@options("--max-solve-s", "1")
def test_a_job_over_its_time_ends_and_others_go_on(s):
    job = s.solve(service.ENDLESS)
    check(job["status"] == "successful" and job["summary"]["outcome"] == "time_limit", job)
    # Beside much else even that is over its second at times.
    wait_until(lambda: (s.solve(MATRICES)["summary"] or {}).get("outcome") == "converged")


@options("--access-log", "no")
def test_access_log_off(s):
    s.get("/healthz")
    s.get("/nothing")
    check(s.end() == 0 and not s.events("request") and s.events("started"), s.log())


if __name__ == "__main__":
    service.main(globals())
