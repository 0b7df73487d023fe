"""One body on several processes (`operator` distributed): its answers, and what becomes of a job whose group ends.
usage: test_group.py BUILD_DIR [FILTER]"""
# not under sanitizers: MPI and PETSc are not made for them, and the daemon's part is that of any process
import copy
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import time

import service
from service import MATRICES, PATIENT_S, SCENE, Skip, check, options, wait_until

# As root, on fewer processors than processes, and in a container without process_vm_readv.
os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                  OMPI_MCA_btl_vader_single_copy_mechanism="none")
ROOT = pathlib.Path(__file__).parents[2]
PAIR = "mpirun --oversubscribe -n 2 {program}"

CUBE = {"problem": {"kind": "scene", "model": "solid",
                    "mesh": {"box": {"origin": [0, 0, -1], "size": [1, 1, 1], "cells": [3, 3, 3], "element": "hex8"}},
                    "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                    "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": 0}],
                    "contacts": [{"on": "front", "obstacle": {"sphere": {"center": [0.5, 0.5, 1.98], "radius": 2}}}]}}

ON_PLANE = copy.deepcopy(CUBE)  # by cells, without a matrix, where it is not distributed
ON_PLANE["problem"]["contacts"][0]["obstacle"] = {"plane": {"point": [0, 0, -0.01], "normal": [0, 0, -1]}}

BEAM = copy.deepcopy(SCENE)
BEAM["problem"]["mesh"]["box"]["cells"] = [12, 4]


def square(group, low, cells):
    """Nodes and elements of a unit square above `low`, and its two sides."""
    n = cells + 1
    nodes = [[i / cells, low + j / cells] for j in range(n) for i in range(n)]
    quads = [[a + b for b in (0, 1, n + 1, n)] for a in (i + j * n for j in range(cells) for i in range(cells))]
    sides = {f"{group}_bottom": range(n), f"{group}_top": range(n * n - n, n * n)}
    return nodes, quads, sides


def two_bodies():
    """A square on another one with other nodes, overlapping a little: rows of several entries."""
    nodes, quads, groups = [], [], {}
    for name, low, cells in (("lower", 0, 4), ("upper", 0.999, 3)):
        more, elements, sides = square(name, low, cells)
        quads += [[a + len(nodes) for a in quad] for quad in elements]
        for side, members in sides.items():
            members = [a + len(nodes) for a in members]
            groups[side] = {"nodes": members, "edges": [list(pair) for pair in zip(members, members[1:])]}
        nodes += more
    return {"problem": {"kind": "scene", "model": "plane_strain",
                        "mesh": {"nodes": nodes, "elements": {"quad4": quads}, "groups": groups},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "lower_bottom", "ux": 0, "uy": 0}, {"on": "upper_top", "ux": 0, "uy": -0.01}],
                        "contacts": [{"on": "lower_top", "with": "upper_bottom"}]}}


def solve(s, request):
    """As s.solve, but it may take a while."""
    job = s.post(request, {"Prefer": "wait=40"}).json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=40").json
    return job


def by(operator, request, **solver):
    accuracy = {"accuracy": {"relative_error": 1e-6}}
    return {**copy.deepcopy(request), "solver": {**accuracy, **solver, "operator": operator}}


