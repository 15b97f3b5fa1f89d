"""A tradeoff in report and picture, in every state."""

from dataclasses import replace
from html import unescape
from re import findall

import pytest
from support.lettered_worlds import run
from support.price_rows import ABOUT, price_row

from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.documents import accuracy_text
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import advice_of, front_of


@pytest.mark.parametrize(
    ("rows", "cut", "front"),
    [
        ([], (), 0),
        ([price_row("a", 0.5, 2)], ("b",), 1),
        ([price_row("a", 0.5, 2), price_row("b", 5.0, 0), price_row("c", 9.0, 8)], ("d", "e"), 2),
        ([price_row("a", 0.5, 2, contact_frames_undecided=1)], (), 0),
    ],
    ids=["none", "one", "several", "undecided"],
)
def test_the_report_of_a_tradeoff_answers_in_every_state(rows, cut, front):
    labels = tuple(front_of(rows))
    done = Tradeoff(tuple(rows), labels, tuple(advice_of(rows)), cut, ABOUT)
    text = unescape(report_html(replace(run("several"), tradeoff=done)))
    assert f"<h1>{done.answer}</h1>" in text and len(labels) == front
    dots = dict(findall(r'<text class="lb"[^>]*>([^<]*): ([\d.]+)<', text.partition("What accuracy costs</h2>")[2]))
    assert dots.items() >= {row["label"]: f"{row['wrong']:g}" for row in rows}.items()
    assert (f"{len(cut)} setting{'s' * (len(cut) > 1)} not tried, for want of time" in text) == bool(cut)
    told = accuracy_text(replace(run("several"), tradeoff=done)).replace("\u00a0", " ")
    assert (f"Not tried, for want of time: {', '.join(cut)}." in told) == bool(cut) and done.answer in told
    assert ("No advice: " in told) == (len(rows) < 3) and ("No advice: " in text) == (len(rows) < 3)
