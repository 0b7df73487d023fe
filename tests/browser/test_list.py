"""The list of jobs. usage: test_list.py BUILD_DIR [FILTER]"""
import json
import sqlite3

import browser
from browser import Keys, check, options
from service import ENDLESS, MATRICES, SCENE, expect

MANY = 10000


def rows(b):
    """What the rows in sight say, from above."""
    return b.run("""return [...document.querySelectorAll('.sizer .row')].sort((a, b) => a.ariaRowIndex - b.ariaRowIndex)
                      .map((row) => row.innerText.replace(/\\s+/g, ' '))""")


def has_rows(b, count):
    b.wait(f"{count} rows", "return document.querySelectorAll('.sizer .row').length === arguments[0]", count)
    return rows(b)


@options("--workers", "1")
def test_is_live(s, b):
    b.open(s)
    b.says(".empty", "No jobs yet")
    b.says("#list-state", "live")
    job = s.post({**ENDLESS, "tags": ["endless"]}).json
    b.says(".sizer .row .status", "running")
    check("endless" in has_rows(b, 1)[0], rows(b))
    waiting = s.post(MATRICES).json
    check("waiting" in has_rows(b, 2)[0], rows(b))
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 200)
    s.wait_status(waiting["id"], "successful")
    b.wait("both ended", "return !document.querySelector('.chip.running, .chip.accepted')")
    check("converged" in rows(b)[0] and "≤" in rows(b)[0], rows(b))
    expect(s.request("DELETE", f"/v1/jobs/{waiting['id']}"), 204)
    has_rows(b, 1)


@options("--workers", "1")
def test_cancels_and_deletes(s, b):
    job = s.post(ENDLESS).json
    b.open(s)
    b.says(".sizer .row .status", "running")
    b.click(".sizer .row .menu-button")
    b.click(".menu [data-label=Cancel]")
    b.says(".menu", "Cancel it now")
    check(s.get(f"/v1/jobs/{job['id']}").json["status"] == "running", "one press was enough")
    b.click(".menu [data-label=Cancel]")
    s.wait_status(job["id"], "dismissed", "successful")
    b.says(".sizer .row .status", "dismissed")
    b.one(".sizer .row .menu-button").send_keys(Keys.ENTER)  # by the keyboard alone
    b.one(".menu")
    b.driver.switch_to.active_element.send_keys(Keys.ARROW_DOWN)
    b.driver.switch_to.active_element.send_keys(Keys.ENTER)
    b.says(".menu", "Delete for good")
    b.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
    b.wait("it is closed", "return !document.querySelector('.menu') && document.activeElement.matches('.menu-button')")
    check(s.get(f"/v1/jobs/{job['id']}").status == 200, "it was deleted all the same")
    b.click(".sizer .row .menu-button")
    b.click(".menu [data-label=Delete]")
    b.click(".menu [data-label=Delete]")
    b.says(".empty", "No jobs yet")
    check(s.get(f"/v1/jobs/{job['id']}").status == 404, "it is still there")


def test_every_cell_is_in_sight_at_any_width(s, b):
    """From a phone to a desk: nothing is cut off at the right, the menu of a job least of all."""
    s.post({**MATRICES, "name": "a name that is rather long", "tags": ["one tag", "another"]}, {"Prefer": "wait=20"})
    for width in (390, 701, 760, 820, 960, 961, 1100, 1280):
        b.size(width, 900, width < 700)
        b.open(s)
        b.wait(f"a row at {width}", "return document.querySelectorAll('.sizer .row').length === 1")
        right, menu = b.run("""const row = document.querySelector('.sizer .row'), box = document.querySelector('.jobs').getBoundingClientRect();
            return [Math.max(...[...row.children].filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect().right)) - box.right,
                    row.querySelector('.menu-button').getBoundingClientRect().right - box.right]""")
        check(right <= 0.5 and menu <= 0.5, width, right, menu)
    b.size(1200, 900)


