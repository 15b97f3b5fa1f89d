"""Bodies of a group count as one thing: a hand of several links beside a glass."""

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

import replay
from replay.auditing.outcome import Comparison, Outcome, joined_outcome
from replay.show.run_tables import pair_table
from sessions.scene_files.scene_toml import parse_scene

X_OF_CUBES = {
    "thumb": [9, 9, 0.9, 0.9, 9, 9, 9, 9],
    "index": [8, 8, 8, 0.8, 0.8, 8, 0.9, 8],
    "palm": [7.5, 7.5, 7.5, 7.5, 7.5, 7.5, 7.5, 7.5],
    "glass": [0, 0, 0, 0, 0, 0, 0, 0.001],
}
"""Metres on X of four cubes of 1 m in eight frames of 10 ms; they touch below 1 m.

The thumb touches the glass in frames 2 and 3, the index in 3, 4 and 6: two contacts of the hand.
"""

SCENE = """
[[body]]
id = "thumb"
[[body]]
id = "index"
[[body]]
id = "palm"
[[body]]
id = "glass"
[[group]]
name = "hand"
members = ["thumb", "i*", "palm"]
"""
"""Thumb, index and palm are a group, the hand."""

HAND_AND_CUP = """
[[body]]
id = "thumb"
[[body]]
id = "finger"
[[body]]
id = "cup"
[[group]]
name = "hand"
members = ["thumb", "finger"]
[[pair]]
between = ["hand", "cup"]
"""
"""Thumb and finger are a group, which is examined beside the cup."""


@pytest.fixture(scope="module")
def run_with_hand():
    """A run of the four cubes, three of which are the hand, by exact and by the detector of a paper."""
    session = unit_cubes_on_x(X_OF_CUBES, scene=parse_scene(SCENE))
    return replay.run(session, detectors="paper,exact", oracle="exact")


def test_members_are_not_paired_and_touch_as_a_group(run_with_hand):
    """Thumb, index and palm are a hand: each is paired with the glass, not with each other, though they meet.

    Thumb and index touch the glass in frames 2 and 3, and in frames 3, 4 and 6: contacts of the hand are 2 to 4, and 6.
    The detector ``paper`` finds the same.
    """
    assembly = run_with_hand.assembly
    pairs = {assembly.bodies_of(pair) for pair in range(len(assembly.pairs))}
    assert pairs == {("thumb", "glass"), ("index", "glass"), ("palm", "glass")}
    contacts = [(contact.first, contact.last) for contact in run_with_hand.episodes["exact"]]
    assert contacts == [(2, 4), (6, 6)]
    assert [*run_with_hand.episodes["paper"]] == [*run_with_hand.episodes["exact"]]
    assert run_with_hand.document.audit["paper"].contacts == 2


def test_table_of_pairs_names_group_and_below_it_members(run_with_hand):
    """Thumb and index of a hand touch a glass: frames 2 and 3, and frames 3, 4 and 6; the palm never does.

    The table is of the detector ``paper``, which finds all. The hand has two contacts, frames 2 to 4 and 6; five frames
    are 2 of the thumb and 3 of the index.
    """
    table = pair_table(run_with_hand, "paper")
    assert table.column("pair") == ["hand-glass", "  thumb-glass", "  index-glass"]
    assert table.column("contacts") == [2, None, None]
    assert table.column("frames found") == [5, 2, 3]


def test_table_of_contacts_names_the_group_and_who_touched_first(run_with_hand):
    """Thumb and index of a hand touch a glass: frames 2 and 3, and frames 3, 4 and 6.

    The first contact of the hand begins with the thumb, the second with the index.
    """
    rows = [row for row in run_with_hand.tables["episodes"].plain() if row["detector"] == "exact"]
    assert [(row["body_a"], row["body_b"]) for row in rows] == [("hand", "glass")] * 2
    assert [row["members"] for row in rows] == ["thumb", "index"]


