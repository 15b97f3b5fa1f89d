"""``replay tradeoff``: what accuracy costs in time, over every detector and its settings; and which one to take."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import ANY_PATH, SESSION_FILE, lineup, replaying, reporting


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Run folder with table, curve and picture.")
@lineup
@click.option(
    "--time-limit", type=click.FloatRange(min=0), metavar="SECONDS", default=150.0, show_default=True,
    help="Begin no setting that cannot end by then. Not in it: compiling, and the audit for --out.",
)  # fmt: skip
@click.option("--steps", is_flag=True, help="Only the steps of trust, from balls to every moment; what each adds.")
@click.option("--engine", metavar="NAME", help="Instead, what one can turn in unity, unreal or mujoco, in its words.")
@click.option("--growth", is_flag=True, help="Then grow the session: bodies, faces, rate. As much time again.")
@replaying
@reporting
def command(
    session: Path, scene: Path | None, out: Path | None, force: bool, time_limit: float, steps: bool,
    growth: bool, engine: str | None, no_picture: bool, as_json: bool, people: People, **asked: Any,
) -> int:  # fmt: skip
    """Run every detector with every setting of a fixed list over SESSION, or --detectors: misses against time, advice.

    Times are taken live, frame by frame, and offline, in turns with one reference, which is timed twice.

    \b
    replay tradeoff session.mcap --out costs
    replay tradeoff session.mcap --time-limit 60 --format json
    replay tradeoff session.mcap --detectors exact,hybrid,discrete[rate_hz=22.5]
    replay tradeoff session.mcap --engine unity
    """
    if engine is not None:
        if steps or growth or asked.pop("detectors"):
            raise click.UsageError("--engine has settings of its own; leave out --detectors, --steps and --growth")
        from replay.cli.engine_advice import advise_engine

        how: dict[str, Any] = {"no_picture": no_picture, "as_json": as_json}
        return advise_engine(session, engine, people, scene=scene, out=out, force=force, **how, **asked)
    from replay.api.runner import write
    from replay.cli.run_report import answer_cited
    from replay.cli.terminal import terminal
    from replay.cli.tradeoff_tables import pareto_bar, pareto_table
    from replay.detection.compile_notice import compiling_announced
    from replay.outputs.report.tradeoff import tradeoff_files
    from replay.outputs.results.run_folder import check_target
    from replay.outputs.tradeoff_table import growth_table
    from replay.pipeline.citations import sources_behind
    from replay.pipeline.engine import compute
    from replay.tradeoffs.growth import grow
    from replay.tradeoffs.settings import steps_of_trust
    from replay.tradeoffs.sweep import tradeoff
    from sessions import read_session

    if out is not None:
        check_target(out, force=force)
    held = read_session(session, scene=scene)
    with compiling_announced(people, alone=True), pareto_bar(people) as watch:
        listed = steps_of_trust() if steps else None
        done = tradeoff(held, settings=listed, time_limit=time_limit, watch=watch, **asked)
    if growth:
        where = {name: asked[name] for name in ("start", "end", "policy")}
        with compiling_announced(people, alone=True):
            done = replace(done, growth=grow(held, time_limit=time_limit, **where))
    if out is not None:
        people.say("outside the time limit: one audit of the session, for the report and the picture ...")
        progress = TerminalProgress(people)
        run = replace(compute(held, progress=progress, **asked | {"detectors": None}), tradeoff=done)
        with progress.stage("write"), tradeoff_files(done) as files:
            write(run, out, force=force, picture=not no_picture, files=files)
    behind = sources_behind(row["detector"] for row in done.rows) if people.verbose else {}
    shown = [pareto_table(done, everything=people.verbose), *([growth_table(done.growth)] if growth else [])]
    answer_cited(as_json, done.as_json(), lambda: terminal(*shown), behind, (done.answer, *done.advice))
    if done.cut:
        people.say(f"time limit: {len(done.cut)} of {len(done.cut) + len(done.rows)} settings were not tried:")
        people.say(f"  {', '.join(done.cut)}")
    if out is not None:
        view = f", or: replay view {out}" * (not no_picture)
        people.say("", f"wrote {out}", f"look at:  {out / 'tradeoff.png'}{view}")
    return 0
