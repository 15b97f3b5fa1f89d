"""``replay fix``: the colliders to ship, measured on the motion of a session, as files that an engine takes."""

from dataclasses import asdict
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import EXIT_FAILURE, EXIT_OK, People, TerminalProgress, answer, show
from replay.cli.options import ANY_PATH, SESSION_FILE, SHARE, Number, force, reporting, scene, tau

if TYPE_CHECKING:
    from replay.running.collider_files import ColliderFix

ENGINE_HELP = "Write files for unity, unreal, godot or mujoco."
OUT_HELP = "Folder for page and files.  [default: fix-ENGINE, or fix-page]"
FALSE_HELP = "Largest fraction of the reported contact time that may be false."
MISSED_HELP = "Largest fraction of the contact time that may be missed."
PIECES_HELP = "Most convex pieces a body."
LIMIT_HELP = "Time limit for cutting and searching; then the best pieces are taken."

PAGE_FOLDER = Path("fix-page")
"""Folder of the page where no engine is named; an earlier one is replaced."""


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION")
@click.option("--engine", metavar="NAME", default="", help=ENGINE_HELP)
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help=OUT_HELP)
@click.option("--max-false", type=SHARE, default=0.2, show_default=True, metavar="SHARE", help=FALSE_HELP)
@click.option("--max-missed", type=SHARE, metavar="SHARE", help=MISSED_HELP)
@click.option("--max-pieces", type=click.IntRange(min=1), metavar="N", help=PIECES_HELP)
@click.option("--time-limit", type=Number(min=0), default=60.0, show_default=True, metavar="SECONDS", help=LIMIT_HELP)
@click.option("--start", type=Number(), metavar="SECONDS", help="Leave out what comes before.")
@click.option("--end", type=Number(), metavar="SECONDS", help="Leave out what comes after.")
@scene
@tau
@force
@reporting
def command(
    session: Path,
    engine: str,
    out: Path | None,
    max_false: float,
    max_missed: float | None,
    max_pieces: int | None,
    people: People,
    as_json: bool,
    **options: Any,
) -> int:
    """Find the colliders to ship for SESSION: the fewest convex pieces a body that keep false contact low.

    A body whose pieces miss as much contact as they save keeps its hull.

    It cuts the bodies, replays the motion with many choices of pieces, prints a report card, and writes a page with
    before and after. With --engine it writes files that the engine takes too, and prints the command that counts them
    again. Ctrl-C keeps the pieces that are cut: the same command goes on from them. Exit code 1: a limit is not
    reached.

    \b
    replay fix session.mcap
    replay fix session.mcap --engine unity
    replay fix session.mcap --engine godot -o game/colliders --max-false 0.05
    """
    from replay.advice.collider_search import Limits
    from replay.cutting.piece_store import PIECES_ARE_KEPT, pieces_are_stored
    from replay.detection.compile_notice import compiling_announced
    from replay.running.collider_files import fix_colliders

    folder = out or (Path(f"fix-{engine}") if engine else PAGE_FOLDER)
    if folder == PAGE_FOLDER:
        options["force"] = True
    limits = Limits(false=max_false, missed=max_missed, pieces=max_pieces)
    try:
        with compiling_announced(people):
            fix = fix_colliders(
                session,
                folder,
                engine=engine,
                limits=limits,
                progress=TerminalProgress(people),
                every_method=people.verbose,
                **options,
            )
    except KeyboardInterrupt:
        if pieces_are_stored():
            people.say(PIECES_ARE_KEPT)
        raise
    answer(as_json, fix.as_json() | {"limits": asdict(limits)}, lambda: fix_screen(fix, people))
    if not as_json:
        show(_fix_sentences(fix, str(session)))
    return EXIT_OK if fix.reached else EXIT_FAILURE


def fix_screen(fix: "ColliderFix", people: People) -> Any:
    """The tables that a terminal shows of the colliders that were found."""
    from replay.cli.terminal import stacked
    from replay.document.cost import busy_text
    from replay.show.fix_table import before_after_table, card_table, front_table

    contacts = fix.result.ranking[-1].contacts if fix.result.ranking else 0
    busy_sentence = busy_text(fix.result.document)
    body_cards = card_table(fix.bodies)
    error_table = before_after_table(
        fix.before, fix.after, contacts=contacts, step_hz=fix.step_hz, busy_note=busy_sentence
    )
    if people.verbose:
        return stacked(body_cards, front_table(fix.front), error_table)
    return stacked(body_cards.narrow(), error_table.narrow())


def _fix_sentences(fix: "ColliderFix", session: str) -> list[str]:
    """Sentences about errors reached, uncut bodies, steps in the engine, and the command to measure again."""
    from replay.document.headline import open_questions
    from replay.document.placeholders import RECORDING
    from replay.show.fix_page.page import cure_sentences

    lines = [text.replace(RECORDING, quote(session)) for text in open_questions(fix.result.document)]
    lines.append(cure_sentences(fix.result, fix.before, fix.after))
    lines += fix.remarks
    assert fix.folder is not None
    run_command = f'replay run {quote(str(fix.folder / "session.mcap"))} --detectors "{fix.setting}"'
    page = ["Before and after:", f"  {fix.folder / 'report.html'}"]
    if not fix.engine:
        write_commands = ["To write them for your engine:", f"  replay fix {quote(session)} --engine unity"]
        return ["", *lines, *page, "Count it again:", f"  {run_command}", *write_commands]
    written_sentence = (
        f"Wrote {fix.folder} for {fix.engine}: a GLB a body, README.txt, colliders.json, session.mcap, report.html."
    )
    return [
        "",
        *lines,
        written_sentence,
        *fix.steps,
        *steps_about_axes(fix),
        *page,
        "Count it again:",
        f"  {run_command}",
    ]


def steps_about_axes(fix: "ColliderFix") -> list[str]:
    """Returns a sentence where the files suit a mesh that was imported as glTF, and no other."""
    from sessions.meshes.mesh_axes import GLTF

    if fix.engine in ("Unity", "Unreal Engine") and fix.axes == GLTF:
        return [f"The poses are not in axes of {fix.engine}: pieces fit a mesh imported there as glTF."]
    return []
