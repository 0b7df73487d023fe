"""The page itself: its files, what it may do, addresses, keys, themes. usage: test_page.py BUILD_DIR [FILTER]"""
import gzip
import re

import browser
from browser import Keys, check
from service import SCENE, expect

FIRST_PAINT = 300e3  # bytes that may be transferred until the list stands there


def plain(reply):
    return gzip.decompress(reply.body) if reply.headers.get("content-encoding") == "gzip" else reply.body


def files_of(s, text, seen):
    """What a file of the page loads at once, itself included: {path: bytes as sent}."""
    for path in re.findall(r'(?:src|href)="(/page/[\w.-]+)"', text) + \
            re.findall(r'(?:from|import)\s*"(/page/[\w.-]+)"', text):
        if path in seen:
            continue
        reply = expect(s.get(path, Accept_Encoding="gzip"), 200)
        seen[path] = len(reply.body)
        files_of(s, plain(reply).decode(), seen)
    return seen


def test_files_may_be_kept_and_nothing_else_may_run(s, b):
    index = expect(s.get("/"), 200)
    policy = index.headers["content-security-policy"]
    check("default-src 'none'" in policy and "script-src 'self';" in policy and "style-src 'self';" in policy, policy)
    check("unsafe" not in policy and "http" not in policy and "*" not in policy, policy)
    check(index.headers["content-type"] == "text/html; charset=utf-8" and index.headers["referrer-policy"] == "no-referrer", index)
    check(index.headers["cache-control"] == "no-cache", index.headers)
    check(s.get("/", If_None_Match=index.headers["etag"]).status == 304, index.headers)
    files = files_of(s, index.body.decode(), {})
    check(len(files) >= 3, files)
    for path in files:
        reply = expect(s.get(path), 200)
        check("immutable" in reply.headers["cache-control"], path, reply.headers)
        check(s.get(path, If_None_Match=reply.headers["etag"]).status == 304, path)
        packed = expect(s.get(path, Accept_Encoding="gzip"), 200)
        check(plain(packed) == reply.body, path)
        if len(reply.body) >= 1024:
            check(len(packed.body) < 0.6 * len(reply.body) and packed.headers["vary"] == "Accept-Encoding", path, packed.headers)
            check(packed.headers["etag"] != reply.headers["etag"], path)
    expect(s.get("/page/main.js"), 404, "not_found")
    expect(s.get("/page/index.html.gz"), 404, "not_found")
    expect(s.request("POST", "/"), 405, "method_not_allowed")


def test_first_paint_needs_little(s, b):
    s.solve(SCENE)
    index = s.get("/", Accept_Encoding="gzip")
    bundle = len(index.body) + sum(files_of(s, plain(index).decode(), {}).values())
    check(bundle < FIRST_PAINT, "the bundle", bundle)
    b.open(s)
    b.one(".sizer .row")
    sent = b.run("""return [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]
                      .map((one) => [one.name, one.transferSize])""")
    total = sum(size for _, size in sent)
    check(bundle / 2 < total < FIRST_PAINT, total, sent)
    check(all(name.startswith(s.url) for name, _ in sent), "something came from elsewhere", sent)
    print(f"# first paint: {total} bytes sent, {bundle} of them the page's own files")


def test_other_code_does_not_run(s, b):
    b.open(s)
    b.run("""window.broken = [];
             document.addEventListener('securitypolicyviolation', (e) => window.broken.push(e.effectiveDirective));
             const code = document.createElement('script'); code.textContent = 'window.bad = 1'; document.body.append(code);
             const far = document.createElement('img'); far.src = 'http://127.0.0.1:9/x.png'; document.body.append(far);
             const style = document.createElement('style'); style.textContent = 'body{display:none}'; document.body.append(style);""")
    broken = b.wait("three violations", "return window.broken.length >= 3 && window.broken")
    check(b.run("return window.bad") is None and b.all("body")[0].is_displayed(), broken)
    check(sorted(broken) == ["img-src", "script-src-elem", "style-src-elem"], broken)
    check(all("Content Security Policy" in text for _, text in b.console()), "something else was said")


