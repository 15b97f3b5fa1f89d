import json
from dataclasses import replace

from support.small_worlds import cubes, jumping

from replay.cli.console import People
from replay.cli.run_report import report_run, run_json, where_to_look
from replay.pipeline.engine import compute


def test_bodies_without_a_mesh_are_named(capsys):
    import dataclasses

    session = cubes({"a": [0, 0], "b": [3, 0.9], "wand": [5, 6]})
    meshes = {name: mesh for name, mesh in session.meshes.items() if name != "wand"}
    result = compute(dataclasses.replace(session, meshes=meshes), detectors="hybrid", oracle="none")
    report_run(result, People())
    assert "note: no mesh, so not looked at: wand" in capsys.readouterr().err


def test_json_lists_misses_with_the_columns_of_their_table():
    session = cubes({"a": [0.0] * 8, "b": [1.05] * 3 + [0.95] + [1.05] * 4})
    result = compute(session, detectors="slow=discrete[rate_hz=20]", oracle="continuous")
    told = json.loads(json.dumps(run_json(result)))
    (miss,) = told["misses"]["slow"]
    assert (miss["body_a"], miss["body_b"], miss["number"], miss["detector"]) == ("a", "b", 1, "slow")
    assert miss["face_pairs"] == len(result.misses["slow"][0].faces) > 0 and told["false"] == {"slow": []}


def test_a_miss_that_no_frame_shows_is_not_called_a_cut(tmp_path):
    result = compute(jumping(), detectors="exact", oracle="continuous")
    (tmp_path / "run.rrd").touch()
    assert where_to_look(replace(result, out=tmp_path))[0] == f"See it   replay view {tmp_path} --miss 1"
    assert "between two recorded frames" in result.answers[0].why
    found = compute(jumping(), detectors="exact", oracle="hybrid")
    assert "--miss" not in "".join(where_to_look(replace(found, out=tmp_path)))
