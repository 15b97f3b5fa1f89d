"""From two OBJ files and a CSV to colliders in the folder of an engine, in three commands."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from support.shapes import revolved_mesh

from replay.cli.fix import steps_about_axes
from replay.cli.main import main
from replay.cutting import piece_store

pytestmark = pytest.mark.usefixtures("quickest_cutter_only")

WALL = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
ROD = [(0, 0), (0.003, 0), (0.003, 0.2), (0, 0.2)]
IMPORT = ["import", "csv", "own.csv", "--mapping", "own.toml", "--meshes", ".", "-o", "own.mcap"]


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Two OBJ files, a CSV of a rod that stirs in a cup, and what its columns are, in an empty folder."""
    cup = revolved_mesh(WALL, 24)
    axis = int(np.argmax(np.ptp(cup.vertices, axis=0)))
    side = (axis + 1) % 3
    for name, mesh in {"cup": cup, "rod": revolved_mesh(ROD, 8)}.items():
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / f"{name}.obj")
    rows = ["t,x,y,z,zero,one"]
    for frame in range(60):
        position = np.zeros(3)
        position[axis], position[side] = 0.05, 0.031 if frame % 15 < 3 else 0.001 * (frame % 15)
        rows.append(",".join(map(str, [0.011 * frame, *position.tolist(), 0, 1])))
    (tmp_path / "own.csv").write_text("\n".join(rows), "utf-8")
    rotations = 'quaternion_xyzw = ["zero", "zero", "zero", "one"]'
    bodies = {"cup": ["zero"] * 3, "rod": ["x", "y", "z"]}
    mapping = ['convention = "openxr"', 'units = "m"', "[time]", 'column = "t"', 'unit = "s"']
    for body, columns in bodies.items():
        mapping += [f"[bodies.{body}]", f"position = {columns}", rotations]
    (tmp_path / "own.toml").write_text("\n".join(mapping), "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_import_run_and_fix_lead_to_colliders_for_unity(own, capsys):
    """A CSV becomes colliders of several convex pieces of at most 255 faces, with below 20 % false contact."""
    assert main(IMPORT) == 3  # the last row, cut short, is more than 1 %
    assert main(["run", "own.mcap", "--detectors", "hull50,exact", "--no-picture"]) == 0
    assert "Do In your engine, split cup into" in " ".join(capsys.readouterr().out.split())
    assert main(["fix", "own.mcap", "--engine", "unity"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "Report card of each collider" in output and "Wrote fix-unity for Unity" in output
    reported = json.loads((own / "fix-unity" / "colliders.json").read_text("utf-8"))
    assert reported["after"]["false"] <= 0.2 < reported["before"]["false"]
    assert {"ColliderPieces.cs", "README.txt", "cup.glb", "rod.glb", "session.mcap"} <= set(reported["files"])
    pieces = trimesh.load(own / "fix-unity" / "cup.glb", force="scene", process=False).geometry
    assert len(pieces) == reported["bodies"][0]["after"]["pieces"] > 1
    assert all(len(piece.faces) <= 255 and piece.is_convex for piece in pieces.values())


@pytest.mark.slow
def test_interrupted_fix_keeps_cut_pieces_for_the_next_call(own, capsys, monkeypatch):
    """Ctrl-C in the search: the folder of pieces has some, that of the colliders was not made."""
    monkeypatch.setattr(piece_store, "cache_folder", lambda: own / "cache")
    main(IMPORT)

    def interrupted(*_args, **_named):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("replay.advice.collider_search.ColliderSearch.descend", interrupted)
        assert main(["fix", "own.mcap", "--engine", "unity"]) == 130
    assert "the same command goes on from them" in capsys.readouterr().err
    assert not (own / "fix-unity").exists() and any((own / "cache").glob("cut-*"))


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [(["--engine", "source"], 1, "no engine 'source'; there are: unity"), (["--max-pieces", "0"], 2, "--max-pieces")],
)
def test_wrong_options_of_fix_are_refused_with_valid_choices(own, arguments, code, message, capsys):
    """An engine that there is not, and fewer than one piece."""
    main(IMPORT)
    assert main(["fix", "own.mcap", *arguments]) == code
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "folder", "replaces"),
    [
        (["-o", "mine", "--engine", "unity"], "mine", False),
        (["-o", "mine"], "mine", False),
        (["--engine", "unity"], "fix-unity", False),
        ([], "fix-page", True),
    ],
)
def test_fix_writes_to_the_named_folder_before_the_usual_folders(options, folder, replaces, tmp_path, monkeypatch):
    """Only the page without a name replaces the one before."""
    calls = []

    def interrupted(_session, folder, *, force, **_settings):
        calls.append((str(folder), force))
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.mcap").touch()
    monkeypatch.setattr("replay.running.collider_files.fix_colliders", interrupted)
    assert main(["fix", "own.mcap", *options]) == 130
    assert calls == [(folder, replaces)]


@pytest.mark.slow
def test_page_is_written_without_an_engine(own, capsys):
    """Without a name the page replaces the one before; a folder that somebody named stays."""
    main(IMPORT)
    command = ["fix", "own.mcap", "--max-false", "1"]
    assert main([*command, "-o", "mine"]) == 0
    assert {path.name for path in (own / "mine").iterdir()} == {"report.html", "colliders.json", "session.mcap"}
    assert "mine/report.html" in " ".join(capsys.readouterr().out.split())
    assert main([*command, "-o", "mine"]) == 1

    (own / "mine").rename(own / "fix-page")
    (own / "fix-page" / "report.html").write_text("the page before")
    assert main(command) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "fix-page/report.html" in output and "replay fix own.mcap --engine unity" in output
    assert "the page before" not in (own / "fix-page" / "report.html").read_text("utf-8")


@pytest.mark.parametrize(("axes", "is_said"), [("gltf", True), ("unity", False)])
def test_unity_steps_mention_pieces_in_axes_of_gltf(axes, is_said):
    """Poses in glTF's axes fit a mesh that Unity imported as glTF, not one in its own axes, which is said.

    Godot's own axes are glTF's, so nothing is.
    """
    fixed = SimpleNamespace(engine="Unity", axes=axes)
    assert any("pieces fit a mesh imported there as glTF" in line for line in steps_about_axes(fixed)) == is_said
    assert steps_about_axes(SimpleNamespace(engine="Godot", axes=axes)) == []
