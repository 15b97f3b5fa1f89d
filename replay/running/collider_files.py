"""A session in, the colliders to ship out: report cards, the fewest pieces that keep to limits, files for an engine.

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
MuJoCo reads an OBJ as it is: where poses are right-handed, its pieces stand in the axes of the body, as an OBJ of the
user does.

Source: KhronosGroup/UnityGLTF, SchemaExtensions.CoordinateSpaceConversionScale; `mesh_axes.toml`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.tolerances import TWO_MICROMETRES
from replay import words
from replay.advice.collider_search import (
    CONVEX_REASON,
    JOINED_LABEL,
    OTHER_METHODS,
    ColliderSearch,
    Deadline,
    Ladder,
    Limits,
    as_row,
)
from replay.advice.report_card import contact_figures, shape_figures
from replay.advice.scoring import Scoring
from replay.advice.settings import FASTEST_RATE_RATIO
from replay.auditing.tolerance import Reference
from replay.cutting.convex_solids import MOST_TRIANGLES
from replay.cutting.methods import METHODS
from replay.cutting.piece_store import Cut, convex_pieces, cut_ahead, not_tried_sentences
from replay.detection.detector_spec import TRUSTED_DETECTOR, parse_detector
from replay.detection.progress import Progress, Silent
from replay.document.run_result import RunResult
from replay.engine import prepare
from replay.errors import TradeoffError
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_rate
from replay.running.advisor import errors_of_detector
from replay.running.runner import open_session, run
from replay.settings import STEP_RATE_HZ
from replay.show.engine_files import EngineFiles, engine_files
from replay.show.fix_page.page import AFTER_LABEL, BEFORE_LABEL, BodyShape, Cure, cure_page
from replay.show.results.run_folder import REPORT_FILE, FolderKind, check_target, result_folder, write_summary
from replay.words import safe_text
from sessions import MeshData, Session
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_axes import default_mesh_axes
from sessions.model.assumption import pose_convention
from sessions.scene_files.body_axes import from_body_axes, in_body_axes
from sessions.temporary_folders import temporary_folder

MOST_FALSE_FRACTION: Final = 0.2
"""Fraction of the reported contact time that may be false when nothing is said."""

CARD_PIECES: Final = 16
"""The most pieces of V-HACD and of CoACD that get a report card."""

CARD_TIME_S: Final = 600.0
"""Seconds that cutting for report cards takes at most where there is no limit of time."""

DEFAULT_LIMITS: Final = Limits(false=MOST_FALSE_FRACTION)

LONGEST_NAME_CHARACTERS: Final = 100
"""Signs of the name of a body that are in the name of its file, at most."""

WINDOWS_DEVICES: Final = frozenset(
    ["con", "prn", "aux", "nul", *(f"{device}{k}" for device in ("com", "lpt") for k in range(1, 10))]
)
"""Names that no file has on Windows, whatever its ending."""

TIME_LIMIT_S: Final = 60.0
"""Seconds that cutting and searching take at most when nothing is said."""

COLLIDERS_FOLDER: Final = FolderKind("colliders", "colliders.json", "vrlab-replay/colliders/2")


@dataclass(frozen=True, eq=False)
class ColliderFix:
    """The colliders to ship, and what they give.

    Parameters
    ----------
    engine : name of the engine that the files are for; ``""``: nothing was written.
    folder : where the files are; ``None``: nothing was written.
    step_hz : steps a second at which contact was counted.
    setting : what ``replay run`` takes, of the session in the folder, for the figures *after*.
    bodies : plain data a body: ``body``, ``file``, ``how``, ``reason`` (why it keeps its hull, ``""``), and the cards
        ``before`` and ``after``, with a list of ``others``, as ``replay.advice.report_card`` has them.
    before, after : plain data: the figures of a hull a body and of the pieces, as ``run`` counts them.
    front : rows of what was tried and has the smallest loss of all with as few pieces: ``pieces``, ``loss``,
        ``false``, ``missed``.
    limits : the fractions that were asked for.
    axes : of the GLB files, as ``--mesh-axes`` takes them.
    result : the run that counted both, with the labels ``hulls`` and ``pieces``.
    shapes : name of a body -> its mesh, its hull and its pieces.
    time_up : whether the time limit ended the search: with more time there may be better pieces, or fewer.
    steps : what to do in the engine, sentences.
    not_tried : sentences about cuts that there was no time for.
    """

    engine: str
    folder: Path | None
    step_hz: float
    setting: str
    bodies: tuple[dict[str, Any], ...]
    before: dict[str, Any]
    after: dict[str, Any]
    front: tuple[dict[str, Any], ...]
    limits: Limits
    axes: str
    result: RunResult
    shapes: Mapping[str, BodyShape]
    time_up: bool = False
    steps: tuple[str, ...] = ()
    not_tried: tuple[str, ...] = ()

    @property
    def reached(self) -> bool:
        """Whether false and missed contact are at most what was asked for."""
        return self.limits.hold(self.after["false"] or 0.0, self.after["not_reported"] or 0.0)

    @property
    def remarks(self) -> list[str]:
        """Sentences about the limits, about bodies that are not cut, and about a search that ended early."""
        lines = [
            f"False contact: {_percent(self.after['false'])}; at most {_percent(self.limits.false)} was asked for."
        ]
        missed_after, missed_before = _percent(self.after["not_reported"]), _percent(self.before["not_reported"])
        if self.limits.missed is not None:
            lines.append(f"Missed contact: {missed_after}; at most {_percent(self.limits.missed)} was asked for.")
        elif missed_after != missed_before:
            lines.append(f"Missed contact: {missed_after}; with a hull a body it is {missed_before}.")
        uncut_rows = [row for row in self.bodies if row["reason"] not in ("", CONVEX_REASON)]
        lines += [f"{row['body']} keeps its hull: {row['reason']}." for row in uncut_rows]
        lines += self._fitted_to_motion()
        lines += self.not_tried
        if self.time_up:
            lines.append("The time limit ended the search: a longer --time-limit may find better pieces, or fewer.")
        elif not self.reached:
            lines.append("No pieces that were tried keep to the limits at so small a loss.")
        return lines

    def _fitted_to_motion(self) -> list[str]:
        """A sentence about pieces that were joined where no body went, with how far they fill a hollow there."""
        joined_rows = [row for row in self.bodies if row["how"].endswith(JOINED_LABEL)]
        overshoot_of_body = {
            row["body"]: row["after"]["reach_mm"] for row in joined_rows if row["after"]["reach_mm"] > 0.0
        }
        if not overshoot_of_body:
            return []
        filled_text = ", ".join(
            f"{body}: up to {words.length(reach / 1e3)}" for body, reach in overshoot_of_body.items()
        )
        return [
            f"Pieces joined by motion fill hollows where nothing went in this recording ({filled_text} beyond "
            f"the mesh). "
            "Record also the movements that must stay free."
        ]

    def as_json(self) -> dict[str, Any]:
        """Everything as plain data: what the manifest holds."""
        return {
            "engine": self.engine,
            "step_hz": self.step_hz,
            "most_triangles": MOST_TRIANGLES,
            "setting": self.setting,
            "max_false": self.limits.false,
            "max_missed": self.limits.missed,
            "max_pieces": self.limits.pieces,
            "reached": self.reached,
            "time_up": self.time_up,
            "before": self.before,
            "after": self.after,
            "front": list(self.front),
            "axes": self.axes,
            "not_tried": list(self.not_tried),
            "bodies": list(self.bodies),
        }


def fix_colliders(
    session_or_path: Session | str | Path,
    folder: str | Path | None = None,
    *,
    engine: str = "",
    limits: Limits = DEFAULT_LIMITS,
    time_limit: float | None = TIME_LIMIT_S,
    force: bool = False,
    progress: Progress | None = None,
    every_method: bool = False,
    **options: Any,
) -> ColliderFix:
    """Find the fewest convex pieces a body that keep to limits, replay the session with them, and write them.

    Bodies that are round about an axis are cut by height and angle, others by planes and V-HACD; fine pieces are joined
    where the motion of the session does not notice. The step is that of a new project
    of the engine, 50 Hz without one.

    Parameters
    ----------
    session_or_path : a session, or the file of one.
    folder : where the files go: ``report.html``, ``colliders.json``, ``session.mcap``, which carries the colliders, and
        for an engine ``BODY.glb`` with what it needs beside them; ``None``: nothing is written.
    engine : ``unity``, ``unreal``, ``godot`` or ``mujoco``; ``""``: none, and no files for one are written.
    limits : fractions of the contact time that may be false and missed, and the most pieces a body.
    time_limit : seconds for cutting and searching, after which the best pieces until then are taken; ``None``: no
        limit. Reading the session, counting the hulls, the report cards and the last run are not in it.
    force : replace an earlier folder of the kind.
    every_method : make report cards of boxes, spheres and capsules too, of V-HACD, and of CoACD where there is time.
    options : ``scene``, ``pairs``, ``start``, ``end``, ``policy``, ``tau`` and ``seed``, as ``replay.run``.

    Raises ``TradeoffError``: nothing touches, not even the hulls, or there is no such engine; ``OutputError``: the
    folder cannot be written; and as ``replay.run``.
    """
    progress = progress or Silent()
    target = engine_files(engine) if engine else None
    target_folder = Path(folder) if folder is not None else None
    if target_folder is not None:
        check_target(target_folder, force=force, kind=COLLIDERS_FOLDER)
    session = open_session(session_or_path, options.pop("scene", None))
    prepared_session = prepare(
        session,
        progress=progress,
        **{key: options[key] for key in ("pairs", "start", "end", "policy") if key in options},
    )
    if target is not None:
        _require_plain_names(prepared_session.assembly.names)
    step_hz = STEP_RATE_HZ if target is None else target.step_hz
    rate_setting = {} if step_hz >= FASTEST_RATE_RATIO * frame_rate(session.stamps() / 1e9) else {"rate_hz": step_hz}
    with progress.stage("Finding the contacts", 1) as advance:
        scoring = Scoring(
            prepared_session.assembly,
            parse_detector(TRUSTED_DETECTOR),
            options.get("seed", 0),
            options.get("tau", TWO_MICROMETRES),
            prepared_session.repaired.session,
        )
        advance(1)
    with progress.stage("Cutting and trying colliders", None if time_limit is None else 100) as advance:
        deadline = Deadline(time_limit, advance)
        search = ColliderSearch(prepared_session.assembly, scoring, rate_setting, limits, deadline)
        cuts_of_body = _card_cuts(search.ladders) if every_method else {}
        vhacd_cuts = [of_body["vhacd"] for of_body in cuts_of_body.values()]
        cut_ahead(vhacd_cuts, deadline.report, CARD_TIME_S if time_limit is None else time_limit)
        search.run()
        not_tried = search.not_tried + _late_cuts(search, cuts_of_body)
    axes = _file_axes(target, pose_convention(session.facts))
    with (
        nullcontext()
        if target_folder is None
        else result_folder(target_folder, COLLIDERS_FOLDER, force=force) as written_folder
    ):
        shipped_session, body_rows = _ship_pieces(session, search, target, written_folder, axes)
        shape_of_body: dict[str, BodyShape] = {}
        with progress.stage("Writing report cards", len(body_rows)) as advance:
            for row in body_rows:
                name = row["body"]
                hulls = search.ladders[name].pieces(0)
                row["before"] = row["after"] = _report_card_row(
                    prepared_session.assembly, scoring.reference, name, hulls
                )
                shape_of_body[name] = BodyShape(search.ladders[name].mesh, hulls, hulls)
                if search.steps[name]:
                    pieces = [TriangleMesh(piece.vertices, piece.faces) for piece in shipped_session.colliders[name]]
                    shape_of_body[name] = replace(shape_of_body[name], after=pieces)
                    row["after"] = _report_card_row(prepared_session.assembly, scoring.reference, name, pieces)
                other_cuts = _other_cuts(search.ladders[name], cuts_of_body.get(name, {})) if every_method else {}
                row["others"] = [
                    {"how": collider_description}
                    | _report_card_row(prepared_session.assembly, scoring.reference, name, convex_pieces(cut))
                    for collider_description, cut in other_cuts.items()
                ]
                advance(1)
        rate_text = "".join(f",{key}={value:g}" for key, value in rate_setting.items())
        hull, setting = (f"collider[shape={shape}{rate_text}]" for shape in ("compound,pieces=1", "shipped"))
        result = run(
            shipped_session, detectors={BEFORE_LABEL: hull, AFTER_LABEL: setting}, progress=progress, **options
        )
        fix = ColliderFix(
            engine="" if target is None else target.name,
            folder=target_folder,
            step_hz=step_hz,
            setting=setting,
            bodies=tuple(body_rows),
            before=_detector_figures(result, BEFORE_LABEL, sum(row["before"]["pieces"] for row in body_rows)),
            after=_detector_figures(result, AFTER_LABEL, sum(row["after"]["pieces"] for row in body_rows)),
            front=tuple(as_row(choice) for choice in search.front()),
            limits=limits,
            axes=axes,
            result=result,
            shapes=shape_of_body,
            time_up=search.time_up,
            steps=() if target is None else target.steps,
            not_tried=tuple(not_tried_sentences(not_tried)),
        )
        if written_folder is not None:
            if target is not None:
                (written_folder / "README.txt").write_text(_read_me_text(fix, target), "utf-8")
            (written_folder / REPORT_FILE).write_text(before_after_page(fix), "utf-8", newline="\n")
            write_summary(written_folder, COLLIDERS_FOLDER, {"schema": COLLIDERS_FOLDER.schema, **fix.as_json()})
    return fix


def before_after_page(fix: ColliderFix) -> str:
    """Returns the page that shows hulls before and pieces after, self-contained."""
    run_command = f'replay run session.mcap --detectors "{fix.setting}"' if fix.folder is not None else ""
    return cure_page(
        Cure(
            result=fix.result,
            before=fix.before,
            after=fix.after,
            bodies=fix.bodies,
            shapes=fix.shapes,
            front=fix.front,
            notes=fix.remarks,
            engine=fix.engine,
            steps=fix.steps,
            again=run_command,
        )
    )


def _file_axes(target: EngineFiles | None, poses: Convention) -> str:
    """Axes of the written files: those that a mesh has in the engine, which reads an OBJ as it is.

    An engine of OBJ files is right-handed, so that an OBJ in axes of left-handed poses would be mirrored there.
    """
    if target is None or poses.handedness != "right":
        return default_mesh_axes("glb", poses)
    return default_mesh_axes(target.file_type, poses)


def _require_plain_names(names: Sequence[str]) -> None:
    """Refuse names of bodies that no file can hold, before anything is cut. Raises ``TradeoffError``."""
    unfit_names = [name for name in names if safe_text(name) != name]
    if unfit_names:
        unfit_text = ", ".join(safe_text(name) for name in unfit_names)
        raise TradeoffError(
            f"bodies are called {unfit_text}: no engine takes control characters; rename them in the session"
        )


def _report_card_row(
    assembly: Assembly, reference: Reference, name: str, pieces: Sequence[TriangleMesh]
) -> dict[str, Any]:
    """The report card of a body with these pieces."""
    mesh = assembly.bodies[assembly.names.index(name)].mesh
    return shape_figures(mesh, pieces) | contact_figures(assembly, reference, name, pieces)


def _card_cuts(ladders: Mapping[str, Ladder]) -> dict[str, dict[str, Cut]]:
    """Cuts by V-HACD and CoACD that get a report card, of each body that can be cut: name of the body, method."""
    return {
        name: {method: Cut(ladder.mesh, method, CARD_PIECES) for method in OTHER_METHODS}
        for name, ladder in ladders.items()
        if not ladder.reason
    }


def _late_cuts(search: ColliderSearch, cuts: Mapping[str, Mapping[str, Cut]]) -> list[tuple[str, Cut]]:
    """Cut by CoACD for report cards what there is time for; the name of the body and the cut of each of the others."""
    name_and_cut_of_key = {cut.key: (name, cut) for name, of_body in cuts.items() for cut in of_body.values()}
    not_tried = {cut.key for _, cut in search.not_tried}
    not_cut_by_key = search.cut_in_time([cut for _, cut in name_and_cut_of_key.values()])
    return [
        name_and_cut_of_key[key] for key, not_cut in not_cut_by_key.items() if not_cut.late and key not in not_tried
    ]


def _other_cuts(ladder: Ladder, cuts: Mapping[str, Cut]) -> dict[str, Cut]:
    """Other colliders of a body, in words: solids of one piece, and those of ``cuts`` that are cut by now."""
    solids = {METHODS[name].words: Cut(ladder.mesh, name, 1) for name in ("box", "sphere", "capsule")}
    cuts_by_label = {f"{cut.row.words}, {cut.most} at most": cut for cut in cuts.values() if cut.is_ready}
    return solids | cuts_by_label


def _detector_figures(result: RunResult, label: str, pieces: int) -> dict[str, Any]:
    """Returns the errors, milliseconds and number of pieces of a detector of the run."""
    seconds = result.document.detectors[label].seconds
    p99_ms = None if seconds.p99 is None else 1e3 * seconds.p99
    return errors_of_detector(result, label) | {"ms": 1e3 * seconds.per_frame_mean, "p99_ms": p99_ms, "pieces": pieces}


def _ship_pieces(
    session: Session, search: ColliderSearch, target: EngineFiles | None, written_folder: Path | None, axes: str
) -> tuple[Session, list[dict[str, Any]]]:
    """The session with the pieces as a file gives them back, and a row a body; the files where a folder is given."""
    from sessions import write_session

    poses = pose_convention(session.facts)
    colliders: dict[str, tuple[MeshData, ...]] = {}
    in_files: dict[str, list[MeshData]] = {}
    body_rows: list[dict[str, Any]] = []
    files = _file_names(list(search.ladders))
    for name, solids in search.pieces().items():
        file_name, ladder = files[name], search.ladders[name]
        in_file = [from_body_axes(_in_glb_numbers(solid), axes, poses) for solid in solids]
        mesh = from_body_axes(_in_glb_numbers(ladder.mesh), axes, poses)
        colliders[name] = tuple(in_body_axes(solid, axes, poses) for solid in _pieces_read_back(name, in_file))
        in_files[file_name] = in_file
        if written_folder is not None and target is not None:
            (written_folder / f"{file_name}.glb").write_bytes(_pieces_glb(name, mesh, in_file, target))
        body_rows.append(
            {
                "body": name,
                "file": f"{file_name}.glb" if written_folder is not None and target is not None else "",
                "how": ladder.how(search.steps[name]),
                "reason": ladder.reason,
            }
        )
    shipped_session = replace(session, colliders=colliders)
    if written_folder is not None:
        for extra_file, extra_text in ({} if target is None else target.extra(in_files)).items():
            (written_folder / extra_file).write_text(extra_text, "utf-8")
        write_session(shipped_session, written_folder / "session.mcap")
    return shipped_session, body_rows


def _pieces_glb(name: str, mesh: MeshData, pieces: Sequence[MeshData], target: EngineFiles) -> bytes:
    """A node a piece, named as the engine wants it; the body's own mesh beside them where the engine wants that."""
    from sessions.meshes.glb import meshes_to_glb

    mesh_of_node = {name: mesh} if target.has_mesh else {}
    mesh_of_node |= {target.node.format(body=name, number=k): piece for k, piece in enumerate(pieces)}
    return meshes_to_glb(mesh_of_node)


