"""``replay run``: session files through detectors, beside one that is trusted, each into a run folder; with gates."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import OUT_ANYWHERE, SESSIONS_ANYWHERE, auditing
from replay.cli.project_settings import ProjectCommand
from replay.cli.session_files import session_files, several

if TYPE_CHECKING:
    from replay.pipeline.gates import Gates


@click.command(cls=ProjectCommand)
@click.argument("sessions", type=SESSIONS_ANYWHERE, metavar="FILE|DIR|LIST.txt...", nargs=-1, required=True)
@click.option("--out", "-o", type=OUT_ANYWHERE, metavar="DIR", help="Run folder; of several sessions, one each in it.")
@click.option("--view", is_flag=True, help="Open the picture when it is written.")
@auditing
def command(
    sessions: tuple[Path, ...], out: Path | None, view: bool, no_picture: bool, limits: "Gates",
    as_json: bool, as_markdown: bool, people: People, jobs: int, scheduler: str | None, step_rate: float | None,
    **asked: Any,
) -> int:  # fmt: skip
    """Replay each FILE.mcap through detectors and say what each missed, why, and what mends it.

    Without --detectors it asks what engines ask: the contacts that the engine reported, if they were recorded; the
    colliders recorded with the bodies, or else convex hulls, and the meshes, at the step rate; the paper's pipeline;
    and every triangle of every frame, the reference.

    Several, a folder of them or a text file that lists them, go into a folder of run folders; killed, the same command
    goes on where it stopped. What you always ask may stand in replay.toml beside the sessions: `replay guide ci`.

    \b
    replay run session.mcap --out run1 --view
    replay run session.mcap --out run1 --step-rate 72
    replay run session.mcap --out run2 --detectors "slow=discrete[rate_hz=22.5],hybrid" --oracle exact
    replay run session.mcap --detector lab.engine:Detector --max-missed 0.01 --max-p99-ms 11.1
    replay run recordings --out runs --jobs 4 --no-picture
    """
    if view and no_picture:
        raise click.UsageError("--view shows the picture; leave out --no-picture")
    if view and out is None:
        raise click.UsageError("--view shows the picture of a run folder; name one with --out")
    if step_rate is not None:
        if asked["detectors"]:
            raise click.UsageError("--step-rate is of the usual detectors; write rate_hz=... in --detectors")
        asked["step_rate"] = step_rate
    files = session_files(sessions)
    if len(files) > 1 or scheduler is not None or several(sessions):
        if view:
            raise click.UsageError("--view is for one session, replayed here; leave it out")
        if scheduler is not None and out is None:
            raise click.UsageError("--scheduler needs --out, a folder that all its workers reach")
        from replay.cli.many import run_many

        how = {"jobs": jobs, "scheduler": scheduler, "force": asked.pop("force"), "limits": limits}
        return run_many(files, out, people, settings={**asked, "picture": not no_picture}, as_json=as_json,
                        as_markdown=as_markdown, **how)  # fmt: skip
    people.say(f"replaying {files[0]}")
    from replay.api.batch import run_near
    from replay.api.places import check_place
    from replay.cli.run_report import close_run, report_run

    check_place(out, force=asked["force"])
    asked |= {"out": out, "picture": not no_picture, "progress": TerminalProgress(people)}
    result = run_near(files[0], asked)
    broken = limits.broken(result.summary["audit"], [result.summary])
    if as_markdown:
        from replay.cli.run_markdown import run_markdown

        print(run_markdown(result, broken))
        code = close_run(result, people)
    else:
        code = report_run(result, people, broken, as_json=as_json, picture=not no_picture, recording=files[0])
    if view and out is not None:
        from replay.cli.view import watch

        watch([out], people)
    return people.gate(broken, code)
