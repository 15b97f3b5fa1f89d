"""Detectors that lose contacts in one stage each, by a real mechanism, and explain themselves by deciding again."""

from typing import ClassVar

import numpy as np

from cdcore import Detection, Verdict, create_detector, triangles_intersect
from cdcore.protocol import Explanation
from cdcore.protocol.frame_detector import NoSettings


class Stage:
    """Decides frame by frame with ``meets``; what a subclass loses is in ``meets`` and in ``explain``."""

    name: ClassVar[str] = "stage"
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = NoSettings

    def __init__(self, bodies, pairs, settings):
        self.bodies, self.pairs, self.settings = bodies, pairs, settings

    def detect(self, motion, *, faces=False):
        verdict = np.array(
            [[self.verdict(motion, frame, pair) for pair in range(len(self.pairs))] for frame in range(len(motion))],
            dtype=np.uint8,
        ).reshape(len(motion), len(self.pairs))
        return Detection(self.name, tuple(b.name for b in self.bodies), self.pairs, motion.times, verdict)

    def stream(self, motions, *, faces=False):
        for motion in motions:
            yield self.detect(motion)

    def triangles(self, motion, frame, pair):
        """World corners (n, 3, 3) of both bodies."""
        return [
            self.bodies[k].mesh.triangles @ motion.rotations[frame, k].T + motion.translations[frame, k]
            for k in self.pairs[pair].tolist()
        ]


class SmallSpheres(Stage):
    """Its spheres have half the radius they need."""

    def spheres_meet(self, motion, frame, pair):
        a, b = (t.reshape(-1, 3) for t in self.triangles(motion, frame, pair))
        ca, cb = a.mean(axis=0), b.mean(axis=0)
        reach = np.linalg.norm(a - ca, axis=1).max() + np.linalg.norm(b - cb, axis=1).max()
        return np.linalg.norm(ca - cb) <= reach / 2

    def verdict(self, motion, frame, pair):
        met = self.spheres_meet(motion, frame, pair) and _any_meet(*self.triangles(motion, frame, pair))
        return Verdict.CONTACT if met else Verdict.CLEAR

    def explain(self, motion, frame, pair, faces):
        return Explanation(spheres_meet=self.spheres_meet(motion, frame, pair))


class EveryThird(Stage):
    """Samples every third face of each mesh and searches the sample wholly."""

    def verdict(self, motion, frame, pair):
        a, b = self.triangles(motion, frame, pair)
        return Verdict.CONTACT if _any_meet(a[::3], b[::3]) else Verdict.NOT_FOUND

    def explain(self, motion, frame, pair, faces):
        return Explanation(sample_meets=bool((faces % 3 == 0).all(axis=1).any()), found_with_more=False)


class Impatient(Stage):
    """Draws three pairs of faces; with thirty times more it has seen them all."""

    def found(self, motion, frame, pair, budget):
        a, b = self.triangles(motion, frame, pair)
        order = np.random.default_rng(frame).permutation(len(a) * len(b))[:budget]
        return bool(triangles_intersect(np.stack([a[order // len(b)], b[order % len(b)]], axis=1)).any())

    def verdict(self, motion, frame, pair):
        return Verdict.CONTACT if self.found(motion, frame, pair, 3) else Verdict.NOT_FOUND

    def explain(self, motion, frame, pair, faces):
        return Explanation(sample_meets=True, found_with_more=self.found(motion, frame, pair, 144))


class Stubborn(Stage):
    """Looks only at the two faces whose middles are nearest, whatever its budget."""

    def verdict(self, motion, frame, pair):
        a, b = self.triangles(motion, frame, pair)
        away = np.linalg.norm(a.mean(axis=1)[:, None] - b.mean(axis=1)[None], axis=-1)
        i, j = divmod(int(away.argmin()), len(b))
        return Verdict.CONTACT if triangles_intersect(np.stack([a[i], b[j]])[None])[0] else Verdict.NOT_FOUND

    def explain(self, motion, frame, pair, faces):
        return Explanation(sample_meets=True, found_with_more=False)


class Silent(Stubborn):
    """The same without a word about it."""

    explain = None

    def verdict(self, motion, frame, pair):
        found = super().verdict(motion, frame, pair)
        return Verdict.CLEAR if found == Verdict.NOT_FOUND else found


class Swept(Stage):
    """An oracle of intervals for bodies that only move along X by steps too long for instants: unit cubes."""

    def detect(self, motion, *, faces=False):
        exact = create_detector("exact", self.bodies, pairs=self.pairs).detect(motion)
        verdict = exact.verdict.copy()
        gap = motion.translations[:, self.pairs[:, 1], 0] - motion.translations[:, self.pairs[:, 0], 0]
        crossed = np.sign(gap[1:]) != np.sign(gap[:-1])
        touched = (exact.verdict[1:] == Verdict.CONTACT) | (exact.verdict[:-1] == Verdict.CONTACT)
        verdict[1:][crossed | touched] = Verdict.CONTACT
        return Detection("swept", exact.names, self.pairs, motion.times, verdict, "intervals")


def _any_meet(a, b):
    i, j = np.meshgrid(np.arange(len(a)), np.arange(len(b)), indexing="ij")
    return bool(triangles_intersect(np.stack([a[i.ravel()], b[j.ravel()]], axis=1)).any())
