"""Engines of others say what their documentation says, whatever was asked before; truth by known gaps between hulls."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from support.optional import ENGINE_MODULE
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    hulls_at,
    lab_bodies_and_motion,
    motion_at_rest,
    rod_mesh,
    unrotated_motion,
)

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.errors import InvalidMeshError
from cdcore.protocol import counts_as_contact

ENGINES = [
    pytest.param(name, marks=pytest.mark.skipif(find_spec(module) is None, reason=f"{module} is an extra"))
    for name, module in ENGINE_MODULE.items()
]
BUT_MUJOCO = [row for row in ENGINES if row.values[0] != "mujoco"]
GAPS = np.array([-1, -0.1, 0.1, 1, 1.9, 2.1, 3.7, 4, 10, 10.8, 11, 15, 19.9, 20.1]) / 1000

REACH = {
    # Cube of 10 cm on a plate, millimetres below which the engine's own defaults list a contact.
    # MuJoCo: geom margin 0, mujoco.readthedocs.io/en/stable/XMLreference.html#body-geom-margin.
    "mujoco": 0.0,
    # Rapier: normalized_prediction_distance 0.02 times length_unit 1, rapier.rs/docs: integration parameters.
    "rapier": 20.0,
    # Bullet: 1 mm of collision margin a body (PyBullet Quickstart Guide, changeDynamics), then the contact breaking
    # threshold, 0.02 times the smaller half diagonal with its margin: btCollisionShape::getContactBreakingThreshold.
    "bullet": 2 * 1.0 + 0.02 * (50 + 1) * 3**0.5,
    # PhysX: contactOffset computed from gravity and step, twice 9.81 / 60**2 m a body, and contact below the sum of
    # both: nvidia-omniverse.github.io/PhysX/ovphysx, simulation_setup/collision, "Rest and Contact Offsets".
    "physx": 2 * 2 * 9.81 / 60**2 * 1000,
    # Newton: ShapeConfig.margin 0; our row sets gap 0, which its documentation calls additional detection distance.
    "newton": 0.0,
}


def cube_above_plate(gaps):
    """A cube of 10 cm over a plate, and a motion with a frame for each gap, metres."""
    positions = [[[0.01, 0.02, 0.06 + gap], [0, 0, 0]] for gap in gaps]
    motion = unrotated_motion(positions)
    return [Body("cube", box_mesh((0.1, 0.1, 0.1))), Body("plate", box_mesh((1, 1, 0.02)))], motion


def contact_by_frame(name, bodies, motion, **settings):
    """Whether a detector reports contact of the first pair, frame by frame."""
    return counts_as_contact(create_detector(name, bodies, **settings).detect(motion).verdict[:, 0])


@pytest.mark.parametrize("name", ENGINES)
def test_cube_touches_plate_below_the_documented_distance(name):
    """REACH: each engine's distance in mm below which it reports a contact."""
    answer = contact_by_frame(name, *cube_above_plate(GAPS))
    assert answer.tolist() == np.less(GAPS * 1000, REACH[name]).tolist()


@pytest.mark.parametrize(
    ("name", "settings", "millimetres"),
    [
        ("rapier", {"prediction_m": 0.005}, 5.0),
        ("bullet", {"margin_m": 0.004}, 2 * 4.0 + 0.02 * (50 + 4) * 3**0.5),
        ("physx", {"contact_offset_m": 0.01}, 20.0),
        ("newton", {"gap_m": 0.005}, 10.0),
    ],
)
def test_another_offset_moves_the_distance_by_as_much(name, settings, millimetres):
    """``millimetres``: distance below which the engine reports contact with this setting, by its documentation."""
    pytest.importorskip(ENGINE_MODULE[name])
    answer = contact_by_frame(
        name, *cube_above_plate([(millimetres - 0.1) / 1000, (millimetres + 0.1) / 1000]), **settings
    )
    assert answer.tolist() == [True, False]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "reach", "early", "late"),
    [
        # A millimetre and more too late between edges: Rapier measures at corners of faces.
        ("rapier", {"prediction_m": 0.01}, 0.01, 1e-6, 3e-3),
        ("bullet", {}, 0.002, 1e-3, 0.0),
        ("newton", {}, 0.0, 1e-6, 5e-6),
        ("physx", {"contact_offset_m": 0.01}, 0.02, 1e-6, 2e-5),
    ],
)
def test_random_hulls_err_within_the_documented_tolerance(name, settings, reach, early, late):
    """Hulls ``reach`` metres apart, give or take 10 nm to 5 mm; ``early``, ``late``: tolerated metres of error."""
    pytest.importorskip(ENGINE_MODULE[name])
    about = np.concatenate([-np.logspace(-2.3, -8, 18), np.logspace(-8, -2.3, 18)])
    for seed in range(6):
        bodies, motion = hulls_at(seed, reach + about)
        answer = contact_by_frame(name, bodies, motion, **settings)
        assert answer[about < -late].all()
        assert not answer[about > early].any()


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["hull", "mesh"])
@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_earlier_queries_change_no_answer(name, shape):
    """40 frames asked alone and in another order, and one of a new detector, as in the whole motion."""
    bodies, motion = lab_bodies_and_motion(frames=120)
    detector = create_detector(name, bodies, shape=shape)
    whole = detector.detect(motion).verdict
    frames = np.random.default_rng(0).permutation(120)[:40].tolist()
    alone = [detector.detect(motion.frames(k, k + 1)).verdict[0] for k in frames]
    assert np.array_equal(alone, whole[frames])
    new = create_detector(name, bodies, shape=shape).detect(motion.frames(frames[0], frames[0] + 1))
    assert np.array_equal(new.verdict[0], whole[frames[0]])


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_rod_in_a_beaker_touches_hull_not_mesh(name):
    """The rod at 0.075 m is in the hollow of the beaker, which its convex hull fills; at 0.2 m it is above."""
    bodies = [Body("beaker", beaker_mesh()), Body("rod", rod_mesh())]
    for height, hull, mesh in ((0.2, False, False), (0.075, True, False)):
        motion = motion_at_rest(bodies, [[0, 0, 0], [0, 0, height]])
        assert contact_by_frame("exact", bodies, motion)[0] == mesh
        settings = {"prediction_m": 0.001} if name == "rapier" else {}
        settings |= {"contact_offset_m": 0.001} if name == "physx" else {}
        assert contact_by_frame(name, bodies, motion, shape="hull", **settings)[0] == hull
        assert contact_by_frame(name, bodies, motion, shape="mesh", **settings)[0] == mesh


