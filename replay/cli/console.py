"""Answers on stdout, sentences and progress on stderr, and exit codes. Progress is shown on a terminal only."""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import IO, TYPE_CHECKING, Any, Final

from replay import words
from replay.detection.progress import Advance, ignore_progress
from replay.words import number, safe_text

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

EXIT_OK: Final = 0
EXIT_FAILURE: Final = 1
EXIT_DATA_LOSS: Final = 3
EXIT_GATE_FAILED: Final = 4
EXIT_INTERRUPTED: Final = 130
"""Exit codes; 2 is click's, for a wrong call or a missing path."""

PIPED_WIDTH: Final = 100
"""Columns where there is no terminal and ``COLUMNS`` says nothing: what a mail, a log or a second pane shows whole."""


class People:
    """Speaks to whoever started the command; where asked for not at all (``quiet``), or more (``verbose``)."""

    def __init__(self, *, quiet: bool = False, verbose: bool = False) -> None:
        self.quiet, self.verbose = quiet, verbose

    def say(self, *sentences: str) -> None:
        """Sentences, each on a line, at once."""
        if not self.quiet:
            for sentence in sentences:
                print(_folded_sentence(safe_text(sentence), sys.stderr), file=sys.stderr, flush=True)

    def detail(self, sentence: str) -> None:
        """One sentence for those who asked for more."""
        if self.verbose:
            self.say(sentence)

    def gate(self, broken: Sequence[str], otherwise: int = EXIT_OK) -> int:
        """Say which gates failed, to the quiet too: they are why the command fails; the exit code."""
        People().say(*(f"gate: {sentence}" for sentence in broken))
        return EXIT_GATE_FAILED if broken else otherwise


LONG_STAGE_S: Final = 3.0
"""Seconds from which a stage says how much is done and left, and stays ticked off on the screen."""

REPORT_INTERVAL_S: Final = 10.0
"""Seconds between the lines of a long stage where there is no terminal."""


class TerminalProgress:
    """A bar for each stage on a terminal; elsewhere a line every ten seconds. A short stage leaves nothing behind."""

    def __init__(self, people: People, report_interval: float = REPORT_INTERVAL_S) -> None:
        self.say = people.say
        self._quiet, self._interval_s = people.quiet, report_interval

    def stage(self, name: str, total: int | None = None, unit: str = "frames") -> AbstractContextManager[Advance]:
        """Report a piece of work of ``total`` units while it lasts."""
        del unit
        if self._quiet:
            return nullcontext(ignore_progress)
        return _bar(name, total) if sys.stderr.isatty() else self._report_lines(name, total)

    @contextmanager
    def _report_lines(self, name: str, total: int | None) -> Iterator[Advance]:
        done_units, start_time = 0, time.monotonic()
        printed_at = start_time

        def advance(more: int) -> None:
            nonlocal done_units, printed_at
            done_units += more
            now = time.monotonic()
            if now - printed_at >= self._interval_s:
                printed_at = now
                self.say(f"{name}: {progress_text(done_units / total if total else 0.0, now - start_time)}")

        yield advance
        if time.monotonic() - start_time >= self._interval_s:
            self.say(f"{name}: {progress_text(1.0, time.monotonic() - start_time)}")


def progress_text(fraction: float, seconds: float) -> str:
    """Progress of a stage with its time: ``43 %  12 s left``, ``100 %  14 s``."""
    if fraction >= 1.0:
        return f"100 %  {words.decimal(seconds, 0)} s"
    if fraction <= 0.0:
        return f"{words.decimal(seconds, 0)} s so far"
    return f"{words.decimal(100 * fraction, 0):>3} %  {words.decimal(seconds * (1.0 - fraction) / fraction, 0)} s left"


@contextmanager
def _bar(name: str, total: int | None) -> Iterator[Advance]:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
    from rich.text import Text

    class PaceColumn(ProgressColumn):
        """Nothing of a short stage."""

        def render(self, task: Task) -> Text:
            seconds = task.elapsed or 0.0
            return Text(progress_text(task.percentage / 100, seconds) if seconds >= LONG_STAGE_S else "", style="dim")

    ticked, described = SpinnerColumn(finished_text="[green]✓[/green]"), TextColumn("{task.description:<28}")
    with Progress(ticked, described, BarColumn(bar_width=18), PaceColumn(), console=Console(stderr=True)) as bars:
        task = bars.add_task(name, total=total)
        yield lambda more: bars.advance(task, more)
        bars.update(task, total=total or 1, completed=total or 1)
        bars.live.transient = (bars.tasks[0].elapsed or 0.0) < LONG_STAGE_S


def progress_counter(people: People, total: int) -> Callable[[str, str], None]:
    """Tells each finished piece with how many there are, how long the rest may take and how many a minute are done."""
    done_count, worked_count, start_time = 0, 0, time.monotonic()

    def tell(name: str, outcome: str) -> None:
        nonlocal done_count, worked_count
        done_count, worked_count = done_count + 1, worked_count + (outcome != "kept")
        seconds_each = (time.monotonic() - start_time) / max(worked_count, 1)
        remaining_text = (
            f", about {words.decimal(seconds_each * (total - done_count), 0)} s left at "
            f"{number(60 / seconds_each)} a minute"
        )
        people.say(
            f"{done_count:>4} of {total}  {name}: "
            f"{outcome}{remaining_text if worked_count and done_count < total else ''}"
        )

    return tell


def _folded_sentence(sentence: str, stream: "IO[str]") -> str:
    """A sentence for a terminal, no word of it cut; elsewhere as it is, unless ``COLUMNS`` asks."""
    if not (stream.isatty() or "COLUMNS" in os.environ):
        return sentence
    from shutil import get_terminal_size
    from textwrap import fill

    terminal_width, indent = get_terminal_size().columns, " " * (len(sentence) - len(sentence.lstrip()) + 2)
    fits_whole = len(sentence) <= terminal_width
    return (
        sentence
        if fits_whole
        else fill(sentence, terminal_width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    )


def answer(as_json: bool, json_value: Any, render: "Callable[[], RenderableType | list[str]]") -> None:
    """Print what a verb found: ``json_value`` data as JSON, or what ``render`` makes for a terminal."""
    if as_json:
        print_as_json(json_value)
    else:
        show(render())


def show(renderable: "RenderableType | list[str]") -> None:
    """Print for people: a ``str`` is a line, a ``list`` are lines; what is piped has no spaces at the ends of lines.

    Nothing is cropped: a path longer than the terminal is wide runs over into the next line, and can be copied whole.
    """
    if isinstance(renderable, str | list):
        for line in [renderable] if isinstance(renderable, str) else renderable:
            print(_folded_sentence(safe_text(line), sys.stdout))
    elif sys.stdout.isatty():
        stdout_console().print(renderable, crop=False)
    else:
        with (console := stdout_console()).capture() as capture:
            console.print(renderable, crop=False)
        print("\n".join(line.rstrip() for line in capture.get().splitlines()))


def print_as_json(json_value: Any) -> None:
    """Data for programs."""
    print(json.dumps(json_value, indent=1, allow_nan=False))


def stdout_console() -> "Console":
    """Console on stdout, as wide as the terminal or ``COLUMNS``."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else PIPED_WIDTH, highlight=False)
