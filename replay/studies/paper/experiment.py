"""The whole experiment: fixtures, wall times, tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.base.processes import Crew
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
    jobs: int = 1,  # processes; what is no time is the same for any number
    progress: Progress | None = None,
) -> PaperResult:
    """Run it. Raises FixtureError, WorkerError."""
    reporter = progress or Silent()
    with Crew(jobs) as crew:
        fixtures = _fixtures(crew, targets, poses, seed, reporter)
        groups = tuple(groups_of(fixtures))
        times = measure(groups, reporter)
        largest_first = sorted(groups, key=lambda group: -sum(len(body.mesh.faces) for body in group.bodies))
        with reporter.stage("Table I", len(groups), "groups") as advance:
            found = crew.results([(ask_group, (group, times)) for group in largest_first], advance)
        order = [largest_first.index(group) for group in groups]
        table_one = joined([found[place] for place in order])
        colony, drawn, sampled = _searches(crew, near, sessions, seed, reporter)
    tables = (
        *tables_of(table_one, times), frame_sampling_table(sampled), *colony_tables(colony),
        *feature_sample_tables(drawn, pace_of(drawn)),
    )  # fmt: skip
    experiment = {"targets": list(targets), "poses": poses, "seed": seed, "near": near, "sessions": sessions}
    return PaperResult(experiment, fixtures, groups, times, table_one, tables)


def _fixtures(crew: Crew, targets: Sequence[int], poses: int, seed: int, reporter: Progress) -> tuple[Fixture, ...]:
    """All fixtures in order of target and pose; those of the same meshes are made in one process."""
    families = range(min(poses, len(FAMILY_NAMES)))
    tasks = [
        (target, tuple(range(family, poses, len(FAMILY_NAMES))), seed) for target in targets for family in families
    ]
    with reporter.stage("fixtures", len(tasks), "groups") as advance:
        made = crew.results([(_make_fixtures, task) for task in reversed(tasks)], advance)
    return tuple(sorted((one for some in made for one in some), key=lambda one: (one.target, one.number)))


def _make_fixtures(target: int, numbers: tuple[int, ...], seed: int) -> list[Fixture]:
    return [fixture(target, number, seed) for number in numbers]


def _searches(
    crew: Crew, near: int, sessions: int, seed: int, reporter: Progress
) -> tuple[list[ColonyRows], list[Drawn], list[list[Sampled]]]:
    """What hangs on no fixture, in one round."""
    tasks: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
        (colony_rows, (family, near, seed)) for family in FAMILY_NAMES
    ]
    tasks += [(sample_frames, (seed * sessions + number,)) for number in range(sessions)]
    tasks += [(search_samples, (family, draw, near, seed)) for family in FAMILY_NAMES for draw in range(DRAWS)]
    with reporter.stage("searches near contact, sampled frames and faces", len(tasks), "parts") as advance:
        found = crew.results(tasks, advance)
    first, second = len(FAMILY_NAMES), len(FAMILY_NAMES) + sessions
    return found[:first], found[second:], found[first:second]
