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
GAPS_MM = np.array([-1, -0.1, 0.1, 1, 1.9, 2.1, 3.7, 4, 10, 10.8, 11, 15, 19.9, 20.1])
"""Millimetres between a cube and a plate, on both sides of the distance below which each engine reports a contact."""

REACH_MM = {
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


def cube_above_plate(gaps_mm):
    """A cube of 10 cm over a plate 2 cm thick, and a motion with a frame for each gap."""
    positions = [[[0.01, 0.02, 0.05 + 0.01 + gap / 1000], [0, 0, 0]] for gap in gaps_mm]
    motion = unrotated_motion(positions)
    return [Body("cube", box_mesh((0.1, 0.1, 0.1))), Body("plate", box_mesh((1, 1, 0.02)))], motion


def contact_by_frame(name, bodies, motion, **settings):
    """Whether a detector reports contact of the first pair, frame by frame."""
    return counts_as_contact(create_detector(name, bodies, **settings).detect(motion).verdict[:, 0])


@pytest.mark.parametrize("name", ENGINES)
def test_cube_touches_plate_below_the_documented_distance(name):
    """A cube above a plate at the gaps of GAPS_MM; REACH_MM has the engine's documented distance, and its source."""
    bodies, motion = cube_above_plate(GAPS_MM)
    assert contact_by_frame(name, bodies, motion).tolist() == [gap < REACH_MM[name] for gap in GAPS_MM.tolist()]


@pytest.mark.parametrize(
    ("name", "settings", "reach_mm"),
    [
        pytest.param("rapier", {"prediction_m": 0.005}, 5.0, id="Rapier: prediction of 5 mm"),
        pytest.param("bullet", {"margin_m": 0.004}, 2 * 4.0 + 0.02 * (50 + 4) * 3**0.5, id="Bullet: margins of 4 mm"),
        pytest.param("physx", {"contact_offset_m": 0.01}, 2 * 10.0, id="PhysX: contact offsets of 1 cm"),
        pytest.param("newton", {"gap_m": 0.005}, 2 * 5.0, id="Newton: gaps of 5 mm"),
    ],
)
def test_another_offset_moves_the_distance_by_as_much(name, settings, reach_mm):
    """A cube above a plate, 0.1 mm within and 0.1 mm beyond the distance of contact with this setting.

    A setting of both bodies counts twice; Bullet adds its breaking threshold, as at REACH_MM.
    """
    pytest.importorskip(ENGINE_MODULE[name])
    bodies, motion = cube_above_plate([reach_mm - 0.1, reach_mm + 0.1])
    assert contact_by_frame(name, bodies, motion, **settings).tolist() == [True, False]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "reach_m", "early_m", "late_m"),
    [
        # A millimetre and more too late between edges: Rapier measures at corners of faces.
        ("rapier", {"prediction_m": 0.01}, 0.01, 1e-6, 3e-3),
        # 1 mm of margin a body; beyond it the contact breaking threshold, as at REACH_MM, is at most
        # 0.02 * 26 mm * 3**0.5 = 0.9 mm for the smaller hull, of 5 cm.
        ("bullet", {}, 0.002, 1e-3, 0.0),
        ("newton", {}, 0.0, 1e-6, 5e-6),
        ("physx", {"contact_offset_m": 0.01}, 0.02, 1e-6, 2e-5),
    ],
    ids=["rapier", "bullet", "newton", "physx"],
)
def test_random_hulls_err_within_the_documented_tolerance(name, settings, reach_m, early_m, late_m):
    """Two random hulls at ``reach_m``, from which the engine should report contact, give or take 10 nm to 5 mm.

    Contact is certain nearer than that by ``late_m``, and excluded beyond it by ``early_m``.
    """
    pytest.importorskip(ENGINE_MODULE[name])
    offsets = np.concatenate([-np.logspace(-2.3, -8, 18), np.logspace(-8, -2.3, 18)])
    for seed in range(6):
        bodies, motion = hulls_at(seed, gaps=reach_m + offsets)
        answer = contact_by_frame(name, bodies, motion, **settings)
        assert answer[offsets < -late_m].all(), seed
        assert not answer[offsets > early_m].any(), seed


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["hull", "mesh"])
@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_earlier_queries_change_no_answer(name, shape):
    """40 of 120 frames, in another order, get the answers of the whole motion; so does the first, of a new detector."""
    bodies, motion = lab_bodies_and_motion(frames=120)
    detector = create_detector(name, bodies, shape=shape)
    whole = detector.detect(motion).verdict
    frames = np.random.default_rng(0).permutation(120)[:40].tolist()
    separately = [detector.detect(motion.frames(frame, frame + 1)).verdict[0] for frame in frames]
    assert np.array_equal(separately, whole[frames])
    first = frames[0]
    new_detector = create_detector(name, bodies, shape=shape)
    assert np.array_equal(new_detector.detect(motion.frames(first, first + 1)).verdict[0], whole[first])


