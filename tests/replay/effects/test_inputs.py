import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.effects.inputs import HANDS, BodyPoses, EffectInputs
from replay.effects.output import EffectOutput
from replay.errors import EffectError
from replay.prepare.assemble import assemble
from sessions import Session
from sessions.model.scene import Scene, SceneBody
from sessions.model.track import HandTrack

QUARTER = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))
"""A quarter turn about Z: +Y goes to -X."""


def inputs(**more):
    poses = {"cup": along_x([0, 1, 2], QUARTER), "hand_left": along_x([5, 5, 6])}
    scene = Scene(bodies=(SceneBody("cup"), SceneBody("hand_left"), SceneBody("lost")))
    session = Session.from_arrays([0, 10**7, 2 * 10**7], poses, {name: cube() for name in poses}, scene)
    hands = {f"{who}/{side}": HandTrack([0, 10**7]) for who in ("ann", "bob") for side in ("left", "right")}
    object.__setattr__(session, "hands", hands)
    given = {"declared": (), "pairs": (), "known_bodies": frozenset(("cup", "hand_left", "lost")), **more}
    return EffectInputs(kind="pour", session=session, assembly=assemble(session), **given)


def test_a_point_of_a_body_follows_its_pose():
    cup = inputs().poses("cup")
    assert np.allclose(cup.point((0.0, 2.0, 0.0)), [[-2, 0, 0], [-1, 0, 0], [0, 0, 0]])


def test_a_frame_without_a_pose_gives_no_number():
    cup = inputs().poses("cup")
    lost = BodyPoses(cup.times, cup.translation, cup.rotation, np.array([True, False, True]), cup.linked)
    assert np.isnan(lost.point((0, 0, 0)))[:, 0].tolist() == [False, True, False]


def test_what_the_spec_does_not_name_cannot_be_had():
    given = inputs()
    for ask, said in (
        (lambda: given.poses("flask"), "which no declared effect names"),
        (lambda: given.poses("lost"), "has no mesh or was not recorded"),
        (lambda: given.output("contact"), "name it in `needs`"),
        (lambda: given.hand_of("hand_left"), "name '/hands' in `reads`"),
        (lambda: given.contact(("cup", "lost")), "name a `detector`"),
        (lambda: given.mesh("flask"), "which no declared effect names"),
    ):
        with pytest.raises(EffectError, match=said):
            ask()


def test_a_hand_is_found_by_the_words_of_its_body_and_counted_as_decoded():
    given = inputs(reads=(HANDS,))
    assert given.hand_of("hand_left") is given.session.hands["ann/left"]
    assert given.counters == {"decoded /hands/ann/left": 1}
    assert given.hand_of("cup") is None


def test_outputs_of_needed_effects_clock_mesh_and_declaration_are_there():
    given = inputs(outputs={"contact": EffectOutput()})
    assert given.output("contact").events == ()
    assert len(given) == 3 and given.times.tolist() == [0.0, 0.01, 0.02]
    assert given.body("cup").id == "cup" and len(given.mesh("cup").vertices) == 8
