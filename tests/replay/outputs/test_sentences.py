"""Every sentence of report and picture against planted worlds: a letter a frame, counted here, in every state."""

from dataclasses import replace
from functools import cache
from html import escape, unescape
from itertools import groupby
from re import findall
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
import rerun.blueprint as rrb
from support.page_cells import Cells
from support.sentences import unsaid
from support.small_worlds import cubes, jumping

from replay.comparison.outcome import Episode, Outcome
from replay.outputs import moments, run_tables, tradeoff_table, words
from replay.outputs.report import audit_parts, charts, page, tables, tradeoff
from replay.outputs.report.markup import Markup
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log import findings
from replay.outputs.rerun_log import report as notes
from replay.outputs.rerun_log import tradeoff as curve
from replay.outputs.rerun_log.focus import focus
from replay.pipeline.engine import compute
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import advice_of
from sessions import Finding, Severity
from sessions.model.scene import Scene, SceneBody, SceneEffect

STATES = {
    # state: (oracle, subject, headline)
    "none": ("......", "nnnnnn", "No contact found by exact, so none for it to miss"),
    "one": (".CC...", "nnnnnn", "1 of 1 contact missed by it"),
    "several": ("C.C.CC", "nncncn", "1 of 3 contacts missed by it, 1 more in part"),
    "undecided": (".C.CC.", "nunuun", "2 of 2 contacts undecided by it"),
    "not measured": ("......", "uuuuuu", "Nothing compared: exact and it both decided none of 6 pair-frames"),
    "more invented than found": ("C.....", "cnccnc", "None of 1 contact missed by it"),
    "false at both ends": ("..CC..C.", "nccccccn", "None of 2 contacts missed by it"),
    "more than a list holds": ("C." * 41, "n" * 82, "41 of 41 contacts missed by it"),
}


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


@cache
def run(state):
    truth, said, _ = STATES[state]
    places = [0.99 if letter == "C" else 1.01 + 0.02 * (k % 2) for k, letter in enumerate(truth)]
    session = cubes({"a": [0.0] * len(truth), "b": places})
    return compute(session, detectors=f"it=support.planted_detectors:Scripted[says={said}]")


class Kept:
    """A writer of recordings that keeps its documents."""

    def __init__(self):
        self.text = ""

    def markdown(self, _path, text):
        self.text += text + "\n"

    def rows_later(self, _path, _rows, columns):
        for column in columns:
            self.text += "\n".join(str(one) for row in column.as_arrow_array().to_pylist() for one in row)


def picture_words(result):
    """What the tabs of a recording say."""
    kept, found = Kept(), result.misses["it"]
    notes.log_worst(kept, "", "it", found)
    if found:
        notes.log_notes(kept, "", focus(found), result, "it")
    false = moments.false_of(result)
    focused = [f"{one.words} {one.said}" for one in moments.key_moments(result, false)]
    texts = [notes.report_text(result), kept.text, findings.finding_list(result), notes.ranking_text(result, false)]
    return "\n".join([*texts, *focused])


def stretches(letters):
    """First frame, number of frames, and value of each stretch of equal letters."""
    first = 0
    for value, same in groupby(letters):
        count = len(list(same))
        yield first, count, value
        first += count


def became(truth, said):
    """A word for each frame."""
    pairs = {("C", "c"): "both", ("C", "n"): "MISSED", (".", "c"): "invented"}
    return ["left out" if mine == "u" else pairs.get((own, mine), "") for own, mine in zip(truth, said, strict=True)]


def missed(truth, said):
    """Contact from 1, first frame and number of frames of each miss."""
    contacts = [(first, count) for first, count, value in stretches(truth) if value == "C"]
    outcome = became(truth, said)
    return len(contacts), [
        (number, begin + first, count)
        for number, (begin, length) in enumerate(contacts, 1)
        for first, count, word in stretches(outcome[begin : begin + length])
        if word == "MISSED"
    ]


