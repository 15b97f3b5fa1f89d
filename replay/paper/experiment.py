"""The whole experiment: fixtures, calibration, tables; the same seed and calibration give the same tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from replay.paper.calibration import Calibration, read_calibration
from replay.paper.colony import colony_tables
from replay.paper.contestants import CONTESTANTS, Group, groups_of
from replay.paper.fixtures import POSES, TARGETS, Fixture, fixture
from replay.paper.table_one import TableOne, measure, table_one, tables_of
from replay.paper.tables import PaperTable
from replay.progress import Progress, Silent


@dataclass(frozen=True)
class Size:
    """How much is run: columns of Table I, poses of each, random poses about first touch of each family."""

    targets: tuple[int, ...]
    poses: int
    near: int


QUICK: Final = Size((100, 300, 500), 2, 100)
FULL: Final = Size(TARGETS, POSES, 1000)


@dataclass(frozen=True, eq=False)
class PaperResult:
    """All that was found: tables in order, with what a picture needs beside them."""

    experiment: dict[str, Any]
    fixtures: tuple[Fixture, ...]
    groups: tuple[Group, ...]
    calibration: Calibration
    table_one: TableOne
    tables: tuple[PaperTable, ...]

    @property
    def hard(self) -> int:
        """Fixtures in which FCL lists other pairs than there are: kept, and said."""
        return sum(one.hard for one in self.fixtures)


def run_paper(
    *,
    targets: Sequence[int] = TARGETS,
    poses: int = POSES,
    near: int = 1000,
    seed: int = 0,
    calibration: Path | None = None,
    progress: Progress | None = None,
) -> PaperResult:
    """Run it.

    Parameters
    ----------
    targets, poses : columns of Table I, and poses of each.
    near : random poses about first touch, per family.
    calibration : a file to read times from; ``None``: measure.

    Raises
    ------
    CalibrationError, FixtureError
    """
    experiment = {"targets": list(targets), "poses": poses, "seed": seed}
    known = read_calibration(calibration, experiment, tuple(CONTESTANTS)) if calibration else None
    made = []
    with (progress or Silent()).stage("fixtures", len(targets) * poses, "poses") as advance:
        for target in targets:
            for number in range(poses):
                made.append(fixture(target, number, seed))
                advance(1)
    groups = tuple(groups_of(made))
    times = known or measure(groups, experiment, progress)
    found = table_one(groups, times, progress)
    tables = (*tables_of(found, times), *colony_tables(near, seed, progress))
    return PaperResult(experiment | {"near": near}, tuple(made), groups, times, found, tables)
