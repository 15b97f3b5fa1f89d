from types import SimpleNamespace

import numpy as np
import pytest
from msgspec import structs
from support.report_states import MATCHING, audit_of, zeros
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x, verdict_column

from replay.auditing.fault import FaultKind
from replay.auditing.matching import EpisodeMatch, EpisodeMatches
from replay.auditing.outcome import Outcome
from replay.auditing.wilson import proportion, wilson_interval
from replay.document.audit import OffsetProportions, PairFrames, TimeErrors
from replay.document.scores import matching_of, pooled_audits, undecided_alone
from replay.engine import compute
from sessions.model.scene import Scene, SceneBody


def test_contacts_of_a_body_with_its_parent_are_not_counted():
    """Body b hangs from body a and touches it twice: both contacts are counted apart, as those while a hand holds it.

    MATCHING is the comparison of contacts where there are none.
    """
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="a")))
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=scene), detectors="discrete", pairs=[("a", "b")])
    audit = result.document.audit["discrete"]
    assert audit.matching == MATCHING
    assert audit.while_grasped.contacts == 2
    (pair,) = result.document.pairs
    assert pair.audit["discrete"].while_grasped == audit.while_grasped
    assert [*pair.grasped_contacts] == ["exact"]


def test_excused_contacts_count_in_no_fraction():
    """The reference has three contacts: the first is reported, the second missed, the third excused.

    The first of two reports is of the first contact, 0.5 s late, the second is excused. So fractions are of 2 contacts
    and of 1 report; mean, median, 95 % and largest of a single error are the error.
    """
    match = EpisodeMatch(truth=1, reported=1, overlap=3, onset_error=0.5, duration_error=-0.25)
    matches = EpisodeMatches((match,), missed=(2,), excused_truth=(3,), excused_reports=(2,))
    matching = matching_of(matches, reference_contacts=3, reported_contacts=2)
    assert matching.missed_proportion.of == 3 - 1
    assert matching.false_proportion.of == 2 - 1
    assert structs.astuple(matching.onset_error) == pytest.approx((0.5, 0.5, 0.5, 0.5))


def test_pair_frames_only_the_detector_left_undecided_are_counted():
    """The first four of five frames are left out of the comparison; the reference decided two of these.

    The reference says clear, undecided, contact, no pose, contact (``.uC-C``).
    """
    reference = verdict_column(".uC-C")
    left_out, both = Outcome.LEFT_OUT, Outcome.BOTH
    comparison = SimpleNamespace(outcome=np.array([[left_out], [left_out], [left_out], [left_out], [both]]))
    run = SimpleNamespace(oracle="exact", detections={"exact": reference}, comparisons={"slow": comparison})
    assert undecided_alone(run, "slow") == 2


ERRORS = TimeErrors(mean=0.1, median=0.1, p95_absolute=0.1, largest_absolute=0.1)
"""Seconds by which reports begin late, of one contact: mean, median and largest are the same."""

SESSION_AUDIT = audit_of(
    time_missed=proportion(1, 10),
    pair_frames=zeros(PairFrames, both=9, missed=1),
    matching=structs.replace(MATCHING, reference_contacts=3, onset_error=ERRORS),
    undecided_reasons={"open mesh": 2},
)
"""The audit of a detector in a session: 1 of 10 pair-frames missed, three contacts, one late."""


def test_pooled_sessions_sum_counts_before_dividing():
    """Two sessions of 1 missed in 10 pair-frames are 2 in 20, with Wilson's interval of 2 in 20.

    Errors in time are of single contacts and are not pooled; reasons of what is undecided are added by name.
    """
    other = structs.replace(SESSION_AUDIT, undecided_reasons={"budget": 1})
    (audit,) = pooled_audits([{"x": SESSION_AUDIT}, {"x": other}]).values()
    assert audit.time_missed == proportion(2, 20)
    assert (audit.time_missed.lower, audit.time_missed.upper) == wilson_interval(count=2, whole=20)
    assert audit.pair_frames == zeros(PairFrames, both=18, missed=2)
    assert audit.between_frames == "not examined"
    assert audit.undecided_reasons == {"open mesh": 2, "budget": 1}
    assert audit.matching == structs.replace(MATCHING, reference_contacts=6)


