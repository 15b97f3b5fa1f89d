from xml.etree import ElementTree

import numpy as np
import pytest
from support.price_rows import ABOUT, price_row

from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, plot_of, subtitle
from replay.outputs.report import tradeoff_picture
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import advice_of


def tried(*rows):
    return Tradeoff(rows, (), tuple(advice_of(rows)), (), ABOUT)


def rate(hz, missed, ms):
    names = {"line": "meshes at a step rate", "value": f"{hz}", "rate_hz": hz}
    return price_row(f"meshes at {hz} Hz", ms, (missed - 1, missed + 1), **names)


@pytest.fixture
def done():
    plain = [price_row(name, ms, 0, complete=True) for name, ms in (("exact", 0.1), ("hybrid", 0.3))]
    return tried(
        plain[0] | {"front": True}, plain[1], rate(10, 16, 0.006), rate(45, 9, 0.05), price_row("ants", 1.0, 2)
    )


def test_both_kinds_can_be_opened_and_the_answer_is_the_title(done):
    assert tradeoff_picture.picture(done).startswith(b"\x89PNG")
    drawn = tradeoff_picture.picture(done, "svg").decode()
    ElementTree.fromstring(drawn)
    plot = plot_of(done)
    for words in (done.answer, *subtitle(done), "meshes at a step rate", "45", "exact", plot.title, plot.x_words):
        assert f"<!-- {words}" in drawn or words in drawn, words


def test_a_mark_stands_where_its_time_and_its_wrong_contacts_are_and_its_bar_is_over_offsets(done):
    plot = plot_of(done)
    assert [mark.kind for mark in plot.marks] == [BEST, COMPLETE, CURVES[0], CURVES[0], FAINT]
    exact, _, rare, often, _ = plot.marks
    ticks = {words: x for x, words in plot.x_ticks}
    assert (
        exact.x == pytest.approx(ticks["0.1"]) and exact.y == 0 < often.low < often.y < often.high < rare.y < rare.high
    )
    steps = np.diff(list(ticks.values()))
    assert steps == pytest.approx([steps[0]] * len(steps))


def test_a_table_without_rows_is_an_empty_picture():
    assert tradeoff_picture.picture(tried()).startswith(b"\x89PNG")
