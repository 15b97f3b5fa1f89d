"""Looks at every n-th frame miss what lies between them, in every phase as counted by hand."""

import numpy as np
import pytest

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.protocol import counts_as_contact
from replay.studies.paper.frame_sampling import STEPS, Sampled, frame_sampling_table, held_to, sample_frames
from sessions.geometry.shapes import make_shape

TIMES = np.arange(12) / 10.0


def touching(*frames):
    table = np.zeros((12, 1), dtype=bool)
    table[list(frames)] = True
    return table


@pytest.mark.parametrize(
    ("looks", "missed", "lost"),
    [
        ((1, 0), 0, 0.05),
        ((2, 0), 0, 0.05),
        ((2, 1), 0, 0.15),
        ((4, 0), 0, 0.05),
        ((4, 1), 0, 0.15),
        ((4, 2), 0, 0.25),
        ((4, 3), 1, 0.25),
    ],
)
def test_a_contact_of_a_quarter_second_is_missed_as_counted_by_hand(looks, missed, lost):
    # in contact from 0.35 s to 0.6 s; frames at 0.4, 0.5 and 0.6 s see it, and what was seen holds until the next look
    found = held_to(touching(4, 5, 6), TIMES, looks, [0], np.array([0.35]), np.array([0.6]))
    assert found == (missed, pytest.approx(lost))


def test_a_contact_between_two_frames_is_missed_by_every_look():
    begin, end = np.array([0.41, 0.72]), np.array([0.49, 0.78])
    assert held_to(touching(), TIMES, (1, 0), [0, 0], begin, end) == (2, pytest.approx(0.14))


def test_a_held_contact_covers_time_of_the_next_but_sees_it_not():
    found = held_to(touching(0), TIMES, (3, 0), [0], np.array([0.12]), np.array([0.22]))
    assert found == (1, pytest.approx(0.0))


def test_what_is_believed_in_the_first_phase_is_what_a_discrete_detector_of_that_rate_says():
    shape = make_shape("box", {"x": 0.1, "y": 0.1, "z": 0.1})
    bodies = [Body(name, TriangleMesh(shape.vertices, shape.faces)) for name in "ab"]
    places = np.zeros((90, 2, 3))
    places[:, 1, 0] = 0.1 + 0.05 * np.sin(np.arange(90) / 2.0)
    motion = Motion(np.arange(90) / 90.0, places, np.tile(np.eye(3), (90, 2, 1, 1)))
    seen = counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)
    assert 10 < seen.sum() < 80
    for step in STEPS[:3]:
        held = counts_as_contact(create_detector("discrete", bodies, rate_hz=90.0 / step).detect(motion).verdict)
        # each frame as a contact of its own: it is lost in full, or not at all
        lost = [
            held_to(seen, motion.times, (step, 0), [0], motion.times[[k]], motion.times[[k + 1]])[1] for k in range(89)
        ]
        assert [one == 0.0 for one in lost] == held[:89, 0].tolist()


def test_the_table_adds_sessions_and_averages_phases():
    session = [Sampled(step, 4, 2.0, [1] * step, [0.5] * step) for step in STEPS]
    one = frame_sampling_table([session, session])
    assert one.column("looks a second") == [90.0, 45.0, 22.5, 10.0]
    assert set(one.column("contacts")) == {8} and set(one.column("missed, mean")) == {2.0}
    assert set(one.column("missed seconds, share")) == {0.25}
    assert "95 %, over contacts, not over sampling offsets alone" in one.note


@pytest.mark.slow
def test_the_brief_half_of_the_bumps_is_missed_in_part_and_more_with_fewer_looks():
    found = sample_frames(0)
    means = [np.mean(one.missed) for one in found]
    assert means == sorted(means) and means[0] == 0.0 and means[-1] > 3.0
    seconds = [np.mean(one.missed_seconds) for one in found]
    assert seconds == sorted(seconds) and 0.0 < seconds[0] < 0.1 * found[0].seconds
