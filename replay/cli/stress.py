"""``replay stress``: detectors on hard triangle pairs whose answer is known."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import click

from replay.cli.console import People, TerminalProgress, stdout_console
from replay.cli.options import ANY_PATH, common, output_format

QUICK_PAIRS: Final = 200


@click.command()
@click.option(
    "--detector", "--detectors", default="all", show_default=True, metavar="NAME", help="A row, coal, trimesh, or all."
)
@click.option("--family", "--families", metavar="RANGE", help="Ask families: 9, 3-5 or 1,7-9.")
@click.option(
    "--relation", "--relations", metavar="NAMES", help="Ask relations: swap, order, axes, scale, shift or all."
)
@click.option("--case", "--cases", metavar="RANGE", help="Ask cases of whole bodies: 29, 27-28,41 or all (27-43).")
@click.option("--pairs", type=click.IntRange(min=1), default=4000, show_default=True, help="Pairs of each family.")
@click.option(
    "--relation-pairs", type=click.IntRange(min=1), default=200, show_default=True, help="The same under each relation."
)
@click.option(
    "--quick", is_flag=True, help=f"Only {QUICK_PAIRS} pairs of each family, {QUICK_PAIRS // 10} under relations."
)
@click.option("--seed", type=click.IntRange(min=0), default=100, show_default=True, help="Of the first family.")
@click.option("--tau", type=click.FloatRange(min=0), default=2e-6, show_default=True, help="Metres of tolerance.")
@click.option(
    "--out", "-o", type=ANY_PATH, metavar="DIR", help="Write failing pairs here, a file a detector and family."
)
@click.option("--max-missed", type=click.IntRange(min=0), metavar="N", help="Exit with 4 if more are missed.")
@output_format
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@common
def command(
    detector: str,
    family: str | None,
    relation: str | None,
    case: str | None,
    pairs: int,
    relation_pairs: int,
    quick: bool,
    seed: int,
    tau: float,
    out: Path | None,
    max_missed: int | None,
    format_: str,
    as_json: bool,
    verbose: bool,
    quiet: bool,
    debug: bool,
) -> int:
    """Ask detectors about triangle pairs made to be hard, and count where they are wrong.

    What is named of --family, --relation and --case is asked; if nothing is, everything. Relations are asked of the
    named families. Exits with 4 when a detector that claims exactness is wrong or undecided anywhere.

    \b
    replay stress --quick
    replay stress --detector exact --seed 7
    replay stress --detector hybrid --family 9-12 --out failures
    replay stress --detector hybrid --relation axes,shift
    replay stress --detector discrete --case 29,41
    """
    del debug
    people = People(quiet=quiet, verbose=verbose)
    from replay.cli.main import GATE_FAILED, OK
    from replay.stress.flips import count_flips
    from replay.stress.peers import PEERS, installed_peers
    from replay.stress.relations import relations_of
    from replay.stress.runner import ALL, StressResult, detectors_of, families_of, stress
    from replay.stress.system import cases_of, run_cases

    chosen = families_of(family or "01-26")
    relations = relations_of(relation or "all")
    cases = cases_of(case or "all")
    everything = family is None and relation is None and case is None
    at_most = QUICK_PAIRS if quick else pairs
    absent = [name for name in PEERS if name not in installed_peers()]
    if detector == ALL and absent:
        people.say(f"not installed, so not asked: {', '.join(absent)}; install vrlab-replay[peers] to see them")
    result = StressResult(seed, min(pairs, at_most), tau, ())
    shared: dict[str, Any] = {"families": chosen, "seed": seed, "out": out, "progress": TerminalProgress(people)}
    if family is not None or everything:
        result = stress(detector, pairs=result.pairs, tau=tau, **shared)
    if relation is not None or everything:
        few = min(relation_pairs, at_most // 10 if quick else relation_pairs)
        result = replace(result, flips=count_flips(detectors_of(detector), relations, pairs=few, **shared))
    if case is not None or everything:
        told = {name: shared[name] for name in ("seed", "out", "progress")}
        result = replace(result, cases=run_cases(detectors_of(detector), cases, tau=tau, **told))
    broken = result.broken
    missed = sum(tally.missed for tally in result.tallies)
    if max_missed is not None and missed > max_missed:
        broken.append(f"{missed:,} missed, more than --max-missed {max_missed:,}")
    if as_json or format_ == "json":
        click.echo(json.dumps(result.as_json() | {"broken": broken}, indent=1, allow_nan=False))
    else:
        from replay.cli.stress_tables import stress_tables

        stdout_console().print(stress_tables(result))
    for sentence in broken:
        people.say(f"gate: {sentence}")
    return GATE_FAILED if broken else OK
