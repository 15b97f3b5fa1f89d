"""``replay paper``: the paper's tables and figures, regenerated beside what it printed."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import OK, People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, reporting

if TYPE_CHECKING:
    from rich.console import Group

    from replay.outputs.paper_table import PaperTable


@click.command()
@click.option("--quick", is_flag=True, help="Three columns, two poses each: under a minute once compiled.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of poses and searches.")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Write figure_7.png and figure_8.png here.")
@reporting
def command(quick: bool, seed: int, out: Path | None, as_json: bool, people: People) -> int:
    """Regenerate Table I, Fig. 7 and Fig. 8 with exact truth; printed values stand in a column of their own.

    Without --quick: the ten columns of Table I with 20 poses each, 1,000 random poses about first touch of each family
    of meshes, and three sessions.

    \b
    replay paper --quick
    replay paper --out paper
    """
    from replay.studies.paper.experiment import FULL, QUICK, run_paper
    from replay.studies.paper.verdict import as_json as plain
    from replay.studies.paper.verdict import verdict_of

    size = QUICK if quick else FULL
    result = run_paper(
        targets=size.targets, poses=size.poses, near=size.near, sessions=size.sessions, seed=seed,
        progress=TerminalProgress(people),
    )  # fmt: skip
    answer(as_json, plain(result), lambda: paper_tables(result.tables))
    if not as_json:
        answer(False, None, lambda: [f"- {sentence}" for sentence in verdict_of(result.tables)])
    if result.hard:
        people.say(f"FCL lists other pairs than there are in {result.hard} of {len(result.fixtures)} fixtures")
    if out is not None:
        from replay.studies.paper.pictures import write_pictures

        people.say(*(f"wrote {path}" for path in write_pictures(result.tables, out)))
    return OK


def paper_tables(tables: "Sequence[PaperTable]") -> "Group":
    """All tables, each with its note below it."""
    from replay.cli.terminal import terminal

    return terminal(*(one.plain for one in tables))
