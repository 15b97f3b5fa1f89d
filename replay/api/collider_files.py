"""A session in, the fewest convex pieces a body out that keep false contact below a share.

The files are what an engine takes: a GLB a body with a node a piece, and a manifest that says how far they hold. For
Unreal the mesh that is drawn stands beside its pieces, since its importer gives a piece to a mesh of the same file.

Axes. A session holds poses and meshes in the canonical frame: what stands at p in the body's own axes in Unity stands
at Fz p here, with Fz = diag(1, 1, -1), since poses of Unity are converted by flipping Z. The importers of glTF that
Unity has (glTFast, UnityGLTF) flip X instead: a point q of a file stands at Fx q in Unity, with Fx = diag(-1, 1, 1). So
the file must hold q = Fx p = Fx Fz (Fz p): the canonical mesh turned by half a circle about Y. Written as it is, it
would stand in Unity turned by just that half circle. It is the turn that a mesh gets on its way in, where it went
through such an exporter (``--mesh-axes x-flipped``), the other way round; Unreal's exchange of Y and Z likewise. So
files are written in the axes that a GLB from the engine of the recording has (`default_mesh_axes`), and lie on the mesh
that the user has there. Poses of no such engine have meshes with Y up as glTF says, and those are written as they are.

Source: KhronosGroup/UnityGLTF, SchemaExtensions.CoordinateSpaceConversionScale; `mesh_axes.toml`.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, Final

import numpy as np

from cdcore.mesh import TriangleMesh
from replay.api.advisor import wrong_in
from replay.api.runner import opened, run
from replay.auditing.tolerance import TAU
from replay.base.progress import Advance, Progress, Silent
from replay.cutting.convex_solids import MOST_TRIANGLES, outside_by, solids_of, volume_of
from replay.cutting.methods import METHODS, method_of
from replay.cutting.piece_store import Cut, convex_pieces, why_not_cut
from replay.detection.detector_spec import TRUSTED, parse_detector
from replay.detection.run_detector import make_detector
from replay.outputs.results.run_folder import FolderKind, check_target, result_folder, write_summary
from replay.pipeline.engine import prepared
from replay.pipeline.run_result import RunResult
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_rate
from replay.tradeoffs.engine_knobs import Engine, engine_named
from replay.tradeoffs.scoring import Scoring
from replay.tradeoffs.settings import FASTEST, Setting
from sessions import MeshData, Session
from sessions.meshes.mesh_axes import default_mesh_axes
from sessions.scene_files.body_axes import from_body_axes, in_body_axes, pose_convention

MAX_FALSE: Final = 0.2
"""Share of the reported contact time that may be false when nothing is said."""

TIME_LIMIT: Final = 150.0
"""Seconds that the search takes at most when nothing is said."""

CUT_COUNTS: Final = (4, 16, 64)
"""Pieces that are asked for, of a body that is not round."""

SECTOR_COUNTS: Final = (2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 40, 48, 64, 96)
"""Pieces that are asked for, of a body that is round about an axis."""

WORTH: Final = 0.8
"""The next step of a body fills at most this share of the volume that its pieces filled before."""

SLACK: Final = 0.02
"""Where the wanted share is not reached, so much more false contact is no reason to keep pieces."""

COLLIDERS: Final = FolderKind("colliders", "colliders.json", "vrlab-replay/colliders/1")

HULL: Final = "one hull"

IMPORTED_WITH_MESH: Final = ("Unreal Engine",)
"""Engines whose importer takes a collider only beside the mesh that it is of."""


class _TimeUp(Exception):  # noqa: N818 - no error: what was found until then is written
    """The time for the search is used up."""


class _Deadline:
    """Tells how much of the time for a search is used up, as percents of progress."""

    def __init__(self, seconds: float | None, advance: Advance) -> None:
        self._seconds, self._advance, self._began, self._percent = seconds, advance, perf_counter(), 0

    def check(self) -> None:
        """Report progress. Raises ``_TimeUp``."""
        used = 0.0 if self._seconds is None else (perf_counter() - self._began) / max(self._seconds, 1e-9)
        percent = min(99, int(100 * used))
        self._advance(percent - self._percent)
        self._percent = percent
        if used >= 1.0:
            raise _TimeUp


class _Ladder:
    """Ways to stand for one mesh, from its hull to many pieces, each cut when it is asked for."""

    def __init__(self, mesh: TriangleMesh, deadline: _Deadline) -> None:
        self.mesh, self._deadline = mesh, deadline
        self._method = "hull" if why_not_cut(mesh) else method_of("auto", mesh)
        self.how = METHODS[self._method].words
        counts = {"sectors": SECTOR_COUNTS, "hull": ()}.get(self._method, CUT_COUNTS)
        self.counts = (1, *counts)
        self._made: dict[int, Sequence[TriangleMesh]] = {}

    def above(self, step: int) -> list[int]:
        """Steps to try next: the one that is worth it, and the last; V-HACD takes too long for its last one."""
        every = range(step + 1, len(self.counts))
        if self._method != "sectors":
            return [*every[:1]]
        filled = _filled(self.pieces(step))
        worth = [higher for higher in every if _filled(self.pieces(higher)) <= WORTH * filled]
        return sorted({*worth[:1], *every[-1:]})

    def pieces(self, step: int) -> Sequence[TriangleMesh]:
        """The pieces of a step. Raises ``_TimeUp`` where the time is up before they are cut."""
        if step not in self._made:
            watch = self._deadline.check if step else None
            self._made[step] = convex_pieces(Cut(self.mesh, self._method, self.counts[step]), watch)
        return self._made[step]


def _filled(pieces: Sequence[TriangleMesh]) -> float:
    """The sum of the volumes of closed pieces."""
    return sum(abs(volume_of(piece)) for piece in pieces)


@dataclass(frozen=True, eq=False)
class Shipped:
    """What was written.

    Parameters
    ----------
    folder : where the files are.
    engine : for which they are.
    setting : what ``replay run`` takes, of the session in the folder, for the figures *after*.
    bodies : plain data a body: ``body``, ``file``, ``pieces``, ``how``, ``triangles`` (of the largest piece) and
        ``outside_mm``: how far the mesh lies outside its pieces at most.
    before, after : plain data: the figures of a hull a body and of the pieces, as ``run`` counts them.
    max_false : the share that was asked for.
    axes : of the GLB files, as ``--mesh-axes`` takes them.
    result : the run that counted both, as ``before`` and ``after``.
    time_up : whether the time limit ended the search: with more time there may be better pieces, or fewer.
    """

    folder: Path
    engine: Engine
    setting: str
    bodies: tuple[dict[str, Any], ...]
    before: dict[str, Any]
    after: dict[str, Any]
    max_false: float
    axes: str
    result: RunResult
    time_up: bool = False

    @property
    def reached(self) -> bool:
        """Whether false contact is at most what was asked for."""
        return self.after["false"] is None or self.after["false"] <= self.max_false

    def as_json(self) -> dict[str, Any]:
        """Everything as plain data: what the manifest holds."""
        return {
            "engine": self.engine.name, "version": self.engine.version, "most_triangles": MOST_TRIANGLES,
            "setting": self.setting, "max_false": self.max_false, "reached": self.reached, "time_up": self.time_up,
            "before": self.before, "after": self.after, "axes": self.axes, "bodies": list(self.bodies),
        }  # fmt: skip


def ship_colliders(
    session_or_path: Session | str | Path, folder: str | Path, *, engine: str, max_false: float = MAX_FALSE,
    time_limit: float | None = TIME_LIMIT, force: bool = False, progress: Progress | None = None,
    scene: str | Path | None = None, **asked: Any,
) -> Shipped:  # fmt: skip
    """Write the fewest convex pieces a body that keep false contact below a share, and replay the session with them.

    Bodies that are round about an axis are cut by height and angle, others by V-HACD. The step is that of a new project
    of the engine.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    folder : where the files go: ``BODY.glb``, ``colliders.json``, and ``session.mcap``, which carries the colliders.
    engine : ``unity``, ``unreal`` or ``mujoco``.
    max_false : share of the reported contact time that may be false, 0 to 1.
    time_limit : seconds for the search, after which the best pieces until then are written; ``None``: no limit. Reading
        the session and the run that counts before and after are not in it.
    force : replace an earlier folder of the kind.
    asked : ``pairs``, ``start``, ``end``, ``policy``, ``tau`` and ``seed``, as ``replay.run``.

    Raises ``TradeoffError``: no contact happens; ``OutputError``: the folder cannot be written; and as ``replay.run``.
    """
    progress, target, chosen = progress or Silent(), Path(folder), engine_named(engine)
    check_target(target, force=force, kind=COLLIDERS)
    held = opened(session_or_path, scene)
    ready = prepared(
        held, progress=progress, **{key: asked[key] for key in ("pairs", "start", "end", "policy") if key in asked}
    )
    every_frame = chosen.step_hz >= FASTEST * frame_rate(held.stamps() / 1e9)
    rate = {} if every_frame else {"rate_hz": chosen.step_hz}
    with progress.stage("Finding the contacts", 1) as advance:
        scoring = Scoring(
            ready.assembly, parse_detector(TRUSTED), asked.get("seed", 0), asked.get("tau", TAU),
            ready.treatment.session,
        )  # fmt: skip
        advance(1)
    with progress.stage("Cutting and trying pieces", None if time_limit is None else 100) as advance:
        search = _Search(ready.assembly, scoring, rate, max_false, _Deadline(time_limit, advance))
        pieces, how = search.fewest()
    axes = default_mesh_axes("glb", pose_convention(held.facts))
    with result_folder(target, COLLIDERS, force=force) as place:
        session, rows = _written(place, held, pieces, how, axes=axes, drawn=chosen.name in IMPORTED_WITH_MESH)
        sampled = "".join(f",{key}={value:g}" for key, value in rate.items())
        hulls, setting = (f"collider[shape={shape}{sampled}]" for shape in ("compound,pieces=1", "shipped"))
        result = run(session, detectors={"before": hulls, "after": setting}, progress=progress, **asked)
        before = _figures(result, "before", len(rows))
        after = _figures(result, "after", sum(row["pieces"] for row in rows))
        shipped = Shipped(target, chosen, setting, tuple(rows), before, after, max_false, axes, result, search.time_up)
        write_summary(place, COLLIDERS, {"schema": COLLIDERS.schema, **shipped.as_json()})
    return shipped


def _figures(result: RunResult, label: str, pieces: int) -> dict[str, Any]:
    """What a detector of the run gets wrong and takes, and of how many pieces."""
    seconds = result.document.detectors[label].seconds
    return wrong_in(result, label) | {"ms": 1e3 * seconds.per_frame_mean, "pieces": pieces}


class _Search:
    """Goes up the ladders of the bodies of the pair with most false contact, then down again where that is free."""

    def __init__(
        self, assembly: Assembly, scoring: Scoring, rate: dict[str, float], max_false: float, deadline: _Deadline
    ) -> None:
        self.time_up, self._deadline = False, deadline
        self._assembly, self._scoring, self._rate, self._max_false = assembly, scoring, rate, max_false
        by_mesh = {body.mesh.content_hash: body.mesh for body in assembly.bodies}
        ladders = {mesh_hash: _Ladder(mesh, deadline) for mesh_hash, mesh in by_mesh.items()}
        self._ladders = {body.name: ladders[body.mesh.content_hash] for body in assembly.bodies}
        self._known: dict[tuple[int, ...], tuple[float, Any]] = {}

    def fewest(self) -> tuple[dict[str, Sequence[TriangleMesh]], dict[str, str]]:
        """Pieces of each body, and how they were cut; where the time is up, the best that was found until then."""
        self._steps = dict.fromkeys(self._ladders, 0)
        try:
            self._descend(self._climb())
        except _TimeUp:
            self.time_up = True
        made = {name: self._ladders[name].pieces(step) for name, step in self._steps.items()}
        return made, {name: self._ladders[name].how if step else HULL for name, step in self._steps.items()}

    def _climb(self) -> float:
        """Take more pieces of the bodies of the worst pair until little enough is false; the share that is left."""
        false, by_pair = self._false(self._steps)
        spent: set[int] = set()
        while false > self._max_false:
            order = np.argsort(by_pair)[::-1].tolist()
            worst = next((column for column in order if column not in spent and by_pair[column]), None)
            if worst is None:
                break
            found = [(self._false(tried), tried) for tried in self._above(self._steps, worst)]
            better = min(found, key=lambda tried: (tried[0][0], sum(tried[1].values())), default=None)
            if better is None or better[0][1][worst] >= by_pair[worst]:
                spent.add(worst)
                continue
            (false, by_pair), self._steps = better
        return false

    def _descend(self, false: float) -> None:
        """Take fewer pieces of each body where that costs nothing, the body of most pieces first."""
        most = max(false + SLACK, self._max_false)
        for name in sorted(self._steps, key=lambda body: -len(self._ladders[body].pieces(self._steps[body]))):
            self._steps = {**self._steps, name: self._least(self._steps, name, most)}

    def _least(self, steps: Mapping[str, int], name: str, most: float) -> int:
        """The first step of a body with which false contact is at most so much: more pieces make it less."""

        def enough(step: int) -> bool:
            return self._false({**steps, name: step})[0] <= most

        return bisect_left(range(steps[name]), True, key=enough)

    def _above(self, steps: Mapping[str, int], column: int) -> list[dict[str, int]]:
        """More pieces of one body of a pair, or of both: one alone may change nothing."""
        ends = [self._assembly.names[body] for body in self._assembly.pairs[column].tolist()]
        higher = {name: self._ladders[name].above(steps[name]) for name in ends}
        found = [{**steps, name: step} for name, more in higher.items() for step in more]
        if all(higher.values()):
            found.append({**steps, **{name: more[-1] for name, more in higher.items()}})
        return found

    def _false(self, steps: Mapping[str, int]) -> tuple[float, Any]:
        """Share of the reported contact time that is false, and false frames of each pair; counted once."""
        key = tuple(steps.values())
        if key not in self._known:
            # The hulls are counted whatever it takes: they are what is written where nothing else was tried in time.
            if self._known:
                self._deadline.check()
            solids = {name: solids_of(self._ladders[name].pieces(step)) for name, step in steps.items()}
            bodies = tuple(replace(body, colliders=solids[body.name]) for body in self._assembly.bodies)
            assembly = replace(self._assembly, bodies=bodies)
            setting = Setting(f"pieces {sorted(steps.items())}", "collider", {"shape": "shipped", **self._rate})
            detection = make_detector(setting.spec, assembly, 0).detect(assembly.motion)
            share = self._scoring.figures(detection, setting, assembly)["false"] or 0.0
            self._known[key] = share, self._scoring.false_frames(detection)
        return self._known[key]


def _written(
    place: Path,
    held: Session,
    pieces: Mapping[str, Sequence[TriangleMesh]],
    how: Mapping[str, str],
    *,
    axes: str,
    drawn: bool,
) -> tuple[Session, list[dict[str, Any]]]:
    """Write the files and read them again; the session with what was read, and a row a body.

    ``drawn``: whether a file holds the body's own mesh too, under the body's name.
    """
    from sessions import write_session
    from sessions.meshes.glb import meshes_to_glb
    from sessions.meshes.mesh_match import read_colliders

    poses = pose_convention(held.facts)
    colliders: dict[str, tuple[MeshData, ...]] = {}
    rows: list[dict[str, Any]] = []
    for number, (name, parts) in enumerate(pieces.items()):
        file = place / f"{_file_name(name, number)}.glb"
        mesh = TriangleMesh(held.meshes[name].vertices, held.meshes[name].faces)
        nodes = {name: mesh} if drawn else {}
        nodes |= {f"UCX_{name}_{k:02d}": part for k, part in enumerate(parts)}
        in_file = {node: from_body_axes(_rounded(part), axes, poses) for node, part in nodes.items()}
        file.write_bytes(meshes_to_glb(in_file))
        read = read_colliders(file, [name]).solids
        colliders[name] = tuple(in_body_axes(part, axes, poses) for part in read[name])
        back = [TriangleMesh(part.vertices, part.faces) for part in colliders[name]]
        rows.append({
            "body": name, "file": file.name, "pieces": len(back), "how": how[name],
            "triangles": max(len(part.faces) for part in back), "outside_mm": 1e3 * outside_by(mesh, back),
        })  # fmt: skip
    session = replace(held, colliders=colliders)
    write_session(session, place / "session.mcap")
    return session, rows


def _file_name(name: str, number: int) -> str:
    """The name of a body as that of a file; with a number where signs had to be left out."""
    plain = re.sub(r"[^A-Za-z0-9._-]", "", name).lstrip(".")
    return plain if plain == name else f"{plain or 'body'}-{number}"


def _rounded(piece: TriangleMesh) -> MeshData:
    """The piece in the numbers that a GLB has for any program."""
    return MeshData(piece.vertices.astype(np.float32).astype(np.float64), piece.faces)
