"""Answers on stdout, sentences and progress on stderr, and exit codes. Progress is shown on a terminal only."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from replay.base.progress import Advance
from replay.base.shown import shown as safe_text

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.progress import Progress

OK: Final = 0
FAILURE: Final = 1
DATA_LOSS: Final = 3
GATE_FAILED: Final = 4
INTERRUPTED: Final = 130
"""Exit codes; 2 is click's, for a wrong call or a missing path."""

PIPED: Final = 100
"""Columns where there is no terminal and ``COLUMNS`` says nothing: what a mail, a log or a second pane shows whole."""


class People:
    """Speaks to whoever started the command; where asked for not at all (``quiet``), or more (``verbose``)."""

    def __init__(self, *, quiet: bool = False, verbose: bool = False) -> None:
        self.quiet, self.verbose = quiet, verbose

    def say(self, *sentences: str) -> None:
        """Sentences, each on a line, at once."""
        if not self.quiet:
            for sentence in sentences:
                print(_folded(safe_text(sentence), sys.stderr), file=sys.stderr, flush=True)

    def detail(self, sentence: str) -> None:
        """One sentence for those who asked for more."""
        if self.verbose:
            self.say(sentence)

    def gate(self, broken: Sequence[str], otherwise: int = OK) -> int:
        """Say which gates failed, to the quiet too: they are why the command fails; the exit code."""
        People().say(*(f"gate: {sentence}" for sentence in broken))
        return GATE_FAILED if broken else otherwise


class TerminalProgress:
    """A bar per stage, on a terminal; elsewhere nothing."""

    def __init__(self, people: People) -> None:
        self.say = people.say
        self._shown = sys.stderr.isatty() and not people.quiet

    @contextmanager
    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> Iterator[Advance]:
        """Show a bar while the stage lasts; a line with its time stays."""
        if not self._shown:
            yield lambda _: None
            return
        with _bars(unit) as bars:
            task = bars.add_task(name, total=total)
            yield lambda done: bars.advance(task, done)
            if total is None:
                bars.update(task, total=1, completed=1)


def _bars(unit: str) -> "Progress":
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
    from rich.text import Text

    class PaceColumn(ProgressColumn):
        """``12,345 frames/s, 3 s left``, then ``4.1 s``."""

        def render(self, task: Task) -> Text:
            words = pace(task.speed, task.time_remaining, task.elapsed, task.finished, unit)
            return Text(words, style="dim")

    return Progress(
        SpinnerColumn(finished_text="[green]✓[/green]"),
        TextColumn("{task.description:<12}"),
        BarColumn(bar_width=24),
        PaceColumn(),
        console=Console(stderr=True),
    )


def pace(speed: float | None, left: float | None, elapsed: float | None, finished: bool, unit: str) -> str:
    """A stage's pace in words; rates and times in seconds, ``None`` where not known."""
    if finished or speed is None or left is None:
        return "" if elapsed is None else f"{elapsed:.1f} s"
    return f"{speed:,.0f} {unit}/s, {left:.0f} s left"


def counting(people: People, total: int) -> Callable[[str, str], None]:
    """Tells each finished piece with how many there are, how long the rest may take and how many a minute are done."""
    count, worked, begun = 0, 0, time.monotonic()

    def tell(name: str, became: str) -> None:
        nonlocal count, worked
        count, worked = count + 1, worked + (became != "kept")
        each = (time.monotonic() - begun) / max(worked, 1)
        rest = f", about {each * (total - count):.0f} s left at {60 / each:.3g} a minute"
        people.say(f"{count:>4} of {total}  {name}: {became}{rest if worked and count < total else ''}")

    return tell


def _folded(text: str, stream: "IO[str]") -> str:
    """A sentence for a terminal, no word of it cut; elsewhere as it is, unless ``COLUMNS`` asks."""
    if not (stream.isatty() or "COLUMNS" in os.environ):
        return text
    from shutil import get_terminal_size
    from textwrap import fill

    room, indent = get_terminal_size().columns, " " * (len(text) - len(text.lstrip()) + 2)
    whole = len(text) <= room
    return text if whole else fill(text, room, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def answer(as_json: bool, plain: Any, shown: "Callable[[], RenderableType | list[str]]") -> None:
    """Print what a verb found: ``plain`` data, or what that makes, as JSON, or what ``shown`` makes for a terminal.

    A ``str`` is a line, a ``list`` are lines, whatever they hold. What is piped has no spaces at the ends of lines.
    """
    if as_json:
        print(json.dumps(plain() if callable(plain) else plain, indent=1, allow_nan=False))
    elif isinstance(made := shown(), str | list):
        for one in [made] if isinstance(made, str) else made:
            print(_folded(safe_text(one), sys.stdout))
    elif sys.stdout.isatty():
        stdout_console().print(made)
    else:
        with (console := stdout_console()).capture() as held:
            console.print(made)
        print("\n".join(one.rstrip() for one in held.get().splitlines()))


def print_name(path: Path) -> None:
    """Print the name of a file that was written, whatever it holds, on one line."""
    print(safe_text(str(path)))


def stdout_console() -> "Console":
    """Where answers go: as wide as the terminal, or as ``COLUMNS`` says."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else PIPED, highlight=False)
