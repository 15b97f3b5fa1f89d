import json
from dataclasses import replace
from pathlib import Path

import pytest
from support.small_worlds import cubes, framed

from replay.cli.console import People
from replay.cli.main import main
from replay.cli.run_report import lost_frames, report_run, run_json, where_to_look
from replay.pipeline.engine import compute
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    write_session(cubes(PLACES), path)
    return path


def test_run_writes_the_folder_prints_tables_and_says_how_to_look(file, tmp_path, capsys):
    out = tmp_path / "run"
    assert (
        main(["run", str(file), "--out", str(out), "--detectors", "slow=discrete[rate_hz=20]", "--oracle", "hybrid"])
        == 0
    )
    printed, said = capsys.readouterr()
    assert "1 of 2 contacts missed by slow" in printed
    assert f"replay view {out}" in said and "replay view" not in printed
    assert (out / "run.rrd").is_file() and (out / "summary.json").is_file()


def test_json_on_stdout_is_the_summary_and_the_misses(file, tmp_path, capsys):
    arguments = [
        "--format", "json", "--detector", "slow=discrete[rate_hz=20]", "--detector", "sphere", "--oracle", "hybrid",
    ]  # fmt: skip
    assert main(["run", str(file), "-o", str(tmp_path / "run"), "--no-picture", *arguments]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["detectors"]) == {"slow", "sphere", "hybrid"}
    assert [miss["number"] for miss in told["misses"]["slow"]] == [1, 2]
    assert told["out"] == str(tmp_path / "run") and not (tmp_path / "run" / "run.rrd").exists()


def test_start_and_end_and_seed_reach_the_run(file, tmp_path, capsys):
    where = [
        "run", str(file), "--out", str(tmp_path / "run"), "--no-picture", "--format", "json", "--detectors", "hybrid",
    ]  # fmt: skip
    assert main([*where, "--start", "0.02", "--end", "0.05", "--seed", "9", "--oracle", "none"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["session"]["frames"], told["seed"], told["detectors"]["hybrid"]["contacts"]) == (4, 9, 1)


def test_quiet_says_nothing_on_stderr(file, tmp_path, capsys):
    assert main(["run", str(file), "--out", str(tmp_path / "run"), "--no-picture", "-q", "--detectors", "hybrid"]) == 0
    assert capsys.readouterr().err == ""


def test_frames_that_could_not_be_used_end_in_3_and_are_named(tmp_path, capsys):
    session = framed([0, 10, 10, 20], [[1, 1]] * 4)
    write_session(session, tmp_path / "s.mcap")
    code = main(
        ["run", str(tmp_path / "s.mcap"), "--out", str(tmp_path / "run"), "--no-picture", "--detectors", "hybrid"]
    )
    assert code == 3
    assert "note: 1 frame left out: the stamp repeats the one before" in capsys.readouterr().err


def test_a_folder_in_the_way_is_refused_and_force_replaces_it(file, tmp_path, capsys):
    where = ["run", str(file), "--out", str(tmp_path / "run"), "--no-picture", "--detectors", "hybrid"]
    assert main(where) == 0
    capsys.readouterr()
    assert main(where) == 1
    assert "replace it with --force" in capsys.readouterr().err
    assert main([*where, "--force"]) == 0


def test_cite_prints_the_sources_of_the_detectors_that_looked(file, tmp_path, capsys):
    plain = ["run", str(file), "--no-picture", "--detectors", "sphere", "--oracle", "hybrid"]
    assert main([*plain, "-o", str(tmp_path / "one"), "--cite"]) == 0
    printed = capsys.readouterr().out
    assert "detector sphere" in printed and "equation (21)" in printed and "FCL" in printed
    assert main([*plain, "-o", str(tmp_path / "two"), "--cite", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told["sources"]) == {"detector sphere", "detector hybrid"}
    assert main([*plain, "-o", str(tmp_path / "three")]) == 0
    assert "equation (21)" not in capsys.readouterr().out


def test_a_run_without_loss_ends_in_0_and_one_with_loss_in_3(capsys):
    whole = compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="hybrid", oracle="none")
    torn = compute(framed([0, 10, 5], [[1, 1]] * 3), detectors="hybrid", oracle="none")
    assert report_run(whole, People()) == 0
    assert report_run(torn, People(), as_json=True) == 3
    assert lost_frames(whole.summary) == 0 and lost_frames(torn.summary) == 1


def test_bodies_without_a_mesh_are_named(capsys):
    import dataclasses

    session = cubes({"a": [0, 0], "b": [3, 0.9], "wand": [5, 6]})
    meshes = {name: mesh for name, mesh in session.meshes.items() if name != "wand"}
    result = compute(dataclasses.replace(session, meshes=meshes), detectors="hybrid", oracle="none")
    report_run(result, People())
    assert "note: no mesh, so not looked at: wand" in capsys.readouterr().err


def test_verbose_says_settings_and_digest_of_every_detector(capsys):
    result = compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="slow=discrete[rate_hz=20]", oracle="none")
    report_run(result, People(verbose=True))
    said = capsys.readouterr().err
    assert "slow: discrete[rate_hz=20, " in said and result.detections["slow"].digest in said


def test_json_says_where_the_run_lies():
    import dataclasses

    result = compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="hybrid", oracle="none")
    assert run_json(result)["out"] is None
    told = run_json(dataclasses.replace(result, out=Path("run")))
    assert told["out"] == "run" and json.loads(json.dumps(told)) == told


def test_where_to_look_names_the_page_the_picture_and_the_deepest_miss(tmp_path):
    places = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
    result = compute(cubes(places), detectors="slow=discrete[rate_hz=20]")
    (nothing,) = where_to_look(result)
    assert "nothing was written; with --out DIR" in nothing
    written = replace(result, out=tmp_path)
    deepest = max(result.misses["slow"], key=lambda miss: miss.cut_length)
    assert where_to_look(written)[-1] == f"or at the deepest miss: replay view {tmp_path} --miss {deepest.number}"
    assert where_to_look(written)[0].endswith(str(tmp_path / "report.html"))
    assert len(where_to_look(written, picture=False)) == 1, "without a picture there is nothing to view"
