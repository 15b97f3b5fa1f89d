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
USAGE_ERROR = 2
"""Exit code of click for a wrong argument or option."""

needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash, as GitHub has it")


def filled(text, inputs):
    """The value of a step with its expressions ``${{ ... }}`` filled in, as GitHub fills them."""

    def value(match):
        kind, _, name = match[1].partition(".")
        return inputs[name] if kind == "inputs" else {"steps.install.outputs.python": sys.executable}[match[1]]

    return re.sub(r"\$\{\{ ([\w.-]+) \}\}", value, text)


def run_audit_step(folder, **given):
    """Runs the step *Audit* in a folder, with these inputs of the action and else its defaults, without pictures.

    Returns its exit code, the page of the job that it writes, and what it hands on to later steps.
    """
    inputs = {name: item.get("default", "") for name, item in ACTION["inputs"].items()} | {"options": "--no-picture"}
    inputs |= {name.replace("_", "-"): value for name, value in given.items()}
    step, files = STEPS["Audit"], {name: folder / f"{name}.md" for name in ("GITHUB_STEP_SUMMARY", "GITHUB_OUTPUT")}
    values = {name: filled(value, inputs) for name, value in step["env"].items()}
    values |= {name: str(file) for name, file in files.items()} | {"RUNNER_TEMP": str(folder)}
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    ended = subprocess.run(
        command, cwd=folder, env={**os.environ, **values}, capture_output=True, text=True, timeout=300
    )
    return ended.returncode, *(file.read_text("utf-8") for file in files.values())


@pytest.fixture
def folder_of_recordings(tmp_path):
    """A folder with recordings/bench.mcap, in which cubes touch in frame 4 and in frames 8 to 10."""
    (tmp_path / "recordings").mkdir()
    write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / "recordings" / "bench.mcap")
    return tmp_path


TEXTS_OF_A_FAILED_GATE = (
    "**gate failed:** slow missed contacts",
    "more than --max-missed 0",
    "| bench | 12 | 2 | 0-2 |",  # 12 frames, 2 contacts, of which 0 to 2 are missed over the sampling offsets
)


@needs_bash
@pytest.mark.slow
@pytest.mark.parametrize(
    ("detectors", "code", "texts"),
    [
        pytest.param("slow=discrete[rate_hz=20]", console.EXIT_GATE_FAILED, TEXTS_OF_A_FAILED_GATE, id="misses"),
        pytest.param("hybrid", console.EXIT_OK, (), id="misses nothing"),
    ],
)
def test_regression_fails_the_build_and_sound_detector_passes(folder_of_recordings, detectors, code, texts):
    """Cubes touch in frame 4 and in 8 to 10 at 100 Hz; no contact may be missed. At 20 Hz some are, by ``hybrid`` none.

    The exit code is handed on, the report is written, and the page of the job has the gate's text where it failed.
    """
    actual_code, printed, output = run_audit_step(
        folder_of_recordings, sessions="recordings", detectors=detectors, max_missed="0", out="runs"
    )
    assert (actual_code, output) == (code, f"exit-code={code}\n")
    assert (folder_of_recordings / "runs" / "bench" / "report.html").is_file()
    assert [text for text in TEXTS_OF_A_FAILED_GATE if text in printed] == [*texts]


@needs_bash
def test_action_inputs_are_data_and_errors_stand_on_the_page(folder_of_recordings):
    """The input ``sessions`` has commands of the shell, which do not run: it is the name of files that do not exist.

    The step ends with the code of a usage error, and the page of the job says so. Options stand one a line.
    """
    commands = "$(touch ran)\n; touch ran"
    code, printed, output = run_audit_step(folder_of_recordings, sessions=commands, options="--no-picture\n--seed\n1")
    assert (code, output) == (USAGE_ERROR, f"exit-code={USAGE_ERROR}\n")
    assert "does not exist" in printed
    assert not (folder_of_recordings / "ran").exists()


FOREIGN = 'import pathlib\npathlib.Path("ran").write_text(__name__)\nraise SystemExit("this is not the tool")\n'
"""Text of a module that leaves the file ``ran`` and ends the program, if anything imports it."""


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
    """Modules of the user's checkout have names of those that the tool imports, and its folder is in PYTHONPATH.

    None of them runs, and the audit writes its summary.
    """
    plant_foreign_modules(folder_of_recordings)
    monkeypatch.setenv("PYTHONPATH", str(folder_of_recordings))
    code, printed, _ = run_audit_step(
        folder_of_recordings, sessions="recordings", detectors="sphere", options="--no-picture\n--oracle\nnone"
    )
    assert code == console.EXIT_OK, printed
    assert not (folder_of_recordings / "ran").exists()
    assert (folder_of_recordings / "replay-runs" / "bench" / "summary.json").is_file()


@needs_bash
@pytest.mark.slow
def test_detector_of_the_checkout_loads_from_pythonpath(folder_of_recordings, monkeypatch):
    """A user's own detector is in a folder of PYTHONPATH; modules of the tool's names beside it are not imported."""
    plant_foreign_modules(folder_of_recordings)
    (folder_of_recordings / "src").mkdir()
    (folder_of_recordings / "src" / "my_engine.py").write_text(
        "from cdcore.detectors.sphere import SphereDetector as Mine\n"
    )
    monkeypatch.setenv("PYTHONPATH", "src")
    code, printed, _ = run_audit_step(folder_of_recordings, sessions="recordings", detectors="mine=my_engine:Mine")
    assert code == console.EXIT_OK, printed
    assert not (folder_of_recordings / "ran").exists()


def test_no_step_writes_an_input_into_its_script():
    """Both steps get inputs as variables of the environment: ``${{`` in a script would let them run commands."""
    assert set(STEPS) == {"Install", "Audit"}
    assert not [name for name, step in STEPS.items() if "${{" in step["run"]]


def test_exit_code_table_matches_the_verbs():
    """The first column of the table on the page "in-a-build" has every exit code of the program."""
    codes_of_page = {int(code) for code in re.findall(r"^\| (\d+) \|", page("in-a-build"), re.MULTILINE)}
    codes_of_program = {
        console.EXIT_OK,
        console.EXIT_FAILURE,
        USAGE_ERROR,
        console.EXIT_DATA_LOSS,
        console.EXIT_GATE_FAILED,
        console.EXIT_INTERRUPTED,
    }
    assert codes_of_page == codes_of_program
