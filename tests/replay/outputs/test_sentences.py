"""Every sentence of report and picture against planted worlds: a letter a frame, counted here, in every state."""

from dataclasses import replace
from functools import cache
from html import escape, unescape
from re import findall
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from matplotlib.text import Text
from support.lettered_worlds import STATES, became, missed, run, stretches
from support.page_cells import Cells
from support.price_rows import ABOUT, price_row
from support.sentences import picture_text
from support.small_worlds import cubes

from replay.comparison.outcome import Outcome
from replay.outputs import moments, tradeoff_table
from replay.outputs.report import charts, page, tables, tradeoff, tradeoff_picture
from replay.outputs.report.drawing import LIGHT
from replay.outputs.report.markup import Markup
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log import tradeoff as curve
from replay.outputs.rerun_log.search_picture import path_words
from replay.pipeline.engine import compute
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import advice_of, answer_of
from sessions.model.scene import Scene, SceneBody, SceneEffect


@pytest.fixture(scope="module", autouse=True)
def without_drawings():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "bench_picture", lambda *_: b"")
        patch.setattr(tradeoff, "picture", lambda *_: b"")
        patch.setattr(charts, "svg_in_page", lambda *what: Markup(escape(f"{what[2]} {labels(what[-1])}")))
        yield


def labels(draw):
    """What a chart says, without drawing it."""
    axes = MagicMock()
    draw(axes)
    return axes.mock_calls


def expected_in_page(state):
    truth, said, headline = STATES[state]
    outcome, frames = became(truth, said), len(truth)
    contacts, lost = missed(truth, said)
    yield f"{headline}, compared with exact"
    pairs = "1 pair" if {"both", "MISSED", "false"} & set(outcome) else "0 pairs"
    yield f"{pairs} over {0.01 * (frames - 1):.0f} seconds, as it compares with exact."
    yield f"{0.01 * (frames - 1):.1f} s, {frames} frames"
    yield from (f"{word}: {0.01 * first:.3f} s, {count} frames" for first, count, word in stretches(outcome)
                if word not in ("", "left out"))  # fmt: skip
    if contacts:
        yield f"Contacts of {contacts} that looks at fixed steps miss"
    if len(lost) > 40:
        yield f"{len(lost)} misses of it in "
        yield f"All {len(lost)}, each with the command that shows it"
    if outcome.count("left out"):
        yield f"{outcome.count('left out')} of {frames} pair-frames with a pose are undecided by exact or it"
    if outcome.count("false"):
        share = 100 * outcome.count("false") / (outcome.count("false") + outcome.count("both"))
        yield f"{share:g} % of the contact time it reports is false"


def expected_in_picture(state):
    truth, said, headline = STATES[state]
    outcome, (contacts, lost) = became(truth, said), missed(truth, said)
    yield f"**{headline}.**"
    yield f"{0.01 * (len(truth) - 1):.1f} s, {len(truth)} frames, 2 bodies, 1 pair."
    counts = [outcome.count(word) for word in ("both", "MISSED", "false", "within tolerance", "left out")]
    yield f"| it | {' | '.join(map(str, counts))} |"
    for number, (contact, first, count) in enumerate(lost, 1):
        yield f"#### Miss {number} of {len(lost)}: a-b"
        frames = f"{count} frame" + "s" * (count > 1)
        yield f"{frames} ({first} to {first + count - 1}), contact {contact} of {contacts}"
    yield from expected_of_false(outcome)


def expected_of_false(outcome):
    """False contacts; the cubes are 10 mm apart in even frames without contact, 30 mm in odd ones."""
    false = [(first, count) for first, count, word in stretches(outcome) if word == "false"]
    for number, (first, count) in enumerate(false, 1):
        gap = 30 if count > 1 or first % 2 else 10
        yield f"#### False contact {number} of {len(false)}: a-b\n\n- it: **CONTACT** (unexplained)\n- exact: none, the"
        yield f"the meshes are **{gap}.0 mm** apart\n\n**{0.01 * first:.3f} s**, {count} frame{'s' * (count > 1)} "
        after, before = (outcome[k : k + 1] == ["both"] for k in (first + count, first - 1 if first else len(outcome)))
        where = ("nothing there", "starts early", "ends late", "joins two contacts")[2 * before + after]
        yield f"({first} to {first + count - 1}), {where}"


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_the_report_holds_in_every_state(state):
    made = report_html(run(state))
    text = unescape(made)
    assert [one for one in expected_in_page(state) if one not in text] == []
    truth, said, _ = STATES[state]
    outcome, (contacts, lost) = became(truth, said), missed(truth, said)
    assert ("Every miss of it" in text) == bool(lost)
    cells = Cells(made).tables
    assert dict(cells["Pair-frames"][:5]) == {
        word.lower(): str(outcome.count(word)) for word in ("both", "MISSED", "false", "within tolerance", "left out")
    }
    matched = dict(cells["Contacts matched one to one"])
    reported = sum(value == "c" for _, _, value in stretches(said))
    assert (matched["contacts by the oracle"], matched["contacts reported"]) == (str(contacts), str(reported))
    assert dict(cells["Causes: misses (pair-frames decided again)"])["decided again, of pair-frames missed"].endswith(
        f" of {outcome.count('MISSED')}"
    )


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_the_picture_holds_in_every_state(state, tmp_path):
    text, lost = picture_text(run(state), tmp_path / "run.rrd"), missed(*STATES[state][:2])[1]
    assert [one for one in expected_in_picture(state) if one not in text] == []
    assert len(set(findall("#### Miss [0-9]+", text))) == len(lost)
    assert ("nothing missed by it" in text) == (not lost) == ("The miss in the close-up" not in text)
    said = list(expected_of_false(became(*STATES[state][:2])))
    assert 3 * len(set(findall("#### False contact [0-9]+", text))) == len(said)
    undecided = state in ("undecided", "not measured")
    assert ("**To do:** no action needed." in text) == (
        not said and not lost and "C" in STATES[state][0] and not undecided
    )
    assert ("**To do:** see what it left undecided." in text) == (state == "undecided")


