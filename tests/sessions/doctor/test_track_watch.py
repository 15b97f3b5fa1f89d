from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planted_faults import FRAMES, STEP_NS, clean

from sessions import Severity, Status
from sessions.doctor.pose_pass import look_through
from sessions.doctor.timing import out_of_order, time_findings
from sessions.doctor.track_watch import Mark, TrackSamples, TrackWatch

STEP = 1 / 90


def samples(position, quaternion=None, sample_ns=None):
    count = len(position)
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)) if quaternion is None else np.asarray(quaternion, float)
    stamps = np.arange(count) if sample_ns is None else np.asarray(sample_ns)
    return TrackSamples(np.arange(count), np.arange(count) * STEP, stamps, np.asarray(position, float), turn)


def watched(all_of, cuts=()):
    count = len(all_of)
    marks, steps = np.zeros(count, np.uint16), np.full(count, np.nan, np.float32)
    watch, edges = TrackWatch(STEP), [0, *sorted(cuts), count]
    for start, stop in pairwise(edges):
        watch.add(all_of.part(start, stop), marks, steps, last=stop == count)
    return marks, steps


def swing(count=60, size=0.3):
    t = np.arange(count) * STEP
    return np.stack([size * np.sin(6 * t), np.cos(5 * t), 0 * t], axis=1)


@given(st.lists(st.integers(0, 60), max_size=8), st.integers(0, 5))
def test_the_marks_do_not_depend_on_how_the_track_was_cut(cuts, seed):
    rng = np.random.default_rng(seed)
    place = swing() + rng.normal(0, 1e-3, (60, 3))
    place[rng.integers(5, 55) :] += [0.4, 0, 0]
    place[30:34] = place[29]
    whole = watched(samples(place))
    parts = watched(samples(place), cuts)
    assert whole[0].tolist() == parts[0].tolist()
    assert whole[1].tobytes() == parts[1].tobytes()


def test_a_body_that_starts_at_once_or_is_struck_is_not_teleported():
    place = np.zeros((60, 3))
    place[30:, 0] = np.arange(30) * 10 * STEP  # from rest to 10 m/s in one step
    bounced = np.abs(np.arange(-30, 30))[:, None] * [4 * STEP, 0, 0]
    assert not (watched(samples(place))[0] & Mark.TELEPORT).any()
    assert not (watched(samples(bounced))[0] & Mark.TELEPORT).any()


def findings(draft):
    return [*time_findings(look_through([draft.session().frames]))]


def shifted(draft, start, stop, by):
    for name in ("stamp_ns", "log_ns", "sample_ns"):
        draft.arrays[name][start:stop] += by


def test_a_frame_is_out_of_order_against_the_latest_one_before():
    backwards, repeated = out_of_order(np.array([0, 10, 5, 10, 8, 11]))
    assert np.flatnonzero(backwards).tolist() == [2, 4] and np.flatnonzero(repeated).tolist() == [3]


@pytest.mark.parametrize(("steps", "found"), [(2.9, False), (3.1, True)])
def test_a_gap_is_longer_than_three_median_steps(steps, found):
    draft = clean()
    shifted(draft, 400, FRAMES, round((steps - 1) * STEP_NS))
    gaps = [one for one in findings(draft) if one.code == "gap"]
    stamps = draft.arrays["stamp_ns"]
    assert [(one.start_ns, one.end_ns) for one in gaps] == [(stamps[399], stamps[400])] * found
    assert all(one.severity == Severity.NOTE for one in gaps)


def test_a_body_that_pauses_while_others_go_on_has_a_gap_of_its_own():
    draft = clean()
    draft.arrays["status"][300:400, 1] = Status.ABSENT
    (one,) = findings(draft)
    stamps = draft.arrays["stamp_ns"]
    assert (one.code, one.body, one.start_ns, one.end_ns) == ("gap", "hand-left", stamps[299], stamps[400])


def test_a_body_at_a_third_of_the_rate_has_no_gap():
    draft = clean()
    draft.arrays["status"][np.arange(FRAMES) % 3 > 0, 1] = Status.ABSENT
    assert findings(draft) == []


def test_a_log_clock_with_another_zero_is_noted_and_its_jump_still_found():
    draft = clean()
    draft.arrays["log_ns"] = draft.arrays["log_ns"] - 10**18
    (one,) = findings(draft)
    assert (one.code, one.severity) == ("clock-skew", Severity.NOTE)
    draft.arrays["log_ns"][600:] += 5 * 10**9
    assert [one.severity for one in findings(draft)] == [Severity.NOTE, Severity.WARNING]
