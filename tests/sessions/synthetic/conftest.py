"""Made-up sessions, made once per test run, and what finds their truth again: an engine, and the recorded poses."""

from functools import lru_cache

import numpy as np
import pytest
from support.small_worlds import make_analytic

from cdcore import create_detector
from replay.prepare.assemble import assemble
from sessions.geometry.rotations import quaternion_inverse, rotated_vectors
from sessions.glassware.catalogue import made_instrument
from sessions.synthetic.crowded import NAME, make_crowded_lab
from sessions.synthetic.scenes import SCENES, make_scene_session


def _verdicts(session, pairs):
    """Verdicts (T, P) of the complete detector for the named pairs."""
    assembly = assemble(session)
    numbers = [(assembly.names.index(a), assembly.names.index(b)) for a, b in pairs]
    detection = create_detector("hybrid", assembly.bodies, pairs=numbers).detect(assembly.motion)
    order = {tuple(sorted(pair)): k for k, pair in enumerate(detection.pairs.tolist())}
    return detection.verdict[:, [order[tuple(sorted(pair))] for pair in numbers]]


@pytest.fixture(scope="session")
def verdicts():
    return _verdicts


class Made:
    """One session, its truth, and its poses by name on the truth's clock."""

    def __init__(self, name: str, noise: str = "off", seed: int = 0) -> None:
        if name in SCENES:
            self.session, self.truth = make_scene_session(name, seed, noise=noise, faces=600)
        elif name == NAME:
            self.session, self.truth = make_crowded_lab(seed, noise=noise, faces=500, seconds=2.0)
        else:
            jitter = "even" if noise == "off" else "browser"
            self.session, self.truth = make_analytic(name, seconds=8.0, noise=noise, jitter=jitter)
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
        return position + rotated_vectors(quaternion, np.asarray(local))

    def within(self, body: str, points):
        """World points (n, 3) in a body's frame."""
        position, quaternion = self.pose(body)
        return rotated_vectors(quaternion_inverse(quaternion), points - position)

    def cavity(self, body: str):
        return self.vessel(body).table

    def vessel(self, body: str):
        """The cavity that a body's instrument brings."""
        declared = self.session.scene.body(body)
        return made_instrument(declared.instrument, declared.extra["faces"]).cavity

    def near(self, start: float, end: float):
        return (self.times >= start) & (self.times <= end)


@pytest.fixture(scope="session")
def made():
    """A function that makes each session once, by name, noise and seed."""
    sessions = lru_cache(maxsize=32)(Made)
    return lambda name, noise="off", seed=0: sessions(name, noise, seed)
