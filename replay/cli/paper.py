"""``replay paper``: the paper's tables and figures, regenerated beside what it printed."""

from dataclasses import asdict, replace
from pathlib import Path

import click

from replay.cli.console import EXIT_OK, People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, reporting


@click.command()
@click.option("--quick", is_flag=True, help="Three columns, two poses each: under a minute once compiled.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of poses and searches.")
@click.option(
    "--out", "-o", type=ANY_PATH, metavar="DIR", help="Write figure_7.png and figure_8.png here (extra: plots)."
)
@reporting
def command(quick: bool, seed: int, out: Path | None, as_json: bool, people: People) -> int:
    """Regenerate Table I, Fig. 7 and Fig. 8 with exact truth; printed values stand in a column of their own.

    Without --quick: the ten columns of Table I with 20 poses each, and 1,000 random poses about first touch of each
    family of meshes.

    \b
    replay paper --quick
    replay paper --out paper
    """
    from replay.cli.terminal import stacked
    from replay.studies.paper import experiment
    from replay.studies.paper.pictures import require_matplotlib, write_pictures

    if out is not None:
        require_matplotlib()
    experiment_size = experiment.QUICK_SIZE if quick else experiment.FULL_SIZE
    tables = experiment.run_paper(experiment_size, seed, TerminalProgress(people))
    table_records = [
        {"key": table.key, "title": table.title, "head": table.head, "rows": table.rows, "note": table.notes[0]}
        for table in tables
    ]
    json_value = {"version": 5, "experiment": asdict(experiment_size) | {"seed": seed}, "tables": table_records}
    answer(
        as_json, json_value, lambda: stacked(*(replace(table, title=f"{table.key}: {table.title}") for table in tables))
    )
    if out is not None:
        people.say(*(f"wrote {path}" for path in write_pictures(tables, out)))
    return EXIT_OK
