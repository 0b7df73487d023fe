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
    names = b.run("return [...document.querySelectorAll('#example option:not([disabled])')].map((one) => one.value)")
    files = list((ROOT / "client/examples/gallery").glob("*.json"))
    check(len(names) == len(files) + 1, names, files)
    for name in names:
        b.run("location.hash = '#/new/' + arguments[0]", name)
        b.wait(f"{name} chosen", "return document.querySelector('#example')?.value === arguments[0]", name)
        b.says("#verdict", "Valid")
    source = json.loads((ROOT / "client/examples/gallery/press_fit.json").read_text())
    check(json.loads(b.run("return document.querySelector('#job-text').value")) == source or names[-1] != "press_fit",
          "the example is not what stands in its file")


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
    b.write("#job-text", b.run("return document.querySelector('#job-text').value").replace('"ux": 0, "uy": 0', '"uy": 0'))
    b.says("#verdict", "Valid")
    b.click("#submit")
    b.says(".verdict h2", "The body is free to move")
    b.click(".verdict a")
    check('"left", "uy": 0' in b.one("#job-text").get_property("value"), "the text is gone")


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


browser.main(globals())
