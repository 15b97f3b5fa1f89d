"""The doctor names crossing and nested parts, holes and doubled faces by their codes."""

import json

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, shift_mesh

from cdcore import TriangleMesh
from replay.cli.main import main
from replay.prepare.inside_findings import containment_findings

BOX = box_mesh()
SMALLER_REVERSED = TriangleMesh(0.5 * BOX.vertices, BOX.faces[:, ::-1])


@pytest.mark.parametrize(
    ("mesh", "codes"),
    [
        (BOX, []),
        (merge_meshes(BOX, shift_mesh(BOX, [9, 0, 0])), []),
        (merge_meshes(BOX, shift_mesh(BOX, [0.5, 0.3, 0.2])), ["mesh-parts-cross"]),
        (merge_meshes(BOX, TriangleMesh(0.5 * BOX.vertices, BOX.faces)), ["mesh-parts-nested"]),
        (merge_meshes(BOX, SMALLER_REVERSED), []),
    ],
    ids=["one", "apart", "crossing", "nested", "hollow"],
)
def test_crossing_and_nested_pieces_are_named(mesh, codes):
    """Two parts apart are sound, and so is a smaller one inside that is reversed: a hollow."""
    assert [finding.code for finding in containment_findings("m", mesh)] == codes


@pytest.mark.parametrize(
    ("mesh", "code"),
    [
        (merge_meshes(BOX, shift_mesh(BOX, [0.5, 0.3, 0.2])), "mesh-parts-cross"),
        (TriangleMesh(BOX.vertices, BOX.faces[1:]), "mesh-open"),
        (TriangleMesh(BOX.vertices, np.concatenate([BOX.faces, BOX.faces[:1]])), "mesh-duplicate"),
    ],
)
def test_doctor_finds_crossing_open_and_duplicate_faces(tmp_path, capsys, mesh, code):
    """Two boxes that cross, a box that lacks a face and a box with a face twice, read from an OBJ file."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    file = tmp_path / "block.obj"
    file.write_text("\n".join(lines) + "\n")
    assert main(["doctor", str(file), "--format", "json"]) == 0
    (result,) = json.loads(capsys.readouterr().out)
    assert code in [finding["code"] for finding in result["findings"]]
