"""Nothing of the paper is lost: every row of the guide's table opens, and equations (1) to (14) hold as printed."""

import re
from dataclasses import dataclass
from functools import partial, reduce
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
"""Rows of the table in the contributors' page that says where in the product each part of the paper is.

Cells: part of the paper, what it is, and code or commands in backticks.
"""
ENTRIES = sorted({entry for row in ROWS for entry in re.findall("`([^`]+)`", row[2])})
"""Each code or command of the table."""


CONTENTS_OF_PAPER = " ".join(row[0] for row in ROWS)


def numbers_in(pattern):
    """Numbers, and those within ranges such as "(3) to (5)", that a pattern of two groups finds in the table."""
    ranges = [(int(first), int(last or first)) for first, last in re.findall(pattern, CONTENTS_OF_PAPER)]
    return {number for first, last in ranges for number in range(first, last + 1)}


def test_table_names_every_equation_and_figure_of_the_paper():
    """The paper has equations (1) to (21) and figures 1 to 8; the table may name ranges, "(3) to (5)"."""
    assert numbers_in(r"\((\d+)\)(?: to \((\d+)\))?") == set(range(1, 22))
    assert numbers_in(r"Fig\. (\d)(?: to (\d))?") == set(range(1, 9))


@pytest.mark.parametrize(
    "content",
    [
        *("Table I,", "Table II,", "Table III,", "Table IV,", "instruments", "static", "discrete", "continuous"),
        *("spheres, AABB, OBB", "image space"),
    ],
)
def test_table_names_every_table_and_detection_kind(content):
    """Tables I to IV of the paper, its instruments, and kinds of collision detection."""
    assert content in CONTENTS_OF_PAPER


def test_every_row_names_code_or_a_command():
    """Code and commands stand in backticks in the third of three cells; the table has over 25 rows."""
    assert len(ROWS) > 25
    assert [row for row in ROWS if len(row) != 3 or "`" not in row[2]] == []


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """The folder of a run of two cubes that touch twice, without a picture."""
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


COLUMN_ENTRIES = [entry for entry in ENTRIES if ".parquet: " in entry]
COMMAND_ENTRIES = [entry for entry in ENTRIES if entry.startswith("replay ")]
FUNCTION_ENTRIES = [entry for entry in ENTRIES if entry not in (*COLUMN_ENTRIES, *COMMAND_ENTRIES)]


def test_every_column_in_the_table_of_the_paper_exists(run_folder):
    """An entry "table.parquet: column" is a column of that file in a run folder."""
    assert COLUMN_ENTRIES
    for entry in COLUMN_ENTRIES:
        file, _, column = entry.partition(".parquet: ")
        assert column in pq.read_schema(run_folder / f"{file}.parquet").names, entry


def test_every_command_in_the_table_of_the_paper_exists():
    """An entry "replay ..." is a command with options that its help names, and a detector that exists."""
    assert COMMAND_ENTRIES
    assert [entry for entry in COMMAND_ENTRIES if not is_a_command(entry)] == []


def test_every_function_in_the_table_of_the_paper_exists():
    """Any other entry is "module:name" of a function or a class."""
    assert FUNCTION_ENTRIES
    assert [entry for entry in FUNCTION_ENTRIES if not is_a_function(entry)] == []


@dataclass(frozen=True)
class RowTransforms:
    """Points, a movement and three angles at random, and matrices as the paper prints them: for rows of points."""

    points: np.ndarray
    move: np.ndarray
    angles: np.ndarray
    translation: np.ndarray
    scale: np.ndarray
    rotations: list


def random_row_transforms():
    """Fifty random movements with points to move."""
    rng = np.random.default_rng(14)  # any seed
    for _ in range(50):
        angles, scales, move = rng.uniform(-3, 3, 3), rng.uniform(0.1, 3, 3), rng.normal(size=3)
        yield RowTransforms(
            points=rng.normal(size=(3, 3)),
            move=move,
            angles=angles,
            translation=row_translation(move),
            scale=row_scale(scales),
            rotations=[row_rotation(axis, angle) for axis, angle in enumerate(angles)],
        )


assert_equal = partial(np.testing.assert_allclose, rtol=0, atol=1e-12)


@pytest.mark.slow
def test_printed_matrices_transform_meshes_once_transposed():
    """The paper's matrices act on rows of points, the product's on columns: each is the other transposed.

    Translation, scale and the rotations about three axes; all corners of a triangle are compared.
    """
    for paper in random_row_transforms():
        for matrix in (paper.translation, paper.scale, *paper.rotations):
            transformed = MeshData(paper.points, [[0, 1, 2]]).transformed(matrix.T).vertices
            assert_equal(transformed, apply_row(paper.points, matrix))


@pytest.mark.slow
def test_printed_translation_moves_points():
    """``place_points`` without a rotation moves points as the paper's matrix for rows of points does."""
    for paper in random_row_transforms():
        placed = place_points(paper.points, np.eye(3), paper.move)
        assert_equal(placed, apply_row(paper.points, paper.translation))


@pytest.mark.slow
def test_printed_rotations_are_those_of_quaternions_about_an_axis():
    """Rotations about one axis, by a quaternion.

    The paper's matrices act on rows, so the product's are theirs transposed.
    """
    for paper in random_row_transforms():
        for axis, matrix in enumerate(paper.rotations):
            rotation = rotation_from_quaternion(quaternion_about(np.eye(3)[axis], paper.angles[axis]))
            assert_equal(rotation, matrix[:3, :3].T)


@pytest.mark.slow
def test_printed_rotations_in_sequence_are_those_of_euler_angles():
    """About x, then y, then z: matrices for rows are multiplied in that order, and transposed for columns."""
    for paper in random_row_transforms():
        about_x, about_y, about_z = paper.rotations
        rotation = rotation_from_quaternion(quaternion_from_euler(paper.angles, "xyz"))
        assert_equal(rotation, (about_x @ about_y @ about_z)[:3, :3].T)
