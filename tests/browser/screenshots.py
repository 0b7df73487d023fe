"""The pictures of the web page in docs, from the running product. usage: screenshots.py BUILD_DIR FOLDER"""
import io
import json
import pathlib
import sys
import time

import browser
from browser import ROOT, check
from service import ENDLESS, Service

MOST = 150e3  # bytes of a picture
GALLERY = ("press_fit", "bracket", "gear", "cylinder")


def small(png):
    """The same picture, packed better."""
    from PIL import Image
    out = io.BytesIO()
    Image.open(io.BytesIO(png)).convert("RGB").save(out, "PNG", optimize=True)
    return min(png, out.getvalue(), key=len)


def keep(b, folder, name):
    time.sleep(0.4)  # whatever is still being drawn
    png = small(b.picture())
    check(len(png) < MOST, name, "has", len(png), "bytes")
    (folder / f"{name}.png").write_bytes(png)
    print(f"{name}.png {len(png)} bytes")


def solve_some(s):
    """Jobs of many kinds; the ids by name."""
    paper = json.loads((ROOT / "tests/data/paper_body.json").read_text())
    ids = {name: s.solve(json.loads((ROOT / f"client/examples/gallery/{name}.json").read_text()))["id"] for name in GALLERY}
    for method in ("uzawa", "accelerated", "accelerated_restart"):
        ids[method] = s.solve({**paper, "solver": {**paper["solver"], "method": method}, "tags": ["paper", method]})["id"]
    s.solve({**paper, "solver": {"method": "uzawa", "max_iterations": 40}, "tags": ["paper", "short"]})
    s.solve({"problem": {"kind": "matrices", "K": "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 -1\n", "p": [1]}, "tags": ["wrong"]})
    s.post({**ENDLESS, "tags": ["long"]})
    return ids


def job_page(b, s, job):
    b.open(s, f"jobs/{job}")
    b.wait("curves", "return document.querySelector('#convergence .line') && document.querySelector('.downloads button')")


def take_all(s, b, folder):
    ids = solve_some(s)
    b.open(s)
    b.wait("all rows", "return document.querySelectorAll('.sizer .row').length >= 10")
    keep(b, folder, "list")
    job_page(b, s, ids["accelerated_restart"])
    keep(b, folder, "job")
    for other in ("uzawa", "accelerated"):
        b.write("#overlay", ids[other])
        b.click("#overlay-add")
        b.wait("the other's curve", "return document.querySelector('#convergence .legend').innerText.includes(arguments[0])", ids[other][-8:])
    for quantity in ("residual_total", "dual_objective"):
        b.click(f"#convergence input[value={quantity}]")
    b.run("document.querySelector('#convergence').scrollIntoView({block: 'start'})")
    keep(b, folder, "overlay")
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", b.run("return document.querySelector('#job-text').value").replace('"poisson"', '"poison"'))
    b.says("#verdict", "Did you mean")
    b.click("#go-there")
    b.says("#key-help", "problem.materials")
    keep(b, folder, "editor")
    b.open(s, "compare")
    b.click("#compare-start")
    b.says("main", "All four are solved")
    keep(b, folder, "compare")
    b.open(s, f"jobs/{ids['bracket']}")
    b.wait("the body", "return document.querySelector('#body canvas, #body img')")
    time.sleep(2)
    b.run("document.querySelector('#body').closest('section').scrollIntoView({block: 'start'})")
    keep(b, folder, "body")
    b.media("prefers-color-scheme", "dark")
    job_page(b, s, ids["accelerated_restart"])
    keep(b, folder, "dark")
    b.media("prefers-color-scheme", "light")
    b.size(360, 740, phone=True)
    job_page(b, s, ids["press_fit"])
    keep(b, folder, "phone")


def main():
    build, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    s = Service(build)
    b = browser.start()
    try:
        s.start()
        take_all(s, b, folder)
    finally:
        b.quit()
        s.stop()


main()
