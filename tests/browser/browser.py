"""The page in Debian's Chromium, headless, driven through its own WebDriver: what tests/browser/test_*.py share.

A test is a function test_*(s, b): s is a running Service (tests/api/service.py), b the browser, a selenium WebDriver with
a few methods more. `browser.main(globals())` runs them like service.main. WebGL is drawn by SwiftShader, without a
graphics card. After each test its console must be empty: whatever a test provokes on purpose it takes by b.console().

BROWSER_SLOW=6 makes the page as slow as a far service and an old phone do, in every tab: each request is answered 300 ms
late, what a script fetches up to 700 ms more, at random, so that answers overtake each other, and the processor takes six
times as long (1: as ever, for a machine that is busy anyway). A test that reads once what it should wait for fails then,
and so does one of a page that takes a stale answer for a new one.
"""
import base64
import os
import pathlib
import shutil
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests" / "api"))

import service  # noqa: E402
from service import PATIENT_S, Skip, check, options  # noqa: E402,F401

try:
    from selenium import webdriver
    from selenium.common.exceptions import StaleElementReferenceException
    from selenium.webdriver.chrome.service import Service as Driver
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys  # noqa: F401
except ImportError:
    webdriver = None


def start(width=1200, height=900, dark=False):
    """A browser with an empty profile; the caller calls quit()."""
    wanted = webdriver.ChromeOptions()
    for one in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-device-scale-factor=1", "--no-first-run",
                "--disable-gpu-watchdog", "--disable-gpu-process-crash-limit", "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP *.example 127.0.0.1", f"--window-size={width},{height}"):
        wanted.add_argument(one)
    wanted.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    wanted.binary_location = shutil.which("chromium")
    driver = webdriver.Chrome(service=Driver(shutil.which("chromedriver")), options=wanted)
    driver.set_script_timeout(180)
    return Browser(driver, width, height, dark)


SLOW = float(os.environ.get("BROWSER_SLOW") or 0)  # times that the processor takes as long; 0: nothing is late
LATE = """const fetched = window.fetch;
window.fetch = async (...asked) => {
    const answer = await fetched(...asked);
    await new Promise((done) => setTimeout(done, 700 * Math.random()));
    return answer;
};"""
HOLD = """const fetched = window.fetch, part = arguments[0];
window.held = [];
window.end_hold = () => (window.fetch = fetched);
window.fetch = async (...asked) => {
    const answer = await fetched(...asked);
    if (asked[0].includes(part)) await new Promise((done) => window.held.push(done));
    return answer;
};"""
RELEASE = """const [which, done] = arguments;
if (which === null) window.end_hold();
for (const i of which ?? window.held.keys()) window.held[i]();
setTimeout(done, 100);"""

# What an element shows; of one that is hidden innerText would be all that is in it.
SHOWN = "const e = document.querySelector(arguments[0]); const text = e?.checkVisibility() ? e.innerText : ''; "


