"""The page for everybody: axe-core's rules on every view, and a phone. usage: test_accessible.py BUILD_DIR [FILTER]"""
import pathlib
import shutil
import subprocess
import sys

import browser
from browser import ROOT, Skip, check
from service import SCENE

SERIOUS = ("serious", "critical")
PHONE = (360, 740)


def axe():
    """The source of axe-core, as package-lock.json names it, from BUILD_DIR/browser or else from npm."""
    folder = pathlib.Path(sys.argv[1], "browser")
    source = folder / "node_modules/axe-core/axe.min.js"
    if source.exists():
        return source.read_text(encoding="utf-8")
    if not shutil.which("npm"):
        raise Skip("needs npm to get axe-core, which is what looks for the findings")
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(ROOT / "tests/browser" / name, folder)
    got = subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=folder, capture_output=True, text=True,
                         timeout=120, check=False)
    if got.returncode != 0:
        if "EINTEGRITY" in got.stderr:
            raise AssertionError(got.stderr)
        raise Skip(f"axe-core could not be had from npm's registry: {got.stderr.strip().splitlines()[-1:]}")
    return source.read_text(encoding="utf-8")


def findings(b, source):
    """What axe-core finds serious or critical in the page as it is: [rule, element]."""
    b.command("Runtime.evaluate", expression=source)
    result = b.driver.execute_async_script("axe.run(document, {resultTypes: ['violations']}).then(arguments[0])")
    check(len(result["passes"]) > 5, "axe did not look", result["passes"])
    return [(one["id"], one["impact"], node["html"][:200], node["failureSummary"]) for one in result["violations"]
            for node in one["nodes"] if one["impact"] in SERIOUS]


def views(s, b):
    """Every view, with something in it: (name, once it stands there)."""
    job = s.solve({**SCENE, "tags": ["demo"]})
    failed = s.solve({"problem": {"kind": "matrices", "K": "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 -1\n", "p": [1]}})
    cases = s.solve({**SCENE, "name": "Two cases", "cases": [{"name": "one", "loads": SCENE["problem"]["loads"]}, {"name": "two", "loads": []}]})
    b.open(s)
    b.one(".sizer .row")
    for box in b.all(".sizer .row .choice input"):
        box.click()
    yield "list"
    b.click(".sizer .row .menu-button")
    yield "menu"
    b.open(s, f"side/{job['id']}.{failed['id']}")
    b.one("#side-requests")
    yield "side by side"
    b.open(s, f"jobs/{cases['id']}")
    b.one("#cases-table")
    b.click("#request summary")
    yield "load cases"
    b.open(s, f"jobs/{job['id']}")
    b.wait("curves", "return document.querySelector('#convergence path.line') && document.querySelector('.downloads button')")
    b.click("#refine")
    yield "job"
    b.wait("the body", "return document.querySelector('.body-canvas')?.dataset.frames > 0 && document.querySelector('.body-pressure .chart')")
    b.click(".pressure-table summary")
    yield "body"
    b.open(s, f"jobs/{failed['id']}")
    b.one(".downloads button")
    yield "failed job"
    b.open(s, "new")
    b.says("#verdict", "Valid")
    yield "editor"
    b.write("#job-text", "{")
    b.says("#verdict", "Line 1")
    yield "editor with a mistake"
    b.open(s, "compare")
    b.click("#compare-start")
    b.says("main", "All four are solved")
    yield "comparison"
    b.click("#keys")
    b.one("#keys-dialog")
    yield "dialog"


def test_axe_has_no_serious_findings(s, b):
    source = axe()
    for view in views(s, b):
        for theme in ("light", "dark"):
            b.media("prefers-color-scheme", theme)
            found = findings(b, source)
            check(not found, view, theme, *[f"\n{one}" for one in found])
        b.media("prefers-color-scheme", "light")


def test_fits_a_phone(s, b):
    b.size(*PHONE, phone=True)
    for view in views(s, b):
        wide = b.run("""const out = document.documentElement.clientWidth;
            const inside = (e) => e.closest('.text-field, .scrolled, .unseen, .skip, .head');
            return [document.documentElement.scrollWidth, out, [...document.querySelectorAll('body *')].filter((e) =>
                !inside(e) && e.checkVisibility() && e.getBoundingClientRect().right > out + 1).map((e) => e.outerHTML.slice(0, 120))]""")
        check(wide[0] <= wide[1] == PHONE[0] and not wide[2], view, wide)
        small = b.run("""return [...document.querySelectorAll('button, select, a.button')].filter((e) => e.checkVisibility() &&
            !e.closest('.unseen') && Math.min(e.getBoundingClientRect().width, e.getBoundingClientRect().height) < 24).map((e) => e.outerHTML.slice(0, 120))""")
        check(not small, view, "too small for a finger (WCAG 2.2, 2.5.8)", small)


browser.main(globals())
