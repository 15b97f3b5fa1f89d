"""``replay annotate``: what a person thinks of one miss, kept with its contact."""

from dataclasses import asdict, replace
from pathlib import Path

import click

from replay.cli.console import People, answer
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, force, reporting

TAGS = ("real", "artefact", "unsure")
MOST_WORDS = 2000
"""Characters of a note."""


@click.command()
@click.argument("run", type=RUN_FOLDER, metavar="RUN")
@click.argument("text", default="")
@click.option("--miss", type=click.IntRange(min=1), metavar="N", help="Of the miss of this number.")
@click.option("--false", type=click.IntRange(min=1), metavar="N", help="Of the false contact of this number.")
@click.option("--by", metavar="LABEL", help="Of which detector, where several have one of that number.")
@click.option("--tag", type=click.Choice(TAGS), default="unsure", show_default=True,
              help="Whether the contact is real.")  # fmt: skip
@click.option("--rater", metavar="NAME", help="Who says so; a short name is enough.")
@click.option("--session", type=SESSION_FILE, metavar="FILE", help="The recording, where it is not found by itself.")
@click.option("--session-out", type=ANY_PATH, metavar="FILE.mcap", help="Write a copy of the recording that holds all.")
@force
@reporting
def command(
    run: Path, text: str, miss: int | None, false: int | None, by: str | None, tag: str, rater: str | None,
    session: Path | None, session_out: Path | None, force: bool, as_json: bool, people: People,
) -> int:  # fmt: skip
    """Say what a miss or a false contact is, in words and a tag; without a number, list what was said.

    It is kept in RUN/annotations.json by recording, pair and time, so it stays with its contact when numbers change;
    the report and the picture of the run show it. The recording itself is never changed.

    \b
    replay annotate run1 --miss 4 "hand went through the wall" --tag real --rater anna
    replay annotate run1
    replay annotate run1 --session-out annotated.mcap
    """
    from replay.cli.terminal import terminal
    from replay.outputs.results import annotations
    from replay.outputs.results.run_folder import read_run_folder

    if miss is not None and false is not None:
        raise click.UsageError("name one of --miss N and --false N")
    folder = read_run_folder(run)
    if miss is not None or false is not None:
        if not text.strip() or not (rater or "").strip():
            raise click.UsageError('say what it is and who says so: "hand went through the wall" --rater anna')
        if len(text) > MOST_WORDS:
            raise click.UsageError(f"the note has {len(text)} characters; {MOST_WORDS} are kept at most")
        fault = annotations.fault_of(folder, "miss" if miss is not None else "false", miss or false or 0, by)
        said_now = replace(fault.where, text=text.strip(), tag=tag, rater=(rater or "").strip())
        annotations.add_annotation(folder, said_now)
    elif text:
        raise click.UsageError("say of which contact, with --miss N or --false N")
    if session_out is not None:
        annotations.annotated_session(folder, session, session_out, force=force)
        people.say(f"wrote {session_out}, a copy of the recording with what was said in it")
    said, faults = annotations.read_annotations(run), annotations.faults_of(folder)
    plain = [asdict(one) | {"contact": annotations.now_called(folder, one, faults)} for one in said]
    none = f"nothing is said of {run} yet"
    answer(as_json, plain, lambda: terminal(annotations.annotation_table(folder, said)) if said else none)
    return 0
