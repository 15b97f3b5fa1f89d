"""Sessions of the experiments, made once per test run, and the geometry that checks their truth from the poses."""

from functools import lru_cache

import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_inverse, rotated
from sessions.glassware.catalogue import made_instrument
from sessions.synthetic.scenes import make_scene_session


class Made:
    """One session, its truth, and its poses by name on the truth's clock."""

    def __init__(self, name: str, noise: str, seed: int) -> None:
        self.session, self.truth = make_scene_session(name, seed=seed, noise=noise, faces=600)
        frames = self.session.frames
        self.times = self.truth.seconds_of(frames.stamp_ns)
        self.poses = {
            body: (frames.position[:, column], frames.quaternion_xyzw[:, column])
            for column, body in enumerate(frames.names)
        }

    def facts(self, kind: str):
        return [fact for fact in self.truth.facts if fact.kind == kind]

    def pose(self, body: str):
        if body in self.poses:
            return self.poses[body]
        fixed = self.session.scene.body(body).fixed
        count = len(self.times)
        return np.tile(fixed.position, (count, 1)), np.tile(fixed.quaternion_xyzw, (count, 1))

    def point(self, body: str, local):
        """A point of a body's frame in the world, (n, 3)."""
        position, quaternion = self.pose(body)
        return position + rotated(quaternion, np.asarray(local))

    def within(self, body: str, points):
        """World points (n, 3) in a body's frame."""
        position, quaternion = self.pose(body)
        return rotated(quaternion_inverse(quaternion), points - position)

    def cavity(self, body: str):
        return self.vessel(body).table

    def vessel(self, body: str):
        """The cavity that a body's instrument brings."""
        declared = self.session.scene.body(body)
        return made_instrument(declared.instrument, declared.extra["faces"]).cavity

    def near(self, start: float, end: float):
        return (self.times >= start) & (self.times <= end)


@lru_cache(maxsize=16)
def _made(name: str, noise: str, seed: int) -> Made:
    return Made(name, noise, seed)


@pytest.fixture(scope="session")
def made():
    def make(name: str, noise: str = "off", seed: int = 0) -> Made:
        return _made(name, noise, seed)

    return make


def kept_by_counting(cavity, down, count: int = 400):
    """Millilitres (n,) kept with gravity along ``down`` (n, 3): points counted in the cones from a middle to each face.

    No formula and no library in common with the code under test.
    """
    corners, middle = cavity.to_brim.vertices[cavity.to_brim.faces], np.array(cavity.opening.centre) / 2.0
    sides = corners - middle
    volume = np.linalg.det(sides) / 6.0 * 1e6
    shift = np.random.default_rng(1).random((len(sides), 1, 3))
    # An evenly spread sequence, shifted in each cone: Roberts, The unreasonable effectiveness of quasirandom sequences.
    spread = (np.arange(count)[:, None] * np.array([0.8191725134, 0.6710436067, 0.5497004779]) + shift) % 1.0
    points = middle + np.diff(np.sort(spread), prepend=0.0) @ sides
    rim = cavity.to_brim.vertices[cavity.to_brim.vertices[:, 1] > cavity.opening.lip[1] - 1e-6]
    return np.array([float(((points @ way > (rim @ way).max()).mean(axis=1) * volume).sum()) for way in down])


def tilt_of(quaternions):
    """Angle (n,) of a body's Y axis from the vertical, radians."""
    return np.arccos(np.clip(rotated(quaternions, np.array([0.0, 1.0, 0.0]))[:, 1], -1.0, 1.0))


@pytest.fixture(scope="session")
def counted():
    return kept_by_counting


@pytest.fixture(scope="session")
def check_pour():
    return _check_pour


def _check_pour(run: Made, fact, before: float) -> None:
    """The recorded tilt lets the liquid out from the stated time on, as much as stated, into what is stated."""
    source, cavity = fact.values["source"], run.cavity(fact.values["source"])
    turn = run.pose(source)[1]
    tilt, down = tilt_of(turn), rotated(quaternion_inverse(turn), np.array([0.0, -1.0, 0.0]))
    during = run.near(fact.start - 3.0, fact.end + 0.3)
    kept = kept_by_counting(run.vessel(source), down[during])
    times = run.times[during]
    step = np.diff(run.times).max()
    assert abs(times[np.argmax(kept < before)] - fact.start) < 2.0 * step + 0.02
    assert before - kept.min() == pytest.approx(fact.values["volume_ml"], rel=0.02)
    assert times[np.argmax(tilt[during] > tilt[during].max() - 1e-4)] == pytest.approx(fact.end, abs=0.15)
    if fact.kind == "pour":
        target = fact.values["target"]
        spot = run.within(target, run.point(source, cavity["lip"]))[run.near(fact.start, fact.end)]
        assert np.hypot(spot[:, 0], spot[:, 2]).max() < run.cavity(target)["opening_radius"]
        assert spot[:, 1].min() > run.cavity(target)["opening"][1]
    else:
        for body in ("water", "acid"):
            spot = run.within(body, run.point(source, cavity["lip"]))[run.near(fact.start, fact.end)]
            if body != source:
                assert np.hypot(spot[:, 0], spot[:, 2]).min() > run.cavity(body)["opening_radius"]
