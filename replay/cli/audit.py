"""``replay audit``: what detectors missed and invented beside an oracle, over one session or several, with gates."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import OK, People, TerminalProgress, counting
from replay.cli.options import (
    OUT_ANYWHERE,
    SESSION_ANYWHERE,
    gates,
    lineup,
    log_search,
    noisy,
    offline,
    replaying,
    workers,
)

if TYPE_CHECKING:
    from replay.pipeline.gates import Gates


@click.command()
@click.argument("sessions", type=SESSION_ANYWHERE, metavar="SESSION...", nargs=-1, required=True)
@click.option("--out", "-o", type=OUT_ANYWHERE, metavar="DIR", help="Run folder; of several sessions a folder of them.")
@click.option("--no-faces", is_flag=True, help="Leave out face recall, and the second pass it takes.")
@lineup
@log_search
@offline
@noisy
@workers
@gates
@replaying
def command(
    sessions: tuple[Path, ...], no_faces: bool, no_picture: bool, limits: "Gates", cite: bool, as_json: bool,
    people: People, **asked: Any,
) -> int:  # fmt: skip
    """Replay each SESSION through detectors and say what each missed beside the oracle, and why.

    \b
    replay audit session.mcap --detectors "hybrid-qaco,slow=discrete[rate_hz=22.5]" --out runs/audit
    replay audit recordings/*.mcap --detector lab.engine:Detector --max-missed 0.01 --max-p99-ms 11.1
    replay audit recordings/*.mcap --jobs 4 --out runs/all
    """
    from replay.api.auditor import audit
    from replay.cli.run_report import answer_cited, close_run, run_json, sources_of, where_to_look
    from replay.cli.run_tables import answers, audit_tables, fault_tables
    from replay.cli.terminal import terminal

    shown: dict[str, Any] = {"faces": not no_faces, "picture": not no_picture}
    told: dict[str, Any] = {"progress": TerminalProgress(people), "on_done": counting(people, len(sessions))}
    result = audit(list(sessions), **asked, **shown, **told)
    broken = limits.broken(result.summary, [one.summary for one in result.results])
    plain = {"audit": result.summary, "runs": [run_json(one) for one in result.results], "broken": broken}
    tables = [*fault_tables(result.results), *audit_tables(result.results, result.summary)]
    cited = sources_of(result.results) if cite else {}
    answer_cited(as_json, plain, lambda: terminal(answers(result.results), *tables), cited)
    codes = [close_run(one, people) for one in result.results]
    for one in result.results:
        people.say(*where_to_look(one, picture=not no_picture))
    return people.gate(broken, max(codes, default=OK))
