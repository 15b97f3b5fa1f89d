"""All that an effect gets: it can read what its spec names, and everything else is refused."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdcore import Detection, Verdict
from cdcore.errors import NotRecordedError
from cdcore.numerics import IntArray
from cdcore.protocol import is_one_of, is_undecided
from replay.effects.declaring import Declaration, Pair
from replay.effects.output import EffectOutput, FloatArray, LaneSpan
from replay.effects.spans import BoolArray, FrameRange
from replay.errors import EffectError
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_ends
from sessions.mesh_data import MeshData
from sessions.model.scene import SceneBody
from sessions.model.session import HandTrack, Session

HANDS_TOPIC: Final = "/hands"
"""Topics below this: trigger, grip and buttons."""

CONTACT_VERDICTS: Final = (Verdict.CONTACT, Verdict.CONTAINED)
"""Verdicts that are contact to an effect; a candidate of bounding volumes is none."""


@dataclass(frozen=True, eq=False)
class BodyPoses:
    """Pose of one body's mesh in every frame.

    Parameters
    ----------
    times : (T,) seconds since the session's first frame.
    translation : (T, 3) world metres.
    rotation : (T, 3, 3) body to world.
    valid : (T,) bool; elsewhere there is no pose and the numbers mean nothing.
    linked : (T,) bool; whether the path from the frame before is known: False after a gap, a loss or a jump.
    """

    times: FloatArray
    translation: FloatArray
    rotation: FloatArray
    valid: BoolArray
    linked: BoolArray

    def point(self, local: ArrayLike) -> FloatArray:
        """World place (T, 3) of a point (3,) of the body's frame; NaN where there is no pose."""
        x, y, z = (float(value) for value in np.asarray(local, dtype=np.float64))
        rotation = self.rotation
        offset = (rotation[:, :, 0] * x + rotation[:, :, 1] * y) + rotation[:, :, 2] * z
        offset[~self.valid] = np.nan
        return self.translation + offset

    def take(self, rows: IntArray | slice) -> "BodyPoses":
        """Some frames of it."""
        return BodyPoses(*(column[rows] for column in vars(self).values()))

    def relative_to(self, other: "BodyPoses") -> "BodyPoses":
        """The same in the other body's frame."""
        translation = other.to_body_frame(self.translation)
        rotation = np.einsum("tji,tjk->tik", other.rotation, self.rotation)
        return BodyPoses(self.times, translation, rotation, self.valid & other.valid, self.linked & other.linked)

    def to_body_frame(self, points: FloatArray) -> FloatArray:
        """World places (T, 3) in the body's frame; they mean nothing where there is no pose."""
        return np.einsum("tji,tj->ti", self.rotation, points - self.translation)

    def last_known(self) -> "BodyPoses":
        """The last pose there was, in every frame: a glass lost for a moment stays; invalid before the first pose."""
        if self.valid.all():
            return self
        last_valid_frames = np.maximum.accumulate(np.where(self.valid, np.arange(len(self.valid)), -1))
        return BodyPoses(
            self.times,
            self.translation[last_valid_frames],
            self.rotation[last_valid_frames],
            last_valid_frames >= 0,
            self.linked,
        )


@dataclass(frozen=True, eq=False)
class PairContact:
    """Contact of one pair by the detector."""

    pair: Pair  # names as asked for
    touching: BoolArray  # (T,) bool
    known: BoolArray  # (T,) bool; elsewhere undecided or without a pose, and ``touching`` is False
    # detection, column: whose answer it is
    detection: Detection
    column: int

    def section(self, frame: int) -> FloatArray:
        """Segments (k, 2, 3), world metres, in which the surfaces meet; none where the detector keeps no faces."""
        try:
            return self.detection.section(frame, self.column)
        except NotRecordedError:
            return np.zeros((0, 2, 3))


