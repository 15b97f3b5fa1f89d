"""``replay diff``: two run folders beside each other, in words or as JSON."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import People, answer
from replay.cli.options import ANY_PATH, reporting

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.document.tables import Table
    from replay.studies.diff.runs import RunDiff

MOST_ROWS = 20
"""Contacts listed of each detector; JSON holds them all."""

COMPARE_HELP = "Compare detector OLD of RUN_A with NEW of RUN_B; the usual choice is by label, then by what is alike."


@click.command()
@click.argument("run_a", type=ANY_PATH, metavar="RUN_A")
@click.argument("run_b", type=ANY_PATH, metavar="RUN_B")
@click.option("--different-sessions", is_flag=True, help="Compare runs of two recordings; else they are refused.")
@click.option("--compare", multiple=True, metavar="OLD=NEW", help=COMPARE_HELP)
@reporting
def command(
    run_a: Path, run_b: Path, different_sessions: bool, compare: tuple[str, ...], as_json: bool, people: People
) -> int:
    """Say whether RUN_B is better than RUN_A, which contacts it gained, lost or shifted, and what was set differently.

    \b
    replay diff runs/before runs/after
    replay diff runs/before runs/after --compare hull50=shipped50
    replay view runs/before runs/after
    """
    from replay.cli.terminal import stacked
    from replay.document.coding import plain_of
    from replay.show.results.run_folder import PICTURE_FILE
    from replay.studies.diff.runs import diff_runs

    difference = diff_runs(run_a, run_b, different_sessions=different_sessions, compared_labels=_labels(compare))
    json_value = plain_of(difference) | {"changed": difference.changed}
    answer(as_json, json_value, lambda: stacked(*_diff_report(difference, run_a, run_b)))
    if "machine" in {name.partition(".")[0] for name in difference.settings}:
        people.say("note: the runs are of different machines; their times do not compare")
    if all((run / PICTURE_FILE).is_file() for run in (run_a, run_b)):
        people.say(f"open both in one viewer: replay view {run_a} {run_b}")
    return 0


def _labels(pairs: tuple[str, ...]) -> list[tuple[str, str]]:
    """The labels of ``--compare``."""
    labels = []
    for pair in pairs:
        label_before, equals, label_after = pair.partition("=")
        if not (label_before and equals and label_after):
            raise click.BadParameter(
                f"{pair!r} is not OLD=NEW, a label of RUN_A and one of RUN_B", param_hint="--compare"
            )
        labels.append((label_before, label_after))
    return labels


def _diff_report(difference: "RunDiff", run_a: Path, run_b: Path) -> "Iterator[Table | RenderableType]":
    from replay.cli.terminal import line
    from replay.document.tables import STRONG
    from replay.studies.diff.diff_words import change_lines, diff_table, settings_lines

    yield line(difference.answer, STRONG)
    yield line(f"before: {run_a}; after: {run_b}")
    yield from map(line, settings_lines(difference))
    for side, labels in ((run_a, difference.only_a), (run_b, difference.only_b)):
        if labels:
            yield line(f"only in {side}: {', '.join(labels)}")
    yield diff_table(difference)
    for label, detector in difference.detectors.items():
        change_texts = [*change_lines(detector)]
        yield from (line(f"{label}: {text}") for text in change_texts[:MOST_ROWS])
        if len(change_texts) > MOST_ROWS:
            yield line(f"{label}: … and {len(change_texts) - MOST_ROWS} more with --format json")
