"""``replay doctor``: what is wrong with recordings, worst first, and what to do about each thing."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from replay.cli.console import GATE_FAILED, OK, People, answer
from replay.cli.options import SESSION_ANYWHERE, SESSION_FILE, reporting, scene
from replay.document.tables import ERROR, FAINT, WARNING, Table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from sessions.doctor.finding import Finding

WORDS: Final = ("note", "warning", "error")
MARKS: Final = (FAINT, WARNING, ERROR)


@click.command()
@click.argument("files", type=SESSION_ANYWHERE, nargs=-1, required=True, metavar="FILE...")
@click.option("--fail-on", type=click.Choice(WORDS), metavar="SEVERITY", help=f"Exit with 4 from: {', '.join(WORDS)}.")
@click.option("--look", is_flag=True, help="Pictures of the scene, and questions on what its import guessed.")
@click.option("--answer", "answers", multiple=True, metavar="1b", help="Answer a question of --look. Repeatable.")
@click.option(
    "--mapping", type=SESSION_FILE, metavar="FILE", help="A mapping that gets the answers too, or loses them."
)
@click.option("--forget-answers", is_flag=True, help="Undo the answers to the questions of --look.")
@scene
@reporting
def command(
    files: tuple[Path, ...],
    fail_on: str | None,
    scene: Path | None,
    as_json: bool,
    people: People,
    look: bool,
    answers: tuple[str, ...],
    forget_answers: bool,
    mapping: Path | None,
) -> int:
    """Say what is suspicious about a recording: FILE is a session (MCAP), a mesh, or a scene (TOML).

    \b
    replay doctor session.mcap
    replay doctor *.mcap --format json --fail-on warning
    replay doctor session.mcap --look
    """
    if look or answers or forget_answers:
        return _look(files, people, as_json=as_json, answers=answers, forgets=forget_answers, mapping=mapping)
    from replay.cli.terminal import terminal
    from replay.effects.effect_plan import plan_faults
    from replay.running.remote_files import local_copy
    from replay.words import plural
    from sessions import examine
    from sessions.doctor.finding import in_order

    findings_of_file = {}
    for file in files:
        with local_copy(file) as here:
            findings_of_file[file] = in_order(
                [*examine(here, scene=scene, planned=plan_faults), *_inside_findings(here)]
            )
    plain = [
        {"file": str(file), "findings": [finding.as_json() for finding in some]}
        for file, some in findings_of_file.items()
    ]
    lines = (entry for file, some in findings_of_file.items() for entry in _report(file, some, people.verbose))
    answer(as_json, plain, lambda: terminal(*lines))
    bad = (
        sum(finding.severity >= WORDS.index(fail_on) for some in findings_of_file.values() for finding in some)
        if fail_on
        else 0
    )
    if bad:
        people.say(f"{plural(bad, 'finding')} of severity {fail_on} or worse")
    return GATE_FAILED if bad else OK


def _inside_findings(file: Path) -> "Iterator[Finding]":
    """Why it may be undecided what is inside a mesh of a session or in a mesh file; nothing of one that is refused."""
    from replay.prepare.inside_findings import inside_findings
    from sessions import load_mesh, read_session
    from sessions.doctor.examine import MESH_FILES
    from sessions.errors import SessionError

    kind = file.suffix.lower()
    try:
        if kind in MESH_FILES:
            yield from inside_findings({file.stem: load_mesh(file)})
        elif kind == ".mcap":
            yield from inside_findings(read_session(file).meshes)
    except SessionError:
        return


def _look(
    files: Sequence[Path],
    people: People,
    *,
    as_json: bool,
    answers: Sequence[str],
    forgets: bool,
    mapping: Path | None,
) -> int:
    """Show one recording and ask what its import guessed, or forget what was answered."""
    from replay.cli.look import forget_answers, look_at, parse_answers

    if len(files) != 1 or files[0].suffix.lower() != ".mcap" or not files[0].is_file():
        raise click.UsageError("--look, --answer and --forget-answers are for one session file: FILE.mcap")
    if forgets:
        return forget_answers(files[0], people, mapping=mapping)
    return look_at(files[0], people, as_json=as_json, given=parse_answers(answers), mapping=mapping)


def _report(file: Path, findings: "Sequence[Finding]", verbose: bool) -> "Iterator[Table | RenderableType]":
    from rich.text import Text

    from replay.cli.terminal import plain
    from replay.show.run_tables import finding_table

    yield plain(file.name, "bold").append_text(Text.from_markup(f"  {headline(findings)}", style="not bold"))
    notes = Counter(finding.code for finding in findings if WORDS[finding.severity] == "note")
    listed = [finding for finding in findings if verbose or WORDS[finding.severity] != "note"]
    if listed:
        made = finding_table(sorted(listed, key=lambda finding: -finding.severity), "", marks=MARKS)
        yield made.only("code", "severity", "body", "seconds", "what")
    if notes and not verbose:
        codes = ", ".join(f"{code} ({count})" if count > 1 else code for code, count in notes.items())
        yield plain(f"  notes (-v lists them): {codes}", "dim")


def headline(findings: "Sequence[Finding]") -> str:
    """One clause: how bad it is."""
    from replay.show.words import NOTHING_SUSPICIOUS
    from replay.words import plural

    count = Counter(WORDS[finding.severity] for finding in findings)
    bad = {"error": "bold magenta", "warning": "yellow"}  # not red: that is for misses
    counts = [f"[{colour}]{plural(count[word], word)}[/]" for word, colour in bad.items() if count[word]]
    return ", ".join(counts) or f"[green]{NOTHING_SUSPICIOUS.lower()}[/green]"