def test_means_over_offsets_are_pooled_only_if_all_have_means():
    """1 of 16 in two sessions are 2 of 32; a session without means over sampling offsets leaves none."""
    same = proportion(1, 16)
    means = OffsetProportions(contacts_missed=same, late_or_cut_short=same, time_missed=same, false_contact=same)
    with_means = structs.replace(SESSION_AUDIT, means_over_offsets=means)
    pooled = pooled_audits([{"x": with_means}, {"x": with_means}])["x"]
    assert pooled.means_over_offsets.contacts_missed == proportion(2, 32)
    assert pooled_audits([{"x": with_means}, {"x": SESSION_AUDIT}])["x"].means_over_offsets is None


def test_audit_of_a_single_session_is_pooled_unchanged():
    """Detector x in one session; without a session there is no audit."""
    assert pooled_audits([{"x": SESSION_AUDIT}]) == {"x": SESSION_AUDIT}
    assert pooled_audits([]) == {}


def test_detectors_of_different_sessions_are_pooled_apart():
    """Detectors x and y have a session each, whose audit they keep whole, with the errors of matched contacts."""
    assert SESSION_AUDIT.matching.onset_error is not None
    pooled = pooled_audits([{"x": SESSION_AUDIT}, {"y": SESSION_AUDIT}])
    assert list(pooled.items()) == [("x", SESSION_AUDIT), ("y", SESSION_AUDIT)]


@pytest.fixture(scope="module")
def run_of_three_contacts():
    """Unit cubes at 100 Hz: b is in contact with a in frames 2 and 3, in 5, and in 8 to 10; c is 0.2 m beside a.

    ``slow`` samples the even frames: it misses frame 5 and reports 11 too. Spheres overlap below 1.73 m.
    """
    x_of_b = [3, 3, 0.9, 0.9, 3, 0.9, 3, 3, 0.9, 0.8, 0.9, 1.2]
    session = unit_cubes_on_x({"a": [0.0] * 12, "b": x_of_b, "c": [-1.2] * 12})
    pairs = [("a", "b"), ("a", "c")]
    return compute(session, detectors="slow=discrete[rate_hz=50],sphere", oracle="exact", pairs=pairs).document


def test_contacts_of_a_pair_are_counted_and_measured(run_of_three_contacts):
    """Pair a-b has 2, 1 and 3 contact frames of 10 ms by the reference, 2 and 4 by ``slow``.

    On a-c spheres alone report contact, falsely in all 12 frames; its audit leaves out ``slow``, which reports nothing.
    """
    first, second = run_of_three_contacts.pairs
    exact, slow = first.contacts["exact"], first.contacts["slow"]
    assert (exact.count, exact.seconds, exact.longest, exact.cut) == (3, pytest.approx(0.06), pytest.approx(0.03), 0)
    assert (slow.count, slow.seconds, slow.longest) == (2, pytest.approx(0.06), pytest.approx(0.04))
    assert [{*pair.audit} for pair in (first, second)] == [{"slow", "sphere"}, {"sphere"}]
    assert second.audit["sphere"].pair_frames.false_contact == 12


def test_audit_counts_misses_by_kind_and_unconfirmed_frames(run_of_three_contacts):
    """``slow`` misses one contact of three and is false in frame 11, by its meshes: none of that is unconfirmed.

    Only bounding spheres overlap in frame 11 of a-b and in all 12 frames of a-c: 13 unconfirmed. Of the two contacts
    that ``slow`` finds one ends on time, the other a frame late: 5 ms in the mean.
    """
    slow, sphere = run_of_three_contacts.audit["slow"], run_of_three_contacts.audit["sphere"]
    assert slow.misses_by_kind == {kind: int(kind is FaultKind.NEVER_REPORTED) for kind in slow.misses_by_kind}
    assert (slow.misses, slow.contacts_cut) == (1, 0)
    assert (slow.unconfirmed, sphere.unconfirmed) == (0, 13)
    assert slow.matching.end_error.mean == pytest.approx(0.005)