def expected_in_page(state):
    truth, said, headline = STATES[state]
    outcome, frames = became(truth, said), len(truth)
    contacts, lost = missed(truth, said)
    yield f"{headline}, compared with exact"
    pairs = "1 pair" if {"both", "MISSED", "invented"} & set(outcome) else "0 pairs"
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
    if outcome.count("invented"):
        share = 100 * outcome.count("invented") / (outcome.count("invented") + outcome.count("both"))
        yield f"it invents {share:g} % of the contact that it reports"


def expected_in_picture(state):
    truth, said, headline = STATES[state]
    outcome, (contacts, lost) = became(truth, said), missed(truth, said)
    yield f"**{headline}.**"
    yield f"{0.01 * (len(truth) - 1):.1f} s, {len(truth)} frames, 2 bodies, 1 pair."
    counts = [outcome.count(word) for word in ("both", "MISSED", "invented", "within tolerance", "left out")]
    yield f"| it | {' | '.join(map(str, counts))} |"
    many = f"{len(lost)} cuts" if len(lost) > 1 else "1 cut"
    yield f"### The {min(len(lost), 40)} longest of {many}" if lost else "### Nothing missed"
    for number, (contact, first, count) in enumerate(lost, 1):
        yield f"#### Miss {number} of {len(lost)}: a-b"
        frames = f"{count} frame" + "s" * (count > 1)
        yield f"{frames} ({first} to {first + count - 1}), contact {contact} of {contacts}"
    yield from expected_of_false(outcome)


def expected_of_false(outcome):
    """False contacts; the cubes are 10 mm apart in even frames without contact, 30 mm in odd ones."""
    false = [(first, count) for first, count, word in stretches(outcome) if word == "invented"]
    for number, (first, count) in enumerate(false, 1):
        gap = 30 if count > 1 or first % 2 else 10
        yield f"#### False contact {number} of {len(false)}: a-b\n\n- it: **CONTACT** (unexplained)\n- exact: none, the"
        yield f"the meshes are **{gap}.0 mm** apart\n\n**{0.01 * first:.3f} s**, {count} frame{'s' * (count > 1)} "
        after, before = (outcome[k : k + 1] == ["both"] for k in (first + count, first - 1 if first else len(outcome)))
        where = ("nothing there", "begins early", "lasts long", "joins two")[2 * before + after]
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
        word.lower(): str(outcome.count(word))
        for word in ("both", "MISSED", "invented", "within tolerance", "left out")
    }
    matched = dict(cells["Contacts matched one to one"])
    reported = sum(value == "c" for _, _, value in stretches(said))
    assert (matched["contacts by the oracle"], matched["contacts reported"]) == (str(contacts), str(reported))
    of = outcome.count("MISSED") + outcome.count("both")
    heat = [["a-b", f"{outcome.count('MISSED')} of {of}"]] if of else []
    assert cells["Pair-frames missed of those in contact, by pair"] == heat
    assert dict(cells["Causes: misses (pair-frames decided again)"])["decided again, of pair-frames missed"].endswith(
        f" of {outcome.count('MISSED')}"
    )


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_of_the_picture_holds_in_every_state(state):
    text = picture_words(run(state))
    assert [one for one in expected_in_picture(state) if one not in text] == []
    assert len(set(findall("#### Miss [0-9]+", text))) == len(missed(*STATES[state][:2])[1])
    said = list(expected_of_false(became(*STATES[state][:2])))
    assert 3 * text.count("#### False contact") == len(said)
    assert ("| nothing |" in text) == (not said and not missed(*STATES[state][:2])[1])


def timed(result, *p99):
    """As if oracle and detector had been timed so, frame by frame."""
    made = dict(result.summary["detectors"])
    for label, seconds in zip(("exact", "it"), p99, strict=True):
        frame = {"per_frame": {"p99": seconds}} if seconds else {}
        made[label] = {**made[label], "seconds": {"per_frame_mean": 1e-4, **frame}}
    return replace(result, summary=result.summary | {"detectors": made})


