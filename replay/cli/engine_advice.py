"""``replay tradeoff --engine``: settings of an engine in its words, which to take, and colliders to ship with it."""

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, Final

from replay import words
from replay.base.constants import RECORDING
from replay.cli.console import FAILURE, OK, People, TerminalProgress, answer, show

if TYPE_CHECKING:
    from replay.api.collider_files import Shipped

GLTF_IMPORTERS: Final = ("Unity", "Unreal Engine")
"""Engines that turn the meshes of a glTF file on import."""


def advise_engine(session: Path, engine: str, people: People, *, as_json: bool, **asked: Any) -> int:
    """Print and write what the settings of an engine came to; the exit code of the run behind it."""
    from rich.text import Text

    from replay.api.advisor import advise
    from replay.cli.run_report import answer_cited, close_run, sources_of, where_to_look
    from replay.cli.terminal import line, terminal
    from replay.cutting.piece_store import cache_folder
    from replay.outputs.tradeoff_table import engine_table
    from replay.pipeline.headline import open_questions

    if not any(cache_folder().glob("cut-*")):
        people.say("cutting meshes into convex pieces, once per machine: about ten seconds each ...")
    advice = advise(session, engine=engine, progress=TerminalProgress(people), **asked)
    undecided = [text.replace(RECORDING, quote(str(session))) for text in open_questions(advice.result.document)]
    plain = {
        "engine": advice.engine.name, "version": advice.engine.version, "pages": dict(advice.engine.pages),
        "rows": list(advice.rows), "advice": list(advice.sentences), "open_questions": undecided,
    }  # fmt: skip
    table = engine_table(advice.engine, advice.rows, advice.result, settings=people.verbose)
    sentences = map(line, [*advice.sentences, *undecided])
    answer_cited(as_json, plain, lambda: terminal(table, Text(), *sentences), sources_of(advice.result, people))
    code = close_run(advice.result, people)
    if advice.result.out is not None:
        people.say(*where_to_look(advice.result))
    return code


def write_colliders(session: Path, folder: Path, people: People, *, as_json: bool, **asked: Any) -> int:
    """Write the pieces and print before and after; exit code 1 where false contact stays above what was asked for."""
    from replay.api.collider_files import ship_colliders
    from replay.cli.terminal import terminal
    from replay.detection.compile_notice import compiling_announced
    from replay.outputs.tradeoff_table import before_after, piece_table
    from replay.pipeline.headline import open_questions

    with compiling_announced(people):
        shipped = ship_colliders(session, folder, progress=TerminalProgress(people), **asked)
    tables = [before_after(shipped.before, shipped.after, shipped.result, shipped.engine)]
    if people.verbose:
        tables.append(piece_table(shipped.bodies))
    undecided = [text.replace(RECORDING, quote(str(session))) for text in open_questions(shipped.result.document)]
    answer(as_json, {**shipped.as_json(), "open_questions": undecided}, lambda: terminal(*tables))
    if not as_json:
        show([*undecided, *_sentences(shipped)])
    return OK if shipped.reached else FAILURE


def _sentences(shipped: "Shipped") -> list[str]:
    """What was reached, what the engine does with the files, and how to count it again."""

    from sessions.meshes.mesh_axes import GLTF

    false, limit = words.percentage(100 * (shipped.after["false"] or 0.0)), words.percentage(100 * shipped.max_false)
    lines = [f"{false} % of the contact time is false; the limit is {limit} %."]
    if shipped.time_up:
        lines.append("The time limit ended the search: a longer --time-limit may find better pieces, or fewer.")
    elif not shipped.reached:
        lines.append("No split got below that. Try a faster step or a higher --max-false.")
    outside = max(row["outside_mm"] for row in shipped.bodies)
    lines.append(f"Every mesh lies within its pieces, or outside by {outside:.2f} mm at most.")
    if shipped.engine.name == "Unity":
        lines.append("Triggers report contacts and do not push; each piece is a Convex Mesh Collider.")
        lines.append("Unity reads GLB by a package: add com.unity.cloud.gltfast (glTFast), or UnityGLTF.")
    if shipped.engine.name == "Unreal Engine":
        lines.append("Import each GLB whole: the mesh in it takes the UCX_ pieces beside it as its collision.")
    if shipped.engine.name in GLTF_IMPORTERS and shipped.axes == GLTF:
        lines.append(f"The poses are not in axes of {shipped.engine.name}: pieces fit a mesh imported there as glTF.")
    again = f'replay run {shipped.folder / "session.mcap"} --detectors "{shipped.setting}"'
    wrote = f"Wrote {shipped.folder}: a GLB a body, colliders.json, session.mcap. Count it again:"
    return ["", *lines, wrote, f"  {again}"]
