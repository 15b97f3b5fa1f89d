"""``replay run``: session files through detectors, each into a run folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import OUT_ANYWHERE, SESSION_ANYWHERE, auditing, proof

if TYPE_CHECKING:
    from replay.pipeline.gates import Gates


@click.command()
@click.argument("sessions", type=SESSION_ANYWHERE, metavar="FILE.mcap...", nargs=-1, required=True)
@click.option("--out", "-o", type=OUT_ANYWHERE, required=True, metavar="DIR", help="Run folder; of several, one each.")
@click.option("--view", is_flag=True, help="Open the picture when it is written.")
@proof
@auditing
def command(
    sessions: tuple[Path, ...], out: Path, view: bool, no_picture: bool, limits: "Gates", cite: bool, as_json: bool,
    people: People, jobs: int, scheduler: str | None, **asked: Any,
) -> int:  # fmt: skip
    """Replay each FILE.mcap through detectors and write what came of it to a run folder.

    Several go into a folder of run folders; killed, the same command goes on where it stopped.

    \b
    replay run session.mcap --out run1 --view
    replay run session.mcap --out run2 --detectors "slow=discrete[rate_hz=22.5],hybrid" --oracle exact
    replay run session.mcap --out run3 --proof
    replay run recordings/*.mcap --out runs --jobs 4 --no-picture
    """
    if view and no_picture:
        raise click.UsageError("--view shows the picture; leave out --no-picture")
    if len(sessions) > 1 or scheduler is not None:
        if view or cite:
            raise click.UsageError(f"{'--view' if view else '--cite'} is for one session, replayed here; leave it out")
        from replay.cli.many import run_many

        how = {"jobs": jobs, "scheduler": scheduler, "force": asked.pop("force"), "limits": limits}
        return run_many(sessions, out, people, settings={**asked, "picture": not no_picture}, as_json=as_json, **how)
    people.say(f"replaying {sessions[0]}")
    from replay.api.batch import run_near
    from replay.api.places import check_place
    from replay.cli.run_report import report_run, where_to_look

    check_place(out, force=asked["force"])
    asked |= {"out": out, "picture": not no_picture, "progress": TerminalProgress(people)}
    result = run_near(sessions[0], asked)
    code = report_run(result, people, as_json=as_json, cite=cite)
    people.say("", *where_to_look(result, picture=not no_picture))
    if view:
        from replay.cli.view import watch

        watch([out], people)
    return people.gate(limits.broken(result.summary["audit"], [result.summary]), code)
