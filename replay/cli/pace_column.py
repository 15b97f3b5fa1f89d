"""How a stage comes along: rate and time left while it runs, the time it took when it is done."""

from __future__ import annotations

from rich.progress import ProgressColumn, Task
from rich.text import Text


class PaceColumn(ProgressColumn):
    """``12,345 frames/s, 3 s left``, then ``4.1 s``.

    Parameters
    ----------
    unit : what is counted.
    """

    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        """What is known of the task's pace."""
        return Text(pace(task.speed, task.time_remaining, task.elapsed, task.finished, self._unit), style="dim")


def pace(speed: float | None, left: float | None, elapsed: float | None, finished: bool, unit: str) -> str:
    """A stage's pace in words; rates and times in seconds, ``None`` where not known."""
    if finished or speed is None or left is None:
        return "" if elapsed is None else f"{elapsed:.1f} s"
    return f"{speed:,.0f} {unit}/s, {left:.0f} s left"
