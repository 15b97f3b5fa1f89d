"""What stands in ``replay.toml`` beside the sessions is asked, the command line comes first, and a mistake is named."""

import json

import pytest
from support.small_worlds import cubes

from replay.cli.main import main
from sessions import write_session

SLOW = "slow=discrete[rate_hz=20]"


@pytest.fixture
def folder(tmp_path):
    write_session(cubes({"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}), tmp_path / "s.mcap")
    return tmp_path


def settings(folder, text):
    (folder / "replay.toml").write_text(text, "utf-8")
    return str(folder / "s.mcap")


def test_detectors_and_gates_of_the_file_are_asked_and_the_command_line_comes_first(folder, capsys):
    file = settings(folder, f'detectors = ["{SLOW}", "sphere"]\nseed = 3\n[gates]\nmax-missed = 0\n')
    assert main(["run", file, "--format", "json"]) == 4
    printed, said = capsys.readouterr()
    told = json.loads(printed)
    assert set(told["audit"]) == {"slow", "sphere"} and told["seed"] == 3 and "slow missed" in told["broken"][0]
    assert "replay.toml: detectors, seed, max-missed" in said
    assert main(["run", file, "-q", "--format", "json", "--detectors", "hybrid", "--seed", "4"]) == 0
    printed, said = capsys.readouterr()
    assert "replay.toml" not in said
    told = json.loads(printed)
    assert set(told["audit"]) == {"hybrid"} and told["seed"] == 4


def test_the_step_rate_of_the_file_is_of_the_usual_detectors(folder, capsys):
    file = settings(folder, "step-rate = 25")
    assert main(["run", file, "--format", "json"]) == 0
    rates = [one["settings"].get("rate_hz") for one in json.loads(capsys.readouterr().out)["detectors"].values()]
    assert 25 in rates
    assert main(["run", file, "--detectors", "hybrid", "--format", "json"]) == 0


def test_a_folder_of_sessions_has_the_file_in_it_and_two_that_differ_are_refused(folder, capsys):
    settings(folder, f'detectors = "{SLOW}"')
    assert main(["run", str(folder), "--format", "json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["audit"]) == {"slow"}
    (folder / "other").mkdir()
    write_session(cubes({"a": [0] * 4, "b": [3] * 4}), folder / "other" / "t.mcap")
    settings(folder / "other", "seed = 1")
    assert main(["run", str(folder), str(folder / "other")]) == 2
    assert "replay these folders one by one" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text, words",
    [
        ('detector = "aabb"', "no setting 'detector'; did you mean 'detectors'?"),
        ("[gates]\nmax_missed = 0", "no setting 'max_missed'; did you mean 'max-missed'?"),
        ("gates = 1", "gates is no table"),
        ("[gates]\nmax-missed = 2", "max-missed is 2; "),
        ('start = "soon"', "start is 'soon'; "),
        ("end = true", "end is True; give a text or a number"),
        ("end = [1, 2]", "end is [1, 2]; give a text or a number"),
        ('out = "runs"', "no setting 'out'; there are: "),
        ("wings = 2", "no setting 'wings'; there are: "),
        ("a = [", "this is not TOML"),
    ],
)
def test_each_mistake_is_one_sentence_that_names_the_file_and_the_key(folder, text, words, capsys):
    assert main(["run", settings(folder, text)]) == 2
    said = capsys.readouterr().err.splitlines()[0]
    assert "replay.toml" in said and words in said


@pytest.mark.parametrize("key", ["detectors", "oracle"])
def test_a_file_that_came_with_recordings_runs_no_code(folder, key, monkeypatch, capsys):
    (folder / "planted.py").write_text("raise SystemExit('ran')\n", "utf-8")
    monkeypatch.chdir(folder)
    assert main(["run", settings(folder, f'{key} = "planted:Detector"')]) == 2
    assert "code of your own is named on the command line" in capsys.readouterr().err
