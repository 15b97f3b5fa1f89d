"""The page in a browser: its first screen, phones, dark and light, accessibility."""

import pytest
from support.viewers import opened, serious_faults

from replay.engine import compute
from replay.show.report.page import report_html
from replay.studies.synthetic_sessions import synthetic_session

pytestmark = pytest.mark.slow

DETECTORS = "paper=hybrid-qaco,hull50=collider[shape=hull,rate_hz=50],mesh50=discrete[rate_hz=50],exact"
WIDTHS = pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (1280, "dark"), (400, "light"), (400, "dark")])
BOX = """(name => {
  const box = document.querySelector(name).getBoundingClientRect();
  return [box.top, box.bottom, box.right];
})"""


@pytest.fixture(scope="module")
def report_file(tmp_path_factory):
    """The report of the made-up bench."""
    session, _ = synthetic_session("bench-bumps", seed=0, noise=None)
    file = tmp_path_factory.mktemp("demo") / "report.html"
    file.write_text(report_html(compute(session, detectors=DETECTORS)), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def laptop_page(report_file, tmp_path_factory):
    """The report in a window of 1280 x 720 pixels."""
    with opened(report_file.as_uri(), tmp_path_factory.mktemp("laptop"), (1280, 720)) as page:
        yield page


@pytest.fixture(scope="module")
def phone_page(report_file, tmp_path_factory):
    """The report in a window of 400 x 800 pixels."""
    with opened(report_file.as_uri(), tmp_path_factory.mktemp("phone"), (400, 800)) as page:
        yield page


HEADINGS = ["What", "When", "Why", "Do", "Cost", "Sure", "Also", "Or"]
"""Headings of the answer, which is a list of terms in the element ``.hero``."""

HEADINGS_OF_PAGE = "[...document.querySelectorAll('.hero dt')].map((term) => term.innerText)"
FONT_PIXELS = "parseFloat(getComputedStyle(document.querySelector('.hero dd')).fontSize)"


def test_first_screen_of_a_laptop_answers_beside_picture_and_ranking(laptop_page):
    """A window of 1280 x 720 pixels shows, without scrolling: headline, answer, picture, link to the viewer, ranking.

    Also the plot of loss against cost, and the navigation. The font of the answer is readable, 16 pixels or more.
    """
    first_screen = {
        "headline": "h1",
        "answer": ".hero dl",
        "picture": ".hero .still",
        "link to the viewer": ".hero .see",
        "ranking": ".rank",
        "plot": ".sc",
        "navigation": ".top nav",
    }
    for name, selector in first_screen.items():
        top, bottom, right = laptop_page.ask(f"{BOX}('{selector}')")
        assert 0 <= top < bottom <= 720, name
        assert right <= 1280, name
    assert laptop_page.ask(HEADINGS_OF_PAGE) == HEADINGS
    assert laptop_page.ask(FONT_PIXELS) >= 16


def test_report_has_a_lane_for_each_detector(laptop_page):
    """Four detectors: ant colony search (paper), hulls, meshes, and the reference (exact)."""
    labels = laptop_page.ask("[...document.querySelectorAll('.lane')].map((lane) => lane.dataset.detector)")
    assert set(labels) >= {"paper", "hull50", "mesh50", "exact"}


def test_phone_has_the_picture_below_the_headline(phone_page):
    """A phone of 400 x 800 pixels: headline, picture, answer, ranking and timeline are one below the other.

    The picture ends within 520 pixels, so that the answer begins on the first screen. The answer ends within one and a
    half, 1200 pixels; its font has 15 pixels or more.
    """
    selectors_downwards = ("h1", ".hero .still", ".hero dl", ".rank", ".time")
    assert phone_page.ask(HEADINGS_OF_PAGE) == HEADINGS
    tops = [phone_page.ask(f"{BOX}('{selector}')")[0] for selector in selectors_downwards]
    assert tops == sorted(tops)
    _top, picture_bottom, _right = phone_page.ask(f"{BOX}('.hero figure')")
    _top, answer_bottom, _right = phone_page.ask(f"{BOX}('.hero dl')")
    assert picture_bottom <= 520
    assert answer_bottom <= 1200
    assert phone_page.ask(FONT_PIXELS) >= 15


def test_ranking_of_a_phone_is_a_stack_of_cards(phone_page):
    """Rows of the ranking are one below the other, and its line of headings takes no room (under 40 pixels)."""
    tops = phone_page.ask("[...document.querySelectorAll('.rank tbody tr')].map((row) => row.offsetTop)")
    _top, _bottom, headings_right = phone_page.ask(f"{BOX}('.rank thead')")
    assert len(tops) > 1
    assert tops == sorted(set(tops))
    assert headings_right < 40


@WIDTHS
def test_nothing_is_clipped_or_fails_accessibility_checks(report_file, tmp_path, width, scheme):
    """Every fold of the report is open; the window is 800 pixels high, that of a laptop or of a phone wide.

    Nothing is wider than the window, but what keys can scroll (``tabindex``). The checker axe reports no serious fault,
    and the console no error.
    """
    too_wide = """[...document.querySelectorAll('table, svg, img, code')]
      .filter((node) => !node.closest('[tabindex]') && node.getBoundingClientRect().right > innerWidth)
      .map((node) => node.outerHTML)"""
    with opened(report_file.as_uri(), tmp_path, (width, 800), scheme) as page:
        page.ask("for (const fold of document.querySelectorAll('details')) fold.open = true")
        assert page.ask("document.documentElement.scrollWidth <= innerWidth")
        assert page.ask(too_wide) == []
        assert serious_faults(page, tmp_path) == []
        assert page.errors() == []