@pytest.mark.parametrize("name", BUT_MUJOCO)
@pytest.mark.parametrize(
    ("height_m", "hull_contact", "mesh_contact"),
    [pytest.param(0.2, False, False, id="above"), pytest.param(0.075, True, False, id="in the hollow")],
)
def test_rod_in_a_beaker_touches_hull_not_mesh(name, height_m, hull_contact, mesh_contact):
    """A thin rod stands in the middle of a beaker 10 cm high, whose hollow its convex hull fills, or above it.

    Contact offsets are at most 1 mm, the rod is 3.5 cm from the glass: its radius is 0.3 cm, the hollow's 3.8 cm.
    """
    bodies = [Body("beaker", beaker_mesh()), Body("rod", rod_mesh())]
    motion = motion_at_rest(bodies, [[0, 0, 0], [0, 0, height_m]])
    settings = {"rapier": {"prediction_m": 0.001}, "physx": {"contact_offset_m": 0.001}}.get(name, {})
    assert contact_by_frame("exact", bodies, motion).tolist() == [mesh_contact]
    assert contact_by_frame(name, bodies, motion, shape="hull", **settings).tolist() == [hull_contact]
    assert contact_by_frame(name, bodies, motion, shape="mesh", **settings).tolist() == [mesh_contact]


@pytest.mark.parametrize("name", ["bullet", "physx"])
def test_untestable_mesh_pairs_are_unsupported_never_clear(name):
    """Two beakers, hollow meshes, which these engines do not test against each other, and a ball 4 m from both.

    Pair 0, the beakers, is refused in frame 0; in frame 1 the second beaker has no pose. The pair of the first beaker
    and the ball is clear.
    """
    pytest.importorskip(ENGINE_MODULE[name])
    bodies, motion = beakers_and_a_ball()
    answer = create_detector(name, bodies, shape="mesh").detect(motion)
    beakers, first_and_ball = 0, 1
    assert answer.verdict[:, beakers].tolist() == [Verdict.INVALID, Verdict.NO_POSE]
    assert (answer.verdict[:, first_and_ball] == Verdict.CLEAR).all()
    assert set(answer.reasons) == {(0, beakers)}
    assert "not supported" in answer.reasons[0, beakers]
    assert "not supported" in answer.containment[beakers]


@pytest.mark.parametrize("name", ["bullet", "physx"])
def test_untestable_mesh_pairs_are_explained_as_unknown(name):
    """Two beakers, hollow meshes, which these engines do not test against each other: whether they meet is unknown."""
    pytest.importorskip(ENGINE_MODULE[name])
    bodies, motion = beakers_and_a_ball()
    detector = create_detector(name, bodies, shape="mesh")
    assert detector.explain(motion, frame=0, pair=0, faces=np.zeros((0, 2))).shapes_meet is None


@pytest.mark.parametrize("name", ["bullet", "physx"])
def test_hulls_of_untestable_mesh_pairs_are_tested(name):
    """Two beakers 9 m apart: an engine that cannot test two meshes of this kind against each other says clear of their
    convex hulls.
    """
    pytest.importorskip(ENGINE_MODULE[name])
    bodies, motion = beakers_and_a_ball()
    assert create_detector(name, bodies, shape="hull").detect(motion).verdict[0, 0] == Verdict.CLEAR


