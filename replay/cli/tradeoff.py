"""``replay tradeoff``: what accuracy costs in time, over many detectors and settings; and which one to take."""

from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import ANY_PATH, SESSION_FILE, Number, lineup, replaying, reporting

if TYPE_CHECKING:
    from replay.advice.sweep import Watch
    from replay.detection.progress import Advance

LIMIT_HELP = (
    "Begin no setting, with --engine no cut, that cannot end by then; compiling, the audit for --out, and the replay "
    "with --engine come on top."
)


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Run folder with table, report and picture.")
@lineup
@click.option("--time-limit", type=Number(min=0), metavar="SECONDS", show_default="150", help=LIMIT_HELP)
@click.option("--engine", metavar="NAME", help="Try the settings of an engine instead: unity, unreal or mujoco.")
@replaying
@reporting
def command(
    session: Path,
    people: People,
    time_limit: float | None,
    engine: str | None,
    as_json: bool,
    **options: Any,
) -> int:
    """Try many settings over SESSION, or --detectors: what each gets wrong, what it costs, and what to take.

    Times are taken frame by frame, in turns with one reference, which is timed twice.

    \b
    replay tradeoff session.mcap --out costs
    replay tradeoff session.mcap --time-limit 20 --format json
    replay tradeoff session.mcap --detectors exact,hybrid,discrete[rate_hz=22.5]
    replay tradeoff session.mcap --engine unity
    """
    from replay.advice.sweep import TIME_LIMIT_S
    from replay.cli.engine_advice import advise_engine

    seconds = TIME_LIMIT_S if time_limit is None else time_limit
    picture = not options.pop("no_picture")
    if engine is not None:
        if options.pop("detectors"):
            raise click.UsageError("--engine has settings of its own; leave out --detectors")
        return advise_engine(session, engine, people, time_limit=seconds, picture=picture, as_json=as_json, **options)
    return _run_tradeoff(session, people, time_limit=seconds, picture=picture, as_json=as_json, **options)


def _run_tradeoff(
    session: Path,
    people: People,
    *,
    out: Path | None,
    force: bool,
    scene: Path | None,
    time_limit: float,
    picture: bool,
    as_json: bool,
    **options: Any,
) -> int:
    from replay.advice.assumptions import first_screen_lines
    from replay.advice.sweep import tradeoff
    from replay.cli.run_report import answer_cited
    from replay.cli.terminal import stacked
    from replay.detection.compile_notice import compiling_announced
    from replay.document.citations import sources_behind
    from replay.document.placeholders import RECORDING
    from replay.engine import compute
    from replay.running.runner import write_watched
    from replay.show.results.run_folder import check_target
    from replay.show.tradeoff_table import tradeoff_list
    from sessions import read_session

    if out is not None:
        check_target(out, force=force)
    session_read = read_session(session, scene=scene)
    progress = TerminalProgress(people)
    with compiling_announced(people, is_alone=True), progress.stage("Trying settings", 100) as advance:
        tradeoff_result = tradeoff(session_read, time_limit=time_limit, watch=percent_of_settings(advance), **options)
    lines = first_screen_lines(session_read, None, progress)
    question_lines = [line.replace(RECORDING, quote(str(session))) for line in lines.questions]
    if out is not None:
        people.say("outside the time limit: one audit of the session, for the report and the picture ...")
        run = replace(
            compute(session_read, progress=progress, **options | {"detectors": None}), tradeoff=tradeoff_result
        )
        write_watched(run, out, progress, force=force, picture=picture)
    sources = sources_behind(row["detector"] for row in tradeoff_result.rows) if people.verbose else {}
    answer_cited(
        as_json,
        {**tradeoff_result.as_json(), "open_questions": question_lines},
        lambda: stacked(
            tradeoff_list(tradeoff_result, is_complete=people.verbose), *tradeoff_result.advice, *question_lines
        ),
        sources,
    )
    if tradeoff_result.cut:
        people.detail(f"not tried: {', '.join(tradeoff_result.cut)}")
    if out is not None:
        view = f", or: replay view {out}" if picture else ""
        people.say("", f"wrote {out}", f"look at:  {out / 'report.html'}{view}")
    return 0


def percent_of_settings(advance: "Advance") -> "Watch":
    """Advances a stage by percents of the settings begun; how many there are grows while the front is refined."""
    reached_percent = 0

    def watch(begun_settings: int, all_settings: int) -> None:
        nonlocal reached_percent
        added_percent = max(0, 100 * begun_settings // all_settings - reached_percent)
        advance(added_percent)
        reached_percent += added_percent

    return watch
