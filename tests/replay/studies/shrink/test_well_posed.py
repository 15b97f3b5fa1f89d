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

POSITIONS = [3, 3, 0.9, 0.9, 3, 3, 3, 3]
ROTATED = (0.1, 0.2, 0.3, 0.9274)
"""No face of the second cube is parallel to one of the first."""


def shrunk_case(tmp_path, first, second, quaternion):
    """Bodies, poses and summary of the case that a miss of two bodies ends in."""
    poses = {"a": along_x([0] * 8), "b": along_x(POSITIONS, quaternion)}
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
    """Faces without area are left out, and the deepest pair overlaps by more than 2 um."""
    bodies, motion, case = shrunk_case(tmp_path, with_needles(cube()), with_needles(cube()), ROTATED)
    for body in bodies:
        a, b, c = body.mesh.triangles.transpose(1, 0, 2)
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-6).all()
    first, second = in_last_frame(bodies, motion)
    meets, depth = triangle_margins([(item, other) for item in first for other in second])
    assert depth[meets].max() > 2e-6 and case["doubts"] == []


@pytest.mark.slow
def test_no_shift_by_tolerance_ends_a_coplanar_contact(tmp_path):
    """Cubes with parallel faces: 1.9 um, within the tolerance of 2 um, in each of 27 directions."""
    bodies, motion, case = shrunk_case(tmp_path, cube(), cube(), (0, 0, 0, 1))
    last = motion.take(np.array([len(motion) - 1]))
    for method in itertools.product((-1, 0, 1), repeat=3):
        moved = last.translations.copy()
        moved[0, 1] += 1.9e-6 * np.array(method) / max(1.0, np.linalg.norm(method))
        shifted = Motion(last.times, moved, last.rotations)
        assert create_detector("exact", bodies).detect(shifted).verdict[0, 0] == Verdict.CONTACT, method
    assert "overlap by more than 2 micrometres" in " ".join(case["doubts"])


@pytest.mark.slow
def test_ill_posed_case_is_explained(tmp_path, capsys):
    """The second body is a face without an area, a segment through the cube: screen, case and README say so."""
    segment = MeshData([[-0.95, 0, 0], [0.95, 0.01, 0]], [(0, 1, 1)])
    _, _, case = shrunk_case(tmp_path, cube(), segment, ROTATED)
    for text in (*case["doubts"], capsys.readouterr().out, (tmp_path / "case" / "README.md").read_text()):
        assert "without an area" in " ".join(text.split())


def test_face_no_higher_than_the_tolerance_is_thin_anywhere():
    """A triangle 1 m wide and half or one and a half times 2 um high, nine metres from the origin."""
    for height in (0.5 * TWO_MICROMETRES, 1.5 * TWO_MICROMETRES):
        face = TriangleMesh(np.array([[0, 0, 0], [1, 0, 0], [0.5, height, 0]]) + 9.0, [[0, 1, 2]])
        assert thin_faces(face).tolist() == [height < TWO_MICROMETRES]


@pytest.mark.parametrize(
    ("position", "contact", "oracle", "doubts"),
    [
        ((0.9, 0.1, 0.2), True, "exact", set()),
        ((1.0 - 1e-6, 0.1, 0.2), True, "exact", {Doubt.SHALLOW, Doubt.LOOSE}),
        ((1.0 + 1e-6, 0.1, 0.2), True, "exact", {Doubt.NEAR}),
        ((1.0 + 1e-6, 0.1, 0.2), True, "continuous", set()),
        ((1.0 + 1e-6, 0.1, 0.2), False, "exact", {Doubt.NEAR}),
        ((1.1, 0.1, 0.2), False, "exact", set()),
    ],
    ids=["deep", "a micrometre deep", "inside or near", "met between frames", "a micrometre apart", "apart"],
)
def test_doubts_are_of_contacts_within_two_micrometres(position, contact, oracle, doubts):
    """Cubes of 1 m, the second at a position beside the first."""
    bodies = body_pair(box_mesh(), box_mesh())
    motion = motion_at([position])
    corners = [body.mesh.triangles + motion.translations[0, k] for k, body in enumerate(bodies)]
    fault = SimpleNamespace(
        bodies=bodies,
        pairs=np.array([[0, 1]]),
        motion=motion,
        contact=contact,
        oracle=oracle,
        corners=lambda body: corners[body],
    )
    assert doubts_of(fault) == doubts
