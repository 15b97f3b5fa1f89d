import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from support.small_worlds import cubes

from replay.cli.main import main
from sessions import write_session


@pytest.fixture
def files(tmp_path):
    for k in range(3):
        session = cubes({"a": [0.0] * 20, "b": list(np.linspace(3, 0.8 + 0.1 * k, 20))})
        session = type(session)(session.source, session.meshes, facts={"pseudonym": f"S{k}"})
        write_session(session, tmp_path / f"s{k}.mcap")
    return [str(tmp_path / f"s{k}.mcap") for k in range(3)]


def test_sessions_are_run_collected_and_run_again_for_nothing(files, tmp_path, capsys):
    out = str(tmp_path / "runs")
    assert main(["run", "--no-picture", *files, "--out", out, "--detectors", "hybrid", "--format", "json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["done"] == ["s0", "s1", "s2"] and first["kept"] == []
    assert main(["run", "--no-picture", *files, "--out", out, "--detectors", "hybrid"]) == 0
    printed, said = capsys.readouterr()
    assert f"digest: {first['digest']}" in printed and said.count("kept") == 3
    assert main(["study", "collect", out, "--out", str(tmp_path / "m.parquet")]) == 0
    assert set(pq.read_table(tmp_path / "m.parquet")["student"].to_pylist()) == {"S0", "S1", "S2"}
    assert "6 rows of 3 students" in capsys.readouterr().err


def test_a_broken_session_is_listed_with_exit_code_three_and_the_rest_of_the_time_is_told(files, tmp_path, capsys):
    (tmp_path / "s1.mcap").write_bytes(b"no session")
    assert main(["run", "--no-picture", *files, "--out", str(tmp_path / "runs"), "--detectors", "hybrid"]) == 3
    printed, said = capsys.readouterr()
    assert "2 of 3 sessions" in printed and "failed: s1:" in printed and "digest: none" in printed
    assert "1 of 3  s0: done, about" in said and "s left" in said


@pytest.mark.slow
def test_a_small_class_goes_the_whole_way_to_its_page(tmp_path, capsys):
    assert main(["study", "demo", "--out", str(tmp_path / "class"), "--students", "5"]) == 0
    printed, said = capsys.readouterr()
    assert "questionnaire" in printed and "few-students" in printed
    assert (tmp_path / "class" / "study" / "study.html").is_file() and "5 of 5  S05: done" in said
