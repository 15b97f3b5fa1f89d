import numpy as np
import pytest
from support.liquid_worlds import glass, still, world

from replay.engine import compute
from sessions.model.scene import SceneBody

TEST = {
    "flame": "lamp", "base": [0.0, 0.1, 0.0], "flame_radius": 0.01, "flame_height": 0.05, "wire": "wire",
    "tip": [0.0, -0.1, 0.0], "seconds": 1.0, "colours": {"NaCl": "yellow"}, "vessels": ["b"], "dips": {"b": "NaCl"},
}  # fmt: skip
AWAY, DIP, FLAME = (1.0, 1.0, 0.0), (0.5, 0.005, 0.0), (0.0, 0.11, 0.0)


def run(points, valid=None):
    """The wire's tip is at these places, 50 ms each."""
    wire = np.asarray(points, dtype=np.float64) + np.array([0.0, 0.1, 0.0])
    count = len(wire)
    poses = {"wire": (wire, still(count)[1]), "lamp": still(count), "b": still(count, (0.5, 0.0, 0.0))}
    bodies = (SceneBody("wire"), SceneBody("lamp"), glass("b", 20.0, solute="NaCl", molar=1.0))
    session = world(poses, bodies, ("flame-test", TEST), valid={"wire": valid}, step_ns=50_000_000)
    return compute(session).effects["flame-test"]


def visit(frames, before=DIP):
    return [AWAY] * 3 + [before] * 4 + [AWAY] * 3 + [FLAME] * frames + [AWAY] * 3


def test_a_salt_that_stays_shows_its_colour():
    run_ = run(visit(20))
    dip, flame = run_.events
    assert (dip.name, dip.values["salt"]) == ("dip", "NaCl") and (dip.time, dip.end) == pytest.approx((0.15, 0.35))
    assert flame.bodies == ("wire", "lamp") and flame.message == "NaCl is in the flame for 1.0 s: yellow"
    assert [span.word for span in run_.output.lanes["wire"]] == ["in b", "yellow"] and run_.frames_run == 24


LOST = np.ones(len(visit(30)), dtype=bool)
LOST[15:20] = False


@pytest.mark.parametrize(
    ("points", "valid", "visits"),
    [
        (visit(19), None, [("NaCl", "", 0.95)]),
        (visit(30, AWAY), None, [("", "", 1.5)]),
        (visit(1), None, []),
        (visit(30), LOST, [("NaCl", "yellow", 1.5)]),
    ],
    ids=["too short", "clean wire", "one frame is noise", "a loss ends no visit"],
)
def test_a_lasting_visit_shows_the_salt_on_the_wire(points, valid, visits):
    events = [event.values for event in run(points, valid).output.events_named("flame")]
    assert [(visit["salt"], visit["seen"], pytest.approx(visit["seconds"])) for visit in events] == visits


LEVEL = 20e-6 / (np.pi * 0.02**2)


@pytest.mark.parametrize(
    ("point", "inside"),
    [((0.0099, 0.1, 0.0), True), ((0.0101, 0.1, 0.0), False), ((0.0, 0.149, 0.0), True), ((0.0, 0.151, 0.0), False),
     ((0.0051, 0.125, 0.0), False), ((0.0049, 0.125, 0.0), True), ((0.0, 0.0999, 0.0), False),
     ((0.5, LEVEL + 1e-4, 0.0), False), ((0.5, LEVEL - 1e-4, 0.0), True), ((0.53, 0.005, 0.0), False)],
)  # fmt: skip
def test_wire_tip_counts_inside_flame_cone_and_below_liquid_level(point, inside):
    """The flame is 1 cm in radius at y = 0.1 and ends at 0.15; the liquid reaches up to LEVEL, 2 cm about x = 0.5."""
    assert bool(run([AWAY] * 3 + [point] * 5 + [AWAY] * 3).events) == inside
