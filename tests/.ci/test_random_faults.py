"""Faults are drawn by seed and planted alone, and the tests that should notice one are asked first."""

from pathlib import Path

import pytest
from support import processes

SOURCE = "def twice(a, b):\n    return a + b if a <= b and b else len('a < b') - 2\n"
"""A source file with four operators in its second line, and one within quotes."""
TEST = "from cdcore.small import twice\n\n\ndef test_it():\n    assert twice(1, 2) == 3 and twice(2, 1) == 3\n"


@pytest.fixture(scope="module")
def random_faults():
    """The script as a module."""
    return processes.script("random_faults")


@pytest.fixture
def small_tree(tmp_path):
    """A folder with two sources, one of which is SOURCE, and tests of that one."""
    files = {"cdcore/small.py": SOURCE, "tests/cdcore/test_small.py": TEST, "sessions/other.py": "A = 1 + 1\n"}
    files |= {f"tests/test_{n}.py": TEST for n in range(20)}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "kernels").mkdir()
    return tmp_path


@pytest.fixture
def fault_of_operator(random_faults, small_tree):
    """Returns the fault that exchanges an operator of SOURCE."""
    faults = random_faults.faults_of(small_tree, small_tree / "cdcore/small.py")
    return {fault.right: fault for fault in faults}.__getitem__


def test_every_operator_outside_quotes_can_become_a_fault(random_faults, small_tree):
    """A source file has +, <=, and, - in its second line, and < in quotes; a fault exchanges one operator.

    Its first and last byte and its line say where.
    """
    faults = random_faults.faults_of(small_tree, small_tree / "cdcore/small.py")
    assert len(faults) == 4
    assert {fault.right: fault.wrong for fault in faults} == {"+": "-", "<=": ">", "and": "or", "-": "+"}
    for fault in faults:
        assert SOURCE[fault.begin : fault.end] == fault.right
        assert fault.line == 2


PASSED, FAILED, NO_TESTS = 0, 1, 5
"""Exit codes of pytest."""


@pytest.mark.parametrize(
    ("status", "noticed_by", "runs"),
    [
        pytest.param(FAILED, "own", 1, id="own tests fail"),
        pytest.param(PASSED, "nothing", 2, id="all pass"),
        pytest.param(NO_TESTS, "nothing", 2, id="no tests"),
    ],
)
def test_fault_exists_only_while_tests_run(
    random_faults, small_tree, fault_of_operator, monkeypatch, status, noticed_by, runs
):
    """A plus becomes a minus; the tests of the file ("own"), then those of its folder, end with ``status``.

    They see the file with the fault; those of the folder run only where its own did not fail. Afterwards the file has
    its text and its time again.
    """
    source_file = small_tree / "cdcore/small.py"
    texts_while_tests_run = []

    def run_tests(command, **_):
        texts_while_tests_run.append(source_file.read_text())
        return random_faults.subprocess.CompletedProcess(command, status)

    monkeypatch.setattr(random_faults.subprocess, "run", run_tests)
    stamp = source_file.stat().st_mtime_ns
    environment = {"NUMBA_CACHE_DIR": str(small_tree / "kernels")}
    actual = random_faults.noticed_by(small_tree, fault_of_operator("+"), environment, ("own", "folder"))
    assert actual == noticed_by
    assert texts_while_tests_run == [SOURCE.replace("a + b", "a - b")] * runs
    assert source_file.read_text() == SOURCE
    assert source_file.stat().st_mtime_ns == stamp


def test_fault_listed_as_harmless_is_not_tested(random_faults, small_tree, fault_of_operator):
    """A file lists faults that change nothing, by source file, line, operator and reason; that of "and" is listed."""
    second_line = SOURCE.splitlines()[1].strip()
    (small_tree / random_faults.HARMLESS).parent.mkdir(parents=True)
    (small_tree / random_faults.HARMLESS).write_text(f"cdcore/small.py | {second_line} | and | b is never 0\n")
    assert random_faults.noticed_by(small_tree, fault_of_operator("and"), {}) == "harmless"


def test_every_listed_harmless_fault_can_still_be_drawn(random_faults):
    """A line whose source was renamed or left would excuse nothing, and somebody else would judge the fault again.

    Lines are "file | source line | operator | reason"; the first three must be those of a fault of today's sources.
    """
    listed = (random_faults.HARMLESS).read_text("utf-8").splitlines()
    assert listed
    drawable = set()
    for module in {row.partition(" | ")[0] for row in listed}:
        lines = Path(module).read_text("utf-8").splitlines()
        for fault in random_faults.faults_of(Path(), Path(module)):
            drawable.add(f"{module} | {lines[fault.line - 1].strip()} | {fault.right} | ")
    assert [row for row in listed if not row.startswith(tuple(drawable))] == []


def test_summary_has_wilsons_interval(random_faults):
    """48 of 50 faults are noticed, 96 %; Wilson's interval is (48 + 1.92 +- 1.96 * 1.70) / 53.84, 86.5 to 98.9 %.

    By z = 1.96: 1.92 is z^2 / 2, 53.84 is 50 + z^2, and 1.70 the root of 48 * 2 / 50 + z^2 / 4. Harmless faults are no
    part of the 50, and of none there is no percentage.
    """
    noticed_by = ["own"] * 30 + ["folder"] * 17 + ["suite"] + ["nothing"] * 2 + ["harmless"] * 3
    expected = "48 of 50 noticed (96.0%, 95 % interval 86.5% to 98.9%); 3 harmless left out"
    assert random_faults.summary(noticed_by) == expected
    assert random_faults.summary(["harmless"]) == "no fault was tried; 1 harmless left out"
