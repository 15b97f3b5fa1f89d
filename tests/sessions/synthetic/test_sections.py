import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.looks import looks, predicted

from sessions.geometry.rotations import IDENTITY, quaternion_about
from sessions.geometry.solids import box, pointed_ball, prism
from sessions.glassware.catalogue import make_instrument
from sessions.synthetic.assembly import CLOCKS, stamps
from sessions.synthetic.rng import random_stream
from sessions.synthetic.sections import _Posed, approach, inscribed_radius, round_in_round
from sessions.synthetic.truth import PlantedEpisode, Truth

TURN = quaternion_about((0.0, 1.0, 0.0), np.radians(45.0))


def level_section(mesh, height):
    return _Posed(mesh.vertices, mesh.faces).section(height)


def test_the_inscribed_radius_of_a_polygon_is_its_inradius():
    points = level_section(prism(12, 0.05, 1.0), 0.1)
    assert inscribed_radius(points) == pytest.approx(0.05 * np.cos(np.pi / 12), rel=1e-6)
    assert inscribed_radius(points[:2]) == 0.0
    assert inscribed_radius(np.zeros((5, 3))) == 0.0
    assert inscribed_radius(points + np.array([1.0, 0.0, 0.0])) == 0.0


def test_a_cube_corner_meets_a_prism_between_the_bounds():
    cube, post = box((0.1, 0.1, 0.1)), prism(64, 0.03, 0.5)
    meets = approach(cube, TURN, post, (0.0, 0.0, -1.0), 0.05)
    corner = 0.05 * np.sqrt(2.0)
    assert meets.sure <= corner + 0.03 <= meets.possible + 1e-9
    assert meets.slack < 0.0001
    assert abs(meets.aside) < 1e-9


def test_the_foremost_point_is_brought_onto_the_line():
    wedge = box((0.1, 0.1, 0.1))
    meets = approach(wedge, quaternion_about((0.0, 1.0, 0.0), 0.2), prism(64, 0.03, 0.5), (1.0, 0.0, 0.0), 0.0)
    place = meets.place((0.0, 0.0, 0.0), 0.0)
    corners = np.array([[x, z] for x in (-0.05, 0.05) for z in (-0.05, 0.05)])
    turned = corners @ np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]) + place[[0, 2]]
    assert turned[turned[:, 0].argmax(), 1] == pytest.approx(0.0, abs=1e-9)


def test_a_ball_meets_a_ball_where_their_heights_say():
    ball, other = pointed_ball(0.05, 4), pointed_ball(0.03, 4)
    meets = approach(ball, IDENTITY, other, (1.0, 0.0, 0.0), 0.04)
    # Centres 0.04 apart in height: level distance sqrt(0.08^2 - 0.04^2), less what facets cut off.
    truth = np.sqrt(0.08**2 - 0.04**2)
    assert meets.sure < truth < meets.possible + 0.0005
    assert meets.sure > truth - 0.002


def test_a_rod_meets_the_wall_of_a_beaker_from_within_between_the_bounds():
    rod, beaker = make_instrument("stirring_rod", 3000), make_instrument("beaker_250", 3000)
    sure, possible = round_in_round(rod.mesh, beaker.mesh, 0.02)
    nominal = 0.035 - beaker.wall.thickness - 0.003
    assert possible < nominal < sure
    assert sure - possible < 0.0007


def test_a_prism_in_a_ring_gives_the_difference_of_their_radii():
    sure, possible = round_in_round(prism(12, 0.01, 0.4), prism(64, 0.06, 0.1, hole=0.05), 0.0)
    assert possible == pytest.approx(0.05 - 0.01, rel=0.01)
    assert sure == pytest.approx(0.05 / np.cos(np.pi / 64) - 0.01 * np.cos(np.pi / 12), rel=1e-6)


@given(st.integers(0, 1000), st.floats(1.0, 200.0))
def test_each_look_is_the_first_frame_at_or_after_its_tick(seed, rate):
    times = stamps(3.0, 90.0, CLOCKS["browser"], np.random.default_rng(seed))
    plain = []
    tick = 0
    while (due := tick * 1e9 / rate) <= times[-1]:
        plain.append(int(np.argmax(times >= int(due) - 1)))
        tick += 1
    assert sorted(set(plain)) == looks(times, rate).tolist()


def episode(start, end, slack=0.0):
    sure = (start + slack, end - slack)
    return PlantedEpisode(("a", "b"), "contact", (start, end), sure, (start - slack, end + slack))


def fates(*episodes):
    answer = predicted(Truth("t", 0, 0, 10.0, "off", tuple(episodes)), (np.arange(900) * 1e9 / 90).astype(int), 22.5)
    return {name: len(found) for name, found in vars(answer).items() if found}


def test_episodes_between_looks_are_missed_and_between_frames_unseen():
    frame = 1.0 / 90.0
    assert fates(episode(3.9 * frame, 4.1 * frame)) == {"caught": 1}
    assert fates(episode(4.1 * frame, 7.9 * frame)) == {"missed": 1}
    assert fates(episode(4.1 * frame, 4.9 * frame)) == {"unseen": 1}
    assert fates(episode(4.05 * frame, 7.9 * frame, slack=0.1 * frame)) == {"undecided": 1}


def test_every_part_of_the_key_counts():
    keys = [
        random_stream(1, "noise", "a"), random_stream(2, "noise", "a"), random_stream(1, "loss", "a"),
        random_stream(1, "noise", "b"), random_stream(1, "noise"), random_stream(1, "noise", "a", stamp_ns=1),
        random_stream(1, "noise", "a", restart=1),
    ]  # fmt: skip
    assert len({stream.random() for stream in keys}) == len(keys)


def test_the_stream_of_a_known_key_stays_what_it_is():
    # The digest of '[0, "clock", [], 0, 0]' as a little-endian integer seeds PCG64, whose bits NumPy keeps.
    assert random_stream(0, "clock").bit_generator.random_raw(2).tolist() == [1707325541862686270, 16313027572328560223]
