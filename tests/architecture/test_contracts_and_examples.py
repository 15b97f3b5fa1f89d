"""Import contracts notice an upward import, and examples in docstrings hold; `.ci/lint` runs the rest."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LINT = "import sys; from importlinter.cli import lint_imports_command; sys.exit(lint_imports_command())"


def run(*command, cwd=ROOT):
    """The finished process of this interpreter with a command, in the repository's folder unless another is given."""
    return subprocess.run([sys.executable, *command], cwd=cwd, capture_output=True, text=True)


UPWARD = {
    "Floors of the tool": ("replay/auditing/compare.py", "import replay.show.report.page"),
    "Floors of the sessions": ("sessions/model/session.py", "import sessions.mcap.reader"),
    "Floors of the narrow phase": ("cdcore/triangles/sums.py", "import cdcore.narrow.tree_stage"),
    "Rerun is imported by the recording alone": ("replay/detection/progress.py", "import rerun"),
    "pyarrow is imported where tables are read and written": ("replay/auditing/compare.py", "import pyarrow"),
    "rich is imported by the command line alone": ("replay/document/summary.py", "import rich"),
    "matplotlib is imported where plots are drawn": ("replay/document/metrics/near.py", "import matplotlib"),
    "jinja2 is imported where pages are filled in": ("replay/show/notebook.py", "import jinja2"),
}
"""Contract of import-linter, by its name in pyproject.toml -> a file and an import there that breaks it."""


@pytest.mark.slow
def test_an_arrow_upward_breaks_its_contract(tmp_path):
    """A copy of the packages gets the import that each contract of UPWARD forbids; import-linter names every one."""
    for package in ("cdcore", "sessions", "replay"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for file, line in UPWARD.values():
        with (tmp_path / file).open("a", encoding="utf-8") as source:
            source.write(f"\n{line}\n")
    ended = run("-c", LINT, "--no-cache", cwd=tmp_path)
    assert ended.returncode == 1
    printed = " ".join(ended.stdout.split())
    for contract in UPWARD:
        assert f"{contract} BROKEN" in printed, contract


@pytest.mark.slow
def test_examples_in_docstrings_hold():
    """Doctests of all modules of the packages with an example; the others are not imported."""
    files = [
        str(path.relative_to(ROOT))
        for package in ("cdcore", "sessions", "replay")
        for path in sorted((ROOT / package).rglob("*.py"))
        if ">>> " in path.read_text("utf-8")
    ]
    assert files
    arguments = ["-q", "--doctest-modules", "-p", "no:cacheprovider", "-o", "addopts=--import-mode=importlib"]
    ended = run("-m", "pytest", *arguments, *files)
    assert ended.returncode == 0, ended.stdout[-5000:] + ended.stderr[-2000:]