def beakers_and_a_ball():
    """Two beakers 9 m apart and a ball between them; in frame 1 the second beaker has no pose."""
    bodies = [Body("a", beaker_mesh()), Body("b", beaker_mesh()), Body("ball", ball_mesh(0.01))]
    positions = np.tile([[0, 0, 0], [0, 0, 9], [0, 0, 5]], (2, 1, 1))
    valid = np.array([[True, True, True], [True, False, True]])
    return bodies, unrotated_motion(positions, valid=valid)


@pytest.mark.parametrize("name", ENGINES)
def test_crowded_bodies_lose_no_contacts(name):
    """All 15 * 14 / 2 = 105 pairs of 15 boxes of 10 cm meet, as their centres are about 1 cm apart."""
    bodies = [Body(f"box {k}", box_mesh((0.1, 0.1, 0.1))) for k in range(15)]
    positions = np.random.default_rng(0).normal(scale=0.01, size=(15, 3))
    verdict = create_detector(name, bodies).detect(motion_at_rest(bodies, positions)).verdict
    assert verdict.shape == (1, 105)
    assert counts_as_contact(verdict).all()


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_sheet_without_thickness_is_a_body(name):
    """A cube of 10 cm whose middle is 49 mm above a flat sheet, 1 mm deep in it, and 1 m above it."""
    sheet = TriangleMesh(box_mesh((0.3, 0.3, 1.0)).vertices * [1, 1, 0], box_mesh().faces)
    bodies = [Body("cube", box_mesh((0.1, 0.1, 0.1))), Body("sheet", sheet)]
    motion = unrotated_motion([[[0, 0, 0.049], [0, 0, 0]], [[0, 0, 1], [0, 0, 0]]])
    assert contact_by_frame(name, bodies, motion).tolist() == [True, False]


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_oversized_mesh_is_refused_by_name(name):
    """A box with edges of 1e100 m, called slab: an engine keeps float32, too coarse for its corners."""
    slab = Body("slab", TriangleMesh(box_mesh().vertices * 1e100, box_mesh().faces))
    with pytest.raises(InvalidMeshError, match="too coarse for slab"):
        create_detector(name, [slab])


@pytest.mark.parametrize("name", ["rapier", pytest.param("newton", marks=pytest.mark.slow)])
def test_two_meshes_are_tested_against_each_other(name):
    """Two beakers of radius 4 cm: 9 m apart, then 3 cm, where their walls cross."""
    pytest.importorskip(ENGINE_MODULE[name])
    bodies = [Body("a", beaker_mesh()), Body("b", beaker_mesh())]
    motion = unrotated_motion([[[0, 0, 0], [9, 0, 0]], [[0, 0, 0], [0.03, 0, 0]]])
    assert contact_by_frame(name, bodies, motion, shape="mesh").tolist() == [False, True]


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_meshes_far_from_their_origin_keep_precision(name):
    """A cube above a plate; vertices are shifted by 300 m and poses shifted back, so that the answers stay the same."""
    far = np.array([300.0, -200.0, 100.0])
    bodies, motion = cube_above_plate(GAPS_MM)
    far_bodies = [Body(body.name, TriangleMesh(body.mesh.vertices + far, body.mesh.faces)) for body in bodies]
    shifted_back = Motion(motion.times, motion.translations - far, motion.rotations)
    expected = contact_by_frame(name, bodies, motion)
    assert set(expected.tolist()) == {True, False}
    assert np.array_equal(contact_by_frame(name, far_bodies, shifted_back), expected)


@pytest.mark.slow
@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_an_engine_prints_nothing(name):
    """Two tetrahedra on each other in a new process, of which output and errors are empty."""
    code = (
        "from cdcore import Body, Motion, TriangleMesh, create_detector; import numpy as np;"
        "mesh = TriangleMesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);"
        f"detector = create_detector({name!r}, [Body('a', mesh), Body('b', mesh)]);"
        "detector.detect(Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1))))"
    )
    process = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert (process.stdout, process.stderr) == ("", "")


@pytest.mark.parametrize("name", BUT_MUJOCO)
def test_an_engine_prints_nothing_into_a_notebook(name, capsys):
    """A notebook prints what Python's ``sys.stdout`` and ``sys.stderr`` get, which ``capsys`` captures."""
    create_detector(name, [Body("a", box_mesh()), Body("b", box_mesh())])
    assert capsys.readouterr() == ("", "")
