import hashlib
import itertools
import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from sessions.glassware.catalogue import made_instrument
from sessions.mcap_format.reader import read_session
from sessions.mcap_format.writer import write_session
from sessions.scene_files.scene_meshes import scene_meshes
from sessions.synthetic.experiments.pouring import GRAVITY, Outlet, Turn, tilt_keeping
from sessions.synthetic.experiments.practice import make_practice
from sessions.synthetic.scenes import SCENES, make_scene_session
from sessions.synthetic.truth import truth_path, write_truth

TURNS = (Turn(2.0, 3.0, 0.0, 0.7), Turn(40.0, 41.5, 0.7, 0.12), Turn(80.0, 80.5, 0.12, 0.0))
OUTLET = Outlet(6e-7, 0.6, 9.5e-5, 0.67, TURNS)


@pytest.mark.parametrize(
    ("name", "fill", "onset"), [("beaker_50", 40, 48.7), ("beaker_100", 80, 40.2), ("beaker_250", 120, 57.1)]
)
def test_the_tilt_that_keeps_a_volume_keeps_it(name, fill, onset, counted):
    """Onsets and volumes by two other routes: slices of the finest mesh, and points counted."""
    cavity = made_instrument(name, 3000).cavity
    tilt = tilt_keeping(cavity, fill)
    assert math.degrees(tilt) == pytest.approx(onset, abs=0.1)
    down = np.array([[math.sin(tilt), -math.cos(tilt), 0.0]])
    assert counted(cavity, down)[0] == pytest.approx(fill, rel=0.005)
    with pytest.raises(ValueError, match="cannot keep"):
        tilt_keeping(cavity, 10 * fill)


def flow(times):
    """Delivered volume by adding up Torricelli's law in small steps."""
    head, delivered = OUTLET.head, [0.0]
    for a, b in itertools.pairwise(times):
        middle = 0.5 * (a + b)
        angle = next((turn.angle(middle) for turn in reversed(TURNS) if middle >= turn.start), 0.0)
        area = OUTLET.full_area * angle / (math.pi / 2.0)
        step = OUTLET.discharge * area * math.sqrt(2.0 * GRAVITY * head) * (b - a)
        head -= step / OUTLET.section
        delivered.append(delivered[-1] + step)
    return np.array(delivered)


def test_the_volume_is_what_torricelli_adds_up_to():
    times = np.linspace(0.0, 100.0, 100_001)
    summed = flow(times)
    for k in (0, 1500, 2500, 20_000, 40_700, 60_000, 80_200, 100_000):
        assert OUTLET.volume(float(times[k])) == pytest.approx(summed[k], rel=1e-4, abs=1e-12)


def test_the_time_of_a_volume_is_the_inverse():
    for volume in (1e-6, 2e-5, 2.3e-5):
        assert OUTLET.volume(OUTLET.time_of(volume, 90.0)) == pytest.approx(volume, rel=1e-12)
    with pytest.raises(ValueError, match="open it more"):
        OUTLET.time_of(1.0, 90.0)


EXPERIMENTS = [name for name in SCENES if name != "bench-bumps"]


@pytest.fixture(params=EXPERIMENTS)
def one(request, made):
    return made(request.param)


POSES = {
    "bench-bumps": ("2", "c8ba035c697ebf7f"),
    "titration": ("1", "ab10751bf2660258"),
    "silver-chloride": ("2", "6c212d14996e5b30"),
    "acid-dilution": ("2", "36504a2100cd2af2"),
    "gas-collection": ("2", "e3dfb95b930e7d76"),
    "copper-sulfate": ("1", "85871ba078afbd8c"),
    "flame-test": ("1", "8bb93e510f4936d5"),
    "carbonate-titration": ("1", "ae8f6aacee7c353b"),
    "marble": ("1", "aeb20a14ac783199"),
    "ammonia-calorimetry": ("1", "7ae2cc68bde125b0"),
}
"""Scene -> version of its choreography, and the hash of its poses to 10 um. Other poses need another version."""


@pytest.mark.parametrize("name", SCENES)
def test_the_poses_of_a_scene_are_those_of_its_version(name, made):
    session = made(name).session
    frames = session.frames
    poses = (np.round(values, 5) + 0.0 for values in (frames.position, frames.quaternion_xyzw))
    assert (session.facts["choreography"], hashlib.sha256(b"".join(map(bytes, poses))).hexdigest()[:16]) == POSES[name]


def test_grasps_are_pressed_before_the_thing_moves_and_it_rides_till_it_is_let_go(one):
    assert one.facts("hold")
    for hold in one.facts("hold"):
        (hand,) = (body for body in hold.bodies if body.startswith("hand-"))
        (thing,) = set(hold.bodies) - {hand}
        trigger = one.session.hands[f"student/{hand.removeprefix('hand-')}"].trigger
        held = one.near(hold.start, hold.end - 1e-9)
        assert trigger[held][1:-1].min() > 0.4
        edges = np.flatnonzero((trigger[1:] > 0.6) & (trigger[:-1] <= 0.6)) + 1
        assert np.abs(one.times[edges] - hold.start).min() < 0.03
        before = one.near(hold.start - 0.5, hold.start - 1e-9)
        assert (np.diff(one.pose(thing)[0][before], axis=0) == 0.0).all()
        rides = one.within(hand, one.pose(thing)[0])[held]
        np.testing.assert_allclose(rides, np.broadcast_to(rides[0], rides.shape), atol=1e-9)


def test_the_same_seed_gives_the_same_bytes_of_session_and_truth(tmp_path, made):
    fresh = make_scene_session("silver-chloride", seed=0, noise="vive", faces=600)
    kept = made("silver-chloride", "vive")
    files = []
    for number, (session, truth) in enumerate((fresh, (kept.session, kept.truth))):
        session_file = tmp_path / f"silver{number}.mcap"
        write_session(session, session_file)
        write_truth(truth, truth_path(session_file))
        files.append((session_file.read_bytes(), truth_path(session_file).read_bytes()))
    assert files[0] == files[1]
    again = read_session(tmp_path / "silver0.mcap")
    np.testing.assert_array_equal(again.frames.position, kept.session.frames.position)
    assert again.intervals and again.hands.keys() == kept.session.hands.keys()


def test_scenes_declare_effects_and_their_text_makes_the_same_meshes(one):
    held = tomllib.loads(one.session.scene.text)
    assert len(held["effect"]) >= 4
    # Hands and headset take seconds to make and are the same in every scene.
    bodies = tuple(body for body in one.session.scene.bodies if not body.instrument.startswith(("hand", "proxy")))
    again = scene_meshes(replace(one.session.scene, bodies=bodies))
    assert len(again) == len(one.session.meshes) - 3
    assert all((one.session.meshes[name].vertices == mesh.vertices).all() for name, mesh in again.items())


def test_a_session_holds_the_touches_and_near_misses_that_were_asked_for():
    session, truth = make_practice((0.02, 0.25), 3, pseudonym="S09", seed=2, noise="off")
    lengths = [episode.nominal[1] - episode.nominal[0] for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose(lengths, [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3
    assert session.facts["pseudonym"] == "S09"
