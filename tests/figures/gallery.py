"""The gallery's scenes against theory: BUILD/gallery.json from the summaries that tests/gallery.sh left.

usage: gallery.py FOLDER OUTPUT.json   FOLDER has NAME.json, a finished job each
"""
import json
import math
import pathlib
import sys

NAMES = ("cylinder", "press_fit", "gear", "bracket", "paper_body")


def hertz(contact):
    """(largest pressure, half width) under the force that the cylinder got, half of which is there: K. L. Johnson, Contact Mechanics,
    1985, section 4.2(c)."""
    load, radius, modulus = 2 * contact["force"][1], 50, 210e3 / (1 - 0.3 ** 2)
    half_width = math.sqrt(4 * load * radius / (math.pi * modulus))
    return 2 * load / (math.pi * half_width), half_width


def lame():
    """The pressure of the press fit: S. P. Timoshenko and J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, section 28: two rings, in
    plane strain."""
    inner, seat, outer, interference = 10, 20, 35, 0.05

    def plane_strain(young, poisson):
        return young / (1 - poisson ** 2), poisson / (1 - poisson)

    shaft, shaft_poisson = plane_strain(70e3, 0.33)
    hub, hub_poisson = plane_strain(210e3, 0.3)
    give = seat / hub * ((outer ** 2 + seat ** 2) / (outer ** 2 - seat ** 2) + hub_poisson)
    give += seat / shaft * ((seat ** 2 + inner ** 2) / (seat ** 2 - inner ** 2) - shaft_poisson)
    return interference / give


def scene(name, summary):
    """What the tutorial says of a scene."""
    contact = summary["contact"]
    got = {"name": name, "outcome": summary["outcome"], "d": summary["problem"]["d"], "active": contact["active"], "candidates": contact["candidates"],
           "reaction_sum": contact["reaction_sum"], "max_pressure": contact["max_pressure"], "area": contact["area"]}
    if name == "cylinder":
        got["hertz_pressure"], got["hertz_half_width"] = hertz(contact)
    if name == "press_fit":
        got["mean_pressure"], got["lame_pressure"] = -contact["reaction_sum"] / contact["area"], lame()
    return got


def main():
    folder, output = (pathlib.Path(argument) for argument in sys.argv[1:3])
    rows = [scene(name, json.loads((folder / f"{name}.json").read_text())["summary"]) for name in NAMES]
    output.write_text(json.dumps({"scenes": rows}))


if __name__ == "__main__":
    main()
