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

SINGLE_CONTACT = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}
"""Metres on X of two cubes of 1 m, which touch in frame 2 of six."""


def test_a_session_and_its_file_give_the_same_digests(tmp_path):
    """The session itself, the path of its file and that path as text; nothing is written without ``out``."""
    session, file = unit_cubes_on_x(SINGLE_CONTACT), tmp_path / "s.mcap"
    write_session(session, file)
    results = [replay.run(source, detectors="hybrid") for source in (session, file, str(file))]
    assert len({result.detections["hybrid"].digest for result in results}) == 1
    assert [result.out for result in results] == [None, None, None]


def test_out_makes_a_run_folder_with_its_picture(tmp_path):
    """run.rrd is the picture, of more than a kilobyte; two cubes touch once."""
    result = replay.run(unit_cubes_on_x(SINGLE_CONTACT), detectors="sphere", oracle="hybrid", out=tmp_path / "run")
    assert result.out == tmp_path / "run"
    assert (result.out / "summary.json").is_file()
    assert (result.out / "run.rrd").stat().st_size > 1000


def test_run_folder_without_a_picture_on_request(tmp_path):
    """``out`` may be a text; two cubes touch once."""
    result = replay.run(unit_cubes_on_x(SINGLE_CONTACT), detectors="hybrid", out=str(tmp_path / "run"), picture=False)
    assert (result.out / "summary.json").is_file()
    assert not (result.out / "run.rrd").exists()


def test_existing_folder_is_refused_before_any_work(tmp_path):
    """The session's file is missing as well: with an existing folder the folder is the error, else the file."""
    with pytest.raises(OutputError, match=r"exists; name another folder, or replace it with --force"):
        replay.run(tmp_path / "missing.mcap", out=tmp_path)
    with pytest.raises(SessionFileError, match=r"missing\.mcap does not exist"):
        replay.run(tmp_path / "missing.mcap")


@pytest.mark.slow
def test_recording_of_a_run_is_matched_by_content(tmp_path):
    """After the run its recording is renamed, and another file has its name: ``shrink`` takes the renamed one.

    The detector samples every fifth frame and misses a contact, number 1.
    """
    write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / "s1.mcap")
    replay.run(tmp_path / "s1.mcap", detectors="slow=discrete[rate_hz=20]", out=tmp_path / "run", picture=False)
    (tmp_path / "s1.mcap").rename(tmp_path / "another_name.mcap")
    (tmp_path / "s1.mcap").write_bytes(b"of another lesson")
    assert main(["shrink", str(tmp_path / "run"), "--miss", "1", "-o", str(tmp_path / "case")]) == 0


@pytest.mark.parametrize(
    ("fix_time", "answers", "is_measured"),
    [
        pytest.param(0.0, ("slow",), False, id="no time"),
        pytest.param(5.0, (), False, id="no detector is wrong"),
        pytest.param(5.0, ("slow",), True, id="time, and a wrong detector"),
    ],
)
def test_fixes_are_measured_where_time_and_answers_are(monkeypatch, fix_time, answers, is_measured):
    """``fix_time``: seconds to measure in; ``answers``: one for each detector that is wrong."""
    monkeypatch.setattr(
        "replay.advice.measured_fix.measured_fixes", lambda result, seconds, progress: f"measured in {seconds} s"
    )
    document = SimpleNamespace(settings=SimpleNamespace(fix_time=fix_time))
    result = SimpleNamespace(document=document, answers=answers)
    assert with_measured_fixes(result, Silent()) == ("measured in 5.0 s" if is_measured else result)
