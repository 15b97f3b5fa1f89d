"""How large the project is: files, lines, and how long files and functions are.  python .ci/count_lines.py [FOLDER]"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

PACKAGES = ("cdcore", "sessions", "replay")
LOOSE = {"__init__.py", "__main__.py", "errors.py"}
"""Modules that lie in a package and in no room because everything needs them."""


def python_files(root: Path, *folders: str) -> list[Path]:
    """All Python files that git tracks below the folders."""
    listed = subprocess.run(["git", "-C", str(root), "ls-files", *folders], capture_output=True, text=True, check=True)
    return [root / name for name in listed.stdout.splitlines() if name.endswith(".py") and (root / name).exists()]


def lines_of(file: Path) -> int:
    """Lines of a file as ``wc -l`` counts them."""
    return file.read_bytes().count(b"\n")


def function_lengths(file: Path) -> list[int]:
    """Lines of every function and method, its docstring included."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    return [(node.end_lineno or node.lineno) - node.lineno + 1 for node in functions]


def at_share(values: list[int], share: float) -> int:
    """The value below which this share of all lies."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def row(root: Path, name: str, files: list[Path]) -> str:
    """A line of the table."""
    lengths = [lines_of(file) for file in files]
    functions = [length for file in files for length in function_lengths(file)]
    depth = max(len(file.relative_to(root).parts) for file in files)
    left = f"{name:<10}{len(files):>6}{sum(lengths):>8}"
    of_files = f"{at_share(lengths, 0.5):>8}{at_share(lengths, 0.9):>6}{max(lengths):>6}"
    of_functions = f"{at_share(functions, 0.5):>11}{at_share(functions, 0.9):>6}{max(functions):>6}"
    return f"{left}{of_files}{of_functions}{depth:>7}"


def main(root: Path) -> None:
    """Print the table, the loose modules of ``replay`` and the size of the README."""
    print(
        f"{'':<10}{'files':>6}{'lines':>8}{'median':>8}{'p90':>6}{'max':>6}{'function':>11}{'p90':>6}{'max':>6}{'depth':>7}"
    )
    for package in PACKAGES:
        print(row(root, package, python_files(root, package)))
    print(row(root, "source", python_files(root, *PACKAGES)))
    print(row(root, "tests", python_files(root, "tests")))
    loose = [file.name for file in python_files(root, "replay") if file.parent == root / "replay"]
    print(f"modules of replay in no room: {len(loose)}, {len(set(loose) - LOOSE)} of them not needed by everything")
    readme = (root / "README.md").read_text(encoding="utf-8")
    print(f"README: {len(readme.split())} words, {len(readme.encode())} bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
