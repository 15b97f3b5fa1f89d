"""Sessions of the experiments, made once per test run, and the geometry that checks their truth from the poses."""

from functools import lru_cache

import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_inverse, rotated
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
        return self.session.scene.body(body).extra["cavity"]

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


def kept_by_counting(tilt: float, radius: float, height: float, count: int = 400) -> float:
    """Volume a tilted cylinder keeps, by adding up columns: no formula in common with the code under test."""
    x = (np.arange(count) + 0.5) / count * 2.0 * radius - radius
    chord = 2.0 * np.sqrt(radius**2 - x**2)
    level = np.clip(height - (radius - x) * np.tan(tilt), 0.0, height)
    return float((chord * level).sum() * 2.0 * radius / count)


def tilt_of(quaternions):
    """Angle (n,) of a body's Y axis from the vertical, radians."""
    return np.arccos(np.clip(rotated(quaternions, np.array([0.0, 1.0, 0.0]))[:, 1], -1.0, 1.0))


@pytest.fixture(scope="session")
def check_pour():
    return _check_pour


def _check_pour(run: Made, fact, before: float) -> None:
    """The recorded tilt lets the liquid out from the stated time on, as much as stated, into what is stated."""
    source, cavity = fact.values["source"], run.cavity(fact.values["source"])
    tilt = tilt_of(run.pose(source)[1])
    during = run.near(fact.start - 3.0, fact.end + 0.3)
    kept = np.array([kept_by_counting(angle, cavity["radius"], cavity["height"]) * 1e6 for angle in tilt[during]])
    times = run.times[during]
    step = np.diff(run.times).max()
    assert abs(times[np.argmax(kept < before)] - fact.start) < 2.0 * step + 0.02
    assert before - kept.min() == pytest.approx(fact.values["volume_ml"], rel=0.01)
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
