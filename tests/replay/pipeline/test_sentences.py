"""Every sentence of headline, advice and gate, against counts worked out by hand, in every state."""

from types import SimpleNamespace

import pytest
from support.price_rows import price_row as row
from support.small_worlds import verdict_column

from replay.comparison.compare import compare
from replay.comparison.episodes import episodes
from replay.comparison.misses import stretches
from replay.outputs.report.tables import trust
from replay.pipeline import headline
from replay.pipeline.gates import Gates
from replay.pipeline.scores import score
from replay.tradeoffs import pareto
from replay.tradeoffs.pareto import advice_of, answer_of
from sessions import Finding, Severity

LIMITS = Gates(max_missed=0.0, max_p99_ms=1.0, max_invented=0.0)

STATES = {
    # state: (oracle, subject, every sentence)
    "none": ("......", "......", [
        "No contact found by exact, so none for it to miss",
        "--max-missed cannot be checked: there is no contact for it to miss",
    ]),
    "one": (".C....", "......", [
        "it missed 1 of 1 contact",
        "it missed 1 of 1 contacts (100 % [21, 100]), more than --max-missed 0",
        "it missed 1 of 1 pair-frames in contact (100 % [21, 100]), more than --max-missed 0",
    ]),
    "one found": (".C....", ".C....", ["it found the one contact"]),
    "several": ("C.C.CC", "..C.C.", [
        "it missed 1 of 3 contacts and part of 1 more",
        "it missed 1 of 3 contacts (33 % [6.1, 79]), more than --max-missed 0",
        "it missed 2 of 4 pair-frames in contact (50 % [5.5, 94.5]), more than --max-missed 0",
    ]),
    "in part": ("CCCC..", "C.C...", [
        "it missed part of 1 of 1 contact",
        "it missed 2 of 4 pair-frames in contact (50 % [5.5, 94.5]), more than --max-missed 0",
    ]),
    "undecided": (".C.CC.", ".u.uu.", [
        "it left 2 of 2 contacts undecided",
        "3 of 6 pair-frames with a pose are undecided by exact or it: nothing is known of them.",
        "--max-missed cannot be checked: it left 3 pair-frames in contact undecided, 2 of 2 contacts whole",
    ]),
    "undecided in part": (".C.CC.", ".C.uC.", [
        "it left part of 1 of 2 contacts undecided; missed none where it decided",
        "1 of 6 pair-frames with a pose are undecided by exact or it: nothing is known of them.",
        "--max-missed cannot be checked: it left 1 pair-frames in contact undecided, 0 of 2 contacts whole",
    ]),
    "not measured": ("uuuuuu", "......", [
        "Nothing compared: exact and it both decided none of 6 pair-frames",
        "6 of 6 pair-frames with a pose are undecided by exact or it: nothing is known of them.",
        "--max-missed cannot be checked: there is no contact for it to miss",
        "--max-missed cannot be checked: the oracle left 6 pair-frames undecided",
        "--max-invented cannot be checked: it was compared in no pair-frame",
        "--max-invented cannot be checked: the oracle left 6 pair-frames undecided",
    ]),
    "no pose": ("------", "------", [
        "Nothing compared: exact and it both decided none of 6 pair-frames",
        "--max-missed cannot be checked: there is no contact for it to miss",
        "--max-invented cannot be checked: it was compared in no pair-frame",
    ]),
    "more invented than found": ("C.....", "C.CC.C", [
        "it: 75 % of the contact time it reports is false; finds the one contact",
        "it invented 3 of the 4 pair-frames in contact that it reports (75 % [12, 98.5]), more than --max-invented 0",
    ]),
}  # fmt: skip
UNTIMED = "--max-p99-ms cannot be checked: it was not timed frame by frame in s.mcap"


def audited(oracle, subject):
    """A run of one pair, a letter a frame, with its summary as far as sentences read it."""
    detections = {"exact": verdict_column(oracle), "it": verdict_column(subject)}
    comparison = compare(detections["it"], detections["exact"], ("it", "exact"))
    found = {label: episodes(one) for label, one in detections.items()}
    run = SimpleNamespace(
        noise=None,
        oracle="exact", detections=detections, comparisons={"it": comparison}, episodes=found, face_recall={},
        misses={"it": stretches(comparison, found["exact"])}, causes={}, matches={}, treatment=None, holdings=(),
        phases={}, false={},
    )  # fmt: skip
    took = {"name": "x", "live": True, "faces_asked": False, "seconds": {"per_frame_mean": 1e-3}, "contacts": 0}
    run.summary = {
        "audit": {"it": score(run, "it")}, "session": {"name": "s.mcap", "frames": 6}, "oracle": "exact",
        "detectors": {"exact": {**took, "live": False, "faces_asked": True}, "it": took},
    }  # fmt: skip
    return run


