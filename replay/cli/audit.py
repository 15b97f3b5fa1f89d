"""``replay audit``: what detectors missed and invented beside an oracle, over one session or several, with gates."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import OK, People, TerminalProgress, answer
from replay.cli.options import (
    ANY_PATH,
    SESSION_FILE,
    common,
    force,
    gates,
    lineup,
    log_search,
    no_picture,
    output_format,
    tau,
    window,
)  # fmt: skip

if TYPE_CHECKING:
    from replay.pipeline.gates import Gates


@click.command()
@click.argument("sessions", type=SESSION_FILE, metavar="SESSION...", nargs=-1, required=True)
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Run folder; of several sessions a folder of them.")
@force
@lineup
@window
@tau
@click.option("--no-faces", is_flag=True, help="Leave out face recall, and the second pass it takes.")
@no_picture
@log_search
@gates
@output_format
@common
def command(
    sessions: tuple[Path, ...], no_faces: bool, no_picture: bool, limits: Gates, as_json: bool, people: People,
    **asked: Any,
) -> int:  # fmt: skip
    """Replay each SESSION through detectors and say what each missed beside the oracle.

    \b
    replay audit session.mcap --detectors "hybrid-qaco,slow=discrete[rate_hz=22.5]" --out runs/audit
    replay audit recordings/*.mcap --detector lab.engine:Detector --max-missed 0.01 --max-p99-ms 11.1
    """
    from replay.api.auditor import audit
    from replay.cli.run_report import close_run, where_to_look
    from replay.cli.run_tables import answers, audit_tables
    from replay.cli.terminal import terminal

    shown: dict[str, Any] = {"faces": not no_faces, "picture": not no_picture}
    result = audit(list(sessions), **asked, **shown, progress=TerminalProgress(people))
    summaries = [one.summary for one in result.results]
    broken = limits.broken(result.summary, summaries)
    plain = {"audit": result.summary, "runs": summaries, "broken": broken}
    answer(as_json, plain, lambda: terminal(answers(result.results), audit_tables(result.summary)))
    codes = [close_run(one, people) for one in result.results]
    for one in result.results:
        people.say(*where_to_look(one, picture=not no_picture))
    return people.gate(broken, max(codes, default=OK))
