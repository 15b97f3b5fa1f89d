"""``replay run``: session files through detectors, beside one that is trusted, each into a run folder; with gates."""

from pathlib import Path
from typing import Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import (
    FIX_SECONDS,
    MARKDOWN,
    OUT_ANYWHERE,
    SESSIONS_ANYWHERE,
    SHARE,
    Length,
    Number,
    fix_time,
    format_options,
    jobs,
    lineup,
    replaying,
    tables,
)
from replay.cli.project_settings import ProjectCommand
from replay.cli.session_files import are_several, session_files

STEP_HELP = "Physics steps a second of your engine, where no detectors are named.  [default: 50]"
NOISE_HELP = 'Replay noisy copies: [BODY=]vive or "0.3 mm, 0.05 deg, 0.1 s"; repeat it.'
MISSED_HELP = "Exit 4 when more contacts or pair-frames are missed."
FALSE_HELP = "Exit 4 when more of the contact it reports is false."
DEPTH_HELP = "Exit 4 when bodies are deeper in each other in a miss: 2mm."
LATE_HELP = "Exit 4 when the slowest 1 % of the samples take longer."


def _refuse_old_name(_: click.Context, __: click.Parameter, value: str | None) -> None:
    """Refuse the old name of an option with the new one."""
    if value is not None:
        raise click.UsageError("--max-invented is called --max-false now")


@click.command(cls=ProjectCommand)
@click.argument("sessions", type=SESSIONS_ANYWHERE, metavar="FILE|DIR|LIST.txt...", nargs=-1, required=True)
@click.option("--out", "-o", type=OUT_ANYWHERE, metavar="DIR", help="Run folder; for several sessions, their folder.")
@lineup
@click.option("--step-rate", type=Number(min=0, min_open=True), metavar="HZ", help=STEP_HELP)
@click.option("--noise", multiple=True, metavar="SIZE", help=NOISE_HELP)
@jobs
@click.option("--scheduler", metavar="ADDRESS", help="Replay on the workers of this Dask scheduler.")
@click.option("--max-missed", type=SHARE, metavar="SHARE", help=MISSED_HELP)
@click.option("--max-false", type=SHARE, metavar="SHARE", help=FALSE_HELP)
@click.option("--max-missed-depth", type=Length(), metavar="LENGTH", help=DEPTH_HELP)
@click.option("--max-invented", hidden=True, expose_value=False, callback=_refuse_old_name)
@click.option("--max-p99-ms", type=Number(min=0), metavar="MS", help=LATE_HELP)
@fix_time
@tables("parquet")
@replaying
@format_options("text", "json", MARKDOWN)
def command(
    sessions: tuple[Path, ...],
    out: Path | None,
    people: People,
    as_json: bool,
    as_markdown: bool,
    **options: Any,
) -> int:
    """Replay each FILE.mcap through detectors and say which contacts each missed, why, and how to mend it.

    Without --detectors it tests what engines ship: the contacts that the engine reported, if they were recorded; the
    colliders recorded with the bodies, or else convex hulls, and the meshes, at the step rate; the paper's pipeline;
    and every triangle of every frame, the reference.

    Several, a folder of them or a text file that lists them, go into a folder of run folders; killed, the same command
    goes on where it stopped. Options that you always use may stand in replay.toml beside the sessions: `replay guide
    in-a-build`.

    \b
    replay run session.mcap --out run1
    replay run session.mcap --out run1 --step-rate 72
    replay run session.mcap --out run2 --detectors "slow=discrete[rate_hz=22.5],hybrid" --oracle exact
    replay run session.mcap --detector lab.engine:Detector --max-missed 0.01 --max-p99-ms 11.1
    replay run recordings --out runs --jobs 4 --no-picture
    """
    from replay.document.gates import Gates, times_of
    from replay.show.results.spreadsheets import PARQUET, require_form, write_run_tables
    from replay.show.results.without_pandas import leave_pandas_out

    leave_pandas_out()
    picture = not options.pop("no_picture")
    if options["step_rate"] is None:
        del options["step_rate"]
    elif options["detectors"]:
        raise click.UsageError("--step-rate belongs to the usual detectors; with --detectors, write rate_hz=... there")
    limits = Gates(*(options.pop(name) for name in ("max_missed", "max_p99_ms", "max_false", "max_missed_depth")))
    batch_options = {name: options.pop(name) for name in ("jobs", "scheduler", "force")}
    table_format = options.pop("tables")
    if table_format != PARQUET:
        if out is None:
            raise click.UsageError(f"--tables {table_format} needs --out, the folder to write them to")
        require_form(table_format)
    files = session_files(sessions)
    if len(files) > 1 or batch_options["scheduler"] is not None or are_several(sessions):
        options["fix_time"] = options["fix_time"] or 0.0
        if batch_options["scheduler"] is not None and out is None:
            raise click.UsageError("--scheduler needs --out, a folder that all its workers reach")
        from replay.cli.many_sessions import run_many

        output_options = {"as_json": as_json, "as_markdown": as_markdown, "table_format": table_format}
        return run_many(
            files, out, people, limits, settings=options | {"picture": picture}, **output_options, **batch_options
        )
    import replay
    from replay.cli.run_report import close_run, report_run

    people.say(f"replaying {files[0]}")
    options["fix_time"] = FIX_SECONDS if options["fix_time"] is None else options["fix_time"]
    progress = TerminalProgress(people)
    result = replay.run(files[0], out=out, picture=picture, force=batch_options["force"], progress=progress, **options)
    if result.out is not None:
        people.say(*write_run_tables(result.out, table_format))
    broken_limits = limits.broken_limits(result.document.audit, times_of([result.document]))
    if as_markdown:
        from replay.cli.run_markdown import run_markdown

        print(run_markdown(result, broken_limits))
        code = close_run(result, people)
    else:
        code = report_run(result, people, broken_limits, as_json=as_json, recording=files[0])
    return people.gate(broken_limits, code)
