"""The files of server/deploy: they are well-formed, name what there is, and the programs that read them take them."""
# not under ThreadSanitizer: about files, not about threads
# in the ordinary build too, the_package: programs with a sanitizer are not packed
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile

import service
from service import MATRICES, ROOT, Skip, check

SHARED = True
DEPLOY = ROOT / "server" / "deploy"
# Words of PromQL, labels and what Prometheus makes itself.
METRIC = re.compile(r"\b((?:uzawad|process)_[a-z0-9_]+)")


def families(s):
    """Every name of /metrics, after a job; a database's disk is not the daemon's to watch."""
    s.solve(MATRICES)
    text = s.get("/metrics").body.decode()
    beside = {"uzawad_store_free_bytes"} if "://" in s.db else set()
    return beside | set(re.findall(r"^# TYPE (\S+)", text, re.M)) | set(re.findall(r"^(\w+)[ {]", text, re.M))


def tool(name, *words, cwd=None):
    if not shutil.which(name):
        raise Skip(f"no {name}")
    run = subprocess.run([name, *words], capture_output=True, text=True, check=False, cwd=cwd)
    check(run.returncode == 0, name, words, run.stdout, run.stderr)
    return run.stdout + run.stderr


def yaml_of(name):
    import yaml
    return yaml.safe_load((DEPLOY / name).read_text())


def test_the_dashboard_shows_what_there_is(s):
    known = families(s)
    dashboard = json.loads((DEPLOY / "grafana.json").read_text())
    shown = set()
    for panel in dashboard["panels"]:
        check(panel["targets"] and panel["title"], panel)
        for target in panel["targets"]:
            named = set(METRIC.findall(target["expr"]))
            check(named and named <= known, panel["title"], named - known)
            check(target["expr"].count("(") == target["expr"].count(")"), target["expr"])
            shown |= named
    check(len({panel["id"] for panel in dashboard["panels"]}) == len(dashboard["panels"]), "an id comes twice")
    bare = {re.sub(r"_(bucket|sum|count)$", "", one) for one in shown}
    types = set(re.findall(r"^# TYPE (\S+)", s.get("/metrics").body.decode(), re.M))
    check(types <= bare, "not on the dashboard:", types - bare)


def test_the_alerts_watch_what_there_is(s):
    known = families(s)
    rules = [rule for group in yaml_of("alerts.yml")["groups"] for rule in group["rules"]]
    for rule in rules:
        named = set(METRIC.findall(rule["expr"]))
        check((named or "up{" in rule["expr"]) and named <= known, rule["alert"], named - known)
        check(rule["annotations"]["summary"] and rule["labels"]["severity"] in ("warning", "critical"), rule)
    check(yaml_of("prometheus.yml")["rule_files"] == ["alerts.yml"])
    nodes = yaml_of("prometheus.yml")["scrape_configs"][0]["static_configs"][0]["targets"]
    check([one.split(":")[0] for one in nodes] == [one for one in yaml_of("compose.yaml")["services"] if "node" in one])
    tool("promtool", "check", "config", "prometheus.yml", cwd=DEPLOY)