def test_faults_of_a_hand_name_the_link_that_caused_them():
    """A hand touches a glass in frames 2 to 4, by thumb and index in turn, and in frame 6.

    A detector that samples frames 3 and 7 (25 Hz, from 30 ms on) is late for a contact and reports it too long.
    """
    session = unit_cubes_on_x(X_OF_CUBES, scene=parse_scene(SCENE))
    run = replay.run(session, detectors="late=discrete[rate_hz=25,sampling_offset_s=0.03],exact", oracle="exact")
    assert run.misses["late"] and run.false["late"]
    for fault in (*run.misses["late"], *run.false["late"]):
        outcome = Outcome.MISSED if fault.kind.is_miss else Outcome.FALSE_CONTACT
        assert (run.comparisons["late"].outcome[fault.first : fault.last + 1, fault.pair] == outcome).all()
        link, _glass = run.assembly.bodies_of(fault.pair)
        assert fault.bodies == ("hand", "glass") and f"hand ({link}) and glass" in fault.why
    counts = run.document.audit["late"]
    assert counts.contacts == 2
    assert counts.contacts_missed + counts.late_or_cut_short <= 2


def test_contact_of_a_member_hides_no_false_contact_of_another():
    """The finger is in contact with the cup throughout; the surface of the thumb comes within 0.2 m of it.

    Boxes with a contact offset of 0.2 m each report contact from 0.4 m on: that of the thumb is false.
    """
    still = [0.0] * 6
    session = unit_cubes_on_x(
        {"finger": still, "thumb": [1.4, 1.3, 1.2, 1.2, 1.3, 1.4], "cup": still}, scene=parse_scene(HAND_AND_CUP)
    )
    run = replay.run(session, detectors="wide=collider[shape=box,skin_m=0.2],exact", oracle="exact")
    audit = run.document.audit["wide"]
    assert audit.contacts == 1 and audit.false_contacts > 0 and audit.false_contact.value > 0.0
    assert run.false["wide"]
    assert all("hand (thumb) and cup" in fault.why for fault in run.false["wide"])


@pytest.mark.parametrize(
    ("thumb", "index", "hand"),
    [
        pytest.param(Outcome.NEITHER, Outcome.NEITHER, Outcome.NEITHER, id="no contact"),
        # Reference and detector both report contact of the hand, be it of the same link or not.
        pytest.param(Outcome.BOTH, Outcome.MISSED, Outcome.BOTH, id="another link reported"),
        pytest.param(Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH, id="reported at the other link"),
        pytest.param(Outcome.MISSED, Outcome.NEITHER, Outcome.MISSED, id="missed"),
        pytest.param(Outcome.MISSED, Outcome.LEFT_OUT, Outcome.MISSED, id="missed, other link without verdict"),
        pytest.param(Outcome.FALSE_CONTACT, Outcome.NEITHER, Outcome.FALSE_CONTACT, id="false"),
        # The index has no verdict and may touch, so the thumb's false contact is not counted.
        pytest.param(Outcome.FALSE_CONTACT, Outcome.LEFT_OUT, Outcome.LEFT_OUT, id="false, other without verdict"),
        # A hand that holds the body touches it by intent.
        pytest.param(Outcome.GRASPED, Outcome.FALSE_CONTACT, Outcome.GRASPED, id="grasped"),
        pytest.param(Outcome.WITHIN_TOLERANCE, Outcome.NEITHER, Outcome.WITHIN_TOLERANCE, id="within tolerance"),
    ],
)
def test_outcome_of_a_hand_follows_from_outcomes_of_its_links(thumb, index, hand):
    """Detector and reference are compared in one frame: about each link beside a glass, and so about the whole hand."""
    outcomes_of_one_frame = np.array([[thumb, index]], dtype=np.uint8)
    assert joined_outcome(outcomes_of_one_frame) == [hand]


@pytest.mark.parametrize(
    ("contact_columns", "expected"),
    [
        pytest.param(None, [Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT], id="no groups"),
        pytest.param([0, 1, 2], [Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT], id="each pair for itself"),
        # Missed at one link and reported at the other, the contact of the hand is reported.
        pytest.param([0, 1, 0], [Outcome.BOTH, Outcome.BOTH, Outcome.NEITHER], id="pairs 0 and 2 are one contact"),
    ],
)
def test_contacts_of_a_group_stand_in_its_first_column(contact_columns, expected):
    """Pairs 0 to 2 in one frame: missed, reported rightly, and falsely.

    ``contact_columns``: for each pair, the first pair that counts as one contact with it.
    """
    outcome = np.array([[Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT]], dtype=np.uint8)
    columns = None if contact_columns is None else np.array(contact_columns)
    assert Comparison("slow", "exact", outcome, columns).by_contact.tolist() == [expected]
