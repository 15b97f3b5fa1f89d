from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import jumping

from replay.base.wilson import share
from replay.comparison.look_phases import OffsetCounts
from replay.comparison.outcome import Comparison, Episode, Outcome
from replay.pipeline.engine import compute
from replay.pipeline.headline import beside, compounds, headline, headlines, held, invented, price


def told(*contacts):
    """A run whose oracle has contacts of one frame a letter: b(oth), m(issed), u(ndecided), w(ithin tolerance)."""
    letters = {"b": Outcome.BOTH, "m": Outcome.MISSED, "u": Outcome.LEFT_OUT, "w": Outcome.WITHIN_TOLERANCE}
    outcome, found = [[Outcome.NEITHER]], []
    for contact in contacts:
        found.append(Episode(0, len(outcome), len(outcome) + len(contact) - 1, 0.0, 0.0))
        outcome += [*([letters[letter]] for letter in contact), [Outcome.NEITHER]]
    comparison = Comparison("slow", "exact", np.array(outcome, dtype=np.uint8))
    return SimpleNamespace(
        oracle="exact", episodes={"exact": tuple(found)}, comparisons={"slow": comparison}, noise=None, phases={}
    )


@pytest.mark.parametrize(
    ("contacts", "words"),
    [
        (["m"] * 9 + ["b"] * 9, "slow missed 9 of 18 contacts"),
        (["mm", "mb", *["b"] * 7], "slow missed 1 of 9 contacts and part of 1 more"),
        (["mbmbm", *["b"] * 4], "slow missed part of 1 of 5 contacts"),
        (["b", "bb", "w"], "slow missed none of 3 contacts"),
        (["u", "b", "b"], "slow left 1 of 3 contacts undecided; missed none where it decided"),
        (
            ["u", "ub", "m", "bm"],
            "slow left 1 of 4 contacts undecided and part of 1 more; missed 1 of 4 contacts and part of 1 more",
        ),
    ],
)
def test_the_headline_counts_contacts_and_says_first_what_was_not_decided(contacts, words):
    assert headline(told(*contacts), "slow") == words


def took(seconds, *, live=True, name="discrete", faces=False, **more):
    return {"name": name, "live": live, "faces_asked": faces, "seconds": {"per_frame_mean": seconds, **more}}


def counted(false=0, missed=0, of=4):
    """The figures of an audited detector."""
    return {
        "contacts": of, "contacts_missed": missed, "contacts_in_part": 0, "contacts_undecided": 0,
        "invented": share(false, 4),
    }  # fmt: skip


def priced(*, oracle, **detectors):
    """A run of the oracle and others: label -> what it took, and its faults."""
    labels = {"exact": oracle, **{label: one for label, (one, _) in detectors.items()}}
    summary = {
        "detectors": {label: {"contacts": 4, **one} for label, one in labels.items()}, "session": {"frames": 400},
        "audit": {label: fault for label, (_, fault) in detectors.items()}, "oracle": "exact",
    }  # fmt: skip
    return SimpleNamespace(oracle="exact", comparisons=detectors, summary=summary)


RATE = {"settings": {"rate_hz": 22.5}}


@pytest.mark.parametrize(
    ("oracle", "subject", "faults", "words"),
    [
        (
            took(9e-5, live=False, faces=True),
            took(5e-5, at_every_frame=8e-5, per_frame={"looks": 100, "p99": 1e-4}) | RATE, counted(missed=2),
            "The same algorithm at every frame costs 0.08 ms (0.72 % of a 90 Hz frame), every fourth frame 0.05 ms "
            "(like with like, live).",
        ),
        (
            took(9e-5), took(5e-5, at_every_frame=8e-5, per_frame={"looks": 150, "p99": 1e-4}) | RATE,
            counted(missed=2),
            "The same algorithm at every frame costs 0.08 ms (0.72 % of a 90 Hz frame), 22.5 times a second 0.05 ms "
            "(like with like, live).",
        ),
        (
            took(9e-5), took(9e-5, at_every_frame=8e-5, per_frame={"looks": 200, "p99": 1e-4}) | RATE,
            counted(missed=2),
            "The same algorithm at every frame costs 0.08 ms (0.72 % of a 90 Hz frame); what a sample every second "
            "frame saves is too small to compare here (live).",
        ),
        (
            took(9e-5), took(5e-5, at_every_frame=8e-5) | RATE, counted(false=3),
            "Being right costs 0.09 ms (0.81 % of a 90 Hz frame) with exact; it takes 0.05 ms (like with like, live).",
        ),
        (
            took(9e-5, live=False, faces=True), took(5e-5), counted(missed=1),
            "Being right costs 0.09 ms (0.81 % of a 90 Hz frame) with exact (offline, with faces); it "
            "took 0.05 ms (live). `replay tradeoff` compares alike.",
        ),
        (
            took(9e-5), took(0.0, name="recorded"), counted(missed=1),
            "Being right costs 0.09 ms (0.81 % of a 90 Hz frame) with exact (live); what it took is not recorded.",
        ),
    ],
)  # fmt: skip
def test_what_being_right_costs_is_said_like_with_like_or_what_each_time_is_of(oracle, subject, faults, words):
    assert price(priced(oracle=oracle, it=(subject, faults))) == [words]
    assert price(priced(oracle=oracle)) == []


def test_of_several_detectors_the_price_is_said_beside_the_worst():
    run = priced(oracle=took(9e-5), good=(took(1e-5), counted()), bad=(took(3e-5), counted(missed=3)))
    assert price(run)[0].endswith(" with exact; bad takes 0.03 ms (like with like, live).")


