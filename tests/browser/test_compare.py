"""The comparison of the four accuracies. usage: test_compare.py BUILD_DIR [FILTER]"""
import browser
from browser import check
from service import wait_until

LEVELS = ["quick", "balanced", "precise", "exact"]


def test_four_accuracies_side_by_side(s, b):
    b.open(s, "compare")
    b.hold(".json")
    b.one("#compare-start")
    b.run("const start = document.querySelector('#compare-start'); start.click(); start.click()")
    b.held()
    b.release(0)
    wait_until(lambda: s.get("/v1/jobs").json["jobs"])
    b.release()  # what a second press asked for, if it did
    b.says("main", "All four are solved")
    tag = b.driver.current_url.split("/")[-1]
    jobs = {next(t[6:] for t in job["tags"] if t.startswith("level-")): job for job in s.get(f"/v1/jobs?tag={tag}").json["jobs"]}
    check(sorted(jobs) == sorted(LEVELS), jobs)
    table = b.run("return [...document.querySelectorAll('#trade-table tbody tr')].map((r) => [...r.children].map((c) => c.innerText))")
    check([row[0] for row in table] == LEVELS, table)
    for row in table:
        summary = jobs[row[0]]["summary"]
        check(row[1] == jobs[row[0]]["id"][-8:] and row[4] == f"{summary['iterations']:,}" and "%" in row[3], row, summary)
    # Each point stands where its time and its error are.
    at = b.run("""return [...document.querySelectorAll('#trade circle.series-1')].filter((c) => c.querySelector('title'))
                    .map((c) => [c.querySelector('title').textContent, +c.getAttribute('cx'), +c.getAttribute('cy')])""")
    check([name for name, _, _ in at] == LEVELS, at)

    def errors(name):
        return jobs[name]["summary"]["certificate"]["relative_error"]

    def times(name):
        return jobs[name]["summary"]["timings_s"]["iterate"] + jobs[name]["summary"]["timings_s"]["certify"]

    for (a, ax, ay), (c, cx, cy) in zip(at, at[1:]):
        check((errors(a) > errors(c)) == (ay < cy), a, c, "errors", at)
        check(times(a) == times(c) or (times(a) < times(c)) == (ax < cx), a, c, "times", at)
    b.shows("#trade .chart", "--series-1", 200)
    # By its address the comparison is there again, and makes no further jobs.
    b.open(s, f"compare/{tag}")
    b.says("main", "All four are solved")
    check(len(s.get("/v1/jobs").json["jobs"]) == 4, "jobs were made anew")


def test_of_the_editor(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", '{"problem": {"kind": "matrices", "K": "%%MatrixMarket matrix coordinate real symmetric\\n1 1 1\\n1 1 2\\n",'
                         ' "N": "%%MatrixMarket matrix coordinate real general\\n1 1 1\\n1 1 1\\n", "h": [0.25], "p": [1]}}')
    b.run("location.hash = '#/compare'")
    b.run("arguments[0].value = 'draft'", b.one("#compare-what"))
    b.click("#compare-start")
    b.says("main", "All four are solved")
    b.run("location.hash = '#/compare/there-is-none'")
    b.says("main", "no jobs of this comparison")


browser.main(globals())
