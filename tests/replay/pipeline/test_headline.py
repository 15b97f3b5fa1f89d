from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import jumping

from replay.base.wilson import share
from replay.comparison.outcome import Comparison, Episode, Outcome
from replay.pipeline.engine import compute
from replay.pipeline.headline import beside, compounds, headline, headlines, held, invented, phases, price


def told(*contacts):
    """A run whose oracle has contacts of one frame a letter: b(oth), m(issed), u(ndecided), w(ithin tolerance)."""
    letters = {"b": Outcome.BOTH, "m": Outcome.MISSED, "u": Outcome.LEFT_OUT, "w": Outcome.WITHIN_TOLERANCE}
    outcome, found = [[Outcome.NEITHER]], []
    for contact in contacts:
        found.append(Episode(0, len(outcome), len(outcome) + len(contact) - 1, 0.0, 0.0))
        outcome += [*([letters[letter]] for letter in contact), [Outcome.NEITHER]]
    comparison = Comparison("slow", "exact", np.array(outcome, dtype=np.uint8))
    return SimpleNamespace(oracle="exact", episodes={"exact": tuple(found)}, comparisons={"slow": comparison})


@pytest.mark.parametrize(
    ("contacts", "words"),
    [
        (["m"] * 9 + ["b"] * 9, "9 of 18 contacts missed by slow"),
        (["mm", "mb", *["b"] * 7], "1 of 9 contacts missed by slow, 1 more in part"),
        (["mbmbm", *["b"] * 4], "1 of 5 contacts missed in part by slow"),
        (["b", "bb", "w"], "None of 3 contacts missed by slow"),
        (["m"], "1 of 1 contact missed by slow"),
        ([], "No contact found by exact, so none for slow to miss"),
        (["uu"] * 8, "8 of 8 contacts undecided by slow"),
        (["u", "b", "b"], "1 of 3 contacts undecided by slow; none missed where it decided"),
        (["ub", "b"], "1 of 2 contacts undecided in part by slow; none missed where it decided"),
        (
            ["u", "ub", "m", "bm"],
            "1 of 4 contacts undecided by slow, 1 more in part; 1 of 4 contacts missed by slow, 1 more in part",
        ),
    ],
)
def test_the_headline_counts_contacts_and_says_first_what_was_not_decided(contacts, words):
    assert headline(told(*contacts), "slow") == words


def test_the_headline_of_two_that_decided_nothing_says_that_nothing_was_compared():
    run = told()
    nothing = Comparison("slow", "exact", np.full((5, 2), Outcome.LEFT_OUT, dtype=np.uint8))
    run.comparisons = {"slow": nothing}
    assert headline(run, "slow") == "Nothing compared: exact and slow both decided none of 10 pair-frames"


def took(seconds, *, live=True, name="discrete", faces=False):
    return {"name": name, "live": live, "faces_asked": faces, "seconds": {"per_frame_mean": seconds}}


def priced(*, contacts=1, faces=True, **detectors):
    summary = {"detectors": {"exact": took(5.69e-5, live=False, name="exact", faces=faces), **detectors}}
    episodes = {"exact": (None,) * contacts}
    return SimpleNamespace(oracle="exact", comparisons=dict.fromkeys(detectors), summary=summary, episodes=episodes)


LIKE = "replay tradeoff compares like with like."


def test_times_of_one_pass_are_said_to_be_that_and_to_be_of_what_they_are():
    engine = took(1e-7, name="recorded")
    assert price(priced(slow=took(1.63e-4), engine=engine, box=took(2e-5, live=False))) == [
        "Every contact counted here was found by exact in 0.0569 ms a frame (whole recording at once, with faces); "
        "slow took 0.163 ms (frame by frame, without faces); box took 0.02 ms (whole recording at once, without "
        f"faces). One pass of each, not alike: {LIKE}"
    ]
    assert price(priced()) == []
    (alone,) = price(priced(engine=engine))
    assert alone.endswith(" 0.0569 ms a frame (whole recording at once, with faces). One pass.")
    (none,) = price(priced(contacts=0, slow=took(1.63e-4)))
    assert none.startswith("No contact was found by exact in 0.0569 ms a frame")


