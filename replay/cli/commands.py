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
    "info": CommandSpec("Check", "List the contents of a session file: bodies, clock, gaps, tasks.", "info"),
    "doctor": CommandSpec("Check", "List what is suspicious in a recording, and what to do about it.", "doctor"),
    "recover": CommandSpec("Check", "Save what is left of a torn or damaged session file.", "recover"),
    "minimise": CommandSpec("Record", "Remove personal data from a recording; list what remains.", "minimise"),
    "demo": CommandSpec("Replay", "Make up a lab session, replay it, show the misses.", "demo"),
    "scene": CommandSpec("Record", "Draft the scene of a recording; check a scene, print its plan.", "scene"),
    "mesh": CommandSpec("Check", "Mend a mesh, and say what was changed.", "mesh"),
    "run": CommandSpec("Replay", "Replay sessions; say what each detector missed, and why.", "run"),
    "tradeoff": CommandSpec("Audit", "Measure what accuracy costs in time, and which setting to take.", "tradeoff"),
    "fix": CommandSpec("Audit", "Find the colliders to ship, measure them, write them for an engine.", "fix"),
    "diff": CommandSpec("Audit", "Compare two runs: contacts that changed, and why.", "diff"),
    "shrink": CommandSpec("Audit", "Cut a wrong answer down to a small test.", "shrink"),
    "view": CommandSpec("Replay", "Open the picture of a run, at a miss if you like.", "view"),
    "share": CommandSpec("Replay", "Write runs as a folder that opens in any browser, to send.", "share"),
    "study": CommandSpec("Study", "Join what students did with what they answered; check tables.", "study"),
    "stress": CommandSpec("Audit", "Run detectors on hard cases with known answers.", "stress"),
    "paper": CommandSpec("Study", "Regenerate the paper's tables beside what it printed.", "paper"),
    "guide": CommandSpec("Learn", "Print the page of the guide that answers your words, or list all.", "guide"),
}

ALIASES: Final = {"audit": "run"}
"""Names of the version before that no help shows, and the verbs they stand for."""
