from types import SimpleNamespace

import numpy as np
import pytest
from msgspec import structs
from support.report_states import MATCHING, audit_of, zeros
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x, verdict_column

from replay.auditing.matching import EpisodeMatch, EpisodeMatches
from replay.auditing.outcome import Outcome
from replay.auditing.wilson import proportion, wilson_interval
from replay.document.audit import OffsetProportions, PairFrames, TimeErrors
from replay.document.scores import matching_of, pooled_audits, undecided_alone
from replay.engine import compute
from sessions.model.scene import Scene, SceneBody


def test_contacts_of_a_body_with_its_parent_are_not_counted():
    """MATCHING is that of no contacts; both contacts are counted apart, as those while a hand holds a body."""
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="a")))
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=scene), detectors="discrete", pairs=[("a", "b")])
    figures = result.document.audit["discrete"]
    assert figures.matching == MATCHING
    (pair,) = result.document.pairs
    assert pair.audit["discrete"].while_grasped == figures.while_grasped and figures.while_grasped.contacts == 2
    assert [*pair.grasped_contacts] == ["exact"]


def test_excused_contacts_count_in_no_fraction():
    """The first of three contacts is matched, the second missed, the third excused; so is the second report."""
    match = EpisodeMatch(truth=1, reported=1, overlap=3, onset_error=0.5, duration_error=-0.25)
    matches = EpisodeMatches((match,), missed=(2,), excused_truth=(3,), excused_reports=(2,))
    figures = matching_of(matches, reference_contacts=3, reported_contacts=2)
    assert figures.missed_proportion.of == 3 - 1  # contact 3 is excused
    assert figures.false_proportion.of == 2 - 1  # report 2 is excused
    assert structs.astuple(figures.onset_error) == pytest.approx([0.5] * 4)


def test_pair_frames_only_the_detector_left_undecided_are_counted():
    """Four frames are left out; the reference decided the first, clear, and the third, contact."""
    reference = verdict_column(".uC-C")
    left_out, both = Outcome.LEFT_OUT, Outcome.BOTH
    comparison = SimpleNamespace(outcome=np.array([[left_out], [left_out], [left_out], [left_out], [both]]))
    run = SimpleNamespace(oracle="exact", detections={"exact": reference}, comparisons={"slow": comparison})
    assert undecided_alone(run, "slow") == 2


ERRORS = TimeErrors(mean=0.1, median=0.1, p95_absolute=0.1, largest_absolute=0.1)
"""The same of one contact: mean, median and largest."""

SINGLE = audit_of(
    time_missed=proportion(1, 10),
    pair_frames=zeros(PairFrames, both=9, missed=1),
    matching=structs.replace(MATCHING, reference_contacts=3, onset_error=ERRORS),
    undecided_reasons={"open mesh": 2},
)


def test_pooled_sessions_sum_counts_before_dividing():
    """Two sessions of 1 missed in 10 pair-frames are 2 in 20."""
    other = structs.replace(SINGLE, undecided_reasons={"budget": 1})
    (audit,) = pooled_audits([{"x": SINGLE}, {"x": other}]).values()
    assert audit.time_missed == proportion(2, 20)
    assert (audit.time_missed.lower, audit.time_missed.upper) == wilson_interval(count=2, whole=20)
    assert audit.pair_frames == zeros(PairFrames, both=18, missed=2)
    assert audit.between_frames == "not examined"
    assert audit.undecided_reasons == {"open mesh": 2, "budget": 1}
    assert audit.matching == structs.replace(MATCHING, reference_contacts=6)


def test_means_over_offsets_are_pooled_only_if_all_have_means():
    """1 of 16 in two sessions are 2 of 32; a session without offsets leaves no mean."""
    same = proportion(1, 16)
    means = OffsetProportions(contacts_missed=same, late_or_cut_short=same, time_missed=same, false_contact=same)
    rated = structs.replace(SINGLE, means_over_offsets=means)
    assert pooled_audits([{"x": rated}, {"x": rated}])["x"].means_over_offsets.contacts_missed == proportion(2, 32)
    assert pooled_audits([{"x": rated}, {"x": SINGLE}])["x"].means_over_offsets is None


def test_audit_of_a_single_session_is_pooled_unchanged():
    """Also of two detectors that have a session each."""
    assert pooled_audits([{"x": SINGLE}]) == {"x": SINGLE}
    assert list(pooled_audits([{"x": SINGLE}, {"y": SINGLE}])) == ["x", "y"]
    assert pooled_audits([]) == {}
