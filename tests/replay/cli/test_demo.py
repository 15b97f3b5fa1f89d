import json
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.second_opinions import predicted

from replay.cli.main import main
from replay.document.ranking import ranking
from replay.show.results.run_folder import read_run_folder
from replay.words import count_range
from sessions import read_session
from sessions.synthetic.scenes import make_scene_session


def test_a_small_demo_records_replays_and_names_what_was_missed(tmp_path, monkeypatch, capsys):
    """The made-up scene ``fast-ball`` is recorded and replayed into the usual folder, which exists and is empty.

    JSON on the one stream, progress and the next command on the other. Default detectors are audited against exact:
    hulls and meshes at 50 Hz, and "paper", the pipeline of a paper; all are timed frame by frame. A ball crosses a thin
    wall in 1.5 to 15 ms, so that samples every 20 ms miss some contact. Shares of contact at 50 Hz are also means
    over sampling offsets, of when the first sample is. The folder has the report's misses, a picture, and the session.
    """
    monkeypatch.chdir(tmp_path)
    (tmp_path / "replay-demo").mkdir()
    assert main(["demo", "--scene", "fast-ball", "--format", "json"]) == 0
    printed, progress = capsys.readouterr()
    report = json.loads(printed)
    folder = read_run_folder(tmp_path / "replay-demo")
    assert progress.startswith("making up") and "replay view replay-demo" in progress
    assert list(report["audit"]) == ["hull50", "mesh50", "paper"] and report["oracle"] == "exact"
    assert all(figures["live"] and figures["seconds"]["sample_times"] for figures in report["detectors"].values())
    assert sum(figures["misses"] for figures in report["audit"].values()) == len(folder.rows("misses")) > 0
    means = {"contacts_missed", "late_or_cut_short", "time_missed", "false_contact"}
    assert set(report["audit"]["mesh50"]["means_over_offsets"]) == means
    assert folder.picture.is_file()
    assert len(read_session(tmp_path / "replay-demo" / "session.mcap").frames) == report["session"]["frames"]


def test_brief_touches_are_for_a_class(capsys):
    """``--brief``, which makes touches of a class of students short, without ``--class`` is a wrong call (2)."""
    assert main(["demo", "--brief"]) == 2
    assert "--brief is for --class" in capsys.readouterr().err


def test_class_is_written_to_the_named_folder(tmp_path, monkeypatch, capsys):
    """A file with the name of the folder is in the way: the command names it and fails (1)."""
    monkeypatch.chdir(tmp_path)
    Path("mine").touch()
    assert main(["demo", "--class", "5", "-o", "mine"]) == 1
    assert "mine holds something else than a made-up class; name another folder" in capsys.readouterr().err


@pytest.mark.slow
def test_demo_replaces_its_default_folder_but_no_named_folder(tmp_path, monkeypatch, capsys):
    """Two demos go to the default folder, replay-demo; a third, to which ``-o`` names it, needs ``--force``."""
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert main(["demo", "--scene", "fast-ball", "-q"]) == 0
    assert main(["demo", "--scene", "fast-ball", "-q", "-o", "replay-demo"]) == 1
    assert "--force" in capsys.readouterr().err


@pytest.fixture(scope="module")
def demo_run(tmp_path_factory):
    """Folder, JSON report, first line on stderr and seconds until it of `replay demo` in a process of its own."""
    folder = tmp_path_factory.mktemp("demo") / "run"
    command = [sys.executable, "-m", "replay", "demo", "-o", str(folder), "--format", "json"]
    start = time.monotonic()
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    first_line = program.stderr.readline()
    seconds = time.monotonic() - start
    printed, text = program.communicate()
    assert program.returncode == 0, text
    return SimpleNamespace(folder=folder, report=json.loads(printed), first_line=first_line, first_line_s=seconds)


@pytest.mark.slow
def test_demo_prints_its_first_line_soon(demo_run):
    """Two seconds are promised on a machine of its own; this one is shared, and a start from cold files is slower."""
    assert demo_run.first_line.startswith(b"making up")
    assert demo_run.first_line_s < 5.0


@pytest.mark.slow
def test_the_demo_misses_the_bumps_that_the_closed_form_predicts(demo_run):
    """The demo's glasses bump at known times; mesh50 samples at 50 Hz from an offset, which the report has.

    Contacts that no sample falls into are missed ("never found"), and those into which one surely falls are not.
    """
    session, truth = make_scene_session("bench-bumps")
    report = demo_run.report
    offset_s = report["detectors"]["mesh50"]["settings"]["sampling_offset_s"]
    expected = predicted(truth, session.frames.stamp_ns, rate_hz=50.0, offset_s=offset_s)
    missed = [miss for miss in report["misses"]["mesh50"] if miss["kind"] == "never found"]
    assert all(any(lies_within(miss, contact) for miss in missed) for contact in expected.missed)
    assert expected.caught
    assert not any(lies_within(miss, contact) for miss in missed for contact in expected.caught)
    assert {figures["contacts"] for figures in report["audit"].values()} == {len(truth.episodes)}


@pytest.mark.slow
def test_readme_has_the_counts_of_the_demo(demo_run):
    """The README's table has what the demo counts: contacts missed, contacts late or cut short, and false contact in %.

    It has them of each detector but the last in the ranking, which is the reference.
    """
    readme = (Path(__file__).resolve().parents[3] / "README.md").read_text("utf-8")
    *ranks, _reference = ranking(read_run_folder(demo_run.folder).document)
    assert ranks
    for rank in ranks:
        counts = f"| {count_range(rank.missed_counts)} | {count_range(rank.late_counts)} |"
        assert f"{counts} {100 * rank.false.value:.0f} % |" in readme


def lies_within(miss, contact):
    """Whether a miss is of a planted contact and lies within the time in which that is possible."""
    lower, upper = contact.possibly
    pair = tuple(sorted((miss["body_a"], miss["body_b"])))
    return pair == contact.pair and lower <= miss["start"] and miss["end"] <= upper


@pytest.mark.slow
def test_small_class_is_replayed_up_to_its_page(tmp_path, capsys):
    """Five made-up students are recorded and replayed, and their page is written; progress counts the sessions.

    They are too few for a conclusion, which screen and page say.
    """
    assert main(["demo", "--class", "5", "--out", str(tmp_path / "class")]) == 0
    printed, progress = capsys.readouterr()
    unwrapped = " ".join(printed.split())
    assert "5 students, 5 sessions" in unwrapped and "the detector changes a conclusion is not known" in unwrapped
    assert "few-students" in (tmp_path / "class" / "study" / "study.html").read_text("utf-8")
    assert "5 of 5  S05: done" in progress
