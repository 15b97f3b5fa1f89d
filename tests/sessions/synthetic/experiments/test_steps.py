import numpy as np
import pytest

from sessions.geometry.rotations import IDENTITY, quaternion_about
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import BENCH_TOP, Placed, standing
from sessions.synthetic.experiments.lab import SNAP, SPOUT_LEFT, Lab, layout_of
from sessions.synthetic.experiments.pouring import GRAVITY
from sessions.synthetic.experiments.practice import make_practice
from sessions.synthetic.experiments.steps import pour
from sessions.synthetic.experiments.things import Falling, Held, Standing, placed_by

GLASS_AT = standing(0.1, 0.15)


@pytest.fixture(scope="module")
def layout():
    placed = {
        "from": Placed("beaker_50", standing(0.1, 0.02), SPOUT_LEFT),
        "into": Placed("beaker_100", standing(-0.08, 0.0)), "rod": Placed("stirring_rod", standing(0.3, 0.0)),
        "glass": Placed("beaker_50", GLASS_AT, SPOUT_LEFT),
    }  # fmt: skip
    return layout_of(placed, (0.034, 0.034), 600)


@pytest.fixture
def lab(layout):
    return Lab("test", layout, Recording(seconds=600.0, noise="vive", seed=1))


def test_a_pour_moves_liquid_and_nothing_is_lost(lab):
    lab.volumes.update({"from": 30.0, "into": 40.0})
    lab.grasp("right", "from", (0.0, 0.05, 0.0))
    pour(lab, "right", "into", 12.0)
    assert (lab.volumes["from"], lab.volumes["into"]) == (18.0, 52.0)
    assert set(lab.things) == {"from", "into", "rod", "glass"}, "hands and what stands for good are no things"
    fact = lab.last("pour")
    assert fact.start < fact.end and fact.values["volume_ml"] == 12.0
    assert fact.values["onset_tilt_deg"] < fact.values["greatest_tilt_deg"] < 90.0
    pour(lab, "right", "into", 2.0, beside=0.08)
    assert (lab.volumes["from"], lab.volumes["into"]) == (16.0, 52.0)
    assert lab.last("spill").bodies == ("from",)
    assert lab.last("spill").values["onset_tilt_deg"] == fact.values["greatest_tilt_deg"]


def test_more_than_there_is_cannot_be_poured(lab):
    lab.volumes["from"] = 5.0
    lab.grasp("right", "from", (0.0, 0.05, 0.0))
    with pytest.raises(ValueError, match="cannot keep"):
        pour(lab, "right", "into", 12.0)


TIMES = np.linspace(0.0, 10.0, 1001)
TURN = tuple(quaternion_about((0.0, 1.0, 0.0), 1.2).tolist())
HANDS = {"hand-left": (np.stack([TIMES, np.ones(1001), np.zeros(1001)], axis=1), np.tile(TURN, (1001, 1)))}


def test_each_phase_lasts_until_the_next_begins():
    held, falls = Held("hand-left", (0.0, -0.1, 0.0), IDENTITY), Falling(6.0, (6.0, 0.9, 0.0), TURN, 0.5)
    phases = [(0.0, Standing((0.0, 0.9, 0.0), IDENTITY)), (2.0, held), (6.0, falls)]
    position, quaternion = placed_by(phases, TIMES, HANDS)
    assert (position[TIMES < 2.0] == (0.0, 0.9, 0.0)).all()
    held = (TIMES >= 2.0) & (TIMES < 6.0)
    np.testing.assert_allclose(position[held, 0], TIMES[held])
    np.testing.assert_allclose(position[held, 1], 0.9)
    np.testing.assert_allclose(quaternion[held], np.tile(TURN, (held.sum(), 1)))
    assert (position[-1] == (6.0, 0.5, 0.0)).all()


def test_a_fall_is_free_and_ends_on_the_floor():
    fall = Falling(1.0, (0.0, 1.4, 0.0), IDENTITY, 0.9)
    position, _ = fall(TIMES, {})
    y = position[:, 1]
    flying = (TIMES > 1.0) & (fall.time_at(0.9) - 0.02 > TIMES)
    assert np.diff(y[flying], 2) == pytest.approx(-GRAVITY * 0.01**2, rel=1e-6)
    assert fall.speed_at(0.9) == pytest.approx(np.sqrt(2.0 * GRAVITY * 0.5))
    assert fall.time_at(0.9) == pytest.approx(1.0 + fall.speed_at(0.9) / GRAVITY)
    assert (y[fall.time_at(0.9) < TIMES] == 0.9).all()


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
    assert (glass[0][before] == GLASS_AT).all()
    np.testing.assert_allclose(glass[0][held][0], np.array(GLASS_AT) + SNAP * np.array([0.0, 1.0, 0.0]), atol=1e-9)
    offset = glass[0][held] - hand[0][held]
    np.testing.assert_allclose(offset, np.broadcast_to(offset[0], offset.shape), atol=1e-9)
    np.testing.assert_allclose(glass[0][after], np.broadcast_to(standing(-0.05, 0.1), (after.sum(), 3)), atol=1e-12)
    assert glass[0][held][:, 1].min() > BENCH_TOP + SNAP


def test_a_dropped_thing_lands_in_contact_and_breaks_when_fast_enough(lab):
    lab.grasp("left", "glass", (0.0, 0.05, 0.0))
    lab.carry("left", (0.1, BENCH_TOP + 0.3, 0.0))
    lab.drop("left", threshold_speed=1.5)
    speed = np.sqrt(2.0 * 9.80665 * 0.3)
    assert lab.last("break").values["speed_m_s"] == pytest.approx(speed)
    assert 0.5 < lab.hands["left"].now + lab.late - lab.last("drop").end < 1.0, "the hand waits for what it sees"
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


def test_hands_are_not_lost_while_they_hold(lab):
    lab.grasp("right", "glass", (0.0, 0.05, 0.0))
    lab.place("right", GLASS_AT)
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
