"""``replay run``: a session file through detectors, into a run folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, TerminalProgress
from replay.cli.options import ANY_PATH, SESSION_FILE, gates, lineup, log_search, noisy, offline, proof, replaying

if TYPE_CHECKING:
    from replay.pipeline.gates import Gates


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="FILE.mcap")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="DIR", help="Run folder to make.")
@click.option("--view", is_flag=True, help="Open the picture when it is written.")
@lineup
@log_search
@offline
@noisy
@proof
@gates
@replaying
def command(
    session: Path, view: bool, no_picture: bool, limits: "Gates", cite: bool, as_json: bool, people: People,
    **asked: Any,
) -> int:  # fmt: skip
    """Replay FILE.mcap through detectors and write what came of it to a run folder.

    \b
    replay run session.mcap --out run1 --view
    replay run session.mcap --out run2 --detectors "slow=discrete[rate_hz=22.5],hybrid" --oracle exact
    replay run session.mcap --out run3 --proof
    """
    if view and no_picture:
        raise click.UsageError("--view shows the picture; leave out --no-picture")
    people.say(f"replaying {session}")
    from replay.api.runner import run
    from replay.cli.run_report import report_run, where_to_look

    result = run(session, **asked, picture=not no_picture, progress=TerminalProgress(people))
    code = report_run(result, people, as_json=as_json, cite=cite)
    people.say("", *where_to_look(result, picture=not no_picture))
    if view:
        from replay.cli.view import watch

        watch(asked["out"], people)
    return people.gate(limits.broken(result.summary["audit"], [result.summary]), code)
