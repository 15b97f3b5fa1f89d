"""Run folders of these tests have an empty report."""

import pytest

from replay.show.results import run_folder


@pytest.fixture(autouse=True, scope="module")
def empty_reports():
    """The report of a run is an empty file: drawing it took most of the time of a run folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_folder, "write_report", lambda _result, path: path.touch())
        yield
