"""The scenes of the gallery against theory, and `make gallery`. usage: test_gallery.py BUILD_DIR [FILTER]"""
# not under sanitizers: five scenes of fine meshes are held against theory; tests of each kind of scene look at their code
import functools
import json
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "figures"))

import gallery  # noqa: E402  the path is set above
import inline  # noqa: E402
import service  # noqa: E402
from service import ROOT, check, options  # noqa: E402

FOLDER = ROOT / "client/examples/gallery"
FILES = {**{name: FOLDER / f"{name}.json" for name in ("cylinder", "press_fit", "gear", "bracket")},
         "paper_body": ROOT / "tests/data/paper_body.json"}
SMALL = 150000  # bytes of a picture that is kept in the repository


@functools.cache
def made(build):
    """The folder of what the command behind `make gallery` makes: each scene is solved once for all tests."""
    folder = tempfile.TemporaryDirectory(prefix="gallery-")
    done = subprocess.run(["tests/gallery.sh", build, folder.name], cwd=ROOT, capture_output=True, text=True, timeout=1000)
    check(done.returncode == 0, done.stdout, done.stderr)
    return folder


def file_of(s, name, kind):
    return pathlib.Path(made(s.build).name, f"{name}.{kind}")


def summary_of(s, name):
    return json.loads(file_of(s, name, "json").read_text())["summary"]


def solved(s, name):
    """The scene's summary, which meets what was asked for."""
    summary = summary_of(s, name)
    check(summary["outcome"] == "converged", name, summary)
    check(summary["certificate"]["relative_error"] <= summary["requested_error"], name, summary["certificate"])
    check(summary["resultants"]["imbalance"] < 1e-6, name, summary["resultants"])
    return summary


def near(got, wanted, tolerance):
    check(abs(got - wanted) <= tolerance * abs(wanted), got, "is not", wanted, "within", tolerance)


@options(None)
def test_cylinder_is_a_line_contact_of_hertz(s):
    contact = solved(s, "cylinder")["contact"]
    pressure, half_width = gallery.hertz(contact)
    near(contact["max_pressure"], pressure, 0.03)
    near(contact["area"], half_width, 0.03)
    check(contact["max_pressure_at"]["x"] == [0, -50], contact)


@options(None)
def test_press_fit_has_the_pressure_of_lame(s):
    """The nodes of the rings do not meet, and chords of different lengths are on top of each other, so that single
    pressures scatter about the mean."""
    contact = solved(s, "press_fit")["contact"]
    near(-contact["reaction_sum"] / contact["area"], gallery.lame(), 0.03)
    check(contact["active"] == contact["candidates"], contact)
    near(contact["force"][0], contact["force"][1], 1e-6)  # the same along both axes of a quarter


@options(None)
def test_bracket_is_held_by_bolt_and_wall(s):
    """Contact alone holds it: the bolt carries the load, bolt and wall the couple that it makes."""
    acts = solved(s, "bracket")["resultants"]
    bolt, wall = acts["contacts"]
    check((bolt["on"], wall["on"]) == ("hole", "back") and acts["supports"] == [], acts)
    near(bolt["force"][1], -acts["loads"]["force"][1], 1e-6)
    near(bolt["force"][0], -wall["force"][0], 1e-6)
    near(bolt["moment"][0] + wall["moment"][0], -acts["loads"]["moment"][0], 1e-6)
    check(wall["force"][0] > 0, wall)


@options(None)
def test_gear_presses_each_tooth(s):
    """Symmetric about the middle of the block, so that the moment is the force by half its width. The corners of the
    teeth strain the rubber by more than small deformation allows, which has to be said."""
    summary = solved(s, "gear")
    contact = summary["resultants"]["contacts"][0]
    near(contact["moment"][0], 30 * contact["force"][1], 1e-6)
    check(contact["force"][1] > 0 and summary["contact"]["active"] >= 6, summary["contact"])
    check("large_strain" in [one["code"] for one in summary["warnings"]], summary["warnings"])


@options(None)
def test_paper_body(s):
    contact = solved(s, "paper_body")["contact"]
    check(contact["active"] == 22, contact)
    near(contact["reaction_sum"], -10.513717, 1e-7)


@options(None)
def test_meshes_are_those_of_the_program(_):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-B", FOLDER / "meshes.py", folder], check=True, timeout=60)
        made = sorted(pathlib.Path(folder).iterdir())
        check([path.name for path in made] == ["cylinder.json", "gear.json", "press_fit.json"], made)
        for path in made:
            check(path.read_bytes() == (FOLDER / path.name).read_bytes(), path.name, "differs from the one that is kept")


def check_picture(path):
    root = xml.etree.ElementTree.parse(path).getroot()
    check(root.tag.endswith("svg") and path.stat().st_size < SMALL, path, path.stat().st_size)
    return root.get("viewBox")


@options(None)
def test_make_gallery(s):
    """What it draws is what is kept, and its numbers are those of the tutorial."""
    rows = []
    for name in FILES:
        text = file_of(s, name, "txt").read_text()
        rows.append(gallery.scene(name, summary_of(s, name)))
        check(rows[-1]["outcome"] == "converged" and rows[-1]["active"] <= rows[-1]["candidates"], rows[-1])
        check("outcome     converged" in text and "\nforces " in text, text)
        drawn = check_picture(file_of(s, name, "svg"))
        check(drawn == check_picture(FOLDER / f"{name}.svg"), name, drawn)
    kept = json.loads((ROOT / "docs/figures/gallery.json").read_text())
    for name, value in inline.VALUES.items():
        if name.split(".")[0] in FILES:
            check(value({"gallery": {"scenes": rows}}) == value({"gallery": kept}), name, rows)


if __name__ == "__main__":
    service.main(globals())
