"""The whole experiment: fixtures, wall times, tables."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

from replay.detection.progress import Progress, Silent
from replay.document.tables import Table
from replay.studies.paper.colony import colony_rows, colony_tables
from replay.studies.paper.feature_samples import feature_sample_tables, search_samples
from replay.studies.paper.fixtures import FAMILY_NAMES, POSES_PER_TARGET, TARGET_FACES, make_fixture
from replay.studies.paper.rows import groups_of
from replay.studies.paper.table_one import (
    BUDGET_FRACTIONS,
    accuracy_table,
    ask_cut_short,
    ask_to_completion,
    completion_table,
    join_answers,
    run_time_table,
    time_table,
)


@dataclass(frozen=True)
class Size:
    """Size of an experiment.

    ``targets``: columns of Table I; ``poses``: poses of each; ``near``: random poses about first touch of each family;
    ``search_seeds``: seeds with which a search is run over these.
    """

    targets: tuple[int, ...]
    poses: int
    near: int
    search_seeds: int = 2


QUICK_SIZE: Final = Size((100, 300, 500), 2, 60)
FULL_SIZE: Final = Size(TARGET_FACES, POSES_PER_TARGET, 1000, search_seeds=4)


def run_paper(experiment_size: Size = FULL_SIZE, seed: int = 0, progress: Progress | None = None) -> list[Table]:
    """All tables in order. Raises FixtureError."""

    def run_stage(name: str, task_function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Results of ``task_function`` for each task, as a stage of this name."""
        task_results = []
        with (progress or Silent()).stage(name, len(tasks), "parts") as advance:
            for task in tasks:
                task_results.append(task_function(*task))
                advance(1)
        return task_results

    fixtures = run_stage(
        "fixtures",
        make_fixture,
        [(*key, seed) for key in product(experiment_size.targets, range(experiment_size.poses))],
    )
    groups = groups_of(fixtures)
    complete_answers = join_answers(run_stage("measuring times", ask_to_completion, [(group,) for group in groups]))
    answers_by_budget = {
        fraction: join_answers(
            run_stage(
                f"Table I, B = {fraction:g}", ask_cut_short, [(group, complete_answers, fraction) for group in groups]
            )
        )
        for fraction in BUDGET_FRACTIONS
    }
    near_tasks = [(family, experiment_size.near, seed, experiment_size.search_seeds) for family in FAMILY_NAMES]
    colony_results = run_stage("searches near contact", colony_rows, near_tasks)
    sample_searches = run_stage(
        "samples of faces", search_samples, [(family, experiment_size.near, seed) for family in FAMILY_NAMES]
    )
    return [
        run_time_table(complete_answers, answers_by_budget),
        completion_table(complete_answers),
        accuracy_table(answers_by_budget),
        time_table(complete_answers),
        *colony_tables(colony_results, experiment_size.search_seeds),
        *feature_sample_tables(sample_searches),
    ]
