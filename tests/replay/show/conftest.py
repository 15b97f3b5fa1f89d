"""Runs in some state, written once for all tests that compare its outputs."""

from functools import cache
from types import SimpleNamespace

import pytest
from support.report_states import result_of
from support.viewers import recording_text

from replay.show.results.run_folder import write_run_folder


@pytest.fixture(scope="session")
def written_run_of(tmp_path_factory):
    """Writes the run in a state with its picture, and reads texts of that; each run once."""

    @cache
    def written_run(state):
        result = result_of(state)
        folder = write_run_folder(result, tmp_path_factory.mktemp("run") / "run", picture=True)
        return SimpleNamespace(result=result, folder=folder, picture_text=recording_text(folder / "run.rrd"))

    return written_run