def _pieces_read_back(name: str, pieces: Sequence[MeshData]) -> tuple[MeshData, ...]:
    """The pieces as a reader of the written file has them: what is counted is what is shipped."""
    from sessions.meshes.glb import meshes_to_glb
    from sessions.meshes.mesh_match import read_colliders

    with temporary_folder() as folder:
        file = folder / "pieces.glb"
        file.write_bytes(meshes_to_glb({f"UCX_{name}_{k:02d}": piece for k, piece in enumerate(pieces)}))
        return read_colliders(file, [name]).solids[name]


def _read_me_text(fix: ColliderFix, target: EngineFiles) -> str:
    """Returns the read-me: contents of the folder, steps in the engine, command to measure again."""
    lines = [f"Colliders for {target.name}, from the motion of a recorded session.", ""]
    lines += [f"{number}. {step}" for number, step in enumerate(target.steps, 1)]
    lines += ["", f"Source: {target.page}", "", "colliders.json holds the figures. To count them again:"]
    return "\n".join([*lines, f'replay run session.mcap --detectors "{fix.setting}"', ""])


def _percent(fraction: float | None) -> str:
    return words.as_percentage(fraction or 0.0)


def _file_names(names: Sequence[str]) -> dict[str, str]:
    """Name of a body -> its name as that of a file, where signs are left out with a number.

    No two are the same where capital letters do not count, as on Windows and macOS.
    """
    plain_name_of_body = {
        name: re.sub(r"[^A-Za-z0-9._-]", "", name).lstrip(".")[:LONGEST_NAME_CHARACTERS] for name in names
    }
    files: dict[str, str] = {}
    taken_names: set[str] = set()
    # Names that are files' as they are come first: no other one takes them.
    for number, name in sorted(enumerate(names), key=lambda item: plain_name_of_body[item[1]] != item[1]):
        file_name = plain_name_of_body[name] or "body"
        is_device = file_name.partition(".")[0].lower() in WINDOWS_DEVICES
        if file_name != name or file_name.lower() in taken_names or is_device:
            file_name = next(
                numbered_name for k in count(number) if (numbered_name := f"{file_name}-{k}").lower() not in taken_names
            )
        files[name] = file_name
        taken_names.add(file_name.lower())
    return files


def _in_glb_numbers(piece: TriangleMesh) -> MeshData:
    """The piece in the numbers that a GLB has for any program."""
    return MeshData(piece.vertices.astype(np.float32).astype(np.float64), piece.faces)
