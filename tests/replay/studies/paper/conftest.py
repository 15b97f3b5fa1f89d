"""One small experiment, run once for all files here."""

import pytest

from replay.studies.paper.contestants import groups_of
from replay.studies.paper.experiment import run_paper
from replay.studies.paper.fixtures import fixture


@pytest.fixture(scope="session")
def small():
    return run_paper(targets=(100,), poses=2, near=40, sessions=1)


@pytest.fixture(scope="session")
def groups():
    return list(groups_of([fixture(100, number) for number in range(4)]))