def test_addresses_lead_to_views(s, b):
    b.open(s)
    check(b.text("h1") == "Jobs", b.text("body"))
    b.says(".empty", "No jobs yet")
    for place, title in (("new", "New job"), ("compare", "Compare accuracies"), ("nonsense/%E0%A4", "Nothing here"), ("", "Jobs")):
        b.run("location.hash = '#/' + arguments[0]", place)
        b.says("h1", title)
    b.run("history.back()")
    b.says("h1", "Nothing here")
    check("Nothing here" in b.driver.title, b.driver.title)


def test_a_job_that_is_not_there(s, b):
    b.open(s, "jobs/" + "0" * 32)
    b.says("main [role=alert]", "no such job")
    check([level for level, text in b.console() if "404" not in text] == [], "other messages")


def test_keys(s, b):
    keys = b.driver.switch_to
    b.open(s)
    keys.active_element.send_keys(Keys.TAB)
    check(b.run("return document.activeElement.className") == "skip", "the first stop is not the skip link")
    check(b.run("return getComputedStyle(document.activeElement).outlineStyle") == "solid", "the focus is not seen")
    keys.active_element.send_keys(Keys.ENTER)
    check(b.run("return document.activeElement.id") == "main", "the skip link does not lead to the content")
    for key, title in (("n", "New job"), ("c", "Compare accuracies"), ("l", "Jobs")):
        b.all("body")[0].send_keys(key)
        b.says("h1", title)
    b.all("body")[0].send_keys("/")
    b.wait("focus on the search", "return document.activeElement.id === 'search'")
    keys.active_element.send_keys("n")
    check(b.text("h1") == "Jobs" and b.run("return document.activeElement.value") == "n", "a letter of a word was taken for a key")
    b.click("#keys")
    b.one("#keys-dialog input").click()  # off
    keys.active_element.send_keys(Keys.ESCAPE)
    b.wait("no dialog", "return !document.querySelector('dialog')")
    b.run("document.activeElement.blur()")
    b.all("body")[0].send_keys("n")
    check(b.text("h1") == "Jobs", "shortcuts that are off still work")


def test_list_is_walked_by_keys(s, b):
    ids = [s.solve(SCENE)["id"] for _ in range(3)]
    b.open(s)
    b.wait("three rows", "return document.querySelectorAll('.sizer .row').length === 3")
    body = b.all("body")[0]
    for _ in range(2):
        body.send_keys("j")
        body = b.driver.switch_to.active_element
    check(b.run("return document.activeElement.closest('.row').dataset.id") == ids[1], "j does not go down the list")
    body.send_keys(Keys.ENTER)
    b.wait("the job", "return location.hash === '#/jobs/' + arguments[0]", ids[1])
    b.says("h1", f"Job {ids[1][-8:]}")


def luminance(pixels):
    """Mean of what is seen, 0 to 255."""
    return sum(sum(colour) / 3 * n for colour, n in pixels.items()) / sum(pixels.values())


def test_light_and_dark(s, b):
    b.open(s)
    light = luminance(b.pixels())
    b.media("prefers-color-scheme", "dark")
    dark = luminance(b.pixels())
    check(light > 200 and dark < 60, light, dark)
    b.click("#theme")  # light
    check(luminance(b.pixels()) > 200, "the choice does not win over the system")
    b.driver.refresh()
    b.one("h1")
    check(luminance(b.pixels()) > 200, "the choice is forgotten")
    b.click("#theme")  # dark
    b.media("prefers-color-scheme", "light")
    check(luminance(b.pixels()) < 60, "dark is not dark")


def test_without_motion(s, b):
    b.media("prefers-reduced-motion", "reduce")
    b.open(s)
    moving = b.run("""return [...document.querySelectorAll('*')].filter((e) => {
        const style = getComputedStyle(e);
        return style.animationName !== 'none' || parseFloat(style.transitionDuration) > 0; }).map((e) => e.className)""")
    check(not moving, moving)


def test_a_service_that_is_gone_is_said_to_be_gone(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    s.end()
    b.click("#submit")
    b.says("#verdict", "The service does not answer")
    b.run("location.hash = '#/compare'")
    b.says("main h1", "Compare")
    b.says("main [role=alert]", "The service does not answer")
    b.one("main button")
    b.console()  # the browser's own lines about refused connections


browser.main(globals())
