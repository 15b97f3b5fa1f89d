"""One small experiment, run once for all files here."""

import pytest
from support.processes import Watched

from replay.studies.paper.experiment import Size, run_paper


@pytest.fixture(scope="session")
def small():
    """Key -> table."""
    watched = Watched()
    tables = {table.key: table for table in run_paper(Size((100,), poses=2, near=40), progress=watched)}
    assert watched.stages and all(total == done for total, done in watched.stages.values())
    return tables