@pytest.mark.parametrize(("p99", "words"), [
    ((1e-3, 2e-3), "**Being right costs** 1 ms (9 % of a 90 Hz frame), p99 of exact; it takes 2 ms."),
    ((1e-3, None), "One pass of each"), ((None, 2e-3), "One pass of each"),
])  # fmt: skip
def test_what_it_costs_to_be_right_compares_only_what_was_timed_frame_by_frame(p99, words):
    (line,) = notes.cost_to_be_right(timed(run("several"), *p99))
    assert words in line


def test_a_pair_without_a_fault_of_its_own_says_what_each_detector_made_of_it():
    result = run("false at both ends")
    (one,) = moments.key_moments(all_held(result), {"it": ()})
    assert one.said.splitlines()[0] == "#### a-b, in the whole session"
    assert one.said.endswith("- it: 0 frames missed, 0 invented, 6 held and counted apart")
    outcome = np.full_like(result.comparisons["it"].outcome, Outcome.BOTH)
    calm = replace(result, comparisons={"it": replace(result.comparisons["it"], outcome=outcome)})
    (one,) = moments.key_moments(calm, {"it": ()})
    assert one.said.endswith("- it: 0 frames missed, 0 invented")


def all_held(result):
    """As if the one pair were a hand and what it holds."""
    outcome = result.comparisons["it"].outcome
    held = np.where(outcome == Outcome.NEITHER, outcome, np.uint8(Outcome.HELD))
    return replace(result, comparisons={"it": replace(result.comparisons["it"], outcome=held)})


SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("contact", {"between": ["a", "b"]}), SceneEffect("penetration")),
)


NEAR = SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 0.2})


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


ABOUT = {
    "session": "s", "contacts": 3, "frames": 6, "oracle": "exact", "processor_share": 0.5,
    "machine": {"system": "Linux", "processor": "x", "cores": 2},
}  # fmt: skip


def tried(label, ms, missed, **more):
    return {
        "label": label, "detector": label, "line": label, "ms_per_frame": ms, "ms_high": ms, "p99_ms": None,
        "missed": missed, "missed_low": 0.0, "missed_high": 1.0, "recall": 1 - missed, "recall_low": 0.0,
        "recall_high": 1.0, "precision": 1.0, "precision_low": 0.5,
        "precision_high": 1.0, "face_recall": None, "seconds_per_minute": 1.0, "work": {"looks": 3}, "online": False,
        "oracle": False, "front": False, "front_online": False, **more,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "cut", "front"),
    [
        ([], (), 0),
        ([tried("a", 0.5, 0.1)], ("b",), 1),
        ([tried("a", 0.5, 0.1), tried("b", 5.0, 0.0), tried("c", 9.0, 0.5)], ("d", "e"), 2),
        ([tried("a", 0.5, 0.1, contact_frames_undecided=1)], (), 0),
        ([tried("a", 0.5, 0.1, precision=None)], (), 0),
        ([tried("a", 0.5, 0.1, precision=0.4)], (), 0),
    ],
    ids=["none", "one", "several", "undecided", "not measured", "more invented than found"],
)
def test_the_report_of_a_tradeoff_counts_settings_and_front_in_every_state(rows, cut, front):
    labels = tuple(tradeoff_table.front_of(rows))
    done = Tradeoff(tuple(rows), labels, (), tuple(advice_of(rows)), cut, ABOUT)
    text = unescape(report_html(replace(run("several"), tradeoff=done)))
    assert f"<h1>What accuracy costs: {len(rows)} settings tried, {front} on the front</h1>" in text
    assert (f"{len(cut)} setting{'s' * (len(cut) > 1)} not tried, for want of time" in text) == bool(cut)
    told = curve.advice_text(done)
    assert (f"Not tried, for want of time: {', '.join(cut)}." in told) == bool(cut)
    assert told.count("To audit a recording, ") == front == text.count("<li>To audit a recording, ")