def processes(s):
    """The processes of this service's groups."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if os.readlink(path / "exe") == str(pathlib.Path(s.build, "uzawa-group").resolve()):
                found.append(int(path.name))
        except OSError:
            pass
    return found


def needs_group(test):
    def run(s):
        if not pathlib.Path(s.build, "uzawa-group").exists() or not shutil.which("mpirun"):
            raise Skip("uzawa-group needs PETSc and MPI (make deps-group)")
        s.start()
        test(s)
        wait_until(lambda: not processes(s))  # nothing of it stays
    run.options = (None, *test.options)
    return run


@needs_group
@options("--workers", "1", "--group-command", PAIR + "")
def test_answers_are_those_of_one_process(s):
    """The paper's body, a cube on a sphere and on a plane, two bodies, matrices: certified, and the same."""
    for request in (BEAM, CUBE, ON_PLANE, two_bodies(), MATRICES):
        alone, group = (solve(s, by(operator, request)) for operator in ("condensed", "distributed"))
        check(group["status"] == "successful", group)
        one, two = alone["summary"], group["summary"]
        check(two["operator"] == "distributed" and two["outcome"] == "converged", two)
        check(two["certificate"]["relative_error"] <= 1e-6, two["certificate"])
        check(two["contact"]["active"] > 0 and two["factor"]["bytes"] > 0 or request is MATRICES, two)
        # energies differ by half the square of the error at most
        check(abs(one["energy"]["primal"] - two["energy"]["primal"]) <= 1e-11 * abs(one["energy"]["primal"]), one, two)
        near = 1e-4 * abs(one["contact"]["reaction_sum"])
        check(abs(one["contact"]["reaction_sum"] - two["contact"]["reaction_sum"]) <= near, one["contact"], two["contact"])
    wait_until(lambda: not processes(s))  # the group ends with its job
    done = subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", "submit", "-", "--wait"],
                          input=json.dumps({**MATRICES, "solver": {"operator": "distributed"}}), capture_output=True, text=True,
                          timeout=PATIENT_S)
    check(done.returncode == 0 and "none: coarse levels of" in done.stdout, done)


@needs_group
@options("--workers", "1", "--group-command", PAIR.replace("2", "3"))
def test_levels_of_a_larger_body(s):
    """Three processes, which have the next level whole: of 20,577 dofs that is a multigrid itself, also where dofs are held."""
    larger = copy.deepcopy(ON_PLANE)
    larger["problem"]["mesh"]["box"]["cells"] = [18, 18, 18]
    alone, group = (solve(s, by(operator, larger))["summary"] for operator in ("matrix_free", "distributed"))
    check(group["outcome"] == "converged" and group["certificate"]["relative_error"] <= 1e-6, group)
    check(group["contact"]["active"] == alone["contact"]["active"] > 0, alone["contact"], group["contact"])
    check(abs(alone["energy"]["primal"] - group["energy"]["primal"]) <= 1e-11 * abs(alone["energy"]["primal"]), alone, group)


@needs_group
@options("--workers", "1", "--group-command", PAIR + "")
def test_slender_beams(s):
    """Single precision does not get far with their K, which takes double, and no method that goes on without end."""
    for length in (200, 300):
        beam = {"kind": "scene", "model": "solid",
                "mesh": {"box": {"size": [length, 2, 2], "cells": [length, 2, 2], "element": "hex8"}},
                "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}],
                "loads": [{"on": "right", "traction": [0.01, 0.001, 0]}, {"on": "top", "traction": [0, -0.0005, 0]}],
                "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.0001, 0], "normal": [0, 1, 0]}}}]}
        found = solve(s, by("distributed", {"problem": beam})).get("summary")
        check(found and found["outcome"] == "converged" and found["iterations"] < 60, length, found)


def waiting_in_group(s, request):
    """A job that iterates on a group."""
    job = s.post(request).json["id"]
    wait_until(lambda: len(s.get(f"/v1/jobs/{job}/history").json.get("rows", ())) > 2)
    check(len(processes(s)) == 2, processes(s))
    return job


# Two springs, and steps so short that it runs until it is told to stop.
LONG = by("distributed", MATRICES, method="uzawa", alpha=1e-9, max_iterations=1000000000)


@needs_group
@options("--workers", "1", "--max-attempts", "2", "--group-command", PAIR)
def test_a_lost_process_is_a_lost_attempt(s):
    """Killed: a process of the group, in both attempts; then the job has failed, and the service solves the next one."""
    job = waiting_in_group(s, LONG)
    os.kill(max(processes(s)), signal.SIGKILL)
    wait_until(lambda: s.get(f"/v1/jobs/{job}").json["attempts"] == 2)
    gone_before = s.events("process_died")
    check([event["cause"] for event in gone_before] == ["the loss of its group of processes"], gone_before)
    wait_until(lambda: len(s.get(f"/v1/jobs/{job}/history").json.get("rows", ())) > 2 and len(processes(s)) == 2)
    os.kill(min(processes(s)), signal.SIGKILL)
    ended = s.wait_status(job, "failed")
    check(ended["error"]["code"] == "process_died" and "group" in ended["error"]["detail"], ended)
    check(s.solve(MATRICES)["status"] == "successful")


@needs_group
@options("--workers", "1", "--max-attempts", "1", "--group-command", PAIR)
def test_mpirun_is_lost(s):
    job = waiting_in_group(s, LONG)
    group = processes(s)
    parents = {int(pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1]) for pid in group}
    check(len(parents) == 1, parents)
    os.kill(parents.pop(), signal.SIGKILL)
    ended = s.wait_status(job, "failed")
    check(ended["error"]["code"] == "process_died", ended)
    check(s.solve(MATRICES)["status"] == "successful")


