"""Do the tests notice a small fault?  Draws faults by seed, one a module, and runs the tests that should break.

    python .ci/random_faults.py --faults 60 --seed 0 --out faults.json      # continues where a file of results ends
    python .ci/random_faults.py --part 2/8 --stages own,folder              # quicker: without the quick suite
    python .ci/random_faults.py --under cdcore/search --faults 20           # of one room, asked by tests/cdcore last

A fault flips a comparison, puts + for - or - for +, or `and` for `or`. Tests run in a copy of the committed tree, in
this order, and stop at the first that fails: those that name the module (its own file first), those of its folder,
then the quick suite. Faults that change nothing anyone can see are listed and judged in ``HARMLESS``.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from replay.auditing.wilson import wilson_interval

PACKAGES = ("cdcore", "sessions", "replay")
QUICK = ["-q", "-x", "-m", "not slow and not bench", "-p", "no:cacheprovider"]
OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
"""Class of an operator -> how it is written, and what a fault writes in its place."""
LONGEST_S = 900
"""A run of tests that takes longer hangs because of the fault, which is noticed then."""
MOST_OWN = 12
"""Test files; more of them name modules that everything imports, and the folder's tests and the suite ask those."""
STAGES = ("own", "folder", "suite")
HARMLESS = Path("tests/architecture/harmless_faults.txt")
"""A line each: module, the line of source, the operator, and why its fault harms nobody; `` | `` between them."""


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
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in OPERATORS:
            yield node.left, node.ops[0], node.comparators[0]
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            yield node.left, node.op, node.right
        elif isinstance(node, ast.BoolOp):
            yield node.values[0], node.op, node.values[1]


def faults_of(root: Path, file: Path) -> list[Fault]:
    """All faults of a file that its text shows without doubt: the operator stands alone between its operands."""
    source = file.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    result = []
    for left, operator, right in operators(ast.parse(source)):
        begin = starts[(left.end_lineno or 1) - 1] + (left.end_col_offset or 0)
        end = starts[right.lineno - 1] + right.col_offset
        between = source[begin:end].decode()
        right_word, wrong_word = OPERATORS[type(operator)]
        if between.count(right_word) == 1 and not between.replace(right_word, "").strip("() \n\t"):
            at = begin + between.index(right_word)
            name = file.relative_to(root).as_posix()
            result.append(Fault(name, left.end_lineno or 1, at, at + len(right_word), right_word, wrong_word))
    return result


def drawn(root: Path, count: int, seed: int, under: str = "") -> list[Fault]:
    """So many faults below a folder, each in a module of its own.

    Every module is drawn by its own name: a change in one changes nothing about the others.
    """
    files = [file for package in PACKAGES for file in (root / package).rglob("*.py")]
    files = [file for file in files if file.relative_to(root).as_posix().startswith(under)]
    result = []
    for file in files:
        rng = random.Random(f"{seed} {file.relative_to(root).as_posix()}")
        if faults := faults_of(root, file):
            result.append((rng.random(), rng.choice(faults)))
    return [fault for _, fault in sorted(result, key=lambda item: item[0])][:count]


def judged_harmless(root: Path, fault: Fault) -> bool:
    """Whether the list of harmless faults has this one."""
    line = (root / fault.module).read_text(encoding="utf-8").splitlines()[fault.line - 1].strip()
    listed = (root / HARMLESS).read_text(encoding="utf-8").splitlines() if (root / HARMLESS).exists() else []
    return any(row.startswith(f"{fault.module} | {line} | {fault.right} | ") for row in listed)


def own_tests(root: Path, fault: Fault) -> list[str]:
    """Test files that name the module: its own first, then those nearest to it, at most ``MOST_OWN``."""
    module = fault.module.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, name = module.rpartition(".")
    named = re.compile(rf"\b{re.escape(module)}\b|from {re.escape(package)} import [^\n]*\b{name}\b")
    folder = root / "tests" / Path(*package.split("."))
    own = [
        (test.stem != f"test_{name}", test.parent != folder, str(test.relative_to(root)))
        for test in (root / "tests").rglob("test_*.py")
        if test.stem == f"test_{name}" or named.search(test.read_text(encoding="utf-8"))
    ]
    return [test for *_, test in sorted(own)[:MOST_OWN]]


