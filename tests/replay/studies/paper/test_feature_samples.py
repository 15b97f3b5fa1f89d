"""Coverage and search misses are counted from the truth, samples of frames cover as they say."""

from itertools import pairwise

import numpy as np
import pytest

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.protocol import counts_as_contact
from replay.studies.paper.feature_samples import (
    ALL,
    DRAWS,
    EXPECTED,
    LIMIT,
    SEARCHERS,
    SIZES,
    expected_evaluations,
    feature_sample_tables,
    growth,
    least_evaluations,
    pace_of,
    search_samples,
)
from replay.studies.paper.frame_sampling import STEPS, Sampled, frame_sampling_table, held_to, sample_frames
from sessions.geometry.shapes import make_shape


@pytest.fixture(scope="module")
def drawn():
    parts = (("torus-sphere", 0), ("torus-sphere", 1), ("beaker-flask", 0))
    return [search_samples(family, draw, 40, 0) for family, draw in parts]


@pytest.mark.slow
def test_all_faces_cover_every_pose_and_smaller_samples_fewer(drawn):
    for one in drawn:
        counts = [one.meeting[size] for size in SIZES]
        assert all(count > 0 for count in counts[-1])
        for few, more in pairwise(counts):
            assert all(a <= b for a, b in zip(few, more, strict=True))
        assert sum(counts[0]) < sum(counts[-1]) / 10


@pytest.mark.slow
def test_searches_are_asked_about_covered_poses_only_and_say_none_where_they_gave_up(drawn):
    for one in drawn:
        assert set(one.spent) == {(searcher, size) for searcher in SEARCHERS for size in SIZES}
        for (_, size), spent in one.spent.items():
            assert len(spent) == sum(count > 0 for count in one.meeting[size])
            assert all(hit is None or 0 < hit <= LIMIT for hit in spent)


def test_nine_in_ten_are_reached_by_the_ninth_of_ten():
    assert least_evaluations([5, 1, 2, 3, 4, 6, 7, 8, 9, None], 10) == 9
    assert least_evaluations([5, 1, 2, 3, 4, 6, 7, 8, None, None], 10) is None
    assert least_evaluations([], 0) is None and least_evaluations([1, 2], 10) is None


def test_random_pairs_take_as_many_evaluations_as_computed():
    # one chance p: 1 - (1 - p)^n reaches 0.9 at n = log 0.1 / log(1 - p)
    assert expected_evaluations([0.01]) == int(np.ceil(np.log(0.1) / np.log(0.99)))
    assert expected_evaluations([1.0, 1.0]) == 1
    assert expected_evaluations([]) is None and expected_evaluations([0.1, 0.0]) is None
    rng = np.random.default_rng(0)
    chances = rng.uniform(0.001, 0.05, size=4000)
    spent = rng.geometric(chances)
    assert np.quantile(spent, 0.9) == pytest.approx(expected_evaluations(chances), rel=0.1)


def test_the_exponent_of_a_square_is_two():
    assert growth({100: 50, 200: 200, 400: 800, 800: None}) == (100, 50, 400, 800, pytest.approx(2.0))
    assert growth({100: 5, 200: None}) == (None,) * 5


@pytest.mark.slow
def test_the_three_tables_have_a_row_for_every_family_and_size(drawn):
    coverage, search, grown = feature_sample_tables(drawn, pace_of(drawn))
    assert len(coverage.rows) == 2 * len(SIZES) and len(search.rows) == 2 * len(SIZES) * (1 + len(SEARCHERS))
    for row in coverage.rows:
        assert row[3] == round(row[4] * row[2]) and row[5] <= row[4] <= row[6]
    whole = [row for row in search.rows if row[2] == ALL and row[1] != EXPECTED]
    assert all(row[3] == coverage.rows[0][2] for row in whole if row[0] == "torus-sphere")
    for row in search.rows:
        if row[5] is not None:
            assert row[6] <= row[5] <= row[7] and row[4] == round(row[5] * row[3])
    assert set(grown.column("search")) == {EXPECTED, *SEARCHERS}


@pytest.mark.slow
def test_draws_share_the_colliding_poses_among_them(drawn):
    sizes = [len(one.meeting[None]) for one in drawn[:2]]
    assert max(sizes) - min(sizes) <= 1 and sum(sizes) < 40 and DRAWS > 1


TIMES = np.arange(12) / 10.0


def touching(*frames):
    table = np.zeros((12, 1), dtype=bool)
    table[list(frames)] = True
    return table


@pytest.mark.parametrize(
    ("looks", "missed", "lost"),
    [
        ((1, 0), 0, 0.05), ((2, 0), 0, 0.05), ((2, 1), 0, 0.15), ((4, 0), 0, 0.05), ((4, 1), 0, 0.15),
        ((4, 2), 0, 0.25), ((4, 3), 1, 0.25),
    ],
)  # fmt: skip
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


@pytest.mark.slow
def test_the_brief_half_of_the_bumps_is_missed_in_part_and_more_with_fewer_looks():
    found = sample_frames(0)
    means = [np.mean(one.missed) for one in found]
    assert means == sorted(means) and means[0] == 0.0 and means[-1] > 3.0
    seconds = [np.mean(one.missed_seconds) for one in found]
    assert seconds == sorted(seconds) and 0.0 < seconds[0] < 0.1 * found[0].seconds
