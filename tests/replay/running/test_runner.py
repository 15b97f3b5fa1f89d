from types import SimpleNamespace

import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.cli.main import main
from replay.detection.progress import Silent
from replay.errors import OutputError
from replay.running.runner import with_measured_fixes
from sessions import write_session
from sessions.errors import SessionFileError

POSITIONS = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}


def test_a_session_and_its_file_give_the_same_digests(tmp_path):
    """The session itself, the path of its file and that path as text; nothing is written."""
    session = unit_cubes_on_x(POSITIONS)
    write_session(session, tmp_path / "s.mcap")
    results = [
        replay.run(given, detectors="hybrid") for given in (session, tmp_path / "s.mcap", str(tmp_path / "s.mcap"))
    ]
    digests = {result.detections["hybrid"].digest for result in results}
    assert len(digests) == 1 and results[0].out is None


def test_out_makes_a_run_folder_with_its_picture(tmp_path):
    """run.rrd is the picture, and is absent where none is wanted."""
    result = replay.run(unit_cubes_on_x(POSITIONS), detectors="sphere", oracle="hybrid", out=tmp_path / "run")
    assert result.out == tmp_path / "run"
    assert (result.out / "run.rrd").stat().st_size > 1000 and (result.out / "summary.json").is_file()
    bare = replay.run(unit_cubes_on_x(POSITIONS), detectors="hybrid", out=str(tmp_path / "bare"), picture=False)
    assert not (bare.out / "run.rrd").exists()


def test_existing_folder_is_refused_before_any_work(tmp_path):
    """The session's file is missing as well: with an existing folder the folder is the error, else the file."""
    with pytest.raises(OutputError, match="--force"):
        replay.run(tmp_path / "missing.mcap", out=tmp_path)
    with pytest.raises(SessionFileError, match=r"missing\.mcap"):
        replay.run(tmp_path / "missing.mcap")


@pytest.mark.slow
def test_recording_of_a_run_is_matched_by_content(tmp_path):
    """After the run its recording is renamed, and another file has its name: ``shrink`` takes the renamed one."""
    write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / "s1.mcap")
    replay.run(tmp_path / "s1.mcap", detectors="slow=discrete[rate_hz=20]", out=tmp_path / "run", picture=False)
    (tmp_path / "s1.mcap").rename(tmp_path / "another_name.mcap")
    (tmp_path / "s1.mcap").write_bytes(b"of another lesson")
    assert main(["shrink", str(tmp_path / "run"), "--miss", "1", "-o", str(tmp_path / "case")]) == 0


@pytest.mark.parametrize(
    ("fix_time", "answers", "is_measured"), [(0.0, ("slow",), False), (5.0, (), False), (5.0, ("slow",), True)]
)
def test_fixes_are_measured_where_time_and_answers_are(monkeypatch, fix_time, answers, is_measured):
    """``fix_time``: seconds to measure in; an answer stands for a detector that is wrong."""
    monkeypatch.setattr("replay.advice.measured_fix.measured_fixes", lambda result, seconds, progress: seconds)
    document = SimpleNamespace(settings=SimpleNamespace(fix_time=fix_time))
    result = SimpleNamespace(document=document, answers=answers)
    assert with_measured_fixes(result, Silent()) == (fix_time if is_measured else result)
