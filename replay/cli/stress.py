"""``replay stress``: detectors on hard triangle pairs whose answer is known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import click

from replay.cli.console import People, TerminalProgress, stdout_console
from replay.cli.options import ANY_PATH, common, output_format

QUICK_PAIRS: Final = 200


@click.command()
@click.option(
    "--detector", "--detectors", default="all", show_default=True, metavar="NAME", help="A row, coal, trimesh, or all."
)
@click.option("--family", "--families", default="01-26", show_default=True, metavar="RANGE", help="9, 3-5 or 1,7-9.")
@click.option("--pairs", type=click.IntRange(min=1), default=4000, show_default=True, help="Pairs of each family.")
@click.option("--quick", is_flag=True, help=f"Only {QUICK_PAIRS} pairs of each family.")
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
    family: str,
    pairs: int,
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

    Exits with 4 when a detector that claims exactness is wrong or undecided anywhere.

    \b
    replay stress --quick
    replay stress --detector exact --seed 7
    replay stress --detector hybrid --family 9-12 --out failures
    """
    del debug
    people = People(quiet=quiet, verbose=verbose)
    from replay.cli.main import GATE_FAILED, OK
    from replay.stress.peers import PEERS, installed_peers
    from replay.stress.runner import ALL, families_of, stress

    chosen = families_of(family)
    absent = [name for name in PEERS if name not in installed_peers()]
    if detector == ALL and absent:
        people.say(f"not installed, so not asked: {', '.join(absent)}; install vrlab-replay[peers] to see them")
    result = stress(
        detector,
        families=chosen,
        pairs=min(pairs, QUICK_PAIRS) if quick else pairs,
        seed=seed,
        tau=tau,
        out=out,
        progress=TerminalProgress(people),
    )
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