@dataclass(frozen=True, eq=False)
class EffectInputs:
    """Arguments of the function of one effect; ``replay.effects.protocol`` describes them."""

    kind: str  # the effect; ``declared`` its checked declarations, empty where it runs only because another needs it
    declared: tuple[Declaration, ...]
    pairs: tuple[Pair, ...]  # its own pairs and those of the effects that need it
    session: Session
    assembly: Assembly
    known_bodies: frozenset[str]  # bodies that some effect of the plan names
    reads: tuple[str, ...]  # topics its spec names; ``detector`` likewise
    detection: Detection | None
    outputs: Mapping[str, EffectOutput]  # of the effects it needs or uses
    counters: Counter[str]
    tables: Mapping[str, tuple[Declaration, ...]]  # declarations of every kind of the plan
    shared_objects: dict[str, Any]  # what effects share

    @property
    def times(self) -> FloatArray:
        """(T,) seconds since the session's first frame."""
        return self.assembly.motion.times

    def __len__(self) -> int:
        return len(self.times)

    def span_times(self, span: FrameRange) -> tuple[float, float]:
        """First second of a span, and the second at which it is over; the recording's last, if it ends before."""
        first, stop = span
        return float(self.times[first]), float(self.times[min(stop, len(self) - 1)])

    def end(self, stop: int) -> float | None:
        """The ``end`` of an event that is over at frame ``stop``; ``None``: the recording ends before."""
        return None if stop >= len(self) else float(frame_ends(self.times)[stop - 1])

    def lane_spans(self, spans: Iterable[FrameRange], word: str) -> list[LaneSpan]:
        """Spans of frames as spans of a lane."""
        return [LaneSpan(*self.span_times(span), word) for span in spans]

    def count(self, name: str, by: int = 1) -> None:
        """Add to a counter of this effect's work."""
        self.counters[name] += by

    def shared_object(self, name: str, make: Callable[[], Any]) -> Any:
        """Returns an object that several effects share, such as the ledger of matter: made by the first that asks."""
        if name not in self.shared_objects:
            self.shared_objects[name] = make()
        return self.shared_objects[name]

    def body(self, name: str) -> SceneBody:
        """The declaration of a body."""
        declaration = self.session.scene.body(self._checked_name(name))
        return declaration if declaration is not None else SceneBody(name)

    def poses(self, name: str) -> BodyPoses:
        """Pose of a body's mesh in every frame.

        Raises EffectError: no effect of the plan names it, or it has no mesh or no track.
        """
        body_names = self.assembly.names
        if self._checked_name(name) not in body_names:
            raise EffectError(
                f"effect {self.kind!r}: body {name!r} has no mesh or was not recorded; record it, or give it "
                "fixed = { position = [x, y, z] } if it stands still"
            )
        column, motion = body_names.index(name), self.assembly.motion
        translations, rotations = motion.translations[:, column], motion.rotations[:, column]
        return BodyPoses(motion.times, translations, rotations, motion.valid[:, column], motion.linked[:, column])

    def mesh(self, name: str) -> MeshData:
        """Vertices and faces in the body's frame."""
        return self.session.meshes[self._checked_name(name)]

    def output(self, kind: str) -> EffectOutput:
        """The output of an effect this one needs or uses.

        Raises EffectError: its spec names no such effect, or the plan does not hold it.
        """
        if kind not in self.outputs:
            raise EffectError(f"effect {self.kind!r} needs {kind!r}, which is not there; name it in `needs`")
        return self.outputs[kind]

    def hand_of(self, body: str) -> HandTrack | None:
        """Trigger, grip and buttons of the hand with this body; ``None``: nothing was recorded.

        A body goes with ``participant/side`` by its tags, else by its name: it holds the side, and where several
        participants have that side, the participant too.

        Raises EffectError: the effect's spec does not read hands.
        """
        if HANDS_TOPIC not in self.reads:
            raise EffectError(f"effect {self.kind!r} reads a hand; name {HANDS_TOPIC!r} in `reads`")
        body_tags = {*self.body(body).tags, *body.replace("_", "-").split("-")}
        hand_keys = [key for key in self.session.hands if key.rpartition("/")[2] in body_tags]
        mine = [key for key in hand_keys if key.partition("/")[0] in body_tags] or hand_keys
        if not mine:
            return None
        self.count(f"decoded {HANDS_TOPIC}/{mine[0]}")
        return self.session.hands[mine[0]]

    def contact(self, pair: Pair) -> PairContact:
        """Contact of a pair by the detector.

        Raises EffectError: the spec names no detector, or the pair is not the effect's.
        """
        if self.detection is None:
            raise EffectError(f"effect {self.kind!r} needs contacts; name a `detector`")
        body_names = self.detection.names
        columns = {
            frozenset((body_names[a], body_names[b])): c for c, (a, b) in enumerate(self.detection.pairs.tolist())
        }
        column = columns.get(frozenset(pair))
        if column is None:
            raise EffectError(f"effect {self.kind!r} needs the pair {pair[0]}-{pair[1]}, which was not tested")
        verdict = self.detection.verdict[:, column]
        return PairContact(pair, is_one_of(verdict, CONTACT_VERDICTS), ~is_undecided(verdict), self.detection, column)

    def _checked_name(self, name: str) -> str:
        if name not in self.known_bodies:
            raise EffectError(f"effect {self.kind!r} asks for body {name!r}, which no declared effect names")
        return name
