"""All wall times of the experiment, in one file: who reads the same file gets the same tables, on any machine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

from replay.errors import ReplayError

VERSION: Final = 1
SHARES: Final = (0.25, 0.5, 1.0, 2.0)
"""Common wall times B, in medians of ``hybrid``."""


class CalibrationError(ReplayError, ValueError):
    """A calibration file that cannot be read, or is of another experiment."""


@dataclass(frozen=True)
class Calibration:
    """What was measured once.

    Parameters
    ----------
    experiment : targets, poses and seed the times belong to.
    machine : where it was measured.
    seconds, operations : row -> target, as text -> one value per pose; operations of rows without a budget are 0.
    """

    experiment: Mapping[str, Any]
    machine: Mapping[str, Any]
    seconds: Mapping[str, Mapping[str, list[float]]]
    operations: Mapping[str, Mapping[str, list[int]]]

    def budget(self, name: str, target: int, share: float) -> int:
        """Operations that row ``name`` does in ``share`` medians of ``hybrid``; 1 at least."""
        key = str(target)
        rate = sum(self.operations[name][key]) / sum(self.seconds[name][key])
        return max(1, round(share * median(self.seconds["hybrid"][key]) * rate))

    def all_seconds(self, name: str) -> list[float]:
        """Seconds of every pose of every target."""
        return [one for key in sorted(self.seconds[name], key=int) for one in self.seconds[name][key]]


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write the file; floats come back as they were."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".part")
    text = json.dumps({"version": VERSION} | asdict(calibration), indent=1, allow_nan=False)
    partial.write_text(text + "\n", encoding="utf-8", newline="\n")
    partial.replace(path)


def read_calibration(path: Path, experiment: Mapping[str, Any], names: tuple[str, ...]) -> Calibration:
    """Read the file of the same experiment.

    Raises
    ------
    CalibrationError
        No such file, no calibration, or of other targets, poses, seed or rows.
    """
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise CalibrationError(f"{path} cannot be read as a calibration ({error}); leave it out to measure") from error
    if not isinstance(told, dict) or told.pop("version", None) != VERSION:
        raise CalibrationError(f"{path} is no calibration of version {VERSION}; leave it out to measure anew")
    try:
        found = Calibration(**told)
    except TypeError as error:
        raise CalibrationError(f"{path} is no calibration ({error}); leave it out to measure anew") from error
    if dict(found.experiment) != dict(experiment):
        raise CalibrationError(
            f"{path} is of {dict(found.experiment)}, not of {dict(experiment)}; use the same options"
        )
    absent = [name for name in names if name not in found.seconds]
    if absent:
        raise CalibrationError(f"{path} knows no times of {absent[0]}; leave it out to measure anew")
    return found
