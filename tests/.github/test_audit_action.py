"""The steps of the GitHub action as its file has them, in the shell that it names; the tool is installed already."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.cli import console
from replay.guide.pages import page
from sessions import write_session

ROOT = Path(__file__).resolve().parents[2]
ACTION = yaml.safe_load((ROOT / ".github" / "actions" / "audit" / "action.yml").read_text("utf-8"))
STEPS = {step["name"]: step for step in ACTION["runs"]["steps"] if "run" in step}
GATE = "slow missed contacts"

needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash, as GitHub has it")


def filled(text, inputs):
    """The value with its expressions filled in, as GitHub fills them."""

    def value(found):
        kind, _, name = found[1].partition(".")
        return inputs[name] if kind == "inputs" else {"steps.install.outputs.python": sys.executable}[found[1]]

    return re.sub(r"\$\{\{ ([\w.-]+) \}\}", value, text)


def run_audit_step(folder, **given):
    """Run the step *Audit* in a folder: its exit code, the page of the job, and what it hands on."""
    inputs = {name: item.get("default", "") for name, item in ACTION["inputs"].items()} | {"options": "--no-picture"}
    inputs |= {name.replace("_", "-"): value for name, value in given.items()}
    step, files = STEPS["Audit"], {name: folder / f"{name}.md" for name in ("GITHUB_STEP_SUMMARY", "GITHUB_OUTPUT")}
    values = {name: filled(value, inputs) for name, value in step["env"].items()}
    values |= {name: str(file) for name, file in files.items()} | {"RUNNER_TEMP": str(folder)}
    sentence = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    done = subprocess.run(
        sentence, cwd=folder, env={**os.environ, **values}, capture_output=True, text=True, timeout=300
    )
    return done.returncode, *(file.read_text("utf-8") for file in files.values())


@pytest.fixture
def folder_of_recordings(tmp_path):
    """A folder with recordings/bench.mcap, in which cubes touch in frame 4 and in frames 8 to 10."""
    (tmp_path / "recordings").mkdir()
    write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / "recordings" / "bench.mcap")
    return tmp_path


@needs_bash
@pytest.mark.slow
@pytest.mark.parametrize(("detectors", "ends_with"), [("slow=discrete[rate_hz=20]", 4), ("hybrid", 0)])
def test_regression_fails_the_build_and_sound_detector_passes(folder_of_recordings, detectors, ends_with):
    code, printed, output = run_audit_step(
        folder_of_recordings, sessions="recordings", detectors=detectors, max_missed="0", out="runs"
    )
    assert (code, output) == (ends_with, f"exit-code={ends_with}\n")
    assert (folder_of_recordings / "runs" / "bench" / "report.html").is_file()
    text = (f"**gate failed:** {GATE}", "more than --max-missed 0", "| bench | 12 | 2 | 0-2 |")
    assert {word in printed for word in text} == {ends_with == 4}


@needs_bash
def test_action_inputs_are_data_and_errors_stand_on_the_page(folder_of_recordings):
    code, printed, output = run_audit_step(
        folder_of_recordings, sessions="$(touch ran)\n; touch ran", options="--no-picture\n--seed\n1"
    )
    assert (code, output) == (2, "exit-code=2\n") and "does not exist" in printed
    assert not (folder_of_recordings / "ran").exists()


FOREIGN = 'import pathlib\npathlib.Path("ran").write_text(__name__)\nraise SystemExit("this is not the tool")\n'


def plant_foreign_modules(folder):
    """Files of the user's checkout with names of modules that the tool imports; each would leave the file ``ran``."""
    for name in ("numpy.py", "scipy.py", "click.py", "json.py", "random.py", "llvmlite.py"):
        (folder / name).write_text(FOREIGN)
    for name in ("replay", "sessions", "cdcore", "numba"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(FOREIGN)


@needs_bash
@pytest.mark.slow
def test_modules_of_the_checkout_are_not_imported(folder_of_recordings, monkeypatch):
    plant_foreign_modules(folder_of_recordings)
    monkeypatch.setenv("PYTHONPATH", str(folder_of_recordings))
    code, printed, _ = run_audit_step(
        folder_of_recordings, sessions="recordings", detectors="sphere", options="--no-picture\n--oracle\nnone"
    )
    assert code == 0, printed
    assert (
        not (folder_of_recordings / "ran").exists()
        and (folder_of_recordings / "replay-runs" / "bench" / "summary.json").is_file()
    )


@needs_bash
@pytest.mark.slow
def test_detector_of_the_checkout_loads_from_pythonpath(folder_of_recordings, monkeypatch):
    plant_foreign_modules(folder_of_recordings)
    (folder_of_recordings / "src").mkdir()
    (folder_of_recordings / "src" / "my_engine.py").write_text(
        "from cdcore.detectors.sphere import SphereDetector as Mine\n"
    )
    monkeypatch.setenv("PYTHONPATH", "src")
    code, printed, _ = run_audit_step(folder_of_recordings, sessions="recordings", detectors="mine=my_engine:Mine")
    assert code == 0, printed
    assert not (folder_of_recordings / "ran").exists()


def test_no_step_writes_an_input_into_its_script():
    assert set(STEPS) == {"Install", "Audit"}
    assert not [name for name, step in STEPS.items() if "${{" in step["run"]]


def test_exit_code_table_matches_the_verbs():
    codes = {int(code) for code in re.findall(r"^\| (\d+) \|", page("in-a-build"), re.MULTILINE)}
    existing = {
        console.EXIT_OK,
        console.EXIT_FAILURE,
        2,
        console.EXIT_DATA_LOSS,
        console.EXIT_GATE_FAILED,
        console.EXIT_INTERRUPTED,
    }
    assert codes == existing