@needs_group
@options("--workers", "1", "--group-command", PAIR)
def test_dismissed(s):
    """With its best answer so far, and no process stays."""
    job = waiting_in_group(s, LONG)
    began = time.monotonic()
    s.request("DELETE", f"/v1/jobs/{job}")
    ended = s.wait_status(job, "dismissed")
    check(time.monotonic() - began < 40, ended)


def used_s(pid):
    """Seconds of processors."""
    times = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


@needs_group
@options("--workers", "1", "--group-command", PAIR)
def test_who_waits_for_another_sleeps(s):
    """Whichever process is held up, the other leaves its processor to who can use it, and goes on afterwards."""
    job = waiting_in_group(s, LONG)
    pair = sorted(processes(s))
    for stopped, waits in (pair, pair[::-1]):
        os.kill(stopped, signal.SIGSTOP)
        time.sleep(0.2)
        before = used_s(waits)
        time.sleep(2)
        used = used_s(waits) - before
        last = s.get(f"/v1/jobs/{job}/history").json["rows"][-1]
        os.kill(stopped, signal.SIGCONT)
        check(used < 0.07, used)  # 2 where it asks all the time, less where others have the processors
        wait_until(lambda: s.get(f"/v1/jobs/{job}/history").json["rows"][-1] != last, PATIENT_S)
    s.request("DELETE", f"/v1/jobs/{job}")
    s.wait_status(job, "dismissed", seconds=PATIENT_S)


# Of MPI's calls those that wait, and ask all the time while they do; what begins with MPI_I does not.
WAITING = {"Send", "Ssend", "Recv", "Sendrecv", "Probe", "Wait", "Waitall", "Waitany", "Barrier", "Bcast", "Reduce", "Allreduce", "Scan",
           "Exscan", "Gather", "Gatherv", "Scatter", "Scatterv", "Allgather", "Allgatherv", "Alltoall", "Alltoallv"}


@needs_group
@options("--workers", "1", "--group-command", PAIR)
def test_nothing_waits_awake(s):
    """Neither rows nor vectors nor sums are waited for by a call of MPI's: a process sleeps then (neighbours.c)."""
    listed = subprocess.run(["nm", "-D", "--undefined-only", str(s.build / "uzawa-group")], capture_output=True, text=True, check=True)
    called = {line.split()[-1].split("@")[0] for line in listed.stdout.splitlines()}
    check("MPI_Testall" in called and "MPI_Isend" in called, called)
    check(not {f"MPI_{name}" for name in WAITING} & called, called)


