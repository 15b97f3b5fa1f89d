"""``replay bench``: how fast ``exact`` is beside python-fcl in one run, and how its cost grows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import click

from replay.cli.console import People, TerminalProgress, stdout_console
from replay.cli.options import ANY_PATH, common

QUICK_FACES: Final = (500, 5_000)
FULL_FACES: Final = (500, 5_000, 50_000)
QUICK_GROWTH: Final = {"frames": (5_400, 54_000), "bodies": (5, 20), "faces": QUICK_FACES}
FULL_GROWTH: Final = {"frames": (5_400, 54_000, 540_000), "bodies": (5, 20, 60), "faces": FULL_FACES}


@click.command()
@click.option("--quick/--full", default=True, show_default=True, help="Small sizes, or all of them.")
@click.option("--frames", type=click.IntRange(min=1), help="Of the race; otherwise 1,800 quick, 5,400 full.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the made-up session.")
@click.option("--out", "-o", type=ANY_PATH, metavar="FILE", help="Write all figures here as JSON.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@common
def command(
    quick: bool, frames: int | None, seed: int, out: Path | None, as_json: bool, verbose: bool, quiet: bool, debug: bool
) -> int:
    """Time the exact detector beside python-fcl, in one process, on one thread.

    Exits with 4 when an answer differs.

    \b
    replay bench --quick
    replay bench --full --out bench.json
    """
    del debug
    people = People(quiet=quiet, verbose=verbose)
    from replay.bench.race import grow, race
    from replay.cli.main import GATE_FAILED, OK
    from replay.compiling import compiling_announced
    from replay.machine import machine, versions

    progress = TerminalProgress(people)
    many = frames or (1_800 if quick else 5_400)
    asked = [(n, what) for n in (QUICK_FACES if quick else FULL_FACES) for what in ("bool", "faces")]
    sizes = [(by, size) for by, some in (QUICK_GROWTH if quick else FULL_GROWTH).items() for size in some]
    with compiling_announced(progress):
        rows = []
        with progress.stage("race", len(asked), "races") as advance:
            for n, what in asked:
                rows += race(n, what, frames=many, repeats=2 if quick else 3, seed=seed)
                advance(1)
        growth = []
        with progress.stage("growth", len(sizes), "sizes") as advance:
            for by, size in sizes:
                growth.append(grow(by, size, seed=seed))
                advance(1)
    figures: dict[str, Any] = {"seed": seed, "frames": many, "machine": machine(), "versions": versions()}
    figures |= {"race": [vars(row) for row in rows], "growth": [one.as_json() for one in growth]}
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if as_json:
        click.echo(json.dumps(figures, indent=1))
    else:
        from replay.cli.bench_tables import bench_tables

        stdout_console().print(bench_tables(rows, growth, figures))
    wrong = [row for row in rows if row.wrong]
    for row in wrong:
        people.say(f"gate: {row.engine} differs from python-fcl in {row.wrong:,} pair-frames at {row.faces:,} faces")
    return GATE_FAILED if wrong else OK