def said(run):
    """Headline, what stands beside it, and what the gates say; without the price."""
    lines = [*headline.headlines(run), *headline.undecided(run), *headline.invented(run)]
    return lines + LIMITS.broken(run.summary["audit"], [run.summary])


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_holds_in_every_state(state):
    oracle, subject, sentences = STATES[state]
    run = audited(oracle, subject)
    assert said(run) == [*sentences, UNTIMED]
    (price,) = headline.price(run)
    assert price == (
        "Being right costs 1 ms (9 % of a 90 Hz frame) with exact (offline, with faces); it took 1 ms "
        "(live). `replay tradeoff` compares alike."
    )


AUDIT = "To audit a recording, take "
MINUTE = "it takes 5.4 s for a minute of it"
PART = "of 18 contacts, whole or in part"
ADVICE = {
    "none": ([], []),
    "one": ([row("a", 1.0, 2)], [f"{AUDIT}a: it misses 2 {PART}; {MINUTE}."]),
    "several": ([row("a", 1.0, 2), row("b", 5.0, 0, precision=0.9)], [
        f"{AUDIT}b: it misses none of 18 contacts, and 10 % of what it reports is false; it takes 27 s for a minute of "
        "it.", f"For less time, take a: it misses 2 {PART}; {MINUTE}."]),
    "a tie": ([row("a", 1.0, 0), row("b", 1.1, 0), row("c", 1.05, 0)], [
        f"{AUDIT}a: it misses none of 18 contacts; {MINUTE}; a tie with b and c."]),
    "trusted": ([row("a", 1.0, 0, oracle=True)], [f"{AUDIT}a: it is what the others are compared with; {MINUTE}."]),
    "a mean over phases": ([row("a", 1.0, 2.25, phases=36)], [f"{AUDIT}a: it misses 2.2 {PART}; {MINUTE}."]),
    "undecided": ([row("a", 0.5, 0, contact_frames_undecided=3)], []),
    "not measured": ([row("a", 0.5, 0, precision=None)], []),
    "more invented than found": ([row("a", 0.5, 0, precision=0.4)], []),
}  # fmt: skip


@pytest.mark.parametrize("state", ADVICE)
def test_advice_is_given_only_of_what_was_decided_and_is_mostly_true(state):
    rows, sentences = ADVICE[state]
    assert advice_of(rows) == sentences


LIVE = [
    row("a", 1.0, 2, live=0.6), row("b", 5.0, 0, live=12.0), row("c", 5.0, 0, precision=0.1, live=0.1),
    row("d", 5.0, 4, live=0.3, phases=36),
]  # fmt: skip


def test_advice_for_a_live_loop_speaks_of_the_99th_percentile():
    first, second = (one for one in advice_of(LIVE) if "live loop" in one)
    assert first.startswith(
        "In a live loop at 60 and 72 Hz, take b: it misses none of 18 contacts; it takes 12 ms in the mean; its p99 is"
    )
    assert second.startswith("In a live loop at 90 and 120 Hz, take a: ") and second.endswith("5.4 % of a 90 Hz frame.")
    (none,) = (one for one in advice_of([row("c", 5.0, 0, precision=0.1, live=0.1)]) if "live loop" in one)
    assert none == f"In a live loop at 60, 72, 90 and 120 Hz, {pareto.NONE}."
    assert answer_of(LIVE).endswith("sampling less often saves 0.3 ms a frame at most")
    assert answer_of([*LIVE[:2], row("d", 5.0, 4, live=0.7, phases=36)]).endswith("saves is too small to compare here")
    assert answer_of([row("a", 1.0, 0, live=0.6)]).endswith(
        "costs 0.6 ms a frame in the mean, p99 5.4 % of a 90 Hz frame"
    )


@pytest.mark.parametrize(
    ("severities", "words"),
    [
        ((), "Nothing suspicious found."),
        ((Severity.NOTE,), "Nothing suspicious found."),
        ((Severity.WARNING,), "1 warning: verdicts"),
        ((Severity.ERROR, Severity.WARNING, Severity.WARNING), "1 error and 2 warnings: verdicts"),
    ],
)  # fmt: skip
def test_the_report_says_how_much_is_suspicious(severities, words):
    told = trust(tuple(Finding("frozen", one, "it stood still") for one in severities))
    assert told == words + (" on these spans carry a flag." if severities[:1] > (Severity.NOTE,) else "")


def doubted(*findings):
    return headline.doubts(SimpleNamespace(treatment=SimpleNamespace(findings=findings)))


def test_doubts_are_of_errors_and_of_units_axes_and_handedness_a_line_a_kind():
    units = [Finding("unit-suspect", Severity.WARNING, "3000 m away", name) for name in "abc"]
    noted = Finding("frozen", Severity.WARNING, "it stood still", "a")
    assert doubted(noted) == [] == headline.doubts(SimpleNamespace(treatment=None))
    first, second = doubted(Finding("handedness", Severity.ERROR, "left is right"), noted, *units)
    assert first == (
        "Error, handedness: left and right seem to be swapped (left is right). "
        "To do: import with the source's handedness."
    )
    assert "(a: 3000 m away; 2 more like it)" in second