def everything(monkeypatch):
    """Texts of all worlds, and of one in which every limit of a list is passed and every part of a page is filled."""
    yield from (report_html(run("more than a list holds")), report_html(run("undecided")))
    for module, name, most in (
        (tables, "MOST_ROWS", 1), (tables, "EVENT_ROWS", 1), (audit_parts, "MOST_PAIRS", 0), (charts, "MOST_BARS", 0),
        (run_tables, "MOST_REASONS", 0),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, most)
    yield from (report_html(flickering()), report_html(run("more than a list holds")))
    between = compute(jumping(), detectors="it=exact", oracle="continuous")
    yield report_html(compute(jumping(), detectors="continuous"))
    yield from (report_html(between), picture_words(between))
    yield from (picture_words(run("undecided")), picture_words(run("several")))
    monkeypatch.setattr(charts, "MOST_LANES", 0)
    several = run("several")
    span = SimpleNamespace(kind="lost", body="a", action="drop", samples=1, dropped=1, held=0, interpolated=0)
    bad = SimpleNamespace(findings=(Finding("frozen", Severity.WARNING, "it stood"),), spans=(span,))
    left = replace(several.assembly, proxies=("a",), left_out=("c",), notes=("made up",))
    session = several.summary["session"] | {"dropped_frames": {"lost": 2}}
    flagged = {"it": {"CONTACT": 2}}
    filled = several.summary | {"session": session, "flagged_verdicts": flagged}
    rows = (tried("a", 0.5, 0.1), tried("b", 5.0, 0.0))
    done = Tradeoff(rows, ("a", "b"), (), tuple(advice_of(rows)), ("c",), ABOUT)
    in_hand = (Episode(0, 0, 1, 0.0, 0.01),)
    full = replace(several, holdings=in_hand, treatment=bad, assembly=left, summary=filled, tradeoff=done)
    yield from (report_html(full), notes.report_text(full), findings.finding_list(full), curve.advice_text(done))
    writer = MagicMock()
    curve.log_tradeoff(writer, done)
    views = (*findings.finding_tab(("lane",), rrb.TimeAxis()).contents, *curve.curve_tab().contents)
    yield from (view.name for view in views)
    sent = [call.args[1].labels for call in writer.static.call_args_list]
    yield from (str(one.as_arrow_array().to_pylist()) for one in sent if one is not None)
    apart = {"it": several.summary["audit"]["it"] | {"held": {"invented": 2, "contacts_missed": 1}}}
    ranked = timed(replace(several, summary=several.summary | {"audit": apart}), 1e-3, 2e-3)
    yield from (notes.ranking_text(ranked, moments.false_of(ranked)), *moments.TO_DO.values())
    yield str(run_tables.ranking_table(ranked.summary))
    ends = run("false at both ends")
    for one in (ends, all_held(ends)):
        yield from (f"{at.words} {at.said}" for at in moments.key_moments(one, moments.false_of(one)))
    yield report_html(replace(several, treatment=None))
    pair = Scene(bodies=(SceneBody("a", group="g", tags=("hand",)), SceneBody("b", group="g"), SceneBody("c")))
    places = {"a": [0.0] * 6, "b": [0.9, 3.0, 0.9, 0.9, 3.0, 0.9], "c": [3.0, -0.9, 3.0, -0.9, 3.0, 3.0]}
    rated = compute(
        cubes(places, scene=pair), detectors="it=discrete[rate_hz=50],more=sphere", pairs=[("a", "b"), ("a", "c")]
    )
    yield from (report_html(rated), notes.report_text(rated))
    calm = compute(cubes({"a": [0.0] * 2, "b": [3.0, 3.1]}, scene=replace(SCENE, effects=(NEAR,))), detectors=())
    yield from (report_html(calm), notes.report_text(calm))
    yield report_html(compute(several.session, detectors="exact,sphere", oracle="none"))
    yield from ("\n".join(map(str, run_tables.pair_table(several, "it").notes)), words.NOTHING_SUSPICIOUS)


def test_no_template_of_report_and_picture_is_untested(monkeypatch):
    text = "\n".join(map(unescape, everything(monkeypatch)))
    pages = (page, tables, audit_parts, charts, tradeoff)
    assert unsaid(text, *pages, notes, findings, run_tables, tradeoff_table, words, curve, moments) == []