def test_many_tabs_leave_connections_to_each_other(s, b):
    """A browser has six to a service. Pages that are left, and tabs that are not seen, hold none; a job that is not
    seen says in its title how it ends."""
    job = s.post(ENDLESS).json
    first = b.driver.current_window_handle
    b.open(s, f"jobs/{job['id']}")
    b.says(".title", "running")
    for _ in range(8):
        b.open(s)
        has_rows(b, 1)
    b.open(s, f"jobs/{job['id']}")
    b.says(".title", "running")
    tabs = []
    for _ in range(8):
        b.driver.switch_to.new_window("tab")
        tabs.append(b.driver.current_window_handle)
        b.open(s)
        has_rows(b, 1)
        b.says("#list-state", "live")
    expect(s.request("DELETE", f"/v1/jobs/{job['id']}"), 200)
    b.says(".sizer .row .status", "dismissed")
    for tab in tabs:
        b.driver.switch_to.window(tab)
        b.driver.close()
    b.to_front(first)
    b.says(".title", "dismissed")


def test_filters(s, b):
    s.solve({**SCENE, "tags": ["a", "b"]})
    s.solve({**SCENE, "tags": ["a"]})
    singular = {"problem": {**MATRICES["problem"], "K": MATRICES["problem"]["K"].replace("2 2 1\n", "2 2 -1\n")}}
    s.solve({**singular, "tags": ["b", "<b>bold</b>"]})
    b.open(s)
    check("<b>bold</b>" in has_rows(b, 3)[0], rows(b))
    b.write("#filter-tag", "a")
    has_rows(b, 2)
    b.write("#filter-tag", "a, b")
    has_rows(b, 1)
    b.write("#filter-tag", "")
    has_rows(b, 3)
    b.run("const field = document.querySelector('#filter-status'); field.value = 'failed'; field.dispatchEvent(new Event('change'))")
    check("positive definite" in has_rows(b, 1)[0], rows(b))
    b.run("location.hash = '#/new'")
    b.says("h1", "New job")
    b.run("location.hash = '#/'")
    has_rows(b, 1)  # as it was left
    b.write("#filter-tag", "nothing")
    b.says(".empty", "No job is like that")


def titles(b):
    return b.run("""return [...document.querySelectorAll('.sizer .row')].sort((a, b) => a.ariaRowIndex - b.ariaRowIndex)
                      .map((row) => row.querySelector('.job').innerText)""")


def test_searches_sorts_and_compares(s, b):
    heavy = {**SCENE["problem"], "loads": [{"on": "right", "traction": [1, 0]}, {"on": "top", "traction": [0, -0.05]}]}
    first = s.solve({**SCENE, "name": "Light beam", "problem": {**SCENE["problem"], "units": {"length": "mm", "force": "N"}}})
    second = s.solve({**SCENE, "name": "Heavy beam", "problem": heavy, "tags": ["heavy"]})
    s.solve({**SCENE, "solver": {"method": "uzawa", "max_iterations": 3}})
    b.open(s)
    check("iteration limit" in has_rows(b, 3)[0], rows(b))
    check(titles(b)[1:] == ["Heavy beam", "Light beam"], titles(b))
    b.click("[data-by=title] button")
    b.wait("sorted by name", "return document.querySelector('[data-by=title]').ariaSort === 'ascending'")
    b.wait("the order", "return [...document.querySelectorAll('.sizer .row')].find((r) => r.ariaRowIndex === '3' || r.getAttribute('aria-rowindex') === '3')?.innerText.includes('eam')")
    check(sorted(titles(b), key=str.lower) == titles(b), titles(b))
    b.click("[data-by=error] button")
    b.wait("the largest error first", """return [...document.querySelectorAll('.sizer .row')].sort((a, b) => a.getAttribute('aria-rowindex') - b.getAttribute('aria-rowindex'))[0]
        .innerText.includes('iteration limit')""")
    b.write("#search", "beam conv")
    has_rows(b, 2)
    b.says("#list-total", "2 jobs")
    b.click(".sizer .row .choice input")
    b.says(".chosen-bar", "1 job is chosen")
    check(b.run("return document.querySelector('#compare-chosen').disabled"), "one job alone is compared with nothing")
    b.run("[...document.querySelectorAll('.sizer .row .choice input')].find((box) => !box.checked).click()")
    b.says(".chosen-bar", "2 jobs are chosen")
    b.click("#compare-chosen")
    b.one("#side-requests")
    check({first["id"], second["id"]} == set(b.driver.current_url.split("/")[-1].split(".")), b.driver.current_url)
    asked = b.text("#side-requests")
    check("problem.loads" in asked and "problem.units.length" in asked and "problem.materials" not in asked, asked)
    answers = b.text("#side-answers")
    check("MPa" in answers and "%" in answers and "Light beam" in answers, answers)
    b.wait("both curves", "return new Set([...document.querySelectorAll('path.line')].map((one) => one.dataset.series.split(':')[0])).size === 2")
    b.open(s)
    b.write("#search", "")
    has_rows(b, 3)
    for _ in range(3):
        b.run("[...document.querySelectorAll('.sizer .row .choice input')].find((box) => !box.checked).click()")
    b.one("#delete-chosen")
    b.run("const button = document.querySelector('#delete-chosen'); button.click(); button.click()")  # within its 4 s
    b.says(".empty", "No jobs yet")


