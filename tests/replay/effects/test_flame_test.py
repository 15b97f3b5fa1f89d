import numpy as np
import pytest
from support.liquid_worlds import glass, poses_at_rest, session_with_effects

from replay.engine import compute
from sessions.model.scene import SceneBody

FLAME_TEST = {
    "flame": "lamp", "base": [0.0, 0.1, 0.0], "flame_radius": 0.01, "flame_height": 0.05, "wire": "wire",
    "tip": [0.0, -0.1, 0.0], "seconds": 1.0, "colours": {"NaCl": "yellow"}, "vessels": ["b"], "dips": {"b": "NaCl"},
}  # fmt: skip
AWAY, DIP, FLAME = (1.0, 1.0, 0.0), (0.5, 0.005, 0.0), (0.0, 0.11, 0.0)
"""Where the tip of the wire is: in the air, in the salt solution of vessel b, in the flame of the lamp."""
STEP_S = 0.05


def flame_test_of(points, valid=None):
    """The effect of a run in which the wire's tip is at these places, 50 ms each; ``valid``: frames with a pose."""
    wire = np.asarray(points, dtype=np.float64) + np.array([0.0, 0.1, 0.0])
    count = len(wire)
    poses = {
        "wire": (wire, poses_at_rest(count)[1]),
        "lamp": poses_at_rest(count),
        "b": poses_at_rest(count, (0.5, 0.0, 0.0)),
    }
    bodies = (SceneBody("wire"), SceneBody("lamp"), glass("b", volume_ml=20.0, solute="NaCl", molar=1.0))
    session = session_with_effects(poses, bodies, ("flame-test", FLAME_TEST), valid={"wire": valid}, step_ns=50_000_000)
    return compute(session).effects["flame-test"]


def dip_then_flame(frames, before=DIP):
    """Places of a tip that is dipped for 4 frames, and then is in the flame, which starts at frame 10."""
    return [AWAY] * 3 + [before] * 4 + [AWAY] * 3 + [FLAME] * frames + [AWAY] * 3


def test_a_salt_that_stays_shows_its_colour():
    """The tip is in the salt solution of vessel b in frames 3 to 6, and later in the flame for 20 frames of 50 ms.

    A dip ends at the first frame after it; the effect runs only in frames with the tip in the salt or in the flame.
    """
    run = flame_test_of(dip_then_flame(frames=20))
    dip, flame = run.events
    assert dip.name == "dip" and dip.values["salt"] == "NaCl"
    assert (dip.time, dip.end) == pytest.approx((3 * STEP_S, 7 * STEP_S))
    assert flame.bodies == ("wire", "lamp") and flame.message == "NaCl is in the flame for 1.0 s: yellow"
    assert [span.word for span in run.output.lanes["wire"]] == ["in b", "yellow"]
    assert run.frames_run == 4 + 20


POSES_LOST_IN_FLAME = np.ones(len(dip_then_flame(frames=30)), dtype=bool)
"""No pose is known in five of the thirty frames in the flame."""
POSES_LOST_IN_FLAME[15:20] = False


@pytest.mark.parametrize(
    ("points", "valid", "visits"),
    [
        (dip_then_flame(frames=19), None, [("NaCl", "", 19 * STEP_S)]),
        (dip_then_flame(frames=30, before=AWAY), None, [("", "", 30 * STEP_S)]),
        (dip_then_flame(frames=1), None, []),
        (dip_then_flame(frames=30), POSES_LOST_IN_FLAME, [("NaCl", "yellow", 30 * STEP_S)]),
    ],
    ids=["shorter than 1 s", "clean wire", "one frame is noise", "a loss of poses ends no visit"],
)
def test_wire_in_the_flame_for_1_s_shows_its_salt(points, valid, visits):
    """A visit is (salt on the wire, colour seen, seconds in the flame); a frame is 50 ms, and sodium burns yellow.

    Before it the tip is in salt solution, but for the clean wire, which stays in the air until it is in the flame.
    """
    events = [event.values for event in flame_test_of(points, valid).output.events_named("flame")]
    assert [(event["salt"], event["seen"], pytest.approx(event["seconds"])) for event in events] == visits


LIQUID_LEVEL = 20e-6 / (np.pi * 0.02**2)


@pytest.mark.parametrize(
    ("point", "inside"),
    [((0.0099, 0.1, 0.0), True), ((0.0101, 0.1, 0.0), False), ((0.0, 0.149, 0.0), True), ((0.0, 0.151, 0.0), False),
     ((0.0051, 0.125, 0.0), False), ((0.0049, 0.125, 0.0), True), ((0.0, 0.0999, 0.0), False),
     ((0.5, LIQUID_LEVEL + 1e-4, 0.0), False), ((0.5, LIQUID_LEVEL - 1e-4, 0.0), True), ((0.53, 0.005, 0.0), False)],
)  # fmt: skip
def test_wire_tip_counts_inside_flame_cone_and_below_liquid_level(point, inside):
    """The tip is at a point (x, y, z in metres) for 5 frames: a visit to flame or salt is reported where it is inside.

    The flame is a cone of 1 cm radius at y = 0.1 that ends at y = 0.15, so of 5 mm radius at y = 0.125. The glass of
    salt solution, 2 cm in radius, stands at x = 0.5; LIQUID_LEVEL is the height of its 20 mL.
    """
    assert bool(flame_test_of([AWAY] * 3 + [point] * 5 + [AWAY] * 3).events) == inside
