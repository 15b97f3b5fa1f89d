"""What was recorded beside poses, shown as effects are: numbers over time, and what each participant looked at.

Neither is declared by a scene: they are there where the recording holds them. What somebody looked at is the body whose
mesh the ray of a sample meets first, with all bodies where they are at the frame nearest to it. What is worn is looked
through: a small body in whose box the eye is most of the time, as in a headset.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.containment.first_hits import FirstHits
from replay.base.shown import shown
from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectEvent, EffectOutput, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec
from replay.prepare.assembly import Assembly
from replay.prepare.interpolation import BRIDGE_NS
from sessions import GazeTrack, Session
from sessions.mcap_format.metadata import NOT_STATED

GAZE: Final = "gaze"
SCALARS: Final = "scalars"
CURVES: Final = "curves"
NOTHING, UNSEEN = -1, -2
NOT_SEEN: Final = "(eyes not seen)"

LONGEST_LOOK: Final = 0.1
"""Seconds for which a sample speaks at most: a fixation lasts that long (Salvucci and Goldberg, 2000)."""

WORN_M: Final = 0.6
"""A body that is larger is a room or a table, and not worn."""


@dataclass(frozen=True, eq=False)
class Looked:
    """What one participant looked at, by sample.

    ``times`` (n,) seconds, ``rays`` (n, 2, 3) origin and direction in the world, ``distance`` (n,) metres to the first
    body or inf, ``body`` (n,) its number among the bodies of the assembly, ``NOTHING`` or ``UNSEEN``: the eyes were not
    seen, or no pose is near in time. ``worn``: bodies looked through.
    """

    times: FloatArray
    rays: FloatArray
    distance: FloatArray
    body: NDArray[np.int64]
    worn: tuple[str, ...] = ()

    @property
    def lasting(self) -> FloatArray:
        """Seconds for which each sample speaks, (n,): to the next one, at most ``LONGEST_LOOK``."""
        steps = np.diff(self.times)
        usual = float(np.median(steps)) if len(steps) else LONGEST_LOOK
        return np.minimum(np.append(steps, usual), LONGEST_LOOK)


def recorded(session: Session, assembly: Assembly) -> dict[str, EffectRun]:
    """Kind -> what the recording holds of it in the time of the assembly; empty where it holds nothing."""
    found: dict[str, EffectRun] = {}
    if not len(assembly.motion):
        return found
    for spec in (SCALARS_SPEC, GAZE_SPEC):
        start = perf_counter()
        output = OUTPUTS[spec.kind](session, assembly)
        if output is not None:
            count, curves = len(assembly.motion), {CURVES: len(output.series)}
            seconds = perf_counter() - start
            found[spec.kind] = EffectRun(spec, ("it was recorded",), output, seconds, curves, count, count)
    return found


def _scalars(session: Session, assembly: Assembly) -> EffectOutput | None:
    series = {}
    for name, one in session.scalars.items():
        times, rows = _within(one.times_ns, assembly)
        if len(rows):
            series[name] = Series(times, one.values[rows], one.unit)
    return EffectOutput(series=series) if series else None


def _gaze(session: Session, assembly: Assembly) -> EffectOutput | None:
    names = assembly.names
    meshes = [FirstHits(body.mesh.triangles) for body in assembly.bodies if session.gaze]
    looked = {
        who: _looked(one, assembly, meshes) for who, one in zip(_called(session), session.gaze.values(), strict=True)
    }
    looked = {who: one for who, one in looked.items() if len(one.times)}
    if not looked:
        return None
    series = {f"{who}/distance": _distance(one) for who, one in looked.items()}
    lanes = {who: _spans(one, names) for who, one in looked.items()}
    return EffectOutput(tuple(_event(who, one, names) for who, one in looked.items()), series, lanes, data=looked)


def _called(session: Session) -> list[str]:
    """What those whose gaze was recorded are called: a recorder may have been given their names."""
    pseudonym = session.facts.get("pseudonym", NOT_STATED)
    if len(session.gaze) == 1:
        return ["the participant" if pseudonym == NOT_STATED else pseudonym]
    return [f"participant {number}" for number in range(1, len(session.gaze) + 1)]


def _within(times_ns: NDArray[np.int64], assembly: Assembly) -> tuple[FloatArray, NDArray[np.int64]]:
    """Seconds and rows of the samples between the first and the last frame."""
    times = (times_ns - assembly.first_ns) / 1e9
    ends = assembly.motion.times
    rows = np.flatnonzero((times >= ends[0]) & (times <= ends[-1]))
    return times[rows], rows


def _looked(gaze: GazeTrack, assembly: Assembly, meshes: Sequence[FirstHits]) -> Looked:
    times, rows = _within(gaze.times_ns, assembly)
    rays = np.stack([gaze.origins[rows], gaze.directions[rows]], axis=1)
    motion = assembly.motion
    frame = np.searchsorted((motion.times[1:] + motion.times[:-1]) / 2, times)
    seen = gaze.usable[rows] & (np.abs(motion.times[frame] - times) <= BRIDGE_NS / 1e9)
    distance, body = np.full(len(rows), np.inf), np.where(seen, NOTHING, UNSEEN)
    worn = []
    for number, mesh in enumerate(meshes):
        there = np.flatnonzero(seen & motion.valid[frame, number])
        turn, place = motion.rotations[frame[there], number], motion.translations[frame[there], number]
        origin = np.einsum("nji,nj->ni", turn, rays[there, 0] - place)
        if _is_worn(assembly.bodies[number].mesh.vertices, origin):
            worn.append(assembly.names[number])
            continue
        ahead = mesh.distances(origin, np.einsum("nji,nj->ni", turn, rays[there, 1]))
        nearer = ahead < distance[there]
        distance[there[nearer]], body[there[nearer]] = ahead[nearer], number
    return Looked(times, rays, distance, body, tuple(worn))


def _is_worn(vertices: FloatArray, eyes: FloatArray) -> bool:
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    inside = ((eyes >= low) & (eyes <= high)).all(axis=1)
    return bool(len(eyes)) and float((high - low).max()) <= WORN_M and bool(inside.mean() > 0.5)


def _distance(one: Looked) -> Series:
    return Series(one.times, np.where(np.isfinite(one.distance), one.distance, np.nan), "m")


def _spans(one: Looked, names: Sequence[str]) -> tuple[LaneSpan, ...]:
    """A span wherever samples after each other meet one body."""
    ends = one.times + one.lasting
    cut = np.flatnonzero((np.diff(one.body) != 0) | (one.times[1:] > ends[:-1] + 1e-9)) + 1
    firsts, lasts = [0, *cut.tolist()], [*(cut - 1).tolist(), len(one.times) - 1]
    return tuple(
        LaneSpan(float(one.times[first]), float(ends[last]), names[int(one.body[first])])
        for first, last in zip(firsts, lasts, strict=True)
        if one.body[first] >= 0
    )


def _event(who: str, one: Looked, names: Sequence[str]) -> EffectEvent:
    """How long a participant looked at what."""
    spent = {word: float(one.lasting[one.body == number].sum()) for number, word in _words(names).items()}
    seconds = dict(sorted(((word, time) for word, time in spent.items() if time > 0.0), key=lambda row: -row[1]))
    seen = ", ".join(f"{shown(word)} {time:.1f} s" for word, time in seconds.items() if word != NOT_SEEN)
    parts = [f"{shown(who)} looked at {seen}"] if seen else []
    parts += [f"the eyes of {shown(who)} were not seen for {seconds[NOT_SEEN]:.1f} s"] if NOT_SEEN in seconds else []
    parts += [f"looked through what is worn: {', '.join(map(shown, one.worn))}"] if one.worn else []
    start, end = float(one.times[0]), float(one.times[-1] + one.lasting[-1])
    return EffectEvent(start, "looked-at", (who,), end, seconds, "; ".join(parts))


def _words(names: Sequence[str]) -> Mapping[int, str]:
    return {**dict(enumerate(names)), NOTHING: "nothing", UNSEEN: NOT_SEEN}


SCALARS_SPEC: Final = EffectSpec(SCALARS, "Numbers that were recorded beside the poses.", lambda _: EffectOutput())
GAZE_SPEC: Final = EffectSpec(
    GAZE, "The first body that each participant's gaze meets.", lambda _: EffectOutput(),
    sources=("Moeller and Trumbore, Fast, minimum storage ray-triangle intersection, 1997",),
)  # fmt: skip
OUTPUTS: Final = {SCALARS: _scalars, GAZE: _gaze}
