"""Detectors that lose contacts in one stage each, by a real mechanism, and explain themselves by deciding again."""

import numpy as np

from cdcore import Detection, Verdict, create_detector, triangles_intersect
from cdcore.protocol import Explanation
from cdcore.protocol.frame_detector import NoSettings


class Stage:
    """Decides frame by frame whether the triangles ``looked_at`` meet, and answers ``nothing`` where they do not."""

    name = "stage"
    online = False
    Settings = NoSettings
    nothing = Verdict.NOT_FOUND
    explanation = Explanation(sample_meets=True, found_with_more=False)

    def __init__(self, bodies, pairs, settings):
        self.bodies, self.pairs, self.settings = bodies, pairs, settings

    def detect(self, motion, *, faces=False):
        verdict = np.full((len(motion), len(self.pairs)), self.nothing, dtype=np.uint8)
        for frame, pair in np.ndindex(verdict.shape):
            if self.meets(motion, frame, pair):
                verdict[frame, pair] = Verdict.CONTACT
        return Detection(self.name, tuple(b.name for b in self.bodies), self.pairs, motion.times, verdict)

    def stream(self, motions, *, faces=False):
        for motion in motions:
            yield self.detect(motion)

    def meets(self, motion, frame, pair):
        return bool(triangles_intersect(self.looked_at(*self.triangles(motion, frame, pair))).any())

    def triangles(self, motion, frame, pair):
        """World corners (n, 3, 3) of both bodies."""
        return [
            self.bodies[k].mesh.triangles @ motion.rotations[frame, k].T + motion.translations[frame, k]
            for k in self.pairs[pair].tolist()
        ]

    def looked_at(self, a, b):
        """Pairs of triangles (k, 2, 3, 3): all of them."""
        return np.stack([np.repeat(a, len(b), axis=0), np.tile(b, (len(a), 1, 1))], axis=1)

    def explain(self, motion, frame, pair, faces):
        return self.explanation


class SmallSpheres(Stage):
    """Its spheres have half the radius they need."""

    nothing = Verdict.CLEAR

    def spheres_meet(self, motion, frame, pair):
        corners = [t.reshape(-1, 3) for t in self.triangles(motion, frame, pair)]
        middles = [part.mean(axis=0) for part in corners]
        reach = sum(np.linalg.norm(part - middle, axis=1).max() for part, middle in zip(corners, middles, strict=True))
        return np.linalg.norm(middles[0] - middles[1]) <= reach / 2

    def meets(self, motion, frame, pair):
        return self.spheres_meet(motion, frame, pair) and super().meets(motion, frame, pair)

    def explain(self, motion, frame, pair, faces):
        return Explanation(spheres_meet=self.spheres_meet(motion, frame, pair))


class EveryThird(Stage):
    """Samples every third face of each mesh and searches the sample wholly."""

    def looked_at(self, a, b):
        return super().looked_at(a[::3], b[::3])

    def explain(self, motion, frame, pair, faces):
        return Explanation(sample_meets=bool((faces % 3 == 0).all(axis=1).any()), found_with_more=False)


class Impatient(Stage):
    """Draws three pairs of faces; with thirty times more it has seen them all."""

    def meets(self, motion, frame, pair, budget=3):
        both = self.looked_at(*self.triangles(motion, frame, pair))
        drawn = np.random.default_rng(frame).permutation(len(both))[:budget]
        return bool(triangles_intersect(both[drawn]).any())

    def explain(self, motion, frame, pair, faces):
        return Explanation(sample_meets=True, found_with_more=self.meets(motion, frame, pair, 144))


class Stubborn(Stage):
    """Looks only at the two faces whose middles are nearest, whatever its budget."""

    def looked_at(self, a, b):
        both = super().looked_at(a, b)
        middles = both.mean(axis=2)
        nearest = np.linalg.norm(middles[:, 0] - middles[:, 1], axis=1).argmin()
        return both[nearest : nearest + 1]


class Silent(Stubborn):
    """The same without a word about it."""

    explain = None
    nothing = Verdict.CLEAR


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
