"""A session without the head, the height, the time, the place and the words that lead to a person; motion stays."""

from collections.abc import Collection, Iterator, Mapping, Set
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from replay.base.constants import BLOCK_FRAMES
from replay.effects.effect_plan import plan
from replay.errors import AssemblyError
from replay.outputs.palette import tags_of
from replay.outputs.words import counted
from replay.prepare.flags import chain_of
from replay.studies.minimise.names import Names, plain_scene
from replay.studies.synthetic_sessions import made_up_names
from sessions import Frames, GazeTrack, HandTrack, ScalarTrack, Session, Track
from sessions.errors import SessionError
from sessions.geometry.rotations import IDENTITY, quaternion_about, quaternion_product, rotated
from sessions.mcap_format.annotations import UNCLOSED
from sessions.mcap_format.metadata import DECLARED, FORMAT
from sessions.model.frames import Status
from sessions.model.scene import Pose, Scene

EPOCH_NS: Final = 946_684_800 * 10**9
"""When every recording begins: 2000-01-01 00:00 UTC."""

MOST_APART_NS: Final = 86_400 * 10**9
"""A stamp further than a day from the first frame is of another clock, which would say when it was."""

HEAD_TAGS: Final = frozenset(("head", "headset", "hmd"))
NUMBERS: Final = ("contacts_clock_offset_s", "contacts_clock_drift", "contacts_clock_residual_s")
WORDS: Final = {
    "source_units": ("m", "cm", "mm"), "handedness": ("right", "left"), "consent": ("none", "lab", "share"),
    "vr_type": ("immersive", "augmented", "distributed", "desktop"), "noise": ("vive", "off"),
    "synthetic": made_up_names(),
}  # fmt: skip
"""Facts that stay, where they hold a number or one of these words."""


@dataclass(frozen=True)
class Shift:
    """A rigid move of the world: a turn about the vertical, then a step; and a step in time."""

    turn: tuple[float, ...] = IDENTITY
    step: tuple[float, float, float] = (0.0, 0.0, 0.0)
    later_ns: int | None = None

    def points(self, points: Any) -> Any:
        """Points (..., 3) after it; no bit changes where nothing moves."""
        points = np.asarray(points) if self.turn == IDENTITY else rotated(self.turn, points)
        return points if not any(self.step) else points + self.step

    def turns(self, quaternions: Any) -> Any:
        """Quaternions (..., 4) after it."""
        return quaternions if self.turn == IDENTITY else quaternion_product(self.turn, quaternions)

    def directions(self, directions: Any) -> Any:
        """Directions (..., 3) after it."""
        return directions if self.turn == IDENTITY else rotated(self.turn, directions)

    def pose(self, pose: Pose) -> Pose:
        """A pose in the world after it."""
        (x, y, z), turn = np.asarray(self.points(pose.position)).tolist(), self.turns(np.array(pose.quaternion_xyzw))
        i, j, k, w = turn.tolist()
        return Pose((x, y, z), (i, j, k, w))

    def stamps(self, stamps: Any) -> Any:
        """Stamps after it; SessionError: of another clock."""
        if self.later_ns is None:
            return stamps
        later = np.asarray(stamps, dtype=np.int64) + self.later_ns
        if (np.abs(later - EPOCH_NS) > MOST_APART_NS).any():
            raise SessionError(
                "some stamps lie more than a day from the first frame, on a clock of their own that would say when it "
                "was; import the recording with one clock, or keep the time with --keep time"
            )
        return later


@dataclass(frozen=True, eq=False)
class ShiftedFrames:
    """The frames of a session after a shift, block by block, without some bodies."""

    session: Session
    shift: Shift
    columns: tuple[int, ...]
    rooted: tuple[bool, ...]  # of each column, whether its poses are in the world and not in a parent's frame
    names: tuple[str, ...]

    def blocks(self, frames: int) -> Iterator[Frames]:
        """The frames in blocks of at most this many."""
        columns, free, first_log = list(self.columns), np.array(self.rooted, dtype=bool), None
        for block in self.session.blocks(frames):
            status, sample = block.status[:, columns], block.sample_ns[:, columns].copy()
            place, turn = block.position[:, columns].copy(), block.quaternion_xyzw[:, columns].copy()
            with np.errstate(all="ignore"):  # what a lost sample holds may be no number
                place[:, free] = self.shift.points(place[:, free])
                turn[:, free] = self.shift.turns(turn[:, free])
            there = status != Status.ABSENT
            sample[there] = self.shift.stamps(sample[there])
            log = block.log_ns.copy()
            if (
                len(log) and self.shift.later_ns is not None
            ):  # the recorder's clock may be another; it begins with the first frame
                first_log = int(log[0]) if first_log is None else first_log
                log = np.maximum(log - first_log, 0) + EPOCH_NS
            yield Frames(self.names, self.shift.stamps(block.stamp_ns), log, sample, place, turn, status.copy())