def hand_rows(s, told, messages, expected=0, most=resource.RLIM_INFINITY):
    """Status of a group of one process that is given rows of two nodes with a dof each (wire.h), as (blocks that the message
    is said to have, those of each node, columns), and told of so many blocks in all, after so many bytes that they would be,
    with room for `most`; None: it makes levels of them."""
    wire = (ROOT / "solver/group/wire.h").read_text()
    version, kinds = int(re.search(r"define UZ_WIRE_VERSION (\d+)", wire)[1]), re.findall(r"^    UZ_WIRE_(\w+)", wire, re.M)
    ours, theirs = socket.socketpair()
    with ours, theirs, subprocess.Popen([str(s.build / "uzawa-group"), str(theirs.fileno())], pass_fds=[theirs.fileno()],
                                        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (most, most)),
                                        stderr=subprocess.PIPE) as group:
        theirs.close()
        head = lambda kind, *numbers: struct.pack("=2i4q2d", 1 + kinds.index(kind), version, 1, *numbers)
        ours.settimeout(PATIENT_S)
        hello = ours.recv(56, socket.MSG_WAITALL)
        ours.sendall(head("EXPECT", expected, 0, 0, 0, 0) + head("BODY", 2, 1, 1, 0.1, 0) + struct.pack("=2q", 2, told))
        for blocks, counts, columns in messages:
            ours.sendall(head("ROWS", len(counts), blocks, 0, 0, 0) + struct.pack(f"={blocks}d", *[1.0] * blocks) +
                         struct.pack(f"={len(counts)}i", *counts) + struct.pack(f"={blocks}i", *columns) +
                         struct.pack(f"={len(counts)}f", *[1.0] * len(counts)))
        made = ours.recv(56, socket.MSG_WAITALL)
        ours.close()
        said = group.stderr.read()
        check(len(hello) == 56 and (not made) == (b"other rows" in said), hello, made, said)
        return None if made else group.wait(PATIENT_S)


@needs_group
@options("--workers", "1")
def test_rows_that_are_not_those_told_of(s):
    """Nothing is made of blocks that have not come, or of columns that there are not."""
    check(hand_rows(s, 3, [(3, (2, 1), (0, 1, 1))]) is None)
    if not service.INSTRUMENTED:  # sanitizers take more for themselves; there is no room for what is announced
        check(hand_rows(s, 3, [(3, (2, 1), (0, 1, 1))], expected=1 << 60, most=400 << 20) is None)
    for told, message in ((3, (2, (2, 1), (0, 1))),  # fewer than its nodes have
                          (2, (2, (1, 1), (0, 7))), (2, (2, (1, 1), (1, 1)))):
        check(hand_rows(s, told, [message]) not in (None, 0), told, message)


@needs_group
@options("--workers", "1", "--group-command", PAIR)
def test_a_group_that_nobody_needs(s):
    """It is started while the body is assembled: of a scene that is refused then nothing stays, and the next is solved."""
    free = by("distributed", CUBE)
    free["problem"]["supports"] = [{"on": "left", "ux": 0}, {"on": "top", "uy": 0}]
    free["problem"]["loads"] = [{"on": "back", "traction": [0, 0, -1]}]  # away from the sphere: the solver finds it
    job = solve(s, free)
    check(job["status"] == "failed" and job["error"]["code"] == "free_body", job)
    wait_until(lambda: not processes(s))
    check(solve(s, by("distributed", CUBE))["status"] == "successful")


@options("--workers", "1")
def test_refused_without_a_command(s):
    job = s.solve(by("distributed", SCENE))
    check(job["status"] == "failed" and "--group-command" in job["error"]["detail"], job)
    check(job["error"]["pointer"] == "/solver/operator" and "matrix_free" in job["error"]["detail"], job)


@options("--workers", "1", "--group-command", "echo no such cluster; exit 7")
def test_a_command_that_does_not_start_it(s):
    job = s.solve(by("distributed", SCENE))
    check(job["status"] == "failed" and "log" in job["error"]["detail"], job)
    events = s.events("group_not_started")
    check(len(events) == 1 and events[0]["status"] == 7 and "no such cluster" in s.log(), events)
    check(s.solve(MATRICES)["status"] == "successful")


if __name__ == "__main__":
    service.main(globals())
