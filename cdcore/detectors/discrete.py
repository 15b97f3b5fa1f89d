"""Fixed time steps: tests every pair at its ticks, as a live engine does, and sees nothing between them."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar, Final

import numpy as np

from cdcore.bounding.sphere import SPHERES
from cdcore.broad.broad_looks import LivePairs
from cdcore.broad.broad_phase import BroadPhase
from cdcore.detectors import FCL, PAPER
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.sections.section_source import Pose, section_of_faces
from cdcore.numerics import BoolArray, ByteArray, FloatArray, Int32Array, IntArray
from cdcore.protocol import NO_FACES, Body, Detection, Explanation, FaceSets, Motion, PairDetector, Verdict
from cdcore.protocol.blocks import HeldVerdicts, looks_at, looks_of, pair_has_pose
from cdcore.protocol.detection import SectionSource
from cdcore.protocol.live import Live, LiveHeld
from cdcore.protocol.settings import MOST_HERTZ, CheckedSettings, choice, flag, number

STAGES: Final = ("spheres", "boxes", "meshes", "containment")
COUNTERS: Final = ("sphere_tests", "box_tests", "mesh_queries", "containment_tests")


@dataclass(frozen=True, kw_only=True)
class DiscreteSettings(CheckedSettings):
    """Settings of ``discrete``.

    ``rate_hz``: looks per second of session time; ``None``: every frame.
    ``sphere``: "paper" for equation (21), "best" for the smallest ball known; the verdicts are the same.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    rate_hz: float | None = number(None, 0, MOST_HERTZ, above=True, unit="looks per second", optional=True)
    sphere: str = choice("best", SPHERES)
    containment: bool = flag(True)


@dataclass(frozen=True, eq=False)
class _Contact:
    """A contact as it was seen: its faces and the poses of both bodies, rotation and translation each."""

    faces: Int32Array
    pose_i: Pose
    pose_j: Pose


class _DiscreteMemory(HeldVerdicts):
    """What the detector knows from its looks so far; the only thing that passes from block to block."""

    def __init__(self, pairs: int) -> None:
        super().__init__(pairs)
        self.contacts: list[_Contact | None] = [None] * pairs
        """Of each pair the one seen last."""


