"""``replay tradeoff``: what accuracy costs in time, over many detectors and settings; and which one to take."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import ANY_PATH, SESSION_FILE, SHARE, lineup, replaying, reporting

if TYPE_CHECKING:
    from replay.base.progress import Advance
    from replay.tradeoffs.sweep import Watch


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Run folder with table, report and picture.")
@lineup
@click.option(
    "--time-limit", type=click.FloatRange(min=0), metavar="SECONDS", default=150.0, show_default=True,
    help="Begin no setting that cannot end by then. Not in it: compiling, and the audit for --out.",
)  # fmt: skip
@click.option("--engine", metavar="NAME", help="Instead, what one can set in unity, unreal or mujoco, in its words.")
@click.option(
    "--colliders", type=ANY_PATH, metavar="DIR",
    help="With --engine: write the fewest convex pieces a body that keep false contact below --max-false.",
)  # fmt: skip
@click.option(
    "--max-false", type=SHARE, default=0.2, show_default=True, metavar="SHARE",
    help="With --colliders: of the reported contact time at most so much may be false.",
)  # fmt: skip
@replaying
@reporting
def command(
    session: Path, scene: Path | None, out: Path | None, force: bool, time_limit: float,
    engine: str | None, colliders: Path | None, max_false: float, no_picture: bool, as_json: bool,
    people: People, **asked: Any,
) -> int:  # fmt: skip
    """Try many settings over SESSION, or --detectors: what each gets wrong, what it costs, and what to take.

    Times are taken frame by frame, in turns with one reference, which is timed twice.

    \b
    replay tradeoff session.mcap --out costs
    replay tradeoff session.mcap --time-limit 20 --format json
    replay tradeoff session.mcap --detectors exact,hybrid,discrete[rate_hz=22.5]
    replay tradeoff session.mcap --engine unity
    replay tradeoff session.mcap --engine unity --colliders unity-colliders
    """
    if colliders is not None:
        if engine is None or out is not None or asked.pop("detectors") or asked.pop("oracle"):
            raise click.UsageError("--colliders goes with --engine alone; leave out --out, --detectors and --oracle")
        from replay.cli.collider_table import write_colliders

        where = {"scene": scene, "force": force, "max_false": max_false, **asked}
        return write_colliders(session, colliders, engine, people, as_json=as_json, **where)
    if engine is not None:
        if asked.pop("detectors"):
            raise click.UsageError("--engine has settings of its own; leave out --detectors")
        from replay.cli.engine_advice import advise_engine

        how: dict[str, Any] = {"no_picture": no_picture, "as_json": as_json}
        return advise_engine(session, engine, people, scene=scene, out=out, force=force, **how, **asked)
    from replay.api.runner import WRITING, WRITING_STEPS, write
    from replay.cli.run_report import answer_cited
    from replay.cli.terminal import terminal
    from replay.detection.compile_notice import compiling_announced
    from replay.outputs.results.run_folder import check_target
    from replay.outputs.tradeoff_table import tradeoff_list
    from replay.pipeline.citations import sources_behind
    from replay.pipeline.engine import compute
    from replay.tradeoffs.sweep import tradeoff
    from sessions import read_session

    if out is not None:
        check_target(out, force=force)
    held = read_session(session, scene=scene)
    progress = TerminalProgress(people)
    with compiling_announced(people, alone=True), progress.stage("Trying settings", 100) as advance:
        done = tradeoff(held, time_limit=time_limit, watch=percent_of_settings(advance), **asked)
    if out is not None:
        people.say("outside the time limit: one audit of the session, for the report and the picture ...")
        run = replace(compute(held, progress=progress, **asked | {"detectors": None}), tradeoff=done)
        with progress.stage(WRITING, WRITING_STEPS) as advance:
            write(run, out, force=force, picture=not no_picture, advance=advance)
    behind = sources_behind(row["detector"] for row in done.rows) if people.verbose else {}
    shown = tradeoff_list(done, everything=people.verbose)
    answer_cited(as_json, done.as_json(), lambda: terminal(shown), behind, done.advice)
    if done.cut:
        people.detail(f"not tried: {', '.join(done.cut)}")
    if out is not None:
        view = "" if no_picture else f", or: replay view {out}"
        people.say("", f"wrote {out}", f"look at:  {out / 'report.html'}{view}")
    return 0


def percent_of_settings(advance: "Advance") -> "Watch":
    """Advances a stage by percents of the settings begun; how many there are grows while the front is refined."""
    reached = 0

    def watch(begun: int, total: int, label: str, rows: Sequence[dict[str, Any]]) -> None:
        nonlocal reached
        del label, rows
        more = max(0, 100 * begun // total - reached)
        advance(more)
        reached += more

    return watch
