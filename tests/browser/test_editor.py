"""The editor: mistakes at the right key, examples, submission. usage: test_editor.py BUILD_DIR [FILTER]"""
import json

import browser
from browser import Keys, check
from service import ROOT, SCENE

TEXT = json.dumps(SCENE, indent=2)
MARKED = """const marker = document.querySelector('.marker'), area = document.querySelector('#job-text');
if (!marker) return null;
const box = marker.getBoundingClientRect(), field = area.getBoundingClientRect(), style = getComputedStyle(area);
const height = parseFloat(style.lineHeight);
const line = Math.round((box.top - field.top - parseFloat(style.paddingTop) + area.scrollTop) / height);
const of = area.value.split('\\n')[line];
const probe = document.createElement('canvas').getContext('2d');
probe.font = style.font;
const wide = probe.measureText('0').width, from = Math.round((box.left - field.left - parseFloat(style.paddingLeft) + area.scrollLeft) / wide);
return [line + 1, of.slice(from, from + Math.round(box.width / wide)), area.getAttribute('aria-invalid')];"""


def wrong(b, text, says, line, marked):
    """Puts a text into the editor and waits until it says what is wrong, and marks that."""
    b.write("#job-text", text)
    b.wait("another verdict", "return !document.querySelector('#verdict').innerText.includes('Checking')")
    b.says("#verdict", says)
    b.says("#verdict", f"Line {line},")
    check(b.run(MARKED) == [line, marked, "true"], "wanted", line, marked, "but", b.run(MARKED))


def line_of(text, part):
    return text[:text.index(part)].count("\n") + 1