@pytest.mark.parametrize(
    ("faces", "subject", "alike"),
    [
        (False, took(2e-5, live=False), True),
        (True, took(2e-5, live=False), False),
        (False, took(2e-5), False),
        (False, took(2e-5, live=False, faces=True), False),
    ],
)
def test_booleans_beside_faces_and_live_beside_the_whole_recording_are_not_alike(faces, subject, alike):
    (line,) = price(priced(faces=faces, it=subject))
    assert line.endswith(f". One pass of each{'' if alike else ', not alike'}: {LIKE}")


def test_who_lists_no_faces_took_its_time_without_them_though_it_was_asked():
    (line,) = price(compute(jumping(), detectors="exact", oracle="continuous", offline=True))
    assert line.count("(whole recording at once, without faces)") == 2 and "One pass of each: " in line
    (line,) = price(compute(jumping(), detectors="continuous", oracle="exact"))
    assert "with faces); continuous took" in line and "One pass of each, not alike: " in line


def test_who_reports_contact_where_there_is_none_is_told_so_however_little_it_misses():
    for outcomes, told in {(1, 1, 2): [], (1, *[3] * 29): ["96.7"], (3, 3): ["100"]}.items():
        one = Comparison("it", "exact", np.array([outcomes], dtype=np.uint8))
        lines = [f"it invents {share} % of the contact that it reports, counted in pair-frames." for share in told]
        assert invented(SimpleNamespace(comparisons={"it": one})) == lines


def looked(contacts=18):
    """A detector at 22.5 Hz that misses half of the contacts at this phase, and a quarter in the mean."""
    run = told(*["m", "b"] * (contacts // 2))
    run.summary = {"detectors": {"slow": {"name": "discrete", "settings": {"rate_hz": 22.5}}}}
    run.phases = {"slow": {"contacts_missed": share(contacts * 4, contacts * 16)}}
    run.detections = {"exact": SimpleNamespace(verdict=np.ones((len(run.comparisons["slow"].outcome), 1), np.uint8))}
    run.detections["slow"], run.holdings, run.detectors = run.detections["exact"], (), {}
    return run


def test_who_looks_at_a_rate_is_said_to_miss_at_this_runs_phase_and_what_the_mean_is():
    assert phases(looked()) == [
        "slow looks 22.5 times a second. At this run's phase it misses 9 of 18 contacts, 4.50 in the mean over 16 "
        "phases."
    ]
    assert phases(looked(contacts=0)) == []


def test_what_a_hand_holds_is_counted_apart_and_said():
    run = looked()
    assert held(run) == []
    run.holdings = (Episode(0, 1, 3, 0.0, 0.0),)
    outcome = run.comparisons["slow"].outcome.copy()
    outcome[1:4] = Outcome.HELD
    run.comparisons = {"slow": Comparison("slow", "exact", outcome)}
    run.detections["exact"] = SimpleNamespace(verdict=np.zeros_like(run.detections["exact"].verdict))
    assert held(run) == ["Counted apart, of a hand with what it holds, slow reports 3 pair-frames of false contact."]
    run.episodes = {"exact": run.holdings}
    run.detections["exact"] = run.detections["slow"]
    assert held(run) == ["Counted apart, of a hand with what it holds, slow misses 0 of 1 contacts."]


def test_page_picture_and_terminal_say_the_same_beside_the_headline():
    run = looked()
    assert beside(run) == [*invented(run), *held(run), *phases(run)] and len(beside(run)) == 1


def test_of_several_detectors_the_headline_is_that_of_the_worst_with_its_larger_fault_first():
    run, wrong = told("m", "b"), share(3, 4)
    lost = {
        "contacts": 2, "contacts_missed": 1, "contacts_in_part": 0, "contacts_undecided": 0, "invented": share(0, 1),
    }  # fmt: skip
    made = {"name": "x", "contacts": 2, "seconds": {}}
    run.summary = {
        "oracle": "exact", "audit": {"slow": lost, "hull": {**lost, "contacts_missed": 0, "invented": wrong}},
        "detectors": dict.fromkeys(("slow", "hull", "exact"), made),
    }  # fmt: skip
    assert headlines(run) == ["1 of 2 contacts missed by slow"]
    run.comparisons["hull"] = run.comparisons["slow"]
    assert headlines(run) == ["hull: 75 % of the contact it reports is false"]
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
