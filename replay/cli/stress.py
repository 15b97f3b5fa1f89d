"""``replay stress``: detectors on hard triangle pairs whose answer is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, reporting, tau
from replay.outputs.tables import Cell, Table, table

if TYPE_CHECKING:
    from rich.console import Group

    from replay.studies.stress.relations import Flips
    from replay.studies.stress.stress_runner import StressResult, Tally
    from replay.studies.stress.system import CaseTally

QUICK_PAIRS: Final = 200
RELATION_PAIRS: Final = 200

FIELDS: Final = ("missed", "invented", "within", "refused", "unconfirmed")
COLUMNS: Final = ("missed", "invented", "within tolerance", "refused", "unconfirmed")
"""Fields of a tally, and their headings."""


@click.command()
@click.option(
    "--detectors", "--detector", "detector", default="all", show_default=True, metavar="NAMES",
    help="Detectors, coal, trimesh or all; several with commas.",
)  # fmt: skip
@click.option("--family", metavar="RANGE", help="Ask families: 9, 3-5 or 1,7-9.")
@click.option("--relation", metavar="NAMES", help="Ask relations: swap, order, axes, scale, shift, all.")
@click.option("--case", metavar="RANGE", help="Ask cases of whole bodies: 29, 27-28,41 or all (from 27 on).")
@click.option("--pairs", type=click.IntRange(min=1), default=4000, show_default=True,
    help=f"Pairs of each family; a tenth of them, at most {RELATION_PAIRS}, under relations.",
)  # fmt: skip
@click.option("--quick", is_flag=True, help=f"{QUICK_PAIRS} pairs of a family.")
@click.option("--seed", type=click.IntRange(min=0), default=100, show_default=True, help="Of the first family.")
@tau
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Write what fails here, a file a detector and family.")
@reporting
def command(
    detector: str, family: str | None, relation: str | None, case: str | None, pairs: int,
    quick: bool, seed: int, tau: float, out: Path | None, as_json: bool, people: People,
) -> int:  # fmt: skip
    """Ask detectors about triangle pairs made to be hard, and count where they are wrong.

    What is named of --family, --relation and --case is asked; if nothing is, everything. Relations are asked of the
    named families. Exits with 4 when a detector that claims exactness is wrong or undecided anywhere.

    \b
    replay stress --quick
    replay stress --detector exact --seed 7
    replay stress --detectors exact,hybrid --family 9-12 --out failures
    replay stress --detector hybrid --relation axes,shift
    replay stress --detector discrete --case 29,41
    """
    from replay.studies.stress.peers import PEERS, installed_peers
    from replay.studies.stress.relations import count_flips, relations_of
    from replay.studies.stress.stress_runner import ALL, StressResult, detectors_of, families_of, stress
    from replay.studies.stress.system import cases_of, run_cases

    chosen, relations, cases = families_of(family or "01-26"), relations_of(relation or "all"), cases_of(case or "all")
    everything = family is None and relation is None and case is None
    at_most = QUICK_PAIRS if quick else pairs
    absent = [name for name in PEERS if name not in installed_peers()]
    if ALL in detector.split(",") and absent:
        people.say(f'not installed, so not asked: {", ".join(absent)}; pip install "vrlab-replay[peers]"')
    result = StressResult(seed, min(pairs, at_most), tau, ())
    shared: dict[str, Any] = {"families": chosen, "seed": seed, "out": out, "progress": TerminalProgress(people)}
    if family is not None or everything:
        result = stress(detector, pairs=result.pairs, tau=tau, **shared)
    if relation is not None or everything:
        few = min(RELATION_PAIRS, max(1, at_most // 10))
        result = replace(result, flips=count_flips(detectors_of(detector), relations, pairs=few, **shared))
    if case is not None or everything:
        whole = {name: shared[name] for name in ("seed", "out", "progress")}
        result = replace(result, cases=run_cases(detectors_of(detector), cases, tau=tau, **whole))
    answer(as_json, result.as_json() | {"broken": result.broken}, lambda: stress_tables(result))
    return people.gate(result.broken)


NO_NAMES: Final = "-"


def stress_tables(result: StressResult) -> Group:
    """The sums of each detector; below them where they come from, and the files that were written."""
    from rich.text import Text

    from replay.cli.terminal import terminal

    rows = dict(result.by_detector())
    asked = f", {result.pairs:,} pairs of each family" if rows else ""
    tables = [family_table(next(iter(rows.values())))] if len(rows) == 1 else []
    tables += [sum_table(rows), cross_table(rows)] if len(rows) > 1 else []
    tables += [flip_table(result.flips)] if result.flips else []
    tables += [case_table(result.cases)] if result.cases else []
    files = [one.file for some in (result.cases, result.tallies, result.flips) for one in some if one.file]
    written = (Text(f"  {file}", overflow="fold") for file in files)
    return terminal(f"seed {result.seed}{asked}, tau {result.tau:g} m", *tables, *written)


def sum_table(rows: dict[str, list[Tally]]) -> Table:
    """A row per detector, summed over the families."""
    cells = [(name, sum(one.pairs for one in tallies), *_sums(tallies)) for name, tallies in rows.items()]
    return table("all families", ("detector", "pairs", *COLUMNS), cells)


def family_table(tallies: Sequence[Tally]) -> Table:
    """A row per family of one detector, and the sums."""
    rows = [(_label(tally), *_sums([tally])) for tally in tallies]
    foot = ("all", *_sums(tallies)) if len(tallies) > 1 else ()
    return table(tallies[0].detector, ("family", *COLUMNS), rows, foot=foot)


def cross_table(rows: dict[str, list[Tally]]) -> Table:
    """A row per family in which anybody failed, a column per detector that failed anywhere."""
    failing = {name: tallies for name, tallies in rows.items() if any(one.failed for one in tallies)}
    cells = [
        (_label(tallies[0]), *(_cell(tally) for tally in tallies))
        for tallies in zip(*failing.values(), strict=True)
        if any(one.failed for one in tallies)
    ]
    title = "missed + invented, ~ within tolerance, ! refused; nobody else failed anywhere"
    return table(title, ("family", *failing), cells)


def flip_table(flips: Sequence[Flips]) -> Table:
    """A row per detector, a column per relation, and the families with any."""
    pairs = flips[0].pairs * len({one.number for one in flips})
    relations = list(dict.fromkeys(one.relation for one in flips))
    rows = []
    for name in dict.fromkeys(one.detector for one in flips):
        of = [one for one in flips if one.detector == name]
        cells = [_flip_cell([one for one in of if one.relation == relation]) for relation in relations]
        families = sorted({one.number for one in of if one.flips or one.refused})
        rows.append((name, *cells, " ".join(f"{number:02d}" for number in families) or NO_NAMES))
    head = ("detector", *relations, "in families")
    title = f"answers that changed under harmless changes, of {pairs:,} pairs"
    return table(title, head, rows, words=("detector", "in families"))


def case_table(cases: Sequence[CaseTally]) -> Table:
    """A row for each case and for each answer that detectors gave to it."""
    rows: list[tuple[Cell, ...]] = []
    asked_any = {one.detector for one in cases if one.applies}
    for number in sorted({one.number for one in cases}):
        of = [one for one in cases if one.number == number and (one.detector in asked_any or not asked_any)]
        answers = list(dict.fromkeys((one.words, one.asked, one.reason) for one in of))
        for place, (words, asked, reason) in enumerate(answers):
            names = [one.detector for one in of if (one.words, one.asked, one.reason) == (words, asked, reason)]
            who = ", ".join(names) if len(names) < len(of) or len(of) == 1 else "all"
            rows.append((f"{number} {of[0].name}" if place == 0 else "", asked, words, who, reason))
    never = {one.detector: one.reason for one in cases if asked_any and one.detector not in asked_any}
    rows += [("all of them", 0, "does not apply", name, reason) for name, reason in never.items()]
    head = ("case", "questions", "result", "detectors", "why")
    return table("cases of whole bodies", head, rows, words=("case", "result", "detectors", "why"))


def _flip_cell(flips: Sequence[Flips]) -> str:
    changed, refused = (sum(getattr(one, name) for one in flips) for name in ("flips", "refused"))
    return (f"{changed:,}" if changed else "0") + (f"  ! {refused:,}" if refused else "")


def _cell(tally: Tally) -> str:
    parts = [f"{tally.missed:,} + {tally.invented:,}"] if tally.missed or tally.invented else []
    parts += [f"{sign} {count:,}" for sign, count in (("~", tally.within), ("!", tally.refused)) if count]
    return "  ".join(parts) or "0"


def _label(tally: Tally) -> str:
    return f"{tally.number:02d} {tally.name}"


def _sums(tallies: Sequence[Tally]) -> list[int]:
    return [sum(getattr(tally, field) for tally in tallies) for field in FIELDS]
