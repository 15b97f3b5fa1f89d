"""The shape of the repository: what lies at the top, which rooms there are, where tests lie."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cdcore", "sessions", "replay")
TOP = {"pyproject.toml", "README.md", "LICENSE", "cdcore", "sessions", "replay", "tests"}


def tracked_files():
    """Files that git knows."""
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("this copy is not a git checkout")
    return [Path(line) for line in done.stdout.splitlines() if (ROOT / line).is_file()]


def modules():
    """The Python files of the packages."""
    return [path for path in tracked_files() if path.parts[0] in PACKAGES and path.suffix == ".py"]


def test_the_top_level_holds_exactly_what_the_design_says():
    """Files that git knows are counted, but for hidden ones."""
    visible = {path.parts[0] for path in tracked_files() if not path.parts[0].startswith(".")}
    assert visible == TOP


def test_tests_mirror_the_module_they_are_named_after():
    """A test file with the name of a module lies in a folder below tests that is one of the packages too."""
    by_name = {}
    for path in modules():
        by_name.setdefault(path.stem, set()).add(Path("tests") / path.parent)
    mirrored = [path for path in tracked_files() if path.parts[0] == "tests" and path.parts[1] in PACKAGES]
    astray = [
        str(path)
        for path in mirrored
        if path.match("test_*.py")
        and path.stem[5:] in by_name
        and path.parent not in by_name[path.stem[5:]]
        and not (ROOT / Path(*path.parent.parts[1:])).is_dir()
    ]
    assert astray == []


def test_the_wheel_holds_the_three_packages_and_nothing_else():
    """By pyproject.toml: cdcore, sessions and replay."""
    build = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert build == {"packages": list(PACKAGES)}


def test_readme_of_the_tests_names_every_support_file_once():
    """Names in backticks of tests/README.md beside the files of tests/support."""
    named = re.findall(r"`(\w+\.(?:py|toml))`", (ROOT / "tests" / "README.md").read_text("utf-8"))
    files = [path.name for path in tracked_files() if path.parts[:2] == ("tests", "support")]
    assert sorted(named) == sorted(files)
