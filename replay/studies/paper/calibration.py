"""All wall times of the experiment, in one file: who reads the same file gets the same tables, on any machine."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import inf
from pathlib import Path
from statistics import median
from typing import Any, Final

from replay.errors import OutputError, ReplayError
from sessions.whole_files import whole_file

VERSION: Final = 2
SHARES: Final = (0.25, 0.5, 1.0, 2.0)
"""Common wall times B, in medians of ``hybrid``."""


class CalibrationError(ReplayError, ValueError):
    """A calibration file that cannot be read, or is of another experiment."""


@dataclass(frozen=True)
class Calibration:
    """What was measured once."""

    experiment: Mapping[str, Any]  # targets, poses and seed the times belong to
    machine: Mapping[str, Any]  # where it was measured
    # seconds, operations: row -> target, as text -> one value per pose; operations of rows without a budget are 0
    seconds: Mapping[str, Mapping[str, list[float]]]
    operations: Mapping[str, Mapping[str, list[int]]]
    # family -> searcher -> faces sampled, as text -> seconds of an evaluation
    pace: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)

    def budget(self, name: str, target: int, share: float) -> int:
        """Operations that row ``name`` does in ``share`` medians of ``hybrid``; 1 at least."""
        return max(1, round(share * median(self.seconds["hybrid"][str(target)]) * self._rate(name, target)))

    def seconds_of(self, name: str, target: int, operations: int) -> float:
        """Seconds that row ``name`` takes for so many operations."""
        return operations / self._rate(name, target)

    def _rate(self, name: str, target: int) -> float:
        """Operations in a second."""
        return sum(self.operations[name][str(target)]) / sum(self.seconds[name][str(target)])

    def all_seconds(self, name: str) -> list[float]:
        """Seconds of every pose of every target."""
        return [one for key in sorted(self.seconds[name], key=int) for one in self.seconds[name][key]]


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write the file; floats come back as they were."""
    path.parent.mkdir(parents=True, exist_ok=True)
    put(path, json.dumps({"version": VERSION} | asdict(calibration), indent=1, allow_nan=False) + "\n")


def put(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all."""
    with whole_file(path, OutputError) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def read_calibration(path: Path, experiment: Mapping[str, Any], names: tuple[str, ...]) -> Calibration:
    """Read the file of the same experiment.

    Raises CalibrationError: no such file, no calibration, or of other targets, poses, seed or rows.
    """
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise CalibrationError(f"{path} cannot be read as a calibration ({error}); leave it out to measure") from error
    if not isinstance(stored, dict) or stored.pop("version", None) != VERSION:
        raise CalibrationError(f"{path} is no calibration of version {VERSION}; leave it out to measure anew")
    try:
        found = Calibration(**stored)
        if found.experiment != experiment:
            raise CalibrationError(f"{path} is of {found.experiment}, not of {experiment}; use the same options")
        for name in names:
            _require_times(path, name, found, experiment)
    except (AttributeError, TypeError) as error:
        raise CalibrationError(f"{path} is no calibration ({error}); leave it out to measure anew") from error
    return found


def _require_times(path: Path, name: str, found: Calibration, experiment: Mapping[str, Any]) -> None:
    """A positive time and a count of operations of every pose of every target."""
    for target in experiment["targets"]:
        seconds, operations = (table.get(name, {}).get(str(target), []) for table in (found.seconds, found.operations))
        good = len(seconds) == len(operations) == experiment["poses"]
        if not good or not all(isinstance(one, float) and 0.0 < one < inf for one in seconds):
            raise CalibrationError(
                f"{path} has no times of {name} in every pose of {target} faces; leave it out to measure anew"
            )