@pytest.mark.parametrize("name", ["bullet", "physx"])
def test_untestable_mesh_pairs_are_unsupported_never_clear(name):
    """Two hollow beakers, 9 m apart in frame 0, are refused as meshes; the ball beside them, and their hulls, are not.

    In frame 1 the second beaker has no pose, which needs no reason.
    """
    pytest.importorskip(ENGINE_MODULE[name])
    bodies = [Body("a", beaker_mesh()), Body("b", beaker_mesh()), Body("ball", ball_mesh(0.01))]
    motion = Motion(
        np.arange(2),
        np.array([[[0, 0, 0], [0, 0, 9], [0, 0, 5]], [[0, 0, 0], [0, 0, 0.01], [0, 0, 5]]]),
        np.tile(np.eye(3), (2, 3, 1, 1)),
        np.array([[True, True, True], [True, False, True]]),
    )
    answer = create_detector(name, bodies, shape="mesh").detect(motion)
    assert answer.verdict[:, 0].tolist() == [Verdict.INVALID, Verdict.NO_POSE]
    assert set(answer.reasons) == {(0, 0)}
    assert "not supported" in answer.reasons[0, 0] and "not supported" in answer.containment[0]
    assert (answer.verdict[:, 1] == Verdict.CLEAR).all()
    explained = create_detector(name, bodies, shape="mesh").explain(motion, frame=0, pair=0, faces=np.zeros((0, 2)))
    assert explained.shapes_meet is None
    assert create_detector(name, bodies, shape="hull").detect(motion).verdict[0, 0] == Verdict.CLEAR


@pytest.mark.parametrize("name", ENGINES)
def test_crowded_bodies_lose_no_contacts(name):
    """All 105 pairs of 15 boxes of 10 cm meet, as their centres are about 1 cm apart."""
    bodies = [Body(f"box {k}", box_mesh((0.1, 0.1, 0.1))) for k in range(15)]
    positions = np.random.default_rng(0).normal(scale=0.01, size=(15, 3))
    assert counts_as_contact(create_detector(name, bodies).detect(motion_at_rest(bodies, positions)).verdict).all()


@pytest.mark.parametrize("name", ["rapier", pytest.param("newton", marks=pytest.mark.slow)])
def test_two_meshes_are_tested_against_each_other(name):
    """Two beakers of radius 4 cm: 9 m apart, then 3 cm, where their walls cross."""
    pytest.importorskip(ENGINE_MODULE[name])
    bodies = [Body("a", beaker_mesh()), Body("b", beaker_mesh())]
    motion = unrotated_motion([[[0, 0, 0], [9, 0, 0]], [[0, 0, 0], [0.03, 0, 0]]])
    assert contact_by_frame(name, bodies, motion, shape="mesh").tolist() == [False, True]


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_sheets_are_bodies_and_oversized_sheets_are_refused(name):
    """A cube 1 mm deep in a sheet of no thickness, and 1 m above it; edges of 1e100 m are refused."""
    sheet = TriangleMesh(box_mesh((0.3, 0.3, 1.0)).vertices * [1, 1, 0], box_mesh().faces)
    bodies = [Body("cube", box_mesh((0.1, 0.1, 0.1))), Body("sheet", sheet)]
    motion = unrotated_motion([[[0, 0, 0.049], [0, 0, 0]], [[0, 0, 1], [0, 0, 0]]])
    assert contact_by_frame(name, bodies, motion).tolist() == [True, False]
    with pytest.raises(InvalidMeshError, match="slab"):
        create_detector(name, [Body("slab", TriangleMesh(box_mesh().vertices * 1e100, box_mesh().faces))])


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_meshes_far_from_their_origin_keep_precision(name):
    """Vertices are shifted by 300 m and poses shifted back, so that the bodies meet as before."""
    far = np.array([300.0, -200.0, 100.0])
    bodies, motion = cube_above_plate(GAPS)
    moved = [Body(body.name, TriangleMesh(body.mesh.vertices + far, body.mesh.faces)) for body in bodies]
    present = Motion(motion.times, motion.translations - far, motion.rotations)
    assert np.array_equal(contact_by_frame(name, moved, present), contact_by_frame(name, bodies, motion))


@pytest.mark.slow
@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_an_engine_prints_nothing(name):
    """Two tetrahedra on each other in a new process, whose output and errors are read."""
    code = (
        "from cdcore import Body, Motion, TriangleMesh, create_detector; import numpy as np;"
        "mesh = TriangleMesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);"
        f"detector = create_detector({name!r}, [Body('a', mesh), Body('b', mesh)]);"
        "detector.detect(Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1))))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout + done.stderr == ""


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_an_engine_prints_nothing_into_a_notebook(name, capsys):
    create_detector(name, [Body("a", box_mesh()), Body("b", box_mesh())])
    assert capsys.readouterr() == ("", "")
