"""Wall times of the experiment, taken once: they turn a common wall time into a budget of operations for every row."""

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

SHARES: Final = (0.25, 0.5, 1.0, 2.0)
"""Common wall times B, in medians of ``hybrid``."""


@dataclass(frozen=True)
class Calibration:
    """What was measured: row -> number of faces that meet -> one value per pose; operations without a budget are 0."""

    machine: Mapping[str, Any]
    seconds: Mapping[str, Mapping[int, list[float]]]
    operations: Mapping[str, Mapping[int, list[int]]]

    def budget(self, name: str, target: int, share: float) -> int:
        """Operations that row ``name`` does in ``share`` medians of ``hybrid``; 1 at least."""
        return max(1, round(share * median(self.seconds["hybrid"][target]) * self._rate(name, target)))

    def seconds_of(self, name: str, target: int, operations: int) -> float:
        """Seconds that row ``name`` takes for so many operations."""
        return operations / self._rate(name, target)

    def _rate(self, name: str, target: int) -> float:
        """Operations in a second."""
        return sum(self.operations[name][target]) / sum(self.seconds[name][target])

    def all_seconds(self, name: str) -> list[float]:
        """Seconds of every pose of every target."""
        return [seconds for target in sorted(self.seconds[name]) for seconds in self.seconds[name][target]]
