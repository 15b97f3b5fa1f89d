"""One small experiment, run once for all files here."""

import pytest
from support.processes import Watched

from replay.studies.paper.experiment import Size, run_paper


@pytest.fixture(scope="session")
def tables_of_small_experiment():
    """Key -> table of an experiment: two poses in which 100 faces meet, and 40 about first touch of each family."""
    watched = Watched()
    tables = {table.key: table for table in run_paper(Size(targets=(100,), poses=2, near=40), progress=watched)}
    assert watched.stages and all(total == done for total, done in watched.stages.values())
    return tables
