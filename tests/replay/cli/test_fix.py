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
def folder_with_csv(tmp_path, monkeypatch):
    """The current folder, with OBJ files of a cup and a rod, a CSV of the rod stirring in it, and the CSV's columns."""
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
def test_import_run_and_fix_lead_to_colliders_for_unity(folder_with_csv, capsys):
    """A CSV of a rod in a cup is imported and run with convex hulls at 50 Hz: the advice is to split the cup.

    `replay fix` then writes colliders for Unity: the cup as several convex pieces of at most 255 faces, with at most
    20 % false contact where hulls had more.
    """
    assert main(IMPORT) == 3  # data loss: the last row, cut short, is more than 1 %
    assert main(["run", "own.mcap", "--detectors", "hull50,exact", "--no-picture"]) == 0
    assert "Do In your engine, split cup into" in " ".join(capsys.readouterr().out.split())
    assert main(["fix", "own.mcap", "--engine", "unity"]) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "Report card of each collider" in output and "Wrote fix-unity for Unity" in output
    reported = json.loads((folder_with_csv / "fix-unity" / "colliders.json").read_text("utf-8"))
    assert reported["after"]["false"] <= 0.2 < reported["before"]["false"]
    assert {"ColliderPieces.cs", "README.txt", "cup.glb", "rod.glb", "session.mcap"} <= set(reported["files"])
    pieces = trimesh.load(folder_with_csv / "fix-unity" / "cup.glb", force="scene", process=False).geometry
    assert len(pieces) == reported["bodies"][0]["after"]["pieces"] > 1
    assert all(len(piece.faces) <= 255 and piece.is_convex for piece in pieces.values())


@pytest.mark.slow
def test_interrupted_fix_stores_cut_pieces_for_the_next_call(folder_with_csv, capsys, monkeypatch):
    """`replay fix` gets Ctrl-C in its search among cut meshes: exit code 130, and a sentence that says how to go on.

    The folder in which pieces are stored has some; that of the colliders was not made.
    """
    monkeypatch.setattr(piece_store, "cache_folder", lambda: folder_with_csv / "cache")
    main(IMPORT)

    def interrupted(*_args, **_named):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("replay.advice.collider_search.ColliderSearch.descend", interrupted)
        assert main(["fix", "own.mcap", "--engine", "unity"]) == 130
    assert "the same command goes on from them" in capsys.readouterr().err
    assert not (folder_with_csv / "fix-unity").exists()
    assert any((folder_with_csv / "cache").glob("cut-*"))


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--engine", "source"], 1, "no engine 'source'; there are: unity"),
        (["--max-pieces", "0"], 2, "0 is not in the range"),
    ],
    ids=["unknown engine", "fewer than one piece"],
)
@pytest.mark.usefixtures("folder_with_csv")
def test_wrong_options_of_fix_are_refused_with_valid_choices(arguments, code, message, capsys):
    """``arguments``: of `replay fix` on an imported recording, which fails (1) or is a wrong call (2)."""
    main(IMPORT)
    assert main(["fix", "own.mcap", *arguments]) == code
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "folder", "may_replace"),
    [
        (["-o", "mine", "--engine", "unity"], "mine", False),
        (["-o", "mine"], "mine", False),
        (["--engine", "unity"], "fix-unity", False),
        ([], "fix-page", True),
    ],
)
def test_fix_writes_to_the_named_folder_before_the_usual_folders(options, folder, may_replace, tmp_path, monkeypatch):
    """The folder of `replay fix` is the one that ``-o`` names, else one of the engine, else one of a page alone.

    Only the page in its usual folder may replace what is there. The work is cut off at its start, as by Ctrl-C (130).
    """
    calls = []

    def interrupted(_session, folder, *, force, **_settings):
        calls.append((str(folder), force))
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.mcap").touch()
    monkeypatch.setattr("replay.running.collider_files.fix_colliders", interrupted)
    assert main(["fix", "own.mcap", *options]) == 130
    assert calls == [(folder, may_replace)]


@pytest.mark.slow
def test_page_is_written_without_an_engine(folder_with_csv, capsys):
    """`replay fix` without an engine writes a page that compares colliders, and no files for an engine.

    A folder that somebody named (mine) is not written over (1). The usual folder, fix-page, is: its page is another one
    afterwards. ``--max-false 1`` allows any fraction of false contact.
    """
    main(IMPORT)
    command = ["fix", "own.mcap", "--max-false", "1"]
    mine, usual = folder_with_csv / "mine", folder_with_csv / "fix-page"
    assert main([*command, "-o", "mine"]) == 0
    assert {path.name for path in mine.iterdir()} == {"report.html", "colliders.json", "session.mcap"}
    assert "mine/report.html" in " ".join(capsys.readouterr().out.split())
    assert main([*command, "-o", "mine"]) == 1
    assert "mine exists; name another folder" in " ".join(capsys.readouterr().err.split())

    mine.rename(usual)
    (usual / "report.html").write_text("the page before")
    assert main(command) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "fix-page/report.html" in output and "replay fix own.mcap --engine unity" in output
    assert "the page before" not in (usual / "report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("engine", "axes", "mentions"),
    [("Unity", "gltf", True), ("Unity", "unity", False), ("Godot", "gltf", False), ("Godot", "unity", False)],
)
def test_unity_steps_mention_pieces_in_axes_of_gltf(engine, axes, mentions):
    """``axes``: of the convex pieces that are written for an engine, with steps how to use them there.

    Pieces in glTF's axes fit a mesh that Unity imported as glTF, not one in its own axes, which a step says. Godot's
    own axes are glTF's, so no step is about axes.
    """
    steps = steps_about_axes(SimpleNamespace(engine=engine, axes=axes))
    assert any("pieces fit a mesh imported there as glTF" in step for step in steps) == mentions
    assert engine == "Unity" or steps == []
