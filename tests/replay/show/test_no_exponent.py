"""A gap of 300 mm and a frame of 120 ms are read as such on every screen, and never with an exponent."""

import re
from io import StringIO

import pytest
from rich.console import Console
from support.report_states import ABOUT, price_row
from support.small_worlds import unit_cubes_on_x

from replay.advice.pareto import advice_of
from replay.cli.run_tables import run_screen, run_tables
from replay.cli.terminal import stacked
from replay.document.run_result import Tradeoff
from replay.engine import compute
from replay.show.report.page import report_html
from replay.show.rerun_log.documents import answer_text
from replay.show.tradeoff_table import tradeoff_list

EXPONENT = re.compile(r"\d[eE][+-]?\d{2}\b")


def printed(content):
    """The text of something on a terminal, 200 columns wide."""
    console = Console(file=StringIO(), width=200)
    console.print(content)
    return console.file.getvalue()


@pytest.fixture(scope="module")
def run_with_wide_gap():
    """Unit cubes, in frames 1, 2 and 4 at 1.3, 1.3 and 0.9 m from middle to middle; their bounding spheres overlap.

    At 1.3 m the faces are 300 mm apart: the detector ``sphere`` reports a false contact.
    """
    return compute(unit_cubes_on_x({"a": [0] * 6, "b": [3, 1.3, 1.3, 3, 0.9, 3]}), detectors="sphere")


def test_a_wide_gap_is_read_in_millimetres(run_with_wide_gap):
    """Unit cubes, 1.3 m from middle to middle, reported in contact by their spheres: a gap of 300 mm, never 3e+02.

    Both screens of the terminal, the text beside the picture, and the page, without numbers of its drawings.
    """
    page = re.sub(r"<style>.*?</style>|data:[^\"]*|<path[^>]*>", "", report_html(run_with_wide_gap), flags=re.DOTALL)
    first_screen, tables = printed(run_screen(run_with_wide_gap)), printed(run_tables(run_with_wide_gap))
    texts = [first_screen, tables, answer_text(run_with_wide_gap), page]
    assert [number for text in texts for number in EXPONENT.findall(text)] == []
    assert "300 mm" in first_screen
    assert "300 mm" in page


def test_a_slow_frame_is_read_in_milliseconds():
    """Settings of a tradeoff that take 120 ms, 12 ms and 0.12 us a frame: the terminal never prints 1.2e-04."""
    rows = [
        price_row("exact", ms=120.0, missed=0),
        price_row("hulls", ms=12.0, missed=2, rate_hz=50),
        price_row("balls", ms=0.00012, missed=8),
    ]
    tradeoff = Tradeoff(rows=tuple(rows), front=("balls",), advice=tuple(advice_of(rows)), cut=(), about=ABOUT)
    screen = printed(stacked(tradeoff_list(tradeoff, is_complete=True), *tradeoff.advice))
    assert EXPONENT.findall(screen) == []
    assert "120 ms a frame" in screen
    assert "0.00012" in screen