def test_the_price_of_every_frame_is_measured_in_the_run_itself_and_live():
    run = compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid")
    often = run.summary["detectors"]["slow"]["seconds"]["at_every_frame"]
    assert run.at_every_frame == {"slow": often} and often > 0 and run.summary["detectors"]["slow"]["live"]
    assert "at_every_frame" not in run.summary["detectors"]["hybrid"]["seconds"]
    offline = compute(jumping(), detectors="slow=discrete[rate_hz=10]", oracle="hybrid", offline=True)
    assert offline.at_every_frame == {} and offline.phases["slow"].shares() == run.phases["slow"].shares()


@pytest.mark.parametrize(("outcomes", "words"), [((1, 1, 2), ""), ((*[1] * 29, 3), "3.3"), ((1, 3), "50")])
def test_who_reports_contact_where_there_is_none_is_told_so_however_little_it_misses(outcomes, words):
    wrong = share(outcomes.count(3), outcomes.count(3) + outcomes.count(1))
    run = priced(oracle=took(1e-4), it=(took(1e-4), counted(missed=3) | {"invented": wrong}))
    assert invented(run) == [f"{words} % of the contact time it reports is false."] * bool(words)
    run = priced(oracle=took(1e-4), it=(took(1e-4), counted() | {"invented": wrong}))
    assert invented(run) == []  # the headline says it


def looked(contacts=18):
    """A detector at 22.5 Hz that misses half of the contacts at this phase, and a quarter in the mean."""
    run = told(*["m", "b"] * (contacts // 2))
    run.summary = priced(oracle=took(1e-4), slow=(took(1e-4) | RATE, counted(false=1, missed=2))).summary
    missed = np.tile(np.arange(16)[:, None] < 4, (1, contacts))
    run.phases = {"slow": OffsetCounts(missed, ~missed, np.zeros(contacts), np.zeros(contacts), share(0, 0))}
    run.detections = {"exact": SimpleNamespace(verdict=np.ones((len(run.comparisons["slow"].outcome), 1), np.uint8))}
    run.detections["slow"], run.holdings, run.detectors = run.detections["exact"], (), {}
    return run


def test_who_looks_at_a_rate_is_said_to_miss_here_and_what_the_mean_over_look_phases_is():
    words = "Looking 22.5 times a second missed 9 of 18 contacts here; 4.5 on average over look phases"
    assert headline(looked(), "slow") == words
    assert headline(looked(contacts=0), "slow") == "No contact found by exact, so none for slow to miss"


def test_what_a_hand_holds_is_counted_apart_and_said():
    run = looked()
    assert held(run) == []
    run.holdings = (Episode(0, 1, 3, 0.0, 0.0),)
    outcome = run.comparisons["slow"].outcome.copy()
    outcome[1:4] = Outcome.HELD
    run.comparisons = {"slow": Comparison("slow", "exact", outcome)}
    run.detections["exact"] = SimpleNamespace(verdict=np.zeros_like(run.detections["exact"].verdict))
    assert held(run) == ["Counted apart, of a hand with what it holds, slow reports 3 false frames."]
    run.episodes = {"exact": run.holdings}
    run.detections["exact"] = run.detections["slow"]
    assert held(run) == ["Counted apart, of a hand with what it holds, slow misses 0 of 1 contact."]


def test_page_picture_and_terminal_say_the_same_beside_the_headline():
    run = looked()
    assert beside(run) == [*invented(run), *held(run)] and len(beside(run)) == 1


def test_of_several_detectors_the_headline_is_that_of_the_worst_with_its_larger_fault_first():
    run, wrong = told("m", "b"), share(3, 4)
    lost = {
        "contacts": 2, "contacts_missed": 1, "contacts_in_part": 0, "contacts_undecided": 0, "invented": share(0, 1),
    }  # fmt: skip
    made = {"name": "x", "contacts": 2, "seconds": {"per_frame_mean": 1e-4}}
    run.summary = {
        "oracle": "exact", "audit": {"slow": lost, "hull": {**lost, "contacts_missed": 0, "invented": wrong}},
        "detectors": dict.fromkeys(("slow", "hull", "exact"), made),
    }  # fmt: skip
    audit = run.summary["audit"]
    assert headlines(SimpleNamespace(**vars(run) | {"summary": run.summary | {"audit": {"slow": audit["slow"]}}})) == [
        "slow missed 1 of 2 contacts"
    ]
    run.comparisons["hull"] = run.comparisons["slow"]
    assert headlines(run) == ["hull: 75 % of the contact time it reports is false; misses none of 2 contacts"]
    assert invented(run) == []


@pytest.mark.parametrize(
    ("counts", "lines"),
    [
        ((), []),
        ((1,), ["it was asked for at most 4 convex pieces of a mesh: it made 1 piece of each, 1 in all."]),
        ((3, 1, 4), ["it was asked for at most 4 convex pieces of a mesh: it made 1 to 4 pieces of each, 8 in all."]),
    ],
)
def test_how_many_pieces_a_compound_came_to_is_said(counts, lines):
    parts = {str(k): (None,) * count for k, count in enumerate(counts)}
    shape = "compound" if counts else "hull"
    detector = SimpleNamespace(settings=SimpleNamespace(shape=shape, pieces=4), parts=parts)
    assert compounds(SimpleNamespace(detectors={"it": detector})) == lines
