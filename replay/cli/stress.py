"""``replay stress``: detectors on hard triangle pairs and bodies whose answer is known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, detectors_named, reporting, tau
from replay.document.tables import Table, table

if TYPE_CHECKING:
    from rich.console import Group

    from replay.studies.stress.tally import StressResult, Tally

QUICK_PAIRS: Final = 200

COUNT_HEADINGS: Final = {
    "missed": "missed",
    "invented": "invented",
    "within": "within tolerance",
    "refused": "refused",
    "unconfirmed": "unconfirmed",
    "changed": "changed",
}
"""Field of a tally -> its heading."""

SECTION_TITLES: Final = {"family": "triangle pairs of all families", "case": "cases of whole bodies"}


@click.command()
@click.option(
    "--detectors",
    "--detector",
    "detector",
    default="all",
    show_default=True,
    metavar="SPECS",
    callback=detectors_named,
    help="Detectors, as run takes them, or all; several with commas.",
)
@click.option("--family", metavar="RANGE", help="Run families: 9, 3-5 or 1,7-9.")
@click.option("--case", metavar="RANGE", help="Run cases of whole bodies: 29, 27-28,41 or all (from 27 on).")
@click.option("--pairs", type=click.IntRange(min=1), default=4000, show_default=True, help="Pairs of each family.")
@click.option("--quick", is_flag=True, help=f"{QUICK_PAIRS} pairs of a family.")
@click.option("--seed", type=click.IntRange(min=0), default=100, show_default=True, help="Seed of the first family.")
@tau
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Write pairs that fail, a file a detector and family.")
@reporting
def command(
    family: str | None, case: str | None, pairs: int, quick: bool, as_json: bool, people: People, **options: Any
) -> int:
    """Run detectors on triangle pairs and bodies made to be hard, and count their wrong answers.

    --family and --case choose; without them everything runs. Exits with 4 when a detector that claims
    exactness is wrong or undecided anywhere.

    \b
    replay stress --quick
    replay stress --detector exact --seed 7
    replay stress --detectors exact,hybrid --family 9-12 --out failures
    replay stress --detector discrete --case 29,41
    replay stress --detector my_lab:Detector --quick
    """
    from replay.studies.stress.bodies import CASE_NAMES
    from replay.studies.stress.families import FAMILIES
    from replay.studies.stress.runner import numbers_of, stress

    runs_everything = family is None and case is None
    numbers = numbers_of("all" if runs_everything else family, "family", range(1, len(FAMILIES) + 1))
    result = stress(
        families=[FAMILIES[number - 1] for number in numbers],
        cases=numbers_of("all" if runs_everything else case, "case", [*CASE_NAMES]),
        pairs=min(pairs, QUICK_PAIRS) if quick else pairs,
        progress=TerminalProgress(people),
        **options,
    )
    answer(as_json, result.as_json(), lambda: stress_tables(result))
    return people.gate(result.broken)


def stress_tables(result: StressResult) -> Group:
    """The sums of each detector; below them where they come from, and the files that were written."""
    from rich.text import Text

    from replay.cli.terminal import stacked

    pairs_text = f", {result.pairs:,} pairs of each family" if any(t.kind == "family" for t in result.tallies) else ""
    tables = [
        sum_table(title, tallies)
        for kind, title in SECTION_TITLES.items()
        if (tallies := [tally for tally in result.tallies if tally.kind == kind])
    ]
    file_lines = (Text(f"  {tally.file}", overflow="fold") for tally in result.tallies if tally.file)
    settings_line = f"seed {result.seed}{pairs_text}, tau {result.tau:g} m"
    return stacked(settings_line, *tables, where_table(result.tallies), *file_lines)


def sum_table(title: str, tallies: Sequence[Tally]) -> Table:
    """A row per detector."""
    rows = []
    for name in dict.fromkeys(tally.detector for tally in tallies):
        own_tallies = [tally for tally in tallies if tally.detector == name]
        rows.append(
            (name, *(sum(getattr(tally, field) for tally in own_tallies) for field in ("asked", *COUNT_HEADINGS)))
        )
    return table(title, ("detector", "questions", *COUNT_HEADINGS.values()), rows)


def where_table(tallies: Sequence[Tally]) -> Table:
    """A row for each result of a family or a case; of several detectors only what was not passed."""
    all_detectors = {tally.detector for tally in tallies}
    detectors_of_result: dict[tuple[str, str, str], list[str]] = {}
    for tally in tallies:
        if tally.words != "passed" or len(all_detectors) == 1:
            result = f"{tally.number:02d} {tally.name}", tally.words, tally.reason
            detectors_of_result.setdefault(result, []).append(tally.detector)
    rows = [
        (question, text, "all" if len(names) == len(all_detectors) > 1 else ", ".join(names), why)
        for (question, text, why), names in detectors_of_result.items()
    ]
    title = "not passed" if len(all_detectors) > 1 else "each question"
    column_names = ("question", "result", "detectors", "why")
    return table(title, column_names, rows, words=column_names)
