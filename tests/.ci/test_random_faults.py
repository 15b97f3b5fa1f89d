"""Faults are drawn by seed and planted alone, and the tests that should notice one are asked first."""

from pathlib import Path

import pytest
from support import processes

SOURCE = "def twice(a, b):\n    return a + b if a <= b and b else len('a < b') - 2\n"
TEST = "from cdcore.small import twice\n\n\ndef test_it():\n    assert twice(1, 2) == 3 and twice(2, 1) == 3\n"


@pytest.fixture(scope="module")
def random_faults():
    """The script as a module."""
    return processes.script("random_faults")


@pytest.fixture
def small_tree(tmp_path):
    """A folder with two sources and tests of one of them."""
    files = {"cdcore/small.py": SOURCE, "tests/cdcore/test_small.py": TEST, "sessions/other.py": "A = 1 + 1\n"}
    files |= {f"tests/test_{n}.py": TEST for n in range(20)}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "kernels").mkdir()
    return tmp_path


def test_every_operator_outside_quotes_can_become_a_fault(random_faults, small_tree):
    """A fault exchanges one operator of a source file; its bytes and line say where."""
    source = "def twice(a, b):\n    return a + b if a <= b and b else len('a < b') - 2\n"
    source_file = small_tree / "cdcore/small.py"
    source_file.write_text(source)
    faults = random_faults.faults_of(small_tree, source_file)
    replacements = {fault.right: fault.wrong for fault in faults}
    assert len(faults) == 4
    assert replacements == {"+": "-", "<=": ">", "and": "or", "-": "+"}
    assert all(source[fault.begin : fault.end] == fault.right and fault.line == 2 for fault in faults)


@pytest.mark.parametrize(("status", "by"), [(1, "own"), (0, "nothing"), (5, "nothing")])
def test_fault_exists_only_while_tests_run(random_faults, small_tree, monkeypatch, status, by):
    fault = next(
        item for item in random_faults.faults_of(small_tree, small_tree / "cdcore/small.py") if item.right == "+"
    )
    recorded = []

    def run(command, **_):
        recorded.append((small_tree / "cdcore/small.py").read_text())
        return random_faults.subprocess.CompletedProcess(command, status)

    monkeypatch.setattr(random_faults.subprocess, "run", run)
    stamp = (small_tree / "cdcore/small.py").stat().st_mtime_ns
    assert (
        random_faults.noticed_by(small_tree, fault, {"NUMBA_CACHE_DIR": str(small_tree / "kernels")}, ("own", "folder"))
        == by
    )
    assert set(recorded) == {SOURCE.replace("a + b", "a - b")} and len(recorded) == (1 if status == 1 else 2)
    assert (small_tree / "cdcore/small.py").read_text() == SOURCE
    assert (small_tree / "cdcore/small.py").stat().st_mtime_ns == stamp


def test_fault_listed_as_harmless_is_not_tested(random_faults, small_tree):
    """A line of the list names file, source line, operator and reason."""
    fault = next(
        item for item in random_faults.faults_of(small_tree, small_tree / "cdcore/small.py") if item.right == "and"
    )
    (small_tree / random_faults.HARMLESS).parent.mkdir(parents=True)
    (small_tree / random_faults.HARMLESS).write_text(
        f"cdcore/small.py | {SOURCE.splitlines()[1].strip()} | and | b is never 0\n"
    )
    assert random_faults.noticed_by(small_tree, fault, {}) == "harmless"


def test_every_listed_harmless_fault_can_still_be_drawn(random_faults):
    """A line whose source was renamed or left would excuse nothing, and somebody else would judge the fault again."""
    listed = (random_faults.HARMLESS).read_text("utf-8").splitlines()
    by_module = {
        row.partition(" | ")[0]: random_faults.faults_of(Path(), Path(row.partition(" | ")[0])) for row in listed
    }
    drawable = set()
    for module, faults in by_module.items():
        lines = Path(module).read_text("utf-8").splitlines()
        drawable |= {f"{module} | {lines[fault.line - 1].strip()} | {fault.right} | " for fault in faults}
    assert [row for row in listed if not row.startswith(tuple(drawable))] == []


def test_summary_has_wilsons_interval(random_faults):
    noticed_by = ["own"] * 30 + ["folder"] * 17 + ["suite"] + ["nothing"] * 2 + ["harmless"] * 3
    # 48 of 50, from the closed form with z = 1.96.
    expected = "48 of 50 noticed (96.0%, 95 % interval 86.5% to 98.9%); 3 harmless left out"
    assert random_faults.summary(noticed_by) == expected
    assert random_faults.summary(["harmless"]) == "no fault was tried; 1 harmless left out"
