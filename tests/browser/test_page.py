"""The page itself: its files, its policy, its views. usage: test_page.py BUILD_DIR [FILTER]"""
import browser
from browser import check


def test_loads_without_a_word_on_the_console(s, b):
    b.open(s)
    check(b.text("h1") == "Jobs", b.text("body"))
    b.says(".empty", "No jobs yet")


browser.main(globals())
