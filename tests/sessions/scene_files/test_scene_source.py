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
name = "held"
members = ["cup", "rod"]
[[pair]]
between = ["held", "shelf"]
[[ignore]]
between = ["rod", "shelf"]
"""


@pytest.fixture
def scene_file(tmp_path):
    """The file scene.toml, beside the model it takes its bodies from."""
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
    """MuJoCo's shelf at (1, 2, 3), turned by 90 degrees about x, in the world of a recording with such axes.

    The axes of ROS and z-up turn world and bodies alike; beside OpenXR's Y up only the world of the model is turned.
    """
    facts = {ASSUMPTIONS_FACT: assumptions_fact([Assumption(Subject.POSE_AXES, axes, Origin.USER)])}
    session = with_scene(replace(recording_without_meshes(), facts=facts), scene_file)
    world = CONVENTIONS["z-up" if axes == "openxr" else axes].matrix
    fixed = session.scene.body("shelf").fixed
    assert fixed.position == pytest.approx(tuple(world @ [1.0, 2.0, 3.0]))
    own = np.eye(3) if axes == "openxr" else world
    rotation = Rotation.from_quat(fixed.quaternion_xyzw).as_matrix()
    expected = world @ Rotation.from_euler("x", 90, degrees=True).as_matrix() @ own.T
    np.testing.assert_allclose(rotation, expected, atol=1e-12)


def test_surfaces_that_were_guessed_are_assumptions(scene_file):
    """The cup gets a geom that is drawn and one that collides; read once or twice, "drawn" is one guess."""
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
    """Two recorded bodies and a fixed shelf get meshes and colliders of the model, whose excluded pair is ignored too.

    Written and read again, the session has them without the model.
    """
    session = with_scene(recording_without_meshes(), scene_file)
    assert {*session.meshes} == {*session.colliders} == {"shelf", "cup", "rod"}
    assert session.scene.body("shelf").fixed.position == pytest.approx((1, 3, -2))
    assert session.scene.body("cup").fixed is None and session.scene.body("cup").extra["margin"] == 0.002
    assert session.scene.groups[0].members == ("cup", "rod") and len(session.scene.pairs) == 2
    assert {frozenset(pair) for pair in session.scene.ignore} == {
        frozenset(("cup", "shelf")),
        frozenset(("rod", "shelf")),
    }
    # The file of the recording needs that scene no more.
    write_session(session, tmp_path / "s.mcap")
    kept = read_session(tmp_path / "s.mcap")
    assert kept.scene.groups == session.scene.groups and {*kept.colliders} == {*session.colliders}


@pytest.mark.parametrize("convention", ["canonical", "z-up"])
def test_tracked_and_fixed_bodies_agree_in_any_axes(scene_file, tmp_path, convention):
    """A cup recorded where the shelf stands, in the scene's own axes or in +Y up, has the same corners as the shelf."""
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
    """A missing model, one above the folder, an unknown surface, a root without a model, and a body that it lacks."""
    scene_file.write_text(text)
    with pytest.raises(SceneError, match=refusal):
        with_scene(recording_without_meshes(), scene_file)
    faults = checked_scene(text, "scene.toml", no_plan_problems, scene_file.parent)[2]
    assert len(faults) == 1


def test_check_resolves_the_named_scene(scene_file):
    """SCENE declares no body and takes all three from model.xml, which lies beside it."""
    checked, _, faults = checked_scene(SCENE, "scene.toml", no_plan_problems, scene_file.parent)
    assert not faults and {body.id for body in checked.bodies} == {"shelf", "cup", "rod"}
