"""Nothing of the paper is lost: every row of the guide's table opens, and equations (1) to (14) hold as printed."""

import re
from functools import reduce
from importlib import import_module
from itertools import takewhile
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from support.second_opinions import apply_row, row_rotation, row_scale, row_translation
from support.small_worlds import unit_cubes_on_x

import replay
from cdcore.detectors.detector_table import DETECTORS
from cdcore.poses import place_points, rotation_from_quaternion
from replay.cli.main import cli
from replay.guide.pages import page
from sessions.geometry.rotations import quaternion_about
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import quaternion_from_euler

CONTRIBUTING = (Path(__file__).resolve().parents[3] / ".github" / "CONTRIBUTING.md").read_text("utf-8")
SECTION = CONTRIBUTING.partition("## Where everything of the paper is")[2].partition("\n## ")[0]
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in SECTION.splitlines() if line[:1] == "|"][2:]
ENTRIES = {entry for row in ROWS for entry in re.findall("`([^`]+)`", row[2])}


def test_table_names_every_equation_table_figure_and_detection_kind():
    output = " ".join(row[0] for row in ROWS)
    named = set()
    for first, last in re.findall(r"\((\d+)\)(?: to \((\d+)\))?", output):
        named |= set(range(int(first), int(last or first) + 1))
    assert named == set(range(1, 22))
    figures = re.findall(r"Fig\. (\d)(?: to (\d))?", output)
    assert {k for first, last in figures for k in range(int(first), int(last or first) + 1)} == set(range(1, 9))
    for text in ("Table I,", "Table II,", "Table III,", "Table IV,", "instruments", "static", "discrete", "continuous",
                  "spheres, AABB, OBB", "image space"):  # fmt: skip
        assert text in output, text


def test_every_row_names_code_or_a_command():
    assert len(ROWS) > 25 and all(len(row) == 3 and "`" in row[2] for row in ROWS)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    session = unit_cubes_on_x({"a": [0.0] * 8, "b": [3, 3, 0.9, 3, 3, 3, 0.9, 3]})
    out = tmp_path_factory.mktemp("runs") / "run"
    return replay.run(session, detectors="discrete[rate_hz=20]", oracle="exact", out=out, picture=False).out


def is_a_function(entry):
    """Whether ``module:name`` is a function of the product."""
    module, _, names = entry.partition(":")
    return callable(reduce(getattr, names.split("."), import_module(module)))


def is_a_command(entry):
    """Whether a command, its options and its detector exist."""
    _, *text = entry.split()
    verbs = [*takewhile(lambda word: not word.startswith("-"), text)]
    if verbs[0] == "guide":
        return page(verbs[1]) != ""
    printed = CliRunner().invoke(cli, [*verbs, "--help"]).output
    named = text[-1].partition("[")[0] in DETECTORS or "--detectors" not in text
    return named and all(word in printed for word in text if word.startswith("-"))


def test_every_entry_of_the_table_opens(run_folder):
    for entry in sorted(ENTRIES):
        file, _, column = entry.partition(".parquet: ")
        if column:
            assert column in pq.read_schema(run_folder / f"{file}.parquet").names, entry
        elif entry.startswith("replay "):
            assert is_a_command(entry), entry
        else:
            assert is_a_function(entry), entry


@pytest.mark.slow
def test_printed_equations_move_points_as_the_functions_do():
    """The paper's matrices act on rows of points, the product's on columns: each is the other transposed."""
    rng = np.random.default_rng(14)
    for _ in range(50):
        angles, scales, move = rng.uniform(-3, 3, 3), rng.uniform(0.1, 3, 3), rng.normal(size=3)
        rotations = [row_rotation(axis, angle) for axis, angle in enumerate(angles)]
        points = rng.normal(size=(3, 3))
        for matrix in (row_translation(move), row_scale(scales), *rotations):
            posed = MeshData(points, [[0, 1, 2]]).transformed(matrix.T).vertices
            np.testing.assert_allclose(posed, apply_row(points, matrix), rtol=0, atol=1e-12)
        moved = place_points(points, np.eye(3), move)
        np.testing.assert_allclose(moved, apply_row(points, row_translation(move)), rtol=0, atol=1e-12)
        for axis, matrix in enumerate(rotations):
            rotation = rotation_from_quaternion(quaternion_about(np.eye(3)[axis], angles[axis]))
            np.testing.assert_allclose(rotation, matrix[:3, :3].T, rtol=0, atol=1e-12)
        rotated = rotation_from_quaternion(quaternion_from_euler(angles, "xyz"))
        np.testing.assert_allclose(rotated, (rotations[0] @ rotations[1] @ rotations[2])[:3, :3].T, rtol=0, atol=1e-12)
