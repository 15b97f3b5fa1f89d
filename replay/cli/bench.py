"""``replay bench``: how fast ``exact`` is beside other engines in one run, how its cost grows, and where it goes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import ANY_PATH, cite, reporting
from replay.outputs.tables import Table, table

if TYPE_CHECKING:
    from rich.console import Group

    from replay.studies.bench.race import Row
    from replay.studies.bench.stages import Growth, Stages

QUICK_FACES: Final = (500, 5_000)
FULL_FACES: Final = (500, 5_000, 50_000)
QUICK_FRAMES, FULL_FRAMES = 2_700, 5_400
"""Of the race: the made-up session goes on after 2,700."""
QUICK_GROWTH: Final = {"frames": (5_400, 54_000), "bodies": (5, 20, 60), "faces": QUICK_FACES}
FULL_GROWTH: Final = {"frames": (5_400, 54_000, 540_000), "bodies": (5, 20, 60), "faces": FULL_FACES}
RESTING_FACES, RESTING_FRAMES = 5_000, 200
REPEATS: Final = 5
"""Of every engine after its warm-up, the least counts: on a busy machine three were not enough (2026-11)."""


@click.command()
@click.option("--quick/--full", default=True, show_default=True, help="Small sizes, or all of them.")
@click.option("--frames", type=click.IntRange(min=1), help=f"Of the race; {QUICK_FRAMES:,} or {FULL_FRAMES:,} unasked.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the made-up session.")
@click.option("--out", "-o", type=ANY_PATH, metavar="FILE", help="Write all figures here as JSON.")
@cite
@reporting
def command(
    quick: bool, frames: int | None, seed: int, out: Path | None, cite: bool, as_json: bool, people: People
) -> int:
    """Time the exact detector beside python-fcl, coal and trimesh, in one process, on one thread.

    Then: where its time goes, and how its cost grows with frames, bodies and faces. Exits with 4 when an answer of the
    exact detector differs from python-fcl's; what others answer differently is counted in the table.

    \b
    replay bench
    replay bench --full --out bench.json
    """
    from replay.base.machine import machine, versions
    from replay.cli.run_report import answer_cited
    from replay.detection.compile_notice import compiling_announced
    from replay.errors import OutputError
    from replay.pipeline.citations import sources_behind
    from replay.studies.bench.engines import OPTIONAL, installed_engines
    from sessions.whole_files import whole_file

    absent = [name for name in OPTIONAL if name not in installed_engines()]
    if absent:
        people.say(f'not installed, so not in the race: {", ".join(absent)}; pip install -e ".[peers]"')
    progress, many = TerminalProgress(people), frames or (QUICK_FRAMES if quick else FULL_FRAMES)
    with compiling_announced(progress, alone=True):
        rows, spent, growth = _measured(progress, quick, many, seed)
    figures: dict[str, Any] = {"seed": seed, "frames": many, "machine": machine(), "versions": versions()}
    figures |= {"race": [vars(row) for row in rows], "stages": [vars(one) for one in spent]}
    figures |= {"growth": [vars(one) for one in growth]}
    if out is not None:
        with whole_file(out, OutputError, parents=True) as file:
            file.write((json.dumps(figures, indent=1) + "\n").encode())
    behind = sources_behind(["exact"]) if cite else {}
    answer_cited(as_json, figures, lambda: bench_tables(rows, spent, growth, figures), behind)
    wrong = [row for row in rows if row.wrong and row.engine == "exact"]
    words = "exact differs from python-fcl in {:,} pair-frames at {:,} faces"
    return people.gate([words.format(row.wrong, row.faces) for row in wrong])


def _measured(
    progress: TerminalProgress, quick: bool, frames: int, seed: int
) -> tuple[list[Row], list[Stages], list[Growth]]:
    """Race, stages and growth, each under a progress bar."""
    from replay.studies.bench.race import race
    from replay.studies.bench.stages import WHERE, grow, stages
    from replay.studies.bench.workload import make_resting, make_workload

    def counted(name: str, unit: str, asked: Sequence[tuple[Any, ...]], answer: Callable[..., Any]) -> list[Any]:
        answers = []
        with progress.stage(name, len(asked), unit) as advance:
            for one in asked:
                answers.append(answer(*one))
                advance(1)
        return answers

    def staged(name: str, faces: int, what: str) -> Stages:
        load = make_resting(faces, RESTING_FRAMES) if name == "resting" else make_workload(faces, frames, seed=seed)
        return stages(name, load, what)

    questions = [(n, what) for n in (QUICK_FACES if quick else FULL_FACES) for what in ("bool", "faces")]
    loads = [*(("bench", *question) for question in questions), ("resting", RESTING_FACES, "faces")]
    growing = (QUICK_GROWTH if quick else FULL_GROWTH).items()
    sizes = [(where, by, size) for where in WHERE for by, some in growing for size in some]
    races = counted("race", "races", questions, partial(race, frames=frames, repeats=REPEATS, seed=seed))
    spent = counted("stages", "workloads", loads, staged)
    return [row for rows in races for row in rows], spent, counted("growth", "sizes", sizes, partial(grow, seed=seed))


def bench_tables(
    rows: Sequence[Row], spent: Sequence[Stages], growth: Sequence[Growth], figures: Mapping[str, Any]
) -> Group:
    """Machine, race, stages and growth."""
    from replay.cli.terminal import terminal

    where, packages = figures["machine"], figures["versions"]
    head = f"{where['system']}, {where['processor']}, {where['cores']} cores, one used; Python {packages['python']}; "
    head += f"seed {figures['seed']}, {figures['frames']:,} frames"
    return terminal(head, race_table(rows), stage_table(spent), growth_table(growth))


def race_table(rows: Sequence[Row]) -> Table:
    """A row an engine and question."""
    head = ("faces", "question", "engine", "build", "seconds", "speed", "contacts", "digest", "wrong")
    cells = [
        (
            f"{row.faces:,}", row.what, row.engine, f"{row.build:.3f}", f"{row.seconds:.4f}", f"{row.speed:.2f}",
            row.contacts, row.digest, row.wrong,
        )
        for row in rows
    ]  # fmt: skip
    title = "beside python-fcl's plain loop, trees kept; wrong: pair-frames that differ from it"
    note = "exact asks containment too, in every race; no peer does"
    return table(title, head, cells, words=("question", "engine", "digest"), notes=(note,))


def stage_table(spent: Sequence[Stages]) -> Table:
    """A row a workload: milliseconds of every stage."""
    from replay.studies.bench.stages import STAGES

    rows = []
    for one in spent:
        each = [f"{1e3 * one.seconds[name]:.2f}" if name in one.seconds else "in trees" for name in STAGES]
        rows.append((one.workload, one.faces, one.what, *each, f"{1e3 * sum(one.seconds.values()):.2f}"))
    head = ("workload", "faces each", "question", *STAGES, "all")
    return table("where the time of exact goes, milliseconds", head, rows, words=("workload", "question"))


def growth_table(growth: Sequence[Growth]) -> Table:
    """A row a size; x is the figure before it over that of the row above, whose size is smaller."""
    rows = []
    before: Growth | None = None
    for one in growth:
        last = before if before is not None and (before.where, before.grows) == (one.where, one.grows) else None
        seconds, search, tests = (
            f"{getattr(one, name) / getattr(last, name):.1f}" if last and getattr(last, name) else ""
            for name in ("seconds", "search", "tests")
        )
        rows.append(
            (
                one.where, one.grows, one.size, one.pair_frames, f"{one.seconds:.4f}", seconds, f"{one.reading:.4f}",
                f"{one.search:.5f}", search, one.tests, tests,
                f"{one.work.get('skipped', 0) / max(1, one.pair_frames):.1%}",
            )
        )  # fmt: skip
        before = one
    head = ("where", "grows", "size", "pair-frames", "seconds", "x", "reading", "search", "x", "tests", "x", "skipped")
    return table("growth of exact: reading poses is linear, the search need not be", head, rows, words=2)
