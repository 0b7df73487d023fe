"""The deformed body on a job's page, and the contact along its surface. usage: test_body.py BUILD_DIR [FILTER]"""
import copy
import json
import re

import browser
from browser import check
from service import MATRICES, SCENE, wait_until

SOLID = {"problem": {"kind": "scene", "model": "solid",
                     "mesh": {"box": {"size": [4, 2, 4], "cells": [6, 3, 6], "element": "hex8"}},
                     "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                     "supports": [{"on": "top", "ux": 0, "uy": -0.2, "uz": 0}], "loads": [],
                     "contacts": [{"on": "bottom", "obstacle": {"sphere": {"center": [2, -10, 2], "radius": 10}}}]},
         "solver": {"accuracy": {"relative_error": 1e-6}}}
VIRIDIS = ["#440154", "#472c7a", "#3b518b", "#2c718e", "#21908d", "#27ad81", "#5cc863", "#aadc32", "#fde725"]


LEGEND = "(document.querySelector('.body-legend').innerText + document.querySelector('.body-legend svg')?.getAttribute('aria-label'))"


def legend(b):
    """The numbers below the colour bar, and what it is called, with the least and the largest value."""
    return b.run(f"return {LEGEND}")


def show(s, b, request):
    """The body of a job, drawn."""
    job = s.solve(request)
    check(job["status"] == "successful", job)
    b.open(s, f"jobs/{job['id']}")
    drawn(b)
    b.one(".body-pressure .chart, .body-pressure .pressure-map")
    return job["id"]


def show_all(s, b, request):
    """The same, all of it, coloured by its displacement."""
    job = show(s, b, request)
    set_value(b, ".body-colour", "displacement", "change")
    after(b, lambda: press(b, "0"))
    return job


def drawn(b, more_than=0):
    """Waits for a frame after so many; returns how many there are."""
    return int(b.wait("a frame", "const f = document.querySelector('.body-canvas')?.dataset.frames; return f > arguments[0] && f",
                      more_than))


def after(b, act):
    """What `act` returns, once the picture has been drawn again."""
    before = int(b.run("return document.querySelector('.body-canvas').dataset.frames"))
    value = act()
    drawn(b, before)
    return value


def set_value(b, selector, value, event):
    b.run("""const field = document.querySelector(arguments[0]); field.value = arguments[1];
             field.dispatchEvent(new Event(arguments[2], {bubbles: true}));""", selector, value, event)


def coloured(b):
    """How many pixels of the picture are near each of the nine colours."""
    found = [0] * len(VIRIDIS)
    wanted = [tuple(int(text[i:i + 2], 16) for i in (1, 3, 5)) for text in VIRIDIS]
    for pixel, n in b.pixels(".body-frame").items():
        for i, colour in enumerate(wanted):
            if sum((p - c) ** 2 for p, c in zip(pixel, colour)) < 900:
                found[i] += n
                break
    return found


def columns(b):
    """First and last column of the picture with a pixel of the body's end, which is yellow; -1, -1: none."""
    import io

    from PIL import Image
    image = Image.open(io.BytesIO(b.picture(".body-frame"))).convert("RGB")
    pixels = image.load()
    seen = [x for x in range(image.width) for y in range(0, image.height, 4)
            if pixels[x, y][0] > 225 and pixels[x, y][1] > 200 and pixels[x, y][2] < 90]
    return (min(seen), max(seen)) if seen else (-1, -1)


def alike(some, others):
    """Counts of pixels; a few at edges are drawn one way or another."""
    return all(abs(a - b) <= 50 + 0.01 * b for a, b in zip(some, others))


def brightness(b):
    """Of all pixels of the picture, 0..255."""
    pixels = b.pixels(".body-frame")
    return sum(sum(pixel) * n for pixel, n in pixels.items()) / 3 / sum(pixels.values())


def press(b, key, shift=False):
    b.run("""const c = document.querySelector('.body-canvas'); c.focus();
             c.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], shiftKey: arguments[1], bubbles: true, cancelable: true}));""",
          key, shift)


