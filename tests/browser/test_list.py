"""The list of jobs. usage: test_list.py BUILD_DIR [FILTER]"""
import json
import sqlite3

import browser
from browser import check, options
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
    check("successful" in rows(b)[0] and "≤" in rows(b)[0], rows(b))
    expect(s.request("DELETE", f"/v1/jobs/{waiting['id']}"), 204)
    has_rows(b, 1)


@options("--workers", "1")
def test_cancels_and_deletes(s, b):
    job = s.post(ENDLESS).json
    b.open(s)
    b.says(".sizer .row .status", "running")
    b.click(".sizer .row .action button")
    b.says(".sizer .row .action button", "Cancel?")
    check(s.get(f"/v1/jobs/{job['id']}").json["status"] == "running", "one press was enough")
    b.click(".sizer .row .action button")
    s.wait_status(job["id"], "dismissed", "successful")
    b.says(".sizer .row .action button", "Delete")
    b.wait("a button to press", "return !document.querySelector('.sizer .row .action button').innerText.includes('?')")
    b.click(".sizer .row .action button")
    b.says(".sizer .row .action button", "Delete?")
    b.click(".sizer .row .action button")
    b.says(".empty", "No jobs yet")
    check(s.get(f"/v1/jobs/{job['id']}").status == 404, "it is still there")


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


SCROLL = """const done = arguments[0], view = document.querySelector('.rows'), gaps = [], tasks = [];
const watch = new PerformanceObserver((list) => tasks.push(...list.getEntries().map((one) => one.duration)));
watch.observe({type: 'longtask'});
let last = performance.now(), frames = 0, empty = 0;
const step = (now) => {
    gaps.push(now - last);
    last = now;
    const box = view.getBoundingClientRect(), row = document.elementFromPoint(box.left + 200, box.top + box.height / 2)?.closest('.row');
    if (!row) empty++;
    view.scrollTop += 400;
    if (++frames < 120) requestAnimationFrame(step);
    else {
        watch.disconnect();
        gaps.sort((a, b) => a - b);
        done({median: gaps[60], worst: gaps[119], empty, tasks: tasks.length, longest: Math.max(0, ...tasks),
              elements: document.querySelectorAll('.sizer .row').length, top: view.scrollTop});
    }
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
    check(seen["processor"] < 120 * 0.05, "frames cost too much", seen)  # of 17 ms; the clock says what the machine does besides
    check(seen["longest"] < 2000, "the page stands still", seen)
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
