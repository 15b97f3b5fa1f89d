"""``replay bench`` names the machine, prints digests, and exits with 4 when answers differ."""

import json

import pytest

from replay.bench import race
from replay.cli import bench
from replay.cli.main import main


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(bench, "QUICK_FACES", (100,))
    monkeypatch.setattr(bench, "QUICK_GROWTH", {"frames": (90, 180), "bodies": (5,)})


def test_json_and_the_file_hold_the_race_and_the_growth(capsys, tmp_path):
    assert main(["bench", "--quick", "--frames", "60", "--json", "--out", str(tmp_path / "new" / "b.json")]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [(row["engine"], row["wrong"]) for row in told["race"]] == [("python-fcl", 0), ("exact", 0)] * 2
    assert [one["size"] for one in told["growth"]] == [90, 180, 5]
    assert json.loads((tmp_path / "new" / "b.json").read_text()) == told


def test_a_difference_exits_with_4(capsys, monkeypatch):
    class Liar(race.OwnExact):
        def ask(self, what):
            return super().ask(what) + 1

    monkeypatch.setitem(race.ENGINES, "exact", Liar)
    assert main(["bench", "--frames", "20"]) == 4
    assert "gate: exact differs from python-fcl in" in capsys.readouterr().err