def test_mistakes_are_shown_at_their_key(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", TEXT)
    b.says("#verdict", "Valid")
    check(b.run(MARKED) is None, "something is marked")
    for old, new, says, marked in (('"poisson"', '"poison"', "Did you mean", '"poison"'),
                                   ('"young": 200000.0', '"young": -1', "greater than 0", '"young"'),
                                   ('"thickness": 5', '"thickness": "5"', "must be", '"thickness"'),
                                   ('"on": "left"', '"on": "lift"', "lift", '"on"')):
        text = TEXT.replace(old, new)
        check(text != TEXT, old)
        wrong(b, text, says, line_of(text, new), marked)
    lone = json.dumps({**SCENE, "problem": {k: v for k, v in SCENE["problem"].items() if k != "materials"}}, indent=2)
    wrong(b, lone, "materials", 2, '"problem"')
    b.console()  # each refusal is there, by its status


def test_mistakes_of_json_need_no_service(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    s.terminate()
    for old, new, says, after, marked in (('"thickness": 5,', '"thickness": 5', '"," or "}"', 1, '"'),
                                          ('"thickness": 5,', '"thickness": 05,', '"," or "}"', 0, "5"),
                                          ('"thickness": 5,', '"thickness": 5, "thickness": 5,', "twice", 0, '"'),
                                          ('"kind": "scene"', "'kind': \"scene\"", "in double quotes", 0, "'"),
                                          ('"kind": "scene"', '"kind": "scene', "does not end", 0, '"'),
                                          ('"kind": "scene"', '"kind": scene', "a value", 0, "s"),
                                          ('"kind": "scene"', '"kind": 1e', '"," or "}"', 0, "e")):
        text = TEXT.replace(old, new, 1)
        wrong(b, text, says, line_of(text, new) + after, marked)
    b.write("#job-text", TEXT[:-1])
    b.says("#verdict", f"Line {TEXT.count(chr(10)) + 1},")
    s.start()
    b.console()


def test_says_what_it_will_take(s, b):
    b.open(s, "new")
    b.says("#verdict", "660 unknowns, 30 contact rows")
    b.write("#job-text", json.dumps({**SCENE, "problem": {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": [60, 20]}}}}))
    b.says("#verdict", "2,520 unknowns, 60 contact rows")


def test_examples_are_all_valid(s, b):
    b.open(s, "new")
    files = {one.stem: one.read_text() for one in (ROOT / "client/examples/gallery").glob("*.json")}
    names = b.wait("an example for each file", """
        const names = [...document.querySelectorAll('#example option:not([disabled])')].map((one) => one.value);
        return names.length > arguments[0] && names""", len(files))
    check(len(names) == len(files) + 1 and set(files) < set(names), names, files.keys())
    for name in names:
        b.run("location.hash = '#/new/' + arguments[0]", name)
        b.wait(f"{name} chosen", "return document.querySelector('#example')?.value === arguments[0]", name)
        if name in files:
            b.wait(f"what stands in {name}'s file", """
                const plain = (text) => JSON.stringify(JSON.parse(text || null));
                return plain(document.querySelector('#job-text').value) === plain(arguments[0])""", files[name])
        b.wait("another verdict", "return !document.querySelector('#verdict').innerText.includes('Checking')")
        b.says("#verdict", "Valid")


def test_an_example_that_comes_late_replaces_nothing(s, b):
    """Neither what was typed meanwhile nor the draft, where another example was chosen."""
    b.open(s, "new")
    b.says("#verdict", "Valid")
    value = "return document.querySelector('#job-text').value"
    b.hold("gear")
    b.run("location.hash = '#/new/gear'")
    b.held()
    b.write("#job-text", TEXT)
    b.release(0)
    check(b.run(value) == TEXT, b.run(value)[:300])
    b.run("location.hash = '#/new/'")
    b.run("location.hash = '#/new/gear'")
    b.held(2)
    b.run("location.hash = '#/new/cylinder'")
    b.wait("the other example", "return document.querySelector('#example')?.value === 'cylinder'")
    chosen = b.wait("its text", value)
    b.release()
    b.run("location.hash = '#/'")
    b.says("h1", "Jobs")
    b.run("location.hash = '#/new'")
    b.says("#verdict", "Valid")
    check(b.run(value) == chosen, b.run(value)[:300])


def test_the_schema_explains_the_key_at_the_caret(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", TEXT)
    schema = s.get("/schemas/request.json").json
    for part, path, says in (('"thickness"', "problem.thickness", ""), ('"young"', "problem.materials[0].young", "greater than 0"),
                             ('"accuracy"', "solver.accuracy", schema["$defs"]["accuracy"]["description"][:60]),
                             ('"method"', "solver.method", "one of"), ('"traction"', "problem.loads[0].traction", ""),
                             ('"plane"', "problem.contacts[0].obstacle.plane", "Keys: point, normal")):
        b.run("""const area = document.querySelector('#job-text'); area.focus();
                 area.setSelectionRange(arguments[0], arguments[0]); area.dispatchEvent(new Event('click'));""", TEXT.index(part) + 2)
        b.says("#key-help", path + ":")
        b.says("#key-help", says)
    b.write("#job-text", TEXT.replace('"plane"', '"plain"'))
    b.says("#verdict", "plain")
    b.run("const a = document.querySelector('#job-text'); a.setSelectionRange(arguments[0], arguments[0]); a.dispatchEvent(new Event('click'))",
          TEXT.index('"plane"') + 2)
    b.says("#key-help", "plain: not known")
    b.says("#key-help", "plane")
    b.console()


def test_submits_once_and_shows_the_job(s, b):
    b.open(s, "new/gear")
    b.says("#verdict", "Valid")
    b.one("#job-text").send_keys(Keys.CONTROL, Keys.ENTER)
    b.says(".title h1", "Job")
    jobs = s.get("/v1/jobs").json["jobs"]
    check(len(jobs) == 1 and jobs[0]["tags"] == ["gallery", "gear"] and jobs[0]["id"] in b.driver.current_url, jobs)
    b.says("#certificate", "differs by at most")


def test_a_mistake_is_not_submitted(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", TEXT.replace('"model"', '"modell"'))
    b.click("#submit")
    b.says("#verdict", "modell")
    check(b.run(MARKED)[1] == '"modell"' and s.get("/v1/jobs").json["jobs"] == [], b.run(MARKED))
    b.click("#go-there")
    check(b.run("const a = document.querySelector('#job-text'); return a.value.slice(a.selectionStart, a.selectionStart + 8)") == '"modell"',
          "the caret is elsewhere")
    b.console()


def test_a_draft_is_kept(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", TEXT.replace("60", "66"))
    b.run("location.hash = '#/'")
    b.says("h1", "Jobs")
    b.run("location.hash = '#/new'")
    b.one("#job-text")
    b.wait("the draft", "return document.querySelector('#job-text').value === arguments[0]", TEXT.replace("60", "66"))


def test_a_job_that_fails_leads_back_to_its_text(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    text = b.run("return document.querySelector('#job-text').value")
    b.write("#job-text", text.replace('"ux": 0, "uy": 0', '"uy": 0'))
    b.says("#verdict", "translation along x free")  # nothing stops it, whatever the load is: told at once
    check("[0, -0.05]" in text, text)
    b.write("#job-text", text.replace('"ux": 0, "uy": 0', '"ux": 0').replace("[0, -0.05]", "[0, 0.05]"))
    b.says("#verdict", "Valid")
    b.click("#submit")
    b.says(".verdict h2", "The body is free to move")
    b.click(".verdict a")
    check('"left", "ux": 0' in b.one("#job-text").get_property("value"), "the text is gone")


def test_all_mistakes_at_once(s, b):
    """Of independent members each is told, marked, and a button leads there."""
    b.open(s, "new")
    b.says("#verdict", "Valid")
    text = b.run("return document.querySelector('#job-text').value")
    b.write("#job-text", text.replace('"poisson": 0.3', '"poison": 0.3').replace('"left"', "7").replace('"thickness": 5', '"thickness": -5'))
    b.says("#verdict", "3 mistakes")
    said = b.text("#verdict")
    for word in ("/problem/materials/0/poison is not known", 'Did you mean "poisson"', "/problem/supports/0/on must be", "/problem/thickness must be greater than 0"):
        check(word in said, word, said)
    check(len(b.all(".marker")) == 3 and len(b.all(".bad-line")) == 3, "marks")
    b.run("[...document.querySelectorAll('.mistakes li')].find((one) => one.innerText.includes('poison is')).querySelector('button').click()")
    check(b.run("const a = document.querySelector('#job-text'); return a.value.slice(a.selectionStart).startsWith('\"poison\"')"), "the caret is at the key")
    b.write("#job-text", text)
    b.says("#verdict", "Valid")
    check(not b.all(".marker") and not b.all(".mistakes"), "nothing is marked")
    check(all("422" in line for _, line in b.console()), "no other word")


def pixels_of(b, kind):
    return b.near("#preview .body-frame", {"support": "--series-1", "load": "--push", "contact": "--series-3"}[kind], 30)


def test_the_scene_is_drawn_while_it_is_typed(s, b):
    """Body, supports, loads, contacts and obstacle; what goes from the text goes from the picture."""
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.says("#preview", "1 support, 2 loads, 1 contact")
    check(all(pixels_of(b, kind) > 40 for kind in ("support", "load", "contact")), [pixels_of(b, kind) for kind in ("support", "load", "contact")])
    b.shows("#preview .body-frame", "#8a8f96", 5000, 12)
    request = json.loads(b.run("return document.querySelector('#job-text').value"))
    request["problem"]["loads"] = []
    b.write("#job-text", json.dumps(request))
    b.says("#preview", "0 loads")
    check(pixels_of(b, "load") < 20 and pixels_of(b, "support") > 40, "a load is still seen")
    b.write("#job-text", '{"problem": {"kind": "scene", "mesh"')
    b.says("#verdict", "This is not JSON")
    check(pixels_of(b, "support") > 40, "the last picture stays while one types")
    # A mesh of numbers, and a solid.
    request["problem"].update(mesh={"nodes": [[0, 0], [2, 0], [2, 1], [0, 1]], "elements": {"quad4": [[0, 1, 2, 3]]}, "groups": {"left": {"nodes": [0, 3]}, "bottom": {"edges": [[0, 1]]}}})
    b.write("#job-text", json.dumps(request))
    b.says("#preview", "1 support, 0 loads, 1 contact.")
    check(pixels_of(b, "support") > 10 and b.near("#preview .body-frame", "#8a8f96", 12) > 5000, "a mesh of numbers")
    solid = {"problem": {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [4, 2, 4], "cells": [6, 3, 6], "element": "hex8"}},
                         "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "supports": [{"on": "+y", "ux": 0, "uy": -0.2, "uz": 0}], "loads": [],
                         "contacts": [{"on": "bottom", "obstacle": {"sphere": {"center": [2, -10, 2], "radius": 10}}}]}}
    b.write("#job-text", json.dumps(solid))
    b.says("#verdict", "Valid")
    b.says("#preview", "1 support, 0 loads, 1 contact.")
    check(pixels_of(b, "support") > 40 and b.near("#preview .body-frame", "#c8c8c8", 45) > 2000, "the solid and its sphere")
    for width, phone, dark in ((760, False, True), (360, True, False)):
        b.size(width, 800, phone)
        b.media("prefers-color-scheme", "dark" if dark else "light")
        check(b.run("return document.documentElement.scrollWidth <= innerWidth"), width, "the page is wider than the screen")
    b.console()


def test_a_problem_in_matrices_from_four_files(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.click(".matrices summary")
    for name in "KNhp":
        b.one(f"#matrix-{name}").send_keys(str(browser.ROOT / f"tests/data/springs_{name}.mtx"))
        b.says(".matrices [role=status]", "The job names the files" if name == "p" else "Still to come")
    b.says("#verdict", "Valid")
    check(not b.run("return document.querySelector('#preview').checkVisibility()"), "there is no body")
    b.click("#submit")
    b.says(".verdict h2", "Converged")
    b.open(s, "new")
    b.click(".matrices summary")
    b.one("#matrix-K").send_keys(str(browser.ROOT / "tests/data/small_matrices.json"))
    b.says(".matrices [role=status]", "Still to come: p.")


browser.main(globals())
