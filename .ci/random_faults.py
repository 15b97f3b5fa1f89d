"""Do the tests notice a small fault?  Draws faults by seed, one a module, and runs the tests that should break.

    python .ci/random_faults.py --faults 60 --seed 0 --out faults.json      # continues where a file of results ends

A fault flips a comparison, puts + for - or - for +, or `and` for `or`. Tests run in a copy of the committed tree, in
this order, and stop at the first that fails: those that import the module, those of its folder, then the quick suite.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

PACKAGES = ("cdcore", "sessions", "replay")
QUICK = ["-q", "-x", "-m", "not slow and not bench", "-p", "no:cacheprovider"]
FLIPPED: dict[type[ast.AST], str] = {
    ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
    ast.Add: "-", ast.Sub: "+", ast.And: "or", ast.Or: "and",
}  # fmt: skip
WRITTEN: dict[type[ast.AST], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.Add: "+", ast.Sub: "-", ast.And: "and", ast.Or: "or",
}  # fmt: skip
LONGEST_S = 900
"""A run of tests that takes longer hangs because of the fault, which is noticed then."""


@dataclass(frozen=True)
class Fault:
    """One operator of one module written wrongly: ``text[begin:end]`` becomes ``wrong``."""

    module: str
    line: int
    begin: int
    end: int
    right: str
    wrong: str


def operators(tree: ast.AST) -> Iterator[tuple[ast.expr, ast.AST, ast.expr]]:
    """Left operand, operator and right operand of everything that can be written wrongly."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in FLIPPED:
            yield node.left, node.ops[0], node.comparators[0]
        elif isinstance(node, ast.BinOp) and type(node.op) in FLIPPED:
            yield node.left, node.op, node.right
        elif isinstance(node, ast.BoolOp):
            yield node.values[0], node.op, node.values[1]


def faults_of(root: Path, file: Path) -> list[Fault]:
    """All faults of a file that its text shows without doubt: the operator stands alone between its operands."""
    source = file.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for left, operator, right in operators(ast.parse(source)):
        begin = starts[(left.end_lineno or 1) - 1] + (left.end_col_offset or 0)
        end = starts[right.lineno - 1] + right.col_offset
        between, word = source[begin:end].decode(), WRITTEN[type(operator)]
        if between.count(word) == 1 and not between.replace(word, "").strip("() \n\t"):
            at = begin + between.index(word)
            name = file.relative_to(root).as_posix()
            found.append(Fault(name, left.end_lineno or 1, at, at + len(word), word, FLIPPED[type(operator)]))
    return found


def drawn(root: Path, count: int, seed: int) -> list[Fault]:
    """So many faults, each in a module of its own while there are modules left."""
    rng = random.Random(seed)
    files = sorted(file for package in PACKAGES for file in (root / package).rglob("*.py"))
    rng.shuffle(files)
    one_each = [rng.choice(faults) for file in files if (faults := faults_of(root, file))]
    return one_each[:count]


def stages(root: Path, fault: Fault) -> list[list[str]]:
    """Which tests are asked, in turn."""
    module = fault.module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, name = module.rpartition(".")
    tests = sorted((root / "tests").rglob("test_*.py"))
    reached = (f"from {module} import", f"import {module}", f'"{module}')
    texts = {test: test.read_text(encoding="utf-8") for test in tests}
    own = [test for test in tests if any(part in texts[test] for part in reached) or test.stem == f"test_{name}"]
    folder = root / "tests" / Path(*package.split("."))
    paths = [[str(test.relative_to(root)) for test in own], [str(folder.relative_to(root))] if folder.is_dir() else []]
    return [*(path for path in paths if path), ["-n", "auto", "--dist", "loadfile", "tests"]]


def noticed_by(root: Path, fault: Fault, environment: dict[str, str]) -> str:
    """The first run of tests that fails: own, folder, suite; or "nothing"."""
    file = root / fault.module
    right = file.read_bytes()
    file.write_bytes(right[: fault.begin] + fault.wrong.encode() + right[fault.end :])
    try:
        asked = stages(root, fault)
        for name, tests in zip(["own", "folder", "suite"][-len(asked) :], asked, strict=True):
            command = [sys.executable, "-m", "pytest", *QUICK, *tests]
            try:
                ended = subprocess.run(command, cwd=root, env=environment, capture_output=True, timeout=LONGEST_S)
            except subprocess.TimeoutExpired:
                return name
            if ended.returncode not in (0, 5):  # 5: no test was chosen
                return name
        return "nothing"
    finally:
        file.write_bytes(right)


def main() -> None:
    """Draw, run, and print each fault with who noticed it."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--faults", type=int, default=200)
    asked.add_argument("--seed", type=int, default=0)
    asked.add_argument("--out", type=Path, default=Path("faults.json"))
    asked.add_argument("--part", default="1/1", help="K/N: only every N-th fault, beginning with the K-th")
    options = asked.parse_args()
    part, parts = map(int, options.part.split("/"))
    done = json.loads(options.out.read_text()) if options.out.exists() else []
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "copy"
        subprocess.run(["git", "clone", "-q", ".", str(root)], check=True)
        environment = {**os.environ, "PYTHONPATH": str(root)}
        for fault in drawn(root, options.faults, options.seed)[part - 1 :: parts]:
            if any(one["module"] == fault.module and one["begin"] == fault.begin for one in done):
                continue
            by = noticed_by(root, fault, environment)
            done.append({**asdict(fault), "noticed_by": by})
            print(f"{by:8} {fault.module}:{fault.line}  {fault.right} -> {fault.wrong}", flush=True)
            options.out.write_text(json.dumps(done, indent=1))
            shutil.rmtree(root / ".hypothesis", ignore_errors=True)
    caught = sum(one["noticed_by"] != "nothing" for one in done)
    print(f"{caught} of {len(done)} noticed")


if __name__ == "__main__":
    main()
