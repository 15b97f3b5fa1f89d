"""The doctor names crossing and nested parts, holes and doubled faces by their codes."""

import json

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, shift_mesh

from cdcore import TriangleMesh
from replay.cli.console import EXIT_OK
from replay.cli.main import main
from replay.prepare.inside_findings import containment_findings

BOX = box_mesh()
CROSSING_BOXES = merge_meshes(BOX, shift_mesh(BOX, [0.5, 0.3, 0.2]))
"""Two boxes of 1 m in one mesh that overlap."""

SMALLER_BOX = TriangleMesh(0.5 * BOX.vertices, BOX.faces)

SMALLER_REVERSED = TriangleMesh(0.5 * BOX.vertices, BOX.faces[:, ::-1])
"""A box of 0.5 m whose faces look inwards."""


@pytest.mark.parametrize(
    ("mesh", "codes"),
    [
        pytest.param(BOX, [], id="a box"),
        pytest.param(merge_meshes(BOX, shift_mesh(BOX, [9, 0, 0])), [], id="two boxes 9 m apart"),
        pytest.param(CROSSING_BOXES, ["mesh-parts-cross"], id="two boxes that overlap"),
        pytest.param(merge_meshes(BOX, SMALLER_BOX), ["mesh-parts-nested"], id="a box in a box"),
        pytest.param(merge_meshes(BOX, SMALLER_REVERSED), [], id="a box with a hollow"),
    ],
)
def test_crossing_and_nested_pieces_are_named(mesh, codes):
    """Two parts apart are sound, and so is a smaller one inside that is reversed: a hollow."""
    assert [finding.code for finding in containment_findings("m", mesh)] == codes


@pytest.mark.parametrize(
    ("mesh", "code"),
    [
        pytest.param(CROSSING_BOXES, "mesh-parts-cross", id="two boxes that overlap"),
        pytest.param(TriangleMesh(BOX.vertices, BOX.faces[1:]), "mesh-open", id="a face is missing"),
        pytest.param(
            TriangleMesh(BOX.vertices, np.concatenate([BOX.faces, BOX.faces[:1]])), "mesh-duplicate", id="a face twice"
        ),
    ],
)
def test_doctor_finds_crossing_open_and_duplicate_faces(tmp_path, capsys, mesh, code):
    """The mesh is written as an OBJ file, and ``replay doctor`` asked for its findings as JSON; the exit code is 0."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    file = tmp_path / "block.obj"
    file.write_text("\n".join(lines) + "\n")
    assert main(["doctor", str(file), "--format", "json"]) == EXIT_OK
    (result,) = json.loads(capsys.readouterr().out)
    assert code in [finding["code"] for finding in result["findings"]]