def timed(result, *p99):
    """As if oracle and detector had been timed so, frame by frame."""
    made = dict(result.summary["detectors"])
    for label, seconds in zip(("exact", "it"), p99, strict=True):
        made[label] = {**made[label], "seconds": {"per_frame_mean": 1e-4, "per_frame": {"p99": seconds}}}
    return replace(result, summary=result.summary | {"detectors": made})


def test_a_pair_without_a_fault_of_its_own_says_what_each_detector_made_of_it():
    result = run("false at both ends")
    (one,) = moments.key_moments(all_held(result))
    assert one.said.splitlines()[0] == "#### a-b, in the whole session"
    assert one.said.endswith("- it: 0 frames missed, 0 false, 6 held and counted apart")
    outcome = np.full_like(result.comparisons["it"].outcome, Outcome.BOTH)
    calm = replace(result, comparisons={"it": replace(result.comparisons["it"], outcome=outcome)})
    (one,) = moments.key_moments(replace(calm, false={"it": ()}))
    assert one.said.endswith("- it: 0 frames missed, 0 false")


def all_held(result):
    """As if the one pair were a hand and what it holds."""
    outcome = result.comparisons["it"].outcome
    held = np.where(outcome == Outcome.NEITHER, outcome, np.uint8(Outcome.HELD))
    return replace(result, comparisons={"it": replace(result.comparisons["it"], outcome=held)}, false={"it": ()})


SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("contact", {"between": ["a", "b"]}), SceneEffect("penetration")),
)


@cache
def flickering():
    """Three contacts of a scene's effects, which nobody audits."""
    return compute(cubes({"a": [0.0] * 12, "b": [0.99, 0.99, 3.0, 3.0] * 3}, scene=SCENE), detectors=())


def test_a_page_without_an_audit_counts_what_each_detector_found():
    truth = STATES["several"][0]
    session = run("several").session
    text = unescape(report_html(compute(session, detectors="exact,sphere", oracle="none")))
    contacts = sum(value == "C" for _, _, value in stretches(truth))
    assert f"<h1>{contacts} contacts found by exact, 1 contact found by sphere</h1>" in text


def test_a_page_of_effects_counts_what_happened_and_says_how_much_it_leaves_out(monkeypatch):
    monkeypatch.setattr(tables, "EVENT_ROWS", 2)
    text = unescape(report_html(flickering()))
    assert "What the effects found, the first 2 of 3" in text
    assert "Declared, and not computed by this version: penetration." in text
    assert "Not called for, so not imported and not run: " in text


def words_of_picture(done):
    """The words of the drawn picture."""
    drawn = tradeoff_picture._drawn(done, LIGHT)
    return [one.get_text() for one in drawn.findobj(Text)]


@pytest.mark.parametrize(
    ("rows", "cut", "front"),
    [
        ([], (), 0),
        ([price_row("a", 0.5, 2)], ("b",), 1),
        ([price_row("a", 0.5, 2), price_row("b", 5.0, 0, live=5.0), price_row("c", 9.0, 8)], ("d", "e"), 2),
        ([price_row("a", 0.5, 2, contact_frames_undecided=1)], (), 0),
        ([price_row("a", 0.5, 2, precision=None)], (), 0),
        ([price_row("a", 0.5, 2, precision=0.4)], (), 0),
    ],
    ids=["none", "one", "several", "undecided", "not measured", "more invented than found"],
)
def test_the_report_of_a_tradeoff_answers_in_every_state(rows, cut, front):
    labels = tuple(tradeoff_table.front_of(rows))
    done = Tradeoff(tuple(rows), labels, (), tuple(advice_of(rows)), cut, ABOUT, answer_of(rows))
    text = unescape(report_html(replace(run("several"), tradeoff=done)))
    assert f"<h1>{done.answer}</h1>" in text and len(labels) == front
    drawn = words_of_picture(done)
    assert done.answer in drawn and set(labels) <= {one.partition(":")[0] for one in drawn}
    assert (f"{len(cut)} setting{'s' * (len(cut) > 1)} not tried, for want of time" in text) == bool(cut)
    told = curve.advice_text(done)
    assert (f"Not tried, for want of time: {', '.join(cut)}." in told) == bool(cut)
    assert told.count("To audit a recording, ") == bool(front) == text.count("<li>To audit a recording, ")
    assert text.count("<li>For less time, ") == max(0, front - 1)


def test_the_path_of_a_look_says_how_near_its_first_pair_and_its_best_ant_came():
    trace = SimpleNamespace(
        best=lambda: np.arange(3), distance=np.array([0.2, 0.1, 0.05]), asked_by=np.array(["walk", "ant", "walk"]),
        iteration=np.array([0, 7, 8]),
    )  # fmt: skip
    steps = [(0, "first pair: 200 mm apart"), (1, "best ant, iteration 7: 100 mm; local search takes over"), (2, "end")]
    assert path_words(trace, "end") == steps
