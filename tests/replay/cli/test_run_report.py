import json
from dataclasses import replace
from pathlib import Path

from support.small_worlds import cubes, framed, jumping

from replay.cli.console import People
from replay.cli.run_report import lost_frames, report_run, run_json, where_to_look
from replay.pipeline.engine import compute


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


def test_json_lists_the_faces_of_misses_beside_an_oracle_that_keeps_none():
    session = cubes({"a": [0.0] * 8, "b": [1.05] * 3 + [0.95] + [1.05] * 4})
    result = compute(session, detectors="slow=discrete[rate_hz=20]", oracle="continuous")
    (miss,) = json.loads(json.dumps(run_json(result)))["misses"]["slow"]
    assert len(miss["faces"]) == miss["face_pairs"] > 0


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
    assert where_to_look(written)[-1] == f"or at the longest cut: replay view {tmp_path} --miss {deepest.number}"
    assert len({line.index("replay view") for line in where_to_look(written)[1:]}) == 1, (
        "commands stand below each other"
    )
    assert where_to_look(written)[0].endswith(str(tmp_path / "report.html"))
    assert len(where_to_look(written, picture=False)) == 1, "without a picture there is nothing to view"


def test_of_several_detectors_the_longest_cut_of_all_is_named_with_its_detector(tmp_path):
    places = {"a": [0] * 12, "b": [3, 3, 0.99, 3, 3, 3, 3, 3, 0.5, 3, 3, 3]}
    result = compute(cubes(places), detectors="other=discrete[rate_hz=25],slow=discrete[rate_hz=20]")
    cuts = {label: max((miss.cut_length for miss in found), default=-1) for label, found in result.misses.items()}
    label = max(cuts, key=cuts.get)
    number = max(result.misses[label], key=lambda miss: miss.cut_length).number
    assert label == "slow" and cuts["other"] > 0
    assert where_to_look(replace(result, out=tmp_path))[-1].endswith(
        f"replay view {tmp_path} --miss {number} --by slow"
    )


def test_a_miss_that_no_frame_shows_is_not_called_a_cut(tmp_path):
    result = compute(jumping(), detectors="exact", oracle="continuous")
    assert where_to_look(replace(result, out=tmp_path))[-1] == f"or between two frames: replay view {tmp_path} --miss 1"
    found = compute(jumping(), detectors="exact", oracle="hybrid")
    assert "--miss" not in "".join(where_to_look(replace(found, out=tmp_path)))