def test_a_plane_body(s, b):
    """Colours, arrows and obstacle are seen; the slider moves the body; other quantities have their own numbers."""
    job = show_all(s, b, SCENE)
    found = coloured(b)
    check(min(found) > 2000, "pixels of each colour:", found)
    check(b.near(".body-frame", "--push", 60) > 200 and b.near(".body-frame", "--obstacle", 30) > 300, "arrows, obstacle")
    label = b.run("return document.querySelector('.body-canvas').getAttribute('aria-label')")
    check("300 elements" in label and "22 of 30 contact nodes touch" in label, label)
    check("1.5439" in legend(b), legend(b))
    ticks = [value.replace("×10", "e").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) for value in
             b.run("return [...document.querySelectorAll('.body-legend text')].map((one) => one.textContent)")]
    picture = s.get(f"/v1/jobs/{job}/deformed.svg?colour=displacements").body.decode()
    bar = re.findall(r'v4"/><text [^>]*>([^<]*)<', picture)
    check(len(ticks) > 2 and [float(one) for one in ticks] == [float(one) for one in bar], ticks, bar)
    end = columns(b)[1]
    after(b, lambda: set_value(b, ".body-scale", 0, "input"))
    still = columns(b)[1]
    check(still > 100 and end - still > 20, "the right end stood at", end, "and stands at", still)
    check(b.run("return document.querySelector('.body-factor').value") == "0", "the number beside it")
    after(b, lambda: set_value(b, ".body-factor", 10000, "change"))
    check(still + 10 < columns(b)[1] < end - 10, "the right end stands at", columns(b)[1])
    after(b, lambda: set_value(b, ".body-colour", "von_mises", "change"))
    stress = s.get(f"/v1/jobs/{job}/result?fields=von_mises").json["von_mises"]
    check(f"{max(stress):.4f}" in legend(b) and coloured(b) != found, legend(b), max(stress))
    after(b, lambda: set_value(b, ".body-colour", "pressure", "change"))
    check("Contact pressure" in legend(b) and b.near(".body-frame", "#8a8f96", 25) > 20000, "grey within")


def switch(b, part):
    after(b, lambda: b.run("""[...document.querySelectorAll('.body-parts label')]
        .find((label) => label.innerText === arguments[0]).querySelector('input').click()""", part))


def node_under_pointer(b):
    """What is said of the first contact node above the lower border in the middle of the picture."""
    b.run("document.querySelector('.body-frame').scrollIntoView({block: 'center'})")
    text = b.run("""const c = document.querySelector('.body-canvas'), r = c.getBoundingClientRect();
        for (let y = r.bottom - 5; y > r.top; y -= 6) {
            c.dispatchEvent(new PointerEvent('pointermove', {clientX: r.left + r.width / 2, clientY: y, pointerId: 7}));
            const text = document.querySelector('.body-readout').innerText;
            if (text.includes('pressure')) return text;
        }
        return '';""")
    return dict(line.split(" ", 1) for line in text.splitlines())


def test_nodes_parts_and_the_contact_along_the_surface(s, b):
    job = show_all(s, b, SCENE)
    answer = s.get(f"/v1/jobs/{job}/result?fields=nodes,pressure").json
    said = node_under_pointer(b)
    check(said and int(said["node"]) in answer["contact_nodes"], said)
    pressure = answer["pressure"][answer["contact_nodes"].index(int(said["node"]))]
    check(abs(float(said["pressure"]) - pressure) < 1e-4 * pressure, said, pressure)
    check([float(x) for x in said["at"].split(", ")] == answer["nodes"][int(said["node"])], said)
    for part in ("Obstacle", "Contact forces"):
        switch(b, part)
    check(b.near(".body-frame", "--push", 40) == 0, "arrows are still there")
    lined = brightness(b)
    switch(b, "Elements")
    check(brightness(b) > lined + 0.5, "elements are still drawn:", lined, brightness(b))
    b.one(".body-pressure .chart")
    b.shows(".body-pressure .chart", "--series-1", 100, 60)
    b.click(".pressure-table summary")
    b.one(".pressure-table table")
    rows = b.run("return [...document.querySelectorAll('.pressure-table tbody tr')].map((tr) => [...tr.children].map((td) => td.innerText))")
    check([int(row[0]) for row in rows] == answer["contact_nodes"], rows)
    check(all(abs(float(row[3]) - p) < 1e-4 * max(answer["pressure"]) for row, p in zip(rows, answer["pressure"])), rows)


