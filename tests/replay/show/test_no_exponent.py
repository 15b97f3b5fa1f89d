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


def printed(made):
    """The text of something on a terminal."""
    console = Console(file=StringIO(), width=200)
    console.print(made)
    return console.file.getvalue()


@pytest.fixture(scope="module")
def distant():
    """Two cubes whose balls overlap, 1.3 m from middle to middle: 300 mm from face to face."""
    return compute(unit_cubes_on_x({"a": [0] * 6, "b": [3, 1.3, 1.3, 3, 0.9, 3]}), detectors="sphere")


def test_a_wide_gap_is_read_in_millimetres(distant):
    """300 mm, in terminal and page; numbers of drawings are left out of the page."""
    page = report_html(distant)
    body = re.sub(r"<style>.*?</style>|data:[^\"]*|<path[^>]*>", "", page, flags=re.DOTALL)
    screens = [printed(run_screen(distant)), printed(run_tables(distant)), answer_text(distant), body]
    assert [result for screen in screens for result in EXPONENT.findall(screen)] == []
    assert "300 mm" in screens[0] and "300 mm" in body


def test_a_slow_frame_is_read_in_milliseconds():
    """A frame of 120 ms and one of 0.12 us."""
    rows = [
        price_row("exact", ms=120.0, missed=0),
        price_row("hulls", ms=12.0, missed=2, rate_hz=50),
        price_row("balls", ms=0.00012, missed=8),
    ]
    done = Tradeoff(rows=tuple(rows), front=("balls",), advice=tuple(advice_of(rows)), cut=(), about=ABOUT)
    screen = printed(stacked(tradeoff_list(done, is_complete=True), *done.advice))
    assert EXPONENT.findall(screen) == [] and "120 ms a frame" in screen and "0.00012" in screen
