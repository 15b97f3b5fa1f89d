"""Bodies of a group count as one thing: a hand of several links beside a glass."""

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

import replay
from replay.auditing.outcome import Comparison, Outcome, joined_outcome
from replay.show.run_tables import pair_table
from sessions.scene_files.scene_toml import parse_scene

POSITIONS = {
    "thumb": [9, 9, 0.9, 0.9, 9, 9, 9, 9],
    "index": [8, 8, 8, 0.8, 0.8, 8, 0.9, 8],
    "palm": [7.5, 7.5, 7.5, 7.5, 7.5, 7.5, 7.5, 7.5],
    "glass": [0, 0, 0, 0, 0, 0, 0, 0.001],
}
"""Thumb touches the glass in frames 2 and 3, index in 3, 4 and 6: two contacts of the hand, whose links meet."""

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


@pytest.fixture(scope="module")
def paper_run():
    """A run of the paper's pipeline over cubes in groups."""
    session = unit_cubes_on_x(POSITIONS, scene=parse_scene(SCENE))
    return replay.run(session, detectors="paper,exact", oracle="exact")


def test_members_are_not_paired_and_touch_as_a_group(paper_run):
    """Frames 2 to 4, by thumb and index in turn, are one contact of the hand, frame 6 another."""
    assembly = paper_run.assembly
    names = {"-".join(assembly.bodies_of(pair)) for pair in range(len(assembly.pairs))}
    assert names == {"thumb-glass", "index-glass", "palm-glass"}
    contacts = [(contact.first, contact.last) for contact in paper_run.episodes["exact"]]
    assert contacts == [(2, 4), (6, 6)]
    assert paper_run.document.audit["paper"].contacts == 2
    assert [*paper_run.episodes["paper"]] == [*paper_run.episodes["exact"]]


def test_tables_name_the_group_and_open_to_members(paper_run):
    """The rows of the members have their own frames, 2 of the thumb and 3 of the index; the palm never touches."""
    table = pair_table(paper_run, "paper")
    assert table.column("pair") == ["hand-glass", "  thumb-glass", "  index-glass"]
    assert table.column("contacts") == [2, None, None]
    assert table.column("frames found") == [5, 2, 3]
    assert {(row["body_a"], row["body_b"]) for row in paper_run.tables["episodes"].plain()} == {("hand", "glass")}
    members = [row["members"] for row in paper_run.tables["episodes"].plain() if row["detector"] == "exact"]
    assert members == ["thumb", "index"]


def test_faults_of_a_hand_name_the_link_that_caused_them():
    """A detector that samples frames 3 and 7 (25 Hz, from 30 ms on) is late for a contact and reports it too long."""
    session = unit_cubes_on_x(POSITIONS, scene=parse_scene(SCENE))
    slow = replay.run(session, detectors="late=discrete[rate_hz=25,sampling_offset_s=0.03],exact", oracle="exact")
    faults = [*slow.misses["late"], *slow.false["late"]]
    assert len(faults) >= 2
    for fault in faults:
        outcome = Outcome.MISSED if fault.kind.is_miss else Outcome.FALSE_CONTACT
        assert (slow.comparisons["late"].outcome[fault.first : fault.last + 1, fault.pair] == outcome).all()
        link = slow.assembly.bodies_of(fault.pair)[0]
        assert fault.bodies == ("hand", "glass") and f"hand ({link}) and glass" in fault.why
    counts = slow.document.audit["late"]
    assert counts.contacts == 2 and counts.contacts_missed + counts.late_or_cut_short <= 2


def test_contact_of_a_member_hides_no_false_contact_of_another():
    """The finger touches throughout; the thumb comes within 0.4 m, an offset of 0.2 m of both: that is false."""
    still = [0.0] * 6
    session = unit_cubes_on_x(
        {"finger": still, "thumb": [1.4, 1.3, 1.2, 1.2, 1.3, 1.4], "cup": still}, scene=parse_scene(HAND_AND_CUP)
    )
    wide = replay.run(session, detectors="wide=collider[shape=box,skin_m=0.2],exact", oracle="exact")
    audit = wide.document.audit["wide"]
    assert audit.contacts == 1 and audit.false_contacts and audit.false_contact.value > 0.0
    assert all("hand (thumb) and cup" in false.why for false in wide.false["wide"])


@pytest.mark.parametrize(
    ("thumb", "index", "hand"),
    [
        (Outcome.NEITHER, Outcome.NEITHER, Outcome.NEITHER),
        # Reference and detector both say contact of the hand, be it of the same link or not.
        (Outcome.BOTH, Outcome.MISSED, Outcome.BOTH),
        (Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH),
        (Outcome.MISSED, Outcome.NEITHER, Outcome.MISSED),
        (Outcome.MISSED, Outcome.LEFT_OUT, Outcome.MISSED),
        (Outcome.FALSE_CONTACT, Outcome.NEITHER, Outcome.FALSE_CONTACT),
        # The index has no verdict and may touch, so the thumb's false contact is not counted.
        (Outcome.FALSE_CONTACT, Outcome.LEFT_OUT, Outcome.LEFT_OUT),
        # A hand that holds the body touches it by intent.
        (Outcome.GRASPED, Outcome.FALSE_CONTACT, Outcome.GRASPED),
        (Outcome.WITHIN_TOLERANCE, Outcome.NEITHER, Outcome.WITHIN_TOLERANCE),
    ],
)
def test_outcome_of_a_hand_follows_from_outcomes_of_its_links(thumb, index, hand):
    """An outcome is of one frame, beside a glass; ``hand``: what counts for both links together."""
    outcomes_of_one_frame = np.array([[thumb, index]], dtype=np.uint8)
    assert joined_outcome(outcomes_of_one_frame) == [hand]


@pytest.mark.parametrize(
    ("contact_columns", "expected"),
    [
        (None, [Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT]),
        ([0, 1, 2], [Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT]),
        # Pairs 0 and 2 are one contact: missed at one link and reported at the other, it is reported.
        ([0, 1, 0], [Outcome.BOTH, Outcome.BOTH, Outcome.NEITHER]),
    ],
)
def test_contacts_of_a_group_stand_in_its_first_column(contact_columns, expected):
    """``contact_columns``: for each pair, the column of the pairs that count as one contact with it."""
    outcome = np.array([[Outcome.MISSED, Outcome.BOTH, Outcome.FALSE_CONTACT]], dtype=np.uint8)
    columns = None if contact_columns is None else np.array(contact_columns)
    assert Comparison("slow", "exact", outcome, columns).by_contact.tolist() == [expected]
