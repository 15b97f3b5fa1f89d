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


HEADINGS = ["What", "When", "Why", "Do", "Cost", "Sure", "Also", "Or"]


def test_first_screen_of_a_laptop_answers_beside_picture_and_ranking(report_file, tmp_path):
    """1280 x 720 pixels; the answer's font is at least 16 pixels high; a lane for each of four detectors."""
    with opened(report_file.as_uri(), tmp_path, (1280, 720)) as page:
        for piece in ("h1", ".hero dl", ".hero .still", ".hero .see", ".rank", ".sc", ".top nav"):
            top, bottom, right = page.ask(f"{BOX}('{piece}')")
            assert 0 <= top < bottom <= 720 and right <= 1280, piece
        assert page.ask("[...document.querySelectorAll('.hero dt')].map(one => one.innerText)") == HEADINGS
        assert page.ask("parseFloat(getComputedStyle(document.querySelector('.hero dd')).fontSize)") >= 16
        assert page.ask("document.querySelectorAll('.lane').length") >= 4


def test_phone_has_the_picture_below_the_headline(report_file, tmp_path):
    """400 x 800 pixels: headline, picture, answer, ranking and timeline one below the other."""
    with opened(report_file.as_uri(), tmp_path, (400, 800)) as page:
        assert page.ask("[...document.querySelectorAll('.hero dt')].map(one => one.innerText)") == HEADINGS
        assert page.ask(f"{BOX}('.hero figure')[1]") <= 520 and page.ask(f"{BOX}('.hero dl')[1]") <= 1200
        assert page.ask("parseFloat(getComputedStyle(document.querySelector('.hero dd')).fontSize)") >= 15
        boxes = [page.ask(f"{BOX}('{piece}')[0]") for piece in ("h1", ".hero .still", ".hero dl", ".rank", ".time")]
        assert boxes == sorted(boxes)
        rows = page.ask("[...document.querySelectorAll('.rank tbody tr')].map(one => one.offsetTop)")
        assert rows == sorted(set(rows)) and page.ask(f"{BOX}('.rank thead')[2]") < 40


@WIDTHS
def test_nothing_is_clipped_or_fails_accessibility_checks(report_file, tmp_path, width, scheme):
    """Every fold of the report is open."""
    with opened(report_file.as_uri(), tmp_path, (width, 800), scheme) as page:
        page.ask("for (const one of document.querySelectorAll('details')) one.open = true")
        assert page.ask("document.documentElement.scrollWidth <= innerWidth")
        # What is wider than its place can be moved, by keys too.
        wide = "[...document.querySelectorAll('table, svg, img, code')].filter(one => !one.closest('[tabindex]') && "
        assert page.ask(f"{wide} one.getBoundingClientRect().right > innerWidth).map(one => one.outerHTML)") == []
        assert serious_faults(page, tmp_path) == [] and page.errors() == []
