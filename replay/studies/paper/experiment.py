"""The whole experiment: fixtures, wall times, tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.base.progress import Progress, Silent
from replay.outputs.paper_table import PaperTable
from replay.studies.paper.calibration import Calibration
from replay.studies.paper.colony import ColonyRows, colony_rows, colony_tables
from replay.studies.paper.contestants import Group, groups_of
from replay.studies.paper.feature_samples import DRAWS, Drawn, feature_sample_tables, pace_of, search_samples
from replay.studies.paper.fixtures import FAMILY_NAMES, POSES, TARGETS, Fixture, fixture
from replay.studies.paper.frame_sampling import Sampled, frame_sampling_table, sample_frames
from replay.studies.paper.table_one import TableOne, ask_group, joined, measure, tables_of


@dataclass(frozen=True)
class Size:
    """How much is run: columns of Table I, poses of each, random poses about first touch of each family, sessions."""

    targets: tuple[int, ...]
    poses: int
    near: int
    sessions: int


QUICK: Final = Size((100, 300, 500), 2, 60, 1)
FULL: Final = Size(TARGETS, POSES, 1000, 3)


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
    # targets, poses: columns of Table I, and poses of each
    targets: Sequence[int] = TARGETS,
    poses: int = POSES,
    near: int = 1000,  # random poses about first touch, per family
    sessions: int = 3,  # made-up sessions whose frames are sampled
    seed: int = 0,
    progress: Progress | None = None,
) -> PaperResult:
    """Run it. Raises FixtureError."""
    reporter = progress or Silent()
    fixtures = _fixtures(targets, poses, seed, reporter)
    groups = tuple(groups_of(fixtures))
    times = measure(groups, reporter)
    found = _each("Table I", [(ask_group, (group, times)) for group in groups], "groups", reporter)
    table_one = joined(found)
    colony, drawn, sampled = _searches(near, sessions, seed, reporter)
    tables = (
        *tables_of(table_one, times), frame_sampling_table(sampled), *colony_tables(colony),
        *feature_sample_tables(drawn, pace_of(drawn)),
    )  # fmt: skip
    experiment = {"targets": list(targets), "poses": poses, "seed": seed, "near": near, "sessions": sessions}
    return PaperResult(experiment, fixtures, groups, times, table_one, tables)


def _fixtures(targets: Sequence[int], poses: int, seed: int, reporter: Progress) -> tuple[Fixture, ...]:
    """All fixtures in order of target and pose."""
    wanted = [(target, number, seed) for target in targets for number in range(poses)]
    return tuple(_each("fixtures", [(fixture, one) for one in wanted], "fixtures", reporter))


def _each(name: str, tasks: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]], unit: str, reporter: Progress) -> Any:
    """What each function returns for its arguments, in order, as a stage of this name."""
    found = []
    with reporter.stage(name, len(tasks), unit) as advance:
        for work, arguments in tasks:
            found.append(work(*arguments))
            advance(1)
    return found


def _searches(
    near: int, sessions: int, seed: int, reporter: Progress
) -> tuple[list[ColonyRows], list[Drawn], list[list[Sampled]]]:
    """What hangs on no fixture."""
    tasks: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
        (colony_rows, (family, near, seed)) for family in FAMILY_NAMES
    ]
    tasks += [(sample_frames, (seed * sessions + number,)) for number in range(sessions)]
    tasks += [(search_samples, (family, draw, near, seed)) for family in FAMILY_NAMES for draw in range(DRAWS)]
    found = _each("searches near contact, sampled frames and faces", tasks, "parts", reporter)
    first, second = len(FAMILY_NAMES), len(FAMILY_NAMES) + sessions
    return found[:first], found[second:], found[first:second]