@options(None)
def test_comes_back_when_the_daemon_does(s, b):
    s.start()
    s.solve(SCENE)
    b.open(s)
    has_rows(b, 1)
    port = s.port
    s.terminate()
    b.says("#list-state", "connection lost")
    start = s.command
    s.command = lambda *given: start(*[f"127.0.0.1:{port}" if one == "127.0.0.1:0" else one for one in given])
    s.start()
    s.solve(SCENE)
    has_rows(b, 2)
    b.says("#list-state", "live")
    b.console()  # what Chromium says about a daemon that is not there


def fill(path, summary):
    """Adds ended jobs, older than any other."""
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA synchronous = OFF")
    with connection:
        connection.executemany(
            "INSERT INTO job(id, status, progress, attempts, created, started, finished, tags, summary)"
            " VALUES(?, 2, 100, 1, 1e9, 1e9, 1e9, ?, ?)",
            (("%012x%04x%016x" % (i, 0, i), json.dumps([f"number-{i}"]), summary) for i in range(MANY)))
        connection.executemany("INSERT INTO request(job, body) VALUES(?, x'7b7d')",
                               (("%012x%04x%016x" % (i, 0, i),) for i in range(MANY)))
    connection.close()


SCROLL = """const done = arguments[0], view = document.querySelector('.rows');
let frames = 0, empty = 0, waited = 0;
const step = () => { // a frame of the end, where the next page is waited for, is none of scrolling
    const box = view.getBoundingClientRect(), row = document.elementFromPoint(box.left + 200, box.top + box.height / 2)?.closest('.row');
    if (!row) empty++;
    const top = view.scrollTop;
    view.scrollTop += 400;
    if (view.scrollTop > top) frames++;
    else waited++;
    if (frames < 120 && waited < 2000) requestAnimationFrame(step);
    else done({empty, elements: document.querySelectorAll('.sizer .row').length, top: view.scrollTop});
};
requestAnimationFrame(step);"""


@options(None)
def test_ten_thousand_jobs_are_smooth(s, b):
    s.start()
    summary = json.dumps(s.solve(SCENE)["summary"])
    check(s.end() == 0, s.log())
    fill(s.db, summary)
    s.start()
    b.open(s)
    b.one(".sizer .row")
    b.command("Performance.enable", timeDomain="threadTicks")
    used = -b.processor()
    seen = b.driver.execute_async_script(SCROLL)
    seen["processor"] = used + b.processor()
    print(f"# scrolled {seen['top']} px in 120 frames: {json.dumps(seen)}")
    check(seen["top"] > 40 * 1000, "the list ends too early", seen)  # pages come as they are looked at
    check(seen["elements"] < 100, "rows out of sight are elements", seen)
    check(seen["empty"] < 12, "one sees no rows", seen)
    check(browser.SLOW or seen["processor"] < 120 * 0.05, "frames cost too much", seen)  # of 17 ms; the clock says what the machine does besides
    for _ in range(200):
        if b.run("const v = document.querySelector('.rows'); v.scrollTop = v.scrollHeight; return document.querySelector('#list-total').innerText") \
                == f"{MANY + 1:,} jobs":
            break
        b.driver.execute_async_script("setTimeout(arguments[0], 50)")
    b.says("#list-total", f"{MANY + 1:,} jobs")
    b.wait("the oldest job", """const v = document.querySelector('.rows'); v.scrollTop = v.scrollHeight;
        return [...document.querySelectorAll('.tag')].some((tag) => tag.innerText === 'number-0')""")
    b.run("document.querySelector('.rows').scrollTop = 200000")
    b.wait("the jobs of the middle", """return [...document.querySelectorAll('.sizer .row')].some((row) => row.ariaRowIndex === '5002')""")
    check(b.run("return document.querySelectorAll('.sizer .row').length") < 100, "rows are left behind")


browser.main(globals())
