"""The table of verbs: each is a module, imported when the verb is used and not before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

GROUPS: Final = ("Record", "Check", "Replay", "Audit", "Study", "Learn")
"""Headings of the help text, in the order of a day's work."""


@dataclass(frozen=True)
class CommandSpec:
    """One verb.

    Parameters
    ----------
    entry : ``module:command``.
    group : one of ``GROUPS``.
    help : one line.
    """

    entry: str
    group: str
    help: str


COMMANDS: Final[dict[str, CommandSpec]] = {
    "import": CommandSpec("replay.cli.import_file:command", "Record", "Turn a recording of another program into MCAP."),
    "info": CommandSpec(
        "replay.cli.info:command", "Check", "Say what a session file holds: bodies, clock, gaps, tasks."
    ),
    "doctor": CommandSpec(
        "replay.cli.doctor:command", "Check", "Say what is suspicious about a recording, and what to do about it."
    ),
    "recover": CommandSpec(
        "replay.cli.recover:command", "Check", "Save what is left of a torn or damaged session file."
    ),
    "demo": CommandSpec(
        "replay.cli.demo:command", "Replay", "Record a made-up lab session, replay it, show the misses."
    ),
    "plan": CommandSpec("replay.cli.plan:command", "Replay", "Say what a scene calls for, and why."),
    "run": CommandSpec(
        "replay.cli.run:command", "Replay", "Replay a session through detectors and write a run folder."
    ),
    "audit": CommandSpec("replay.cli.audit:command", "Audit", "Count what detectors missed beside an oracle; gates."),
    "tradeoff": CommandSpec(
        "replay.cli.tradeoff:command", "Audit", "Measure what accuracy costs in time, and which setting to take."
    ),
    "diff": CommandSpec("replay.cli.diff:command", "Audit", "Say which contacts two runs disagree about, and why."),
    "view": CommandSpec("replay.cli.view:command", "Replay", "Open the picture of a run, at a miss if you like."),
    "study": CommandSpec(
        "replay.cli.study:command", "Study", "Join what students did with what they answered; check printed tables."
    ),
    "stress": CommandSpec("replay.cli.stress:command", "Audit", "Ask detectors hard questions with known answers."),
    "paper": CommandSpec("replay.cli.paper:command", "Study", "Regenerate the paper's tables beside what it printed."),
    "bench": CommandSpec("replay.cli.bench:command", "Audit", "Time the exact detector beside python-fcl; its growth."),
    "guide": CommandSpec("replay.cli.guide:command", "Learn", "Print a page of the guide; without a topic, the list."),
}