@dataclass(frozen=True, eq=False)
class Minimised:
    """A session with less in it, and what was done: ``names`` old to new, of ``bodies`` those that are left.

    ``done`` says it in sentences that repeat nothing that was taken out.
    """

    session: Session
    names: Names
    done: tuple[str, ...]


def minimise(
    session: Session, *, drop: Collection[str] = (), keep: Collection[str] = (), allow: Collection[str] = ()
) -> Minimised:
    """Take out of a session what leads to a person; the motion of what is left stays as it is, relative to itself.

    Parameters
    ----------
    drop : ``head``: bodies tagged as one, and gaze; ``height``: the mean height of all bodies becomes 0.
    keep : ``time``, ``place``: stamps, positions as recorded.
    allow : names, or words of names, that may stay beside those of the laboratory.

    Raises ``PlanError``: a scene with faults; ``AssemblyError``: a body hangs on the head; ``SessionError``: stamps of
    several clocks.
    """
    plan(session.scene)
    heads = {name for name in session.names if "head" in drop and HEAD_TAGS & set(tags_of(name, session.scene))}
    hung = [name for name in session.names if name not in heads and heads & set(chain_of(name, session.scene))]
    if hung:
        raise AssemblyError(f"the head carries {len(hung)} other of the bodies in the scene, so it cannot be dropped")
    names = Names(allow)
    left = [name for name in (*session.names, *session.meshes) if name not in heads]
    names.settle("body", dict.fromkeys([*left, *(body.id for body in session.scene.bodies)]))
    free = {name for name in session.names if (known := session.scene.body(name)) is None or not known.parent}
    shift = _shift(session, free - heads, height="height" in drop, time="time" not in keep, place="place" not in keep)
    scene, lost = plain_scene(_without(session.scene, heads), names, shift.pose)
    body = {name: names.of("body", name) for name in left}
    columns = tuple(k for k, name in enumerate(session.names) if name not in heads)
    tracked = tuple(session.names[k] for k in columns)
    made = Session(
        ShiftedFrames(session, shift, columns, tuple(n in free for n in tracked), tuple(body[n] for n in tracked)),
        {body[name]: mesh for name, mesh in session.meshes.items() if name in body}, scene,
        facts=_facts(session.facts),
        fast_tracks={body[k]: _track(one, shift, k in free) for k, one in session.fast_tracks.items() if k in body},
        colliders={body[name]: solids for name, solids in session.colliders.items() if name in body},
        **_happened(session, names, shift, heads, gaze="head" not in drop),
    )  # fmt: skip
    done = _done(session, made, names, shift, heads, lost, head="head" in drop, height="height" in drop)
    return Minimised(made, names, tuple(done))


def _without(scene: Scene, heads: Set[str]) -> Scene:
    """A scene without these bodies, their pairs, and effects that name them alone."""
    if not heads:
        return scene
    pairs = scene.pairs and tuple(pair for pair in scene.pairs if not heads & set(pair))
    ignore = tuple(pair for pair in scene.ignore if not heads & set(pair))
    bodies = tuple(body for body in scene.bodies if body.id not in heads)
    there = {body.id for body in bodies} | {f"tag:{tag}" for body in bodies for tag in body.tags}
    gone = ({*heads} | {f"tag:{tag}" for body in scene.bodies for tag in body.tags}) - there
    effects = scene.effects and tuple(one for one in scene.effects if not gone & {*_texts(one.settings)})
    return replace(scene, bodies=bodies, pairs=pairs, ignore=ignore, effects=effects)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    for inner in (*value, *value.values()) if isinstance(value, Mapping) else value if isinstance(value, list) else ():
        yield from _texts(inner)


def _shift(session: Session, free: Collection[str], *, height: bool, time: bool, place: bool) -> Shift:
    """The move that leaves nothing of time and place: a recording moved before gives the same poses after it."""
    columns = [k for k, name in enumerate(session.names) if name in free]
    first_ns, origin, count, total, outer = None, None, 0, np.zeros(3), np.zeros((3, 3))
    for block in session.blocks(BLOCK_FRAMES):
        first_ns = int(block.stamp_ns[0]) if first_ns is None and len(block) else first_ns
        points, status = block.position[:, columns], block.status[:, columns]
        with np.errstate(all="ignore"):
            far = ~(np.abs(points) <= session.scene.space_radius).all(axis=2)
        points = points[~far & (status != Status.LOST) & (status != Status.ABSENT)]
        if len(points):
            origin = points[0].copy() if origin is None else origin
            moved = points - origin
            count, total, outer = count + len(points), total + moved.sum(axis=0), outer + moved.T @ moved
    later = EPOCH_NS - first_ns if time and first_ns is not None else None
    if origin is None or not (place or height):
        return Shift(later_ns=later)
    mean = total / count
    spread = outer / count - np.outer(mean, mean)
    # The axis along which all move most becomes X, and the first sample lies on its positive side.
    angle = 0.5 * float(np.arctan2(2 * spread[0, 2], spread[0, 0] - spread[2, 2])) if place else 0.0
    if -mean[0] * np.cos(angle) - mean[2] * np.sin(angle) < 0 and place:
        angle += np.pi
    x, y, z, w = quaternion_about((0.0, 1.0, 0.0), angle).tolist()
    turn = (x, y, z, w) if place else IDENTITY
    x, y, z = (-rotated(turn, origin + mean)).tolist()
    return Shift(turn, (x if place else 0.0, y if height else 0.0, z if place else 0.0), later)


