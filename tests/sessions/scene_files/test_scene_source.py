"""``[scene] from``: bodies, colliders and excluded pairs of another program's scene beside a recording."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions import read_session, write_session
from sessions.errors import SceneError
from sessions.importers import import_session
from sessions.meshes.conventions import CONVENTIONS
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Origin, Subject, assumptions_fact
from sessions.model.session import Session
from sessions.scene_files.answers import recording_assumptions
from sessions.scene_files.scene_meshes import checked_scene, with_scene

pytest.importorskip("mujoco")

MODEL = """
<mujoco><contact><exclude body1="cup" body2="shelf"/></contact><worldbody>
  <body name="shelf" pos="1 2 3" euler="90 0 0"><geom type="box" size="0.1 0.2 0.3"/></body>
  <body name="cup"><freejoint/><geom type="box" size="0.1 0.2 0.3" margin="0.002"/></body>
  <body name="rod"><freejoint/><geom type="box" size="0.01 0.01 0.3"/></body>
</worldbody></mujoco>
"""
SCENE = """
[scene]
from = "model.xml"
[[group]]
name = "carried"
members = ["cup", "rod"]
[[pair]]
between = ["carried", "shelf"]
[[ignore]]
between = ["rod", "shelf"]
"""


@pytest.fixture
def scene_file(tmp_path):
    """The path of scene.toml (SCENE), beside the model of MuJoCo (MODEL) that it takes its bodies from."""
    (tmp_path / "model.xml").write_text(MODEL)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


def no_plan_problems(*_):
    """The problems that planning the effects of a checked scene finds: none."""
    return ()


def recording_without_meshes():
    """Two frames of the cup and the rod, without meshes."""
    poses = (np.zeros((2, 3)), np.tile([0.0, 0, 0, 1], (2, 1)))
    return Session.from_arrays([0, 1], {"cup": poses, "rod": poses}, {})


@pytest.mark.parametrize("axes", ["ros", "z-up", "openxr"])
def test_fixed_bodies_of_a_scene_use_the_recordings_axes(scene_file, axes):
    """MuJoCo's shelf is at (1, 2, 3), rotated by 90 degrees about x, and has Z up as all its models.

    A recording in axes of ROS or z-up has Z up, too, so that both the model's world and its bodies are in such axes. A
    recording with OpenXR's Y up has the model's world turned to Y up, and its bodies as the model has them.
    """
    facts = {ASSUMPTIONS_FACT: assumptions_fact([Assumption(Subject.POSE_AXES, axes, Origin.USER)])}
    session = with_scene(replace(recording_without_meshes(), facts=facts), scene_file)
    world_axes = CONVENTIONS["z-up" if axes == "openxr" else axes].matrix
    body_axes = np.eye(3) if axes == "openxr" else world_axes
    shelf = session.scene.body("shelf").fixed
    assert shelf.position == pytest.approx(tuple(world_axes @ [1.0, 2.0, 3.0]))
    expected = world_axes @ Rotation.from_euler("x", 90, degrees=True).as_matrix() @ body_axes.T
    np.testing.assert_allclose(Rotation.from_quat(shelf.quaternion_xyzw).as_matrix(), expected, atol=1e-12)


def test_surfaces_that_were_guessed_are_assumptions(scene_file):
    """The model's cup has a box that is drawn and a box that collides: that the drawn box is its surface is a guess.

    It stays a single guess where the scene is read twice.
    """
    drawn = '<geom type="box" size="0.1 0.2 0.3" contype="0" conaffinity="0" group="1"/>'
    hidden = '<geom type="box" size="0.1 0.2 0.3" group="3"/>'
    body = f'<body name="cup"><freejoint/>{drawn}{hidden}</body>'
    text = (scene_file.parent / "model.xml").read_text()
    (scene_file.parent / "model.xml").write_text(re.sub(r'<body name="cup">.*?</body>', body, text))
    once = with_scene(recording_without_meshes(), scene_file)
    for session in (once, with_scene(once, scene_file)):
        (row,) = (row for row in recording_assumptions(session) if row.subject is Subject.SURFACE)
        assert (row.value, row.bodies, row.origin) == ("drawn", ("cup",), Origin.GUESS)


def test_scene_takes_bodies_of_another_program(scene_file, tmp_path):
    """Two recorded bodies and a fixed shelf get meshes and colliders of the model, and the cup its contact margin.

    The scene's own group is a pair with the shelf by each of its two members; one pair is ignored by the scene, one
    excluded by the model.
    """
    session = with_scene(recording_without_meshes(), scene_file)
    assert {*session.meshes} == {"shelf", "cup", "rod"}
    assert {*session.colliders} == {"shelf", "cup", "rod"}
    shelf, cup = session.scene.body("shelf"), session.scene.body("cup")
    assert shelf.fixed.position == pytest.approx((1, 3, -2))  # (1, 2, 3) with Z up
    assert cup.fixed is None
    assert cup.extra["margin"] == 0.002
    (group,) = session.scene.groups
    assert group.members == ("cup", "rod")
    assert len(session.scene.pairs) == 2
    ignored = {frozenset(pair) for pair in session.scene.ignore}
    assert ignored == {frozenset(("cup", "shelf")), frozenset(("rod", "shelf"))}


def test_session_file_needs_the_scene_of_another_program_no_more(scene_file, tmp_path):
    """The session with the model's bodies is written and read again, without model and scene."""
    session = with_scene(recording_without_meshes(), scene_file)
    write_session(session, tmp_path / "s.mcap")
    session_of_file = read_session(tmp_path / "s.mcap")
    assert session_of_file.scene.groups == session.scene.groups
    assert {*session_of_file.colliders} == {"shelf", "cup", "rod"}


