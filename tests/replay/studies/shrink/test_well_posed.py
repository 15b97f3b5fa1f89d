"""A shrunk case is well posed, so that a detector that fails it is wrong and not only unlike another."""

import itertools
import json
import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import along_x, cube

from cdcore import Motion, TriangleMesh, Verdict, create_detector
from cdcore.narrow.margins import triangle_margins
from cdcore.tolerances import TWO_MICROMETRES
from replay import run
from replay.cli.main import main
from replay.studies.shrink.well_posed import Doubt, doubts_of, thin_faces
from replay.studies.stress.scenes import body_pair, motion_at
from replay.studies.stress.solids import box_mesh
from sessions import MeshData, Session, write_session

X_OF_SECOND_BODY = [3, 3, 0.9, 0.9, 3, 3, 3, 3]
"""Metres beside the first body, frame by frame of 10 ms: cubes of 1 m touch in frames 2 and 3."""
UNROTATED = (0.0, 0.0, 0.0, 1.0)
ROTATED = (0.1, 0.2, 0.3, 0.9274)
"""Quaternions; rotated no face of the second cube is parallel to one of the first."""


def shrunk_case(tmp_path, first, second, quaternion):
    """Bodies, poses and summary of the case that a miss of two meshes, the second rotated, is shrunk to.

    The detector samples every fourth frame of eight, and misses the contact between two samples.
    """
    poses = {"a": along_x([0] * 8), "b": along_x(X_OF_SECOND_BODY, quaternion)}
    session = Session.from_arrays(np.arange(8) * 10_000_000, poses, {"a": first, "b": second})
    write_session(session, tmp_path / "s.mcap")
    run(tmp_path / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=tmp_path / "run", picture=False)
    assert main(["shrink", str(tmp_path / "run"), "--miss", "1", "-o", str(tmp_path / "case")]) == 0
    test = runpy.run_path(str(tmp_path / "case" / "test_case.py"))
    bodies = [test["body"](*row) for row in test["CASE"]["bodies"]]
    return bodies, test["motion"](len(bodies)), json.loads((tmp_path / "case" / "case.json").read_text())


def in_last_frame(bodies, motion):
    """Triangles of each body as they are placed in the last frame."""
    return [
        body.mesh.triangles @ motion.rotations[-1, k].T + motion.translations[-1, k] for k, body in enumerate(bodies)
    ]


def with_needles(mesh):
    """The mesh, and faces without an area that cross what is left of it: a segment each."""
    ends = [[[-0.95, y, 0.0], [0.95, y, 0.0]] for y in (-0.1, 0.0, 0.1)]
    corners = np.array(ends).reshape(-1, 3)
    needles = [(len(mesh.vertices) + k, len(mesh.vertices) + k + 1, len(mesh.vertices) + k + 1) for k in (0, 2, 4)]
    return MeshData([*mesh.vertices, *corners], [*needles, *mesh.faces])


def test_faces_have_area_and_overlap_beyond_the_tolerance(tmp_path):
    """Two cubes with needles, faces without an area: the case has none of these, and no doubts.

    Its deepest pair of faces overlaps by more than 2 um, within which engines may differ.
    """
    bodies, motion, case = shrunk_case(tmp_path, with_needles(cube()), with_needles(cube()), ROTATED)
    for body in bodies:
        a, b, c = body.mesh.triangles.transpose(1, 0, 2)
        double_areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        assert (double_areas > 1e-6).all(), "square metres; faces of the cubes have 1"
    first, second = in_last_frame(bodies, motion)
    meets, depth = triangle_margins([(face, other) for face in first for other in second])
    assert depth[meets].max() > TWO_MICROMETRES
    assert case["doubts"] == []


@pytest.mark.slow
def test_no_shift_by_tolerance_ends_a_coplanar_contact(tmp_path):
    """Two cubes with parallel faces: the case stays in contact with the second body shifted by 1.9 um, below 2 um.

    No two faces overlap by more than 2 um, which is its doubt; they keep the contact together.
    """
    bodies, motion, case = shrunk_case(tmp_path, cube(), cube(), UNROTATED)
    last = motion.take(np.array([len(motion) - 1]))
    for direction in itertools.product((-1, 0, 1), repeat=3):
        length = max(1.0, np.linalg.norm(direction))  # (0, 0, 0): not shifted
        shifted_positions = last.translations.copy()
        shifted_positions[0, 1] += 1.9e-6 * np.array(direction) / length
        shifted = Motion(last.times, shifted_positions, last.rotations)
        assert create_detector("exact", bodies).detect(shifted).verdict[0, 0] == Verdict.CONTACT, direction
    assert "overlap by more than 2 micrometres" in " ".join(case["doubts"])


@pytest.mark.slow
def test_ill_posed_case_is_explained(tmp_path, capsys):
    """The second body is a face without an area, a segment through the cube: screen, case and README say so."""
    segment = MeshData([[-0.95, 0, 0], [0.95, 0.01, 0]], [(0, 1, 1)])
    _, _, case = shrunk_case(tmp_path, cube(), segment, ROTATED)
    (doubt,) = case["doubts"]
    for text in (doubt, capsys.readouterr().out, (tmp_path / "case" / "README.md").read_text()):
        assert "without an area" in " ".join(text.split())


@pytest.mark.parametrize(("heights", "is_thin"), [(0.5, True), (1.5, False)])
def test_face_no_higher_than_the_tolerance_is_thin_anywhere(heights, is_thin):
    """A triangle 1 m wide and half or one and a half times 2 um high, at (9, 9, 9) m, where digits are fewer."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, heights * TWO_MICROMETRES, 0]])
    face = TriangleMesh(corners + 9.0, [[0, 1, 2]])
    assert thin_faces(face).tolist() == [is_thin]


@pytest.mark.parametrize(
    ("x", "contact", "oracle", "doubts"),
    [
        pytest.param(0.9, True, "exact", set(), id="contact, deep"),
        pytest.param(1.0 - 1e-6, True, "exact", {Doubt.SHALLOW, Doubt.LOOSE}, id="contact, a micrometre deep"),
        pytest.param(1.0 + 1e-6, True, "exact", {Doubt.NEAR}, id="contact, so inside, and surfaces are near"),
        pytest.param(1.0 + 1e-6, True, "continuous", set(), id="contact between the frames"),
        pytest.param(1.0 + 1e-6, False, "exact", {Doubt.NEAR}, id="clear, a micrometre apart"),
        pytest.param(1.1, False, "exact", set(), id="clear, far apart"),
    ],
)
def test_doubts_are_of_contacts_within_two_micrometres(x, contact, oracle, doubts):
    """Cubes of 1 m, the second at (x, 0.1, 0.2): they touch at x = 1 m; ``contact`` is the right answer.

    Expected are reasons why engines may differ: the right answer changes within 2 um.
    """
    bodies = body_pair(box_mesh(), box_mesh())
    motion = motion_at([(x, 0.1, 0.2)])
    placed_triangles = [body.mesh.triangles + motion.translations[0, k] for k, body in enumerate(bodies)]
    fault = SimpleNamespace(
        bodies=bodies,
        pairs=np.array([[0, 1]]),
        motion=motion,
        contact=contact,
        oracle=oracle,
        corners=lambda body: placed_triangles[body],
    )
    assert doubts_of(fault) == doubts
