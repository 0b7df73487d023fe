"""A service that asks for tokens. usage: test_token.py BUILD_DIR [FILTER]"""
import os
import pathlib
import tempfile

import browser
from browser import Keys, check, options
from service import SCENE

READ, SUBMIT = "r" * 20, "s" * 20
FOLDER = tempfile.TemporaryDirectory(prefix="uzawad-tokens-")
TOKENS = pathlib.Path(FOLDER.name, "tokens")
TOKENS.write_text(f"reader read {READ} owner=sender\nsender submit {SUBMIT}\n", encoding="utf-8")
os.chmod(TOKENS, 0o600)

# Wherever a page could leave something.
TRACES = """return [location.href, document.referrer, document.cookie, JSON.stringify({...localStorage}), JSON.stringify(history.state),
    document.documentElement.outerHTML, ...performance.getEntriesByType('resource').map((one) => one.name)].join(' ')"""


def give(b, secret, keep=False):
    field = b.one("#token-field")
    field.clear()
    field.send_keys(secret)
    if keep:
        b.click("#token-keep")
    b.click("#token-dialog button[type=submit]")


def submitted(s):
    headers = {"Authorization": f"Bearer {SUBMIT}", "Prefer": "wait=60"}
    return s.post(SCENE, headers).json["id"]


@options("--token-file", str(TOKENS))
def test_a_token_is_asked_for_and_left_nowhere(s, b):
    job = submitted(s)
    b.open(s)
    b.says("#token-dialog", "asks for a token")
    check(b.one("#token-field").get_attribute("type") == "password", "the token is shown")
    give(b, "wrong" * 5)
    b.says("#token-dialog", "did not accept")
    give(b, READ)
    b.wait("the list", "return document.querySelectorAll('.sizer .row').length === 1 && !document.querySelector('dialog')")
    b.run("location.hash = '#/jobs/' + arguments[0]", job)
    b.says("#certificate", "differs by at most")
    check(not b.all("dialog"), "it is asked for twice")
    check(READ not in b.run(TRACES) and b.run("return sessionStorage.length") == 0, b.run(TRACES)[:2000])
    # What the token does not allow is said, not asked for.
    b.run("location.hash = '#/new'")
    b.says("#verdict", "submit")
    check(not b.all("dialog"), b.text("body"))
    # It is gone with the page.
    b.driver.refresh()
    b.says("#token-dialog", "asks for a token")
    b.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
    b.wait("no dialog", "return !document.querySelector('dialog')")
    check(all("401" in text or "403" in text for _, text in b.console()), "other messages")


@options("--token-file", str(TOKENS))
def test_a_token_is_kept_for_the_tab_by_choice(s, b):
    submitted(s)
    b.open(s)
    give(b, SUBMIT, keep=True)
    b.one(".sizer .row")
    b.console()
    b.driver.refresh()
    b.one(".sizer .row")
    check(not b.all("dialog") and SUBMIT not in b.run(TRACES), "asked again, or left behind")
    b.run("location.hash = '#/new'")
    b.says("#verdict", "Valid")
    b.click("#submit")
    b.says("#certificate", "differs by at most")
    b.click("#token")
    b.says("#token-dialog", "asks for a token")
    check(b.run("return sessionStorage.length") == 0, "it is still kept")
    check(all("401" in text for _, text in b.console()), "other messages")


@options("--token-file", str(TOKENS))
def test_without_a_token(s, b):
    b.open(s)
    b.click("#token-dialog button[type=button]")
    b.says("main [role=alert]", "No jobs without a token")
    b.click("main [role=alert] button")
    give(b, READ)
    b.says(".empty", "No jobs yet")
    b.console()


browser.main(globals())
