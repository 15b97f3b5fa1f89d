"""Detectors with one planted fault each, so that an audit can be held against what was planted.

They are named on a command line as ``support.planted_detectors:Dropping``, as a user's own detector would be.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from cdcore import FrameDetector, Motion, Verdict, create_detector, join
from cdcore.protocol import Explanation, counts_as_contact
from cdcore.protocol.pair_detector import NoSettings


class Planted:
    """The exact detector, its verdicts then spoilt by ``spoil``; reports no faces."""

    name = "planted"
    online = False
    Settings = NoSettings

    def __init__(self, bodies, pairs, settings):
        self.settings = settings
        self._exact = create_detector("exact", bodies, pairs=pairs)

    def detect(self, motion, *, faces=False):
        return self.spoilt(self._exact.detect(motion))

    def stream(self, motions, *, faces=False):
        yield self.spoilt(join([self._exact.detect(piece) for piece in motions]))

    def spoilt(self, detection):
        contact = self.spoil(counts_as_contact(detection.verdict))
        verdict = np.where(contact, np.uint8(Verdict.CONTACT), np.uint8(Verdict.CLEAR))
        verdict[detection.verdict == Verdict.NO_POSE] = Verdict.NO_POSE
        return replace(detection, detector=self.name, verdict=verdict)

    @staticmethod
    def spoil(contact):
        """Returns the contact that the detector reports where this one is true: (T, P), frames by pairs."""
        return contact


class Dropping(Planted):
    """Loses every 7th frame of contact of each pair."""

    @staticmethod
    def spoil(contact):
        for column in contact.T:
            column[np.flatnonzero(column)[6::7]] = False
        return contact


class Late(Planted):
    """Says everything three frames late."""

    @staticmethod
    def spoil(contact):
        late = np.zeros_like(contact)
        late[3:] = contact[:-3]
        return late


class Inventing(Planted):
    """Adds a contact of two frames at frames 100, 200, ... of the first pair, where there is none within a frame."""

    @staticmethod
    def spoil(contact):
        near = contact[:, 0].copy()
        for frame in range(100, len(contact) - 3, 100):
            if not near[frame - 1 : frame + 3].any():
                contact[frame : frame + 2, 0] = True
        return contact


class Blind(Planted):
    """Reports no contact of the last pair."""

    @staticmethod
    def spoil(contact):
        contact[:, -1] = False
        return contact


@dataclass(frozen=True)
class Blame:
    """The stage that lost every contact."""

    stage: str = ""


class Blamed(Planted):
    """Never says contact, and explains that by one stage wherever faces meet."""

    Settings = Blame
    STAGES: ClassVar = {
        "spheres": Explanation(spheres_meet=False),
        "sample": Explanation(sample_meets=False, found_with_more=False),
        "budget": Explanation(sample_meets=True, found_with_more=True),
        "search": Explanation(sample_meets=True, found_with_more=False),
    }

    @staticmethod
    def spoil(contact):
        return np.zeros_like(contact)

    def explain(self, motion, frame, pair, faces):
        return self.STAGES.get(self.settings.stage, Explanation()) if len(faces) else Explanation()


class Distracted(Planted):
    """Never looks at the first pair where there are others."""

    @staticmethod
    def spoil(contact):
        contact[:, 0] &= contact.shape[1] == 1
        return contact


class Swept(Planted):
    """Adds contact where the two bodies pass each other between frames; both move along X alone."""

    def detect(self, motion, *, faces=False):
        exact = self._exact.detect(motion)
        contact = exact.verdict == Verdict.CONTACT
        side = np.sign(np.diff(motion.translations[:, :, 0], axis=1))
        contact[1:] |= contact[:-1] | (side[1:] != side[:-1])
        verdict = np.where(contact, np.uint8(Verdict.CONTACT), exact.verdict)
        return replace(exact, detector="swept", verdict=verdict, covers="intervals")

    def stream(self, motions, *, faces=False):
        yield from map(self.detect, motions)


class Undecided(FrameDetector):
    """Decides nothing."""

    def look(self, rotations, translations):
        return [Verdict.UNRESOLVED] * len(self.pairs)


@dataclass(frozen=True)
class Script:
    """A letter a frame: n CLEAR, c CONTACT, u UNRESOLVED; CLEAR beyond the last."""

    says: str = ""


class Scripted(FrameDetector):
    """Says of every pair what is written."""

    Settings = Script
    WORDS: ClassVar = {"n": Verdict.CLEAR, "c": Verdict.CONTACT, "u": Verdict.UNRESOLVED}

    def prepare(self):
        self._left = iter(self.settings.says)

    def look(self, rotations, translations):
        return [self.WORDS[next(self._left, "n")]] * len(self.pairs)


class Raising(FrameDetector):
    """Fails in the frame in which anything is nearer than 1.0 m."""

    def look(self, rotations, translations):
        a, b = self.pairs.T
        return [1.0 / (abs(x) > 1.0) < 0 for x in (translations[a] - translations[b])[:, 0].tolist()]


class Unmade(Undecided):
    """Fails when it is made."""

    def __init__(self, bodies, pairs, settings):
        raise KeyError("radius")


class FiveLate(FrameDetector):
    """Answers exactly, bodies inside others included, and five frames late, as an engine with a queue does."""

    def prepare(self):
        self._exact = create_detector("exact", self.bodies, pairs=self.pairs)
        self._queue = [np.zeros(len(self.pairs), dtype=bool)] * 5

    def look(self, rotations, translations):
        now = Motion([0.0], translations[None], rotations[None])
        self._queue.append(counts_as_contact(self._exact.detect(now).verdict[0]))
        return self._queue.pop(0)
