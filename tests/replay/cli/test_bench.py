"""``replay bench`` names the machine, prints digests, and exits with 4 when an answer of ours differs."""

import json

import pytest
from rich.console import Console

from replay.cli import bench
from replay.cli.bench import bench_tables
from replay.cli.main import main
from replay.studies.bench import engines, race
from replay.studies.bench.race import Row
from replay.studies.bench.stages import STAGES, Growth, Stages


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(bench, "QUICK_FACES", (100,))
    monkeypatch.setattr(bench, "QUICK_GROWTH", {"frames": (90, 180)})
    monkeypatch.setattr(bench, "RESTING_FACES", 100)
    monkeypatch.setattr(bench, "RESTING_FRAMES", 5)


@pytest.mark.slow
def test_json_and_the_file_hold_the_race_the_stages_and_the_growth(capsys, tmp_path):
    words = ["bench", "--quick", "--frames", "60", "--format", "json", "--cite", "--out"]
    assert main([*words, str(tmp_path / "new" / "b.json")]) == 0
    report = json.loads(capsys.readouterr().out)
    raced = [(row["what"], row["engine"]) for row in report["race"]]
    assert raced == [(what, name) for what in ("bool", "faces") for name in engines.installed_engines()]
    assert all(row["wrong"] == 0 for row in report["race"] if row["engine"] == "exact")
    assert [(one["workload"], one["what"]) for one in report["stages"]] == [
        ("bench", "bool"), ("bench", "faces"), ("resting", "faces"),
    ]  # fmt: skip
    assert [(one["where"], one["size"]) for one in report["growth"]] == [
        (where, size) for where in ("distant", "near") for size in (90, 180)
    ]
    assert [*report.pop("sources")] == ["detector exact"]
    assert json.loads((tmp_path / "new" / "b.json").read_text()) == report


@pytest.mark.slow
def test_a_difference_exits_with_4_and_one_of_a_peer_does_not(capsys, monkeypatch):
    class Liar(engines.OwnExact):
        def ask(self, what):
            return super().ask(what) + 1

    monkeypatch.setattr(race, "installed_engines", lambda: ["python-fcl", "trimesh", "exact"])
    monkeypatch.setitem(engines.ENGINES, "trimesh", Liar)
    assert main(["bench", "--frames", "20"]) == 0
    assert "gate" not in capsys.readouterr().err
    monkeypatch.setitem(engines.ENGINES, "exact", Liar)
    assert main(["bench", "--frames", "20"]) == 4
    assert "gate: exact differs from python-fcl in" in capsys.readouterr().err


@pytest.mark.slow
def test_one_sentence_names_the_extra_when_coal_is_absent(capsys, monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    assert main(["bench", "--frames", "20"]) == 0
    shown = capsys.readouterr()
    assert 'not in the race: coal; pip install -e ".[peers]"' in shown.err
    assert "trimesh" in shown.out and "coal" not in shown.out


def sized(where, size, seconds, tests):
    work = {"skipped": 900, "span_tests": tests}
    return Growth(where, "frames", size, 1_000, seconds, work, {"check": seconds / 2, "search": seconds / 4})


@pytest.fixture
def printed():
    rows = [Row("exact", "bool", 5_000, 0.3, 0.1, 23.4, 77, "00c0ffee", 0)]
    spent = [Stages("bench", "bool", 5_000, {name: 0.002 for name in STAGES if name != "faces"})]
    growth = [sized("distant", 5_400, 0.1, 45), sized("distant", 54_000, 0.7, 60), sized("near", 5_400, 0.3, 1_000)]
    figures = {"seed": 8, "frames": 60, "machine": {"system": "Linux", "processor": "Z80", "cores": 2}}
    console = Console(width=140, record=True)
    console.print(bench_tables(rows, spent, growth, figures | {"versions": {"python": "3.11"}}))
    return console.export_text()


def test_machine_ratio_digest_and_stages_are_shown(printed):
    assert "exact asks containment too, in every race; no peer does" in " ".join(printed.split())
    for words in ("seed 8", "Z80, 2 cores", "23.40", "00c0ffee", "in trees", "12.00", "90.0%"):
        assert words in printed


def test_a_growth_row_is_compared_with_the_row_above_it_of_the_same_session_only(printed):
    rows = {tuple(line.split()[:3]): line.split() for line in printed.splitlines() if " frames " in line}
    assert rows["distant", "frames", "54,000"][4:] == [
        "0.7000",
        "7.0",
        "0.3500",
        "0.17500",
        "7.0",
        "60",
        "1.3",
        "90.0%",
    ]
    assert len(rows["distant", "frames", "5,400"]) == len(rows["near", "frames", "5,400"]) == 9
