from xml.etree import ElementTree

import numpy as np
import pytest
from support.price_rows import ABOUT, price_row

from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, INVENTS, plots_of, subtitle
from replay.outputs.report import tradeoff_picture
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import answer_of


def tried(*rows):
    return Tradeoff(rows, (), (), (), (), ABOUT, answer_of(rows))


def rate(hz, lost, ms):
    names = {"line": "discrete, step rate", "axis": "step rate", "value": f"{hz} Hz", "detector": "discrete"}
    return price_row(f"discrete {hz}", ms, lost, live=ms, phases=36) | names


@pytest.fixture
def done():
    sphere = price_row("sphere", 0.01, 0, live=0.02, precision=0.01)
    plain = [price_row(name, ms, 0, live=ms, complete=True) for name, ms in (("exact", 0.05), ("hybrid", 0.3))]
    best = {"front": True, "front_online": True}
    return tried(plain[0] | best, plain[1], sphere, rate(10, 16, 0.06), rate(45, 9, 0.1), price_row("ants", 1.0, 2))


def test_both_kinds_can_be_opened_and_the_answer_is_the_title(done):
    assert tradeoff_picture.picture(done).startswith(b"\x89PNG")
    drawn = tradeoff_picture.picture(done, "svg").decode()
    ElementTree.fromstring(drawn)
    assert "p99 0.45 % of a 90 Hz frame: what sampling less often saves is too small" in done.answer
    words = [done.answer, *subtitle(done), "discrete, looked at less often", "10 Hz", "90 Hz", "sphere: 99 % false"]
    for one in (*words, *(text for plot in plots_of(done) for text in (plot.title, plot.x_words))):
        assert f"<!-- {one}" in drawn or one in drawn, one


def test_what_invents_is_apart_from_the_curves_and_the_best_and_the_complete_are_told(done):
    kinds = [mark.kind for mark in plots_of(done)[1].marks]
    assert kinds == [BEST, COMPLETE, INVENTS, CURVES[0], CURVES[0], FAINT]
    ((kind, curve),) = plots_of(done)[0].curves
    assert kind == CURVES[0] and [round(18 * mark.y) for mark in curve] == [16, 9]


def test_a_mark_stands_where_its_time_and_its_misses_are_and_its_bar_is_over_contacts(done):
    live = plots_of(done)[0]
    (mark,) = (one for one in live.marks if one.kind == CURVES[0] and round(18 * one.y) == 9)
    ticks = {words: x for x, words in live.x_ticks}
    assert mark.x == pytest.approx(ticks["0.1"]) and mark.low * 18 == pytest.approx(8.1)
    assert mark.high * 18 == pytest.approx(12.2)
    steps = np.diff(list(ticks.values()))
    assert steps == pytest.approx([steps[0]] * len(steps))


def test_a_table_without_rows_is_an_empty_picture():
    assert tradeoff_picture.picture(tried()).startswith(b"\x89PNG")
