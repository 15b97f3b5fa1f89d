import io
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from support.price_rows import ABOUT, price_row

from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, INVENTS, LETTER, LINE, plots_of, subtitle
from replay.outputs.report import tradeoff_picture
from replay.outputs.report.drawing import DARK, LIGHT
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


def test_live_and_offline_share_no_axis_and_only_live_has_budgets(done):
    live, offline = plots_of(done)
    assert [words for _, words in live.budgets] == ["60 Hz", "72 Hz", "90 Hz", "120 Hz"] and not offline.budgets
    assert live.x_words != offline.x_words and len(live.marks) + 1 == len(offline.marks) == len(done.rows)
    assert live.y_words == offline.y_words == "contacts missed, whole or in part, of 18"


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


@pytest.mark.parametrize("letters", [1.0, 1.4])
def test_no_two_words_overlap_and_none_leaves_the_plot(letters):
    many = tried(*(price_row(f"a long name {k}", 0.1 + k / 1000, 0, live=0.1, complete=True) for k in range(30)))
    for plot in plots_of(many, letters):
        boxes = [(word.x, word.y, letters * LETTER * len(word.text), letters * LINE) for word in plot.words]
        assert len(boxes) > 5
        for k, (x, y, wide, high) in enumerate(boxes):
            assert x - wide / 2 >= 0 and x + wide / 2 <= 1
            assert all(abs(x - a) >= (wide + b) / 2 - 1e-9 or abs(y - c) >= high - 1e-9 for a, c, b, _ in boxes[:k])


def test_passes_phases_containment_and_faces_are_named(done):
    assert "7 live passes, 36 look phases. Containment in, faces out." in subtitle(done)[0]
    one = {"front": True, "front_online": True, "live_passes": 1}
    out = tried(price_row("a", 1.0, 0, live=1.0, containment=False) | one)
    assert "1 live pass, 1 look phase. Containment not in everywhere" in subtitle(out)[0]


def test_on_a_dark_page_nothing_is_drawn_on_white_paper(done):
    light, dark = (
        np.asarray(Image.open(io.BytesIO(tradeoff_picture.picture(done, theme=theme))).convert("L"))
        for theme in (LIGHT, DARK)
    )
    assert light.shape == dark.shape and np.median(light) == 255 and np.median(dark) < 40
    assert (dark > 200).sum() < 0.05 * dark.size


def test_colours_of_a_theme_differ_and_stand_out_from_its_paper():
    def lightness(colour):
        red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
        return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2

    for theme in (LIGHT, DARK):
        assert len(set(theme.kinds.values())) == len(theme.kinds)
        for colour in (*theme.kinds.values(), theme.ink, theme.faint):
            low, high = sorted((lightness(colour), lightness(theme.paper)))
            assert (high + 0.05) / (low + 0.05) > 2.0, colour


def test_a_table_without_rows_is_an_empty_picture():
    assert tradeoff_picture.picture(tried()).startswith(b"\x89PNG")
