"""One small experiment, run once for all files here."""

import pytest

from replay.studies.paper.experiment import Size, run_paper


@pytest.fixture(scope="session")
def small():
    """Key -> table."""
    return {table.key: table for table in run_paper(Size((100,), poses=2, near=40))}
