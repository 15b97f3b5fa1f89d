"""A run, or one of several, that left out frames or poses or failed exits with 3."""

from types import SimpleNamespace

import pytest

from replay.cli import many_sessions, run_report
from replay.running import batch


@pytest.mark.parametrize(("dropped", "lost", "code"), [(0, 0, 0), (1, 0, 3), (0, 1, 3)])
def test_run_that_left_out_frames_or_poses_exits_with_3(monkeypatch, dropped, lost, code):
    """``dropped``: frames that the run left out; ``lost``: poses that were damaged in the recording."""
    monkeypatch.setattr(run_report, "lost_poses", lambda flagged: lost)
    session = SimpleNamespace(notes=(), left_out=(), dropped_frames=SimpleNamespace(total=dropped))
    document = SimpleNamespace(detectors={}, session=session, flagged=())
    people = SimpleNamespace(say=lambda *sentences: None)
    assert run_report.close_run(SimpleNamespace(document=document), people) == code


@pytest.mark.parametrize(
    ("failed", "dropped", "lost", "code"), [({}, 0, 0, 0), ({"b": "no file"}, 0, 0, 3), ({}, 1, 0, 3), ({}, 0, 1, 3)]
)
def test_sessions_of_which_something_was_lost_exit_with_3(monkeypatch, capsys, failed, dropped, lost, code):
    """A batch of which session a has a run; ``failed``: sessions without a run, and the reason.

    ``dropped``: frames that the run of a left out; ``lost``: poses that were damaged in its recording.
    """
    run = SimpleNamespace(dropped_frames=dropped, flagged=(), times={}, open_questions=0)
    outcome = SimpleNamespace(done=["a"], kept=[], failed=failed, runs={"a": run}, audit={}, digest="d")
    monkeypatch.setattr(batch, "run_batch", lambda *_, **__: outcome)
    monkeypatch.setattr(many_sessions, "lost_poses", lambda flagged: lost)
    monkeypatch.setattr(many_sessions, "session_table", lambda outcome: None)
    people = SimpleNamespace(say=print, gate=lambda broken, exit_code: exit_code, quiet=True)
    monkeypatch.setattr(many_sessions, "progress_counter", lambda people, count: None)
    limits = SimpleNamespace(broken_limits=lambda audit, times: [])
    form = {"as_json": True, "as_markdown": False, "table_format": "parquet", "settings": {}}
    assert many_sessions.run_many(["a.mcap"], None, people, limits, **form) == code
