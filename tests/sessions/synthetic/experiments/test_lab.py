import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_about, rotated
from sessions.synthetic.assembly import START_NS, Recording
from sessions.synthetic.bench import BENCH_TOP, Placed, standing
from sessions.synthetic.experiments.lab import SNAP, SPOUT_LEFT, Lab, layout_of
from sessions.synthetic.experiments.practice import make_practice
from sessions.synthetic.experiments.things import placed_by


@pytest.fixture(scope="module")
def layout():
    return layout_of({"glass": Placed("beaker_50", standing(0.1, 0.0), SPOUT_LEFT)}, (0.034, 0.034), 600)


@pytest.fixture
def lab(layout):
    return Lab("test", layout, Recording(seconds=600.0, noise="vive", seed=1))


def poses(lab, side="right"):
    times = np.arange(0.0, lab.together() + 1.0, 1.0 / 90.0)
    hands = {f"hand-{s}": lab.hands[s].path()(times - lab.late) for s in ("left", "right")}
    return times, hands[f"hand-{side}"], placed_by(lab.things["glass"], times, hands)


def test_a_grasped_thing_snaps_rides_and_is_put_down_exactly(lab):
    lab.grasp("right", "glass", (0.0, 0.05, 0.0))
    lab.carry("right", (0.0, 1.1, 0.1))
    lab.place("right", standing(-0.05, 0.1))
    times, hand, glass = poses(lab)
    grasp, release = lab.last("grasp").start, lab.last("release").start
    before, after = times < grasp, times >= release
    held = ~before & ~after
    assert (glass[0][before] == standing(0.1, 0.0)).all()
    np.testing.assert_allclose(
        glass[0][held][0], np.array(standing(0.1, 0.0)) + SNAP * np.array([0.0, 1.0, 0.0]), atol=1e-9
    )
    offset = glass[0][held] - hand[0][held]
    np.testing.assert_allclose(offset, np.broadcast_to(offset[0], offset.shape), atol=1e-9)
    np.testing.assert_allclose(glass[0][after], np.broadcast_to(standing(-0.05, 0.1), (after.sum(), 3)), atol=1e-12)
    assert glass[0][held][:, 1].min() > BENCH_TOP + SNAP


def test_a_carried_thing_gets_where_it_is_sent_turned_as_asked(lab):
    lab.grasp("right", "glass", (0.0, 0.05, 0.0))
    turn = quaternion_about((0.0, 0.0, 1.0), 0.5)
    lab.carry("right", (0.0, 1.2, 0.1), quaternion=turn)
    lab.hands["right"].wait(0.5)
    _, _, glass = poses(lab)
    np.testing.assert_allclose(glass[0][-1], (0.0, 1.2, 0.1), atol=1e-9)
    up = rotated(turn, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(rotated(glass[1][-1], np.array([0.0, 1.0, 0.0])), up, atol=1e-9)


def test_a_dropped_thing_lands_in_contact_and_breaks_when_fast_enough(lab):
    lab.grasp("left", "glass", (0.0, 0.05, 0.0))
    lab.carry("left", (0.1, BENCH_TOP + 0.3, 0.0))
    lab.drop("left", threshold_speed=1.5)
    speed = np.sqrt(2.0 * 9.80665 * 0.3)
    assert lab.last("break").values["speed_m_s"] == pytest.approx(speed)
    (episode,) = lab.episodes
    assert episode.pair == ("bench", "glass")
    assert episode.nominal[0] == pytest.approx(lab.last("drop").end)
    _, _, glass = poses(lab, "left")
    assert glass[0][-1][1] < BENCH_TOP


def test_a_slow_drop_breaks_nothing(lab):
    lab.grasp("left", "glass", (0.0, 0.05, 0.0))
    lab.carry("left", (0.1, BENCH_TOP + 0.05, 0.0))
    lab.drop("left", threshold_speed=1.5)
    assert not [fact for fact in lab.facts if fact.kind == "break"]


def test_tasks_stages_and_features_become_intervals(lab):
    lab.stage("virtual reality")
    with lab.task("look"):
        lab.wait(5.0)
    lab.stage("perceptual interaction")
    with lab.task("take"):
        lab.grasp("right", "glass", (0.0, 0.05, 0.0))
        lab.place("right", standing(0.1, 0.0))
    lab.finish(60.0)
    found = {(span.kind, span.name): (span.start_ns - START_NS, span.end_ns - START_NS) for span in lab.intervals}
    assert found["task", "look"] == (0, 5 * 10**9)
    assert found["stage", "virtual reality"] == (0, 5 * 10**9)
    assert found["stage", "perceptual interaction"][1] == 60 * 10**9
    assert found["feature", "immersion"] == (0, 60 * 10**9)
    assert found["feature", "conception"] == found["stage", "virtual reality"]
    held = lab.last("hold")
    assert found["feature", "interactivity"][0] == round(held.start * 1e9)


def test_hands_are_not_lost_while_they_hold(lab):
    lab.grasp("right", "glass", (0.0, 0.05, 0.0))
    lab.place("right", standing(0.1, 0.0))
    held = lab.last("hold")
    assert any(start < held.start and held.end < end for start, end in lab.keep["right"])


def test_a_session_holds_the_touches_and_near_misses_that_were_asked_for():
    session, truth = make_practice((0.02, 0.25), 3, pseudonym="S09", seed=2, noise="off")
    lengths = [episode.nominal[1] - episode.nominal[0] for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose(lengths, [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3
    assert session.facts["pseudonym"] == "S09"


def test_a_careful_student_touches_nothing():
    _, truth = make_practice(seed=4)
    assert [episode for episode in truth.episodes if episode.nominal] == []
    assert len([fact for fact in truth.facts if fact.kind == "grasp"]) == 1


def test_the_same_arguments_give_the_same_session():
    one, other = (make_practice((0.1,), 1, seed=6)[0] for _ in range(2))
    assert one.names == other.names
    for a, b in zip(one.source.blocks(4096), other.source.blocks(4096), strict=True):
        assert np.array_equal(a.position, b.position, equal_nan=True)
