import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.effects.hazard_proximity import surface_points
from replay.engine import compute
from sessions import Session
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody, SceneEffect

NEAR, LEAVE = 0.2, 0.05
CUBES = (cube(), cube())


def visit_of_hand(points, rotation=(0.0, 0.0, 0.0, 1.0), height=0.0, meshes=CUBES, **more):
    """The effect on a hand at these x, ``height`` m up, beside a lamp at 0; a frame is 10 ms.

    Both are unit cubes unless given, so that their distance is x - 1 m. ``more``: keys of the effect.
    """
    settings = {"of": ["hand"], "hazard": "lamp", "distance": NEAR, "leave_by": LEAVE, **more}
    scene = Scene(bodies=(SceneBody("hand"), SceneBody("lamp")), effects=(SceneEffect("hazard-proximity", settings),))
    poses = {"hand": along_x(points, rotation), "lamp": along_x([0.0] * len(points))}
    poses["hand"][0][:, 1] = height
    stamps = np.arange(len(points)) * 10_000_000
    result = compute(Session.from_arrays(stamps, poses, dict(zip(poses, meshes, strict=True)), scene))
    assert not result.detections and len(result.assembly.pairs) == 0
    return result.effects["hazard-proximity"]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_near_ends_beyond_the_distance_by_the_hysteresis(side):
    """A hand, a cube of 2 cm, is near a lamp, a cube of 1 m, within 0.2 m, and away again only above 0.25 m.

    Frames are 10 ms: it is near from frame 2 (0.19 m) until frame 7 (0.26 m), also at 0.22 and 0.24 m between them.
    ``side``: whether it comes from +X or -X.
    """
    distances = np.array([2.0, 0.3, 0.19, 0.1, 0.22, 0.19, 0.24, 0.26, 2.0])
    half_of_lamp_and_hand = 0.5 + 0.01
    (event,) = visit_of_hand(side * (distances + half_of_lamp_and_hand), meshes=(cube(edge=0.02), cube())).events
    assert (event.time, event.end) == pytest.approx((0.02, 0.07))
    assert event.values["seconds"] == pytest.approx(0.07 - 0.02)
    assert event.values["least_m"] == pytest.approx(distances.min())


def test_far_away_only_balls_are_tested():
    """Unit cubes with centres 3 m apart: the balls around them decide that they are more than 0.2 m apart.

    In the only frame in which they are 0.1 m apart (1.1 m from centre to centre) every surface point is tested.
    """
    for far in (visit_of_hand([3.0] * 50), visit_of_hand([-3.0] * 50)):
        assert far.frames_run == 0 and far.counters == {"vertex tests": 0} and far.series == {}
    assert visit_of_hand([3.0, 1.1, 3.0]).counters["vertex tests"] == len(surface_points(cube()))


BOARD = MeshData(np.asarray(cube(edge=0.8).vertices) * [1.0, 0.02, 1.0], cube(edge=0.8).faces)


@pytest.mark.parametrize(
    ("more", "metres"),
    [
        # Turned by 45 degrees about Y, the hand's edge is root 0.5 from its centre; the lamp's face is at x = 0.5.
        ({"points": [1.3] * 2, "rotation": (0.0, np.sin(np.pi / 8), 0.0, np.cos(np.pi / 8))},
         1.3 - 0.5 - np.sqrt(0.5)),
        # The lamp's top is at y = 0.5, the flame's at 3.5; the hand's faces are 0.5 over and under its centre.
        ({"points": [0.0] * 2, "height": 4.1, "above": 3.0}, 4.1 - 0.5 - 3.5),
        ({"points": [0.0] * 2, "height": 3.2, "above": 3.0}, 0.0),
        ({"points": [0.0] * 2, "height": -1.1, "above": 3.0}, 1.1 - 0.5 - 0.5),
        # A board of 0.8 m, 16 mm thick, lies 5 mm over a lamp of 80 mm: its corners are 0.5 m away.
        ({"points": [0.0] * 2, "height": 0.053, "meshes": (BOARD, cube(edge=0.08))}, 0.053 - 0.008 - 0.04),
    ],
    ids=["turned", "over a flame", "in a flame above the mesh", "below the lamp", "board"],
)  # fmt: skip
def test_distance_is_from_rotated_surface_to_hazard_and_flame(more, metres):
    """The hand is a unit cube beside or over the lamp, a unit cube about the origin, in two frames.

    ``points``, ``height``: x and y of its centre; ``above``: metres that a flame reaches over the lamp's top.
    """
    assert visit_of_hand(**more).series["hand-lamp/distance"].values == pytest.approx([metres] * 2, abs=1e-6)


def test_large_faces_get_each_point_of_their_grid_once():
    """A cube of 10 cm about (3, 3, 3); a face is cut so that no edge of its triangles is longer than 2 cm.

    Its diagonal of 14.1 cm needs 8 pieces, so a face has 9 times 9 points.
    """
    box = cube(edge=0.1)
    points = surface_points(MeshData(np.asarray(box.vertices) + 3.0, box.faces))
    assert len(points) == 6 * 9**2 - 12 * 9 + 8, "a point of an edge counts for two faces, of a corner for three"
    assert points.min() == pytest.approx(2.95) and points.max() == pytest.approx(3.05)
