"""Hits are held to closed form: spheres, boxes and planes; and to exact arithmetic on triangles."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.small_worlds import cube

from cdcore.narrow.containment.first_hits import FirstHits, crossing
from replay.effects.effect_summary import happened_words
from replay.effects.recorded import NOTHING, UNSEEN
from replay.outputs.run_tables import effect_table
from replay.pipeline.engine import compute
from sessions import GazeTrack, ScalarTrack, Session, make_shape

STEP = 10_000_000
COUNT = 100


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def exact_hit(triangle, origin, ray):
    """How far along a ray a triangle is crossed, in fractions, by signed volumes; ``None``: not."""
    a, b, c, o, d = ([Fraction(float(x)) for x in p] for p in (*triangle, origin, ray))

    def minus(p, q):
        return [x - y for x, y in zip(p, q, strict=True)]

    def volume(p, q, r):
        return sum(p[i] * (q[(i + 1) % 3] * r[(i + 2) % 3] - q[(i + 2) % 3] * r[(i + 1) % 3]) for i in range(3))

    corners = [minus(p, o) for p in (a, b, c)]
    sides = [volume(d, corners[k], corners[(k + 1) % 3]) for k in range(3)]
    if not (all(s >= 0 for s in sides) or all(s <= 0 for s in sides)) or not sum(sides):
        return None
    along = volume(*corners) / sum(sides)
    return float(along) if along >= 0 else None


def test_the_first_hit_is_that_of_exact_arithmetic_on_every_face():
    rng = np.random.default_rng(1)
    for faces in (1, 5, 40, 200):
        triangles = rng.normal(size=(faces, 1, 3)) + 0.3 * rng.normal(size=(faces, 3, 3))
        origins, rays = 3 * rng.normal(size=(30, 3)), unit(rng.normal(size=(30, 3)))
        found = FirstHits(triangles).distances(origins, rays)
        for got, origin, ray in zip(found, origins, rays, strict=True):
            hits = [hit for one in triangles if (hit := exact_hit(one, origin, ray)) is not None]
            assert got == pytest.approx(min(hits, default=np.inf), rel=1e-9)


def test_no_ray_slips_through_an_edge_or_a_corner_of_a_closed_mesh():
    mesh = make_shape("sphere", {"radius": 1.0}, 500)
    triangles = mesh.vertices[mesh.faces]
    edges = triangles[:, [0, 1, 2]] * 0.25 + triangles[:, [1, 2, 0]] * 0.75
    targets = np.concatenate([mesh.vertices, edges.reshape(-1, 3)])
    length = np.linalg.norm(targets, axis=1)
    assert np.allclose(FirstHits(triangles).distances(np.zeros_like(targets), unit(targets)), length, rtol=1e-9)


def test_a_ray_in_the_plane_of_a_face_or_away_from_it_meets_nothing():
    face = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert crossing(face, np.array([[-1.0, 0.2, 0]]), np.array([[1.0, 0, 0]])).tolist() == [np.inf]
    assert FirstHits(face).distances(np.array([[0.2, 0.2, 1.0]]), np.array([[0.0, 0, 1]])).tolist() == [np.inf]
    assert FirstHits(face).distances(np.array([[0.2, 0.2, 1.0]]), np.array([[0.0, 0, -1]])).tolist() == [1.0]


@pytest.fixture(scope="module")
def world():
    """A turning cube of 0.2 m, a ball that moves sideways behind it, and a headset around the eyes of anna."""
    stamps = 7 * 10**9 + STEP * np.arange(COUNT)
    turns = Rotation.from_euler("y", np.linspace(0, 80, COUNT)[:, None], degrees=True)
    cubes, balls = np.tile([0.0, 1, -1], (COUNT, 1)), np.tile([0.0, 1, -3], (COUNT, 1))
    balls[:, 0] = np.linspace(0.4, -0.4, COUNT)
    head = np.column_stack([0.01 * np.arange(COUNT) / COUNT, np.full(COUNT, 1.02), np.full(COUNT, 0.5)])
    still = np.tile([0.0, 0, 0, 1], (COUNT, 1))
    poses = {"cube": (cubes, turns.as_quat()), "ball": (balls, still), "camera": (head, still)}
    meshes = {"cube": cube(0.2), "ball": make_shape("sphere", {"radius": 0.5}, 20_000), "camera": cube(0.3)}
    aim = np.column_stack([np.linspace(-1, 1, COUNT), np.full(COUNT, 1.0), np.full(COUNT, -3.0)])
    valid = np.arange(COUNT) % 10 != 3
    gaze = {"anna": GazeTrack(stamps, head, unit(aim - head), valid)}
    pulse = ScalarTrack(stamps[::10] + 3, 70 + np.arange(10.0), "1/min")
    late = ScalarTrack(stamps + 10**10, np.zeros(COUNT))
    session = replace(Session.from_arrays(stamps, poses, meshes), gaze=gaze, scalars={"pulse": pulse, "late": late})
    return (
        session,
        compute(session, detectors="exact", oracle="none"),
        (cubes, turns, balls, head, unit(aim - head), valid),
    )


def box_hit(half, origin, ray):
    """First crossing of a box about the origin by the slab method; inf where there is none."""
    with np.errstate(divide="ignore"):
        a, b = (-half - origin) / ray, (half - origin) / ray
    near, far = np.minimum(a, b).max(), np.maximum(a, b).min()
    return near if 0 <= near <= far else np.inf


def ball_hit(radius, origin, ray):
    along = -origin @ ray
    under = radius**2 - (origin @ origin - along**2)
    return along - np.sqrt(under) if under >= 0 and along > 0 else np.inf


def test_what_is_looked_at_first_is_what_closed_form_says(world):
    session, result, (cubes, turns, balls, head, rays, valid) = world
    looked = result.effects["gaze"].output.data["the participant"]
    names = result.assembly.names
    half = session.meshes["cube"].bounds[1]
    seen = {UNSEEN: 0, NOTHING: 0, names.index("cube"): 0, names.index("ball"): 0}
    for k in range(COUNT):
        to_cube = turns[k].inv()
        first = box_hit(half, to_cube.apply(head[k] - cubes[k]), to_cube.apply(rays[k]))
        second = ball_hit(0.5, head[k] - balls[k], rays[k])
        expected = min(first, second)
        word = names.index("cube" if first <= second else "ball") if np.isfinite(expected) else NOTHING
        assert looked.body[k] == (word if valid[k] else UNSEEN), k
        seen[looked.body[k]] += 1
        if valid[k] and np.isfinite(expected):  # the ball has 20,000 faces
            assert looked.distance[k] == pytest.approx(expected, abs=1e-9 if first <= second else 2e-3)
        else:
            assert looked.distance[k] == np.inf
    assert min(seen.values()) > 3 and looked.worn == ("camera",)


def test_lanes_and_seconds_add_up_and_the_sentence_says_them(world):
    _, result, _ = world
    output = result.effects["gaze"].output
    looked, lanes, (event,) = output.data["the participant"], output.lanes["the participant"], output.events
    names = result.assembly.names
    for word in ("cube", "ball"):
        shown = sum(span.end - span.start for span in lanes if span.word == word)
        assert shown == pytest.approx(0.01 * (looked.body == names.index(word)).sum(), abs=1e-9)
        assert event.values[word] == pytest.approx(shown, abs=1e-9)
    assert sum(event.values.values()) == pytest.approx(1.0)
    assert event.values["(eyes not seen)"] == pytest.approx(0.1)
    seen = sorted((row for row in event.values.items() if row[0] != "(eyes not seen)"), key=lambda row: -row[1])
    parts = [f"{word} {time:.1f} s" for word, time in seen]
    unseen = "the eyes of the participant were not seen for 0.1 s; looked through what is worn: camera"
    assert event.text == f"the participant looked at {', '.join(parts)}; {unseen}" and "nothing" in event.text
    assert happened_words(result.effects, 9) == [f"0.0 s: {event.text}"]


def test_numbers_come_with_the_time_of_the_session_and_those_of_another_time_do_not(world):
    _, result, _ = world
    assert list(result.effects) == ["scalars", "gaze"]
    (pulse,) = result.effects["scalars"].series.values()
    assert pulse.unit == "1/min" and pulse.values.tolist() == [70.0 + k for k in range(10)]
    assert np.allclose(pulse.times, 0.1 * np.arange(10) + 3e-9)
    assert np.nanmax(result.effects["gaze"].series["the participant/distance"].values) < 4


def test_the_table_says_how_many_curves_there_are(world):
    _, result, _ = world
    found = {row[0]: row[1:] for row in effect_table(result).only("effect", "because", "found").rows}
    assert found == {"scalars": ("it was recorded", "1 curve"), "gaze": ("it was recorded", "looked-at: 1")}


def test_a_window_cuts_them_and_a_recording_without_has_none(world):
    session, _, _ = world
    part = compute(session, detectors=(), start=0.2, end=0.49)
    assert part.effects["scalars"].series["pulse"].values.tolist() == [72.0, 73.0, 74.0]
    assert len(part.effects["gaze"].output.data["the participant"].times) == 30
    assert compute(replace(session, gaze={}, scalars={}), detectors=()).effects == {}


def test_a_body_is_not_met_where_it_has_no_pose_and_nothing_is_asked_far_from_a_frame():
    stamps = STEP * np.array([0, 1, 2, 30, 31])
    poses = {"a": (np.tile([0.0, 0, -1], (5, 1)), np.tile([0.0, 0, 0, 1], (5, 1)))}
    poses["a"][1][2] = np.nan
    times = STEP * np.array([0, 2, 15, 31])
    gaze = GazeTrack(times, np.zeros((4, 3)), np.tile([0.0, 0, -1], (4, 1)))
    session = replace(Session.from_arrays(stamps, poses, {"a": cube(0.2)}), gaze={"b": gaze})
    looked = (
        compute(session, detectors=(), policy={"not-finite": "drop"}).effects["gaze"].output.data["the participant"]
    )
    assert looked.body.tolist() == [0, NOTHING, UNSEEN, 0]
    assert looked.lasting.tolist() == pytest.approx([0.02, 0.1, 0.1, 0.1])


@pytest.mark.parametrize(
    ("ahead", "seen", "words"),
    [
        ([-1.0, -1.0], [True, True], "the participant looked at a 0.2 s"),
        ([1.0], [True], "the participant looked at nothing 0.1 s"),
        ([-1.0, 1.0], [True, True], "the participant looked at a 0.1 s, nothing 0.1 s"),
        ([-1.0, 1.0], [False, False], "the eyes of the participant were not seen for 0.2 s"),
        ([-1.0, 1.0], [False, True],
         "the participant looked at nothing 0.1 s; the eyes of the participant were not seen for 0.1 s"),
    ],
)  # fmt: skip
def test_the_sentence_names_what_there_is_and_no_more(ahead, seen, words):
    poses = {"a": (np.tile([0.0, 0, -1], (11, 1)), np.tile([0.0, 0, 0, 1], (11, 1)))}
    rays = np.array([[0.0, 0.0, z] for z in ahead])
    gaze = GazeTrack(10 * STEP * np.arange(len(ahead)), 0 * rays, rays, seen)
    session = replace(Session.from_arrays(STEP * np.arange(11), poses, {"a": cube(0.2)}), gaze={"b": gaze})
    (event,) = compute(session, detectors=()).effects["gaze"].events
    assert event.text == words