def test_a_solid_is_turned_enlarged_and_moved(s, b):
    show_all(s, b, SOLID)
    first = b.pixels(".body-frame")
    check(sum(coloured(b)) > 5000, coloured(b))
    b.shows(".body-frame", "#c8c8c8", 5000, 45)
    for act in (lambda: press(b, "ArrowLeft"), lambda: press(b, "ArrowUp"), lambda: press(b, "+"), lambda: press(b, "ArrowLeft", True)):
        after(b, act)
        now = b.pixels(".body-frame")
        check(now != first, "nothing changed")
        first = now
    after(b, lambda: press(b, "0"))
    home = b.pixels(".body-frame")
    after(b, lambda: b.run("""const c = document.querySelector('.body-canvas'), r = c.getBoundingClientRect();
        const at = (x, y) => ({clientX: r.left + x, clientY: r.top + y, pointerId: 3, bubbles: true});
        c.dispatchEvent(new PointerEvent('pointerdown', at(200, 200)));
        c.dispatchEvent(new PointerEvent('pointermove', at(320, 200)));
        c.dispatchEvent(new PointerEvent('pointerup', at(320, 200)));"""))
    check(b.pixels(".body-frame") != home, "dragging turned nothing")
    check(b.one(".pressure-map") and sum(n > 0 for n in b.pixels(".pressure-map").values()) > 5, "the map of the pressure")


def test_cases_are_chosen_and_a_lost_graphics_card_comes_back(s, b):
    request = copy.deepcopy(SCENE)
    request["cases"] = [{"name": "pressed", "loads": [{"on": "top", "traction": [0, -1]}]},
                        {"name": "pulled", "loads": [{"on": "right", "traction": [1, 0]}]}]
    show_all(s, b, request)
    before = legend(b)
    b.run("""const field = [...document.querySelectorAll('.body-tools select')].find((one) => [...one.options].some((o) => o.value === 'pulled'));
             field.value = 'pulled'; field.dispatchEvent(new Event('change', {bubbles: true}));""")
    b.wait("the other case", f"return {LEGEND} !== arguments[0]", before)
    check(sum(coloured(b)) > 10000, coloured(b))
    b.run("""const c = document.querySelector('.body-canvas');
             window.card = (c.getContext('webgl2') || c.getContext('webgl')).getExtension('WEBGL_lose_context'); window.card.loseContext();""")
    b.says(".body-readout", "lost")
    after(b, lambda: b.run("window.card.restoreContext()"))
    b.wait("the picture", "return document.querySelector('.body-readout').hidden")
    check(sum(coloured(b)) > 10000, coloured(b))
    check(all("Context" in text for _, text in b.console()), "no other word")


