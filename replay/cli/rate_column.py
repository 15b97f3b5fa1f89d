"""The rate of a bar in its own unit, ``12,345 frames/s``."""

from __future__ import annotations

from rich.progress import ProgressColumn, Task
from rich.text import Text


class RateColumn(ProgressColumn):
    """Units per second since the stage began.

    Parameters
    ----------
    unit : what is counted.
    """

    def __init__(self, unit: str) -> None:
        super().__init__()
        self._unit = unit

    def render(self, task: Task) -> Text:
        """The rate, or nothing while there is none."""
        speed = task.finished_speed or task.speed
        known = speed is not None and task.total not in (None, 1)
        return Text(f"{speed:>9,.0f} {self._unit}/s" if known else " " * (12 + len(self._unit)), style="cyan")