def stages(root: Path, fault: Fault, suite: str = "tests") -> dict[str, list[str]]:
    """Which tests are asked, in turn; the last are those of the suite."""
    folder = root / "tests" / Path(fault.module).parent
    requested = {"own": own_tests(root, fault), "folder": [str(folder.relative_to(root))] if folder.is_dir() else []}
    return {**{name: tests for name, tests in requested.items() if tests}, "suite": ["-n", "auto", suite]}


def noticed_by(
    root: Path, fault: Fault, environment: dict[str, str], chosen: tuple[str, ...] = STAGES, suite: str = "tests"
) -> str:
    """The first run of tests that fails: own, folder, suite; or "nothing"; or "harmless"."""
    if judged_harmless(root, fault):
        return "harmless"
    file = root / fault.module
    right, stamp = file.read_bytes(), file.stat().st_mtime_ns
    file.write_bytes(right[: fault.begin] + fault.wrong.encode() + right[fault.end :])
    kernels = Path(environment["NUMBA_CACHE_DIR"])
    # Machine code of a faulty source removes that of earlier sources, which the next fault can load.
    spoiled = kernels.with_name("spoiled")
    if fault.module.startswith("cdcore/"):
        environment = {**environment, "NUMBA_CACHE_DIR": str(spoiled)}
        if b"kernel" not in right:
            shutil.copytree(kernels, spoiled)
    try:
        for name, tests in stages(root, fault, suite).items():
            if name not in chosen:
                continue
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
        os.utime(file, ns=(stamp, stamp))  # compiled code of what is right stays valid
        shutil.rmtree(spoiled, ignore_errors=True)


def summary(noticed_by: list[str]) -> str:
    """How many faults were noticed, with Wilson's interval of 95 %; harmless ones are left out."""
    harmless = noticed_by.count("harmless")
    harmful = len(noticed_by) - harmless
    noticed = harmful - noticed_by.count("nothing")
    if not harmful:
        return f"no fault was tried; {harmless} harmless left out"
    lower, upper = wilson_interval(noticed, harmful)
    interval = f"{noticed / harmful:.1%}, 95 % interval {lower:.1%} to {upper:.1%}"
    return f"{noticed} of {harmful} noticed ({interval}); {harmless} harmless left out"


def main() -> None:
    """Draw, run, and print each fault with who noticed it."""
    requested = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    requested.add_argument("--faults", type=int, default=200)
    requested.add_argument("--seed", type=int, default=0)
    requested.add_argument("--out", type=Path, default=Path("faults.json"))
    requested.add_argument("--part", default="1/1", help="K/N: only every N-th fault, beginning with the K-th")
    requested.add_argument("--stages", default=",".join(STAGES), help="which of own,folder,suite are asked")
    requested.add_argument(
        "--under", default="", help="only modules below this folder, asked by the tests of its package"
    )
    options = requested.parse_args()
    suite = "tests/" + options.under.split("/")[0] if options.under else "tests"
    piece, pieces = map(int, options.part.split("/"))
    chosen = tuple(options.stages.split(","))
    done = json.loads(options.out.read_text()) if options.out.exists() else []
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "copy"
        subprocess.run(["git", "clone", "-q", ".", str(root)], check=True)
        if (beside := Path.cwd().parent / "shared").is_dir():
            (Path(folder) / "shared").symlink_to(beside)  # the recordings that some tests ask
        (kernels := Path(folder) / "kernels").mkdir()
        environment = {**os.environ, "PYTHONPATH": str(root), "NUMBA_CACHE_DIR": str(kernels)}
        environment["PYTHONPYCACHEPREFIX"] = str(Path(folder) / "bytecode")
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for fault in drawn(root, options.faults, options.seed, options.under)[piece - 1 :: pieces]:
            if any(item["module"] == fault.module and item["begin"] == fault.begin for item in done):
                continue
            by = noticed_by(root, fault, environment, chosen, suite)
            done.append({**asdict(fault), "noticed_by": by})
            print(f"{by:8} {fault.module}:{fault.line}  {fault.right} -> {fault.wrong}", flush=True)
            options.out.write_text(json.dumps(done, indent=1))
            shutil.rmtree(root / ".hypothesis", ignore_errors=True)
    print(summary([item["noticed_by"] for item in done]))


if __name__ == "__main__":
    main()