def test_the_compose_file_is_whole(s):
    compose = yaml_of("compose.yaml")
    options = s.command()[0] and subprocess.run(s.command("--help"), capture_output=True, text=True, check=True).stdout
    nodes = {name: one for name, one in compose["services"].items() if name.startswith("node")}
    check(len(nodes) == 3, list(nodes))
    for name, one in compose["services"].items():
        for dependence in one.get("depends_on", []):
            check(dependence in compose["services"], name, dependence)
        for secret in one.get("secrets", []):
            check((secret if isinstance(secret, str) else secret["source"]) in compose["secrets"], name, secret)
        for volume in one.get("volumes", []):
            source = volume.split(":")[0]
            check(source in compose["volumes"] or (DEPLOY / source).is_file(), name, volume)
        if "build" in one:
            folder = (DEPLOY / one["build"]["context"]).resolve()
            check((folder / one["build"]["dockerfile"]).is_file() and folder == ROOT, one["build"])
    text = (DEPLOY / "compose.yaml").read_text()
    for variable in set(re.findall(r"UZAWAD_[A-Z_]+(?=:)", text)):
        check("--" + variable[7:].lower().replace("_", "-") in options, variable, "is no option")
    # a node starts with what the image and this file give it
    image = dict(word.split("=", 1) for word in re.search(r"^ENV (.*)$", (ROOT / "server/Containerfile").read_text(), re.M)[1].split())
    with tempfile.TemporaryDirectory() as folder:
        tokens = pathlib.Path(folder, "tokens")
        tokens.write_text("me admin a-secret-of-the-test\n")
        tokens.chmod(0o600)
        given = {**os.environ, **image, **compose["x-node"]["environment"], "UZAWAD_TOKEN_FILE": str(tokens)}
        got = subprocess.run(s.command("--check-config"), capture_output=True, text=True, check=False, env=given)
        check(got.returncode == 0 and "postgresql://uzawa@database/uzawa" in got.stdout, got)
    balancer = (DEPLOY / "haproxy.cfg").read_text()
    check(re.findall(r"server \w+ (\w+):8080", balancer) == list(nodes), balancer)


def test_the_units_are_taken(s):
    unit = (DEPLOY / "uzawad@.service").read_text()
    alone = (ROOT / "server" / "uzawad.service").read_text()
    for line in re.findall(r"^(?:Protect|Private|Restrict|Capability|NoNew|Memory|System|Lock|Remove).*$", alone, re.M):
        check(line in unit, "the template is less confined:", line)
    options = subprocess.run(s.command("--help"), capture_output=True, text=True, check=True).stdout
    for option in re.findall(r" (--[a-z-]+)", "\n".join(re.findall(r"^ExecStart.*", unit, re.M))):
        check(option in options, option)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("uzawad@.service", "uzawad.target"):
            text = (DEPLOY / name).read_text().replace("/usr/local/bin/uzawad", str(pathlib.Path(s.command()[0]).resolve()))
            pathlib.Path(folder, name).write_text(text)
        told = tool("systemd-analyze", "verify", f"{folder}/uzawad@1.service")
        check("uzawad" not in told, told)


def test_the_package(s):
    """Its programs solve where they are unpacked, its unit starts what is in it, and it can be installed here."""
    build = pathlib.Path(s.command()[0]).resolve().parent
    if "san" in build.name:
        raise Skip("the package of a build for tests is not made")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(build, f"{folder}/build", ignore=lambda _, names: {n for n in names if not n.startswith("uzawa")})
        package = tool("make", "-s", "-o", "all", f"BUILD={folder}/build", "deb", cwd=ROOT).split()[-1]
        tool("dpkg-deb", "-x", package, f"{folder}/root")
        tool("apt-get", "-qq", "--simulate", "install", package)
        about = tool("dpkg-deb", "-f", package)
        check(re.search(r"^Depends: .*libmicrohttpd12.*libsqlite3-0", about, re.M) and "Version: 0" in about, about)
        unit = pathlib.Path(folder, "root/lib/systemd/system/uzawad.service").read_text()
        for program in re.findall(r"^Exec\w+=(/\S+/uzawad) ", unit, re.M):
            check(os.access(f"{folder}/root{program}", os.X_OK), program)
        tool(f"{folder}/root/usr/bin/uzawad", "--config", f"{folder}/root/etc/uzawad/uzawad.conf", "--check-config", cwd=folder)
        told = tool(f"{folder}/root/usr/bin/uzawa", "-s", s.url, "submit", str(ROOT / "tests/data/paper_body.json"), "--wait")
        check("converged" in told, told)


def test_the_balancer_is_taken(_):
    with tempfile.TemporaryDirectory() as folder, socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        text = (DEPLOY / "haproxy.cfg").read_text().replace(":8080\n", f":{free.getsockname()[1]}\n", 1)
        pathlib.Path(folder, "haproxy.cfg").write_text(text)
        tool("haproxy", "-c", "-f", f"{folder}/haproxy.cfg")


if __name__ == "__main__":
    service.main(globals())