def _facts(facts: Mapping[str, str]) -> dict[str, str]:
    kept = {key: facts[key] for key, words in WORDS.items() if facts.get(key) in words}
    for key in NUMBERS:
        try:
            kept[key] = repr(float(facts[key]))
        except (KeyError, ValueError):
            continue
    return kept | ({"seed": facts["seed"]} if "synthetic" in kept and facts.get("seed", "").isdecimal() else {})


def _track(track: Track, shift: Shift, free: bool) -> Track:
    place = shift if free else Shift()
    poses = place.points(track.positions), place.turns(track.quaternions_xyzw)
    return Track(shift.stamps(track.times_ns), *poses, track.valid)


def _happened(session: Session, names: Names, shift: Shift, heads: Set[str], *, gaze: bool) -> dict[str, Any]:
    """What was recorded beside poses."""
    of = names.of

    def at(time_ns: int) -> int:
        return int(shift.stamps(time_ns))

    def body(name: str) -> str:
        return "" if name in heads else of("body", name)

    def hand(key: str) -> str:
        who, _, side = key.rpartition("/")
        return f"{of('participant', who or 'participant')}/{side if side in ('left', 'right') else of('side', side)}"

    return {
        "events": tuple(
            replace(one, time_ns=at(one.time_ns), name=of("event", one.name), message="", body=body(one.body))
            for one in session.events
        ),
        "intervals": tuple(
            replace(
                one, start_ns=at(one.start_ns), end_ns=at(one.end_ns), kind=of("kind", one.kind),
                name=of(of("kind", one.kind), one.name), data={UNCLOSED: "true"} if UNCLOSED in one.data else {},
            )
            for one in session.intervals
        ),
        "live_contacts": tuple(
            replace(
                one, time_ns=at(one.time_ns), body_a=body(one.body_a), body_b=body(one.body_b),
                point=one.point and tuple(shift.points(one.point).tolist()),
            )
            for one in session.live_contacts
            if not heads & {one.body_a, one.body_b}
        ),
        "hands": {
            hand(key): HandTrack(shift.stamps(one.times_ns), one.trigger, one.grip,
                                 tuple(of("button", name) for name in one.buttons), one.pressed)
            for key, one in session.hands.items()
        },
        "gaze": {
            of("participant", who): GazeTrack(shift.stamps(one.times_ns), shift.points(one.origins),
                                              shift.directions(one.directions), one.valid, [*map(body, one.bodies)])
            for who, one in session.gaze.items() if gaze
        },
        "scalars": {
            of("scalar", name): ScalarTrack(shift.stamps(one.times_ns), one.values,
                                            one.unit if names.plain(one.unit) else "")
            for name, one in session.scalars.items()
        },
    }  # fmt: skip


def _done(
    session: Session, made: Session, names: Names, shift: Shift, heads: Set[str], lost: Collection[int], *,
    head: bool, height: bool,
) -> Iterator[str]:  # fmt: skip
    """What was done and what is left, without a word of what was taken out."""
    yield "time: the first frame is at 2000-01-01 00:00 UTC" if shift.later_ns is not None else "time: as recorded"
    moved = shift.turn != IDENTITY or shift.step[0] or shift.step[2]
    yield f"place: {'moved and turned about the vertical, all together' if moved else 'as recorded'}"
    yield "height: the mean of all bodies is 0" if height else "height: as recorded"
    yield f"head: {len(heads)} dropped" if heads else f"head: {'no body is tagged as one' if head else 'as recorded'}"
    new = (f"{count} of kind {kind}" for kind, count in names.changed().items())
    yield f"new names: {', '.join(new) or 'none'}"
    stated = {key: value for key, value in session.facts.items() if key != FORMAT and value != DECLARED.get(key)}
    gone = sum(made.facts.get(key) != value for key, value in stated.items())
    words = sum(bool(one.message) for one in session.events)
    words += sum(bool({*one.data} - {UNCLOSED}) for one in session.intervals)
    yield f"taken out: {counted(gone, 'fact')}, {counted(words, 'text')} of events and intervals"
    if lost:
        yield f"effects left out, because they hold words of their own (see --allow): {', '.join(map(str, lost))}"
    if made.gaze or made.scalars:
        yield f"still in it: gaze of {len(made.gaze)}, {len(made.scalars)} other numbers over time"
