"""The load at which a clamped arch (span 20, rise 2, thickness 0.5, E = 1000, nu = 0.3, plane strain) goes through under a
force amid, along a path, on ever finer meshes of one half; quad8 with 1 x 16, 2 x 16, 2 x 32, 4 x 64 and 8 x 128 cells. A path
ends within 0.00003 of its limit. What is left goes down with the cells about the corners of the clamp. neo_hooke, the force
spread over the section: 0.5758, 0.5742, 0.5734, 0.5731, 0.5730, which is the limit. neo_hooke_isochoric, the force at the
node on top: 0.5772, 0.5756, 0.5747, 0.5745, 0.5744. Elements and laws that were written apart from the solver have the
same limits, 0.57303 and 0.57442 with 8 x 80 cells. Seconds. usage: arch.py BUILD_DIR"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import plate

LIMITS, WITHIN = {"neo_hooke": 0.5730, "neo_hooke_isochoric": 0.5744}, 0.0001
RADIUS, THICK, CLAMPED = 26, 0.5, math.asin(10 / 26)
PARTS = [0.4, 0.56, 0.585]


def request(along, through, law):
    def place(x, y):
        r = RADIUS + THICK * (y - 0.5)
        return r * math.sin(CLAMPED * x), r * math.cos(CLAMPED * x) - 24
    nodes, cells, edges = plate("quad8", (along, through), 0, place)
    groups = {side: {"edges": [[edge[0], edge[-1]] for edge in on]} for side, on in edges.items()}
    top = min(range(len(nodes)), key=lambda k: math.dist(nodes[k], place(0, 1)))
    at = {"on": "left"} if law == "neo_hooke" else {"node": top}
    return {"problem": {"kind": "scene", "model": "plane_strain", "kinematics": "finite",
                        "mesh": {"nodes": nodes, "elements": {"quad8": cells}, "groups": groups},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3, "law": law}],
                        "supports": [{"on": "right", "ux": 0, "uy": 0}, {"on": "left", "ux": 0}],
                        "loads": [{**at, "force": [0, -0.5]}],
                        "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.75], "normal": [0, 1]}}}]},
            "cases": [{"name": f"{part}", "part": part, **({"after": f"{PARTS[k - 1]}"} if k else {})} for k, part in enumerate(PARTS)]}


def main():
    s = service.Service(sys.argv[1])
    try:
        s.start()
        for law, limit in LIMITS.items():
            for along, through in ((16, 1), (16, 2), (32, 2), (64, 4), (128, 8)):
                job = s.solve(request(along, through, law))
                last = s.get(f"/v1/jobs/{job['id']}/result").json["cases"][-1]["summary"]
                print(f"{law}, quad8 {through} x {along:3d}: {last['outcome']} beyond {last['finite']['part']:.5f}", flush=True)
                service.check(last["outcome"] == "unstable", last)
            service.check(abs(last["finite"]["part"] - limit) < WITHIN, last["finite"])
    finally:
        s.stop()


if __name__ == "__main__":
    main()
