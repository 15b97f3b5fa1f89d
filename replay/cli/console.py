"""Answers on stdout, sentences and progress on stderr, and exit codes. Progress is shown on a terminal only."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
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


LONG: Final = 3.0
"""Seconds from which a stage says how much is done and left, and stays ticked off on the screen."""

EVERY: Final = 10.0
"""Seconds between the lines of a long stage where there is no terminal."""


class TerminalProgress:
    """A bar for each stage on a terminal; elsewhere a line every ten seconds. A short stage leaves nothing behind."""

    def __init__(self, people: People, every: float = EVERY) -> None:
        self.say = people.say
        self._quiet, self._every = people.quiet, every

    @contextmanager
    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> Iterator[Advance]:
        """Report a piece of work of ``total`` units while it lasts."""
        del unit
        work = Work(name, total)
        if self._quiet:
            yield work.advance
        elif sys.stderr.isatty():
            with _bars() as bars:
                task = bars.add_task(name, total=total)

                def advance(done: int) -> None:
                    work.advance(done)
                    bars.advance(task, done)

                yield advance
                bars.update(task, total=total or 1, completed=total or 1)
                bars.live.transient = work.seconds < LONG
        else:
            ended = Event()
            teller = Thread(target=self._tell, args=(work, ended), daemon=True)
            teller.start()
            try:
                yield work.advance
            finally:
                ended.set()
                teller.join()
            if work.seconds >= self._every:
                self.say(f"{name}: done in {work.seconds:.0f} s")

    def _tell(self, work: "Work", ended: Event) -> None:
        while not ended.wait(self._every):
            self.say(f"{work.name}: {work.words()}")


class Work:
    """How much of a stage is done."""

    def __init__(self, name: str, total: int | None) -> None:
        self.name, self._total, self._done, self._begun = name, total, 0, time.monotonic()

    def advance(self, done: int) -> None:
        """Count units that are done."""
        self._done += done

    @property
    def seconds(self) -> float:
        """Since it began."""
        return time.monotonic() - self._begun

    def words(self) -> str:
        """``43 %, about 12 s left``; without a total the time so far."""
        if not self._total or not self._done:
            return f"{self.seconds:.0f} s so far"
        share = min(1.0, self._done / self._total)
        return f"{100 * share:.0f} %, about {self.seconds * (1 - share) / share:.0f} s left"


def _bars() -> "Progress":
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
    from rich.text import Text

    class PaceColumn(ProgressColumn):
        """``43 %, 3 s left``, then ``100 %  4 s``."""

        def render(self, task: Task) -> Text:
            return Text(pace(task.percentage, task.time_remaining, task.elapsed, task.finished), style="dim")

    return Progress(
        SpinnerColumn(finished_text="[green]✓[/green]"),
        TextColumn("{task.description:<28}"),
        BarColumn(bar_width=18),
        PaceColumn(),
        console=Console(stderr=True),
    )


def pace(percentage: float, left: float | None, elapsed: float | None, finished: bool) -> str:
    """A stage's share in words, from ``LONG`` seconds on with the time left; seconds, ``None`` where not known."""
    if elapsed is None or elapsed < LONG:
        return ""
    if finished:
        return f"100 %  {elapsed:.0f} s"
    return f"{percentage:3.0f} %  {elapsed:.0f} s so far" if left is None else f"{percentage:3.0f} %  {left:.0f} s left"


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
