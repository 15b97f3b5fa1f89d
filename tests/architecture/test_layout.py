"""The shape of the repository: what lies at the top, how long a file is, and that each module has its own tests."""

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cdcore", "sessions", "replay")
TOP = {"pyproject.toml", "README.md", "LICENSE", "cdcore", "sessions", "replay", "tests"}

LONGEST = 300
"""Lines: beyond that a file is about two things."""


def tracked():
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("this copy is not a git checkout")
    return [Path(line) for line in done.stdout.splitlines() if (ROOT / line).is_file()]


def modules():
    return [path for path in tracked() if path.parts[0] in PACKAGES and path.suffix == ".py"]


def test_the_top_level_holds_exactly_what_the_design_says():
    visible = {path.parts[0] for path in tracked() if not path.parts[0].startswith(".")}
    assert visible == TOP


def test_no_module_is_longer_than_it_should_be():
    long = {str(path): len((ROOT / path).read_text("utf-8").splitlines()) for path in modules()}
    assert {path: lines for path, lines in long.items() if lines > LONGEST} == {}


def test_every_module_has_a_test_file_of_its_own():
    there = set(tracked())
    missing = [
        str(path)
        for path in modules()
        if not path.name.startswith("__") and Path("tests", path.parent, f"test_{path.name}") not in there
    ]
    assert missing == []


def test_tests_are_no_packages():
    assert [str(path) for path in tracked() if path.parts[0] == "tests" and path.name == "__init__.py"] == []


def test_the_wheel_holds_the_three_packages_and_nothing_else():
    import tomllib

    told = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert told == {"packages": list(PACKAGES)}