def test_dark_and_narrow_and_sharp(s, b):
    b.media("prefers-color-scheme", "dark")
    b.command("Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=2, mobile=True)
    show_all(s, b, SCENE)
    size = b.run("const c = document.querySelector('.body-canvas'); return [c.width, c.clientWidth, document.documentElement.scrollWidth]")
    check(size[0] == 2 * size[1] and size[2] <= 360, size)
    check(min(coloured(b)) > 500 and b.near(".body-frame", "--paper", 12) > 5000, coloured(b))


PAIR = {"kind": "scene", "model": "solid", "mesh": {
            "nodes": [[x, y, z] for low, wide in ((0, 4), (1, 2)) for z in (low, low + 1) for y in (0, wide) for x in (0, wide)],
            "elements": {"hex8": [[0, 1, 3, 2, 4, 5, 7, 6], [8, 9, 11, 10, 12, 13, 15, 14]]},
            "groups": {"low": {"faces": [[4, 5, 7, 6]]}, "high": {"faces": [[8, 9, 11, 10]]}, "base": {"nodes": [0, 1, 2, 3]}, "head": {"nodes": [12, 13, 14, 15]}}},
        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
        "supports": [{"on": "base", "ux": 0, "uy": 0, "uz": 0}, {"on": "head", "ux": 0, "uy": 0, "uz": -0.05}], "contacts": [{"on": "high", "with": "low"}]}


def test_between_two_solids(s, b):
    """What presses is seen through the bodies, or not at all: they are before it."""
    show(s, b, {"problem": PAIR})
    through = sum(coloured(b)), b.near(".body-frame", "--push", 60)
    check(through[0] > 3000 and through[1] > 50, "pressure and arrows", through)
    switch(b, "See through")
    check(sum(coloured(b)) < through[0] / 2 and b.near(".body-frame", "--push", 60) == 0, coloured(b), through)
    switch(b, "See through")
    check(sum(coloured(b)) == through[0], coloured(b), through)


def press_button(b, text):
    after(b, lambda: b.run("[...document.querySelectorAll('.body-buttons button')].find((one) => one.innerText === arguments[0]).click()", text))


def test_it_begins_where_it_touches(s, b):
    """Coloured by the pressure, near, and from below where that is; the arrows are hidden from above."""
    request = copy.deepcopy(SCENE)
    request["problem"]["contacts"][0]["obstacle"] = {"circle": {"center": [30, -100], "radius": 100}}
    request["problem"]["supports"] = [{"on": "top", "ux": 0, "uy": -0.01}]
    request["problem"]["loads"] = []
    show(s, b, request)
    check("Contact pressure" in legend(b), legend(b))
    near, home = b.near(".body-frame", "--push", 60), coloured(b)
    press_button(b, "Show all")
    check(near > 10 and not alike(coloured(b), home), "all of it is no other picture")
    press_button(b, "Contact")
    check(alike(coloured(b), home), "where it touches", coloured(b), home)
    show(s, b, SOLID)
    below = b.near(".body-frame", "--push", 60)
    press_button(b, "Top")
    check(below > 100 and b.near(".body-frame", "--push", 60) == 0, "arrows from below and above", below)
    press_button(b, "Front")
    b.shows(".body-frame", "--push", 50, 60)


def test_colours_between_other_values(s, b):
    show_all(s, b, SCENE)
    before = coloured(b)
    after(b, lambda: set_value(b, ".body-high", 0.00005, "change"))
    now = coloured(b)
    check(now[-1] > 2 * before[-1] and "5×10⁻⁵" in legend(b), before, now, legend(b))
    after(b, lambda: b.click(".body-range button"))
    check(alike(coloured(b), before) and not b.run("return document.querySelector('.body-range button')"), before, coloured(b))
    after(b, lambda: set_value(b, ".body-low", 10, "change"))
    check(alike(coloured(b), before), "what leaves nothing between both ends")


def test_without_webgl_the_service_draws(s, b):
    script = b.command("Page.addScriptToEvaluateOnNewDocument", source="""
        const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind.startsWith("webgl") ? null : get.call(this, kind, ...more); };""")
    try:
        job = s.solve(SCENE)
        b.open(s, f"jobs/{job['id']}")
        b.wait("the picture", "const i = document.querySelector('#body img'); return i && i.complete && i.naturalWidth > 100")
        b.one(".body-pressure .chart")
    finally:
        b.command("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])


def test_a_large_body_sends_only_what_is_drawn_and_matrices_have_none(s, b):
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = [120, 40]
    request["solver"] = {"accuracy": "quick"}
    show(s, b, request)
    sent = b.run("""return performance.getEntriesByType('resource').filter((e) => e.name.includes('/surface')).map((e) => [e.encodedBodySize, e.decodedBodySize, e.name])""")
    check(sent and sent[0][1] < 4961 * 24 + 4800 * (24 + 16) + 20000, json.dumps(sent))
    check(not b.run("return document.querySelector('.body-parts input').checked"), "4,800 elements are not lined")
    check("von_mises" not in sent[0][2], "the stress is fetched with the shape:", sent)
    job = s.solve(MATRICES)
    b.open(s, f"jobs/{job['id']}")
    b.one("#convergence")
    check(not b.run("return document.querySelector('#open-body')?.checkVisibility()"), b.text("main"))


def test_fields_along_a_line(s, b):
    """The ends are typed or clicked, the curve is what the service says, and the line is seen on the body."""
    job = show_all(s, b, {**SCENE, "problem": {**SCENE["problem"], "units": {"length": "mm", "force": "N"}}})
    ink = b.near(".body-frame", "--ink", 30)
    b.click(".path summary")
    curve = "return document.querySelector('.path path.line')?.getAttribute('d')"
    first = b.wait("a curve", curve)
    check(b.run("return [document.querySelector('#path-from').value, document.querySelector('#path-to').value]") == ["0, 10", "60, 10"], "through the middle")
    check(b.near(".body-frame", "--ink", 30) > ink + 300, "no line on the body")
    said = b.run("return document.querySelector('.path .chart').textContent")
    check("von Mises stress, MPa" in said and "from (0, 10), mm" in said, said)
    set_value(b, "#path-curve", "u0", "change")
    b.wait("another curve", curve.replace("return ", "return arguments[0] !== "), first)
    # The answer about a line that is not asked for any more comes last, and is not taken.
    whole = b.run(curve)
    b.hold("/path?")
    set_value(b, "#path-to", "120, 10", "change")
    b.held()
    set_value(b, "#path-to", "60, 10", "change")
    b.held(2)
    b.release(1)
    b.release()
    check(b.run(curve) == whole, "the curve of the line before")
    # A line that leaves the body is interrupted: the body ends at 60.
    set_value(b, "#path-to", "120, 10", "change")
    b.wait("half a curve", """const d = document.querySelector('.path path.line').getBoundingClientRect(), c = document.querySelector('.path .chart').getBoundingClientRect();
        return d.width < 0.55 * c.width && d.width > 0.4 * c.width""")
    set_value(b, "#path-to", "nowhere", "change")
    b.says(".path [role=alert]", "to is a point")
    check(all("400" in text for _, text in b.console()), "no other word")
    # Two clicks on the body.
    after(b, lambda: set_value(b, ".body-scale", 0, "input"))
    b.click("#path-pick")
    for share in (0.3, 0.7):
        b.run("document.querySelector('.body-frame').scrollIntoView({block: 'center'})")
        b.run("""const c = document.querySelector('.body-canvas'), r = c.getBoundingClientRect();
            for (const name of ['pointerdown', 'pointerup'])
                c.dispatchEvent(new PointerEvent(name, {clientX: r.left + arguments[0] * r.width, clientY: r.top + r.height / 2, pointerId: 7, bubbles: true}));""", share)
    b.wait("ends", "return document.querySelector('#path-to').value !== 'nowhere' && document.querySelector('#path-pick').getAttribute('aria-pressed') === 'false'")
    ends = b.run("return [document.querySelector('#path-from').value, document.querySelector('#path-to').value]")
    nodes = s.get(f"/v1/jobs/{job}/result?fields=nodes").json["nodes"]
    places = [[float(x) for x in end.split(", ")] for end in ends]
    check(all(place in nodes for place in places) and places[0][0] < places[1][0], places)
    b.wait("no complaint", "return document.querySelector('.path [role=alert]').hidden")
    for width, phone, dark in ((1200, False, False), (760, False, True), (360, True, False)):
        b.size(width, 800, phone)
        b.media("prefers-color-scheme", "dark" if dark else "light")
        b.wait("drawn anew", "return document.querySelector('.path .chart').getBoundingClientRect().right <= innerWidth")
        check(b.run("return document.documentElement.scrollWidth <= innerWidth"), width, "the page is wider than the screen")
        b.shows(".path .chart", "--series-1", 60)


def test_a_plane_cuts_a_solid(s, b):
    """What lies beyond is gone, the section stands in the colours of the body, and moves with the plane."""
    job = show_all(s, b, SOLID)
    whole = b.near(".body-frame", "--paper", 6)
    after(b, lambda: set_value(b, ".body-cut", "2 1", "change"))
    section = "return performance.getEntriesByType('resource').filter((e) => e.name.includes('/section')).length"
    count = b.wait("a section", section)
    wait_until(lambda: b.near(".body-frame", "--paper", 6) > whole + 2000 and sum(coloured(b)) > 10000)  # half of the body
    press_button(b, "Front")
    front = b.picture(".body-frame")
    after(b, lambda: set_value(b, ".body-cut-at", 30, "input"))
    b.wait("another section", section.replace(".length", f".length > {count}"))
    check(b.picture(".body-frame") != front, "the plane moved")
    # From the front the cut is seen alone, in the values of the service: no pixel is grey, one is of the largest stress,
    # which is asked for while the section is on its way.
    b.hold("/section")
    after(b, lambda: set_value(b, ".body-cut-at", 31, "input"))
    b.held()
    after(b, lambda: set_value(b, ".body-colour", "von_mises", "change"))
    b.release()
    b.wait("its stress", "return performance.getEntriesByType('resource').some((e) => e.name.includes('/section') && e.name.includes('von_mises'))")
    wait_until(lambda: sum(n > 100 for n in coloured(b)) >= 3 and b.near(".body-frame", "#8a8f96", 12) < 500)
    grey = b.near(".body-frame", "#8a8f96", 12)
    after(b, lambda: set_value(b, ".body-colour", "pressure", "change"))
    check(b.near(".body-frame", "#8a8f96", 12) > grey + 5000, "there is no contact pressure within")
    after(b, lambda: set_value(b, ".body-colour", "displacement", "change"))
    after(b, lambda: set_value(b, ".body-cut", "", "change"))
    press_button(b, "Show all")
    check(abs(b.near(".body-frame", "--paper", 6) - whole) < 500, "all of it again", whole)
    for width, phone, dark in ((760, False, True), (360, True, False)):
        b.size(width, 800, phone)
        b.media("prefers-color-scheme", "dark" if dark else "light")
        check(b.run("return document.documentElement.scrollWidth <= innerWidth"), width, "the page is wider than the screen")


def test_a_section_has_its_range_and_no_arrows_of_what_is_gone(s, b):
    """A hot core within: the largest stress is not on the surface, and the bar of colours has it while it is to be seen."""
    core = {**{axis: {"min": 2.5, "max": 7.5} for axis in "xyz"}, "of": "elements"}
    body = {"problem": {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [10, 10, 10], "cells": [8, 8, 8], "element": "hex8"}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3, "expansion": 1e-4}],
                        "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}], "loads": [{"on": "top", "traction": [0, -1, 0]}, {"on": {"where": core}, "temperature": 100}],
                        "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}}]}}
    job = show_all(s, b, body)
    answer = s.get(f"/v1/jobs/{job}/result?fields=von_mises,nodes").json
    surface = max(v for v, x in zip(answer["von_mises"], answer["nodes"]) if any(c in (0, 10) for c in x))
    inside = max(v for v, x in zip(answer["von_mises"], answer["nodes"]) if x[2] == 5)
    check(inside > 1.05 * surface, inside, surface)
    high = "return Number(document.querySelector('.body-high').value)"
    after(b, lambda: set_value(b, ".body-colour", "von_mises", "change"))
    b.wait("the surface's", high.replace("return", "return Math.abs(1 -") + f" / {surface}) < 1e-4")
    after(b, lambda: set_value(b, ".body-cut", "2 1", "change"))
    b.wait("the section's", high.replace("return", "return Math.abs(1 -") + f" / {inside}) < 1e-4")
    after(b, lambda: set_value(b, ".body-cut", "", "change"))
    b.wait("the surface's again", high.replace("return", "return Math.abs(1 -") + f" / {surface}) < 1e-4")
    press_button(b, "Contact")
    arrows = b.near(".body-frame", "--push", 12)
    for way in ("1 1", "1 -1"):  # above the contact, and the contact itself
        after(b, lambda: set_value(b, ".body-cut", way, "change"))
        left = b.near(".body-frame", "--push", 12)
        check(left > 0.5 * arrows if way == "1 1" else left < 0.1 * arrows, way, left, arrows)


browser.main(globals())