class Browser:
    """A WebDriver, and what tests do with a page."""

    def __init__(self, driver, width, height, dark):
        self.driver = driver
        self.slowed = set()
        self.size(width, height)
        self.media("prefers-color-scheme", "dark" if dark else "light")

    def size(self, width, height, phone=False):
        """Of the page itself, without a frame."""
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)

    def media(self, feature, value):
        """Emulates one media feature: ("prefers-reduced-motion", "reduce")."""
        self.command("Emulation.setEmulatedMedia", features=[{"name": feature, "value": value}])

    def command(self, name, **arguments):
        """One command of Chromium's own protocol."""
        return self.driver.execute_cdp_cmd(name, arguments)

    def slow_down(self):
        """Makes the tab as slow as BROWSER_SLOW asks for, once."""
        tab = self.driver.current_window_handle
        if SLOW and tab not in self.slowed:
            self.slowed.add(tab)
            self.command("Network.enable")
            self.command("Network.emulateNetworkConditions", offline=False, latency=300, downloadThroughput=-1, uploadThroughput=-1)
            self.command("Emulation.setCPUThrottlingRate", rate=SLOW)
            self.command("Page.addScriptToEvaluateOnNewDocument", source=LATE)

    def open(self, s, place=""):
        """Loads the page of a service anew, at a view: "", "new", "jobs/ID", "compare"."""
        self.slow_down()
        self.driver.get("about:blank")
        self.driver.get(f"{s.url}/#/{place}")
        self.wait("the view", "return document.querySelector('main').childElementCount > 0")

    def to_front(self, window):
        """Goes to a tab and shows it: one that is not shown draws no frame, and Chromium need not show it by itself when
        another is closed."""
        self.driver.switch_to.window(window)
        self.command("Page.bringToFront")

    def run(self, script, *arguments):
        """The value of a script that says `return`."""
        return self.driver.execute_script(script, *arguments)

    def wait(self, what, script, *arguments, seconds=PATIENT_S):
        """Waits until the script returns something true, and returns that."""
        end = time.monotonic() + seconds
        while True:
            value = self.run(script, *arguments)
            if value:
                return value
            check(time.monotonic() < end, "not there after", seconds, "s:", what, "\nthe page, which is",
                  self.run("return document.visibilityState"), "says:", self.text("body")[:1500], "\nthe console:", self.console())
            time.sleep(0.03)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def one(self, selector, seconds=PATIENT_S):
        """The element that a CSS selector finds, waited for until it is seen."""
        self.wait(selector, "const e = document.querySelector(arguments[0]); return e && e.checkVisibility()", selector,
                  seconds=seconds)
        return self.all(selector)[0]

    def click(self, selector):
        """Clicks on an element, also on one that is drawn anew meanwhile."""
        for _ in range(20):
            try:
                self.one(selector).click()
                return
            except StaleElementReferenceException:
                pass
        raise AssertionError(f"{selector} is never the same for long")

    def processor(self):
        """Seconds of processor that the page's own thread has used, whatever else the machine does."""
        metrics = {one["name"]: one["value"] for one in self.command("Performance.getMetrics")["metrics"]}
        return metrics["TaskDuration"]

    def text(self, selector):
        """What an element shows; "" if there is none."""
        return self.run(SHOWN + "return text", selector)

    def says(self, selector, text, seconds=PATIENT_S):
        """Waits until an element shows a text."""
        return self.wait(f"{selector} saying {text!r}", SHOWN + "return text.includes(arguments[1])", selector, text,
                         seconds=seconds)

    def write(self, selector, text):
        """Sets the value of a field as if it had been pasted."""
        self.one(selector)
        self.run("""const field = document.querySelector(arguments[0]);
                    field.focus(); field.value = arguments[1];
                    field.dispatchEvent(new Event('input', {bubbles: true}));""", selector, text)

    def console(self):
        """What came to the console since the last call: [level, message]."""
        return [(line["level"], line["message"]) for line in self.driver.get_log("browser") if line["level"] != "DEBUG"]

    def hold(self, part):
        """Answers that the page fetches from an address with `part` in it come to it when they are released."""
        self.run(HOLD, part)

    def held(self, count=1):
        """Waits until so many answers are there."""
        self.wait(f"{count} answers", "return window.held.length >= arguments[0]", count)

    def release(self, *which):
        """Answers, numbered as they came, go to the page, which has taken them then; without a number all, and none is
        held any more."""
        self.driver.execute_async_script(RELEASE, which or None)

    def picture(self, selector=None):
        """The PNG bytes of the page as it is in sight, or of an element."""
        if selector is None:
            return base64.b64decode(self.command("Page.captureScreenshot", format="png")["data"])
        place = """const e = document.querySelector(arguments[0]);
            e.scrollIntoView({block: 'center'});
            return JSON.stringify(e.getBoundingClientRect())"""
        for _ in range(20):  # what comes above it meanwhile moves it
            before = self.run(place, selector)
            png = self.one(selector).screenshot_as_png
            if self.run(place, selector) == before:
                break
        return png

    def pixels(self, selector=None):
        """{colour: how many} of the page in sight, or of an element; colours are (r, g, b)."""
        from PIL import Image
        import io
        image = Image.open(io.BytesIO(self.picture(selector))).convert("RGB")
        return {colour: n for n, colour in image.getcolors(image.width * image.height)}

    def near(self, selector, colour, distance=40):
        """How many pixels of an element are of nearly this colour, "#rrggbb" or the name of a variable "--series-1"."""
        text = self.run("return getComputedStyle(document.documentElement).getPropertyValue(arguments[0]).trim()",
                        colour) if colour.startswith("--") else colour
        wanted = tuple(int(text[i:i + 2], 16) for i in (1, 3, 5))
        return sum(n for got, n in self.pixels(selector).items()
                   if sum((a - b) ** 2 for a, b in zip(got, wanted)) <= distance ** 2)

    def shows(self, selector, colour, more_than, distance=40):
        """Waits until more pixels than so many are near the colour."""
        end = time.monotonic() + PATIENT_S
        while (found := self.near(selector, colour, distance)) <= more_than:
            check(time.monotonic() < end, selector, "has", found, "pixels like", colour, "of more than", more_than)

    def quit(self):
        self.driver.quit()


# The browser that the tests of a program share, one after another: each service is an origin of its own, so that nothing
# of one test is there in the next. A test that fails ends it.
SHARED = {}


def take_browser(downloads):
    missing = [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
    if webdriver is None or missing:
        raise Skip(f"needs {' and '.join(missing) or 'python3-selenium'}: make deps-test installs it")
    if "browser" not in SHARED:
        SHARED["browser"] = start()
    b = SHARED["browser"]
    b.downloads = downloads
    b.command("Browser.setDownloadBehavior", behavior="allow", downloadPath=downloads)
    b.size(1200, 900)
    b.media("prefers-color-scheme", "light")
    b.driver.get("about:blank")
    b.console()
    return b


def end_browser():
    if "browser" in SHARED:
        SHARED.pop("browser").quit()


def keep_picture(b, name):
    """BROWSER_PICTURES=FOLDER: what the page looked like when a test failed."""
    folder = os.environ.get("BROWSER_PICTURES")
    if folder:
        pathlib.Path(folder, f"{name}.png").write_bytes(b.picture())


def with_browser(test):
    """A test of service.main from one of a browser."""
    def run(s):
        downloads = tempfile.mkdtemp(prefix="downloads-")
        b = None
        try:
            b = take_browser(downloads)
            test(s, b)
            said = b.console()
            check(not said, "the console says", said)
            b.driver.get("about:blank")  # a stream that is open would keep the daemon from ending
        except Skip:
            raise
        except Exception:
            if b:
                keep_picture(b, test.__name__)
            end_browser()
            raise
        finally:
            shutil.rmtree(downloads, ignore_errors=True)
    run.__name__ = test.__name__
    if hasattr(test, "options"):
        run.options = test.options
    return run


def main(names):
    """As service.main, for tests that take a browser too."""
    try:
        service.main({name: with_browser(one) if name.startswith("test_") else one for name, one in names.items()})
    finally:
        end_browser()