@pytest.mark.parametrize("convention", ["canonical", "z-up"])
def test_tracked_and_fixed_bodies_agree_in_any_axes(scene_file, tmp_path, convention):
    """The model's cup and shelf have equal boxes; a cup is recorded where the shelf stands, in axes with Z or Y up.

    The corners of both boxes are then at the same places.
    """
    rotation = Rotation.from_euler("x", 90, degrees=True)
    position = np.array([1.0, 2.0, 3.0])
    if convention == "canonical":
        up = Rotation.from_euler("x", -90, degrees=True)
        rotation, position = up * rotation, up.apply(position)
    cells = ",".join(map(repr, [*position.tolist(), *rotation.as_quat().tolist()]))
    (tmp_path / "cup.csv").write_text(f"time_s,cup_x,cup_y,cup_z,cup_qx,cup_qy,cup_qz,cup_qw\n0,{cells}\n1,{cells}\n")
    (tmp_path / "map.toml").write_text(
        'units = "m"\n[time]\ncolumn = "time_s"\nunit = "s"\n[bodies.cup]\nposition = ["cup_x", "cup_y", "cup_z"]\n'
        'quaternion_xyzw = ["cup_qx", "cup_qy", "cup_qz", "cup_qw"]\n'
    )
    session = import_session("csv", tmp_path / "cup.csv", mapping=tmp_path / "map.toml", convention=convention)
    session = with_scene(session, scene_file)
    fixed = session.scene.body("shelf").fixed
    shelf = Rotation.from_quat(fixed.quaternion_xyzw).apply(session.meshes["shelf"].vertices.copy()) + fixed.position
    frames = session.frames
    corners = session.meshes["cup"].vertices.copy()
    cup = Rotation.from_quat(frames.quaternion_xyzw[0, 0]).apply(corners) + frames.position[0, 0]
    assert np.abs(shelf - cup).max() <= 1e-9


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ('[scene]\nfrom = "gone.xml"', "is missing"),
        ('[scene]\nfrom = "../model.xml"', "lies outside"),
        ('[scene]\nfrom = "model.xml"\nsurface = "skin"', "give one of: auto, drawn, colliding"),
        ('[scene]\nroot = ".."', "it has root and no from"),
        ('[scene]\nfrom = "model.xml"\n[[pair]]\nbetween = ["cup", "shelv"]', "no body is 'shelv'"),
    ],
)
def test_unusable_scene_source_is_refused_with_a_single_fault(scene_file, text, refusal):
    """A model is missing or above the folder, a surface unknown, a root without a model, or a body is not in it.

    Reading raises an error, and the check of a scene, which lists all faults, has one.
    """
    scene_file.write_text(text)
    with pytest.raises(SceneError, match=refusal):
        with_scene(recording_without_meshes(), scene_file)
    _scene, _meshes, faults = checked_scene(text, "scene.toml", no_plan_problems, scene_file.parent)
    assert len(faults) == 1


def test_check_resolves_the_named_scene(scene_file):
    """SCENE declares no body and takes all three from model.xml, which lies beside it: nothing is wrong."""
    scene, _meshes, faults = checked_scene(SCENE, "scene.toml", no_plan_problems, scene_file.parent)
    assert faults == []
    assert {body.id for body in scene.bodies} == {"shelf", "cup", "rod"}
