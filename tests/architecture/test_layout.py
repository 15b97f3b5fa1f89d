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
    """Files and folders that git knows, but for hidden ones, are those of TOP."""
    visible = {path.parts[0] for path in tracked_files() if not path.parts[0].startswith(".")}
    assert visible == TOP


def test_tests_mirror_the_module_they_are_named_after():
    """test_NAME.py of a module NAME.py lies in the same folder below ``tests`` as the module at the top.

    Else its folder is that of another part of a package, about which it is.
    """
    folders_of_module = {}
    for path in modules():
        folders_of_module.setdefault(path.stem, set()).add(Path("tests") / path.parent)
    tests = [
        path
        for path in tracked_files()
        if path.parts[0] == "tests" and path.parts[1] in PACKAGES and path.match("test_*.py")
    ]
    assert tests
    astray = []
    for path in tests:
        folders = folders_of_module.get(path.stem.removeprefix("test_"))
        is_in_a_folder_of_a_package = (ROOT / Path(*path.parent.parts[1:])).is_dir()
        if folders and path.parent not in folders and not is_in_a_folder_of_a_package:
            astray.append(str(path))
    assert astray == []


def test_the_wheel_holds_the_three_packages_and_nothing_else():
    """pyproject.toml names cdcore, sessions and replay for the wheel."""
    build = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert build == {"packages": ["cdcore", "sessions", "replay"]}


def test_readme_of_the_tests_names_every_support_file_once():
    """Names of Python and TOML files in backticks of tests/README.md are the files of tests/support."""
    named = re.findall(r"`(\w+\.(?:py|toml))`", (ROOT / "tests" / "README.md").read_text("utf-8"))
    files = [path.name for path in tracked_files() if path.parts[:2] == ("tests", "support")]
    assert sorted(named) == sorted(files)
