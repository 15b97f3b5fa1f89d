"""One small experiment, run once for all files here."""

import pytest

from replay.studies.paper.experiment import Size, run_paper
from replay.studies.paper.fixtures import fixture
from replay.studies.paper.rows import groups_of


@pytest.fixture(scope="session")
def small():
    """Key -> table."""
    return {table.key: table for table in run_paper(Size((100,), poses=2, near=40))}


@pytest.fixture(scope="session")
def groups():
    return groups_of(fixture(100, number) for number in range(4))
