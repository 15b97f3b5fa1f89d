"""The table of verbs: each is a module of this folder, imported when the verb is used and not before."""

from typing import Final, NamedTuple

GROUPS: Final = ("Record", "Check", "Replay", "Audit", "Study", "Learn")
"""Headings of the help text, in the order of a day's work."""


class CommandSpec(NamedTuple):
    """One verb: its heading, its line of help, and the module of its ``command``."""

    group: str
    help: str
    module: str

    @property
    def entry(self) -> str:
        """``module:command``."""
        return f"replay.cli.{self.module}:command"


COMMANDS: Final[dict[str, CommandSpec]] = {
    "import": CommandSpec("Record", "Turn a recording of another program into MCAP.", "import_file"),
    "info": CommandSpec("Check", "Say what a session file holds: bodies, clock, gaps, tasks.", "info"),
    "doctor": CommandSpec("Check", "Say what is suspicious about a recording, and what to do about it.", "doctor"),
    "recover": CommandSpec("Check", "Save what is left of a torn or damaged session file.", "recover"),
    "minimise": CommandSpec("Record", "Take out of a recording what leads to a person, and say the rest.", "minimise"),
    "demo": CommandSpec("Replay", "Record a made-up lab session, replay it, show the misses.", "demo"),
    "scene": CommandSpec("Record", "Write a first scene of a recording; find its faults, print its plan.", "scene"),
    "mesh": CommandSpec("Check", "Mend a mesh, and say what that changes in a recording.", "mesh"),
    "run": CommandSpec("Replay", "Replay sessions through detectors; what each missed, why; gates.", "run"),
    "tradeoff": CommandSpec("Audit", "Measure what accuracy costs in time, and which setting to take.", "tradeoff"),
    "diff": CommandSpec("Audit", "Say which contacts two runs disagree about, and why.", "diff"),
    "shrink": CommandSpec("Audit", "Cut a wrong answer down to a small test.", "shrink"),
    "view": CommandSpec("Replay", "Open the pictures of runs, at a miss if you like.", "view"),
    "share": CommandSpec("Replay", "Write runs as a folder that opens in any browser, to send.", "share"),
    "study": CommandSpec("Study", "Join what students did with what they answered; check printed tables.", "study"),
    "stress": CommandSpec("Audit", "Ask detectors hard questions with known answers.", "stress"),
    "paper": CommandSpec("Study", "Regenerate the paper's tables beside what it printed.", "paper"),
    "guide": CommandSpec("Learn", "Print a page of the guide; without a topic, the list.", "guide"),
}

ALIASES: Final = {"audit": "run"}
"""Names of the version before that no help shows, and the verbs they stand for."""
