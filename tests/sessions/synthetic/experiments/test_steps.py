import numpy as np
import pytest

from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import Placed, standing
from sessions.synthetic.experiments.lab import Lab, layout_of
from sessions.synthetic.experiments.pouring import GRAVITY
from sessions.synthetic.experiments.practice import make_practice
from sessions.synthetic.experiments.steps import pour
from sessions.synthetic.things import Falling

SPOUT_LEFT = (0.0, 1.0, 0.0, 0.0)
GLASS_AT = standing(0.1, 0.15)
TIMES = np.linspace(0.0, 10.0, 1001)


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


def test_a_session_holds_the_touches_and_near_misses_that_were_asked_for():
    session, truth = make_practice((0.02, 0.25), 3, pseudonym="S09", seed=2, noise="off")
    lengths = [episode.nominal[1] - episode.nominal[0] for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose(lengths, [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3
    assert session.facts["pseudonym"] == "S09"


def test_a_fall_is_free_and_ends_on_the_floor():
    fall = Falling(1.0, (0.0, 1.4, 0.0), IDENTITY, 0.9)
    position, _ = fall(TIMES, {})
    y = position[:, 1]
    flying = (TIMES > 1.0) & (fall.time_at(0.9) - 0.02 > TIMES)
    assert np.diff(y[flying], 2) == pytest.approx(-GRAVITY * 0.01**2, rel=1e-6)
    assert fall.speed_at(0.9) == pytest.approx(np.sqrt(2.0 * GRAVITY * 0.5))
    assert fall.time_at(0.9) == pytest.approx(1.0 + fall.speed_at(0.9) / GRAVITY)
    assert (y[fall.time_at(0.9) < TIMES] == 0.9).all()
