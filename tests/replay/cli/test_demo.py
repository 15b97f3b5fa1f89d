import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.second_opinions import predicted

from replay.cli.main import main
from replay.document.ranking import ranking
from replay.show.results.run_folder import read_run_folder
from replay.words import count_range
from sessions import read_session
from sessions.synthetic.scenes import make_scene_session

MEANS = {"contacts_missed", "late_or_cut_short", "time_missed", "false_contact"}


def test_a_small_demo_records_replays_and_names_what_was_missed(tmp_path, monkeypatch, capsys):
    """The scene ``fast-ball``, as JSON, into the usual folder, which exists and is empty."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "replay-demo").mkdir()
    assert main(["demo", "--scene", "fast-ball", "--format", "json"]) == 0
    printed, output = capsys.readouterr()
    report = json.loads(printed)
    folder = read_run_folder(tmp_path / "replay-demo")
    assert output.startswith("making up") and "replay view replay-demo" in output
    assert list(report["audit"]) == ["hull50", "mesh50", "paper"] and report["oracle"] == "exact"
    assert all(figures["live"] and figures["seconds"]["sample_times"] for figures in report["detectors"].values())
    assert sum(item["misses"] for item in report["audit"].values()) == len(folder.rows("misses")) > 0
    assert set(report["audit"]["mesh50"]["means_over_offsets"]) == MEANS
    assert folder.picture.is_file()
    assert len(read_session(tmp_path / "replay-demo" / "session.mcap").frames) == report["session"]["frames"]


def test_brief_touches_are_for_a_class(capsys):
    """A call without ``--class`` is wrong."""
    assert main(["demo", "--brief"]) == 2 and "--brief is for --class" in capsys.readouterr().err


def test_class_is_written_to_the_named_folder(tmp_path, monkeypatch, capsys):
    """A file of that name is in the way."""
    monkeypatch.chdir(tmp_path)
    Path("mine").touch()
    assert main(["demo", "--class", "5", "-o", "mine"]) == 1 and "mine" in capsys.readouterr().err


@pytest.mark.slow
def test_demo_replaces_its_default_folder_but_no_named_folder(tmp_path, monkeypatch, capsys):
    """The same folder, first by default, then by ``-o``, which needs ``--force``."""
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert main(["demo", "--scene", "fast-ball", "-q"]) == 0
    assert main(["demo", "--scene", "fast-ball", "-q", "-o", "replay-demo"]) == 1
    assert "--force" in capsys.readouterr().err


@pytest.mark.slow
def test_the_demo_misses_the_bumps_that_the_closed_form_predicts(tmp_path):
    """Mesh50 samples at 50 Hz from an offset; contacts that no sample falls into are missed. README has the counts."""
    session, truth = make_scene_session("bench-bumps")
    command = [sys.executable, "-m", "replay", "demo", "-o", str(tmp_path / "run"), "--format", "json"]
    start = time.monotonic()
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    first = program.stderr.readline()
    first_line = time.monotonic() - start
    printed, text = program.communicate()
    assert program.returncode == 0, text
    # Two seconds are promised on a machine of its own; this one is shared, and a start from cold files is slower.
    assert first.startswith(b"making up") and first_line < 5.0
    report = json.loads(printed)
    offset_s = report["detectors"]["mesh50"]["settings"]["sampling_offset_s"]
    expected = predicted(truth, session.frames.stamp_ns, rate_hz=50.0, offset_s=offset_s)
    never = [miss for miss in report["misses"]["mesh50"] if miss["kind"] == "never found"]
    assert all(any(_within(miss, episode) for miss in never) for episode in expected.missed)
    assert not any(_within(miss, episode) for miss in never for episode in expected.caught)
    readme = (Path(__file__).resolve().parents[3] / "README.md").read_text("utf-8")
    for rank in ranking(read_run_folder(tmp_path / "run").document)[:-1]:
        counts = f"| {count_range(rank.missed_counts)} | {count_range(rank.late_counts)} |"
        assert f"{counts} {100 * rank.false.value:.0f} % |" in readme
    assert {figures["contacts"] for figures in report["audit"].values()} == {len(truth.episodes)}
    assert expected.caught


def _within(miss, episode):
    """Whether a miss lies within a planted contact."""
    lower, upper = episode.possibly
    pair = tuple(sorted((miss["body_a"], miss["body_b"])))
    return pair == episode.pair and lower <= miss["start"] and miss["end"] <= upper


@pytest.mark.slow
def test_small_class_is_replayed_up_to_its_page(tmp_path, capsys):
    """Five students, too few for a conclusion, which screen and page say."""
    assert main(["demo", "--class", "5", "--out", str(tmp_path / "class")]) == 0
    printed, output = capsys.readouterr()
    text = " ".join(printed.split())
    assert "5 students, 5 sessions" in text and "the detector changes a conclusion is not known" in text
    assert "few-students" in (tmp_path / "class" / "study" / "study.html").read_text("utf-8")
    assert "5 of 5  S05: done" in output
