"""The shape of the repository: what lies at the top, which rooms there are, where tests lie."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from support.sampled import SAMPLED

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("cdcore", "sessions", "replay")
TOP = {"pyproject.toml", "README.md", "LICENSE", "cdcore", "sessions", "replay", "tests"}
MOST_LOOSE = 8
"""Modules of `replay` in no room."""


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


def test_few_modules_of_the_tool_lie_in_no_room():
    loose = [path.name for path in modules() if path.parent == Path("replay")]
    assert len(loose) <= MOST_LOOSE, loose


def test_no_module_of_the_tool_bears_the_name_of_a_public_function():
    names = {path.stem if path.name != "__init__.py" else path.parent.name for path in modules() if len(path.parts) < 4}
    direct = {name for name in names if (ROOT / "replay" / name).exists() or (ROOT / "replay" / f"{name}.py").exists()}
    assert not direct & {"plan", "run", "audit", "tradeoff", "stress"}


def test_every_module_is_reached_by_a_test():
    """A module has tests of its own, or a test names it, or a module with tests of its own imports it."""
    tests = [path for path in tracked() if path.parts[0] == "tests" and path.suffix == ".py"]
    own = {path.stem.removeprefix("test_") for path in tests}
    texts = [(ROOT / path).read_text("utf-8") for path in tests]
    texts += [(ROOT / path).read_text("utf-8") for path in modules() if path.stem in own or path.name == "__init__.py"]
    words = set(re.findall(r"[\w.]+", "\n".join(texts)))
    words |= {
        f"{package}.{name}" for text in texts for package, name in re.findall(r"from ([\w.]+) import (\w+)", text)
    }
    unreached = []
    for path in modules():
        name = ".".join(path.with_suffix("").parts)
        if not path.name.startswith("__") and path.stem not in own and name not in words:
            unreached.append(str(path))
    assert unreached == []


def test_tests_lie_where_the_module_lies_that_they_are_named_after():
    by_name = {}
    for path in modules():
        by_name.setdefault(path.stem, set()).add(Path("tests") / path.parent)
    mirrored = [path for path in tracked() if path.parts[0] == "tests" and path.parts[1] in PACKAGES]
    astray = [
        str(path)
        for path in mirrored
        if path.match("test_*.py")
        and path.stem[5:] in by_name
        and path.parent not in by_name[path.stem[5:]]
        and not (ROOT / Path(*path.parent.parts[1:])).is_dir()
    ]
    assert astray == []


def test_every_sampled_test_is_there_once():
    tests = [path for path in tracked() if path.parts[0] == "tests" and path.suffix == ".py"]
    text = "".join((ROOT / path).read_text(encoding="utf-8") for path in tests)
    found = re.findall(r"^def (test_\w+)", text, re.MULTILINE)
    assert [name for name in SAMPLED if found.count(name) != 1] == [], "rename it in support/sampled.py too"


def test_tests_are_no_packages():
    assert [str(path) for path in tracked() if path.parts[0] == "tests" and path.name == "__init__.py"] == []


def test_the_wheel_holds_the_three_packages_and_nothing_else():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert build == {"packages": list(PACKAGES)}