class DiscreteDetector(PairDetector[DiscreteSettings]):
    """Tests every pair at each tick ``k / rate_hz`` and holds the answer until the next test (zero-order hold).

    A test (a *look*) happens at the first frame at or after a tick, and at the first frame of all. The verdict of a
    frame between two looks is *held*: a live engine would still believe it, and it may be wrong. A look at which a pair
    has no pose keeps the verdict before. A frame without a pose is NO_POSE, even where a verdict is held.

    Choose it to see what an engine of a given rate would have missed; ``hybrid`` gives the same verdicts at every
    frame in less time, because it knows the whole motion. ``work["held"]`` counts the pair-frames between looks.
    """

    name: ClassVar[str] = "discrete"
    kind: ClassVar[str] = "engine"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = DiscreteSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, Fig. 5, discrete detection", FCL)
    choose_when: ClassVar[str] = "you want to know what an engine of that rate misses"
    cannot: ClassVar[str] = "see what happens between its looks"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: DiscreteSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._broad = BroadPhase(bodies, pairs, sphere=settings.sphere, skip=False)
        self._meshes = MeshStage(bodies, pairs)
        self._containment = ContainmentStage(bodies, pairs, asked=settings.containment)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether a frame was tested; where it was, spheres and boxes let every contact through."""
        del pair, faces
        return Explanation(looked=looks_at(motion.times, frame, self.settings.rate_hz), spheres_meet=True)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        looks = LivePairs(self._broad, self._meshes.decide_now, self._containment.question)
        return LiveHeld(looks, self.pairs, self.settings.rate_hz) if self.settings.rate_hz else looks

    def faces_of(self, motion: Motion, hits: BoolArray) -> FaceSets | None:
        """Ask the meshes in these pair-frames; ``None`` with a rate, where a frame holds an earlier one's faces."""
        if self.settings.rate_hz is not None:
            return None
        columns, frames = np.nonzero(hits.T)
        return self._meshes.decide(motion, frames, columns, faces=True).face_sets(frames, columns)

    def _fresh_memory(self) -> _DiscreteMemory:
        return _DiscreteMemory(len(self.pairs))

    def _run(self, motion: Motion, memory: _DiscreteMemory, faces: bool) -> Detection:
        known = pair_has_pose(motion, self.pairs)
        looks, memory.tick = looks_of(motion.times, self.settings.rate_hz, memory.tick)
        seconds, counts = np.zeros((len(STAGES), len(motion))), Counter[str]()
        seen, contacts = np.empty((int(looks.sum()), len(self.pairs)), dtype=np.uint8), list(memory.contacts)
        # Row 0 is what was known before the block; then, per look, the number of the contact seen last.
        which = np.tile(np.arange(len(self.pairs)), (len(seen) + 1, 1))
        for row, frame in enumerate(np.flatnonzero(looks).tolist()):
            found, seconds[:, frame] = self._look(motion.frames(frame, frame + 1), seen[row], counts, faces)
            which[row + 1] = which[row]
            which[row + 1, list(found)] = len(contacts) + np.arange(len(found))
            contacts += found.values()
        verdict, held = memory.hold(seen, looks, known)
        memory.contacts = [contacts[k] for k in which[-1].tolist()]
        which = which[np.cumsum(looks)]
        return self._detection(
            motion,
            verdict,
            face_sets=_face_sets(verdict, which, contacts) if faces else None,
            containment=self._containment.words,
            work={name: counts[name] for name in COUNTERS}
            | {"looks": held["looks"], "pair_looks": int(known[looks].sum()), "held": held["held"]},
            seconds=dict(zip(STAGES, seconds, strict=True)),
            section_source=self._sections(which, contacts) if faces else None,
        )

    def _look(
        self, now: Motion, verdict: ByteArray, counts: Counter[str], faces: bool
    ) -> tuple[dict[int, _Contact], list[float]]:
        """Look at every pair in one frame, fill ``verdict`` (P,); contacts by pair if asked for faces, and seconds."""
        broad, found = self._broad.candidates(now), dict[int, _Contact]()
        near, clock = broad.columns, broad.clock
        for column in near.tolist():
            hit, pairs = self._meshes.look(now, 0, column, faces=faces)
            if hit:
                broad.verdict[0, column] = Verdict.CONTACT
            if hit and faces:
                # Copies: a view would keep every pose of its block in memory for as long as the contact is remembered.
                ends = self.pairs[column].tolist()
                poses = ((now.rotations[0, k].copy(), now.translations[0, k].copy()) for k in ends)
                found[column] = _Contact(pairs, *poses)
        clock.append(perf_counter())
        apart = near[broad.verdict[0, near] != Verdict.CONTACT]
        asked = self._containment.mark(now, np.zeros(len(apart), dtype=np.int64), apart, broad.verdict)
        clock.append(perf_counter())
        verdict[:] = broad.verdict[0]
        counts.update(broad.work | {"mesh_queries": len(near), "containment_tests": asked})
        return found, np.diff(clock).tolist()

    def _sections(self, which: IntArray, contacts: list[_Contact | None]) -> SectionSource:
        """Segments at the poses of the look that found the faces, not at those of a frame that holds its verdict."""
        ends = self.pairs.tolist()

        def section(frame: int, pair: int, faces: IntArray) -> FloatArray:
            seen = contacts[which[frame, pair]]
            if seen is None or not len(faces):
                return np.zeros((0, 2, 3))
            i, j = ends[pair]
            return section_of_faces(self.bodies[i], seen.pose_i, self.bodies[j], seen.pose_j, faces)

        return section


def _face_sets(verdict: ByteArray, which: IntArray, contacts: list[_Contact | None]) -> FaceSets:
    frames, columns = np.nonzero(verdict == Verdict.CONTACT)
    sets = [NO_FACES if contact is None else contact.faces for contact in contacts]
    return FaceSets.from_shared(frames, columns, which[frames, columns], sets)
