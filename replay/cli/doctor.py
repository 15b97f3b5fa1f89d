"""``replay doctor``: what is wrong with recordings, worst first, and what to do about each thing."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from replay.cli.console import EXIT_GATE_FAILED, EXIT_OK, People, answer
from replay.cli.options import SESSION_ANYWHERE, SESSION_FILE, reporting, scene
from replay.document.tables import ERROR, FAINT, WARNING, Table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from sessions.doctor.finding import Finding

SEVERITY_NAMES: Final = ("note", "warning", "error")
SEVERITY_MARKS: Final = (FAINT, WARNING, ERROR)


@click.command()
@click.argument("files", type=SESSION_ANYWHERE, nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--fail-on",
    type=click.Choice(SEVERITY_NAMES),
    metavar="SEVERITY",
    help=f"Exit with 4 from: {', '.join(SEVERITY_NAMES)}.",
)
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
        return _ask_about_import(
            files, people, as_json=as_json, answers=answers, forgets=forget_answers, mapping=mapping
        )
    from replay.cli.terminal import stacked
    from replay.effects.effect_plan import plan_faults
    from replay.running.remote_files import local_copy
    from replay.words import plural
    from sessions import examine
    from sessions.doctor.finding import in_order

    findings_of_file = {}
    for file in files:
        with local_copy(file) as local_file:
            findings_of_file[file] = in_order(
                [*examine(local_file, scene=scene, planned=plan_faults), *_inside_findings(local_file)]
            )
    json_value = [
        {"file": str(file), "findings": [finding.as_json() for finding in file_findings]}
        for file, file_findings in findings_of_file.items()
    ]
    report_lines = (
        entry
        for file, file_findings in findings_of_file.items()
        for entry in _findings_report(file, file_findings, people.verbose)
    )
    answer(as_json, json_value, lambda: stacked(*report_lines))
    failing_count = (
        sum(
            finding.severity >= SEVERITY_NAMES.index(fail_on)
            for file_findings in findings_of_file.values()
            for finding in file_findings
        )
        if fail_on
        else 0
    )
    if failing_count:
        people.say(f"{plural(failing_count, 'finding')} of severity {fail_on} or worse")
    return EXIT_GATE_FAILED if failing_count else EXIT_OK


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


def _ask_about_import(
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


def _findings_report(file: Path, findings: "Sequence[Finding]", verbose: bool) -> "Iterator[Table | RenderableType]":
    from rich.text import Text

    from replay.cli.terminal import plain_text
    from replay.show.run_tables import finding_table

    yield plain_text(file.name, "bold").append_text(
        Text.from_markup(f"  {severity_headline(findings)}", style="not bold")
    )
    note_counts = Counter(finding.code for finding in findings if SEVERITY_NAMES[finding.severity] == "note")
    listed_findings = [finding for finding in findings if verbose or SEVERITY_NAMES[finding.severity] != "note"]
    if listed_findings:
        findings_table = finding_table(
            sorted(listed_findings, key=lambda finding: -finding.severity), "", marks=SEVERITY_MARKS
        )
        yield findings_table.only("code", "severity", "body", "seconds", "what")
    if note_counts and not verbose:
        codes = ", ".join(f"{code} ({count})" if count > 1 else code for code, count in note_counts.items())
        yield plain_text(f"  notes (-v lists them): {codes}", "dim")


def severity_headline(findings: "Sequence[Finding]") -> str:
    """One clause: how bad it is."""
    from replay.show.words import NOTHING_SUSPICIOUS
    from replay.words import plural

    count_of_word = Counter(SEVERITY_NAMES[finding.severity] for finding in findings)
    colour_of_word = {"error": "bold magenta", "warning": "yellow"}  # not red: that is for misses
    count_texts = [
        f"[{colour}]{plural(count_of_word[word], word)}[/]"
        for word, colour in colour_of_word.items()
        if count_of_word[word]
    ]
    return ", ".join(count_texts) or f"[green]{NOTHING_SUSPICIOUS.lower()}[/green]"
