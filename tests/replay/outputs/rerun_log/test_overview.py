"""All detectors on one screen: lanes, list, words and eye are those of the moment in focus, wherever the cursor is."""

import numpy as np
import pytest

from cdcore.protocol import counts_as_contact
from replay.comparison.outcome import Outcome
from replay.errors import RunFolderError
from replay.outputs.moments import KINDS, key_moments, pair_in_focus
from replay.outputs.palette import OUTCOMES
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.viewer import _target

SUBJECT = "22.5Hz"


@pytest.fixture(scope="module")
def moments(demo):
    return key_moments(demo)


def states(read, path, stamps):
    """What a lane shows at each of these nanoseconds."""
    rows = read.lane(path)
    return [next((state for ns, state in reversed(rows) if ns <= at), "") for at in stamps.tolist()]


@pytest.fixture(scope="module")
def stamps(demo):
    return demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]


def test_the_moments_are_all_misses_and_false_contacts_and_no_two_share_a_place(demo, moments):
    false = demo.false[SUBJECT]
    found = {(one.outcome, one.number) for one in moments if one.label}
    assert found == {(Outcome.MISSED, one.number) for one in demo.misses[SUBJECT]} | {
        (Outcome.INVENTED, one.number) for one in false
    }
    assert false and len({(one.frame, one.later) for one in moments}) == len(moments)
    assert {one.pair for one in moments if not one.label}.isdisjoint(one.pair for one in moments if one.label)


def test_at_every_frame_a_lane_says_what_the_detector_made_of_the_pair_in_focus(demo, moments, read, stamps):
    pair = pair_in_focus(moments, len(stamps))
    outcome = demo.comparisons[SUBJECT].outcome[np.arange(len(stamps)), pair]
    words = [OUTCOMES[code][0] if code in OUTCOMES else "" for code in outcome.tolist()]
    assert states(read, f"focus/pair/2_{SUBJECT}", stamps) == words
    contact = counts_as_contact(demo.detections["hybrid"].verdict)[np.arange(len(stamps)), pair]
    name = demo.assembly.pair_name
    names = [name(column) + ": contact" * int(now) for column, now in zip(pair, contact, strict=True)]
    assert states(read, "focus/pair/1_hybrid", stamps) == names
    assert len(set(pair.tolist())) > 1


def test_the_lane_of_all_pairs_shows_the_worst_and_numbers_stand_over_misses(demo, read, stamps):
    own = demo.comparisons[SUBJECT].outcome
    seen = states(read, f"focus/all/2_{SUBJECT}", stamps)
    numbers = {str(one.number) for one in demo.misses[SUBJECT]}
    for frame, word in enumerate(seen):
        if word in ("both", "false", ""):
            codes = (Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH)
            worst = next((OUTCOMES[code][0] for code in codes if (own[frame] == code).any()), "")
            assert word == worst, frame
        else:
            assert word in numbers or "-" in word
    for miss in demo.misses[SUBJECT]:
        assert seen[miss.first] not in ("both", "false", "")


def test_where_the_list_leads_the_note_speaks_of_the_moment_and_the_eye_looks_at_it(demo, moments, read, stamps):
    assert len(read.column("focus/moments", "TextLog:text")) == len(moments)
    for one in moments:
        ns = int(stamps[one.frame]) + one.later
        assert read.at_ns("focus/note", "TextDocument:text", ns) == [one.said]
        (line,) = read.at_ns("focus/moments", "TextLog:text", ns)
        assert one.label in line and demo.assembly.pair_name(one.pair) in line
        (place,) = read.at_ns("world/focus/eye", "Transform3D:translation", ns)
        away = np.linalg.norm(np.subtract(place, one.point))
        assert away == pytest.approx(0.125 if one.outcome == Outcome.MISSED else 0.3, abs=1e-4)


def test_a_flag_stands_while_a_fault_in_focus_lasts_and_carries_its_number(moments, read, stamps):
    for one in moments:
        if one.label and not one.later:
            (flag,) = read.at("world/focus/flag", "Points3D:labels", one.frame)
            near = [other for other in moments if other.frame == one.frame]
            assert flag in [f"{other.label}: {other.words}" for other in near]


def test_a_number_leads_to_its_moment_and_a_wrong_one_is_one_sentence(moments, recording, stamps):
    there = sorted((one.kind, one.number) for one in read_moments(recording))
    assert there == sorted((KINDS[one.outcome], one.number) for one in moments)
    for one in moments:
        at = int(stamps[one.frame]) + one.later
        if one.outcome == Outcome.INVENTED:
            assert _target(recording, None, one.number, "") == _target(recording, None, one.number, SUBJECT) == at
        elif one.outcome == Outcome.MISSED:
            assert _target(recording, one.number, None, SUBJECT) == at
    with pytest.raises(RunFolderError, match=r"there is no false 999 in .*; its false contacts are numbered 1 to \d+"):
        _target(recording, None, 999, "")
    with pytest.raises(RunFolderError, match=r"there is no miss 1 in .*; it has none"):
        _target(recording, 1, None, "nobody")
